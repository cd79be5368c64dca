"""Lives as outputs of studies: what the verb `life` tells, damage without end, what is refused on reading."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.life.life_file import summary
from exugear.project import Project
from exugear.studies.dataset import load_study
from exugear.studies.executors import processes
from exugear.studies.pictures import draw_study
from exugear.studies.point_results import PointResults, PointSettings, Shared
from exugear.studies.quantities import contact_safeties, worst_planets
from exugear.studies.runner import run_study
from exugear.studies.sections import StudyError
from exugear.studies.study import Study

from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..life.test_life import TABLE, content_of
from ..life.test_verdicts import hertzian, planets_with

pytestmark = pytest.mark.usefixtures("coarse_tables")

CASE = "gearbox.toml"
QUANTITIES = {
    "S_H": {"quantity": "contact_safety"},
    "S_F": {"quantity": "root_safety", "gear": "wheel"},
    "by_standard": {"quantity": "contact_safeties", "of": "iso6336"},
    "at_rest": {"quantity": "root_safeties", "of": "static"},
    "pitting": {"quantity": "contact_damages"},
    "breakage": {"quantity": "root_damage"},
    "L10": {"quantity": "bearing_lives", "by": "L10"},
    "least_life": {"quantity": "bearing_life"},
    "wear": {"quantity": "bearing_damage", "bearing": "bearing_1"},
    "S_0": {"quantity": "static_safety"},
    "hours": {"quantity": "life_hours"},
    "short": {"quantity": "shortfalls"},
}


def content(folder: Path, **changes):
    """Study of the rated spur pair over K_v; with the last of its values no load cycle is endured."""
    (folder / CASE).write_text(toml_text(content_of(TABLE, folder)), encoding="utf-8")
    return {
        "name": "lives",
        "case": str(folder / CASE),
        "choice": {"variant": "bushing", "mesh_model": "iso6336"},
        "parameters": {"K_v": {"path": "rating.dynamic_factor", "values": [1.0, 2.4]}},
        "outputs": QUANTITIES,
        **changes,
    }


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """The study, carried out."""
    folder = tmp_path_factory.mktemp("lives")
    return folder, run_study(Study.from_dict(content(folder)), folder / "out", processes(1)).dataset


@pytest.mark.validation
def test_figures_of_a_life_are_what_the_verb_tells(swept):
    folder, data = swept
    project = Project.from_toml(folder / CASE, folder / "project", Choice("bushing", "iso6336"))
    (table,) = (folder / "out" / "shared").glob("tables/*/tables/spur.nc")
    shutil.copytree(table.parent, project.folder / "tables")
    told = summary(project.life())
    flanks = {one["flank"]: one for one in told["flanks"]}
    (bearing,) = told["bearings"]
    first = data.isel(K_v=0)
    assert float(first["S_H"]) == min(one["contact_safety"] for one in flanks.values())
    assert float(first["S_F"]) == flanks["wheel + spur"]["root_safety"]
    assert float(first["breakage"]) == max(one["root_damage"] for one in flanks.values())
    for label, one in flanks.items():
        own = first.sel(flank=label)
        assert float(own["by_standard"]) == one["standard_contact_safety"]
        assert float(own["at_rest"]) == one["root_static"]
        assert float(own["pitting"]) == one["contact_damage"]
    assert float(first["L10"].sel(bearing="bearing_1")) == bearing["basic_hours"]
    assert float(first["least_life"]) == min(bearing["basic_hours"], bearing["reference_hours"])
    assert float(first["wear"]) == max(bearing["damage"], bearing["reference_damage"])
    assert float(first["S_0"]) == bearing["static_safety"]
    assert float(first["hours"]) == pytest.approx(10_000.0 / told["limits"][0]["damage"], rel=1e-12)
    assert float(first["short"]) == len(told["failures"]) + len(told["shortfalls"])


@pytest.mark.validation
def test_damage_without_end_is_infinite_in_file_journal_and_picture(swept):
    folder, data = swept
    stored = load_study(folder / "out" / "study.nc")
    last = stored.isel(K_v=1)
    assert last["pitting"].to_numpy().tolist() == [math.inf, math.inf]
    assert float(last["hours"]) == 0.0 and 0.0 < float(last["S_H"]) < 1.0
    assert "invalid" in str(last["doubts"].item()) and not str(last["error"].item())
    lines = "".join(path.read_text() for path in (folder / "out" / "points").iterdir())
    assert '"infinite"' in lines and "Infinity" not in lines
    again = run_study(Study.from_dict(content(folder)), folder / "out", processes(1))
    assert again.computed == 0 and again.dataset["pitting"].identical(data["pitting"])
    names = {path.name for path in draw_study(stored, folder / "drawn")}
    assert "pitting.png" in names


def test_points_share_tables_and_stresses(swept):
    folder, _ = swept
    assert len(list((folder / "out" / "shared").glob("stress/*/stress/spur.nc"))) == 1


def test_a_dynamic_factor_of_a_run_is_that_of_each_point(swept):
    """A point has no results folder with a run: K_v is computed there. More damping, less K_v, more safety."""
    folder, data = swept
    case = content_of(TABLE, folder)
    del case["rating"]["dynamic_factor"]
    case["rating"] |= {"dynamic_factor_run": "run_up", "minimum_dynamic_factor": 1.01}
    (folder / "run.toml").write_text(toml_text(case), encoding="utf-8")
    study = content(folder, case=str(folder / "run.toml"), outputs={"S_H": {"quantity": "contact_safety"}})
    study |= {
        "choice": {"variant": "bushing", "mesh_model": "line_of_action"},
        "parameters": {"damping": {"path": "damping.mesh_time_s", "values": [1e-6, 5e-6]}},
        "run": {"duration_s": 0.3},
    }
    found = run_study(Study.from_dict(study), folder / "out", processes(1))
    assert not found.failed, [record.error for record in found.failed]
    little, much = found.dataset["S_H"].to_numpy().tolist()
    assert little < much < float(data["S_H"][0])  # that of K_v = 1
    assert not list((folder / "out" / "work").glob("*"))


@pytest.mark.validation
def test_the_worst_planet_is_that_of_the_life(tmp_path):
    """A pin 60 um out of place: the same safeties and the same planet as the rating of flanks has them."""
    pins = {"pin": {"body": "planet_2", "tangential_um": 60.0}}
    grc = Path("cases/grc750/gearbox.toml")
    gearbox = Gearbox.from_dict({**Gearbox.from_toml(grc).content, "pins": pins}, str(grc))

    class Known(Shared):
        """Stresses in closed form in place of tables."""

        def table(self, *_):
            return None

        def stresses(self, request, _):
            return hertzian(gearbox.pairs[request.name].static_torque)

    choice = Choice("bushing", "iso6336").of(gearbox)
    results = PointResults(gearbox, choice, PointSettings(), Known(tmp_path), tmp_path / "work")
    expected = planets_with(2)
    for label in ("planet sun_planet", "planet ring_planet"):
        gear, family = label.split(" ")
        (name,) = [
            one for one in contact_safeties(results) if one.startswith(f"{gear} ") and one.endswith(f" {family}")
        ]
        assert contact_safeties(results)[name] == pytest.approx(expected[label].contact_safety, rel=1e-12)
        assert worst_planets(results)[name] == int(expected[label].contact_holder.removeprefix("planet_"))
    assert math.isnan(next(value for name, value in worst_planets(results).items() if name.startswith("hs_pinion")))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"outputs": {"f": {"quantity": "contact_safety", "gear": "sun"}}}, "no such gear; there are pinion, wheel"),
        (
            {"outputs": {"f": {"quantity": "contact_safety", "of": "lif"}}},
            "no such of; there are life, static",
        ),
        (
            {"outputs": {"f": {"quantity": "bearing_life", "by": "L11"}}},
            "no such by; there are minimum, L10",
        ),
        ({"outputs": {"f": {"quantity": "bearing_life", "bearing": "b"}}}, "no such bearing; there are bearing_1"),
        (
            {"outputs": {"f": {"quantity": "static_safety"}}, "choice": {"variant": "rigid", "mesh_model": "iso6336"}},
            "outputs.f: requires bearings with a section catalogue, which the variant 'rigid'",
        ),
        ({"outputs": {"f": {"quantity": "loudest_peak"}}}, ": requires a steady-state response; add a section"),
        (
            {"outputs": {"f": {"quantity": "rms", "signal": "noise"}}},
            "outputs.f.signal = 'noise': no such signal; there",
        ),
        (
            {"outputs": {"f": {"quantity": "loudest_peak", "signal": "mesh_dte x"}}, "steady": {"speeds": "0:100:5"}},
            "no such signal; did you mean 'mesh_dte spur'?",
        ),
        (
            {"outputs": {"f": {"quantity": "largest_line", "line": "2 x nope"}}, "steady": {"speeds": "0:100:5"}},
            ": no such order; orders are such as spur and 2 x spur",
        ),
    ],
)
def test_what_no_point_could_give_is_refused_on_reading(tmp_path, changes, words):
    with pytest.raises(StudyError) as told:
        Study.from_dict(content(tmp_path, **changes))
    assert words in str(told.value) and len(str(told.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("without", "words"),
    [("loads", "loads: this section is missing"), ("rating", "rating: this section is missing")],
)
def test_lives_need_loads_and_strengths_before_any_work(tmp_path, without, words):
    study = content(tmp_path)
    case = content_of(TABLE, tmp_path)
    del case[without]
    (tmp_path / CASE).write_text(toml_text(case), encoding="utf-8")
    with pytest.raises(GearboxFileError, match=words):
        Study.from_dict(study)
    (tmp_path / "a.study.toml").write_text(toml_text({**study, "case": CASE}), encoding="utf-8")
    outcome = exugear("study", tmp_path / "a.study.toml", "--out", tmp_path / "out")
    assert outcome.exit_code == 2 and words in outcome.stderr
    assert not (tmp_path / "out").exists()


def test_a_failed_point_of_a_life_names_parameter_and_value(tmp_path):
    parameters = {"bin": {"path": "loads.sources.spectrum.hours_per_year", "values": [-1.0]}}
    swept = run_study(Study.from_dict(content(tmp_path, parameters=parameters)), tmp_path / "out", processes(1))
    (error,) = [record.error for record in swept.records.values()]
    assert "parameters.bin: loads.sources.spectrum.hours_per_year = -1.0" in error
    assert np.isnan(swept.dataset["S_H"].to_numpy()).all()


def hashes(folder: Path, change=lambda case: None, **changes) -> str:
    study = content(folder, **changes)
    case = content_of((folder / "loads.csv").read_text() if "files" in changes else TABLE, folder)
    change(case)
    (folder / CASE).write_text(toml_text(case), encoding="utf-8")
    return Study.from_dict(study).case_hash


def test_points_belong_to_all_that_their_figures_read(tmp_path):
    """Settings of tables belong to every point; loads, also by a pattern of files, and strengths to lives alone."""
    modal = {
        "outputs": {"f": {"quantity": "frequencies"}},
        "parameters": {"a": {"path": "housing.factor", "values": [1]}},
    }
    seats = {"parameters": {"a": {"path": "housing.factor", "values": [1]}}}

    def finer(case):
        case["ste"] = {**case["ste"], "positions": 10}

    def weaker(case):
        case["rating"]["gears"]["pinion"]["sigma_H_lim_MPa"] = 900.0

    assert hashes(tmp_path, **modal) == hashes(tmp_path, weaker, **modal) != hashes(tmp_path, finer, **modal)
    assert hashes(tmp_path, **seats) != hashes(tmp_path, weaker, **seats)
    series = "time_s,shaft_1_N_m,shaft_1_rpm\n" + "".join(f"{n},{{}},1000\n" for n in range(50))

    def many(case):
        case["loads"]["sources"]["spectrum"] = {"files": "dlc/*.csv", "hours_per_year": 100.0, "skip_s": 0.0}

    (tmp_path / "dlc").mkdir()
    found = []
    for torque in (90.0, 95.0):
        (tmp_path / "dlc" / "one.csv").write_text(series.replace("{}", str(torque)))
        found += [hashes(tmp_path, many, **seats), hashes(tmp_path, many, **modal)]
    assert found[0] != found[2] and found[1] == found[3]


@pytest.mark.validation
def test_json_of_the_verb_has_no_number_that_json_has_not(swept):
    folder, _ = swept
    (folder / "a.study.toml").write_text(toml_text({**content(folder), "case": CASE}), encoding="utf-8")
    outcome = exugear("study", folder / "a.study.toml", "--out", folder / "out", "--workers", "1", "--json")
    assert outcome.exit_code == 0, outcome.stderr
    assert json.loads(outcome.stdout, parse_constant=lambda token: pytest.fail(token))["finished"] == 2
