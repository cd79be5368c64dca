"""Commands for gearbox files: templates, industry files, description of the keys, old files and checks."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import typer

from exugear.cli import options
from exugear.cli.console import BadInputError, print_json, say
from exugear.gearbox.renames import MigrationError, migrated
from exugear.gearbox.templates.kinds import KINDS, template
from fe_ste.tools.files import write_file


class Kind(StrEnum):
    """Kinds of gearboxes for which a template exists."""

    _ignore_ = ["members", "kind"]
    members = vars()
    for kind in KINDS:
        members[kind.replace("-", "_")] = kind


PARALLEL = Kind("parallel")
"""Template without an option, which the tutorial uses."""
_KINDS_TOLD = "; ".join(f"{kind}: {words}" for kind, words in KINDS.items())


def new(
    case: Annotated[Path, typer.Argument(metavar="FILE.toml", help="File to write.", show_default=False)],
    kind: Annotated[Kind, typer.Option(metavar="NAME", help=f"Template. {_KINDS_TOLD}.")] = PARALLEL,
    as_json: options.JsonOption = False,
) -> None:
    """Write a commented gearbox file to start from. It runs without changes."""
    from exugear.project import default_folder

    if case.suffix != ".toml":
        raise BadInputError(f"{case}: specify a file name that ends with .toml")
    if case.exists() or case.is_symlink():
        raise BadInputError(f"{case}: exists already and is not overwritten; specify another file")
    _write(case, template(kind.value))
    if as_json:
        print_json({"case": str(case), "kind": kind.value})
        return
    say(f"Template {kind.value}: {KINDS[kind.value]}.")
    say("Next:")
    for line in (f"check {case}", f"steady {case}", f"report {default_folder(case)}"):
        say(f"  exugear {line}")
    say(f"Written: {case}")


def _write(path: Path, text: str) -> None:
    try:
        write_file(path, text.encode())
    except OSError as error:
        raise BadInputError(f"{path}: cannot be written ({error.strerror}); specify another file") from error


def import_(
    file: Annotated[Path, typer.Argument(metavar="FILE.rexs", help="REXS file: XML, JSON or zip.", show_default=False)],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FOLDER", help="Folder for gearbox.toml. (default: file name without extension)"),
    ] = None,
    shifts: options.ShiftsOption = "file",
    distances: options.DistancesOption = "agreeing",
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Convert a REXS file (1.0 to 2.0) to a gearbox file. Each value has its source; assumptions are marked."""
    from exugear.cli.tasks.rexs import import_rexs
    from exugear.exchange.rexs.to_case.notes import Rules

    import_rexs(file, out, Rules(shifts, distances), as_json, whole)


def schema(
    page: Annotated[bool, typer.Option("--page", help="Write a human-readable Markdown page instead.")] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write. (default: standard output)")
    ] = None,
) -> None:
    """Describe every key of the gearbox file as a JSON schema. Editors use it to check and complete files."""
    from exugear.gearbox.sections.schema.keys import json_schema
    from exugear.gearbox.sections.schema.keys import page as described

    text = described() if page else json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"
    if out is None:
        typer.echo(text, nl=False)
        return
    _write(out, text)
    say(f"Written: {out}")


def migrate(
    file: Annotated[Path, typer.Argument(metavar="FILE.toml", help="Gearbox or study file.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write. (default: the same file)")
    ] = None,
) -> None:
    """Update the key names of an older file; comments are kept."""
    from exugear.gearbox.reading import read_text

    try:
        text, changes = migrated(read_text(file))
    except MigrationError as error:
        raise BadInputError(f"{file}: {error}") from error
    target = out or file
    if changes or target != file:
        _write(target, text)
    for change in changes:
        say(change)
    if changes:
        say(f"{len(changes)} name{'s' * (len(changes) != 1)} replaced")
        say(f"Written: {target}")
    else:
        say(f"{file}: no old names")


def check(
    case: options.CaseArgument,
    rating: Annotated[
        bool,
        typer.Option(
            "--rating",
            help="Rate the gears to ISO 6336-2 and -3 instead: all factors, next to the finite element results of the "
            "results folder.",
        ),
    ] = False,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Check a gearbox file and summarise it. Lists gear pairs, bearings and load cases; writes no files."""
    if rating:
        from exugear.cli.rating_tables import rate

        rate(case, out, allow_dir, as_json, whole)
    else:
        from exugear.cli.tasks import check as task

        task.check(case, allow_dir, as_json, whole)


def edit(
    case: options.CaseArgument,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="N", help="Port of the page. (default: any)", show_default=False)
    ] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser, or print its address only.")
    ] = True,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
) -> None:
    """Edit a gearbox file in the browser and see its results at once.

    The page is served on this machine only and needs no network. The file is written only when you save it. Tables,
    steady-state response, report and design changes are computed by the other commands when you start them.
    """
    from exugear.cli.edit.task import edit as task

    task(case, out, allow_dir, port, browser)


def export(
    case: options.CaseArgument,
    rexs: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE.rexs", help="REXS file that the gearbox file was imported from.", show_default=False
        ),
    ] = None,
    matrices: Annotated[
        str | None,
        typer.Option(
            "--matrices",
            metavar="BODY",
            help="Write mass and stiffness of a flexible body instead, on its seats.",
            show_default=False,
        ),
    ] = None,
    loads: Annotated[
        Path | None,
        typer.Option(
            "--loads",
            metavar="FILE.nc",
            help="Write forces and moments of a steady-state response on the housing instead.",
            show_default=False,
        ),
    ] = None,
    surface: Annotated[
        Path | None,
        typer.Option(
            "--surface",
            metavar="FILE.nc",
            help="Write velocities of a steady-state response on the housing's surface instead (netCDF, VTK).",
            show_default=False,
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed",
            metavar="RPM",
            help="Input speed of loads as Nastran cards, or of velocities.",
            show_default=False,
        ),
    ] = None,
    form: Annotated[
        Literal["npz", "csv", "mtx", "op4", "dmig"],
        typer.Option(
            "--format", metavar="NAME", help="Format of matrices: npz, csv, mtx (Abaqus), op4, dmig (Nastran)."
        ),
    ] = "npz",
    units: Annotated[
        Literal["SI", "mm-t-s", "mm-kg-ms", "mm-kg-s", "inch-lbf-s"],
        typer.Option(
            "--units",
            metavar="NAME",
            help="Units of matrices and load cards: SI, mm-t-s, mm-kg-ms, mm-kg-s, inch-lbf-s.",
        ),
    ] = "SI",
    to: Annotated[
        Path | None,
        typer.Option(
            "--to",
            metavar="PATH",
            help="File to write (default: NAME-exugear, same folder as FILE.rexs), or folder for matrices (default: "
            "matrices in the results folder).",
        ),
    ] = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    shifts: options.ShiftsOption = "file",
    distances: options.DistancesOption = "agreeing",
    whole: options.AllOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Write results for other programs: REXS, matrices, loads.

    In a REXS file, geometry and static forces are always written; tables, modes, bearings and runs if the results
    folder has them. Use --shifts and --distances of the import.
    """
    if matrices is not None:
        from exugear.cli.tasks.export import export_matrices

        if rexs is not None:
            raise BadInputError(f"--matrices {matrices}: omit {rexs}, which is for results in a REXS file")
        export_matrices(case, matrices, form, units, to, out, allow_dir, scripts, as_json, whole)
        return
    if loads is not None:
        from exugear.cli.tasks.export import export_loads

        export_loads(case, loads, speed, units, to, allow_dir, as_json, whole)
        return
    if surface is not None:
        from exugear.cli.tasks.export import export_surface

        export_surface(case, surface, speed, to, out, allow_dir, scripts, as_json, whole)
        return
    if rexs is None:
        raise BadInputError(
            "nothing to export; name a REXS file, a body with --matrices BODY, --loads FILE.nc or --surface FILE.nc"
        )
    from exugear.cli.tasks.rexs import export_rexs
    from exugear.exchange.rexs.to_case.notes import Rules

    export_rexs(case, rexs, to, out, allow_dir, Rules(shifts, distances), as_json, whole)
