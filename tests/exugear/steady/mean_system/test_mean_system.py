"""The rotating frame and the mean system in it: constant, and at rest that of the eigenmodes."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.steady.mean_system.mean_system import mean_system, tangents
from exugear.steady.mean_system.planet_sets import SteadyError, planet_sets
from exugear.steady.mean_system.rotating_frame import RotatingFrame
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_response import response_of
from exugear.system.bearings.stiffness import planet_supports, with_equal_planets
from exugear.system.build import assemble
from exugear.system.modes import eigenmodes
from exugear.system.statics import linearise

BUSHING = Choice("bushing")


@pytest.fixture(scope="module")
def assembly(grc, stiffness):
    return assemble(grc, BUSHING, stiffness)


@pytest.fixture(scope="module")
def system(assembly):
    return mean_system(assembly, np.array([0.0, 22.5]))


def test_the_derivatives_of_the_frame_are_those_of_differences(assembly):
    frame, psi, step = RotatingFrame(assembly, planet_sets(assembly)), 0.4, 1e-4
    for parts in (frame.matrices, frame.rolling):
        behind, at, ahead = (np.array(parts(psi + n * step)) for n in (-1, 0, 1))
        np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * step), at[1], rtol=0.0, atol=1e-7 * abs(at).max())
        np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * step), at[2], rtol=0.0, atol=1e-7 * abs(at).max())


def test_forces_at_several_states_at_once_are_those_at_each(assembly):
    random = np.random.default_rng(7)
    q, v = 1e-5 * random.normal(size=(2, 5, assembly.size))
    alone = np.array([assembly.forces(*state) for state in zip(q, v, strict=True)])
    np.testing.assert_allclose(assembly.forces(q, v), alone, rtol=0.0, atol=1e-12 * abs(alone).max())


def test_rolling_closes_no_mesh_and_strains_no_bearing_wherever_the_carrier_stands(assembly):
    assembly = assembly.unloaded
    frame = RotatingFrame(assembly, planet_sets(assembly))
    rest = np.zeros(assembly.size)
    q, v, _ = frame.state(1.3, 10.0, rest)
    state = assembly.mesh_states(q, v)
    # Deflections against lengths of the order of a metre, forces against 1e9 N/m times a micrometre.
    assert np.abs(state[:, 0]).max() < 1e-12
    assert np.abs(assembly.bearing_loads(q, rest)[:, :3]).max() < 1e-2


def test_at_rest_the_stiffness_is_that_of_the_eigenmodes_in_turned_coordinates(system):
    """Both by differences of the same forces, over the places of the carrier between one planet and the next."""
    frame = system.frame
    known = np.zeros_like(system.mass)
    for psi in frame.places:
        t = frame.matrices(psi)[0]
        q, _, _ = frame.state(psi, 0.0, system.static[0])
        known += t.T @ linearise(frame.assembly, q).total_stiffness @ t / len(frame.places)
    size = np.sqrt(np.abs(np.diag(known)))
    assert (np.abs(system.stiffness[0] - known) / np.outer(size, size)).max() < 1e-6


def test_at_rest_the_frequencies_are_those_of_the_eigenmodes(system, grc, stiffness):
    """Equal planets move them by less than the spread of their bearings' stiffness, 1.7 %; most by nothing."""
    known = eigenmodes(grc, BUSHING, stiffness).frequency
    values = system.eigenvalues(0.0)
    found = np.sort(np.abs(values[values.imag > 1.0])) / 2.0 / np.pi
    known = known[known > 1.0]
    apart = np.abs(found[:, None] - known).min(axis=1) / found
    assert np.median(apart) < 2e-4  # teeth that resist tilting tie most modes to the planets
    assert apart.max() < 0.01


def test_nothing_changes_as_the_carrier_turns(system):
    """Largest change of the stiffness over the whole of it; second-order geometry of static tilts leaves 1e-6."""
    u, speed = system.static[1], float(system.speeds[1])
    damping, stiffness = tangents(system.frame, 0.9, speed, u)
    assert np.linalg.norm(stiffness - system.stiffness[1]) < 1e-5 * np.linalg.norm(stiffness)
    assert np.linalg.norm(damping - system.damping[1]) < 1e-5 * np.linalg.norm(damping)


def test_parabolas_over_speed_are_exact(assembly, system):
    """But for the means over the carrier's places, which are those at the middle speed: 1.4e-7."""
    other = mean_system(assembly, np.array([5.0, 9.0]))
    for speed in (5.0, 9.0):
        for parts in ("stiffness_at", "damping_at"):
            here, there = getattr(system, parts)(speed), getattr(other, parts)(speed)
            assert np.linalg.norm(here - there) < 1e-6 * np.linalg.norm(here)


def test_the_drive_takes_what_the_load_asks_for(system, grc):
    """240 kN m over the ratio, but for moments of tilted planets: 1e-5 of it."""
    assert system.torque_at(10.0) == pytest.approx(-240e3 / grc.train.ratio, rel=1e-4)


def test_the_spread_of_planets_bearings_is_that_of_their_operating_points(assembly, system):
    """What made them equal, 1.7 % of the stiffness; after it they are equal, each along its own radius."""
    supports = planet_supports(assembly.supports, system.frame.sets[0].names, system.frame.sets[0].angles)
    same, left = with_equal_planets(assembly.connectors, supports)
    np.testing.assert_allclose(same.stiffness, assembly.connectors.stiffness, rtol=1e-9, atol=1e-3)
    assert left < 1e-9
    assert 0.005 < system.planet_spread < 0.05


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_displaced_pins_leave_matrices_that_do_not_change_as_the_carrier_turns(grc, stiffness, variant):
    """The mean of the displacement, a third of it for all planets, is in the static state; the rest excites.

    Mesh stiffness does not depend on the load here, so that the matrices are those of nominal pins, except for the
    bearings of the planets, whose mean stiffness under unequal loads is another: 2e-4 of the stiffness.
    """
    speeds = np.array([0.0, 10.0])
    nominal = mean_system(assemble(grc, Choice(variant), stiffness), speeds)
    varied = grc.varied({"pins": {"one": {"body": "planet_1", "tangential_um": 20.0}}})
    found = mean_system(assemble(varied, Choice(variant), stiffness), speeds)
    assert found.variation < 1e-4
    change = np.linalg.norm(found.stiffness - nominal.stiffness) / np.linalg.norm(nominal.stiffness)
    assert change < (1e-9 if variant == "rigid" else 1e-3)


def test_gears_that_only_roll_are_refused_before_anything_is_linearised(grc, stiffness):
    made = assemble(grc, Choice("rigid", "kinematic"), stiffness)
    with pytest.raises(SteadyError, match=": kinematic constraint without vibration; use another mesh model"):
        response_of(made, SteadySettings(SpeedRange(0.0, 10.0, 3)))
