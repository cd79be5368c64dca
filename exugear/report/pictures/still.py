"""Picture of a mode as PNG without a graphics library: points on all surfaces, drawn from far to near."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from exugear.report.pictures.png import png
from exugear.report.pictures.scene import DISPLACEMENT_COLOURS, VIEW
from exugear.report.pictures.shapes import BodyShape, displacement_of
from fe_ste.tools.arrays import Floats

SIZE = 300
"""Width and height of the picture in pixels."""
FINER = 2
"""Factor by which it is drawn finer and then averaged."""
DENSITY = 2.5
"""Points per fine pixel of a triangle."""
VEIL = 0.12
"""Opacity of fixed bodies, which hide others."""
DISPLACED = 0.035
"""Largest displacement drawn, over the diagonal of the scene."""


def mode_picture(bodies: Sequence[tuple[BodyShape, Floats, Floats | None]]) -> bytes:
    """Return a PNG of bodies in a mode shape, coloured by displacement, on a transparent ground.

    Parameters
    ----------
    bodies
        Shape, rigid-body motion (6,) and, for a flexible body, the displacement (p, 3) of its points instead; the
        largest displacement of any point is 1 m.
    """
    moved = [displacement_of(shape, motion) if field is None else field for shape, motion, field in bodies]
    points = np.concatenate([shape.surface.points for shape, _, _ in bodies])
    low = points.min(axis=0)
    high = points.max(axis=0)
    view = np.array(VIEW) / np.linalg.norm(VIEW)
    right = np.cross((0.0, 1.0, 0.0), view)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(view, right), view])
    corners = (points - 0.5 * (low + high)) @ axes[:2].T
    pixels = SIZE * FINER
    scale = 0.47 * pixels / float(np.abs(corners).max())
    displaced = DISPLACED * float(np.linalg.norm(high - low))
    generator = np.random.default_rng(0)
    layers = []
    for fixed in (False, True):
        samples = [
            _samples(shape, field, displaced, (0.5 * (low + high), axes, scale), generator)
            for (shape, _, _), field in zip(bodies, moved, strict=True)
            if shape.fixed == fixed
        ]
        layers.append(_layer(samples, pixels))
    (solid, near), (veil, veil_near) = layers
    opacity = np.where(np.isfinite(veil_near) & (veil_near > near), VEIL, 0.0)[..., None]
    picture = (1.0 - opacity) * solid + opacity * veil
    picture[..., 3] = np.maximum(solid[..., 3], np.where(np.isfinite(veil_near), VEIL, 0.0))
    # Average each square of fine pixels; colours are weighted by opacity.
    blocks = picture.reshape(SIZE, FINER, SIZE, FINER, 4)
    opacities = blocks[..., 3:]
    whole = opacities.sum(axis=(1, 3))
    colour = (blocks[..., :3] * opacities).sum(axis=(1, 3)) / np.maximum(whole, 1e-12)
    return png(np.clip(np.concatenate([colour, whole / FINER**2], axis=-1), 0.0, 1.0))


def _samples(
    shape: BodyShape,
    field: Floats,
    displaced: float,
    camera: tuple[Floats, Floats, float],
    generator: np.random.Generator,
) -> tuple[Floats, Floats, Floats]:
    """Return points on a body: (n, 3) pixels and depth, (n,) displacement, (n,) brightness."""
    centre, axes, scale = camera
    place = scale * ((shape.surface.points + displaced * field - centre) @ axes.T)
    corners = place[shape.surface.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    bright = 0.45 + 0.55 * np.abs(normal[:, 2]) / np.maximum(size, 1e-300)
    count = np.ceil(0.5 * DENSITY * np.abs(normal[:, 2])).astype(int) + 1
    triangle = np.repeat(np.arange(len(count)), count)
    weights = generator.random((len(triangle), 2))
    beyond = weights.sum(axis=1) > 1.0
    weights[beyond] = 1.0 - weights[beyond]
    shares = np.column_stack([1.0 - weights.sum(axis=1), weights])
    motion = np.linalg.norm(field, axis=1)[shape.surface.triangles]
    own = np.einsum("nk,nkd->nd", shares, corners[triangle])
    return own, np.einsum("nk,nk->n", shares, motion[triangle]), bright[triangle]


def _layer(samples: Sequence[tuple[Floats, Floats, Floats]], pixels: int) -> tuple[Floats, Floats]:
    """Return the picture (pixels, pixels, 4) of points, the nearest last, and its depth; minus infinity is empty."""
    picture = np.zeros((pixels, pixels, 4))
    depth = np.full((pixels, pixels), -np.inf)
    if not samples:
        return picture, depth
    place, motion, bright = (np.concatenate(parts) for parts in zip(*samples, strict=True))
    column, row = np.clip(np.round(0.5 * pixels + place[:, :2] * (1.0, -1.0)).astype(int), 0, pixels - 1).T
    order = np.argsort(place[:, 2])
    nearest = np.full(pixels * pixels, -1)
    nearest[(row * pixels + column)[order]] = order
    filled = np.flatnonzero(nearest >= 0)
    shown = nearest[filled]
    colour = LinearSegmentedColormap.from_list("displacement", DISPLACEMENT_COLOURS)(np.clip(motion[shown], 0.0, 1.0))
    colour[:, :3] *= bright[shown, None]
    picture.reshape(-1, 4)[filled] = colour
    depth.reshape(-1)[filled] = place[shown, 2]
    return picture, depth
