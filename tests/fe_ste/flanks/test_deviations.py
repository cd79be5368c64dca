"""Gaps of single tooth pairs in the finite-element contact."""

from __future__ import annotations

import numpy as np
import pytest

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.flank import flank_compliance
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.transmission_error.compliance import PairCompliance
from fe_ste.transmission_error.search import contact_state
from fe_ste.transmission_error.states import StateAxes
from fe_ste.transmission_error.transmission_error import solve_positions

SPUR_GEAR = Gear(name="gear", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
SPUR = GearPair(name="spur", pinion=SPUR_GEAR, gear=SPUR_GEAR, centre_distance=150e-3)


@pytest.fixture(scope="module")
def spur() -> PairCompliance:
    coarse = MeshSettings(layers=6, flank=10, thickness=8, fillet=2, root=2, rim=6)
    flank = flank_compliance(SPUR_GEAR, 1, coarse)
    return PairCompliance.from_flanks(SPUR, (flank, flank), ContactSettings(slices=16))


@pytest.mark.parametrize("pmc", [0.0, 0.3, 0.55])
def test_a_small_pitch_error_turns_the_gear_by_its_part_of_a_little_more_load(spur: PairCompliance, pmc: float) -> None:
    """The finite difference against the derivative that the table stores; the share of all the load is another."""
    curve = solve_positions(spur, StateAxes.checked(SPUR, [300.0], 20), [round(20 * pmc)])
    step = 2e-9  # no cell changes: 1e-4 of the deflection
    for tooth in (-1, 0, 1):
        back, forth = (
            contact_state(spur.with_tooth_gaps({tooth: gap}), 300.0, pmc).solution.approach for gap in (step, -step)
        )
        part = curve.tangent_load_share[0, 0, 0, 0, tooth - spur.teeth[0]]
        # Spur: the normal lies in the transverse plane. A cell may take up or lose contact within the step.
        assert (back - forth) / (2.0 * step) == pytest.approx(part, abs=1e-3)
    assert curve.tangent_load_share.sum() == pytest.approx(1.0, rel=1e-12)


def test_parts_of_a_little_more_load_are_those_by_difference(spur: PairCompliance) -> None:
    axes = StateAxes.checked(SPUR, [297.0, 300.0, 303.0], 20)
    results = solve_positions(spur, axes, [6])
    low, high = (results.load_share[0, t, 0, 0] * axes.torque[t] for t in (0, 2))
    # The cells grow with the load: 1 % of it moves shares by some 1e-4.
    assert (high - low) / 6.0 == pytest.approx(results.tangent_load_share[0, 1, 0, 0], abs=1e-2)
    # It is not the share of all the load, which a pair in double contact of growing length shows.
    assert np.abs(results.tangent_load_share - results.load_share)[0, 1].max() > 5e-3


def test_slope_by_misalignment_is_the_centre_of_a_little_more_load(spur: PairCompliance) -> None:
    tilt, step = 2e-4, 1e-7
    axes = StateAxes.checked(SPUR, [300.0], 20, misalignment=[tilt - step, tilt, tilt + step])
    results = solve_positions(spur, axes, [3])
    ste = results.values["ste"][0, 0, 0]
    slope = (ste[2] - ste[0]) / (2.0 * step)
    # +z opens: load and a little more load sit at the other end.
    assert results.values["tangent_load_centroid"][0, 0, 0, 1] == pytest.approx(slope, abs=1e-5)
    assert slope < -1e-4
    assert results.values["load_centroid"][0, 0, 0, 1] < -1e-4


def test_equal_gaps_of_all_pairs_are_a_rotation(spur: PairCompliance) -> None:
    everywhere = spur.with_tooth_gaps({int(tooth): 5e-6 for tooth in spur.teeth})
    plain, turned = (contact_state(one, 300.0, 0.4).solution.approach for one in (spur, everywhere))
    assert turned == pytest.approx(plain + 5e-6, rel=1e-9)


def test_a_pair_that_stands_far_back_carries_nothing(spur: PairCompliance) -> None:
    base = contact_state(spur, 300.0, 0.5)
    carrying = sorted(set(base.cells.tooth[base.solution.force > 0].tolist()))
    assert len(carrying) == 2
    late = contact_state(spur.with_tooth_gaps({carrying[0]: 100e-6}), 300.0, 0.5)
    assert set(late.cells.tooth[late.solution.force > 0].tolist()) == {carrying[1]}


def test_pairs_that_never_touch_are_refused(spur: PairCompliance) -> None:
    with pytest.raises(ValueError, match="tooth pair 40: only pairs"):
        spur.with_tooth_gaps({40: 1e-6})
