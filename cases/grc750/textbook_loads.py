"""GRC 750 kW gearbox on its bearings in Exudyn: mesh forces by one element, and the textbook way, by loads.

    python cases/grc750/textbook_loads.py [results folder]

Exudyn's documentation gives a force law of one's own to a body by a load with a user function. Here each mesh gives
each of its gears one force and one torque that way. The script runs the beginning of the run-up both ways, prints what
each took, and by how much the signals differ: by round-off. The mesh stiffness is that of ISO 6336, which needs no
tables. Results go to results/grc750-routes by default. The whole takes less than a minute.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import xarray as xr

from exugear import Choice, Project, load_run

CASE = Path(__file__).with_name("gearbox.toml")
CHOICE = Choice("bushing", "iso6336")
ROUTES: tuple[Literal["element", "loads"], ...] = ("element", "loads")
SIGNALS = ("input_speed", "overall_dte", "mesh_force", "support_force", "kinetic_energy", "elastic_energy")


def main(out: Path, duration: float = 0.02) -> dict[str, float]:
    """Run a simulated time (s) both ways, print, and return the largest difference of each signal over its largest."""
    runs = {}
    for route in ROUTES:
        project = Project.from_toml(CASE, out / route, CHOICE)
        run = project.run(duration=duration, solver="exudyn", mesh_route=route)
        runs[route] = load_run(run.path, SIGNALS)
        print(f"{route:8s} {duration:g} s simulated in {run.wall:5.1f} s ({runs[route].attrs['solver']})", flush=True)
    differences = {name: difference(runs["element"][name], runs["loads"][name]) for name in SIGNALS}
    for name, value in differences.items():
        print(f"  {name:15s} differs by up to {value:.0e} of its largest value")
    return differences


def difference(first: xr.DataArray, second: xr.DataArray) -> float:
    """Largest difference of two signals over the largest value of the first."""
    values = first.to_numpy()
    return float(np.abs(second.to_numpy() - values).max() / np.abs(values).max())


if __name__ == "__main__":
    from arguments import results_folder

    main(results_folder("results/grc750-routes"))
