"""Tables, stresses and reductions that points of a study share: computed once, whoever asks first, locked meanwhile."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import filelock

from exugear.gearbox.gearbox import Gearbox
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.tooth_mesh.table_remarks import doubts_about_table
from exugear.system.tooth_mesh.tables import TableRequest, requested_tables, wanted_table
from fe_ste.root_stress.mesh_cycle import MeshCycleStress
from fe_ste.transmission_error.table import MeshTable, TableError, TableInput

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
        CaseError
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
        from exugear.life.pair_stresses import pair_stresses  # root stress, which most figures need not

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
        from exugear.system.bodies.of_gearbox.elastic_bodies import reduced_bodies

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
