"""Equilibrium of elastic bricks in frictionless contact: Newton's method with a primal-dual active set.

Each iteration linearises bricks and contact together. The nodes of the first surface whose pressure, lessened by a
multiple of their mean gap, is positive must close their weighted gaps; the others carry no pressure (M. Hintermueller,
K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865-888). The pressures are exact multipliers: the stiffness added on the
active gaps only makes the matrix positive definite, and the multipliers are iterated until none of it is left.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse

from fe_ste.elimination import FactorisationError, factorise
from fe_ste.reference.finite_deformation import Bricks, BrickTangent, InvertedElementError
from fe_ste.reference.mortar import Surface, WeightedGap, facing_pairs, summed, weighted_gap
from fe_ste.tools.arrays import Booleans, Floats, Integers, SparseMatrix
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.threads import one_dense_thread


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
class CondensedPart:
    """Elastic material adjacent to the bricks, condensed onto some of their nodes, in small strains."""

    nodes: Integers
    """(k,) none of them on the hub."""
    stiffness: Floats
    """(3 k, 3 k) N/m."""
    turns: bool
    """Whether it is held by the hub and turns with it; else it is held in place."""


@dataclass(frozen=True)
class ContactModel(ReprMixin):
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
    condensed: tuple[CondensedPart, ...] = ()
    clearance: Floats | None = None
    """(s,) gap at the nodes of the first surface in addition to the gap between the meshes, m: removed material."""

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
class Equilibrium(ReprMixin):
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
    head = "load %  iteration  in contact  changed  step  force error  gap error     hub µm"
    rows = [
        f"{100 * row.load:6.4g}  {row.number:9d}  {row.active:10d}  {row.changed:7d}  {row.step_length:4.2f}"
        f"  {row.force_error:11.1e}  {row.gap_error:9.1e}  {1e6 * row.hub:9.4f}"
        for row in iterations
    ]
    return "\n".join([head, *rows])


#: Stiffness added on active gaps, in Young's moduli times the node's width: the more, the fewer solves a step takes.
_AUGMENTATION = 1000.0
_MOST_AUGMENTATIONS = 25

#: Pressures still to be added when a Newton step is taken, as part of the largest and of the tolerances.
_PRESSURE_LEFT = 0.01

#: Nodes that face the other surface with less than this part of their area carry no pressure: to close their gap, the
#: sliver would be crushed.
_LEAST_FACING = 1e-2

#: Nodes that face it with more than this part do so with their whole area: the rest is the surface's curvature.
_WHOLLY_FACING = 0.95
_LEAST_STEP_LENGTH = 1.0 / 16.0
_LEAST_LOAD_STEP = 1.0 / 64.0


class EquilibriumError(RuntimeError):
    """No equilibrium was found; the message says at which load step and iteration."""


@dataclass(frozen=True)
class NewtonSettings:
    """How equilibrium is searched."""

    load_steps: int = 1
    """Equal steps in which the load is applied; a step that fails is halved."""
    most_iterations: int = 30
    """Newton iterations of a step."""
    force_tolerance: float = 1e-8
    """Largest force out of balance, as part of the largest load."""
    gap_tolerance: float = 1e-8
    """Largest mean gap or overlap left where pressure is, as part of the largest displacement."""

    def __post_init__(self) -> None:
        """Refuse what cannot converge."""
        if self.load_steps < 1 or self.most_iterations < 2:
            raise ValueError("load_steps must be at least 1 and most_iterations at least 2")
        if not (self.force_tolerance > 0 and self.gap_tolerance > 0):
            raise ValueError("the tolerances must be positive")


@dataclass(frozen=True)
class _EquilibriumState:
    displacement: Floats
    modes: Floats
    pressure: Floats
    hub: float


@dataclass(frozen=True)
class _Evaluation:
    """A state with its forces, tangents and gaps."""

    state: _EquilibriumState
    bricks_force: Floats
    """(n, 3) internal forces of the bricks."""
    recovery: Floats
    """As in `fe_ste.reference.finite_deformation.BrickTangent`."""
    blocks: Floats
    """Stiffness of bricks and condensed parts by pair of nodes, see `_Numbering`."""
    contact: WeightedGap
    mean_gap: Floats
    imbalance: Floats


@dataclass
class _Numbering:
    """Places of the bricks' node pairs in the matrix, and which unknowns are free; the hub is the last unknown."""

    model: ContactModel
    free: Integers = field(init=False)
    count: int = field(init=False)
    condensed: SparseMatrix = field(init=False)
    """Stiffness of the condensed parts, (3 n, 3 n)."""
    _pair_of_block: Integers = field(init=False)
    _pair_of_part: Integers = field(init=False)
    _pairs: tuple[Integers, Integers] = field(init=False)
    _starts: Integers = field(init=False)
    _columns: Integers = field(init=False)
    _source: Integers = field(init=False)

    def __post_init__(self) -> None:
        """Sort out which displacements are unknown, and where the entries of bricks and condensed parts go."""
        nodes = self.model.bricks.nodes
        hub = self.model.hub
        size = len(self.model.bricks.points)
        bound = self.model.held.copy()
        on_hub = np.zeros(size, dtype=np.bool_)
        if hub is not None:
            bound[hub.nodes] = True
            on_hub[hub.nodes] = True
        self.free = np.flatnonzero(~bound.ravel())
        self.count = len(self.free)
        # One number per pair of nodes that share a brick or a condensed part: the entries are then summed without a
        # sort at each iteration, since the pattern of the matrix stays.
        parts = self.model.condensed
        of_bricks = (nodes[:, :, None] * size + nodes[:, None, :]).ravel()
        of_parts = [(part.nodes[:, None] * size + part.nodes).ravel() for part in parts]
        pairs, number = np.unique(np.concatenate([of_bricks, *of_parts]), return_inverse=True)
        self._pair_of_block, self._pair_of_part = np.split(number, [len(of_bricks)])
        self._pairs = pairs % size, np.searchsorted(pairs // size, np.arange(size + 1))
        self.condensed = self._whole(self._parts(np.zeros((len(pairs), 3, 3)))).tocsr()
        self.condensed.eliminate_zeros()
        # Where each entry of the matrix of the unknowns comes from: a matrix of the numbers of the entries, from 1.
        entries = 9 * len(pairs)
        numbers = np.arange(1.0, entries + 1.0, dtype=np.float64).reshape(-1, 3, 3)
        entry: SparseMatrix = self._whole(numbers).tocsr()[self.free][:, self.free]
        if hub is not None:
            touched = np.zeros((size, 3), dtype=np.bool_)
            touched[nodes[on_hub[nodes].any(axis=1)]] = True
            for part in parts:
                touched[part.nodes] |= part.turns
            rows = np.flatnonzero(touched.ravel()[self.free])
            value = 1.0 + entries + self.free[rows]
            column = scipy.sparse.csr_matrix((value, (rows, np.zeros_like(rows))), shape=(self.count, 1))
            corner = scipy.sparse.csr_matrix([[1.0 + entries + 3 * size]])
            entry = scipy.sparse.bmat([[entry, column], [column.T, corner]], format="csr")
        self._source = entry.data.astype(np.int64) - 1
        self._columns = entry.indices
        self._starts = entry.indptr

    def _whole(self, blocks: Floats) -> SparseMatrix:
        columns, starts = self._pairs
        size = 3 * len(self.model.bricks.points)
        return scipy.sparse.bsr_matrix((blocks, columns, starts), shape=(size, size))

    def _parts(self, blocks: Floats) -> Floats:
        """Add the stiffness of the condensed parts to blocks by pair of nodes, which are returned."""
        first = 0
        for part in self.model.condensed:
            count = len(part.nodes)
            entries = part.stiffness.reshape(count, 3, count, 3).transpose(0, 2, 1, 3).reshape(-1, 3, 3)
            blocks[self._pair_of_part[first : first + count**2]] += entries
            first += count**2
        return blocks

    def blocks(self, tangent: BrickTangent) -> Floats:
        """Stiffness (p, 3, 3) of bricks and condensed parts by pair of nodes."""
        by_node = tangent.stiffness.reshape(-1, 8, 3, 8, 3)
        blocks = np.empty((len(self._pairs[0]), 3, 3))
        for a in range(3):
            for b in range(3):
                blocks[:, a, b] = summed(self._pair_of_block, by_node[:, :, a, :, b], len(blocks))
        return self._parts(blocks)

    def matrix(self, blocks: Floats, motion: Floats, carried: Floats, curvature: float) -> SparseMatrix:
        """Tangent matrix of the free unknowns, and of the hub where there is one.

        ``motion`` (n, 3) are the displacements of the hub's nodes per unit of the hub's, ``carried`` (n, 3) those of
        condensed parts that turn with it as rigid bodies, ``curvature`` its geometric stiffness.
        """
        # The hub's nodes move by motion times one unknown: its column is K motion, its diagonal motion' K motion and
        # the geometric stiffness of forces whose arms turn. A condensed part takes displacements less the rigid turn.
        by_parts = self.condensed @ carried.ravel()
        coupling = self._whole(blocks) @ motion.ravel() - by_parts
        own = float(motion.ravel() @ coupling + carried.ravel() @ by_parts)
        values = np.concatenate([blocks.ravel(), coupling, [own + curvature]])
        size = len(self._starts) - 1
        return scipy.sparse.csr_matrix((values[self._source], self._columns, self._starts), shape=(size, size))

    def reduced(self, forces: Floats, motion: Floats) -> Floats:
        """Gather the forces on the unknowns from nodal forces (n, 3)."""
        free = forces.ravel()[self.free]
        if self.model.hub is None:
            return free
        return np.append(free, float(np.sum(motion * forces)))


@dataclass
class _EquilibriumSearch:
    """The search of one equilibrium."""

    model: ContactModel
    settings: NewtonSettings
    report: Callable[[Iteration], None] | None

    def __post_init__(self) -> None:
        """Find what stays the same: numbering, areas, and in small displacements the contact geometry."""
        points = self.model.bricks.points
        self.numbering = _Numbering(self.model)
        self.area = self.model.first.areas(points)
        self.pairs = facing_pairs(points, self.model.first, self.model.second, self.model.search)
        self.at_rest = self._gap(points)
        self.history: list[Iteration] = []
        hub = self.model.hub
        self.largest_load = max(float(np.abs(self.model.forces).max()), abs(hub.force) if hub else 0.0)
        if not self.largest_load > 0.0:
            raise EquilibriumError("load step 1: there is no load")
        gap = self._facing_gap(self.at_rest)
        deepest = int(np.argmin(gap))
        if gap[deepest] < -self.model.allowed_overlap:
            point = self.model.bricks.points[self.model.first.nodes[deepest]]
            coordinates = ", ".join(f"{1e3 * value:.3f}" for value in point)
            raise EquilibriumError(
                f"the surfaces overlap by {-1e6 * gap[deepest]:.3g} µm at the start, near ({coordinates}) mm; "
                f"at most {1e6 * self.model.allowed_overlap:.3g} µm is allowed"
            )
        if not np.isfinite(gap).any():
            raise EquilibriumError("no facets of the two surfaces face each other: nothing can touch")

    def _gap(self, points: Floats) -> WeightedGap:
        contact = weighted_gap(points, self.model.first, self.model.second, self.pairs)
        if self.model.clearance is None:
            return contact
        return replace(contact, gap=contact.gap + self.model.clearance * contact.weight)

    def _facing_gap(self, contact: WeightedGap) -> Floats:
        return np.where(contact.weight > _LEAST_FACING * self.area, contact.mean, np.inf)

    def hub_motion(self, hub_displacement: float) -> tuple[Floats, Floats, Floats]:
        """Displacement of the hub's nodes, and its first and second derivative by the hub's displacement, (n, 3)."""
        if self.model.hub is None:
            return (np.zeros_like(self.model.bricks.points),) * 3
        return self._turned(self.model.hub.nodes, self.model.hub, hub_displacement)

    def carried_motion(self, hub_displacement: float) -> tuple[Floats, Floats, Floats]:
        """Do as `hub_motion` for the nodes of condensed parts that turn with the hub, as rigid bodies."""
        carried = [part.nodes for part in self.model.condensed if part.turns]
        if self.model.hub is None or not carried:
            return (np.zeros_like(self.model.bricks.points),) * 3
        return self._turned(np.concatenate(carried), self.model.hub, hub_displacement)

    def _turned(self, nodes: Integers, hub: TurningHub, hub_displacement: float) -> tuple[Floats, Floats, Floats]:
        points = self.model.bricks.points
        displacement = np.zeros_like(points)
        slope = np.zeros_like(points)
        curvature = np.zeros_like(points)
        x, y = (points[nodes, :2] - hub.axis).T
        angle = hub_displacement / hub.lever
        if not self.model.bricks.finite:
            slope[nodes, :2] = np.stack([-y, x], axis=1) / hub.lever
            return slope * hub_displacement, slope, curvature
        # A finite rotation: nodes move on circles, and the second derivative points to the axis.
        cosine = math.cos(angle)
        sine = math.sin(angle)
        turned = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)
        displacement[nodes, :2] = turned - np.stack([x, y], axis=1)
        slope[nodes, :2] = np.stack([-turned[:, 1], turned[:, 0]], axis=1) / hub.lever
        curvature[nodes, :2] = -turned / hub.lever**2
        return displacement, slope, curvature

    def _moved(
        self, state: _EquilibriumState, step: Floats, recovery: Floats, length: float, pressure: Floats
    ) -> _EquilibriumState:
        """State after `length` times a step of the unknowns."""
        hub = state.hub
        displacement = state.displacement.copy()
        displacement.ravel()[self.numbering.free] += length * step[: self.numbering.count]
        full_step = np.zeros_like(displacement)
        full_step.ravel()[self.numbering.free] = step[: self.numbering.count]
        if self.model.hub is not None:
            full_step += step[-1] * self.hub_motion(hub)[1]
            hub += length * float(step[-1])
            nodes = self.model.hub.nodes
            displacement[nodes] = self.hub_motion(hub)[0][nodes]
        return _EquilibriumState(
            displacement=displacement,
            modes=self.model.bricks.stepped_modes(state.modes, recovery, full_step, length),
            pressure=state.pressure + length * (pressure - state.pressure),
            hub=hub,
        )

    def evaluate(self, state: _EquilibriumState, load: float) -> _Evaluation:
        """Compute forces, tangents and gaps of a state under a part of the load."""
        model = self.model
        tangent = model.bricks.evaluate(state.displacement, state.modes)
        # In small displacements the contact geometry is that of the undeformed surfaces, and the gap linear.
        if model.bricks.finite:
            contact = self._gap(model.bricks.points + state.displacement)
        else:
            opened = self.at_rest.gap + self.at_rest.gradient @ state.displacement.ravel()
            contact = replace(self.at_rest, gap=opened)
        # External and contact forces less the internal ones: zero in equilibrium.
        by_parts = self.condensed_force(state)
        imbalance = load * model.forces - tangent.force - by_parts + self.contact_force(contact, state.pressure)
        _, motion, _ = self.hub_motion(state.hub)
        reduced = self.numbering.reduced(imbalance, motion)
        if model.hub is not None:
            _, carried, _ = self.carried_motion(state.hub)
            reduced[-1] += load * model.hub.force + float(np.sum(carried * by_parts))
        return _Evaluation(
            state=state,
            bricks_force=tangent.force,
            recovery=tangent.recovery,
            blocks=self.numbering.blocks(tangent),
            contact=contact,
            mean_gap=self._facing_gap(contact),
            imbalance=reduced,
        )

    def condensed_force(self, state: _EquilibriumState) -> Floats:
        """Return the internal nodal forces (n, 3) of the condensed parts."""
        own = state.displacement - self.carried_motion(state.hub)[0]
        return np.asarray((self.numbering.condensed @ own.ravel()).reshape(-1, 3))

    def contact_force(self, contact: WeightedGap, pressure: Floats) -> Floats:
        """Nodal forces (n, 3) of contact pressures."""
        return np.asarray((contact.gradient.T @ pressure).reshape(-1, 3))

    def solve(self) -> Equilibrium:
        """Apply the load in steps."""
        bricks = self.model.bricks
        state = _EquilibriumState(np.zeros_like(bricks.points), bricks.modes_at_rest(), np.zeros(len(self.area)), 0.0)
        active = self._first_guess(1.0)
        reached = 0.0
        step = 1.0 / self.settings.load_steps
        number = 1
        while reached < 1.0 - 1e-12:
            load = min(reached + step, 1.0)
            try:
                state, active = self._solve_step(state, active, load, number)
            except EquilibriumError as error:
                # A smaller part of the load from the last equilibrium on, with the contact found there.
                step /= 2.0
                if step < _LEAST_LOAD_STEP:
                    raise EquilibriumError(f"{error}; {100 * reached:.3g} % of the load was reached") from error
                if reached == 0.0:
                    active = self._first_guess(step)
                continue
            reached = load
            number = number + 1
        contact = self.evaluate(state, 1.0).contact
        force = self.contact_force(contact, state.pressure)
        on_node = np.linalg.norm(force[self.model.first.nodes], axis=1)
        return Equilibrium(
            displacement=state.displacement,
            modes=state.modes,
            pressure=state.pressure,
            contact_force=force,
            mean_pressure=on_node / np.maximum(contact.weight, _LEAST_FACING * self.area),
            weight=contact.weight,
            facing=contact.weight > _WHOLLY_FACING * self.area,
            hub=state.hub,
            iterations=tuple(self.history),
        )

    def _first_guess(self, load: float) -> Booleans:
        """Nodes that may be in contact under a first part of the load."""
        gap = self._facing_gap(self.at_rest)
        return np.asarray(gap <= max(float(gap.min()), 0.0) + load * self.model.reach)

    def _solve_step(
        self, state: _EquilibriumState, active: Booleans, load: float, number: int
    ) -> tuple[_EquilibriumState, Booleans]:
        """Newton iterations of one load step."""
        load_step = f"load step {number} ({100 * load:.4g} % of the load)"
        try:
            current = self.evaluate(state, load)
        except InvertedElementError as error:
            raise EquilibriumError(f"{load_step}, iteration 0: {error}") from error
        for iteration in range(1, self.settings.most_iterations + 1):
            where = f"{load_step}, iteration {iteration}"
            try:
                step, pressure = self._newton_step(current, active)
            except FactorisationError as error:
                raise EquilibriumError(
                    f"{where}: a rigid-body motion is left free, or contact is lost: {error}"
                ) from error
            current, length = self._line_search(current, active, step, pressure, load, where)
            tested = self._tested_active(current, active)
            changed = int(np.sum(tested != active))
            largest = float(np.abs(current.state.displacement).max())
            gap = float(np.abs(current.mean_gap[active]).max(initial=0.0))
            force = float(np.abs(current.imbalance).max()) / (load * self.largest_load)
            row = Iteration(
                load, iteration, int(active.sum()), changed, length, force, gap / largest, current.state.hub
            )
            self.history.append(row)
            if self.report is not None:
                self.report(row)
            settled = row.force_error < self.settings.force_tolerance and row.gap_error < self.settings.gap_tolerance
            if changed == 0 and settled:
                return current.state, active
            active = tested
        raise EquilibriumError(
            f"{where}: not converged, force error {row.force_error:.1e}, gap error {row.gap_error:.1e}, "
            f"{row.changed} nodes still change"
        )

    def _tested_active(self, now: _Evaluation, active: Booleans) -> Booleans:
        """Nodes that pressure and gap ask to be in contact."""
        # Complementarity function of Hintermueller, Ito and Kunisch: p - c g > 0, c a modulus over the node's width so
        # that both terms are pressures of like size.
        width = np.sqrt(self.area)
        test = now.state.pressure - self.model.modulus * now.mean_gap / width
        tolerance = 1e-9 * float(np.abs(now.state.pressure).max())
        # A node that is neither pressed nor open to rounding keeps its state, or it would change for ever.
        tested = np.where(np.abs(test) <= tolerance, active, test > 0.0)
        if not tested.any():
            tested = now.mean_gap <= now.mean_gap.min() + self.model.reach
        return np.asarray(tested & np.isfinite(now.mean_gap))

    def _newton_step(self, now: _Evaluation, active: Booleans) -> tuple[Floats, Floats]:
        """Step of the unknowns and the pressures after it, from the linearised equilibrium with the gaps closed."""
        _, motion, curvature = self.hub_motion(now.state.hub)
        _, carried, bending = self.carried_motion(now.state.hub)
        # What the hub's nodes are held by does work on the curvature of their paths; so do the condensed parts.
        held_force = self.contact_force(now.contact, now.state.pressure) - now.bricks_force
        geometric = -float(np.sum(curvature * held_force) + np.sum(bending * self.condensed_force(now.state)))
        stiffness = self.numbering.matrix(now.blocks, motion, carried, geometric)
        numbers = np.flatnonzero(active)
        gradient = now.contact.gradient[numbers]
        weight = now.contact.weight[numbers]
        rows = gradient[:, self.numbering.free]
        if self.model.hub is not None:
            rows = scipy.sparse.hstack([rows, scipy.sparse.csr_matrix((gradient @ motion.ravel())[:, None])], "csr")
        # Augmented Lagrangian on the linearised problem: penalties make the indefinite saddle point system positive
        # definite; the multipliers are then iterated with the same factor (Uzawa) until the gaps are closed exactly.
        added = _AUGMENTATION * self.model.modulus * np.sqrt(self.area[numbers]) / weight**2
        stiffness = (stiffness + rows.T @ scipy.sparse.diags_array(added) @ rows).tocsr()
        balance = now.imbalance - self.numbering.reduced(self.contact_force(now.contact, now.state.pressure), motion)
        pressure = np.where(active, now.state.pressure, 0.0)[numbers]
        gap = now.contact.gap[numbers]
        with factorise(stiffness) as factor:
            step = factor.solve(balance + rows.T @ (pressure - added * gap))
            # Conjugate gradients on the pressures; what the penalties would add is the preconditioner.
            overlap = -(gap + rows @ step)
            change = added * overlap
            direction = change
            left = _PRESSURE_LEFT * min(self.settings.gap_tolerance, self.settings.force_tolerance)
            for _ in range(_MOST_AUGMENTATIONS):
                if np.abs(change).max() <= left * np.abs(pressure).max():
                    break
                moved = factor.solve(rows.T @ direction)
                closed = rows @ moved
                before = float(overlap @ change)
                length = before / float(direction @ closed)
                step += length * moved
                pressure = pressure + length * direction
                overlap -= length * closed
                change = added * overlap
                direction = change + float(overlap @ change) / before * direction
        result = np.zeros(len(self.area))
        result[numbers] = pressure
        return step, result

    def _line_search(
        self, now: _Evaluation, active: Booleans, step: Floats, pressure: Floats, load: float, at: str
    ) -> tuple[_Evaluation, float]:
        """Shorten the step until it lessens what is out of balance, on the gaps taken as closed."""
        # Newton's step descends on the norm of what it linearises: halving finds a length that does, if there is one.
        before = self._merit(now, active)
        length = 1.0
        reason = ""
        rounding = 0.1 * self.settings.force_tolerance * load * self.largest_load
        while length >= _LEAST_STEP_LENGTH:
            try:
                trial = self.evaluate(self._moved(now.state, step, now.recovery, length, pressure), load)
            except InvertedElementError as error:
                reason = str(error)
            else:
                merit = self._merit(trial, active)
                if merit < max(before, rounding):
                    return trial, length
                reason = "no step length lessens the forces out of balance"
            length /= 2.0
        raise EquilibriumError(f"{at}: {reason}; the load may be too large")

    def _merit(self, now: _Evaluation, active: Booleans) -> float:
        """Norm of what the linearised equations on the nodes taken as `active` are to remove, N."""
        # Gaps and stray pressures as forces, so that one number compares them.
        gaps = self.model.modulus * np.sqrt(self.area[active]) * now.mean_gap[active]
        pulls = (now.contact.weight * now.state.pressure)[~active]
        return float(np.sqrt(np.sum(now.imbalance**2) + np.sum(gaps**2) + np.sum(pulls**2)))


def solve_contact(
    model: ContactModel, settings: NewtonSettings | None = None, report: Callable[[Iteration], None] | None = None
) -> Equilibrium:
    """Find the equilibrium of elastic bodies in contact.

    Parameters
    ----------
    report : called after each iteration

    Raises
    ------
    EquilibriumError
        If the surfaces overlap at the start or cannot touch, a rigid-body motion is left free, or Newton's method fails
        in spite of halved load steps; the message names load step and iteration.
    """
    with one_dense_thread():
        return _EquilibriumSearch(model, settings or NewtonSettings(), report).solve()


def fixed_body_displacement(model: ContactModel) -> tuple[Floats, Floats]:
    """Displacement (n, 3) and modes of held bodies under their nodal forces alone, to first order, without contact.

    Raises
    ------
    FactorisationError
        If a rigid-body motion is left free.
    """
    bricks = model.bricks
    numbering = _Numbering(model)
    displacement = np.zeros_like(bricks.points)
    modes = bricks.modes_at_rest()
    tangent = bricks.evaluate(displacement, modes)
    with factorise(numbering.matrix(numbering.blocks(tangent), displacement, displacement, 0.0)) as factor:
        displacement.ravel()[numbering.free] = factor.solve(numbering.reduced(model.forces, displacement))
    return displacement, bricks.stepped_modes(modes, tangent.recovery, displacement, 1.0)
