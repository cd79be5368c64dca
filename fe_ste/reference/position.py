"""The reference analysis: full finite-element contact of a gear pair with geometric nonlinearity.

Both gears are complete: the teeth in contact and their neighbours are remeshed at each position, fine around the
contact, and the other teeth of each closed ring are condensed onto the ends of this sector
(`fe_ste.elasticity.gear_mesh`). The pinion's hub is fixed; the gear's hub is rigid and turns about its axis under the
torque. The static transmission error is this rotation, from the position in which the rigid flanks would roll, as a
length on the base circle.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from scipy.spatial import cKDTree

from fe_ste.contact.kinematics import Cells, pinion_flank_points
from fe_ste.elasticity.gear_mesh import ContactMesh, GearMesh, refined_gears
from fe_ste.flanks import FlankModification
from fe_ste.geometry.gears import GearPair
from fe_ste.reference.finite_deformation import Bricks, von_mises
from fe_ste.reference.mortar import Surface
from fe_ste.reference.newton import (
    CondensedPart,
    ContactModel,
    Equilibrium,
    EquilibriumError,
    Iteration,
    NewtonSettings,
    TurningHub,
    fixed_body_displacement,
    solve_contact,
)
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin, TitledRows, value_range
from fe_ste.transmission_error.compliance import PairCompliance
from fe_ste.transmission_error.contact_stress import contact_line_stress, mean_over_contact_line
from fe_ste.transmission_error.search import flank_radii, hertz_half_width, least_contact_length, normal_load
from fe_ste.transmission_error.states import ContactState

Modifications: TypeAlias = tuple[FlankModification, FlankModification]
"""Of the flanks of gear 1 and gear 2."""
UNMODIFIED: Modifications = (FlankModification(), FlankModification())

#: Mesh stiffness per face width for the first guess of the approach, N/m^2 (ISO 6336-1: 14 to 20 N/(mm um)).
_USUAL_STIFFNESS = 14e9

#: Overlap that the chords of a mesh may have at the start, in normal modules.
_ALLOWED_OVERLAP = 2e-3


@dataclass(frozen=True)
class NonlinearSettings(ReprMixin):
    """How a position is analysed."""

    teeth: int | None = None
    """Odd number of teeth of each gear that are meshed; by default those that `fe_ste.elasticity.gear_mesh` chooses."""
    mesh: ContactMesh = field(default_factory=ContactMesh)
    closed: bool = True
    """False leaves the other teeth away: open sectors with free cut faces, which are too soft where bodies are deep."""
    finite_deformation: bool = True
    """False leaves geometric non-linearity out: small strains, contact on the undeformed flanks."""
    newton: NewtonSettings = field(default_factory=NewtonSettings)

    def __post_init__(self) -> None:
        """Refuse meshed teeth without one in the middle."""
        if self.teeth is not None and (self.teeth < 1 or self.teeth % 2 == 0):
            raise ValueError(f"teeth = {self.teeth}: must be an odd number")

    def _line(self) -> str:
        return f": {self.bodies}, {self.mesh.layers} layers, {self.strains}"

    @property
    def bodies(self) -> str:
        """Modelled part of the gears, as text."""
        bodies = "whole gears" if self.closed else "open sectors"
        return bodies if self.teeth is None else f"{bodies} with {self.teeth} teeth meshed"

    @property
    def strains(self) -> str:
        """Kinematics of the bricks, as text."""
        return "finite deformation" if self.finite_deformation else "small strains"


@dataclass(frozen=True)
class NonlinearPosition(ReprMixin):
    """One position solved."""

    pair: GearPair
    torque: float
    """On gear 1, N m."""
    pmc: float
    ste: float
    """m."""
    model: ContactModel
    """Gear 1's nodes and bricks first."""
    equilibrium: Equilibrium
    sectors: tuple[GearMesh, GearMesh]
    """Gear 1, gear 2."""
    load_share: dict[int, float]
    """Tooth pair -> part of the normal load."""
    contact_stress: dict[int, float]
    """Tooth pair -> Hertzian stress of its line load, mean along the contact line weighted by that load, Pa."""
    wall_time: float
    """s."""

    @property
    def pinion_nodes(self) -> int:
        """Number of nodes of gear 1, which come first in the model."""
        return len(self.sectors[0].points)

    @property
    def unknowns(self) -> int:
        """Displacements, held ones too."""
        return int(self.model.held.size)

    def _line(self) -> str:
        return f" of {self.pair.name!r}: pmc {self.pmc:.4g}, torque {self.torque:g} N m, ste {1e6 * self.ste:.5g} µm"

    def _table(self) -> TitledRows:
        return f"gear pair {self.pair.name} by the reference analysis", {
            "position in the mesh cycle": f"{self.pmc:.4g}",
            "torque": value_range(self.torque, "N m"),
            "static transmission error": value_range(self.ste, "µm", 1e6),
            "load share": ", ".join(f"tooth pair {tooth}: {share:.1%}" for tooth, share in self.load_share.items()),
            "unknowns": str(self.unknowns),
            "Newton iterations": str(len(self.equilibrium.iterations)),
            "wall time": value_range(self.wall_time, "s"),
        }


def nonlinear_position(
    pair: GearPair,
    torque: float,
    pmc: float,
    settings: NonlinearSettings | None = None,
    report: Callable[[Iteration], None] | None = None,
    modifications: Modifications = UNMODIFIED,
) -> NonlinearPosition:
    """Analyse one position of a gear pair.

    Parameters
    ----------
    torque : static torque on gear 1, N m, positive
    pmc : position in the mesh cycle
    modifications : of the flanks of gear 1 and gear 2; the elements keep the unmodified flanks, whose gap is widened
    report : called after each Newton iteration

    Raises
    ------
    EquilibriumError
        If Newton's method fails; the message names position, load step and iteration.
    GeometryError
        If a gear cannot be meshed.
    ValueError
        If the torque is not positive.
    """
    if not (math.isfinite(torque) and torque > 0.0):
        raise ValueError(f"torque = {torque}: must be a positive torque on gear 1")
    settings = settings or NonlinearSettings()
    started = time.perf_counter()
    half_width = hertz_half_width(pair, normal_load(pair, torque) / least_contact_length(pair))
    sectors = refined_gears(pair, settings.mesh, pmc, half_width, settings.teeth, settings.closed)
    model = gear_model(pair, torque, sectors, settings.finite_deformation)
    # Material removed from both flanks at the nodes of the loaded flanks of gear 1.
    x, y, z = model.bricks.points[model.first.nodes].T
    removed = np.zeros(len(z))
    for gear, mesh, modification in zip((pair.pinion, pair.gear), sectors, modifications, strict=True):
        radius = np.clip(np.hypot(x - mesh.axis_x, y), *flank_radii(gear))
        removed = removed + modification.gap(gear, radius, z)
    model = replace(model, clearance=removed)
    try:
        equilibrium = solve_contact(model, settings.newton, report)
    except EquilibriumError as error:
        raise EquilibriumError(f"position {pmc:.4g} of the mesh cycle, torque {torque:g} N m: {error}") from error
    return NonlinearPosition(
        pair=pair,
        torque=torque,
        pmc=pmc,
        ste=equilibrium.hub,
        model=model,
        equilibrium=equilibrium,
        sectors=sectors,
        load_share=_load_share(sectors[0], model, equilibrium),
        contact_stress=_contact_stress(pair, pmc, sectors[0], model, equilibrium),
        wall_time=time.perf_counter() - started,
    )


def gear_model(
    pair: GearPair, torque: float, sectors: tuple[GearMesh, GearMesh], finite_deformation: bool = True
) -> ContactModel:
    """Put two sectors, in their places, together to a contact problem.

    The rigid flanks touch along their contact lines; the first guess of the contact is where their gap is less than
    that at the edge of a Hertzian contact, b^2 / (2 R) = 2 w / (pi E*).

    Parameters
    ----------
    torque : on gear 1, N m
    """
    pinion_sector, gear_sector = sectors
    points = np.concatenate([pinion_sector.points, gear_sector.points])
    shift = len(pinion_sector.points)
    material_of = np.repeat([0, 1], [len(pinion_sector.hexahedra), len(gear_sector.hexahedra)])
    held = np.zeros_like(points, dtype=np.bool_)
    held[pinion_sector.held] = True
    mate_sign = -1.0 if pair.gear.internal else 1.0
    module = pair.pinion.normal_module
    approach = torque / pair.pinion.base_radius / (_USUAL_STIFFNESS * pair.face_width)
    line_load = normal_load(pair, torque) / least_contact_length(pair)
    compliance = sum((1 - g.material.poissons_ratio**2) / g.material.youngs_modulus for g in (pair.pinion, pair.gear))
    return ContactModel(
        bricks=Bricks.from_mesh(
            points,
            np.concatenate([pinion_sector.hexahedra, gear_sector.hexahedra + shift]),
            (pair.pinion.material, pair.gear.material),
            material_of,
            finite=finite_deformation,
        ),
        first=Surface(pinion_sector.facets),
        second=Surface(gear_sector.facets + shift),
        held=held,
        forces=np.zeros_like(points),
        modulus=pair.pinion.material.youngs_modulus,
        search=min(max(0.05 * module, 5.0 * approach), 0.3 * module),
        reach=2.0 * line_load * compliance / math.pi,
        allowed_overlap=_ALLOWED_OVERLAP * module,
        hub=TurningHub(
            nodes=gear_sector.held + shift,
            axis=np.array([mate_sign * pair.centre_distance, 0.0]),
            lever=mate_sign * pair.gear.base_radius,
            force=torque / pair.pinion.base_radius,
        ),
        condensed=tuple(
            CondensedPart(mesh.others.nodes + first, mesh.others.stiffness, turns)
            for mesh, first, turns in ((pinion_sector, 0, False), (gear_sector, shift, True))
            if mesh.others is not None
        ),
    )


def _load_share(sector: GearMesh, model: ContactModel, equilibrium: Equilibrium) -> dict[int, float]:
    """Part of the normal load of each tooth pair: its nodal pressures over their areas."""
    load = equilibrium.pressure * equilibrium.weight
    shares = {}
    for tooth in np.unique(sector.tooth):
        nodes = np.unique(sector.facets[sector.tooth == tooth])
        shares[int(tooth)] = float(load[np.searchsorted(model.first.nodes, nodes)].sum() / load.sum())
    return shares


def _contact_stress(
    pair: GearPair, pmc: float, sector: GearMesh, model: ContactModel, equilibrium: Equilibrium
) -> dict[int, float]:
    """Mean Hertzian stress of each tooth pair, from the forces of the rows of nodes along the face."""
    force = equilibrium.pressure * equilibrium.weight
    axial = model.bricks.points[model.first.nodes, 2]
    rows, row = np.unique(axial.round(9), return_inverse=True)
    widths = np.convolve(np.diff(rows), [0.5, 0.5])
    cosine = math.cos(pair.pinion.base_helix_angle)
    stresses = {}
    for tooth in np.unique(sector.tooth):
        nodes = np.searchsorted(model.first.nodes, np.unique(sector.facets[sector.tooth == tooth]))
        load = np.bincount(row[nodes], weights=force[nodes], minlength=len(rows))
        stress = contact_line_stress(pair, pmc, tooth, rows, cosine * load / widths)
        stresses[int(tooth)] = float(mean_over_contact_line(stress, load))
    return stresses


#: Points across a contact cell at which its force acts.
_POINTS_ACROSS = 5

#: Facets whose middles lie nearest, seen along the axes, among which that under a point is looked for.
_CANDIDATES = 100


@dataclass(frozen=True)
class StressField(ReprMixin):
    """Both gears at one position, deformed.

    Attributes
    ----------
    method : "non-linear" or "superelement"
    """

    pair: GearPair
    torque: float
    """On gear 1, N m."""
    pmc: float
    method: str
    sectors: tuple[GearMesh, GearMesh]
    """Undeformed gear 1 and gear 2; the nodes below are gear 1's, then gear 2's."""
    displacement: Floats
    """(n, 3) m."""
    von_mises: Floats
    """(n,) Pa."""
    pressure: Floats
    """(n,) contact pressure at the nodes of both gears' loaded flanks, zero elsewhere, Pa."""

    def nodes_of(self, number: int) -> slice:
        """Place of the nodes of gear 1 (`number` 0) or gear 2 (1) in the nodal values."""
        pinion_nodes = len(self.sectors[0].points)
        return slice(pinion_nodes, None) if number else slice(0, pinion_nodes)

    def _line(self) -> str:
        return (
            f" of {self.pair.name!r}: pmc {self.pmc:.4g}, torque {self.torque:g} N m, {self.method}, "
            f"von Mises up to {1e-6 * self.von_mises.max():.4g} MPa"
        )


def stress_of_position(position: NonlinearPosition) -> StressField:
    """Stresses of a position of the reference analysis."""
    equilibrium = position.equilibrium
    model = position.model
    return StressField(
        pair=position.pair,
        torque=position.torque,
        pmc=position.pmc,
        method="non-linear",
        sectors=position.sectors,
        displacement=equilibrium.displacement,
        von_mises=von_mises(model.bricks.nodal_stress(equilibrium.displacement, equilibrium.modes)),
        pressure=_pressure(model, equilibrium.contact_force),
    )


def stress_of_state(
    compliance: PairCompliance, state: ContactState, torque: float, settings: NonlinearSettings | None = None
) -> StressField:
    """Stresses under the contact pressures that the superelement gives, by linear finite elements.

    Both gears are whole unless `settings` says otherwise; of an open sector stress near the contact is right, that at
    the roots is not.

    Parameters
    ----------
    state : solved contact of the position
    torque : on gear 1, N m
    settings : mesh and number of teeth

    Returns
    -------
    both hubs are held under the pressures; gear 2 is then turned until the flanks close in the mean over the load
    """
    pair = compliance.pair
    settings = settings or NonlinearSettings()
    half_width = hertz_half_width(pair, state.normal_load / least_contact_length(pair))
    sectors = refined_gears(pair, settings.mesh, state.pmc, half_width, settings.teeth, settings.closed)
    model = gear_model(pair, torque, sectors, finite_deformation=False)
    rotation = state.pmc * pair.pinion.angular_pitch
    load_points, loads = _point_loads(pair, state.cells, state.solution.force, rotation, compliance)
    forces = sum(
        (_nodal_forces(model.bricks.points, surface, load_points, loads) for surface in (model.first, model.second)),
        np.zeros_like(model.bricks.points),
    )
    held = model.held.copy()
    if model.hub is not None:
        held[model.hub.nodes] = True
    displacement, modes = fixed_body_displacement(replace(model, held=held, hub=None, forces=forces))
    stress = von_mises(model.bricks.nodal_stress(displacement, modes))
    # Mean over the load of what the flanks yield and of the gap they close: work over the force on the line of action.
    work = float(np.sum(forces * displacement)) + float(state.solution.force @ state.cells.gap)
    approach = work * pair.pinion.base_radius / torque
    return StressField(
        pair=pair,
        torque=torque,
        pmc=state.pmc,
        method="superelement",
        sectors=sectors,
        displacement=displacement + _turning(model, approach, len(sectors[0].points)),
        von_mises=stress,
        pressure=_pressure(model, forces),
    )


def _pressure(model: ContactModel, forces: Floats) -> Floats:
    """Nodal contact forces over the areas of the nodes of both surfaces."""
    pressure = np.zeros(len(forces))
    for surface in (model.first, model.second):
        area = surface.areas(model.bricks.points)
        pressure[surface.nodes] = np.linalg.norm(forces[surface.nodes], axis=1) / area
    return pressure


def _turning(model: ContactModel, approach: float, pinion_nodes: int) -> Floats:
    """Displacement of gear 2 that turns as a rigid body by an approach on the line of action."""
    turned = np.zeros_like(model.bricks.points)
    if model.hub is not None:
        x, y = (model.bricks.points[pinion_nodes:, :2] - model.hub.axis).T
        turned[pinion_nodes:, :2] = approach / model.hub.lever * np.stack([-y, x], axis=1)
    return turned


def _point_loads(
    pair: GearPair, cells: Cells, force: Floats, rotation: float, compliance: PairCompliance
) -> tuple[Floats, Floats]:
    """Points (p, 3) on the flanks of gear 1 and the forces (p,) at them."""
    loaded = force > 0.0
    share = (np.arange(_POINTS_ACROSS) + 0.5) / _POINTS_ACROSS * 2.0 - 1.0
    half_roll = (cells.half_across / (pair.pinion.base_radius * cells.roll))[loaded]
    roll = cells.roll[loaded][:, None] + half_roll[:, None] * share
    axial = compliance.axial[cells.layer][loaded][:, None]
    load_points = pinion_flank_points(pair, roll, cells.tooth[loaded][:, None], axial, rotation)
    return load_points.reshape(-1, 3), np.repeat(force[loaded] / _POINTS_ACROSS, _POINTS_ACROSS)


def _nodal_forces(points: Floats, surface: Surface, load_points: Floats, loads: Floats) -> Floats:
    """Nodal forces (n, 3) of normal forces that push on a surface, shared by the nearest facet's corners."""
    corners = points[surface.facets]
    middle = corners.mean(axis=1)
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # Facets are long and narrow: the nearest one is where the point lies within its two directions.
    _, neighbours = cKDTree(middle[:, :2]).query(load_points[:, :2], k=min(_CANDIDATES, len(middle)))
    candidates = np.asarray(neighbours, dtype=np.int64).reshape(len(load_points), -1)
    along = corners[:, 1] - corners[:, 0]
    across = corners[:, 3] - corners[:, 0]
    apart = load_points[:, None] - middle[candidates]
    # Coordinates along the two directions, which are not at right angles where the mesh follows a slanted line.
    along_product, across_product = (np.einsum("pka,pka->pk", apart, way[candidates]) for way in (along, across))
    along_square, across_square = (np.sum(way**2, axis=1)[candidates] for way in (along, across))
    mixed = np.sum(along * across, axis=1)[candidates]
    determinant = along_square * across_square - mixed**2
    s = (across_square * along_product - mixed * across_product) / determinant
    t = (along_square * across_product - mixed * along_product) / determinant
    # Facets of other teeth can lie under a point too, but far below it.
    below = np.abs(np.einsum("pka,pka->pk", apart, normals[candidates])) / np.sqrt(
        np.minimum(along_square, across_square)
    )
    best = np.argmin(np.maximum(np.maximum(np.abs(s), np.abs(t)), below), axis=1)
    rows = np.arange(len(load_points))
    facet = candidates[rows, best]
    u, v = (np.clip(value[rows, best] + 0.5, 0.0, 1.0) for value in (s, t))
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)
    forces = np.zeros_like(points)
    pushes = -(loads[:, None, None] * weights[:, :, None]) * normals[facet][:, None]
    np.add.at(forces, surface.facets[facet], pushes)
    return forces
