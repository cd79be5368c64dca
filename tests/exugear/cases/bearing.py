"""The spur pair of `spur` on two catalogue bearings a shaft: balls and cylindrical rollers, two tapered ones."""

from __future__ import annotations

from typing import Any

from exugear.gearbox.gearbox import Gearbox

from .spur import SPUR_CASE

BEARINGS = """
[bearings.ball]
body = "shaft_1"
z_mm = -30.0
[bearings.ball.catalogue]
type = "deep_groove_ball"
bore_mm = 25.0
outer_diameter_mm = 52.0
width_mm = 15.0

[bearings.roller]
body = "shaft_1"
z_mm = 45.0
[bearings.roller.catalogue]
type = "cylindrical_roller"
bore_mm = 25.0
outer_diameter_mm = 52.0
width_mm = 15.0

[bearings.taper_1]
body = "shaft_2"
z_mm = -30.0
[bearings.taper_1.catalogue]
type = "tapered_roller"
bore_mm = 30.0
outer_diameter_mm = 62.0
width_mm = 17.25
contact_angle_deg = 14.0
locates_towards = "-z"

[bearings.taper_2]
body = "shaft_2"
z_mm = 45.0
[bearings.taper_2.catalogue]
type = "tapered_roller"
bore_mm = 30.0
outer_diameter_mm = 62.0
width_mm = 17.25
contact_angle_deg = 14.0
locates_towards = "+z"
"""
before, after = SPUR_CASE.index("[bearings.bearing_1]"), SPUR_CASE.index("[meshes]")
BEARING_CASE = SPUR_CASE[:before] + BEARINGS + "\n" + SPUR_CASE[after:]
NAMES = ("ball", "roller", "taper_1", "taper_2")
NON_LINEAR = {f"bearings.{name}.model": "iso16281" for name in NAMES}
STIFFNESS = {"spur": 3e8}


def bearing_gearbox(folder: Any, **changes: Any) -> Gearbox:
    """The case, with keys changed by dots written as ``__``."""
    path = folder / "bearing_case.toml"
    path.write_text(BEARING_CASE, encoding="utf-8")
    return Gearbox.from_toml(path).varied({key.replace("__", "."): value for key, value in changes.items()})
