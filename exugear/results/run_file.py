"""The file of a run: it grows beside the pieces of the run, and is read back, whole or in pieces.

A run in progress, or one that was stopped, is the folder ``run.partial`` (`exugear.results.pieces`). ``run.nc`` grows
in it, beside the pieces, and takes its place when the run is complete (`RunFile`). `load_run` reads both.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import h5netcdf
import numpy as np
from numpy.typing import NDArray

from exugear.gearbox.versions import RUN
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
TEXT = np.dtype("O", metadata={"vlen": str})
"""Text of any length, as HDF5 stores it."""
_LAYOUT = Layout(
    "run",
    RUN,
    {name: VARIABLES[name].dimensions for name in ("time", "input_speed", "overall_dte")},
    ("gearbox", "variant", "load_case", "mesh_law", "inertias", "highest_order"),
)


class RunFile:
    """The file of a run, which grows while the run goes on; as a context manager it removes what is not finished.

    Samples come to their places as the pieces are written, so that little is left to do at the end. Until it is
    finished nothing can go on from this file: that is what pieces are for.

    Parameters
    ----------
    path : its place when it is finished; until then it is in the folder of the pieces
    pieces : of the run; what a run that was stopped has left is taken over from their files
    samples : how many there are of each signal in the whole run
    """

    def __init__(self, path: Path, pieces: RunPieces, samples: int) -> None:
        self._path = path
        self._pieces = pieces
        self._samples = samples
        self._written = self._taken = 0
        self._last: Piece | None = None
        self._lines: list[Mapping[str, NDArray[Any]]] = []
        self._open = ExitStack()
        self._raw: IO[bytes]
        self._target: ErrorKeeper
        self._file: h5netcdf.File

    def __enter__(self) -> RunFile:
        """Leave the disk alone: the file is made with the first piece."""
        return self

    def __exit__(self, *raised: Any) -> None:
        """Remove the file, unless it is finished."""
        with suppress(_Unfinished):
            self._open.__exit__(*(raised if raised[0] else (_Unfinished, _Unfinished(), None)))

    def add(self, piece: Piece) -> None:
        """Take over the piece that was written last.

        Raises
        ------
        OSError
            The disk is full, say; the pieces are kept.
        """
        self._take_over(len(self._pieces.paths) - 1)
        self._take(piece)

    def finish(self) -> None:
        """Write what the end alone tells, give the file its name and remove the pieces.

        Raises
        ------
        OSError
            As `add`.
        """
        self._take_over(len(self._pieces.paths))
        if self._last is None or self._written != self._samples:
            raise ValueError(f"{self._written} samples were written of {self._samples}")
        for key, value in self._pieces.attributes.items():
            self._file.attrs[key] = value
        rest = {name: values for name, values in self._last.arrays.items() if _dimension(name) != "time"}
        for name in rest:
            if _dimension(name) in GROWING:
                rest[name] = np.concatenate([lines[name] for lines in self._lines])
        _define(self._file, rest)
        for name, values in rest.items():
            if values.size:
                self._file.variables[name][:] = values
        self._file.close()
        self._target.check()
        seal(self._raw)
        self._open.close()
        discard_pieces(self._pieces.folder)

    def _take_over(self, pieces: int) -> None:
        """Take so many pieces from their files, as far as they are not taken yet."""
        for path in self._pieces.paths[self._taken : pieces]:
            self._take(Piece.read(path)[0])

    def _take(self, piece: Piece) -> None:
        if self._last is None:
            self._begin(piece)
        samples = {name: values for name, values in piece.arrays.items() if _dimension(name) == "time"}
        end = self._written + len(samples["time"])
        for name, values in samples.items():
            if values.size:
                self._file.variables[name][self._written : end] = values
        self._target.check()
        self._lines.append({name: values for name, values in piece.arrays.items() if _dimension(name) in GROWING[1:]})
        self._last, self._written, self._taken = piece, end, self._taken + 1

    def _begin(self, piece: Piece) -> None:
        """Make the file with the names that a piece has, and room for all samples."""
        self._raw = self._open.enter_context(replacement(self._path, self._pieces.folder))
        self._target = ErrorKeeper(self._raw)
        self._file = self._open.enter_context(h5netcdf.File(self._target, "w"))
        for dimension, names in piece.names.items():
            self._file.dimensions[dimension] = len(names) or None
            made = self._file.create_variable(dimension, (dimension,), TEXT)
            if names:
                made[:] = np.array(names, dtype=object)
        self._file.dimensions["time"] = self._samples
        _define(self._file, {name: values for name, values in piece.arrays.items() if _dimension(name) == "time"})


class _Unfinished(Exception):
    """What ends a file that is not to be kept."""


def _dimension(name: str) -> str:
    """First dimension of a variable."""
    return VARIABLES[name].dimensions[0]


def _define(file: h5netcdf.File, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Define variables like these, with the dimensions that are not there yet."""
    for name, values in arrays.items():
        variable = VARIABLES[name]
        for dimension, size in zip(variable.dimensions, values.shape, strict=True):
            if dimension not in file.dimensions:
                # What has no length must be able to grow: netCDF knows no empty dimension.
                file.dimensions[dimension] = size or None
        shape = [file.dimensions[dimension].size for dimension in variable.dimensions]
        chunks = None if all(shape) else tuple(max(1, size) for size in shape)
        made = file.create_variable(name, variable.dimensions, variable.kind, chunks=chunks)
        for key, attribute in variable.attributes.items():
            made.attrs[key] = attribute


def load_run(path: str | Path, names: Iterable[str] | None = None) -> xr.Dataset:
    """Read a run into memory.

    Parameters
    ----------
    path : ``run.nc``, or the folder ``run.partial`` of a run that goes on or was stopped
    names : variables; all by default

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
    if path.is_dir():
        return _load_pieces(path, wanted)
    return load_dataset(path, _LAYOUT, wanted)


def read_run(path: Path, names: Iterable[str]) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read some variables and the attributes of a run, without labels: xarray's start costs more than that.

    Parameters
    ----------
    path : ``run.nc``, or the folder ``run.partial`` of a run that was stopped

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
        return {name: _values(run.variables[name]) for name in names}, dict(run.attrs)


def _values(variable: h5netcdf.Variable) -> NDArray[Any]:
    """Values of a variable; texts as Python's."""
    values = np.asarray(variable[...])
    if values.dtype == object:
        return np.array([text.decode() for text in values], dtype=str)
    return values


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
    if wanted is None:
        return data
    return data[wanted]


def verdict_of(attributes: Mapping[str, Any]) -> str:
    """Why the run of a file is not to be trusted, from its attributes; empty if nothing speaks against it.

    Examples
    --------
    >>> verdict_of({"trusted": 0, "verdict": "energy: ..."}), verdict_of({"trusted": 1}), verdict_of({})
    ('energy: ...', '', '')
    """
    if int(attributes.get("trusted", 1)):
        return ""
    return str(attributes.get("verdict", "no reason is kept"))
