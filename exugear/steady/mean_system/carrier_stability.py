"""Stability of a gearbox whose stiffness varies as the carrier turns: Floquet exponents over a planet passage.

With the averaged mass and the damping and stiffness at the angle psi = W t of the input

    M u'' + C(psi) u' + K(psi) u = 0,

the state x = (u, u') is multiplied by a matrix X in each passage, whose eigenvalues are exp(exponent x period). X is a
product of exponentials of the system at the middle of each of many steps: exact where nothing varies, and of second
order in what varies within a step. Large systems are reduced to the modes of lowest frequency of the averaged system,
of which all but the damping of the highest hardly depends on the rest.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from exugear.steady.mean_system.mean_system import MeanSystem, most_rolling, vibrations
from exugear.system.modes import state_matrix
from fe_ste.tools.arrays import Complexes, Floats

STEPS = 96
"""Steps of a passage: twice as many change the exponents of a set of two planets by less than 1e-3 1/s."""
LARGEST = 100
"""Coordinates from which the system is reduced."""
MODES = 40
"""Modes that are kept then."""


def growth_over_carrier(system: MeanSystem, speed: float) -> float:
    """Return the fastest growth of a disturbance at a speed of the input (rad/s) other than zero, 1/s.

    Free rolling is left out. Stiffness has to vary with the angle of the carrier: `MeanSystem.over_angle`.
    """
    dampings, stiffnesses = _at_steps(system, speed)
    places = system.frame.places
    step = float(places[1] * len(places)) / abs(speed) / STEPS
    if system.size > LARGEST:
        passage = _of_modes(system, speed, dampings, stiffnesses, step)
        multipliers = scipy.linalg.eigvals(passage)
    else:
        passage = np.eye(2 * system.size)
        for damping, stiffness in zip(dampings, stiffnesses, strict=True):
            passage = scipy.linalg.expm(step * state_matrix(system.mass, damping, stiffness)) @ passage
        multipliers, shapes = scipy.linalg.eig(passage)
        multipliers = np.delete(multipliers, most_rolling(system, shapes))
    return float(np.log(np.abs(multipliers).max()) / (STEPS * step))


def _at_steps(system: MeanSystem, speed: float) -> tuple[Floats, Floats]:
    """Find C and K (steps, size, size) at the middle of each step of a passage, by Fourier series over the angle."""
    assert system.over_angle is not None
    dampings, stiffnesses = system.over_angle[0], system.at(system.over_angle[1], speed)
    count = len(dampings)
    turns = np.fft.fftfreq(count, 1.0 / count)
    middle = 2.0 * np.pi * (np.arange(STEPS) + 0.5) / STEPS * np.sign(speed)
    # Of an even number of places the highest harmonic is a cosine.
    phases = np.where(2 * turns == -count, np.cos(np.outer(middle, turns)), np.exp(1j * np.outer(middle, turns)))
    weights = (phases @ np.fft.fft(np.eye(count), axis=0)).real / count - 1.0 / count
    return (
        system.damping_at(speed) + np.tensordot(weights, dampings, axes=1),
        system.stiffness_at(speed) + np.tensordot(weights, stiffnesses, axes=1),
    )


def _of_modes(system: MeanSystem, speed: float, dampings: Floats, stiffnesses: Floats, step: float) -> Complexes:
    """Multiply the amplitudes of the lowest modes and of their conjugates (2 modes, 2 modes) over a passage."""
    mean = system.damping_at(speed), system.stiffness_at(speed)
    values, right, left = (own[:MODES] for own in vibrations(system.mass, *mean))
    size = system.size
    shapes = np.concatenate([right, right.conj()])
    felt = np.concatenate([left, left.conj()])[:, size:] @ np.linalg.inv(system.mass)
    passage: Complexes = np.eye(len(shapes), dtype=complex)
    for damping, stiffness in zip(dampings, stiffnesses, strict=True):
        forces = (damping - mean[0]) @ shapes[:, size:].T + (stiffness - mean[1]) @ shapes[:, :size].T
        passage = scipy.linalg.expm(step * (np.diag(np.append(values, values.conj())) - felt @ forces)) @ passage
    return passage
