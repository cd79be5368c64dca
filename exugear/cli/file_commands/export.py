"""The command `export`: write results into a copy of the imported industry file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.console import BadInputError, exit_codes, note, print_json, say

SHOWN = 10
"""Maximum number of replaced attributes that are printed."""


def export(
    case: options.CaseArgument,
    rexs: Annotated[
        Path,
        typer.Argument(
            metavar="FILE.rexs", help="REXS file that the gearbox file was imported from.", show_default=False
        ),
    ],
    to: Annotated[
        Path | None,
        typer.Option("--to", metavar="FILE", help="File to write. (default: NAME-exugear, same folder as FILE.rexs)"),
    ] = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    shifts: options.ShiftsOption = options.ShiftRule.file,
    distances: options.DistancesOption = options.DistanceRule.agreeing,
    as_json: options.JsonOption = False,
) -> None:
    """Write results into a copy of a REXS file. They are REXS attributes where possible, else custom_exugear ones.

    Geometry and static forces are always written; tables, modes, bearings and runs if the results folder has them. Use
    --shifts and --distances of the import.
    """
    with exit_codes():
        from exugear.cli.case import read_gearbox
        from exugear.exchange.rexs.export.export import with_results
        from exugear.exchange.rexs.to_case.notes import Rules
        from exugear.exchange.rexs.tree import RexsError
        from exugear.project import default_folder
        from fe_ste.tools.files import write_file

        target = to or rexs.with_name(_new_name(rexs.name))
        if target.exists():
            raise BadInputError(f"{target}: exists already; specify another file with --to")
        gearbox = read_gearbox(case, allow_dir)
        try:
            exported = with_results(gearbox, out or default_folder(case), rexs, Rules(shifts.value, distances.value))
        except RexsError as error:
            raise BadInputError(error) from error
        write_file(target, exported.content)
        if as_json:
            counts = {"attributes": exported.named, "custom_attributes": exported.own}
            lists = {"replaced": list(exported.replaced), "left_out": list(exported.left_out)}
            print_json({"file": str(target), **counts, **lists})
            return
        for line in exported.left_out:
            note(f"Warning: not exported: {line}", style="yellow")
        for line in exported.replaced[:SHOWN]:
            note(f"Replaced: {line}")
        if len(exported.replaced) > SHOWN:
            note(f"and {len(exported.replaced) - SHOWN} more replaced")
        say(f"{target}: {exported.named} REXS attributes, {exported.own} custom_exugear_ attributes")


def _new_name(name: str) -> str:
    """Name of the copy of a file, which keeps its extensions.

    Examples
    --------
    >>> _new_name("gearbox.rexs"), _new_name("gearbox.rexs.zip")
    ('gearbox-exugear.rexs', 'gearbox-exugear.rexs.zip')
    """
    stem, dot, ends = name.partition(".")
    return f"{stem}-exugear{dot}{ends}"
