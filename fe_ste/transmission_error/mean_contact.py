"""Contact of a pair linearised about its operating state: means over the mesh cycle, and slopes by misalignment.

A table over load, centre distance and misalignment takes thousands of states. The static equilibrium of shafts and
bearings, and mesh models of the variation over the mesh cycle, need forty-five: some positions of the cycle at two
misalignments on either side of the actual one, and at a neighbouring centre distance. Between these everything is
linear. They lie on a lattice whose steps are small compared with tooth deflections, so that all states nearby share one
contact: equal planets, later steps of the same iteration, and slightly changed gearboxes.

The key is a hash of its whole input and of the versions of the method.
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from fe_ste.contact.kinematics import ContactError, ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.stores import Arrays, Cache
from fe_ste.tools.threads import one_dense_thread, side_by_side
from fe_ste.tools.versions import MEAN_CONTACT
from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
from fe_ste.transmission_error.contact_stress import face_load_factor, largest_contact_stress, load_along_face
from fe_ste.transmission_error.states import StateAxes
from fe_ste.transmission_error.table import TableInput
from fe_ste.transmission_error.transmission_error import solve_positions

if TYPE_CHECKING:
    import xarray as xr

POSITIONS = 5
"""Positions of the mesh cycle for means: twice as many move the misalignment of a gearbox in balance by 0.4 %."""
FINER = 4
"""Factor on the number of positions for the variation over the mesh cycle.

With a factor of two the third harmonic of gears misaligned by a millirad is a fifth too high, the fourth 1.4 to 2
times.
"""
FORCE_STEP = 0.02
"""Step of the lattice in force, as a part of it: the slopes by force are those of the contact itself."""
OPENING_STEP = 0.05
"""Step of the lattice in misalignment: how far it opens the gap over the face, as a part of what teeth yield."""
DISTANCE_STEP = 5e-3
"""Step of the lattice in centre distance, in normal modules."""
DISTANCE_CHANGE = 0.02
"""Change of the centre distance, in normal modules, over which the slope by it is taken: towards more backlash."""
YIELDING = 14e9
"""Force per face width and deflection, Pa, of usual teeth (c' of ISO 6336-1): it sets steps, no result."""
_SHARED_PAIRS = 8


@dataclass(frozen=True, eq=False)
class MeanContact(ReprMixin):
    """Contact of a pair over its mesh cycle under one force, at two misalignments.

    Lengths and forces are along the transverse line of action. Arrays are over the misalignments.
    """

    force: float
    """N."""
    centre_distance: float
    """m."""
    misalignment: Floats
    """(2,) rad, rising; positive where it opens the gap at the +z end."""
    deflection: Floats
    """(2,) mean of the static transmission error, m."""
    stiffness: Floats
    """(2,) tangent stiffness: 1 / mean (d deflection / d force), N/m."""
    load_centroid: Floats
    """(2,) axial position of the resultant, m from the middle of the common face; mean under the constant force."""
    tangent_load_centroid: Floats
    """(2,) that of the incremental load, m: derivative of the deflection by the misalignment."""
    deflection_by_distance: float
    """Slope of the deflection by the centre distance under constant force, between both misalignments."""
    face_load_factor: Floats
    """(2,) K_Hbeta: maximum divided by mean line load along the face width."""
    contact_stress: Floats
    """(2,) largest of the cycle within the path of contact, Pa."""
    edge_pressure: Floats
    """(2,) largest of the cycle at tip edges, Pa."""
    axial: Floats
    """(k,) middle of the contact slices, m."""
    line_load: Floats
    """(2, k) of all tooth pairs together, mean of the cycle, N/m."""
    cycle_deflection: Floats
    cycle_stiffness: Floats
    cycle_load_centroid: Floats
    cycle_tangent_load_centroid: Floats
    """(2, n) static transmission error (m), force over deflection by a little more force (N/m), axial position of
    the resultant (m) and of that of a little more force (m) at n equal steps of the mesh cycle from its beginning."""

    def _line(self) -> str:
        low, high = 1e6 * self.misalignment
        return f": {self.force:.5g} N, misalignment {low:.4g} to {high:.4g} µrad"

    @property
    def tilt_stiffness(self) -> float:
        """Moment against misalignment under constant force, -force d load_centroid / d misalignment, N m/rad."""
        return float(-self.force * np.diff(self.load_centroid)[0] / np.diff(self.misalignment)[0])

    def at(self, values: Floats, misalignment: float) -> Floats:
        """One of the fields, (2,) or (2, k) or (2, n), at a misalignment (rad): on the straight line through both.

        Examples
        --------
        >>> two = np.array([0.0, 1.0])
        >>> contact = MeanContact(1.0, 1.0, 1e-5 * two, *[two] * 14)
        >>> float(contact.at(contact.load_centroid, 5e-6))
        0.5
        """
        low, high = self.misalignment
        share = (misalignment - low) / (high - low)
        return np.asarray((1.0 - share) * values[0] + share * values[1])


def contact_input(
    table: TableInput, force: float, misalignment: float, centre_distance: float, positions: int = POSITIONS
) -> TableInput:
    """Return the two states of the lattice between which a state lies.

    Parameters
    ----------
    table : of the pair: its modifications and discretisation
    force : on the transverse line of action, N, positive
    misalignment, centre_distance : rad, m

    Raises
    ------
    ValueError
        A force that is not positive, or a state that is not finite.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> wanted = contact_input(TableInput(pair=pair, torque=(100.0,)), 2000.0, 30e-6, 90.001e-3)
    >>> [round(1e6 * value, 1) for value in wanted.misalignment]
    [26.9, 44.8]
    """
    if not (math.isfinite(force) and force > 0.0 and math.isfinite(misalignment) and math.isfinite(centre_distance)):
        raise ValueError(
            f"force = {force} N, misalignment = {misalignment} rad, centre_distance = {centre_distance} m: a state of "
            "contact needs a positive force and finite numbers"
        )
    pair = table.pair
    node = (1.0 + FORCE_STEP) ** round(math.log(force) / math.log(1.0 + FORCE_STEP))
    step = OPENING_STEP * node / (YIELDING * pair.face_width**2)
    # Teeth that stand straight lie between two nodes, so that rounding cannot move them to others.
    below = math.floor(misalignment / step + 0.5) - 0.5
    apart = DISTANCE_STEP * pair.pinion.normal_module
    distance = pair.centre_distance + apart * round((centre_distance - pair.centre_distance) / apart)
    return replace(
        table,
        torque=(_rounded(node * pair.pinion.base_radius),),
        positions=positions,
        centre_distance=(_rounded(distance),),
        misalignment=(_rounded(below * step), _rounded((below + 1.0) * step)),
        static_torque=None,
    )


def _rounded(value: float) -> float:
    """Drop the digits that another machine's libraries may have otherwise."""
    return float(f"{value:.12g}")


def mean_contact(wanted: TableInput) -> MeanContact:
    """Solve the contact of a pair at two misalignments.

    Parameters
    ----------
    wanted : with one torque, one centre distance and two misalignments, as `contact_input` gives it

    Raises
    ------
    ContactError
        If the contact of a position could not be solved; the message says of which pair and why.
    """
    pair, (torque,), (distance,) = wanted.pair, wanted.torque, wanted.centre_distance
    compliance = _compliance(pair, wanted.mesh, wanted.contact)
    compliance = compliance.with_modifications(wanted.pinion_modification, wanted.gear_modification)
    axes = StateAxes.checked(pair, torque, FINER * wanted.positions, distance, wanted.misalignment)
    change = DISTANCE_CHANGE * pair.pinion.normal_module * (-1.0 if pair.gear.internal else 1.0)
    beside = replace(
        axes,
        positions=wanted.positions,
        centre_distance=axes.centre_distance + change,
        misalignment=axes.misalignment.mean(keepdims=True),
    )
    finer = _cycle(compliance, axes)
    other = _cycle(compliance, beside)
    data = finer.isel(pmc=slice(None, None, FINER))
    mean = data.mean("pmc")
    largest = data.max("pmc")
    return MeanContact(
        force=torque / pair.pinion.base_radius,
        centre_distance=distance,
        misalignment=np.array(wanted.misalignment),
        deflection=mean["ste"].to_numpy(),
        stiffness=1.0 / (1.0 / data["tangent_stiffness"]).mean("pmc").to_numpy(),
        load_centroid=mean["load_centroid"].to_numpy(),
        tangent_load_centroid=mean["tangent_load_centroid"].to_numpy(),
        deflection_by_distance=(float(other["ste"].mean()) - float(mean["ste"].mean())) / change,
        face_load_factor=face_load_factor(data).to_numpy(),
        contact_stress=largest_contact_stress(pair, finer).to_numpy(),
        edge_pressure=largest["edge_pressure"].to_numpy(),
        axial=data["axial_position"].to_numpy(),
        line_load=load_along_face(data).to_numpy(),
        cycle_deflection=finer["ste"].transpose("misalignment", "pmc").to_numpy(),
        cycle_stiffness=finer["tangent_stiffness"].transpose("misalignment", "pmc").to_numpy(),
        cycle_load_centroid=finer["load_centroid"].transpose("misalignment", "pmc").to_numpy(),
        cycle_tangent_load_centroid=finer["tangent_load_centroid"].transpose("misalignment", "pmc").to_numpy(),
    )


def states_of_contact(
    table: TableInput, force: float, misalignments: Sequence[float], centre_distance: float, positions: int
) -> xr.Dataset:
    """Solve the contact over the mesh cycle at one force and centre distance.

    Parameters
    ----------
    table : of the pair: its modifications and discretisation
    force : on the transverse line of action, N
    misalignments, centre_distance : rad, m
    positions : of the mesh cycle

    Returns
    -------
    over pmc and misalignment, as `fe_ste.transmission_error.transmission_error.static_transmission_error`

    Raises
    ------
    ContactError
        If the contact of a position could not be solved; the message says of which pair and why.
    """
    pair = table.pair
    compliance = _compliance(pair, table.mesh, table.contact)
    compliance = compliance.with_modifications(table.pinion_modification, table.gear_modification)
    torque = force * pair.pinion.base_radius
    return _cycle(compliance, StateAxes.checked(pair, torque, positions, centre_distance, misalignments))


def _cycle(compliance: PairCompliance, axes: StateAxes) -> xr.Dataset:
    """States over the mesh cycle, at one torque and one centre distance."""
    data = solve_positions(compliance, axes, range(axes.positions)).dataset(axes)
    if not bool(data["converged"].all()):
        raise ContactError(f"pair {compliance.pair.name}: {str(data.attrs['failures']).splitlines()[0]}")
    return data.isel(torque=0, centre_distance=0)


@lru_cache(maxsize=_SHARED_PAIRS)
def _compliance(pair: GearPair, mesh: MeshSettings, contact: ContactSettings) -> PairCompliance:
    return pair_compliance(pair, mesh, contact)


# Stored contacts about a state

#: Each takes 4 kB.
_contacts = Cache[MeanContact]("contact", in_memory=1000, in_files=20_000_000)
_progress: ContextVar[Callable[[int, int], None] | None] = ContextVar("_progress", default=None)


@contextmanager
def contacts_told(progress: Callable[[int, int], None]) -> Iterator[None]:
    """Report the contacts that are solved inside the context, at any depth of calls.

    Parameters
    ----------
    progress
        Called with the number of finished contacts, and of all that have to be solved. An exception that it raises,
        such as Ctrl-C, ends the work.
    """
    token = _progress.set(progress)
    try:
        yield
    finally:
        _progress.reset(token)


def known_contacts(wanted: Sequence[TableInput]) -> list[MeanContact | ContactError]:
    """Return contacts as `fe_ste.transmission_error.mean_contact.mean_contact` does, each solved at most once.

    Files are kept where `fe_ste.elasticity.flank.known_flanks` keeps its own; each is written when it is solved, so
    that a stopped computation resumes from there.

    Returns
    -------
    in the order requested; for a contact that could not be solved, the reason
    """
    keys = [hashlib.sha256(f"{MEAN_CONTACT} {one.hash}".encode()).hexdigest() for one in wanted]
    asked = dict(zip(keys, wanted, strict=True))
    stored = {key: _contacts.get(key, _unpacked) for key in asked}
    found: dict[str, MeanContact | ContactError] = {key: kept for key, kept in stored.items() if kept is not None}
    missing = [key for key in asked if key not in found]
    progress = _progress.get()

    def solve(key: str) -> MeanContact | ContactError:
        try:
            contact = mean_contact(asked[key])
        except ContactError as error:
            return error
        _contacts.keep(key, contact, vars(contact))
        return contact

    # Two at a time; between pairs of them the caller hears of it, and may end the work.
    with one_dense_thread():
        for first in range(0, len(missing), 2):
            if progress is not None:
                progress(first, len(missing))
            chosen = missing[first : first + 2]
            found |= dict(zip(chosen, side_by_side(solve, chosen), strict=True))
    if progress is not None and missing:
        progress(len(missing), len(missing))
    return [found[key] for key in keys]


def forget_contacts() -> None:
    """Drop all contacts from memory."""
    _contacts.forget()


def _unpacked(arrays: Arrays) -> MeanContact:
    """Contact from its fields."""
    values: dict[str, Any] = {field.name: arrays[field.name] for field in dataclasses.fields(MeanContact)}
    values |= {name: float(value) for name, value in values.items() if value.ndim == 0}
    return MeanContact(**values)
