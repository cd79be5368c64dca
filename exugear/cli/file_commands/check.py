"""The command `check`: read and check a gearbox file and summarise it, or rate its gears."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exugear.cli.case import (
    CaseArgument,
    FilesBelowOption,
    JsonOption,
    OutOption,
    assembled_by_iso,
    read_gearbox,
    steady_lack,
)
from exugear.cli.console import (
    BadInputError,
    FailedError,
    counted,
    exit_codes,
    model_errors,
    note,
    print_json,
    say,
)
from exugear.cli.tables import HARD_SPACE, print_table, print_text, significant
from exugear.gearbox.variant import OFFERED, Variant

if TYPE_CHECKING:
    from exugear.gearbox.gearbox import Gearbox
    from exugear.system.system import Assembly


RatingOption = Annotated[
    bool,
    typer.Option(
        "--rating",
        help="Rate the gears to ISO 6336-2 and -3 instead: all factors, next to the finite element results of the "
        "results folder.",
    ),
]


def check(
    case: CaseArgument,
    rating: RatingOption = False,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check a gearbox file and summarise it. Lists gear pairs, bearings and load cases; writes no files."""
    with exit_codes():
        if rating:
            _rate(case, out, allow_dir, as_json)
            return
        from exugear.life.rating.lacks import missing_for_life
        from exugear.system.gearbox_checks import gearbox_warnings, lacking

        gearbox = _read(case, allow_dir, as_json)
        _print_scripts(gearbox)
        pairs = [_pair_summary(gearbox, name) for name in gearbox.pairs]
        thicknesses = _thickness_summaries(gearbox)
        loads = _load_summaries(gearbox)
        variants = {str(variant): lacking(gearbox, variant) for variant in OFFERED}
        assemblies = _assemblies(gearbox, variants)
        steady = _steady_lacks(assemblies)
        bearings, doubts = _bearing_summaries(gearbox, assemblies.get(Variant.bushing))
        warnings = [*gearbox_warnings(gearbox), *doubts, *_damping_warnings(assemblies)]
        lives = missing_for_life(gearbox)
        if as_json:
            summary = {"case": str(case), "name": gearbox.name, "ratio": gearbox.train.ratio, "pairs": pairs}
            summary["tooth_thickness"] = thicknesses
            summary["forces"] = _force_summaries(gearbox)
            found: dict[str, Any] = {"bearings": bearings, "load_cases": loads, "variants": variants, "steady": steady}
            found["life"] = {verb: list(reasons) for verb, reasons in lives.items()}
            found["warnings"] = warnings
            print_json({**summary, **found})
        else:
            _print_check(gearbox, pairs, thicknesses, loads, bearings)
            _print_availability(variants, steady, lives)
            for line in counted([f"Warning: {line}" for line in warnings]):
                note(line, style="yellow")
        for one in loads:
            for doubt in one["doubts"]:
                note(f"Warning: load_cases.{one['load_case']}: {doubt}", style="yellow")


def _print_check(
    gearbox: Gearbox,
    pairs: list[dict[str, Any]],
    thicknesses: list[dict[str, Any]],
    loads: list[dict[str, Any]],
    bearings: list[dict[str, Any]],
) -> None:
    """Print the tables of a gearbox without errors."""
    ratio = gearbox.train.ratio
    inverse = f" (i = {1.0 / ratio:.4g})" if ratio else ""
    print_text(f"{gearbox.name}: no errors; speed ratio output/input {ratio:.6g}{inverse}")
    if pairs:
        print_table("Gear pairs", [_pair_row(pair) for pair in pairs], legend=PAIR_LEGEND)
        print_table("Geometry checks, gear 1 / gear 2", [_margin_row(pair) for pair in pairs], legend=MARGIN_LEGEND)
    if thicknesses:
        rows = [_thickness_row(thickness) for thickness in thicknesses]
        print_table("Tooth thickness within its allowances", rows)
        for thickness in thicknesses:
            if thickness["span_doubt"]:
                note(thickness["span_doubt"], style="yellow")
    if gearbox.forces:
        rows = [_force_row(force) for force in _force_summaries(gearbox)]
        print_table("Constant forces on bodies", rows, ("body", "force x, y, z\nkN", "moment x, y\nN m"))
    if loads:
        band = 1e-3 * loads[0]["band_Hz"]
        title = (
            f'Load cases (rigid kinematics, speeds of body "{gearbox.case.overall.input}"; stored up to {band:g} kHz)'
        )
        rows = [_load_row(load) for load in loads]
        legend = ""
        if any(load["driven"] for load in loads):
            legend += LOAD_LEGEND
        if any(load["reversed_flanks"] for load in loads):
            legend += REVERSED_LEGEND
        print_table(title, rows, ("loaded flank\nof gear 1",), legend.strip())
    if bearings:
        stated = any(bearing["reaction_kN"] is not None for bearing in bearings)
        rows = [_bearing_row(bearing, stated) for bearing in bearings]
        legend = BEARING_LEGEND
        if stated:
            legend += STATED_LEGEND
        print_table("Bearings under the static load", rows, ("dominant\nestimate",), legend)


def _print_availability(
    variants: Mapping[str, str], steady: Mapping[str, str], lives: Mapping[str, Sequence[str]]
) -> None:
    """Print which variants and which commands are available, and why others are not."""
    say("")
    for variant, reason in variants.items():
        print_text(f"Variant {variant}: {f'not available, {reason}' if reason else 'available'}", "  ")
    for reason in dict.fromkeys(filter(None, steady.values())):
        names = ", ".join(variant for variant in steady if steady[variant] == reason)
        print_text(f"Steady-state response ({names}): not available, {reason}", "  ")
    for verb, reasons in lives.items():
        say(f"Command {verb}: {'not ' * bool(reasons)}available")
        for reason in reasons:
            print_text(f"- {reason}", "  ")


def _rate(case: Path, out: Path | None, allow_dir: Path | None, as_json: bool) -> None:
    """Print the rating of all gears; end with code 1 if a safety factor is below the required one."""
    from exugear.cli.rating_tables import print_rating
    from exugear.cli.watched import WatchedProject
    from exugear.gearbox.choice import Choice
    from exugear.project import default_folder

    gearbox = read_gearbox(case, allow_dir, tell=not as_json)
    project = WatchedProject(gearbox, out or default_folder(case), Choice(Variant.bushing, "line_of_action"))
    sheet = project.rating()
    if as_json:
        print_json({"case": str(case), "name": gearbox.name, "rating": sheet.summary()})
    else:
        print_rating(sheet)
    if sheet.shortfalls:
        raise FailedError("\n".join(["safety factors below the required minimum:", *sheet.shortfalls]))


def _read(case: Path, allow_dir: Path | None, as_json: bool) -> Gearbox:
    """Read the file; if it has errors and JSON is requested, print them as an object, too."""
    from exugear.gearbox.reading import GearboxFileError

    try:
        return read_gearbox(case, allow_dir, tell=False)
    except BadInputError as error:
        if as_json and isinstance(error.__cause__, GearboxFileError):
            print_json({"case": str(case), "errors": list(error.__cause__.errors)})
        raise


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


def _steady_lacks(assemblies: Mapping[Variant, Assembly | FailedError]) -> dict[str, str]:
    """Return for each variant why it has no steady-state response over speed; empty if it has one."""
    return {
        str(variant): str(assembly) if isinstance(assembly, FailedError) else steady_lack(assembly, variant)
        for variant, assembly in assemblies.items()
    }


def _damping_warnings(assemblies: Mapping[Variant, Assembly | FailedError]) -> list[str]:
    """Return warnings about modes with unusual damping, for rigid bodies with the mesh stiffness of ISO 6336-1."""
    from exugear.system.modes import modes_of, unusual_damping

    assembly = assemblies.get(Variant.bushing) or assemblies.get(Variant.rigid)
    if assembly is None or isinstance(assembly, FailedError):
        return []
    return list(filter(None, [unusual_damping(modes_of(assembly))]))


def _print_scripts(gearbox: Gearbox) -> None:
    """Check the solids, and print which of them require a script."""
    from exugear.system.bodies.of_gearbox import solids_of

    for key, model in solids_of(gearbox):
        if model.mesh.is_script:
            note(
                f"{key}.file = {model.mesh.path.name!r}: a gmsh script can run any command, so modes, run and "
                "view want --allow-scripts or EXUGEAR_ALLOW_SCRIPTS=1 for the variant flexible",
                style="yellow",
            )


def _pair_summary(gearbox: Gearbox, name: str) -> dict[str, Any]:
    from exugear.system.part_warnings import backlash_range, pair_margins

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
        "pitch_point_pressure_MPa": 1e-6 * margins.pitch_point_pressure,
        "margin_to_form_diameter": [None if math.isnan(margin) else margin for margin in margins.form],
        "tip_thickness_in_modules": list(margins.tip_thickness),
        "backlash_um": [1e6 * play for play in backlash_range(gearbox, pair)],
        "normal_backlash_um": 1e6 * pair.normal_backlash,
    }


PAIR_LEGEND = "Gear 1 is the first gear of the pair; torque: static torque of the gearbox file."
MARGIN_LEGEND = (
    "Contact stress: Hertz, at the pitch point under the static torque of gear 1, even load distribution, no load "
    "factors. SAP: start of active profile; its distance from the root form diameter in % of the profile length "
    "(roll length). Backlash: circumferential, on the working circle."
)
LOAD_LEGEND = "*: the speed of a body is prescribed (driven_body). "
REVERSED_LEGEND = "!: the flank opposite to the flank loaded by the static load."
BEARING_LEGEND = (
    "Axial load: of the shaft on the inner ring, positive along +z. Stiffness: radial; range: with the "
    "estimated (not specified) inputs at their limits; dominant estimate: the input with the largest effect."
)
STATED_LEGEND = " *: specified in the gearbox file, used for the stiffness; static react.: static balance."


def _pair_row(pair: dict[str, Any]) -> dict[str, str]:
    return {
        "pair": pair["pair"],
        "teeth": "{}/{}".format(*pair["teeth"]),
        "centre\ndistance mm": f"{pair['centre_distance_mm']:.3f}",
        "working press.\nangle α_wt deg": f"{pair['pressure_angle_deg']:.3f}",
        "contact ratio\ntransv. overlap": f"{pair['transverse_contact_ratio']:.3f}   {pair['overlap_ratio']:.3f}",
        "torque on\ngear 1 N m": f"{pair['torque_gear_1_N_m']:.1f}",
    }


def _margin_row(pair: dict[str, Any]) -> dict[str, str]:
    margins = ("-" if margin is None else f"{100 * margin:.1f}" for margin in pair["margin_to_form_diameter"])
    return {
        "pair": pair["pair"],
        "contact stress at\npitch point MPa": f"{pair['pitch_point_pressure_MPa']:.0f}",
        "SAP above root\nform dia. %": " / ".join(margins),
        "backlash\nµm": _backlash(pair["backlash_um"]),
        "tip thickness\ns_an/m_n": " / ".join(f"{tip:.2f}" for tip in pair["tip_thickness_in_modules"]),
    }


def _backlash(ends: list[float]) -> str:
    minimum, nominal, maximum = ends
    if maximum - minimum < 1.0:
        return f"{nominal:.0f}"
    return f"{nominal:.0f} ({minimum:.0f} to {maximum:.0f})"


def _thickness_summaries(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Summarise the tooth thickness of gears with allowances."""
    from exugear.system.part_warnings import thickness_range

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


def _force_summaries(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Summarise the constant forces on bodies."""
    return [
        {
            "force": force.name,
            "body": force.body,
            "z_mm": 1e3 * force.position[2],
            "force_N": list(force.wrench[:3]),
            "moment_N_m": list(force.wrench[3:]),
        }
        for force in gearbox.forces
    ]


def _force_row(force: dict[str, Any]) -> dict[str, str]:
    return {
        "force": force["force"],
        "body": force["body"],
        "z position\nmm": f"{force['z_mm']:g}",
        "force x, y, z\nkN": " / ".join(f"{1e-3 * value:.4g}" for value in force["force_N"]),
        "moment x, y\nN m": " / ".join(f"{value:.4g}" for value in force["moment_N_m"]),
    }


def _thickness_row(one: dict[str, Any]) -> dict[str, str]:
    span = one["base_tangent_length_mm"]
    return {
        "gear": one["gear"],
        "normal tooth\nthickness mm": "{:.3f} to {:.3f}".format(*one["normal_tooth_thickness_mm"]),
        "teeth\nspanned": str(one["span_teeth"] or "-"),
        "base tangent\nlength mm": "{:.3f} to {:.3f}".format(*span) if span else "-",
    }


def _bearing_summaries(
    gearbox: Gearbox, assembly: Assembly | FailedError | None
) -> tuple[list[dict[str, Any]], list[str]]:
    """Summarise load and stiffness of catalogue bearings, one row for those of all planets, and return their warnings.

    The mesh stiffness is that of ISO 6336, because tables may not exist and the static loads barely depend on it.
    """
    from exugear.results.folder import duty_summary
    from exugear.system.bearings.duty import estimate_effects
    from exugear.system.operating_points import bearing_duties, bearing_points

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
    doubts = [f"bearings.{duty.name}: {remark}" for duty in every for remark in duty.remarks]
    return summaries, doubts


def _bearing_row(summary: dict[str, Any], with_reaction: bool) -> dict[str, str]:
    ranges = {
        key: [end for end in one["radial_stiffness_N_per_m"] if end is not None]
        for key, one in summary["estimated"].items()
    }
    ends = [end for pair in ranges.values() for end in pair]
    spread = f"{significant(1e-9 * min(ends), 3, 5)} - {significant(1e-9 * max(ends), 3, 5)}" if ends else ""
    stated = summary["reaction_kN"] is not None
    dominant = max(ranges, key=lambda key: max(ranges[key], default=0.0) - min(ranges[key], default=0.0), default="")
    reaction = {"static\nreact. kN": significant(summary["reaction_kN" if stated else "radial_load_kN"])}
    return {
        "bearing": summary["bearing"],
        "radial\nload kN": significant(summary["radial_load_kN"]) + ("*" if stated else ""),
        **(reaction if with_reaction else {}),
        "axial\nload kN": significant(round(summary["axial_load_kN"], 3)),
        "stiffness\nGN/m": significant(1e-9 * summary["radial_stiffness_N_per_m"], 3, 5),
        "range\nGN/m": spread,
        "dominant\nestimate": re.sub(r"_(mm|um|deg|kN)$", "", dominant).replace("_", " "),
    }


def _load_summaries(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Summarise each load case on the kinematic gear train; a load case that no run could use is bad input."""
    from exugear.gearbox.load_cases import (
        band_warning,
        bearing_range_warning,
        load_warnings,
        other_load_warning,
        summarise_loads,
    )
    from exugear.gearbox.units import RPM
    from exugear.transient.plan import check_duration
    from exugear.transient.runup import BAND

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
                "doubts": [
                    *load_warnings(loads),
                    *filter(None, [bearing_range_warning(gearbox, loads, Variant.bushing)]),
                    *filter(None, [other_load_warning(gearbox, loads)]),
                    *filter(None, [band_warning(loads, BAND)]),
                ],
            }
        )
    return summaries


def _load_row(summary: dict[str, Any]) -> dict[str, str]:
    reverse = summary["reversed_flanks"]
    flanks = (
        f"{name}{HARD_SPACE}{sign}{'!' if name in reverse else ''}" for name, sign in summary["loaded_flanks"].items()
    )
    return {
        "load case": summary["load_case"],
        "net input\ntorque N m": significant(summary["net_torque_N_m"]) + ("*" if summary["driven"] else ""),
        "final\nspeed rpm": f"{summary['end_speed_rpm']:.4g}",
        "max. mesh\nfreq. kHz": f"{1e-3 * summary['highest_mesh_frequency_Hz']:.3g}",
        "max. tip\nspeed m/s": f"{summary['fastest_rim_m_per_s']:.3g}",
        "loaded flank\nof gear 1": ", ".join(flanks),
    }
