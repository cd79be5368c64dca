"""The spur pair of `spur` on two catalogue bearings a shaft: balls and cylindrical rollers, two tapered ones."""

from __future__ import annotations

from typing import Any

from exugear.gearbox.gearbox import Gearbox

from .spur import SPUR_CASE


def _on_shaft(name: str, body: str, z: float, kind: str, sizes: tuple[float, float, float], more: str = "") -> str:
    bore, outer, width = sizes
    return f"""
[bearings.{name}]
body = "{body}"
z_mm = {z}
[bearings.{name}.catalogue]
type = "{kind}"
bore_mm = {bore}
outer_diameter_mm = {outer}
width_mm = {width}
{more}"""


TAPER = ("tapered_roller", (30.0, 62.0, 17.25))
BEARINGS = (
    _on_shaft("ball", "shaft_1", -30.0, "deep_groove_ball", (25.0, 52.0, 15.0))
    + _on_shaft("roller", "shaft_1", 45.0, "cylindrical_roller", (25.0, 52.0, 15.0))
    + _on_shaft("taper_1", "shaft_2", -30.0, *TAPER, 'contact_angle_deg = 14.0\nlocates_towards = "-z"\n')
    + _on_shaft("taper_2", "shaft_2", 45.0, *TAPER, 'contact_angle_deg = 14.0\nlocates_towards = "+z"\n')
)
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
