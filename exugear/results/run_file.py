"""The file of a run: its pieces joined to netCDF when it is complete, and read back, whole or in pieces.

A run in progress, or one that was stopped, is the folder ``run.partial`` (`exugear.results.pieces`). When it is
complete the pieces are joined into ``run.nc``. `load_run` reads both.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5netcdf
import numpy as np
from numpy.typing import NDArray

from exugear.model.versions import RUN
from exugear.results.pieces import Piece, RunPieces, discard_pieces, whole_pieces
from exugear.results.variables import GROWING, VARIABLES
from fe_ste.tools.files import FileError, replacement
from fe_ste.tools.sealed import ErrorKeeper, Layout, load_dataset, open_sealed, seal

if TYPE_CHECKING:
    import xarray as xr


FINAL_NAME = "run.nc"
PARTIAL_NAME = "run.partial"
"""Folder with the pieces of a run that is not complete."""
EARLIER_PARTIAL_NAME = "run.partial.nc"
"""What an earlier version wrote instead; it can be neither trusted nor gone on with."""
STRETCH_BYTES = 16_000_000
"""What is read of pieces before it is written to the whole: writing costs by the call, not by the byte."""
TEXT = np.dtype("O", metadata={"vlen": str})
"""Text of any length, as HDF5 stores it."""
_LAYOUT = Layout(
    "run",
    RUN,
    {name: VARIABLES[name].dimensions for name in ("time", "input_speed", "overall_dte")},
    ("gearbox", "variant", "load_case", "mesh_law", "inertias", "highest_order"),
)


def join_pieces(pieces: RunPieces, path: Path) -> None:
    """Join the pieces of a run into one file, a few in memory at a time, and remove them.

    Raises
    ------
    OSError
        The disk is full, say; the pieces are kept.
    """
    with replacement(path, pieces.folder) as raw:
        target = ErrorKeeper(raw)
        with h5netcdf.File(target, "w") as whole:
            _copy_pieces(pieces, whole, target)
        target.check()
        seal(raw)
    discard_pieces(pieces.folder)


def _copy_pieces(pieces: RunPieces, whole: h5netcdf.File, target: ErrorKeeper) -> None:
    last, _ = Piece.read(pieces.paths[-1])
    _define(whole, last, pieces.attributes, pieces.lengths)
    for name, values in last.arrays.items():
        if values.size and VARIABLES[name].dimensions[0] not in GROWING:
            whole.variables[name][:] = values
    growing = [name for name in last.arrays if VARIABLES[name].dimensions[0] in GROWING]
    done = dict.fromkeys(GROWING, 0)
    for stretch in _stretches(pieces.paths, growing):
        for name, values in stretch.items():
            start = done[VARIABLES[name].dimensions[0]]
            if values.size:
                whole.variables[name][start : start + len(values)] = values
        done = {name: done[name] + len(stretch[name]) for name in GROWING}
        target.check()


def _stretches(paths: Iterable[Path], names: Sequence[str]) -> Iterator[dict[str, NDArray[Any]]]:
    """Join some variables of pieces, as many pieces at a time as fit into the memory set aside for it."""
    together: list[Mapping[str, NDArray[Any]]] = []
    size = 0
    for path in paths:
        piece, _ = Piece.read(path, names)
        together.append(piece.arrays)
        size += sum(values.nbytes for values in piece.arrays.values())
        if size >= STRETCH_BYTES:
            yield {name: np.concatenate([arrays[name] for arrays in together]) for name in names}
            together, size = [], 0
    if together:
        yield {name: np.concatenate([arrays[name] for arrays in together]) for name in names}


def _define(file: h5netcdf.File, piece: Piece, attributes: Mapping[str, Any], lengths: Mapping[str, int]) -> None:
    """Define the variables of a whole run of so many samples, with the other dimensions of a piece."""
    sizes = {name: len(names) for name, names in piece.names.items()}
    for name, values in piece.arrays.items():
        sizes |= dict(zip(VARIABLES[name].dimensions, values.shape, strict=True))
    # What has no length must be able to grow: netCDF knows no empty dimension.
    file.dimensions = {name: size or None for name, size in {**sizes, **lengths}.items()}
    for key, value in attributes.items():
        file.attrs[key] = value
    for name, variable in VARIABLES.items():
        if name not in piece.arrays:
            continue
        shape = [file.dimensions[dimension].size for dimension in variable.dimensions]
        chunks = None if all(shape) else tuple(max(1, size) for size in shape)
        made = file.create_variable(name, variable.dimensions, variable.kind, chunks=chunks)
        for key, words in variable.attributes.items():
            made.attrs[key] = words
    for dimension, names in piece.names.items():
        made = file.create_variable(dimension, (dimension,), TEXT)
        if names:
            made[:] = np.array(names, dtype=object)


def load_run(path: str | Path, names: Iterable[str] | None = None) -> xr.Dataset:
    """Read a run into memory.

    Parameters
    ----------
    path : path
        ``run.nc``, or the folder ``run.partial`` of a run that goes on or was stopped.
    names : iterable of str, optional
        Variables; all by default.

    Raises
    ------
    FileError
        The run is missing, damaged, or of another version.

    Examples
    --------
    >>> load_run("nowhere/run.nc")
    Traceback (most recent call last):
    fe_ste.tools.files.FileError: nowhere/run.nc: no such file
    """
    path = Path(path)
    wanted = None if names is None else list(names)
    return _load_pieces(path, wanted) if path.is_dir() else load_dataset(path, _LAYOUT, wanted)


def read_run(path: Path, names: Iterable[str]) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read some variables and the attributes of a run, without labels: xarray's start costs more than that.

    Parameters
    ----------
    path : path
        ``run.nc``, or the folder ``run.partial`` of a run that was stopped.
    names : iterable of str

    Raises
    ------
    FileError
        The run is missing or damaged, or has no such variable.
    """
    if path.is_dir():
        stopped = load_run(path, names)
        return {str(name): stopped[name].to_numpy() for name in stopped.variables}, dict(stopped.attrs)
    with open_sealed(path) as (file, _), h5netcdf.File(file, "r") as run:
        unknown = sorted(set(names) - set(run.variables))
        if unknown:
            raise FileError(f"{path}: holds no {unknown[0]}")
        return {name: np.asarray(run.variables[name][...]) for name in names}, dict(run.attrs)


def _load_pieces(folder: Path, wanted: list[str] | None) -> xr.Dataset:
    """Read the run that the pieces in a folder make."""
    asked = set(VARIABLES) if wanted is None else {*wanted, *_LAYOUT.variables}
    parts: dict[str, list[NDArray[Any]]] = {}
    for _, piece, _ in whole_pieces(folder):
        for name in asked & set(piece.arrays):
            parts.setdefault(name, []).append(piece.arrays[name])
    if not parts:
        raise FileError(f"{folder}: holds no piece of a run")
    import xarray as xr

    data = xr.Dataset(coords=piece.names, attrs=piece.attributes)
    for name, variable in VARIABLES.items():
        if name in parts:
            growing = variable.dimensions[0] in GROWING
            values = np.concatenate(parts[name]) if growing else parts[name][-1]
            data[name] = (variable.dimensions, values, variable.attributes)
    _LAYOUT.check(data, folder)
    return data if wanted is None else data[wanted]
