"""Mortar integrals between surfaces that do not match."""

from __future__ import annotations

import numpy as np
import pytest

from fe_ste.reference.mortar import Surface, facing_pairs, weighted_gap


def sheet(count_x: int, count_y: int, height, upward: bool, turn: float = 0.0, first_node: int = 0):
    """Nodes and facets of a sheet over the unit square, turned about its middle; `height` is a function of x and y."""
    x, y = np.meshgrid(np.linspace(0, 1, count_x + 1), np.linspace(0, 1, count_y + 1), indexing="ij")
    x, y = x.ravel() - 0.5, y.ravel() - 0.5
    x, y = np.cos(turn) * x - np.sin(turn) * y + 0.5, np.sin(turn) * x + np.cos(turn) * y + 0.5
    ids = np.arange(x.size).reshape(count_x + 1, count_y + 1) + first_node
    facets = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1).reshape(-1, 4)
    return np.stack([x, y, height(x, y)], axis=-1), facets if upward else facets[:, ::-1]


def sheets(lower_height, upper_height, turn: float = 0.0):
    lower, lower_facets = sheet(4, 3, lower_height, True)
    upper, upper_facets = sheet(5, 5, upper_height, False, turn, len(lower))
    points = np.concatenate([lower, upper])
    first, second = Surface(lower_facets), Surface(upper_facets)
    return points, first, second, weighted_gap(points, first, second, facing_pairs(points, first, second, 0.5))


def test_parallel_sheets_have_their_distance_as_mean_gap_everywhere():
    _, _, _, result = sheets(lambda x, y: 0 * x, lambda x, y: 0.1 + 0 * x)
    assert np.allclose(result.mean, 0.1, rtol=1e-13)
    assert result.weight.sum() == pytest.approx(1.0, rel=1e-13)


def test_a_slanted_sheet_has_the_integral_of_its_distance():
    points, first, _, result = sheets(lambda x, y: 0 * x, lambda x, y: 0.1 + 0.2 * x - 0.1 * y)
    assert result.gap.sum() == pytest.approx(0.15, rel=1e-12)
    # By node: the distance is linear, its integral with a linear shape function that of the interpolated values.
    inner = np.all((points[first.nodes, :2] > 0.01) & (points[first.nodes, :2] < 0.99), axis=1)
    x, y, _ = points[first.nodes[inner]].T
    assert np.allclose(result.mean[inner], 0.1 + 0.2 * x - 0.1 * y, rtol=1e-12)


def test_a_turned_sheet_covers_the_common_area():
    # Unit squares turned by 45 degrees about their middle overlap in a regular octagon of area 2 (sqrt(2) - 1).
    _, _, _, result = sheets(lambda x, y: 0 * x, lambda x, y: 0.1 + 0 * x, np.pi / 4)
    assert result.weight.sum() == pytest.approx(2 * (np.sqrt(2) - 1), rel=1e-12)


def test_contact_forces_carry_no_net_force_and_no_net_moment_where_the_gap_is_closed():
    def bowl(x, y):
        return 0.05 * ((x - 0.5) ** 2 + (y - 0.5) ** 2)

    points, first, second, result = sheets(bowl, bowl, 0.3)
    pressure = np.random.default_rng(0).uniform(0.0, 1.0, len(first.nodes))
    force = (result.gradient.T @ pressure).reshape(-1, 3)
    assert np.abs(force.sum(axis=0)).max() < 1e-14
    # The moment of a pair of forces is the gap that chords leave times the tilt of the normal.
    size = np.abs(np.cross(points, force)).sum()
    assert np.abs(np.cross(points, force).sum(axis=0)).max() < 1e-5 * size


def test_gradient_is_the_derivative_of_the_gap_along_the_normal():
    points, first, second, result = sheets(lambda x, y: 0 * x, lambda x, y: 0.1 + 0 * x, 0.3)
    lift = np.zeros_like(points)
    lift[second.nodes, 2] = np.random.default_rng(0).uniform(-1e-3, 1e-3, len(second.nodes))
    lifted = weighted_gap(points + lift, first, second, facing_pairs(points, first, second, 0.5))
    # The lower sheet is plane, so its normals stay and the gap is linear in the lifts.
    assert np.allclose(lifted.gap - result.gap, result.gradient @ lift.ravel(), rtol=0, atol=1e-15)


def test_sheets_that_face_away_or_are_far_apart_make_no_pairs():
    lower, lower_facets = sheet(2, 2, lambda x, y: 0 * x, True)
    upper, upper_facets = sheet(2, 2, lambda x, y: 0.1 + 0 * x, True, first_node=len(lower))
    points = np.concatenate([lower, upper])
    assert not len(facing_pairs(points, Surface(lower_facets), Surface(upper_facets), 0.5))
    assert not len(facing_pairs(points, Surface(lower_facets), Surface(upper_facets[:, ::-1]), 0.05))
    assert len(facing_pairs(points, Surface(lower_facets), Surface(upper_facets[:, ::-1]), 0.15))


def test_nodes_that_face_nothing_have_an_infinite_gap():
    lower, lower_facets = sheet(4, 4, lambda x, y: 0 * x, True)
    upper, upper_facets = sheet(3, 3, lambda x, y: 0.1 + 0 * x, False, first_node=len(lower))
    upper[:, 0] += 0.6
    points, first = np.concatenate([lower, upper]), Surface(lower_facets)
    second = Surface(upper_facets)
    result = weighted_gap(points, first, second, facing_pairs(points, first, second, 0.5))
    assert np.isinf(result.mean[lower[:, 0] < 0.3]).all()
    assert np.allclose(result.mean[lower[:, 0] > 0.6], 0.1)
