"""Catalogue bearings at their operating loads: the static state with the nonlinear model of their rows.

A bearing's stiffness depends on its load, and the load on the stiffness of all bearings. The static state is solved
with the nonlinear model of every row, so that load and stiffness are consistent to round-off. The problem is convex.

The search starts from the nominal stiffness of each bearing, which is that at the share `NOMINAL_LOAD` of its basic
dynamic rating (`exugear.system.bearings.stiffness`). The static state is solved twice, because the rolling elements of
a cage that stands still are placed by the direction of the load: first as for loads along x, then for the loads found.
The second state gives the operating points. In static states bearings keep their rows. In motion a linear bearing has
the tangent of its rows at the operating point and passes through it, so that its static state is the same.

In motion the mean over the revolution of each carrier is relevant, which equal planets give at a single angle: bearings
of planets get the mean of their set. Planets with unequal pins or spacing are evaluated over the whole revolution.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Bearing, Body
from exugear.gearbox.sections.connections import CatalogueSection
from exugear.gearbox.units import optional_si, si
from exugear.system.bearings.duty import BearingLoadState, OperatingPoint, duty_of, operating_point
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.contact import bearing_load, equilibrium, row_contacts
from exugear.system.bearings.rolling.rows import BallRow, BearingOfRows
from exugear.system.bearings.stiffness import (
    PlanetSupports,
    SupportLaw,
    bearing_rows,
    catalogue_stiffness,
    equally_spaced,
    holds_one_way,
    is_catalogued,
    law_through_point,
    linear_law,
    load_stands_still,
    planet_families,
    planet_supports,
    rolling_law,
    with_equal_planets,
    with_laws,
)
from exugear.system.kernels.connectors import ConnectorArrays
from exugear.system.kernels.coordinates import BODY_SIZE, TILT
from exugear.system.kernels.meshes import FORCE
from exugear.system.part_warnings import shafts_on_one_bearing
from exugear.system.statics import BalanceError, locked_equilibrium, rolled_coordinates, static_state
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.contact_state import MeshLoadState, MeshPlace, static_contacts, with_contact
from fe_ste.tools.arrays import Floats

_log = logging.getLogger(__name__)
CARRIER_ANGLES = 8
"""Angles of a carrier over its turn, over which bearings are averaged where its planets are not equal."""
CONTACT_STEPS = 2
"""Steps between shafts and contact: a third one changes misalignments by less than a hundredth of an urad."""


class _SupportState(NamedTuple):
    """All supports in one static state; points only of those from a catalogue."""

    strain: Floats
    load: Floats
    """(supports, 6) displacement (m, rad) and load (N, N m), in the axes of what each sits on."""
    points: tuple[OperatingPoint | None, ...]
    """Operating points, None for supports that are not from a catalogue."""


def linearise_at_static_load(assembly: Assembly, like: Assembly | None = None) -> Assembly:
    """Give catalogue bearings of an assembly the laws that they have under the static load of the gearbox file.

    Parameters
    ----------
    assembly : one whose catalogue bearings have their nominal stiffness
    like : one of a similar gearbox, from whose static state the search begins if it has the same coordinates

    Returns
    -------
    Assembly
        With the operating points of its catalogue bearings. Those without `radial_load_kN` in the file follow their
        rows in static states. In motion linear ones have the stiffness of their operating point and pass through it,
        non-linear ones keep their rows.

    Raises
    ------
    BalanceError
        The static load cannot be held.
    """
    # The load distribution of teeth from finite-element contact at static gear positions.
    near = None
    even = assembly
    for _ in range(CONTACT_STEPS if contact_places(assembly, np.zeros(assembly.size)) else 0):
        near, _laws = _loaded_state(assembly, near)
        assembly = even.with_contacts(static_contacts(contact_places(assembly, near)))
    for remark in assembly.contacts.remarks:
        _log_warning(remark)
    if not any(is_catalogued(support) for support in assembly.supports):
        return assembly
    if near is None and like is not None and like.known_rest and like.coordinates == assembly.coordinates:
        near = like.known_rest[0]
    q, searched = _loaded_state(assembly, near)
    first_points = _points(assembly, searched, assembly.support_strains(q))
    at_rest, laws = _with_placed_rows(assembly, first_points)
    q = _balance(at_rest, laws, near=q)
    static = _state(at_rest, laws, q)
    # States over the turn of each carrier with unequal planets, from that at the angles zero.
    over_turns: dict[str, list[_SupportState]] = {}
    equal = _equal(at_rest)
    unequal = [planets for planets in planet_families(at_rest.bodies) if planets not in equal]
    for carrier in sorted({planets[0].carrier or "" for planets in unequal}):
        over_turns[carrier] = [static]
        for turn in 2.0 * math.pi / CARRIER_ANGLES * np.arange(1, CARRIER_ANGLES):
            about = rolled_coordinates(at_rest, carrier, float(turn))
            over_turns[carrier].append(_state(at_rest, laws, _balance(at_rest, laws, about)))
    in_motion, spread = _laws_in_motion(at_rest, laws, static, over_turns)
    linearised = replace(
        at_rest,
        connectors=in_motion,
        connectors_at_rest=at_rest.connectors,
        operating_points=static.points,
        planet_spread=spread,
    )
    linearised.known_rest.append(q)
    return linearised


@cache
def _log_warning(remark: str) -> None:
    """Say it once in a process, whoever asks for the assembly: most doors to it have no other way to."""
    _log.warning(remark)


def contact_places(assembly: Assembly, q: Floats) -> dict[str, MeshPlace]:
    """Places of the meshes whose contact can be solved, at a state at rest, in the axes of their tables."""
    positions = assembly.gear_positions(q)
    force = assembly.mesh_states(q, np.zeros_like(q), assembly.mean_meshes)[:, FORCE]
    equal = {planet.name for planets in _equal(assembly) for planet in planets}
    places = {}
    for number, element in enumerate(assembly.elements):
        mesh = element.mesh
        tilts = assembly.meshes.coordinates[number, [TILT, BODY_SIZE + TILT]]
        if element.computed_from is None or (tilts < 0).all():
            continue
        distance, misalignment = positions[number]
        together = mesh.pinion in equal or mesh.gear in equal
        places[mesh.name] = MeshPlace(
            table=element.computed_from,
            force=float(force[number]),
            misalignment=element.flank * float(misalignment),
            centre_distance=float(distance),
            group=mesh.family if together else mesh.name,
        )
    return places


def _loaded_state(assembly: Assembly, near: Floats | None = None) -> tuple[Floats, tuple[SupportLaw, ...]]:
    """Coordinates under the static load with the rows of all bearings whose load is looked for, and the laws there."""
    laws = tuple(
        _law_at_rest(support, catalogue_stiffness(support.catalogue), 0.0, 0.0)
        if support.catalogue is not None and is_catalogued(support)
        else linear_law(support, 0.0)
        for support in assembly.supports
    )
    nominal = [
        support.factor * catalogue_stiffness(support.catalogue) if is_catalogued(support) else np.zeros((6, 6))
        for support in assembly.supports
    ]
    searched = replace(
        assembly, connectors=with_laws(assembly.connectors, laws), rows_stiffness=np.array(nominal).reshape(-1, 6, 6)
    )
    return _balance(searched, laws, near=near), laws


def _balance(
    assembly: Assembly, laws: Sequence[SupportLaw], about: Floats | None = None, near: Floats | None = None
) -> Floats:
    """Coordinates under the static load, of the train rolled to `about`, from a state that is near it."""
    load = assembly.gearbox.case.static_load
    meshes = assembly.mean_meshes
    try:
        return locked_equilibrium(assembly, load.torques_N_m, assembly.gearbox.locked, meshes, about, near=near)
    except BalanceError as error:
        unsupported = "; ".join(shafts_on_one_bearing(assembly.gearbox))
        hint = unsupported or _what_holds_one_way(laws, assembly.connector_names)
        raise BalanceError(f"{error}; {hint}") from None


def _law_at_rest(support: Bearing, of_rows: Floats, direction: float, damping_time: float) -> SupportLaw:
    """Law of a bearing's rows in static states, placed by the direction of its load.

    The seat of a bearing with clearance yields under load only: the share of a deflection that the bearing takes counts
    beyond the clearance.
    """
    law = rolling_law(support, damping_time, of_rows, direction)
    share = abs(law.scale)
    rows = tuple(
        replace(row, radial_clearance=share * row.radial_clearance) if row.radial_clearance > 0.0 else row
        for row in law.rows
    )
    return replace(law, rows=rows)


def _points(assembly: Assembly, laws: Sequence[SupportLaw], strains: Floats) -> tuple[OperatingPoint | None, ...]:
    """Operating points of catalogue bearings at the strains (supports, 6) of all supports."""
    bodies = _bodies(assembly)
    return tuple(
        _point(support, bodies, law, strain) if is_catalogued(support) else None
        for support, law, strain in zip(assembly.supports, laws, strains, strict=True)
    )


def _bodies(assembly: Assembly) -> dict[str, Body]:
    return {body.name: body for body in assembly.gearbox.bodies()}


def _point(support: Bearing, bodies: dict[str, Body], law: SupportLaw, strain: Floats) -> OperatingPoint:
    """Operating point of a bearing at the displacement of its body against what it sits on."""
    displacement = law.scale * strain
    rows = bearing_rows(support)
    if rows != law.rows:  # its seat yields, and it has clearance
        force = bearing_load(row_contacts(law.rows, law.phase), displacement)[:3]
        if force.any():
            tilt = displacement[3:5]
            angle = law.phase
            displacement = equilibrium(BearingOfRows(rows), force, tilt=tilt, first_roller_angle=angle).displacement
    return operating_point(support, displacement, load_stands_still(support, bodies), law.phase)


def _with_placed_rows(
    assembly: Assembly, points: Sequence[OperatingPoint | None]
) -> tuple[Assembly, tuple[SupportLaw, ...]]:
    """Assembly with the rows of all catalogue bearings, placed by their loads, and their laws."""
    time = assembly.gearbox.damping_times.bearing
    laws = tuple(
        linear_law(support, time) if point is None else _law_at_rest(support, point.stiffness, point.direction, time)
        for support, point in zip(assembly.supports, points, strict=True)
    )
    of_rows = [np.zeros((6, 6)) if point is None else point.bearing.factor * point.stiffness for point in points]
    connectors = with_laws(assembly.connectors, laws)
    connectors, _ = with_equal_planets(connectors, _equal_supports(assembly))
    placed = tuple(replace(law, phase=float(phase)) for law, phase in zip(laws, connectors.rolling.phase, strict=True))
    return replace(assembly, connectors=connectors, rows_stiffness=np.array(of_rows)), placed


def _state(assembly: Assembly, laws: Sequence[SupportLaw], q: Floats) -> _SupportState:
    strain = assembly.support_strains(q)
    return _SupportState(strain, assembly.support_loads_at_rest(q), _points(assembly, laws, strain))


def _laws_in_motion(
    assembly: Assembly, laws: Sequence[SupportLaw], static: _SupportState, over_turns: dict[str, list[_SupportState]]
) -> tuple[ConnectorArrays, float]:
    """Connectors with the laws of motion, and the largest relative change of stiffness that made planets equal."""
    bodies = _bodies(assembly)
    time = assembly.gearbox.damping_times.bearing
    all_around = [state for states in over_turns.values() for state in states] or [static]
    equal = {planet.name for planets in _equal(assembly) for planet in planets}
    found = []
    for n, (support, law) in enumerate(zip(assembly.supports, laws, strict=True)):
        if not is_catalogued(support) or support.model == "iso16281":
            found.append(law)
            continue
        states = [static] if support.body in equal else over_turns.get(bodies[support.body].carrier or "", all_around)
        points = [state.points[n] for state in states]
        of_rows = np.mean([point.stiffness for point in points if point is not None], axis=0)
        strain, load = np.mean([(state.strain[n], state.load[n]) for state in states], axis=0)
        linear = linear_law(support, time, of_rows)
        found.append(law_through_point(linear, strain, load, load_stands_still(support, bodies)))
    return with_equal_planets(with_laws(assembly.connectors, found), _equal_supports(assembly))


def _equal(assembly: Assembly) -> list[list[Body]]:
    """Planet sets whose planets pass the same loads, one after the other."""
    if assembly.gearbox.pin_offsets:
        return []
    return [planets for planets in planet_families(assembly.bodies) if equally_spaced(planets)]


def _equal_supports(assembly: Assembly) -> list[PlanetSupports]:
    """Catalogue bearings of equal planets."""
    found = []
    for planets in _equal(assembly):
        names = [planet.name for planet in planets]
        angles = np.array([planet.orbit_angle for planet in planets])
        found += planet_supports(assembly.supports, names, angles)
    return [point for point in found if all(is_catalogued(assembly.supports[n]) for n in point.numbers)]


def _what_holds_one_way(laws: Sequence[SupportLaw], names: Sequence[str]) -> str:
    """Say which bearings hold their ring in one direction along the axis only."""
    one_way = [name for name, law in zip(names, laws, strict=True) if law.rows and holds_one_way(law.rows)]
    if not one_way:
        return "check for a body supported only through clearances"
    return f"{', '.join(one_way)}: located axially in one direction only; check arrangements and `locates_towards`"


def bearing_points(assembly: Assembly) -> tuple[OperatingPoint, ...]:
    """Operating points of all catalogue bearings; those with a load in the file are taken at that load.

    Raises
    ------
    BearingError
        A stated load that the bearing cannot hold.
    """
    points = assembly.operating_points or (None,) * len(assembly.supports)
    found = []
    for support, point in zip(assembly.supports, points, strict=True):
        if point is not None:
            found.append(point)
        elif support.catalogue is not None:
            displacement = _stated_displacement(support.catalogue)
            found.append(
                replace(operating_point(support, displacement, False), stiffness=catalogue_stiffness(support.catalogue))
            )
    return tuple(found)


@lru_cache(maxsize=64)
def _stated_displacement(section: CatalogueSection) -> Floats:
    """Displacement (6,) of a bearing under the load that the file states."""
    force = (si(section, "radial_load_kN"), 0.0, optional_si(section, "axial_load_kN") or 0.0)
    return equilibrium(BearingOfRows(catalogue_rows(section)), force).displacement


def bearing_duties(assembly: Assembly, one_of_a_set: bool = False) -> tuple[BearingLoadState, ...]:
    """Find what all catalogue bearings of an assembly bear under the static load of its gearbox file.

    Parameters
    ----------
    one_of_a_set : whether the bearings of the first planet of a set stand for those of the others

    Raises
    ------
    BalanceError
        The static load cannot be held.
    BearingError
        A stated load that a bearing cannot hold.
    """
    points: Iterable[OperatingPoint] = bearing_points(assembly)
    if one_of_a_set:
        points = {point.bearing.family: point for point in reversed(tuple(points))}.values()
        points = tuple(points)[::-1]
    reactions = reaction_loads(assembly) if any(is_stated(point.bearing) for point in points) else {}
    opposed = opposed_bearings(assembly.gearbox)
    return tuple(
        duty_of(
            point,
            reactions.get(point.bearing.name) if is_stated(point.bearing) else None,
            is_opposed=point.bearing.name in opposed,
        )
        for point in points
    )


def opposed_bearings(gearbox: Gearbox) -> tuple[str, ...]:
    """Return the bearings that locate in one axial direction, and whose body another one locates in the opposite one.

    Single tapered or angular contact bearings in X or O arrangement are opposed to each other.

    Examples
    --------
    >>> opposed_bearings(Gearbox.from_toml("cases/grc750/gearbox.toml"))
    ()
    """
    found = []
    for bearing in gearbox.bearings:
        seats = (bearing.body, bearing.on, bearing.carries_outer_ring)
        located = _located_directions(bearing)
        beside = [one for one in gearbox.bearings if (one.body, one.on, one.carries_outer_ring) == seats]
        if len(located) == 1 and any(_located_directions(one) - located for one in beside):
            found.append(bearing.name)
    return tuple(found)


def _located_directions(bearing: Bearing) -> set[float]:
    """Signs along z of the axial loads on the inner ring that a bearing carries."""
    if bearing.catalogue is None:
        return {-1.0, 1.0} if linear_law(bearing, 0.0).stiffness[2, 2] > 0.0 else set()
    rows = bearing_rows(bearing)
    if any(isinstance(row, BallRow) and row.contact_angle == 0.0 for row in rows):
        return {-1.0, 1.0}
    return {math.copysign(1.0, row.contact_angle) for row in rows if row.contact_angle != 0.0}


def is_stated(bearing: Bearing) -> bool:
    """Return whether the file states a bearing's load."""
    return bearing.catalogue is not None and bearing.catalogue.radial_load_kN is not None


def reaction_loads(assembly: Assembly) -> dict[str, Floats]:
    """Force and moment (6,) of each bearing on its body by name, under the static load, N and N m."""
    state = static_state(assembly)
    loads = state.assembly.bearing_loads(state.q, np.zeros_like(state.q))
    return dict(zip(assembly.connector_names, loads, strict=True))


def mesh_duties(assembly: Assembly) -> tuple[MeshLoadState, ...]:
    """Return the positions of the gears of all meshes under the static load, and the load distribution of their teeth.

    Each mesh has its own contact here, at more positions of the mesh cycle than its mesh model needs.

    Raises
    ------
    BalanceError
        The static load cannot be held.
    """
    state = static_state(assembly)
    places = contact_places(state.assembly, state.q)
    duties = []
    for element, (distance, misalignment), force in zip(
        assembly.elements, state.assembly.gear_positions(state.q), state.mesh_force, strict=True
    ):
        mesh = element.mesh
        duty = MeshLoadState(
            name=mesh.name,
            force=float(force),
            misalignment=float(misalignment),
            opening=float(misalignment) * mesh.pair.face_width,
            centre_distance_change=float(distance) - mesh.centre_distance,
        )
        duties.append(with_contact(duty, places.get(mesh.name), element.flank))
    return tuple(duties)
