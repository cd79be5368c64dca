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

from exugear.steady.mean_system.mean_system import MeanSystem, most_rolling
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

    Free rolling is left out. Stiffness has to vary with the angle of a carrier: `MeanSystem.over_angles`. Where it
    varies with those of several, it is the fastest growth with one of them, the others at their mean.
    """
    basis = np.eye(system.size)
    if system.size > LARGEST:
        stiffness = system.stiffness_at(speed)
        basis = scipy.linalg.eigh(0.5 * (stiffness + stiffness.T), system.mass, subset_by_index=(0, MODES - 1))[1]
    mass = basis.T @ system.mass @ basis
    growths = []
    for carrier, (dampings, at_speeds) in zip(system.frame.varying_carriers, system.over_angles, strict=True):
        places = system.frame.places_of(carrier)
        period = float(places[1] * len(places)) / speed
        stiffnesses = system.at(at_speeds, speed)
        dampings = basis.T @ (system.damping_at(speed) + dampings - dampings.mean(axis=0)) @ basis
        stiffnesses = basis.T @ (system.stiffness_at(speed) + stiffnesses - stiffnesses.mean(axis=0)) @ basis
        found, shapes = exponents_of_turning(mass, dampings, stiffnesses, period)
        growths.append(float(np.delete(found, most_rolling(system, basis @ shapes)).real.max()))
    return max(growths)


def exponents_of_turning(
    mass: Floats, dampings: Floats, stiffnesses: Floats, period: float
) -> tuple[Complexes, Complexes]:
    """Return Floquet exponents (2 n,), 1/s, and shapes (n, 2 n), by columns, of C and K that vary over a turn.

    Parameters
    ----------
    mass : (n, n)
    dampings, stiffnesses : (p, n, n) at p angles that are evenly spread over the turn
    period : of the turn, s; negative where the angle decreases

    Examples
    --------
    >>> stiffnesses = np.full((3, 1, 1), 100.0)
    >>> exponents_of_turning(np.eye(1), np.full((3, 1, 1), 2.0), stiffnesses, 0.1)[0].real.round(6)
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
    passage = np.eye(2 * len(mass))
    for own in weights:
        constant = state_matrix(mass, np.tensordot(own, dampings, axes=1), np.tensordot(own, stiffnesses, axes=1))
        passage = scipy.linalg.expm(step * constant) @ passage
    multipliers, shapes = scipy.linalg.eig(passage)
    return np.log(multipliers.astype(np.complex128)) / abs(period), shapes[: len(mass)]
