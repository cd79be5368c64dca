"""Results of one point: computed when a output asks for them, each once."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import filelock

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import UM
from exugear.life.dynamic_factors import factors, source_hash
from exugear.life.life import UNTRUSTED_REACH, check_reach, checked_loads, compute_life, life_hash, rating_of
from exugear.life.life_file import to_dataset
from exugear.life.load_spectrum.counted import CountedLoads
from exugear.life.static_balance import KeptAngles, stress_requests
from exugear.steady.settings import SteadySettings, usual_speeds
from exugear.steady.steady_file import steady_path, stored_or_computed
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.build import assemble
from exugear.system.modes import Modes, modes_of
from exugear.system.statics import StaticState, static_state
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.element import MeshData
from exugear.system.tooth_mesh.laws.registry import LAWS, law_of
from exugear.system.tooth_mesh.tables import TableRequest, doubts_about_table, requested_tables, wanted_table
from fe_ste.root_stress import MeshCycleStress
from fe_ste.tools.stores import Store
from fe_ste.tools.threads import stop_if_asked
from fe_ste.transmission_error.table import MeshTable, TableError, TableInput, prepared_compliance

if TYPE_CHECKING:
    import xarray as xr

    from exugear.transient.runup import Solver

# Tables, stresses and reductions that points of a study share: computed once, whoever asks first, locked meanwhile

UNRELATED = (
    "name",
    "load_cases",
    "static_load",
    "damping",
    "ste",
    "housing",
    "overall",
    "report",
    "pins",
    "deviations",
)
"""Sections of a gearbox file that a reduction of its bodies does not read."""


class SharedTableError(RuntimeError):
    """A table that is not to be trusted."""


@contextmanager
def _waiting(path: Path) -> Iterator[None]:
    """Hold a lock that others wait for; the system takes it back from a process that is killed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with filelock.FileLock(path):
        yield


@dataclass(frozen=True)
class Shared:
    """Folder of what points share, by the hash of its input."""

    folder: Path

    def results_folder(self, gearbox: Gearbox, pair: str, grid: bool = False) -> Path:
        """Results folder that holds the table of a pair of this gearbox, and no other of this pair."""
        wanted = wanted_table(gearbox, pair, gearbox.ste.positions, grid or gearbox.ste.grid)
        return self.folder / "tables" / wanted.hash[:32]

    def table(
        self, gearbox: Gearbox, pair: str, grid: bool = False, progress: Callable[[int, int], None] | None = None
    ) -> MeshTable:
        """Table of a pair; the first that asks computes it, others wait for it.

        Raises
        ------
        GearboxFileError
            The pair carries no load.
        SharedTableError
            It is not to be trusted.
        """
        folder = self.results_folder(gearbox, pair, grid)
        (request,) = requested_tables(gearbox, folder, [pair], grid=grid)
        table = request.stored
        if table is None:
            with _waiting(folder / "lock"):
                (request,) = requested_tables(gearbox, folder, [pair], grid=grid)
                table = request.stored or request.compute(progress)
        doubts = list(doubts_about_table(pair, table))
        if doubts:
            raise SharedTableError("; ".join(doubts))
        return table

    def stresses(self, request: TableRequest, progress: Callable[[int, int], None] | None = None) -> MeshCycleStress:
        """Stresses of a pair from its table of loads and misalignments, which is computed first; likewise.

        Raises
        ------
        SharedTableError
            The table is not to be trusted.
        """
        from exugear.life.gear_life import pair_stresses

        folder = self.folder / "stress" / request.wanted.hash[:32]
        if request.stored is None:
            path = folder / f"{request.name}.states.nc"
            request = replace(request, path=path, stored=_stored(path, request.wanted))
        with _waiting(folder / "lock"):
            table = request.stored or _stored(request.path, request.wanted) or request.compute(progress)
            doubts = list(doubts_about_table(request.name, table))
            if doubts:
                raise SharedTableError("; ".join(doubts))
            return pair_stresses([replace(request, stored=table)], folder)[request.name]

    def bodies(self, gearbox: Gearbox, inertias: str) -> dict[str, ElasticBody]:
        """Reduced elastic bodies; likewise."""
        from exugear.system.bodies.of_gearbox import reduced_bodies

        own = {key: value for key, value in gearbox.content.items() if key not in UNRELATED}
        key = hashlib.sha256(json.dumps(own, sort_keys=True).encode()).hexdigest()
        folder = self.folder / "bodies"
        with _waiting(folder / f"{key[:32]}.lock"):
            return reduced_bodies(gearbox, inertias, folder)


def _stored(path: Path, wanted: TableInput) -> MeshTable | None:
    try:
        return MeshTable.open(path, wanted)
    except TableError:
        return None


# The life of one point: rated as the verb `life` does, with tables and stresses that points share

Progress = Callable[[int, int], None]
KEPT_ANGLES = "life.partial.npz"
"""Solved angles of the carrier in the folder of a point: a life that was stopped goes on from these."""


def life_loads(gearbox: Gearbox, choice: Choice) -> CountedLoads:
    """Read the loads of a life, and check all that is asked for before any work begins.

    Raises
    ------
    GearboxFileError
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
    GearboxFileError, BalanceError
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
            yield f"{label}: the largest torque is {reach:.3g} times the largest torque of its table: stresses invalid"


def response_of_factors(
    assembly: Assembly, choice: Choice, settings: SteadySettings | None, folder: Path, progress: Progress
) -> None:
    """Compute the steady response that K_v is taken from, at the speeds of the study or the usual ones."""
    level = rating_of(assembly.gearbox).dynamic_factor_steady
    assert level is not None
    if settings is None or settings.method != level:
        settings = SteadySettings(usual_speeds(assembly.gearbox), level)
    stored_or_computed(steady_path(folder, choice, settings), assembly, settings, progress)


def _requests(gearbox: Gearbox, choice: Choice, folder: Path) -> list[TableRequest]:
    return requested_tables(gearbox, folder, grid=_has_axes(choice))


def _has_axes(choice: Choice) -> bool:
    law = LAWS.get(choice.mesh_model)
    return law is not None and law.needs_axes


# Results of one point: computed when a output asks for them, each once


class PointError(RuntimeError):
    """A point that cannot give a figure."""


@dataclass(frozen=True)
class PointSettings:
    """What results of points are computed with."""

    steady: SteadySettings | None = None
    duration: float | None = None
    """Of runs, s; that of the load case by default."""
    solver: Solver | None = None
    """Str, optional. Of runs."""


@dataclass
class PointResults:
    """What is computed of one variation of a gearbox."""

    gearbox: Gearbox
    choice: Choice
    settings: PointSettings
    shared: Shared
    folder: Path
    """Where a run grows; removed by `clear`."""
    doubts: list[str] = field(default_factory=list)
    """What speaks against trusting the numbers."""

    def table(self, pair: str) -> MeshTable:
        """Table of the transmission error of a pair.

        Raises
        ------
        PointError
            There is no such pair.
        """
        if pair not in self.gearbox.pairs:
            raise PointError(f"no gear pair {pair!r}; pairs are {', '.join(self.gearbox.pairs)}")
        return self.shared.table(self.gearbox, pair, progress=_ignore_progress)

    @cached_property
    def stiffness(self) -> dict[str, MeshData]:
        """Mesh stiffness by pair at work, as the mesh law needs it."""
        law = LAWS.get(self.choice.mesh_model)
        if law is not None and not law.has_force:
            return {}
        found: dict[str, MeshData] = {}
        reader = law_of(self.choice.mesh_model)
        for pair in dict.fromkeys(mesh.pair.name for mesh in self.gearbox.meshes):
            folder = Path()
            if law is not None and law.needs_tables and (law.needs_axes or pair not in self.gearbox.stated_stiffness):
                self.shared.table(self.gearbox, pair, law.needs_axes, _ignore_progress)
                folder = self.shared.results_folder(self.gearbox, pair, law.needs_axes)
            found[pair] = reader.read(self.gearbox, pair, folder)
        return found

    @cached_property
    def bodies(self) -> dict[str, ElasticBody]:
        """Reduced elastic bodies of the variant."""
        if not self.choice.variant.is_elastic:
            return {}
        return self.shared.bodies(self.gearbox, self.choice.inertia_set(self.gearbox))

    @cached_property
    def assembly(self) -> Assembly:
        """Equations of motion."""
        return assemble(self.gearbox, self.choice, self.stiffness, self.bodies)

    @cached_property
    def static(self) -> StaticState:
        """State at rest under the static load."""
        return static_state(self.assembly)

    @cached_property
    def modes(self) -> Modes:
        """Eigenmodes at the static load."""
        return modes_of(self.assembly)

    @cached_property
    def steady(self) -> xr.Dataset:
        """Steady response over speed.

        Raises
        ------
        PointError
            The study does not say over which speeds.
        """
        if self.settings.steady is None:
            raise PointError("results of the steady-state response require a section [steady] with speeds")
        from exugear.steady.steady_file import to_dataset
        from exugear.steady.steady_response import response_of

        return to_dataset(response_of(self.assembly, self.settings.steady, progress=_ignore_progress))

    @cached_property
    def run(self) -> xr.Dataset:
        """Load case in time; one that was stopped is gone on with.

        Raises
        ------
        RunError
            It went wrong.
        KeyboardInterrupt
            The user stopped it.
        """
        from exugear.results.run_file import load_run

        return load_run(self._simulated(self.choice))

    def _simulated(self, choice: Choice) -> Path:
        """File of a run; doubts about it are kept."""
        from exugear.results.folder import run_directory
        from exugear.transient.runup import simulate
        from exugear.transient.start import refuse_to_resume

        resume = not refuse_to_resume(run_directory(self.folder, choice))
        run = simulate(
            self.gearbox,
            choice,
            self.stiffness,
            self.folder,
            bodies=self.bodies,
            duration=self.settings.duration,
            solver=self.settings.solver,
            resume=resume,
            progress=lambda _: stop_if_asked(),
        )
        if not run.complete:
            raise KeyboardInterrupt
        self.doubts += run.reasons
        return run.path

    @cached_property
    def life(self) -> xr.Dataset:
        """Life of gears and bearings under the loads of the gearbox file, as `exugear life` has it.

        K_v of a run or of a steady response is computed first: a point has no results folder that holds one.

        Raises
        ------
        GearboxFileError
            No loads or strengths, or such as cannot be used.
        BalanceError
            A static state that is not held.
        """
        from exugear.life.life import rating_of
        # imported here before

        rating = rating_of(self.gearbox)
        if rating.dynamic_factor_run is not None:
            self._simulated(replace(self.choice, load_case=rating.dynamic_factor_run))
        elif rating.dynamic_factor_steady is not None:
            response_of_factors(self.assembly, self.choice, self.settings.steady, self.folder, _ignore_progress)
        data, doubts = point_life(self.assembly, self.choice, self.shared, self.folder, _ignore_progress)
        self.doubts += doubts
        return data

    def states(
        self, pair: str, positions: int, torque_factors: Sequence[float], misalignment_um: Sequence[float]
    ) -> xr.Dataset:
        """States of contact of a pair over loads and misalignments, kept for the next output that asks the same."""
        key = (pair, positions, tuple(torque_factors), tuple(misalignment_um))
        if key not in self._states:
            self._states[key] = self._computed_states(*key)
        return self._states[key]

    @cached_property
    def _states(self) -> dict[tuple[str, int, tuple[float, ...], tuple[float, ...]], xr.Dataset]:
        return {}

    def _computed_states(
        self, pair: str, positions: int, torque_factors: tuple[float, ...], misalignment_um: tuple[float, ...]
    ) -> xr.Dataset:
        from fe_ste.transmission_error.transmission_error import static_transmission_error

        if pair not in self.gearbox.pairs:
            raise PointError(f"no gear pair {pair!r}; pairs are {', '.join(self.gearbox.pairs)}")
        wanted = wanted_table(self.gearbox, pair, positions)
        width = self.gearbox.pairs[pair].pair.face_width
        return static_transmission_error(
            prepared_compliance(wanted),
            [factor * wanted.torque[0] for factor in torque_factors],
            positions,
            misalignment=[UM * opening / width for opening in misalignment_um],
            progress=_ignore_progress,
        )

    def clear(self) -> None:
        """Remove what a run left in the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)


def _ignore_progress(done: int, total: int) -> None:
    stop_if_asked()
