"""Searches: optima that are known, fronts that are known, nothing computed twice."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.studies.dataset import EVALUATION, is_pareto_optimal
from exugear.studies.executors import processes
from exugear.studies.quantities import QUANTITIES, OutputKind
from exugear.studies.runner import optimise
from exugear.studies.study import Study

from ..cases.study import study_content

HERE = processes(1)


def distance(results, *, of: float) -> float:
    """Squared distance of the housing factor from a value, with the second parameter's own optimum at 3e-6."""
    case = results.gearbox.case
    return (case.housing.factor - of) ** 2 + (1e6 * case.damping.mesh_time_s - 3.0) ** 2


KNOWN = {**QUANTITIES, "distance": OutputKind(distance, "1")}


def searched(folder, *minimise, **settings):
    parameters = {
        "seat": {"path": "housing.factor", "uniform": {"min": 0.1, "max": 1.0}},
        "time": {"path": "damping.mesh_time_s", "uniform": {"min": 1e-6, "max": 9e-6}},
    }
    outputs = {"low": {"quantity": "distance", "of": 0.3}, "high": {"quantity": "distance", "of": 0.7}}
    content = study_content(folder, parameters=parameters, outputs=outputs)
    content["optimise"] = {"minimise": list(minimise), "population": 12, "generations": 12, **settings}
    return Study.from_dict(content, quantities=KNOWN)


@pytest.mark.validation
@pytest.mark.long
def test_a_search_finds_the_optimum_that_is_known(tmp_path):
    """Squared distances fall by four a halving: 1e-2 is within 0.1 of both optima, of ranges of 0.9 and 8."""
    data = optimise(searched(tmp_path, "low", generations=20), tmp_path / "out", HERE).dataset
    best = data.isel({EVALUATION: int(np.argmin(data["low"].to_numpy()))})
    assert float(best["low"]) < 1e-2
    assert float(best["seat"]) == pytest.approx(0.3, abs=0.1)
    assert data["on_front"].sum() == 1


@pytest.mark.validation
def test_the_front_of_two_figures_lies_between_their_optima(tmp_path):
    """Both distances fall until the point stands on the line between 0.3 and 0.7; the front's ends are the optima."""
    swept = optimise(searched(tmp_path, "low", "high", weightings=3), tmp_path / "out", HERE)
    front = swept.dataset.isel({EVALUATION: swept.dataset["on_front"].to_numpy() == 1})
    assert front.sizes[EVALUATION] >= 5
    assert np.all((front["seat"] > 0.25) & (front["seat"] < 0.75))
    assert float(front["seat"].max() - front["seat"].min()) > 0.2
    first = swept.dataset.isel({EVALUATION: 0})  # the case as it is
    assert float(first["low"]) == pytest.approx(0.2**2 + 1.0) and np.isnan(float(first["seat"]))


@pytest.mark.validation
def test_a_search_that_is_begun_again_computes_nothing_twice(tmp_path):
    first = optimise(searched(tmp_path, "low"), tmp_path / "out", HERE)
    assert first.computed == first.dataset.sizes[EVALUATION]
    again = optimise(searched(tmp_path, "low"), tmp_path / "out", HERE)
    assert again.computed == 0
    np.testing.assert_array_equal(again.dataset["low"], first.dataset["low"])
    longer = optimise(searched(tmp_path, "low", generations=14), tmp_path / "out", HERE)
    assert 0 < longer.computed <= 24


def test_progress_counts_each_point_of_a_generation(tmp_path):
    told = []
    study = searched(tmp_path, "low", population=8, generations=1)
    found = optimise(study, tmp_path / "out", HERE, progress=lambda *counts: told.append(counts))
    assert [done for done, _, _ in told] == list(range(1, found.computed + 1))
    assert {failed for _, failed, _ in told} == {0} and {most for _, _, most in told} == {17}


def test_points_on_a_front_are_beaten_by_none():
    outputs = np.random.default_rng(1).random((60, 2))
    front = is_pareto_optimal(outputs)
    for n, own in enumerate(outputs):
        beaten = any(np.all(other <= own) and np.any(other < own) for other in outputs)
        assert front[n] != beaten


def test_parameters_of_a_search_need_limits(tmp_path):
    with pytest.raises(ValueError, match="an optimisation requires bounds for each parameter; set a key uniform for"):
        Study.from_dict({**study_content(tmp_path), "optimise": {"minimise": ["nearest"]}})
