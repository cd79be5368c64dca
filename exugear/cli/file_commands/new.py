"""The command `new`: write a template gearbox file."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.console import BadInputError, exit_codes, print_json, say
from exugear.gearbox.templates.kinds import KINDS


class Kind(StrEnum):
    """Kinds of gearboxes for which a template exists."""

    _ignore_ = ["members", "kind"]
    members = vars()
    for kind in KINDS:
        members[kind] = kind


PARALLEL = Kind("parallel")
"""Template without an option, which the tutorial uses."""
_KINDS_TOLD = "; ".join(f"{kind}: {words}" for kind, words in KINDS.items())


def new(
    case: Annotated[Path, typer.Argument(metavar="FILE.toml", help="File to write.", show_default=False)],
    kind: Annotated[Kind, typer.Option(metavar="NAME", help=f"Template. {_KINDS_TOLD}.")] = PARALLEL,
    as_json: options.JsonOption = False,
) -> None:
    """Write a commented gearbox file to start from. It runs without changes."""
    with exit_codes():
        from exugear.gearbox.templates.kinds import template
        from exugear.project import default_folder
        from fe_ste.tools.files import write_file

        if case.suffix != ".toml":
            raise BadInputError(f"{case}: specify a file name that ends with .toml")
        if case.exists() or case.is_symlink():
            raise BadInputError(f"{case}: exists already and is not overwritten; specify another file")
        try:
            write_file(case, template(kind.value).encode())
        except OSError as error:
            raise BadInputError(f"{case}: cannot be written ({error.strerror}); specify another file") from error
        if as_json:
            print_json({"case": str(case), "kind": kind.value})
            return
        say(f"{case}: {KINDS[kind.value]}. Next:")
        for line in (f"check {case}", f"run {case}", f"report {default_folder(case)}"):
            say(f"  exugear {line}")
