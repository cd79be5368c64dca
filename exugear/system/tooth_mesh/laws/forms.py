"""Forces of all meshes in one pass, each by the form that its law has: plain, and in loops over time.

Forms are numbered (`MeshArrays.form`). All but that of the law `table` depend on the deflection along a row and stand
in `exugear.system.tooth_mesh.laws.along_row`; a table depends on where the gears stand as well.
"""

from __future__ import annotations

import numpy as np

from exugear.system.tooth_mesh.kernels.fast_meshes import Meshes, MeshWork
from exugear.system.tooth_mesh.kernels.meshes import ROW_SIZE, STATE_SIZE, MeshArrays
from exugear.system.tooth_mesh.kernels.table_law import Scratch, TableArrays, scratch_memory
from exugear.system.tooth_mesh.laws.along_row import (
    ACTING,
    ROW_MEMORY,
    add_row_mesh,
    add_row_tangent,
    add_spinning_mesh,
    row_force,
)
from exugear.system.tooth_mesh.laws.table import (
    TABLE_FORM,
    TABLE_MEMORY,
    add_table_mesh,
    add_table_tangent,
    table_force,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel
from fe_ste.tools.inner_kernels import bundle, kept_bundle

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
    """Do for all meshes what the functions below say, where there is room for it.

    One function does all, so that the laws are compiled once. `table` is that of `acting_table`, and the memory
    of its law is there with it; `memory` is (`MEMORY`, 13).
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
    """Fill (m, 10): what each mesh does; columns as named in `exugear.system.tooth_mesh.kernels.meshes`."""
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
