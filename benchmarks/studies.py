"""What studies cost: overhead of a point, and what a second core brings for tables, runs and modes.

Measured by ``python benchmarks/run_all.py --part studies``. Efficiency is the wall time of one worker over twice that
of two, the points, their number and the loading of workers being the same; it needs two free cores. A worker uses one
core; the same study without workers may use a second one in part, and is measured beside. Overhead is processor time
of a study beside that of its points by themselves.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

from timing import CASE, ROOT, say

from exugear.gearbox.gearbox import Gearbox
from exugear.studies.executors import Opens, PersistentPool, processes
from exugear.studies.point_results import PointResults, Shared
from exugear.studies.runner import run_study, task_of
from exugear.studies.sampling import changed
from exugear.studies.study import Study

SMALL = ROOT / "exugear" / "gearbox" / "templates" / "pair.toml"
FREQUENCIES = {"frequency": {"quantity": "frequencies", "count": 4}}


def study(case: Path, variant: str, path: str, values: list[float], outputs: dict[str, Any], **more: Any) -> Study:
    """Make a study of one parameter."""
    return Study.from_dict(
        {
            "name": "benchmark",
            "case": str(case),
            "choice": {"variant": variant, "mesh_model": "iso6336"},
            "parameters": {"varied": {"path": path, "values": values}},
            "outputs": outputs,
            **more,
        }
    )


def spread(first: float, last: float, count: int) -> list[float]:
    """Values from one to another."""
    return [first + (last - first) * n / max(count - 1, 1) for n in range(count)]


def overhead(count: int) -> dict[str, Any]:
    """Cost of modal points of a small gearbox, in a study and by themselves, one process; and of two processes."""
    own = study(SMALL, "rigid", "housing.factor", spread(0.2, 0.9, count), FREQUENCIES)
    with tempfile.TemporaryDirectory() as folder:
        task = task_of(own, Path(folder))
        points = [changes for _, changes in ((name, point.changes) for name, point in own.hashed_points())]
        few = points[: min(count, 1000)]
        bare(task, few[:5])
        start = time.process_time()
        bare(task, few)
        alone = (time.process_time() - start) / len(few)
        start, wall = time.process_time(), time.perf_counter()
        swept = run_study(own, Path(folder) / "out", processes(1))
        processor, wall = time.process_time() - start, time.perf_counter() - wall
        assert not swept.failed
        start = time.process_time()
        assert run_study(own, Path(folder) / "out", processes(1)).computed == 0
        again = time.process_time() - start
    return {
        "points": count,
        "alone_ms": 1e3 * alone,
        "in_study_ms": 1e3 * processor / count,
        "overhead_ms": 1e3 * (processor / count - alone),
        "wall_s": wall,
        "restart_s": again,
    }


def bare(task: Any, points: list[Any]) -> None:
    """Compute points as a script would: build the gearbox, take its outputs."""
    for changes in points:
        gearbox = Gearbox.from_dict(changed(task.content, changes), task.source, task.permissions)
        results = PointResults(gearbox, task.choice, task.settings, Shared(task.folder), task.folder / "work")
        for kept in task.outputs.values():
            kept.of(results)


def efficiency(name: str, of: Study, warm: Study) -> dict[str, Any]:
    """Wall time of a study without workers, by one and by two, workers warm and started before."""
    walls = {}
    for workers in (0, 1, 2):
        opens = _in_processes(workers) if workers else processes(1)
        with tempfile.TemporaryDirectory() as folder, PersistentPool(opens) as kept:
            run_study(warm, Path(folder) / "warm", kept.opened)
            start = time.perf_counter()
            swept = run_study(of, Path(folder) / "out", kept.opened)
            walls[workers] = time.perf_counter() - start
            assert not swept.failed, swept.failed[0].error
            memory = max(record.memory for record in swept.records.values())
        say(f"studies: {name} on {workers}: {walls[workers]:.1f} s")
    return {
        "what": name,
        "points": len(of.design.points),
        "wall_here_s": walls[0],
        "wall_1_s": walls[1],
        "wall_2_s": walls[2],
        "efficiency": walls[1] / (2.0 * walls[2]),
        "memory_MB": 1e-6 * memory,
    }


def _in_processes(workers: int) -> Opens:
    """Worker processes, also one: what is compared differs in their number alone."""
    from contextlib import contextmanager

    from exugear.studies.executors import Pool
    from fe_ste.tools.processes import Workers

    @contextmanager
    def opened() -> Any:
        with Workers(workers) as executor:
            yield Pool(executor, workers)

    return opened


def of_tables(first: float, count: int) -> Study:
    """Every point a table of its own: the flank is modified, its finite elements stay."""
    outputs = {"ripple": {"quantity": "ste_peak_to_peak", "pair": "high_speed"}}
    values = spread(first, first + 0.02, count)
    return study(CASE, "bushing", "gears.hs_pinion.modification.lead_crowning_um", values, outputs)


def of_runs(first: float, count: int, duration: float) -> Study:
    """Make runs of the bushing variant."""
    outputs = {"speed": {"quantity": "final_speed"}}
    return study(
        CASE, "bushing", "housing.factor", spread(first, first + 0.1, count), outputs, run={"duration_s": duration}
    )


def of_modes(first: float, count: int) -> Study:
    """Make modes of the bushing variant."""
    return study(CASE, "bushing", "housing.factor", spread(first, first + 0.1, count), FREQUENCIES)


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    points = 200 if quick else 10_000
    tables, runs, modes = (2, 2, 8) if quick else (24, 16, 200)
    duration = 0.2 if quick else 4.0
    rows = [
        efficiency("tables", of_tables(1.0, tables), of_tables(5.0, 2)),
        efficiency("runs", of_runs(0.3, runs, duration), of_runs(0.6, 2, 0.1)),
        efficiency("modes", of_modes(0.3, modes), of_modes(0.6, 4)),
    ]
    say("studies: overhead")
    return {"overhead": overhead(points), "efficiency": rows}
