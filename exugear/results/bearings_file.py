"""The file of what bearings and meshes bear: JSON, units in the keys, hash of its input, version of its method."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from exugear.gearbox.versions import MODES
from exugear.system.bearings.duty import BearingDuty
from exugear.system.tooth_mesh.mesh_duty import MeshDuty
from fe_ste.tools.files import FileError, read_text, write_file


def duty_summary(duty: BearingDuty) -> dict[str, Any]:
    """Figures of a bearing by key, in the units that catalogues use; lives without end are None."""
    return {
        "bearing": duty.name,
        "type": duty.kind,
        "law": duty.law,
        "radial_load_kN": 1e-3 * duty.radial_load,
        "axial_load_kN": 1e-3 * duty.axial_load,
        "reaction_kN": None if duty.reaction is None else 1e-3 * duty.reaction,
        "radial_stiffness_N_per_m": duty.radial_stiffness,
        "axial_stiffness_N_per_m": float(duty.stiffness[2, 2]),
        "stiffness_matrix_N_m_rad": duty.stiffness.tolist(),
        "tilt_stiffness_N_m_per_rad": 0.5 * float(duty.stiffness[3, 3] + duty.stiffness[4, 4]),
        "misalignment_mrad": 1e3 * duty.misalignment,
        "most_loaded_element_kN": 1e-3 * duty.element_load,
        "contact_pressure_MPa": 1e-6 * duty.pressure,
        "dynamic_rating_kN": 1e-3 * duty.ratings.dynamic,
        "static_rating_kN": 1e-3 * duty.ratings.static,
        "ratings_estimated": duty.ratings.estimated,
        "ratings_of_makers": list(duty.ratings.makers),
        "L10_Mrev": _finite(duty.basic_life),
        "L10r_Mrev": _finite(duty.reference_life),
        "remarks": list(duty.remarks),
    }


def mesh_summary(duty: MeshDuty) -> dict[str, Any]:
    """Figures of a mesh by key; what no contact was solved for is None."""
    return {
        "mesh": duty.name,
        "force_kN": 1e-3 * duty.force,
        "misalignment_mrad": 1e3 * duty.misalignment,
        "opening_um": 1e6 * duty.opening,
        "centre_distance_change_um": 1e6 * duty.centre_distance_change,
        "load_centre_mm": _finite(1e3 * duty.load_centre),
        "K_Hbeta": _finite(duty.face_load_factor),
        "contact_pressure_MPa": _finite(1e-6 * duty.pressure),
        "remark": duty.remark,
    }


def duties_summary(duties: Iterable[BearingDuty], meshes: Iterable[MeshDuty]) -> dict[str, Any]:
    """Figures of all bearings and of all meshes."""
    return {"bearings": [*map(duty_summary, duties)], "meshes": [*map(mesh_summary, meshes)]}


def read_duties(path: Path) -> dict[str, Any]:
    """Read what `write_duties` wrote.

    Raises
    ------
    FileError
        The file is missing, damaged, or of another version.
    """
    try:
        content = json.loads(read_text(path))
        if content["method_version"] == MODES and isinstance(content["bearings"], list):
            return dict(content)
    except (ValueError, KeyError, TypeError):
        raise FileError(f"{path}: is damaged; run `exugear bearings` again") from None
    raise FileError(f"{path}: was written by another version; run `exugear bearings` again")


def _finite(value: float) -> float | None:
    if math.isfinite(value):
        return value
    return None


def write_duties(path: Path, duties: Iterable[BearingDuty], meshes: Iterable[MeshDuty], input_hash: str) -> Path:
    """Write what bearings and meshes bear (atomically) and return the path."""
    content = {
        "input_hash": input_hash,
        "method_version": MODES,
        "life": "basic: by ISO 281 and ISO/TS 16281 without lubricant and cleanliness; ribs and cages left out",
        **duties_summary(duties, meshes),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())
    return path
