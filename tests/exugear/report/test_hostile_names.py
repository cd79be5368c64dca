"""Names and paths of a stranger: pages, pictures and the terminal show them as they are, and obey none of them."""

from __future__ import annotations

import base64
import hashlib
import io
import json
import os
import re
import subprocess
import sys
import unicodedata
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from rich.console import Console

from exugear.cli import console, tables
from exugear.report.pictures.diagrams import plot_campbell
from exugear.report.pictures.scene import mode_figure
from exugear.report.web.html import Cell, Figure, Table, render
from exugear.results.spectra.waterfall import OrderLine
from fe_ste.tools.drawing import RenderingError

from ..cases.command import exugear
from ..cases.spur import SPUR_CASE

MARKUP = "[/] [bold]:warning:"
HTML = """@DATA@<img src=x onerror=alert(1)></script><!--<script>'"&"""
FORMULA = r"$\frac{$ x_1^"
STEERING = "\x1b[31mred\x1b[2J\x07\x9b1m\r\u202egnp.\u2028\u2066"
NAME = f"{MARKUP} {HTML} {FORMULA} {STEERING}"
TITLE = f"{MARKUP} {HTML} {FORMULA} \x9b1m\u202egnp.\u2028\u2066"
"""What a gearbox file may be named: other control characters are refused."""


class Page(HTMLParser):
    """Elements of a page with their attributes, and its text by the element that it stands in."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, str] = {}
        self.inside = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))
        self.inside = dict(attributes).get("id") or tag

    def handle_endtag(self, tag: str) -> None:
        self.inside = ""

    def handle_data(self, text: str) -> None:
        self.texts[self.inside] = self.texts.get(self.inside, "") + text

    @property
    def active(self) -> list[str]:
        """What could run or load something: handlers, and addresses that are no data of the page itself."""
        found = [f"{tag} {key}" for tag, attributes in self.elements for key in attributes if key.startswith("on")]
        for tag, attributes in self.elements:
            for key in ("src", "href"):
                if not (attributes.get(key) or "data:").startswith(("data:", "#")):
                    found.append(f"{tag} {key}={attributes[key]}")
        return found


def tame(text: str) -> bool:
    """Tell whether a terminal shows all of a text and obeys nothing of it but ends of lines."""
    return not any(letter != "\n" and unicodedata.category(letter) in ("Cc", "Cs", "Zl", "Zp") for letter in text) and (
        not re.search("[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]", text)
    )


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Any]]:
    """Results folder with a name of its own of a gearbox with a hostile one, and how each verb ended."""
    folder = tmp_path_factory.mktemp("stranger") / "["  # so that paths hold [/]
    folder.mkdir()
    case, out = folder / "].toml", folder / "] :skull: \x1b[1m"
    text = SPUR_CASE.replace('"one spur pair"', json.dumps(TITLE)) + "\n[report]\nreference_frequency_Hz = 3000.0\n"
    case.write_text(text, encoding="utf-8")
    choices = ("--variant", "bushing", "--mesh-model", "iso6336", "--out", out)
    with pytest.MonkeyPatch.context() as patch:

        def unable(*arguments: Any, **options: Any) -> None:
            raise RenderingError(f"no picture {MARKUP}")

        patch.setattr("exugear.cli.tasks.view.draw_gearbox", unable)
        ended = [
            exugear("check", case),
            exugear("check", case, "--json"),
            exugear("modes", case, *choices),
            exugear("modes", case, *choices, "--json"),
            exugear("run", case, *choices, "--duration", 0.05),
            exugear("view", case, *choices),
            exugear("report", out),
        ]
    return out, ended


@pytest.mark.validation
def test_every_verb_ends_well_and_prints_names_and_paths_as_they_are(results: tuple[Path, list[Any]]) -> None:
    out, ended = results
    for outcome in ended:
        assert outcome.exit_code == 0, outcome.stderr
        assert tame(outcome.stdout + outcome.stderr)
    checked, _, modes, _, run, view, report = (outcome.stdout + outcome.stderr for outcome in ended)
    title = f"{MARKUP} {HTML} {FORMULA} " + r"\x9b1m\u202egnp.\u2028\u2066: no errors"
    assert "".join(title.split()) in "".join(checked.split())
    for printed in (modes, run, view, report):
        assert r"[/] :skull: \x1b[1m/" in printed
    assert f"no pictures: no picture {MARKUP}" in view


def test_json_is_ascii_and_holds_names_as_they_are(results: tuple[Path, list[Any]]) -> None:
    out, ended = results
    for outcome in (ended[1], ended[3]):
        assert outcome.stdout.isascii()
        assert tame(outcome.stdout)
    assert json.loads(ended[1].stdout)["name"] == TITLE
    assert json.loads(ended[3].stdout)["file"].startswith(str(out))


@pytest.mark.parametrize("name", ["modes.html", "report.html"])
def test_no_name_breaks_out_of_a_page(results: tuple[Path, list[Any]], name: str) -> None:
    out, _ = results
    (path,) = out.rglob(name)
    text = path.read_text(encoding="utf-8")
    found = Page(text)
    assert found.active == []
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", text, re.DOTALL)
    assert text.count("</script") == len(scripts)
    # What may run is named by its hash, and no name stands in it.
    running = [script for script in scripts if not script.startswith("{") and len(script.split()) > 1]
    policy = next(attributes["content"] for tag, attributes in found.elements if "http-equiv" in attributes)
    for script in running:
        digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
        assert f"'sha256-{digest}'" in str(policy)
        assert "onerror=alert" not in script
    for place in ("title", "h1"):
        # The parser takes every end of a line as one of its own.
        assert found.texts[place].startswith(TITLE)
    data = json.loads(found.texts["data"])
    assert data["name"].startswith(TITLE)
    assert not re.search("[<>&]", found.texts["data"])


EMPTY_LIST: dict[str, Any] = {"listed": [], "animated": False, "modes": [], "responses": [], "measured": []}
NO_GEARS = {"errors": Table([]), "gears": Table([])}


def test_pieces_of_a_page_escape_whatever_a_file_holds() -> None:
    table = Table(
        [{HTML: Cell(HTML, choice=HTML, tag="good")}, {HTML: HTML}], caption=HTML, name=HTML, choices=[HTML] * 2
    )
    waterfall = Figure("waterfall", HTML, HTML, HTML)
    pair = {"title": HTML, "maps": [], "words": HTML, "data_sheet": table}
    measured = dict.fromkeys(("title", "verdict", "window"), HTML)
    measured |= {"warnings": [HTML], "charts": [waterfall], "peaks": Table([])}
    drawn = {"words": HTML, "waterfall": waterfall, "cuts": waterfall, "measured": [measured]}
    pieces = [
        render("table", table=table),
        render("resonances", **EMPTY_LIST | drawn),
        render("mode_page", heading=HTML, modes=table, operation=table, about_resonances=HTML),
        render("gears", **NO_GEARS | {"contacts": table, "scope": HTML, "pairs": [pair]}),
    ]
    found = Page("".join(pieces))
    assert not [own for own in found.active if "onerror" in own.split("=")[0]]
    assert not [tag for tag, _ in found.elements if tag == "script"]
    assert found.texts["h1"] == HTML and found.texts["h4"] == HTML
    assert found.texts["td"] == 5 * HTML


def test_pictures_take_any_name_and_a_formula_in_it_as_text(tmp_path: Path) -> None:
    # Warnings are errors here: one of matplotlib's about a control character holds that very character.
    title = f"{FORMULA} {STEERING} \x00\udcff"
    line, path = OrderLine(FORMULA, 20.0), tmp_path / "modes.png"
    figure = plot_campbell([200.0], [line], 10.0, path, names=[FORMULA], title=title)
    assert matplotlib.image.imread(tmp_path / "modes.png").size
    assert figure.axes[0].get_title(loc="left").startswith(FORMULA)
    picture = mode_figure(np.zeros((40, 60, 3), dtype=np.uint8), 1e-3, title)
    picture.savefig(tmp_path / "mode.png")
    assert matplotlib.image.imread(tmp_path / "mode.png").size


def printed(line: Any, monkeypatch: pytest.MonkeyPatch, width: int = 80) -> str:
    """What a terminal is sent by a function of the console."""
    shown = io.StringIO()
    for name in ("results", "messages"):
        monkeypatch.setattr(console, name, Console(file=shown, force_terminal=True, color_system=None, width=width))
    monkeypatch.setattr(tables, "results", console.results)
    line()
    return shown.getvalue()


def test_tables_and_bars_show_text_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [{"pair": f"{MARKUP} {STEERING}", "what": "[/]"}]
    columns = (tables.Column("pair", "pair"), tables.Column("what", "what", is_text=True))
    shown = printed(lambda: tables.print_table(tables.Table(MARKUP, rows, columns)), monkeypatch, 200)
    assert shown.count(MARKUP) == 2
    assert tame(shown)

    def bar() -> None:
        with console.progress_bar() as progress:
            progress.add_task(f"{MARKUP} {STEERING}", total=None)

    shown = printed(bar, monkeypatch, 200)
    assert MARKUP in shown
    assert "\x1b[31m" not in shown
    assert "\x07" not in shown


def test_a_long_line_of_a_message_keeps_its_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    message = f"case.toml: name = {10**6 * 'x'}: must be shorter\n" + "second line"
    first, second = printed(lambda: console.note(message), monkeypatch).splitlines()
    assert len(first) <= console.LONGEST_LINE
    assert first.startswith("case.toml: name = xxx")
    assert first.endswith("xxx: must be shorter")
    assert second == "second line"


def test_a_long_value_in_a_case_is_one_short_line(tmp_path: Path) -> None:
    case = tmp_path / "case.toml"
    case.write_text(SPUR_CASE.replace("one spur pair", 10**6 * "x"), encoding="utf-8")
    outcome = exugear("check", case)
    assert outcome.exit_code == 2
    assert len(outcome.stderr.splitlines()) == 1
    assert len(outcome.stderr) <= console.LONGEST_LINE + 1
    assert f"Bad input: {case}: name = 'xxx" in outcome.stderr
    assert "at most 200 characters" in outcome.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="no such names of files")
def test_a_path_that_is_no_text_is_printed(tmp_path: Path) -> None:
    case = os.fsencode(tmp_path) + b"/\xff[]\x1b.toml"
    command = [sys.executable, "-c", "from exugear.cli.app import main; main()", "check", case]
    found = subprocess.run(command, capture_output=True, timeout=60)
    assert found.returncode == 2
    assert rb"\udcff[]\x1b.toml: no such file" in found.stderr
