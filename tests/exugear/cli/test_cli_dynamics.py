"""The verbs of dynamics as a user meets them: what they write and print, and how they end."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest
import xarray as xr

from exugear.cli.commands import models
from exugear.cli.options import MeshModel
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.variant import Variant, VariantError
from exugear.system.tooth_mesh.laws.registry import MESH_MODELS
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.tables import missing_tables, requested_tables
from exugear.transient.outcome import RunError
from exugear.transient.runup import SOLVERS
from exugear.transient.runup import simulate as real_simulate
from fe_ste.tools.drawing import RenderingError

from ..cases.bearing import BEARING_CASE
from ..cases.command import exugear
from ..cases.floating import FLOATING_CASE
from ..cases.spur import SPUR_CASE

pytestmark = pytest.mark.usefixtures("coarse_tables")


def iso(verb, case, *more):
    """Call a verb with the law that needs no tables."""
    return exugear(verb, case, "--mesh-model", "iso6336", "--out", case.parent / "out", *more)


def test_the_choices_offered_are_those_of_the_library():
    assert [law.value for law in MeshModel] == list(MESH_MODELS)
    assert set(get_args(get_type_hints(models.run)["solver"])) == set(SOLVERS)


def test_a_variant_is_refused_at_once_and_the_one_meant_is_named():
    for name, text in (("bush", "did you mean 'bushing'"), ("none", "variants are rigid, bushing, flexible")):
        with pytest.raises(VariantError, match=text):
            Choice(name)
    with pytest.raises(VariantError, match="is for internal comparisons only; variants are"):
        Variant.offered("jointed")


@pytest.mark.parametrize("verb", ["modes", "steady"])
def test_without_a_variant_the_usual_one_of_the_gearbox_is_computed_and_named(case, verb):
    on_bearings = iso(verb, case, "--json")
    assert json.loads(on_bearings.stdout)["variant"] == "bushing", on_bearings.stderr
    assert "Variant " not in on_bearings.stderr
    text = case.read_text(encoding="utf-8")
    case.write_text(text.replace("radial_N_per_m = 2e7, ", "radial_N_per_m = 0.0, "), encoding="utf-8")
    on_joints = iso(verb, case, "--json")
    assert json.loads(on_joints.stdout)["variant"] == "rigid", on_joints.stderr
    assert "Variant rigid (ideal joints): bushing is not available, " in on_joints.stderr


@pytest.mark.sample
@pytest.mark.parametrize("variant", ["rigid", "bushing"])
@pytest.mark.parametrize("solver", ["compiled", "exudyn"])
def test_run_writes_results_and_sums_them_up(case, variant, solver):
    outcome = iso("run", case, "--variant", variant, "--solver", solver, "--duration", 0.02, "--json")
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    path = Path(summary["file"])
    assert path == case.parent / "out" / variant / "run_up-iso6336-disc" / "run.nc"
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.attrs["complete"] == 1
        assert len(data.attrs["input_hash"]) == 64
    # (100 - 140 / 1.5) N m over the inertia referred to the pinion, 1e-2 + 3e-2 / 1.5^2 kg m2; 20 ms less the
    # end of the filter, 1 ms. Elastic parts of the motion stay under 1 % of it.
    expected = (100 - 140 / 1.5) / (1e-2 + 3e-2 / 2.25) * 0.02 * 30 / np.pi
    assert summary["input_speed_rpm"] == pytest.approx(expected, rel=0.08)
    assert abs(summary["energy_not_accounted_for"]) < 1e-3


@pytest.mark.validation
def test_a_floating_frame_asks_for_exudyn_before_anything_is_computed(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(FLOATING_CASE, encoding="utf-8")
    outcome = exugear("run", case, "--variant", "flexible", "--load-case", "run_up")
    assert outcome.exit_code == 2
    message = " ".join(outcome.stderr.split())
    assert "bodies.shaft.flexibility = 'ffrf' requires Exudyn; add --solver exudyn" in message
    assert list(tmp_path.iterdir()) == [case]
    outcome = iso("run", case, "--variant", "flexible", "--solver", "exudyn", "--duration", 0.002, "--json")
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    assert summary["solver"].endswith("generalized-alpha")


def test_a_solid_whose_file_is_missing_is_refused_before_anything_is_written(tmp_path):
    case = tmp_path / "case.toml"
    content = SPUR_CASE.replace(
        "[bodies.shaft_2]",
        """[bodies.shaft_2]
flexibility = "elastic"
solid = { file = "shaft.msh", seats = { bearing_2 = { diameter_mm = 40.0, width_mm = 10.0 } } }
""",
    )
    case.write_text(content, encoding="utf-8")
    outcome = iso("modes", case, "--variant", "flexible")
    assert outcome.exit_code == 2
    assert "bodies.shaft_2.solid.file = 'shaft.msh': no such file" in " ".join(outcome.stderr.split())
    assert list(tmp_path.iterdir()) == [case]


def test_modes_are_those_of_the_closed_form(case):
    outcome = iso("modes", case, "--variant", "rigid", "--json")
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    gearbox = Gearbox.from_toml(case)
    pair = gearbox.pairs["spur"].pair
    stiffness = mesh_stiffness(gearbox, "iso6336")["spur"][0]
    flexibility = pair.pinion.base_radius**2 / 1e-2 + pair.gear.base_radius**2 / 3e-2
    assert [mode["frequency_Hz"] for mode in summary["modes"]] == [
        0.0,
        pytest.approx(np.sqrt(stiffness * flexibility) / (2 * np.pi), rel=1e-9),  # one spring, one degree of freedom
    ]
    assert summary["modes"][1]["te_participation"] == pytest.approx(1.0, abs=1e-12)
    assert Path(summary["file"]) == case.parent / "out" / "rigid" / "iso6336-disc" / "modes.nc"
    assert Path(summary["picture"]).is_file()


@pytest.mark.validation
def test_missing_tables_are_computed_first_and_kept_for_the_next_verb(case, tmp_path):
    out = tmp_path / "out"
    first = exugear("modes", case, "--variant", "rigid", "--out", out)
    assert first.exit_code == 0, first.stderr
    assert "spur" in first.stderr
    assert "computing it first" in first.stderr
    written = (out / "tables" / "spur.nc").stat().st_mtime_ns
    second = exugear("run", case, "--variant", "rigid", "--duration", 0.01, "--out", out)
    assert second.exit_code == 0, second.stderr
    assert (out / "tables" / "spur.nc").stat().st_mtime_ns == written


def test_dynamics_refuses_a_table_of_another_input_but_not_of_other_positions(case, tmp_path):
    out = tmp_path / "out"
    gearbox = Gearbox.from_toml(case)
    requested_tables(gearbox, out, positions=9)[0].compute()
    assert not missing_tables(gearbox, out)
    assert mesh_stiffness(gearbox, "line_of_action", out)["spur"].stiffness.shape == (9,)
    wider = gearbox.varied({"gears.wheel.face_width_mm": 16.0})
    assert [request.name for request in missing_tables(wider, out)] == ["spur"]
    with pytest.raises(MeshError, match="another input"):
        mesh_stiffness(wider, "line_of_action", out)


@pytest.mark.parametrize(
    ("verb", "options", "said"),
    [
        ("run", ["--variant", "flexibel"], "'flexible'?"),
        ("run", ["--variant", "rigid", "--inertias", "none"], "sets are disc"),
        ("modes", ["--variant", "rigid", "--inertias", "none"], "sets are disc"),
        ("run", ["--variant", "rigid", "--load-case", "nothing"], "choose one of: run_up"),
        ("run", ["--variant", "rigid", "--duration", "-1"], "duration = -1"),
        ("run", ["--variant", "rigid", "--resume"], ": no interrupted run with these settings"),
        ("run", ["--variant", "bushing", "--mesh-model", "kinematic"], "requires --variant rigid"),
    ],
)
def test_bad_input_is_one_message_and_code_2(case, verb, options, said):
    outcome = iso(verb, case, *options)
    assert outcome.exit_code == 2
    assert outcome.stdout == ""
    assert said in outcome.stderr
    assert "Traceback" not in outcome.stderr
    assert not (case.parent / "out").exists()


def test_a_run_that_fails_ends_with_code_1(case, monkeypatch):
    def failing(*arguments, **options):
        raise RunError("the state is not finite at t = 0.1 s")

    monkeypatch.setattr("exugear.project.simulate", failing)
    outcome = iso("run", case, "--variant", "rigid")
    assert outcome.exit_code == 1
    assert "Failed: the state is not finite" in outcome.stderr


@pytest.mark.validation
@pytest.mark.usefixtures("terminal_signals")
def test_ctrl_c_keeps_the_run_and_resume_ends_it_as_if_nothing_had_been(case, monkeypatch):
    def interrupted(*arguments, progress, **options):
        def press(at):
            progress(at)
            os.kill(os.getpid(), signal.SIGINT)

        return real_simulate(*arguments, progress=press, **options)

    duration = ("--variant", "rigid", "--duration", 0.6)
    with monkeypatch.context() as patch:
        patch.setattr("exugear.project.simulate", interrupted)
        stopped = iso("run", case, *duration)
    assert stopped.exit_code == 130
    assert "--resume" in stopped.stderr
    folder = case.parent / "out" / "rigid" / "run_up-iso6336-disc"
    assert (folder / "run.partial" / "000001.npz").is_file()
    assert sorted(path.name for path in folder.iterdir()) == ["run.partial"]
    resumed = iso("run", case, *duration, "--resume")
    assert resumed.exit_code == 0, resumed.stderr
    with xr.open_dataset(folder / "run.nc", engine="h5netcdf") as data:
        pieces = data["overall_dte"].to_numpy()
    assert iso("run", case, *duration).exit_code == 0
    with xr.open_dataset(folder / "run.nc", engine="h5netcdf") as data:
        assert np.array_equal(data["overall_dte"].to_numpy(), pieces)


@pytest.mark.usefixtures("terminal_signals")
def test_a_stopped_run_goes_on_to_the_duration_of_its_first_call(case, monkeypatch):
    def interrupted(*arguments, progress, **options):
        return real_simulate(*arguments, progress=lambda at: os.kill(os.getpid(), signal.SIGINT), **options)

    monkeypatch.setattr("exugear.transient.recorder.FLUSH_INTERVAL", 0.05)
    rigid = ("--variant", "rigid")
    with monkeypatch.context() as patch:
        patch.setattr("exugear.project.simulate", interrupted)
        stopped = iso("run", case, *rigid, "--duration", 1.3)  # the load case's is 0.3 s
    assert stopped.exit_code == 130
    out = case.parent / "out"
    again = f"exugear run {case} --variant rigid --mesh-model iso6336 --duration 1.3 --out {out} --resume"
    assert again in stopped.stderr
    shorter = iso("run", case, *rigid, "--duration", 0.01, "--resume")
    assert shorter.exit_code == 2
    assert "a duration of 0.01 s ends before that; set a longer duration" in shorter.stderr
    resumed = iso("run", case, *rigid, "--resume", "--json")
    assert resumed.exit_code == 0, resumed.stderr
    assert json.loads(resumed.stdout)["simulated_s"] == pytest.approx(1.3)


def test_a_band_that_is_asked_for_is_kept_and_one_that_misses_a_mesh_is_told(case):
    """20 teeth beyond 6.4 kHz want 20000 rpm; an overdriven pair reaches it in a moment."""
    text = case.read_text(encoding="utf-8").replace("duration_s = 1.0", "start_speed_rpm = 25000.0, duration_s = 0.05")
    case.write_text(text, encoding="utf-8")
    usual = iso("run", case, "--variant", "rigid", "--json")
    said = "beyond the stored band: the run stores frequencies up to 6400 Hz, and mesh frequencies reach spur 83"
    assert f"load_cases.run_up: {said}" in usual.stderr
    assert "; use exugear run --band 8400" in usual.stderr
    assert json.loads(usual.stdout)["band_doubt"].startswith(said)
    wide = iso("run", case, "--variant", "rigid", "--band", 8400, "--json")
    assert wide.exit_code == 0, wide.stderr
    assert "beyond the stored band: the run stores frequencies up to" not in wide.stderr
    summary = json.loads(wide.stdout)
    assert (summary["band_Hz"], summary["band_doubt"]) == (8400.0, "")
    with xr.open_dataset(summary["file"], engine="h5netcdf") as data:
        assert 1.0 / float(np.diff(data["time"])[0]) == pytest.approx(40e3)
    assert iso("run", case, "--variant", "rigid", "--band", 0).exit_code == 2


@pytest.mark.validation
@pytest.mark.parametrize("verb", ["check", "ste", "bearings", "life"])
def test_contact_stresses_are_printed_with_load_factors_and_place(tmp_path, verb):
    content = (
        BEARING_CASE
        + """
[rating]
dynamic_factor = 1.1
viscosity_40_mm2_per_s = 320.0
[loads]
body = "shaft_1"
life_years = 1.0
[loads.sources.drive]
file = "duty.csv"
"""
    )
    case = tmp_path / "gearbox.toml"
    case.write_text(content, encoding="utf-8")
    (tmp_path / "duty.csv").write_text("torque_N_m,speed_rpm,hours\n100,1000,3\n", encoding="utf-8")
    options = ("--out", tmp_path / "out")
    assert "load factors" in " ".join(exugear(verb, case, *options).stdout.split()) or verb == "bearings"
    said = " ".join(exugear(verb, case, *options, "--all").stdout.split())
    assert "load factors" in said
    places = {
        "check": "pitch point",
        "ste": "parallel axes",
        "bearings": "at this misalignment",
        "life": "misaligned by each load",
    }
    assert places[verb] in said


def test_view_writes_a_page_where_nothing_can_be_rendered(case, monkeypatch):
    def unable(*arguments, **options):
        raise RenderingError("3-D pictures need pyvista: pip install")

    monkeypatch.setattr("exugear.cli.tasks.view.draw_gearbox", unable)
    outcome = iso("view", case, "--variant", "rigid", "--json")
    assert outcome.exit_code == 0, outcome.stderr
    (page,) = json.loads(outcome.stdout)["files"]
    assert "mode" in Path(page).read_text(encoding="utf-8")
    assert "pip install" in outcome.stderr


@pytest.mark.validation
def test_view_refuses_a_resonance_that_it_cannot_show(case):
    """There is no response; then one without resonances, since the stiffness is constant over the mesh cycle."""
    both = iso("view", case, "--near", 100, "--resonance", 1)
    missing = iso("view", case, "--variant", "rigid", "--resonance", 1)
    assert iso("steady", case, "--variant", "rigid").exit_code == 0
    beyond = iso("view", case, "--variant", "rigid", "--resonance", 1)
    for outcome, text in ((both, "omit one"), (missing, "run: exugear steady"), (beyond, "has 0 resonances")):
        assert outcome.exit_code == 2
        assert text in " ".join(outcome.stderr.split())
    assert not [file for name in ("*.html", "modes.nc") for file in case.parent.rglob(name)]
    page = Path(json.loads(iso("view", case, "--variant", "rigid", "--json").stdout)["files"][0])
    assert "There is no resonance in the ranking." in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["absent", "empty"])
def test_report_of_a_folder_without_results_is_bad_input(tmp_path, name):
    (tmp_path / "empty").mkdir()
    outcome = exugear("report", tmp_path / name)
    assert outcome.exit_code == 2
    assert name in outcome.stderr
    assert not (tmp_path / name / "report.html").exists()


@pytest.mark.validation
def test_report_says_where_it_is_and_where_the_time_went(case):
    for variant in ("rigid", "bushing"):
        assert iso("modes", case, "--variant", variant).exit_code == 0
    outcome = exugear("report", case.parent / "out")
    assert outcome.exit_code == 0, outcome.stderr
    assert "report.html" in outcome.stdout
    assert outcome.stdout.splitlines()[-1] == f"Results: {case.parent / 'out' / 'report.html'}"
    outcome = exugear("report", case.parent / "out", "--all")
    assert "modes, bushing, disc, iso6336" in outcome.stdout
