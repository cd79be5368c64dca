"""Look-up tables of the static transmission error of a gear pair: computed, stored, opened again.

A table is one netCDF file that xarray reads without this package. It carries its whole input and the hash of it; a
file whose hash differs from what is asked for is refused, never used.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.flanks import FlankModification
from fe_ste.geometry.gear_relations import inputs_that_are_given
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.display import ReprMixin, TitledRows, value_range
from fe_ste.tools.files import FileError
from fe_ste.tools.processes import Workers
from fe_ste.tools.stores import Layout, load_dataset, write_dataset
from fe_ste.tools.versions import TABLE
from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
from fe_ste.transmission_error.cycle import DEFAULT_POSITIONS
from fe_ste.transmission_error.diagrams import draw_table
from fe_ste.transmission_error.grid import Checkpoint, GridExecutor, solve_grid
from fe_ste.transmission_error.search import unloaded_states
from fe_ste.transmission_error.states import CUT_OFF, RESULTS, STATE_AXES, StateAxes, cut_off_variable

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


#: Beyond this many states the start of processes is repaid.
_STATES_IN_PROCESS = 1000
_LAYOUT = Layout(
    "static transmission error table",
    TABLE,
    {name: (name,) for name in ("pmc", *STATE_AXES, "tooth", "axial_position")}
    | {name: ("pmc", *STATE_AXES) for name in (*RESULTS, "mesh_stiffness", "converged") if name != CUT_OFF}
    | dict.fromkeys(("load_share", "tangent_load_share"), ("pmc", *STATE_AXES, "tooth")),
    ("input_hash", "failures", "pair", "static_centre_distance", "static_misalignment"),
)


class TableError(FileError):
    """A table file that is missing, damaged, or belongs to another input."""


@dataclass(frozen=True, kw_only=True)
class TableInput(ReprMixin):
    """All that the numbers of a table depend on.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> len(TableInput(pair=pair, torque=(100.0,)).hash)
    64
    """

    pair: GearPair
    torque: tuple[float, ...]
    """Static torques on gear 1, N m."""
    positions: int = DEFAULT_POSITIONS
    """Positions of the mesh cycle."""
    centre_distance: tuple[float, ...] = ()
    """m; empty for the pair's own."""
    misalignment: tuple[float, ...] = (0.0,)
    """In rad."""
    mesh: MeshSettings = field(default_factory=MeshSettings)
    contact: ContactSettings = field(default_factory=ContactSettings)
    pinion_modification: FlankModification = field(default_factory=FlankModification)
    gear_modification: FlankModification = field(default_factory=FlankModification)
    static_torque: float | None = None
    """Which of several torques is that of the static state."""

    def resolved(self) -> dict[str, Any]:
        """Return the input as plain data, with everything that has a default spelled out."""
        return {"method_version": TABLE, **asdict(self, dict_factory=inputs_that_are_given)}

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the resolved input."""
        return hashlib.sha256(json.dumps(self.resolved(), sort_keys=True).encode()).hexdigest()

    def _line(self) -> str:
        return f" of {self.pair.name!r}: {', '.join(self.axes().ranges().values())}"

    def _table(self) -> TitledRows:
        return f"input of a table of gear pair {self.pair.name}", {
            **self.axes().ranges(),
            "pinion modification": repr(self.pinion_modification),
            "gear modification": repr(self.gear_modification),
            "mesh": repr(self.mesh),
            "contact": repr(self.contact),
        }

    def axes(self) -> StateAxes:
        """Axes of the table, not checked."""
        return StateAxes(
            self.positions,
            np.array(self.torque),
            np.array(self.centre_distance or (self.pair.centre_distance,)),
            np.array(self.misalignment),
        )


@dataclass(frozen=True)
class MeshTable(ReprMixin):
    """Static transmission error of a pair over its axes."""

    dataset: xr.Dataset
    """See `fe_ste.static_transmission_error`; with the input, its hash and the solver's settings as attributes."""

    @classmethod
    def compute(
        cls,
        wanted: TableInput,
        progress: Callable[[int, int], None] | None = None,
        *,
        executor: GridExecutor | None = None,
        partial: Path | None = None,
    ) -> MeshTable:
        """Compute a table.

        Parameters
        ----------
        progress : called with the number of finished states and of all states
        executor
            Executor of the states, see `fe_ste.transmission_error.grid`; without it two processes share a grid of more
            than a thousand states, and this process solves fewer.
        partial : file in which finished positions are kept; a stopped computation resumes from there

        Raises
        ------
        ValueError, GeometryError
            As in `fe_ste.static_transmission_error`.
        GridError
            If workers are lost.
        """
        pair = wanted.pair
        axes = StateAxes.checked(
            pair, wanted.torque, wanted.positions, wanted.centre_distance or None, wanted.misalignment
        )
        compliance = prepared_compliance(wanted)
        checkpoint = None if partial is None else Checkpoint(partial, wanted.hash)
        with ExitStack() as owned:
            if executor is None and math.prod(axes.shape) > _STATES_IN_PROCESS:
                executor = owned.enter_context(Workers())
            dataset = solve_grid(compliance, axes, executor=executor, checkpoint=checkpoint, progress=progress)
        dataset = dataset.assign(unloaded_states(compliance, axes))
        dataset.attrs |= _attributes(wanted, compliance)
        return cls(dataset)

    @classmethod
    def open(cls, path: str | Path, wanted: TableInput | None = None) -> MeshTable:
        """Read a table into memory.

        Parameters
        ----------
        wanted : if given, the table must have been computed from exactly this input

        Raises
        ------
        TableError
            If the file is missing, damaged, is not a table of this version, or belongs to another input.
        """
        path = Path(path)
        try:
            dataset = load_dataset(path, _LAYOUT)
        except FileError as error:
            raise TableError(str(error)) from error
        if wanted is not None and dataset.attrs["input_hash"] != wanted.hash:
            raise TableError(f"{path}: was computed from another input; recompute it")
        return cls(_with_cut_off(dataset, path))

    def save(self, path: str | Path) -> None:
        """Write the table; a file of that name is replaced only by a complete one.

        Parameters
        ----------
        path : its directory is made if need be
        """
        write_dataset(Path(path), self.dataset)

    @property
    def input_hash(self) -> str:
        """Hash of the input the table was computed from."""
        return str(self.dataset.attrs["input_hash"])

    @property
    def static_state(self) -> xr.Dataset:
        """The mesh cycle at the static torque, the pair's own centre distance and without misalignment.

        An axis with one value gives that value.

        Raises
        ------
        TableError
            If an axis has several values and not this one.
        """
        places = self._static_places()
        for axis, place in places.items():
            if place is None:
                raise TableError(
                    f"table of {self.dataset.attrs['pair']}: no {axis} of the static state among its values"
                )
        return self.dataset.isel(places)

    def _static_places(self) -> dict[str, int | None]:
        """Return the place of the static state along each axis; None where the axis has several values and not it."""
        places: dict[str, int | None] = {}
        for axis in STATE_AXES:
            values = self.dataset[axis].to_numpy()
            wanted = float(self.dataset.attrs.get(f"static_{axis}", math.nan))
            at = np.flatnonzero(values == wanted) if len(values) > 1 else np.array([0])
            places[axis] = int(at[0]) if len(at) else None
        return places

    def plot(self, kind: Literal["ste", "stiffness", "load_share", "contact"] = "ste", ax: Axes | None = None) -> Axes:
        """Draw a quantity at the static state.

        Where an axis of the table has several values and not that of the static state, the value nearest to their mean
        is drawn, and the title states it.

        Parameters
        ----------
        kind
            Over the mesh cycle the static transmission error ``ste`` (µm), the mesh ``stiffness`` (N/µm) or the
            ``load_share`` of each tooth pair (%); ``contact``: line load along the face (N/mm), mean of the mesh cycle.
            Positions that have not converged are crossed out.
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Raises
        ------
        ValueError
            There is no such kind.

        Examples
        --------
        >>> from fe_ste.geometry.gears import Gear
        >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
        >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
        >>> coarse = MeshSettings(layers=3, flank=4, thickness=4)
        >>> table = MeshTable.compute(TableInput(pair=pair, torque=(100.0,), positions=4, mesh=coarse))
        >>> table.plot("stiffness").get_ylabel()
        'Mesh stiffness / (N/µm)'
        """
        places = self._static_places()
        chosen = {axis: self._middle(axis) if place is None else place for axis, place in places.items()}
        state = self.dataset.isel(chosen)
        panel = draw_table(state, kind, ax)
        values = StateAxes(state.sizes["pmc"], *(np.atleast_1d(state[axis].to_numpy()) for axis in STATE_AXES)).ranges()
        stated = [
            f"{axis} {values[axis]}" for name in places if places[name] is None and (axis := name.replace("_", " "))
        ]
        if stated:
            panel.set_title(", ".join(stated))
        return panel

    def _middle(self, axis: str) -> int:
        """Return the place of the value nearest to the mean of an axis."""
        values = self.dataset[axis].to_numpy()
        return int(np.argmin(np.abs(values - values.mean())))

    @property
    def failures(self) -> list[str]:
        """Positions that have not converged, with the reason."""
        return [line for line in str(self.dataset.attrs["failures"]).splitlines() if line]

    def _line(self) -> str:
        return f" of {self.dataset.attrs['pair']!r}: {', '.join(self._ranges().values())}"

    def _table(self) -> TitledRows:
        return f"static transmission error of gear pair {self.dataset.attrs['pair']}", {
            **self._ranges(),
            "static transmission error": value_range(self.dataset["ste"], "µm", 1e6),
            "mesh stiffness": value_range(self.dataset["mesh_stiffness"], "N/µm", 1e-6),
            "non-converged states": str(len(self.failures)),
            "input": self.input_hash[:12],
        }

    def _ranges(self) -> dict[str, str]:
        positions = self.dataset.sizes["pmc"]
        values = (self.dataset[axis].to_numpy() for axis in STATE_AXES)
        return StateAxes(positions, *values).ranges()


def _with_cut_off(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Add missing variables of a table computed before contact was truncated at form diameters: nothing was truncated.

    Raises
    ------
    TableError
        It has states that have not converged for that reason.
    """
    if CUT_OFF in dataset:
        return dataset
    unsolved = int(np.count_nonzero(~dataset["converged"].to_numpy().astype(bool)))
    if unsolved:
        raise TableError(f"{path}: contains {unsolved} states that this version can solve; recompute it")
    return dataset.assign({CUT_OFF: cut_off_variable(np.zeros(dataset["ste"].shape))})


def prepared_compliance(wanted: TableInput) -> PairCompliance:
    """Prepare the pair of a table; a planet, which meshes twice, is computed once."""
    prepared = pair_compliance(wanted.pair, wanted.mesh, wanted.contact)
    return prepared.with_modifications(wanted.pinion_modification, wanted.gear_modification)


def _attributes(wanted: TableInput, compliance: PairCompliance) -> dict[str, str | int | float]:
    figures: dict[str, str | int | float] = {}
    for role, flank in zip(("pinion", "gear"), compliance.flanks, strict=True):
        figures |= {f"{role}_{name}": value for name, value in flank.figures.items()}
        figures[f"{role}_held_diameter"] = flank.gear.held_diameter
    static = {"static_centre_distance": wanted.pair.centre_distance, "static_misalignment": 0.0}
    if wanted.static_torque is not None:
        static["static_torque"] = wanted.static_torque
    packages = ("exugear", "numpy", "scipy", "scikit-fem", "numba")
    return {
        "title": f"static transmission error of gear pair {wanted.pair.name}",
        "pair": wanted.pair.name,
        "input": json.dumps(wanted.resolved(), sort_keys=True),
        "input_hash": wanted.hash,
        "method_version": TABLE,
        "boundary": "pinion hub held; gear hub (or ring's outer rim) rigid and turning about its axis only",
        "method": "closed ring of 8-node hexahedra with incompatible modes, half-space near field, linear elastic, "
        "frictionless contact on the exact rigid gap",
        **static,
        **figures,
        "versions": json.dumps({package: version(package) for package in packages}),
    }
