"""Octets in compiled code do what arrays do without compiling."""

from __future__ import annotations

import numpy as np
import pytest

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import all_eight, eight, eight_at, put, sum_of, sums_of


def mixed(a: Floats, b: Floats, factor: float, out: Floats) -> float:
    """All operators, numbers on either side, rows that begin anywhere."""
    values = eight(a, 1) + eight(b, 3) * factor - all_eight(factor) * eight(a, 5)
    values = values * (2.0 - values) + 0.5
    put(out, 2, values)
    return sum_of(values)


compiled_mixed = kernel(mixed)


def test_compiled_octets_are_arrays_to_round_off() -> None:
    a, b = np.random.default_rng(3).normal(size=(2, 16))
    found, expected = np.zeros((2, 12))
    one, other = compiled_mixed(a, b, 0.7, found), mixed(a, b, 0.7, expected)
    # Fused products and another order of the sum: a few roundings of numbers of the size of ten.
    assert one == pytest.approx(other, abs=1e-13)
    assert found == pytest.approx(expected, abs=1e-14)
    assert not found[:2].any()
    assert not found[10:].any()


def gathered(a: Floats, places: Integers, out: Floats) -> None:
    """Entries from anywhere, and sums of eight octets at once."""
    rows = eight_at(a, places, 1), eight(a, 0), eight(a, 3) * 0.5
    put(out, 0, rows[0])
    put(out, 8, sums_of(rows[0], rows[1], rows[2], rows[0] + rows[1], rows[1], rows[2], rows[0], rows[2] * 2.0))


compiled_gathered = kernel(gathered)


def test_gathered_octets_and_their_sums_are_those_of_arrays() -> None:
    random = np.random.default_rng(5)
    a, places = random.normal(size=16), random.integers(0, 16, size=12)
    found, expected = np.zeros((2, 16))
    compiled_gathered(a, places, found)
    gathered(a, places, expected)
    assert (found[:8] == a[places[1:9]]).all()
    assert found == pytest.approx(expected, abs=1e-13)  # sums of eight numbers of the size of one, in another order
