"""Surface of a body from another program: how it moves with the interface coordinates, for the sound that it radiates.

An NPZ file has one of two forms; n coordinates, six of each of `nodes` (s,), then those of `modal` (m,) if it has some:

points
    `points` (p, 3), outward unit `normals` (p, 3) and `areas` (p,) of the outer surface, and the recovery matrix
    `displacement` (3 p, n): rows are the displacements of each point along x, y and z. It may be in an op4 file as MUG1
    instead, also with rotations after the displacements of each point (6 p, n).
integral
    `normal_motion` (n, n), the integral of (n . u)(n . u)^T over the outer surface, and its `area`, as
    `exugear.system.bodies.outer_surface` has it.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from exugear.system.bodies.matrix_files.interface import InterfaceMatrices, Label, LabelledMatrix, MatrixFileError
from exugear.system.bodies.matrix_files.op4 import RECOVERY, read_op4
from exugear.system.bodies.matrix_files.plain import read_arrays, six_each
from fe_ste.tools.arrays import Floats

MOST_POINTS = 200_000
"""Largest number of points."""
UNIT = 1e-3
"""Largest difference of the length of a normal from one."""
UNEVEN = 0.01
"""Largest difference of the motion of a surface in rigid motions of the nodes from that of a rigid body, over that."""
AT_A_TIME = 10_000
"""Points whose normal displacements are held together."""
OF_POINTS = ("points", "normals", "areas", "displacement")
OF_INTEGRAL = ("normal_motion", "area")
"""Arrays of both forms."""


@dataclass(frozen=True, eq=False)
class Recovery:
    """Outer surface of a body as it is in a file."""

    normal_motion: LabelledMatrix
    """(n, n) integral of (n . u)(n . u)^T over the surface."""
    area: float
    rigid: Floats | None = None
    """(6, 6) the same of translations and of rotations about the origin by the places of the points, if it has some."""


def read_recovery(path: Path, displacements: Path | None = None) -> Recovery:
    """Read the surface of a body, in the units and axes of its files.

    Parameters
    ----------
    displacements : op4 file with the recovery matrix, if the surface has none

    Raises
    ------
    MatrixFileError
        The file is no NPZ file, is truncated, lacks an array, or an array has another shape than the others demand.
    """
    if path.suffix.lower() != ".npz":
        raise MatrixFileError(
            f"{path}: unknown format of a surface; its name must end in .npz: write points, normals, areas and nodes, "
            "and the recovery matrix as displacement, or set recovery_matrix to an op4 file with MUG1"
        )
    arrays = read_arrays(path, ("nodes",), ("modal", *OF_POINTS, *OF_INTEGRAL), 3 * MOST_POINTS)
    for name, values in arrays.items():
        if not np.isfinite(values).all():
            raise MatrixFileError(f"{path}: array {name} has values that are not finite; write the file again")
    numbers, modal = ([int(number) for number in arrays.get(name, np.zeros(0)).ravel()] for name in ("nodes", "modal"))
    labels: tuple[Label, ...] = (*six_each(numbers), *((number, 0) for number in modal))
    if len(set(labels)) < len(labels):
        raise MatrixFileError(f"{path}: arrays nodes and modal have a number twice; give each one of its own")
    size = len(labels)
    if all(name in arrays for name in OF_INTEGRAL):
        matrix, area = arrays["normal_motion"], arrays["area"]
        if matrix.shape != (size, size) or area.size != 1 or not area.ravel()[0] > 0.0:
            raise MatrixFileError(
                f"{path}: arrays normal_motion {matrix.shape} and area {area.shape}; expected ({size}, {size}), six "
                "rows for each of nodes and one for each of modal, and a positive number"
            )
        return Recovery(LabelledMatrix(matrix.astype(np.float64), labels), float(area.ravel()[0]))
    if displacements is not None:
        if "displacement" in arrays:
            raise MatrixFileError(f"{path}: has the array displacement; remove it, or the key recovery_matrix")
        arrays["displacement"] = _of_op4(displacements, len(arrays.get("areas", ())))
    lacking = [name for name in OF_POINTS if name not in arrays]
    if lacking:
        raise MatrixFileError(f"{path}: no array {lacking[0]!r}; write {', '.join(OF_POINTS)}, and nodes")
    points, normals, areas, displacement = (arrays[name].astype(np.float64) for name in OF_POINTS)
    count = len(areas)
    wanted = {"points": (count, 3), "normals": (count, 3), "areas": (count,), "displacement": (3 * count, size)}
    for name, shape in wanted.items():
        if not count or arrays[name].shape != shape:
            raise MatrixFileError(
                f"{path}: array {name} has the shape {arrays[name].shape}; expected {shape} for {count} areas and "
                f"{size} coordinates, six of each node, then the modal ones"
            )
    length = np.linalg.norm(normals, axis=1)
    wrong = np.flatnonzero((np.abs(length - 1.0) > UNIT) | ~(areas > 0.0))
    if len(wrong):
        point = int(wrong[0])
        raise MatrixFileError(
            f"{path}: point {point + 1} has a normal of length {length[point]:g} and the area {areas[point]:g}; "
            "expected unit normals and positive areas"
        )
    matrix = np.zeros((size, size))
    for start in range(0, count, AT_A_TIME):
        own = slice(start, start + AT_A_TIME)
        moved = displacement[3 * start : 3 * (start + AT_A_TIME)].reshape(-1, 3, size)
        rows = np.sqrt(areas[own])[:, None] * np.einsum("pa,pan->pn", normals[own], moved)
        matrix += rows.T @ rows
    rigid = np.sqrt(areas)[:, None] * np.hstack([normals, np.cross(points, normals)])
    return Recovery(LabelledMatrix(matrix, labels), float(areas.sum()), rigid.T @ rigid)


def _of_op4(path: Path, points: int) -> Floats:
    """Read the recovery matrix (3 p, n) of p points from an op4 file."""
    if path.suffix.lower() != ".op4":
        raise MatrixFileError(f"{path}: unknown format of a recovery matrix; its name must end in .op4")
    found, names = read_op4(path, frozenset((RECOVERY,)))
    if RECOVERY not in found:
        raise MatrixFileError(f"{path}: no matrix {RECOVERY}; matrices are {', '.join(names[:20])}")
    values = found[RECOVERY].values
    if len(values) == 6 * points:
        return values.reshape(points, 2, 3, -1)[:, 0].reshape(3 * points, -1)
    if len(values) == 3 * points:
        return values
    raise MatrixFileError(
        f"{path}: matrix {RECOVERY} has {len(values)} rows; expected three or six for each of the {points} points of "
        "the surface, in their order"
    )


def recovery_content(matrices: InterfaceMatrices) -> bytes:
    """Content of the NPZ file of a surface, in the form of the integral."""
    assert matrices.normal_motion is not None
    buffer = io.BytesIO()
    np.savez(
        buffer,
        nodes=np.array(matrices.nodes, dtype=np.int64),
        modal=np.array(matrices.modal, dtype=np.int64),
        normal_motion=matrices.normal_motion,
        area=np.array([matrices.area]),
    )
    return buffer.getvalue()


def with_surface(matrices: InterfaceMatrices, recovery: Recovery, path: Path) -> InterfaceMatrices:
    """Return matrices that have the normal motion of a surface with its area, both in the units of the files.

    Raises
    ------
    MatrixFileError
        Rigid motions of the nodes do not move the surface like a rigid body. Without points it is only known that the
        squares of the normal motion by translations along x, y and z add up to one everywhere.
    """
    motions = matrices.rigid_motions((0.0, 0.0, 0.0))
    assert matrices.normal_motion is not None
    found = motions.T @ matrices.normal_motion @ motions
    moved = float(np.trace(found[:3, :3]))
    off = moved / recovery.area - 1.0
    if recovery.rigid is not None:
        sizes = np.sqrt(np.diag(recovery.rigid))
        differences = np.abs(found - recovery.rigid) / np.outer(sizes, sizes).clip(min=1e-300)
        off = max(abs(off), float(np.where(np.outer(sizes, sizes) > 0.0, differences, 0.0).max()))
    if abs(off) > UNEVEN:
        raise MatrixFileError(
            f"{path}: the surface does not move with the nodes as a rigid body (translations by "
            f"{moved / recovery.area:.4g} of its area); check order of coordinates, units, and that displacements are "
            "along x, y, z"
        )
    return replace(matrices, area=recovery.area)
