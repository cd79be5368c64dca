"""Arrays of the compiled solver: what its right-hand side reads, and its working memory.

Names of columns become part of machine code: `fe_ste.tools.compilation` compiles anew when this file changes.
"""

from __future__ import annotations

from typing import NamedTuple

from exugear.system.bearings.kernels.rolling import RollingArrays
from exugear.system.bodies.kernels.elastic import ElasticMotion
from exugear.system.bodies.kernels.travelling import TravellingArrays
from exugear.system.bodies.kernels.turning import TurningArrays
from exugear.system.kernels.coordinates import PADDED
from exugear.system.tooth_mesh.kernels.fast_meshes import Meshes, MeshMemory
from fe_ste.tools.arrays import Floats, Integers

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
    """(s, s) inverse mass matrix of these spins where gears only roll, else (0, 0)."""
    turning: Integers
    """(k,) coordinates whose sine is needed; the first is one that stays zero."""


class Connectors(NamedTuple):
    """6x6 connectors, those between the same bodies one after the other."""

    number: Integers
    """(c,) position of each connector in the assembly."""
    ends: Integers
    """(c, 2) numbers of the two bodies in `Bodies`."""
    local: Floats
    """(c, 2, 3) attachment in each body's axes, m."""
    gap: Floats
    """(c, 3) second attachment against the first at zero angles, m."""
    repeated: Integers
    """(c,) 1 where the one before has the same ends, so that angles and their rates are known."""
    twisting: Integers
    """(c,) 1 where the angle about z acts on these ends, else 0."""
    stiffness: Floats
    """(c, 6, 6) by column and row, N/m .. N m/rad."""
    offset: Floats
    """(c, 6) load of the linear law without displacement, N and N m."""
    time: Floats
    """(c,) damping over stiffness where the two are in proportion, s."""
    damping: Floats
    """(c, 6, 6) by column and row where they are not."""
    damped: Integers
    """(c,) 1 where they are not, else 0."""
    rolling: RollingArrays | None
    """Rolling laws, in parallel to these; None where there are none."""


class Places(NamedTuple):
    """Places of bodies and seats, numbered as in `Bodies`; then those of seats that only meshes act on."""

    start: Integers
    """(p,) first of the six coordinates."""
    spin: Integers
    """(s,) spins of bodies with their spin alone, whose places follow, where a mesh sees them beside other bodies."""


class Pairs(NamedTuple):
    """Pairs of bodies with connectors between them; p pairs, c connectors in the order of `Connectors`."""

    ends: Integers
    """(p, 2) numbers of the two bodies in `Bodies`."""
    first: Integers
    """(p + 1,) first connector of each pair."""
    twisting: Integers
    """(p,) 1 where the angle about z acts, else 0."""
    data: Floats
    """(c, 72) stiffness by column, rows padded to x y z 0 a b c 0, and padded alike the load without displacement;:
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
    """(m,) see `exugear.system.bearings.kernels.rolling.rolling_forces`."""
    mesh: MeshMemory
    """Memory of the meshes' laws."""
    series: Integers
    """(s,) line of each torque series that was used last."""
    shares: Floats
    """Memory of the travelling seats, see `exugear.system.bodies.kernels.travelling`."""
    damped: Floats
    """(2,) power that elastic bodies damp, and those in turning frames, at the last evaluation that asked for it:
    (W)."""
    scratch: Floats
    memory: Floats
    """Memory of the elastic bodies, and of those in turning frames."""
