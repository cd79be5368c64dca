"""Signals and energies of states, observed by one compiled loop over the arrays of the compiled solver."""

from __future__ import annotations

import math

import numpy as np

from exugear.dynamics.modes import overall_row
from exugear.dynamics.signals import Channels
from exugear.kernels.elastic import elastic_energies
from exugear.kernels.fast_meshes import (
    ALONG_FORCE,
    LAST_DEFLECTION,
    LAST_FORCE,
    LAST_OUTSIDE,
    Meshes,
    mesh_row,
)
from exugear.kernels.table_law import ENERGY_DERIVATIVES
from exugear.kernels.travelling import place_travelling
from exugear.kernels.turning import turning_energies
from exugear.solvers.compiled.arrays import Bodies, Connectors, Equations, Joints, Work
from exugear.solvers.compiled.connectors import move_connector, place_bodies
from exugear.solvers.compiled.equations import set_loads
from exugear.solvers.compiled.meshes import mesh_law, mesh_motion
from exugear.solvers.compiled.packing import equations_of, work_for
from exugear.solvers.loads import LoadTable
from exugear.tooth_mesh.laws.table import TABLE_FORM, fast_table_force
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel


@kernel
def place_signals(q: Floats, v: Floats, m: int, meshes: Meshes, work: Work, places: Floats) -> None:
    """Fill change of centre distance (m) and misalignment (rad) of mesh m."""
    table, index, axis = meshes.table, meshes.coordinates[m], meshes.axis[m]
    c, s = work.turns[meshes.slot[m], 0], work.turns[meshes.slot[m], 1]
    count = meshes.coordinates.shape[0]
    places[m] = mesh_row(q, v, index, axis, table.centre[m], c, s, work.mesh.gradient[ALONG_FORCE])[0]
    tilted = mesh_row(q, v, index, axis, table.misalignment[m], c, s, work.mesh.gradient[ALONG_FORCE])[0]
    places[count + m] = table.nominal[m, 2] + tilted


@kernel
def observe_meshes(q: Floats, v: Floats, meshes: Meshes, work: Work, signals: Floats, energy: Floats) -> None:
    """Fill deflection and F_bt of each mesh into signals (2 m,); add energy and powers (see `observe`).

    With tables, change of centre distance, misalignment and whether outside the table follow at the end (3 m,).

    The scalar force of each mesh, or that along its line of action, is left in `work.mesh.states`.
    """
    count = meshes.coordinates.shape[0]
    for m in range(count):
        if meshes.form[m] == TABLE_FORM:
            c, s = work.turns[meshes.slot[m], 0], work.turns[meshes.slot[m], 1]
            force = fast_table_force(q, v, m, ENERGY_DERIVATIVES, meshes, c, s, work.mesh, energy)
            work.mesh.states[m, LAST_FORCE] = force
            signals[m], signals[count + m] = work.mesh.states[m, LAST_DEFLECTION], force
            places = signals[signals.size - 3 * count :]
            places[m], places[count + m] = 0.0, meshes.table.nominal[m, 2]
            places[2 * count + m] = work.mesh.states[m, LAST_OUTSIDE]
            if meshes.spinning[m] == 0:
                place_signals(q, v, m, meshes, work, places)
            continue
        delta, rate, acting = mesh_motion(q, v, m, meshes, work)
        elastic, _, _, stored, cycle_power = mesh_law(q, v, m, delta, meshes)
        force = elastic + meshes.damping[m] * rate
        work.mesh.states[m, LAST_FORCE] = force
        signals[m], signals[count + m] = delta, force * meshes.line_of_action[m]
        energy[1] += stored
        energy[3] += meshes.damping[m] * rate * rate
        energy[4] += cycle_power
        energy[5] += force * (acting - rate)


@kernel
def true_rate(n: int, first_body: Floats, work: Work) -> None:
    """Fill the derivative of the strain into `work.motion[2]`: see `exugear.kernels.connectors.connector_motion`."""
    d, w, out = work.motion[0], work.motion[1], work.motion[2]
    x = first_body[0] * first_body[9] + first_body[3] * first_body[10] + first_body[6] * first_body[11]
    y = first_body[1] * first_body[9] + first_body[4] * first_body[10] + first_body[7] * first_body[11]
    z = first_body[2] * first_body[9] + first_body[5] * first_body[10] + first_body[8] * first_body[11]
    out[0] = w[0] - y * d[2] + z * d[1]
    out[1] = w[1] - z * d[0] + x * d[2]
    out[2] = w[2] - x * d[1] + y * d[0]
    c, s = math.cos(d[3]), math.sin(d[3])
    out[5] = (c * w[5] - s * w[4]) / math.cos(d[4])
    out[4] = c * w[4] + s * w[5]
    out[3] = w[3] - math.sin(d[4]) * out[5]


@kernel
def observe_connectors(
    q: Floats, v: Floats, bodies: Bodies, connectors: Connectors, work: Work, signals: Floats, energy: Floats
) -> None:
    """Fill the force of each bearing on its body (3 c,), global axes; add energy and powers (see `observe`)."""
    for n in range(connectors.ends.shape[0]):
        move_connector(q, v, n, bodies, connectors, work)
        turn = work.frames[connectors.ends[n, 0]]
        true_rate(n, turn, work)
        strain, rate, true, own = work.motion[0], work.motion[1], work.motion[2], work.motion[3]
        own[:] = 0.0
        for entry in range(connectors.first[n], connectors.first[n + 1]):
            row, column = connectors.row[entry], connectors.column[entry]
            elastic = connectors.stiffness[entry] * strain[column]
            damped = connectors.damping[entry] * rate[column]
            own[row] += elastic + damped
            energy[1] += 0.5 * elastic * strain[row]
            energy[3] += damped * rate[row]
            energy[6] += elastic * (rate[row] - true[row])
        first = 3 * connectors.number[n]
        for i in range(3):
            o = 3 * i
            signals[first + i] = -(turn[o] * own[0] + turn[o + 1] * own[1] + turn[o + 2] * own[2])


@kernel
def observe_joints(v: Floats, meshes: Meshes, joints: Joints, work: Work, signals: Floats) -> None:
    """Fill the force of each ideal joint on its body (3 j,), global axes; after `observe_meshes`."""
    signals[:] = 0.0
    for m in range(meshes.coordinates.shape[0]):
        c, s = work.turns[meshes.slot[m], 0], work.turns[meshes.slot[m], 1]
        for end in range(2):
            j = joints.ends[m, end]
            if j >= 0:
                force = work.mesh.states[m, LAST_FORCE]
                row = meshes.force[m]
                if force < 0.0 and meshes.table.shape[m, 0] > 0:  # the other flank pushes
                    force, row = -force, meshes.table.back[m]
                x, y, z = row[6 * end], row[6 * end + 1], row[6 * end + 2]
                signals[3 * j] += force * (c * x - s * y)
                signals[3 * j + 1] += force * (s * x + c * y)
                signals[3 * j + 2] += force * z
    for j in range(joints.host.size):
        if joints.planet[j, 0] > 0.0:
            c, s = work.turns[joints.slot[j], 0], work.turns[joints.slot[j], 1]
            pull = joints.planet[j, 0] * v[joints.carrier[j]] ** 2
            signals[3 * j] -= pull * (c * joints.planet[j, 1] - s * joints.planet[j, 2])
            signals[3 * j + 1] -= pull * (s * joints.planet[j, 1] + c * joints.planet[j, 2])
        if joints.host[j] >= 0:
            for i in range(3):
                signals[3 * joints.host[j] + i] += signals[3 * j + i]


@kernel
def observe_bodies(q: Floats, v: Floats, bodies: Bodies, work: Work, energy: Floats) -> None:
    """Add the kinetic energy of all bodies (see `observe`)."""
    for n in range(bodies.mass.size):
        o, sb, cb = bodies.start[n], work.frames[n, 14], work.frames[n, 15]
        square = v[o] * v[o] + v[o + 1] * v[o + 1] + v[o + 2] * v[o + 2]
        tilting = (v[o + 3] * cb) ** 2 + v[o + 4] * v[o + 4]
        spin = v[o + 5] + v[o + 3] * sb
        energy[0] += 0.5 * (bodies.mass[n] * square + bodies.transverse[n] * tilting + bodies.axial[n] * spin * spin)
    for n in range(bodies.spin.size):
        energy[0] += 0.5 * bodies.spin_inertia[n] * v[bodies.spin[n]] ** 2


@kernel
def observe(
    time: Floats, q: Floats, v: Floats, equations: Equations, work: Work, signals: Floats, energies: Floats
) -> None:
    """Fill signals (samples, 2 m + 3 supports) and energies (samples, 7) of states q, v (samples, size).

    Signals: deflection and F_bt of each mesh, force of each bearing or ideal joint, with tables where the gears stand
    (`exugear.dynamics.signals`). Energies: kinetic and elastic (J); powers (W) of the loads, damped, of k(PMC),
    non-conservative of meshes and of bearings.
    """
    size = q.shape[1]
    meshes, springs = equations.meshes, equations.springs
    two = 2 * meshes.coordinates.shape[0]
    x, u, f = work.stage_q, work.stage_v, work.force
    for n in range(q.shape[0]):
        energy = energies[n]
        energy[:] = 0.0
        for i in range(size):
            x[i], u[i] = q[n, i], v[n, i]
        place_bodies(x, u, equations.bodies, work)
        observe_bodies(x, u, equations.bodies, work, energy)
        place_travelling(x, u, equations.travelling)
        observe_meshes(x, u, meshes, work, signals[n], energy)
        observe_connectors(x, u, equations.bodies, equations.connectors, work, signals[n, two:], energy)
        if equations.joints.host.size > 0:
            observe_joints(u, meshes, equations.joints, work, signals[n, two : two + 3 * equations.joints.host.size])
        for s in range(springs.ends.shape[0]):
            i, j = springs.ends[s, 0], springs.ends[s, 1]
            energy[1] += 0.5 * springs.stiffness[s] * (x[j] - x[i]) ** 2
            energy[3] += springs.damping[s] * (u[j] - u[i]) ** 2
        kinetic, stored, damped = elastic_energies(x, u, equations.elastic, work.scratch)
        energy[0] += kinetic
        energy[1] += stored
        energy[3] += damped
        kinetic, stored, damped, weight = turning_energies(x, u, equations.turning, work.memory)
        energy[0] += kinetic
        energy[1] += stored
        energy[2] += weight
        energy[3] += damped
        set_loads(time[n], x, u, equations.loads, work.series, f)
        for i in range(size):
            energy[2] += f[i] * u[i]


class Observer:
    """Signals and energies of states by one compiled loop; columns as those of `exugear.dynamics.signals.Channels`."""

    def __init__(self, channels: Channels, loads: LoadTable) -> None:
        assembly = channels.assembly
        overall = assembly.gearbox.case.overall
        self._count = channels.count
        self._input = assembly.spin[overall.input]
        self._overall = overall_row(assembly) / channels.radius
        self._equations = equations_of(assembly, loads)
        self._work = work_for(self._equations, np.zeros(assembly.size), np.zeros(assembly.size))

    def observe(self, time: Floats, q: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """Signals (samples, count), energies (samples, 2) in J and powers (samples, 5) in W of states q, v.

        The powers are those of the loads, damping, k(PMC), and non-conservative forces of meshes and bearings.
        """
        signals, energies = np.empty((len(time), self._count)), np.empty((len(time), 7))
        signals[:, 0] = v[:, self._input]
        signals[:, 1] = q @ self._overall
        observe(time, q, v, self._equations, self._work, signals[:, 2:], energies)
        return signals, energies[:, :2], energies[:, 2:]
