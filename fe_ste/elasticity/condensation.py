"""One tooth sector condensed onto its cut faces, with loads and displacements of its flank.

Loads act at the flank nodes of one side, where the displacement is evaluated, too. These matrices contain all
finite-element data that the ring or chain of sectors needs. Signs are as in `fe_ste.elasticity.flank`.

A sector, and any chain of sectors, is invariant under rotation by 180 degrees about the line through its middle. It is
therefore described by two symmetric stiffness matrices on its plus face: one for even deformations, which this rotation
keeps, and one for odd ones, which it reverses. The minus face then moves as the rotated plus face, or opposite to it.
The unknowns of a face are chosen so that rotation about the face's own middle keeps or reverses each: its signs, 1 or
-1, ones first.

A chain is made by doubling: a ring of z teeth requires about log2(z) eliminations of one face, whereas the discrete
Fourier transform over the teeth requires z/2 complex ones.

A tooth is invariant under rotation by 180 degrees about its middle line (the x axis), which changes the sign of z and
exchanges both flanks and both cut faces. Any deformation is therefore the sum of an even one, which is invariant under
this rotation, and an odd one, which changes sign. Each needs only the finite elements of the counter-clockwise half of
the sector.

The unknowns of a node of the section are those of all its layers, in the frame that rotates with the section along the
helix; those of the cut face have its radial direction as first axis. In this frame all layers of one height have equal
elements, which are computed once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy.linalg
import scipy.sparse

from fe_ste.elasticity.bricks import element_stiffness
from fe_ste.elasticity.halfspace import tent_weights
from fe_ste.elasticity.hexmesh import SectorMesh
from fe_ste.elimination import (
    Front,
    dissected,
    divided_by_factor,
    eliminate,
    mirrored_lower,
    parts_without,
    schur_complement,
)
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix
from fe_ste.tools.threads import side_by_side


class Chain(NamedTuple):
    """Equal sectors in a row, or one: stiffness (m, m) of the plus face in even and in odd deformations, N/m."""

    even: Floats
    odd: Floats

    @property
    def own(self) -> Floats:
        """Force on the plus face by its own displacement, the minus face held."""
        return (self.even + self.odd) / 2

    @property
    def across(self) -> Floats:
        """Force on the plus face by the displacement of the minus face turned, the plus face held."""
        return (self.even - self.odd) / 2

    def whole(self, signs: Floats) -> Floats:
        """Return the stiffness (2 m, 2 m) of both faces, minus face first."""
        turned = self.own * signs * signs[:, None]
        return np.block([[turned, signs[:, None] * self.across], [self.across * signs, self.own]])


def doubled(chain: Chain, signs: Floats) -> Chain:
    """Join a chain to an identical one.

    Parameters
    ----------
    signs : (m,) of the unknowns of a face

    Examples
    --------
    Two equal springs in series are half as stiff. Their ends move along the springs, which the turn reverses: the even
    part stretches them, the odd part is their rigid motion.

    >>> spring = Chain(even=np.array([[2.0]]), odd=np.array([[0.0]]))
    >>> doubled(spring, np.array([-1.0])).even.tolist()
    [[1.0]]
    """
    own = chain.own
    across = chain.across
    ones = int(np.count_nonzero(signs > 0))

    def half(parity: int) -> Floats:
        # The joined face lies in the middle of the new chain: an even deformation moves only what its turn keeps.
        moved = slice(None, ones) if parity > 0 else slice(ones, None)
        return _condensed(own[moved, moved], across[:, moved], own)[0]

    return Chain(*side_by_side(half, (1, -1)))


def enclosed(inner: Floats, outer: Chain, signs: Floats) -> tuple[Floats, Floats, Floats]:
    """Join a chain to either end of another one.

    Parameters
    ----------
    inner : (m, m) the even or the odd stiffness of the chain in the middle
    signs : (m,)

    Returns
    -------
    stiffness : (m, m) of the whole, even or odd as `inner`
    factor, below : (m, m)
        ``-(below @ inv(factor)).T`` is the displacement of the inner plus face by that of the outer one.
    """
    return _condensed(inner + outer.own * signs * signs[:, None], outer.across * signs, outer.own)


def _condensed(gone: Floats, coupling: Floats, kept: Floats) -> tuple[Floats, Floats, Floats]:
    """Schur complement of the unknowns that are gone, their Cholesky factor L, and the coupling times L^-T."""
    size = len(kept)
    count = len(gone)
    front = np.empty((count + size, count + size), order="F")
    front[:count, :count], front[count:, :count], front[count:, count:] = gone, coupling, kept
    eliminate(front, count)
    return mirrored_lower(front[count:, count:]), front[:count, :count], front[count:, :count]


def chain_of(sector: Chain, count: int, signs: Floats) -> Chain:
    """Join `count` equal sectors, by doubling."""
    if count == 1:
        return sector
    half = chain_of(sector, count // 2, signs)
    if count % 2 == 0:
        return doubled(half, signs)
    return Chain(*side_by_side(lambda middle: enclosed(middle, half, signs)[0], sector))


def ring_faces(sector: Chain, load: Chain, signs: Floats, teeth: int, reach: int) -> dict[int, Floats]:
    """Face displacements of the closed ring under loads on one sector.

    Parameters
    ----------
    load : forces (m, k) on the plus face of sector 0 under even and odd loads: a load and the same turned, or reversed
    signs : (m,) of the unknowns of a face
    teeth : sectors of the ring
    reach : sectors on either side of sector 0 wanted; at least ``teeth - 2 reach`` 2

    Returns
    -------
    dict
        Face number -> ndarray (m, k) for the faces ``-reach`` to ``reach + 1``, under the loads alone; face j is the
        minus face of sector j.
    """
    # The ring is sector 0 and a chain of all others. That grows from its middle, opposite to sector 0, by one sector on
    # either side; on the way it tells how each face follows the next one.
    rest = chain_of(sector, teeth - 1 - 2 * reach, signs)

    def one_parity(parity: int) -> list[Floats]:
        at = 0 if parity > 0 else 1
        stiffness = rest[at]
        follows = []
        for _ in range(reach):
            stiffness, factor, below = enclosed(stiffness, sector, signs)
            follows.append((factor, below))
        # The plus face of the rest is the minus face of sector 0, which moves as the plus face turned, or against that.
        closed = sector[at] + stiffness * signs * signs[:, None]
        held = scipy.linalg.cho_factor(closed, lower=True, overwrite_a=True, check_finite=False)
        first = scipy.linalg.cho_solve(held, load[at], check_finite=False)
        faces = [parity * signs[:, None] * first]
        for factor, below in reversed(follows):
            faces.append(-divided_by_factor(faces[-1].T @ below, factor).T)
        return faces  # 0, -1, -2, ...

    even, odd = side_by_side(one_parity, (1, -1))
    result = {}
    for step, (kept, reverse) in enumerate(zip(even, odd, strict=True)):
        result[-step] = (kept + reverse) / 2
        result[step + 1] = signs[:, None] * (kept - reverse) / 2
    return result


def open_chain_faces(sector: Floats, load: Floats, teeth: int) -> list[list[Floats]]:
    """Face displacements of an open chain with free ends.

    Parameters
    ----------
    sector : (2 m, 2 m) both faces, minus face first; see `Chain.whole`
    load : (2 m, k) load columns on the faces of the loaded sector
    teeth : sectors of the chain

    Returns
    -------
    (m, k) by loaded sector, then by face 0 to `teeth`
    """
    half = len(sector) // 2
    matrix = np.zeros((half * (teeth + 1), half * (teeth + 1)))
    for number in range(teeth):
        both = slice(half * number, half * (number + 2))
        matrix[both, both] += sector
    factor = scipy.linalg.cho_factor(matrix, overwrite_a=True, check_finite=False)
    result = []
    for number in range(teeth):
        right = np.zeros((len(matrix), load.shape[1]))
        right[half * number : half * (number + 2)] = load
        result.append(np.split(scipy.linalg.cho_solve(factor, right, check_finite=False), teeth + 1))
    return result


def uniform_faces(sector: Chain, load: Chain, signs: Floats) -> Floats:
    """Sum over the ring's faces of their displacements under loads as in `ring_faces`, (m, k)."""
    # In this harmonic of order zero both faces of a sector move alike: what the turn of a face keeps is an even
    # deformation of the sector, what it reverses an odd one.
    ones = int(np.count_nonzero(signs > 0))
    parts = (
        scipy.linalg.solve(stiffness[part, part], forces[part], assume_a="pos", check_finite=False)
        for stiffness, forces, part in zip(sector, load, (slice(None, ones), slice(ones, None)), strict=True)
    )
    return np.concatenate(list(parts)) / 2


#: Part of the face width by which heights of layers may differ and count as equal.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class LayeredElements:
    """Stiffness of the bricks over the quadrilaterals of a section."""

    corners: Integers
    """(q, 8) section node of each corner of a brick."""
    above: Integers
    """(q, 8) 0 for a corner at the lower end of the layer, 1 at the upper end."""
    kinds: Integers
    """(layers,) height of each layer, as a place in `stiffness`."""
    stiffness: Floats
    """(heights, q, 8, 8, 3, 3) by two corners and two directions, N/m."""

    @classmethod
    def from_mesh(cls, mesh: SectorMesh, quads: Integers, share: Floats, incompatible_modes: bool) -> LayeredElements:
        """Compute the elements over some quadrilaterals, given by their number; of each a share counts.

        Raises
        ------
        ValueError
            If layers have sections of their own, or an element is folded.
        """
        if mesh.layer_points is not None:
            raise ValueError(f"gear {mesh.gear.name}: layers with sections of their own cannot be condensed")
        steps = np.diff(mesh.axial_positions)
        _, first, kinds = np.unique(
            np.round(steps / (_ROUNDING * mesh.gear.face_width)), return_index=True, return_inverse=True
        )
        layers = [_layer(mesh, quads, float(steps[at]), incompatible_modes) for at in first]
        corners, above, _ = layers[0]
        stiffness = np.stack([matrices for *_, matrices in layers])
        return cls(corners, above, kinds.ravel(), stiffness * share[:, None, None, None, None])

    def stack(self, elements: Integers) -> tuple[Integers, Floats]:
        """Stiffness of the stacks of bricks over some quadrilaterals, all layers joined.

        Parameters
        ----------
        elements : (e,)

        Returns
        -------
        nodes : (n,) their section nodes
        stiffness : (n, s, n, s) with s = 3 (layers + 1) unknowns a node, by layer and direction, N/m
        """
        nodes, local = np.unique(self.corners[elements], return_inverse=True)
        at = 2 * local.reshape(-1, 8) + self.above[elements]
        layers = len(self.kinds)
        result = np.zeros((len(nodes), layers + 1, 3, len(nodes), layers + 1, 3))
        for kind, stiffness in enumerate(self.stiffness):
            one = np.zeros((2 * len(nodes), 2 * len(nodes), 3, 3))
            for corners, matrix in zip(at, stiffness[elements], strict=True):
                one[corners[:, None], corners] += matrix
            both_ends = one.reshape(len(nodes), 2, len(nodes), 2, 3, 3).transpose(0, 1, 4, 2, 3, 5)
            for layer in np.flatnonzero(self.kinds == kind):
                result[:, layer : layer + 2, :, :, layer : layer + 2] += both_ends
        unknowns = 3 * (layers + 1)
        return nodes, result.reshape(len(nodes), unknowns, len(nodes), unknowns)


def _layer(
    mesh: SectorMesh, quads: Integers, height: float, incompatible_modes: bool
) -> tuple[Integers, Integers, Floats]:
    """Section nodes, ends and matrices of one layer, whose upper end is turned, and its unknowns with it."""
    section = mesh.section
    angle = mesh.twist_rate * height
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    lower = np.column_stack([section.points, np.zeros(len(section.points))])
    upper = lower @ turn.T + [0.0, 0.0, height]
    bottom = section.quads[quads]
    nodes, stiffness = element_stiffness(
        np.concatenate([lower, upper]),
        np.concatenate([bottom, bottom + len(lower)], axis=1),
        mesh.gear.material,
        incompatible_modes,
    )
    above, corners = np.divmod(nodes, len(lower))
    turns = np.where(above[..., None, None] == 1, turn, np.eye(3))
    blocks = stiffness.reshape(-1, 8, 3, 8, 3).transpose(0, 1, 3, 2, 4)
    return corners, above, np.asarray(turns.transpose(0, 1, 3, 2)[:, :, None] @ blocks @ turns[:, None])


#: Blocks of a set of cells that is not dissected any more.
_LEAF_BLOCKS = 12

#: Part of the section's size by which nodes may miss their mirror image.
_ROUNDING_OF_HALF_SECTOR = 1e-9

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
    _, signs = turn_basis(len(mesh.axial_positions))
    return np.asarray(np.sort(np.tile(signs, nodes))[::-1])


def _line_turn(layers: int) -> Floats:
    """Half turn of the unknowns of a line of nodes about its middle, (3 layers, 3 layers)."""
    return np.asarray(np.kron(np.eye(layers)[::-1], np.diag(_HALF_TURN)))


def turn_basis(layers: int) -> tuple[Floats, Floats]:
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
        lean = _ROUNDING_OF_HALF_SECTOR * np.abs(section.points).max()
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
        loaded = np.array([node for node, _ in self._pairs], dtype=np.int64)
        coupled = np.union1d(self._elements.corners, loaded)
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
        signs = np.tile(turn_basis(self._layers)[1], len(self._face))
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
        turn, (basis, signs) = _line_turn(layers), turn_basis(layers)
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
    if missed > _ROUNDING_OF_HALF_SECTOR * np.abs(points).max():
        raise ValueError(
            f"gear {mesh.gear.name}: the mesh turned by 180 deg about the middle of the tooth misses itself by "
            f"{missed:.3g} m; it must be the same"
        )
    return images


@dataclass(frozen=True)
class CondensedSector:
    """One tooth sector condensed onto its cut faces, with loads and displacements of its flank.

    Each cut face has m unknowns, the same on both sides of it, so that two sectors are joined by equating these
    unknowns; the flank has n nodes. Values named ``fixed`` apply to fixed faces; contributions of the displacements
    of the faces are added to them. Pairs consist of an even and an odd part, see the module.
    """

    stiffness: Chain
    """Of the plus face, N/m."""
    signs: Floats
    """(m,) what the half turn about the middle of a face does to its unknowns."""
    load: Chain
    """Forces (m, n) on the plus face under unit nodal loads on the flank."""
    fixed: Floats
    """(n, n) normal displacement of the flank under unit nodal loads, m/N."""
    by_face: tuple[Floats, Floats]
    """(n, m) the same by the displacements of the plus face."""
    fixed_torque: Floats
    face_torque: Floats
    """(n,), (m,) torque of the reaction at the held surface about the axis, per unit nodal load (m), and per
    displacement of the plus face and the opposite one of the minus face (N)."""
    weights: Floats
    """(n, n) nodal loads of the tent loads, see `fe_ste.elasticity.halfspace.tent_weights`."""

    @classmethod
    def from_mesh(cls, mesh: SectorMesh, side: int, incompatible_modes: bool) -> CondensedSector:
        """Condense the mesh of a sector.

        Parameters
        ----------
        side : loaded flank: +1 counter-clockwise, -1 clockwise
        incompatible_modes : see `fe_ste.elasticity.bricks.stiffness_matrix`
        """
        # Loads press into the flank, and displacements into it are read: both are against the outward normal.
        halves = sector_halves(mesh, [-flank_functionals(mesh, side)], incompatible_modes)
        even, odd = halves
        # A load alone is half of it with the same one turned, and half of it with the opposite one turned.
        return cls(
            stiffness=Chain(even.stiffness, odd.stiffness),
            signs=turn_signs(mesh),
            load=Chain(*(half.face_reading.T for half in halves)),
            fixed=(even.fixed_reading + odd.fixed_reading) / 2,
            by_face=(even.face_reading, odd.face_reading),
            fixed_torque=odd.fixed_torque,
            face_torque=odd.face_torque,
            weights=tent_weights(mesh.section.flank_roll, mesh.axial_positions),
        )

    def ring_faces(self, teeth: int, reach: int) -> dict[tuple[int, int], tuple[Floats, Floats]]:
        """Displacement of the minus and plus face of the teeth within `reach` of the loaded one."""
        faces = ring_faces(self.stiffness, self.load, self.signs, teeth, reach)
        return {(offset, 0): (faces[offset], faces[offset + 1]) for offset in range(-reach, reach + 1)}

    def ring_torque(self) -> Floats:
        """Torque of the reaction at the held surface of the whole ring per unit nodal load."""
        faces = uniform_faces(self.stiffness, self.load, self.signs)
        return self.fixed_torque + self._torque(faces, faces)

    def open_faces(self, teeth: int) -> tuple[dict[tuple[int, int], tuple[Floats, Floats]], Floats]:
        """Face displacements of an open chain of sectors with free ends, for every loaded tooth.

        Also the torque of the reaction at the held surface when the middle tooth is loaded.
        """
        middle = teeth // 2
        even, odd = self.load
        load = np.concatenate([self.signs[:, None] * (even - odd), even + odd]) / 2
        by_load = open_chain_faces(self.stiffness.whole(self.signs), load, teeth)
        faces = {
            (read - middle, loaded - middle): (chain[read], chain[read + 1])
            for loaded, chain in enumerate(by_load)
            for read in range(teeth)
        }
        torque = self.fixed_torque.copy()
        for read in range(teeth):
            torque += self._torque(by_load[middle][read], by_load[middle][read + 1])
        return faces, torque

    def _torque(self, minus: Floats, plus: Floats) -> Floats:
        return np.asarray(self.face_torque @ (plus - self.signs[:, None] * minus))

    def displacement(self, loaded: bool, minus: Floats, plus: Floats) -> Floats:
        """Compliance (read node, loaded node): under tent loads on the own tooth, under nodal loads elsewhere."""
        turned = self.signs[:, None] * minus
        even, odd = self.by_face
        moved = even @ ((plus + turned) / 2) + odd @ ((plus - turned) / 2)
        # Tent loads are spread over nodes: the half-space solution that is taken out has the same loads.
        return np.asarray((self.fixed + moved) @ self.weights if loaded else moved)


def flank_functionals(mesh: SectorMesh, side: int) -> SparseMatrix:
    """Columns that read the outward normal displacement at the flank nodes."""
    nodes = mesh.flank_nodes(side)
    rows = 3 * nodes[..., None] + np.arange(3)
    where = np.broadcast_to(np.arange(nodes.size).reshape(*nodes.shape, 1), rows.shape)
    values = flank_normals(mesh, side)
    shape = (3 * len(mesh.points), nodes.size)
    return scipy.sparse.coo_matrix((values.ravel(), (rows.ravel(), where.ravel())), shape=shape).tocsr()


def flank_normals(mesh: SectorMesh, side: int) -> Floats:
    """Return the unit normals out of the material at the flank nodes, (f, l, 3)."""
    gear = mesh.gear
    roll = mesh.section.flank_roll
    tip_sign = -1.0 if gear.internal else 1.0
    pressure_angle = np.arctan(roll)
    radius = gear.base_radius * np.sqrt(1.0 + roll**2)
    angle = side * gear.half_angle(radius)[:, None] + mesh.twist_rate * mesh.axial_positions
    radial = tip_sign * np.sin(pressure_angle)[:, None]
    tangential = side * np.cos(pressure_angle)[:, None]
    axial = np.full_like(angle, -side * np.tan(gear.base_helix_angle))
    normal = np.stack(
        [
            radial * np.cos(angle) - tangential * np.sin(angle),
            radial * np.sin(angle) + tangential * np.cos(angle),
            axial,
        ],
        axis=-1,
    )
    return np.asarray(normal * np.cos(gear.base_helix_angle))
