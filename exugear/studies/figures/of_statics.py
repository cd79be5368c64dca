"""Figures of the static state: what meshes carry, and how evenly planets share it."""

from __future__ import annotations

import numpy as np

from exugear.studies.figures.point_results import PointError, PointResults
from fe_ste.tools.arrays import Floats


def mesh_forces(results: PointResults) -> dict[str, float]:
    """Force of each mesh on its line of action under the static load."""
    return dict(zip(results.assembly.mesh_names, map(float, results.static.mesh_force), strict=True))


def misalignments(results: PointResults) -> dict[str, float]:
    """Misalignment of each mesh under the static load, positive where the gap opens at the +z end."""
    return dict(zip(results.assembly.mesh_names, map(float, results.static.misalignment), strict=True))


def load_sharing(results: PointResults, *, meshes: str) -> float:
    """Mesh load factor: the largest force among the planets' meshes over their mean, under the static load."""
    forces = of_planets(results, meshes, results.static.mesh_force)
    return float(forces.max() / forces.mean())


def of_planets(results: PointResults, family: str, values: Floats) -> Floats:
    """Pick the values of the meshes of a family, one for each planet.

    Raises
    ------
    PointError
        There is no such family.
    """
    families = [mesh.family for mesh in results.gearbox.meshes]
    chosen = [n for n, own in enumerate(families) if own == family]
    if not chosen:
        raise PointError(f"no meshes {family!r}; meshes are {', '.join(dict.fromkeys(families))}")
    return np.asarray(values[..., chosen], dtype=np.float64)
