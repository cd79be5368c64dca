"""The parts of a gearbox as data in SI: bodies, supports, meshes, load cases."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exugear.model.sections.connections import CatalogueSection, StiffnessSection
from fe_ste.flanks.modifications import FlankModification
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats

RPM = math.pi / 30.0
"""One revolution a minute, rad/s."""


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
    pitch: Floats
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


def stiffness_matrix(section: StiffnessSection | None) -> Floats:
    """Stiffness or damping (6, 6) as a section gives it; zeros for none."""
    if section is None:
        return np.zeros((6, 6))
    if section.matrix is not None:
        return np.array(section.matrix, dtype=np.float64)
    radial, tilt = section.radial_N_per_m, section.tilt_N_m_per_rad
    return np.diag([radial, radial, section.axial_N_per_m, tilt, tilt, section.torsion_N_m_per_rad])
