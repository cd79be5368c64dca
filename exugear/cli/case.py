"""What verbs ask of a gearbox file before they work."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from exugear.cli.console import counted, note
from exugear.cli.errors import BadInputError, model_errors
from exugear.cli.folders import check_results_folder
from exugear.gearbox.variant import Variant

if TYPE_CHECKING:
    from exugear.cli.watched import WatchedProject
    from exugear.gearbox.choice import Choice
    from exugear.gearbox.gearbox import Gearbox
    from exugear.system.assembly import Assembly


def read_gearbox(case: Path, files_below: Path | None = None, scripts: bool = False, *, tell: bool = True) -> Gearbox:
    """Read a gearbox file for a verb, with what the user permits it, and try all its parts; tell what is unusual."""
    from exugear.gearbox.gearbox import Gearbox
    from exugear.gearbox.named_files import Permissions
    from exugear.gearbox.reading import CaseError, read_toml
    from exugear.system.readiness.readiness import check_parts, faults_of_bearings, remarks

    check_files_below(files_below)
    try:
        content = read_toml(case)
        try:
            gearbox = Gearbox.from_dict(content, str(case), Permissions(scripts, files_below))
        except CaseError as error:
            raise CaseError(*error.faults, *faults_of_bearings(content, str(case))) from None
        check_parts(gearbox)
    except CaseError as error:
        raise BadInputError(error) from error
    for line in counted([f"Warning: {line}" for line in remarks(gearbox)]) if tell else ():
        note(line, style="yellow")
    return gearbox


def check_files_below(folder: Path | None) -> None:
    """Refuse a further folder for the files of a case that is not there."""
    if folder is not None and not folder.is_dir():
        raise BadInputError(f"--files-below {folder}: no such folder; name one that the gearbox file may read from")


def open_project(
    case: Path,
    choice: Choice,
    out: Path | None,
    files_below: Path | None,
    scripts: bool,
) -> WatchedProject:
    """Read a gearbox file and refuse choices that it does not have, or may not have; write nothing."""
    from exugear.cli.watched import WatchedProject
    from exugear.project import default_folder

    gearbox = read_gearbox(case, files_below, scripts)
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
    from exugear.system.assemble import assemble
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
    from exugear.system.bearings.supports import elastic_names

    return unsuitable(assembly, elastic_names(assembly.gearbox) if variant.is_elastic else ())


def check_choice(gearbox: Gearbox, choice: Choice, folder: Path) -> None:
    """Refuse what the gearbox does not have, or may not do, before anything is written into the results folder."""
    from exugear.results.folder import bodies_folder
    from exugear.system.bodies.of_gearbox.solids import check_solids
    from exugear.system.readiness.readiness import lacking
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
    if LAWS[choice.mesh_law].needs_axes:
        without = without_table(gearbox, [mesh.pair.name for mesh in gearbox.meshes])
        if without:
            raise BadInputError(gearbox.fault(without))
    if not LAWS[choice.mesh_law].has_force and not choice.variant.spins_only:
        raise BadInputError(
            f"--mesh-law {choice.mesh_law}: its gears only roll, which needs the variant rigid, not {choice.variant}"
        )
