"""Stages of a REXS file as gear pairs: profile shifts that follow from centre distances, and consistency checks."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from exugear.exchange.rexs.mapping import IMPORTED_MODIFICATIONS, MODIFICATIONS, READ, SHAPES
from exugear.exchange.rexs.to_case.notes import Entry, Notes, assumed, derived, read, tidy
from exugear.exchange.rexs.to_case.toothing import EQUAL, Tool, Toothing
from exugear.exchange.rexs.tree import Component, Model, RexsError
from exugear.gearbox.gear_parts import pinion_cutter
from exugear.gearbox.sections.gears import CutterSection
from exugear.gearbox.units import MM
from fe_ste.geometry import pair_relations
from fe_ste.geometry.checks import GeometryError, check_gear
from fe_ste.geometry.gear_relations import BasicRack, GearInputs
from fe_ste.geometry.involute import involute
from fe_ste.geometry.pair_relations import UncheckedPair

SHIFT_TOLERANCE = 1e-3
"""Largest difference between the sum of profile shifts and the value from the centre distance; covers rounding in
files.
"""
RACK_TOLERANCE = 1e-6
"""Largest relative difference of modules and pressure angles of one rack."""
PITCH_TOLERANCE = 2e-4
"""Largest relative difference of equal base pitches, in files with four digits."""
PLACE_TOLERANCE = 0.02
"""Largest difference between a centre distance and the positions of the gears, mm."""
MARGIN = 1e-4
"""Allowance for rounding if a tool or a tip is replaced, in normal modules."""
FORM_TOLERANCE = 1e-3
"""Difference of form diameters that is neglected, in normal modules."""
CURVE_SAMPLES = 2001
"""Number of points of the curve that the rounded tip of a tool cuts."""


@dataclass(frozen=True)
class Stage:
    """Two meshing gears; the pinion is the smaller gear, or the external one if the other is a ring gear."""

    part: Component
    """First of the equal stages, one of which exists for each planet."""
    pinion: int
    gear: int
    """Numbers of the components of both gears."""
    distance: Entry
    """Centre distance, mm: the specified one, or that of the positions, according to the rules of the import."""
    apart: float
    """Distance of the axes from their positions, mm."""
    common_face: Entry | None = None
    """Common face width of the gears if less than the narrower face width, mm."""

    @property
    def both(self) -> tuple[int, int]:
        """Numbers of pinion and gear."""
        return self.pinion, self.gear


def centre_distance(stage: Component, apart: float, pair: tuple[Toothing, Toothing], notes: Notes) -> Entry:
    """Centre distance of a stage with a given distance of the axes (mm), according to the rules of the import.

    Raises
    ------
    RexsError
        The file has two different distances, and neither profile shifts nor rules decide between them.
    """
    stated = stage.quantity("center_distance")
    if apart <= PLACE_TOLERANCE:
        raise RexsError(f"{stage}: both gears are on one axis; correct support_vector of one of them")
    if stated is None:
        return derived(tidy(round(apart, 9)), "distance of the gears' positions")
    stated = abs(stated)
    notes.checked.append(f"{stage}: centre distance {stated:.6g} mm, positions {apart:.6f} mm")
    if abs(stated - apart) <= PLACE_TOLERANCE:
        return Entry(tidy(stated), "center_distance")
    rule = notes.rules.distances
    why = "as asked for"
    if rule == "agreeing" and stated > PLACE_TOLERANCE:
        rule = _confirmed(pair, stated, apart)
        why = "with which the profile shifts agree"
    both = f"center_distance = {stated:g} mm, but the distance of the gear positions is {apart:.4f} mm"
    if rule == "agreeing":
        raise RexsError(
            f"{stage}: {both}; correct one of them, or import with --distances positions or --distances file"
        )
    notes.changed.append(
        f"{stage}: {both}; {'the positions count' if rule == 'positions' else 'axes are moved to the first'}, {why}"
    )
    if rule == "positions":
        return derived(tidy(round(apart, 9)), f"distance of the gears' positions, {why}; center_distance {stated:g}")
    return Entry(tidy(stated), f"center_distance, {why}; distance of the gear positions {apart:.4f}")


def _confirmed(
    pair: tuple[Toothing, Toothing], stated: float, apart: float
) -> Literal["agreeing", "positions", "file"]:
    """Return which of two distances agrees with the profile shifts of both gears; "agreeing" for both or neither."""
    pinion, gear = pair
    if pinion.signed_shift is None or gear.signed_shift is None:
        return "agreeing"
    total = pinion.signed_shift + gear.signed_shift
    asked = [
        pair_relations.shift_sum(unchecked("", pinion), unchecked("", gear), MM * distance)
        for distance in (apart, stated)
    ]
    fits = [shift is not None and abs(shift - total) <= SHIFT_TOLERANCE for shift in asked]
    if fits[0] == fits[1]:
        return "agreeing"
    if fits[0]:
        return "positions"
    return "file"


def shift_sum(pinion: Toothing, gear: Toothing, distance: float) -> float:
    """Sum of profile shifts for zero backlash at a distance (mm), see `fe_ste.geometry.pair_relations.shift_sum`.

    Raises
    ------
    RexsError
        No working pressure angle exists for the distance.
    """
    total = pair_relations.shift_sum(unchecked("", pinion), unchecked("", gear), MM * distance)
    if total is None:
        raise RexsError(
            f"{pinion.part}, {gear.part}: no line of action touches both base circles at a distance of {distance:g} mm"
        )
    return total


def with_shifts(gears: Mapping[int, Toothing], stages: Sequence[Stage], notes: Notes) -> dict[int, Toothing]:
    """Complete the profile shifts that a file omits for one or both gears of a pair, from the centre distance."""
    solved = _solved(gears, stages)
    wrong = [stage for stage in stages if _contradicts_distance(solved, stage)]
    for replaced in (_zeros_with_followers(gears, stages, wrong, notes), _replaceable(gears, stages, wrong, notes)):
        again = _reopened(gears, stages, replaced)
        if replaced and not any(_contradicts_distance(again, stage) for stage in stages):
            solved = again
            for before, after in ((gears[number], again[number]) for number in replaced):
                assert before.shift is not None and after.shift is not None
                notes.changed.append(
                    f"{before.part}: addendum_modification_coefficient = {before.shift.value:g} contradicts the centre "
                    f"distances and is treated as missing: {after.shift.value:.6f} for zero backlash"
                )
            break
    for stage in stages:
        with notes.errors.gathered():
            stated, total = _shift_sums(solved, stage)
            notes.checked.append(
                f"{stage.part}: sum of profile shifts {stated:.6f}, the centre distance requires {total:.6f}"
            )
            if abs(stated - total) > SHIFT_TOLERANCE:
                option = ""
                if notes.rules.shifts == "file":
                    option = (
                        ", or import with --shifts centre-distance, which replaces a shift of 0, or else one of the two"
                    )
                raise RexsError(
                    f"{stage.part}: the sum of profile shifts is {stated:.5f}, but the centre distance of "
                    f"{stage.distance.value:g} mm requires {total:.5f}; correct addendum_modification_coefficient or "
                    f"center_distance{option}"
                )
    notes.errors.tell()
    return solved


def _reopened(gears: Mapping[int, Toothing], stages: Sequence[Stage], numbers: Sequence[int]) -> dict[int, Toothing]:
    """Give every gear a profile shift; those of the listed gears are derived from their stages."""
    open_shifts = {number: dataclasses.replace(gears[number], shift=None) for number in numbers}
    return _solved({**gears, **open_shifts}, stages)


def _zeros_with_followers(
    gears: Mapping[int, Toothing], stages: Sequence[Stage], wrong: Sequence[Stage], notes: Notes
) -> list[int]:
    """Gears with a shift of zero in contradictory stages, and dependent mating gears, if the rules permit replacement.

    The zero shift of a planet may agree with its ring gear and contradict its sun. Its shift then follows from the sun,
    and that of the ring gear from the planet.
    """
    if notes.rules.shifts != "centre-distance":
        return []
    found: list[int] = []
    for stage in wrong:
        zeros = [number for number in stage.both if gears[number].signed_shift == 0.0]
        if len(zeros) == 1:
            found += zeros
    again = _reopened(gears, stages, found)
    for stage in stages:
        if found and stage not in wrong and _contradicts_distance(again, stage):
            found += [number for number in stage.both if number not in found]
    return list(dict.fromkeys(found))


def _solved(gears: Mapping[int, Toothing], stages: Sequence[Stage]) -> dict[int, Toothing]:
    solved = dict(gears)
    open_stages = list(stages)
    while open_stages:
        ready = [stage for stage in open_stages if any(solved[number].shift for number in stage.both)]
        for stage in ready or open_stages[:1]:
            open_stages.remove(stage)
            _complete(solved, stage)
    return solved


def _contradicts_distance(gears: Mapping[int, Toothing], stage: Stage) -> bool:
    """Return whether the shifts of a stage contradict its centre distance."""
    stated, total = _shift_sums(gears, stage)
    return abs(stated - total) > SHIFT_TOLERANCE


def _shift_sums(gears: Mapping[int, Toothing], stage: Stage) -> tuple[float, float]:
    pinion = gears[stage.pinion]
    gear = gears[stage.gear]
    assert pinion.signed_shift is not None and gear.signed_shift is not None
    return pinion.signed_shift + gear.signed_shift, shift_sum(pinion, gear, stage.distance.value)


def _replaceable(
    gears: Mapping[int, Toothing], stages: Sequence[Stage], wrong: Sequence[Stage], notes: Notes
) -> list[int]:
    """Gears whose shift of zero may mean no value: zeros that contradict all of their stages, one in each of these.

    Programs write 0 for a shift that they derive. If both gears of a stage have such a zero, or neither, the rules
    decide.
    """
    found: list[int] = []
    for stage in wrong:
        free = [number for number in stage.both if all(other in wrong for other in stages if number in other.both)]
        zeros = [number for number in free if gears[number].signed_shift == 0.0]
        if len(zeros) == 1:
            found += zeros
        elif notes.rules.shifts == "centre-distance":
            found += zeros or free[:1]
    return list(dict.fromkeys(found))


def _complete(gears: dict[int, Toothing], stage: Stage) -> None:
    """Give both gears of a stage a shift; if neither has one, the gear gets zero and the pinion the whole sum."""
    total = shift_sum(gears[stage.pinion], gears[stage.gear], stage.distance.value)
    if all(gears[number].shift is None for number in stage.both):
        zero = assumed(0.0, "not in the file for either gear of the stage")
        gears[stage.gear] = dataclasses.replace(gears[stage.gear], shift=zero)
    for number, mate in (stage.both, stage.both[::-1]):
        gear = gears[number]
        counted = gears[mate].signed_shift
        if gear.shift is None and counted is not None:
            rest = counted - total if gear.internal else total - counted
            shift = derived(tidy(round(rest, 9)), "from the centre distance, without backlash")
            gears[number] = dataclasses.replace(gear, shift=shift)


def with_equal_racks(gears: Mapping[int, Toothing], stages: Sequence[Stage], notes: Notes) -> dict[int, Toothing]:
    """Describe gears by the rack of their mating gears if their own is a different one with the same base pitch.

    Involutes mesh if their base pitches are equal, even if they were cut with different racks. Base circle, base helix,
    tooth thickness and diameters are unchanged. The fillet is that of the other rack, which differs slightly.
    """
    same = dict(gears)
    open_stages = list(stages)
    settled: set[int] = set()
    while open_stages:
        stage = next((stage for stage in open_stages if settled & {*stage.both}), open_stages[0])
        open_stages.remove(stage)
        keep, other = stage.both[::-1] if stage.gear in settled else stage.both
        settled |= {keep, other}
        mate, gear = same[keep], same[other]
        of_mate, own = ((one.module.value, one.pressure_angle.value) for one in (mate, gear))
        (wanted, wanted_sine), (pitch, sine) = _base_pitch(mate), _base_pitch(gear)
        one_pitch = abs(wanted - pitch) <= PITCH_TOLERANCE * pitch and abs(wanted_sine - sine) <= PITCH_TOLERANCE
        if np.allclose(of_mate, own, rtol=RACK_TOLERANCE, atol=0.0) or not one_pitch:
            continue
        notes.changed.append(
            f"{gear.part}: m_n = {gear.module.value:g} mm at {gear.pressure_angle.value:g} deg "
            f"has the base pitch of {mate.part}; described by its rack of {mate.module.value:g} mm at "
            f"{mate.pressure_angle.value:g} deg, base circle, tooth thickness and diameters kept"
        )
        same[other] = _relative_to_mating_rack(mate, gear)
    return same


def _base_pitch(gear: Toothing) -> tuple[float, float]:
    """Return the normal base pitch divided by pi (mm), and the sine of the base helix angle."""
    cosine = math.cos(math.radians(gear.pressure_angle.value))
    return gear.module.value * cosine, abs(math.sin(math.radians(gear.helix_angle.value))) * cosine


def _relative_to_mating_rack(mate: Toothing, gear: Toothing) -> Toothing:
    """Describe a gear by the rack of its mating gear."""
    before = unchecked("", gear)
    angle = math.radians(mate.pressure_angle.value)
    sine = math.sin(before.helix_angle) * math.cos(before.normal_pressure_angle) / math.cos(angle)
    source = f"of another rack with the same base pitch: {gear.module.value:g} mm, {gear.pressure_angle.value:g} deg"
    changes: dict[str, Any] = {
        "module": derived(mate.module.value, source),
        "pressure_angle": derived(mate.pressure_angle.value, source),
        "helix_angle": derived(tidy(math.degrees(math.asin(sine))), "the same base helix angle"),
    }
    bare = unchecked("", dataclasses.replace(gear, **changes, tip=None, root=None, cutter=None, root_form=None))
    scale = bare.reference_radius / before.reference_radius
    changes["thinning"] = dataclasses.replace(gear.thinning, value=tidy(gear.thinning.value * scale))
    if gear.allowances:
        allowances = {key: tidy(value * scale) for key, value in gear.allowances.value.items()}
        changes["allowances"] = dataclasses.replace(gear.allowances, value=allowances)
    if gear.shift is None:
        return dataclasses.replace(gear, **changes)
    turned = involute(before.transverse_pressure_angle) - involute(bare.transverse_pressure_angle)
    thickness = gear.shift.value * math.tan(before.normal_pressure_angle) + 0.5 * gear.teeth * turned
    shift = thickness / math.tan(angle)
    root = 2e3 * before.root_radius
    depth = bare.outward * (1e3 * bare.reference_radius - 0.5 * root) / mate.module.value
    changes |= {
        "shift": derived(tidy(round(shift, 9)), "the same tooth thickness at the base circle"),
        "tip": gear.tip or derived(tidy(round(2e3 * before.tip_radius, 6)), "as of its own rack"),
        "root": gear.root or derived(tidy(round(root, 6)), "as of its own rack"),
        "dedendum": derived(tidy(round(depth + bare.outward * shift, 9)), "the same root diameter"),
        "tip_radius": derived(
            tidy(round(gear.tip_radius.value * gear.module.value / mate.module.value, 9)), "the same length"
        ),
        "cutter": None,
        "tools": (),
    }
    return dataclasses.replace(gear, **changes)


def unchecked(name: str, gear: Toothing) -> GearInputs:
    """Build the gear with its geometric relations."""
    cutter = CutterSection.model_construct(**gear.cutter.value) if gear.cutter else None
    plain = GearInputs(
        name=name,
        teeth=gear.teeth,
        normal_module=MM * gear.module.value,
        normal_pressure_angle=math.radians(gear.pressure_angle.value),
        helix_angle=math.radians(gear.helix_angle.value),
        profile_shift=gear.shift.value if gear.shift else 0.0,
        face_width=MM * gear.face_width.value,
        held_diameter=1e-3,
        internal=gear.internal,
        rack=BasicRack(1.0, gear.dedendum.value, gear.tip_radius.value),
        tip_diameter=MM * gear.tip.value if gear.tip else None,
        root_diameter=MM * gear.root.value if gear.root else None,
        tooth_thinning=MM * gear.thinning.value,
        root_form_diameter=MM * gear.root_form.value if gear.root_form else None,
        cutter=pinion_cutter(cutter, gear.module.value, gear.helix_angle.value),
    )
    if not gear.chamfer:
        return plain
    return dataclasses.replace(plain, tip_form_diameter=2.0 * (plain.tip_radius - MM * plain.outward * gear.chamfer))


@contextmanager
def reports_impossible(*gears: Toothing) -> Iterator[None]:
    """Convert errors of geometric relations without a solution to errors that name the gears."""
    try:
        yield
    except RexsError:
        raise
    except (ArithmeticError, ValueError) as error:
        parts = " and ".join(str(gear.part) for gear in gears)
        raise RexsError(
            f"{parts}: tooth numbers, diameters, profile shift and tool are inconsistent ({error}); correct them"
        ) from None


def with_possible_cutter(gear: Toothing, notes: Notes) -> Toothing:
    """Remove a cutter that cannot produce the specified ring gear, and record the reason."""
    if gear.cutter is None:
        return gear
    made = unchecked("", gear)
    try:
        check_gear(dataclasses.replace(made, held_diameter=10.0 * made.reference_radius))
    except GeometryError as error:
        why = str(error).removeprefix("gear '': ")
        notes.changed.append(f"{gear.part}: its cutter is not imported, the root fillet is an arc instead; {why}")
        return dataclasses.replace(gear, cutter=None)
    return gear


def with_fitting_tool(gear: Toothing, notes: Notes) -> Toothing:
    """Limit the corner radius of the tool to the largest possible one; large pressure angles require this."""
    made = unchecked("", gear)
    if gear.internal or made.rack_tip_half_land >= 0.0:
        return gear
    most = made.largest_rack_rounding
    if most <= 0.0:
        return gear
    radius = math.floor(1e4 * most) / 1e4
    if not gear.tip_radius.kind:
        notes.changed.append(
            f"{gear.part}: a tool tip radius of {gear.tip_radius.value:g} does not fit; {radius:g} is used"
        )
    said = f"{gear.tip_radius.value:g} does not fit on a tool of {gear.pressure_angle.value:g} deg"
    return dataclasses.replace(gear, tip_radius=assumed(radius, said))


def with_form_circles(gear: Toothing, notes: Notes) -> Toothing:
    """Keep a root form diameter if it ends the flank before the fillet does; undercut is computed separately."""
    bare = unchecked("", dataclasses.replace(gear, root_form=None))
    if bare.is_undercut:
        notes.checked.append(f"{gear.part}: undercut by its tool; root form diameter {2e3 * bare.form_radius:.4f} mm")
    if gear.root_form is None:
        gear = dataclasses.replace(gear, root_form=_flank_end(gear, bare))
    if gear.root_form is None:
        return gear
    beyond = (MM * gear.root_form.value - 2.0 * bare.form_radius) * bare.outward
    notes.checked.append(
        f"{gear.part}: root form diameter {gear.root_form.value:.6g} mm, from the tip radius of its tool "
        f"{2e3 * bare.form_radius:.6g} mm"
    )
    if beyond > FORM_TOLERANCE * bare.normal_module:
        return gear
    return dataclasses.replace(gear, root_form=None)


def _flank_end(gear: Toothing, bare: GearInputs) -> Entry | None:
    """Root form diameter (mm) that the tools produce; None if one tool without protuberance makes flank and root.

    The last tool finishes the flank down to the end of its straight part. An earlier tool that cuts deeper ends the
    flank where its protuberance, minus its machining allowance, cuts into it.
    """
    if not gear.tools:
        return None
    last = gear.tools[-1]
    deepest = max(gear.tools, key=lambda tool: tool.depth)
    relief = deepest.protuberance
    ends: dict[str, float] = {}
    sine = math.sin(bare.normal_pressure_angle)
    if deepest is not last:
        relief -= deepest.allowance
        straight = last.depth - last.tip_radius * (1.0 - sine)
        ends[f"the straight flank of {last.part} ends there"] = _generated_radius(bare, straight)
    if relief > 0.0 and math.degrees(deepest.protuberance_angle) < gear.pressure_angle.value:
        ends[f"the protuberance of {deepest.part} cuts in there"] = _cut_by_protuberance(bare, deepest, relief)
    if not ends:
        return None
    source, radius = max(ends.items(), key=lambda one: one[1])
    return derived(tidy(round(2e3 * radius, 4)), source)


def _generated_radius(gear: GearInputs, depth: float) -> float:
    """Radius (m) down to which a rack that is straight to a depth in normal modules generates the flank."""
    angle = gear.transverse_pressure_angle
    below = (depth - gear.profile_shift) * gear.normal_module
    roll = gear.base_radius * math.tan(angle) - below / math.sin(angle)
    return math.hypot(gear.base_radius, max(roll, 0.0))


def _cut_by_protuberance(gear: GearInputs, tool: Tool, relief: float) -> float:
    """Largest radius at which the protuberance and tip rounding of a tool cut into the finished flank, m; 0 if none.

    `relief` is the distance of the protuberance beyond the line of the finished flank, in normal modules. A point of
    the tool cuts where its normal passes through the pitch point, as in `fe_ste.geometry.involute.RackTipCut`.
    """
    module = gear.normal_module
    angle = tool.protuberance_angle
    rounding = tool.tip_radius * module
    middle = gear.rack_tip_half_land + relief * module / math.cos(gear.normal_pressure_angle)
    # The straight part extends from the rounding to the intersection with the line of the flank.
    beyond = (rounding - relief * module) / math.cos(gear.normal_pressure_angle) - rounding / math.cos(angle)
    height = beyond / (math.tan(angle) - math.tan(gear.normal_pressure_angle)) + rounding * math.sin(angle)
    along = np.linspace(max(height, 0.0) / math.cos(angle), 0.0, CURVE_SAMPLES)
    around = np.linspace(angle, 0.5 * math.pi, CURVE_SAMPLES)
    slope = -np.append(np.full(CURVE_SAMPLES, angle), around)
    along = np.append(along, np.zeros(CURVE_SAMPLES))
    stretch = 1.0 / math.cos(gear.helix_angle)
    x = stretch * (middle + rounding * np.cos(slope) + along * math.sin(angle))
    y = gear.root_radius - gear.reference_radius + rounding * (1.0 + np.sin(slope)) + along * math.cos(angle)
    travel = y * np.cos(slope) / (stretch * np.sin(slope)) - x
    radius = np.hypot(x + travel, gear.reference_radius + y)
    polar = 0.5 * gear.angular_pitch + travel / gear.reference_radius
    polar = polar - np.arctan2(x + travel, gear.reference_radius + y)
    above = radius > gear.base_radius
    cut = radius[above & (polar < gear.half_angle(np.where(above, radius, gear.base_radius)))]
    return float(np.max(cut, initial=0.0))


def with_clear_tips(gears: dict[int, Toothing], stages: Sequence[Stage], notes: Notes) -> dict[int, Toothing]:
    """Shorten tips that would contact the mating gear below its root form diameter, where it has no involute.

    A specified tip diameter is changed only in this case; an unspecified one also gets a clearance.
    """
    cleared = dict(gears)
    for stage in stages:
        for tip, mate in (stage.both[::-1], stage.both):
            with reports_impossible(cleared[tip], cleared[mate]):
                bound = _tip_bound(cleared, stage, tip)
            if bound is None:
                continue
            tip_diameter = 2e3 * unchecked("", cleared[tip]).tip_radius
            notes.changed.append(
                f"{cleared[tip].part}: tip diameter {bound:g} mm instead of {tip_diameter:.4f} mm, which reaches or is "
                f"too close to the form diameter of {cleared[mate].part}"
            )
            entry = assumed(
                bound, f"{tip_diameter:.4f} would be too close to the form diameter of {cleared[mate].part}"
            )
            cleared[tip] = dataclasses.replace(cleared[tip], tip=entry)
    return cleared


def _tip_bound(gears: Mapping[int, Toothing], stage: Stage, which: int) -> float | None:
    """Tip diameter (mm) of a gear that clears the form diameter of its mating gear; None if it already does."""
    pinion = unchecked("pinion", gears[stage.pinion])
    gear = unchecked("gear", gears[stage.gear])
    pair = UncheckedPair(name="", pinion=pinion, gear=gear, centre_distance=MM * stage.distance.value)
    for member, of in ((pinion, stage.pinion), (gear, stage.gear)):
        if member.tip_radius <= member.base_radius:
            raise RexsError(
                f"{gears[of].part}: its tip diameter of {2e3 * member.tip_radius:.6g} mm is inside its base diameter "
                f"of {2e3 * member.base_radius:.6g} mm; correct tip_diameter or its tooth data"
            )
    tip = gear if which == stage.gear else pinion
    margin = (MARGIN if gears[which].tip else pair_relations.ROOT_MARGIN) * tip.normal_module
    diameter = 1e3 * pair_relations.clear_tip_diameter(pair, tip, margin)
    if pair_relations.root_margin(pair, tip) >= margin:
        return None
    # Rounded towards more clearance.
    return round((math.floor if tip.outward > 0 else math.ceil)(1e4 * diameter) / 1e4, 4)


# Flank modifications of a REXS file: reliefs and crownings that are equal on both flanks


def modification_of(model: Model, gear: Toothing, notes: Notes) -> dict[str, Entry]:
    """Entries of a gear's table of modifications; empty for none.

    Raises
    ------
    RexsError
        Left and right flank differ.
    """
    left, right = (_modification_by_type(model, gear.part, side) for side in ("left", "right"))
    for kind, part in {**right, **left}.items():
        if kind not in (*IMPORTED_MODIFICATIONS, *(row.attribute for row in READ["unsigned"])):
            notes.changed.append(f"{part} of {gear.part}: not imported; set it in [gears.NAME.modification]")
    entries: dict[str, Entry] = {}
    for kind in IMPORTED_MODIFICATIONS:
        first = left.get(kind)
        other = right.get(kind)
        if first is None and other is None:
            continue
        if first is None or other is None or not _equal(first, other):
            raise RexsError(f"{gear.part}: left and right flank differ in {kind}; only equal flanks can be imported")
        found = dict(_entries(gear, first, notes))
        if not found:
            notes.changed.append(f"{first} of {gear.part}: not imported, its numbers cannot be interpreted")
        entries |= found
    return entries | dict(_blanks(gear, left, right, notes))


def _blanks(
    gear: Toothing, left: dict[str, Component], right: dict[str, Component], notes: Notes
) -> Iterator[tuple[str, Entry]]:
    """Yield slopes of the file as zeros to be completed, since their signs are not defined; skip zero slopes."""
    for kind, key in ((row.attribute, row.key) for row in READ["unsigned"]):
        part = left.get(kind) or right.get(kind)
        amounts = [side[kind].quantity(kind) for side in (left, right) if kind in side]
        if part is None or not any(amounts):
            continue
        said = ", ".join(dict.fromkeys(f"{_um(amount):g} µm" for amount in amounts if amount))
        notes.changed.append(
            f"{part} of {gear.part}: its amount of {said} is not imported, since REXS does not define at which end a "
            f"positive value removes material; set {key} in [gears.NAME.modification]"
        )
        yield key, assumed(0.0, f"SET IT: {said} by {part}, end unknown")


def _modification_by_type(model: Model, gear: Component, side: str) -> dict[str, Component]:
    flanks = model.related("flank", "gear", gear.number, side)
    found = [
        component for flank in flanks for component in model.related("reference", "origin", flank.number, "referenced")
    ]
    return {component.type: component for component in found if component.type in MODIFICATIONS}


def _equal(component: Component, other: Component) -> bool:
    keys = {key for part in (component, other) for key, value in part.attributes.items() if value.unit == "mm"}
    pairs = ((component.quantity(key, "mm"), other.quantity(key, "mm")) for key in keys)
    return all(a == b or (a is not None and b is not None and abs(a - b) < EQUAL) for a, b in pairs)


def _entries(gear: Toothing, part: Component, notes: Notes) -> Iterator[tuple[str, Entry]]:
    if part.type.endswith("_relief"):
        yield from _relief(gear, part)
    elif part.type == "profile_crowning":
        ends = [part.quantity(f"profile_crowning_at_{end}") for end in ("tip", "root")]
        if ends[0] is not None and ends[1] is not None and abs(ends[0] - ends[1]) < EQUAL:
            yield "profile_crowning_um", read(_um(ends[0]), f"profile_crowning_at_tip and _root of {part}")
    else:
        yield from _lead_crowning(gear, part)


def _lead_crowning(gear: Toothing, part: Component) -> Iterator[tuple[str, Entry]]:
    """Lead crowning scaled to the ends of the face, with the square of the distance from the middle."""
    sides = ("datum_face", "non_datum_face")
    amounts = [part.quantity(f"helix_crowning_amount_{side}") for side in sides]
    quantities = [part.quantity(f"coordinate_where_helix_crowning_is_specified_{side}") for side in sides]
    if None in amounts or None in quantities:
        return
    (one, other), (low, high) = [[value or 0.0 for value in pair] for pair in (amounts, quantities)]
    half = 0.5 * gear.face_width.value
    if abs(one - other) < EQUAL and abs(low + high) < EQUAL and abs(high) > 0.1 * half:
        amount = _um(one * (half / high) ** 2)
        yield "lead_crowning_um", read(amount, f"helix_crowning_amount at the ends of the face, {part}")


def _relief(gear: Toothing, part: Component) -> Iterator[tuple[str, Entry]]:
    """Relief from its datum diameter, scaled to the end of the flank if its depth is specified elsewhere."""
    kind = part.type.removesuffix("_relief")
    depth, datum = (part.quantity(f"{part.type}_{key}") for key in ("depth", "datum_diameter"))
    shape = SHAPES.get(part.text("shape_of_relief"))
    geometry = unchecked("", gear)
    base = 2e3 * geometry.base_radius
    if not depth or datum is None or abs(datum) <= base or shape is None:
        return
    end = 2e3 * (geometry.tip_radius if kind == "tip" else geometry.form_radius)
    stated = abs(part.quantity(f"{part.type}_evaluation_reference") or end)
    start, stated_at, ends_at = (math.sqrt(max((d / base) ** 2 - 1.0, 0.0)) for d in (abs(datum), stated, end))
    if abs(stated_at - start) < EQUAL:
        return
    scale = (abs(ends_at - start) / abs(stated_at - start)) ** (1 if shape == "linear" else 2)
    yield f"{kind}_relief_um", read(_um(depth * scale), f"{part.type}_depth of {part}")
    yield f"{kind}_relief_start_roll_deg", derived(tidy(round(math.degrees(start), 6)), f"{part.type}_datum_diameter")
    yield f"{kind}_relief_shape", read(shape, f"shape_of_relief {part.text('shape_of_relief')}")


def _um(length: float) -> float:
    """Convert millimetres to micrometres without round-off digits."""
    return tidy(round(1e3 * length, 6))
