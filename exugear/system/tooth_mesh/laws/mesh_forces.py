"""Forces of all meshes in one pass, each in the form of its model, in a plain version and one for loops over time.

Forms are numbered (`MeshArrays.form`). All except the model `table` depend on the deflection along a row and are
implemented here; the model `table` also depends on the positions of the gears.

The model itself is implemented once, in `row_law`: a model with its own force is a branch there. The other functions
implement common parts: damping, resistance of teeth to misalignment, shuttling of the load. Friction of the teeth is
added to the force of any model (`exugear.system.tooth_mesh.laws.friction`). `row_force` with
`add_row_tangent` is the plain version, on unmodified coordinates. `add_row_mesh` is the version for loops over time, on
the geometry that is optimised for speed (`exugear.system.kernels.meshes`). Tests check that they agree.
"""

from __future__ import annotations

import math

import numpy as np

from exugear.system.kernels.coordinates import COSINE, PADDED, PADDED_SPIN, PADDED_TILT, SINE
from exugear.system.kernels.meshes import (
    CYCLE_POWER,
    DAMPED_POWER,
    DEFLECTION,
    DEFLECTION_ROW,
    ENERGY,
    FORCE,
    FORCE_ROW,
    FRAME,
    LAST_CYCLE,
    LAST_DAMPED,
    LAST_DEFLECTION,
    LAST_ENERGY,
    LAST_FORCE,
    LAST_OTHER,
    LAST_OUTSIDE,
    LAST_RATE,
    OTHER_POWER,
    OUTSIDE,
    PADDED_FRAME,
    PMC,
    RATE,
    ROW_SIZE,
    SPIN_1,
    SPIN_2,
    STATE_SIZE,
    STIFFNESS,
    TILT_ARM,
    TILT_DAMPER,
    TILT_DAMPING,
    TILT_LEVER,
    TILT_MOMENT,
    TILT_PUSH,
    TILT_RESISTANCE,
    TILT_REST,
    TILT_STIFFNESS,
    MeshArrays,
    Meshes,
    MeshWork,
    frame_row,
    load_way,
    mesh_pmc,
    net_deflection,
    push_apart,
    rate_gradient,
    relative_spin,
    row_dot,
    row_motion,
    shuttling_at,
    subtract_errors,
    tilt_motion,
    turn_rows,
)
from exugear.system.kernels.table_law import (
    NOMINAL_DEFLECTION,
    NOMINAL_MISALIGNMENT,
    Scratch,
    TableArrays,
    scratch_memory,
)
from exugear.system.tooth_mesh.laws.friction import add_friction, add_friction_loads
from exugear.system.tooth_mesh.laws.line_of_action import CURVE_FORM, curve_law, stiffness_law
from exugear.system.tooth_mesh.laws.table import (
    TABLE_FORM,
    TABLE_MEMORY,
    add_table_mesh,
    add_table_tangent,
    table_force,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.inner_kernels import bundle, cached_struct

# Laws whose force depends on the deflection along a row and on the mesh cycle: both forms of their force

ACTING, ACTING_TURNING, GRADIENT, TURNING, BEND, SLOPE, TILTING, TILT_TURNING, STILL, ROW_MEMORY = range(10)
"""Rows of the memory of the plain form, (`ROW_MEMORY`, 13), and their number."""


@kernel
def row_law(
    form: int, coefficients: Floats, pieces: int, delta: float, pmc: float, cycling: float
) -> tuple[float, float, float, float, float]:
    """Elastic force of a law along a row; results as of `stiffness_law`, which is the form of stated stiffness."""
    if form == CURVE_FORM:
        return curve_law(coefficients, pieces, delta, pmc, cycling)
    return stiffness_law(coefficients, pieces, delta, pmc, cycling)


# -- plain -----------------------------------------------------------------------------------------------------------


@kernel
def tilted(q: Floats, m: int, meshes: MeshArrays, memory: Floats) -> float:
    """Misalignment of mesh m relative to that of its contact's state, rad; its gradient stays in `memory`.

    Rows of the deflection stored there are replaced by those of e (`exugear.system.tooth_mesh.contact_state`).
    """
    gradient = memory[GRADIENT]
    turning = memory[TURNING]
    tilting = memory[TILTING]
    tilt_turning = memory[TILT_TURNING]
    table = meshes.table
    lever = meshes.tilt[m, TILT_LEVER]
    tilt: float = table.nominal[m, NOMINAL_MISALIGNMENT] - meshes.tilt[m, TILT_REST]
    tilt += frame_row(q, meshes.coordinates[m], meshes.axis[m], table.misalignment[m], tilting, tilt_turning)
    for i in range(ROW_SIZE):
        gradient[i] -= lever * tilting[i]
        turning[i] -= lever * tilt_turning[i]
    return tilt


@kernel
def row_force(q: Floats, v: Floats, m: int, meshes: MeshArrays, memory: Floats, out: Floats, acting: Floats) -> None:
    """Fill the state of a mesh with a law along a row, as in `mesh_state`, and its negative generalized force (13,)."""
    gradient = memory[GRADIENT]
    turning = memory[TURNING]
    bend = memory[BEND]
    tilting = memory[TILTING]
    index = meshes.coordinates[m]
    resists = meshes.tilt[m]
    # What deflects, and how fast.
    delta = meshes.table.nominal[m, NOMINAL_DEFLECTION]
    delta += net_deflection(q, m, meshes, meshes.deflection[m], 1.0, gradient, turning, bend)
    rate = row_dot(index, gradient, v)
    out[DEFLECTION], out[RATE] = delta, rate
    moment = 0.0
    turned = 0.0
    stored = 0.0
    lost = 0.0
    if resists[TILT_STIFFNESS] > 0.0:
        turned = tilted(q, m, meshes, memory)
        tilt_rate = row_dot(index, tilting, v)
        delta = delta - resists[TILT_LEVER] * turned
        rate = rate - resists[TILT_LEVER] * tilt_rate
        moment = resists[TILT_MOMENT] - resists[TILT_STIFFNESS] * turned - resists[TILT_DAMPING] * tilt_rate
        stored = (0.5 * resists[TILT_STIFFNESS] * turned - resists[TILT_MOMENT]) * turned
        lost = resists[TILT_DAMPING] * tilt_rate * tilt_rate
    pmc = mesh_pmc(q, m, meshes)
    cycling = meshes.cycles[m] * relative_spin(v, index, 0)
    # The law, and its damper beside it, which stays where the load is in the mean.
    way, moving, beyond, changing = load_way(m, pmc, meshes)
    elastic, k, _, energy, cycle_power = row_law(
        meshes.form[m], meshes.stiffness[m], meshes.pieces[m], delta - way * turned, pmc, cycling
    )
    moment += way * elastic + beyond
    stored -= beyond * turned
    force = elastic + meshes.damping[m] * rate
    # It acts along a row of its own, which for most laws is that of the deflection.
    net_deflection(q, m, meshes, meshes.force[m], 1.0, acting, turning, bend)
    if resists[TILT_STIFFNESS] > 0.0:
        for i in range(ROW_SIZE):
            acting[i] -= resists[TILT_LEVER] * tilting[i]
    out[PMC], out[STIFFNESS] = pmc - math.floor(pmc), k
    out[FORCE] = force * meshes.line_of_action[m]
    out[ENERGY] = energy + stored
    out[DAMPED_POWER] = meshes.damping[m] * rate * rate + lost
    out[CYCLE_POWER] = cycle_power + (elastic * moving + changing) * turned * cycling
    out[OTHER_POWER] = force * (row_dot(index, acting, v) - rate)
    out[OUTSIDE] = 0.0
    for i in range(ROW_SIZE):
        acting[i] *= force
    if resists[TILT_STIFFNESS] > 0.0:
        for i in range(ROW_SIZE):
            acting[i] -= moment * tilting[i]


@kernel
def add_row_tangent(q: Floats, v: Floats, m: int, meshes: MeshArrays, memory: Floats, jq: Floats, jv: Floats) -> None:
    """Add the derivatives of the negative force of a mesh with a law along a row, (13, 13)."""
    gradient = memory[GRADIENT]
    turning = memory[TURNING]
    bend = memory[BEND]
    slope = memory[SLOPE]
    acting = memory[ACTING]
    acting_turning = memory[ACTING_TURNING]
    index = meshes.coordinates[m]
    tilting = memory[TILTING]
    tilt_turning = memory[TILT_TURNING]
    resists = meshes.tilt[m]
    delta = meshes.table.nominal[m, NOMINAL_DEFLECTION]
    delta += net_deflection(q, m, meshes, meshes.deflection[m], 1.0, gradient, turning, bend)
    pmc = mesh_pmc(q, m, meshes)
    turned = 0.0
    if resists[TILT_STIFFNESS] > 0.0:
        turned = tilted(q, m, meshes, memory)
        delta -= resists[TILT_LEVER] * turned
        add_tilt_tangent(v, index, turned, resists, memory, jq, jv)
    way, moving, beyond, changing = load_way(m, pmc, meshes)
    elastic, k, by_pmc, _, _ = row_law(
        meshes.form[m], meshes.stiffness[m], meshes.pieces[m], delta - way * turned, pmc, 0.0
    )
    by_pmc -= k * moving * turned
    c = meshes.damping[m]
    force = elastic + c * row_dot(index, gradient, v)
    # Slope of the scalar force: of the damper's rate, of the deflection, and of pmc by both its angles.
    rate_gradient(v, index, turning, bend, slope)
    for i in range(ROW_SIZE):
        slope[i] = c * slope[i] + k * gradient[i]
    if meshes.way_pieces[m] > 0:
        by_spin = (way * by_pmc + moving * elastic + changing) * meshes.cycles[m]
        add_way_tangent(k * way, way, way * elastic + beyond, by_spin, memory, jq)
    slope[SPIN_1] += by_pmc * meshes.cycles[m]
    slope[FRAME] -= by_pmc * meshes.cycles[m]
    # Product rule: the row times the force's slope, and the row's own turning times the force.
    net_deflection(q, m, meshes, meshes.force[m], 1.0, acting, acting_turning, bend)
    if resists[TILT_STIFFNESS] > 0.0:
        for i in range(ROW_SIZE):
            acting[i] -= resists[TILT_LEVER] * tilting[i]
            acting_turning[i] -= resists[TILT_LEVER] * tilt_turning[i]
    for i in range(ROW_SIZE):
        for j in range(ROW_SIZE):
            jq[i, j] += acting[i] * slope[j]
            jv[i, j] += acting[i] * c * gradient[j]
    turn_rows(acting_turning, bend, force, jq)


@kernel
def add_way_tangent(across: float, way: float, moment: float, by_spin: float, memory: Floats, jq: Floats) -> None:
    """Add the derivatives of the moment of a shuttling load to the negative force, (13, 13).

    The contribution of misalignment to the force's slope is stored in `memory`; `across` is the stiffness times the
    shift (N), `by_spin` the slope of the moment (N m) by the spin of gear 1.
    """
    gradient = memory[GRADIENT]
    tilting = memory[TILTING]
    slope = memory[SLOPE]
    straight = memory[STILL]
    straight[:] = 0.0
    for i in range(ROW_SIZE):
        slope[i] -= across * tilting[i]
        for j in range(ROW_SIZE):
            jq[i, j] -= tilting[i] * across * (gradient[j] - way * tilting[j])
        jq[i, SPIN_1] -= tilting[i] * by_spin
        jq[i, FRAME] += tilting[i] * by_spin
    turn_rows(memory[TILT_TURNING], straight, -moment, jq)


@kernel
def add_tilt_tangent(
    v: Floats, index: Integers, turned: float, resists: Floats, memory: Floats, jq: Floats, jv: Floats
) -> None:
    """Add the derivatives of what the tilt stiffness and its damper give to the negative force, (13, 13)."""
    tilting = memory[TILTING]
    tilt_turning = memory[TILT_TURNING]
    slope = memory[SLOPE]
    straight = memory[STILL]
    k = resists[TILT_STIFFNESS]
    c = resists[TILT_DAMPING]
    straight[:] = 0.0  # errors of wheels do not tilt
    rate_gradient(v, index, tilt_turning, straight, slope)
    for i in range(ROW_SIZE):
        for j in range(ROW_SIZE):
            jq[i, j] += tilting[i] * (k * tilting[j] + c * slope[j])
            jv[i, j] += tilting[i] * c * tilting[j]
    turn_rows(tilt_turning, straight, k * turned + c * row_dot(index, tilting, v) - resists[TILT_MOMENT], jq)


# -- arranged for speed ----------------------------------------------------------------------------------------------


@kernel
def spinning_motion(q: Floats, v: Floats, m: int, meshes: Meshes) -> tuple[float, float, float]:
    """Deflection of mesh m of gears that only spin, without errors; its rate, and the rate along the force row."""
    index = meshes.coordinates[m]
    lever_1 = meshes.deflection[m, SPIN_1]
    lever_2 = meshes.deflection[m, SPIN_2]
    i = index[SPIN_1]
    j = index[SPIN_2]
    k = index[FRAME]
    delta = meshes.nominal[m] + lever_1 * (q[i] - q[k]) + lever_2 * (q[j] - q[k])
    rate = lever_1 * (v[i] - v[k]) + lever_2 * (v[j] - v[k])
    if meshes.conjugate[m] == 1:
        return delta, rate, rate
    lever_1 = meshes.force[m, SPIN_1]
    lever_2 = meshes.force[m, SPIN_2]
    return delta, rate, lever_1 * (v[i] - v[k]) + lever_2 * (v[j] - v[k])


@kernel
def mesh_cycle(q: Floats, v: Floats, m: int, meshes: Meshes) -> tuple[float, float]:
    """Position in the mesh cycle of mesh m, unwrapped, and its rate, 1/s."""
    index = meshes.coordinates[m]
    pmc = meshes.phase[m] + meshes.cycles[m] * (q[index[SPIN_1]] - q[index[FRAME]])
    return pmc, meshes.cycles[m] * (v[index[SPIN_1]] - v[index[FRAME]])


@kernel
def elastic_mesh_force(
    q: Floats, v: Floats, m: int, delta: float, meshes: Meshes
) -> tuple[float, float, float, float, float]:
    """Elastic force of mesh m at a deflection (m), of a law along a row; results as of `row_law`."""
    pmc, cycling = mesh_cycle(q, v, m, meshes)
    return row_law(meshes.form[m], meshes.stiffness[m], meshes.pieces[m], delta, pmc, cycling)


@kernel
def add_spinning_mesh(q: Floats, v: Floats, m: int, meshes: Meshes, work: MeshWork) -> None:
    """Add the force of a mesh along a row between gears that only spin: two products instead of a whole row."""
    index = meshes.coordinates[m]
    state = work.mesh.states[m]
    delta, rate, acting = spinning_motion(q, v, m, meshes)
    elastic, _, _, energy, cycle_power = elastic_mesh_force(q, v, m, delta, meshes)
    force = elastic + meshes.damping[m] * rate
    torque_1 = force * meshes.force[m, SPIN_1]
    torque_2 = force * meshes.force[m, SPIN_2]
    work.force[index[SPIN_1]] -= torque_1
    work.force[index[SPIN_2]] -= torque_2
    # The frame that carries the gears takes what they leave.
    work.force[index[FRAME]] += torque_1 + torque_2
    keep_state(m, delta, rate, acting, force, energy, cycle_power, meshes, state)


@kernel
def keep_state(
    m: int,
    delta: float,
    rate: float,
    acting: float,
    force: float,
    energy: float,
    cycle_power: float,
    meshes: Meshes,
    state: Floats,
) -> None:
    """Leave what a mesh with a law along a row does: see `exugear.system.kernels.meshes`."""
    state[LAST_DEFLECTION], state[LAST_RATE], state[LAST_OUTSIDE], state[LAST_FORCE] = delta, rate, 0.0, force
    state[LAST_ENERGY], state[LAST_DAMPED] = energy, meshes.damping[m] * rate * rate
    state[LAST_CYCLE], state[LAST_OTHER] = cycle_power, force * (acting - rate)


@kernel
def add_row_mesh(q: Floats, v: Floats, m: int, meshes: Meshes, work: MeshWork) -> None:
    """Add the force of a mesh with a law along a row."""
    index = meshes.coordinates[m]
    gradient = work.mesh.gradients[DEFLECTION_ROW]
    psi = q[index[FRAME]]
    psi_rate = v[index[FRAME]]
    c = work.turns[meshes.slot[m], COSINE]
    s = work.turns[meshes.slot[m], SINE]
    clean = meshes.error_pieces[m, 0] + meshes.error_pieces[m, 1] == 0
    delta, rate = row_motion(m, DEFLECTION_ROW, psi, psi_rate, c, s, meshes, work.places, gradient)
    delta += meshes.nominal[m]
    if not clean:
        less, slower = subtract_errors(q, v, m, 1.0, meshes, gradient, PADDED, PADDED_SPIN, PADDED_FRAME)
        delta = delta + less
        rate = rate + slower
    acting = rate
    if meshes.conjugate[m] == 0:  # a law that pushes along its deflection has one row
        gradient = work.mesh.gradients[FORCE_ROW]
        _, acting = row_motion(m, FORCE_ROW, psi, psi_rate, c, s, meshes, work.places, gradient)
        if not clean:
            acting += subtract_errors(q, v, m, 1.0, meshes, gradient, PADDED, PADDED_SPIN, PADDED_FRAME)[1]
    if meshes.tilting[m] == 1:
        add_tilting_mesh(q, v, m, delta, rate, c, s, meshes, work)
        return
    elastic, _, _, energy, cycle_power = elastic_mesh_force(q, v, m, delta, meshes)
    force = elastic + meshes.damping[m] * rate
    push_apart(m, force, gradient, meshes, work)
    keep_state(m, delta, rate, acting, force, energy, cycle_power, meshes, work.mesh.states[m])


@kernel
def add_tilting_mesh(
    q: Floats, v: Floats, m: int, delta: float, rate: float, c: float, s: float, meshes: Meshes, work: MeshWork
) -> None:
    """Add force and moment of a mesh that resists misalignment; the gradient of its deflection is known."""
    frame = meshes.coordinates[m, FRAME]
    resists = meshes.tilt[m]
    state = work.mesh.states[m]
    turned, tilt_rate, x, y, turning = tilt_motion(m, v[frame], c, s, meshes, work.places)
    arm = resists[TILT_ARM]
    stiffness = resists[TILT_RESISTANCE]
    lost = resists[TILT_DAMPER] * tilt_rate
    way = 0.0
    moving = 0.0
    beyond = 0.0
    changing = 0.0
    cycling = 0.0
    if meshes.way_pieces[m] > 0:
        pmc, cycling = mesh_cycle(q, v, m, meshes)
        way, moving, beyond, changing = shuttling_at(meshes.way[m], meshes.way_pieces[m], pmc)
    # Where the load bears beside the middle of the face, it deflects with the misalignment.
    approach = delta - arm * turned
    approaching = rate - arm * tilt_rate
    elastic, _, _, energy, cycle_power = elastic_mesh_force(q, v, m, approach - way * turned, meshes)
    cycle_power += (elastic * moving + changing) * cycling * turned
    force = elastic + meshes.damping[m] * approaching
    push_apart(m, force, work.mesh.gradients[DEFLECTION_ROW], meshes, work)
    moment = resists[TILT_PUSH] - stiffness * turned - lost + arm * force + way * elastic + beyond
    first = work.loads[meshes.ends[m, 0]]
    second = work.loads[meshes.ends[m, 1]]
    first[PADDED_TILT] += moment * x
    first[PADDED_TILT + 1] += moment * y
    second[PADDED_TILT] -= moment * x
    second[PADDED_TILT + 1] -= moment * y
    work.force[frame] += moment * turning
    keep_state(m, delta, approaching, approaching, force, energy, cycle_power, meshes, state)
    state[LAST_RATE] = rate
    state[LAST_ENERGY] += (0.5 * stiffness * turned - resists[TILT_PUSH] - beyond) * turned
    state[LAST_DAMPED] += lost * tilt_rate


# Forces of all meshes in one pass, each by the form that its law has: plain, and in loops over time

STATE = ROW_MEMORY
BY_Q = STATE + 1
BY_V = BY_Q + ROW_SIZE
OF_TABLE = BY_Q + 2 * ROW_SIZE
MEMORY = OF_TABLE + TABLE_MEMORY
"""Rows of the memory of `pass_meshes`, (`MEMORY`, 13): vectors of a mesh, and derivatives of its force."""
_NOTHING, _NO_ROWS = np.zeros(0), np.zeros((0, 0))
"""No room for what `pass_meshes` fills."""


@kernel
def pass_meshes(
    q: Floats,
    v: Floats,
    meshes: MeshArrays,
    table: TableArrays | None,
    states: Floats,
    f: Floats,
    jq: Floats,
    jv: Floats,
    memory: Floats,
    law_memory: Scratch | None,
) -> None:
    """Apply the functions below to all meshes, with the memory provided.

    One function does all, so that the models are compiled once. `table` is that of `acting_table`, including the memory
    of its model; `memory` is (`MEMORY`, 13).
    """
    state = memory[STATE]
    acting = memory[ACTING]
    local_q = memory[BY_Q:BY_V]
    local_v = memory[BY_V:OF_TABLE]
    of_table = memory[OF_TABLE:]
    for m in range(meshes.coordinates.shape[0]):
        index = meshes.coordinates[m]
        if f.size > 0 or states.size > 0:
            if meshes.form[m] == TABLE_FORM:
                table_force(q, v, m, meshes, table, of_table, law_memory, state, acting)
            else:
                row_force(q, v, m, meshes, memory, state, acting)
            add_friction(q, v, m, meshes, memory[GRADIENT], memory[TURNING], state, acting)
            for i in range(STATE_SIZE if states.size > 0 else 0):
                states[m, i] = state[i]
            for i in range(ROW_SIZE):
                if f.size > 0 and index[i] >= 0:
                    f[index[i]] -= acting[i]
        if jq.size > 0:
            for i in range(ROW_SIZE):
                for j in range(ROW_SIZE):
                    local_q[i, j], local_v[i, j] = 0.0, 0.0
            if meshes.form[m] == TABLE_FORM:
                for side in (1, -1):
                    add_table_tangent(q, v, m, side, meshes, table, of_table, law_memory, local_q, local_v)
            else:
                add_row_tangent(q, v, m, meshes, memory, local_q, local_v)
            for i in range(ROW_SIZE):
                for j in range(ROW_SIZE):
                    if index[i] >= 0 and index[j] >= 0:
                        jq[index[i], index[j]] -= local_q[i, j]
                        jv[index[i], index[j]] -= local_v[i, j]


def acting_table(meshes: MeshArrays) -> TableArrays | None:
    """Tables of meshes, None if none of them follows one: nothing of their law is compiled then."""
    if (meshes.form == TABLE_FORM).any():
        return meshes.table
    return None


def _bundles(meshes: MeshArrays) -> tuple[MeshArrays, TableArrays | None]:
    table = acting_table(meshes)
    return cached_struct(meshes), None if table is None else cached_struct(table)


def _pass(q: Floats, v: Floats, meshes: MeshArrays, states: Floats, f: Floats, jq: Floats, jv: Floats) -> None:
    bundled, table = _bundles(meshes)
    law_memory = None if table is None else bundle(scratch_memory())
    pass_meshes(q, v, bundled, table, states, f, jq, jv, np.empty((MEMORY, ROW_SIZE)), law_memory)


def add_mesh_forces(q: Floats, v: Floats, meshes: MeshArrays, f: Floats) -> None:
    """Add the generalized forces of all meshes to f, shape of q."""
    _pass(q, v, meshes, _NO_ROWS, f, _NO_ROWS, _NO_ROWS)


def add_mesh_jacobian(q: Floats, v: Floats, meshes: MeshArrays, jq: Floats, jv: Floats) -> None:
    """Add d f/dq and d f/dv of `add_mesh_forces` to jq and jv, each (n, n)."""
    _pass(q, v, meshes, _NO_ROWS, _NOTHING, jq, jv)


def mesh_state(q: Floats, v: Floats, meshes: MeshArrays, out: Floats) -> None:
    """Fill (m, 11): what each mesh does; columns as named in `exugear.system.kernels.meshes`."""
    _pass(q, v, meshes, out, _NOTHING, _NO_ROWS, _NO_ROWS)


@kernel
def add_meshes(q: Floats, v: Floats, meshes: Meshes, work: MeshWork) -> None:
    """Add the forces of all meshes to `work.loads` and `work.force`; leave what they do in `work.mesh.states`."""
    for m in range(meshes.coordinates.shape[0]):
        if meshes.form[m] == TABLE_FORM:
            add_table_mesh(q, v, m, meshes, meshes.table, work.mesh.law, work)
        elif meshes.spinning[m] == 1 and meshes.error_pieces[m, 0] + meshes.error_pieces[m, 1] == 0:
            add_spinning_mesh(q, v, m, meshes, work)
        else:
            add_row_mesh(q, v, m, meshes, work)
        add_friction_loads(q, v, m, meshes, work)
