"""Forces of gear meshes in the compiled solver: the laws' forms on the geometry that is arranged for speed."""

from __future__ import annotations

from exugear.kernels.fast_meshes import (
    ALONG_DEFLECTION,
    ALONG_FORCE,
    TABLE_FORCE,
    Meshes,
    mesh_row,
    subtract_wheel_errors,
)
from exugear.kernels.meshes import FRAME, ROW_SIZE, SPIN_1, SPIN_2
from exugear.kernels.table_law import FORCE_DERIVATIVES, NOMINAL_DEFLECTION
from exugear.solvers.compiled.arrays import COSINE, SINE, Work
from exugear.tooth_mesh.laws.forms import row_law
from exugear.tooth_mesh.laws.table import TABLE_FORM, fast_table_force
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel


@kernel
def mesh_motion(q: Floats, v: Floats, m: int, meshes: Meshes, work: Work) -> tuple[float, float, float]:
    """Deflection of mesh m, its rate, and the rate along the force row; fills `work.mesh.gradient`."""
    index, gradient = meshes.coordinates[m], work.mesh.gradient
    clean = meshes.error_pieces[m, 0] + meshes.error_pieces[m, 1] == 0
    # Gears that only spin, without errors: two products instead of a row of thirteen, and no gradient is needed.
    if meshes.spinning[m] == 1 and clean:
        lever_1, lever_2 = meshes.deflection[m, SPIN_1], meshes.deflection[m, SPIN_2]
        i, j, k = index[SPIN_1], index[SPIN_2], index[FRAME]
        delta = meshes.table.nominal[m, NOMINAL_DEFLECTION] + lever_1 * (q[i] - q[k]) + lever_2 * (q[j] - q[k])
        rate = lever_1 * (v[i] - v[k]) + lever_2 * (v[j] - v[k])
        if meshes.conjugate[m] == 1:
            return delta, rate, rate
        lever_1, lever_2 = meshes.force[m, SPIN_1], meshes.force[m, SPIN_2]
        return delta, rate, lever_1 * (v[i] - v[k]) + lever_2 * (v[j] - v[k])
    c, s = work.turns[meshes.slot[m], COSINE], work.turns[meshes.slot[m], SINE]
    delta, rate = mesh_row(q, v, index, meshes.axis[m], meshes.deflection[m], c, s, gradient[ALONG_DEFLECTION])
    delta += meshes.table.nominal[m, NOMINAL_DEFLECTION]
    if not clean:
        less, slower = subtract_wheel_errors(q, v, m, 1.0, meshes, gradient[ALONG_DEFLECTION])
        delta, rate = delta + less, rate + slower
    # A law that pushes along its deflection has one row; it is not turned twice.
    if meshes.conjugate[m] == 1:
        return delta, rate, rate
    _, acting = mesh_row(q, v, index, meshes.axis[m], meshes.force[m], c, s, gradient[ALONG_FORCE])
    if not clean:
        _, slower = subtract_wheel_errors(q, v, m, 1.0, meshes, gradient[ALONG_FORCE])
        acting += slower
    return delta, rate, acting


@kernel
def mesh_law(q: Floats, v: Floats, m: int, delta: float, meshes: Meshes) -> tuple[float, float, float, float, float]:
    """Elastic force of mesh m at a deflection (m), of a law along a row; results as of `row_law`."""
    index = meshes.coordinates[m]
    pmc = meshes.phase[m] + meshes.cycles[m] * (q[index[SPIN_1]] - q[index[FRAME]])
    cycling = meshes.cycles[m] * (v[index[SPIN_1]] - v[index[FRAME]])
    return row_law(meshes.form[m], meshes.stiffness[m], meshes.pieces[m], delta, pmc, cycling)


@kernel
def add_meshes(q: Floats, v: Floats, meshes: Meshes, work: Work) -> None:
    """Add the generalized forces of all meshes to `work.force`."""
    f = work.force
    for m in range(meshes.coordinates.shape[0]):
        index = meshes.coordinates[m]
        if meshes.form[m] == TABLE_FORM:
            c, s = work.turns[meshes.slot[m], COSINE], work.turns[meshes.slot[m], SINE]
            fast_table_force(q, v, m, FORCE_DERIVATIVES, meshes, c, s, work.mesh, work.total)
            for i in range(ROW_SIZE):
                f[index[i]] -= work.mesh.gradient[TABLE_FORCE, i]
            continue
        delta, rate, _ = mesh_motion(q, v, m, meshes, work)
        force = mesh_law(q, v, m, delta, meshes)[0] + meshes.damping[m] * rate
        if meshes.spinning[m] == 1 and meshes.error_pieces[m, 0] + meshes.error_pieces[m, 1] == 0:
            torque_1, torque_2 = force * meshes.force[m, SPIN_1], force * meshes.force[m, SPIN_2]
            f[index[SPIN_1]] -= torque_1
            f[index[SPIN_2]] -= torque_2
            # The frame that carries the gears takes what they leave.
            f[index[FRAME]] += torque_1 + torque_2
        else:
            acting = work.mesh.gradient[ALONG_FORCE - meshes.conjugate[m]]
            for i in range(ROW_SIZE):
                f[index[i]] -= force * acting[i]
