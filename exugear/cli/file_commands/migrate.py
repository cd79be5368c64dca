"""The command `migrate`: rewrite a file of an earlier version with the current names."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exugear.cli.console import BadInputError, exit_codes, say


def migrate(
    file: Annotated[Path, typer.Argument(metavar="FILE.toml", help="Gearbox or study file.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write. (default: the same file)")
    ] = None,
) -> None:
    """Update the key names of an older file; comments are kept."""
    with exit_codes():
        from exugear.gearbox.reading import read_text
        from exugear.gearbox.renames import MigrationError, migrated
        from fe_ste.tools.files import write_file

        try:
            text, changes = migrated(read_text(file))
        except MigrationError as error:
            raise BadInputError(f"{file}: {error}") from error
        target = out or file
        if changes or target != file:
            try:
                write_file(target, text.encode())
            except OSError as error:
                raise BadInputError(f"{target}: cannot be written ({error.strerror})") from error
        for change in changes:
            say(change)
        if changes:
            say(f"{len(changes)} names replaced in {target}")
        else:
            say(f"{file}: no old names")
