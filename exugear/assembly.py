"""A gearbox variant as equations of motion on one vector of coordinates, independent of any solver.

Everything is packed once into arrays for the kernels: Exudyn (system.py) and the compiled solver are built
from the same assembly, so they solve the same equations in the same coordinates.

Bodies with six coordinates come first, in the order of the file, then those with their spin alone. In the
variant `rigid` every body has its spin alone: ideal joints leave nothing else, and a planet rides on its
carrier's spin. In the variant `flexible` elastic bodies follow, with six coordinates at each seat and their inner
amplitudes: a gear or a bearing sits on a seat as it would on a rigid body. A fixed body, such as the housing, is the
ground itself unless it is elastic; then it moves on its mounts, and what sits in it sits on its seats.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from exugear.elastic import (
    ElasticArrays,
    add_elastic_forces,
    no_elastic,
    scratch_for,
    set_elastic_accelerations,
)
from exugear.elastic_bodies import ElasticBody, reduced_bodies
from exugear.floating import FloatingBody
from exugear.gearbox import Bearing, Body, Gearbox
from exugear.kernels import (
    STATE_SIZE,
    ConnectorArrays,
    InertiaArrays,
    MeshArrays,
    SpringArrays,
    accelerations,
    add_connector_forces,
    add_mesh_forces,
    add_mesh_jacobian,
    add_spring_forces,
    connector_load,
    gear_positions,
    mesh_state,
)
from exugear.mesh_element import Angles, MeshData, MeshElement, mesh_elements, node_position, pack, seat_key
from exugear.supports import ON_BEARINGS, bearing_matrices, elastic_names, mounts_at_work, unsupported
from exugear.travelling import (
    TravellingArrays,
    follow,
    no_travelling,
    share_travelling_forces,
    travelling_tangent,
)
from exugear.turning import TurningArrays, TurningBody, turning_arrays

Floats = NDArray[np.float64]
Variant = Literal["rigid", "bushing", "flexible", "jointed"]
VARIANTS: tuple[str, ...] = get_args(Variant)


class VariantError(ValueError):
    """A variant that cannot be built from this gearbox."""


@dataclass(frozen=True)
class Assembly:
    """Equations of motion of a gearbox variant.

    Attributes
    ----------
    gearbox, variant, law, inertias : what was assembled
    bodies : moving bodies in the order of their coordinates, elastic fixed ones among them
    coordinates : the six state indices of each body by name, -1 where there is none; of an elastic body those of
        its main seat, and those of each seat under `exugear.mesh_element.seat_key`
    size : number of coordinates
    elements, meshes : mesh elements and their arrays
    travelling : seats of meshes on an elastic ring; their coordinates follow those of the system
    supports, connectors : bearings and mounts (none in the variant `rigid`)
    spring_names, springs : torsional couplings
    inertia : mass properties of rigid bodies; in the variant `rigid` the planets' orbit is in the carrier's
    elastic_bodies : elastic bodies by name, in the order of their coordinates
    elastic : matrices of those whose frame does not turn
    motions : (size, n) motions that are free; the identity, but for the law `rigid` the rolling ones
    """

    gearbox: Gearbox
    variant: str
    law: str
    inertias: str
    bodies: tuple[Body, ...]
    coordinates: Mapping[str, tuple[int, ...]]
    size: int
    elements: tuple[MeshElement, ...]
    meshes: MeshArrays
    travelling: TravellingArrays
    supports: tuple[Bearing, ...]
    connectors: ConnectorArrays
    spring_names: tuple[str, ...]
    springs: SpringArrays
    inertia: InertiaArrays
    elastic_bodies: Mapping[str, ElasticBody]
    elastic: ElasticArrays
    motions: Floats

    def has_six(self, body: Body) -> bool:
        """Tell whether a body is rigid with all six coordinates."""
        return self.coordinates[body.name][0] >= 0 and body.name not in self.elastic_bodies

    @cached_property
    def elastic_slices(self) -> dict[str, slice]:
        """Coordinates of each elastic body."""
        begin, found = self.size - sum(shaft.reduced.size for shaft in self.elastic_bodies.values()), {}
        for name, shaft in self.elastic_bodies.items():
            found[name] = slice(begin, begin + shaft.reduced.size)
            begin += shaft.reduced.size
        return found

    @property
    def floating(self) -> dict[str, FloatingBody]:
        """Bodies that move in floating frames in Exudyn."""
        return {name: body.floating for name, body in self.elastic_bodies.items() if body.floating is not None}

    @cached_property
    def turning(self) -> dict[str, TurningBody]:
        """Elastic bodies in their own turning frame."""
        time, gravity = self.gearbox.case.damping.body_time_s, self.gearbox.case.gravity.acceleration_m_per_s2
        return {
            name: TurningBody(body.reduced, time, gravity)
            for name, body in self.elastic_bodies.items()
            if body.reduced.frame == "carrier"
        }

    @cached_property
    def turning_arrays(self) -> TurningArrays:
        """Arrays of the same bodies."""
        return turning_arrays((self.elastic_slices[name].start, body) for name, body in self.turning.items())

    def rigid_part(self, vector: Floats) -> Floats:
        """Copy of a vector of coordinates in which a shaft's main seat has the mean motion of the whole shaft.

        It is that of the body's centre of mass, as `coordinates` of a rigid body are.
        """
        out = vector.copy()
        for name, place in self.elastic_slices.items():
            body = self.elastic_bodies[name].reduced
            motions = body.rigid_motions(body.rigid_inertia.centre)
            carried = motions.T @ body.mass
            out[list(self.coordinates[name])] = np.linalg.solve(carried @ motions, carried @ vector[place])
        return out

    @cached_property
    def housing_factor(self) -> float:
        """Factor on bearings' stiffness that stands for their seats: 1 where an elastic housing has these itself."""
        replaced = self.variant == "flexible" and all(support.factor == 1.0 for support in self.supports)
        return 1.0 if replaced else self.gearbox.case.housing.factor

    @cached_property
    def spin(self) -> dict[str, int]:
        """Coordinate of the spin of each body that turns."""
        return {body.name: self.coordinates[body.name][5] for body in self.bodies if not body.fixed}

    @cached_property
    def connector_names(self) -> tuple[str, ...]:
        """Names of bearings and mounts in the order of the arrays."""
        return tuple(support.name for support in self.supports)

    @cached_property
    def mesh_names(self) -> tuple[str, ...]:
        """Names of the meshes in the order of the arrays."""
        return tuple(element.mesh.name for element in self.elements)

    @cached_property
    def mean_meshes(self) -> MeshArrays:
        """Mesh arrays with stiffness and tables replaced by their mean over the cycle."""
        return pack(self.elements, self.coordinates, averaged=True)

    def linear_meshes(self, reversed_flanks: NDArray[np.bool_] | None = None) -> MeshArrays:
        """Mesh arrays that are linear and bilateral, tables replaced by the mean stiffness at their static load.

        Parameters
        ----------
        reversed_flanks : (meshes,) array of bool, optional
            Meshes that press the other flank: their deflection counts from there.
        """
        meshes = pack(self.elements, self.coordinates, averaged=True, tables=False)
        for m, element in enumerate(self.elements):
            if reversed_flanks is not None and reversed_flanks[m] and element.table is not None:
                meshes.table.nominal[m, 0] += element.table.backlash
        return meshes

    def forces(self, q: Floats, v: Floats, meshes: MeshArrays | None = None) -> Floats:
        """Generalized forces of meshes, bearings, couplings, elastic bodies and weight, shape (size,), N and N m."""
        f = self.mesh_forces(q, v, self.meshes if meshes is None else meshes)
        add_connector_forces(q, v, self.connectors, f)
        add_spring_forces(q, v, self.springs, f)
        add_elastic_forces(q, v, self.elastic, scratch_for(self.elastic), f)
        for name, body in self.turning.items():
            place = self.elastic_slices[name]
            f[place] += body.forces(q[place], v[place])
        return f + self.weight

    @cached_property
    def weight(self) -> Floats:
        """Generalized forces of gravity, shape (size,); those on bodies in turning frames turn with them."""
        f = np.zeros(self.size)
        acceleration = np.array(self.gearbox.case.gravity.acceleration_m_per_s2)
        for body in self.bodies:
            if self.has_six(body):
                f[list(self.coordinates[body.name][:3])] = body.mass * acceleration
        for name, place in self.elastic_slices.items():
            if name in self.turning:
                continue
            reduced = self.elastic_bodies[name].reduced
            f[place] = reduced.mass @ reduced.rigid_motions(reduced.seats[0].place)[:, :3] @ acceleration
        return f

    def torque_vector(self, torques: Mapping[str, float]) -> Floats:
        """Generalized forces of torques about the bodies' spin axes (N m), shape (size,)."""
        f = np.zeros(self.size)
        for name, torque in torques.items():
            if name not in self.spin:
                raise VariantError(f"no turning body {name!r} to load; bodies are {', '.join(self.spin)}")
            f[self.spin[name]] += torque
        return f

    def accelerations(self, q: Floats, v: Floats, applied: Floats) -> Floats:
        """Accelerations under all forces and the applied generalized forces, shape (size,)."""
        out = np.zeros(self.size)
        forces = self.forces(q, v) + applied
        accelerations(q, v, self.inertia, forces, out)
        set_elastic_accelerations(forces, self.elastic, scratch_for(self.elastic), out)
        for name, body in self.turning.items():
            place = self.elastic_slices[name]
            out[place] = body.accelerations(q[place], v[place], forces[place])
        return out

    def with_travelling(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """States (..., size) as the laws of meshes read them: with the travelling seats' coordinates, if any."""
        if not self.travelling.first.size:
            return q, v
        x, u = follow(np.atleast_2d(q), np.atleast_2d(v), self.travelling)
        return (x, u) if q.ndim > 1 else (x[0], u[0])

    def mesh_forces(self, q: Floats, v: Floats, meshes: MeshArrays) -> Floats:
        """Generalized forces of meshes, shape (size,), N and N m."""
        x, u = self.with_travelling(q, v)
        f = np.zeros(x.size)
        add_mesh_forces(x, u, meshes, f)
        share_travelling_forces(x, self.travelling, f)
        return f[: self.size]

    def mesh_jacobians(self, q: Floats, v: Floats, meshes: MeshArrays | None = None) -> tuple[Floats, Floats]:
        """Differentiate the forces of the meshes, or others, to q and to v, each (size, size)."""
        meshes = self.meshes if meshes is None else meshes
        x, u = self.with_travelling(q, v)
        jq, jv = np.zeros((x.size, x.size)), np.zeros((x.size, x.size))
        add_mesh_jacobian(x, u, meshes, jq, jv)
        if not self.travelling.first.size:
            return jq, jv
        f = np.zeros(x.size)
        add_mesh_forces(x, u, meshes, f)
        place, rate, turning = travelling_tangent(x, u, f, self.travelling)
        return place.T @ (jq @ place + jv @ rate) + turning, place.T @ jv @ place

    @cached_property
    def mass_matrix(self) -> Floats:
        """Mass matrix at zero angles, diagonal but for elastic bodies, (size, size)."""
        m = np.zeros((self.size, self.size))
        for n, o in enumerate(self.inertia.body):
            values = [self.inertia.mass[n]] * 3 + [self.inertia.transverse[n]] * 2 + [self.inertia.axial[n]]
            m[range(o, o + 6), range(o, o + 6)] = values
        m[self.inertia.spin, self.inertia.spin] = self.inertia.spin_inertia
        for name, place in self.elastic_slices.items():
            m[place, place] = self.elastic_bodies[name].reduced.mass
        return m

    def mass_at(self, q: Floats) -> Floats:
        """Mass matrix at coordinates q and zero tilts, (size, size)."""
        m = self.mass_matrix.copy()
        for name, body in self.turning.items():
            place = self.elastic_slices[name]
            m[place, place] = body.mass_matrix(q[place])
        return m

    def rolling_velocity(self, q: Floats, speeds: Mapping[str, float]) -> Floats:
        """Velocities when the train rolls at the given spins and the planets orbit with their carriers."""
        v = np.zeros(self.size)
        for name, place in self.elastic_slices.items():
            v[place] = speeds.get(name, 0.0) * self.elastic_bodies[name].reduced.spin
            if name in self.turning:
                v[place] = self.turning[name].rolling_velocity(q[place], speeds[name])
        for body in self.bodies:
            if body.fixed:
                continue
            v[self.spin[body.name]] = speeds[body.name]
            if self.has_six(body) and body.carrier is not None:
                x, y = self._from_carrier_axis(body, q)
                o = self.coordinates[body.name][0]
                v[o : o + 2] = speeds[body.carrier] * np.array([-y, x])
        return v

    def rolling_acceleration(self, q: Floats, speeds: Mapping[str, float], rates: Mapping[str, float]) -> Floats:
        """Accelerations of a train that rolls at given spins and spin rates, planets' orbit included."""
        a = np.zeros(self.size)
        for name, place in self.elastic_slices.items():
            a[place] = rates.get(name, 0.0) * self.elastic_bodies[name].reduced.spin
            if name in self.turning:
                a[place] = self.turning[name].rolling_acceleration(q[place], speeds[name], rates[name])
        for body in self.bodies:
            if body.fixed:
                continue
            a[self.spin[body.name]] = rates[body.name]
            if self.has_six(body) and body.carrier is not None:
                x, y = self._from_carrier_axis(body, q)
                o, w = self.coordinates[body.name][0], speeds[body.carrier]
                a[o : o + 2] = rates[body.carrier] * np.array([-y, x]) - w**2 * np.array([x, y])
        return a

    def _from_carrier_axis(self, body: Body, q: Floats) -> tuple[float, float]:
        carrier = next(other for other in self.bodies if other.name == body.carrier)
        o = self.coordinates[body.name][0]
        return body.axis[0] - carrier.axis[0] + float(q[o]), body.axis[1] - carrier.axis[1] + float(q[o + 1])

    def bearing_loads(self, q: Floats, v: Floats) -> Floats:
        """Force and moment that each bearing takes from its body, (bearings, 6), global axes, N and N m."""
        loads, arms = np.zeros((len(self.connector_names), 6)), np.zeros((2, 3))
        for n, load in enumerate(loads):
            connector_load(q, v, n, self.connectors, arms, load)
        return loads

    def mesh_states(self, q: Floats, v: Floats, meshes: MeshArrays | None = None) -> Floats:
        """State of each mesh, (meshes, 10): see `exugear.kernels.mesh_state`."""
        out = np.zeros((len(self.elements), STATE_SIZE))
        mesh_state(*self.with_travelling(q, v), self.meshes if meshes is None else meshes, out)
        return out

    def gear_positions(self, q: Floats) -> Floats:
        """Centre distance (m) and misalignment (rad) of each mesh, (meshes, 2)."""
        out = np.zeros((len(self.elements), 2))
        gear_positions(self.with_travelling(q, q)[0], self.meshes, out)
        return out

    def inertia_forces(self, q: Floats, v: Floats, a: Floats) -> Floats:
        """Generalized forces that the accelerations a need, shape (size,): the inverse of `accelerations`."""
        f = np.zeros(self.size)
        for n, o in enumerate(self.inertia.body):
            mass, jt, ja = self.inertia.mass[n], self.inertia.transverse[n], self.inertia.axial[n]
            sb, cb = math.sin(q[o + 4]), math.cos(q[o + 4])
            da, db = v[o + 3], v[o + 4]
            p = ja * (v[o + 5] + da * sb)
            f[o : o + 3] = mass * a[o : o + 3]
            f[o + 5] = ja * (a[o + 5] + a[o + 3] * sb + da * db * cb)
            f[o + 3] = jt * cb**2 * a[o + 3] + f[o + 5] * sb + p * db * cb - 2.0 * jt * da * db * sb * cb
            f[o + 4] = jt * a[o + 4] + jt * da**2 * sb * cb - p * da * cb
        f[self.inertia.spin] = self.inertia.spin_inertia * a[self.inertia.spin]
        for name, place in self.elastic_slices.items():
            f[place] = self.elastic_bodies[name].reduced.mass @ a[place]
            if name in self.turning:
                f[place] = self.turning[name].inertia_forces(q[place], v[place], a[place])
        return f


def assemble(
    gearbox: Gearbox,
    variant: str,
    stiffness: Mapping[str, MeshData],
    law: str = "line_of_action",
    inertias: str | None = None,
    flanks: Mapping[str, int] | None = None,
    angles: Angles = "reference",
    folder: Path | None = None,
) -> Assembly:
    """Assemble a variant; arguments as in `exugear.mesh_element.mesh_elements`.

    Elastic bodies are reduced for the variant `flexible`; in `folder` their reductions are kept and found again.

    Raises
    ------
    VariantError
        Unknown variant, or supports missing for it.
    MeshError
        Unknown law, or no stiffness for a pair at work.
    """
    if variant not in VARIANTS:
        raise VariantError(f"variant {variant!r} is unknown; variants are {', '.join(VARIANTS)}")
    inertias = inertias or gearbox.case.default_inertias
    elastic = elastic_names(gearbox) if variant == "flexible" else ()
    moving = [body for body in gearbox.bodies(inertias) if not body.fixed or body.name in elastic]
    lacking = unsupported(gearbox, variant)
    if lacking:
        raise VariantError(f"variant {variant}: {lacking}")
    if law == "rigid" and variant != "rigid":
        raise VariantError(f"mesh law rigid: its gears only roll, which needs the variant rigid, not {variant}")
    flexible = reduced_bodies(gearbox, inertias, folder) if variant == "flexible" else {}
    rigid = [body for body in moving if body.name not in flexible]
    six = [body for body in rigid if variant != "rigid" and not body.spin_only]
    alone = [body for body in rigid if body not in six]
    coordinates, nodes = _coordinates(six, alone), {body.name: node_position(body) for body in moving}
    size = 6 * len(six) + len(alone)
    for name, shaft in flexible.items():
        size = _take_seats(name, shaft, size, coordinates, nodes)
    travelling = _travelling(gearbox, flexible, size, coordinates, nodes)
    supports = _supports(gearbox, flexible) if variant in ON_BEARINGS else ()
    displaced = gearbox.pin_offsets if variant not in ON_BEARINGS else {}  # bearings carry the planets along
    settings = (law, inertias, flanks, angles, displaced, nodes)
    elements = () if law == "rigid" else mesh_elements(gearbox, stiffness, *settings)
    return Assembly(
        gearbox=gearbox,
        variant=variant,
        law=law,
        inertias=inertias,
        bodies=(*six, *alone, *(body for body in moving if body.name in flexible)),
        coordinates=coordinates,
        size=size,
        elements=elements,
        meshes=pack(elements, coordinates),
        travelling=travelling,
        supports=supports,
        connectors=_connectors(gearbox, supports, nodes, coordinates),
        spring_names=tuple(coupling.name for coupling in gearbox.couplings),
        springs=_springs(gearbox, coordinates),
        inertia=_inertia(variant, six, alone),
        elastic_bodies=flexible,
        elastic=elastic_arrays(flexible, size, gearbox.case.damping.body_time_s),
        motions=_rolling_motions(gearbox, coordinates) if law == "rigid" else np.eye(size),
    )


def _take_seats(
    name: str,
    body: ElasticBody,
    first: int,
    coordinates: dict[str, tuple[int, ...]],
    nodes: dict[str, Floats],
) -> int:
    """Enter the seats of an elastic body whose coordinates begin at `first`; return where the next one begins."""
    for n, seat in enumerate(body.reduced.seats):
        key = seat_key(name, seat.name)
        coordinates[key] = tuple(range(first + 6 * n, first + 6 * n + 6))
        nodes[key] = np.array(seat.place)
    for item, seat_name in body.shared.items():
        key = seat_key(name, seat_name)
        coordinates[seat_key(name, item)], nodes[seat_key(name, item)] = coordinates[key], nodes[key]
    coordinates[name] = coordinates[seat_key(name, body.main)]
    nodes[name] = nodes[seat_key(name, body.main)]
    return first + body.reduced.size


def _travelling(
    gearbox: Gearbox,
    flexible: Mapping[str, ElasticBody],
    size: int,
    coordinates: dict[str, tuple[int, ...]],
    nodes: dict[str, Floats],
) -> TravellingArrays:
    """Enter a travelling seat, with coordinates after all `size` others, for each mesh of a gear with sectors."""
    seats: list[tuple[int, float, list[int]]] = []
    bodies = {body.name: body for body in gearbox.bodies()}
    for mesh in gearbox.meshes:
        sectors = flexible[mesh.gear].sectors.get(mesh.pair.gear.name, ()) if mesh.gear in flexible else ()
        if not sectors:
            continue
        keys = [seat_key(mesh.gear, sector) for sector in sectors]
        first = size + 6 * len(seats)
        coordinates[seat_key(mesh.gear, mesh.name)] = tuple(range(first, first + 6))
        nodes[seat_key(mesh.gear, mesh.pair.gear.name)] = nodes[keys[0]]
        x, y = np.array(bodies[mesh.pinion].axis) - bodies[mesh.gear].axis
        seats.append((coordinates.get(mesh.frame, (-1,) * 6)[5], math.atan2(y, x), [coordinates[k][0] for k in keys]))
    if not seats:
        return no_travelling()
    count = np.array([len(sectors) for _, _, sectors in seats], dtype=np.int64)
    most = int(count.max())
    middles = 2.0 * np.pi * np.arange(most) / count[:, None]
    return TravellingArrays(
        first=size + 6 * np.arange(len(seats), dtype=np.int64),
        frame=np.array([frame if frame >= 0 else size + 6 * len(seats) for frame, _, _ in seats], dtype=np.int64),
        angle=np.array([angle for _, angle, _ in seats]),
        number=count,
        sectors=np.array([starts + [-1] * (most - len(starts)) for _, _, starts in seats], dtype=np.int64),
        axes=np.stack([np.cos(middles), np.sin(middles)], axis=2),
    )


def elastic_arrays(flexible: Mapping[str, ElasticBody], size: int, damping_time: float) -> ElasticArrays:
    """Arrays of elastic bodies whose coordinates are the last of `size`; damping is `damping_time` (s) times stiffness.

    Those in turning frames are left out (`exugear.turning`). Each body falls into blocks that neither its mass nor its
    stiffness couples. Coordinates that turn with the body come first in their block; a body on the ground has no spin
    speed, and no gyroscopic forces.
    """
    blocks: list[NDArray[np.int64]] = []
    turning, partner = [], []
    parts: dict[str, list[Floats]] = {"stiffness": [], "mass": [], "inverse": [], "gyroscopic": []}
    spin, momentum = [], []
    begin = size - sum(body.reduced.size for body in flexible.values())
    for flexible_body in flexible.values():
        body = flexible_body.reduced
        if body.frame == "carrier":
            begin += body.size
            continue
        own = [block[np.argsort(-body.spin[block], kind="stable")] for block in body.blocks]
        carried = body.mass @ body.spin
        spinning = next((n for n, block in enumerate(own) if body.spin[block].any()), 0)
        inertia = float(body.spin @ carried) or 1.0
        for block in own:
            others = [n for n, other in enumerate(own) if body.gyroscopic[np.ix_(block, other)].any()]
            if len(others) > 1:
                raise VariantError(f"body {body.name}: gyroscopic forces tie one block to {len(others)} others")
            turning.append(len(blocks) + spinning)
            partner.append(len(blocks) + others[0] if others else -1)
            parts["stiffness"].append(body.stiffness[np.ix_(block, block)])
            parts["mass"].append(body.mass[np.ix_(block, block)])
            parts["inverse"].append(np.asarray(np.linalg.inv(body.mass[np.ix_(block, block)]), dtype=np.float64))
            parts["gyroscopic"].append(body.gyroscopic[np.ix_(block, own[others[0]])] if others else np.zeros((0, 0)))
            spin.append(body.spin[block])
            momentum.append(carried[block] / inertia)
        blocks += [block + begin for block in own]
        begin += body.size
    if not blocks:
        return no_elastic()
    flat = {name: np.concatenate([matrix.T.ravel() for matrix in values]) for name, values in parts.items()}
    return ElasticArrays(
        first=np.cumsum([0, *map(len, blocks)]).astype(np.int64),
        coordinate=np.concatenate(blocks).astype(np.int64),
        spin=np.concatenate(spin),
        momentum=np.concatenate(momentum),
        turning=np.array(turning, dtype=np.int64),
        partner=np.array(partner, dtype=np.int64),
        square=np.cumsum([0, *(m.size for m in parts["mass"][:-1])]).astype(np.int64),
        stiffness=flat["stiffness"],
        mass=flat["mass"],
        inverse=flat["inverse"],
        across=np.cumsum([0, *(m.size for m in parts["gyroscopic"][:-1])]).astype(np.int64),
        gyroscopic=flat["gyroscopic"],
        damping_time=np.full(len(blocks), damping_time),
    )


def _coordinates(six: list[Body], alone: list[Body]) -> dict[str, tuple[int, ...]]:
    """Six state indices of each moving body; -1 for all but the spin where a body has nothing else."""
    found = {body.name: tuple(range(6 * n, 6 * n + 6)) for n, body in enumerate(six)}
    for n, body in enumerate(alone):
        found[body.name] = (-1, -1, -1, -1, -1, 6 * len(six) + n)
    return found


def _inertia(variant: str, six: list[Body], alone: list[Body]) -> InertiaArrays:
    orbiting = {
        carrier.name: sum(
            body.mass * math.dist(body.axis, carrier.axis) ** 2
            for body in alone
            if body.carrier == carrier.name and variant == "rigid"
        )
        for carrier in alone
    }
    return InertiaArrays(
        body=np.arange(len(six), dtype=np.int64) * 6,
        mass=np.array([body.mass for body in six]),
        transverse=np.array([body.transverse for body in six]),
        axial=np.array([body.axial for body in six]),
        spin=np.arange(len(alone), dtype=np.int64) + 6 * len(six),
        spin_inertia=np.array([body.axial + orbiting[body.name] for body in alone]),
    )


def _rolling_motions(gearbox: Gearbox, coordinates: Mapping[str, tuple[int, ...]]) -> Floats:
    """Motions of the spins (size, n) in which no mesh closes; couplings may twist."""
    rows = np.array([gearbox.mesh_row(mesh) for mesh in gearbox.meshes])
    order = [coordinates[name][5] for name in gearbox.spinning]
    motions = np.zeros((len(order), len(order) - np.linalg.matrix_rank(rows)))
    motions[order] = scipy.linalg.null_space(rows / np.abs(rows).max(axis=1, keepdims=True))
    return motions


def _springs(gearbox: Gearbox, coordinates: Mapping[str, tuple[int, ...]]) -> SpringArrays:
    pairs = [
        [coordinates[_attached(coordinates, body, c.seat) or body][5] for body in (c.first, c.second)]
        for c in gearbox.couplings
    ]
    return SpringArrays(
        coordinates=np.array(pairs, dtype=np.int64).reshape(-1, 2),
        stiffness=np.array([c.stiffness for c in gearbox.couplings]),
        damping=np.array([c.damping for c in gearbox.couplings]),
    )


def _supports(gearbox: Gearbox, flexible: Mapping[str, ElasticBody]) -> tuple[Bearing, ...]:
    """Bearings and the mounts at work; the housing factor stands for seats that no elastic body has."""
    fixed = {body.name for body in gearbox.bodies() if body.fixed and body.name in flexible}
    bearings = [
        replace(bearing, factor=1.0) if fixed & {bearing.on, bearing.body} else bearing for bearing in gearbox.bearings
    ]
    return (*bearings, *(mounts_at_work(gearbox) if flexible else ()))


def _connectors(
    gearbox: Gearbox,
    supports: tuple[Bearing, ...],
    nodes: Mapping[str, Floats],
    coordinates: Mapping[str, tuple[int, ...]],
) -> ConnectorArrays:
    if not supports:
        return no_connectors()
    starts, local, places = [], [], []
    for bearing in supports:
        keys = [_attached(coordinates, body, bearing.name) for body in (bearing.on, bearing.body)]
        at = [np.zeros(3) if key is None else nodes[key] for key in keys]
        starts.append([-1 if key is None else coordinates[key][0] for key in keys])
        local.append([np.array(bearing.place) - node for node in at])
        if bearing.body in gearbox.pin_offsets:
            local[-1][0] = local[-1][0] + [*gearbox.pin_offsets[bearing.body], 0.0]
        places.append(at)
    matrices = [bearing_matrices(bearing, gearbox.case.damping.bearing_time_s) for bearing in supports]
    return ConnectorArrays(
        bodies=np.array(starts, dtype=np.int64),
        local=np.array(local),
        place=np.array(places),
        stiffness=np.array([stiffness for stiffness, _ in matrices]),
        damping=np.array([damping for _, damping in matrices]),
    )


def _attached(coordinates: Mapping[str, tuple[int, ...]], body: str, item: str | None) -> str | None:
    """Key of what carries an item on a body: its seat, else the rigid body, None for the ground."""
    key = seat_key(body, item or "")
    if key in coordinates:
        return key
    return body if body in coordinates else None


def no_connectors() -> ConnectorArrays:
    """Arrays of a system without bearings."""
    empty = np.zeros((0, 2, 3))
    matrices = np.zeros((0, 6, 6))
    return ConnectorArrays(np.zeros((0, 2), dtype=np.int64), empty, empty, matrices, matrices)
