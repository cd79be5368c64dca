"""Bodies of an assembly in an Exudyn system: rigid ones, those with their spin alone, and elastic ones.

Rigid bodies are ``NodeRigidBodyRxyz`` with z as spin axis, so that the unwrapped angle is a coordinate. An elastic body
has such a node at each seat, one node for its modal coordinates, and its matrices in one ``ObjectGenericODE2`` on all.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from exugear.gearbox.parts import Body, node_position, seat_key
from exugear.system.bodies.reduced_body import ReducedBody
from exugear.system.bodies.turning_frame import TurningBody
from exugear.transient.exudyn_model.floating_bodies import FloatingBodies
from exugear.transient.exudyn_model.library import items
from exugear.transient.exudyn_model.parts import Parts
from fe_ste.tools.arrays import Floats


def add_bodies(parts: Parts, q: Floats, v: Floats) -> None:
    """Add all bodies at coordinates and velocities (size,) of the assembly."""
    assembly = parts.assembly
    for body in assembly.bodies:
        if assembly.has_six(body):
            _add_rigid_body(parts, body, q, v)
        elif body.name not in assembly.elastic_bodies:
            _add_spinning_body(parts, body, q, v)
    if assembly.floating:
        parts.floating = FloatingBodies(parts.mbs, assembly, q, v)
    for name in assembly.elastic_bodies:
        if parts.floating is not None and name in parts.floating.nodes:
            parts.elastic_nodes[name] = parts.floating.nodes[name]
        else:
            _add_elastic_body(parts, name, q, v)


def _add_spinning_body(parts: Parts, body: Body, q: Floats, v: Floats) -> None:
    """Add a body that has its spin alone."""
    i = parts.assembly.spin[body.name]
    parts.nodes[body.name] = parts.mbs.AddNode(
        items.Node1D(referenceCoordinates=[0.0], initialCoordinates=[q[i]], initialVelocities=[v[i]])
    )
    parts.bodies[body.name] = parts.mbs.AddObject(
        items.ObjectMass1D(physicsMass=body.axial, nodeNumber=parts.nodes[body.name])
    )


def _add_rigid_body(parts: Parts, body: Body, q: Floats, v: Floats) -> None:
    first = parts.assembly.coordinates[body.name][0]
    node = _add_rigid_node(parts, node_position(body), first, q, v)
    parts.nodes[body.name] = node
    inertia = [body.transverse, body.transverse, body.axial, 0.0, 0.0, 0.0]
    parts.bodies[body.name] = parts.mbs.AddObject(
        items.ObjectRigidBody(physicsMass=body.mass, physicsInertia=inertia, nodeNumber=node)
    )
    acceleration = parts.assembly.gearbox.case.gravity.acceleration_m_per_s2
    if any(acceleration):
        marker = parts.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=parts.bodies[body.name]))
        parts.mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=list(acceleration)))


def _add_rigid_node(parts: Parts, position: Floats, first: int, q: Floats, v: Floats) -> Any:
    """Add a node with six coordinates, which begin at `first` in the assembly's."""
    return parts.mbs.AddNode(
        items.NodeRigidBodyRxyz(
            referenceCoordinates=[*position.tolist(), 0.0, 0.0, 0.0],
            initialCoordinates=q[first : first + 6].tolist(),
            initialVelocities=v[first : first + 6].tolist(),
        )
    )


def _add_elastic_body(parts: Parts, name: str, q: Floats, v: Floats) -> None:
    """Add an elastic body: a rigid-body node at each seat, one node for the modal coordinates, matrices on all."""
    assembly = parts.assembly
    elastic = assembly.elastic_bodies[name]
    coordinates = assembly.elastic_slices[name]
    reduced = elastic.reduced
    for n, seat in enumerate(reduced.seats):
        key = seat_key(name, seat.name)
        position = np.array(seat.position)
        parts.nodes[key] = _add_rigid_node(parts, position, coordinates.start + 6 * n, q, v)
        parts.seat_positions[key] = position
    nodes = [parts.nodes[seat_key(name, seat.name)] for seat in reduced.seats]
    modal = slice(coordinates.start + 6 * len(reduced.seats), coordinates.stop)
    nodes.append(
        parts.mbs.AddNode(
            items.NodeGenericODE2(
                referenceCoordinates=[0.0] * len(reduced.modal_groups),
                initialCoordinates=q[modal].tolist(),
                initialCoordinates_t=v[modal].tolist(),
                numberOfODE2Coordinates=len(reduced.modal_groups),
            )
        )
    )
    parts.elastic_nodes[name] = nodes
    parts.nodes[name] = parts.nodes[seat_key(name, elastic.main_seat)]
    for item, seat_name in elastic.shared_seats.items():
        key = seat_key(name, item)
        shared = seat_key(name, seat_name)
        parts.nodes[key], parts.seat_positions[key] = parts.nodes[shared], parts.seat_positions[shared]
    if name in assembly.turning:
        _add_turning_laws(parts, assembly.turning[name], nodes)
        return
    parts.mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=nodes,
            massMatrix=reduced.mass,
            stiffnessMatrix=reduced.stiffness,
            dampingMatrix=assembly.gearbox.case.damping.body_time_s * reduced.stiffness,
            forceVector=assembly.weight[coordinates],
            forceUserFunction=_gyroscopic_function(reduced) if reduced.gyroscopic.any() else 0,
        )
    )


def _add_turning_laws(parts: Parts, body: TurningBody, nodes: list[Any]) -> None:
    """Add the laws of a body in its own turning frame; forces without accelerations are on the right-hand side."""

    def mass(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        return body.mass_matrix(np.array(q))

    def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        q = np.array(q)
        v = np.array(v)
        return np.asarray(body.forces(q, v) - body.inertia_forces(q, v, np.zeros_like(q)))

    parts.mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=nodes,
            massMatrix=body.reduced.mass,
            massMatrixUserFunction=mass,
            forceUserFunction=force,
        )
    )


def _gyroscopic_function(body: ReducedBody) -> Callable[..., Floats]:
    """Force - Omega G v of an elastic body that turns."""
    momentum = body.mass @ body.spin / float(body.spin @ body.mass @ body.spin)
    gyroscopic = body.gyroscopic

    def force(mbs: Any, t: float, item: int, q: Any, v: Any) -> Floats:
        rates = np.array(v)
        opposing: Floats = gyroscopic @ rates
        return -float(momentum @ rates) * opposing

    return force
