"""Steady-state response at constant speed: unknowns, equation and solution, in the order in which to read the modules.

**Averaged system** (`mean_system.rotating_frame`, `mean_system.mean_system`): in multi-blade coordinates u, the gearbox
has constant matrices, M u'' + C(W) u' + K(W) u = forces, at the speed W of the input.

**Unknowns** (`mean_system.mesh_places`, `balance.interface.Interface`): for every order k with the angular frequency
w_k, the inputs y_k of the mesh models: deflection, and where the model needs them centre distance, misalignment and
position in the mesh cycle. The orders are the integer combinations of the mesh frequencies (`harmonics.lines`).

**Equation** (`balance.response`): meshes act with forces F in addition to those of their mean stiffness, which is in K.
With the compliance G(w_k) of the averaged system at the interface (`balance.model.HarmonicBalanceModel.at`),

    y_k = y_static [k = 0] - G(w_k) F_k(y).

**Methods** (`balance`), by what F is:

- `linear` (`response.linear_response`): the static transmission error under the mean force; F does not depend on y.
- `parametric` (`response.parametric_response`): the tangent stiffness over the mesh cycle; F is linear in y.
- `nonlinear` (`nonlinear.HarmonicResidual`): the models of teeth and bearings, sampled in time.

Stiffness that varies as the carrier turns, by a flexible ring gear or by planets that are not alike, couples orders
beside each other (`balance.passing_planets`), of which those that matter are kept (`balance.neighbours`).

**Solution** (`point_solver.PointSolver.response`): directly, by GMRES, or by Newton's method, at one speed.
`steady_response` chooses the speeds, `damping_band` solves the highest peaks for other damping, and `steady_file` keeps
the result.
"""
