"""The gearbox of a command: reading the file, and the checks that come before anything is computed or written."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from exugear.cli.console import BadInputError, counted, model_errors, note
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.reading import GearboxFileError, read_toml
from exugear.gearbox.variant import Variant
from exugear.results.folder import bodies_folder
from exugear.steady.mean_system.mean_system import unsuitable
from exugear.system.bearings.stiffness import elastic_names
from exugear.system.bodies.of_gearbox import check_solids
from exugear.system.build import assemble
from exugear.system.gearbox_checks import check_parts, errors_of_bearings, gearbox_warnings, lacking
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.tables import without_table


def read_gearbox(case: Path, allow_dir: Path | None = None, scripts: bool = False, *, tell: bool = True) -> Gearbox:
    """Read a gearbox file for a command with the user's permissions, check all its parts, and print warnings."""
    check_allow_dir(allow_dir)
    try:
        gearbox = checked_gearbox(read_toml(case), str(case), Permissions(scripts, allow_dir))
    except GearboxFileError as error:
        raise BadInputError(error) from error
    for line in counted([f"Warning: {line}" for line in gearbox_warnings(gearbox)]) if tell else ():
        note(line, style="yellow")
    return gearbox


def checked_gearbox(content: Mapping[str, Any], source: str, permissions: Permissions) -> Gearbox:
    """Build a gearbox of the content of a file, and check all its parts.

    Raises
    ------
    GearboxFileError
        All errors of the content.
    """
    try:
        gearbox = Gearbox.from_dict(content, source, permissions)
    except GearboxFileError as error:
        raise GearboxFileError(*error.errors, *errors_of_bearings(content, source)) from None
    check_parts(gearbox)
    return gearbox


def check_allow_dir(folder: Path | None) -> None:
    """Raise an error if the additional permitted folder does not exist."""
    if folder is not None and not folder.is_dir():
        raise BadInputError(
            f"--allow-dir {folder}: no such folder; specify a folder that the gearbox file may read from"
        )


def assembled_by_iso(gearbox: Gearbox, variant: Variant, like: Assembly | None = None) -> Assembly:
    """Assemble a variant with rigid bodies and the mesh stiffness of ISO 6336-1, which requires no finite elements.

    An assembly of a similar gearbox, `like`, shortens the search for the static state.

    Raises
    ------
    FailedError
        The variant has no static equilibrium with this stiffness.
    """
    law = "iso6336"
    rigid = Variant.bushing if variant.is_elastic else variant
    with model_errors():
        return assemble(gearbox, Choice(rigid, law), mesh_stiffness(gearbox, law), like=like)


def steady_lack(assembly: Assembly, variant: Variant) -> str:
    """Return why a variant has no steady-state response over speed, from `assembled_by_iso`; empty if it has one.

    The possible reasons do not depend on finite elements.
    """
    return unsuitable(assembly, elastic_names(assembly.gearbox) if variant.is_elastic else ())


def check_choice(gearbox: Gearbox, choice: Choice, folder: Path) -> None:
    """Raise an error for invalid or unavailable model settings before files are written into the results folder."""
    gearbox.bodies(choice.inertias)
    if choice.load_case is not None and choice.load_case not in gearbox.load_cases:
        known = ", ".join(gearbox.load_cases) or "none"
        raise gearbox.error(f"no load case {choice.load_case!r}; choose one of: {known}")
    if reason := lacking(gearbox, choice.variant):
        raise gearbox.error(f"variant {choice.variant}: {reason}")
    if choice.variant.is_elastic:
        check_solids(gearbox, bodies_folder(folder))
    pairs = [mesh.pair.name for mesh in gearbox.meshes]
    if LAWS[choice.mesh_model].needs_axes and (without := without_table(gearbox, pairs)):
        raise BadInputError(gearbox.error(without))
    if not LAWS[choice.mesh_model].has_force and not choice.variant.spins_only:
        raise BadInputError(
            f"--mesh-model {choice.mesh_model}: a kinematic constraint, which requires --variant rigid, not "
            f"{choice.variant}"
        )


def check_friction(gearbox: Gearbox, mesh_model: str) -> None:
    """Raise an error if the file requests friction of the teeth that the mesh model cannot have."""
    friction = gearbox.case.damping.tooth_friction
    law = LAWS[mesh_model]
    if friction == 0.0 or not law.has_force:
        return
    if not law.has_line_loads:
        known = ", ".join(other.name for other in LAWS.values() if other.has_line_loads)
        raise BadInputError(
            f"--mesh-model {mesh_model}: damping.tooth_friction = {friction:g} requires line loads over the mesh "
            f"cycle, which this mesh model does not have; use --mesh-model {known}, or remove the key"
        )
    for mesh in gearbox.meshes:
        if gearbox.case.pairs[mesh.pair.name].stiffness is not None:
            raise gearbox.error(
                f"damping.tooth_friction = {friction:g}: requires line loads over the mesh cycle, which are unknown "
                f"for a stated stiffness; remove pairs.{mesh.pair.name}.stiffness, or remove tooth_friction"
            )
