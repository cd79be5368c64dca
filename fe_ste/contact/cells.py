"""Cells over the plane of action, in which pressures are looked for; frame and signs as in `fe_ste.contact.kinematics`.

Each slice of the face width has a window of cells about its contact line. Cells are equal in arc length along the
involute, in which the contact of two flanks is nearly that of two parabolas.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fe_ste.contact.kinematics import FlankPair, circle_limit, rigid_gap
from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.tools.compilation import compiled
from fe_ste.tools.display import Displayed

#: A cell cut by a tip edge to less than this part of its width is joined to its neighbour: so narrow a cell would
#: have a pressure of its own that is all rounding.
_LEAST_CELL = 0.2


@dataclass(frozen=True)
class ContactSettings:
    """Discretisation of the contact."""

    slices: int = 48
    """Slices along the common face width."""
    cells: int = 9
    """Cells of a slice across the window that travels with the contact line."""
    window: float = 1.8
    """Half width of that window in Hertzian half widths at the largest mean line load."""

    def __post_init__(self) -> None:
        """Refuse what cannot resolve a contact."""
        for key, least in (("slices", 3), ("cells", 3), ("window", 1.0)):
            if not getattr(self, key) >= least:
                raise ValueError(f"contact setting {key} = {getattr(self, key)}: must be at least {least}")


@compiled
def _lay_cells(
    pair: FlankPair, rotation: float, teeth: Integers, axial: Floats, half_window: float, count: int
) -> tuple[Integers, Integers, Floats, Floats, Floats, Floats, Booleans, Floats]:
    """Cells around the contact lines, in the order of the attributes of `Cells`; arc lengths for rolls on gear 1.

    Arc lengths u = r_b roll^2 / 2 run along the transverse involute of gear 1.
    """
    most = len(teeth) * len(axial) * count
    tooth_of = np.empty(most, np.int64)
    slice_of = np.empty(most, np.int64)
    middle = np.empty(most)
    half = np.empty(most)
    gap = np.empty(most)
    gear_roll = np.empty(most)
    offset = np.empty(most)
    cut = np.zeros(most, np.bool_)
    edges = np.empty(count + 1)
    step = 2.0 * half_window / count
    used = 0
    for tooth in teeth:
        for layer in range(len(axial)):
            # The contact line: roll grows with the rotation, by a pitch from tooth to tooth and along the helix.
            line = pair.working_roll + rotation + tooth * pair.pitch_1 + pair.twist_1 * axial[layer]
            # Gear 1's own tip bounds the window above, the tip of gear 2 below; where a flank ends in an edge towards
            # its root, this bounds it likewise.
            lowest_roll = circle_limit(pair, pair.tip_radius_2, axial[layer], tooth, rotation)
            highest_roll = pair.tip_roll_1
            if 0.0 < pair.root_radius_2 < math.inf:
                highest_roll = circle_limit(pair, pair.root_radius_2, axial[layer], tooth, rotation)
            bottom = 0.5 * pair.base_radius_1 * lowest_roll**2
            top = 0.5 * pair.base_radius_1 * highest_roll**2
            if top - bottom < step:
                continue
            # Elastic teeth touch a little before and after the path of contact: the window then stays at the edge.
            line = min(max(line, lowest_roll), highest_roll)
            centre = 0.5 * pair.base_radius_1 * line**2
            number = 0
            for edge in range(count + 1):
                at = centre - half_window + edge * step
                at = min(max(at, bottom), top)
                if number == 0 or at > edges[number - 1]:
                    edges[number] = at
                    number += 1
            if number > 2 and edges[1] - edges[0] < _LEAST_CELL * step:
                for edge in range(1, number - 1):
                    edges[edge] = edges[edge + 1]
                number -= 1
            if number > 2 and edges[number - 1] - edges[number - 2] < _LEAST_CELL * step:
                edges[number - 2] = edges[number - 1]
                number -= 1
            for cell in range(number - 1):
                mean = 0.5 * (edges[cell] + edges[cell + 1])
                roll = math.sqrt(2.0 * mean / pair.base_radius_1)
                distance, other = rigid_gap(pair, roll, axial[layer], tooth, rotation)
                tooth_of[used], slice_of[used] = tooth, layer
                middle[used], half[used] = mean, 0.5 * (edges[cell + 1] - edges[cell])
                gap[used], gear_roll[used] = distance, other
                cut[used] = edges[cell] == bottom or edges[cell + 1] == top
                offset[used] = (mean - centre) / step
                used += 1
    return (
        tooth_of[:used], slice_of[:used], middle[:used], gear_roll[:used], half[:used], gap[:used], cut[:used],
        offset[:used],
    )  # fmt: skip


@dataclass(frozen=True)
class Cells(Displayed):
    """Contact cells of one position."""

    tooth: Integers
    layer: Integers
    """(n,) tooth pair and slice."""
    roll: Floats
    gear_roll: Floats
    """(n,) roll angles of the middle on both gears, rad."""
    half_across: Floats
    """(n,) half width along the profile, m."""
    gap: Floats
    """(n,) rigid gap of the unmodified flanks, m."""
    cut: Booleans
    """(n,) whether a tip edge bounds the cell."""
    offset: Floats
    """(n,) distance of the middle from the contact line, or from the tip edge where that line is off the flanks, in
    cells."""

    def select(self, keep: Booleans) -> Cells:
        """Return the cells for which `keep` holds."""
        return Cells(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))

    def _line(self) -> str:
        tooth_pairs = np.unique(self.tooth)
        cut = np.count_nonzero(self.cut)
        return f": {len(self.tooth)} on {len(tooth_pairs)} tooth pairs, {cut} cut by a tip edge"


def lay_cells(
    pair: FlankPair, rotation: float, teeth: Integers, axial: Floats, half_window: float, count: int
) -> Cells:
    """Lay the cells of all `teeth` around their contact lines at one rotation of gear 1."""
    cells = _lay_cells(pair, rotation, teeth, axial, half_window, count)
    tooth, layer, middle, gear_roll, half, gap, cut, offset = cells
    return Cells(tooth, layer, np.sqrt(2.0 * middle / pair.base_radius_1), gear_roll, half, gap, cut, offset)
