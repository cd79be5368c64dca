"""The spur pair of `spur` in an elastic plate of ten elements: the smallest housing there is."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skfem

from .spur import SPUR_CASE

THICKNESS = 12.0


def write_plate(file: Path) -> None:
    """Plate of 125 x 50 x 12 mm as ten hexahedra; bearings sit on its upper face, a foot is below.

    A VTU file in plain text: only reading it needs meshio, which tests of the gearbox file do without.
    """
    lines = [np.linspace(-25.0, 100.0, 6), np.linspace(-25.0, 25.0, 3), np.array([-THICKNESS, 0.0])]
    mesh = skfem.MeshHex.init_tensor(*lines)
    cells = mesh.t.T[:, np.argsort([6, 2, 5, 7, 1, 3, 4, 0])]  # order of VTK
    count = len(cells)

    def array(kind: str, values: np.ndarray, more: str = "") -> str:
        text = " ".join(map(str, np.ravel(values).tolist()))
        return f'<DataArray type="{kind}" {more} format="ascii">{text}</DataArray>'

    points = array("Float64", mesh.p.T, 'NumberOfComponents="3"')
    arrays = {"connectivity": cells, "offsets": 8 * np.arange(1, count + 1), "types": np.full(count, 12)}
    parts = "".join(array("Int64", values, f'Name="{name}"') for name, values in arrays.items())
    file.write_text(
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>'
        f'<Piece NumberOfPoints="{mesh.p.shape[1]}" NumberOfCells="{count}"><Points>{points}</Points>'
        f"<Cells>{parts}</Cells></Piece></UnstructuredGrid></VTKFile>",
        encoding="utf-8",
    )


def boxed(band: float, **solid: Any) -> dict[str, Any]:
    """The spur pair in the plate, whose seats are the bearings and a foot."""
    content = tomllib.loads(SPUR_CASE)
    face = {"diameter_mm": 72.0, "inner_diameter_mm": 0.0}
    seats = {"bearing_1": face, "bearing_2": face, "foot": {**face, "position_mm": [50.0, 0.0, -THICKNESS]}}
    content["bodies"]["box"] = {
        "fixed": True,
        "axis_position_mm": [0.0, 0.0],
        "flexibility": "elastic",
        "solid": {"file": "plate.vtu", "band_Hz": band, **solid, "seats": seats},
    }
    for bearing in content["bearings"].values():
        bearing["on"] = "box"
    stiffness = {"radial_N_per_m": 5e7, "axial_N_per_m": 5e7, "tilt_N_m_per_rad": 1e5, "torsion_N_m_per_rad": 1e5}
    # The foot stands below its seat: the support works on an arm.
    content["mounts"] = {"foot": {"body": "box", "position_mm": [50.0, 0.0, -40.0], "stiffness": stiffness}}
    return content


def box_content(folder: Path) -> dict[str, Any]:
    """Content of the gearbox file in `folder`, where its plate is written."""
    pytest.importorskip("meshio", reason="meshio (extra mesh) is missing")
    write_plate(folder / "plate.vtu")
    return boxed(8000.0) | {"elasticity": {"band_Hz": 8000.0, "limit_Hz": 12000.0}}
