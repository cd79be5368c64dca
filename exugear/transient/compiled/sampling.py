"""Compiled signals, energies and powers of the last evaluated state.

Observable signals are listed in `exugear.system.signals.SIGNALS`, with the kernel here that fills each. The columns of
the signals in a sample are passed as `Columns`.
"""

from __future__ import annotations

from typing import NamedTuple

from exugear.system.kernels.coordinates import (
    AXIAL,
    BODY_SIZE,
    COSINE,
    PADDED,
    PADDED_TILT,
    SINE,
    SPIN,
    TILT,
)
from exugear.system.kernels.elastic import motion_energies
from exugear.system.kernels.meshes import (
    CENTRE_CHANGE,
    CYCLE_POWER,
    DAMPED_POWER,
    DEFLECTION,
    DISSIPATED,
    ELASTIC,
    ENERGY,
    FORCE,
    FRICTION,
    FRICTION_POWER,
    KINETIC,
    MISALIGNMENT,
    NON_CONSERVATIVE,
    OF_BEARING_RATES,
    OF_FRICTION,
    OF_LOADS,
    OF_VARYING_STIFFNESS,
    OTHER_POWER,
    OUTSIDE,
    Meshes,
)
from exugear.system.kernels.rolling import (
    CAGE_DAMPING,
    DAMPED_PART,
    ELASTIC_PART,
    STORED,
    RollingArrays,
    rolling_forces,
)
from exugear.system.kernels.table_law import TableArrays
from exugear.system.kernels.turning import turning_energies, turning_weight_power
from exugear.system.signals import SignalLayout
from exugear.system.tooth_mesh.laws.table import TABLE_FORM
from exugear.transient.compiled.equations import set_loads, tilt_sines, turn_between
from exugear.transient.compiled.packing import (
    COS_B,
    DAMPED,
    LAG,
    OFFSET,
    SIN_B,
    SUPPORT_LOAD,
    W_X,
    W_Y,
    W_Z,
    Bodies,
    Connectors,
    Equations,
    Joints,
    Loads,
    Pairs,
    Springs,
    Work,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, all_eight, eight, put, sum_of


class Columns(NamedTuple):
    """First column of each signal that a kernel here fills; -1 where a run does not hold it.

    The fields have the names of the signals. Signals of each mesh take one column a mesh, forces and moments of
    supports three each.
    """

    mesh_dte: int
    mesh_force: int
    support_force: int
    support_moment: int
    centre_distance_change: int
    misalignment: int
    outside_table: int


@kernel
def observe_meshes(meshes: Meshes, work: Work, columns: Columns, sample: Floats, energy: Floats) -> None:
    """Fill the signals of each mesh into a sample; add energy and powers (see `take_sample`)."""
    for m in range(meshes.coordinates.shape[0]):
        state = work.mesh.states[m]
        sample[columns.mesh_dte + m] = state[DEFLECTION]
        sample[columns.mesh_force + m] = state[FORCE]
        energy[ELASTIC] += state[ENERGY]
        energy[DISSIPATED] += state[DAMPED_POWER]
        energy[OF_VARYING_STIFFNESS] += state[CYCLE_POWER]
        energy[NON_CONSERVATIVE] += state[OTHER_POWER]
        energy[OF_FRICTION] += state[FRICTION_POWER]
        if meshes.arrays.form[m] == TABLE_FORM:
            sample[columns.outside_table + m] = state[OUTSIDE]
            sample[columns.centre_distance_change + m] = state[CENTRE_CHANGE]
            sample[columns.misalignment + m] = state[MISALIGNMENT]


@kernel
def true_rate(strain: Floats, rate: Floats, first_body: Floats, out: Floats) -> None:
    """Fill the derivative of a connector's strain: see `exugear.system.kernels.connectors`."""
    d = strain
    w = rate
    x = first_body[0] * first_body[W_X] + first_body[3] * first_body[W_Y] + first_body[6] * first_body[W_Z]
    y = first_body[1] * first_body[W_X] + first_body[4] * first_body[W_Y] + first_body[7] * first_body[W_Z]
    z = first_body[2] * first_body[W_X] + first_body[5] * first_body[W_Y] + first_body[8] * first_body[W_Z]
    out[0] = w[0] - y * d[2] + z * d[1]
    out[1] = w[1] - z * d[0] + x * d[2]
    out[2] = w[2] - x * d[1] + y * d[0]
    (ca, sa), (cb, sb) = tilt_sines(d[TILT]), tilt_sines(d[TILT + 1])
    out[SPIN] = (ca * w[SPIN] - sa * w[TILT + 1]) / cb
    out[TILT + 1] = ca * w[TILT + 1] + sa * w[SPIN]
    out[TILT] = w[TILT] - sb * out[SPIN]


@kernel
def observe_supports(connectors: Connectors, work: Work, columns: Columns, sample: Floats) -> None:
    """Fill force (N) and moment (N m) of each bearing on its body, global axes."""
    for n in range(connectors.ends.shape[0]):
        turn = work.frames[connectors.ends[n, 0]]
        support = work.supports[n]
        for part in range(2):
            place = SUPPORT_LOAD + 3 * part
            x = support[place]
            y = support[place + 1]
            z = support[place + 2]
            first = (columns.support_moment if part else columns.support_force) + 3 * connectors.number[n]
            sample[first] = -(turn[0] * x + turn[1] * y + turn[2] * z)
            sample[first + 1] = -(turn[3] * x + turn[4] * y + turn[5] * z)
            sample[first + 2] = -(turn[6] * x + turn[7] * y + turn[8] * z)


@kernel
def observe_rolling(
    q: Floats,
    v: Floats,
    n: int,
    stride: int,
    derivative: Floats,
    bodies: Bodies,
    connectors: Connectors,
    rolling: RollingArrays | None,
    work: Work,
    energy: Floats,
) -> None:
    """Add energy and powers of the rolling law of connector n, if it has one (see `take_sample`)."""
    if rolling is None:
        return
    if rolling.first[n] == rolling.first[n + 1]:
        return
    strain = work.supports[n, :BODY_SIZE]
    rate = work.supports[n, BODY_SIZE:SUPPORT_LOAD]
    rolling_forces(n, strain, rate, turn_between(q, n, bodies, connectors), rolling, work.rolling)
    energy[ELASTIC] += work.rolling[STORED]
    energy[DISSIPATED] += stride * work.rolling[CAGE_DAMPING] * turn_between(v, n, bodies, connectors)
    for i in range(BODY_SIZE):
        elastic = work.rolling[ELASTIC_PART + i]
        damped = work.rolling[DAMPED_PART + i]
        energy[DISSIPATED] += stride * damped * rate[i]
        # The potential knows no angle about z, whose moment but keeps the others from working on the spin.
        energy[OF_BEARING_RATES] += stride * elastic * (rate[i] - (derivative[i] if i < SPIN else 0.0))


@kernel
def observe_connectors(
    q: Floats,
    v: Floats,
    stride: int,
    bodies: Bodies,
    connectors: Connectors,
    pairs: Pairs,
    work: Work,
    energy: Floats,
) -> None:
    """Add energy and powers of all bearings, these for `stride` samples (see `take_sample`)."""
    derivative = work.motion
    for n in range(connectors.ends.shape[0]):
        strain = work.supports[n, :BODY_SIZE]
        rate = work.supports[n, BODY_SIZE:SUPPORT_LOAD]
        true_rate(strain, rate, work.frames[connectors.ends[n, 0]], derivative)
        one = pairs.data[n]
        damping = all_eight(0.0)
        elastic = damping
        for column in range(BODY_SIZE):
            of_column = eight(one, PADDED * column)
            elastic = elastic + of_column * strain[column]
            damping = damping + of_column * rate[column]
        put(work.motion, PADDED, elastic)
        put(work.motion, 2 * PADDED, damping * one[LAG])
        stored = 0.0
        lost = 0.0
        turned = 0.0
        for row in range(BODY_SIZE):
            place = row if row < TILT else row - TILT + PADDED_TILT
            force = work.motion[PADDED + place]
            damped = work.motion[2 * PADDED + place]
            offset = one[OFFSET + place]
            if one[DAMPED] == 1.0:
                for column in range(BODY_SIZE):
                    damped += connectors.damping[n, column, row] * rate[column]
            stored += (force + 2.0 * offset) * strain[row]
            lost += damped * rate[row]
            turned += (force + offset) * (rate[row] - derivative[row])
        energy[ELASTIC] += 0.5 * stored
        energy[DISSIPATED] += stride * lost
        energy[OF_BEARING_RATES] += stride * turned
        observe_rolling(q, v, n, stride, derivative, bodies, connectors, connectors.rolling, work, energy)


@kernel
def acting_row(m: int, meshes: Meshes, table: TableArrays | None, work: Work) -> tuple[float, Floats]:
    """Scalar force of mesh m (N) and the row that it acts along."""
    force = work.mesh.states[m, FORCE] / meshes.arrays.line_of_action[m]
    row = meshes.arrays.force[m]
    if table is None:
        return force, row
    if force < 0.0 and meshes.arrays.form[m] == TABLE_FORM:  # the other flank pushes
        return -force, table.back[m]
    return force, row


@kernel
def observe_joints(
    v: Floats,
    meshes: Meshes,
    table: TableArrays | None,
    joints: Joints | None,
    work: Work,
    columns: Columns,
    sample: Floats,
) -> None:
    """Fill the force of each ideal joint, if any, on its body (N), global axes."""
    if joints is None:
        return
    forces = sample[columns.support_force : columns.support_force + 3 * joints.host.size]
    forces[:] = 0.0
    for m in range(meshes.coordinates.shape[0]):
        c = work.turns[meshes.slot[m], COSINE]
        s = work.turns[meshes.slot[m], SINE]
        for end in range(2):
            j = joints.ends[m, end]
            if j >= 0:
                force, row = acting_row(m, meshes, table, work)
                across = work.mesh.states[m, FRICTION]
                along_x = BODY_SIZE * end
                x = force * row[along_x] + across * meshes.arrays.friction_rows[m, 0, along_x]
                y = force * row[along_x + 1] + across * meshes.arrays.friction_rows[m, 0, along_x + 1]
                forces[3 * j] += c * x - s * y
                forces[3 * j + 1] += s * x + c * y
                forces[3 * j + 2] += force * row[along_x + AXIAL]
    for j in range(joints.host.size):
        if joints.planet[j, 0] > 0.0:  # held on its orbit
            c = work.turns[joints.slot[j], COSINE]
            s = work.turns[joints.slot[j], SINE]
            pull = joints.planet[j, 0] * v[joints.carrier[j]] * v[joints.carrier[j]]
            forces[3 * j] -= pull * (c * joints.planet[j, 1] - s * joints.planet[j, 2])
            forces[3 * j + 1] -= pull * (s * joints.planet[j, 1] + c * joints.planet[j, 2])
        if joints.host[j] >= 0:  # hands its force on to the joint of the body that it sits on
            for i in range(3):
                forces[3 * joints.host[j] + i] += forces[3 * j + i]


@kernel
def observe_bodies(q: Floats, v: Floats, bodies: Bodies, work: Work, energy: Floats) -> None:
    """Add the kinetic energy of all bodies (see `take_sample`)."""
    for n in range(bodies.mass.size):
        o = bodies.start[n]
        sb = work.frames[n, SIN_B]
        cb = work.frames[n, COS_B]
        square = v[o] * v[o] + v[o + 1] * v[o + 1] + v[o + 2] * v[o + 2]
        turning = v[o + TILT] * cb
        tilting = turning * turning + v[o + TILT + 1] * v[o + TILT + 1]
        spin = v[o + SPIN] + v[o + TILT] * sb
        twice = bodies.mass[n] * square + bodies.transverse[n] * tilting + bodies.axial[n] * spin * spin
        energy[KINETIC] += 0.5 * twice
    for n in range(bodies.spin.size):
        spin = v[bodies.spin[n]]
        energy[KINETIC] += 0.5 * bodies.spin_inertia[n] * spin * spin


@kernel
def observe_springs(q: Floats, v: Floats, stride: int, springs: Springs, energy: Floats) -> None:
    """Add elastic energy and damping power of the torsional springs (see `take_sample`)."""
    for n in range(springs.ends.shape[0]):
        i = springs.ends[n, 0]
        j = springs.ends[n, 1]
        twist = q[j] - q[i]
        rate = v[j] - v[i]
        energy[ELASTIC] += 0.5 * springs.stiffness[n] * twist * twist
        energy[DISSIPATED] += stride * springs.damping[n] * rate * rate


@kernel
def observe_elastic_bodies(
    q: Floats, v: Floats, stride: int, whole: bool, equations: Equations, work: Work, energy: Floats
) -> None:
    """Add powers of elastic bodies, in fixed and in turning frames, for `stride` samples; if `whole`, energies too."""
    if whole:
        kinetic, stored = motion_energies(q, v, equations.elastic, work.scratch)
        energy[KINETIC] += kinetic
        energy[ELASTIC] += stored
        kinetic, stored = turning_energies(q, v, equations.turning, work.memory)
        energy[KINETIC] += kinetic
        energy[ELASTIC] += stored
    energy[OF_LOADS] += stride * turning_weight_power(q, v, equations.turning, work.memory)
    energy[DISSIPATED] += stride * (work.damped[0] + work.damped[1] + work.damped[2])


@kernel
def observe_loads(t: float, q: Floats, v: Floats, loads: Loads, work: Work, energy: Floats) -> None:
    """Add the power of what acts from outside at time t (s); nothing acts on travelling seats."""
    set_loads(t, q, v, loads, work.series, work.force)
    power = all_eight(0.0)
    for i in range(0, v.size, SIZE):
        power = power + eight(work.force, i) * eight(v, i)
    energy[OF_LOADS] += sum_of(power)


@kernel
def take_sample(
    t: float,
    q: Floats,
    v: Floats,
    equations: Equations,
    work: Work,
    columns: Columns,
    stride: int,
    whole: bool,
    sample: Floats,
    energy: Floats,
) -> None:
    """Fill signals (columns,) and energies and powers (8,) of the state at time t (s) that was evaluated last.

    Signals but those that a state has by itself (`exugear.transient.compiled.solver`); energies in the columns
    `KINETIC` and so on. Powers but those of meshes and loads stand for `stride` samples, none at 0: they take longer
    than the signals. Energies of bodies are left out unless it is `whole`.
    """
    for i in range(energy.size):
        energy[i] = 0.0
    observe_meshes(equations.meshes, work, columns, sample, energy)
    observe_supports(equations.connectors, work, columns, sample)
    observe_joints(v, equations.meshes, equations.meshes.table, equations.joints, work, columns, sample)
    observe_loads(t, q, v, equations.loads, work, energy)
    if stride > 0 and whole:
        observe_bodies(q, v, equations.bodies, work, energy)
    if stride > 0:
        observe_connectors(q, v, stride, equations.bodies, equations.connectors, equations.pairs, work, energy)
        observe_springs(q, v, stride, equations.springs, energy)
        observe_elastic_bodies(q, v, stride, whole, equations, work, energy)


def columns_of(layout: SignalLayout) -> Columns:
    """Columns of a layout, as the kernels take them."""
    return Columns._make(layout[name].start if name in layout else -1 for name in Columns._fields)
