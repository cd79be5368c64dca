"""Velocities on the surface of flexible bodies at one speed of a steady-state response, for other programs.

Boundary elements or other models of radiation take them as the motion of their surface: a dataset for netCDF, and a VTK
file for unstructured grids, which ParaView and most programs read.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.units import RPM
from exugear.system.bodies.reduction import BodySurface
from fe_ste.tools.arrays import Complexes, Floats

AXES = ("x", "y", "z")
PARTS = ("real", "imaginary")


def surface_velocities(
    surfaces: Mapping[str, BodySurface],
    motion: Mapping[str, Complexes],
    frequency: Floats,
    names: Sequence[str],
    speed: float,
) -> xr.Dataset:
    """Velocities of all points of the surfaces, inside and outside.

    Parameters
    ----------
    motion : (lines, n) peak amplitudes of the coordinates of each of them, m and rad
    frequency : (lines,) Hz
    speed : of the overall input, rad/s

    Returns
    -------
    Dataset
        ``velocity`` over line, part, point and axis: v(t) = Re((real + i imaginary) exp(i 2 pi frequency t)), m/s;
        ``position`` of the points (m), ``face`` with four points each (a triangle repeats its last), ``body`` of a
        point.
    """
    rate = 2j * np.pi * np.asarray(frequency)
    velocity = [
        rate[:, None, None] * np.einsum("pan,ln->lpa", surface.displacement, motion[name])
        for name, surface in surfaces.items()
    ]
    whole = np.concatenate(velocity, axis=1)
    starts = np.cumsum([0, *(len(surface.points) for surface in surfaces.values())])
    faces = [surface.quads + start for surface, start in zip(surfaces.values(), starts, strict=False)]
    bodies = np.repeat(np.array(list(surfaces), dtype=object), np.diff(starts))
    return xr.Dataset(
        {
            "velocity": (
                ("line", "part", "point", "axis"),
                np.stack([whole.real, whole.imag], axis=1),
                {"units": "m/s", "long_name": "peak amplitude of the velocity"},
            ),
            "frequency": ("line", frequency, {"units": "Hz"}),
            "position": (
                ("point", "axis"),
                np.concatenate([surface.points for surface in surfaces.values()]),
                {"units": "m"},
            ),
            "face": (("quad", "corner"), np.concatenate(faces), {"long_name": "points of each face"}),
            "body": ("point", bodies),
        },
        {
            "line": np.array(names, dtype=object),
            "part": np.array(PARTS, dtype=object),
            "axis": np.array(AXES, dtype=object),
        },
        {"speed_rpm": speed / RPM},
    )


def vtk_file(velocities: xr.Dataset) -> bytes:
    """Return the same as a VTK file for unstructured grids (.vtu), with two vectors for each order.

    Requires meshio. An order is named by its number in the dataset, from 1, with its frequency.
    """
    import meshio

    faces = velocities["face"].to_numpy()
    is_triangle = faces[:, 2] == faces[:, 3]
    data: dict[str, Any] = {}
    for number, (frequency, velocity) in enumerate(
        zip(velocities["frequency"].to_numpy(), velocities["velocity"].to_numpy(), strict=True), start=1
    ):
        for part, values in zip(PARTS, velocity, strict=True):
            data[f"velocity_{number}_{frequency:.1f}Hz_{part}"] = values
    cells = [("triangle", faces[is_triangle][:, :3]), ("quad", faces[~is_triangle])]
    mesh = meshio.Mesh(
        velocities["position"].to_numpy(), [(kind, own) for kind, own in cells if len(own)], point_data=data
    )
    with tempfile.TemporaryDirectory() as folder:  # meshio writes this format into named files alone
        file = Path(folder) / "surface.vtu"
        mesh.write(file)
        return file.read_bytes()
