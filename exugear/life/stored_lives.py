"""Lives in a results folder that belong to its case."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import CaseError
from exugear.life.dynamic_factors.response_factors import source_hash
from exugear.life.life import checked_loads, life_hash, rating_of
from exugear.life.life_file import read_life
from exugear.life.stress_tables import life_requests
from exugear.system.assembly import Assembly
from exugear.system.statics import BalanceError
from fe_ste.tools.files import FileError

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class StoredLife:
    """A file of a life."""

    path: Path
    data: xr.Dataset | None
    """None where it does not belong to the case."""
    reason: str = ""
    """Why it does not."""


def stored_lives(gearbox: Gearbox, folder: Path, assembled: Callable[[Choice], Assembly]) -> Iterator[StoredLife]:
    """Read all lives of a folder.

    Parameters
    ----------
    gearbox : case of the folder
    assembled : gives the equations of a choice
    """
    for path in sorted(folder.glob("*/*/life.nc")):
        try:
            data = read_life(path)
            assembly = assembled(Choice(*(str(data.attrs[key]) for key in ("variant", "mesh_law", "inertias"))))
            counted = checked_loads(gearbox)
            source = source_hash(assembly, rating_of(gearbox), folder)
            tables = {request.name: request.wanted.hash for request in life_requests(assembly, counted, folder)}
            digest = life_hash(assembly, counted, tables, source)
        except (FileError, CaseError, BalanceError, KeyError) as error:
            yield StoredLife(path, None, str(error))
            continue
        fits = data.attrs["input_hash"] == digest
        yield StoredLife(path, data if fits else None, "" if fits else "was computed from another input")
