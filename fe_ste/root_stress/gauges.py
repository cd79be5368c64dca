"""Strain gauges on the root of a tooth: surface strains as linear read-outs of a sector's displacements.

A gauge lies on each edge of the section's surface between flank and root land, on both sides of the tooth, at each
layer of nodes. It reads the strains of the surface there along the section, along the face, and the shear between them.
Edges at the corner where the blocks of tooth and rim meet are left out: the mesh is least regular there.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import scipy.sparse

from fe_ste.elasticity.hexmesh import SectorMesh
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix
from fe_ste.tools.display import Displayed

COMPONENTS = 3
"""Strains of a gauge: along the section, along the face, shear."""


@dataclass(frozen=True)
class GaugePlaces(Displayed, line=": {edges!n} edges"):
    """Where gauges lie."""

    edges: Integers
    """(g, 2) section nodes of each edge."""
    side: Integers
    """(g,) +1 on the counter-clockwise side of the tooth, -1 on the clockwise one."""
    depth: Floats
    """(g,) distance along the surface from the end of the flank to the middle of the edge, m."""
    radius: Floats
    """(g,) of the middle of the edge, m."""


def gauge_places(mesh: SectorMesh) -> GaugePlaces:
    """Find the edges of the root's surface, from the end of each flank to the cut face."""
    section = mesh.section
    loose = _loose_edges(section.quads)
    corners = np.bincount(section.quads.ravel(), minlength=len(section.points))
    edges = []
    sides = []
    depths = []
    for side, flank in ((1, section.plus_flank), (-1, section.minus_flank)):
        cut = section.plus_cut if side > 0 else section.minus_cut
        chain = _chain(loose, int(flank[0 if not mesh.gear.internal else -1]), set(flank.tolist()), set(cut.tolist()))
        points = section.points[chain]
        along = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
        for place, (first, second) in enumerate(itertools.pairwise(chain)):
            if max(corners[first], corners[second]) <= 2:
                edges.append((first, second))
                sides.append(side)
                depths.append(0.5 * (along[place] + along[place + 1]))
    found = np.array(edges)
    middles = section.points[found].mean(axis=1)
    return GaugePlaces(found, np.array(sides), np.array(depths), np.hypot(*middles.T))


def _loose_edges(quads: Integers) -> dict[int, list[int]]:
    """Neighbours of each node along edges that belong to one quadrilateral alone: the outline of the section."""
    pairs = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    unique, counts = np.unique(pairs, axis=0, return_counts=True)
    neighbours: dict[int, list[int]] = {}
    for first, second in unique[counts == 1].tolist():
        neighbours.setdefault(first, []).append(second)
        neighbours.setdefault(second, []).append(first)
    return neighbours


def _chain(loose: dict[int, list[int]], start: int, flank: set[int], cut: set[int]) -> list[int]:
    """Nodes of the outline from the end of a flank, away from it, to the first node of a cut face."""
    chain = [start]
    before = set(flank)
    while chain[-1] not in cut:
        before.add(chain[-1])
        chain.append(next(node for node in loose[chain[-1]] if node not in before))
    return chain


def gauge_columns(mesh: SectorMesh, places: GaugePlaces) -> SparseMatrix:
    """Columns (3 nodes, g 3 layers) that read strains; those of one gauge and component follow each other by layer."""
    layers = len(mesh.axial_positions)
    count = len(mesh.section.points)
    points = mesh.points.reshape(layers, count, 3)
    before = np.maximum(np.arange(layers) - 1, 0)
    after = np.minimum(np.arange(layers) + 1, layers - 1)
    span = (mesh.axial_positions[after] - mesh.axial_positions[before])[:, None]
    matrix = scipy.sparse.lil_matrix((3 * layers * count, COMPONENTS * len(places.edges) * layers))
    for gauge, (first, second) in enumerate(places.edges.tolist()):
        step = points[:, second] - points[:, first]
        length = np.linalg.norm(step, axis=1, keepdims=True)
        along = step / length
        middle = 0.5 * (points[:, first] + points[:, second])
        lead = (middle[after] - middle[before]) / span
        lean = np.sum(lead * along, axis=1, keepdims=True)
        across = lead - lean * along
        size = np.linalg.norm(across, axis=1, keepdims=True)
        across = across / size
        # Derivative of the displacement across: along the generator, less its part along the section.
        for component in range(COMPONENTS):
            by_along = {0: along, 1: -lean / size * across, 2: across - lean / size * along}[component]
            by_across = {0: np.zeros_like(along), 1: across / size, 2: along / size}[component]
            for layer in range(layers):
                column = (COMPONENTS * gauge + component) * layers + layer
                parts = {
                    (layer, second): by_along[layer] / length[layer],
                    (layer, first): -by_along[layer] / length[layer],
                }
                for node in (first, second):
                    for end, sign in ((after[layer], 1.0), (before[layer], -1.0)):
                        part = 0.5 * sign * by_across[layer] / span[layer]
                        parts[end, node] = parts.get((end, node), 0.0) + part
                for (end, node), part in parts.items():
                    row = 3 * (int(end) * count + node)
                    matrix[row : row + 3, column] = np.asarray(part)[:, None]
    return matrix.tocsr()
