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
    """Nodes of a rigid hub that turns about an axis along z under a torque.

    Attributes
    ----------
    nodes : ndarray
    axis : ndarray (2,)
        m.
    lever : float
        The unknown is the rotation (positive about +z) times this length, m; negative reverses its sense.
    force : float
        Torque over `lever`, N.
    """

    nodes: Integers
    axis: Floats
    lever: float
    force: float


@dataclass(frozen=True)
class ContactModel(Displayed):
    """Elastic bodies, what holds and loads them, and where they may touch.

    Attributes
    ----------
    bricks : Bricks
    first, second : Surface
        The nodes of the first one carry the contact pressures.
    held : ndarray of bool (n, 3)
        Displacements that are zero.
    forces : ndarray (n, 3)
        Nodal forces, N; they do not turn with the bodies.
    hub : TurningHub, optional
    modulus : float
        A Young's modulus of the bodies, Pa, for scales.
    search : float
        Distance up to which facets count as neighbours, m.
    reach : float
        Gap at the edge of the contact expected, m: the first guess are the nodes whose gap is smaller. A guess too wide
        would crush the smallest bricks.
    allowed_overlap : float
        Overlap of the undeformed surfaces that a mesh of chords may have, m.
    """

    bricks: Bricks
    first: Surface
    second: Surface
    held: Booleans
    forces: Floats
    modulus: float
    search: float
    reach: float
    allowed_overlap: float = 0.0
    hub: TurningHub | None = None

    def _line(self) -> str:
        facets = f"surfaces of {len(self.first.facets)} and {len(self.second.facets)} facets"
        return f": {len(self.bricks.nodes)} bricks, {len(self.bricks.points)} nodes, {facets}"


@dataclass(frozen=True)
class Iteration:
    """One Newton iteration, a row of the convergence table.

    Attributes
    ----------
    load : float
        Part of the load.
    number : int
        Within the load step, from 1.
    active : int
        Nodes in contact.
    changed : int
        Nodes whose state changed after it.
    step_length : float
        Of the line search.
    force_error : float
        Largest force out of balance after it, as part of the largest load.
    gap_error : float
        Largest mean gap or overlap left where pressure is, as part of the largest displacement.
    hub : float
        Displacement of the hub, m.
    """

    load: float
    number: int
    active: int
    changed: int
    step_length: float
    force_error: float
    gap_error: float
    hub: float


@dataclass(frozen=True)
class Equilibrium(Displayed):
    """Bodies in equilibrium.

    Attributes
    ----------
    displacement : ndarray (n, 3)
        m.
    modes : ndarray (m, 3, 3)
        Incompatible modes.
    pressure : ndarray (s,)
        Contact pressure at the nodes of the first surface, Pa.
    contact_force : ndarray (n, 3)
        Contact forces on the nodes of both surfaces, N.
    mean_pressure : ndarray (s,)
        Contact force on each of these nodes over its contact area, Pa: without the peaks that `pressure` has where an
        edge of the other surface leaves a node little of its area.
    weight : ndarray (s,)
        Contact area of each node, m^2.
    facing : ndarray of bool (s,)
        Nodes whose whole area faces the other surface.
    hub : float
        Displacement of the hub, m.
    iterations : tuple of Iteration
    """

    displacement: Floats
    modes: Floats
    pressure: Floats
    contact_force: Floats
    mean_pressure: Floats
    weight: Floats
    facing: Booleans
    hub: float
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
