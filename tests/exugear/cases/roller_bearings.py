"""Roller bearings from their boundary dimensions, with the usual proportions of their type, single and in pairs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from exugear.system.bearings.rolling.dimensions import PROPORTIONS, ROLLER_LENGTH, element_count, standard_profile
from exugear.system.bearings.rolling.rows import LAMINAE, RollerRow, pair_rows


@dataclass(frozen=True, kw_only=True)
class CylindricalRollerBearing:
    """Single-row cylindrical roller bearing from its boundary dimensions.

    Dimensions missing in the catalogue are estimated from the boundary dimensions: roller diameter ``0.27 (D - d)``,
    effective length ``0.64 B``, and as many rollers as fit on the pitch circle at a pitch of 1.15 roller diameters
    (with a cage) or 1.01 (full complement); see `exugear.system.bearings.rolling.dimensions`.
    """

    bore: float
    outside_diameter: float
    width: float
    """Boundary dimensions d, D, B, m."""
    full_complement: bool = False
    """Without a cage."""
    element_diameter: float | None = None
    effective_length: float | None = None
    element_count: int | None = None
    """Replace the estimates where they are known."""
    radial_clearance: float = 0.0
    profile_factor: float | None = None
    """See `RollerRow`; by default the standard profile of ISO/TS 16281."""
    laminae: int = LAMINAE

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """The one row, in the middle of the bearing."""
        return (_row_from_catalogue("cylindrical_roller", self, 0.0),)


@dataclass(frozen=True, kw_only=True)
class TaperedRollerBearing(CylindricalRollerBearing):
    """Single-row tapered roller bearing from its boundary dimensions d, D, T.

    The pressure line is taken at the one contact angle that catalogues state (outer raceway); the rib is
    left out. Used alone, the bearing holds an inner ring that is pushed towards +z; turn it by a negative
    `contact_angle` or combine two in a `BearingPair`.
    """

    contact_angle: float
    """Nominal contact angle, rad, signed as in `RollerRow`."""

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """The one row, in the middle of the bearing."""
        return (_row_from_catalogue("tapered_roller", self, self.contact_angle),)


@dataclass(frozen=True, kw_only=True)
class BearingPair:
    """Two equal bearings next to each other on one shaft and in one housing, as one bearing."""

    bearing: CylindricalRollerBearing
    """One of the two."""
    arrangement: Literal["X", "O", "tandem"]
    """X (face to face): pressure lines meet the axis towards the middle of the pair. O (back to back): away from it,
    stiff against tilting. Tandem: both rows take the same direction; also right for cylindrical rollers, where the
    three are the same."""
    row_distance: float | None = None
    """Distance of the middles of the rows, m; by default the width of one bearing (mounted face to face)."""
    axial_preload: float = 0.0
    """Approach of the two rows along the axis against line-to-line contact, m; negative: axial clearance."""

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """The row at -z, then the row at +z."""
        (row,) = self.bearing.rows
        distance = self.bearing.width if self.row_distance is None else self.row_distance
        return pair_rows(row, self.arrangement, distance, self.axial_preload)


def _row_from_catalogue(kind: str, bearing: CylindricalRollerBearing, angle: float) -> RollerRow:
    """Fill what the catalogue leaves open with the usual proportions of the type."""
    usual = PROPORTIONS[kind]
    pitch_diameter = 0.5 * (bearing.bore + bearing.outside_diameter)
    diameter = bearing.element_diameter or usual.diameter.value * (bearing.outside_diameter - bearing.bore)
    length = bearing.effective_length or ROLLER_LENGTH[kind].value * bearing.width
    estimated = element_count(kind, diameter / pitch_diameter, usual.spacing.value, bearing.full_complement)
    factor, straight = standard_profile(kind, diameter, length)
    if bearing.profile_factor is not None:
        factor = bearing.profile_factor
        straight = 0.0
    return RollerRow(
        element_diameter=diameter,
        effective_length=length,
        pitch_diameter=pitch_diameter,
        element_count=bearing.element_count or estimated,
        contact_angle=angle,
        radial_clearance=bearing.radial_clearance,
        profile_factor=factor,
        straight_share=straight,
        laminae=bearing.laminae,
    )
