"""Pieces of a web page that stands alone: headings, tables, embedded pictures."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path

_STYLE = files("exugear.report").joinpath("page.css").read_text(encoding="utf-8")


def text(value: object) -> str:
    """Escape a text for the page; halves of characters, which no file can hold, become question marks."""
    return html.escape(str(value).encode("utf-8", "replace").decode("utf-8"))


def paragraph(value: str, kind: str = "") -> str:
    """Make a paragraph of plain text; the kind ``warning`` sets it off."""
    return f'<p class="{kind}">{text(value)}</p>' if kind else f"<p>{text(value)}</p>"


def bullets(values: Iterable[str]) -> str:
    """Make a list of plain texts."""
    return f"<ul>{''.join(f'<li>{text(value)}</li>' for value in values)}</ul>"


def table(rows: Sequence[Mapping[str, object]], texts: Iterable[str] = ()) -> str:
    """Make a table of rows under the keys of the first.

    Parameters
    ----------
    rows : sequence of mapping
        None makes no table.
    texts : iterable of str
        Columns to align left; the first one always is.

    Examples
    --------
    >>> "<td>3</td>" in table([{"gear": "sun", "teeth": 3}])
    True
    """
    if not rows:
        return ""
    keys = list(rows[0])
    left = {keys[0], *texts}

    def cell(tag: str, key: str, value: object) -> str:
        side = ' class="text"' if key in left else ""
        return f"<{tag}{side}>{text(value)}</{tag}>"

    head = "".join(cell("th", key, key) for key in keys)
    body = "".join(f"<tr>{''.join(cell('td', key, row[key]) for key in keys)}</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def alert(title: str, values: Iterable[str]) -> str:
    """Make a red box that readers of the page cannot miss, also those who have it read aloud.

    Examples
    --------
    >>> alert("Not to be trusted", ["run <1>"])
    '<div class="alert" role="alert"><strong>Not to be trusted</strong><ul><li>run &lt;1&gt;</li></ul></div>'
    """
    return f'<div class="alert" role="alert"><strong>{text(title)}</strong>{bullets(values)}</div>'


def picture(path: Path, caption: str) -> str:
    """Embed a picture, PNG or GIF, with what it shows below."""
    kind = path.suffix.lower().removeprefix(".")
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return (
        f'<figure><img src="data:image/{kind};base64,{data}" alt="{text(caption)}">'
        f"<figcaption>{text(caption)}</figcaption></figure>"
    )


def folded(title: str, content: str) -> str:
    """Hide content behind a title until it is clicked."""
    return f"<details><summary>{text(title)}</summary>{content}</details>"


def section(title: str, *content: str, level: int = 2) -> str:
    """Put content under a heading; nothing if there is none."""
    joined = "".join(content)
    return f"<h{level}>{text(title)}</h{level}>{joined}" if joined else ""


def whole(title: str, *sections: str) -> str:
    """Make the page."""
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{text(title)}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>\n{_STYLE}</style></head>'
        f"<body><h1>{text(title)}</h1>{''.join(sections)}</body></html>"
    )
