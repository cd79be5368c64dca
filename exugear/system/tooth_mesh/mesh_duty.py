"""What meshes bear under the static load: how they stand, and how evenly and hard teeth press by finite elements."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from exugear.system.tooth_mesh.static_contact import MeshPlace, static_contacts
from fe_ste.tools.display import Displayed

POSITIONS = 10
"""Positions of the mesh cycle over which the load along the face is averaged: with five it is up to 6 % too uneven,
with ten by 1 %."""


@dataclass(frozen=True)
class MeshDuty(Displayed):
    """A mesh under the static load."""

    name: str
    force: float
    """On the transverse line of action, N; positive, the flank that the static load presses pushes."""
    misalignment: float
    opening: float
    """Of the gears, opening the gap at the +z end, rad; over the common face, m."""
    centre_distance_change: float
    """Axes further apart than nominal, m."""
    load_centre: float = math.nan
    """Axial position of the resultant from the middle of the common face, m; NaN where no contact was solved."""
    face_load_factor: float = math.nan
    """K_Hbeta: highest over mean line load along the face; NaN likewise."""
    pressure: float = math.nan
    """Largest of the mesh cycle away from tip edges, Pa; NaN likewise."""
    remark: str = ""
    """Why no contact was solved; empty where it was."""

    def _line(self) -> str:
        return f" of {self.name!r}: open by {1e6 * self.opening:.3g} um, K_Hbeta {self.face_load_factor:.3g}"


def with_contact(duty: MeshDuty, place: MeshPlace | None, flank: int) -> MeshDuty:
    """Add what finite-element contact tells of a mesh.

    Parameters
    ----------
    place : where its gears stand, if contact can be solved
    flank : loaded flank of gear 1: the table's frame is that of +1
    """
    if place is None:
        return duty
    solved = static_contacts({duty.name: place}, POSITIONS)
    if duty.name in solved.unsolved:
        return replace(duty, remark=solved.unsolved[duty.name])
    contact = solved.contacts[duty.name]
    centre, factor, pressure = (
        float(contact.at(values, place.misalignment))
        for values in (contact.load_centre, contact.face_load_factor, contact.max_pressure)
    )
    return replace(duty, load_centre=flank * centre, face_load_factor=factor, pressure=pressure)
