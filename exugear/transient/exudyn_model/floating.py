"""A floating body in a separate Exudyn system, with any forces on its seats.

The modes of a solid (`exugear.system.bodies.solids`) are those of an ``ObjectFFRFreducedOrder`` on a rigid-body node
with Euler parameters. Forces on its seats are an ``ObjectGenericODE2`` on the object's two nodes. In a gearbox such
bodies are `exugear.transient.exudyn_model.bodies`. For shafts it is an alternative to the non-rotating frame
(`exugear.system.bodies.reduction`), whose constant matrices are far faster.

Errors of the object of Exudyn 1.13, and their corrections:

- It softens a spinning body by the centrifugal forces of its deformation without the tension that they cause: torsion
  falls to sqrt(w^2 - Omega^2). The missing stiffness Omega^2 int rho d_phi phi_i . d_phi phi_j, d_phi = x d_y - y d_x,
  is added (`stiffening`). It is valid for a body of revolution that spins about z, and follows the instantaneous speed.
  Forces of angular acceleration are Exudyn's own; the non-rotating frame neglects them (Omega' C q), an error of about
  the angular acceleration over speed times frequency: negligible in a run-up of seconds.
- On Tait-Bryan angles its gyroscopic moments are wrong. It is built on Euler parameters, whose angle is not unwrapped:
  the spin at a seat of a body by itself is the elastic twist alone, in a gearbox the one nearest to the last step's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from exugear.system.bodies.elastic_body import NO_TURN, FloatingBody, euler_rotation, skew
from exugear.system.bodies.reduction import TILT_X, TILT_Y
from exugear.system.kernels.coordinates import SPIN
from exugear.transient.exudyn_model.bodies import Rotation, add_floating_body
from exugear.transient.exudyn_model.library import SolverFailure, exudyn, items, kinematics
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True)
class SeatLaw:
    """Forces on the seats of a body."""

    force: Callable[[float, Floats, Floats], Floats]
    """Function of time, motion and velocity (6 s,) of the seats. Gives forces and moments (6 s,) on them, in axes
    that do not turn."""
    stiffness: Floats
    damping: Floats
    """(6 s, 6 s) about what its derivatives are, for Newton's method."""


def linear_supports(stiffness: Floats, damping: Floats) -> SeatLaw:
    """Springs and dampers between the seats and the ground, (6 s, 6 s); about z they see the elastic twist alone."""
    return SeatLaw(lambda t, motion, velocity: -stiffness @ motion - damping @ velocity, stiffness, damping)


class FloatingSystem:
    """A floating body in an Exudyn system of its own, with forces on its seats.

    Parameters
    ----------
    speed : spin about z at the beginning, rad/s
    velocity : (3,) of the mass centre at the beginning, m/s
    modal_rates : (k,) rates of the modal coordinates at the beginning, m kg^0.5/s
    stiffening : add the centrifugal tension that Exudyn leaves out. False shows what is missing.
    rotation : {"euler_parameters", "tait_bryan"}
        Tait-Bryan angles show what is wrong with them.

    Attributes
    ----------
    mbs : exudyn.MainSystem
        The system, open to everything Exudyn offers.
    """

    def __init__(
        self,
        body: FloatingBody,
        law: SeatLaw,
        speed: float,
        velocity: Floats,
        modal_rates: Floats,
        stiffening: bool = True,
        rotation: Rotation = "euler_parameters",
    ) -> None:
        self.body, self.law, self.stiffening = body, law, stiffening
        self._euler = rotation == "euler_parameters"
        self._container = exudyn.SystemContainer()
        self.mbs = self._container.AddSystem()
        rigid, modal = add_floating_body(self.mbs, body, rotation)
        self._reference = NO_TURN if self._euler else np.zeros(3)
        self._rotation = slice(3, 3 + len(self._reference))
        self._modal = slice(self._rotation.stop, None)
        turning = [0.0, 0.0, 0.0, speed / 2.0] if self._euler else [0.0, 0.0, speed]
        self.mbs.SetNodeParameter(rigid, "initialVelocities", [*np.asarray(velocity).tolist(), *turning])
        self.mbs.SetNodeParameter(modal, "initialCoordinates_t", np.asarray(modal_rates).tolist())
        self._spin_stiffness, self._spin_damping = body.spin_stiffness, body.spin_damping
        self._arms = body.places - body.centre
        by_seat = body.at_seats.reshape(len(body.seats), 2, 3, -1)
        self._moves, self._turns = by_seat[:, 0], by_seat[:, 1]
        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=[rigid, modal], forceUserFunction=self._force, jacobianUserFunction=self._jacobian
            )
        )
        self.mbs.Assemble()
        sizes = {rigid: self._rotation.stop, modal: len(body.frequencies)}
        self._order = np.concatenate(
            [self.mbs.GetNodeODE2Index(node) + np.arange(sizes[node]) for node in (rigid, modal)]
        )

    def _seat_motion(self, q: Floats, v: Floats, turn: Floats, arms: Floats, jacobian: Floats) -> tuple[Floats, Floats]:
        """Motion (6 s,) and velocity of the seats in axes that do not turn, with what `_kinematics` gives.

        Tilts are those of the seat's axis; about z the motion is the elastic twist, the velocity the speed.
        """
        modal = q[self._modal]
        spatial = (jacobian @ v).reshape(-1, 6)
        axes = turn[:, 2] + self._turns @ modal @ turn.T @ skew(turn[:, 2])
        axis_rates = (skew(spatial[:, 3:]) @ axes[..., None])[..., 0]
        motion = np.empty_like(spatial)
        velocity = spatial.copy()
        motion[:, :3] = q[:3] + arms - self._arms
        # A tilt about +x moves the tip of the axis towards -y.
        motion[:, TILT_X], motion[:, TILT_Y] = -axes[:, 1], axes[:, 0]
        motion[:, SPIN] = self._turns[:, 2] @ modal
        velocity[:, TILT_X], velocity[:, TILT_Y] = -axis_rates[:, 1], axis_rates[:, 0]
        return motion.ravel(), velocity.ravel()

    def _kinematics(self, q: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Rotation, its rate matrix, arms of the seats (s, 3), and velocities of the seats per rate (6 s, n)."""
        # The rate matrix leads from the rates of the rotation's parameters to the angular velocity.
        parameters = q[self._rotation] + self._reference
        if self._euler:
            turn, rates = euler_rotation(parameters)
        else:
            turn, rates = kinematics.RotXYZ2RotationMatrix(parameters), kinematics.RotXYZ2G(parameters)
        arms = (self._arms + self._moves @ q[self._modal]) @ turn.T
        jacobian = np.zeros((len(arms), 6, len(q)))
        jacobian[:, :3, :3] = np.eye(3)
        jacobian[:, :3, self._rotation] = -skew(arms) @ rates
        jacobian[:, 3:, self._rotation] = rates
        jacobian[:, :3, self._modal] = turn @ self._moves
        jacobian[:, 3:, self._modal] = turn @ self._turns
        return turn, rates, arms, jacobian.reshape(-1, len(q))

    def _force(self, mbs: Any, t: float, item: int, coordinates: Any, velocities: Any) -> Floats:
        q = np.array(coordinates)
        v = np.array(velocities)
        turn, rates, arms, jacobian = self._kinematics(q)
        force: Floats = self.law.force(t, *self._seat_motion(q, v, turn, arms, jacobian)) @ jacobian
        if self.stiffening:
            speed = self._speed(turn, rates, v)
            modal = self._modal
            force[modal] -= speed**2 * (self._spin_stiffness @ q[modal]) + speed * (self._spin_damping @ v[modal])
        return force

    def _jacobian(
        self, mbs: Any, t: float, item: int, coordinates: Any, velocities: Any, factor_q: float, factor_v: float
    ) -> Floats:
        q = np.array(coordinates)
        v = np.array(velocities)
        turn, rates, _, jacobian = self._kinematics(q)
        matrix: Floats = jacobian.T @ (factor_q * self.law.stiffness + factor_v * self.law.damping) @ jacobian
        if self.stiffening:
            speed = self._speed(turn, rates, v)
            spinning = factor_q * speed**2 * self._spin_stiffness + factor_v * speed * self._spin_damping
            matrix[self._modal, self._modal] += spinning
        return matrix

    def _speed(self, turn: Floats, rates: Floats, v: Floats) -> float:
        """Spin speed about the body's own axis, rad/s."""
        return float(turn[:, 2] @ rates @ v[self._rotation])

    def run(self, steps: int, step: float) -> tuple[Floats, Floats]:
        """Integrate by generalized-alpha; return times (steps + 1,) and motions of the seats (steps + 1, 6 s).

        Raises
        ------
        SolverFailure
            Exudyn gave up.
        """
        settings = exudyn.SimulationSettings()
        integration = settings.timeIntegration
        integration.endTime, integration.numberOfSteps = steps * step, steps
        integration.verboseMode = 0
        integration.generalizedAlpha.spectralRadius = 0.95
        integration.newton.useModifiedNewton = True
        settings.solutionSettings.writeSolutionToFile = False
        settings.displayStatistics = False
        times = []
        motions = []

        def post_step(mbs: Any, t: float) -> bool:
            data = mbs.systemData
            q = np.array(data.GetODE2Coordinates())[self._order]
            v = np.array(data.GetODE2Coordinates_t())[self._order]
            times.append(t)
            turn, _, arms, jacobian = self._kinematics(q)
            motions.append(self._seat_motion(q, v, turn, arms, jacobian)[0])
            return True

        self.mbs.SetPostStepUserFunction(post_step)
        try:
            exudyn.MainSolverImplicitSecondOrder().SolveSystem(self.mbs, settings)
        except exudyn.ExudynError as error:
            raise SolverFailure(f"body {self.body.name}: {str(error).splitlines()[0]}") from None
        return np.array(times), np.array(motions)
