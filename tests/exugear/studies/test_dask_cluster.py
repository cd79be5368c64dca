"""Studies on a Dask cluster of two local workers: the same bits, and a worker that is killed costs nothing."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import xarray as xr

from exugear.studies.dataset import load_study
from exugear.studies.executors import processes
from exugear.studies.runner import run_study

from ..cases.study import figures_of, small_study, study_content

pytest.importorskip("distributed")
ROOT = Path(__file__).parents[3]
CLUSTER = """
import json, sys
from distributed import LocalCluster

if __name__ == "__main__":
    cluster = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    workers = [int(worker.pid) for worker in cluster.workers.values()]
    print(json.dumps([cluster.scheduler_address, workers]), flush=True)
    sys.stdin.read()  # until the test closes it
    cluster.close()
"""
STUDY = """
import json, sys
from exugear.studies.executors import dask_cluster
from exugear.studies.study import Study
from exugear.studies.runner import run_study

content, folder, address = json.loads(sys.argv[1])
told = lambda done, failed, total: print(done, flush=True)
run_study(Study.from_dict(content), folder, dask_cluster(address), progress=told)
"""


@pytest.fixture
def cluster(tmp_path):
    """Address of a scheduler, and the processes of its workers."""
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, str(script)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, text=True, cwd=tmp_path, env=environment, **pipes) as running:
        yield json.loads(running.stdout.readline())
        running.stdin.close()


def on_cluster(address, content, folder):
    arguments = json.dumps([content, str(folder), address])
    command = [sys.executable, "-c", STUDY, arguments]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.validation
@pytest.mark.long
def test_a_cluster_gives_the_same_bits_even_if_a_worker_is_killed(cluster, tmp_path):
    address, workers = cluster
    here = run_study(small_study(tmp_path), tmp_path / "here", processes(1))
    with on_cluster(address, study_content(tmp_path), tmp_path / "cluster") as running:
        assert running.stdout.readline().strip() == "0"
        assert int(running.stdout.readline()) >= 1
        os.kill(workers[0], signal.SIGKILL)
        _, errors = running.communicate(timeout=300)
    assert running.returncode == 0, errors
    xr.testing.assert_identical(figures_of(load_study(tmp_path / "cluster" / "study.nc")), figures_of(here.dataset))


def test_a_scheduler_that_is_not_there_is_told(tmp_path, monkeypatch):
    from exugear.studies import executors

    monkeypatch.setattr(executors, "CONNECT_SECONDS", 1.0)
    start = time.monotonic()
    with pytest.raises(executors.ExecutorError, match="no Dask scheduler answers there"):
        run_study(small_study(tmp_path), tmp_path / "out", executors.dask_cluster("tcp://127.0.0.1:9"))
    assert time.monotonic() - start < 60.0
