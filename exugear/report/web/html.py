"""Elements of a web page: text, lists, tables, cards, sections. All content of files is escaped."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

_VOID = ("img", "input")
"""Elements without content."""
SHORT_TEXT, LONG_TEXT = 8, 40
"""Longest text (characters) of a column without reserved width, and shortest text of one with a large width."""


def text(value: object) -> str:
    """Escape a text for the page; lone surrogates, which no file can contain, become question marks."""
    return html.escape(str(value).encode("utf-8", "replace").decode("utf-8"))


def element(tag: str, content: str = "", **attributes: object) -> str:
    """Return an element with content that is already HTML; attributes are escaped.

    Parameters
    ----------
    content : HTML
    attributes
        By name, with underscores for hyphens and a trailing one for keywords such as ``class_``. True yields an
        attribute without value; None and False omit it.

    Examples
    --------
    >>> element("p", text("1 < 2"), class_="note", hidden=True)
    '<p class="note" hidden>1 &lt; 2</p>'
    """
    written = [
        f" {name.rstrip('_').replace('_', '-')}" + ("" if value is True else f'="{text(value)}"')
        for name, value in attributes.items()
        if value is not None and value is not False
    ]
    opening = f"<{tag}{''.join(written)}>"
    if tag in _VOID:
        return opening
    return f"{opening}{content}</{tag}>"


def paragraph(value: str, kind: str = "") -> str:
    """Return a paragraph of plain text; the kind ``warning`` highlights it, ``note`` makes it small."""
    return element("p", text(value), class_=kind or None)


def bullets(values: Iterable[str]) -> str:
    """Return a bulleted list of plain texts."""
    return f"<ul>{''.join(f'<li>{text(value)}</li>' for value in values)}</ul>"


@dataclass(frozen=True)
class Cell:
    """Table cell with more properties than its text."""

    shown: str
    """Its text."""
    order: float | None = None
    """Sort key of the row; by default the text."""
    choice: str = ""
    """Selection made in the scripts of the page by clicking the cell; empty for none."""
    tag: str = ""
    """Shown as a tag instead of plain text: ``good``, ``mind`` or ``plain``."""
    bar: float | None = None
    """Length of a bar next to the text, 0 to 1."""

    def __str__(self) -> str:
        """Text of the cell."""
        return self.shown


def table(
    rows: Sequence[Mapping[str, object]],
    texts: Iterable[str] = (),
    *,
    caption: str = "",
    name: str = "",
    hidden: Iterable[str] = (),
    sortable: bool = False,
    choices: Sequence[str] = (),
) -> str:
    """Return a table of rows with the keys of the first row as headings.

    Parameters
    ----------
    rows : an empty sequence yields no table
    texts : left-aligned columns; the first one always is
    caption : content of the table, for screen readers
    name : identifier in the page; its data can be exported under this name
    hidden : columns that narrow screens omit
    sortable : whether the scripts may sort it
    choices : selection made in the scripts of the page by clicking each row

    Examples
    --------
    >>> "<td>3</td>" in table([{"gear": "sun", "teeth": 3}])
    True
    """
    if not rows:
        return ""
    keys = list(rows[0])
    left = {keys[0], *texts}
    small = set(hidden)

    kinds = {key: " ".join(_text_kinds(rows, key) * (key in left) + ["wide"] * (key in small)) or None for key in keys}
    head = "".join(element("th", text(key), class_=kinds[key], scope="col") for key in keys)
    chosen = [*choices, *[None] * (len(rows) - len(choices))]
    body = "".join(
        element("tr", "".join(_cell(row[key], kinds[key]) for key in keys), data_choice=choice)
        for row, choice in zip(rows, chosen, strict=True)
    )
    said = element("caption", text(caption), class_="unseen") if caption else ""
    own = f"{said}<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    whole = element("table", own, id=name or None, data_title=caption if name else None, data_sortable=sortable)
    # A focusable region can be scrolled by the arrow keys.
    return element("div", whole, class_="scroll", tabindex=0, role="region", aria_label=caption or f"Table: {keys[0]}")


def _text_kinds(rows: Sequence[Mapping[str, object]], key: str) -> list[str]:
    """Return the classes of a text column, by its longest entry."""
    shown = (row[key] for row in rows)
    longest = max(len(value.shown if isinstance(value, Cell) else str(value)) for value in shown)
    return ["text"] + ["brief"] * (longest <= SHORT_TEXT) + ["told"] * (longest > LONG_TEXT)


def _cell(value: object, kind: str | None) -> str:
    if not isinstance(value, Cell):
        return element("td", text(value), class_=kind)
    shown = element("span", text(value.shown), class_=f"tag {value.tag}") if value.tag else text(value.shown)
    if value.choice:
        shown = element("button", shown, type="button", class_="choice", data_choice=value.choice)
    if value.bar is not None:
        length = f"{100.0 * min(max(value.bar, 0.0), 1.0):.1f}"
        drawn = element("rect", width=length, height=8, rx=4)
        shown += element(
            "svg", drawn, class_="bar", viewBox="0 0 100 8", preserveAspectRatio="none", aria_hidden="true"
        )
    return element("td", shown, class_=kind, data_order=value.order)


def alert(title: str, values: Iterable[str]) -> str:
    """Return a red box with an alert role, so that screen readers announce it.

    Examples
    --------
    >>> alert("Not to be trusted", ["run <1>"])
    '<div class="alert" role="alert"><strong>Not to be trusted</strong><ul><li>run &lt;1&gt;</li></ul></div>'
    """
    return f'<div class="alert" role="alert"><strong>{text(title)}</strong>{bullets(values)}</div>'


def folded(title: str, content: str, opened: bool = False) -> str:
    """Return content that is hidden behind a title until it is clicked; print shows it."""
    if content:
        return element("details", f"<summary>{text(title)}</summary>{content}", open=opened)
    return ""


def section(title: str, *content: str, level: int = 2, name: str = "") -> str:
    """Return content under a heading; empty without content.

    Parameters
    ----------
    content : HTML
    level : of the heading
    name : identifier in the page and target of links; makes the section a landmark
    """
    joined = "".join(content)
    if not joined:
        return ""
    heading = element(f"h{level}", text(title), id=f"{name}-heading" if name else None)
    if not name:
        return heading + joined
    return element("section", heading + joined, id=name, aria_labelledby=f"{name}-heading")


def picture(source: str, words: str, width: int) -> str:
    """Return a picture on white ground, of given width or at most that of the window, for all colour themes."""
    return element("div", element("img", src=source, alt=words, width=width), class_="panel picture")


def figure(name: str, title: str, hint: str, words: str, kind: str = "") -> str:
    """Return the frame of a diagram that a script draws.

    Parameters
    ----------
    name : identifier in the page
    title, hint : heading, and a note on the use of the diagram
    words : content as text, for screen readers and pages without scripts
    kind : key of the script that draws it
    """
    caption = element("figcaption", f"<strong>{text(title)}</strong>" + element("span", text(hint), class_="hint"))
    drawn = element("div", "", class_="plot", tabindex=0, role="img", aria_label=f"{title}. {words}")
    said = element("p", text(words), class_="words")
    tools = element("div", "", class_="tools")
    return element("figure", caption + tools + drawn + said, id=name, class_="panel", data_figure=kind or None)
