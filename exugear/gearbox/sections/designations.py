"""Boundary dimensions of rolling bearings by their designation.

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

import re
from collections.abc import Mapping
from dataclasses import dataclass

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
        return _found("tapered_roller", _bore(tapered[2]), tapered[1][-1], _TAPERED[tapered[1]])
    for start, kind, series in _FAMILIES:
        match = re.match(rf"{start}(\d\d)(?!\d)", text)
        if match:
            dimensions = series.get(match[1], match[1])
            bore = _bore(match[2])
            if bore < _LEAST_BORE.get(kind, {}).get(dimensions, 0):
                return None
            return _found(kind, bore, dimensions[-1], _WIDTH[dimensions])
    return None


def _bore(number: str) -> int:
    """Return the bore (mm) of a bore number."""
    return _BORES.get(number, 5 * int(number))


def _found(kind: str, bore: int, diameter_series: str, widths: Mapping[int, float]) -> Boundary | None:
    outer = _OUTER[diameter_series].get(bore)
    if outer is None or bore not in widths:
        return None
    return Boundary(kind, float(bore), outer, widths[bore], SOURCES.get(kind, SOURCES[""]))
