"""One tooth sector condensed onto its cut faces, with loads and read-outs on its flank.

Loads press on the flank nodes of one side; the displacement is read there and at a depth below them. All that the ring
or chain of sectors needs of the finite elements is in these matrices. Signs as in `fe_ste.elasticity.flank`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse

from fe_ste.elasticity.half_sector import sector_halves, turn_signs
from fe_ste.elasticity.halfspace import tent_weights
from fe_ste.elasticity.hexmesh import SectionMesh, SectorMesh
from fe_ste.elasticity.ring import Chain, open_chain_faces, ring_faces, uniform_faces
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats, Integers


@dataclass(frozen=True)
class CondensedSector:
    """One tooth sector condensed onto its cut faces, with loads and read-outs on its flank.

    Each cut face has m unknowns, the same on both sides of it, so that joining two sectors means equating the same
    numbers; the flank has n nodes. What is ``fixed`` holds with the faces held, to which is added what their
    displacements do. Pairs hold an even and an odd part, see `fe_ste.elasticity.half_sector`.

    Attributes
    ----------
    stiffness : Chain
        Of the plus face, N/m.
    signs : ndarray (m,)
        What the half turn about the middle of a face does to its unknowns.
    load : Chain
        Forces (m, n) on the plus face under unit nodal loads on the flank.
    fixed_depth : ndarray (n, n)
        Normal displacement at the depth under unit nodal loads, m/N.
    face_depth, face_surface : tuple of ndarray (n, m)
        The same, and that on the flank, by the displacements of the plus face.
    fixed_torque, face_torque : ndarray (n,), (m,)
        Torque of the reaction at the held surface about the axis, per unit nodal load (m), and per displacement of the
        plus face and the opposite one of the minus face (N).
    weights : ndarray (n, n)
        Nodal loads of the tent loads, see `fe_ste.elasticity.halfspace.tent_weights`.
    """

    stiffness: Chain
    signs: Floats
    load: Chain
    fixed_depth: Floats
    face_depth: tuple[Floats, Floats]
    face_surface: tuple[Floats, Floats]
    fixed_torque: Floats
    face_torque: Floats
    weights: Floats

    @classmethod
    def from_mesh(cls, mesh: SectorMesh, side: int, depth: float, incompatible_modes: bool) -> CondensedSector:
        """Condense the mesh of a sector.

        Parameters
        ----------
        mesh : SectorMesh
        side : int
            Loaded flank: +1 counter-clockwise, -1 clockwise.
        depth : float
            Distance of the read-out points from the flank, m.
        incompatible_modes : bool
            See `fe_ste.elasticity.bricks.stiffness_matrix`.
        """
        # Loads press into the flank, and displacements into it are read: both are against the outward normal.
        surface, below = (-columns for columns in flank_functionals(mesh, side, depth))
        halves = sector_halves(mesh, (surface, below), incompatible_modes)
        even, odd = halves
        count = surface.shape[1]
        # A load alone is half of it with the same one turned, and half of it with the opposite one turned.
        fixed = (even.fixed_reading + odd.fixed_reading) / 2
        return cls(
            stiffness=Chain(even.stiffness, odd.stiffness),
            signs=turn_signs(mesh),
            load=Chain(*(half.face_reading[:count].T for half in halves)),
            fixed_depth=fixed[count:, :count],
            face_depth=(even.face_reading[count:], odd.face_reading[count:]),
            face_surface=(even.face_reading[:count], odd.face_reading[:count]),
            fixed_torque=odd.fixed_torque[:count],
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
        """Compliance (read node, loaded node): at depth under tent loads on the own tooth, on the surface elsewhere."""
        turned = self.signs[:, None] * minus
        even, odd = self.face_depth if loaded else self.face_surface
        moved = even @ ((plus + turned) / 2) + odd @ ((plus - turned) / 2)
        # Tent loads are spread over nodes: the half-space solution that is taken out has the same loads.
        return np.asarray((self.fixed_depth + moved) @ self.weights if loaded else moved)


def flank_functionals(
    mesh: SectorMesh, side: int, depth: float
) -> tuple[scipy.sparse.csr_matrix, scipy.sparse.csr_matrix]:
    """Columns that read the outward normal displacement at the flank nodes, and at the depth below them."""
    nodes = mesh.flank_nodes(side)
    normals = flank_normals(mesh, side)
    size, count = 3 * len(mesh.points), nodes.size
    column = np.arange(count).reshape(nodes.shape)

    def columns(at: Integers, weight: Floats) -> scipy.sparse.csr_matrix:
        rows = 3 * at[..., None] + np.arange(3)
        values = weight[..., None] * normals
        where = np.broadcast_to(column[..., None], rows.shape)
        return scipy.sparse.coo_matrix((values.ravel(), (rows.ravel(), where.ravel())), shape=(size, count)).tocsr()

    surface = columns(nodes, np.ones(nodes.shape))
    section_nodes, weights = depth_readout(mesh.section, mesh.gear, side, depth)
    layer = np.arange(len(mesh.axial_positions)) * len(mesh.section.points)
    below = scipy.sparse.csr_matrix(surface.shape)
    for corner in range(4):
        share = np.broadcast_to(weights[:, corner, None], nodes.shape)
        below = below + columns(section_nodes[:, corner, None] + layer, share)
    return surface, below


def flank_normals(mesh: SectorMesh, side: int) -> Floats:
    """Return the unit normals out of the material at the flank nodes, (f, l, 3)."""
    gear, roll = mesh.gear, mesh.section.flank_roll
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


def depth_readout(section: SectionMesh, gear: Gear, side: int, depth: float) -> tuple[Integers, Floats]:
    """Find the points at a depth below the flank nodes of a section.

    Parameters
    ----------
    section : SectionMesh
    gear : Gear
    side : int
    depth : float
        Distance from the flank surface, m.

    Returns
    -------
    nodes : ndarray (f, 4)
        Section nodes of the quadrilateral each point lies in.
    weights : ndarray (f, 4)
        Bilinear shape functions there.

    Raises
    ------
    ValueError
        If a point lies outside the section: the depth is too large for the tooth.
    """
    flank = section.plus_flank if side > 0 else section.minus_flank
    points = section.points[flank]
    pressure_angle = np.arctan(section.flank_roll)
    angle = np.arctan2(points[:, 1], points[:, 0])
    radial = (-1.0 if gear.internal else 1.0) * np.sin(pressure_angle)
    tangential = side * np.cos(pressure_angle)
    normal = np.stack(
        [
            radial * np.cos(angle) - tangential * np.sin(angle),
            radial * np.sin(angle) + tangential * np.cos(angle),
        ],
        axis=-1,
    )
    # The readout stays in the section, where a depth along the normal shows as depth / cos(beta_b).
    targets = points - depth / np.cos(gear.base_helix_angle) * normal
    corners = section.points[section.quads]
    low, high = corners.min(axis=1), corners.max(axis=1)
    nodes, weights = np.empty((len(targets), 4), dtype=np.int64), np.empty((len(targets), 4))
    for number, target in enumerate(targets):
        # Boxes first: the inverse map is asked of few quadrilaterals.
        near = np.flatnonzero(((low <= target) & (target <= high)).all(axis=1))
        local = _inverse_bilinear(corners[near], target)
        outside = np.abs(local - 0.5).max(axis=1, initial=0.0)
        if not (outside <= 0.5 + 1e-6).any():
            raise ValueError(f"gear {gear.name}: the hand-over depth {depth:.3g} m leaves the tooth; choose it smaller")
        inside = int(np.argmin(outside))
        s, t = local[inside]
        nodes[number] = section.quads[near[inside]]
        weights[number] = (1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t
    return nodes, weights


def _inverse_bilinear(corners: Floats, target: Floats) -> Floats:
    """Local coordinates (m, 2) of one point in each quadrilateral (m, 4, 2), by Newton."""
    a = corners[:, 0]
    b, c = corners[:, 1] - a, corners[:, 3] - a
    d = corners[:, 2] - corners[:, 1] - c
    local = np.full((len(corners), 2), 0.5)
    for _ in range(25):
        s, t = local[:, :1], local[:, 1:]
        residual = a + s * b + t * c + s * t * d - target
        jacobian = np.stack([b + t * d, c + s * d], axis=-1)
        # A step is kept near the quadrilateral: far from it the bilinear map may fold.
        local = local - np.clip(np.linalg.solve(jacobian, residual[..., None])[..., 0], -2.0, 2.0)
    return np.asarray(local)
