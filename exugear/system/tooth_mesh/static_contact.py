"""Contact of meshes at the places where their gears stand under the static load, by finite elements.

Meshes of equal planets share one contact, that at their mean: as the carrier turns each of them passes all places, and
left apart they would be an asymmetry that turns with the carrier.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from exugear.system.tooth_mesh.contact_state import ContactCycle, ContactState
from fe_ste.contact.kinematics import ContactError
from fe_ste.transmission_error.known_contacts import known_contacts
from fe_ste.transmission_error.mean_contact import POSITIONS, MeanContact, contact_input
from fe_ste.transmission_error.table import TableInput


@dataclass(frozen=True)
class MeshPlace:
    """How the gears of a mesh stand at rest, in the axes of its pair's table."""

    table: TableInput
    """What the pair's table was computed from."""
    force: float
    """On the transverse line of action, N."""
    misalignment: float
    centre_distance: float
    """rad, m."""
    group: str
    """Meshes of one group share one contact."""


@dataclass(frozen=True)
class StaticContacts:
    """Contacts of meshes at rest."""

    contacts: Mapping[str, MeanContact] = field(default_factory=dict)
    """By mesh name."""
    unsolved: Mapping[str, str] = field(default_factory=dict)
    """By mesh name, why there is none."""

    @property
    def states(self) -> dict[str, ContactState]:
        """What a mesh law takes of them, by mesh, in the axes of the pairs' tables."""
        return {name: contact_state(contact) for name, contact in self.contacts.items()}

    @property
    def remarks(self) -> tuple[str, ...]:
        """Say of which meshes there is none, why, and what they do instead."""
        return tuple(
            f"mesh {name}: no contact at its static misalignment ({why}); its teeth resist misalignment as if they "
            "bore evenly along the face"
            for name, why in self.unsolved.items()
        )

    @property
    def in_words(self) -> str:
        """What resists misalignment, for files."""
        words = []
        if self.contacts:
            words.append(f"finite elements at the static misalignment: {', '.join(self.contacts)}")
        if self.unsolved:
            words.append(f"as if they bore evenly, contact not solved: {', '.join(self.unsolved)}")
        return "; ".join(words) or "by the mesh law alone"


def static_contacts(places: Mapping[str, MeshPlace], positions: int = POSITIONS) -> StaticContacts:
    """Solve the contact of meshes where they stand.

    Parameters
    ----------
    places : by mesh name
    positions : of the mesh cycle
    """
    groups: dict[str, list[MeshPlace]] = {}
    for place in places.values():
        groups.setdefault(place.group, []).append(place)
    wanted: dict[str, TableInput] = {}
    unsolved: dict[str, str] = {}
    for name, members in groups.items():
        force, misalignment, distance = (
            float(np.mean([getattr(member, value) for member in members]))
            for value in ("force", "misalignment", "centre_distance")
        )
        if force > 0.0:
            wanted[name] = contact_input(members[0].table, force, misalignment, distance, positions)
        else:
            unsolved[name] = "presses no teeth together"
    solved = dict(zip(wanted, known_contacts(list(wanted.values())), strict=True))
    unsolved |= {name: str(found) for name, found in solved.items() if isinstance(found, ContactError)}
    contacts = {name: found for name, found in solved.items() if isinstance(found, MeanContact)}
    return StaticContacts(
        {mesh: contacts[place.group] for mesh, place in places.items() if place.group in contacts},
        {mesh: unsolved[place.group] for mesh, place in places.items() if place.group in unsolved},
    )


def contact_state(contact: MeanContact) -> ContactState:
    """Take from a contact what a mesh law needs: the middle of its two misalignments, so that all nearby agree."""
    middle = float(contact.misalignment.mean())
    deflection, stiffness, centre, tangent_centre = (
        float(contact.at(values, middle))
        for values in (contact.deflection, contact.stiffness, contact.load_centre, contact.tangent_load_centre)
    )
    over_cycle = (
        contact.cycle_deflection,
        contact.cycle_stiffness,
        contact.cycle_load_centre,
        contact.cycle_tangent_load_centre,
    )
    return ContactState(
        force=contact.force,
        deflection=deflection,
        tangent_stiffness=stiffness,
        misalignment=middle,
        load_centre=centre,
        tangent_load_centre=tangent_centre,
        tilt_stiffness=contact.tilt_stiffness,
        centre_distance=contact.centre_distance,
        deflection_by_distance=contact.deflection_by_distance,
        cycle=ContactCycle(*(tuple(contact.at(values, middle).tolist()) for values in over_cycle)),
    )
