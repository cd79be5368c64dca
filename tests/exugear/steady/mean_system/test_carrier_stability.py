"""Floquet exponents of stiffness that varies as the carrier turns."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.steady.mean_system.carrier_stability import exponents_of_turning, growth_over_carrier
from exugear.steady.mean_system.mean_system import mean_system
from exugear.system.build import assemble
from exugear.system.modes import fastest_growth, state_matrix

from ...cases import gear_trains
from ..test_unlike_planets import on_unlike_bearings, train

TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize(("speed", "is_stable"), [(6.0, True), (10.0, False), (13.0, True)])
def test_a_rotor_of_unequal_stiffness_is_unstable_between_its_critical_speeds(speed, is_stable, sense):
    """Smith (1933), Proc. R. Soc. A 142, 92: between 9 and 11 rad/s, with little damping that stands still.

    In the frame of the shaft all coefficients are constant. They are here taken in the fixed frame.
    """
    mass, damping, stiffness = 1.0, 0.05, np.diag([81.0, 121.0])
    angles = sense * 2.0 * np.pi * np.arange(8) / 8
    turned = [np.cos(angle) * np.eye(2) + np.sin(angle) * TURN for angle in angles]
    stiffnesses = np.array([r @ stiffness @ r.T for r in turned])
    # Angles of the shaft are counted in its own sense: a shaft that turns backwards passes them in this order, too.
    found = exponents_of_turning(
        mass * np.eye(2), np.tile(damping * np.eye(2), (8, 1, 1)), stiffnesses, 2 * np.pi / speed
    )
    w = sense * speed
    constant = state_matrix(
        mass * np.eye(2),
        damping * np.eye(2) + 2.0 * mass * w * TURN,
        stiffness - mass * w**2 * np.eye(2) + damping * w * TURN,
    )
    known = np.linalg.eigvals(constant).real.max()
    assert (known < 0.0) == is_stable
    assert found.real.max() == pytest.approx(known, abs=2e-3)


@pytest.mark.parametrize("speed", [100.0, -100.0])
def test_equal_planets_taken_one_by_one_grow_as_their_waves(monkeypatch, speed):
    """Multi-blade coordinates have constant matrices, whose eigenvalues are another way to the same growth."""
    assembly = train(on_unlike_bearings(gear_trains.planetary("ring")))
    speeds = np.array(sorted((0.5 * speed, 1.5 * speed)))
    known = fastest_growth(mean_system(assembly, speeds).eigenvalues(speed))
    monkeypatch.setattr("exugear.steady.mean_system.planet_sets.equally_spaced", lambda planets: False)
    system = mean_system(assembly, speeds)
    assert growth_over_carrier(system, speed) == pytest.approx(known, rel=1e-6)
    monkeypatch.setattr("exugear.steady.mean_system.carrier_stability.LARGEST", 10)
    monkeypatch.setattr("exugear.steady.mean_system.carrier_stability.MODES", 20)
    assert growth_over_carrier(system, speed) == pytest.approx(known, rel=1e-3)


@pytest.mark.parametrize("train", [gear_trains.planetary("ring", 1), gear_trains.unevenly_spaced()])
def test_free_rolling_is_no_growth_at_any_speed(train):
    """One planet has rolling exponents of 1.7 and -1.7 1/s. In a turn at the lowest speed all vibrations die out.

    They had been mistaken for it below 1 rad/s, and a stable gearbox was called unstable.
    """
    gearbox = Gearbox.from_dict(train)
    assembly = assemble(gearbox, Choice("bushing"), dict.fromkeys(gearbox.pairs, np.full(8, 4e8)))
    system = mean_system(assembly, np.array([0.02, 40.0]))
    for speed in (0.02, 1.0, 40.0):
        assert -60.0 < growth_over_carrier(system, speed) < -8.0
