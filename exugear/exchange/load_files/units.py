"""Units as load files write them, and what they are worth in SI."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Unit:
    """A unit of a load file."""

    quantity: str
    """What it measures: torque, force, speed, time, angle, velocity, or another."""
    factor: float
    """Its worth in SI."""


_RPM = math.pi / 30.0
_TURN = 2.0 * math.pi
UNITS: dict[str, Unit] = {
    "s": Unit("time", 1.0),
    "sec": Unit("time", 1.0),
    "ms": Unit("time", 1e-3),
    "min": Unit("time", 60.0),
    "h": Unit("time", 3600.0),
    "hr": Unit("time", 3600.0),
    "m/s": Unit("velocity", 1.0),
    "m/sec": Unit("velocity", 1.0),
    "km/h": Unit("velocity", 1.0 / 3.6),
    "n": Unit("force", 1.0),
    "kn": Unit("force", 1e3),
    "mn": Unit("force", 1e6),
    "nm": Unit("torque", 1.0),
    "n-m": Unit("torque", 1.0),
    "knm": Unit("torque", 1e3),
    "kn-m": Unit("torque", 1e3),
    "mnm": Unit("torque", 1e6),
    "mn-m": Unit("torque", 1e6),
    "rpm": Unit("speed", _RPM),
    "1/min": Unit("speed", _RPM),
    "rad/s": Unit("speed", 1.0),
    "rad/sec": Unit("speed", 1.0),
    "deg/s": Unit("speed", _TURN / 360.0),
    "deg/sec": Unit("speed", _TURN / 360.0),
    "hz": Unit("speed", _TURN),
    "deg": Unit("angle", _TURN / 360.0),
    "rad": Unit("angle", 1.0),
}
"""Units that are understood, as `plain_unit` writes them, without capitals."""
SI_NAMES = {"torque": "N m", "force": "N", "speed": "rad/s", "time": "s", "angle": "rad", "velocity": "m/s"}
USUAL_NAMES = {"torque": "kN-m", "force": "kN", "speed": "rpm", "time": "s", "angle": "deg", "velocity": "m/s"}
"""Units that a message names as examples."""


def plain_unit(text: str) -> str:
    """Write a unit without brackets and blanks, multiplication as a hyphen or nothing.

    Examples
    --------
    >>> plain_unit("(kN·m)"), plain_unit(" [kN m] "), plain_unit("(kN-m)"), plain_unit("INVALID")
    ('kn-m', 'knm', 'kn-m', 'invalid')
    """
    bare = text.strip().strip("()[]").strip().lower()
    return bare.replace("·", "-").replace("*", "-").replace(" ", "")


def unit_of(text: str) -> Unit | None:
    """Look up a unit; None for one that is not understood, millinewtons among them: they are not meganewtons.

    Examples
    --------
    >>> unit_of("(kN·m)"), unit_of("furlong"), unit_of("mNm")
    (Unit(quantity='torque', factor=1000.0), None, None)
    """
    if text.strip(" ()[]").startswith("mN"):
        return None
    return UNITS.get(plain_unit(text))
