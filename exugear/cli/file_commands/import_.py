"""The command `import`: a gearbox file from an industry file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exugear.cli import options
from exugear.cli.console import BadInputError, counted, exit_codes, note, print_json, say

if TYPE_CHECKING:
    from exugear.exchange.rexs.to_case.conversion import Imported
    from exugear.exchange.rexs.to_case.notes import Rules

NAME = "gearbox.toml"
"""Name of the file that is written."""


def import_(
    file: Annotated[Path, typer.Argument(metavar="FILE.rexs", help="REXS file: XML, JSON or zip.", show_default=False)],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="Folder for gearbox.toml. (default: file name without extension)"),
    ] = None,
    shifts: options.ShiftsOption = options.ShiftRule.file,
    distances: options.DistancesOption = options.DistanceRule.agreeing,
    as_json: options.JsonOption = False,
) -> None:
    """Convert a REXS file (1.0 to 2.0) to a gearbox file. Each value has its source; assumptions are marked."""
    with exit_codes():
        from exugear.exchange.rexs.to_case.loads import SPECTRUM
        from exugear.exchange.rexs.to_case.notes import Rules
        from fe_ste.tools.files import write_file

        # A REXS file may have two extensions.
        stem = file.name.removesuffix(".zip").removesuffix(".xml").removesuffix(".json").rsplit(".rexs", 1)[0]
        target = (out or Path(stem or "imported")) / NAME
        _refuse_existing(target)
        imported = _imported(file, target, Rules(shifts.value, distances.value))
        if imported.spectrum:
            table = target.with_name(SPECTRUM)
            content = imported.spectrum.encode("utf-8")
            if not (table.is_file() and table.read_bytes() == content):  # as left by an import that was killed
                _refuse_existing(table)
                write_file(table, content)
        write_file(target, imported.text.encode("utf-8"))
        if as_json:
            print_json(
                {
                    "file": str(target),
                    "name": imported.gearbox.name,
                    "ratio": imported.gearbox.train.ratio,
                    "changed": list(imported.changed),
                    "checked": list(imported.checked),
                    "left_out": list(imported.lost),
                    "ignored": list(imported.ignored),
                }
            )
            return
        for line in counted([f"Warning: not imported: {line}" for line in imported.lost]):
            note(line, style="yellow")
        for line in imported.changed:
            note(f"Warning: {line}", style="yellow")
        besides = len(imported.ignored) - len(imported.lost)
        if besides:
            note(f"Also not imported, without effect on results: {besides} lines, listed at the top of {target.name}")
        say(
            f"{target}: speed ratio output/input {imported.gearbox.train.ratio:.6g}, {len(imported.gearbox.pairs)} "
            f"gear pairs, {len(imported.gearbox.bearings)} bearings"
        )
        say(f"Values marked A are assumed. Check them, then run: exugear check {target}")


def _refuse_existing(path: Path) -> None:
    if path.exists():
        raise BadInputError(f"{path}: exists already and may have been edited; specify another folder with --out")


def _imported(file: Path, target: Path, rules: Rules) -> Imported:
    from exugear.exchange.rexs.containers import read_rexs
    from exugear.exchange.rexs.to_case.conversion import to_case
    from exugear.exchange.rexs.tree import RexsError

    try:
        model = read_rexs(file)
        try:
            return to_case(model, file.name, target, rules)
        except RexsError as error:
            raise RexsError(*(f"{file}: {line}" for line in error.errors)) from None
    except RexsError as error:
        raise BadInputError(error) from error
