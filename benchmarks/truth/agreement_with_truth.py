"""Deflection of the stored contact forces' cells by the superelement, beside the stored truth.

Run ``python benchmarks/truth/agreement_with_truth.py``.
"""

from __future__ import annotations

import json
import math
import sys
from functools import cache
from pathlib import Path

import numpy as np
from superelement import cell_deflection

from cases import PAIRS, TEETH, LoadCase
from fe_ste.contact.kinematics import Cells
from fe_ste.elasticity.flank import FlankCompliance, flank_compliance
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear

FOLDER = Path(__file__).parent
MESH = MeshSettings(rim=24)
"""The default one, but finer towards the hub: an open sector stands on few elements there, which a ring does not."""


def stored_load(name: str) -> LoadCase:
    """Load case of an entry of ``results.json``."""
    entry = json.loads((FOLDER / "results.json").read_text(encoding="utf-8"))[name]
    with np.load(FOLDER / "forces.npz") as file:
        stored = {key.split("/")[1]: file[key] for key in file.files if key.startswith(f"{name}/")}
    force, axial = stored.pop("force"), stored.pop("axial")
    nothing = np.zeros(len(force))
    whole = {key: stored[key].astype(np.int64) for key in ("tooth", "layer")}
    cells = Cells(**(stored | whole), gap=nothing, cut=nothing > 0.0, offset=nothing)
    return LoadCase(PAIRS[entry["pair"]][0](), entry["pmc"], cells, force, axial)


@cache
def _flank(gear: Gear, side: int) -> FlankCompliance:
    return flank_compliance(gear, side, MESH, open_teeth=TEETH)


def superelement_um(name: str, number: int) -> float:
    """Part of gear 0 or 1 in the transmission error, the forces given: force by displacement over their sum."""
    load = stored_load(name)
    gear, side, _, _ = load.on_gear(number)
    moved = load.force @ cell_deflection(load, number, _flank(gear, side)) / load.force.sum()
    return float(1e6 * moved / math.cos(load.pair.pinion.base_helix_angle))


def main() -> None:
    """Print all."""
    stored = json.loads((FOLDER / "results.json").read_text(encoding="utf-8"))
    for name, entry in stored.items():
        for gear, truth in entry["gears"].items():
            ours, true = superelement_um(name, int(gear)), truth["deflection_um"]
            sys.stdout.write(
                f"{name} gear {int(gear) + 1}: {ours:.4f} um, truth {true:.4f}, {100 * (ours / true - 1):+.2f} %\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
