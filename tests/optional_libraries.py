"""Marks of tests that need a library or a service of the system that not every machine has."""

from __future__ import annotations

import importlib

import pytest

from fe_ste.tools.drawing import RenderingError, require_rendering


def works(library: str) -> bool:
    """Tell whether an optional library and what it needs of the system is there."""
    try:
        importlib.import_module(library)
    except (ImportError, OSError):
        return False
    return True


def renders() -> bool:
    """Tell whether pyvista is there and draws off the screen."""
    try:
        require_rendering()
    except (RenderingError, ImportError):
        return False
    return True


needs_gmsh = pytest.mark.skipif(not works("gmsh"), reason="gmsh (extra mesh) or its system libraries are missing")
needs_meshio = pytest.mark.skipif(not works("meshio"), reason="meshio (extra mesh) is missing")
needs_asammdf = pytest.mark.skipif(not works("asammdf"), reason="asammdf (extra mdf) is missing")
needs_rendering = pytest.mark.skipif(not renders(), reason="no pyvista or no OpenGL on this machine")
