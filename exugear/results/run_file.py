"""Results of a run, kept while it goes on: filtered, decimated, written piece by piece, joined to netCDF at the end.

A run in progress, or one that was stopped, is the folder ``run.partial``: pieces ``000001.npz``, ``000002.npz``, ...,
each with its stretch of time and the state to go on from. A piece is written whole or not at all and names the checksum
of the one before it, so that pieces of different runs never mix and a kill costs one piece at most. When the run is
complete they are joined into ``run.nc``. `load_run` reads both. Pieces are no netCDF, because making some 30 variables
anew takes 60 ms, and a piece is due after 100 ms of a fast run.
"""

from __future__ import annotations

import io
import itertools
import json
import logging
import os
import re
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exugear.dynamics.signals import BALANCE_TERMS, Channels
from exugear.model.versions import RUN
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, replacement
from fe_ste.tools.sealed import ErrorKeeper, Layout, open_dataset, open_sealed, seal, write_sealed

FINAL_NAME = "run.nc"
PARTIAL_NAME = "run.partial"
"""Folder with the pieces of a run that is not complete."""
EARLIER_PARTIAL_NAME = "run.partial.nc"
"""What an earlier version wrote instead; it can be neither trusted nor gone on with."""
TEXT = np.dtype("O", metadata={"vlen": str})
"""Text of any length, as HDF5 stores it."""
MESH_TIMES = {
    "pulling_time": "time in which the deflection had the sign that teeth cannot carry (where the law is bilateral)",
    "apart_time": "time in which the teeth were apart (law table)",
    "outside_time": "time in which load, centre distance or misalignment lay outside the table, which then goes on in "
    "a straight line",
}
"""Times (s) that a run adds up for each mesh."""


@dataclass(frozen=True)
class Checkpoint:
    """State from which a run goes on: step number, coordinates, velocities, filter memory, accounts and judgement."""

    step: int
    q: Floats
    v: Floats
    pending: Floats
    pending_first: int
    balance: Floats
    start_angle: float
    mesh_times: Floats
    judgement: Floats


@dataclass(frozen=True)
class _Variable:
    """A variable of the file: dimensions, unit, type, and what it is where the name does not say it."""

    dimensions: tuple[str, ...]
    units: str
    kind: str = "f8"
    note: str = ""


_VARIABLES = {
    "time": _Variable(("time",), "s"),
    "input_speed": _Variable(("time",), "rad/s"),
    "overall_dte_angle": _Variable(("time",), "rad"),
    "overall_dte": _Variable(("time",), "m"),
    "mesh_dte": _Variable(("time", "mesh"), "m", "f4"),
    "mesh_force": _Variable(("time", "mesh"), "N", "f4"),
    "support_force": _Variable(("time", "support", "axis"), "N", "f4"),
    **{name: _Variable(("mesh",), "s", note=note) for name, note in MESH_TIMES.items()},
    "centre_distance_change": _Variable(("time", "mesh"), "m", "f4"),
    "misalignment": _Variable(("time", "mesh"), "rad", "f4"),
    "balance_time": _Variable(("balance_time",), "s"),
    **{term: _Variable(("balance_time",), "J") for term in BALANCE_TERMS},
    "state_q": _Variable(("coordinate",), "m or rad"),
    "state_v": _Variable(("coordinate",), "m/s or rad/s"),
    "state_balance": _Variable(("term",), "J"),
    "state_judgement": _Variable(("criterion", "figure"), "value, s, place"),
    "state_pending": _Variable(("pending", "signal"), "of the signals"),
}
"""What a run holds, in the order of the file; the places of meshes only where the law asks for them."""
_GROWING = ("time", "balance_time")
_LAYOUT = Layout(
    "run",
    RUN,
    {name: ("time",) for name in ("time", "input_speed", "overall_dte")},
    ("gearbox", "variant", "load_case", "mesh_law", "inertias", "highest_order"),
)
_PIECE_NAME = re.compile(r"\d{6}\.npz")
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Piece:
    """A stretch of a run.

    Attributes
    ----------
    arrays : by name, see `_VARIABLES`
    attributes : of the run, and of the state at its end
    names : of meshes and supports
    follows : checksum of the piece before, empty for the first
    """

    arrays: Mapping[str, NDArray[Any]]
    attributes: Mapping[str, Any]
    names: Mapping[str, list[str]]
    follows: str

    def write(self, path: Path) -> str:
        """Write it whole or not at all; return its checksum."""
        words = {"attributes": self.attributes, "names": self.names, "follows": self.follows}
        content = io.BytesIO()
        arrays: Mapping[str, Any] = self.arrays
        np.savez(content, words=np.array(json.dumps(words)), **arrays)
        return write_sealed(path, content.getvalue())

    @classmethod
    def read(cls, path: Path) -> tuple[_Piece, str]:
        """Read it, and its checksum.

        Raises
        ------
        FileError
            It is missing, damaged, or no piece of a run.
        """
        with open_sealed(path) as (file, checksum):
            try:
                with np.load(file, allow_pickle=False) as stored:
                    arrays = {name: stored[name] for name in stored.files}
                words = json.loads(str(arrays.pop("words")))
                return cls(arrays, words["attributes"], words["names"], words["follows"]), checksum
            except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
                raise FileError(f"{path}: is no piece of a run ({error})") from error


class RunFile:
    """Writer of one run, piece by piece; none is open between writes.

    Parameters
    ----------
    folder : Path
        Where the pieces lie.
    channels : Channels
    attributes : mapping, optional
        What is run: begins anew with these attributes. Without them the pieces that are there are gone on with.

    Raises
    ------
    FileError
        There is nothing to go on with, or the folder is a link.
    """

    def __init__(self, folder: Path, channels: Channels, attributes: Mapping[str, Any] | None = None) -> None:
        self.folder = folder
        self.channels = channels
        self._pieces: list[Path] = []
        self._lengths: dict[str, int] = dict.fromkeys(_GROWING, 0)
        self._checksum = ""
        if attributes is not None:
            discard_pieces(folder)
            self.attributes = dict(attributes)
            return
        for path, piece, checksum in _whole_pieces(folder):
            self._take(path, piece, checksum)
        if not self._pieces:
            raise FileError(f"{folder}: holds nothing to resume; run without resuming first")
        discard_pieces(folder, keep=self._pieces)
        self.attributes = dict(piece.attributes)

    def _take(self, path: Path, piece: _Piece, checksum: str) -> None:
        """Count a piece that is on the disk."""
        self._pieces.append(path)
        self._checksum = checksum
        self._lengths = {name: self._lengths[name] + len(piece.arrays[name]) for name in _GROWING}
        self._lengths["pending"] = len(piece.arrays["state_pending"])

    def append(self, times: Floats, rows: Floats, balance_times: Floats, balances: Floats, state: Checkpoint) -> None:
        """Write a piece: decimated samples, lines of the energy account (n, terms), and the state to go on from."""
        channels = self.channels
        self.attributes |= {
            "state_step": state.step,
            "state_pending_first": state.pending_first,
            "start_angle": state.start_angle,
        }
        values = {
            **self._samples(times, rows),
            "balance_time": balance_times,
            **dict(zip(BALANCE_TERMS, balances.T, strict=True)),
            **dict(zip(MESH_TIMES, state.mesh_times, strict=True)),
            "state_q": state.q,
            "state_v": state.v,
            "state_balance": state.balance,
            "state_judgement": state.judgement,
            "state_pending": state.pending,
        }
        with np.errstate(over="ignore"):  # a run that diverges
            arrays = {name: np.ascontiguousarray(value, _VARIABLES[name].kind) for name, value in values.items()}
        names = {"mesh": list(channels.mesh_names), "support": list(channels.support_names)}
        piece = _Piece(arrays, self.attributes, names, self._checksum)
        path = _piece_path(self.folder, len(self._pieces) + 1)
        self._take(path, piece, piece.write(path))

    def _samples(self, times: Floats, rows: Floats) -> dict[str, Floats]:
        channels = self.channels
        meshes, supports = len(channels.mesh_names), len(channels.support_names)
        samples = {
            "time": times,
            "input_speed": rows[:, 0],
            "overall_dte_angle": rows[:, 1],
            "overall_dte": rows[:, 1] * channels.radius,
            "mesh_dte": rows[:, 2 : 2 + meshes],
            "mesh_force": rows[:, 2 + meshes : 2 + 2 * meshes],
            "support_force": rows[:, channels.supports].reshape(len(rows), supports, 3),
        }
        if channels.has_places:
            places = rows[:, channels.places].reshape(len(rows), 3, meshes)
            samples |= {"centre_distance_change": places[:, 0], "misalignment": places[:, 1]}
        return samples

    def last_checkpoint(self) -> Checkpoint:
        """Read the state that the last piece was left with."""
        last, _ = _Piece.read(self._pieces[-1])
        arrays, attributes = last.arrays, last.attributes
        return Checkpoint(
            step=int(attributes["state_step"]),
            q=arrays["state_q"],
            v=arrays["state_v"],
            pending=arrays["state_pending"],
            pending_first=int(attributes["state_pending_first"]),
            balance=arrays["state_balance"],
            start_angle=float(attributes["start_angle"]),
            mesh_times=np.array([arrays[name] for name in MESH_TIMES]),
            judgement=arrays["state_judgement"],
        )

    def note(self, key: str, value: Any) -> None:
        """Add an attribute to the pieces that follow and to the whole run."""
        self.attributes[key] = value

    def mark(self) -> None:
        """Write a piece without samples: it keeps what was noted since the last one."""
        nothing = np.zeros(0)
        rows, lines = np.zeros((0, self.channels.count)), np.zeros((0, len(BALANCE_TERMS)))
        self.append(nothing, rows, nothing, lines, self.last_checkpoint())

    def finish(self, path: Path) -> None:
        """Join the pieces into one file, a piece in memory at a time, and remove them.

        Raises
        ------
        OSError
            The disk is full, say; the pieces are kept.
        """
        with replacement(path, self.folder) as raw:
            target = ErrorKeeper(raw)
            with h5netcdf.File(target, "w") as whole:
                self._join(whole, target)
            target.check()
            seal(raw)
        discard_pieces(self.folder)

    def _join(self, whole: h5netcdf.File, target: ErrorKeeper) -> None:
        done = dict.fromkeys(_GROWING, 0)
        for path in self._pieces:
            piece, _ = _Piece.read(path)
            if path == self._pieces[0]:
                _define(whole, piece, self.attributes, self._lengths)
            for name, values in piece.arrays.items():
                growing = _VARIABLES[name].dimensions[0]
                if not values.size:
                    continue
                if growing in done:
                    whole.variables[name][done[growing] : done[growing] + len(values)] = values
                elif path == self._pieces[-1]:
                    whole.variables[name][:] = values
            done = {name: done[name] + len(piece.arrays[name]) for name in _GROWING}
            target.check()


def _define(file: h5netcdf.File, piece: _Piece, attributes: Mapping[str, Any], lengths: Mapping[str, int]) -> None:
    """Define the variables of a whole run of so many samples, with the other dimensions of a piece."""
    sizes = {name: len(names) for name, names in piece.names.items()}
    for name, values in piece.arrays.items():
        sizes |= dict(zip(_VARIABLES[name].dimensions, values.shape, strict=True))
    # What has no length must be able to grow: netCDF knows no empty dimension.
    file.dimensions = {name: size or None for name, size in {**sizes, **lengths}.items()}
    for key, value in attributes.items():
        file.attrs[key] = value
    for name, variable in _VARIABLES.items():
        if name not in piece.arrays:
            continue
        shape = [file.dimensions[dimension].size for dimension in variable.dimensions]
        chunks = None if all(shape) else tuple(max(1, size) for size in shape)
        made = file.create_variable(name, variable.dimensions, variable.kind, chunks=chunks)
        made.attrs["units"] = variable.units
        if variable.note:
            made.attrs["long_name"] = variable.note
    for dimension, names in piece.names.items():
        made = file.create_variable(dimension, (dimension,), TEXT)
        if names:
            made[:] = np.array(names, dtype=object)


def _piece_path(folder: Path, number: int) -> Path:
    return folder / f"{number:06d}.npz"


def _whole_pieces(folder: Path) -> Iterator[tuple[Path, _Piece, str]]:
    """Pieces from the first on with their checksums, as far as each is whole and follows the one before."""
    last = ""
    for number in itertools.count(1):
        path = _piece_path(folder, number)
        if not path.exists():
            return
        try:
            piece, checksum = _Piece.read(path)
        except FileError as error:
            _log.warning("%s; the run goes on from before it", error)
            return
        if piece.follows != last:
            return  # of a run before: a kill fell between beginning anew and removing it
        yield path, piece, checksum
        last = checksum


def has_pieces(folder: Path) -> bool:
    """Tell whether a folder holds a run to go on with."""
    return _piece_path(folder, 1).is_file()


def discard_pieces(folder: Path, keep: Iterable[Path] = ()) -> None:
    """Remove the pieces of a run, the last first, and what a kill left unfinished; nothing else.

    Raises
    ------
    FileError
        The folder is a link: what it leads to may be anybody's.
    """
    if folder.is_symlink():
        raise FileError(f"{folder}: is a link; remove it, unfinished runs are kept in a folder of this name")
    if not folder.is_dir():
        return
    kept = {path.name for path in keep}
    for name in sorted(os.listdir(folder), reverse=True):
        if name not in kept and (_PIECE_NAME.fullmatch(name) or name.endswith(".partial")):
            os.unlink(folder / name)
    if not kept:
        with suppress(OSError):  # somebody keeps a file of his own there
            os.rmdir(folder)


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
    if not path.is_dir():
        return _load(path, wanted)
    asked = set(_VARIABLES) if wanted is None else {*wanted, *_LAYOUT.variables}
    parts: dict[str, list[NDArray[Any]]] = {}
    for _, piece, _ in _whole_pieces(path):
        for name in asked & set(piece.arrays):
            parts.setdefault(name, []).append(piece.arrays[name])
    if not parts:
        raise FileError(f"{path}: holds no piece of a run")
    data = xr.Dataset(coords=piece.names, attrs=piece.attributes)
    for name, variable in _VARIABLES.items():
        if name in parts:
            growing = variable.dimensions[0] in _GROWING
            note = {"long_name": variable.note} if variable.note else {}
            values = np.concatenate(parts[name]) if growing else parts[name][-1]
            data[name] = (variable.dimensions, values, {"units": variable.units, **note})
    _LAYOUT.check(data, path)
    return data if wanted is None else data[wanted]


def _load(path: Path, names: list[str] | None) -> xr.Dataset:
    with open_dataset(path, _LAYOUT) as data:
        for name in names or ():
            if name not in data.variables:
                raise FileError(f"{path}: holds no {name}")
        return data.load() if names is None else data[names].load()
