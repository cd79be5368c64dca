"""Waterfall, order cuts, ranking and cards read run-ups or steady responses, and say which."""

from __future__ import annotations

import html
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.findings.ranking import resonances
from exugear.report.writer import write_report
from exugear.results.spectra.waterfall import order_lines
from exugear.steady.peaks import peaks
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import load_response, steady_path, stored_or_computed
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

from ..cases.assembled import assembled, simulated, spur_with_tables
from .page_view import IN_BROWSER, SIZES, View, data_of, opened

pytestmark = pytest.mark.usefixtures("coarse_tables")

LAW = "line_of_action"
SETTINGS = SteadySettings(SpeedRange.from_text("50:8000:80"), "parametric")
VARIANTS = ("rigid", "bushing")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Steady responses of both variants, and nothing else."""
    folder = tmp_path_factory.mktemp("steady")
    gearbox, stiffness = spur_with_tables(folder, LAW)
    for variant in VARIANTS:
        assembly = assembled(gearbox, Choice(variant, LAW), stiffness)
        stored_or_computed(response_path(folder, variant), assembly, SETTINGS)
    return folder


def response_path(folder: Path, variant: str) -> Path:
    return steady_path(folder, Choice(variant, LAW, "disc"), SETTINGS)


@pytest.mark.validation
def test_the_ranking_of_steady_responses_alone_is_that_of_the_largest_amplitudes_in_their_files(folder):
    """Second way: the arrays of the file, looked through for local maxima without any spectra."""
    report = write_report(folder)
    assert report.left_out == ()
    (group,) = data_of(report.path)["groups"]
    assert group["source"] == "constant speed, time-varying stiffness"
    assert list(group["variants"]) == list(VARIANTS)
    gearbox = Gearbox.from_toml(folder / "spur.toml")
    for variant in VARIANTS:
        data = load_response(response_path(folder, variant))
        told = [line.order for line in order_lines(gearbox)]
        loudest = next(peak for peak in peaks(data) if np.isclose(told, peak.order).any())
        listed = group["variants"][variant]["resonances"]
        first = max((own for own in listed if own["inside"]), key=lambda own: own["level"])
        # Levels have four digits and speeds five on the page.
        assert first["level"] == pytest.approx(20.0 * np.log10(loudest.amplitude / 1e-6), abs=0.051)
        assert first["speed"] == pytest.approx(loudest.speed * 30.0 / np.pi, rel=1e-4)
        channels = {channel["words"] for channel in group["variants"][variant]["channels"]}
        assert {"Overall transmission error", "Force: mesh spur"} <= channels


def test_words_say_that_figures_are_of_constant_speed_and_name_the_mode_without_a_file_of_modes(folder):
    report = write_report(folder)
    page = html.unescape(report.path.read_text(encoding="utf-8"))
    (card,) = [line for line in report.statements if line.startswith("Highest resonance")]
    for words in ("Transmission error ±", "(rank 1)", "Acceleration at bearings ±"):
        assert words in card
    note = "Forces and accelerations: largest magnitude of the vector, at the bearing or mount where it is largest;"
    assert note in page and "Accelerations: of the shafts at bearings; the housing is rigid." in page
    for words in (
        "Source: constant speed, time-varying stiffness",
        "On bearings, inertia set disc, constant speed, time-varying stiffness",
        "Radial forces on bearings, constant speed, time-varying stiffness",
        "No run-up; run exugear run",
        "energy balance closed to",
    ):
        assert words in page, words
    assert "no modes computed; run exugear modes for mode shapes" not in page
    assert "window-dependent" not in page.partition('id="assumptions"')[0]


def test_the_page_ranks_the_resonances_that_python_ranks(folder):
    page = write_report(folder).path.read_text(encoding="utf-8")
    (table,) = re.findall(r'<table id="resonances".*?</table>', page, re.DOTALL)
    expected = resonances(load_response(response_path(folder, "bushing")))
    for label, values in {
        "speed / rpm": expected["speed_rpm"].abs(),
        "frequency / Hz": expected["frequency_Hz"],
        "transmission error ± / µm": 1e6 * expected["error_m"],
        "bearing force ± / kN": 1e-3 * expected["force_N"],
        "acceleration at bearings ± / m/s²": expected["acceleration_m_per_s2"],
    }.items():
        shown = [float(value) for value in re.findall(f'data-order="([^"]*)" data-label="{label}"', table)]
        np.testing.assert_allclose(shown, values.head(len(shown)), rtol=1e-8)
        assert len(shown) == min(40, len(values)) > 10


@pytest.mark.validation
def test_with_run_ups_beside_them_both_sources_can_be_chosen(folder, tmp_path):
    both = tmp_path / "both"
    shutil.copytree(folder, both)
    gearbox = Gearbox.from_toml(both / "spur.toml")
    stiffness = mesh_stiffness(gearbox, LAW, both)
    simulated(gearbox, Choice("bushing", LAW, load_case="run_up"), stiffness, both)
    report = write_report(both)
    groups = data_of(report.path)["groups"]
    assert [group["source"] for group in groups] == ["constant speed, time-varying stiffness", "run-up run_up"]
    assert [group["words"] for group in groups] == [
        "Constant speed, time-varying stiffness, static load",
        "Run-up run_up",
    ]
    # The command line leads with constant speed; the run-up follows under its own name.
    assert len([line for line in report.statements if line.startswith("Highest resonance")]) == 1
    assert (
        len([line for line in report.statements if line.startswith("Run-up run_up: Highest transmission error")]) == 1
    )


def test_lines_that_mesh_frequencies_share_and_remarks_on_speeds_are_told(folder, monkeypatch):
    def read(path: Path) -> Any:
        data = load_response(path)
        remark = data["remark"].astype(object)
        remark[3] = "passing planets add 1.2 % of the overall transmission error at other orders"
        return data.assign(remark=remark).assign_attrs(shared_lines="2 x spur = 1 x other")

    monkeypatch.setattr("exugear.report.findings.context.load_response", read)
    page = html.unescape(write_report(folder).path.read_text(encoding="utf-8"))
    assert "Note: coinciding orders of several meshes: 2 × spur = 1 × other" in page
    assert page.count("passing planets add 1.2 % of the overall transmission error at other orders") >= 2


def into_the_corner(view: View) -> None:
    """Drag over the lowest speeds and frequencies, where this pair rings: its levels elsewhere are white."""
    frame = view.page.locator("#waterfall .u-over").bounding_box()
    left, bottom = frame["x"] + 1.0, frame["y"] + frame["height"] - 1.0
    view.page.mouse.move(left, bottom)
    view.page.mouse.down()
    view.page.mouse.move(left + 0.12 * frame["width"], bottom - 0.15 * frame["height"], steps=4)
    view.page.mouse.up()


@pytest.mark.parametrize("size", SIZES)
class TestInABrowser:
    pytestmark = IN_BROWSER

    def test_the_waterfall_of_lines_is_drawn_and_says_its_source(self, browser, folder, size):
        view = opened(browser, size)
        view.open(write_report(folder).path)
        assert view.page.evaluate("document.documentElement.scrollWidth - window.innerWidth") <= 0
        assert "Source: constant speed" in view.page.locator("#waterfall .hint").inner_text()
        view.page.locator("#waterfall").scroll_into_view_if_needed()
        into_the_corner(view)
        coloured = view.page.evaluate(
            """() => { const c = document.querySelector('#waterfall canvas'), g = c.getContext('2d');
            const p = g.getImageData(0, 0, c.width, c.height).data; let n = 0;
            for (let i = 0; i < p.length; i += 4)
              if (p[i] > p[i + 1] + 8 && p[i + 2] > p[i + 1] + 8) n++;
            return n / (p.length / 4); }"""
        )
        # Lines in the violet of levels up to the middle, on white ground; axes are grey, circles blue.
        assert 0.002 < coloured < 0.2
        view.page.locator("#bearings .choice:visible").first.click()
        title = view.page.locator("#waterfall figcaption strong")
        assert view.soon(lambda: title.inner_text().startswith("Force: "))
        view.page.locator("#difference").check()
        assert view.soon(lambda: "on bearings against on ideal joints" in title.inner_text())
        view.page.context.close()
        assert view.errors == []
