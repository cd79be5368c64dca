"""What a reader does with the page, in a real browser, at the size of a desk and of a phone: numbers, pixels, files."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.writer import write_report
from exugear.results.folder import keep_case, modes_path
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.tables import requested_tables

from ..cases.assembled import modes_with_bodies, simulated
from ..cases.spur import COARSE_INPUT, SPUR_CASE
from .page_view import IN_BROWSER, SIZES, View, opened

LAW = "line_of_action"
NAME = "</script><img src=x onerror=document.title=1> & pair"
pytestmark = IN_BROWSER


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Page of a spur pair on ideal joints and on bearings, with a name that tries to break out."""
    pytest.importorskip("playwright", reason="no playwright: pip install playwright")
    folder = tmp_path_factory.mktemp("page")
    case = folder / "spur.toml"
    text = SPUR_CASE.replace('"one spur pair"', json.dumps(NAME))
    case.write_text(f"{text}\n[operation]\nrated_speed_rpm = 100.0\n", encoding="utf-8")
    gearbox = Gearbox.from_toml(case)
    keep_case(gearbox, folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
        for request in requested_tables(gearbox, folder):
            request.compute()
        stiffness = mesh_stiffness(gearbox, LAW, folder)
        for variant in ("rigid", "bushing"):
            simulated(gearbox, Choice(variant, LAW, load_case="run_up"), stiffness, folder)
            modes = modes_with_bodies(gearbox, Choice(variant, LAW), stiffness)
            modes.save(modes_path(folder, Choice(variant, LAW, "disc")))
        return write_report(folder).path


@pytest.fixture(scope="module")
def data(path: Path) -> dict[str, Any]:
    """What the scripts read."""
    found = re.search(r'id="data">(.*?)</script>', path.read_text(encoding="utf-8"), re.DOTALL)
    assert found
    return json.loads(found[1])


@pytest.fixture(scope="module", params=SIZES)
def shown(browser: Any, path: Path, request: pytest.FixtureRequest) -> Iterator[View]:
    view = opened(browser, request.param)
    yield view
    assert view.errors == []
    view.page.context.close()


@pytest.fixture
def view(shown: View, path: Path) -> View:
    shown.open(path)
    return shown


def test_nothing_sticks_out_sideways_and_names_are_text(view: View) -> None:
    assert view.page.evaluate("document.documentElement.scrollWidth - window.innerWidth") <= 0
    assert view.page.locator("h1").inner_text() == NAME
    assert view.page.title().startswith(NAME)
    assert view.page.locator("img[src=x]").count() == 0


def test_the_headline_and_the_chosen_row_are_the_highest_steady_resonance(view: View, data: dict[str, Any]) -> None:
    variant = data["groups"][0]["variants"]["bushing"]
    chosen = variant["resonances"][variant["first"]]
    assert chosen["steady"]  # what one window alone shows is no headline
    shown = f"{chosen['frequency']:.0f}"
    large = view.page.locator(".headline .large strong").first.inner_text()
    assert float(large.split()[0]) == pytest.approx(chosen["frequency"], rel=0.01)
    assert view.page.locator("tr.chosen:visible td").nth(2).inner_text().split()[-1].startswith(shown[:3])
    told = view.page.locator("#detail h3").inner_text().partition(" Hz")[0]
    assert float(told) == pytest.approx(chosen["frequency"], abs=0.51)


def test_the_waterfall_has_quiet_and_loud_places(view: View, data: dict[str, Any]) -> None:
    """The canvas itself: white ground, and colour where the run-up rings."""
    view.page.locator("#waterfall").scroll_into_view_if_needed()
    share = view.page.evaluate(
        """() => { const c = document.querySelector('#waterfall canvas'), g = c.getContext('2d');
        const p = g.getImageData(0, 0, c.width, c.height).data; let bright = 0, coloured = 0;
        for (let i = 0; i < p.length; i += 4) {
          if (p[i] + p[i + 1] + p[i + 2] > 700) bright++;
          if (Math.max(p[i], p[i + 1], p[i + 2]) - Math.min(p[i], p[i + 1], p[i + 2]) > 60) coloured++; }
        return [bright / (p.length / 4), coloured / (p.length / 4)]; }"""
    )
    assert share[0] > 0.1
    assert 0.01 < share[1] < 0.9


def test_the_mode_is_drawn_in_colour(view: View) -> None:
    view.page.locator("#view-3d").scroll_into_view_if_needed()
    count = """() => { const c = document.createElement('canvas'), v = document.querySelector('#view-3d');
        c.width = v.width; c.height = v.height; const g = c.getContext('2d'); g.drawImage(v, 0, 0);
        const p = g.getImageData(0, 0, c.width, c.height).data; let n = 0, black = 0, red = 0;
        for (let i = 0; i < p.length; i += 4) if (p[i + 3] > 250) { n++;
          if (p[i] + p[i + 1] + p[i + 2] < 60) black++; if (p[i] > 1.4 * p[i + 2]) red++; }
        return [n / (c.width * c.height), black / n, red / n]; }"""
    assert view.soon(lambda: view.page.evaluate(count)[0] > 0.05)
    covered, black, red = view.page.evaluate(count)
    assert covered < 0.9 and black < 0.1 and red > 0.02


def test_a_mode_moves_while_it_plays_and_rests_when_it_pauses(view: View) -> None:
    view.page.locator("#view-3d").scroll_into_view_if_needed()
    assert view.page.locator("#play").inner_text() == "Play"  # motion is reduced, as the reader's machine asks
    rest = view.pixels("#view-3d")
    view.page.locator("#play").click()
    assert view.soon(lambda: view.pixels("#view-3d") != rest)
    view.page.locator("#play").click()
    still = view.pixels("#view-3d")
    view.page.wait_for_timeout(300)
    assert view.pixels("#view-3d") == still


def test_a_row_moves_everything_and_the_address_keeps_it(view: View, path: Path, data: dict[str, Any]) -> None:
    last = len(data["groups"][0]["variants"]["bushing"]["resonances"]) - 1
    assert last > 0
    view.page.locator("#extent").select_option("all")
    view.page.locator("#ranking [data-variant=bushing] tbody tr").nth(last).click()
    said = f"No. {last + 1} of {last + 1}"
    assert said in view.page.locator("#detail").inner_text()
    assert view.page.locator("tr.chosen:visible td").first.inner_text().split()[-1] == str(last + 1)
    assert f"resonance={last}" in view.page.url
    view.open(path, "#" + view.page.url.split("#")[1])
    assert said in view.page.locator("#detail").inner_text()


def test_a_damaged_address_opens_all_the_same(view: View, path: Path) -> None:
    view.open(path, "#group=nothing&variant=%3Cb%3E&resonance=999&lines=77,x&extent=none&mode=1e9&channel=none&model=0")
    assert "Hz" in view.page.locator("#detail").inner_text()


VALUES = "cells => cells.map(cell => cell.dataset.order)"


def test_rows_are_sorted_and_filtered(view: View, data: dict[str, Any]) -> None:
    view.page.locator("#extent").select_option("all")
    table = view.page.locator("#ranking .listed table:visible")
    if view.page.viewport_size["width"] > 620:  # a phone shows cards without headings
        table.locator("th button", has_text="frequency").click()
    else:
        table.locator("th button", has_text="frequency").evaluate("button => button.click()")
    told = [float(text) for text in table.locator("tbody td:nth-child(3)").evaluate_all(VALUES)]
    assert told == sorted(told, reverse=True)
    assert table.locator("th[aria-sort=descending]").count() == 1
    view.page.locator("#filter").fill("nothing has the same name; rename one")
    assert table.locator("tbody tr:visible").count() == 0
    view.page.locator("#filter").fill("")
    view.page.locator("#extent").select_option("range")
    listed = data["groups"][0]["variants"]["bushing"]["resonances"]
    inside = {n for n, own in enumerate(listed, start=1) if own["inside"]}
    shown = table.locator("tbody tr:visible td:nth-child(1)").evaluate_all(VALUES)
    assert {int(number) for number in shown} == inside


def test_keys_zoom_the_waterfall_and_turn_the_stage(view: View) -> None:
    plot = view.page.locator("#waterfall .plot")
    plot.scroll_into_view_if_needed()
    whole = view.pixels("#waterfall canvas")
    plot.focus()
    view.page.keyboard.press("+")
    assert view.soon(lambda: view.pixels("#waterfall canvas") != whole)
    view.page.keyboard.press("0")
    assert view.soon(lambda: view.pixels("#waterfall canvas") == whole)
    stage = view.page.locator("#view-3d")
    stage.scroll_into_view_if_needed()
    before = view.pixels("#view-3d")
    stage.focus()
    view.page.keyboard.press("ArrowRight")
    assert view.soon(lambda: view.pixels("#view-3d") != before)


def test_dragging_zooms_and_hovering_reads_the_level(view: View) -> None:
    over = view.page.locator("#waterfall .u-over")
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    whole = view.pixels("#waterfall canvas")
    mouse = view.page.mouse
    mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    told = view.page.locator("#readout").inner_text()
    assert re.fullmatch(r"[\d.]+ rpm, [\d.]+ Hz, order [\d.]+: -?[\d.]+ dB = [\d.e-]+ µm", told)
    mouse.down()
    mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 0.9 * box["height"], steps=5)
    mouse.up()
    assert view.soon(lambda: view.pixels("#waterfall canvas") != whole)


def test_difference_and_a_bearing_as_signal(view: View) -> None:
    title = view.page.locator("#waterfall figcaption strong")
    view.page.locator("#difference").check()
    assert view.soon(lambda: title.inner_text() == "Overall transmission error: on bearings against on ideal joints")
    view.page.locator("#difference").uncheck()
    view.page.locator("#bearings .choice:visible").first.click()
    assert view.soon(lambda: title.inner_text().startswith("Force: bearing"))
    assert "re 1 N" in view.page.locator("#waterfall-scale").inner_text()


def test_data_and_pictures_can_be_taken_away(view: View, data: dict[str, Any]) -> None:
    def taken(locator: Any) -> bytes:
        with view.page.expect_download() as got:
            locator.click()
        return Path(got.value.path()).read_bytes()

    tools = view.page.locator("#waterfall .tools button")
    rows = list(csv.reader(io.StringIO(taken(tools.filter(has_text="CSV")).decode("utf-8-sig"))))
    columns, lines = data["groups"][0]["variants"]["bushing"]["channels"][0]["cells"]["shape"]
    assert (len(rows), len(rows[0])) == (lines + 1, columns + 1)
    loudest = data["groups"][0]["variants"]["bushing"]["resonances"][0]["level"]
    # A cell holds the highest level in it: no lower than the loudest peak, to half a step.
    assert max(float(value) for row in rows[1:] for value in row[1:]) > loudest - 0.5
    assert taken(tools.filter(has_text="PNG"))[:4] == b"\x89PNG"
    ranking = taken(view.page.locator("#ranking .listed .of-table button:visible")).decode("utf-8-sig")
    assert next(csv.reader(io.StringIO(ranking)))[:3] == ["No.", "speed / rpm", "frequency / Hz"]
    assert json.loads(taken(view.page.locator("#save-data")))["name"] == NAME


def test_dark_colours_are_dark_and_kept(view: View, path: Path) -> None:
    def brightness() -> float:
        shade = view.page.evaluate("getComputedStyle(document.body).backgroundColor")
        return sum(map(float, re.findall(r"[\d.]+", shade)[:3])) / 3

    assert brightness() > 200
    view.page.locator("#theme").click()
    assert brightness() < 60
    view.open(path)
    assert brightness() < 60
    view.page.locator("#theme").click()


def luminance(colour: str) -> float:
    """Relative luminance (WCAG 2.2) of a colour like #0b5cad."""
    channels = [int(colour[start : start + 2], 16) / 255.0 for start in (1, 3, 5)]
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_words_stand_out_from_their_ground(view: View, theme: str) -> None:
    """Contrast of at least 4.5, what WCAG 2.2 asks for at level AA."""
    view.page.evaluate("t => document.documentElement.dataset.theme = t", theme)

    def colour(name: str) -> str:
        found = view.page.evaluate("n => getComputedStyle(document.documentElement).getPropertyValue(n).trim()", name)
        return str(found)

    pairs = [("ink", "panel"), ("ink", "ground"), ("soft", "panel"), ("soft", "ground"), ("accent", "panel")]
    pairs += [("ink", "good-soft"), ("ink", "mind-soft"), ("good", "good-soft"), ("mind", "mind-soft")]
    pairs += [
        ("accent", "accent-soft"),
        ("ink", "bad-soft"),
        ("panel", "accent"),
        ("bad", "panel"),
        ("bad", "bad-soft"),
    ]
    pairs += [(name, "panel") for name in ("error", "force", "acceleration", "good", "mind")]
    for words, ground in pairs:
        bright, dull = sorted((luminance(colour(f"--{name}")) for name in (words, ground)), reverse=True)
        assert (bright + 0.05) / (dull + 0.05) >= 4.5, (words, ground)


def test_everything_has_a_name_and_headings_follow_each_other(view: View) -> None:
    unnamed = """() => [...document.querySelectorAll('button,select,input,[role=img],[role=group]')].filter(e =>
        !(e.getAttribute('aria-label') || e.textContent.trim() || e.labels?.length || e.placeholder)).map(e => e.id)"""
    assert view.page.evaluate(unnamed) == []
    levels = view.page.evaluate("[...document.querySelectorAll('h1,h2,h3,h4')].map(e => +e.tagName[1])")
    assert levels[0] == 1
    assert all(after - before <= 1 for before, after in zip(levels, levels[1:], strict=False))
    names = view.page.evaluate("[...document.querySelectorAll('[id]')].map(element => element.id)")
    assert len(names) == len(set(names))


def test_paper_shows_the_answer_and_a_picture_of_the_mode(view: View) -> None:
    view.page.emulate_media(media="print")
    assert view.page.locator("#answer .mode-picture").is_visible()
    assert view.page.locator("#resonances").is_visible()
    assert not view.page.locator("nav").is_visible()
    assert view.page.pdf()[:4] == b"%PDF"
    view.page.emulate_media(media="screen")


def test_paper_has_all_line_figures_in_light_colours_and_the_page_gets_its_own_back(view: View) -> None:
    theme = "document.documentElement.dataset.theme"
    view.page.evaluate(f"{theme} = 'dark'")
    view.page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    lacking = (
        "[...document.querySelectorAll('[data-figure=chart]')]"
        ".filter(own => own.clientWidth && !own.querySelector('canvas')).length"
    )
    assert view.page.evaluate(theme) == "light"
    assert view.soon(lambda: view.page.evaluate(lacking) == 0)
    view.page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert view.page.evaluate(theme) == "dark"
    view.page.evaluate(f"{theme} = 'light'")


@pytest.mark.parametrize("size", SIZES)
def test_without_scripts_cards_and_tables_are_there(browser: Any, path: Path, data: dict[str, Any], size: str) -> None:
    view = opened(browser, size, java_script_enabled=False)
    view.page.goto(path.as_uri())
    assert view.page.locator("#answer .card:visible").count() == 4
    assert view.page.locator("#ranking .listed table:visible").count() == 2
    assert view.page.locator("noscript").count() or "scripts" in view.page.content()
    assert view.page.locator(".scripts-only:visible").count() == 0
    assert "Passed: " in view.page.locator("#model").text_content()
    view.page.context.close()
    assert view.errors == []
