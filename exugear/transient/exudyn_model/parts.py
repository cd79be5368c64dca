"""What stands in an Exudyn system, by the names of the assembly, and where others are fixed to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from exugear.gearbox.parts import node_position, seat_key
from exugear.system.assembly import Assembly
from exugear.transient.exudyn_model.floating_bodies import FloatingBodies
from exugear.transient.exudyn_model.library import exudyn, items
from fe_ste.tools.arrays import Floats

SPIN_COORDINATE = 5
"""Coordinate of a rigid-body node that is its spin."""


@dataclass
class Parts:
    """Nodes and objects of an Exudyn system."""

    mbs: Any
    """exudyn.MainSystem."""
    assembly: Assembly
    nodes: dict[str, Any] = field(default_factory=dict)
    """Node of each body; of an elastic one that of its main seat, and those of its seats under.
    `exugear.gearbox.parts.seat_key`."""
    bodies: dict[str, Any] = field(default_factory=dict)
    """Object of each rigid body."""
    elastic_nodes: dict[str, list[Any]] = field(default_factory=dict)
    """All nodes of each elastic body: those of its seats, then one for its modal coordinates."""
    seat_positions: dict[str, Floats] = field(default_factory=dict)
    """(3,) of each seat by its key, m."""
    floating: FloatingBodies | None = None
    """Bodies in floating frames, if there are any."""
    _ground: Any = None

    @property
    def all_nodes(self) -> list[Any]:
        """Nodes of all bodies in the order of the assembly's coordinates."""
        rigid = [body.name for body in self.assembly.bodies if body.name not in self.elastic_nodes]
        elastic = [node for nodes in self.elastic_nodes.values() for node in nodes]
        return [self.nodes[name] for name in rigid] + elastic

    def support_marker(self, body: str, item: str, position: Floats) -> Any:
        """Marker of a support at a position (m, at zero angles) on a body, on an elastic one's seat, or the ground."""
        key = seat_key(body, item)
        if key in self.nodes and not (position - self.seat_positions[key]).any():
            return self.mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=self.nodes[key]))
        if key in self.nodes:  # beside the seat's centre: a body without mass is the arm
            arm = items.ObjectRigidBody(physicsMass=0.0, physicsInertia=[0.0] * 6, nodeNumber=self.nodes[key])
            number = self.mbs.AddObject(arm)
            local = position - self.seat_positions[key]
        elif body in self.bodies:
            carrying = next(b for b in self.assembly.bodies if b.name == body)
            number = self.bodies[body]
            local = position - node_position(carrying)
        else:
            number = self._ground_object()
            local = position
        return self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=number, localPosition=np.asarray(local).tolist()))

    def support_spin(self, body: str, item: str) -> Callable[[], float]:
        """Tell how to ask for the spin (rad, unwrapped) of what carries a support: a body, its seat, or the ground."""
        node = self.nodes.get(seat_key(body, item), self.nodes.get(body))
        if node is None:
            return lambda: 0.0
        coordinates = exudyn.OutputVariableType.Coordinates
        return lambda: float(self.mbs.GetNodeOutput(node, coordinates)[SPIN_COORDINATE])

    def _ground_object(self) -> Any:
        if self._ground is None:
            self._ground = self.mbs.AddObject(items.ObjectGround())
        return self._ground

    def spin_marker(self, body: str, seat: str | None = None) -> Any:
        """Marker of a body's spin, of an elastic one at a seat or where torques act."""
        key = seat_key(body, seat or "")
        has_six = self.assembly.coordinates[body][0] >= 0
        node = self.nodes[key if key in self.nodes else body]
        coordinate = SPIN_COORDINATE if has_six else 0
        return self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
