"""Half-space solutions against quadrature, one another and their limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from fe_ste.elasticity.halfspace import (
    interior_normal_displacement,
    rectangle_integral,
    tent_displacements,
    tent_weights,
)

NU = 0.3


@pytest.mark.parametrize(
    ("across", "along"), [(0.0, 0.0), (0.3, -0.2), (1.0, 0.5), (-1.0, 0.0), (1.7, 0.4), (5.0, -9.0)]
)
def test_rectangle_equals_quadrature(across: float, along: float) -> None:
    """Inside, on a corner, on an edge, outside: integral of 1/r over 2 x 1, in polar strips where r vanishes."""

    def over_strip(y: float) -> float:
        # Integral over x of 1 / sqrt(x^2 + y^2) in closed form leaves a quadrature that log r is no trouble for.
        low, high = across - 1.0, across + 1.0
        if y == 0.0:
            return 0.0
        return float(np.arcsinh(high / abs(y)) - np.arcsinh(low / abs(y)))

    points = [0.0] if abs(along) < 0.5 else None
    reference, _ = quad(over_strip, along - 0.5, along + 0.5, points=points, epsabs=1e-12, epsrel=1e-12, limit=500)
    assert rectangle_integral(across, along, 1.0, 0.5) == pytest.approx(reference, rel=1e-9)


def test_rectangle_equals_plain_double_quadrature_outside() -> None:
    reference, _ = dblquad(lambda y, x: 1 / np.hypot(x, y), 0.7, 2.7, -0.1, 0.9, epsabs=1e-11, epsrel=1e-11)
    assert rectangle_integral(1.7, 0.4, 1.0, 0.5) == pytest.approx(reference, rel=1e-9)


def test_rectangle_is_even_additive_and_far_away_a_point_load() -> None:
    assert rectangle_integral(0.4, 0.3, 1.0, 0.5) == pytest.approx(rectangle_integral(-0.4, -0.3, 1.0, 0.5), rel=1e-14)
    parts = sum(rectangle_integral(0.4 - x, 0.3, 0.5, 0.5) for x in (-0.5, 0.5))
    assert rectangle_integral(0.4, 0.3, 1.0, 0.5) == pytest.approx(parts, rel=1e-13)
    assert rectangle_integral(400.0, 300.0, 1.0, 0.5) == pytest.approx(2.0 / 500.0, rel=1e-5)


def test_interior_field_at_the_surface_is_love_s_kernel() -> None:
    """Depth 0: (1 + nu)/(2 pi E) 2 (1 - nu)/r is (1 - nu^2)/(pi E)/r."""
    assert interior_normal_displacement(0.3, 0.4, 0.0, NU) == pytest.approx(2 * (1 - NU) / 0.5, rel=1e-14)


def test_interior_field_is_boussinesq_s() -> None:
    """Below the load, and elsewhere by integrating the strain of Boussinesq's stresses from the surface down.

    Stresses under a point load P (Johnson, eq. 3.19): s_z = -3 P z^3/(2 pi R^5), s_r + s_t =
    P/(2 pi) [(1 - 2 nu)/... - 3 r^2 z/R^5] with s_x + s_y + s_z = -(1 + nu) P z/(pi R^3).
    """
    assert interior_normal_displacement(0.0, 0.0, 2.0, NU) == pytest.approx((1 + 2 * (1 - NU)) / 2.0, rel=1e-14)
    radius, depth = 0.7, 0.9

    def strain(z: float) -> float:
        """d w / d z times 2 pi E / (1 + nu)."""
        distance = np.hypot(radius, z)
        normal = -3 * z**3 / (2 * np.pi * distance**5)
        total = -(1 + NU) * z / (np.pi * distance**3)
        return float(((1 + NU) * normal - NU * total) * 2 * np.pi / (1 + NU))

    drop, _ = quad(strain, 0.0, depth, epsabs=1e-13)
    surface = interior_normal_displacement(radius, 0.0, 0.0, NU)
    assert interior_normal_displacement(0.42, 0.56, depth, NU) == pytest.approx(surface + drop, rel=1e-10)


ROLL, AXIAL, BASE = np.array([0.30, 0.34, 0.38, 0.42]), np.linspace(-6e-3, 6e-3, 4), 50e-3


def tents(mirror: float = 0.0, lead: float = 3.0, depth: float = 0.9e-3, shift: float = -0.2e-3) -> np.ndarray:
    return tent_displacements(ROLL, AXIAL, BASE, lead, 0.96, depth, shift, NU, mirror)


def test_tent_loads_equal_a_fine_quadrature() -> None:
    """One inner and one corner tent, integrated by a midpoint rule of 400 x 400 points."""
    result = tents()
    samples = (np.arange(400) + 0.5) / 400
    roll = ROLL[0] + samples * np.ptp(ROLL)
    axial = AXIAL[0] + samples * np.ptp(AXIAL)
    for node, layer in ((1, 2), (0, 0)):
        hat_roll = np.interp(roll, ROLL, np.eye(4)[node])
        hat_axial = np.interp(axial, AXIAL, np.eye(4)[layer])
        density = np.outer(roll * hat_roll, hat_axial)  # arc element r_b phi d phi
        density /= density.sum()
        for read_node, read_layer in ((1, 2), (3, 0)):
            apart = AXIAL[read_layer] - axial[None, :]
            mean = (ROLL[read_node] + roll[:, None]) / 2
            across = BASE * mean * (ROLL[read_node] - roll[:, None] - 3.0 * apart)
            along = apart / 0.96 - 0.2e-3
            square = across**2 + along**2 + 0.9e-3**2
            kernel = 0.9e-3**2 / square**1.5 + 2 * (1 - NU) / np.sqrt(square)
            value = result[read_node * 4 + read_layer, node * 4 + layer]
            # Two Gauss points each way in cells of half the depth.
            assert value == pytest.approx(float((density * kernel).sum()), rel=1e-3)


def test_mirror_adds_the_loads_imaged_at_both_ends() -> None:
    """Without shift and lead, images at both ends are the tents of a face three times as long, folded."""
    mirrored = tents(mirror=1.0, lead=0.0, shift=0.0)
    long_axial = np.linspace(-18e-3, 18e-3, 10)
    long = tent_displacements(ROLL, long_axial, BASE, 0.0, 0.96, 0.9e-3, 0.0, NU, 0.0).reshape(4, 10, 4, 10)
    # Inner layer 1 of the face is layer 4 of the long one; its images are layers 2 and 8.
    folded = long[:, 3:7, :, 4] + long[:, 3:7, :, 2] + long[:, 3:7, :, 8]
    own = mirrored.reshape(4, 4, 4, 4)[:, :, :, 1]
    assert np.abs(own - folded).max() < 1e-12 * np.abs(own).max()


def test_tent_weights_are_the_consistent_loads_of_the_tents() -> None:
    """Against Gauss quadrature of hat x hat x roll."""
    weights = tent_weights(ROLL, AXIAL)
    points, factors = np.polynomial.legendre.leggauss(4)
    mass = np.zeros((4, 4))
    for left in range(3):
        step = ROLL[left + 1] - ROLL[left]
        for point, factor in zip((points + 1) / 2, factors / 2, strict=True):
            hats = np.interp(ROLL[left] + point * step, ROLL, np.arange(4.0))
            value = np.maximum(0, 1 - np.abs(np.arange(4) - hats))
            mass += factor * step * (ROLL[left] + point * step) * np.outer(value, value)
    inner = weights.reshape(4, 4, 4, 4)[:, :, 1, 1].sum(axis=1)
    assert inner == pytest.approx(mass[:, 1] / mass[:, 1].sum(), rel=1e-12)
