"""What all catalogue bearings and all meshes of a gearbox bear under its static load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from exugear.gearbox.parts import Bearing
from exugear.system.assembly import Assembly
from exugear.system.bearings.duty import BearingDuty, duty_of
from exugear.system.bearings.operating_point import OperatingPoint, operating_point
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.contact import equilibrium
from exugear.system.bearings.rolling.rows import BearingOfRows
from exugear.system.bearings.support_laws import catalogue_stiffness
from exugear.system.operating_points import contact_places
from exugear.system.statics import static_state
from exugear.system.tooth_mesh.mesh_duty import MeshDuty, with_contact
from fe_ste.tools.arrays import Floats


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
            found.append(_stated_point(support))
    return tuple(found)


def _stated_point(bearing: Bearing) -> OperatingPoint:
    """Operating point of a bearing whose load the file states: along x, the stiffness the same in all directions."""
    assert bearing.catalogue is not None and bearing.catalogue.radial_load_kN is not None
    force = (1e3 * bearing.catalogue.radial_load_kN, 0.0, 1e3 * (bearing.catalogue.axial_load_kN or 0.0))
    displacement = equilibrium(BearingOfRows(catalogue_rows(bearing.catalogue)), force).displacement
    return replace(operating_point(bearing, displacement, False), stiffness=catalogue_stiffness(bearing.catalogue))


def bearing_duties(assembly: Assembly) -> tuple[BearingDuty, ...]:
    """Find what all catalogue bearings of an assembly bear under the static load of its gearbox file.

    Raises
    ------
    BalanceError
        The static load cannot be held.
    BearingError
        A stated load that a bearing cannot hold.
    """
    points = bearing_points(assembly)
    reactions = reaction_loads(assembly) if any(is_stated(point.bearing) for point in points) else {}
    return tuple(
        duty_of(point, reactions.get(point.bearing.name) if is_stated(point.bearing) else None) for point in points
    )


def is_stated(bearing: Bearing) -> bool:
    """Tell whether the file states a bearing's load."""
    return bearing.catalogue is not None and bearing.catalogue.radial_load_kN is not None


def reaction_loads(assembly: Assembly) -> dict[str, Floats]:
    """Force and moment (6,) of each bearing on its body by name, under the static load, N and N m."""
    state = static_state(assembly)
    loads = state.assembly.bearing_loads(state.q, np.zeros_like(state.q))
    return dict(zip(assembly.connector_names, loads, strict=True))


def mesh_duties(assembly: Assembly) -> tuple[MeshDuty, ...]:
    """Find how the gears of all meshes stand under the static load, and how evenly their teeth bear there.

    Each mesh has its own contact here, over more of the mesh cycle than its law needs.

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
        duty = MeshDuty(
            name=mesh.name,
            force=float(force),
            misalignment=float(misalignment),
            opening=float(misalignment) * mesh.pair.face_width,
            centre_distance_change=float(distance) - mesh.centre_distance,
        )
        duties.append(with_contact(duty, places.get(mesh.name), element.flank))
    return tuple(duties)
