"""Results of one point, each computed once when an output requires it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import filelock

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import UM
from exugear.life.dynamic_factors import factors
from exugear.life.gear_life import pair_stresses
from exugear.life.life import UNTRUSTED_REACH, check_reach, checked_loads, compute_life, life_hash, rating_of
from exugear.life.life_file import to_dataset
from exugear.life.load_spectrum.counted import CountedLoads
from exugear.life.static_balance import KeptAngles, stored_table, stress_requests
from exugear.results.folder import content_digest, run_directory
from exugear.results.run_file import load_run
from exugear.steady.settings import SteadySettings, usual_speeds
from exugear.steady.steady_file import steady_path, stored_or_computed
from exugear.steady.steady_response import response_of
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.of_gearbox import reduced_bodies
from exugear.system.build import assemble
from exugear.system.modes import Modes, modes_of
from exugear.system.statics import StaticState, static_state
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.element import MeshData
from exugear.system.tooth_mesh.laws.registry import LAWS, law_of
from exugear.system.tooth_mesh.tables import TableRequest, requested_tables, table_warnings, wanted_table
from exugear.transient.runup import Solver, simulate
from exugear.transient.start import refuse_to_resume
from fe_ste.root_stress import MeshCycleStress
from fe_ste.tools.processes import stop_if_asked
from fe_ste.tools.stores import Store
from fe_ste.transmission_error.table import MeshTable, prepared_compliance
from fe_ste.transmission_error.transmission_error import static_transmission_error

if TYPE_CHECKING:
    import xarray as xr


# Tables, stresses and reductions shared by the points of a study: computed once under a lock, by the first to need them

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
    "excitations",
)
"""Sections of a gearbox file that do not affect the reduction of its bodies."""


class SharedTableError(RuntimeError):
    """Error: a table failed a validity check."""


@contextmanager
def _waiting(path: Path) -> Iterator[None]:
    """Hold a lock that other processes wait for; the system releases it if a process is killed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with filelock.FileLock(path):
        yield


@dataclass(frozen=True)
class Shared:
    """Folder of results shared by points, by the hash of their input."""

    folder: Path

    def results_folder(self, gearbox: Gearbox, pair: str, grid: bool = False) -> Path:
        """Return the results folder with the table of a pair of this gearbox and no other table of this pair."""
        wanted = wanted_table(gearbox, pair, gearbox.ste.positions, grid or gearbox.ste.grid)
        return self.folder / "tables" / wanted.hash[:32]

    def table(
        self, gearbox: Gearbox, pair: str, grid: bool = False, progress: Callable[[int, int], None] | None = None
    ) -> MeshTable:
        """Return the table of a pair; the first process computes it, others wait for it.

        Raises
        ------
        GearboxFileError
            The pair carries no load.
        SharedTableError
            The table failed a validity check.
        """
        folder = self.results_folder(gearbox, pair, grid)
        (request,) = requested_tables(gearbox, folder, [pair], grid=grid)
        table = request.stored
        if table is None:
            with _waiting(folder / "lock"):
                (request,) = requested_tables(gearbox, folder, [pair], grid=grid)
                table = request.stored or request.compute(progress)
        doubts = list(table_warnings(pair, table))
        if doubts:
            raise SharedTableError("; ".join(doubts))
        return table

    def stresses(self, request: TableRequest, progress: Callable[[int, int], None] | None = None) -> MeshCycleStress:
        """Return the stresses of a pair from its table of loads and misalignments; both computed once, under a lock.

        Raises
        ------
        SharedTableError
            The table failed a validity check.
        """
        folder = self.folder / "stress" / request.wanted.hash[:32]
        if request.stored is None:
            path = folder / f"{request.name}.states.nc"
            request = replace(request, path=path, stored=stored_table(path, request.wanted))
        with _waiting(folder / "lock"):
            table = request.stored or stored_table(request.path, request.wanted) or request.compute(progress)
            doubts = list(table_warnings(request.name, table))
            if doubts:
                raise SharedTableError("; ".join(doubts))
            return pair_stresses([replace(request, stored=table)], folder)[request.name]

    def bodies(self, gearbox: Gearbox, inertias: str) -> dict[str, ElasticBody]:
        """Return the reduced flexible bodies; computed once, under a lock."""
        related = {key: value for key, value in gearbox.content.items() if key not in UNRELATED}
        folder = self.folder / "bodies"
        with _waiting(folder / f"{content_digest(related)[:32]}.lock"):
            return reduced_bodies(gearbox, inertias, folder)


# Rating and life of one point, as in the command `life`, with shared tables and stresses

KEPT_ANGLES = "life.partial.npz"
"""File with the solved carrier angles in the folder of a point, from which an interrupted rating resumes."""


def life_loads(gearbox: Gearbox, choice: Choice) -> CountedLoads:
    """Read the load spectrum and check all required input before any computation.

    Raises
    ------
    GearboxFileError
        Invalid loads, or loads far beyond the tables; strengths that do not fit the gears.
    """
    counted = checked_loads(gearbox)
    requests = requested_tables(gearbox, Path(), grid=_has_axes(choice))
    largest = {request.name: max(request.wanted.torque) for request in requests}
    check_reach(gearbox, counted, largest)
    return counted


def _has_axes(choice: Choice) -> bool:
    law = LAWS.get(choice.mesh_model)
    return law is not None and law.needs_axes


class PointError(RuntimeError):
    """Error: a point cannot provide an output."""


@dataclass(frozen=True)
class PointSettings:
    """Settings for the results of points."""

    steady: SteadySettings | None = None
    duration: float | None = None
    """Duration of runs, s; by default that of the load case."""
    solver: Solver | None = None


@dataclass
class PointResults:
    """Results computed for one variation of a gearbox."""

    gearbox: Gearbox
    choice: Choice
    settings: PointSettings
    shared: Shared
    folder: Path
    """Working folder of a run."""
    doubts: list[str] = field(default_factory=list)
    """Warnings about the validity of the results."""
    _states: dict[tuple[Any, ...], xr.Dataset] = field(default_factory=dict, init=False, repr=False)

    def table(self, pair: str) -> MeshTable:
        """Return the transmission error table of a pair.

        Raises
        ------
        PointError
            There is no such pair.
        """
        self._check_pair(pair)
        return self.shared.table(self.gearbox, pair, progress=_ignore_progress)

    def _check_pair(self, pair: str) -> None:
        if pair not in self.gearbox.pairs:
            raise PointError(f"no gear pair {pair!r}; pairs are {', '.join(self.gearbox.pairs)}")

    @cached_property
    def stiffness(self) -> dict[str, MeshData]:
        """Mesh stiffness by active pair, as required by the mesh model."""
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
        """Reduced flexible bodies of the variant."""
        if not self.choice.variant.is_elastic:
            return {}
        return self.shared.bodies(self.gearbox, self.choice.inertia_set(self.gearbox))

    @cached_property
    def assembly(self) -> Assembly:
        """Equations of motion."""
        return assemble(self.gearbox, self.choice, self.stiffness, self.bodies)

    @cached_property
    def static(self) -> StaticState:
        """Static equilibrium under the static load."""
        return static_state(self.assembly)

    @cached_property
    def modes(self) -> Modes:
        """Eigenmodes at the static load."""
        return modes_of(self.assembly)

    @cached_property
    def steady(self) -> xr.Dataset:
        """Steady-state response over speed.

        Raises
        ------
        PointError
            The study has no speed range.
        """
        if self.settings.steady is None:
            raise PointError("results of the steady-state response require a section [steady] with speeds")
        from exugear.steady.steady_file import to_dataset, with_names

        return with_names(to_dataset(response_of(self.assembly, self.settings.steady, progress=_ignore_progress)))

    @cached_property
    def run(self) -> xr.Dataset:
        """Load case in time; an interrupted run is resumed.

        Raises
        ------
        RunError
            The run failed.
        KeyboardInterrupt
            The user stopped it.
        """
        return load_run(self._simulated(self.choice))

    def _simulated(self, choice: Choice) -> Path:
        """Return the file of a run; warnings about its validity are stored."""
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
        """Rating and life of gears and bearings under the load spectrum of the gearbox file, as from `exugear life`.

        The run or steady-state response for K_v is computed first, because a point has no results folder with one.

        Raises
        ------
        GearboxFileError
            Missing or invalid loads or strengths.
        BalanceError
            A static state without equilibrium.
        """
        rating = rating_of(self.gearbox)
        if rating.dynamic_factor_run is not None:
            self._simulated(replace(self.choice, load_case=rating.dynamic_factor_run))
        elif rating.dynamic_factor_steady is not None:
            settings = self.settings.steady
            if settings is None or settings.method != rating.dynamic_factor_steady:
                settings = SteadySettings(usual_speeds(self.gearbox), rating.dynamic_factor_steady)
            path = steady_path(self.folder, self.choice, settings)
            stored_or_computed(path, self.assembly, settings, _ignore_progress)
        assembly = self.assembly
        counted = life_loads(assembly.gearbox, self.choice)
        grid = _has_axes(self.choice)
        static = []
        for request in requested_tables(assembly.gearbox, self.shared.folder, grid=grid):
            self.shared.table(assembly.gearbox, request.name, grid, _ignore_progress)
            place = self.shared.results_folder(assembly.gearbox, request.name, grid)
            static += requested_tables(assembly.gearbox, place, [request.name], grid=grid)
        requests = static if grid else stress_requests(assembly, static, counted, self.folder)
        stresses = {request.name: self.shared.stresses(request, _ignore_progress) for request in requests}
        dynamic = factors(assembly, rating, self.folder, counted.body)
        digest = life_hash(assembly, counted, requests, self.folder)
        angles = KeptAngles(Store(self.folder / KEPT_ANGLES, digest))
        life = compute_life(assembly, counted, stresses, dynamic, digest, _ignore_progress, angles)
        data = to_dataset(life, assembly.gearbox.name)
        reaches = zip(data["flank"].to_numpy().tolist(), data["flank_reach"].to_numpy().tolist(), strict=True)
        self.doubts += [
            f"{label}: the largest torque is {reach:.3g} times the largest torque of its table: stresses invalid"
            for label, reach in reaches
            if reach > UNTRUSTED_REACH
        ]
        return data

    def states(
        self, pair: str, positions: int, torque_factors: Sequence[float], misalignment_um: Sequence[float]
    ) -> xr.Dataset:
        """Return contact states of a pair over loads and misalignments, cached for outputs with the same settings."""
        key = (pair, positions, tuple(torque_factors), tuple(misalignment_um))
        if key not in self._states:
            self._check_pair(pair)
            wanted = wanted_table(self.gearbox, pair, positions)
            width = self.gearbox.pairs[pair].pair.face_width
            self._states[key] = static_transmission_error(
                prepared_compliance(wanted),
                [factor * wanted.torque[0] for factor in torque_factors],
                positions,
                misalignment=[UM * opening / width for opening in misalignment_um],
                progress=_ignore_progress,
            )
        return self._states[key]


def _ignore_progress(done: int, total: int) -> None:
    """Report no progress, but end a computation that was cancelled."""
    stop_if_asked()
