"""Flank modifications: closed forms of each, sums, and refusals."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from fe_ste.flanks import (
    FlankModification,
    Relief,
    ReliefShape,
    radius_at_roll_length_from_root,
    radius_at_roll_length_from_tip,
)
from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Floats

MICRON = 1e-6

ROUNDING = 1e-18
"""1e-12 um, far below any amount in these tests."""


def flank_radii(gear: Gear, fraction: Floats) -> Floats:
    """Radii at fractions of the roll length from form (0) to tip circle (1)."""
    roll_length = gear.form_roll_length + fraction * (gear.tip_roll_length - gear.form_roll_length)
    return np.hypot(gear.base_radius, roll_length)


def test_unmodified_flank_has_no_gap(any_grc_gear: Gear) -> None:
    radius = flank_radii(any_grc_gear, np.linspace(0.0, 1.0, 5))
    np.testing.assert_array_equal(FlankModification().gap(any_grc_gear, radius, np.zeros(5)), 0.0)


@pytest.mark.parametrize("shape, exponent", [(ReliefShape.LINEAR, 1), (ReliefShape.PARABOLIC, 2)])
def test_tip_relief_grows_from_its_start_to_the_tip_in_roll_length(
    any_grc_gear: Gear, shape: ReliefShape, exponent: int
) -> None:
    gear, length = any_grc_gear, 0.6 * any_grc_gear.normal_module
    start = radius_at_roll_length_from_tip(gear, length)
    modification = FlankModification(tip_relief=Relief(40 * MICRON, start, shape))
    part = np.array([-0.5, 0.0, 0.25, 0.5, 1.0])
    roll_length = gear.tip_roll_length - gear.outward * (1.0 - part) * length
    gap = modification.gap(gear, np.hypot(gear.base_radius, roll_length), np.zeros(5))
    expected = 40 * MICRON * np.array([0.0, 0.0, 0.25**exponent, 0.5**exponent, 1.0])
    # Roll lengths of tenths of a metre are rounded to 1e-16 m of 6 mm of relief.
    np.testing.assert_allclose(gap, expected, rtol=1e-10, atol=1e-12 * MICRON)


@pytest.mark.parametrize("shape, exponent", [(ReliefShape.LINEAR, 1), (ReliefShape.PARABOLIC, 2)])
def test_root_relief_grows_from_its_start_to_the_form_circle(
    any_grc_gear: Gear, shape: ReliefShape, exponent: int
) -> None:
    gear, length = any_grc_gear, 0.3 * any_grc_gear.normal_module
    start = radius_at_roll_length_from_root(gear, length)
    modification = FlankModification(root_relief=Relief(25 * MICRON, start, shape))
    roll_length = gear.form_roll_length + gear.outward * np.array([0.0, 0.5, 1.0, 2.0]) * length
    gap = modification.gap(gear, np.hypot(gear.base_radius, roll_length), np.zeros(4))
    expected = 25 * MICRON * np.array([1.0, 0.5**exponent, 0.0, 0.0])
    np.testing.assert_allclose(gap, expected, rtol=1e-10, atol=1e-10 * MICRON)


def test_profile_crowning_is_a_parabola_over_the_roll_length(any_grc_gear: Gear) -> None:
    fraction = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    modification = FlankModification(profile_crowning=8 * MICRON)
    gap = modification.gap(any_grc_gear, flank_radii(any_grc_gear, fraction), np.zeros(5))
    np.testing.assert_allclose(gap, 8 * MICRON * np.array([1.0, 0.25, 0.0, 0.25, 1.0]), atol=1e-10 * MICRON)


def test_lead_crowning_is_a_parabola_over_the_face_width(any_grc_gear: Gear) -> None:
    z = any_grc_gear.face_width * np.array([-0.5, -0.25, 0.0, 0.25, 0.5])
    modification = FlankModification(lead_crowning=12 * MICRON)
    gap = modification.gap(any_grc_gear, np.full(5, any_grc_gear.reference_radius), z)
    np.testing.assert_allclose(gap, 12 * MICRON * np.array([1.0, 0.25, 0.0, 0.25, 1.0]), atol=ROUNDING)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_helix_slope_opens_the_end_that_its_sign_names(any_grc_gear: Gear, sign: float) -> None:
    z = any_grc_gear.face_width * np.array([-0.5, 0.0, 0.5])
    modification = FlankModification(helix_slope=sign * 10 * MICRON)
    gap = modification.gap(any_grc_gear, np.full(3, any_grc_gear.reference_radius), z)
    expected = 10 * MICRON * np.array([0.0, 0.5, 1.0])[:: int(sign)]
    np.testing.assert_allclose(gap, expected, atol=ROUNDING)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_profile_slope_opens_the_end_that_its_sign_names(any_grc_gear: Gear, sign: float) -> None:
    radius = flank_radii(any_grc_gear, np.array([0.0, 0.5, 1.0]))
    modification = FlankModification(profile_slope=sign * 6 * MICRON)
    gap = modification.gap(any_grc_gear, radius, np.zeros(3))
    expected = 6 * MICRON * np.array([0.0, 0.5, 1.0])[:: int(sign)]
    np.testing.assert_allclose(gap, expected, atol=1e-10 * MICRON)


def test_slopes_stay_at_zero_beyond_their_end(any_grc_gear: Gear) -> None:
    """The mate may be wider: points beyond this gear's face must not gain material."""
    z = any_grc_gear.face_width * np.array([-0.6, 0.6])
    modification = FlankModification(helix_slope=10 * MICRON)
    gap = modification.gap(any_grc_gear, np.full(2, any_grc_gear.reference_radius), z)
    np.testing.assert_array_equal(gap, [0.0, 10 * MICRON])


def full_modification(gear: Gear) -> FlankModification:
    length = 0.5 * gear.normal_module
    return FlankModification(
        tip_relief=Relief(40 * MICRON, radius_at_roll_length_from_tip(gear, length)),
        root_relief=Relief(20 * MICRON, radius_at_roll_length_from_root(gear, length), ReliefShape.PARABOLIC),
        profile_crowning=5 * MICRON,
        lead_crowning=15 * MICRON,
        profile_slope=-3 * MICRON,
        helix_slope=7 * MICRON,
    )


def test_modifications_add_up_and_never_add_material(any_grc_gear: Gear) -> None:
    gear = any_grc_gear
    radius = flank_radii(gear, np.linspace(0.0, 1.0, 21))[:, None]
    z = gear.face_width * np.linspace(-0.5, 0.5, 11)
    whole = full_modification(gear)
    gap = whole.gap(gear, radius, z)
    assert gap.shape == (21, 11)
    assert np.all(gap >= 0.0)
    parts = (FlankModification(**{field.name: getattr(whole, field.name)}) for field in dataclasses.fields(whole))
    np.testing.assert_allclose(gap, sum(part.gap(gear, radius, z) for part in parts), atol=ROUNDING)


def test_relief_that_is_linear_in_roll_length_is_linear_along_the_path_of_contact(
    sun_planet: GearPair,
) -> None:
    pair = sun_planet
    start = radius_at_roll_length_from_tip(pair.pinion, 8e-3)
    modification = FlankModification(tip_relief=Relief(52 * MICRON, start))
    xi = np.linspace(pair.path_end - 8e-3, pair.path_end, 9)
    gap = modification.gap(pair.pinion, np.hypot(pair.pinion.base_radius, xi), np.zeros(9))
    np.testing.assert_allclose(gap, np.linspace(0.0, 52 * MICRON, 9), rtol=1e-10, atol=1e-10 * MICRON)


@pytest.mark.parametrize("key", ["profile_crowning", "lead_crowning"])
@pytest.mark.parametrize("amount", [-1e-6, math.nan, math.inf])
def test_crowning_that_would_add_material_is_refused(key: str, amount: float) -> None:
    with pytest.raises(GeometryError, match=rf"{key} = {amount!r} m must be finite and not negative"):
        FlankModification(**{key: amount})


def test_twist_is_a_helix_slope_that_turns_over_along_the_profile(any_grc_gear: Gear) -> None:
    gear = any_grc_gear
    form, middle, tip = flank_radii(gear, np.array([0.0, 0.5, 1.0]))
    low, high = -gear.face_width / 2, gear.face_width / 2
    twist = FlankModification(twist=6 * MICRON)
    corners = [float(twist.gap(gear, np.array(r), np.array(z))) for r, z in ((tip, high), (form, low))]
    assert corners == pytest.approx([6 * MICRON] * 2, rel=1e-12)
    others = [float(twist.gap(gear, np.array(r), np.array(z))) for r, z in ((tip, low), (form, high))]
    assert others == pytest.approx([0.0, 0.0], abs=ROUNDING)
    assert twist.gap(gear, np.array([middle] * 3), np.array([low, 0.0, high])) == pytest.approx([3 * MICRON] * 3)
    reverse = FlankModification(twist=-6 * MICRON)
    assert float(reverse.gap(gear, np.array(tip), np.array(low))) == pytest.approx(6 * MICRON, rel=1e-12)


def test_mirrored_modification_is_itself_seen_from_the_other_end(any_grc_gear: Gear) -> None:
    gear = any_grc_gear
    radius = flank_radii(gear, np.linspace(0.0, 1.0, 5))[:, None]
    z = gear.face_width * np.linspace(-0.5, 0.5, 7)
    whole = full_modification(gear)
    np.testing.assert_allclose(whole.mirrored().gap(gear, radius, z), whole.gap(gear, radius, -z), atol=ROUNDING)


@pytest.mark.parametrize("key", ["profile_slope", "helix_slope", "twist"])
def test_slopes_may_be_negative_but_not_nonsense(key: str) -> None:
    FlankModification(**{key: -1e-6})
    with pytest.raises(GeometryError, match=rf"{key} = nan"):
        FlankModification(**{key: math.nan})


def test_negative_relief_is_refused() -> None:
    with pytest.raises(GeometryError, match=r"relief amount = -1e-06 m must be finite and not negative"):
        Relief(-1e-6, 0.1)


def test_unknown_shape_of_relief_is_refused_and_known_ones_may_be_text() -> None:
    known: Any = "parabolic"
    unknown: Any = "cubic"
    assert Relief(1e-6, 0.1, known) == Relief(1e-6, 0.1, ReliefShape.PARABOLIC)
    with pytest.raises(GeometryError, match=r"relief shape = 'cubic' must be one of 'linear', 'parabolic'"):
        Relief(1e-6, 0.1, unknown)


@pytest.mark.parametrize("start_mm", [math.nan, 100.0, 220.0])
@pytest.mark.parametrize("key", ["tip_relief", "root_relief"])
def test_relief_that_starts_off_the_involute_is_refused(sun_planet: GearPair, key: str, start_mm: float) -> None:
    modification = FlankModification(**{key: Relief(10 * MICRON, 1e-3 * start_mm)})
    message = rf"gear 'planet': {key}\.start_radius = {start_mm:.4f} mm must lie on the involute, between 189\.77"
    with pytest.raises(GeometryError, match=message):
        modification.gap(sun_planet.gear, np.array([0.2]), np.zeros(1))
