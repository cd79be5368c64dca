"""Cubic splines through values at nodes, whose third derivative is continuous at the last but one ("not a knot").

The same splines as those of SciPy, whose module takes a quarter of a second to load.
"""

from __future__ import annotations

import numpy as np

from fe_ste.tools.arrays import Floats, Integers

_DEGREE = 3


def cubic_knots(nodes: Floats) -> Floats:
    """Return the knots (n + 4,) of the splines through n ascending nodes, four or more.

    Examples
    --------
    >>> cubic_knots(np.array([0.0, 1.0, 2.0, 3.0, 4.0])).tolist()
    [0.0, 0.0, 0.0, 0.0, 2.0, 4.0, 4.0, 4.0, 4.0]
    """
    ends = _DEGREE + 1
    return np.concatenate([np.full(ends, nodes[0]), nodes[2:-2], np.full(ends, nodes[-1])])


def cubic_values(places: Floats, knots: Floats) -> tuple[Integers, Floats]:
    """Evaluate the B-splines of some knots.

    Parameters
    ----------
    places : (n,) within the knots

    Returns
    -------
    first : (n,) number of the first of the four splines that are not zero at each place
    values : (n, 4) of these four

    References
    ----------
    C. de Boor, A Practical Guide to Splines, 1978, chapter X.
    """
    span = np.clip(np.searchsorted(knots, places, side="right") - 1, _DEGREE, len(knots) - _DEGREE - 2)
    values = np.zeros((_DEGREE + 1, len(places)))
    values[0] = 1.0
    for degree in range(1, _DEGREE + 1):
        carried = np.zeros(len(places))
        for number in range(degree):
            above = knots[span + number + 1]
            below = knots[span + number + 1 - degree]
            part = values[number] / (above - below)
            values[number] = carried + (above - places) * part
            carried = (places - below) * part
        values[degree] = carried
    return span - _DEGREE, np.ascontiguousarray(values.T)


def cubic_matrix(places: Floats, knots: Floats) -> Floats:
    """Return the values (n, splines) of all B-splines of some knots."""
    first, values = cubic_values(places, knots)
    result = np.zeros((len(places), len(knots) - _DEGREE - 1))
    np.put_along_axis(result, first[:, None] + np.arange(_DEGREE + 1), values, axis=1)
    return result


def cubic_coefficients(nodes: Floats, knots: Floats) -> Floats:
    """Return the coefficients (n, n) of the splines that are 1 at one node, that of the column, and 0 at the others."""
    return np.asarray(np.linalg.inv(cubic_matrix(nodes, knots)))
