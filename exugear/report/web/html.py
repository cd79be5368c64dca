"""HTML of pages: Jinja2 templates, which escape all content of files, and the tables that they show."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

SHORT_TEXT, LONG_TEXT = 8, 40
"""Longest text (characters) of a column without reserved width, and shortest text of one with a large width."""


@cache
def _environment() -> Environment:
    return Environment(
        autoescape=True,
        loader=PackageLoader("exugear.report.web"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )


def render(template: str, **data: object) -> Markup:
    """Return the HTML of a template, such as ``gears``, with data; text in the data is escaped, `Markup` is not."""
    return Markup(_environment().get_template(f"{template}.html").render(data))


@dataclass(frozen=True)
class Cell:
    """Table cell with more properties than its text."""

    shown: str
    value: float | None = None
    """Number in the unit of the heading, for sorting and for CSV files; NaN where there is none. By default the text
    is used."""
    choice: str = ""
    """Selection made in the scripts of the page by clicking the cell; empty for none."""
    tag: str = ""
    """Shown as a tag instead of plain text: ``good``, ``mind``, ``plain`` or ``rank``."""
    bar: float | None = None
    """Length of a bar next to the text, 0 to 1."""
    kind: str = ""
    """CSS class of the bar: its quantity."""
    caveat: str = ""
    """What weakens the number; a sign next to it says so."""

    @property
    def order(self) -> str | None:
        """Number as text with nine digits; empty for NaN, None without a number."""
        if self.value is None:
            return None
        if math.isnan(self.value):
            return ""
        return f"{self.value:.9g}"


@dataclass(frozen=True)
class Table:
    """Table of rows with the keys of the first row as headings.

    Examples
    --------
    >>> "<td>3</td>" in render("table", table=Table([{"gear": "sun", "teeth": 3}]))
    True
    """

    rows: Sequence[Mapping[str, object]]
    """A table without rows is not shown."""
    texts: Sequence[str] = ()
    """Left-aligned columns; the first one always is."""
    caption: str = ""
    """Content of the table, for screen readers and the name of its CSV file."""
    name: str = ""
    """Identifier in the page; its data can be exported under this name."""
    hidden: Sequence[str] = ()
    """Columns that narrow screens omit."""
    sortable: bool = False
    """Whether the scripts may sort it."""
    choices: Sequence[str] = ()
    """Selection made in the scripts of the page by clicking each row."""
    stacked: bool = False
    """Whether narrow screens show each row as a card."""
    kinds: Sequence[str] = ()
    """CSS class of each row, such as ``further`` for rows behind a control."""

    @cached_property
    def columns(self) -> dict[str, str]:
        """CSS classes by heading."""
        return {
            key: " ".join(self._text_kinds(key) + ["wide"] * (key in self.hidden))
            for key in (self.rows[0] if self.rows else ())
        }

    def _text_kinds(self, key: str) -> list[str]:
        """Return the classes of a text column, by its longest entry."""
        if key not in (*self.texts, next(iter(self.rows[0]))):
            return []
        longest = max(len(_cell(row[key]).shown) for row in self.rows)
        return ["text"] + ["brief"] * (longest <= SHORT_TEXT) + ["told"] * (longest > LONG_TEXT)

    def cells(self, row: Mapping[str, object]) -> Iterator[tuple[str, Cell, str]]:
        """Yield heading, cell and CSS classes of each column of a row."""
        return ((key, _cell(row[key]), kind) for key, kind in self.columns.items())


def _cell(value: object) -> Cell:
    return value if isinstance(value, Cell) else Cell(str(value))


@dataclass(frozen=True)
class Figure:
    """Frame of a diagram that a script draws."""

    name: str
    """Identifier in the page."""
    title: str
    hint: str
    """Note on the use of the diagram."""
    words: str
    """Content as text, for screen readers and pages without scripts."""
    kind: str = ""
    """Key of the script that draws it."""
