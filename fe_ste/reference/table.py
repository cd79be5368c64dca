"""Tables of the reference analysis: stored position by position, apart from tables of the superelement.

A table is one netCDF file. It is written after each position, so that converged positions are kept when the computation
is stopped or a position fails; the same input resumes from there.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from fe_ste.elasticity.gear_mesh import meshed_teeth
from fe_ste.flanks import FlankModification
from fe_ste.geometry.gear_relations import inputs_that_are_given
from fe_ste.geometry.gears import GearPair
from fe_ste.reference.finite_deformation import von_mises
from fe_ste.reference.newton import EquilibriumError, Iteration, convergence_table
from fe_ste.reference.position import Modifications, NonlinearPosition, NonlinearSettings, nonlinear_position
from fe_ste.tools.arrays import Integers
from fe_ste.tools.display import ReprMixin, TitledRows, value_range
from fe_ste.tools.files import FileError
from fe_ste.tools.stores import Layout, load_dataset, write_dataset
from fe_ste.tools.versions import NONLINEAR_TABLE
from fe_ste.transmission_error.compliance import pair_compliance
from fe_ste.transmission_error.contact_stress import mean_contact_stress
from fe_ste.transmission_error.table import TableError
from fe_ste.transmission_error.transmission_error import static_transmission_error

METHOD = "non-linear finite elements"
_UNITS = {
    "pmc": ("1", "position in the mesh cycle"),
    "torque": ("N m", "static torque on gear 1"),
    "tooth": ("1", "tooth pair, counted ahead of pair 0, which touches at the pitch point at pmc 0"),
    "ste": ("m", "static transmission error on the transverse line of action"),
    "superelement_ste": ("m", "the same by the superelement method, used for the tables of the dynamic models"),
    "mesh_stiffness": ("N/m", "secant stiffness on the transverse line of action"),
    "line_of_action_force": ("N", "torque on gear 1 over its base radius"),
    "load_share": ("1", "part of the normal load that a tooth pair carries"),
    "superelement_load_share": ("1", "part of the normal load that a tooth pair carries, by the superelement"),
    "contact_stress": (
        "Pa",
        "Hertzian stress of the line load of a tooth pair, load-weighted mean along its contact line",
    ),
    "superelement_contact_stress": ("Pa", "the same by the superelement"),
    "max_pressure": ("Pa", "largest contact pressure where a node's whole area faces the other flank"),
    "superelement_pressure": ("Pa", "largest contact pressure away from edges by the superelement"),
    "edge_pressure": ("Pa", "largest mean contact pressure of nodes at an edge; depends on the mesh"),
    "max_von_mises": ("Pa", "largest equivalent stress at the nodes"),
    "unknowns": ("1", "displacements of the mesh"),
    "iterations": ("1", "Newton iterations"),
    "wall_time": ("s", "of the position"),
    "converged": ("1", "whether the position was solved"),
}
_BY_TOOTH = ("load_share", "superelement_load_share", "contact_stress", "superelement_contact_stress")
_LAYOUT = Layout(
    "table of the non-linear analysis",
    NONLINEAR_TABLE,
    {name: (name,) for name in ("pmc", "torque", "tooth")}
    | {name: ("pmc", "torque") for name in _UNITS if name not in {"pmc", "torque", "tooth", *_BY_TOOTH}}
    | dict.fromkeys(_BY_TOOTH, ("pmc", "torque", "tooth")),
    ("method", "input_hash", "failures", "convergence"),
)
_log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class NonlinearInput(ReprMixin, line=" of {pair.name!r}: {positions} positions, torque {torque:g} N m"):
    """All that the numbers of a table depend on.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> len(NonlinearInput(pair=pair, torque=100.0).hash)
    64
    """

    pair: GearPair
    torque: float
    """Static torque on gear 1, N m."""
    positions: int = 10
    """Equally spaced positions of the mesh cycle."""
    settings: NonlinearSettings = field(default_factory=NonlinearSettings)
    pinion_modification: FlankModification = field(default_factory=FlankModification)
    gear_modification: FlankModification = field(default_factory=FlankModification)

    def __post_init__(self) -> None:
        """Refuse a table without positions."""
        if self.positions < 1:
            raise ValueError(f"positions = {self.positions}: at least 1 is needed")

    def resolved(self) -> dict[str, Any]:
        """Return the input as plain data, with everything that has a default spelled out."""
        return {"method": METHOD, "method_version": NONLINEAR_TABLE, **asdict(self, dict_factory=inputs_that_are_given)}

    @property
    def modifications(self) -> Modifications:
        """Of gear 1 and gear 2."""
        return self.pinion_modification, self.gear_modification

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the resolved input."""
        return hashlib.sha256(json.dumps(self.resolved(), sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class NonlinearTable(ReprMixin):
    """Static transmission error of a pair over the mesh cycle by the reference analysis."""

    dataset: xr.Dataset
    """Over (pmc, torque): ste (m), mesh_stiffness (N/m), line_of_action_force (N), load_share and contact_stress (Pa)
    by ``tooth``, max_pressure, edge_pressure and max_von_mises (Pa), unknowns, iterations, wall_time (s), converged.
    Positions that failed or were not reached are not a number. Attributes: input and hash, ``failures``, and the table
    of all Newton iterations, ``convergence``."""

    @classmethod
    def compute(
        cls,
        wanted: NonlinearInput,
        path: str | Path | None = None,
        progress: Callable[[int, int, Iteration | None], None] | None = None,
    ) -> NonlinearTable:
        """Compute a table.

        Parameters
        ----------
        path
            File to which each position is written once it is solved. If it holds positions of the same input, they
            are kept.
        progress
            Called with the number of finished positions, of all positions, and after a Newton iteration with that.

        Raises
        ------
        GeometryError
            If a gear cannot be meshed.
        OSError
            If the file cannot be written.
        """
        table = _stored(wanted, path) or cls(_without_results(wanted))
        solved = table.dataset["converged"].values[:, 0]
        for number in np.flatnonzero(~solved):
            done = int(solved.sum())
            if progress is not None:
                progress(done, wanted.positions, None)

            def report(iteration: Iteration, done: int = done) -> None:
                if progress is not None:
                    progress(done, wanted.positions, iteration)

            table = table._with_position(int(number), wanted, report)
            solved = table.dataset["converged"].values[:, 0]
            if path is not None:
                write_dataset(Path(path), table.dataset)
        if progress is not None:
            progress(wanted.positions, wanted.positions, None)
        return table

    @classmethod
    def open(cls, path: str | Path, wanted: NonlinearInput | None = None) -> NonlinearTable:
        """Read a table into memory.

        Parameters
        ----------
        wanted : if given, the table must have been computed from exactly this input

        Raises
        ------
        TableError
            If the file is missing, damaged, is not a table of the reference analysis in this version, or belongs to
            another input.
        """
        path = Path(path)
        try:
            dataset = load_dataset(path, _LAYOUT)
        except FileError as error:
            raise TableError(str(error)) from error
        if not str(dataset.attrs.get("method", "")).startswith(METHOD):
            raise TableError(f"{path}: is not a table of the nonlinear analysis")
        if wanted is not None and dataset.attrs["input_hash"] != wanted.hash:
            raise TableError(f"{path}: was computed from another input; recompute it")
        return cls(dataset)

    @property
    def input_hash(self) -> str:
        """Hash of the input the table was computed from."""
        return str(self.dataset.attrs["input_hash"])

    @property
    def complete(self) -> bool:
        """Whether every position is solved."""
        return bool(self.dataset["converged"].all())

    @property
    def failures(self) -> list[str]:
        """Positions that have not converged, with the reason."""
        return [line for line in str(self.dataset.attrs["failures"]).splitlines() if line]

    def _with_position(
        self, number: int, wanted: NonlinearInput, report: Callable[[Iteration], None]
    ) -> NonlinearTable:
        """Return the table with one position solved, or with the reason why it is not."""
        dataset = self.dataset.copy(deep=True)
        pmc = number / wanted.positions
        others = [line for line in self.failures if not line.startswith(f"position {pmc:.4g} ")]
        try:
            position = nonlinear_position(
                wanted.pair, wanted.torque, pmc, wanted.settings, report, wanted.modifications
            )
        except EquilibriumError as error:
            dataset.attrs["failures"] = "\n".join([*others, str(error)])
            return NonlinearTable(dataset)
        dataset.attrs["failures"] = "\n".join(others)
        dataset.attrs["convergence"] += f"position {pmc:.4g}\n{convergence_table(position.equilibrium.iterations)}\n"
        for name, value in _figures(position).items():
            dataset[name].values[number, 0] = value
        for tooth, share in position.load_share.items():
            at = {"pmc": dataset["pmc"][number], "tooth": tooth}
            dataset["load_share"].loc[at] = share
            dataset["contact_stress"].loc[at] = position.contact_stress[tooth]
        return NonlinearTable(dataset)

    def _line(self) -> str:
        solved = int(self.dataset["converged"].sum())
        torque = value_range(self.dataset["torque"], "N m")
        pair = self.dataset.attrs["pair"]
        positions = self.dataset.sizes["pmc"]
        return f" of {pair!r}: {solved} of {positions} positions solved, torque {torque}"

    def _table(self) -> TitledRows:
        return f"gear pair {self.dataset.attrs['pair']} by the reference analysis", {
            "positions solved": f"{int(self.dataset['converged'].sum())} of {self.dataset.sizes['pmc']}",
            "torque": value_range(self.dataset["torque"], "N m"),
            "static transmission error": value_range(self.dataset["ste"], "µm", 1e6),
            "mesh stiffness": value_range(self.dataset["mesh_stiffness"], "N/µm", 1e-6),
            "positions that failed": str(len(self.failures)),
            "input": self.input_hash[:12],
        }


def _figures(position: NonlinearPosition) -> dict[str, float]:
    equilibrium = position.equilibrium
    model = position.model
    force = position.torque / position.pair.pinion.base_radius
    inside = equilibrium.pressure[equilibrium.facing]
    edge = equilibrium.mean_pressure[~equilibrium.facing]
    stress = model.bricks.nodal_stress(equilibrium.displacement, equilibrium.modes)
    return {
        "ste": position.ste,
        "mesh_stiffness": force / position.ste,
        "line_of_action_force": force,
        "max_pressure": inside.max(initial=0.0),
        "edge_pressure": edge.max(initial=0.0),
        "max_von_mises": von_mises(stress).max(),
        "unknowns": position.unknowns,
        "iterations": len(equilibrium.iterations),
        "wall_time": position.wall_time,
        "converged": True,
    }


def _superelement_variables(wanted: NonlinearInput, teeth: Integers) -> dict[str, Any]:
    """Variables of the same curve by the superelement."""
    compliance = pair_compliance(wanted.pair).with_modifications(*wanted.modifications)
    curve = static_transmission_error(compliance, wanted.torque, wanted.positions)
    curve = curve.squeeze(("centre_distance", "misalignment"), drop=True)
    found = {"superelement_ste": curve["ste"], "superelement_pressure": curve["max_pressure"]}
    found |= {
        f"superelement_{name}": values.reindex(tooth=teeth, fill_value=0.0).transpose("pmc", "torque", "tooth")
        for name, values in (
            ("load_share", curve["load_share"]),
            ("contact_stress", mean_contact_stress(wanted.pair, curve)),
        )
    }
    return {name: (values.dims, values.to_numpy()) for name, values in found.items()}


def _without_results(wanted: NonlinearInput) -> xr.Dataset:
    """Table of the right shape with no position solved."""
    names = ("pmc", "torque")
    shape = (wanted.positions, 1)
    counts = ("unknowns", "iterations")
    pmc = np.arange(wanted.positions) / wanted.positions
    ranges = [meshed_teeth(wanted.pair, at) for at in pmc]
    if wanted.settings.teeth is not None:
        ranges = [range(-(wanted.settings.teeth // 2), wanted.settings.teeth // 2 + 1)]
    teeth = np.arange(min(meshed.start for meshed in ranges), max(meshed.stop for meshed in ranges))
    beside = _superelement_variables(wanted, teeth)
    floats = [name for name in _UNITS if name not in {*names, *counts, "tooth", "converged", *_BY_TOOTH, *beside}]
    variables: dict[str, Any] = {name: (names, np.full(shape, np.nan)) for name in floats}
    variables |= {name: (names, np.zeros(shape, dtype=np.int64)) for name in counts}
    variables["converged"] = (names, np.zeros(shape, dtype=np.bool_))
    for name in ("load_share", "contact_stress"):
        variables[name] = ((*names, "tooth"), np.full((*shape, len(teeth)), np.nan))
    variables |= beside
    axes = {
        "pmc": pmc,
        "torque": np.array([wanted.torque]),
        "tooth": teeth,
    }
    dataset = xr.Dataset(variables, axes)
    for name, (unit, meaning) in _UNITS.items():
        dataset[name].attrs = {"units": unit, "long_name": meaning}
    packages = ("exugear", "numpy", "scipy", "scikit-fem", "numba")
    dataset.attrs = {
        "title": f"static transmission error of gear pair {wanted.pair.name}, reference analysis",
        "pair": wanted.pair.name,
        "method": f"{METHOD} on {wanted.settings.bodies}: 8-node hexahedra with incompatible modes, mortar contact "
        f"without friction, exact multipliers, {wanted.settings.strains}",
        "boundary": "pinion hub fixed; gear hub (or outer rim of a ring) rigid, rotating about its axis only",
        "input": json.dumps(wanted.resolved(), sort_keys=True),
        "input_hash": wanted.hash,
        "method_version": NONLINEAR_TABLE,
        "failures": "",
        "convergence": "",
        "versions": json.dumps({package: version(package) for package in packages}),
    }
    return dataset


def _stored(wanted: NonlinearInput, path: str | Path | None) -> NonlinearTable | None:
    """Table in a file, if there is one of the same input."""
    if path is None or not Path(path).exists():
        return None
    try:
        return NonlinearTable.open(path, wanted)
    except TableError as error:
        _log.warning("%s; its positions are recomputed", error)
        return None
