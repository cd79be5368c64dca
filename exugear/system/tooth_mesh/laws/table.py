"""Mesh model `table`: the potential of a pair's table over deflection, centre distance and misalignment.

The potential (`exugear.system.kernels.table_law`) depends on the deflection delta, on the centre distance a
and on the misalignment gamma, each a row of the same coordinates. The generalized force is

    f = -(F d delta/dq + U_a da/dq + U_gamma d gamma/dq).

Damping is a time times the tangent of the potential at a frozen position, along the same rows: a negative part of the
tangent causes no damping (`exugear.system.kernels.table_law.surface_damping`). It vanishes as the teeth lose contact.
Teeth are separated within the backlash; beyond it the other flank touches. A table applies to the flank s = +1; the
flank s = -1 is the same rotated by pi about the line of centres: the same table with misalignment reversed. The force
has two forms, `table_force` with its tangent, and `fast_table_force` for the compiled solver; tests check that they
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
    CYCLE_POWER,
    DAMPED_POWER,
    DEFLECTION,
    ENERGY,
    FORCE,
    FRAME,
    LAST_CENTRE,
    LAST_CENTRE_RATE,
    LAST_CYCLE,
    LAST_DAMPED,
    LAST_DEFLECTION,
    LAST_ENERGY,
    LAST_FORCE,
    LAST_MISALIGNMENT,
    LAST_OUTSIDE,
    LAST_RATE,
    OUTSIDE,
    PMC,
    RATE,
    ROW_SIZE,
    SPIN_1,
    SPIN_2,
    STIFFNESS,
    TABLE_FORCE,
    MeshArrays,
    Meshes,
    MeshMemory,
    MeshWork,
    frame_row,
    mesh_pmc,
    mesh_row,
    net_deflection,
    rate_gradient,
    relative_spin,
    row_dot,
    subtract_errors,
    turn_rows,
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
GRADIENT, TURNING, BEND, CHANGING, PUSH, DAMPING, RATES = range(7)
GRADIENTS, SLOPES, SECOND, BY_ARGUMENTS = RATES + 3, RATES + 7, RATES + 11, RATES + 15
BY_RATES, TABLE_MEMORY = BY_ARGUMENTS + 3, BY_ARGUMENTS + 6
"""Rows of the memory of `table_force` and `add_table_tangent`, (`TABLE_MEMORY`, 13)."""


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
def flank_of(side: int, m: int, meshes: MeshArrays, table: TableArrays) -> tuple[Floats, Floats, float, float, float]:
    """Rows of deflection and misalignment, deflection at zero coordinates, phase and cycles of one flank (1, -1)."""
    deflection = table.nominal[m, NOMINAL_DEFLECTION]
    if side > 0:
        return meshes.deflection[m], table.misalignment[m], deflection, meshes.phase[m], meshes.cycles[m]
    # The other flank closes when the loaded one opens by the backlash, and its cycle runs the other way.
    offset = -deflection - table.backlash[m]
    return table.back[m], table.back_misalignment[m], offset, table.back_phase[m], -meshes.cycles[m]


@kernel
def position_by(
    q: Floats, m: int, meshes: MeshArrays, row: Floats, nominal: float, gradient: Floats, changing: Floats
) -> float:
    """Centre distance (m) or misalignment (rad) of mesh m by its row, whose gradient and change stay behind."""
    value: float = nominal + frame_row(q, meshes.coordinates[m], meshes.axis[m], row, gradient, changing)
    return value


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
def table_force(
    q: Floats,
    v: Floats,
    m: int,
    meshes: MeshArrays,
    table: TableArrays | None,
    rows: Floats,
    law_memory: Scratch | None,
    out: Floats,
    acting: Floats,
) -> None:
    """Fill the state of a mesh with a table, as in `mesh_state`, and its generalized force, negative (13,).

    `table` is None in a system without tables: nothing of their law is compiled then.
    """
    if table is None or law_memory is None:
        return
    gradient, turning, bend, changing, push = rows[GRADIENT], rows[TURNING], rows[BEND], rows[CHANGING], rows[PUSH]
    index, damping = meshes.coordinates[m], rows[DAMPING]
    centre = position_by(q, m, meshes, table.centre[m], table.nominal[m, NOMINAL_DISTANCE], gradient, changing)
    centre_rate = row_dot(index, gradient, v)
    spin, cycling = relative_spin(q, index, 0), relative_spin(v, index, 0)
    pmc = mesh_pmc(q, m, meshes)
    out[:] = 0.0
    acting[:] = 0.0
    out[PMC] = pmc - math.floor(pmc)
    for side in (1, -1):
        row, misalignment_row, offset, phase, cycles = flank_of(side, m, meshes, table)
        delta = offset + net_deflection(q, m, meshes, row, float(side), gradient, turning, bend)
        rate = row_dot(index, gradient, v)
        if side > 0:
            out[DEFLECTION], out[RATE] = delta, rate
        # Most of the time one flank is far away: nothing of its table needs to be read.
        if delta <= table.lowest[m]:
            continue
        # The table is that of the flank +1: on the other one it is seen from the other end of the gear.
        sense = side * table.sense[m]
        nominal = table.nominal[m, NOMINAL_MISALIGNMENT]
        misalignment = sense * position_by(q, m, meshes, misalignment_row, nominal, push, changing)
        tilt_rate = sense * row_dot(index, push, v)
        pmc = phase + cycles * spin
        piece, t = surface_law(delta, pmc, centre, misalignment, m, table, 0, DAMPING_DERIVATIVES, law_memory)
        law = law_memory.law
        surface_damping(t, piece, m, table, law_memory, damping)
        damped, along_centre, along_tilt, lost = damped_forces(
            table.damping_time[m], law[LAW_STIFFNESS], damping, rate, centre_rate, tilt_rate
        )
        force = law[LAW_FORCE] + damped
        for i in range(ROW_SIZE):
            acting[i] += force * gradient[i]
        # Push between the axes and moment of misalignment, as one row.
        apart, moment = law[LAW_BY_DISTANCE] + along_centre, sense * (law[LAW_BY_MISALIGNMENT] + along_tilt)
        for i in range(FRAME):
            push[i] = apart * table.centre[m, i] + moment * misalignment_row[i]
        frame_row(q, index, meshes.axis[m], push, gradient, turning)
        for i in range(ROW_SIZE):
            acting[i] += gradient[i]
        out[STIFFNESS] += law[LAW_STIFFNESS]
        out[FORCE] += side * force
        out[ENERGY] += law[LAW_POTENTIAL]
        out[DAMPED_POWER] += lost
        out[CYCLE_POWER] -= law[LAW_BY_PMC] * cycles * cycling
        out[OUTSIDE] = max(out[OUTSIDE], law[LAW_OUTSIDE])


@kernel
def add_table_tangent(
    q: Floats,
    v: Floats,
    m: int,
    side: int,
    meshes: MeshArrays,
    table: TableArrays | None,
    rows: Floats,
    law_memory: Scratch | None,
    jq: Floats,
    jv: Floats,
) -> None:
    """Add the derivatives of the negative force of one flank of a mesh with a table, (13, 13); None as there."""
    if table is None or law_memory is None:
        return
    index, axis = meshes.coordinates[m], meshes.axis[m]
    row, misalignment_row, offset, phase, cycles = flank_of(side, m, meshes, table)
    # Gradients of the four arguments of the law: delta, centre distance, misalignment, pmc.
    gradients, slopes, second = rows[GRADIENTS:SLOPES], rows[SLOPES:SECOND], rows[SECOND:TABLE_MEMORY]
    turning, bend, changing, tilting = rows[TURNING], rows[BEND], rows[CHANGING], rows[PUSH]
    rates, damping = rows[RATES:GRADIENTS], rows[DAMPING]
    by_arguments, by_rates = rows[BY_ARGUMENTS:BY_RATES], rows[BY_RATES:TABLE_MEMORY]
    delta = offset + net_deflection(q, m, meshes, row, float(side), gradients[0], turning, bend)
    if delta <= table.lowest[m]:
        return
    rate_gradient(v, index, turning, bend, rates[0])
    centre = table.nominal[m, NOMINAL_DISTANCE] + frame_row(q, index, axis, table.centre[m], gradients[1], changing)
    damping[:] = 0.0  # errors of wheels neither move axes nor tilt them
    rate_gradient(v, index, changing, damping, rates[1])
    sense = side * table.sense[m]
    for i in range(FRAME):
        tilting[i] = sense * misalignment_row[i]
    misalignment = sense * table.nominal[m, NOMINAL_MISALIGNMENT]
    misalignment += frame_row(q, index, axis, tilting, gradients[2], changing)
    rate_gradient(v, index, changing, damping, rates[2])
    pmc = phase + cycles * relative_spin(q, index, 0)
    gradients[3, :] = 0.0
    gradients[3, SPIN_1], gradients[3, FRAME] = cycles, -cycles
    piece, t = surface_law(delta, pmc, centre, misalignment, m, table, 0, ORDERS.shape[0], law_memory)
    if t < 0.0:
        return
    surface_tangent(t, piece, m, table, law_memory, second)
    surface_damping(t, piece, m, table, law_memory, damping)
    law, time = law_memory.law, table.damping_time[m]
    rate, centre_rate = row_dot(index, gradients[0], v), row_dot(index, gradients[1], v)
    damped, along_centre, along_tilt, _ = damped_forces(
        time, law[LAW_STIFFNESS], damping, rate, centre_rate, row_dot(index, gradients[2], v)
    )
    flank_tangent(time, law[LAW_STIFFNESS], damped, damping, second, by_arguments, by_rates)
    # Slopes of F, U_a and U_gamma over the coordinates, by the chain rule.
    for i in range(ROW_SIZE):
        for a in range(3):
            slopes[a, i] = 0.0
            for b in range(4):
                slopes[a, i] += by_arguments[a, b] * gradients[b, i]
            for b in range(3):
                slopes[a, i] += by_rates[a, b] * rates[b, i]
                for j in range(ROW_SIZE):
                    jv[i, j] += by_rates[a, b] * gradients[a, i] * gradients[b, j]
    for a in range(3):
        for i in range(ROW_SIZE):
            for j in range(ROW_SIZE):
                jq[i, j] += gradients[a, i] * slopes[a, j]
    # The rows turn with the frame: second derivatives of all three times what acts along them.
    turn_rows(turning, bend, law[LAW_FORCE] + damped, jq)
    bend[:] = 0.0
    apart, moment = law[LAW_BY_DISTANCE] + along_centre, law[LAW_BY_MISALIGNMENT] + along_tilt
    for i in range(FRAME):
        tilting[i] = apart * table.centre[m, i] + moment * tilting[i]
    frame_row(q, index, axis, tilting, gradients[0], turning)
    turn_rows(turning, bend, 1.0, jq)


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
    """Add the part of one flank (1, -1) of a mesh with a table to `memory.states`; its force to `memory.gradient`.

    The latter is the negative generalized force. The states already contain the change of centre distance; the loaded
    flank stores deflection, rate and misalignment there. c and s are cosine and sine of the frame's angle.
    """
    index, axis, state = meshes.coordinates[m], meshes.axis[m], memory.states[m]
    gradient, total = memory.gradient[ALONG_DEFLECTION], memory.gradient[TABLE_FORCE]
    deflection = table.nominal[m, NOMINAL_DEFLECTION]
    if side > 0:
        row, misalignment_row, offset = meshes.deflection[m], table.misalignment[m], deflection
        phase, cycles, number = meshes.phase[m], meshes.cycles[m], 0
    else:
        row, misalignment_row, offset = table.back[m], table.back_misalignment[m], -deflection - table.backlash[m]
        phase, cycles, number = table.back_phase[m], -meshes.cycles[m], 1
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
        state[LAST_DEFLECTION], state[LAST_RATE], state[LAST_MISALIGNMENT] = delta, rate, misalignment
    if delta <= table.lowest[m]:
        return
    sense = side * table.sense[m]
    pmc = phase + cycles * (q[index[SPIN_1]] - q[index[FRAME]])
    centre = table.nominal[m, NOMINAL_DISTANCE] + state[LAST_CENTRE]
    # From step to step the load stays on a piece: the search begins where it ended.
    guess = memory.pieces[m, number]
    wanted = ENERGY_DERIVATIVES if spinning else DAMPING_DERIVATIVES
    piece, t = surface_law(delta, pmc, centre, sense * misalignment, m, table, guess, wanted, law_memory)
    memory.pieces[m, number] = piece
    law, damping = law_memory.law, memory.damping
    # Gears that stay where they are damp along the deflection alone.
    if spinning:
        damping[:] = 0.0
    else:
        surface_damping(t, piece, m, table, law_memory, damping)
    damped, along_centre, along_tilt, lost = damped_forces(
        table.damping_time[m], law[LAW_STIFFNESS], damping, rate, state[LAST_CENTRE_RATE], sense * tilt_rate
    )
    force = law[LAW_FORCE] + damped
    for i in range(ROW_SIZE):
        total[i] += force * gradient[i]
    if not spinning:
        apart, moment = law[LAW_BY_DISTANCE] + along_centre, sense * (law[LAW_BY_MISALIGNMENT] + along_tilt)
        for i in range(FRAME):
            memory.row[i] = apart * table.centre[m, i] + moment * misalignment_row[i]
        mesh_row(q, v, index, axis, memory.row, c, s, memory.gradient[ALONG_FORCE])
        for i in range(ROW_SIZE):
            total[i] += memory.gradient[ALONG_FORCE, i]
    state[LAST_FORCE] += side * force
    state[LAST_OUTSIDE] = max(state[LAST_OUTSIDE], law[LAW_OUTSIDE])
    state[LAST_ENERGY] += law[LAW_POTENTIAL]
    state[LAST_DAMPED] += lost
    state[LAST_CYCLE] -= law[LAW_BY_PMC] * cycles * (v[index[SPIN_1]] - v[index[FRAME]])


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
        memory.states[m, LAST_CENTRE], memory.states[m, LAST_CENTRE_RATE] = centre, rate
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
