"""What the finite elements say beside the standard: of a stored life, or under the nominal load by tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.loads import RatingSection
from exugear.life.acting_loads import acting_loads
from exugear.life.dynamic_factors.dynamic_factor import stated_factors
from exugear.life.gear_life import flank_lives
from exugear.life.load_spectrum.counted import CountedLoads
from exugear.life.static_balance import StaticBalance
from fe_ste.root_stress.mesh_cycle import MeshCycleStress

if TYPE_CHECKING:
    import xarray as xr

_NAMES = {
    "sigma_H": "contact_stress",
    "sigma_F": "root_stress",
    "K_Hbeta": "face_load",
    "S_H": "contact_safety",
    "S_F": "root_safety",
}
"""Figures of a life by the symbols of a sheet."""
FlankKey = tuple[str, str, str]
"""Gear, family of meshes and flank."""


def of_life(data: xr.Dataset) -> dict[FlankKey, dict[str, float]]:
    """Figures of all flanks of a stored life."""
    found = {}
    for place, label in enumerate(data["flank"].to_numpy().tolist()):
        gear, flank, family = label.split(" ", 2)
        figures = {name: float(data[f"flank_{figure}"][place]) for name, figure in _NAMES.items()}
        found[gear, family, flank] = figures
    return found


def of_nominal_load(
    gearbox: Gearbox,
    rating: RatingSection,
    counted: CountedLoads,
    balance: StaticBalance,
    stresses: Mapping[str, MeshCycleStress],
) -> dict[FlankKey, dict[str, float]]:
    """Figures of the flanks of pairs with stresses under the nominal load with K_A, which acts on its torque.

    Parameters
    ----------
    counted : the nominal load times K_A
    stresses : by pair name
    """
    dynamic = stated_factors(gearbox, rating.dynamic_factor or rating.least_dynamic_factor or 1.0)
    lives = flank_lives(gearbox, rating, counted.teeth, acting_loads(counted), balance, stresses, dynamic)
    return {
        (life.gear, life.family, life.flank): {name: float(getattr(life, figure)) for name, figure in _NAMES.items()}
        for life in lives
    }


def remarks_on(stresses: Mapping[str, MeshCycleStress]) -> list[str]:
    """Say of which gears that stand aligned the finite elements are."""
    straight = [name for name, stress in stresses.items() if len(stress.misalignment) < 2]
    if straight:
        return [f"sigma and K_Hbeta by finite elements of {', '.join(straight)} are of aligned gears"]
    return []
