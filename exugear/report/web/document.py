"""The whole page: one file that runs its own scripts and no other, and asks nothing of any network."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from exugear.report.web.arrays import ArrayStore, json_element
from exugear.report.web.libraries import vendored
from exugear.report.web.pieces import text
from exugear.report.web.scripts import bundle

STYLES = ("base", "parts", "narrow", "paper")
"""Style sheets of all pages, in their order."""
THEME = (
    "try{const t=localStorage.getItem('exugear-theme');document.documentElement.dataset.theme=t||"
    "(matchMedia('(prefers-color-scheme: dark)').matches?'dark':'light')}"
    "catch(e){document.documentElement.dataset.theme='light'}document.documentElement.classList.add('scripted')"
)
"""What must run before the first paint: the colours that were chosen last, or those of the machine."""


def whole_page(
    title: str, body: str, script: str, data: Mapping[str, Any], arrays: ArrayStore, libraries: Sequence[str]
) -> str:
    """Make the page.

    Parameters
    ----------
    body : HTML of its body
    script : name of its main module
    data : what the scripts read as JSON
    arrays : arrays that the data refer to
    libraries : files of vendored libraries that it needs

    Returns
    -------
    str
        HTML. Its policy lets scripts and styles of these very bytes run and no others, whatever a name or a file of
        a stranger brought in, and lets no request leave.
    """
    style = "\n".join([vendored("uPlot.min.css"), *map(_style, STYLES)])
    scripts = [*map(vendored, libraries), bundle(script)]
    policy = (
        f"default-src 'none'; script-src {' '.join(map(_digest, [THEME, *scripts]))}; style-src {_digest(style)}; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta name="color-scheme" content="light dark"><title>{text(title)}</title>\n'
        f"<style>{style}</style><script>{THEME}</script></head>\n<body>{body}\n"
        f"{json_element('data', data)}\n{arrays.elements()}\n"
        + "\n".join(f"<script>{script}</script>" for script in scripts)
        + "\n</body></html>\n"
    )


def _style(name: str) -> str:
    return files("exugear.report.web").joinpath("styles", f"{name}.css").read_text(encoding="utf-8")


def _digest(content: str) -> str:
    """Name a script or style in the policy by its hash."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(content.encode('utf-8')).digest()).decode('ascii')}'"
