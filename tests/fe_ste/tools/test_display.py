"""What objects show is one line, in a notebook text that does not act, and ranges have their unit."""

from __future__ import annotations

import ast
import sys
from base64 import b64decode
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from string import Formatter

import numpy as np
import pytest
from matplotlib.axes import Axes

from fe_ste.tools.display import ReprMixin, html_table, value_range
from fe_ste.tools.drawing import paper_axes

HOSTILE = ("<script>alert(1)</script>", "</td></table><b>", '" onload="x', "&lt;", "dollar $x$", "\x1b[31m", "Zähne")


class Page(HTMLParser):
    """Elements and text of a piece of HTML."""

    def __init__(self) -> None:
        super().__init__()
        self.elements: list[str] = []
        self.texts: list[str] = []

    def handle_starttag(self, tag, attrs):
        assert attrs == []
        self.elements.append(tag)

    def handle_data(self, data):
        self.texts.append(data)


@pytest.mark.parametrize("text", HOSTILE)
def test_any_text_is_shown_and_none_acts(text):
    page = Page()
    page.feed(html_table(text, {text: text}))
    assert page.elements == ["table", "caption", "tr", "th", "td"]
    assert page.texts == [text, text, text]


def test_half_a_character_can_be_stored_in_a_notebook():
    assert "a?b" in html_table("a\ud800b", {}).encode("utf-8").decode("utf-8")


def test_rows_keep_their_order():
    page = Page()
    page.feed(html_table("title", {"b": "1", "a": "2"}))
    assert page.texts == ["title", "b", "1", "a", "2"]


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        ([[3.0, 1.0], [2.0, 2.0]], "1000 to 3000 mm"),
        (0.5, "500 mm"),
        ([0.5, 0.5], "500 mm"),
        ([np.nan, 0.5], "500 mm"),
        ([], "no value"),
        ([np.nan], "no value"),
    ],
)
def test_a_range_is_told_by_its_ends(values, shown):
    assert value_range(values, "mm", 1e3) == shown


@dataclass(frozen=True)
class Shaft(ReprMixin, line=" {name!r}: {seats!n} seats, {mass:.3g} kg, {seats[0].real} first"):
    name: str
    mass: float
    seats: tuple[int, ...]


class Hollow(Shaft):
    def _table(self):
        return f"shaft {self.name}", {"mass": value_range(self.mass, "kg")}


def test_a_dataclass_shows_its_stated_line_under_the_name_of_its_own_class():
    assert repr(Shaft("low", 12.3456, (7, 8))) == "<Shaft 'low': 2 seats, 12.3 kg, 7 first>"
    assert repr(Hollow("low", 12.3456, (7, 8))).startswith("<Hollow 'low': 2 seats")


def test_braces_in_a_name_are_no_fields():
    assert repr(Shaft("{mass}{0}", 1.0, (7,))).startswith("<Shaft '{mass}{0}': 1 seats")


def test_what_has_no_table_shows_its_line_in_a_notebook_and_what_has_one_its_table():
    page = Page()
    page.feed(Shaft(HOSTILE[0], 1.0, (7,))._repr_html_())
    assert page.elements == ["p"]
    assert page.texts == [repr(Shaft(HOSTILE[0], 1.0, (7,)))]
    page = Page()
    page.feed(Hollow(HOSTILE[0], 1.0, (7,))._repr_html_())
    assert page.texts == [f"shaft {HOSTILE[0]}", "mass", "1 kg"]


def stated_lines():
    """Class -> its stated line, and the names of its attributes."""
    root = Path(__file__).parents[3]
    for file in (file for package in ("fe_ste", "exugear") for file in (root / package).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            for keyword in node.keywords if isinstance(node, ast.ClassDef) else ():
                if keyword.arg == "line":
                    members = {item.target.id for item in node.body if isinstance(item, ast.AnnAssign)}
                    members |= {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
                    members |= {item.attr for item in ast.walk(node) if isinstance(item, ast.Attribute)}
                    yield node.name, ast.literal_eval(keyword.value), members


@pytest.mark.validation
def test_stated_lines_name_attributes_that_their_classes_have():
    lines = list(stated_lines())
    assert len(lines) > 30
    for name, line, members in lines:
        fields = [field for _, field, _, _ in Formatter().parse(line) if field is not None]
        assert fields and {field.partition(".")[0].partition("[")[0] for field in fields} <= members, name


class Drawn(ReprMixin, line=" {name}"):
    name = "<b>"

    def plot(self) -> Axes:
        ax = paper_axes()
        ax.set_title("$not math \x1b")
        return ax


class Undrawable(Drawn):
    def plot(self) -> Axes:
        raise KeyError("<i>no run</i>")


def test_a_notebook_shows_the_diagram_of_a_result_inside_of_its_page(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)  # whose backend somebody may have set
    text, picture = Drawn()._repr_html_().split("<img ")
    assert text == "<p>&lt;Drawn &lt;b&gt;&gt;</p>"
    content = b64decode(picture.split("base64,")[1].removesuffix('">'))
    assert content.startswith(b"\x89PNG")
    assert len(content) < 50_000


def test_a_result_that_cannot_be_drawn_keeps_its_text_and_says_why():
    assert Undrawable()._repr_html_() == (
        "<p>&lt;Undrawable &lt;b&gt;&gt;</p><p>No diagram: &#x27;&lt;i&gt;no run&lt;/i&gt;&#x27;</p>"
    )


def test_a_line_of_text_draws_nothing(monkeypatch):
    monkeypatch.setattr(Drawn, "plot", Undrawable.plot)
    assert repr(Drawn()) == "<Drawn <b>>"
