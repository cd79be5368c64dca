"""The file of a run: it is written along with the pieces of the run; complete and incomplete runs can be read.

A run that is in progress or was stopped is the folder ``run.partial``. ``run.nc`` is
written in this folder, next to the pieces, and is moved to its final place when the run is complete (`RunFile`).
`load_run` reads both forms.

Each of the pieces ``000001.npz``, ``000002.npz``, ... covers an interval of time. A piece is written atomically and
contains the checksum of the previous one. So pieces of different runs never mix, and a killed process loses at most one
piece. The pieces are not netCDF files, because creating about 30 variables takes 60 ms, and a fast run writes a piece
every 100 ms.
"""

from __future__ import annotations

import itertools
import json
import logging
import os
import re
import zipfile
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exugear.gearbox.versions import RUN
from exugear.system.signals import BALANCE_TERMS, MESH_TIMES, SIGNALS, SignalLayout, Variable
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, replacement
from fe_ste.tools.stores import ErrorKeeper, Layout, load_dataset, open_sealed, seal, write_arrays

if TYPE_CHECKING:
    import h5netcdf
    import xarray as xr

STATE = (
    Variable("state_q", ("coordinate",), "m or rad"),
    Variable("state_v", ("coordinate",), "m/s or rad/s"),
    Variable("state_past", ("past", "coordinate"), "m/s2 or rad/s2"),
    Variable("state_balance", ("term",), "J"),
    Variable("state_powers", ("power",), "W"),
    Variable("state_judgement", ("criterion", "figure"), "value, s, index"),
    Variable("state_pending", ("pending", "signal"), "of the signals"),
)
"""Variables in which a `RunCheckpoint` is stored."""
VARIABLES = {variable.name: variable for variable in (*(signal for signal in SIGNALS if signal.stored), *STATE)}
"""All variables by name, in the order of the file; a run contains those of its mesh model."""
GROWING = ("time", "balance_time")
"""Dimensions along which the pieces of a run are appended."""

_PIECE_NAME = re.compile(r"\d{6}\.npz")
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunCheckpoint:
    """State from which a run is resumed."""

    step: int
    """Number of the time step that led to the state."""
    q: Floats
    v: Floats
    """(size,) coordinates and velocities."""
    past: Floats
    """(n, size) accelerations at the last steps, the latest last, as many as the integration method needs."""
    pending: Floats
    """(n, columns) samples that the filter still needs."""
    pending_first: int
    """Number of the first of these samples."""
    balance: Floats
    """(terms,) energy balance, J, as in `exugear.system.signals.BALANCE_TERMS`."""
    powers: Floats
    """(powers,) powers, W, as in `exugear.system.signals.POWERS`."""
    start_angle: float
    """Angle by which a drive started ahead, rad."""
    mesh_times: Floats
    """(times, meshes) s, as in `exugear.system.signals.MESH_TIMES`."""
    judgement: Floats
    """Intermediate values of an `exugear.transient.outcome.ValidityMonitor`."""


@dataclass(frozen=True)
class Piece:
    """An interval of a run."""

    arrays: Mapping[str, NDArray[Any]]
    """Variables by name, see `VARIABLES`."""
    attributes: Mapping[str, Any]
    """Attributes of the run, and of the state at the end of the piece."""
    names: Mapping[str, list[str]]
    """Names of meshes and supports."""
    follows: str
    """Checksum of the previous piece; empty for the first."""

    def write(self, path: Path) -> str:
        """Write the piece atomically and return its checksum."""
        words = {"attributes": self.attributes, "names": self.names, "follows": self.follows}
        return write_arrays(path, {"words": np.array(json.dumps(words)), **self.arrays})

    @classmethod
    def read(cls, path: Path, names: Collection[str] | None = None) -> tuple[Piece, str]:
        """Read a piece, or only some of its arrays, and return it with its checksum.

        Raises
        ------
        FileError
            The file is missing, damaged, or not a piece of a run.
        """
        with open_sealed(path) as (file, checksum):
            try:
                with np.load(file, allow_pickle=False) as stored:
                    words = json.loads(str(stored["words"]))
                    held = [name for name in stored.files if name != "words"]
                    arrays = {name: stored[name] for name in held if names is None or name in names}
                return cls(arrays, words["attributes"], words["names"], words["follows"]), checksum
            except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
                raise FileError(f"{path}: is not a part of a run ({error})") from error


class RunPieces:
    """Writer of the pieces of one run; no file stays open between writes.

    Parameters
    ----------
    attributes
        Attributes of a new run. If omitted, the run of the existing pieces is resumed.

    Attributes
    ----------
    paths : files of the pieces
    lengths : length so far of each dimension in `GROWING` and of the filter's samples
    attributes : attributes of the whole run

    Raises
    ------
    FileError
        There is no run to resume, or the folder is a link.
    """

    def __init__(self, folder: Path, layout: SignalLayout, attributes: Mapping[str, Any] | None = None) -> None:
        self.folder = folder
        self.paths: list[Path] = []
        self.lengths: dict[str, int] = dict.fromkeys(GROWING, 0)
        self._layout = layout
        self._checksum = ""
        if attributes is not None:
            discard_pieces(folder)
            self.attributes = dict(attributes)
            return
        for path, piece, checksum in whole_pieces(folder):
            self._count(path, piece, checksum)
        if not self.paths:
            raise FileError(f"{folder}: nothing to resume; run without --resume first")
        discard_pieces(folder, keep=self.paths)
        self.attributes = dict(piece.attributes)

    def _count(self, path: Path, piece: Piece, checksum: str) -> None:
        """Register a piece that has been written."""
        self.paths.append(path)
        self._checksum = checksum
        self.lengths = {name: self.lengths[name] + len(piece.arrays[name]) for name in GROWING}
        self.lengths["pending"] = len(piece.arrays["state_pending"])

    def append(
        self, times: Floats, rows: Floats, balance_times: Floats, balances: Floats, state: RunCheckpoint
    ) -> Piece:
        """Write a piece and return it.

        Parameters
        ----------
        times, rows : (n,) (n, columns) decimated samples, s and in the units of the layout
        balance_times, balances : (k,) (k, terms) terms of the energy balance, s and J
        state : state from which the run is resumed
        """
        self.attributes |= {
            "state_step": state.step,
            "state_pending_first": state.pending_first,
            "start_angle": state.start_angle,
        }
        values = {
            **self._layout.stored_values(times, rows),
            "balance_time": balance_times,
            **dict(zip(BALANCE_TERMS, balances.T, strict=True)),
            **dict(zip(MESH_TIMES, state.mesh_times, strict=True)),
            "state_q": state.q,
            "state_v": state.v,
            "state_past": state.past,
            "state_balance": state.balance,
            "state_powers": state.powers,
            "state_judgement": state.judgement,
            "state_pending": state.pending,
        }
        with np.errstate(over="ignore"):  # if a run diverges
            arrays = {name: np.ascontiguousarray(value, VARIABLES[name].kind) for name, value in values.items()}
        names = {dimension: list(entries) for dimension, entries in self._layout.names.items()}
        piece = Piece(arrays, self.attributes, names, self._checksum)
        path = _piece_path(self.folder, len(self.paths) + 1)
        self._count(path, piece, piece.write(path))
        return piece

    def last_checkpoint(self) -> RunCheckpoint:
        """Read the state at the end of the last piece."""
        last, _ = Piece.read(self.paths[-1])
        arrays = last.arrays
        attributes = last.attributes
        return RunCheckpoint(
            step=int(attributes["state_step"]),
            q=arrays["state_q"],
            v=arrays["state_v"],
            past=arrays["state_past"],
            pending=arrays["state_pending"],
            pending_first=int(attributes["state_pending_first"]),
            balance=arrays["state_balance"],
            powers=arrays["state_powers"],
            start_angle=float(attributes["start_angle"]),
            mesh_times=np.array([arrays[name] for name in MESH_TIMES]),
            judgement=arrays["state_judgement"],
        )

    def note(self, key: str, value: Any) -> None:
        """Add an attribute to the following pieces and to the whole run."""
        self.attributes[key] = value

    def mark(self) -> None:
        """Write a piece without samples to store the attributes added since the last one."""
        nothing = np.zeros(0)
        rows = np.zeros((0, self._layout.count))
        lines = np.zeros((0, len(BALANCE_TERMS)))
        self.append(nothing, rows, nothing, lines, self.last_checkpoint())


def _piece_path(folder: Path, number: int) -> Path:
    return folder / f"{number:06d}.npz"


def whole_pieces(folder: Path) -> Iterator[tuple[Path, Piece, str]]:
    """Yield the pieces with their checksums, up to the last that is complete and follows its predecessor."""
    last = ""
    for number in itertools.count(1):
        path = _piece_path(folder, number)
        if not path.exists():
            return
        try:
            piece, checksum = Piece.read(path)
        except FileError as error:
            _log.warning("%s; the run resumes before that point", error)
            return
        if piece.follows != last:
            return  # piece of an earlier run, if the process was killed before removing it
        yield path, piece, checksum
        last = checksum


def has_pieces(folder: Path) -> bool:
    """Return whether a folder contains a run that can be resumed."""
    return _piece_path(folder, 1).is_file()


def kept_attributes(folder: Path) -> dict[str, Any]:
    """Attributes of the last readable piece in a folder; empty without one."""
    for path in sorted(folder.glob("*.npz"), reverse=True):
        with suppress(FileError):
            return dict(Piece.read(path, ())[0].attributes)
    return {}


def discard_pieces(folder: Path, keep: Iterable[Path] = ()) -> None:
    """Remove the pieces of a run, the last first, and unfinished files of a killed process; keep all other files.

    Raises
    ------
    FileError
        The folder is a link, whose target may contain other files.
    """
    if folder.is_symlink():
        raise FileError(f"{folder}: is a link; remove it, interrupted runs are stored in a folder of this name")
    if not folder.is_dir():
        return
    kept = {path.name for path in keep}
    for name in sorted(os.listdir(folder), reverse=True):
        if name not in kept and (_PIECE_NAME.fullmatch(name) or name.endswith(".partial")):
            os.unlink(folder / name)
    if not kept:
        with suppress(OSError):  # the user has put other files there
            os.rmdir(folder)


FINAL_NAME = "run.nc"
PARTIAL_NAME = "run.partial"
"""Folder with the pieces of an incomplete run."""
EARLIER_PARTIAL_NAME = "run.partial.nc"
"""File that an earlier version wrote instead; it is not valid and cannot be resumed."""
TEXT = np.dtype("O", metadata={"vlen": str})
"""Text of any length, in the data type of HDF5."""
_LAYOUT = Layout(
    "run",
    RUN,
    {name: VARIABLES[name].dimensions for name in ("time", "input_speed", "overall_dte")},
    ("gearbox", "variant", "load_case", "mesh_model", "inertias", "highest_order"),
)


class RunFile:
    """The file of a run, which grows during the run; as a context manager it removes an unfinished file.

    Samples are written to their final positions together with the pieces, so that little work remains at the end. An
    unfinished file cannot be resumed; the pieces serve that purpose.

    Parameters
    ----------
    path : path of the finished file; until then the file is in the folder of the pieces
    pieces : pieces of the run; those of a stopped run are copied from their files
    samples : number of samples of each signal in the whole run
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
        """Return the object; the file is created with the first piece."""
        return self

    def __exit__(self, *raised: Any) -> None:
        """Remove the file if it is unfinished."""
        with suppress(_Unfinished):
            self._open.__exit__(*(raised if raised[0] else (_Unfinished, _Unfinished(), None)))

    def add(self, piece: Piece) -> None:
        """Copy the piece that was written last.

        Raises
        ------
        OSError
            The file cannot be written, for example on a full disk; the pieces are kept.
        """
        self._take_over(len(self._pieces.paths) - 1)
        self._take(piece)

    def finish(self) -> None:
        """Write the values that are known only at the end, rename the file and remove the pieces.

        Raises
        ------
        OSError
            As in `add`.
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
        """Copy pieces from their files up to a number, skipping those already copied."""
        for path in self._pieces.paths[self._taken : pieces]:
            self._take(Piece.read(path)[0])

    def _take(self, piece: Piece) -> None:
        if self._last is None:
            import h5netcdf  # most commands read no run

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
        samples = {name: values for name, values in piece.arrays.items() if _dimension(name) == "time"}
        end = self._written + len(samples["time"])
        for name, values in samples.items():
            if values.size:
                self._file.variables[name][self._written : end] = values
        self._target.check()
        self._lines.append({name: values for name, values in piece.arrays.items() if _dimension(name) in GROWING[1:]})
        self._last, self._written, self._taken = piece, end, self._taken + 1


class _Unfinished(Exception):
    """Exception that closes a file that is not kept."""


def _dimension(name: str) -> str:
    return VARIABLES[name].dimensions[0]


def _define(file: h5netcdf.File, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Define variables for these arrays, and their dimensions if missing."""
    for name, values in arrays.items():
        variable = VARIABLES[name]
        for dimension, size in zip(variable.dimensions, values.shape, strict=True):
            if dimension not in file.dimensions:
                # netCDF has no empty dimension, so one of length zero is unlimited.
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
    path : ``run.nc``, or the folder ``run.partial`` of a run that is in progress or was stopped
    names : variables to read; all by default

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
    """Read some variables and the attributes of a run or of its pieces, without labels and the import of xarray.

    Raises
    ------
    FileError
        The run is missing or damaged, or lacks a variable.
    """
    if path.is_dir():
        stopped = load_run(path, names)
        return {str(name): stopped[name].to_numpy() for name in stopped.variables}, dict(stopped.attrs)
    import h5netcdf

    with open_sealed(path) as (file, _), h5netcdf.File(file, "r") as run:
        unknown = sorted(set(names) - set(run.variables))
        if unknown:
            raise FileError(f"{path}: contains no {unknown[0]}")
        found = {name: np.asarray(run.variables[name][...]) for name in names}
        for name, values in found.items():
            if values.dtype == object:  # texts are read as bytes
                found[name] = np.array([text.decode() for text in values], dtype=str)
        return found, dict(run.attrs)


def _load_pieces(folder: Path, wanted: list[str] | None) -> xr.Dataset:
    """Read the run from the pieces in a folder."""
    asked = set(VARIABLES) if wanted is None else {*wanted, *_LAYOUT.variables}
    parts: dict[str, list[NDArray[Any]]] = {}
    for _, piece, _ in whole_pieces(folder):
        for name in asked & set(piece.arrays):
            parts.setdefault(name, []).append(piece.arrays[name])
    if not parts:
        raise FileError(f"{folder}: contains no part of a run")
    import xarray as xr

    data = xr.Dataset(coords=piece.names, attrs=piece.attributes)
    for name, variable in VARIABLES.items():
        if name in parts:
            growing = variable.dimensions[0] in GROWING
            values = np.concatenate(parts[name]) if growing else parts[name][-1]
            data[name] = (variable.dimensions, values, variable.attributes)
    _LAYOUT.check_dataset(data, folder)
    return data if wanted is None else data[wanted]


def invalidity_of(attributes: Mapping[str, Any]) -> str:
    """Reason why a run is invalid, from the attributes of its file; empty for a valid run.

    Examples
    --------
    >>> invalidity_of({"valid": 0, "validity_message": "energy: ..."}), invalidity_of({"valid": 1}), invalidity_of({})
    ('energy: ...', '', '')
    """
    if int(attributes.get("valid", 1)):
        return ""
    return str(attributes.get("validity_message", "no reason is stored"))
