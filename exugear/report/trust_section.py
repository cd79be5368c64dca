"""Section "What was assumed, and where it comes from": assumptions, checks, all inputs, provenance, glossary."""

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
from exugear.report.findings.context import choice_of, words_of
from exugear.report.findings.verdicts import run_figures
from exugear.report.material import Axis, Curve, Part, ReportData, chart, model_name
from exugear.report.web import html as pieces
from exugear.report.web.document import libraries, licences
from exugear.results.folder import times_spent
from exugear.results.run_file import verdict_of
from exugear.results.solver_comparison import EXUDYN_FOLDER, compare_solvers
from exugear.results.spectra.run_spectra import VariantRun
from fe_ste.tools.files import FileError

PACKAGES = ("exugear", "exudyn", "numpy", "scipy", "numba", "scikit-fem", "xarray", "h5netcdf", "matplotlib", "pyvista")
"""Packages whose versions a report names."""
MESH_TIME_LABELS = (
    "longest pull of a mesh",
    "longest time teeth are apart",
    "longest time outside a table",
    "longest time beside unsolved states of a table",
)
"""Labels of `exugear.system.signals.MESH_TIMES`, in their order."""
GLOSSARY = {
    "overall transmission error": "Angle of the output less the ratio times the angle of the input, as a length on the "
    "base circle of the output gear.",
    "static transmission error": "Approach of two gears along the line of action under load, at rest.",
    "mesh cycle": "Passage of one tooth: one angular pitch.",
    "order": "Periods per turn of the overall input.",
    "level": "20 log10 of an amplitude over a reference: 0 dB = 1 µm, or 1 N for forces; 6 dB are a factor of 2.",
    "prominence": "Height of a peak above the higher of the two valleys beside it.",
    "± Hz": "How exactly the sweep allows a frequency to be told: the wider of one over the length of the window and "
    "the root of the rate at which the order sweeps.",
    "amplification": "Overall transmission error at resonance per static transmission error of one mesh.",
    "share": "Part of a mode in the mobility of the overall transmission error, or in its strain or kinetic energy.",
    "variant": "How shafts are held: on ideal joints (rigid), on bearings (bushing), with elastic bodies (flexible).",
    "first-order shift": "Change of a frequency for a small change of a parameter, the shape of the mode held.",
    "inertia set": "One of the sets of masses and inertias that the case gives its bodies.",
    "mesh law": "How the force of a mesh follows from the motion of its gears; line_of_action: along the line on which "
    "flanks push each other, with a stiffness that varies over the mesh cycle.",
    "housing factor": "Share of a deflection that the bearing takes where its seat yields, too; 1 is a rigid housing.",
    "unsteady": "Of a resonance: shown with one length of the spectra's window and not with others.",
    "steady response": "Vibration at constant speed: what a run-up would show if it were infinitely slow.",
    "Campbell diagram": "Eigenfrequencies over speed, with the orders that may excite them.",
    "whirl": "Motion of a shaft's axis on a circle, forward or backward against its turn.",
    "sideband": "Line beside a loud one, at the distance of another frequency such as the carrier's.",
    "L10, L10r": "Rating life that nine bearings of ten reach: by ISO 281, and by ISO/TS 16281 from the loads of all "
    "rolling elements.",
    "damage": "Miner's sum: cycles that occur over those that each load allows. One is worn out.",
    "S_H, S_F": "Factor on the stress of the flank, or of the tooth root, at which the damage is one.",
}
"""Words of the field that the page uses."""


def trust_section(material: ReportData) -> Part:
    """List what results rest on."""
    charts: dict[str, Any] = {}
    compared = "".join(_exudyn_comparison(material, run, charts) for run in material.results.runs)
    parts = [
        pieces.folded("Assumptions", _assumptions(material), opened=True),
        pieces.folded("What was run, and how well its energy adds up", _runs(material)),
        pieces.folded("All inputs of the case", _inputs(material)),
        pieces.folded("Provenance: hashes and versions", _provenance(material)),
        pieces.folded("Where the time went", _times(material)),
        pieces.folded("Words of this page", _glossary()),
        pieces.folded("Libraries in this page, and their licences", _licences()),
    ]
    if compared:
        parts.insert(2, pieces.folded("The same run by Exudyn", compared))
    html = pieces.section("What was assumed, and where it comes from", *parts, name="trust")
    return Part(html, {"charts": charts}, "Trust", "trust")


def _assumptions(material: ReportData) -> str:
    gearbox = material.context.gearbox
    case = material.context.gearbox.case
    acceleration = np.linalg.norm(case.gravity.acceleration_m_per_s2)
    listed = [
        f"Inertia sets: {', '.join(gearbox.inertia_sets)}; default {case.default_inertias}.",
        f"Housing factor on the stiffness of bearings in the housing: {case.housing.factor:g}.",
        f"Damping proportional to stiffness: bearings {1e6 * case.damping.bearing_time_s:g} µs, meshes "
        f"{1e6 * case.damping.mesh_time_s:g} µs, couplings {1e6 * case.damping.coupling_time_s:g} µs times the "
        "stiffness.",
        f"Gravity {'off' if acceleration == 0.0 else f'{acceleration:.2f} m/s²'}.",
        f"Mesh stiffness is that at the static load of the case, {static_load_in_words(gearbox)}; meshes are "
        "bilateral, and the time in which teeth would have to pull is counted.",
        "Modes: linearised at the static load, mesh stiffness averaged over the mesh cycle.",
        *_elastic_words(material),
    ]
    return pieces.bullets(listed) + pieces.paragraph(
        f"Sources of all inputs: the comments of {material.file_words}, and what lies beside it.", "note"
    )


def _elastic_words(material: ReportData) -> Iterator[str]:
    """Say which bodies are elastic in the models of the report, and how finely."""
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
        f"Elastic in the variant {assembly.variant}: {', '.join(parts)}; damping {1e6 * case.damping.body_time_s:g} µs "
        f"times the stiffness, modes listed up to {case.elasticity.band_Hz:g} Hz."
    )
    if any(body.fixed for body in assembly.bodies):
        yield f"In the variant {assembly.variant} the elastic housing takes the place of the housing factor."


def _runs(material: ReportData) -> str:
    rows = [_run_row(material, run) for run in material.results.runs]
    steady = [_response_row(data) for data in material.results.steady]
    tables = []
    if rows:
        tables.append(pieces.table(rows, ("run", "load", "solver", "analysis"), caption="What was run", name="runs"))
    if steady:
        tables.append(pieces.table(steady, ("steady response",), caption="Steady responses", name="responses"))
    return "".join(tables) or pieces.paragraph("Nothing was run.")


def _exudyn_comparison(material: ReportData, run: VariantRun, charts: dict[str, Any]) -> str:
    """Say how far the compiled solver is from Exudyn where the beginning of the run was integrated by both."""
    name = material.context.name_of(run.path)
    path = material.context.folder / EXUDYN_FOLDER / name
    if not path.exists():
        return ""
    try:
        found = compare_solvers(run.path, path)
    except FileError as error:
        material.context.notes.left_out.append(str(error))
        return ""
    middle = found.overall[1].mean()
    own, other = (1e6 * (values - middle) for values in found.overall)
    html, data = chart(
        f"exudyn-{model_name(choice_of(run.attributes))}",
        f"Overall transmission error by both solvers, {words_of(choice_of(run.attributes))}",
        "Change about the mean of Exudyn's.",
        found.words,
        [Curve("compiled solver", found.time, own), Curve("Exudyn", found.time, other, "dashed")],
        [Axis("time / s"), Axis("overall transmission error / µm")],
        material.arrays,
    )
    charts.update(data)
    return pieces.paragraph(found.words) + html


def _response_row(data: xr.Dataset) -> dict[str, object]:
    speed = np.abs(data["speed"].to_numpy()) / RPM
    return {
        "steady response": f"{words_of(choice_of(data.attrs))}, level {data.attrs['method']}",
        "speeds": data.sizes["point"],
        "slowest / rpm": f"{speed.min():.1f}",
        "fastest / rpm": f"{speed.max():.1f}",
        "lines": data.sizes["line"] - 1,
        "left out": len(json.loads(data.attrs["not_converged"])),
        "largest share of power not accounted for": f"{float(np.nanmax(data['energy_error'])):.1e}",
        "fastest growth of a disturbance / (1/s)": f"{float(data.attrs['growth_rate']):.3g}",
    }


def _run_row(material: ReportData, run: VariantRun) -> dict[str, object]:
    figures = run_figures(run)
    times = zip(MESH_TIME_LABELS, figures.times, strict=True)
    return {
        "run": str(material.context.name_of(run.path)),
        "load": str(run.attributes.get("load", "")),
        "to be trusted": "NO, see the top" if verdict_of(run.attributes) else "yes",
        "solver": run.attributes["solver"],
        "step / µs": f"{1e6 * float(run.attributes['step']):g}",
        "simulated / s": f"{figures.end:.2f}" + ("" if int(run.attributes["complete"]) else " (stopped)"),
        "fastest / rpm": f"{float(run.spectra.speed.max()) / RPM:.1f}",
        "energy not accounted for": f"{figures.residual:.1e}",
        **{f"{what} / s": f"{time:.3g}" for what, time in times},
        "analysis": run.spectra.description,
    }


def _inputs(material: ReportData) -> str:
    rows = [{"key": key, "value": value} for key, value in flat_keys(material.context.gearbox.content)]
    return pieces.table(rows, ("value",), caption="All inputs of the case", name="inputs")


def flat_keys(content: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """Yield all keys of a case with their tables, and their values as text.

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


def _provenance(material: ReportData) -> str:
    results = material.results
    context = material.context
    hashes = {f"table {name}": table.input_hash for name, table in results.tables.items()}
    hashes |= {str(context.name_of(run.path)): run.attributes["input_hash"] for run in results.runs}
    hashes |= {
        f"steady response {words_of(choice_of(data.attrs))}, {data.attrs['method']}": data.attrs["input_hash"]
        for data in results.steady
    }
    hashes |= {f"modes {words_of(model)}": data.attrs["input_hash"] for model, data in results.modes.items()}
    rows = [{"result": name, "SHA-256 of its input": sha256} for name, sha256 in hashes.items()]
    versions = [f"Python {platform.python_version()}", *(f"{name} {_version(name)}" for name in PACKAGES)]
    carried = [f"{library.name} {library.version}" for library in libraries()]
    return pieces.table(rows, ("SHA-256 of its input",), caption="Hashes", name="hashes") + pieces.paragraph(
        f"{', '.join([*versions, *carried])}; {platform.platform()}.", "note"
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"


def _times(material: ReportData) -> str:
    rows = [
        {"step": entry.step, "wall / s": f"{entry.seconds:.1f}", "peak memory / MB": f"{1e-6 * entry.memory:.0f}"}
        for entry in times_spent(material.context.folder)
    ]
    note = pieces.paragraph("Each step was a process of its own; some ran side by side.", "note") if rows else ""
    return pieces.table(rows, caption="Where the time went") + note


def _glossary() -> str:
    terms = "".join(f"<dt>{pieces.text(term)}</dt><dd>{pieces.text(words)}</dd>" for term, words in GLOSSARY.items())
    return pieces.element("dl", terms)


def _licences() -> str:
    return pieces.element("pre", pieces.text(licences()), class_="licences")
