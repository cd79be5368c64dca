"""Motions in time as the rotating frame sees them: its coordinates from those of the assembly, at many instants."""

from __future__ import annotations

import numpy as np

from exugear.steady.mean_system.rotating_frame import PlanetSet, RotatingFrame
from exugear.system.kernels.coordinates import TILT
from fe_ste.tools.arrays import Floats, Integers


def frame_coordinates(frame: RotatingFrame, q: Floats, psi: Floats) -> Floats:
    """Coordinates u (s, size) in the rotating frame: what `RotatingFrame.state` makes q (s, size) of, turned round.

    Parameters
    ----------
    q : (s, size) coordinates of the assembly, m and rad
    psi : (s,) angles of the overall input, rad
    """
    assembly = frame.assembly
    still = np.zeros(frame.assembly.size)
    u = q - np.outer(psi, assembly.rolling_velocity(still, frame.speeds))
    bend = assembly.rolling_acceleration(still, frame.speeds, dict.fromkeys(frame.speeds, 0.0))
    for planets in frame.sets:
        own = np.array([assembly.coordinates[name] for name in planets.names])
        if own[0, 0] >= 0:
            _turn_back(u, q, planets, own, psi, bend)
        shapes = planets.values(planets.ratio * psi)
        back = shapes / (shapes**2).sum(axis=1, keepdims=True)
        for axis in range(own.shape[1]):
            if own[0, axis] >= 0:
                u[:, own[:, axis]] = np.einsum("spw,sp->sw", back, u[:, own[:, axis]])
    return u


def _turn_back(u: Floats, q: Floats, planets: PlanetSet, own: Integers, psi: Floats, bend: Floats) -> None:
    """Turn displacements and tilts of planets from the axes that stand to radius and tangent, in place."""
    turned = planets.ratio * psi
    for angle, places in zip(planets.angles, own, strict=True):
        along = places[:2]
        # The centripetal acceleration points back along the radius.
        radius = -bend[along] / planets.ratio**2 if planets.ratio else np.zeros(2)
        u[:, along] = q[:, along] - _rotated(np.broadcast_to(radius, (len(psi), 2)), turned) + radius
        for first in (0, TILT):
            at = places[first : first + 2]
            u[:, at] = _rotated(u[:, at], -(turned + angle))


def _rotated(plane: Floats, angle: Floats) -> Floats:
    """Vectors (s, 2) turned by angles (s,)."""
    c = np.cos(angle)
    s = np.sin(angle)
    return np.stack([c * plane[:, 0] - s * plane[:, 1], s * plane[:, 0] + c * plane[:, 1]], axis=1)
