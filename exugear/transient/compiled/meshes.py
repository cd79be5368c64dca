"""Forces of gear meshes in the compiled solver: the laws' forms on the geometry that is arranged for speed.

Machine code is kept by `fe_ste.tools.compilation`.
"""

from __future__ import annotations

from exugear.kernels.coordinates import PADDED, PADDED_TILT
from exugear.tooth_mesh.kernels.fast_meshes import (
    DEFLECTION_ROW,
    FORCE_ROW,
    LAST_CYCLE,
    LAST_DAMPED,
    LAST_DEFLECTION,
    LAST_ENERGY,
    LAST_FORCE,
    LAST_OTHER,
    LAST_OUTSIDE,
    LAST_RATE,
    TABLE_FORCE,
    TILT_ARM,
    TILT_DAMPER,
    TILT_PUSH,
    TILT_RESISTANCE,
    TURNING,
    Meshes,
    row_motion,
    subtract_errors,
    tilt_motion,
)
from exugear.tooth_mesh.kernels.meshes import FRAME, ROW_SIZE, SPIN_1, SPIN_2, stiffness_at
from exugear.tooth_mesh.kernels.table_law import Scratch, TableArrays
from exugear.tooth_mesh.laws.forms import row_law
from exugear.tooth_mesh.laws.table import TABLE_FORM, fast_table_force
from exugear.transient.compiled.arrays import COSINE, SINE, Work
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import eight, put


@kernel
def spinning_motion(q: Floats, v: Floats, m: int, meshes: Meshes) -> tuple[float, float, float]:
    """Deflection of mesh m of gears that only spin, without errors; its rate, and the rate along the force row."""
    index = meshes.coordinates[m]
    lever_1, lever_2 = meshes.deflection[m, SPIN_1], meshes.deflection[m, SPIN_2]
    i, j, k = index[SPIN_1], index[SPIN_2], index[FRAME]
    delta = meshes.nominal[m] + lever_1 * (q[i] - q[k]) + lever_2 * (q[j] - q[k])
    rate = lever_1 * (v[i] - v[k]) + lever_2 * (v[j] - v[k])
    if meshes.conjugate[m] == 1:
        return delta, rate, rate
    lever_1, lever_2 = meshes.force[m, SPIN_1], meshes.force[m, SPIN_2]
    return delta, rate, lever_1 * (v[i] - v[k]) + lever_2 * (v[j] - v[k])


@kernel
def mesh_cycle(q: Floats, v: Floats, m: int, meshes: Meshes) -> tuple[float, float]:
    """Position in the mesh cycle of mesh m, unwrapped, and its rate, 1/s."""
    index = meshes.coordinates[m]
    pmc = meshes.phase[m] + meshes.cycles[m] * (q[index[SPIN_1]] - q[index[FRAME]])
    return pmc, meshes.cycles[m] * (v[index[SPIN_1]] - v[index[FRAME]])


@kernel
def mesh_law(q: Floats, v: Floats, m: int, delta: float, meshes: Meshes) -> tuple[float, float, float, float, float]:
    """Elastic force of mesh m at a deflection (m), of a law along a row; results as of `row_law`."""
    pmc, cycling = mesh_cycle(q, v, m, meshes)
    return row_law(meshes.form[m], meshes.stiffness[m], meshes.pieces[m], delta, pmc, cycling)


@kernel
def add_spinning_mesh(q: Floats, v: Floats, m: int, meshes: Meshes, work: Work) -> None:
    """Add the force of a mesh along a row between gears that only spin: two products instead of a whole row."""
    index, state = meshes.coordinates[m], work.mesh.states[m]
    delta, rate, acting = spinning_motion(q, v, m, meshes)
    elastic, _, _, energy, cycle_power = mesh_law(q, v, m, delta, meshes)
    force = elastic + meshes.damping[m] * rate
    torque_1, torque_2 = force * meshes.force[m, SPIN_1], force * meshes.force[m, SPIN_2]
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
    """Leave what a mesh with a law along a row does: see `exugear.tooth_mesh.kernels.fast_meshes`."""
    state[LAST_DEFLECTION], state[LAST_RATE], state[LAST_OUTSIDE], state[LAST_FORCE] = delta, rate, 0.0, force
    state[LAST_ENERGY], state[LAST_DAMPED] = energy, meshes.damping[m] * rate * rate
    state[LAST_CYCLE], state[LAST_OTHER] = cycle_power, force * (acting - rate)


@kernel
def push_apart(m: int, force: float, gradient: Floats, meshes: Meshes, work: Work) -> None:
    """Subtract a scalar force times its gradient from what acts on the gears of mesh m and on its frame."""
    first, second = work.loads[meshes.ends[m, 0]], work.loads[meshes.ends[m, 1]]
    put(first, 0, eight(first, 0) - eight(gradient, 0) * force)
    put(second, 0, eight(second, 0) - eight(gradient, PADDED) * force)
    work.force[meshes.coordinates[m, FRAME]] -= force * gradient[TURNING]


@kernel
def add_row_mesh(q: Floats, v: Floats, m: int, meshes: Meshes, work: Work) -> None:
    """Add the force of a mesh with a law along a row."""
    index, gradient = meshes.coordinates[m], work.mesh.gradients[DEFLECTION_ROW]
    psi, psi_rate = q[index[FRAME]], v[index[FRAME]]
    c, s = work.turns[meshes.slot[m], COSINE], work.turns[meshes.slot[m], SINE]
    clean = meshes.error_pieces[m, 0] + meshes.error_pieces[m, 1] == 0
    delta, rate = row_motion(m, DEFLECTION_ROW, psi, psi_rate, c, s, meshes, work.places, gradient)
    delta += meshes.nominal[m]
    if not clean:
        less, slower = subtract_errors(q, v, m, 1.0, meshes, gradient)
        delta, rate = delta + less, rate + slower
    acting = rate
    if meshes.conjugate[m] == 0:  # a law that pushes along its deflection has one row
        gradient = work.mesh.gradients[FORCE_ROW]
        _, acting = row_motion(m, FORCE_ROW, psi, psi_rate, c, s, meshes, work.places, gradient)
        if not clean:
            acting += subtract_errors(q, v, m, 1.0, meshes, gradient)[1]
    if meshes.tilting[m] == 1:
        add_tilting_mesh(q, v, m, delta, rate, c, s, meshes, work)
        return
    elastic, _, _, energy, cycle_power = mesh_law(q, v, m, delta, meshes)
    force = elastic + meshes.damping[m] * rate
    push_apart(m, force, gradient, meshes, work)
    keep_state(m, delta, rate, acting, force, energy, cycle_power, meshes, work.mesh.states[m])


@kernel
def add_tilting_mesh(
    q: Floats, v: Floats, m: int, delta: float, rate: float, c: float, s: float, meshes: Meshes, work: Work
) -> None:
    """Add force and moment of a mesh that resists misalignment; the gradient of its deflection is known."""
    frame, resists, state = meshes.coordinates[m, FRAME], meshes.tilt[m], work.mesh.states[m]
    turned, tilt_rate, x, y, turning = tilt_motion(m, v[frame], c, s, meshes, work.places)
    arm, stiffness, lost = resists[TILT_ARM], resists[TILT_RESISTANCE], resists[TILT_DAMPER] * tilt_rate
    way, moving = 0.0, 0.0
    if meshes.way_pieces[m] > 0:
        pmc, cycling = mesh_cycle(q, v, m, meshes)
        way, slope = stiffness_at(meshes.way[m], meshes.way_pieces[m], pmc)
        moving = slope * cycling
    # Where the load bears beside the middle of the face, it deflects with the misalignment.
    approach, approaching = delta - arm * turned, rate - arm * tilt_rate
    elastic, _, _, energy, cycle_power = mesh_law(q, v, m, approach - way * turned, meshes)
    cycle_power += elastic * moving * turned
    force = elastic + meshes.damping[m] * approaching
    push_apart(m, force, work.mesh.gradients[DEFLECTION_ROW], meshes, work)
    moment = resists[TILT_PUSH] - stiffness * turned - lost + arm * force + way * elastic
    first, second = work.loads[meshes.ends[m, 0]], work.loads[meshes.ends[m, 1]]
    first[PADDED_TILT] += moment * x
    first[PADDED_TILT + 1] += moment * y
    second[PADDED_TILT] -= moment * x
    second[PADDED_TILT + 1] -= moment * y
    work.force[frame] += moment * turning
    keep_state(m, delta, approaching, approaching, force, energy, cycle_power, meshes, state)
    state[LAST_RATE] = rate
    state[LAST_ENERGY] += (0.5 * stiffness * turned - resists[TILT_PUSH]) * turned
    state[LAST_DAMPED] += lost * tilt_rate


@kernel
def add_table_mesh(
    q: Floats, v: Floats, m: int, meshes: Meshes, table: TableArrays | None, law: Scratch | None, work: Work
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


@kernel
def add_meshes(q: Floats, v: Floats, meshes: Meshes, work: Work) -> None:
    """Add the forces of all meshes to `work.loads` and `work.force`; leave what they do in `work.mesh.states`."""
    for m in range(meshes.coordinates.shape[0]):
        if meshes.form[m] == TABLE_FORM:
            add_table_mesh(q, v, m, meshes, meshes.table, work.mesh.law, work)
        elif meshes.spinning[m] == 1 and meshes.error_pieces[m, 0] + meshes.error_pieces[m, 1] == 0:
            add_spinning_mesh(q, v, m, meshes, work)
        else:
            add_row_mesh(q, v, m, meshes, work)
