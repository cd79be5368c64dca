"""What makes a peak: parts that add up, and derivatives against differences of changed gearboxes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.campbell.campbell import modes_over_speed
from exugear.dynamics.assemble import assemble
from exugear.model.choice import Choice
from exugear.steady.contributions import contributions, loudest_near
from exugear.steady.point_solver import gearset_of
from exugear.steady.resonances import crossings
from exugear.steady.response import linear_response, signals, transmission_errors

RANGE = np.array([1.0, 22.5])


@pytest.fixture(scope="module")
def gearset(grc, stiffness):
    return gearset_of(assemble(grc, Choice("bushing"), stiffness), RANGE)


@pytest.fixture(scope="module")
def peak(gearset):
    tracks = modes_over_speed(gearset.system, *RANGE, 3e3)
    crossing = crossings(gearset, tracks, lambda interface: transmission_errors(gearset, interface))[0]
    return loudest_near(gearset, crossing.speed, 2.0 * crossing.damping, crossing.line), crossing.line


def test_parts_by_mesh_add_up_to_the_line_of_the_linear_level(gearset, peak):
    speed, line = peak
    found = contributions(gearset, speed, line)
    assert sum(found.meshes.values()) == pytest.approx(1.0)
    known = 2.0 * abs(signals(gearset, linear_response(gearset, gearset.at(speed)))[line, 0])
    assert found.amplitude == pytest.approx(known, rel=1e-9)


def test_one_mode_carries_most_of_a_resonance_and_all_together_carry_it(gearset, peak):
    """What is left are modes below a hundredth each, and free rolling, which the overall signal does not see."""
    found = contributions(gearset, *peak)
    assert found.modes[0][0] == pytest.approx(gearset.lines.orders[peak[1]] * peak[0] / 2.0 / np.pi, rel=0.01)
    assert found.modes[0][1] > 0.8
    assert sum(share for _, share in found.modes) == pytest.approx(1.0, abs=0.05)


def test_a_peak_is_loudest_where_it_is_said_to_be(gearset, peak):
    speed, line = peak
    here, *beside = (contributions(gearset, speed * (1.0 + shift), line).amplitude for shift in (0.0, -1e-3, 1e-3))
    assert here > max(beside)


def test_the_derivative_by_a_bearing_is_that_of_a_gearbox_with_a_stiffer_one(grc, stiffness, gearset, peak):
    """Half a per mille stiffer and softer, in the mean system alone; static states move by as little."""
    speed, line = peak
    frequency = speed * gearset.lines.orders[line]
    derivative = contributions(gearset, speed, line).supports
    family = max(derivative, key=lambda name: abs(derivative[name]))
    assembly, step = gearset.waves.assembly, 5e-4
    own = [support.family == family for support in assembly.supports]
    amplitudes = []
    for sign in (1.0, -1.0):
        factor = np.where(own, 1.0 + sign * step, 1.0)[:, None, None]
        arrays = assembly.connectors
        changed = replace(
            assembly, connectors=arrays._replace(stiffness=factor * arrays.stiffness, damping=factor * arrays.damping)
        )
        other = gearset_of(changed, RANGE)
        system = other.system
        dynamic = system.stiffness_at(speed) - frequency**2 * system.mass + 1j * frequency * system.damping_at(speed)
        interface = gearset.at(speed)
        loads = gearset.loads(interface.ports) @ transmission_errors(gearset, interface)[line, :, 0]
        amplitudes.append(abs(gearset.row_of_overall(speed) @ np.linalg.solve(dynamic, loads)))
    difference = (amplitudes[0] - amplitudes[1]) / (2.0 * step * np.mean(amplitudes))
    assert derivative[family] == pytest.approx(difference, rel=0.02, abs=0.02)
