"""Coordinates of reduced bodies."""

from __future__ import annotations

from exugear.system.bodies.reduction import ReducedBody


def first_coordinate(body: ReducedBody, seat: str) -> int:
    """Find the first of a seat's six coordinates."""
    return 6 * [own.name for own in body.seats].index(seat)
