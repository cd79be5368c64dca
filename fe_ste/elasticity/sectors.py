"""Open sectors of some neighbouring teeth of both gears, as they stand in the pair, fine where flanks touch.

Frame and tooth numbers are those of `fe_ste.contact.kinematics`. In each layer the flank nodes gather about the contact
line of that layer; the cut faces between teeth do not move with them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fe_ste.elasticity.hexmesh import MeshSettings, SectorMesh, refined_sector_mesh, sector_mesh
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import Displayed

#: Corners of the six faces of a hexahedron in VTK order, counter-clockwise seen from outside.
HEXAHEDRON_FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])

#: Part of a flank's length by which a contact line may lie outside the flank for the flank to be refined still.
_LINE_MARGIN = 0.1


@dataclass(frozen=True)
class ContactMesh:
    """Numbers of elements of a sector that is refined where its flanks touch.

    Examples
    --------
    >>> ContactMesh().refined(1.5).layers
    9
    """

    layers: int = 6
    """Elements along the face width."""
    contact_elements: float = 5.0
    """Elements across the Hertzian contact width."""
    band: float = 1.6
    """Half width of the uniformly fine band about the contact line, in Hertzian half widths."""
    growth: float = 0.6
    """Growth of the element size per length beyond the band."""
    thickness: int = 9
    fillet: int = 4
    root: int = 3
    rim: int = 10
    """As in `fe_ste.elasticity.hexmesh.MeshSettings`; through the tooth, elements are graded towards the loaded
    flank."""
    far_flank: int = 6
    """Elements along flanks that do not touch; others have no fewer."""

    def __post_init__(self) -> None:
        """Refuse what no mesh can have; the counts are checked with the mesh."""
        if not (self.contact_elements >= 1.0 and self.band >= 1.0 and self.growth > 0.0):
            raise ValueError("contact_elements and band must be at least 1, growth positive")

    def refined(self, factor: float) -> ContactMesh:
        """Return the settings with every element size divided by about `factor`."""
        names = ("layers", "thickness", "fillet", "root", "rim", "far_flank")
        counts = {name: math.ceil(getattr(self, name) * factor) for name in names}
        return replace(self, contact_elements=self.contact_elements * factor, growth=self.growth / factor, **counts)


@dataclass(frozen=True)
class OpenSector(Displayed):
    """Bricks of some neighbouring teeth of one gear, in its place in the pair."""

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

    @property
    def facets(self) -> Integers:
        """Nodes (k, 4) of the loaded flanks' faces, counter-clockwise seen from outside."""
        element, face = self.contact_faces.T
        return np.asarray(self.hexahedra[element[:, None], HEXAHEDRON_FACES[face]])

    def _line(self) -> str:
        nodes = len(self.points)
        elements = len(self.hexahedra)
        faces = len(self.tooth)
        return f": {nodes} nodes, {elements} hexahedra, {faces} contact faces"


@dataclass(frozen=True)
class _Placement:
    """Where a gear of a pair stands: which it is, loaded side, angle of tooth 0, sense of the tooth numbers, axis."""

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


def placed_sectors(pair: GearPair, settings: MeshSettings, teeth: int, pmc: float) -> tuple[OpenSector, OpenSector]:
    """Both gears in the conjugate position `pmc`, every tooth meshed alike.

    Parameters
    ----------
    teeth : odd number of teeth of each sector; tooth pair 0, in the middle, touches at the pitch point for ``pmc = 0``
    """
    pinion, gear = (
        _joined(placement, [sector_mesh(placement.gear, settings)] * teeth) for placement in _placements(pair, pmc)
    )
    return pinion, gear


def refined_sectors(
    pair: GearPair, settings: ContactMesh, teeth: int, pmc: float, half_width: float
) -> tuple[OpenSector, OpenSector]:
    """Both gears in the conjugate position `pmc`, fine about the contact lines.

    Parameters
    ----------
    teeth : odd number of teeth of each sector
    half_width : Hertzian half width of the contact, m
    """
    sectors = []
    for placement in _placements(pair, pmc):
        numbers = placement.sense * (np.arange(teeth) - teeth // 2)
        meshes = [_refined_tooth(pair, placement, settings, int(number), pmc, half_width) for number in numbers]
        sectors.append(_joined(placement, meshes))
    return sectors[0], sectors[1]


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
    smallest = 2.0 * half_width / settings.contact_elements
    band = settings.band * half_width
    if touches:
        within = 2.0 * _elements_within(length / 2.0, smallest, band, settings.growth)
        count = max(math.ceil(within), settings.far_flank)
        centres = np.clip(fraction_on_flank, 0.0, 1.0) * length
        flank_fractions = np.stack([_gathered(c, length, count, smallest, band, settings.growth) for c in centres])
    else:
        count = settings.far_flank
        flank_fractions = np.tile(np.linspace(0.0, 1.0, count + 1), (settings.layers + 1, 1))
    counts = MeshSettings(
        layers=settings.layers,
        flank=count,
        thickness=settings.thickness,
        fillet=settings.fillet,
        root=settings.root,
        rim=settings.rim,
    )
    across = _graded(settings.thickness, smallest / (0.5 * math.pi * gear.transverse_module))
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


def _joined(placement: _Placement, meshes: list[SectorMesh]) -> OpenSector:
    """Join tooth sectors, counted counter-clockwise, with the middle one at the gear's angle."""
    gear = placement.gear
    numbers = np.arange(len(meshes)) - len(meshes) // 2
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
        flank_faces = _flank_faces(mesh, placement.side)
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
    return OpenSector(
        points=all_points[kept] + np.array([placement.axis_x, 0.0, 0.0]),
        hexahedra=renumbered[np.concatenate(bricks)],
        held=np.unique(renumbered[np.concatenate(held)]),
        contact_faces=np.concatenate(faces),
        tooth=np.concatenate(tooth),
        brick_tooth=np.concatenate(brick_tooth),
    )


def _turned(points: Floats, angle: float) -> Floats:
    cosine = math.cos(angle)
    sine = math.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]]))


def _cut_face(mesh: SectorMesh, side: int) -> Integers:
    """Nodes of a cut face with those of the held surface, ordered alike on both sides."""
    section = mesh.section.plus_cut if side > 0 else mesh.section.minus_cut
    layers = np.arange(len(mesh.axial_positions)) * len(mesh.section.points)
    return np.asarray((layers[:, None] + section).ravel())


def _flank_faces(mesh: SectorMesh, side: int) -> Integers:
    on_flank = np.isin(mesh.hexahedra, mesh.flank_nodes(side))
    return np.argwhere(on_flank[:, HEXAHEDRON_FACES].all(axis=2))
