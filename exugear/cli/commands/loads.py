"""The command `loads`: load spectra of meshes and bearings from the load sources of a gearbox."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from exugear.cli.case import CaseArgument, FilesBelowOption, JsonOption, OutOption, ScriptsOption, read_gearbox
from exugear.cli.console import (
    Bars,
    check_results_folder,
    exit_codes,
    files_read,
    make_results_folder,
    note,
    print_json,
    say,
)
from exugear.cli.tables import print_table

if TYPE_CHECKING:
    from exugear.life.load_spectrum.counted import CountedLoads

HUB_LEGEND = "Range in kN (forces) and kN m (moments), one cycle per second, by S-N exponent."


def loads(
    case: CaseArgument,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Count the loads on each mesh and bearing.

    Reads the load files of section [loads]; needs no transmission error tables. Writes load duration distributions
    (LDD) as CSV, and a picture of them.
    """
    with exit_codes():
        from exugear.life.load_spectrum.counted import count_loads, draw_duration, write_spectra
        from exugear.project import default_folder

        gearbox = read_gearbox(case, allow_dir, scripts)
        folder = (out or default_folder(case)) / "loads"
        check_results_folder(folder)
        with Bars().row() as row:
            counted = count_loads(gearbox, files_read(row))
        make_results_folder(folder)
        picture = folder / "load_duration.png"
        draw_duration(counted.distribution, counted.body, picture)
        files = [*write_spectra(counted, folder), picture]
        if as_json:
            print_json({"case": str(case), **counted.summary(), "files": [str(path) for path in files]})
            return
        sources = [_source_row(row) for row in counted.source_rows()]
        print_table(
            "Load sources", sources, ("kind",), "Skipped: at the start of each file. Torque of the loaded body."
        )
        title = f"Damage-equivalent loads on {counted.body} over {counted.life_years:g} years"
        print_table(title, _equivalent_rows(counted), legend=_equivalent_legend(counted))
        hub = [_hub_row(name, ranges) for name, ranges in counted.equivalent_ranges.items() if name != "torque"]
        if hub:
            print_table(f"Damage-equivalent rotor loads on {counted.body}", hub, legend=HUB_LEGEND)
        parts = _part_rows(counted)
        print_table("Loads on rotating parts", parts, ("mesh",), "Mesh force: per mesh, at the largest torque.")
        for line in counted.remarks:
            note(f"Warning: {line}", style="yellow")
        say(f"Results (load duration distributions): {folder}")


def _source_row(row: dict[str, Any]) -> dict[str, str]:
    return {
        "source": row["source"],
        "kind": row["kind"],
        "skipped\ns": f"{row['skipped_s']:.4g}",
        "files": str(row["files"]),
        "hours": f"{row['hours']:.6g}",
        "mean\nkN m": f"{row['mean_torque_kN_m']:.4g}",
        "minimum\nkN m": f"{row['least_torque_kN_m']:.4g}",
        "maximum\nkN m": f"{row['largest_torque_kN_m']:.4g}",
        "mean\nrpm": f"{row['mean_speed_rpm']:.4g}",
    }


def _equivalent_rows(counted: CountedLoads) -> list[dict[str, str]]:
    rows = [
        {"S-N exponent": f"{m:.4g}", "torque\nkN m": f"{1e-3 * value:.4g}", "torque range\nkN m": ""}
        for m, value in counted.equivalents().items()
    ]
    rows += [
        {"S-N exponent": f"{m:.4g}", "torque\nkN m": "", "torque range\nkN m": f"{1e-3 * value:.4g}"}
        for m, value in counted.equivalent_ranges.get("torque", {}).items()
    ]
    return rows


def _equivalent_legend(counted: CountedLoads) -> str:
    found = counted.distribution
    return (
        f"Torque: constant torque over the same {found.revolutions.sum():.4g} revolutions with the same damage; range: "
        f"one cycle per second. {len(found.hours)} bins, {found.hours.sum():.6g} h."
    )


def _hub_row(name: str, ranges: Mapping[float, float]) -> dict[str, str]:
    return {"load": name.replace("_", " "), **{f"{m:.4g}": f"{1e-3 * value:.4g}" for m, value in ranges.items()}}


def _part_rows(counted: CountedLoads) -> list[dict[str, str]]:
    return [
        {
            "part": str(row["part"]),
            "mesh": str(row["loaded_by"]),
            "load\ncycles": f"{row['cycles']:.4g}",
            "mesh\nforce kN": f"{row['force_kN']:.4g}" if math.isfinite(float(row["force_kN"])) else "",
        }
        for row in counted.part_rows()
    ]
