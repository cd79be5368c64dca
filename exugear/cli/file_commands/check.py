"""The verb `check`: read and check a gearbox file, and sum up what follows from it at once, or rate its gears."""

from __future__ import annotations

import math
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
    print_table,
    say,
)
from exugear.gearbox.variant import OFFERED, Variant

if TYPE_CHECKING:
    from exugear.gearbox.gearbox import Gearbox
    from exugear.system.system import Assembly


RatingOption = Annotated[
    bool,
    typer.Option(
        "--rating",
        help="Rate the gears by ISO 6336-2 and -3 instead, all factors by name, beside what the results folder has of "
        "finite elements.",
    ),
]


def check(
    case: CaseArgument,
    rating: RatingOption = False,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    as_json: JsonOption = False,
) -> None:
    """Read and check a gearbox file; sum up its gear pairs, bearings and load cases. Writes nothing."""
    with exit_codes():
        if rating:
            _rate(case, out, allow_dir, as_json)
            return
        from exugear.life.rating.lacks import lacks_of_life
        from exugear.system.readiness import lacking, remarks

        gearbox = _read(case, allow_dir, as_json)
        _tell_scripts(gearbox)
        pairs = [_pair_summary(gearbox, name) for name in gearbox.pairs]
        thicknesses = _thickness_summaries(gearbox)
        loads = _load_summaries(gearbox)
        variants = {str(variant): lacking(gearbox, variant) for variant in OFFERED}
        assemblies = _assemblies(gearbox, variants)
        steady = _steady_lacks(assemblies)
        bearings, doubts = _bearing_summaries(gearbox, assemblies.get(Variant.bushing))
        warnings = [*remarks(gearbox), *doubts]
        lives = lacks_of_life(gearbox)
        if as_json:
            summary = {"case": str(case), "name": gearbox.name, "ratio": gearbox.train.ratio, "pairs": pairs}
            summary["tooth_thickness"] = thicknesses
            summary["forces"] = _force_summaries(gearbox)
            found: dict[str, Any] = {"bearings": bearings, "load_cases": loads, "variants": variants, "steady": steady}
            found["life"] = {verb: list(reasons) for verb, reasons in lives.items()}
            found["warnings"] = warnings
            print_json({**summary, **found})
        else:
            say(f"{gearbox.name}: no fault found, ratio {gearbox.train.ratio:.6f}")
            if pairs:
                print_table("Gear pairs", [_pair_row(pair) for pair in pairs])
                print_table("Margins of gear 1 and 2", [_margin_row(pair) for pair in pairs])
                say("Pressure: by Hertz at the pitch point under torque 1, load spread evenly, without load factors")
            if thicknesses:
                print_table(
                    "Tooth thickness within its allowances", [_thickness_row(thickness) for thickness in thicknesses]
                )
                for thickness in thicknesses:
                    if thickness["span_doubt"]:
                        note(thickness["span_doubt"], style="yellow")
            if gearbox.forces:
                print_table("Constant forces on bodies", [_force_row(force) for force in _force_summaries(gearbox)])
            if loads:
                band = 1e-3 * loads[0]["band_Hz"]
                title = f"Load cases, rolling at the overall input {gearbox.case.overall.input}; runs keep {band:g} kHz"
                print_table(title, [_load_row(load) for load in loads], ("loaded flanks",))
            if bearings:
                print_table(
                    "Bearings under the static load", [_bearing_row(bearing) for bearing in bearings], ("most by",)
                )
                say("Axial loads are those of the shaft on the inner ring, positive along +z")
                if any(bearing["reaction_kN"] is not None for bearing in bearings):
                    say("* stated by the file, which the stiffness goes by")
            _tell_possibilities(variants, steady, lives)
            for line in counted([f"Warning: {line}" for line in warnings]):
                note(line, style="yellow")
        for one in loads:
            for doubt in one["doubts"]:
                note(f"load_cases.{one['load_case']}: {doubt}", style="yellow")


def _tell_possibilities(
    variants: Mapping[str, str], steady: Mapping[str, str], lives: Mapping[str, Sequence[str]]
) -> None:
    """Print which variants and which verbs are possible, and why others are not."""
    for variant, reason in variants.items():
        say(f"variant {variant}: {f'not possible, {reason}' if reason else 'possible'}")
    for reason in dict.fromkeys(filter(None, steady.values())):
        names = ", ".join(variant for variant in steady if steady[variant] == reason)
        say(f"steady response ({names}): not possible, {reason}")
    for verb, reasons in lives.items():
        for line in [f"not possible, {reason}" for reason in reasons] or ["possible"]:
            say(f"{verb}: {line}")


def _rate(case: Path, out: Path | None, allow_dir: Path | None, as_json: bool) -> None:
    """Print the rating of all gears; end with code 1 where one has less safety than is asked for."""
    from exugear.cli.rating_tables import tell_rating
    from exugear.cli.watched import WatchedProject
    from exugear.gearbox.choice import Choice
    from exugear.project import default_folder

    gearbox = read_gearbox(case, allow_dir, tell=not as_json)
    project = WatchedProject(gearbox, out or default_folder(case), Choice(Variant.bushing, "line_of_action"))
    sheet = project.rating()
    if as_json:
        print_json({"case": str(case), "name": gearbox.name, "rating": sheet.summary()})
    else:
        tell_rating(sheet)
    if sheet.shortfalls:
        raise FailedError("\n".join(["gears have less safety than is asked for:", *sheet.shortfalls]))


def _read(case: Path, allow_dir: Path | None, as_json: bool) -> Gearbox:
    """Read the file; of one with faults print these as an object, too, if that is asked for."""
    from exugear.gearbox.reading import GearboxFileError

    try:
        return read_gearbox(case, allow_dir, tell=False)
    except BadInputError as error:
        if as_json and isinstance(error.__cause__, GearboxFileError):
            print_json({"case": str(case), "errors": list(error.__cause__.faults)})
        raise


def _assemblies(gearbox: Gearbox, variants: Mapping[str, str]) -> dict[Variant, Assembly | FailedError]:
    """Assemble each variant that is possible, once: those on bearings are one as long as all bodies are rigid."""
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
    """Say of each variant why it has no steady response over speed; empty where it has one."""
    return {
        str(variant): str(assembly) if isinstance(assembly, FailedError) else steady_lack(assembly, variant)
        for variant, assembly in assemblies.items()
    }


def _tell_scripts(gearbox: Gearbox) -> None:
    """Check the solids, and say which of them only a script makes."""
    from exugear.system.bodies.of_gearbox import solids_of

    for key, model in solids_of(gearbox):
        if model.mesh.is_script:
            note(
                f"{key}.file = {model.mesh.path.name!r}: a gmsh script can run any command, so modes, run and "
                "view want --allow-scripts or EXUGEAR_ALLOW_SCRIPTS=1 for the variant flexible",
                style="yellow",
            )


def _pair_summary(gearbox: Gearbox, name: str) -> dict[str, Any]:
    from exugear.system.plausibility import backlash_range, pair_margins

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


def _pair_row(pair: dict[str, Any]) -> dict[str, str]:
    return {
        "pair": pair["pair"],
        "teeth": "{}/{}".format(*pair["teeth"]),
        "centre dist.\nmm": f"{pair['centre_distance_mm']:.3f}",
        "press. angle\ndeg": f"{pair['pressure_angle_deg']:.3f}",
        "contact ratio\n+ overlap": f"{pair['transverse_contact_ratio']:.3f} + {pair['overlap_ratio']:.3f}",
        "torque 1\nN m": f"{pair['torque_gear_1_N_m']:.1f}",
    }


def _margin_row(pair: dict[str, Any]) -> dict[str, str]:
    left = ("-" if margin is None else f"{100 * margin:.1f}" for margin in pair["margin_to_form_diameter"])
    return {
        "pair": pair["pair"],
        "pressure at pitch\npoint, MPa": f"{pair['pitch_point_pressure_MPa']:.0f}",
        "left to form circles\n% of the flanks": " / ".join(left),
        "backlash\num": _play(pair["backlash_um"]),
        "tips\nnormal modules": " / ".join(f"{tip:.2f}" for tip in pair["tip_thickness_in_modules"]),
    }


def _play(ends: list[float]) -> str:
    least, given, most = ends
    if most - least < 1.0:
        return f"{given:.0f}"
    return f"{given:.0f} ({least:.0f} to {most:.0f})"


def _thickness_summaries(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Sum up the tooth thickness of gears that have allowances of it."""
    from exugear.system.plausibility import thickness_range

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
                    "span_doubt": one.span_doubt or None,
                }
            )
    return summaries


def _force_summaries(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Sum up the constant forces on bodies."""
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
        "on": force["body"],
        "at z\nmm": f"{force['z_mm']:g}",
        "along x, y, z\nkN": " / ".join(f"{1e-3 * value:.4g}" for value in force["force_N"]),
        "about x, y\nN m": " / ".join(f"{value:.4g}" for value in force["moment_N_m"]),
    }


def _thickness_row(one: dict[str, Any]) -> dict[str, str]:
    span = one["base_tangent_length_mm"]
    return {
        "gear": one["gear"],
        "normal thickness\nmm": "{:.3f} to {:.3f}".format(*one["normal_tooth_thickness_mm"]),
        "teeth of\nthe span": str(one["span_teeth"] or "-"),
        "base tangent length\nmm": "{:.3f} to {:.3f}".format(*span) if span else "-",
    }


def _bearing_summaries(
    gearbox: Gearbox, assembly: Assembly | FailedError | None
) -> tuple[list[dict[str, Any]], list[str]]:
    """Load and stiffness of catalogue bearings, a line for those of all planets, and what is doubtful about them.

    With the mesh stiffness of ISO 6336: tables may not be there, and the static loads hardly depend on it.
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


def _bearing_row(summary: dict[str, Any]) -> dict[str, str]:
    ranges = {
        key: [end for end in one["radial_stiffness_N_per_m"] if end is not None]
        for key, one in summary["estimated"].items()
    }
    ends = [end for pair in ranges.values() for end in pair]
    spread = f"{1e-9 * min(ends):.3g} to {1e-9 * max(ends):.3g}" if ends else ""
    stated = summary["reaction_kN"] is not None
    most = max(ranges, key=lambda key: max(ranges[key], default=0.0) - min(ranges[key], default=0.0), default="")
    return {
        "bearing": summary["bearing"],
        "radial\nkN": f"{summary['radial_load_kN']:.4g}{'*' if stated else ''}",
        "statics\nkN": f"{summary['reaction_kN' if stated else 'radial_load_kN']:.4g}",
        "axial\nkN": f"{round(summary['axial_load_kN'], 3) + 0.0:.4g}",
        "radial\nGN/m": f"{1e-9 * summary['radial_stiffness_N_per_m']:.3g}",
        "over the range\nof estimates": spread,
        "most by": most,
    }


def _load_summaries(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Sum up what each load case does to the rolling train; one that no run could take is bad input."""
    from exugear.gearbox.load_cases import (
        band_warning,
        bearing_range_warning,
        doubts_about,
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
                    *doubts_about(loads),
                    *filter(None, [bearing_range_warning(gearbox, loads, Variant.bushing)]),
                    *filter(None, [other_load_warning(gearbox, loads)]),
                    *filter(None, [band_warning(loads, BAND)]),
                ],
            }
        )
    return summaries


def _load_row(summary: dict[str, Any]) -> dict[str, str]:
    turned = summary["reversed_flanks"]
    flanks = (f"{name} {sign}{'!' if name in turned else ''}" for name, sign in summary["loaded_flanks"].items())
    return {
        "load case": summary["load_case"],
        "net torque\nN m": f"{summary['net_torque_N_m']:.6g}" + (" (driven)" if summary["driven"] else ""),
        "end speed\nrpm": f"{summary['end_speed_rpm']:.4g}",
        "meshes\nkHz": f"{1e-3 * summary['highest_mesh_frequency_Hz']:.3g}",
        "rim\nm/s": f"{summary['fastest_rim_m_per_s']:.3g}",
        "loaded flanks": ", ".join(flanks),
    }
