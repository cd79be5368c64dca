"""Results in a folder that belong to a gearbox: what was computed from another input is left out, and told."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import CaseError
from exugear.gearbox.variant import VariantError
from exugear.results.bearings_file import read_duties
from exugear.results.folder import bodies_folder
from exugear.results.run_file import FINAL_NAME, load_run
from exugear.system.assemble import assemble
from exugear.system.assembly import Assembly
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.of_gearbox.elastic_bodies import reduced_bodies
from exugear.system.eigenmodes.modes import load_modes
from exugear.system.fingerprint import input_hash
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.tables import fitting_table, table_path
from fe_ste.tools.files import FileError
from fe_ste.transmission_error.table import MeshTable, TableError

Result = TypeVar("Result")
_UNFIT = (CaseError, MeshError, VariantError, BearingError, BalanceError, FileError, KeyError, ValueError)
"""What a file, or the case for the choice that it was computed of, may say."""


@dataclass
class StoredResults:
    """What lies in a results folder."""

    gearbox: Gearbox
    folder: Path
    left_out: list[str] = field(default_factory=list)
    """Files that do not belong to the gearbox, with the reason."""
    _assemblies: dict[Choice, Assembly] = field(default_factory=dict, repr=False)

    def tables(self) -> dict[str, MeshTable]:
        """Tables by pair."""
        found = {}
        for name in self.gearbox.pairs:
            if not table_path(self.folder, name).exists():
                continue
            try:
                found[name] = fitting_table(self.gearbox, name, self.folder)
            except TableError as error:
                self.left_out.append(f"table of {name}: {error}")
        return found

    def modes(self) -> dict[Choice, xr.Dataset]:
        """Modes by what they were computed of."""
        return dict(self._each("*/*/modes.nc", self._modes))

    def runs(self) -> dict[Choice, xr.Dataset]:
        """Mesh forces of finished runs by what was run, the load case included."""
        return dict(self._each(f"*/*/{FINAL_NAME}", self._run))

    def duties(self) -> list[Mapping[str, Any]]:
        """Return what bearings bear, from the most complete variant that was asked."""
        found = dict(self._each("*/*/bearings.json", self._duties))
        best = sorted(found, key=lambda choice: choice.variant.is_elastic)[-1:]
        return [duty for choice in best for duty in found[choice]]

    @property
    def loaded(self) -> Assembly | None:
        """The most complete variant with bearings of which results were read."""
        assemblies = [assembly for assembly in self._assemblies.values() if assembly.variant.on_bearings]
        return max(assemblies, key=lambda one: one.variant.is_elastic, default=None)

    def _each(self, pattern: str, read: Callable[[Path], tuple[Choice, Result]]) -> Iterator[tuple[Choice, Result]]:
        """Read files one by one; what does not belong to the gearbox is noted."""
        for path in sorted(self.folder.glob(pattern)):
            try:
                yield read(path)
            except _UNFIT as error:
                self.left_out.append(f"{path.relative_to(self.folder)}: {error}")

    def _modes(self, path: Path) -> tuple[Choice, xr.Dataset]:
        data = load_modes(path)
        self._check(_choice(data.attrs), data.attrs)
        return _choice(data.attrs), data

    def _run(self, path: Path) -> tuple[Choice, xr.Dataset]:
        data = load_run(path, ("mesh_force",))
        case = str(data.attrs["load_case"])
        if case not in self.gearbox.load_cases:
            raise CaseError(f"the case has no load case {case!r}")
        self._check(_choice(data.attrs), data.attrs, case)
        return replace(_choice(data.attrs), load_case=case), data

    def _duties(self, path: Path) -> tuple[Choice, list[Mapping[str, Any]]]:
        content = read_duties(path)
        law, _, inertias = path.parent.name.partition("-")
        choice = Choice(path.parent.parent.name, law, inertias)
        self._check(choice, content)
        return choice, content["bearings"]

    def _check(self, choice: Choice, attributes: Mapping[str, Any], load_case: str | None = None) -> None:
        """Refuse what was computed from another input.

        Raises
        ------
        CaseError
            It was.
        """
        if choice not in self._assemblies:
            bodies: dict[str, ElasticBody] = {}
            if choice.variant.is_elastic:
                bodies = reduced_bodies(self.gearbox, choice.inertia_set(self.gearbox), bodies_folder(self.folder))
            stiffness = mesh_stiffness(self.gearbox, choice.mesh_law, self.folder)
            self._assemblies[choice] = assemble(self.gearbox, choice, stiffness, bodies)
        if input_hash(self._assemblies[choice], load_case) != attributes.get("input_hash"):
            raise CaseError("was computed from another input; compute it again")


def _choice(attributes: Mapping[str, Any]) -> Choice:
    return Choice(*(str(attributes[key]) for key in ("variant", "mesh_law", "inertias")))
