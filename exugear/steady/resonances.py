"""Where lines cross modes of the mean system: speeds at which a response has to be looked at, and how strong it is.

With half a per mille of damping a peak is as wide as a per mille of its speed: even steps miss it. The linear response
of one mode tells which crossings matter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exugear.rotating.mean_modes import mean_modes
from exugear.rotating.mesh_ports import DEFLECTION
from exugear.steady.excitation import Gearset, Interface
from fe_ste.tools.arrays import Complexes, Floats

Forcing = Callable[[Interface], Complexes]
HARMONICS = 3
"""Lines of each base that are looked at."""
LEAST_SHARE = 0.01
"""Peaks below this share of the largest of their signal are left to the even steps."""
AROUND = (-2.0, -0.7, 0.0, 0.7, 2.0)
"""Speeds around a crossing in half-widths of its peak."""
MOST = 120
"""Crossings at most, the strongest first."""
ROUNDS = 2
"""Times that a crossing is found anew at its own speed."""


@dataclass(frozen=True)
class Crossing:
    """A line that meets a mode.

    Attributes
    ----------
    speed : float
        Of the input, rad/s.
    line : int
        Place in the line set.
    frequency : float
        Of the mode there, Hz.
    damping : float
        Share of critical damping.
    share : float
        Peak over the largest of its signal, whichever signal shows it most.
    """

    speed: float
    line: int
    frequency: float
    damping: float
    share: float


def crossings(gearset: Gearset, low: float, high: float, forcing: Forcing) -> tuple[Crossing, ...]:
    """Crossings of lines of single bases with modes between two speeds of the input (rad/s), the strongest first.

    `forcing` gives the forces of the meshes (lines, m, f), N, that vary in the static state.
    """
    middle = 0.5 * (low + high)
    values, peaks = _peaks(gearset, middle, forcing)
    strongest = peaks.max(axis=(0, 1))
    found = []
    lines = _looked_at(gearset)
    shares = np.max(peaks / np.maximum(strongest, 1e-300), axis=2)
    for mode, value in enumerate(values):
        for at, line in enumerate(lines):
            speed = float(np.copysign(value.imag / gearset.lines.orders[line], middle))
            # The mode moves with speed: whether it is met in the range shows where it is met.
            if shares[mode, at] >= LEAST_SHARE and 0.8 * min(abs(low), abs(high)) <= abs(speed) <= 1.2 * max(
                abs(low), abs(high)
            ):
                found.append(Crossing(speed, line, value.imag / 2.0 / np.pi, 0.0, float(shares[mode, at])))
    found.sort(key=lambda crossing: -crossing.share)
    exact = (_met(gearset, crossing) for crossing in found[:MOST])
    return tuple(crossing for crossing in exact if low <= crossing.speed <= high)


def refined(speeds: Floats, found: tuple[Crossing, ...]) -> Floats:
    """Speeds (n,) with others around each crossing, ascending."""
    around = [crossing.speed * (1.0 + offset * crossing.damping) for crossing in found for offset in AROUND]
    inside = [speed for speed in around if speeds.min() <= speed <= speeds.max()]
    return np.unique(np.concatenate([speeds, inside]))


def _looked_at(gearset: Gearset) -> list[int]:
    """Lines of a single base up to the highest harmonic that is looked at."""
    index = np.abs(gearset.lines.index)
    alone = (np.count_nonzero(index, axis=1) == 1) & (index.sum(axis=1) <= HARMONICS)
    return [int(line) for line in np.flatnonzero(alone)]


def _peaks(gearset: Gearset, speed: float, forcing: Forcing) -> tuple[Complexes, Floats]:
    """Eigenvalues, and what each mode makes of each line at resonance (modes, lines, signals).

    Signals are the overall transmission error and the deflections of the meshes.
    """
    interface = gearset.at(speed)
    values, right, left = mean_modes(gearset.system, speed)
    size = gearset.system.size
    felt = left[:, size:] @ np.linalg.solve(gearset.system.mass, gearset.loads(interface.ports).astype(complex))
    rows = np.vstack([interface.rows.by_place[:1], interface.ports.readings[:, DEFLECTION]])
    seen = np.abs(right[:, :size] @ rows.T)
    force = forcing(interface)
    pushed = [np.abs(felt @ force[line].ravel()) / np.abs(values.real) for line in _looked_at(gearset)]
    return values, np.array([seen * own[:, None] for own in pushed]).transpose(1, 0, 2)


def _met(gearset: Gearset, crossing: Crossing) -> Crossing:
    """Find a crossing with the mode as it is at that speed."""
    speed, order = crossing.speed, gearset.lines.orders[crossing.line]
    wanted, damping = 2.0 * np.pi * crossing.frequency, 0.0
    for _ in range(ROUNDS):
        values = gearset.system.eigenvalues(speed)
        value = values[np.argmin(np.abs(values.imag - wanted))]
        wanted, damping = float(value.imag), float(-value.real / abs(value))
        speed = float(np.copysign(wanted / order, speed))
    return Crossing(speed, crossing.line, wanted / 2.0 / np.pi, damping, crossing.share)
