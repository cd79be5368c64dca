"""Frictional moment of SKF: by hand, against its constant coefficients, and the series of designations."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.sections.connections import CatalogueSection
from exugear.gearbox.units import RPM
from exugear.system.bearings.rolling.friction import (
    REPLENISHMENT,
    friction_constants,
    friction_series,
    frictional_moment,
)
from exugear.system.gearbox_checks import check_parts

CONSTANT = {
    "deep_groove_ball": 0.0015,
    "angular_contact_ball": 0.0020,
    "four_point_ball": 0.0024,
    "self_aligning_ball": 0.0010,
    "cylindrical_roller": 0.0011,
    "tapered_roller": 0.0018,
    "spherical_roller": 0.0018,
}
"""Coefficients of friction M = mu P d / 2 for a load near a tenth of the rating (SKF, Rolling bearings, table 1)."""


def bearing(kind: str, designation: str = "", **keys: object) -> CatalogueSection:
    sizes = {"bore_mm": 100.0, "outer_diameter_mm": 180.0, "width_mm": 34.0}
    return CatalogueSection.model_validate({"type": kind, "designation": designation, **sizes, **keys})


def test_a_cylindrical_roller_bearing_by_hand() -> None:
    """NU 218 with 22 kN at 2980 rpm in oil of 20 mm2/s: each factor of the formulas of the catalogue."""
    section = bearing("cylindrical_roller", "NU 218", bore_mm=90.0, outer_diameter_mm=160.0, width_mm=30.0)
    mean, load, n, nu = 125.0, 22e3, 2980.0, 20.0
    heating = 1.0 / (1.0 + 1.84e-9 * (n * mean) ** 1.28 * nu**0.64)
    starvation = math.exp(-3e-8 * nu * n * 250.0 * math.sqrt(5.1 / 140.0))
    rolling = heating * starvation * 1.09e-6 * mean**2.41 * load**0.31 * (nu * n) ** 0.6
    thin = math.exp(-2.6e-8 * (n * nu) ** 1.4 * mean)
    sliding = 0.0015 * mean * load * (0.12 * thin + 0.02 * (1.0 - thin))
    moment, low, high = frictional_moment(section, load, 0.0, n * RPM, nu * 1e-6, 2e5)
    assert moment == low == high == pytest.approx(1e-3 * (rolling + sliding), rel=1e-12)
    assert moment == pytest.approx(1.658, abs=1e-3)


@pytest.mark.parametrize(
    ("kind", "designation", "axial"),
    [
        ("deep_groove_ball", "6220", 0.0),
        ("angular_contact_ball", "7220 B", 0.5),
        ("four_point_ball", "QJ 220", 0.5),
        ("self_aligning_ball", "1220", 0.0),
        ("cylindrical_roller", "NU 220", 0.0),
        ("tapered_roller", "30220", 0.3),
        ("spherical_roller", "22220 E", 0.0),
    ],
)
def test_constant_coefficients_are_met_within_a_factor_of_two(kind: str, designation: str, axial: float) -> None:
    """At a tenth of a usual rating, a normal speed and viscosity: the simple method of the same maker."""
    section = bearing(kind, designation)
    rating = 1.2e5 if kind.endswith("ball") else 2.5e5
    load = 0.1 * rating
    moment, _, _ = frictional_moment(section, load, axial * load, 1500.0 * RPM, 15e-6, rating)
    simple = 0.5 * CONSTANT[kind] * load * (1.0 + axial) * 0.1
    assert 0.5 < moment / simple < 2.0


def test_a_full_film_slides_more_lightly_and_friction_grows_with_the_load() -> None:
    """The curve of Stribeck of a tapered roller bearing, whose ribs slide: highest in thin films, then a minimum."""
    section = bearing("tapered_roller", "30220")
    speeds = np.geomspace(0.1, 1000.0, 40) * RPM
    moments = [frictional_moment(section, 20e3, 0.0, speed, 100e-6, 3e5)[0] for speed in speeds]
    least = int(np.argmin(moments))
    assert 0 < least < len(moments) - 1
    assert max(moments[:least]) > 1.3 * moments[least]
    loads = [frictional_moment(section, load, 0.1 * load, 50.0, 50e-6, 3e5)[0] for load in (1e3, 1e4, 1e5)]
    assert loads == sorted(loads)


def test_tapered_bearings_of_a_pair_share_the_radial_load_and_press_each_other() -> None:
    both = bearing("tapered_roller", "32220 pair, O", arrangement="O", contact_angle_deg=15.0)
    alone = both.model_copy(update={"arrangement": "single"})
    caused = 0.5 * 10e3 * math.tan(math.radians(15.0)) / 0.4
    each = [frictional_moment(alone, 10e3, axial, 50.0, 50e-6, 3e5)[0] for axial in (caused + 7e3, caused)]
    assert frictional_moment(both, 20e3, -7e3, 50.0, 50e-6, 6e5)[0] == pytest.approx(sum(each), rel=1e-12)
    tandem = both.model_copy(update={"arrangement": "tandem"})
    shared = 2.0 * frictional_moment(alone, 10e3, 3.5e3, 50.0, 50e-6, 3e5)[0]
    assert frictional_moment(tandem, 20e3, 7e3, 50.0, 50e-6, 6e5)[0] == pytest.approx(shared, rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "designation", "series"),
    [
        ("deep_groove_ball", "6206", "62"),
        ("deep_groove_ball", "61880 MA", "618"),
        ("deep_groove_ball", "623-2Z", "62"),
        ("cylindrical_roller", "NU 208", "2"),
        ("cylindrical_roller", "NJ 2232", "22"),
        ("cylindrical_roller", "N 1010", "10"),
        ("tapered_roller", "30208 pair, X", "302"),
        ("tapered_roller", "32032 X pair", "320"),
        ("tapered_roller", "32222 B", "322 B"),
        ("tapered_roller", "HM 212049", ""),
        ("spherical_roller", "22220 E", "222 E"),
        ("spherical_roller", "23040 CC/W33", "230"),
        ("self_aligning_ball", "1206", "12"),
        ("angular_contact_ball", "7210 BECBP", "72 B"),
        ("four_point_ball", "", "QJ"),
        ("thrust_spherical_roller", "29420 E", "294 E"),
        ("cylindrical_roller", "", ""),
    ],
)
def test_designations_have_their_series(kind: str, designation: str, series: str) -> None:
    assert friction_series(bearing(kind, designation)) == series


def test_an_unknown_series_has_the_range_of_all() -> None:
    moment, low, high = frictional_moment(bearing("tapered_roller"), 10e3, 3e3, 50.0, 50e-6, 3e5)
    assert low < moment < high
    each = [
        frictional_moment(bearing("tapered_roller", series=name), 10e3, 3e3, 50.0, 50e-6, 3e5)[0]
        for name in friction_constants("tapered_roller")
    ]
    assert (low, high) == (min(each), max(each))


def test_all_constants_are_there_and_give_a_moment() -> None:
    for kind in REPLENISHMENT:
        for name in friction_constants(kind):
            moment = frictional_moment(bearing(kind, series=name), 10e3, 2e3, 100.0, 30e-6, 1e5)[0]
            assert 0.2 < moment < 30.0, (kind, name)
    assert not friction_constants("needle_roller")


def test_a_series_that_is_not_in_the_table_is_refused(grc: Gearbox) -> None:
    with pytest.raises(GearboxFileError, match=r"bearings.hss_a.catalogue: series = '99': unknown.*choose 2, 3"):
        check_parts(grc.varied({"bearings.hss_a.catalogue.series": "99"}))
