"""Flank topography: material removed over a grid of radii and axial positions, as a gear measuring machine gives it.

File. Comma-separated text. The first row is a free heading such as ``radius_mm`` and then the axial positions in mm,
from the middle of the face width, rising. Each further row is a radius in mm, rising, and then the material removed
along the flank normal in um, one value for each axial position; material that stands proud is negative. Empty rows and
rows that begin with ``#`` are skipped::

    radius_mm, -10.0,  0.0, 10.0
    71.5,        4.0,  3.0,  5.0
    75.0,        1.0,  0.0,  1.5
    78.0,        6.0,  5.5,  7.0
"""

from __future__ import annotations

import csv
import itertools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import Displayed, value_range


@dataclass(frozen=True)
class FlankTopography(Displayed):
    """Material removed over a grid, linear between its points in roll length and axial position.

    Beyond the grid the values of its edge go on.

    Raises
    ------
    GeometryError
        If the grid does not rise, is not full, or holds values that are not finite.

    Examples
    --------
    >>> gear = Gear(name="pinion", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    >>> topography = FlankTopography((72e-3, 78e-3), (-0.01, 0.01), ((0.0, 4e-6), (0.0, 4e-6)))
    >>> print(np.round(1e6 * topography.gap(gear, np.array(75e-3), np.array([-0.02, 0.0, 0.01])), 6))
    [0. 2. 4.]
    """

    radius: tuple[float, ...]
    axial: tuple[float, ...]
    """Rising, two values or more, m; axial positions from the middle of the face width."""
    removed: tuple[tuple[float, ...], ...]
    """Along the flank normal, m, a row for each radius."""

    def __post_init__(self) -> None:
        """Refuse grids that are none."""
        for name, values in (("radius", self.radius), ("axial", self.axial)):
            if len(values) < 2 or not all(b > a for a, b in itertools.pairwise(values)):
                raise GeometryError(f"topography: {name} must hold two rising values or more, m, not {list(values)}")
        if [len(row) for row in self.removed] != [len(self.axial)] * len(self.radius):
            raise GeometryError(
                f"topography: {len(self.radius)} rows of {len(self.axial)} values of removed material are needed"
            )
        if not all(math.isfinite(value) for row in (self.radius, self.axial, *self.removed) for value in row):
            raise GeometryError("topography: all values must be finite numbers")

    @classmethod
    def from_csv(cls, path: str | Path) -> FlankTopography:
        """Read a topography from a file; its form stands at the head of this module.

        Raises
        ------
        GeometryError
            If the file cannot be read or holds something else; with file, line and value.
        """
        path = Path(path)
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise GeometryError(f"{path}: cannot be read as a topography ({error})") from None
        rows = [
            (line, cells)
            for line, cells in enumerate(csv.reader(text.splitlines()), start=1)
            if any(cell.strip() for cell in cells) and not cells[0].lstrip().startswith("#")
        ]
        if len(rows) < 3 or len(rows[0][1]) < 3:
            raise GeometryError(
                f"{path}: a topography needs a row of two axial positions or more, and two rows of radii or more"
            )
        heading, cells = rows[0]
        axial = [_number(path, heading, cell) for cell in cells[1:]]
        _check_rising(path, heading, "axial position", axial)
        radius: list[float] = []
        removed = []
        for line, cells in rows[1:]:
            if len(cells) != len(axial) + 1:
                raise GeometryError(
                    f"{path}: line {line}: {len(cells)} values; a radius and {len(axial)} amounts are needed"
                )
            radius.append(_number(path, line, cells[0]))
            _check_rising(path, line, "radius", radius)
            removed.append(tuple(1e-6 * _number(path, line, cell) for cell in cells[1:]))
        return cls(tuple(1e-3 * r for r in radius), tuple(1e-3 * z for z in axial), tuple(removed))

    def mirrored(self) -> FlankTopography:
        """Return the topography with the ends of the face exchanged."""
        return FlankTopography(
            self.radius, tuple(-z for z in reversed(self.axial)), tuple(row[::-1] for row in self.removed)
        )

    def gap(self, gear: Gear, radius: Floats, z: Floats) -> Floats:
        """Material removed at points of the flank, m; `radius` and `z` (m) broadcast against each other.

        Raises
        ------
        GeometryError
            If no radius of the grid lies on the gear's involute.
        """
        along, across = np.broadcast_arrays(_roll_length(gear, radius), z)
        nodes = _roll_length(gear, np.array(self.radius))
        if not nodes[-1] > 0.0:
            raise GeometryError(
                f"gear '{gear.name}': topography: its radii end at {1e3 * self.radius[-1]:.4f} mm, inside the "
                f"base circle of {1e3 * gear.base_radius:.4f} mm, where no involute is"
            )
        i, s = _interval(nodes, along)
        j, t = _interval(np.array(self.axial), across)
        values = np.array(self.removed)
        low = (1.0 - t) * values[i, j] + t * values[i, j + 1]
        high = (1.0 - t) * values[i + 1, j] + t * values[i + 1, j + 1]
        return np.asarray((1.0 - s) * low + s * high, dtype=np.float64)

    def _line(self) -> str:
        radii = value_range(self.radius, "mm", 1e3)
        removed = value_range(self.removed, "um", 1e6)
        return f": {len(self.radius)} x {len(self.axial)} points, radius {radii}, {removed} removed"


def _number(path: Path, line: int, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise GeometryError(f"{path}: line {line}: {cell.strip()!r} must be a finite number")
    return value


def _check_rising(path: Path, line: int, what: str, values: list[float]) -> None:
    for before, after in itertools.pairwise(values):
        if not after > before:
            raise GeometryError(f"{path}: line {line}: {what} {after:g} mm must be above {before:g} mm")


def _roll_length(gear: Gear, radius: Floats) -> Floats:
    return np.sqrt(np.maximum(np.asarray(radius) ** 2 - gear.base_radius**2, 0.0))


def _interval(nodes: Floats, at: Floats) -> tuple[Integers, Floats]:
    """Interval of `nodes` that holds each value, and the part of it that lies below the value."""
    within = np.clip(at, nodes[0], nodes[-1])
    interval = np.clip(np.searchsorted(nodes, within, side="right") - 1, 0, len(nodes) - 2)
    return interval, (within - nodes[interval]) / (nodes[interval + 1] - nodes[interval])
