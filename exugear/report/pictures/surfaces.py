"""Surfaces of gears, shafts and pins as triangles; z along the axis, lengths in m."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fe_ste.geometry.gears import Gear
from fe_ste.geometry.profile import tooth_profile
from fe_ste.tools.arrays import Floats, Integers

TWIST_PER_LAYER = 0.06
"""Rotation of the section from one ring of points to the next along a helical gear, rad."""


@dataclass(frozen=True)
class Surface:
    """Triangulated surface."""

    points: Floats
    """(n, 3) m."""
    triangles: Integers
    """(m, 3)"""

    def moved(self, shift: ArrayLike) -> Surface:
        """Copy at another place."""
        return Surface(self.points + np.asarray(shift, dtype=np.float64), self.triangles)

    @classmethod
    def joined(cls, surfaces: Sequence[Surface]) -> Surface:
        """All surfaces as one."""
        offsets = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
        return cls(
            np.concatenate([surface.points for surface in surfaces]),
            np.concatenate([s.triangles + offset for s, offset in zip(surfaces, offsets, strict=False)]),
        )


def gear_surface(gear: Gear, angle: float = 0.0, rim_diameter: float | None = None) -> Surface:
    """Surface of a whole gear with its teeth, about the z axis, z = 0 in the middle of the face width.

    Parameters
    ----------
    gear : the gear
    angle : polar angle of the middle of a tooth at z = 0, rad
    rim_diameter : bore of an external, outside diameter of an internal gear, m; by default where it is held

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
    # Walls run round the axis; the caps join the teeth with the rim at the same polar angles.
    bands = [toothed, plain[::-1], np.stack([plain[0], toothed[0]]), np.stack([toothed[-1], plain[1]])]
    return Surface.joined([_band(band) for band in bands])


def _gear_outline(gear: Gear) -> Floats:
    """Radius and polar angle along the toothed circumference, shape (n, 2), counter-clockwise."""
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


def _band(rings: Floats) -> Surface:
    """Close bands between rings of equal numbers of points, shape (rings, points, 3)."""
    count, size = rings.shape[:2]
    point = np.arange(count * size).reshape(count, size)
    following = np.roll(point, -1, axis=1)
    corners = np.stack([point[:-1], following[:-1], following[1:], point[1:]], axis=-1).reshape(-1, 4)
    return Surface(rings.reshape(-1, 3), np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]))


def tube_surface(
    diameter: float, start: float, end: float, bore: float = 0.0, centre: ArrayLike = (0.0, 0.0)
) -> Surface:
    """Surface of a shaft, disc or pin along z.

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
