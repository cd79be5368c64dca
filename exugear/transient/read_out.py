"""Filters of stored signals: what is read off predicted states is put right while it is filtered.

A multistep method evaluates at the state that it predicts, and signals come from that evaluation. The correction of the
state changes each of them in a known way: `exugear.transient.compiled.methods.ahead_of_correction`. So the low pass
before decimation takes the change off, at no cost in the loop:

- deflections and other positions by what the method says of a position,
- forces of bearings by what it says of a position and its rate together, as damping goes with stiffness,
- forces of meshes, whose stiffness changes, by the change of their deflection times mean stiffness and damping.

What hangs on corrected states alone (`exugear.transient.compiled.observers.Observer.complete`) stays as it is, and so
do meshes of gears that only spin: the loop corrects these itself.
"""

from __future__ import annotations

import numpy as np

from exugear.results.decimation import TAPS_PER_FACTOR, Filter, plain_filter
from exugear.system.assembly import Assembly
from exugear.system.signals import AXES, SignalLayout, signal_layout
from exugear.transient.compiled.methods import Method, ahead_of_correction
from exugear.transient.compiled.packing import spinning_alone
from fe_ste.tools.arrays import Complexes, Floats, Integers

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
    >>> from exugear.system.assemble import assemble
    >>> from exugear.gearbox.choice import Choice
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> from exugear.transient.compiled.methods import RUNGE_KUTTA, adams
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> bushing = assemble(gearbox, Choice("bushing"), stiffness)
    >>> [bool(stored_filter(bushing, method, 1 / 60e3, 3).other.any()) for method in (RUNGE_KUTTA, adams(5))]
    [False, True]
    """
    layout = signal_layout(assembly)
    plain = plain_filter(factor, layout.count)
    lags = _lags(assembly, layout, step)
    if not method.is_multistep or np.isnan(lags).all():
        return plain
    half = max(plain.half, TAPS_PER_FACTOR // 2)  # at a factor of 1 nothing else is filtered
    own = np.pad(plain.own, ((half - plain.half,) * 2, (0, 0)))
    rows = min(half, HALF)
    low_pass = own[:, 0].copy()
    other = np.zeros_like(own)
    for lag in np.unique(lags[np.isfinite(lags)]):
        own[:, lags == lag] += _after(low_pass, _remedy(method, lag, rows))[:, None]
    first = layout["mesh_force"].start
    before = layout["mesh_force"].start - layout["mesh_dte"].start
    for m in _meshes(assembly):
        element = assembly.elements[m]
        remedy = _remedy_of_force(method, element.tangent.mean(), element.damping / step, rows)
        other[:, first + m] = element.line_of_action * _after(low_pass, remedy)
    return Filter(own, other, before)


def _meshes(assembly: Assembly) -> Integers:
    """Meshes that the loop leaves as they were evaluated."""
    return np.flatnonzero(~spinning_alone(assembly.meshes))


def _lags(assembly: Assembly, layout: SignalLayout, step: float) -> Floats:
    """By how many steps what each column holds is ahead of a position (columns,); NaN where nothing is put right."""
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
    return lags


def _remedy(method: Method, lag: float, half: int) -> Floats:
    """Taps (2 half + 1,) of what a column is changed by, on itself."""
    error = ahead_of_correction(method, ANGLES, lag)
    return _fitted(-error, 1.0 + error, error, half)


def _remedy_of_force(method: Method, stiffness: float, damping: float, half: int) -> Floats:
    """Taps of what a mesh's force is changed by, on its deflection (N/m); damping (N/m) is that of a step.

    The force changes by stiffness and damping times what the correction does to deflection and rate.
    """
    lag = damping / stiffness if stiffness else 0.0
    error, position = (ahead_of_correction(method, ANGLES, one) for one in (lag, 0.0))
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


def _after(low_pass: Floats, remedy: Floats) -> Floats:
    """Taps of a low pass and a remedy one after the other, as many as the low pass has: what is cut off is 1e-6.

    Their sum is zero: a mean load may be ten thousand times the fluctuation beside it, and is right as it is.
    """
    both = np.convolve(low_pass, remedy, mode="same")
    both[len(both) // 2] -= both.sum()
    return both
