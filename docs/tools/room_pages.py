"""API pages: one per package, generated from the docstrings of its modules."""

from __future__ import annotations

import ast
from pathlib import Path

from sphinx.application import Sphinx

DOCS = Path(__file__).parent.parent
ROOT = DOCS.parent
FOLDER = DOCS / "reference" / "rooms"
PACKAGES = ("exugear", "fe_ste")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("builder-inited", lambda app: write_pages())
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_pages() -> None:
    """Write the page of each package and the index; remove obsolete pages."""
    pages = {f"{name}.rst": _room(name, files) for name, files in rooms().items()}
    pages["index.rst"] = _index()
    FOLDER.mkdir(exist_ok=True)
    for file in FOLDER.glob("*.rst"):
        if file.name not in pages:
            file.unlink()
    for name, text in pages.items():
        target = FOLDER / name
        if not target.is_file() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")


def rooms() -> dict[str, list[Path]]:
    """Return the modules of each package by its dotted name."""
    found: dict[str, list[Path]] = {}
    for package in PACKAGES:
        for file in sorted((ROOT / package).rglob("*.py")):
            name = ".".join(file.parent.relative_to(ROOT).parts)
            if file.stem not in ("__init__", "__main__"):
                found.setdefault(name, []).append(file)
    return dict(sorted(found.items()))


def _room(name: str, files: list[Path]) -> str:
    lines = [_title(name, "="), _about(ROOT.joinpath(*name.split("."), "__init__.py")), ""]
    for file in files:
        lines += [_title(file.stem, "-"), f".. automodule:: {name}.{file.stem}"]
        lines += ["   :members:", "   :undoc-members:", ""]
    return "\n".join(lines)


def _index() -> str:
    lines = [_title("All modules", "="), "A page for each package, generated from the docstrings.", ""]
    for package in PACKAGES:
        names = [name for name in rooms() if name.partition(".")[0] == package]
        lines += [_title(package, "-"), ".. toctree::", "   :maxdepth: 1", "", *(f"   {name}" for name in names), ""]
    return "\n".join(lines)


def _title(text: str, under: str) -> str:
    shown = text.replace("_", r"\_")
    return f"{shown}\n{under * len(shown)}\n"


def _about(file: Path) -> str:
    return ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
