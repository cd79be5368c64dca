"""Half-space solutions against quadrature, one another and their limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from fe_ste.elasticity.halfspace import (
    interior_displacement as displacement_of_loads,
)
from fe_ste.elasticity.halfspace import (
    rectangle_integral,
    tent_integrals,
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


def interior_displacement(places: np.ndarray, poissons_ratio: float) -> np.ndarray:
    """Under a unit load at the origin."""
    at, one = places.reshape(-1, 3), np.array([[1.0, 0.0]])
    found = displacement_of_loads(at, np.zeros((1, 2)), np.array([0]), one, 2, poissons_ratio)
    return np.asarray(found[..., 0].reshape(places.shape))


def into_the_surface(x: float, y: float, z: float) -> float:
    return float(interior_displacement(np.array([x, y, z]), NU)[2])


def test_interior_field_at_the_surface_is_love_s_kernel() -> None:
    """Depth 0: (1 + nu)/(2 pi E) 2 (1 - nu)/r is (1 - nu^2)/(pi E)/r."""
    assert into_the_surface(0.3, 0.4, 0.0) == pytest.approx(2 * (1 - NU) / 0.5, rel=1e-14)


def test_interior_field_is_boussinesq_s() -> None:
    """Below the load, and elsewhere by integrating the strain of Boussinesq's stresses from the surface down.

    Stresses under a point load P (Johnson, eq. 3.19): s_z = -3 P z^3/(2 pi R^5), s_r + s_t =
    P/(2 pi) [(1 - 2 nu)/... - 3 r^2 z/R^5] with s_x + s_y + s_z = -(1 + nu) P z/(pi R^3).
    """
    assert into_the_surface(0.0, 0.0, 2.0) == pytest.approx((1 + 2 * (1 - NU)) / 2.0, rel=1e-14)
    radius, depth = 0.7, 0.9

    def strain(z: float) -> float:
        """d w / d z times 2 pi E / (1 + nu)."""
        distance = np.hypot(radius, z)
        normal = -3 * z**3 / (2 * np.pi * distance**5)
        total = -(1 + NU) * z / (np.pi * distance**3)
        return float(((1 + NU) * normal - NU * total) * 2 * np.pi / (1 + NU))

    drop, _ = quad(strain, 0.0, depth, epsabs=1e-13)
    surface = into_the_surface(radius, 0.0, 0.0)
    assert into_the_surface(0.42, 0.56, depth) == pytest.approx(surface + drop, rel=1e-10)


def test_interior_field_is_in_equilibrium_without_forces_inside() -> None:
    """Navier: (1 - 2 nu) laplacian u + grad div u = 0, by central differences."""
    step, place = 1e-3, np.array([0.5, -0.4, 0.7])

    def second(first: int, other: int) -> np.ndarray:
        moves = [(a, b, a * b) for a in (1, -1) for b in (1, -1)]
        at = [place + step * (a * np.eye(3)[first] + b * np.eye(3)[other]) for a, b, _ in moves]
        signs = np.array([sign for *_, sign in moves])
        return np.asarray(signs @ interior_displacement(np.array(at), NU) / (4 * step**2))

    laplacian = sum(second(k, k) for k in range(3))
    of_divergence = np.array([sum(second(k, m)[m] for m in range(3)) for k in range(3)])
    terms = (1 - 2 * NU) * laplacian, of_divergence
    # Second differences err by step^2 of the fourth derivatives.
    assert np.abs(terms[0] + terms[1]).max() < 1e-4 * np.abs(terms[1]).max()


def test_interior_field_leaves_its_surface_free() -> None:
    """No shear stress on z = 0 away from the load: du/dz + dw/dx = 0."""
    step, place = 1e-5, np.array([0.5, 0.0, 0.0])
    slope = interior_displacement(np.array([place + [0, 0, step], place + [step, 0, 0], place - [step, 0, 0]]), NU)
    shear = (slope[0, 0] - interior_displacement(place, NU)[0]) / step + (slope[1, 2] - slope[2, 2]) / (2 * step)
    assert abs(shear) < 1e-3 * abs(slope[1, 2] - slope[2, 2]) / (2 * step)


ROLL, AXIAL, BASE = np.array([0.30, 0.34, 0.38, 0.42]), np.linspace(-6e-3, 6e-3, 4), 50e-3


def tents(mirror: float = 0.0, lead: float = 3.0) -> np.ndarray:
    return tent_integrals(ROLL, AXIAL, BASE, lead, 0.96, np.array([[[mirror, 1.0, 2.0]]] * 2))


@pytest.mark.parametrize(("node", "layer"), [(1, 2), (0, 0)])
@pytest.mark.parametrize(("read_node", "read_layer"), [(1, 2), (3, 0), (2, 2), (0, 0)])
def test_tents_are_sums_of_small_rectangles(node: int, layer: int, read_node: int, read_layer: int) -> None:
    """An inner and a corner tent of 300 x 300 parts, by Love's formula or as points; parts lean, which errs 1e-3."""
    samples = (np.arange(300) + 0.5) / 300
    roll, axial = ROLL[0] + samples * np.ptp(ROLL), AXIAL[0] + samples * np.ptp(AXIAL)
    density = np.outer(roll * np.interp(roll, ROLL, np.eye(4)[node]), np.interp(axial, AXIAL, np.eye(4)[layer]))
    density /= density.sum()
    apart = AXIAL[read_layer] - axial[None, :]
    across = BASE * (ROLL[read_node] + roll[:, None]) / 2 * (ROLL[read_node] - roll[:, None] - 1.0 * apart)
    along = np.broadcast_to(apart / 0.96, across.shape)
    distance, half_along = np.hypot(across, along), np.ptp(AXIAL) / 600 / 0.96
    inverse = 1.0 / distance
    for i, j in np.argwhere(distance < 6 * half_along):
        half_across = BASE * float(roll[i]) * np.ptp(ROLL) / 600
        integral = rectangle_integral(float(across[i, j]), float(along[i, j]), half_across, half_along)
        inverse[i, j] = integral / (4 * half_across * half_along)
    found = tents(lead=1.0)[read_node * 4 + read_layer, node * 4 + layer]
    assert found == pytest.approx(float((density * inverse).sum()), rel=2e-3)


def test_mirror_adds_the_loads_imaged_at_both_ends() -> None:
    """Without lead, images at both ends are the tents of a face three times as long, folded."""
    mirrored = tents(mirror=1.0, lead=0.0)
    long_axial = np.linspace(-18e-3, 18e-3, 10)
    long = tent_integrals(ROLL, long_axial, BASE, 0.0, 0.96, np.zeros((2, 0, 3))).reshape(4, 10, 4, 10)
    # Inner layer 1 of the face is layer 4 of the long one; its images are layers 2 and 8.
    folded = long[:, 3:7, :, 4] + long[:, 3:7, :, 2] + long[:, 3:7, :, 8]
    own = mirrored.reshape(4, 4, 4, 4)[:, :, :, 1]
    assert np.abs(own - folded).max() < 1e-9 * np.abs(own).max()


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
