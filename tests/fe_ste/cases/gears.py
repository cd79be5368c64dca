"""Gears and pairs that several files test: small ones to mesh, a spur gear to change, and published test gears."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from fe_ste.geometry.gears import BasicRack, Gear, GearPair, Material

SPUR_20 = Gear(name="spur", teeth=20, normal_module=3e-3, face_width=20e-3, held_diameter=30e-3, profile_shift=0.2)
HELICAL_20 = dataclasses.replace(SPUR_20, name="helical", helix_angle=np.radians(-15.0))
HELICAL_12 = Gear(
    name="helical",
    teeth=12,
    normal_module=3e-3,
    helix_angle=np.radians(15.0),
    profile_shift=0.4,
    face_width=15e-3,
    held_diameter=16e-3,
)
"""The fewest teeth: quick to mesh all round."""
RING_60 = Gear(
    name="ring",
    teeth=60,
    normal_module=3e-3,
    helix_angle=np.radians(12.0),
    face_width=20e-3,
    held_diameter=210e-3,
    internal=True,
)

GEAR_30 = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
PAIR_30 = GearPair(name="pair", pinion=GEAR_30, gear=GEAR_30, centre_distance=90e-3)
SPUR_50 = Gear(name="spur", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
SPUR_PAIR = GearPair(name="spur", pinion=SPUR_50, gear=SPUR_50, centre_distance=150e-3)
HELICAL_PAIR = GearPair(
    name="helical",
    pinion=Gear(
        name="pinion",
        teeth=22,
        normal_module=3e-3,
        helix_angle=math.radians(14.0),
        profile_shift=0.3,
        face_width=30e-3,
        held_diameter=32e-3,
    ),
    gear=Gear(
        name="wheel",
        teeth=45,
        normal_module=3e-3,
        helix_angle=math.radians(-14.0),
        face_width=28e-3,
        held_diameter=80e-3,
    ),
    centre_distance=104.6e-3,
)


def spur(**changes: Any) -> Gear:
    """A spur gear of 50 teeth, module 3 mm, with changes."""
    values: dict[str, Any] = {
        "name": "wheel",
        "teeth": 50,
        "normal_module": 3e-3,
        "face_width": 20e-3,
        "held_diameter": 60e-3,
    }
    return Gear(**(values | changes))


def ring(**changes: Any) -> Gear:
    """An internal spur gear of 99 teeth, module 3 mm, with changes."""
    return spur(**({"name": "ring", "teeth": 99, "internal": True, "held_diameter": 0.36} | changes))


def pair(pinion: Gear, gear: Gear, centre_distance: float) -> GearPair:
    return GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=centre_distance)


def fzg_c() -> GearPair:
    """FZG-C test gears: the spur reference, z 16/24, m 4.5 mm, b 14 mm."""
    rack = BasicRack(addendum=1.0, dedendum=1.25, tip_radius=0.38)
    common = {"normal_module": 4.5e-3, "face_width": 14e-3, "held_diameter": 30e-3, "rack": rack}
    pinion = Gear(name="pinion", teeth=16, profile_shift=0.1817, tip_diameter=82.46e-3, **common)
    wheel = Gear(name="wheel", teeth=24, profile_shift=0.1715, tip_diameter=118.36e-3, **common)
    return GearPair(name="FZG-C", pinion=pinion, gear=wheel, centre_distance=91.5001e-3)


def nrel_stage_3(material: Material) -> GearPair:
    """Helical stage of the NREL 5 MW gearbox, whose rating sheet is published."""
    common: dict[str, Any] = {"normal_module": 14e-3, "face_width": 0.36, "material": material}
    pinion = Gear(
        name="1",
        teeth=24,
        profile_shift=0.48,
        helix_angle=math.radians(10.0),
        held_diameter=179.1e-3,
        tip_diameter=380.747e-3,
        **common,
    )
    wheel = Gear(
        name="2",
        teeth=95,
        profile_shift=0.6691,
        helix_angle=math.radians(-10.0),
        held_diameter=1193.32e-3,
        tip_diameter=1395.376e-3,
        **common,
    )
    return GearPair(name="stage 3", pinion=pinion, gear=wheel, centre_distance=0.861 + 1e-6)


def nrel_stage_1(material: Material) -> tuple[GearPair, GearPair]:
    """Planet with sun, and planet with ring, of the first stage of the NREL 5 MW gearbox.

    The rating sheet is published: KISSsoft report in gfsReboucas/Drivetrain, @NREL_5MW/stage_01.rtf; Nejad et al., Wind
    Energy 2016, 10.1002/we.1884.
    """
    common: dict[str, Any] = {"normal_module": 45e-3, "face_width": 0.491, "material": material}
    sun = Gear(name="sun", teeth=19, profile_shift=0.6170, held_diameter=482.33e-3, tip_diameter=978.808e-3, **common)
    planet = Gear(
        name="planet", teeth=17, profile_shift=0.8021, held_diameter=408.99e-3, tip_diameter=905.470e-3, **common
    )
    ring = Gear(
        name="ring",
        teeth=56,
        internal=True,
        profile_shift=0.5013,
        rack=BasicRack(tip_radius=0.30),
        held_diameter=2994.24e-3,
        tip_diameter=2475.118e-3,
        **common,
    )
    return (
        GearPair(name="sun", pinion=planet, gear=sun, centre_distance=0.863 + 1e-6),
        GearPair(name="ring", pinion=planet, gear=ring, centre_distance=0.863 - 1e-6),
    )
