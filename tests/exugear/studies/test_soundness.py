"""Studies that would lose a output, never end or fail after the work are refused on reading, with the names."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from exugear.studies.executors import processes
from exugear.studies.runner import run_study
from exugear.studies.sections import StudyError

from ..cases.study import small_study

SEAT = {"path": "housing.factor", "values": [0.2, 0.4]}
FREQUENCIES = {"quantity": "frequencies", "count": 2}
DRAWN = {"path": "housing.factor", "uniform": {"min": 0.2, "max": 0.4}}


SPEEDS = {"speeds": "800:1200:3", "at_resonances": False}


def nearest(**options):
    return {"f": {"quantity": "nearest_frequency", "near_Hz": 500.0, **options}}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        *(
            ({"outputs": {name: FREQUENCIES}}, f"outputs.{name}: this is the name of the results of each point")
            for name in ("error", "seconds", "memory", "doubts")
        ),
        ({"parameters": {"error": SEAT}}, "parameters.error: this is the name of the results of each point"),
        ({"parameters": {"mode": SEAT}}, "parameters.mode: this is the name of a dimension of outputs.frequency"),
        ({"parameters": {"forces": SEAT}}, "outputs.forces: parameters.forces has the same name; rename one"),
        ({"parameters": {"sample": DRAWN}, "samples": 4}, "parameters.sample: this is the name of the draws"),
        (
            {"parameters": {"a": SEAT, "b": SEAT}},
            "parameters.b: sets housing.factor, and parameters.a housing.factor; remove one of them",
        ),
        (
            {"parameters": {"a": {"paths": ["housing.factor", "housing.factor"], "values": [0.2, 0.4]}}},
            "parameters.a: sets housing.factor twice; remove one",
        ),
        (
            {"parameters": {"a": {"paths": ["housing.factor"], "values": [0.2, 0.4]}}},
            "parameters.a.paths = ['housing.factor']: must have at least 2 entries",
        ),
        ({"parameters": {"a": SEAT | {"values": []}}}, "parameters.a.values = []: must have at least 1 entry"),
        (
            {"parameters": {"a": SEAT | {"values": [0.3, 0.5, 0.3]}}},
            "parameters.a: values 1 and 3 are the same point, housing.factor = 0.3",
        ),
        (
            {"parameters": {"a": {"path": "housing.factor", "range": {"first": 0.3, "last": 0.3, "count": 2}}}},
            "parameters.a: values 1 and 2 are the same point,",
        ),
        (
            {"outputs": {"f": FREQUENCIES | {"count": -1}}},
            "outputs.f.count = -1: must be finite, and lie between 1 and",
        ),
        ({"outputs": nearest(near_Hz=math.nan)}, "outputs.f.near_Hz = nan: must be finite"),
        (
            {"parameters": {"a": {"path": "housing.factor", "range": {"first": math.nan, "last": 1.0, "count": 3}}}},
            "parameters.a.range.first = nan: must be a finite number",
        ),
        ({"outputs": nearest(near_Hz=-1.0)}, "outputs.f.near_Hz = -1.0: must be finite, and lie between 0"),
        (
            {"outputs": nearest(element="nope")},
            "outputs.f.element = 'nope': no such element; there are spur, bearing_1",
        ),
        ({"outputs": {"f": {"quantity": "ste_harmonic", "pair": "nope"}}}, "outputs.f.pair = 'nope': no such pair"),
        (
            {"outputs": {"f": {"quantity": "load_sharing", "meshes": "nope"}}},
            "f.meshes = 'nope': no such meshes",
        ),
        (
            {"outputs": {"f": {"quantity": "ste_harmonic", "pair": "spur", "harmonic": 5}}},
            "outputs.f.harmonic = 5: a table of 8 positions has 4 harmonics",
        ),
        (
            {"outputs": {"f": {"quantity": "loudest_peak", "signal": "support_force bearing_9"}}, "steady": SPEEDS},
            "outputs.f.signal = 'support_force bearing_9': no such signal; did you mean 'support_force bearing_2'?",
        ),
        (
            {"outputs": {"f": {"quantity": "loudest_peak", "signal": "support_force bearing_1 w"}}, "steady": SPEEDS},
            "no such signal; did you mean 'support_force bearing_1",
        ),
        (
            {"outputs": {"f": {"quantity": "loudest_frequency", "from_Hz": 900.0, "to_Hz": 100.0}}},
            "outputs.f.from_Hz = 900: must be below to_Hz = 100",
        ),
    ],
)
def test_what_would_be_lost_or_fail_after_the_work_is_refused_with_names(changes, words, tmp_path):
    with pytest.raises(StudyError, match=re.escape(words)):
        small_study(tmp_path, **changes)


def test_all_that_is_wrong_is_told_at_once(tmp_path):
    with pytest.raises(StudyError) as caught:
        small_study(tmp_path, parameters={"a": SEAT, "b": SEAT}, outputs={"error": FREQUENCIES, **nearest(element="x")})
    assert len(str(caught.value).splitlines()) == 3


def test_elements_are_those_that_modes_have(tmp_path):
    """Names that reading takes are those that the modes of the variant know."""
    outputs = {
        name: {"quantity": "nearest_strain", "near_Hz": 500.0, "element": name}
        for name in ("spur", "bearing_1", "bearing_2")
    }
    study = small_study(tmp_path, outputs=outputs, parameters={"a": SEAT})
    assert not run_study(study, tmp_path / "out", processes(1)).failed


def test_a_bearing_without_a_direction_has_its_radial_amplitude(tmp_path):
    """The root of the sum of squares over x and y; names accepted on reading are those of the points."""
    signals = {part: f"support_force bearing_1{part}" for part in ("", " x", " y")}
    outputs = {f"f{part.strip()}": {"quantity": "largest_line", "line": "spur"} for part in signals}
    for name, signal in zip(outputs, signals.values(), strict=True):
        outputs[name]["signal"] = signal
    steady = {"speeds": "1000:1001:2", "at_resonances": False}
    study = small_study(tmp_path, outputs=outputs, parameters={"a": SEAT}, steady=steady)
    data = run_study(study, tmp_path / "out", processes(1)).dataset
    assert data["f"].values == pytest.approx(np.hypot(data["fx"], data["fy"]).values, rel=1e-3)


def test_an_output_that_fails_leaves_the_others_of_its_point(tmp_path):
    """No mode lies in the range; the second output of the point is that of a study without the first one."""
    lost = {"quantity": "loudest_frequency", "from_Hz": 1.0, "to_Hz": 2.0}
    result = run_study(
        small_study(tmp_path, outputs={"lost": lost, **nearest()}, parameters={"a": SEAT}),
        tmp_path / "out",
        processes(1),
    )
    alone = run_study(
        small_study(tmp_path, outputs=nearest(), parameters={"a": SEAT}), tmp_path / "alone", processes(1)
    )
    assert len(result.failed) == 2
    assert np.isnan(result.dataset["lost"]).all()
    assert result.dataset["f"].values == pytest.approx(alone.dataset["f"].values)
    assert str(result.dataset["error"].values[0]).startswith("outputs.lost: no mode between 1 and 2 Hz")
