"""The file of what bearings bear: JSON, units in the keys, with the hash of its input and its method's version."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from exugear.bearings.duty import BearingDuty
from exugear.model.versions import MODES
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
        "L10_Mrev": _finite(duty.basic_life),
        "L10r_Mrev": _finite(duty.reference_life),
        "remarks": list(duty.remarks),
    }


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


def _finite(life: float) -> float | None:
    return life if math.isfinite(life) else None


def write_duties(path: Path, duties: Iterable[BearingDuty], input_hash: str) -> Path:
    """Write what bearings bear (atomically) and return the path."""
    content = {
        "input_hash": input_hash,
        "method_version": MODES,
        "life": "basic: by ISO 281 and ISO/TS 16281 without lubricant and cleanliness; ribs and cages left out",
        "bearings": [duty_summary(duty) for duty in duties],
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())
    return path
