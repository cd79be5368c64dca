"""What a start of the command line costs: its help, and a run that is over at once, with and without kernels cached.

Measured by ``python benchmarks/run_all.py``.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from typing import Any

from timing import CASE, ROOT, Cost, environment, median, say, timed

RUN = ["run", str(CASE), "--variant", "bushing", "--mesh-model", "iso6336", "--duration", "0.01"]


def cost_of(arguments: list[str], cache: str) -> Cost:
    """Cost of one command; the processor time counts this process's children."""
    import resource

    command = [sys.executable, "-c", "from exugear.cli.app import main; main()", *arguments]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    cost = timed(
        lambda: subprocess.run(command, check=True, capture_output=True, cwd=ROOT, env=environment(**kept_in(cache)))
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Cost(cost.wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def kept_in(cache: str) -> dict[str, str]:
    """Environment in which compiled kernels and Python's own byte code are kept in a folder, as after installation."""
    return {"NUMBA_CACHE_DIR": cache, "PYTHONPYCACHEPREFIX": cache, "PYTHONDONTWRITEBYTECODE": ""}


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    rounds = 1 if quick else 5
    with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryDirectory() as out:
        cold = [cost_of([*RUN, "--out", out], cache)]
        warm = [cost_of([*RUN, "--out", out], cache) for _ in range(rounds)]
        asked = [cost_of(["--help"], cache) for _ in range(rounds + 1)][1:]
    say("start-up: done")
    rows = {"--help": asked, "run, kernels cached": warm, "run, kernels compiled": cold}
    return {
        "rounds": rounds,
        "starts": [
            {
                "command": name,
                "wall_s": median(cost.wall for cost in costs),
                "processor_s": median(cost.processor for cost in costs),
            }
            for name, costs in rows.items()
        ],
    }
