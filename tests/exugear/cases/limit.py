"""Cases beyond what a file may say: the limit of rigid bodies, which a stiffness of no material approaches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from exugear.gearbox.gearbox import Gearbox


def unchecked(gearbox: Gearbox, changes: Mapping[str, Any]) -> Gearbox:
    """Gearbox with some keys replaced, by dotted paths, whose values no range is held against."""
    case = gearbox.case
    for dotted, value in changes.items():
        case = _replaced(case, dotted.split("."), value)
    return replace(gearbox, case=case)


def _replaced(section: Any, path: list[str], value: Any) -> Any:
    name, *rest = path
    if isinstance(section, BaseModel):
        return section.model_copy(update={name: _replaced(getattr(section, name), rest, value) if rest else value})
    return {**section, name: _replaced(section[name], rest, value) if rest else value}
