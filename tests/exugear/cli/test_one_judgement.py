"""What one verb accepts, all accept, and say the same of it: doubtful cases through every verb, and in Python."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.project import Project
from exugear.studies.executors import processes
from exugear.studies.runner import run_study
from exugear.studies.study import Study
from exugear.system.gearbox_checks import check_parts, gearbox_warnings
from exugear.system.tooth_mesh import tables
from exugear.system.tooth_mesh.laws.iso6336 import iso6336_stiffness
from exugear.system.tooth_mesh.placement import loaded_flanks

from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..cases.ring import ring_content
from ..cases.spur import COARSE_INPUT, SPUR_CASE

SHORT = ("--duration", 0.01)
TWO_SPEEDS = ("--speeds", "1000:1010", "--points", "2")
COMMANDS: dict[str, tuple[object, ...]] = {
    "check": (),
    "ste": ("--positions", 8),
    "modes": ("--variant", "flexible"),
    "bearings": ("--variant", "flexible", "--mesh-model", "line_of_action"),
    "run": ("--variant", "bushing", *SHORT),
    "steady": ("--variant", "bushing", *TWO_SPEEDS),
}


def shafted() -> dict[str, Any]:
    """The spur pair with a turned shaft of 80 mm in ball bearings of 16 mm, whose shoulders they touch."""
    content = tomllib.loads(SPUR_CASE)
    content["bodies"]["shaft_1"] |= {
        "flexibility": "elastic",
        "shape": {"start_z_mm": -40.0, "sections": shaft(18.0)},
    }
    del content["bearings"]["bearing_1"]
    for name, place in (("left", -30.0), ("right", 30.0)):
        rings = {"type": "deep_groove_ball", "bore_mm": 30.0, "outer_diameter_mm": 62.0, "width_mm": 16.0}
        content["bearings"][name] = {"body": "shaft_1", "z_mm": place, "catalogue": rings}
    content["load_cases"]["run_up"]["start_speed_rpm"] = 100.0
    return content


def shaft(first_mm: float) -> list[dict[str, float]]:
    """Sections of the shaft with its first shoulder in some place."""
    lengths = ((first_mm, 30.0), (62.0 - first_mm, 36.0), (18.0, 30.0))
    return [{"length_mm": length, "outer_diameter_mm": diameter} for length, diameter in lengths]


def idle(content: dict[str, Any]) -> None:
    """A third wheel that the second drives, with nothing behind it."""
    content["gears"]["pump"] = content["gears"]["pinion"]
    content["pairs"]["idle"] = {"pinion": "pump", "gear": "wheel", "centre_distance_mm": 75.0}
    content["meshes"]["idle"] = {"pair": "idle", "pinion_body": "shaft_3", "gear_body": "shaft_2"}
    one = content["bodies"]["shaft_2"]
    content["bodies"]["shaft_3"] = one | {"axis_position_mm": [150.0, 0.0], "gears_z_mm": {"pump": 0.0}}
    content["joints"]["joint_3"] = {"body": "shaft_3", "z_mm": 0.0}
    content["bearings"]["bearing_3"] = content["bearings"]["bearing_2"] | {"body": "shaft_3"}


def across_a_shoulder(content: dict[str, Any]) -> None:
    content["bodies"]["shaft_1"]["shape"]["sections"] = shaft(16.5)


def into_a_bearing(content: dict[str, Any]) -> None:
    content["bearings"]["left"]["z_mm"] = -10.0
    content["bodies"]["shaft_1"]["shape"]["sections"] = [{"length_mm": 80.0, "outer_diameter_mm": 30.0}]


def near_a_form_circle(content: dict[str, Any]) -> None:
    """Profile shifts that cancel out, as much as the wheel's tip bears."""
    content["gears"]["pinion"]["profile_shift"], content["gears"]["wheel"]["profile_shift"] = 0.9, -0.9


DOUBTFUL: dict[str, tuple[Callable[[dict[str, Any]], None], str]] = {
    "idle pair": (idle, ", so no table is computed: mesh stiffness to ISO 6336-1, no excitation"),
    "shoulder": (
        across_a_shoulder,
        ".shape: the seat of left extends 1.5 mm beyond a shoulder or",
    ),
    "bearing": (
        into_a_bearing,
        "bodies.shaft_1.gears_z_mm.pinion = 0: the face width overlaps by 5.5 mm with bearings.left at z_mm =",
    ),
    "% of the profile length from the root form diameter of": (
        near_a_form_circle,
        "% of the profile length from the root form diameter of",
    ),
}


def content_of(change: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
    content = shafted()
    change(content)
    return content


def written(content: dict[str, Any], folder: Path) -> Path:
    path = folder / "gearbox.toml"
    path.write_text(toml_text(content), encoding="utf-8")
    return path


def one_line(text: str) -> str:
    return " ".join(text.split())


@pytest.fixture
def coarse(monkeypatch):
    monkeypatch.setattr(tables, "TableInput", COARSE_INPUT)


def test_the_case_behind_the_doubtful_ones_is_beyond_doubt():
    assert gearbox_warnings(Gearbox.from_dict(shafted())) == ()


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("name", DOUBTFUL)
def test_every_verb_accepts_a_doubtful_case_with_the_same_remark(name, tmp_path):
    change, remark = DOUBTFUL[name]
    case, folder = written(content_of(change), tmp_path), tmp_path / "results"
    for verb, options in COMMANDS.items():
        out = () if verb == "check" else ("--out", folder)
        result = exugear(verb, case, *options, *out)
        assert result.exit_code == 0, (verb, result.output)
        assert one_line(result.stderr).count(remark) == 1, (verb, result.stderr)
    gearbox = Gearbox.from_dict(shafted()).varied(content_of(change))
    check_parts(gearbox)
    assert sum(remark in line for line in gearbox_warnings(gearbox)) == 1
    assert Project(gearbox, folder).modes().frequency.size > 0


@pytest.mark.sample
@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("name", DOUBTFUL)
def test_a_study_accepts_a_doubtful_case(name, tmp_path):
    case = written(content_of(DOUBTFUL[name][0]), tmp_path)
    study = Study.from_dict(
        {
            "name": "seats",
            "case": str(case),
            "choice": {"variant": "flexible", "mesh_model": "line_of_action"},
            "parameters": {"seat": {"path": "housing.factor", "values": [0.4, 0.6]}},
            "outputs": {"frequency": {"quantity": "frequencies", "count": 2}},
        }
    )
    assert not run_study(study, tmp_path / "study", processes(1)).failed


def test_what_reaches_too_far_across_a_shoulder_every_verb_refuses_alike(tmp_path):
    content = shafted()
    content["bodies"]["shaft_1"]["shape"]["sections"] = shaft(12.0)
    case, folder, error = written(content, tmp_path), tmp_path / "results", "seat left: a shoulder lies between"
    for verb, options in COMMANDS.items():
        out = () if verb == "check" else ("--out", folder)
        result = exugear(verb, case, *options, *out)
        assert result.exit_code == 2 and error in one_line(result.stderr), (verb, result.output)
    with pytest.raises(GearboxFileError, match=error):
        check_parts(Gearbox.from_dict(shafted()).varied(content))
    assert not folder.exists()


WITH_WHOLE_TABLES = ("--variant", "bushing", "--mesh-model", "table")


@pytest.mark.parametrize(
    "arguments",
    [
        *((verb, *WITH_WHOLE_TABLES) for verb in ("modes", "bearings", "run", "steady")),
        *(("ste", "--mesh", "idle", "--method", method) for method in ("superelement", "nonlinear")),
    ],
    ids=" ".join,
)
def test_an_idle_pair_is_refused_before_any_work_where_its_table_is_needed(arguments, tmp_path):
    case, folder = written(content_of(idle), tmp_path), tmp_path / "results"
    verb, *options = arguments
    result = exugear(verb, case, *options, "--out", folder)
    assert result.exit_code == 2
    assert "; a table requires one, since it is for one loaded flank; set a torque on the driven body, or" in one_line(
        result.stderr
    )
    assert not folder.exists()


def test_an_idle_pair_is_as_stiff_as_the_standard_says_and_touches_on_the_flank_that_drags_it():
    """The wheel turns as the input drives it, and what it drives holds back: by friction, or as speed is gained."""
    gearbox = Gearbox.from_dict(content_of(idle))
    spec = gearbox.pairs["idle"]
    assert gearbox.idle_pairs == ("idle",) and not spec.table and spec.static_torque == 0.0
    assert gearbox.stated_stiffness == {"idle": (pytest.approx(iso6336_stiffness(spec)),)}
    loaded = gearbox.varied({"static_load.torques_N_m": {"shaft_1": 100.0, "shaft_3": -1.0}})
    assert loaded.idle_pairs == ()
    assert loaded_flanks(gearbox) == loaded_flanks(loaded)
    backwards = gearbox.varied({"static_load.torques_N_m": {"shaft_1": -100.0}})
    assert loaded_flanks(backwards) == {name: -flank for name, flank in loaded_flanks(gearbox).items()}


def test_a_seat_that_ends_at_its_shoulder_holds_the_shaft_as_one_that_fits(tmp_path):
    """The first four frequencies, to a thousandth: 1.5 mm more or less of 16 mm hardly count."""
    found = []
    for change in (lambda content: None, across_a_shoulder):
        gearbox = Gearbox.from_dict(content_of(change))
        project = Project(gearbox, tmp_path, Choice("flexible", "iso6336"))
        found.append([f for f in project.modes().frequency if f > 1.0][:4])
    assert found[1] == pytest.approx(found[0], rel=2e-3)


def with_steps(content: dict[str, Any]) -> None:
    content["ste"]["centre_distance_offsets_um"] = [-3000.0, 0.0, 100.0]


def with_stiffness(content: dict[str, Any]) -> None:
    content["pairs"]["spur"]["stiffness"] = {"mean_N_per_m": 2e8}


@pytest.mark.parametrize(
    ("change", "arguments", "reason"),
    [
        (with_steps, ("run", "--variant", "bushing", "--mesh-model", "table"), "ste.centre_distance_offsets_um: -3000"),
        (
            with_steps,
            ("modes", "--variant", "bushing", "--mesh-model", "table"),
            "ste.centre_distance_offsets_um: -3000",
        ),
        (with_steps, ("ste", "--grid"), "ste.centre_distance_offsets_um: -3000"),
        (
            with_stiffness,
            ("ste",),
            "pairs.spur.stiffness: is specified, so the pair has no table; remove it to compute one, or",
        ),
        (idle, ("ste", "--mesh", "spur", "--mesh", "nothing"), "no gear pair 'nothing'; the pairs are spur, idle"),
        (idle, ("ste", "--mesh", "nothing", "--method", "nonlinear"), "no gear pair 'nothing'"),
        (
            idle,
            ("run", "--variant", "rigid", "--load-case", "nothing"),
            "no load case 'nothing'; choose one of: run_up",
        ),
        (idle, ("bearings", "--inertias", "nothing"), "inertia set 'nothing' is unknown; sets are disc"),
    ],
)
def test_what_cannot_be_computed_is_refused_before_any_work(change, arguments, reason, tmp_path):
    verb, *options = arguments
    result = exugear(verb, written(content_of(change), tmp_path), *options, "--out", tmp_path / "results")
    assert result.exit_code == 2
    assert reason in one_line(result.stderr)
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize("verb", ["ste", "modes", "run", "steady", "bearings"])
def test_a_folder_that_cannot_be_is_refused_before_any_work(verb, tmp_path):
    case = written(shafted(), tmp_path)
    variant = () if verb in ("ste", "bearings") else ("--variant", "bushing")
    result = exugear(verb, case, *variant, "--out", case / "results")
    assert result.exit_code == 2
    assert f"--out {case}" in one_line(result.stderr).replace("- ", "-")


def test_gears_that_only_roll_have_modes_of_rolling_alone(tmp_path):
    case = written(shafted(), tmp_path)
    result = exugear("modes", case, "--variant", "rigid", "--mesh-model", "kinematic", "--out", tmp_path, "--json")
    assert result.exit_code == 0, result.output
    assert [mode["frequency_Hz"] for mode in json.loads(result.stdout)["modes"]] == [0.0]


def test_a_flexible_ring_that_steady_cannot_treat_is_refused_before_its_finite_elements(grc, tmp_path):
    """As `check` says it, though only the elastic body itself knows the seats that its meshes travel around.

    The ring turns around a carrier that is held.
    """
    content = ring_content(grc, tmp_path)
    ring, carrier = (content["bodies"][name] for name in ("housing", "carrier"))
    del ring["fixed"]
    ring["inertia"] = carrier.pop("inertia")
    carrier["fixed"] = True
    held = {"radial_N_per_m": 4e9, "axial_N_per_m": 4e9, "tilt_N_m_per_rad": 1e9}
    bearings = {name: own for name, own in content["bearings"].items() if own["body"] != "carrier"}
    seats = ring["solid"]["seats"]
    for name, mount in content.pop("mounts").items():
        bearings[f"ring_{name}"] = {"body": "housing", "z_mm": mount["position_mm"][2], "stiffness": held}
        seats[f"ring_{name}"] = seats.pop(name)
    content |= {"bearings": bearings, "load_cases": {}}
    content["overall"]["input"] = "housing"
    content["static_load"]["torques_N_m"] = {"housing": 240e3}
    case = written(content, tmp_path)
    checked = exugear("check", case, "--json")
    reason = json.loads(checked.stdout)["steady"]["flexible"]
    assert reason.startswith("bodies.housing: the flexible ring gear rotates")
    result = exugear(
        "steady", case, "--variant", "flexible", "--speeds", "0:100", "--points", "5", "--out", tmp_path / "results"
    )
    assert result.exit_code == 2 and one_line(reason) in one_line(result.stderr)
    assert not (tmp_path / "results").exists()
