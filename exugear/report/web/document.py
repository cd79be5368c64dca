"""Whole web page in one file that runs only its own scripts and makes no network requests.

The libraries in it are files of the repository, so that tests and benchmarks need no Node.js; ``web/vendor.mjs``
updates them from npm.

A page opened from a file cannot import modules. Each module therefore becomes a function that is called once and
returns its exports; imports become constants from the results of earlier modules. Nothing else is changed.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from exugear.report.web.html import render

# Libraries in every page: fixed versions in ``vendor``, with their licences and hashes


@dataclass(frozen=True)
class Library:
    """Third-party library included in the pages."""

    name: str
    version: str
    licence: str
    files: tuple[tuple[str, str], ...]
    """Files with the SHA-256 of each."""
    licence_file: str


def vendored(name: str) -> str:
    """Return the text of a file of the vendored libraries."""
    return files("exugear.report.web").joinpath("vendor", name).read_text(encoding="utf-8")


@cache
def libraries() -> tuple[Library, ...]:
    """Return all libraries listed in ``vendor.json``.

    Examples
    --------
    >>> [library.name for library in libraries()]
    ['uplot', 'three', 'codemirror']
    """
    listed = json.loads(vendored("vendor.json"))
    return tuple(
        Library(one["name"], one["version"], one["licence"], tuple(one["files"].items()), one["licence_file"])
        for one in listed
    )


def licences(names: Sequence[str] = ("uplot", "three")) -> str:
    """Return the licences of libraries, by default those of the report, as text for the pages."""
    return "\n\n".join(
        f"{library.name} {library.version}\n\n{vendored(library.licence_file)}"
        for library in libraries()
        if library.name in names
    )


# Scripts of the pages: small modules, bundled in the order of their imports into one script without addresses

_IMPORT = re.compile(r'^import (\{[^}]*\}) from "\./([a-z_]+)\.js";$', re.MULTILINE)
_EXPORT = re.compile(r"^export ((?:async )?(?:function\*?|const|class) (\w+))", re.MULTILINE)


@cache
def script_source(name: str) -> str:
    """Return the source of a module."""
    return files("exugear.report.web").joinpath("scripts", f"{name}.js").read_text(encoding="utf-8")


def module_order(name: str) -> tuple[str, ...]:
    """Return the names of a module and all its imports, each after those that it needs.

    Examples
    --------
    >>> module_order("theme")
    ('dom', 'theme')
    """
    order: dict[str, None] = {}

    def visit(one: str) -> None:
        if one in order:
            return
        for _, needed in _IMPORT.findall(script_source(one)):
            visit(needed)
        order[one] = None

    visit(name)
    return tuple(order)


def as_function(name: str, source: str) -> str:
    r"""Convert a module to a function that is called once.

    Examples
    --------
    >>> print(as_function("sum", 'import { one } from "./ones.js";\nexport const two = one + one;'))
    const $sum = (() => {
    const { one } = $ones;
    const two = one + one;
    return { two };
    })();
    """
    exported = ", ".join(found for _, found in _EXPORT.findall(source))
    body = _EXPORT.sub(r"\1", _IMPORT.sub(r"const \1 = $\2;", source))
    return f"const ${name} = (() => {{\n{body.rstrip()}\nreturn {{ {exported} }};\n}})();"


def bundle(name: str) -> str:
    """Return one script with a module and all its imports."""
    parts = [as_function(one, script_source(one)) for one in module_order(name)]
    return '"use strict";\n(() => {\n' + "\n".join(parts) + "\n})();\n"


# Arrays in a page: deflated and base64-encoded, each in its own element, unpacked when it is shown

KINDS: Final = {"u1": "u8", "u2": "u16", "i1": "i8", "i2": "i16", "u4": "u32", "f4": "f32"}
"""Type names used by the scripts, by NumPy types."""


class ArrayStore:
    """Arrays of one page, by name.

    Examples
    --------
    >>> store = ArrayStore()
    >>> store.add(np.arange(3, dtype="u1"), differences=True)
    {'blob': 'a0', 'type': 'u8', 'shape': [3], 'differences': True}
    """

    def __init__(self, prefix: str = "a", level: int = 6) -> None:
        self._prefix = prefix
        self._level = level
        self._packed: list[str] = []
        self._known: dict[bytes, str] = {}

    def add(self, values: NDArray[Any], *, differences: bool = False) -> dict[str, object]:
        """Store an array and return its reference for the scripts.

        Parameters
        ----------
        values : of a type in `KINDS`
        differences : whether to store differences along the first axis, which compress better for similar neighbours
        """
        array = np.ascontiguousarray(values)
        kept = array
        if differences:
            kept = np.diff(array, axis=0, prepend=np.zeros_like(array[:1])).astype(array.dtype)
        little = kept.astype(kept.dtype.newbyteorder("<"), copy=False)
        packed = zlib.compress(little.tobytes(), self._level)
        if packed not in self._known:  # equal planets share one array
            self._known[packed] = f"{self._prefix}{len(self._packed)}"
            self._packed.append(base64.b64encode(packed).decode("ascii"))
        return {
            "blob": self._known[packed],
            "type": KINDS[array.dtype.str[1:]],
            "shape": list(array.shape),
            "differences": differences,
        }

    def packed(self) -> dict[str, str]:
        """Return all arrays as text by name."""
        return dict(zip(self._known.values(), self._packed, strict=True))

    def elements(self) -> str:
        """Return all arrays as elements of the page."""
        return "\n".join(
            f'<script type="text/plain" id="{name}">{data}</script>' for name, data in self.packed().items()
        )


def json_element(name: str, content: Mapping[str, Any]) -> str:
    r"""Return data as JSON in an element of the page, escaped so that it cannot end the element or begin another.

    Examples
    --------
    >>> json_element("data", {"title": "</script>"})
    '<script type="application/json" id="data">{"title":"\\u003c/script\\u003e"}</script>'
    """
    written = json.dumps(content, separators=(",", ":"), allow_nan=False)
    safe = written.translate({ord(sign): f"\\u{ord(sign):04x}" for sign in "<>&"})
    return f'<script type="application/json" id="{name}">{safe}</script>'


def rounded(value: float, digits: int = 5) -> float | None:
    """Round a number to significant digits for JSON; None for non-finite values.

    Examples
    --------
    >>> rounded(3.14159265, 3), rounded(float("nan"))
    (3.14, None)
    """
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None


def rounded_list(values: NDArray[Any], digits: int = 5) -> list[float | None]:
    """Round all numbers of an array."""
    return [rounded(float(value), digits) for value in values]


# The whole page: one file that runs only its own scripts and makes no network requests

STYLES = ("base", "parts", "narrow", "paper")
"""Style sheets of all pages, in their order."""
THEME = (
    "try{const t=localStorage.getItem('exugear-theme');document.documentElement.dataset.theme=t||"
    "(matchMedia('(prefers-color-scheme: dark)').matches?'dark':'light')}"
    "catch(e){document.documentElement.dataset.theme='light'}document.documentElement.classList.add('scripted')"
)
"""Script that runs before the first paint: it sets the colours selected last, or those of the system."""


NO_RESULTS: Mapping[str, Any] = {"input": "", "rated": None, "lines": [], "groups": [], "charts": {}}
"""Data of a page without results over speed."""


def whole_page(
    title: str,
    body: Markup,
    script: str,
    data: Mapping[str, Any],
    arrays: ArrayStore,
    libraries: Sequence[str],
    *,
    sheets: Sequence[str] = STYLES,
    served_nonce: str = "",
) -> str:
    """Return the whole page.

    Parameters
    ----------
    body : HTML of its body
    script : name of its main module
    data : JSON data for the scripts
    arrays : arrays that the data refer to
    libraries : required files of vendored libraries
    sheets : style sheets, in their order
    served_nonce : of a page from a server, which may send requests to that server alone, and whose scripts may add
        style elements with this nonce; empty for a file

    Returns
    -------
    str
        HTML. Its content security policy permits only scripts and styles with these hashes, whatever names or untrusted
        files contain, and blocks all requests.
    """
    folder = files("exugear.report.web").joinpath("styles")
    styles = [folder.joinpath(f"{name}.css").read_text(encoding="utf-8") for name in sheets]
    style = "\n".join([vendored("uPlot.min.css"), *styles])
    scripts = [*map(vendored, libraries), bundle(script)]
    served = f" 'nonce-{served_nonce}'; connect-src 'self'" if served_nonce else ""
    policy = (
        f"default-src 'none'; script-src {' '.join(map(_digest, [THEME, *scripts]))}; style-src {_digest(style)}"
        f"{served}; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    return render(
        "page",
        title=title,
        body=body,
        policy=Markup(policy),
        style=Markup(style),
        theme=Markup(THEME),
        data=Markup(json_element("data", data)),
        arrays=Markup(arrays.elements()),
        scripts=map(Markup, scripts),
    )


def _digest(content: str) -> str:
    """Return the hash of a script or style for the content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(content.encode('utf-8')).digest()).decode('ascii')}'"
