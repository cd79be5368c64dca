"""Contact of a mesh about its static state: deflection, load centroid, and their dependence on load and tilt.

With the deflection d at mid-face and the misalignment g, both of the loaded flank, a model along a row uses

    e = d - (zt + w) (g - g0),   force F(e),   moment M = F0 zc + zt (F - F0) + w F - kg (g - g0),

which has a potential, U = U(e) + (zt - zc) F0 (g - g0) + kg (g - g0)^2 / 2: the generalized force of the mesh is
-F dd/dq + M dg/dq. The deflection changes with the centre distance a by sa (a - a0): the row of d includes this, so
that the load also acts between the axes. The load centroid zc and the centroid zt of an increment of load are means
over the mesh cycle, in the transverse plane of action from the middle of the common face towards +z.

Over the mesh cycle the load shuttles, most with helical teeth, and the increment of load shuttles differently: c(pmc)
and w(pmc) are load centroid and tangent load centroid relative to their means. Through w the deflection under a
constant load depends on the misalignment, and the moment on the load: F w + F0 (c - w), which at F0 equals the moment
of the contact. The latter part depends only on the cycle, in the potential -F0 (c - w) (g - g0). While both change,
teeth absorb or supply the power (F w' + F0 (c' - w')) (g - g0) dpmc/dt, as they do while the stiffness changes. Dampers
act along the mean lever arm zt.

Meshes of equal planets share one contact, at their mean: as the carrier rotates each of them passes all positions, and
separate contacts would be an asymmetry that rotates with the carrier.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fe_ste.contact.kinematics import ContactError
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.transmission_error.mean_contact import POSITIONS, MeanContact, contact_input, known_contacts
from fe_ste.transmission_error.table import TableInput

Samples = tuple[float, ...]


@dataclass(frozen=True)
class ContactCycle:
    """What of a contact changes over the mesh cycle, at equal steps from its beginning."""

    deflection: Samples
    """Static transmission error, m."""
    tangent_stiffness: Samples
    """N/m."""
    load_centroid: Samples
    tangent_load_centroid: Samples
    """Of the load, and of the load that a small additional deflection adds, m."""


@dataclass(frozen=True)
class MeshContactState:
    """Contact of a mesh at one load and misalignment, as mean over the mesh cycle.

    Examples
    --------
    >>> state = MeshContactState(50e3, 20e-6, 2.6e9, 1e-4, -2e-3, -1.9e-3, 2e5)
    >>> state.seen_by(-1).load_centroid, state.seen_by(-1).misalignment
    (0.002, -0.0001)
    """

    force: float
    """Load F0 on the transverse line of action, N, positive."""
    deflection: float
    """Static transmission error at that load and misalignment, m."""
    tangent_stiffness: float
    """Change of the load with the deflection at that misalignment, N/m."""
    misalignment: float
    """g0, rad; it opens the gap at the +z end."""
    load_centroid: float
    """Zc, m."""
    tangent_load_centroid: float
    """Centre zt of the load that a little more deflection adds, m; also the change of the deflection with the
    misalignment under constant load, m/rad."""
    tilt_stiffness: float
    """kg: how much the load's moment falls with the misalignment while the load stays, N m/rad."""
    centre_distance: float = 0.0
    deflection_by_distance: float = 0.0
    """a0 (m), and sa: change of the deflection with the centre distance under constant load."""
    cycle: ContactCycle | None = None
    """Variation over the mesh cycle, if known."""

    def seen_by(self, flank: int) -> MeshContactState:
        """Take the state from the axes of a table to those of a mesh with this flank, or back.

        The flank -1 is that of the table turned about the line of centres: the ends of the face change places.
        """
        cycle = self.cycle
        if cycle is not None:
            centres = (
                tuple(flank * centre for centre in own) for own in (cycle.load_centroid, cycle.tangent_load_centroid)
            )
            cycle = ContactCycle(cycle.deflection, cycle.tangent_stiffness, *centres)
        return replace(
            self,
            misalignment=flank * self.misalignment,
            load_centroid=flank * self.load_centroid,
            tangent_load_centroid=flank * self.tangent_load_centroid,
            cycle=cycle,
        )


def changed_over_cycle(known: Floats, samples: Samples) -> Floats:
    """Give what is known finely over the mesh cycle the changes that were found at some positions of it.

    Their difference has no more harmonics than these positions can tell apart, and no mean: finer harmonics stay those
    that are known.

    Parameters
    ----------
    known : (n,) at pmc = 0, 1/n, ..
    found : tuple of k floats
        At pmc = 0, 1/k, ...

    Returns
    -------
    (n,) with the mean of `known`

    Examples
    --------
    >>> cycle = 2.0 * np.pi * np.arange(20) / 20
    >>> fine = 3.0 + np.cos(7 * cycle)
    >>> found = tuple(fine[::2] + 0.5 + np.cos(2 * cycle[::2]))
    >>> np.allclose(changed_over_cycle(fine, found), fine + np.cos(2 * cycle))
    True
    """
    count = len(samples)
    size = len(known)
    there = np.interp(np.arange(count) / count, np.arange(size) / size, known, period=1.0)
    spectrum = np.fft.rfft(np.array(samples) - there) / count
    spectrum[0] = 0.0
    spectrum[(count + 1) // 2 :] = 0.0
    return np.asarray(known + size * np.fft.irfft(spectrum, size))


def even_contact(pair: GearPair, force: float, stiffness: float, tangent_stiffness: float) -> MeshContactState:
    """Return the contact of teeth of uniform stiffness and even load along the common face, so that kg = k b^2 / 12.

    Parameters
    ----------
    force : N
    stiffness, tangent_stiffness
        Load over deflection, and the slope of the load, which resists a tilt at constant load, N/m.
    """
    tilt_stiffness = tangent_stiffness * pair.face_width**2 / 12.0
    return MeshContactState(force, force / stiffness, tangent_stiffness, 0.0, 0.0, 0.0, tilt_stiffness)


# Contact of meshes at the places where their gears stand under the static load, by finite elements


@dataclass(frozen=True)
class MeshPlace:
    """Static position of the gears of a mesh, in the axes of its pair's table."""

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
    def states(self) -> dict[str, MeshContactState]:
        """Values for the mesh model, by mesh, in the axes of the pairs' tables."""
        return {name: contact_state(contact) for name, contact in self.contacts.items()}

    @property
    def remarks(self) -> tuple[str, ...]:
        """Say of which meshes there is none, why, and what they do instead."""
        return tuple(
            f"mesh {name}: no contact solution at its static misalignment ({why}); tilting stiffness of an even load "
            "distribution along the face width is used"
            for name, why in self.unsolved.items()
        )

    @property
    def description(self) -> str:
        """What resists misalignment, for files."""
        words = []
        if self.contacts:
            words.append(f"finite elements at the static misalignment: {', '.join(self.contacts)}")
        if self.unsolved:
            words.append(f"even load distribution, contact not converged: {', '.join(self.unsolved)}")
        return "; ".join(words) or "from the mesh model alone"


def static_contacts(places: Mapping[str, MeshPlace], positions: int = POSITIONS) -> StaticContacts:
    """Solve the contact of meshes at the positions of their gears.

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
            unsolved[name] = "no torque"
    solved = dict(zip(wanted, known_contacts(list(wanted.values())), strict=True))
    unsolved |= {name: str(found) for name, found in solved.items() if isinstance(found, ContactError)}
    contacts = {name: found for name, found in solved.items() if isinstance(found, MeanContact)}
    return StaticContacts(
        {mesh: contacts[place.group] for mesh, place in places.items() if place.group in contacts},
        {mesh: unsolved[place.group] for mesh, place in places.items() if place.group in unsolved},
    )


def contact_state(contact: MeanContact) -> MeshContactState:
    """Return the values of a contact for a mesh model: at the middle of its misalignments, equal for nearby states."""
    middle = float(contact.misalignment.mean())
    deflection, stiffness, centre, tangent_centre = (
        float(contact.at(values, middle))
        for values in (contact.deflection, contact.stiffness, contact.load_centroid, contact.tangent_load_centroid)
    )
    over_cycle = (
        contact.cycle_deflection,
        contact.cycle_stiffness,
        contact.cycle_load_centroid,
        contact.cycle_tangent_load_centroid,
    )
    return MeshContactState(
        force=contact.force,
        deflection=deflection,
        tangent_stiffness=stiffness,
        misalignment=middle,
        load_centroid=centre,
        tangent_load_centroid=tangent_centre,
        tilt_stiffness=contact.tilt_stiffness,
        centre_distance=contact.centre_distance,
        deflection_by_distance=contact.deflection_by_distance,
        cycle=ContactCycle(*(tuple(contact.at(values, middle).tolist()) for values in over_cycle)),
    )


# What meshes bear under the static load: how they stand, and how evenly and hard teeth press by finite elements

DUTY_POSITIONS = 10
"""Positions of the mesh cycle over which the load along the face is averaged: with five it is up to 6 % too uneven,
with ten by 1 %."""


@dataclass(frozen=True)
class MeshLoadState(ReprMixin):
    """A mesh under the static load."""

    name: str
    force: float
    """On the transverse line of action, N; positive, the flank that the static load presses pushes."""
    misalignment: float
    opening: float
    """Of the gears, opening the gap at the +z end, rad; over the common face, m."""
    centre_distance_change: float
    """Axes further apart than nominal, m."""
    load_centroid: float = math.nan
    """Axial position of the resultant from the middle of the common face, m; NaN where no contact was solved."""
    face_load_factor: float = math.nan
    """K_Hbeta: highest over mean line load along the face; NaN likewise."""
    pressure: float = math.nan
    """sigma_H: largest of the mesh cycle within the path of contact, Pa; NaN likewise."""
    remark: str = ""
    """Why no contact was solved; empty where it was."""

    def _line(self) -> str:
        return f" of {self.name!r}: gap {1e6 * self.opening:.3g} µm, K_Hbeta {self.face_load_factor:.3g}"


def with_contact(duty: MeshLoadState, place: MeshPlace | None, flank: int) -> MeshLoadState:
    """Add the results of finite-element contact to a mesh.

    Parameters
    ----------
    place : position of its gears, if contact can be solved
    flank : loaded flank of gear 1: the table's frame is that of +1
    """
    if place is None:
        return duty
    solved = static_contacts({duty.name: place}, DUTY_POSITIONS)
    if duty.name in solved.unsolved:
        return replace(duty, remark=solved.unsolved[duty.name])
    contact = solved.contacts[duty.name]
    centre, factor, pressure = (
        float(contact.at(values, place.misalignment))
        for values in (contact.load_centroid, contact.face_load_factor, contact.contact_stress)
    )
    return replace(duty, load_centroid=flank * centre, face_load_factor=factor, pressure=pressure)
