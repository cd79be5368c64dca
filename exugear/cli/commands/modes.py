"""Options of the command `modes`."""

from __future__ import annotations

from exugear.cli import options
from exugear.cli.console import exit_codes


def modes(
    case: options.CaseArgument,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """Compute eigenmodes and a Campbell diagram.

    The variant is linearised at the static load. Transmission error tables that are missing or out of date are computed
    first.
    """
    with exit_codes():
        from exugear.cli.case import open_project
        from exugear.cli.tasks import modes as task

        task.modes(open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias), as_json)
