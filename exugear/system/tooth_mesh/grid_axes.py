"""Axes of a table over misalignment and centre distance that follow from how the gears stand at rest.

An axis reaches three times as far as the static state, for loads that grow and gears that swing, and at least 20 um:
over the common face for the misalignment, for the centre distance where the backlash leaves it. Ends are round numbers,
so that a gearbox that varies a little keeps its tables.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import GearPair
from fe_ste.transmission_error.table import MeshTable, TableInput

REACH = 3.0
"""Times the static state that an axis reaches."""
NEEDED = 0.5
"""Part of its reach that an axis of a table must have that is there already."""
LEAST = 20e-6
"""Least end of an axis, m."""
STEP = 40e-6
"""Longest step of openings, m: half of it is interpolated within half a per cent of what usual teeth yield."""
MOST_STEPS = 4
"""Steps to either side at most."""
ROUND_NUMBERS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


@dataclass(frozen=True)
class GridAxes:
    """Values along the axes of a pair's table."""

    openings: tuple[float, ...]
    """Openings at the +z end over the common face width, m."""
    offsets: tuple[float, ...]
    """Centre distances less that of the pair, m."""


def reaches(table: MeshTable, wanted: TableInput) -> bool:
    """Whether a table reaches far enough to serve in place of the one with axes that were laid for it."""
    for axis, nominal in (("misalignment", 0.0), ("centre_distance", wanted.pair.centre_distance)):
        have = table.dataset[axis].to_numpy() - nominal
        want = np.array(getattr(wanted, axis)) - nominal
        if have.max() < NEEDED * want.max() or have.min() > NEEDED * want.min():
            return False
    return True


def axes_reaching(pair: GearPair, opening: float = 20e-6, change: float = 33e-6) -> GridAxes:
    """Lay axes for a pair whose gears stand `opening` (m over the face) askew at rest, and `change` (m) from nominal.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="g", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=5e-2, tooth_thinning=1e-4)
    >>> axes = axes_reaching(GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3), 12e-6, 4e-6)
    >>> [round(1e6 * value) for value in axes.openings], [round(1e6 * value) for value in axes.offsets]
    ([-40, -20, 0, 20, 40], [-20, -10, 0, 10, 20])
    """
    end = rounded_up(max(LEAST, REACH * abs(opening)))
    steps = min(MOST_STEPS, max(2, math.ceil(end / STEP)))
    openings = _to_end(end, steps)
    farther = rounded_up(max(LEAST, REACH * abs(change)))
    offsets = [0.0]
    for sense in (-1.0, 1.0):
        side = _possible(pair, sense, farther)
        offsets += [0.5 * sense * side, sense * side] if side else []
    return GridAxes((*(-value for value in openings[::-1]), 0.0, *openings), tuple(sorted(offsets)))


def rounded_up(value: float) -> float:
    """Return the next round number, by `ROUND_NUMBERS`.

    Examples
    --------
    >>> [float(f"{rounded_up(value):g}") for value in (2e-5, 2.1e-5, 9e-5, 1.2e-4)]
    [2e-05, 3e-05, 0.0001, 0.00015]
    """
    power = 10.0 ** math.floor(math.log10(value) + 1e-9)
    number = next(number for number in ROUND_NUMBERS if number * power >= value * (1.0 - 1e-9))
    return float(f"{number * power:.3g}")


def _to_end(end: float, steps: int) -> tuple[float, ...]:
    return tuple(float(f"{end * step / steps:.6g}") for step in range(1, steps + 1))


def _possible(pair: GearPair, sense: float, most: float) -> float:
    """Greatest change of the centre distance to one side, m, up to `most`, at which the gears run; 0 if none."""
    change = most
    while change > 0.05 * LEAST:
        try:
            pair.with_centre_distance(pair.centre_distance + sense * change)
        except GeometryError:
            change = float(f"{0.8 * change:.2g}")
        else:
            return change
    return 0.0
