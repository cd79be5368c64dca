"""Elasticity of shafts turned on a lathe: finite elements over the half-section, Fourier harmonics around it.

The solid is axially symmetric, its displacement is not. Written in harmonics around the axis the three-dimensional
problem falls into small ones over the half-section (r, z): bending (n = 1), torsion and stretching (n = 0). They
are exact in the angle, so that a shaft needs about a tenth of the unknowns of a solid mesh on the same lines and has
no facets and no preferred direction.

Bending uses u_r = U cos(phi), u_phi = V sin(phi), u_z = W cos(phi) for a motion along x (turned by a right angle for
y) with the unknowns A = (U - V)/2, S = (U + V)/2 and W: a translation is A = 1, on the axis S = W = 0.

Gyroscopic terms follow from the velocity Omega z x x + u_t + Omega (x d_y - y d_x) u of a particle that passes a fixed
point of space. What is quadratic in Omega, this convection and the stiffness by centrifugal tension, cancels for
rigid tilts and is left out together, as is usual in rotor dynamics (Friswell et al., Dynamics of Rotating Machines,
2010).

Meshes are made over cylinders: those that each section has where it begins, pushed on by all cones before it. At every
place along the shaft the map stretches radii piece by piece, and between the ends of a section it changes evenly, so
that edges of elements stay straight and follow the cone exactly.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import scipy

from exugear.system.bodies.lazy import lazy_import
from exugear.system.bodies.shaft_sections import (
    SAME,
    STANDARD_SIZE,
    MeshSize,
    SeatBand,
    ShaftSection,
    check_sections,
    locate,
)
from exugear.system.bodies.solid_elements import SolidError
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix

if TYPE_CHECKING:
    import skfem
else:
    skfem = lazy_import("skfem")


@dataclass(frozen=True)
class _Stretch:
    """Radii of the shaft over those of its cylinders at one place: straight between knots, shifted beyond the last."""

    cylinders: Floats
    radii: Floats

    def radius(self, cylinder: Floats) -> Floats:
        """Radius of the shaft."""
        beyond = np.maximum(cylinder - self.cylinders[-1], 0.0)
        return np.asarray(np.interp(cylinder, self.cylinders, self.radii) + beyond)

    def cylinder(self, radius: Floats) -> Floats:
        """Radius among the cylinders."""
        beyond = np.maximum(radius - self.radii[-1], 0.0)
        return np.asarray(np.interp(radius, self.radii, self.cylinders) + beyond)


class Tapers:
    """Radii of a shaft with cones over those of a shaft of cylinders.

    Parameters
    ----------
    sections : from the beginning at z = 0 on

    Attributes
    ----------
    outer, inner : (s,)
        Radii of the cylinders that stand for the sections, m.

    Examples
    --------
    >>> cone = Tapers([ShaftSection(1.0, 0.2, 0.0, 0.1), ShaftSection(1.0, 0.1)])
    >>> cone.outer
    array([0.1, 0.1])
    >>> cone.radius(np.array([0.1, 0.05, 0.1]), np.array([0.5, 0.5, 1.5]))
    array([0.075 , 0.0375, 0.05  ])
    """

    def __init__(self, sections: Sequence[ShaftSection]) -> None:
        self._ends = np.concatenate([[0.0], np.cumsum([section.length for section in sections])])
        self._stretches = [_Stretch(np.zeros(1), np.zeros(1))]
        outer = []
        inner = []
        for section in sections:
            last = self._stretches[-1]
            begins = 0.5 * np.array([section.inner_diameter, section.outer_diameter])
            cylinders = last.cylinder(begins)
            inner.append(float(cylinders[0]))
            outer.append(float(cylinders[1]))
            self._stretches.append(_stretched(last, section, begins, cylinders) if section.is_cone else last)
        self.outer, self.inner = np.array(outer), np.array(inner)

    def radius(self, cylinder: Floats, z: Floats) -> Floats:
        """Radii of the shaft at places z (m) for radii among the cylinders (m)."""
        number = np.clip(np.searchsorted(self._ends, z, side="right") - 1, 0, len(self.outer) - 1)
        found = np.empty(np.broadcast(cylinder, z).shape)
        for section in np.unique(number):
            here = number == section
            low = self._ends[section]
            high = self._ends[section + 1]
            share = np.clip((z[here] - low) / (high - low), 0.0, 1.0)
            before, after = (stretch.radius(cylinder[here]) for stretch in self._stretches[section : section + 2])
            found[here] = before + share * (after - before)
        return found

    def cylinder_at(self, boundary: int, radius: float) -> float:
        """Radius among the cylinders where a section with a number begins, for one of the shaft, m."""
        return float(self._stretches[boundary].cylinder(np.array([radius]))[0])


def _stretched(last: _Stretch, section: ShaftSection, begins: Floats, cylinders: Floats) -> _Stretch:
    """Stretch at the end of a cone: its radii become those there; what is thinner stretches, what is thicker shifts."""
    knots = np.unique(np.concatenate([last.cylinders, cylinders]))
    ends = 0.5 * np.array([section.inner_end, section.outer_end])
    # A section without bore has no knot for it but the axis.
    bored = int(begins[0] == 0.0)
    stretch = _Stretch(np.concatenate([[0.0], begins[bored:]]), np.concatenate([[0.0], ends[bored:]]))
    return _Stretch(knots, stretch.radius(last.radius(knots)))


HarmonicName = Literal["bending", "torsion", "stretching"]
FIELDS: dict[HarmonicName, int] = {"bending": 3, "torsion": 1, "stretching": 2}
"""Unknowns at each node."""
GRADING = 0.35
"""Ratio of neighbouring element sizes towards a re-entrant corner."""
INTEGRATION_ORDER = 5
"""Exact for the mass matrix but for the factor r; the strains' 1/r is no polynomial anyway."""


@dataclass(frozen=True)
class Harmonic:
    """One harmonic of a shaft as matrices over its n free unknowns."""

    name: HarmonicName
    """What it describes."""
    mass: SparseMatrix
    stiffness: SparseMatrix
    """(n, n) sparse, kg and N/m."""
    gyroscopic: SparseMatrix | None
    """(n, n) sparse symmetric g of M q'' - 2 i Omega g q' + K q, q = q_x + i q_y; None but for bending."""
    seats: Floats
    """(s, n) averages over the seats: per seat displacement and tilt (bending), twist, or axial displacement."""
    rigid: Floats
    """(n, k) rigid motions: along x and tilt about the origin (bending), turn, or along z."""


@dataclass(frozen=True)
class Outline:
    """Boundary of a half-section: places (m), nodes, edges as pairs of places, and the element along each edge."""

    r: Floats
    z: Floats
    nodes: Integers
    edges: Integers
    elements: Integers


class Shaft:
    """The half-section of a shaft, meshed.

    Parameters
    ----------
    sections : from the beginning at z = 0 on
    seats : element boundaries fall on the edges of each band

    Raises
    ------
    ShaftError
        Sections that do not touch each other, or a seat outside the shaft or across a step.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Material
    >>> shaft = Shaft([ShaftSection(1.2, 0.08)], Material(), [SeatBand("left", 0.0), SeatBand("right", 1.2)])
    >>> torsion = shaft.harmonic("torsion")
    >>> turn = torsion.rigid[:, 0]
    >>> round(float(turn @ torsion.mass @ turn), 6)  # polar inertia, kg m2
    0.03788
    """

    def __init__(
        self,
        sections: Sequence[ShaftSection],
        material: Material,
        seats: Sequence[SeatBand],
        size: MeshSize = STANDARD_SIZE,
    ) -> None:
        self.sections = tuple(sections)
        self.material = material
        self.seats = tuple(seats)
        self.size = size
        self._ends = np.concatenate([[0.0], np.cumsum([section.length for section in sections])])
        check_sections(self.sections)
        self._bands = [self._locate(seat) for seat in self.seats]
        self.tapers = Tapers(self.sections)
        radii, heights = self._lines()
        # Quadrilaterals over the steel of the half-section.
        r_middle, z_middle = np.meshgrid(
            (radii[1:] + radii[:-1]) / 2.0, (heights[1:] + heights[:-1]) / 2.0, indexing="ij"
        )
        number = np.clip(np.searchsorted(self._ends, z_middle) - 1, 0, len(self.sections) - 1)
        i, j = np.nonzero(np.asarray((r_middle < self.tapers.outer[number]) & (r_middle > self.tapers.inner[number])))
        count = len(heights)
        corners = np.stack([i * count + j, (i + 1) * count + j, (i + 1) * count + j + 1, i * count + j + 1])
        used, numbers = np.unique(corners, return_inverse=True)
        points = np.stack([radii[used // count], heights[used % count]])
        self.lines = skfem.MeshQuad(points, numbers.reshape(corners.shape))
        self.mesh = self._tapered(self.lines)
        self.basis = skfem.Basis(self.mesh, skfem.ElementQuad2(), intorder=INTEGRATION_ORDER)
        self.nodes: Floats = np.asarray(self.basis.doflocs)
        # Radius of each node among the cylinders that stand for the sections.
        same = self.basis
        if self.mesh is not self.lines:
            same = skfem.Basis(self.lines, skfem.ElementQuad2(), intorder=INTEGRATION_ORDER)
        self._cylinder: Floats = np.asarray(same.doflocs[0])

    @property
    def length(self) -> float:
        """Overall length, m."""
        return float(self._ends[-1])

    def section_under(self, seat: SeatBand) -> ShaftSection:
        """Return the section that a seat lies on: the thicker one where it is a plane between two."""
        return self.sections[self._locate(seat)[0]]

    def _tapered(self, lines: Any) -> Any:
        """Mesh of the half-section from that of the cylinders which stand for it."""
        if not any(section.is_cone for section in self.sections):
            return lines
        r, z = np.asarray(lines.p)
        return skfem.MeshQuad(np.stack([self.tapers.radius(r, z), z]), lines.t)

    def _locate(self, seat: SeatBand) -> tuple[int, float, float]:
        return locate(self.sections, seat)

    def _lines(self) -> tuple[Floats, Floats]:
        """Lines of the mesh over the radius and along the axis, closing in on re-entrant corners."""
        shoulder_z = set()
        corner_r = set()
        for number, (left, right) in enumerate(zip(self.sections[:-1], self.sections[1:], strict=True), start=1):
            if abs(left.outer_end - right.outer_diameter) > SAME:
                corner_r.add(self.tapers.cylinder_at(number, min(left.outer_end, right.outer_diameter) / 2.0))
                shoulder_z.add(float(self._ends[number]))
            if abs(left.inner_end - right.inner_diameter) > SAME:
                corner_r.add(self.tapers.cylinder_at(number, max(left.inner_end, right.inner_diameter) / 2.0))
                shoulder_z.add(float(self._ends[number]))
        edges = [edge for _, low, high in self._bands for edge in (low, high)]
        radii = [*self.tapers.outer, *self.tapers.inner]
        return (
            _graded_line(radii, corner_r, self.size.radial, self.size.grading),
            _graded_line([*self._ends, *edges], shoulder_z, self.size.axial, self.size.grading),
        )

    @cached_property
    def _fields(self) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Values, slopes along r and along z (elements, points, 9), radius and weight r dr dz (elements, points)."""
        basis = self.basis
        values = np.stack([np.broadcast_to(b[0], basis.dx.shape) for b in basis.basis], axis=-1)
        slopes = np.stack([b[0].grad for b in basis.basis], axis=-1)
        radius = np.asarray(basis.global_coordinates())[0]
        return values, slopes[0], slopes[1], radius, radius * basis.dx

    def strains(self, harmonic: HarmonicName, points: tuple[Floats, Floats, Floats, Floats] | None = None) -> Floats:
        """Strain amplitudes per unknown, (elements, points, 6, 9 fields): rr, phi phi, zz, rz, r phi, phi z.

        Parameters
        ----------
        points : values, slopes along r and z (elements, points, 9), radius (elements, points)
            Of the shape functions; the integration points by default.
        """
        n, n_r, n_z, r = self._fields[:4] if points is None else points
        over_r = n / r[..., None]
        fields = FIELDS[harmonic]
        e = np.zeros((*n.shape[:2], 6, n.shape[2], fields))
        if harmonic == "bending":  # unknowns A, S, W: U = S + A, V = S - A
            e[:, :, 0, :, 0], e[:, :, 0, :, 1] = n_r, n_r
            e[:, :, 1, :, 1] = 2.0 * over_r
            e[:, :, 2, :, 2] = n_z
            e[:, :, 3, :, 0], e[:, :, 3, :, 1], e[:, :, 3, :, 2] = n_z, n_z, n_r
            e[:, :, 4, :, 0], e[:, :, 4, :, 1] = -n_r, n_r - 2.0 * over_r
            e[:, :, 5, :, 0], e[:, :, 5, :, 1], e[:, :, 5, :, 2] = -n_z, n_z, -over_r
        elif harmonic == "torsion":  # unknown V
            e[:, :, 4, :, 0], e[:, :, 5, :, 0] = n_r - over_r, n_z
        else:  # unknowns U, W
            e[:, :, 0, :, 0], e[:, :, 1, :, 0], e[:, :, 2, :, 1] = n_r, over_r, n_z
            e[:, :, 3, :, 0], e[:, :, 3, :, 1] = n_z, n_r
        return e.reshape(*n.shape[:2], 6, -1)

    @property
    def elasticity(self) -> Floats:
        """Stress by strain (6, 6), Pa, engineering shear strains."""
        e = self.material.youngs_modulus
        nu = self.material.poissons_ratio
        shear = e / (2.0 * (1.0 + nu))
        lame = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
        d = np.diag([2.0 * shear] * 3 + [shear] * 3)
        d[:3, :3] += lame
        return d

    def harmonic(self, harmonic: HarmonicName) -> Harmonic:
        """Matrices, seat averages and rigid motions of one harmonic."""
        n, _, _, _, weight = self._fields
        around = math.pi if harmonic == "bending" else 2.0 * math.pi
        strain = self.strains(harmonic)
        stress = np.einsum("st,epti->epsi", self.elasticity, strain)
        size = strain.shape[-1]
        flat = strain.reshape(len(strain), -1, size)
        weighted = (stress * (around * weight)[..., None, None]).reshape(len(strain), -1, size)
        stiffness = flat.transpose(0, 2, 1) @ weighted
        scalar = (n.transpose(0, 2, 1) * (self.material.density * around * weight)[:, None, :]) @ n
        inertia = {"bending": [2.0, 2.0, 1.0], "torsion": [1.0], "stretching": [1.0, 1.0]}[harmonic]
        free = self.free_unknowns(harmonic)
        gyroscopic = None
        if harmonic == "bending":
            gyroscopic = self._gather(_repeat_for_fields(scalar, [0.0, 4.0, 1.0]), 3, free)
        return Harmonic(
            name=harmonic,
            mass=self._gather(_repeat_for_fields(scalar, inertia), len(inertia), free),
            stiffness=self._gather(stiffness, len(inertia), free),
            gyroscopic=gyroscopic,
            seats=self._seat_rows(harmonic)[:, free],
            rigid=self._rigid(harmonic)[free],
        )

    def free_unknowns(self, harmonic: HarmonicName) -> Integers:
        """Unknowns that the axis leaves free, numbered field by field within each node."""
        on_axis = self.nodes[0] < SAME
        held = {"bending": [False, True, True], "torsion": [True], "stretching": [True, False]}[harmonic]
        return np.flatnonzero(~(on_axis[:, None] & np.array(held)).ravel())

    def _gather(self, blocks: Floats, fields: int, free: Integers) -> SparseMatrix:
        """Sparse matrix over the free unknowns from one block per element (elements, 9 fields, 9 fields)."""
        dofs = (np.asarray(self.basis.element_dofs).T[:, :, None] * fields + np.arange(fields)).reshape(len(blocks), -1)
        rows = np.broadcast_to(dofs[:, :, None], blocks.shape).ravel()
        columns = np.broadcast_to(dofs[:, None, :], blocks.shape).ravel()
        size = fields * self.nodes.shape[1]
        whole = scipy.sparse.csr_array((blocks.ravel(), (rows, columns)), shape=(size, size))
        gathered = whole[free][:, free]
        return scipy.sparse.csr_array(0.5 * (gathered + gathered.T))

    def _rigid(self, harmonic: HarmonicName) -> Floats:
        """Rigid motions over all unknowns, about the origin."""
        r, z = self.nodes
        zero = np.zeros_like(r)
        one = np.ones_like(r)
        fields: dict[HarmonicName, list[list[Floats]]] = {
            "bending": [[one, zero, zero], [z, zero, -r]],
            "torsion": [[r]],
            "stretching": [[zero, one]],
        }
        motions: list[Floats] = [np.stack(columns, axis=1).ravel() for columns in fields[harmonic]]
        return np.stack(motions, axis=1)

    def _seat_rows(self, harmonic: HarmonicName) -> Floats:
        """Seat averages over all unknowns: the rigid motion nearest to the surface's, area by area (RBE3)."""
        fields = FIELDS[harmonic]
        rows = []
        for seat, (section, low, high) in zip(self.seats, self._bands, strict=True):
            nodes, weight = self._surface(seat, section, low, high)
            r = self.nodes[0, nodes]
            arm = self.nodes[1, nodes] - seat.z
            weight = weight / weight.sum()
            if harmonic == "bending":
                inertia = weight @ (arm**2 + r**2 / 2.0)
                row = np.zeros((fields, self.nodes.shape[1]))
                tilt = np.zeros((fields, self.nodes.shape[1]))
                row[0, nodes] = weight
                tilt[0, nodes], tilt[2, nodes] = weight * arm / inertia, -0.5 * weight * r / inertia
                rows += [row.T.ravel(), tilt.T.ravel()]
            else:
                row = np.zeros((fields, self.nodes.shape[1]))
                row[-1, nodes] = weight * r / (weight @ r**2) if harmonic == "torsion" else weight
                rows.append(row.T.ravel())
        return np.array(rows).reshape(len(rows), fields * self.nodes.shape[1])

    def _surface(self, seat: SeatBand, section: int, low: float, high: float) -> tuple[Integers, Floats]:
        """Nodes of a seat's surface and their share of its area, by Simpson's rule over each element's edge.

        On a cone their share of its length, so that the seat's centre stays in its middle.
        """
        (r, z), cylinder = self.nodes, self._cylinder
        outer = self.tapers.outer[section]
        inner = self.tapers.inner[section]
        if seat.width > 0.0:
            on = (np.abs(cylinder - outer) < SAME) & (z > low - SAME) & (z < high + SAME)
        else:
            on = np.abs(z - seat.z) < SAME
            on &= (cylinder < outer + SAME) & (cylinder > inner - SAME)
        along = z if seat.width > 0.0 else r
        nodes = np.flatnonzero(on)
        nodes = nodes[np.argsort(along[nodes])]
        edges = np.diff(along[nodes[::2]])
        weight = np.zeros(nodes.size)
        for offset, share in ((0, 1.0), (1, 4.0), (2, 1.0)):
            weight[offset : offset + 2 * edges.size - 1 : 2] += share / 6.0 * edges
        on_cone = seat.width > 0.0 and self.sections[section].is_cone
        return nodes, weight if on_cone else weight * r[nodes]

    def outline(self) -> Outline:
        """Boundary of the half-section, the axis left out."""
        facets = self.mesh.boundary_facets()
        ends = self.mesh.facets[:, facets]
        off_axis = self.mesh.p[0, ends].max(axis=0) > SAME
        facets = facets[off_axis]
        ends = ends[:, off_axis]
        vertices, edges = np.unique(ends, return_inverse=True)
        return Outline(
            r=np.asarray(self.mesh.p[0, vertices]),
            z=np.asarray(self.mesh.p[1, vertices]),
            nodes=np.asarray(self.basis.nodal_dofs[0, vertices]),
            edges=edges.reshape(ends.shape).T,
            elements=np.asarray(self.mesh.f2t[0, facets]),
        )

    def displacement(self, harmonic: HarmonicName, nodes: Integers, shapes: Floats) -> Floats:
        """Amplitudes of u_r, u_phi, u_z (nodes, 3, k) at nodes for shapes (free unknowns, k)."""
        values = self._whole(harmonic, shapes)[nodes]
        zero = np.zeros_like(values[:, 0])
        if harmonic == "bending":
            a = values[:, 0]
            s = values[:, 1]
            w = values[:, 2]
            return np.stack([s + a, s - a, w], axis=1)
        if harmonic == "torsion":
            return np.stack([zero, values[:, 0], zero], axis=1)
        return np.stack([values[:, 0], zero, values[:, 1]], axis=1)

    def strain_at_edges(self, harmonic: HarmonicName, elements: Integers, shapes: Floats) -> Floats:
        """Strain amplitudes (elements, 6, k) in the middle of elements for shapes (free unknowns, k)."""
        middle = skfem.Basis(
            self.mesh, skfem.ElementQuad2(), quadrature=(np.array([[0.5], [0.5]]), np.ones(1)), elements=elements
        )
        values = np.stack([np.broadcast_to(b[0], middle.dx.shape) for b in middle.basis], axis=-1)
        slopes = np.stack([b[0].grad for b in middle.basis], axis=-1)
        radius = np.asarray(middle.global_coordinates())[0]
        strain = self.strains(harmonic, (values, slopes[0], slopes[1], radius))[:, 0]
        local = self._whole(harmonic, shapes)[np.asarray(self.basis.element_dofs)[:, elements].T]
        return np.asarray(strain @ local.reshape(len(elements), -1, shapes.shape[1]))

    def _whole(self, harmonic: HarmonicName, shapes: Floats) -> Floats:
        """Shapes over all unknowns (nodes, fields, k), zero where the axis holds them."""
        fields = FIELDS[harmonic]
        values = np.zeros((fields * self.nodes.shape[1], shapes.shape[1]))
        values[self.free_unknowns(harmonic)] = shapes
        return values.reshape(self.nodes.shape[1], fields, -1)


def _repeat_for_fields(scalar: Floats, factors: Sequence[float]) -> Floats:
    """Element matrices (elements, 9 f, 9 f) of f fields that do not couple, from the scalar one (elements, 9, 9)."""
    return np.asarray(np.kron(scalar, np.diag(factors)))


def _graded_line(breaks: Sequence[float], corners: set[float], size: float, grading: int) -> Floats:
    """Lines over an axis: on all breaks, no farther apart than `size`, closing in on the corners."""
    unique: list[float] = []
    for place in sorted(breaks):
        if not unique or place - unique[-1] > SAME:
            unique.append(place)
    lines = [unique[0]]
    for low, high in itertools.pairwise(unique):
        ends = [any(abs(end - corner) < SAME for corner in corners) for end in (low, high)]
        room = min(size, (high - low) / (2.0 if all(ends) else 1.0))
        closing = room * GRADING ** np.arange(grading, 0, -1)
        left = low + closing if ends[0] else np.array([low])
        right = high - closing if ends[1] else np.array([high])
        start = left.max(initial=low)
        stop = right.min(initial=high)
        between = np.linspace(start, stop, 1 + max(1, math.ceil((stop - start) / size - SAME)))
        inside = np.unique(np.concatenate([left, between, right, [high]]))
        lines += inside[inside > low].tolist()
    return np.array(lines)


CORE = 0.5
"""Radius of the square core of a solid section over that of its first ring of lines."""
BULGE = 0.5
"""How far the sides of the core lean towards a circle: 0 is a square, 1 a circle without corners."""


def turned_hexahedra(shaft: Shaft, around: int = 8) -> Any:
    """Mesh a turned shaft with hexahedra on the lines of its half-section.

    A section without bore has a square core with bulging sides, which the first ring surrounds; all other rings are
    those of the half-section. All nodes lie on true circles.

    Parameters
    ----------
    shaft : its axis is the z axis, its beginning z = 0
    around : elements around, a multiple of 8. The mass is 0.08 % short with 8, 0.005 % with 16.

    Returns
    -------
    skfem.MeshHex2

    Raises
    ------
    SolidError
        `around` is not a multiple of 8.
    """
    if around < 8 or around % 8:
        raise SolidError(f"{around} elements around a shaft: it must be a multiple of 8")
    corners = np.asarray(shaft.lines.p)[:, np.asarray(shaft.lines.t)]
    radii, heights = (np.unique(np.round(np.asarray(line) / SAME)) * SAME for line in shaft.lines.p)
    middle = corners.mean(axis=1)
    rings = np.searchsorted(radii, middle[0]) - 1
    layers = np.searchsorted(heights, middle[1]) - 1
    on_axis = bool(radii[0] < SAME)
    points, faces, level = _square_rings(around, len(radii) if on_axis else len(radii) + 1)
    # Level 0 is the core, level 1 the ring about it: both fill the first cell of the half-section.
    ring_of = np.maximum(level - 1, 0) if on_axis else level - 2
    count = len(points)
    bricks = [
        np.hstack([faces[ring_of == ring] + count * layer, faces[ring_of == ring] + count * (layer + 1)])
        for ring, layer in zip(rings, layers, strict=True)
    ]
    used, numbers = np.unique(np.concatenate(bricks), return_inverse=True)
    logical = np.column_stack([points[used % count], heights[used // count]])
    from fe_ste.elasticity.bricks import skfem_mesh

    mesh = skfem.MeshHex2.from_mesh(skfem_mesh(logical, numbers.reshape(-1, 8)))
    circles = np.concatenate([[0.0], radii[1:]]) if on_axis else np.concatenate([[0.0], radii])
    x, y, z = np.asarray(mesh.doflocs)
    ring = np.maximum(np.abs(x), np.abs(y))
    safe = np.where(ring > 0.0, ring, 1.0)
    sideways = np.abs(x) < np.abs(y)
    angle = np.pi / 4.0 * np.where(sideways, x, y) / safe * np.sign(np.where(sideways, y, x))
    direction = np.where(
        sideways,
        np.sign(y) * np.array([np.sin(angle), np.cos(angle)]),
        np.sign(x) * np.array([np.cos(angle), np.sin(angle)]),
    )
    square = np.array([x, y]) / safe / np.sqrt(2.0)
    bulging = CORE * circles[1] * ((1.0 - BULGE * ring) * square + BULGE * ring * direction)
    inside = ring * bulging
    edge = CORE * circles[1] * ((1.0 - BULGE) * square + BULGE * direction)
    share = np.clip(ring - 1.0, 0.0, 1.0)
    between = (1.0 - share) * edge + share * circles[1] * direction
    radius = np.interp(ring, 1.0 + np.arange(len(circles)), circles)
    plane = np.where(ring <= 1.0, inside, np.where(ring <= 2.0, between, radius * direction))
    return skfem.MeshHex2(_tapered(shaft, np.vstack([plane, z])), mesh.t)


def _tapered(shaft: Shaft, points: Floats) -> Floats:
    """Move points (3, n) of a shaft of cylinders out or in to those of its cones."""
    if shaft.mesh is shaft.lines:
        return points
    x, y, z = points
    cylinder = np.hypot(x, y)
    scale = shaft.tapers.radius(cylinder, z) / np.where(cylinder > 0.0, cylinder, 1.0)
    return np.vstack([x * scale, y * scale, z])


def _square_rings(around: int, levels: int) -> tuple[Floats, Integers, Integers]:
    """Square of logical rings: points (n, 2), faces (f, 4), level (f,) of each face; level 0 is the core.

    A point at the largest coordinate s lies on ring s, and at 45 degrees times the smaller coordinate over s.
    """
    side = around // 8
    core = np.linspace(-1.0, 1.0, 2 * side + 1)
    x, y = np.meshgrid(core, core, indexing="ij")
    grid = np.arange(x.size).reshape(x.shape)
    faces = [np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)]
    border = np.concatenate([grid[:-1, 0], grid[-1, :-1], grid[:0:-1, -1], grid[0, :0:-1]])
    points = [np.stack([x.ravel(), y.ravel()], axis=1)]
    unit = points[0][border]
    inner = border
    total = x.size
    for level in range(1, levels):
        points.append((level + 1.0) * unit)
        outer = total + np.arange(around)
        faces.append(np.stack([inner, outer, np.roll(outer, -1), np.roll(inner, -1)], axis=1))
        inner = outer
        total = total + around
    numbers = np.repeat(np.arange(levels), [len(f) for f in faces])
    return np.concatenate(points), np.concatenate(faces).astype(np.int64), numbers
