"""Static transmission error of gear pairs by three-dimensional finite elements and contact."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from fe_ste.flanks.modifications import FlankModification, Relief, ReliefShape
from fe_ste.flanks.topography import FlankTopography
from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import BasicRack, Gear, GearPair, Material
from fe_ste.geometry.profile import ToothProfile, tooth_profile

if TYPE_CHECKING:
    from fe_ste.contact.cells import ContactSettings
    from fe_ste.elasticity.hexmesh import MeshSettings
    from fe_ste.elasticity.sectors import ContactMesh
    from fe_ste.reference.position import NonlinearSettings, nonlinear_position
    from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
    from fe_ste.transmission_error.table import MeshTable, TableError, TableInput
    from fe_ste.transmission_error.transmission_error import static_transmission_error

#: Names whose modules load the finite-element libraries: imported when first asked for.
_LATER = {
    "ContactMesh": "elasticity.sectors",
    "ContactSettings": "contact.cells",
    "MeshSettings": "elasticity.hexmesh",
    "MeshTable": "transmission_error.table",
    "NonlinearSettings": "reference.position",
    "PairCompliance": "transmission_error.compliance",
    "TableError": "transmission_error.table",
    "TableInput": "transmission_error.table",
    "nonlinear_position": "reference.position",
    "pair_compliance": "transmission_error.compliance",
    "static_transmission_error": "transmission_error.transmission_error",
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
