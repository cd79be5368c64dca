"""Catalogue bearings at the loads that they really carry: the static state with the full law of their rows.

A bearing's stiffness depends on its load, and the load on the stiffness of all bearings. The static state is solved
with the non-linear law of every row, so that both belong to each other to round-off; a linear bearing then has the
tangent there. The problem is convex, and starts from the bearings' stiffness at a nominal load. A linear model's own
static state then shares loads a little otherwise, since tangents yield less than rows do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from exugear.bearings.operating_point import OperatingPoint, operating_point
from exugear.bearings.rolling.contact import bearing_load, equilibrium, row_contacts
from exugear.bearings.rolling.rows import BearingOfRows
from exugear.bearings.support_laws import (
    SupportLaw,
    bearing_rows,
    catalogue_stiffness,
    holds_one_way,
    is_catalogued,
    linear_law,
    rolling_law,
    with_laws,
)
from exugear.dynamics.assembly import Assembly
from exugear.dynamics.statics import BalanceError, static_state
from exugear.model.parts import Bearing
from fe_ste.tools.arrays import Floats


def at_static_load(assembly: Assembly) -> Assembly:
    """Give catalogue bearings of an assembly the laws that they have under the static load of the gearbox file.

    Parameters
    ----------
    assembly : Assembly
        One whose catalogue bearings have their nominal stiffness.

    Returns
    -------
    Assembly
        With the operating points of its catalogue bearings; those without `radial_load_kN` in the file have the
        stiffness there, non-linear ones keep their rows.

    Raises
    ------
    BalanceError
        The static load cannot be held.
    """
    if not any(is_catalogued(support) for support in assembly.supports):
        return assembly
    q, searched = _loaded_state(assembly)
    points = tuple(
        _point(assembly, support, law, strain) if is_catalogued(support) else None
        for support, law, strain in zip(assembly.supports, searched, assembly.support_strains(q), strict=True)
    )
    laws = [_final_law(assembly, support, point) for support, point in zip(assembly.supports, points, strict=True)]
    stiffness = [
        point.bearing.factor * point.stiffness if point is not None and law.rows else np.zeros((6, 6))
        for point, law in zip(points, laws, strict=True)
    ]
    return replace(
        assembly,
        connectors=with_laws(assembly.connectors, laws),
        rows_stiffness=np.array(stiffness),
        operating_points=points,
    )


def _loaded_state(assembly: Assembly) -> tuple[Floats, tuple[SupportLaw, ...]]:
    """Coordinates under the static load with the rows of all bearings whose load is looked for, and the laws there."""
    laws = tuple(
        _searched_law(support) if is_catalogued(support) else linear_law(support, 0.0) for support in assembly.supports
    )
    nominal = [
        support.factor * catalogue_stiffness(support.catalogue) if is_catalogued(support) else np.zeros((6, 6))
        for support in assembly.supports
    ]
    searched = replace(
        assembly, connectors=with_laws(assembly.connectors, laws), rows_stiffness=np.array(nominal).reshape(-1, 6, 6)
    )
    try:
        return static_state(searched).q, laws
    except BalanceError as error:
        raise BalanceError(f"{error}; {_what_holds_one_way(laws, assembly.connector_names)}") from None


def _searched_law(support: Bearing) -> SupportLaw:
    """Law of a bearing's rows for the search of its load.

    The seat of a bearing with clearance yields under load only: the share of a deflection that the bearing takes counts
    beyond the clearance.
    """
    assert support.catalogue is not None
    law = rolling_law(support, 0.0, catalogue_stiffness(support.catalogue), 0.0)
    share = abs(law.scale)
    rows = tuple(
        replace(row, radial_clearance=share * row.radial_clearance) if row.radial_clearance > 0.0 else row
        for row in law.rows
    )
    return replace(law, rows=rows)


def _point(assembly: Assembly, support: Bearing, law: SupportLaw, strain: Floats) -> OperatingPoint:
    """Operating point of a bearing at the displacement of its body against what it sits on."""
    displacement = law.scale * strain
    rows = bearing_rows(support)
    if rows != law.rows:  # its seat yields, and it has clearance
        force = bearing_load(row_contacts(law.rows, law.phase), displacement)[:3]
        if force.any():
            tilt, angle = displacement[3:5], law.phase
            displacement = equilibrium(BearingOfRows(rows), force, tilt=tilt, first_roller_angle=angle).displacement
    bodies = {body.name: body for body in assembly.gearbox.bodies()}
    sits_still = support.on not in bodies or bodies[support.on].fixed or bodies[support.body].carrier == support.on
    return operating_point(support, displacement, sits_still, law.phase)


def _final_law(assembly: Assembly, support: Bearing, point: OperatingPoint | None) -> SupportLaw:
    time = assembly.gearbox.case.damping.bearing_time_s
    if point is None:
        return linear_law(support, time)
    if support.law == "iso16281":
        return rolling_law(support, time, point.stiffness, point.direction)
    return linear_law(support, time, point.stiffness)


def _what_holds_one_way(laws: Sequence[SupportLaw], names: Sequence[str]) -> str:
    """Say which bearings hold their ring in one direction along the axis only."""
    one_way = [name for name, law in zip(names, laws, strict=True) if law.rows and holds_one_way(law.rows)]
    if not one_way:
        return "look for a body that only clearances hold"
    return f"{', '.join(one_way)}: held along the axis in one direction only; look at arrangements and `holds_towards`"
