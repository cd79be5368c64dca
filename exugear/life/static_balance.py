"""What meshes and bearings carry at rest: the static balance of a variant over torques and angles of the carrier.

For fatigue the balance at rest is enough: what a turbine's torque swings with lies far below the first mode of a
gearbox. Linear laws are solved once an angle and scaled; others on some torques, and forces over torque are linear
between these.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from exugear.dynamics.assembly import Assembly
from exugear.dynamics.statics import locked_equilibrium
from exugear.kernels.meshes import FORCE
from exugear.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Floats

TORQUE_SHARES = (0.1, 0.25, 0.5, 0.75, 1.0)
"""Torques over the largest at which laws that are not linear are solved."""
LONGEST_TURN = 0.02
"""Longest step, rad, in which a train is rolled to an angle."""


@dataclass(frozen=True, eq=False)
class StaticBalance:
    """Forces over torques and angles.

    Attributes
    ----------
    torque, angle : array (t,), (a,)
        On the loaded body, N m, rising and without zero; of the carrier, rad.
    mesh_force, misalignment : array (t, a, meshes)
        F_bt, N, positive on the flank that the static load presses; on tables' flank, rad.
    bearing_load : array (t, a, bearings, 6)
        Force and moment of the shaft on the inner ring in the axes of what the bearing sits on, N and N m.
    bearing_tilt : array (t, a, bearings, 2)
        Of the inner ring against the outer one in the same axes, rad.
    linear : bool
        Whether all that is proportional to torque.
    """

    torque: Floats
    angle: Floats
    mesh_force: Floats
    misalignment: Floats
    bearing_load: Floats
    bearing_tilt: Floats
    linear: bool

    def __repr__(self) -> str:
        """Return one short line."""
        return f"<StaticBalance: {len(self.torque)} torques, {len(self.angle)} angles, linear: {self.linear}>"

    def at(self, values: Floats, torque: Floats) -> Floats:
        """Values (t, ...) of these fields at other torques (n,): (n, ...).

        Values over torque are linear between the torques that were solved, those of the same sign.
        """
        found = np.zeros((len(torque), *values.shape[1:]))
        for sign in (1.0, -1.0):
            wanted = np.sign(torque) == sign
            own = np.sign(self.torque) == sign
            if not own.any():
                own = ~own  # linear laws need one torque, of either sign
            nodes, ratios = self.torque[own], values[own] / self.torque[own].reshape(-1, *(1,) * (values.ndim - 1))
            flat = ratios.reshape(len(nodes), -1)
            inside = np.array([np.interp(torque[wanted], nodes, column) for column in flat.T]).T
            found[wanted] = inside.reshape(-1, *values.shape[1:]) * torque[wanted].reshape(
                -1, *(1,) * (values.ndim - 1)
            )
        return found

    def load_sharing(self, meshes: Sequence[int]) -> float:
        """K_gamma of the meshes of a family: largest over mean force at the largest torque, over all angles."""
        forces = np.abs(self.mesh_force[np.abs(self.torque).argmax()][:, list(meshes)])
        mean = float(forces.mean())
        return float(forces.max()) / mean if mean else 1.0


def rolled_coordinates(assembly: Assembly, body: str, angle: float) -> Floats:
    """Coordinates of a rigid train rolled until a body has turned by an angle (rad), (size,).

    Notes
    -----
    Velocities of rolling are integrated by the classical Runge-Kutta method: planets go round in a circle to 1e-9.
    """
    speeds = assembly.gearbox.train.rolling_speeds(body, 1.0)
    steps = math.ceil(abs(angle) / LONGEST_TURN)
    q = np.zeros(assembly.size)
    for _ in range(steps):
        h = angle / steps
        first = assembly.rolling_velocity(q, speeds)
        second = assembly.rolling_velocity(q + 0.5 * h * first, speeds)
        third = assembly.rolling_velocity(q + 0.5 * h * second, speeds)
        fourth = assembly.rolling_velocity(q + h * third, speeds)
        q = q + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
    return q


def static_balance(
    assembly: Assembly,
    body: str,
    torques: Floats,
    angles: int,
    progress: Callable[[int, int], None] | None = None,
) -> StaticBalance:
    """Solve the static balance of a variant for the range of some torques on a body.

    Parameters
    ----------
    assembly : Assembly
    body : str
    torques : array
        N m; what is solved covers them.
    angles : int
        Angles of the carrier within its turn; without planets one is all.
    progress : callable, optional
        Called with the number of solved states, and of all.

    Raises
    ------
    BalanceError
        A state that is not held.
    """
    linear = is_linear(assembly)
    solved, turns = _torques(torques, linear), _angles(assembly, angles)
    shape, meshes, bearings = (len(solved), len(turns)), len(assembly.elements), len(assembly.supports)
    force, misalignment = np.zeros((2, *shape, meshes))
    load, tilt = np.zeros((*shape, bearings, 6)), np.zeros((*shape, bearings, 2))
    flanks = np.array([element.flank for element in assembly.elements])
    locked = assembly.gearbox.case.static_load.locked
    carrier = _carrier(assembly)
    for a, turn in enumerate(turns):
        about = rolled_coordinates(assembly, carrier, turn) if carrier else np.zeros(assembly.size)
        for t, torque in enumerate(solved):
            q = locked_equilibrium(assembly, {body: float(torque)}, locked, assembly.mean_meshes, about)
            rest = np.zeros_like(q)
            force[t, a] = assembly.mesh_states(q, rest, assembly.mean_meshes)[:, FORCE]
            misalignment[t, a] = flanks * assembly.gear_positions(q)[:, 1]
            if bearings:
                load[t, a], tilt[t, a] = _inner_rings(assembly, q)
            if progress is not None:
                progress(a * len(solved) + t + 1, len(solved) * len(turns))
    return StaticBalance(solved, turns, force, misalignment, load, tilt, linear)


def is_linear(assembly: Assembly) -> bool:
    """Tell whether forces are proportional to torque: linear bearings and teeth, no weight."""
    weight = any(assembly.gearbox.case.gravity.acceleration_m_per_s2)
    return not (assembly.has_rows or weight or LAWS[assembly.mesh_law].loses_contact)


def _torques(torques: Floats, linear: bool) -> Floats:
    high, low = float(np.max(torques, initial=0.0)), float(np.min(torques, initial=0.0))
    if linear:
        return np.array([high if high >= -low else low])
    shares = np.array(TORQUE_SHARES)
    return np.concatenate(
        [(low * shares)[::-1] if low < 0.0 else shares[:0], high * shares if high > 0.0 else shares[:0]]
    )


def _carrier(assembly: Assembly) -> str | None:
    bodies = assembly.gearbox.named_bodies
    carriers = [body.carrier for body in bodies.values() if body.carrier is not None]
    return next((name for name in carriers if not bodies[name].fixed), None)


def _angles(assembly: Assembly, count: int) -> Floats:
    if _carrier(assembly) is None:
        return np.zeros(1)
    return np.asarray(2.0 * math.pi / count * np.arange(count))


def _inner_rings(assembly: Assembly, q: Floats) -> tuple[Floats, Floats]:
    """Load on the inner ring (bearings, 6) and its tilt (bearings, 2) in the axes of what each bearing sits on."""
    loads = assembly.bearing_loads(q, np.zeros_like(q))
    strains = assembly.support_strains(q)
    # The bearing takes its factor of a deflection, the seat the rest; the outer ring moves the other way.
    scales = np.array([one.factor * (-1.0 if one.carries_outer_ring else 1.0) for one in assembly.supports])
    turned = np.empty_like(loads)
    for number, support in enumerate(assembly.supports):
        angle = float(q[assembly.spin[support.on]]) if support.on in assembly.spin else 0.0
        cosine, sine = math.cos(angle), math.sin(angle)
        back = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        turned[number] = np.sign(scales[number]) * np.concatenate([back @ loads[number, :3], back @ loads[number, 3:]])
    return turned, scales[:, None] * strains[:, 3:5]
