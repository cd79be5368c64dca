"""A gearbox variant as equations of motion on one vector of coordinates, independent of any solver.

Everything is packed once into arrays for the kernels: Exudyn (`exugear.transient.exudyn_model`) and the compiled solver
are built from the same assembly, so they solve the same equations in the same coordinates.

Bodies with six coordinates come first, in the order of the file, then those with their spin alone. In the
variant `rigid` every body has its spin alone: ideal joints leave nothing else, and a planet rides on its
carrier's spin. In the variant `flexible` elastic bodies follow, with six coordinates at each seat and their modal
coordinates: a gear or a bearing sits on a seat as it would on a rigid body. A fixed body, such as the housing, is the
ground itself unless it is elastic; then it moves on its mounts, and what sits in it sits on its seats.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import astuple, dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Bearing, Body, node_position, seat_key
from exugear.gearbox.variant import Variant, VariantError
from exugear.gearbox.versions import MODES, REDUCTION, RUN
from exugear.system.bearings.duty import OperatingPoint
from exugear.system.bearings.stiffness import law_in_words, load_stands_still
from exugear.system.bodies.elastic_body import ElasticBody, FloatingBody
from exugear.system.bodies.reduction import Seat
from exugear.system.bodies.turning_frame import TurningBody, turning_arrays
from exugear.system.kernels.connectors import (
    ConnectorArrays,
    add_connector_forces,
    connector_loads,
    connector_strains,
    loads_at_rest,
)
from exugear.system.kernels.coordinates import BODY_SIZE, InertiaArrays, SpringArrays, add_spring_forces
from exugear.system.kernels.elastic import ElasticArrays, add_elastic_forces, scratch_for
from exugear.system.kernels.meshes import STATE_SIZE, MeshArrays, gear_positions
from exugear.system.kernels.modal_damping import ModalArrays, add_modal_damping, modal_memory
from exugear.system.kernels.rolling import no_rolling
from exugear.system.kernels.table_law import NOMINAL_DEFLECTION
from exugear.system.kernels.turning import (
    TravellingArrays,
    TurningArrays,
    follow,
    share_travelling_forces,
    travelling_memory,
    travelling_tangent,
)
from exugear.system.kernels.varying_loads import VaryingLoadArrays
from exugear.system.tooth_mesh.contact_state import StaticContacts
from exugear.system.tooth_mesh.element import MeshElement
from exugear.system.tooth_mesh.laws.mesh_forces import add_mesh_forces, add_mesh_jacobian, mesh_state
from exugear.system.tooth_mesh.laws.stiffness import pack
from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.bundles import cached_bundle
from fe_ste.tools.display import ReprMixin
from fe_ste.transmission_error.surface import SteSurface


@dataclass(frozen=True)
class Assembly(ReprMixin):
    """Equations of motion of a gearbox variant."""

    gearbox: Gearbox
    choice: Choice
    """What was assembled; the choice names its inertia set."""
    bodies: tuple[Body, ...]
    """Moving bodies in the order of their coordinates, elastic fixed ones among them."""
    coordinates: Mapping[str, tuple[int, ...]]
    """The six state indices of each body by name, -1 where there is none; of a flexible body those of its main
    seat, and those of each seat under `exugear.gearbox.parts.seat_key`."""
    size: int
    """Number of coordinates."""
    elements: tuple[MeshElement, ...]
    meshes: MeshArrays
    """Mesh elements and their arrays."""
    travelling: TravellingArrays
    """Seats of meshes on an elastic ring; their coordinates follow those of the system."""
    supports: tuple[Bearing, ...]
    connectors: ConnectorArrays
    """Bearings and mounts (none in the variant `rigid`)."""
    spring_names: tuple[str, ...]
    springs: SpringArrays
    """Torsional couplings."""
    inertia: InertiaArrays
    """Mass properties of rigid bodies; in the variant `rigid` the planets' orbit is in the carrier's."""
    elastic_bodies: Mapping[str, ElasticBody]
    """Elastic bodies by name, in the order of their coordinates."""
    elastic: ElasticArrays
    """Matrices of those whose frame does not turn."""
    motions: Floats
    """(size, n) motions that are free; the identity, but for the law `rigid` the rolling ones."""
    rows_stiffness: Floats
    """(supports, 6, 6) stiffness of the rows of catalogue bearings at their static load, for methods that begin
    with linear bearings; zero for other supports."""
    operating_points: tuple[OperatingPoint | None, ...] = ()
    """Of each support, None for those that are no catalogue bearings; empty where there are none."""
    connectors_at_rest: ConnectorArrays | None = None
    """Connectors of static states, in which all catalogue bearings follow their rows; None where they are those of
    motion."""
    contacts: StaticContacts = StaticContacts()
    """Contact of meshes at the static misalignment, where it was solved."""
    modal: ModalArrays | None = None
    """Modal damping, where the file states it."""
    planet_spread: float = 0.0
    """Largest change of stiffness that made bearings of equal planets equal, over that stiffness."""
    known_rest: list[Floats] = field(default_factory=list, init=False, repr=False, compare=False)
    """Coordinates (size,) under the static load once they are known, otherwise empty, as in copies by `replace`."""

    def _line(self) -> str:
        choice = f"{self.variant}, {self.mesh_model}, {self.inertias}"
        return f" {self.gearbox.name!r}, {choice}: {self.size} coordinates, {len(self.elements)} meshes"

    @property
    def variant(self) -> Variant:
        """Variant: how bodies are supported."""
        return self.choice.variant

    @property
    def mesh_model(self) -> str:
        """Mesh model."""
        return self.choice.mesh_model

    @property
    def inertias(self) -> str:
        """Inertia set."""
        return self.choice.inertia_set(self.gearbox)

    def has_six(self, body: Body) -> bool:
        """Return whether a body is rigid with all six coordinates."""
        return self.coordinates[body.name][0] >= 0 and body.name not in self.elastic_bodies

    @cached_property
    def elastic_slices(self) -> dict[str, slice]:
        """Coordinates of each elastic body."""
        begin = self.size - sum(shaft.reduced.size for shaft in self.elastic_bodies.values())
        slices = {}
        for name, shaft in self.elastic_bodies.items():
            slices[name] = slice(begin, begin + shaft.reduced.size)
            begin += shaft.reduced.size
        return slices

    @property
    def floating(self) -> dict[str, FloatingBody]:
        """Bodies that move in floating frames in Exudyn."""
        return {name: body.floating for name, body in self.elastic_bodies.items() if body.floating is not None}

    @cached_property
    def turning(self) -> dict[str, TurningBody]:
        """Elastic bodies in their own turning frame."""
        gravity = self.gearbox.case.gravity.acceleration_m_per_s2
        return {
            name: TurningBody(body.reduced, self.damping_time(name), gravity)
            for name, body in self.elastic_bodies.items()
            if body.reduced.frame == "carrier"
        }

    def damping_time(self, name: str) -> float:
        """Damping over stiffness of an elastic body, s."""
        own = self.elastic_bodies[name].damping_time
        return self.gearbox.case.damping.body_time_s if own is None else own

    @cached_property
    def turning_arrays(self) -> TurningArrays:
        """Arrays of the same bodies."""
        return turning_arrays((self.elastic_slices[name].start, body) for name, body in self.turning.items())

    def with_contacts(self, contacts: StaticContacts) -> Assembly:
        """Let meshes resist deflection and misalignment by contacts that were solved."""
        states = contacts.states
        elements = tuple(
            element.with_contact(states[element.mesh.name]) if element.mesh.name in states else element
            for element in self.elements
        )
        return replace(self, elements=elements, meshes=pack(elements, self.coordinates), contacts=contacts)

    @cached_property
    def has_rows(self) -> bool:
        """Whether bearings are non-linear."""
        return bool(self.connectors.rolling.first[-1] > 0)

    @cached_property
    def at_rest(self) -> Assembly:
        """The same as static states see it: all catalogue bearings follow their rows, whatever their law in motion."""
        if self.connectors_at_rest is None:
            return self
        return replace(self, connectors=self.connectors_at_rest, connectors_at_rest=None)

    @cached_property
    def unloaded(self) -> Assembly:
        """The same with linear bearings through the origin: in balance at zero coordinates, where nothing loads it."""
        none = np.zeros_like(self.connectors.point_load)
        return replace(self, connectors=self.connectors._replace(point_strain=none, point_load=none))

    @cached_property
    def _row_stiffness(self) -> Floats:
        """Stiffness (supports, 6, 6) at the static load of what rows there are; zero for linear supports."""
        return np.where(np.diff(self.connectors.rolling.first)[:, None, None] > 0, self.rows_stiffness, 0.0)

    def with_linear_supports(self, factor: float = 1.0) -> Assembly:
        """Replace the rows of non-linear bearings by their stiffness at the static load times a factor."""
        connectors = self.connectors
        if not self.has_rows:
            return self
        of_rows = factor * self._row_stiffness
        time = connectors.rolling.time[:, None, None]
        linear = connectors._replace(
            stiffness=connectors.stiffness + of_rows,
            damping=connectors.damping + time * of_rows,
            rolling=no_rolling(len(of_rows)),
        )
        return replace(self, connectors=linear)

    def with_added_stiffness(self, share: float) -> Assembly:
        """Add a share of the stiffness of nonlinear bearings to their rows."""
        stiffness = self.connectors.stiffness + share * self._row_stiffness
        if self.has_rows:
            return replace(self, connectors=self.connectors._replace(stiffness=stiffness))
        return self

    def rigid_part(self, vector: Floats) -> Floats:
        """Copy of a vector of coordinates in which a shaft's main seat has the mean motion of the whole shaft.

        It is that of the body's centre of mass, as `coordinates` of a rigid body are.
        """
        out = vector.copy()
        for name, elastic_slice in self.elastic_slices.items():
            body = self.elastic_bodies[name].reduced
            motions = body.rigid_motions(body.rigid_inertia.centre)
            carried = motions.T @ body.mass
            out[list(self.coordinates[name])] = np.linalg.solve(carried @ motions, carried @ vector[elastic_slice])
        return out

    @cached_property
    def housing_factor(self) -> float:
        """Factor on bearings' stiffness that stands for their seats: 1 where an elastic housing has these itself."""
        replaced = self.variant.is_elastic and all(support.factor == 1.0 for support in self.supports)
        if replaced:
            return 1.0
        return self.gearbox.case.housing.factor

    @cached_property
    def bearing_laws(self) -> str:
        """What the force of each bearing follows, planets together: an attribute of files."""
        held = {bearing.name for bearing in self.gearbox.bearings}
        bodies = {body.name: body for body in self.gearbox.bodies()}
        laws = {
            support.family: law_in_words(support, load_stands_still(support, bodies))
            for support in self.supports
            if support.name in held
        }
        return "; ".join(f"{name}: {law}" for name, law in laws.items())

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

    @cached_property
    def tangent_meshes(self) -> MeshArrays:
        """Mesh arrays with laws along a row as straight lines: the tangents at the static load, mean over the cycle."""
        return pack(self.elements, self.coordinates, averaged=True, tangent=True)

    def linear_meshes(self, reversed_flanks: NDArray[np.bool_] | None = None) -> MeshArrays:
        """Mesh arrays that are linear and bilateral, tables replaced by the mean stiffness at their static load.

        Parameters
        ----------
        reversed_flanks : (meshes,) array of bool, optional
            Meshes that press the other flank: their deflection counts from there.
        """
        meshes = pack(self.elements, self.coordinates, averaged=True, linear=True)
        for m, element in enumerate(self.elements):
            if reversed_flanks is not None and reversed_flanks[m] and element.table is not None:
                meshes.table.nominal[m, NOMINAL_DEFLECTION] += element.table.backlash
        return meshes

    def forces(self, q: Floats, v: Floats, meshes: MeshArrays | None = None) -> Floats:
        """Generalized forces of meshes, bearings, couplings, elastic bodies and weight, N and N m.

        At one state (size,) or several (n, size), as the coordinates and velocities have it.
        """
        meshes = self.meshes if meshes is None else meshes
        if q.ndim == 1:
            f = self._forces_of_kernels(q, v, meshes)
        else:
            f = np.array([self._forces_of_kernels(x, u, meshes) for x, u in zip(q, v, strict=True)])
        for name, body in self.turning.items():
            elastic_slice = self.elastic_slices[name]
            f[..., elastic_slice] += body.forces(q[..., elastic_slice].T, v[..., elastic_slice].T).T
        add_connector_forces(q, v, self.connectors, f)
        return f + self.constant_forces

    def _forces_of_kernels(self, q: Floats, v: Floats, meshes: MeshArrays) -> Floats:
        f = self.mesh_forces(q, v, meshes)
        add_spring_forces(q, v, self.springs, f)
        if self.elastic_bodies:
            add_elastic_forces(q, v, self.elastic, scratch_for(self.elastic), f)
        if self.modal is not None:
            add_modal_damping(q, v, cached_bundle(self.modal), modal_memory(self.modal), f)
        return f

    @cached_property
    def constant_forces(self) -> Floats:
        """Generalized forces that never change, shape (size,): of gravity, and of forces on bodies.

        Gravity of bodies in turning frames is not among them: it turns with them.
        """
        f = np.zeros(self.size)
        acceleration = np.array(self.gearbox.case.gravity.acceleration_m_per_s2)
        for body in self.bodies:
            if self.has_six(body):
                f[list(self.coordinates[body.name][:3])] = body.mass * acceleration
        for name, elastic_slice in self.elastic_slices.items():
            if name in self.turning:
                continue
            reduced = self.elastic_bodies[name].reduced
            f[elastic_slice] = reduced.mass @ reduced.rigid_motions(reduced.seats[0].position)[:, :3] @ acceleration
        for force in self.gearbox.forces:
            index, values = self._entries(force.name, force.body, force.position, np.array([*force.wrench, 0j]))
            f[index] += values.real
        return f

    @cached_property
    def varying_loads(self) -> VaryingLoadArrays:
        """Loads of the gearbox file that vary with the angle of a body."""
        loads = self.gearbox.varying_loads
        entries = []
        for load in loads:
            index, values = self._entries(load.excitation, load.body, load.position, np.array(load.wrench))
            if load.reaction_on is not None:
                other, opposite = self._entries(
                    load.excitation, load.reaction_on, load.position, -np.array(load.wrench)
                )
                index, values = np.append(index, other), np.append(values, opposite)
            entries.append((index, values))
        waves = np.concatenate([np.zeros(0, dtype=complex), *(values for _, values in entries)])
        rows = [row for load in loads for row in load.curve]
        return VaryingLoadArrays(
            turning=np.array([self.spin[load.body] for load in loads], dtype=np.int64),
            order=np.array([load.order for load in loads], dtype=np.float64),
            exponent=np.array([load.exponent for load in loads]),
            first=np.cumsum([0] + [len(index) for index, _ in entries]).astype(np.int64),
            coordinate=np.concatenate([np.zeros(0, dtype=np.int64), *(index for index, _ in entries)]),
            wave=np.stack([waves.real, waves.imag], axis=1),
            first_row=np.cumsum([0] + [len(load.curve) for load in loads]).astype(np.int64),
            table=np.array(rows, dtype=np.float64).reshape(-1, 3),
        )

    def wrench_on(self, body: str, position: tuple[float, float, float] | None, wrench: Floats) -> Floats:
        """Generalized forces (size,) of a force and moment (6,), N and N m, on a body at a place (m).

        Without a place they act at the node of the body, of a flexible body at its main seat.
        """
        found = np.zeros(self.size)
        index, values = self._entries("", body, position, wrench.astype(np.complex128))
        found[index] = values.real
        return found

    def _entries(
        self, name: str, body: str, position: tuple[float, float, float] | None, wrench: Complexes
    ) -> tuple[Integers, Complexes]:
        """Coordinates (k,) and generalized forces (k,) of a force and moment (6,), N and N m, on a body at a place (m).

        On a flexible body they act at the seat of `loaded_seat`. Coordinates that the body does not have are left out.
        """
        where = self.coordinates.get(body, (-1,) * BODY_SIZE)
        node = None
        if (seat := self.loaded_seat(name, body)) is not None:
            where = self.coordinates[seat_key(body, seat.name)]
            node = np.array(seat.position)
        elif position is not None:
            node = node_position(next(own for own in self.gearbox.bodies(self.inertias) if own.name == body))
        arm = np.zeros(3) if position is None or node is None else position - node
        acting = np.append(wrench[:3], wrench[3:] + np.cross(arm, wrench[:3]))
        index = np.array(where, dtype=np.int64)
        moves = (index >= 0) & (acting != 0.0)
        return index[moves], acting[moves]

    def loaded_seat(self, name: str, body: str) -> Seat | None:
        """Seat at which a force or an excitation acts on a flexible body: that of its name, or the main seat.

        None if the body is not flexible.
        """
        elastic = self.elastic_bodies.get(body)
        if elastic is None:
            return None
        seats = {seat.name: seat for seat in elastic.reduced.seats}
        return seats.get(elastic.shared_seats.get(name, name), seats[elastic.main_seat])

    def torque_vector(self, torques: Mapping[str, float]) -> Floats:
        """Generalized forces of torques about the bodies' spin axes (N m), shape (size,)."""
        f = np.zeros(self.size)
        for name, torque in torques.items():
            if name not in self.spin:
                raise VariantError(f"no rotating body {name!r} to load; bodies are {', '.join(self.spin)}")
            f[self.spin[name]] += torque
        return f

    def with_travelling(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """States (..., size) as the laws of meshes read them: with the travelling seats' coordinates, if any."""
        if not self.travelling.first.size:
            return q, v
        x, u = follow(np.atleast_2d(q), np.atleast_2d(v), self.travelling)
        return (x, u) if q.ndim > 1 else (x[0], u[0])

    def mesh_forces(self, q: Floats, v: Floats, meshes: MeshArrays) -> Floats:
        """Generalized forces of meshes, shape (size,), N and N m."""
        if not self.travelling.first.size:
            f = np.zeros(self.size)
            add_mesh_forces(q, v, meshes, f)
            return f
        shares = travelling_memory(self.travelling)
        (x,), (u,) = follow(q[None], v[None], self.travelling, shares)
        f = np.zeros(x.size)
        add_mesh_forces(x, u, meshes, f)
        share_travelling_forces(self.travelling, shares, f)
        return f[: self.size]

    def mesh_jacobians(self, q: Floats, v: Floats, meshes: MeshArrays | None = None) -> tuple[Floats, Floats]:
        """Differentiate the forces of the meshes, or others, to q and to v, each (size, size)."""
        meshes = self.meshes if meshes is None else meshes
        x, u = self.with_travelling(q, v)
        jq = np.zeros((x.size, x.size))
        jv = np.zeros((x.size, x.size))
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
        for name, elastic_slice in self.elastic_slices.items():
            m[elastic_slice, elastic_slice] = self.elastic_bodies[name].reduced.mass
        return m

    def mass_at(self, q: Floats) -> Floats:
        """Mass matrix at coordinates q and zero tilts, (size, size)."""
        m = self.mass_matrix.copy()
        for name, body in self.turning.items():
            elastic_slice = self.elastic_slices[name]
            m[elastic_slice, elastic_slice] = body.mass_matrix(q[elastic_slice])
        return m

    def rolling_velocity(self, q: Floats, speeds: Mapping[str, float]) -> Floats:
        """Velocities of the gear train at the given spins, with planets orbiting with their carriers."""
        v = np.zeros(self.size)
        for name, elastic_slice in self.elastic_slices.items():
            v[elastic_slice] = speeds.get(name, 0.0) * self.elastic_bodies[name].reduced.spin
            if name in self.turning:
                v[elastic_slice] = self.turning[name].rolling_velocity(q[elastic_slice], speeds[name])
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
        for name, elastic_slice in self.elastic_slices.items():
            a[elastic_slice] = rates.get(name, 0.0) * self.elastic_bodies[name].reduced.spin
            if name in self.turning:
                a[elastic_slice] = self.turning[name].rolling_acceleration(q[elastic_slice], speeds[name], rates[name])
        for body in self.bodies:
            if body.fixed:
                continue
            a[self.spin[body.name]] = rates[body.name]
            if self.has_six(body) and body.carrier is not None:
                x, y = self._from_carrier_axis(body, q)
                o = self.coordinates[body.name][0]
                w = speeds[body.carrier]
                a[o : o + 2] = rates[body.carrier] * np.array([-y, x]) - w**2 * np.array([x, y])
        return a

    def _from_carrier_axis(self, body: Body, q: Floats) -> tuple[float, float]:
        carrier = next(other for other in self.bodies if other.name == body.carrier)
        o = self.coordinates[body.name][0]
        return body.axis[0] - carrier.axis[0] + float(q[o]), body.axis[1] - carrier.axis[1] + float(q[o + 1])

    def bearing_loads(self, q: Floats, v: Floats) -> Floats:
        """Force and moment that each bearing takes from its body, (..., bearings, 6), global axes, N and N m.

        At one state or several: (..., size), as the coordinates and velocities have it.
        """
        return connector_loads(q, v, self.connectors)

    def support_loads_at_rest(self, q: Floats) -> Floats:
        """Force and moment that each support takes from its body, (supports, 6), in the axes of what it sits on."""
        return loads_at_rest(q, self.connectors)

    def support_strains(self, q: Floats) -> Floats:
        """Displacement of each support's body against what it sits on, (supports, 6), in the axes of the latter."""
        return connector_strains(q, self.connectors)

    def mesh_states(self, q: Floats, v: Floats, meshes: MeshArrays | None = None) -> Floats:
        """State of each mesh, (meshes, 11): columns as named in `exugear.system.kernels.meshes`."""
        out = np.zeros((len(self.elements), STATE_SIZE))
        mesh_state(*self.with_travelling(q, v), self.meshes if meshes is None else meshes, out)
        return out

    def gear_positions(self, q: Floats) -> Floats:
        """Centre distance (m) and misalignment (rad) of each mesh, (meshes, 2)."""
        out = np.zeros((len(self.elements), 2))
        gear_positions(self.with_travelling(q, q)[0], self.meshes, out)
        return out

    def inertia_forces(self, q: Floats, v: Floats, a: Floats) -> Floats:
        """Generalized forces that the accelerations a need, (size,) or (n, size): the inverse of `accelerations`."""
        f = np.zeros(np.broadcast_shapes(q.shape, v.shape, a.shape))
        first = self.inertia.body
        mass, jt, ja = self.inertia.mass, self.inertia.transverse, self.inertia.axial
        sb, cb = np.sin(q[..., first + 4]), np.cos(q[..., first + 4])
        da, db, spin = (v[..., first + n] for n in (3, 4, 5))
        p = ja * (spin + da * sb)
        moves = first[:, None] + np.arange(3)
        f[..., moves] = mass[:, None] * a[..., moves]
        about_z = ja * (a[..., first + 5] + a[..., first + 3] * sb + da * db * cb)
        f[..., first + 5] = about_z
        f[..., first + 3] = jt * cb**2 * a[..., first + 3] + about_z * sb + p * db * cb - 2.0 * jt * da * db * sb * cb
        f[..., first + 4] = jt * a[..., first + 4] + jt * da**2 * sb * cb - p * da * cb
        f[..., self.inertia.spin] = self.inertia.spin_inertia * a[..., self.inertia.spin]
        for name, elastic_slice in self.elastic_slices.items():
            if name in self.turning:
                states = (np.broadcast_to(values, f.shape)[..., elastic_slice].T for values in (q, v, a))
                f[..., elastic_slice] = self.turning[name].inertia_forces(*states).T
            else:
                f[..., elastic_slice] = a[..., elastic_slice] @ self.elastic_bodies[name].reduced.mass.T
        return f


def input_hash(assembly: Assembly, load_case: str | None = None) -> str:
    """SHA-256 of all that the equations of a variant depend on: gearbox file with its solids, choices, mesh stiffness.

    The versions of the methods are part of it. Load cases that are not run leave it as it is.

    Parameters
    ----------
    load_case : for a run: its load case, with the content of its torque series

    Examples
    --------
    >>> from exugear.system.build import assemble
    >>> from exugear.gearbox.choice import Choice
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> gearbox, choice = Gearbox.from_toml("cases/grc750/gearbox.toml"), Choice("bushing")
    >>> softer = gearbox.varied({"housing.factor": 0.2})
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> input_hash(assemble(gearbox, choice, stiffness)) == input_hash(assemble(softer, choice, stiffness))
    False
    """
    gearbox = assembly.gearbox
    series = gearbox.load_cases[load_case].torque_series if load_case else None
    content = {
        "method_version": RUN if load_case else MODES,
        "reduction_version": REDUCTION if assembly.elastic_bodies else None,
        "gearbox": gearbox.computed_content,
        "load": gearbox.content["load_cases"][load_case] if load_case else None,
        "variant": assembly.variant,
        "law": assembly.mesh_model,
        "inertias": assembly.inertias,
        "load_case": load_case,
        "torque_series": hashlib.sha256(series.read_bytes()).hexdigest() if series else None,
        "solids": {
            name: body.file_digest for name, body in assembly.elastic_bodies.items() if body.file_digest is not None
        },
        # Rounded: another machine's last digits must not make another hash.
        "stiffness": {
            element.mesh.name: [f"{value:.9g}" for value in np.atleast_1d(element.stiffness)]
            for element in assembly.elements
        },
        "mesh_tangents": {
            element.mesh.name: [f"{value:.9g}" for value in element.tangent]
            for element in assembly.elements
            if element.is_curved
        },
        "mesh_contact": {
            element.mesh.name: [f"{value:.9g}" for value in astuple(replace(element.contact, cycle=None))[:-1]]
            for element in assembly.elements
            if element.contact is not None
        },
        "load_ways": {
            element.mesh.name: [f"{value:.9g}" for value in element.load_ways.ravel()]
            for element in assembly.elements
            if element.load_ways.size
        },
        "tables": {
            element.mesh.name: _digest(element.table.surface)
            for element in assembly.elements
            if element.table is not None
        },
    }
    if curves := [load.curve for load in gearbox.varying_loads if load.curve]:
        content["excitation_tables"] = [[[f"{value:.9g}" for value in row] for row in curve] for curve in curves]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _digest(surface: SteSurface) -> str:
    """Hash of a table's surface, rounded likewise."""
    arrays = (surface.centre_distance, surface.misalignment, surface.root_force, surface.coefficients)
    text = ",".join(f"{value:.9g}" for values in arrays for value in values.ravel())
    return hashlib.sha256(text.encode()).hexdigest()
