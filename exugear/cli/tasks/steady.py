"""The command `steady`: steady-state response over speed, for every mesh order and their combinations."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from exugear.cli.case import assembled_by_iso, check_friction, steady_lack
from exugear.cli.console import BadInputError, FailedError, not_converged_failure
from exugear.cli.resonances import highest_resonance, resonance_table, source_table
from exugear.cli.sound_tables import sound_line, sound_tables
from exugear.cli.tables import Outcome, significant
from exugear.cli.watched import WatchedProject
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import load_in_words, other_load_warning, static_load_in_words, summarise_loads
from exugear.gearbox.units import RPM
from exugear.project import Project
from exugear.report.findings.context import METHOD_LABELS
from exugear.report.findings.ranking import Ranking, ranking_of
from exugear.results.findings import Finding
from exugear.results.folder import finite_or_none
from exugear.results.sound.over_speed import sound_over_speed
from exugear.results.sound.radiated_power import radiating_names
from exugear.steady.findings import is_excited, response_findings, shuttling_findings
from exugear.steady.mean_system.signals import ROUND_OFF
from exugear.steady.peaks import bearing_swings, peaks, pulls
from exugear.steady.settings import (
    USUAL_COUNT,
    Method,
    SpeedRange,
    SteadySettings,
    check_law,
    check_nonlinear,
    check_planets,
    check_speeds,
    check_varying,
    usual_speeds,
)
from exugear.system.modal_damping import damping_in_words
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.tables import Shuttling, shuttling_pairs

if TYPE_CHECKING:
    import xarray as xr


def speeds_of_options(project: Project, speeds: str | None, points: int | None) -> SpeedRange:
    """Return the range of speeds that the options state; by default the usual one of the gearbox."""
    if speeds is None:
        usual = usual_speeds(project.gearbox)
        return usual if points is None else replace(usual, count=points)
    ends = speeds.split(":")
    if len(ends) == 3:
        raise BadInputError(
            f"--speeds {speeds}: states the two ends of the range only; write --speeds {ends[0]}:{ends[1]} "
            f"--points {ends[2]}"
        )
    try:
        first, last = (float(end) * RPM for end in ends)
    except ValueError:
        raise BadInputError(f"--speeds {speeds}: must be FIRST:LAST in rpm of the input, such as 0:215") from None
    return SpeedRange(first, last, USUAL_COUNT if points is None else points)


def settings_of_options(
    project: Project, method: Method, speeds: SpeedRange, harmonics: int | None, branches: bool
) -> SteadySettings:
    """Return the settings that the options state; raise an error if they are invalid for the project."""
    check_law(project.choice.mesh_model, method)
    check_nonlinear(project.gearbox, method)
    check_planets(project.gearbox, method)
    check_speeds(project.gearbox, speeds)
    return SteadySettings(speeds, method, harmonics, branches=branches)


def steady(project: WatchedProject, settings: SteadySettings, quantity: str | None, as_json: bool, whole: bool) -> None:
    """Compute, store and print the response of a project."""
    gearbox = project.gearbox
    variant = project.choice.variant
    # A variant without steady-state response is refused before tables and finite elements are computed.
    if variant.is_elastic or not all(request.stored for request in project.missing_tables()):
        with suppress(FailedError):  # such a failure does not apply to the selected mesh model
            assembly = assembled_by_iso(gearbox, variant)
            if reason := steady_lack(assembly, variant):
                raise BadInputError(reason)
            check_varying(assembly, settings.method)
    if quantity == "sound_power" and not radiating_names(gearbox, variant):
        raise BadInputError(
            f"--quantity sound_power: the variant {variant} has no flexible housing; use --variant flexible, and give "
            'a fixed body a [bodies.NAME.solid] table and flexibility = "elastic" ([bodies.NAME.external] needs '
            "recovery, the file of its surface)"
        )
    check_friction(gearbox, project.choice.mesh_model)
    project.begin()
    project.prepare()
    data = project.steady(settings)
    shuttling = neglected_shuttling(project)
    ranking = ranking_of(data, wanted=quantity or gearbox.case.report.quantity)
    summary = summarise(project, settings, data, shuttling, ranking)
    sound = summary["sound"]
    findings = [*response_findings(data), *ranking.findings]
    if summary["excited"]:
        findings += shuttling_findings(shuttling, project.choice.mesh_model)
    static = static_load_in_words(gearbox)
    for name, load_case in gearbox.load_cases.items():
        if other_load_warning(gearbox, summarise_loads(gearbox, load_case)):
            text = f"the response is computed at the static load ({static}); load case {name} has another load "
            text += f"({load_in_words(load_case)}): add --load-case {name} to compute it there"
            findings.append(Finding("warning", text))
    near = [mesh for mesh in str(data.attrs["near_unconverged_states"]).split(", ") if mesh]
    Outcome(
        verdict=highest_resonance(gearbox, ranking) if summary["excited"] else "No excitation",
        further=[sound_line(sound)] if sound else [],
        summary=summary,
        tables=[
            resonance_table(
                gearbox, ranking, f"{summary['variant']}, constant speed, {METHOD_LABELS[settings.method]}"
            ),
            *filter(None, [source_table(gearbox, data)]),
            *(sound_tables(sound) if sound else ()),
        ],
        findings=findings,
        path=summary["file"],
        failure=not_converged_failure(near),
        remarks=[_computed(gearbox, summary, data)],
    ).show(as_json, whole)


# Summary of a response, from which the tables and messages are made


def summarise(
    project: Project,
    settings: SteadySettings,
    data: xr.Dataset,
    shuttling: tuple[Shuttling, ...],
    ranking: Ranking,
) -> dict[str, Any]:
    """Summarise a response, with units in the keys."""
    law = LAWS[str(data.attrs["mesh_model"])]
    excited = is_excited(data)
    sound = sound_over_speed(data) if excited else None  # None without an elastic housing, too
    # planets by their family
    shares = zip(data["mesh_wave"].values, data["left_out"].values, strict=True)
    return {
        "case": project.gearbox.source,
        **{key: str(data.attrs[key]) for key in ("variant", "mesh_model", "inertias", "method")},
        "static_load": static_load_in_words(project.gearbox),
        "speeds": int(data.sizes["point"]),
        "lines": int(data.sizes["line"]),
        "growth_rate_1_per_s": float(data.attrs["growth_rate"]),
        "excited": excited,
        "harmonics": int(data.attrs["harmonics"]),
        "truncation_of_compliance": {str(wave): float(share) for wave, share in shares if " " not in str(wave)},
        "change_with_more_harmonics": finite_or_none(float(data.attrs["change_with_more"])),
        "meshes_that_pull": [
            {"mesh": pull.name, "speeds": pull.count, "worst_speed_rpm": pull.speed / RPM, "share_of_time": pull.share}
            for pull in (() if law.loses_contact else pulls(data))
        ],
        "not_converged": [
            {"speed_rpm": point["speed"] / RPM, "reason": point["reason"]}
            for point in json.loads(data.attrs["not_converged"])
        ],
        "excitations_at_mean_angles_rpm": [
            abs(float(speed)) / RPM
            for speed, mean in zip(data["speed"].values, data["loads_at_mean_angles"].values, strict=True)
            if mean
        ],
        "unstable_points": int((data["growth"] > 0.0).sum()),
        "largest_energy_error": float(abs(data["energy_error"]).max()),
        "branch_ended": str(data.attrs["branch_ended"]),
        "folds_rpm": [fold / RPM for fold in json.loads(data.attrs["folds"])],
        **{key: float(data.attrs[key]) for key in ("planet_spread", "stiffness_variation")},
        **{key: str(data.attrs[key]) for key in ("bearings_in_time", "shared_lines")},
        "ranked_speeds_rpm": [speed / RPM for speed in ranking.speeds],
        "ranked_over_all_speeds": ranking.whole,
        "accelerations_of": ranking.accelerates,
        "ranked_by": ranking.quantity,
        "ranked_by_reason": ranking.reason,
        "resonances": [resonance.summary() for resonance in ranking.resonances],
        "peaks_of_overall_dte": [
            {
                "line": peak.line,
                "order": peak.order,
                "speed_rpm": peak.speed / RPM,
                "frequency_Hz": peak.frequency,
                "amplitude_m": peak.amplitude,
            }
            for peak in peaks(data)
            if peak.amplitude > ROUND_OFF["error"]
        ],
        "sources_of_overall_dte": json.loads(data.attrs["contributions"]) if project.gearbox.varying_loads else [],
        "sound": None if sound is None else sound.inside(ranking.speeds).summary(),
        "file": str(project.steady_path(settings)),
        "neglected_shuttling": [
            {"pair": pair.pair, "load_centroid_m": pair.amplitude, "over_transmission_error": pair.over_error}
            for pair in shuttling
            if excited
        ],
        "bearings_outside_linear_range": [
            {
                "bearing": swing.name,
                "speeds": swing.count,
                "worst_speed_rpm": swing.speed / RPM,
                "share_of_static_load": swing.share,
            }
            for swing in bearing_swings(data)
        ],
    }


def neglected_shuttling(project: Project) -> tuple[Shuttling, ...]:
    """Return the shuttling of each pair, largest first, where the mesh model neglects it."""
    law = LAWS[project.choice.mesh_model]
    if law.moves_load or not law.needs_tables or project.choice.variant.spins_only:
        return ()
    return shuttling_pairs(project.gearbox, project.folder)


def _computed(gearbox: Gearbox, summary: Mapping[str, Any], data: xr.Dataset) -> str:
    """Return the computed speeds, the damping, and the neglected part of the excitation."""
    fastest = float(abs(data["speed"]).max()) / RPM
    text = f"{summary['speeds']} speeds up to {significant(fastest, 3)} rpm; damping "
    text += damping_in_words(gearbox.case.damping)
    if friction := gearbox.case.damping.tooth_friction:
        text += f"; friction of teeth included, coefficient {friction:g}"
    if summary["truncation_of_compliance"]:
        mesh, share = max(summary["truncation_of_compliance"].items(), key=lambda own: own[1])
        text += f"; {100.0 * share:.2g} % (rms) of the compliance variation of {mesh} neglected"
    return f"{text}."
