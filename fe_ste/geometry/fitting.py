"""Inputs of gears that follow from their mates: profile shifts from centre distances, tips that keep clear."""

from __future__ import annotations

import math

from fe_ste.geometry.gear_relations import UncheckedGear
from fe_ste.geometry.involute import involute
from fe_ste.geometry.pair_relations import UncheckedPair

ROOT_MARGIN = 0.1
"""Roll length that a fitted tip keeps from its mate's form circle, in normal modules: the breadth of the contact under
load reaches beyond the path of contact."""
LEAST_ROOT_MARGIN = 0.03
"""Roll length below which contact under usual loads reaches the form circle, in normal modules."""
LEAST_CLEARANCE = 0.1
"""Tip clearance that a fitted tip keeps at least, in normal modules."""


def shift_sum(one: UncheckedGear, other: UncheckedGear, centre_distance: float) -> float | None:
    """Profile shifts that leave no backlash at a centre distance: x1 + x2, of an internal pair x1 - x2.

    ISO 21771: sum = (z1 + z2) (inv alpha_wt - inv alpha_t) / (2 tan alpha_n), teeth of a ring negative.

    Parameters
    ----------
    one, other : the pair; of an internal one in either order
    centre_distance : m

    Returns
    -------
    in normal modules; None if no line of action touches both base circles at this distance

    Examples
    --------
    >>> gear = UncheckedGear(name="", teeth=25, normal_module=4e-3, face_width=20e-3, held_diameter=50e-3)
    >>> round(shift_sum(gear, gear, 102e-3), 4)
    0.5354
    """
    teeth = sum(-gear.teeth if gear.internal else gear.teeth for gear in (one, other))
    transverse = one.transverse_pressure_angle
    cosine = abs(teeth) * one.transverse_module * math.cos(transverse) / (2.0 * centre_distance)
    if not 0.0 < cosine < 1.0:
        return None
    return teeth * (involute(math.acos(cosine)) - involute(transverse)) / (2.0 * math.tan(one.normal_pressure_angle))


def shift_beside(mate: UncheckedGear, gear: UncheckedGear, centre_distance: float) -> float | None:
    """Profile shift of a gear that leaves no backlash beside its mate; None if there is none."""
    total = shift_sum(gear, mate, centre_distance)
    if total is None:
        return None
    if gear.internal:
        return mate.profile_shift - total
    if mate.internal:
        return total + mate.profile_shift
    return total - mate.profile_shift


def root_margin(pair: UncheckedPair, tip: UncheckedGear) -> float:
    """Roll length, m, by which a gear's tip keeps above the form circle of its mate; infinite above a relieved root."""
    if (pair.pinion if tip is pair.gear else pair.gear).has_relieved_root:
        return math.inf
    if tip is pair.gear:
        return pair.pinion_roll_length(tip.tip_form_roll_length) - pair.pinion.form_roll_length
    return pair.pinion_roll_length(pair.gear.form_roll_length) - tip.tip_form_roll_length


def clear_tip_diameter(pair: UncheckedPair, tip: UncheckedGear, margin: float) -> float:
    """Tip diameter, m, at which a gear keeps above its mate's form circle by a roll length (m); its own if it does.

    A chamfer keeps its height.
    """
    lacking = margin - root_margin(pair, tip)
    if lacking <= 0.0:
        return 2.0 * tip.tip_radius
    roll = max(tip.tip_form_roll_length - tip.outward * lacking, 0.0)
    chamfer = tip.tip_radius - tip.tip_form_radius
    return 2.0 * (math.hypot(tip.base_radius, roll) + chamfer)


def fitted_tip_diameter(pair: UncheckedPair, tip: UncheckedGear) -> float:
    """Tip diameter, m, shortened as far as the mate asks for: the clearance of the rack, and room above the fillet.

    ISO 21771 calls the shortening of the tip that keeps the clearance at profile shifts the tip alteration k m_n.
    """
    mate = pair.pinion if tip is pair.gear else pair.gear
    module = tip.normal_module
    clearance = module * max(mate.dedendum_factor - tip.rack.addendum, LEAST_CLEARANCE)
    inner = tip.internal or mate.internal
    # External pair: r_a + c + r_f = a. A ring's root lies outside its pinion's tip, a pinion's root inside a ring's.
    if not inner:
        bound = pair.centre_distance - mate.root_radius - clearance
    elif tip.internal:
        bound = pair.centre_distance + mate.root_radius + clearance
    else:
        bound = mate.root_radius - pair.centre_distance - clearance
    clear = 0.5 * clear_tip_diameter(pair, tip, ROOT_MARGIN * module)
    pick = max if tip.internal else min
    return 2.0 * pick(tip.tip_radius, bound, clear)
