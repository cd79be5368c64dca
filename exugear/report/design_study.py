"""Design changes of a project: tables, static state and steady-state response of each changed gearbox.

`exugear.report.findings.design_changes` has the proposals and what is compared. Each changed gearbox has a subfolder of
the results, so that a stopped study resumes, and a repeated one reads its results.
"""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.reading import GearboxFileError
from exugear.report.findings.design_changes import (
    ChangeResult,
    DesignChange,
    effects_in_decibels,
    effects_of,
    exciting_families,
    ordered,
    peaks_of,
    price_of,
    propose_changes,
)
from exugear.report.findings.loudness import Resonance, ranking_of
from exugear.results.folder import DESIGN_CHANGES_FILE
from exugear.steady.mean_system.rotating_frame import SteadyError
from exugear.steady.settings import SpeedRange, SteadySettings, usual_speeds
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.readiness import check_parts, lacking
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.placement import MeshError
from fe_ste.geometry.checks import GeometryError
from fe_ste.tools.files import write_file

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

    from exugear.system.bearings.duty import BearingLoadState
    from exugear.system.modes import Modes
    from fe_ste.transmission_error.table import MeshTable

FOLDER = "design-changes"
"""Subfolder of the results with one folder for each changed gearbox."""
SPEEDS = 180
"""Even speeds over the operating range; speeds at resonances are added."""
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


@dataclass(frozen=True)
class DesignStudy:
    """Results of all design changes."""

    resonance: Resonance
    """First resonance of the ranking in the operating range, which the changes are to reduce."""
    results: tuple[ChangeResult, ...]
    """Changes of the design by their effect, then assumptions, then changes that cannot be made."""
    path: Path
    """File with the results."""

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw what each change does to the three quantities, in dB, as `exugear report --levers` lists it.

        Narrow dark bars: this peak; wide pale bars: highest amplitude of any order in the operating range. Changes that
        cannot be made are left out.

        Parameters
        ----------
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Examples
        --------
        >>> from exugear.report.findings.design_changes import Effect
        >>> wider = DesignChange("wider", "face width 40 to 48 mm", "gear", {})
        >>> results = (ChangeResult(wider, {"error": Effect(-6.0, -3.5)}, "+2 kg"),)
        >>> ax = DesignStudy(Resonance("stage_1", 21.0, 100.0, 334.0, {}), results, Path("changes.json")).plot()
        >>> [label.get_text() for label in ax.get_yticklabels()], [float(bar.get_width()) for bar in ax.patches]
        (['face width 40 to 48 mm'], [-3.5, -6.0])
        """
        from exugear.report.pictures.diagrams import draw_effects  # for drawing only

        made = [result for result in self.results if not result.refusal]
        return draw_effects([result.change.words for result in made], effects_in_decibels(made), ax)


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
    settings = SteadySettings(_speeds(project.gearbox))
    data = project.steady(settings)
    ranking = ranking_of(data)
    if not ranking.resonances:
        return None
    resonance = ranking.resonances[0]
    speed = abs(resonance.speed)
    before = peaks_of(data, resonance.order, speed, ranking.speeds)
    changes = _proposed(project, data, resonance)
    life = _shortest_life(project)
    results = []
    for number, change in enumerate(changes):
        if progress is not None:
            progress(number, len(changes), change.words)
        try:
            changed = _changed_project(project, change)
            response = changed.steady(settings)
            after = peaks_of(response, resonance.order, speed, ranking.speeds)
            price = price_of(project.gearbox, changed.gearbox, (life, _shortest_life(changed)))
            results.append(ChangeResult(change, effects_of(before, after), price))
        except _REFUSALS as error:
            reason = str(error).removeprefix(f"{project.gearbox.source}: ").split("\n")[0]
            results.append(ChangeResult(change, {}, "", reason))
    study = DesignStudy(resonance, tuple(ordered(results)), project.folder / DESIGN_CHANGES_FILE)
    content = {
        "input_hash": str(data.attrs["input_hash"]),
        "order": resonance.line,
        "frequency_Hz": resonance.frequency,
        "speed_rad_per_s": resonance.speed,
        "amplitudes": {name: values[0] for name, values in before.items()},
        "results": [asdict(result) for result in study.results],
    }
    write_file(study.path, json.dumps(content, indent=1).encode("utf-8"))
    return study


def _speeds(gearbox: Gearbox) -> SpeedRange:
    """Speeds of the operating range; those of the first load case without one."""
    usual = usual_speeds(gearbox)
    stated = operating_range(gearbox)
    if stated is None:
        return usual
    low, high = (math.copysign(speed, usual.last) for speed in stated)
    return SpeedRange(low, high, SPEEDS)


def _proposed(project: ComputedProject, data: xr.Dataset, resonance: Resonance) -> list[DesignChange]:
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
    return propose_changes(project.gearbox, resonance, exciting_families(data, resonance), deflections, bearings)


def _changed_project(project: ComputedProject, change: DesignChange) -> ComputedProject:
    """Check the changed gearbox as a file would be, and give it a folder with the tables there are.

    Tables of pairs that the change does not touch fit there, too.
    """
    gearbox = project.gearbox.varied(change.keys)
    check_parts(gearbox)
    if reason := lacking(gearbox, project.choice.variant):
        raise gearbox.fault(reason)
    folder = project.folder / FOLDER / change.name
    changed = project.replaced(gearbox, folder)
    changed.keep_case()
    for path in (project.folder / "tables").glob("*.nc"):
        if not (folder / "tables" / path.name).exists():
            (folder / "tables").mkdir(exist_ok=True)
            shutil.copy2(path, folder / "tables" / path.name)
    return changed


def _shortest_life(project: ComputedProject) -> float:
    """Shortest basic rating life of the bearings with a catalogue, million revolutions; infinite without any."""
    if project.choice.variant.spins_only:
        return math.inf
    return min((duty.basic_life for duty in project.bearings()), default=math.inf)
