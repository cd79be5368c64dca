"""Modules of the benchmarks, which are no part of the installed packages."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

FOLDER = Path(__file__).parents[3] / "benchmarks"


def benchmark_module(folder: str, name: str) -> ModuleType:
    """A module of a folder of benchmarks, which finds its neighbours as when it is run there."""
    sys.path.insert(0, str(FOLDER / folder))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(FOLDER / folder))
