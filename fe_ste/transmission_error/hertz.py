"""Pressure at the pitch point by Hertz: what the greatest pressure of a table is compared with."""

from __future__ import annotations

import math

from fe_ste.geometry.gears import GearPair
from fe_ste.transmission_error.search import hertz_half_width, least_contact_length, normal_load


def pitch_point_pressure(pair: GearPair, torque: float) -> float:
    """Greatest pressure at the pitch point, the load spread evenly over the least length of the contact lines, Pa.

    Parameters
    ----------
    torque : on gear 1, N m, positive

    Notes
    -----
    p = 2 w / (pi b) with the line load w and the half width b of two cylinders (Johnson, Contact Mechanics, eqs. 4.43
    and 4.45). ISO 6336-2 spreads the load likewise, by its contact ratio factor. Tip edges and uneven loads come on
    top.

    Examples
    --------
    A tenth of the load, a third of the pressure:

    >>> from fe_ste.geometry.gears import Gear
    >>> size = {"normal_module": 0.003, "face_width": 0.03, "held_diameter": 0.03}
    >>> pinion, gear = Gear(name="one", teeth=24, **size), Gear(name="other", teeth=36, **size)
    >>> pair = GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=0.09)
    >>> round(pitch_point_pressure(pair, 100.0) / pitch_point_pressure(pair, 10.0), 6)
    3.162278
    """
    line_load = normal_load(pair, torque) / least_contact_length(pair)
    return 2.0 * line_load / (math.pi * hertz_half_width(pair, line_load))
