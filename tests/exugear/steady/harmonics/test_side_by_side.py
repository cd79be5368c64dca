"""Lines solved side by side, and kicks passed together, against the same one after the other."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from exugear.steady.harmonics.branches import TOGETHER, exponents
from exugear.steady.harmonics.linear_solvers import batches_of, elimination, solve_side_by_side


def chain_of_bodies(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness, damping and mass (30, 30) of six bodies of five coordinates, each tied to the next at two of them."""
    stiffness, damping, mass = np.zeros((3, 30, 30))
    for begin in range(0, 30, 5):
        own = slice(begin, begin + 5)
        root, weight = random.normal(size=(2, 5, 5))
        stiffness[own, own], mass[own, own] = 1e4 * root @ root.T, weight @ weight.T + np.eye(5)
        turning = random.normal(size=(5, 5))
        damping[own, own] = 1e-4 * stiffness[own, own] + turning - turning.T  # gyroscopic
        if begin:
            tied = slice(begin - 2, begin + 2)
            stiffness[tied, tied] += 1e3 * np.ones((4, 4))
    return stiffness, damping, mass


@pytest.mark.parametrize("lines", [1, 8, 13])
def test_lines_side_by_side_are_those_of_dense_solutions(lines: int) -> None:
    random = np.random.default_rng(lines)
    stiffness, damping, mass = chain_of_bodies(random)
    plan = elimination((stiffness != 0.0) | (damping != 0.0) | (mass != 0.0))
    assert len(plan.row) < 0.4 * stiffness.size  # most entries are never touched
    frequencies, loads = np.linspace(3.0, 300.0, lines), random.normal(size=(30, 4))
    found = np.empty((lines, 30, 4), dtype=complex)
    own = 1e6 * random.normal(size=(2, lines, 30)).view(complex).reshape(lines, 30)
    answers = own.copy()
    every = batches_of(np.ones((lines, 4), dtype=bool), np.ones(lines, dtype=bool))
    solve_side_by_side(plan, (stiffness, damping, mass), frequencies, loads, answers, every, found)
    for w, load, *both in zip(frequencies, own, answers, found, strict=True):
        matrix = stiffness + 1j * w * damping - w**2 * mass
        for given, answer in zip((load, loads), both, strict=True):
            expected = np.linalg.solve(matrix, given)
            assert np.abs(answer - expected).max() < 1e-9 * np.abs(expected).max()


def test_loads_that_do_not_act_on_a_line_are_left_out() -> None:
    """Each eight lines have the loads of any of them; the others stay zero."""
    random = np.random.default_rng(4)
    stiffness, damping, mass = chain_of_bodies(random)
    plan = elimination((stiffness != 0.0) | (damping != 0.0) | (mass != 0.0))
    frequencies, loads = np.linspace(3.0, 300.0, 40), random.normal(size=(30, 3))
    acting = np.arange(40)[:, None] % 4 == [0, 1, 2]
    own, found = np.zeros((40, 30), dtype=complex), np.zeros((40, 30, 3), dtype=complex)
    own[7, 3] = 2.0 - 1.0j
    batches = batches_of(acting, own.any(axis=1))
    solve_side_by_side(plan, (stiffness, damping, mass), frequencies, loads, own, batches, found)
    for line, w in enumerate(frequencies):
        matrix = stiffness + 1j * w * damping - w**2 * mass
        expected = np.linalg.solve(matrix, loads)
        assert np.abs((found[line] - expected)[:, acting[line]]).max(initial=0.0) < 1e-9 * np.abs(expected).max()
    assert not found[3::4].any(axis=(1, 2)).all()
    load = (2.0 - 1.0j) * np.eye(30)[3]
    w = frequencies[7]
    assert own[7] == pytest.approx(np.linalg.solve(stiffness + 1j * w * damping - w**2 * mass, load), rel=1e-9)
    assert not np.delete(own, 7, axis=0).any()


def test_a_line_whose_diagonal_vanishes_is_solved_with_exchanges() -> None:
    """Two masses at the frequency of each alone: their diagonals are zero, what ties them is not."""
    mass, stiffness, damping = np.eye(2), np.array([[4.0, 1.0], [1.0, 4.0]]), np.zeros((2, 2))
    loads = np.array([[1.0], [0.0]])
    plan = elimination(np.ones((2, 2), dtype=bool))
    found, none = np.empty((2, 2, 1), dtype=complex), np.zeros((2, 2), dtype=complex)
    both = batches_of(np.ones((2, 1), dtype=bool), np.zeros(2, dtype=bool))
    with np.errstate(all="ignore"):
        solve_side_by_side(plan, (stiffness, damping, mass), np.array([2.0, 1.0]), loads, none, both, found)
    assert found[0] == pytest.approx(np.array([[0.0], [1.0]]), abs=1e-14)
    assert found[1] == pytest.approx(np.array([[3.0], [-1.0]]) / 8.0, abs=1e-14)


@pytest.mark.parametrize("kicks", [1, TOGETHER, 2 * TOGETHER + 5])
def test_kicks_passed_together_are_those_passed_one_after_the_other(kicks: int) -> None:
    random = np.random.default_rng(kicks)
    constant = random.normal(size=(12, 12)) - 3.0 * np.eye(12)
    pushes, reads = random.normal(size=(12, 2)), random.normal(size=(5, 12))
    varying, period = random.normal(size=(kicks, 2, 5)), 0.7
    advance, total = scipy.linalg.expm(period / kicks * constant), np.eye(12)
    for own in varying:
        total = advance @ (total - pushes @ (period / kicks * own @ (reads @ total)))
    expected = np.sort(np.abs(np.linalg.eigvals(total)))
    found = np.exp(exponents(constant, pushes, reads, varying, period)[0] * period)
    # Eigenvalues of a matrix that is not symmetric: round-off times their condition.
    assert np.sort(np.abs(found)) == pytest.approx(expected, rel=1e-8)
