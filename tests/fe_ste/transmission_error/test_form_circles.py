"""Contact that reaches the end of the involute: cut off there, in balance, and the share beyond counted."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fe_ste.contact.kinematics import ContactSettings, FlankPair, reaches_form_circle, share_beyond
from fe_ste.elasticity.flank import FlankCompliance
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.stores import write_dataset
from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
from fe_ste.transmission_error.search import contact_state, hertz_half_width
from fe_ste.transmission_error.states import CUT_OFF
from fe_ste.transmission_error.table import MeshTable, TableError, TableInput
from fe_ste.transmission_error.transmission_error import static_transmission_error

COARSE = MeshSettings(layers=4, flank=8, thickness=6)
OVERLOAD = 1000.0
"""Torque, N m, ten times the load that the pair would be given: contact is then wide enough to pass the end."""


def low_tip() -> GearPair:
    """Spur gears of which the wheel's tip comes within 0.13 % of the flank to the pinion's form circle."""
    small = Gear(name="small", teeth=24, normal_module=3e-3, profile_shift=0.9, face_width=20e-3, held_diameter=36e-3)
    large = Gear(name="large", teeth=36, normal_module=3e-3, profile_shift=-0.9, face_width=20e-3, held_diameter=54e-3)
    thinned = [dataclasses.replace(gear, tooth_thinning=30e-6) for gear in (small, large)]
    return GearPair(name="low tip", pinion=thinned[0], gear=thinned[1], centre_distance=90e-3)


def planet_and_ring() -> tuple[GearPair, float]:
    """First stage of the 5 MW reference gearbox, with a third of the sun's torque at 12.1 rpm of the rotor.

    A. R. Nejad, Y. Guo, Z. Gao, T. Moan, Development of a 5 MW reference gearbox for offshore wind turbines, Wind
    Energy 19 (2016) 1089-1106, table V; bores and the rim's outside are assumed, and 0.1 mm of backlash on each tooth.
    """
    common = {"normal_module": 45e-3, "face_width": 491e-3, "tooth_thinning": 1e-4}
    planet = Gear(name="planet", teeth=17, profile_shift=0.802, tip_diameter=905.440e-3, held_diameter=0.4, **common)
    ring = Gear(
        name="ring",
        teeth=56,
        internal=True,
        profile_shift=0.501,
        tip_diameter=2475.087e-3,
        held_diameter=3.024,
        **common,
    )
    of_sun = 5e6 / (12.1 * math.pi / 30.0) / (1.0 + 56.0 / 19.0) / 3.0
    return GearPair(name="planet and ring", pinion=planet, gear=ring, centre_distance=863e-3), of_sun * 17.0 / 19.0


@pytest.fixture(scope="module")
def spur() -> PairCompliance:
    return pair_compliance(low_tip(), COARSE, ContactSettings(slices=8))


@pytest.fixture(scope="module")
def overloaded(spur: PairCompliance) -> xr.Dataset:
    return static_transmission_error(spur, OVERLOAD, 50)


def test_a_published_five_megawatt_stage_is_solved_at_every_position() -> None:
    """The ring's tip comes within 0.4 % of the flank to the planet's form circle, and contact with it.

    It does not pass it: the tip's own edge ends the contact first, so that nothing is cut off.
    """
    pair, torque = planet_and_ring()
    compliance = pair_compliance(pair, COARSE, ContactSettings(slices=8))
    curve = static_transmission_error(compliance, torque, 25)
    assert bool(curve.converged.all())
    at_end = [
        reaches_form_circle(compliance.flanks, state.cells, state.solution.force)
        for state in (contact_state(compliance, torque, p / 25) for p in range(25))
    ]
    assert 1 <= sum(at_end) <= 4
    assert float(curve[CUT_OFF].max()) < 1e-4
    assert float(curve.ste.std()) > 0.0


def test_a_state_cut_off_at_a_form_circle_is_in_balance_and_presses_on_no_fillet(
    spur: PairCompliance, overloaded: xr.Dataset
) -> None:
    (cut,) = np.flatnonzero(overloaded[CUT_OFF].values.ravel() == overloaded[CUT_OFF].values.max())
    state = contact_state(spur, OVERLOAD, cut / 50)
    force = state.solution.force
    assert 1e-3 < state.truncated_load < 1e-2
    assert force.sum() == pytest.approx(state.normal_load, rel=1e-10)
    # Forces act along the line of action: their levers about gear 1's axis are its base radius.
    assert force.sum() * spur.pair.pinion.base_radius == pytest.approx(OVERLOAD, rel=1e-10)
    assert share_beyond(spur.flanks, state.cells, force) < 1e-12
    assert (force >= 0.0).all()


def test_what_is_cut_off_hardly_moves_the_curve(overloaded: xr.Dataset) -> None:
    """A neighbour of a position that is cut off has nothing beyond, and the curve goes on smoothly between them."""
    curve, share = overloaded.ste.values.ravel(), overloaded[CUT_OFF].values.ravel()
    assert bool(overloaded.converged.all())
    assert 1 <= np.count_nonzero(share) <= 4
    bends = np.abs(np.roll(curve, 1) - 2.0 * curve + np.roll(curve, -1))
    assert bends[share > 0.0].max() <= np.quantile(bends[share == 0.0], 0.9)


def test_the_share_cut_off_does_not_depend_on_the_cells(overloaded: xr.Dataset) -> None:
    """Three times as many cells across the contact and slices along it: the same state to 0.1 %, its share to 15 %."""
    fine = pair_compliance(low_tip(), COARSE, ContactSettings(slices=24, cells=27))
    cut = int(overloaded[CUT_OFF].values.argmax())
    state = contact_state(fine, OVERLOAD, cut / 50)
    assert state.solution.approach == pytest.approx(float(overloaded.ste[cut, 0, 0, 0]), rel=1e-3)
    assert state.truncated_load == pytest.approx(float(overloaded[CUT_OFF].max()), rel=0.15)


@pytest.mark.parametrize("place", [0.0, 0.4, -0.4])
def test_the_share_beyond_an_end_is_that_of_the_ellipse_of_hertz(place: float) -> None:
    """The flank of the wheel is made to end near the pitch point, `place` half widths above the contact line.

    A strip of Hertz bears the share (acos x - x sqrt(1 - x^2)) / pi beyond x half widths (Johnson, Contact Mechanics,
    4.2). Cells of a seventh of a half width, 3 % of the load; what is cut off goes on the rest, which yields more.
    """
    gear = Gear(name="gear", teeth=40, normal_module=3e-3, face_width=20e-3, held_diameter=60e-3)
    pair = GearPair(name="spur", pinion=gear, gear=gear, centre_distance=120e-3)
    whole = pair_compliance(pair, COARSE, ContactSettings(slices=8, cells=27))
    torque = 200.0
    width = hertz_half_width(pair, torque / pair.pinion.base_radius / pair.face_width)
    # One pair of teeth touches at the pitch point, where arc lengths along the flank change by r_b tan(alpha).
    end = math.tan(pair.working_pressure_angle) - place * width / (
        gear.base_radius * math.tan(pair.working_pressure_angle)
    )
    ended = dataclasses.replace(whole, flanks=(whole.flanks[0], _beginning_at(whole.flanks[1], end)))
    plain, cut = contact_state(whole, torque, 0.0), contact_state(ended, torque, 0.0)
    beyond = (math.acos(place) - place * math.sqrt(1.0 - place**2)) / math.pi
    assert cut.truncated_load == pytest.approx(beyond, abs=0.03)
    assert share_beyond(ended.flanks, cut.cells, cut.solution.force) < 1e-3  # an arc of one gear, seen on the other
    assert cut.solution.approach > plain.solution.approach


def _beginning_at(flank: FlankCompliance, roll: float) -> FlankCompliance:
    rolls = flank.roll.copy()
    rolls[0] = roll
    return dataclasses.replace(flank, roll=rolls)


def test_flanks_that_end_in_edges_count_nothing(spur: PairCompliance) -> None:
    """A relieved root has an edge: load ends there in the gearbox, too."""
    pinion = dataclasses.replace(spur.pair.pinion, root_form_diameter=2.0 * spur.pair.pinion.form_radius + 0.6e-3)
    pair = dataclasses.replace(spur.pair, pinion=pinion)
    curve = static_transmission_error(pair_compliance(pair, COARSE, ContactSettings(slices=8)), OVERLOAD, 12)
    assert bool(curve.converged.all())
    assert float(curve[CUT_OFF].max()) == 0.0
    kinematics = FlankPair.from_pair(pair, 0.0, 1.0)
    assert kinematics.form_roll_1 == pytest.approx(pinion.root_form_roll_length / pinion.base_radius)


@pytest.mark.validation
def test_a_large_misalignment_presses_on_one_end_of_the_face_in_balance() -> None:
    """0.6 mm over the face of 491 mm, and three times the load: a wedge bears at its end, and comes to form circles.

    Moments: the load's centre is where the forces' sum of moments says. A mesh and cells twice as fine as the others
    move the transmission error by 2 %: four layers of elements are coarse for a wedge.
    """
    pair, torque = planet_and_ring()
    misalignment = 0.6e-3 / pair.face_width
    coarse, fine = (
        pair_compliance(pair, mesh, ContactSettings(slices=slices))
        for mesh, slices in ((COARSE, 12), (MeshSettings(layers=8, flank=12, thickness=8), 24))
    )
    for pmc in (0.0, 0.92, 0.96):
        state = contact_state(coarse, 3.0 * torque, pmc, misalignment)
        force = state.solution.force
        assert force.sum() == pytest.approx(state.normal_load, rel=1e-10)
        assert (force >= 0.0).all() and share_beyond(coarse.flanks, state.cells, force) < 1e-9
        centre = force @ coarse.axial[state.cells.layer] / force.sum()
        assert -0.5 * pair.face_width < centre < -0.05 * pair.face_width
        # Derivative of the transmission error by misalignment is the centre of a little more load.
        step = 1e-7
        ahead, behind = (
            contact_state(coarse, 3.0 * torque, pmc, misalignment + turn).solution.approach for turn in (step, -step)
        )
        per_load = state.solution.force_per_load @ coarse.axial[state.cells.layer]
        cosine = math.cos(pair.pinion.base_helix_angle)
        assert (ahead - behind) / (2.0 * step) == pytest.approx(per_load * cosine, rel=1e-3)
        finer = contact_state(fine, 3.0 * torque, pmc, misalignment)
        assert state.solution.approach == pytest.approx(finer.solution.approach, rel=0.03)


# --- stored tables -------------------------------------------------------------------------------


WANTED = TableInput(pair=low_tip(), torque=(100.0,), positions=3, mesh=COARSE, contact=ContactSettings(slices=8))


def stored_before(path: Path, unsolved: int) -> None:
    """A table as it was stored when contact could not end at a form circle."""
    dataset = MeshTable.compute(WANTED).dataset.drop_vars(CUT_OFF)
    dataset["converged"] = dataset["converged"] & (dataset["pmc"] >= unsolved / 3.0)
    write_dataset(path, dataset)


def test_an_older_table_that_is_whole_is_read_and_nothing_was_cut_off(tmp_path: Path) -> None:
    stored_before(tmp_path / "pair.nc", 0)
    table = MeshTable.open(tmp_path / "pair.nc", WANTED)
    assert table.dataset[CUT_OFF].dims == table.dataset["ste"].dims
    assert float(np.abs(table.dataset[CUT_OFF]).max()) == 0.0
    assert table.dataset[CUT_OFF].attrs["units"] == "1"


def test_an_older_table_with_unsolved_states_is_computed_again(tmp_path: Path) -> None:
    stored_before(tmp_path / "pair.nc", 1)
    with pytest.raises(TableError, match=": contains 1 states that this version can solve; recompute it"):
        MeshTable.open(tmp_path / "pair.nc", WANTED)
