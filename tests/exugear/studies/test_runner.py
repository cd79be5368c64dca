"""Studies carried out: the same numbers anywhere, nothing lost by kills, failures told."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.studies import executors
from exugear.studies.dataset import load_study
from exugear.studies.executors import (
    ExecutorError,
    Journal,
    PointInput,
    Pool,
    Record,
    compute_batch,
    given,
    processes,
    read_journals,
)
from exugear.studies.point_results import Shared
from exugear.studies.runner import Shard, run_study, task_of
from exugear.studies.sections import StudyError
from fe_ste.transmission_error.table import MeshTable

from ..cases.spur import COARSE_INPUT
from ..cases.study import figures_of, small_study, study_content

ROOT = Path(__file__).parents[3]
HERE = processes(1)


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Folder of the case."""
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def here(home):
    """The study done in this process; nobody changes its folder."""
    return run_study(small_study(home), home / "here", HERE)


def journal_lines(folder):
    return sum(path.read_text(encoding="utf-8").count("\n") for path in folder.glob("points/*.jsonl"))


def test_points_are_those_of_gearboxes_varied_one_by_one(here, home):
    from exugear.system.modes import eigenmodes
    from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

    study = small_study(home)
    data = load_study(here.path)
    assert data["frequency"].dims == ("seat", "bearing", "mode") and data["frequency"].attrs["units"] == "Hz"
    for seat in data["seat"].to_numpy():
        changes = {"housing.factor": float(seat), "bearings.bearing_1.stiffness.radial_N_per_m": 2e7}
        gearbox = study.gearbox.varied(changes)
        modes = eigenmodes(gearbox, study.choice, mesh_stiffness(gearbox, "iso6336"))
        elastic = modes.frequency[modes.frequency > 0.0][:4]
        np.testing.assert_array_equal(data["frequency"].sel(seat=seat).isel(bearing=1), elastic)


@pytest.mark.validation
@pytest.mark.long
def test_one_process_and_two_give_the_same_bits(here, home, tmp_path):
    two = run_study(small_study(home), tmp_path / "two", processes(2))
    xr.testing.assert_identical(figures_of(two.dataset), figures_of(here.dataset))


def test_any_executor_of_the_protocol_serves(here, home, tmp_path):
    with ThreadPoolExecutor(1) as executor:
        other = run_study(small_study(home), tmp_path / "threads", given(executor))
    xr.testing.assert_identical(figures_of(other.dataset), figures_of(here.dataset))


@pytest.mark.validation
def test_a_worker_that_is_killed_costs_nothing_but_time(here, home, tmp_path):
    killed = []

    def kill_one(done, failed, total):
        if done >= 2 and not killed:
            killed.append(multiprocessing.active_children()[0].pid)
            os.kill(killed[0], signal.SIGKILL)

    swept = run_study(small_study(home), tmp_path / "killed", processes(2), progress=kill_one)
    assert killed and not swept.failed
    xr.testing.assert_identical(figures_of(swept.dataset), figures_of(here.dataset))


@pytest.mark.validation
def test_a_study_whose_main_process_is_killed_computes_no_finished_point_again(here, home, tmp_path):
    program = f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
import os, time
from exugear.studies import executors
from exugear.studies.study import Study
from exugear.studies.runner import run_study

compute = executors.compute_point
def slow(task, work):
    time.sleep(0.2)
    return compute(task, work)
executors.compute_point = slow
run_study(Study.from_dict({study_content(home)!r}), {str(tmp_path / "again")!r}, executors.processes(1))
"""
    running = subprocess.Popen([sys.executable, "-c", program], cwd=ROOT)
    deadline = time.monotonic() + 120.0
    while journal_lines(tmp_path / "again") < 3 and time.monotonic() < deadline:
        time.sleep(0.05)
    running.kill()
    running.wait()
    study, folder = small_study(home), tmp_path / "again"
    finished = read_journals(folder, {name for name, _ in study.hashed_points()})
    assert 3 <= len(finished) < 12
    swept = run_study(study, folder, HERE)
    assert swept.computed == 12 - len(finished)
    assert journal_lines(folder) == 12
    xr.testing.assert_identical(figures_of(swept.dataset), figures_of(here.dataset))


def test_a_study_that_grows_keeps_the_points_it_had(here, home, tmp_path):
    content = study_content(home)
    content["parameters"]["seat"]["values"] += [0.9]
    shutil.copytree(here.path.parent, tmp_path / "here")
    grown = run_study(small_study(home, parameters=content["parameters"]), tmp_path / "here", HERE)
    assert grown.computed == 3 and grown.dataset.sizes["seat"] == 5


def test_other_figures_or_another_case_are_other_points(tmp_path):
    study = small_study(tmp_path)
    other_figure = small_study(tmp_path, outputs={"nearest": {"quantity": "nearest_frequency", "near_Hz": 600.0}})
    other_case = small_study(tmp_path, changes={"damping.mesh_time_s": 5e-6})
    names = [{name for name, _ in own.hashed_points()} for own in (study, other_figure, other_case)]
    assert len(set.union(*names)) == 36


def test_shards_are_parts_that_merge_to_the_whole(here, home, tmp_path):
    folder = tmp_path / "parts"
    first = run_study(small_study(home), folder, HERE, shard=Shard(1, 2))
    assert first.computed == 6 and first.path is None
    merged = run_study(small_study(home), folder, HERE, merge=True)
    assert merged.computed == 0 and int(np.isnan(merged.dataset["nearest"]).sum()) == 6
    assert merged.dataset.attrs["missing"] == 6
    second = run_study(small_study(home), folder, HERE, shard=Shard(2, 2))
    assert second.computed == 6 and second.path is not None
    xr.testing.assert_identical(figures_of(second.dataset), figures_of(here.dataset))


def test_a_point_that_fails_is_told_and_stops_no_other(tmp_path):
    drawn = {"seat": {"path": "housing.factor", "uniform": {"min": 0.6, "max": 1.4}}}
    study = small_study(tmp_path, parameters=drawn, samples=8)
    swept = run_study(study, tmp_path / "out", HERE)
    assert len(swept.failed) == 4  # a Latin hypercube: half of the draws lie beyond 1
    assert all("housing.factor" in record.error and "between 0.001 and 1" in record.error for record in swept.failed)
    beyond = swept.dataset["seat"] > 1.0
    assert bool((np.isnan(swept.dataset["nearest"]) == beyond).all())
    assert bool(((swept.dataset["error"] != "") == beyond).all())
    assert run_study(study, tmp_path / "out", HERE).computed == 0
    assert run_study(study, tmp_path / "out", HERE, retry=True).computed == 4


class Breaking:
    """Executor that loses its workers at one point."""

    def __init__(self, poison: str) -> None:
        self.poison, self.batches = poison, []

    def submit(self, fn, /, *arguments):
        task, batch = arguments
        future: Future = Future()
        self.batches.append([work.point for work in batch])
        if self.poison in self.batches[-1]:
            future.set_exception(BrokenExecutor())
        else:
            future.set_result(fn(task, batch))
        return future


def test_a_point_that_kills_every_worker_is_given_up_and_no_other_is_blamed(tmp_path):
    study = small_study(tmp_path)
    points = [PointInput(name, point.changes) for name, point in study.hashed_points()]
    breaking = Breaking(points[3].point)

    @contextmanager
    def opened():
        yield Pool(breaking, 2)

    found = executors.compute_points(task_of(study, tmp_path / "out"), points, opened, lambda record: None)
    assert [name for name, record in found.items() if record.error] == [points[3].point]
    assert "unexpectedly 3 times" in found[points[3].point].error
    assert breaking.batches[-1] == [points[3].point]


def test_an_executor_that_was_given_is_not_started_again(tmp_path):
    study = small_study(tmp_path)
    first = next(study.hashed_points())[0]
    with pytest.raises(
        ExecutorError,
        match="the executor lost its workers; finished points are stored, start again with another executor",
    ):
        run_study(study, tmp_path / "out", given(Breaking(first), 1))


def test_a_line_that_was_cut_short_is_no_point(tmp_path):
    journal = Journal(tmp_path)
    for name in ("a", "b"):
        journal.add(Record(name, {"quantity": 1.25, "several": {"1": None}}))
    (path,) = tmp_path.glob("points/*.jsonl")
    whole = path.read_bytes()
    for length in range(len(whole) // 2 + 1, len(whole) - 1):
        path.write_bytes(whole[:length])
        assert list(read_journals(tmp_path, {"a", "b"})) == ["a"]
    path.write_bytes(whole.replace(b"1.25", b"1.26"))
    assert read_journals(tmp_path, {"a", "b"}) == {}


@pytest.mark.validation
def test_points_with_one_table_compute_it_once(tmp_path, monkeypatch):
    monkeypatch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
    computed = []
    compute = MeshTable.compute
    monkeypatch.setattr(MeshTable, "compute", lambda *args, **options: computed.append(1) or compute(*args, **options))
    outputs = {"ripple": {"quantity": "ste_peak_to_peak", "pair": "spur"}, "modes": {"quantity": "frequencies"}}
    choice = {"variant": "bushing", "mesh_model": "line_of_action"}
    swept = run_study(small_study(tmp_path, outputs=outputs, choice=choice), tmp_path / "out", HERE)
    assert not swept.failed and computed == [1]
    assert float(swept.dataset["ripple"].max()) > 1e-7


def test_two_that_want_the_same_table_wait_for_one(tmp_path, monkeypatch):
    monkeypatch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
    computed, begun = [], threading.Barrier(2)
    compute = MeshTable.compute
    monkeypatch.setattr(MeshTable, "compute", lambda *args, **options: computed.append(1) or compute(*args, **options))
    gearbox = small_study(tmp_path).gearbox

    def ask(_):
        begun.wait()
        return Shared(tmp_path / "shared").table(gearbox, "spur").input_hash

    with ThreadPoolExecutor(2) as threads:
        hashes = list(threads.map(ask, range(2)))
    assert computed == [1] and hashes[0] == hashes[1]


@pytest.mark.validation
def test_memory_of_a_worker_does_not_grow_with_its_points(tmp_path):
    values = {"seat": {"path": "housing.factor", "range": {"first": 0.1, "last": 0.9, "count": 190}}}
    study = small_study(tmp_path, parameters=values)
    swept = run_study(study, tmp_path / "out", HERE)
    memory = swept.dataset["memory"].to_numpy()
    assert memory[-1] - memory[60] < 20e6  # a gearbox that stayed behind would be 0.2 MB a point


def test_outputs_of_runs_take_a_bearing_and_a_direction(tmp_path, monkeypatch):
    monkeypatch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
    signals = [f"support_force bearing_1 {axis}" for axis in "xyz"] + ["support_force bearing_1"]
    outputs = {f"f{n}": {"quantity": "peak_to_peak", "signal": signal} for n, signal in enumerate(signals)}
    parameters = {"seat": {"path": "housing.factor", "values": [0.4]}}
    choice = {"variant": "bushing", "mesh_model": "line_of_action"}
    study = small_study(tmp_path, parameters=parameters, outputs=outputs, choice=choice, run={"duration_s": 0.05})
    swept = run_study(study, tmp_path / "out", HERE)
    *directions, largest = (float(swept.dataset[f"f{n}"].max()) for n in range(len(signals)))
    assert largest == max(directions) > 0.0
    for quantity, name in (("rms", "support_force bearing_1 w"), ("run_harmonics", "support_force bearing_1")):
        of_mesh = {"mesh": "spur"} if quantity == "run_harmonics" else {}
        outputs = {"f": {"quantity": quantity, "signal": name, **of_mesh}}
        with pytest.raises(StudyError, match=f"outputs.f.signal = '{name}': no such signal; did you mean"):
            small_study(tmp_path, parameters=parameters, outputs=outputs, run={"duration_s": 0.05})


@pytest.mark.validation
def test_a_run_that_was_stopped_is_gone_on_with(tmp_path, monkeypatch):
    from exugear.transient import recorder

    monkeypatch.setattr(recorder, "FLUSH_INTERVAL", 1e-3)
    settings = {
        "parameters": {"seat": {"path": "housing.factor", "values": [0.4]}},
        "outputs": {"rms": {"quantity": "rms"}, "speed": {"quantity": "final_speed"}},
        "run": {"duration_s": 0.05},
    }
    study = small_study(tmp_path, **settings)
    whole = run_study(study, tmp_path / "whole", HERE)
    assert not whole.failed, whole.failed
    assert float(whole.dataset["rms"].max()) > 0.0
    assert not list((tmp_path / "whole" / "work").glob("*"))
    name, point = next(study.hashed_points())
    task = task_of(study, tmp_path / "again")
    asked = []

    def stop_once():
        asked.append(1)
        if len(asked) == 3:
            raise executors.WorkerStoppedError

    monkeypatch.setattr("exugear.studies.point_results.stop_if_asked", stop_once)
    with pytest.raises(executors.WorkerStoppedError):
        compute_batch(task, [PointInput(name, point.changes)])
    again = run_study(study, tmp_path / "again", HERE)
    xr.testing.assert_identical(figures_of(again.dataset), figures_of(whole.dataset))
