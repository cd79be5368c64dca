"""What joins bodies in an Exudyn system: bearings and mounts, torsional couplings, ideal joints.

Bearings are ``RigidBodySpringDamper``, with a user function where they have a rolling law. What acts on a body in a
floating frame is left to `exugear.transient.exudyn_model.floating_bodies`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from exugear.gearbox.parts import Joint
from exugear.system.bearings.kernels.connectors import ConnectorArrays
from exugear.system.bearings.kernels.rolling import (
    CAGE_TORQUE,
    ELASTIC_PART,
    rolling_force,
    rolling_memory,
)
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from exugear.transient.exudyn_model.library import items
from exugear.transient.exudyn_model.parts import Parts
from fe_ste.tools.arrays import Floats

FREE_SPIN = [1, 1, 1, 1, 1, 0]
"""Axes that an ideal joint holds: all but the spin."""


def add_supports(parts: Parts) -> None:
    """Add bearings and mounts."""
    assembly = parts.assembly
    elsewhere = () if parts.floating is None else parts.floating.connectors
    for n, bearing in enumerate(assembly.supports):
        if n in elsewhere:
            continue
        position = np.array(bearing.position)
        pin = np.array([*assembly.gearbox.pin_offsets.get(bearing.body, (0.0, 0.0)), 0.0])
        ends = ((bearing.on, position + pin), (bearing.body, position))
        rolling = assembly.connectors.rolling
        law = _rolling_law(parts, n) if rolling.first[n] < rolling.first[n + 1] else 0
        parts.mbs.AddObject(
            items.RigidBodySpringDamper(
                markerNumbers=[parts.support_marker(body, bearing.name, at) for body, at in ends],
                stiffness=assembly.connectors.stiffness[n],
                damping=assembly.connectors.damping[n],
                offset=_offset(assembly.connectors, n),
                springForceTorqueUserFunction=law,
            )
        )


def _offset(connectors: ConnectorArrays, n: int) -> Floats:
    """Displacement (6,) at which the linear law of connector n has no load, m and rad.

    It has none where the matrix resists nothing: rows that do not resist do not push either.
    """
    size = np.sqrt(np.abs(np.diag(connectors.stiffness[n])))
    scale = np.divide(1.0, size, out=np.zeros(BODY_SIZE), where=size > 0.0)
    # Forces and moments differ by orders of magnitude: to a unit diagonal before a rank is decided.
    matrix = scale[:, None] * connectors.stiffness[n] * scale
    found = np.linalg.pinv(matrix, rcond=1e-12, hermitian=True) @ (scale * connectors.offset[n])
    return np.asarray(-scale * found)


def _rolling_law(parts: Parts, n: int) -> Callable[..., Floats]:
    """User function of a support whose rolling law acts beside its linear one; it stands in for both."""
    offset = parts.assembly.connectors.offset[n]
    bearing = parts.assembly.supports[n]
    rolling = parts.assembly.connectors.rolling
    first, second = (parts.support_spin(body, bearing.name) for body in (bearing.on, bearing.body))
    forces = rolling_memory(rolling)

    def law(
        mbs: Any,
        t: float,
        item: int,
        displacement: Any,
        rotation: Any,
        velocity: Any,
        angular_velocity: Any,
        stiffness: Any,
        damping: Any,
        *frames: Any,
    ) -> Floats:
        strain = np.array([*displacement, *rotation])
        rate = np.array([*velocity, *angular_velocity])
        rolling_force(n, strain, rate, second() - first(), rolling, forces)
        load: Floats = offset + stiffness @ strain + damping @ rate
        load += forces[ELASTIC_PART : ELASTIC_PART + BODY_SIZE]
        load[SPIN] += forces[CAGE_TORQUE]
        return load

    return law


def add_couplings(parts: Parts) -> None:
    """Add torsional springs between spins."""
    elsewhere = () if parts.floating is None else parts.floating.couplings
    for n, coupling in enumerate(parts.assembly.gearbox.couplings):
        if n in elsewhere:
            continue
        parts.mbs.AddObject(
            items.CoordinateSpringDamper(
                markerNumbers=[parts.spin_marker(body, coupling.seat) for body in (coupling.first, coupling.second)],
                stiffness=coupling.stiffness,
                damping=coupling.damping,
            )
        )


def add_joint(parts: Parts, joint: Joint) -> None:
    """Add an ideal joint, which leaves a body its spin."""
    position = np.array(joint.position)
    parts.mbs.AddObject(
        items.GenericJoint(
            markerNumbers=[parts.support_marker(body, joint.name, position) for body in (joint.on, joint.body)],
            constrainedAxes=FREE_SPIN,
        )
    )
