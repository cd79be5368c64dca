"""The command `losses`: friction of teeth and bearings at an operating point, efficiency, and oil temperature."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from exugear.cli.case import (
    CaseArgument,
    FilesBelowOption,
    JsonOption,
    OutOption,
    assembled_by_iso,
    open_project,
)
from exugear.cli.console import BadInputError, exit_codes, note, print_json, say
from exugear.cli.tables import print_table, print_text, significant
from exugear.gearbox.variant import Variant

if TYPE_CHECKING:
    from exugear.gearbox.gearbox import Gearbox
    from exugear.life.losses import BearingLoss, Losses, MeshLoss, SealLoss
    from exugear.project import Project
    from fe_ste.transmission_error.table import MeshTable

MESH_LEGEND = (
    "H_V: gear loss factor, from the line loads of the table (*) or in closed form. mu_m: mean coefficient of friction "
    "by Schlenk. Band: also by Niemann and Winter and, with a table, by Xu and Kahraman."
)
BEARING_LEGEND = (
    "P: equivalent dynamic load; C: basic dynamic load rating; series: the one whose constants SKF's frictional moment "
    "takes, otherwise the mean and the band of all series of the type."
)
SHARES = (0.1, 0.25, 0.5, 0.75, 1.0)
"""Shares of speed and of torque of the efficiency map."""
FASTEST = 1e6
"""Highest speed, rpm."""


def losses(
    case: CaseArgument,
    speed: Annotated[
        float | None,
        typer.Option(
            metavar="RPM",
            help="Input speed. (default: rated, or of a load case)",
            show_default=False,
        ),
    ] = None,
    load_case: Annotated[
        str | None,
        typer.Option(
            "--load-case",
            metavar="NAME",
            help="Losses at the torques of a load case. (default: static load)",
            show_default=False,
        ),
    ] = None,
    efficiency_map: Annotated[
        bool, typer.Option("--map", help="Also compute the efficiency over speed and torque.")
    ] = False,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute losses of meshes, bearings and seals, and the efficiency.

    Uses the line loads of transmission error tables in the results folder. Churning and windage are not included.
    Writes no files.
    """
    with exit_codes():
        from exugear.life.losses import losses_of, operating_speed

        project = open_project(case, out, allow_dir, scripts=False, variant=Variant.rigid)
        if load_case is not None:
            project = project.at_load_case(load_case)
        if speed is not None and not 0.0 < abs(speed) <= FASTEST:
            raise BadInputError(f"--speed {speed:g}: must be a number of rpm up to {FASTEST:g}, not 0")
        chosen = operating_speed(project.gearbox, speed)
        tables = project.tables_at_work()
        found = losses_of(project.gearbox, _duties(project.gearbox), tables, chosen)
        mapped = []
        if efficiency_map:
            mapped = _mapped(project, tables, chosen)
        if as_json:
            print_json({"case": str(case), **_summary(found), "map": mapped})
        else:
            _print(project.gearbox, found, mapped)


def _duties(gearbox: Gearbox) -> Any:
    """Return the loads of catalogue bearings, with the tooth stiffness of ISO 6336-1; none without bearings."""
    from exugear.system.gearbox_checks import lacking
    from exugear.system.operating_points import bearing_duties

    if not gearbox.bearings or lacking(gearbox, Variant.bushing):
        return ()
    return bearing_duties(assembled_by_iso(gearbox, Variant.bushing))


def _mapped(project: Project, tables: dict[str, MeshTable], speed: float) -> list[dict[str, float]]:
    """Efficiency and losses over shares of the speed and of the torques."""
    from exugear.life.losses import losses_of

    torques = project.gearbox.case.static_load.torques_N_m
    rows = []
    for torque in SHARES:
        scaled = {body: torque * value for body, value in torques.items()}
        gearbox = project.gearbox.varied({"static_load.torques_N_m": scaled})
        duties = _duties(gearbox)
        for share in SHARES:
            own = losses_of(gearbox, duties, tables, share * speed)
            rows.append(
                {
                    "torque_share": torque,
                    "speed_share": share,
                    "input_power_W": own.input_power,
                    "losses_W": own.total,
                    "efficiency": own.efficiency,
                    "oil_temperature_C": own.oil_temperature,
                }
            )
    return rows


def _summary(found: Losses) -> dict[str, Any]:
    from exugear.gearbox.units import RPM

    return {
        "speed_rpm": found.speed / RPM,
        "input_power_W": found.input_power,
        "output_power_W": found.output_power,
        "losses_W": found.total,
        "losses_band_W": list(found.band),
        "efficiency": found.efficiency,
        "oil_temperature_C": found.oil_temperature,
        "viscosity_mm2_per_s": 1e6 * found.viscosity,
        "assumed_roughness": found.assumed_roughness,
        "bearings_without_data": list(found.without_data),
        "meshes": [
            {
                "family": mesh.family,
                "count": mesh.count,
                "power_W": mesh.power,
                "loss_factor": mesh.loss_factor,
                "from_table": mesh.from_table,
                "friction": mesh.friction,
                **{f"friction_{method}": value for method, value in mesh.other_friction.items()},
                "loss_W": mesh.loss,
                "loss_band_W": list(mesh.band),
            }
            for mesh in found.meshes
        ],
        "bearings": [
            {
                "family": bearing.family,
                "count": bearing.count,
                "equivalent_load_N": bearing.load,
                "load_ratio": bearing.load_ratio,
                "speed_rpm": bearing.speed / RPM,
                "series": bearing.series,
                "loss_W": bearing.loss,
                "loss_band_W": list(bearing.band),
            }
            for bearing in found.bearings
        ],
        "seals": [
            {
                "name": seal.name,
                "diameter_mm": 1e3 * seal.diameter,
                "speed_rpm": seal.speed / RPM,
                "loss_W": seal.loss,
            }
            for seal in found.seals
        ],
    }


def _print(gearbox: Gearbox, found: Losses, mapped: list[dict[str, float]]) -> None:
    from exugear.gearbox.load_cases import static_load_in_words
    from exugear.gearbox.units import RPM

    title = f"Losses at {significant(found.speed / RPM)} rpm, {static_load_in_words(gearbox)}"
    print_table(f"{title}: meshes", [_mesh_row(mesh) for mesh in found.meshes], legend=MESH_LEGEND)
    if found.bearings:
        print_table("Bearings", [_bearing_row(bearing) for bearing in found.bearings], legend=BEARING_LEGEND)
    if found.seals:
        print_table("Seals", [_seal_row(seal) for seal in found.seals])
    losses = f"{_kilowatts(found.total)} kW"
    if found.band[0] < found.band[1]:
        losses += f" (band {_band(*found.band, 4)})"
    print_text(
        f"Input {_kilowatts(found.input_power)} kW, losses {losses}, output {_kilowatts(found.output_power)} kW: "
        f"efficiency {100.0 * found.efficiency:.2f} %. Oil {found.oil_temperature:.3g} °C, "
        f"{significant(1e6 * found.viscosity, 3)} mm²/s."
    )
    print_text(
        "Not included: churning, windage, pumps, and seals without a table [seals.NAME]. They matter most at low "
        "torque and high speed, where the efficiency is overestimated."
    )
    if found.assumed_roughness:
        note("Roughness Ra 0.5 µm is assumed for gears without roughness_Ra_um or roughness_Rz_um in [rating.gears]")
    if found.without_data:
        note(f"Warning: no friction of bearings without a catalogue: {', '.join(found.without_data)}", style="yellow")
    unknown = [bearing.family for bearing in found.bearings if not bearing.series]
    if unknown:
        note(
            f"Unknown series of the bearings {', '.join(unknown)}: their friction is that of all series of the type; "
            "set catalogue.designation or catalogue.series"
        )
    if mapped:
        rows = []
        for torque in SHARES:
            own = [row for row in mapped if row["torque_share"] == torque]
            cells = {f"{100 * row['speed_share']:g} %\nspeed": f"{100.0 * row['efficiency']:.2f}" for row in own}
            rows.append({"torque": f"{100 * torque:g} %", **cells})
        print_table("Efficiency, %", rows)
    if not any(mesh.from_table for mesh in found.meshes):
        say("exugear ste computes the tables from which H_V follows.")


def _kilowatts(power: float) -> str:
    return significant(1e-3 * power, 4, 4)


def _band(low: float, high: float, digits: int) -> str:
    """Return the band of powers (W) in kW; a dash where one method alone is known."""
    if low == high:
        return "–"
    return f"{significant(1e-3 * low, digits, 4)}–{significant(1e-3 * high, digits, 4)}"


def _mesh_row(mesh: MeshLoss) -> dict[str, str]:
    low, high = mesh.band
    return {
        "meshes": f"{mesh.count} x {mesh.family}".removeprefix("1 x "),
        "power\nkW": _kilowatts(mesh.power),
        "H_V": f"{mesh.loss_factor:.4f}" + "*" * mesh.from_table,
        "mu_m": f"{mesh.friction:.4f}",
        "loss\nkW": _kilowatts(mesh.loss),
        "band\nkW": _band(low, high, 2),
    }


def _bearing_row(bearing: BearingLoss) -> dict[str, str]:
    from exugear.gearbox.units import RPM

    return {
        "bearings": f"{bearing.count} x {bearing.family}".removeprefix("1 x "),
        "P\nkN": significant(1e-3 * bearing.load, 3),
        "P/C": f"{bearing.load_ratio:.2g}",
        "speed\nrpm": significant(bearing.speed / RPM),
        "series": bearing.series or "–",
        "loss\nkW": _kilowatts(bearing.loss),
        "band\nkW": _band(*bearing.band, 2),
    }


def _seal_row(seal: SealLoss) -> dict[str, str]:
    from exugear.gearbox.units import RPM

    return {
        "seals": seal.name,
        "diameter\nmm": significant(1e3 * seal.diameter),
        "speed\nrpm": significant(seal.speed / RPM),
        "loss\nkW": _kilowatts(seal.loss),
    }
