"""Arguments and options that several commands share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Literal

import typer

from exugear.gearbox.variant import OFFERED, Variant, VariantError
from exugear.system.tooth_mesh.laws.registry import LAWS

CaseArgument = Annotated[Path, typer.Argument(metavar="GEARBOX.toml", help="Gearbox file.", show_default=False)]
JsonOption = Annotated[bool, typer.Option("--json", help="Print a summary as a JSON object.")]
AllOption = Annotated[bool, typer.Option("--all", help="Print all tables, rows and notes.")]
OutOption = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Results folder. (default: results/NAME)")]


class MeshModel(StrEnum):
    """Mesh force models, see `exugear.system.tooth_mesh.laws.registry`."""

    _ignore_ = ["members", "law"]
    members = vars()
    for law in LAWS:
        members[law] = law


ShiftsOption = Annotated[
    Literal["file", "centre-distance"],
    typer.Option(
        "--shifts",
        metavar="RULE",
        help="Source of profile shifts: file (a contradiction to the centre distance is an error), or centre-distance "
        "(adjusted to it).",
    ),
]
DistancesOption = Annotated[
    Literal["agreeing", "positions", "file"],
    typer.Option(
        "--distances",
        metavar="RULE",
        help="Source of centre distances that contradict the gear positions: agreeing (whichever agrees with the "
        "profile shifts), positions, or file.",
    ),
]

USUAL_LAW = MeshModel("line_of_action")


VARIANT_DESCRIPTIONS = {
    Variant.rigid: "ideal joints",
    Variant.bushing: "elastic bearings",
    Variant.flexible: "flexible bodies",
}
_VARIANTS = ", ".join(f"{name} ({VARIANT_DESCRIPTIONS[Variant.of(name)]})" for name in OFFERED)


def _variant(name: str) -> Variant:
    try:
        return Variant.offered(name)
    except VariantError as error:
        raise typer.BadParameter(str(error)) from error


VariantOption = Annotated[
    Variant | None,
    typer.Option(
        "--variant",
        parser=_variant,
        metavar="NAME",
        help=f"Variant: {_VARIANTS}. (default: bushing; rigid if the data of the bearings are incomplete)",
        show_default=False,
    ),
]
LawOption = Annotated[
    MeshModel, typer.Option("--mesh-model", metavar="NAME", help=f"Mesh force model: {', '.join(LAWS)}.")
]
FilesBelowOption = Annotated[
    Path | None,
    typer.Option(
        "--allow-dir",
        metavar="DIR",
        envvar="EXUGEAR_ALLOW_DIR",
        help="Further folder of files for the gearbox file.",
        show_default=False,
        show_envvar=False,
    ),
]
WithoutOption = Annotated[
    list[str] | None,
    typer.Option("--without", metavar="NAME", help="Leave out an excitation; repeatable.", show_default=False),
]
ScriptsOption = Annotated[
    bool,
    typer.Option(
        "--allow-scripts",
        envvar="EXUGEAR_ALLOW_SCRIPTS",
        help="Run gmsh scripts of the gearbox file (full user rights).",
        show_envvar=False,
    ),
]
QuantityOption = Annotated[
    Literal["transmission_error", "bearing_force", "acceleration", "sound_power"] | None,
    typer.Option(
        "--quantity",
        metavar="NAME",
        help="Rank by transmission_error, bearing_force, acceleration, sound_power. (default: file)",
        show_default=False,
    ),
]
InertiasOption = Annotated[
    str | None, typer.Option("--inertias", metavar="SET", help="Inertia set. (default: gearbox file)")
]
