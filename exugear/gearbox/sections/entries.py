"""What all sections of a gearbox file share: names, texts, tables of named entries; unknown keys are refused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from exugear.gearbox.sections import quantities as q
from fe_ste.tools.display import html_table

GROUND = "ground"
"""Name of what stands still, where a body could be named."""
MOST_ENTRIES = 500
"""Most entries of a table such as [bearings]."""
MOST_PLANETS = 40
"""Most planets of a set."""
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=80)]
"""Name of a part; results folders and files are named by them, by up to three in one name."""
Text = Annotated[str, Field(pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$", max_length=2000)]
"""Words for people: no control characters but tabs and line ends."""
FileName = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=1000)]
"""Path of a file, relative to the folder of the gearbox file."""
Entry = TypeVar("Entry")
Entries = Annotated[dict[Name, Entry], Field(max_length=MOST_ENTRIES)]
"""Table of named entries."""
Point = Annotated[tuple[q.PlaceMm, q.PlaceMm, q.PlaceMm], Field(strict=False)]
"""Place in space. Arrays of a file are lists; nothing in them is converted."""
LONGEST_LINE = 200
"""Characters of a section shown as a line."""
LONGEST_VALUE = 40
"""Characters of one of its values."""


class Section(BaseModel):
    """A table of the gearbox file; frozen, and no key or type is guessed."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    def __repr__(self) -> str:
        """Return one short line: the keys that were given."""
        line = f"<{type(self).__name__}: {', '.join(f'{key} = {value}' for key, value in self._given().items())}>"
        if len(line) <= LONGEST_LINE:
            return line
        return f"{line[: LONGEST_LINE - 2]}…>"

    def __str__(self) -> str:
        """Return the same short line."""
        return repr(self)

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self._given())

    def _given(self) -> dict[str, str]:
        """Values that were given, as short texts."""
        fields = (key for key in type(self).model_fields if key in self.model_fields_set)
        return {key: _shown(getattr(self, key)) for key in fields}


def _shown(value: Any) -> str:
    """Return a value as a short text; of tables and long arrays the number of their entries."""
    if isinstance(value, Section):
        return "a table"
    if isinstance(value, Mapping) or (isinstance(value, tuple) and len(value) > 3):
        return f"{len(value)} entries"
    text = repr(value)
    if len(text) <= LONGEST_VALUE:
        return text
    return f"{text[: LONGEST_VALUE - 1]}…"


def check_wall(inner: float, outer: float, keys: str) -> None:
    """Refuse a ring without a wall; `keys` names the inner diameter.

    Raises
    ------
    ValueError
        The inner diameter is not below the outer one.
    """
    if inner >= outer:
        raise ValueError(f"{keys} = {inner:g} must be below outer_diameter_mm = {outer:g}")
