"""Elastic half-space under normal loads: displacement inside (Boussinesq) and on the surface (Love).

Kernels are compiled by `fe_ste.tools.compilation`.

Flank coordinates. An involute helicoid is a developable surface. With the roll angle phi = tan(alpha) and the
axial position z of a point, the two directions along the generator (the contact line) and across it are
perpendicular, and two near points are apart by

    across: r_b phi_m (delta_phi - kappa delta_z),    along: delta_z / cos(beta_b),

phi_m being their mean roll angle and kappa = d phi / d z along a generator. All kernels here take this metric.
"""

from __future__ import annotations

import math

import numpy as np

from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import compiled

#: Gauss rule of three points over 0 to 1.
_PLACES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_SHARES = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)

#: Part of a quadrilateral's sides below which it is not halved any more: 1e-3 of the integral is left in such a part.
_LEAST_PART = 2e-3


def interior_displacement(places: Floats, poissons_ratio: float) -> Floats:
    """Evaluate the displacement inside a half-space under a unit normal point load at the origin.

    Boussinesq: u = (1 + nu) / (2 pi E) [z/R^3 - (1 - 2 nu)/(R (R + z))] (x, y) in the surface and
    w = (1 + nu) / (2 pi E) [z^2/R^3 + 2 (1 - nu)/R] into it; the factor (1 + nu) / (2 pi E) is left out.

    Parameters
    ----------
    places : ndarray (..., 3)
        x and y in the surface, z into it, m; not the origin.
    poissons_ratio : float

    Returns
    -------
    ndarray (..., 3)
        1/m.

    References
    ----------
    K. L. Johnson, Contact Mechanics, 1985, eq. (3.18).
    """
    depth = places[..., 2:]
    distance = np.linalg.norm(places, axis=-1, keepdims=True)
    outward = depth / distance**3 - (1.0 - 2.0 * poissons_ratio) / (distance * (distance + depth))
    inward = depth**2 / distance**3 + 2.0 * (1.0 - poissons_ratio) / distance
    return np.concatenate([outward * places[..., :2], inward], axis=-1)


@compiled
def _weighted_difference(x: float, high: float, low: float, to_high: float, to_low: float) -> float:
    """Evaluate x [asinh(high / |x|) - asinh(low / |x|)] with one logarithm; ``to_high`` is hypot(x, high)."""
    # asinh(h / |x|) = log((h + hypot(x, h)) / |x|). For a negative h the sum would cancel, but asinh is odd.
    if x == 0.0:
        return 0.0
    above, below = abs(high) + to_high, abs(low) + to_low
    if (high < 0.0) == (low < 0.0):
        return x * math.log(above / below) if high >= 0.0 else x * math.log(below / above)
    return x * math.log(above * below / (x * x))


@compiled
def rectangle_integral(across: float, along: float, half_across: float, half_along: float) -> float:
    """Integral of 1 / distance over a rectangle, seen from a point of the surface (Love's uniform pressure).

    The surface displacement under a uniform pressure p is p (1 - nu^2) / (pi E) times this.

    Parameters
    ----------
    across, along : float
        Position of the point from the middle of the rectangle, m.
    half_across, half_along : float
        Half sides of the rectangle, m.

    Returns
    -------
    float
        The integral, m.

    References
    ----------
    A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377-420; Johnson, Contact Mechanics, eq. (3.25).
    """
    # Johnson's four logarithms, joined in pairs: sides right and left by the height, top and bottom by the breadth.
    right, left = across + half_across, across - half_across
    top, bottom = along + half_along, along - half_along
    right_top, right_bottom = math.hypot(right, top), math.hypot(right, bottom)
    left_top, left_bottom = math.hypot(left, top), math.hypot(left, bottom)
    return (
        _weighted_difference(right, top, bottom, right_top, right_bottom)
        - _weighted_difference(left, top, bottom, left_top, left_bottom)
        + _weighted_difference(top, right, left, right_top, left_top)
        - _weighted_difference(bottom, right, left, right_bottom, left_bottom)
    )


@compiled
def tent_integrals(
    roll: Floats, axial: Floats, base_radius: float, lead: float, base_helix_cosine: float, mirror: float
) -> Floats:
    """Mean of 1 / distance over bilinear ("tent") loads on the flank nodes, seen from the flank nodes.

    The surface displacement under a unit tent load is (1 - nu^2) / (pi E) times this.

    Parameters
    ----------
    roll, axial : ndarray (f,), (l,)
        Roll angles (rad) and axial positions (m) of the flank grid.
    base_radius : float
    lead : float
        d phi / d z along a generator, rad/m.
    base_helix_cosine : float
        cos(beta_b).
    mirror : float
        Strength of the image loads behind both free end faces; 0 for none.

    Returns
    -------
    ndarray (f l, f l)
        Row: read-out node, column: load node, both numbered ``flank node * l + layer``, 1/m.
    """
    n_roll, n_axial = len(roll), len(axial)
    result = np.zeros((n_roll * n_axial, n_roll * n_axial))
    weight_sum = np.zeros(n_roll * n_axial)
    metric = (base_radius, lead, base_helix_cosine)
    corners = np.empty(4)
    for i in range(n_roll - 1):
        for j in range(n_axial - 1):
            quad = (roll[i], axial[j], roll[i + 1] - roll[i], axial[j + 1] - axial[j])
            first = i * n_axial + j
            columns = (first, first + 1, first + n_axial, first + n_axial + 1)
            for read in range(n_roll * n_axial):
                place = (roll[read // n_axial], axial[read % n_axial])
                corners[:] = 0.0
                _add_quadrilateral(corners, place, quad, metric, 1.0, 0.0)
                for k in range(4):
                    result[read, columns[k]] += corners[k]
                if mirror != 0.0:
                    corners[:] = 0.0
                    # The image of a load at z behind the face at z_end is at 2 z_end - z.
                    _add_quadrilateral(corners, place, quad, metric, -1.0, 2.0 * axial[0])
                    _add_quadrilateral(corners, place, quad, metric, -1.0, 2.0 * axial[-1])
                    for k in range(4):
                        result[read, columns[k]] += mirror * corners[k]
            # Areas of the tents: r_b phi dphi dz, constant factors left out; exact for a tent times phi.
            near, far = quad[0] / 3.0 + (quad[0] + quad[2]) / 6.0, quad[0] / 6.0 + (quad[0] + quad[2]) / 3.0
            for k in range(4):
                weight_sum[columns[k]] += 0.5 * quad[2] * quad[3] * (near if k < 2 else far)
    return result / weight_sum


@compiled
def _add_quadrilateral(
    corners: Floats,
    place: tuple[float, float],
    quad: tuple[float, float, float, float],
    metric: tuple[float, float, float],
    sense: float,
    offset: float,
) -> None:
    """Add the integrals of the four bilinear shape functions over distance; the load is at ``sense * z + offset``.

    The quadrilateral (first roll angle and axial position, their steps) is halved towards the place until its parts
    are small against their distance, and each part integrated by three Gauss points each way.
    """
    base_radius, lead, cosine = metric
    roll, axial, roll_step, axial_step = quad
    stack = np.empty((256, 4))
    stack[0] = np.array([0.0, 0.0, 1.0, 1.0])
    held = 1
    while held > 0:
        held -= 1
        s, t, width, height = stack[held]
        phi, z = roll + (s + width / 2) * roll_step, axial + (t + height / 2) * axial_step
        across = base_radius * 0.5 * (place[0] + phi) * (place[0] - phi - lead * (place[1] - z))
        along = (place[1] - sense * z - offset) / cosine
        breadth, length = abs(base_radius * phi * roll_step * width), axial_step * height / cosine
        if max(breadth, length) > 0.5 * math.hypot(across, along) and max(width, height) > _LEAST_PART:
            halves_roll = 1 if length > 2.0 * breadth else 2
            halves_axial = 1 if breadth > 2.0 * length else 2
            width, height = width / halves_roll, height / halves_axial
            for k in range(halves_roll):
                for m in range(halves_axial):
                    stack[held, 0], stack[held, 1] = s + k * width, t + m * height
                    stack[held, 2], stack[held, 3] = width, height
                    held += 1
            continue
        for k in range(3):
            for m in range(3):
                p, q = s + _PLACES[k] * width, t + _PLACES[m] * height
                phi, z = roll + p * roll_step, axial + q * axial_step
                across = base_radius * 0.5 * (place[0] + phi) * (place[0] - phi - lead * (place[1] - z))
                along = (place[1] - sense * z - offset) / cosine
                area = _SHARES[k] * _SHARES[m] * width * height * phi * roll_step * axial_step
                value = area / math.hypot(across, along)
                corners[0] += value * (1 - p) * (1 - q)
                corners[1] += value * (1 - p) * q
                corners[2] += value * p * (1 - q)
                corners[3] += value * p * q


def tent_weights(roll: Floats, axial: Floats) -> Floats:
    """Share of each flank node in the consistent nodal load of each tent load.

    Parameters
    ----------
    roll, axial : ndarray (f,), (l,)
        Flank grid.

    Returns
    -------
    ndarray (f l, f l)
        Row: node, column: tent; columns sum to 1.

    Examples
    --------
    >>> weights = tent_weights(np.array([0.2, 0.3, 0.4]), np.array([0.0, 1.0]))
    >>> np.allclose(weights.sum(axis=0), 1.0)
    True
    """
    # The mass matrix of the tents is a product, since the area r_b phi dphi dz is: phi goes with the roll angle.
    along_roll = _line_mass(roll, weight=roll)
    along_axis = _line_mass(axial, weight=np.ones_like(axial))
    mass = np.kron(along_roll, along_axis)
    return np.asarray(mass / mass.sum(axis=0))


def _line_mass(nodes: Floats, weight: Floats) -> Floats:
    """Mass matrix of linear elements with a density that is linear between its nodal values `weight`."""
    mass = np.zeros((len(nodes), len(nodes)))
    for left in range(len(nodes) - 1):
        length, (a, b) = nodes[left + 1] - nodes[left], weight[left : left + 2]
        # Integrals of two linear shape functions with a linear weight, exact.
        block = length / 12.0 * np.array([[3 * a + b, a + b], [a + b, a + 3 * b]])
        mass[left : left + 2, left : left + 2] += block
    return mass
