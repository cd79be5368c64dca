"""Mortar integrals between two surfaces of quadrilaterals that do not match: weighted gaps and their derivatives.

Each facet of the first surface is projected along its normal, with every facet of the second one that it may touch,
onto the plane through its middle. Their common polygon is cut into triangles and integrated over. The multipliers
are pressures at the nodes of the first surface, interpolated as the displacements are: a force that the one surface
gives the other takes, point by point, so that no momentum is lost and a uniform pressure passes exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse

from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled
from fe_ste.tools.display import ReprMixin

#: Facets whose common part is smaller than this part of the first one are not integrated over.
_LEAST_OVERLAP = 1e-10

#: Corners a polygon cut from two quadrilaterals can have, with room for those that coincide.
_MOST_CORNERS = 16

# Six-point rule on the triangle, exact for degree 4 (G. R. Cowper, Int. J. Num. Meth. Eng. 7 (1973) 405-408).
_A, _B = 0.445948490915965, 0.091576213509771
_RULE_WEIGHTS = np.array([0.223381589678011] * 3 + [0.109951743655322] * 3)
_RULE_POINTS = np.array(
    [
        [_A, _A, 1.0 - 2.0 * _A],
        [_A, 1.0 - 2.0 * _A, _A],
        [1.0 - 2.0 * _A, _A, _A],
        [_B, _B, 1.0 - 2.0 * _B],
        [_B, 1.0 - 2.0 * _B, _B],
        [1.0 - 2.0 * _B, _B, _B],
    ]
)


def summed(numbers: Integers, values: Floats, count: int) -> Floats:
    """Add up the values that have the same number from 0, (count,).

    Examples
    --------
    >>> summed(np.array([0, 2, 0]), np.array([1.0, 2.0, 3.0]), 3).tolist()
    [4.0, 0.0, 2.0]
    """
    return np.asarray(np.bincount(numbers.ravel(), values.ravel(), minlength=count), dtype=np.float64)


@dataclass(frozen=True)
class Surface(ReprMixin, line=": {facets!n} facets"):
    """Quadrilaterals of a boundary.

    Examples
    --------
    >>> Surface(np.array([[7, 8, 3, 2]])).nodes.tolist()
    [2, 3, 7, 8]
    """

    facets: Integers
    """(k, 4) nodes, counter-clockwise seen from outside."""

    @cached_property
    def nodes(self) -> Integers:
        """Its nodes in ascending order."""
        return np.unique(self.facets)

    @cached_property
    def local(self) -> Integers:
        """Number (k, 4) of each facet's corners in `nodes`."""
        return np.searchsorted(self.nodes, self.facets)

    def normals(self, points: Floats) -> Floats:
        """Outward unit normals at `nodes`: the mean of the adjacent corners' normals, weighted by area."""
        corners = points[self.facets]
        ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
        normals = np.zeros((len(self.nodes), 3))
        np.add.at(normals, self.local, np.cross(ahead, behind))
        return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))

    def areas(self, points: Floats) -> Floats:
        """Area that belongs to each of `nodes`: a quarter of each adjacent facet, m^2."""
        corners = points[self.facets]
        diagonals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        quarter = np.linalg.norm(diagonals, axis=1) / 8.0
        return summed(self.local, np.repeat(quarter, 4), len(self.nodes))


@dataclass(frozen=True)
class WeightedGap:
    """Gap between two surfaces, weighted with the shape functions of the first one's nodes."""

    gap: Floats
    """(s,) integral of shape function times gap by node of the first surface, m^3; negative where they overlap."""
    weight: Floats
    """(s,) integral of the shape function over the part that faces the other surface, m^2."""
    gradient: scipy.sparse.csr_matrix
    """(s, 3 n) derivative of `gap` by the nodes' positions with projections and normals held, m^2."""

    @property
    def mean(self) -> Floats:
        """Mean gap by node, m; infinite where nothing faces the node."""
        facing = self.weight > 0.0
        return np.where(facing, self.gap / np.where(facing, self.weight, 1.0), np.inf)


@compiled
def _cut(polygon: Floats, count: int, window: Floats, result: Floats, spare: Floats) -> int:
    """Cut a polygon by a convex one, both counter-clockwise (Sutherland and Hodgman); the number of corners left."""
    result[:count] = polygon[:count]
    for edge in range(4):
        start, end = window[edge], window[(edge + 1) % 4]
        along_x, along_y = end[0] - start[0], end[1] - start[1]
        kept = 0
        for corner in range(count):
            corner_point, next_point = result[corner], result[(corner + 1) % count]
            # Cross product of the edge with the way to the point: positive on its left, inside.
            inside = along_x * (corner_point[1] - start[1]) - along_y * (corner_point[0] - start[0])
            inside_next = along_x * (next_point[1] - start[1]) - along_y * (next_point[0] - start[0])
            if inside >= 0.0:
                spare[kept] = corner_point
                kept += 1
            # The edge crosses the polygon between two corners strictly on either side; one on it is kept above.
            if (inside > 0.0 and inside_next < 0.0) or (inside < 0.0 and inside_next > 0.0):
                share = inside / (inside - inside_next)
                spare[kept, 0] = corner_point[0] + share * (next_point[0] - corner_point[0])
                spare[kept, 1] = corner_point[1] + share * (next_point[1] - corner_point[1])
                kept += 1
        count = kept
        result[:count] = spare[:count]
        if count < 3:
            return 0
    return count


@compiled
def _shape(s: float, t: float, values: Floats) -> None:
    values[0] = 0.25 * (1.0 - s) * (1.0 - t)
    values[1] = 0.25 * (1.0 + s) * (1.0 - t)
    values[2] = 0.25 * (1.0 + s) * (1.0 + t)
    values[3] = 0.25 * (1.0 - s) * (1.0 + t)


@compiled
def _shape_at(corners: Floats, x: float, y: float, values: Floats) -> None:
    """Bilinear shape functions of a plane quadrilateral at a point, by Newton."""
    s, t = 0.0, 0.0
    for _ in range(20):
        _shape(s, t, values)
        at_x, at_y = -x, -y
        for corner in range(4):
            at_x += values[corner] * corners[corner, 0]
            at_y += values[corner] * corners[corner, 1]
        # Jacobian of the bilinear map, inverted by hand.
        a = 0.25 * ((1.0 - t) * (corners[1, 0] - corners[0, 0]) + (1.0 + t) * (corners[2, 0] - corners[3, 0]))
        b = 0.25 * ((1.0 - s) * (corners[3, 0] - corners[0, 0]) + (1.0 + s) * (corners[2, 0] - corners[1, 0]))
        c = 0.25 * ((1.0 - t) * (corners[1, 1] - corners[0, 1]) + (1.0 + t) * (corners[2, 1] - corners[3, 1]))
        d = 0.25 * ((1.0 - s) * (corners[3, 1] - corners[0, 1]) + (1.0 + s) * (corners[2, 1] - corners[1, 1]))
        determinant = a * d - b * c
        step_s, step_t = (d * at_x - b * at_y) / determinant, (a * at_y - c * at_x) / determinant
        s -= step_s
        t -= step_t
        if abs(step_s) + abs(step_t) < 1e-14:
            break
    _shape(s, t, values)


@compiled
def _flatten(corners: Floats, origin: Floats, axes: Floats, reverse: bool, result: Floats) -> None:
    """Coordinates (4, 2) of a facet's corners in a plane; in reverse order for one that is seen from behind."""
    for corner in range(4):
        at = 3 - corner if reverse else corner
        for axis in range(2):
            total = 0.0
            for k in range(3):
                total += axes[axis, k] * (corners[at, k] - origin[k])
            result[corner, axis] = total


@compiled
def _plane(corners: Floats, origin: Floats, axes: Floats) -> float:
    """Middle, two axes and normal of a facet's plane; its area."""
    for k in range(3):
        origin[k] = 0.25 * (corners[0, k] + corners[1, k] + corners[2, k] + corners[3, k])
    # The diagonals span the mean plane of a warped facet, and their cross product is twice its area.
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    twice_area = np.sqrt(np.sum(normal**2))
    axes[2] = normal / twice_area
    along = corners[1] - corners[0]
    along = along - np.sum(along * axes[2]) * axes[2]
    axes[0] = along / np.sqrt(np.sum(along**2))
    axes[1] = np.cross(axes[2], axes[0])
    return float(0.5 * twice_area)


@compiled
def _integrate_pairs(
    points: Floats,
    first: Integers,
    second: Integers,
    pairs: Integers,
    normals: Floats,
    rule_points: Floats,
    rule_weights: Floats,
    gaps: Floats,
    weights: Floats,
    gradients: Floats,
) -> None:
    """Weighted gaps (p, 4), weights (p, 4) and gradients (p, 4, 8, 3) of pairs of facets.

    ``normals`` (k, 4, 3) are those at the corners of the first facets.
    """
    origin, axes = np.empty(3), np.empty((3, 3))
    flat_one, flat_two = np.empty((4, 2)), np.empty((4, 2))
    polygon, spare = np.empty((_MOST_CORNERS, 2)), np.empty((_MOST_CORNERS, 2))
    shape_one, shape_two, reversed_two = np.empty(4), np.empty(4), np.empty(4)
    normal, apart, triangle = np.empty(3), np.empty(3), np.empty((3, 2))
    for number in range(len(pairs)):
        nodes_one, nodes_two = first[pairs[number, 0]], second[pairs[number, 1]]
        corners_one, corners_two = points[nodes_one], points[nodes_two]
        area = _plane(corners_one, origin, axes)
        _flatten(corners_one, origin, axes, False, flat_one)
        _flatten(corners_two, origin, axes, True, flat_two)
        count = _cut(flat_two, 4, flat_one, polygon, spare)
        if count == 0:
            continue
        # Triangles from the middle: the polygon is convex, so all have positive area.
        middle_x, middle_y = np.mean(polygon[:count, 0]), np.mean(polygon[:count, 1])
        for corner in range(count):
            triangle[0, 0], triangle[0, 1] = middle_x, middle_y
            triangle[1] = polygon[corner]
            triangle[2] = polygon[(corner + 1) % count]
            size = 0.5 * (
                (triangle[1, 0] - middle_x) * (triangle[2, 1] - middle_y)
                - (triangle[2, 0] - middle_x) * (triangle[1, 1] - middle_y)
            )
            if size < _LEAST_OVERLAP * area:
                continue
            for point in range(len(rule_weights)):
                x, y = 0.0, 0.0
                for k in range(3):
                    x += rule_points[point, k] * triangle[k, 0]
                    y += rule_points[point, k] * triangle[k, 1]
                _shape_at(flat_one, x, y, shape_one)
                _shape_at(flat_two, x, y, reversed_two)
                for k in range(4):
                    shape_two[k] = reversed_two[3 - k]  # back in the order of the second facet's nodes
                # Gap along the interpolated normal, from the point of the first surface to that of the second.
                length = 0.0
                for axis in range(3):
                    normal[axis], apart[axis] = 0.0, 0.0
                    for k in range(4):
                        normal[axis] += shape_one[k] * normals[pairs[number, 0], k, axis]
                        apart[axis] += shape_two[k] * corners_two[k, axis] - shape_one[k] * corners_one[k, axis]
                    length += normal[axis] ** 2
                length = np.sqrt(length)
                gap = 0.0
                for axis in range(3):
                    normal[axis] /= length
                    gap += normal[axis] * apart[axis]
                for a in range(4):
                    weight = size * rule_weights[point] * shape_one[a]
                    gaps[number, a] += weight * gap
                    weights[number, a] += weight
                    for b in range(4):
                        for axis in range(3):
                            # Virtual gap: the second surface's point moves away, the first one's towards it. Its
                            # transpose distributes pressures with equal and opposite sums.
                            gradients[number, a, b, axis] -= weight * shape_one[b] * normal[axis]
                            gradients[number, a, 4 + b, axis] += weight * shape_two[b] * normal[axis]


@compiled
def _facing_pairs(points: Floats, first: Integers, second: Integers, reach: float) -> Integers:
    """Pairs of facets whose boxes come within `reach` and whose normals point against each other."""
    count_one, count_two = len(first), len(second)
    low, high = np.empty((count_two, 3)), np.empty((count_two, 3))
    normals = np.empty((count_two, 3))
    for facet_two in range(count_two):
        corners = points[second[facet_two]]
        for axis in range(3):
            low[facet_two, axis], high[facet_two, axis] = corners[:, axis].min(), corners[:, axis].max()
        normals[facet_two] = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    pairs = np.empty((64, 2), dtype=np.int64)
    used = 0
    for facet_one in range(count_one):
        corners = points[first[facet_one]]
        normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
        for facet_two in range(count_two):
            near = True
            for axis in range(3):
                if (
                    corners[:, axis].min() - reach > high[facet_two, axis]
                    or corners[:, axis].max() + reach < low[facet_two, axis]
                ):
                    near = False
                    break
            # Facets whose normals agree belong to the backs of teeth.
            if not near or np.sum(normal * normals[facet_two]) >= 0.0:
                continue
            if used == len(pairs):  # compiled code has no growing list of rows
                larger = np.empty((2 * used, 2), dtype=np.int64)
                larger[:used] = pairs
                pairs = larger
            pairs[used, 0], pairs[used, 1] = facet_one, facet_two
            used += 1
    return pairs[:used]


def facing_pairs(points: Floats, first: Surface, second: Surface, reach: float) -> Integers:
    """Pairs (p, 2) of facets of two surfaces that come within `reach` (m) of each other, face to face."""
    return np.asarray(_facing_pairs(points, first.facets, second.facets, reach))


def weighted_gap(points: Floats, first: Surface, second: Surface, pairs: Integers) -> WeightedGap:
    """Integrate the gap between two surfaces.

    Parameters
    ----------
    points : (n, 3) positions of all nodes, m
    first : the one whose nodes carry the multipliers
    pairs : (p, 2) facets that may touch, see `facing_pairs`

    Notes
    -----
    The gap is measured along the nodes' mean normals, interpolated; point and counterpart lie on a normal of the first
    facet's plane. Segments as in M. A. Puso, T. A. Laursen, Comput. Methods Appl. Mech. Eng. 193 (2004) 601-629.
    """
    count = len(pairs)
    gaps, weights, gradients = np.zeros((count, 4)), np.zeros((count, 4)), np.zeros((count, 4, 8, 3))
    normals = np.ascontiguousarray(first.normals(points)[first.local])
    _integrate_pairs(
        points, first.facets, second.facets, pairs, normals, _RULE_POINTS, _RULE_WEIGHTS, gaps, weights, gradients
    )
    rows = first.local[pairs[:, 0]]
    nodes = np.concatenate([first.facets[pairs[:, 0]], second.facets[pairs[:, 1]]], axis=1)
    columns = np.broadcast_to((3 * nodes[:, :, None] + np.arange(3))[:, None], gradients.shape)
    by_row = np.broadcast_to(rows[:, :, None, None], gradients.shape)
    size = len(first.nodes)
    gradient = scipy.sparse.csr_matrix(
        (gradients.ravel(), (by_row.ravel(), columns.ravel())), shape=(size, points.size)
    )
    return WeightedGap(
        gap=summed(rows, gaps, size),
        weight=summed(rows, weights, size),
        gradient=gradient,
    )
