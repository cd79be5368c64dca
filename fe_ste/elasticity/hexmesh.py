"""Structured 8-node hexahedra of one tooth sector, twisted along the helix, with named surfaces.

The transverse section of one tooth is made of four transfinite blocks: the tooth core between both flanks, the
rim below it, and the rim below each half root land. Extruding the section along the face width while turning it
with the helix gives the sector. Its two cut faces are helical surfaces one angular pitch apart, so sectors join
to a ring without any interpolation.

Frame and tooth numbers are those of `fe_ste.contact.kinematics`. In each layer the flank nodes gather about the contact
line of that layer; the cut faces between teeth do not move with them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import Gear
from fe_ste.geometry.profile import ToothProfile, tooth_profile
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin

#: Tangent angle to the tooth centre line at which the fillet is split between tooth core and rim.
_FILLET_SPLIT_ANGLE = np.radians(50.0)


@dataclass(frozen=True)
class MeshSettings:
    """Numbers of elements of one tooth sector.

    Examples
    --------
    >>> MeshSettings().refined(2).layers
    24
    """

    layers: int = 12
    """Elements along the face width."""
    flank: int = 20
    """Elements along the involute of one flank, equal in arc length."""
    thickness: int = 12
    """Elements through the tooth, graded towards both flanks."""
    fillet: int = 8
    """Elements along the upper part of the root fillet, which bounds the tooth core."""
    root: int = 4
    """Elements along the lower fillet and half the root land."""
    rim: int = 14
    """Elements from the held hub or rim to the root, graded towards the root."""
    grading: float = 4.0
    """Ratio of the largest to the smallest element through the tooth."""

    def __post_init__(self) -> None:
        """Refuse counts no mesh can have."""
        for key, least in (
            ("layers", 3),
            ("flank", 4),
            ("thickness", 2),
            ("fillet", 1),
            ("root", 1),
            ("rim", 1),
        ):
            if getattr(self, key) < least:
                raise ValueError(f"mesh setting {key} = {getattr(self, key)}: at least {least} elements are needed")
        if not self.grading >= 1.0:
            raise ValueError(f"mesh setting grading = {self.grading}: must be 1 (uniform) or more")

    def refined(self, factor: int) -> MeshSettings:
        """Return the settings with every element size divided by `factor`."""
        return replace(
            self,
            layers=self.layers * factor,
            flank=self.flank * factor,
            thickness=self.thickness * factor,
            fillet=self.fillet * factor,
            root=self.root * factor,
            rim=self.rim * factor,
        )


@dataclass(frozen=True)
class SectionMesh(ReprMixin, line=": {points!n} nodes, {quads!n} quadrilaterals"):
    """Quadrilaterals of the transverse section of one tooth, centred on the +x axis."""

    points: Floats
    """(n, 2) node coordinates, m."""
    quads: Integers
    """(m, 4) counter-clockwise connectivity."""
    flank_roll: Floats
    """(f + 1,) roll angle tan(alpha) of the flank nodes, rad, ascending."""
    between_flanks: Integers
    """(thickness + 1, f + 1) nodes of the tooth from the clockwise to the counter-clockwise flank, each row by
    ascending roll angle."""
    plus_cut: Integers
    minus_cut: Integers
    """(c,) nodes of the cut faces at +pi/z and -pi/z, from the held surface to the root."""
    held: Integers
    """Nodes of the held hub or rim surface."""

    @property
    def plus_flank(self) -> Integers:
        """Nodes of the counter-clockwise flank, by ascending roll angle."""
        return np.asarray(self.between_flanks[-1])

    @property
    def minus_flank(self) -> Integers:
        """Nodes of the clockwise flank, by ascending roll angle."""
        return np.asarray(self.between_flanks[0])


@dataclass(frozen=True)
class SectorMesh(ReprMixin, line=" of {gear.name!r}: {points!n} nodes, {hexahedra!n} hexahedra"):
    """Hexahedra of one tooth sector; node ``layer * section nodes + section node``."""

    gear: Gear
    settings: MeshSettings
    section: SectionMesh
    axial_positions: Floats
    """(layers + 1,) z of the node layers from the middle of the face width, m."""
    layer_points: Floats | None = None
    """(layers + 1, n, 2) nodes of the section of each layer, before it is turned, where they are not those of
    `section`, m."""

    @cached_property
    def twist_rate(self) -> float:
        """Rotation of the section per length along +z, rad/m: tan(beta_b) / r_b, positive for a right hand."""
        return float(np.tan(self.gear.base_helix_angle) / self.gear.base_radius)

    @cached_property
    def points(self) -> Floats:
        """Node coordinates (n, 3), m."""
        layers = self.section.points if self.layer_points is None else self.layer_points
        x = layers[..., 0]
        y = layers[..., 1]
        angle = self.twist_rate * self.axial_positions[:, None]
        turned_x = np.cos(angle) * x - np.sin(angle) * y
        turned_y = np.sin(angle) * x + np.cos(angle) * y
        z = np.broadcast_to(self.axial_positions[:, None], turned_x.shape)
        return np.stack([turned_x, turned_y, z], axis=-1).reshape(-1, 3)

    @cached_property
    def hexahedra(self) -> Integers:
        """Connectivity (m, 8) in VTK order: bottom quadrilateral counter-clockwise, then the top one."""
        bottom = self._all_layers(self.section.quads)[:-1]
        top = self._all_layers(self.section.quads)[1:]
        return np.concatenate([bottom, top], axis=-1).reshape(-1, 8)

    def flank_nodes(self, side: int) -> Integers:
        """Nodes (flank + 1, layers + 1) of the flank on the `side` +1 (counter-clockwise) or -1 of the tooth."""
        nodes = self.section.plus_flank if side > 0 else self.section.minus_flank
        return self._all_layers(nodes).T

    def cut_nodes(self, side: int) -> Integers:
        """Nodes of the cut face at +pi/z (`side` +1) or -pi/z (-1), held nodes left out, matching one another."""
        nodes = self.section.plus_cut if side > 0 else self.section.minus_cut
        return self._all_layers(nodes[~np.isin(nodes, self.section.held)]).ravel()

    @cached_property
    def held_nodes(self) -> Integers:
        """Nodes of the held hub or rim surface."""
        return self._all_layers(self.section.held).ravel()

    def _all_layers(self, section_nodes: Integers) -> Integers:
        offsets = np.arange(len(self.axial_positions)) * len(self.section.points)
        return offsets.reshape((-1,) + (1,) * section_nodes.ndim) + section_nodes

    @cached_property
    def scaled_jacobian(self) -> Floats:
        """Minimum scaled Jacobian over the corners of each hexahedron (m,): 1 for a brick, 0 when degenerate."""
        corners = self.points[self.hexahedra]
        neighbours = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])
        edges = corners[:, neighbours] - corners[:, :, None]
        edges = edges / np.linalg.norm(edges, axis=-1, keepdims=True)
        return np.asarray(np.linalg.det(edges).min(axis=1))


def sector_mesh(gear: Gear, settings: MeshSettings | None = None) -> SectorMesh:
    """Mesh one tooth sector of `gear`.

    Raises
    ------
    GeometryError
        If the section folds, that is, a hexahedron has a corner with no positive volume.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="pinion", teeth=25, normal_module=3e-3, face_width=20e-3, held_diameter=40e-3)
    >>> mesh = sector_mesh(gear, MeshSettings(layers=4))
    >>> bool(mesh.scaled_jacobian.min() > 0.5)
    True
    """
    settings = settings or MeshSettings()
    section = _section_mesh(
        gear,
        settings,
        tooth_profile(gear),
        np.linspace(0.0, 1.0, settings.flank + 1),
        _symmetric_grading(settings.thickness, settings.grading),
    )
    half_width = gear.face_width / 2
    return _checked(SectorMesh(gear, settings, section, np.linspace(-half_width, half_width, settings.layers + 1)))


def _checked(mesh: SectorMesh) -> SectorMesh:
    if mesh.scaled_jacobian.min() <= 0:
        raise GeometryError(
            f"gear {mesh.gear.name}: the tooth section cannot be meshed (scaled Jacobian "
            f"{mesh.scaled_jacobian.min():.3f}); held_diameter = {mesh.gear.held_diameter:.6g} m may be too near "
            "the root"
        )
    return mesh


def refined_sector_mesh(
    gear: Gear, settings: MeshSettings, flank_fractions: Floats, across_fractions: Floats
) -> SectorMesh:
    """Mesh one tooth sector whose flank nodes lie elsewhere in each layer.

    Parameters
    ----------
    settings : its numbers `flank` and `thickness` must be those of the fractions
    flank_fractions : (layers + 1, flank + 1)
        Arc length of the flank nodes as part of the involute's from form to tip circle, ascending from 0 to 1.
    across_fractions : (thickness + 1,)
        Distance through the tooth as part of its thickness, ascending from 0 on its clockwise to 1 on its
        counter-clockwise flank.

    Returns
    -------
    the cut faces and the held surface are those of `sector_mesh`, whatever the fractions

    Raises
    ------
    GeometryError
        If a section folds.
    """
    profile = tooth_profile(gear)
    sections = [_section_mesh(gear, settings, profile, fractions, across_fractions) for fractions in flank_fractions]
    half_width = gear.face_width / 2
    return _checked(
        SectorMesh(
            gear,
            settings,
            sections[0],
            np.linspace(-half_width, half_width, settings.layers + 1),
            np.stack([section.points for section in sections]),
        )
    )


def _section_mesh(
    gear: Gear,
    settings: MeshSettings,
    profile: ToothProfile,
    flank_fractions: Floats,
    across_fractions: Floats,
) -> SectionMesh:
    flank_roll, upper, lower = _half_boundary(gear, profile, settings, flank_fractions)
    # Nodes of the tooth core, from the minus to the plus flank, root to tip.
    minus_edge = upper * np.array([1.0, -1.0])
    step = np.hypot(*np.diff(upper, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(step)]) / step.sum()
    bottom = minus_edge[0] + across_fractions[:, None] * (upper[0] - minus_edge[0])
    tip_radius = np.hypot(*upper[-1])
    tip_angle = np.arctan2(upper[-1, 1], upper[-1, 0])
    angle = (2.0 * across_fractions - 1.0) * tip_angle
    top = tip_radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    core = _coons(minus_edge, upper, bottom, top, across_fractions, along)
    rim_centre, rim_plus = _rim_blocks(gear, core, upper[0], lower, settings)
    rim_minus = rim_plus[::-1] * np.array([1.0, -1.0])

    points, (core_id, centre_id, plus_id, minus_id) = _joined(core, rim_centre, rim_plus, rim_minus)
    quads = np.concatenate([_quads(ids) for ids in (core_id, centre_id, plus_id, minus_id)])
    if gear.internal:  # the blocks run towards the axis there, which mirrors them
        quads = quads[:, ::-1]
    flank_start = settings.fillet
    by_roll = slice(None, None, -1) if gear.internal else slice(None)
    return SectionMesh(
        points=points,
        quads=quads,
        flank_roll=flank_roll[by_roll],
        between_flanks=core_id[:, flank_start:][:, by_roll],
        plus_cut=plus_id[-1],
        minus_cut=minus_id[0],
        held=np.unique(np.concatenate([centre_id[:, 0], plus_id[:, 0], minus_id[:, 0]])),
    )


def _half_boundary(
    gear: Gear, profile: ToothProfile, settings: MeshSettings, flank_fractions: Floats
) -> tuple[Floats, Floats, Floats]:
    """Roll angles from form to tip, boundary of the tooth core from split to tip, of the root from split to pi/z."""
    roll_form, roll_tip = (
        np.sqrt((radius / gear.base_radius) ** 2 - 1.0) for radius in (profile.form_radius, profile.tip_radius)
    )
    # Arc length of an involute is r_b roll^2 / 2: fractions of it are fractions of the squared roll angle.
    roll = np.sqrt(roll_form**2 + flank_fractions * (roll_tip**2 - roll_form**2))
    radius = gear.base_radius * np.sqrt(1.0 + roll**2)
    angle = gear.half_angle(radius)
    involute = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)

    land_angle = np.linspace(np.arctan2(profile.fillet[-1, 1], profile.fillet[-1, 0]), np.pi / gear.teeth, 50)
    land = profile.root_radius * np.stack([np.cos(land_angle), np.sin(land_angle)], axis=-1)
    root_curve = np.concatenate([profile.fillet, land[1:]]) if np.ptp(land_angle) > 1e-9 else profile.fillet
    root_curve[-1] = land[-1]

    step = np.diff(root_curve, axis=0)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))])
    # The blocks of tooth and rim part where the fillet runs half-way between flank and root land; element angles stay
    # near 90 degrees on both sides.
    tangent_angle = np.arctan2(np.abs(step[:, 1]), np.abs(step[:, 0]))
    split = max(length[int(np.argmax(tangent_angle > _FILLET_SPLIT_ANGLE))], 0.1 * length[-1])
    upper_fillet = _point_along(root_curve, length, np.linspace(split, 0.0, settings.fillet + 1))
    lower = _point_along(root_curve, length, np.linspace(split, length[-1], settings.root + 1))
    upper_fillet[-1] = involute[0]  # the same point but for rounding: a crack otherwise
    return roll, np.concatenate([upper_fillet[:-1], involute]), lower


def _point_along(curve: Floats, length: Floats, arc: Floats) -> Floats:
    return np.stack([np.interp(arc, length, curve[:, 0]), np.interp(arc, length, curve[:, 1])], axis=-1)


def _rim_blocks(gear: Gear, core: Floats, split: Floats, root: Floats, settings: MeshSettings) -> tuple[Floats, Floats]:
    """Nodes of the rim below the tooth core and of the rim below the root at its plus side, held surface to root."""
    held_radius = gear.held_diameter / 2
    split_angle = np.arctan2(split[1], split[0])
    held_angle = split_angle * np.linspace(-1.0, 1.0, core.shape[0])
    # Elements of the rim grow from the size they have at the root.
    depth = abs(np.hypot(*split) - held_radius)
    upwards = 1.0 - _geometric(settings.rim, np.hypot(*(root[1] - root[0])) / depth)[::-1]

    def between(held_angles: Floats, top: Floats) -> Floats:
        bottom = held_radius * np.stack([np.cos(held_angles), np.sin(held_angles)], axis=-1)
        return bottom[:, None] + upwards[:, None] * (top - bottom)[:, None]

    across = (core[:, 0, 1] / core[-1, 0, 1] + 1.0) / 2.0
    centre = between((2.0 * across - 1.0) * held_angle[-1], core[:, 0])
    fraction = np.linspace(0.0, 1.0, len(root))
    plus = between(split_angle + fraction * (np.pi / gear.teeth - split_angle), root)
    return centre, plus


def _coons(
    left: Floats,
    right: Floats,
    bottom: Floats,
    top: Floats,
    across: Floats,
    along: Floats,
) -> Floats:
    """Transfinite interpolation between four edges; result (across, along, 2)."""
    # Gordon and Hall, Int. J. Num. Meth. Eng. 7 (1973) 461-477: both pairs of edges less the corners, counted twice.
    s = across[:, None, None]
    t = along[None, :, None]
    edges = (1 - s) * left + s * right + (1 - t) * bottom[:, None] + t * top[:, None]
    corners = (1 - s) * ((1 - t) * left[0] + t * left[-1]) + s * ((1 - t) * right[0] + t * right[-1])
    return np.asarray(edges - corners)


def _symmetric_grading(count: int, ratio: float) -> Floats:
    """Fractions 0..1 whose intervals grow geometrically from both ends by `ratio` to the middle."""
    position = np.minimum(np.arange(count), np.arange(count)[::-1])
    size = ratio ** (position / max(position.max(), 1))
    return _fractions(np.asarray(size, dtype=np.float64))


def _geometric(count: int, first: float) -> Floats:
    """Fractions 0..1 in geometric progression whose first interval is `first`, or uniform ones if that is smaller."""
    if first * count >= 1.0 or count == 1:
        return np.linspace(0.0, 1.0, count + 1)

    powers = np.arange(count)
    low = 1.0
    high = 50.0
    while high - low > 4.0 * np.finfo(float).eps * high:  # scipy.optimize would take a quarter of a second to load
        middle = 0.5 * (low + high)
        low, high = (middle, high) if first * np.sum(middle**powers) < 1.0 else (low, middle)
    return _fractions(np.asarray(first * low**powers, dtype=np.float64))


def _fractions(sizes: Floats) -> Floats:
    return np.asarray(np.concatenate([[0.0], np.cumsum(sizes)]) / sizes.sum())


def _quads(ids: Integers) -> Integers:
    return np.stack([ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]], axis=-1).reshape(-1, 4)


def _joined(
    core: Floats, centre: Floats, plus: Floats, minus: Floats
) -> tuple[Floats, tuple[Integers, Integers, Integers, Integers]]:
    """Join the blocks along their common edges; return the nodes and each block's node numbers.

    The edges are known, so nothing is compared by distance: a node missed by rounding would be a crack.
    """
    core_id = np.arange(core.shape[0] * core.shape[1]).reshape(core.shape[:2])
    centre_id = np.concatenate([_numbers(core_id, centre[:, :-1]), core_id[:, :1]], axis=1)
    plus_id = np.concatenate([centre_id[-1:], _numbers(centre_id, plus[1:])])
    minus_id = np.concatenate([_numbers(plus_id, minus[:-1]), centre_id[:1]])
    new = (core, centre[:, :-1], plus[1:], minus[:-1])
    return np.concatenate([part.reshape(-1, 2) for part in new]), (core_id, centre_id, plus_id, minus_id)


def _numbers(before: Integers, nodes: Floats) -> Integers:
    """Numbers for the new `nodes` of a block, after the largest number `before`."""
    return np.asarray(before.max() + 1 + np.arange(nodes.shape[0] * nodes.shape[1]).reshape(nodes.shape[:2]))
