"""Filter of the API pages: imported names and type aliases are omitted."""

from __future__ import annotations

from types import BuiltinFunctionType, GenericAlias
from typing import Any, get_origin

from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("autodoc-skip-member", _skipped)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _skipped(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Omit type aliases and foreign names; return None for the default of Sphinx."""
    alias = isinstance(obj, GenericAlias) or get_origin(obj) is not None
    return True if what == "module" and (alias or _foreign(obj)) else None


def _foreign(obj: Any) -> bool:
    """Return whether a class or function belongs to another project."""
    home = getattr(obj, "__module__", None) or ""
    return isinstance(obj, type | BuiltinFunctionType) and home.partition(".")[0] not in ("exugear", "fe_ste")
