"""Damaged, edited and outdated files of a results folder: each is refused in words or computed again, none is used."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from exugear.cli import app as cli
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.versions import MODES as METHOD
from exugear.results.folder import read_stored_gearbox, times_spent
from exugear.results.run_file import load_run, read_run
from exugear.system.modes import load_modes
from exugear.system.system import input_hash
from fe_ste.tools.files import FileError
from fe_ste.tools.stores import write_dataset

from ...fe_ste.damage import damages
from ..cases.spur import SPUR_CASE
from ..transient.test_kills import stopped_run

MODES = Path("rigid") / "iso6336-disc" / "modes.nc"
RUN = Path("rigid") / "run_up-iso6336-disc" / "run.nc"


def exugear(*arguments: object):
    outcome = CliRunner().invoke(cli.app, [str(argument) for argument in arguments])
    assert outcome.exception is None or isinstance(outcome.exception, SystemExit), outcome.exception
    return outcome


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder with modes and a run."""
    folder = tmp_path_factory.mktemp("damage")
    (folder / "spur.toml").write_text(SPUR_CASE, encoding="utf-8")
    for verb, more in (("modes", ()), ("run", ("--duration", "0.3"))):
        model = ("--variant", "rigid", "--mesh-model", "iso6336", "--out", folder / "out")
        assert exugear(verb, folder / "spur.toml", *model, *more).exit_code == 0
    return folder / "out"


@pytest.fixture
def out(finished: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(finished, tmp_path / "out"))


@pytest.mark.sample
@pytest.mark.parametrize(("name", "load", "count"), [(MODES, load_modes, 200), (RUN, load_run, 100)])
def test_no_damaged_result_is_read(out: Path, name: Path, load, count: int) -> None:
    path = out / name
    for damaged in damages(path.read_bytes(), count):
        path.write_bytes(damaged)
        with pytest.raises(FileError, match=rf"{path.name}: (has no checksum at its end|is damaged)"):
            load(path)


@pytest.mark.validation
def test_no_damaged_piece_is_gone_on_with(tmp_path: Path) -> None:
    (tmp_path / "spur.toml").write_text(SPUR_CASE, encoding="utf-8")
    folder = stopped_run(tmp_path / "spur.toml", tmp_path / "out")
    whole = load_run(folder)
    last = max(folder.iterdir())
    for damaged in damages(last.read_bytes(), 100):
        last.write_bytes(damaged)
        assert load_run(folder).sizes["time"] < whole.sizes["time"]


@pytest.mark.validation
def test_a_report_leaves_damaged_files_out_and_names_them(out: Path) -> None:
    content = (out / MODES).read_bytes()
    for damaged in damages(content, 4):
        (out / MODES).write_bytes(damaged)
        outcome = exugear("report", out, "--stored")
        assert outcome.exit_code == 0, outcome.stderr
        assert f"Warning: skipped: {out / MODES}: " in outcome.stderr
        assert "checksum" in outcome.stderr
    (out / RUN).write_bytes((out / RUN).read_bytes()[:-1000])
    outcome = exugear("report", out, "--stored")
    assert outcome.exit_code == 2
    assert f"{out / RUN}: has no checksum at its end" in outcome.stderr


def test_a_case_that_was_changed_since_is_refused(out: Path) -> None:
    path = out / "case.json"
    plain = json.loads(path.read_text(encoding="utf-8"))
    read_stored_gearbox(out)
    for damaged in damages(path.read_bytes(), 200):
        path.write_bytes(damaged)
        try:
            kept = read_stored_gearbox(out)
        except GearboxFileError as error:
            assert "case.json: cannot be used" in str(error)
        else:  # a blank or an end of line beside what it says
            assert kept.content == plain["content"]
    softer = json.dumps(plain).replace('"factor": 0.5', '"factor": 0.4')
    assert softer != json.dumps(plain)
    path.write_text(softer, encoding="utf-8")
    with pytest.raises(GearboxFileError, match="it was changed since it was written"):
        read_stored_gearbox(out)


@pytest.mark.parametrize(
    "content",
    [
        "[" * 5000,
        "[" * 5000 + "]" * 5000,
        '{"content": ' + "9" * 5000 + "}",
        '{"content": 3, "source": 3}',
        '{"source": 1}',
        "null",
        "[]",
        "\udcff",
        "",
    ],
)
def test_a_case_that_somebody_made_up_is_one_message(out: Path, content: str) -> None:
    (out / "case.json").write_bytes(content.encode("utf-8", errors="surrogateescape"))
    outcome = exugear("report", out, "--stored")
    assert outcome.exit_code == 2
    assert "case.json: cannot be used" in outcome.stderr


def test_an_account_of_times_with_nonsense_in_it_serves_as_far_as_it_can(out: Path) -> None:
    before = [spent.step for spent in times_spent(out)]
    nonsense = ["[" * 5000, '{"step": "x", "seconds": NaN, "memory": 1}', "1" * 5000, "null", '{"step": "cut']
    with (out / "times.jsonl").open("ab") as file:
        file.write("\n".join(nonsense).encode() + b"\n\xff\xfe\n")
    assert [spent.step for spent in times_spent(out)] == before
    assert exugear("report", out, "--stored").exit_code == 0


def test_results_of_an_earlier_version_of_a_method_do_not_fit(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("exugear.system.system.MODES", 1000)
    monkeypatch.setattr("exugear.system.system.RUN", 1000)
    outcome = exugear("report", out, "--stored")
    assert outcome.exit_code == 2
    assert f"{MODES}: was computed from another input; recompute it" in outcome.stderr
    assert f"{RUN}: was computed from another input; recompute it" in outcome.stderr


def test_a_file_of_an_earlier_version_says_so(out: Path) -> None:
    path = out / MODES
    write_dataset(path, load_modes(path).assign_attrs(method_version=0))
    with pytest.raises(FileError, match=f"computed by version 0 of its method, now at {METHOD}; recompute it"):
        load_modes(path)
    load_run(out / RUN).to_netcdf(out / RUN, engine="h5netcdf")  # as earlier versions wrote it
    with pytest.raises(FileError, match="written by an earlier version"):
        load_run(out / RUN)


def test_a_run_read_without_labels_has_the_same_numbers(out: Path) -> None:
    labelled = load_run(out / RUN)
    arrays, attributes = read_run(out / RUN, ("time", "overall_dte", "kinetic_energy"))
    assert all(np.array_equal(values, labelled[name]) for name, values in arrays.items())
    assert {key: attributes[key] for key in labelled.attrs} == labelled.attrs
    with pytest.raises(FileError, match="contains no heat"):
        read_run(out / RUN, ("heat",))


def test_the_hashes_of_runs_and_modes_differ_by_their_methods(monkeypatch: pytest.MonkeyPatch) -> None:
    from exugear.system.build import assemble

    gearbox = Gearbox.from_toml(Path(__file__).parents[3] / "cases" / "grc750" / "gearbox.toml")
    stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    assembly = assemble(gearbox, Choice("rigid"), stiffness)
    before = input_hash(assembly), input_hash(assembly, "reference")
    monkeypatch.setattr("exugear.system.system.RUN", 1000)
    assert input_hash(assembly) == before[0]
    assert input_hash(assembly, "reference") != before[1]
