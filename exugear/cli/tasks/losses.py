"""The command `losses`: friction of teeth and bearings at an operating point, efficiency, and oil temperature."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

from exugear.cli.case import assembled_by_iso
from exugear.cli.console import BadInputError, FailedError
from exugear.cli.tables import Column, Outcome, Table, detail, significant
from exugear.cli.watched import WatchedProject
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import static_load_in_words
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.life.losses import Losses, losses_of, operating_speed
from exugear.life.power_flow import SelfLockingError
from exugear.project import Project
from exugear.results.findings import Finding
from exugear.system.gearbox_checks import lacking
from exugear.system.operating_points import bearing_duties
from fe_ste.transmission_error.table import MeshTable

LEGEND = "Band: by several methods of friction. Without churning and windage."
DETAILS = (
    "P, C: equivalent dynamic load and basic dynamic load rating. H_V: gear loss factor, from the line loads of the "
    "table (*) or in closed form. µ_m: mean coefficient of friction by Schlenk; band: also by Niemann and Winter and, "
    "with a table, by Xu and Kahraman. Series: the one whose constants SKF's frictional moment takes, otherwise the "
    "mean and the band of all series of the type."
)
NOT_INCLUDED = (
    "Not included: churning, windage, pumps, and seals without a table [seals.NAME]. They matter most at low torque "
    "and high speed, where the efficiency is overestimated."
)
SHARES = (0.1, 0.25, 0.5, 0.75, 1.0)
"""Shares of speed and of torque of the efficiency map."""
FASTEST = 1e6
"""Highest speed, rpm."""


def losses(project: WatchedProject, speed: float | None, efficiency_map: bool, as_json: bool, whole: bool) -> None:
    """Compute and print the losses of a project."""
    gearbox = project.gearbox
    if speed is not None and not 0.0 < abs(speed) <= FASTEST:
        raise BadInputError(f"--speed {speed:g}: must be a number of rpm up to {FASTEST:g}, not 0")
    chosen = operating_speed(gearbox, speed)
    tables = project.tables_at_work()
    try:
        found = losses_of(gearbox, _duties(gearbox), tables, chosen)
    except SelfLockingError as error:
        raise FailedError(f"{static_load_in_words(gearbox)} at {significant(chosen / RPM)} rpm: {error}") from None
    summary = {"case": gearbox.source, **summarise(found), "map": []}
    if efficiency_map:
        summary["map"] = _mapped(project, tables, chosen)
    losses = f"{_kilowatts(summary['losses_W'])} kW"
    if summary["losses_band_W"][0] < summary["losses_band_W"][1]:
        losses += f" ({_band(summary['losses_band_W'], 3)})"
    Outcome(
        verdict=(
            f"Efficiency {100.0 * summary['efficiency']:.1f} %: input {_kilowatts(summary['input_power_W'])} kW, "
            f"losses {losses}, oil {summary['oil_temperature_C']:.0f} °C"
        ),
        summary=summary,
        tables=_tables(static_load_in_words(gearbox), summary),
        findings=[*_findings(summary), *_driven_backwards(gearbox, chosen)],
        remarks=[NOT_INCLUDED],
    ).show(as_json, whole)


def _driven_backwards(gearbox: Gearbox, speed: float) -> Iterator[Finding]:
    """Yield a warning if the input takes power: the rated speed has no sign and may belong to the other sense."""
    source = gearbox.case.overall.input
    torque = gearbox.case.static_load.torques_N_m.get(source, 0.0)
    if torque * speed < 0.0:
        yield Finding(
            "warning",
            f"torque and speed of {source} have opposite signs: it takes power instead of supplying it; if the gearbox "
            f"turns in the other sense, use --speed {significant(-speed / RPM)}",
        )


def _duties(gearbox: Gearbox) -> Any:
    """Return the loads of catalogue bearings, with the tooth stiffness of ISO 6336-1; none without bearings."""
    if not gearbox.bearings or lacking(gearbox, Variant.bushing):
        return ()
    return bearing_duties(assembled_by_iso(gearbox, Variant.bushing))


def _mapped(project: Project, tables: dict[str, MeshTable], speed: float) -> list[dict[str, float]]:
    """Efficiency and losses over shares of speed and torque; only the shares where the train locks itself."""
    torques = project.gearbox.case.static_load.torques_N_m
    rows = []
    for torque in SHARES:
        scaled = {body: torque * value for body, value in torques.items()}
        gearbox = project.gearbox.varied({"static_load.torques_N_m": scaled})
        duties = _duties(gearbox)
        for share in SHARES:
            row = {"torque_share": torque, "speed_share": share}
            with suppress(SelfLockingError):
                own = losses_of(gearbox, duties, tables, share * speed)
                row |= {
                    "input_power_W": own.input_power,
                    "losses_W": own.total,
                    "efficiency": own.efficiency,
                    "oil_temperature_C": own.oil_temperature,
                }
            rows.append(row)
    return rows


def summarise(found: Losses) -> dict[str, Any]:
    """Summarise losses, with units in the keys."""
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
            {"name": seal.name, "diameter_mm": 1e3 * seal.diameter, "speed_rpm": seal.speed / RPM, "loss_W": seal.loss}
            for seal in found.seals
        ],
    }


def _kilowatts(power: float) -> str:
    return significant(1e-3 * power, 3)


def _band(band: Sequence[float], digits: int = 2) -> str:
    """Return the band of powers (W) in kW; a dash where one method alone is known."""
    low, high = band
    if low == high:
        return "–"
    return f"{significant(1e-3 * low, digits)}–{significant(1e-3 * high, digits)}"


def _loss_factor(part: Mapping[str, Any]) -> str | None:
    return f"{part['loss_factor']:.3f}" + "*" * part["from_table"] if "loss_factor" in part else None


_column, _detail = partial(Column, missing=""), partial(detail, missing="")
PARTS = (
    Column(
        "part",
        lambda part: (
            f"seal {part['name']}" if "name" in part else f"{part['count']} × {part['family']}".removeprefix("1 × ")
        ),
    ),
    _column("power\nkW", "power_W", _kilowatts),
    _column("P/C", "load_ratio", ".2g"),
    _column("speed\nrpm", "speed_rpm", partial(significant, digits=3)),
    Column("loss\nkW", "loss_W", _kilowatts),
    _column("loss\nband kW", "loss_band_W", _band),
    _detail("H_V", _loss_factor),
    _detail("µ_m", "friction", ".3f"),
    _detail("P\nkN", "equivalent_load_N", partial(significant, digits=3), 1e-3),
    _detail("series", "series"),
    _detail("diameter\nmm", "diameter_mm", "g"),
)


def _tables(load: str, summary: Mapping[str, Any]) -> list[Table]:
    """Return the efficiency map if there is one, and the losses of all parts."""
    title = f"Losses at {significant(summary['speed_rpm'], 3)} rpm, {load}"
    parts = [*summary["meshes"], *summary["bearings"], *summary["seals"]]
    parts.sort(key=lambda part: -part["loss_W"])
    tables = [Table(title, parts, PARTS, LEGEND, DETAILS, "parts")]
    if summary["map"]:
        efficiency = {
            (point["speed_share"], point["torque_share"]): point.get("efficiency") for point in summary["map"]
        }
        rows = [{"torque": torque, **{str(speed): efficiency[speed, torque] for speed in SHARES}} for torque in SHARES]
        columns = [Column(f"{100 * speed:g} %\nspeed", str(speed), ".1f", 100.0) for speed in SHARES]
        torques = Column("torque", lambda row: f"{100 * row['torque']:g} %")
        tables.insert(0, Table("Efficiency, %", rows, [torques, *columns]))
    return tables


def _findings(summary: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield what is assumed or not included."""
    if summary["output_power_W"] == 0.0:
        yield Finding("warning", "the losses exceed the power of the static load: every loaded body has to be driven")
    if summary["bearings_without_data"]:
        names = ", ".join(summary["bearings_without_data"])
        yield Finding("warning", f"no friction of bearings whose catalogue data or loads are not known: {names}")
    if unknown := [bearing["family"] for bearing in summary["bearings"] if not bearing["series"]]:
        text = f"unknown series of the bearings {', '.join(unknown)}: their friction is that of all series of the "
        yield Finding("warning", f"{text}type; set catalogue.designation or catalogue.series")
    if summary["assumed_roughness"]:
        text = "roughness Ra 0.5 µm is assumed for gears without roughness_Ra_um or roughness_Rz_um in [rating.gears]"
        yield Finding("warning", text)
    if not any(mesh["from_table"] for mesh in summary["meshes"]):
        yield Finding("note", "exugear ste computes the tables from which H_V follows")
