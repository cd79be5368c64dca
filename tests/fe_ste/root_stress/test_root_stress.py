"""Root stress from the superelement: against ISO 6336-3, another mesh, and states of contact."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr

from fe_ste.elasticity.hexmesh import MeshSettings, sector_mesh
from fe_ste.geometry.gears import Gear
from fe_ste.root_stress import RootGauges, gauge_columns, gauge_places, hertz_stress, mesh_cycle_stress, root_gauges
from fe_ste.standards.pitting import nominal_contact_stress
from fe_ste.standards.tooth_root import form_and_correction

from ..cases.gears import fzg_c

MODULE, WIDTH = 4.5e-3, 14e-3


def middle_stress(gauges: RootGauges, radius: float) -> float:
    """Largest root stress in the middle of the face, Pa, with F_t / (b m) = 1 Pa on one tooth at a radius (m)."""
    gear = gauges.gear
    roll = math.sqrt((radius / gear.base_radius) ** 2 - 1.0)
    width = np.gradient(gauges.axial)
    force = WIDTH * MODULE / math.cos(math.radians(20.0))
    loads = gauges.node_loads(np.full(len(width), roll), gauges.axial, force * width / width.sum())
    largest, _ = gauges.principal({0: loads})
    own = largest[max(gauges.stress)]
    return float(own[:, len(width) // 2].max())


@pytest.fixture(scope="module")
def gauges():
    pair = fzg_c()
    return root_gauges(pair.pinion, 1), root_gauges(pair.gear, 1)


@pytest.mark.validation
@pytest.mark.parametrize(("member", "radius"), [(0, 37.72e-3), (0, 36.28e-3), (1, 55.95e-3), (1, 54.54e-3)])
def test_root_stress_of_the_spur_reference_is_that_of_iso_6336_3(gauges, member, radius):
    """Within 6 %: the standard's tangent of 30 degrees is not where the stress is largest, and its Y_S is a fit."""
    gear = (fzg_c().pinion, fzg_c().gear)[member]
    form, correction, _ = form_and_correction(gear, gear.teeth, 2.0 * radius / MODULE)
    assert middle_stress(gauges[member], radius) == pytest.approx(form * correction, rel=0.06)


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize(("member", "radius"), [(0, 37.72e-3), (1, 55.95e-3)])
def test_root_stress_has_converged_with_the_mesh_of_the_fillet(gauges, member, radius):
    gear = (fzg_c().pinion, fzg_c().gear)[member]
    finer = root_gauges(gear, 1, MeshSettings(fillet=16, root=8))
    assert middle_stress(gauges[member], radius) == pytest.approx(middle_stress(finer, radius), rel=0.01)


def test_gauges_read_the_strains_of_a_uniform_deformation():
    """A linear field of displacements has the same strains everywhere; helical, so that the face leans."""
    gear = Gear(
        name="helical", teeth=20, normal_module=4e-3, helix_angle=math.radians(20.0), face_width=20e-3,
        held_diameter=40e-3,
    )  # fmt: skip
    mesh = sector_mesh(gear, MeshSettings(layers=6))
    places = gauge_places(mesh)
    gradient = np.random.default_rng(1).normal(size=(3, 3))
    strain = 0.5 * (gradient + gradient.T)
    read = (gauge_columns(mesh, places).T @ (mesh.points @ gradient.T).ravel()).reshape(len(places.edges), 3, -1)
    points = mesh.points.reshape(7, -1, 3)
    along = points[:, places.edges[:, 1]] - points[:, places.edges[:, 0]]
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    expected = np.einsum("lgi,ij,lgj->gl", along, strain, along)
    assert read[:, 0] == pytest.approx(expected, abs=1e-9)
    # Across: the trace of the strain in the tangent plane does not depend on the axes in it.
    middle = points[:, places.edges].mean(axis=2)
    lead = np.gradient(middle, mesh.axial_positions, axis=0, edge_order=1)
    across = lead - np.sum(lead * along, axis=2, keepdims=True) * along
    across /= np.linalg.norm(across, axis=2, keepdims=True)
    assert read[:, 1] == pytest.approx(np.einsum("lgi,ij,lgj->gl", across, strain, across), abs=1e-9)
    assert read[:, 2] == pytest.approx(2.0 * np.einsum("lgi,ij,lgj->gl", along, strain, across), abs=1e-9)


@pytest.mark.validation
def test_a_flank_and_the_other_have_the_same_root_stress(gauges):
    """A gear turned by 180 degrees about the middle of a tooth is itself."""
    other = root_gauges(fzg_c().pinion, -1)
    assert middle_stress(other, 37.72e-3) == pytest.approx(middle_stress(gauges[0], 37.72e-3), rel=1e-6)


def test_hertz_stress_at_the_pitch_point_is_that_of_iso_6336_2():
    """A spur pair with contact ratio one has Z_eps = 1: the standard's nominal stress is Hertz at the pitch point."""
    pair = fzg_c()
    force = 10e3
    line_load = np.array([force / math.cos(pair.pinion.transverse_pressure_angle) / WIDTH])
    found = hertz_stress(pair, line_load, np.array([pair.path_pitch_point]))[0]
    ratio = math.sqrt((4.0 - pair.transverse_contact_ratio) / 3.0)
    assert found * ratio == pytest.approx(nominal_contact_stress(pair, force), rel=1e-6)


@pytest.mark.parametrize("member", [0, 1])
def test_tip_edges_that_dig_in_above_a_fillet_bend_less_than_loads_at_the_tip(gauges, member):
    """All load on a twelfth of the face at one end of the path: what it presses in beside a gauge is no bending."""
    pair = fzg_c()
    axial = (np.arange(12) - 5.5) / 12.0 * WIDTH
    load = np.zeros((1, 1, 1, 1, 1, 12))
    load[..., -1] = 1e6
    deep, tip = (pair.path_start, pair.path_end)[:: -1 if member else 1]

    def root(path: float) -> float:
        pmc = (path - pair.path_pitch_point) / pair.transverse_base_pitch
        names = ("pmc", "torque", "centre_distance", "misalignment", "tooth", "axial_position")
        coordinates = {
            "pmc": [pmc],
            "torque": [100.0],
            "centre_distance": [pair.centre_distance],
            "misalignment": [0.0],
        }
        states = xr.Dataset({"line_load": (names, load)}, {**coordinates, "tooth": [0.0], "axial_position": axial})
        return float(mesh_cycle_stress(pair, states, gauges).root[0, 0, member])

    assert root(deep) < root(tip)  # five times as much if gauges read loads beside them
    assert root(deep) == pytest.approx(root(pair.path_pitch_point), rel=0.15)
