"""Searches within limits and over tolerances: optima in closed form, the same draws every time, what is refused."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from exugear.studies.dataset import EVALUATION, beyond, load_study
from exugear.studies.executors import processes
from exugear.studies.pictures import draw_study
from exugear.studies.quantities import QUANTITIES, OutputKind
from exugear.studies.runner import optimise
from exugear.studies.sampling import percentile_of
from exugear.studies.sections import StudyError
from exugear.studies.study import Study

from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..cases.study import study_content

HERE = processes(1)
SMALL = {"population": 6, "generations": 8}
SEAT = {"path": "housing.factor", "uniform": {"min": 0.2, "max": 0.8}}
MADE = {"path": "housing.factor", "acts": "shifts", "uniform": {"min": -0.1, "max": 0.1}}


def place(results) -> float:
    """Housing factor as it is made."""
    return results.gearbox.case.housing.factor


def wall(results) -> float:
    """Square of the distance from 0.5, nine times as large above it."""
    away = results.gearbox.case.housing.factor - 0.5
    return away**2 * (9.0 if away > 0.0 else 1.0)


def endless(results) -> float:
    """Square of the distance from 0.3; without end above 0.6."""
    factor = results.gearbox.case.housing.factor
    return (factor - 0.3) ** 2 if factor < 0.6 else float("inf")


def failing(results) -> float:
    """The same, where what has no end fails."""
    assert results.gearbox.case.housing.factor < 0.6, "too stiff"
    return (results.gearbox.case.housing.factor - 0.3) ** 2


def depth(results) -> float:
    """A output below zero, least at 0.6."""
    return (results.gearbox.case.housing.factor - 0.6) ** 2 - 1.0


KNOWN = {
    "depth": OutputKind(depth, "1"),
    **QUANTITIES,
    "place": OutputKind(place, "1"),
    "wall": OutputKind(wall, "1"),
    "endless": OutputKind(endless, "1"),
    "failing": OutputKind(failing, "1"),
}


def searched(folder, outputs, optimise, **changes):
    content = study_content(folder, parameters={"seat": SEAT}, outputs={name: {"quantity": name} for name in outputs})
    content["changes"] = {"housing.factor": 0.5}
    content["optimise"] = {"population": 12, "generations": 14, **optimise}
    return Study.from_dict({**content, **changes}, quantities=KNOWN)


def best(dataset, name):
    kept = dataset.isel({EVALUATION: dataset["on_front"].to_numpy() == 1})
    assert kept.sizes[EVALUATION] >= 1
    return kept.isel({EVALUATION: int(np.argmin(kept[name].to_numpy()))})


@pytest.mark.validation
def test_a_limit_holds_where_the_optimum_lies_beyond_it(tmp_path):
    """(x - 0.3)^2 has its least value at 0.3; with x at least 0.45 it is at the limit, 0.0225."""
    study = searched(tmp_path, ["failing", "place"], {"minimise": ["failing"], "limits": {"place": {"min": 0.45}}})
    data = optimise(study, tmp_path / "out", HERE).dataset
    found = best(data, "failing")
    assert 0.45 <= float(found["place"]) < 0.452
    assert float(found["failing"]) == pytest.approx(0.0225, rel=0.03)
    kept = data["meets_limits"].to_numpy() == 1
    assert np.array_equal(kept, data["place"].to_numpy() >= 0.45)
    assert kept.any() and not kept.all() and not np.any(data["on_front"].to_numpy()[~kept])


def test_a_figure_below_zero_is_made_small_all_the_same(tmp_path):
    data = optimise(searched(tmp_path, ["depth"], {"minimise": ["depth"], **SMALL}), tmp_path / "out", HERE).dataset
    assert float(best(data, "depth")["seat"]) == pytest.approx(0.6, abs=0.02)


@pytest.mark.validation
def test_limits_of_both_sides_and_of_the_figure_itself_hold(tmp_path):
    limits = {"place": {"min": 0.62, "max": 0.7}, "wall": {"max": 0.3}}
    data = optimise(
        searched(tmp_path, ["wall", "place"], {"minimise": ["wall"], "limits": limits}), tmp_path / "out", HERE
    )
    found = best(data.dataset, "wall")
    assert 0.62 <= float(found["place"]) < 0.625


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize(("percent", "height", "seat"), [(95.0, (0.75 * 0.19) ** 2, 0.4525), (100.0, 0.15**2, 0.45)])
def test_the_optimum_over_tolerances_stands_off_the_wall(tmp_path, percent, height, seat):
    """Made within 0.1, evenly: 95 of 100 draws lie in a piece of 0.19 of the 0.2, all in 0.2.

    The wall is as high at both ends of a piece that reaches r below 0.5 and r / 3 above: 4/3 r = 0.19 or 0.2. At 0.5
    itself the piece reaches 0.1 below and 0.09 or 0.1 above. Of 16 even draws the ends lie within 1/32 of the range.
    """
    search = {"minimise": ["wall"], "percentile": percent, **SMALL}
    study = searched(tmp_path, ["wall"], search, tolerances={"made": MADE}, samples=16, sampling="sobol")
    data = optimise(study, tmp_path / "out", HERE).dataset
    found, drawn = best(data, "wall_high"), data["made"].to_numpy()
    assert float(found["wall_high"]) == pytest.approx(height, rel=0.15)
    assert float(found["seat"]) == pytest.approx(seat, abs=0.02)
    # The same draws at places 1e-4 apart: none is better.
    grid = [heights(place + drawn) for place in np.arange(0.3, 0.7, 1e-4)]
    assert float(found["wall_high"]) <= 1.02 * percentile_of(np.array(grid), percent).min()
    assert data["wall"].dims == (EVALUATION, "sample")
    assert data["wall_high"].attrs["long_name"] == (
        f"{percent:g}th percentile of wall over 16 draws of the tolerances (sobol, seed 0, the same at every point)"
    )
    # Every point has the same draws; the case as it is stands at 0.5.
    made = np.append(0.5, data["seat"].to_numpy()[1:])[:, None] + drawn
    assert data["wall"].to_numpy() == pytest.approx(heights(made), abs=1e-5)
    assert data["wall_high"].to_numpy() == pytest.approx(percentile_of(data["wall"].to_numpy(), percent))


def heights(place):
    return np.where(place > 0.5, 9.0, 1.0) * (place - 0.5) ** 2


@pytest.mark.validation
def test_what_is_limited_below_counts_by_its_low_percentile(tmp_path):
    """Of x made within 0.1, 90 of 100 are above x - 0.08: at least 0.35 they are from x = 0.43 on."""
    study = searched(
        tmp_path,
        ["endless", "place"],
        {"minimise": ["endless"], "limits": {"place": {"min": 0.35}}, "percentile": 90.0, **SMALL},
        tolerances={"made": MADE},
        samples=16,
        sampling="sobol",
    )
    data = optimise(study, tmp_path / "out", HERE).dataset
    found = best(data, "endless_high")
    assert float(found["seat"]) == pytest.approx(0.35 + 0.08, abs=0.01)
    assert "10th percentile of place" in data["place_low"].attrs["long_name"]


@pytest.mark.sample
@pytest.mark.parametrize("output", ["endless", "failing"])
def test_draws_that_fail_or_have_no_end_are_worst(tmp_path, output):
    """Above 0.6 less than 5 of 100 draws may lie: x + 0.09 stays below."""
    study = searched(
        tmp_path,
        [output, "place"],
        {"minimise": [output], "limits": {"place": {"min": 0.3}}, "population": 8, "generations": 1},
        tolerances={"made": MADE},
        samples=8,
        changes={"housing.factor": 0.4},
    )
    data = optimise(study, tmp_path / "out", HERE).dataset
    high, seats = data[f"{output}_high"].to_numpy()[1:], data["seat"].to_numpy()[1:]
    assert np.isinf(high[seats > 0.53]).all() and np.isfinite(high[seats < 0.5]).all()
    lost = data[output].to_numpy()[1:][seats > 0.71]
    assert lost.size and (np.isinf(lost) if output == "endless" else np.isnan(lost)).all()
    draw_study(data, tmp_path / "drawn", (f"{output}_high",))
    assert (tmp_path / "drawn" / "pictures" / "search.png").is_file()


def test_percentiles_are_those_of_the_distribution():
    """Shares of an even spread: k of n + 1 within 1/3 draw; of a normal one 1.645 deviations at 95 of 100."""
    even = (np.arange(1, 201) - 0.5) / 200.0
    for percent in (5.0, 50.0, 90.0, 95.0):
        assert float(percentile_of(even, percent)) == pytest.approx(percent / 100.0, abs=0.3 / 200.0)
    normal = np.random.default_rng(1).standard_normal((3, 20_000))
    assert percentile_of(normal, 95.0) == pytest.approx([1.645] * 3, abs=0.04)
    assert percentile_of(-normal, 5.0) == pytest.approx(-percentile_of(normal, 95.0))
    assert float(percentile_of(np.array([1.0, 2.0, 3.0, np.inf]), 60.0)) == 3.0
    assert float(percentile_of(np.array([-np.inf, 1.0, 2.0]), 5.0)) == -np.inf


def test_a_limit_of_what_has_no_end_is_far_beyond_or_kept():
    assert beyond(float("inf"), "low", 2e4) < 0.0 < beyond(float("inf"), "high", 2e4)
    assert beyond(float("-inf"), "low", 0.0) > 0.0 and beyond(2.0, "high", 2.0) == 0.0


@pytest.mark.validation
def test_a_search_over_tolerances_that_is_begun_again_computes_nothing_twice(tmp_path):
    options = {"minimise": ["wall"], "generations": 2, "limits": {"wall": {"max": 0.1}}}
    made = {"tolerances": {"made": MADE}, "samples": 8}
    first = optimise(searched(tmp_path, ["wall"], options, **made), tmp_path / "out", HERE)
    assert first.computed == first.dataset.sizes[EVALUATION] * 8
    again = optimise(searched(tmp_path, ["wall"], options, **made), tmp_path / "out", HERE)
    assert again.computed == 0
    np.testing.assert_array_equal(again.dataset["wall_high"], first.dataset["wall_high"])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"optimise": {"minimise": ["f"], "limits": {"g": {"min": 1.0}}}}, "optimise.limits: no result 'g'"),
        ({"optimise": {"minimise": ["f"], "limits": {"f": {}}}}, "set min, max or both"),
        (
            {"optimise": {"minimise": ["f"], "limits": {"f": {"min": 2.0, "max": 1.0}}}},
            "min must not be above max",
        ),
        ({"optimise": {"minimise": ["f"], "limits": {"f": {"min": float("nan")}}}}, "finite number"),
        ({"optimise": {"minimise": ["f", "f"]}}, "f is listed twice; set two different results, or one"),
        ({"optimise": {"minimise": ["f"], "population": 4}}, "population = 4"),
        (
            {"optimise": {"minimise": ["many"]}},
            ": outputs.many has a value for each mode; an optimisation requires a single one",
        ),
        ({"optimise": {"minimise": ["f"], "percentile": 95.0}}, "optimise.percentile: requires tolerances; add"),
        ({"tolerances": {"made": MADE}}, "tolerances: set the number of draws per point, such as samples = 32"),
        (
            {"tolerances": {"made": MADE}, "samples": 12, "sampling": "sobol"},
            ": a Sobol sequence requires a power of two",
        ),
        (
            {"tolerances": {"made": {"path": "housing.factor", "values": [1.0]}}, "samples": 8},
            ": set a distribution: normal, uniform or iso1328",
        ),
        ({"tolerances": {"made": {**MADE, "acts": "replaces"}}, "samples": 8}, "tolerances.made: replaces housing.fac"),
        ({"tolerances": {"made": {**MADE, "path": "housing.facter"}}, "samples": 8}, "did you mean housing.factor"),
        ({"tolerances": {"made": {**MADE, "path": "name"}}, "samples": 8}, "no number there"),
        ({"tolerances": {"sample": MADE}, "samples": 8}, "tolerances.sample: this is the name of the draws"),
        (
            {"tolerances": {"seat": MADE}, "samples": 8},
            "tolerances.seat: parameters.seat has the same name; rename one",
        ),
        ({"tolerances": {"f_high": MADE}, "samples": 8}, "tolerances.f_high: this is the name of a percentile of out"),
        ({"optimise": None, "tolerances": {"made": MADE}}, "; otherwise define the draws as parameters"),
    ],
)
def test_searches_that_cannot_be_are_refused_on_reading(tmp_path, changes, words):
    outputs = {"f": {"quantity": "nearest_frequency", "near_Hz": 500.0}, "many": {"quantity": "frequencies"}}
    content = {"optimise": {"minimise": ["f"]}, "parameters": {"seat": SEAT}, "outputs": outputs, **changes}
    with pytest.raises(StudyError) as told:
        Study.from_dict({key: value for key, value in study_content(tmp_path, **content).items() if value is not None})
    assert words in str(told.value) and len(str(told.value).splitlines()) == 1


def test_the_example_of_the_reference_can_be_read():
    page = Path("docs/reference/studies.md").read_text(encoding="utf-8")
    begin = page.index('```toml\nname = "Relief')
    content = tomllib.loads(page[begin + 7 : page.index("```\n", begin + 7)])
    study = Study.from_dict({**content, "case": "cases/grc750/gearbox.toml"})
    path = "gears.hs_pinion.modification.tip_relief_um"
    made = study.tolerances.produced(study.gearbox, {path: 30.0})
    assert len(made) == 32 and all(24.0 <= one[path] <= 36.0 for one in made)
    assert len({one["gears.hs_pinion.modification.profile_slope_um"] for one in made}) == 32


def verb(folder, content):
    (folder / "a.study.toml").write_text(toml_text({**content, "case": "spur.toml"}), encoding="utf-8")
    return exugear("study", folder / "a.study.toml", "--workers", "1", "--all", "--out", folder / "out")


def damped(folder, limits, **changes):
    """Damping of the nearest mode, with its frequency within limits."""
    outputs = {
        "damping": {"quantity": "nearest_damping", "near_Hz": 500.0},
        "frequency": {"quantity": "nearest_frequency", "near_Hz": 500.0},
    }
    search = {"minimise": ["damping"], "population": 6, "generations": 2, "limits": limits}
    return study_content(folder, parameters={"seat": SEAT}, outputs=outputs, optimise=search, **changes)


@pytest.mark.validation
def test_the_verb_tells_percentiles_limits_and_front(tmp_path):
    tolerances = {"made": {**MADE, "uniform": {"min": -0.01, "max": 0.01}}}
    outcome = verb(tmp_path, damped(tmp_path, {"frequency": {"min": 10.0}}, tolerances=tolerances, samples=4))
    assert outcome.exit_code == 0, outcome.stderr
    assert "damping_high" in outcome.stdout and "frequency_low" in outcome.stdout
    told = " ".join((outcome.stdout + outcome.stderr).split())
    assert "95th percentile of damping over 4 draws of the tolerances (latin_hypercube, seed 0" in told
    data = load_study(tmp_path / "out" / "study.nc")
    assert json.loads(data.attrs["study"])["tolerances"]["made"]["uniform"] == {"min": -0.01, "max": 0.01}


def test_a_search_that_finds_nothing_within_its_limits_ends_with_1_and_says_so(tmp_path):
    outcome = verb(tmp_path, damped(tmp_path, {"frequency": {"min": 1e6, "max": 2e6}}))
    assert outcome.exit_code == 1
    assert "evaluated points meets the limits frequency min 1e+06 max 2e+06; widen" in outcome.stderr
    data = load_study(tmp_path / "out" / "study.nc")
    assert not data["meets_limits"].any() and not data["on_front"].any()
    assert (tmp_path / "out" / "pictures" / "search.png").is_file()
