"""Rows of rollers: the element that all roller bearings are made of.

Frame: origin at the middle of the bearing, z along its axis; coordinates
``(u_x, u_y, u_z, theta_x, theta_y, theta_z)`` of the inner ring relative to the outer ring, SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

LINE_CONTACT_CONSTANT = 35948.0e6
"""Load-deflection constant of steel line contact, roller against both raceways, N/m^2 in SI:
35948 N/mm^(10/9) mm^(-8/9), where the exponents of the length add up to two (ISO/TS 16281)."""


class BearingError(ValueError):
    """The bearing cannot exist, or cannot carry the load it is given."""


@dataclass(frozen=True, kw_only=True)
class RollerRow:
    """One row of rollers, the element all roller bearings are made of.

    Attributes
    ----------
    roller_diameter, effective_length, pitch_diameter : float
        Mean roller diameter, effective contact length and pitch circle diameter, m.
    roller_count : int
        Number of rollers.
    contact_angle : float
        Angle between the contact normal and the radial plane, rad, signed: positive where the row holds an
        inner ring that is pushed towards +z. Zero for cylindrical rollers.
    axial_position : float
        Middle of the rollers in the frame of the bearing, m.
    radial_clearance : float
        Diametral clearance of the mounted row in the radial plane, m. Negative: preload.
    profile_factor : float
        Logarithmic profile over roller diameter; 0 for a straight roller.
    laminae : int
        Slices per roller; ISO/TS 16281 asks for at least 30.
    """

    roller_diameter: float
    effective_length: float
    pitch_diameter: float
    roller_count: int
    contact_angle: float = 0.0
    axial_position: float = 0.0
    radial_clearance: float = 0.0
    profile_factor: float = 0.0
    laminae: int = 30

    def __post_init__(self) -> None:
        """Refuse what cannot be built."""
        for key in ("roller_diameter", "effective_length", "pitch_diameter"):
            if not getattr(self, key) > 0.0:
                raise BearingError(f"roller row: {key} = {getattr(self, key)!r} must be positive")
        if self.roller_count < 3:
            raise BearingError(f"roller row: roller_count = {self.roller_count} must be at least 3")
        if self.laminae < 1:
            raise BearingError(f"roller row: laminae = {self.laminae} must be at least 1")
        if not abs(self.contact_angle) < math.pi / 2:
            raise BearingError(f"roller row: contact_angle = {self.contact_angle} rad must lie within +-pi/2")
        if self.profile_factor < 0.0:
            raise BearingError(f"roller row: profile_factor = {self.profile_factor} must not be negative")
        if self.roller_count * self.roller_diameter > math.pi * self.pitch_diameter:
            raise BearingError(
                f"roller row: {self.roller_count} rollers of {1e3 * self.roller_diameter:.1f} mm "
                f"do not fit on a pitch circle of {1e3 * self.pitch_diameter:.1f} mm"
            )

    @property
    def contact_constant(self) -> float:
        """``c_L`` of a whole roller, N/m^(10/9)."""
        return LINE_CONTACT_CONSTANT * float(self.effective_length ** (8.0 / 9.0))


class RollerBearing(Protocol):
    """Anything made of rows of rollers between one inner and one outer ring body."""

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """Rows in the frame of the bearing."""
        ...
