"""Rating of gears by ISO 6336: worked example of ISO/TR 6336-30, root factors, S-N curves, Miner's rule."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fe_ste.geometry.gears import BasicRack, Gear, GearPair
from fe_ste.standards.iso6336 import mesh_stiffness
from fe_ste.standards.pitting import (
    CASE_HARDENED_BENDING,
    CASE_HARDENED_CONTACT,
    LifeCurve,
    contact_ratio_factor,
    elasticity_factor,
    helix_factor,
    lubricant_factor,
    miner_sum,
    nominal_contact_stress,
    reduced_radius,
    roughness_factor,
    safety_factor,
    velocity_factor,
    zone_factor,
)
from fe_ste.standards.tooth_root import form_and_correction, root_stress_factors

from ..cases.gears import fzg_c


def example_1() -> GearPair:
    """ISO/TR 6336-30:2017, example 1, a single helical case-carburised pair; mm and degrees.

    Its figures here are those that github.com/gfsReboucas/Drivetrain (at 4a88df3) prints beside its own.
    """
    common = {
        "normal_module": 8e-3,
        "helix_angle": math.radians(15.8),
        "face_width": 0.1,
        "held_diameter": 0.08,
        "rack": BasicRack(addendum=1.0, dedendum=1.4, tip_radius=0.39),
    }
    pinion = Gear(name="1", teeth=17, profile_shift=0.145, **common)
    wheel = Gear(name="2", teeth=103, profile_shift=0.0, **{**common, "helix_angle": -common["helix_angle"]})
    return GearPair(name="example 1", pinion=pinion, gear=wheel, centre_distance=0.5)


TANGENTIAL_FORCE, LIMIT = 127_352.0, 1500e6


@pytest.mark.parametrize(
    ("computed", "printed"),
    [
        (lambda pair: 9000.0 / pair.pinion.reference_radius, TANGENTIAL_FORCE),
        (zone_factor, 2.39533),
        (lambda pair: 1e-3 * elasticity_factor(pair), 189.812),
        (contact_ratio_factor, 0.803),
        (lambda pair: helix_factor(pair.pinion), 1.01944),
        (lambda pair: 1e-6 * nominal_contact_stress(pair, TANGENTIAL_FORCE), 1206.58),
        (lambda pair: lubricant_factor(LIMIT, 320.0), 1.04739),
        (lambda pair: velocity_factor(LIMIT, 360.0 * math.pi / 30.0 * pair.pinion.reference_radius), 0.96911),
        (lambda pair: roughness_factor(LIMIT, 6e-6, reduced_radius(pair)), 0.96599),
        (lambda pair: 1e-9 * mesh_stiffness(pair).mesh_stiffness, 17.465),
    ],
    ids=["F_t", "Z_H", "Z_E", "Z_eps", "Z_beta", "sigma_H0", "Z_L", "Z_v", "Z_R", "c_gamma_alpha"],
)
def test_the_worked_example_is_met(computed, printed):
    """Within 0.1 %: the figures have four to six digits, and the tip diameters are rounded in the example."""
    assert computed(example_1()) == pytest.approx(printed, rel=1e-3)


def test_safety_against_pitting_of_the_worked_example():
    """S_H 1.0285 and 1.0870 at 1.08e9 and 1.783e8 cycles, K_v 1.003, K_Hbeta 1.16, K_Halpha 1, Z_NT 0.910 and 0.962."""
    pair = example_1()
    stress = nominal_contact_stress(pair, TANGENTIAL_FORCE) * math.sqrt(1.003 * 1.16)
    assert 1e-6 * stress == pytest.approx(1301.35, rel=1e-3)
    velocity = 360.0 * math.pi / 30.0 * pair.pinion.reference_radius
    influences = lubricant_factor(LIMIT, 320.0) * velocity_factor(LIMIT, velocity)
    strength = LIMIT * influences * roughness_factor(LIMIT, 6e-6, reduced_radius(pair))
    cycles = 360.0 * 60.0 * 50_000.0
    for count, life, allowed, safety in (
        (cycles, 0.910, 1338.48, 1.0285),
        (cycles * 17 / 103, 0.962, 1414.53, 1.0870),
    ):
        factor = CASE_HARDENED_CONTACT.factor(count)
        assert factor == pytest.approx(life, rel=1e-3)
        assert 1e-6 * strength * factor == pytest.approx(allowed, rel=1e-3)
        found = safety_factor(CASE_HARDENED_CONTACT, np.array([stress]), strength, np.array([count]))
        assert found == pytest.approx(safety, rel=1e-3)


def test_life_curves_have_the_exponents_of_the_corrigendum():
    """ISO 6336-6:2006/Cor.1:2007, clause C.6: N = (Z / 1.6)^-13.222469 1e5 and Z^-32.60122926 5e7, and for bending."""
    for curve, need, endured in (
        (CASE_HARDENED_CONTACT, 1.3, (1.3 / 1.6) ** -13.222469 * 1e5),
        (CASE_HARDENED_CONTACT, 0.9, 0.9**-32.60122926 * 5e7),
        (CASE_HARDENED_BENDING, 1.7, (1.7 / 2.5) ** -8.73724908 * 1e3),
        (CASE_HARDENED_BENDING, 0.9, 0.9**-49.91250338 * 3e6),
    ):
        # Its exponent for bending is that of its points to four digits: cycles then differ by 2e-4.
        assert curve.endured(np.array([need]))[0] == pytest.approx(endured, rel=3e-4)
        assert curve.factor(endured) == pytest.approx(need, rel=3e-5)


def test_a_level_curve_endures_without_end_and_none_more_than_its_beginning():
    curve = LifeCurve((1e4, 1e6, 1e10), (2.0, 1.0, 1.0))
    assert curve.endured(np.array([0.99, 1.5, 2.1])) == pytest.approx(
        [math.inf, 1e4 * 100 ** (math.log(2 / 1.5, 2)), 0.0]
    )


def test_miner_adds_and_safety_scales_the_stress():
    """Two loads on one slope: the safety is the ratio of strength to the equivalent stress, in closed form."""
    slope, cycles, stress = 13.222469, np.array([2e5, 4e5]), np.array([1.2e9, 1.0e9])
    factor = safety_factor(CASE_HARDENED_CONTACT, stress, 1e9, cycles)
    equivalent = (np.sum(cycles * stress**slope) / cycles.sum()) ** (1.0 / slope)
    allowed = 1.6e9 * (1e5 / cycles.sum()) ** (1.0 / slope)
    assert factor == pytest.approx(allowed / equivalent, rel=1e-6)
    assert miner_sum(CASE_HARDENED_CONTACT, factor * stress, 1e9, cycles) == pytest.approx(1.0)


@pytest.mark.parametrize(("member", "form", "correction"), [(0, 2.634, 1.608), (1, 2.418, 1.672)])
def test_root_factors_with_the_load_at_the_tip(member, form, correction):
    """By github.com/hanslhansl/din3990 (DIN 3990-11, another code): 2.634, 1.608 and 2.418, 1.672."""
    gear = (fzg_c().pinion, fzg_c().gear)[member]
    found = form_and_correction(gear, gear.teeth, 2.0 * gear.tip_radius / gear.normal_module)
    assert found[:2] == pytest.approx((form, correction), rel=1e-3)


def test_root_factors_at_the_outer_point_of_single_contact():
    pair = fzg_c()
    found = [root_stress_factors(pair, member) for member in (0, 1)]
    assert (found[0].form, found[0].stress_correction) == pytest.approx((1.7089, 1.8394), rel=1e-3)
    assert [one.product for one in found] == pytest.approx([3.143, 3.047], rel=1e-3)
    assert found[0].helix == 1.0 and not found[0].outside_validity


def test_a_ring_without_a_cutter_has_the_fillet_of_its_rack_and_says_so():
    pair = fzg_c()
    ring = Gear(
        name="ring",
        teeth=61,
        normal_module=4.5e-3,
        face_width=14e-3,
        held_diameter=0.3,
        internal=True,
        tip_diameter=0.267,
    )
    found = root_stress_factors(GearPair(name="r", pinion=pair.pinion, gear=ring, centre_distance=100.4e-3), 1)
    assert any("no cutter" in remark for remark in found.outside_validity)
    assert 2.0 < found.product / found.rim < 4.0
