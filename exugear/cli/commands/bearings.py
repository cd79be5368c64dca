"""Options of the command `bearings`."""

from __future__ import annotations

from exugear.cli import options
from exugear.cli.console import BadInputError, exit_codes
from exugear.gearbox.variant import Variant


def bearings(
    case: options.CaseArgument,
    variant: options.VariantOption = None,
    mesh_model: options.LawOption = options.USUAL_LAW,
    inertias: options.InertiasOption = None,
    out: options.OutOption = None,
    allow_dir: options.FilesBelowOption = None,
    scripts: options.ScriptsOption = False,
    as_json: options.JsonOption = False,
) -> None:
    """List load, stiffness and life of the catalogue bearings.

    All values are for the static load. Also lists misalignment, load distribution and contact stress of each mesh.
    Transmission error tables that are missing or out of date are computed first.
    """
    with exit_codes():
        from exugear.cli.case import open_project
        from exugear.cli.tasks import bearings as task

        variant = variant or Variant.bushing
        if not variant.has_bearings:
            raise BadInputError(f"--variant {variant}: has ideal joints instead of bearings; use bushing or flexible")
        task.bearings(open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias), as_json)
