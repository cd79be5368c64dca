"""Signals and energies by plain loops over the kernels: what the compiled observer is held against.

`sampled` gives the columns of `exugear.system.signals.SignalLayout`, `energies_of` its energies and powers but the
loads'. Also of variants and solvers that the compiled observer does not take.
"""

from __future__ import annotations

import math

import numpy as np

from exugear.gearbox.sections.entries import GROUND
from exugear.system.kernels.elastic import scratch_for
from exugear.system.kernels.meshes import (
    DEFLECTION,
    ENERGY,
    FORCE,
    MEMORY,
    OUTSIDE,
    ROW_SIZE,
    STATE_SIZE,
    mesh_pmc,
    relative_spin,
)
from exugear.system.kernels.rolling import (
    CAGE_DAMPING,
    CAGE_TORQUE,
    DAMPED_PART,
    ELASTIC_PART,
    STORED,
    rolling_forces,
)
from exugear.system.kernels.table_law import scratch_memory
from exugear.system.kernels.turning import set_turning_motion, turning_energies, turning_memory
from exugear.system.modes import overall_row
from exugear.system.signals import signal_layout, turning_bodies
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.friction import friction_part, friction_size
from exugear.system.tooth_mesh.laws.mesh_forces import pass_meshes
from fe_ste.tools.compilation import compiled

from .plain_connectors import connector_load, connector_motion, memory_for, turn_between
from .plain_motion import elastic_energies, kinetic_energies


def sampled(assembly: Assembly, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Signals of states q, v (samples, size), shape (samples, columns)."""
    q, v = np.ascontiguousarray(q), np.ascontiguousarray(v)  # others would have the loops compiled once more
    layout = signal_layout(assembly)
    meshes = len(assembly.mesh_names)
    out = np.empty((q.shape[0], layout.count))
    out[:, layout["input_speed"]] = v[:, [assembly.spin[assembly.gearbox.case.overall.input]]]
    out[:, layout["overall_dte_angle"]] = (q @ (overall_row(assembly) / layout.radius))[:, None]
    deflections_and_forces = np.empty((q.shape[0], 2 * meshes))
    mesh_signals(*assembly.with_travelling(q, v), assembly.meshes, deflections_and_forces)
    out[:, layout["mesh_dte"]] = deflections_and_forces[:, :meshes]
    out[:, layout["mesh_force"]] = deflections_and_forces[:, meshes:]
    if assembly.variant == "rigid":
        joint_signals(q, v, assembly.meshes, *joint_arrays(assembly), out[:, layout["support_force"]])
    else:
        loads = out[:, layout["support_force"]], out[:, layout["support_moment"]]
        bearing_signals(q, v, assembly.connectors, *loads)
    if "misalignment" in layout:
        nominal = [element.mesh.centre_distance for element in assembly.elements]
        for row, x, u in zip(out, q, v, strict=True):
            centre, misalignment = assembly.gear_positions(x).T
            row[layout["centre_distance_change"]] = centre - nominal
            row[layout["misalignment"]] = misalignment
            row[layout["outside_table"]] = assembly.mesh_states(x, u)[:, OUTSIDE]
    if "coupling_torque" in layout:
        stiffness, damping = assembly.springs.stiffness, assembly.springs.damping
        twist, rate = (np.diff(own[:, assembly.springs.coordinates], axis=2)[..., 0] for own in (q, v))
        out[:, layout["coupling_torque"]] = stiffness * twist + damping * rate
    turning = turning_bodies(assembly.gearbox, assembly.spin)
    out[:, layout["body_speed"]] = v[:, [assembly.spin[name] for name in turning]]
    return out


def energies_of(assembly: Assembly, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Kinetic and elastic energy (J), powers (W) but the loads' of states q, v (samples, size), (samples, 7)."""
    q, v = np.ascontiguousarray(q), np.ascontiguousarray(v)
    a, out = assembly, np.empty((q.shape[0], 7))
    energy_signals(*a.with_travelling(q, v), a.meshes, a.connectors, a.springs, a.inertia, out)
    add_elastic_signals(q, v, a.elastic, scratch_for(a.elastic), out)
    add_turning_signals(q, v, a.turning_arrays, turning_memory(a.turning_arrays), out)
    return out


@compiled
def mesh_states(q, v, meshes, out) -> None:
    """Fill (m, 10): what each mesh does, by the readable laws."""
    none = np.empty((0, 0))
    pass_meshes(
        q, v, meshes, meshes.table, out, np.empty(0), none, none, np.empty((MEMORY, ROW_SIZE)), scratch_memory()
    )


@compiled
def mesh_signals(q, v, meshes, out) -> None:
    """Fill (samples, 2 m): deflection (m), then F_bt (N) of each mesh; q and v (samples, size)."""
    count = meshes.cycles.size
    state = np.empty((count, STATE_SIZE))
    for n in range(q.shape[0]):
        mesh_states(q[n], v[n], meshes, state)
        for m in range(count):
            out[n, m] = state[m, DEFLECTION]
            out[n, count + m] = state[m, FORCE]


@compiled
def bearing_signals(q, v, connectors, out, moments) -> None:
    """Fill (samples, 3 c) each: force (N) and moment (N m) of each bearing on its body, global axes."""
    load, arms = np.empty(6), np.empty((2, 3))
    for n in range(q.shape[0]):
        for c in range(connectors.bodies.shape[0]):
            connector_load(q[n], v[n], c, connectors, arms, load)
            for i in range(3):
                out[n, 3 * c + i] = -load[i]
                moments[n, 3 * c + i] = -load[3 + i]


@compiled
def joint_signals(q, v, meshes, ends, hosts, planets, out) -> None:
    """Fill (samples, 3 j): force of each ideal joint on its body (N), global axes, in minimal coordinates.

    Parameters
    ----------
    ends : (m, 2) joint that carries gear 1 and gear 2, -1 for none
    hosts : (j,) joint of the body that a joint sits on (the carrier's for a planet), -1 for ground
    planets : (j, 4) mass, x and y from the carrier's axis, coordinate of the carrier's spin; mass 0 else
    """
    state = np.empty((meshes.cycles.size, STATE_SIZE))
    for n in range(q.shape[0]):
        mesh_states(q[n], v[n], meshes, state)
        out[n, :] = 0.0
        for m in range(meshes.cycles.size):
            psi = q[n, meshes.coordinates[m, 12]] if meshes.coordinates[m, 12] >= 0 else 0.0
            cosine, sine = math.cos(psi), math.sin(psi)
            scalar, row = state[m, FORCE] / meshes.line_of_action[m], meshes.force[m]
            if scalar < 0.0 and meshes.table.shape[m, 0] > 0:  # the other flank pushes
                scalar, row = -scalar, meshes.table.back[m]
            acting = scalar * row
            if meshes.friction_pieces[m] > 0:
                index = meshes.coordinates[m]
                sliding = relative_spin(v[n], index, 0) - relative_spin(v[n], index, 1)
                across = friction_size(state[m, FORCE], sliding, meshes.friction_speed[m])
                across *= friction_part(0, meshes.friction[m], meshes.friction_pieces[m], mesh_pmc(q[n], m, meshes))
                acting = acting + across * meshes.friction_rows[m, 0]
            for end in range(2):
                j = ends[m, end]
                if j >= 0:
                    x, y, z = acting[6 * end : 6 * end + 3]
                    out[n, 3 * j] += cosine * x - sine * y
                    out[n, 3 * j + 1] += sine * x + cosine * y
                    out[n, 3 * j + 2] += z
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
def mesh_energies(q, v, meshes, state, out) -> None:
    """Add elastic energy (J) and the powers (W) damped, of k(PMC), non-conservative, of friction to out (6,)."""
    mesh_states(q, v, meshes, state)
    for m in range(meshes.cycles.size):
        for i in range(5):
            out[i] += state[m, ENERGY + i]


@compiled
def bearing_energies(q, v, connectors, out) -> None:
    """Add elastic energy (J), damping power and power of the rate's own (W) of all bearings to out (6,).

    The connector's rate is not the derivative of its displacement (see `connector_motion`): with stiffness that
    couples tilt and translation the elastic force then does a little work of its own, of second order.
    """
    turn, arms, motion = np.empty((3, 3)), np.empty((2, 3)), np.empty((3, 6))
    forces = memory_for(connectors.rolling)
    for n in range(connectors.bodies.shape[0]):
        connector_motion(q, v, n, connectors, turn, arms, motion)
        offset = connectors.point_load[n] - connectors.stiffness[n] @ connectors.point_strain[n]
        elastic = connectors.stiffness[n] @ motion[0] + offset
        out[0] += 0.5 * np.dot(motion[0], elastic + offset)
        out[5] += np.dot(elastic, motion[1] - motion[2])
        out[1] += np.dot(motion[1], connectors.damping[n] @ motion[1])
        if connectors.rolling.first[n] < connectors.rolling.first[n + 1]:
            turned = turn_between(q, n, connectors)
            rolling_forces(n, motion[0], motion[1], turned, connectors.rolling, forces)
            out[0] += forces[STORED]
            elastic = forces[ELASTIC_PART:DAMPED_PART]
            out[5] += np.dot(elastic, motion[1]) - np.dot(elastic[:5], motion[2, :5])
            out[1] += np.dot(forces[DAMPED_PART:CAGE_TORQUE], motion[1])
            out[1] += forces[CAGE_DAMPING] * turn_between(v, n, connectors)


@compiled
def spring_energies(q, v, springs, out) -> None:
    """Add elastic energy (J) and damping power (W) of all couplings to out (6,)."""
    for n in range(springs.coordinates.shape[0]):
        i, j = springs.coordinates[n]
        out[0] += 0.5 * springs.stiffness[n] * (q[j] - q[i]) ** 2
        out[1] += springs.damping[n] * (v[j] - v[i]) ** 2


@compiled
def energy_signals(
    q,
    v,
    meshes,
    connectors,
    springs,
    inertia,
    out,
) -> None:
    """Fill (samples, 7): kinetic and elastic energy (J); powers (W) as the terms of the account but the loads'."""
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
def add_elastic_signals(q, v, elastic, scratch, out) -> None:
    """Add kinetic and elastic energy (J) and the damped power (W) of elastic bodies to out (samples, 7)."""
    for n in range(q.shape[0]):
        kinetic, stored, damped = elastic_energies(q[n], v[n], elastic, scratch)
        out[n, 0] += kinetic
        out[n, 1] += stored
        out[n, 2] += damped


@compiled
def add_turning_signals(q, v, turning, memory, out) -> None:
    """Add the same of elastic bodies in turning frames."""
    unused = np.zeros(q.shape[1])
    for n in range(q.shape[0]):
        kinetic, stored = turning_energies(q[n], v[n], turning, memory)
        damped = set_turning_motion(q[n], v[n], np.zeros(q.shape[1]), True, turning, memory, unused)
        out[n, 0] += kinetic
        out[n, 1] += stored
        out[n, 2] += damped


def joint_arrays(assembly: Assembly) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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
