"""Pictures of how elastic bodies vibrate by themselves, rendered off-screen with pyvista."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg

from exugear.report.pictures.scene import displacement_map, look, mode_figure, quad_mesh
from exugear.system.bodies.reduced_body import ReducedBody
from fe_ste.tools.drawing import finish_figure
from fe_ste.tools.rendering import offscreen_plotter, rendered_image, without_margins

if TYPE_CHECKING:
    from matplotlib.figure import Figure


DRAWN_DEFLECTION = 0.06
"""Largest displacement in a picture over the length of the body."""


def draw_free_vibration(body: ReducedBody, number: int, path: str | Path | None = None) -> Figure:
    """Draw an elastic vibration of a free body at rest, coloured by displacement.

    Parameters
    ----------
    number : 0 for the first elastic one
    path : where to write the picture

    Raises
    ------
    fe_ste.tools.rendering.RenderingError
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
