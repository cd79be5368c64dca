"""What verbs ask of a gearbox file and of a results folder before they work."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from exugear.cli.console import note
from exugear.cli.errors import BadInputError, model_errors
from exugear.cli.options import MeshLaw, Variant

if TYPE_CHECKING:
    from exugear.model.gearbox import Gearbox


def read_gearbox(case: Path, files_below: Path | None = None, scripts: bool = False, *, tell: bool = True) -> Gearbox:
    """Read a gearbox file for a verb, with what the user permits it, and try all its parts; tell what is unusual."""
    from exugear.dynamics.readiness import check_parts
    from exugear.model.gearbox import Gearbox
    from exugear.model.named_files import Permissions
    from exugear.model.reading import CaseError

    check_files_below(files_below)
    try:
        gearbox = Gearbox.from_toml(case, Permissions(scripts, files_below))
        check_parts(gearbox)
    except CaseError as error:
        raise BadInputError(error) from error
    for line in gearbox.warnings if tell else ():
        note(f"Warning: {line}", style="yellow")
    return gearbox


def check_files_below(folder: Path | None) -> None:
    """Refuse a further folder for the files of a case that is not there."""
    if folder is not None and not folder.is_dir():
        raise BadInputError(f"--files-below {folder}: no such folder; name one that the gearbox file may read from")


def results_folder(case: Path, out: Path | None, make: bool = True) -> Path:
    """Return the folder that a verb writes into; make it unless told not to."""
    folder = out or Path("results") / case.resolve().parent.name
    if make:
        make_results_folder(folder)
    return folder


def make_results_folder(folder: Path) -> None:
    """Make the folder that a verb writes into, so that a wrong one shows before the work, not after."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"--out {folder}: {error.strerror}; name a folder that can be made") from error
    if not os.access(folder, os.W_OK):
        raise BadInputError(f"--out {folder}: not writable; name another folder")


def check_choices(
    gearbox: Gearbox,
    variant: Variant,
    law: MeshLaw,
    inertias: str | None,
    folder: Path,
    load_case: str | None = None,
) -> None:
    """Refuse what the gearbox does not have, or may not do, before anything is written into the results folder."""
    from exugear.bodies.of_gearbox.solids import check_solids
    from exugear.dynamics.readiness import lacking
    from exugear.results.folder import bodies_folder
    from exugear.tooth_mesh.laws.registry import LAWS

    with model_errors():
        gearbox.bodies(inertias)
        if load_case is not None and load_case not in gearbox.load_cases:
            known = ", ".join(gearbox.load_cases) or "none"
            raise gearbox.fault(f"no load case {load_case!r}; load cases are {known}")
        reason = lacking(gearbox, variant.value)
        if reason:
            raise gearbox.fault(f"variant {variant}: {reason}")
        if variant is Variant.flexible:
            check_solids(gearbox, bodies_folder(folder))
    if not LAWS[law].has_force and variant is not Variant.rigid:
        raise BadInputError(f"--mesh-law {law}: its gears only roll, which needs the variant rigid, not {variant}")


@contextmanager
def time_noted(folder: Path, step: str) -> Iterator[None]:
    """Write into the results folder how long a step took, if it ended well."""
    from exugear.results.folder import note_time

    start = time.perf_counter()
    yield
    try:
        note_time(folder, step, time.perf_counter() - start)
    except OSError as error:  # the work itself is done
        note(f"The time that it took is not noted: {error}", style="yellow")
