"""Checks that refuse an impossible gear or gear pair before any mesh is built.

Every refusal is a `GeometryError` that states the gear, the key, the value and the permitted range.
"""

from __future__ import annotations

import math
import numbers

import numpy as np

from fe_ste.geometry.gear_relations import ROUNDING, GearInputs, root_fillet
from fe_ste.geometry.involute import PinionCutter, involute
from fe_ste.geometry.pair_relations import (
    FILLET_TOLERANCE,
    UncheckedPair,
    corner_clear_tip_diameter,
    corner_to_fillet_gap,
)

LEAST_TEETH = 5
"""Fewest teeth; below lie worms and pump rotors."""
LEAST_TIP_THICKNESS = 0.1
"""Minimum tooth thickness at the tip circle, normal section, in normal modules; elements there degenerate below it."""
USUAL_TIP_THICKNESS = 0.2
"""What is usual at least; published gears have a little less."""
LEAST_NECK_THICKNESS = 0.2
"""Minimum tooth thickness left by undercut, normal section, in normal modules."""
PRESSURE_ANGLE_RANGE = (math.radians(10.0), math.radians(35.0))
"""Normal pressure angles accepted, rad."""
LARGEST_HELIX_ANGLE = math.radians(50.0)
"""Largest magnitude of the helix angle at the reference circle, rad."""
LENGTH_TOLERANCE = ROUNDING
"""Rounding allowed for when lengths are compared, in normal modules."""


class GeometryError(ValueError):
    """A gear or gear pair that cannot be made or cannot run."""


def check_gear(gear: GearInputs) -> None:
    """Refuse a gear that cannot be made.

    Parameters
    ----------
    gear : the gear, possibly of nonsensical values

    Raises
    ------
    GeometryError
        With one message that says what would be right.
    """
    _check_values(gear)
    if not 0.0 < gear.reference_half_angle < 0.5 * gear.angular_pitch:
        what = "tooth" if gear.reference_half_angle <= 0.0 else "tooth space"
        value = f"{gear.profile_shift:g} with tooth_thinning = {_mm(gear.tooth_thinning)}"
        remedy = f"leaves no {what} at the reference circle: values nearer to zero are needed"
        raise _refuse_gear(gear, "profile_shift", value, remedy)
    tip = gear.tip_radius
    root = gear.root_radius
    if min(tip, root) <= 0.0 or (tip - root) * gear.outward <= 0.0:
        word = "below" if gear.internal else "above"
        remedy = f"must lie {word} the root diameter of {_mm(2.0 * root)}, and both above zero"
        raise _refuse_gear(gear, "tip_diameter", _mm(2.0 * tip), remedy)
    if gear.cutter is not None:
        _check_cutter(gear, gear.cutter)
    elif gear.internal:
        _check_internal_space(gear)
    if not gear.internal:
        _check_generating_rack(gear)
        _check_flank(gear)
    _check_form_circles(gear)
    thickness = gear.tip_thickness / gear.normal_module
    if thickness < LEAST_TIP_THICKNESS:
        word = "larger" if gear.internal else "smaller"
        remedy = (
            f"at profile_shift = {gear.profile_shift:g} leaves a tip {thickness:.4f} normal modules thick: "
            f"at least {LEAST_TIP_THICKNESS} is needed, for instance by a {word} tip_diameter"
        )
        raise _refuse_gear(gear, "tip_diameter", _mm(2.0 * gear.tip_radius), remedy)
    root = 2.0 * gear.root_radius
    if (root - gear.held_diameter) * gear.outward <= 0.0:
        word = "above" if gear.internal else "below"
        remedy = f"must lie {word} the root diameter of {_mm(root)}"
        raise _refuse_gear(gear, "held_diameter", _mm(gear.held_diameter), remedy)


def check_gear_pair(pair: UncheckedPair) -> None:
    """Refuse a pair that does not fit, does not touch or interferes.

    Parameters
    ----------
    pair : two gears that passed `check_gear`

    Raises
    ------
    GeometryError
        With one message that says what would be right.
    """
    pinion = pair.pinion
    gear = pair.gear
    if pinion.internal:
        remedy = "is an internal gear: the external gear of the pair must be the pinion"
        raise _refuse_pair(pair, "pinion", f"'{pinion.name}'", remedy)
    least = pinion.teeth + 1 if gear.internal else pinion.teeth
    if gear.teeth < least:
        remedy = f"must be at least {least}: the pinion, '{pinion.name}' with {pinion.teeth}, is the smaller"
        raise _refuse_pair(pair, f"teeth of '{gear.name}'", f"{gear.teeth}", remedy)
    _check_common_face(pair)
    if not math.isclose(pinion.normal_module, gear.normal_module, rel_tol=LENGTH_TOLERANCE):
        remedy = f"must equal that of '{pinion.name}', {_mm(pinion.normal_module)}"
        raise _refuse_pair(pair, f"normal_module of '{gear.name}'", _mm(gear.normal_module), remedy)
    if not math.isclose(pinion.normal_pressure_angle, gear.normal_pressure_angle, rel_tol=LENGTH_TOLERANCE):
        remedy = f"must equal that of '{pinion.name}', {_deg(pinion.normal_pressure_angle)}"
        value = _deg(gear.normal_pressure_angle)
        raise _refuse_pair(pair, f"normal_pressure_angle of '{gear.name}'", value, remedy)
    needed = -gear.outward * pinion.helix_angle
    if not math.isclose(gear.helix_angle, needed, rel_tol=LENGTH_TOLERANCE, abs_tol=LENGTH_TOLERANCE):
        kind = "same hand" if gear.internal else "opposite hand"
        remedy = (
            f"does not mate with {_deg(pinion.helix_angle)} of '{pinion.name}': an "
            f"{'internal' if gear.internal else 'external'} pair needs the {kind}, {_deg(needed)}"
        )
        raise _refuse_pair(pair, f"helix_angle of '{gear.name}'", _deg(gear.helix_angle), remedy)
    if not _is_number(pair.centre_distance) or pair.centre_distance <= 0.0:
        remedy = "must be a finite number above zero, also for an internal pair"
        raise _refuse_pair(pair, "centre_distance", f"{pair.centre_distance!r}", remedy)
    touching = abs(pinion.base_radius + gear.outward * gear.base_radius)
    if pair.centre_distance <= touching:
        distance = pair.centre_distance
        remedy = f"is too small: no line of action touches both base circles below {_mm(touching, distance)}"
        raise _refuse_pair(pair, "centre_distance", _mm(distance, touching), remedy)
    _check_backlash(pair)
    _check_tip_clearances(pair)
    _check_tip_interference(pair)
    _check_contact(pair)
    _check_fillet_clearance(pair)
    if pair.gear.internal:
        swallowed = pair.pinion.tip_radius >= pair.centre_distance + pair.gear.tip_radius
        if swallowed or internal_tip_gap(pair) < 0.0:
            difference = pair.gear.teeth - pair.pinion.teeth
            remedy = (
                f"is too small: outside the path of contact the tips of '{pair.pinion.name}' and "
                f"'{pair.gear.name}' collide; more difference in teeth or shorter teeth are needed"
            )
            raise _refuse_pair(pair, "difference in teeth", f"{difference}", remedy)


def _refuse_gear(gear: GearInputs, key: str, value: str, remedy: str) -> GeometryError:
    return GeometryError(f"gear '{gear.name}': {key} = {value} {remedy}")


def _refuse_pair(pair: UncheckedPair, key: str, value: str, remedy: str) -> GeometryError:
    return GeometryError(f"gear pair '{pair.name}': {key} = {value} {remedy}")


def _mm(length: float, beside: float | None = None) -> str:
    """Length as shown in messages, with enough digits to distinguish it from another length in the same message."""
    digits = 4
    while beside is not None and digits < 12 and f"{1e3 * length:.{digits}f}" == f"{1e3 * beside:.{digits}f}":
        digits += 1
    return f"{1e3 * length:.{digits}f} mm"


def _small(length: float) -> str:
    """Size of an overlap: in micrometres where four decimals of a millimetre would not show it."""
    if length >= 5e-6:
        return _mm(length)
    return f"{1e6 * length:.3g} µm"


def _deg(angle: float) -> str:
    return f"{math.degrees(angle):.4f} deg"


def _is_number(value: object) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool) and math.isfinite(value)


def _check_values(gear: GearInputs) -> None:
    """Check each number by itself: finite, of the right sign, within the range of the relations."""
    teeth: object = gear.teeth
    if not isinstance(teeth, numbers.Integral) or isinstance(teeth, bool) or teeth < LEAST_TEETH:
        remedy = f"must be a whole number of at least {LEAST_TEETH}"
        raise _refuse_gear(gear, "teeth", f"{teeth!r}", remedy)
    positive = {
        "normal_module": gear.normal_module,
        "face_width": gear.face_width,
        "held_diameter": gear.held_diameter,
        "rack.addendum": gear.rack.addendum,
        "rack.dedendum": gear.rack.dedendum,
        "material.youngs_modulus": gear.material.youngs_modulus,
        "material.density": gear.material.density,
    }
    keys = ("tip_diameter", "root_diameter", "tip_form_diameter", "root_form_diameter")
    given = {key: getattr(gear, key) for key in keys}
    positive |= {key: value for key, value in given.items() if value is not None}
    for key, value in positive.items():
        if not _is_number(value) or value <= 0.0:
            raise _refuse_gear(gear, key, f"{value!r}", "must be a finite number above zero (SI units)")
    not_negative = {"rack.tip_radius": gear.rack.tip_radius, "tooth_thinning": gear.tooth_thinning}
    for key, value in not_negative.items():
        if not _is_number(value) or value < 0.0:
            raise _refuse_gear(gear, key, f"{value!r}", "must be a finite number, zero or above (SI units)")
    if not _is_number(gear.profile_shift):
        raise _refuse_gear(gear, "profile_shift", f"{gear.profile_shift!r}", "must be a finite number")
    least, most = PRESSURE_ANGLE_RANGE
    angle = gear.normal_pressure_angle
    if not _is_number(angle) or not least <= angle <= most:
        remedy = f"must lie between {_deg(least)} and {_deg(most)} (given in rad: {least:.4f} to {most:.4f})"
        raise _refuse_gear(gear, "normal_pressure_angle", f"{angle!r} rad", remedy)
    angle = gear.helix_angle
    most = LARGEST_HELIX_ANGLE
    if not _is_number(angle) or abs(angle) > most:
        remedy = f"must lie within +-{_deg(most)} (given in rad: +-{most:.4f})"
        raise _refuse_gear(gear, "helix_angle", f"{angle!r} rad", remedy)
    ratio = gear.material.poissons_ratio
    if not _is_number(ratio) or not 0.0 <= ratio < 0.5:
        raise _refuse_gear(gear, "material.poissons_ratio", f"{ratio!r}", "must be at least 0 and below 0.5")


def _check_generating_rack(gear: GearInputs) -> None:
    """Refuse a rounding that does not fit on the rack's tooth."""
    if gear.rack_tip_half_land >= -LENGTH_TOLERANCE * gear.normal_module:
        return
    radius = gear.rack.tip_radius
    largest = gear.largest_rack_rounding
    if largest < 0.0:
        remedy = "makes the generating rack pointed: a smaller one is needed"
        raise _refuse_gear(gear, "rack.dedendum", f"{gear.dedendum_factor:.4f}", remedy)
    remedy = f"does not fit on the rack at a dedendum of {gear.dedendum_factor:.4f}: at most {largest:.4f}"
    raise _refuse_gear(gear, "rack.tip_radius", f"{radius:g}", remedy)


def _check_flank(gear: GearInputs) -> None:
    """Refuse a tooth that its root, undercut or not, leaves no flank, and one that undercut leaves too thin a neck."""
    if gear.is_undercut:
        neck = 2.0 * float(np.min(np.abs(root_fillet(gear, np.linspace(0.0, 1.0, 201))[:, 1]))) / gear.normal_module
        if neck < LEAST_NECK_THICKNESS:
            least = gear.profile_shift - gear.generated_roll_length / gear.normal_module * math.sin(
                gear.transverse_pressure_angle
            )
            remedy = (
                f"undercuts the tooth to a neck {max(neck, 0.0):.4f} normal modules thick: at least "
                f"{LEAST_NECK_THICKNESS} is needed; without undercut it is {least:.4f}"
            )
            raise _refuse_gear(gear, "profile_shift", f"{gear.profile_shift:g}", remedy)
    if gear.tip_radius <= gear.form_radius:
        remedy = f"leaves no involute: it must lie above the form diameter of {_mm(2.0 * gear.form_radius)}"
        raise _refuse_gear(gear, "tip_diameter", _mm(2.0 * gear.tip_radius), remedy)


def _check_form_circles(gear: GearInputs) -> None:
    """Refuse specified form diameters that lie outside the flank or leave no flank."""
    tolerance = LENGTH_TOLERANCE * gear.normal_module
    out = gear.outward
    if (gear.tip_form_radius - gear.tip_radius) * out > tolerance:
        word = "smaller" if gear.internal else "larger"
        remedy = f"must not be {word} than the tip diameter of {_mm(2.0 * gear.tip_radius)}"
        raise _refuse_gear(gear, "tip_form_diameter", _mm(2.0 * gear.tip_form_radius), remedy)
    if gear.root_form_diameter is not None and (gear.form_radius - 0.5 * gear.root_form_diameter) * out > tolerance:
        word = "at most" if gear.internal else "at least"
        remedy = (
            f"lies in the root fillet: {word} {_mm(2.0 * gear.form_radius)}, where the tool's tip ends the involute"
        )
        raise _refuse_gear(gear, "root_form_diameter", _mm(gear.root_form_diameter), remedy)
    if (gear.tip_form_radius - gear.root_form_radius) * out <= tolerance:
        word = "below" if gear.internal else "above"
        remedy = f"leaves no flank: it must lie {word} the root form diameter of {_mm(2.0 * gear.root_form_radius)}"
        raise _refuse_gear(gear, "tip_form_diameter", _mm(2.0 * gear.tip_form_radius), remedy)


def _check_cutter(gear: GearInputs, cutter: PinionCutter) -> None:
    """Refuse a cutter that cannot make the gear, or that spoils its tips."""
    if not gear.internal:
        raise _refuse_gear(gear, "cutter", f"{cutter!r}", "is for internal gears: that of external ones is the rack")
    most = gear.teeth - 1
    if not isinstance(cutter.teeth, numbers.Integral) or not LEAST_TEETH <= cutter.teeth <= most:
        remedy = f"must be a whole number from {LEAST_TEETH} to {most}, below the teeth of the gear"
        raise _refuse_gear(gear, "cutter.teeth", f"{cutter.teeth!r}", remedy)
    if not _is_number(cutter.tip_radius) or cutter.tip_radius < 0.0:
        raise _refuse_gear(
            gear, "cutter.tip_radius", f"{cutter.tip_radius!r}", "must be a finite number, zero or above"
        )
    if not _is_number(cutter.profile_shift) or math.isnan(gear.cutting_distance):
        remedy = "leaves no centre distance at which it generates these teeth: values nearer to the gear's are needed"
        raise _refuse_gear(gear, "cutter.profile_shift", f"{cutter.profile_shift!r}", remedy)
    if gear.root_diameter is not None and cutter.tip_diameter is not None:
        remedy = "says the root diameter, too: leave it or root_diameter out"
        raise _refuse_gear(gear, "cutter.tip_diameter", _mm(cutter.tip_diameter), remedy)
    _check_cutter_tooth(gear, cutter)
    _check_tip_outside_base(gear)
    if gear.form_radius <= gear.tip_radius:
        remedy = f"leaves no involute: it must lie below the form diameter of {_mm(2.0 * gear.form_radius)}"
        raise _refuse_gear(gear, "tip_diameter", _mm(2.0 * gear.tip_radius), remedy)
    _check_trimmed_tips(gear)


def _check_cutter_tooth(gear: GearInputs, cutter: PinionCutter) -> None:
    """Refuse a cutter whose tip is below its involute or pointed, and a rounding that does not fit on it."""
    cut = gear.cutter_tip_cut
    module = gear.normal_module
    tip = 2.0 * cut.cutter_tip_radius
    key = "cutter.tip_diameter" if cutter.tip_diameter is not None else "root_diameter"
    value = _mm(tip) if cutter.tip_diameter is not None else _mm(2.0 * gear.root_radius)
    if cut.cutter_tip_radius <= cut.cutter_base_radius or not cut.largest_rounding >= 0.0:
        which = "pointed" if cut.cutter_tip_radius > cut.cutter_base_radius else "without an involute"
        remedy = f"makes a cutter with a tip diameter of {_mm(tip)}, whose teeth are {which} there: another is needed"
        raise _refuse_gear(gear, key, value, remedy)
    if cut.rounding > cut.largest_rounding + LENGTH_TOLERANCE * module:
        remedy = f"does not fit on the cutter's tip: at most {cut.largest_rounding / module:.4f}, a full round"
        raise _refuse_gear(gear, "cutter.tip_radius", f"{cutter.tip_radius:g}", remedy)


def _check_trimmed_tips(gear: GearInputs) -> None:
    """Refuse a cutter that cuts the tips: below its involute, or off the line of action."""
    cut = gear.cutter_tip_cut
    tip = gear.tip_radius
    count = gear.cutter.teeth if gear.cutter else 0
    if gear.tip_roll_length < cut.tangent_length:
        bound = 2.0 * math.hypot(gear.base_radius, cut.tangent_length)
        remedy = (
            f"reaches below the involute of the cutter, whose {count} teeth then trim the tips: "
            f"above {_mm(bound)}, or a cutter of more teeth, is needed"
        )
        raise _refuse_gear(gear, "tip_diameter", _mm(2.0 * tip), remedy)
    gap = cut.tip_corner_gap(tip, gear.half_angle(tip))
    if gap < -FILLET_TOLERANCE * gear.normal_module:
        remedy = f"trims the gear's tips by {_mm(-gap)} as it rolls out of the mesh: a cutter of fewer teeth is needed"
        raise _refuse_gear(gear, "cutter.teeth", f"{count}", remedy)


def _check_tip_outside_base(gear: GearInputs) -> None:
    if gear.tip_radius <= gear.base_radius:
        base = _mm(2.0 * gear.base_radius)
        remedy = f"lies inside the base circle, where no involute is: it must be above {base}"
        raise _refuse_gear(gear, "tip_diameter", _mm(2.0 * gear.tip_radius), remedy)


def _check_internal_space(gear: GearInputs) -> None:
    """Refuse a tip without involute, a space closed at the root, a fillet higher than the tooth."""
    _check_tip_outside_base(gear)
    if gear.half_angle(gear.root_radius) >= 0.5 * gear.angular_pitch:
        remedy = "lies beyond the point where the flanks of a tooth space meet: a smaller one is needed"
        raise _refuse_gear(gear, "root_diameter", _mm(2.0 * gear.root_radius), remedy)
    depth = gear.root_radius - gear.tip_radius
    if gear.rack.tip_radius * gear.normal_module >= depth or gear.form_radius <= gear.tip_radius:
        remedy = f"leaves no involute on teeth {_mm(depth)} high: a smaller one is needed"
        raise _refuse_gear(gear, "rack.tip_radius", f"{gear.rack.tip_radius:g}", remedy)


def _check_common_face(pair: UncheckedPair) -> None:
    width = pair.common_face_width
    most = min(pair.pinion.face_width, pair.gear.face_width)
    if width is None:
        return
    if not _is_number(width) or not 0.0 < width <= most + LENGTH_TOLERANCE * pair.pinion.normal_module:
        value = _mm(width) if _is_number(width) else f"{width!r}"
        raise _refuse_pair(
            pair, "common_face_width", value, f"must be above zero and at most the narrower face, {_mm(most)}"
        )


def _check_backlash(pair: UncheckedPair) -> None:
    backlash = pair.circumferential_backlash
    limit = pair.backlash_free_centre_distance
    if backlash >= -LENGTH_TOLERANCE * pair.pinion.normal_module:
        return
    if limit <= abs(pair.gear.base_radius - pair.pinion.base_radius):
        remedy = f"leaves no room for the teeth of '{pair.pinion.name}' at any centre distance: more is needed"
        value = f"{pair.gear.profile_shift:g}"
        raise _refuse_pair(pair, f"profile_shift of '{pair.gear.name}'", value, remedy)
    word, bound = ("large", "at most") if pair.gear.internal else ("small", "at least")
    distance = pair.centre_distance
    remedy = f"is too {word}: the flanks would overlap by {_small(-backlash)}; {bound} {_mm(limit, distance)} is needed"
    raise _refuse_pair(pair, "centre_distance", _mm(distance, limit), remedy)


def _check_tip_clearances(pair: UncheckedPair) -> None:
    for tip, root, clearance in (
        (pair.pinion, pair.gear, pair.pinion_tip_clearance),
        (pair.gear, pair.pinion, pair.gear_tip_clearance),
    ):
        if clearance <= 0.0:
            bound = tip.tip_radius + tip.outward * clearance
            word = "above" if tip.internal else "below"
            given = 2.0 * tip.tip_radius
            needed = _mm(2.0 * bound, given)
            remedy = f"runs {_small(-clearance)} into the root of '{root.name}': {word} {needed} needed"
            raise _refuse_pair(pair, f"tip_diameter of '{tip.name}'", _mm(given, 2.0 * bound), remedy)


def _check_tip_interference(pair: UncheckedPair) -> None:
    """Refuse a tip that contacts the mating gear below its root form diameter, in the fillet.

    Where undercut or root relief ends the mating flank at an edge there is nothing to contact: contact ends there.
    """
    tolerance = LENGTH_TOLERANCE * pair.pinion.normal_module
    reach_of_gear = pair.pinion_roll_length(pair.gear.tip_form_roll_length)
    reach_of_pinion = pair.pinion_roll_length(pair.gear.form_roll_length)
    for tip, mate, excess in (
        (pair.gear, pair.pinion, pair.pinion.form_roll_length - reach_of_gear),
        (pair.pinion, pair.gear, pair.pinion.tip_form_roll_length - reach_of_pinion),
    ):
        if excess > tolerance and not mate.has_relieved_root:
            bound = 2.0 * math.hypot(tip.base_radius, tip.tip_form_roll_length - tip.outward * excess)
            word = "at least" if tip.internal else "at most"
            remedy = (
                f"interferes with the root fillet of '{mate.name}', which begins at the form diameter "
                f"{_mm(2.0 * mate.form_radius)}: {word} {_mm(bound, 2.0 * tip.tip_form_radius)} is needed"
            )
            key = "tip_diameter" if tip.tip_form_diameter is None else "tip_form_diameter"
            raise _refuse_pair(pair, f"{key} of '{tip.name}'", _mm(2.0 * tip.tip_form_radius, bound), remedy)


def _check_contact(pair: UncheckedPair) -> None:
    """Refuse a pair that loses contact between its tooth pairs.

    Contact lines are a base pitch apart on the field of contact. Helical teeth traverse its length and, by their
    overlap, its width: one of them is always in contact if both ratios together are at least 1.
    """
    ratio = pair.transverse_contact_ratio
    at = f"at centre_distance = {_mm(pair.centre_distance)}"
    if ratio <= 0.0:
        raise _refuse_pair(pair, "transverse contact ratio", f"{ratio:.4f}", f"must be above zero: no contact {at}")
    if pair.total_contact_ratio < 1.0:
        key = "transverse contact ratio"
        value = f"{ratio:.4f}"
        if pair.overlap_ratio > 0.0:
            key = "total contact ratio"
            value = f"{pair.total_contact_ratio:.4f} ({ratio:.4f} + {pair.overlap_ratio:.4f})"
        raise _refuse_pair(pair, key, value, f"must be at least 1: contact is interrupted {at}")


def _check_fillet_clearance(pair: UncheckedPair) -> None:
    """Refuse a tip whose corner, outside the path of contact, interferes with the root fillet of the mating gear."""
    for tip, mate in ((pair.pinion, pair.gear), (pair.gear, pair.pinion)):
        gap = corner_to_fillet_gap(pair, tip, mate)
        if gap < -FILLET_TOLERANCE * tip.normal_module:
            word = "larger" if tip.internal else "smaller"
            tool = "rack" if mate.cutter is None else "cutter"
            clear = corner_clear_tip_diameter(pair, tip)
            would_do = ""
            if clear is not None:
                would_do = f", such as {_mm(clear)} (fitted_tip = true takes it)"
            remedy = (
                f"interferes with the root fillet of '{mate.name}', its corner cuts {_small(-gap)} into it: "
                f"a {word} one{would_do}, or a smaller {tool}.tip_radius of '{mate.name}', is needed"
            )
            raise _refuse_pair(pair, f"tip_diameter of '{tip.name}'", _mm(2.0 * tip.tip_radius), remedy)


def internal_tip_gap(pair: UncheckedPair) -> float:
    """Gap between mating tip corners of an internal pair where the tip circles cross.

    The flanks are taken in contact, as on the path of contact; the back flanks have the backlash in addition.

    Parameters
    ----------
    pair : an internal pair whose tip circles cross

    Returns
    -------
    arc along the gear's tip circle, m; negative if the corners collide
    """
    pinion = pair.pinion
    gear = pair.gear
    distance = pair.centre_distance
    at_pinion = math.acos(
        (gear.tip_radius**2 - distance**2 - pinion.tip_radius**2) / (2.0 * distance * pinion.tip_radius)
    )
    at_gear = math.acos((gear.tip_radius**2 + distance**2 - pinion.tip_radius**2) / (2.0 * distance * gear.tip_radius))
    working = involute(pair.working_pressure_angle)
    pinion_corner = working - involute(math.acos(pinion.base_radius / pinion.tip_radius))
    gear_corner = working - involute(math.acos(gear.base_radius / gear.tip_radius))
    # Angles from the line of centres; with the flanks touching at the pitch point the corners stand at
    # pinion_corner and gear_corner. The pinion's is turned to the crossing at which it runs out of the
    # mesh; at the other it runs in far behind its mate.
    return gear.tip_radius * ((at_pinion - pinion_corner) / pair.ratio + gear_corner - at_gear)
