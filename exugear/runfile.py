"""Results of a run, streamed to netCDF while it goes on: filtered, decimated, written piece by piece.

A run in progress, or one that was stopped, is the folder ``run.partial``: pieces ``000001.nc``, ``000002.nc``, ...,
each a whole netCDF file of its stretch of time with the state to go on from. A piece is written whole or not at all and
names the checksum of the one before it, so that pieces of different runs never mix and a kill costs one piece at
most. When the run is complete they are joined into ``run.nc``.
"""

from __future__ import annotations

import io
import itertools
import logging
import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exugear.channels import BALANCE_TERMS, Channels
from exugear.extent import TAPS_PER_FACTOR
from exugear.trust import FIGURES
from exugear.versions import RUN
from fe_ste.compilation import compiled
from fe_ste.files import (
    ErrorKeeper,
    FileError,
    Layout,
    open_dataset,
    open_sealed,
    replacement,
    seal,
    write_sealed,
)

Floats = NDArray[np.float64]

FINAL_NAME = "run.nc"
PARTIAL_NAME = "run.partial"
"""Folder with the pieces of a run that is not complete."""
EARLIER_PARTIAL_NAME = "run.partial.nc"
"""What an earlier version wrote instead; it can be neither trusted nor gone on with."""
TEXT = np.dtype("O", metadata={"vlen": str})
"""Text of any length, as HDF5 stores it."""


@compiled
def filter_rows(rows: Floats, taps: Floats, factor: int, out: Floats) -> None:
    """Fill out (count, columns) with every so many rows, filtered by symmetric taps of unit sum (middle first)."""
    half = taps.size - 1
    for n in range(out.shape[0]):
        middle = n * factor + half
        for c in range(rows.shape[1]):
            out[n, c] = rows[middle, c]
        for k in range(1, taps.size):
            if taps[k] != 0.0:
                for c in range(rows.shape[1]):
                    out[n, c] += taps[k] * (rows[middle - k, c] + rows[middle + k, c] - 2.0 * rows[middle, c])


def low_pass(factor: int, half: int) -> Floats:
    """Taps (2 half + 1,) of the low pass before decimation: a sinc under a Kaiser window, of unit sum.

    Written out, because ``scipy.signal.firwin``, which the tests compare with, takes a third of a second to load.

    Examples
    --------
    >>> low_pass(2, 3).round(3)
    array([-0.   ,  0.   ,  0.227,  0.547,  0.227,  0.   , -0.   ])
    """
    if factor == 1:
        return np.ones(1)
    taps = np.sinc(np.arange(-half, half + 1) / factor) * np.kaiser(2 * half + 1, 8.0)
    taps /= taps.sum()
    taps[np.abs(taps) < 1e-15] = 0.0  # every other one is, but for round-off, when halving the rate
    return taps


MESH_TIMES = {
    "pulling_time": "time in which the deflection had the sign that teeth cannot carry (where the law is bilateral)",
    "apart_time": "time in which the teeth were apart (law table)",
    "outside_time": "time in which load, centre distance or misalignment lay outside the table, which then goes on in "
    "a straight line",
}
"""Times (s) that a run adds up for each mesh."""


class Decimator:
    """Linear-phase low pass and decimation of a stream of rows.

    Parameters
    ----------
    factor : int
        Keep every so many rows; 1 passes everything.
    count : int
        Columns per row.

    Examples
    --------
    >>> decimator = Decimator(2, 1)
    >>> rows = np.arange(200.0)[:, None]
    >>> first, values = decimator.push(rows[:100])
    >>> again, more = decimator.push(rows[100:])
    >>> first, again, bool(np.allclose(np.vstack([values, more])[:, 0], np.arange(first, first + 138, 2)))
    (32, 70, True)
    """

    def __init__(self, factor: int, count: int) -> None:
        self.factor = factor
        self.half = (TAPS_PER_FACTOR * factor) // 2 if factor > 1 else 0
        self.taps = low_pass(factor, self.half)
        self.pending = np.zeros((0, count))
        self.first = 0  # number of the raw row that `pending` starts with

    def push(self, rows: Floats) -> tuple[int, Floats]:
        """Filter as far as the rows reach: number of the raw row of the first result, and the results."""
        self.pending = np.vstack([self.pending, rows])
        centre = self.first + self.half
        centre += -centre % self.factor
        last = self.first + len(self.pending) - 1 - self.half
        count = max(0, (last - centre) // self.factor + 1)
        if count == 0:
            return centre, np.zeros((0, self.pending.shape[1]))
        begin = centre - self.half - self.first
        window = self.pending[begin : begin + (count - 1) * self.factor + len(self.taps)]
        # Angles far from zero lose no digits: what is filtered is the difference from the middle row.
        results = np.empty((count, window.shape[1]))
        filter_rows(window, self.taps[self.half :], self.factor, results)
        following = centre + count * self.factor - self.half
        self.pending = self.pending[following - self.first :]
        self.first = following
        return centre, results


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


_GROWING = ("time", "balance_time")
_STATE_ATTRIBUTES = ("state_step", "state_pending_first", "start_angle")
_OF_PIECE = ("follows", *_STATE_ATTRIBUTES)
_LAYOUT = Layout(
    "run",
    RUN,
    {name: ("time",) for name in ("time", "input_speed", "overall_dte")},
    ("gearbox", "variant", "load_case", "mesh_law", "inertias", "highest_order"),
)
_PIECE_NAME = re.compile(r"\d{6}\.nc")
_log = logging.getLogger(__name__)


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
        self._checksum = ""
        if attributes is not None:
            discard_pieces(folder)
            self.attributes = dict(attributes)
            return
        self._pieces, self._checksum = _whole_pieces(folder)
        if not self._pieces:
            raise FileError(f"{folder}: holds nothing to resume; run without resuming first")
        discard_pieces(folder, keep=self._pieces)
        with open_sealed(self._pieces[-1]) as (file, _), h5netcdf.File(file, "r") as piece:
            self.attributes = {key: value for key, value in piece.attrs.items() if key not in _OF_PIECE}

    def append(self, times: Floats, rows: Floats, balance_times: Floats, balances: Floats, state: Checkpoint) -> None:
        """Write a piece: decimated samples, lines of the energy account (n, terms), and the state to go on from."""
        content = io.BytesIO()
        lengths = {"time": len(times), "balance_time": len(balance_times), "pending": len(state.pending)}
        with h5netcdf.File(content, "w") as file:
            self._create(file, {**self.attributes, "follows": self._checksum}, lengths)
            self._put_samples(file, times, rows)
            if len(balance_times):
                file.variables["balance_time"][:] = balance_times
                for term, values in zip(BALANCE_TERMS, balances.T, strict=True):
                    file.variables[term][:] = values
            if len(state.pending):
                file.variables["state_pending"][:] = state.pending
            file.variables["state_q"][:] = state.q
            file.variables["state_v"][:] = state.v
            file.variables["state_balance"][:] = state.balance
            file.variables["state_judgement"][:] = state.judgement
            for name, values in zip(MESH_TIMES, state.mesh_times, strict=True):
                file.variables[name][:] = values
            file.attrs["state_step"] = state.step
            file.attrs["state_pending_first"] = state.pending_first
            file.attrs["start_angle"] = state.start_angle
        path = _piece_path(self.folder, len(self._pieces) + 1)
        self._checksum = write_sealed(path, content.getbuffer())
        self._pieces.append(path)

    def _create(self, file: h5netcdf.File, attributes: Mapping[str, Any], lengths: Mapping[str, int]) -> None:
        """Define a piece, or the whole run, of so many samples."""
        channels = self.channels
        sizes = {"mesh": len(channels.mesh_names), "support": len(channels.support_names), "axis": 3}
        states = {"coordinate": channels.assembly.size, "signal": channels.count, "term": len(BALANCE_TERMS)}
        states |= dict(zip(("criterion", "figure"), FIGURES, strict=True))
        # What has no length yet must be able to grow: netCDF knows no empty dimension.
        file.dimensions = {name: length or None for name, length in lengths.items()} | sizes | states
        for key, value in attributes.items():
            file.attrs[key] = value
        series, balance = ("time",), ("balance_time",)
        _add(file, "time", series, "s")
        _add(file, "input_speed", series, "rad/s")
        _add(file, "overall_dte_angle", series, "rad")
        _add(file, "overall_dte", series, "m")
        _add(file, "mesh_dte", (*series, "mesh"), "m", "f4")
        _add(file, "mesh_force", (*series, "mesh"), "N", "f4")
        _add(file, "support_force", (*series, "support", "axis"), "N", "f4")
        for name, note in MESH_TIMES.items():
            _add(file, name, ("mesh",), "s")
            file.variables[name].attrs["long_name"] = note
        if channels.has_places:
            _add(file, "centre_distance_change", (*series, "mesh"), "m", "f4")
            _add(file, "misalignment", (*series, "mesh"), "rad", "f4")
        _add(file, "balance_time", balance, "s")
        for term in BALANCE_TERMS:
            _add(file, term, balance, "J")
        _add(file, "state_q", ("coordinate",), "m or rad")
        _add(file, "state_v", ("coordinate",), "m/s or rad/s")
        _add(file, "state_balance", ("term",), "J")
        _add(file, "state_pending", ("pending", "signal"), "of the signals")
        _add(file, "state_judgement", ("criterion", "figure"), "value, s, place")
        for dimension, names in (("mesh", channels.mesh_names), ("support", channels.support_names)):
            variable = file.create_variable(dimension, (dimension,), TEXT)
            if names:
                variable[:] = np.array(names, dtype=object)

    def _put_samples(self, file: h5netcdf.File, times: Floats, rows: Floats) -> None:
        if not len(times):
            return
        channels = self.channels
        meshes, supports = len(channels.mesh_names), len(channels.support_names)
        file.variables["time"][:] = times
        file.variables["input_speed"][:] = rows[:, 0]
        file.variables["overall_dte_angle"][:] = rows[:, 1]
        file.variables["overall_dte"][:] = rows[:, 1] * channels.radius
        file.variables["mesh_dte"][:] = rows[:, 2 : 2 + meshes]
        file.variables["mesh_force"][:] = rows[:, 2 + meshes : 2 + 2 * meshes]
        if supports:
            file.variables["support_force"][:] = rows[:, channels.supports].reshape(-1, supports, 3)
        if channels.has_places:
            places = rows[:, channels.places].reshape(-1, 3, meshes)
            file.variables["centre_distance_change"][:] = places[:, 0]
            file.variables["misalignment"][:] = places[:, 1]

    def last_checkpoint(self) -> Checkpoint:
        """Read the state that the last piece was left with."""
        with open_sealed(self._pieces[-1]) as (content, _), h5netcdf.File(content, "r") as file:
            return Checkpoint(
                step=int(file.attrs["state_step"]),
                q=np.array(file.variables["state_q"][:]),
                v=np.array(file.variables["state_v"][:]),
                pending=np.array(file.variables["state_pending"][:]).reshape(-1, self.channels.count),
                pending_first=int(file.attrs["state_pending_first"]),
                balance=np.array(file.variables["state_balance"][:]),
                start_angle=float(file.attrs["start_angle"]),
                mesh_times=np.array([file.variables[name][:] for name in MESH_TIMES]),
                judgement=np.array(file.variables["state_judgement"][:]),
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
        lengths = dict.fromkeys(_GROWING, 0)
        for path in self._pieces:
            with open_sealed(path) as (file, _), h5netcdf.File(file, "r") as piece:
                lengths = {name: lengths[name] + piece.dimensions[name].size for name in _GROWING}
                lengths["pending"] = piece.dimensions["pending"].size
                state = {key: piece.attrs[key] for key in _STATE_ATTRIBUTES}
        self._create(whole, {**self.attributes, **state}, lengths)
        done = dict.fromkeys(_GROWING, 0)
        for path in self._pieces:
            with open_sealed(path) as (file, _), h5netcdf.File(file, "r") as piece:
                for name, variable in piece.variables.items():
                    growing = variable.dimensions[0]
                    if not all(variable.shape) or variable.dtype == TEXT:
                        continue
                    if growing in done:
                        begin = done[growing]
                        whole.variables[name][begin : begin + len(variable)] = variable[:]
                    elif path == self._pieces[-1]:
                        whole.variables[name][:] = variable[:]
                done = {name: done[name] + piece.dimensions[name].size for name in _GROWING}
            target.check()


def _add(file: h5netcdf.File, name: str, dimensions: tuple[str, ...], units: str, kind: str = "f8") -> None:
    sizes = [file.dimensions[d].size for d in dimensions]
    chunks = None if all(sizes) else tuple(max(1, size) for size in sizes)
    file.create_variable(name, dimensions, kind, chunks=chunks).attrs["units"] = units


# -- pieces ------------------------------------------------------------------------------------------------------


def _piece_path(folder: Path, number: int) -> Path:
    return folder / f"{number:06d}.nc"


def _whole_pieces(folder: Path) -> tuple[list[Path], str]:
    """Pieces from the first on, as far as each fits its checksum and follows the one before; and the last checksum."""
    pieces: list[Path] = []
    last = ""
    for number in itertools.count(1):
        path = _piece_path(folder, number)
        if not path.exists():
            break
        try:
            with open_sealed(path) as (file, checksum), h5netcdf.File(file, "r") as piece:
                if piece.attrs.get("follows") != last:
                    break  # of a run before: a kill fell between beginning anew and removing it
        except OSError as error:
            _log.warning("%s; the run goes on from before it", error)
            break
        pieces.append(path)
        last = checksum
    return pieces, last


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
    fe_ste.files.FileError: nowhere/run.nc: no such file
    """
    path = Path(path)
    wanted = None if names is None else list(names)
    if not path.is_dir():
        return _load(path, wanted)
    pieces, _ = _whole_pieces(path)
    if not pieces:
        raise FileError(f"{path}: holds no piece of a run")
    parts = [_load(piece, wanted) for piece in pieces]
    last = parts[-1]
    variables = {
        name: (variable.dims, np.concatenate([part[name].to_numpy() for part in parts]), variable.attrs)
        for name, variable in last.variables.items()
        if variable.dims and variable.dims[0] in _GROWING
    }
    whole = last.drop_dims(_GROWING, errors="ignore").assign(variables)
    del whole.attrs["follows"]
    return whole


def _load(path: Path, names: list[str] | None) -> xr.Dataset:
    with open_dataset(path, _LAYOUT) as data:
        for name in names or ():
            if name not in data.variables:
                raise FileError(f"{path}: holds no {name}")
        return data.load() if names is None else data[names].load()
