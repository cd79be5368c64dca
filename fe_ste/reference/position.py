"""The reference analysis: full finite-element contact of a gear pair with geometric non-linearity.

Both gears are open sectors of some teeth, meshed afresh at each position so that they are fine where they touch there.
The pinion's hub is held; the gear's hub is rigid and turns about its axis under the torque. The static transmission
error is that turning, from the position in which the rigid flanks would roll, as a length on the base circle.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fe_ste.elasticity.sectors import ContactMesh, OpenSector, refined_sectors
from fe_ste.geometry.gears import GearPair
from fe_ste.reference.contact_model import ContactModel, Equilibrium, Iteration, TurningHub
from fe_ste.reference.finite_deformation import Bricks
from fe_ste.reference.mortar import Surface
from fe_ste.reference.newton import EquilibriumError, NewtonSettings, solve_contact
from fe_ste.tools.display import Displayed, TitledRows, value_range
from fe_ste.transmission_error.search import hertz_half_width, least_contact_length, normal_load

#: Mesh stiffness per face width for the first guess of the approach, N/m^2 (ISO 6336-1: 14 to 20 N/(mm um)).
_USUAL_STIFFNESS = 14e9

#: Overlap that the chords of a mesh may have at the start, in normal modules.
_ALLOWED_OVERLAP = 2e-3


@dataclass(frozen=True)
class NonlinearSettings(Displayed):
    """How a position is analysed."""

    teeth: int = 5
    """Odd number of teeth of each open sector."""
    mesh: ContactMesh = field(default_factory=ContactMesh)
    finite_deformation: bool = True
    """False leaves geometric non-linearity out: small strains, contact on the undeformed flanks."""
    newton: NewtonSettings = field(default_factory=NewtonSettings)

    def __post_init__(self) -> None:
        """Refuse sectors without a tooth in the middle."""
        if self.teeth < 1 or self.teeth % 2 == 0:
            raise ValueError(f"teeth = {self.teeth}: must be an odd number")

    def _line(self) -> str:
        strains = "finite deformation" if self.finite_deformation else "small strains"
        return f": sectors of {self.teeth} teeth, {self.mesh.layers} layers, {strains}"


@dataclass(frozen=True)
class NonlinearPosition(Displayed):
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
    sectors: tuple[OpenSector, OpenSector]
    """Gear 1, gear 2."""
    load_share: dict[int, float]
    """Tooth pair -> part of the normal load."""
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
        return f" of {self.pair.name!r}: pmc {self.pmc:.4g}, torque {self.torque:g} N m, ste {1e6 * self.ste:.5g} um"

    def _table(self) -> TitledRows:
        return f"gear pair {self.pair.name} by the reference analysis", {
            "position in the mesh cycle": f"{self.pmc:.4g}",
            "torque": value_range(self.torque, "N m"),
            "static transmission error": value_range(self.ste, "um", 1e6),
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
) -> NonlinearPosition:
    """Analyse one position of a gear pair.

    Parameters
    ----------
    torque : static torque on gear 1, N m, positive
    pmc : position in the mesh cycle
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
    sectors = refined_sectors(pair, settings.mesh, settings.teeth, pmc, half_width)
    model = gear_model(pair, torque, sectors, settings.finite_deformation)
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
        wall_time=time.perf_counter() - started,
    )


def gear_model(
    pair: GearPair, torque: float, sectors: tuple[OpenSector, OpenSector], finite_deformation: bool = True
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
    )


def _load_share(sector: OpenSector, model: ContactModel, equilibrium: Equilibrium) -> dict[int, float]:
    """Part of the normal load of each tooth pair: its nodal pressures over their areas."""
    load = equilibrium.pressure * equilibrium.weight
    shares = {}
    for tooth in np.unique(sector.tooth):
        nodes = np.unique(sector.facets[sector.tooth == tooth])
        shares[int(tooth)] = float(load[np.searchsorted(model.first.nodes, nodes)].sum() / load.sum())
    return shares
