"""What cannot be made or cannot run is refused with a clear message, and nothing else is."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import BasicRack, Gear, GearPair, Material
from fe_ste.geometry.involute import inverse_involute, involute
from fe_ste.geometry.profile import tooth_profile
from fe_ste.tools.arrays import Floats

from ..cases.gears import pair, ring, spur

# --- interference, by brute force -----------------------------------------------------------------


def corner_gap(gear: Gear, radius: Floats, angle: Floats) -> Floats:
    """Arc from points to the nearest tooth of a gear, one tooth on the +x axis, fillets and root included.

    Negative inside a tooth; infinite beyond the tip, where there is no material.
    """
    away = np.abs((angle + 0.5 * gear.angular_pitch) % gear.angular_pitch - 0.5 * gear.angular_pitch)
    fillet = tooth_profile(gear).fillet
    fillet_radius, fillet_angle = np.hypot(*fillet.T), np.arctan2(fillet[:, 1], fillet[:, 0])
    order = slice(None, None, -gear.outward)
    on_fillet = np.interp(radius, fillet_radius[order], fillet_angle[order])
    above_form = gear.outward * (radius - gear.form_radius) > 0.0
    half = np.where(above_form, gear.half_angle(np.maximum(radius, gear.base_radius)), on_fillet)
    gap = np.where(gear.outward * (radius - gear.root_radius) < 0.0, -np.inf, radius * (away - half))
    return np.where(gear.outward * (radius - gear.tip_radius) > 0.0, np.inf, gap)


def least_tip_gap(pinion: Gear, gear: Gear, centre_distance: float) -> float:
    """Least gap between the tip corners of either gear and the teeth of the other over a turn, m.

    The driving flanks touch as on the path of contact. Knows neither roll lengths nor form circles.
    """
    outward, ratio = gear.outward, gear.teeth / pinion.teeth
    working_radius = centre_distance / (ratio + outward)
    rotation = np.linspace(-math.pi, math.pi, 20001)
    # Pinion axis at the origin, gear axis on the x axis; mating flanks stand on it at rotation zero.
    pinion_tooth = rotation - pinion.half_angle(working_radius)
    gear_tooth = gear.half_angle(ratio * working_radius) + rotation / ratio
    gear_tooth = math.pi - gear_tooth if outward > 0 else gear_tooth
    gaps = []
    for tip, tooth, mate, mate_tooth, shift in (
        (pinion, pinion_tooth, gear, gear_tooth, -outward * centre_distance),
        (gear, gear_tooth, pinion, pinion_tooth, outward * centre_distance),
    ):
        for side in (-1.0, 1.0):
            angle = tooth + side * tip.half_angle(tip.tip_radius)
            x, y = tip.tip_radius * np.cos(angle) + shift, tip.tip_radius * np.sin(angle)
            gaps.append(corner_gap(mate, np.hypot(x, y), np.arctan2(y, x) - mate_tooth).min())
    return float(min(gaps))


def refusal(pinion: Gear, gear: Gear, centre_distance: float) -> str | None:
    """Message with which a pair is refused, None if it is accepted."""
    try:
        pair(pinion, gear, centre_distance)
    except GeometryError as error:
        return str(error)
    return None


FILLET_POLYGON = 1e-7
"""Error of the fillet as a polygon of 200 sides, m: it lies inside the material by less."""


def test_grc_tips_clear_their_mates(any_grc_pair: GearPair) -> None:
    both = any_grc_pair
    assert least_tip_gap(both.pinion, both.gear, both.centre_distance) > -FILLET_POLYGON


@pytest.mark.validation
def test_accepted_external_pairs_run_free_and_interfering_ones_collide() -> None:
    random = np.random.default_rng(1)
    verdicts = {"accepted": 0, "interferes": 0}
    for _ in range(150):
        teeth = sorted(random.integers(14, 70, 2))
        shifts = random.uniform(-0.1, 0.6, 2)
        rack = BasicRack(addendum=float(random.uniform(0.9, 1.25)), dedendum=1.3, tip_radius=0.38)
        try:
            pinion, gear = (
                spur(teeth=int(z), profile_shift=float(x), rack=rack, held_diameter=10e-3)
                for z, x in zip(teeth, shifts, strict=True)
            )
        except GeometryError:
            continue
        free = pinion.normal_module * (sum(teeth) / 2.0 + sum(shifts))
        message = refusal(pinion, gear, free)
        if message is None:
            verdicts["accepted"] += 1
            assert least_tip_gap(pinion, gear, free) > -FILLET_POLYGON
        elif "interferes" in message:
            verdicts["interferes"] += 1
            # A tip that reaches just below the form circle touches the fillet by less than the polygon shows.
            assert least_tip_gap(pinion, gear, free) < FILLET_POLYGON
    assert min(verdicts.values()) > 10, verdicts


@pytest.mark.sample
@pytest.mark.parametrize("addendum", [0.8, 0.9, 1.0])
@pytest.mark.parametrize("teeth", [28, 40])
def test_accepted_internal_pairs_run_free_and_tips_of_too_close_teeth_collide(addendum: float, teeth: int) -> None:
    rack = BasicRack(addendum=addendum, dedendum=1.25, tip_radius=0.2)
    pinion = spur(teeth=teeth, profile_shift=0.6, rack=rack, held_diameter=10e-3)
    verdicts = []
    for ring_teeth in range(teeth + 2, teeth + 20):
        gear = ring(teeth=ring_teeth, profile_shift=0.75, rack=rack, held_diameter=0.4)
        distance = tight_internal_distance(pinion, gear)
        message = refusal(pinion, gear, distance)
        if message is None:
            verdicts.append("accepted")
            assert least_tip_gap(pinion, gear, distance) > -FILLET_POLYGON
        else:
            verdicts.append("refused: difference in teeth too small")
            assert "difference in teeth" in message
            assert least_tip_gap(pinion, gear, distance) < 0.0
    assert len(set(verdicts)) == 2
    assert verdicts == sorted(verdicts, reverse=True)


def tight_internal_distance(pinion: Gear, gear: Gear) -> float:
    """Centre distance of an internal pair a hair below that without backlash."""
    angle, difference = pinion.transverse_pressure_angle, gear.teeth - pinion.teeth
    shift = 2.0 * (gear.profile_shift - pinion.profile_shift) * math.tan(pinion.normal_pressure_angle)
    working = inverse_involute(involute(angle) + shift / difference)
    return 0.5 * difference * pinion.transverse_module * math.cos(angle) / math.cos(working) * (1.0 - 1e-9)


# --- refusals -------------------------------------------------------------------------------------

REFUSED_GEARS: dict[str, tuple[dict[str, Any], str]] = {
    "no torque": ({"teeth": 0}, r"gear 'wheel': teeth = 0 must be a whole number of at least 5"),
    "negative teeth": ({"teeth": -20}, r"teeth = -20 must be a whole number"),
    "half a tooth": ({"teeth": 20.5}, r"teeth = 20\.5 must be a whole number"),
    "teeth as a truth value": ({"teeth": True}, r"teeth = True must be a whole number"),
    "no module": ({"normal_module": 0.0}, r"normal_module = 0\.0 must be a finite number above zero"),
    "module not a number": ({"normal_module": math.nan}, r"normal_module = nan must be"),
    "infinite module": ({"normal_module": math.inf}, r"normal_module = inf must be"),
    "module as text": ({"normal_module": "3 mm"}, r"normal_module = '3 mm' must be"),
    "negative width": ({"face_width": -20e-3}, r"face_width = -0\.02 must be"),
    "no hub": ({"held_diameter": 0.0}, r"held_diameter = 0\.0 must be"),
    "hub as wide as the root": (
        {"held_diameter": 142.5e-3},
        r"held_diameter = 142\.5000 mm must lie below the root",
    ),
    "negative tip diameter": ({"tip_diameter": -1.0}, r"tip_diameter = -1\.0 must be"),
    "root diameter not a number": ({"root_diameter": math.nan}, r"root_diameter = nan must be"),
    "pressure angle in degrees": (
        {"normal_pressure_angle": 20.0},
        r"normal_pressure_angle = 20\.0 rad must lie between 10\.0000 deg and 35\.0000 deg",
    ),
    "pressure angle not a number": ({"normal_pressure_angle": math.nan}, r"normal_pressure_angle = nan"),
    "helix angle in degrees": (
        {"helix_angle": 7.5},
        r"helix_angle = 7\.5 rad must lie within \+-50\.0000 deg",
    ),
    "helix angle not a number": ({"helix_angle": math.nan}, r"helix_angle = nan"),
    "profile shift not a number": (
        {"profile_shift": math.nan},
        r"profile_shift = nan must be a finite number",
    ),
    "negative thinning": ({"tooth_thinning": -1e-6}, r"tooth_thinning = -1e-06 must be .* zero or above"),
    "thinned away": ({"tooth_thinning": 5e-3}, r"tooth_thinning = 5\.0000 mm leaves no tooth at"),
    "shifted until the space is gone": (
        {"profile_shift": 2.2},
        r"profile_shift = 2\.2 .* leaves no tooth space",
    ),
    "negative tool radius": ({"rack": BasicRack(tip_radius=-0.1)}, r"rack\.tip_radius = -0\.1 must be"),
    "no addendum": ({"rack": BasicRack(addendum=0.0)}, r"rack\.addendum = 0\.0 must be"),
    "no dedendum": ({"rack": BasicRack(dedendum=0.0)}, r"rack\.dedendum = 0\.0 must be"),
    "tool radius too large": (
        {"rack": BasicRack(tip_radius=0.5)},
        r"rack\.tip_radius = 0\.5 does not fit on the rack at a dedendum of 1\.2500: at most 0\.4719",
    ),
    "pointed tool": (
        {"rack": BasicRack(dedendum=2.3)},
        r"rack\.dedendum = 2\.3000 makes the generating rack pointed",
    ),
    "no elasticity": ({"material": Material(youngs_modulus=0.0)}, r"material\.youngs_modulus = 0\.0 must be"),
    "incompressible": (
        {"material": Material(poissons_ratio=0.5)},
        r"material\.poissons_ratio = 0\.5 must be",
    ),
    "weightless": ({"material": Material(density=-1.0)}, r"material\.density = -1\.0 must be"),
    "tip inside the root": (
        {"tip_diameter": 140e-3},
        r"tip_diameter = 140\.0000 mm must lie above the root diameter of 142\.5000 mm",
    ),
    "tip inside the form circle": (
        {"tip_diameter": 144e-3},
        r"tip_diameter = 144\.0000 mm leaves no involute",
    ),
    "undercut to a thin neck": (
        {"teeth": 8, "held_diameter": 5e-3, "profile_shift": -0.9},
        # x_min = 1 - 8 sin^2(20 deg) / 2 with the straight rack flank 0.99997 deep: 0.5321
        r"profile_shift = -0\.9 undercuts the tooth to a neck 0\.\d+ normal modules thick: at least 0\.2 is needed; "
        r"without undercut it is 0\.532\d",
    ),
    "flank that ends beyond its tip": (
        {"tip_form_diameter": 157e-3},
        r"tip_form_diameter = 157\.0000 mm must not be larger than the tip diameter of 156\.0000 mm",
    ),
    "flank that begins in its fillet": (
        {"root_form_diameter": 144e-3},
        r"root_form_diameter = 144\.0000 mm lies in the root fillet: at least 144\.9406 mm",
    ),
    "no flank between form circles": (
        {"tip_form_diameter": 150e-3, "root_form_diameter": 151e-3},
        r"tip_form_diameter = 150\.0000 mm leaves no flank: it must lie above the root form diameter of 151\.0000 mm",
    ),
    "pointed tooth": (
        {"teeth": 12, "profile_shift": 0.75, "held_diameter": 10e-3},
        r"profile_shift = 0\.75 leaves a tip 0\.\d+ normal modules thick: at least 0\.1 is needed",
    ),
}


REFUSED_RINGS: dict[str, tuple[dict[str, Any], str]] = {
    "rim inside the root": (
        {"held_diameter": 0.3},
        r"gear 'ring': held_diameter = 300\.0000 mm must lie above",
    ),
    "tip outside the root": (
        {"tip_diameter": 310e-3},
        r"tip_diameter = 310\.0000 mm must lie below the root diameter of 304\.5000 mm",
    ),
    "tip without involute": (
        {"tip_diameter": 270e-3},
        r"tip_diameter = 270\.0000 mm lies inside the base circle, .* above 279\.0887 mm",
    ),
    "closed space": ({"root_diameter": 320e-3}, r"root_diameter = 320\.0000 mm lies beyond the point where"),
    "fillet as high as the tooth": (
        {"rack": BasicRack(tip_radius=2.5)},
        r"rack\.tip_radius = 2\.5 leaves no involute",
    ),
    "pointed tooth": (
        {"profile_shift": 1.2, "tip_diameter": 281e-3},
        r"tip_diameter = 281\.0000 mm .* leaves a tip -?0\.\d+ normal modules thick: .* by a larger "
        r"tip_diameter",
    ),
}


@pytest.mark.parametrize(
    "make, changes, message",
    [*((spur, *row) for row in REFUSED_GEARS.values()), *((ring, *row) for row in REFUSED_RINGS.values())],
    ids=[*REFUSED_GEARS, *(f"ring: {name}" for name in REFUSED_RINGS)],
)
def test_gear_that_cannot_be_made_is_refused(make: Callable[..., Gear], changes: dict[str, Any], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        make(**changes)


LEFT, RIGHT = math.radians(-10.0), math.radians(10.0)
PINION = {"name": "pinion", "teeth": 30, "held_diameter": 30e-3}

REFUSED_PAIRS: dict[str, tuple[Gear, Gear, float, str]] = {
    "internal pinion": (ring(), spur(), 0.12, r"pair 'pair': pinion = 'ring' is an internal gear"),
    "pinion the larger": (spur(), spur(**PINION), 0.12, r"teeth of 'pinion' = 30 must be at least 50"),
    "ring no larger than its pinion": (
        spur(teeth=99),
        ring(),
        0.1,
        r"teeth of 'ring' = 99 must be at least 100",
    ),
    "modules": (
        spur(),
        spur(name="other", normal_module=4e-3, held_diameter=0.1),
        0.18,
        r"normal_module of 'other' = 4\.0000 mm must equal that of 'wheel', 3\.0000 mm",
    ),
    "pressure angles": (
        spur(),
        spur(name="other", normal_pressure_angle=math.radians(25.0), rack=BasicRack(tip_radius=0.2)),
        0.15,
        r"normal_pressure_angle of 'other' = 25\.0000 deg must equal that of 'wheel', 20\.0000 deg",
    ),
    "equal hands outside": (
        spur(helix_angle=RIGHT),
        spur(name="other", helix_angle=RIGHT),
        0.153,
        r"helix_angle of 'other' = 10\.0000 deg does not mate .* external pair needs the opposite "
        r"hand, -10\.0000 deg",
    ),
    "opposite hands inside": (
        spur(helix_angle=RIGHT),
        ring(helix_angle=LEFT),
        0.0746,
        r"helix_angle of 'ring' = -10\.0000 deg does not mate .* internal pair needs the same hand, "
        r"10\.0000 deg",
    ),
    "helical with spur": (
        spur(helix_angle=RIGHT),
        spur(name="other"),
        0.15,
        r"helix_angle of 'other' = 0\.0000 deg",
    ),
    "negative distance": (
        spur(),
        spur(),
        -0.15,
        r"centre_distance = -0\.15 must be a finite number above zero",
    ),
    "distance not a number": (spur(), spur(), math.nan, r"centre_distance = nan must be"),
    "distance below the base circles": (
        spur(),
        spur(),
        0.14,
        r"centre_distance = 140\.0000 mm is too small: no line of action .* below 140\.9539 mm",
    ),
    "overlapping flanks": (
        spur(),
        spur(),
        0.1495,
        # 2 x 0.5 mm x tan(19.7 deg) = 0.358 mm, at the mean of the pressure angles at both distances.
        r"centre_distance = 149\.5000 mm is too small: the flanks would overlap by 0\.358\d mm; at "
        r"least 150\.0000",
    ),
    "overlapping flanks inside": (
        spur(),
        ring(),
        0.0737,
        r"centre_distance = 73\.7000 mm is too large: the flanks would overlap by 0\.1\d\d\d mm; at "
        r"most 73\.5000 mm",
    ),
    "no room in the ring": (
        spur(teeth=90, profile_shift=0.5),
        ring(profile_shift=0.1),
        0.0135,
        r"profile_shift of 'ring' = 0\.1 leaves no room for the teeth of 'wheel' at any centre distance",
    ),
    "no contact": (
        spur(),
        spur(),
        0.1535,
        r"transverse contact ratio = 0\.\d+ must be at least 1: contact is interrupted at",
    ),
    "helical teeth without overlap enough": (
        spur(tip_diameter=154e-3, helix_angle=RIGHT, face_width=5e-3),
        spur(name="other", tip_diameter=154e-3, helix_angle=LEFT, face_width=5e-3),
        0.15232,
        r"total contact ratio = 0\.\d+ \(0\.\d+ \+ 0\.09\d+\) must be at least 1: contact is interrupted at",
    ),
    "tips that do not reach each other": (
        spur(),
        spur(),
        0.158,
        r"transverse contact ratio = -0\.\d+ must be above zero: no contact at centre_distance = 158\.0000 mm",
    ),
    "short teeth without contact": (
        spur(tip_diameter=152e-3),
        spur(tip_diameter=152e-3),
        0.15,
        r"transverse contact ratio = 0\.\d+ must be at least 1",
    ),
    "tip in the root": (
        spur(),
        spur(name="long", tip_diameter=158e-3),
        0.15,
        r"tip_diameter of 'long' = 158\.0000 mm runs 0\.2500 mm into the root of 'wheel': below "
        r"157\.5000 mm needed",
    ),
    "tip in the root of the ring": (
        spur(tip_diameter=158.4e-3),
        ring(root_diameter=305e-3),
        0.0735,
        r"tip_diameter of 'wheel' = 158\.4000 mm runs 0\.2000 mm into the root of 'ring': below "
        r"158\.0000 mm needed",
    ),
    "ring tip in the pinion root": (
        spur(),
        ring(tip_diameter=289.4e-3, rack=BasicRack(tip_radius=0.2)),
        0.0735,
        r"tip_diameter of 'ring' = 289\.4000 mm runs 0\.0500 mm into the root of 'wheel': above "
        r"289\.5000 mm needed",
    ),
    "long tip in the fillet": (
        spur(teeth=20, held_diameter=10e-3),
        spur(name="long", teeth=70, tip_diameter=217.2e-3),
        0.135,
        r"tip_diameter of 'long' = 217\.2000 mm interferes with the root fillet of 'wheel', .*: at "
        r"most 21\d\.\d+ mm",
    ),
    "pinion tip in the fillet of the ring": (
        spur(tip_diameter=157.4e-3),
        ring(tip_diameter=292e-3),
        0.0735,
        r"tip_diameter of 'wheel' = 157\.4000 mm interferes with the root fillet of 'ring'.*: at most "
        r"15\d\.\d+ mm",
    ),
    "ring tip in the fillet of the pinion": (
        spur(teeth=20, held_diameter=10e-3),
        ring(teeth=60, held_diameter=0.3, profile_shift=0.0),
        0.06,
        r"tip_diameter of 'ring' = 174\.0000 mm interferes with the root fillet of 'wheel'.*: at "
        r"least 17\d\.\d+ mm",
    ),
}


@pytest.mark.parametrize("pinion, gear, distance, message", REFUSED_PAIRS.values(), ids=REFUSED_PAIRS)
def test_pair_that_cannot_run_is_refused(pinion: Gear, gear: Gear, distance: float, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        pair(pinion, gear, distance)


def test_corner_that_cuts_the_fillet_outside_the_path_of_contact_is_refused() -> None:
    """The path of contact stays clear of both form circles by 0.06 mm, the corner does not."""
    rack = BasicRack(addendum=1.2314520591574916, dedendum=1.3, tip_radius=0.38)
    pinion, gear = (
        spur(name=name, teeth=teeth, profile_shift=shift, rack=rack)
        for name, teeth, shift in (("small", 46, 0.075), ("large", 48, 0.1795))
    )
    message = r"tip_diameter of '\w+' = .* interferes with the root fillet of '\w+', its corner cuts 0\.0\d+ mm"
    with pytest.raises(GeometryError, match=message):
        pair(pinion, gear, 3e-3 * (47.0 + 0.075 + 0.1795))


def test_difference_in_teeth_too_small_is_refused() -> None:
    rack = BasicRack(addendum=0.9, dedendum=1.25, tip_radius=0.2)
    pinion = spur(teeth=40, profile_shift=0.6, rack=rack)
    gear = ring(teeth=43, profile_shift=0.75, rack=rack)
    message = r"difference in teeth = 3 is too small: .* tips of 'wheel' and 'ring' collide"
    with pytest.raises(GeometryError, match=message):
        pair(pinion, gear, tight_internal_distance(pinion, gear))


def test_pinion_that_swallows_the_tip_circle_of_the_ring_is_refused() -> None:
    """55/56 teeth, where the tip circles do not even cross: 28.84 mm is above 27.16 mm + 0.53 mm."""
    rack = BasicRack(addendum=0.967, dedendum=1.17, tip_radius=0.245)
    module = {"normal_module": 1e-3, "rack": rack}
    pinion = spur(teeth=55, profile_shift=0.78, held_diameter=20e-3, **module)
    gear = ring(teeth=56, profile_shift=1.22, held_diameter=80e-3, **module)
    distance = 0.533e-3
    assert pinion.tip_radius > gear.tip_radius + distance
    with pytest.raises(GeometryError, match=r"difference in teeth = 1 is too small"):
        pair(pinion, gear, distance)


@pytest.mark.parametrize("name", [name for name in REFUSED_PAIRS if "fillet" in name])
def test_tip_diameter_named_against_interference_touches_the_form_circle(name: str) -> None:
    pinion, gear, distance, _ = REFUSED_PAIRS[name]
    message = str(refusal(pinion, gear, distance))
    named = 1e-3 * float(message.split("mm is needed")[0].split()[-1])
    if "tip_diameter of 'wheel'" in message:
        pinion = dataclasses.replace(pinion, tip_diameter=named - 1e-6)
    else:
        gear = dataclasses.replace(gear, tip_diameter=named - gear.outward * 1e-6)
    assert "which begins at the form diameter" in message
    # Clear of the form circle on the path of contact; the corner may still cut the fillet beside it.
    assert "which begins at the form diameter" not in str(refusal(pinion, gear, distance))


def test_distances_named_in_refusals_are_accepted(any_grc_pair: GearPair) -> None:
    """The least (internal: greatest) centre distance is right up to the digits printed."""
    limit = any_grc_pair.backlash_free_centre_distance
    step = 1e-7 * any_grc_pair.gear.outward
    assert any_grc_pair.with_centre_distance(limit + step).circumferential_backlash > 0.0
    with pytest.raises(GeometryError, match="would overlap"):
        any_grc_pair.with_centre_distance(limit - step)


def test_one_missing_digit_of_the_helix_is_refused(sun_planet: GearPair) -> None:
    tilted = dataclasses.replace(sun_planet.gear, helix_angle=math.radians(-7.5))
    with pytest.raises(GeometryError, match=r"helix_angle of 'planet' = -7\.5000 deg does not mate with 7\.4950 deg"):
        dataclasses.replace(sun_planet, gear=tilted)
