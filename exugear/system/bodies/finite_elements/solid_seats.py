"""Seats on meshed solids: bands of cylinders and flat rings, each with the rigid motion nearest to its surface's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.system.bodies.finite_elements.lazy import at_first_use
from exugear.system.bodies.finite_elements.second_order import SolidError, entity_numbers
from exugear.system.bodies.finite_elements.solid_facets import ordered_corners
from exugear.system.bodies.finite_elements.solid_matrices import Solid
from fe_ste.tools.arrays import Floats, Integers

if TYPE_CHECKING:
    import skfem
else:
    skfem = at_first_use("skfem")


SURFACE_TOLERANCE = 1e-3
"""Distance from a seat's surface, as a share of its radius, up to which a corner lies on it."""


@dataclass(frozen=True)
class SolidSeat:
    """Where something sits on a solid: a band of a cylinder along z, or a flat ring across z."""

    name: str
    centre: tuple[float, float, float]
    """(3,) on the axis of the cylinder, in the middle of the band; m."""
    radius: float
    """Of the cylinder, or outer radius of the flat ring, m."""
    width: float = 0.0
    """Of the band, m; 0 for a flat ring."""
    inner_radius: float = 0.0
    """Of a flat ring, m."""
    sector: tuple[float, float] | None = None
    """Middle and extent (rad) of the part around the axis that belongs to it; all of it by default."""


def seat_rows(solid: Solid, seats: Sequence[SolidSeat]) -> Floats:
    """Seat coordinates as averages of the unknowns, (6 s, 3 n): the rigid motion nearest to the surface's.

    Nearest means least square distance over the area of the seat's facets, so that loads on a seat spread evenly.

    Raises
    ------
    SolidError
        No seat, a seat without facets, or two seats that share some.
    """
    if not seats:
        raise SolidError("a body needs at least one seat")
    facets = {seat.name: _facets(solid.mesh, seat) for seat in seats}
    taken: dict[int, str] = {}  # seat by facet
    for name, numbers in facets.items():
        if not numbers.size:
            raise SolidError(f"seat {name}: no face of the mesh lies on it")
        shared = next((taken[n] for n in numbers.tolist() if n in taken), None)
        if shared is not None:
            raise SolidError(f"seats {shared} and {name} share faces; move or narrow one")
        taken |= dict.fromkeys(numbers.tolist(), name)
    return np.concatenate([_rows(solid.mesh, facets[seat.name], np.array(seat.centre)) for seat in seats])


def _facets(mesh: Any, seat: SolidSeat) -> Integers:
    """Numbers of the facets on a seat's surface."""
    points = np.asarray(mesh.p)[:, np.asarray(mesh.facets)] - np.reshape(seat.centre, (3, 1, 1))
    points = points[:, : 3 if mesh.t.shape[0] == 4 else 4]
    radius = np.hypot(points[0], points[1])
    height = points[2]
    middle = points.mean(axis=1)
    slack = SURFACE_TOLERANCE * seat.radius
    if seat.width > 0.0:
        on = (np.abs(radius - seat.radius) < slack).all(axis=0) & (np.abs(middle[2]) < seat.width / 2.0)
        on &= np.ptp(height, axis=0) > slack  # an end face may have all its corners on the circle
    else:
        on = (np.abs(height) < slack).all(axis=0)
        on &= (radius.min(axis=0) > seat.inner_radius - slack) & (radius.max(axis=0) < seat.radius + slack)
    if seat.sector is not None:
        away = np.angle(np.exp(1j * (np.arctan2(middle[1], middle[0]) - seat.sector[0])))
        on &= np.abs(away) < seat.sector[1] / 2.0
    return np.flatnonzero(on)


def _rows(mesh: Any, facets: Integers, centre: Floats) -> Floats:
    """Averages over facets, (6, 3 n): displacement of the centre and turns."""
    nodes = _facet_nodes(mesh, facets)
    element = skfem.ElementTriP2() if nodes.shape[1] == 6 else skfem.ElementQuad2()
    points, weights = skfem.quadrature.get_quadrature(element, 5)
    functions = [element.lbasis(points, number) for number in range(nodes.shape[1])]
    values = np.stack([value for value, _ in functions])
    places = np.asarray(mesh.doflocs).T[nodes]
    tangents = np.einsum("fka,kbq->bfqa", places, np.stack([slope for _, slope in functions]), optimize=True)
    weight = np.linalg.norm(np.cross(tangents[0], tangents[1]), axis=2) * weights
    arm = np.einsum("fka,kq->afq", places, values, optimize=True) - centre[:, None, None]
    share = np.zeros((4, mesh.doflocs.shape[1]))  # integrals of the shape functions, and of them times the arm
    for row, factor in enumerate((np.ones_like(weight), *arm)):
        integrals = np.einsum("fq,kq->fk", factor * weight, values)
        share[row] = np.bincount(nodes.ravel(), integrals.ravel(), share.shape[1])
    motions = np.zeros((6, 3, *weight.shape))
    motions[:3] = np.eye(3)[:, :, None, None]
    loads = np.zeros((6, 3, share.shape[1]))
    loads[:3] = np.eye(3)[:, :, None] * share[0]
    # A turn about an axis moves the arm along the two axes after it in cyclic order.
    for turn, (after, before) in enumerate(((1, 2), (2, 0), (0, 1))):
        motions[3 + turn, after], motions[3 + turn, before] = -arm[before], arm[after]
        loads[3 + turn, after], loads[3 + turn, before] = -share[1 + before], share[1 + after]
    inertia = np.einsum("idfq,jdfq,fq->ij", motions, motions, weight)
    rows: Floats = np.linalg.solve(inertia, loads.transpose(0, 2, 1).reshape(6, -1))
    return rows


def _facet_nodes(mesh: Any, facets: Integers) -> Integers:
    """Nodes of facets, (f, 6) or (f, 9): corners around each, middles of its edges, its own middle if it has one."""
    corners = ordered_corners(mesh, facets)[:, : 3 if mesh.t.shape[0] == 4 else 4]
    sides = [corners, np.roll(corners, -1, axis=1)]
    if corners.shape[1] == 3:  # the element's edges are 01, 12, 02; a quadrilateral's 01, 12, 23, 03
        sides = [corners[:, [0, 1, 0]], corners[:, [1, 2, 2]]]
    edges = entity_numbers(mesh.edges, np.stack(sides, axis=2).reshape(-1, 2)).reshape(corners.shape)
    vertices = int(np.max(mesh.t)) + 1
    nodes = [corners, vertices + edges]
    if corners.shape[1] == 4:
        nodes.append(vertices + mesh.edges.shape[1] + facets[:, None])
    return np.hstack(nodes)
