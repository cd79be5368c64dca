"""The reference analysis on coarse meshes; the fine ones are stored in benchmarks/nonlinear."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from fe_ste.elasticity.gear_mesh import ContactMesh
from fe_ste.geometry.gears import GearPair
from fe_ste.reference.newton import EquilibriumError, NewtonSettings
from fe_ste.reference.position import NonlinearSettings, nonlinear_position
from fe_ste.transmission_error.search import normal_load

from ..cases.gears import SPUR_PAIR

TORQUE = 340.0
COARSE = NonlinearSettings(
    teeth=3,
    mesh=ContactMesh(layers=3, contact_elements=4, growth=0.8, thickness=6, fillet=3, root=2, rim=10, far_flank=4),
)


@pytest.fixture(scope="module")
def solved():
    return nonlinear_position(SPUR_PAIR, TORQUE, 0.0, COARSE)


@pytest.mark.validation
def test_a_coarse_position_of_open_sectors_comes_near_the_finest_mesh():
    # 161,880 unknowns, benchmarks/nonlinear: 31.720 um, itself some 0.5 to 1.5 % below its limit.
    found = nonlinear_position(SPUR_PAIR, TORQUE, 0.0, dataclasses.replace(COARSE, closed=False))
    assert found.ste == pytest.approx(31.720e-6, rel=0.02)


@pytest.mark.validation
def test_contact_forces_balance_the_torque_on_both_gears(solved):
    force, points = solved.equilibrium.contact_force, solved.model.bricks.points + solved.equilibrium.displacement
    moment = np.cross(points, force)[: solved.pinion_nodes, 2].sum()
    other = np.cross(points - [SPUR_PAIR.centre_distance, 0, 0], force)[solved.pinion_nodes :, 2].sum()
    # Gear 1 is pushed back, gear 2 carries the hub's torque to the tolerance of the equilibrium; the point of contact
    # moves with the deflection on gear 1, whose torque is that of its reaction.
    assert other == pytest.approx(-TORQUE * SPUR_PAIR.ratio, rel=1e-6)
    assert moment == pytest.approx(-TORQUE, rel=1e-3)
    assert np.abs(force.sum(axis=0)).max() < 1e-9 * np.abs(force).sum()


@pytest.mark.validation
def test_pressures_push_and_sum_to_the_normal_force(solved):
    found = solved.equilibrium
    assert found.pressure.min() >= 0
    assert found.pressure @ found.weight == pytest.approx(normal_load(SPUR_PAIR, TORQUE), rel=2e-3)
    assert sum(solved.load_share.values()) == pytest.approx(1.0)
    assert solved.load_share[0] > 0.99  # single contact at the pitch point


@pytest.mark.validation
def test_geometric_nonlinearity_adds_less_than_a_thousandth(solved):
    small = nonlinear_position(SPUR_PAIR, TORQUE, 0.0, dataclasses.replace(COARSE, finite_deformation=False))
    # CalculiX: +0.07 % (benchmarks/calculix).
    assert 0.0002 < solved.ste / small.ste - 1 < 0.0015


@pytest.mark.validation
def test_an_internal_helical_pair_turns_the_right_way(ring_planet):
    # Narrow gears, whose three teeth hold all contacts.
    narrow = GearPair(
        name="ring_planet",
        pinion=dataclasses.replace(ring_planet.pinion, face_width=30e-3),
        gear=dataclasses.replace(ring_planet.gear, face_width=30e-3),
        centre_distance=ring_planet.centre_distance,
    )
    found = nonlinear_position(narrow, 3000.0, 0.0, COARSE)
    stiffness = 3000.0 / narrow.pinion.base_radius / found.ste / narrow.face_width
    # ISO 6336: mesh stiffness of steel gears 14 to 20 N/(mm um).
    assert 5e9 < stiffness < 25e9
    assert len([share for share in found.load_share.values() if share > 0.05]) >= 2


@pytest.mark.validation
def test_a_torque_too_large_names_position_load_step_and_iteration():
    mesh = ContactMesh(layers=3, contact_elements=2, growth=2.0, thickness=3, fillet=1, root=1, rim=3, far_flank=4)
    settings = NonlinearSettings(teeth=3, mesh=mesh, newton=NewtonSettings(most_iterations=3))
    with pytest.raises(EquilibriumError, match=r"position 0.5 .*torque 1e\+07 N m: load step \d+ .*iteration \d+"):
        nonlinear_position(SPUR_PAIR, 1e7, 0.5, settings)


@pytest.mark.parametrize("torque", [0.0, -1.0, math.nan])
def test_a_torque_that_does_not_press_is_refused(torque):
    with pytest.raises(ValueError, match="torque"):
        nonlinear_position(SPUR_PAIR, torque, 0.0, COARSE)


@pytest.mark.parametrize("teeth", [0, 2])
def test_sectors_without_a_middle_tooth_are_refused(teeth):
    with pytest.raises(ValueError, match="odd"):
        NonlinearSettings(teeth=teeth)
