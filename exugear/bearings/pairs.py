"""Two equal rows side by side, in X, O or tandem arrangement, with axial preload."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TypeVar

from exugear.bearings.rows import BallRow, BearingError, RollingRow

Row = TypeVar("Row", bound=RollingRow)


def moved(row: Row, contact_angle: float, axial_position: float) -> Row:
    """Give a row another contact angle (rad) and another place (m)."""
    return replace(row, contact_angle=contact_angle, axial_position=axial_position)


def pair_rows(row: Row, arrangement: str, row_distance: float, axial_preload: float = 0.0) -> tuple[Row, Row]:
    """Two rows like the given one.

    Parameters
    ----------
    row : RollingRow
        One of them; in tandem the sign of its contact angle counts.
    arrangement : {"X", "O", "tandem"}
        X (face to face): pressure lines meet the axis towards the middle of the pair. O (back to back): away
        from it, stiff against tilting. Tandem: both rows take the same direction; also right for cylindrical
        rollers, where the three are the same.
    row_distance : float
        Distance of the middles of the rows, m.
    axial_preload : float
        Approach of the two rows along the axis against line-to-line contact, m; negative: axial clearance.

    Returns
    -------
    (RollingRow, RollingRow)
        The row at -z, then the row at +z.

    Raises
    ------
    exugear.bearings.rows.BearingError
        The arrangement or the distance does not exist, or the rows cannot be preloaded along the axis.
    """
    if arrangement not in ("X", "O", "tandem"):
        raise BearingError(f"bearing pair: arrangement = {arrangement!r} is not 'X', 'O' or 'tandem'")
    if row_distance < 0.0:
        raise BearingError(f"bearing pair: row_distance = {row_distance} m must not be negative")
    if axial_preload != 0.0 and row.contact_angle == 0.0:
        raise BearingError("bearing pair: axial_preload needs rows with a contact angle")
    angle = abs(row.contact_angle)
    tandem = (row.contact_angle, row.contact_angle)
    lower, upper = {"X": (-angle, angle), "O": (angle, -angle), "tandem": tandem}[arrangement]
    half = 0.5 * row_distance
    # Both rows share an axial approach by halves.
    return (
        _approached(moved(row, lower, -half), 0.5 * axial_preload),
        _approached(moved(row, upper, half), 0.5 * axial_preload),
    )


def _approached(row: Row, approach: float) -> Row:
    """Push the rings of a row together along the axis (m), as another clearance, and with balls another angle."""
    if approach == 0.0:
        return row
    angle = abs(row.contact_angle)
    if not isinstance(row, BallRow):
        return replace(row, radial_clearance=row.radial_clearance - 2.0 * approach * math.tan(angle))
    # The centres of the grooves are then at another angle to each other; the rest is radial.
    sine = math.sin(angle) + approach / row.groove_distance
    if not 0.0 <= sine < 1.0:
        raise BearingError(
            f"bearing pair: axial_preload = {2e6 * approach:g} um moves the grooves of balls of "
            f"{1e3 * row.element_diameter:g} mm past each other; it must be smaller"
        )
    turned = math.asin(sine)
    clearance = row.radial_clearance + 2.0 * row.groove_distance * (math.cos(turned) - math.cos(angle))
    return replace(row, contact_angle=math.copysign(turned, row.contact_angle), radial_clearance=clearance)
