"""Hexahedra of both gears of a pair in their places: fine where flanks touch, the rest of each ring condensed.

The teeth in contact and one on either side are meshed, finely about their contact lines. The other teeth are equal
sectors of the same bricks, condensed onto the two cut faces where the meshed teeth end. So the gear is a closed ring
down to the surface that is held, whatever the depth of its body. Without these teeth the meshed ones are an open sector
with free cut faces, which bends like a wedge where the body is deep.

Frame and tooth numbers are those of `fe_ste.contact.kinematics`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy.linalg
import scipy.sparse

from fe_ste.elasticity.condensation import Chain, chain_of, sector_halves, turn_basis, turn_signs
from fe_ste.elasticity.hexmesh import MeshSettings, SectorMesh, refined_sector_mesh, sector_mesh
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin

#: Corners of the six faces of a hexahedron in VTK order, counter-clockwise seen from outside.
HEXAHEDRON_FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])

#: Part of a flank's length by which a contact line may lie outside the flank for the flank to be refined still.
_LINE_MARGIN = 0.1

#: Part of a flank's roll angle by which a contact line may lie outside the flank for the tooth to be meshed.
_MESHED_BEYOND = 0.15


@dataclass(frozen=True)
class ContactMesh:
    """Numbers of elements of a sector that is refined where its flanks touch.

    Examples
    --------
    >>> ContactMesh().refined(2.0).layers
    18
    """

    layers: int = 9
    """Elements along the face width; of helical gears with fewer, contact lines that end between two layers bear too
    little."""
    contact_elements: float = 5.0
    """Elements across the Hertzian contact width."""
    band: float = 1.6
    """Half width of the uniformly fine band about the contact line, in Hertzian half widths."""
    growth: float = 0.6
    """Growth of the element size per length beyond the band."""
    growth_through: float = 0.35
    """Growth of the element size per length from the loaded flank through the tooth."""
    thickness: int | None = None
    """Elements through the tooth; by default as many as `growth_through` asks for."""
    fillet: int = 4
    root: int = 3
    rim: int = 8
    """As in `fe_ste.elasticity.hexmesh.MeshSettings`."""
    far_flank: int = 6
    """Elements along flanks that do not touch; others have no fewer."""

    def __post_init__(self) -> None:
        """Refuse what no mesh can have; the counts are checked with the mesh."""
        if not (self.contact_elements >= 1.0 and self.band >= 1.0 and min(self.growth, self.growth_through) > 0.0):
            raise ValueError("contact_elements and band must be at least 1, growth and growth_through positive")

    def refined(self, factor: float) -> ContactMesh:
        """Return the settings with every element size divided by about `factor`."""
        thickness = self.thickness
        if thickness is not None:
            thickness = math.ceil(thickness * factor)
        return replace(
            self,
            layers=math.ceil(self.layers * factor),
            contact_elements=self.contact_elements * factor,
            growth=self.growth / factor,
            growth_through=self.growth_through / factor,
            thickness=thickness,
            fillet=math.ceil(self.fillet * factor),
            root=math.ceil(self.root * factor),
            rim=math.ceil(self.rim * factor),
            far_flank=math.ceil(self.far_flank * factor),
        )

    def smallest(self, half_width: float) -> float:
        """Return the size of the elements at the contact, m, of a Hertzian half width (m)."""
        return 2.0 * half_width / self.contact_elements

    def tooth(self, gear: Gear, flank: int, half_width: float) -> MeshSettings:
        """Return the numbers of elements of one tooth with so many along its flanks."""
        thickness = self.thickness
        if thickness is None:
            across = 0.5 * math.pi * gear.transverse_module
            thickness = math.ceil(_elements_within(across, self.smallest(half_width), 0.0, self.growth_through))
        return MeshSettings(
            layers=self.layers, flank=flank, thickness=thickness, fillet=self.fillet, root=self.root, rim=self.rim
        )


@dataclass(frozen=True)
class OtherTeeth:
    """The teeth of a gear that are not meshed: equal sectors, condensed onto the ends of those that are."""

    sector: SectorMesh
    """One of them."""
    first_angle: float
    """Angle about the gear's axis to the middle of the first one, which follows the meshed teeth, rad."""
    count: int
    nodes: Integers
    """(k,) nodes of the meshed teeth on the two cut faces, held ones left out."""
    stiffness: Floats
    """(3 k, 3 k) forces on these nodes by their displacements, the held surface at rest, N/m."""


@dataclass(frozen=True)
class GearMesh(ReprMixin):
    """Bricks of some neighbouring teeth of one gear, in its place in the pair, and its other teeth condensed."""

    points: Floats
    """(n, 3) m."""
    hexahedra: Integers
    """(m, 8)"""
    held: Integers
    """Nodes of the hub or rim surface."""
    contact_faces: Integers
    """(k, 2) element and number in `HEXAHEDRON_FACES` of the loaded flanks' faces."""
    tooth: Integers
    """(k,) tooth pair of each of these faces."""
    brick_tooth: Integers
    """(m,) tooth pair of the sector each hexahedron belongs to."""
    axis_x: float
    """Position of the gear's axis, m."""
    others: OtherTeeth | None = None
    """None for an open sector with free cut faces."""

    @property
    def facets(self) -> Integers:
        """Nodes (k, 4) of the loaded flanks' faces, counter-clockwise seen from outside."""
        element, face = self.contact_faces.T
        return np.asarray(self.hexahedra[element[:, None], HEXAHEDRON_FACES[face]])

    def _line(self) -> str:
        nodes = len(self.points)
        elements = len(self.hexahedra)
        faces = len(self.tooth)
        line = f": {nodes} nodes, {elements} hexahedra, {faces} contact faces"
        if self.others is None:
            return line
        return f"{line}, {self.others.count} teeth condensed"


@dataclass(frozen=True)
class _Placement:
    """Position of a gear in a pair: which gear, loaded side, angle of tooth 0, sense of the tooth numbers, axis."""

    number: int
    gear: Gear
    side: int
    angle: float
    sense: int
    axis_x: float


def _placements(pair: GearPair, pmc: float) -> tuple[_Placement, _Placement]:
    pinion = pair.pinion
    gear = pair.gear
    pinion_placement = _Placement(
        0, pinion, 1, pmc * pinion.angular_pitch - pinion.half_angle(pair.pinion_working_radius), 1, 0.0
    )
    half_angle = gear.half_angle(pair.gear_working_radius)
    rolled = pmc * gear.angular_pitch
    if gear.internal:
        return pinion_placement, _Placement(1, gear, -1, rolled + half_angle, 1, -pair.centre_distance)
    return pinion_placement, _Placement(1, gear, 1, math.pi - rolled - half_angle, -1, pair.centre_distance)


def placed_gears(
    pair: GearPair,
    settings: MeshSettings,
    teeth: int,
    pmc: float,
    closed: bool = True,
    others: MeshSettings | None = None,
) -> tuple[GearMesh, GearMesh]:
    """Both gears in the conjugate position `pmc`, every meshed tooth alike.

    Parameters
    ----------
    teeth : odd number of teeth that are meshed; tooth pair 0, in the middle, touches at the pitch point for ``pmc = 0``
    closed : False leaves the other teeth away
    others : of the teeth that are condensed, as `settings` by default; on the cut faces both must agree
    """
    condensed = others or settings
    pairs = range(-(teeth // 2), teeth // 2 + 1)
    pinion, gear = (
        _gear_of_sectors(placement, dict.fromkeys(pairs, sector_mesh(placement.gear, settings)), condensed, closed)
        for placement in _placements(pair, pmc)
    )
    return pinion, gear


def refined_gears(
    pair: GearPair, settings: ContactMesh, pmc: float, half_width: float, teeth: int | None = None, closed: bool = True
) -> tuple[GearMesh, GearMesh]:
    """Both gears in the conjugate position `pmc`, fine about the contact lines.

    Parameters
    ----------
    half_width : Hertzian half width of the contact, m
    teeth : odd number of teeth that are meshed; by default those of `meshed_teeth`
    closed : False leaves the other teeth away
    """
    pairs = meshed_teeth(pair, pmc)
    if teeth is not None:
        pairs = range(-(teeth // 2), teeth // 2 + 1)
    gears = []
    for placement in _placements(pair, pmc):
        others = settings.tooth(placement.gear, settings.far_flank, half_width)
        meshes = {
            placement.sense * tooth: _refined_tooth(pair, placement, settings, tooth, pmc, half_width)
            for tooth in pairs
        }
        gears.append(_gear_of_sectors(placement, meshes, others, closed))
    return gears[0], gears[1]


def meshed_teeth(pair: GearPair, pmc: float) -> range:
    """Tooth pairs that touch at `pmc`, or would if the flanks were longer by 15 % at either end.

    Under load contact begins early and ends late, by far less than that. At least one tooth of either gear is left.
    """
    axial = np.linspace(-pair.face_width / 2, pair.face_width / 2, 101)
    farthest = math.ceil(pair.total_contact_ratio) + 1
    touching = [0]
    for tooth in range(-farthest, farthest + 1):
        on_both = np.ones(len(axial), dtype=np.bool_)
        for gear, roll in zip((pair.pinion, pair.gear), contact_line_rolls(pair, tooth, pmc, axial), strict=True):
            ends = sorted((radius / gear.base_radius) ** 2 - 1.0 for radius in (gear.form_radius, gear.tip_radius))
            low, high = np.sqrt(np.maximum(ends, 0.0))
            beyond = _MESHED_BEYOND * (high - low)
            on_both &= (roll >= low - beyond) & (roll <= high + beyond)
        if on_both.any():
            touching.append(tooth)
    most = min(pair.pinion.teeth, pair.gear.teeth) - 1
    return range(min(touching), min(max(touching) + 1, min(touching) + most))


def contact_line_rolls(pair: GearPair, tooth: int, pmc: float, axial: Floats) -> tuple[Floats, Floats]:
    """Roll angles on gear 1 and gear 2 of the rigid contact line of a tooth pair at axial positions (m), rad.

    Below zero where the line lies beyond a base circle.
    """
    pinion = pair.pinion
    twist = math.tan(pinion.base_helix_angle) / pinion.base_radius
    roll = math.tan(pair.working_pressure_angle) + (pmc + tooth) * pinion.angular_pitch + twist * axial
    tangent = pair.base_tangent_length
    length = pinion.base_radius * roll
    return roll, (tangent + length if pair.gear.internal else tangent - length) / pair.gear.base_radius


def _refined_tooth(
    pair: GearPair, placement: _Placement, settings: ContactMesh, tooth: int, pmc: float, half_width: float
) -> SectorMesh:
    gear = placement.gear
    axial = np.linspace(-gear.face_width / 2, gear.face_width / 2, settings.layers + 1)
    roll = np.maximum(contact_line_rolls(pair, tooth, pmc, axial)[placement.number], 0.0)
    form, tip = ((radius / gear.base_radius) ** 2 - 1.0 for radius in (gear.form_radius, gear.tip_radius))
    length = gear.base_radius * abs(tip - form) / 2.0
    fraction_on_flank = (roll**2 - form) / (tip - form)
    touches = bool(((fraction_on_flank > -_LINE_MARGIN) & (fraction_on_flank < 1.0 + _LINE_MARGIN)).any())
    smallest = settings.smallest(half_width)
    band = settings.band * half_width
    if touches:
        within = 2.0 * _elements_within(length / 2.0, smallest, band, settings.growth)
        count = max(math.ceil(within), settings.far_flank)
        centres = np.clip(fraction_on_flank, 0.0, 1.0) * length
        flank_fractions = np.stack([_gathered(c, length, count, smallest, band, settings.growth) for c in centres])
    else:
        count = settings.far_flank
        flank_fractions = np.tile(np.linspace(0.0, 1.0, count + 1), (settings.layers + 1, 1))
    counts = settings.tooth(gear, count, half_width)
    across = _graded(counts.thickness, smallest / (0.5 * math.pi * gear.transverse_module))
    return refined_sector_mesh(gear, counts, flank_fractions, 1.0 - across[::-1] if placement.side > 0 else across)


def _elements_within(distance: float, smallest: float, band: float, growth: float) -> float:
    """Elements between the contact line and a distance from it."""
    if distance <= band:
        return distance / smallest
    return band / smallest + math.log(1.0 + growth * (distance - band) / smallest) / growth


def _gathered(centre: float, length: float, count: int, smallest: float, band: float, growth: float) -> Floats:
    """Fractions 0..1 that bound `count` elements over a length, smallest about `centre`."""
    fine = np.linspace(0.0, length, 2001)
    below = _elements_within(centre, smallest, band, growth)
    passed = np.array([_elements_within(abs(at - centre), smallest, band, growth) for at in fine])
    passed = below + np.where(fine < centre, -passed, passed)
    fractions = np.interp(np.linspace(0.0, passed[-1], count + 1), passed, fine) / length
    fractions[0], fractions[-1] = 0.0, 1.0
    return np.asarray(fractions)


def _graded(count: int, first: float) -> Floats:
    """Fractions 0..1 that bound `count` elements that grow geometrically from `first`."""
    if first * count >= 1.0:
        return np.linspace(0.0, 1.0, count + 1)
    low = 1.0
    high = 1e3
    for _ in range(200):
        ratio = 0.5 * (low + high)
        if first * np.sum(ratio ** np.arange(count)) < 1.0:
            low = ratio
        else:
            high = ratio
    sizes = low ** np.arange(count)
    return np.asarray(np.concatenate([[0.0], np.cumsum(sizes)]) / sizes.sum())


def _gear_of_sectors(
    placement: _Placement, sectors: dict[int, SectorMesh], others: MeshSettings, closed: bool
) -> GearMesh:
    """Join tooth sectors, counted counter-clockwise, number 0 at the gear's angle, and the other teeth."""
    gear = placement.gear
    numbers = np.array(sorted(sectors))
    meshes = [sectors[number] for number in numbers.tolist()]
    first_point = np.cumsum([0] + [len(mesh.points) for mesh in meshes])
    first_brick = np.cumsum([0] + [len(mesh.hexahedra) for mesh in meshes])
    points = []
    bricks = []
    held = []
    faces = []
    tooth = []
    brick_tooth = []
    for copy, (mesh, number) in enumerate(zip(meshes, numbers, strict=True)):
        points.append(_turned(mesh.points, placement.angle + number * gear.angular_pitch))
        bricks.append(mesh.hexahedra + first_point[copy])
        held.append(mesh.held_nodes + first_point[copy])
        on_flank = np.isin(mesh.hexahedra, mesh.flank_nodes(placement.side))
        flank_faces = np.argwhere(on_flank[:, HEXAHEDRON_FACES].all(axis=2))
        faces.append(flank_faces + np.array([first_brick[copy], 0]))
        tooth.append(np.full(len(flank_faces), placement.sense * number))
        brick_tooth.append(np.full(len(mesh.hexahedra), placement.sense * number))
    all_points = np.concatenate(points)
    target = np.arange(len(all_points))
    for copy in range(1, len(meshes)):
        ahead = _cut_face(meshes[copy], -1) + first_point[copy]
        behind = _cut_face(meshes[copy - 1], 1) + first_point[copy - 1]
        apart = np.abs(all_points[ahead] - all_points[behind]).max()
        if apart > 1e-9 * gear.tip_radius:
            raise ValueError(f"gear {gear.name}: neighbouring sectors are {apart:.3g} m apart")
        target[ahead] = target[behind]
    kept, renumbered = np.unique(target, return_inverse=True)
    result = GearMesh(
        points=all_points[kept] + np.array([placement.axis_x, 0.0, 0.0]),
        hexahedra=renumbered[np.concatenate(bricks)],
        held=np.unique(renumbered[np.concatenate(held)]),
        contact_faces=np.concatenate(faces),
        tooth=np.concatenate(tooth),
        brick_tooth=np.concatenate(brick_tooth),
        axis_x=placement.axis_x,
    )
    count = gear.teeth - len(meshes)
    if not closed or count == 0:
        return result
    ends = [meshes[-1].cut_nodes(1) + first_point[len(meshes) - 1], meshes[0].cut_nodes(-1)]
    first_angle = placement.angle + (numbers[-1] + 1) * gear.angular_pitch
    return replace(result, others=_other_teeth(gear, others, count, first_angle, [renumbered[end] for end in ends]))


def whole_ring(mesh: GearMesh) -> GearMesh:
    """Mesh the teeth that are condensed, too: the same gear as an ordinary mesh of bricks.

    Raises
    ------
    ValueError
        If `mesh` is an open sector.
    """
    others = mesh.others
    if others is None:
        raise ValueError("an open sector has no other teeth")
    sector = others.sector
    shift = np.array([mesh.axis_x, 0.0, 0.0])
    first_point = len(mesh.points) + len(sector.points) * np.arange(others.count)
    pitch = sector.gear.angular_pitch
    points = np.concatenate(
        [mesh.points]
        + [_turned(sector.points, others.first_angle + number * pitch) + shift for number in range(others.count)]
    )
    target = np.arange(len(points))
    behind = sector.cut_nodes(1)
    ahead = sector.cut_nodes(-1)
    target[first_point[0] + ahead], last = np.split(others.nodes, 2)
    for number in range(1, others.count):
        target[first_point[number] + ahead] = first_point[number - 1] + behind
    target[first_point[-1] + behind] = last
    # Held nodes of neighbours that coincide stay apart: nothing moves there.
    kept, renumbered = np.unique(target, return_inverse=True)
    bricks = np.concatenate([mesh.hexahedra] + [sector.hexahedra + first for first in first_point])
    held = np.concatenate([mesh.held] + [sector.held_nodes + first for first in first_point])
    no_tooth = np.full(len(bricks) - len(mesh.hexahedra), mesh.brick_tooth.max() + 1)
    return replace(
        mesh,
        points=points[kept],
        hexahedra=renumbered[bricks],
        held=np.unique(renumbered[held]),
        brick_tooth=np.concatenate([mesh.brick_tooth, no_tooth]),
        others=None,
    )


def _other_teeth(
    gear: Gear, settings: MeshSettings, count: int, first_angle: float, ends: list[Integers]
) -> OtherTeeth:
    """Condense `count` teeth onto the nodes (layers times n each) at the end and at the beginning of those meshed."""
    sector, chain = _condensed_teeth(gear, settings, count)
    layers = settings.layers + 1
    signs = turn_signs(sector)
    # By node along the face, as the unknowns of a condensed face are; nodes of a cut face come by layer.
    nodes = np.concatenate([end.reshape(layers, -1).T.ravel() for end in ends])
    beside = first_angle - gear.angular_pitch / 2
    frames = [_face_frame(sector, beside + turn) for turn in (0.0, count * gear.angular_pitch)]
    frame = scipy.linalg.block_diag(*frames)
    if len(frame) != 3 * len(nodes):
        raise ValueError(f"gear {gear.name}: the condensed teeth have another mesh on the cut faces than those meshed")
    stiffness = frame @ chain.whole(signs) @ frame.T
    by_layer = np.arange(len(nodes)).reshape(2, -1, layers).transpose(0, 2, 1).ravel()
    unknowns = (3 * by_layer[:, None] + np.arange(3)).ravel()
    return OtherTeeth(
        sector=sector,
        first_angle=first_angle,
        count=count,
        nodes=nodes[by_layer],
        stiffness=np.ascontiguousarray(stiffness[np.ix_(unknowns, unknowns)]),
    )


@lru_cache(maxsize=8)
def _condensed_teeth(gear: Gear, settings: MeshSettings, count: int) -> tuple[SectorMesh, Chain]:
    """One tooth, and as many in a row condensed onto their two ends: the same at all positions of the mesh cycle."""
    sector = sector_mesh(gear, settings)
    nothing = scipy.sparse.csr_matrix((3 * len(sector.points), 0))
    even, odd = sector_halves(sector, [nothing], incompatible_modes=True)
    return sector, chain_of(Chain(even.stiffness, odd.stiffness), count, turn_signs(sector))


def _face_frame(sector: SectorMesh, angle: float) -> Floats:
    """Displacements of the nodes of a cut face, by node, layer and direction, by its unknowns, (m, m).

    Parameters
    ----------
    angle : of the face at the middle of the face width, rad
    """
    layers = len(sector.axial_positions)
    basis, signs = turn_basis(layers)
    turned = angle + sector.twist_rate * sector.axial_positions
    turns = np.zeros((layers, 3, 3))
    turns[:, 0, 0] = turns[:, 1, 1] = np.cos(turned)
    turns[:, 1, 0], turns[:, 0, 1] = np.sin(turned), -np.sin(turned)
    turns[:, 2, 2] = 1.0
    line = (turns @ basis.reshape(layers, 3, -1)).reshape(3 * layers, -1)
    nodes = len(sector.section.plus_cut) - 1
    kept = np.tile(signs, nodes) > 0
    order = np.concatenate([np.flatnonzero(kept), np.flatnonzero(~kept)])
    return np.asarray(np.kron(np.eye(nodes), line)[:, order])


def _turned(points: Floats, angle: float) -> Floats:
    cosine = math.cos(angle)
    sine = math.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]))


def _cut_face(mesh: SectorMesh, side: int) -> Integers:
    """Nodes of a cut face with those of the held surface, ordered alike on both sides."""
    section = mesh.section.plus_cut if side > 0 else mesh.section.minus_cut
    layers = np.arange(len(mesh.axial_positions)) * len(mesh.section.points)
    return np.asarray((layers[:, None] + section).ravel())
