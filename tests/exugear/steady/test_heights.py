"""Heights of peaks against dense sweeps, and harmonics against more of them."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.gearbox.units import RPM
from exugear.steady.balance.response import signals
from exugear.steady.findings import response_findings
from exugear.steady.harmonics.branches import peaks_of_lines, standing_peaks
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.mean_system.signals import quantities_of
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import to_dataset
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble

from ...optional_libraries import needs_meshio
from ..cases.assembled import assembled
from ..cases.ring import drum_content

BUSHING = Choice("bushing")
CYCLE = 2.0 * np.pi * np.arange(50) / 50
CLEARLY = 0.03
"""What a peak of a dense sweep stands above both sides: of one that hardly does, either sweep may see nothing."""
NEAR = 0.01
"""Share of the speed within which a listed peak is the one of a dense sweep."""


def stiff(mean, *amplitudes):
    """Stiffness over the mesh cycle with harmonics of given shares, N/m."""
    return mean * (1.0 + sum(own * np.cos(n * CYCLE + 0.7 * n) for n, own in enumerate(amplitudes, start=1)))


@pytest.fixture(scope="module")
def parallel(tmp_path_factory):
    path = tmp_path_factory.mktemp("parallel") / "gearbox.toml"
    path.write_text(template("parallel"), encoding="utf-8")
    gearbox = Gearbox.from_toml(path)
    stiffness = {"stage_1": stiff(6e8, 0.03, 0.015, 0.01, 0.005), "stage_2": stiff(9e8, 0.05, 0.02, 0.01, 0.005)}
    return assemble(gearbox, BUSHING, stiffness)


def dense_peaks(assembly, speeds, harmonics, count, most, lines=None):
    """Loudest peaks of the quantities by a dense sweep, each then searched for by itself: line, speed, height.

    `lines` are those that a response has of the model; by default all of them.
    """
    settings = SteadySettings(speeds, harmonics=harmonics)
    model = harmonic_balance_model(assembly, np.array([speeds.first, speeds.last]), harmonics)
    if lines is not None:
        model = model.of(np.isin(np.arange(len(model.lines.index)), model.lines.find(lines.index)[0]))
    solver, sense = PointSolver(model, settings.method), np.sign(speeds.first + speeds.last)

    def sizes(speed):
        amplitude = 2.0 * signals(model, solver.response(sense * speed))[1:]
        return [own.sizes(amplitude).max(axis=1) for own in quantities]

    quantities = model.quantities
    at = np.geomspace(abs(speeds.first), abs(speeds.last), count)
    swept = [np.array(own) for own in zip(*(sizes(speed) for speed in at), strict=True)]
    found = {}
    for number, (quantity, values) in enumerate(zip(quantities, swept, strict=True)):
        peaks = sorted(peaks_of_lines(values, CLEARLY), key=lambda peak: -values[peak])[:most]
        own = []
        for point, line in peaks:
            top = scipy.optimize.minimize_scalar(
                lambda speed, number=number, line=line: -sizes(speed)[number][line],
                bounds=(at[point - 1], at[point + 1]),
                method="bounded",
                options={"xatol": 1e-6 * at[point], "maxiter": 20},
            )
            own.append((line, float(top.x), max(-float(top.fun), float(values[point, line]))))
        found[quantity.name] = own
    return found


def differences(response, truth):
    """Relative difference of each peak of a dense sweep from the one that is listed near it, 1 where none is."""
    speed = np.abs(response.solved.speed)
    found = {}
    for quantity in quantities_of([own.name for own in response.signals], ()):
        sizes = quantity.sizes(response.solved.amplitude[:, 1:]).max(axis=2)
        own = []
        for line, at, height in truth[quantity.name]:
            places = standing_peaks(sizes[:, line])
            near = places[np.abs(speed[places] / at - 1.0) < NEAR]
            own.append(float(np.abs(sizes[near, line] / height - 1.0).min(initial=1.0)))
        found[quantity.name] = np.array(own)
    return found


@pytest.mark.validation
def test_the_loudest_peaks_are_those_of_a_dense_sweep(parallel):
    """Two stages between 300 and 900 rpm: the twenty loudest of each quantity, by fewer speeds than the sweep has."""
    speeds = SpeedRange(300.0 * RPM, 900.0 * RPM, 120)
    response = response_of(parallel, SteadySettings(speeds, harmonics=6))
    off = differences(response, dense_peaks(parallel, speeds, 6, 900, 20))
    assert len(response.solved.speed) < 400
    for quantity in ("error", "force", "acceleration"):
        assert off[quantity].max() < 2e-3, quantity


@pytest.mark.validation
@pytest.mark.long
def test_the_sixty_loudest_peaks_of_the_grc_are_those_of_a_dense_sweep(grc, stiffness):
    """All speeds above a tenth: few peaks, which stand by 5 % on shoulders of others, lie between the speeds."""
    assembly = assemble(grc, BUSHING, stiffness)
    whole = SpeedRange(0.0, -22.46, 400)
    response = response_of(assembly, SteadySettings(whole))
    assert len(response.solved.speed) < 999  # as many as five speeds a crossing took
    truth = dense_peaks(assembly, SpeedRange(-2.246, -22.46, 2), response.harmonics, 8000, 60)
    off = differences(response, truth)
    assert np.count_nonzero(off["error"][:50] > 2e-3) == 0
    assert np.count_nonzero(off["error"] > 2e-3) <= 1
    assert np.count_nonzero(off["force"] > 2e-3) <= 3
    assert np.count_nonzero(off["acceleration"] > 2e-3) <= 3


@needs_meshio
@pytest.mark.validation
@pytest.mark.long
def test_the_fifteen_loudest_peaks_of_a_flexible_stage_are_those_of_a_dense_sweep(grc, stiffness, tmp_path):
    """A flexible ring gear and carrier, where thirty tops of each quantity are evaluated; neighbours leave 5e-4."""
    content = drum_content(grc, tmp_path)
    drum = assembled(Gearbox.from_dict(content, str(tmp_path / "drum.toml")), Choice("flexible"), stiffness)
    speeds = SpeedRange(6.0, 9.0, 40)
    response = response_of(drum, SteadySettings(speeds, harmonics=4))
    off = differences(response, dense_peaks(drum, speeds, 4, 400, 15, response.lines))
    for quantity, own in off.items():
        assert own.max() < 2e-3, quantity


def heights_of(response, name):
    """Heights (points, lines) of a quantity of a response."""
    quantities = quantities_of([own.name for own in response.signals], ())
    quantity = next(own for own in quantities if own.name == name)
    return quantity.sizes(response.solved.amplitude[:, 1:]).max(axis=2)


def test_peaks_that_are_known_between_speeds_only_are_estimated_and_a_narrower_range_computes_them(
    parallel, monkeypatch
):
    """With three tops instead of a hundred, the estimate is held against the response with all of them."""
    settings = SteadySettings(SpeedRange(30.0, 60.0, 20), harmonics=4)
    whole = response_of(parallel, settings)
    assert not whole.higher_between
    monkeypatch.setattr("exugear.steady.steady_response.LOUDEST", 3)
    few = response_of(parallel, settings)
    sizes, true = heights_of(few, "force"), heights_of(whole, "force")
    excess = []
    for point, line in sorted(peaks_of_lines(sizes), key=lambda peak: -sizes[peak]):
        low, high = few.solved.speed[[point - 1, point + 1]]
        between = (whole.solved.speed >= low) & (whole.solved.speed <= high)
        excess.append((true[between, line].max() / sizes[point, line] - 1.0, few.solved.speed[point]))
    found = {own.quantity: own for own in few.higher_between}
    most, at = max(excess)
    assert most > 0.03
    assert found["force"].excess == pytest.approx(most, rel=0.1)
    assert all(own < 0.011 for own, _ in excess[: found["force"].rank - 1])
    finding = next(own for own in response_findings(to_dataset(few)) if "between the computed speeds" in own.text)
    assert finding.level == "warning"
    assert (
        f"bearing force from rank {found['force'].rank} on, by up to {100.0 * found['force'].excess:.0f} %"
        in finding.text
    )
    narrow = response_of(parallel, SteadySettings(SpeedRange(0.985 * at, 1.015 * at, 20), harmonics=4))
    assert not narrow.higher_between


def fewest_above_half(response):
    """Fewest speeds above half height of the ten highest peaks of each quantity."""
    fewest = {}
    for quantity in quantities_of([own.name for own in response.signals], ()):
        sizes = quantity.sizes(response.solved.amplitude[:, 1:]).max(axis=2)
        counts = []
        for point, line in sorted(peaks_of_lines(sizes), key=lambda peak: -sizes[peak])[:10]:
            low = sizes[:, line] < 0.5 * sizes[point, line]
            before, after = np.flatnonzero(low[:point]), np.flatnonzero(low[point:])
            ends = before.max(initial=-1), point + after.min(initial=len(low) - point)
            counts.append(ends[1] - ends[0] - 1)
        fewest[quantity.name] = min(counts)
    return fewest


@pytest.mark.validation
@pytest.mark.parametrize("percent", [0.05, 0.2, 2.0])
def test_the_highest_peaks_have_five_speeds_above_half_their_height(tmp_path, monkeypatch, percent):
    """Resonances narrower than the distance of the even speeds, which were triangles, and wider ones."""
    path = tmp_path / "gearbox.toml"
    text = template("parallel").replace("modal_percent = 2.0", f"modal_percent = {percent}")
    path.write_text(text.replace("[1.0, 4.0]", "[0.01, 4.0]"), encoding="utf-8")
    stiffness = {"stage_1": stiff(6e8, 0.03, 0.015), "stage_2": stiff(9e8, 0.05, 0.02)}
    assembly = assemble(Gearbox.from_toml(path), BUSHING, stiffness)
    settings = SteadySettings(SpeedRange(300.0 * RPM, 900.0 * RPM, 60), harmonics=4)
    response = response_of(assembly, settings)
    assert min(fewest_above_half(response).values()) >= 5
    monkeypatch.setattr("exugear.steady.steady_response.missed_flanks", lambda *_: np.zeros(0))
    before = response_of(assembly, settings)
    assert (min(fewest_above_half(before).values()) < 5) == (percent < 1.0)
    assert len(response.solved.speed) - len(before.solved.speed) <= 100
    assert set(before.solved.speed) <= set(response.solved.speed)


@pytest.mark.validation
def test_what_was_stopped_between_tops_goes_on_to_the_same_numbers(parallel):
    settings, kept, seen = SteadySettings(SpeedRange(30.0, 60.0, 20), harmonics=4), [], []
    whole = response_of(parallel, settings, progress=lambda done, total: seen.append(done)).solved
    tops = seen[-1] - 3
    assert tops > 20

    def stop(done, total):
        if done == tops:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        response_of(parallel, settings, progress=stop, keep=kept.append)
    seen.clear()
    again = response_of(parallel, settings, known=kept[-1], progress=lambda done, total: seen.append(done)).solved
    assert seen == [tops + 1, tops + 2, tops + 3]
    np.testing.assert_array_equal(again.speed, whole.speed)
    np.testing.assert_array_equal(again.amplitude, whole.amplitude)


def spur(swing):
    """Stiffness of spur teeth: one pair or two in contact, with short ramps between."""
    edge = np.clip(np.minimum(np.arange(50) - 5.0, 30.0 - np.arange(50)) / 3.0, 0.0, 1.0)
    return 4e8 * (1.0 + swing * edge)


@pytest.mark.validation
def test_harmonics_follow_from_the_stiffness_and_more_change_little(parallel):
    """A smooth mesh takes the fewest; one that swings in steps as many as leave 2e-2 of its compliance out."""
    smooth = harmonic_balance_model(parallel, np.array([30.0, 60.0]))
    assert smooth.usual_harmonics == 10
    assembly = assemble(parallel.gearbox, BUSHING, {"stage_1": spur(0.5), "stage_2": stiff(9e8, 0.05)})
    response = response_of(assembly, SteadySettings(SpeedRange(30.0, 60.0, 20)))
    assert 10 < response.harmonics <= 25
    compliance = 1.0 / spur(0.5)
    tails = np.abs(np.fft.rfft(compliance - compliance.mean()))
    left = np.linalg.norm(tails[response.harmonics + 1 :]) / np.linalg.norm(tails)
    # By its positions alone; the law runs smoothly between them.
    assert response.left_out[0] == pytest.approx(left, rel=0.5)
    assert response.change_with_more < 1e-2
    few = response_of(assembly, SteadySettings(SpeedRange(30.0, 60.0, 20), harmonics=3))
    assert few.harmonics == 3
    assert few.left_out[0] > 0.1
    assert few.change_with_more > response.change_with_more


def test_the_change_with_more_harmonics_is_that_of_the_loudest_peaks(parallel):
    speeds = SpeedRange(30.0, 60.0, 20)
    few, more = (response_of(parallel, SteadySettings(speeds, harmonics=n)) for n in (2, 3))
    peaks = np.abs(few.solved.amplitude[:, 1:, 0])
    point, line = np.unravel_index(np.argmax(peaks), peaks.shape)
    index = tuple(few.lines.index[line + 1].tolist())
    same = np.interp(few.solved.speed[point], more.solved.speed, np.abs(more.amplitude("overall_dte", index)))
    # The loudest is one of the ten; between speeds of the other a straight line.
    assert abs(same / peaks[point, line] - 1.0) < few.change_with_more + 2e-2


@pytest.mark.validation
def test_the_change_with_more_orders_is_that_of_combinations_too(parallel):
    """Two meshes that swing: without their combinations peaks are off by what more of them change."""
    assembly = assemble(parallel.gearbox, BUSHING, {"stage_1": stiff(6e8, 0.2), "stage_2": stiff(9e8, 0.2)})
    speeds = SpeedRange(30.0, 60.0, 20)
    few, more = (response_of(assembly, SteadySettings(speeds, harmonics=10, combinations=n)) for n in (2, 6))
    assert more.change_with_more < 0.1 * few.change_with_more


@pytest.mark.parametrize("count", [0, 101])
def test_harmonics_that_cannot_be_are_refused(count):
    with pytest.raises(SteadyError, match="must be from 1 to 100"):
        SteadySettings(SpeedRange(1.0, 2.0, 2), harmonics=count)


def test_a_stiffness_that_does_not_vary_excites_nothing(parallel):
    """Two bases without a wave: every line is zero, and disturbances decay as the mean system has them decay."""
    assembly = assemble(parallel.gearbox, BUSHING, {"stage_1": np.full(50, 6e8), "stage_2": np.full(50, 9e8)})
    response = response_of(assembly, SteadySettings(SpeedRange(30.0, 60.0, 5)))
    assert np.abs(response.solved.amplitude[:, 1:, 0]).max() < 1e-15
    assert not response.left_out.any()
    model = harmonic_balance_model(assembly, np.array([30.0, 60.0]))
    values = np.concatenate([model.system.eigenvalues(speed) for speed in (30.0, 45.0, 60.0)])
    assert response.growth_rate == pytest.approx(values.real[np.abs(values.imag) > 10.0].max(), rel=1e-6)
