"""Stability of a gearbox whose stiffness varies as the carrier turns: Floquet exponents over a planet passage.

With the averaged mass and the damping and stiffness at the angle psi = W t of the input

    M u'' + C(psi) u' + K(psi) u = 0,

the state x = (u, u') is multiplied by a matrix X in each passage, whose eigenvalues are exp(exponent x period). X is a
product of exponentials of the system at the middle of each of many steps: exact where nothing varies, and of second
order in what varies within a step. Large systems are reduced to the undamped modes of lowest frequency of the averaged
system.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg

from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.system.modes import state_matrix
from fe_ste.tools.arrays import Complexes, Floats

STEPS = 96
"""Steps of a passage: twice as many change the growth of three unevenly spaced planets by 2e-4 of 26 1/s."""
LARGEST = 100
"""Coordinates from which the system is reduced."""
MODES = 40
"""Modes that are kept then. In the GRC with all bodies flexible 30 and 100 modes give the same growth to 1e-3."""


def growth_over_carrier(system: MeanSystem, speed: float) -> float:
    """Return the fastest growth of a disturbance at a speed of the input (rad/s) other than zero, 1/s.

    Free rolling, which has no inertia in common with vibrations, is held by a spring and a damper along it: in a system
    that varies with the angle it has two exponents of opposite sign, not zero ones. Stiffness has to vary with the
    angle of a carrier: `MeanSystem.over_angles`. Where it varies with those of several, it is the fastest growth with
    one of them, the others at their mean.
    """
    basis = np.eye(system.size)
    if system.size > LARGEST:
        stiffness = system.stiffness_at(speed)
        basis = scipy.linalg.eigh(0.5 * (stiffness + stiffness.T), system.mass, subset_by_index=(0, MODES - 1))[1]
    mass = basis.T @ system.mass @ basis
    along = basis.T @ system.mass @ system.rolling
    held = np.outer(along, along) / (system.rolling @ system.mass @ system.rolling)
    rate = math.sqrt(np.trace(np.linalg.solve(system.mass, system.stiffness_at(speed))) / system.size)
    growths = []
    for carrier, (dampings, at_speeds) in zip(system.frame.varying_carriers, system.over_angles, strict=True):
        places = system.frame.places_of(carrier)
        period = float(places[1] * len(places)) / speed
        stiffnesses = system.at(at_speeds, speed)
        dampings = basis.T @ (system.damping_at(speed) + dampings - dampings.mean(axis=0)) @ basis
        stiffnesses = basis.T @ (system.stiffness_at(speed) + stiffnesses - stiffnesses.mean(axis=0)) @ basis
        found = exponents_of_turning(mass, dampings + 2.0 * rate * held, stiffnesses + rate**2 * held, period)
        growths.append(float(found.real.max()))
    return max(growths)


def exponents_of_turning(mass: Floats, dampings: Floats, stiffnesses: Floats, period: float) -> Complexes:
    """Return Floquet exponents (2 n,), 1/s, of C and K that vary over a turn.

    Parameters
    ----------
    mass : (n, n)
    dampings, stiffnesses : (p, n, n) at p angles that are evenly spread over the turn
    period : of the turn, s; negative where the angle decreases

    Examples
    --------
    >>> stiffnesses = np.full((3, 1, 1), 100.0)
    >>> exponents_of_turning(np.eye(1), np.full((3, 1, 1), 2.0), stiffnesses, 0.1).real.round(6)
    array([-1., -1.])
    """
    step = abs(period) / STEPS
    count = len(dampings)
    turns = np.fft.fftfreq(count, 1.0 / count)
    angles = np.outer(math.copysign(1.0, period) * 2.0 * np.pi * (np.arange(STEPS) + 0.5) / STEPS, turns)
    # Of an even number of angles the highest harmonic is a cosine.
    phases = np.where(2 * turns == -count, np.cos(angles), np.exp(1j * angles))
    # Values at the middle of each step are those at even angles with weights (steps, count), by Fourier series.
    weights = (phases @ np.fft.fft(np.eye(count), axis=0)).real / count
    # At low speeds a turn takes so long that all motion decays to less than the smallest number: its decay on average,
    # and the size after each step, are factors by themselves.
    mean = state_matrix(mass, dampings.mean(axis=0), stiffnesses.mean(axis=0))
    decay = float(np.linalg.eigvals(mean).real.max())
    growth = decay * abs(period)
    passage = np.eye(2 * len(mass))
    for own in weights:
        constant = state_matrix(mass, np.tensordot(own, dampings, axes=1), np.tensordot(own, stiffnesses, axes=1))
        passage = scipy.linalg.expm(step * (constant - decay * np.eye(len(passage)))) @ passage
        size = float(np.linalg.norm(passage))
        passage /= size
        growth += math.log(size)
    multipliers = np.asarray(np.linalg.eigvals(passage), dtype=complex)
    return np.asarray((np.log(np.where(multipliers == 0.0, 1e-300, multipliers)) + growth) / abs(period))
