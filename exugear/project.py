"""Project: a gearbox, its results folder and the model settings, with tables, bodies, modes, runs and the report.

The command line, the case scripts and notebooks are based on this class. It computes missing results, reuses stored
ones that match the input, and writes only into its folder.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import gearbox_at_load
from exugear.gearbox.named_files import NOTHING_MORE, Permissions
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.variant import OFFERED, Variant, VariantError
from exugear.results.folder import (
    bearings_path,
    bodies_folder,
    keep_case,
    modes_path,
    read_stored_gearbox,
    run_directory,
    stored_source,
    time_noted,
    write_duties,
)
from exugear.results.run_file import FINAL_NAME
from exugear.results.solver_comparison import EXUDYN_FOLDER, SolverComparison, compare_solvers
from exugear.steady.settings import Method, SteadySettings, check_varying, usual_speeds
from exugear.system.bearings.duty import BearingLoadState
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.of_gearbox import reduced_bodies
from exugear.system.build import assemble
from exugear.system.modes import Modes, kept_modes, modes_of
from exugear.system.operating_points import bearing_duties, mesh_duties
from exugear.system.statics import BalanceError, static_state
from exugear.system.system import Assembly, input_hash
from exugear.system.tooth_mesh.contact_state import MeshLoadState
from exugear.system.tooth_mesh.element import MeshData
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.tables import (
    GridAxes,
    TableRequest,
    axes_reaching,
    missing_tables,
    requested_tables,
    tables_at_work,
)
from exugear.transient.outcome import Run
from exugear.transient.runup import simulate
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.stores import Store
from fe_ste.transmission_error.table import MeshTable

if TYPE_CHECKING:
    import xarray as xr

    from exugear.life.load_spectrum.counted import CountedLoads
    from exugear.life.rating.sheet import RatingSheet
    from exugear.life.static_balance import StaticBalance
    from exugear.report.findings.design_changes import DesignStudy
    from exugear.report.writer import Report
    from exugear.steady.evaluation.fit import ParameterFit
    from exugear.steady.evaluation.measured_comparison import MeasuredComparison
    from exugear.steady.evaluation.run_up import MeasuredRunUp

Figures = dict[tuple[str, str, str], dict[str, float]]
"""Values of flanks by gear, family of meshes and flank, and then by symbol."""


@dataclass(frozen=True)
class Project(ReprMixin):
    """Gearbox with the folder of its results and the model settings.

    Tables, flexible bodies, modes, steady-state responses and ratings of life are stored in the folder, and reused if
    they match input and method. A run is repeated each time, or resumed (`resume`). Static loads of bearings and meshes
    and rating sheets are always recomputed.

    Examples
    --------
    >>> project = Project.from_toml("cases/grc750/gearbox.toml", choice=Choice("bushing", "iso6336"))
    >>> project
    <Project 'GRC 750 kW', results/grc750, bushing, iso6336, assemblies, reference>
    >>> project.chosen(variant="rigid").assembly().size
    8
    """

    gearbox: Gearbox
    folder: Path
    """Results folder; created when something is written."""
    choice: Choice = Choice()
    """Model settings: variant, mesh model, inertia set and load case, with defaults filled in."""

    def __post_init__(self) -> None:
        """Fill in defaults of the model settings."""
        object.__setattr__(self, "folder", Path(self.folder))
        object.__setattr__(self, "choice", self.choice.of(self.gearbox))

    @classmethod
    def from_toml(
        cls,
        case: str | Path,
        folder: str | Path | None = None,
        choice: Choice | None = None,
        permissions: Permissions = NOTHING_MORE,
    ) -> Project:
        """Read a gearbox file; without a folder, results go to ``results/<folder of the file>``.

        Raises
        ------
        GearboxFileError
            The file is invalid, or its default folder contains the results of another file.
        """
        gearbox = Gearbox.from_toml(case, permissions)
        return cls(gearbox, results_folder(case, folder), choice or Choice())

    @classmethod
    def from_folder(
        cls, folder: str | Path, choice: Choice | None = None, permissions: Permissions = NOTHING_MORE
    ) -> Project:
        """Open the gearbox whose results are in a folder.

        Raises
        ------
        GearboxFileError
            The folder holds no results, or its stored gearbox file is invalid.
        """
        return cls(read_stored_gearbox(Path(folder), permissions), Path(folder), choice or Choice())

    def chosen(self, **changes: Any) -> Project:
        """Return the same gearbox and folder with other settings: `variant`, `mesh_model`, `inertias`, `load_case`."""
        return replace(self, choice=replace(self.choice, **changes))

    def replaced(self, gearbox: Gearbox, folder: Path) -> Self:
        """Return another gearbox with another results folder and the same settings."""
        return replace(self, gearbox=gearbox, folder=folder)

    def at_load_case(self, name: str) -> Self:
        """Return the same gearbox with the torques at the start of a load case as its static load.

        Tables, load distribution of the teeth and bearing stiffness are then those at this load. The results go to
        the subfolder ``at-NAME`` of the results folder.

        Raises
        ------
        GearboxFileError
            There is no such load case, or it has no torque for the static load.

        Examples
        --------
        >>> project = Project.from_toml("cases/grc750/gearbox.toml", "results/grc750").at_load_case("rated")
        >>> project.gearbox.case.static_load.torques_N_m, project.folder.name
        ({'carrier': 240000.0}, 'at-rated')
        """
        known = self.gearbox.load_cases
        if name not in known:
            raise self.gearbox.error(f"no load case {name!r}; choose one of: {', '.join(known) or 'none in the file'}")
        return self.replaced(gearbox_at_load(self.gearbox, known[name]), self.folder / f"at-{name}")

    def _line(self) -> str:
        choice = self.choice
        chosen = ", ".join(str(what) for what in (choice.variant, choice.mesh_model, choice.inertias, choice.load_case))
        return f" {self.gearbox.name!r}, {self.folder}, {chosen}"

    @property
    def modes_path(self) -> Path:
        """File of the modes."""
        return modes_path(self.folder, self.choice)

    @property
    def bearings_path(self) -> Path:
        """File of the static bearing and mesh loads."""
        return bearings_path(self.folder, self.choice)

    @property
    def run_directory(self) -> Path:
        """Folder of the run, with its files, including those of an interrupted run."""
        return run_directory(self.folder, self.choice)

    @property
    def run_path(self) -> Path:
        """File of the completed run."""
        return self.run_directory / FINAL_NAME

    def requested_tables(
        self, names: Iterable[str] = (), positions: int | None = None, *, grid: bool = False
    ) -> list[TableRequest]:
        """List tables and load the stored ones: see `exugear.system.tooth_mesh.tables.requested_tables`."""
        axes = self.grid_axes() if grid or self.gearbox.ste.grid else {}
        return requested_tables(self.gearbox, self.folder, names, positions, grid, axes)

    def grid_axes(self) -> dict[str, GridAxes]:
        """Return table axes over centre distance and misalignment, where the file has none, by gear pair.

        They cover three times the static displacement of the gears on their bearings, with mesh stiffness to ISO 6336;
        default axes are used if that state is not known.
        """
        ste = self.gearbox.ste
        if ste.misalignment_um is not None and ste.centre_distance_offsets_um is not None:
            return {}
        choice = replace(self.choice, variant=Variant.bushing, mesh_model="iso6336")
        try:
            at_rest = static_state(assemble(self.gearbox, choice, mesh_stiffness(self.gearbox, choice.mesh_model)))
        except (VariantError, BalanceError, MeshError, BearingError):
            return {}
        axes: dict[str, list[tuple[float, float]]] = {}
        places = zip(self.gearbox.meshes, at_rest.misalignment, at_rest.centre_distance, strict=True)
        for mesh, misalignment, distance in places:
            place = (abs(misalignment) * mesh.pair.face_width, abs(distance - mesh.centre_distance))
            axes.setdefault(mesh.pair.name, []).append(place)
        pairs = self.gearbox.gear_pairs
        return {name: axes_reaching(pairs[name], *np.max(where, axis=0)) for name, where in axes.items()}

    def tables(
        self,
        names: Iterable[str] = (),
        positions: int | None = None,
        *,
        grid: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> dict[str, MeshTable]:
        """Return transmission error tables by gear pair; missing ones are computed, which takes minutes.

        Parameters
        ----------
        names : pairs; by default all that need a table according to the file
        positions : number of positions in the mesh cycle; by default that of the file
        grid : whether tables are also over load, centre distance and misalignment
        progress : called with the number of finished states of the current table, and the total
        """
        self.keep_case()
        return self.computed(self.requested_tables(names, positions, grid=grid), progress)

    def computed(
        self, requests: Sequence[TableRequest], progress: Callable[[int, int], None] | None = None
    ) -> dict[str, MeshTable]:
        """Return the table of each request by its name; missing ones are computed, as in `tables`."""
        return {request.name: request.stored or request.compute(progress) for request in requests}

    def missing_tables(self) -> list[TableRequest]:
        """Return the tables that the mesh model needs and that are missing or belong to another input."""
        law = LAWS.get(self.choice.mesh_model)
        if law is None or not law.needs_tables:
            return []
        axes = self.grid_axes() if law.needs_axes else {}
        return missing_tables(self.gearbox, self.folder, grid=law.needs_axes, axes=axes)

    def tables_at_work(self) -> dict[str, MeshTable]:
        """Return the available tables that the mesh model reads."""
        law = LAWS.get(self.choice.mesh_model)
        if law is None or not law.needs_tables:
            return {}
        return tables_at_work(self.gearbox, self.folder, grid=law.needs_axes)

    def stiffness(self) -> dict[str, MeshData]:
        """Return the mesh stiffness by gear pair for the mesh model; missing tables are computed first."""
        read = partial(mesh_stiffness, self.gearbox, self.choice.mesh_model, self.folder)
        try:
            return dict(read())
        except MeshError:  # the search for missing tables reads the tables again
            if requests := self.missing_tables():
                self.keep_case()
                self.computed(requests)
            return dict(read())

    def bodies(self, begin: Callable[[str], None] | None = None) -> dict[str, ElasticBody]:
        """Return the reduced flexible bodies of the variant by name; missing ones are reduced and stored.

        Parameters
        ----------
        begin : called with the name of each body before it is reduced
        """
        if not self.choice.variant.is_elastic:
            return {}
        inertias = self.choice.inertia_set(self.gearbox)
        return reduced_bodies(self.gearbox, inertias, bodies_folder(self.folder), begin)

    def assembly(self) -> Assembly:
        """Return the equations of motion."""
        return assemble(self.gearbox, self.choice, self.stiffness(), self.bodies())

    def modes(self) -> Modes:
        """Return the eigenmodes at the static load, stored in `modes_path`; matching stored ones are reused."""
        assembly = self.assembly()
        choice = self.choice
        modes = kept_modes(self.modes_path, assembly)
        if modes is None:
            self.keep_case()
            with time_noted(self.folder, f"modes, {choice.variant}, {choice.inertias}, {choice.mesh_model}"):
                modes = modes_of(assembly)
                modes.save(self.modes_path)
        return modes

    def steady(
        self,
        settings: SteadySettings | None = None,
        progress: Callable[[int, int], None] | None = None,
        prepared: Callable[[str, int, int], None] | None = None,
    ) -> xr.Dataset:
        """Return the steady-state response over speed, stored in `steady_path`; a matching stored one is reused.

        Parameters
        ----------
        settings : speeds and method; by default `parametric`, up to the highest speed of the first load case and of
            ``[operation]``
        progress : called with the number of finished speeds and the total
        prepared : called before the first speed with the name of a preparation, its finished steps and the total
        """
        # Kernels that a run does not need
        from exugear.steady.mean_system.mean_system import unsuitable
        from exugear.steady.mean_system.planet_sets import SteadyError
        from exugear.steady.steady_file import stored_or_computed

        settings = settings or SteadySettings(usual_speeds(self.gearbox))
        assembly = self.assembly()
        if reason := unsuitable(assembly):
            raise SteadyError(reason)
        check_varying(assembly, settings.method)
        choice = self.choice
        self.keep_case()
        with time_noted(self.folder, f"steady, {choice.variant}, {choice.inertias}, {choice.mesh_model}"):
            return stored_or_computed(self.steady_path(settings), assembly, settings, progress, prepared)

    def measured(
        self,
        run_up: MeasuredRunUp | str | None = None,
        method: Method = "parametric",
        progress: Callable[[int, int], None] | None = None,
    ) -> MeasuredComparison:
        """Compare a measured run-up of the gearbox file with the steady-state response over its speeds.

        The response is stored next to the modes and reused if it matches. The comparison is written to
        `measured_path`, with tables and a diagram.

        Parameters
        ----------
        run_up : name of a table of ``[measurements]``, or one read by
            `exugear.steady.evaluation.run_up.read_run_up`; not needed if there is only one
        method : of the response, as in `exugear.steady.settings.SteadySettings`
        progress : called with the number of finished speeds and the total

        Raises
        ------
        GearboxFileError
            There is no such measurement, or its recording cannot be used.
        SteadyError
            The response has no signal at the place of a channel.
        """
        from exugear.steady.evaluation.load_over_speed import LoadedModels, damping_extremes
        from exugear.steady.evaluation.measured_comparison import compare_run_up
        from exugear.steady.evaluation.run_up import MeasuredRunUp, read_run_up, response_settings
        from exugear.steady.steady_file import stored_or_computed

        found = run_up if isinstance(run_up, MeasuredRunUp) else read_run_up(self.gearbox, run_up)
        loaded = self.at_measured_load(found)
        settings = response_settings(loaded.gearbox, found, method)
        assembly_at = loaded.assembly_at_loads(found)
        path = loaded.measured_path(found.name)
        loaded.keep_case()
        with time_noted(loaded.folder, f"measured {found.name}, {self.choice.variant}, {self.choice.mesh_model}"):
            stored = path.with_name(f"{path.stem}-steady.nc")
            at_mean = stored_or_computed(stored, assembly_at(1.0), settings, progress)
            response, limits = at_mean, None
            if method != "nonlinear":  # with another load or damping, it may lead to another state
                speeds, harmonics = at_mean["speed"].to_numpy(), int(at_mean.attrs["harmonics"])
                models = LoadedModels.of(assembly_at, found.torque, speeds, harmonics, settings)
                response = models.response(at_mean, settings, found.section.harmonics)
                limits = damping_extremes(models, response, settings, found)
            comparison = compare_run_up(loaded.gearbox, found, response, limits)
            comparison.write(path)
        return comparison

    def at_measured_load(self, run_up: MeasuredRunUp) -> Self:
        """Return the same gearbox at the load of a measured run-up: of its load case, scaled to its mean torque.

        Results at a mean torque that differs by more than 1 % go to the subfolder ``at-measured-NAME``.

        Raises
        ------
        GearboxFileError
            There is no such load case, or the static load has no torque on the body of the measured torque.
        """
        from exugear.steady.evaluation.run_up import gearbox_at_torque

        case = run_up.section.load_case
        loaded = self if case is None else self.at_load_case(case)
        gearbox = gearbox_at_torque(loaded.gearbox, run_up)
        if gearbox is loaded.gearbox:
            return loaded
        return loaded.replaced(gearbox, loaded.folder / f"at-measured-{run_up.name}")

    def assembly_at_loads(
        self, run_up: MeasuredRunUp, values: Mapping[str, float] | None = None
    ) -> Callable[[float], Assembly]:
        """Return a function that assembles the gearbox at a torque over the mean torque of a run-up.

        Parameters
        ----------
        values : other numbers of the gearbox file, by key
        """
        from exugear.steady.evaluation.run_up import gearbox_at_torque

        stiffness, bodies = self.stiffness(), self.bodies()

        def assembly_at(load: float) -> Assembly:
            gearbox = gearbox_at_torque(self.gearbox, run_up, load) if load != 1.0 else self.gearbox
            return assemble(gearbox.varied(values or {}), self.choice, stiffness, bodies)

        return assembly_at

    def fit_measured(
        self, comparison: MeasuredComparison, keys: Sequence[str], method: Method = "parametric"
    ) -> ParameterFit:
        """Fit numbers of the gearbox file to a comparison with a measured run-up; nothing is written.

        Parameters
        ----------
        comparison : result of `measured`
        keys : one to three keys of ``housing``, ``damping``, ``bearings``, ``mounts`` or ``couplings``, such as
            ``housing.factor``
        method : as in `measured`

        Raises
        ------
        GearboxFileError
            A key has no single number above zero.
        FitError
            Too few orders of channels count.
        """
        from exugear.steady.evaluation.fit import fit_levels, start_of_fit
        from exugear.steady.evaluation.load_over_speed import response_levels
        from exugear.steady.evaluation.run_up import response_settings

        cuts = comparison.cuts
        loaded = self.at_measured_load(cuts.run_up)
        settings = response_settings(loaded.gearbox, cuts.run_up, method)
        start, limits = start_of_fit(loaded.gearbox, keys)

        def levels(values: Mapping[str, float]) -> Floats:
            own = {key: float(value) for key, value in values.items()}
            return response_levels(loaded.assembly_at_loads(cuts.run_up, own), cuts, settings, comparison.harmonics)

        with np.errstate(divide="ignore"):
            measured = 20.0 * np.log10(np.abs(cuts.measured))
        return fit_levels(levels, measured, cuts.fitted, start, limits)

    def measured_path(self, name: str) -> Path:
        """Return the path of the comparison with a measured run-up: next to the modes."""
        return self.modes_path.with_name(f"measured-{name}.nc")

    def steady_path(self, settings: SteadySettings) -> Path:
        """Return the path of the steady-state response."""
        from exugear.steady.steady_file import steady_path

        return steady_path(self.folder, self.choice, settings)

    def duties(self) -> tuple[tuple[BearingLoadState, ...], tuple[MeshLoadState, ...]]:
        """Compute the loads of catalogue bearings and meshes at the static load, and write them to `bearings_path`."""
        assembly = self.assembly()
        duties = bearing_duties(assembly)
        meshes = mesh_duties(assembly)
        self.keep_case()
        write_duties(self.bearings_path, duties, meshes, input_hash(assembly))
        return duties, meshes

    def bearings(self) -> tuple[BearingLoadState, ...]:
        """Compute the loads of catalogue bearings at the static load: see `duties`."""
        return self.duties()[0]

    def meshes(self) -> tuple[MeshLoadState, ...]:
        """Compute misalignment and load distribution of meshes at the static load: see `duties`."""
        return self.duties()[1]

    def life_tables(self) -> list[TableRequest]:
        """List the tables that a rating needs, of all pairs with a table, and load the stored ones."""
        return self.requested_tables(grid=LAWS[self.choice.mesh_model].needs_axes)

    def stress_tables(self, counted: CountedLoads) -> list[TableRequest]:
        """List the tables for stresses in a rating, and load the stored ones.

        If the file has no axes, they are over load and misalignment around the static positions of the gears.
        """
        from exugear.life.static_balance import life_requests

        return life_requests(self.assembly(), counted, self.folder)

    def checked_loads(self, progress: Callable[[int, int], None] | None = None) -> CountedLoads:
        """Read the load spectrum, and check all required input before the computation begins.

        Parameters
        ----------
        progress : called with the number of load files read and the total

        Raises
        ------
        GearboxFileError
            Invalid loads, or loads far beyond the tables; strengths that do not fit the gears.
        """
        from exugear.life.life import check_reach, checked_loads

        counted = checked_loads(self.gearbox, progress)
        check_reach(
            self.gearbox, counted, {life_table.name: max(life_table.wanted.torque) for life_table in self.life_tables()}
        )
        return counted

    def life(
        self,
        begin: Callable[[str], None] | None = None,
        progress: Callable[[int, int], None] | None = None,
        counted: CountedLoads | None = None,
    ) -> xr.Dataset:
        """Rate gears and bearings under the load spectrum, stored in `life_path`; a matching stored rating is reused.

        Missing tables are computed first. An interrupted computation keeps its tables, stresses of pairs and solved
        carrier angles, and resumes from them.

        Parameters
        ----------
        begin : called with the name of each pair before its root stress is computed
        progress : called with the number of solved static states and the total
        counted : result of `checked_loads`; by default the loads are read again
        """
        from exugear.life.dynamic_factors import factors
        from exugear.life.gear_life import pair_stresses
        from exugear.life.life import compute_life, life_hash, rating_of  # root stress modules, not needed by a run
        from exugear.life.life_file import stored_life, write_life
        from exugear.life.static_balance import KeptAngles

        counted = counted or self.checked_loads()
        if any(request.stored is None for request in self.life_tables()):
            self.tables(grid=LAWS[self.choice.mesh_model].needs_axes)
        assembly = self.assembly()
        requests = self.stress_tables(counted)
        dynamic = factors(assembly, rating_of(self.gearbox), self.folder, counted.body)
        digest = life_hash(assembly, counted, requests, self.folder)
        angles = Store(self.life_path.with_suffix(".partial.npz"), digest)
        kept = stored_life(self.life_path, digest)
        if kept is not None:
            angles.discard()  # left by a process that was killed after its last file
            return kept
        self.keep_case()
        with time_noted(self.folder, f"life, {self.choice.variant}, {self.choice.mesh_model}"):
            self.computed(requests)
            stresses = pair_stresses(self.stress_tables(counted), self.folder, begin)
            life = compute_life(assembly, counted, stresses, dynamic, digest, progress, KeptAngles(angles))
            data = write_life(self.life_path, life, self.gearbox.name)
            angles.discard()
            return data

    def rating(
        self,
        begin: Callable[[str], None] | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> RatingSheet:
        """Rate all gears to ISO 6336 under the load spectrum, or under the static load; nothing is written.

        Finite element results are listed next to the standard's: those of a matching life in the folder, or under the
        static load from stored tables. Apart from stresses from tables, none of these is computed.

        Parameters
        ----------
        begin : called with the name of each pair before its root stress is computed
        progress : called with the number of solved static states and the total

        Raises
        ------
        GearboxFileError
            No section `[rating]`, invalid loads, or strengths that do not fit the gears.
        """
        from exugear.life.rating.sheet import balanced, rated, rated_as, rated_loads

        counted = rated_loads(self.gearbox)
        choice = rated_as(self.gearbox)
        at_rest = self.chosen(variant=choice.variant, mesh_model=choice.mesh_model)
        balance = balanced(at_rest.assembly(), counted, progress)
        if self.gearbox.case.loads is not None:
            found, remarks = self._rated_by_life(counted)
        else:
            found, remarks = self._rated_by_tables(balance, begin)
        return rated(self.gearbox, counted, balance, found, remarks)

    def _rated_by_life(self, counted: CountedLoads) -> tuple[Figures, tuple[str, ...]]:
        """Return values of a stored life, preferably of the selected variant; otherwise none, with the reason."""
        from exugear.life.rating.sheet import life_results

        missing = "no finite element results: compute them by `exugear life`"
        reasons: list[str] = []
        for variant in dict.fromkeys((self.choice.variant, *reversed(OFFERED))):
            other = self.chosen(variant=variant)
            if not other.life_path.is_file() or any(request.stored is None for request in other.life_tables()):
                continue
            try:
                data = other.stored_life(counted)
            except (BalanceError, MeshError, BearingError, VariantError, GearboxFileError) as error:
                reasons.append(str(error))
                continue
            if data is not None:
                return life_results(data), (f"by finite elements, variant {variant}: {other.life_path}",)
            reasons.append(f"{other.life_path} was computed from another input")
        return {}, ("; ".join([missing, *reasons]),)

    def _rated_by_tables(
        self, balance: StaticBalance, begin: Callable[[str], None] | None
    ) -> tuple[Figures, tuple[str, ...]]:
        """Return values for the nominal load from stored tables."""
        from exugear.life.gear_life import pair_stresses
        from exugear.life.life import rating_of
        from exugear.life.rating.sheet import nominal_load_values, nominal_loads, stress_warnings

        rating = rating_of(self.gearbox)
        stresses = pair_stresses(self.requested_tables(), self.folder, begin, keep=False)
        loads = nominal_loads(self.gearbox, rating, rating.application_factor)
        found = nominal_load_values(self.gearbox, rating, loads, balance, stresses)
        remarks = list(stress_warnings(stresses))
        if missing := [name for name in self.gearbox.gear_pairs if name not in stresses]:
            remarks.insert(0, f"no finite element results for {', '.join(missing)}: compute tables by `exugear ste`")
        return found, tuple(remarks)

    def stored_life(self, counted: CountedLoads) -> xr.Dataset | None:
        """Return the stored life computed from exactly this input; None without one."""
        from exugear.life.life import life_hash
        from exugear.life.life_file import stored_life

        digest = life_hash(self.assembly(), counted, self.stress_tables(counted), self.folder)
        return stored_life(self.life_path, digest)

    @property
    def life_path(self) -> Path:
        """File of the life."""
        from exugear.life.life_file import life_path

        return life_path(self.folder, self.choice)

    def run(self, **options: Any) -> Run:
        """Run the load case in time; options as in `exugear.transient.runup.simulate`.

        Results are written to `run_directory` during the run.
        """
        stiffness = self.stiffness()
        bodies = self.bodies()
        self.keep_case()
        return simulate(self.gearbox, self.choice, stiffness, self.folder, bodies=bodies, **options)

    def compare_with_exudyn(self, duration: float, **options: Any) -> SolverComparison:
        """Integrate the beginning of the run with Exudyn, and compare it with the stored run.

        Parameters
        ----------
        duration : simulated time, s
        options : as in `exugear.transient.runup.simulate`

        Raises
        ------
        FileError
            If the folder holds no run of the compiled solver from the same input.
        """
        beside = self.folder / EXUDYN_FOLDER
        given = {"duration": duration, "solver": "exudyn", "bodies": self.bodies(), **options}
        exudyn = simulate(self.gearbox, self.choice, self.stiffness(), beside, **given)
        return compare_solvers(self.run_directory / FINAL_NAME, exudyn.path)

    def design_changes(
        self,
        progress: Callable[[int, int, str], None] | None = None,
        *,
        resonance: int = 1,
        quantity: str | None = None,
        loads: Sequence[str] = (),
    ) -> DesignStudy | None:
        """Compute what design changes do to a resonance in the operating range, each with the full check.

        Tables, static state, steady-state response and rating of each changed gearbox are stored in a subfolder; a
        repeated or resumed study reads those that exist. None without such a resonance in the range.

        Parameters
        ----------
        progress : called with the number of finished changes, their total, and the description of the next one
        resonance : rank of the resonance
        quantity : ``transmission_error``, ``bearing_force``, ``acceleration`` or ``sound_power``, which decides; by
            default as `exugear steady` ranks
        loads : names of load cases, or percentages of the static load such as ``50%``; by default the static load
        """
        from exugear.report.design_study import study_design_changes  # not needed by a run

        with time_noted(self.folder, f"design changes, {self.choice.variant}"):
            return study_design_changes(self, progress, resonance=resonance, quantity=quantity, loads=loads)

    def report(self, near: float | None = None, tell: Callable[[str], None] | None = None) -> Report:
        """Write the report of all results in the folder: see `exugear.report.writer.write_report`."""
        from exugear.report.writer import write_report  # for drawing, not needed by a run

        with time_noted(self.folder, "report"):
            return write_report(self.folder, near, tell, self.gearbox.permissions.below)

    def keep_case(self) -> None:
        """Create the folder, and store the gearbox file of its results in it."""
        self.folder.mkdir(parents=True, exist_ok=True)
        keep_case(self.gearbox, self.folder)


def default_folder(case: str | Path) -> Path:
    """Return the default results folder of a gearbox file.

    Examples
    --------
    >>> default_folder("cases/grc750/gearbox.toml").as_posix()
    'results/grc750'
    """
    return Path("results") / Path(case).resolve().parent.name


def results_folder(case: str | Path, out: str | Path | None = None) -> Path:
    """Return the folder for the results of a gearbox file: `out`, or else the default one.

    Raises
    ------
    GearboxFileError
        The default folder contains the results of another gearbox file, which still exists.

    Examples
    --------
    >>> results_folder("cases/grc750/gearbox.toml", "elsewhere").as_posix()
    'elsewhere'
    """
    if out is not None:
        return Path(out)
    folder = default_folder(case)
    other = stored_source(folder)
    if other is not None and other.is_file() and Path(case).is_file() and not other.samefile(case):
        raise GearboxFileError(
            f"{case}: {folder} contains the results of another file, {other.name}; compute those of this one with "
            f"--out {folder}-{Path(case).stem}"
        )
    return folder
