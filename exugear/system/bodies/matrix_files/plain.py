"""Matrices and nodes as NPZ (NumPy) and CSV, for programs that write such tables by a script.

NPZ
    Arrays `nodes` (s,), `positions` (s, 3), `mass` and `stiffness` (n, n) with n = 6 s + m; m modal coordinates last,
    whose numbers `modal` (m,) are optional.
CSV of a matrix
    A line of headings `NODE.COMPONENT`, such as `12.1` for the displacement of node 12 along x, and a row for each
    coordinate in the same order. Component 0 is a modal coordinate.
CSV of the nodes
    The headings `node,x,y,z` and a row for each node, in the order of a matrix without headings. A modal coordinate has
    a number and no position: `900001,,,`.
"""

from __future__ import annotations

import io
import os
import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.system.bodies.matrix_files.interface import (
    NODE_SIZE,
    InterfaceMatrices,
    Label,
    LabelledMatrix,
    MatrixFileError,
    NodeTable,
    check_size,
)
from exugear.system.bodies.matrix_files.text import real, text_lines, whole
from fe_ste.tools.files import FileError, open_regular

ARRAYS = ("nodes", "positions", "mass", "stiffness")
"""Arrays that an NPZ file must have."""
MOST_NUMBERS = 60_000_000
"""Largest number of numbers of an array that is no matrix, 480 MB."""
_DEFLATE_RATIO = 1040
"""Deflate shortens nothing by more than a factor of 1032."""
_MODAL_NUMBER = 900_001
"""Number of the first modal coordinate where a file states none."""
_MOST_MEMBERS = 1000
_LABEL = re.compile(r"(-?\d{1,18})\.([0-6])")


def read_npz(path: Path) -> tuple[dict[str, LabelledMatrix], NodeTable]:
    """Matrices `stiffness` and `mass`, and the nodes, of an NPZ file; nothing in it is run.

    Raises
    ------
    MatrixFileError
        The file is no NPZ file, is truncated, lacks an array, or an array has another type, shape or size than stated.
    """
    arrays = read_arrays(path, ARRAYS, ("modal",))
    nodes, positions = arrays["nodes"], arrays["positions"]
    if nodes.dtype.kind not in "iu" or nodes.ndim != 1 or positions.shape != (len(nodes), 3):
        raise MatrixFileError(
            f"{path}: arrays nodes {nodes.shape} and positions {positions.shape}; expected whole numbers (s,) and "
            "numbers (s, 3)"
        )
    if not np.isfinite(positions).all():
        raise MatrixFileError(f"{path}: array positions has values that are not finite; write the file again")
    numbers = [int(number) for number in nodes]
    size = len(arrays["stiffness"])
    modes = size - NODE_SIZE * len(numbers)
    if modes < 0:
        raise MatrixFileError(
            f"{path}: array stiffness has {size} rows for {len(numbers)} nodes; expected six coordinates per node, "
            "then modal coordinates"
        )
    modal = [int(number) for number in arrays.get("modal", np.zeros(0))] or range(_MODAL_NUMBER, _MODAL_NUMBER + modes)
    labels = (*six_each(numbers), *((number, 0) for number in modal))
    if len(set(labels)) < len(labels) or len(labels) != size or set(modal) & set(numbers):
        raise MatrixFileError(
            f"{path}: arrays nodes and modal state {len(labels)} coordinates for {size} rows, or a number twice; give "
            "each node and mode one number of its own"
        )
    matrices = {name: LabelledMatrix(_square(arrays[name], name, path), labels) for name in ("stiffness", "mass")}
    table = NodeTable({n: (float(x), float(y), float(z)) for n, (x, y, z) in zip(numbers, positions, strict=True)})
    return matrices, table


def read_arrays(
    path: Path, names: tuple[str, ...], others: tuple[str, ...], most: int | None = None
) -> dict[str, NDArray[Any]]:
    """Arrays of real numbers of an NPZ file: `names`, and those of `others` that it has; nothing in it is run.

    Parameters
    ----------
    most : rows that an array may have; by default as many as a matrix

    Raises
    ------
    MatrixFileError
        The file is no NPZ file, is truncated, lacks an array, or an array has another type or size than stated.
    """
    try:
        with open_regular(path) as file:
            length = os.fstat(file.fileno()).st_size
            with zipfile.ZipFile(file) as archive:
                known = set(archive.namelist())
                chosen = (*names, *(name for name in others if f"{name}.npy" in known))
                return {name: _array(archive, name, length, path, names, most) for name in chosen}
    except FileError as error:
        raise MatrixFileError(str(error)) from None
    # zipfile and zlib raise many kinds of errors on damaged files, also NotImplementedError and EOFError.
    except (zipfile.BadZipFile, OSError, ValueError, EOFError, RuntimeError, LookupError, MemoryError) as error:
        if isinstance(error, MatrixFileError):
            raise
        raise MatrixFileError(f"{path}: not a readable NPZ file ({error}); write it again with numpy.savez") from None


def _array(
    archive: zipfile.ZipFile, name: str, length: int, path: Path, expected: tuple[str, ...], most: int | None
) -> NDArray[Any]:
    """Array of an NPZ file, allocated after its header was compared with the size of the file."""
    members = archive.infolist()
    if len(members) > _MOST_MEMBERS:
        raise MatrixFileError(f"{path}: {len(members)} arrays; expected {', '.join(expected)}")
    info = next((member for member in members if member.filename == f"{name}.npy"), None)
    if info is None:
        found = ", ".join(member.filename.removesuffix(".npy")[:40] for member in members[:8]) or "none"
        raise MatrixFileError(f"{path}: no array {name!r}; arrays are {found}; write {', '.join(expected)}")
    if info.file_size > _DEFLATE_RATIO * length:
        raise MatrixFileError(
            f"{path}: array {name} states {info.file_size} bytes in a file of {length}; write it again"
        )
    with archive.open(info) as member:
        version = np.lib.format.read_magic(member)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran_order, dtype = read_header(member)
        if dtype.kind not in "fiu" or len(shape) > 2:
            raise MatrixFileError(f"{path}: array {name} has type {dtype} and shape {shape}; expected real numbers")
        count = int(np.prod(shape, dtype=object))
        if most is not None and (max(shape, default=1) > most or count > MOST_NUMBERS):
            raise MatrixFileError(
                f"{path}: array {name} has the shape {shape}; at most {most} rows and {MOST_NUMBERS} numbers are read"
            )
        if most is None and shape != (0,):  # a body without modal coordinates
            check_size(max(shape, default=0), path, name)
        begin = member.tell()
        needed = count * dtype.itemsize
        if needed != info.file_size - begin:
            raise MatrixFileError(
                f"{path}: array {name} {shape} needs {needed} bytes, the file has {info.file_size - begin}; write it "
                "again"
            )
        content = member.read(needed)
    if len(content) < needed:
        raise MatrixFileError(f"{path}: array {name} is cut short at {len(content)} of {needed} bytes; write it again")
    values = np.frombuffer(content, dtype)
    return values.reshape(shape, order="F" if fortran_order else "C")


def _square(values: NDArray[Any], name: str, path: object) -> NDArray[np.float64]:
    """Return a matrix in double precision, which must be square and finite."""
    if values.ndim != 2 or values.shape[0] != values.shape[1]:
        raise MatrixFileError(f"{path}: matrix {name} has the shape {values.shape}; expected a square matrix")
    matrix = values.astype(np.float64)
    wrong = np.argwhere(~np.isfinite(matrix))
    if len(wrong):
        row, column = wrong[0] + 1
        raise MatrixFileError(f"{path}: matrix {name}: row {row}, column {column} is not finite; write the file again")
    return matrix


def six_each(numbers: list[int]) -> list[Label]:
    """Return the coordinates of nodes."""
    return [(number, component) for number in numbers for component in range(1, NODE_SIZE + 1)]


def npz_content(matrices: InterfaceMatrices) -> bytes:
    """Content of an NPZ file, exact to the last digit."""
    buffer = io.BytesIO()
    np.savez(
        buffer,
        nodes=np.array(matrices.nodes, dtype=np.int64),
        positions=matrices.positions,
        modal=np.array(matrices.modal, dtype=np.int64),
        mass=matrices.mass,
        stiffness=matrices.stiffness,
    )
    return buffer.getvalue()


def read_csv_matrix(path: Path) -> LabelledMatrix:
    """Matrix of a CSV file with headings `NODE.COMPONENT`.

    Raises
    ------
    MatrixFileError
        A heading is not of this form or occurs twice, or there are not as many rows and columns as headings.
    """
    lines = ((number, text) for number, text in text_lines(path) if text.strip())
    first = next(lines, None)
    if first is None:
        raise MatrixFileError(f"{path}: is empty; expected headings NODE.COMPONENT and rows of numbers")
    headings = [word.strip().strip('"') for word in first[1].split(",")]
    check_size(len(headings), path, "of the file")
    labels = []
    for heading in headings:
        found = _LABEL.fullmatch(heading)
        if found is None:
            raise MatrixFileError(
                f"{path}: line {first[0]}: heading {heading[:40]!r}; expected NODE.COMPONENT, such as 12.1 for ux of "
                "node 12, or 900001.0 for a modal coordinate"
            )
        labels.append((int(found[1]), int(found[2])))
    if len(set(labels)) < len(labels):
        twice = next(heading for heading in headings if headings.count(heading) > 1)
        raise MatrixFileError(f"{path}: heading {twice} occurs twice; rename one")
    rows: list[NDArray[np.float64]] = []
    for number, text in lines:
        rows.append(_row(text, len(headings), f"{path}: line {number}"))
        if len(rows) > len(headings):
            break
    if len(rows) != len(headings):
        count = f"{len(rows)}" if len(rows) < len(headings) else "more"
        raise MatrixFileError(f"{path}: {count} rows for {len(headings)} headings; expected one for each")
    return LabelledMatrix(np.array(rows), tuple(labels))


def _row(text: str, count: int, place: str) -> NDArray[np.float64]:
    """Numbers of a line."""
    words = text.split(",")
    if len(words) != count:
        raise MatrixFileError(f"{place}: {len(words)} numbers; expected {count}; write the file again")
    try:
        row = np.array(words, dtype=np.float64)
    except ValueError:
        row = np.array([real(word, place) for word in words])
    if not np.isfinite(row).all():
        raise MatrixFileError(f"{place}: column {int(np.argmin(np.isfinite(row))) + 1} is not finite")
    return row


def read_csv_nodes(path: Path) -> NodeTable:
    """Nodes of a CSV file with the headings `node,x,y,z`.

    Raises
    ------
    MatrixFileError
        The headings are others, a line is not a number and a position, or a number occurs twice.
    """
    lines = ((number, text) for number, text in text_lines(path) if text.strip())
    _, heading = next(lines, (0, ""))
    if [word.strip().strip('"').lower() for word in heading.split(",")] != ["node", "x", "y", "z"]:
        raise MatrixFileError(f"{path}: line 1: headings {heading[:60]!r}; expected node,x,y,z")
    positions: dict[int, tuple[float, float, float]] = {}
    order: list[Label] = []
    known: set[int] = set()
    for number, text in lines:
        place = f"{path}: line {number}"
        first, *words = text.split(",")
        if len(words) != 3:
            raise MatrixFileError(f"{place}: {len(words) + 1} columns; expected node,x,y,z")
        node = whole(first, place)
        if node in known:
            raise MatrixFileError(f"{place}: number {node} occurs twice; remove one")
        known.add(node)
        if any(word.strip() for word in words):
            x, y, z = (real(word, place) for word in words)
            positions[node] = (x, y, z)
            order += six_each([node])
        else:
            order.append((node, 0))
    return NodeTable(positions, order=tuple(order))


def csv_matrix_content(matrices: InterfaceMatrices, name: str) -> bytes:
    """Content of the CSV file of a matrix, "mass", "stiffness" or "gyroscopic", exact to the last digit."""
    buffer = io.BytesIO()
    headings = ",".join(f"{node}.{component}" for node, component in matrices.labels)
    np.savetxt(buffer, getattr(matrices, name), fmt="%.17g", delimiter=",", header=headings, comments="")
    return buffer.getvalue()


def csv_nodes_content(matrices: InterfaceMatrices) -> bytes:
    """Content of the CSV file of the nodes."""
    rows = zip(matrices.nodes, matrices.positions.tolist(), strict=True)
    lines = ["node,x,y,z", *(f"{node},{x:.17g},{y:.17g},{z:.17g}" for node, (x, y, z) in rows)]
    lines += [f"{number},,," for number in matrices.modal]
    return ("\n".join(lines) + "\n").encode()
