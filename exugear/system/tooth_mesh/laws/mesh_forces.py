"""Forces of all meshes: one law for each model, one chain rule from its readings to the coordinates.

A law sees readings of a flank: deflection, centre distance, misalignment, position in the mesh cycle, and their rates.
It returns what acts along the first three. Laws along a row are `row_law` with the resistance to misalignment and the
shuttling of the load (`row_flank`); the model `table` is `exugear.system.tooth_mesh.laws.table.table_flank`. Friction
of the teeth is added to the force of any model (`exugear.system.tooth_mesh.laws.friction`).

Two ways lead from the coordinates to the readings and back: `pass_meshes`, also with derivatives, on unmodified
coordinates, and `add_meshes` for loops over time, on the geometry that is optimised for speed
(`exugear.system.kernels.meshes`). Tests check that they agree.
"""

from __future__ import annotations

import math

import numpy as np

from exugear.system.kernels.coordinates import COSINE, PADDED, PADDED_SPIN, PADDED_TILT, SINE
from exugear.system.kernels.meshes import (
    ACTING,
    ALONG,
    ALONG_TURNING,
    BEND,
    BY_CENTRE,
    BY_DELTA,
    BY_PMC,
    BY_Q,
    BY_TILT,
    BY_V,
    CYCLE_POWER,
    DAMPED_POWER,
    DEFLECTION,
    DEFLECTION_ROW,
    ENERGY,
    FORCE,
    FORCE_ROW,
    FORCES,
    FRAME,
    GRADIENTS,
    MEMORY,
    OTHER_POWER,
    OUTSIDE,
    PADDED_FRAME,
    PMC,
    RATE,
    RATE_GRADIENTS,
    RATE_SLOPES,
    RATES,
    READINGS,
    ROW_SIZE,
    SECOND_SLOPES,
    SLOPES,
    SPIN_1,
    SPIN_2,
    STATE,
    STATE_SIZE,
    STIFFNESS,
    STRAIGHT,
    TILT_DAMPING,
    TILT_LEVER,
    TILT_MOMENT,
    TILT_STIFFNESS,
    TURNINGS,
    MeshArrays,
    Meshes,
    MeshWork,
    load_way,
    net_deflection,
    push_apart,
    rate_gradient,
    read_flank,
    row_dot,
    row_motion,
    subtract_errors,
    tilt_motion,
    turn_rows,
)
from exugear.system.kernels.table_law import (
    Scratch,
    TableArrays,
    scratch_memory,
)
from exugear.system.tooth_mesh.laws.friction import add_friction, add_friction_loads
from exugear.system.tooth_mesh.laws.line_of_action import CURVE_FORM, curve_law, stiffness_law
from exugear.system.tooth_mesh.laws.table import (
    TABLE_FORM,
    add_table_flank,
    add_table_mesh,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.bundles import bundle, cached_bundle
from fe_ste.tools.compilation import kernel

# Laws along a row: force by the deflection and the position in the mesh cycle


@kernel
def row_law(
    form: int, coefficients: Floats, pieces: int, delta: float, pmc: float, cycling: float
) -> tuple[float, float, float, float, float]:
    """Elastic force of a law along a row; results as of `stiffness_law`, which is the form of stated stiffness."""
    if form == CURVE_FORM:
        return curve_law(coefficients, pieces, delta, pmc, cycling)
    return stiffness_law(coefficients, pieces, delta, pmc, cycling)


@kernel
def row_flank(
    m: int,
    delta: float,
    rate: float,
    tilt: float,
    tilt_rate: float,
    pmc: float,
    cycling: float,
    meshes: MeshArrays,
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Law along a row of mesh m with damper, resistance to misalignment and shuttling, by its readings and their rates.

    The load bears at an axial place that shuttles, so that the teeth deflect by e = delta - (lever + way) tilt; the
    damper stays at the lever. Teeth that do not resist misalignment have zeros in `MeshArrays.tilt`.

    Returns
    -------
    force, moment : along deflection and misalignment, N and N m
    energy, damped, cycle_power : J; W dissipated; W that the changing law gives to the rest
    stiffness, by_pmc : slopes of the force by e and by pmc
    arm, moment_by_pmc : lever + way (m); what the moment changes by pmc besides -arm times the force
    """
    resists = meshes.tilt[m]
    lever = resists[TILT_LEVER]
    way, moving, beyond, changing = load_way(m, pmc, meshes)
    arm = lever + way
    elastic, k, by_pmc, energy, cycle_power = row_law(
        meshes.form[m], meshes.stiffness[m], meshes.pieces[m], delta - arm * tilt, pmc, cycling
    )
    approaching = rate - lever * tilt_rate
    damped = meshes.damping[m] * approaching
    lost = resists[TILT_DAMPING] * tilt_rate
    push = resists[TILT_MOMENT] + beyond
    moment = resists[TILT_STIFFNESS] * tilt + lost - push - arm * elastic - lever * damped
    energy += (0.5 * resists[TILT_STIFFNESS] * tilt - push) * tilt
    moment_by_pmc = -moving * elastic - changing
    cycle_power -= moment_by_pmc * tilt * cycling
    by_pmc -= k * moving * tilt
    lost = damped * approaching + lost * tilt_rate
    return elastic + damped, moment, energy, lost, cycle_power, k, by_pmc, arm, moment_by_pmc


@kernel
def row_slopes(
    m: int, k: float, by_pmc: float, arm: float, moment_by_pmc: float, meshes: MeshArrays, slopes: Floats, rates: Floats
) -> None:
    """Fill the slopes (3, 4) of what `row_flank` gives by the readings, and those (3, 3) by their rates."""
    resists = meshes.tilt[m]
    c = meshes.damping[m]
    lever = resists[TILT_LEVER]
    slopes[BY_DELTA, BY_DELTA], slopes[BY_DELTA, BY_TILT], slopes[BY_DELTA, BY_PMC] = k, -arm * k, by_pmc
    slopes[BY_TILT, BY_DELTA], slopes[BY_TILT, BY_TILT] = -arm * k, resists[TILT_STIFFNESS] + arm * arm * k
    slopes[BY_TILT, BY_PMC] = moment_by_pmc - arm * by_pmc
    rates[BY_DELTA, BY_DELTA], rates[BY_DELTA, BY_TILT] = c, -lever * c
    rates[BY_TILT, BY_DELTA], rates[BY_TILT, BY_TILT] = -lever * c, resists[TILT_DAMPING] + lever * lever * c


# Any law on unmodified coordinates: readings of a flank, and the chain rule back to the coordinates

_NOTHING, _NO_ROWS = np.zeros(0), np.zeros((0, 0))
"""No room for what `pass_meshes` fills."""


@kernel
def add_flank(
    q: Floats,
    v: Floats,
    m: int,
    side: int,
    meshes: MeshArrays,
    table: TableArrays | None,
    law_memory: Scratch | None,
    memory: Floats,
    tangent: bool,
) -> None:
    """Add one flank (1, -1) of mesh m to its state and negative force, or to the derivatives of this: see `MEMORY`."""
    is_table = meshes.form[m] == TABLE_FORM
    # The table is that of the flank +1: the other one is seen from the other end of the gear.
    read_flank(q, v, m, side, side * meshes.table.sense[m] if is_table else 1.0, meshes, memory)
    readings, rates, forces = memory[READINGS], memory[RATES], memory[FORCES]
    gradients = memory[GRADIENTS:TURNINGS]
    slopes, rate_slopes = memory[SLOPES:RATE_SLOPES], memory[RATE_SLOPES:SECOND_SLOPES]
    state = memory[STATE]
    along = memory[ALONG]
    slopes[:], rate_slopes[:], forces[:] = 0.0, 0.0, 0.0
    if side > 0:
        state[DEFLECTION] = readings[BY_DELTA]
        state[RATE] = rates[BY_DELTA]
        state[PMC] = readings[BY_PMC] - math.floor(readings[BY_PMC])
    row = meshes.force[m]
    if is_table:
        if side < 0:
            row = meshes.table.back[m]
        add_table_flank(m, table, law_memory, memory, tangent)
    else:
        forces[BY_DELTA], forces[BY_TILT], energy, lost, cycle_power, k, by_pmc, arm, moment_by_pmc = row_flank(
            m,
            readings[BY_DELTA],
            rates[BY_DELTA],
            readings[BY_TILT],
            rates[BY_TILT],
            readings[BY_PMC],
            rates[BY_PMC],
            meshes,
        )
        row_slopes(m, k, by_pmc, arm, moment_by_pmc, meshes, slopes, rate_slopes)
        state[STIFFNESS], state[ENERGY], state[DAMPED_POWER], state[CYCLE_POWER] = k, energy, lost, cycle_power
    # The force acts along a row of its own, which for most laws is that of the deflection.
    net_deflection(q, m, meshes, row, float(side), along, memory[ALONG_TURNING], memory[BEND])
    index = meshes.coordinates[m]
    state[FORCE] += side * forces[BY_DELTA] * meshes.line_of_action[m]
    state[OTHER_POWER] += forces[BY_DELTA] * (row_dot(index, along, v) - rates[BY_DELTA])
    for i in range(ROW_SIZE):
        memory[ACTING, i] += forces[BY_DELTA] * along[i]
        memory[ACTING, i] += forces[BY_CENTRE] * gradients[BY_CENTRE, i] + forces[BY_TILT] * gradients[BY_TILT, i]
    if tangent:
        add_flank_tangent(v, index, memory)


@kernel
def add_flank_tangent(v: Floats, index: Integers, memory: Floats) -> None:
    """Add the derivatives of the negative force of a flank, (13, 13) each, by the chain rule and the product rule."""
    gradients, turnings = memory[GRADIENTS:TURNINGS], memory[TURNINGS:RATE_GRADIENTS]
    rate_gradients = memory[RATE_GRADIENTS:SLOPES]
    slopes, rate_slopes = memory[SLOPES:RATE_SLOPES], memory[RATE_SLOPES:SECOND_SLOPES]
    bend, straight, along = memory[BEND], memory[STRAIGHT], memory[ALONG]
    jq = memory[BY_Q:BY_V]
    jv = memory[BY_V:MEMORY]
    straight[:] = 0.0  # errors of wheels neither move axes nor tilt them
    rate_gradient(v, index, turnings[BY_DELTA], bend, rate_gradients[BY_DELTA])
    rate_gradient(v, index, turnings[BY_CENTRE], straight, rate_gradients[BY_CENTRE])
    rate_gradient(v, index, turnings[BY_TILT], straight, rate_gradients[BY_TILT])
    for a in range(3):
        row = along if a == BY_DELTA else gradients[a]
        for j in range(ROW_SIZE):
            slope, rate_slope = slopes[a, BY_PMC] * gradients[BY_PMC, j], 0.0
            for b in range(3):
                slope += slopes[a, b] * gradients[b, j] + rate_slopes[a, b] * rate_gradients[b, j]
                rate_slope += rate_slopes[a, b] * gradients[b, j]
            for i in range(ROW_SIZE):
                jq[i, j] += row[i] * slope
                jv[i, j] += row[i] * rate_slope
    # The rows turn with the frame.
    turn_rows(memory[ALONG_TURNING], bend, memory[FORCES, BY_DELTA], jq)
    turn_rows(turnings[BY_CENTRE], straight, memory[FORCES, BY_CENTRE], jq)
    turn_rows(turnings[BY_TILT], straight, memory[FORCES, BY_TILT], jq)


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
    """Fill states (m, 11), add forces to f, or derivatives to jq and jv, of all meshes, where there is room for them.

    One function does all, so that the models are compiled once. `table` is that of `acting_table`, including the memory
    of its model; `memory` is (`MEMORY`, 13).
    """
    state = memory[STATE]
    acting = memory[ACTING]
    tangent = jq.size > 0
    for m in range(meshes.coordinates.shape[0]):
        index = meshes.coordinates[m]
        state[:] = 0.0
        acting[:] = 0.0
        if tangent:
            memory[BY_Q:MEMORY] = 0.0
        # One call in a loop: numba compiles a function once for each constant that it is given.
        for side in range(1, -2 if meshes.form[m] == TABLE_FORM else 0, -2):
            add_flank(q, v, m, side, meshes, table, law_memory, memory, tangent)
        add_friction(q, v, m, meshes, memory[ALONG], memory[ALONG_TURNING], state, acting)
        for i in range(STATE_SIZE if states.size > 0 else 0):
            states[m, i] = state[i]
        for i in range(ROW_SIZE):
            if index[i] >= 0 and f.size > 0:
                f[index[i]] -= acting[i]
            for j in range(ROW_SIZE if tangent else 0):
                if index[i] >= 0 and index[j] >= 0:
                    jq[index[i], index[j]] -= memory[BY_Q + i, j]
                    jv[index[i], index[j]] -= memory[BY_V + i, j]


def acting_table(meshes: MeshArrays) -> TableArrays | None:
    """Tables of meshes, None if none of them follows one: nothing of their law is compiled then."""
    if (meshes.form == TABLE_FORM).any():
        return meshes.table
    return None


def _pass(q: Floats, v: Floats, meshes: MeshArrays, states: Floats, f: Floats, jq: Floats, jv: Floats) -> None:
    given = acting_table(meshes)
    table = None if given is None else cached_bundle(given)
    law_memory = None if given is None else bundle(scratch_memory())
    pass_meshes(q, v, cached_bundle(meshes), table, states, f, jq, jv, np.empty((MEMORY, ROW_SIZE)), law_memory)


def add_mesh_forces(q: Floats, v: Floats, meshes: MeshArrays, f: Floats) -> None:
    """Add the generalized forces of all meshes to f, shape of q."""
    _pass(q, v, meshes, _NO_ROWS, f, _NO_ROWS, _NO_ROWS)


def add_mesh_jacobian(q: Floats, v: Floats, meshes: MeshArrays, jq: Floats, jv: Floats) -> None:
    """Add d f/dq and d f/dv of `add_mesh_forces` to jq and jv, each (n, n)."""
    _pass(q, v, meshes, _NO_ROWS, _NOTHING, jq, jv)


def mesh_state(q: Floats, v: Floats, meshes: MeshArrays, out: Floats) -> None:
    """Fill (m, 11): what each mesh does; columns as named in `exugear.system.kernels.meshes`."""
    _pass(q, v, meshes, out, _NOTHING, _NO_ROWS, _NO_ROWS)


# -- arranged for speed ----------------------------------------------------------------------------------------------


@kernel
def spinning_motion(q: Floats, v: Floats, m: int, meshes: Meshes) -> tuple[float, float, float]:
    """Deflection of mesh m of gears that only spin, without errors; its rate, and the rate along the force row."""
    index = meshes.coordinates[m]
    lever_1 = meshes.arrays.deflection[m, SPIN_1]
    lever_2 = meshes.arrays.deflection[m, SPIN_2]
    i = index[SPIN_1]
    j = index[SPIN_2]
    k = index[FRAME]
    delta = meshes.nominal[m] + lever_1 * (q[i] - q[k]) + lever_2 * (q[j] - q[k])
    rate = lever_1 * (v[i] - v[k]) + lever_2 * (v[j] - v[k])
    if meshes.conjugate[m] == 1:
        return delta, rate, rate
    lever_1 = meshes.arrays.force[m, SPIN_1]
    lever_2 = meshes.arrays.force[m, SPIN_2]
    return delta, rate, lever_1 * (v[i] - v[k]) + lever_2 * (v[j] - v[k])


@kernel
def mesh_cycle(q: Floats, v: Floats, m: int, meshes: Meshes) -> tuple[float, float]:
    """Position in the mesh cycle of mesh m, unwrapped, and its rate, 1/s."""
    index = meshes.coordinates[m]
    pmc = meshes.arrays.phase[m] + meshes.arrays.cycles[m] * (q[index[SPIN_1]] - q[index[FRAME]])
    return pmc, meshes.arrays.cycles[m] * (v[index[SPIN_1]] - v[index[FRAME]])


@kernel
def elastic_mesh_force(
    q: Floats, v: Floats, m: int, delta: float, meshes: Meshes
) -> tuple[float, float, float, float, float]:
    """Elastic force of mesh m at a deflection (m), of a law along a row; results as of `row_law`."""
    pmc, cycling = mesh_cycle(q, v, m, meshes)
    return row_law(meshes.arrays.form[m], meshes.arrays.stiffness[m], meshes.arrays.pieces[m], delta, pmc, cycling)


@kernel
def add_spinning_mesh(q: Floats, v: Floats, m: int, meshes: Meshes, work: MeshWork) -> None:
    """Add the force of a mesh along a row between gears that only spin: two products instead of a whole row."""
    index = meshes.coordinates[m]
    state = work.mesh.states[m]
    delta, rate, acting = spinning_motion(q, v, m, meshes)
    elastic, _, _, energy, cycle_power = elastic_mesh_force(q, v, m, delta, meshes)
    force = elastic + meshes.arrays.damping[m] * rate
    torque_1 = force * meshes.arrays.force[m, SPIN_1]
    torque_2 = force * meshes.arrays.force[m, SPIN_2]
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
    state[DEFLECTION], state[RATE], state[OUTSIDE] = delta, rate, 0.0
    state[FORCE] = force * meshes.arrays.line_of_action[m]
    state[ENERGY], state[DAMPED_POWER] = energy, meshes.arrays.damping[m] * rate * rate
    state[CYCLE_POWER], state[OTHER_POWER] = cycle_power, force * (acting - rate)


@kernel
def add_row_mesh(q: Floats, v: Floats, m: int, meshes: Meshes, work: MeshWork) -> None:
    """Add the force of a mesh with a law along a row."""
    index = meshes.coordinates[m]
    gradient = work.mesh.gradients[DEFLECTION_ROW]
    psi = q[index[FRAME]]
    psi_rate = v[index[FRAME]]
    c = work.turns[meshes.slot[m], COSINE]
    s = work.turns[meshes.slot[m], SINE]
    clean = meshes.arrays.error_pieces[m, 0] + meshes.arrays.error_pieces[m, 1] == 0
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
    force = elastic + meshes.arrays.damping[m] * rate
    push_apart(m, force, gradient, meshes, work)
    keep_state(m, delta, rate, acting, force, energy, cycle_power, meshes, work.mesh.states[m])


@kernel
def add_tilting_mesh(
    q: Floats, v: Floats, m: int, delta: float, rate: float, c: float, s: float, meshes: Meshes, work: MeshWork
) -> None:
    """Add force and moment of a mesh that resists misalignment; the gradient of its deflection is known."""
    frame = meshes.coordinates[m, FRAME]
    state = work.mesh.states[m]
    tilt, tilt_rate, x, y, turning = tilt_motion(m, v[frame], c, s, meshes, work.places)
    pmc, cycling = mesh_cycle(q, v, m, meshes)
    force, moment, energy, lost, cycle_power, _, _, _, _ = row_flank(
        m, delta, rate, tilt, tilt_rate, pmc, cycling, meshes.arrays
    )
    push_apart(m, force, work.mesh.gradients[DEFLECTION_ROW], meshes, work)
    first = work.loads[meshes.ends[m, 0]]
    second = work.loads[meshes.ends[m, 1]]
    first[PADDED_TILT] -= moment * x
    first[PADDED_TILT + 1] -= moment * y
    second[PADDED_TILT] += moment * x
    second[PADDED_TILT + 1] += moment * y
    work.force[frame] -= moment * turning
    keep_state(m, delta, rate, rate, force, energy, cycle_power, meshes, state)
    state[DAMPED_POWER] = lost


@kernel
def add_meshes(q: Floats, v: Floats, meshes: Meshes, work: MeshWork) -> None:
    """Add the forces of all meshes to `work.loads` and `work.force`; leave what they do in `work.mesh.states`."""
    for m in range(meshes.coordinates.shape[0]):
        if meshes.arrays.form[m] == TABLE_FORM:
            add_table_mesh(q, v, m, meshes, meshes.table, work.mesh.law, work)
        elif meshes.spinning[m] == 1 and meshes.arrays.error_pieces[m, 0] + meshes.arrays.error_pieces[m, 1] == 0:
            add_spinning_mesh(q, v, m, meshes, work)
        else:
            add_row_mesh(q, v, m, meshes, work)
        add_friction_loads(q, v, m, meshes, work)
