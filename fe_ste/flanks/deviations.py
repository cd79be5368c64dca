"""Long-period deviations of gears as gaps: pitch of single teeth, runout, position of an axis.

They are too small to change the compliance, and add to the gap of the conjugate flanks: a pitch deviation to that of
one tooth pair, a displaced axis to that of all pairs alike. Gaps here are lengths on the transverse line of action,
as transmission errors are, positive where the loaded flanks of gear 1 and gear 2 stand further apart.

To first order in a gap, the transmission error under constant load grows by the gap times the part that its pair
takes of a little more load (`tangent_load_share` of a table), and under constant rotation the strain energy falls by
the gap times the load the pair carries (`load_share`). The two shares are the same only where sharing does not change
with the load.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.geometry.involute import involute
from fe_ste.tools.arrays import Floats


def pitch_gap(gear: Gear, deviation: Floats) -> Floats:
    """Gap that flanks bring about which lie behind their places by an arc of the reference circle.

    Parameters
    ----------
    deviation
        Arc by which a loaded flank lies inside its own tooth's material, m: the cumulative pitch deviation of
        ISO 1328-1, counted positive towards the tooth.

    Returns
    -------
    m on the transverse line of action

    Notes
    -----
    A turn by deviation / r moves an involute by r_b / r times the arc: cos(alpha_t) of it.

    Examples
    --------
    >>> gear = Gear(name="pinion", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    >>> round(float(pitch_gap(gear, np.array(10e-6))) * 1e6, 4)
    9.3969
    """
    return np.asarray(deviation * (gear.base_radius / gear.reference_radius), dtype=np.float64)


def gaps_of_pairs(pinion: Floats, gear: Floats, cycle: int, pairs: Iterable[int]) -> dict[int, float]:
    """Gap of each tooth pair in one mesh cycle from those of the single teeth.

    Parameters
    ----------
    pinion, gear : (z,)
        Gap of each tooth (see `pitch_gap`), in the order in which the teeth come into mesh; tooth 0 of both gears
        touches at the pitch point at the start of cycle 0.
    cycle : mesh cycles since then
    pairs : numbers of tooth pairs as in a table: counted ahead of the one that touches at the pitch point at pmc 0

    Returns
    -------
    number of the pair -> gap, m

    Notes
    -----
    In cycle n the pair j is made of the teeth that passed the pitch point in cycle n - j.

    Examples
    --------
    >>> gaps_of_pairs(np.array([5e-6, 0.0, 0.0]), np.zeros(7), cycle=4, pairs=(0, 1, 2))
    {0: 0.0, 1: 5e-06, 2: 0.0}
    """
    return {pair: float(pinion[(cycle - pair) % len(pinion)] + gear[(cycle - pair) % len(gear)]) for pair in pairs}


def runout_displacement(eccentricity: float, phase: float, rotation: float) -> tuple[float, float]:
    """Displacement of the axis of a gear's teeth that runs out about its bearings' axis.

    Parameters
    ----------
    eccentricity : distance of the two axes, m: half of the radial runout
    phase : angle of the eccentricity at rotation zero, rad
    rotation : rotation of the gear, rad

    Returns
    -------
    along two fixed directions at right angles, of which the first is angle zero, m

    Examples
    --------
    >>> [round(value, 9) for value in runout_displacement(20e-6, 0.0, math.pi / 2)]
    [0.0, 2e-05]
    """
    angle = phase + rotation
    return eccentricity * math.cos(angle), eccentricity * math.sin(angle)


def displaced_axis(pair: GearPair, along: float, across: float) -> tuple[float, float]:
    """Centre distance and gap of a pair whose gear 2 is displaced while both gears keep their rotations.

    Serves runout (displacements of the gears against each other, gear 2 less gear 1) and planet pins out of place.

    Parameters
    ----------
    along : displacement of the axis of gear 2 away from that of gear 1, m
    across
        Displacement of the axis of gear 2 at right angles, m, positive in the sense in which gear 1, driving, pushes.

    Returns
    -------
    centre_distance : m
    gap : m on the transverse line of action, positive where the loaded flanks part

    Notes
    -----
    As the line of centres turns by psi, both gears have turned back against it: the loaded flanks part by
    (r_b2 +- r_b1) psi. As the working pressure angle becomes alpha', they part by
    (r_b2 + r_b1) [inv(alpha') - inv(alpha)] in an external pair, and come nearer by (r_b2 - r_b1) times that in an
    internal one. First order: cos(alpha) across +- sin(alpha) along. A table's states at other centre distances
    count from the rolling position there, so that this gap comes in addition.

    Examples
    --------
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90.1e-3)
    >>> distance, gap = displaced_axis(pair, 10e-6, 0.0)
    >>> round(1e3 * distance, 6), round(gap / 10e-6 / math.sin(pair.working_pressure_angle), 3)
    (90.11, 1.0)
    """
    distance = math.hypot(pair.centre_distance + along, across)
    turned = math.atan2(across, pair.centre_distance + along)
    bases = pair.centre_distance * math.cos(pair.working_pressure_angle)
    angle = math.acos(bases / distance)
    opening = involute(angle) - involute(pair.working_pressure_angle)
    return distance, bases * (turned - opening if pair.gear.internal else turned + opening)
