"""Pictures of contact stress: the flank from the front and the section through the contact, rendered off-screen."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from fe_ste.elasticity.sectors import OpenSector
from fe_ste.reference.stress import StressField
from fe_ste.tools.arrays import Floats, Integers, Pixels
from fe_ste.tools.drawing import drawing_style, finish_figure, new_figure
from fe_ste.tools.rendering import offscreen_plotter, place_picture, rendered_image

if TYPE_CHECKING:
    import pyvista
    from matplotlib.figure import Figure


_STRESS_MAP: Final = "turbo"
_PRESSURE_MAP: Final = "inferno_r"

#: Height of the section's picture in transverse modules.
_SECTION_HEIGHT = 1.2

#: Part of the face width, from its middle, in which the section may lie.
_INNER_WIDTH = 0.4

#: Facets with less than this part of the highest pressure are drawn with their stress.
_LEAST_PRESSURE = 0.03


def draw_contact_stress(
    field: StressField,
    path: str | Path | None = None,
    *,
    title: str = "",
    flank_of: int = 1,
    magnification: float = 20.0,
    size: tuple[int, int] = (1500, 1100),
) -> Figure:
    """Draw the stress in meshing teeth in two views.

    Parameters
    ----------
    path : where to write the picture
    title : name of the pair; load, position and method are added
    flank_of : gear whose flank is shown from the front: 1 or 2
    magnification : of the displacements in the view of the flank; the section shows them as they are
    size : width and height of each rendered image, pixels

    Returns
    -------
    matplotlib.figure.Figure
        On the left the loaded flank of the tooth that carries most, from the front, with the contact pressure where it
        touches and the equivalent stress elsewhere; on the right the transverse section of both gears where the
        pressure of that tooth is highest.

    Raises
    ------
    RenderingError
        If this machine cannot render off-screen; the message names what to install.
    ValueError
        If no node carries pressure, or there is no such gear.
    """
    if flank_of not in (1, 2):
        raise ValueError(f"flank_of = {flank_of}: must be 1 or 2")
    if not field.pressure.max() > 0.0:
        raise ValueError("draw_contact_stress: no node carries pressure")
    flank = _LoadedFlank.of(field, flank_of - 1)
    gear = field.sectors[flank.number]
    name = (field.pair.pinion, field.pair.gear)[flank.number].name.replace("_", " ")
    load = f"{field.torque:.0f} N m on gear 1, position {field.pmc:.2f} of the mesh cycle, {field.method}"
    highest_point = flank.points[flank.highest] + flank.displacement[flank.highest]
    top = 1e-6 * _top_stress(field, flank.points[flank.highest])
    views = (
        (f"flank of the {name} from the front", _flank_view(field, gear, flank, magnification, top, size)),
        (f"section at z = {1e3 * highest_point[2]:.1f} mm", _section_view(field, flank, highest_point, top, size)),
    )
    with drawing_style():
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        figure = new_figure(12.5, 4.4)
        panels = figure.subplots(1, 2)
        for panel, (caption, (image, pixel)) in zip(panels, views, strict=True):
            place_picture(panel, image, pixel, caption)
        stress = ScalarMappable(Normalize(0.0, top), _STRESS_MAP)
        pressure = ScalarMappable(Normalize(0.0, 1e-6 * flank.top_pressure), _PRESSURE_MAP)
        figure.colorbar(
            pressure, ax=panels[0], label="Contact pressure / MPa", shrink=0.8, location="left", extend="max"
        )
        figure.colorbar(stress, ax=panels[1], label="Equivalent stress (von Mises) / MPa", shrink=0.8, extend="max")
        figure.suptitle(
            f"{title or field.pair.name}: {load}; flank's displacements {magnification:g} times", fontsize=10
        )
        return finish_figure(figure, path)


@dataclass(frozen=True)
class _LoadedFlank:
    """The flank that carries most of one gear, and how to look at it.

    ``points``, ``displacement`` and ``pressure`` are those of the gear's nodes, ``highest`` the node of highest
    pressure away from the end faces, ``normal`` points out of the flank in the transverse plane, ``upward`` along it
    to the tip.
    """

    number: int
    tooth: int
    facets: Integers
    points: Floats
    displacement: Floats
    pressure: Floats
    highest: int
    top_pressure: float
    normal: Floats
    upward: Floats
    middle: Floats

    @classmethod
    def of(cls, field: StressField, number: int) -> _LoadedFlank:
        sector = field.sectors[number]
        nodes = field.nodes_of(number)
        pressure = field.pressure[nodes]
        corners = sector.points[sector.facets]
        normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        load = pressure[sector.facets].mean(axis=1) * np.linalg.norm(normals, axis=1)
        tooth = max(np.unique(sector.tooth).tolist(), key=lambda each: float(load[sector.tooth == each].sum()))
        on_tooth = sector.tooth == tooth
        facets = sector.facets[on_tooth]
        load = load[on_tooth]
        normal = np.sum(load[:, None] * normals[on_tooth] / np.linalg.norm(normals[on_tooth], axis=1)[:, None], axis=0)
        normal[2] = 0.0
        normal /= np.linalg.norm(normal)
        middle = np.sum(load[:, None] * corners[on_tooth].mean(axis=1), axis=0) / load.sum()
        middle[2] = 0.0
        gear = (field.pair.pinion, field.pair.gear)[number]
        mate_sign = -1.0 if field.pair.gear.internal else 1.0
        axis = np.array([mate_sign * field.pair.centre_distance * number, 0.0, 0.0])
        radial = (middle - axis) * (-1.0 if gear.internal else 1.0)
        upward = radial - (radial @ normal) * normal
        # Not at an end face, where there is no section to see, and not at an edge, where the mesh makes the pressure.
        inner = np.zeros(len(pressure), dtype=np.bool_)
        inner[facets] = True
        inner &= np.abs(sector.points[:, 2]) < _INNER_WIDTH * field.pair.face_width
        return cls(
            number=number,
            tooth=int(tooth),
            facets=facets,
            points=sector.points,
            displacement=field.displacement[nodes],
            pressure=pressure,
            highest=int(np.argmax(np.where(inner, pressure, 0.0))),
            top_pressure=float(np.where(inner, pressure, 0.0).max()),
            normal=normal,
            upward=upward / np.linalg.norm(upward),
            middle=middle,
        )


def _top_stress(field: StressField, point: Floats) -> float:
    """Upper end of the stress colours: the highest in the section, not the peaks at edges of other teeth."""
    points = np.concatenate([sector.points for sector in field.sectors])
    apart = np.abs(points - point)
    shown = np.hypot(apart[:, 0], apart[:, 1]) < 0.5 * _SECTION_HEIGHT * field.pair.pinion.transverse_module
    layer = apart[:, 2] <= max(float(apart[shown, 2].min()), 0.02 * field.pair.face_width)
    return float(field.von_mises[shown & layer].max())


def _grid(field: StressField, number: int, bricks: Integers, magnification: float) -> pyvista.UnstructuredGrid:
    """Deformed bricks of one gear with their stress in MPa."""
    import pyvista

    nodes = field.nodes_of(number)
    points = field.sectors[number].points + magnification * field.displacement[nodes]
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: bricks}, points)
    grid.point_data["stress"] = 1e-6 * field.von_mises[nodes]
    return grid


def _flank_view(
    field: StressField,
    sector: OpenSector,
    flank: _LoadedFlank,
    magnification: float,
    top: float,
    size: tuple[int, int],
) -> tuple[Pixels, float]:
    """One tooth alone, seen against the loaded flank's normal, pressure on it; `top` of the stress colours in MPa."""
    import pyvista

    points = flank.points + magnification * flank.displacement
    touching = flank.pressure[flank.facets].mean(axis=1) > _LEAST_PRESSURE * flank.top_pressure
    facets = np.column_stack([np.full(int(touching.sum()), 4), flank.facets[touching]])
    module = field.pair.pinion.transverse_module
    with offscreen_plotter(*size) as plotter:
        bricks = sector.hexahedra[sector.brick_tooth == flank.tooth]
        surface = _grid(field, flank.number, bricks, magnification).extract_surface(algorithm="geometry")
        plotter.add_mesh(
            surface,
            scalars="stress",
            clim=(0.0, top),
            cmap=_STRESS_MAP,
            show_scalar_bar=False,
            ambient=0.5,
            diffuse=0.5,
        )
        # Towards the eye by next to nothing, so that the pressure is not lost in the flank below it.
        patch = pyvista.PolyData(points + 0.01 * module * flank.normal, faces=facets.ravel())
        patch.point_data["pressure"] = 1e-6 * flank.pressure
        plotter.add_mesh(
            patch,
            scalars="pressure",
            clim=(0.0, 1e-6 * flank.top_pressure),
            cmap=_PRESSURE_MAP,
            lighting=False,
            show_scalar_bar=False,
        )
        width = float(np.ptp(flank.points[flank.facets, 2]))
        plotter.camera_position = [flank.middle + 10.0 * module * flank.normal, flank.middle, flank.upward]
        plotter.camera.parallel_scale = max(2.2 * module, 0.55 * width * size[1] / size[0])
        plotter.renderer.ResetCameraClippingRange()
        return rendered_image(plotter)


def _section_view(
    field: StressField, flank: _LoadedFlank, point: Floats, top: float, size: tuple[int, int]
) -> tuple[Pixels, float]:
    """Both gears cut at the height of a point on the flank, close to it."""
    module = field.pair.pinion.transverse_module
    with offscreen_plotter(*size) as plotter:
        for number, sector in enumerate(field.sectors):
            grid = _grid(field, number, sector.hexahedra, 1.0)
            # A little beside the layer of nodes, where bricks are cut, not touched.
            cut = grid.slice(normal=(0.0, 0.0, 1.0), origin=(0.0, 0.0, point[2] + 1e-4 * module))
            plotter.add_mesh(
                cut,
                scalars="stress",
                clim=(0.0, top),
                cmap=_STRESS_MAP,
                lighting=False,
                show_scalar_bar=False,
            )
            outline = cut.extract_feature_edges(boundary_edges=True, feature_edges=False, manifold_edges=False)
            plotter.add_mesh(outline, color="#222222", line_width=2.0)
        plotter.camera_position = [point + np.array([0.0, 0.0, module]), point, flank.upward]
        plotter.camera.parallel_scale = 0.5 * _SECTION_HEIGHT * module
        plotter.renderer.ResetCameraClippingRange()
        return rendered_image(plotter)
