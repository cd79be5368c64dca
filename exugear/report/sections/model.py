"""Part "Model and checks": warnings, models compared, modes near a frequency, studies, assumptions, provenance."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import Choice, choice_of
from exugear.gearbox.load_cases import static_load_in_words
from exugear.gearbox.reading import flattened
from exugear.gearbox.units import RPM
from exugear.report.findings.context import (
    MESH_MODEL_LABELS,
    REFERENCE_VARIANT,
    VISIBLE_SHARE,
    model_label,
    response_label,
)
from exugear.report.findings.facts import facts_of
from exugear.report.findings.groups import RunGroup
from exugear.report.findings.result_checks import run_figures, validity_checks
from exugear.report.findings.words import capitalised
from exugear.report.pictures.png import png_address
from exugear.report.sections.material import ChartAxis, Curve, Part, ReportData, group_words, model_name
from exugear.report.web.document import libraries, licences
from exugear.report.web.html import Cell, Figure, Table, render
from exugear.results.folder import StoredStudy, stored_studies, times_spent
from exugear.results.run_file import invalidity_of
from exugear.results.solver_comparison import EXUDYN_FOLDER, compare_solvers
from exugear.results.spectra.run_spectra import NEAR, ModeReport, VariantRun, nearest_mode, report_mode
from exugear.system.modal_damping import damping_in_words
from exugear.system.modes import modes_of
from exugear.system.sensitivity import FrequencyMatch, assumed_parameters, frequency_matches
from fe_ste.tools.files import FileError

if TYPE_CHECKING:
    import xarray as xr

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
    "amplification": "Overall transmission error at resonance per static transmission error of one mesh; shuttling of "
    "the load comes on top.",
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
    "Campbell diagram": "Natural frequencies over speed, with the orders that can excite them.",
    "whirl": "Orbital motion of a shaft axis, forward or backward relative to its rotation.",
    "sideband": "Spectral component next to a dominant one, offset by another frequency such as the carrier frequency.",
    "L10, L10r": "Rating life reached by 90 % of bearings: to ISO 281, and to ISO/TS 16281 from element loads.",
    "damage": "Miner's sum: number of cycles over permissible cycles, summed over all loads; 1 is failure.",
    "S_H, S_F": "Factor on flank or root stress at which the damage is 1.",
}
"""Terms used on the page."""


def model_section(material: ReportData) -> Part:
    """List checks, models compared, assumptions, inputs and provenance of the results."""
    results = material.results
    groups = _compared_groups(material)
    inputs = [{"key": key, "value": value} for key, value in flat_keys(material.context.gearbox.content)]
    html = render(
        "model",
        groups=groups,
        run_ups=any(not group.responses for group in material.groups) or not material.groups,
        target=_target(material),
        studies=list(map(_study, stored_studies(material.context.folder, material.context.gearbox))),
        notes=material.context.notes,
        missing=material.missing,
        assumptions=list(_assumptions(material)),
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
    return Part(html, title="Model and checks", name="model")


def _assumptions(material: ReportData) -> Iterator[str]:
    """Yield what the results rest on; deviations of gears and stated loads, used or left out, come last."""
    gearbox = material.context.gearbox
    case = gearbox.case
    acceleration = np.linalg.norm(case.gravity.acceleration_m_per_s2)
    yield f"Inertia sets: {', '.join(gearbox.inertia_sets)}; default {case.default_inertias}."
    yield f"Housing stiffness factor of bearings in the housing: {case.housing.factor:g}."
    yield f"Damping: {damping_in_words(case.damping)}."
    yield f"Gravity {'off' if acceleration == 0.0 else f'{acceleration:.2f} m/s²'}."
    yield (
        f"Mesh stiffness at the static load, {static_load_in_words(gearbox)}; meshes are bilateral (they transmit "
        "tension); the time with tensile mesh force is recorded."
    )
    yield "Modes: linearised at the static load, mesh stiffness averaged over the mesh cycle."
    yield from _elastic_words(material)
    if friction := case.damping.tooth_friction:
        yield f"Friction of teeth in runs and steady-state responses: coefficient {friction:g}."
    gears = []
    for (body, gear), deviation in gearbox.deviations.items():
        pitch = float(np.ptp(deviation.pitch)) if deviation.pitch.size else 0.0
        sizes = {"pitch": pitch, "eccentricity": deviation.eccentricity}
        parts = [f"{name} {1e6 * size:.3g} µm" for name, size in sizes.items() if size > 0.0]
        gears.append(f"{material.words.of(gear)} on {material.words.of(body)} ({', '.join(parts)})")
    if gears:
        yield f"Deviations of gears, pitch over one revolution: {'; '.join(gears)}."
    orders: dict[tuple[str, str], set[float]] = {}
    for load in gearbox.varying_loads:
        orders.setdefault((load.excitation, load.body), set()).add(load.order)
    acting = [
        f"{material.words.of(name)} (order{'s' * (len(own) > 1)} {', '.join(f'{number:g}' for number in sorted(own))} "
        f"of {material.words.of(body)})"
        for (name, body), own in orders.items()
    ]
    if acting:
        yield f"Excitations beside the gears, at the static torque: {'; '.join(acting)}."
    names = {name for name, _ in orders}
    if without := [material.words.of(name) for name in case.excitations if name not in names]:
        yield f"Excitations of the file that are left out: {', '.join(without)}."


def _elastic_words(material: ReportData) -> Iterator[str]:
    """Describe which bodies are flexible in the models of the report, and the sizes of their reduced models."""
    context = material.context
    assembly = next((assembly for assembly in context.assemblies.values() if assembly.elastic_bodies), None)
    if assembly is None:
        return
    case = context.gearbox.case
    parts = ", ".join(f"{name} ({body.reduced.origin})" for name, body in assembly.elastic_bodies.items())
    yield (
        f"Flexible in the variant {assembly.variant}: {parts}; damping {1e6 * case.damping.body_time_s:g} "
        f"µs times the stiffness, modes listed up to {case.elasticity.band_Hz:g} Hz."
    )
    for name, body in assembly.elastic_bodies.items():
        if body.loss_factor:
            yield f"{name}: loss factor {body.loss_factor:g} of its free modes instead."
        elif body.damping_time is not None:
            yield f"{name}: damping {1e6 * body.damping_time:g} µs times its stiffness instead."
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
        "steady-state response": response_label(data),
        "speeds": data.sizes["point"],
        "lowest speed / rpm": f"{speed.min():.1f}",
        "highest speed / rpm": f"{speed.max():.1f}",
        "orders": data.sizes["line"] - 1,
        "not converged": len(json.loads(data.attrs["not_converged"])),
        "largest error of the power balance": f"{float(np.nanmax(np.abs(data['energy_error']))):.1e}",
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


def flat_keys(content: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield all keys of a gearbox file with their tables, and their values as text.

    Examples
    --------
    >>> list(flat_keys({"name": "box", "gears": {"sun": {"teeth": 21}}}))
    [('name', 'box'), ('gears.sun.teeth', '21')]
    """
    for key, value in flattened(content).items():
        yield key, value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def _hashes(material: ReportData) -> list[dict[str, str]]:
    results = material.results
    context = material.context
    hashes = {f"table {name}": table.input_hash for name, table in results.tables.items()}
    hashes |= {str(context.name_of(run.path)): run.attributes["input_hash"] for run in results.runs}
    for data in results.steady:
        hashes[f"steady-state response {response_label(data)}"] = data.attrs["input_hash"]
    hashes |= {f"modes {model_label(model)}": data.attrs["input_hash"] for model, data in results.modes.items()}
    return [{"result": name, "SHA-256 of its input": sha256} for name, sha256 in hashes.items()]


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"


# Checks and findings of each result


def _compared_groups(material: ReportData) -> list[dict[str, Any]]:
    """Return findings and checks of each result group; the command line prints them, too."""
    notes = material.context.notes
    content = []
    for group in material.groups:
        facts = facts_of(material.context, material.words, group, material.variations)
        findings = [
            replace(finding, text=material.words.labelled(finding.text))
            for finding in validity_checks(material.context, group)
        ]
        if group is material.groups[0]:
            notes.findings.extend(findings)
            notes.statements.extend(f"{finding.line}." for finding in findings)
        if not group.responses:
            several = group_words(material.groups, group)
            notes.statements.append(f"{several}: Load: {_load_of(material, group)}.")
            notes.statements.extend(f"{several}: {fact.line}" for fact in facts)
            if group is not material.groups[0]:
                notes.statements.extend(f"{several}: {finding.line}." for finding in findings)
        content.append(
            {
                "name": group.name,
                "scope": (
                    f"{capitalised(group.title)}. Load: {_load_of(material, group)}. Speeds: of the "
                    f"{material.input_words}. Levels: overall transmission error (TE), 0 dB = 1 µm."
                ),
                "facts": facts,
                "findings": findings,
            }
        )
        for variant, comparison in group.comparisons.items():
            reference = comparison.second.variant
            here = _only(group, variant, reference)
            there = _only(group, reference, variant)
            notes.statements.append(
                f"Resonances in {variant} and not in {reference} ({group.title}): {here}. In {reference} and not in "
                f"{variant}: {there}."
            )
    return content


def _load_of(material: ReportData, group: RunGroup) -> str:
    """Describe the load of a group: that of its load case, or the static load."""
    static = static_load_in_words(material.context.gearbox)
    loads = sorted({str(run.attributes.get("load", "")) for run in group.runs.values()} - {""})
    text = f"static load, {static}"
    if loads and not group.responses:
        text = f"{'; '.join(loads)} (tables and steady-state responses: {text})"
    return material.words.labelled(text)


def _only(group: RunGroup, variant: str, other: str) -> str:
    frequencies = sorted(
        own.finding.resonance.frequency for own in group.ranked[variant] if own.steady and other in own.lacking
    )
    if frequencies:
        return ", ".join(f"{frequency:.0f}" for frequency in frequencies) + " Hz"
    return "none"


# Modes near a target frequency from the gearbox file or the command line, such as a measured one


def _target(material: ReportData) -> dict[str, Any] | None:
    """List the modes near the target frequency, and parameter changes that would shift a mode there."""
    target = material.context.target
    modes = material.results.modes
    if target is None or not modes:
        return None
    rows = []
    for model, data in modes.items():
        nearest = nearest_mode(data, target)
        visible = nearest_mode(data, target, VISIBLE_SHARE)
        if nearest is None or visible is None:
            continue
        for place in dict.fromkeys([nearest.index, visible.index]):
            mode = report_mode(data, place)
            near = {
                "frequency / Hz": f"{mode.frequency:.1f}",
                "near": "yes" if mode.is_near(target) else "no",
                "damping / %": f"{100 * mode.damping_ratio:.2f}",
            }
            words = material.words.moves(data, place)
            rows.append({**_model_cells(model), **near, **_mode_cells(material, mode), "mode shape": words})
        material.context.notes.statements.append(_statement(model, data, nearest, visible, target))
    found = [
        (variation.choice, match)
        for variation in material.variations
        for match in frequency_matches(variation.variations, target, VISIBLE_SHARE)
    ]
    if found:
        entries = "; ".join(
            f"{match.parameter.label} = {match.value:.3g} instead of {match.parameter.default:g} "
            f"({model_label(model)}: {match.frequency:.0f} Hz)"
            for model, match in found
        )
        material.context.notes.statements.append(
            f"Assumptions that shift a mode with TE participation to {target:.0f} Hz: {entries}."
        )
    return {
        "target": target,
        "near": Table(rows, ("inertia set", "mode shape"), caption=f"Modes near {target:.0f} Hz", name="near"),
        "visible": 100 * VISIBLE_SHARE,
        "within": 100 * NEAR,
        "matches": Table(
            [_match_row(material, model, match, target) for model, match in found],
            ("inertia set", "assumption", "mode shape"),
            caption="Assumptions",
            name="matches",
        ),
    }


def _statement(model: Choice, data: xr.Dataset, nearest: ModeReport, visible: ModeReport, target: float) -> str:
    factor = float(data.attrs["housing_factor"])
    subject = f"Variant {model_label(model)}, housing stiffness factor {factor:g}"
    if visible.is_near(target):
        return (
            f"{subject}: mode at {visible.frequency:.0f} Hz near {target:.0f} Hz, TE participation "
            f"{100 * visible.share:.0f} % ({visible.name})."
        )
    if nearest.is_near(target):
        return (
            f"{subject}: mode at {nearest.frequency:.0f} Hz near {target:.0f} Hz, but with negligible TE "
            f"participation ({100 * nearest.share:.2g} %; {nearest.name})."
        )
    return (
        f"{subject}: no mode within {100 * NEAR:g} % of {target:.0f} Hz; the nearest mode with TE participation is at "
        f"{visible.frequency:.0f} Hz ({visible.name})."
    )


def _model_cells(model: Choice) -> dict[str, object]:
    return {"variant": model.variant, "inertia set": f"{model.inertias} ({MESH_MODEL_LABELS[model.mesh_model]})"}


def _mode_cells(material: ReportData, mode: ModeReport) -> dict[str, object]:
    return {
        "TE part. / %": f"{100 * mode.share:.1f}",
        "amplification": Cell(f"{mode.amplification:.2f} ({material.words.of(mode.mesh)})", mode.amplification),
    }


def _match_row(material: ReportData, model: Choice, match: FrequencyMatch, target: float) -> dict[str, object]:
    """Return a parameter change, with the nearest visible mode of the reference variant for the same value."""
    context = material.context
    reference = replace(model, variant=REFERENCE_VARIANT)
    parameters = assumed_parameters(context.gearbox, reference, context.stiffness(model.mesh_model))
    same = next((parameter for parameter in parameters if parameter.label == match.parameter.label), None)
    assembly = same.build(match.value) if same else context.assembled(reference)
    nearest = nearest_mode(modes_of(assembly).to_dataset(), target, VISIBLE_SHARE)
    frequency = nearest.frequency if nearest else math.nan
    data = match.modes.to_dataset()
    mode = report_mode(data, match.index)
    return {
        **_model_cells(model),
        "assumption": material.words.change(match.parameter.label, match.value, match.parameter.default),
        "frequency / Hz": f"{mode.frequency:.0f}",
        **_mode_cells(material, mode),
        f"nearest with TE participation in {REFERENCE_VARIANT} / Hz": f"{frequency:.0f}",
        "mode shape": material.words.moves(data, match.index),
    }


# Studies

LARGEST_PICTURE = 2_000_000
"""Maximum size of a picture embedded in the page, bytes."""


def _study(study: StoredStudy) -> dict[str, object]:
    lost = "".join(
        f", {count} {word}" for count, word in ((study.failed, "failed"), (study.missing, "missing")) if count
    )
    return {
        "title": study.title,
        "fits": study.fits,
        "words": f"{study.points} points{lost}. {capitalised(study.description)}",
        "pictures": [
            (png_address(path.read_bytes()), path.stem.replace("_", " "))
            for path in study.pictures
            if path.stat().st_size <= LARGEST_PICTURE
        ],
    }
