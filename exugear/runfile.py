"""Results of a run, streamed to netCDF while it goes on: filtered, decimated, flushed chunk by chunk.

A run in progress, or one that was stopped, is ``run.partial.nc``: a readable file with everything up to the
last flush and the state to go on from. It becomes ``run.nc`` when it is complete.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
from numpy.typing import NDArray

from exugear.channels import BALANCE_TERMS, Channels
from exugear.compilation import compiled
from exugear.extent import TAPS_PER_FACTOR
from exugear.trust import FIGURES

Floats = NDArray[np.float64]

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


class RunFile:
    """Writer of one run. The file is closed between writes, so that others may read it and a kill leaves it whole.

    Parameters
    ----------
    path : Path
        The partial file.
    channels : Channels
    attributes : mapping, optional
        What is run: starts a new file with these attributes. Without them an existing file is gone on with.
    """

    def __init__(self, path: Path, channels: Channels, attributes: Mapping[str, Any] | None = None) -> None:
        self.path = path
        self.channels = channels
        path.parent.mkdir(parents=True, exist_ok=True)
        if attributes is not None:
            with h5netcdf.File(path, "w") as file:
                self._create(file, attributes)

    def _create(self, file: h5netcdf.File, attributes: Mapping[str, Any]) -> None:
        channels = self.channels
        sizes = {"mesh": len(channels.mesh_names), "support": len(channels.support_names), "axis": 3}
        states = {"coordinate": channels.assembly.size, "signal": channels.count, "term": len(BALANCE_TERMS)}
        states |= dict(zip(("criterion", "figure"), FIGURES, strict=True))
        file.dimensions = {"time": None, "balance_time": None, "pending": None, **sizes, **states}
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

    def append(self, times: Floats, rows: Floats, balance_times: Floats, balances: Floats, state: Checkpoint) -> None:
        """Append decimated samples, lines of the energy account (n, terms), and the state to go on from."""
        with h5netcdf.File(self.path, "a") as file:
            self._append_samples(file, times, rows)
            begin = file.dimensions["balance_time"].size
            end = begin + len(balance_times)
            file.resize_dimension("balance_time", end)
            file.variables["balance_time"][begin:end] = balance_times
            for term, values in zip(BALANCE_TERMS, balances.T, strict=True):
                file.variables[term][begin:end] = values
            file.resize_dimension("pending", len(state.pending))
            if len(state.pending):
                file.variables["state_pending"][: len(state.pending)] = state.pending
            file.variables["state_q"][:] = state.q
            file.variables["state_v"][:] = state.v
            file.variables["state_balance"][:] = state.balance
            file.variables["state_judgement"][:] = state.judgement
            for name, times in zip(MESH_TIMES, state.mesh_times, strict=True):
                file.variables[name][:] = times
            file.attrs["state_step"] = state.step
            file.attrs["state_pending_first"] = state.pending_first
            file.attrs["start_angle"] = state.start_angle

    def _append_samples(self, file: h5netcdf.File, times: Floats, rows: Floats) -> None:
        if not len(times):
            return
        channels = self.channels
        begin = file.dimensions["time"].size
        end = begin + len(times)
        file.resize_dimension("time", end)
        meshes, supports = len(channels.mesh_names), len(channels.support_names)
        file.variables["time"][begin:end] = times
        file.variables["input_speed"][begin:end] = rows[:, 0]
        file.variables["overall_dte_angle"][begin:end] = rows[:, 1]
        file.variables["overall_dte"][begin:end] = rows[:, 1] * channels.radius
        file.variables["mesh_dte"][begin:end] = rows[:, 2 : 2 + meshes]
        file.variables["mesh_force"][begin:end] = rows[:, 2 + meshes : 2 + 2 * meshes]
        if supports:
            forces = rows[:, channels.supports].reshape(-1, supports, 3)
            file.variables["support_force"][begin:end] = forces
        if channels.has_places:
            places = rows[:, channels.places].reshape(-1, 3, meshes)
            file.variables["centre_distance_change"][begin:end] = places[:, 0]
            file.variables["misalignment"][begin:end] = places[:, 1]

    def last_checkpoint(self) -> Checkpoint:
        """Read the state that the file was left with."""
        with h5netcdf.File(self.path, "r") as file:
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

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Attributes of the file."""
        with h5netcdf.File(self.path, "r") as file:
            return dict(file.attrs)

    def note(self, key: str, value: Any) -> None:
        """Write one attribute."""
        with h5netcdf.File(self.path, "a") as file:
            file.attrs[key] = value


def _add(file: h5netcdf.File, name: str, dimensions: tuple[str, ...], units: str, kind: str = "f8") -> None:
    growing = ("time", "balance_time", "pending")
    chunks = tuple(4096 if d in growing else max(1, file.dimensions[d].size) for d in dimensions)
    file.create_variable(name, dimensions, kind, chunks=chunks).attrs["units"] = units
