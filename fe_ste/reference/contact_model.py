"""Elastic bodies in contact as data: what is asked, and the equilibrium that answers it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_ste.reference.finite_deformation import Bricks
from fe_ste.reference.mortar import Surface
from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.tools.display import Displayed


@dataclass(frozen=True)
class TurningHub:
    """Nodes of a rigid hub that turns about an axis along z under a torque."""

    nodes: Integers
    axis: Floats
    """(2,) m."""
    lever: float
    """The unknown is the rotation (positive about +z) times this length, m; negative reverses its sense."""
    force: float
    """Torque over `lever`, N."""


@dataclass(frozen=True)
class ContactModel(Displayed):
    """Elastic bodies, what holds and loads them, and where they may touch."""

    bricks: Bricks
    first: Surface
    second: Surface
    """The nodes of the first one carry the contact pressures."""
    held: Booleans
    """(n, 3) displacements that are zero."""
    forces: Floats
    """(n, 3) nodal forces, N; they do not turn with the bodies."""
    modulus: float
    """A Young's modulus of the bodies, Pa, for scales."""
    search: float
    """Distance up to which facets count as neighbours, m."""
    reach: float
    """Gap at the edge of the contact expected, m: the first guess are the nodes whose gap is smaller. A guess too
    wide would crush the smallest bricks."""
    allowed_overlap: float = 0.0
    """Overlap of the undeformed surfaces that a mesh of chords may have, m."""
    hub: TurningHub | None = None

    def _line(self) -> str:
        facets = f"surfaces of {len(self.first.facets)} and {len(self.second.facets)} facets"
        return f": {len(self.bricks.nodes)} bricks, {len(self.bricks.points)} nodes, {facets}"


@dataclass(frozen=True)
class Iteration:
    """One Newton iteration, a row of the convergence table."""

    load: float
    """Part of the load."""
    number: int
    """Within the load step, from 1."""
    active: int
    """Nodes in contact."""
    changed: int
    """Nodes whose state changed after it."""
    step_length: float
    """Of the line search."""
    force_error: float
    """Largest force out of balance after it, as part of the largest load."""
    gap_error: float
    """Largest mean gap or overlap left where pressure is, as part of the largest displacement."""
    hub: float
    """Displacement of the hub, m."""


@dataclass(frozen=True)
class Equilibrium(Displayed):
    """Bodies in equilibrium."""

    displacement: Floats
    """(n, 3) m."""
    modes: Floats
    """(m, 3, 3) incompatible modes."""
    pressure: Floats
    """(s,) contact pressure at the nodes of the first surface, Pa."""
    contact_force: Floats
    """(n, 3) contact forces on the nodes of both surfaces, N."""
    mean_pressure: Floats
    """(s,) contact force on each of these nodes over its contact area, Pa: without the peaks that `pressure` has
    where an edge of the other surface leaves a node little of its area."""
    weight: Floats
    """(s,) contact area of each node, m^2."""
    facing: Booleans
    """(s,) nodes whose whole area faces the other surface."""
    hub: float
    """Displacement of the hub, m."""
    iterations: tuple[Iteration, ...]

    def _line(self) -> str:
        touching = np.count_nonzero(self.pressure)
        return f": {touching} of {len(self.pressure)} nodes in contact, {len(self.iterations)} iterations"


def convergence_table(iterations: Sequence[Iteration]) -> str:
    """Lay out the iterations of an analysis as text, one a line."""
    head = "load %  iteration  in contact  changed  step  force error  gap error     hub um"
    rows = [
        f"{100 * row.load:6.4g}  {row.number:9d}  {row.active:10d}  {row.changed:7d}  {row.step_length:4.2f}"
        f"  {row.force_error:11.1e}  {row.gap_error:9.1e}  {1e6 * row.hub:9.4f}"
        for row in iterations
    ]
    return "\n".join([head, *rows])
