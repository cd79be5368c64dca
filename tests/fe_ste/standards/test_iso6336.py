"""ISO 6336-1 method B against hand evaluations and the table derived for the GRC gearbox."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest

from fe_ste.geometry.gears import BasicRack, Gear, GearPair, Material
from fe_ste.standards.iso6336 import mesh_stiffness

PER_WIDTH = 1e9
"""One N/(mm um) in N/m per m."""


def spur_pair(
    pinion: dict[str, Any] | None = None, wheel: dict[str, Any] | None = None, apart: float = 0.122
) -> GearPair:
    """Gears 30/50 of module 3 mm at the distance without backlash, reached from a looser one."""
    common: dict[str, Any] = {
        "normal_module": 3e-3,
        "face_width": 20e-3,
        "held_diameter": 30e-3,
        "rack": BasicRack(1.0, 1.2, 0.2),
    }
    gears = (
        Gear(**({"name": "pinion", "teeth": 30} | common | (pinion or {}))),
        Gear(**({"name": "wheel", "teeth": 50} | common | (wheel or {}))),
    )
    loose = GearPair(name="pair", pinion=gears[0], gear=gears[1], centre_distance=apart)
    return loose.with_centre_distance(loose.backlash_free_centre_distance * (1.0 + 1e-9))


def test_unshifted_spur_pair_by_hand() -> None:
    """z 30/50, x 0, h_fP 1.2: only three terms of the series and C_M remain.

    q' = 0.04723 + 0.15551/30 + 0.25791/50 = 0.04723 + 0.00518367 + 0.00515820 = 0.05757187
    c'_th = 17.36960, c' = 0.8 x 17.36960 = 13.89568
    """
    result = mesh_stiffness(spur_pair())
    assert result.theoretical_single_stiffness / PER_WIDTH == pytest.approx(17.36960, rel=1e-6)
    assert result.single_stiffness / PER_WIDTH == pytest.approx(13.89568, rel=1e-6)


def test_shifted_helical_pair_by_hand(intermediate: GearPair) -> None:
    """Pair 23/82, beta 14 deg, x 0.154/0.296, h_fP 1.46, every term of the series.

    cos(beta) = 0.97029573, sin(beta_b) = 0.24192190 x 0.93969262 = 0.22733222, cos^2(beta_b) = 0.94832006
    z_n1 = 23 / (0.94832006 x 0.97029573) = 23 / 0.92015090 = 24.995900, z_n2 = 82 / 0.92015090 = 89.115818
    q' = 0.04723 + 0.00622142 + 0.00289410 - 0.00097790 - 0.00071800 - 0.00057128 - 0.00080341
         + 0.00012546 + 0.00015946 = 0.05355984
    C_B = 1 + 0.5 (1.2 - 1.46) = 0.87
    c' = 0.8 x 0.87 x 0.97029573 / 0.05355984 = 12.60881
    """
    result = mesh_stiffness(intermediate)
    assert result.theoretical_single_stiffness / PER_WIDTH == pytest.approx(1.0 / 0.05355984, rel=1e-4)
    assert result.single_stiffness / PER_WIDTH == pytest.approx(12.60881, rel=1e-4)
    ratio = 0.75 * intermediate.transverse_contact_ratio + 0.25
    assert result.mesh_stiffness == pytest.approx(result.single_stiffness * ratio, rel=1e-14)


def test_only_the_teeth_of_an_internal_gear_are_without_end_by_hand(ring_planet: GearPair) -> None:
    """Planet 39, x 0.399, beta 7.495 deg, ring x -0.974 by the sign of ISO 21771, 1 / z_n2 = 0.

    cos(beta) = 0.99145625, sin(beta_b) = 0.13043967 x 0.93969262 = 0.12257320, cos^2(beta_b) = 0.98497581
    z_n1 = 39 / 0.97656042 = 39.936085
    q' = 0.04723 + 0.00389397 - 0.00253365 - 0.00116435 + 0.00187982 + 0.00084217 + 0.00172659 = 0.05187455
    c' = 0.8 x 0.87 x 0.99145625 / 0.05187455 = 13.30235
    """
    result = mesh_stiffness(ring_planet)
    assert result.single_stiffness / PER_WIDTH == pytest.approx(13.30235, rel=1e-5)


GRC_TABLE = {
    "sun_planet": (12.3, 17.1, 3.77),
    "ring_planet": (13.3, 19.8, 4.51),
    "intermediate": (12.6, 18.0, 3.07),
    "high_speed": (12.2, 17.5, 1.93),
}
"""c' and c_gamma in N/(mm um), mean stiffness in 1e9 N/m, as tabulated for the deep racks; rings with shift."""

GRC_TABLE_STANDARD_RACK = {"sun_planet": 4.22, "ring_planet": 5.06, "intermediate": 3.44, "high_speed": 2.21}
"""Mean stiffness in 1e9 N/m with a dedendum of 1.25, everything else the same."""


@pytest.mark.parametrize("name", GRC_TABLE)
def test_grc_stiffness_as_tabulated(name: str, request: pytest.FixtureRequest) -> None:
    single, mesh, stiffness = GRC_TABLE[name]
    result = mesh_stiffness(request.getfixturevalue(name))
    # Half a unit of the last digit, and a contact ratio rounded to two digits: 0.4 %.
    assert result.single_stiffness / PER_WIDTH == pytest.approx(single, abs=0.05)
    assert result.mesh_stiffness / PER_WIDTH == pytest.approx(mesh, abs=0.05)
    assert result.stiffness / 1e9 == pytest.approx(stiffness, abs=0.02)


@pytest.mark.parametrize("name", GRC_TABLE_STANDARD_RACK)
def test_grc_stiffness_with_a_standard_rack_as_tabulated(name: str, request: pytest.FixtureRequest) -> None:
    deep: GearPair = request.getfixturevalue(name)
    rack = BasicRack(1.0, 1.25, 0.3)
    standard = dataclasses.replace(
        deep,
        pinion=dataclasses.replace(deep.pinion, rack=rack),
        gear=dataclasses.replace(deep.gear, rack=rack),
    )
    expected = GRC_TABLE_STANDARD_RACK[name]
    assert mesh_stiffness(standard).stiffness / 1e9 == pytest.approx(expected, abs=0.02)


def test_light_load_softens_with_the_fourth_root(sun_planet: GearPair) -> None:
    """20 N/mm: (20/100)^0.25 = 0.668740; at and above 100 N/mm nothing changes."""
    heavy, light = mesh_stiffness(sun_planet), mesh_stiffness(sun_planet, tangential_force=20e3 * 0.22)
    assert light.single_stiffness / heavy.single_stiffness == pytest.approx(0.668740, rel=1e-6)
    assert light.mesh_stiffness / heavy.mesh_stiffness == pytest.approx(0.668740, rel=1e-6)
    assert mesh_stiffness(sun_planet, tangential_force=100e3 * 0.22) == heavy
    nearly = mesh_stiffness(sun_planet, tangential_force=99e3 * 0.22)
    assert nearly.single_stiffness / heavy.single_stiffness == pytest.approx(0.99**0.25, rel=1e-12)
    by_factor = mesh_stiffness(sun_planet, tangential_force=10e3 * 0.22, application_factor=2.0)
    assert by_factor.stiffness == pytest.approx(light.stiffness, rel=1e-14)


def test_softer_material_counts_by_the_harmonic_mean_of_the_moduli() -> None:
    """Steel on a material of half its modulus: 2 x 0.5 / 1.5 = 2/3."""
    soft = spur_pair(wheel={"material": Material(youngs_modulus=103e9)})
    ratio = mesh_stiffness(soft).stiffness / mesh_stiffness(spur_pair()).stiffness
    assert ratio == pytest.approx(2.0 / 3.0, rel=1e-12)


def test_rack_factor_is_the_mean_of_both_gears() -> None:
    """h_fP 1.4 on one gear only: (1 + (1 - 0.5 x 0.2)) / 2 = 0.95."""
    deep = spur_pair(wheel={"rack": BasicRack(1.0, 1.4, 0.2)})
    ratio = mesh_stiffness(deep).single_stiffness / mesh_stiffness(spur_pair()).single_stiffness
    assert ratio == pytest.approx(0.95, rel=1e-12)


def test_rack_factor_of_another_pressure_angle() -> None:
    """alpha_n 17.5 deg: 1 - 0.02 x 2.5 = 0.95; the series itself does not know the angle."""
    angle = math.radians(17.5)
    steep = spur_pair({"normal_pressure_angle": angle}, {"normal_pressure_angle": angle})
    ratio = mesh_stiffness(steep).single_stiffness / mesh_stiffness(spur_pair()).single_stiffness
    assert ratio == pytest.approx(0.95, rel=1e-12)


def test_webbed_blanks_enter_by_their_factor() -> None:
    ratio = mesh_stiffness(spur_pair(), blank_factor=0.9).stiffness / mesh_stiffness(spur_pair()).stiffness
    assert ratio == pytest.approx(0.9, rel=1e-14)


def test_stiffness_for_load_distribution_is_an_alternative_not_an_addend() -> None:
    result = mesh_stiffness(spur_pair())
    assert result.mesh_stiffness_for_load_distribution == pytest.approx(0.85 * result.mesh_stiffness, rel=1e-14)
    assert result.stiffness == pytest.approx(result.mesh_stiffness * 0.02, rel=1e-14)


def test_pair_within_validity_has_no_remark() -> None:
    assert mesh_stiffness(spur_pair(), tangential_force=500e3 * 0.02).outside_validity == ()


def test_extrapolations_are_told(sun_planet: GearPair) -> None:
    remarks = mesh_stiffness(sun_planet, tangential_force=2000e3 * 0.22).outside_validity
    assert remarks == ("x1 = 0.176 is below x2 = 0.399", "line load is above 1600 N/mm")
    short = spur_pair({"tip_diameter": 93.6e-3}, {"tip_diameter": 153.4e-3}, apart=0.12)
    assert 1.0 < short.transverse_contact_ratio < 1.2
    assert mesh_stiffness(short).outside_validity == (
        f"transverse contact ratio = {short.transverse_contact_ratio:.3f} is below 1.2",
    )
    negative = spur_pair({"profile_shift": -0.25}, {"profile_shift": -0.35}, apart=0.119)
    assert mesh_stiffness(negative).outside_validity == ("x1 + x2 = -0.6 is outside -0.5 to 2",)
    few = spur_pair({"teeth": 17, "profile_shift": 0.3}, apart=0.102)
    assert mesh_stiffness(few).outside_validity == ("virtual teeth of the pinion = 17.0 are below 18",)
    steep = spur_pair({"helix_angle": math.radians(31.0)}, {"helix_angle": math.radians(-31.0)}, apart=0.141)
    assert mesh_stiffness(steep).outside_validity == ("helix angle = 31 deg is above 30 deg",)


@pytest.mark.parametrize("key", ["tangential_force", "application_factor", "blank_factor"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_nonsensical_forces_and_factors_are_refused(key: str, value: float) -> None:
    with pytest.raises(ValueError, match=rf"{key} = {value!r} must be a finite number above zero"):
        mesh_stiffness(spur_pair(), **{key: value})
