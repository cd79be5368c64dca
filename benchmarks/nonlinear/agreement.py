"""Static transmission error by the superelement and by the full non-linear analysis on the same open sectors.

Run ``python benchmarks/nonlinear/agreement.py`` for all cases, or with names of cases; it renews their entries in
``results.json``. See README.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import json
import math
import platform
import sys
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from fe_ste.elasticity.gear_mesh import ContactMesh
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.reference.position import NonlinearSettings, nonlinear_position
from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
from fe_ste.transmission_error.search import contact_state

RESULTS = Path(__file__).with_name("results.json")
sys.path.insert(0, str(Path(__file__).parents[1] / "calculix"))
PAIRS = importlib.import_module("cross_check").PAIRS
TORQUES = {"spur": 340.0, "helical": 5400.0, "internal": 10000.0}
POSITIONS = (0.0, 0.2, 0.4, 0.6, 0.8)
#: Mesh of the superelement: finer than the default one.
SUPERELEMENT = MeshSettings(layers=14, flank=24, thickness=14, fillet=6, root=4, rim=18)
#: Default mesh of the non-linear analysis while it modelled open sectors, for which the results are stored.
OF_SECTORS = ContactMesh(layers=6, thickness=9, fillet=4, root=3, rim=10)
MESHES = {"coarse": OF_SECTORS.refined(0.6), "default": OF_SECTORS, "fine": OF_SECTORS.refined(1.5)}


@dataclass(frozen=True)
class Case:
    """One position of one pair on one mesh.

    Parameters
    ----------
    pair : str
        Key of the pairs of the CalculiX benchmark.
    pmc : float
    mesh : str
        Key of `MESHES`.
    teeth : int
    finite_deformation : bool
    """

    pair: str
    pmc: float
    mesh: str = "default"
    teeth: int = 3
    finite_deformation: bool = True


def _cases() -> dict[str, Case]:
    cases = {}
    for pair in TORQUES:
        for pmc in POSITIONS:
            cases[f"{pair} {pmc:g}"] = Case(pair, pmc)
        for pmc in (0.0, 0.6):
            cases[f"{pair} {pmc:g} small strain"] = Case(pair, pmc, finite_deformation=False)
        for mesh in ("coarse", "fine"):
            cases[f"{pair} 0 {mesh}"] = Case(pair, 0.0, mesh=mesh)
        for teeth in (5, 7):
            cases[f"{pair} 0 {teeth} teeth"] = Case(pair, 0.0, teeth=teeth)
    return cases


CASES = _cases()


@lru_cache(maxsize=4)
def compliance(pair: str, teeth: int | None) -> PairCompliance:
    """Superelement of a pair on open sectors, or on closed rings without a number of teeth."""
    return pair_compliance(PAIRS[pair](), SUPERELEMENT, open_teeth=teeth)


def superelement(pair: str, pmc: float, teeth: int | None) -> dict[str, float]:
    """Solve a position by the superelement: static transmission error and wall time."""
    prepared = compliance(pair, teeth)
    started = time.perf_counter()
    state = contact_state(prepared, TORQUES[pair], pmc)
    elapsed = time.perf_counter() - started
    ste = state.solution.approach / math.cos(prepared.pair.pinion.base_helix_angle)
    return {"ste_um": 1e6 * ste, "position_wall_s": elapsed}


def with_superelement(case: Case, entry: dict[str, Any]) -> dict[str, Any]:
    """Entry of a case with the figures of the superelement renewed."""
    ours = superelement(case.pair, case.pmc, case.teeth)
    difference = ours["ste_um"] / entry["nonlinear"]["ste_um"] - 1.0
    renewed = entry | {"superelement": ours, "difference_percent": 100.0 * difference}
    if case.teeth > 3 or case.pmc == 0.0:
        renewed["closed_ring_um"] = superelement(case.pair, case.pmc, None)["ste_um"]
    return renewed


def compare(case: Case) -> dict[str, Any]:
    """Both methods on one case, as stored."""
    settings = NonlinearSettings(case.teeth, MESHES[case.mesh], False, case.finite_deformation)
    found = nonlinear_position(PAIRS[case.pair](), TORQUES[case.pair], case.pmc, settings)
    entry = {
        "case": dataclasses.asdict(case),
        "torque_N_m": TORQUES[case.pair],
        "contact_mesh": dataclasses.asdict(MESHES[case.mesh]),
        "nonlinear": {
            "ste_um": 1e6 * found.ste,
            "unknowns": found.unknowns,
            "iterations": len(found.equilibrium.iterations),
            "position_wall_s": found.wall_time,
            "load_share": {str(tooth): share for tooth, share in found.load_share.items()},
        },
        "machine": f"{platform.system()} {platform.machine()}",
    }
    return with_superelement(case, entry)


def stored() -> dict[str, dict[str, Any]]:
    """Results by name of the case."""
    if not RESULTS.exists():
        return {}
    results: dict[str, dict[str, Any]] = json.loads(RESULTS.read_text(encoding="utf-8"))
    return results


def main() -> None:
    """Run the cases named on the command line and store their results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", help="names of cases; all, if none is given")
    parser.add_argument("--superelement", action="store_true", help="renew only the superelement's figures")
    arguments = parser.parse_args()
    for name in arguments.cases or CASES:
        case = CASES[name]
        entry = with_superelement(case, stored()[name]) if arguments.superelement else compare(case)
        RESULTS.write_text(json.dumps(stored() | {name: entry}, indent=1) + "\n", encoding="utf-8")
        ours, theirs = entry["superelement"]["ste_um"], entry["nonlinear"]["ste_um"]
        sys.stdout.write(
            f"{name}: superelement {ours:.3f} um, non-linear {theirs:.3f} um, {entry['difference_percent']:+.2f} %, "
            f"{entry['nonlinear']['unknowns']} unknowns, {entry['nonlinear']['position_wall_s']:.0f} s\n"
        )
        sys.stdout.flush()


if __name__ == "__main__":
    main()
