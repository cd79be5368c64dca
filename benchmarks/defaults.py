"""What the commands show without an option, beside the best model of the program, on gearboxes of several kinds.

    python benchmarks/defaults.py [NAME ...] [--folder FOLDER] [--heights COUNT]

The default: law `line_of_action`, linear bearings, the contact of the teeth as the commands find it. The best: law
`table` on full grids, bearings by their rows (`model = "iso16281"`). Modes are matched by shape; misalignments and
bearing loads are those of the static load; heights are those of the loudest lines of the overall transmission error,
beside a dense sweep of the level `nonlinear`. Figures go to `defaults.json` in the folder;
docs/validation/steady_response.md shows them.
"""

from __future__ import annotations

import argparse
import copy
import json
import tempfile
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from exugear import Choice, Gearbox, Modes, Project
from exugear.gearbox.templates.kinds import template
from exugear.gearbox.units import RPM
from exugear.steady.peaks import Peak, peaks
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.system.statics import static_state

CASE = Path(__file__).parent.parent / "cases" / "grc750" / "gearbox.toml"
DEFAULT, BEST = Choice("bushing"), Choice("bushing", "table")
SAME_SHAPE = 0.8
"""Least share of kinetic energy that a mode must have along another to count as the same."""
HIGHEST_HZ = 5000.0
"""Frequency up to which modes are compared."""
BESIDE, DENSE = 0.02, 21
"""Share of a peak's speed on either side that the best model is swept over, and at how many speeds."""
SIGNAL = "overall_dte"
LEAST_TILT, LEAST_LOAD = 1e-9, 1.0
"""Misalignment (rad) and load (N) of the best model below which there is nothing to compare: planets in balance."""

Content = dict[str, Any]


def relieved() -> Content:
    """Two parallel stages whose second pinion has tip relief and crowning."""
    content = tomllib.loads(template("parallel"))
    content["name"] = "two parallel stages, second relieved"
    relief = {"tip_relief_um": 12.0, "tip_relief_length_mm": 7.0}
    content["gears"]["pinion_2"]["modification"] = {**relief, "lead_crowning_um": 4.0}
    content["gears"]["wheel_2"]["modification"] = relief
    return content


def internal() -> Content:
    """One helical pinion in an overhung ring; the ring's teeth are short, for the pinion's roots."""
    content = tomllib.loads(template("pair"))
    content["name"] = "pinion in a ring"
    content["gears"]["pinion"] |= {"helix_angle_deg": 12.0, "profile_shift": 0.0}
    content["gears"]["wheel"] = {
        "teeth": 71,
        "internal": True,
        "normal_module_mm": 3.0,
        "helix_angle_deg": 12.0,
        "face_width_mm": 40.0,
        "held_diameter_mm": 262.0,
        "tooth_thinning_mm": 0.06,
        "rack": {"addendum": 0.8},
    }
    distance = 3.0 * (71 - 24) / (2.0 * np.cos(np.radians(12.0)))
    content["pairs"]["helical"]["centre_distance_mm"] = round(float(distance), 3)
    content["bodies"]["output"] |= {"axis_position_mm": [round(float(distance), 3), 0.0]}
    content["bodies"]["output"]["inertia"]["discs"] = {
        "mass_kg": 14.0,
        "axial_kg_m2": 0.18,
        "transverse_kg_m2": 0.13,
        "centre_of_mass_z_mm": 25.0,
    }
    for name, z in (("output_left", 50.0), ("output_right", 130.0)):
        content["bearings"][name]["z_mm"] = z
    content["load_cases"]["run_up"]["torques_N_m"]["output"] = -150.0 * 71.0 / 24.0 + 0.2
    return content


def two_stages() -> Content:
    """Two heavily loaded stages on tapered and cylindrical rollers, the second pinion near one end of its shaft."""
    content = tomllib.loads(template("parallel"))
    content["name"] = "two loaded stages, asymmetric"
    content["static_load"]["torques_N_m"] = {"input": 220.0}
    content["bodies"]["middle"]["gears_z_mm"] = {"wheel_1": -50.0, "pinion_2": 48.0}
    content["bodies"]["output"]["gears_z_mm"] = {"wheel_2": 48.0}
    content["housing"]["factor"] = 0.3
    return content


def of_template(kind: str) -> Gearbox:
    """Gearbox that `exugear new` begins with."""
    return Gearbox.from_dict(tomllib.loads(template(kind)))


CASES: Mapping[str, Callable[[], Gearbox]] = {
    "grc750": lambda: Gearbox.from_toml(CASE),
    **{kind: partial(of_template, kind) for kind in ("pair", "parallel", "planetary", "wind")},
    "relieved": lambda: Gearbox.from_dict(relieved()),
    "internal": lambda: Gearbox.from_dict(internal()),
    "two stages": lambda: Gearbox.from_dict(two_stages()),
}


def by_rows(gearbox: Gearbox) -> Gearbox:
    """Let every catalogue bearing act by its rows."""
    content = copy.deepcopy(dict(gearbox.content))
    for bearing in content["bearings"].values():
        if "catalogue" in bearing and "radial_load_kN" not in bearing["catalogue"]:
            bearing["model"] = "iso16281"
    return Gearbox.from_dict(content)


@dataclass(frozen=True)
class Difference:
    """A figure of the default beside that of the best model."""

    name: str
    default: float
    best: float

    @property
    def share(self) -> float:
        """Difference over the best model's value."""
        return (self.default - self.best) / self.best if self.best else 0.0


def same_modes(default: Modes, best: Modes) -> list[Difference]:
    """Frequencies (Hz) of modes that have the same shape, by the best model's number."""
    mass = default.assembly.mass_matrix
    likeness = (best.shapes.T @ mass @ default.shapes) ** 2
    matched = []
    for number, shares in enumerate(likeness):
        other = int(np.argmax(shares))
        frequency = float(best.frequency[number])
        if shares[other] >= SAME_SHAPE and 1.0 < frequency <= HIGHEST_HZ:
            matched.append(Difference(best.names[number], float(default.frequency[other]), frequency))
    return matched


def misalignments(default: Project, best: Project) -> list[Difference]:
    """Misalignment of each mesh at the static load, rad."""
    states = [static_state(project.assembly()) for project in (default, best)]
    names = states[0].assembly.mesh_names
    pairs = zip(names, *(state.misalignment for state in states), strict=True)
    found = [Difference(name, float(one), float(other)) for name, one, other in pairs]
    return [own for own in found if abs(own.best) > LEAST_TILT]


def bearing_loads(default: Project, best: Project) -> list[Difference]:
    """Radial load of each catalogue bearing at the static load, N."""
    pairs = zip(default.bearings(), best.bearings(), strict=True)
    found = [Difference(one.name, one.radial_load, other.radial_load) for one, other in pairs]
    return [own for own in found if abs(own.best) > LEAST_LOAD]


def heights(default: Project, best: Project, count: int) -> list[Difference]:
    """Amplitudes of the loudest lines (m), each at its own resonance of the one and the other model."""
    found = peaks(default.steady(), SIGNAL)[:count]
    return [Difference(f"{peak.line}, {peak.frequency:.0f} Hz", peak.amplitude, _height(best, peak)) for peak in found]


def _height(best: Project, peak: Peak) -> float:
    about = abs(peak.speed) / RPM
    speeds = SpeedRange.from_text(f"{about * (1.0 - BESIDE)}:{about * (1.0 + BESIDE)}:{DENSE}")
    swept = best.steady(SteadySettings(speeds, "nonlinear", at_resonances=False))
    same = [own.amplitude for own in peaks(swept, SIGNAL, 0.0) if own.line == peak.line]
    return max(same, default=float("nan"))


def compare(gearbox: Gearbox, folder: Path, count: int = 0) -> dict[str, list[Difference]]:
    """All differences of a gearbox, tables taken from the folder or computed into it; heights of `count` lines."""
    default = Project(gearbox, folder, DEFAULT)
    default.tables(grid=True)
    best = Project(by_rows(gearbox), folder / "best", BEST)
    _share_tables(default, best)
    found = {
        "frequency": same_modes(default.modes(), best.modes()),
        "misalignment": misalignments(default, best),
        "bearing load": bearing_loads(default, best),
    }
    return found | ({"height": heights(default, best, count)} if count else {})


def _share_tables(one: Project, other: Project) -> None:
    other.folder.mkdir(parents=True, exist_ok=True)
    tables = other.folder / "tables"
    if not tables.exists():
        tables.symlink_to((one.folder / "tables").resolve())


def main() -> None:
    """Compare, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="of " + ", ".join(CASES))
    parser.add_argument("--folder", type=Path, default=Path(tempfile.gettempdir()) / "exugear-defaults")
    parser.add_argument("--heights", type=int, default=0, help="how many of the loudest lines are compared")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    results = arguments.folder / "defaults.json"
    kept = json.loads(results.read_text(encoding="utf-8")) if results.exists() else {}
    for name in arguments.names or CASES:
        found = compare(CASES[name](), arguments.folder / name, arguments.heights)
        kept[name] = {what: [[own.name, own.default, own.best] for own in own_list] for what, own_list in found.items()}
        results.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
        for what, differences in found.items():
            if not differences:
                print(f"{name}: {what}: nothing to compare")
                continue
            worst = max(differences, key=lambda own: abs(own.share))
            print(f"{name}: {what}: {len(differences)} compared, worst {100.0 * worst.share:+.2f} %, {worst.name}")


if __name__ == "__main__":
    main()
