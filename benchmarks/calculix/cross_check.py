"""Static transmission error by the superelement, by CalculiX and by the non-linear analysis on the same meshes.

Run ``python benchmarks/calculix/cross_check.py`` for all cases, or with names of cases; it renews their entries
in ``results.json``. See README.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import platform
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ccx_model import CalculixSettings, run_calculix, write_input

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.gear_mesh import GearMesh, placed_gears, whole_ring
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import BasicRack, Gear, GearPair
from fe_ste.reference.newton import solve_contact
from fe_ste.reference.position import gear_model
from fe_ste.transmission_error.compliance import pair_compliance
from fe_ste.transmission_error.search import contact_state

RESULTS = Path(__file__).with_name("results.json")
TEETH = 3


def spur_pair() -> GearPair:
    """Two equal spur gears, 50 teeth, module 3 mm, 20 mm wide, held at 100 mm diameter."""
    gear = Gear(name="spur", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    return GearPair(name="spur", pinion=gear, gear=gear, centre_distance=150e-3)


def _grc_gear(name: str, teeth: int, hand: int, shift: float, held_diameter: float, internal: bool = False) -> Gear:
    """Gear of the planetary stage of the GRC 750 gearbox at 60 mm face width."""
    return Gear(
        name=name,
        teeth=teeth,
        normal_module=10e-3,
        helix_angle=hand * math.radians(7.495),
        profile_shift=shift,
        face_width=60e-3,
        held_diameter=held_diameter,
        internal=internal,
        rack=BasicRack(addendum=1.0, dedendum=1.46, tip_radius=0.36),
        tooth_thinning=0.2e-3,
    )


def helical_pair() -> GearPair:
    """Sun and planet of the GRC 750 gearbox (21/39) at 60 mm face width."""
    sun, planet = _grc_gear("sun", 21, 1, 0.176, 120e-3), _grc_gear("planet", 39, -1, 0.399, 290e-3)
    return GearPair(name="helical", pinion=sun, gear=planet, centre_distance=308e-3)


def internal_pair() -> GearPair:
    """Planet and ring of the GRC 750 gearbox (39/99) at 60 mm face width."""
    planet = _grc_gear("planet", 39, -1, 0.399, 290e-3)
    ring = _grc_gear("ring", 99, -1, 0.974, 1166e-3, internal=True)
    return GearPair(name="internal", pinion=planet, gear=ring, centre_distance=308e-3)


def deep_pair() -> GearPair:
    """Spur gears of 15 and 23 teeth, module 3 mm, 10 mm wide, held at 20 mm diameter: an open sector would bend."""
    pinion, wheel = (
        Gear(name=name, teeth=teeth, normal_module=3e-3, face_width=10e-3, held_diameter=20e-3, profile_shift=shift)
        for name, teeth, shift in (("pinion", 15, 0.3), ("wheel", 23, -0.3))
    )
    return GearPair(name="deep", pinion=pinion, gear=wheel, centre_distance=57e-3)


PAIRS = {"spur": spur_pair, "helical": helical_pair, "internal": internal_pair, "deep": deep_pair}


@dataclass(frozen=True)
class Case:
    """One position of one pair on one mesh.

    Parameters
    ----------
    pair : str
        Key of `PAIRS`.
    torque : float
        On gear 1, N m.
    pmc : float
    mesh : MeshSettings
    calculix : CalculixSettings
    """

    pair: str
    torque: float
    pmc: float
    mesh: MeshSettings
    calculix: CalculixSettings = CalculixSettings()
    others: MeshSettings | None = None
    """Of the other teeth of whole gears; None for open sectors."""


def superelement(case: Case, contact: ContactSettings | None = None) -> dict[str, float]:
    """Solve a case by the superelement: static transmission error and processor times."""
    pair = PAIRS[case.pair]()
    started = time.process_time()
    compliance = pair_compliance(pair, case.mesh, contact, open_teeth=None if case.others else TEETH)
    offline = time.process_time() - started
    started = time.process_time()
    state = contact_state(compliance, case.torque, case.pmc)
    ste = state.solution.approach / math.cos(pair.pinion.base_helix_angle)
    return {"ste_um": 1e6 * ste, "offline_cpu_s": offline, "position_cpu_s": time.process_time() - started}


def _gears(case: Case) -> tuple[GearMesh, GearMesh]:
    """Both gears in their places; of whole ones the other teeth are condensed."""
    whole = case.others is not None
    return placed_gears(PAIRS[case.pair](), case.mesh, TEETH, case.pmc, closed=whole, others=case.others)


def calculix(case: Case, expected: float, folder: Path, threads: int = 1) -> dict[str, float | int | str]:
    """Solve a case by CalculiX; `expected` (m) only sets how far the first step closes the flanks."""
    pair = PAIRS[case.pair]()
    one, two = _gears(case)
    sectors = (whole_ring(one), whole_ring(two)) if case.others else (one, two)
    path = folder / "pair.inp"
    write_input(path, pair, sectors, case.torque, expected, case.calculix)
    result = run_calculix(path, pair, 3 * sum(len(sector.points) for sector in sectors), threads)
    return {
        "ste_um": 1e6 * result.ste,
        "unknowns": result.unknowns,
        "position_cpu_s": result.processor_time,
        "position_wall_s": result.wall_time,
        "iterations": result.iterations,
        "version": result.version,
        "threads": threads,
    }


def nonlinear(case: Case) -> dict[str, float | int]:
    """Solve a case by the program's own full non-linear analysis, on the mesh that CalculiX gets."""
    pair = PAIRS[case.pair]()
    started, spent = time.perf_counter(), time.process_time()
    model = gear_model(pair, case.torque, _gears(case), case.calculix.large_displacements)
    found = solve_contact(model)
    return {
        "ste_um": 1e6 * found.hub,
        "unknowns": int(model.held.size),
        "position_cpu_s": time.process_time() - spent,
        "position_wall_s": time.perf_counter() - started,
        "iterations": len(found.iterations),
    }


def with_superelement(entry: dict[str, Any], ours: dict[str, float]) -> dict[str, Any]:
    """Entry of a case with the figures of the superelement."""
    difference = ours["ste_um"] / float(entry["calculix"]["ste_um"]) - 1.0
    return entry | {"superelement": ours, "difference_percent": 100.0 * difference}


def compare(case: Case, threads: int = 1) -> dict[str, Any]:
    """All methods on one case, as stored."""
    ours = superelement(case)
    with tempfile.TemporaryDirectory() as folder:
        theirs = calculix(case, 1e-6 * ours["ste_um"], Path(folder), threads)
    entry = {
        "case": dataclasses.asdict(case),
        "open_teeth": None if case.others else TEETH,
        "calculix": theirs,
        "nonlinear": nonlinear(case),
        "machine": f"{platform.system()} {platform.machine()}",
    }
    return with_superelement(entry, ours)


def _mesh(layers: int, flank: int) -> MeshSettings:
    return MeshSettings(layers=layers, flank=flank, thickness=6, fillet=3, root=3, rim=6)


_COARSE = _mesh(5, 16)
_FINE = MeshSettings(layers=4, flank=32, thickness=8, fillet=6, root=5, rim=12, grading=6.0)
#: Teeth that are far from the contact.
_OTHERS = MeshSettings(layers=4, flank=4, thickness=2, fillet=6, root=5, rim=12)
_LARGE = CalculixSettings(large_displacements=True)
_SOFT = CalculixSettings(contact_stiffness=50.0)

CASES = {
    "spur 0 coarse": Case("spur", 340.0, 0.0, _COARSE),
    "spur 0 flank 32": Case("spur", 340.0, 0.0, _mesh(5, 32)),
    "spur 0 flank 64": Case("spur", 340.0, 0.0, _mesh(4, 64)),
    "spur 0 fine": Case("spur", 340.0, 0.0, _FINE),
    "spur 0.5 coarse": Case("spur", 340.0, 0.5, _COARSE),
    "spur 0.5 fine": Case("spur", 340.0, 0.5, _FINE),
    "spur 0 coarse, large displacements": Case("spur", 340.0, 0.0, _COARSE, _LARGE),
    "spur 0 coarse, soft contact": Case("spur", 340.0, 0.0, _COARSE, _SOFT),
    "helical 0 flank 16": Case("helical", 5400.0, 0.0, _mesh(6, 16)),
    "helical 0 flank 24": Case("helical", 5400.0, 0.0, _mesh(9, 24)),
    "helical 0 flank 32": Case("helical", 5400.0, 0.0, _mesh(12, 32)),
    "helical 0 flank 48, 6 layers": Case("helical", 5400.0, 0.0, _mesh(6, 48)),
    "helical 0.5 flank 16": Case("helical", 5400.0, 0.5, _mesh(6, 16)),
    "helical 0.5 flank 24": Case("helical", 5400.0, 0.5, _mesh(9, 24)),
    "internal 0 flank 16": Case("internal", 10000.0, 0.0, _mesh(6, 16)),
    "deep 0 whole gears": Case("deep", 100.0, 0.0, _FINE, others=_OTHERS),
    "internal 0 flank 32": Case("internal", 10000.0, 0.0, _mesh(6, 32)),
}


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
    parser.add_argument("--without-calculix", action="store_true", help="renew only this program's own figures")
    parser.add_argument("--superelement", action="store_true", help="renew only the superelement's figures")
    parser.add_argument("--threads", type=int, default=1, help="threads of ccx")
    arguments = parser.parse_args()
    for name in arguments.cases or CASES:
        if arguments.superelement or arguments.without_calculix:
            entry = with_superelement(stored()[name], superelement(CASES[name]))
            if arguments.without_calculix:
                entry["nonlinear"] = nonlinear(CASES[name])
        else:
            entry = compare(CASES[name], arguments.threads)
        RESULTS.write_text(json.dumps(stored() | {name: entry}, indent=1) + "\n", encoding="utf-8")
        ours, theirs = entry["superelement"]["ste_um"], entry["calculix"]["ste_um"]
        own = f", non-linear {entry['nonlinear']['ste_um']:.3f} um" if "nonlinear" in entry else ""
        sys.stdout.write(
            f"{name}: superelement {ours:.3f} um, CalculiX {theirs:.3f} um, {entry['difference_percent']:+.2f} %{own}\n"
        )
        sys.stdout.flush()


if __name__ == "__main__":
    main()
