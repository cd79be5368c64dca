"""Bodies of a gearbox that are matrices of other programs: files, units, and nodes of gears, bearings and mounts."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import LARGEST_MATRICES
from exugear.gearbox.sections.bodies import ExternalSeatSection, ExternalSection
from exugear.gearbox.units import DEG, MM
from exugear.system.bearings.stiffness import elastic_names
from exugear.system.bodies.elastic_body import stated_damping
from exugear.system.bodies.external import SAME_PLACE, ExternalModel, NodeSeat, matrices_of, placed_matrices
from exugear.system.bodies.matrix_files.files import Kind, MatrixFiles
from exugear.system.bodies.matrix_files.interface import MatrixFileError
from exugear.system.bodies.reduction import ReductionError
from exugear.system.bodies.seated_items import Item, SeatedBody, frame_of, stated_seats
from fe_ste.tools.arrays import Floats

STATED_TOLERANCE = 0.01
"""Largest difference from a stated mass, over it, and from a stated centre, over the extent of the nodes."""
STIFF_SEATS = (
    "RBE2 makes each seat rigid: thin-walled bearing seats tilt up to 38 % less, and frequencies of a gearbox were up "
    "to 19 % higher than with RBE3; reduce with RBE3 for comparison"
)
"""What an RBE2 does, from housings reduced both ways."""


def external_body(gearbox: Gearbox, name: str) -> SeatedBody[ExternalModel]:
    """Return the data of a body's matrices from the gearbox file; its files are permitted, but not yet read.

    Raises
    ------
    GearboxFileError
        The body has no matrices, a file does not exist or lies outside the permitted folder, or a seat is inconsistent.
    """
    body = gearbox.body(name)
    section = gearbox.case.bodies[body.family]
    key = f"bodies.{body.family}.external"
    external = section.external
    if external is None:
        raise gearbox.error(f"bodies.{body.family}: no matrices; add a [{key}] table")
    frame = frame_of(gearbox, body)
    if section.flexibility == "nonrotating" and frame != "nonrotating":
        raise gearbox.error(
            f"bodies.{body.family}.flexibility = 'nonrotating': the body carries planets and is described in its own "
            "rotating frame; set 'elastic'"
        )
    if external.gyroscopic is not None and frame != "nonrotating":
        raise gearbox.error(f"{key}.gyroscopic: only shafts, in a frame that does not turn, have one; remove it")
    if external.recovery is not None and frame != "ground":
        raise gearbox.error(f"{key}.recovery: only fixed bodies radiate sound here; remove it")
    seats, sectors, shared = stated_seats(gearbox, body, "external", external.seats, partial(_node_seats, gearbox))
    names = [seat.name for seat in seats]
    if external.torque_seat is not None and external.torque_seat not in names:
        raise gearbox.error(f"{key}.torque_seat = {external.torque_seat!r}: no such seat; seats are {', '.join(names)}")
    x, y, z = external.shift_mm
    model = ExternalModel(
        name=name,
        files=_files(gearbox, key, external),
        units=external.units,
        rotation=tuple((float(a), float(b), float(c)) for a, b, c in _rotation(external.turn_deg)),
        shift=(MM * x, MM * y, MM * z),
        seats=tuple(seats),
        frame=frame,
        limit=gearbox.case.elasticity.limit_Hz,
        band=external.band_Hz or gearbox.case.elasticity.band_Hz,
        axis=body.axis,
    )
    return SeatedBody(model, external.torque_seat or names[0], sectors, shared, *stated_damping(external))


def _files(gearbox: Gearbox, key: str, external: ExternalSection) -> MatrixFiles:
    def path(of: str, name: str | None) -> Path | None:
        return None if name is None else gearbox.file(f"{key}.{of}", name, LARGEST_MATRICES)

    names: dict[Kind, str] = {}
    if external.stiffness_name is not None:
        names["stiffness"] = external.stiffness_name
    if external.mass_name is not None:
        names["mass"] = external.mass_name
    return MatrixFiles(
        file=path("file", external.file),
        stiffness=path("stiffness", external.stiffness),
        mass=path("mass", external.mass),
        nodes=path("nodes", external.nodes),
        names=names,
        gyroscopic=path("gyroscopic", external.gyroscopic),
        recovery=path("recovery", external.recovery),
        recovery_matrix=path("recovery_matrix", external.recovery_matrix),
    )


def _rotation(turn_deg: tuple[float, float, float]) -> Floats:
    """Rotation matrix of rotations about the fixed axes x, y and z, in this order."""
    rotation = np.eye(3)
    for axis, angle in enumerate(turn_deg):
        cosine, sine = np.cos(DEG * angle), np.sin(DEG * angle)
        one = np.eye(3)
        first, second = (axis + 1) % 3, (axis + 2) % 3
        one[first, first] = one[second, second] = cosine
        one[first, second], one[second, first] = -sine, sine
        rotation = one @ rotation
    return rotation


def _node_seats(
    gearbox: Gearbox, key: str, name: str, item: Item | None, section: ExternalSeatSection | None
) -> list[NodeSeat]:
    """One seat, from its entry in the file and the position of the item on it, or its sectors."""
    if section is not None and section.sector_nodes:
        if item is None or item.noun != "gear":
            raise gearbox.error(f"{key}.sector_nodes: only the seat of a gear has sectors; set node")
        return [NodeSeat(f"{name}_{n}", item.position, node) for n, node in enumerate(section.sector_nodes, start=1)]
    position = None if item is None else item.position
    node = None if section is None else section.node
    if section is not None and section.position_mm is not None:
        x, y, z = section.position_mm
        position = (MM * x, MM * y, MM * z)
    if position is None and node is None:
        raise gearbox.error(f"{key}: no gear, bearing or mount of the body is named {name!r}; set node or position_mm")
    return [NodeSeat(name, position or (0.0, 0.0, 0.0), node)]


def check_external(gearbox: Gearbox, name: str) -> None:
    """Read the matrices of a body and refuse those that are not of a free elastic body, or do not fit its seats.

    Raises
    ------
    GearboxFileError
        As `external_body`; or a file cannot be used, the matrices fail a check, a seat has no node, or stated mass and
        centre contradict the matrices.
    """
    external = external_body(gearbox, name)
    key = f"bodies.{gearbox.body(name).family}.external"
    try:
        matrices, found = matrices_of(external.model)
        if found.errors:
            raise gearbox.error(*(f"{key}: {line}" for line in found.errors))
        placed = placed_matrices(external.model)
    except (MatrixFileError, ReductionError) as error:
        raise gearbox.error(f"{key}: {error}") from None
    section = gearbox.case.bodies[gearbox.body(name).family].external
    assert section is not None
    stated = section.stated_mass_kg
    if stated is not None and abs(found.mass - stated) > STATED_TOLERANCE * stated:
        raise gearbox.error(
            f"{key}.stated_mass_kg = {stated:g}: the matrices have {found.mass:.6g} kg; check units and model"
        )
    if section.stated_centre_mm is not None:
        off = float(np.linalg.norm(MM * np.array(section.stated_centre_mm) - found.centre))
        if off > STATED_TOLERANCE * found.size:
            centre = ", ".join(f"{1e3 * value:.5g}" for value in found.centre)
            raise gearbox.error(
                f"{key}.stated_centre_mm: the matrices have their centre at ({centre}) mm; check units and model"
            )
    at_sectors = {seat for seats in external.sectors.values() for seat in seats}
    for seat, place, node in zip(external.model.seats, placed.positions, placed.nodes, strict=False):
        off = float(np.linalg.norm(place - np.array(seat.position)))
        if seat.name in at_sectors and off > SAME_PLACE:
            raise gearbox.error(
                f"{key}.seats: sector node {node} is {1e3 * off:.4g} mm from the centre of the gear; refer the mean "
                "motion of each sector to the centre of the gear, as an RBE3 with its reference node there does"
            )


def external_facts(gearbox: Gearbox) -> Iterator[str]:
    """Say what the matrices of each flexible body hold: coordinates, mass, centre and first mode.

    These are the figures to compare with those that the other program lists.
    """
    for name in elastic_names(gearbox):
        family = gearbox.body(name).family
        if gearbox.case.bodies[family].external is None:
            continue
        matrices, found = matrices_of(external_body(gearbox, name).model)
        centre = ", ".join(f"{1e3 * value:.4g}" for value in found.centre)
        yield (
            f"bodies.{family}.external: {len(matrices.nodes)} nodes, {len(matrices.modal)} modal coordinates, "
            f"{found.mass:.5g} kg, centre of mass at ({centre}) mm in the axes of the files, first elastic mode of the "
            f"free body at {found.first_frequency:.4g} Hz"
        )


def external_warnings(gearbox: Gearbox, name: str) -> Iterator[str]:
    """Say what is unusual about the matrices of a body, and which effects they do not have.

    Errors are not repeated here; see `check_external`.
    """
    body = gearbox.body(name)
    key = f"bodies.{body.family}.external"
    try:
        external = external_body(gearbox, name)
        found = matrices_of(external.model)[1]
        placed = placed_matrices(external.model)
    except (MatrixFileError, ReductionError):
        return
    yield from (f"{key}: {line}" for line in found.warnings)
    section = gearbox.case.bodies[body.family].external
    if section is not None and section.constraint == "rbe2":
        yield f"{key}.constraint = 'rbe2': {STIFF_SEATS}"
    spare = placed.nodes[len(external.model.seats) :]
    if spare:
        yield f"{key}: nodes {', '.join(map(str, spare))} carry nothing and remain free"
    if external.model.frame == "nonrotating" and placed.gyroscopic is None:
        yield (
            f"{key}: gyroscopic forces follow from the torsional inertia of the seats; frequencies of shafts came out "
            "within 0.03 %"
        )
    elif external.model.frame == "carrier":
        yield (
            f"{key}: Coriolis and centrifugal forces act as on a rigid body; frequencies of a carrier at 22 rpm came "
            "out within 0.02 %"
        )
