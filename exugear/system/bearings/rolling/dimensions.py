"""Usual proportions of rolling bearings, from which missing dimensions are estimated.

Diameters, numbers and lengths were set so that the static ratings that follow from them (ISO 76) are those of SKF's
General Catalogue (2008), its edition of 2017 for needle roller bearings. For each type: how many bearings, and
estimated over printed rating, the median and the range of the middle nine tenths:

==================== === ==== =========
cylindrical roller   125 1.00 0.91-1.21
the same, no cage     94 1.06 0.89-1.27
needle roller         40 1.00 0.92-1.06
tapered roller       188 1.00 0.88-1.17
spherical roller      87 1.00 0.87-1.13
deep-groove ball      68 0.96 0.93-1.08
angular-contact ball  38 0.94 0.87-1.02
self-aligning ball    72 1.00 0.71-1.21
four-point ball       51 1.01 0.93-1.13
==================== === ==== =========

The range of each single proportion covers bearings with published internal geometry (Harris and Kotzalas, Rolling
Bearing Analysis; data sets of faulty bearings), widened where the ratings require it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

CYLINDRICAL_ROLLER_PROFILE = 0.00035
TAPERED_ROLLER_PROFILE = 0.00045
LONG_ROLLER_PROFILE = 0.0005
"""Logarithmic roller profiles of ISO/TS 16281: drop / roller diameter, for `RollerRow.profile_factor`."""
CURVED_LENGTH = 2.5
"""Rollers longer than this many diameters are straight in the middle: only so much of their length is curved."""
FILLING_HALF_ANGLE_DEG = 93.0
"""Half of the arc that balls fill between eccentric rings: how deep-groove bearings are assembled."""
FULL_COMPLEMENT_SPACING = 1.01
"""Distance of neighbours on the pitch circle over their diameter, without a cage."""


@dataclass(frozen=True)
class Proportion:
    """A proportion and the range that it usually has."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Proportions:
    """Proportions of one type of bearing."""

    diameter: Proportion
    """Diameter of the rolling elements over outer diameter less bore."""
    spacing: Proportion
    """Circumference of the pitch circle over the sum of the elements' diameters, with a cage."""


PROPORTIONS: Mapping[str, Proportions] = {
    "cylindrical_roller": Proportions(Proportion(0.27, 0.24, 0.29), Proportion(1.15, 1.08, 1.45)),
    "needle_roller": Proportions(Proportion(0.16, 0.12, 0.20), Proportion(1.40, 1.20, 1.60)),
    "tapered_roller": Proportions(Proportion(0.27, 0.24, 0.29), Proportion(1.15, 1.08, 1.25)),
    "spherical_roller": Proportions(Proportion(0.26, 0.23, 0.28), Proportion(1.15, 1.08, 1.25)),
    "deep_groove_ball": Proportions(Proportion(0.305, 0.29, 0.32), Proportion(1.70, 1.60, 1.85)),
    "angular_contact_ball": Proportions(Proportion(0.32, 0.29, 0.335), Proportion(1.08, 1.04, 1.20)),
    "self_aligning_ball": Proportions(Proportion(0.26, 0.22, 0.31), Proportion(1.25, 1.15, 1.40)),
    "four_point_ball": Proportions(Proportion(0.3175, 0.29, 0.335), Proportion(1.12, 1.05, 1.20)),
    "thrust_spherical_roller": Proportions(Proportion(0.26, 0.23, 0.29), Proportion(1.15, 1.05, 1.25)),
}
"""Proportions by type."""
PITCH_BEYOND_MEAN = Proportion(0.0, -0.02, 0.03)
"""Pitch diameter less the mean of bore and outer diameter, over outer diameter less bore."""
ROLLER_LENGTH: Mapping[str, Proportion] = {
    "cylindrical_roller": Proportion(0.64, 0.50, 0.74),
    "needle_roller": Proportion(0.68, 0.60, 0.76),
    "tapered_roller": Proportion(0.68, 0.58, 0.76),
    "spherical_roller": Proportion(0.74, 0.65, 0.82),
    "thrust_spherical_roller": Proportion(0.60, 0.50, 0.68),
}
"""Effective length of rollers over the width of their row, by type."""
CONTACT_ANGLE_DEG: Mapping[str, Proportion] = {
    "tapered_roller": Proportion(16.0, 11.0, 29.0),
    "angular_contact_ball": Proportion(40.0, 15.0, 40.0),
    "four_point_ball": Proportion(35.0, 30.0, 40.0),
    "thrust_spherical_roller": Proportion(48.0, 45.0, 51.0),
}
"""Contact angles by type; those of bearings that align themselves follow from the distance of their rows."""
ALIGNING_ROW_DISTANCE: Mapping[str, Proportion] = {
    "spherical_roller": Proportion(0.49, 0.46, 0.54),
    "self_aligning_ball": Proportion(0.52, 0.46, 0.62),
}
"""Distance of the rows over the width of the bearing, where both rows point to its middle."""
PAIR_DISTANCE = Proportion(1.0, 0.95, 1.05)
"""Distance between the middles of the rows over the width of one bearing, for two bearings next to each other."""
TAPERED_PAIR_DISTANCE: Mapping[str, Proportion] = {
    "X": Proportion(1.16, 1.11, 1.24),
    "O": Proportion(0.84, 0.76, 0.89),
}
"""The same of tapered roller bearings: the middle of their rollers is 0.42 (0.38 to 0.445) of the width away from the
back face of the outer ring, as the effective centres of 54 bearings in SKF's General Catalogue have it."""
RIB_CONTACT = Proportion(0.2, 0.1, 0.3)
"""Length of the contact of a roller's end with a rib over the roller's diameter: assumed. It decides on the axial
stiffness alone, not on which bearing holds the shaft."""
GROOVE_RATIO = Proportion(0.52, 0.515, 0.53)
"""Groove radius over ball diameter; ISO 281 and ISO 76 take 0.52 for the ratings."""
OSCULATION = Proportion(0.98, 0.965, 0.99)
"""Radius of a barrel roller's outline over that of the raceway."""
CLEARANCE_UM: Mapping[str, tuple[float, float]] = {
    "cylindrical_roller": (25.0, 0.62),
    "needle_roller": (25.0, 0.62),
    "spherical_roller": (20.0, 0.85),
    "deep_groove_ball": (8.0, 0.28),
    "self_aligning_ball": (15.0, 0.33),
    "four_point_ball": (60.0, 0.45),
}
"""Maximum radial clearance (micrometres) before mounting, normal group of ISO 5753: a constant, and a part per mm of
bore. A fit within 15 % to the tables, which go by steps; of four-point bearings from the axial one."""
AXIAL_SETTING_UM_PER_MM = 0.5
"""Range of the axial setting of a pair, either way, for each mm of bore: assumed, it is set at mounting."""


def element_count(kind: str, diameter_ratio: float, spacing: float, full_complement: bool) -> int:
    """Count the rolling elements of one row.

    Parameters
    ----------
    kind : type of the bearing
    diameter_ratio : diameter of an element over that of the pitch circle
    spacing : of `Proportions`; for rollers, and balls of bearings that are not filled eccentrically
    full_complement : without a cage

    Examples
    --------
    A 6205 has 9 balls of 7.94 mm on 39.04 mm:

    >>> element_count("deep_groove_ball", 7.94 / 39.04, 1.70, False)
    9
    """
    if full_complement:
        return int(math.pi / (FULL_COMPLEMENT_SPACING * diameter_ratio))
    if kind == "deep_groove_ball":
        filled = math.radians(FILLING_HALF_ANGLE_DEG) * 1.70 / spacing
        return round(1.0 + filled / math.asin(min(diameter_ratio, 1.0)))
    return int(math.pi / (spacing * diameter_ratio))


def standard_profile(kind: str, diameter: float, length: float) -> tuple[float, float]:
    """Give the standard roller profile of ISO/TS 16281, as `profile_factor` and `straight_share` of `RollerRow`.

    Parameters
    ----------
    kind : type of the bearing
    diameter, length : mean diameter and effective length of the roller, m

    Notes
    -----
    Drop at x from the middle: ``0.00035 D ln(1 / (1 - (2 x / L)^2))`` for cylindrical and needle rollers up to
    ``L = 2.5 D``; for longer ones 0 up to ``(L - 2.5 D) / 2``, and from there
    ``0.0005 D ln(1 / (1 - ((2 x - (L - 2.5 D)) / (2.5 D))^2))``; for tapered rollers as the first, with 0.00045.

    Examples
    --------
    >>> standard_profile("cylindrical_roller", 0.030, 0.050), standard_profile("needle_roller", 0.004, 0.020)
    ((0.00035, 0.0), (0.0005, 0.5))

    References
    ----------
    ISO/TS 16281:2008, roller profiles (its equations 42 to 44).
    """
    if kind == "tapered_roller":
        return TAPERED_ROLLER_PROFILE, 0.0
    if length <= CURVED_LENGTH * diameter:
        return CYLINDRICAL_ROLLER_PROFILE, 0.0
    return LONG_ROLLER_PROFILE, 1.0 - CURVED_LENGTH * diameter / length
