"""Parameters varied over assumptions: closed forms on one gear pair, modes followed through crossings."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.modes import modes_of
from exugear.system.sensitivity import (
    FrequencyMatch,
    Parameter,
    ParameterVariation,
    assumed_parameters,
    frequency_matches,
    planet_bearings,
    scaled_bearings,
    vary_parameter,
)
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

from ..cases.spur import SPUR_CASE


@pytest.fixture(scope="module")
def spur() -> Gearbox:
    return Gearbox.from_dict(tomllib.loads(SPUR_CASE))


def parameter(gearbox: Gearbox, variant: str, start: str, stiffness: dict) -> Parameter:
    parameters = assumed_parameters(gearbox, Choice(variant), stiffness)
    return next(parameter for parameter in parameters if parameter.label.startswith(start))


def test_output_inertia_moves_the_mesh_mode_as_the_closed_form_says(spur):
    stiffness = mesh_stiffness(spur, "iso6336")
    variation = vary_parameter(parameter(spur, "rigid", "axial inertia of shaft_2", stiffness))
    pair = spur.pairs["spur"].pair
    inertia = np.array(variation.parameter.values)
    flexibility = pair.pinion.base_radius**2 / 1e-2 + pair.gear.base_radius**2 / inertia
    expected = np.sqrt(stiffness["spur"][0] * flexibility) / (2 * np.pi)
    assert variation.frequency[:, 1] == pytest.approx(expected, rel=1e-9)
    assert variation.share[:, 1] == pytest.approx(np.ones(inertia.size), abs=1e-12)


def test_mesh_damping_moves_no_frequency_and_lowers_the_resonance(spur):
    stiffness = mesh_stiffness(spur, "iso6336")
    variation = vary_parameter(parameter(spur, "rigid", "mesh damping", stiffness))
    assert np.ptp(variation.frequency[:, 1]) < 1e-9 * variation.frequency[0, 1]
    times = np.array(variation.parameter.values)
    # One degree of freedom: damping ratio = pi f tau, amplification = 1 / (2 ratio) times the kinematic factor.
    assert variation.damping_ratio[:, 1] == pytest.approx(np.pi * variation.frequency[:, 1] * 1e-6 * times, rel=1e-9)
    product = variation.amplification[:, 1] * variation.damping_ratio[:, 1]
    assert product == pytest.approx(np.full(times.size, product[0]), rel=1e-9)


def test_a_crossing_leads_to_the_assumption_that_brings_the_mode_there(spur):
    stiffness = mesh_stiffness(spur, "iso6336")
    variation = vary_parameter(parameter(spur, "rigid", "axial inertia of shaft_2", stiffness))
    target = 0.5 * float(variation.frequency[3, 1] + variation.frequency[4, 1])
    (match,) = frequency_matches([variation], target, 0.01)
    # Linear between values a factor 1.4 apart.
    assert match.frequency == pytest.approx(target, rel=3e-3)
    assert variation.parameter.values[3] < match.value < variation.parameter.values[4]
    assert not list(frequency_matches([variation], 10.0 * target, 0.01))


def test_the_housing_factor_counts_only_where_there_are_bearings(spur):
    stiffness = mesh_stiffness(spur, "iso6336")
    labels = {
        variant: [parameter.label for parameter in assumed_parameters(spur, Choice(variant), stiffness)]
        for variant in ("rigid", "bushing")
    }
    assert "housing stiffness factor" not in labels["rigid"]
    assert "housing stiffness factor" in labels["bushing"]
    assert not any(label.startswith("planet") for label in labels["bushing"])


def test_planet_bearings_of_the_grc_are_those_between_planets_and_carrier(grc, stiffness):
    base = parameter(grc, "bushing", "stiffness of planet bearings", stiffness).build(1.0)
    places = planet_bearings(grc, base)
    assert [base.connector_names[place] for place in places] == [f"pl_{row}_{n}" for row in "ab" for n in (1, 2, 3)]
    doubled = scaled_bearings(base, places, 2.0).connectors
    others = [place for place in range(len(base.connector_names)) if place not in places]
    assert np.array_equal(doubled.stiffness[list(places)], 2.0 * base.connectors.stiffness[list(places)])
    assert np.array_equal(doubled.stiffness[others], base.connectors.stiffness[others])


@pytest.mark.validation
def test_modes_are_followed_through_a_crossing(grc, stiffness):
    # With less inertia the mode of the high-speed shaft rises through those of the planets, which stay.
    variation = vary_parameter(parameter(grc, "bushing", "axial inertia of hss", stiffness))
    seen = variation.near((1500.0, 5500.0), 0.01)
    spread = np.ptp(seen.frequency, axis=0)
    assert np.sum(spread > 1000.0) == 1
    # The others lie in its way and move by less than a quarter of a percent.
    assert np.sort(spread)[:-1] == pytest.approx(0.0, abs=5.0)


def test_inertias_no_rigid_body_has_are_not_built(grc, stiffness):
    # The set "gears" has a light pinion: a large axial inertia needs a larger transverse one with it.
    parameters = assumed_parameters(grc, Choice("bushing", inertias="gears"), stiffness)
    inertia = next(parameter for parameter in parameters if parameter.label.startswith("axial inertia"))
    built = inertia.build(max(inertia.values)).gearbox.body("hss", "gears")
    assert built.axial == max(inertia.values)
    assert built.axial <= 2.0 * built.transverse


def test_variations_and_assemblies_show_themselves_in_a_line(grc: Gearbox, stiffness: dict) -> None:
    parameters = assumed_parameters(grc, Choice("rigid"), stiffness)
    assembly = parameters[0].build(parameters[0].default)
    assert repr(assembly) == "<Assembly 'GRC 750 kW', rigid, line_of_action, assemblies: 8 coordinates, 8 meshes>"
    variation = ParameterVariation(parameters[0], *(np.ones((9, 3)) for _ in range(4)))
    assert repr(variation) == "<ParameterVariation axial inertia of hss / kg m²: 9 values, 3 modes>"
    match = FrequencyMatch(parameters[0], 2.0, modes_of(assembly), 1)
    assert repr(match).startswith("<FrequencyMatch axial inertia of hss / kg m² = 2: ") and len(repr(match)) < 100
