"""API pages: one per program with the public names that docs/reference/python.md lists, from their docstrings."""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx

DOCS = Path(__file__).parent.parent
ROOT = DOCS.parent
FOLDER = DOCS / "reference" / "api"
LIST = DOCS / "reference" / "python.md"
PACKAGES = ("exugear", "fe_ste")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("builder-inited", lambda app: write_pages())
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_pages() -> None:
    """Write the page of each program."""
    FOLDER.mkdir(exist_ok=True)
    names = re.findall(r"^   ~([\w.]+)$", LIST.read_text(encoding="utf-8"), re.MULTILINE)
    for package in PACKAGES:
        target = FOLDER / f"{package}.rst"
        text = _page(package, [name for name in names if name.partition(".")[0] == package])
        if not target.is_file() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")


def _page(package: str, names: list[str]) -> str:
    """Modules in the order of the list, each with its public names; all names of a module that is listed itself."""
    members: dict[str, list[str]] = {}
    for name in names:
        if ROOT.joinpath(*name.split(".")).with_suffix(".py").is_file():
            members[name] = []
        else:
            module, _, own = name.rpartition(".")
            members.setdefault(module, []).append(own)
    lines = [_title(package, "=")]
    for module, own in members.items():
        lines += [_title(module, "-"), f".. automodule:: {module}"]
        lines += [f"   :members: {', '.join(own)}".rstrip(), "   :undoc-members:", ""]
    return "\n".join(lines)


def _title(text: str, under: str) -> str:
    shown = text.replace("_", r"\_")
    return f"{shown}\n{under * len(shown)}\n"
