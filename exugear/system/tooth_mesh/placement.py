"""Where teeth in mesh stand: directions, phases, orientation; frames as in `exugear.system.tooth_mesh.element`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Mesh
from exugear.system.kernels.coordinates import BODY_SIZE, TILT
from fe_ste.tools.arrays import Floats

Angle = TypeVar("Angle", float, Floats)
PHASE_TOLERANCE = 5e-3
"""Allowed misfit of a closed chain of meshes, in mesh cycles: file angles and positions are rounded."""


class MeshError(ValueError):
    """A mesh that the element cannot represent."""


@dataclass(frozen=True)
class MeshGeometry:
    """Directions and angles of a mesh at zero angles, from the bodies' positions."""

    radial: Floats
    tangential: Floats
    pressure_angle: float
    pinion_radius: float
    gear_radius: float

    @classmethod
    def of(cls, mesh: Mesh) -> MeshGeometry:
        """Geometry at the operating centre distance of the bodies."""
        pair = mesh.pair
        sign = -1.0 if pair.gear.internal else 1.0
        base_sum = pair.gear.base_radius + sign * pair.pinion.base_radius
        angle = math.acos(base_sum / mesh.centre_distance)
        radial = sign * np.array([math.cos(mesh.position_angle), math.sin(mesh.position_angle), 0.0])
        return cls(
            radial=radial,
            tangential=np.array([-radial[1], radial[0], 0.0]),
            pressure_angle=angle,
            pinion_radius=pair.pinion.base_radius / math.cos(angle),
            gear_radius=pair.gear.base_radius / math.cos(angle),
        )

    def plane_of_action(self, flank: int) -> Floats:
        """Transverse direction (3,), a unit vector, along which a flank of gear 1 pushes."""
        return flank * math.cos(self.pressure_angle) * self.tangential + math.sin(self.pressure_angle) * self.radial

    @property
    def polar_angle(self) -> float:
        """Polar angle of u, rad."""
        return math.atan2(self.radial[1], self.radial[0])


@dataclass(frozen=True)
class ToothContact:
    """How PMC and the orientation of one wheel's teeth hang together in a mesh.

    The orientation is the polar angle of a tooth's middle at zero body angle, in the wheel's own middle
    plane. With eta the tooth's half angle at the working radius, the loaded flank is at +s eta from it, on
    an internal wheel at
    -s eta; in the pitch point it stands at u (gear 1, internal gear 2) or opposite (external gear 2).
    """

    mesh: Mesh
    flank: int
    number: int

    def pmc(self, orientation: Angle) -> Angle:
        """PMC, unwrapped, where a tooth's middle is at this polar angle (rad), seen from the mesh's frame."""
        return (orientation + self._flank_offset - self._pitch_point) / self._pitch

    def orientation(self, pmc: float) -> float:
        """Orientation of the wheel at a given PMC."""
        return pmc * self._pitch - self._flank_offset + self._pitch_point

    @property
    def _wheel_is_internal(self) -> bool:
        return self.number == 2 and self.mesh.pair.gear.internal

    @property
    def _pitch(self) -> float:
        """Angle by which the wheel turns per mesh cycle; an external gear 2 turns against gear 1."""
        pair = self.mesh.pair
        if self.number == 1:
            return self.flank * pair.pinion.angular_pitch
        return (self.flank if pair.gear.internal else -self.flank) * pair.gear.angular_pitch

    @property
    def _flank_offset(self) -> float:
        """Angle from the orientation to the loaded flank at the working radius, in the plane of the mesh."""
        pair = self.mesh.pair
        gear, radius = (
            (pair.pinion, pair.pinion_working_radius) if self.number == 1 else (pair.gear, pair.gear_working_radius)
        )
        side = -self.flank if self._wheel_is_internal else self.flank
        twist = self.mesh.offsets[self.number - 1] * math.tan(gear.helix_angle) / gear.reference_radius
        return side * float(gear.half_angle(radius)) + twist

    @property
    def _pitch_point(self) -> float:
        """Polar angle of the pitch point about the wheel's axis."""
        angle = MeshGeometry.of(self.mesh).polar_angle
        if self.number == 2 and not self._wheel_is_internal:
            return angle + math.pi
        return angle


def loaded_flanks(gearbox: Gearbox, torques: Mapping[str, float] | None = None) -> dict[str, int]:
    """Tell the loaded flank s of each mesh under the static load, or other torques at the same locks.

    Of a mesh that they leave without force, the one by which what it drives is dragged along.
    """
    forces = gearbox.train.static_mesh_forces(torques)
    if not all(forces.values()):
        dragged = gearbox.train.dragging_forces()
        forces = {name: force or dragged.get(name, 0.0) for name, force in forces.items()}
    return {name: -1 if force < 0.0 else 1 for name, force in forces.items()}


def wrench_row(direction: Floats, pitch_point: Floats, nodes: tuple[Floats, Floats]) -> Floats:
    """Row (12,) of a force along `direction` (3,) at the pitch point: plus on gear 1, minus on gear 2."""
    ends = [np.concatenate([direction, np.cross(pitch_point - node, direction)]) for node in nodes]
    return np.concatenate([ends[0], -ends[1]])


def pitch_point_of(mesh: Mesh, geometry: MeshGeometry, nodes: tuple[Floats, Floats]) -> Floats:
    """Place of the pitch point at the middle of the common face, m."""
    first_axis = np.array([nodes[0][0], nodes[0][1], mesh.z])
    return np.asarray(first_axis + geometry.pinion_radius * geometry.radial)


def line_of_action_row(mesh: Mesh, flank: int, nodes: tuple[Floats, Floats]) -> Floats:
    """Row (12,) of the deflection along the line of action about the two bodies' nodes."""
    geometry = MeshGeometry.of(mesh)
    axial = flank * math.tan(mesh.pair.pinion.base_helix_angle) * np.array([0.0, 0.0, 1.0])
    return wrench_row(geometry.plane_of_action(flank) - axial, pitch_point_of(mesh, geometry, nodes), nodes)


def position_rows(mesh: Mesh, flank: int, nodes: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Rows (12,) of the centre distance and of the misalignment of a flank about the two bodies' nodes."""
    geometry = MeshGeometry.of(mesh)
    towards = np.array([math.cos(mesh.position_angle), math.sin(mesh.position_angle), 0.0])
    centre = -wrench_row(towards, pitch_point_of(mesh, geometry, nodes), nodes)
    x, y, _ = geometry.plane_of_action(flank)
    # Gear 1's tilts against gear 2's, turned into the plane of action.
    misalignment = np.zeros(2 * BODY_SIZE)
    misalignment[[TILT, TILT + 1, BODY_SIZE + TILT, BODY_SIZE + TILT + 1]] = y, -x, -y, x
    return centre, misalignment


def mesh_phases(gearbox: Gearbox, flanks: Mapping[str, int]) -> dict[str, float]:
    """Compute the PMC of each mesh at zero angles: see `tooth_places`."""
    return tooth_places(gearbox, flanks)[0]


def tooth_places(gearbox: Gearbox, flanks: Mapping[str, int]) -> tuple[dict[str, float], dict[tuple[str, str], float]]:
    """Place the teeth of all wheels from tooth numbers, planet places and tooth thickness.

    The wheels' tooth orientations follow from one another: a mesh whose loaded flanks touch fixes gear 2
    once gear 1 is placed. A mesh between two wheels not yet placed starts at PMC = 0. Wheels on one shaft
    that belong to different stages are timed independently of each other.

    Returns
    -------
    phases : name of the mesh -> PMC at zero angles
    orientation : body and gear -> polar angle of a tooth's middle at zero body angle, rad

    Raises
    ------
    MeshError
        A closed chain of meshes (sun, planets, ring) does not fit with its loaded flanks in contact.
    """
    orientation: dict[tuple[str, str], float] = {}
    phases: dict[str, float] = {}
    waiting = list(gearbox.meshes)
    while waiting:
        mesh = next((m for m in waiting if any(end in orientation for end in _wheels(m))), waiting[0])
        waiting.remove(mesh)
        phases[mesh.name] = _place_wheels(mesh, flanks[mesh.name], orientation)
    for mesh in gearbox.meshes:
        if mesh.phase is not None:
            phases[mesh.name] = mesh.phase % 1.0
    return phases, orientation


def _wheels(mesh: Mesh) -> tuple[tuple[str, str], tuple[str, str]]:
    return (mesh.pinion, mesh.pair.pinion.name), (mesh.gear, mesh.pair.gear.name)


def _place_wheels(mesh: Mesh, flank: int, orientation: dict[tuple[str, str], float]) -> float:
    """PMC of a mesh from the wheels already placed; places those that are not."""
    wheels = tuple(enumerate(_wheels(mesh), start=1))
    placed = [
        ToothContact(mesh, flank, number).pmc(orientation[wheel]) for number, wheel in wheels if wheel in orientation
    ]
    misfit = math.remainder(placed[0] - placed[1], 1.0) if len(placed) == 2 else 0.0
    if abs(misfit) > PHASE_TOLERANCE:
        raise MeshError(
            f"mesh {mesh.name}: the gears do not fit, loaded flanks miss each other by {misfit:.4f} of a "
            "mesh cycle; check planet angles and tooth thicknesses"
        )
    phase = placed[0] % 1.0 if placed else 0.0
    for number, wheel in wheels:
        if wheel not in orientation:
            orientation[wheel] = ToothContact(mesh, flank, number).orientation(phase)
    return phase
