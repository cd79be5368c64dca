"""Where bodies carry what is attached to them: names of seats, positions of nodes."""

from __future__ import annotations

import numpy as np

from exugear.gearbox.parts import Body
from fe_ste.tools.arrays import Floats


def seat_key(body: str, item: str) -> str:
    """Name of the seat of a gear or bearing on an elastic body.

    Examples
    --------
    >>> seat_key("lss", "sun")
    'lss.sun'
    """
    return f"{body}.{item}"


def node_position(body: Body) -> Floats:
    """Position of a body's node, its centre of mass, at zero angles, m."""
    return np.array([*body.axis, body.centre_of_mass_z])
