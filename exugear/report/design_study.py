"""Design changes of a project: tables, static state and steady-state response of each changed gearbox.

`exugear.report.findings.design_changes` has the proposals and what is compared. Each changed gearbox has a subfolder of
the results, so that a stopped study resumes, and a repeated one reads its results.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.report.findings.design_changes import (
    ChangeResult,
    DesignChange,
    DesignStudy,
    effects_of,
    multiples_of,
    ordered,
    peaks_of,
    price_of,
    propose_changes,
    settings_of_study,
    write_design_study,
)
from exugear.report.findings.ranking import Resonance, ranking_of
from exugear.results.folder import DESIGN_CHANGES_FILE
from exugear.steady.mean_system.rotating_frame import SteadyError
from exugear.steady.settings import SteadySettings
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.gearbox_checks import check_parts, lacking
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.placement import MeshError
from fe_ste.geometry.checks import GeometryError
from fe_ste.tools.files import write_file

if TYPE_CHECKING:
    import xarray as xr

    from exugear.system.bearings.duty import BearingLoadState
    from exugear.system.modes import Modes
    from fe_ste.transmission_error.table import MeshTable

FOLDER = "design-changes"
"""Subfolder of the results with one folder for each changed gearbox."""
BEARINGS = 2
"""Number of bearings with the largest strain energy that changes are proposed for."""
_REFUSALS = (GearboxFileError, GeometryError, BearingError, BalanceError, MeshError, SteadyError)
"""Errors that say that a change cannot be made."""


class ComputedProject(Protocol):
    """Gearbox with its results, as `exugear.project.Project` computes them."""

    @property
    def gearbox(self) -> Gearbox:
        """Gearbox."""

    @property
    def folder(self) -> Path:
        """Results folder."""

    @property
    def choice(self) -> Choice:
        """Model settings."""

    def replaced(self, gearbox: Gearbox, folder: Path) -> Self:
        """Return another gearbox with other results and the same settings."""

    def keep_case(self) -> None:
        """Store the gearbox file in the results folder."""

    def steady(self, settings: SteadySettings) -> xr.Dataset:
        """Return the steady-state response over speed."""

    def modes(self) -> Modes:
        """Return the modes."""

    def bearings(self) -> tuple[BearingLoadState, ...]:
        """Return the loads and lives of the bearings at the static load."""

    def tables_at_work(self) -> dict[str, MeshTable]:
        """Return the transmission error tables that the mesh model reads."""


def study_design_changes(
    project: ComputedProject, progress: Callable[[int, int, str], None] | None = None
) -> DesignStudy | None:
    """Compute what proposed design changes do to the first resonance in the operating range.

    Parameters
    ----------
    progress : called with the number of finished changes, their total, and the description of the next one

    Returns
    -------
    None if the response has no resonances in the range
    """
    settings = settings_of_study(project.gearbox)
    # The response of the unchanged gearbox has a folder, too: that of the project may be over other speeds.
    data = _project_with(project, project.gearbox, "unchanged").steady(settings)
    ranking = ranking_of(data)
    if not ranking.resonances:
        return None
    resonance = ranking.resonances[0]
    families = {mesh.family for mesh in project.gearbox.meshes}
    multiples = multiples_of(data, resonance.order, families)
    before = peaks_of(data, multiples, families, resonance.frequency, ranking.speeds)
    exciting = {family: count for base, count in multiples.items() for family in base.split(", ")}
    changes = _proposed(project, exciting, resonance)
    life = _shortest_life(project)
    results = []
    for number, change in enumerate(changes):
        if progress is not None:
            progress(number, len(changes), change.words)
        try:
            changed = _changed_project(project, change)
            response = changed.steady(settings)
            after = peaks_of(response, multiples, families, resonance.frequency, ranking.speeds)
            price = price_of(project.gearbox, changed.gearbox, (life, _shortest_life(changed)))
            results.append(ChangeResult(change, effects_of(before, after), price))
        except _REFUSALS as error:
            reason = str(error).removeprefix(f"{project.gearbox.source}: ").split("\n")[0]
            results.append(ChangeResult(change, {}, "", reason))
    study = DesignStudy(
        {key: str(data.attrs[key]) for key in ("variant", "mesh_model", "inertias")},
        str(data.attrs["input_hash"]),
        resonance.line,
        resonance.frequency,
        resonance.speed,
        {name: values[0] for name, values in before.items()},
        ordered(results),
    )
    write_design_study(project.folder / DESIGN_CHANGES_FILE, study)
    return study


def _proposed(project: ComputedProject, exciting: dict[str, int], resonance: Resonance) -> list[DesignChange]:
    deflections = {
        name: float(np.nanmean(np.abs(table.static_state["ste"].to_numpy())))
        for name, table in project.tables_at_work().items()
    }
    modes = project.modes()
    mode = modes.nearest(resonance.frequency)
    families = {bearing.name: bearing.family for bearing in project.gearbox.bearings}
    energies = dict(zip(modes.element_names, modes.strain[mode].tolist(), strict=True))
    by_energy = sorted((name for name in energies if name in families), key=lambda name: -energies[name])
    bearings = list(dict.fromkeys(families[name] for name in by_energy))[:BEARINGS]
    return propose_changes(project.gearbox, exciting, deflections, bearings)


def _changed_project(project: ComputedProject, change: DesignChange) -> ComputedProject:
    """Check the changed gearbox as a file would be."""
    gearbox = project.gearbox.varied(change.keys)
    check_parts(gearbox)
    if reason := lacking(gearbox, project.choice.variant):
        raise gearbox.error(reason)
    return _project_with(project, gearbox, change.name)


def _project_with(project: ComputedProject, gearbox: Gearbox, name: str) -> ComputedProject:
    """Give a gearbox a folder with the tables that exist: those of unchanged pairs are valid there, too."""
    folder = project.folder / FOLDER / name
    changed = project.replaced(gearbox, folder)
    changed.keep_case()
    for path in (project.folder / "tables").glob("*.nc"):
        if not (folder / "tables" / path.name).exists():
            (folder / "tables").mkdir(exist_ok=True)
            # A copy that was cut off would count as there.
            write_file(folder / "tables" / path.name, path.read_bytes())
    return changed


def _shortest_life(project: ComputedProject) -> float:
    """Shortest basic rating life of the bearings with a catalogue, million revolutions; infinite without any."""
    if project.choice.variant.spins_only:
        return math.inf
    return min((duty.basic_life for duty in project.bearings()), default=math.inf)
