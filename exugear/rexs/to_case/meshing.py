"""Stages of a REXS file as gear pairs: profile shifts that follow from centre distances, and what must fit."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from exugear.rexs.faults import RexsError
from exugear.rexs.to_case.notes import Entry, Notes, assumed, derived, tidy
from exugear.rexs.to_case.toothing import Toothing
from exugear.rexs.tree import Component
from fe_ste.geometry import fitting
from fe_ste.geometry.checks import GeometryError, check_gear
from fe_ste.geometry.cutter import PinionCutter
from fe_ste.geometry.gear_relations import BasicRack, UncheckedGear
from fe_ste.geometry.pair_relations import UncheckedPair

SHIFT_TOLERANCE = 1e-3
"""Largest difference of the sum of profile shifts from what the centre distance asks for: digits of a file."""
PLACE_TOLERANCE = 0.02
"""Largest difference of a centre distance and the positions of the gears, mm."""
MARGIN = 1e-4
"""Rounding allowed for where a tool or a tip is replaced, in normal modules."""
FORM_TOLERANCE = 1e-3
"""Difference of form diameters that says nothing, in normal modules."""


@dataclass(frozen=True)
class Stage:
    """Two gears in mesh: the pinion is the smaller, against a ring the external one.

    Attributes
    ----------
    part : Component
        The first of the stages that are alike, one for each planet.
    pinion, gear : int
        Numbers of the gears' components.
    distance : Entry
        Centre distance, mm.
    common_face : Entry, optional
        Face width that the gears share, where that is less than the narrower face, mm.
    """

    part: Component
    pinion: int
    gear: int
    distance: Entry
    common_face: Entry | None = None


def centre_distance(stage: Component, apart: float, notes: Notes) -> Entry:
    """Centre distance of a stage whose gears stand so far apart (mm).

    Raises
    ------
    RexsError
        The file says two different distances.
    """
    stated = stage.quantity("center_distance", "mm")
    if stated is None:
        return derived(tidy(round(apart, 9)), "distance of the gears' positions")
    notes.checked.append(f"{stage}: centre distance {abs(stated):.6g} mm, positions {apart:.6f} mm")
    if abs(abs(stated) - apart) > PLACE_TOLERANCE:
        raise RexsError(
            f"{stage}: center_distance = {stated:g} mm, but its gears stand {apart:.4f} mm apart; correct one of them"
        )
    return Entry(tidy(abs(stated)), "center_distance")


def shift_sum(pinion: Toothing, gear: Toothing, distance: float) -> float:
    """Profile shifts that leave no backlash at a centre distance (mm), see `fe_ste.geometry.fitting.shift_sum`.

    Raises
    ------
    RexsError
        No working pressure angle belongs to the distance.
    """
    total = fitting.shift_sum(unchecked("", pinion), unchecked("", gear), 1e-3 * distance)
    if total is None:
        raise RexsError(
            f"{pinion.part}, {gear.part}: no line of action touches both base circles at a distance of {distance:g} mm"
        )
    return total


def with_shifts(gears: Mapping[int, Toothing], stages: Sequence[Stage], notes: Notes) -> dict[int, Toothing]:
    """Complete the profile shifts: a file may give one of a pair, or none, and leave the rest to the centre distance.

    Raises
    ------
    RexsError
        Shifts and centre distance contradict each other.
    """
    solved, open_stages = dict(gears), list(stages)
    while open_stages:
        ready = [one for one in open_stages if _given(solved, one)] or open_stages[:1]
        for stage in ready:
            open_stages.remove(stage)
            _complete(solved, stage)
    for stage in stages:
        with notes.faults.gathered():
            _check_shifts(solved, stage, notes)
    notes.faults.tell()
    return solved


def _given(gears: Mapping[int, Toothing], stage: Stage) -> bool:
    return gears[stage.pinion].shift is not None or gears[stage.gear].shift is not None


def _complete(gears: dict[int, Toothing], stage: Stage) -> None:
    """Give both gears of a stage a shift; where neither has one the gear gets none and the pinion all."""
    pinion, gear = gears[stage.pinion], gears[stage.gear]
    sign = -1.0 if gear.internal else 1.0
    total = shift_sum(pinion, gear, stage.distance.value)
    if pinion.shift is None and gear.shift is None:
        gear = dataclasses.replace(gear, shift=assumed(0.0, "the file gives none for either gear of the stage"))
        gears[stage.gear] = gear
    if pinion.shift is None and gear.shift is not None:
        shift = derived(tidy(round(total - sign * gear.shift.value, 9)), "from the centre distance, without backlash")
        gears[stage.pinion] = dataclasses.replace(pinion, shift=shift)
    elif gear.shift is None and pinion.shift is not None:
        missing = tidy(round(sign * (total - pinion.shift.value), 9))
        shift = derived(missing, "from the centre distance, without backlash")
        gears[stage.gear] = dataclasses.replace(gear, shift=shift)


def _check_shifts(gears: Mapping[int, Toothing], stage: Stage, notes: Notes) -> None:
    pinion, gear = gears[stage.pinion], gears[stage.gear]
    if pinion.shift is None or gear.shift is None:
        return
    total = shift_sum(pinion, gear, stage.distance.value)
    stated = pinion.shift.value + (-gear.shift.value if gear.internal else gear.shift.value)
    notes.checked.append(f"{stage.part}: sum of profile shifts {stated:.6f}, centre distance asks for {total:.6f}")
    if abs(stated - total) > SHIFT_TOLERANCE:
        raise RexsError(
            f"{stage.part}: the profile shifts sum to {stated:.5f}, but its centre distance of "
            f"{stage.distance.value:g} mm asks for {total:.5f}; correct addendum_modification_coefficient "
            "or center_distance"
        )


def unchecked(name: str, gear: Toothing) -> UncheckedGear:
    """Build the gear with the relations of its geometry."""
    plain = UncheckedGear(
        name=name,
        teeth=gear.teeth,
        normal_module=1e-3 * gear.module.value,
        normal_pressure_angle=math.radians(gear.pressure_angle.value),
        helix_angle=math.radians(gear.helix_angle.value),
        profile_shift=gear.shift.value if gear.shift else 0.0,
        face_width=1e-3 * gear.face_width.value,
        held_diameter=1e-3,
        internal=gear.internal,
        rack=BasicRack(1.0, gear.dedendum.value, gear.tip_radius.value),
        tip_diameter=1e-3 * gear.tip.value if gear.tip else None,
        root_diameter=1e-3 * gear.root.value if gear.root else None,
        tooth_thinning=1e-3 * gear.thinning.value,
        root_form_diameter=1e-3 * gear.root_form.value if gear.root_form else None,
        cutter=_cutter(gear),
    )
    if not gear.chamfer:
        return plain
    return dataclasses.replace(plain, tip_form_diameter=2.0 * (plain.tip_radius - 1e-3 * plain.outward * gear.chamfer))


def _cutter(gear: Toothing) -> PinionCutter | None:
    """Build the cutter of a ring."""
    if gear.cutter is None:
        return None
    given, tip = gear.cutter.value, gear.cutter.value.get("tip_diameter_mm")
    if "addendum" in given:
        reference = given["teeth"] / math.cos(math.radians(gear.helix_angle.value))
        tip = gear.module.value * (reference + 2.0 * (given["profile_shift"] + given["addendum"]))
    return PinionCutter(
        given["teeth"], given["tip_radius"], given["profile_shift"], None if tip is None else 1e-3 * tip
    )


def with_possible_cutter(gear: Toothing, notes: Notes) -> Toothing:
    """Leave out a cutter that cannot make the ring as the file describes it, and say why."""
    if gear.cutter is None:
        return gear
    made = unchecked("", gear)
    try:
        check_gear(dataclasses.replace(made, held_diameter=10.0 * made.reference_radius))
    except GeometryError as error:
        why = str(error).removeprefix("gear '': ")
        notes.changed.append(f"{gear.part}: its cutter is left out, the fillet is an arc instead; {why}")
        return dataclasses.replace(gear, cutter=None)
    return gear


def with_form_circles(gear: Toothing, notes: Notes) -> Toothing:
    """Keep a root form diameter where it ends the flank before the fillet does; undercut ends it by itself."""
    bare = unchecked("", dataclasses.replace(gear, root_form=None))
    if bare.is_undercut:
        notes.checked.append(
            f"{gear.part}: undercut by its tool; its flank begins at a diameter of {2e3 * bare.form_radius:.4f} mm"
        )
    if gear.root_form is None:
        return gear
    beyond = (1e-3 * gear.root_form.value - 2.0 * bare.form_radius) * bare.outward
    notes.checked.append(
        f"{gear.part}: root form diameter {gear.root_form.value:.6g} mm, its tool's rounding gives "
        f"{2e3 * bare.form_radius:.6g} mm"
    )
    return gear if beyond > FORM_TOLERANCE * bare.normal_module else dataclasses.replace(gear, root_form=None)


def with_clear_tips(gears: dict[int, Toothing], stages: Sequence[Stage], notes: Notes) -> dict[int, Toothing]:
    """Move back tips that would touch their mate below its form circle, where it has no involute.

    A tip that the file gives is left alone as long as it does not; one that it does not give keeps a clearance.
    """
    cleared = dict(gears)
    for stage in stages:
        for tip, mate in ((stage.gear, stage.pinion), (stage.pinion, stage.gear)):
            bound = _tip_bound(cleared, stage, tip)
            if bound is None:
                continue
            own = 2e3 * unchecked("", cleared[tip]).tip_radius
            notes.changed.append(
                f"{cleared[tip].part}: tip diameter {bound:g} mm instead of {own:.4f} mm, which reaches the form "
                f"circle of {cleared[mate].part} or comes too near to it"
            )
            entry = assumed(bound, f"{own:.4f} would come too near to the form circle of {cleared[mate].part}")
            cleared[tip] = dataclasses.replace(cleared[tip], tip=entry)
    return cleared


def _tip_bound(gears: Mapping[int, Toothing], stage: Stage, which: int) -> float | None:
    """Tip diameter (mm) at which a gear keeps clear of its mate's form circle; None if it does so already."""
    pinion, gear = unchecked("pinion", gears[stage.pinion]), unchecked("gear", gears[stage.gear])
    pair = UncheckedPair(name="", pinion=pinion, gear=gear, centre_distance=1e-3 * stage.distance.value)
    tip = gear if which == stage.gear else pinion
    margin = (MARGIN if gears[which].tip else fitting.ROOT_MARGIN) * tip.normal_module
    diameter = 1e3 * fitting.clear_tip_diameter(pair, tip, margin)
    if fitting.root_margin(pair, tip) >= margin:
        return None
    # Rounded to the side that clears.
    return round((math.floor if tip.outward > 0 else math.ceil)(1e4 * diameter) / 1e4, 4)
