"""Draws of parameters: their distributions, correlations and order, and the points that they make."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats

from exugear.gearbox.gearbox import Gearbox
from exugear.studies.sampling import Normal, correlated, design_of, shares
from exugear.studies.sections import StudyError, parse_study
from exugear.studies.study import Study
from fe_ste.standards.iso1328 import tolerance

from ..cases.study import small_study, study_content
from ..conftest import CASE

PINS = {
    f"pins.pin_{number}.{key}": value
    for number in (1, 2, 3)
    for key, value in (("body", f"planet_{number}"), ("tangential_um", 0.0))
}
PIN_PATHS = [f"pins.pin_{number}.tangential_um" for number in (1, 2, 3)]


def pins_study(**parameter) -> Study:
    return Study.from_dict(
        {
            "name": "pins",
            "case": str(CASE),
            "choice": {"variant": "bushing", "mesh_model": "iso6336"},
            "changes": PINS,
            "samples": 512,
            "sampling": "sobol",
            "parameters": {"pins": {"paths": PIN_PATHS, "normal": {"deviation": 10.0}, **parameter}},
            "outputs": {"sharing": {"quantity": "load_sharing", "meshes": "sun_planet"}},
        }
    )


def test_a_normal_distribution_that_is_cut_off_is_that_of_scipy():
    """`scipy.stats.truncnorm`, another implementation; both end in the error function, so 1e-9 is generous."""
    own = Normal(3.0, 2.0, 0.0, 4.0)
    reference = scipy.stats.truncnorm(-1.5, 0.5, loc=3.0, scale=2.0)
    share = np.linspace(0.0, 1.0, 101)
    np.testing.assert_allclose(own.at(share), reference.ppf(share), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("correlation", [0.0, 0.4, 0.9])
def test_members_of_a_group_are_correlated_as_asked(correlation):
    """Standard error of a correlation from 4096 draws is (1 - r^2) / 64; four of them are allowed."""
    normal = scipy.stats.norm.ppf(correlated(shares("random", 4096, 3, seed=3), correlation))
    found = np.corrcoef(normal.T)[np.triu_indices(3, 1)]
    np.testing.assert_allclose(found, correlation, atol=4.0 * (1.0 - correlation**2) / 64.0 + 1e-12)


def test_a_sobol_sequence_that_is_made_longer_begins_as_it_was():
    np.testing.assert_array_equal(shares("sobol", 32, 3, seed=7), shares("sobol", 128, 3, seed=7)[:32])


@pytest.mark.parametrize("sampling", ["sobol", "latin_hypercube"])
def test_draws_fill_each_stratum_once(sampling):
    """What sets them apart from random draws: each of n equal strata of every dimension holds one of n draws."""
    points = shares(sampling, 64, 4, seed=1)
    for column in np.floor(64.0 * points).T:
        assert sorted(column) == list(range(64))


def test_pins_that_are_drawn_by_themselves_differ_and_one_draw_moves_all():
    own = pins_study(correlation=0.0).design
    values = own.axes["pins"].values
    assert values.shape == (512, 3) and own.axes["pins"].units == "µm"
    np.testing.assert_allclose(values.mean(axis=0), 0.0, atol=0.05)  # evenly spread: far below 10 / sqrt(512)
    np.testing.assert_allclose(values.std(axis=0), 10.0, rtol=0.02)
    together = pins_study().design
    assert together.axes["pins"].values.shape == (512,)
    assert all(len(set(point.changes.values())) == 1 for point in together.points)


def test_a_tolerance_class_bounds_the_flanks_of_a_production(tmp_path):
    study = small_study(
        tmp_path,
        parameters={
            "slope": {
                "path": "gears.pinion.modification.helix_slope_um",
                "iso1328": {"gear": "pinion", "deviation": "helix_slope", "tolerance_class": 7},
            }
        },
        samples=200,
    )
    most = 1e6 * tolerance("helix_slope", 7, reference_diameter=60e-3, normal_module=3e-3, face_width=15e-3)
    values = study.design.axes["slope"].values
    assert np.abs(values).max() <= most
    assert values.std() == pytest.approx(most / 3.0, rel=0.03)  # cutting off at three deviations takes 1.5 %


def test_lists_and_draws_are_combined(tmp_path):
    content = study_content(tmp_path)["parameters"]
    content["time"] = {"path": "damping.mesh_time_s", "uniform": {"min": 1e-6, "max": 5e-6}}
    study = small_study(tmp_path, parameters=content, samples=5)
    assert dict(study.design.shape) == {"seat": 4, "bearing": 3, "sample": 5} and len(study.design.points) == 60
    assert study.design.axes["bearing"].values.tolist() == [1e7, 2e7, 4e7]


def test_values_scale_or_shift_those_of_the_case():
    def factors(**parameter):
        study = Study.from_dict(
            {
                "name": "scaled",
                "case": str(CASE),
                "choice": {"variant": "bushing", "mesh_model": "iso6336"},
                "parameters": {"own": {"paths": ["bearings.pl_a.z_mm", "bearings.pl_b.z_mm"], **parameter}},
                "outputs": {"frequency": {"quantity": "frequencies"}},
            }
        )
        return [list(point.changes.values()) for point in study.design.points]

    assert factors(acts="scales", values=[0.5, 2.0]) == [[-77.25, -27.25], [-309.0, -109.0]]
    assert factors(acts="shifts", values=[10.0]) == [[-144.5, -44.5]]


def test_settings_set_several_keys_by_one_name(tmp_path):
    settings = {
        "soft": {"housing.factor": 0.2, "damping.mesh_time_s": 1e-6},
        "hard": {"housing.factor": 1.0, "damping.mesh_time_s": 2e-6},
    }
    study = small_study(tmp_path, parameters={"build": {"settings": settings}})
    assert [dict(point.changes) for point in study.design.points] == list(settings.values())
    assert study.design.axes["build"].values.tolist() == ["soft", "hard"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"parameters": {"a": {"path": "housing.facter", "values": [1.0]}}}, "did you mean housing.factor"),
        ({"parameters": {"a": {"path": "bearings.bearing_3.z_mm", "values": [1.0]}}}, "bearings.bearing_1.z_mm"),
        ({"parameters": {"a": {"path": "housing.factor", "values": [1.0], "step": 0.1}}}, "values and step is set"),
        ({"parameters": {"a": {"path": "housing.factor"}}}, "set exactly one of values, range"),
        (
            {"parameters": {"a": {"values": [1.0]}}},
            "set path or paths; settings contain their own paths and require neither",
        ),
        (
            {"parameters": {"a": {"path": "housing.factor", "normal": {"deviation": 0.1}}}},
            "has a distribution; set the number of draws, such as samples = 64",
        ),
        ({"samples": 8}, "no parameter has a distribution"),
        ({"outputs": {"f": {"quantity": "frequencis"}}}, "did you mean 'frequencies'?"),
        ({"outputs": {"f": {"quantity": "frequencies", "cont": 3}}}, "did you mean 'count'?"),
        (
            {"sampling": "sobl"},
            "sampling = 'sobl': must be 'sobol', 'latin_hypercube' or 'random'; did you mean 'sobol'?",
        ),
        ({"outputs": {"f": {"quantity": "frequencies", "count": 3.5}}}, "must be a whole number"),
        ({"outputs": {"f": {"quantity": "nearest_frequency"}}}, "near_Hz: this option is missing"),
        ({"output": {}}, "did you mean 'outputs'?"),
        ({"case": "nowhere.toml"}, "nowhere.toml"),
        ({"steady": {"speeds": "ten"}}, "must be FIRST:LAST:COUNT"),
        ({"changes": {"name.x": 1.0}}, "neither a table nor a list"),
    ],
)
def test_a_study_that_cannot_be_is_told_with_file_key_and_remedy(tmp_path, changes, words):
    with pytest.raises(ValueError, match=words.replace("?", r"\?")) as told:
        small_study(tmp_path, **changes)
    assert str(told.value).splitlines()[0].split(":")[0] in ("study", str(tmp_path / "spur.toml"), "nowhere.toml")


def test_a_sobol_sequence_of_an_uneven_number_of_points_is_refused():
    content = {"name": "a", "case": "b", "samples": 100, "sampling": "sobol", "outputs": {"f": {}}}
    content["parameters"] = {"a": {"path": "p", "normal": {"deviation": 1.0}}}
    with pytest.raises(StudyError, match=": a Sobol sequence requires a power of two"):
        parse_study(content, "s")


def test_a_group_in_the_case_is_checked_path_by_path():
    study = pins_study()
    assert isinstance(study.gearbox, Gearbox) and len(study.gearbox.case.pins) == 3
    assert len(design_of(study.file, study.gearbox).points) == 512


def test_a_value_that_is_no_number_cannot_be_scaled(tmp_path):
    parameters = {"a": {"path": "name", "acts": "scales", "values": [2.0]}}
    with pytest.raises(StudyError, match="no number there that a value scales"):
        small_study(tmp_path, parameters=parameters)
