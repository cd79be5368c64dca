"""The even and the odd half of a tooth sector, condensed onto a cut face, loads and read-outs.

A tooth is equal to itself turned by 180 degrees about its middle line (the x axis): z changes sign, and both flanks and
both cut faces change places. So any deformation is the sum of an even one, which is equal to itself so turned, and an
odd one, which changes sign; each needs the finite elements of the counter-clockwise half of the sector only.

The unknowns of a node of the section are those of all its layers, in the frame that turns with the section along the
helix (`fe_ste.elasticity.layers`); those of the cut face have its radial direction as first axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeAlias

import numpy as np
import scipy.sparse

from fe_ste.elasticity.hexmesh import SectorMesh
from fe_ste.elasticity.layers import LayeredElements
from fe_ste.elimination.dense import mirrored_lower
from fe_ste.elimination.dissection import Front, dissected, parts_without, schur_complement
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix
from fe_ste.tools.threads import side_by_side

#: Blocks of a set of cells that is not dissected any more.
_LEAF_BLOCKS = 12

#: Part of the section's size by which nodes may miss their mirror image.
_ROUNDING = 1e-9

#: What the half turn does to the components of a vector.
_HALF_TURN = np.array([1.0, -1.0, -1.0])
EVEN = 1
ODD = -1

#: Section node -> its block, and its unknowns by those of the block; what is not here is a block of its own.
_Maps: TypeAlias = dict[int, tuple[int, Floats]]


@dataclass(frozen=True)
class SectorHalf:
    """Even or odd half of a sector, its inner unknowns eliminated.

    Loads and read-outs are the same columns.
    """

    stiffness: Floats
    """(m, m) of the cut face at +pi/z, N/m; first the unknowns that a half turn about its middle keeps, see
    `turn_signs`."""
    face_reading: Floats
    """(r, m) of the columns, per displacement of the face; also the forces on the held face per load."""
    fixed_reading: Floats
    """(r, r) of the columns per load, the face held, m/N."""
    face_torque: Floats
    fixed_torque: Floats
    """(m,), (r,) torque of the reaction at the held surface of this half, per displacement of the face (N) and load
    (m); the even half takes none."""


def sector_halves(
    mesh: SectorMesh, columns: Sequence[SparseMatrix], incompatible_modes: bool
) -> tuple[SectorHalf, SectorHalf]:
    """Condense both halves of a sector.

    Parameters
    ----------
    mesh : turned by 180 degrees about its middle line it must be the same; all layers have one section
    columns : (3 nodes, n)
        Loads and read-outs, one a column; those of a node of the flank, one a layer, follow each other.
    incompatible_modes : see `fe_ste.elasticity.bricks.stiffness_matrix`

    Returns
    -------
    even, odd : for loads that are joined by the same ones, turned; by their opposites

    Raises
    ------
    ValueError
        If the mesh is not equal to itself so turned.
    """
    halving = _Halving(mesh, scipy.sparse.hstack(columns).tocsr(), incompatible_modes)
    common = halving.common_parts()
    even, odd = side_by_side(lambda parity: halving.half(parity, common), (EVEN, ODD))
    return even, odd


def turn_signs(mesh: SectorMesh) -> Floats:
    """Return what a half turn about the middle of the cut face does to its unknowns: 1 or -1 each, (m,), ones first."""
    nodes = len(np.setdiff1d(mesh.section.plus_cut, mesh.section.held))
    _, signs = _turn_basis(len(mesh.axial_positions))
    return np.asarray(np.sort(np.tile(signs, nodes))[::-1])


def _line_turn(layers: int) -> Floats:
    """Half turn of the unknowns of a line of nodes about its middle, (3 layers, 3 layers)."""
    return np.asarray(np.kron(np.eye(layers)[::-1], np.diag(_HALF_TURN)))


def _turn_basis(layers: int) -> tuple[Floats, Floats]:
    """Orthonormal vectors, one a column, that the half turn of a line keeps or reverses, and these signs."""
    turn = _line_turn(layers)
    front = 3 * (layers // 2)
    kept, reverse = ((np.eye(3 * layers) + sign * turn)[:, :front] * np.sqrt(0.5) for sign in (EVEN, ODD))
    middle = np.eye(3 * layers)[:, front : 3 * layers - front]
    basis = np.concatenate([kept, reverse, middle], axis=1)
    return np.asarray(basis), np.asarray(np.diag(basis.T @ turn @ basis).round())


class _Halving:
    """The counter-clockwise half of a sector mesh, ready to condense.

    Blocks of unknowns: by section node, then one for the turn of the held surface, then one for each group of columns.
    """

    def __init__(self, mesh: SectorMesh, columns: scipy.sparse.csr_matrix, incompatible_modes: bool) -> None:
        section = mesh.section
        self._mesh = mesh
        self._nodes = len(section.points)
        self._layers = len(mesh.axial_positions)
        self._mirrored = _mirror_images(mesh)
        middles = section.points[section.quads].mean(axis=1)
        lean = _ROUNDING * np.abs(section.points).max()
        quads = np.flatnonzero(middles[:, 1] > -lean)
        # What crosses the middle line is its own mirror image: half of it belongs to this half.
        share = np.where(middles[quads, 1] < lean, 0.5, 1.0)
        self._elements = LayeredElements.from_mesh(mesh, quads, share, incompatible_modes)
        self._below = section.points[:, 1] < -lean
        self._columns = self._blocks_of(columns)
        self._groups = columns.shape[1] // self._layers
        self._pairs = list(self._columns)
        self._plan = self._planned(middles[quads])

    def common_parts(self) -> dict[Front, Floats]:
        """Parts of the half that know nothing of even and odd: away from the middle line and the held surface."""
        own_images = np.flatnonzero(self._mirrored == np.arange(self._nodes))
        coupled = np.union1d(self._elements.corners, [node for node, _ in self._pairs])
        crossing = self._mirrored[coupled[self._below[coupled]]]
        parts = parts_without(self._plan, np.concatenate([own_images, crossing, [self._nodes]]))
        maps = self._maps(EVEN)
        return dict(zip(parts, side_by_side(lambda part: self._condensed(part, maps, {}), parts), strict=True))

    def half(self, parity: int, common: dict[Front, Floats]) -> SectorHalf:
        """Condense the half for even or odd deformations."""
        maps = self._maps(parity)
        sizes = self._sizes(maps)
        matrix = mirrored_lower(self._condensed(self._plan, maps, common))
        # Kept blocks come by their numbers: the face's nodes, the turn of the held surface, the columns.
        signs = np.tile(_turn_basis(self._layers)[1], len(self._face))
        face = np.concatenate([np.flatnonzero(signs > 0), np.flatnonzero(signs < 0)])
        readings = np.arange(len(signs) + sizes[self._nodes], len(matrix))
        torque = matrix[len(signs)] if parity == ODD else np.zeros(len(matrix))
        return SectorHalf(
            stiffness=matrix[np.ix_(face, face)],
            face_reading=-matrix[np.ix_(readings, face)],
            fixed_reading=-matrix[np.ix_(readings, readings)],
            face_torque=torque[face],
            fixed_torque=torque[readings],
        )

    def _condensed(self, front: Front, maps: _Maps, known: dict[Front, Floats]) -> Floats:
        sizes = self._sizes(maps)
        return schur_complement(front, sizes, partial(self._add_cells, maps, sizes), known)

    @cached_property
    def _face(self) -> Integers:
        """Section nodes of the cut face, ascending."""
        section = self._mesh.section
        return np.setdiff1d(section.plus_cut, section.held)

    def _blocks_of(self, columns: scipy.sparse.csr_matrix) -> dict[tuple[int, int], Floats]:
        """Columns by section node and group, over the node's unknowns in the frame of the section."""
        layers = self._layers
        angle = self._mesh.twist_rate * self._mesh.axial_positions
        turns = np.zeros((layers, 3, 3))
        turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angle)
        turns[:, 0, 1], turns[:, 1, 0] = np.sin(angle), -np.sin(angle)
        turns[:, 2, 2] = 1.0
        touched = np.unique(columns.nonzero()[0] // 3 % self._nodes)
        found = {}
        for node in touched.tolist():
            rows = 3 * (node + self._nodes * np.arange(layers))[:, None] + np.arange(3)
            local = turns @ columns[rows.ravel()].toarray().reshape(layers, 3, -1)
            by_group = local.reshape(3 * layers, -1, layers)
            for group in np.flatnonzero(np.abs(by_group).max(axis=(0, 2))).tolist():
                found[node, group] = by_group[:, group]
        return found

    def _maps(self, parity: int) -> _Maps:
        """Block, and the node's unknowns by those of the block, of all nodes that are no plain block of their own."""
        section = self._mesh.section
        layers = self._layers
        turn, (basis, signs) = _line_turn(layers), _turn_basis(layers)
        maps = {}
        half_pitch = self._mesh.gear.angular_pitch / 2
        cosine = np.cos(half_pitch)
        sine = np.sin(half_pitch)
        radial = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        for node in self._face.tolist():
            maps[node] = node, np.kron(np.eye(layers), radial) @ basis
        for node in np.flatnonzero(self._mirrored == np.arange(self._nodes)).tolist():
            maps[node] = node, basis[:, signs == parity]
        for node in section.held.tolist():
            # The held surface turns by one angle, by which no even deformation turns it.
            x, y = section.points[node]
            rotation = np.tile([-y, x, 0.0], layers)[:, None]
            maps[node] = self._nodes, rotation[:, : int(parity == ODD)]
        for node in np.flatnonzero(self._below).tolist():
            block, image = maps.get(self._mirrored[node], (int(self._mirrored[node]), np.eye(3 * layers)))
            maps[node] = block, parity * turn @ image
        return maps

    def _sizes(self, maps: _Maps) -> Integers:
        sizes = np.full(self._nodes + 1 + self._groups, 3 * self._layers)
        sizes[self._nodes + 1 :] = self._layers
        for block, image in maps.values():
            sizes[block] = image.shape[1]
        return sizes

    def _planned(self, middles: Floats) -> Front:
        maps = self._maps(EVEN)
        section = self._mesh.section
        block = np.arange(self._nodes)
        for node, (at, _) in maps.items():
            block[node] = at
        couplings = [np.array([block[node], self._nodes + 1 + group]) for node, group in self._pairs]
        cells = [*(block[np.unique(corners)] for corners in self._elements.corners), *couplings]
        point = section.points[[node for node, _ in self._pairs]]
        kept = np.concatenate([self._face, np.arange(self._nodes, self._nodes + 1 + self._groups)])
        return dissected(np.concatenate([middles, point]), cells, self._sizes(maps), kept, _LEAF_BLOCKS)

    def _add_cells(self, maps: _Maps, sizes: Integers, matrix: Floats, cells: Integers, blocks: Integers) -> None:
        """Add the matrices of some cells over the unknowns of some blocks."""
        ends = np.cumsum(sizes[blocks])
        parts = {block: slice(end - sizes[block], end) for block, end in zip(blocks.tolist(), ends, strict=True)}
        bricks = cells[cells < len(self._elements.corners)]
        if bricks.size:
            nodes, stack = self._elements.stack(bricks)
            images = [maps.get(node, (node, None)) for node in nodes.tolist()]
            for (row_block, row_image), across in zip(images, stack, strict=True):
                rows = across if row_image is None else np.tensordot(row_image.T, across, 1)
                for place, (column_block, column_image) in enumerate(images):
                    if parts[row_block].start >= parts[column_block].start:
                        found = rows[:, place] if column_image is None else rows[:, place] @ column_image
                        matrix[parts[row_block], parts[column_block]] += found
        for pair in cells[cells >= len(self._elements.corners)] - len(self._elements.corners):
            node, group = self._pairs[pair]
            block, image = maps.get(node, (node, None))
            coefficients = self._columns[node, group]
            force = coefficients if image is None else image.T @ coefficients
            matrix[parts[self._nodes + 1 + group], parts[block]] -= force.T


def _mirror_images(mesh: SectorMesh) -> Integers:
    """Section node that each node of a section becomes by the half turn."""
    points = mesh.section.points
    axial = mesh.axial_positions
    images = np.empty(len(points), dtype=np.int64)
    missed = np.abs(axial + axial[::-1]).max()
    for some in np.array_split(np.arange(len(points)), len(points) // 256 + 1):  # all at once would be a gigabyte
        away = np.abs(points[some, None] - points * [1.0, -1.0]).max(axis=-1)
        images[some] = away.argmin(axis=1)
        missed = max(missed, away.min(axis=1).max())
    if missed > _ROUNDING * np.abs(points).max():
        raise ValueError(
            f"gear {mesh.gear.name}: the mesh turned by 180 deg about the middle of the tooth misses itself by "
            f"{missed:.3g} m; it must be the same"
        )
    return images
