"""The mesh force element: frames, signs and phases of every mesh, and its parameters for the kernel.

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

Laws
----
``line_of_action``  k(PMC) of the table on the deflection above; force and deflection share one row
``seed``            tangential deflection at the pitch point; force T = (1, tan phi_n / cos beta, -tan beta)
``constant``        as line_of_action with the table's mean stiffness
``iso6336``         as line_of_action with the mean stiffness of ISO 6336-1 method B
``table``           potential of the table over deflection, centre distance and misalignment
                    (`exugear.kernels.table_law`); apart in the backlash, the other flank beyond it
``rigid``           no deflection and no element: the gears roll, only couplings twist (variant `rigid`)

Where the gears stand: the centre distance is along the line of centres at mid-face; misalignment is the turning of
gear 1's axis against gear 2's in the loaded flank's plane of action, positive where it opens the gap at the +z end.
A table is that of the flank s = +1; the flank s = -1 is it turned by pi about the line of centres: the same table
with misalignment reversed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exugear.kernels.meshes import MeshArrays, periodic_cubic
from exugear.kernels.table_law import TableArrays
from exugear.model.gearbox import Gearbox
from exugear.model.parts import Body, Mesh
from exugear.model.seats import node_position, seat_key
from exugear.model.sections.entries import GROUND
from exugear.tooth_mesh.placement import (
    MeshError,
    MeshGeometry,
    ToothContact,
    line_of_action_row,
    loaded_flanks,
    pitch_point_of,
    tooth_places,
    wrench_row,
)
from exugear.tooth_mesh.wheel_errors import wheel_errors
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.surface import SteSurface, axis_weights, slope_axis_weights

MeshData = ArrayLike | SteSurface
"""What a law knows of a pair: stiffness over the mesh cycle (N/m), or the table's surface."""
MeshLaw = Literal["rigid", "constant", "iso6336", "seed", "line_of_action", "table"]
MESH_LAWS: tuple[str, ...] = get_args(MeshLaw)
Angles = Literal["reference", "operating"]


@dataclass(frozen=True)
class TableFlanks:
    """What the law `table` needs of a mesh beyond its rows.

    Attributes
    ----------
    surface : SteSurface of the loaded flank
    back, back_tilt : (12,) rows of the other flank's deflection and misalignment
    backlash : approach from flank to flank along the transverse line of action, m
    back_phase : PMC of the other flank at zero angles
    damping_time : damping over tangent stiffness, s
    """

    surface: SteSurface
    back: Floats
    back_tilt: Floats
    backlash: float
    back_phase: float
    damping_time: float


@dataclass(frozen=True)
class MeshElement:
    """One mesh as the kernel sees it.

    Attributes
    ----------
    mesh : Mesh
    flank : +1 or -1, the loaded flank s of gear 1
    deflection, force : (12,) rows about the two bodies' nodes (x y z, tilts, spin of gear 1, then gear 2)
    place : (2, 2) axes of the two bodies relative to the frame's axis, m
    cycles : mesh cycles per rad of gear 1 relative to the frame
    phase : PMC at zero angles
    stiffness : (n,) k over the mesh cycle, in the law's own coordinate, N/m
    damping : N s/m, in the law's own coordinate
    line_of_action : F_bt per scalar force of the law
    centre, tilt : (12,) rows of the centre distance and of the misalignment
    errors : errors of gear 1 and gear 2 over a revolution of each from zero angle, m; empty for none
    offset : (3,) deflection (m), change of centre distance (m) and misalignment (rad) at zero coordinates
    table : for the law `table`; `stiffness` and `damping` are then what it has at the static load
    """

    mesh: Mesh
    flank: int
    deflection: Floats
    force: Floats
    place: Floats
    cycles: float
    phase: float
    stiffness: Floats
    damping: float
    line_of_action: float
    centre: Floats
    tilt: Floats
    errors: tuple[Floats, Floats]
    offset: Floats
    table: TableFlanks | None = None


def rows_of_law(
    mesh: Mesh, flank: int, nodes: tuple[Floats, Floats], law: str, angles: Angles = "reference"
) -> tuple[Floats, Floats]:
    """Deflection row and force row (12,) of a mesh law about the two bodies' nodes."""
    if law != "seed":
        row = line_of_action_row(mesh, flank, nodes)
        return row, row
    geometry = MeshGeometry.of(mesh)
    along, across, axial = geometry.tangential, geometry.radial, np.array([0.0, 0.0, 1.0])
    pitch_point = pitch_point_of(mesh, geometry, nodes)
    pressure, helix = seed_angles(mesh, angles)
    tangent = flank * along
    pushing = tangent + math.tan(pressure) * across - flank * math.tan(helix) * axial
    return wrench_row(tangent, pitch_point, nodes), wrench_row(pushing, pitch_point, nodes)


def rows_of_place(mesh: Mesh, flank: int, nodes: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Rows (12,) of the centre distance and of the misalignment of a flank about the two bodies' nodes."""
    geometry = MeshGeometry.of(mesh)
    towards = np.array([math.cos(mesh.position_angle), math.sin(mesh.position_angle), 0.0])
    centre = -wrench_row(towards, pitch_point_of(mesh, geometry, nodes), nodes)
    x, y, _ = geometry.plane_of_action(flank)
    tilt = np.zeros(12)
    tilt[[3, 4, 9, 10]] = y, -x, -y, x
    return centre, tilt


def seed_angles(mesh: Mesh, angles: Angles) -> tuple[float, float]:
    """Transverse pressure angle and helix angle of gear 1 that the law `seed` uses, rad."""
    pinion = mesh.pair.pinion
    if angles == "reference":
        return pinion.transverse_pressure_angle, pinion.helix_angle
    pressure = MeshGeometry.of(mesh).pressure_angle
    return pressure, math.atan(math.tan(pinion.base_helix_angle) / math.cos(pressure))


def law_stiffness(mesh: Mesh, law: str, line_of_action: Floats, angles: Angles) -> tuple[Floats, float]:
    """Stiffness of a law from F_bt/STE over the cycle, and F_bt per scalar force of the law.

    The seed's tangential law has k = F_tt / (STE / cos phi) with F_tt = F_bt cos phi, so k is cos^2 phi
    times the table's; its moment F_tt r_w is that of F_bt = F_tt / cos a with the operating angle a.
    """
    if law in ("constant", "iso6336"):
        return np.array([np.mean(line_of_action)]), 1.0
    if law in ("line_of_action", "table"):
        return line_of_action, 1.0
    pressure, _ = seed_angles(mesh, angles)
    return math.cos(pressure) ** 2 * line_of_action, 1.0 / math.cos(MeshGeometry.of(mesh).pressure_angle)


def mesh_elements(
    gearbox: Gearbox,
    stiffness: Mapping[str, MeshData],
    law: str = "line_of_action",
    inertias: str | None = None,
    flanks: Mapping[str, int] | None = None,
    angles: Angles = "reference",
    displaced: Mapping[str, tuple[float, float]] | None = None,
    nodes: Mapping[str, Floats] | None = None,
) -> tuple[MeshElement, ...]:
    """Elements of all meshes.

    Parameters
    ----------
    gearbox : Gearbox
    stiffness : mapping of pair name to (n,) array, or to the table's surface
        F_bt / STE at pmc = 0, 1/n, ..., N/m; a single value for a constant. The law `table` needs surfaces.
    law : str
        One of `MESH_LAWS` but ``rigid``, which has no force.
    inertias : str, optional
        Inertia set: it decides where the bodies' nodes (centres of mass) are.
    flanks : mapping, optional
        Loaded flank of each mesh; from the static load by default.
    angles : {"reference", "operating"}
        Angles of the law `seed`.
    displaced : mapping, optional
        Place of bodies at zero coordinates against their nominal one, x and y seen from the mesh's frame, m.
    nodes : mapping, optional
        Position (3,) of the node that carries a gear, by `seat_key` of body and gear; the body's own otherwise.

    Raises
    ------
    MeshError
        Unknown law, or no stiffness for a pair at work.
    """
    if law not in MESH_LAWS or law == "rigid":
        known = ", ".join(name for name in MESH_LAWS if name != "rigid")
        raise MeshError(f"mesh law {law!r} has no force element; laws are {known}")
    flanks = loaded_flanks(gearbox) if flanks is None else flanks
    phases, orientation = tooth_places(gearbox, flanks)
    bodies = {body.name: body for body in gearbox.bodies(inertias)}
    time = gearbox.case.damping.mesh_time_s
    static = gearbox.train.static_mesh_forces()
    elements = []
    for mesh in gearbox.meshes:
        if mesh.pair.name not in stiffness:
            raise MeshError(f"mesh {mesh.name}: no stiffness for pair {mesh.pair.name!r}; compute its table")
        data = stiffness[mesh.pair.name]
        flank, phase = flanks[mesh.name], phases[mesh.name]
        ends = (_node(mesh.pinion, mesh.pair.pinion, bodies, nodes), _node(mesh.gear, mesh.pair.gear, bodies, nodes))
        table = None
        if law == "table":
            table = _table_flanks(mesh, flank, ends, phase, data, time)
            data = table.surface.mean_stiffness(abs(static[mesh.name]), mesh.centre_distance)
        samples = np.atleast_1d(np.asarray(data, dtype=np.float64))
        if not (np.all(np.isfinite(samples)) and np.all(samples > 0.0)):
            raise MeshError(f"pair {mesh.pair.name}: mesh stiffness must be positive and finite")
        deflection, force = rows_of_law(mesh, flank, ends, law, angles)
        centre, tilt = rows_of_place(mesh, flank, ends)
        own, factor = law_stiffness(mesh, law, samples, angles)
        elements.append(
            MeshElement(
                mesh=mesh,
                flank=flank,
                deflection=deflection,
                force=force,
                place=_places(mesh, bodies),
                cycles=flank * mesh.pair.pinion.teeth / (2.0 * math.pi),
                phase=phase,
                stiffness=own,
                damping=time * float(np.mean(own)),
                line_of_action=factor,
                centre=centre,
                tilt=tilt,
                errors=wheel_errors(gearbox, mesh, flank, phase, orientation),
                offset=_offset(mesh, displaced or {}, deflection, centre),
                table=table,
            )
        )
    return tuple(elements)


def _offset(mesh: Mesh, displaced: Mapping[str, tuple[float, float]], deflection: Floats, centre: Floats) -> Floats:
    """Deflection, change of centre distance and misalignment at zero coordinates, (3,)."""
    offset = np.zeros(3)
    for first, body in ((0, mesh.pinion), (6, mesh.gear)):
        way = np.array(displaced.get(body, (0.0, 0.0)))
        offset[:2] += deflection[first : first + 2] @ way, centre[first : first + 2] @ way
    return offset


def _table_flanks(
    mesh: Mesh, flank: int, nodes: tuple[Floats, Floats], phase: float, data: MeshData, time: float
) -> TableFlanks:
    if not isinstance(data, SteSurface):
        raise MeshError(f"pair {mesh.pair.name}: the law table needs its table, not a stiffness")
    back, _ = rows_of_law(mesh, -flank, nodes, "table")
    _, back_tilt = rows_of_place(mesh, -flank, nodes)
    pair = mesh.pair.with_centre_distance(mesh.centre_distance)
    orientation = ToothContact(mesh, flank, 1).orientation(phase)
    return TableFlanks(
        surface=data,
        back=back,
        back_tilt=back_tilt,
        backlash=pair.circumferential_backlash * math.cos(pair.working_pressure_angle),
        back_phase=ToothContact(mesh, -flank, 1).cycle(orientation) % 1.0,
        damping_time=time,
    )


def _node(body: str, gear: Gear, bodies: Mapping[str, Body], nodes: Mapping[str, Floats] | None) -> Floats:
    """Position of the node that carries a gear of a body, m."""
    found = None if nodes is None else nodes.get(seat_key(body, gear.name))
    return node_position(bodies[body]) if found is None else found


def _places(mesh: Mesh, bodies: Mapping[str, Body]) -> Floats:
    """Axes of the two gears relative to the frame's axis (2, 2); irrelevant but finite for ground."""
    origin: Floats = np.array(bodies[mesh.frame].axis if mesh.frame != GROUND else (0.0, 0.0))
    places: Floats = np.array([bodies[mesh.pinion].axis, bodies[mesh.gear].axis]) - origin
    if mesh.frame != GROUND:
        for name, place in zip((mesh.pinion, mesh.gear), places, strict=True):
            if bodies[name].carrier is None and math.hypot(*place) > 1e-6:
                raise MeshError(f"mesh {mesh.name}: body {name} is not on the axis of its frame {mesh.frame}")
    return places


def pack(
    elements: tuple[MeshElement, ...],
    coordinates: Mapping[str, tuple[int, ...]],
    averaged: bool = False,
    tables: bool = True,
) -> MeshArrays:
    """Arrays for the kernel.

    Parameters
    ----------
    elements : tuple of MeshElement
    coordinates : mapping of body name, or of `seat_key`, to six state indices (-1 where there is none)
    averaged : bool
        Replace stiffness and tables by their mean over the cycle, as eigenmodes need it.
    tables : bool
        False replaces tables by the stiffness they have at the static load.
    """
    count = len(elements)
    samples = [np.array([np.mean(e.stiffness)]) if averaged else e.stiffness for e in elements]
    width = max((len(values) for values in samples), default=1)
    stiffness = np.zeros((count, width, 4))
    for block, values in zip(stiffness, samples, strict=True):
        block[: len(values)] = periodic_cubic(values)
    index = np.full((count, 13), -1, dtype=np.int64)
    for row, element in zip(index, elements, strict=True):
        mesh = element.mesh
        for end, body, gear in ((0, mesh.pinion, mesh.pair.pinion), (6, mesh.gear, mesh.pair.gear)):
            keys = (seat_key(body, mesh.name), seat_key(body, gear.name), body)  # a travelling seat, a seat, the body
            row[end : end + 6] = next((coordinates[key] for key in keys if key in coordinates), (-1,) * 6)
        row[12] = coordinates.get(mesh.frame, (-1,) * 6)[5]
    return MeshArrays(
        coordinates=index,
        place=np.array([e.place for e in elements]).reshape(count, 2, 2),
        deflection=np.array([e.deflection for e in elements]).reshape(count, 12),
        force=np.array([e.force for e in elements]).reshape(count, 12),
        cycles=np.array([e.cycles for e in elements]),
        phase=np.array([e.phase for e in elements]),
        pieces=np.array([len(values) for values in samples], dtype=np.int64),
        stiffness=stiffness,
        damping=np.array([e.damping for e in elements]),
        line_of_action=np.array([e.line_of_action for e in elements]),
        error_pieces=np.array([[len(error) for error in e.errors] for e in elements], dtype=np.int64).reshape(count, 2),
        error=_pack_errors(elements),
        table=_pack_tables(elements, index, averaged, tables),
    )


def _pack_errors(elements: tuple[MeshElement, ...]) -> Floats:
    longest = max((len(error) for element in elements for error in element.errors), default=0)
    coefficients = np.zeros((len(elements), 2, longest, 4))
    for block, element in zip(coefficients, elements, strict=True):
        for end, error in enumerate(element.errors):
            if len(error):
                block[end, : len(error)] = periodic_cubic(error)
    return coefficients


def _pack_tables(
    elements: tuple[MeshElement, ...], index: NDArray[np.int64], averaged: bool, tables: bool
) -> TableArrays:
    """Arrays of all tables; those of gears that stay where they are hold that place only."""
    surfaces = [
        _surface(element, row, averaged) if tables and element.table is not None else None
        for element, row in zip(elements, index, strict=True)
    ]
    found = [surface for surface in surfaces if surface is not None]
    count = len(elements)
    size = max((s.coefficients.size for s in found), default=0)
    loads = max((s.root_force.size for s in found), default=0)
    longest = max((len(knots) for s in found for knots in (s.centre_distance, s.misalignment)), default=0)
    arrays = TableArrays(
        shape=np.zeros((count, 4), dtype=np.int64),
        axes=np.zeros((count, 2), dtype=np.int64),
        values=np.zeros((count, size)),
        root=np.zeros((count, loads)),
        knots=np.zeros((count, 2, longest)),
        first=np.zeros((count, 2, longest), dtype=np.int64),
        weights=np.zeros((count, 2, longest, 4, 4)),
        lowest=np.zeros(count),
        centre=np.array([e.centre for e in elements]).reshape(count, 12),
        tilt=np.array([e.tilt for e in elements]).reshape(count, 12),
        back=np.zeros((count, 12)),
        back_tilt=np.zeros((count, 12)),
        nominal=np.array([e.offset + [0.0, e.mesh.centre_distance, 0.0] for e in elements]).reshape(count, 3),
        backlash=np.zeros(count),
        back_phase=np.zeros(count),
        damping_time=np.zeros(count),
        sense=np.array([e.flank for e in elements], dtype=np.float64),
    )
    for m, (element, surface) in enumerate(zip(elements, surfaces, strict=True)):
        if surface is not None and element.table is not None:
            _fill_table(arrays, m, element.table, surface)
    return arrays


def _surface(element: MeshElement, row: NDArray[np.int64], averaged: bool) -> SteSurface | None:
    if element.table is None:
        return None
    surface = element.table.surface
    if np.all(np.delete(row[:12], [5, 11]) < 0):
        surface = surface.at_nominal(element.mesh.centre_distance)
    return surface.averaged() if averaged else surface


def _fill_table(arrays: TableArrays, m: int, flanks: TableFlanks, surface: SteSurface) -> None:
    flat = np.ascontiguousarray(surface.coefficients).ravel()
    arrays.shape[m] = surface.coefficients.shape[:4]
    arrays.values[m, : flat.size] = flat
    arrays.root[m, : surface.root_force.size] = surface.root_force
    axes = (surface.centre_distance, axis_weights), (surface.misalignment, slope_axis_weights)
    for axis, (knots, weights_of) in enumerate(axes):
        first, weights = weights_of(knots)
        arrays.axes[m, axis] = len(knots)
        arrays.knots[m, axis, : len(knots)] = knots
        arrays.first[m, axis, : len(first)] = first
        arrays.weights[m, axis, : len(first)] = weights
    step = 1 if surface.misalignment.size == 1 else 2
    unloaded = surface.coefficients[:, :, ::step, 0, 0]
    arrays.lowest[m] = unloaded.min() - np.ptp(unloaded)  # weights may carry the surface below its nodes
    arrays.back[m], arrays.back_tilt[m] = flanks.back, flanks.back_tilt
    arrays.backlash[m], arrays.back_phase[m] = flanks.backlash, flanks.back_phase
    arrays.damping_time[m] = flanks.damping_time
