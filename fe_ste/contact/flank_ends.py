"""Where contact meets the end of the involute: what is cut off at the form circles, and how much load that was.

Below the form circle a tooth goes on as a fillet, which comes nearer to the mate than the involute would. The rigid
gap knows involutes alone, so contact ends at the form circle, as it does at an edge. What it leaves out is told by the
same state with involutes that go on to the base circles: the share of the load that is beyond. In a gearbox a tip
corner presses on the fillet there, so that the share is what the results are uncertain by.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from fe_ste.contact.cells import Cells
from fe_ste.contact.kinematics import FlankPair
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    from fe_ste.elasticity.flank import FlankCompliance

Flanks: TypeAlias = "tuple[FlankCompliance, FlankCompliance]"
"""Loaded flanks of gear 1 and gear 2."""

#: Part of a flank, in roll, within which contact counts as being at the form circle.
_AT_FORM_CIRCLE = 0.01


def reaches_form_circle(flanks: Flanks, cells: Cells, force: Floats) -> bool:
    """Whether cells that carry load lie at or beyond a form circle, where the involute ends and the fillet begins."""
    touching = force > 0.0
    for flank, roll in _flanks_with_fillets(flanks, cells):
        margin = _above(flank, roll[touching])
        if (margin < _AT_FORM_CIRCLE * np.ptp(flank.roll)).any():
            return True
    return bool((_parts_beyond(flanks, cells)[touching] > 0.0).any())


def share_beyond(flanks: Flanks, cells: Cells, force: Floats) -> float:
    """Share of the load on cells beyond the form circles; of a cell that one of them divides, the part beyond."""
    return float(_parts_beyond(flanks, cells) @ force / force.sum())


def cut_at_form_circles(kinematics: FlankPair, flanks: Flanks) -> FlankPair:
    """Return the kinematics of flanks on which contact ends at both form circles; it does so on gear 1 anyway."""
    gear = flanks[1].gear
    if gear.has_relieved_root:
        return kinematics
    return kinematics._replace(root_radius_2=gear.base_radius * math.hypot(1.0, _form_roll(flanks[1])))


def continued_involutes(kinematics: FlankPair, flanks: Flanks) -> FlankPair:
    """Return the kinematics of involutes that go on beyond their form circles, of gear 1 to its base circle.

    Where a root is relieved the flank ends in an edge, and so does contact.
    """
    if flanks[0].gear.has_relieved_root:
        return kinematics
    return kinematics._replace(form_roll_1=0.0)


def _flanks_with_fillets(flanks: Flanks, cells: Cells) -> list[tuple[FlankCompliance, Floats]]:
    """Flanks that go over into a fillet, with the roll angles of the cells on them."""
    both = zip(flanks, (cells.roll, cells.gear_roll), strict=True)
    return [(flank, roll) for flank, roll in both if not flank.gear.has_relieved_root]


def _form_roll(flank: FlankCompliance) -> float:
    return float(flank.roll[-1] if flank.gear.internal else flank.roll[0])


def _above(flank: FlankCompliance, roll: Floats) -> Floats:
    """Roll angles by which places on a gear are on its flank's side of the form circle."""
    if flank.gear.internal:
        return _form_roll(flank) - roll
    return roll - _form_roll(flank)


def _parts_beyond(flanks: Flanks, cells: Cells) -> Floats:
    """Part of each cell that lies beyond a form circle.

    A cell is as wide on one flank as on the other; arc lengths are r_b roll^2 / 2.
    """
    beyond = np.zeros(len(cells.roll))
    for flank, roll in _flanks_with_fillets(flanks, cells):
        outward = -1.0 if flank.gear.internal else 1.0
        depth = outward * 0.5 * flank.gear.base_radius * (_form_roll(flank) ** 2 - roll**2)
        beyond = np.maximum(beyond, np.clip(0.5 * (1.0 + depth / cells.half_across), 0.0, 1.0))
    return beyond
