"""Rows of rollers and of balls, from which all rolling bearings are composed.

Frame: origin at the middle of the bearing, z along its axis; coordinates
``(u_x, u_y, u_z, theta_x, theta_y, theta_z)`` of the inner ring relative to the outer ring, SI units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from fe_ste.tools.arrays import Floats

LINE_CONTACT_CONSTANT = 35948.0e6
"""Load-deflection constant of steel line contact, roller against both raceways, N/m^2 in SI:
35948 N/mm^(10/9) mm^(-8/9), where the exponents of the length add up to two (ISO/TS 16281)."""
LAMINAE = 240
"""Slices per roller. ISO/TS 16281 asks for at least 30, which is enough for loads. The slope of a contact sets in
almost as a step at its end: 30 slices of a profiled roller leave up to 2 % (under light loads 10 %) in the tilt
stiffness, 240 leave 0.5 %."""
STEEL_MODULUS = 206e9 / (1.0 - 0.3**2)
"""Young's modulus over 1 - nu^2 of bearing steel, Pa (ISO/TS 16281 and its line contact constant)."""
RIB_ANGLE = math.radians(89.9)
"""Contact angle of the ribs of cylindrical rollers."""
RIB_APPROACH = 5e-8
"""Approach (m) of ribs and rollers in the unloaded bearing: they touch, and hold a shaft without axial load in place by
some newtons for each roller."""
LEAST_ELEMENTS = 3
"""Fewer balls or rollers than these hold nothing in all directions."""


class BearingError(ValueError):
    """The bearing cannot exist, or cannot carry the load it is given."""


@dataclass(frozen=True, kw_only=True)
class RollingRow:
    """Common base of rows of rollers and of balls."""

    element_diameter: float
    pitch_diameter: float
    """Diameter of a ball, or mean diameter of a roller, and of the circle of their middles, m."""
    element_count: int
    """Number of rolling elements."""
    contact_angle: float = 0.0
    """Angle between the contact normal and the radial plane, rad, signed: positive where the row holds an inner ring
    that is pushed towards +z. Zero for cylindrical rollers."""
    axial_position: float = 0.0
    """Middle of the elements in the frame of the bearing, m."""
    radial_clearance: float = 0.0
    """Diametral clearance of the mounted row in the radial plane, m. Negative: preload."""
    aligning: bool = False
    """Whether the outer raceway is a sphere, in which no element tilts: tilting rings about its centre loads
    nothing."""
    sphere_centre: float = 0.0
    """Axial position of that centre, m: in the middle of radial bearings, outside thrust bearings."""

    def __post_init__(self) -> None:
        """Refuse what cannot be built."""
        for key in ("element_diameter", "pitch_diameter"):
            if not getattr(self, key) > 0.0:
                raise BearingError(f"row: {key} = {getattr(self, key)!r} must be positive")
        if self.element_count < LEAST_ELEMENTS:
            raise BearingError(f"row: element_count = {self.element_count} must be at least {LEAST_ELEMENTS}")
        if not abs(self.contact_angle) < math.pi / 2:
            raise BearingError(f"row: contact_angle = {self.contact_angle} rad must lie within +-pi/2")
        # Neighbours on the pitch circle are a chord apart.
        chord = self.pitch_diameter * math.sin(math.pi / self.element_count)
        if self.element_diameter > chord:
            raise BearingError(
                f"row: {self.element_count} rolling elements of {1e3 * self.element_diameter:.1f} mm "
                f"do not fit on a pitch circle of {1e3 * self.pitch_diameter:.1f} mm"
            )

    @property
    def diameter_ratio(self) -> float:
        """Diameter of the elements, seen in the radial plane, over that of the pitch circle: gamma of ISO 281."""
        return self.element_diameter * math.cos(self.contact_angle) / self.pitch_diameter


@dataclass(frozen=True, kw_only=True)
class RollerRow(RollingRow):
    """One row of rollers."""

    effective_length: float
    """Effective contact length, m."""
    profile_factor: float = 0.0
    """Logarithmic profile over roller diameter; 0 for a straight roller."""
    straight_share: float = 0.0
    """Share of the length, about the middle, that the logarithmic profile leaves straight: long rollers."""
    profile_table: tuple[tuple[float, float], ...] | None = None
    """(share, drop) instead: the gap (m) between roller and raceway at shares, 0 to 1, of half the length, linear
    between."""
    crown_curvature: float = 0.0
    """Curvature of the roller's outline less that of the raceway's, 1/m: spherical rollers."""
    laminae: int = LAMINAE
    """Slices of equal length per roller; ISO/TS 16281 asks for at least 30."""
    rib: bool = False
    """Whether these are no raceway but the ribs that the ends of its rollers touch: see `rib_row`."""

    def __post_init__(self) -> None:
        """Refuse what cannot be built."""
        super().__post_init__()
        if not self.effective_length > 0.0:
            raise BearingError(f"roller row: effective_length = {self.effective_length!r} must be positive")
        if self.laminae < 1:
            raise BearingError(f"roller row: laminae = {self.laminae} must be at least 1")
        if self.profile_factor < 0.0:
            raise BearingError(f"roller row: profile_factor = {self.profile_factor} must not be negative")
        if not 0.0 <= self.straight_share < 1.0:
            raise BearingError(f"roller row: straight_share = {self.straight_share} must lie between 0 and 1")

    @property
    def contact_constant(self) -> float:
        """``c_L`` of a whole roller, N/m^(10/9)."""
        return LINE_CONTACT_CONSTANT * float(self.effective_length ** (8.0 / 9.0))

    def drop(self, along: Floats) -> Floats:
        """Gap (m) between roller and one raceway at places (m) along the roller, from its middle; even in them."""
        share = np.abs(2.0 * along / self.effective_length)
        drop: Floats = 0.5 * self.crown_curvature * along**2
        if self.profile_table is not None:
            shares, drops = np.array(self.profile_table).T
            drop = drop + np.interp(share, shares, drops)
        elif self.profile_factor > 0.0:
            curved = np.maximum(share - self.straight_share, 0.0) / (1.0 - self.straight_share)
            drop = drop - self.profile_factor * self.element_diameter * np.log(1.0 - curved**2)
        return drop


@dataclass(frozen=True, kw_only=True)
class BallRow(RollingRow):
    """One row of balls."""

    inner_conformity: float = 0.52
    outer_conformity: float = 0.52
    """Radius of each raceway's groove over the ball's diameter; above 0.5."""

    def __post_init__(self) -> None:
        """Refuse what cannot be built."""
        super().__post_init__()
        for key in ("inner_conformity", "outer_conformity"):
            if not getattr(self, key) > 0.5:
                raise BearingError(f"ball row: {key} = {getattr(self, key)!r} must be above 0.5")

    @property
    def groove_distance(self) -> float:
        """Distance of the centres of the grooves of both rings while the ball touches them without load, m."""
        return (self.inner_conformity + self.outer_conformity - 1.0) * self.element_diameter


class RollingBearing(Protocol):
    """Anything made of rows of rolling elements between one inner and one outer ring body."""

    @property
    def rows(self) -> tuple[RollingRow, ...]:
        """Rows in the frame of the bearing."""
        ...


@dataclass(frozen=True)
class BearingOfRows:
    """A bearing that is given by its rows."""

    rows: tuple[RollingRow, ...]
    """In the frame of the bearing."""


Row = TypeVar("Row", bound=RollingRow)


def moved(row: Row, contact_angle: float, axial_position: float) -> Row:
    """Give a row another contact angle (rad) and another place (m)."""
    return replace(row, contact_angle=contact_angle, axial_position=axial_position)


def rib_row(row: RollerRow, towards: int, contact_length: float) -> RollerRow:
    """Ribs of a row of cylindrical rollers as a row of their own, which holds the inner ring along the axis.

    A roller that is pushed along the axis is held between a rib of the one ring and the opposite rib of the other: two
    contacts, which are taken as those of ISO/TS 16281 with a short length. Where they press, how the roller tilts under
    them, their friction and their own life are left out; a tilt of the rings loads no rib.

    Parameters
    ----------
    towards : {1, -1}
        Direction along z in which the inner ring is pushed when these ribs hold it.
    contact_length : of the line contacts that stand for both ribs, m

    Examples
    --------
    >>> row = RollerRow(element_diameter=0.03, pitch_diameter=0.225, element_count=20, effective_length=0.06)
    >>> rib = rib_row(row, -1, 0.006)
    >>> rib.rib, rib.contact_angle < -1.56
    (True, True)
    """
    return RollerRow(
        element_diameter=row.element_diameter,
        pitch_diameter=row.pitch_diameter,
        element_count=row.element_count,
        contact_angle=math.copysign(RIB_ANGLE, towards),
        axial_position=row.axial_position,
        radial_clearance=-2.0 * RIB_APPROACH / math.cos(RIB_ANGLE),
        aligning=True,
        effective_length=contact_length,
        rib=True,
    )


def is_rib(row: RollingRow) -> bool:
    """Return whether a row represents ribs."""
    return isinstance(row, RollerRow) and row.rib


def raceway_rows(rows: Sequence[RollingRow]) -> tuple[RollingRow, ...]:
    """Rows without those that represent ribs: the rows with a rating and with rolling contact fatigue."""
    return tuple(row for row in rows if not is_rib(row))


def pair_rows(row: Row, arrangement: str, row_distance: float, axial_preload: float = 0.0) -> tuple[Row, Row]:
    """Two rows like the given one.

    Parameters
    ----------
    row : RollingRow
        One of them; in tandem the sign of its contact angle counts.
    arrangement : {"X", "O", "tandem"}
        X (face to face): pressure lines meet the axis towards the middle of the pair. O (back to back): away
        from it, stiff against tilting. Tandem: both rows take the same direction; also right for cylindrical
        rollers, where the three are the same.
    row_distance : distance of the middles of the rows, m
    axial_preload : approach of the two rows along the axis against line-to-line contact, m; negative: axial clearance

    Returns
    -------
    (RollingRow, RollingRow) the row at -z, then the row at +z

    Raises
    ------
    exugear.system.bearings.rolling.rows.BearingError
        The arrangement or the distance does not exist, or the rows cannot be preloaded along the axis.
    """
    if arrangement not in ("X", "O", "tandem"):
        raise BearingError(f"bearing pair: arrangement = {arrangement!r} is not 'X', 'O' or 'tandem'")
    if row_distance < 0.0:
        raise BearingError(f"bearing pair: row_distance = {row_distance} m must not be negative")
    if axial_preload != 0.0 and row.contact_angle == 0.0:
        raise BearingError("bearing pair: axial_preload needs rows with a contact angle")
    angle = abs(row.contact_angle)
    tandem = (row.contact_angle, row.contact_angle)
    lower, upper = {"X": (-angle, angle), "O": (angle, -angle), "tandem": tandem}[arrangement]
    half = 0.5 * row_distance
    # Both rows share an axial approach by halves.
    return (
        _approached(moved(row, lower, -half), 0.5 * axial_preload),
        _approached(moved(row, upper, half), 0.5 * axial_preload),
    )


def _approached(row: Row, approach: float) -> Row:
    """Push the rings of a row together along the axis (m), as another clearance, and with balls another angle."""
    if approach == 0.0:
        return row
    angle = abs(row.contact_angle)
    if not isinstance(row, BallRow):
        return replace(row, radial_clearance=row.radial_clearance - 2.0 * approach * math.tan(angle))
    # The centres of the grooves are then at another angle to each other; the rest is radial.
    sine = math.sin(angle) + approach / row.groove_distance
    if not 0.0 <= sine < 1.0:
        raise BearingError(
            f"bearing pair: axial_preload = {2e6 * approach:g} µm moves the grooves of balls of "
            f"{1e3 * row.element_diameter:g} mm past each other; it must be smaller"
        )
    turned = math.asin(sine)
    clearance = row.radial_clearance + 2.0 * row.groove_distance * (math.cos(turned) - math.cos(angle))
    return replace(row, contact_angle=math.copysign(turned, row.contact_angle), radial_clearance=clearance)
