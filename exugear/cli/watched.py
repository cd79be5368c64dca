"""The project of a command: opened from its options, it shows the progress of long work."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exugear.cli.bars import Bars, ProgressRow, files_read
from exugear.cli.case import check_choice, read_gearbox
from exugear.cli.console import BadInputError, FailedError, check_results_folder, make_results_folder, note, warn
from exugear.cli.options import VARIANT_DESCRIPTIONS
from exugear.gearbox.choice import Choice
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.variant import Variant
from exugear.project import Project, results_folder
from exugear.results.folder import time_noted
from exugear.results.solver_comparison import SolverComparison
from exugear.steady.settings import Method, SteadySettings
from exugear.system.bearings.duty import BearingLoadState
from exugear.system.bearings.stiffness import elastic_names
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.gearbox_checks import lacking, usual_variant
from exugear.system.modes import Modes
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.contact_state import MeshLoadState
from exugear.system.tooth_mesh.tables import TableRequest, table_notes, table_warnings
from exugear.transient.outcome import Progress, Run
from fe_ste.elimination import FactorisationError
from fe_ste.geometry.checks import GeometryError
from fe_ste.transmission_error.grid import GridError
from fe_ste.transmission_error.table import MeshTable

if TYPE_CHECKING:
    import xarray as xr

    from exugear.life.load_spectrum.counted import CountedLoads
    from exugear.life.rating.sheet import RatingSheet
    from exugear.steady.evaluation.fit import ParameterFit
    from exugear.steady.evaluation.measured_comparison import MeasuredComparison
    from exugear.steady.evaluation.run_up import MeasuredRunUp


@dataclass(frozen=True, repr=False)
class WatchedProject(Project):
    """A project that shows long work in rows of one display and stops between its steps after Ctrl-C."""

    bars: Bars = field(default_factory=Bars, compare=False)

    def begin(self) -> None:
        """Create the folder after the last check, which is that of table axes the gears cannot reach."""
        self.missing_tables()
        make_results_folder(self.folder)

    def prepare(self) -> None:
        """Compute the tables that the mesh model needs if they are missing or belong to other input."""
        requests = self.missing_tables()
        self.keep_case()
        for request in requests:
            note(request.announcement)
        with time_noted(self.folder, "tables, computed before dynamics") if requests else nullcontext():
            self.computed(requests)
        # Mesh models themselves refuse tables that they cannot use.
        for doubt in errors_of_tables(self.tables_at_work()):
            warn(doubt)

    def computed(
        self, requests: Sequence[TableRequest], progress: Callable[[int, int], None] | None = None
    ) -> dict[str, MeshTable]:
        """Table of each request; the missing ones share one row."""
        total = sum(request.work for request in requests if not request.stored)
        before = 0
        tables = {}
        with self.bars.row() as row:
            for request in requests:
                tables[request.name] = request.stored or _computed(request, row, before, total)
                before += 0 if request.stored else request.work
        return tables

    def bodies(self, begin: Callable[[str], None] | None = None) -> dict[str, ElasticBody]:
        """Reduced flexible bodies of the variant, computed or stored."""
        names = elastic_names(self.gearbox)
        with self.bars.row() as row:

            def show(name: str) -> None:
                row(f"{name}: finite elements, reduction to interfaces", names.index(name), len(names))

            try:
                return super().bodies(show)
            except GearboxFileError as error:  # an invalid mesh detected only on reading: the work has already started
                raise FailedError(error) from error

    def assembly(self) -> Assembly:
        """Equations of motion."""
        with self.bars.row():
            return super().assembly()

    def modes(self) -> Modes:
        """Eigenmodes; prints how flexible bodies were reduced."""
        with self.bars.row():
            modes = super().modes()
        for name, body in modes.assembly.elastic_bodies.items():
            note(f"{name}: {body.reduced.origin} in {body.reduced.summary.seconds:.1f} s")
        return modes

    def duties(self) -> tuple[tuple[BearingLoadState, ...], tuple[MeshLoadState, ...]]:
        """Compute the loads of catalogue bearings and meshes."""
        with self.bars.row():
            return super().duties()

    def steady(
        self,
        settings: SteadySettings | None = None,
        progress: Callable[[int, int], None] | None = None,
        prepared: Callable[[str, int, int], None] | None = None,
    ) -> xr.Dataset:
        """Steady-state response over speed."""
        words = f"{self.choice.variant}: steady state"
        with self.bars.row() as row:
            row(words)
            return super().steady(
                settings,
                lambda done, total: row(words, done, total),
                lambda step, done, total: row(f"{words}, {step}", done, total),
            )

    def measured(
        self,
        run_up: MeasuredRunUp | str | None = None,
        method: Method = "parametric",
        progress: Callable[[int, int], None] | None = None,
    ) -> MeasuredComparison:
        """Comparison with a measured run-up."""
        words = f"{self.choice.variant}: steady state over the measured speeds"
        with self.bars.row() as row:
            row(words)
            return super().measured(run_up, method, lambda done, total: row(words, done, total))

    def fit_measured(
        self, comparison: MeasuredComparison, keys: Sequence[str], method: Method = "parametric"
    ) -> ParameterFit:
        """Fit of keys to a measured run-up."""
        with self.bars.row() as row:
            row(f"fit of {', '.join(keys)}")
            return super().fit_measured(comparison, keys, method)

    def run(self, **options: Any) -> Run:
        """Run of the load case in time."""
        variant = self.choice.variant
        with self.bars.row() as row:

            def show(at: Progress) -> None:
                text = f"{variant}: {at.simulated:.2f} of {at.total:g} s, {at.speed:.2f} simulated s per s"
                row(text, at.simulated, at.total)

            row(f"{variant}: initial static balance")
            return super().run(progress=show, **options)

    def compare_with_exudyn(self, duration: float, **options: Any) -> SolverComparison:
        """Compare the beginning of the run with Exudyn."""
        with self.bars.row() as row:

            def show(at: Progress) -> None:
                row(f"Exudyn: {at.simulated:.3f} of {at.total:g} s", at.simulated, at.total)

            return super().compare_with_exudyn(duration, progress=show, **options)

    def checked_loads(self, progress: Callable[[int, int], None] | None = None) -> CountedLoads:
        """Read the loads over the life."""
        with self.bars.row() as row:
            return super().checked_loads(files_read(row))

    def life(
        self,
        begin: Callable[[str], None] | None = None,
        progress: Callable[[int, int], None] | None = None,
        counted: CountedLoads | None = None,
    ) -> xr.Dataset:
        """Life of gears and bearings."""
        with self.bars.row() as row:
            row("tooth stresses")
            return super().life(*_life_progress(row), counted)

    def rating(
        self, begin: Callable[[str], None] | None = None, progress: Callable[[int, int], None] | None = None
    ) -> RatingSheet:
        """Rating of all gears according to the standard."""
        with self.bars.row() as row:
            row("static balance")
            return super().rating(*_life_progress(row))


def _life_progress(row: ProgressRow) -> tuple[Callable[[str], None], Callable[[int, int], None]]:
    """Return functions that show the pair whose root stress is computed, and the number of computed static states."""
    return (
        lambda pair: row(f"{pair}: root stress by finite elements"),
        lambda done, total: row("static balance", done, total),
    )


def errors_of_tables(tables: Mapping[str, MeshTable]) -> list[str]:
    """Print warnings about missing or truncated values of tables; return the reasons why tables are invalid."""
    for name, table in tables.items():
        for remark in table_notes(name, table):
            warn(remark)
    return [doubt for name, table in tables.items() for doubt in table_warnings(name, table)]


def _computed(request: TableRequest, row: ProgressRow, before: int, total: int) -> MeshTable:
    """Compute a table; its row counts the work of all missing tables, part of which is already done."""
    row(f"{request.name}: finite elements", before, total)
    what = "position" if request.states == request.wanted.positions else "state"

    def show(done: int, of: int) -> None:
        row(f"{request.name}: {what} {done} of {of}", before + request.work - of + done, total)

    try:
        return request.compute(show)
    except GeometryError as error:
        raise BadInputError(f"pairs.{request.name}: {error}") from error
    except (FactorisationError, GridError) as error:
        raise FailedError(f"{request.name}: {error}") from error


def open_project(
    case: Path,
    out: Path | None,
    allow_dir: Path | None,
    scripts: bool,
    variant: Variant | None,
    mesh_model: str = "line_of_action",
    inertias: str | None = None,
    load_case: str | None = None,
    without: Sequence[str] = (),
) -> WatchedProject:
    """Read a gearbox file without some excitations, and refuse invalid or unavailable settings; write no files."""
    gearbox = read_gearbox(case, allow_dir, scripts)
    for name in without:
        if name not in gearbox.case.excitations:
            known = ", ".join(gearbox.case.excitations) or "none in the file"
            raise BadInputError(f"--without {name}: no such excitation; choose one of: {known}")
    gearbox = gearbox.varied({f"excitations.{name}.enabled": False for name in without}) if without else gearbox
    if variant is None:
        variant = usual_variant(gearbox)
        if reason := lacking(gearbox, Variant.bushing):
            note(f"Variant {variant} ({VARIANT_DESCRIPTIONS[variant]}): bushing is not available, {reason}")
    choice = Choice(variant, str(mesh_model), inertias, load_case)
    folder = results_folder(case, out)
    check_choice(gearbox, choice, folder)
    check_results_folder(folder)
    return WatchedProject(gearbox, folder, choice)
