"""All parts of a gearbox built once, as far as that is quick: what a later step refuses is told before it begins."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases.torque_series import torque_series
from exugear.gearbox.parts import Bearing
from exugear.gearbox.reading import CaseError, fault_line, readable
from exugear.gearbox.variant import Variant
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.bearings.support_laws import linear_law, misplaced_factor
from exugear.system.bearings.supports import elastic_names, unsupported
from exugear.system.readiness.margins import doubts_about_pairs
from exugear.system.readiness.plausibility import doubts_about_parts
from exugear.system.readiness.restraint import free_motion
from exugear.system.tooth_mesh.placement import MeshError, loaded_flanks, tooth_places

MOST_STATES = 200_000
"""Most states of one table: at 50 ms each, three hours."""
_FOLLOWING = range(5)
"""As many values as an axis usually has that follows from the static state."""


def check_parts(gearbox: Gearbox) -> None:
    """Build what tables, modes and runs are made of, but no mesh of finite elements.

    Raises
    ------
    CaseError
        All that is wrong: bearings, teeth that do not fit, shapes and solids with their seats, axes of tables, series.
    """
    families = {bearing.family: bearing for bearing in gearbox.bearings}
    attempts: list[Callable[[], object]] = [partial(_build_bearing, gearbox, bearing) for bearing in families.values()]
    attempts += [partial(_place_teeth, gearbox), partial(_count_states, gearbox)]
    attempts += [partial(gearbox.table_distances, name) for name in _pairs_with_axes(gearbox)]
    attempts += [partial(torque_series, gearbox, case) for case in gearbox.load_cases.values()]
    attempts += [partial(_build_elastic_body, gearbox, name) for name in elastic_names(gearbox)]
    faults: list[str] = []
    for attempt in attempts:
        try:
            attempt()
        except CaseError as error:
            faults += error.faults
    if faults:
        raise CaseError(*faults)


def faults_of_bearings(content: Mapping[str, Any], source: str) -> Iterator[str]:
    """Tell rolling bearings whose data do not fit, in content that may have other faults."""
    for name, section in readable(content).bearings.items():
        if section.catalogue is not None:
            try:
                catalogue_rows(section.catalogue)
            except BearingError as error:
                yield fault_line(source, f"bearings.{name}.catalogue: {error}")


def lacking(gearbox: Gearbox, variant: str) -> str:
    """Say why a variant cannot be built or moves without resistance; empty if it can.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [lacking(gearbox, variant) for variant in ("rigid", "bushing", "flexible")]
    ['', '', '']
    """
    chosen = Variant.of(variant)
    lack = unsupported(gearbox, variant)
    if lack or not chosen.on_bearings:
        return lack
    return _misfits(gearbox, chosen) or free_motion(gearbox, variant) or _misplaced_factors(gearbox, chosen)


def _misfits(gearbox: Gearbox, variant: Variant) -> str:
    """Say which elastic body cannot be, or has a seat beside it: the first fault that `check_parts` tells of them."""
    for name in elastic_names(gearbox) if variant.is_elastic else ():
        try:
            _build_elastic_body(gearbox, name)
        except CaseError as error:
            return error.faults[0].removeprefix(f"{gearbox.source}: ")
    return ""


def _misplaced_factors(gearbox: Gearbox, variant: Variant) -> str:
    """Say which bearing's seat no factor can stand for; an elastic housing has seats of its own."""
    elastic = elastic_names(gearbox) if variant.is_elastic else ()
    seats = {body.name for body in gearbox.bodies() if body.fixed and body.name in elastic}
    reasons = (misplaced_factor(bearing) for bearing in gearbox.bearings if not seats & {bearing.on, bearing.body})
    return next(filter(None, reasons), "")


def remarks(gearbox: Gearbox) -> tuple[str, ...]:
    """Tell what is possible and unusual, and how it is taken; a line each. Every verb tells the same."""
    lines = list(gearbox.warnings)
    lines += (
        f"pairs.{name}: carries no torque in [static_load], and so gets no table: its teeth are as stiff as "
        "ISO 6336-1 says, and excite nothing"
        for name in gearbox.idle_pairs
    )
    train = gearbox.train
    if train.degrees_of_freedom > 1:
        others = ", ".join(train.independent[1:])
        lines.append(
            f"meshes: the train has {train.degrees_of_freedom} degrees of freedom; ratio, orders and speeds of the "
            f"input hold while {others} stand{'s' if len(train.independent) == 2 else ''}"
        )
    lines += doubts_about_pairs(gearbox)
    lines += doubts_about_parts(gearbox)
    lines += _narrowed_seats(gearbox)
    return tuple(dict.fromkeys(lines))


def _narrowed_seats(gearbox: Gearbox) -> Iterator[str]:
    from exugear.system.bodies.of_gearbox.shafts import narrowed_seats

    for name in elastic_names(gearbox):
        if gearbox.case.bodies[gearbox.body(name).family].solid is None:
            yield from narrowed_seats(gearbox, name)


def _build_bearing(gearbox: Gearbox, bearing: Bearing) -> None:
    try:
        stiffness = linear_law(bearing, 0.0).stiffness
    except BearingError as error:
        raise gearbox.fault(f"bearings.{bearing.family}.catalogue: {error}") from None
    if not np.all(np.isfinite(stiffness)):
        raise gearbox.fault(f"bearings.{bearing.family}.catalogue: gives no finite stiffness; check its dimensions")


def _place_teeth(gearbox: Gearbox) -> None:
    try:
        tooth_places(gearbox, loaded_flanks(gearbox))
    except MeshError as error:
        raise gearbox.fault(str(error)) from None


def _count_states(gearbox: Gearbox) -> None:
    axes = gearbox.ste
    states = axes.positions * len(axes.torque_factors) * len(axes.centre_distance_offsets_um or _FOLLOWING)
    states *= len(axes.misalignment_um or _FOLLOWING)
    if states > MOST_STATES:
        raise gearbox.fault(f"ste: its axes make {states} states of a table; {MOST_STATES} are the most")


def _pairs_with_axes(gearbox: Gearbox) -> list[str]:
    """Pairs whose tables go over centre distances; none where nobody asked for these."""
    if gearbox.ste.centre_distance_offsets_um is None:
        return []
    at_work = {mesh.pair.name for mesh in gearbox.meshes}
    return [name for name, section in gearbox.case.pairs.items() if section.table or name in at_work]


def _build_elastic_body(gearbox: Gearbox, name: str) -> None:
    from exugear.system.bodies.of_gearbox.elastic_bodies import check_elastic_body

    check_elastic_body(gearbox, name)
