"""What a comparison with a measured run-up costs: 60 s at 50 kHz with four channels, by step and by format.

Run separately: ``python benchmarks/measured_run_up.py``. Times are processor times after compilation; compare ratios.
"""

from __future__ import annotations

import json
import tempfile
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from exugear import Choice, Project, template
from exugear.steady.evaluation.load_over_speed import LoadedModels, damping_extremes
from exugear.steady.evaluation.measured_comparison import compare_run_up
from exugear.steady.evaluation.run_up import read_run_up, response_settings
from exugear.steady.steady_file import steady_response

RATE, SECONDS, ROUNDS = 50_000.0, 60.0, 3
SPEEDS = 600.0, 2400.0
CHANNELS = {"left": "m/s2", "right": "m/s2", "te": "um"}
STIFFNESS = """
[pairs.stage_1.stiffness]
mean_N_per_m = 4.5e8
cosine_N_per_m = [18e6, 9e6, 4.5e6]
[pairs.stage_2.stiffness]
mean_N_per_m = 8e8
cosine_N_per_m = [32e6, 16e6, 8e6]
[measurements.bench]
file = "bench.FORMAT"
tacho = { channel = "tacho", shaft = "input" }
[measurements.bench.channels.left]
quantity = "acceleration"
place = "input_left"
direction = "x"
[measurements.bench.channels.right]
quantity = "acceleration"
place = "middle_right"
direction = "y"
[measurements.bench.channels.te]
quantity = "transmission_error"
"""


def recorded(folder: Path) -> dict[str, Project]:
    """Write a run-up with six orders in noise, in two formats; return the project of each."""
    instants = np.arange(int(SECONDS * RATE)) / RATE
    low, high = (2.0 * np.pi * speed / 60.0 for speed in SPEEDS)
    angle = low * instants + 0.5 * (high - low) / SECONDS * instants**2
    noise = np.random.default_rng(1)
    orders = tomllib.loads(template("parallel"))["gears"]
    teeth = [float(gear["teeth"]) for gear in orders.values()][:3]
    signals = {
        name: sum(np.cos(order * angle) for order in teeth) + 0.1 * noise.standard_normal(angle.size)
        for name in CHANNELS
    }
    signals["tacho"] = (np.cos(angle) > 0.9).astype(float)
    with h5py.File(folder / "bench.h5", "w") as file:
        file.attrs["sample_rate"] = RATE
        for name, values in signals.items():
            file[name] = values
            file[name].attrs["units"] = CHANNELS.get(name, "V")
    head = ",".join(["time_s", *(f"{name} [{CHANNELS.get(name, 'V')}]" for name in signals)])
    table = np.column_stack([instants, *signals.values()])
    np.savetxt(folder / "bench.csv", table, "%.8g", ",", header=head, comments="")
    found = {}
    for form in ("h5", "csv"):
        path = folder / f"{form}.toml"
        path.write_text(template("parallel") + STIFFNESS.replace("FORMAT", form), encoding="utf-8")
        found[form] = Project.from_toml(path, folder / "results", Choice("bushing", "line_of_action"))
    return found


def spent(work: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time of a piece of work, s, and its result."""
    begin = time.process_time()
    result = work()
    return time.process_time() - begin, result


def steps(project: Project, folder: Path) -> dict[str, float]:
    """Processor time of each step, s."""
    found = {}
    found["read, tacho, angle"], run_up = spent(lambda: read_run_up(project.gearbox))
    settings = response_settings(project.gearbox, run_up)
    stiffness = project.stiffness()
    found["response"], response = spent(
        lambda: steady_response(project.gearbox, project.choice, stiffness, settings=settings)
    )
    speeds, harmonics = response["speed"].to_numpy(), int(response.attrs["harmonics"])
    models = LoadedModels.of(project.assembly_at_loads(run_up), run_up.torque, speeds, harmonics, settings)
    found["band of damping"], limits = spent(lambda: damping_extremes(models, response, settings, run_up))
    found["cuts, peaks, foreign orders"], comparison = spent(
        lambda: compare_run_up(project.gearbox, run_up, response, limits)
    )
    found["tables and diagram"], _ = spent(lambda: comparison.write(folder / "measured-bench.nc"))
    return found


def measure() -> dict[str, Any]:
    """Medians of the steps with HDF5, and the ratio of reading a table to reading HDF5."""
    with tempfile.TemporaryDirectory() as name:
        projects = recorded(Path(name))
        steps(projects["h5"], Path(name))  # compiles
        rows = [steps(projects["h5"], Path(name)) for _ in range(ROUNDS)]
        medians = {step: float(np.median([row[step] for row in rows])) for step in rows[0]}
        table = min(spent(lambda: read_run_up(projects["csv"].gearbox))[0] for _ in range(2))
    whole = sum(medians.values())
    return {
        "processor_s": {step: round(value, 2) for step, value in medians.items()},
        "shares": {step: round(value / whole, 2) for step, value in medians.items()},
        "whole_s": round(whole, 2),
        "whole_without_response_s": round(whole - medians["response"], 2),
        "per_recorded_second": round(whole / SECONDS, 3),
        "table_over_hdf5": round(table / medians["read, tacho, angle"], 1),
    }


if __name__ == "__main__":
    print(json.dumps(measure(), indent=1))
