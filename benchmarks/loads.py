"""What the life under 30 minutes of turbine data costs: torque alone, and all six components of a hub.

Measured by ``python benchmarks/run_all.py``. Tables are there before; stresses of the pairs are computed once and kept,
and told by themselves. Loads of the hub are the torque's own samples with swings beside them.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from timing import CASE, ROOT, median, say, timed

from exugear.exchange.series_files import read_channels
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.life.dynamic_factors import stated_factors
from exugear.life.gear_life import pair_stresses
from exugear.life.life import checked_loads, compute_life, rating_of
from exugear.project import Project

POSITIONS = 10
"""Of the mesh cycle in the tables: more change nothing in what is measured but the stresses of pairs."""
HUB = {"x": 40e3, "y": 60e3, "z": 50e3, "mx": 300e3, "my": 250e3}
"""Swings of the hub's forces (N) and moments (N m)."""


def measure(quick: bool) -> dict[str, Any]:
    """Processor time of a life of the GRC, variant bushing, seconds."""
    rounds = 1 if quick else 5
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        project = Project(_gearbox(folder), folder / "out", Choice("bushing"))
        say("loads: tables of the pairs")
        project.tables(positions=POSITIONS)
        project = Project(project.gearbox.varied({"ste.positions": POSITIONS}), project.folder, project.choice)
        stresses = timed(lambda: pair_stresses(project.life_tables(), project.folder))
        cases = {"torque alone": project, "six components": _with_hub(project, folder)}
        rows = []
        for what, one in cases.items():
            say(f"loads: {what}")
            costs = [timed(lambda one=one: _life(one)).processor for _ in range(rounds)]
            rows.append({"loads": what, "processor_s": median(costs)})
    return {"rounds": rounds, "minutes": 30, "stresses_s": stresses.processor, "rows": rows}


def _life(project: Project) -> None:
    counted = checked_loads(project.gearbox)
    rating = rating_of(project.gearbox)
    stresses = pair_stresses(project.life_tables(), project.folder)
    assert rating.dynamic_factor is not None
    dynamic = stated_factors(project.gearbox, rating.dynamic_factor)
    compute_life(project.assembly(), counted, stresses, dynamic, "")


def _gearbox(folder: Path) -> Gearbox:
    """Gearbox with its files of loads beside it."""
    loads = folder / "loads"
    loads.mkdir()
    for path in (ROOT / "cases/grc750/loads").glob("*.outb"):
        (loads / path.name).write_bytes(path.read_bytes())
    solids = {f"bodies.{name}.flexibility": "none" for name in ("carrier", "housing")}
    content = Gearbox.from_toml(CASE).varied(solids).content
    return Gearbox.from_dict(dict(content), str(folder / "gearbox.toml"))


def _with_hub(project: Project, folder: Path) -> Project:
    """Put the loads of a hub beside the torque of each file, on the main shaft."""
    changes: dict[str, Any] = {
        "bodies.main_shaft.enabled": True,
        "static_load.torques_N_m": {"main_shaft": 240e3},
        "loads.body": "main_shaft",
    }
    for number, name in enumerate(("wind_8", "wind_12", "wind_18"), start=1):
        series = read_channels(folder / "loads" / f"oc3_hywind_test{number}.outb")
        torque, speed = series.channel("RotTorq", "torque"), series.channel("RotSpeed", "speed") * 30.0 / np.pi
        swings = [size * np.sin(0.3 * (k + 1) * series.time + k) for k, size in enumerate(HUB.values())]
        table = np.column_stack([series.time, torque, speed, *swings])
        headings = "time_s,torque_N_m,shaft_rpm,x_N,y_N,z_N,mx_N_m,my_N_m"
        np.savetxt(folder / f"{name}.csv", table, "%.8g", ",", header=headings, comments="")
        source = f"loads.sources.{name}"
        changes |= {
            f"{source}.file": f"{name}.csv",
            f"{source}.torque": "torque_N_m",
            f"{source}.speed": "shaft_rpm",
            f"{source}.hub_forces": ["x_N", "y_N", "z_N"],
            f"{source}.hub_moments": ["mx_N_m", "my_N_m"],
        }
    return Project(project.gearbox.varied(changes), project.folder, project.choice)
