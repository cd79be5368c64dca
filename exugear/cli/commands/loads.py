"""The verb `loads`: what a gearbox sees of its sources of loads, counted."""

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
    print_table,
    say,
)

if TYPE_CHECKING:
    from exugear.life.load_spectrum.counted import CountedLoads


def loads(
    case: CaseArgument,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Read the files that section ``loads`` names, and tell what each mesh and bearing sees of them.

    No tables are needed. Writes load duration distributions as CSV, and a picture of them.
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
        print_table("Sources of loads", [_source_row(row) for row in counted.source_rows()])
        title = f"Equivalent loads on {counted.body} over {counted.life_years:g} years: torque in as many revolutions,"
        print_table(f"{title} range of torque once a second", _equivalent_rows(counted))
        hub = [_hub_row(name, ranges) for name, ranges in counted.equivalent_ranges.items() if name != "torque"]
        if hub:
            print_table(f"Loads of the hub on {counted.body}: range once a second by slope, kN and kN m", hub)
        print_table("What turns through its load", _part_rows(counted))
        for line in counted.remarks:
            note(line, style="yellow")
        say(f"Load duration distributions in {folder}")


def _source_row(row: dict[str, Any]) -> dict[str, str]:
    return {
        "source": row["source"],
        "kind": row["kind"],
        "skipped\ns": f"{row['skipped_s']:.4g}",
        "files": str(row["files"]),
        "hours": f"{row['hours']:.6g}",
        "mean\nkN m": f"{row['mean_torque_kN_m']:.4g}",
        "least\nkN m": f"{row['least_torque_kN_m']:.4g}",
        "largest\nkN m": f"{row['largest_torque_kN_m']:.4g}",
        "mean\nrpm": f"{row['mean_speed_rpm']:.4g}",
    }


def _equivalent_rows(counted: CountedLoads) -> list[dict[str, str]]:
    distribution = counted.distribution
    rows = [
        {"by damage with the slope": f"{m:.4g}", "torque\nkN m": f"{1e-3 * value:.4g}", "range\nkN m": ""}
        for m, value in counted.equivalents().items()
    ]
    rows += [
        {"by damage with the slope": f"{m:.4g}", "torque\nkN m": "", "range\nkN m": f"{1e-3 * value:.4g}"}
        for m, value in counted.equivalent_ranges.get("torque", {}).items()
    ]
    say(
        f"{len(distribution.hours)} bins, {distribution.hours.sum():.6g} h, "
        f"{distribution.revolutions.sum():.4g} revolutions"
    )
    return rows


def _hub_row(name: str, ranges: Mapping[float, float]) -> dict[str, str]:
    return {"load": name.replace("_", " "), **{f"{m:.4g}": f"{1e-3 * value:.4g}" for m, value in ranges.items()}}


def _part_rows(counted: CountedLoads) -> list[dict[str, str]]:
    return [
        {
            "part": str(row["part"]),
            "loaded by": str(row["loaded_by"]),
            "cycles": f"{row['cycles']:.4g}",
            "at the largest\ntorque kN": f"{row['force_kN']:.4g}" if math.isfinite(float(row["force_kN"])) else "",
        }
        for row in counted.part_rows()
    ]
