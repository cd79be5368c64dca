"""How near gear pairs are to what tables cut off or what wears out: form circles, tips, pressure at the pitch point.

From macro geometry and the static load alone, so that it costs nothing before the finite elements do.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from exugear.gearbox.gear_parts import thinning_range
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import PairSpec
from fe_ste.geometry.checks import USUAL_TIP_THICKNESS
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.transmission_error.hertz import pitch_point_pressure

LEAST_FORM_MARGIN = 0.02
"""Part of a flank that should be left between the mate's tip and the form circle.

Elastic teeth meet a little before and after the path of contact; tables cut off what is beyond the form circle, and
count it (`fe_ste.contact.flank_ends`).
"""
PROPOSED_MARGIN = 0.025
"""Part of a flank that a proposed tip diameter leaves."""


@dataclass(frozen=True)
class PairMargins:
    """Margins of a gear pair."""

    form: tuple[float, float]
    """Of gear 1 and gear 2: roll length from the form circle to where the mate's tip touches, over the roll length
    of the flank; NaN where the root is relieved on purpose, so that contact may end there."""
    tip_thickness: tuple[float, float]
    """Of both tips in the normal section, in normal modules."""
    pitch_point_pressure: float
    """By Hertz under the static load, Pa; zero where the pair carries none."""


def pair_margins(spec: PairSpec) -> PairMargins:
    """Find the margins of a pair.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> margins = pair_margins(gearbox.pairs["high_speed"])
    >>> bool(min(margins.form) > LEAST_FORM_MARGIN), round(1e-6 * margins.pitch_point_pressure)
    (True, 842)
    """
    pair = spec.pair
    torque = spec.static_torque
    first, second = (gear.tip_thickness / gear.normal_module for gear in (pair.pinion, pair.gear))
    return PairMargins(
        form=_form_margins(pair),
        tip_thickness=(first, second),
        pitch_point_pressure=pitch_point_pressure(pair, torque) if torque > 0.0 else 0.0,
    )


@dataclass(frozen=True)
class ThicknessRange:
    """What allowances of the tooth thickness make of a gear, from the thinnest to the thickest tooth."""

    thickness: tuple[float, float]
    """On the reference circle, normal section, m."""
    span_teeth: int | None
    """Number of teeth of the base tangent; None for internal gears."""
    span: tuple[float, float]
    """Base tangent length over them, m; zero for internal gears."""


def thickness_range(gearbox: Gearbox, name: str) -> ThicknessRange:
    """Tooth thickness of a gear within its allowances, and the base tangent length that an inspector finds."""
    gear = gearbox.gears[name]
    thick, thin = (replace(gear, tooth_thinning=thinning) for thinning in thinning_range(gearbox.case.gears[name]))
    count = None if gear.internal else gear.usual_span
    spans = (0.0, 0.0) if count is None else (thin.span_measurement(count), thick.span_measurement(count))
    return ThicknessRange((thin.normal_tooth_thickness, thick.normal_tooth_thickness), count, spans)


def backlash_range(gearbox: Gearbox, pair: GearPair) -> tuple[float, float, float]:
    """Least, computed and greatest backlash of a pair on its working circles, m: of the thickest and thinnest teeth.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [round(1e6 * play) for play in backlash_range(gearbox, gearbox.gear_pairs["high_speed"])]
    [201, 201, 201]
    """
    given = pair.circumferential_backlash
    across = 1.0 / math.cos(pair.working_pressure_angle)
    ends = [0.0, 0.0]
    for gear in (pair.pinion, pair.gear):
        # Thickness and radius grow alike along the involute: the base circle's share, on the working circle.
        thinnings = thinning_range(gearbox.case.gears[gear.name])
        share = math.cos(gear.transverse_pressure_angle) * across
        ends = [end + share * (thinning - gear.tooth_thinning) for end, thinning in zip(ends, thinnings, strict=True)]
    return given + ends[0], given, given + ends[1]


def _form_margins(pair: GearPair) -> tuple[float, float]:
    """Margins of both gears, as `PairMargins` has them."""
    tangent = pair.base_tangent_length
    on_pinion = pair.pinion_roll_length(pair.gear.tip_roll_length)
    pinion_tip = pair.pinion.tip_roll_length
    on_gear = tangent + pinion_tip if pair.gear.internal else tangent - pinion_tip
    return _margin(pair.pinion, on_pinion), _margin(pair.gear, on_gear)


def _margin(gear: Gear, roll_length: float) -> float:
    if gear.has_relieved_root:
        return math.nan
    flank = gear.tip_roll_length - gear.form_roll_length  # negative for a ring, as the numerator is
    return (roll_length - gear.form_roll_length) / flank


def doubts_about_pairs(gearbox: Gearbox) -> Iterator[str]:
    """Say which margins of pairs at work are small: key, value, and what would be right."""
    at_work = {mesh.pair.name for mesh in gearbox.meshes}
    for name, spec in gearbox.pairs.items():
        if name not in at_work:
            continue
        margins = pair_margins(spec)
        gears = (spec.pair.pinion, spec.pair.gear)
        for gear, mate, margin in zip(gears, gears[::-1], margins.form, strict=True):
            if margin < LEAST_FORM_MARGIN and spec.table:
                key = f"gears.{mate.name}.tip_diameter_mm = {2e3 * mate.tip_radius:.6g}"
                yield (
                    f"{key}: its tip comes within {100 * margin:.2g} % of the flank to the form circle of {gear.name}, "
                    f"where contact under load ends; the table of {name} counts what it cuts off there; "
                    f"{1e3 * _clear_tip_diameter(spec.pair, mate):.6g} leaves {100 * PROPOSED_MARGIN:g} %"
                )
    for name, gear in gearbox.gears.items():
        thickness = gear.tip_thickness / gear.normal_module
        if thickness < USUAL_TIP_THICKNESS:
            yield (
                f"gears.{name}.tip_diameter_mm = {2e3 * gear.tip_radius:.6g}: leaves a tip {thickness:.3f} normal "
                f"modules thick; {USUAL_TIP_THICKNESS:g} is the usual least, 0.4 for case-hardened teeth"
            )


def _clear_tip_diameter(pair: GearPair, mate: Gear) -> float:
    """Tip diameter of a gear, m, that leaves the proposed margin on the other one of its pair."""
    if mate is pair.gear:
        other = pair.pinion
        on_other = other.form_roll_length + PROPOSED_MARGIN * (other.tip_roll_length - other.form_roll_length)
        roll = on_other + pair.base_tangent_length if mate.internal else pair.base_tangent_length - on_other
    else:
        other = pair.gear
        on_other = other.form_roll_length + PROPOSED_MARGIN * (other.tip_roll_length - other.form_roll_length)
        roll = pair.pinion_roll_length(on_other)
    return 2.0 * math.hypot(mate.base_radius, roll)
