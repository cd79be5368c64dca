"""Shapes of the bodies of a gearbox for drawing: gears with meshing teeth, plain shafts and carriers.

The frame is that of the gearbox (z along the shafts), lengths are in m. The module needs only NumPy;
`exugear.report.pictures.scene` draws the shapes and `exugear.report.web.stage` writes them into a web page.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.body_parts import blank_places
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Body, Mesh
from exugear.gearbox.units import MM
from fe_ste.geometry.gears import Gear
from fe_ste.geometry.profile import tooth_profile
from fe_ste.tools.arrays import Complexes, Floats, Integers

# Surfaces of gears, shafts and pins as triangles; z along the axis, lengths in m

TWIST_PER_LAYER = 0.06
"""Rotation of the section between successive rings of points along a helical gear, rad."""


@dataclass(frozen=True)
class TriangleSurface:
    """Triangulated surface."""

    points: Floats
    """(n, 3) m."""
    triangles: Integers
    """(m, 3)"""

    def moved(self, shift: ArrayLike) -> TriangleSurface:
        """Return a translated copy."""
        return TriangleSurface(self.points + np.asarray(shift, dtype=np.float64), self.triangles)

    @classmethod
    def joined(cls, surfaces: Sequence[TriangleSurface]) -> TriangleSurface:
        """Merge surfaces into one."""
        offsets = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
        return cls(
            np.concatenate([surface.points for surface in surfaces]),
            np.concatenate([s.triangles + offset for s, offset in zip(surfaces, offsets, strict=False)]),
        )


@lru_cache(maxsize=32)
def gear_surface(gear: Gear, angle: float = 0.0, rim_diameter: float | None = None) -> TriangleSurface:
    """Return the surface of a whole gear with its teeth, about the z axis, with z = 0 in the middle of the face width.

    Parameters
    ----------
    angle : polar angle of the middle of a tooth at z = 0, rad
    rim_diameter : bore of an external, outside diameter of an internal gear, m; by default the fixed diameter

    Examples
    --------
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> surface = gear_surface(gear)
    >>> bool(abs(np.hypot(*surface.points[:, :2].T).max() - gear.tip_radius) < 1e-12)
    True
    """
    outline = _gear_outline(gear)
    rim = 0.5 * (rim_diameter or gear.held_diameter)
    twist = math.tan(gear.base_helix_angle) / gear.base_radius * gear.face_width
    layers = max(2, 1 + math.ceil(abs(twist) / TWIST_PER_LAYER))
    heights = np.linspace(-0.5, 0.5, layers)
    polar = outline[:, 1] + angle
    toothed = np.stack([_circle(outline[:, 0], polar + twist * part, gear.face_width * part) for part in heights])
    plain = np.stack([_circle(rim, polar + twist * part, gear.face_width * part) for part in heights[[0, -1]]])
    # Walls extend around the axis; end faces join the teeth with the rim at the same polar angles.
    bands = [toothed, plain[::-1], np.stack([plain[0], toothed[0]]), np.stack([toothed[-1], plain[1]])]
    surface = TriangleSurface.joined([_band(band) for band in bands])
    for values in (surface.points, surface.triangles):
        values.flags.writeable = False  # a picture that is drawn again reads the same arrays
    return surface


def _gear_outline(gear: Gear) -> Floats:
    """Return radius and polar angle along the toothed circumference, shape (n, 2), counter-clockwise."""
    profile = tooth_profile(gear)
    fillet = profile.fillet[np.linspace(len(profile.fillet) - 1, 0, 6).astype(np.int64)[:-1]]
    from_root = np.column_stack([np.hypot(*fillet.T), np.arctan2(fillet[:, 1], fillet[:, 0])])
    radii = np.linspace(profile.form_radius, profile.tip_radius, 6)
    to_tip = np.column_stack([radii, gear.half_angle(radii)])
    side = np.concatenate([from_root, to_tip])
    tooth = np.concatenate([side * np.array([1.0, -1.0]), side[::-1]])
    starts = gear.angular_pitch * np.arange(gear.teeth)
    return np.concatenate([tooth + np.array([0.0, start]) for start in starts])


def _circle(radius: Floats | float, polar: Floats, height: float) -> Floats:
    return np.column_stack([radius * np.cos(polar), radius * np.sin(polar), np.full(polar.shape, height)])


def _band(rings: Floats) -> TriangleSurface:
    """Return closed bands between rings of equal numbers of points, shape (rings, points, 3)."""
    count, size = rings.shape[:2]
    point = np.arange(count * size).reshape(count, size)
    following = np.roll(point, -1, axis=1)
    corners = np.stack([point[:-1], following[:-1], following[1:], point[1:]], axis=-1).reshape(-1, 4)
    return TriangleSurface(rings.reshape(-1, 3), np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]))


def tube_surface(
    diameter: float, start: float, end: float, bore: float = 0.0, centre: ArrayLike = (0.0, 0.0)
) -> TriangleSurface:
    """Return the surface of a shaft, disc or pin along z.

    Parameters
    ----------
    diameter, bore : m
    start, end : z of both ends, m
    centre : (2,) x and y of its axis, m
    """
    polar = np.linspace(0.0, 2.0 * math.pi, 49)[:-1]
    corners = [(bore, start), (diameter, start), (diameter, end), (bore, end), (bore, start)]
    rings = np.stack([_circle(0.5 * size, polar, height) for size, height in corners])
    return _band(rings).moved([*np.asarray(centre, dtype=np.float64), 0.0])


# Bodies of a gearbox: gears with meshing teeth, plain shafts and carriers

THINNEST_DISC = 0.02
"""Minimum drawn width of a disc, as a fraction of its diameter."""


@dataclass(frozen=True)
class BodyShape:
    """Drawn shape of a body."""

    name: str
    family: str
    """Common name of equal bodies, such as the planets of a set."""
    surface: TriangleSurface
    """In the frame of the gearbox, at rest."""
    reference: Floats
    """(3,) point whose displacement describes the body's motion: the centre of mass, m."""
    fixed: bool = False
    """Whether it is fixed and drawn translucent, as a ring gear hides its planets."""


def bodies_of(gearbox: Gearbox) -> tuple[BodyShape, ...]:
    """Return the shapes of all bodies with gears (rotated so that the teeth mesh), a stepped shaft or planets.

    Returns
    -------
    gears with true geometry; shafts and carriers as plain cylinders that only show which gears are connected

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [body.name for body in bodies_of(gearbox)]
    ['housing', 'carrier', 'planet_1', 'planet_2', 'planet_3', 'lss', 'ims', 'hss']
    """
    angles = tooth_angles(gearbox.meshes)
    shapes = []
    for body in gearbox.bodies():
        planets = [planet for planet in gearbox.bodies() if planet.carrier == body.name]
        parts = []
        for name, z in body.wheels.items():
            gear = gearbox.gears[name]
            # On a shaft, the rim ends at the shaft; planets and rings have their fixed diameter.
            rim = _shaft_diameter(gearbox, body) if _has_shaft(body) and not gear.internal else None
            parts.append(gear_surface(gear, angles.get((body.name, name), 0.0), rim).moved([*body.axis, z]))
        parts += _shaft(gearbox, body) + _carrier(gearbox, body, planets)
        parts += [disc for _, disc in blank_discs(gearbox, body).values()]
        if parts:
            reference = np.array([*body.axis, body.centre_of_mass_z])
            shapes.append(BodyShape(body.name, body.family, TriangleSurface.joined(parts), reference, body.fixed))
    return tuple(shapes)


def tooth_angles(meshes: Sequence[Mesh]) -> dict[tuple[str, str], float]:
    """Rotate the gears of a train so that the teeth of each meet tooth spaces of its mating gears.

    Returns
    -------
    dict
        Polar angle (rad) of the middle of a tooth in the middle plane, by names of body and gear. Where a gear has
        several mating gears, the assembly condition of the train makes the angles consistent.
    """
    angles: dict[tuple[str, str], float] = {}
    waiting = list(meshes)
    while waiting:
        mesh = next((m for m in waiting if _ends(m)[0] in angles or _ends(m)[1] in angles), waiting[0])
        waiting.remove(mesh)
        pinion, gear = _ends(mesh)
        if gear in angles and pinion not in angles:
            angles[pinion] = _mating_angle(mesh, angles[gear], backwards=True)
        else:
            angles.setdefault(gear, _mating_angle(mesh, angles.setdefault(pinion, 0.0), backwards=False))
    return angles


def _ends(mesh: Mesh) -> tuple[tuple[str, str], tuple[str, str]]:
    """Return names of body and gear at both ends of a mesh."""
    return (mesh.pinion, mesh.pair.pinion.name), (mesh.gear, mesh.pair.gear.name)


def _mating_angle(mesh: Mesh, angle: float, *, backwards: bool) -> float:
    """Return the polar angle of a tooth of the mating gear when a tooth of the known gear is at `angle`."""
    # The pitch point lies towards gear 2 for external gears, and beyond gear 1 for an internal pair.
    gears = (mesh.pair.pinion, mesh.pair.gear)
    facing = math.pi if gears[1].internal else 0.0
    towards = (mesh.position_angle + facing, mesh.position_angle + math.pi)
    sense = 1.0 if gears[1].internal else -1.0
    known, mate = (1, 0) if backwards else (0, 1)
    twists = [math.tan(gear.base_helix_angle) / gear.base_radius for gear in gears]
    at_mesh = angle + twists[known] * mesh.offsets[known]
    # Pitches from the tooth to the pitch point, where the mating gear has a space, half a pitch off its tooth.
    pitches = (towards[known] - at_mesh) / gears[known].angular_pitch
    return towards[mate] - (sense * pitches + 0.5) * gears[mate].angular_pitch - twists[mate] * mesh.offsets[mate]


def _shaft_diameter(gearbox: Gearbox, body: Body) -> float:
    return 0.9 * min(gearbox.gears[name].held_diameter for name in body.wheels)


def _has_shaft(body: Body) -> bool:
    return bool(body.wheels) and not body.fixed and body.carrier is None


def _shaft(gearbox: Gearbox, body: Body) -> list[TriangleSurface]:
    """Return a plain cylinder through the gears of a body, or the pieces of its stepped shape if it has none."""
    if not _has_shaft(body):
        shape = gearbox.case.bodies[body.family].shape
        if shape is None or body.wheels:
            return []
        # A cone is drawn as the cylinder of its mean diameter.
        pieces = []
        start = MM * shape.start_z_mm
        for piece in shape.sections:
            end_diameter = piece.outer_diameter_end_mm or piece.outer_diameter_mm
            end = start + MM * piece.length_mm
            diameter = 0.5 * MM * (piece.outer_diameter_mm + end_diameter)
            pieces.append(
                tube_surface(diameter, start, end, MM * min(piece.inner_diameter_mm, 1e3 * diameter), body.axis)
            )
            start = end
        return pieces
    ends = [z + side * 0.5 * gearbox.gears[name].face_width for name, z in body.wheels.items() for side in (-1.0, 1.0)]
    ends += [bearing.position[2] for bearing in gearbox.bearings if bearing.body == body.name]
    margin = 0.02
    return [tube_surface(_shaft_diameter(gearbox, body), min(ends) - margin, max(ends) + margin, centre=body.axis)]


def blank_discs(gearbox: Gearbox, body: Body) -> dict[str, tuple[float, TriangleSurface]]:
    """Return the blanks at seats of a stepped shaft without gear: position (m) and surface, by name of the seat.

    The surface is that of the solid disc with the mass and both moments of inertia of the blank, such as the inner
    ring of a bearing. Diameter and width are limited to the length of the shaft, because the disc of a rotor would
    otherwise hide all other parts.
    """
    shape = gearbox.case.bodies[body.family].shape
    if shape is None:
        return {}
    places = blank_places(gearbox.case, body.family)
    length = MM * sum(piece.length_mm for piece in shape.sections)
    discs = {}
    for name, blank in shape.blanks.items():
        if name in body.wheels:
            continue
        z = MM * places[name]
        diameter = min(math.sqrt(8.0 * blank.axial_kg_m2 / blank.mass_kg), length)
        width = math.sqrt(max(12.0 * blank.transverse_kg_m2 - 6.0 * blank.axial_kg_m2, 0.0) / blank.mass_kg)
        half = 0.5 * min(max(width, THINNEST_DISC * diameter), length)
        discs[name] = (z, tube_surface(diameter, z - half, z + half, centre=body.axis))
    return discs


def shapes_at_seats(gearbox: Gearbox, body: Body) -> list[BodyShape]:
    """Return the gears of a flexible body and the discs at its other seats, each under the name of its seat.

    A fixed body, such as a housing, has its ring gears in its own surface.
    """
    shapes = []
    for gear, z in {} if body.fixed else body.wheels.items():
        centre = np.array([*body.axis, z])
        shapes.append(BodyShape(gear, gear, gear_surface(gearbox.gears[gear]).moved(centre), centre))
    for seat, (z, disc) in blank_discs(gearbox, body).items():
        shapes.append(BodyShape(seat, seat, disc, np.array([*body.axis, z])))
    return shapes


def _carrier(gearbox: Gearbox, body: Body, planets: Sequence[Body]) -> list[TriangleSurface]:
    """Return pins through the planets and a plate behind them, towards +z, that does not hide the planets."""
    parts = []
    for planet in planets:
        for name, z in planet.wheels.items():
            gear = gearbox.gears[name]
            reach = 0.5 * gear.face_width + 0.015
            parts.append(tube_surface(0.6 * gear.held_diameter, z - reach, z + reach + 0.03, centre=planet.axis))
            orbit = math.hypot(planet.axis[0] - body.axis[0], planet.axis[1] - body.axis[1])
            if planet is planets[0]:
                around = (2.0 * orbit + 0.8 * gear.held_diameter, 2.0 * orbit - 0.8 * gear.held_diameter)
                parts.append(tube_surface(around[0], z + reach, z + reach + 0.04, around[1], body.axis))
    return parts


# Motion of the bodies of a gearbox: rigid-body motions from a mode shape, scaled for drawing


def displacement_of(body: BodyShape, motion: ArrayLike) -> Floats:
    """Return the displacement (n, 3), m, of each point of a body for a small motion.

    Parameters
    ----------
    motion : (6,) displacement (m) of the reference point and rotations (rad) about x, y, z
    """
    return np.asarray(_displaced(body, np.asarray(motion, dtype=np.float64)))


def _displaced(body: BodyShape, motion: Floats | Complexes) -> Floats | Complexes:
    """Return the displacement (n, 3) of each point for a real or complex motion (6,)."""
    displacement: Floats | Complexes = motion[:3] + turned(motion[3:], body.surface.points - body.reference)
    return displacement


def turned(rotation: Floats | Complexes, arms: Floats) -> Floats | Complexes:
    """Return the displacements (n, 3) or (3,) at arms (n, 3) or (3,) for a small rotation (3,) about x, y, z.

    Examples
    --------
    >>> turned(np.array([0.0, 0.0, 0.1]), np.array([2.0, 0.0, 0.0]))
    array([0. , 0.2, 0. ])
    """
    a, b, c = rotation
    # The vector product with the rotations as a matrix: np.cross takes ten times as long for few points.
    displacement: Floats | Complexes = arms @ np.array([[0.0, c, -b], [-c, 0.0, a], [b, -a, 0.0]])
    return displacement


def vibration_of(body: BodyShape, motion: Complexes) -> Complexes:
    """Return the complex displacement amplitude (n, 3) of each point of a body from that of its motion (6,)."""
    return np.asarray(_displaced(body, motion), dtype=np.complex128)


def peak_displacement(vibration: Complexes) -> Floats:
    """Return the largest distance (n,) from rest of points that move along ellipses Re(vibration exp(i w t)), (n, 3).

    Examples
    --------
    >>> peak_displacement(np.array([[3.0, 4.0j, 0.0], [3.0, 4.0, 0.0]]))
    array([4., 5.])
    """
    mean_square = np.sum(np.abs(vibration) ** 2, axis=1)
    return np.asarray(np.sqrt(0.5 * (mean_square + np.abs(np.sum(vibration**2, axis=1)))))


def largest_displacement(vibrations: Sequence[Complexes]) -> complex:
    """Return the largest displacement of any point of several bodies, with the phase at which it is reached.

    Vibrations divided by it have the largest displacement 1 at the time 0. It is 0 if nothing moves, and real and
    positive for a mode shape, whose points all move in phase.
    """
    if not vibrations:
        return 0.0j
    together = np.concatenate(vibrations)
    sizes = peak_displacement(together)
    point = int(np.argmax(sizes))
    phase = 0.5 * np.angle(np.sum(together[point] ** 2))
    return complex(sizes[point] * np.exp(1j * phase))


def placed(body: BodyShape, motion: ArrayLike) -> Floats:
    """Return the points (n, 3), m, of a body after a motion that may be large: a finite rotation, then a translation.

    Linear displacements would enlarge a gear that rotates by a drawn amplitude; a finite rotation keeps its size.

    Parameters
    ----------
    motion : (6,) as in `displacement_of`, the rotations as a rotation vector
    """
    matrix = motion_matrix(body.reference, motion)
    points: Floats = body.surface.points @ matrix[:3, :3].T + matrix[:3, 3]
    return points


def motion_matrix(reference: ArrayLike, motion: ArrayLike) -> Floats:
    """Return the homogeneous matrix (4, 4) of a rotation about a reference point and a translation.

    Examples
    --------
    >>> quarter = motion_matrix((1.0, 0.0, 0.0), (0.0, 0.0, 0.5, 0.0, 0.0, math.pi / 2))
    >>> [round(float(entry), 12) for entry in (quarter @ [2.0, 0.0, 0.0, 1.0])[:3]]
    [1.0, 1.0, 0.5]
    """
    centre = np.asarray(reference, dtype=np.float64)
    vector = np.asarray(motion, dtype=np.float64)
    angle = float(np.linalg.norm(vector[3:]))
    rotation = np.eye(3)
    if angle > 0.0:
        x, y, z = vector[3:] / angle
        skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        rotation += math.sin(angle) * skew + (1.0 - math.cos(angle)) * (skew @ skew)  # Rodrigues' formula
    matrix = np.eye(4)
    matrix[:3, :3] = rotation
    matrix[:3, 3] = centre - rotation @ centre + vector[:3]
    return matrix


@dataclass(frozen=True)
class ModeScene:
    """Mode shape on the bodies of a gearbox, ready to draw."""

    bodies: tuple[BodyShape, ...]
    motions: tuple[Complexes, ...]
    """(6,) complex motion of each body at the drawn amplitude; its real part is the motion at the largest deflection.
    In a mode shape the imaginary part is 0."""
    displacement: tuple[Floats, ...]
    """(n,) displacement of each point over the maximum of all points, 0 to 1."""
    title: str


def mode_scene(
    bodies: Sequence[BodyShape], motions: Mapping[str, ArrayLike], *, title: str = "", amplitude: float = 0.035
) -> ModeScene:
    """Scale a mode shape for drawing.

    Parameters
    ----------
    motions : by body name, (6,)
        Mode shape in any normalisation, as in `displacement_of`, or complex amplitudes of a vibration in operation;
        bodies that are not listed are at rest.
    title : frequency, damping and name of the mode
    amplitude : largest displacement drawn, over the diagonal of the scene

    Raises
    ------
    ValueError
        If a motion belongs to no body, or nothing moves.
    """
    unknown = sorted(set(motions) - {body.name for body in bodies})
    if unknown:
        raise ValueError(f"mode shape: no body {unknown[0]!r} among {[body.name for body in bodies]}")
    moving = [np.asarray(motions.get(body.name, np.zeros(6)), dtype=np.complex128) for body in bodies]
    vibrations = [vibration_of(body, motion) for body, motion in zip(bodies, moving, strict=True)]
    largest = largest_displacement(vibrations)
    if largest == 0.0:
        raise ValueError("mode shape: no body moves")
    points = np.concatenate([body.surface.points for body in bodies])
    factor = amplitude * float(np.linalg.norm(np.ptp(points, axis=0))) / largest
    return ModeScene(
        bodies=tuple(bodies),
        motions=tuple(factor * motion for motion in moving),
        displacement=tuple(peak_displacement(vibration) / abs(largest) for vibration in vibrations),
        title=title,
    )


def motions_of(bodies: Iterable[Body], coordinates: Mapping[str, Sequence[int]], shape: ArrayLike) -> dict[str, Floats]:
    """Extract the motions of all bodies from a vector of coordinates.

    Parameters
    ----------
    coordinates : mapping of body name to six int
        Indices of x, y, z and the rotations about them in the vector; -1 for a missing coordinate.
    shape : (size,) mode shape or displacement

    Returns
    -------
    by body name, (6,) as in `displacement_of`. A planet on an ideal pin moves with its carrier.
    """
    vector = np.append(np.asarray(shape, dtype=np.float64), 0.0)  # index -1 reads the appended zero
    by_name = {body.name: body for body in bodies}
    motions = {name: vector[list(coordinates[name])] for name in by_name if name in coordinates}
    for name, motion in motions.items():
        carrier = by_name[name].carrier
        if carrier in motions and max(coordinates[name][:5]) < 0:
            arm = np.subtract(by_name[name].axis, by_name[carrier].axis)
            motion[:2] = motions[carrier][5] * np.array([-arm[1], arm[0]])
    return motions
