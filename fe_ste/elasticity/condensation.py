"""One tooth sector condensed onto its cut faces, with loads and read-outs on its flank.

Loads press on the flank nodes of one side; the displacement is read there and at a depth below them. All that the ring
or chain of sectors needs of the finite elements is in these matrices. Signs as in `fe_ste.elasticity.flank`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse

from fe_ste.elasticity.bricks import stiffness_matrix
from fe_ste.elasticity.halfspace import tent_weights
from fe_ste.elasticity.hexmesh import SectionMesh, SectorMesh
from fe_ste.elasticity.ring import open_chain_faces, ring_faces, uniform_faces
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.sparse import Backend, factorise


@dataclass(frozen=True)
class CondensedSector:
    """One tooth sector condensed onto its cut faces, with loads and read-outs on its flank.

    The unknowns of the +pi/z face are expressed in the frame of the next sector, so that joining two sectors means
    equating the same numbers. Each face has m unknowns, the one at -pi/z (minus) comes first; the flank has n nodes.
    What is ``fixed`` holds with the faces held, what is ``static`` is added by their displacements.

    Attributes
    ----------
    backend : str
        Sparse solver.
    stiffness : ndarray (2 m, 2 m)
        Of the faces, N/m.
    face_load : ndarray (2 m, n)
        Forces on the faces under unit nodal loads on the flank.
    fixed_depth, fixed_surface : ndarray (n, n)
        Normal displacement at the depth and on the flank under unit nodal loads, m/N.
    static_depth, static_surface : ndarray (n, 2 m)
        The same by the displacements of the faces.
    fixed_torque, static_torque : ndarray (n,), (2 m,)
        Torque of the reaction at the held surface about the axis, per unit nodal load (m) and face displacement (N).
    weights : ndarray (n, n)
        Nodal loads of the tent loads, see `fe_ste.elasticity.halfspace.tent_weights`.
    """

    backend: str
    stiffness: Floats
    face_load: Floats
    fixed_depth: Floats
    fixed_surface: Floats
    static_depth: Floats
    static_surface: Floats
    fixed_torque: Floats
    static_torque: Floats
    weights: Floats

    @classmethod
    def from_mesh(
        cls, mesh: SectorMesh, side: int, depth: float, incompatible_modes: bool, backend: Backend | None
    ) -> CondensedSector:
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
        backend : {"pardiso", "superlu"}, optional
        """
        gear = mesh.gear
        stiffness = stiffness_matrix(mesh.points, mesh.hexahedra, gear.material, incompatible_modes)
        turn = _turned_face(mesh)
        faces = np.concatenate([_unknowns(mesh.cut_nodes(-1)), _unknowns(mesh.cut_nodes(1))])
        held = _unknowns(mesh.held_nodes)
        inside = np.setdiff1d(np.arange(stiffness.shape[0]), np.concatenate([faces, held]))
        # K in blocks: i inside, f faces, held ones zero. One factor of K_ii gives the condensed faces
        # K_ff - K_fi K_ii^-1 K_if, what loads on the flank do to the faces, and what both do to the read-outs.
        to_faces = stiffness[:, faces] @ turn
        coupling = to_faces[inside].tocsc()
        surface, depth_rows = flank_functionals(mesh, side, depth)
        torque = _torque_functional(mesh)
        # Reaction at the held surface is K_h u; its torque is a row like the read-outs.
        held_torque = stiffness[held].T @ torque[held]
        loads = scipy.sparse.hstack([coupling, -surface[inside]]).tocsc()
        readings = scipy.sparse.hstack(
            [
                coupling,
                -depth_rows[inside],
                -surface[inside],
                scipy.sparse.csc_matrix(held_torque[inside][:, None]),
            ]
        ).tocsc()
        with factorise(stiffness[inside][:, inside], backend) as factor:
            name = factor.name
            response = factor.compliance(readings, loads)
        count = len(faces)
        nodes = surface.shape[1]
        depth_part = slice(count, count + nodes)
        surface_part = slice(count + nodes, count + 2 * nodes)
        face_to_face = (turn.T @ to_faces[faces]).toarray()
        condensed = face_to_face - response[:count, :count]
        return cls(
            backend=name,
            stiffness=(condensed + condensed.T) / 2,  # symmetric but for rounding
            face_load=-response[:count, count:],
            fixed_depth=response[depth_part, count:],
            fixed_surface=response[surface_part, count:],
            static_depth=-response[depth_part, :count],
            static_surface=-response[surface_part, :count],
            fixed_torque=response[-1, count:],
            static_torque=np.asarray(turn.T @ held_torque[faces]) - response[-1, :count],
            weights=tent_weights(mesh.section.flank_roll, mesh.axial_positions),
        )

    def ring_faces(self, teeth: int, reach: int) -> dict[tuple[int, int], tuple[Floats, Floats]]:
        """Displacement of the minus and plus face of the teeth within `reach` of the loaded one."""
        faces = ring_faces(self.stiffness, self.face_load, teeth, reach)
        return {(offset, 0): (faces[offset], faces[offset + 1]) for offset in range(-reach, reach + 1)}

    def ring_torque(self) -> Floats:
        """Torque of the reaction at the held surface of the whole ring per unit nodal load."""
        minus, plus = np.split(self.static_torque, 2)
        return np.asarray(self.fixed_torque + (minus + plus) @ uniform_faces(self.stiffness, self.face_load))

    def open_faces(self, teeth: int) -> tuple[dict[tuple[int, int], tuple[Floats, Floats]], Floats]:
        """Face displacements of an open chain of sectors with free ends, for every loaded tooth.

        Also the torque of the reaction at the held surface when the middle tooth is loaded.
        """
        middle = teeth // 2
        by_load = open_chain_faces(self.stiffness, self.face_load, teeth)
        faces = {
            (read - middle, loaded - middle): (chain[read], chain[read + 1])
            for loaded, chain in enumerate(by_load)
            for read in range(teeth)
        }
        minus, plus = np.split(self.static_torque, 2)
        torque = self.fixed_torque.copy()
        for read in range(teeth):
            torque += minus @ by_load[middle][read] + plus @ by_load[middle][read + 1]
        return faces, torque

    def displacement(self, loaded: bool, minus: Floats, plus: Floats) -> Floats:
        """Compliance (read node, loaded node): at depth under tent loads on the own tooth, on the surface elsewhere."""
        half = len(minus)
        if loaded:
            # The displacement with fixed faces and what the faces add. Tent loads are spread over nodes: the half-space
            # solution that is taken out has the same loads.
            nodal = self.fixed_depth + self.static_depth[:, :half] @ minus + self.static_depth[:, half:] @ plus
            return np.asarray(nodal @ self.weights)
        return np.asarray(self.static_surface[:, :half] @ minus + self.static_surface[:, half:] @ plus)


def _unknowns(nodes: Integers) -> Integers:
    return np.asarray((3 * nodes[:, None] + np.arange(3)).ravel())


def _turned_face(mesh: SectorMesh) -> scipy.sparse.csc_matrix:
    """Face unknowns (minus, plus) from face unknowns with the plus face in the frame of the next sector."""
    pitch = mesh.gear.angular_pitch
    rotation = np.array([[np.cos(pitch), -np.sin(pitch), 0], [np.sin(pitch), np.cos(pitch), 0], [0, 0, 1]])
    nodes = len(mesh.cut_nodes(1))
    parts = [scipy.sparse.identity(3 * nodes), scipy.sparse.kron(scipy.sparse.identity(nodes), rotation)]
    return scipy.sparse.csc_matrix(scipy.sparse.block_diag(parts))


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


def _torque_functional(mesh: SectorMesh) -> Floats:
    """Displacements of a unit rotation about the axis: their product with forces is the torque."""
    x, y, _ = mesh.points.T
    return np.stack([-y, x, np.zeros_like(x)], axis=-1).ravel()


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
