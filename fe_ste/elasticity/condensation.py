"""One tooth sector condensed onto its cut faces, with loads and read-outs on its flank.

Loads press on the flank nodes of one side, where the displacement is read, too. All that the ring or chain of sectors
needs of the finite elements is in these matrices. Signs as in `fe_ste.elasticity.flank`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse

from fe_ste.elasticity.half_sector import sector_halves, turn_signs
from fe_ste.elasticity.halfspace import tent_weights
from fe_ste.elasticity.hexmesh import SectorMesh
from fe_ste.elasticity.ring import Chain, open_chain_faces, ring_faces, uniform_faces
from fe_ste.tools.arrays import Floats, SparseMatrix


@dataclass(frozen=True)
class CondensedSector:
    """One tooth sector condensed onto its cut faces, with loads and read-outs on its flank.

    Each cut face has m unknowns, the same on both sides of it, so that joining two sectors means equating the same
    numbers; the flank has n nodes. What is ``fixed`` holds with the faces held, to which is added what their
    displacements do. Pairs hold an even and an odd part, see `fe_ste.elasticity.half_sector`.
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
