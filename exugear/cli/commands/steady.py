"""The command `steady`: steady-state response over speed, for every mesh order and their combinations."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exugear.cli.case import (
    USUAL_LAW,
    CaseArgument,
    FilesBelowOption,
    InertiasOption,
    JsonOption,
    LawOption,
    OutOption,
    ScriptsOption,
    VariantOption,
    assembled_by_iso,
    check_friction,
    open_project,
    steady_lack,
)
from exugear.cli.console import (
    BadInputError,
    FailedError,
    exit_codes,
    note,
    print_json,
    refuse_not_converged,
    say,
)
from exugear.cli.tables import HARD_SPACE, print_table, print_text, significant

if TYPE_CHECKING:
    import xarray as xr

    from exugear.gearbox.gearbox import Gearbox
    from exugear.project import Project
    from exugear.report.findings.ranking import Ranking, Resonance
    from exugear.steady.peaks import BearingLoadExcursion, Peak, TensileMesh
    from exugear.steady.settings import SteadySettings
    from exugear.system.tooth_mesh.tables import Shuttling

LEAST_AMPLITUDE = 1e-12
"""Amplitude of the overall transmission error below which a peak is round-off, m."""
SHOWN_RESONANCES = 15
SHOWN_BEARINGS = 4
COLUMNS = {
    "error": ("overall\nTE µm", 1e6),
    "force": ("bearing\nforce kN", 1e-3),
    "acceleration": ("accel.\nm/s²", 1.0),
}
"""Headings of the table and the factors from SI units."""
NOTICED_CHANGE = 1e-2
"""Relative change of the highest peaks with more harmonics above which a warning is printed."""
NOTICED_VARIATION = 1e-3
"""Relative variation of stiffness with the carrier angle above which a warning is printed."""
NOTICED_WAY = 0.3
"""Ratio of shuttling moment to transmission error excitation above which a warning is printed."""


BAND_LEGEND = (
    "Zero-to-peak amplitudes with the highest and with the lowest damping; (ranks) where the rank within the quantity "
    "depends on the damping."
)


class Method(StrEnum):
    """Methods: transmission error as excitation, time-varying stiffness, or nonlinear models evaluated in time."""

    linear = "linear"
    parametric = "parametric"
    nonlinear = "nonlinear"


def steady(
    case: CaseArgument,
    variant: VariantOption = None,
    mesh_model: LawOption = USUAL_LAW,
    inertias: InertiasOption = None,
    load_case: Annotated[
        str | None,
        typer.Option(
            "--load-case",
            metavar="NAME",
            help="Linearise at the torques of a load case; results in at-NAME of the results folder. (default: static "
            "load)",
            show_default=False,
        ),
    ] = None,
    method: Annotated[
        Method,
        typer.Option(
            metavar="NAME",
            help="Method. linear: transmission error as excitation; parametric: time-varying stiffness, all meshes "
            "coupled; nonlinear: harmonic balance with contact loss (model table) and bearings of model iso16281.",
        ),
    ] = Method.parametric,
    speeds: Annotated[
        str | None,
        typer.Option(
            metavar="FIRST:LAST:COUNT",
            help="Input speeds, rpm, positive about +z. (default: range of the first load case)",
            show_default=False,
        ),
    ] = None,
    harmonics: Annotated[
        int | None,
        typer.Option(
            help="Harmonics of each mesh frequency. (default: as the mesh stiffness requires)",
            show_default=False,
        ),
    ] = None,
    branches: Annotated[
        bool,
        typer.Option(
            "--continuation",
            help="Continuation: follow the solution through turning points (method nonlinear).",
        ),
    ] = False,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compute the steady-state response and rank the resonances.

    Needs no run-up. Speeds are added where mesh orders cross modes. Transmission error tables that are missing or out
    of date are computed first.
    """
    with exit_codes():
        project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias, load_case)
        if load_case is not None:
            project = project.at_load_case(load_case)
        settings = _settings(project, method, speeds, harmonics, branches)
        # A variant without steady-state response is refused before tables and finite elements are computed.
        with suppress(FailedError):  # such a failure does not apply to the selected mesh model
            if reason := steady_lack(assembled_by_iso(project.gearbox, project.choice.variant), project.choice.variant):
                raise BadInputError(reason)
        check_friction(project.gearbox, mesh_model)
        project.begin()
        project.prepare()
        _print_result(project, settings, project.steady(settings), as_json)


def _warn_of_other_loads(gearbox: Gearbox) -> None:
    """Print warnings about load cases whose mesh loads differ from the static load used for the response."""
    from exugear.gearbox.load_cases import load_in_words, other_load_warning, static_load_in_words, summarise_loads

    static = static_load_in_words(gearbox)
    for name, load_case in gearbox.load_cases.items():
        if other_load_warning(gearbox, summarise_loads(gearbox, load_case)):
            note(
                f"Warning: the response is computed at the static load ({static}); load case {name} has another load "
                f"({load_in_words(load_case)}): add --load-case {name} to compute it there",
                style="yellow",
            )


def _settings(
    project: Project, method: Method, speeds: str | None, harmonics: int | None, branches: bool
) -> SteadySettings:
    from exugear.steady.settings import SpeedRange, SteadySettings, check_law, check_speeds, usual_speeds

    check_law(project.choice.mesh_model, method.value)
    asked = usual_speeds(project.gearbox) if speeds is None else SpeedRange.from_text(speeds)
    check_speeds(project.gearbox, asked)
    return SteadySettings(asked, method.value, harmonics, branches=branches)


def _print_result(project: Project, settings: SteadySettings, data: xr.Dataset, as_json: bool) -> None:
    from exugear.gearbox.load_cases import static_load_in_words
    from exugear.gearbox.units import RPM
    from exugear.report.findings.ranking import ranking_of
    from exugear.system.modal_damping import damping_in_words

    _warn_of_other_loads(project.gearbox)
    growth = float(data.attrs["growth_rate"])
    ranking = ranking_of(data)
    _warn_of_instability(data, growth)
    pulling = _warn_of_tensile_forces(data)
    swinging = _warn_of_bearing_loads(data)
    if data.attrs["shared_lines"]:
        note(f"Coinciding orders of several meshes, each named after one of them: {data.attrs['shared_lines']}")
    excited = bool((data["amplitude"][:, 1:, 0] > LEAST_AMPLITUDE).any())
    if not excited:
        note(
            f"No excitation: the mesh model {data.attrs['mesh_model']} has constant stiffness over the mesh cycle, and "
            "all amplitudes are zero; use --mesh-model line_of_action"
        )
    else:
        _print_harmonics(data)
        _print_speed_range(ranking)
    wandering = _warn_of_shuttling(project) if excited else ()
    if as_json:
        summary = _whole_summary(project, settings, data, ranking, pulling, excited)
        remarks = {
            "neglected_shuttling": [
                {"pair": load.pair, "load_centroid_m": load.amplitude, "over_transmission_error": load.over_error}
                for load in wandering
            ],
            "bearings_outside_linear_range": [
                {
                    "bearing": swing.bearing,
                    "speeds": swing.count,
                    "worst_speed_rpm": swing.speed / RPM,
                    "share_of_static_load": swing.share,
                }
                for swing in swinging
            ],
        }
        print_json({**summary, **remarks})
        _fail_if_invalid(data, growth)
        return
    title = f"Resonance ranking, {_speeds_of(ranking)}, variant {project.choice.variant}, {settings.method}"
    title += f", at {static_load_in_words(project.gearbox)}".replace(" N m", f"{HARD_SPACE}N{HARD_SPACE}m")
    if ranking.resonances:
        rows = [_row(resonance) for resonance in ranking.resonances[:SHOWN_RESONANCES]]
        print_table(title, rows, ("bearing",), _legend(ranking))
        _print_bands(project.gearbox, ranking)
    fastest = float(abs(data["speed"]).max()) / RPM
    stable = f"slowest decay rate {-growth:.3g} 1/s (stable)" if growth <= 0.0 else f"fastest growth {growth:.3g} 1/s"
    damping = damping_in_words(project.gearbox.case.damping)
    if friction := project.gearbox.case.damping.tooth_friction:
        damping += f"; friction of teeth included, coefficient {friction:g}"
    print_text(f"{data.sizes['point']} speeds up to {fastest:.4g} rpm; {stable}; damping {damping}.")
    say(f"Results: {project.steady_path(settings)}")
    _fail_if_invalid(data, growth)


def _print_bands(gearbox: Gearbox, ranking: Ranking) -> None:
    """Print the amplitudes at both ends of the range of damping, where they were solved."""
    shown = [
        resonance
        for resonance in ranking.resonances[:SHOWN_RESONANCES]
        if any(peak.limits for peak in resonance.amplitudes.values())
    ]
    if not shown:
        return
    band = gearbox.case.damping.modal_band_percent
    damping = "half to twice the damping"
    if band is not None:
        damping = f"{band[0]:g} to {band[1]:g} % of critical damping"
    print_table(f"Amplitudes with {damping}", [_band_row(resonance) for resonance in shown], legend=BAND_LEGEND)


def _band_row(resonance: Resonance) -> dict[str, str]:
    from exugear.gearbox.units import RPM

    found = {"order": resonance.line, "speed\nrpm": significant(resonance.speed / RPM, 5, 2)}
    for quantity, peak in resonance.amplitudes.items():
        heading, factor = COLUMNS[quantity]
        found[heading] = "-"
        if peak.limits:
            found[heading] = "–".join(significant(factor * limit.amplitude, 2, 6) for limit in peak.limits[::-1])
            if peak.places is not None and peak.places[0] != peak.places[1]:
                best, worst = peak.places
                found[heading] += f" ({best}–{worst})"
            found[heading] = found[heading].replace(" ", HARD_SPACE)
    return found


def _legend(ranking: Ranking) -> str:
    text = "Zero-to-peak amplitudes, (rank) within each quantity. TE: transmission error"
    if "force" not in ranking.resonances[0].amplitudes:
        return f"{text}."
    owner = {"shafts": "shaft", "housing": "housing"}.get(ranking.accelerates, ranking.accelerates)
    return f"{text}; force: largest dynamic bearing force; accel.: {owner} at the bearing."


def _whole_summary(
    project: Project,
    settings: SteadySettings,
    data: xr.Dataset,
    ranking: Ranking,
    pulling: tuple[TensileMesh, ...],
    excited: bool,
) -> dict[str, Any]:
    from exugear.gearbox.load_cases import static_load_in_words
    from exugear.gearbox.units import RPM
    from exugear.steady.peaks import peaks

    found = [peak for peak in peaks(data) if peak.amplitude > LEAST_AMPLITUDE]
    return {
        "case": project.gearbox.source,
        **{key: str(data.attrs[key]) for key in ("variant", "mesh_model", "inertias", "method")},
        "static_load": static_load_in_words(project.gearbox),
        "speeds": int(data.sizes["point"]),
        "lines": int(data.sizes["line"]),
        "growth_rate_1_per_s": float(data.attrs["growth_rate"]),
        "excited": excited,
        "harmonics": int(data.attrs["harmonics"]),
        "truncation_of_compliance": _left_out(data),
        "change_with_more_harmonics": _known(float(data.attrs["change_with_more"])),
        "meshes_that_pull": [
            {"mesh": pull.mesh, "speeds": pull.count, "worst_speed_rpm": pull.speed / RPM, "share_of_time": pull.share}
            for pull in pulling
        ],
        "not_converged": [
            {"speed_rpm": load["speed"] / RPM, "reason": load["reason"]}
            for load in json.loads(data.attrs["not_converged"])
        ],
        "unstable_points": int((data["growth"] > 0.0).sum()),
        "largest_energy_error": float(abs(data["energy_error"]).max()),
        "branch_ended": str(data.attrs["branch_ended"]),
        "folds_rpm": [fold / RPM for fold in json.loads(data.attrs["folds"])],
        "planet_spread": float(data.attrs["planet_spread"]),
        "stiffness_variation": float(data.attrs["stiffness_variation"]),
        "bearings_in_time": str(data.attrs["bearings_in_time"]),
        "shared_lines": str(data.attrs["shared_lines"]),
        "ranked_speeds_rpm": [speed / RPM for speed in ranking.speeds],
        "ranked_over_all_speeds": ranking.whole,
        "accelerations_of": ranking.accelerates,
        "resonances": [resonance.summary() for resonance in ranking.resonances],
        "peaks_of_overall_dte": [_summary(peak) for peak in found],
        "file": str(project.steady_path(settings)),
    }


def _speeds_of(ranking: Ranking) -> str:
    from exugear.gearbox.units import RPM

    low, high = (speed / RPM for speed in ranking.speeds)
    return f"{low:.4g} to {high:.4g} rpm"


def _print_speed_range(ranking: Ranking) -> None:
    """Print which speed range is ranked, and notes if all speeds are ranked or no resonance was found."""
    if ranking.whole:
        note(
            "Ranking over all speeds: no computed speed lies in an operating range. Set rated_speed_rpm or "
            "speed_range_rpm in [operation]."
        )
    if not ranking.resonances:
        note(f"No resonance at {_speeds_of(ranking)}")


def _fail_if_invalid(data: xr.Dataset, growth: float) -> None:
    """End with code 1 if the response is unstable; stability known for each speed is left to the result file.

    The command also fails if meshes use table states next to non-converged ones, or if the continuation is incomplete.
    """
    refuse_not_converged([mesh for mesh in str(data.attrs["near_unconverged_states"]).split(", ") if mesh])
    if data.attrs["branch_ended"]:
        raise FailedError(f"continuation incomplete: {data.attrs['branch_ended']}")
    if growth > 0.0 and not bool(data["growth"].notnull().any()):
        raise FailedError(f"invalid steady-state response: disturbances grow at up to {growth:.3g} 1/s (unstable)")


def _warn_of_tensile_forces(data: xr.Dataset) -> tuple[TensileMesh, ...]:
    """Print which meshes have tensile forces, if the mesh model neglects contact loss."""
    from exugear.gearbox.units import RPM
    from exugear.steady.peaks import pulls
    from exugear.system.tooth_mesh.laws.registry import LAWS

    law = str(data.attrs["mesh_model"])
    found: tuple[TensileMesh, ...] = () if LAWS[law].loses_contact else pulls(data)
    for pull in found:
        note(
            f"Warning: {pull.mesh}: tensile mesh force at {pull.count} of {data.sizes['point']} speeds, at most "
            f"{100.0 * pull.share:.2g} % of the time at {pull.speed / RPM:.4g} rpm. The model {law} neglects contact "
            "loss; use --mesh-model table --method nonlinear.",
            style="yellow",
        )
    return found


def _warn_of_instability(data: xr.Dataset, growth: float) -> None:
    """Print the speeds without a converged or stable steady state."""
    from exugear.gearbox.units import RPM

    for missing in json.loads(data.attrs["not_converged"]):
        note(f"Warning: {missing['speed'] / RPM:.4g} rpm: {missing['reason']}", style="yellow")
    for speed, remark in zip(data["speed"].values, data["remark"].values, strict=True):
        if remark:
            note(f"Warning: {float(speed) / RPM:.4g} rpm: {remark}", style="yellow")
    if growth > 0.0:
        speeds = data["speed"].values[data["growth"].values == growth]
        where = f" (at {float(speeds[0]) / RPM:.4g} rpm)" if speeds.size else ""
        note(f"Warning: unstable: disturbances grow at up to {growth:.3g} 1/s{where}; no steady state", style="yellow")


def _warn_of_shuttling(project: Project) -> tuple[Shuttling, ...]:
    """Print a warning if the shuttling moment is significant but neglected by the mesh model."""
    from exugear.system.tooth_mesh.laws.registry import LAWS
    from exugear.system.tooth_mesh.tables import shuttling_pairs

    law = LAWS[project.choice.mesh_model]
    if law.moves_load or not law.needs_tables or project.choice.variant.spins_only:
        return ()
    found = shuttling_pairs(project.gearbox, project.folder)
    if found and found[0].over_error > NOTICED_WAY:
        note(
            f"Warning: {found[0].description}. The shuttling moment, {found[0].over_error:.2g} times the excitation by "
            f"the transmission error, is neglected by the mesh model {law.name}; resonances with tilting gears may be "
            "many times higher. Use --mesh-model line_of_action.",
            style="yellow",
        )
    return found


def _left_out(data: xr.Dataset) -> dict[str, float]:
    """Neglected fraction of the compliance variation of each mesh, above the harmonics; planets by their family."""
    shares = zip(data["mesh_wave"].values, data["left_out"].values, strict=True)
    return {str(wave): float(share) for wave, share in shares if " " not in str(wave)}


def _known(value: float) -> float | None:
    if math.isfinite(value):
        return value
    return None


def _print_harmonics(data: xr.Dataset) -> None:
    """Print the number of harmonics, their truncation error, and the effect of more harmonics."""
    mesh, share = max(_left_out(data).items(), key=lambda own: own[1])
    change = _known(float(data.attrs["change_with_more"]))
    count = int(data.attrs["harmonics"])
    text = f"Harmonic truncation: {count} mesh harmonics; {100.0 * share:.2g} % (rms) of the compliance variation of "
    text += f"{mesh} neglected"
    if change is None:
        note(f"{text}; harmonics that a solution requires are added.")
        return
    text += f"; 1.5 times as many harmonics change the ten highest peaks by at most {100.0 * change:.2g} %."
    if change > NOTICED_CHANGE:
        note(f"Warning: {text}", style="yellow")
    else:
        note(text)


def _warn_of_bearing_loads(data: xr.Dataset) -> tuple[BearingLoadExcursion, ...]:
    """Print how nonlinear bearings were modelled, effects of unequal planet loads, and large dynamic bearing loads."""
    from exugear.gearbox.units import RPM
    from exugear.steady.peaks import STRAINED, bearing_swings

    if data.attrs["bearings_in_time"]:
        note(f"Nonlinear bearings (rolling elements evaluated in time): {data.attrs['bearings_in_time']}")
    elif "16281" in data.attrs["bearing_laws"]:
        note("Nonlinear bearings are linearised at the static load; --method nonlinear evaluates the nonlinear model")
    variation = float(data.attrs["stiffness_variation"])
    if variation > NOTICED_VARIATION:
        note(
            f"Warning: stiffness varies by {100.0 * variation:.2g} % over a carrier revolution (unequal planet loads). "
            "The mean is used; responses near lightly damped planet modes are off by a few thousandths.",
            style="yellow",
        )
    swinging = bearing_swings(data)
    if swinging:
        worst = "; ".join(
            f"{swing.bearing} {100.0 * swing.share:.0f} % at {abs(swing.speed) / RPM:.4g} rpm"
            for swing in swinging[:SHOWN_BEARINGS]
        )
        more = f", and {len(swinging) - SHOWN_BEARINGS} more" if len(swinging) > SHOWN_BEARINGS else ""
        note(
            f"Warning: dynamic load of bearings at least {100.0 * STRAINED:.0f} % of their static load "
            f"({worst}{more}). Outside the linear range; peaks there are overestimated, by about 50 % where a bearing "
            "is unloaded part of the time. Set "
            'model = "iso16281" and use --method nonlinear.',
            style="yellow",
        )
    return swinging


def _summary(peak: Peak) -> dict[str, Any]:
    from exugear.gearbox.units import RPM

    return {
        "line": peak.line,
        "order": peak.order,
        "speed_rpm": peak.speed / RPM,
        "frequency_Hz": peak.frequency,
        "amplitude_m": peak.amplitude,
    }


def _row(resonance: Resonance) -> dict[str, str]:
    from exugear.gearbox.units import RPM

    found = {
        "order": resonance.line,
        "speed\nrpm": significant(resonance.speed / RPM, 5, 2),
        "freq.\nHz": significant(resonance.frequency, 4, 2),
    }
    for quantity, peak in resonance.amplitudes.items():
        heading, factor = COLUMNS[quantity]
        rank = "" if peak.place is None else f" ({peak.place})"
        found[heading] = significant(factor * peak.amplitude, 3, 6) + rank
        if quantity == "force":
            found["bearing"] = peak.at
    return found
