"""Outer surface of a solid, which radiates sound, and the matrix of its normal motion.

The matrix is E = int (n . u)(n . u)^T dA. A housing is wetted inside and outside, and only the outside radiates.
Bearings and shafts close its bores: flat discs that move with a seat close both ends of a cylindrical seat, and the
opening of a flat ring. Parts of discs inside the solid or on it do not count. The outside is then found by flooding a
grid of voxels from its corner: a point of the surface is outside if the first free voxel along its normal is flooded.

With peak amplitudes q of the coordinates of the reduced body at the angular frequency w, the mean square of the normal
velocity over the outer surface is w^2 q^H E q / (2 area). The equivalent radiated power (ERP) follows from it, see
`exugear.results.sound.radiated_power`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from exugear.system.bodies.lazy import lazy_import
from exugear.system.bodies.reduction import RadiatingSurface, symmetric
from exugear.system.bodies.solid_elements import SolidSeat, facet_nodes
from exugear.system.kernels.coordinates import AXIAL, BODY_SIZE, TILT
from fe_ste.tools.arrays import Booleans, Floats, Integers

if TYPE_CHECKING:
    import skfem
else:
    skfem = lazy_import("skfem")

VOXELS = 160
"""Voxels along the longest side of the solid; the outer area of the GRC housing changes by 0.6 % from 120 to 160."""
MARGIN = 3
"""Free voxels around the solid."""
SAMPLES_PER_VOXEL = 2
"""Points of the surface per side of a voxel that mark voxels as solid."""
STEPS_OUT = (1.0, 1.5, 2.0, 2.5, 3.0)
"""Distances from the surface along its normal, in voxels, at which a free voxel is looked for."""
DISC_RINGS, DISC_ANGLES = 48, 25
"""Integration points of a disc: rings of equal area, exact for its area and second moments, and angles."""
BESIDE_DISC = 1e-3
"""Distance from a disc, as a share of its radius, at which the solid is looked for."""
FLAT_PARTS = {
    6: np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]),
    9: np.array([[0, 4, 8], [4, 1, 8], [1, 5, 8], [5, 2, 8], [2, 6, 8], [6, 3, 8], [3, 7, 8], [7, 0, 8]]),
}
"""Nodes of the flat triangles that replace a curved facet, by its number of nodes."""
FACETS_AT_A_TIME = 2000
"""Facets whose normal displacements are held together."""


@dataclass(frozen=True)
class Disc:
    """A flat disc across z that closes an opening and moves with seats."""

    centre: tuple[float, float, float]
    """(3,) m."""
    radius: float
    """In m."""
    seats: tuple[int, ...]
    """Seats whose mean motion it has: one, or all sectors of a ring."""

    @property
    def points(self) -> Floats:
        """Integration points (p, 3), m, each of the area pi r^2 / p."""
        angles = 2.0 * np.pi * (np.arange(DISC_ANGLES) + 0.37) / DISC_ANGLES  # not on lines of a regular mesh
        radii = self.radius * np.sqrt((np.arange(DISC_RINGS) + 0.5) / DISC_RINGS)
        x, y = (np.outer(radii, direction(angles)).ravel() for direction in (np.cos, np.sin))
        return np.asarray(np.stack([x, y, np.zeros_like(x)], axis=1) + self.centre)

    @property
    def point_area(self) -> float:
        """Area of each point, m2."""
        return float(np.pi) * self.radius**2 / (DISC_RINGS * DISC_ANGLES)

    def rows(self, points: Floats, size: int) -> Floats:
        """Axial displacement at points (p, 3) of it, per coordinate (p, size): u_z + tilt_x y - tilt_y x."""
        found = np.zeros((len(points), size))
        x, y = (points - np.asarray(self.centre)).T[:2]
        for seat in self.seats:
            first = BODY_SIZE * seat
            found[:, first + AXIAL] = 1.0 / len(self.seats)
            found[:, first + TILT] = y / len(self.seats)
            found[:, first + TILT + 1] = -x / len(self.seats)
        return found


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Integration points of the boundary of a mesh; f facets of k nodes, q points each."""

    nodes: Integers
    """(f, k)"""
    values: Floats
    """(k, q) of the shape functions."""
    places: Floats
    """(f, q, 3) m."""
    normals: Floats
    """(f, q, 3) outward, of unit length."""
    areas: Floats
    """(f, q) m2."""


def radiating_surface(
    mesh: Any, seats: Sequence[SolidSeat], modes: Floats, band: float, closed: bool = True
) -> RadiatingSurface:
    """Return the outer surface of a reduced solid.

    Parameters
    ----------
    mesh : skfem.MeshTet2 or skfem.MeshHex2, m
    seats : in the order of the coordinates, six of each first
    modes : (3 nodes, n) displacement per coordinate
    band : cut-off frequency of the reduction, Hz
    closed : whether discs close the openings at the seats

    Examples
    --------
    A cube that moves along z radiates from two of its six faces:

    >>> mesh = skfem.MeshHex2.from_mesh(skfem.MeshHex.init_tensor(*[np.linspace(0.0, 0.5, 3)] * 3))
    >>> along_z = np.kron(np.ones((mesh.doflocs.shape[1], 1)), np.array([[0.0], [0.0], [1.0]]))
    >>> surface = radiating_surface(mesh, (), along_z, 1000.0)
    >>> round(surface.area, 12), surface.matrix.round(12)
    (1.5, array([[0.5]]))
    """
    nodes = facet_nodes(mesh, np.asarray(mesh.boundary_facets()))
    element = skfem.ElementTriP2() if nodes.shape[1] == 6 else skfem.ElementQuad2()
    at, weights = skfem.quadrature.get_quadrature(element, 5)
    functions = [element.lbasis(at, number) for number in range(nodes.shape[1])]
    values = np.stack([value for value, _ in functions])
    at_nodes = np.asarray(mesh.doflocs).T[nodes]
    tangents = np.einsum("fka,kbq->bfqa", at_nodes, np.stack([slope for _, slope in functions]), optimize=True)
    across = np.cross(tangents[0], tangents[1])
    sizes = np.linalg.norm(across, axis=2)
    places = np.einsum("fka,kq->fqa", at_nodes, values, optimize=True)
    surface = SurfacePoints(nodes, values, places, across / sizes[..., None], sizes * weights)
    discs = _discs(seats) if closed else ()
    air = _OutsideAir.around(mesh, surface.nodes, discs)
    outer = air.reaches(surface.places, surface.normals)
    matrix = _integral(surface, outer, modes)
    area = float(surface.areas[outer].sum())
    triangles = np.asarray(mesh.doflocs).T[surface.nodes[:, FLAT_PARTS[surface.nodes.shape[1]]]].reshape(-1, 3, 3)
    for disc in discs:
        points = disc.points
        beside = BESIDE_DISC * disc.radius
        free = ~_inside(points, triangles, disc.centre[2], beside)
        for side in (-1.0, 1.0):
            normals = np.broadcast_to([0.0, 0.0, side], points.shape)
            counted = points[free & air.reaches(points, normals)]
            rows = disc.rows(counted, modes.shape[1])
            matrix += disc.point_area * rows.T @ rows
            area += disc.point_area * len(counted)
    return RadiatingSurface(symmetric(matrix), area, float(surface.areas.sum()), band)


def _integral(surface: SurfacePoints, outer: Booleans, modes: Floats) -> Floats:
    """Integral of (n . u)(n . u)^T over the outer points (f, q), (n, n)."""
    size = modes.shape[1]
    found = np.zeros((size, size))
    for start in range(0, len(outer), FACETS_AT_A_TIME):
        chosen = slice(start, start + FACETS_AT_A_TIME)
        facet, point = np.nonzero(outer[chosen])
        if not facet.size:
            continue
        nodes = surface.nodes[chosen][facet]
        normals = surface.normals[chosen][facet, point]
        weights = np.sqrt(surface.areas[chosen][facet, point])
        entries = (weights[:, None] * surface.values.T[point])[:, :, None] * normals[:, None, :]
        columns = 3 * nodes[:, :, None] + np.arange(3)
        ends = np.arange(len(facet) + 1) * columns[0].size
        rows = scipy.sparse.csr_array((entries.ravel(), columns.ravel(), ends), shape=(len(facet), len(modes)))
        displacement = rows @ modes
        found += displacement.T @ displacement
    return found


def _discs(seats: Sequence[SolidSeat]) -> tuple[Disc, ...]:
    """Discs that close the openings at seats; the sectors of a ring share theirs."""
    sharing: dict[tuple[float, ...], list[int]] = {}
    for number, seat in enumerate(seats):
        x, y, z = seat.centre
        radius = seat.radius if seat.width > 0.0 else seat.inner_radius
        for end in {-seat.width / 2.0, seat.width / 2.0} if radius > 0.0 else ():
            sharing.setdefault((x, y, z + end, radius), []).append(number)
    return tuple(Disc((x, y, z), radius, tuple(own)) for (x, y, z, radius), own in sorted(sharing.items()))


def _inside(points: Floats, triangles: Floats, z: float, beside: float) -> Booleans:
    """Whether the solid is directly below or above points (p, 3) in a plane z: crossings of a line along z are odd.

    Triangles (t, 3, 3) of the whole surface.
    """
    low = triangles[:, :, :2].min(axis=1)
    high = triangles[:, :, :2].max(axis=1)
    near = ((high > points[:, :2].min(axis=0)) & (low < points[:, :2].max(axis=0))).all(axis=1)
    first, second, third = triangles[near].transpose(1, 0, 2)
    one = second - first
    two = third - first
    determinant = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    upright = np.abs(determinant) > 0.0
    first, one, two, determinant = first[upright], one[upright], two[upright], determinant[upright]
    above = np.zeros((2, len(points)), dtype=np.int64)
    for number, (x, y, _) in enumerate(points):
        away_x = x - first[:, 0]
        away_y = y - first[:, 1]
        a = (away_x * two[:, 1] - away_y * two[:, 0]) / determinant
        b = (one[:, 0] * away_y - one[:, 1] * away_x) / determinant
        hit = (a >= 0.0) & (b >= 0.0) & (a + b < 1.0)
        heights = first[hit, 2] + a[hit] * one[hit, 2] + b[hit] * two[hit, 2]
        above[:, number] = [np.count_nonzero(heights > z - beside), np.count_nonzero(heights > z + beside)]
    return np.asarray((above % 2 == 1).any(axis=0))


@dataclass(frozen=True, eq=False)
class _OutsideAir:
    """Voxels that are free, and those of them that are connected with the outside."""

    origin: Floats
    """(3,) corner of the first voxel, m."""
    size: float
    """Side of a voxel, m."""
    blocked: Booleans
    """(x, y, z) where the surface passes."""
    flooded: Booleans
    """(x, y, z) connected with the outside through sides of voxels."""

    @classmethod
    def around(cls, mesh: Any, nodes: Integers, discs: Sequence[Disc]) -> _OutsideAir:
        """Flood the air around a solid from the first corner of a box about it."""
        import scipy.ndimage

        places = np.asarray(mesh.doflocs).T
        low = places.min(axis=0)
        size = float((places.max(axis=0) - low).max()) / VOXELS
        origin = low - MARGIN * size
        shape = np.ceil((places.max(axis=0) - origin) / size).astype(np.int64) + MARGIN
        blocked = np.zeros(shape, dtype=bool)
        for points in (
            *_samples(places[nodes], size / SAMPLES_PER_VOXEL),
            *(_disc_samples(own, size) for own in discs),
        ):
            at = np.floor((points - origin) / size).astype(np.int64)
            at = at[((at >= 1) & (at < shape - 1)).all(axis=1)]
            blocked[tuple(at.T)] = True
        labels, _ = scipy.ndimage.label(~blocked)
        return cls(origin, size, blocked, labels == labels[0, 0, 0])

    def reaches(self, places: Floats, normals: Floats) -> Booleans:
        """Whether the first free voxel along normals (..., 3) from places (..., 3) is connected with the outside."""
        found = np.zeros(places.shape[:-1], dtype=bool)
        open_ = np.ones_like(found)
        for step in STEPS_OUT:
            at = np.floor((places + step * self.size * normals - self.origin) / self.size).astype(np.int64)
            at = np.clip(at, 0, np.array(self.blocked.shape) - 1)
            index = tuple(np.moveaxis(at, -1, 0))
            free = open_ & ~self.blocked[index]
            found |= free & self.flooded[index]
            open_ &= ~free
        return found


def _samples(facets: Floats, spacing: float) -> Iterator[Floats]:
    """Points (s, 3) on curved facets (f, k, 3), at most a spacing apart; facets of similar size at once."""
    corners = facets[:, : 3 if facets.shape[1] == 6 else 4]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    halvings = np.ceil(np.log2(np.maximum(longest / spacing, 1.0))).astype(np.int64)
    element = skfem.ElementTriP2() if facets.shape[1] == 6 else skfem.ElementQuad2()
    for number in np.unique(halvings):
        line = np.linspace(0.0, 1.0, 2**number + 1)
        lattice = np.stack([own.ravel() for own in np.meshgrid(line, line)])
        if facets.shape[1] == 6:
            lattice = lattice[:, lattice.sum(axis=0) < 1.0 + 1e-9]
        values = np.stack([element.lbasis(lattice, k)[0] for k in range(facets.shape[1])])
        chosen = facets[halvings == number]
        for start in range(0, len(chosen), FACETS_AT_A_TIME):
            yield np.einsum("fka,kq->fqa", chosen[start : start + FACETS_AT_A_TIME], values, optimize=True).reshape(
                -1, 3
            )


def _disc_samples(disc: Disc, size: float) -> Floats:
    """Points (s, 3) on a disc at most half a voxel apart, up to one voxel beyond its edge."""
    reach = disc.radius + size
    line = np.linspace(-reach, reach, int(np.ceil(2.0 * SAMPLES_PER_VOXEL * reach / size)) + 1)
    x, y = (own.ravel() for own in np.meshgrid(line, line))
    within = np.hypot(x, y) <= reach
    return np.asarray(np.stack([x[within], y[within], np.zeros(int(within.sum()))], axis=1) + disc.centre)
