"""The first screen of the GRC: headline, ranking and command line agree; printed pages, phones, no scripts."""

from __future__ import annotations

import csv
import html
import io
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.report.findings.resonance_list import MOST_INSIDE
from exugear.report.findings.result_checks import share_check
from exugear.report.writer import write_report
from exugear.results.folder import keep_case, modes_path
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import load_response, steady_path, stored_or_computed
from exugear.system.build import assemble
from exugear.system.modes import modes_of

from ..cases.command import exugear
from .page_view import IN_BROWSER, View, opened

CHOICE = Choice("bushing", "line_of_action", "assemblies")
SETTINGS = SteadySettings(SpeedRange.from_text("-10:-35:60"), harmonics=4)
MOST_PAGES = 4
OPERATION = (11.05, 27.625)
"""Operating range of the GRC, rpm."""
PARTS = ["Answer", "Resonances", "Changes", "Bearings and life", "Gears", "Model and checks"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, stiffness: dict[str, np.ndarray]) -> Iterator[Path]:
    """Modes and a steady response of the GRC with given mesh stiffness, without tables."""
    folder = tmp_path_factory.mktemp("grc")
    gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    keep_case(gearbox, folder)
    assembly = assemble(gearbox, CHOICE, stiffness)
    stored_or_computed(steady_path(folder, CHOICE, SETTINGS), assembly, SETTINGS)
    modes_of(assembly).save(modes_path(folder, CHOICE))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("exugear.report.findings.context.mesh_stiffness", lambda *arguments: stiffness)
        yield folder


@pytest.fixture(scope="module")
def told(folder: Path) -> dict[str, Any]:
    """What the command line says as JSON; it writes the page."""
    outcome = exugear("report", folder, "--json")
    assert outcome.exit_code == 0, outcome.stderr
    return json.loads(outcome.stdout)


@pytest.fixture(scope="module")
def view(browser: Any, folder: Path, told: dict[str, Any]) -> Iterator[View]:
    view = opened(browser, "desk")
    view.open(folder / "report.html")
    yield view
    assert view.errors == []
    view.page.context.close()


@pytest.mark.validation
def test_a_higher_peak_outside_the_operating_range_does_not_lead(folder, told, tmp_path, monkeypatch):
    def planted(path: Path) -> Any:
        data = load_response(path)
        low, high = json.loads(data.attrs["operating_range"])
        speed = np.abs(data["speed"].to_numpy())
        amplitude = data["amplitude"].to_numpy().copy()
        amplitude[(speed < low) | (speed > high)] *= 1e3
        return data.assign(amplitude=(data["amplitude"].dims, amplitude))

    shutil.copytree(folder, tmp_path / "planted")
    monkeypatch.setattr("exugear.report.findings.context.load_response", planted)
    monkeypatch.setattr("exugear.report.writer.model_variations", lambda *arguments: ())
    report = write_report(tmp_path / "planted")
    assert report.resonances[0]["frequency_Hz"] == told["resonances"][0]["frequency_Hz"]
    outside = next(line for line in report.statements if line.startswith("Just outside the range"))
    amplitude = re.search(r"bearing force ±(\d+)", outside)
    assert amplitude and float(amplitude[1]) > 0.1 * told["resonances"][0]["force_N"]


@pytest.mark.parametrize(
    ("number", "count", "passed", "said"),
    [
        (9, 10, True, "Passed: 9 of the 10 highest resonances are at a mode"),
        (3, 10, False, "Warning: only 3 of the 10 highest resonances are at a mode"),
        (1, 1, True, "Passed: the highest resonance is at a mode"),
        (0, 1, False, "Warning: the highest resonance is not at a mode"),
    ],
)
def test_checks_of_resonances_are_sentences(number, count, passed, said):
    assert share_check(number, count, passed, "at a mode").line == said


@pytest.mark.validation
@pytest.mark.parametrize(("highest", "warns"), [(27.625, True), (60.0, False)])
def test_speeds_beyond_the_operating_range_are_a_warning(folder, tmp_path, monkeypatch, highest, warns):
    """The response reaches 35 rpm."""
    shutil.copytree(folder, tmp_path / "other")
    monkeypatch.setattr("exugear.report.writer.model_variations", lambda *arguments: ())
    monkeypatch.setattr(
        "exugear.report.findings.result_checks.operating_range", lambda gearbox: (1.0 * RPM, highest * RPM)
    )
    statements = write_report(tmp_path / "other").statements
    said = [line for line in statements if "the highest computed speed is" in line]
    assert bool(said) == warns
    assert all("1.3 times the highest operating speed" in line for line in said)


@pytest.mark.validation
def test_a_note_on_the_result_is_no_passed_check(folder, tmp_path, monkeypatch):
    """Peaks that may be higher between the computed speeds are a warning within the first ranks, else a note."""

    def planted(path: Path) -> Any:
        higher = [{"quantity": "force", "rank": 40, "excess": 0.5}]
        return load_response(path).assign_attrs(higher_between=json.dumps(higher))

    shutil.copytree(folder, tmp_path / "planted")
    monkeypatch.setattr("exugear.report.findings.context.load_response", planted)
    monkeypatch.setattr("exugear.report.writer.model_variations", lambda *arguments: ())
    report = write_report(tmp_path / "planted")
    page = html.unescape(report.path.read_text(encoding="utf-8"))
    lists = dict(re.findall(r'<ul class="findings" aria-label="([^"]*)">(.*?)</ul>', page, re.DOTALL))
    noted = re.sub(r"<[^>]*>", "", lists["Notes"])
    assert "Note: peaks of lower rank may be higher between the computed speeds" in noted
    assert "peaks of lower rank" not in lists["Passed checks"] + lists["Warnings"]
    assert "Passed: " not in noted and f"Notes ({noted.count('Note: ')})</summary>" in page
    assert any(line.startswith("Note: peaks of lower rank") for line in report.statements)


def rows_of(page: str, table: str) -> list[dict[str, str]]:
    """Cells of a table of the page by their label."""
    (body,) = re.findall(rf'<table id="{table}".*?</table>', page, re.DOTALL)
    rows = re.findall(r"<tr.*?</tr>", body.split("<tbody>")[1], re.DOTALL)
    cell = r'<t[dh][^>]*data-label="([^"]*)"[^>]*>(.*?)</t[dh]>'
    return [{label: re.sub(r"<[^>]*>", "", text).strip() for label, text in re.findall(cell, row)} for row in rows]


FACTORS = {"force_N": 1e-3, "error_m": 1e6, "acceleration_m_per_s2": 1.0}
COLUMNS = {
    "force": "bearing force ± / kN",
    "error": "transmission error ± / µm",
    "acceleration": "acceleration at bearings ± / m/s²",
}


@pytest.mark.validation
def test_all_numbers_of_the_page_are_those_of_one_list(folder, told):
    """Headline, quantities, bands, leaders, ranking and the panels of single resonances, each read from the page."""
    page = html.unescape((folder / "report.html").read_text(encoding="utf-8"))
    listed = told["resonances"]
    first = listed[0]
    # The ranking has the list, and the headline is its first row.
    rows = rows_of(page, "resonances")
    for row, own in zip(rows[:MOST_INSIDE], listed, strict=False):
        assert float(row["speed / rpm"]) == pytest.approx(abs(own["speed_rpm"]), rel=5e-3)
        assert float(row["frequency / Hz"]) == pytest.approx(own["frequency_Hz"], rel=5e-3)
        for (key, factor), label in zip(FACTORS.items(), COLUMNS.values(), strict=True):
            assert float(row[label]) == pytest.approx(factor * own[key], rel=5e-3, abs=1e-9)
    # Below are resonances at other speeds, without ranks.
    beyond = rows[min(MOST_INSIDE, len(listed)) :]
    assert beyond
    for row in beyond:
        assert not OPERATION[0] <= float(row["speed / rpm"]) <= OPERATION[1]
        assert row["rank, error"] == row["rank, acceleration"] == "–"
    large = re.findall(r'<p class="large">(.*?)</p>', page)[0]
    frequency, speed = re.findall(r"<strong>([\d.]+) (?:Hz|rpm)", large)
    assert (frequency, speed) == (rows[0]["frequency / Hz"], rows[0]["speed / rpm"])
    (quantities,) = re.findall(r'<table class="quantities">.*?</table>', page, re.DOTALL)
    for name, label in COLUMNS.items():
        (shown,) = re.findall(rf'<tr class="{name}">(.*?)</tr>', quantities, re.DOTALL)
        value, unit, band = re.search(r"±([^ ]+) <small>(.*?)</small></td><td[^>]*>(.*?)</td>", shown).groups()
        assert (value, unit) == (rows[0][label], label.rsplit("/ ", 1)[-1] if name != "acceleration" else "m/s²")
        key = next(key for key in FACTORS if key.startswith(name))
        ends = [first[f"{name}_{end}_damping_{key.removeprefix(name + '_')}"] for end in ("highest", "lowest")]
        factor = FACTORS[key]
        assert [float(end) for end in band.split(" to ")] == pytest.approx([factor * end for end in ends], rel=5e-3)
    # The deciding quantity is highest in the first resonance, and the leaders of the others are listed.
    assert first["force_place"] == 1 and first["force_N"] == max(own["force_N"] for own in listed if own["force_place"])
    for name, key in (("error", "error_m"), ("acceleration", "acceleration_m_per_s2")):
        leader = next(own for own in listed if own[f"{name}_place"] == 1)
        title = {"error": "Transmission error", "acceleration": "Acceleration at bearings"}[name]
        (line,) = [text for text in told["statements"] if text.startswith(f"Highest in other quantities: {title}")]
        if leader is first:
            assert line.endswith("this resonance.")
            continue
        value, at, turns = re.search(r"±([\d.e+-]+).*?, ([\d.]+) Hz at ([\d.]+) rpm", line).groups()
        assert float(value) == pytest.approx(FACTORS[key] * leader[key], rel=5e-3)
        assert [float(at), float(turns)] == pytest.approx([leader["frequency_Hz"], abs(leader["speed_rpm"])], rel=5e-3)
    # "Damping does not change the first rank" is said only if the ranks over the range of damping say so.
    stays = any("Damping does not change the first rank" in text for text in told["statements"])
    assert stays == (first["force_places_over_damping"] == [1, 1])
    # Each row of the list has the speed, the frequency and the order of the panel that opens from it.
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])
    compared = 0
    for group in data["groups"]:
        for name, variant in group["variants"].items():
            leads = group is data["groups"][0] and name == group["main"]
            table = "resonances" if leads else f"resonances-{group['name']}-{name}"
            for row, panel in zip(rows_of(page, table), variant["resonances"], strict=True):
                assert float(row["speed / rpm"]) == pytest.approx(panel["speed"], rel=5e-3)
                assert float(row["frequency / Hz"]) == pytest.approx(panel["frequency"], rel=5e-3)
                error = 1e-6 * float(row[COLUMNS["error"]])
                assert 20.0 * np.log10(error / 1e-6) == pytest.approx(panel["level"], abs=0.06)
                assert row["excited by"] == panel["short"]
                facts = dict(panel["facts"])
                assert facts["Bearing force"].startswith(f"±{row[COLUMNS['force']]} kN")
                compared += 1
    assert compared > 10


class TestInABrowser:
    pytestmark = IN_BROWSER

    def test_headline_first_row_and_json_agree(self, view: View, told: dict[str, Any]) -> None:
        first = told["resonances"][0]
        large = view.page.locator("#answer .headline .large").inner_text()
        frequency, speed = (float(text) for text in re.findall(r"([\d.]+) (?:Hz|rpm)", large))
        assert frequency == pytest.approx(first["frequency_Hz"], rel=5e-3)
        assert speed == pytest.approx(abs(first["speed_rpm"]), rel=5e-3)
        row = view.page.locator("#resonances tbody tr").first
        assert float(row.locator("[data-label='frequency / Hz']").inner_text()) == frequency
        assert float(row.locator("[data-label='speed / rpm']").inner_text()) == speed
        values = view.page.locator(".quantities .value").all_inner_texts()
        for shown, (key, factor) in zip(values, FACTORS.items(), strict=True):
            assert float(shown.split()[0].removeprefix("±")) == pytest.approx(factor * first[key], rel=5e-3)
        assert f"Highest resonance: {frequency:.0f} Hz" in " ".join(told["statements"])
        # The panel next to the waterfall shows it at this speed, not where its mode is excited most at any speed.
        detail = re.findall(r"([\d.]+) (?:Hz|rpm)", view.page.locator("#detail h3").inner_text())
        assert [float(detail[0]), float(detail[-1])] == pytest.approx([frequency, speed], rel=5e-3)

    def test_the_first_screen_is_seen_without_scrolling(self, view: View) -> None:
        view.page.set_viewport_size({"width": 1440, "height": 900})
        boxes = [box.bounding_box() for box in view.page.locator("#answer .chain").all()]
        assert len(boxes) == 3
        assert max(box["y"] + box["height"] for box in boxes) <= 900
        assert view.page.locator("#answer svg.drawing:visible").count() == 1
        assert view.page.locator("#answer img.mode-picture").count() == 1
        sentences = view.page.locator("#answer .card > p, #answer .about p, #answer .further p").all_inner_texts()
        assert max(len(text.split()) for text in sentences) <= 25

    def test_the_page_has_six_parts_and_large_controls(self, view: View) -> None:
        assert view.page.locator("nav a").all_inner_texts() == PARTS
        assert view.page.evaluate("(n => n.scrollWidth - n.clientWidth)(document.querySelector('nav'))") <= 0
        small = """() => [...document.querySelectorAll('button, select, input, summary, nav a')].filter(e =>
            e.offsetParent && e.getBoundingClientRect().height < 24).map(e => e.outerHTML)"""
        assert view.page.evaluate(small) == []

    def test_a_circle_selects_its_resonance_everywhere_and_the_cursor_is_shared(self, view: View) -> None:
        circle = view.page.locator("#answer svg.wide-only g.ranked:has-text('4')").first
        circle.click()
        assert "No. 4 of " in view.page.locator("#detail").inner_text()
        assert view.page.locator("#resonances tr.chosen td").first.inner_text() == "4"
        assert view.page.locator(".campbell-figure svg.wide-only g.chosen").text_content().strip() == "4"
        drawing = view.page.locator("#answer svg.wide-only")
        drawing.hover()
        readout = view.page.locator("#speed-readout")
        assert view.soon(lambda: re.match(r"[\d.]+ rpm: .*force ±", readout.inner_text()))
        assert view.page.locator("svg.wide-only .cursor[visibility=visible]").count() == 2
        view.page.locator("#resonances tbody tr").first.click()

    def test_diagrams_begin_at_the_operating_range(self, view: View) -> None:
        assert view.page.locator("#extent").input_value() == "first"
        data = json.loads(view.page.locator("#data").text_content())
        (group,) = data["groups"]
        listed = group["variants"]["bushing"]["resonances"]
        rows = view.page.locator("#resonances tbody tr:visible")
        assert rows.count() == 10
        view.page.locator("#extent").select_option("range")
        assert rows.count() == sum(own["inside"] for own in listed) < len(listed)
        view.page.locator("#extent").select_option("all")
        assert rows.count() == len(listed)
        view.page.locator("#extent").select_option("first")
        assert group["range"] == pytest.approx(OPERATION)
        speeds, columns = group["variants"]["bushing"]["channels"][0]["knots"]
        inside = np.diff(np.interp([0.8 * OPERATION[0], 1.15 * OPERATION[1]], speeds, columns))[0]
        assert inside >= 0.5 * columns[-1]

    def test_circles_are_those_of_the_ranking(self, view: View) -> None:
        circles = view.page.locator("#ranking .campbell-figure svg.wide-only .ranked text").all_text_contents()
        rows = view.page.locator("#resonances tbody tr:visible").count()
        assert sorted(map(int, circles)) == list(range(1, rows + 1))
        assert view.page.locator("#ranking .campbell-figure svg.wide-only .rated").count() == 1

    def test_data_files_have_plain_numbers(self, view: View) -> None:
        with view.page.expect_download() as got:
            view.page.locator("#ranking .listed .of-table button:visible").click()
        text = Path(got.value.path()).read_text(encoding="utf-8-sig")
        head, *rows = csv.reader(io.StringIO(text))
        texts = {"excited by", "place", "mode shape"}
        for row in rows:
            for name, value in zip(head, row, strict=True):
                assert name in texts or value == "" or np.isfinite(float(value)), (name, value)

    def test_the_rank_is_labelled_on_a_phone_which_has_no_heading_row(self, view: View) -> None:
        view.page.set_viewport_size({"width": 390, "height": 844})
        assert not view.page.locator(".quantities thead").is_visible()
        content = "cell => getComputedStyle(cell, '::before').content + cell.dataset.label"
        labels = [cell.evaluate(content) for cell in view.page.locator(".quantities td:nth-child(4)").all()]
        assert labels and all("rank" in label and not label.startswith("none") for label in labels)
        view.page.set_viewport_size({"width": 1440, "height": 900})

    def test_nothing_scrolls_sideways_on_a_phone(self, view: View, folder: Path) -> None:
        view.page.set_viewport_size({"width": 390, "height": 844})
        view.open(folder / "report.html")
        assert view.page.evaluate("document.documentElement.scrollWidth") <= 390
        assert view.page.locator("#answer svg.drawing:visible").count() == 1
        inside = "[...document.querySelectorAll('#answer *, #resonances *')].map(e => e.getBoundingClientRect().right)"
        assert max(view.page.evaluate(inside)) <= 390.5
        view.page.set_viewport_size({"width": 1440, "height": 900})
        view.open(folder / "report.html")

    def test_few_pages_are_printed(self, view: View) -> None:
        view.page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
        pages = len(re.findall(rb"/Type\s*/Page\b", view.page.pdf(prefer_css_page_size=True)))
        assert 2 <= pages <= MOST_PAGES
        view.page.emulate_media(media="print")
        view.page.set_viewport_size({"width": 711, "height": 1039})  # A4 without its margins
        first = view.page.locator("#answer").bounding_box()
        assert first["y"] + first["height"] <= 1039
        assert not view.page.locator("#waterfall, #view-3d, #inputs").locator("visible=true").count()
        assert view.page.locator("#resonances tbody tr:visible").count() == 10
        assert view.page.locator(".paper-only").is_visible()
        view.page.emulate_media(media="screen")
        view.page.set_viewport_size({"width": 1440, "height": 900})
        view.page.evaluate("window.dispatchEvent(new Event('afterprint'))")

    def test_without_scripts_text_and_drawings_are_there(self, browser: Any, folder: Path, view: View) -> None:
        plain = opened(browser, "desk", java_script_enabled=False)
        plain.page.goto((folder / "report.html").as_uri())
        assert plain.page.locator("#answer svg.drawing:visible").count() == 1
        assert "Hz" in plain.page.locator("#answer .headline").inner_text()
        assert plain.page.locator("#ranking .campbell-figure svg:visible").count() == 1
        assert plain.page.locator("#resonances tbody tr:visible").count() >= 5
        assert plain.errors == []
        plain.page.context.close()
