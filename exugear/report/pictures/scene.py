"""Pictures and animations of a gearbox and its modes, rendered off-screen with pyvista."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Final

import numpy as np
import scipy.linalg

from exugear.gearbox.parts import seat_key
from exugear.report.pictures.shapes import BodyShape, ModeScene, placed, shapes_at_seats
from exugear.system.bodies.reduction import ReducedBody
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats, Integers, Pixels
from fe_ste.tools.drawing import (
    COLOURS,
    drawing_style,
    drawn_part,
    finish_figure,
    new_figure,
    offscreen_plotter,
    place_picture,
    rendered_image,
    without_margins,
)
from fe_ste.tools.files import write_file

if TYPE_CHECKING:
    import pyvista
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

# Animated pictures of a period of a vibration


def gif_path(path: str | Path) -> Path:
    """Return the path of an animation.

    Raises
    ------
    ValueError
        If the suffix is not ``.gif``.
    """
    target = Path(path)
    if target.suffix.lower() != ".gif":
        raise ValueError(f"animation {target}: the suffix must be .gif")
    return target


def period_images(plotter: pyvista.Plotter, frames: int, move: Callable[[complex], None]) -> list[tuple[Pixels, float]]:
    """Render a period from the largest deflection on, with one margin around all images.

    Parameters
    ----------
    plotter : with all meshes and the camera set
    frames : pictures per period
    move : moves the meshes by the real part of their complex amplitudes times exp(i w t), which it is given

    Returns
    -------
    list of (image, float)
        Pixels, and m per pixel.
    """
    images = []
    for turn in np.exp(2j * np.pi * np.arange(frames) / frames):
        move(complex(turn))
        images.append(rendered_image(plotter))
    # The darkest value of all frames at each pixel shows the area that any frame needs.
    rows, columns = drawn_part(np.min([image for image, _ in images], axis=0))
    return [(image[rows, columns], pixel) for image, pixel in images]


def write_animation(figures: Sequence[Figure], target: Path, duration: float) -> Path:
    """Write the images of a period as an animated picture; `duration` of a period in s."""
    from PIL import Image

    pictures = []
    for figure in figures:
        finished = io.BytesIO()
        figure.savefig(finished, format="png", dpi=100)
        pictures.append(Image.open(finished).convert("RGB"))
    # One palette for all frames, otherwise colours flicker.
    palette = pictures[0].quantize(colors=255, method=Image.Quantize.MEDIANCUT)
    # Averaging turns white into light grey, which is set to white again.
    colours = np.array(palette.getpalette()).reshape(-1, 3)
    colours[colours.min(axis=1) >= 250] = 255
    palette.putpalette(colours.ravel().tolist())
    indexed = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    pause = round(1e3 * duration / len(indexed))
    content = io.BytesIO()
    rest = indexed[1:]
    indexed[0].save(content, "GIF", save_all=True, append_images=rest, duration=pause, loop=0, optimize=True)
    write_file(target, content.getvalue())
    return target


# Pictures and animations of a gearbox and its modes, rendered off-screen with pyvista

DISPLACEMENT_COLOURS: Final = ("#E4E7EB", "#F5D67B", "#EE8A33", "#C2242E", "#5A0F3E")
"""Colours of displacement from zero (light grey, which keeps bodies at rest in the background) to the maximum."""
BODY_COLOURS: Final = (*COLOURS[:6], "#F0E442", "#999933")
"""Colours of families of rotating bodies."""
VIEW = (0.75, 0.45, -1.0)
"""View direction from the bodies to the eye: from the input side, from above and from the side."""


def draw_gearbox(
    bodies: Sequence[BodyShape],
    path: str | Path | None = None,
    *,
    title: str = "",
    size: tuple[int, int] = (1600, 1200),
) -> Figure:
    """Draw the bodies of a gearbox, each in its colour; the rendered image has a size in pixels.

    Raises
    ------
    fe_ste.tools.drawing.RenderingError
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
    """Draw a mode or operating deflection shape at its maximum, coloured by displacement; the size is in pixels.

    Raises
    ------
    fe_ste.tools.drawing.RenderingError
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
    """Write one period of a vibration as an animated picture that repeats endlessly.

    Parameters
    ----------
    path : output file; the suffix must be ``.gif``
    frames : pictures per period
    duration : length of a period, s
    size : width and height of the rendered image, pixels

    Raises
    ------
    ValueError
        If the suffix is another.
    fe_ste.tools.drawing.RenderingError
        If this machine cannot render off-screen.
    """
    target = gif_path(path)
    with offscreen_plotter(*size) as plotter:
        meshes = _add_mode(plotter, scene)
        look(plotter)

        def move(turn: complex) -> None:
            for mesh, body, motion in zip(meshes, scene.bodies, scene.motions, strict=True):
                mesh.points = placed(body, (turn * motion).real)

        images = period_images(plotter, frames, move)
    return write_animation([mode_figure(image, pixel, scene.title) for image, pixel in images], target, duration)


def _add_mode(plotter: pyvista.Plotter, scene: ModeScene) -> list[pyvista.PolyData]:
    meshes = []
    for body, motion, displacement in zip(scene.bodies, scene.motions, scene.displacement, strict=True):
        mesh = triangle_mesh(placed(body, motion.real), body.surface.triangles)
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
    """Return a surface from triangles."""
    import pyvista

    faces = np.column_stack([np.full(len(triangles), 3), triangles])
    return pyvista.PolyData(points, faces=faces.ravel())


def quad_mesh(points: Floats, quads: Integers) -> pyvista.PolyData:
    """Return a surface from four-node faces, with true quads first; a triangle repeats its last node."""
    import pyvista

    triangular = quads[:, 2] == quads[:, 3]
    cells = [
        np.column_stack([np.full(len(faces), faces.shape[1]), faces]).ravel()
        for faces in (quads[~triangular], quads[triangular, :3])
    ]
    return pyvista.PolyData(points, faces=np.concatenate(cells))


def look(plotter: pyvista.Plotter, direction: tuple[float, float, float] = VIEW) -> None:
    """Point the camera at the whole scene with y up; by default from the input side, from above and from the side."""
    centre = np.asarray(plotter.center)
    plotter.camera_position = [centre + np.asarray(direction), centre, (0.0, 1.0, 0.0)]
    plotter.renderer.ResetCamera()


def mode_figure(image: Pixels, pixel: float, title: str, label: str = "Displacement / largest displacement") -> Figure:
    """Combine the rendered image of a mode with its length scale (m per pixel) and a colour bar from 0 to 1."""
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
    """Return the colour of each family of bodies as red, green, blue from 0 to 1; fixed bodies are grey."""
    from matplotlib.colors import to_rgb

    families = list(dict.fromkeys(body.family for body in bodies if not body.fixed))
    full = {family: BODY_COLOURS[n % len(BODY_COLOURS)] for n, family in enumerate(families)}
    full |= {body.family: "#8A8F96" for body in bodies if body.fixed}
    channels = {family: to_rgb(colour) for family, colour in full.items()}
    # Lighter than in diagrams
    return {
        family: (0.35 + 0.65 * red, 0.35 + 0.65 * green, 0.35 + 0.65 * blue)
        for family, (red, green, blue) in channels.items()
    }


def displacement_map() -> Colormap:
    """Return the colour map of displacement over maximum displacement."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("displacement", DISPLACEMENT_COLOURS)


def _opacity(body: BodyShape) -> float:
    return 0.22 if body.fixed else 1.0


# Pictures and animations of flexible bodies in a mode, deformed and coloured by strain energy

SIDE = (1.0, 0.35, -0.4)
"""View direction from the bodies to the eye: mostly from the side, where bending is visible."""
LINE = 90
"""Characters per line of the title."""
BRIGHTEST = 99.0
"""Percentage of the surface below the density of the last colour; at sharp shoulders the density is singular."""


@dataclass(frozen=True)
class DeformedBody:
    """Body in a mode: points (p, 3) at rest, quads (f, 4), displacement (p, 3) as drawn, energy (f,) from 0 to 1.

    Of a housing, only the half behind its axis is drawn so that it does not hide the other bodies.
    """

    points: Floats
    quads: Integers
    displacement: Floats
    energy: Floats


@dataclass(frozen=True)
class ElasticScene:
    """Flexible bodies in a mode, and the gears and discs on their seats, which move as rigid bodies."""

    bodies: tuple[DeformedBody, ...]
    gears: tuple[BodyShape, ...]
    motions: tuple[Floats, ...]
    """(6,) motion of each gear as drawn."""
    title: str


def elastic_scene(assembly: Assembly, shape: Floats, *, title: str = "", amplitude: float = 0.06) -> ElasticScene:
    """Prepare the flexible bodies of an assembly in a mode for drawing.

    Parameters
    ----------
    assembly : of the variant `flexible`
    shape : (size,) mode shape
    amplitude : largest displacement drawn, as a fraction of the longest body

    Raises
    ------
    ValueError
        The assembly has no flexible bodies, or the mode does not move them.
    """
    if not assembly.elastic_bodies:
        raise ValueError(f"variant {assembly.variant} has no flexible bodies to draw; use the variant flexible")
    deformed = []
    fixed = {body.name: body.axis for body in assembly.bodies if body.fixed}
    for name, coordinates in assembly.elastic_slices.items():
        surface = assembly.elastic_bodies[name].reduced.surface
        if name in fixed and surface.elasticity.any():  # the nodes of matrices hide nothing
            # only the half behind the axis, seen from `SIDE`
            behind = (surface.points[surface.quads].mean(axis=1)[:, :2] - fixed[name]) @ SIDE[:2] < 0.0
            surface = replace(surface, quads=surface.quads[behind], strain=surface.strain[behind])
        motion = shape[coordinates]
        deformed.append((surface, surface.displacement @ motion, surface.energy_density(motion)))
    largest = max(float(np.linalg.norm(moved, axis=1).max()) for _, moved, _ in deformed)
    if not largest > 0.0:
        raise ValueError("the mode does not deform the flexible bodies")
    factor = amplitude * max(float(np.ptp(surface.points[:, 2])) for surface, _, _ in deformed) / largest
    densities = np.concatenate([density for _, _, density in deformed])
    corners = [surface.points[surface.quads] for surface, _, _ in deformed]
    diagonals = [(own[:, 2] - own[:, 0], own[:, 3] - own[:, 1]) for own in corners]
    areas = np.concatenate([0.5 * np.linalg.norm(np.cross(*own), axis=1) for own in diagonals])
    # The density that all but the brightest part of the surface stays below
    order = np.argsort(densities)
    share = np.cumsum(areas[order]) / areas.sum()
    brightest = float(densities[order][np.searchsorted(share, BRIGHTEST / 100.0)]) or 1.0
    gears = []
    motions = []
    for body in assembly.bodies:
        if body.name in assembly.elastic_bodies and not body.fixed:
            for seated in shapes_at_seats(assembly.gearbox, body):
                gears.append(seated)
                motions.append(factor * shape[list(assembly.coordinates[seat_key(body.name, seated.name)])])
    return ElasticScene(
        bodies=tuple(
            DeformedBody(surface.points, surface.quads, factor * moved, np.minimum(density / brightest, 1.0))
            for surface, moved, density in deformed
        ),
        gears=tuple(gears),
        motions=tuple(motions),
        title=title,
    )


def draw_elastic_bodies(
    scene: ElasticScene, path: str | Path | None = None, *, size: tuple[int, int] = (1600, 1200)
) -> Figure:
    """Draw flexible bodies at maximum deflection, coloured by strain energy density; gears are translucent.

    Raises
    ------
    fe_ste.tools.drawing.RenderingError
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
    """Write one period of a mode as an animated picture that repeats endlessly.

    Parameters
    ----------
    path : output file; the suffix must be ``.gif``
    frames : pictures per period
    duration : length of a period, s
    size : width and height of the rendered image, pixels

    Raises
    ------
    ValueError
        If the suffix is another.
    fe_ste.tools.drawing.RenderingError
        If this machine cannot render off-screen.
    """
    target = gif_path(path)
    with offscreen_plotter(*size) as plotter:
        bodies, gears = _add(plotter, scene)
        look(plotter, SIDE)

        def move(turn: complex) -> None:
            part = turn.real
            for mesh, body in zip(bodies, scene.bodies, strict=True):
                mesh.points = body.points + part * body.displacement
                mesh.cell_data["energy"] = part**2 * body.energy
            for mesh, gear, motion in zip(gears, scene.gears, scene.motions, strict=True):
                mesh.points = placed(gear, part * motion)

        images = period_images(plotter, frames, move)
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
            diffuse=0.75,  # below 1: walls at rest are light and must contrast with the page
        )
        bodies.append(mesh)
    for gear, motion in zip(scene.gears, scene.motions, strict=True):
        mesh = triangle_mesh(placed(gear, motion), gear.surface.triangles)
        plotter.add_mesh(mesh, color="#8A97A8", opacity=0.25)
        gears.append(mesh)
    return bodies, gears


def _figure(image: Pixels, pixel: float, title: str) -> Figure:
    label = f"Strain energy density / {BRIGHTEST:g} % quantile of the surface"
    return mode_figure(image, pixel, fill(title, LINE), label)


# Pictures of the free vibration of flexible bodies, rendered off-screen with pyvista

DRAWN_DEFLECTION = 0.06
"""Maximum displacement in a picture over the length of the body."""


def draw_free_vibration(body: ReducedBody, number: int, path: str | Path | None = None) -> Figure:
    """Draw an elastic mode of a free body, number 0 for the first one, coloured by displacement.

    Raises
    ------
    fe_ste.tools.drawing.RenderingError
        This machine cannot render off-screen.
    """
    values, shapes = scipy.linalg.eigh(body.stiffness, body.mass)
    motion = body.surface.displacement @ shapes[:, 6 + number]
    size = np.linalg.norm(motion, axis=1)
    points = body.surface.points
    scale = DRAWN_DEFLECTION * float(np.ptp(points, axis=0).max()) / float(size.max())
    with offscreen_plotter(1600, 1200) as plotter:
        mesh = quad_mesh(points + scale * motion, body.surface.quads)
        mesh.point_data["displacement"] = size / size.max()
        plotter.add_mesh(mesh, scalars="displacement", cmap=displacement_map(), clim=(0.0, 1.0), show_scalar_bar=False)
        edges = quad_mesh(points, body.surface.quads).extract_feature_edges(50.0)
        plotter.add_mesh(edges, color="#8A8F96", line_width=1.5)
        look(plotter)
        image, pixel = rendered_image(plotter)
    frequency = float(np.sqrt(max(values[6 + number], 0.0)) / (2.0 * np.pi))
    title = f"{body.name}, free vibration {number + 1}: {frequency:.0f} Hz"
    return finish_figure(mode_figure(without_margins(image), pixel, title), path)
