"""Steady states on non-linear bearings: against runs in time, the linearised case, differences, balance of power."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.steady.balance.response import dissipated_and_given, signals
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import stored_or_computed
from exugear.steady.steady_response import follow_branch
from exugear.system.build import assemble

from ..cases import table as table_case
from ..cases.assembled import assembled
from ..cases.bearing import BEARING_CASE, NAMES, NON_LINEAR
from ..cases.spur import SPUR_CASE
from ..cases.steady_runs import apart, error_of_tangents, solver_of

PLAIN = Gearbox.from_dict(tomllib.loads(BEARING_CASE)).varied(NON_LINEAR)
CLEARANCES = {
    "housing.factor": 1.0,  # a clearance closes without load
    "bearings.ball.catalogue.radial_clearance_mm": 0.02,
    "bearings.roller.catalogue.radial_clearance_mm": 0.01,
}
LOOSE = PLAIN.varied(CLEARANCES)
FAMILIES = ("pl_a", "pl_b", "lss_a", "lss_bc", "ims_a", "ims_bc", "hss_a", "hss_bc")
"""Bearings of the GRC that carry load; those of the carrier carry none but the weight, which the case leaves out."""


def varying(share):
    cycle = 2.0 * np.pi * np.arange(50) / 50
    return {"spur": 3e8 * (1.0 + share * (np.cos(cycle) + 0.4 * np.sin(2.0 * cycle)))}


def spur_solver(gearbox, speeds, share=0.1, method="nonlinear"):
    return solver_of(assemble(gearbox, Choice("bushing"), varying(share)), speeds, method)


@pytest.fixture(scope="module")
def loose_solver():
    return spur_solver(LOOSE, (20.0, 400.0))


@pytest.mark.sample
@pytest.mark.parametrize("gearbox", [PLAIN, LOOSE], ids=["without clearance", "with clearance"])
def test_small_vibration_is_that_of_linear_bearings(gearbox):
    """What laws do beyond their tangents is of second order: a tenth of the vibration, a tenth of the difference."""
    apart_by = []
    for share in (0.01, 0.001):
        found = {}
        for level in ("parametric", "nonlinear"):
            solver = spur_solver(gearbox, (99.0, 101.0), share, level)
            found[level] = signals(solver.model, solver.response(100.0))[1:, 0]
        apart_by.append(np.linalg.norm(found["nonlinear"] - found["parametric"]) / np.linalg.norm(found["parametric"]))
    assert apart_by[1] < 0.2 * apart_by[0]


@pytest.mark.sample
@pytest.mark.parametrize("speed", [pytest.param(60.0, marks=pytest.mark.validation), 150.0])
def test_a_spur_pair_on_rollers_and_balls_stays_on_its_steady_state(speed):
    """RK4 at 1/60 kHz; harmonics beyond the tenth and the parabola of the position leave 1e-4."""
    assert apart(spur_solver(PLAIN, (20.0, 400.0)), speed, 0.4, 1.0 / 60e3, 0.2)[0] < 3e-4


@pytest.mark.sample
@pytest.mark.parametrize(("speed", "most"), [(80.0, 3e-4), (110.0, 2e-3), (220.0, 2e-3)])
def test_a_spur_pair_with_clearances_stays_on_its_steady_state(loose_solver, speed, most):
    """At 110 and 220 rad/s it resonates: the response is twice and three times off that of linear bearings."""
    complex_apart, in_amplitude = apart(loose_solver, speed, 0.8, 1.0 / 60e3, 0.4)
    assert complex_apart < most
    assert in_amplitude < 0.5 * most + 1e-4


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize("speed", [60.0, 150.0])
def test_teeth_by_their_table_and_bearings_by_their_elements_stay_on_their_steady_state(monkeypatch, speed):
    """As with linear bearings: 1e-3."""
    monkeypatch.setitem(table_case.STIFFNESS, "spur", 3e8)
    data = {"spur": table_case.surface_of(PLAIN, "spur")}
    solver = solver_of(assemble(PLAIN, Choice("bushing", "table"), data), (20.0, 400.0), "nonlinear", 14)
    assert apart(solver, speed, 0.4, 1.0 / 60e3, 0.2)[0] < 1e-3
    taken, given = dissipated_and_given(solver.model, solver.response(speed))
    assert given == pytest.approx(taken, rel=1e-4)


@pytest.mark.parametrize("speed", [80.0, 110.0, 220.0])
def test_bearings_take_and_give_power_that_is_balanced(loose_solver, speed):
    taken, given = dissipated_and_given(loose_solver.model, loose_solver.response(speed))
    assert given == pytest.approx(taken, rel=1e-6)


def test_the_tangents_of_bearings_are_those_of_differences(loose_solver):
    """Rolling elements that a difference brings into touch leave 1e-5."""
    assert error_of_tangents(loose_solver, 80.0, 1e-11, of_bearings=True) < 1e-4


@pytest.fixture(scope="module")
def grc_rows(grc):
    return grc.varied({f"bearings.{family}.model": "iso16281" for family in FAMILIES})


@pytest.fixture(scope="module")
def rows_solver(grc_rows, stiffness):
    return solver_of(assemble(grc_rows, Choice("bushing"), stiffness), (1.0, 22.5), "nonlinear", 10, 5)


def test_the_tangents_of_planets_bearings_are_those_of_differences(grc_rows, stiffness):
    solver = solver_of(assemble(grc_rows, Choice("bushing"), stiffness), (1.0, 22.5), "nonlinear", 4, 2)
    assert error_of_tangents(solver, 11.0, 1e-11, of_bearings=True) < 1e-4


@pytest.mark.validation
def test_forces_of_bearings_are_those_of_their_law_on_the_motion(grc_rows, stiffness):
    """Lines of the signals, added up at some instants, against the assembly's own bearings in that state.

    Lines that are left out make 2e-3 of the forces. The static loads of the planets differ by 8 % of their mean, and so
    do the tangents of their bearings, which the response has at their mean: 1.4e-2 of what vibrates on them.
    """
    solver = solver_of(assemble(grc_rows, Choice("bushing"), stiffness), (1.0, 22.5), "nonlinear", 8, 3)
    speed, model = 14.0, solver.model
    response = solver.response(speed)
    frequencies, motion = response.interface.frequencies, response.motion
    frame, assembly = model.system.frame, model.system.frame.assembly
    still, planets = model.system.static_at(speed), frame.sets[0]
    names, numbers = [own.name for own in model.signal_names], [support.name for support in assembly.supports]
    planet = [numbers.index(f"pl_a_{n}") for n in (1, 2, 3)]
    known, found = [], []
    for time in (0.0, 0.0123, 0.0451, 0.0777):
        psi, turning = speed * time, np.where(frequencies > 0.0, 2.0, 1.0) * np.exp(1j * frequencies * time)
        moved = (turning @ motion).real, (turning @ (1j * frequencies[:, None] * motion)).real
        loads = assembly.bearing_loads(*frame.state(psi, speed, still + moved[0], moved[1])[:2])
        loads -= assembly.bearing_loads(*frame.state(psi, speed, still)[:2])
        angles = planets.ratio * psi + planets.angles
        radial = loads[planet, 0] * np.cos(angles) + loads[planet, 1] * np.sin(angles)
        known.append([*-loads[numbers.index("hss_a"), :2], *-radial])
        values = dict(zip(names, (turning @ signals(model, response)).real, strict=True))
        waves = [values[f"support_force pl_a {wave} radial"] for wave in ("mean", "cosine", "sine")]
        radial = planets.values(np.array(planets.ratio * psi)) @ waves
        found.append([*(values[f"support_force hss_a {axis}"] for axis in "xy"), *radial])
    known, found = np.array(known), np.array(found)
    assert np.linalg.norm((found - known)[:, :2]) < 6e-3 * np.linalg.norm(known[:, :2])
    assert np.linalg.norm((found - known)[:, 2:]) < 2e-2 * np.linalg.norm(known[:, 2:])


STOP = """
[bearings.stop]
body = "shaft_1"
z_mm = 20.0
model = "iso16281"
[bearings.stop.catalogue]
type = "cylindrical_roller"
bore_mm = 25.0
outer_diameter_mm = 52.0
width_mm = 15.0
radial_clearance_mm = 0.06
"""
HARDLY_LOADED = Gearbox.from_dict(tomllib.loads(SPUR_CASE.replace("[meshes]", STOP + "\n[meshes]", 1))).varied(
    {"housing.factor": 1.0, "bearings.bearing_1.stiffness.radial_N_per_m": 1e8}
)
"""A bearing with clearance beside a linear one that carries nearly all."""


@pytest.fixture(scope="module")
def stop_solver():
    return spur_solver(HARDLY_LOADED, (20.0, 400.0), 0.2)


@pytest.mark.parametrize(("speed", "share", "most"), [(220.0, 0.168, 1e-3), (370.0, 0.484, 2e-3)])
def test_a_bearing_that_comes_free_stays_on_its_steady_state(stop_solver, speed, share, most):
    """First touch is a kink that ten harmonics have to 1e-3; the second speed is beside a resonance."""
    response = stop_solver.response(speed)
    assert response.free == pytest.approx([share], abs=0.02)
    assert apart(stop_solver, speed, 0.6, 1.0 / 60e3, 0.3)[0] < most
    taken, given = dissipated_and_given(stop_solver.model, response)
    assert given == pytest.approx(taken, rel=1e-4)


def test_what_varies_with_bearings_may_be_unstable(loose_solver):
    """The run in time leaves the state that the balance finds, and repeats after two mesh periods."""
    loose_solver.response(260.0)
    assert loose_solver.state.growth > 20.0
    assert "half orders" in loose_solver.state.remark


@pytest.mark.validation
def test_the_file_says_which_bearings_followed_their_law(tmp_path):
    assembly, attributes = assemble(LOOSE, Choice("bushing"), varying(0.1)), {}
    for level in ("parametric", "nonlinear"):
        settings = SteadySettings(SpeedRange(80.0, 90.0, 2), level, at_resonances=False)
        data = stored_or_computed(tmp_path / f"{level}.nc", assembly, settings)
        attributes[level] = data.attrs["bearings_in_time"]
        assert ("unloaded_fraction" in data) == (level == "nonlinear")
        assert "rolling elements to ISO/TS 16281, cage" in data.attrs["bearing_laws"]
    assert attributes == {"parametric": "", "nonlinear": ", ".join(NAMES)}


@pytest.mark.validation
def test_a_branch_on_non_linear_bearings_passes_the_states_at_single_speeds():
    solver, single = (spur_solver(LOOSE, (100.0, 130.0)) for _ in range(2))
    branch = follow_branch(solver, 125.0, 118.0)
    n = len(branch.speed) // 2
    followed = signals(solver.model, solver.response_to(branch.readings[n], branch.speed[n]))[1:, 0]
    found = signals(single.model, single.response(float(branch.speed[n])))[1:, 0]
    assert np.linalg.norm(followed - found) < 1e-4 * np.linalg.norm(found)
    assert branch.growth[n] == pytest.approx(single.state.growth, rel=0.01)


def test_elements_that_pass_are_refused():
    turning = PLAIN.varied({"bearings.roller.cage": "turning"})
    with pytest.raises(SteadyError, match=r"bearings\.roller\.cage = 'turning'.*averaged"):
        spur_solver(turning, (50.0, 60.0))


def test_elements_that_turn_against_their_load_are_refused():
    between = BEARING_CASE.replace(
        '[bearings.roller]\nbody = "shaft_1"', '[bearings.roller]\nbody = "shaft_1"\non = "shaft_2"'
    )
    gearbox = Gearbox.from_dict(tomllib.loads(between)).varied(NON_LINEAR)
    with pytest.raises(SteadyError, match=r"bearings\.roller\.model.*rotate with shaft_2 relative to the load"):
        spur_solver(gearbox, (50.0, 60.0))


@pytest.fixture(scope="module")
def shafts_solver(grc_shafts, stiffness):
    rows = grc_shafts.varied({f"bearings.{family}.model": "iso16281" for family in FAMILIES})
    return solver_of(assembled(rows, Choice("flexible"), stiffness), (1.0, 22.5), "nonlinear", 10, 3)


@pytest.mark.validation
@pytest.mark.long
@pytest.mark.parametrize(("speed", "most"), [(18.0, 3e-4), (10.402, 1e-3)])
def test_elastic_shafts_on_rolling_bearings_stay_on_their_steady_state(shafts_solver, speed, most):
    """As before."""
    assert apart(shafts_solver, speed, 3.0, 1.0 / 120e3, 2.0)[0] < most


@pytest.mark.validation
@pytest.mark.long
@pytest.mark.parametrize(("speed", "most"), [(11.0, 3e-4), (18.0, 3e-4), (14.0, 1.5e-3), (3.218, 1.5e-2), (8.0, 4e-3)])
def test_the_gearbox_on_rolling_bearings_stays_on_its_steady_state(rows_solver, speed, most):
    """RK4 at 1/120 kHz, the last 2 of 3 s.

    The last three are resonances. At 8 rad/s a line meets modes of the planets which three turns of the carrier lead
    from one to the other: planets that share the load unequally couple them, which is left out. At 3.218 rad/s a mode
    has 0.3 % of damping.
    """
    assert apart(rows_solver, speed, 3.0, 1.0 / 120e3, 2.0)[0] < most
