"""Causes of a resonance as text: shares of an amplitude or a power, and derivatives by parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

LEAST_SHARE, MOST_SHOWN = 0.05, 3
"""Smallest share that is listed, and how many causes are."""


def shares(parts: Iterable[tuple[str, float]]) -> str:
    """Return shares as text, in the order given.

    Examples
    --------
    >>> shares([("spur", 0.9), ("unbalance", 0.07), ("helical", 0.03)])
    'spur 90 %, unbalance 7 %'
    """
    listed = [f"{name} {100.0 * share:.0f} %" for name, share in parts if abs(share) >= LEAST_SHARE]
    return ", ".join(listed[:MOST_SHOWN])


def strongest(slopes: Mapping[str, float]) -> str:
    """Return the largest relative derivatives as text.

    Examples
    --------
    >>> strongest({"front": -0.02, "rear": 0.314})
    'rear +0.31, front -0.02'
    """
    largest = sorted(slopes.items(), key=lambda item: -abs(item[1]))[:MOST_SHOWN]
    return ", ".join(f"{name} {slope:+.2f}" for name, slope in largest)
