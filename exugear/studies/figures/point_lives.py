"""The life of one point: rated as the verb `life` does, with tables and stresses that points share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.life.dynamic_factors.response_factors import factors, source_hash
from exugear.life.kept_angles import KeptAngles
from exugear.life.life import checked_loads, compute_life, life_hash, rating_of
from exugear.life.life_file import to_dataset
from exugear.life.load_spectrum.counted import CountedLoads
from exugear.life.stress_tables import stress_requests
from exugear.life.verdict import UNTRUSTED_REACH, check_reach
from exugear.steady.settings import SteadySettings, usual_speeds
from exugear.steady.steady_file import steady_path, stored_or_computed
from exugear.studies.figures.shared import Shared
from exugear.system.assembly import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.tables import TableRequest, requested_tables
from fe_ste.tools.stores.store import Store

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[int, int], None]
KEPT_ANGLES = "life.partial.npz"
"""Solved angles of the carrier in the folder of a point: a life that was stopped goes on from these."""


def life_loads(gearbox: Gearbox, choice: Choice) -> CountedLoads:
    """Read the loads of a life, and check all that is asked for before any work begins.

    Raises
    ------
    CaseError
        Loads that cannot be used, or that go far beyond the tables; strengths that do not fit the gears.
    """
    counted = checked_loads(gearbox)
    largest = {request.name: max(request.wanted.torque) for request in _requests(gearbox, choice, Path())}
    check_reach(gearbox, counted, largest)
    return counted


def point_life(
    assembly: Assembly, choice: Choice, shared: Shared, folder: Path, progress: Progress
) -> tuple[xr.Dataset, list[str]]:
    """Rate gears and bearings of a point.

    Parameters
    ----------
    shared : holds tables of pairs and the stresses from them
    folder : of the point: K_v of a run or a response lies there
    progress : called between steps, so that what is stopped ends

    Returns
    -------
    dataset, list of str
        As `exugear.life.life_file.to_dataset` has it, and what speaks against trusting it.

    Raises
    ------
    CaseError, BalanceError
        See `exugear.life.life.compute_life`.
    """
    gearbox = assembly.gearbox
    counted = life_loads(gearbox, choice)
    rating = rating_of(gearbox)
    static = []
    for request in _requests(gearbox, choice, shared.folder):
        shared.table(gearbox, request.name, _has_axes(choice), progress)
        place = shared.results_folder(gearbox, request.name, _has_axes(choice))
        static += requested_tables(gearbox, place, [request.name], grid=_has_axes(choice))
    requests = static if _has_axes(choice) else stress_requests(assembly, static, counted, folder)
    stresses = {request.name: shared.stresses(request, progress) for request in requests}
    dynamic = factors(assembly, rating, folder, counted.body)
    tables = {request.name: request.wanted.hash for request in requests}
    digest = life_hash(assembly, counted, tables, source_hash(assembly, rating, folder))
    angles = KeptAngles(Store(folder / KEPT_ANGLES, digest))
    life = compute_life(assembly, counted, stresses, dynamic, digest, progress, angles)
    data = to_dataset(life, gearbox.name)
    return data, [*_doubts(data)]


def _doubts(data: xr.Dataset) -> Iterator[str]:
    """Tell whose stresses lie too far beyond their tables."""
    for label, reach in zip(data["flank"].to_numpy().tolist(), data["flank_reach"].to_numpy().tolist(), strict=True):
        if reach > UNTRUSTED_REACH:
            yield f"{label}: its largest torque is {reach:.3g} times that of its table: stresses not to be trusted"


def response_of_factors(
    assembly: Assembly, choice: Choice, settings: SteadySettings | None, folder: Path, progress: Progress
) -> None:
    """Compute the steady response that K_v is taken from, at the speeds of the study or the usual ones."""
    level = rating_of(assembly.gearbox).dynamic_factor_steady
    assert level is not None
    if settings is None or settings.level != level:
        settings = SteadySettings(usual_speeds(assembly.gearbox), level)
    stored_or_computed(steady_path(folder, choice, settings), assembly, settings, progress)


def _requests(gearbox: Gearbox, choice: Choice, folder: Path) -> list[TableRequest]:
    return requested_tables(gearbox, folder, grid=_has_axes(choice))


def _has_axes(choice: Choice) -> bool:
    law = LAWS.get(choice.mesh_law)
    return law is not None and law.needs_axes
