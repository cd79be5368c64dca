"""How objects show themselves in a notebook: small HTML tables, ranges of values with their unit."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

import numpy as np
from numpy.typing import ArrayLike


def html_table(title: str, rows: Mapping[str, str]) -> str:
    """Return a small HTML table for a method ``_repr_html_``; any text can be shown, none of it acts as HTML.

    Parameters
    ----------
    title : str
        Stands above the table.
    rows : mapping of str to str
        What is told -> its value as text, with its unit.

    Returns
    -------
    str
        One ``<table>`` without style, which takes that of the page.

    Examples
    --------
    >>> html_table("gear <1>", {"teeth": "30"})
    '<table><caption>gear &lt;1&gt;</caption><tr><th>teeth</th><td>30</td></tr></table>'
    """
    cells = (f"<tr><th>{_shown(name)}</th><td>{_shown(value)}</td></tr>" for name, value in rows.items())
    return f"<table><caption>{_shown(title)}</caption>{''.join(cells)}</table>"


def _shown(text: str) -> str:
    """Escape a text; halves of characters, which no page can hold, become question marks."""
    return escape(text.encode("utf-8", "replace").decode("utf-8"))


def value_range(values: ArrayLike, unit: str, scale: float = 1.0) -> str:
    """Return the least and the greatest of some values as text, or the one value.

    Parameters
    ----------
    values : array_like
        In any shape; those that are not a number are left out.
    unit : str
        Unit that is shown.
    scale : float
        What the values are multiplied by to have that unit.

    Examples
    --------
    >>> value_range([0.09, 0.0905], "mm", 1e3), value_range(200.0, "N m")
    ('90 to 90.5 mm', '200 N m')
    """
    numbers = scale * np.asarray(values, dtype=np.float64).ravel()
    numbers = numbers[~np.isnan(numbers)]
    if not numbers.size:
        return "no value"
    ends = [f"{number:.6g}" for number in (numbers.min(), numbers.max())]
    return f"{' to '.join(dict.fromkeys(ends))} {unit}"
