"""The command `schema`: describe every key of the gearbox file, for editors or as a page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from exugear.cli.console import BadInputError, exit_codes, say


def schema(
    page: Annotated[bool, typer.Option("--page", help="Write a human-readable Markdown page instead.")] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="File to write. (default: standard output)")
    ] = None,
) -> None:
    """Describe every key of the gearbox file as a JSON schema. Editors use it to check and complete files."""
    with exit_codes():
        from exugear.gearbox.sections.schema.keys import json_schema
        from exugear.gearbox.sections.schema.keys import page as described
        from fe_ste.tools.files import write_file

        text = described() if page else json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"
        if out is None:
            typer.echo(text, nl=False)
            return
        try:
            write_file(out, text.encode())
        except OSError as error:
            raise BadInputError(f"--out {out}: cannot be written ({error.strerror}); specify another file") from error
        say(f"Written: {out}")
