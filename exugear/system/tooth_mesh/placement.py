"""Tooth positions in mesh: directions, phases, orientation; frames as in `exugear.system.tooth_mesh.element`.

The error of each gear in a mesh is a function of its own angle seen from the mesh's frame, a length on the transverse
line of action by which its loaded flank is set back. A tooth's pitch deviation acts with its share of the contact
lines, which is the first-order effect in a table of the same teeth; run-out acts along the line of action. Both repeat
with the gear, not with the mesh, and cause sidebands at its shaft order.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Mesh, WheelDeviation
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN, TILT
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats, Integers

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
    """Relate PMC and the orientation of a gear's teeth in a mesh.

    The orientation is the polar angle of a tooth's middle at zero body angle, in the gear's own middle plane. With eta
    the tooth's half angle at the working radius, the loaded flank is at +s eta from it, on an internal gear at -s eta;
    in the pitch point it lies at u (gear 1, internal gear 2) or opposite (external gear 2).
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


def loaded_flanks(gearbox: Gearbox) -> dict[str, int]:
    """Return the loaded flank s of each mesh under the static load.

    For a mesh without force, return the flank that drags the driven side along.
    """
    forces = gearbox.train.static_mesh_forces()
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


def friction_rows(mesh: Mesh, flank: int, nodes: tuple[Floats, Floats]) -> Floats:
    """Rows (3, 12) of friction on a flank about the two bodies' nodes, as `friction_over_cycle` lists its parts.

    The force acts across the line of action in the transverse plane. Where teeth touch away from the pitch point it has
    a moment about the gear axes, and away from the middle of the face one about the line of action, in the axes of a
    table, which is turned about for the flank -1.
    """
    geometry = MeshGeometry.of(mesh)
    line_of_action = geometry.plane_of_action(flank)
    force = np.array([-line_of_action[1], line_of_action[0], 0.0])
    turning = np.zeros(2 * BODY_SIZE)
    turning[[SPIN, BODY_SIZE + SPIN]] = 1.0, -1.0
    tilting = np.zeros(2 * BODY_SIZE)
    tilting[[TILT, TILT + 1]] = -flank * line_of_action[:2]
    tilting[[BODY_SIZE + TILT, BODY_SIZE + TILT + 1]] = flank * line_of_action[:2]
    return np.array([wrench_row(force, pitch_point_of(mesh, geometry, nodes), nodes), turning, tilting])


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
            f"mesh {mesh.name}: the gears do not assemble, loaded flanks are off by {misfit:.4f} of a mesh cycle; "
            "check planet angles and tooth thicknesses"
        )
    phase = placed[0] % 1.0 if placed else 0.0
    for number, wheel in wheels:
        if wheel not in orientation:
            orientation[wheel] = ToothContact(mesh, flank, number).orientation(phase)
    return phase


# Errors that return once a revolution: pitch of single teeth and run-out of a wheel, position of a planet's pin

SAMPLES_PER_TOOTH = 32
"""Samples of an error over a pitch: ten harmonics of the mesh, to a per cent."""
_PLANES = 101
"""Planes across the face in which contact is looked for."""


def contact_line_shares(pair: GearPair, pmc: Floats) -> tuple[Integers, Floats]:
    """Part of all contact lines that each tooth pair has.

    Parameters
    ----------
    pmc : (n,) positions in the mesh cycle, 0 to 1

    Returns
    -------
    teeth : (t,) tooth pairs, counted ahead of the one that touches at the pitch point at pmc 0
    shares : (n, t) adds up to one in each position

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> teeth, shares = contact_line_shares(pair, np.array([0.0, 0.5]))
    >>> teeth.tolist(), shares.tolist()
    ([-1, 0], [[0.0, 1.0], [0.5, 0.5]])
    """
    reach = math.ceil(pair.total_contact_ratio / 2.0) + 1
    teeth = np.arange(-reach, reach + 1)
    planes = (np.arange(_PLANES) + 0.5) / _PLANES - 0.5
    across = math.tan(pair.pinion.base_helix_angle) * pair.face_width * planes
    at = pair.path_pitch_point + across + pair.transverse_base_pitch * (pmc[:, None] + teeth)[..., None]
    length = np.mean((at > pair.path_start) & (at < pair.path_end), axis=2)
    carried = length.any(axis=0)
    return teeth[carried], length[:, carried] / length.sum(axis=1, keepdims=True)


def wheel_errors(
    gearbox: Gearbox, mesh: Mesh, flank: int, phase: float, orientation: Mapping[tuple[str, str], float]
) -> tuple[Floats, Floats]:
    """Errors of both wheels of a mesh over a revolution each, (n,) samples from angle zero, m; empty for none.

    Parameters
    ----------
    flank : +1 or -1, the loaded flank of gear 1
    phase : PMC at zero angles
    orientation : mapping of (body, gear) to the polar angle of a tooth's middle at zero body angle
    """
    return (
        _wheel_error(gearbox, (mesh.pinion, mesh.pair.pinion.name), ToothContact(mesh, flank, 1), orientation, phase),
        _wheel_error(gearbox, (mesh.gear, mesh.pair.gear.name), ToothContact(mesh, flank, 2), orientation, phase),
    )


def _wheel_error(
    gearbox: Gearbox,
    wheel: tuple[str, str],
    contact: ToothContact,
    orientation: Mapping[tuple[str, str], float],
    phase: float,
) -> Floats:
    """Error of one gear over its revolution; empty for none."""
    deviation = gearbox.deviations.get(wheel)
    if deviation is None:
        return np.zeros(0)
    # Way of the teeth's axis along the line of action, away from the other wheel.
    x, y, _ = MeshGeometry.of(contact.mesh).plane_of_action(contact.flank)
    away = -1.0 if contact.number == 1 else 1.0
    angle = deviation.eccentricity_angle + _angles(deviation)
    error = np.asarray(away * deviation.eccentricity * (x * np.cos(angle) + y * np.sin(angle)))
    if deviation.pitch.size:
        error = error + _pitch_error(deviation, contact, orientation[wheel], phase)
    return error


def _angles(deviation: WheelDeviation) -> Floats:
    count = deviation.teeth * SAMPLES_PER_TOOTH
    return 2.0 * np.pi * np.arange(count) / count


def _pitch_error(deviation: WheelDeviation, contact: ToothContact, orientation: float, phase: float) -> Floats:
    """Sum of the teeth's deviations, each by its part of the contact lines."""
    teeth = deviation.teeth
    tooth_0 = orientation % (2.0 * math.pi / teeth)  # the first at a positive polar angle
    stated = math.remainder(phase - contact.pmc(orientation), 1.0)  # where the file gives the phase
    error = np.zeros(teeth * SAMPLES_PER_TOOTH)
    for tooth, gap in enumerate(deviation.pitch):
        if gap == 0.0:
            continue
        # Unwrapped position in the mesh cycle of this tooth, zero where it stands at the pitch point.
        pmc = contact.pmc(tooth_0 + 2.0 * math.pi * tooth / teeth + _angles(deviation)) + stated
        pmc = pmc - teeth * np.round(pmc / teeth)
        pairs, shares = contact_line_shares(contact.mesh.pair, pmc % 1.0)
        ahead = np.floor(pmc).astype(np.int64) - pairs[0]
        inside = (ahead >= 0) & (ahead < len(pairs))
        error[inside] += gap * shares[inside, ahead[inside]]
    return error
