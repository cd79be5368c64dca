"""Gearbox dynamics in Exudyn with finite-element transmission error tables.

Names are imported when first used, so that ``import exugear`` and the command line's help stay quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exugear.dynamics.eigenmodes.modes import Modes, eigenmodes
    from exugear.dynamics.statics import static_state
    from exugear.gearbox.choice import Choice
    from exugear.gearbox.gearbox import Gearbox
    from exugear.gearbox.reading import CaseError
    from exugear.project import Project
    from exugear.report.writer import write_report
    from exugear.steady.steady_response import steady_response
    from exugear.transient.outcome import Run
    from exugear.transient.runup import simulate

#: Public names and the modules they stand in.
_HOMES = {
    "CaseError": "exugear.gearbox.reading",
    "Choice": "exugear.gearbox.choice",
    "Gearbox": "exugear.gearbox.gearbox",
    "Modes": "exugear.dynamics.eigenmodes.modes",
    "Project": "exugear.project",
    "Run": "exugear.transient.outcome",
    "eigenmodes": "exugear.dynamics.eigenmodes.modes",
    "simulate": "exugear.transient.runup",
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
