"""All six components of what supports carry in a run: stored of bearings, derived of ideal joints.

A joint's load is that of the meshes of its body and, of planets on their orbits, what keeps them there. Both follow
from what a run stores, so that runs of the variant `rigid` need not hold moments.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exugear.system.assembly import Assembly
from exugear.system.kernels.coordinates import BODY_SIZE, TILT
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Floats

NEEDED = ("time", "input_speed", "mesh_force", "support_force")
"""Signals of a run that loads of ideal joints are derived from."""


class LoadsUnknownError(ValueError):
    """Loads of supports that what is stored does not tell."""


def support_loads(assembly: Assembly, run: Mapping[str, Floats]) -> Floats:
    """Force and moment of each support on its body, (samples, supports, 6), global axes, N and N m.

    Moments are about the support's seat on its body. Ideal joints have none about z.

    Parameters
    ----------
    assembly : variant of the run
    run : signals of a whole run by name: `support_force` and `support_moment`; of the variant `rigid` those of `NEEDED`

    Raises
    ------
    LoadsUnknownError
        Joints under the law `table`, whose teeth press unevenly along the face by an amount that no file holds.
    """
    force = np.asarray(run["support_force"], dtype=np.float64)
    if not assembly.variant.spins_only:
        return np.concatenate([force, np.asarray(run["support_moment"], dtype=np.float64)], axis=2)
    if LAWS[assembly.mesh_law].needs_axes:
        raise LoadsUnknownError(
            f"moments of ideal joints under the mesh law {assembly.mesh_law}: uneven loads along the face add moments "
            "that the run does not hold; run the variant bushing, which stores them"
        )
    return np.concatenate([force, _joint_moments(assembly, run)], axis=2)


@dataclass(frozen=True)
class _Places:
    """Where bodies of ideal joints are over time."""

    assembly: Assembly
    turned: Floats
    """Angle of the overall input, (samples,), rad."""

    def rotated(self, frame: str | None, vector: Floats) -> Floats:
        """Vector (3,) fixed to a body that turns in its place, in global axes (samples, 3)."""
        gearbox = self.assembly.gearbox
        angle = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0).get(frame or "", 0.0) * self.turned
        cosine = np.cos(angle)
        sine = np.sin(angle)
        x, y, z = vector
        return np.stack([cosine * x - sine * y, sine * x + cosine * y, np.full_like(angle, z)], axis=-1)

    def of(self, name: str, height: float | None = None) -> Floats:
        """Points (samples, 3) on the axis of a body, at a height, m, or at its node."""
        bodies = {body.name: body for body in self.assembly.bodies}
        body = bodies[name]
        centre = np.array(body.axis if body.carrier is None else bodies[body.carrier].axis)
        from_centre = np.append(np.array(body.axis) - centre, body.centre_of_mass_z if height is None else height)
        return np.append(centre, 0.0) + self.rotated(body.carrier, from_centre)


def _joint_moments(assembly: Assembly, run: Mapping[str, Floats]) -> Floats:
    """Moments (samples, joints, 3) of ideal joints about their own places.

    Summed up about the origin of the global axes: a planet hands its load on to the joint of its carrier.
    """
    joints = assembly.gearbox.joints
    force = np.asarray(run["support_force"], dtype=np.float64).swapaxes(0, 1)
    number = {joint.body: n for n, joint in enumerate(joints)}
    speed = np.asarray(run["input_speed"], dtype=np.float64)
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(run["time"])
    places = _Places(assembly, np.append(0.0, np.cumsum(steps)))
    # What a joint takes of its own body: the file's force less what planets hand on; it acts at the node but for the
    # moments of meshes about that.
    own = force.copy()
    moments = np.zeros_like(force)
    for joint in joints:
        if joint.on in number:
            own[number[joint.on]] -= force[number[joint.body]]
    for n, joint in enumerate(joints):
        moments[n] = np.cross(places.of(joint.body), own[n])
    for element, scalar in zip(assembly.elements, np.asarray(run["mesh_force"], dtype=np.float64).T, strict=True):
        rows = element.force.reshape(2, BODY_SIZE)[:, TILT:] / element.line_of_action
        for body, row in zip((element.mesh.pinion, element.mesh.gear), rows, strict=True):
            if body in number:
                moments[number[body]] += scalar[:, None] * places.rotated(element.mesh.frame, row)
    about_origin = moments.copy()
    for n, joint in enumerate(joints):
        host = joint.on
        while host in number:
            about_origin[number[host]] += moments[n]
            host = joints[number[host]].on
    for n, joint in enumerate(joints):
        about_origin[n] -= np.cross(places.of(joint.body, joint.position[2]), force[n])
    about_origin[..., 2] = 0.0
    return about_origin.swapaxes(0, 1)
