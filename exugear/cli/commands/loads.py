"""Options of the command `loads`."""

from __future__ import annotations

from exugear.cli import options
from exugear.cli.console import exit_codes


def loads(
    case: options.CaseArgument,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Count the loads on each mesh and bearing.

    Reads the load files of section [loads]; needs no transmission error tables. Writes load duration distributions
    (LDD) as CSV, and a picture of them.
    """
    with exit_codes():
        from exugear.cli.case import read_gearbox
        from exugear.cli.tasks import loads as task

        task.loads(read_gearbox(case, allow_dir, scripts), out, as_json)
