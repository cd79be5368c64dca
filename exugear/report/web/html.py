"""Pieces of a web page: text, lists, tables, cards, sections. Whatever a file holds is escaped."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

_VOID = ("img", "input")
"""Elements without content."""
SHORT_TEXT, LONG_TEXT = 8, 40
"""Characters up to which a column of texts needs no width kept for it, and from which it needs much."""


def text(value: object) -> str:
    """Escape a text for the page; halves of characters, which no file can hold, become question marks."""
    return html.escape(str(value).encode("utf-8", "replace").decode("utf-8"))


def element(tag: str, content: str = "", **attributes: object) -> str:
    """Make an element of content that is HTML already; attributes are escaped.

    Parameters
    ----------
    content : HTML
    attributes
        By name, underscores for hyphens and one at the end to tell ``class_`` from the word of Python; True stands
        alone, None and False are left out.

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
    """Make a paragraph of plain text; the kind ``warning`` sets it off, ``note`` makes it small."""
    return element("p", text(value), class_=kind or None)


def bullets(values: Iterable[str]) -> str:
    """Make a list of plain texts."""
    return f"<ul>{''.join(f'<li>{text(value)}</li>' for value in values)}</ul>"


@dataclass(frozen=True)
class Cell:
    """A cell of a table that is more than a text."""

    shown: str
    """Its text."""
    order: float | None = None
    """What rows are sorted by; the text otherwise."""
    choice: str = ""
    """What clicking it chooses in the scripts of the page; empty for nothing."""
    tag: str = ""
    """Shown as a tag instead of plain text: ``good``, ``mind`` or ``plain``."""
    bar: float | None = None
    """Length of a bar beside the text, 0 to 1."""

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
    """Make a table of rows under the keys of the first.

    Parameters
    ----------
    rows : None makes no table
    texts : columns to align left; the first one always is
    caption : what the table shows, for those who have it read aloud
    name : identity in the page; its data can be taken away under this name
    hidden : columns that a phone leaves out
    sortable : whether its scripts may sort it
    choices : what clicking each row chooses in the scripts of the page

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
    # Whoever has no mouse scrolls a wide table by the arrow keys.
    return element("div", whole, class_="scroll", tabindex=0, role="region", aria_label=caption or f"Table: {keys[0]}")


def _text_kinds(rows: Sequence[Mapping[str, object]], key: str) -> list[str]:
    """Classes of a column of texts, by the longest of them."""
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
    """Make a red box that readers of the page cannot miss, also those who have it read aloud.

    Examples
    --------
    >>> alert("Not to be trusted", ["run <1>"])
    '<div class="alert" role="alert"><strong>Not to be trusted</strong><ul><li>run &lt;1&gt;</li></ul></div>'
    """
    return f'<div class="alert" role="alert"><strong>{text(title)}</strong>{bullets(values)}</div>'


def folded(title: str, content: str, opened: bool = False) -> str:
    """Hide content behind a title until it is clicked; paper shows it."""
    if content:
        return element("details", f"<summary>{text(title)}</summary>{content}", open=opened)
    return ""


def section(title: str, *content: str, level: int = 2, name: str = "") -> str:
    """Put content under a heading; nothing if there is none.

    Parameters
    ----------
    content : HTML
    level : of the heading
    name : identity in the page, which links lead to; the section is a landmark then
    """
    joined = "".join(content)
    if not joined:
        return ""
    heading = element(f"h{level}", text(title), id=f"{name}-heading" if name else None)
    if not name:
        return heading + joined
    return element("section", heading + joined, id=name, aria_labelledby=f"{name}-heading")


def picture(source: str, words: str, width: int) -> str:
    """Make a picture on white ground, as wide as given or as the window, whatever the colours of the page."""
    return element("div", element("img", src=source, alt=words, width=width), class_="panel picture")


def figure(name: str, title: str, hint: str, words: str, kind: str = "") -> str:
    """Make the frame of a figure that a script draws.

    Parameters
    ----------
    name : identity in the page
    title, hint : what it shows, and what can be done with it
    words : what it shows in words, for those who cannot see it, and where scripts are off
    kind : what draws it: a key of the scripts
    """
    caption = element("figcaption", f"<strong>{text(title)}</strong>" + element("span", text(hint), class_="hint"))
    drawn = element("div", "", class_="plot", tabindex=0, role="img", aria_label=f"{title}. {words}")
    said = element("p", text(words), class_="words")
    tools = element("div", "", class_="tools")
    return element("figure", caption + tools + drawn + said, id=name, class_="panel", data_figure=kind or None)
