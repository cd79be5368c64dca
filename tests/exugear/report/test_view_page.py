"""The page of `exugear view` in a browser: mode numbers, list beside the picture, views and rest position."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.web.stage import ModeRow, write_mode_page
from exugear.system.build import assemble
from exugear.system.modes import modes_of

from .page_view import IN_BROWSER, View, opened

pytestmark = IN_BROWSER
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


@pytest.fixture
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
    assert json.loads(desk.page.locator("#data").text_content())["models"]["model"]["modes"][0]["number"] == 3


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


def test_nothing_scrolls_sideways_on_a_phone(browser: Any, page: Path) -> None:
    view = opened(browser, "phone")
    view.open(page)
    assert view.page.evaluate("document.documentElement.scrollWidth - window.innerWidth") <= 0
    view.page.context.close()
