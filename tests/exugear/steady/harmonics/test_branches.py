"""Branches through folds and their stability, against closed forms and against shooting in time."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate
import scipy.optimize

from exugear.steady.harmonics.branches import Scales, exponents, trace
from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError
from exugear.steady.harmonics.lines import line_set, rank1_lattice

DAMPING, SHARES, BACKLASH, LOAD = 0.03, (0.1, 0.05), 1.0, 2.0
"""Gear pair with backlash: x'' + 2 z x' + k(t) f(x) = F, f = x in contact, zero in the backlash behind it."""


def stiffness(angle):
    return 1.0 + sum(2.0 * share * np.cos((n + 1) * angle) for n, share in enumerate(SHARES))


def contact(x):
    return np.where(x > 0.0, x, np.where(x < -2.0 * BACKLASH, x + 2.0 * BACKLASH, 0.0))


def touching(x):
    return np.where((x > 0.0) | (x < -2.0 * BACKLASH), 1.0, 0.0)


def oscillator(harmonics):
    """Residual x - H(w) (F - k f(x) + x) of the lines."""
    lines = line_set([1.0], harmonics)
    samples = rank1_lattice(lines, line_set([1.0], 4 * harmonics))
    k = stiffness(samples.angles[:, 0])

    def residual(x, frequency):
        w = frequency * lines.orders
        answer = 1.0 / (1.0 - w**2 + 2j * DAMPING * w)
        values = samples.values(x)
        force = samples.coefficients(values - k * contact(values))
        force[0] += LOAD
        slope = 1.0 - k * touching(values)
        return x - answer * force, lambda step: step - answer * samples.coefficients(slope * samples.values(step))

    start = np.zeros(len(lines.orders), dtype=complex)
    start[0] = LOAD
    return residual, start


@pytest.fixture(scope="module")
def branch():
    residual, start = oscillator(30)
    return trace(residual, start, 1.15, 0.4, Scales(1.0, 0.05), step=0.02, longest=0.06)


INTEGRATED = 1e-10
"""Error of a period's end over its size."""


def one_period(state, frequency):
    """State after a period, and how it follows small changes of the first one, by the variational equations.

    Differences of integrated ends would carry the error of integration a million times magnified, and different bits
    on each processor.
    """

    def rate(t, y):
        k, moved = float(stiffness(frequency * t)), y.reshape(3, 2)
        pull = np.array([k * float(contact(y[0])) - LOAD, *(k * float(touching(y[0])) * moved[1:, 0])])
        return np.column_stack([moved[:, 1], -2.0 * DAMPING * moved[:, 1] - pull]).ravel()

    period = 2.0 * np.pi / frequency
    begin, limits = [*state, 1.0, 0.0, 0.0, 1.0], {"rtol": INTEGRATED, "atol": 1e-2 * INTEGRATED}
    ended = scipy.integrate.solve_ivp(rate, (0.0, period), begin, method="DOP853", **limits, max_step=period / 50)
    return ended.y[:2, -1], ended.y[2:, -1].reshape(2, 2).T


def fold_by_shooting(state, frequency):
    """Period's fixed point with a Floquet multiplier of one: two states and the frequency.

    Steps of 1e-5 for the derivatives of Newton's method, so that what is integrated to 1e-10 gives them five digits.
    """

    def equations(unknown):
        moved, monodromy = one_period(unknown[:2], unknown[2])
        return [*(moved - unknown[:2]), np.linalg.det(monodromy - np.eye(2))]

    return scipy.optimize.fsolve(equations, [*state, frequency], xtol=1e-7, epsfcn=INTEGRATED)[2]


def state_of(branch, point):
    lines, orders = branch.lines[point], np.arange(branch.lines.shape[1])
    speed = 2.0 * (1j * branch.parameter[point] * orders[1:] * lines[1:]).sum().real
    return np.array([lines[0].real + 2.0 * lines[1:].real.sum(), speed])


@pytest.mark.validation
@pytest.mark.parametrize("near", [0.92249, 0.83043, 0.46904, 0.48055])
def test_every_fold_of_a_pair_with_backlash_is_that_of_shooting_in_time(branch, near):
    """Both resonances, where teeth first part and where they come together again, to 5e-4 of the frequency."""
    point, frequency = min(branch.folds, key=lambda fold: abs(fold[1] - near))
    assert frequency == pytest.approx(near, rel=5e-4)
    assert frequency == pytest.approx(fold_by_shooting(state_of(branch, point), frequency), rel=5e-4)


@pytest.mark.validation
def test_stability_changes_at_the_folds_and_nowhere_else(branch):
    """Floquet exponents in every point of the branch, which passes eight folds."""
    samples = 400
    angles = 2.0 * np.pi * np.arange(samples) / samples
    constant = np.array([[0.0, 1.0], [0.0, -2.0 * DAMPING]])
    stable = []
    for frequency, lines in zip(branch.parameter, branch.lines, strict=True):
        x = lines[0].real + 2.0 * np.real(np.exp(1j * np.outer(angles, np.arange(1, len(lines)))) @ lines[1:])
        varying = (stiffness(angles) * touching(x))[:, None, None]
        push, read = np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
        stable.append(exponents(constant, push, read, varying, 2.0 * np.pi / frequency)[0][0].real < 0.0)
    changes = np.flatnonzero(np.diff(stable))
    assert len(branch.folds) == len(changes) == 8
    assert np.abs(changes - [point for point, _ in branch.folds]).max() <= 1


@pytest.mark.parametrize(("frequency", "share"), [(2.0, 0.1), (2.05, 0.1), (2.0, 0.02), (1.9, 0.05)])
def test_mathieus_equation_grows_where_its_first_zone_says(frequency, share):
    """x'' + 2 z x' + (1 + 2 e cos w t) x = 0: near w = 2 the growth is sqrt(e^2/4 - (w/2 - 1)^2) - z to first order."""
    z, kicks = 0.02, 400
    angles = 2.0 * np.pi * np.arange(kicks) / kicks
    varying = (2.0 * share * np.cos(angles))[:, None, None]
    constant = np.array([[0.0, 1.0], [-1.0, -2.0 * z]])
    found, _ = exponents(constant, np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]]), varying, 2.0 * np.pi / frequency)
    inside = 0.25 * share**2 - (0.5 * frequency - 1.0) ** 2
    expected = (np.sqrt(inside) if inside > 0.0 else 0.0) - z
    # Second order in the variation and in the detuning.
    assert found[0].real == pytest.approx(expected, abs=0.02 * share + 1e-4)


def test_a_start_that_leads_nowhere_is_told():
    def residual(x, parameter):
        return np.ones_like(x), lambda step: step

    with pytest.raises(HarmonicBalanceError, match="continuation: no solution at the start 1"):
        trace(residual, np.zeros(2, dtype=complex), 1.0, 2.0, Scales(1.0, 1.0), step=0.1, longest=0.1)


def test_a_branch_that_is_lost_is_kept_up_to_there():
    def residual(x, parameter):
        return x - parameter if parameter < 1.5 else np.full_like(x, np.nan), lambda step: step

    found = trace(residual, np.ones(1, dtype=complex), 1.0, 2.0, Scales(1.0, 1.0), step=0.1, longest=0.1)
    assert found.lost and not found.whole
    assert 1.49 < found.parameter[-1] < 1.5
    np.testing.assert_allclose(found.lines[:, 0], found.parameter, rtol=1e-6)
    with pytest.raises(HarmonicBalanceError, match="no solution beyond the start 1.49999"):
        trace(residual, np.ones(1, dtype=complex), 1.49999, 2.0, Scales(1.0, 1.0), step=0.1, longest=0.1)
