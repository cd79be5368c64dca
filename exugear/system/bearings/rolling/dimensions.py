"""Dimensions of rolling bearings: boundary dimensions by designation, usual proportions of missing dimensions.

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

Sizes of radial bearings are those of ISO 15, of tapered roller bearings those of ISO 355; the basic numbers of
designations are those of DIN 623-1: type, dimension series, bore. Suffixes (seals, cages, clearance) do not change
them.

All series were compared with manufacturers' catalogues: of 737 designations in the tables, 728 are listed with the same
three dimensions in catalogues of FAG/INA, FBJ, IBB or KRW (their text in the public repository ArtemFilin1990/Mar,
commit 7b871a5), and the series 2 also in BOLTS (DIN 625-1 and 5412-1); none is listed with other dimensions. The nine
that are not listed, N303, N1005, N1030 to N1040 and NU1004, differ from listed ones only in their ribs, as all NUP
bearings do.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

# Usual proportions of rolling bearings: what catalogues leave open, from the boundary dimensions

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


# Boundary dimensions of rolling bearings by their designation

SOURCES = {"tapered_roller": "ISO 355", "": "ISO 15"}
"""Standard by type of bearing; the empty name for all others."""


@dataclass(frozen=True)
class Boundary:
    """Type and boundary dimensions (mm) of a bearing, and the standard that has them."""

    type: str
    bore: float
    outer: float
    width: float
    source: str


def _read_by_bore(text: str) -> dict[int, float]:
    """Numbers by bore, from pairs."""
    return {int(bore): float(value) for bore, _, value in (pair.partition(":") for pair in text.split())}


_OUTER: Mapping[str, Mapping[int, float]] = {
    "0": _read_by_bore(
        "10:26 12:28 15:32 17:35 20:42 25:47 30:55 35:62 40:68 45:75 50:80 55:90 60:95 65:100 70:110 75:115 80:125 "
        "85:130 90:140 95:145 100:150 105:160 110:170 120:180 130:200 140:210 150:225 160:240 170:260 180:280 190:290 "
        "200:310"
    ),
    "2": _read_by_bore(
        "10:30 12:32 15:35 17:40 20:47 25:52 30:62 35:72 40:80 45:85 50:90 55:100 60:110 65:120 70:125 75:130 80:140 "
        "85:150 90:160 95:170 100:180 105:190 110:200 120:215 130:230 140:250 150:270 160:290 170:310 180:320 190:340 "
        "200:360"
    ),
    "3": _read_by_bore(
        "10:35 12:37 15:42 17:47 20:52 25:62 30:72 35:80 40:90 45:100 50:110 55:120 60:130 65:140 70:150 75:160 80:170 "
        "85:180 90:190 95:200 100:215 105:225 110:240 120:260 130:280 140:300 150:320 160:340 170:360 180:380 190:400 "
        "200:420"
    ),
    "4": _read_by_bore("17:62 20:72 25:80 30:90 35:100 40:110 45:120 50:130 55:140 60:150 65:160 70:180 75:190 80:200"),
}
"""Outer diameter by diameter series and bore."""

_WIDTH: Mapping[str, Mapping[int, float]] = {
    "10": _read_by_bore(
        "10:8 12:8 15:9 17:10 20:12 25:12 30:13 35:14 40:15 45:16 50:16 55:18 60:18 65:18 70:20 75:20 80:22 85:22 "
        "90:24 95:24 100:24 105:26 110:28 120:28 130:33 140:33 150:35 160:38 170:42 180:46 190:46 200:51"
    ),
    "02": _read_by_bore(
        "10:9 12:10 15:11 17:12 20:14 25:15 30:16 35:17 40:18 45:19 50:20 55:21 60:22 65:23 70:24 75:25 80:26 85:28 "
        "90:30 95:32 100:34 105:36 110:38 120:40 130:40 140:42 150:45 160:48 170:52 180:52 190:55 200:58"
    ),
    "03": _read_by_bore(
        "10:11 12:12 15:13 17:14 20:15 25:17 30:19 35:21 40:23 45:25 50:27 55:29 60:31 65:33 70:35 75:37 80:39 85:41 "
        "90:43 95:45 100:47 105:49 110:50 120:55 130:58 140:62 150:65 160:68 170:72 180:75 190:78 200:80"
    ),
    "04": _read_by_bore("17:17 20:19 25:21 30:23 35:25 40:27 45:29 50:31 55:33 60:35 65:37 70:42 75:45 80:48"),
    "22": _read_by_bore(
        "20:18 25:18 30:20 35:23 40:23 45:23 50:23 55:25 60:28 65:31 70:31 75:31 80:33 85:36 90:40 95:43 100:46 110:53 "
        "120:58 130:64 140:68 150:73 160:80 170:86 180:86 190:92 200:98"
    ),
    "23": _read_by_bore(
        "20:21 25:24 30:27 35:31 40:33 45:36 50:40 55:43 60:46 65:48 70:51 75:55 80:58 85:60 90:64 95:67 100:73 110:80 "
        "120:86 130:93 140:102 150:108 160:114 170:120 180:126 190:132 200:138"
    ),
}
"""Width by dimension series and bore, ISO 15."""

_TAPERED: Mapping[str, Mapping[int, float]] = {
    "302": _read_by_bore(
        "17:13.25 20:15.25 25:16.25 30:17.25 35:18.25 40:19.75 45:20.75 50:21.75 55:22.75 60:23.75 65:24.75 70:26.25 "
        "75:27.25 80:28.25 85:30.5 90:32.5 95:34.5 100:37 105:39 110:41 120:43.5"
    ),
    "303": _read_by_bore(
        "15:14.25 17:15.25 20:16.25 25:18.25 30:20.75 35:22.75 40:25.25 45:27.25 50:29.25 55:31.5 60:33.5 65:36 70:38 "
        "75:40 80:42.5 85:44.5 90:46.5 95:49.5 100:51.5 105:53.5 110:54.5 120:59.5"
    ),
    "320": _read_by_bore(
        "20:15 25:15 30:17 35:18 40:19 45:20 50:20 55:23 60:23 65:23 70:25 75:25 80:29 85:29 90:32 95:32 100:32"
    ),
    "322": _read_by_bore(
        "30:21.25 35:24.25 40:24.75 45:24.75 50:24.75 55:26.75 60:29.75 65:32.75 70:33.25 75:33.25 80:35.25 85:38.5 "
        "90:42.5 95:45.5 100:49"
    ),
    "323": _read_by_bore(
        "20:22.25 25:25.25 30:28.75 35:32.75 40:35.25 45:38.25 50:42.25 55:45.5 60:48.5 65:51 70:54 75:58 80:61.5 "
        "85:63.5 90:67.5 95:71.5 100:77.5"
    ),
    "330": _read_by_bore(
        "25:17 30:20 35:21 40:22 45:24 50:24 55:27 60:27 65:27 70:31 75:31 80:36 85:36 90:39 95:39 100:39"
    ),
}
"""Width over both rings by series and bore, ISO 355."""

_FAMILIES: tuple[tuple[str, str, Mapping[str, str]], ...] = (
    (r"6(0|2|3|4)", "deep_groove_ball", {"0": "10", "2": "02", "3": "03", "4": "04"}),
    (r"7(0|2|3)", "angular_contact_ball", {"0": "10", "2": "02", "3": "03"}),
    (r"(?:NU|NJ|NUP|N)(10|2|3|4|22|23)", "cylindrical_roller", {"10": "10", "2": "02", "3": "03", "4": "04"}),
    (r"2(22|23)", "spherical_roller", {}),
)
"""Beginning of a designation before its bore number, type, and the dimension series of its letters."""
_LEAST_BORE = {
    "cylindrical_roller": {"10": 20, "02": 15, "03": 17, "04": 30},
    "spherical_roller": {"22": 25, "23": 40},
}
"""Bores below which no manufacturer lists a type in a dimension series, where the table of its widths continues."""

_BORES = {"00": 10, "01": 12, "02": 15, "03": 17}


def boundary_of(designation: str) -> Boundary | None:
    """Type and boundary dimensions of a bearing; None where the tables here do not have it.

    Examples
    --------
    >>> boundary_of("6210-2Z")
    Boundary(type='deep_groove_ball', bore=50.0, outer=90.0, width=20.0, source='ISO 15')
    >>> boundary_of("33014").width, boundary_of("NU 2208 ECP").outer, boundary_of("XY 1")
    (31.0, 80.0, None)
    """
    text = re.sub(r"^([A-Z]+)\s+(?=\d)", r"\1", designation.strip().upper())
    tapered = re.match(r"(30[23]|32[023]|330)(\d\d)(?!\d)", text)
    if tapered:
        return _found("tapered_roller", tapered[2], tapered[1][-1], _TAPERED[tapered[1]])
    for start, kind, series in _FAMILIES:
        match = re.match(rf"{start}(\d\d)(?!\d)", text)
        if match:
            dimensions = series.get(match[1], match[1])
            if _BORES.get(match[2], 5 * int(match[2])) < _LEAST_BORE.get(kind, {}).get(dimensions, 0):
                return None
            return _found(kind, match[2], dimensions[-1], _WIDTH[dimensions])
    return None


def _found(kind: str, number: str, diameter_series: str, widths: Mapping[int, float]) -> Boundary | None:
    bore = _BORES.get(number, 5 * int(number))
    outer = _OUTER["0" if diameter_series == "0" else diameter_series].get(bore)
    if outer is None or bore not in widths:
        return None
    return Boundary(kind, float(bore), outer, widths[bore], SOURCES.get(kind, SOURCES[""]))
