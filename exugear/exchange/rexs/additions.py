"""Attributes that are inserted into an existing REXS file without changing its other bytes."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from exugear.exchange.rexs.tree import RexsError, degree_sign

OWN = "custom_exugear_"
"""Prefix of attributes for which REXS has no name; other programs ignore them."""
JSON_KINDS: Mapping[type, str] = {str: "string", float: "floating_point", tuple: "floating_point_array"}
"""JSON key of a value by its type."""

AdditionValue = str | float | tuple[float, ...]


@dataclass(frozen=True)
class Addition:
    """An attribute that is added to a component."""

    component: int
    name: str
    """Name in the version of the file."""
    unit: str
    value: AdditionValue
    """Value of type str, float or tuple of float."""
    load_case: int | None = None
    """Load case of the value; None for the component itself."""


Edit = tuple[int, int, str]
"""Start and end of a section of text, and the text that replaces it."""


def edited(text: str, edits: Iterable[Edit]) -> str:
    """Text after some edits, which must not overlap; edits at one position are applied in the given order.

    Examples
    --------
    >>> edited("abcd", [(3, 3, "-"), (0, 1, "A"), (3, 3, "+")])
    'Abc-+d'
    """
    pieces = []
    place = 0
    for start, end, new in sorted(edits, key=lambda edit: edit[:2]):
        pieces += [text[place:start], new]
        place = end
    return "".join([*pieces, text[place:]])


def group_by_place(additions: Iterable[Addition]) -> dict[tuple[int | None, int], dict[str, Addition]]:
    """Additions by load case and component, then by name.

    Raises
    ------
    RexsError
        Two additions have the same name and position.
    """
    gathered: dict[tuple[int | None, int], dict[str, Addition]] = {}
    for addition in additions:
        names = gathered.setdefault((addition.load_case, addition.component), {})
        if addition.name in names:
            raise RexsError(f"component {addition.component}: two results have the name {addition.name}")
        names[addition.name] = addition
    return gathered


def number(value: float) -> str:
    """Format a number for a file: ten digits, always with a point or an exponent.

    Examples
    --------
    >>> number(2.0), number(-0.0), number(1e20), number(1.0 / 3.0)
    ('2.0', '0.0', '1e+20', '0.3333333333')
    """
    return repr(float(f"{value:.10g}") + 0.0)


def unit_in(unit: str, version: tuple[int, int]) -> str:
    """Return a unit in the notation of a REXS version.

    Examples
    --------
    >>> unit_in("deg", (1, 1)), unit_in("deg", (1, 4)), unit_in("MPa", (1, 7))
    ('°', 'deg', 'N / mm^2')
    """
    if unit == "deg":
        return degree_sign(version)
    if unit == "MPa" and version < (2, 0):
        return "N / mm^2"
    return unit


def json_entry(addition: Addition) -> str:
    """Attribute in JSON notation."""
    value = addition.value
    kind = JSON_KINDS[type(value)]
    if isinstance(value, tuple):
        shown = f"[{', '.join(map(number, value))}]"
    else:
        shown = json.dumps(value) if isinstance(value, str) else number(value)
    return f'{{"id": {json.dumps(addition.name)}, "unit": {json.dumps(addition.unit)}, "{kind}": {shown}}}'
