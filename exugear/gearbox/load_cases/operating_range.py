"""The speeds that a gearbox works at: which resonances count."""

from __future__ import annotations

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import RPM

OF_RATED = (0.5, 1.25)
"""Speeds of a gearbox whose file names none, over the rated one."""


def operating_range(gearbox: Gearbox) -> tuple[float, float] | None:
    """Lowest and highest speed of the overall input in service, rad/s, without sign.

    None where the file names neither a range nor a rated speed: all speeds count then.

    Examples
    --------
    >>> [round(speed / RPM, 3) for speed in operating_range(Gearbox.from_toml("cases/grc750/gearbox.toml"))]
    [11.05, 27.625]
    """
    operation = gearbox.case.operation
    if operation.speed_range_rpm is not None:
        low, high = operation.speed_range_rpm
        return low * RPM, high * RPM
    if operation.rated_speed_rpm is None:
        return None
    return OF_RATED[0] * operation.rated_speed_rpm * RPM, OF_RATED[1] * operation.rated_speed_rpm * RPM
