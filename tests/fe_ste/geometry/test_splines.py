"""Cubic splines: SciPy's own, and a cubic is itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline, make_interp_spline

from fe_ste.geometry.profile import cubic_coefficients, cubic_knots, cubic_matrix, cubic_values


@pytest.mark.parametrize("count", [4, 5, 9, 21])
def test_splines_are_those_of_scipy(count: int) -> None:
    nodes = np.sort(np.random.default_rng(count).uniform(2.0, 3.0, count))
    places = np.concatenate([np.linspace(nodes[0], nodes[-1], 50), nodes])
    expected = make_interp_spline(nodes, np.eye(count), k=3)
    knots = cubic_knots(nodes)
    assert np.array_equal(knots, expected.t)
    assert np.abs(cubic_matrix(places, knots) - BSpline.design_matrix(places, knots, 3).toarray()).max() < 1e-13
    # The nodes may be near one another, which the coefficients grow with.
    found = cubic_matrix(places, knots) @ cubic_coefficients(nodes, knots)
    assert np.abs(found - expected(places)).max() < 1e-10 * np.abs(expected(places)).max()


def test_four_values_at_a_place_add_up_to_one_and_a_cubic_is_met() -> None:
    nodes = np.array([0.0, 1.0, 2.5, 3.0, 4.0, 6.0])
    knots, places = cubic_knots(nodes), np.linspace(0.0, 6.0, 31)
    first, values = cubic_values(places, knots)
    assert first.min() == 0
    assert first.max() == len(nodes) - 4
    assert np.abs(values.sum(axis=1) - 1.0).max() < 1e-14
    met = cubic_matrix(places, knots) @ cubic_coefficients(nodes, knots) @ (nodes**3 - nodes)
    assert np.abs(met - (places**3 - places)).max() < 1e-12 * 210.0
