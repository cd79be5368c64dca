"""What a run records: signals per sample and the account of energy, by compiled loops over coordinates."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from exugear.dynamics.assembly import Assembly
from exugear.dynamics.modes import overall_row
from exugear.kernels.connectors import ConnectorArrays, connector_load, connector_motion
from exugear.kernels.elastic import ElasticArrays, elastic_energies, scratch_for
from exugear.kernels.inertia import InertiaArrays, kinetic_energies
from exugear.kernels.meshes import DEFLECTION, ENERGY, FORCE, OUTSIDE, STATE_SIZE, MeshArrays
from exugear.kernels.springs import SpringArrays
from exugear.kernels.turning import TurningArrays, turning_energies, turning_memory
from exugear.model.sections import GROUND
from exugear.tooth_mesh.laws.forms import mesh_state
from exugear.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled

BALANCE_TERMS = (
    "work_of_loads",
    "kinetic_energy",
    "elastic_energy",
    "dissipated_energy",
    "work_of_varying_stiffness",
    "non_conservative_work",
    "bearing_rate_work",
)
"""Loads' work = change of kinetic and elastic energy + the other four.

The last two: what the law `seed` does because its force has parts that its deflection does not see, and what the
bearings do because their rate is not the derivative of their displacement (see `bearing_energies`).
"""


def energy_residual(data: xr.Dataset) -> float:
    """Part of the change of kinetic energy that the account of a run does not explain; NaN without a change."""
    change = {term: float(data[term][-1] - data[term][0]) for term in BALANCE_TERMS}
    explained = sum(value for term, value in change.items() if term != "work_of_loads")
    kinetic = change["kinetic_energy"]
    return (change["work_of_loads"] - explained) / kinetic if kinetic else math.nan


@compiled
def mesh_signals(q: Floats, v: Floats, meshes: MeshArrays, out: Floats) -> None:
    """Fill (samples, 2 m): deflection (m), then F_bt (N) of each mesh; q and v (samples, size)."""
    count = meshes.cycles.size
    state = np.empty((count, STATE_SIZE))
    for n in range(q.shape[0]):
        mesh_state(q[n], v[n], meshes, state)
        for m in range(count):
            out[n, m] = state[m, DEFLECTION]
            out[n, count + m] = state[m, FORCE]


@compiled
def bearing_signals(q: Floats, v: Floats, connectors: ConnectorArrays, out: Floats) -> None:
    """Fill (samples, 3 c): force of each bearing on its body (N), global axes."""
    load, arms = np.empty(6), np.empty((2, 3))
    for n in range(q.shape[0]):
        for c in range(connectors.bodies.shape[0]):
            connector_load(q[n], v[n], c, connectors, arms, load)
            for i in range(3):
                out[n, 3 * c + i] = -load[i]


@compiled
def joint_signals(
    q: Floats, v: Floats, meshes: MeshArrays, ends: Integers, hosts: Integers, planets: Floats, out: Floats
) -> None:
    """Fill (samples, 3 j): force of each ideal joint on its body (N), global axes, in minimal coordinates.

    Parameters
    ----------
    ends : (m, 2) joint that carries gear 1 and gear 2, -1 for none
    hosts : (j,) joint of the body that a joint sits on (the carrier's for a planet), -1 for ground
    planets : (j, 4) mass, x and y from the carrier's axis, coordinate of the carrier's spin; mass 0 else
    """
    state = np.empty((meshes.cycles.size, STATE_SIZE))
    for n in range(q.shape[0]):
        mesh_state(q[n], v[n], meshes, state)
        out[n, :] = 0.0
        for m in range(meshes.cycles.size):
            psi = q[n, meshes.coordinates[m, 12]] if meshes.coordinates[m, 12] >= 0 else 0.0
            cosine, sine = math.cos(psi), math.sin(psi)
            scalar, row = state[m, FORCE] / meshes.line_of_action[m], meshes.force[m]
            if scalar < 0.0 and meshes.table.shape[m, 0] > 0:  # the other flank pushes
                scalar, row = -scalar, meshes.table.back[m]
            for end in range(2):
                j = ends[m, end]
                if j >= 0:
                    x, y, z = row[6 * end : 6 * end + 3]
                    out[n, 3 * j] += scalar * (cosine * x - sine * y)
                    out[n, 3 * j + 1] += scalar * (sine * x + cosine * y)
                    out[n, 3 * j + 2] += scalar * z
        for j in range(hosts.size):
            if planets[j, 0] > 0.0:
                c = int(planets[j, 3])
                cosine, sine = math.cos(q[n, c]), math.sin(q[n, c])
                square = v[n, c] ** 2
                out[n, 3 * j] -= planets[j, 0] * square * (cosine * planets[j, 1] - sine * planets[j, 2])
                out[n, 3 * j + 1] -= planets[j, 0] * square * (sine * planets[j, 1] + cosine * planets[j, 2])
            if hosts[j] >= 0:
                for i in range(3):
                    out[n, 3 * hosts[j] + i] += out[n, 3 * j + i]


@compiled
def mesh_energies(q: Floats, v: Floats, meshes: MeshArrays, state: Floats, out: Floats) -> None:
    """Add elastic energy (J) and the powers (W) damped, of k(PMC), non-conservative to out (5,)."""
    mesh_state(q, v, meshes, state)
    for m in range(meshes.cycles.size):
        for i in range(4):
            out[i] += state[m, ENERGY + i]


@compiled
def bearing_energies(q: Floats, v: Floats, connectors: ConnectorArrays, out: Floats) -> None:
    """Add elastic energy (J), damping power and power of the rate's own (W) of all bearings to out (5,).

    The connector's rate is not the derivative of its displacement (see `connector_motion`): with stiffness that
    couples tilt and translation the elastic force then does a little work of its own, of second order.
    """
    turn, arms, motion = np.empty((3, 3)), np.empty((2, 3)), np.empty((3, 6))
    for n in range(connectors.bodies.shape[0]):
        connector_motion(q, v, n, connectors, turn, arms, motion)
        elastic = connectors.stiffness[n] @ motion[0]
        out[0] += 0.5 * np.dot(motion[0], elastic)
        out[4] += np.dot(elastic, motion[1] - motion[2])
        out[1] += np.dot(motion[1], connectors.damping[n] @ motion[1])


@compiled
def spring_energies(q: Floats, v: Floats, springs: SpringArrays, out: Floats) -> None:
    """Add elastic energy (J) and damping power (W) of all couplings to out (5,)."""
    for n in range(springs.coordinates.shape[0]):
        i, j = springs.coordinates[n]
        out[0] += 0.5 * springs.stiffness[n] * (q[j] - q[i]) ** 2
        out[1] += springs.damping[n] * (v[j] - v[i]) ** 2


@compiled
def energy_signals(
    q: Floats,
    v: Floats,
    meshes: MeshArrays,
    connectors: ConnectorArrays,
    springs: SpringArrays,
    inertia: InertiaArrays,
    out: Floats,
) -> None:
    """Fill (samples, 6): kinetic and elastic energy (J); powers (W) as the last four of `BALANCE_TERMS`."""
    state = np.empty((meshes.cycles.size, STATE_SIZE))
    kinetic = np.empty(inertia.body.size + inertia.spin.size)
    for n in range(q.shape[0]):
        kinetic_energies(q[n], v[n], inertia, kinetic)
        out[n, :] = 0.0
        out[n, 0] = kinetic.sum()
        mesh_energies(q[n], v[n], meshes, state, out[n, 1:])
        bearing_energies(q[n], v[n], connectors, out[n, 1:])
        spring_energies(q[n], v[n], springs, out[n, 1:])


@compiled
def add_elastic_signals(q: Floats, v: Floats, elastic: ElasticArrays, scratch: Floats, out: Floats) -> None:
    """Add kinetic and elastic energy (J) and the damped power (W) of elastic bodies to out (samples, 6)."""
    for n in range(q.shape[0]):
        kinetic, stored, damped = elastic_energies(q[n], v[n], elastic, scratch)
        out[n, 0] += kinetic
        out[n, 1] += stored
        out[n, 2] += damped


@compiled
def add_turning_signals(q: Floats, v: Floats, turning: TurningArrays, memory: Floats, out: Floats) -> None:
    """Add the same of elastic bodies in turning frames."""
    for n in range(q.shape[0]):
        kinetic, stored, damped, _ = turning_energies(q[n], v[n], turning, memory)
        out[n, 0] += kinetic
        out[n, 1] += stored
        out[n, 2] += damped


class Channels:
    """The signals of an assembly, in the order of the columns of :meth:`sample`.

    Columns: spin of the overall input (rad/s), overall DTE (rad), DTE and F_bt of each mesh, force (x, y, z) of
    each support: bearings, or the ideal joints of the variant `rigid`. With the law `table` each mesh has three more:
    change of the centre distance (m), misalignment (rad), and 1 where it is outside its table.
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        overall = assembly.gearbox.case.overall
        self.radius = assembly.gearbox.gears[overall.output_gear].base_radius
        self._overall = overall_row(assembly) / self.radius
        self._input = assembly.spin[overall.input]
        self.mesh_names = assembly.mesh_names
        joints = assembly.gearbox.joints if assembly.variant == "rigid" else ()
        self.support_names = assembly.connector_names or tuple(joint.name for joint in joints)
        self._joints = _joint_arrays(assembly) if joints else None
        self.has_places = LAWS[assembly.law].signals_positions
        first = 2 + 2 * len(self.mesh_names) + 3 * len(self.support_names)
        places = 3 * len(self.mesh_names) if self.has_places else 0
        self.count = first + places
        self.supports = slice(2 + 2 * len(self.mesh_names), first)
        self.places = slice(first, first + places)

    def sample(self, q: Floats, v: Floats) -> Floats:
        """Signals of states q, v (samples, size), shape (samples, count)."""
        meshes = len(self.mesh_names)
        out = np.empty((q.shape[0], self.count))
        out[:, 0] = v[:, self._input]
        out[:, 1] = q @ self._overall
        mesh_signals(*self.assembly.with_travelling(q, v), self.assembly.meshes, out[:, 2 : 2 + 2 * meshes])
        supports = out[:, self.supports]
        if self._joints is not None:
            joint_signals(q, v, self.assembly.meshes, *self._joints, supports)
        else:
            bearing_signals(q, v, self.assembly.connectors, supports)
        if self.has_places:
            for row, x, u in zip(out, q, v, strict=True):
                row[self.places] = self._places(x, u).ravel()
        return out

    def _places(self, q: Floats, v: Floats) -> Floats:
        """Change of centre distance, misalignment, and whether outside the table, (3, meshes)."""
        centre, misalignment = self.assembly.gear_positions(q).T
        nominal = [element.mesh.centre_distance for element in self.assembly.elements]
        return np.array([centre - nominal, misalignment, self.assembly.mesh_states(q, v)[:, OUTSIDE]])

    def mesh_deflections(self, signals: Floats) -> Floats:
        """DTE of each mesh among the columns of `sample`, (samples, meshes), m."""
        return signals[:, 2 : 2 + len(self.mesh_names)]

    def mesh_times(self, signals: Floats) -> Floats:
        """Count the samples, (3, meshes), in which the deflection pulls, teeth are apart, and a table is left."""
        meshes = len(self.mesh_names)
        times = np.zeros((3, meshes))
        if self.has_places:
            times[1] = np.sum(signals[:, 2 + meshes : 2 + 2 * meshes] == 0.0, axis=0)
            times[2] = np.sum(signals[:, self.places][:, 2 * meshes :] > 0.0, axis=0)
        else:
            times[0] = np.sum(self.mesh_deflections(signals) < 0.0, axis=0)
        return times

    def energies(self, q: Floats, v: Floats) -> Floats:
        """Energies and powers of states q, v (samples, size), shape (samples, 6): see `energy_signals`."""
        out = np.empty((q.shape[0], 6))
        a = self.assembly
        energy_signals(*a.with_travelling(q, v), a.meshes, a.connectors, a.springs, a.inertia, out)
        add_elastic_signals(q, v, a.elastic, scratch_for(a.elastic), out)
        add_turning_signals(q, v, a.turning_arrays, turning_memory(a.turning_arrays), out)
        return out


def _joint_arrays(assembly: Assembly) -> tuple[Integers, Integers, Floats]:
    """Build the arrays of `joint_signals`; a planet hands its force on to its carrier's joint."""
    joints = assembly.gearbox.joints
    bodies = {body.name: body for body in assembly.gearbox.bodies(assembly.inertias)}
    number = {joint.body: n for n, joint in enumerate(joints)}
    ends = [[number.get(e.mesh.pinion, -1), number.get(e.mesh.gear, -1)] for e in assembly.elements]
    hosts = [-1 if joint.on == GROUND else number.get(joint.on, -1) for joint in joints]
    planets = np.zeros((len(joints), 4))
    for n, joint in enumerate(joints):
        body = bodies[joint.body]
        if body.carrier is not None:
            axis = np.array(body.axis) - np.array(bodies[body.carrier].axis)
            planets[n] = body.mass, axis[0], axis[1], assembly.spin[body.carrier]
    return np.array(ends, dtype=np.int64).reshape(-1, 2), np.array(hosts, dtype=np.int64), planets
