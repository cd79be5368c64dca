"""Static transmission error of gear pairs by three-dimensional finite elements and contact."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from fe_ste.gears import BasicRack, Gear, GearPair, GeometryError, Material
from fe_ste.modifications import FlankModification, Relief, ReliefShape
from fe_ste.profile import ToothProfile, tooth_profile
from fe_ste.topography import FlankTopography

if TYPE_CHECKING:
    from fe_ste.contact import ContactSettings
    from fe_ste.hexmesh import MeshSettings
    from fe_ste.nonlinear import NonlinearSettings, nonlinear_position
    from fe_ste.sectors import ContactMesh
    from fe_ste.ste import PairCompliance, pair_compliance, static_transmission_error
    from fe_ste.table import MeshTable, TableError, TableInput

#: Names whose modules load the finite-element libraries: imported when first asked for.
_LATER = {
    "ContactMesh": "sectors",
    "ContactSettings": "contact",
    "MeshSettings": "hexmesh",
    "MeshTable": "table",
    "NonlinearSettings": "nonlinear",
    "PairCompliance": "ste",
    "TableError": "table",
    "TableInput": "table",
    "nonlinear_position": "nonlinear",
    "pair_compliance": "ste",
    "static_transmission_error": "ste",
}

__all__ = [
    "BasicRack",
    "ContactMesh",
    "ContactSettings",
    "FlankModification",
    "FlankTopography",
    "Gear",
    "GearPair",
    "GeometryError",
    "Material",
    "MeshSettings",
    "MeshTable",
    "NonlinearSettings",
    "PairCompliance",
    "Relief",
    "ReliefShape",
    "TableError",
    "TableInput",
    "ToothProfile",
    "nonlinear_position",
    "pair_compliance",
    "static_transmission_error",
    "tooth_profile",
]


def __getattr__(name: str) -> Any:
    if name in _LATER:
        return getattr(importlib.import_module(f"fe_ste.{_LATER[name]}"), name)
    raise AttributeError(f"module 'fe_ste' has no attribute {name!r}")
