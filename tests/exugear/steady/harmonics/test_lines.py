"""Line sets, products on them and the equations that they lead to, against functions of time and closed forms."""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest
import scipy.integrate

from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError, solve_lines
from exugear.steady.harmonics.lines import Group, HarmonicCoupling, Modulator, beside, joined, line_set, rank1_lattice

BASES = (1.0, 0.5 * (1.0 + 5.0**0.5))


def product_of(lines, base, coefficients, signal):
    """Lines of the product of a signal with a function of one base's angle, by its coefficients c_0 .. c_h."""
    both = np.concatenate([np.conj(coefficients[:0:-1]), coefficients])
    harmonics = np.zeros((len(both), lines.index.shape[1]), dtype=np.int64)
    harmonics[:, base] = np.arange(len(both)) - len(coefficients) + 1
    coupling = HarmonicCoupling(lines, (Group(0, 1, harmonics),))
    return coupling.of([both[:, None, None]], signal[:, None])[:, 0]


def random_lines(lines, inside, seed=0):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=len(lines.orders)) + 1j * rng.normal(size=len(lines.orders))
    values[np.abs(lines.index).sum(axis=1) > inside] = 0.0
    values[0] = values[0].real
    return values


def test_one_line_of_each_pair_stands_in_a_set_and_none_is_negative():
    lines = line_set([99.0, 468.57, 1792.8], 10, 3)
    rows = {tuple(row) for row in lines.index.tolist()}
    assert len(rows) == len(lines.index) == 53
    assert not any(tuple(-n for n in row) in rows for row in rows if any(row))
    assert lines.orders[0] == 0.0 and np.all(lines.orders[1:] > 0.0)


def test_a_line_is_found_directly_or_as_its_conjugate():
    lines = line_set(BASES, 3, 2)
    place, mirrored = lines.find(np.array([[0, 2], [0, -2], [7, 0]]))
    assert place[0] == place[1] and place[2] == -1
    assert mirrored.tolist() == [False, True, False]


def test_the_product_of_lines_is_the_product_of_the_functions():
    """Lines of the factor reach two, the function's harmonics two: a set of four holds the whole product."""
    lines = line_set(BASES, 4, 4)
    signal, function = random_lines(lines, 2), np.array([2.0, 0.3 + 0.1j, 0.2j])
    product = product_of(lines, 1, function, signal)
    angles = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, (20, 2))
    values = 2.0 + 2.0 * np.real(function[1] * np.exp(1j * angles[:, 1]) + function[2] * np.exp(2j * angles[:, 1]))
    expected = values * lines.values(signal, angles)
    np.testing.assert_allclose(lines.values(product, angles), expected, rtol=0.0, atol=1e-12)


def test_signals_of_a_group_are_mixed_as_their_functions_say_at_every_angle():
    """Nine signals that functions of both angles mix, which fill more than an octet, and one by itself beside them."""
    lines, rng = line_set(BASES, 4, 4), np.random.default_rng(5)
    signals = np.stack([random_lines(lines, 2, seed) for seed in range(10)], axis=1)
    ways = np.array([[0, 0], [1, -1], [-1, 1]])
    mixing = rng.normal(size=(2, 9, 9)) + 1j * rng.normal(size=(2, 9, 9))
    functions = [np.array([mixing[0].real, mixing[1], mixing[1].conj()]), np.array([[[2.0 + 0.0j]]])]
    groups = Group(0, 9, ways), Group(9, 1, ways[:1])
    angles = rng.uniform(0.0, 2.0 * np.pi, (20, 2))
    whole = mixing[0].real + 2.0 * np.real(mixing[1] * np.exp(1j * (angles[:, 0] - angles[:, 1]))[:, None, None])
    values = lines.values(signals, angles)
    found = lines.values(HarmonicCoupling(lines, groups).of(functions, signals), angles)
    np.testing.assert_allclose(found[:, :9], (whole @ values[:, :9, None])[..., 0], rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(found[:, 9], 2.0 * values[:, 9], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("base", [0, 1])
def test_a_function_of_one_base_on_the_lattice_is_its_series_at_the_angles(base):
    lines = line_set(BASES, 3, 2)
    found = rank1_lattice(lines, line_set(BASES, 6, 4))
    harmonics = np.array([[2.0, 0.3 + 0.1j, 0.2j], [0.0, 1.0j, -0.5]])
    turns = np.exp(1j * found.angles[:, base])
    series = [own[0].real + 2.0 * np.real(own[1] * turns + own[2] * turns**2) for own in harmonics]
    np.testing.assert_allclose(found.sample_along_base(base, harmonics), series, rtol=0.0, atol=1e-12)


def balance(damping, frequency, lines, functions, force):
    """Lines of x'' + 2 z x' + k(t) x = F with k = 1 + a function of each base's angle."""
    w = frequency * lines.orders
    answer = 1.0 / (1.0 - w**2 + 2j * damping * w)
    factors = [(base, np.asarray(own)) for base, own in enumerate(functions)]

    def apply(x):
        return x + answer * sum(product_of(lines, base, own, x) for base, own in factors)

    right = np.zeros(len(w), dtype=complex)
    right[0] = force
    return solve_lines(apply, right, 1e-12)[0]


def test_two_incommensurate_causes_give_what_integration_in_time_gives():
    """Beside the parametric resonance at 2; the start on the lines stays on them, to the integrator's 1e-10."""
    lines = line_set(BASES, 14, 9)
    damping, frequency, functions = 0.03, 0.9, ([0.0, 0.06], [0.0, 0.04 + 0.02j])
    x = balance(damping, frequency, lines, functions, 1.0)

    def stiffness(t):
        turned = frequency * t * np.array(BASES)
        return 1.0 + sum(2.0 * np.real(own[1] * np.exp(1j * a)) for own, a in zip(functions, turned, strict=True))

    start = [lines.values(x, np.zeros((1, 2)))[0], lines.values(1j * frequency * lines.orders * x, np.zeros((1, 2)))[0]]
    times = np.linspace(0.0, 200.0, 101)
    run = scipy.integrate.solve_ivp(
        lambda t, y: [y[1], 1.0 - 2.0 * damping * y[1] - stiffness(t) * y[0]],
        (0.0, 200.0),
        start,
        method="DOP853",
        rtol=1e-11,
        atol=1e-12,
        t_eval=times,
    )
    expected = lines.values(x, np.outer(times, frequency * np.array(BASES)))
    # Lines beyond the set are of the ninth order in the variation.
    assert np.abs(run.y[0] - expected).max() < 1e-6 * np.ptp(expected)


def test_the_solver_agrees_with_a_dense_one():
    rng = np.random.default_rng(3)
    direct, mirrored = rng.normal(size=(2, 12, 12)) + 1j * rng.normal(size=(2, 12, 12))
    right = rng.normal(size=12) + 1j * rng.normal(size=12)
    found, products = solve_lines(lambda y: 8.0 * y + direct @ y + mirrored @ y.conj(), right, 1e-12)
    a, b = 8.0 * np.eye(12) + direct, mirrored
    dense = np.block([[np.real(a + b), -np.imag(a - b)], [np.imag(a + b), np.real(a - b)]])
    expected = np.linalg.solve(dense, np.concatenate([right.real, right.imag]))
    np.testing.assert_allclose(found, expected[:12] + 1j * expected[12:], rtol=0.0, atol=1e-10)
    assert 0 < products <= 24


def test_equations_without_solution_are_told():
    with pytest.raises(HarmonicBalanceError, match="not converged, the residual remains at"):
        solve_lines(lambda y: np.array([y[0], 0.0 * y[1]]), np.array([1.0, 1.0j]), 1e-10)


def test_what_passes_puts_lines_beside_every_line_and_none_twice():
    """Three things that turn: the product of a line with the third harmonic of their turn is in the set."""
    slow = [Modulator(1.0, (0,), 3, 0), Modulator(4.3, (1,), 5, 0)]
    lines = line_set([99.0, 468.57], 4, 3)
    found = beside(lines, slow, 2)
    rows = {tuple(row) for row in found.index.tolist()}
    assert len(rows) == len(found.index) == len(lines.index) + 8 * (len(lines.index) - 1) + 4
    assert not any(tuple(-n for n in row) in rows for row in rows if any(row))
    assert found.orders[0] == 0.0 and np.all(np.diff(found.orders) >= 0.0)
    for turns in ((3, 0), (-6, 0), (0, 5), (0, -10)):
        places, _ = found.find(np.hstack([lines.index, np.tile(turns, (len(lines.index), 1))]))
        assert (places >= 0).all()
    both = joined(beside(lines, slow, 1), beside(lines, slow, 2))
    np.testing.assert_array_equal(np.sort(both.orders), np.sort(found.orders))


@pytest.mark.parametrize("bases", [[1.0, 2.0], [4.0, 3.0], [21.0, 12.0], [20.0, 15.0, 47.3]])
def test_bases_in_small_ratios_have_each_frequency_once(bases):
    """And all that independent bases have: their frequencies, counted as rational numbers."""
    lines = line_set(bases, 6, 4)
    exact = {Fraction(str(base)): n for n, base in enumerate(bases)}
    wanted = {
        abs(sum((m * base for m, base in zip(row, exact, strict=True)), Fraction(0)))
        for row in itertools.product(range(-6, 7), repeat=len(bases))
        if sum(map(abs, row)) <= 4 or np.count_nonzero(row) <= 1
    }
    np.testing.assert_allclose(lines.orders, sorted(map(float, wanted)), rtol=1e-12, atol=1e-12)


def test_a_product_of_bases_that_share_lines_is_that_in_time():
    """One period of both, sampled: every frequency is a multiple of their greatest common divisor."""
    lines = line_set([4.0, 3.0], 8, 6)
    signal = np.where(lines.orders <= 12.0, 1.0 / (1.0 + lines.orders) + 0.3j * (lines.orders > 0.0), 0.0)
    angle = 2.0 * np.pi * np.arange(512) / 512
    values = lines.values(signal, np.outer(angle, [4.0, 3.0]))
    factor = 1.0 + 0.4 * np.cos(4.0 * angle)
    found = product_of(lines, 0, np.array([1.0, 0.2, 0.0], dtype=complex), signal)
    known = np.fft.rfft(values * factor)[np.rint(lines.orders).astype(int)] / 512
    inside = lines.orders <= 8.0
    np.testing.assert_allclose(found[inside], known[inside], atol=1e-12)


def test_samples_of_bases_that_share_lines_give_their_lines_back():
    lines = line_set([2.0, 1.0, 17.4], 5, 3)
    samples = rank1_lattice(lines, line_set([2.0, 1.0, 17.4], 10, 6))
    signal = np.arange(1.0, len(lines.orders) + 1) + 0j
    np.testing.assert_allclose(samples.coefficients(samples.values(signal)), signal, atol=1e-9)
    np.testing.assert_allclose(lines.values(signal, samples.angles), samples.values(signal), atol=1e-8)
