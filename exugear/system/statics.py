"""States in balance: the output locked under load, the start of a run; equations of motion linearised about a state.

Both are Newton solutions of the assembly's own forces; elastic deflections are small against the geometry, so
that a few steps reach round-off.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import scipy.linalg

from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.contact import LEAST_SHOULDER
from exugear.system.bearings.stiffness import holds_one_way
from exugear.system.bodies.turning_frame import TurningBody
from exugear.system.diagrams import draw_misalignment
from exugear.system.kernels.connectors import add_connector_stiffness, connector_tangents
from exugear.system.kernels.coordinates import SpringArrays, add_spring_forces
from exugear.system.kernels.meshes import FORCE, OUTSIDE, MeshArrays
from exugear.system.kernels.modal_damping import modal_matrix
from exugear.system.kernels.table_law import GUESSED
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DIFFERENCE_STEP = 1e-6
"""Step of central differences, m or rad, and per second."""
ROLLING_STEP = 1e-8
"""The same for rows of rolling elements: a thousandth of what these yield under load, which bends their law."""
RIGID_BODY_LIMIT = 0.1
"""Modes below this frequency (Hz) are motions of the whole train without deflection."""


@dataclass(frozen=True)
class Linearised(ReprMixin, line=": {mass!n} coordinates, {stiffness!n} elements"):
    """Mass, and stiffness and damping by element, about a state; each matrix (size, size)."""

    mass: Floats
    stiffness: Mapping[str, Floats]
    damping: Mapping[str, Floats]
    """Element name -> matrix; elements are meshes, bearings, couplings, elastic bodies."""
    modal: Floats
    """Modal damping, which belongs to no element."""

    @property
    def total_stiffness(self) -> Floats:
        """Sum over all elements."""
        return sum(self.stiffness.values(), start=np.zeros_like(self.mass))

    @property
    def total_damping(self) -> Floats:
        """Sum over all elements, and modal damping."""
        return sum(self.damping.values(), start=self.modal)


def linearise(assembly: Assembly, q: Floats, meshes: MeshArrays | None = None) -> Linearised:
    """Matrices about the coordinates q at rest, mesh stiffness averaged over the cycle or that of other `meshes`."""
    stiffness: dict[str, Floats] = {}
    damping: dict[str, Floats] = {}
    rest = np.zeros(assembly.size)
    averaged = assembly.mean_meshes if meshes is None else meshes
    for n, name in enumerate(assembly.mesh_names):
        jq, jv = assembly.mesh_jacobians(q, rest, averaged.one(n))
        stiffness[name], damping[name] = -jq, -jv
    of_connectors = connector_tangents(q, _connector_steps(assembly), assembly.connectors)
    for name, tangents in zip(assembly.connector_names, of_connectors, strict=True):
        stiffness[name], damping[name] = tangents
    for n, name in enumerate(assembly.spring_names):
        spring = SpringArrays._make(values[n : n + 1] for values in assembly.springs)
        stiffness[name], damping[name] = _tangents(assembly.size, q, spring, add_spring_forces)
    for name, of_body in assembly.elastic_slices.items():
        if name in assembly.turning:
            turning = (of_body, assembly.turning[name])
            stiffness[f"{name}_body"], damping[f"{name}_body"] = _tangents(
                assembly.size, q, turning, _add_turning_forces
            )
            continue
        matrix = np.zeros((assembly.size,) * 2)
        matrix[of_body, of_body] = assembly.elastic_bodies[name].reduced.stiffness
        stiffness[f"{name}_body"] = matrix
        damping[f"{name}_body"] = assembly.damping_time(name) * matrix
    return Linearised(assembly.mass_at(q), stiffness, damping, modal_matrix(q, assembly.modal))


def tangent_stiffness(assembly: Assembly, q: Floats, meshes: MeshArrays) -> Floats:
    """Stiffness (size, size) of all elements together about the coordinates q at rest.

    The sum over the elements of `linearise`, where no single one is asked for: a tenth of its time with elastic bodies.
    """
    rest = np.zeros(assembly.size)
    stiffness = -assembly.mesh_jacobians(q, rest, meshes)[0]
    add_connector_stiffness(q, _connector_steps(assembly), assembly.connectors, stiffness)
    for i, (first, second) in enumerate(assembly.springs.coordinates):
        for one, other in ((first, second), (second, first)):
            stiffness[one, one] += assembly.springs.stiffness[i]
            stiffness[one, other] -= assembly.springs.stiffness[i]
    for name, of_body in assembly.elastic_slices.items():
        if name not in assembly.turning:
            stiffness[of_body, of_body] += assembly.elastic_bodies[name].reduced.stiffness
            continue
        body = assembly.turning[name]
        place = q[of_body]
        still = rest[of_body]
        steps = DIFFERENCE_STEP * np.eye(len(place))
        columns = [body.forces(place - e, still) - body.forces(place + e, still) for e in steps]
        stiffness[of_body, of_body] += np.array(columns).T / (2.0 * DIFFERENCE_STEP)
    return np.asarray(stiffness)


def _connector_steps(assembly: Assembly) -> Floats:
    """Step of the differences that fits each connector."""
    rows = np.diff(assembly.connectors.rolling.first)
    return np.where(rows > 0, ROLLING_STEP, DIFFERENCE_STEP)


def _add_turning_forces(q: Floats, v: Floats, element: tuple[slice, TurningBody], f: Floats) -> None:
    of_body, body = element
    f[of_body] += body.forces(q[of_body], v[of_body])


def _tangents(
    size: int, q: Floats, element: Any, add: Callable[[Floats, Floats, Any, Floats], None]
) -> tuple[Floats, Floats]:
    """Stiffness and damping matrices of one element by central differences of its force."""

    def force(dq: Floats, v: Floats) -> Floats:
        f = np.zeros(size)
        add(q + dq, v, element, f)
        return f

    zero = np.zeros(size)
    steps = DIFFERENCE_STEP * np.eye(size)
    # Columns; a force falls with stiffness times displacement: hence minus ahead of plus.
    stiffness = np.array([force(-e, zero) - force(e, zero) for e in steps]).T / (2.0 * DIFFERENCE_STEP)
    damping = np.array([force(zero, -e) - force(zero, e) for e in steps]).T / (2.0 * DIFFERENCE_STEP)
    return stiffness, damping


MOST_NEWTON_STEPS = 30
"""Steps after which the search for a balance is given up."""
LARGEST_RESIDUAL = 1e-9
"""Share of the load at which a residual that stops falling is round-off."""
ROUNDINGS = 10.0
"""Times that places near 1 m are rounded on their way to a force."""
EASING_SHARES = (0.1, 1e-3, 0.0)
"""Shares of the stiffness of nonlinear bearings added to their rows, one search after the other."""
HOLDING_SHARES = (1e-6, 1e-4, 1e-2)
"""The same in Newton's matrix alone, each where the one before fails: it holds bearings that carry nothing."""
CLOSING_SHARES = (1.0, 0.1, 1e-2, 1e-3, 1e-5, 0.0)
"""Shares of the stiffness of linear teeth added to tables, where separated teeth have no stiffness."""
SHORTEST_STEP = 1e-4
"""Share of a step of Newton's method to which it is halved while it does not lower the residual."""
LONGEST_TURN = 0.02
"""Longest step, rad, in which a train is rolled to an angle."""


class BalanceError(RuntimeError):
    """No state in balance was found."""


@dataclass(frozen=True, eq=False)
class _Beside:
    """Linear teeth in parallel with a mesh model, scaled by a share of their stiffness."""

    share: float
    meshes: MeshArrays

    def forces(self, assembly: Assembly, q: Floats) -> Floats:
        return np.asarray(self.share * assembly.mesh_forces(q, np.zeros(assembly.size), self.meshes))

    def stiffness(self, assembly: Assembly, q: Floats) -> Floats:
        return np.asarray(-self.share * assembly.mesh_jacobians(q, np.zeros(assembly.size), self.meshes)[0])


class _Solve(Protocol):
    """Equilibrium search of an assembly, with other meshes than its own or with linear ones in parallel."""

    def __call__(
        self, assembly: Assembly, start: Floats, meshes: MeshArrays | None, beside: _Beside | None = None
    ) -> Floats: ...


@dataclass(frozen=True)
class StartState(ReprMixin, line=": {q!n} coordinates, drive torque {drive_torque:.4g} N m"):
    """Coordinates and velocities at the start of a run, with the spin rates (rad/s2) it starts with."""

    q: Floats
    v: Floats
    """(size,) coordinates and velocities."""
    rates: Mapping[str, float]
    """Spin rate by body, rad/s2."""
    drive_torque: float
    """Torque that the driven body takes, N m; 0 where none is driven."""


def _newton(
    residual: Callable[[Floats], Floats],
    derivative: Callable[[Floats], Floats],
    start: Floats,
    scale: Floats,
    what: str,
) -> Floats:
    """Newton's method until the residual stops falling; steps that would enlarge it are shortened.

    `derivative` is that of the residual, a matrix; `scale` is the size of each residual that counts as one. Being
    small against the loads ends nothing: a train near balance accelerates with a ten-thousandth of them. Residuals are
    sums of spring forces, and rounding of places near 1 m is what these cannot resolve: under a small load that is
    more of it than under a large one, and no step can make it less.
    """
    x = start
    solution = start
    best = np.inf
    rounded = False
    if not x.size:
        return x
    rounding = np.zeros_like(x)
    r = residual(x)
    for _ in range(MOST_NEWTON_STEPS):
        error = _size(r, scale)
        if not np.isfinite(error):
            break
        stalled = error > 0.5 * best
        if error < best:
            solution = x
            best = error
            rounded = bool(np.all(np.abs(r) <= rounding))
        small = best < LARGEST_RESIDUAL or rounded
        if error == 0.0 or (stalled and small):
            return solution
        matrix = derivative(x)
        rounding = np.abs(matrix) @ np.full(x.size, ROUNDINGS * np.finfo(float).eps)
        step = _solved(matrix / scale[:, None], -r / scale)
        if step is None:
            raise BalanceError(f"{what}: the stiffness matrix is singular; a body may move without resistance")
        # Rollers that touch and part bend the residual: a whole step may lead away from the balance.
        share = 1.0
        ahead = residual(x + step)
        while not small and share > SHORTEST_STEP and not _size(ahead, scale) < error:
            share *= 0.5
            ahead = residual(x + share * step)
        x = x + share * step
        r = ahead
    raise BalanceError(f"{what}: static equilibrium not found, the residual remains at {best:.2e} of the load")


def _size(residual: Floats, scale: Floats) -> float:
    return float(np.max(np.abs(residual) / scale))


def _solved(matrix: Floats, right_hand_side: Floats) -> Floats | None:
    """Solution of linear equations, None where the matrix is singular to working precision."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", scipy.linalg.LinAlgWarning)
            return np.asarray(scipy.linalg.solve(matrix, right_hand_side), dtype=np.float64)
    except (scipy.linalg.LinAlgError, scipy.linalg.LinAlgWarning):
        return None


def locked_equilibrium(
    assembly: Assembly,
    torques: Mapping[str, float],
    locked: Sequence[str],
    meshes: MeshArrays | None = None,
    about: Floats | None = None,
    other_loads: Floats | None = None,
    near: Floats | None = None,
) -> Floats:
    """Solve for the static coordinates under torques (N m) with some spins held at zero.

    Parameters
    ----------
    torques : mapping of body name to torque about +z, N m
    locked : names of the bodies whose spins are held; where they leave the gear train free to rotate and the torques
        are in balance, it keeps its position
    meshes : mesh arrays to use instead of the assembly's, such as its `mean_meshes`
    about : (size,) coordinates of the gear train rotated to another position, at which spins are held instead of zero
    other_loads : (size,) generalized forces in addition to the torques, N and N m
    near : (size,)
        Coordinates from which the search begins, such as those under a similar load; by default it begins with linear
        bearings and teeth, also if the search from these coordinates fails.

    Raises
    ------
    BalanceError
        The structure is free to move, or Newton's method does not converge.
    """
    held = [assembly.spin[name] for name in _held(assembly, torques, locked)]
    free = assembly.motions @ scipy.linalg.null_space(assembly.motions[held])
    applied = assembly.torque_vector(torques) + (0.0 if other_loads is None else other_loads)
    rest = np.zeros(assembly.size)
    loads = np.append(applied, assembly.constant_forces)
    origin = rest if about is None else about

    def solve(assembly: Assembly, start: Floats, meshes: MeshArrays | None, beside: _Beside | None = None) -> Floats:
        def residual(x: Floats) -> Floats:
            aid = 0.0 if beside is None else beside.forces(assembly, origin + free @ x)
            return free.T @ (assembly.forces(origin + free @ x, rest, meshes) + aid + applied)

        def derivative(held: Assembly, x: Floats) -> Floats:
            stiffness = tangent_stiffness(held, origin + free @ x, held.meshes if meshes is None else meshes)
            if beside is not None:
                stiffness = stiffness + beside.stiffness(held, origin + free @ x)
            return np.asarray(-free.T @ stiffness @ free)

        def search(share: float) -> Floats:
            held = assembly.with_added_stiffness(share)
            scale = np.full(start.size, _load_scale(loads))
            return _newton(residual, partial(derivative, held), start, scale, "static state")

        *shares, last = HOLDING_SHARES if assembly.has_rows else HOLDING_SHARES[:1]
        for share in shares:
            with suppress(BalanceError):
                return search(share)
        return search(last)

    if near is not None:
        with suppress(BalanceError):
            q = np.asarray(origin + free @ solve(assembly, free.T @ (near - origin), meshes))
            _check_shoulders(assembly, q)
            return q
    x = _from_linear(assembly, np.zeros(free.shape[1]), lambda x: np.asarray(origin + free @ x), solve, meshes)
    q = np.asarray(origin + free @ x)
    _check_shoulders(assembly, q)
    return q


def _check_shoulders(assembly: Assembly, q: Floats) -> None:
    """Refuse bearings with a contact angle that balls hold on the side of the groove without a shoulder.

    Grooves of balls hold in both directions; those of angular contact bearings end where the contact angle changes its
    sign. Rollers have no equilibrium there.
    """
    loads = assembly.support_loads_at_rest(q)
    has_rows = np.diff(assembly.connectors.rolling.first) > 0
    for support, load, rolling in zip(assembly.supports, loads, has_rows, strict=True):
        if not rolling or support.catalogue is None:
            continue
        rows = catalogue_rows(support.catalogue)
        if not holds_one_way(rows):
            continue
        axial = float(load[2])
        least = LEAST_SHOULDER * float(np.linalg.norm(load[:3]))
        towards = math.copysign(1.0, rows[0].contact_angle)
        if towards * axial >= least:
            continue
        sense = {1.0: "+z", -1.0: "-z"}
        what = f"a load of {1e-3 * abs(axial):.4g} kN towards {sense[-towards]}"
        if abs(axial) < least:
            what = "a radial load without the axial load that its contact angle requires"
        raise BalanceError(
            f"static equilibrium not found: bearings.{support.name} holds its body against loads towards "
            f"{sense[towards]} only, and has {what}"
        )


def rolled_coordinates(assembly: Assembly, body: str, angle: float) -> Floats:
    """Coordinates of a rigid train rolled until a body has turned by an angle (rad), (size,).

    Notes
    -----
    Velocities of rolling are integrated by the classical Runge-Kutta method: planets go round in a circle to 1e-9.
    """
    speeds = assembly.gearbox.train.rolling_speeds(body, 1.0)
    steps = math.ceil(abs(angle) / LONGEST_TURN)
    q = np.zeros(assembly.size)
    for _ in range(steps):
        h = angle / steps
        first = assembly.rolling_velocity(q, speeds)
        second = assembly.rolling_velocity(q + 0.5 * h * first, speeds)
        third = assembly.rolling_velocity(q + 0.5 * h * second, speeds)
        fourth = assembly.rolling_velocity(q + h * third, speeds)
        q = q + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
    return q


@dataclass(frozen=True)
class StaticState(ReprMixin):
    """A variant at rest under the static load of its gearbox file, mesh stiffness at its mean over the cycle."""

    assembly: Assembly
    q: Floats
    """(size,) coordinates, m and rad."""

    @property
    def centre_distance(self) -> Floats:
        """Centre distance of each mesh, m."""
        return np.asarray(self.assembly.gear_positions(self.q)[:, 0])

    @property
    def misalignment(self) -> Floats:
        """Misalignment of each mesh, rad."""
        return np.asarray(self.assembly.gear_positions(self.q)[:, 1])

    @property
    def mesh_force(self) -> Floats:
        """Transverse force F_bt of each mesh on the line of action, N; positive, the loaded flank pushes."""
        states = self.assembly.mesh_states(self.q, np.zeros_like(self.q), self.assembly.mean_meshes)
        return np.asarray(states[:, FORCE])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the misalignment of each mesh as a bar, in mrad, as `exugear bearings` lists it.

        Parameters
        ----------
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Examples
        --------
        >>> from exugear import Choice, Gearbox, assemble, mesh_stiffness, static_state, template
        >>> import tomllib
        >>> gearbox = Gearbox.from_dict(tomllib.loads(template("parallel")))
        >>> choice = Choice("bushing", "iso6336")
        >>> ax = static_state(assemble(gearbox, choice, mesh_stiffness(gearbox, "iso6336"))).plot()
        >>> [label.get_text() for label in ax.get_yticklabels()], ax.get_xlabel()
        (['stage_1', 'stage_2'], 'Misalignment / mrad')
        """
        return draw_misalignment(self.assembly.mesh_names, self.misalignment, ax)

    def _line(self) -> str:
        meshes = zip(self.assembly.mesh_names, 1e6 * self.misalignment, strict=True)
        tilts = ", ".join(f"{mesh} {tilt:.0f}" for mesh, tilt in meshes)
        return f" of {self.assembly.variant}: misalignment in rad / 1e6: {tilts}"


def static_state(assembly: Assembly) -> StaticState:
    """Rest under the static load of the gearbox file, its locked bodies held; catalogue bearings follow their rows.

    The assembly of the state is that with these rows.

    Raises
    ------
    BalanceError
        The structure is free to move, or Newton's method does not converge.

    Examples
    --------
    >>> from exugear.system.build import assemble
    >>> from exugear.gearbox.choice import Choice
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> state = static_state(assemble(gearbox, Choice("rigid"), stiffness))
    >>> bool((state.mesh_force > 0.0).all())
    True
    """
    gearbox = assembly.gearbox
    resting = assembly.at_rest
    if not assembly.known_rest:
        torques = gearbox.case.static_load.torques_N_m
        assembly.known_rest.append(locked_equilibrium(resting, torques, gearbox.locked, resting.mean_meshes))
    return StaticState(resting, assembly.known_rest[0].copy())


def meshes_near_unconverged(assembly: Assembly) -> tuple[str, ...]:
    """Meshes whose table is read next to states that have not converged, at static load; see `SteSurface.guessed`."""
    if not any(
        element.table is not None and element.table.surface.guessed is not None for element in assembly.elements
    ):
        return ()
    state = static_state(assembly)
    read = assembly.mesh_states(state.q, np.zeros_like(state.q), assembly.mean_meshes)[:, OUTSIDE]
    return tuple(name for name, how in zip(assembly.mesh_names, read, strict=True) if how == GUESSED)


def _held(assembly: Assembly, torques: Mapping[str, float], locked: Sequence[str]) -> list[str]:
    """Bodies to hold so that the train cannot roll: the locked ones, then such as carry no torque by being held.

    Raises
    ------
    BalanceError
        The locked bodies leave the train free to roll, and the torques would make it.
    """
    gearbox = assembly.gearbox
    held = list(locked)
    rolling = gearbox.train.kinematic_modes
    row = gearbox.spinning.index
    free = rolling @ scipy.linalg.null_space(rolling[[row(name) for name in held]]) if held else rolling
    applied = np.array([torques.get(name, 0.0) for name in gearbox.spinning])
    if free.size and np.abs(free.T @ applied).max() > 1e-9 * np.abs(applied).max():
        raise BalanceError(f"static state: locking {', '.join(locked) or 'nothing'} does not balance the torques")
    overall = gearbox.case.overall
    for name in (overall.input, overall.output, *gearbox.spinning):
        rank = np.linalg.matrix_rank(rolling[[row(other) for other in held]]) if held else 0
        if np.linalg.matrix_rank(rolling[[row(other) for other in (*held, name)]]) > rank:
            held.append(name)
    return held


def _from_linear(
    assembly: Assembly,
    start: Floats,
    to_coordinates: Callable[[Floats], Floats],
    solve: _Solve,
    meshes: MeshArrays | None,
) -> Floats:
    """Solve for linear bearings and teeth, then change to their own models step by step.

    Separated rows of rolling elements have no stiffness, nor have table flanks: the search begins with contact. Under a
    small load linear teeth do not close the gap between table flanks: then they act in parallel with decreasing
    stiffness, so that the flanks are in contact before the linear teeth are removed.
    """
    linear = assembly.with_linear_supports()
    x, teeth = _touching(linear, start, to_coordinates, solve)
    try:
        x = solve(linear, x, meshes)
    except BalanceError:
        if teeth is None:
            raise
        for share in CLOSING_SHARES:
            x = solve(linear, x, meshes, _Beside(share, teeth) if share else None)
    for share in EASING_SHARES if assembly.has_rows else ():
        x = solve(assembly.with_added_stiffness(share), x, meshes)
    return x


def _touching(
    assembly: Assembly,
    start: Floats,
    to_coordinates: Callable[[Floats], Floats],
    solve: _Solve,
) -> tuple[Floats, MeshArrays | None]:
    """Begin where linear teeth would be, on the flanks that they press; these teeth, where they may part."""
    if not LAWS[assembly.mesh_model].loses_contact:
        curved = any(element.is_curved for element in assembly.elements)
        return (solve(assembly, start, assembly.linear_meshes()) if curved else start), None
    teeth = assembly.linear_meshes()
    x = solve(assembly, start, teeth)
    q = to_coordinates(x)
    reversed_flanks = assembly.mesh_states(q, np.zeros_like(q), teeth)[:, FORCE] < 0.0
    if reversed_flanks.any():
        teeth = assembly.linear_meshes(reversed_flanks)
        x = solve(assembly, x, teeth)
    return x, teeth


def _load_scale(applied: Floats) -> float:
    """Size of the loads (N or N m, at least 1) that residuals are measured by."""
    return max(1.0, float(np.abs(applied).max(initial=0.0)))


def accelerating_start(
    assembly: Assembly,
    torques: Mapping[str, float],
    speeds: float | Mapping[str, float] = 0.0,
    driven: tuple[str, float] | None = None,
) -> StartState:
    """State that rolls with a uniform acceleration, deflections in balance with loads and inertia forces.

    Parameters
    ----------
    torques : mapping of body name to torque about +z, N m
    speeds : float, or mapping of body name to float
        Speed of the overall input, rad/s, from which all others follow by rolling; or of several bodies, as
        `exugear.gearbox.train.Train.rolling` takes them.
    driven : (body, spin rate) a body whose spin rate (rad/s2) is prescribed; the torque that this takes is solved for

    Raises
    ------
    BalanceError
        As `locked_equilibrium`.
    """
    train = assembly.gearbox.train
    speeds = train.rolling(speeds if isinstance(speeds, Mapping) else {train.input: speeds})
    applied = assembly.torque_vector(torques)
    pinned = [assembly.spin[name] for name in train.independent]
    direction = np.zeros(assembly.size)
    if driven is not None:
        direction[assembly.spin[driven[0]]] = 1.0
    size = _load_scale(applied)
    motions = assembly.motions
    modes = train.kinematic_modes
    # Unknown: deflections, the acceleration in each way to roll, and the torque of a drive.
    unknown = motions.shape[1] + modes.shape[1]

    def split(x: Floats) -> tuple[Floats, dict[str, float], float]:
        rates = dict(zip(train.spins, (modes @ x[motions.shape[1] : unknown]).tolist(), strict=True))
        return motions @ x[: motions.shape[1]], rates, 0.0 if driven is None else size * float(x[-1])

    def solve(assembly: Assembly, start: Floats, meshes: MeshArrays | None, beside: _Beside | None = None) -> Floats:
        def residual(x: Floats) -> Floats:
            q, rates, torque = split(x)
            v = assembly.rolling_velocity(q, speeds)
            needed = assembly.inertia_forces(q, v, assembly.rolling_acceleration(q, speeds, rates))
            unbalanced = assembly.forces(q, v, meshes) + applied + torque * direction - needed
            if beside is not None:
                unbalanced = unbalanced + beside.forces(assembly, q)
            off = [] if driven is None else [size * (rates[driven[0]] - driven[1])]
            return np.concatenate([motions.T @ unbalanced, size * q[pinned], off])

        def derivative(x: Floats) -> Floats:
            # At rest: what velocities add to the stiffness is small against it, and costs no more than a step or two.
            stiffness = tangent_stiffness(assembly, split(x)[0], assembly.meshes if meshes is None else meshes)
            if beside is not None:
                stiffness = stiffness + beside.stiffness(assembly, split(x)[0])
            matrix = np.zeros((x.size, x.size))
            bends = motions.shape[1]
            matrix[:bends, :bends] = -motions.T @ stiffness @ motions
            matrix[bends : bends + len(pinned), :bends] = size * motions[pinned]
            # The residual is linear in the last unknowns, accelerations and a torque: no step is too long for them.
            for n, e in enumerate(np.eye(x.size)[bends:], start=bends):
                matrix[:, n] = 0.5 * (residual(x + e) - residual(x - e))
            return matrix

        return _newton(residual, derivative, start, np.full(start.size, size), "start of the run")

    start = np.zeros(unknown + (driven is not None))
    x = _from_linear(assembly, start, lambda x: split(x)[0], solve, None)
    q, rates, torque = split(x)
    return StartState(q, assembly.rolling_velocity(q, speeds), rates, torque)
