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
import scipy.signal
from numpy.typing import NDArray

from exugear.channels import BALANCE_TERMS, Channels

Floats = NDArray[np.float64]

TEXT = np.dtype("O", metadata={"vlen": str})
"""Text of any length, as HDF5 stores it."""
TAPS_PER_FACTOR = 31
"""Length of the anti-aliasing filter per decimation factor: 80 dB above 0.58, flat below 0.42 of the rate."""


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
        window = ("kaiser", 8.0)
        taps = [1.0] if factor == 1 else scipy.signal.firwin(2 * self.half + 1, 1.0 / factor, window=window)
        self.taps = np.asarray(taps)
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
        # Angles far from zero lose no digits: what is filtered is the difference from the first row.
        base = window[0]
        filtered = scipy.signal.upfirdn(self.taps, window - base, down=1, axis=0)
        results = filtered[len(self.taps) - 1 :: self.factor][:count] + base
        following = centre + count * self.factor - self.half
        self.pending = self.pending[following - self.first :]
        self.first = following
        return centre, results


@dataclass(frozen=True)
class Checkpoint:
    """State from which a run goes on: step number, coordinates, velocities, filter memory, accounts so far."""

    step: int
    q: Floats
    v: Floats
    pending: Floats
    pending_first: int
    balance: Floats
    start_angle: float
    pulling_time: Floats


class RunFile:
    """Writer of one run.

    Parameters
    ----------
    path : Path
        The partial file.
    channels : Channels
    attributes : mapping
        What was run, written as attributes.
    resume : bool
        Go on in an existing file instead of starting a new one.
    """

    def __init__(self, path: Path, channels: Channels, attributes: Mapping[str, Any], resume: bool = False) -> None:
        self.path = path
        self.channels = channels
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = h5netcdf.File(path, "a" if resume else "w")
        if not resume:
            self._create(attributes)

    def _create(self, attributes: Mapping[str, Any]) -> None:
        file, channels = self._file, self.channels
        sizes = {"mesh": len(channels.mesh_names), "support": len(channels.support_names), "axis": 3}
        file.dimensions = {
            "time": None, "balance_time": None, **sizes, "name_length": 64,
            "coordinate": channels.assembly.size, "signal": channels.count, "pending": None,
            "term": len(BALANCE_TERMS),
        }  # fmt: skip
        for key, value in attributes.items():
            file.attrs[key] = value
        self._variable("time", ("time",), "s", "f8")
        self._variable("input_speed", ("time",), "rad/s", "f8")
        self._variable("overall_dte_angle", ("time",), "rad", "f8")
        self._variable("overall_dte", ("time",), "m", "f8")
        self._variable("mesh_dte", ("time", "mesh"), "m", "f4")
        self._variable("mesh_force", ("time", "mesh"), "N", "f4")
        self._variable("support_force", ("time", "support", "axis"), "N", "f4")
        self._variable("pulling_time", ("mesh",), "s", "f8")
        note = "time in which the deflection had the sign that teeth cannot carry (the laws are bilateral)"
        file.variables["pulling_time"].attrs["long_name"] = note
        self._variable("balance_time", ("balance_time",), "s", "f8")
        for term in BALANCE_TERMS:
            self._variable(term, ("balance_time",), "J", "f8")
        for name, dimension in (("state_q", "coordinate"), ("state_v", "coordinate"), ("state_balance", "term")):
            self._variable(name, (dimension,), "SI", "f8")
        self._variable("state_pending", ("pending", "signal"), "SI", "f8")
        for dimension, names in (("mesh", channels.mesh_names), ("support", channels.support_names)):
            variable = file.create_variable(dimension, (dimension,), TEXT)
            if names:
                variable[:] = np.array(names, dtype=object)

    def _variable(self, name: str, dimensions: tuple[str, ...], units: str, kind: str) -> None:
        chunks = tuple(
            4096 if d in ("time", "balance_time", "pending") else max(1, self._file.dimensions[d].size)
            for d in dimensions
        )
        self._file.create_variable(name, dimensions, kind, chunks=chunks).attrs["units"] = units

    def append(self, times: Floats, rows: Floats, balance_time: float, balance: Floats) -> None:
        """Append decimated samples and one line of the energy account."""
        file, channels = self._file, self.channels
        begin = file.dimensions["time"].size
        end = begin + len(times)
        if len(times):
            file.resize_dimension("time", end)
            meshes, supports = len(channels.mesh_names), len(channels.support_names)
            file.variables["time"][begin:end] = times
            file.variables["input_speed"][begin:end] = rows[:, 0]
            file.variables["overall_dte_angle"][begin:end] = rows[:, 1]
            file.variables["overall_dte"][begin:end] = rows[:, 1] * channels.radius
            file.variables["mesh_dte"][begin:end] = rows[:, 2 : 2 + meshes]
            file.variables["mesh_force"][begin:end] = rows[:, 2 + meshes : 2 + 2 * meshes]
            if supports:
                forces = rows[:, 2 + 2 * meshes :].reshape(-1, supports, 3)
                file.variables["support_force"][begin:end] = forces
        row = file.dimensions["balance_time"].size
        file.resize_dimension("balance_time", row + 1)
        file.variables["balance_time"][row] = balance_time
        for term, value in zip(BALANCE_TERMS, balance, strict=True):
            file.variables[term][row] = value

    def checkpoint(self, state: Checkpoint) -> None:
        """Keep the state to go on from, and bring everything to the disk."""
        file = self._file
        file.resize_dimension("pending", len(state.pending))
        file.variables["state_q"][:] = state.q
        file.variables["state_v"][:] = state.v
        file.variables["state_balance"][:] = state.balance
        file.variables["pulling_time"][:] = state.pulling_time
        if len(state.pending):
            file.variables["state_pending"][: len(state.pending)] = state.pending
        file.attrs["state_step"] = state.step
        file.attrs["state_pending_first"] = state.pending_first
        file.attrs["start_angle"] = state.start_angle
        file.flush()

    def last_checkpoint(self) -> Checkpoint:
        """Read the state that the file was left with."""
        file = self._file
        return Checkpoint(
            step=int(file.attrs["state_step"]),
            q=np.array(file.variables["state_q"][:]),
            v=np.array(file.variables["state_v"][:]),
            pending=np.array(file.variables["state_pending"][:]).reshape(-1, self.channels.count),
            pending_first=int(file.attrs["state_pending_first"]),
            balance=np.array(file.variables["state_balance"][:]),
            start_angle=float(file.attrs["start_angle"]),
            pulling_time=np.array(file.variables["pulling_time"][:]),
        )

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Attributes of the file."""
        return dict(self._file.attrs)

    def note(self, key: str, value: Any) -> None:
        """Write one attribute."""
        self._file.attrs[key] = value

    def close(self) -> None:
        """Close the file."""
        self._file.close()
