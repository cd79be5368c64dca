"""What a table over load, centre distance and misalignment costs: each GRC pair from nothing, in a process of its own.

    python benchmarks/grid.py --pair NAME

measures one and prints it; `run_all.py` measures all. The grid is the case's default one, shared by two worker
processes; some of its states are also solved alone, for time and result. Compiled kernels are in their cache on disk.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from timing import environment, say

if TYPE_CHECKING:
    import xarray as xr

    from fe_ste.transmission_error.table import TableInput

HERE = Path(__file__).parent
CASE = HERE.parent / "cases" / "grc750" / "gearbox.toml"
PAIRS = ("sun_planet", "ring_planet", "intermediate", "high_speed")
#: Every so many states one is solved alone.
ALONE_EVERY = 251


def measure(name: str) -> dict[str, float | int | str]:
    """Compute one pair's grid in this process and two workers, and some of its states alone."""
    from exugear.gearbox.gearbox import Gearbox
    from exugear.system.tooth_mesh.tables import wanted_table
    from fe_ste.transmission_error.table import MeshTable, prepared_compliance

    gearbox = Gearbox.from_toml(CASE)
    wanted = wanted_table(gearbox, name, gearbox.ste.positions, grid=True)
    started = time.perf_counter()
    prepared_compliance(wanted)  # kept: the table takes it from there
    offline = time.perf_counter()
    processor = time.process_time()
    data = MeshTable.compute(wanted).dataset
    finished = time.perf_counter()
    workers = resource.getrusage(resource.RUSAGE_CHILDREN)
    states = data["ste"].size
    alone_ms, deviation = solved_alone(wanted, data)
    return {
        "pair": name,
        "states": states,
        "unsolved": int((~data["converged"]).sum()),
        "offline_s": offline - started,
        "grid_s": finished - offline,
        "total_s": finished - started,
        "state_ms": 1e3 * (finished - offline) / states,
        "state_processor_ms": 1e3 * (time.process_time() - processor + workers.ru_utime + workers.ru_stime) / states,
        "alone_ms": alone_ms,
        "largest_deviation": deviation,
        "worker_memory_MB": workers.ru_maxrss / 1024,
    }


def solved_alone(wanted: TableInput, data: xr.Dataset) -> tuple[float, float]:
    """Processor time of a state that no other helps, ms, and the largest relative deviation of its result."""
    import math

    import numpy as np

    from fe_ste.tools.threads import one_dense_thread
    from fe_ste.transmission_error.search import contact_state
    from fe_ste.transmission_error.table import prepared_compliance

    compliance = prepared_compliance(wanted)
    cosine = math.cos(wanted.pair.pinion.base_helix_angle)
    deviation, started, numbers = 0.0, time.process_time(), range(0, data["ste"].size, ALONE_EVERY)
    for number in numbers:
        p, t, c, m = (int(i) for i in np.unravel_index(number, data["ste"].shape))
        placed = compliance.at_centre_distance(wanted.centre_distance[c])
        with one_dense_thread():
            state = contact_state(placed, wanted.torque[t], p / wanted.positions, wanted.misalignment[m])
        stored = float(data["ste"][p, t, c, m])
        deviation = max(deviation, abs(state.solution.approach / cosine / stored - 1.0))
    return 1e3 * (time.process_time() - started) / len(numbers), deviation


def measure_all(quick: bool) -> dict[str, Any]:
    """Measure every pair, or the first one alone."""
    command = [sys.executable, __file__, "--pair"]
    pairs = []
    for name in PAIRS[:1] if quick else PAIRS:
        say(f"grid of {name}")
        run = subprocess.run([*command, name], check=True, capture_output=True, text=True, env=environment())
        pairs.append(json.loads(run.stdout))
    return {"pairs": pairs}


def main() -> None:
    """Measure one pair in this process and print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pair", choices=PAIRS, required=True)
    sys.stdout.write(json.dumps(measure(parser.parse_args().pair)))


if __name__ == "__main__":
    main()
