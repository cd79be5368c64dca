"""GRC 750 kW: which of its assumptions bring a resonance at the reference's 3215 Hz that the rigid variant lacks.

    python cases/grc750/search_3215.py [results folder]

The reference found a peak of the overall transmission error at 3215 Hz with compliant bearings, and none with rigid
ones. What it assumed is not printed. This varies what had to be assumed here: radial stiffness of the planet bearings
with housing factor, or one stiffness for all bearings; and with either the inertia set, spin inertia and mass of the
high-speed shaft, and stiffness of the brake coupling. The damping is that of `published.py`, not that of the file.

For each set of the others, every bearing stiffness within the range that makes 3215 Hz a natural frequency is found
exactly: stiffness matrices are linear in it, so that these are eigenvalues. There the response to the static
transmission errors tells how far each mesh order, up to the fifth harmonic and 215 rpm, rises above both its sides
within 10 % of the frequency, at a peak within 2 % of it in `bushing` and anywhere within 10 % in `rigid`. The mean
system is that at half the speed.

Lines go to search-3215.jsonl in the results folder (results/grc750-published without one), one set each; a search that
is stopped goes on there. Tables of the case are computed first where they are missing. `draw_3215.py` draws what was
found.
"""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from published import published_project

from exugear import Choice, Gearbox, Project, assemble
from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.response import transmission_errors
from exugear.steady.harmonics.linear_solvers import batches_of
from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.steady.point_solver import harmonic_balance_model
from exugear.system.system import input_hash
from exugear.system.tooth_mesh.contact_state import MeshContactState
from exugear.system.tooth_mesh.element import MeshCurve

TARGET_HZ, NEAR, AROUND = 3215.0, 0.02, 0.10
FASTEST = 215.0 * np.pi / 30.0
HARMONICS = 5
FREQUENCIES = TARGET_HZ * np.linspace(1.0 - AROUND, 1.0 + AROUND, 81)
RANGES = {"planet_bearings": (8e8, 4e10), "all_bearings": (1e8, 1e11)}
"""Radial stiffness of each bearing of a planet with all others as in the file, or of every bearing, N/m."""
HOUSING_FACTORS = (0.2, 0.3, 0.5, 1.0)
SPIN_FACTORS = {"assemblies": (0.1, 0.2, 0.3, 1.0, 1.5), "gears": (0.7, 1.0, 2.0, 4.0)}
"""Axial inertia of the high-speed shaft over that of the file, by inertia set."""
MASS_FACTORS = (0.7, 1.0, 1.3)
"""Its mass over that of the file."""
COUPLINGS = (1e5, 1e6, 1e8, 1e10)
"""Torsional stiffness between high-speed shaft and brake disc, N m/rad."""
AXIAL = {
    **dict.fromkeys(("pl_a", "pl_b", "plc_a", "plc_b"), 1e8),
    **dict.fromkeys(("lss_a", "ims_a", "hss_a"), 1e6),
    **dict.fromkeys(("lss_bc", "ims_bc", "hss_bc"), None),
}
"""Axial stiffness of springs in place of bearings, N/m: as in the file; of pairs that hold a shaft the radial one."""
TOLD_FROM = 1.0
"""Rise from which a peak is kept, dB."""
SEEN, BESIDE = 2.0, (0.94, 0.97, 1.03, 1.06)
"""Rise from which stiffnesses beside one are looked at, and their shares of it."""
WANTED = 6.0
"""Rise of the reference's peak, dB."""


@dataclass(frozen=True)
class Given:
    """What all sets share: the gearbox, its mesh stiffness, and the contact of its teeth at rest.

    The contact is that of the file as it is: solved for each set anew it would take minutes of a set, and moves what is
    looked for by less than the range that is looked in.
    """

    gearbox: Gearbox
    stiffness: Mapping[str, Any]
    contact: Mapping[str, MeshContactState]


def given_by(project: Project) -> Given:
    """Take it from a project, whose tables are there."""
    bare = {
        name: replace(curve, table=None) if isinstance(curve, MeshCurve) else curve
        for name, curve in project.stiffness().items()
    }
    return Given(project.gearbox, bare, project.assembly().contacts.states)


def sets() -> list[dict[str, float | str]]:
    """Every set of what is not a bearing's stiffness, always in the same order."""
    found: list[dict[str, float | str]] = []
    # The kind whose sets have the peak comes first: a search that is stopped has what matters.
    for kind, factors in (("all_bearings", (1.0,)), ("planet_bearings", HOUSING_FACTORS)):
        for inertias, spins in SPIN_FACTORS.items():
            for factor, spin, mass, coupling in itertools.product(factors, spins, MASS_FACTORS, COUPLINGS):
                shaft = {"inertias": inertias, "spin": spin, "mass": mass}
                found.append({"kind": kind, "housing_factor": factor, **shaft, "coupling": coupling})
    return found


def varied(gearbox: Gearbox, own: Mapping[str, Any], radial: float) -> Gearbox:
    """Gearbox with a set of assumptions and a radial stiffness of its bearings, N/m.

    The shaft's transverse inertia follows its mass; it is half of the axial one at least, as of a disc.
    """
    path = f"bodies.hss.inertia.{own['inertias']}"
    inertia = gearbox.content["bodies"]["hss"]["inertia"][own["inertias"]]
    axial = own["spin"] * inertia["axial_kg_m2"]
    changes: dict[str, Any] = {
        "housing.factor": own["housing_factor"],
        f"{path}.axial_kg_m2": axial,
        f"{path}.mass_kg": own["mass"] * inertia["mass_kg"],
        f"{path}.transverse_kg_m2": max(own["mass"] * inertia["transverse_kg_m2"], 0.5 * axial),
        "couplings.brake_coupling.stiffness_N_m_per_rad": own["coupling"],
    }
    for name in ("pl_a", "pl_b") if own["kind"] == "planet_bearings" else AXIAL:
        changes[f"bearings.{name}.catalogue"] = None
        changes[f"bearings.{name}.stiffness"] = {"radial_N_per_m": radial, "axial_N_per_m": AXIAL[name] or radial}
        changes[f"bearings.{name}.housing_factor_applies"] = False
    return gearbox.varied(changes)


def model_with(given: Given, own: Mapping[str, Any], radial: float, variant: str) -> HarmonicBalanceModel:
    """Mean system and meshes of a variant."""
    choice = Choice(variant, inertias=own["inertias"])
    assembly = assemble(varied(given.gearbox, own, radial), choice, given.stiffness, contact=given.contact)
    return harmonic_balance_model(assembly, np.array([0.0, FASTEST]), HARMONICS, 0)


@dataclass(frozen=True)
class Between:
    """The variant `bushing` of a set at any radial stiffness within the range, from what it is at both ends.

    Stiffness and damping are linear in it. What the meshes push along is that at the stiff end, where it hardly moves.
    """

    low: float
    high: float
    soft: MeanSystem
    stiff: HarmonicBalanceModel

    @classmethod
    def of(cls, given: Given, own: Mapping[str, Any]) -> Between:
        """Assemble both ends of a set."""
        low, high = RANGES[str(own["kind"])]
        soft, stiff = (model_with(given, own, radial, "bushing") for radial in (low, high))
        return cls(low, high, soft.system, stiff)

    def at(self, radial: float) -> MeanSystem:
        """Mean system at a radial stiffness, N/m."""
        share = (radial - self.low) / (self.high - self.low)
        changed = {
            name: (1.0 - share) * getattr(self.soft, name) + share * getattr(self.stiff.system, name)
            for name in ("stiffness", "damping")
        }
        return replace(self.stiff.system, **changed)


def tuned(between: Between) -> list[float]:
    """Radial stiffnesses within the range (N/m) with which the frequency is a natural one of `bushing`.

    With the stiffness matrix K_0 + s E of the mean system they solve (K_0 - w^2 M) x = -s E x.
    """
    low, high = between.low, between.high
    at, speed = 2.0 * np.pi * TARGET_HZ, 0.5 * FASTEST
    first, last = (system.stiffness_at(speed) for system in (between.soft, between.stiff.system))
    slope = (last - first) / (high - low)
    found = scipy.linalg.eigvals(at**2 * between.soft.mass - first + low * slope, slope)
    real = found.real[np.isfinite(found) & (np.abs(found.imag) < 1e-3 * np.abs(found.real))]
    kept: list[float] = []
    for value in sorted(float(f"{own:.3g}") for own in real[(real >= low) & (real <= high)]):
        if not kept or value > 1.005 * kept[-1]:
            kept.append(value)
    return kept


def amplitudes(model: HarmonicBalanceModel, system: MeanSystem) -> dict[str, np.ndarray]:
    """Peak amplitude of the overall transmission error along `FREQUENCIES` by mesh order, m; NaN beyond the speeds."""
    speed = 0.5 * FASTEST
    ports = model.ports_at(speed)
    loads = model.loads(ports)
    count = len(FREQUENCIES)
    motion = np.zeros((count, *loads.shape), dtype=complex)
    # All loads at each frequency, and no others.
    batches = batches_of(np.ones((count, loads.shape[1]), dtype=bool), np.zeros(count, dtype=bool))
    pencil = system.stiffness_at(speed), system.damping_at(speed)
    none = np.zeros((count, system.size), dtype=complex)
    system.fill_responses(pencil, 2.0 * np.pi * FREQUENCIES, loads, none, batches, motion)
    seen = np.einsum("fsm,s->fm", motion, model.row_of_overall(speed))
    found, errors = {}, transmission_errors(model, ports, speed)
    for line in range(1, len(model.lines.index)):
        multiples = model.lines.index[line]
        name = f"{multiples.max()} x {model.waves.base_names[int(np.argmax(multiples))].split(', ')[0]}"
        amplitude = 2.0 * np.abs(seen @ errors[line].ravel())
        reached = model.lines.orders[line] * FASTEST >= 2.0 * np.pi * FREQUENCIES
        found[name] = np.where(reached, amplitude, np.nan)
    return found


def peak_of(amplitude: np.ndarray, within: float) -> dict[str, float] | None:
    """Peak within a share of the frequency that rises most above the higher of both sides' lowest values."""
    best = None
    for n in range(1, len(amplitude) - 1):
        here = amplitude[n]
        if abs(FREQUENCIES[n] / TARGET_HZ - 1.0) > within or not (here > amplitude[n - 1] and here >= amplitude[n + 1]):
            continue
        rise = 20.0 * float(np.log10(here / max(np.nanmin(amplitude[:n]), np.nanmin(amplitude[n + 1 :]))))
        if best is None or rise > best["rise_dB"]:
            best = {"rise_dB": round(rise, 2), "Hz": round(float(FREQUENCIES[n]), 1), "m": float(f"{here:.3g}")}
    return best


def peaks_of(model: HarmonicBalanceModel, system: MeanSystem, within: float) -> dict[str, dict[str, float]]:
    """Peaks by mesh order."""
    found = {name: peak_of(values, within) for name, values in amplitudes(model, system).items()}
    return {name: peak for name, peak in found.items() if peak is not None and peak["rise_dB"] >= TOLD_FROM}


def around(between: Between, radial: float) -> list[dict[str, Any]]:
    """Peaks at a radial stiffness (N/m); where one is seen, at stiffnesses beside it, too: it may rise more there."""
    found: list[dict[str, Any]] = []
    for factor in (1.0, *BESIDE):
        peaks = peaks_of(between.stiff, between.at(factor * radial), NEAR)
        found.append({"radial_N_per_m": float(f"{factor * radial:.4g}"), "peaks": peaks})
        if not any(peak["rise_dB"] >= SEEN for peak in found[0]["peaks"].values()):
            break
    return found


def search(project: Project) -> list[dict[str, Any]]:
    """Search all sets, and go on where a search was stopped."""
    path = project.folder / "search-3215.jsonl"
    head = {"input": input_hash(project.assembly()), "script": 3}
    given = given_by(project)
    wanted, done = sets(), kept_rows(path, head)
    first, begun = len(done), time.monotonic()
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8") as file:
        file.writelines(json.dumps(row) + "\n" for row in (head, *done))
        for n, own in enumerate(wanted[first:], start=first + 1):
            rigid, between = model_with(given, own, 1e9, "rigid"), Between.of(given, own)
            row: dict[str, Any] = {"set": own, "rigid": peaks_of(rigid, rigid.system, AROUND)}
            row["bushing"] = [found for radial in tuned(between) for found in around(between, radial)]
            done.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
            left = (time.monotonic() - begun) / (n - first) * (len(wanted) - n)
            print(f"\r{n} of {len(wanted)} sets, {left:5.0f} s left", end="", flush=True)
    print()
    return done


def kept_rows(path: Path, head: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Read the sets of a search with the same input, up to the first line that is not whole."""
    rows: list[dict[str, Any]] = []
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                rows.append(json.loads(line))
            except json.JSONDecodeError:
                break
    return rows[1:] if rows[:1] == [head] else []


def candidates(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Each stiffness of each set with the loudest order that rises as wanted, or that which rises most if none does."""
    found = []
    for row in rows:
        rigid = max((peak["rise_dB"] for peak in row["rigid"].values()), default=0.0)
        for own in row["bushing"]:
            none = {"rise_dB": 0.0, "Hz": TARGET_HZ, "m": 0.0}
            risen = {name: peak for name, peak in own["peaks"].items() if peak["rise_dB"] >= WANTED}
            by = "m" if risen else "rise_dB"
            line, peak = max((risen or own["peaks"]).items(), key=lambda item: item[1][by], default=("none", none))
            met = peak["rise_dB"] >= WANTED > rigid
            found.append({**row["set"], "radial_N_per_m": own["radial_N_per_m"], "line": line, **peak, "met": met})
    return found


def main() -> None:
    """Search, and print what was found."""
    project = published_project(Choice("bushing"))
    project.tables()
    found = candidates(search(project))
    for kind in RANGES:
        own = [candidate for candidate in found if candidate["kind"] == kind]
        met = sum(candidate["met"] for candidate in own)
        print(f"\n{kind}: 3215 Hz is a natural frequency with {len(own)} sets; {met} have a peak of 6 dB there")
        for one in sorted(own, key=lambda candidate: -candidate["rise_dB"])[:8]:
            assumed = f"{one['radial_N_per_m']:.3g} N/m, housing {one['housing_factor']:g}, {one['inertias']}, "
            assumed += f"spin {one['spin']:g}, mass {one['mass']:g}, coupling {one['coupling']:.0e} N m/rad"
            print(
                f"{one['rise_dB']:6.2f} dB, {1e9 * one['m']:8.3f} nm at {one['Hz']:6.1f} Hz on {one['line']}: {assumed}"
            )


if __name__ == "__main__":
    main()
