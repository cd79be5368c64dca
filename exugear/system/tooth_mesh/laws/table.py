"""Mesh model `table`: the potential of a pair's table over deflection, centre distance and misalignment.

The potential (`exugear.system.kernels.table_law`) depends on the deflection delta, on the centre distance a
and on the misalignment gamma, each a row of the same coordinates. The generalized force is

    f = -(F d delta/dq + U_a da/dq + U_gamma d gamma/dq).

Damping is a time times the tangent of the potential at a frozen position, along the same rows: a negative part of the
tangent causes no damping (`exugear.system.kernels.table_law.surface_damping`). It vanishes as the teeth lose contact.
Teeth are separated within the backlash; beyond it the other flank touches. A table applies to the flank s = +1; the
flank s = -1 is the same rotated by pi about the line of centres: the same table with misalignment reversed. The force
has two forms, `add_table_flank` with its tangent, and `fast_table_force` for the compiled solver; tests check that they
agree.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Mesh
from exugear.system.kernels.coordinates import BODY_SIZE, COSINE, SINE, SPIN
from exugear.system.kernels.meshes import (
    ALONG_DEFLECTION,
    ALONG_FORCE,
    BY_CENTRE,
    BY_DELTA,
    BY_PMC,
    BY_Q,
    BY_TILT,
    CENTRE_CHANGE,
    CENTRE_RATE,
    CYCLE_POWER,
    DAMPED_POWER,
    DAMPING,
    DEFLECTION,
    ENERGY,
    FORCE,
    FORCES,
    FRAME,
    MISALIGNMENT,
    OUTSIDE,
    RATE,
    RATE_SLOPES,
    RATES,
    READINGS,
    ROW_SIZE,
    SECOND_SLOPES,
    SLOPES,
    SPIN_1,
    SPIN_2,
    STATE,
    STIFFNESS,
    TABLE_FORCE,
    Meshes,
    MeshMemory,
    MeshWork,
    mesh_row,
    subtract_errors,
)
from exugear.system.kernels.table_law import (
    BY_DISTANCE,
    BY_MISALIGNMENT,
    CUBIC_SIZE,
    DAMPING_DERIVATIVES,
    ENERGY_DERIVATIVES,
    LAW_BY_DISTANCE,
    LAW_BY_MISALIGNMENT,
    LAW_BY_PMC,
    LAW_FORCE,
    LAW_OUTSIDE,
    LAW_POTENTIAL,
    LAW_STIFFNESS,
    NODE_SIZE,
    NOMINAL_DEFLECTION,
    NOMINAL_DISTANCE,
    NOMINAL_MISALIGNMENT,
    OF_BOTH,
    OF_DISTANCE,
    OF_MISALIGNMENT,
    ORDERS,
    Scratch,
    TableArrays,
    surface_damping,
    surface_law,
    surface_tangent,
)
from exugear.system.tooth_mesh.element import Law, MeshData, MeshElement, TableFlanks
from exugear.system.tooth_mesh.placement import (
    MeshError,
    ToothContact,
    line_of_action_row,
    position_rows,
)
from exugear.system.tooth_mesh.tables import fitting_table, table_path, without_table
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.transmission_error.surface import InterpolationError, SteSurface, axis_weights, slope_axis_weights
from fe_ste.transmission_error.table import TableError

TABLE_FORM = 1


class TableLaw(Law):
    """The whole table of a pair, both flanks."""

    form = TABLE_FORM

    def read(self, gearbox: Gearbox, pair: str, directory: Path) -> SteSurface:
        """Surface through a pair's table over all axes, which must have been computed from exactly this case."""
        if pair in gearbox.stated_stiffness:
            raise MeshError(without_table(gearbox, [pair]))
        try:
            return SteSurface.from_table(fitting_table(gearbox, pair, directory, grid=True).dataset)
        except TableError as error:
            raise MeshError(f"pair {pair}: {error} (exugear ste --grid)") from None
        except InterpolationError as error:
            raise MeshError(f"pair {pair}: {table_path(directory, pair)}: {error}") from None

    def samples(self, data: MeshData, mesh: Mesh, static_force: float) -> tuple[Floats, Floats]:
        """Mean stiffness of the table at the static load, (1,), N/m: for damping and for linear models."""
        mean = _surface_of(mesh, data).mean_stiffness(abs(static_force), mesh.centre_distance)
        values = np.atleast_1d(np.asarray(mean, dtype=np.float64))
        return values, values

    def table_flanks(
        self, mesh: Mesh, flank: int, nodes: tuple[Floats, Floats], phase: float, data: MeshData, time: float
    ) -> TableFlanks | None:
        """Surface of the loaded flank, and rows, phase and distance of the other one."""
        pair = mesh.pair.with_centre_distance(mesh.centre_distance)
        orientation = ToothContact(mesh, flank, 1).orientation(phase)
        return TableFlanks(
            surface=_surface_of(mesh, data),
            back=line_of_action_row(mesh, -flank, nodes),
            back_misalignment=position_rows(mesh, -flank, nodes)[1],
            backlash=pair.circumferential_backlash * math.cos(pair.working_pressure_angle),
            back_phase=ToothContact(mesh, -flank, 1).pmc(orientation) % 1.0,
            damping_time=time,
        )


def _surface_of(mesh: Mesh, data: MeshData) -> SteSurface:
    if not isinstance(data, SteSurface):
        raise MeshError(f"pair {mesh.pair.name}: the mesh model table requires a table, not a stiffness")
    return data


@kernel
def damped_forces(
    time: float, stiffness: float, damping: Floats, rate: float, centre_rate: float, tilt_rate: float
) -> tuple[float, float, float, float]:
    """Damping along deflection (N), centre distance (N) and misalignment (N m) at their rates, and its power (W).

    `damping` is what `surface_damping` fills, `time` that of the damping (s), `stiffness` the slope of the force (N/m).
    """
    by_distance, by_misalignment = damping[BY_DISTANCE], damping[BY_MISALIGNMENT]
    approaching = rate - by_distance * centre_rate - by_misalignment * tilt_rate
    damped = time * stiffness * approaching
    centre = time * (damping[OF_DISTANCE] * centre_rate + damping[OF_BOTH] * tilt_rate)
    tilt = time * (damping[OF_BOTH] * centre_rate + damping[OF_MISALIGNMENT] * tilt_rate)
    lost = damped * approaching + centre * centre_rate + tilt * tilt_rate
    return damped, centre - by_distance * damped, tilt - by_misalignment * damped, lost


@kernel
def flank_tangent(
    time: float, stiffness: float, damped: float, damping: Floats, second: Floats, slopes: Floats, by_rates: Floats
) -> None:
    """Slopes (3, 4) of a flank's force and of what it does along centre distance and misalignment, by its arguments.

    They follow `surface_tangent` and `surface_damping`, in the axes of the table; those by the rates (3, 3) are apart.

    Parameters
    ----------
    time : of the damping, s; zero for none
    stiffness : slope of the force, N/m
    damped : damping along the deflection, N

    Notes
    -----
    The slope of the force changes with the place; that directions and the tangent at constant load do is left out,
    which is a share of 1e-4 of damping, and of nothing at rest.
    """
    per_stiffness = damped / stiffness if stiffness > 0.0 else 0.0
    for a in range(3):
        along = 1.0 if a == 0 else -damping[BY_DISTANCE + a - 1]
        for b in range(3):
            across = 1.0 if b == 0 else -damping[BY_DISTANCE + b - 1]
            by_rates[a, b] = time * stiffness * along * across
            if a > 0 and b > 0:
                by_rates[a, b] += time * damping[OF_DISTANCE + a + b - 2]
        for b in range(4):
            slopes[a, b] = second[a, b] + along * per_stiffness * second[3, b]


@kernel
def table_flank(
    m: int,
    delta: float,
    rate: float,
    centre: float,
    centre_rate: float,
    tilt: float,
    tilt_rate: float,
    pmc: float,
    guess: int,
    wanted: int,
    table: TableArrays,
    law_memory: Scratch,
    damping: Floats,
) -> tuple[int, float, float, float, float, float, float]:
    """Law of one flank of mesh m by its readings, in the axes of the table; `law_memory` and `damping` are left filled.

    Parameters
    ----------
    guess : load piece where the search begins
    wanted : number of derivatives of the surface, in the order of `ORDERS`

    Returns
    -------
    piece, t : as of `surface_law`
    force, along_centre, along_tilt : along deflection and centre distance (N), and along misalignment (N m)
    damped, lost : damping along the deflection, N; its power, W
    """
    piece, t = surface_law(delta, pmc, centre, tilt, m, table, guess, wanted, law_memory)
    law = law_memory.law
    # Gears that stay where they are damp along the deflection alone.
    if wanted < DAMPING_DERIVATIVES:
        damping[:] = 0.0
    else:
        surface_damping(t, piece, m, table, law_memory, damping)
    damped, centre_damped, tilt_damped, lost = damped_forces(
        table.damping_time[m], law[LAW_STIFFNESS], damping, rate, centre_rate, tilt_rate
    )
    along_centre, along_tilt = law[LAW_BY_DISTANCE] + centre_damped, law[LAW_BY_MISALIGNMENT] + tilt_damped
    return piece, t, law[LAW_FORCE] + damped, along_centre, along_tilt, damped, lost


@kernel
def add_table_flank(
    m: int, table: TableArrays | None, law_memory: Scratch | None, memory: Floats, tangent: bool
) -> None:
    """Fill what a flank gives along its readings, and its slopes if wanted; add to the state of the mesh: see `MEMORY`.

    `table` is None in a system without tables: nothing of their law is compiled then.
    """
    if table is None or law_memory is None:
        return
    readings, rates, forces, damping, state = (
        memory[READINGS],
        memory[RATES],
        memory[FORCES],
        memory[DAMPING],
        memory[STATE],
    )
    # Most of the time one flank is far away: nothing of its table needs to be read.
    if readings[BY_DELTA] <= table.lowest[m]:
        return
    wanted = ORDERS.shape[0] if tangent else DAMPING_DERIVATIVES
    piece, t, forces[BY_DELTA], forces[BY_CENTRE], forces[BY_TILT], damped, lost = table_flank(
        m,
        readings[BY_DELTA],
        rates[BY_DELTA],
        readings[BY_CENTRE],
        rates[BY_CENTRE],
        readings[BY_TILT],
        rates[BY_TILT],
        readings[BY_PMC],
        0,
        wanted,
        table,
        law_memory,
        damping,
    )
    law = law_memory.law
    state[STIFFNESS] += law[LAW_STIFFNESS]
    state[ENERGY] += law[LAW_POTENTIAL]
    state[DAMPED_POWER] += lost
    state[CYCLE_POWER] -= law[LAW_BY_PMC] * rates[BY_PMC]
    state[OUTSIDE] = max(state[OUTSIDE], law[LAW_OUTSIDE])
    if tangent and t >= 0.0:
        second, slopes, rate_slopes = (
            memory[SECOND_SLOPES:BY_Q],
            memory[SLOPES:RATE_SLOPES],
            memory[RATE_SLOPES:SECOND_SLOPES],
        )
        surface_tangent(t, piece, m, table, law_memory, second)
        flank_tangent(table.damping_time[m], law[LAW_STIFFNESS], damped, damping, second, slopes, rate_slopes)


@kernel
def fast_flank_force(
    q: Floats,
    v: Floats,
    m: int,
    side: int,
    meshes: Meshes,
    table: TableArrays,
    c: float,
    s: float,
    law_memory: Scratch,
    memory: MeshMemory,
) -> None:
    """Add the part of one flank of a mesh with a table to `memory.states`; its force to `memory.gradient`.

    The latter is the negative generalized force. The states already contain the change of centre distance; the loaded
    flank stores deflection, rate and misalignment there.

    Parameters
    ----------
    side : 1 for the loaded flank of the static state, -1 for the opposite one
    c, s : cosine and sine of the frame's angle
    """
    index, axis, state = meshes.coordinates[m], meshes.axis[m], memory.states[m]
    gradient, total = memory.gradient[ALONG_DEFLECTION], memory.gradient[TABLE_FORCE]
    deflection = table.nominal[m, NOMINAL_DEFLECTION]
    # `number` is the column of the flank in `memory.pieces`.
    if side > 0:
        row, misalignment_row, offset = meshes.arrays.deflection[m], table.misalignment[m], deflection
        phase, cycles, number = meshes.arrays.phase[m], meshes.arrays.cycles[m], 0
    else:
        row, misalignment_row, offset = table.back[m], table.back_misalignment[m], -deflection - table.backlash[m]
        phase, cycles, number = table.back_phase[m], -meshes.arrays.cycles[m], 1
    delta, rate = mesh_row(q, v, index, axis, row, c, s, gradient)
    less, slower = subtract_errors(q, v, m, float(side), meshes, gradient, BODY_SIZE, SPIN, FRAME)
    delta, rate = delta + offset + less, rate + slower
    misalignment = table.nominal[m, NOMINAL_MISALIGNMENT]
    # Gears with spin only neither move apart nor tilt; the other flank is evaluated only in contact.
    spinning = meshes.spinning[m] == 1
    tilt_rate = 0.0
    if not spinning and (side > 0 or delta > table.lowest[m]):
        tilt, tilt_rate = mesh_row(q, v, index, axis, misalignment_row, c, s, memory.gradient[ALONG_FORCE])
        misalignment += tilt
    if side > 0:
        state[DEFLECTION], state[RATE], state[MISALIGNMENT] = delta, rate, misalignment
    if delta <= table.lowest[m]:
        return
    # Sign between the misalignment of the gears and that of the table, which belongs to the flank +1 of gear 1.
    sense = side * table.sense[m]
    pmc = phase + cycles * (q[index[SPIN_1]] - q[index[FRAME]])
    centre = table.nominal[m, NOMINAL_DISTANCE] + state[CENTRE_CHANGE]
    # Number of derivatives of the surface: gears that only spin are damped along the deflection alone.
    wanted = ENERGY_DERIVATIVES if spinning else DAMPING_DERIVATIVES
    # From step to step the load stays on a piece: the search begins where it ended.
    memory.pieces[m, number], _, force, apart, along_tilt, _, lost = table_flank(
        m,
        delta,
        rate,
        centre,
        state[CENTRE_RATE],
        sense * misalignment,
        sense * tilt_rate,
        pmc,
        memory.pieces[m, number],
        wanted,
        table,
        law_memory,
        memory.damping,
    )
    law = law_memory.law
    for i in range(ROW_SIZE):
        total[i] += force * gradient[i]
    if not spinning:
        moment = sense * along_tilt
        for i in range(FRAME):
            memory.row[i] = apart * table.centre[m, i] + moment * misalignment_row[i]
        mesh_row(q, v, index, axis, memory.row, c, s, memory.gradient[ALONG_FORCE])
        for i in range(ROW_SIZE):
            total[i] += memory.gradient[ALONG_FORCE, i]
    state[FORCE] += side * force
    state[OUTSIDE] = max(state[OUTSIDE], law[LAW_OUTSIDE])
    state[ENERGY] += law[LAW_POTENTIAL]
    state[DAMPED_POWER] += lost
    state[CYCLE_POWER] -= law[LAW_BY_PMC] * cycles * (v[index[SPIN_1]] - v[index[FRAME]])


@kernel
def fast_table_force(
    q: Floats,
    v: Floats,
    m: int,
    meshes: Meshes,
    table: TableArrays,
    c: float,
    s: float,
    law_memory: Scratch,
    memory: MeshMemory,
) -> None:
    """Fill `memory.gradient` with the negative generalized force of a mesh with a table, its row of `memory.states`.

    Parameters as of `fast_flank_force`.
    """
    memory.gradient[TABLE_FORCE, :] = 0.0
    memory.states[m, :] = 0.0
    if meshes.spinning[m] == 0:
        index, gradient = meshes.coordinates[m], memory.gradient[ALONG_FORCE]
        centre, rate = mesh_row(q, v, index, meshes.axis[m], table.centre[m], c, s, gradient)
        memory.states[m, CENTRE_CHANGE], memory.states[m, CENTRE_RATE] = centre, rate
    for side in (1, -1):
        fast_flank_force(q, v, m, side, meshes, table, c, s, law_memory, memory)


@kernel
def add_table_mesh(
    q: Floats, v: Floats, m: int, meshes: Meshes, table: TableArrays | None, law: Scratch | None, work: MeshWork
) -> None:
    """Add the force of a mesh with a table; without tables (None) nothing, and nothing of their law is compiled."""
    if table is None:
        return
    if law is None:
        return
    c, s = work.turns[meshes.slot[m], COSINE], work.turns[meshes.slot[m], SINE]
    fast_table_force(q, v, m, meshes, table, c, s, law, work.mesh)
    for i in range(ROW_SIZE):
        work.force[meshes.coordinates[m, i]] -= work.mesh.gradient[TABLE_FORCE, i]


def pack_tables(elements: tuple[MeshElement, ...], index: Integers, averaged: bool, linear: bool) -> TableArrays:
    """Arrays of all tables; those of gears that stay where they are hold that place only."""
    by_mesh = [
        None if linear else _surface(element, row, averaged) for element, row in zip(elements, index, strict=True)
    ]
    surfaces = [surface for surface in by_mesh if surface is not None]
    count = len(elements)
    size = max((s.coefficients.size // CUBIC_SIZE * NODE_SIZE for s in surfaces), default=0)
    loads = max((s.root_force.size for s in surfaces), default=0)
    marks = [surface.acting_guesses().size if surface.guessed is not None else 0 for surface in surfaces]
    longest = max((len(knots) for s in surfaces for knots in (s.centre_distance, s.misalignment)), default=0)
    arrays = TableArrays(
        shape=np.zeros((count, 4), dtype=np.int64),
        axes=np.zeros((count, 2), dtype=np.int64),
        values=np.zeros((count, size)),
        root=np.zeros((count, loads)),
        knots=np.zeros((count, 2, longest)),
        first_node=np.zeros((count, 2, longest), dtype=np.int64),
        weights=np.zeros((count, 2, longest, 4, 4)),
        lowest=np.zeros(count),
        centre=np.array([e.centre for e in elements]).reshape(count, FRAME),
        misalignment=np.array([e.misalignment for e in elements]).reshape(count, FRAME),
        back=np.zeros((count, FRAME)),
        back_misalignment=np.zeros((count, FRAME)),
        nominal=np.array([e.offset + [0.0, e.mesh.centre_distance, 0.0] for e in elements]).reshape(count, 3),
        backlash=np.zeros(count),
        back_phase=np.zeros(count),
        damping_time=np.zeros(count),
        sense=np.array([e.flank for e in elements], dtype=np.float64),
        has_guesses=np.zeros(count, dtype=np.int64),
        acting_guesses=np.zeros((count, max(marks, default=0)), dtype=np.bool_),
    )
    for m, (element, surface) in enumerate(zip(elements, by_mesh, strict=True)):
        if surface is not None and element.table is not None:
            _fill_table(arrays, m, element.table, surface)
    return arrays


def _surface(element: MeshElement, row: Integers, averaged: bool) -> SteSurface | None:
    if element.table is None:
        return None
    surface = element.table.surface
    if np.all(np.delete(row[:FRAME], [SPIN_1, SPIN_2]) < 0):
        surface = surface.at_nominal(element.mesh.centre_distance)
    return surface.averaged() if averaged else surface


def _fill_table(arrays: TableArrays, m: int, flanks: TableFlanks, surface: SteSurface) -> None:
    filled = [(0, 0)] * (surface.coefficients.ndim - 1) + [(0, NODE_SIZE - CUBIC_SIZE)]
    flat = np.pad(surface.coefficients, filled).ravel()
    arrays.shape[m] = surface.coefficients.shape[:4]
    arrays.values[m, : flat.size] = flat
    arrays.root[m, : surface.root_force.size] = surface.root_force
    axes = (surface.centre_distance, axis_weights), (surface.misalignment, slope_axis_weights)
    for axis, (knots, weights_of) in enumerate(axes):
        first_node, weights = weights_of(knots)
        arrays.axes[m, axis] = len(knots)
        arrays.knots[m, axis, : len(knots)] = knots
        arrays.first_node[m, axis, : len(first_node)] = first_node
        arrays.weights[m, axis, : len(first_node)] = weights
    step = 1 if surface.misalignment.size == 1 else 2
    unloaded = surface.coefficients[:, :, ::step, 0, 0]
    arrays.lowest[m] = unloaded.min() - np.ptp(unloaded)  # weights may carry the surface below its nodes
    arrays.back[m], arrays.back_misalignment[m] = flanks.back, flanks.back_misalignment
    arrays.backlash[m], arrays.back_phase[m] = flanks.backlash, flanks.back_phase
    arrays.damping_time[m] = flanks.damping_time
    if surface.guessed is not None:
        acting = surface.acting_guesses().ravel()
        arrays.has_guesses[m], arrays.acting_guesses[m, : acting.size] = 1, acting


LAW = TableLaw()
