"""Ratings of the gears: stored lives under the load spectrum, and the rating sheet to ISO 6336."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.variant import VariantError
from exugear.life.life_file import stored_lives
from exugear.life.rating.sheet import RatingSheet, balanced, life_results, rated, rated_as, rated_loads
from exugear.report.findings.context import Context
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.placement import MeshError

if TYPE_CHECKING:
    import xarray as xr

SAFETY_FACTORS = ("S_H", "S_F")


@dataclass(frozen=True, eq=False)
class Ratings:
    """Ratings of a gearbox."""

    lives: tuple[xr.Dataset, ...] = ()
    """Stored results of `exugear life` that belong to the gearbox file."""
    sheet: RatingSheet | None = None
    """Rating sheet as of ``exugear check --rating``; None if the file lacks data for it."""

    def safety_factors(self, family: str) -> dict[str, float]:
        """Smallest S_H and S_F of both gears of a family of meshes; empty if they are not rated.

        The finite element contact of `exugear life` counts, and the standard's values if there is none.
        """
        if self.sheet is None:
            return {}
        flanks = [flank for flank in self.sheet.flanks if flank.family == family]
        known = {
            name: [value for flank in flanks if (value := {**flank.standard, **flank.finite_elements}.get(name))]
            for name in SAFETY_FACTORS
        }
        return {name: min(values) for name, values in known.items() if values}


def ratings_of(context: Context) -> Ratings:
    """Read the stored lives of a results folder, and compute the rating sheet; notes say what is left out."""
    gearbox = context.gearbox
    lives = []
    if gearbox.case.loads is not None:
        for stored in stored_lives(gearbox, context.folder, context.assembled):
            if stored.data is None:
                context.leave_out(stored.path, stored.reason)
            else:
                lives.append(stored.data)
    if gearbox.case.rating is None:
        return Ratings(tuple(lives))
    try:
        counted = rated_loads(gearbox)
        balance = balanced(context.assembled(rated_as(gearbox).of(gearbox)), counted)
    except (GearboxFileError, BalanceError, VariantError, MeshError, BearingError) as error:
        context.notes.left_out.append(f"rating to ISO 6336: {error}")
        return Ratings(tuple(lives))
    finite_elements = life_results(lives[0]) if lives else {}
    return Ratings(tuple(lives), rated(gearbox, counted, balance, finite_elements))
