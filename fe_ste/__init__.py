"""Static transmission error of gear pairs by three-dimensional finite elements and contact."""

from fe_ste.gears import BasicRack, Gear, GearPair, GeometryError, Material
from fe_ste.modifications import FlankModification, Relief, ReliefShape
from fe_ste.profile import ToothProfile, tooth_profile

__all__ = [
    "BasicRack",
    "FlankModification",
    "Gear",
    "GearPair",
    "GeometryError",
    "Material",
    "Relief",
    "ReliefShape",
    "ToothProfile",
    "tooth_profile",
]
