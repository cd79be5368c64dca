"""What joins bodies in an Exudyn system: bearings and mounts, torsional couplings, ideal joints.

Bearings are ``RigidBodySpringDamper``. What acts on a body in a floating frame is left to
`exugear.solvers.exudyn_model.floating_bodies`.
"""

from __future__ import annotations

import numpy as np

from exugear.model.parts import Joint
from exugear.solvers.exudyn_model.library import items
from exugear.solvers.exudyn_model.parts import Parts

FREE_SPIN = [1, 1, 1, 1, 1, 0]
"""Axes that an ideal joint holds: all but the spin."""


def add_supports(parts: Parts) -> None:
    """Add bearings and mounts."""
    assembly = parts.assembly
    elsewhere = () if parts.floating is None else parts.floating.connectors
    for n, bearing in enumerate(assembly.supports):
        if n in elsewhere:
            continue
        place = np.array(bearing.position)
        pin = np.array([*assembly.gearbox.pin_offsets.get(bearing.body, (0.0, 0.0)), 0.0])
        ends = ((bearing.on, place + pin), (bearing.body, place))
        parts.mbs.AddObject(
            items.RigidBodySpringDamper(
                markerNumbers=[parts.support_marker(body, bearing.name, at) for body, at in ends],
                stiffness=assembly.connectors.stiffness[n],
                damping=assembly.connectors.damping[n],
            )
        )


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
    place = np.array(joint.position)
    parts.mbs.AddObject(
        items.GenericJoint(
            markerNumbers=[parts.support_marker(body, joint.name, place) for body in (joint.on, joint.body)],
            constrainedAxes=FREE_SPIN,
        )
    )
