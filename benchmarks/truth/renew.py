"""Deflections of stored contact forces' cells by 20-node bricks, written into ``results.json``.

Run ``python benchmarks/truth/renew.py "spur 0" ...`` with names of cases; ``--factors 0.5 0.7 1`` for other meshes than
those stored. A mesh of 400,000 unknowns takes minutes and 10 GB. A case that has no forces yet, as ``"spur 0.25"``, is
solved for them first.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from agreement_with_truth import FOLDER, stored_load
from second_order import Fineness, deflection
from superelement import middle_less_mean

from cases import PAIRS, LoadCase, solved

FACTORS = (0.5, 0.7)
ORDER, HIGHEST_ORDER, LOWEST_ORDER = 2.75, 3.5, 2.0
"""Of convergence: the one taken, and those that bound the truth."""

GEARS = {"spur": (0,), "thin_rim": (0,), "thin_ring": (1,), "high_speed": (0,)}
"""Gears of a pair that are computed where they are not both: one of equal ones, no known one, no thin wedge."""


def extrapolated(meshes: Sequence[dict[str, float]], order: float) -> float:
    """Deflection (um) on elements without size, from the two finest meshes."""
    coarse, fine = sorted(meshes, key=lambda mesh: mesh["factor"])[-2:]
    gain = (fine["factor"] / coarse["factor"]) ** order - 1.0
    return fine["deflection_um"] + (fine["deflection_um"] - coarse["deflection_um"]) / gain


def mesh_entry(load: LoadCase, number: int, factor: float) -> dict[str, float]:
    """Part (um) of gear 0 or 1 in the transmission error on one mesh, as stored."""
    found = deflection(load, number, Fineness(factor))
    middles = found.mean + middle_less_mean(load, number)
    um = 1e6 * load.force @ middles / load.force.sum() / math.cos(load.pair.pinion.base_helix_angle)
    return {"factor": factor, "unknowns": found.unknowns, "deflection_um": round(float(um), 5)}


def gear_entry(load: LoadCase, number: int, factors: Sequence[float]) -> dict[str, Any]:
    """Meshes, extrapolated deflection and its range, as stored."""
    meshes = [mesh_entry(load, number, factor) for factor in sorted(factors)]
    low, middle, high = (round(extrapolated(meshes, order), 4) for order in (HIGHEST_ORDER, ORDER, LOWEST_ORDER))
    return {"meshes": meshes, "deflection_um": middle, "between_um": [low, high]}


def _solved_and_kept(name: str) -> LoadCase:
    pair, pmc = name.split()
    build, torque, _ = PAIRS[pair]
    load = solved(build(), torque, float(pmc))
    values = {field.name: getattr(load.cells, field.name) for field in dataclasses.fields(load.cells)}
    forces = {key: value for key, value in values.items() if key not in ("gap", "cut", "offset")}
    forces |= {"force": load.force, "axial": load.axial}
    with np.load(FOLDER / "forces.npz") as file:
        kept = {key: file[key] for key in file.files}
    np.savez_compressed(FOLDER / "forces.npz", **kept, **{f"{name}/{key}": value for key, value in forces.items()})
    return load


def renewed(name: str, stored: dict[str, Any], factors: Sequence[float] | None) -> dict[str, Any]:
    """Entry of a case, as stored, on the meshes of the stored one unless other factors are given."""
    load = stored_load(name) if name in stored else _solved_and_kept(name)
    pair = name.split()[0]
    known = stored.get(name, {}).get("gears", {})
    gears = {}
    for number in GEARS.get(pair, (0, 1)):
        meshes = known.get(str(number), {}).get("meshes", ())
        gears[str(number)] = gear_entry(load, number, factors or [mesh["factor"] for mesh in meshes] or FACTORS)
    return {"pair": pair, "torque_N_m": PAIRS[pair][1], "pmc": load.pmc, "gears": gears}


def main() -> None:
    """Compute the cases named on the command line and store them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="+", help="pair and position")
    parser.add_argument("--factors", type=float, nargs="+", help="of the element sizes; two or more")
    arguments = parser.parse_args()
    path = FOLDER / "results.json"
    for name in arguments.cases:
        stored = json.loads(path.read_text(encoding="utf-8"))
        entry = renewed(name, stored, arguments.factors)
        path.write_text(json.dumps(stored | {name: entry}, indent=1) + "\n", encoding="utf-8")
        for gear, truth in entry["gears"].items():
            sys.stdout.write(f"{name} gear {int(gear) + 1}: {truth['deflection_um']:.4f} um\n")


if __name__ == "__main__":
    main()
