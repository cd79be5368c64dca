"""Stresses in meshing teeth at one position, from the reference analysis or under the superelement's pressures."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from fe_ste.contact.cells import Cells
from fe_ste.elasticity.sectors import OpenSector, refined_sectors
from fe_ste.geometry.gears import GearPair
from fe_ste.reference.contact_model import ContactModel
from fe_ste.reference.finite_deformation import von_mises
from fe_ste.reference.mortar import Surface
from fe_ste.reference.newton import fixed_body_displacement
from fe_ste.reference.position import NonlinearPosition, NonlinearSettings, gear_model
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed
from fe_ste.transmission_error.compliance import PairCompliance
from fe_ste.transmission_error.search import hertz_half_width, least_contact_length
from fe_ste.transmission_error.states import ContactState

#: Points across a contact cell at which its force acts.
_POINTS_ACROSS = 5

#: Facets whose middles lie nearest, seen along the axes, among which that under a point is looked for.
_CANDIDATES = 100


@dataclass(frozen=True)
class StressField(Displayed):
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
    sectors: tuple[OpenSector, OpenSector]
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
        if number:
            return slice(pinion_nodes, None)
        return slice(0, pinion_nodes)

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

    Both gears are open sectors, whose cut faces are free: stress near the contact is right, that at roots is too high
    (a pinion of the GRC: by 16 % with five teeth, 4 % with nine). `fe_ste.root_stress` has roots of the closed ring.

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
    sectors = refined_sectors(pair, settings.mesh, settings.teeth, state.pmc, half_width)
    model = gear_model(pair, torque, sectors, finite_deformation=False)
    rotation = state.pmc * pair.pinion.angular_pitch
    load_points, loads = _point_loads(pair, state.cells, state.solution.force, rotation, compliance)
    forces = sum(
        (_on_surface(model.bricks.points, surface, load_points, loads) for surface in (model.first, model.second)),
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
    pinion = pair.pinion
    loaded = force > 0.0
    share = (np.arange(_POINTS_ACROSS) + 0.5) / _POINTS_ACROSS * 2.0 - 1.0
    half_roll = (cells.half_across / (pinion.base_radius * cells.roll))[loaded]
    roll = cells.roll[loaded][:, None] + half_roll[:, None] * share
    height = np.broadcast_to(compliance.axial[cells.layer][loaded][:, None], roll.shape)
    working = pair.working_pressure_angle
    twist = math.tan(pinion.base_helix_angle) / pinion.base_radius
    turned = rotation + cells.tooth[loaded][:, None] * pinion.angular_pitch + twist * height
    polar = (math.tan(working) - working) - (roll - np.arctan(roll)) + turned
    radius = pinion.base_radius * np.sqrt(1.0 + roll**2)
    load_points = np.stack([radius * np.cos(polar), radius * np.sin(polar), height], axis=-1)
    return load_points.reshape(-1, 3), np.repeat(force[loaded] / _POINTS_ACROSS, _POINTS_ACROSS)


def _on_surface(points: Floats, surface: Surface, load_points: Floats, loads: Floats) -> Floats:
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
