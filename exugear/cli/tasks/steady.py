"""The command `steady`: steady-state response over speed, for every mesh order and their combinations."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from typing import Any

import xarray as xr

from exugear.cli.case import assembled_by_iso, check_friction, steady_lack
from exugear.cli.console import BadInputError, FailedError, note, print_json, refuse_not_converged, say, warn
from exugear.cli.tables import HARD_SPACE, Column, print_table, print_text, significant
from exugear.cli.watched import WatchedProject
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import load_in_words, other_load_warning, static_load_in_words, summarise_loads
from exugear.gearbox.units import RPM
from exugear.project import Project
from exugear.report.findings.ranking import UNIT_KEYS, ranking_of
from exugear.report.findings.words import QUANTITIES
from exugear.steady.peaks import STRAINED, bearing_swings, peaks, pulls
from exugear.steady.settings import Method, SpeedRange, SteadySettings, check_law, check_speeds, usual_speeds
from exugear.system.modal_damping import damping_in_words
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.tables import Shuttling, shuttling_pairs

LEAST_AMPLITUDE = 1e-12
"""Amplitude of the overall transmission error below which a peak is round-off, m."""
SHOWN_RESONANCES = 15
SHOWN_BEARINGS = 4
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


def settings_of_options(
    project: Project, method: Method, speeds: str | None, harmonics: int | None, branches: bool
) -> SteadySettings:
    """Return the settings that the options state; raise an error if they are invalid for the project."""
    check_law(project.choice.mesh_model, method)
    asked = usual_speeds(project.gearbox) if speeds is None else SpeedRange.from_text(speeds)
    check_speeds(project.gearbox, asked)
    return SteadySettings(asked, method, harmonics, branches=branches)


def steady(project: WatchedProject, settings: SteadySettings, quantity: str | None, as_json: bool) -> None:
    """Compute, store and print the response of a project."""
    gearbox = project.gearbox
    # A variant without steady-state response is refused before tables and finite elements are computed.
    with suppress(FailedError):  # such a failure does not apply to the selected mesh model
        if reason := steady_lack(assembled_by_iso(gearbox, project.choice.variant), project.choice.variant):
            raise BadInputError(reason)
    check_friction(gearbox, project.choice.mesh_model)
    project.begin()
    project.prepare()
    data = project.steady(settings)
    shuttling = neglected_shuttling(project)
    summary = summarise(project, settings, data, shuttling, quantity or gearbox.case.report.quantity)
    _warn_of_other_loads(gearbox)
    _warn_of_response(data, summary)
    _print_excitation(summary, shuttling)
    if as_json:
        print_json(summary)
    else:
        _print_response(gearbox, summary, float(abs(data["speed"]).max()) / RPM)
    _fail_if_invalid(data)


# Summary of a response, from which the tables and messages are made


def summarise(
    project: Project,
    settings: SteadySettings,
    data: xr.Dataset,
    shuttling: tuple[Shuttling, ...],
    quantity: str | None = None,
) -> dict[str, Any]:
    """Summarise a response, with units in the keys; `quantity` ranks the resonances."""
    law = LAWS[str(data.attrs["mesh_model"])]
    ranking = ranking_of(data, wanted=quantity)
    excited = bool((data["amplitude"][:, 1:, 0] > LEAST_AMPLITUDE).any())
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
            for pull in (() if law.loses_contact else pulls(data))
        ],
        "not_converged": [
            {"speed_rpm": point["speed"] / RPM, "reason": point["reason"]}
            for point in json.loads(data.attrs["not_converged"])
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
            if peak.amplitude > LEAST_AMPLITUDE
        ],
        "file": str(project.steady_path(settings)),
        "neglected_shuttling": [
            {"pair": pair.pair, "load_centroid_m": pair.amplitude, "over_transmission_error": pair.over_error}
            for pair in shuttling
            if excited
        ],
        "bearings_outside_linear_range": [
            {
                "bearing": swing.bearing,
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


def _left_out(data: xr.Dataset) -> dict[str, float]:
    """Neglected fraction of the compliance variation of each mesh, above the harmonics; planets by their family."""
    shares = zip(data["mesh_wave"].values, data["left_out"].values, strict=True)
    return {str(wave): float(share) for wave, share in shares if " " not in str(wave)}


def _known(value: float) -> float | None:
    if math.isfinite(value):
        return value
    return None


# Messages


def _warn_of_other_loads(gearbox: Gearbox) -> None:
    """Print warnings about load cases whose mesh loads differ from the static load used for the response."""
    static = static_load_in_words(gearbox)
    for name, load_case in gearbox.load_cases.items():
        if other_load_warning(gearbox, summarise_loads(gearbox, load_case)):
            warn(
                f"the response is computed at the static load ({static}); load case {name} has another load "
                f"({load_in_words(load_case)}): add --load-case {name} to compute it there"
            )


def _warn_of_response(data: xr.Dataset, summary: Mapping[str, Any]) -> None:
    """Print where the response is missing, unstable or outside the range of its linear models."""
    growth = summary["growth_rate_1_per_s"]
    for missing in summary["not_converged"]:
        warn(f"{missing['speed_rpm']:.4g} rpm: {missing['reason']}")
    for speed, remark in zip(data["speed"].values, data["remark"].values, strict=True):
        if remark:
            warn(f"{float(speed) / RPM:.4g} rpm: {remark}")
    if growth > 0.0:
        speeds = data["speed"].values[data["growth"].values == growth]
        where = f" (at {float(speeds[0]) / RPM:.4g} rpm)" if speeds.size else ""
        warn(f"unstable: disturbances grow at up to {growth:.3g} 1/s{where}; no steady state")
    for pull in summary["meshes_that_pull"]:
        warn(
            f"{pull['mesh']}: tensile mesh force at {pull['speeds']} of {summary['speeds']} speeds, at most "
            f"{100.0 * pull['share_of_time']:.2g} % of the time at {pull['worst_speed_rpm']:.4g} rpm. The model "
            f"{summary['mesh_model']} neglects contact loss; use --mesh-model table --method nonlinear."
        )
    if summary["bearings_in_time"]:
        note(f"Nonlinear bearings (rolling elements evaluated in time): {summary['bearings_in_time']}")
    elif "16281" in data.attrs["bearing_laws"]:
        note("Nonlinear bearings are linearised at the static load; --method nonlinear evaluates the nonlinear model")
    if summary["stiffness_variation"] > NOTICED_VARIATION:
        warn(
            f"stiffness varies by {100.0 * summary['stiffness_variation']:.2g} % over a carrier revolution (unequal "
            "planet loads). The mean is used; responses near lightly damped planet modes are off by a few thousandths."
        )
    swinging = summary["bearings_outside_linear_range"]
    if swinging:
        worst = "; ".join(
            f"{swing['bearing']} {100.0 * swing['share_of_static_load']:.0f} % at {abs(swing['worst_speed_rpm']):.4g} "
            "rpm"
            for swing in swinging[:SHOWN_BEARINGS]
        )
        more = f", and {len(swinging) - SHOWN_BEARINGS} more" if len(swinging) > SHOWN_BEARINGS else ""
        warn(
            f"dynamic load of bearings at least {100.0 * STRAINED:.0f} % of their static load ({worst}{more}). Outside "
            "the linear range; peaks there are overestimated, by about 50 % where a bearing is unloaded part of the "
            'time. Set model = "iso16281" and use --method nonlinear.'
        )
    if summary["shared_lines"]:
        note(f"Coinciding orders of several meshes, each named after one of them: {summary['shared_lines']}")


def _print_excitation(summary: Mapping[str, Any], shuttling: tuple[Shuttling, ...]) -> None:
    """Print what excites the response and what is neglected of it, and which speed range is ranked."""
    if not summary["excited"]:
        note(
            f"No excitation: the mesh model {summary['mesh_model']} has constant stiffness over the mesh cycle, and "
            "all amplitudes are zero; use --mesh-model line_of_action"
        )
        return
    _print_harmonics(summary)
    if summary["ranked_over_all_speeds"]:
        note(
            "Ranking over all speeds: no computed speed lies in an operating range. Set rated_speed_rpm or "
            "speed_range_rpm in [operation]."
        )
    if not summary["resonances"]:
        note(f"No resonance at {_ranked_speeds(summary)}")
    if shuttling and shuttling[0].over_error > NOTICED_WAY:
        warn(
            f"{shuttling[0].description}. The shuttling moment, {shuttling[0].over_error:.2g} times the excitation by "
            f"the transmission error, is neglected by the mesh model {summary['mesh_model']}; resonances with tilting "
            "gears may be many times higher. Use --mesh-model line_of_action."
        )


def _print_harmonics(summary: Mapping[str, Any]) -> None:
    """Print the number of harmonics, their truncation error, and the effect of more harmonics."""
    mesh, share = max(summary["truncation_of_compliance"].items(), key=lambda own: own[1])
    change = summary["change_with_more_harmonics"]
    text = f"Harmonic truncation: {summary['harmonics']} mesh harmonics; {100.0 * share:.2g} % (rms) of the compliance "
    text += f"variation of {mesh} neglected"
    if change is None:
        note(f"{text}; harmonics that a solution requires are added.")
        return
    text += f"; 1.5 times as many harmonics change the ten highest peaks by at most {100.0 * change:.2g} %."
    if change > NOTICED_CHANGE:
        warn(text)
    else:
        note(text)


def _fail_if_invalid(data: xr.Dataset) -> None:
    """End with code 1 if the response is unstable; stability known for each speed is left to the result file.

    The command also fails if meshes use table states next to non-converged ones, or if the continuation is incomplete.
    """
    growth = float(data.attrs["growth_rate"])
    refuse_not_converged([mesh for mesh in str(data.attrs["near_unconverged_states"]).split(", ") if mesh])
    if data.attrs["branch_ended"]:
        raise FailedError(f"continuation incomplete: {data.attrs['branch_ended']}")
    if growth > 0.0 and not bool(data["growth"].notnull().any()):
        raise FailedError(f"invalid steady-state response: disturbances grow at up to {growth:.3g} 1/s (unstable)")


# Tables of resonances


def _print_response(gearbox: Gearbox, summary: Mapping[str, Any], fastest: float) -> None:
    """Print the ranking, and the number of speeds, stability and damping of the response."""
    title = f"Resonances by {QUANTITIES[summary['ranked_by']].column}, {_ranked_speeds(summary)}"
    title += f", variant {summary['variant']}, {summary['method']}"
    title += f", at {summary['static_load']}".replace(" N m", f"{HARD_SPACE}N{HARD_SPACE}m")
    print_ranking(title, summary)
    _print_bands(gearbox.case.damping.modal_band_percent, summary["resonances"][:SHOWN_RESONANCES])
    growth = summary["growth_rate_1_per_s"]
    stable = f"slowest decay rate {-growth:.3g} 1/s (stable)" if growth <= 0.0 else f"fastest growth {growth:.3g} 1/s"
    damping = damping_in_words(gearbox.case.damping)
    if friction := gearbox.case.damping.tooth_friction:
        damping += f"; friction of teeth included, coefficient {friction:g}"
    print_text(f"{summary['speeds']} speeds up to {fastest:.4g} rpm; {stable}; damping {damping}.")
    say(f"Results: {summary['file']}")


def _ranked_speeds(summary: Mapping[str, Any]) -> str:
    low, high = summary["ranked_speeds_rpm"]
    return f"{low:.4g} to {high:.4g} rpm"


def print_ranking(title: str, summary: Mapping[str, Any]) -> None:
    """Print the amplitudes of the first resonances in each quantity."""
    resonances = summary["resonances"][:SHOWN_RESONANCES]
    if not resonances:
        return
    columns = [ORDER, SPEED, Column("freq.\nHz", "frequency_Hz", partial(significant, digits=4, decimals=2))]
    legend = "Zero-to-peak amplitudes, (rank) within each quantity. TE: overall transmission error"
    first = summary["ranked_by"]
    quantities = [first, *(own for own in QUANTITIES if own != first and f"{own}_place" in resonances[0])]
    for quantity in quantities:
        columns.append(Column(_heading(quantity), partial(_amplitude, quantity)))
        if quantity == first != "error":
            columns.append(Column("at", f"{quantity}_at", is_text=True))
    if "force" in quantities:
        owner = {"shafts": "shaft", "housing": "housing"}.get(summary["accelerations_of"], summary["accelerations_of"])
        legend += f"; force: largest dynamic bearing force; accel.: {owner} at the bearing"
        legend += "; mounts: acceleration at mounts" if "mount_acceleration" in quantities else ""
    print_table(title, resonances, columns, f"{legend}.")
    for quantity in quantities[1:]:
        leader = next((own for own in summary["resonances"] if own[f"{quantity}_place"] == 1), None)
        if leader is not None:
            label = QUANTITIES[quantity]
            value = significant(label.factor * leader[f"{quantity}_{UNIT_KEYS[quantity]}"], 3, 6)
            at = f" ({leader[f'{quantity}_at']})" if f"{quantity}_at" in leader else ""
            where = f"{significant(leader['frequency_Hz'], 4, 2)} Hz at {significant(leader['speed_rpm'], 4, 2)} rpm"
            say(f"Highest {label.column}: ±{value} {label.unit}{at}, {where}, {leader['line']}")


ORDER = Column("order", "line")
SPEED = Column("speed\nrpm", "speed_rpm", partial(significant, digits=4, decimals=2))


def _heading(quantity: str) -> str:
    return f"{QUANTITIES[quantity].short}\n{QUANTITIES[quantity].unit}"


def _amplitude(quantity: str, resonance: Mapping[str, Any]) -> str:
    """Amplitude of a resonance in one quantity, with its rank."""
    place = resonance[f"{quantity}_place"]
    rank = "" if place is None else f" ({place})"
    return significant(QUANTITIES[quantity].factor * resonance[f"{quantity}_{UNIT_KEYS[quantity]}"], 3, 6) + rank


def _print_bands(band: tuple[float, float] | None, resonances: list[dict[str, Any]]) -> None:
    """Print the amplitudes at both ends of the range of damping, where they were solved."""
    shown = [resonance for resonance in resonances if any("lowest_damping" in key for key in resonance)]
    if not shown:
        return
    damping = "half to twice the damping"
    if band is not None:
        damping = f"{band[0]:g} to {band[1]:g} % of critical damping"
    quantities = [quantity for quantity in QUANTITIES if f"{quantity}_place" in shown[0]]
    columns = [ORDER, SPEED, *(Column(_heading(quantity), partial(_band, quantity)) for quantity in quantities)]
    print_table(f"Amplitudes with {damping}", shown, columns, BAND_LEGEND)


def _band(quantity: str, resonance: Mapping[str, Any]) -> str | None:
    """Amplitudes of a resonance with the highest and with the lowest damping, and its ranks if they differ."""
    ends = [resonance.get(f"{quantity}_{end}_damping_{UNIT_KEYS[quantity]}") for end in ("highest", "lowest")]
    if None in ends:
        return None
    text = "–".join(significant(QUANTITIES[quantity].factor * end, 2, 6) for end in ends if end is not None)
    places = resonance[f"{quantity}_places_over_damping"]
    if places is not None and places[0] != places[1]:
        text += f"{HARD_SPACE}({places[0]}–{places[1]})"
    return text
