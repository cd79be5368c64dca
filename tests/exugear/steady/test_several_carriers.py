"""Stiffness that varies with the angles of several carriers: two planetary stages, each with a flexible ring gear."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.steady.balance.neighbours import with_needed_neighbours
from exugear.steady.balance.response import dissipated_and_given, signals
from exugear.steady.campbell import frequencies_over_angle, modes_over_speed
from exugear.steady.findings import response_findings
from exugear.steady.harmonics.lines import Modulator, line_set, modulated
from exugear.steady.mean_system.carrier_stability import growth_over_carrier
from exugear.steady.mean_system.mean_system import mean_modes, mean_system, unsuitable
from exugear.steady.point_solver import PointSolver
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset
from exugear.steady.steady_response import response_of
from exugear.system.modes import fastest_growth

from ...optional_libraries import needs_meshio
from ..cases.assembled import assembled
from ..cases.ring import ring_content, two_stage_content, write_rim
from ..cases.steady_runs import apart_over_time, planets_apart_over_time, solver_of

pytestmark = needs_meshio

SPEED = 8.0
RANGE = (7.0, 9.0)
DAMPED = {"mesh_time_s": 2e-5, "bearing_time_s": 4e-5, "coupling_time_s": 4e-5, "body_time_s": 4e-5}
"""Free vibration of the coupling between the stages decays within a run."""


def stages(grc, stiffness, folder, ovals=(0.01, 0.01), planets=3, **more):
    """Two stages whose rims are thinner at two opposite places by these (m); with two planets the second is rigid."""
    content = two_stage_content(grc, folder, "second.vtu" if planets > 2 else "") | {"damping": DAMPED} | more
    write_rim(folder / "rim.vtu", oval=ovals[0])
    write_rim(folder / "second.vtu", oval=ovals[1])
    content["bodies"]["planet_2"]["planet_angles_deg"] = [360.0 * n / planets for n in range(planets)]
    return assembled(Gearbox.from_dict(content, str(folder / "stages.toml")), Choice("flexible"), stiffness)


@pytest.fixture(scope="module")
def two_rings(grc, stiffness, tmp_path_factory):
    return stages(grc, stiffness, tmp_path_factory.mktemp("stages"))


@pytest.fixture(scope="module")
def solver(two_rings):
    return solver_of(two_rings, RANGE, "parametric", 2)


@pytest.mark.validation
def test_damping_takes_the_power_that_the_meshes_of_both_stages_give(solver):
    assert solver.model.waves.varying_carriers == ("carrier", "carrier_2")
    taken, given = dissipated_and_given(solver.model, solver.response(SPEED))
    assert taken > 0.0
    assert given == pytest.approx(taken, rel=1e-6)


@pytest.mark.validation
@pytest.mark.parametrize("method", ["parametric", "nonlinear"])
def test_a_run_with_two_flexible_ring_gears_stays_on_its_steady_state(two_rings, method):
    """RK4 at 1/120 kHz. One carrier turns 5.7 times as fast as the other; 35 um overall, near a resonance."""
    model = solver_of(two_rings, RANGE, "parametric", 6).model
    solver = PointSolver(with_needed_neighbours(model, np.array([SPEED]))[0], method)
    error, overall, _ = planets_apart_over_time(solver, SPEED, 1.4, 1.0 / 120e3, 0.6)
    assert error < (2e-3 if method == "parametric" else 1e-3) * overall


OTHER_EXCITATIONS = {
    "run-out of the first sun": {"deviations": {"one": {"body": "lss", "gear": "sun", "runout_um": 60.0}}},
    "displaced pin of the second stage": {"pins": {"late": {"body": "planet_2_1", "tangential_um": 20.0}}},
    "torque on the second sun": {"excitations": {"one": {"body": "lss_2", "orders": [2], "torque_N_m": [50.0]}}},
}


@pytest.mark.validation
@pytest.mark.parametrize("more", OTHER_EXCITATIONS.values(), ids=OTHER_EXCITATIONS)
def test_a_run_with_orders_of_shafts_stays_on_its_steady_state(grc, stiffness, tmp_path, more):
    """RK4 at 1/120 kHz, mesh frequencies up to the fourth harmonic."""
    assembly = stages(grc, stiffness, tmp_path, **more)
    model = solver_of(assembly, RANGE, "parametric", 4).model
    solver = PointSolver(with_needed_neighbours(model, np.array([SPEED]))[0], "parametric")
    assert apart_over_time(solver, SPEED, 1.2, 1.0 / 120e3, 0.6, assembly) < 3e-3


@pytest.mark.validation
def test_passing_planets_of_one_stage_feel_how_the_ring_of_the_other_gives(grc, stiffness, tmp_path):
    """The ring of the second stage alone is oval. RK4 at 1/120 kHz.

    Its planets cause vibration at nine turns of their carrier, which was 1.5 % off while the ring of the first stage
    counted by its mean.
    """
    assembly = stages(grc, stiffness, tmp_path, (0.0, 0.03))
    model = solver_of(assembly, RANGE, "parametric", 6).model
    solver = PointSolver(with_needed_neighbours(model, np.array([SPEED]))[0], "parametric")
    error, overall, _ = planets_apart_over_time(solver, SPEED, 1.4, 1.0 / 120e3, 0.6)
    assert error < 1.5e-3 * overall


@pytest.mark.validation
def test_a_run_of_two_planets_behind_a_flexible_ring_gear_stays_on_its_steady_state(grc, stiffness, tmp_path):
    """RK4 at 1/120 kHz. The second carrier has two planets in a rigid ring gear."""
    assembly = stages(grc, stiffness, tmp_path, planets=2)
    model = solver_of(assembly, RANGE, "parametric", 6).model
    assert model.waves.varying_carriers == ("carrier", "carrier_2")
    solver = PointSolver(with_needed_neighbours(model, np.array([SPEED]))[0], "parametric")
    assert apart_over_time(solver, SPEED, 1.4, 1.0 / 120e3, 0.6) < 3e-3


@pytest.mark.validation
def test_two_halves_of_a_ring_gear_are_the_whole(grc, stiffness, tmp_path):
    """A ring gear whose teeth are two meshes of half of the stiffness, as those of a herringbone gear."""
    content = ring_content(grc, tmp_path)
    write_rim(tmp_path / "rim.vtu", oval=0.01)
    found = []
    for halves in (1, 2):
        content["meshes"] |= {"again": dict(content["meshes"]["ring_planet"])} if halves == 2 else {}
        gearbox = Gearbox.from_dict(content, str(tmp_path / "rim.toml"))
        shared = stiffness | {"ring_planet": stiffness["ring_planet"] / halves}
        solver = solver_of(assembled(gearbox, Choice("flexible"), shared), RANGE, "parametric", 2)
        found.append(signals(solver.model, solver.response(SPEED))[:, 0])
    assert np.linalg.norm(found[1] - found[0]) < 1e-5 * np.linalg.norm(found[0][1:])


@pytest.mark.validation
def test_one_carrier_turned_at_a_time_has_the_frequencies_of_a_stage_by_itself(two_rings):
    """Modes with all carriers at zero angle come first, and each carrier has as many angles as its places."""
    system = mean_system(two_rings, np.array(RANGE))
    held = list(system.at_angles())
    places = [len(system.frame.places_of(name)) for name in ("carrier", "carrier_2")]
    assert len(held) == sum(places) - 1
    np.testing.assert_array_equal(held[0].stiffness, system.frozen.stiffness)
    turned = held[places[0]].stiffness[1] - held[0].stiffness[1]
    rims = [two_rings.elastic_slices[name] for name in ("housing", "housing_2")]
    first, second = (np.abs(turned[own, own]).max() for own in rims)
    assert first < 1e-6 * second
    tracks = modes_over_speed(system.frozen, *RANGE, 300.0)
    over_angle = frequencies_over_angle(system, tracks)
    every = np.array([mean_modes(one, SPEED)[0].imag[:10] for one in held]) / (2.0 * np.pi)
    assert over_angle[:, 0].min() == pytest.approx((every / every[0]).min(), rel=1e-3)


@pytest.mark.validation
def test_stages_that_do_not_vary_grow_as_the_averaged_system(grc, stiffness, tmp_path, monkeypatch):
    """Without what varies, exponents over a passage of either carrier are the eigenvalues."""
    system = mean_system(stages(grc, stiffness, tmp_path, (0.0, 0.0)), np.array(RANGE))
    known = fastest_growth(system.eigenvalues(SPEED))
    still = tuple((0.0 * damping, 0.0 * stiff) for damping, stiff in system.over_angles)
    object.__setattr__(system, "over_angles", still)
    monkeypatch.setattr("exugear.steady.mean_system.carrier_stability.LARGEST", system.size)
    assert growth_over_carrier(system, SPEED) == pytest.approx(known, rel=1e-6)


def test_orders_at_which_several_carriers_coincide_are_one():
    """Twice the first carrier's rotation is the second one's; passages of both are included beside the mean alone."""
    carriers = [Modulator(1.0, (0,), 1, 0, 1), Modulator(2.0, (1,), 1, 0, 1)]
    lines = modulated(line_set([40.3, 91.7], 1), carriers, 2)
    orders = lines.orders
    assert len(np.unique(orders.round(9))) == len(orders)
    assert {0.0, 1.0, 2.0, 3.0, 4.0, 6.0} <= set(orders.round(9).tolist())
    beside = lines.index[lines.index[:, 0] != 0][:, 2:]
    assert not (beside != 0).all(axis=1).any()
    # 47 passages of one are 11 of the other: no line but the mean stands still.
    slow = modulated(line_set([40.3, 91.7], 1), [Modulator(11.0, (0,), 4, 0, 4), Modulator(47.0, (1,), 3, 0, 3)], 12)
    assert np.count_nonzero(slow.orders < 1e-9) == 1


@pytest.mark.validation
def test_what_varies_with_several_carriers_is_told(two_rings):
    data = to_dataset(response_of(two_rings, SteadySettings(SpeedRange(*RANGE, 2), harmonics=1, at_resonances=False)))
    assert data.attrs["varying_carrier"] == "carrier, carrier_2"
    said = " ".join(finding.text for finding in response_findings(data))
    assert "stiffness varies with the angles of carrier and carrier_2" in said
    assert "with carrier and carrier_2 at zero angles; as one of them turns" in said


def test_a_gearbox_with_flexible_ring_gears_in_two_stages_is_not_refused(two_rings):
    assert unsuitable(two_rings) == ""
