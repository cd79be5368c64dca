"""The file of a steady response: what it holds, when it is taken as it is, and what a stopped one leaves."""

from __future__ import annotations

import json

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.steady.campbell import campbell_from
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.peaks import peaks, planet_sidebands, sidebands
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import load_response, partial_path, stored_or_computed
from exugear.steady.steady_response import response_of
from exugear.system.build import assemble
from fe_ste.tools.files import FileError
from fe_ste.tools.stores import load_arrays, write_arrays

SETTINGS = SteadySettings(SpeedRange(0.0, 20.0, 21), at_resonances=False)


@pytest.fixture(scope="module")
def assembly(grc, stiffness):
    return assemble(grc, Choice("rigid"), stiffness)


def test_a_file_gives_back_the_response_with_units_and_origin(assembly, tmp_path):
    response, path = response_of(assembly, SETTINGS), tmp_path / "steady.nc"
    data = stored_or_computed(path, assembly, SETTINGS)
    assert data.attrs["input_hash"] == response.input_hash
    sizes = {"point": 20, "line": 53, "base": 3, "signal": len(response.signals), "mesh_wave": 8}
    assert {name: data.sizes[name] for name in sizes} == sizes
    np.testing.assert_array_equal(campbell_from(data).frequency, response.campbell.frequency)
    assert str(data["units"][0].item()) == "m"
    line = int(np.argmin(abs(data["order"].to_numpy() - 99.0)))
    known = response.amplitude("overall_dte", (1, 0, 0))
    assert data["line"].to_numpy()[[0, line]].tolist() == ["mean", "sun_planet"]
    np.testing.assert_allclose(data["speed_rpm"], data["speed"] * 30.0 / np.pi, rtol=1e-12)
    by_name = data["amplitude"].sel(line="sun_planet", signal="overall_dte")
    np.testing.assert_array_equal(by_name, data["amplitude"][:, line, 0])
    stored = data["amplitude"][:, line, 0] * np.exp(1j * data["phase"][:, line, 0])
    # Single precision.
    np.testing.assert_allclose(stored, known, rtol=1e-6, atol=1e-6 * abs(known).max())
    assert json.loads(data.attrs["settings"])["method"] == "parametric"


@pytest.mark.validation
def test_a_file_that_fits_is_taken_and_another_input_is_computed(assembly, tmp_path):
    path, asked = tmp_path / "steady.nc", []
    for _ in range(2):
        stored_or_computed(path, assembly, SETTINGS, lambda done, total: asked.append(done))
    assert asked == list(range(1, 21))
    other = SteadySettings(SpeedRange(0.0, 20.0, 11), at_resonances=False)
    assert stored_or_computed(path, assembly, other).sizes["point"] == 10


def stopped(path, assembly):
    """Leave the points of a response that is stopped after the fifth."""

    def stop(done, total):
        if done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stored_or_computed(path, assembly, SETTINGS, stop)
    assert partial_path(path).exists() and not path.exists()


@pytest.mark.sample
@pytest.mark.parametrize("kept", ["whole", "cut", "of another input", "of 0.3.0"])
def test_what_stopped_is_gone_on_with_if_it_fits_and_leaves_nothing_behind(assembly, tmp_path, kept):
    path, seen = tmp_path / "steady.nc", []
    stopped(path, assembly)
    points = partial_path(path)
    arrays = load_arrays(points)
    if kept == "cut":
        points.write_bytes(points.read_bytes()[:-200])
    elif kept == "of another input":
        write_arrays(points, {**arrays, "key": np.array("another")})
    elif kept == "of 0.3.0":
        write_arrays(points, {"input_hash": arrays.pop("key"), **arrays})
    data = stored_or_computed(path, assembly, SETTINGS, lambda done, total: seen.append(done))
    assert seen[0] == (6 if kept == "whole" else 1)
    assert data.identical(stored_or_computed(tmp_path / "other.nc", assembly, SETTINGS))
    assert not points.exists()


def test_a_damaged_file_is_refused(assembly, tmp_path):
    path = tmp_path / "steady.nc"
    stored_or_computed(path, assembly, SETTINGS)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))
    with pytest.raises(FileError):
        load_response(path)


def test_peaks_are_the_local_maxima_the_loudest_first(assembly, tmp_path):
    data = stored_or_computed(tmp_path / "steady.nc", assembly, SETTINGS)
    found = peaks(data)
    assert found[0].amplitude == pytest.approx(float(data["amplitude"][:, 1:, 0].max()), rel=1e-6)
    assert [peak.amplitude for peak in found] == sorted((peak.amplitude for peak in found), reverse=True)
    assert found[0].frequency == pytest.approx(found[0].order * found[0].speed / 2.0 / np.pi)
    with pytest.raises(SteadyError, match="no signal 'noise'; signals are overall_dte"):
        peaks(data, "noise")


def test_sidebands_are_combinations_with_the_line_of_the_peak_and_named_by_what_is_added(assembly, tmp_path):
    data = stored_or_computed(tmp_path / "steady.nc", assembly, SETTINGS)
    peak = next(own for own in peaks(data) if own.line == "high_speed")
    found = sidebands(data, peak, least=1e-9)
    causes = {band.cause: band for band in found}
    assert {"+ sun_planet", "- sun_planet", "+ intermediate", "- 2 x intermediate"} <= set(causes)
    below = causes["- sun_planet"]
    assert below.line == "high_speed - sun_planet"
    assert below.frequency == pytest.approx(peak.frequency - 99.0 * peak.speed / 2.0 / np.pi)
    line = int(np.argmin(abs(data["order"].to_numpy() - (peak.order - 99.0))))
    point = int(np.argmin(abs(data["speed"].to_numpy() - peak.speed)))
    assert below.amplitude == pytest.approx(float(data["amplitude"][point, line, 0]))
    assert below.share == pytest.approx(below.amplitude / peak.amplitude)


def test_a_planet_feels_waves_at_the_line_plus_and_minus_its_carrier(assembly, tmp_path):
    """Against the force of the planet at zero angle, sampled in time over turns of the carrier."""
    data = stored_or_computed(tmp_path / "steady.nc", assembly, SETTINGS)
    peak = next(own for own in peaks(data) if own.line == "intermediate")
    names = [str(name) for name in data["signal"].to_numpy()]
    point = int(np.argmin(abs(data["speed"].to_numpy() - peak.speed)))
    line = int(np.argmin(abs(data["order"].to_numpy() - peak.order)))
    forced = data.copy(deep=True)
    for name, (amplitude, phase) in {" cosine": (3.0, 0.4), " sine": (2.0, 1.9), "": (0.5, 0.0)}.items():
        place = point, line, names.index(f"mesh_force sun_planet{name}")
        forced["amplitude"].to_numpy()[place], forced["phase"].to_numpy()[place] = amplitude, phase
    # Whole numbers of periods of both: the line at 40 and the carrier at 3 of them.
    t = np.arange(4096) / 4096.0
    force = 3.0 * np.cos(2 * np.pi * 40 * t + 0.4) * np.cos(2 * np.pi * 3 * t)
    force += 2.0 * np.cos(2 * np.pi * 40 * t + 1.9) * np.sin(2 * np.pi * 3 * t)
    known = 2.0 * np.abs(np.fft.rfft(force)) / t.size
    found = {band.cause[0]: band for band in planet_sidebands(forced, peak, {"sun_planet": ("carrier", 1.0)})}
    assert found["+"].amplitude == pytest.approx(known[43], rel=1e-6)
    assert found["-"].amplitude == pytest.approx(known[37], rel=1e-6)
    assert found["+"].frequency - peak.frequency == pytest.approx(peak.speed / 2.0 / np.pi)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0:215", "must be FIRST:LAST:COUNT"),
        ("0:fast:3", "must be FIRST:LAST:COUNT"),
        ("0:1:2:3", "must be FIRST:LAST:COUNT"),
        ("-5:5:3", ": change sign; compute each sense of rotation separately"),
        ("0:0:3", ": no excitation at standstill; set a speed above 0"),
        ("0:300:1", ": the only speed is the first one, standstill, which has no excitation; set 2 or more speeds"),
        ("0:nan:3", "must be finite"),
        ("0:10:0", "the count must be from 1"),
    ],
)
def test_speeds_that_cannot_be_are_told_in_one_sentence(text, said):
    with pytest.raises(SteadyError, match=said):
        SpeedRange.from_text(text)
