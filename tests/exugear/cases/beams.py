"""A free frame of beams as matrices on its nodes, computed here: a body as files of matrices hold it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from exugear.system.bodies.matrix_files.interface import InterfaceMatrices

POSITIONS = np.array([[0.0, 0.0, 0.0], [0.6, 0.1, 0.0], [0.5, 0.5, 0.3], [0.0, 0.4, 0.2]])
NUMBERS = (12, 15, 101, 7)
"""Node numbers, in no order."""
STEEL, SHEAR, DENSITY = 210e9, 80e9, 7850.0
SIDE = 0.08
"""Side of the square cross-section, m."""


def beam_matrices(first: np.ndarray, second: np.ndarray, side: float = SIDE) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and consistent mass (12, 12) of an Euler-Bernoulli beam in space (Przemieniecki 1968, ch. 5 and 11)."""
    along = second - first
    length = float(np.linalg.norm(along))
    area, moment, polar = side**2, side**4 / 12.0, side**4 / 6.0
    stiffness, mass = np.zeros((12, 12)), np.zeros((12, 12))
    rod = np.array([[1.0, -1.0], [-1.0, 1.0]])
    linear = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    for place, k, m in (((0, 6), STEEL * area, area), ((3, 9), SHEAR * polar * 0.843, polar)):
        stiffness[np.ix_(place, place)] = k / length * rod
        mass[np.ix_(place, place)] = DENSITY * m * length * linear
    sign = 1.0
    for place in ((1, 5, 7, 11), (2, 4, 8, 10)):
        a, b = sign * 6.0 * length, length**2
        stiffness[np.ix_(place, place)] = (STEEL * moment / length**3) * np.array(
            [[12.0, a, -12.0, a], [a, 4 * b, -a, 2 * b], [-12.0, -a, 12.0, -a], [a, 2 * b, -a, 4 * b]]
        )
        c, d = sign * 22.0 * length, sign * 13.0 * length
        mass[np.ix_(place, place)] = (DENSITY * area * length / 420.0) * np.array(
            [[156.0, c, 54.0, -d], [c, 4 * b, d, -3 * b], [54.0, d, 156.0, -c], [-d, -3 * b, -c, 4 * b]]
        )
        sign = -1.0
    x = along / length
    y = np.cross([0.0, 0.0, 1.0] if abs(x[2]) < 0.9 else [0.0, 1.0, 0.0], x)
    y /= np.linalg.norm(y)
    axes = np.kron(np.eye(4), np.array([x, y, np.cross(x, y)]))
    return axes.T @ stiffness @ axes, axes.T @ mass @ axes


def beams_between(
    positions: np.ndarray, numbers: Sequence[int], side: float = SIDE, modes: int = 0
) -> InterfaceMatrices:
    """Beams between all nodes in SI units; modal coordinates of unit mass, coupled by mass to the nodes."""
    size = 6 * len(numbers)
    stiffness, mass = np.zeros((size + modes, size + modes)), np.zeros((size + modes, size + modes))
    for first, second in combinations(range(len(numbers)), 2):
        at = np.r_[6 * first : 6 * first + 6, 6 * second : 6 * second + 6]
        k, m = beam_matrices(positions[first], positions[second], side)
        stiffness[np.ix_(at, at)] += k
        mass[np.ix_(at, at)] += m
    rigid = InterfaceMatrices(tuple(numbers), positions, (), mass, stiffness).rigid_motions((0.0, 0.0, 0.0))[:size]
    for mode in range(modes):
        stiffness[size + mode, size + mode] = (2.0 * np.pi * (300.0 + 400.0 * mode)) ** 2
        mass[size + mode, size + mode] = 1.0
        coupling = np.zeros(size)
        coupling[6 * mode] = 0.3 * np.sqrt(mass[6 * mode, 6 * mode])
        mass[size + mode, :size] = mass[:size, size + mode] = coupling
    assert np.abs(stiffness[:size, :size] @ rigid).max() < 1e-9 * np.abs(stiffness).max()
    mass, stiffness = 0.5 * (mass + mass.T), 0.5 * (stiffness + stiffness.T)
    return InterfaceMatrices(tuple(numbers), positions, tuple(range(900_001, 900_001 + modes)), mass, stiffness)


def frame(modes: int = 2) -> InterfaceMatrices:
    """Frame of four nodes."""
    return beams_between(POSITIONS, NUMBERS, SIDE, modes)


def sorted_frame(modes: int = 2) -> InterfaceMatrices:
    """The same frame with its nodes in the order of their numbers."""
    body = frame(modes)
    return body.in_order([int(n) for n in np.argsort(NUMBERS)])
