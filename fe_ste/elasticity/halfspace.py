"""Elastic half-space: normal displacement under normal loads, inside (Boussinesq) and on the surface (Love).

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


@compiled
def interior_normal_displacement(across: float, along: float, depth: float, poissons_ratio: float) -> float:
    """Evaluate the normal displacement inside a half-space under a unit normal point load.

    Boussinesq: w = (1 + nu) / (2 pi E) [depth^2 / R^3 + 2 (1 - nu) / R]; the factor (1 + nu) / (2 pi E) is left out.

    Parameters
    ----------
    across, along : float
        Distances in the surface from the load, m.
    depth : float
        Depth of the point, m.
    poissons_ratio : float

    Returns
    -------
    float
        Bracket of the formula above, 1/m.

    References
    ----------
    K. L. Johnson, Contact Mechanics, 1985, eq. (3.18c).
    """
    square = across * across + along * along + depth * depth
    distance = math.sqrt(square)
    return depth * depth / (square * distance) + 2.0 * (1.0 - poissons_ratio) / distance


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
def tent_displacements(
    roll: Floats,
    axial: Floats,
    base_radius: float,
    lead: float,
    base_helix_cosine: float,
    depth: float,
    depth_shift: float,
    poissons_ratio: float,
    mirror: float,
) -> Floats:
    """Evaluate the normal displacement at a depth below the flank nodes under bilinear ("tent") unit loads on them.

    Parameters
    ----------
    roll, axial : ndarray (f,), (l,)
        Roll angles (rad) and axial positions (m) of the flank grid.
    base_radius : float
    lead : float
        d phi / d z along a generator, rad/m.
    base_helix_cosine : float
        cos(beta_b).
    depth : float
        Depth of the read-out points, m.
    depth_shift : float
        Their distance along the generator from the flank node, m.
    poissons_ratio : float
    mirror : float
        Strength of the image loads behind both free end faces; 0 for none.

    Returns
    -------
    ndarray (f l, f l)
        Row: read-out node, column: load node, both numbered ``flank node * l + layer``; the factor
        (1 + nu) / (2 pi E) is left out, 1/m.
    """
    n_roll, n_axial = len(roll), len(axial)
    result = np.zeros((n_roll * n_axial, n_roll * n_axial))
    weight_sum = np.zeros(n_roll * n_axial)
    gauss = 0.5 / math.sqrt(3.0)  # two-point Gauss rule, from the middle of a part of length 1
    # The image of a load at z behind the face at z_end is at 2 z_end - z.
    ends = (2.0 * axial[0], 2.0 * axial[-1])
    for quad_roll in range(n_roll - 1):
        roll_step = roll[quad_roll + 1] - roll[quad_roll]
        roll_length = base_radius * 0.5 * (roll[quad_roll] + roll[quad_roll + 1]) * roll_step
        # 1/R changes over the depth: parts of half of it are fine enough for two points each way.
        cuts_roll = max(1, int(math.ceil(roll_length / (0.5 * depth))))
        for quad_axial in range(n_axial - 1):
            axial_step = axial[quad_axial + 1] - axial[quad_axial]
            cuts_axial = max(1, int(math.ceil(axial_step / (0.5 * depth))))
            for part_roll in range(2 * cuts_roll):
                sign_roll = 1.0 if part_roll % 2 else -1.0
                s = (part_roll // 2 + 0.5 + sign_roll * gauss) / cuts_roll
                load_roll = roll[quad_roll] + s * roll_step
                for part_axial in range(2 * cuts_axial):
                    sign_axial = 1.0 if part_axial % 2 else -1.0
                    t = (part_axial // 2 + 0.5 + sign_axial * gauss) / cuts_axial
                    load_axial = axial[quad_axial] + t * axial_step
                    # dA = r_b phi dphi dz / cos(beta_b); constant factors cancel against the sum of the weights.
                    area = load_roll / (cuts_roll * cuts_axial) * roll_step * axial_step
                    corner = quad_roll * n_axial + quad_axial
                    # A load on the quadrilateral belongs to its four corners by their bilinear shape functions.
                    columns = (corner, corner + 1, corner + n_axial, corner + n_axial + 1)
                    weights = (area * (1 - s) * (1 - t), area * (1 - s) * t, area * s * (1 - t), area * s * t)
                    for k in range(4):
                        weight_sum[columns[k]] += weights[k]
                    for i in range(n_roll):
                        mean_roll = 0.5 * (roll[i] + load_roll)
                        for j in range(n_axial):
                            apart = axial[j] - load_axial
                            across = base_radius * mean_roll * (roll[i] - load_roll - lead * apart)
                            along = apart / base_helix_cosine + depth_shift
                            value = interior_normal_displacement(across, along, depth, poissons_ratio)
                            if mirror != 0.0:
                                for end in ends:
                                    image = (axial[j] + load_axial - end) / base_helix_cosine + depth_shift
                                    value += mirror * interior_normal_displacement(across, image, depth, poissons_ratio)
                            row = i * n_axial + j
                            for k in range(4):
                                result[row, columns[k]] += weights[k] * value
    return result / weight_sum


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
