"""Bundles: kernels read and write what the named tuple holds."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
import pytest

from fe_ste.tools.bundles import bundle, cached_bundle


class Inner(NamedTuple):
    numbers: np.ndarray
    nothing: None


class Outer(NamedTuple):
    share: float
    count: int
    inner: Inner
    table: np.ndarray


@numba.njit
def sum_and_mark(given) -> float:
    given.table[1, 2] = 7.0
    return given.share * given.inner.numbers[1] + given.count * given.table[0, 1]


def test_kernels_read_and_write_the_arrays_of_the_tuple() -> None:
    given = Outer(0.5, 3, Inner(np.array([1.0, 2.0]), None), np.arange(6.0).reshape(2, 3))
    assert sum_and_mark(bundle(given)) == 0.5 * 2.0 + 3 * 1.0
    assert given.table[1, 2] == 7.0


def test_the_same_tuple_keeps_its_bundle_and_another_has_its_own() -> None:
    one, two = (Inner(np.zeros(2), None) for _ in range(2))
    assert cached_bundle(one) is cached_bundle(one)
    assert cached_bundle(one) is not cached_bundle(two)


def test_arrays_in_another_order_are_refused() -> None:
    with pytest.raises(ValueError, match="C order"):
        bundle(Inner(np.zeros((3, 2)).T, None))
