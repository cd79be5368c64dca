"""The parts of a gearbox as data in SI units: bodies, supports, meshes, load cases."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from exugear.gearbox.sections.connections import CatalogueSection, ConnectorDampingSection, StiffnessSection
from exugear.gearbox.units import RPM
from fe_ste.flanks import FlankModification
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin, TitledRows, value_range
from fe_ste.tools.drawing import COLOURS, drawable

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Body(ReprMixin, line=" {name!r}: {_kind}, {mass:g} kg, {axial:g} kg m2 about its axis"):
    """A rigid body with its position at zero angles and its mass properties about the centre of mass."""

    name: str
    family: str
    """Name of the body, and name of its section, which the planets of a set share."""
    axis: tuple[float, float]
    """(2,) position x, y of the axis at zero angles, m."""
    centre_of_mass_z: float
    """Axial position of the centre of mass, m."""
    mass: float
    axial: float
    transverse: float
    """Mass (kg) and moments of inertia about and across the axis (kg m2); a spin-only body has the axial one alone."""
    carrier: str | None
    """Carrier of a planet; None while the carrier is fixed, so that its planets rotate about stationary axes."""
    orbit_angle: float
    """Angular position of the planet on the carrier, rad."""
    spin_only: bool
    fixed: bool
    """Whether the body has only rotational inertia and no position, and whether it does not rotate."""
    wheels: Mapping[str, float]
    """By gear name, axial position of the middle of the face width, m."""
    planet_of: str | None = None
    """Carrier of the planet set that the body belongs to, fixed or not."""

    def _table(self) -> TitledRows:
        return f"body {self.name}", {
            "kind": self._kind,
            "axis": _point(self.axis),
            "centre of mass": value_range(self.centre_of_mass_z, "mm", 1e3),
            "mass": value_range(self.mass, "kg"),
            "axial inertia": value_range(self.axial, "kg m2"),
            "transverse inertia": value_range(self.transverse, "kg m2"),
            "gears": ", ".join(f"{gear} at {1e3 * z:g} mm" for gear, z in self.wheels.items()) or "none",
        }

    @property
    def _kind(self) -> str:
        if self.fixed:
            return "fixed"
        if self.carrier is not None:
            return f"planet on {self.carrier}"
        if self.planet_of is not None:
            return f"planet on {self.planet_of}, which is fixed"
        if self.spin_only:
            return "spin only"
        return "turning"


class DampingTimes(NamedTuple):
    """Damping over stiffness of elements without a damper of their own, s."""

    bearing: float
    mesh: float
    coupling: float


@dataclass(frozen=True)
class Joint:
    """Ideal joint between `on` and `body` that permits only rotation about z."""

    name: str
    body: str
    on: str
    """Connected bodies."""
    position: tuple[float, float, float]
    """(3,) position at zero angles, m."""


@dataclass(frozen=True)
class Bearing(ReprMixin):
    """Compliant support: a 6x6 stiffness in the axes of `on`, order x y z rx ry rz."""

    name: str
    family: str
    """Name of the bearing, and name of its section, which the bearings of planets share."""
    body: str
    on: str
    """Supported body, and the body that supports it."""
    position: tuple[float, float, float]
    """(3,) position at zero angles, m."""
    stiffness: StiffnessSection | None
    """Stiffness of the gearbox file; with catalogue data, the minimum stiffness in each direction."""
    catalogue: CatalogueSection | None
    """Dimensions and loads from which the stiffness is computed."""
    damping: ConnectorDampingSection | None
    """Damping of the gearbox file; proportional to the stiffness if None."""
    factor: float
    """Housing stiffness factor, which is not yet multiplied in."""
    carries_outer_ring: bool = False
    """Whether the body carries the outer ring, as planets do; otherwise it carries the inner ring."""
    model: Literal["linear", "iso16281"] = "linear"
    """Linear model, or nonlinear model of the individual rolling elements."""
    cage: Literal["averaged", "turning"] = "averaged"
    """For a nonlinear bearing, whether its rolling elements orbit as the rings rotate."""

    def _line(self) -> str:
        return f" {self.name!r}: {self.body} on {self.on} at {_point(self.position)}, {self._source}"

    def _table(self) -> TitledRows:
        return f"bearing {self.name}", {
            "holds": self.body,
            "on": self.on,
            "position": _point(self.position),
            "stiffness": self._source,
            "damping": "in proportion to the stiffness" if self.damping is None else "given",
            "housing stiffness factor": f"{self.factor:g}",
        }

    @property
    def _source(self) -> str:
        """Source of the stiffness as text."""
        if self.catalogue is None:
            return "specified stiffness"
        if self.stiffness is None:
            return "from catalogue"
        return "from catalogue data and specified stiffness"


@dataclass(frozen=True)
class PointForce:
    """Constant force and moment on a body, in the axes of the gearbox."""

    name: str
    body: str
    position: tuple[float, float, float]
    """(3,) position at zero angles, m."""
    wrench: tuple[float, float, float, float, float]
    """Force along x, y, z (N), moment about x, y (N m)."""


@dataclass(frozen=True)
class VaryingLoad:
    """Force and moment Re(w exp(i n theta)) s^p on a body at its angle theta and the size s of its speed.

    A component A cos(n theta + phi) has w = A exp(i phi). A force of fixed size F that turns with the angle
    n theta + phi has w = F exp(i phi) along x and -i F exp(i phi) along y.
    """

    excitation: str
    """Name of its section."""
    body: str
    order: float
    """Periods n per revolution of the body."""
    position: tuple[float, float, float] | None
    """(3,) place at zero angles, m; None for a torque, which acts where constant torques do."""
    wrench: tuple[complex, ...]
    """(6,) w: force along x, y, z (N s^p), moment about x, y, z (N m s^p), zero to peak."""
    exponent: float = 0.0
    """p, of the speed in rad/s."""
    reaction_on: str | None = None
    """Body on which the opposite load acts at the same place."""
    curve: tuple[tuple[float, float, float], ...] = ()
    """Instead of the power: rows of speed (rad/s), ascending, with factor on w and phase (rad), linear in between."""


@dataclass(frozen=True)
class Coupling:
    """Torsional spring and damper between two rotating bodies."""

    name: str
    first: str
    second: str
    """Connected bodies."""
    seat: str | None
    """Bearing at whose seat the coupling acts on flexible bodies."""
    stiffness: float
    damping: float
    """Torsional stiffness (N m/rad) and damping (N m s/rad)."""


@dataclass(frozen=True)
class Mesh(ReprMixin):
    """A mesh of a gear pair between two bodies."""

    name: str
    family: str
    """Name of the mesh, and name of its section, which the meshes of planets share."""
    pair: GearPair
    pinion: str
    gear: str
    """Bodies that carry gear 1 and gear 2."""
    frame: str
    """Body with which the line of centres rotates, or "ground"."""
    z: float
    """Axial position of the middle of the common face width, m."""
    offsets: tuple[float, float]
    """(2,) axial distance of that middle from the middle of gear 1 and of gear 2, m."""
    position_angle: float
    """Polar angle of the line from gear 1's axis to gear 2's axis at zero angles, rad."""
    centre_distance: float
    """Centre distance from the positions of the bodies, m; it agrees with that of the pair within 20 um."""
    phase: float | None
    """Position in the mesh cycle at zero angles if the file overrides the value from geometry."""

    def _line(self) -> str:
        pinion = self.pair.pinion
        gear = self.pair.gear
        return (
            f" {self.name!r}: {pinion.name} ({pinion.teeth} teeth) on {self.pinion} with "
            f"{gear.name} ({gear.teeth} teeth) on {self.gear}"
        )

    def _table(self) -> TitledRows:
        return f"mesh {self.name}", {
            "pair": self.pair.name,
            "gear 1": f"{self.pair.pinion.name} on {self.pinion}",
            "gear 2": f"{self.pair.gear.name} on {self.gear}",
            "line of centres rotates with": self.frame,
            "middle of the face widths": value_range(self.z, "mm", 1e3),
            "centre distance": value_range(self.centre_distance, "mm", 1e3),
            "position angle": value_range(math.degrees(self.position_angle), "deg"),
        }


@dataclass(frozen=True)
class WheelDeviation(ReprMixin):
    """Deviations of one gear that repeat with each revolution."""

    teeth: int
    pitch: Floats
    """(teeth,) distance by which each loaded flank lies below its nominal position, along the transverse line of
    action, m. Tooth 0 is the first at a positive polar angle at zero body angle; the others follow in the positive
    sense.
    """
    eccentricity: float
    """Distance between the axis of the teeth and the axis of the body, m."""
    eccentricity_angle: float
    """Polar angle of the eccentricity at zero body angle, rad."""

    def _line(self) -> str:
        runout = value_range(2.0 * self.eccentricity, "µm", 1e6)
        return f": {self.teeth} teeth, runout {runout}, pitch {value_range(self.pitch, 'µm', 1e6)}"

    def _table(self) -> TitledRows:
        return "deviations of a gear", {
            "teeth": str(self.teeth),
            "cumulative pitch on the line of action": value_range(self.pitch, "µm", 1e6),
            "runout": value_range(2.0 * self.eccentricity, "µm", 1e6),
            "angle of the eccentricity": value_range(math.degrees(self.eccentricity_angle), "deg"),
        }


@dataclass(frozen=True)
class LoadCase(ReprMixin, line=" {name!r}: {duration:g} s, {_drive}, torques on {torques!n} bodies"):
    """Loads of a run."""

    name: str
    torques: Mapping[str, float]
    """Torques by body name, N m."""
    torque_series: Path | None
    """File of torques over time."""
    duration: float
    """Simulated time, s."""
    start_speed: float
    """Initial speed of the overall input, rad/s."""
    start_speeds: Mapping[str, float]
    """By body name, initial speeds of further bodies in a train of several degrees of freedom, rad/s."""
    driven_body: str | None
    """Body whose speed a machine prescribes."""
    end_speed: float | None
    """Final speed of the driven body, rad/s."""
    drive_stiffness: float | None
    """Torsional stiffness of the spring between the driven body and the machine, N m/rad."""
    description: str

    def _table(self) -> TitledRows:
        rows = {
            "duration": value_range(self.duration, "s"),
            "start speed": value_range(self.start_speed / RPM, "rpm"),
            "drive": self._drive,
            "torque series": "none" if self.torque_series is None else str(self.torque_series),
        }
        torques = {f"torque on {body}": value_range(torque, "N m") for body, torque in self.torques.items()}
        return f"load case {self.name}", rows | torques | {"description": self.description}

    @property
    def _drive(self) -> str:
        if self.driven_body is None or self.end_speed is None:
            return "no drive"
        return f"{self.driven_body} driven to {self.end_speed / RPM:g} rpm"


@dataclass(frozen=True)
class PairSpec(ReprMixin):
    """Input data for the STE table of a pair."""

    name: str
    pair: GearPair
    static_torque: float
    """Static torque on gear 1, N m, positive."""
    table: bool
    """Whether the file requests a table of the pair."""
    flank: int
    """Loaded flank of gear 1 in the static state: +1 if it faces the sense of +z rotation, else -1. Tables are computed
    for flank +1; rotated about the line of centres, a table applies to flank -1, with the ends of the face exchanged.
    """
    modifications: tuple[FlankModification, FlankModification]
    """Modifications of gear 1 and gear 2, in the axes of the gearbox."""
    stiffness: tuple[float, ...] = ()
    """Mesh stiffness of a pair that needs no table, at equal distances over the mesh cycle, N/m; empty for all others.
    """

    def _line(self) -> str:
        pinion = self.pair.pinion
        gear = self.pair.gear
        return (
            f" {self.name!r}: {pinion.teeth} and {gear.teeth} teeth, "
            f"{self.static_torque:g} N m on gear 1, flank {self.flank:+d}"
        )

    def _table(self) -> TitledRows:
        return f"gear pair {self.name} in the gearbox", {
            "gear 1": f"{self.pair.pinion.name}, {self.pair.pinion.teeth} teeth",
            "gear 2": f"{self.pair.gear.name}, {self.pair.gear.teeth} teeth",
            "static torque on gear 1": value_range(self.static_torque, "N m"),
            "loaded flank": f"{self.flank:+d}",
            "table": "wanted" if self.table else "not wanted",
            "specified stiffness": value_range(np.array(self.stiffness), "N/m") if self.stiffness else "none",
        }


def _point(coordinates: tuple[float, ...]) -> str:
    return f"({', '.join(f'{1e3 * value:.6g}' for value in coordinates)}) mm"


def connector_matrix(section: StiffnessSection | ConnectorDampingSection | None) -> Floats:
    """Return the stiffness or damping matrix (6, 6) of a section; zeros without a section."""
    if section is None:
        return np.zeros((6, 6))
    if section.matrix is not None:
        return np.array(section.matrix, dtype=np.float64)
    if isinstance(section, ConnectorDampingSection):
        entries = [section.radial_N_s_per_m, section.axial_N_s_per_m]
        entries += [section.tilt_N_m_s_per_rad, section.torsion_N_m_s_per_rad]
    else:
        entries = [section.radial_N_per_m, section.axial_N_per_m, section.tilt_N_m_per_rad, section.torsion_N_m_per_rad]
    radial, axial, tilt, torsion = entries
    return np.diag([radial, radial, axial, tilt, tilt, torsion])


def seat_key(body: str, item: str) -> str:
    """Name of the seat of a gear or bearing on a flexible body.

    Examples
    --------
    >>> seat_key("lss", "sun")
    'lss.sun'
    """
    return f"{body}.{item}"


def node_position(body: Body) -> Floats:
    """Position of the node of a body at zero angles, which is its centre of mass, m."""
    return np.array([*body.axis, body.centre_of_mass_z])


def draw_side_view(panel: Axes, bodies: Sequence[Body], gears: Mapping[str, Gear], bearings: Sequence[Bearing]) -> None:
    """Draw gears as rectangles, shafts as lines and bearings as crosses, to scale in mm.

    Axes are seen across the plane in which they are farthest apart. Planets of a set have one colour and label.
    """
    axes = np.array([body.axis for body in bodies])
    direction = np.linalg.svd(axes - axes.mean(axis=0))[2][0]
    direction *= np.sign(direction[np.argmax(np.abs(direction))])
    families = list(dict.fromkeys(body.family for body in bodies))
    labelled: set[str] = set()
    for body in bodies:
        colour = COLOURS[families.index(body.family) % len(COLOURS)]
        height = 1e3 * float(direction @ body.axis)
        seats = [1e3 * bearing.position[2] for bearing in bearings if bearing.body == body.name]
        reach = list(seats)
        beside = height
        for name, z in body.wheels.items():
            gear = gears[name]
            half = 500.0 * gear.face_width
            reach += [1e3 * z - half, 1e3 * z + half]
            radii = sorted((1e3 * gear.tip_radius, 500.0 * gear.held_diameter))
            spans = [(-radii[1], radii[1])]
            if gear.internal:
                spans = [(-radii[1], -radii[0]), (radii[0], radii[1])]
                beside = height + radii[0]
            for low, high in spans:
                corners = ([1e3 * z - half, 1e3 * z + half], [height + low] * 2, [height + high] * 2)
                panel.fill_between(*corners, facecolor=colour, edgecolor=colour, alpha=0.35)
        if not reach:
            continue
        if beside == height:
            panel.plot([min(reach), max(reach)], [height] * 2, color=colour)
        panel.plot(seats, [height] * len(seats), color=colour, linestyle="none", marker="x", markersize=7.0)
        if body.family not in labelled:
            labelled.add(body.family)
            label = drawable(body.family)
            panel.annotate(label, (max(reach), beside), (4, 3), textcoords="offset points", color=colour)
    panel.set_aspect("equal", adjustable="datalim")
    panel.set(xlabel="z / mm", ylabel="Across the axes / mm")
