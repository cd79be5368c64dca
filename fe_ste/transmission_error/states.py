"""States of contact and their axes, and how results are gathered over them; signs as in `fe_ste.contact.kinematics`.

A state is the solved contact of a pair at one position in the mesh cycle (pmc), torque, centre distance and
misalignment. Results are kept in arrays over these four axes and labelled as a dataset at the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fe_ste.contact.complementarity import ContactSolution
from fe_ste.contact.kinematics import Cells, ContactError
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.tools.display import ReprMixin, TitledRows, value_range
from fe_ste.transmission_error.compliance import PairCompliance
from fe_ste.transmission_error.cycle import DEFAULT_POSITIONS

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class ContactState(ReprMixin):
    """Solved contact at one position."""

    pmc: float
    normal_load: float
    """Sum of the normal forces, N."""
    cells: Cells
    solution: ContactSolution
    pressure: Floats
    """(n,) Pa."""
    truncated_load: float = 0.0
    """Share of the load that would lie beyond the form diameters, where contact is truncated: see
    `fe_ste.contact.kinematics`."""

    def _line(self) -> str:
        cells = len(self.cells.tooth)
        return f": pmc {self.pmc:.4g}, normal load {self.normal_load:.5g} N, {cells} cells"


@dataclass
class SearchStart:
    """Where the search for a state begins: what solved states hand on. It never changes what is found.

    A window that contact fills gets more cells of the same width, cells too far apart to touch are left out only if
    they are, and the complementarity problem has one solution: so a state is the same whichever were solved before.
    """

    cells: int
    """Cells of a slice across the window."""
    depth: float
    """Reckoned approach beyond the first touch, m."""
    touching: Integers | None = None
    """Addresses, relative to the contact lines, of the cells that carried load."""
    moved: int = 0
    """Cells by which contact may have moved since then."""

    def scaled(self, factor: float) -> SearchStart:
        """Return the start for `factor` times the load; the cells grow with the contact, so their addresses stay."""
        return replace(self, depth=self.depth * factor)


@dataclass(frozen=True)
class StateAxes(ReprMixin):
    """Axes of a grid of states."""

    positions: int
    """Equally spaced positions of the mesh cycle."""
    torque: Floats
    centre_distance: Floats
    misalignment: Floats
    """N m, m, rad."""

    @classmethod
    def checked(
        cls,
        pair: GearPair,
        torque: float | Sequence[float],
        positions: int = DEFAULT_POSITIONS,
        centre_distance: float | Sequence[float] | None = None,
        misalignment: float | Sequence[float] = 0.0,
    ) -> StateAxes:
        """Return the axes after checking each value; for the errors see `static_transmission_error`."""
        if positions < 1:
            raise ValueError(f"positions = {positions}: at least 1 is needed")
        torques = np.atleast_1d(np.asarray(torque, dtype=float))
        if not (np.isfinite(torques) & (torques > 0)).all():
            raise ValueError(
                f"torque = {torque}: must be positive torques on gear 1; a table belongs to one loaded flank"
            )
        misalignments = np.atleast_1d(np.asarray(misalignment, dtype=float))
        if not np.isfinite(misalignments).all():
            raise ValueError(f"misalignment = {misalignment}: must be finite angles in rad")
        distances_asked = pair.centre_distance if centre_distance is None else centre_distance
        distances = np.atleast_1d(np.asarray(distances_asked, dtype=float))
        for distance in distances:
            pair.with_centre_distance(float(distance))  # refuses before the finite elements, not after
        return cls(positions, torques, distances, misalignments)

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Number of states along each axis, positions first."""
        return self.positions, len(self.torque), len(self.centre_distance), len(self.misalignment)

    def coordinates(self) -> dict[str, Floats]:
        """Return the values along each axis under its name."""
        return {
            "pmc": np.arange(self.positions) / self.positions,
            "torque": self.torque,
            "centre_distance": self.centre_distance,
            "misalignment": self.misalignment,
        }

    def _line(self) -> str:
        return f": {', '.join(self.ranges().values())}"

    def _table(self) -> TitledRows:
        return "axes of a grid of states", self.ranges()

    def ranges(self) -> dict[str, str]:
        """Return the values along each axis as text with units."""
        return {
            "position in the mesh cycle": f"{self.positions} positions",
            "torque": value_range(self.torque, "N m"),
            "centre distance": value_range(self.centre_distance, "mm", 1e3),
            "misalignment": value_range(self.misalignment, "µrad", 1e6),
        }


CUT_OFF = "truncated_load"
"""Variable of the load neglected beyond the form diameters: see `fe_ste.contact.kinematics`."""

_UNITS = {
    "pmc": ("1", "position in the mesh cycle"),
    "torque": ("N m", "static torque on gear 1"),
    "centre_distance": ("m", "operating centre distance"),
    "misalignment": ("rad", "rotation of the axes in the plane of action; positive: gap at the +z end"),
    "tooth": ("1", "tooth pair, counted ahead of pair 0, which touches at the pitch point at pmc 0"),
    "axial_position": ("m", "from the middle of the common face width"),
    "ste": ("m", "static transmission error on the transverse line of action"),
    "mesh_stiffness": ("N/m", "secant stiffness on the transverse line of action"),
    "tangent_stiffness": ("N/m", "tangent stiffness on the transverse line of action"),
    "line_of_action_force": ("N", "torque on gear 1 over its base radius"),
    "load_share": ("1", "fraction of the normal load that a tooth pair carries"),
    "line_load": ("N/m", "normal load per length of contact line"),
    "load_centroid": ("m", "axial position of the resultant normal load"),
    "tangent_load_centroid": (
        "m",
        ("axial position of the resultant of a load increment: derivative of ste by misalignment"),
    ),
    "tangent_load_share": (
        "1",
        ("fraction of a load increment that a tooth pair carries: derivative of ste by a gap there"),
    ),
    "max_pressure": ("Pa", "largest contact pressure away from tip edges"),
    "edge_pressure": ("Pa", "largest contact pressure in cells at a tip edge; depends on their size"),
    CUT_OFF: ("1", "fraction of the load beyond the form diameters, where contact is truncated"),
    "iterations": ("1", "active-set iterations"),
    "converged": ("1", "whether the position was solved"),
}

#: Axes of a table beside the position in the mesh cycle, ``pmc``.
STATE_AXES = ("torque", "centre_distance", "misalignment")

#: Results of a state that are numbers by themselves.
RESULTS = (
    "ste",
    "tangent_stiffness",
    "load_centroid",
    "tangent_load_centroid",
    "max_pressure",
    "edge_pressure",
    CUT_OFF,
)


def _labelled(name: str, dimensions: tuple[str, ...], values: NDArray[Any]) -> xr.Variable:
    import xarray as xr

    unit, meaning = _UNITS[name]
    return xr.Variable(dimensions, values, {"units": unit, "long_name": meaning}, fastpath=True)


def cut_off_variable(values: Floats) -> xr.Variable:
    """Label shares of the load that is cut off over (pmc, torque, centre_distance, misalignment)."""
    return _labelled(CUT_OFF, ("pmc", *STATE_AXES), values)


@dataclass
class StateResults(ReprMixin):
    """Results of states over (pmc, torque, centre_distance, misalignment); those that failed are not a number."""

    teeth: Integers
    """(t,) tooth pairs that may touch."""
    axial: Floats
    """(k,) middle of the contact slices, m."""
    base_radius: float
    """Of gear 1, m."""
    values: dict[str, Floats]
    """Name of a result -> ndarray over the axes."""
    line_load: Floats
    """(..., t, k)"""
    load_share: Floats
    tangent_load_share: Floats
    """(..., t)"""
    iterations: NDArray[np.int32]
    failures: list[str] = field(default_factory=list)
    """Why states failed."""

    @classmethod
    def empty(cls, compliance: PairCompliance, shape: tuple[int, int, int, int]) -> StateResults:
        """Empty results of `shape`."""
        teeth = compliance.teeth
        axial = compliance.axial
        return cls(
            teeth,
            axial,
            compliance.pair.pinion.base_radius,
            {name: np.full(shape, np.nan) for name in RESULTS},
            np.full((*shape, len(teeth), len(axial)), np.nan),
            np.full((*shape, len(teeth)), np.nan),
            np.full((*shape, len(teeth)), np.nan),
            np.zeros(shape, dtype=np.int32),
        )

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of states along each axis."""
        return self.iterations.shape

    def restore(self, dataset: xr.Dataset, solved: Booleans) -> None:
        """Take over the states that are solved from a dataset with all tooth pairs.

        Parameters
        ----------
        solved : (positions, centre distances)
        """
        chosen = np.broadcast_to(solved[:, None, :, None], self.shape)
        for name, values in self._arrays().items():
            values[chosen] = dataset[name].to_numpy()[chosen]
        self.failures += [line for line in str(dataset.attrs["failures"]).splitlines() if line]

    def _arrays(self) -> dict[str, NDArray[Any]]:
        """All results under their names."""
        with_teeth = {name: getattr(self, name) for name in ("line_load", "load_share", "tangent_load_share")}
        return {**self.values, **with_teeth, "iterations": self.iterations}

    def put(
        self,
        index: tuple[int, int, int, int],
        compliance: PairCompliance,
        torque: float,
        pmc: float,
        misalignment: float,
        state: ContactState | ContactError,
    ) -> None:
        """Keep the results of one state, or why there are none."""
        if isinstance(state, ContactError):
            distance = compliance.pair.centre_distance
            self.failures.append(
                f"pmc {pmc:.3f}, torque {torque:g} N m, centre distance {1e3 * distance:.7g} mm, "
                f"misalignment {1e6 * misalignment:.4g} µrad: {state}"
            )
            return
        cosine = math.cos(compliance.pair.pinion.base_helix_angle)
        cells = state.cells
        solution = state.solution
        # From the contact normal, on which the contact is solved, to the transverse line of action: lengths grow by
        # 1 / cos(beta_b), forces lessen by it.
        self.values["ste"][index] = solution.approach / cosine
        self.values["tangent_stiffness"][index] = cosine**2 / solution.approach_per_load
        axial = compliance.axial[cells.layer]
        self.values["load_centroid"][index] = solution.force @ axial / state.normal_load
        self.values["tangent_load_centroid"][index] = solution.force_per_load @ axial
        self.values["max_pressure"][index] = state.pressure[~cells.cut].max(initial=0.0)
        self.values["edge_pressure"][index] = state.pressure[cells.cut].max(initial=0.0)
        self.values[CUT_OFF][index] = state.truncated_load
        loads = np.zeros((len(self.teeth), len(self.axial)))
        np.add.at(loads, (cells.tooth - self.teeth[0], cells.layer), solution.force)
        self.line_load[index] = loads * cosine / compliance.slice_width
        self.load_share[index] = loads.sum(axis=1) / state.normal_load
        pair_number = cells.tooth - self.teeth[0]
        self.tangent_load_share[index] = np.bincount(pair_number, solution.force_per_load, len(self.teeth))
        self.iterations[index] = solution.iterations

    def insert(self, positions: Sequence[int], distances: slice, part: StateResults) -> None:
        """Take over the results of some positions at some centre distances, of which `part` has no others."""
        mine = self._arrays()
        for name, values in part._arrays().items():
            mine[name][list(positions), :, distances] = values
        self.failures += part.failures

    def dataset(self, axes: StateAxes, all_teeth: bool = False) -> xr.Dataset:
        """Label the results; tooth pairs that never carry load are left out unless `all_teeth` asks for them."""
        import xarray as xr

        coordinates = axes.coordinates()
        names = tuple(coordinates)
        force = np.broadcast_to(axes.torque[:, None, None] / self.base_radius, self.iterations.shape)
        carries = np.nan_to_num(self.load_share).max(axis=(0, 1, 2, 3)) > 0
        shown = carries | all_teeth
        variables: dict[str, tuple[tuple[str, ...], NDArray[Any]]]
        variables = {name: (names, values) for name, values in self.values.items()}
        variables |= {
            "mesh_stiffness": (names, force / self.values["ste"]),
            "line_of_action_force": (names, force),
            "load_share": ((*names, "tooth"), self.load_share[..., shown]),
            "tangent_load_share": ((*names, "tooth"), self.tangent_load_share[..., shown]),
            "line_load": ((*names, "tooth", "axial_position"), self.line_load[..., shown, :]),
            "iterations": (names, self.iterations),
            "converged": (names, np.isfinite(self.values["ste"])),
        }
        coordinates |= {"tooth": self.teeth[shown], "axial_position": self.axial}
        variables |= {name: ((name,), values) for name, values in coordinates.items()}
        # As variables of arrays of numpy: else xarray loads Dask, where that is installed, to ask what they are.
        dataset = xr.Dataset({name: _labelled(name, *value) for name, value in variables.items()})
        dataset.attrs["failures"] = "\n".join(self.failures)
        return dataset

    def _line(self) -> str:
        solved = int(np.isfinite(self.values["ste"]).sum())
        return f": {solved} of {self.iterations.size} states solved, {len(self.failures)} failed"
