"""Nastran punch and bulk data files: matrices (DMIG), nodes (GRID, SPOINT), local axes (CORD2R), their order (EXTRN).

A card is a name and fields of 8 columns, or of 16 with an asterisk behind the name, or separated by commas. DMIG of
form 6 lists one triangle of a symmetric matrix, of form 1 all entries; each column has an entry with node and
component, and the rows follow in groups of node, component, and real and imaginary part.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exugear.system.bodies.matrix_files.interface import (
    EntryList,
    InterfaceMatrices,
    Label,
    LabelledMatrix,
    MatrixFileError,
    NodeTable,
)
from exugear.system.bodies.matrix_files.text import real, text_lines, whole
from fe_ste.tools.arrays import Floats

SQUARE, SYMMETRIC = 1, 6
"""Forms of matrices: all entries, or one triangle."""
REAL_TYPES = (1, 2)
"""Types of real matrices, single and double precision; 3 and 4 are complex."""
MOST_SCALAR_POINTS = 100_000
"""Maximum number of scalar points of a THRU range."""
_DEEPEST_SYSTEM = 20
"""Maximum number of coordinate systems that are defined in each other."""
_FIELD = 16
_NAMES = ("GRID", "SPOINT", "CORD2R", "EXTRN", "DMIG")


@dataclass(frozen=True)
class _Card:
    """A card with its continuations."""

    name: str
    fields: list[str]
    place: str
    """File and line, for messages."""

    def word(self, number: int) -> str:
        """Return a field, counted from 0; empty if it is missing."""
        return self.fields[number].strip() if number < len(self.fields) else ""

    def whole(self, number: int, default: int | None = None) -> int:
        text = self.word(number)
        return default if default is not None and not text else whole(text, f"{self.place}: {self.name}")

    def real(self, number: int) -> float:
        text = self.word(number)
        return real(text, f"{self.place}: {self.name}") if text else 0.0


def _cards(path: Path) -> Iterator[_Card]:
    """Yield the cards of the file that are read here."""
    card = None
    for number, text in text_lines(path):
        line = text.partition("$")[0].expandtabs(8)
        if not line.strip():
            continue
        free = "," in line
        words = line.split(",") if free else [line[:8]]
        name = words[0].strip().upper()
        if not free:
            width = _FIELD if name.endswith("*") else _FIELD // 2
            words += [line[start : start + width] for start in range(8, 72, width)]
        # Free fields end with the line; behind the eighth, or the fourth wide one, is the name of the continuation.
        fields = words[1 : 5 if name.endswith("*") else 9]
        if not name or name[0] in "+*":
            if card is not None:
                card.fields.extend(fields)
            continue
        if card is not None:
            yield card
        name = name.rstrip("*").strip()
        card = _Card(name, fields, f"{path}: line {number}") if name in _NAMES else None
    if card is not None:
        yield card


@dataclass
class _Systems:
    """Coordinate systems of CORD2R cards: system of definition, and three points (origin, on z, in the xz plane)."""

    cards: dict[int, tuple[int, Floats, str]] = field(default_factory=dict)

    def add(self, card: _Card) -> None:
        points = np.array([card.real(number) for number in range(2, 11)]).reshape(3, 3)
        self.cards[card.whole(0)] = (card.whole(1, 0), points, card.place)

    def axes(self, number: int, place: str, depth: int = 0) -> tuple[Floats, Floats]:
        """Origin (3,) and axes (3, 3) as rows of a system, in the basic system."""
        if number == 0:
            return np.zeros(3), np.eye(3)
        if number not in self.cards or depth > _DEEPEST_SYSTEM:
            raise MatrixFileError(
                f"{place}: coordinate system {number} is not defined by a CORD2R card of the file; add it, or write "
                "the nodes in the basic system"
            )
        parent, points, defined = self.cards[number]
        origin, base = self.axes(parent, defined, depth + 1)
        first, on_z, in_plane = origin + points @ base
        along_z = on_z - first
        along_y = np.cross(along_z, in_plane - first)
        lengths = np.linalg.norm(along_z), np.linalg.norm(along_y)
        if not min(lengths) > 0.0:
            raise MatrixFileError(f"{defined}: CORD2R {number}: its three points lie on a line; write the file again")
        z, y = along_z / lengths[0], along_y / lengths[1]
        return first, np.array([np.cross(y, z), y, z])


@dataclass
class _Matrices:
    """DMIG matrices while their cards are read."""

    path: Path
    forms: dict[str, tuple[int, int]] = field(default_factory=dict)
    """By name, form and type from the header."""
    entries: dict[str, EntryList] = field(default_factory=dict)

    def add(self, card: _Card, wanted: frozenset[str]) -> None:
        name = card.word(0).upper()
        if name not in wanted:
            self.forms.setdefault(name, (0, 0))
            return
        if card.word(1) == "0":
            form, kind = card.whole(2), card.whole(3)
            if form not in (SQUARE, SYMMETRIC) or kind not in REAL_TYPES:
                raise MatrixFileError(
                    f"{card.place}: DMIG {name} has form {form} and type {kind}; only real symmetric (6) and square "
                    "(1) matrices are read; write those, and state structural damping by loss_factor"
                )
            self.forms[name] = (form, kind)
            return
        if self.forms.get(name, (0, 0))[0] == 0:
            raise MatrixFileError(f"{card.place}: DMIG {name} has no header card before its columns; write it again")
        column = (card.whole(1), card.whole(2, 0))
        entries = self.entries.setdefault(name, EntryList(self.path, name))
        for start in range(4, len(card.fields), 4):
            if card.word(start):
                entries.add((card.whole(start), card.whole(start + 1, 0)), column, card.real(start + 2))

    def complete(self) -> dict[str, LabelledMatrix]:
        return {name: entries.matrix(self.forms[name][0] == SYMMETRIC) for name, entries in self.entries.items()}


def read_punch(path: Path, wanted: frozenset[str]) -> tuple[dict[str, LabelledMatrix], tuple[str, ...], NodeTable]:
    """Matrices of the wanted names, names of all matrices, and nodes of a punch file.

    The order of matrices without labels is that of the EXTRN card, or else nodes by number, then scalar points by
    number.

    Raises
    ------
    MatrixFileError
        A number is damaged, a coordinate system is missing or no CORD2R, a wanted matrix is complex or rectangular, or
        an entry occurs twice.
    """
    systems = _Systems()
    grids: dict[int, _Card] = {}
    scalars: dict[int, None] = {}
    external: list[Label] = []
    matrices = _Matrices(path)
    for card in _cards(path):
        if card.name == "GRID":
            grids[card.whole(0)] = card
        elif card.name == "SPOINT":
            scalars |= dict.fromkeys(_scalar_points(card))
        elif card.name == "CORD2R":
            systems.add(card)
        elif card.name == "EXTRN":
            external += _external(card)
        else:
            matrices.add(card, wanted)
    positions = {}
    axes = {}
    for number, card in grids.items():
        origin, base = systems.axes(card.whole(1, 0), card.place)
        x, y, z = origin + np.array([card.real(n) for n in (2, 3, 4)]) @ base
        positions[number] = (float(x), float(y), float(z))
        displaced = card.whole(5, 0)
        if displaced != 0:
            axes[number] = systems.axes(displaced, card.place)[1]
    usual = [(number, component) for number in sorted(positions) for component in range(1, 7)]
    order = tuple(external) or (*usual, *((number, 0) for number in sorted(scalars)))
    complete = matrices.complete()
    return complete, tuple(matrices.forms), NodeTable(positions, axes, order)


def _scalar_points(card: _Card) -> Iterator[int]:
    if card.word(1).upper() != "THRU":
        yield from (card.whole(number) for number in range(len(card.fields)) if card.word(number))
        return
    first, last = card.whole(0), card.whole(2)
    if not 0 <= last - first < MOST_SCALAR_POINTS:
        raise MatrixFileError(f"{card.place}: SPOINT {first} THRU {last}; expected up to {MOST_SCALAR_POINTS} points")
    yield from range(first, last + 1)


def _external(card: _Card) -> Iterator[Label]:
    for number in range(0, len(card.fields), 2):
        if card.word(number):
            node = card.whole(number)
            components = card.word(number + 1) or "0"
            if re.fullmatch("[0-6]+", components) is None:
                raise MatrixFileError(
                    f"{card.place}: EXTRN: node {node} has components {components[:20]!r}; expected 1 to 6"
                )
            yield from ((node, int(component)) for component in components)


def nastran_real(value: float) -> str:
    """Return a number in 16 columns with as many digits as they take, ten to fourteen.

    Zero and sign of the exponent are left out where possible.

    Examples
    --------
    >>> [nastran_real(value) for value in (1.23456789012345e10, -2.0, 1e-7 / 3.0)]
    ['1.23456789012D10', '-2.0000000000000', '3.33333333333D-8']
    """
    if value == 0.0:
        return "0.0".rjust(_FIELD)
    for digits in range(13, 7, -1):
        mantissa, _, exponent = f"{value:.{digits}E}".partition("E")
        power = int(exponent)
        text = mantissa + (f"D{power}" if power else "")
        if len(text) <= _FIELD:
            return text.rjust(_FIELD)
    raise ValueError(f"{value!r} has no notation in {_FIELD} columns")


def nastran_decimal(value: float) -> str:
    """Return a number in 16 columns as single-precision fields take it: without the D of double precision.

    Examples
    --------
    >>> nastran_decimal(-1234.5678901234), nastran_decimal(2.5e-7)
    ('-1234.5678901234', ' 2.500000000E-07')
    """
    if 1e-3 <= abs(value) < 1e9:
        return f"{value:.{14 - len(str(int(abs(value))))}f}"[:_FIELD].rjust(_FIELD)
    return f"{value:.9E}".rjust(_FIELD)


def _grid_lines(matrices: InterfaceMatrices) -> Iterator[str]:
    for node, (x, y, z) in zip(matrices.nodes, matrices.positions.tolist(), strict=True):
        yield f"GRID*   {node:16d}{0:16d}{nastran_decimal(x)}{nastran_decimal(y)}"
        yield f"*       {nastran_decimal(z)}{0:16d}"
    for number in matrices.modal:
        yield f"SPOINT  {number:8d}"


def punch_nodes_content(matrices: InterfaceMatrices) -> bytes:
    """Content of a file of the nodes alone: GRID and SPOINT cards, in the basic system."""
    return ("\n".join(_grid_lines(matrices)) + "\n").encode()


def punch_content(matrices: InterfaceMatrices, names: Mapping[str, str]) -> bytes:
    """Content of a punch file with nodes and DMIG matrices.

    Parameters
    ----------
    names : name of each matrix in the file, by "stiffness" and "mass"
    """
    lines = list(_grid_lines(matrices))
    labels = matrices.labels
    for key, name in names.items():
        matrix = getattr(matrices, key)
        lines.append(f"DMIG    {name:<8}{0:8d}{SYMMETRIC:8d}{2:8d}{0:8d}{'':24}{matrices.size:8d}")
        for column, (node, component) in enumerate(labels):
            rows = column + np.flatnonzero(matrix[column:, column])
            if not len(rows):
                continue
            lines.append(f"DMIG*   {name:<16}{node:16d}{component:16d}")
            for row in rows:
                other, with_component = labels[row]
                lines.append(f"*       {other:16d}{with_component:16d}{nastran_real(matrix[row, column])}")
    return ("\n".join(lines) + "\n").encode()
