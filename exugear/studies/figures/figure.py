"""A figure: a number of a point, or some by name, with unit, and the options that say which."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from exugear.studies.figures.point_results import PointResults

Values = float | Mapping[str, float]
"""One number, or several by name along the figure's dimension."""
Needs = Literal["", "run", "steady", "life", "bearings"]
"""What a figure is read from, where it is more than modes, tables and the static state: a run, a steady response, a
life, or bearings in that life."""


class FigureError(ValueError):
    """A figure that is not known, or options that it has not got."""


@dataclass(frozen=True)
class Figure:
    """What is kept of a point."""

    function: Callable[..., Values]
    """Takes `PointResults` and options by keyword; a function of a module, since workers look it up there. Each
    option is a keyword-only parameter; its annotation names its type, its default makes it optional."""
    units: str
    dimension: str = ""
    """Name of the dimension of several numbers; empty for one."""
    needs: Needs = ""
    """{"", "run", "steady", "life", "bearings"}: what it is read from, where that is more than modes, tables and the
    static state."""

    @property
    def description(self) -> str:
        """What it is, in a line."""
        return (inspect.getdoc(self.function) or "").split("\n")[0]

    def of(self, results: PointResults, options: Mapping[str, Any]) -> Values:
        """Compute it for a point."""
        return self.function(results, **options)

    def check(self, name: str, options: Mapping[str, Any]) -> None:
        """Refuse options that it has not got, are of another type, or are missing."""
        known = {
            key: parameter
            for key, parameter in inspect.signature(self.function).parameters.items()
            if parameter.kind is inspect.Parameter.KEYWORD_ONLY
        }
        for key, value in options.items():
            if key not in known:
                near = difflib.get_close_matches(key[:100], known, n=1)
                hint = f"did you mean {near[0]!r}?" if near else f"its options are {', '.join(known) or 'none'}"
                raise FigureError(f"figures.{name}.{key}: no such option; {hint}")
            if not _fits(value, str(known[key].annotation)):
                raise FigureError(f"figures.{name}.{key} = {value!r}: must be {_WORDS[str(known[key].annotation)]}")
        for key, parameter in known.items():
            if parameter.default is inspect.Parameter.empty and key not in options:
                raise FigureError(f"figures.{name}.{key}: this option is missing")


_WORDS = {
    "float": "a number",
    "int": "a whole number",
    "str": "text in quotes",
    "bool": "true or false",
    "Sequence[float]": "an array of numbers",
}
_TYPES: dict[str, tuple[type, ...]] = {"float": (int, float), "int": (int,), "str": (str,), "bool": (bool,)}


def _fits(value: object, kind: str) -> bool:
    """Whether a value is of the type that an annotation names."""
    if kind == "Sequence[float]":
        return isinstance(value, list) and bool(value) and all(_fits(entry, "float") for entry in value)
    return isinstance(value, _TYPES[kind]) and (kind == "bool" or not isinstance(value, bool))
