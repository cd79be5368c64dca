"""What all sections of a gearbox file share: names, texts, tables of named entries; unknown keys are refused."""

from __future__ import annotations

from typing import Annotated, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from exugear.model.sections import quantities as q

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


class Section(BaseModel):
    """A table of the gearbox file; frozen, and no key or type is guessed."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def check_wall(inner: float, outer: float, keys: str) -> None:
    """Refuse a ring without a wall; `keys` names the inner diameter.

    Raises
    ------
    ValueError
        The inner diameter is not below the outer one.
    """
    if inner >= outer:
        raise ValueError(f"{keys} = {inner:g} must be below outer_diameter_mm = {outer:g}")
