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

from fe_ste.geometry.profile import cubic_coefficients, cubic_knots, cubic_matrix
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled

#: Gauss rule of three points over 0 to 1.
_PLACES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_SHARES = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)

#: Image loads of a wedge: for each of two the logarithms of its strength and of the number before the squares, and half
#: the number before the product over that before the squares; each as powers 0 to 4 of the angle less 90 degrees, in
#: 35 degrees, and 0.05 of Poisson's ratio beyond 0.3 times powers 0 to 2 of it.
_WEDGE = np.array(
    [
        [0.3459, -1.9248, -0.2535, -0.1835, -0.0365, 0.1261, 0.0760, 0.0506],
        [0.3119, 0.2286, 0.0129, -0.0746, -0.0537, -0.0808, 0.0149, 0.0719],
        [0.1877, 0.1984, -0.1252, -0.0464, -0.0143, 0.0882, 0.0616, 0.0214],
        [-0.1880, -1.7776, 0.3032, -0.1381, -0.0409, -0.1914, -0.0507, 0.0491],
        [2.2036, 0.5111, -0.5515, 0.0215, 0.1441, 0.0294, 0.0952, -0.1208],
        [0.8966, 0.0273, 0.5297, -0.0243, -0.1599, -0.0567, -0.0601, 0.1681],
    ]
)

#: Part of a quadrilateral's sides below which it is not halved any more: 1e-3 of the integral is left in such a part.
_LEAST_PART = 2e-3


@compiled
def interior_displacement(
    places: Floats, loads: Floats, columns: Integers, shares: Floats, count: int, poissons_ratio: float
) -> Floats:
    """Evaluate the displacement inside a half-space under normal point loads.

    Boussinesq: u = (1 + nu) / (2 pi E) [z/R^3 - (1 - 2 nu)/(R (R + z))] (x, y) in the surface and
    w = (1 + nu) / (2 pi E) [z^2/R^3 + 2 (1 - nu)/R] into it; the factor (1 + nu) / (2 pi E) is left out.

    Parameters
    ----------
    places : (n, 3) x and y in the surface, z into it, m; no load's own place
    loads : (m, 2) places of the loads in the surface, m
    columns : (m,) load case of each load; it has a part in the one after that, too
    shares : (m, 2) force of the load in either
    count : load cases

    Returns
    -------
    (n, 3, count) 1/m

    References
    ----------
    K. L. Johnson, Contact Mechanics, 1985, eq. (3.18).
    """
    result = np.zeros((len(places), 3, count))
    for n in range(len(places)):
        depth = places[n, 2]
        for m in range(len(loads)):
            x = places[n, 0] - loads[m, 0]
            y = places[n, 1] - loads[m, 1]
            distance = math.sqrt(x * x + y * y + depth * depth)
            outward = depth / distance**3 - (1.0 - 2.0 * poissons_ratio) / (distance * (distance + depth))
            inward = depth * depth / distance**3 + 2.0 * (1.0 - poissons_ratio) / distance
            for k in range(2):
                column = columns[m] + k
                share = shares[m, k]
                result[n, 0, column] += share * outward * x
                result[n, 1, column] += share * outward * y
                result[n, 2, column] += share * inward
    return result


def wedge_images(angle: float, poissons_ratio: float) -> Floats:
    """Image loads that make of a half-space a wedge, loaded on one face and free on the other.

    The face of the wedge moves under a unit normal load by (1 - nu^2) / (pi E) times 1 / R and, for each image, its
    strength over sqrt(s^2 + b (d^2 + d'^2) + c d d'): s is the distance along the edge, d and d' are those of the two
    points from it. Two images are fitted to the wedge's displacement by quadratic finite elements
    (``benchmarks/truth/wedge.py``), within 2 % of what the end adds. Beyond 55 to 125 degrees and Poisson's ratios of
    0.25 to 0.35 the images are those at these bounds.

    Parameters
    ----------
    angle : between the faces, rad

    Returns
    -------
    (2, 3) of each image its strength, b and c

    Examples
    --------
    An acute edge is softer than an obtuse one, where loads have the weaker images.

    >>> acute, obtuse = (wedge_images(np.radians(angle), 0.3) for angle in (70.0, 110.0))
    >>> bool((acute[:, 0] > 5.0 * obtuse[:, 0]).all())
    True
    """
    beyond = np.clip((np.degrees(angle) - 90.0) / 35.0, -1.0, 1.0)
    ratio = np.clip((poissons_ratio - 0.3) / 0.05, -1.0, 1.0)
    found = (_WEDGE @ np.concatenate([beyond ** np.arange(5), ratio * beyond ** np.arange(3)])).reshape(2, 3)
    strength = np.exp(found[:, 0])
    squares = np.exp(found[:, 1])
    return np.stack([strength, squares, 2.0 * squares * found[:, 2]], axis=-1)


@compiled
def _weighted_difference(x: float, high: float, low: float, to_high: float, to_low: float) -> float:
    """Evaluate x [asinh(high / |x|) - asinh(low / |x|)] with one logarithm; ``to_high`` is hypot(x, high)."""
    # asinh(h / |x|) = log((h + hypot(x, h)) / |x|). For a negative h the sum would cancel, but asinh is odd.
    if x == 0.0:
        return 0.0
    above = abs(high) + to_high
    below = abs(low) + to_low
    if (high < 0.0) == (low < 0.0):
        return x * math.log(above / below) if high >= 0.0 else x * math.log(below / above)
    return x * math.log(above * below / (x * x))


@compiled
def rectangle_integral(across: float, along: float, half_across: float, half_along: float) -> float:
    """Integral of 1 / distance over a rectangle, seen from a point of the surface (Love's uniform pressure).

    The surface displacement under a uniform pressure p is p (1 - nu^2) / (pi E) times this.

    Parameters
    ----------
    across, along : position of the point from the middle of the rectangle, m
    half_across, half_along : half sides of the rectangle, m

    Returns
    -------
    the integral, m

    References
    ----------
    A. E. H. Love, Phil. Trans. R. Soc. A 228 (1929) 377-420; Johnson, Contact Mechanics, eq. (3.25).
    """
    # Johnson's four logarithms, joined in pairs: sides right and left by the height, top and bottom by the breadth.
    right = across + half_across
    left = across - half_across
    top = along + half_along
    bottom = along - half_along
    right_top = math.hypot(right, top)
    right_bottom = math.hypot(right, bottom)
    left_top = math.hypot(left, top)
    left_bottom = math.hypot(left, bottom)
    return (
        _weighted_difference(right, top, bottom, right_top, right_bottom)
        - _weighted_difference(left, top, bottom, left_top, left_bottom)
        + _weighted_difference(top, right, left, right_top, left_top)
        - _weighted_difference(bottom, right, left, right_bottom, left_bottom)
    )


@compiled
def tent_integrals(
    roll: Floats, axial: Floats, base_radius: float, lead: float, base_helix_cosine: float, images: Floats
) -> Floats:
    """Mean of 1 / distance over bilinear ("tent") loads on the flank nodes, seen from the flank nodes.

    The surface displacement under a unit tent load is (1 - nu^2) / (pi E) times this.

    Parameters
    ----------
    roll, axial : (f,), (l,) roll angles (rad) and axial positions (m) of the flank grid
    lead : d phi / d z along a generator, rad/m
    base_helix_cosine : cos(beta_b)
    images : (2, n, 3) of the lower and the upper end: strength and place of each image load, see `wedge_images`

    Returns
    -------
    (f l, f l) row: read-out node, column: load node, both numbered ``flank node * l + layer``, 1/m
    """
    n_roll = len(roll)
    n_axial = len(axial)
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
                _add_quadrilateral(corners, place, quad, metric, place[1], 1.0, 0.0)
                for k in range(4):
                    result[read, columns[k]] += corners[k]
                for end in range(2):
                    for image in images[end]:
                        if image[0] != 0.0:
                            corners[:] = 0.0
                            _add_quadrilateral(corners, place, quad, metric, axial[-end], image[1], image[2])
                            for k in range(4):
                                result[read, columns[k]] += image[0] * corners[k]
            # Areas of the tents: r_b phi dphi dz, constant factors left out; exact for a tent times phi.
            near = quad[0] / 3.0 + (quad[0] + quad[2]) / 6.0
            far = quad[0] / 6.0 + (quad[0] + quad[2]) / 3.0
            for k in range(4):
                weight_sum[columns[k]] += 0.5 * quad[2] * quad[3] * (near if k < 2 else far)
    return result / weight_sum


@compiled
def _add_quadrilateral(
    corners: Floats,
    place: tuple[float, float],
    quad: tuple[float, float, float, float],
    metric: tuple[float, float, float],
    end: float,
    squares: float,
    product: float,
) -> None:
    """Add the integrals of the four bilinear shape functions over distance.

    The square of the distance along is ``squares`` (d^2 + d'^2) + ``product`` d d', d and d' being the distances of the
    place and the load from the end. The quadrilateral (first roll angle and axial position, their steps) is halved
    towards the place until its parts are small against their distance, and each part integrated by three Gauss points
    each way.
    """
    base_radius, lead, cosine = metric
    roll, axial, roll_step, axial_step = quad
    own = place[1] - end
    stretch = math.sqrt(max(squares, 0.5 * squares + 0.25 * product))
    stack = np.empty((256, 4))
    stack[0] = np.array([0.0, 0.0, 1.0, 1.0])
    held = 1
    while held > 0:
        held -= 1
        s, t, width, height = stack[held]
        phi = roll + (s + width / 2) * roll_step
        z = axial + (t + height / 2) * axial_step
        across = base_radius * 0.5 * (place[0] + phi) * (place[0] - phi - lead * (place[1] - z))
        along = math.sqrt(squares * (own * own + (z - end) ** 2) + product * own * (z - end)) / cosine
        breadth = abs(base_radius * phi * roll_step * width)
        length = stretch * axial_step * height / cosine
        if max(breadth, length) > 0.5 * math.hypot(across, along) and max(width, height) > _LEAST_PART:
            halves_roll = 1 if length > 2.0 * breadth else 2
            halves_axial = 1 if breadth > 2.0 * length else 2
            width = width / halves_roll
            height = height / halves_axial
            for k in range(halves_roll):
                for m in range(halves_axial):
                    stack[held, 0], stack[held, 1] = s + k * width, t + m * height
                    stack[held, 2], stack[held, 3] = width, height
                    held += 1
            continue
        for k in range(3):
            for m in range(3):
                p = s + _PLACES[k] * width
                q = t + _PLACES[m] * height
                phi = roll + p * roll_step
                z = axial + q * axial_step
                across = base_radius * 0.5 * (place[0] + phi) * (place[0] - phi - lead * (place[1] - z))
                square = (squares * (own * own + (z - end) ** 2) + product * own * (z - end)) / (cosine * cosine)
                area = _SHARES[k] * _SHARES[m] * width * height * phi * roll_step * axial_step
                value = area / math.sqrt(across * across + square)
                corners[0] += value * (1 - p) * (1 - q)
                corners[1] += value * (1 - p) * q
                corners[2] += value * p * (1 - q)
                corners[3] += value * p * q


def tent_weights(roll: Floats, axial: Floats) -> Floats:
    """Share of each flank node in the consistent nodal load of each tent load.

    Parameters
    ----------
    roll, axial : (f,), (l,) flank grid

    Returns
    -------
    (f l, f l) row: node, column: tent; columns sum to 1

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


def tent_means(nodes: Floats, places: Floats) -> Floats:
    """Means over tent loads along the profile of the cubic splines that are 1 at one node and 0 at the others.

    Parameters
    ----------
    nodes : (f,) roll angles
    places : (f,) arc lengths of the nodes, over which the splines are laid; squares of the roll angles but for a factor

    Returns
    -------
    (f, f) row: node of the spline, column: tent

    Examples
    --------
    Tents at the two ends of the profile lie inwards of their nodes.

    >>> roll = np.linspace(1.0, 2.0, 6)
    >>> bool(roll @ tent_means(roll, roll**2)[:, 0] > 1.05)
    True
    """
    knots = cubic_knots(places)
    splines = cubic_coefficients(places, knots)
    points, shares = np.polynomial.legendre.leggauss(4)
    means = np.zeros((len(nodes), len(nodes)))
    total = np.zeros(len(nodes))
    for left in range(len(nodes) - 1):
        within = (points + 1.0) / 2.0
        at = nodes[left] + within * (nodes[left + 1] - nodes[left])
        values = cubic_matrix(np.interp(at**2, nodes**2, places), knots) @ splines
        for tent, part in ((left, 1.0 - within), (left + 1, within)):
            weight = shares * part * at * (nodes[left + 1] - nodes[left])
            means[:, tent] += weight @ values
            total[tent] += weight.sum()
    return np.asarray(means / total)


def _line_mass(nodes: Floats, weight: Floats) -> Floats:
    """Mass matrix of linear elements with a density that is linear between its nodal values `weight`."""
    mass = np.zeros((len(nodes), len(nodes)))
    for left in range(len(nodes) - 1):
        length, (a, b) = nodes[left + 1] - nodes[left], weight[left : left + 2]
        # Integrals of two linear shape functions with a linear weight, exact.
        block = length / 12.0 * np.array([[3 * a + b, a + b], [a + b, a + 3 * b]])
        mass[left : left + 2, left : left + 2] += block
    return mass
