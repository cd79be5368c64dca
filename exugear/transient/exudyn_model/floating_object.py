"""Exudyn's object of a floating frame of reference, made from the integrals of a body's modes.

What Exudyn would compute from a mesh (nodes, mass matrix, modes) it is given as integrals, so that rigid rings on seats
count and a run needs no mesh.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from exugear.system.bodies.floating_body import FloatingBody
from exugear.system.bodies.rotations import skew
from exugear.transient.exudyn_model.library import elements, exudyn, items

Rotation = Literal["euler_parameters", "tait_bryan"]


def add_floating_body(mbs: Any, body: FloatingBody, rotation: Rotation = "euler_parameters") -> tuple[Any, Any]:
    """Add a floating body at rest in its place to an Exudyn system; return its rigid and its modal node."""
    euler = rotation == "euler_parameters"
    kind = exudyn.NodeType.RotationEulerParameters if euler else exudyn.NodeType.RotationRxyz
    made = frame_integrals(body, kind).AddObjectFFRFreducedOrder(mbs, positionRef=body.centre.tolist())
    if body.added_mass.any():
        mbs.AddObject(items.ObjectGenericODE2(nodeNumbers=[made["nGenericODE2"]], massMatrix=np.diag(body.added_mass)))
    return made["nRigidBody"], made["nGenericODE2"]


def frame_integrals(body: FloatingBody, kind: Any) -> Any:
    """Fill Exudyn's description of a floating body: what it would compute from a mesh follows from its integrals.

    A skew matrix s(f) with s(f) v = f x v gives s(f)' s(g) = (f . g) 1 - g f' and s(f)' g = g x f.
    """
    second_moments = body.second_moments
    first_moments = body.first_moments
    modes = len(body.stiffness)
    seats = len(body.seats)
    products = np.einsum("aafg,bc->bcfg", second_moments, np.eye(3)) - second_moments.transpose(1, 0, 2, 3)
    turned = np.stack([second_moments[a, b] - second_moments[b, a] for a, b in ((2, 1), (0, 2), (1, 0))])

    interface = elements.ObjectFFRFreducedOrderInterface(rigidBodyNodeType=kind)
    interface.rigidBodyNodeType = kind
    interface.nModes, interface.trigList, interface.postProcessingModes = modes, [], {}
    interface.xRef = (body.places - body.centre).ravel()
    interface.modeBasis = body.at_seats.reshape(seats, 2, 3, -1)[:, 0].reshape(3 * seats, -1)
    interface.massMatrixReduced = np.einsum("aafg->fg", second_moments)[1:, 1:]
    interface.stiffnessMatrixReduced = np.diag(body.stiffness)
    interface.totalMass, interface.inertiaLocal = body.mass, products[:, :, 0, 0]
    interface.chiU = first_moments[:, 0] / body.mass
    interface.chiUtilde = skew(interface.chiU)
    interface.mPhitTPsi = first_moments[:, 1:]
    interface.mPhitTPsiTilde = np.hstack([skew(column) for column in first_moments[:, 1:].T])
    interface.mXRefTildePsi = turned[:, 0, 1:]
    interface.mXRefTildePsiTilde = products[:, :, 0, 1:].transpose(0, 2, 1).reshape(3, -1)
    interface.mPsiTildePsi = turned[:, 1:, 1:].transpose(1, 0, 2).reshape(3 * modes, -1)
    interface.mPsiTildePsiTilde = products[:, :, 1:, 1:].transpose(2, 0, 3, 1).reshape(3 * modes, -1)
    return interface
