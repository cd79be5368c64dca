"""The command `loads`: load spectra of meshes and bearings from the load sources of a gearbox."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from exugear.cli.bars import Bars, files_read
from exugear.cli.console import check_results_folder, make_results_folder
from exugear.cli.tables import Column, Outcome, Table, detail, significant
from exugear.gearbox.gearbox import Gearbox
from exugear.life.load_spectrum.counted import count_loads, draw_duration, write_spectra
from exugear.project import results_folder
from exugear.results.findings import Finding
from fe_ste.tools.display import torque_unit

HUB_LEGEND = "Range in kN (forces) and kN m (moments), one cycle per second, by S-N exponent."


def loads(gearbox: Gearbox, out: Path | None, as_json: bool, whole: bool) -> None:
    """Count, store and print the loads of a gearbox."""
    folder = results_folder(gearbox.source, out) / "loads"
    check_results_folder(folder)
    with Bars().row() as row:
        counted = count_loads(gearbox, files_read(row))
    make_results_folder(folder)
    picture = folder / "load_duration.png"
    draw_duration(counted.distribution, counted.body, picture)
    files = [*write_spectra(counted, folder), picture]
    summary = {"case": gearbox.source, **counted.summary(), "files": [str(path) for path in files]}
    exponent, torque = max(summary["equivalent_torque_kN_m"].items(), key=lambda own: float(own[0]))
    largest = max(source["largest_torque_kN_m"] for source in summary["sources"])
    unit, factor = _torque_unit(summary)
    Outcome(
        verdict=(
            f"Torque on {summary['body']}: equivalent {_three(factor * torque)} {unit} (m = {exponent}), "
            f"largest {_three(factor * largest)} {unit}, {summary['hours']:,.0f} h"
        ),
        summary=summary,
        tables=load_tables(summary, len(counted.distribution.hours)),
        findings=[Finding("warning", line) for line in summary["remarks"]],
        path=folder,
    ).show(as_json, whole)


_three = partial(significant, digits=3)


def _torque_unit(summary: Mapping[str, Any]) -> tuple[str, float]:
    """Return the unit of all torques of a summary, and the factor from kN m to it."""
    unit, factor = torque_unit(1e3 * max(abs(source["largest_torque_kN_m"]) for source in summary["sources"]))
    return unit, 1e3 * factor


def _source_columns(unit: str, factor: float) -> tuple[Column, ...]:
    return (
        Column("source", "source"),
        Column("kind", "kind", is_text=True),
        Column("hours", "hours", ".0f"),
        Column(f"mean\ntorque\n{unit}", "mean_torque_kN_m", _three, factor),
        Column(f"minimum\ntorque\n{unit}", "least_torque_kN_m", _three, factor),
        Column(f"maximum\ntorque\n{unit}", "largest_torque_kN_m", _three, factor),
        Column("mean\nspeed\nrpm", "mean_speed_rpm", _three),
        detail("skipped at\nstart, s", "skipped_s", ".4g"),
        detail("files", "files"),
    )


PARTS = (
    Column("part", "part"),
    Column("mesh", "loaded_by", missing="", is_text=True),
    Column("load\ncycles", "cycles", ".3g"),
    Column("mesh\nforce kN", "force_kN", _three, missing=""),
)


def load_tables(summary: Mapping[str, Any], bins: int) -> list[Table]:
    """Return the tables of sources, equivalent loads and loaded parts."""
    years = f"on {summary['body']} over {summary['life_years']:g} years"
    torques = [{"exponent": m, "torque": value} for m, value in summary["equivalent_torque_kN_m"].items()]
    ranges = [{"exponent": m, "range": value} for m, value in summary["equivalent_range_1_Hz_kN_m"].items()]
    legend = (
        f"Torque: constant torque over the same {summary['revolutions']:.3g} revolutions with the same damage; range: "
        f"one cycle per second. {bins} bin{'s' * (bins != 1)}, {summary['hours']:,.0f} h."
    )
    hub = [
        {"load": re.sub("_kN(_m)?$", "", name).replace("_", " "), **by_exponent}
        for name, by_exponent in summary["hub_equivalent_range_1_Hz"].items()
    ]
    columns = [Column("load", "load"), *(Column(m, m, _three) for m in (hub[0] if hub else ()) if m != "load")]
    unit, factor = _torque_unit(summary)
    equivalents = [
        Column("S-N exponent", "exponent"),
        Column(f"torque\n{unit}", "torque", _three, factor, missing=""),
        Column(f"torque range\n{unit}", "range", _three, factor, missing=""),
    ]
    return [
        Table("Load sources", summary["sources"], _source_columns(unit, factor), noun="sources"),
        Table(f"Damage-equivalent loads {years}", [*torques, *ranges], equivalents, legend),
        Table(f"Damage-equivalent rotor loads {years}", hub, columns, HUB_LEGEND),
        Table("Loads on rotating parts", summary["parts"], PARTS, "Mesh force: per mesh, at the largest torque."),
    ]
