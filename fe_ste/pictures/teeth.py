"""Pictures of meshing teeth under load, rendered off-screen (`fe_ste.tools.drawing`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from fe_ste.contact.kinematics import pinion_flank_points
from fe_ste.elasticity.gear_mesh import GearMesh, whole_ring
from fe_ste.elasticity.hexmesh import MeshSettings, sector_mesh
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Floats, Integers, Pixels
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.drawing import (
    drawing_style,
    finish_figure,
    new_figure,
    offscreen_plotter,
    place_picture,
    rendered_image,
    without_margins,
)

if TYPE_CHECKING:
    import pyvista
    from matplotlib.axes import Axes
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    from fe_ste.contact.kinematics import Cells
    from fe_ste.reference.position import StressField

#: Colours of the two gears of a pair.
PINION_COLOUR = "#B9C4D0"
GEAR_COLOUR = "#D9C9A8"
CONDENSED_COLOUR = "#F2F2F0"
_PRESSURE_MAP: Final = "inferno_r"


@dataclass(frozen=True)
class HexahedraMesh(ReprMixin, line=": {points!n} nodes, {hexahedra!n} hexahedra"):
    """Hexahedra of one body."""

    points: Floats
    """(n, 3) m."""
    hexahedra: Integers
    """(m, 8) connectivity in VTK order."""

    def surface(self) -> pyvista.PolyData:
        """Outer surface as quadrilaterals."""
        import pyvista

        grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: self.hexahedra}, self.points)
        return grid.extract_surface(algorithm="geometry")


def draw_gear_meshes(
    gears: Sequence[GearMesh], path: str | Path | None = None, *, title: str = "", size: tuple[int, int] = (1100, 1100)
) -> Figure:
    """Draw the meshes of both gears of the non-linear analysis: teeth that are meshed, and those that are condensed.

    Parameters
    ----------
    gears : gear 1 and gear 2, whole, see `fe_ste.elasticity.gear_mesh`
    path : where to write the picture
    title : name of the pair
    size : width and height of each of both views, pixels

    Returns
    -------
    on the left both gears from the front, on the right the teeth in contact

    Raises
    ------
    RenderingError
        If this machine cannot render off-screen; the message names what to install.
    ValueError
        If a gear is an open sector.
    """
    from matplotlib.patches import Patch

    parts = []
    for gear, colour in zip(gears, (PINION_COLOUR, GEAR_COLOUR), strict=True):
        ring = whole_ring(gear)
        meshed = ring.brick_tooth <= gear.brick_tooth.max()
        parts += [(HexahedraMesh(ring.points, ring.hexahedra[meshed]).surface(), colour)]
        parts += [(HexahedraMesh(ring.points, ring.hexahedra[~meshed]).surface(), CONDENSED_COLOUR)]
    flanks = gears[0].points[gears[0].facets[gears[0].tooth == 0]].reshape(-1, 3)
    front = float(gears[0].points[:, 2].max())
    middle = np.array([*flanks.mean(axis=0)[:2], front])
    extent = np.concatenate([part.points for part, _ in parts])[:, :2]
    centre = np.array([*(extent.min(axis=0) + np.ptp(extent, axis=0) / 2), front])
    height = float(np.ptp(flanks[:, :2], axis=0).max())
    views = []
    for focus, scale in ((centre, 0.52 * float(np.ptp(extent, axis=0).max())), (middle, 1.2 * height)):
        with offscreen_plotter(*size) as plotter:
            for surface, colour in parts:
                plotter.add_mesh(surface, color=colour, show_edges=True, edge_color="#555555", line_width=1.0)
            plotter.camera_position = [focus + np.array([0.0, 0.0, 10.0 * scale]), focus, (0.0, 1.0, 0.0)]
            plotter.camera.parallel_scale = scale
            plotter.renderer.ResetCameraClippingRange()
            views.append(rendered_image(plotter))
    with drawing_style():
        figure = new_figure(9.0, 4.9)
        for axes, (image, pixel), words in zip(
            figure.subplots(1, 2), views, (f"{title}: whole gears".lstrip(": "), "teeth in contact"), strict=True
        ):
            place_picture(axes, image, pixel, words)
        colours = {"pinion, meshed": PINION_COLOUR, "gear, meshed": GEAR_COLOUR, "condensed": CONDENSED_COLOUR}
        patches = [Patch(facecolor=shade, edgecolor="#555555", label=label) for label, shade in colours.items()]
        figure.legend(handles=patches, loc="outside lower center", ncols=3)
        return finish_figure(figure, path)


def draw_tooth_contact(
    pinion: HexahedraMesh,
    gear: HexahedraMesh,
    quads: Floats,
    pressure: Floats,
    path: str | Path | None = None,
    *,
    title: str = "",
    highest_pressure: float | None = None,
    size: tuple[int, int] = (1800, 1400),
) -> Figure:
    """Draw meshing teeth with the contact pressure on the pinion's flanks.

    Parameters
    ----------
    pinion, gear : some teeth of both gears in meshing position; the mating gear is drawn translucent
    quads : (k, 4, 3) corners of the contact cells on the flanks of the pinion, m
    pressure : (k,) contact pressure on the cells, Pa; cells without pressure are left out
    path : where to write the picture
    title : name of the pair and its load
    highest_pressure : upper end of the colours, Pa, for peaks at tip edges that would darken all else
    size : width and height of the rendered image, pixels

    Returns
    -------
    above the teeth, below the contact cells unrolled over face width and radius

    Raises
    ------
    RenderingError
        If this machine cannot render off-screen; the message names what to install.
    ValueError
        If quads and pressure do not fit or nothing is loaded.
    """
    from matplotlib.patches import Patch

    if quads.ndim != 3 or quads.shape[1:] != (4, 3) or pressure.shape != quads.shape[:1]:
        raise ValueError(f"quads {quads.shape} and pressure {pressure.shape} must be (k, 4, 3) and (k,)")
    loaded = pressure > 0.0
    if not np.any(loaded):
        raise ValueError("draw_tooth_contact: no cell carries pressure")
    top = 1e-6 * (highest_pressure or float(pressure.max()))
    image, pixel = _render_contact(pinion, gear, quads[loaded], 1e-6 * pressure[loaded], top, size)
    with drawing_style():
        tall = 6.5 * image.shape[0] / image.shape[1]
        figure = new_figure(7.6, tall + 2.5)
        picture, chart = figure.subplots(2, 1, height_ratios=(tall, 1.9))
        place_picture(picture, image, pixel, title)
        patches = [
            Patch(facecolor=colour, edgecolor="#555555", label=label)
            for label, colour in (("pinion", PINION_COLOUR), ("gear, translucent", GEAR_COLOUR))
        ]
        picture.legend(handles=patches, loc="lower right", ncols=2, borderaxespad=0.0)
        cells = _chart_pressure(chart, quads[loaded], 1e-6 * pressure[loaded], top)
        extend = "max" if 1e-6 * pressure.max() > 1.001 * top else "neither"
        figure.colorbar(cells, ax=[picture, chart], label="Contact pressure / MPa", aspect=35, extend=extend)
        return finish_figure(figure, path)


def _render_contact(
    pinion: HexahedraMesh,
    gear: HexahedraMesh,
    quads: Floats,
    pressure: Floats,
    top: float,
    size: tuple[int, int],
) -> tuple[Pixels, float]:
    """Picture and size of its pixels; pressure in MPa."""
    direction, upward = _view_on_contact(quads, pressure, pinion.points)
    with offscreen_plotter(*size) as plotter:
        for body, colour, opacity in ((pinion, PINION_COLOUR, 1.0), (gear, GEAR_COLOUR, 0.12)):
            surface = body.surface()
            plotter.add_mesh(surface, color=colour, opacity=opacity, ambient=0.35, diffuse=0.65)
            edges = surface.extract_feature_edges(30.0, manifold_edges=False, non_manifold_edges=False)
            plotter.add_mesh(edges, color="#444444", line_width=1.5, opacity=0.5 + 0.5 * opacity)
        # Towards the eye by next to nothing, so that the cells are not lost in the flank below them.
        lift = 2e-3 * float(np.ptp(pinion.points, axis=0).max()) * direction
        patch = _quad_surface(quads + lift)
        patch.cell_data["pressure"] = pressure
        _add_unlit(plotter, patch, "pressure", top, _PRESSURE_MAP)
        focus = quads.mean(axis=(0, 1))
        plotter.camera_position = [focus + direction, focus, upward]
        plotter.renderer.ResetCamera()
        image, pixel = rendered_image(plotter)
    return without_margins(image), pixel


def _chart_pressure(panel: Axes, quads: Floats, pressure: Floats, top: float) -> PolyCollection:
    """Contact cells unrolled: radius over face width, the radius stretched."""
    from matplotlib.collections import PolyCollection

    radius = 1e3 * np.hypot(quads[..., 0], quads[..., 1])
    height = 1e3 * quads[..., 2]
    outlines = list(np.stack([height, radius], axis=-1))
    cells = PolyCollection(outlines, array=pressure, cmap=_PRESSURE_MAP, edgecolor="face")
    cells.set_clim(0.0, top)
    panel.add_collection(cells)
    panel.autoscale_view()
    panel.set(xlabel="Face width z / mm", ylabel="Pinion radius / mm")
    return cells


def _add_unlit(
    plotter: pyvista.Plotter, mesh: pyvista.PolyData, name: str, top: float, colours: Literal["inferno_r", "turbo"]
) -> None:
    """Add a mesh in the colours of its values from zero to `top`, not shaded by light."""
    plotter.add_mesh(mesh, scalars=name, clim=(0.0, top), cmap=colours, lighting=False, show_scalar_bar=False)


def _quad_surface(quads: Floats) -> pyvista.PolyData:
    import pyvista

    faces = np.column_stack([np.full(len(quads), 4), np.arange(4 * len(quads)).reshape(-1, 4)])
    return pyvista.PolyData(quads.reshape(-1, 3), faces=faces.ravel())


def _view_on_contact(quads: Floats, pressure: Floats, body: Floats) -> tuple[Floats, Floats]:
    """Direction to the eye, before the loaded flank and a little beyond the face, and which way is up."""
    normals = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    outward = np.sign(np.einsum("ij,ij->i", normals, quads.mean(axis=1) - body.mean(axis=0)))
    normal = np.sum((outward * pressure)[:, None] * normals, axis=0)
    normal[2] = 0.0
    normal /= np.linalg.norm(normal)
    radial = quads.mean(axis=(0, 1)) * np.array([1.0, 1.0, 0.0])
    radial -= (radial @ normal) * normal
    radial /= np.linalg.norm(radial)
    direction = normal + 0.45 * radial + 0.45 * np.array([0.0, 0.0, 1.0])
    return direction / np.linalg.norm(direction), radial


def meshed_teeth(
    pair: GearPair, rotation: float, teeth: Sequence[int], settings: MeshSettings | None = None
) -> tuple[HexahedraMesh, HexahedraMesh]:
    """Mesh some teeth of both gears and put them into meshing position.

    Parameters
    ----------
    pair : the pair
    rotation : rotation of gear 1, rad, from where tooth pair 0 touches at the pitch point; gear 2 rolls with it
    teeth : tooth pairs to show
    settings : elements per tooth

    Returns
    -------
    pinion, gear : HexahedraMesh
        In the frame of gear 1: its axis is z, the line of centres lies along x, z = 0 is the middle of both
        face widths.

    Examples
    --------
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> pinion, mate = meshed_teeth(pair, 0.0, [0], MeshSettings(layers=3, flank=4, thickness=2))
    >>> from_axis = np.hypot(mate.points[:, 0] - 90e-3, mate.points[:, 1])
    >>> bool(abs(from_axis.max() - gear.tip_radius) < 1e-9)
    True
    """
    kind = -1.0 if pair.gear.internal else 1.0
    pinion = _Side(
        start=-float(pair.pinion.half_angle(pair.pinion_working_radius)),
        pitch=pair.pinion.angular_pitch,
        ratio=1.0,
        centre=0.0,
        facing=1.0,
    )
    # The flank that gear 1 pushes lies on the other side of an internal tooth.
    gear = _Side(
        start=-kind * float(pair.gear.half_angle(pair.gear_working_radius)),
        pitch=-kind * pair.gear.angular_pitch,
        ratio=-kind * pair.pinion.teeth / pair.gear.teeth,
        centre=kind * pair.centre_distance,
        facing=-kind,
    )
    return (
        _teeth_of(pair.pinion, pinion, rotation, teeth, settings),
        _teeth_of(pair.gear, gear, rotation, teeth, settings),
    )


@dataclass(frozen=True)
class _Side:
    """Position of a gear in a pair: polar angle of the middle of its tooth 0, pitch and the gear's own frame."""

    start: float
    pitch: float
    ratio: float
    centre: float
    facing: float


def _teeth_of(
    gear: Gear, side: _Side, rotation: float, teeth: Sequence[int], settings: MeshSettings | None
) -> HexahedraMesh:
    sector = sector_mesh(gear, settings)
    angles = [side.start + side.ratio * rotation + tooth * side.pitch for tooth in teeth]
    points = np.concatenate([_turned(sector.points, angle) for angle in angles])
    points[:, :2] = side.facing * points[:, :2] + np.array([side.centre, 0.0])
    offsets = np.arange(len(angles))[:, None, None] * len(sector.points)
    return HexahedraMesh(points, (sector.hexahedra + offsets).reshape(-1, 8))


def _turned(points: Floats, angle: float) -> Floats:
    cosine = math.cos(angle)
    sine = math.sin(angle)
    turned: Floats = points @ np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return turned


def contact_quads(pair: GearPair, cells: Cells, rotation: float, axial: Floats, slice_width: float) -> Floats:
    """Corners of contact cells on the flanks of gear 1.

    Parameters
    ----------
    pair : the pair
    cells : cells of a contact analysis
    rotation : rotation of gear 1, rad
    axial : (slices,) middle of the slices, m
    slice_width : m

    Returns
    -------
    (k, 4, 3) m, in the frame of `meshed_teeth`
    """
    # Along the profile the arc of an involute grows by r_b tan(alpha) per roll angle.
    half_roll = cells.half_across / (pair.pinion.base_radius * cells.roll)
    roll = cells.roll[:, None] + half_roll[:, None] * np.array([-1.0, 1.0, 1.0, -1.0])
    height = axial[cells.layer][:, None] + 0.5 * slice_width * np.array([-1.0, -1.0, 1.0, 1.0])
    return pinion_flank_points(pair, roll, cells.tooth[:, None], height, rotation)


# Pictures of contact stress: the flank from the front and the section through the contact, rendered off-screen

_STRESS_MAP: Final = "turbo"

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
    # The highest stress in the section, not the peaks at edges of other teeth.
    points = np.concatenate([sector.points for sector in field.sectors])
    apart = np.abs(points - flank.points[flank.highest])
    shown = np.hypot(apart[:, 0], apart[:, 1]) < 0.5 * _SECTION_HEIGHT * field.pair.pinion.transverse_module
    layer = apart[:, 2] <= max(float(apart[shown, 2].min()), 0.02 * field.pair.face_width)
    top = 1e-6 * float(field.von_mises[shown & layer].max())
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
    """Flank of a gear that carries the largest load, and its viewing directions.

    ``points``, ``displacement`` and ``pressure`` belong to the gear's nodes, ``highest`` is the node of highest
    pressure away from the end faces, ``normal`` points out of the flank in the transverse plane, ``upward`` along it to
    the tip.
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
    sector: GearMesh,
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
        _add_unlit(plotter, patch, "pressure", 1e-6 * flank.top_pressure, _PRESSURE_MAP)
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
            _add_unlit(plotter, cut, "stress", top, _STRESS_MAP)
            outline = cut.extract_feature_edges(boundary_edges=True, feature_edges=False, manifold_edges=False)
            plotter.add_mesh(outline, color="#222222", line_width=2.0)
        plotter.camera_position = [point + np.array([0.0, 0.0, module]), point, flank.upward]
        plotter.camera.parallel_scale = 0.5 * _SECTION_HEIGHT * module
        plotter.renderer.ResetCameraClippingRange()
        return rendered_image(plotter)
