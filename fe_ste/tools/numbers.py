"""Numbers in texts of other programs: Fortran's notation."""

from __future__ import annotations

import re

FORTRAN_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+))(?:[dDqQ]([+-]?\d{1,3})|([+-]\d{1,3}))")
"""A number in Fortran notation, with D for E, or with a signed exponent without a letter."""


def fortran_number(word: str) -> float:
    """Return the number in a word, including Fortran notation.

    Raises
    ------
    ValueError
        The word is not a number.

    Examples
    --------
    >>> fortran_number("1.2345-101"), fortran_number("-4.5D+02"), fortran_number("2.5D3"), fortran_number("7")
    (1.2345e-101, -450.0, 2500.0, 7.0)
    """
    found = FORTRAN_NUMBER.fullmatch(word)
    return float(f"{found[1]}e{found[2] or found[3]}") if found is not None else float(word)
