"""Studies of the spur pair: small points that show how any are carried out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import xarray as xr

from exugear.studies.study import Study

from .spur import SPUR_CASE

TOLD_APART = ("seconds", "memory")
"""What two runs of one study differ in."""


def written_case(folder: Path) -> Path:
    """The spur pair's file in a folder."""
    path = folder / "spur.toml"
    path.write_text(SPUR_CASE, encoding="utf-8")
    return path


def study_content(folder: Path, **changes: Any) -> dict[str, Any]:
    """Twelve modal points: seats and the first bearing, four and three values."""
    return {
        "name": "seats and bearing",
        "case": str(written_case(folder)),
        "choice": {"variant": "bushing", "mesh_model": "iso6336"},
        "parameters": {
            "seat": {"path": "housing.factor", "values": [0.2, 0.4, 0.6, 0.8]},
            "bearing": {
                "path": "bearings.bearing_1.stiffness.radial_N_per_m",
                "range": {"first": 1e7, "last": 4e7, "count": 3, "scale": "logarithmic"},
            },
        },
        "outputs": {
            "frequency": {"quantity": "frequencies", "count": 4},
            "nearest": {"quantity": "nearest_frequency", "near_Hz": 500.0},
            "forces": {"quantity": "mesh_forces"},
        },
        **changes,
    }


def small_study(folder: Path, **changes: Any) -> Study:
    """The same, read."""
    return Study.from_dict(study_content(folder, **changes))


def figures_of(dataset: xr.Dataset | None) -> xr.Dataset:
    """What two runs of one study have in common."""
    assert dataset is not None
    return dataset.drop_vars(TOLD_APART)
