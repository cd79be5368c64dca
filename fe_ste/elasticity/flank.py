"""Compliance of a gear's flank: scikit-fem hexahedra of one tooth sector, condensed and closed to the full ring.

The sector's stiffness matrix is condensed onto its two cut faces; the ring of z equal sectors is then closed
exactly (ring.py). What is stored per gear is the
normal displacement of the flank of each tooth under unit normal loads on the flank of one tooth, from which the
mesh-dependent near field of the loaded tooth is taken out: the contact solver puts the half-space solution there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse

from fe_ste.elasticity.bricks import stiffness_matrix
from fe_ste.elasticity.halfspace import tent_displacements, tent_weights
from fe_ste.elasticity.hexmesh import MeshSettings, SectionMesh, SectorMesh, sector_mesh
from fe_ste.elasticity.ring import open_chain_faces, ring_faces, uniform_faces
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.notebook import html_table, value_range
from fe_ste.tools.sparse import Backend, factorise
from fe_ste.tools.threads import one_dense_thread

#: Depth below the flank at which the half-space solution hands over to the finite elements, in normal modules.
HANDOVER_DEPTH = 0.3

#: Teeth on either side of the loaded one whose displacement is kept.
TOOTH_REACH = 4


@dataclass(frozen=True)
class FlankCompliance:
    """Compliance of one flank of every tooth of a gear whose hub (or outer rim) is held.

    Attributes
    ----------
    gear : Gear
    side : int
        +1: the counter-clockwise flank of the teeth, -1: the clockwise one.
    depth : float
        Hand-over depth, m.
    mirror : float
        Strength of the image loads behind the free end faces taken out with the near field.
    roll, axial : ndarray (f,), (l,)
        Flank grid: roll angles (rad) and axial positions (m).
    regular : dict
        (tooth read, tooth loaded) -> ndarray (f l, f l), m/N. For the closed ring the key is (difference, 0).
    closed : bool
        Whether all teeth of the ring are there; else an open sector.
    hub_torque : ndarray (f l,)
        Torque of the reaction at the held surface about the axis per unit load on each flank node, m.
    figures : dict
        Unknowns, elements, least scaled Jacobian, back end.
    """

    gear: Gear
    side: int
    depth: float
    mirror: float
    roll: Floats
    axial: Floats
    regular: dict[tuple[int, int], Floats]
    closed: bool
    hub_torque: Floats
    figures: dict[str, float | int | str]

    def between(self, read: int, loaded: int) -> Floats:
        """Return the compliance of tooth `read` under loads on tooth `loaded`.

        Raises
        ------
        ValueError
            If the teeth are further apart than was computed, or outside the open sector.
        """
        return self.regular[self.key(read, loaded)]

    def key(self, read: int, loaded: int) -> tuple[int, int]:
        """Return the key of two teeth in `regular`; raises as `between` does."""
        key = (read - loaded, 0) if self.closed else (read, loaded)
        if key not in self.regular:
            raise ValueError(f"gear {self.gear.name}: no compliance between teeth {read} and {loaded}")
        return key

    @property
    def tooth_reach(self) -> int:
        """Largest number of a tooth, on either side of tooth 0, whose compliance is known."""
        return max(read for read, _ in self.regular)

    @property
    def lead(self) -> float:
        """Slope d phi / d z of a generator in flank coordinates, rad/m."""
        return _flank_lead(self.gear, self.side)

    def __repr__(self) -> str:
        """Return one short line."""
        flank = "counter-clockwise" if self.side > 0 else "clockwise"
        extent = "closed ring" if self.closed else f"open sector of {2 * self.tooth_reach + 1} teeth"
        return (
            f"<FlankCompliance of {self.gear.name!r}: {flank} flank, "
            f"{len(self.roll)} x {len(self.axial)} nodes, {extent}>"
        )

    def _repr_html_(self) -> str:
        return html_table(
            f"compliance of a flank of gear {self.gear.name}",
            {
                "flank": "counter-clockwise" if self.side > 0 else "clockwise",
                "teeth": "closed ring" if self.closed else f"open sector of {2 * self.tooth_reach + 1}",
                "nodes along the profile": str(len(self.roll)),
                "nodes along the face": str(len(self.axial)),
                "hand-over depth": value_range(self.depth, "mm", 1e3),
            }
            | {name.replace("_", " "): f"{value}" for name, value in self.figures.items()},
        )


def _flank_lead(gear: Gear, side: int) -> float:
    handed = side * (-1 if gear.internal else 1)
    return float(handed * np.tan(gear.base_helix_angle) / gear.base_radius)


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


def flank_compliance(
    gear: Gear,
    side: int = 1,
    settings: MeshSettings | None = None,
    *,
    open_teeth: int | None = None,
    incompatible_modes: bool = True,
    depth: float | None = None,
    mirror: float = 1.0,
    backend: Backend | None = None,
) -> FlankCompliance:
    """Compute the compliance of one flank of `gear` by finite elements.

    Parameters
    ----------
    gear : Gear
        Held at ``gear.held_diameter``.
    side : int
        Loaded flank: +1 counter-clockwise, -1 clockwise.
    settings : MeshSettings, optional
    open_teeth : int, optional
        Odd number of teeth of an open sector with free cut faces; without it the closed ring.
    incompatible_modes : bool
        See `stiffness_matrix`.
    depth : float, optional
        Hand-over depth, m; `HANDOVER_DEPTH` normal modules unless given.
    mirror : float
        Strength of the image loads at the free end faces in the near field.
    backend : {"pardiso", "superlu"}, optional
        Sparse solver.

    Returns
    -------
    FlankCompliance

    Raises
    ------
    ValueError
        If `open_teeth` is even, less than 1 or more than the gear has.
    """
    if open_teeth is not None and not (1 <= open_teeth <= gear.teeth and open_teeth % 2 == 1):
        raise ValueError(f"open_teeth = {open_teeth}: must be an odd number from 1 to {gear.teeth}")
    with one_dense_thread():
        return _flank_compliance(gear, side, settings, open_teeth, incompatible_modes, depth, mirror, backend)


def _flank_compliance(
    gear: Gear,
    side: int,
    settings: MeshSettings | None,
    open_teeth: int | None,
    incompatible_modes: bool,
    depth: float | None,
    mirror: float,
    backend: Backend | None,
) -> FlankCompliance:
    mesh = sector_mesh(gear, settings)
    depth = HANDOVER_DEPTH * gear.normal_module if depth is None else depth
    sector = _CondensedSector.from_mesh(mesh, side, depth, incompatible_modes, backend)
    if open_teeth is None:
        faces, torque = sector.ring_faces(gear.teeth, min(TOOTH_REACH, (gear.teeth - 2) // 2)), sector.ring_torque()
    else:
        faces, torque = sector.open_faces(open_teeth)
    regular = {}
    near = _near_field(mesh, side, depth, mirror)
    for (read, loaded), cut_faces in faces.items():
        regular[read, loaded] = sector.displacement(read == loaded, *cut_faces)
        if read == loaded:
            remainder = regular[read, loaded] - near
            regular[read, loaded] = (remainder + remainder.T) / 2
    return FlankCompliance(
        gear=gear,
        side=side,
        depth=depth,
        mirror=mirror,
        roll=mesh.section.flank_roll,
        axial=mesh.axial_positions,
        regular=regular,
        closed=open_teeth is None,
        hub_torque=torque,
        figures={
            "unknowns": 3 * len(mesh.points),
            "elements": len(mesh.hexahedra),
            "least_scaled_jacobian": float(mesh.scaled_jacobian.min()),
            "sparse_solver": sector.backend,
        },
    )


def _near_field(mesh: SectorMesh, side: int, depth: float, mirror: float) -> Floats:
    """Half-space displacement (m/N) at the hand-over depth under the tent loads."""
    gear = mesh.gear
    material = gear.material
    shift = -depth * side * np.tan(gear.base_helix_angle)
    field = tent_displacements(
        mesh.section.flank_roll,
        mesh.axial_positions,
        gear.base_radius,
        _flank_lead(gear, side),
        float(np.cos(gear.base_helix_angle)),
        depth,
        float(shift),
        material.poissons_ratio,
        mirror,
    )
    return np.asarray(field * (1 + material.poissons_ratio) / (2 * np.pi * material.youngs_modulus))


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
    targets = points - depth / np.cos(gear.base_helix_angle) * normal
    corners = section.points[section.quads]
    low, high = corners.min(axis=1), corners.max(axis=1)
    nodes, weights = np.empty((len(targets), 4), dtype=np.int64), np.empty((len(targets), 4))
    for number, target in enumerate(targets):
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
        local = local - np.clip(np.linalg.solve(jacobian, residual[..., None])[..., 0], -2.0, 2.0)
    return np.asarray(local)


@dataclass(frozen=True)
class _CondensedSector:
    """One tooth sector condensed onto its cut faces, with loads and read-outs on its flank.

    The unknowns of the +pi/z face are expressed in the frame of the next sector, so that joining two sectors means
    equating the same numbers. ``faces_*`` are m x m blocks, m unknowns a face; minus is the face at -pi/z.
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
    ) -> _CondensedSector:
        gear = mesh.gear
        stiffness = stiffness_matrix(mesh.points, mesh.hexahedra, gear.material, incompatible_modes)
        turn = _turned_face(mesh)
        faces = np.concatenate([_unknowns(mesh.cut_nodes(-1)), _unknowns(mesh.cut_nodes(1))])
        held = _unknowns(mesh.held_nodes)
        inside = np.setdiff1d(np.arange(stiffness.shape[0]), np.concatenate([faces, held]))
        to_faces = stiffness[:, faces] @ turn
        coupling = to_faces[inside].tocsc()
        surface, depth_rows = _flank_functionals(mesh, side, depth)
        torque = _torque_functional(mesh)
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
            stiffness=(condensed + condensed.T) / 2,
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


def _flank_functionals(
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
