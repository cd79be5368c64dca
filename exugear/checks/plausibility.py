"""What is possible and hardly meant: parts that stand in each other, as the gears' own dimensions tell."""

from __future__ import annotations

from collections.abc import Iterator

from exugear.model.gearbox import Gearbox
from exugear.model.parts import Bearing
from fe_ste.geometry.gears import Gear

LEAST_CLASH = 1e-3
"""Length (m), along the axis and across it, by which a gear and a bearing stand in each other before that is told."""


def doubts_about_parts(gearbox: Gearbox) -> Iterator[str]:
    """Say what looks like a mistake: key, value, and what it is compared with."""
    yield from _faces_in_bearings(gearbox)


def _faces_in_bearings(gearbox: Gearbox) -> Iterator[str]:
    """Tell gears that run into a bearing of their own body."""
    told = set()
    for body in gearbox.bodies():
        bearings = [bearing for bearing in gearbox.bearings if body.name in (bearing.body, bearing.on)]
        for name, place in body.wheels.items():
            for bearing in bearings:
                depth = _clash(gearbox.gears[name], place, bearing)
                if depth > LEAST_CLASH and (name, bearing.family) not in told:
                    told.add((name, bearing.family))
                    yield (
                        f"bodies.{body.family}.wheels_z_mm.{name} = {1e3 * place:g}: its face runs {1e3 * depth:.3g} "
                        f"mm into bearings.{bearing.family} at z_mm = {1e3 * bearing.position[2]:g}; move one of them"
                    )


def _clash(gear: Gear, place: float, bearing: Bearing) -> float:
    """Length along the axis (m) over which a gear's body and a bearing's rings share space; zero or less if none."""
    catalogue = bearing.catalogue
    if catalogue is None:
        return 0.0
    rows = 1 if catalogue.arrangement == "single" else 2
    along = 0.5 * (gear.face_width + 1e-3 * rows * catalogue.width_mm) - abs(place - bearing.position[2])
    inside, outside = sorted((0.5 * gear.held_diameter, gear.tip_radius))
    across = min(outside, 0.5e-3 * catalogue.outer_diameter_mm) - max(inside, 0.5e-3 * catalogue.bore_mm)
    return along if across > LEAST_CLASH else 0.0
