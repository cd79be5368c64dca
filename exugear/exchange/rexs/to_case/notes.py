"""Values of the gearbox file with their sources, their notation in TOML, and the notes of an import."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from exugear.exchange.rexs.mapping import Row
from exugear.exchange.rexs.tree import Component, Errors, Model, RexsError
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin

ASSUMED = "A"
DERIVED = "D"
COMMENT_COLUMN = 44
"""Column in which comments begin after short values."""


@dataclass(frozen=True)
class Entry:
    """A value of the gearbox file with its source."""

    value: Any
    """Value in a type that TOML supports."""
    source: str = ""
    """Component and attribute of the value; for a derived or assumed value the reason."""
    kind: str = ""
    """Empty for a value that was read, else `DERIVED` or `ASSUMED`."""

    @property
    def comment(self) -> str:
        """Comment after the value."""
        return f"{self.kind}   {self.source}" if self.kind else self.source


def read(value: Any, source: str) -> Entry:
    """Value that was read from the REXS file."""
    return Entry(value, source)


def derived(value: Any, source: str) -> Entry:
    """Value that was derived from values of the REXS file."""
    return Entry(value, source, DERIVED)


def assumed(value: Any, source: str) -> Entry:
    """Value that is assumed because the file does not specify it."""
    return Entry(value, source, ASSUMED)


def entries_of(
    rows: Sequence[Row],
    *parts: Component | None,
    zeros: bool = False,
    limits: tuple[float, float] = (-math.inf, math.inf),
) -> dict[str, Entry]:
    """Entries of those attributes that components have, by key; the first row and the first component have priority.

    Parameters
    ----------
    zeros : whether zero is a value, too; it otherwise counts as missing
    limits : range outside of which a value is ignored
    """
    entries: dict[str, Entry] = {}
    for row in rows:
        if row.key in entries:
            continue
        found = (part.quantity(row.attribute) for part in parts if part is not None)
        value = next((row.factor * value for value in found if value or (zeros and value is not None)), None)
        if value is not None and limits[0] <= value <= limits[1]:
            entries[row.key] = read(tidy(value), row.attribute)
    return entries


@dataclass(frozen=True)
class Rules:
    """Rules that decide between contradictory values of a file."""

    shifts: Literal["file", "centre-distance"] = "file"
    """Profile shifts that contradict the centre distance: refused, or replaced by those that it requires."""
    distances: Literal["agreeing", "positions", "file"] = "agreeing"
    """Centre distances that contradict the positions of the gears: use that with which the profile shifts agree, that
    of the positions, or that of ``center_distance``, to which axes are moved.
    """


@dataclass
class Notes:
    """Notes collected during an import."""

    rules: Rules = Rules()
    errors: Errors = field(default_factory=Errors)
    """Errors because of which the file cannot be imported."""
    changed: list[str] = field(default_factory=list)
    """Values of the file that were replaced, and important assumptions."""
    checked: list[str] = field(default_factory=list)
    """Comparisons of values that the file contains twice."""
    lost: list[str] = field(default_factory=list)
    """Omitted content that loads, moves or supports the gearbox, which is reported first."""
    ignored: list[str] = field(default_factory=list)
    """Other content of the file that the gearbox file does not have."""


def tidy(value: float) -> float:
    """Return a number without round-off digits; never minus zero.

    Examples
    --------
    >>> tidy(16.799999999999997), tidy(-0.0)
    (16.8, 0.0)
    """
    return float(f"{value:.12g}") + 0.0


@dataclass
class Block:
    """Table of the gearbox file with its entries and the tables inside it."""

    comment: str = ""
    """Comment after its heading: the component from which it originates."""
    entries: dict[str, Entry] = field(default_factory=dict)
    blocks: dict[str, Block] = field(default_factory=dict)
    number: int = 0
    """Number of the component; 0 if it is not needed."""


def toml_text(head: Sequence[str], top: Mapping[str, Entry], groups: Sequence[tuple[str, Mapping[str, Block]]]) -> str:
    """Text of the gearbox file with comments.

    Parameters
    ----------
    head : lines of comment before everything else
    top : keys outside of tables
    groups : sequence of (str, mapping of str to Block)
        Heading and tables, by their dotted name.
    """
    lines = [f"# {line}".rstrip() for line in head]
    lines += ["", *(_line(key, entry) for key, entry in top.items())]
    for heading, blocks in groups:
        if blocks:
            lines += ["", *([f"# {'-' * 20} {heading}"] if heading else [])]
        for name, block in blocks.items():
            lines += _table(name, block)
    return "\n".join(lines) + "\n"


def _table(name: str, block: Block) -> Iterator[str]:
    yield ""
    yield _with_comment(f"[{name}]", block.comment)
    yield from (_line(key, entry) for key, entry in block.entries.items())
    for key, inner in block.blocks.items():
        yield from list(_table(f"{name}.{key}", inner))[1:]


def _line(key: str, entry: Entry) -> str:
    if isinstance(entry.value, list) and any(isinstance(row, Mapping) for row in entry.value):
        rows = "".join(f"    {toml_value(row)},\n" for row in entry.value)
        return f"{_with_comment(f'{key} = [', entry.comment)}\n{rows}]"
    return _with_comment(f"{key} = {toml_value(entry.value)}", entry.comment)


def _with_comment(text: str, comment: str) -> str:
    return f"{text:<{COMMENT_COLUMN - 1}} # {comment.strip()}" if comment.strip() else text


def toml_value(value: Any) -> str:
    """Return a value in TOML notation.

    Examples
    --------
    >>> toml_value({"sun": 1.0, "names": ["a", True]})
    '{ sun = 1.0, names = ["a", true] }'
    """
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml_value(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


# Positions and directions of components in the axes of the gearbox file, z along the shafts

PARALLEL = 1e-6
"""Largest sine of the angle between axes that count as parallel."""
LONGEST_CHAIN = 100
"""Maximum number of components whose positions refer to each other in a chain."""
TURNING = ("shaft", "cylindrical_gear", "ring_gear", "side_plate")
"""Types of components whose u axis is an axis of rotation."""


class ComponentPositions(ReprMixin):
    """Positions (mm) and directions of components.

    REXS positions a component in the frame (u, v, w) of another, mostly of the gear unit. The axes x, y, z are the gear
    unit's v, w, u if the shafts are parallel to its u. Otherwise they are rotated so that z is along the shafts.

    Raises
    ------
    RexsError
        Axes are not parallel or vectors do not have three numbers; all such errors are reported together.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._moved: dict[int, tuple[float, float]] = {}
        self._frames: dict[int, tuple[Floats, Floats]] = {}
        # Some programs lost all vectors when writing JSON.
        keys = ("support_vector", "u_axis_vector", "w_axis_vector")
        lost = [part for part in model.components.values() if any(part.has_lost_vector(key) for key in keys)]
        if lost:
            more = f" and {len(lost) - 3} more" if len(lost) > 3 else ""
            raise RexsError(
                f"positions are not three numbers for {', '.join(map(str, lost[:3]))}{more}: arrays were lost in the "
                "exporting program; export it again"
            )
        errors = Errors()
        directions: dict[Component, Floats] = {}
        for part in model.components_of_type(*TURNING):
            with errors.gathered():
                directions[part] = self._frame(part)[1][:, 0]
        errors.tell()
        # A file without a gear unit has the axes of its first part.
        first = [*self._model.components_of_type("gear_unit"), *list(directions)][:1]
        self._axes = _axes(list(directions.values()), self._frame(first[0])[1] if first else np.eye(3))
        skew = [part for part, direction in directions.items() if abs(direction @ self._axes[2]) < 1.0 - PARALLEL]
        if skew:
            names = ", ".join(str(part) for part in skew[:3])
            raise RexsError(f"the axis of {names} is not parallel to the others; only parallel axes can be imported")

    def _line(self) -> str:
        return f" along {np.round(self._axes[2], 3).tolist()}"

    def position(self, part: Component) -> tuple[float, float, float]:
        """Origin of a component, mm: the left end of a shaft or plate, the middle of all others.

        Raises
        ------
        RexsError
            The component has no position.
        """
        if not part.given("support_vector"):
            raise RexsError(f"{part}: support_vector is missing, so its position is unknown")
        x, y, z = (self._axes @ self._frame(part)[0]).tolist()
        aside, up = self._moved.get(part.number, (0.0, 0.0))
        return tidy(round(x + aside, 9)), tidy(round(y + up, 9)), tidy(round(z, 9))

    def move(self, parts: Iterable[Component], by: tuple[float, float]) -> None:
        """Move components by x and y, mm, if other values of the file have priority."""
        for part in parts:
            self._moved[part.number] = by

    def sense(self, part: Component) -> int:
        """Sense of a component's u axis: 1 along +z, -1 against it."""
        return 1 if self._frame(part)[1][:, 0] @ self._axes[2] > 0.0 else -1

    def axes(self, part: Component) -> Floats:
        """Axes u, v, w of a component as the rows of a (3, 3) array, in the axes of the gearbox file."""
        return np.asarray((self._axes @ self._frame(part)[1]).T)

    def turned(self, vector: Floats) -> Floats:
        """Transform a vector from the axes of the gear unit to those of the gearbox file."""
        return np.asarray(self._axes @ vector)

    def _frame(self, part: Component, depth: int = 0) -> tuple[Floats, Floats]:
        """Origin (3) and axes u, v, w as columns (3, 3), in the outermost frame."""
        if part.number in self._frames:
            return self._frames[part.number]
        if depth > LONGEST_CHAIN:
            raise RexsError(f"{part}: its position refers to a circular chain of components")
        origin = np.array(part.vector("support_vector") or (0.0, 0.0, 0.0))
        u = np.array(part.vector("u_axis_vector") or (1.0, 0.0, 0.0))
        w = np.array(part.vector("w_axis_vector") or (0.0, 0.0, 1.0))
        lengths = np.linalg.norm(u), np.linalg.norm(w)
        if min(lengths) < 1e-9 or abs(u @ w) > 1e-6 * lengths[0] * lengths[1]:
            raise RexsError(f"{part}: u_axis_vector and w_axis_vector are not perpendicular")
        u = u / lengths[0]
        w = w / lengths[1]
        axes = np.column_stack([u, np.cross(w, u), w])
        reference = part.whole("reference_component_for_position")
        if reference is not None and reference != part.number:
            if reference not in self._model.components:
                raise RexsError(f"{part}: its position refers to component {reference}, which does not exist")
            base, turned = self._frame(self._model.components[reference], depth + 1)
            origin = base + turned @ origin
            axes = turned @ axes
        self._frames[part.number] = origin, axes
        return origin, axes


def _axes(directions: list[Floats], unit: Floats) -> Floats:
    """Axes x, y, z of the gearbox file as rows: v, w, u of the gear unit, or z along the first shaft and y near w."""
    along = unit[:, 0]
    up = unit[:, 2]
    if directions and abs(directions[0] @ along) < 1.0 - PARALLEL:
        along = directions[0]
    across = up - (up @ along) * along
    if np.linalg.norm(across) < 1e-3:
        least = int(np.argmin(np.abs(along)))
        across = np.eye(3)[least] - along[least] * along
    across = across / np.linalg.norm(across)
    rows = np.array([np.cross(across, along), across, along])
    return np.where(np.abs(rows) < 1e-15, 0.0, rows)
