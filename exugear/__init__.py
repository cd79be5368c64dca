"""Gearbox dynamics in Exudyn with finite-element transmission error tables.

Names are imported when first used, so that ``import exugear`` and the command line's help stay quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exugear.gearbox import CaseError, Gearbox
    from exugear.modes import eigenmodes
    from exugear.runup import simulate

__all__ = ["CaseError", "Gearbox", "__version__", "eigenmodes", "simulate"]

_HOMES = {
    "CaseError": "exugear.gearbox",
    "Gearbox": "exugear.gearbox",
    "eigenmodes": "exugear.modes",
    "simulate": "exugear.runup",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("exugear")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
