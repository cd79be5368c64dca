"""Flank modifications: material removed from the involute flank, as a gap over the flank.

Every modification is a gap along the flank normal, zero or above (but for a topography as measured), so that the gaps
of both gears and of several modifications add up. Heights are measured in roll length (ISO 21771), because a relief
that is linear in roll length is linear along the path of contact.

File. Comma-separated text. The first row is a free heading such as ``radius_mm`` and then the axial positions in mm,
from the middle of the face width, rising. Each further row is a radius in mm, rising, and then the material removed
along the flank normal in um, one value for each axial position; protruding material is negative. Empty rows and rows
that begin with ``#`` are skipped::

    radius_mm, -10.0,  0.0, 10.0
    71.5,        4.0,  3.0,  5.0
    75.0,        1.0,  0.0,  1.5
    78.0,        6.0,  5.5,  7.0

They are too small to change the compliance, and add to the gap of the conjugate flanks: a pitch deviation to that of
one tooth pair, a displaced axis to that of all pairs alike. Gaps here are lengths on the transverse line of action, as
transmission errors are, positive where the loaded flanks of gear 1 and gear 2 are further apart.

To first order in a gap, the transmission error under constant load grows by the gap times the part that its pair
takes of a little more load (`tangent_load_share` of a table), and under constant rotation the strain energy falls by
the gap times the load the pair carries (`load_share`). The two shares are the same only where sharing does not change
with the load.
"""

from __future__ import annotations

import csv
import itertools
import math
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin, TitledRows, value_range


@dataclass(frozen=True)
class FlankTopography(ReprMixin):
    """Material removed over a grid, linear between its points in roll length and axial position.

    Outside the grid the values at its edge apply.

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
        """Refuse invalid grids."""
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
        """Read a topography from a file; the docstring of this module gives its format.

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
        removed = value_range(self.removed, "µm", 1e6)
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


class ReliefShape(StrEnum):
    """How a relief grows from its start."""

    LINEAR = "linear"
    PARABOLIC = "parabolic"


@dataclass(frozen=True)
class Relief:
    """Tip or root relief.

    Raises
    ------
    GeometryError
        If the amount is negative or not finite, or the shape unknown.
    """

    amount: float
    """Material removed at the tip, or at the root form diameter for a root relief, m."""
    start_radius: float
    """Radius at which the relief begins, m."""
    shape: ReliefShape = ReliefShape.LINEAR
    """Growth from the start, in roll length; parabolic begins without a kink."""

    def __post_init__(self) -> None:
        """Refuse amounts and shapes that make no sense."""
        _check_removal("relief amount", self.amount)
        if self.shape not in tuple(ReliefShape):
            known = ", ".join(f"'{shape}'" for shape in ReliefShape)
            raise GeometryError(f"relief shape = {self.shape!r} must be one of {known}")


@dataclass(frozen=True, kw_only=True)
class FlankModification(ReprMixin):
    """Modification of both flanks of every tooth of a gear.

    Raises
    ------
    GeometryError
        If an amount is not finite, or is negative where only removal makes sense.

    Examples
    --------
    >>> gear = Gear(name="pinion", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    >>> modification = FlankModification(lead_crowning=8e-6, helix_slope=4e-6)
    >>> ends = np.array([-10e-3, 0.0, 10e-3])
    >>> print(np.round(1e6 * modification.gap(gear, np.array(75e-3), ends), 6))
    [ 8.  2. 12.]
    """

    tip_relief: Relief | None = None
    root_relief: Relief | None = None
    """Reliefs towards the tip and towards the root form diameter."""
    profile_crowning: float = 0.0
    """Parabola over the roll length from form to tip circle, zero in its middle, m at either end."""
    lead_crowning: float = 0.0
    """Parabola over the face width, zero at mid-face, m at either end."""
    profile_slope: float = 0.0
    """Linear over the roll length; m removed at the tip, or at the root form diameter if negative."""
    helix_slope: float = 0.0
    """Linear over the face width; m removed at the +z end, or at the -z end if negative."""
    twist: float = 0.0
    """Helix slope that reverses along the profile: m removed at the tip of the +z end and at the form diameter of the
    -z end, nothing at the other two corners, half at mid-flank; the other way round if negative."""
    topography: FlankTopography | None = None
    """A measured or designed grid, which may also contain protruding material."""

    def __post_init__(self) -> None:
        """Refuse amounts that make no sense."""
        _check_removal("profile_crowning", self.profile_crowning)
        _check_removal("lead_crowning", self.lead_crowning)
        _check_removal("profile_slope", abs(self.profile_slope))
        _check_removal("helix_slope", abs(self.helix_slope))
        _check_removal("twist", abs(self.twist))

    def mirrored(self) -> FlankModification:
        """Return the modification with the ends of the face exchanged, as the other flank's table needs it."""
        topography = self.topography.mirrored() if self.topography else None
        return replace(self, helix_slope=-self.helix_slope, twist=-self.twist, topography=topography)

    def gap(self, gear: Gear, radius: Floats, z: Floats) -> Floats:
        """Material removed at points of the flank.

        Parameters
        ----------
        gear : the modified gear
        radius, z
            Radius and axial position of the points, m, the middle of the face width at zero; broadcast
            against each other.

        Returns
        -------
        gap along the flank normal, m; divide by cos(beta_b) for the transverse line of action

        Raises
        ------
        GeometryError
            If a relief starts outside the involute between form and tip circle.
        """
        roll_length = np.sqrt(np.maximum(radius**2 - gear.base_radius**2, 0.0))
        form = gear.root_form_roll_length
        tip = gear.tip_form_roll_length
        from_form = (roll_length - form) / (tip - form)
        along_face = z / gear.face_width
        gap = (
            self.profile_crowning * (2.0 * from_form - 1.0) ** 2
            + _slope(self.profile_slope, from_form)
            + self.lead_crowning * (2.0 * along_face) ** 2
            + _slope(self.helix_slope, along_face + 0.5)
            + 0.5 * (abs(self.twist) + self.twist * (2.0 * from_form - 1.0) * 2.0 * along_face)
        )
        if self.tip_relief is not None:
            gap = gap + _relief_gap(gear, "tip_relief", self.tip_relief, roll_length, tip)
        if self.root_relief is not None:
            gap = gap + _relief_gap(gear, "root_relief", self.root_relief, roll_length, form)
        if self.topography is not None:
            gap = gap + self.topography.gap(gear, radius, z)
        return gap

    def _line(self) -> str:
        amounts = ", ".join(f"{kind} {amount}" for kind, amount in self._amounts().items())
        return f": {amounts or 'none'}"

    def _table(self) -> TitledRows:
        return "flank modification", self._amounts() or {"material removed": "none"}

    def _amounts(self) -> dict[str, str]:
        """Kind of modification -> amount, of those that there are."""
        names = ("profile_crowning", "lead_crowning", "profile_slope", "helix_slope", "twist")
        amounts = {"tip_relief": self.tip_relief, "root_relief": self.root_relief}
        removed = {name: relief.amount for name, relief in amounts.items() if relief}
        removed |= {name: getattr(self, name) for name in names if getattr(self, name)}
        shown = {name.replace("_", " "): value_range(amount, "µm", 1e6) for name, amount in removed.items()}
        return shown | ({"topography": "by a grid"} if self.topography else {})


def _check_removal(key: str, amount: float) -> None:
    if not math.isfinite(amount) or amount < 0.0:
        raise GeometryError(f"{key} = {amount!r} m must be finite and not negative: it removes material")


def _relief_gap(gear: Gear, key: str, relief: Relief, roll_length: Floats, end: float) -> Floats:
    """Gap of a relief that reaches its amount at the roll length `end`."""
    low, high = sorted((gear.root_form_radius, gear.tip_form_radius))
    if not low < relief.start_radius < high:
        raise GeometryError(
            f"gear '{gear.name}': {key}.start_radius = {1e3 * relief.start_radius:.4f} mm must lie on the "
            f"involute, between {1e3 * low:.4f} mm and {1e3 * high:.4f} mm"
        )
    start = math.sqrt(relief.start_radius**2 - gear.base_radius**2)
    reached = np.maximum((roll_length - start) / (end - start), 0.0)
    exponent = 1 if relief.shape == ReliefShape.LINEAR else 2
    return np.asarray(relief.amount * reached**exponent, dtype=np.float64)


def _slope(amount: float, position: Floats) -> Floats:
    """Linear gap over positions 0 to 1 that is zero at one end: at 0, or at 1 for a negative amount."""
    within = np.clip(position, 0.0, 1.0)
    return amount * within if amount >= 0.0 else -amount * (1.0 - within)


def radius_at_roll_length_from_tip(gear: Gear, roll_length: float) -> float:
    """Radius on the flank at a distance from the tip in roll length, to start a relief of given length.

    Parameters
    ----------
    gear : the gear
    roll_length : roll length from the tip circle into the flank, m

    Returns
    -------
    radius, m

    Raises
    ------
    GeometryError
        If there is no involute so far from the end.

    Examples
    --------
    >>> gear = Gear(name="pinion", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    >>> round(1e3 * radius_at_roll_length_from_tip(gear, 4e-3), 4)
    76.3716
    """
    return _radius_at(gear, gear.tip_form_roll_length - gear.outward * roll_length)


def radius_at_roll_length_from_root(gear: Gear, roll_length: float) -> float:
    """Return the radius on the flank at a roll length from the root form diameter, to start a root relief.

    Parameters
    ----------
    gear : the gear
    roll_length : roll length from the root form diameter into the flank, m

    Returns
    -------
    radius, m

    Raises
    ------
    GeometryError
        If there is no involute so far from the end.

    Examples
    --------
    >>> gear = Gear(name="pinion", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    >>> radius_at_roll_length_from_root(gear, 0.0) == gear.form_radius
    True
    """
    return _radius_at(gear, gear.root_form_roll_length + gear.outward * roll_length)


def _radius_at(gear: Gear, roll_length: float) -> float:
    if roll_length < 0.0:
        raise GeometryError(f"gear '{gear.name}': a roll length of {1e3 * roll_length:.4g} mm lies off the involute")
    return math.hypot(gear.base_radius, roll_length)
