"""The command `check`: read and check a gearbox file and summarise it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from exugear.cli.case import assembled_by_iso, read_gearbox, steady_lack
from exugear.cli.console import BadInputError, FailedError, model_errors, print_json
from exugear.cli.tables import HARD_SPACE, Column, Outcome, Table, bearings_of_remarks, detail, significant
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import load_case_warnings, summarise_loads
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import OFFERED, Variant
from exugear.life.rating.lacks import missing_for_life
from exugear.results.findings import Finding
from exugear.results.folder import duty_summary
from exugear.system.bearings.duty import estimate_effects
from exugear.system.bodies.external_of_gearbox import external_facts
from exugear.system.bodies.of_gearbox import solids_of
from exugear.system.gearbox_checks import gearbox_warnings, lacking
from exugear.system.modes import modes_of, unusual_damping
from exugear.system.operating_points import bearing_duties, bearing_points, opposed_bearings
from exugear.system.part_warnings import backlash_range, pair_margins, thickness_range
from exugear.system.system import Assembly
from exugear.transient.plan import check_duration
from exugear.transient.runup import BAND


def check(case: Path, allow_dir: Path | None, as_json: bool, whole: bool) -> None:
    """Check a gearbox file and print its summary."""
    try:
        gearbox = read_gearbox(case, allow_dir, tell=False)
    except BadInputError as error:
        if as_json and isinstance(error.__cause__, GearboxFileError):
            print_json({"case": str(case), "errors": list(error.__cause__.errors)})
        raise
    summary = summarise(gearbox)
    # A wrong sign of a torque has consequences among the other warnings: seals and bearings that turn too fast.
    warnings = [f"load_cases.{own['load_case']}: {line}" for own in summary["load_cases"] for line in own["doubts"]]
    warnings += [*script_notes(gearbox), *summary["warnings"]]
    warnings += [own["span_doubt"] for own in summary["tooth_thickness"] if own["span_doubt"]]
    findings = [Finding("warning", line) for line in warnings]
    families = {bearing.name: bearing.family for bearing in gearbox.bearings}
    if names := dict.fromkeys(families[name] for name in opposed_bearings(gearbox)):
        text = f"bearings.{', '.join(names)}: locate in one axial direction each, opposed to each other; with "
        text += "model = 'linear' their axial stiffness acts in both directions"
        findings.append(Finding("note", text))
    Outcome(
        verdict=f"{gearbox.name}: no errors; {gearbox.train.ratio_text}",
        summary=summary,
        tables=check_tables(gearbox.case.overall.input, summary),
        findings=findings,
        remarks=[*summary["matrices"], *availability(summary)],
    ).show(as_json, whole)


def script_notes(gearbox: Gearbox) -> Iterator[str]:
    """Check the solids, and yield which of them require a script."""
    for key, model in solids_of(gearbox):
        if model.mesh.is_script:
            yield (
                f"{key}.file = {model.mesh.path.name!r}: a gmsh script can run any command, so modes, run and "
                "view want --allow-scripts or EXUGEAR_ALLOW_SCRIPTS=1 for the variant flexible"
            )


# Summary of a gearbox, from which the tables are made


def summarise(gearbox: Gearbox) -> dict[str, Any]:
    """Summarise a gearbox, with units in the keys."""
    pairs = [pair_summary(gearbox, name) for name in gearbox.pairs]
    loads = _load_summaries(gearbox)
    variants = {str(variant): lacking(gearbox, variant) for variant in OFFERED}
    assemblies = _assemblies(gearbox, variants)
    bearings, doubts = _bearing_summaries(gearbox, assemblies.get(Variant.bushing))
    assembly = assemblies.get(Variant.bushing) or assemblies.get(Variant.rigid)
    if isinstance(assembly, Assembly):
        doubts += filter(None, [unusual_damping(modes_of(assembly))])
    return {
        "case": gearbox.source,
        "name": gearbox.name,
        "ratio": gearbox.train.ratio,
        "pairs": pairs,
        "tooth_thickness": thickness_summaries(gearbox),
        "forces": [
            {
                "force": force.name,
                "body": force.body,
                "z_mm": 1e3 * force.position[2],
                "force_N": list(force.wrench[:3]),
                "moment_N_m": list(force.wrench[3:]),
            }
            for force in gearbox.forces
        ],
        "bearings": bearings,
        "load_cases": loads,
        "variants": variants,
        "steady": {
            str(variant): str(assembly) if isinstance(assembly, FailedError) else steady_lack(assembly, variant)
            for variant, assembly in assemblies.items()
        },
        "matrices": list(external_facts(gearbox)),
        "life": {verb: list(reasons) for verb, reasons in missing_for_life(gearbox).items()},
        "warnings": [*gearbox_warnings(gearbox), *doubts],
    }


def _assemblies(gearbox: Gearbox, variants: Mapping[str, str]) -> dict[Variant, Assembly | FailedError]:
    """Assemble each available variant once; `flexible` shares the assembly of `bushing`, as all bodies are rigid."""
    found: dict[Variant, Assembly | FailedError] = {}
    for variant in (Variant.of(name) for name, lack in variants.items() if not lack):
        if variant.is_elastic and Variant.bushing in found:
            found[variant] = found[Variant.bushing]
            continue
        try:
            found[variant] = assembled_by_iso(gearbox, variant)
        except FailedError as error:
            found[variant] = error
    return found


def pair_summary(gearbox: Gearbox, name: str) -> dict[str, Any]:
    """Summarise the geometry, load and margins of a gear pair."""
    spec = gearbox.pairs[name]
    pair = spec.pair
    margins = pair_margins(spec)
    return {
        "pair": name,
        "teeth": [pair.pinion.teeth, pair.gear.teeth],
        "centre_distance_mm": 1e3 * pair.centre_distance,
        "pressure_angle_deg": math.degrees(pair.working_pressure_angle),
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "torque_gear_1_N_m": spec.static_torque,
        "sigma_H0_MPa": 1e-6 * margins.nominal_contact_stress,
        "margin_to_form_diameter": [None if math.isnan(margin) else margin for margin in margins.form],
        "tip_thickness_in_modules": list(margins.tip_thickness),
        "held_diameter_mm": [1e3 * gear.held_diameter for gear in (pair.pinion, pair.gear)],
        "backlash_um": [1e6 * play for play in backlash_range(gearbox, pair)],
        "normal_backlash_um": 1e6 * pair.normal_backlash,
    }


def thickness_summaries(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Summarise the tooth thickness of gears with allowances."""
    summaries = []
    for name, section in gearbox.case.gears.items():
        if section.tooth_thickness is not None:
            one = thickness_range(gearbox, name)
            summaries.append(
                {
                    "gear": name,
                    "normal_tooth_thickness_mm": [1e3 * end for end in one.thickness],
                    "span_teeth": one.span_teeth,
                    "base_tangent_length_mm": [1e3 * end for end in one.span] if one.span_teeth else None,
                    "span_doubt": one.span_warning or None,
                }
            )
    return summaries


def _bearing_summaries(
    gearbox: Gearbox, assembly: Assembly | FailedError | None
) -> tuple[list[dict[str, Any]], list[str]]:
    """Summarise load and stiffness of catalogue bearings, one row for those of all planets, and return their warnings.

    The mesh stiffness is that of ISO 6336, because tables may not exist and the static loads barely depend on it.
    """
    if assembly is None or not any(bearing.catalogue for bearing in gearbox.bearings):
        return [], []
    if isinstance(assembly, FailedError):
        return [], [f"bearings: {assembly}"]
    try:
        with model_errors():
            every = bearing_duties(assembly)
            duties = {duty.family: duty for duty in reversed(every)}
            points = {point.bearing.family: point for point in reversed(bearing_points(assembly))}
            effects = {family: estimate_effects(point) for family, point in points.items()}
    except FailedError as error:
        return [], [f"bearings: {error}"]
    summaries = []
    for family, duty in reversed(duties.items()):
        ends = [[effect.at_low, effect.at_high] for effect in effects[family]]
        estimated = {
            effect.key: {
                "value": effect.value,
                "range": [effect.low, effect.high],
                "radial_stiffness_N_per_m": [None if math.isnan(end) else end for end in pair],
            }
            for effect, pair in zip(effects[family], ends, strict=True)
        }
        summaries.append({**duty_summary(duty), "bearing": family, "estimated": estimated})
    remarks = bearings_of_remarks((duty.family, duty.remarks) for duty in every)
    doubts = [f"bearings.{', '.join(names)}: {remark}" for remark, names in remarks.items()]
    return summaries, doubts


def _load_summaries(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Summarise each load case on the kinematic gear train; a load case that no run could use is bad input."""
    summaries = []
    for name, case in gearbox.load_cases.items():
        check_duration(gearbox, case)
        loads = summarise_loads(gearbox, case)
        body, rim = loads.fastest_rim
        summaries.append(
            {
                "load_case": name,
                "net_torque_N_m": loads.net_torque,
                "driven": loads.driven,
                "duration_s": case.duration,
                "start_speed_rpm": loads.start_speed / RPM,
                "end_speed_rpm": loads.end_speed / RPM,
                "highest_mesh_frequency_Hz": max(loads.mesh_frequencies.values(), default=0.0),
                "band_Hz": BAND,
                "fastest_rim_m_per_s": rim,
                "fastest_rim_on": body,
                "loaded_flanks": dict(loads.flanks),
                "reversed_flanks": list(loads.reversed_flanks),
                "doubts": list(load_case_warnings(gearbox, case, BAND, Variant.bushing)),
            }
        )
    return summaries


# Tables of a gearbox

PAIR_LEGEND = (
    "Torque: static torque of the file. σ_H0: nominal contact stress at the pitch point, without load factors (ISO "
    "6336-2). Backlash: circumferential."
)
PAIR_DETAILS = (
    "Gear 1 is the first gear of the pair. SAP: start of active profile; its distance from the root form diameter in % "
    "of the profile length (roll length). Held at: held_diameter_mm, at which the tables fix the gear body; a smaller "
    "one of an external gear lowers the mesh stiffness."
)
LOAD_LEGEND = "*: the speed of a body is prescribed (driven_body). "
REVERSED_LEGEND = "!: the flank opposite to the flank loaded by the static load."
BEARING_LEGEND = (
    "Axial load: of the shaft on the inner ring, positive along +z. Stiffness range: with the "
    "estimated (not specified) inputs at their limits; dominant estimate: the input with the largest effect."
)
STATED_LEGEND = " *: specified in the gearbox file, used for the stiffness; static react.: static balance."


def _backlash(ends: list[float]) -> str:
    minimum, nominal, maximum = ends
    if maximum - minimum < 1.0:
        return f"{nominal:.0f}"
    return f"{nominal:.0f} ({minimum:.0f} to {maximum:.0f})"


def _percent(margins: Iterable[float | None]) -> str:
    return " / ".join("-" if margin is None else f"{100 * margin:.1f}" for margin in margins)


def _range(ends: Iterable[float]) -> str:
    return "{:.3f} to {:.3f}".format(*ends)


def _joined(form: str, factor: float = 1.0) -> Callable[[Iterable[float]], str]:
    """Return a function that formats several numbers of one cell."""
    return lambda values: " / ".join(format(factor * value, form) for value in values)


PAIRS = (
    Column("pair", "pair"),
    Column("teeth", "teeth", lambda teeth: "{}/{}".format(*teeth)),
    Column("centre\ndistance mm", "centre_distance_mm", ".2f"),
    Column(
        "contact ratio\nε_α    ε_β",
        lambda pair: f"{pair['transverse_contact_ratio']:.2f}   {pair['overlap_ratio']:.2f}",
    ),
    Column("torque on\ngear 1 N m", "torque_gear_1_N_m", partial(significant, digits=4, decimals=1)),
    Column("σ_H0\nMPa", "sigma_H0_MPa", ".0f"),
    Column("backlash\nµm", "backlash_um", _backlash),
    detail("working press.\nangle α_wt deg", "pressure_angle_deg", ".2f"),
    detail("SAP above root\nform dia. %", "margin_to_form_diameter", _percent),
    detail("tip thickness\ns_an/m_n", "tip_thickness_in_modules", _joined(".2f")),
    detail("held at\nmm", "held_diameter_mm", _joined("g")),
)
THICKNESSES = (
    Column("gear", "gear"),
    Column("normal tooth\nthickness mm", "normal_tooth_thickness_mm", _range),
    Column("teeth\nspanned", lambda gear: gear["span_teeth"] or None),
    Column("base tangent\nlength mm", "base_tangent_length_mm", _range),
)
FORCES = (
    Column("force", "force"),
    Column("body", "body", is_text=True),
    Column("z position\nmm", "z_mm", "g"),
    Column("force x, y, z\nkN", "force_N", _joined(".3g", 1e-3), is_text=True),
    Column("moment x, y\nN m", "moment_N_m", _joined(".4g"), is_text=True),
)


def _loaded_flanks(load: Mapping[str, Any]) -> str:
    return ", ".join(
        f"{name}{HARD_SPACE}{sign}{'!' * (name in load['reversed_flanks'])}"
        for name, sign in load["loaded_flanks"].items()
    )


LOADS = (
    Column("load case", "load_case"),
    Column("net input\ntorque N m", lambda load: significant(load["net_torque_N_m"]) + "*" * bool(load["driven"])),
    Column("final\nspeed rpm", "end_speed_rpm", partial(significant, digits=3)),
    Column("max. mesh\nfreq. kHz", "highest_mesh_frequency_Hz", ".3g", 1e-3),
    Column("max. tip\nspeed m/s", "fastest_rim_m_per_s", ".3g"),
    Column("loaded flank\nof gear 1", _loaded_flanks, is_text=True),
)


def _ends_by_estimate(bearing: Mapping[str, Any]) -> dict[str, list[float]]:
    """Radial stiffness of a bearing with each estimated input at its limits."""
    estimates = bearing["estimated"].items()
    return {key: [end for end in one["radial_stiffness_N_per_m"] if end is not None] for key, one in estimates}


def _stiffness_range(bearing: Mapping[str, Any]) -> str:
    ends = [end for pair in _ends_by_estimate(bearing).values() for end in pair]
    return " - ".join(significant(1e-9 * end, 3, 5) for end in (min(ends), max(ends))) if ends else ""


def _dominant_estimate(bearing: Mapping[str, Any]) -> str:
    ends = _ends_by_estimate(bearing)
    key = max(ends, key=lambda key: max(ends[key], default=0.0) - min(ends[key], default=0.0), default="")
    return re.sub(r"_(mm|um|deg|kN)$", "", key).replace("_", " ")


def _reaction(bearing: Mapping[str, Any]) -> str:
    key = "radial_load_kN" if bearing["reaction_kN"] is None else "reaction_kN"
    return significant(bearing[key], 3)


BEARINGS = (
    Column("bearing", "bearing"),
    Column(
        "radial\nload kN", lambda own: significant(own["radial_load_kN"], 3) + "*" * (own["reaction_kN"] is not None)
    ),
    Column("static\nreact. kN", _reaction),
    Column("axial\nload kN", "axial_load_kN", lambda load: significant(round(load, 3), 3, 2)),
    Column("radial\nstiffness\nGN/m", "radial_stiffness_N_per_m", partial(significant, digits=3, decimals=5), 1e-9),
    Column("stiffness\nrange\nGN/m", _stiffness_range),
    Column("dominant\nestimate", _dominant_estimate, is_text=True),
)


def check_tables(body: str, summary: Mapping[str, Any]) -> list[Table]:
    """Return the tables of a gearbox without errors, whose input is `body`."""
    pairs, loads, bearings = summary["pairs"], summary["load_cases"], summary["bearings"]
    band = 1e-3 * loads[0]["band_Hz"] if loads else 0.0
    legend = LOAD_LEGEND if any(load["driven"] for load in loads) else ""
    legend += REVERSED_LEGEND if any(load["reversed_flanks"] for load in loads) else ""
    stated = any(bearing["reaction_kN"] is not None for bearing in bearings)
    columns = [column for column in BEARINGS if stated or column.key != _reaction]
    title = f'Load cases (rigid kinematics, speeds of body "{body}"; stored up to {band:g} kHz)'
    return [
        Table("Gear pairs", pairs, PAIRS, PAIR_LEGEND, PAIR_DETAILS, "gear pairs"),
        Table("Tooth thickness within its allowances", summary["tooth_thickness"], THICKNESSES),
        Table("Constant forces on bodies", summary["forces"], FORCES),
        Table(title, loads, LOADS, legend.strip()),
        Table("Bearings under the static load", bearings, columns, BEARING_LEGEND + STATED_LEGEND * stated),
    ]


def availability(summary: Mapping[str, Any]) -> list[str]:
    """Return which variants and which commands are available, and why others are not."""
    lines = [
        f"Variant {variant}: {f'not available, {reason}' if reason else 'available'}"
        for variant, reason in summary["variants"].items()
    ]
    steady = summary["steady"]
    for reason in dict.fromkeys(filter(None, steady.values())):
        names = ", ".join(variant for variant in steady if steady[variant] == reason)
        lines.append(f"Steady-state response ({names}): not available, {reason}")
    for verb, reasons in summary["life"].items():
        why = f"not available: {'; '.join(reasons)}" if reasons else "available"
        lines.append(f"Command {verb}: {why}")
    return lines
