"""Static balance of a variant over torques and carrier angles: loads of meshes and bearings.

For fatigue, the static balance is sufficient, because the torque of a turbine varies far below the first natural
frequency of a gearbox. Linear models are solved once per angle and scaled. Nonlinear models are solved at some torques,
with linear interpolation of forces between them.

A table of one load is valid for aligned gears. Where contact is solved at the static misalignment, stresses are from
separate tables: over the loads of the life, and over misalignments from aligned to beyond the static ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from exugear.gearbox.parts import node_position
from exugear.gearbox.units import MM
from exugear.gearbox.variant import VariantError
from exugear.life.load_spectrum.counted import CountedLoads
from exugear.life.load_spectrum.counting import LoadPoints
from exugear.system.kernels.coordinates import BODY_SIZE
from exugear.system.kernels.meshes import FORCE, OUTSIDE
from exugear.system.operating_points import contact_places
from exugear.system.statics import BalanceError, locked_equilibrium, rolled_coordinates, static_state
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.tables import TableRequest, requested_tables
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.stores import Arrays, Store
from fe_ste.transmission_error.table import MeshTable, TableError, TableInput

TORQUE_SHARES = (0.1, 0.25, 0.5, 0.75, 1.0)
"""Fractions of the largest torque at which nonlinear models are solved."""


@dataclass(frozen=True, eq=False)
class BalanceResponse:
    """Result of the balance over torques and angles, and its change by rotor loads."""

    values: Floats
    """(t, a, ...) at the torques of the balance without rotor loads."""
    by_hub: Floats | None = None
    """(t, 5, a, ...) change per unit of each rotor load."""

    def of(self, number: int) -> BalanceResponse:
        """Return the response of one bearing, by its index on the axis after the angles."""
        return BalanceResponse(self.values[:, :, number], None if self.by_hub is None else self.by_hub[:, :, :, number])


@dataclass(frozen=True, eq=False)
class StaticBalance(ReprMixin, line=": {torque!n} torques, {angle!n} angles, linear: {linear}"):
    """Forces over torques and angles."""

    torque: Floats
    angle: Floats
    """(t,) torque on the loaded body, N m, ascending, without zero; (a,) angle of the carrier, rad."""
    mesh_force: BalanceResponse
    misalignment: BalanceResponse
    """(t, a, meshes) F_bt, N, positive on the flank of the static load; misalignment on the tables' flank, rad."""
    bearing_load: BalanceResponse
    """(t, a, bearings, 6) force and moment of the shaft on the inner ring, in the axes of the supporting body, N
    and N m."""
    bearing_tilt: BalanceResponse
    """(t, a, bearings, 2) tilt of the inner relative to the outer ring in the same axes, rad."""
    linear: bool
    """Whether all results are proportional to the loads."""
    outside: tuple[str, ...] = ()
    """Meshes whose load, centre distance or misalignment is outside the range of their table in any state, where it is
    extrapolated linearly."""
    loaded_at_rest: bool = False
    """Whether weight or constant forces act, which load meshes and bearings without torque as well."""

    def at(self, response: BalanceResponse, torque: Floats, hub: Floats | None = None) -> Floats:
        """Return the values of a response at torques (n,) and rotor loads (n, 5): (n, a, ...).

        Values per torque are interpolated linearly between solved torques of the same sign. Loads of weight and of
        constant forces are not proportional to torque and are left out of them: values without torque, extrapolated
        from the two smallest torques of that sign.
        """
        rest = self._without_torque(response.values)
        per_torque = (response.values - rest) / _like(self.torque, response.values)
        found = self._interpolate_torque(per_torque, torque)
        found *= _like(torque, found)
        if self.loaded_at_rest:
            found += self._interpolate_torque(rest, torque)
        if hub is not None and response.by_hub is not None and hub.any():
            slopes = self._interpolate_torque(response.by_hub, torque)
            found += np.einsum("nh,nh...->n...", hub, slopes)
        return found

    def _without_torque(self, values: Floats) -> Floats:
        """Extrapolate values (t, ...) of each sign of the torque to zero torque: (t, ...)."""
        found = np.zeros_like(values)
        for sign in (1.0, -1.0) if self.loaded_at_rest else ():
            own = np.flatnonzero(np.sign(self.torque) == sign)
            if own.size:
                first, second = own[np.argsort(np.abs(self.torque[own]))[:2]]
                slope = (values[second] - values[first]) / (self.torque[second] - self.torque[first])
                found[own] = values[first] - self.torque[first] * slope
        return found

    def _interpolate_torque(self, values: Floats, torque: Floats) -> Floats:
        """Interpolate values (t, ...) at torques (n,): (n, ...)."""
        found = np.zeros((len(torque), *values.shape[1:]))
        for sign in (1.0, -1.0):
            wanted = torque >= 0.0 if sign > 0.0 else torque < 0.0
            same_sense = np.sign(self.torque) == sign
            if not same_sense.any():
                same_sense = ~same_sense  # linear models are solved at one torque, of either sign
            flat = values[same_sense].reshape(int(same_sense.sum()), -1)
            inside = np.array([np.interp(torque[wanted], self.torque[same_sense], column) for column in flat.T]).T
            found[wanted] = inside.reshape(-1, *values.shape[1:])
        return found

    def load_sharing(self, meshes: Sequence[int], torque: Floats | None = None, hub: Floats | None = None) -> float:
        """Return K_gamma of the meshes of a family, over all angles.

        Parameters
        ----------
        torque, hub : (n,), (n, 5) torques and rotor loads; by default the largest torque alone

        Returns
        -------
        largest force over the mean force at the same torque without rotor loads
        """
        if torque is None:
            torque = self.torque[[np.abs(self.torque).argmax()]]
        names = list(meshes)
        forces = np.abs(self.at(self.mesh_force, torque, hub)[..., names]).max(axis=(1, 2))
        worst = int(forces.argmax())
        mean = float(np.abs(self.at(self.mesh_force, torque[[worst]])[..., names]).mean())
        return float(forces[worst]) / mean if mean else 1.0


class States(NamedTuple):
    """Stored static states (...): at one angle over torques and rotor loads; the first has no rotor load."""

    force: Floats
    misalignment: Floats
    """(..., meshes)"""
    load: Floats
    tilt: Floats
    """(..., bearings, 6), (..., bearings, 2)"""
    outside: Floats
    """(..., meshes) 1 where load, centre distance or misalignment is outside the table."""

    @classmethod
    def of(cls, assembly: Assembly, q: Floats) -> States:
        """Extract them from static coordinates (size,)."""
        meshes = assembly.mesh_states(q, np.zeros_like(q), assembly.mean_meshes)
        flanks = np.array([element.flank for element in assembly.elements])
        tilts = flanks * assembly.gear_positions(q)[:, 1]
        return cls(meshes[:, FORCE], tilts, *_inner_rings(assembly, q), meshes[:, OUTSIDE])


def _like(weights: Floats, values: Floats) -> Floats:
    """Reshape weights of the first axis for multiplication with values."""
    return weights.reshape(-1, *(1,) * (values.ndim - 1))


class AngleStore(Protocol):
    """Storage of solved carrier angles, from which an interrupted computation resumes."""

    def stored(self, number: int) -> States | None:
        """Return the states of an angle by its index; None if not stored."""

    def store(self, number: int, states: States) -> None:
        """Store the states of an angle."""


def static_balance(
    assembly: Assembly,
    body: str,
    torques: Floats,
    angles: int,
    progress: Callable[[int, int], None] | None = None,
    hub: Floats | None = None,
    store: AngleStore | None = None,
) -> StaticBalance:
    """Solve the static balance of a variant over the range of given torques on a body.

    Parameters
    ----------
    torques : N m; the solved torques cover their range
    angles : number of carrier angles per revolution; without planets one is sufficient
    progress : called with the number of solved states and the total
    hub : (5,)
        Magnitudes of the forces along x, y, z (N) and the moments about x and y (N m) on the body; nonzero ones are
        solved in addition to each torque.
    store : storage of solved angles

    Raises
    ------
    BalanceError
        A state without equilibrium.
    VariantError
        Rotor loads on a body without translational coordinates.
    """
    assembly = assembly.at_rest
    linear = is_linear(assembly)
    sizes = np.zeros(5) if hub is None else hub
    solved = _torques(torques, linear)
    places = angles if _carrier(assembly) else 1
    turns: Floats = np.asarray(2.0 * math.pi / places * np.arange(places))
    wrenches = _wrenches(assembly, body, sizes)
    found: list[States] = []
    total = len(turns) * len(solved)
    report = progress or (lambda done, total: None)
    for number, turn in enumerate(turns):
        count = partial(lambda before, done: report(before + done, total), number * len(solved))
        states = None if store is None else store.stored(number)
        if states is None:
            states = _solve_angle(assembly, body, solved, float(turn), wrenches, count)
            if store is not None:
                store.store(number, states)
        count(len(solved))
        found.append(states)
    force, misalignment, load, tilt = (_response([states[key] for states in found], sizes) for key in range(4))
    left = np.any([states.outside for states in found], axis=(0, 1, 2))
    outside = tuple(np.array(assembly.mesh_names)[left].tolist())
    at_rest = _loaded_at_rest(assembly)
    return StaticBalance(solved, turns, force, misalignment, load, tilt, linear, outside, at_rest)


def _solve_angle(
    assembly: Assembly,
    body: str,
    torques: Floats,
    turn: float,
    wrenches: Sequence[Floats | None],
    count: Callable[[int], None],
) -> States:
    """Solve all torques, and each rotor load in addition to them, at one angle of the carrier."""
    carrier = _carrier(assembly)
    about = rolled_coordinates(assembly, carrier, turn) if carrier else np.zeros(assembly.size)
    rows: list[list[States]] = [[] for _ in torques]
    before: dict[float, list[tuple[float, Floats]]] = {1.0: [], -1.0: []}
    for done, t in enumerate(np.argsort(-np.abs(torques)).tolist()):  # the largest first, as it closes all clearances
        count(done)
        torque = float(torques[t])
        known = before[math.copysign(1.0, torque)]  # a torque of opposite sign loads other flanks
        near = known[-1][1] if known else None
        if len(known) > 1:  # extrapolate the last two states
            (first, q_first), (second, q_second) = known[-2:]
            near = q_second + (q_second - q_first) * (torque - second) / (second - first)
        q = _static_coordinates(assembly, body, torque, about, None, near)
        alone = States.of(assembly, q)
        rows[t] = [alone]
        for wrench in wrenches:
            if wrench is None:
                rows[t].append(alone)
            else:
                rows[t].append(States.of(assembly, _static_coordinates(assembly, body, torque, about, wrench, q)))
        known.append((torque, q))
    return States(*(np.array([[state[key] for state in row] for row in rows]) for key in range(len(States._fields))))


def _static_coordinates(
    assembly: Assembly, body: str, torque: float, about: Floats, wrench: Floats | None, near: Floats | None
) -> Floats:
    locked = assembly.gearbox.locked
    try:
        return locked_equilibrium(assembly, {body: torque}, locked, assembly.mean_meshes, about, wrench, near)
    except BalanceError as error:
        hint = "; tables may end at a smaller load or misalignment: widen the axes of [ste]"
        needs_axes = LAWS[assembly.mesh_model].needs_axes
        raise BalanceError(f"under {torque:.6g} N m on {body}: {error}{hint if needs_axes else ''}") from error


def _wrenches(assembly: Assembly, body: str, hub: Floats) -> list[Floats | None]:
    """Return the generalised forces (size,) of each rotor load alone; None for zero loads."""
    coordinate = assembly.coordinates[body][: len(hub)]
    if hub.any() and min(coordinate) < 0:
        raise VariantError(
            f"loads on {body}: rotations only in the variant {assembly.variant}, so rotor forces and moments cannot "
            "act on it; set a body on bearings, or use --variant bushing or flexible"
        )
    place = _hub_position(assembly, body)
    found: list[Floats | None] = []
    for component, size in enumerate(hub):
        wrench = np.zeros(BODY_SIZE)
        wrench[component] = size
        found.append(assembly.wrench_on(body, place, wrench) if size else None)
    return found


def _hub_position(assembly: Assembly, body: str) -> tuple[float, float, float] | None:
    """Return the position (m) of rotor loads that the gearbox file states."""
    loads = assembly.gearbox.case.loads
    if loads is None or loads.hub_z_mm is None:
        return None
    return (*assembly.gearbox.named_bodies[body].axis, MM * loads.hub_z_mm)


def hub_position_in_words(assembly: Assembly, body: str) -> str:
    """Describe where rotor loads act on their body."""
    if position := _hub_position(assembly, body):
        return f"at z = {position[2] / MM:g} mm"
    elastic = assembly.elastic_bodies.get(body)
    if elastic is not None:
        place = next(seat for seat in elastic.reduced.seats if seat.name == elastic.main_seat).position[2]
        reason = "its main seat"
    else:
        place = node_position(next(own for own in assembly.bodies if own.name == body))[2]
        reason = "its centre of mass"
    return f"at z = {place / MM:.4g} mm, {reason}; set loads.hub_z_mm if they act elsewhere"


def _response(parts: Sequence[Floats], sizes: Floats) -> BalanceResponse:
    """Return one result of the states of all angles over torque and angle, with its changes by rotor loads."""
    together = np.stack(parts, axis=2)  # torque, rotor load, angle
    values = np.ascontiguousarray(together[:, 0])
    if not sizes.any():
        return BalanceResponse(values)
    steps = np.where(sizes > 0.0, sizes, 1.0).reshape(-1, *(1,) * (values.ndim - 1))
    return BalanceResponse(values, (together[:, 1:] - values[:, None]) / steps)


def is_linear(assembly: Assembly) -> bool:
    """Return whether forces are proportional to torque: meshes and bearings linear through the origin, no weight.

    Constant forces on bodies exclude proportionality, as weight does.
    """
    through_points = bool(assembly.connectors.point_load.any())
    curved = any(element.is_curved or element.bears_beside for element in assembly.elements)
    not_linear = assembly.at_rest.has_rows or through_points or curved or LAWS[assembly.mesh_model].loses_contact
    return not (not_linear or _loaded_at_rest(assembly))


def _loaded_at_rest(assembly: Assembly) -> bool:
    return any(assembly.gearbox.case.gravity.acceleration_m_per_s2) or bool(assembly.gearbox.forces)


def _torques(torques: Floats, linear: bool) -> Floats:
    high = float(np.max(torques, initial=0.0))
    low = float(np.min(torques, initial=0.0))
    if linear:
        return np.array([high if high >= -low else low])
    shares = np.array(TORQUE_SHARES)
    return np.concatenate(
        [(low * shares)[::-1] if low < 0.0 else shares[:0], high * shares if high > 0.0 else shares[:0]]
    )


def _carrier(assembly: Assembly) -> str | None:
    bodies = assembly.gearbox.named_bodies
    carriers = [body.carrier for body in bodies.values() if body.carrier is not None]
    return next((name for name in carriers if not bodies[name].fixed), None)


def _inner_rings(assembly: Assembly, q: Floats) -> tuple[Floats, Floats]:
    """Return load (bearings, 6) and tilt (bearings, 2) of inner rings, in the axes of the supporting body."""
    if not assembly.supports:
        return np.zeros((0, 6)), np.zeros((0, 2))
    loads = assembly.bearing_loads(q, np.zeros_like(q))
    strains = assembly.support_strains(q)
    # The bearing has its factor's fraction of the deflection, the seat the rest; outer rings move the opposite way.
    scales = np.array([support.factor * (-1.0 if support.carries_outer_ring else 1.0) for support in assembly.supports])
    turned = np.empty_like(loads)
    for number, support in enumerate(assembly.supports):
        angle = float(q[assembly.spin[support.on]]) if support.on in assembly.spin else 0.0
        cosine = math.cos(angle)
        sine = math.sin(angle)
        back = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        turned[number] = np.sign(scales[number]) * np.concatenate([back @ loads[number, :3], back @ loads[number, 3:]])
    return turned, scales[:, None] * strains[:, 3:5]


# Solved angles of a static balance, stored until the rating is complete: a resumed computation has identical results


class KeptAngles(ReprMixin):
    """Solved angles in one file, which is rewritten with each.

    Examples
    --------
    >>> from pathlib import Path
    >>> KeptAngles(Store(Path("nowhere/life.partial.npz"), key="this input"))
    <KeptAngles: 0 in nowhere/life.partial.npz>
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._angles = store.read(_unpacked) or {}

    def _line(self) -> str:
        return f": {len(self._angles)} in {self._store.path.as_posix()}"

    def stored(self, number: int) -> States | None:
        """Return the states of an angle by its index; None if not stored."""
        return self._angles.get(number)

    def store(self, number: int, states: States) -> None:
        """Store the states of an angle."""
        self._angles[number] = states
        self._store.write(
            {f"{name}_{angle}": array for angle, kept in self._angles.items() for name, array in kept._asdict().items()}
        )


def _unpacked(arrays: Arrays) -> dict[int, States]:
    numbers = [int(name.removeprefix("force_")) for name in arrays if name.startswith("force_")]
    return {number: States(*(arrays[f"{name}_{number}"] for name in States._fields)) for number in numbers}


# Loads for the rating: points of the distribution, and worst cases


@dataclass(frozen=True, eq=False)
class ActingLoads:
    """Loads over a life."""

    points: LoadPoints
    """Fatigue loads: torques with simultaneous rotor loads."""
    worst_torque: Floats
    worst_hub: Floats
    """(w,), (w, 5) loads for static safety: ends of the distribution, and extreme sources with their partial factors;
    N m, N and N m."""
    bins: int
    """Number of bins of the distribution of the points."""
    slowest: float
    fastest: float
    """Minimum and maximum absolute speed of the body under load, rad/s, including extreme sources."""

    @property
    def torques(self) -> Floats:
        """All torques, N m."""
        return np.concatenate([self.points.torque, self.worst_torque])

    @property
    def hub_sizes(self) -> Floats:
        """Largest absolute value of each rotor load, (5,)."""
        return np.asarray(np.abs(np.concatenate([self.points.other, self.worst_hub])).max(axis=0))

    def worst(self, sense: int) -> tuple[Floats, Floats]:
        """Return the torques of one sign, including the points, with their rotor loads."""
        torque = self.torques
        hub = np.concatenate([self.points.other, self.worst_hub])
        same_sense = torque * sense > 0.0
        return torque[same_sense], hub[same_sense]

    def sum_by_bin(self, values: Floats) -> Floats:
        """Sum values of points (points,) into the bins of the distribution, (bins,)."""
        return np.asarray(np.bincount(self.points.bin, values, self.bins), dtype=np.float64)


def acting_loads(counted: CountedLoads) -> ActingLoads:
    """Return the loads for the rating from counted loads."""
    distribution = counted.distribution
    extremes = [source for source in counted.sources if source.kind == "extreme"]
    ends = np.array([distribution.upper.max(), distribution.upper.min()])
    return ActingLoads(
        points=counted.points,
        worst_torque=np.concatenate([ends, *(extreme.torque for extreme in extremes)]),
        worst_hub=np.concatenate(
            [np.zeros((2, counted.points.other.shape[1])), *(extreme.hub_loads for extreme in extremes)]
        ),
        bins=len(distribution.hours),
        slowest=min(source.slowest for source in counted.sources),
        fastest=max(source.fastest for source in counted.sources),
    )


# Tables for stresses in a rating: around the static positions of the gears, unless the file defines a grid

TABLE_TORQUE_SHARES = (0.35, 0.7, 1.0)
"""Torques over the static torque; a larger one is added if the loads require it."""
REACH_STEP = 0.25
"""Step to which the largest of them is rounded up, so that small changes of loads keep the tables valid."""
ROOM = 1.25
"""Factor on the static misalignment at the largest torque, because planets share loads unequally."""
LARGEST_STEP, ROUNDING = 15e-6, 2.5e-6
"""Largest step of the misalignment as a gap over the face width, and rounding of the ends, m."""
STRAIGHT = 1e-6
"""Gap over the face width up to which gears count as aligned, m."""


def life_requests(assembly: Assembly, counted: CountedLoads, folder: Path) -> list[TableRequest]:
    """Return the tables for stresses in a rating; those already in a results folder are loaded.

    For a mesh model with grids, these grids are used; otherwise see `stress_requests`.
    """
    grid = LAWS[assembly.mesh_model].needs_axes
    requests = requested_tables(assembly.gearbox, folder, grid=grid)
    return requests if grid else stress_requests(assembly, requests, counted, folder)


def stress_requests(
    assembly: Assembly, requests: Iterable[TableRequest], counted: CountedLoads, folder: Path
) -> list[TableRequest]:
    """Return the tables of a rating: the requested ones, or wider ones for misaligned gears with solvable contact.

    Parameters
    ----------
    requests : of the pairs; those with axes in the file are kept
    folder : results folder; wider tables are stored in ``stress/<pair>.states.nc``

    Raises
    ------
    BalanceError
        No equilibrium under the static load.
    """
    tilts: dict[str, list[float]] = {}
    if assembly.contacts.contacts:
        state = static_state(assembly)
        for contact_place in contact_places(state.assembly, state.q).values():
            tilts.setdefault(contact_place.table.pair.name, []).append(contact_place.misalignment)
    reaches = torque_reaches(assembly, counted)
    found = []
    for request in requests:
        wanted = request.wanted
        width = wanted.pair.face_width
        far = max(map(abs, tilts.get(request.name, (0.0,)))) * width
        if len(wanted.misalignment) > 1 or far < STRAIGHT:
            found.append(request)
            continue
        found.append(_wider(request, tilts[request.name], *reaches.get(request.name, (1.0, 0.0)), folder))
    return found


def torque_reaches(assembly: Assembly, counted: CountedLoads) -> dict[str, tuple[float, float]]:
    """Return by pair the largest torque (ratio at least 1) and largest reversed torque over the static torque."""
    gearbox = assembly.gearbox
    largest = max(float(abs(source.torque).max()) for source in counted.sources)
    static_forces = gearbox.train.static_mesh_forces()
    unit_forces = gearbox.train.static_mesh_forces({counted.body: 1.0})
    found: dict[str, tuple[float, float]] = {}
    for mesh in gearbox.meshes:
        static = gearbox.pairs[mesh.pair.name].static_torque
        if static > 0.0:
            sense = -math.copysign(1.0, static_forces[mesh.name] * unit_forces[mesh.name])
            reversed_most = max(0.0, *(float((sense * source.torque).max()) for source in counted.sources))
            each = counted.mesh_forces[mesh.family] * mesh.pair.pinion.base_radius / static
            forward, backward = found.get(mesh.pair.name, (1.0, 0.0))
            found[mesh.pair.name] = max(forward, largest * each), max(backward, reversed_most * each)
    return found


def _wider(
    request: TableRequest, tilts: Sequence[float], reach: float, reversed_reach: float, folder: Path
) -> TableRequest:
    """Return the request for a pair's table over load and misalignment, loaded if it is stored.

    A reversed load causes the opposite misalignment: nodes for it are added beyond those of the load itself.
    """
    static = request.wanted
    width = request.wanted.pair.face_width
    highest = math.ceil(reach / REACH_STEP - 1e-6) * REACH_STEP
    shares = TABLE_TORQUE_SHARES if highest <= 1.0 else (*TABLE_TORQUE_SHARES, highest)
    openings = [ROOM * highest * tilt * width for tilt in tilts]
    low, high = _ends(openings)
    steps = max(1, math.ceil((high - low) / LARGEST_STEP - 1e-6))
    nodes = [low + (high - low) * step / steps for step in range(steps + 1)]
    back = math.ceil(reversed_reach / REACH_STEP - 1e-6) * REACH_STEP
    lowest, uppermost = _ends([*openings, *(-ROOM * back * tilt * width for tilt in tilts)])
    nodes = [*reversed(_nodes(low, lowest)), *nodes, *_nodes(high, uppermost)]
    wanted = replace(
        static,
        torque=tuple(_rounded(static.torque[0] * share) for share in shares),
        misalignment=tuple(_rounded(node / width) for node in nodes),
    )
    path = folder / "stress" / f"{request.name}.states.nc"
    return TableRequest(request.name, wanted, path, stored_table(path, wanted))


def _ends(openings: Sequence[float]) -> tuple[float, float]:
    """Return the rounded ends of an axis that includes the gaps over the face width (m) and zero."""
    low = math.floor(min(0.0, *openings) / ROUNDING) * ROUNDING
    return low, math.ceil(max(0.0, *openings) / ROUNDING) * ROUNDING


def _nodes(begin: float, end: float) -> list[float]:
    """Return equidistant nodes after a beginning up to an end, at most `LARGEST_STEP` apart; none if they coincide."""
    steps = math.ceil(abs(end - begin) / LARGEST_STEP - 1e-6)
    return [begin + (end - begin) * step / steps for step in range(1, steps + 1)]


def stored_table(path: Path, wanted: TableInput) -> MeshTable | None:
    """Read the table of an input; None if the file is missing, damaged, or of another input."""
    try:
        return MeshTable.open(path, wanted)
    except TableError:
        return None


def _rounded(value: float) -> float:
    return float(f"{value:.12g}")
