"""The verb `new`: write a gearbox file to start from."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from exugear.cli.case import JsonOption
from exugear.cli.console import BadInputError, exit_codes, print_json, say
from exugear.gearbox.templates.kinds import KINDS


class Kind(StrEnum):
    """Kinds of gearboxes that a file to start from is at hand for."""

    _ignore_ = ["members", "kind"]
    members = vars()
    for kind in KINDS:
        members[kind] = kind


_KINDS_TOLD = "; ".join(f"{kind}: {words}" for kind, words in KINDS.items())


def new(
    case: Annotated[Path, typer.Argument(metavar="FILE.toml", help="The file to write.", show_default=False)],
    kind: Annotated[Kind, typer.Option(help=f"What it describes. {_KINDS_TOLD}.", show_default=False)],
    as_json: JsonOption = False,
) -> None:
    """Write a commented gearbox file that runs as it is, to make one's own of."""
    with exit_codes():
        from exugear.gearbox.templates.kinds import template
        from exugear.project import default_folder
        from fe_ste.tools.files import write_file

        if case.suffix != ".toml":
            raise BadInputError(f"{case}: name a file that ends with .toml")
        if case.exists() or case.is_symlink():
            raise BadInputError(f"{case}: is there already and is not written over; name another file")
        try:
            write_file(case, template(kind.value).encode())
        except OSError as error:
            raise BadInputError(f"{case}: cannot be written ({error.strerror}); name another file") from error
        if as_json:
            print_json({"case": str(case), "kind": kind.value})
            return
        say(f"{case}: {KINDS[kind.value]}. Next:")
        for line in (f"check {case}", f"run {case} --variant bushing", f"report {default_folder(case)}"):
            say(f"  exugear {line}")
