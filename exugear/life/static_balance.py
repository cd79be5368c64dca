"""What meshes and bearings carry at rest: the static balance of a variant over torques and angles of the carrier.

For fatigue the balance at rest is enough: what a turbine's torque swings with lies far below the first mode of a
gearbox. Linear laws are solved once an angle and scaled; others on some torques, and forces over torque are linear
between these.

A table of one load knows gears that stand straight. Where contact is solved at the static misalignment, stresses come
from tables of their own: over the loads of the life, and over misalignments from straight to beyond the static ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from exugear.gearbox.variant import VariantError
from exugear.life.load_spectrum.counted import CountedLoads
from exugear.life.load_spectrum.counting import LoadPoints
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
"""Torques over the largest at which laws that are not linear are solved."""


@dataclass(frozen=True, eq=False)
class Response:
    """Something of the balance over torques and angles, and what the loads of a hub add to it."""

    values: Floats
    """(t, a, ...) at the torques of the balance without loads of a hub."""
    by_hub: Floats | None = None
    """(t, 5, a, ...) what a unit of each of these adds."""

    def of(self, number: int) -> Response:
        """Response of one bearing alone: that number of the axis behind the angles."""
        return Response(self.values[:, :, number], None if self.by_hub is None else self.by_hub[:, :, :, number])


@dataclass(frozen=True, eq=False)
class StaticBalance(ReprMixin, line=": {torque!n} torques, {angle!n} angles, linear: {linear}"):
    """Forces over torques and angles."""

    torque: Floats
    angle: Floats
    """(t,), (a,) on the loaded body, N m, rising and without zero; of the carrier, rad."""
    mesh_force: Response
    misalignment: Response
    """(t, a, meshes) F_bt, N, positive on the flank that the static load presses; on tables' flank, rad."""
    bearing_load: Response
    """(t, a, bearings, 6) force and moment of the shaft on the inner ring in the axes of what the bearing sits on, N
    and N m."""
    bearing_tilt: Response
    """(t, a, bearings, 2) of the inner ring against the outer one in the same axes, rad."""
    linear: bool
    """Whether all that is proportional to the loads."""
    outside: tuple[str, ...] = ()
    """Meshes whose load, centre distance or misalignment lies outside their table in some of these states, where
    that goes on in a straight line."""

    def at(self, response: Response, torque: Floats, hub: Floats | None = None) -> Floats:
        """Values of a response at torques (n,) and loads of a hub (n, 5): (n, a, ...).

        Values over torque are linear between the torques that were solved, those of the same sign.
        """
        found = self._interpolate_torque(response.values / _like(self.torque, response.values), torque)
        found *= _like(torque, found)
        if hub is not None and response.by_hub is not None and hub.any():
            slopes = self._interpolate_torque(response.by_hub, torque)
            found += np.einsum("nh,nh...->n...", hub, slopes)
        return found

    def _interpolate_torque(self, values: Floats, torque: Floats) -> Floats:
        """Interpolate values (t, ...) at torques (n,): (n, ...)."""
        found = np.zeros((len(torque), *values.shape[1:]))
        for sign in (1.0, -1.0):
            wanted = torque >= 0.0 if sign > 0.0 else torque < 0.0
            own = np.sign(self.torque) == sign
            if not own.any():
                own = ~own  # linear laws need one torque, of either sign
            flat = values[own].reshape(int(own.sum()), -1)
            inside = np.array([np.interp(torque[wanted], self.torque[own], column) for column in flat.T]).T
            found[wanted] = inside.reshape(-1, *values.shape[1:])
        return found

    def load_sharing(self, meshes: Sequence[int], torque: Floats | None = None, hub: Floats | None = None) -> float:
        """K_gamma of the meshes of a family, over all angles.

        Parameters
        ----------
        torque, hub : (n,), (n, 5) torques and loads of a hub; without them the largest torque alone

        Returns
        -------
        largest of all forces over the mean that the same torque gives without loads of a hub
        """
        if torque is None:
            torque = self.torque[[np.abs(self.torque).argmax()]]
        own = list(meshes)
        forces = np.abs(self.at(self.mesh_force, torque, hub)[..., own]).max(axis=(1, 2))
        worst = int(forces.argmax())
        mean = float(np.abs(self.at(self.mesh_force, torque[[worst]])[..., own]).mean())
        if mean:
            return float(forces[worst]) / mean
        return 1.0


class States(NamedTuple):
    """What is kept of states at rest (...): at one angle over torques and loads of a hub, the first of these none."""

    force: Floats
    misalignment: Floats
    """(..., meshes)"""
    load: Floats
    tilt: Floats
    """(..., bearings, 6), (..., bearings, 2)"""
    outside: Floats
    """(..., meshes) 1 where load, centre distance or misalignment lies outside the table."""

    @classmethod
    def of(cls, assembly: Assembly, q: Floats) -> States:
        """Take them from coordinates (size,) at rest."""
        meshes = assembly.mesh_states(q, np.zeros_like(q), assembly.mean_meshes)
        flanks = np.array([element.flank for element in assembly.elements])
        tilts = flanks * assembly.gear_positions(q)[:, 1]
        return cls(meshes[:, FORCE], tilts, *_inner_rings(assembly, q), meshes[:, OUTSIDE])


def _like(weights: Floats, values: Floats) -> Floats:
    """Weights of the first axis, ready to be multiplied with values."""
    return weights.reshape(-1, *(1,) * (values.ndim - 1))


class AngleStore(Protocol):
    """What keeps solved angles of the carrier, so that a computation that was stopped goes on behind them."""

    def stored(self, number: int) -> States | None:
        """States of an angle by its number, None where they are not there."""

    def store(self, number: int, states: States) -> None:
        """Keep the states of an angle."""


def static_balance(
    assembly: Assembly,
    body: str,
    torques: Floats,
    angles: int,
    progress: Callable[[int, int], None] | None = None,
    hub: Floats | None = None,
    store: AngleStore | None = None,
) -> StaticBalance:
    """Solve the static balance of a variant for the range of some torques on a body.

    Parameters
    ----------
    torques : N m; what is solved covers them
    angles : angles of the carrier within its turn; without planets one is all
    progress : called with the number of solved states, and of all
    hub : (5,)
        Sizes of the force along x, y, z (N) and the moment about x and y (N m) on the body: those above zero are solved
        beside each torque.
    store : where each angle goes when it is solved, and where those that were solved before are taken from

    Raises
    ------
    BalanceError
        A state that is not held.
    VariantError
        Loads of a hub on a body that has no place in space.
    """
    assembly = assembly.at_rest
    linear = is_linear(assembly)
    sizes = np.zeros(5) if hub is None else hub
    solved = _torques(torques, linear)
    turns = _angles(assembly, angles)
    wrenches = _wrenches(assembly, body, sizes)
    found: list[States] = []
    for number, turn in enumerate(turns):
        count = partial(_told, progress, number * len(solved), len(turns) * len(solved))
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
    return StaticBalance(solved, turns, force, misalignment, load, tilt, linear, outside)


def _told(progress: Callable[[int, int], None] | None, before: int, total: int, done: int) -> None:
    if progress is not None:
        progress(before + done, total)


def _solve_angle(
    assembly: Assembly,
    body: str,
    torques: Floats,
    turn: float,
    wrenches: Sequence[Floats | None],
    count: Callable[[int], None],
) -> States:
    """Solve all torques, and each load of a hub beside them, at one angle of the carrier."""
    carrier = _carrier(assembly)
    about = rolled_coordinates(assembly, carrier, turn) if carrier else np.zeros(assembly.size)
    rows: list[list[States]] = [[] for _ in torques]
    before: dict[float, list[tuple[float, Floats]]] = {1.0: [], -1.0: []}
    for done, t in enumerate(np.argsort(-np.abs(torques)).tolist()):  # the largest first: it closes all clearances
        count(done)
        torque = float(torques[t])
        known = before[math.copysign(1.0, torque)]  # the other flanks of a torque of the other sign tell nothing
        q = _static_coordinates(assembly, body, torque, about, None, _ahead(known, torque))
        alone = States.of(assembly, q)
        beside = (
            None if wrench is None else _static_coordinates(assembly, body, torque, about, wrench, q)
            for wrench in wrenches
        )
        rows[t] = [alone, *(alone if one is None else States.of(assembly, one) for one in beside)]
        known.append((torque, q))
    return States(*(np.array([[one[key] for one in row] for row in rows]) for key in range(len(States._fields))))


def _ahead(known: Sequence[tuple[float, Floats]], torque: float) -> Floats | None:
    """Coordinates from which the search under a torque begins: straight through the last two states, or the last."""
    if len(known) < 2:
        if known:
            return known[-1][1]
        return None
    (first, one), (second, other) = known[-2:]
    return np.asarray(other + (other - one) * (torque - second) / (second - first))


def _static_coordinates(
    assembly: Assembly, body: str, torque: float, about: Floats, wrench: Floats | None, near: Floats | None
) -> Floats:
    """Coordinates at rest, (size,)."""
    locked = assembly.gearbox.locked
    try:
        return locked_equilibrium(assembly, {body: torque}, locked, assembly.mean_meshes, about, wrench, near)
    except BalanceError as error:
        hint = "; tables may end at a smaller load or misalignment: widen the axes of [ste]"
        needs_axes = LAWS[assembly.mesh_model].needs_axes
        raise BalanceError(f"under {torque:.6g} N m on {body}: {error}{hint if needs_axes else ''}") from error


def _wrenches(assembly: Assembly, body: str, hub: Floats) -> list[Floats | None]:
    """Generalized forces (size,) of each load of a hub by itself, None for those of no size."""
    coordinate = assembly.coordinates[body][: len(hub)]
    if hub.any() and min(coordinate) < 0:
        raise VariantError(
            f"loads on {body}: rotations only in the variant {assembly.variant}, so rotor forces and moments cannot "
            "act on it; set a body on bearings, or use --variant bushing or flexible"
        )
    found: list[Floats | None] = []
    for place, size in zip(coordinate, hub, strict=True):
        wrench = np.zeros(assembly.size)
        wrench[place] = size
        found.append(wrench if size else None)
    return found


def _response(parts: Sequence[Floats], sizes: Floats) -> Response:
    """One part of the states of all angles, over torque and angle, and its differences by the loads of a hub."""
    together = np.stack(parts, axis=2)  # torque, load of the hub, angle
    values = np.ascontiguousarray(together[:, 0])
    if not sizes.any():
        return Response(values)
    steps = np.where(sizes > 0.0, sizes, 1.0).reshape(-1, *(1,) * (values.ndim - 1))
    return Response(values, (together[:, 1:] - values[:, None]) / steps)


def is_linear(assembly: Assembly) -> bool:
    """Tell whether forces are proportional to torque: teeth and bearings linear and through the origin, no weight.

    Constant forces on bodies are as much in the way as weight is.
    """
    constant = any(assembly.gearbox.case.gravity.acceleration_m_per_s2) or bool(assembly.gearbox.forces)
    through_points = bool(assembly.connectors.point_load.any())
    curved = any(element.is_curved or element.bears_beside for element in assembly.elements)
    not_linear = assembly.at_rest.has_rows or through_points or curved or LAWS[assembly.mesh_model].loses_contact
    return not (not_linear or constant)


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


def _angles(assembly: Assembly, count: int) -> Floats:
    if _carrier(assembly) is None:
        return np.zeros(1)
    return np.asarray(2.0 * math.pi / count * np.arange(count))


def _inner_rings(assembly: Assembly, q: Floats) -> tuple[Floats, Floats]:
    """Load on the inner ring (bearings, 6) and its tilt (bearings, 2) in the axes of what each bearing sits on."""
    if not assembly.supports:
        return np.zeros((0, 6)), np.zeros((0, 2))
    loads = assembly.bearing_loads(q, np.zeros_like(q))
    strains = assembly.support_strains(q)
    # The bearing takes its factor of a deflection, the seat the rest; the outer ring moves the other way.
    scales = np.array([one.factor * (-1.0 if one.carries_outer_ring else 1.0) for one in assembly.supports])
    turned = np.empty_like(loads)
    for number, support in enumerate(assembly.supports):
        angle = float(q[assembly.spin[support.on]]) if support.on in assembly.spin else 0.0
        cosine = math.cos(angle)
        sine = math.sin(angle)
        back = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        turned[number] = np.sign(scales[number]) * np.concatenate([back @ loads[number, :3], back @ loads[number, 3:]])
    return turned, scales[:, None] * strains[:, 3:5]


# Solved angles of a static balance, kept until the life is there: what was stopped goes on with the same bits


class KeptAngles(ReprMixin):
    """Solved angles in one file, written anew with each.

    Parameters
    ----------
    store : of all that the life rests on

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
        """States of an angle by its number, None where they are not there."""
        return self._angles.get(number)

    def store(self, number: int, states: States) -> None:
        """Keep the states of an angle."""
        self._angles[number] = states
        self._store.write(
            {f"{name}_{angle}": array for angle, kept in self._angles.items() for name, array in kept._asdict().items()}
        )


def _unpacked(arrays: Arrays) -> dict[int, States]:
    numbers = [int(name.removeprefix("force_")) for name in arrays if name.startswith("force_")]
    return {number: States(*(arrays[f"{name}_{number}"] for name in States._fields)) for number in numbers}


# What acts on a gearbox, as its parts are rated under it: points of its distribution, and the worst of all


@dataclass(frozen=True, eq=False)
class ActingLoads:
    """Loads over a life."""

    points: LoadPoints
    """What wears, with the loads of a hub beside the torque."""
    worst_torque: Floats
    worst_hub: Floats
    """(w,), (w, 5) what counts for static safety: the ends of the distribution, and extreme sources with their
    partial factors; N m, N and N m."""
    bins: int
    """Bins of the distribution that the points belong to."""
    slowest: float
    fastest: float
    """Least and largest speed of the body under a torque, rad/s without sign, extreme sources among them."""

    @property
    def torques(self) -> Floats:
        """All torques, N m."""
        return np.concatenate([self.points.torque, self.worst_torque])

    @property
    def hub_sizes(self) -> Floats:
        """Largest of each load of a hub without sign, (5,)."""
        return np.asarray(np.abs(np.concatenate([self.points.other, self.worst_hub])).max(axis=0))

    def worst(self, sense: int) -> tuple[Floats, Floats]:
        """Torques of one sign, points among them, and the loads of a hub beside them."""
        torque = self.torques
        hub = np.concatenate([self.points.other, self.worst_hub])
        own = torque * sense > 0.0
        return torque[own], hub[own]

    def by_bin(self, values: Floats) -> Floats:
        """Sum values of points (points,) into the bins of the distribution, (bins,)."""
        return np.asarray(np.bincount(self.points.bin, values, self.bins), dtype=np.float64)


def acting_loads(counted: CountedLoads) -> ActingLoads:
    """Gather what acts of counted loads."""
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


# Tables that stresses of a life are taken from: around the places where gears stand, where no grid of the file says

TABLE_TORQUE_SHARES = (0.35, 0.7, 1.0)
"""Torques over the static one; a larger one follows from the loads."""
REACH_STEP = 0.25
"""Step to which the largest of them is rounded up, so that loads that change a little leave tables as they are."""
ROOM = 1.25
"""How far misalignments reach beyond the static one at the largest torque: planets share loads unequally."""
LARGEST_STEP, ROUNDING = 15e-6, 2.5e-6
"""Largest step of misalignment as an opening over the face, and what its ends are rounded to, m."""
STRAIGHT = 1e-6
"""Opening over the face up to which gears stand straight, m."""


def life_requests(assembly: Assembly, counted: CountedLoads, folder: Path) -> list[TableRequest]:
    """Tables that stresses of a life come from, and those of them that are in a results folder.

    Of a law that reads grids these are its grids; else see `stress_requests`.
    """
    grid = LAWS[assembly.mesh_model].needs_axes
    requests = requested_tables(assembly.gearbox, folder, grid=grid)
    if grid:
        return requests
    return stress_requests(assembly, requests, counted, folder)


def stress_requests(
    assembly: Assembly, requests: Iterable[TableRequest], counted: CountedLoads, folder: Path
) -> list[TableRequest]:
    """Tables of a life: those that are wanted, or wider ones where gears stand off straight and contact can be solved.

    Parameters
    ----------
    requests : of the pairs; those with axes of the file stay as they are
    folder : results folder: wider tables are kept in ``stress/<pair>.states.nc``

    Raises
    ------
    BalanceError
        The static load cannot be held.
    """
    tilts = _misalignments(assembly)
    reaches = _reaches(assembly, counted)
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


def _misalignments(assembly: Assembly) -> dict[str, list[float]]:
    """Find the static misalignments of the meshes of each pair in the axes of its table, rad."""
    tilts: dict[str, list[float]] = {}
    if assembly.contacts.contacts:
        state = static_state(assembly)
        for contact_place in contact_places(state.assembly, state.q).values():
            tilts.setdefault(contact_place.table.pair.name, []).append(contact_place.misalignment)
    return tilts


def _reaches(assembly: Assembly, counted: CountedLoads) -> dict[str, tuple[float, float]]:
    """Largest torque of the loads over the static one by pair, at least 1, and the largest reversed one over it."""
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
    """Ask for a pair's table over load and misalignment, and find it where it is kept.

    A reversed load tilts gears the other way: nodes for it are added beyond those of the load itself.
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
    return TableRequest(request.name, wanted, path, _stored(path, wanted))


def _ends(openings: Sequence[float]) -> tuple[float, float]:
    """Return the ends of an axis that holds openings over the face (m) and none."""
    low = math.floor(min(0.0, *openings) / ROUNDING) * ROUNDING
    return low, math.ceil(max(0.0, *openings) / ROUNDING) * ROUNDING


def _nodes(begin: float, end: float) -> list[float]:
    """Return even nodes after a beginning up to an end, at most `LARGEST_STEP` apart; none if both are one."""
    steps = math.ceil(abs(end - begin) / LARGEST_STEP - 1e-6)
    return [begin + (end - begin) * step / steps for step in range(1, steps + 1)]


def _stored(path: Path, wanted: TableInput) -> MeshTable | None:
    try:
        return MeshTable.open(path, wanted)
    except TableError:
        return None


def _rounded(value: float) -> float:
    return float(f"{value:.12g}")
