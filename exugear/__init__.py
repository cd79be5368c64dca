"""Gearbox dynamics in Exudyn with finite-element transmission error tables.

Names are imported when first used, so that ``import exugear`` and the command line's help stay quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exugear.dynamics.modes import Modes, eigenmodes
    from exugear.dynamics.statics import static_state
    from exugear.model.choice import Choice
    from exugear.model.gearbox import Gearbox
    from exugear.model.reading import CaseError
    from exugear.project import Project
    from exugear.report.writer import write_report
    from exugear.runs.outcome import Run
    from exugear.runs.runup import simulate
    from exugear.steady.steady_response import steady_response

#: Public names and the modules they stand in.
_HOMES = {
    "CaseError": "exugear.model.reading",
    "Choice": "exugear.model.choice",
    "Gearbox": "exugear.model.gearbox",
    "Modes": "exugear.dynamics.modes",
    "Project": "exugear.project",
    "Run": "exugear.runs.outcome",
    "eigenmodes": "exugear.dynamics.modes",
    "simulate": "exugear.runs.runup",
    "static_state": "exugear.dynamics.statics",
    "steady_response": "exugear.steady.steady_response",
    "write_report": "exugear.report.writer",
}

__all__ = [
    "CaseError",
    "Choice",
    "Gearbox",
    "Modes",
    "Project",
    "Run",
    "__version__",
    "eigenmodes",
    "simulate",
    "static_state",
    "steady_response",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("exugear")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
