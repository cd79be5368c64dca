"""Line figures as data: curves with axes and marks, which one script draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from exugear.report.web import pieces
from exugear.report.web.arrays import ArrayStore


@dataclass(frozen=True)
class Curve:
    """A curve of a line figure."""

    label: str
    x: ArrayLike
    y: ArrayLike
    """(n,)"""
    style: str = "line"
    """{"line", "dashed", "thin", "points"}"""
    right: bool = False
    """Whether the axis on the right is its."""


@dataclass(frozen=True)
class Axis:
    """An axis of a line figure."""

    label: str
    """With its unit."""
    logarithmic: bool = False


def chart(
    name: str,
    title: str,
    hint: str,
    words: str,
    curves: Sequence[Curve],
    axes: Sequence[Axis],
    arrays: ArrayStore,
    marks: Sequence[tuple[float, str]] = (),
) -> tuple[str, dict[str, Any]]:
    """Make a line figure.

    Parameters
    ----------
    name : identity in the page
    title, hint, words : what it shows; what can be done; what it says in words
    axes : below, on the left, and on the right if curves are there
    arrays : takes the curves
    marks : upright lines at values of x, with words

    Returns
    -------
    html
    data : under the key ``charts`` of the page's data, by name
    """
    spec = {
        "title": title,
        "axes": [{"label": axis.label, "logarithmic": axis.logarithmic} for axis in axes],
        "curves": [
            {
                "label": curve.label,
                "style": curve.style,
                "right": curve.right,
                "x": arrays.add(np.asarray(curve.x, dtype="f4")),
                "y": arrays.add(np.asarray(curve.y, dtype="f4")),
            }
            for curve in curves
        ],
        "marks": [{"x": value, "label": label} for value, label in marks],
    }
    return pieces.figure(name, title, hint, words, "chart"), {name: spec}
