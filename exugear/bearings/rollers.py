"""Catalogue roller bearings: rows of rollers and their stiffness from boundary dimensions.

What a catalogue does not print is estimated from the boundary dimensions by the usual proportions of the design.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from exugear.bearings.contact import pitch_averaged_tangent
from exugear.bearings.rows import BearingError, RollerBearing, RollerRow
from exugear.model.sections.connections import CatalogueSection
from fe_ste.tools.arrays import Floats

CYLINDRICAL_ROLLER_PROFILE = 0.00035
TAPERED_ROLLER_PROFILE = 0.00045
"""Logarithmic roller profiles of ISO/TS 16281: drop / roller diameter, for `RollerRow.profile_factor`."""


@dataclass(frozen=True, kw_only=True)
class CylindricalRollerBearing:
    """Single-row cylindrical roller bearing from its boundary dimensions.

    What the catalogue does not print is estimated from the boundary dimensions: roller diameter
    ``0.27 (D - d)``, effective length ``0.75 B``, and as many rollers as fit on the pitch circle at a
    pitch of 1.15 roller diameters (with a cage) or 1.01 (full complement).

    Parameters
    ----------
    bore, outside_diameter, width : float
        Boundary dimensions d, D, B, m.
    full_complement : bool
        Without a cage.
    element_diameter, effective_length, element_count : optional
        Replace the estimates where they are known.
    radial_clearance, profile_factor, laminae
        See `RollerRow`.

    Examples
    --------
    >>> bearing = CylindricalRollerBearing(bore=0.160, outside_diameter=0.290, width=0.080)
    >>> bearing.rows[0].element_count
    17
    """

    bore: float
    outside_diameter: float
    width: float
    full_complement: bool = False
    element_diameter: float | None = None
    effective_length: float | None = None
    element_count: int | None = None
    radial_clearance: float = 0.0
    profile_factor: float = 0.0
    laminae: int = 30

    def __post_init__(self) -> None:
        """Check the boundary dimensions and the row that follows from them."""
        _check_boundary_dimensions(self.bore, self.outside_diameter, self.width)
        _ = self.rows

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """The one row, in the middle of the bearing."""
        return (_row_from_catalogue(self, contact_angle=0.0),)


@dataclass(frozen=True, kw_only=True)
class TaperedRollerBearing:
    """Single-row tapered roller bearing from its boundary dimensions.

    The pressure line is taken at the one contact angle that catalogues state (outer raceway); the rib is
    left out. Used alone, the bearing holds an inner ring that is pushed towards +z; turn it by a negative
    `contact_angle` or combine two in a `BearingPair`.

    Parameters
    ----------
    bore, outside_diameter, width : float
        Boundary dimensions d, D, T, m.
    contact_angle : float
        Nominal contact angle, rad, signed as in `RollerRow`.
    full_complement, element_diameter, effective_length, element_count : optional
        As in `CylindricalRollerBearing`.
    radial_clearance, profile_factor, laminae
        As in `CylindricalRollerBearing`.

    Examples
    --------
    >>> bearing = TaperedRollerBearing(
    ...     bore=0.160, outside_diameter=0.240, width=0.051, contact_angle=math.radians(17.0)
    ... )
    >>> round(1e3 * bearing.rows[0].element_diameter, 1)
    21.6
    """

    bore: float
    outside_diameter: float
    width: float
    contact_angle: float
    full_complement: bool = False
    element_diameter: float | None = None
    effective_length: float | None = None
    element_count: int | None = None
    radial_clearance: float = 0.0
    profile_factor: float = 0.0
    laminae: int = 30

    def __post_init__(self) -> None:
        """Check the boundary dimensions and the row that follows from them."""
        _check_boundary_dimensions(self.bore, self.outside_diameter, self.width)
        if self.contact_angle == 0.0:
            raise BearingError("tapered roller bearing: contact_angle = 0 makes it a cylindrical one")
        _ = self.rows

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """The one row, in the middle of the bearing."""
        return (_row_from_catalogue(self, contact_angle=self.contact_angle),)


@dataclass(frozen=True, kw_only=True)
class BearingPair:
    """Two equal bearings side by side on one shaft and in one housing, as one bearing.

    Parameters
    ----------
    bearing : CylindricalRollerBearing or TaperedRollerBearing
        One of the two.
    arrangement : {"X", "O", "tandem"}
        X (face to face): pressure lines meet the axis towards the middle of the pair. O (back to back): away
        from it, stiff against tilting. Tandem: both rows take the same direction; also right for cylindrical
        rollers, where the three are the same.
    row_distance : float, optional
        Distance of the middles of the rows, m; by default the width of one bearing (mounted face to face).
    axial_preload : float
        Approach of the two rows along the axis against line-to-line contact, m; negative: axial clearance.

    Examples
    --------
    >>> taper = TaperedRollerBearing(
    ...     bore=0.160, outside_diameter=0.240, width=0.051, contact_angle=math.radians(17.0)
    ... )
    >>> pair = BearingPair(bearing=taper, arrangement="X")
    >>> [row.contact_angle > 0.0 for row in pair.rows]
    [False, True]
    """

    bearing: CylindricalRollerBearing | TaperedRollerBearing
    arrangement: Literal["X", "O", "tandem"]
    row_distance: float | None = None
    axial_preload: float = 0.0

    def __post_init__(self) -> None:
        """Refuse distances and arrangements that do not exist."""
        if self.arrangement not in ("X", "O", "tandem"):
            raise BearingError(f"bearing pair: arrangement = {self.arrangement!r} is not 'X', 'O' or 'tandem'")
        if self.row_distance is not None and self.row_distance < 0.0:
            raise BearingError(f"bearing pair: row_distance = {self.row_distance} m must not be negative")
        if self.axial_preload != 0.0 and self.rows[0].contact_angle == 0.0:
            raise BearingError("bearing pair: axial_preload needs rows with a contact angle")

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """The row at -z, then the row at +z."""
        (row,) = self.bearing.rows
        half_distance = 0.5 * (self.bearing.width if self.row_distance is None else self.row_distance)
        angle = abs(row.contact_angle)
        tandem = (row.contact_angle, row.contact_angle)
        angles = {"X": (-angle, angle), "O": (angle, -angle), "tandem": tandem}[self.arrangement]
        # An axial approach of both rows is shared by halves and closes each as a radial clearance does.
        clearance = row.radial_clearance - self.axial_preload * math.tan(angle)
        lower, upper = (
            replace(row, contact_angle=signed, axial_position=position, radial_clearance=clearance)
            for signed, position in zip(angles, (-half_distance, half_distance), strict=True)
        )
        return lower, upper


def _check_boundary_dimensions(bore: float, outside_diameter: float, width: float) -> None:
    if not 0.0 < bore < outside_diameter:
        raise BearingError(f"bearing: bore = {bore} m must lie between 0 and outside_diameter = {outside_diameter} m")
    if not width > 0.0:
        raise BearingError(f"bearing: width = {width} m must be positive")


def _row_from_catalogue(bearing: CylindricalRollerBearing | TaperedRollerBearing, contact_angle: float) -> RollerRow:
    """Fill what the catalogue leaves open with the usual proportions of the design."""
    pitch_diameter = 0.5 * (bearing.bore + bearing.outside_diameter)
    diameter = bearing.element_diameter or 0.27 * (bearing.outside_diameter - bearing.bore)
    pitch_over_diameter = 1.01 if bearing.full_complement else 1.15
    return RollerRow(
        element_diameter=diameter,
        effective_length=bearing.effective_length or 0.75 * bearing.width,
        pitch_diameter=pitch_diameter,
        element_count=bearing.element_count or int(math.pi * pitch_diameter / (pitch_over_diameter * diameter)),
        contact_angle=contact_angle,
        radial_clearance=bearing.radial_clearance,
        profile_factor=bearing.profile_factor,
        laminae=bearing.laminae,
    )


def cylindrical_roller_stiffness(section: CatalogueSection) -> Floats:
    """Stiffness (6, 6) of cylindrical roller bearings at the load that the file states, in the bearing's axes."""
    bearing = CylindricalRollerBearing(
        bore=section.bore_mm * 1e-3,
        outside_diameter=section.outer_diameter_mm * 1e-3,
        width=section.width_mm * 1e-3,
        full_complement=section.full_complement,
        radial_clearance=section.radial_clearance_mm * 1e-3,
    )
    return _loaded_stiffness(section, bearing)


def tapered_roller_stiffness(section: CatalogueSection) -> Floats:
    """Stiffness (6, 6) of tapered roller bearings at the load that the file states, in the bearing's axes."""
    bearing = TaperedRollerBearing(
        bore=section.bore_mm * 1e-3,
        outside_diameter=section.outer_diameter_mm * 1e-3,
        width=section.width_mm * 1e-3,
        contact_angle=math.radians(section.contact_angle_deg),
        radial_clearance=section.radial_clearance_mm * 1e-3,
    )
    return _loaded_stiffness(section, bearing)


def _loaded_stiffness(section: CatalogueSection, bearing: CylindricalRollerBearing | TaperedRollerBearing) -> Floats:
    """Tangent (6, 6) of a bearing, or of two as the file arranges them, under the load that it states."""
    arranged: RollerBearing = bearing
    if section.arrangement != "single":
        distance = None if section.row_distance_mm is None else section.row_distance_mm * 1e-3
        arranged = BearingPair(bearing=bearing, arrangement=section.arrangement, row_distance=distance)
    force = (section.radial_load_kN * 1e3, 0.0, section.axial_load_kN * 1e3)
    return pitch_averaged_tangent(arranged, force)
