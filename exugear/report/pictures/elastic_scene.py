"""Pictures and animations of elastic bodies in a mode, deformed and coloured by strain energy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.parts import seat_key
from exugear.report.pictures.animation import gif_path, half_period_images, write_animation
from exugear.report.pictures.motions import placed
from exugear.report.pictures.scene import (
    displacement_map,
    look,
    mode_figure,
    quad_mesh,
    triangle_mesh,
)
from exugear.report.pictures.shapes import BodyShape
from exugear.report.pictures.surfaces import gear_surface
from exugear.system.assembly import Assembly
from exugear.system.bodies.reduced_body import Surface
from fe_ste.tools.arrays import Floats, Integers, Pixels
from fe_ste.tools.drawing import finish_figure
from fe_ste.tools.rendering import offscreen_plotter, rendered_image, without_margins

if TYPE_CHECKING:
    import pyvista
    from matplotlib.figure import Figure


SIDE = (1.0, 0.35, -0.4)
"""From the bodies to the eye: mostly from the side, where bending shows."""
LINE = 90
"""Letters in a line of the title."""
BRIGHTEST = 99.0
"""Share of the surface (%) below the density of the last colour: at sharp shoulders it grows without bound."""


@dataclass(frozen=True)
class DeformedBody:
    """A body in a mode: points (p, 3) at rest, quads (f, 4), displacement (p, 3) as drawn, energy (f,) from 0 to 1.

    Of a housing only the half behind its axis, so that it hides nothing.
    """

    points: Floats
    quads: Integers
    displacement: Floats
    energy: Floats


@dataclass(frozen=True)
class ElasticScene:
    """Elastic bodies in a mode, and their gears, which ride on their seats."""

    bodies: tuple[DeformedBody, ...]
    gears: tuple[BodyShape, ...]
    motions: tuple[Floats, ...]
    """(6,) motion of each gear as drawn."""
    title: str


def elastic_scene(assembly: Assembly, shape: Floats, *, title: str = "", amplitude: float = 0.06) -> ElasticScene:
    """Arrange the elastic bodies of an assembly in a mode.

    Parameters
    ----------
    assembly : of the variant `flexible`
    shape : (size,) mode shape
    amplitude : largest displacement drawn, as a share of the longest body

    Raises
    ------
    ValueError
        The assembly has no elastic bodies, or the mode does not move them.
    """
    if not assembly.elastic_bodies:
        raise ValueError(f"variant {assembly.variant} has no elastic bodies to draw; use the variant flexible")
    deformed = []
    fixed = {body.name: body.axis for body in assembly.bodies if body.fixed}
    for name, coordinates in assembly.elastic_slices.items():
        surface = assembly.elastic_bodies[name].reduced.surface
        if name in fixed:
            surface = _half_behind(surface, fixed[name])
        motion = shape[coordinates]
        deformed.append((surface, surface.displacement @ motion, surface.energy_density(motion)))
    largest = max(float(np.linalg.norm(moved, axis=1).max()) for _, moved, _ in deformed)
    if not largest > 0.0:
        raise ValueError("the mode does not move the elastic bodies")
    factor = amplitude * max(float(np.ptp(surface.points[:, 2])) for surface, _, _ in deformed) / largest
    brightest = _density_below(
        np.concatenate([density for _, _, density in deformed]),
        np.concatenate([_areas(surface.points, surface.quads) for surface, _, _ in deformed]),
    )
    gears, motions = _gears(assembly, factor * shape)
    return ElasticScene(
        bodies=tuple(
            DeformedBody(surface.points, surface.quads, factor * moved, np.minimum(density / brightest, 1.0))
            for surface, moved, density in deformed
        ),
        gears=gears,
        motions=motions,
        title=title,
    )


def _half_behind(surface: Surface, axis: tuple[float, float]) -> Surface:
    """Faces of a surface that lie behind an axis along z, seen from `SIDE`."""
    behind = (surface.points[surface.quads].mean(axis=1)[:, :2] - axis) @ SIDE[:2] < 0.0
    return replace(surface, quads=surface.quads[behind], strain=surface.strain[behind])


def _areas(points: Floats, quads: Integers) -> Floats:
    """Area of each quad, m2."""
    diagonals = points[quads[:, 2]] - points[quads[:, 0]], points[quads[:, 3]] - points[quads[:, 1]]
    areas: Floats = 0.5 * np.linalg.norm(np.cross(*diagonals), axis=1)
    return areas


def _density_below(density: Floats, area: Floats) -> float:
    """Density that all but the brightest part of the surface stays below."""
    order = np.argsort(density)
    share = np.cumsum(area[order]) / area.sum()
    return float(density[order][np.searchsorted(share, BRIGHTEST / 100.0)]) or 1.0


def _gears(assembly: Assembly, shape: Floats) -> tuple[tuple[BodyShape, ...], tuple[Floats, ...]]:
    gears = []
    motions = []
    for body in assembly.bodies:
        if body.name not in assembly.elastic_bodies or body.fixed:  # a housing has its ring in its own surface
            continue
        for gear, z in body.wheels.items():
            centre = np.array([*body.axis, z])
            gears.append(BodyShape(gear, gear, gear_surface(assembly.gearbox.gears[gear]).moved(centre), centre))
            motions.append(shape[list(assembly.coordinates[seat_key(body.name, gear)])])
    return tuple(gears), tuple(motions)


def draw_elastic_bodies(
    scene: ElasticScene, path: str | Path | None = None, *, size: tuple[int, int] = (1600, 1200)
) -> Figure:
    """Draw elastic bodies at their largest deflection, coloured by strain energy density; gears translucent.

    Parameters
    ----------
    path : where to write the picture
    size : width and height of the rendered image, pixels

    Raises
    ------
    fe_ste.tools.rendering.RenderingError
        If this machine cannot render off-screen.
    """
    with offscreen_plotter(*size) as plotter:
        _add(plotter, scene)
        look(plotter, SIDE)
        image, pixel = rendered_image(plotter)
    return finish_figure(_figure(without_margins(image), pixel, scene.title), path)


def animate_elastic_bodies(
    scene: ElasticScene,
    path: str | Path,
    *,
    frames: int = 24,
    duration: float = 1.6,
    size: tuple[int, int] = (900, 700),
) -> Path:
    """Write one period of a mode as an animated picture that repeats for ever.

    Parameters
    ----------
    path : where to write; the suffix must be ``.gif``
    frames : pictures per period, an even number
    duration : length of a period, s
    size : width and height of the rendered image, pixels

    Raises
    ------
    ValueError
        If the suffix is another.
    fe_ste.tools.rendering.RenderingError
        If this machine cannot render off-screen.
    """
    target = gif_path(path)
    with offscreen_plotter(*size) as plotter:
        bodies, gears = _add(plotter, scene)
        look(plotter, SIDE)

        def move(part: float) -> None:
            for mesh, body in zip(bodies, scene.bodies, strict=True):
                mesh.points = body.points + part * body.displacement
                mesh.cell_data["energy"] = part**2 * body.energy
            for mesh, gear, motion in zip(gears, scene.gears, scene.motions, strict=True):
                mesh.points = placed(gear, part * motion)

        images = half_period_images(plotter, frames, move)
    return write_animation([_figure(image, pixel, scene.title) for image, pixel in images], target, duration)


def _add(plotter: pyvista.Plotter, scene: ElasticScene) -> tuple[list[pyvista.PolyData], list[pyvista.PolyData]]:
    bodies = []
    gears = []
    for body in scene.bodies:
        mesh = quad_mesh(body.points + body.displacement, body.quads)
        mesh.cell_data["energy"] = body.energy
        plotter.add_mesh(
            mesh,
            scalars="energy",
            clim=(0.0, 1.0),
            cmap=displacement_map(),
            show_scalar_bar=False,
            ambient=0.15,
            diffuse=0.75,  # less than full: walls at rest are light, and must stand out from the page
        )
        bodies.append(mesh)
    for gear, motion in zip(scene.gears, scene.motions, strict=True):
        mesh = triangle_mesh(placed(gear, motion), gear.surface.triangles)
        plotter.add_mesh(mesh, color="#8A97A8", opacity=0.25)
        gears.append(mesh)
    return bodies, gears


def _figure(image: Pixels, pixel: float, title: str) -> Figure:
    label = f"Strain energy density / that of {BRIGHTEST:g} % of the surface"
    return mode_figure(image, pixel, fill(title, LINE), label)
