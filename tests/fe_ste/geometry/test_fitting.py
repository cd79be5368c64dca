"""What follows from the mate: profile shifts that leave no backlash, tips that keep clear of roots and fillets."""

from __future__ import annotations

import dataclasses
import math

import pytest

from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import BasicRack, Gear, GearPair
from fe_ste.geometry.pair_relations import (
    ROOT_MARGIN,
    UncheckedPair,
    clear_tip_diameter,
    fitted_tip_diameter,
    root_margin,
    shift_beside,
    shift_sum,
)

MODULE = 4e-3


def wheel(teeth: int, **changes: object) -> Gear:
    held = 380e-3 if changes.get("internal") else 0.5 * teeth * MODULE
    given = {"name": f"z{teeth}", "teeth": teeth, "held_diameter": held, "normal_module": MODULE, "face_width": 0.02}
    return Gear(**{**given, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize("helix", [0.0, 20.0])
@pytest.mark.parametrize("internal", [False, True])
def test_a_pair_with_these_shifts_has_no_backlash(helix: float, internal: bool) -> None:
    """Two ways: shifts from the involute relation, backlash from tooth thicknesses at the working circles."""
    angle = math.radians(helix)
    pinion = wheel(23, profile_shift=0.3, helix_angle=angle)
    gear = wheel(80, internal=internal, helix_angle=angle if internal else -angle)
    distance = (28.5 if internal else 51.9) * MODULE / math.cos(angle)
    shift = shift_beside(pinion, gear, distance)
    assert shift is not None
    fitted = dataclasses.replace(gear, profile_shift=shift)
    pair = UncheckedPair(name="pair", pinion=pinion, gear=fitted, centre_distance=distance)
    assert pair.circumferential_backlash == pytest.approx(0.0, abs=1e-14)
    back = shift_beside(fitted, dataclasses.replace(pinion, profile_shift=0.0), distance)
    assert back == pytest.approx(0.3, abs=1e-12)


def test_no_shift_belongs_to_a_distance_without_a_line_of_action() -> None:
    assert shift_sum(wheel(20), wheel(40), 0.9 * 30.0 * MODULE * math.cos(math.radians(20.0))) is None


def test_a_cleared_tip_keeps_its_roll_length_above_the_fillet() -> None:
    pinion, gear = wheel(25, rack=BasicRack(1.0, 1.25, 0.25)), wheel(80)
    pair = GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=52.5 * MODULE)
    wanted = root_margin(pair, gear) + 0.2 * MODULE
    clear = dataclasses.replace(gear, tip_diameter=clear_tip_diameter(pair, gear, wanted))
    cleared = dataclasses.replace(pair, gear=clear)
    assert root_margin(cleared, clear) == pytest.approx(wanted, rel=1e-12)
    assert clear_tip_diameter(pair, gear, 0.5 * root_margin(pair, gear)) == 2.0 * gear.tip_radius


def test_tip_shortening_is_that_of_the_standard() -> None:
    """ISO 21771: k m_n = a - a_d - m_n (x1 + x2), both tips by as much, so that the rack's clearance stays."""
    pinion, gear = wheel(25, profile_shift=0.6), wheel(40)
    distance = 33.6 * MODULE
    shift = shift_beside(pinion, gear, distance)
    assert shift is not None
    gear = dataclasses.replace(gear, profile_shift=shift)
    pair = UncheckedPair(name="pair", pinion=pinion, gear=gear, centre_distance=distance)
    alteration = distance - 32.5 * MODULE - MODULE * (0.6 + shift)
    assert alteration < 0.0
    for one in (pinion, gear):
        expected = one.reference_radius + MODULE * (1.0 + one.profile_shift) + alteration
        assert fitted_tip_diameter(pair, one) == pytest.approx(2.0 * expected, rel=1e-12)
    short = [dataclasses.replace(one, tip_diameter=fitted_tip_diameter(pair, one)) for one in (pinion, gear)]
    fitted = dataclasses.replace(pair, pinion=short[0], gear=short[1])
    assert fitted.pinion_tip_clearance == pytest.approx(0.25 * MODULE, rel=1e-9)
    assert fitted.gear_tip_clearance == pytest.approx(0.25 * MODULE, rel=1e-9)


def test_a_ring_whose_tips_touch_fillets_runs_with_its_fitted_tip() -> None:
    pinion = wheel(22, rack=BasicRack(1.0, 1.25, 0.25))
    ring = wheel(61, internal=True)
    with pytest.raises(GeometryError, match="interferes with the root fillet"):
        GearPair(name="pair", pinion=pinion, gear=ring, centre_distance=19.5 * MODULE)
    loose = UncheckedPair(name="pair", pinion=pinion, gear=ring, centre_distance=19.5 * MODULE)
    fitted = dataclasses.replace(ring, tip_diameter=fitted_tip_diameter(loose, ring))
    pair = GearPair(name="pair", pinion=pinion, gear=fitted, centre_distance=19.5 * MODULE)
    assert root_margin(pair, fitted) == pytest.approx(ROOT_MARGIN * MODULE, rel=1e-9)


def test_a_fitted_ring_clears_the_fillet_of_an_undercut_planet() -> None:
    """KHK, Gear Technical Reference, planetary set 16/16/48: 92.7 mm clears by trial at a module of 2 mm, 92.6 not."""
    thin = {"tooth_thinning": 0.03 * MODULE}
    planet, ring = wheel(16, **thin), wheel(48, internal=True, **thin)
    assert planet.is_undercut
    distance = 16.0 * MODULE
    loose = UncheckedPair(name="pair", pinion=planet, gear=ring, centre_distance=distance)
    diameter = fitted_tip_diameter(loose, ring)
    assert 46.3 < diameter / MODULE < 46.35
    fitted = dataclasses.replace(ring, tip_diameter=diameter)
    GearPair(name="pair", pinion=planet, gear=fitted, centre_distance=distance)
    with pytest.raises(GeometryError, match="its corner cuts") as caught:
        GearPair(name="pair", pinion=planet, gear=ring, centre_distance=distance)
    assert f"such as {1e3 * diameter:.4f} mm" in str(caught.value)


def test_nothing_is_to_clear_above_a_relieved_root() -> None:
    pinion, gear = wheel(14), wheel(60)
    pair = GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=37.0 * MODULE)
    assert pinion.is_undercut
    assert root_margin(pair, gear) == math.inf
    assert clear_tip_diameter(pair, gear, MODULE) == 2.0 * gear.tip_radius
