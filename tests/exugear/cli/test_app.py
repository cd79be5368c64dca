"""The command line as a user meets it: what is printed where, and the exit codes."""

from __future__ import annotations

import contextlib
import functools
import gc
import inspect
import json
import shutil
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
import xarray

from exugear.cli.app import COMMANDS, OBJECTS_OF_A_START, app, garbage_seldom_looked_for
from exugear.cli.commands import files, models
from exugear.cli.console import BadInputError, FailedError, exit_codes, interruption
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.system.tooth_mesh.tables import requested_tables
from fe_ste.elasticity.gear_mesh import ContactMesh
from fe_ste.reference.position import NonlinearSettings
from fe_ste.reference.table import NonlinearInput
from fe_ste.transmission_error.cycle import DEFAULT_POSITIONS
from fe_ste.transmission_error.table import MeshTable

from ..cases.command import exugear
from ..cases.spur import SPUR_CASE

pytestmark = pytest.mark.usefixtures("coarse_tables")

CASE = Path(__file__).parents[3] / "cases" / "grc750" / "gearbox.toml"


def changed_case(tmp_path, old, new):
    """Write the case with one piece of its text replaced."""
    text = CASE.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path = tmp_path / "gearbox.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_check_prints_the_ratio_and_the_pairs():
    outcome = exugear("check", CASE)
    assert outcome.exit_code == 0, outcome.stderr
    assert "no errors; 81.5 : 1, speed-increasing" in outcome.stdout
    assert "sun_planet" in outcome.stdout
    assert outcome.stderr == ""


def test_check_names_modes_with_unusual_damping(tmp_path):
    case = tmp_path / "gearbox.toml"
    text = template("parallel")
    stated = "modal_percent = 2.0\nmodal_band_percent = [1.0, 4.0]\n"
    assert stated in text
    case.write_text(text.replace(stated, "mesh_time_s = 4e-6\nbearing_time_s = 4e-6\n"), encoding="utf-8")
    (warning,) = exugear("check", case).stderr.splitlines()
    assert warning.startswith("Warning: damping of ")
    assert "modal_percent = 2.0" in warning


def test_check_as_json_is_one_object_on_standard_output():
    outcome = exugear("check", CASE, "--json")
    summary = json.loads(outcome.stdout)
    assert outcome.exit_code == 0
    # Follows from the tooth numbers alone.
    assert summary["ratio"] == pytest.approx((1 + 99 / 21) * 82 / 23 * 88 / 22, rel=1e-12)
    assert [pair["teeth"] for pair in summary["pairs"]] == [[21, 39], [39, 99], [23, 82], [22, 88]]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("teeth = 21 ", "teeth = -21 ", ["gears.sun.teeth", "-21", "between 5 and 2000"]),
        ("teeth = 21 ", "theeth = 21 ", ["gears.sun.theeth", "did you mean 'teeth'"]),
        ("teeth = 21 ", "teeth 21 ", ["not valid TOML"]),
    ],
)
def test_a_fault_in_the_file_is_one_message_on_standard_error_and_code_2(tmp_path, old, new, said):
    case = changed_case(tmp_path, old, new)
    outcome = exugear("check", case)
    assert outcome.exit_code == 2
    assert outcome.stdout == ""
    assert len(outcome.stderr.splitlines()) == 1
    for words in [str(case), *said]:
        assert words in outcome.stderr


def test_a_missing_file_is_bad_input(tmp_path):
    outcome = exugear("check", tmp_path / "absent.toml")
    assert outcome.exit_code == 2
    assert "absent.toml" in outcome.stderr


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (BadInputError("x.toml: wrong"), 2, "Bad input: x.toml: wrong"),
        (FailedError("no solution"), 1, "Failed: no solution"),
        (KeyboardInterrupt(), 130, "Stopped: finished results are kept"),
    ],
)
def test_exit_codes(error, code, said, capsys):
    with pytest.raises(SystemExit) as ended, exit_codes():
        raise error
    assert ended.value.code == code
    assert said in capsys.readouterr().err


def test_every_command_is_offered_once():
    written = {
        f"{module.__name__.rpartition('.')[2]}.{name}"
        for module in (files, models)
        for name, value in vars(module).items()
        if inspect.isfunction(value) and value.__module__ == module.__name__ and not name.startswith("_")
    }
    assert set(COMMANDS) == written
    assert [command.callback.__name__ for command in app.registered_commands] == [
        place.partition(".")[2] for place in COMMANDS
    ]


def test_the_help_of_ste_names_the_default_number_of_positions():
    # The help starts without NumPy, so that it cannot take the number from where it is defined.
    assert f"else {DEFAULT_POSITIONS};" in " ".join(inspect.getsource(models.ste).split())


def test_no_help_text_loses_a_section_in_brackets_as_if_it_were_markup():
    assert "section [loads]" in exugear("loads", "--help").stdout


def test_the_version_is_that_of_the_distribution():
    assert exugear("--version").stdout.split() == ["exugear", version("exugear")]


@pytest.fixture
def spur_case(tmp_path):
    path = tmp_path / "spur.toml"
    path.write_text(SPUR_CASE, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    """The spur pair's table and pictures, computed once; nobody changes them."""
    folder = tmp_path_factory.mktemp("computed")
    case = folder / "spur.toml"
    case.write_text(SPUR_CASE, encoding="utf-8")
    return case, folder / "out", exugear("ste", case, "--positions", 8, "--out", folder / "out", "--json")


@pytest.mark.validation
def test_ste_writes_a_table_and_its_pictures_and_names_them(computed):
    _, out, outcome = computed
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    (table,) = summary["tables"]
    assert table["not_converged"] == 0
    assert sorted(path.name for path in out.rglob("*.nc")) == ["spur.nc"]
    assert {"ste.png", "load_share_spur.png"} <= {Path(picture).name for picture in summary["pictures"]}
    assert all(Path(picture).is_file() for picture in summary["pictures"])


def test_xarray_alone_reads_the_table(computed):
    _, out, outcome = computed
    with xarray.open_dataset(out / "tables" / "spur.nc") as table:
        assert dict(table.sizes) | {"pmc": 8, "torque": 1} == dict(table.sizes)
        # The file holds what the summary says.
        mean = json.loads(outcome.stdout)["tables"][0]["ste_mean_um"]
        assert float(table["ste"].mean()) == pytest.approx(1e-6 * mean, rel=1e-12)


def test_a_second_run_keeps_what_fits_and_another_number_of_positions_does_not(computed):
    case, out, _ = computed
    table = out / "tables" / "spur.nc"
    written = table.stat().st_mtime_ns
    outcome = exugear("ste", case, "--positions", 8, "--out", out, "--all")
    assert outcome.exit_code == 0
    assert "spur: cached table" in outcome.stdout
    assert table.stat().st_mtime_ns == written
    gearbox = Gearbox.from_toml(case)
    assert requested_tables(gearbox, out, positions=8)[0].stored
    assert "another input" in requested_tables(gearbox, out, positions=9)[0].replaces


def test_a_damaged_table_is_computed_again(spur_case, tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "spur.nc").write_bytes(b"no netCDF")
    (request,) = requested_tables(Gearbox.from_toml(spur_case), tmp_path)
    assert request.stored is None
    assert "spur.nc" in request.replaces
    assert request.announcement.endswith("; computing it again")


@pytest.mark.validation
def test_what_is_computed_again_is_not_asked_of_the_reader(computed):
    case, out, _ = computed
    gearbox = Gearbox.from_toml(case)
    (fewer,) = requested_tables(gearbox, out, positions=9)
    assert fewer.announcement.endswith("with other positions; computing it again")
    (wider,) = requested_tables(gearbox, out, positions=8, grid=True)
    assert wider.replaces.endswith(": does not vary load, centre distance and misalignment as required; recompute it")
    assert wider.announcement.endswith("as required; computing it again")
    (other,) = requested_tables(gearbox.varied({"static_load.torques_N_m.shaft_1": 90.0}), out)
    assert other.announcement.endswith("spur.nc: was computed from another input; computing it again")


@pytest.mark.validation
def test_another_process_draws_the_same_curves(computed, tmp_path, monkeypatch):
    case, out, _ = computed
    shutil.copytree(out / "tables", tmp_path / "tables")
    monkeypatch.setattr("exugear.cli.tasks.ste.WORTH_A_PROCESS", 0)
    outcome = exugear("ste", case, "--positions", 8, "--out", tmp_path)
    assert outcome.exit_code == 0, outcome.stderr
    for name in ("ste.png", "load_share_spur.png"):
        assert (tmp_path / "pictures" / name).read_bytes() == (out / "pictures" / name).read_bytes()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--mesh", "bevel"], "'bevel'; the pairs are spur"),
        (["--positions", "3"], "--positions 3: a table for dynamics requires at least 8"),
        (["--method", "nonlinear", "--grid"], "remove --grid"),
        (["--method", "nonlinear", "--mesh", "bevel"], "'bevel'; the pairs are spur"),
        (["--method", "guess"], "superelement"),
    ],
)
def test_ste_with_bad_options_writes_nothing(spur_case, tmp_path, options, said):
    out = tmp_path / "out"
    outcome = exugear("ste", spur_case, "--out", out, *options)
    assert outcome.exit_code == 2
    assert said in outcome.stderr
    assert outcome.stdout == ""
    assert not out.exists()


@pytest.mark.validation
def test_the_nonlinear_method_writes_a_table_of_its_own_and_goes_on_from_it(spur_case, tmp_path, monkeypatch):
    mesh = ContactMesh(layers=3, contact_elements=4, growth=0.8, thickness=8, fillet=3, root=2, rim=6, far_flank=4)
    coarse = functools.partial(NonlinearInput, settings=NonlinearSettings(mesh=mesh))
    monkeypatch.setattr("exugear.system.tooth_mesh.reference_tables.NonlinearInput", coarse)
    command = ("ste", spur_case, "--method", "nonlinear", "--positions", 1, "--out", tmp_path)
    outcome = exugear(*command, "--json")
    assert outcome.exit_code == 0, outcome.stderr
    (summary,) = json.loads(outcome.stdout)["tables"]
    assert summary["method"] == "nonlinear" and summary["not_converged"] == 0
    path = tmp_path / "tables" / "spur-nonlinear.nc"
    assert Path(summary["table"]) == path and path.exists()
    assert not (tmp_path / "tables" / "spur.nc").exists()
    # The tables' method stands beside it; one position has no peak-to-peak value.
    assert summary["ste_mean_um"] == pytest.approx(summary["superelement_mean_um"], rel=0.05)
    assert summary["ste_peak_to_peak_um"] is None
    # Steel teeth: 14 to 20 N/(mm um) by ISO 6336.
    assert 5e9 < summary["mesh_stiffness_mean_N_per_m"] / 15e-3 < 25e9
    before = path.stat().st_mtime_ns
    again = exugear(*command, "--all")
    assert again.exit_code == 0 and "1/1" in again.stdout
    assert path.stat().st_mtime_ns == before
    assert not requested_tables(Gearbox.from_toml(spur_case), tmp_path)[0].stored


@pytest.mark.validation
def test_methods_that_do_not_agree_end_with_code_1(spur_case, tmp_path, monkeypatch):
    mesh = ContactMesh(layers=3, contact_elements=2, growth=2.0, thickness=3, fillet=1, root=1, rim=3, far_flank=4)
    crude = functools.partial(NonlinearInput, settings=NonlinearSettings(teeth=3, mesh=mesh))
    monkeypatch.setattr("exugear.system.tooth_mesh.reference_tables.NonlinearInput", crude)
    outcome = exugear("ste", spur_case, "--method", "nonlinear", "--positions", 1, "--out", tmp_path)
    assert outcome.exit_code == 1
    assert (
        "spur: the mean differs by -" in outcome.stderr
        and "% from the table used for dynamics; up to" in outcome.stderr
    )
    assert (tmp_path / "tables" / "spur-nonlinear.nc").exists()


def test_a_results_folder_that_is_a_file_is_told_before_the_work(spur_case):
    outcome = exugear("ste", spur_case, "--out", spur_case)
    assert outcome.exit_code == 2
    assert "--out" in outcome.stderr


def test_a_pair_without_load_is_bad_input(tmp_path):
    case = tmp_path / "idle.toml"
    case.write_text(SPUR_CASE.replace("shaft_1 = 100.0 }, locked", "shaft_1 = 0.0 }, locked"), encoding="utf-8")
    outcome = exugear("ste", case, "--out", tmp_path / "out")
    assert outcome.exit_code == 2
    assert "pairs.spur" in outcome.stderr


def test_positions_that_are_not_solved_are_reported_and_end_with_code_1(computed, tmp_path):
    case, out, _ = computed
    (request,) = requested_tables(Gearbox.from_toml(case), out, positions=8)
    data = request.stored.dataset.copy(deep=True)
    data["converged"][2], data["ste"][2] = False, np.nan
    data.attrs["failures"] = "pmc 0.250, torque 100 N m: no balance"
    MeshTable(data).save(tmp_path / "tables" / "spur.nc")
    shutil.copytree(out / "pictures", tmp_path / "pictures")
    outcome = exugear("ste", case, "--positions", 8, "--out", tmp_path, "--all")
    assert outcome.exit_code == 1
    assert "spur: pmc 0.250, torque 100 N m: no balance" in outcome.stderr
    assert "7/8" in outcome.stdout


@pytest.mark.validation
@pytest.mark.usefixtures("terminal_signals")
def test_ctrl_c_ends_with_130_and_leaves_no_half_written_table(spur_case, tmp_path):
    out = tmp_path / "out"
    program = "from exugear.cli.app import main; main()"
    command = [sys.executable, "-c", program, "ste", str(spur_case), "--out", str(out)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    # The folder is made right before the finite elements, which take seconds.
    deadline = time.monotonic() + 60.0
    while not out.exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "Stopped" in said
    assert not list(out.rglob("*.nc*"))


@pytest.mark.usefixtures("terminal_signals")
def test_ctrl_c_that_a_callback_swallowed_still_stops(capsys):
    with pytest.raises(SystemExit) as end, exit_codes():
        with contextlib.suppress(KeyboardInterrupt):  # what a finaliser or a library's callback does with it
            signal.raise_signal(signal.SIGINT)
        interruption.check()
    assert end.value.code == 130
    assert "Stopped" in capsys.readouterr().err


@pytest.mark.usefixtures("terminal_signals")
def test_work_after_a_stopped_one_is_not_stopped():
    with pytest.raises(SystemExit), exit_codes():
        signal.raise_signal(signal.SIGINT)
    with exit_codes():
        interruption.check()


def test_a_command_leaves_python_as_it_found_it() -> None:
    """Within a command garbage is looked for seldom; whoever calls it from a program has their own settings back."""
    before = gc.get_threshold()
    with pytest.raises(RuntimeError), garbage_seldom_looked_for():
        assert gc.get_threshold()[0] == OBJECTS_OF_A_START
        raise RuntimeError
    assert gc.get_threshold() == before
    assert gc.get_freeze_count() > 0
    gc.unfreeze()
