"""Friction of the teeth in runs, in a plain version and one for loops over time.

Under the mesh force F, friction has the force and moments F mu times those of
`fe_ste.transmission_error.sliding.friction_over_cycle`, which are periodic functions of the position in the mesh cycle.
They act along the rows of `exugear.system.tooth_mesh.placement.friction_rows` against the sliding of gear 1 on gear 2:

    f = -abs(F) mu w / sqrt(w^2 + w_0^2)  sum_p part_p(pmc) row_p,    w = spin_1 - spin_2

The smooth change of sign around standstill stands for the transition from sliding to rolling; w_0 is the speed at which
the flanks slide with `SLOW_SLIDING` one base pitch away from the pitch point. Statics and modes have no friction.
"""

from __future__ import annotations

import math

from exugear.system.kernels.coordinates import COSINE, SINE
from exugear.system.kernels.cubics import cubic, piece_of
from exugear.system.kernels.meshes import (
    DEFLECTION_ROW,
    FORCE,
    FRAME,
    FRICTION,
    FRICTION_POWER,
    FRICTION_ROW,
    ROW_SIZE,
    SPIN_1,
    SPIN_2,
    MeshArrays,
    Meshes,
    MeshWork,
    frame_row,
    mesh_pmc,
    push_apart,
    relative_spin,
    row_dot,
    row_motion,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel

FRICTION_PARTS = 3
"""Force across the line of action, moment about the gear axes, moment about the line of action."""
SLOW_SLIDING = 1e-3
"""Sliding speed above which friction has its full size, m/s."""


@kernel
def friction_part(part: int, coefficients: Floats, pieces: int, pmc: float) -> float:
    """One of the force and moments per unit mesh force at a position in the mesh cycle; coefficients (p, 12)."""
    piece, t = piece_of(pmc, pieces)
    c = coefficients[piece, 4 * part :]
    return cubic(c[0], c[1], c[2], c[3], t)[0]


@kernel
def friction_size(force: float, sliding: float, slow: float) -> float:
    """Size of friction (N) per unit of its parts, negative if gear 1 turns faster than gear 2; speeds in rad/s."""
    return -abs(force) * sliding / math.sqrt(sliding * sliding + slow * slow)


@kernel
def add_friction(
    q: Floats,
    v: Floats,
    m: int,
    meshes: MeshArrays,
    gradient: Floats,
    turning: Floats,
    out: Floats,
    acting: Floats,
) -> None:
    """Add the friction of mesh m to its negative generalized force (13,), given its state as in `mesh_state`.

    `gradient` and `turning` (13,) are memory.
    """
    out[FRICTION_POWER] = 0.0
    if meshes.friction_pieces[m] == 0:
        return
    index = meshes.coordinates[m]
    sliding = relative_spin(v, index, 0) - relative_spin(v, index, 1)
    size = friction_size(out[FORCE], sliding, meshes.friction_speed[m])
    pmc = mesh_pmc(q, m, meshes)
    for part in range(FRICTION_PARTS):
        force = size * friction_part(part, meshes.friction[m], meshes.friction_pieces[m], pmc)
        frame_row(q, index, meshes.axis[m], meshes.friction_rows[m, part], gradient, turning)
        out[FRICTION_POWER] -= force * row_dot(index, gradient, v)
        for i in range(ROW_SIZE):
            acting[i] -= force * gradient[i]


@kernel
def add_friction_loads(q: Floats, v: Floats, m: int, meshes: Meshes, work: MeshWork) -> None:
    """Add the friction of mesh m, whose force was evaluated before, to the loads of a loop over time."""
    if meshes.arrays.friction_pieces[m] == 0:
        return
    index = meshes.coordinates[m]
    state = work.mesh.states[m]
    i = index[SPIN_1]
    j = index[SPIN_2]
    k = index[FRAME]
    size = friction_size(state[FORCE], v[i] - v[j], meshes.arrays.friction_speed[m])
    pmc = meshes.arrays.phase[m] + meshes.arrays.cycles[m] * (q[i] - q[k])
    state[FRICTION] = size * friction_part(0, meshes.arrays.friction[m], meshes.arrays.friction_pieces[m], pmc)
    state[FRICTION_POWER] = 0.0
    gradient = work.mesh.gradients[DEFLECTION_ROW]
    c = work.turns[meshes.slot[m], COSINE]
    s = work.turns[meshes.slot[m], SINE]
    for part in range(FRICTION_PARTS):
        force = size * friction_part(part, meshes.arrays.friction[m], meshes.arrays.friction_pieces[m], pmc)
        if meshes.spinning[m] == 1:
            torque_1 = force * meshes.arrays.friction_rows[m, part, SPIN_1]
            torque_2 = force * meshes.arrays.friction_rows[m, part, SPIN_2]
            work.force[i] += torque_1
            work.force[j] += torque_2
            work.force[k] -= torque_1 + torque_2
            rate = meshes.arrays.friction_rows[m, part, SPIN_1] * (v[i] - v[k])
            rate += meshes.arrays.friction_rows[m, part, SPIN_2] * (v[j] - v[k])
        else:
            _, rate = row_motion(m, FRICTION_ROW + part, q[k], v[k], c, s, meshes, work.places, gradient)
            push_apart(m, -force, gradient, meshes, work)
        state[FRICTION_POWER] -= force * rate
