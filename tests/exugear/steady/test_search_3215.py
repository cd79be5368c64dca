"""The search for the reference's 3215 Hz: natural frequencies, rises of peaks, what a stopped search leaves."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from exugear import Choice, Project
from exugear.steady.mean_system.mean_system import mean_modes

from ..cases.command import script

FOLDER = Path(__file__).parents[3] / "cases" / "grc750"
NEARLY_THE_FILE = {"housing_factor": 1.0, "inertias": "assemblies", "spin": 1.0, "mass": 0.7, "coupling": 1e6}


@pytest.fixture(scope="module")
def search():
    return script(FOLDER, "search_3215")


@pytest.fixture(scope="module")
def drawing(search):
    return script(FOLDER, "draw_3215")


@pytest.fixture(scope="module")
def between(search, grc, stiffness):
    """Gearboxes between the ends of the range of each kind."""
    kinds = ("planet_bearings", "all_bearings")
    given = search.Given(grc, stiffness, {})
    return {kind: search.Between.of(given, {"kind": kind, **NEARLY_THE_FILE}) for kind in kinds}


def test_the_search_has_the_damping_of_comparisons_with_published_figures(search, monkeypatch):
    monkeypatch.setattr("sys.argv", ["search_3215.py"])
    project = search.published_project(Choice("bushing"))
    assert project.folder == Path("results/grc750-published")
    assert project.gearbox.case.damping.modal_percent is None
    assert project.gearbox.damping_times.mesh == project.gearbox.damping_times.bearing == 4e-6


@pytest.mark.validation
@pytest.mark.parametrize("kind", ["planet_bearings", "all_bearings"])
def test_each_stiffness_found_makes_the_frequency_a_natural_one(search, grc, stiffness, between, kind):
    """By its matrices within what rounding to three digits leaves; by modes, damped and gyroscopic, within 2 %."""
    own = {"kind": kind, **NEARLY_THE_FILE}
    found = search.tuned(between[kind])
    assert found
    for radial in found:
        system = search.model_with(search.Given(grc, stiffness, {}), own, radial, "bushing").system
        assert nearest(search, undamped(search, system)) < 3e-3
        assert nearest(search, mean_modes(system, 0.5 * search.FASTEST)[0].imag) < search.NEAR


def undamped(search, system):
    """Angular frequencies of a mean system at half the speed without its damping."""
    values = scipy.linalg.eigvals(system.stiffness_at(0.5 * search.FASTEST), system.mass)
    return np.sqrt(np.maximum(values.real, 0.0))


def nearest(search, rates):
    """How far the nearest of some angular frequencies is, as a share."""
    return np.abs(rates / (2.0 * np.pi * search.TARGET_HZ) - 1.0).min()


def test_a_stiffness_between_those_found_does_not(search, grc, stiffness, between):
    own = {"kind": "planet_bearings", **NEARLY_THE_FILE}
    first = search.tuned(between["planet_bearings"])[0]
    assert first > 1.3 * search.RANGES["planet_bearings"][0]
    system = search.model_with(search.Given(grc, stiffness, {}), own, 0.8 * first, "bushing").system
    assert nearest(search, undamped(search, system)) > 3e-3


@pytest.mark.parametrize(("kind", "radial"), [("planet_bearings", 1.6e10), ("all_bearings", 3e9)])
def test_peaks_from_both_ends_of_the_range_are_those_of_the_gearbox_itself(
    search, grc, stiffness, between, kind, radial
):
    """Amplitudes of all orders where the gearbox is assembled with the stiffness, to 2e-3 of the largest."""
    given, own = search.Given(grc, stiffness, {}), {"kind": kind, **NEARLY_THE_FILE}
    itself = search.model_with(given, own, radial, "bushing")
    found = search.amplitudes(between[kind].stiff, between[kind].at(radial))
    for name, amplitude in search.amplitudes(itself, itself.system).items():
        exact, quick = np.nan_to_num(amplitude), np.nan_to_num(found[name])
        assert np.abs(quick - exact).max() <= 2e-3 * exact.max(), name


@pytest.mark.validation
def test_a_set_changes_the_gearbox_as_it_says(search, grc, stiffness):
    own = {"kind": "all_bearings", **NEARLY_THE_FILE}
    changed = search.varied(grc, own, 2e9)
    bearings = changed.content["bearings"]
    assert {bearings[name]["stiffness"]["radial_N_per_m"] for name in search.AXIAL} == {2e9}
    mass = [gearbox.content["bodies"]["hss"]["inertia"]["assemblies"]["mass_kg"] for gearbox in (grc, changed)]
    assert mass[1] == pytest.approx(0.7 * mass[0])
    # The equations are linear in it, as the search takes them; the static state moves a little with it.
    given = search.Given(grc, stiffness, {})
    systems = [search.model_with(given, own, radial, "bushing").system for radial in (1e10, 2e10, 3e10)]
    first, second, third = (system.stiffness_at(0.0) for system in systems)
    assert np.abs(third - second - (second - first)).max() < 1e-3 * np.abs(third - first).max()


def test_every_shaft_that_is_searched_is_a_body(search, grc):
    """Two and four times the spin of the set `gears` ask for a disc: no body has more than twice its transverse one."""
    shafts = {(own["inertias"], own["spin"], own["mass"]): own for own in search.sets()}
    assert len(shafts) == 27
    for own in shafts.values():
        inertia = search.varied(grc, own, 1e10).content["bodies"]["hss"]["inertia"][own["inertias"]]
        assert inertia["axial_kg_m2"] <= (2.0 + 1e-12) * inertia["transverse_kg_m2"]


def test_rise_of_a_peak_is_that_of_an_oscillator(search):
    """Amplitude of one degree of freedom by its closed form, its peak over the higher of both ends of the range."""
    ratio, damping = search.FREQUENCIES / search.TARGET_HZ, 0.02
    amplitude = 1.0 / np.sqrt((1.0 - ratio**2) ** 2 + (2.0 * damping * ratio) ** 2)
    found = search.peak_of(amplitude, search.NEAR)
    higher = max(1.0 / np.hypot(1.0 - end**2, 2.0 * damping * end) for end in (ratio[0], ratio[-1]))
    assert found["rise_dB"] == pytest.approx(20.0 * np.log10(0.5 / damping / higher), abs=0.01)
    assert found["Hz"] == pytest.approx(search.TARGET_HZ, rel=2e-3)


@pytest.mark.parametrize("amplitude", [np.linspace(1.0, 2.0, 81), np.ones(81), np.full(81, np.nan)])
def test_a_slope_is_no_peak_nor_is_what_no_speed_reaches(search, amplitude):
    assert search.peak_of(amplitude, search.NEAR) is None


def test_a_peak_outside_the_range_is_not_told(search):
    amplitude = 1.0 + np.exp(-(((search.FREQUENCIES / search.TARGET_HZ - 1.05) / 0.01) ** 2))
    assert search.peak_of(amplitude, search.NEAR) is None
    assert search.peak_of(amplitude, search.AROUND)["Hz"] == pytest.approx(1.05 * search.TARGET_HZ, rel=3e-3)


@pytest.fixture
def few_sets(search, monkeypatch):
    """Two sets with ranges so narrow that little is found in them."""
    own = [{"kind": "planet_bearings", **NEARLY_THE_FILE, "coupling": coupling} for coupling in (1e5, 1e8)]
    monkeypatch.setattr(search, "sets", lambda: own)
    monkeypatch.setattr(search, "tuned", lambda between: [1e10])
    return own


@pytest.mark.validation
def test_a_stopped_search_goes_on_and_ends_with_the_same_lines(search, grc, few_sets, tmp_path, capsys):
    project = Project(grc, tmp_path / "whole", Choice("bushing", "iso6336"))
    whole = search.search(project)
    assert [row["set"] for row in whole] == few_sets
    lines = (project.folder / "search-3215.jsonl").read_bytes().splitlines(keepends=True)
    stopped = Project(grc, tmp_path / "stopped", Choice("bushing", "iso6336"))
    stopped.folder.mkdir(parents=True)
    # Killed while it wrote its second set, after the head and the first.
    (stopped.folder / "search-3215.jsonl").write_bytes(b"".join(lines[:2]) + lines[2][:20])
    capsys.readouterr()
    assert search.search(stopped) == whole
    assert "1 of 2" not in capsys.readouterr().out
    assert (stopped.folder / "search-3215.jsonl").read_bytes() == b"".join(lines)


@pytest.mark.validation
def test_lines_of_another_input_are_not_taken(search, grc, few_sets, tmp_path, capsys):
    project = Project(grc, tmp_path, Choice("bushing", "iso6336"))
    other = {"input": "of another gearbox", "script": 1}
    row = {"set": {"kind": "none"}, "rigid": {}, "bushing": []}
    path = project.folder / "search-3215.jsonl"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{json.dumps(other)}\n{json.dumps(row)}\n", encoding="utf-8")
    assert [found["set"] for found in search.search(project)] == few_sets


def row_with(kind, coupling, radial, rise, amplitude, rigid=0.0):
    peaks = {"1 x high_speed": {"rise_dB": rise, "Hz": 3200.0, "m": amplitude}}
    flat = {"1 x planetary": {"rise_dB": rigid, "Hz": 3000.0, "m": 1e-9}} if rigid else {}
    own = {"kind": kind, **NEARLY_THE_FILE, "mass": 1.0, "coupling": coupling}
    return {"set": own, "rigid": flat, "bushing": [{"radial_N_per_m": radial, "peaks": peaks}]}


def test_only_a_set_with_the_peak_that_rigid_lacks_meets_the_wish(search, drawing, tmp_path):
    rows = [
        row_with("all_bearings", 1e6, 1e10, 6.5, 1e-9),
        row_with("all_bearings", 1e8, 2e10, 9.0, 5e-8),
        row_with("all_bearings", 1e5, 3e10, 5.9, 1e-6),
        row_with("planet_bearings", 1e6, 1e10, 12.0, 1e-6, rigid=7.0),
    ]
    found = search.candidates(rows)
    assert [one["met"] for one in found] == [True, True, False, False]
    picked = drawing.chosen(found)
    assert picked["nearest"]["coupling"] == 1e6
    assert picked["loudest"]["m"] == 5e-8
    assert drawing.chosen(found[2:]) == {}
    drawing.draw_map(found, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 10_000
