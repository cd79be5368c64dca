"""What makes a peak: parts that add up, and derivatives against differences of changed gearboxes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.steady.balance.response import linear_response, signals, transmission_errors
from exugear.steady.campbell import modes_over_speed
from exugear.steady.crossings import contributions, crossings, loudest_near
from exugear.steady.point_solver import harmonic_balance_model
from exugear.system.build import assemble

RANGE = np.array([1.0, 22.5])


@pytest.fixture(scope="module")
def model(grc, stiffness):
    return harmonic_balance_model(assemble(grc, Choice("bushing"), stiffness), RANGE)


@pytest.fixture(scope="module")
def peak(model):
    tracks = modes_over_speed(model.system, *RANGE, 3e3)
    crossing = crossings(model, tracks, lambda at: transmission_errors(model, at.ports, at.speed))[0]
    return loudest_near(model, crossing.speed, 2.0 * crossing.damping, crossing.line), crossing.line


@pytest.mark.validation
def test_parts_by_mesh_add_up_to_the_line_of_the_linear_level(model, peak):
    speed, line = peak
    found = contributions(model, speed, line)
    assert sum(found.meshes.values()) == pytest.approx(1.0)
    known = 2.0 * abs(signals(model, linear_response(model, model.at(speed)))[line, 0])
    assert found.amplitude == pytest.approx(known, rel=1e-9)


def test_one_mode_carries_most_of_a_resonance_and_all_together_carry_it(model, peak):
    """What is left are modes below a hundredth each, and free rolling, which the overall signal does not see."""
    found = contributions(model, *peak)
    assert found.modes[0][0] == pytest.approx(model.lines.orders[peak[1]] * peak[0] / 2.0 / np.pi, rel=0.01)
    assert found.modes[0][1] > 0.8
    assert sum(share for _, share in found.modes) == pytest.approx(1.0, abs=0.05)


def test_a_peak_is_loudest_where_it_is_said_to_be(model, peak):
    speed, line = peak
    here, *beside = (contributions(model, speed * (1.0 + shift), line).amplitude for shift in (0.0, -1e-3, 1e-3))
    assert here > max(beside)


def amplitude_with(system, excited, model, peak):
    """Amplitude of the line with an averaged system and the excitation of a model; else as of the unchanged model."""
    speed, line = peak
    forces = transmission_errors(excited, excited.ports_at(speed), speed)[line, :, 0]
    dynamic = system.dynamic(speed, speed * model.lines.orders[line])
    return abs(model.row_of_overall(speed) @ np.linalg.solve(dynamic, model.loads(model.ports_at(speed)) @ forces))


def slope(more, less, step):
    return (more - less) / (step * (more + less))


STEP = 5e-4
"""Share by which a parameter is raised and lowered; static states move by as little."""


def test_the_derivative_by_a_bearing_is_that_of_a_gearbox_with_a_stiffer_one(model, peak):
    derivative = contributions(model, *peak).supports
    family = max(derivative, key=lambda name: abs(derivative[name]))
    assembly = model.waves.assembly
    own = [support.family == family for support in assembly.supports]
    amplitudes = []
    for sign in (1.0, -1.0):
        factor = np.where(own, 1.0 + sign * STEP, 1.0)[:, None, None]
        arrays = assembly.connectors
        changed = replace(
            assembly, connectors=arrays._replace(stiffness=factor * arrays.stiffness, damping=factor * arrays.damping)
        )
        amplitudes.append(amplitude_with(harmonic_balance_model(changed, RANGE).system, model, model, peak))
    assert derivative[family] == pytest.approx(slope(*amplitudes, STEP), rel=0.02, abs=0.02)


@pytest.mark.sample
@pytest.mark.parametrize("family", ["hss", "lss", "planet", "carrier"])
def test_the_derivative_by_inertia_is_that_of_a_gearbox_with_a_heavier_body(grc, stiffness, model, peak, family):
    """Mass, both moments of inertia and with them the gyroscopic terms; the latter are left out of the derivative."""
    section = grc.content["bodies"][family]["inertia"]["assemblies"]
    keys = ("mass_kg", "axial_kg_m2", "transverse_kg_m2")
    amplitudes = []
    for sign in (1.0, -1.0):
        changes = {f"bodies.{family}.inertia.assemblies.{key}": (1.0 + sign * STEP) * section[key] for key in keys}
        other = harmonic_balance_model(assemble(grc.varied(changes), Choice("bushing"), stiffness), RANGE)
        amplitudes.append(amplitude_with(other.system, model, model, peak))
    derivative = contributions(model, *peak).bodies[family]
    assert derivative == pytest.approx(slope(*amplitudes, STEP), rel=0.02, abs=0.02)


def test_the_derivative_by_a_mesh_error_is_its_share(grc, stiffness, model, peak):
    """What varies of one pair's compliance a little more and less: its transmission error, with the mean kept."""
    shares = contributions(model, *peak).meshes
    family = max(shares, key=lambda name: abs(shares[name]))
    amplitudes = []
    for sign in (1.0, -1.0):
        compliance = 1.0 / stiffness[family]
        own = 1.0 / (compliance.mean() + (1.0 + sign * STEP) * (compliance - compliance.mean()))
        other = harmonic_balance_model(assemble(grc, Choice("bushing"), {**stiffness, family: own}), RANGE)
        amplitudes.append(amplitude_with(model.system, other, model, peak))
    assert shares[family] == pytest.approx(slope(*amplitudes, STEP), rel=0.02)
