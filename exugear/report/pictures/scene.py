"""Pictures and animations of a gearbox and its modes, rendered off-screen with pyvista."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from exugear.report.pictures.animation import gif_path, half_period_images, write_animation
from exugear.report.pictures.motions import ModeScene, placed
from exugear.report.pictures.shapes import BodyShape
from fe_ste.tools.arrays import Floats, Integers, Pixels
from fe_ste.tools.drawing import COLOURS, drawing_style, finish_figure, new_figure
from fe_ste.tools.rendering import offscreen_plotter, place_picture, rendered_image, without_margins

if TYPE_CHECKING:
    import pyvista
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure


DISPLACEMENT_COLOURS: Final = ("#E4E7EB", "#F5D67B", "#EE8A33", "#C2242E", "#5A0F3E")
"""Colours of displacement from rest, a light grey that leaves resting bodies in the background, to the largest."""
BODY_COLOURS: Final = (*COLOURS[:6], "#F0E442", "#999933")
"""Colours of families of bodies that turn."""
VIEW = (0.75, 0.45, -1.0)
"""From the bodies to the eye: from the input side, from above and the side."""


def draw_gearbox(
    bodies: Sequence[BodyShape],
    path: str | Path | None = None,
    *,
    title: str = "",
    size: tuple[int, int] = (1600, 1200),
) -> Figure:
    """Draw the bodies of a gearbox, each in its colour.

    Parameters
    ----------
    bodies : shapes
    path : where to write the picture
    title : name of the gearbox
    size : width and height of the rendered image, pixels

    Raises
    ------
    fe_ste.tools.rendering.RenderingError
        If this machine cannot render off-screen.
    """
    from matplotlib.patches import Patch

    colours = body_colours(bodies)
    with offscreen_plotter(*size) as plotter:
        for body in bodies:
            mesh = triangle_mesh(body.surface.points, body.surface.triangles)
            plotter.add_mesh(mesh, color=colours[body.family], opacity=_opacity(body), ambient=0.3, diffuse=0.7)
        look(plotter)
        image, pixel = rendered_image(plotter)
    image = without_margins(image)
    with drawing_style():
        figure = new_figure(7.2, 7.2 * image.shape[0] / image.shape[1] + 0.8)
        panel = figure.add_subplot()
        place_picture(panel, image, pixel, title)
        patches = [Patch(facecolor=colour, edgecolor="#555555", label=name) for name, colour in colours.items()]
        figure.legend(handles=patches, loc="outside lower center", ncols=min(6, len(patches)))
        return finish_figure(figure, path)


def draw_mode(scene: ModeScene, path: str | Path | None = None, *, size: tuple[int, int] = (1600, 1200)) -> Figure:
    """Draw a mode shape at its largest deflection, coloured by displacement.

    Parameters
    ----------
    scene : the mode
    path : where to write the picture
    size : width and height of the rendered image, pixels

    Raises
    ------
    fe_ste.tools.rendering.RenderingError
        If this machine cannot render off-screen.
    """
    with offscreen_plotter(*size) as plotter:
        _add_mode(plotter, scene)
        look(plotter)
        image, pixel = rendered_image(plotter)
    figure = mode_figure(without_margins(image), pixel, scene.title)
    return finish_figure(figure, path)


def animate_mode(
    scene: ModeScene, path: str | Path, *, frames: int = 24, duration: float = 1.6, size: tuple[int, int] = (900, 700)
) -> Path:
    """Write one period of a mode as an animated picture that repeats for ever.

    Parameters
    ----------
    scene : the mode
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
        meshes = _add_mode(plotter, scene)
        look(plotter)

        def move(part: float) -> None:
            for mesh, body, motion in zip(meshes, scene.bodies, scene.motions, strict=True):
                mesh.points = placed(body, part * motion)

        images = half_period_images(plotter, frames, move)
    return write_animation([mode_figure(image, pixel, scene.title) for image, pixel in images], target, duration)


def _add_mode(plotter: pyvista.Plotter, scene: ModeScene) -> list[pyvista.PolyData]:
    meshes = []
    for body, motion, displacement in zip(scene.bodies, scene.motions, scene.displacement, strict=True):
        mesh = triangle_mesh(placed(body, motion), body.surface.triangles)
        mesh.point_data["displacement"] = displacement
        plotter.add_mesh(
            mesh,
            scalars="displacement",
            clim=(0.0, 1.0),
            cmap=displacement_map(),
            opacity=_opacity(body),
            show_scalar_bar=False,
            ambient=0.3,
            diffuse=0.7,
        )
        meshes.append(mesh)
    return meshes


def triangle_mesh(points: Floats, triangles: Integers) -> pyvista.PolyData:
    """Surface from triangles."""
    import pyvista

    faces = np.column_stack([np.full(len(triangles), 3), triangles])
    return pyvista.PolyData(points, faces=faces.ravel())


def quad_mesh(points: Floats, quads: Integers) -> pyvista.PolyData:
    """Surface from faces with four corners, those with four of their own first; a triangle repeats its last."""
    import pyvista

    triangular = quads[:, 2] == quads[:, 3]
    cells = [
        np.column_stack([np.full(len(faces), faces.shape[1]), faces]).ravel()
        for faces in (quads[~triangular], quads[triangular, :3])
    ]
    return pyvista.PolyData(points, faces=np.concatenate(cells))


def look(plotter: pyvista.Plotter, direction: tuple[float, float, float] = VIEW) -> None:
    """Look at everything, y up, with a direction from the bodies to the eye; the input side, above and the side."""
    centre = np.asarray(plotter.center)
    plotter.camera_position = [centre + np.asarray(direction), centre, (0.0, 1.0, 0.0)]
    plotter.renderer.ResetCamera()


def mode_figure(image: Pixels, pixel: float, title: str, label: str = "Displacement / largest displacement") -> Figure:
    """Set the rendered image of a mode with its scale of length (m per pixel), and of colours from 0 to 1."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    with drawing_style():
        figure = new_figure(7.6, 6.6 * image.shape[0] / image.shape[1] + 0.7)
        panel = figure.add_subplot()
        place_picture(panel, image, pixel, title)
        scale = ScalarMappable(Normalize(0.0, 1.0), displacement_map())
        figure.colorbar(scale, ax=panel, label=label, shrink=0.7, aspect=26)
        return figure


def body_colours(bodies: Sequence[BodyShape]) -> dict[str, tuple[float, float, float]]:
    """Colour of each family of bodies as red, green, blue from 0 to 1; fixed ones are grey."""
    families = list(dict.fromkeys(body.family for body in bodies if not body.fixed))
    colours = {family: _lightened(BODY_COLOURS[n % len(BODY_COLOURS)]) for n, family in enumerate(families)}
    return colours | {body.family: _lightened("#8A8F96") for body in bodies if body.fixed}


def displacement_map() -> Colormap:
    """Colour map of displacement over the largest displacement."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("displacement", DISPLACEMENT_COLOURS)


def _opacity(body: BodyShape) -> float:
    if body.fixed:
        return 0.22
    return 1.0


def channels(colour: str) -> tuple[float, float, float]:
    """Red, green and blue from 0 to 1 of a colour like ``#E4E7EB``."""
    red, green, blue = (int(colour[start : start + 2], 16) / 255.0 for start in (1, 3, 5))
    return red, green, blue


def _lightened(colour: str) -> tuple[float, float, float]:
    red, green, blue = channels(colour)
    return 0.35 + 0.65 * red, 0.35 + 0.65 * green, 0.35 + 0.65 * blue
