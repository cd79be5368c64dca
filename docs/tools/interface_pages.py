"""What the pages of the programming interface leave out: names that modules import, and short names of types."""

from __future__ import annotations

from types import BuiltinFunctionType, GenericAlias
from typing import Any, get_origin

from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx what this extension does."""
    app.connect("autodoc-skip-member", _skipped)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _skipped(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out short names of types, whose full form is no name to look up; None: as Sphinx would have it."""
    alias = isinstance(obj, GenericAlias) or get_origin(obj) is not None
    return True if what == "module" and (alias or _foreign(obj)) else None


def _foreign(obj: Any) -> bool:
    """Whether a class or function is another project's."""
    home = getattr(obj, "__module__", None) or ""
    return isinstance(obj, type | BuiltinFunctionType) and home.partition(".")[0] not in ("exugear", "fe_ste")
