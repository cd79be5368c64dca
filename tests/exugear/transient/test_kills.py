"""Kills, full disks and neighbours: nothing that was finished is lost, and nothing wrong is gone on with."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.project import Project
from exugear.results.run_file import load_run
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.transient import recorder, runup
from exugear.transient.outcome import Progress, RunError
from fe_ste.tools.files import FileError
from fe_ste.transmission_error.table import MeshTable

from ..cases.command import exugear
from ..cases.spur import SPUR_CASE

ROOT = Path(__file__).parents[3]
DIRECTORY = Path("rigid") / "run_up-iso6336-disc"


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "spur.toml"
    path.write_text(SPUR_CASE, encoding="utf-8")
    return path


def run(case: Path, out: Path, *more: object):
    return exugear("run", case, "--variant", "rigid", "--mesh-model", "iso6336", "--out", out, *more)


def python(program: str, *arguments: object, **options) -> subprocess.Popen:
    command = [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT, **options)


def kills(case: Path, out: Path, solver: str, every: int) -> dict:
    command = [sys.executable, "-m", "tests.exugear.cases.killed_runs", str(case), str(out), solver, str(every)]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)


@pytest.mark.validation
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize(
    ("solver", "every", "least"),
    [
        ("compiled", 23, 8),
        *(
            pytest.param(solver, every, 50 // every + 1, marks=pytest.mark.long)
            for solver, every in (("compiled", 7), ("compiled", 1), ("exudyn", 3))
        ),
    ],
)
def test_a_run_killed_at_any_write_resumes(case: Path, tmp_path: Path, solver: str, every: int, least: int) -> None:
    """Bitwise with the compiled solver; to round-off with Exudyn, whose clock starts anew from a rounded time."""
    found = kills(case, tmp_path / "out", solver, every)
    assert found["kills"] >= least
    assert (found["undisturbed"], found["wrong"]) == (0, [])


STOPPED_LATE = """
import json, resource, sys
from pathlib import Path
from exugear.transient import recorder, runup
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

case, out, solver, room = sys.argv[1:]
gearbox = Gearbox.from_toml(case)
recorder.FLUSH_INTERVAL = 0.01 / recorder.FLUSH_FACTOR[solver]
options = {"duration": 0.1, "solver": solver}
stiffness = mesh_stiffness(gearbox, "iso6336")
runup.simulate(gearbox, Choice("rigid", "iso6336", load_case="run_up"), stiffness, Path(out) / "whole", **options)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(room), int(room)))
try:
    runup.simulate(gearbox, Choice("rigid", "iso6336", load_case="run_up"), stiffness, Path(out), **options)
except OSError as error:
    print(json.dumps([error.filename, error.strerror]))
"""


@pytest.mark.validation
@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of the operating system")
@pytest.mark.parametrize(
    ("solver", "room", "unwritten"),
    [("exudyn", 5_000, "run.partial/000001.npz"), ("compiled", 50_000, "run.nc")],
)
def test_a_full_disk_loses_nothing_that_was_written(
    case: Path, tmp_path: Path, solver: str, room: int, unwritten: str
) -> None:
    """Pieces take 10 to 25 kB and the whole run 100: a limit between lets all be run and nothing be joined."""
    ended = python(STOPPED_LATE, case, tmp_path, solver, room)
    stdout, stderr = ended.communicate(timeout=300)
    assert ended.returncode == 0, stderr
    assert json.loads(stdout) == [str(tmp_path / DIRECTORY / unwritten), "File too large"]
    left = sorted(path.name for path in (tmp_path / DIRECTORY / "run.partial").iterdir())
    assert left == ([] if room == 5_000 else [f"{n:06d}.npz" for n in range(1, len(left) + 1)])
    resume = bool(left)
    gearbox = Gearbox.from_toml(case)
    options = {"duration": 0.1, "solver": solver}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "FLUSH_INTERVAL", 0.01 / recorder.FLUSH_FACTOR[solver])
        stiffness = mesh_stiffness(gearbox, "iso6336")
        again = runup.simulate(
            gearbox, Choice("rigid", "iso6336", load_case="run_up"), stiffness, tmp_path, resume=resume, **options
        )
    xr.testing.assert_identical(load_run(again.path), load_run(tmp_path / "whole" / DIRECTORY / "run.nc"))
    assert [path.name for path in (tmp_path / DIRECTORY).iterdir()] == ["run.nc"]


@pytest.fixture
def small_disk(tmp_path: Path):
    """A file system of one megabyte, where this user may mount one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if sys.platform != "linux" or os.geteuid() or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a file system cannot be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_ends_each_verb_with_a_sentence(case: Path, small_disk: Path) -> None:
    out = small_disk / "out"
    assert exugear("modes", case, "--variant", "rigid", "--mesh-model", "iso6336", "--out", out).exit_code == 0
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    with (small_disk / "ballast").open("wb", buffering=0) as ballast:
        for size in (65536, 4096):
            while True:
                try:
                    ballast.write(bytes(size))
                except OSError:
                    break
    refused = exugear("run", case, "--variant", "rigid", "--mesh-model", "iso6336", "--duration", 0.1, "--out", out)
    assert refused.exit_code == 2
    assert f"{out} has 0 GB free; free some space or use another results folder" in refused.stderr
    verbs = [
        ("modes", case, "--variant", "bushing", "--mesh-model", "iso6336", "--out", out),
        ("view", case, "--variant", "rigid", "--mesh-model", "iso6336", "--out", out),
        ("report", out),
    ]
    for verb in verbs:
        outcome = exugear(*verb)
        assert outcome.exit_code == 1, (verb, outcome.stdout, outcome.stderr)
        assert "No space left on device" in outcome.stderr
        assert str(small_disk) in outcome.stderr
        assert outcome.exception is None or isinstance(outcome.exception, SystemExit)
    after = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert {path: content for path, content in after.items() if path.name != "times.jsonl"} == {
        path: content for path, content in before.items() if path.name != "times.jsonl"
    }


SLOW = """
import sys, time
from pathlib import Path
from exugear.transient import recorder, runup
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

case, out, go = map(Path, sys.argv[1:])
recorder.FLUSH_INTERVAL = 0.0025

def wait(at):
    print("begun", flush=True)
    while not go.exists():
        time.sleep(0.01)

gearbox = Gearbox.from_toml(case)
stiffness = mesh_stiffness(gearbox, "iso6336")
runup.simulate(gearbox, Choice("rigid", "iso6336", load_case="run_up"), stiffness, out, duration=0.03, progress=wait)
"""


@pytest.mark.validation
def test_a_second_process_on_a_run_is_turned_away_and_changes_nothing(case: Path, tmp_path: Path) -> None:
    out, go = tmp_path / "out", tmp_path / "go"
    with python(SLOW, case, out, go) as first:
        try:
            assert first.stdout.readline() == "begun\n", first.stderr.read()
            before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
            for more in ((), ("--resume",)):
                second = run(case, out, *more)
                assert second.exit_code == 1
                assert ": in use by another process; wait until it ends, or stop it" in second.stderr
            assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
        finally:
            go.touch()
        assert first.wait(timeout=120) == 0, first.stderr.read()
    assert [path.name for path in (out / DIRECTORY).iterdir()] == ["run.nc"]
    assert load_run(out / DIRECTORY / "run.nc").attrs["complete"] == 1


@pytest.mark.usefixtures("terminal_signals")
def test_a_run_of_a_changed_file_is_refused_without_hashes(case: Path, tmp_path: Path) -> None:
    project = Project.from_toml(case, tmp_path, Choice("rigid", "iso6336"))
    stopped = project.run(duration=2.0, progress=lambda at: os.kill(os.getpid(), signal.SIGINT))
    assert not stopped.complete
    heavier = project.gearbox.varied({"bodies.shaft_1.inertia.disc.mass_kg": 1.1})
    changed = Project(heavier, tmp_path, project.choice)
    with pytest.raises(RunError, match="other input: the gearbox file or its tables have changed since; run it again"):
        changed.run(resume=True)


def test_what_an_earlier_version_left_is_refused_and_what_is_complete_is_said(case: Path, tmp_path: Path) -> None:
    directory = tmp_path / DIRECTORY
    directory.mkdir(parents=True)
    (directory / "run.partial.nc").write_bytes(b"HDF")
    outcome = run(case, tmp_path, "--resume")
    assert outcome.exit_code == 2
    assert "run.partial.nc: was written by an earlier version and cannot be resumed" in outcome.stderr
    assert run(case, tmp_path, "--duration", 0.02).exit_code == 0
    assert [path.name for path in directory.iterdir()] == ["run.nc"]
    outcome = run(case, tmp_path, "--resume")
    assert outcome.exit_code == 2
    assert "run.nc: is complete; nothing to resume" in outcome.stderr
    (directory / "run.nc").write_bytes(b"")
    outcome = run(case, tmp_path, "--resume")
    assert outcome.exit_code == 2
    assert "run.nc: has no checksum at its end" in outcome.stderr


def test_a_folder_of_pieces_that_is_a_link_is_left_alone(case: Path, tmp_path: Path) -> None:
    others = tmp_path / "others"
    others.mkdir()
    (others / "000001.npz").write_bytes(b"not ours")
    (tmp_path / DIRECTORY).mkdir(parents=True)
    (tmp_path / DIRECTORY / "run.partial").symlink_to(others)
    outcome = run(case, tmp_path, "--duration", 0.02)
    assert outcome.exit_code == 1
    assert "run.partial: is a link" in outcome.stderr
    assert [path.name for path in others.iterdir()] == ["000001.npz"]


def stopped_run(case: Path, out: Path, **varied: float) -> Path:
    """A run that was stopped after some pieces; their folder."""
    gearbox = Gearbox.from_toml(case).varied(varied)

    def fail(at: Progress) -> None:
        if at.simulated > 0.02:
            raise MemoryError

    with pytest.MonkeyPatch.context() as patch, pytest.raises(MemoryError):
        patch.setattr(recorder, "FLUSH_INTERVAL", 0.0015)
        options = {"duration": 0.03, "progress": fail}
        runup.simulate(
            gearbox, Choice("rigid", "iso6336", load_case="run_up"), mesh_stiffness(gearbox, "iso6336"), out, **options
        )
    return out / DIRECTORY / "run.partial"


def test_pieces_of_two_runs_never_mix(case: Path, tmp_path: Path) -> None:
    """As when a run is begun anew and killed before the pieces of the run before are removed."""
    one = stopped_run(case, tmp_path / "one")
    other = stopped_run(case, tmp_path / "other", **{"gears.wheel.face_width_mm": 14.0})
    whole = load_run(one)
    assert len(list(one.iterdir())) >= 3
    (one / "000003.npz").write_bytes((other / "000003.npz").read_bytes())
    cut = load_run(one)
    assert 0 < cut.sizes["time"] < whole.sizes["time"]
    assert np.array_equal(cut["overall_dte"], whole["overall_dte"][: cut.sizes["time"]])
    (one / "000001.npz").unlink()
    with pytest.raises(FileError, match=": contains no part of a run"):
        load_run(one)


FILLING = """
import sys
from pathlib import Path
import exugear.system.tooth_mesh.tables
from exugear.gearbox.gearbox import Gearbox
from tests.exugear.cases.spur import COARSE_INPUT

exugear.system.tooth_mesh.tables.TableInput = COARSE_INPUT
(request,) = exugear.system.tooth_mesh.tables.requested_tables(Gearbox.from_toml(sys.argv[1]), Path(sys.argv[2]))
request.compute()
"""


@pytest.mark.validation
def test_two_processes_may_compute_the_same_table(case: Path, tmp_path: Path) -> None:
    both = [python(FILLING, case, tmp_path / "out") for _ in range(2)]
    for process in both:
        _, stderr = process.communicate(timeout=300)
        assert process.returncode == 0, stderr
    table = MeshTable.open(tmp_path / "out" / "tables" / "spur.nc")
    assert bool(table.dataset["converged"].all())
    assert [path.name for path in (tmp_path / "out" / "tables").iterdir()] == ["spur.nc"]
