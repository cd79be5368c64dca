"""Options of the command `check`."""

from __future__ import annotations

from typing import Annotated

import typer

from exugear.cli import options
from exugear.cli.console import exit_codes

RatingOption = Annotated[
    bool,
    typer.Option(
        "--rating",
        help="Rate the gears to ISO 6336-2 and -3 instead: all factors, next to the finite element results of the "
        "results folder.",
    ),
]


def check(
    case: options.CaseArgument,
    rating: RatingOption = False,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Check a gearbox file and summarise it. Lists gear pairs, bearings and load cases; writes no files."""
    with exit_codes():
        from exugear.cli.tasks import check as task

        if rating:
            task.rate(case, out, allow_dir, as_json)
        else:
            task.check(case, allow_dir, as_json)
