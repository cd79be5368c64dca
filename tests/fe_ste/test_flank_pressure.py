"""Pressure over the flank: against the stress over the mesh cycle, the load, and where a tilted mesh is loaded."""

from __future__ import annotations

import numpy as np
import pytest

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.flank_pressure import POSITIONS, FlankPressure, flank_pressures
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.root_stress import PATH_MARGIN, hertz_stress
from fe_ste.transmission_error.mean_contact import states_of_contact
from fe_ste.transmission_error.table import TableInput

WIDTH = 30e-3
FORCE = 4000.0
TILTS = (-2e-4, 0.0, 2e-4)
KEYS = {"teeth": 30, "normal_module": 3e-3, "face_width": WIDTH, "held_diameter": 50e-3}


@pytest.fixture(scope="module", params=[0.0, 15.0, -15.0])
def pair(request: pytest.FixtureRequest) -> GearPair:
    helix = np.radians(request.param)
    pinion, gear = (Gear(name=name, helix_angle=sign * helix, **KEYS) for name, sign in (("one", 1), ("two", -1)))
    return GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=90e-3 / np.cos(helix))


@pytest.fixture(scope="module")
def table(pair: GearPair) -> TableInput:
    mesh, contact = MeshSettings(layers=6, flank=10, thickness=6), ContactSettings(slices=24)
    return TableInput(pair=pair, torque=(100.0,), mesh=mesh, contact=contact)


@pytest.fixture(scope="module")
def flanks(table: TableInput) -> list[FlankPressure]:
    return flank_pressures(table, FORCE, TILTS)


def test_pressure_integrates_to_the_load_on_the_path_of_contact(table: TableInput, flanks) -> None:
    """Hertz: p^2 pi R / E* is the line load; its mean along the face over a base pitch gives the normal force.

    The ends of the path, where tip edges touch, are left out: their share of the load is counted apart, to one of 20
    positions a base pitch, which is 3 % of the path.
    """
    pair = table.pair
    steel = pair.pinion.material
    give = 2.0 * (1.0 - steel.poissons_ratio**2) / steel.youngs_modulus
    states = states_of_contact(table, FORCE, TILTS, pair.centre_distance, POSITIONS)
    pmc, tooth, axial = (states[name].to_numpy() for name in ("pmc", "tooth", "axial_position"))
    twist = np.tan(pair.pinion.base_helix_angle)
    place = pair.path_pitch_point + pair.transverse_base_pitch * (pmc[:, None, None] + tooth[:, None]) + twist * axial
    on_path = (place > flanks[0].path[0]) & (place < flanks[0].path[-1])
    loads = np.nan_to_num(states["line_load"].transpose("misalignment", "pmc", "tooth", "axial_position").to_numpy())
    for flank, load in zip(flanks, loads, strict=True):
        other = pair.centre_distance * np.sin(pair.working_pressure_angle) - flank.path
        radius = 1.0 / (np.cos(pair.pinion.base_helix_angle) * (1.0 / flank.path + 1.0 / other))
        line_load = flank.pressure**2 * np.pi * radius[:, None] * give
        normal = np.trapezoid(line_load, flank.path, axis=0).mean() / pair.transverse_base_pitch
        assert normal == pytest.approx(flank.line_load.mean() * load[on_path].sum() / load.sum(), rel=0.03)


def test_load_is_highest_at_the_end_where_the_gap_is_closed(flanks: list[FlankPressure]) -> None:
    for flank, sign in zip((flanks[0], flanks[2]), (1.0, -1.0), strict=True):
        assert np.sign(flank.highest[2]) == sign
        assert np.sign(flank.line_load @ flank.axial) == sign
        assert flank.face_load_factor > flanks[1].face_load_factor + 0.2
        assert flank.highest[0] > flanks[1].highest[0]


def test_tip_edges_touch_at_an_end_of_the_path_and_most_where_the_gap_is_closed(flanks: list[FlankPressure]) -> None:
    for flank, sign in zip((flanks[0], flanks[2]), (1.0, -1.0), strict=True):
        path, axial = flank.edge_place
        assert flank.edge_pressure > 0.0
        assert path in (flank.path[0], flank.path[-1])
        assert np.sign(axial) == sign


def test_aligned_spur_gears_are_pressed_most_where_one_tooth_pair_carries_all(pair: GearPair, flanks) -> None:
    """At the inner point of single contact the stress is that of ISO 6336-2 with all of the load, evenly along."""
    if pair.pinion.helix_angle != 0.0:
        pytest.skip("spur gears")
    inner = max(pair.path_end - pair.transverse_base_pitch, pair.path_start)
    other = pair.centre_distance * np.sin(pair.working_pressure_angle) - inner
    stress = np.sqrt(FORCE / WIDTH * (1.0 / inner + 1.0 / other) / (np.pi * 2.0 * (1.0 - 0.3**2) / 2.06e11))
    middle = flanks[1].pressure[:, 8:16].max()
    assert middle == pytest.approx(stress, rel=0.04)


def test_the_diagram_has_the_pressure_over_face_and_path() -> None:
    path, axial = np.linspace(10e-3, 20e-3, 5), np.linspace(-9e-3, 9e-3, 4)
    pressure = 1e8 * np.arange(20.0).reshape(5, 4)
    panel = FlankPressure(0.0, path, axial, pressure, np.full(4, 1e5), 1.0, 0.0).plot()
    (mesh,) = panel.collections
    np.testing.assert_array_equal(mesh.get_array(), 1e-6 * pressure)
    x, y = np.moveaxis(mesh.get_coordinates(), -1, 0)  # corners of the cells, around the places
    np.testing.assert_allclose(0.5 * (x[0, 1:] + x[0, :-1]), 1e3 * axial)
    np.testing.assert_allclose(0.5 * (y[1:, 0] + y[:-1, 0]), 1e3 * path)


def test_the_highest_pressure_is_that_of_the_rating(table: TableInput, flanks: list[FlankPressure]) -> None:
    """`life` takes its contact stress from the same states, sample by sample; the picture interpolates between them."""
    pair = table.pair
    states = states_of_contact(table, FORCE, TILTS, pair.centre_distance, 50)
    loads = np.nan_to_num(states["line_load"].transpose("misalignment", "pmc", "tooth", "axial_position").to_numpy())
    pmc, tooth, axial = (states[name].to_numpy() for name in ("pmc", "tooth", "axial_position"))
    twist = np.tan(pair.pinion.base_helix_angle)
    place = pair.path_pitch_point + pair.transverse_base_pitch * (pmc[:, None, None] + tooth[:, None]) + twist * axial
    margin = PATH_MARGIN * (pair.path_end - pair.path_start)
    inside = (place > pair.path_start + margin) & (place < pair.path_end - margin)
    for flank, load in zip(flanks, loads, strict=True):
        rated = np.where(inside, hertz_stress(pair, load, place), 0.0).max()
        assert flank.highest[0] == pytest.approx(rated, rel=0.03)
