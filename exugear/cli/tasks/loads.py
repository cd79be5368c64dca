"""The command `loads`: load spectra of meshes and bearings from the load sources of a gearbox."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from exugear.cli.bars import Bars, files_read
from exugear.cli.console import check_results_folder, make_results_folder, print_json, say, warn
from exugear.cli.tables import Column, print_table
from exugear.gearbox.gearbox import Gearbox
from exugear.life.load_spectrum.counted import count_loads, draw_duration, write_spectra
from exugear.project import default_folder

SOURCE_LEGEND = "Skipped: at the start of each file. Torque of the loaded body."
HUB_LEGEND = "Range in kN (forces) and kN m (moments), one cycle per second, by S-N exponent."


def loads(gearbox: Gearbox, out: Path | None, as_json: bool) -> None:
    """Count, store and print the loads of a gearbox."""
    folder = (out or default_folder(gearbox.source)) / "loads"
    check_results_folder(folder)
    with Bars().row() as row:
        counted = count_loads(gearbox, files_read(row))
    make_results_folder(folder)
    picture = folder / "load_duration.png"
    draw_duration(counted.distribution, counted.body, picture)
    files = [*write_spectra(counted, folder), picture]
    summary = {"case": gearbox.source, **counted.summary(), "files": [str(path) for path in files]}
    if as_json:
        print_json(summary)
        return
    print_loads(summary, len(counted.distribution.hours))
    for line in summary["remarks"]:
        warn(line)
    say(f"Results (load duration distributions): {folder}")


SOURCES = (
    Column("source", "source"),
    Column("kind", "kind", is_text=True),
    Column("skipped\ns", "skipped_s", ".4g"),
    Column("files", "files"),
    Column("hours", "hours", ".6g"),
    Column("mean\nkN m", "mean_torque_kN_m", ".4g"),
    Column("minimum\nkN m", "least_torque_kN_m", ".4g"),
    Column("maximum\nkN m", "largest_torque_kN_m", ".4g"),
    Column("mean\nrpm", "mean_speed_rpm", ".4g"),
)
EQUIVALENTS = (
    Column("S-N exponent", "exponent"),
    Column("torque\nkN m", "torque", ".4g", missing=""),
    Column("torque range\nkN m", "range", ".4g", missing=""),
)
PARTS = (
    Column("part", "part"),
    Column("mesh", "loaded_by", missing="", is_text=True),
    Column("load\ncycles", "cycles", ".4g"),
    Column("mesh\nforce kN", "force_kN", ".4g", missing=""),
)


def print_loads(summary: Mapping[str, Any], bins: int) -> None:
    """Print the tables of sources, equivalent loads and loaded parts."""
    print_table("Load sources", summary["sources"], SOURCES, SOURCE_LEGEND)
    title = f"Damage-equivalent loads on {summary['body']} over {summary['life_years']:g} years"
    torques = [{"exponent": m, "torque": value} for m, value in summary["equivalent_torque_kN_m"].items()]
    ranges = [{"exponent": m, "range": value} for m, value in summary["equivalent_range_1_Hz_kN_m"].items()]
    legend = (
        f"Torque: constant torque over the same {summary['revolutions']:.4g} revolutions with the same damage; range: "
        f"one cycle per second. {bins} bins, {summary['hours']:.6g} h."
    )
    print_table(title, [*torques, *ranges], EQUIVALENTS, legend)
    hub = [
        {"load": re.sub("_kN(_m)?$", "", name).replace("_", " "), **by_exponent}
        for name, by_exponent in summary["hub_equivalent_range_1_Hz"].items()
    ]
    if hub:
        columns = [Column("load", "load"), *(Column(m, m, ".4g") for m in hub[0] if m != "load")]
        print_table(f"Damage-equivalent rotor loads on {summary['body']}", hub, columns, HUB_LEGEND)
    print_table("Loads on rotating parts", summary["parts"], PARTS, "Mesh force: per mesh, at the largest torque.")
