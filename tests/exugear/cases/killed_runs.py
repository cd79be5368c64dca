"""Kills a run at each of its writes, resumes it and compares: `python killed_runs.py CASE OUT SOLVER EVERY`.

The work is done by forks of one process, in which everything is loaded and compiled. What writes is the program's own
code; only the calls that change the disk are counted, and the process ends by SIGKILL at one of them: before it, or
half-way through what it writes. Prints how many kills there were, and what was wrong after which.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path

import xarray as xr

import fe_ste.tools.files
import fe_ste.tools.stores
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.results.folder import run_directory
from exugear.results.run_file import load_run
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.transient import recorder, runup
from exugear.transient.outcome import Run
from exugear.transient.start import refuse_to_resume

CALLS = ("open", "fsync", "replace", "unlink", "rmdir", "mkdir")
DURATION = 0.024
CHOICE = Choice("rigid", "iso6336", "disc", "run_up")


def kill_at(number: int) -> None:
    """End this process at that call, counted from one."""
    count = 0

    def reached() -> bool:
        nonlocal count
        count += 1
        return count == number

    def counted(call: Callable[..., object]) -> Callable[..., object]:
        def instead(*arguments: object, **options: object) -> object:
            if reached():
                os.kill(os.getpid(), signal.SIGKILL)
            return call(*arguments, **options)

        return instead

    for name in CALLS:
        setattr(os, name, counted(getattr(os, name)))
    plain = fe_ste.tools.files.write_all

    def write_all(file, content) -> None:
        if reached():
            plain(file, memoryview(content)[: len(memoryview(content)) // 2])
            os.kill(os.getpid(), signal.SIGKILL)
        plain(file, content)

    for module in (fe_ste.tools.files, fe_ste.tools.stores):
        module.write_all = write_all


def in_fork(work: Callable[[], None]) -> int:
    """Do it in a process of its own; its exit code, or minus the signal that ended it."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    try:
        work()
    except BaseException:
        traceback.print_exc()
        os._exit(1)
    os._exit(0)


def check(case: Path, out: Path, solver: str, every: int) -> dict[str, object]:
    gearbox = Gearbox.from_toml(case)
    stiffness = mesh_stiffness(gearbox, "iso6336")
    recorder.FLUSH_INTERVAL = DURATION / 2.5 / recorder.FLUSH_FACTOR[solver]

    def simulate(folder: Path, resume: bool) -> Run:
        options = {"duration": DURATION, "solver": solver}
        return runup.simulate(gearbox, CHOICE, stiffness, folder, resume=resume, **options)

    def undisturbed() -> Path:
        return simulate(out / "whole", False).path

    def killed(number: int) -> None:
        kill_at(number)
        simulate(out / str(number), False)

    def taken_up(folder: Path) -> None:
        directory = run_directory(folder, CHOICE)
        found = simulate(folder, not refuse_to_resume(directory))
        assert sorted(path.name for path in directory.iterdir()) == ["run.nc"], list(directory.iterdir())
        again = load_run(found.path)
        if solver == "compiled":
            xr.testing.assert_identical(again, whole)
            for name, values in again.variables.items():
                assert values.dtype == object or values.to_numpy().tobytes() == whole[name].to_numpy().tobytes(), name
        else:  # Exudyn's clock starts anew from a rounded time
            xr.testing.assert_allclose(again, whole, rtol=1e-9, atol=1e-9)

    whole = load_run(undisturbed())
    kills, wrong, number = 0, [], 1
    while (code := in_fork(partial(killed, number))) == -signal.SIGKILL:
        kills += 1
        if in_fork(partial(taken_up, out / str(number))):
            wrong.append(number)
        number += every
    return {"kills": kills, "last": number, "undisturbed": code, "wrong": wrong}


if __name__ == "__main__":
    print(json.dumps(check(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], int(sys.argv[4]))))
