"""The page of the command `edit`: text on the left, what the program makes of it on the right."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from exugear.cli.edit.places import schema_for_completion
from exugear.cli.edit.work import KINDS
from exugear.report.web.document import NO_RESULTS, STYLES, ArrayStore, whole_page
from exugear.report.web.html import render

LIBRARIES = ("codemirror.min.js", "three.min.js", "uPlot.iife.min.js")


def edit_page(case: Path, nonce: str) -> bytes:
    """Return the page of a gearbox file, without its text; the style elements of the editor have a nonce."""
    data: dict[str, Any] = {
        "name": case.name,
        **NO_RESULTS,
        "models": {},
        "nonce": nonce,
        "schema": schema_for_completion(),
    }
    body = render("edit", name=case.name, kinds=KINDS)
    sheets = (*STYLES, "edit")
    page = whole_page(case.name, body, "edit", data, ArrayStore(), LIBRARIES, sheets=sheets, served_nonce=nonce)
    return page.encode("utf-8", errors="replace")
