"""How objects show themselves: a line of text, table and diagram in a notebook, ranges of values with their unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from string import Formatter
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from fe_ste.tools.drawing import inline_picture

TitledRows = tuple[str, Mapping[str, str]]
"""Title of a table, and name of each entry -> its value as text, with its unit."""


class _AttributeFormatter(Formatter):
    """Formats attributes of an object as strings format fields, and ``!n`` as the number of entries."""

    def __init__(self, owner: object) -> None:
        self.owner = owner

    def get_value(self, key: int | str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        return getattr(self.owner, str(key))

    def convert_field(self, value: Any, conversion: str | None) -> Any:
        if conversion:
            return {"n": len, "r": repr}[conversion](value)
        return value


class ReprMixin:
    """Mixin that displays an object as one line of text, and in a notebook as a small table and its diagram.

    A class states its line, or computes it in `_line`; one with a table gives its title and rows in `_table`. The
    diagram is that of a method `plot` without arguments. A result that cannot be drawn says so below its table.

    Parameters
    ----------
    line : str
        Text after the name of the class. Fields are attributes of the object, also dotted ones; ``!n`` is the number of
        their entries.

    Examples
    --------
    >>> class Shafts(ReprMixin, line=" of {gearbox!r}: {names!n} shafts, {mass:.1f} kg"):
    ...     gearbox, names, mass = "GRC <1>", ("low", "high"), 812.345
    >>> Shafts()
    <Shafts of 'GRC <1>': 2 shafts, 812.3 kg>
    >>> Shafts()._repr_html_()
    '<p>&lt;Shafts of &#x27;GRC &lt;1&gt;&#x27;: 2 shafts, 812.3 kg&gt;</p>'
    """

    _stated_line: ClassVar[str] = ""

    def __init_subclass__(cls, line: str | None = None) -> None:
        """Take the line that the class states."""
        super().__init_subclass__()
        if line is not None:
            cls._stated_line = line
        # A dataclass keeps what its own class has and replaces what it inherits.
        if "__repr__" not in vars(cls):
            type.__setattr__(cls, "__repr__", ReprMixin.__repr__)

    def __repr__(self) -> str:
        """Return one short line."""
        return f"<{type(self).__name__}{self._line()}>"

    def _repr_html_(self) -> str:
        title, rows = self._table()
        text = html_table(title, rows) if rows else f"<p>{_shown(repr(self))}</p>"
        plot = getattr(self, "plot", None)
        if plot is None:
            return text
        try:
            return f"{text}{inline_picture(plot().figure, type(self).__name__)}"
        except Exception as error:  # whatever a picture meets, the text is shown
            return f"{text}<p>{_shown(f'No diagram: {error}')}</p>"

    def _line(self) -> str:
        return _AttributeFormatter(self).format(self._stated_line)

    def _table(self) -> TitledRows:
        return "", {}


def html_table(title: str, rows: Mapping[str, str]) -> str:
    """Return a small HTML table; any text can be shown, none of it acts as HTML.

    Parameters
    ----------
    title : caption above the table
    rows : name of each entry -> its value as text, with its unit

    Returns
    -------
    one ``<table>`` without style, which takes that of the page

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


ROUND_OFF = 1e-9
"""Size, in the unit that is displayed, below which numbers are round-off of loads, lengths and shares."""
LONGEST_LIFE = 1e9
"""Largest rating life that is displayed as a number: longer ones say that nothing is loaded."""


def without_round_off(value: float) -> float:
    """Return 0 for a number that is displayed and below `ROUND_OFF`, otherwise the number.

    Examples
    --------
    >>> without_round_off(7e-13), without_round_off(-0.0), without_round_off(2e-3)
    (0.0, 0.0, 0.002)
    """
    if abs(value) < ROUND_OFF:
        return 0.0
    return value


def life_text(value: float) -> str:
    """Return a rating life in three digits, without exponent, at most `LONGEST_LIFE`.

    Examples
    --------
    >>> life_text(6417.3), life_text(0.21), life_text(1.42e57)
    ('6420', '0.21', '>1e9')
    """
    if value > LONGEST_LIFE:
        return ">1e9"
    text = f"{without_round_off(value):.3g}"
    return f"{float(text):.0f}" if "e+" in text else text


def torque_unit(largest: float) -> tuple[str, float]:
    """Return the unit in which torques up to a value (N m) are printed, and the factor from N m to it."""
    return ("kN m", 1e-3) if abs(largest) >= 1e4 else ("N m", 1.0)


def torque_text(torque: float) -> str:
    """Return a torque (N m) with its unit.

    Examples
    --------
    >>> torque_text(-72.5), torque_text(240e3)
    ('-72.5 N m', '240 kN m')
    """
    unit, factor = torque_unit(torque)
    return f"{factor * torque:.6g} {unit}"


def value_range(values: ArrayLike, unit: str, scale: float = 1.0) -> str:
    """Return the range of some values, minimum to maximum, as text, or the single value.

    Parameters
    ----------
    values : in any shape; NaN is omitted
    unit : unit that is shown
    scale : factor that converts the values to that unit

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
