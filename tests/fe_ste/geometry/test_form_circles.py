"""Where flanks end: undercut, chamfered tips, relieved roots, and the face width that mates share (ISO 21771)."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gear_relations import BasicRack, inputs_that_are_given
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.geometry.pair_relations import corner_to_fillet_gap
from fe_ste.geometry.profile import tooth_profile

WHEEL = {"normal_module": 4e-3, "face_width": 50e-3}


def wheel(teeth: int, **changes: object) -> Gear:
    return Gear(**{"name": f"z{teeth}", "teeth": teeth, "held_diameter": 0.5 * teeth * 4e-3, **WHEEL, **changes})  # type: ignore[arg-type]


# --- undercut -------------------------------------------------------------------------------------


@pytest.mark.parametrize("teeth", [12, 15, 17])
def test_undercut_begins_where_the_straight_rack_flank_reaches_the_base_tangent(teeth: int) -> None:
    """x_min = depth - z/2 sin^2 alpha with the flank straight to depth = 1.25 - 0.38 (1 - sin alpha)."""
    sine = math.sin(math.radians(20.0))
    least = 1.25 - 0.38 * (1.0 - sine) - 0.5 * teeth * sine**2
    assert wheel(teeth, profile_shift=least - 1e-6).is_undercut
    assert not wheel(teeth, profile_shift=least + 1e-6).is_undercut
    # Both ways to the limit the involute ends at the base circle, to the square root of the distance from it.
    for shift in (least - 1e-6, least + 1e-6):
        gear = wheel(teeth, profile_shift=shift)
        assert 1.0 <= gear.form_radius / gear.base_radius < 1.0 + 1e-4


def brute_force_form_radius(gear: Gear) -> float:
    """Least radius of the involute that no position of the rack's tooth cuts away, by testing them all."""
    radius = np.linspace(gear.base_radius * (1.0 + 1e-9), gear.tip_radius, 4000)
    angle = gear.half_angle(radius)
    rack, module = gear.rack, gear.normal_module
    cut = np.zeros(radius.shape, dtype=bool)
    for turn in np.linspace(-1.0, 1.0, 8001) * 4.0 * module / gear.reference_radius:
        # The rack's tooth stands above the gear, its middle at zero for turn zero; it moves with the pitch circle.
        place = angle - 0.5 * gear.angular_pitch + turn
        side = -radius * np.sin(place) + gear.reference_radius * turn
        up = radius * np.cos(place) - gear.reference_radius
        for corner in (-gear.rack_tip_half_land, gear.rack_tip_half_land):
            height = gear.root_radius + rack.tip_radius * module - gear.reference_radius
            cut |= np.hypot(side - corner, up - height) < rack.tip_radius * module - 1e-10
    return float(radius[cut].max())


@pytest.mark.sample
@pytest.mark.parametrize(("teeth", "tip_radius"), [(10, 0.38), (12, 0.25), (17, 0.25)])
def test_undercut_ends_the_involute_where_no_position_of_the_rack_cuts_it(teeth: int, tip_radius: float) -> None:
    """All positions of the rack's tip tried one by one, without the law of gearing; steps of 1/1000 of a module."""
    gear = wheel(teeth, rack=BasicRack(1.0, 1.25, tip_radius))
    assert gear.is_undercut
    step = (gear.tip_radius - gear.base_radius) / 4000
    assert gear.form_radius == pytest.approx(brute_force_form_radius(gear), abs=2.0 * step)


def test_the_fillet_of_an_undercut_tooth_starts_on_its_involute_and_enters_the_tooth() -> None:
    gear = wheel(12)
    fillet = tooth_profile(gear).fillet
    radius, angle = np.hypot(*fillet.T), np.arctan2(fillet[:, 1], fillet[:, 0])
    assert angle[0] == pytest.approx(gear.half_angle(gear.form_radius), abs=1e-12)
    above = radius > gear.base_radius * (1.0 + 1e-9)
    assert np.all(angle[above][1:] < gear.half_angle(radius[above][1:]))
    assert angle.min() < angle[0] < angle[-1]


def test_contact_ends_at_the_form_circle_of_an_undercut_pinion() -> None:
    """Rolls on the line of action: the gear's tip would reach to a sin(alpha_w) - xi_a2, below the form circle's."""
    pinion = wheel(14)
    gear = wheel(60)
    pair = GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=4e-3 * 37.0)
    reach = pair.base_tangent_length - gear.tip_roll_length
    assert reach < pinion.form_roll_length
    assert pair.path_start == pinion.form_roll_length
    assert pair.transverse_contact_ratio == pytest.approx(
        (pinion.tip_roll_length - pinion.form_roll_length) / (2.0 * math.pi * pinion.base_radius / 14), rel=1e-12
    )
    assert corner_to_fillet_gap(pair, gear, pinion) > 0.0


def test_a_tip_that_touches_a_fillet_that_is_not_undercut_is_still_refused() -> None:
    with pytest.raises(GeometryError, match="interferes with the root fillet of 'z18'"):
        GearPair(
            name="pair",
            pinion=wheel(18, rack=BasicRack(1.0, 1.25, 0.38)),
            gear=wheel(90, tip_diameter=369.6e-3),
            centre_distance=4e-3 * 54.0,
        )


# --- form circles ---------------------------------------------------------------------------------


def test_a_chamfered_tip_ends_the_path_of_contact() -> None:
    """xi = sqrt(r_Fa^2 - r_b^2) in place of the tip's, on either gear."""
    pinion, gear = wheel(25), wheel(50)
    pair = GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=150e-3)
    short = dataclasses.replace(
        pair,
        pinion=dataclasses.replace(pinion, tip_form_diameter=107e-3),
        gear=dataclasses.replace(gear, tip_form_diameter=206.5e-3),
    )
    base = [4e-3 * teeth / 2.0 * math.cos(math.radians(20.0)) for teeth in (25, 50)]
    tangent = 150e-3 * math.sin(math.radians(20.0))
    ends = math.sqrt(0.0535**2 - base[0] ** 2), tangent - math.sqrt(0.10325**2 - base[1] ** 2)
    assert (short.path_end, short.path_start) == pytest.approx(ends, rel=1e-12)
    assert short.transverse_contact_ratio < pair.transverse_contact_ratio
    assert short.pinion.tip_thickness == pair.pinion.tip_thickness  # the tooth itself reaches to its tip


def test_a_relieved_root_ends_the_path_of_contact_and_lets_tips_pass() -> None:
    pinion, gear = wheel(25, root_form_diameter=97e-3), wheel(50)
    pair = GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=150e-3)
    assert pinion.has_relieved_root
    roll = math.sqrt(0.0485**2 - (0.05 * math.cos(math.radians(20.0))) ** 2)
    assert pair.path_start == pytest.approx(roll, rel=1e-12)
    assert pair.path_start > pair.base_tangent_length - gear.tip_roll_length


def test_the_corner_of_a_chamfer_clears_a_fillet_that_a_sharp_tip_cuts() -> None:
    """The lower corner stands where a tip of that diameter has its own, the upper one as far behind as it is high."""
    pinion = wheel(17, profile_shift=0.1, rack=BasicRack(1.0, 1.4, 0.2))
    sharp = wheel(90, tip_diameter=368.5e-3)
    chamfered = dataclasses.replace(sharp, tip_form_diameter=367.0e-3)
    pairs = []
    for gear in (sharp, chamfered):
        loose = GearPair(name="p", pinion=pinion, gear=wheel(90), centre_distance=4e-3 * 53.6)
        pairs.append(corner_to_fillet_gap(dataclasses.replace(loose, gear=wheel(90)), gear, pinion))
    assert pairs[1] > pairs[0]


def test_form_circles_of_a_ring_lie_the_other_way_round() -> None:
    ring = wheel(80, internal=True, held_diameter=380e-3, tip_form_diameter=314e-3, root_form_diameter=326e-3)
    assert ring.tip_form_radius > ring.tip_radius
    assert ring.root_form_radius < ring.form_radius
    assert ring.has_relieved_root
    with pytest.raises(
        GeometryError, match="tip_form_diameter = 311.0000 mm must not be smaller than the tip diameter"
    ):
        wheel(80, internal=True, held_diameter=380e-3, tip_form_diameter=311e-3)
    with pytest.raises(GeometryError, match="lies in the root fillet: at most"):
        wheel(80, internal=True, held_diameter=380e-3, root_form_diameter=329e-3)


# --- common face ----------------------------------------------------------------------------------


def test_the_overlap_ratio_is_that_of_the_common_face() -> None:
    """eps_beta = b sin(beta) / (pi m_n)."""
    angle = math.radians(12.0)
    pinion, gear = wheel(25, helix_angle=angle), wheel(50, helix_angle=-angle, face_width=45e-3)
    pair = GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=150e-3 / math.cos(angle))
    assert pair.face_width == 45e-3
    narrow = dataclasses.replace(pair, common_face_width=40e-3)
    assert narrow.overlap_ratio == pytest.approx(40e-3 * math.sin(angle) / (math.pi * 4e-3), rel=1e-12)
    with pytest.raises(
        GeometryError, match=r"common_face_width = 46.0000 mm must be above zero and at most .* 45.0000"
    ):
        dataclasses.replace(pair, common_face_width=46e-3)


def test_inputs_that_nobody_gave_change_no_hash() -> None:
    """What files were hashed from before these inputs came: plain fields, in any order."""
    gear = wheel(25)
    before = dataclasses.asdict(gear)
    for key in ("tip_form_diameter", "root_form_diameter", "cutter"):
        del before[key]
    assert json.dumps(dataclasses.asdict(gear, dict_factory=inputs_that_are_given), sort_keys=True) == json.dumps(
        before, sort_keys=True
    )
    given = dataclasses.replace(gear, tip_form_diameter=107e-3)
    assert dataclasses.asdict(given, dict_factory=inputs_that_are_given)["tip_form_diameter"] == 107e-3
