"""Static transmission error of gear pairs by three-dimensional finite elements and contact."""

from fe_ste.gears import BasicRack, Gear, GearPair, GeometryError, Material
from fe_ste.profile import ToothProfile, tooth_profile

__all__ = [
    "BasicRack",
    "Gear",
    "GearPair",
    "GeometryError",
    "Material",
    "ToothProfile",
    "tooth_profile",
]
