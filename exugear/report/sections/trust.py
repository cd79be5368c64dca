"""Section "Assumptions and checks": assumptions, checks, all inputs, provenance, glossary."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.load_cases import static_load_in_words
from exugear.gearbox.units import RPM
from exugear.report.findings.context import METHOD_LABELS, choice_of, model_label
from exugear.report.findings.result_checks import run_figures
from exugear.report.sections.material import ChartAxis, Curve, Part, ReportData, model_name
from exugear.report.web.document import libraries, licences
from exugear.report.web.html import Figure, Table, render
from exugear.results.folder import times_spent
from exugear.results.run_file import invalidity_of
from exugear.results.solver_comparison import EXUDYN_FOLDER, compare_solvers
from exugear.results.spectra.run_spectra import VariantRun
from exugear.system.modal_damping import damping_in_words
from fe_ste.tools.files import FileError

PACKAGES = ("exugear", "exudyn", "numpy", "scipy", "numba", "scikit-fem", "xarray", "h5netcdf", "matplotlib", "pyvista")
"""Packages with versions listed in the report."""
MESH_TIME_LABELS = (
    "longest tensile mesh force",
    "longest contact loss",
    "longest time outside a table",
    "longest time next to non-converged table states",
)
"""Labels of `exugear.system.signals.MESH_TIMES`, in their order."""
GLOSSARY = {
    "overall transmission error": "(Output angle minus ratio times input angle) times base radius of the output.",
    "static transmission error": "Approach of two gears along the line of action under static load.",
    "mesh cycle": "Rotation by one angular pitch.",
    "order": "Periods per revolution of the overall input.",
    "level": "20 log10 of an amplitude over a reference: 0 dB = 1 µm, or 1 N for forces; 6 dB are a factor of 2.",
    "prominence": "Height of a peak above the higher of the two adjacent minima, dB.",
    "± Hz": "Frequency resolution of the run-up: the larger of 1 / window length and the square root of the sweep rate "
    "of the order.",
    "amplification": "Overall transmission error at resonance per static transmission error of one mesh.",
    "TE participation": "Participation of a mode in the overall transmission error, squared and mass-normalised.",
    "energy fraction": "Part of the strain or kinetic energy of a mode that is in one element or body.",
    "variant": "Support of the shafts: ideal joints (rigid), elastic bearings (bushing), flexible bodies (flexible).",
    "first-order shift": "Change of a frequency for a small parameter change, mode shape unchanged.",
    "inertia set": "One of the sets of masses and inertias in the gearbox file.",
    "mesh model": "Mesh force as a function of gear motion; line_of_action: along the line of action, time-varying "
    "stiffness.",
    "housing stiffness factor": "Stiffness of a bearing with the housing, over the stiffness of the bearing alone; 1: "
    "rigid housing.",
    "window-dependent": "Of a resonance: found with some window lengths of the analysis but not with all.",
    "steady-state response": "Vibration at constant speed, the limit of an infinitely slow run-up.",
    "Campbell diagram": "Eigenfrequencies over speed, with the orders that can excite them.",
    "whirl": "Orbital motion of a shaft axis, forward or backward relative to its rotation.",
    "sideband": "Spectral component next to a dominant one, offset by another frequency such as the carrier frequency.",
    "L10, L10r": "Rating life reached by 90 % of bearings: to ISO 281, and to ISO/TS 16281 from element loads.",
    "damage": "Miner's sum: number of cycles over permissible cycles, summed over all loads; 1 is failure.",
    "S_H, S_F": "Factor on flank or root stress at which the damage is 1.",
}
"""Terms used on the page."""


def trust_section(material: ReportData) -> Part:
    """List assumptions, checks, inputs and provenance of the results."""
    results = material.results
    inputs = [{"key": key, "value": value} for key, value in flat_keys(material.context.gearbox.content)]
    html = render(
        "trust",
        assumptions=_assumptions(material),
        source=material.file_words,
        runs=Table(
            [_run_row(material, run) for run in results.runs],
            ("run", "load", "solver", "analysis"),
            caption="Runs",
            name="runs",
        ),
        responses=Table(
            [_response_row(data) for data in results.steady],
            ("steady-state response",),
            caption="Steady-state responses",
            name="responses",
        ),
        compared=list(filter(None, (_exudyn_comparison(material, run) for run in results.runs))),
        inputs=Table(inputs, ("value",), caption="All inputs of the gearbox file", name="inputs"),
        hashes=Table(_hashes(material), ("SHA-256 of its input",), caption="Hashes", name="hashes"),
        versions=[
            f"Python {platform.python_version()}",
            *(f"{name} {_version(name)}" for name in PACKAGES),
            *(f"{library.name} {library.version}" for library in libraries()),
        ],
        platform=platform.platform(),
        times=Table(
            [
                {
                    "step": spent.step,
                    "wall / s": f"{spent.seconds:.1f}",
                    "peak memory / MB": f"{1e-6 * spent.memory:.0f}",
                }
                for spent in times_spent(material.context.folder)
            ],
            caption="Run time",
        ),
        glossary=GLOSSARY,
        licences=licences(),
    )
    return Part(html, title="Assumptions and checks", name="trust")


def _assumptions(material: ReportData) -> list[str]:
    gearbox = material.context.gearbox
    case = material.context.gearbox.case
    acceleration = np.linalg.norm(case.gravity.acceleration_m_per_s2)
    listed = [
        f"Inertia sets: {', '.join(gearbox.inertia_sets)}; default {case.default_inertias}.",
        f"Housing stiffness factor of bearings in the housing: {case.housing.factor:g}.",
        f"Damping: {damping_in_words(case.damping)}.",
        f"Gravity {'off' if acceleration == 0.0 else f'{acceleration:.2f} m/s²'}.",
        f"Mesh stiffness at the static load, {static_load_in_words(gearbox)}; meshes are bilateral (they transmit "
        "tension); the time with tensile mesh force is recorded.",
        "Modes: linearised at the static load, mesh stiffness averaged over the mesh cycle.",
        *_elastic_words(material),
    ]
    if friction := case.damping.tooth_friction:
        listed.append(f"Friction of teeth in runs and steady-state responses: coefficient {friction:g}.")
    return listed


def _elastic_words(material: ReportData) -> Iterator[str]:
    """Describe which bodies are flexible in the models of the report, and the sizes of their reduced models."""
    context = material.context
    assembly = next((assembly for assembly in context.assemblies.values() if assembly.elastic_bodies), None)
    if assembly is None:
        return
    case = context.gearbox.case
    parts = []
    for name, body in assembly.elastic_bodies.items():
        unknowns = sum(body.reduced.summary.unknowns.values())
        parts.append(f"{name} ({unknowns} unknowns reduced to {body.reduced.size} coordinates)")
    yield (
        f"Flexible in the variant {assembly.variant}: {', '.join(parts)}; damping {1e6 * case.damping.body_time_s:g} "
        f"µs times the stiffness, modes listed up to {case.elasticity.band_Hz:g} Hz."
    )
    if assembly.turning and case.damping.modal_percent is not None:
        yield (
            f"Damping in the variant {assembly.variant}: {damping_in_words(assembly.gearbox.case.damping)}, because "
            f"{', '.join(assembly.turning)} turns with planets."
        )
    if any(body.fixed for body in assembly.bodies):
        yield f"In the variant {assembly.variant} the flexible housing replaces the housing stiffness factor."


def _exudyn_comparison(material: ReportData, run: VariantRun) -> Figure | None:
    """Compare the compiled solver with Exudyn where both integrated the beginning of the run."""
    name = material.context.name_of(run.path)
    path = material.context.folder / EXUDYN_FOLDER / name
    if not path.exists():
        return None
    try:
        found = compare_solvers(run.path, path)
    except FileError as error:
        material.context.notes.left_out.append(str(error))
        return None
    middle = found.overall[1].mean()
    own, other = (1e6 * (values - middle) for values in found.overall)
    return material.chart(
        f"exudyn-{model_name(choice_of(run.attributes))}",
        f"Overall transmission error by both solvers, {model_label(choice_of(run.attributes))}",
        "Deviation from the mean of the Exudyn result.",
        found.words,
        [Curve("compiled solver", found.time, own), Curve("Exudyn", found.time, other, "dashed")],
        [ChartAxis("time / s"), ChartAxis("overall transmission error / µm")],
    )


def _response_row(data: xr.Dataset) -> dict[str, object]:
    speed = np.abs(data["speed"].to_numpy()) / RPM
    return {
        "steady-state response": f"{model_label(choice_of(data.attrs))}, {METHOD_LABELS[str(data.attrs['method'])]}",
        "speeds": data.sizes["point"],
        "lowest speed / rpm": f"{speed.min():.1f}",
        "highest speed / rpm": f"{speed.max():.1f}",
        "orders": data.sizes["line"] - 1,
        "not converged": len(json.loads(data.attrs["not_converged"])),
        "largest error of the power balance": f"{float(np.nanmax(data['energy_error'])):.1e}",
        "largest growth rate of a disturbance / (1/s)": f"{float(data.attrs['growth_rate']):.3g}",
    }


def _run_row(material: ReportData, run: VariantRun) -> dict[str, object]:
    figures = run_figures(run)
    times = zip(MESH_TIME_LABELS, figures.times, strict=True)
    return {
        "run": str(material.context.name_of(run.path)),
        "load": str(run.attributes.get("load", "")),
        "valid": "NO, see top of page" if invalidity_of(run.attributes) else "yes",
        "solver": run.attributes["solver"],
        "step / µs": f"{1e6 * float(run.attributes['step']):g}",
        "simulated / s": f"{figures.end:.2f}" + ("" if int(run.attributes["complete"]) else " (stopped)"),
        "highest speed / rpm": f"{float(run.spectra.speed.max()) / RPM:.1f}",
        "error of the energy balance": f"{figures.residual:.1e}",
        **{f"{what} / s": f"{time:.3g}" for what, time in times},
        "analysis": run.spectra.description,
    }


def flat_keys(content: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """Yield all keys of a gearbox file with their tables, and their values as text.

    Examples
    --------
    >>> list(flat_keys({"name": "box", "gears": {"sun": {"teeth": 21}}}))
    [('name', 'box'), ('gears.sun.teeth', '21')]
    """
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from flat_keys(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def _hashes(material: ReportData) -> list[dict[str, str]]:
    results = material.results
    context = material.context
    hashes = {f"table {name}": table.input_hash for name, table in results.tables.items()}
    hashes |= {str(context.name_of(run.path)): run.attributes["input_hash"] for run in results.runs}
    for data in results.steady:
        method = METHOD_LABELS[str(data.attrs["method"])]
        hashes[f"steady-state response {model_label(choice_of(data.attrs))}, {method}"] = data.attrs["input_hash"]
    hashes |= {f"modes {model_label(model)}": data.attrs["input_hash"] for model, data in results.modes.items()}
    return [{"result": name, "SHA-256 of its input": sha256} for name, sha256 in hashes.items()]


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"
