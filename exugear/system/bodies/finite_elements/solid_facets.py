"""Facets of solid meshes: their corners in order, seen from outside."""

from __future__ import annotations

from typing import Any

import numpy as np

from fe_ste.tools.arrays import Floats, Integers


def ordered_corners(mesh: Any, facets: Integers) -> Integers:
    """Corners (f, 4) of facets, seen from outside of their first element counter-clockwise; a triangle repeats one."""
    corners = np.asarray(mesh.facets)[:, facets].T
    places = np.asarray(mesh.doflocs).T
    if corners.shape[1] == 4:
        corners = _around(corners, places)
    points = places[corners]
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    inside = places[np.asarray(mesh.t)[:, np.asarray(mesh.f2t)[0, facets]].T].mean(axis=1)
    inward = np.einsum("fd,fd->f", normal, points.mean(axis=1) - inside) < 0.0
    corners = np.where(inward[:, None], corners[:, ::-1], corners)
    return np.asarray(np.column_stack([corners, corners[:, 2]]) if corners.shape[1] == 3 else corners)


def _around(corners: Integers, places: Floats) -> Integers:
    """Corners (f, 4) of quadrilaterals, put in the order around each."""
    points = places[corners]
    away = points - points.mean(axis=1, keepdims=True)
    start = away[:, 0]
    normal = np.cross(start, away[:, 1]) + np.cross(start, away[:, 2])
    sideways = np.cross(normal, start)
    angle = np.arctan2(
        np.einsum("fcd,fd->fc", away, sideways) * np.linalg.norm(start, axis=1)[:, None],
        np.einsum("fcd,fd->fc", away, start) * np.linalg.norm(sideways, axis=1)[:, None],
    )
    return np.asarray(np.take_along_axis(corners, np.argsort(angle, axis=1), axis=1))
