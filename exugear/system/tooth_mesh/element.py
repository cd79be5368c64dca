"""The mesh force element: frames, signs and phases of every mesh, its stiffness and damping for the kernel.

Frames and signs, in this one place
-----------------------------------
- All axes along +z, rotations positive about +z, helix angle positive for a right-hand gear.
- u is the unit vector from gear 1's axis to the pitch point: towards gear 2's axis for an external pair,
  away from it for an internal one. t = z x u is where gear 1's pitch point moves when gear 1 turns
  positively.
- s = +1 when the loaded flank of gear 1 faces +t (gear 1, driving, turns positively), else -1. It follows
  from the sign of the transmitted torque, not of the speed.
- The flank of gear 1 pushes gear 2 with F_bt (s t cos a + u sin a - s z tan b), a the working transverse
  pressure angle, b the base helix angle of gear 1. Gear 1 feels the opposite: the radial part -u sin a
  separates the gears, for external and internal pairs alike, and a right-hand gear driving in +z is pushed
  towards +z.
- Deflection is positive when the flanks approach. It is conjugate to F_bt, so that its spin part is
  s (r_b1 theta_1 + r_b2 theta_2) for an external pair and s (r_b1 theta_1 - r_b2 theta_2) for an internal
  one.
- PMC grows with s theta_1, seen from the frame of the line of centres; PMC = 0 when the loaded flanks touch
  in the pitch point at the middle of the common face.

Position of the gears: the centre distance is along the line of centres at mid-face; misalignment is the rotation of
gear 1's axis relative to gear 2's in the loaded flank's plane of action, positive for a gap at the +z end. The file of
each mesh model defines its deflection, force and other inputs (`exugear.system.tooth_mesh.laws`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Body, Mesh, node_position, seat_key
from exugear.gearbox.sections.entries import GROUND
from exugear.system.kernels.coordinates import BODY_SIZE
from exugear.system.kernels.cubics import periodic_cubic
from exugear.system.tooth_mesh.contact_state import MeshContactState, changed_over_cycle, even_contact
from exugear.system.tooth_mesh.placement import (
    MeshError,
    friction_rows,
    line_of_action_row,
    loaded_flanks,
    position_rows,
    tooth_places,
    wheel_errors,
)
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.surface import SteSurface
from fe_ste.transmission_error.table import TableInput

# What a mesh law has to say: the data it reads, its rows, its stiffness, and the numbers of its compiled form

Angles = Literal["reference", "operating"]


@dataclass(frozen=True)
class MeshCurve:
    """Curve of load over deflection of a pair, a power of the deflection at each position in the mesh cycle.

    Examples
    --------
    >>> half = MeshCurve(np.array([2e9]), np.array([2.5e9]), 40e3).at(20e3)
    >>> print(round(half.tangent[0] / half.stiffness[0], 9), round(1e-9 * half.stiffness[0], 4))
    1.25 1.7411
    """

    stiffness: Floats
    tangent: Floats
    """(n,) load over deflection, and the slope of the load, at pmc = 0, 1/n, ..., N/m."""
    force: float
    """Load on the transverse line of action at which they are, N."""
    table: TableInput | None = None
    """What they were computed from: contact at other loads and misalignments can be solved then."""
    load_centroid: Floats | None = None
    tangent_load_centroid: Floats | None = None
    """(n,) where the load bears along the face at the same positions, and what a little more deflection adds to it,
    m from its middle, in the axes of the table. The second is the first by default."""
    friction: Floats | None = None
    """(3, n) force and moments of friction at the same positions, see `friction_over_cycle`."""

    def at(self, force: float) -> MeshCurve:
        """Return the same curve by its stiffness at another load (N); without any, at that of the table."""
        if not force:
            return self
        exponent = self.tangent / self.stiffness
        stiffness = self.stiffness * (abs(force) / self.force) ** (1.0 - 1.0 / exponent)
        return replace(self, stiffness=stiffness, tangent=exponent * stiffness, force=abs(force))


MeshData = ArrayLike | MeshCurve | SteSurface
"""Input of a mesh model for a pair: stiffness over the mesh cycle (N/m), load over deflection, or table surface."""


@dataclass(frozen=True)
class TableFlanks:
    """What the law `table` needs of a mesh beyond its rows."""

    surface: SteSurface
    """SteSurface of the loaded flank."""
    back: Floats
    back_misalignment: Floats
    """(12,) rows of the other flank's deflection and misalignment."""
    backlash: float
    """Approach from flank to flank along the transverse line of action, m."""
    back_phase: float
    """PMC of the other flank at zero angles."""
    damping_time: float
    """Damping over tangent stiffness, s."""


class Law:
    """Mesh model with a force; defaults apply to a force along the line of action."""

    form: ClassVar[int]
    """Number of the law's compiled form in `exugear.system.tooth_mesh.laws.mesh_forces`."""
    tilts: ClassVar[bool] = True
    """Whether teeth resist misalignment by the state of their contact
    (`exugear.system.tooth_mesh.contact_state`); a law that does not has no moment, or one of its own."""

    def read(self, gearbox: Gearbox, pair: str, directory: Path) -> Floats | MeshCurve | SteSurface:
        """Read or compute the inputs of the model for a pair.

        Parameters
        ----------
        directory : results folder with ``tables/<pair>.nc``, for models that need tables

        Raises
        ------
        MeshError
            A table is missing, has positions that have not converged, or was computed from another input.
        """
        raise NotImplementedError

    def rows(self, mesh: Mesh, flank: int, nodes: tuple[Floats, Floats], angles: Angles) -> tuple[Floats, Floats]:
        """Deflection row and force row (12,) about the two bodies' nodes."""
        row = line_of_action_row(mesh, flank, nodes)
        return row, row

    def samples(self, data: MeshData, mesh: Mesh, static_force: float) -> tuple[Floats, Floats]:
        """F_bt over STE and its slope along the line of action, each (n,), N/m, at the static force (N)."""
        values = data.stiffness if isinstance(data, MeshCurve) else np.atleast_1d(np.asarray(data, dtype=np.float64))
        return values, values

    def load_ways(self, data: MeshData) -> Floats:
        """Ways of the load, and of what is added to it, along the face (2, n), as `MeshElement.load_ways`."""
        return np.zeros((2, 0))

    def stiffness(self, mesh: Mesh, line_of_action: Floats, angles: Angles) -> tuple[Floats, float]:
        """Stiffness (n,) in the law's own coordinate, N/m, from that of `samples`; F_bt per scalar force of the law."""
        return line_of_action, 1.0

    def coefficients(self, stiffness: Floats) -> Floats:
        """Numbers (n, 4) that the compiled form reads over n equal pieces of the mesh cycle."""
        return periodic_cubic(stiffness)

    def table_flanks(
        self, mesh: Mesh, flank: int, nodes: tuple[Floats, Floats], phase: float, data: MeshData, time: float
    ) -> TableFlanks | None:
        """Both flanks' tables of a law that follows one, with damping time (s) and PMC at zero angles."""
        return None


def friction_lack(elements: Sequence[MeshElement]) -> str:
    """Reason why the requested friction of the teeth cannot be computed; empty if it can, or without friction."""
    for element in elements:
        if element.friction_coefficient > 0.0 and element.friction is None and element.load > 0.0:
            return (
                f"damping.tooth_friction = {element.friction_coefficient:g}: pair {element.mesh.pair.name} has no line "
                "loads over the mesh cycle; use --mesh-model line_of_action with a table of exugear ste, or remove the "
                "key"
            )
    return ""


# The mesh force element: frames, signs and phases of every mesh, and its parameters for the kernel

STEEPEST = 2.0
"""Largest exponent of a curve of load over deflection: flanks that touch on one end first, the contact growing."""


@dataclass(frozen=True)
class MeshElement:
    """One mesh as the kernel sees it."""

    mesh: Mesh
    law: Law
    flank: int
    """+1 or -1, the loaded flank s of gear 1."""
    deflection: Floats
    force: Floats
    """(12,) rows about the two bodies' nodes (x y z, tilts, spin of gear 1, then gear 2)."""
    axis: Floats
    """(2, 2) axes of the two bodies relative to the frame's axis, m."""
    cycles: float
    """Mesh cycles per rad of gear 1 relative to the frame."""
    phase: float
    """PMC at zero angles."""
    stiffness: Floats
    tangent: Floats
    """(n,) load over deflection and slope of the load over the mesh cycle, in the law's own: coordinate, N/m; equal
    where the law is a straight line."""
    load: float
    """At which they are, on the transverse line of action, N."""
    contact: MeshContactState | None
    """How the teeth resist misalignment, in the axes of the mesh; None of a law in which they do not."""
    damping: float
    """N s/m, in the law's own coordinate."""
    damping_time: float
    """Damping over stiffness, s."""
    line_of_action: float
    """F_bt per scalar force of the law."""
    centre: Floats
    misalignment: Floats
    """(12,) rows of the centre distance and of the misalignment."""
    errors: tuple[Floats, Floats]
    """Errors of gear 1 and gear 2 over a revolution of each from zero angle, m; empty for none."""
    offset: Floats
    """(3,) deflection (m), change of centre distance (m) and misalignment (rad) at zero coordinates."""
    table: TableFlanks | None = None
    """For a law that follows a table; `stiffness` and `damping` are then what it has at the static load."""
    computed_from: TableInput | None = None
    """Input of the pair's table where contact is still to be solved at the static misalignment."""
    load_ways: Floats = field(default_factory=lambda: np.zeros((2, 0)))
    """(2, n) axial shift of the load over the mesh cycle, and of an increment of load, each about its mean, in the axes
    of the mesh, m; empty if constant or unknown."""
    friction: Floats | None = None
    """(3, n) force and moments of friction over the mesh cycle per unit coefficient and mesh force, along
    `friction_rows`; None if unknown."""
    friction_rows: Floats = field(default_factory=lambda: np.zeros((3, 2 * BODY_SIZE)))
    """(3, 12) rows of these forces and moments."""
    friction_coefficient: float = 0.0
    """Coefficient of friction of the teeth in runs and steady-state responses."""

    def with_contact(self, contact: MeshContactState) -> MeshElement:
        """Return the mesh, so far with even load, with the results of a solved contact, in the axes of its table.

        The mean stiffness of a curved model is then that of the contact, and so are its variation over the mesh cycle
        and the axial shifts of the load, as far as the positions of the contact resolve them; finer details are from
        the table. Where misalignment is so large that flanks touch long before or after mid-face contact, the
        deflection at mid-face is mostly that gap, and no measure of tooth deflection: the curve then begins at the gap.
        """
        secant = self.stiffness
        tangent = self.tangent
        ways = self.load_ways
        load = self.load
        gap = 0.0
        if self.is_curved:
            straight = contact.force / contact.tangent_stiffness
            yielding = float(np.clip(contact.deflection, straight, STEEPEST * straight))
            gap = contact.deflection - yielding
            secant, tangent, ways = self._samples_over_cycle(contact, yielding)
            secant = secant * (contact.force / yielding / np.mean(secant))
            tangent = tangent * (contact.tangent_stiffness / np.mean(tangent))
            load = contact.force
        slope = contact.deflection_by_distance
        shift = slope * (self.mesh.centre_distance + float(self.offset[1]) - contact.centre_distance)
        return replace(
            self,
            stiffness=secant,
            tangent=tangent,
            load=load,
            load_ways=ways,
            contact=contact.seen_by(self.flank),
            damping=self.damping_time * float(np.mean(tangent)),
            deflection=self.deflection - slope * self.centre,
            force=self.force - slope * self.centre,
            offset=self.offset - np.array([shift + gap, 0.0, 0.0]),
        )

    def _samples_over_cycle(self, contact: MeshContactState, yielding: float) -> tuple[Floats, Floats, Floats]:
        """Secant and tangent stiffness (n,), N/m, and axial shifts of the load (2, n), m, at the gear positions."""
        cycle = contact.cycle
        if cycle is None:
            return self.stiffness, self.tangent, self.load_ways
        deflection = changed_over_cycle(contact.force / self.stiffness, cycle.deflection)
        deflection += yielding - np.mean(deflection)
        softness = changed_over_cycle(1.0 / self.tangent, tuple(1.0 / np.array(cycle.tangent_stiffness)))
        softness += 1.0 / contact.tangent_stiffness - np.mean(softness)
        # A curve needs teeth that yield wherever they are.
        deflection = np.maximum(deflection, yielding / STEEPEST)
        softness = np.maximum(softness, 1.0 / (STEEPEST * contact.tangent_stiffness))
        ways = self.load_ways
        if ways.size:
            centres = cycle.load_centroid, cycle.tangent_load_centroid
            pairs = zip(self.flank * ways, centres, strict=True)
            ways = self.flank * np.array([changed_over_cycle(known, found) for known, found in pairs])
        return contact.force / deflection, 1.0 / softness, ways

    @property
    def is_curved(self) -> bool:
        """Whether load over deflection is another line than a straight one."""
        return self.table is None and not np.array_equal(self.stiffness, self.tangent)

    @property
    def bears_beside(self) -> bool:
        """Whether the load centroid of aligned gears is off the middle of the face."""
        contact = self.contact
        return contact is not None and any((contact.misalignment, contact.load_centroid, contact.tangent_load_centroid))

    @property
    def rest(self) -> float:
        """Deflection at which the mean tangent at the static load has no force, m; zero of a straight law."""
        return self.load / float(np.mean(self.stiffness)) - self.load / float(np.mean(self.tangent))


def mesh_elements(
    gearbox: Gearbox,
    stiffness: Mapping[str, MeshData],
    law: Law,
    inertias: str | None = None,
    flanks: Mapping[str, int] | None = None,
    angles: Angles = "reference",
    displaced: Mapping[str, tuple[float, float]] | None = None,
    nodes: Mapping[str, Floats] | None = None,
    contact: Mapping[str, MeshContactState] | None = None,
) -> tuple[MeshElement, ...]:
    """Return the elements of all meshes.

    Parameters
    ----------
    stiffness : mapping of pair name to (n,) array, to a curve, or to the table's surface
        F_bt / STE at pmc = 0, 1/n, ..., N/m; a single value for a constant. The model `table` needs surfaces.
    law : name of the mesh model, see `exugear.system.tooth_mesh.laws.registry.law_of`
    inertias : inertia set: it determines the positions of the bodies' nodes (centres of mass)
    flanks : loaded flank of each mesh; from the static load by default
    angles : {"reference", "operating"}
        Angles of the model `tangential`.
    displaced : offset of bodies at zero coordinates from their nominal position, x and y in the mesh's frame, m
    nodes : position (3,) of the node that carries a gear, by `seat_key` of body and gear; the body's own otherwise
    contact : by mesh name
        Contact at the static misalignment, in the axes of the pair's table (of the flank +1). A curved model takes its
        stiffness from it, with its variation and the shift of the load over the mesh cycle
        (`MeshElement.with_contact`). Meshes without one, or loaded on the other flank, carry the load evenly along the
        common face (`even_contact`).

    Raises
    ------
    MeshError
        No stiffness for an active pair, or none suitable for the model.
    """
    usual = loaded_flanks(gearbox)
    flanks = usual if flanks is None else flanks
    phases, orientation = tooth_places(gearbox, flanks)
    bodies = {body.name: body for body in gearbox.bodies(inertias)}
    time = gearbox.damping_times.mesh
    static = gearbox.train.static_mesh_forces()
    elements = []
    for mesh in gearbox.meshes:
        if mesh.pair.name not in stiffness:
            raise MeshError(f"mesh {mesh.name}: no stiffness for pair {mesh.pair.name!r}; compute its table")
        data = stiffness[mesh.pair.name]
        flank = flanks[mesh.name]
        phase = phases[mesh.name]
        ends = (_node(mesh.pinion, mesh.pair.pinion, bodies, nodes), _node(mesh.gear, mesh.pair.gear, bodies, nodes))
        known = contact.get(mesh.name) if contact and flank == usual[mesh.name] else None
        secant, tangent = law.samples(data, mesh, static[mesh.name])
        load = abs(static[mesh.name]) or (data.force if isinstance(data, MeshCurve) else 0.0)
        for values in (secant, tangent):
            if not (np.all(np.isfinite(values)) and np.all(values > 0.0)):
                raise MeshError(f"pair {mesh.pair.name}: mesh stiffness must be positive and finite")
        deflection, force = law.rows(mesh, flank, ends, angles)
        centre, misalignment = position_rows(mesh, flank, ends)
        mesh_stiffness, factor = law.stiffness(mesh, secant, angles)
        mesh_tangent, _ = law.stiffness(mesh, tangent, angles)
        even = even_contact(mesh.pair, load, float(np.mean(secant)), float(np.mean(tangent)))
        # Deflection, change of centre distance and misalignment at zero coordinates.
        offset = np.zeros(3)
        for start, carrying in ((0, mesh.pinion), (BODY_SIZE, mesh.gear)):
            way = np.array((displaced or {}).get(carrying, (0.0, 0.0)))
            offset[:2] += deflection[start : start + 2] @ way, centre[start : start + 2] @ way
        element = MeshElement(
            mesh=mesh,
            law=law,
            flank=flank,
            deflection=deflection,
            force=force,
            axis=_gear_axes(mesh, bodies),
            cycles=flank * mesh.pair.pinion.teeth / (2.0 * math.pi),
            phase=phase,
            stiffness=mesh_stiffness,
            tangent=mesh_tangent,
            load=load,
            contact=even if law.tilts else None,
            damping=time * float(np.mean(mesh_tangent)),
            damping_time=time,
            line_of_action=factor,
            centre=centre,
            misalignment=misalignment,
            errors=wheel_errors(gearbox, mesh, flank, phase, orientation),
            offset=offset,
            table=law.table_flanks(mesh, flank, ends, phase, data, time),
            computed_from=data.table if isinstance(data, MeshCurve) and flank == usual[mesh.name] else None,
            # A table holds the ways of its flank alone; on flank -1 it is turned about: ends of the face change places.
            load_ways=flank * law.load_ways(data) if flank == usual[mesh.name] else np.zeros((2, 0)),
            friction=data.friction if isinstance(data, MeshCurve) and flank == usual[mesh.name] else None,
            friction_rows=friction_rows(mesh, flank, ends),
            friction_coefficient=gearbox.case.damping.tooth_friction,
        )
        if known is not None and law.tilts:
            element = replace(element.with_contact(known), computed_from=None)
        elements.append(element)
    return tuple(elements)


def _node(body: str, gear: Gear, bodies: Mapping[str, Body], nodes: Mapping[str, Floats] | None) -> Floats:
    """Position of the node that carries a gear of a body, m."""
    seat = None if nodes is None else nodes.get(seat_key(body, gear.name))
    if seat is None:
        return node_position(bodies[body])
    return seat


def _gear_axes(mesh: Mesh, bodies: Mapping[str, Body]) -> Floats:
    """Axes of the two gears relative to the frame's axis (2, 2); irrelevant but finite for ground."""
    origin: Floats = np.array(bodies[mesh.frame].axis if mesh.frame != GROUND else (0.0, 0.0))
    axes: Floats = np.array([bodies[mesh.pinion].axis, bodies[mesh.gear].axis]) - origin
    if mesh.frame != GROUND:
        for name, axis in zip((mesh.pinion, mesh.gear), axes, strict=True):
            if bodies[name].carrier is None and math.hypot(*axis) > 1e-6:
                raise MeshError(f"mesh {mesh.name}: body {name} is not on the axis of its frame {mesh.frame}")
    return axes
