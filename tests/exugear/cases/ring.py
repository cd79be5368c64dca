"""The planetary stage of the GRC by itself, its ring an elastic rim of 108 elements between two flanges."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skfem

from exugear.gearbox.gearbox import Gearbox

OUTER, INNER, FACE = 0.595, 0.5235, 0.23
MIDDLE = -0.1045
AROUND = 54
PLANETARY = ("sun", "planet", "ring")
STIFF = {"radial_N_per_m": 4e9, "axial_N_per_m": 4e9, "tilt_N_m_per_rad": 1e9, "torsion_N_m_per_rad": 1e9}


def write_rim(file: Path, oval: float = 0.0) -> None:
    """Rim of the ring as flat-sided bricks, the corners of each cross-section on two circles.

    With `oval` (m) it is that much thinner at two opposite places, so that its stiffness differs around it.
    """
    logical = skfem.MeshHex.init_tensor(
        np.array([INNER, OUTER]), np.arange(AROUND + 1.0), np.linspace(-FACE / 2.0, FACE / 2.0, 3)
    )
    radius, number, z = logical.p
    angle = 2.0 * np.pi * number / AROUND
    radius = radius + np.where(radius < OUTER, oval * np.cos(angle) ** 2, 0.0)
    _write_around(file, logical, radius, angle, z + MIDDLE)


def _write_around(file: Path, logical: Any, radius: np.ndarray, angle: np.ndarray, z: np.ndarray) -> None:
    """Bricks of a logical mesh at cylindrical coordinates (m and rad), closed around the axis."""
    meshio = pytest.importorskip("meshio", reason="meshio (extra mesh) is missing")
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    _, first, joined = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    cells = joined.ravel()[logical.t.T[:, np.argsort([6, 2, 5, 7, 1, 3, 4, 0])]]  # order of VTK
    meshio.Mesh(1e3 * points[first], [("hexahedron", cells)]).write(file)


def ring_content(grc: Gearbox, folder: Path) -> dict[str, Any]:
    """Content of the gearbox file in `folder`, where its rim is written."""
    write_rim(folder / "rim.vtu")
    content = copy.deepcopy(dict(grc.content))
    gears = {name: content["gears"][name] for name in PLANETARY}
    bodies = {name: content["bodies"][name] for name in ("carrier", "planet", "lss")}
    for body in bodies.values():
        body["flexibility"] = "none"
    bodies["lss"]["gears_z_mm"] = {"sun": 1e3 * MIDDLE}
    for key in ("shape", "solid"):
        bodies["lss"].pop(key, None)
        bodies["carrier"].pop(key, None)
    bodies["housing"] = {
        "fixed": True,
        "axis_position_mm": [0.0, 0.0],
        "gears_z_mm": {"ring": 1e3 * MIDDLE},
        "flexibility": "elastic",
        "solid": {
            "file": "rim.vtu",
            "band_Hz": 800.0,
            "seats": {
                "ring": {"diameter_mm": 2e3 * OUTER, "sectors": 9},
                "front": {"diameter_mm": 2e3 * OUTER, "inner_diameter_mm": 2e3 * INNER},
                "rear": {"diameter_mm": 2e3 * OUTER, "inner_diameter_mm": 2e3 * INNER},
            },
        },
    }
    bearings = {n: b for n, b in content["bearings"].items() if b["body"] in ("carrier", "planet", "lss")}
    for bearing in bearings.values():
        if bearing.get("on") == "housing":
            del bearing["on"]
    mounts = {
        name: {"body": "housing", "position_mm": [0.0, 0.0, 1e3 * (MIDDLE + side * FACE / 2.0)], "stiffness": STIFF}
        for name, side in (("front", -1.0), ("rear", 1.0))
    }
    return {
        "name": "planetary stage",
        "default_inertias": "assemblies",
        "overall": {"input": "carrier", "output": "lss", "output_gear": "sun"},
        "static_load": {"torques_N_m": {"carrier": 240e3}, "locked": ["lss"]},
        "gears": gears,
        "pairs": {name: content["pairs"][name] for name in ("sun_planet", "ring_planet")},
        "bodies": bodies,
        "meshes": {name: content["meshes"][name] for name in ("sun_planet", "ring_planet")},
        "bearings": bearings,
        "mounts": mounts,
        "load_cases": {"run_up": {"torques_N_m": {"carrier": 240e3, "lss": -38e3}}},
        "damping": content["damping"],
        "elasticity": content["elasticity"],
    }


def write_drum(file: Path) -> None:
    """Carrier as a thick ring of flat-sided bricks, equal under a turn by 15 degrees, with faces at all bearings."""
    around = 24
    logical = skfem.MeshHex.init_tensor(
        np.array([0.04, 0.12, 0.2, 0.308, 0.42]), np.arange(around + 1.0), np.array([-0.31, -0.1545, -0.0545, 0.0975])
    )
    radius, number, z = logical.p
    _write_around(file, logical, radius, 2.0 * np.pi * number / around, z)


def drum_content(grc: Gearbox, folder: Path) -> dict[str, Any]:
    """Content of the same gearbox file with a flexible carrier of this shape."""
    content = ring_content(grc, folder)
    write_drum(folder / "drum.vtu")
    diameters = {"plc_a": 240.0, "plc_b": 240.0, "pl_a": 290.0, "pl_b": 290.0}
    seats = {name: {"diameter_mm": wide, "inner_diameter_mm": 0.0} for name, wide in diameters.items()}
    content["bodies"]["carrier"] |= {
        "flexibility": "elastic",
        "solid": {"file": "drum.vtu", "band_Hz": 1000.0, "seats": seats},
    }
    return content


def two_stage_content(grc: Gearbox, folder: Path, rim: str = "") -> dict[str, Any]:
    """Content of a gearbox file with that stage, whose sun drives the carrier of a second one.

    The ring gear of the second one is rigid, or flexible with a mesh of its own.
    """
    content = ring_content(grc, folder)
    bodies = content["bodies"]
    for name in ("carrier", "planet", "lss"):
        bodies[f"{name}_2"] = copy.deepcopy(bodies[name])
    bodies["planet_2"]["carrier"] = "carrier_2"
    bodies["housing_2"] = {name: bodies["housing"][name] for name in ("fixed", "axis_position_mm", "gears_z_mm")}
    if rim:
        solid = bodies["housing"]["solid"]
        seats = {name if name == "ring" else f"{name}_2": seat for name, seat in solid["seats"].items()}
        bodies["housing_2"] |= {"flexibility": "elastic", "solid": solid | {"file": rim, "seats": seats}}
        content["mounts"] |= {f"{name}_2": own | {"body": "housing_2"} for name, own in content["mounts"].items()}
    for name, bearing in list(content["bearings"].items()):
        ends = {end: f"{bearing[end]}_2" for end in ("body", "on") if end in bearing}
        content["bearings"][f"{name}_2"] = copy.deepcopy(bearing) | ends
    content["meshes"] |= {
        "sun_planet_2": {"pair": "sun_planet", "pinion_body": "lss_2", "gear_body": "planet_2"},
        "ring_planet_2": {"pair": "ring_planet", "pinion_body": "planet_2", "gear_body": "housing_2"},
    }
    content["couplings"] = {"middle": {"bodies": ["lss", "carrier_2"], "stiffness_N_m_per_rad": 2e7}}
    content["overall"] = {"input": "carrier", "output": "lss_2", "output_gear": "sun"}
    content["static_load"] = {"torques_N_m": {"carrier": 240e3}, "locked": ["lss_2"]}
    content["load_cases"] = {"run_up": {"torques_N_m": {"carrier": 240e3, "lss_2": -6e3}}}
    return content
