"""Matrices of Abaqus: matrix input, user elements (substructures), and the nodes of an input file.

Matrix input
    Written by `*MATRIX OUTPUT, FORMAT=MATRIX INPUT`: a line `node, component, node, component, value` for each entry
    of one triangle or of both.
User element
    Written by `*SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED`: the node numbers in comments, lists of
    components that apply from a node on, and a triangle of each matrix, row by row of the lower one.

Both list no positions; these are in the input file or in a CSV file. Internal unknowns, such as the modal coordinates
of a substructure, have numbers without a position.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from exugear.system.bodies.matrix_files.interface import (
    EntryList,
    InterfaceMatrices,
    Label,
    LabelledMatrix,
    MatrixFileError,
    NodeTable,
    check_size,
)
from exugear.system.bodies.matrix_files.text import real, text_lines, whole
from fe_ste.tools.arrays import Floats

_TYPES = {"STIFFNESS": "stiffness", "MASS": "mass"}
_TYPE = re.compile(r"TYPE\s*=\s*(\w+)")
_COORDINATE_FORMAT = 3
"""Words in a line of the format COORDINATE, which has lost the nodes."""


def read_mtx(path: Path) -> dict[str, LabelledMatrix]:
    """Matrices of a file: those of a user element by "stiffness" and "mass", or the one of a matrix input by "matrix".

    Raises
    ------
    MatrixFileError
        The file is neither, is truncated, lists an entry twice, or contains supports.
    """
    for _, text in text_lines(path):
        if re.match(r"\*\s*USER\s+ELEMENT", text.upper()):
            return _read_user_element(path)
        if text.strip() and not text.startswith("*"):
            break
    return {"matrix": _read_matrix_input(path)}


def _read_matrix_input(path: Path) -> LabelledMatrix:
    entries = EntryList(path, "of the file")
    for number, text in text_lines(path):
        if not text.strip() or text.startswith("*"):
            continue
        place = f"{path}: line {number}"
        words = text.split(",")
        if len(words) == _COORDINATE_FORMAT or (len(words) == 1 and len(text.split()) == _COORDINATE_FORMAT):
            raise MatrixFileError(
                f"{place}: row, column and value without nodes; write *MATRIX OUTPUT, FORMAT=MATRIX INPUT instead of "
                "FORMAT=COORDINATE"
            )
        if len(words) != 5:
            raise MatrixFileError(f"{place}: expected node, component, node, component, value; write the file again")
        row, row_component, column, column_component = (whole(word, place) for word in words[:4])
        entries.add((row, row_component), (column, column_component), real(words[4], place))
    return entries.matrix(mirrored=True)


def _read_user_element(path: Path) -> dict[str, LabelledMatrix]:
    nodes: list[int] = []
    components: list[tuple[int, list[int]]] = []
    values: dict[str, list[float]] = {}
    block = ""
    in_node_list = False
    for number, text in text_lines(path):
        place = f"{path}: line {number}"
        if text.startswith("**"):
            comment = text.strip("* \t,")
            in_node_list = in_node_list or comment.upper().startswith("ELEMENT NODES")
            words = re.split(r"[,\s]+", comment)
            if in_node_list and all(re.fullmatch(r"-?\d{1,18}", word) for word in words):
                nodes += map(int, words)
        elif text.startswith("*"):
            in_node_list = False
            block = text[1:].strip().upper()
            found = _TYPE.search(block) if block.startswith("MATRIX") else None
            if found is not None and found[1] in _TYPES:
                block = _TYPES[found[1]]
                if values.setdefault(block, []):
                    raise MatrixFileError(f"{place}: a second {block} matrix; write one substructure per file")
            elif found is not None:
                block = ""
        elif block in values:
            values[block] += [real(word, place) for word in text.split(",") if word.strip()]
        elif block.startswith("USER ELEMENT") and text.strip():
            numbers = [whole(word, place) for word in text.split(",") if word.strip()]
            # The first line lists components alone; the others begin with the node, counted from 1, they apply from.
            components.append((numbers[0], numbers[1:]) if components else (1, numbers))
    if not values:
        raise MatrixFileError(
            f"{path}: no *MATRIX, TYPE=STIFFNESS or MASS; write *SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED, "
            "STIFFNESS=YES, MASS=YES"
        )
    starts = dict(components)
    current: list[int] = []
    order: list[Label] = []
    for count, node in enumerate(nodes, start=1):
        current = starts.get(count, current)
        order += ((node, component) for component in current)
    labels = tuple(order)
    return {name: LabelledMatrix(_triangle(entries, labels, path, name), labels) for name, entries in values.items()}


def _triangle(values: list[float], labels: tuple[Label, ...], path: Path, name: str) -> Floats:
    """Symmetric matrix of its lower triangle, row by row."""
    count = (math.isqrt(8 * len(values) + 1) - 1) // 2
    check_size(count, path, name)
    if count * (count + 1) // 2 != len(values) or count != len(labels):
        raise MatrixFileError(
            f"{path}: matrix {name}: {len(values)} values, but the nodes and components of the element have "
            f"{len(labels)} coordinates, which need {len(labels) * (len(labels) + 1) // 2}; the file is truncated, or "
            "its node list is missing"
        )
    matrix = np.zeros((count, count))
    rows, columns = np.tril_indices(count)
    matrix[rows, columns] = values
    matrix[columns, rows] = values
    return matrix


def read_inp_nodes(path: Path) -> NodeTable:
    """Nodes of an Abaqus or CalculiX input file: its blocks `*NODE`, without included files.

    Raises
    ------
    MatrixFileError
        The file has no nodes, or a line of them is not a number and a position.
    """
    positions: dict[int, tuple[float, float, float]] = {}
    inside = False
    for number, text in text_lines(path):
        if text.startswith("**") or not text.strip():
            continue
        if text.startswith("*"):
            inside = re.fullmatch(r"\*\s*NODE\s*", text.split(",")[0].upper()) is not None
        elif inside:
            place = f"{path}: line {number}"
            node, *words = (word for word in text.split(",") if word.strip())
            if not 1 <= len(words) <= 3:
                raise MatrixFileError(f"{place}: expected the number of a node and its position")
            x, y, z = (*(real(word, place) for word in words), *[0.0] * (3 - len(words)))
            positions[whole(node, place)] = (x, y, z)
    if not positions:
        raise MatrixFileError(f"{path}: no block *NODE; expected the positions of the interface nodes")
    return NodeTable(positions)


def mtx_content(matrices: InterfaceMatrices, name: str) -> bytes:
    """Content of the matrix input file of a matrix, "mass" or "stiffness", exact to the last digit."""
    matrix = getattr(matrices, name)
    labels = [(node, component or 1) for node, component in matrices.labels]
    lines = [f"** {name} matrix: node, component, node, component, value; one triangle"]
    for row, column in zip(*np.nonzero(np.tril(matrix)), strict=True):
        (node, component), (other, with_component) = labels[row], labels[column]
        lines.append(f"{node},{component}, {other},{with_component}, {matrix[row, column]:.16e}")
    return ("\n".join(lines) + "\n").encode()
