"""Elastic bodies of scikit-fem in Exudyn, by its floating frame of reference.

A solid's free vibrations and static shapes become the modes of an ``ObjectFFRFreducedOrder`` on a rigid-body node with
Euler parameters. Forces on its seats, such as those of bearings and meshes, are one ``ObjectGenericODE2`` on the
object's two nodes. For shafts it is the second way beside the frame that does not turn (`exugear.reduction`), whose
constant matrices run far faster.

What the object of Exudyn 1.13 gets wrong, and what is done about it:

- It softens a spinning body by the centrifugal forces of its deformation without the tension that they make: torsion
  falls to sqrt(w^2 - Omega^2). The missing stiffness Omega^2 int rho d_phi phi_i . d_phi phi_j, d_phi = x d_y - y d_x,
  is added (`stiffening`). It is that of a body of revolution that spins about z and follows the speed from instant to
  instant. Forces of angular acceleration are Exudyn's own; the frame that does not turn leaves them out (Omega' C q),
  which is about the angular acceleration over speed times frequency: nothing in a run-up of seconds.
- On Tait-Bryan angles its gyroscopic moments are wrong. It is built on Euler parameters, whose angle is not unwrapped:
  the spin at a seat is the elastic twist alone.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from exugear.reduction import ReductionError
from exugear.solids import SolidModel, in_each_direction, reduce_matrices
from exugear.system import SolverFailure

Floats: TypeAlias = NDArray[np.float64]
Rotation = Literal["euler_parameters", "tait_bryan"]

# Exudyn's type stubs cover a part of it only, so its modules count as untyped.
exudyn: Any = importlib.import_module("exudyn")
items: Any = importlib.import_module("exudyn.itemInterface")
elements: Any = importlib.import_module("exudyn.FEM")
kinematics: Any = importlib.import_module("exudyn.rigidBodyUtilities")


@dataclass(frozen=True)
class FloatingBody:
    """A solid as modes in its own frame; n nodes, k modes, s seats.

    Attributes
    ----------
    name, seats : what it is, and names of its seats
    places : (s, 3) of the seats, m
    centre : (3,) mass centre, where the frame is, m
    nodes : (n, 3), m
    mass, stiffness : (3 n, 3 n) sparse
    modes : (3 n, k) of unit modal mass, orthogonal to rigid motions
    frequencies : (k,) Hz
    at_seats : (6 s, k) displacement and turns of the seats
    stretching : (k, k) what times the square of the spin speed is the stiffness missing in Exudyn, kg
    """

    name: str
    seats: tuple[str, ...]
    places: Floats
    centre: Floats
    nodes: Floats
    mass: Any
    stiffness: Any
    modes: Floats
    frequencies: Floats
    at_seats: Floats
    stretching: Floats


@dataclass(frozen=True)
class SeatLaw:
    """Forces on the seats of a body.

    Attributes
    ----------
    force : function of time, motion and velocity (6 s,) of the seats
        Gives forces and moments (6 s,) on them, in axes that do not turn.
    stiffness, damping : (6 s, 6 s) about what its derivatives are, for Newton's method
    """

    force: Callable[[float, Floats, Floats], Floats]
    stiffness: Floats
    damping: Floats


def linear_supports(stiffness: Floats, damping: Floats) -> SeatLaw:
    """Springs and dampers between the seats and the ground, (6 s, 6 s); about z they see the elastic twist alone."""
    return SeatLaw(lambda t, motion, velocity: -stiffness @ motion - damping @ velocity, stiffness, damping)


def floating_body(model: SolidModel) -> FloatingBody:
    """Modes of a solid in its own frame: all of its reduction up to `model.limit`.

    Raises
    ------
    ReductionError
        The model has blanks: only masses at points of the mesh take part in a floating frame; mesh them.
    """
    if model.blanks:
        raise ReductionError(
            f"body {model.name}: blank on {next(iter(model.blanks))!r}; a floating frame takes mass at nodes only, "
            "so make the ring a part of the mesh"
        )
    reduced = reduce_matrices(model)
    solid, part = reduced.solid, reduced.part
    values, turned = scipy.linalg.eigh(part.stiffness, part.mass)
    frequencies = np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)
    kept = np.flatnonzero(frequencies[6:] < model.limit) + 6
    modes = part.shapes @ turned[:, kept]
    share = np.asarray(solid.scalar_mass.sum(axis=0)).ravel()
    return FloatingBody(
        name=model.name,
        seats=tuple(seat.name for seat in model.seats),
        places=np.array([seat.centre for seat in model.seats]),
        centre=share @ solid.nodes / share.sum(),
        nodes=solid.nodes,
        mass=solid.mass,
        stiffness=solid.stiffness,
        modes=modes,
        frequencies=frequencies[kept],
        at_seats=turned[: 6 * len(model.seats), kept],
        stretching=modes.T @ (in_each_direction(solid.stretching) @ modes),
    )


class FloatingSystem:
    """A floating body in an Exudyn system of its own, with forces on its seats.

    Parameters
    ----------
    body : FloatingBody
    law : SeatLaw
    speed : float
        Spin about z at the beginning, rad/s.
    velocity : (3,) of the mass centre at the beginning, m/s
    amplitude_rates : (k,) rates of the modes at the beginning, m kg^0.5/s
    stiffening : bool
        Add the centrifugal tension that Exudyn leaves out. False shows what is missing.
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
        amplitude_rates: Floats,
        stiffening: bool = True,
        rotation: Rotation = "euler_parameters",
    ) -> None:
        self.body, self.law, self.stiffening = body, law, stiffening
        self._euler = rotation == "euler_parameters"
        kind = exudyn.NodeType.RotationEulerParameters if self._euler else exudyn.NodeType.RotationRxyz
        self._container = exudyn.SystemContainer()
        self.mbs = self._container.AddSystem()
        made = elements.ObjectFFRFreducedOrderInterface(_interface(body), rigidBodyNodeType=kind)
        numbers = made.AddObjectFFRFreducedOrder(
            self.mbs,
            positionRef=body.centre.tolist(),
            initialVelocity=np.asarray(velocity).tolist(),
            initialAngularVelocity=[0.0, 0.0, speed],
        )
        rigid, modal = numbers["nRigidBody"], numbers["nGenericODE2"]
        self.mbs.SetNodeParameter(modal, "initialCoordinates_t", np.asarray(amplitude_rates).tolist())
        self._reference = np.array([1.0, 0.0, 0.0, 0.0]) if self._euler else np.zeros(3)
        self._arms = body.places - body.centre
        by_seat = body.at_seats.reshape(len(body.seats), 2, 3, -1)
        self._moves, self._turns = by_seat[:, 0], by_seat[:, 1]
        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=[rigid, modal], forceUserFunction=self._force, jacobianUserFunction=self._jacobian
            )
        )
        self.mbs.Assemble()
        firsts = [self.mbs.GetNodeODE2Index(node) for node in (rigid, modal)]
        sizes = [3 + len(self._reference), len(body.frequencies)]
        self._order = np.concatenate([first + np.arange(size) for first, size in zip(firsts, sizes, strict=True)])

    def _frame(self, q: Floats) -> tuple[Floats, Floats]:
        """Rotation matrix, and matrix from rates of the rotation's parameters to angular velocity."""
        parameters = q[3 : 3 + len(self._reference)] + self._reference
        if self._euler:
            return kinematics.EulerParameters2RotationMatrix(parameters), kinematics.EulerParameters2G(parameters)
        return kinematics.RotXYZ2RotationMatrix(parameters), kinematics.RotXYZ2G(parameters)

    def seat_motion(self, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Motion (6 s,) and velocity of the seats in axes that do not turn, from the object's coordinates.

        Tilts are those of the seat's axis; about z the motion is the elastic twist, the velocity the speed.
        """
        turn, _, arms, jacobian = self._kinematics(q)
        amplitudes = q[3 + len(self._reference) :]
        spatial = (jacobian @ v).reshape(-1, 6)
        axes = turn[:, 2] + np.cross(self._turns @ amplitudes @ turn.T, turn[:, 2])
        axis_rates = np.cross(spatial[:, 3:], axes)
        motion, velocity = np.empty_like(spatial), spatial.copy()
        motion[:, :3] = q[:3] + arms - self._arms
        motion[:, 3], motion[:, 4] = -axes[:, 1], axes[:, 0]
        motion[:, 5] = self._turns[:, 2] @ amplitudes
        velocity[:, 3], velocity[:, 4] = -axis_rates[:, 1], axis_rates[:, 0]
        return motion.ravel(), velocity.ravel()

    def _kinematics(self, q: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Rotation, its rate matrix, arms of the seats (s, 3), and velocities of the seats per rate (6 s, n)."""
        turn, rates = self._frame(q)
        first = 3 + len(self._reference)
        arms = (self._arms + self._moves @ q[first:]) @ turn.T
        jacobian = np.zeros((len(arms), 6, len(q)))
        jacobian[:, :3, :3] = np.eye(3)
        jacobian[:, :3, 3:first] = np.cross(rates.T[None], arms[:, None]).transpose(0, 2, 1)
        jacobian[:, 3:, 3:first] = rates
        jacobian[:, :3, first:] = turn @ self._moves
        jacobian[:, 3:, first:] = turn @ self._turns
        return turn, rates, arms, jacobian.reshape(-1, len(q))

    def _force(self, mbs: Any, t: float, item: int, coordinates: Any, velocities: Any) -> Floats:
        q, v = np.array(coordinates), np.array(velocities)
        turn, rates, _, jacobian = self._kinematics(q)
        force: Floats = self.law.force(t, *self.seat_motion(q, v)) @ jacobian
        if self.stiffening:
            first = 3 + len(self._reference)
            force[first:] -= self._speed(turn, rates, v) ** 2 * (self.body.stretching @ q[first:])
        return force

    def _jacobian(
        self, mbs: Any, t: float, item: int, coordinates: Any, velocities: Any, factor_q: float, factor_v: float
    ) -> Floats:
        q, v = np.array(coordinates), np.array(velocities)
        turn, rates, _, jacobian = self._kinematics(q)
        matrix: Floats = jacobian.T @ (factor_q * self.law.stiffness + factor_v * self.law.damping) @ jacobian
        if self.stiffening:
            first = 3 + len(self._reference)
            matrix[first:, first:] += factor_q * self._speed(turn, rates, v) ** 2 * self.body.stretching
        return matrix

    def _speed(self, turn: Floats, rates: Floats, v: Floats) -> float:
        """Spin speed about the body's own axis, rad/s."""
        return float(turn[:, 2] @ rates @ v[3 : 3 + len(self._reference)])

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
        times, motions = [], []

        def after_step(mbs: Any, t: float) -> bool:
            data = mbs.systemData
            q, v = np.array(data.GetODE2Coordinates())[self._order], np.array(data.GetODE2Coordinates_t())[self._order]
            times.append(t)
            motions.append(self.seat_motion(q, v)[0])
            return True

        self.mbs.SetPostStepUserFunction(after_step)
        try:
            exudyn.MainSolverImplicitSecondOrder().SolveSystem(self.mbs, settings)
        except exudyn.ExudynError as error:
            raise SolverFailure(f"body {self.body.name}: {str(error).splitlines()[0]}") from None
        return np.array(times), np.array(motions)


def _interface(body: FloatingBody) -> Any:
    """Exudyn's finite-element interface, filled with a body's nodes, matrices and modes."""
    interface = elements.FEMinterface()
    interface.nodes = {"Position": body.nodes - body.centre}
    interface.massMatrix = body.mass
    interface.stiffnessMatrix = body.stiffness
    interface.modeBasis = {"matrix": body.modes, "type": "NormalModes"}
    return interface
