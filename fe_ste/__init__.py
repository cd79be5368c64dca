"""Static transmission error of gear pairs by three-dimensional finite elements and contact.

Names are imported when first used, so that ``import fe_ste`` stays quick.

Examples
--------
>>> import fe_ste
>>> gear = fe_ste.Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
>>> pair = fe_ste.GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
>>> round(1e-6 * fe_ste.iso6336.mesh_stiffness(pair).stiffness)  # N/um
381
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fe_ste.contact.kinematics import ContactError, ContactSettings
    from fe_ste.elasticity.gear_mesh import ContactMesh
    from fe_ste.elasticity.hexmesh import MeshSettings
    from fe_ste.flanks import FlankModification, FlankTopography, Relief, ReliefShape
    from fe_ste.geometry.checks import GeometryError
    from fe_ste.geometry.gears import BasicRack, Gear, GearPair, Material
    from fe_ste.geometry.profile import ToothProfile, tooth_profile
    from fe_ste.reference.position import NonlinearSettings, nonlinear_position
    from fe_ste.standards import iso6336
    from fe_ste.tools.drawing import paper_axes
    from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
    from fe_ste.transmission_error.grid import Checkpoint, GridError
    from fe_ste.transmission_error.surface import SteSurface
    from fe_ste.transmission_error.table import MeshTable, TableError, TableInput
    from fe_ste.transmission_error.transmission_error import static_transmission_error

__all__ = [
    "BasicRack",
    "Checkpoint",
    "ContactError",
    "ContactMesh",
    "ContactSettings",
    "FlankModification",
    "FlankTopography",
    "Gear",
    "GearPair",
    "GeometryError",
    "GridError",
    "Material",
    "MeshSettings",
    "MeshTable",
    "NonlinearSettings",
    "PairCompliance",
    "Relief",
    "ReliefShape",
    "SteSurface",
    "TableError",
    "TableInput",
    "ToothProfile",
    "iso6336",
    "nonlinear_position",
    "pair_compliance",
    "static_transmission_error",
    "paper_axes",
    "tooth_profile",
]

_HOMES = {
    "BasicRack": "fe_ste.geometry.gears",
    "Checkpoint": "fe_ste.transmission_error.grid",
    "ContactError": "fe_ste.contact.kinematics",
    "ContactMesh": "fe_ste.elasticity.gear_mesh",
    "ContactSettings": "fe_ste.contact.kinematics",
    "FlankModification": "fe_ste.flanks",
    "FlankTopography": "fe_ste.flanks",
    "Gear": "fe_ste.geometry.gears",
    "GearPair": "fe_ste.geometry.gears",
    "GeometryError": "fe_ste.geometry.checks",
    "GridError": "fe_ste.transmission_error.grid",
    "Material": "fe_ste.geometry.gears",
    "MeshSettings": "fe_ste.elasticity.hexmesh",
    "MeshTable": "fe_ste.transmission_error.table",
    "NonlinearSettings": "fe_ste.reference.position",
    "PairCompliance": "fe_ste.transmission_error.compliance",
    "Relief": "fe_ste.flanks",
    "ReliefShape": "fe_ste.flanks",
    "SteSurface": "fe_ste.transmission_error.surface",
    "TableError": "fe_ste.transmission_error.table",
    "TableInput": "fe_ste.transmission_error.table",
    "ToothProfile": "fe_ste.geometry.profile",
    "nonlinear_position": "fe_ste.reference.position",
    "pair_compliance": "fe_ste.transmission_error.compliance",
    "static_transmission_error": "fe_ste.transmission_error.transmission_error",
    "paper_axes": "fe_ste.tools.drawing",
    "tooth_profile": "fe_ste.geometry.profile",
}


def __getattr__(name: str) -> Any:
    if name == "iso6336":
        return importlib.import_module("fe_ste.standards.iso6336")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
