"""What objects show in a notebook is text, whatever its source, and ranges have their unit."""

from __future__ import annotations

from html.parser import HTMLParser

import numpy as np
import pytest

from fe_ste.tools.notebook import html_table, value_range

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
