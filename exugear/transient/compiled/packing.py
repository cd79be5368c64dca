"""An assembly and its loads as the arrays of the compiled solver.

Names of columns become part of machine code: `fe_ste.tools.compilation` recompiles when this file changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exugear.gearbox.sections.entries import GROUND
from exugear.system.kernels.coordinates import BODY_SIZE, PADDED, PADDED_TILT, SPIN, TILT
from exugear.system.kernels.elastic import ElasticMotion, elastic_motion, scratch_for
from exugear.system.kernels.meshes import (
    FRAME,
    PADDED_FRAME,
    ROW_SIZE,
    SPIN_1,
    SPIN_2,
    STATES_SIZE,
    TILT_REST,
    TILT_STIFFNESS,
    MeshArrays,
    Meshes,
    MeshMemory,
    padded_rows,
)
from exugear.system.kernels.modal_damping import ModalArrays, modal_memory
from exugear.system.kernels.products import filled_up
from exugear.system.kernels.rolling import RollingArrays, rolling_memory
from exugear.system.kernels.table_law import DAMPING_SIZE, NOMINAL_DEFLECTION, NOMINAL_MISALIGNMENT, scratch_memory
from exugear.system.kernels.turning import TravellingArrays, TurningArrays, travelling_memory, turning_memory
from exugear.system.kernels.varying_loads import VaryingLoadArrays, no_varying_loads
from exugear.system.loads import LoadTable
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.laws.table import TABLE_FORM
from fe_ste.tools.arrays import Booleans, Floats, Integers

# Arrays of the compiled solver: what its right-hand side reads, and its working memory

STIFFNESS, DAMPING, ANGLE, SPEED, HALF_ACCELERATION = range(5)
"""Columns of `Loads.law`."""
W_X, W_Y, W_Z, SIN_A, COS_A, SIN_B, COS_B = range(9, 16)
"""Columns of `Work.frames` behind the rotation matrix, row by row: angular velocity, sine and cosine of the tilts."""
FRAME_SIZE = 16
WRENCH = PADDED
"""First column of force and moment, global axes, in `Work.loads`, behind the generalized forces."""
RELATIVE_PLACE, RELATIVE_AXIS, RELATIVE_VELOCITY, FIRST_TURNING, SECOND_TURNING, RELATIVE_TILT = range(0, 18, 3)
RELATIVE_SIZE = 18
"""First columns of `Work.relative` and their number: all seen in the first body's axes."""
OFFSET, FIRST_ARM, LAG, SECOND_ARM, OFF_AXIS, GAP, NODES, DAMPED = 48, 56, 59, 60, 63, 64, 67, 70
"""Columns of `Pairs.data` behind the six columns of the stiffness, `PADDED` each."""
PAIR_SIZE = 72
SUPPORT_LOAD, SUPPORT_SIZE = 12, 18
"""Column of force and moment in `Work.supports`, behind strain and rate, and number of columns."""


class Bodies(NamedTuple):
    """Bodies with six coordinates, seats of elastic bodies, the ground; then bodies with their spin alone."""

    start: Integers
    """(b + e + 1,) first coordinate, of the rigid ones, then of seats, then one that stays zero for the ground."""
    slot: Integers
    """(b + e + 1,) where `Work.turns` has the sine of the spin, 0 where no law needs it."""
    mass: Floats
    transverse: Floats
    axial: Floats
    """(b,) kg, kg m2."""
    shares: Floats
    """(b, 3) one over each of them: to multiply by is cheaper."""
    spin: Integers
    spin_inertia: Floats
    """(s,) coordinate and kg m2 of bodies with their spin alone."""
    inverse: Floats
    """(s, s) inverse mass matrix of these spins for a kinematic gear train, else (0, 0)."""
    turning: Integers
    """(k,) coordinates whose sine is needed; the first is one that stays zero."""


class Connectors(NamedTuple):
    """6x6 connectors, those between the same bodies one after the other."""

    number: Integers
    """(c,) position of each connector in the assembly."""
    ends: Integers
    """(c, 2) numbers of the two bodies in `Bodies`."""
    damping: Floats
    """(c, 6, 6) by column and row, N s/m .. N m s/rad, where it is not in proportion to the stiffness."""
    rolling: RollingArrays | None
    """Rolling laws, in parallel to these; None where there are none."""


class Places(NamedTuple):
    """Places of bodies and seats, numbered as in `Bodies`; then those of seats that only meshes act on."""

    start: Integers
    """(p,) first of the six coordinates."""
    spin: Integers
    """(s,) spins of bodies with spin only, whose positions follow, where a mesh connects them with other bodies."""


class Pairs(NamedTuple):
    """Pairs of bodies with connectors between them; p pairs, c connectors in the order of `Connectors`."""

    ends: Integers
    """(p, 2) numbers of the two bodies in `Bodies`."""
    first: Integers
    """(p + 1,) first connector of each pair."""
    twisting: Integers
    """(p,) 1 where the angle about z acts, else 0."""
    data: Floats
    """(c, 72) stiffness by column, rows padded to x y z 0 a b c 0, and padded alike the load without displacement;
    then attachment in the first body's axes, damping over stiffness (s), attachment in the second one's axes, 1
    where that is off its z axis, the second attachment and the second node against the first at zero angles, 1 where
    damping has a matrix of its own."""


class Loads(NamedTuple):
    """What acts from outside."""

    steady: Floats
    """(size + 6 t,) constant generalized forces, weight included; zero on travelling seats."""
    coordinate: Integers
    """(s,) coordinates with a torque given over time."""
    first: Integers
    """(s + 1,) first line of each series in `time` (s) and `torque` (N m), linear between the lines."""
    time: Floats
    torque: Floats
    drive: Integers
    """(d,) coordinates driven behind a spring and damper."""
    law: Floats
    """(d, 5) stiffness (N m/rad), damping (N m s/rad), and the angle that the drive follows: its value (rad), speed
    and half the acceleration at t = 0."""
    varying: VaryingLoadArrays
    """Loads that vary with the angle of a body."""


class Joints(NamedTuple):
    """Ideal joints in minimal coordinates, for their forces only."""

    ends: Integers
    """(m, 2) joint that carries gear 1 and gear 2 of each mesh, -1 for none."""
    host: Integers
    """(j,) joint of the body that a joint sits on, -1 for ground."""
    planet: Floats
    """(j, 3) mass, x and y from the carrier's axis; mass 0 where nothing orbits."""
    carrier: Integers
    slot: Integers
    """(j,) coordinate of the carrier's spin, and where its sine is."""


class Springs(NamedTuple):
    """Torsional springs: (s, 2) coordinates, N m/rad, N m s/rad."""

    ends: Integers
    stiffness: Floats
    damping: Floats


class Equations(NamedTuple):
    """All that the right-hand side reads.

    Parts that a system does not have are None: their laws are then not compiled.
    """

    bodies: Bodies
    places: Places
    connectors: Connectors
    pairs: Pairs
    meshes: Meshes
    travelling: TravellingArrays | None
    springs: Springs
    loads: Loads
    joints: Joints | None
    elastic: ElasticMotion | None
    turning: TurningArrays | None
    modal: ModalArrays | None


class Work(NamedTuple):
    """Memory of the right-hand side.

    State vectors have e entries, a multiple of eight: the system's own, those of travelling seats, and six or more that
    stay zero.
    """

    q: Floats
    v: Floats
    """(e,) state at the present step."""
    stage_q: Floats
    stage_v: Floats
    force: Floats
    rate: Floats
    """(e,) stage, generalized forces and accelerations."""
    turns: Floats
    """(k, 2) cosine and sine of `Bodies.turning`."""
    frames: Floats
    """(b + e + 1, 16) rotation matrix, angular velocity, sine and cosine of the tilts."""
    places: Floats
    """(p + s, 16) padded coordinates and rates of all places."""
    loads: Floats
    """(p + s, 16) generalized forces on all places, and force and moment in global axes, padded alike."""
    relative: Floats
    """(18,) motion of a pair's second body against the first."""
    sums: Floats
    """(9,) force and moments on both bodies of a pair."""
    supports: Floats
    """(c, 18) strain of each connector, its rate, force and moment on the first body, in that body's axes."""
    motion: Floats
    """(24,) true rate of change of a connector's strain, elastic force and damping force, padded."""
    rolling: Floats
    """(m,) see `exugear.system.kernels.rolling.rolling_forces`."""
    mesh: MeshMemory
    """Memory of the meshes' laws."""
    series: Integers
    """(s,) line of each torque series that was used last."""
    shares: Floats
    """Memory of the travelling seats, see `exugear.system.kernels.turning`."""
    damped: Floats
    """(3,) power that elastic bodies damp, and those in turning frames, at the last evaluation that asked for it, and
    the power of modal damping (W)."""
    modal: Floats
    """Memory of modal damping."""
    scratch: Floats
    memory: Floats
    """Memory of the elastic bodies, and of those in turning frames."""


# An assembly and its loads as the arrays of the compiled solver

ROUND_OFF = 1e-14
"""Entries of a bearing's matrix this small relative to its diagonal are rotation round-off, and are neglected."""


def extended_size(assembly: Assembly) -> int:
    """Count the coordinates with those of travelling seats."""
    return assembly.size + BODY_SIZE * assembly.travelling.first.size


class _Numbers:
    """Numbering of bodies and of the coordinates whose sine is needed."""

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.size = extended_size(assembly)
        self.starts = [int(start) for start in assembly.inertia.body]
        # Of elastic bodies only seats in bearings turn anything out of their own coordinates.
        seats = np.setdiff1d(assembly.connectors.bodies, [-1, *self.starts])
        self.starts += [int(start) for start in seats]
        self.turning = [self.size]

    def body(self, start: int) -> int:
        """Find the number of the body that starts at a coordinate; the ground (-1) comes last."""
        if start < 0:
            return len(self.starts)
        return self.starts.index(start)

    def slot(self, coordinate: int) -> int:
        """Return the index of a coordinate's sine, which is added if it is new; 0 for none."""
        if coordinate < 0:
            return 0
        if coordinate not in self.turning:
            self.turning.append(coordinate)
        return self.turning.index(coordinate)


def _connectors(numbers: _Numbers) -> tuple[Connectors, Pairs, Integers]:
    """Connectors, pairs of their bodies, and the slot of the sine of each body's spin where a connector needs it."""
    given = numbers.assembly.connectors
    ends = np.array([[numbers.body(int(s)) for s in pair] for pair in given.bodies], dtype=np.int64).reshape(-1, 2)
    order = np.lexsort((ends[:, 1], ends[:, 0])).astype(np.int64)
    given = given.chosen(order)
    ends = ends[order]
    count = len(ends)
    slots = np.zeros(len(numbers.starts) + 1, dtype=np.int64)
    twisting = np.zeros(count, dtype=np.int64)
    matrices = np.zeros((2, count, BODY_SIZE, BODY_SIZE))
    data = np.zeros((count, PAIR_SIZE))
    for n, (i, j) in enumerate(ends):
        stiffness = _without_round_off(given.stiffness[n])
        damping = _without_round_off(given.damping[n])
        data[n, LAG] = _damping_time(stiffness, damping)
        matrices[:, n] = stiffness.T, damping.T * (data[n, LAG] == 0.0)
        twisting[(ends == ends[n]).all(axis=1)] |= stiffness[:, SPIN].any()
        for end, needed in ((i, True), (j, stiffness[:, SPIN].any() or given.local[n, 1, :2].any())):
            if needed and end < len(numbers.starts):
                slots[end] = numbers.slot(numbers.starts[end] + SPIN)
    columns = data[:, : PADDED * BODY_SIZE].reshape(count, BODY_SIZE, PADDED)
    columns[:, :, :TILT], columns[:, :, PADDED_TILT : PADDED_TILT + TILT] = (
        matrices[0, :, :, :TILT],
        matrices[0, :, :, TILT:],
    )
    data[:, OFFSET : OFFSET + TILT] = given.offset[:, :TILT]
    data[:, OFFSET + PADDED_TILT : OFFSET + PADDED_TILT + TILT] = given.offset[:, TILT:]
    data[:, FIRST_ARM : FIRST_ARM + 3] = given.local[:, 0]
    data[:, SECOND_ARM : SECOND_ARM + 3] = given.local[:, 1]
    data[:, OFF_AXIS] = given.local[:, 1, :2].any(axis=1)
    data[:, GAP : GAP + 3] = (given.node[:, 1] + given.local[:, 1]) - (given.node[:, 0] + given.local[:, 0])
    data[:, NODES : NODES + 3] = given.node[:, 1] - given.node[:, 0]
    data[:, DAMPED] = matrices[1].any(axis=(1, 2))
    begins = np.flatnonzero(np.append(True, (ends[1:] != ends[:-1]).any(axis=1))[:count])
    pairs = Pairs(ends[begins], np.append(begins, count).astype(np.int64), twisting[begins], data)
    return Connectors(order, ends, matrices[1], given.rolling if given.rolling.layout.size else None), pairs, slots


def _places(numbers: _Numbers) -> tuple[Places, Integers]:
    """Places of bodies, of seats that connectors or meshes act on and of single spins; (m, 2) those of each mesh."""
    given = numbers.assembly.meshes.coordinates
    starts = [*numbers.starts, numbers.size]
    spins: list[int] = []
    gears = given[:, :FRAME].reshape(-1, 2, BODY_SIZE)
    for x, spin in gears[:, :, [0, SPIN]].reshape(-1, 2):
        if x >= 0 and x not in starts:
            starts.append(int(x))
        if x < 0 <= spin and spin not in spins:
            spins.append(int(spin))
    ends = np.full(gears.shape[:2], len(numbers.starts), dtype=np.int64)
    for (m, end), _ in np.ndenumerate(ends):
        x = gears[m, end, 0]
        spin = gears[m, end, SPIN]
        if x >= 0:
            ends[m, end] = starts.index(int(x))
        elif spin >= 0:
            ends[m, end] = len(starts) + spins.index(int(spin))
    return Places(np.array(starts, dtype=np.int64), np.array(spins, dtype=np.int64)), ends


def _damping_time(stiffness: Floats, damping: Floats) -> float:
    """Damping over stiffness (s) if they are in proportion, else 0."""
    largest = np.unravel_index(np.argmax(np.abs(stiffness)), stiffness.shape)
    if stiffness[largest] == 0.0:
        return 0.0
    time = float(damping[largest] / stiffness[largest])
    if np.allclose(damping, time * stiffness, rtol=1e-12, atol=1e-14 * np.abs(damping).max()):
        return time
    return 0.0


def _without_round_off(matrix: Floats) -> Floats:
    """Set entries to zero that are negligible relative to the translational and tilting stiffness."""
    entries = np.abs(matrix)
    size = np.sqrt(np.repeat([entries[:TILT, :TILT].max(), entries[TILT:, TILT:].max()], 3))
    return np.where(entries <= ROUND_OFF * np.outer(size, size), 0.0, matrix)


def spinning_alone(meshes: MeshArrays) -> Booleans:
    """Return for each mesh whether its gears have spin only, (m,)."""
    others = np.delete(meshes.coordinates[:, :FRAME], [SPIN_1, SPIN_2], axis=1)
    return np.asarray((others < 0).all(axis=1))


def _meshes(numbers: _Numbers, ends: Integers) -> Meshes:
    given = numbers.assembly.meshes
    axis = given.axis.copy()
    axis[given.coordinates[:, :FRAME].reshape(-1, 2, BODY_SIZE)[:, :, 0] < 0] = 0.0
    elements = numbers.assembly.elements
    table = given.table
    both = np.stack([given.deflection, given.force], axis=1)
    rows, offsets = padded_rows(np.concatenate([both, given.friction_rows], axis=1), axis)
    shift = table.nominal[:, NOMINAL_MISALIGNMENT] - given.tilt[:, TILT_REST]
    return Meshes(
        arrays=given,
        coordinates=np.where(given.coordinates < 0, numbers.size, given.coordinates),
        slot=np.array([numbers.slot(int(c)) for c in given.coordinates[:, FRAME]], dtype=np.int64),
        axis=axis,
        conjugate=np.all(given.deflection == given.force, axis=1).astype(np.int64),
        tilting=(given.tilt[:, TILT_STIFFNESS] > 0.0).astype(np.int64),
        misalignment=np.column_stack([shift, table.misalignment[:, TILT : TILT + 2]]),
        spinning=spinning_alone(given).astype(np.int64),
        ends=ends,
        rows=rows,
        offsets=offsets,
        mean=np.array([(e.tangent.mean(), e.damping) for e in elements]).reshape(-1, 2),
        nominal=table.nominal[:, NOMINAL_DEFLECTION].copy(),
        table=table if (given.form == TABLE_FORM).any() else None,
    )


def _joints(numbers: _Numbers) -> Joints | None:
    assembly = numbers.assembly
    joints = assembly.gearbox.joints if assembly.variant.spins_only else ()
    bodies = {body.name: body for body in assembly.gearbox.bodies(assembly.inertias)}
    number = {joint.body: n for n, joint in enumerate(joints)}
    ends = [[number.get(e.mesh.pinion, -1), number.get(e.mesh.gear, -1)] for e in assembly.elements]
    planet = np.zeros((len(joints), 3))
    carrier = np.full(len(joints), numbers.size)
    for n, joint in enumerate(joints):
        body = bodies[joint.body]
        if body.carrier is not None:
            axis = np.array(body.axis) - np.array(bodies[body.carrier].axis)
            planet[n] = body.mass, axis[0], axis[1]
            carrier[n] = assembly.spin[body.carrier]
    if not joints:
        return None
    return Joints(
        ends=np.array(ends, dtype=np.int64).reshape(-1, 2),
        host=np.array([-1 if j.on == GROUND else number.get(j.on, -1) for j in joints], dtype=np.int64),
        planet=planet,
        carrier=carrier.astype(np.int64),
        slot=np.array([numbers.slot(int(c)) if c < numbers.size else 0 for c in carrier], dtype=np.int64),
    )


def _loads(assembly: Assembly, loads: LoadTable) -> Loads:
    series = list(loads.series.values())
    drive = () if loads.drive is None else (loads.drive,)
    following = np.zeros(extended_size(assembly) - assembly.size)
    return Loads(
        steady=np.append(assembly.torque_vector(loads.constant) + assembly.constant_forces, following),
        coordinate=np.array([assembly.spin[name] for name in loads.series], dtype=np.int64),
        first=np.cumsum([0] + [len(times) for times, _ in series]).astype(np.int64),
        time=np.concatenate([np.zeros(0)] + [times for times, _ in series]),
        torque=np.concatenate([np.zeros(0)] + [torques for _, torques in series]),
        drive=np.array([assembly.spin[d.body] for d in drive], dtype=np.int64),
        law=np.array([(d.stiffness, d.damping, *d.angle) for d in drive]).reshape(-1, 5),
        varying=no_varying_loads() if loads.varying is None else loads.varying,
    )


def equations_of(assembly: Assembly, loads: LoadTable) -> Equations:
    """Arrays of an assembly under loads, as the compiled loops read them."""
    numbers = _Numbers(assembly)
    connectors, pairs, slots = _connectors(numbers)
    places, ends = _places(numbers)
    meshes = _meshes(numbers, ends)
    joints = _joints(numbers)
    inertia = assembly.inertia
    springs = assembly.springs
    # All sorts of elastic bodies together, so that few sorts of systems are compiled.
    elastic = bool(assembly.elastic_bodies)
    bodies = Bodies(
        start=np.append(np.array(numbers.starts, dtype=np.int64), numbers.size),
        slot=slots,
        mass=inertia.mass,
        transverse=inertia.transverse,
        axial=inertia.axial,
        shares=1.0 / np.stack([inertia.mass, inertia.transverse, inertia.axial], axis=1),
        spin=inertia.spin,
        spin_inertia=inertia.spin_inertia,
        inverse=np.zeros((0, 0)) if LAWS[assembly.mesh_model].has_force else _rolling_inverse(assembly),
        turning=np.array(numbers.turning, dtype=np.int64),
    )
    return Equations(
        bodies=bodies,
        places=places,
        connectors=connectors,
        pairs=pairs,
        meshes=meshes,
        travelling=assembly.travelling if elastic else None,
        springs=Springs(springs.coordinates, springs.stiffness, springs.damping),
        loads=_loads(assembly, loads),
        joints=joints,
        elastic=elastic_motion(assembly.elastic) if elastic else None,
        turning=assembly.turning_arrays if elastic else None,
        modal=assembly.modal,
    )


def _rolling_inverse(assembly: Assembly) -> Floats:
    """Inverse mass matrix of spins in a kinematic gear train: B (B^T M B)^-1 B^T with the free motions B."""
    free = assembly.motions
    mass = assembly.mass_matrix
    inverse = free @ np.linalg.solve(free.T @ mass @ free, free.T)
    return np.ascontiguousarray(inverse[np.ix_(assembly.inertia.spin, assembly.inertia.spin)])


def work_for(equations: Equations, q: Floats, v: Floats) -> Work:
    """Memory for the compiled loops, at the state q, v (size,)."""
    size = filled_up(equations.loads.steady.size + BODY_SIZE)
    count = equations.meshes.slot.size
    count_of_places = equations.places.start.size + equations.places.spin.size
    rolling = equations.connectors.rolling
    frames = np.zeros((equations.bodies.start.size, FRAME_SIZE))
    frames[-1, [0, 4, 8, COS_A, COS_B]] = 1.0  # the ground neither turns nor tilts
    return Work(
        q=np.append(q, np.zeros(size - q.size)),
        v=np.append(v, np.zeros(size - q.size)),
        stage_q=np.zeros(size),
        stage_v=np.zeros(size),
        force=np.zeros(size),
        rate=np.zeros(size),
        turns=np.zeros((equations.bodies.turning.size, 2)),
        frames=frames,
        places=np.zeros((count_of_places, 2 * PADDED)),
        loads=np.zeros((count_of_places, 2 * PADDED)),
        relative=np.zeros(RELATIVE_SIZE),
        sums=np.zeros(9),
        supports=np.zeros((equations.connectors.number.size, SUPPORT_SIZE)),
        motion=np.zeros(3 * PADDED),
        rolling=np.zeros(0) if rolling is None else rolling_memory(rolling),
        mesh=MeshMemory(
            gradient=np.zeros((3, ROW_SIZE)),
            gradients=np.zeros((4, PADDED_FRAME + 1)),
            states=np.zeros((count, STATES_SIZE)),
            pieces=np.zeros((count, 2), dtype=np.int64),
            law=None if equations.meshes.table is None else scratch_memory(),
            row=np.zeros(FRAME),
            damping=np.zeros(DAMPING_SIZE),
        ),
        series=equations.loads.first[:-1].copy(),
        shares=np.zeros((0, 0, 0)) if equations.travelling is None else travelling_memory(equations.travelling),
        damped=np.zeros(3),
        modal=modal_memory(equations.modal),
        scratch=np.zeros((3, 0)) if equations.elastic is None else scratch_for(equations.elastic),
        memory=np.zeros((7, 0)) if equations.turning is None else turning_memory(equations.turning),
    )
