"""Filters of stored signals: low-pass and decimation during a run, and correction of predicted values.

A multistep method evaluates at the state that it predicts, and signals come from that evaluation. The correction of the
state changes each of them in a known way: `exugear.transient.compiled.integrator.ahead_of_correction`. So the low pass
before decimation subtracts the change, at no cost in the loop:

- deflections and other positions by the method's correction of a position,
- forces of bearings by its correction of a position and its rate together, as damping is proportional to stiffness,
- forces of meshes, whose stiffness changes, by the change of their deflection times mean stiffness and damping.

Signals that depend only on corrected states (`exugear.transient.compiled.solver.Observer.complete`) are unchanged, and
so are meshes of gears with spin only: the loop corrects these itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exugear.system.signals import AXES, signal_layout
from exugear.system.system import Assembly
from exugear.transient.compiled.integrator import Method, ahead_of_correction
from exugear.transient.compiled.packing import spinning_alone
from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, eight, put

TAPS_PER_FACTOR = 31
"""Length of the anti-aliasing filter per decimation factor: 80 dB above 0.58, flat below 0.42 of the rate."""


AT_ONCE = 32
"""Results that are made of one block before the next: their rows and the taps stay in the caches of a core."""


@kernel
def filter_one(rows: Floats, first: int, taps: Floats, source: int, target: int, out: Floats) -> None:
    """Add to eight columns of out (columns,), from `target` on, those of rows from `source` on, by taps (length, 8)."""
    columns = rows.shape[1]
    length = taps.shape[0]
    if columns < SIZE:
        for c in range(max(0, -source), columns):
            for k in range(length):
                out[c] += taps[k, c] * rows[first + k, source + c]
        return
    total = eight(out, target)
    for k in range(length):
        total = total + eight(rows[first + k], source) * eight(taps[k], 0)
    put(out, target, total)


@kernel
def filter_four(rows: Floats, first: int, factor: int, taps: Floats, source: int, target: int, out: Floats) -> None:
    """Do the same for four results in parallel, because each addition waits for the one before."""
    a = eight(out[0], target)
    b = eight(out[1], target)
    c = eight(out[2], target)
    d = eight(out[3], target)
    for k in range(first, first + taps.shape[0]):
        tap = eight(taps[k - first], 0)
        a = a + eight(rows[k], source) * tap
        b = b + eight(rows[k + factor], source) * tap
        c = c + eight(rows[k + 2 * factor], source) * tap
        d = d + eight(rows[k + 3 * factor], source) * tap
    put(out[0], target, a)
    put(out[1], target, b)
    put(out[2], target, c)
    put(out[3], target, d)


@kernel
def filter_rows(rows: Floats, taps: Floats, places: Integers, factor: int, out: Floats) -> None:
    """Add to out (count, columns) every so many rows, filtered.

    Parameters
    ----------
    rows : (n, columns)
    taps : (blocks, length, 8) of eight neighbouring columns each
    places : (blocks, 2) first column that a block reads, and first one that it adds to
    out : (count, columns)
    """
    for begin in range(0, out.shape[0], AT_ONCE):
        end = min(begin + AT_ONCE, out.shape[0])
        fours = end - (end - begin) % 4 if rows.shape[1] >= SIZE else begin
        for b in range(places.shape[0]):
            source, target = places[b]
            for n in range(begin, fours, 4):
                filter_four(rows, n * factor, factor, taps[b], source, target, out[n:])
            for n in range(fours, end):
                filter_one(rows, n * factor, taps[b], source, target, out[n])


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


class Filter(NamedTuple):
    """A filter over rows: taps of each column on itself, and of some columns on others."""

    own: Floats
    """(2 half + 1, columns) weights of each column in itself."""
    other: Floats
    """(2 half + 1, columns) weights in each column of the column so many positions before it."""
    before: int
    """That number of columns."""

    @property
    def half(self) -> int:
        """Rows that it needs on either side."""
        return len(self.own) // 2


def plain_filter(factor: int, count: int) -> Filter:
    """Low pass of so many columns before decimation; nothing at all at a factor of 1."""
    taps = low_pass(factor, (TAPS_PER_FACTOR * factor) // 2 if factor > 1 else 0)
    matrix = np.repeat(taps[:, None], count, axis=1)
    return Filter(matrix, np.zeros_like(matrix), 0)


def _blocks(taps: Floats, before: int) -> tuple[Floats, Integers]:
    """Taps (blocks, length, 8) of eight columns each, none twice, and the places of `filter_rows`."""
    length, columns = taps.shape
    used = np.flatnonzero(taps.any(axis=0))
    blocks = []
    places = []
    done = 0
    for first in used:
        if first < done:
            continue
        start = max(0, min(int(first), columns - SIZE))
        block = np.zeros((length, SIZE))
        begin = max(start, done)
        done = min(start + SIZE, columns)
        block[:, begin - start : done - start] = taps[:, begin:done]
        blocks.append(block)
        places.append((start - before, start))
    return np.array(blocks).reshape(-1, length, SIZE), np.array(places, dtype=np.int64).reshape(-1, 2)


class Decimator:
    """Low pass and decimation of a stream of rows.

    Parameters
    ----------
    factor : keep every so many rows; 1 passes everything
    count : columns per row
    by : taps; the linear-phase low pass of all columns alike by default

    Examples
    --------
    >>> decimator = Decimator(2, 1)
    >>> rows = np.arange(200.0)[:, None]
    >>> first, values = decimator.push(rows[:100])
    >>> again, more = decimator.push(rows[100:])
    >>> first, again, bool(np.allclose(np.vstack([values, more])[:, 0], np.arange(first, first + 138, 2)))
    (32, 70, True)
    """

    def __init__(self, factor: int, count: int, by: Filter | None = None) -> None:
        self.factor = factor
        chosen = plain_filter(factor, count) if by is None else by
        self.half = chosen.half
        blocks = _blocks(chosen.own, 0)
        other = _blocks(chosen.other, chosen.before)
        self._taps, self._places = (np.concatenate(both) for both in zip(blocks, other, strict=True))
        self.pending = np.zeros((0, count))
        self.pending_first = 0  # number of the raw row that `pending` starts with

    def count_of(self, rows: int) -> int:
        """Count the results of so many rows in all.

        Examples
        --------
        >>> Decimator(2, 1).count_of(200)
        69
        """
        first = self.half + -self.half % self.factor
        return max(0, (rows - 1 - self.half - first) // self.factor + 1)

    def push(self, rows: Floats) -> tuple[int, Floats]:
        """Filter as far as the rows reach: number of the raw row of the first result, and the results."""
        before = len(self.pending)
        length = 2 * self.half + 1
        centre = self.pending_first + self.half
        centre += -centre % self.factor
        last = self.pending_first + before + len(rows) - 1 - self.half
        count = max(0, (last - centre) // self.factor + 1)
        begin = centre - self.half - self.pending_first  # first row that the first result needs, among all
        # Results that need rows from before come from both put together; the others from the new rows as they lie.
        of_both = min(count, max(0, -((begin - before) // self.factor)))
        results = np.zeros((count, rows.shape[1]))
        seam = np.vstack([self.pending, rows[: length + self.factor * (of_both + 1)]])
        filter_rows(seam[begin:], self._taps, self._places, self.factor, results[:of_both])
        skipped = max(0, begin + of_both * self.factor - before)
        filter_rows(rows[skipped:], self._taps, self._places, self.factor, results[of_both:])
        following = begin + count * self.factor if count else 0
        self.pending = np.vstack([self.pending[following:], rows[max(0, following - before) :]])
        self.pending_first += following
        return centre, results


HALF = 31
"""Rows on either side that the remedy takes at most."""
ANGLES = np.linspace(0.0, np.pi, 400)
"""Angles (rad) by which motions turn in a step: where the remedy is given."""
LARGEST = 0.05
"""Relative error up to which signals are put right as a whole: it grows with the sixth power of frequency and more."""
GIVEN_UP = 1.0
"""Relative error from which on nothing is put right: that lies above the band of any step that a run chooses."""
LEAST = 1e-5
"""Relative error that smaller ones count as when taps are fitted."""
POSITIONS = ("mesh_dte", "centre_distance_change", "misalignment")
"""Signals that are positions."""
FORCES = ("support_force", "support_moment")
"""Signals that are forces of springs with dampers."""


def stored_filter(assembly: Assembly, method: Method, step: float, factor: int) -> Filter:
    """Filter of all columns of a run that stores every so many steps.

    Parameters
    ----------
    method : whose predicted states the signals are read off; those of the Runge-Kutta method are not predicted
    step : s
    factor : steps for each stored sample

    Examples
    --------
    >>> from exugear.system.build import assemble
    >>> from exugear.gearbox.choice import Choice
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> from exugear.transient.compiled.integrator import RUNGE_KUTTA, adams
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> bushing = assemble(gearbox, Choice("bushing"), stiffness)
    >>> [bool(stored_filter(bushing, method, 1 / 60e3, 3).other.any()) for method in (RUNGE_KUTTA, adams(5))]
    [False, True]
    """
    layout = signal_layout(assembly)
    plain = plain_filter(factor, layout.count)
    # By how many steps what each column holds is ahead of a position; NaN where nothing is put right.
    lags = np.full(layout.count, np.nan)
    for name in POSITIONS:
        if name in layout:
            lags[layout[name].start + _meshes(assembly)] = 0.0
    connectors = assembly.with_linear_supports().connectors
    stiffness = connectors.stiffness
    damping = connectors.damping
    # The ratio where damping is in proportion to stiffness, and its mean where a file gives both.
    sizes = np.maximum((stiffness**2).sum(axis=(1, 2)), np.finfo(np.float64).tiny)
    times = np.maximum((stiffness * damping).sum(axis=(1, 2)) / sizes, 0.0)
    for name in FORCES if len(times) else ():
        lags[layout[name]] = np.repeat(times / step, len(AXES))
    if not method.is_multistep or np.isnan(lags).all():
        return plain
    half = max(plain.half, TAPS_PER_FACTOR // 2)  # at a factor of 1 nothing else is filtered
    taps = np.pad(plain.own, ((half - plain.half,) * 2, (0, 0)))
    rows = min(half, HALF)
    low_pass = taps[:, 0].copy()
    other = np.zeros_like(taps)
    for lag in np.unique(lags[np.isfinite(lags)]):
        error = ahead_of_correction(method, ANGLES, lag)
        taps[:, lags == lag] += _cascade(low_pass, _fitted(-error, 1.0 + error, error, rows))[:, None]
    first = layout["mesh_force"].start
    before = layout["mesh_force"].start - layout["mesh_dte"].start
    for m in _meshes(assembly):
        element = assembly.elements[m]
        remedy = _remedy_of_force(method, element.tangent.mean(), element.damping / step, rows)
        other[:, first + m] = element.line_of_action * _cascade(low_pass, remedy)
    return Filter(taps, other, before)


def _meshes(assembly: Assembly) -> Integers:
    """Meshes that the loop leaves as they were evaluated."""
    return np.flatnonzero(~spinning_alone(assembly.meshes))


def _remedy_of_force(method: Method, stiffness: float, damping: float, half: int) -> Floats:
    """Taps of what a mesh's force is changed by, on its deflection (N/m); damping (N/m) is that of a step.

    The force changes by stiffness and damping times what the correction does to deflection and rate.
    """
    lag = damping / stiffness if stiffness else 0.0
    error, position = (ahead_of_correction(method, ANGLES, delay) for delay in (lag, 0.0))
    return stiffness * _fitted(-(1.0 + 1j * lag * ANGLES) * error, 1.0 + position, error, half)


def _fitted(remedy: Complexes, by: Complexes, error: Complexes, half: int) -> Floats:
    """Taps (2 half + 1,) whose response is a quotient where errors are small, and less and less of it beyond.

    They are those of least squares relative to the errors, so that they change nothing where there is none.
    """
    size = np.abs(error)
    beyond = np.clip((size - LARGEST) / (GIVEN_UP - LARGEST), 0.0, 1.0)
    kept = 0.5 + 0.5 * np.cos(np.pi * beyond)
    wanted = kept * remedy / np.where(kept > 0.0, by, 1.0)
    turns = np.exp(1j * np.outer(ANGLES, np.arange(-half, half + 1)))
    weights = 1.0 / (LEAST + np.minimum(size, 1.0))
    both = np.concatenate([weights[:, None] * turns.real, weights[:, None] * turns.imag])
    taps = np.linalg.lstsq(both, np.concatenate([weights * wanted.real, weights * wanted.imag]), rcond=None)[0]
    return np.asarray(taps)


def _cascade(low_pass: Floats, remedy: Floats) -> Floats:
    """Return taps of a low pass and a remedy in series, as many as the low pass has: truncation error 1e-6.

    Their sum is zero: a mean load may be ten thousand times its fluctuation, and needs no correction.
    """
    both = np.convolve(low_pass, remedy, mode="same")
    both[len(both) // 2] -= both.sum()
    return both
