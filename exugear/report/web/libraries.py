"""Libraries that stand in every page: fixed versions in ``vendor``, with their licences and hashes.

`benchmarks` and tests need no node; ``web/vendor.mjs`` of the repository renews the files from npm.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files


@dataclass(frozen=True)
class Library:
    """A library of others that the pages carry."""

    name: str
    version: str
    licence: str
    """Name of its licence."""
    files: tuple[tuple[str, str], ...]
    """Files with the SHA-256 of each."""
    licence_file: str


def vendored(name: str) -> str:
    """Text of a file of the vendored libraries."""
    return files("exugear.report.web").joinpath("vendor", name).read_text(encoding="utf-8")


@cache
def libraries() -> tuple[Library, ...]:
    """All libraries, as ``vendor.json`` lists them.

    Examples
    --------
    >>> [library.name for library in libraries()]
    ['uplot', 'three']
    """
    listed = json.loads(vendored("vendor.json"))
    return tuple(
        Library(one["name"], one["version"], one["licence"], tuple(one["files"].items()), one["licence_file"])
        for one in listed
    )


def licences() -> str:
    """Licences of all libraries, as the pages show them."""
    return "\n\n".join(
        f"{library.name} {library.version}\n\n{vendored(library.licence_file)}" for library in libraries()
    )
