"""Arrays of the compiled solver: what its right-hand side reads, and its working memory."""

from __future__ import annotations

from typing import NamedTuple

from exugear.kernels.elastic import ElasticArrays, ElasticMotion
from exugear.kernels.table_law import Scratch, TableArrays
from exugear.kernels.travelling import TravellingArrays
from exugear.kernels.turning import TurningArrays
from fe_ste.tools.arrays import Floats, Integers


class Bodies(NamedTuple):
    """Bodies with six coordinates, seats of elastic bodies, the ground; then bodies with their spin alone.

    Attributes
    ----------
    start : (b + e + 1,) first coordinate, of the rigid ones, then of seats, then one that stays zero for the ground
    slot : (b + e + 1,) where `Work.turns` has the sine of the spin, 0 where no law needs it
    mass, transverse, axial : (b,) kg, kg m2
    spin, spin_inertia : (s,) coordinate and kg m2 of bodies with their spin alone
    inverse : (s, s) inverse mass matrix of these spins where gears only roll, else (0, 0)
    turning : (k,) coordinates whose sine is needed; the first is one that stays zero
    """

    start: Integers
    slot: Integers
    mass: Floats
    transverse: Floats
    axial: Floats
    spin: Integers
    spin_inertia: Floats
    inverse: Floats
    turning: Integers


class Connectors(NamedTuple):
    """6x6 connectors, those between the same bodies one after the other, entries that are not zero as lists.

    Attributes
    ----------
    number : (c,) place of each connector in the assembly
    ends : (c, 2) numbers of the two bodies in `Bodies`
    local : (c, 2, 3) attachment in each body's axes, m
    gap : (c, 3) second attachment against the first at zero angles, m
    repeated : (c,) 1 where the one before has the same ends, so that angles and their rates are known
    twisting : (c,) 1 where the angle about z acts on these ends, else 0
    first : (c + 1,) first entry of each connector
    row, column : (e,) place of each entry in the 6x6 matrix
    stiffness, damping : (e,) its values
    """

    number: Integers
    ends: Integers
    local: Floats
    gap: Floats
    repeated: Integers
    twisting: Integers
    first: Integers
    row: Integers
    column: Integers
    stiffness: Floats
    damping: Floats


class Meshes(NamedTuple):
    """Meshes as in `exugear.kernels.meshes.MeshArrays`, with missing coordinates pointing to one that stays zero.

    Attributes
    ----------
    coordinates : (m, 13)
    slot : (m,) where `Work.turns` has the sine of the frame's angle
    place : (m, 2, 2) zero for gears without translations
    conjugate : (m,) 1 where the force row is the deflection row
    spinning : (m,) 1 where the gears have their spins alone
    """

    coordinates: Integers
    slot: Integers
    place: Floats
    deflection: Floats
    force: Floats
    conjugate: Integers
    spinning: Integers
    cycles: Floats
    phase: Floats
    pieces: Integers
    stiffness: Floats
    damping: Floats
    line_of_action: Floats
    error_pieces: Integers
    error: Floats
    table: TableArrays


class Loads(NamedTuple):
    """What acts from outside.

    Attributes
    ----------
    steady : (size + 6 t,) constant generalized forces, weight included; zero on travelling seats
    coordinate : (s,) coordinates with a torque given over time
    first : (s + 1,) first line of each series in `time` (s) and `torque` (N m), linear between the lines
    drive : (d,) coordinates driven behind a spring and damper
    law : (d, 5) stiffness, damping, and angle law[2] + law[3] t + law[4] t^2
    """

    steady: Floats
    coordinate: Integers
    first: Integers
    time: Floats
    torque: Floats
    drive: Integers
    law: Floats


class Joints(NamedTuple):
    """Ideal joints in minimal coordinates, for their forces only.

    Attributes
    ----------
    ends : (m, 2) joint that carries gear 1 and gear 2 of each mesh, -1 for none
    host : (j,) joint of the body that a joint sits on, -1 for ground
    planet : (j, 3) mass, x and y from the carrier's axis; mass 0 where nothing orbits
    carrier, slot : (j,) coordinate of the carrier's spin, and where its sine is
    """

    ends: Integers
    host: Integers
    planet: Floats
    carrier: Integers
    slot: Integers


class Springs(NamedTuple):
    """Torsional springs: (s, 2) coordinates, N m/rad, N m s/rad."""

    ends: Integers
    stiffness: Floats
    damping: Floats


class Equations(NamedTuple):
    """All that the right-hand side reads."""

    bodies: Bodies
    connectors: Connectors
    meshes: Meshes
    travelling: TravellingArrays
    springs: Springs
    loads: Loads
    joints: Joints
    elastic: ElasticArrays
    motion: ElasticMotion
    turning: TurningArrays


class Work(NamedTuple):
    """Memory of the right-hand side.

    State vectors have e entries: the system's own, those of travelling seats, and six that stay zero.

    Attributes
    ----------
    q, v : (e,) state at the present step
    stage_q, stage_v, force, rate, total : (e,) stage, generalized forces, accelerations and their sum
    turns : (k, 2) cosine and sine of `Bodies.turning`
    frames : (b + e + 1, 16) rotation matrix, angular velocity, sine and cosine of the tilts
    wrench : (b + e + 1, 6) force and moment on each body, global axes
    motion : (4, 6) strain, its rate, the true rate of change, force of a connector in its own axes
    gradient : (3, 13) gradients of the deflection and of the force row, and the force of a mesh with a table
    series : (s,) line of each torque series that was used last
    states : (m, 4) deflection and its rate, 1 where a table's axis was left, scalar force
    scratch, memory : memory of the elastic bodies, and of those in turning frames
    pieces : (m, 2) load piece of each flank's table that was used last
    law : memory of the law `table`
    row : (12,) row of the push between the axes and the moment of misalignment
    """

    q: Floats
    v: Floats
    stage_q: Floats
    stage_v: Floats
    force: Floats
    rate: Floats
    total: Floats
    turns: Floats
    frames: Floats
    wrench: Floats
    motion: Floats
    gradient: Floats
    series: Integers
    states: Floats
    scratch: Floats
    memory: Floats
    pieces: Integers
    law: Scratch
    row: Floats
