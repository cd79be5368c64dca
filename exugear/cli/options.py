"""Arguments and options that several verbs share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from exugear.gearbox.variant import OFFERED, Variant, VariantError
from exugear.system.tooth_mesh.laws.registry import LAWS

CaseArgument = Annotated[Path, typer.Argument(metavar="CASE.toml", help="The gearbox file.", show_default=False)]
JsonOption = Annotated[bool, typer.Option("--json", help="Print a summary as one JSON object.")]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Results folder. (default: results/FOLDER-OF-THE-CASE)"),
]


class MeshLaw(StrEnum):
    """How teeth in mesh push each other: the laws of `exugear.system.tooth_mesh.laws.registry`."""

    _ignore_ = ["members", "law"]
    members = vars()
    for law in LAWS:
        members[law] = law


class ShiftRule(StrEnum):
    """Profile shifts of an industry file that contradict the centre distance: refused, or replaced."""

    file = "file"
    centre_distance = "centre-distance"


class DistanceRule(StrEnum):
    """Centre distances of an industry file unlike the positions of its gears: which of them counts."""

    agreeing = "agreeing"
    positions = "positions"
    file = "file"


ShiftsOption = Annotated[
    ShiftRule,
    typer.Option(
        "--shifts",
        help="Profile shifts that the centre distance contradicts: those of the file, which refuses them, or "
        "those that the centre distance asks for.",
    ),
]
DistancesOption = Annotated[
    DistanceRule,
    typer.Option(
        "--distances",
        help="Centre distances unlike the positions of the gears: those that agree with the profile shifts, those of "
        "the positions, or those that the file states.",
    ),
]

USUAL_LAW = MeshLaw("line_of_action")


def _variant(name: str) -> Variant:
    try:
        return Variant.offered(name)
    except VariantError as error:
        raise typer.BadParameter(str(error)) from error


VariantOption = Annotated[
    Variant,
    typer.Option("--variant", parser=_variant, metavar=f"<{'|'.join(OFFERED)}>", help="How the shafts are held."),
]
_LAWS_TOLD = "How teeth in mesh push each other. " + "; ".join(
    f"{law.name}: {law.description.replace('; ', ', ')}" for law in LAWS.values()
)
LawOption = Annotated[MeshLaw, typer.Option("--mesh-law", help=_LAWS_TOLD)]
FilesBelowOption = Annotated[
    Path | None,
    typer.Option(
        "--files-below",
        metavar="DIR",
        envvar="EXUGEAR_FILES_BELOW",
        help="A further folder that files may lie in which the gearbox file names. (default: its own alone)",
        show_default=False,
    ),
]
ScriptsOption = Annotated[
    bool,
    typer.Option(
        "--allow-scripts",
        envvar="EXUGEAR_ALLOW_SCRIPTS",
        help="Let gmsh scripts run that the gearbox file names; they can do all that you can.",
    ),
]
InertiasOption = Annotated[
    str | None, typer.Option("--inertias", metavar="SET", help="Inertia set. (default: as the file says)")
]
