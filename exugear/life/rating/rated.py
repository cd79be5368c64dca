"""From a gearbox file to its rating sheet: the loads of the file or the nominal one, balanced on bearings."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.variant import Variant
from exugear.life.acting_loads import acting_loads
from exugear.life.gear_life import check_strengths
from exugear.life.life import checked_loads, rating_of
from exugear.life.load_spectrum.counted import CountedLoads
from exugear.life.rating.beside import FlankKey
from exugear.life.rating.nominal import nominal_loads
from exugear.life.rating.sheet import RatingSheet, rating_sheet
from exugear.life.static_balance import StaticBalance, static_balance
from exugear.system.assembly import Assembly

RATED_AS = Choice(Variant.bushing, "iso6336")
"""Forces and misalignment of the standard: shafts on their bearings, teeth as stiff as ISO 6336-1 has them."""


def rated_loads(gearbox: Gearbox) -> CountedLoads:
    """Read the loads that gears are rated under: those of `[loads]`, or the static load at rated speed.

    Raises
    ------
    CaseError
        No section `[rating]`, loads that cannot be used, or strengths that do not fit the gears.
    """
    if gearbox.case.loads is not None:
        return checked_loads(gearbox)
    rating = rating_of(gearbox)
    counted = nominal_loads(gearbox, rating)
    check_strengths(gearbox, rating, counted.teeth, False)
    return counted


def balanced(
    assembly: Assembly, counted: CountedLoads, progress: Callable[[int, int], None] | None = None
) -> StaticBalance:
    """Solve the static balance of a gearbox as it is rated (`RATED_AS`), over the torques of its loads.

    Raises
    ------
    BalanceError
        A static state that is not held.
    """
    acting = acting_loads(counted)
    angles = rating_of(assembly.gearbox).carrier_angles
    return static_balance(assembly, counted.body, acting.torques, angles, progress, 0.5 * acting.hub_sizes)


def rated(
    gearbox: Gearbox,
    counted: CountedLoads,
    balance: StaticBalance,
    finite_elements: Mapping[FlankKey, Mapping[str, float]],
    remarks: tuple[str, ...] = (),
) -> RatingSheet:
    """Rating sheet of a gearbox.

    Parameters
    ----------
    counted : of `rated_loads`
    balance : of `balanced`
    finite_elements : (gear, family, flank) what stands beside the standard, see `exugear.life.rating.beside`
    remarks : what is to be said of that
    """
    return rating_sheet(gearbox, rating_of(gearbox), counted, acting_loads(counted), balance, finite_elements, remarks)
