"""A free frame of beams as matrices on its nodes, computed here: a body as files of matrices hold it."""

from __future__ import annotations

import numpy as np

from exugear.system.bodies.matrix_files.interface import InterfaceMatrices

POSITIONS = np.array([[0.0, 0.0, 0.0], [0.6, 0.1, 0.0], [0.5, 0.5, 0.3], [0.0, 0.4, 0.2]])
NUMBERS = (12, 15, 101, 7)
"""Node numbers, in no order."""
BEAMS = ((0, 1), (1, 2), (2, 3), (3, 0), (0, 2))
STEEL, SHEAR, DENSITY = 210e9, 80e9, 7850.0
SIDE = 0.08
"""Side of the square cross-section, m."""


def beam_matrices(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and consistent mass (12, 12) of an Euler-Bernoulli beam in space (Przemieniecki 1968, ch. 5 and 11)."""
    along = second - first
    length = float(np.linalg.norm(along))
    area, moment, polar = SIDE**2, SIDE**4 / 12.0, SIDE**4 / 6.0
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
    y = np.cross([0.0, 0.0, 1.0], x)
    y /= np.linalg.norm(y)
    axes = np.kron(np.eye(4), np.array([x, y, np.cross(x, y)]))
    return axes.T @ stiffness @ axes, axes.T @ mass @ axes


def frame(modes: int = 2) -> InterfaceMatrices:
    """Frame of beams in SI units, with as many modal coordinates of an inner mass on springs."""
    size = 6 * len(NUMBERS)
    stiffness, mass = np.zeros((size + modes, size + modes)), np.zeros((size + modes, size + modes))
    for first, second in BEAMS:
        at = np.r_[6 * first : 6 * first + 6, 6 * second : 6 * second + 6]
        k, m = beam_matrices(POSITIONS[first], POSITIONS[second])
        stiffness[np.ix_(at, at)] += k
        mass[np.ix_(at, at)] += m
    for mode in range(modes):  # modes of unit mass, coupled to the nodes by mass as fixed-interface modes are
        stiffness[size + mode, size + mode] = (2.0 * np.pi * (300.0 + 400.0 * mode)) ** 2
        mass[size + mode, size + mode] = 1.0
        coupling = 0.3 * np.sqrt(mass[6 * mode, 6 * mode])
        mass[size + mode, 6 * mode] = mass[6 * mode, size + mode] = coupling
    mass, stiffness = 0.5 * (mass + mass.T), 0.5 * (stiffness + stiffness.T)
    return InterfaceMatrices(NUMBERS, POSITIONS, tuple(range(900_001, 900_001 + modes)), mass, stiffness)


def sorted_frame(modes: int = 2) -> InterfaceMatrices:
    """The same frame with its nodes in the order of their numbers."""
    body = frame(modes)
    return body.in_order([int(n) for n in np.argsort(NUMBERS)])
