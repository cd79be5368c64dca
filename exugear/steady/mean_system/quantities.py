"""The three quantities by which a steady response is told: transmission error, bearing force, acceleration at bearings.

The force of a bearing has three parts, and those of planets three waves around the carrier as well: of each line it is
the root of the mean square over the planets, along all axes. Of several bearings the one that has most counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_ste.tools.arrays import Complexes, Floats, Integers, SingleComplexes

MEAN_OF_OTHERS = 0.5
"""What the square of a wave around the carrier has in the mean over the planets, but for that which all share."""
ALTERNATING = "alternating"
"""The wave that changes its sign from planet to planet: its square is the same at all."""


@dataclass(frozen=True, eq=False)
class Quantity:
    """One of the quantities, and what it is made of."""

    name: str
    """``error``, ``force`` or ``acceleration``."""
    units: str
    places: tuple[str, ...]
    """Bearings, of planets their family; of the transmission error one place without a name."""
    signals: tuple[Integers, ...]
    """(k,) signals of each place."""
    weights: tuple[Floats, ...]
    """(k,) what they count, as factors of their amplitudes."""

    def at(self, amplitude: Complexes | SingleComplexes, place: int) -> Complexes:
        """Weighted amplitudes (..., k) at a place from those of all signals (..., signals)."""
        return np.asarray(amplitude[..., self.signals[place]] * self.weights[place])

    def sizes(self, amplitude: Complexes | SingleComplexes | Floats) -> Floats:
        """Size (..., places) at each place from the amplitudes (..., signals) of all signals, complex or not."""
        own = [
            np.linalg.norm(amplitude[..., signals] * weights, axis=-1)
            for signals, weights in zip(self.signals, self.weights, strict=True)
        ]
        return np.stack(own, axis=-1)


SIGNALS = {
    "error": ("overall_dte", "m"),
    "force": ("support_force", "N"),
    "acceleration": ("seat_acceleration", "m/s2"),
}
"""Signals of each quantity and their units."""


def quantities_of(names: Sequence[str]) -> tuple[Quantity, ...]:
    """Find the quantities among signals; a gearbox without bearings has no force and no acceleration.

    Parameters
    ----------
    names : of the signals, as `exugear.steady.mean_system.signals.SignalName` has them

    Examples
    --------
    >>> names = ["overall_dte", *(f"support_force pin_a{wave} radial" for wave in (" mean", " cosine", " sine"))]
    >>> error, force = quantities_of(names)
    >>> force.places, float(force.sizes(np.array([0.0, 3.0, 4.0, 4.0]))[0])
    (('pin_a',), 5.0)
    """
    found = []
    for quantity, (signal, units) in SIGNALS.items():
        places: dict[str, list[tuple[int, float]]] = {}
        for at, name in enumerate(names):
            kind, _, rest = name.partition(" ")
            if kind == signal:
                place, *wave = rest.split(" ")[:-1] or [""]
                shared = not wave or wave[0] in ("mean", ALTERNATING)
                places.setdefault(place, []).append((at, 1.0 if shared else float(np.sqrt(MEAN_OF_OTHERS))))
        if places:
            signals = tuple(np.array([at for at, _ in own]) for own in places.values())
            weights = tuple(np.array([weight for _, weight in own]) for own in places.values())
            found.append(Quantity(quantity, units, tuple(places), signals, weights))
    return tuple(found)
