"""Compiled forces of all meshes: the form that each mesh's law has, chosen by its number, on one geometry.

A law whose force depends on the deflection along a row and on pmc is one branch in `row_law`; forces, tangents, energy
and powers follow for both solvers, and so does what resists misalignment. The law `table` depends on where the gears
stand as well and has forms of its own.
"""

from __future__ import annotations

import math

import numpy as np

from exugear.tooth_mesh.kernels.meshes import (
    CYCLE_POWER,
    DAMPED_POWER,
    DEFLECTION,
    ENERGY,
    FORCE,
    FRAME,
    OTHER_POWER,
    OUTSIDE,
    PMC,
    RATE,
    ROW_SIZE,
    SPIN_1,
    STATE_SIZE,
    STIFFNESS,
    TILT_DAMPING,
    TILT_LEVER,
    TILT_MOMENT,
    TILT_REST,
    TILT_STIFFNESS,
    MeshArrays,
    frame_row,
    load_way,
    mesh_pmc,
    net_deflection,
    rate_gradient,
    relative_spin,
    row_dot,
    turn_rows,
)
from exugear.tooth_mesh.kernels.table_law import (
    NOMINAL_DEFLECTION,
    NOMINAL_MISALIGNMENT,
    Scratch,
    TableArrays,
    scratch_memory,
)
from exugear.tooth_mesh.laws.line_of_action import CURVE_FORM, curve_law, stiffness_law
from exugear.tooth_mesh.laws.table import TABLE_FORM, TABLE_MEMORY, add_table_tangent, table_force
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.inner_kernels import bundle, kept_bundle

STATE, ACTING, ACTING_TURNING, GRADIENT, TURNING, BEND, SLOPE, TILTING, TILT_TURNING, STILL, BY_Q = range(11)
BY_V, OF_TABLE = BY_Q + ROW_SIZE, BY_Q + 2 * ROW_SIZE
MEMORY = OF_TABLE + TABLE_MEMORY
"""Rows of the memory of `pass_meshes`, (`MEMORY`, 13): vectors of a mesh, and derivatives of its force."""
_NOTHING, _NO_ROWS = np.zeros(0), np.zeros((0, 0))
"""No room for what `pass_meshes` fills."""


@kernel
def row_law(
    form: int, coefficients: Floats, pieces: int, delta: float, pmc: float, cycling: float
) -> tuple[float, float, float, float, float]:
    """Elastic force of a law along a row; results as of `stiffness_law`, which is the form of stated stiffness."""
    if form == CURVE_FORM:
        return curve_law(coefficients, pieces, delta, pmc, cycling)
    return stiffness_law(coefficients, pieces, delta, pmc, cycling)


@kernel
def tilted(q: Floats, m: int, meshes: MeshArrays, memory: Floats) -> float:
    """Misalignment of mesh m against that of its contact's state, rad; its gradient stays in `memory`.

    Rows of the deflection that stand there become those of e (`exugear.tooth_mesh.contact_state`).
    """
    gradient, turning, tilting, tilt_turning = memory[GRADIENT], memory[TURNING], memory[TILTING], memory[TILT_TURNING]
    table, lever = meshes.table, meshes.tilt[m, TILT_LEVER]
    tilt: float = table.nominal[m, NOMINAL_MISALIGNMENT] - meshes.tilt[m, TILT_REST]
    tilt += frame_row(q, meshes.coordinates[m], meshes.axis[m], table.misalignment[m], tilting, tilt_turning)
    for i in range(ROW_SIZE):
        gradient[i] -= lever * tilting[i]
        turning[i] -= lever * tilt_turning[i]
    return tilt


@kernel
def row_force(q: Floats, v: Floats, m: int, meshes: MeshArrays, memory: Floats, out: Floats, acting: Floats) -> None:
    """Fill the state of a mesh with a law along a row, as in `mesh_state`, and its negative generalized force (13,)."""
    gradient, turning, bend, tilting = memory[GRADIENT], memory[TURNING], memory[BEND], memory[TILTING]
    index, resists = meshes.coordinates[m], meshes.tilt[m]
    # What deflects, and how fast.
    delta = meshes.table.nominal[m, NOMINAL_DEFLECTION]
    delta += net_deflection(q, m, meshes, meshes.deflection[m], 1.0, gradient, turning, bend)
    rate = row_dot(index, gradient, v)
    out[DEFLECTION], out[RATE] = delta, rate
    moment, turned, stored, lost = 0.0, 0.0, 0.0, 0.0
    if resists[TILT_STIFFNESS] > 0.0:
        turned = tilted(q, m, meshes, memory)
        tilt_rate = row_dot(index, tilting, v)
        delta, rate = delta - resists[TILT_LEVER] * turned, rate - resists[TILT_LEVER] * tilt_rate
        moment = resists[TILT_MOMENT] - resists[TILT_STIFFNESS] * turned - resists[TILT_DAMPING] * tilt_rate
        stored = (0.5 * resists[TILT_STIFFNESS] * turned - resists[TILT_MOMENT]) * turned
        lost = resists[TILT_DAMPING] * tilt_rate * tilt_rate
    pmc = mesh_pmc(q, m, meshes)
    cycling = meshes.cycles[m] * relative_spin(v, index, 0)
    # The law, and its damper beside it, which stays where the load is in the mean.
    way, moving = load_way(m, pmc, meshes)
    elastic, k, _, energy, cycle_power = row_law(
        meshes.form[m], meshes.stiffness[m], meshes.pieces[m], delta - way * turned, pmc, cycling
    )
    moment += way * elastic
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
    out[CYCLE_POWER] = cycle_power + elastic * moving * turned * cycling
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
    gradient, turning, bend, slope = memory[GRADIENT], memory[TURNING], memory[BEND], memory[SLOPE]
    acting, acting_turning, index = memory[ACTING], memory[ACTING_TURNING], meshes.coordinates[m]
    tilting, tilt_turning, resists = memory[TILTING], memory[TILT_TURNING], meshes.tilt[m]
    delta = meshes.table.nominal[m, NOMINAL_DEFLECTION]
    delta += net_deflection(q, m, meshes, meshes.deflection[m], 1.0, gradient, turning, bend)
    pmc, turned = mesh_pmc(q, m, meshes), 0.0
    if resists[TILT_STIFFNESS] > 0.0:
        turned = tilted(q, m, meshes, memory)
        delta -= resists[TILT_LEVER] * turned
        add_tilt_tangent(v, index, turned, resists, memory, jq, jv)
    way, moving = load_way(m, pmc, meshes)
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
        add_way_tangent(elastic, k, by_pmc * meshes.cycles[m], way, moving * meshes.cycles[m], memory, jq)
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
def add_way_tangent(
    elastic: float, k: float, by_spin: float, way: float, moving: float, memory: Floats, jq: Floats
) -> None:
    """Add the derivatives of the moment of a load that moves along the face to the negative force, (13, 13).

    What the misalignment takes of the force's slope goes to `memory`; `by_spin` and `moving` are slopes of the elastic
    force (N) and of the load's way (m) by the spin of gear 1.
    """
    gradient, tilting, slope = memory[GRADIENT], memory[TILTING], memory[SLOPE]
    straight = memory[STILL]
    straight[:] = 0.0
    for i in range(ROW_SIZE):
        slope[i] -= k * way * tilting[i]
        for j in range(ROW_SIZE):
            jq[i, j] -= tilting[i] * way * k * (gradient[j] - way * tilting[j])
        jq[i, SPIN_1] -= tilting[i] * (way * by_spin + moving * elastic)
        jq[i, FRAME] += tilting[i] * (way * by_spin + moving * elastic)
    turn_rows(memory[TILT_TURNING], straight, -way * elastic, jq)


@kernel
def add_tilt_tangent(
    v: Floats, index: Integers, turned: float, resists: Floats, memory: Floats, jq: Floats, jv: Floats
) -> None:
    """Add the derivatives of what the tilt stiffness and its damper give to the negative force, (13, 13)."""
    tilting, tilt_turning, slope, straight = memory[TILTING], memory[TILT_TURNING], memory[SLOPE], memory[STILL]
    k, c = resists[TILT_STIFFNESS], resists[TILT_DAMPING]
    straight[:] = 0.0  # errors of wheels do not tilt
    rate_gradient(v, index, tilt_turning, straight, slope)
    for i in range(ROW_SIZE):
        for j in range(ROW_SIZE):
            jq[i, j] += tilting[i] * (k * tilting[j] + c * slope[j])
            jv[i, j] += tilting[i] * c * tilting[j]
    turn_rows(tilt_turning, straight, k * turned + c * row_dot(index, tilting, v) - resists[TILT_MOMENT], jq)


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
    """Do for all meshes what the functions below say, where there is room for it.

    One function does all, so that the laws are compiled once. `table` is that of `acting_table`, and the memory
    of its law is there with it; `memory` is (`MEMORY`, 13).
    """
    state, acting = memory[STATE], memory[ACTING]
    local_q, local_v, of_table = memory[BY_Q:BY_V], memory[BY_V:OF_TABLE], memory[OF_TABLE:]
    for m in range(meshes.coordinates.shape[0]):
        index = meshes.coordinates[m]
        if f.size > 0 or states.size > 0:
            if meshes.form[m] == TABLE_FORM:
                table_force(q, v, m, meshes, table, of_table, law_memory, state, acting)
            else:
                row_force(q, v, m, meshes, memory, state, acting)
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
    return meshes.table if (meshes.form == TABLE_FORM).any() else None


def _bundles(meshes: MeshArrays) -> tuple[MeshArrays, TableArrays | None]:
    table = acting_table(meshes)
    return kept_bundle(meshes), None if table is None else kept_bundle(table)


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
    """Fill (m, 10): what each mesh does; columns as named in `exugear.tooth_mesh.kernels.meshes`."""
    _pass(q, v, meshes, out, _NOTHING, _NO_ROWS, _NO_ROWS)
