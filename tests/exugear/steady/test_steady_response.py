"""The steady response against balances of power, against its own orders of magnitude, and against runs in time."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.steady.balance.response import (
    linear_response,
    parametric_response,
    signals,
    transmission_errors,
)
from exugear.steady.campbell import modes_over_speed
from exugear.steady.crossings import Mode, crossings, improved, with_crossings
from exugear.steady.findings import is_excited, response_findings
from exugear.steady.point_solver import harmonic_balance_model
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble

from ..cases import gear_trains

RANGE = np.array([1.0, 22.5])


@pytest.fixture(scope="module")
def model(grc, stiffness):
    return harmonic_balance_model(assemble(grc, Choice("bushing"), stiffness), RANGE)


def scaled(stiffness, share):
    return {name: values.mean() + share * (values - values.mean()) for name, values in stiffness.items()}


@pytest.mark.validation
def test_the_linear_level_is_the_first_order_of_the_parametric_one(grc, stiffness):
    """A tenth of the variation leaves a hundredth of the difference between both."""
    apart = []
    for share in (1e-1, 1e-2):
        model = harmonic_balance_model(assemble(grc, Choice("bushing"), scaled(stiffness, share)), RANGE)
        interface = model.at(10.0)
        linear, full = (signals(model, level(model, interface)) for level in (linear_response, parametric_response))
        apart.append(np.linalg.norm((full - linear)[1:, 0]))
    assert apart[1] == pytest.approx(apart[0] / 100.0, rel=0.1)


@pytest.mark.parametrize(("speed", "change"), [(4.0, 5e-3), (10.0, 1e-3)])
def test_more_lines_hardly_change_the_response(model, speed, change):
    """Twice the harmonics and larger combinations, over the size of all lines of the overall transmission error.

    At 4 rad/s harmonics beyond the tenth of the planets' mesh still lie among the modes.
    """
    finer = harmonic_balance_model(model.waves.assembly, RANGE, 20, 5)
    coarse, fine = (signals(own, parametric_response(own, own.at(speed)))[1:, 0] for own in (model, finer))
    places, _ = finer.lines.find(model.lines.index[1:])
    assert np.linalg.norm(coarse - fine[places - 1]) < change * np.linalg.norm(fine)


@pytest.fixture(scope="module")
def found(model):
    tracks = modes_over_speed(model.system, *RANGE, 3e3)
    return crossings(model, tracks, lambda at: transmission_errors(model, at.ports, at.speed)), tracks


def test_crossings_lie_on_the_modes_that_were_followed(model, found):
    """Eigenvalues of the gearbox at each crossing's own speed; the followed mode is a straight line between speeds."""
    for crossing in found[0]:
        values = model.system.eigenvalues(crossing.speed)
        met = model.lines.orders[crossing.line] * abs(crossing.speed)
        nearest = values[np.argmin(np.abs(values.imag - met))]
        assert nearest.imag == pytest.approx(met, rel=1e-9)
        assert -nearest.real / abs(nearest) == pytest.approx(crossing.damping, rel=1e-6)
        followed = np.interp(crossing.speed, found[1].speeds, found[1].frequency[:, crossing.mode])
        assert crossing.frequency == pytest.approx(followed, rel=2e-3)


def test_a_mode_whose_eigenvalue_is_exact_to_the_last_bit_is_found():
    """The characteristic matrix of two masses of 1 kg on 4 and 9 N/m is exactly singular at 2 rad/s."""
    near = Mode(2.0j, np.array([1.0, 0.1], dtype=complex), np.array([1.0, -0.2], dtype=complex))
    own = improved(near, np.eye(2), np.zeros((2, 2)), np.diag([4.0, 9.0]))
    assert own.value == pytest.approx(2.0j, rel=1e-15)
    assert abs(own.shape[1]) < 1e-14 and abs(own.left[1]) < 1e-14


def test_one_speed_is_added_where_a_line_meets_a_mode(model, found):
    found = found[0]
    even = np.linspace(*RANGE, 20)
    speeds = with_crossings(even, found)
    strongest = found[0]
    assert strongest.share == 1.0
    values = model.system.eigenvalues(strongest.speed)
    met = model.lines.orders[strongest.line] * strongest.speed
    assert np.abs(values.imag - met).min() < 1e-3 * met
    assert np.isin(even, speeds).all()
    assert np.count_nonzero(np.abs(speeds / strongest.speed - 1.0) < 1e-6) == 1
    assert len(speeds) <= len(even) + len(found)


def test_a_peak_is_a_maximum_of_the_response(model, found):
    """At the crossing of the strongest line the response is above that two half-widths beside it."""
    strongest = found[0][0]
    offsets = np.array([-2.0, 0.0, 2.0]) * strongest.damping
    levels = [
        abs(signals(model, parametric_response(model, model.at(strongest.speed * (1.0 + o))))[strongest.line, 0])
        for o in offsets
    ]
    assert levels[1] > 1.3 * max(levels[0], levels[2])


@pytest.mark.parametrize("method", ["linear", "parametric", "nonlinear"])
def test_powers_of_round_off_are_no_error_of_the_energy_balance(method):
    """Constant stiffness excites nothing: the method `nonlinear` leaves 1e-19 m, whose powers differed by 9 %."""
    gearbox = Gearbox.from_dict(gear_trains.wind())
    assembly = assemble(gearbox, Choice("bushing"), dict.fromkeys(gearbox.pairs, np.array([4e8])))
    data = to_dataset(response_of(assembly, SteadySettings(SpeedRange(1.0, 6.0, 9), method, at_resonances=False)))
    assert not data["energy_error"].any()
    assert "Warning" not in " ".join(own.line for own in response_findings(data) if "energy" in own.text)


def test_an_unbalance_on_ideal_joints_excites_nothing_and_the_result_says_why():
    content = gear_trains.wind()
    body = content["overall"]["input"]
    content["excitations"] = {"balance": {"body": body, "z_mm": 0.0, "unbalance_g_mm": 300.0}}
    gearbox = Gearbox.from_dict(content)
    assembly = assemble(gearbox, Choice("rigid"), dict.fromkeys(gearbox.pairs, np.array([4e8])))
    settings = SteadySettings(SpeedRange(1.0, 6.0, 9), "nonlinear", at_resonances=False)
    data = to_dataset(response_of(assembly, settings))
    assert not data["energy_error"].any()
    (said,) = [own.text for own in response_findings(data) if own.text.startswith("no excitation")]
    assert "ideal joints take the forces of excitations" in said


def test_an_unbalance_that_loads_bearings_alone_is_an_excitation():
    """Three planets share what a sun does that moves aside: the transmission error does not vary, its bearings do."""
    content = gear_trains.planetary("ring")
    content["excitations"] = {"balance": {"body": "sun", "z_mm": 0.0, "unbalance_g_mm": 300.0}}
    gearbox = Gearbox.from_dict(content)
    assembly = assemble(gearbox, Choice("bushing"), dict.fromkeys(gearbox.pairs, np.array([4e8])))
    for method in ("parametric", "nonlinear"):
        settings = SteadySettings(SpeedRange(20.0, 60.0, 9), method, at_resonances=False)
        data = to_dataset(response_of(assembly, settings))
        assert is_excited(data)
        (said,) = [own.text for own in response_findings(data) if own.text.startswith("no excitation")]
        assert "no excitation by the meshes" in said and "the overall transmission error does not vary" in said
        # The model is the one that is in use: another one is no remedy.
        assert said.endswith("; remove the constant stiffness of the pairs, so that their tables are computed")


def test_a_rotor_without_gears_is_not_advised_to_change_its_mesh_model():
    content = gear_trains.rotor()
    content["excitations"] = {"balance": {"body": "motor", "z_mm": 0.0, "unbalance_g_mm": 300.0}}
    assembly = assemble(Gearbox.from_dict(content), Choice("bushing"), {})
    data = to_dataset(response_of(assembly, SteadySettings(SpeedRange(20.0, 60.0, 9), at_resonances=False)))
    (said,) = [own for own in response_findings(data) if "does not vary" in own.text]
    assert (said.level, said.text) == ("note", "the train has no meshes: the overall transmission error does not vary")


def test_an_energy_balance_is_judged_in_both_senses(grc, stiffness):
    assembly = assemble(grc, Choice("bushing"), stiffness)
    data = to_dataset(response_of(assembly, SteadySettings(SpeedRange(9.0, 10.0, 2), at_resonances=False)))
    for error, level in ((1e-6, "passed"), (-0.05, "warning"), (0.05, "warning")):
        (said,) = [
            own
            for own in response_findings(data.assign(energy_error=data["energy_error"] * 0.0 + error))
            if "energy balance" in own.text
        ]
        assert said.level == level
