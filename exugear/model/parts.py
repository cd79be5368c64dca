"""The parts of a gearbox as data in SI: bodies, supports, meshes, load cases; gears as their sections give them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exugear.model.sections import CatalogueSection, GearSection, ModificationSection, StiffnessSection
from fe_ste.flanks.modifications import (
    FlankModification,
    Relief,
    ReliefShape,
    radius_at_roll_length_from_root,
    radius_at_roll_length_from_tip,
)
from fe_ste.flanks.topography import FlankTopography
from fe_ste.geometry.gears import BasicRack, Gear, GearPair, Material


@dataclass(frozen=True)
class Body:
    """A rigid body, its place at zero angles and its mass properties (about the centre of mass).

    Attributes
    ----------
    axis : (2,) axis position x, y at zero angles, m
    centre_of_mass_z : float, m
    mass, axial, transverse : kg, kg m2, kg m2; mass and transverse are 0 for a spin-only body
    carrier, orbit_angle : name of the carrier a planet rides on (None else) and its angle there, rad
    wheels : gear name -> z of the gear's mid-plane, m
    """

    name: str
    family: str
    axis: tuple[float, float]
    centre_of_mass_z: float
    mass: float
    axial: float
    transverse: float
    carrier: str | None
    orbit_angle: float
    spin_only: bool
    fixed: bool
    wheels: Mapping[str, float]


@dataclass(frozen=True)
class Joint:
    """Ideal joint at `place` (m) between `on` and `body` that leaves only the spin about z."""

    name: str
    body: str
    on: str
    place: tuple[float, float, float]


@dataclass(frozen=True)
class Bearing:
    """Compliant support at `place` (m, at zero angles); 6x6 in the axes of `on`, order x y z rx ry rz.

    `stiffness` holds what the file gives (NaN-free 6x6) with None where only the catalogue is given; `given`
    marks entries that replace catalogue values. `factor` (housing) is not yet multiplied in.
    """

    name: str
    family: str
    body: str
    on: str
    place: tuple[float, float, float]
    stiffness: StiffnessSection | None
    catalogue: CatalogueSection | None
    damping: StiffnessSection | None
    factor: float


@dataclass(frozen=True)
class Coupling:
    """Torsional spring (N m/rad) and damper (N m s/rad) between two spins; `seat` is where on elastic bodies."""

    name: str
    first: str
    second: str
    seat: str | None
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Mesh:
    """A gear pair at work.

    Attributes
    ----------
    pinion, gear : names of the bodies that carry gear 1 and gear 2
    frame : body whose spin carries the line of centres, or "ground"
    z : middle of the common face width, m
    offsets : z of that middle from the middle of gear 1 and of gear 2, m
    position_angle : polar angle of the line from gear 1's axis to gear 2's axis at zero angles, rad
    centre_distance : from the bodies' positions, m (the pair's own value agrees within 20 um)
    phase : PMC at zero angles where the file overrides what geometry gives, else None
    """

    name: str
    family: str
    pair: GearPair
    pinion: str
    gear: str
    frame: str
    z: float
    offsets: tuple[float, float]
    position_angle: float
    centre_distance: float
    phase: float | None


@dataclass(frozen=True)
class WheelDeviation:
    """Errors of one wheel that return with each of its revolutions.

    Attributes
    ----------
    teeth : number of teeth
    pitch : (teeth,) by which each loaded flank stands back on the transverse line of action, m; tooth 0 is the first at
        a positive polar angle at zero body angle, the others follow in the positive sense
    eccentricity : distance of the teeth's axis from the body's, m
    eccentricity_angle : its polar angle at zero body angle, rad
    """

    teeth: int
    pitch: NDArray[np.float64]
    eccentricity: float
    eccentricity_angle: float


@dataclass(frozen=True)
class LoadCase:
    """Loads of a run: torques by body (N m), duration (s), speeds (rad/s) and the drive, if any."""

    name: str
    torques: Mapping[str, float]
    torque_series: Path | None
    duration: float
    start_speed: float
    driven_body: str | None
    end_speed: float | None
    drive_stiffness: float | None
    description: str


@dataclass(frozen=True)
class PairSpec:
    """What the STE table of a pair needs.

    Attributes
    ----------
    name : str
    pair : GearPair
    static_torque : float
        On gear 1, N m, positive.
    table : bool
        Whether the file wants a table of it.
    flank : int
        Loaded flank of gear 1 in the static state: +1 if it faces the sense of +z rotation, else -1. A table is that
        of flank +1; turned about the line of centres it is that of flank -1, with the ends of the face exchanged.
    modifications : tuple of FlankModification
        Gear 1, gear 2, in the axes of the gearbox.
    """

    name: str
    pair: GearPair
    static_torque: float
    table: bool
    flank: int
    modifications: tuple[FlankModification, FlankModification]


def stiffness_matrix(section: StiffnessSection | None) -> NDArray[np.float64]:
    """Stiffness or damping (6, 6) as a section gives it; zeros for none."""
    if section is None:
        return np.zeros((6, 6))
    if section.matrix is not None:
        return np.array(section.matrix, dtype=np.float64)
    radial, tilt = section.radial_N_per_m, section.tilt_N_m_per_rad
    return np.diag([radial, radial, section.axial_N_per_m, tilt, tilt, section.torsion_N_m_per_rad])


def gear_from(name: str, section: GearSection) -> Gear:
    """Gear from its section: millimetres to metres, degrees to radians."""
    return Gear(
        name=name,
        teeth=section.teeth,
        normal_module=section.normal_module_mm * 1e-3,
        normal_pressure_angle=math.radians(section.normal_pressure_angle_deg),
        helix_angle=math.radians(section.helix_angle_deg),
        profile_shift=section.profile_shift,
        face_width=section.face_width_mm * 1e-3,
        held_diameter=section.held_diameter_mm * 1e-3,
        internal=section.internal,
        rack=BasicRack(section.rack.addendum, section.rack.dedendum, section.rack.tip_radius),
        tip_diameter=None if section.tip_diameter_mm is None else section.tip_diameter_mm * 1e-3,
        root_diameter=None if section.root_diameter_mm is None else section.root_diameter_mm * 1e-3,
        tooth_thinning=section.tooth_thinning_mm * 1e-3,
        material=Material(
            youngs_modulus=section.material.youngs_modulus_GPa * 1e9,
            poissons_ratio=section.material.poissons_ratio,
            density=section.material.density_kg_per_m3,
        ),
    )


def modification_from(gear: Gear, section: GearSection, find: Callable[[str], Path]) -> FlankModification:
    """Modification of a gear from its section, tried on the gear; `find` gives the path of the topography it names."""
    given = section.modification
    if given is None:
        return FlankModification()
    modification = FlankModification(
        tip_relief=_relief(gear, given, "tip", radius_at_roll_length_from_tip),
        root_relief=_relief(gear, given, "root", radius_at_roll_length_from_root),
        profile_crowning=1e-6 * given.profile_crowning_um,
        lead_crowning=1e-6 * given.lead_crowning_um,
        profile_slope=1e-6 * given.profile_slope_um,
        helix_slope=1e-6 * given.helix_slope_um,
        twist=1e-6 * given.twist_um,
        topography=None if given.topography is None else FlankTopography.from_csv(find(given.topography)),
    )
    modification.gap(gear, np.array(gear.tip_radius), np.array(0.0))  # refuses a relief that starts off the involute
    return modification


def _relief(
    gear: Gear, given: ModificationSection, kind: str, from_end: Callable[[Gear, float], float]
) -> Relief | None:
    length_mm = getattr(given, f"{kind}_relief_length_mm")
    start_roll_deg = getattr(given, f"{kind}_relief_start_roll_deg")
    if length_mm is not None:
        radius = from_end(gear, 1e-3 * length_mm)
    elif start_roll_deg is not None:
        radius = gear.base_radius * math.hypot(1.0, math.radians(start_roll_deg))
    else:
        return None
    shape = ReliefShape(getattr(given, f"{kind}_relief_shape"))
    return Relief(1e-6 * getattr(given, f"{kind}_relief_um"), radius, shape)
