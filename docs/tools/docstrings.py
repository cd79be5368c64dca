"""Docstrings of the site by numpydoc, whose template is compiled once: once for each docstring takes half a minute."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpydoc
from numpydoc.docscrape import get_doc_object
from numpydoc.docscrape_sphinx import SphinxClassDoc, SphinxDocString, SphinxFunctionDoc, SphinxObjDoc
from sphinx.application import Sphinx


@cache
def _template() -> Any:
    return SphinxDocString("").template


def docstring_of(
    documented: object,
    what: str | None = None,
    doc: str | None = None,
    config: Mapping[str, Any] | None = None,
    builder: object = None,
) -> Any:
    """Return a docstring as numpydoc does with its own template."""
    settings = {**(config or {}), "template": _template()}
    kinds = {"class_doc": SphinxClassDoc, "func_doc": SphinxFunctionDoc, "obj_doc": SphinxObjDoc}
    return get_doc_object(documented, what=what, doc=doc, config=settings, **kinds)


def setup(app: Sphinx) -> Any:
    """Register numpydoc with `docstring_of`."""
    return numpydoc.setup(app, docstring_of)
