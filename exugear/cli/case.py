"""What verbs share: arguments and options, and what they ask of a gearbox file before they work."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exugear.cli.console import BadInputError, check_results_folder, counted, model_errors, note
from exugear.gearbox.variant import OFFERED, Variant, VariantError
from exugear.system.tooth_mesh.laws.registry import LAWS

if TYPE_CHECKING:
    from exugear.cli.watched import WatchedProject
    from exugear.gearbox.choice import Choice
    from exugear.gearbox.gearbox import Gearbox
    from exugear.system.system import Assembly

# What verbs ask of a gearbox file before they work


def read_gearbox(case: Path, allow_dir: Path | None = None, scripts: bool = False, *, tell: bool = True) -> Gearbox:
    """Read a gearbox file for a verb, with what the user permits it, and try all its parts; tell what is unusual."""
    from exugear.gearbox.gearbox import Gearbox
    from exugear.gearbox.named_files import Permissions
    from exugear.gearbox.reading import GearboxFileError, read_toml
    from exugear.system.readiness import check_parts, faults_of_bearings, remarks

    check_allow_dir(allow_dir)
    try:
        content = read_toml(case)
        try:
            gearbox = Gearbox.from_dict(content, str(case), Permissions(scripts, allow_dir))
        except GearboxFileError as error:
            raise GearboxFileError(*error.faults, *faults_of_bearings(content, str(case))) from None
        check_parts(gearbox)
    except GearboxFileError as error:
        raise BadInputError(error) from error
    for line in counted([f"Warning: {line}" for line in remarks(gearbox)]) if tell else ():
        note(line, style="yellow")
    return gearbox


def check_allow_dir(folder: Path | None) -> None:
    """Refuse a further folder for the files of a case that is not there."""
    if folder is not None and not folder.is_dir():
        raise BadInputError(f"--allow-dir {folder}: no such folder; name one that the gearbox file may read from")


def open_project(
    case: Path,
    choice: Choice,
    out: Path | None,
    allow_dir: Path | None,
    scripts: bool,
) -> WatchedProject:
    """Read a gearbox file and refuse choices that it does not have, or may not have; write nothing."""
    from exugear.cli.watched import WatchedProject
    from exugear.project import default_folder

    gearbox = read_gearbox(case, allow_dir, scripts)
    folder = out or default_folder(case)
    check_choice(gearbox, choice, folder)
    check_results_folder(folder)
    return WatchedProject(gearbox, folder, choice)


def assembled_by_iso(gearbox: Gearbox, variant: Variant) -> Assembly:
    """Assemble a variant with rigid bodies and teeth as stiff as ISO 6336-1 says, which needs no finite elements.

    Raises
    ------
    FailedError
        The variant finds no balance so.
    """
    from exugear.gearbox.choice import Choice
    from exugear.system.build import assemble
    from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

    law = "iso6336"
    rigid = Variant.bushing if variant.is_elastic else variant
    with model_errors():
        return assemble(gearbox, Choice(rigid, law), mesh_stiffness(gearbox, law))


def steady_lack(assembly: Assembly, variant: Variant) -> str:
    """Say why a variant has no steady response over speed, by its `assembled_by_iso`; empty where it has one.

    What speaks against it does not depend on finite elements.
    """
    from exugear.steady.mean_system.mean_system import unsuitable
    from exugear.system.bearings.stiffness import elastic_names

    return unsuitable(assembly, elastic_names(assembly.gearbox) if variant.is_elastic else ())


def check_choice(gearbox: Gearbox, choice: Choice, folder: Path) -> None:
    """Refuse what the gearbox does not have, or may not do, before anything is written into the results folder."""
    from exugear.results.folder import bodies_folder
    from exugear.system.bodies.of_gearbox import check_solids
    from exugear.system.readiness import lacking
    from exugear.system.tooth_mesh.laws.registry import LAWS
    from exugear.system.tooth_mesh.tables import without_table

    gearbox.bodies(choice.inertias)
    if choice.load_case is not None and choice.load_case not in gearbox.load_cases:
        known = ", ".join(gearbox.load_cases) or "none"
        raise gearbox.fault(f"no load case {choice.load_case!r}; load cases are {known}")
    reason = lacking(gearbox, choice.variant)
    if reason:
        raise gearbox.fault(f"variant {choice.variant}: {reason}")
    if choice.variant.is_elastic:
        check_solids(gearbox, bodies_folder(folder))
    if LAWS[choice.mesh_model].needs_axes:
        without = without_table(gearbox, [mesh.pair.name for mesh in gearbox.meshes])
        if without:
            raise BadInputError(gearbox.fault(without))
    if not LAWS[choice.mesh_model].has_force and not choice.variant.spins_only:
        raise BadInputError(
            f"--mesh-model {choice.mesh_model}: needs the variant rigid, whose gears only roll, not {choice.variant}"
        )


# Arguments and options that several verbs share

CaseArgument = Annotated[Path, typer.Argument(metavar="CASE.toml", help="The gearbox file.", show_default=False)]
JsonOption = Annotated[bool, typer.Option("--json", help="Print a summary as one JSON object.")]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Results folder. (default: results/FOLDER-OF-THE-CASE)"),
]


class MeshModel(StrEnum):
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

USUAL_LAW = MeshModel("line_of_action")


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
LawOption = Annotated[MeshModel, typer.Option("--mesh-model", help=_LAWS_TOLD)]
FilesBelowOption = Annotated[
    Path | None,
    typer.Option(
        "--allow-dir",
        metavar="DIR",
        envvar="EXUGEAR_ALLOW_DIR",
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
