"""Power flow of a gear train with losses: tooth forces and reactions of locked bodies that balance the torques.

Friction of a mesh takes the share mu H_V of the power that enters it, relative to its frame, from the torque of the
driven gear (H. W. Mueller, Epicyclic Drive Trains, 1982: "basic efficiency"). Tooth forces without friction would be
right to first order only: where power circulates, the losses reduce the circulating power itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.train import Train, holding_forces, mesh_row
from fe_ste.tools.arrays import Floats


class SelfLockingError(RuntimeError):
    """Friction of the teeth stops the train in this direction of power."""


@dataclass(frozen=True)
class PowerFlow:
    """Balance of torques with losses at given speeds."""

    mesh_power: Mapping[str, float]
    """Power that enters each mesh relative to its frame, W; at least 0."""
    body_power: Mapping[str, float]
    """Power of the stated torques and of the reactions that each body receives from outside, W; outputs below 0."""

    @property
    def input(self) -> float:
        """Power of all bodies that are driven, W."""
        return sum(max(power, 0.0) for power in self.body_power.values())

    @property
    def output(self) -> float:
        """Power of all bodies that are driving, W."""
        return sum(max(-power, 0.0) for power in self.body_power.values())


def power_flow(
    train: Train,
    torques: Mapping[str, float],
    speeds: Mapping[str, float],
    mesh_losses: Mapping[str, float],
    drags: Mapping[str, float],
) -> PowerFlow:
    """Balance the torques of a train with friction.

    Parameters
    ----------
    torques : stated, by body, N m; locked bodies react them
    speeds : of rigid kinematics, by body, rad/s
    mesh_losses : mu H_V by mesh
    drags : torques of bearings and seals on bodies, N m

    Raises
    ------
    SelfLockingError
        No direction of power through the meshes is in balance.
    """
    relative = np.array([speeds.get(mesh.pinion, 0.0) - speeds.get(mesh.frame, 0.0) for mesh in train.meshes])
    radius = np.array([mesh.pair.pinion.base_radius for mesh in train.meshes])
    remaining = [1.0 - mesh_losses[mesh.name] for mesh in train.meshes]
    applied = np.array([torques.get(body, 0.0) + drags.get(body, 0.0) for body in train.spins])
    locks = np.array([[float(body == lock) for body in train.spins] for lock in train.locked])
    couplings = train.spin_rows[len(train.meshes) :]
    # A train that balances has the right driving gears after a few exchanges; each mesh may change sides twice.
    drives = relative * np.array([*train.static_mesh_forces(torques).values()]) >= 0.0
    for _ in range(2 * len(train.meshes) + 2):
        rows = [
            mesh_row(train.spins, mesh, *((1.0, left) if first else (left, 1.0)))
            for mesh, left, first in zip(train.meshes, remaining, drives, strict=True)
        ]
        forces = holding_forces(np.vstack([*rows, couplings, locks.reshape(-1, len(train.spins))]), applied)
        if forces is None:
            break
        power: Floats = forces[: len(train.meshes)] * radius * relative
        negligible = np.abs(power) <= 1e-9 * np.abs(power).max(initial=0.0)
        now = np.where(negligible, drives, power > 0.0)
        if np.array_equal(now, drives):
            reactions = dict(zip(train.locked, forces[len(train.meshes) + len(couplings) :].tolist(), strict=True))
            return PowerFlow(
                dict(zip((mesh.name for mesh in train.meshes), np.abs(power).tolist(), strict=True)),
                {
                    body: speed * (torques.get(body, 0.0) - reactions.get(body, 0.0))
                    for body, speed in speeds.items()
                    if body in torques or body in reactions
                },
            )
        drives = now
    raise SelfLockingError(
        "the train locks itself, because friction of the teeth exceeds what drives it; drive it from the other side, "
        "with the opposite sign of the torques or of the speed"
    )
