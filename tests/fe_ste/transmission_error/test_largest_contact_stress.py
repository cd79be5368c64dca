"""The largest contact stress of the mesh cycle is that within the path of contact."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.transmission_error.contact_stress import PATH_MARGIN, contact_line_stress, largest_contact_stress

GEAR = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
PAIR = GearPair(name="pair", pinion=GEAR, gear=GEAR, centre_distance=90e-3)


def states(load: float, edge_load: float) -> xr.Dataset:
    """A tooth pair at the pitch point with a line load (N/m), and one at the end of the path with another."""
    end = (PAIR.path_end - PAIR.path_pitch_point) / PAIR.transverse_base_pitch
    line_load = np.zeros((2, 1, 3))
    line_load[0] = load
    line_load[1] = edge_load
    coordinates = {"pmc": [0.0, end], "tooth": [0], "axial_position": [-8e-3, 0.0, 8e-3]}
    return xr.Dataset({"line_load": (("pmc", "tooth", "axial_position"), line_load)}, coordinates)


def test_a_load_at_the_pitch_point_has_the_stress_of_hertz():
    expected = float(contact_line_stress(PAIR, 0.0, 0, 0.0, 1e5))
    assert float(largest_contact_stress(PAIR, states(1e5, 0.0))) == pytest.approx(expected, rel=1e-12)


def test_loads_at_tip_edges_and_states_without_solution_do_not_count():
    expected = float(largest_contact_stress(PAIR, states(1e5, 0.0)))
    assert float(largest_contact_stress(PAIR, states(1e5, 1e6))) == expected
    assert float(largest_contact_stress(PAIR, states(1e5, np.nan))) == expected


def test_a_twentieth_of_the_path_at_either_end_is_left_out():
    length = PAIR.path_end - PAIR.path_start
    beside = states(1e5, 1e6)
    for share, counts in ((1.01 * PATH_MARGIN, True), (0.99 * PATH_MARGIN, False)):
        place = (PAIR.path_start + share * length - PAIR.path_pitch_point) / PAIR.transverse_base_pitch
        moved = beside.assign_coords(pmc=[0.0, place])
        assert (
            float(largest_contact_stress(PAIR, moved)) > 2.0 * float(largest_contact_stress(PAIR, states(1e5, 0.0)))
        ) == counts
