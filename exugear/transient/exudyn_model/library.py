"""Exudyn, loaded once: its modules, and how it gives up."""

from __future__ import annotations

import importlib
from typing import Any

# Exudyn's type stubs cover a part of it only, so its modules count as untyped.
exudyn: Any = importlib.import_module("exudyn")
items: Any = importlib.import_module("exudyn.itemInterface")
elements: Any = importlib.import_module("exudyn.FEM")
kinematics: Any = importlib.import_module("exudyn.rigidBodyUtilities")
exudyn.config.suppressWarnings = True


class SolverFailure(RuntimeError):
    """Exudyn's solver gave up."""
