"""The page of `exugear view` in a browser: numbers, lists beside the picture, views, marks, vibration in operation."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.web.mode_page import ModeRow, write_mode_page
from exugear.system.build import assemble
from exugear.system.modes import modes_of

from ..cases.command import exugear
from ..cases.spur import SPUR_CASE
from .page_view import IN_BROWSER, SIZES, View, opened

pytestmark = [*IN_BROWSER, pytest.mark.usefixtures("coarse_tables")]
NUMBERS = (3, 8, 9, 12)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, stiffness: dict[str, np.ndarray]) -> Path:
    gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    modes = modes_of(assemble(gearbox, Choice("bushing", "line_of_action", "assemblies"), stiffness))
    places = [number - 1 for number in NUMBERS]
    rows = [
        ModeRow(number, float(modes.frequency[place]), 0.02, f"moves {number}", "bearing 90 %", "1: stage, 20 rpm")
        for number, place in zip(NUMBERS, places, strict=True)
    ]
    path = tmp_path_factory.mktemp("view") / "modes.html"
    return write_mode_page(modes.assembly, modes.shapes[:, places], rows, path, heading="GRC", first=1)


@pytest.fixture(scope="module")
def desk(browser: Any, page: Path) -> Iterator[View]:
    view = opened(browser, "desk")
    view.open(page)
    yield view
    assert view.errors == []
    view.page.context.close()


def test_numbers_are_those_of_the_command_line(desk: View) -> None:
    numbers = desk.page.locator("#modes tbody tr td:first-child").all_inner_texts()
    assert [int(number) for number in numbers] == list(NUMBERS)
    assert desk.page.locator("#mode-title").inner_text().startswith("Mode 8 at ")
    desk.page.locator("#next").click()
    assert desk.soon(lambda: desk.page.locator("#mode-title").inner_text().startswith("Mode 9 at "))
    assert desk.page.locator("tr.chosen td").first.inner_text() == "9"
    assert json.loads(desk.page.locator("#data").text_content())["models"]["model"]["modes"][0]["title"].startswith(
        "Mode 3 at "
    )


def test_the_list_stands_beside_the_picture(desk: View) -> None:
    picture, table = (desk.page.locator(name).bounding_box() for name in ("#view-3d", "#modes"))
    assert table["x"] >= picture["x"] + picture["width"]
    assert table["y"] < picture["y"] + picture["height"]


def test_rest_position_and_views_change_the_picture(desk: View) -> None:
    moved = desk.pixels("#view-3d")
    desk.page.locator("#at-rest").check()
    assert desk.soon(lambda: desk.pixels("#view-3d") != moved)
    desk.page.locator("#at-rest").uncheck()
    assert desk.soon(lambda: desk.pixels("#view-3d") == moved)
    for name in ("−z end", "+z end", "Side", "Top"):
        before = desk.pixels("#view-3d")
        desk.page.get_by_role("button", name=name).click()
        assert desk.soon(lambda before=before: desk.pixels("#view-3d") != before)
    desk.page.get_by_role("button", name="Whole").click()
    assert desk.soon(lambda: desk.pixels("#view-3d") == moved)


RECORDED = """window.tags = []; const draw = CanvasRenderingContext2D.prototype.strokeRect;
CanvasRenderingContext2D.prototype.strokeRect = function (...box) { window.tags.push(box); draw.apply(this, box); };"""
COUNT = """([left, top, right, bottom]) => { const c = document.querySelector('#marks'), w = c.width, h = c.height;
const p = c.getContext('2d').getImageData(left * w, top * h, (right - left) * w, (bottom - top) * h).data;
let n = 0; for (let i = 3; i < p.length; i += 4) if (p[i] > 128) n++; return n; }"""
AXES, SCALE, NAMES = (0.0, 0.72, 0.35, 1.0), (0.65, 0.85, 1.0, 1.0), (0.1, 0.05, 1.0, 0.65)


@pytest.fixture(scope="module", params=SIZES)
def marked(browser: Any, page: Path, request: pytest.FixtureRequest) -> Iterator[View]:
    view = opened(browser, request.param)
    view.page.add_init_script(RECORDED)
    view.open(page)
    yield view
    assert view.errors == []
    view.page.context.close()


def test_nothing_scrolls_sideways(marked: View) -> None:
    assert marked.page.evaluate("document.documentElement.scrollWidth - window.innerWidth") <= 0


def test_axes_scale_and_names_are_drawn_and_names_can_be_hidden(marked: View) -> None:
    assert marked.soon(lambda: all(marked.page.evaluate(COUNT, part) > 30 for part in (AXES, SCALE, NAMES)))
    marked.page.locator("#labels").uncheck()
    assert marked.soon(lambda: marked.page.evaluate(COUNT, NAMES) == 0)
    assert all(marked.page.evaluate(COUNT, part) > 30 for part in (AXES, SCALE))
    marked.page.locator("#labels").check()
    assert marked.soon(lambda: marked.page.evaluate(COUNT, NAMES) > 30)


def test_names_do_not_cover_each_other(marked: View) -> None:
    bodies = marked.page.locator("#bodies button").count()
    boxes = marked.page.evaluate("window.tags")[-bodies:]
    width, height = marked.page.evaluate("(c => [c.clientWidth, c.clientHeight])(document.querySelector('#marks'))")
    assert len(boxes) == bodies == 8
    for n, (x, y, wide, high) in enumerate(boxes):
        assert x >= 0 and x + wide <= width and y >= 0 and y + high <= height
        for left, top, other, _ in boxes[:n]:
            assert x >= left + other or left >= x + wide or abs(y - top) >= high


@pytest.fixture(scope="module")
def operation(tmp_path_factory: pytest.TempPathFactory, coarse_tables: None) -> tuple[Path, dict[str, Any]]:
    """Page of a spur pair with a stored steady-state response, and the summary of that response."""
    folder = tmp_path_factory.mktemp("operation")
    case = folder / "spur.toml"
    case.write_text(SPUR_CASE, encoding="utf-8")
    options = (case, "--variant", "bushing", "--out", folder / "out", "--json")
    refused = exugear("view", *options, "--resonance", 1)
    assert refused.exit_code == 2
    assert "no steady-state response; run: exugear steady " in refused.stderr
    assert not list(folder.rglob("*.html"))
    first = exugear("view", *options)
    assert first.exit_code == 0, first.stderr
    page = Path(json.loads(first.stdout)["files"][0])
    assert "exugear steady " in page.read_text(encoding="utf-8")
    steady = exugear("steady", *options)
    assert steady.exit_code == 0, steady.stderr
    usual = exugear("view", *options)
    assert usual.exit_code == 0, usual.stderr
    assert json.loads(usual.stdout)["resonance"] == 1
    shown = exugear("view", *options, "--resonance", 2)
    assert shown.exit_code == 0, shown.stderr
    assert json.loads(shown.stdout)["resonance"] == 2
    return page, json.loads(steady.stdout)


def test_a_phone_shows_the_first_resonance_with_its_picture_in_view(
    browser: Any, operation: tuple[Path, dict[str, Any]]
) -> None:
    view = opened(browser, "phone")
    view.open(operation[0])
    assert view.page.evaluate("window.scrollY") == 0
    assert view.page.locator("#mode-title").is_visible()
    box = view.page.locator("#view-3d").bounding_box()
    assert box["y"] + box["height"] <= SIZES["phone"][1]
    view.page.context.close()


def test_resonances_are_those_of_the_command_line(browser: Any, operation: tuple[Path, dict[str, Any]]) -> None:
    path, summary = operation
    view = opened(browser, "desk")
    view.open(path)
    rows = view.page.locator("#operation tbody tr").all()
    assert len(rows) == min(10, len(summary["resonances"])) > 1
    for number, (row, resonance) in enumerate(zip(rows, summary["resonances"], strict=False), start=1):
        cells = row.locator("td").all_inner_texts()
        assert cells[:2] == [str(number), resonance["line"].replace(" x ", " × ")]
        assert float(cells[2]) == pytest.approx(abs(resonance["speed_rpm"]), abs=0.006)
        assert float(cells[3]) == pytest.approx(resonance["frequency_Hz"], abs=0.06)
        assert float(cells[4]) == pytest.approx(1e6 * resonance["error_m"], rel=0.006)
    assert view.page.locator("#mode-title").inner_text().startswith("Resonance 2: ")
    view.page.context.close()


@pytest.mark.parametrize("size", SIZES)
def test_a_resonance_changes_the_picture_and_moves(
    browser: Any, operation: tuple[Path, dict[str, Any]], size: str
) -> None:
    view = opened(browser, size)
    view.open(operation[0])
    view.page.locator("#modes tbody button").first.click()
    assert view.soon(lambda: view.page.locator("#mode-title").inner_text().startswith("Mode "))
    mode = view.pixels("#view-3d")
    view.page.locator("#operation tbody button").first.click()
    assert view.soon(lambda: view.page.locator("#mode-title").inner_text().startswith("Resonance 1: "))
    assert view.soon(lambda: view.pixels("#view-3d") != mode)
    assert view.page.locator("tr.chosen td").first.inner_text() == "1"
    still = view.pixels("#view-3d")
    view.page.locator("#view-3d").scroll_into_view_if_needed()
    view.page.locator("#play").click()
    assert view.soon(lambda: view.pixels("#view-3d") != still)
    assert view.page.evaluate("document.documentElement.scrollWidth - window.innerWidth") <= 0
    assert view.errors == []
    view.page.context.close()
