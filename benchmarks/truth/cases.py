"""Gear pairs and positions at which the compliance of single gears is known, and the forces that act there."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fe_ste.contact.kinematics import Cells
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import BasicRack, Gear, GearPair
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
from fe_ste.transmission_error.search import contact_state

GEARBOX = Path(__file__).parents[2] / "cases" / "grc750" / "gearbox.toml"
"""Its gears are the large ones."""

TEETH = 5
"""Teeth of the open sector of each gear."""


def spur_pair() -> GearPair:
    """Two equal spur gears, 50 teeth, module 3 mm, 20 mm wide."""
    gear = Gear(name="spur", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    return GearPair(name="spur", pinion=gear, gear=gear, centre_distance=150e-3)


def thin_pair() -> GearPair:
    """Spur pair with rims of 1.4 modules under the roots."""
    pair = spur_pair()
    gear = replace(pair.pinion, held_diameter=134e-3)
    return replace(pair, pinion=gear, gear=gear)


def helical_pair() -> GearPair:
    """23/57 teeth, normal module 4 mm, 18 degrees, 40 mm wide."""
    helix, module = math.radians(18.0), 4e-3
    pinion = Gear(
        name="pinion", teeth=23, normal_module=module, helix_angle=helix, face_width=40e-3, held_diameter=60e-3
    )
    wheel = Gear(
        name="wheel", teeth=57, normal_module=module, helix_angle=-helix, face_width=40e-3, held_diameter=180e-3
    )
    return GearPair(name="helical", pinion=pinion, gear=wheel, centre_distance=40 * module / math.cos(helix))


def _grc_gear(name: str, face_width: float | None = None) -> Gear:
    with GEARBOX.open("rb") as file:
        row = tomllib.load(file)["gears"][name]
    return Gear(
        name=name,
        teeth=row["teeth"],
        normal_module=1e-3 * row["normal_module_mm"],
        helix_angle=math.radians(row["helix_angle_deg"]),
        profile_shift=row["profile_shift"],
        face_width=1e-3 * row["face_width_mm"] if face_width is None else face_width,
        held_diameter=1e-3 * row["held_diameter_mm"],
        internal=row.get("internal", False),
        rack=BasicRack(**row["rack"]),
        tooth_thinning=1e-3 * row["tooth_thinning_mm"],
    )


def internal_pair() -> GearPair:
    """Planet and ring of the GRC 750 gearbox (39/99), 60 mm wide."""
    return GearPair(
        name="internal", pinion=_grc_gear("planet", 60e-3), gear=_grc_gear("ring", 60e-3), centre_distance=308e-3
    )


def thin_ring_pair() -> GearPair:
    """Planet and ring as before, with a rim of 1.6 modules about the roots of the ring."""
    pair = internal_pair()
    return replace(pair, gear=replace(pair.gear, held_diameter=1080e-3))


def sun_planet() -> GearPair:
    """Sun and planet of the GRC 750 gearbox (21/39), 220 mm wide."""
    return GearPair(name="sun_planet", pinion=_grc_gear("sun"), gear=_grc_gear("planet"), centre_distance=308e-3)


def high_speed() -> GearPair:
    """High-speed stage of the GRC 750 gearbox (22/88), 110 mm wide."""
    return GearPair(name="high_speed", pinion=_grc_gear("hs_pinion"), gear=_grc_gear("hs_gear"), centre_distance=285e-3)


PAIRS = {
    "spur": (spur_pair, 340.0, (0.0, 0.5)),
    "helical": (helical_pair, 400.0, (0.2, 0.6)),
    "thin_rim": (thin_pair, 340.0, (0.0, 0.5)),
    "internal": (internal_pair, 10000.0, (0.0, 0.5)),
    "thin_ring": (thin_ring_pair, 10000.0, (0.0, 0.5)),
    "sun_planet": (sun_planet, 14000.0, (0.3,)),
    "high_speed": (high_speed, 2945.0, (0.3,)),
}
"""Pair, torque on gear 1 (N m) and positions in the mesh cycle."""


@dataclass(frozen=True)
class LoadCase:
    """Forces on the contact cells of a pair at one position.

    Attributes
    ----------
    pair : GearPair
    pmc : float
    cells : Cells
        Those that carry force.
    force : ndarray (n,)
        N.
    axial : ndarray (slices,)
        Middle of the slices, m.
    """

    pair: GearPair
    pmc: float
    cells: Cells
    force: Floats
    axial: Floats

    def on_gear(self, number: int) -> tuple[Gear, int, Floats, Integers]:
        """Gear 0 or 1, its loaded side, the roll angle and the number of the gear's tooth of each cell."""
        if number == 0:
            return self.pair.pinion, 1, self.cells.roll, self.cells.tooth
        gear = self.pair.gear
        if gear.internal:
            return gear, -1, self.cells.gear_roll, self.cells.tooth
        return gear, 1, self.cells.gear_roll, -self.cells.tooth

    @property
    def half_along(self) -> float:
        """Half length of the cells along the contact lines, m."""
        return float(0.5 * (self.axial[1] - self.axial[0]) / math.cos(self.pair.pinion.base_helix_angle))


def solved(pair: GearPair, torque: float, pmc: float, compliance: PairCompliance | None = None) -> LoadCase:
    """Solve one position of the closed rings for its forces."""
    compliance = compliance or pair_compliance(pair, MeshSettings())
    state = contact_state(compliance, torque, pmc)
    loaded = state.solution.force > 0.0
    return LoadCase(pair, pmc, state.cells.select(loaded), state.solution.force[loaded], np.asarray(compliance.axial))
