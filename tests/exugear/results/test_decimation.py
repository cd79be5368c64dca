"""Low pass and decimation: what they keep, what they remove, and the design against SciPy."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.signal

from exugear.transient.filters import Decimator, Filter, low_pass


def test_decimation_keeps_the_band_and_removes_what_would_fold() -> None:
    time = np.arange(8000) / 40e3
    rows = np.column_stack([np.sin(2 * np.pi * 7e3 * time), np.sin(2 * np.pi * 12.8e3 * time)])
    decimator = Decimator(2, 2)
    results = np.vstack([decimator.push(part)[1] for part in np.array_split(rows, 7)])
    first = decimator.half + decimator.half % 2
    expected = rows[first::2, 0][: len(results)]
    assert np.abs(results[:, 0] - expected).max() < 2e-4  # passband ripple of an 80 dB design
    assert np.abs(results[:, 1]).max() < 2e-4  # twice the 6.4 kHz mesh would fold to 7.2 kHz


def test_low_pass_is_the_one_that_scipy_designs() -> None:
    for factor in (2, 3, 5):
        half = 31 * factor // 2
        expected = scipy.signal.firwin(2 * half + 1, 1.0 / factor, window=("kaiser", 8.0))
        assert np.abs(low_pass(factor, half) - expected).max() < 1e-15


@pytest.mark.parametrize("columns", [4, 8, 13, 21])
def test_a_column_takes_of_itself_and_of_the_one_so_many_before_it(columns: int) -> None:
    """Taps of each column its own, not symmetric; columns 2 and 3 take of 0 and 1 as well."""
    random = np.random.default_rng(2)
    own, other = random.normal(size=(2, 7, columns))
    other[:, :2], other[:, 4:] = 0.0, 0.0
    rows = random.normal(size=(50, columns))
    results = Decimator(2, columns, Filter(own, other, 2)).push(rows)[1]
    for n, row in enumerate(results):
        window = rows[2 * n + 1 : 2 * n + 8]  # the first result stands at a row whose number is even
        expected = (own * window).sum(axis=0)
        expected[2:4] += (other[:, 2:4] * window[:, :2]).sum(axis=0)
        assert row == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("columns", [3, 8, 21])
@pytest.mark.parametrize("factor", [1, 2, 3, 4])
def test_a_stream_in_parts_is_the_convolution_of_the_whole(columns: int, factor: int) -> None:
    """Eight columns go at once where there are as many; results do not depend on where the stream is cut."""
    rows = np.random.default_rng(1).normal(1.0, 1.0, (700, columns))
    decimator = Decimator(factor, columns)
    results = np.vstack([decimator.push(part)[1] for part in np.split(rows, [1, 150, 151, 490])])
    assert len(results) == decimator.count_of(len(rows))
    filtered = scipy.signal.convolve(rows, low_pass(factor, decimator.half)[:, None], mode="valid")
    expected = filtered[-decimator.half % factor :: factor]
    assert np.abs(results - expected).max() < 1e-13  # a hundred terms of round-off
    whole = Decimator(factor, columns).push(rows)[1]
    assert np.array_equal(results, whole)
