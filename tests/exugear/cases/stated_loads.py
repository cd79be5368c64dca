"""Loads of the GRC's bearings for comparisons of models that must hold their bodies alike.

Each variant finds loads of its own otherwise, and with them another stiffness. At stated loads it is the same in all
directions.
"""

from __future__ import annotations

STATED_LOADS: dict[str, object] = {
    "bearings.pl_a.catalogue.radial_load_kN": 129.9,
    "bearings.pl_b.catalogue.radial_load_kN": 129.9,
    "bearings.lss_a.catalogue.radial_load_kN": 37.0,
    "bearings.lss_bc.catalogue.radial_load_kN": 98.0,
    "bearings.lss_bc.catalogue.axial_load_kN": 22.2,
    "bearings.ims_a.catalogue.radial_load_kN": 34.8,
    "bearings.ims_bc.catalogue.radial_load_kN": 67.3,
    "bearings.ims_bc.catalogue.axial_load_kN": 16.9,
    "bearings.hss_a.catalogue.radial_load_kN": 33.5,
    "bearings.hss_bc.catalogue.radial_load_kN": 21.8,
    "bearings.hss_bc.catalogue.axial_load_kN": 12.9,
}
