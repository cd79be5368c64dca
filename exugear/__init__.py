"""Gearbox dynamics in Exudyn with finite-element transmission error tables.

Names are imported when first used, so that ``import exugear`` and the command line's help stay quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exugear.dynamics.modes import eigenmodes
    from exugear.model.gearbox import Gearbox
    from exugear.model.reading import CaseError
    from exugear.runs.runup import simulate

__all__ = ["CaseError", "Gearbox", "__version__", "eigenmodes", "simulate"]

_HOMES = {
    "CaseError": "exugear.model.reading",
    "Gearbox": "exugear.model.gearbox",
    "eigenmodes": "exugear.dynamics.modes",
    "simulate": "exugear.runs.runup",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("exugear")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
