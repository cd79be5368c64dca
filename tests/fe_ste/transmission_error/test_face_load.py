"""Load along the face: what is measured of it, against the resultant of the same contact."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.transmission_error.contact_stress import face_load_factor, load_along_face
from fe_ste.transmission_error.transmission_error import static_transmission_error

WIDTH = 20e-3
TORQUE = 150.0


@pytest.fixture(scope="module")
def states() -> xr.Dataset:
    """Spur pair over two mesh positions, straight and tilted to either side."""
    gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=WIDTH, held_diameter=50e-3)
    pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    tilts = np.array([-2e-4, 0.0, 2e-4])
    mesh, contact = MeshSettings(layers=8, flank=10, thickness=6), ContactSettings(slices=24)
    return static_transmission_error(pair, TORQUE, 2, misalignment=tilts, mesh=mesh, contact=contact).squeeze()


def test_line_load_over_the_face_is_the_normal_load(states: xr.Dataset) -> None:
    axial = states["axial_position"].to_numpy()
    width = (axial[1] - axial[0]) * len(axial)
    load = load_along_face(states).mean("axial_position") * width
    assert width == pytest.approx(WIDTH, rel=1e-9)
    # Spur teeth: the normal load is the torque over the base radius; the contact is solved to 1e-9.
    assert load.to_numpy() == pytest.approx(TORQUE / (45e-3 * np.cos(np.radians(20.0))), rel=1e-6)


def test_factor_of_a_tilted_mesh_follows_from_where_its_resultant_acts(states: xr.Dataset) -> None:
    # Second way: a load that falls linearly along the face has its highest at 1 + 6 e / b of the mean, e the place of
    # its resultant. Ends give way and deviate from the straight line: 0.03 of them stand in the aligned mesh, too.
    factor = face_load_factor(states)
    excess = abs(states["load_centroid"].mean("pmc")) * 6.0 / WIDTH
    aligned = float(factor[1])
    assert 1.0 < aligned < 1.1
    for side in (0, 2):
        assert float(factor[side]) - aligned == pytest.approx(float(excess[side]), abs=0.05)
        assert float(excess[side]) > 0.3


def test_equal_gears_tilted_either_way_are_loaded_alike(states: xr.Dataset) -> None:
    factor, along = face_load_factor(states), load_along_face(states)
    assert float(factor[0]) == pytest.approx(float(factor[2]), rel=1e-3)
    assert along[0].to_numpy() == pytest.approx(along[2].to_numpy()[::-1], rel=5e-3)
