"""How the bodies of a gearbox move: rigid motions read out of a mode shape, and scaled to be seen.

NumPy alone: `exugear.report.pictures.scene` draws them, `exugear.report.pictures.viewer` writes them into a web page.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.parts import Body
from exugear.report.pictures.shapes import BodyShape
from fe_ste.tools.arrays import Floats


def displacement_of(body: BodyShape, motion: ArrayLike) -> Floats:
    """Displacement of each point of a body for a small motion of it.

    Parameters
    ----------
    body : the body, n points
    motion : (6,) displacement (m) of the reference point and rotations (rad) about x, y, z

    Returns
    -------
    (n, 3) m
    """
    small = np.asarray(motion, dtype=np.float64)
    return small[:3] + np.cross(small[3:], body.surface.points - body.reference)


def placed(body: BodyShape, motion: ArrayLike) -> Floats:
    """Points of a body after a motion that may be large: turned about the axis of its rotation, then shifted.

    Linear displacements would blow a gear up when it turns by a drawn amplitude; this keeps it a gear.

    Parameters
    ----------
    body : the body, n points
    motion : (6,) as in `displacement_of`, the rotations as a rotation vector

    Returns
    -------
    (n, 3) m
    """
    matrix = motion_matrix(body.reference, motion)
    points: Floats = body.surface.points @ matrix[:3, :3].T + matrix[:3, 3]
    return points


def motion_matrix(reference: ArrayLike, motion: ArrayLike) -> Floats:
    """Homogeneous matrix (4, 4) of a rotation about a reference point and a shift.

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
    """A mode shape on the bodies of a gearbox, ready to draw."""

    bodies: tuple[BodyShape, ...]
    motions: tuple[Floats, ...]
    """(6,) motion of each body at the drawn amplitude."""
    displacement: tuple[Floats, ...]
    """(n,) displacement of each point over the largest of all, 0 to 1."""
    title: str


def mode_scene(
    bodies: Sequence[BodyShape], motions: Mapping[str, ArrayLike], *, title: str = "", amplitude: float = 0.035
) -> ModeScene:
    """Scale a mode shape for drawing.

    Parameters
    ----------
    bodies : shapes
    motions : by body name, (6,)
        Mode shape in any normalisation, as in `displacement_of`; bodies that are not named rest.
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
    moving = [np.asarray(motions.get(body.name, np.zeros(6)), dtype=np.float64) for body in bodies]
    sizes = [np.linalg.norm(displacement_of(body, motion), axis=1) for body, motion in zip(bodies, moving, strict=True)]
    largest = max(float(size.max()) for size in sizes)
    if not largest > 0.0:
        raise ValueError("mode shape: no body moves")
    points = np.concatenate([body.surface.points for body in bodies])
    factor = amplitude * float(np.linalg.norm(np.ptp(points, axis=0))) / largest
    return ModeScene(
        bodies=tuple(bodies),
        motions=tuple(factor * motion for motion in moving),
        displacement=tuple(size / largest for size in sizes),
        title=title,
    )


def motions_of(bodies: Iterable[Body], coordinates: Mapping[str, Sequence[int]], shape: ArrayLike) -> dict[str, Floats]:
    """Read the motions of all bodies out of a vector of coordinates.

    Parameters
    ----------
    bodies : bodies of the model
    coordinates : mapping of body name to six int
        Indices of x, y, z and the rotations about them in the vector; -1 where there is none.
    shape : (size,) mode shape or displacement

    Returns
    -------
    by body name, (6,) as in `displacement_of`. A planet that turns on an ideal pin goes where its carrier takes it.
    """
    vector = np.append(np.asarray(shape, dtype=np.float64), 0.0)  # -1 reads the zero
    by_name = {body.name: body for body in bodies}
    motions = {name: vector[list(coordinates[name])] for name in by_name if name in coordinates}
    for name, motion in motions.items():
        carrier = by_name[name].carrier
        if carrier in motions and max(coordinates[name][:5]) < 0:
            arm = np.subtract(by_name[name].axis, by_name[carrier].axis)
            motion[:2] = motions[carrier][5] * np.array([-arm[1], arm[0]])
    return motions
