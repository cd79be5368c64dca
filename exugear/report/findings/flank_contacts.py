"""Contact of the teeth of each pair under the static load: aligned gears, and gears as their bearings hold them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.parts import Mesh
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import Context
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.operating_points import contact_places
from exugear.system.statics import BalanceError, static_state
from exugear.system.tooth_mesh.contact_state import MeshPlace
from fe_ste.contact.kinematics import ContactError
from fe_ste.flank_pressure import FlankPressure, flank_pressures
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.threads import one_dense_thread, side_by_side


@dataclass(frozen=True)
class PairContact:
    """Contact of one pair; its z axis is that of the gearbox."""

    mesh: str
    """Mesh of the pair with the largest misalignment."""
    family: str
    """Family of that mesh."""
    pair: GearPair
    force: float
    """On the transverse line of action, N."""
    aligned: FlankPressure
    actual: FlankPressure
    """At the static misalignment."""


def flank_contacts(context: Context, choice: Choice) -> list[PairContact]:
    """Solve the contact of each pair of a model; pairs without transmission error table are omitted.

    A contact that cannot be solved is noted as skipped.
    """
    if Variant.of(choice.variant).spins_only:
        return []
    assembly = context.assembled(choice)
    try:
        state = static_state(assembly)
    except (BalanceError, BearingError) as error:
        context.notes.left_out.append(f"contact of teeth: {error}")
        return []
    places = contact_places(state.assembly, state.q)
    chosen: dict[str, tuple[Mesh, int, MeshPlace]] = {}
    for element in assembly.elements:
        mesh = element.mesh
        place = places.get(mesh.name)
        if place is None or place.force <= 0.0:
            continue
        before = chosen.get(mesh.pair.name)
        if before is None or abs(place.misalignment) > abs(before[2].misalignment):
            chosen[mesh.pair.name] = (mesh, element.flank, place)
    context.tell("contact of teeth")
    with one_dense_thread():
        solved = dict(zip(chosen, side_by_side(_solved, [place for _, _, place in chosen.values()]), strict=True))
    found = []
    for name, (mesh, flank, place) in chosen.items():
        pressures = solved[name]
        if isinstance(pressures, ContactError):
            context.notes.left_out.append(f"contact of teeth: {pressures}")
            continue
        aligned, actual = (_seen_by(pressure, flank) for pressure in pressures)
        found.append(PairContact(mesh.name, mesh.family, place.table.pair, place.force, aligned, actual))
    return found


def _solved(place: MeshPlace) -> list[FlankPressure] | ContactError:
    try:
        return flank_pressures(place.table, place.force, (0.0, place.misalignment), place.centre_distance)
    except ContactError as error:
        return error


def _seen_by(pressure: FlankPressure, flank: int) -> FlankPressure:
    """Turn the ends of the face of a table to those of a mesh: its loaded flank -1 is that of the table turned."""
    if flank > 0:
        return pressure
    return FlankPressure(
        misalignment=-pressure.misalignment,
        path=pressure.path,
        axial=-pressure.axial[::-1],
        pressure=pressure.pressure[:, ::-1],
        line_load=pressure.line_load[::-1],
        face_load_factor=pressure.face_load_factor,
        edge_pressure=pressure.edge_pressure,
        edge_place=(pressure.edge_place[0], -pressure.edge_place[1]),
    )


def place_on_flank(contact: PairContact, path: float, axial: float, labels: Mapping[str, str]) -> str:
    """Say where a place on the flank of gear 1 is, such as "tip of sun, −z end"; path and axial position in m."""
    share = (path - contact.actual.path[0]) / (contact.actual.path[-1] - contact.actual.path[0])
    height = ("root", "middle of the profile", "tip")[int(np.clip(3.0 * share, 0, 2))]
    pinion = contact.pair.pinion.name
    return f"{height} of {labels.get(pinion, pinion)}, {_end_of_face(contact, axial)}"


def edge_in_words(contact: PairContact, labels: Mapping[str, str]) -> str:
    """Say at which tip the edge pressure is highest, such as "tip of planet, +z end"; a dash if no load lies there."""
    path, axial = contact.actual.edge_place
    if np.isnan(path):
        return "–"
    gear = contact.pair.pinion if path == contact.actual.path[-1] else contact.pair.gear
    return f"tip of {labels.get(gear.name, gear.name)}, {_end_of_face(contact, axial)}"


def _end_of_face(contact: PairContact, axial: float) -> str:
    faces = contact.actual.axial
    ends = ("−z end", "middle of the face", "+z end")
    return ends[int(np.clip(3.0 * (axial - faces[0]) / np.ptp(faces), 0, 2))]
