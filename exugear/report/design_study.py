"""Design changes of a project: tables, static state and steady-state response of each changed gearbox.

`exugear.report.findings.proposals` proposes the changes, and `exugear.report.findings.design_changes` compares the
results. Each changed gearbox has a subfolder of the results, so that a stopped study resumes, and a repeated one reads
its results.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol, Self

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import gearbox_at_load
from exugear.gearbox.reading import GearboxFileError
from exugear.report.findings.design_changes import (
    ChangeResult,
    DesignStudy,
    effects_of,
    least_favourable,
    multiples_of,
    objection_to,
    ordered,
    peaks_of,
    price_of,
    settings_of_study,
    write_design_study,
)
from exugear.report.findings.margins import (
    Margin,
    failing,
    families_short_of_pitting,
    margins_in_words,
    margins_of,
    raised_in_words,
    shortfalls_of,
)
from exugear.report.findings.proposals import ASSUMPTION, DesignChange, alignment_change, propose_changes
from exugear.report.findings.ranking import Resonance, ranking_of
from exugear.report.findings.words import QUANTITIES, excitations_at, rounded_text
from exugear.results.folder import DESIGN_CHANGES_FILE, bodies_folder
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.settings import SteadySettings
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.gearbox_checks import check_parts, lacking
from exugear.system.statics import BalanceError, static_state
from exugear.system.tooth_mesh.placement import MeshError
from fe_ste.geometry.checks import GeometryError
from fe_ste.tools.files import write_file

if TYPE_CHECKING:
    import xarray as xr

    from exugear.system.modes import Modes
    from exugear.system.system import Assembly
    from fe_ste.transmission_error.table import MeshTable

FOLDER = "design-changes"
"""Subfolder of the results with one folder for each changed gearbox."""
LEAST_ENERGY = 0.1
"""Fraction of the strain energy from which changes of a bearing or a coupling are proposed."""
STATIC = "static load"
"""Load by default."""
MOST_LOAD = 3.0
"""Largest load over the static load."""
TOLERANCE_UM = 2.0
"""Tolerance of tip relief for which the transmission error is computed, too; grinding keeps a few micrometres."""
NOT_RATED = "its life cannot be computed (`exugear life`)"
_REFUSALS = (GearboxFileError, GeometryError, BearingError, BalanceError, MeshError, SteadyError)
"""Errors that say that a change cannot be made."""


class Rated(NamedTuple):
    """What a rating says of a gearbox."""

    margins: dict[str, Margin]
    shortfalls: list[str]
    """Parts that fall short of a requirement, as sentences."""
    short_of_pitting: frozenset[str] = frozenset()
    """Families of meshes that fall short of the safety against pitting."""


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

    def assembly(self) -> Assembly:
        """Return the equations of motion."""

    def life(self) -> xr.Dataset:
        """Rate gears and bearings under the load spectrum."""

    def stiffness(self) -> object:
        """Compute missing transmission error tables of the mesh model."""

    def tables_at_work(self) -> dict[str, MeshTable]:
        """Return the transmission error tables that the mesh model reads."""


def study_design_changes(
    project: ComputedProject,
    progress: Callable[[int, int, str], None] | None = None,
    *,
    resonance: int = 1,
    quantity: str | None = None,
    loads: Sequence[str] = (),
) -> DesignStudy | None:
    """Compute what design changes do to a resonance in the operating range; None if it has no such resonance.

    Parameters
    ----------
    progress : called with the number of finished changes, their total, and the description of the next one
    resonance : rank of the resonance at the first load
    quantity : quantity that decides, as in `exugear.report.findings.ranking.DECIDING`; by default that of the file
    loads : names of load cases, or percentages of the static load such as ``50%``; by default the static load

    Raises
    ------
    GearboxFileError
        A load is not known.
    """
    settings = settings_of_study(project.gearbox)
    wanted = quantity or project.gearbox.case.report.quantity
    points = loads or (STATIC,)
    # The response of the unchanged gearbox has a folder, too: that of the project may be over other speeds.
    unchanged = {load: _at_load(project, project.gearbox, "unchanged", load) for load in points}
    responses = {load: own.steady(settings) for load, own in unchanged.items()}
    data = responses[points[0]]
    ranking = ranking_of(data, wanted=wanted)
    if len(ranking.resonances) < resonance:
        return None
    chosen = ranking.resonances[resonance - 1]
    families = {mesh.family for mesh in project.gearbox.meshes}
    multiples = multiples_of(data, chosen.order, families)

    def peaks(response: xr.Dataset) -> dict[str, tuple[float, float]]:
        return peaks_of(response, multiples, families, chosen.frequency, ranking.speeds)

    before = {load: peaks(response) for load, response in responses.items()}
    exciting = {family: count for base, count in multiples.items() for family in base.split(", ")}
    rated = _margins(_project_with(project, project.gearbox, "unchanged"))
    labels = {name: label.column for name, label in QUANTITIES.items()}
    changes = _proposed(project, exciting, chosen)
    if rated is not None and rated.short_of_pitting:
        changes += _alignments(project, rated.short_of_pitting)
    results = []
    for number, change in enumerate(changes):
        if progress is not None:
            progress(number, len(changes), change.words)
        if change.reason:
            results.append(ChangeResult(change, {}, refusal=change.reason))
            continue
        try:
            gearbox = project.gearbox.varied(change.keys)
            # Check the changed gearbox as a file would be.
            check_parts(gearbox)
            if reason := lacking(gearbox, project.choice.variant):
                raise gearbox.error(reason)
            after = {load: peaks(_at_load(project, gearbox, change.name, load).steady(settings)) for load in points}
            effects = least_favourable([effects_of(before[load], after[load]) for load in points])
            costs = [price_of(project.gearbox, gearbox, nominal=rated is None)]
            objection = objection_to(effects, ranking.quantity, labels)
            remedy = ""
            # The rating takes as long as the response: only a change that is worth it is rated.
            worth = not objection and change.group != ASSUMPTION
            if worth:
                costs.append(relief_tolerance(project, change))
            if rated is not None and (worth or change.requirement):
                changed = _margins(_project_with(project, gearbox, change.name))
                failed = [NOT_RATED] if changed is None else _failures(rated, changed)
                if changed is not None:
                    costs.append(margins_in_words(rated.margins, changed.margins))
                    remedy = raised_in_words(rated.margins, changed.margins, change.requirement)
                    remedy += f", but {failed[0]}" if remedy and failed else ""
                objection = objection or (f"fails a requirement: {failed[0]}" if failed else "")
            price = "; ".join(filter(None, costs))
            results.append(ChangeResult(change, effects, price, objection, remedy=remedy))
        except _REFUSALS as error:
            reason = str(error).removeprefix(f"{project.gearbox.source}: ").split("\n")[0]
            results.append(ChangeResult(change, {}, refusal=reason))
    study = DesignStudy(
        {key: str(data.attrs[key]) for key in ("variant", "mesh_model", "inertias")},
        settings.hash_with(project.assembly()),
        chosen.line,
        chosen.frequency,
        chosen.speed,
        {name: values[0] for name, values in before[points[0]].items()},
        ordered(results, ranking.quantity),
        ranking.quantity,
        resonance,
        list(points),
        _requirements(project.gearbox, rated),
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
    families |= {coupling.name: coupling.name for coupling in project.gearbox.couplings}
    strain = dict(zip(modes.element_names, modes.strain[mode].tolist(), strict=True))
    energies: dict[str, float] = {}
    for name, energy in strain.items():
        if name in families:
            energies[families[name]] = energies.get(families[name], 0.0) + energy
    least = LEAST_ENERGY * sum(strain.values())
    strained = sorted((name for name in energies if energies[name] >= least), key=lambda name: -energies[name])
    couplings = [name for name in strained if name in project.gearbox.case.couplings]
    bearings = [name for name in strained if name not in couplings]
    acting = excitations_at(project.gearbox, resonance.order)
    return propose_changes(project.gearbox, exciting, deflections, bearings, couplings, acting)


def _alignments(project: ComputedProject, families: Collection[str]) -> list[DesignChange]:
    """Helix slopes for the mean gap of each family of meshes under the static load."""
    state = static_state(project.assembly())
    meshes = [element.mesh for element in state.assembly.elements]
    openings = state.misalignment * np.array([mesh.pair.face_width for mesh in meshes])
    found = (
        alignment_change(
            project.gearbox,
            family,
            float(np.mean([own for own, mesh in zip(openings, meshes, strict=True) if mesh.family == family])),
        )
        for family in sorted(families)
    )
    return [change for change in found if change is not None]


def relief_tolerance(project: ComputedProject, change: DesignChange) -> str:
    """Say what `TOLERANCE_UM` less and more tip relief than a change states does to the static transmission error.

    Tables at both limits are computed. Changes of no tip relief, and pairs without a table, have no text.
    """
    reliefs = {key: value for key, value in change.keys.items() if key.endswith(".tip_relief_um") and value > 0.0}
    if not reliefs:
        return ""
    errors = []
    for off, name in ((0.0, ""), (-TOLERANCE_UM, "-less-by-tolerance"), (TOLERANCE_UM, "-more-by-tolerance")):
        limits = {key: max(value + off, 0.0) for key, value in reliefs.items()}
        varied = _project_with(project, project.gearbox.varied({**change.keys, **limits}), f"{change.name}{name}")
        varied.stiffness()
        found = varied.tables_at_work()
        errors.append({pair: 1e6 * float(np.ptp(own.static_state["ste"].to_numpy())) for pair, own in found.items()})
    changed = {key.split(".")[1] for key in reliefs}
    texts = []
    for pair, section in project.gearbox.case.pairs.items():
        if changed & {section.pinion, section.gear} and all(pair in swings for swings in errors):
            stated, less, more = (rounded_text(swings[pair]) for swings in errors)
            texts.append(
                f"static transmission error of {pair} {stated} µm peak-to-peak; with {TOLERANCE_UM:g} µm less tip "
                f"relief {less} µm, with {TOLERANCE_UM:g} µm more {more} µm"
            )
    return "; ".join(texts)


def at_load(gearbox: Gearbox, load: str) -> Gearbox:
    """Return a gearbox with the load of a load case, or with a percentage of its static load, as its static load.

    Raises
    ------
    GearboxFileError
        There is no such load case, or the percentage is no positive number.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> at_load(gearbox, "50%").case.static_load.torques_N_m
    {'carrier': 120000.0}
    """
    if load == STATIC:
        return gearbox
    if load in gearbox.load_cases:
        return gearbox_at_load(gearbox, gearbox.load_cases[load])
    try:
        share = 0.01 * float(load.removesuffix("%"))
    except ValueError:
        share = math.nan
    if not (load.endswith("%") and 0.0 < share <= MOST_LOAD):
        known = ", ".join(gearbox.load_cases) or "none in the file"
        raise gearbox.error(
            f"no load {load!r}; specify a load case ({known}) or a percentage of the static load from above 0 to "
            f"{100.0 * MOST_LOAD:g}, such as 50%"
        )
    torques = gearbox.case.static_load.torques_N_m
    return gearbox.varied({"static_load.torques_N_m": {body: share * torque for body, torque in torques.items()}})


def _at_load(project: ComputedProject, gearbox: Gearbox, name: str, load: str) -> ComputedProject:
    loaded = at_load(gearbox, load)
    return _project_with(project, loaded, name if load == STATIC else f"{name}-at-{load.replace('%', '-percent')}")


def _project_with(project: ComputedProject, gearbox: Gearbox, name: str) -> ComputedProject:
    """Give a gearbox a folder with the tables and reduced bodies that exist: of unchanged parts they are valid, too."""
    folder = project.folder / FOLDER / name
    changed = project.replaced(gearbox, folder)
    changed.keep_case()
    for path in (*(project.folder / "tables").glob("*.nc"), *bodies_folder(project.folder).glob("*.np*")):
        copy = folder / path.relative_to(project.folder)
        if not copy.exists():
            copy.parent.mkdir(exist_ok=True)
            # A copy that was cut off would count as there.
            write_file(copy, path.read_bytes())
    return changed


def _requirements(gearbox: Gearbox, rated: Rated | None) -> list[str]:
    """Return what the unchanged gearbox falls short of, or that this is not known although the file has a rating."""
    if rated is not None:
        return rated.shortfalls
    if gearbox.case.loads is None or gearbox.case.rating is None:
        return []
    return [f"no requirement is checked: {NOT_RATED}"]


def _failures(before: Rated, after: Rated) -> list[str]:
    """Return the requirements that a change fails and the unchanged gearbox does not, or not by as much."""
    known = {line.split(" = ")[0] for line in before.shortfalls}
    new = [line for line in after.shortfalls if line.split(" = ")[0] not in known]
    return [*new, *failing(before.margins, after.margins)]


def _margins(project: ComputedProject) -> Rated | None:
    """Rate a gearbox: its margins, and what falls short; None without a load spectrum or where it cannot be rated."""
    case = project.gearbox.case
    if case.loads is None or case.rating is None:
        return None
    try:
        data = project.life()
    except _REFUSALS:
        return None
    return Rated(margins_of(data, case.rating), shortfalls_of(data), families_short_of_pitting(data, case.rating))
