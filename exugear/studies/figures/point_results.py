"""Results of one point: computed when a figure asks for them, each once."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.studies.figures.shared import Shared
from exugear.system.assemble import assemble
from exugear.system.assembly import Assembly
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.eigenmodes.modes import Modes, modes_of
from exugear.system.statics import StaticState, static_state
from exugear.system.tooth_mesh.law import MeshData
from exugear.system.tooth_mesh.laws.registry import LAWS, law_of
from exugear.system.tooth_mesh.tables import wanted_table
from fe_ste.tools.workers import stop_if_asked
from fe_ste.transmission_error.table import MeshTable, prepared_compliance

if TYPE_CHECKING:
    import xarray as xr

    from exugear.steady.settings import SteadySettings
    from exugear.transient.runup import Solver


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
        return self.shared.table(self.gearbox, pair, progress=_between_steps)

    @cached_property
    def stiffness(self) -> dict[str, MeshData]:
        """Mesh stiffness by pair at work, as the mesh law needs it."""
        law = LAWS.get(self.choice.mesh_law)
        if law is not None and not law.has_force:
            return {}
        found: dict[str, MeshData] = {}
        reader = law_of(self.choice.mesh_law)
        for pair in dict.fromkeys(mesh.pair.name for mesh in self.gearbox.meshes):
            folder = Path()
            if law is not None and law.needs_tables and (law.needs_axes or pair not in self.gearbox.stated_stiffness):
                self.shared.table(self.gearbox, pair, law.needs_axes, _between_steps)
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
            raise PointError("figures of steady responses need a section [steady] with speeds")
        from exugear.steady.steady_file import to_dataset
        from exugear.steady.steady_response import response_of

        return to_dataset(response_of(self.assembly, self.settings.steady, progress=_between_steps))

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
        from exugear.transient.run_folder import refuse_to_resume
        from exugear.transient.runup import simulate

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
        CaseError
            No loads or strengths, or such as cannot be used.
        BalanceError
            A static state that is not held.
        """
        from exugear.life.life import rating_of
        from exugear.studies.figures.point_lives import point_life, response_of_factors

        rating = rating_of(self.gearbox)
        if rating.dynamic_factor_run is not None:
            self._simulated(replace(self.choice, load_case=rating.dynamic_factor_run))
        elif rating.dynamic_factor_steady is not None:
            response_of_factors(self.assembly, self.choice, self.settings.steady, self.folder, _between_steps)
        data, doubts = point_life(self.assembly, self.choice, self.shared, self.folder, _between_steps)
        self.doubts += doubts
        return data

    def states(
        self, pair: str, positions: int, torque_factors: Sequence[float], misalignment_um: Sequence[float]
    ) -> xr.Dataset:
        """States of contact of a pair over loads and misalignments, kept for the next figure that asks the same."""
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
            misalignment=[1e-6 * opening / width for opening in misalignment_um],
            progress=_between_steps,
        )

    def clear(self) -> None:
        """Remove what a run left in the folder."""
        shutil.rmtree(self.folder, ignore_errors=True)


def _between_steps(done: int, total: int) -> None:
    stop_if_asked()
