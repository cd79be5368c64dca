"""Tables of torque ripple over speed and torque, as programs for the design of electric machines write them.

A CSV file has a header and one row for each speed, torque and order:

    speed_rpm,torque_N_m,order,amplitude_N_m,phase_deg
    1000,100,48,0.42,10.0
    2000,100,48,0.51,25.0

Columns may be in any order; `torque_N_m` and `phase_deg` may be missing. Each order has a row at each pair of speed and
torque. Amplitude and phase are interpolated linearly, apart from each other: complex numbers of different phase would
cancel in between. Of neighbouring phases the nearest turn counts.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_ste.tools.arrays import Floats

REQUIRED = ("speed_rpm", "order", "amplitude_N_m")
OPTIONAL = ("torque_N_m", "phase_deg")
MOST_ROWS = 200_000
"""Maximum number of rows of a table."""


Curve = tuple[tuple[float, float, float], ...]
"""Rows of speed, amplitude and phase."""


class TableError(ValueError):
    """A table that cannot be used; the message says why and what to do."""


@dataclass(frozen=True, eq=False)
class RippleTable:
    """Amplitude and phase of the orders of a torque over a grid of speeds and torques."""

    speeds: Floats
    """(s,) ascending, without sign, rpm."""
    torques: Floats
    """(t,) ascending, without sign, N m; a single infinite one where the file states none."""
    orders: Floats
    """(n,)"""
    amplitudes: Floats
    phases: Floats
    """(n, t, s) N m, zero to peak, and unwrapped, degrees."""

    @property
    def has_torques(self) -> bool:
        """Return whether amplitudes and phases depend on the torque."""
        return math.isfinite(self.torques[0])

    def curves(self, torque: float) -> dict[float, Curve]:
        """Rows of speed (rpm), amplitude (N m) and phase (degrees) of each order at a static torque (N m).

        Raises
        ------
        TableError
            The table does not cover the torque.
        """
        above, share = 0, 0.0
        if self.has_torques:
            least, most = float(self.torques[0]), float(self.torques[-1])
            if not least * (1.0 - 1e-9) <= abs(torque) <= most * (1.0 + 1e-9):
                raise TableError(
                    f"covers torques from {least:g} to {most:g} N m, the static torque is {abs(torque):g} N m; add rows"
                )
            above = min(max(int(np.searchsorted(self.torques, abs(torque))), 0), len(self.torques) - 1)
            if above:
                below = self.torques[above - 1]
                share = 1.0 - min(1.0, (abs(torque) - below) / (self.torques[above] - below))
        found = {}
        for n, order in enumerate(self.orders.tolist()):
            values = [
                (1.0 - share) * of[n, above] + share * of[n, max(above - 1, 0)] for of in (self.amplitudes, self.phases)
            ]
            found[order] = tuple(zip(self.speeds.tolist(), values[0].tolist(), values[1].tolist(), strict=True))
        return found


def read_ripple_table(path: Path) -> RippleTable:
    """Read a table of torque ripple.

    Raises
    ------
    TableError
        The file cannot be read, lacks a column, has other ones, text or impossible numbers, or no complete grid; the
        message says which line.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            header, *lines = _lines(csv.reader(file, strict=True))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise TableError(f"cannot be read as CSV ({error})") from None
    names = [name.strip() for name in header[1]]
    unknown = [name for name in names if name not in (*REQUIRED, *OPTIONAL)]
    if unknown or len(set(names)) < len(names) or not set(REQUIRED) <= set(names):
        shown = ",".join(names)[:100]
        raise TableError(
            f"the header is {shown!r}; columns are {', '.join(REQUIRED)} and optionally {', '.join(OPTIONAL)}, "
            "each once"
        )
    if not lines:
        raise TableError("has a header and no rows")
    values = np.array([_numbers(number, row, len(names)) for number, row in lines])
    columns = dict(zip(names, values.T, strict=True))
    for name, column in columns.items():
        bad = np.flatnonzero(column < 0.0)
        if bad.size and name in ("speed_rpm", "amplitude_N_m"):
            raise TableError(f"line {lines[bad[0]][0]}: {name} = {column[bad[0]]:g} must not be negative")
    orders = columns["order"]
    bad = np.flatnonzero((orders <= 0.0) | (2.0 * orders != np.round(2.0 * orders)) | (orders > 2000.0))
    if bad.size:
        raise TableError(
            f"line {lines[bad[0]][0]}: order = {orders[bad[0]]:g} must be a whole number or a half, from 0.5 to 2000; "
            "a mean torque is stated in static_load and load_cases"
        )
    return _on_grid(columns, [number for number, _ in lines])


def _lines(reader: Iterator[list[str]]) -> list[tuple[int, list[str]]]:
    """Return number and cells of each line that is not empty, the header first."""
    found = []
    for number, row in enumerate(reader, start=1):
        if any(cell.strip() for cell in row):
            found.append((number, row))
        if len(found) > MOST_ROWS + 1:
            raise TableError(f"has more than {MOST_ROWS} rows; leave out orders or speeds")
    if not found:
        raise TableError("is empty")
    return found


def _numbers(line: int, row: Sequence[str], count: int) -> list[float]:
    """Return the finite numbers of a row."""
    try:
        values = [float(cell) for cell in row]
    except ValueError:
        values = []
    if len(values) != count or not all(math.isfinite(value) and abs(value) < 1e12 for value in values):
        raise TableError(f"line {line}: {count} finite numbers are required, with a decimal point, separated by commas")
    return values


def _on_grid(columns: dict[str, Floats], lines: list[int]) -> RippleTable:
    """Arrange rows on the grid of their orders, torques and speeds."""
    rows = len(lines)
    torque = np.abs(columns["torque_N_m"]) if "torque_N_m" in columns else np.full(rows, np.inf)
    order, n = np.unique(columns["order"], return_inverse=True)
    torque, t = np.unique(torque, return_inverse=True)
    speed, s = np.unique(columns["speed_rpm"], return_inverse=True)
    place = (n * len(torque) + t) * len(speed) + s
    first, counts = np.unique(place, return_index=True, return_counts=True)[1:]
    if (counts > 1).any():
        again = np.setdiff1d(np.arange(rows), first)[0]
        raise TableError(f"line {lines[again]}: repeats order, torque and speed of an earlier line; remove one")
    ascending = place[first]
    if len(ascending) < len(order) * len(torque) * len(speed):
        missing = int(np.append(np.flatnonzero(ascending != np.arange(rows)), rows)[0])
        missing, at = divmod(missing, len(speed))
        of, load = divmod(missing, len(torque))
        loaded = f" and {torque[load]:g} N m" if np.isfinite(torque[load]) else ""
        raise TableError(
            f"order {order[of]:g} has no row at {speed[at]:g} rpm{loaded}; each order needs a row at each speed and "
            "torque, with amplitude 0 where it is absent"
        )
    shape = (len(order), len(torque), len(speed))
    amplitudes = columns["amplitude_N_m"][first].reshape(shape)
    phases = (columns["phase_deg"][first] if "phase_deg" in columns else np.zeros(rows)).reshape(shape)
    phases = np.unwrap(np.unwrap(phases, axis=2, period=360.0), axis=1, period=360.0)
    return RippleTable(speed, torque, order, amplitudes, phases)
