"""Pages of the site from other folders of the project, such as benchmarks, and links to them.

Pages in ``docs`` link to such files by their place in the project, so that the links work where the project is read as
files. In the site they lead to the pages that are made of those files here.
"""

from __future__ import annotations

import re
from os.path import relpath
from pathlib import Path

from sphinx.application import Sphinx

DOCS = Path(__file__).parent.parent
ROOT = DOCS.parent
FOLDERS = ("benchmarks", "cases")
"""Folders whose documents are pages of the site."""


def page_of(file: str) -> str:
    """Return the page of the site that shows a document, both from the root of the project.

    Examples
    --------
    >>> page_of("benchmarks/calculix/README.md"), page_of("CHANGELOG.md")
    ('docs/elsewhere/benchmarks/calculix/readme.md', 'docs/elsewhere/changelog.md')
    """
    return f"docs/elsewhere/{file.lower()}"


def outside_documents() -> list[str]:
    """Return the documents of other folders that are pages of the site."""
    found = [file for folder in FOLDERS for file in (ROOT / folder).rglob("*.md")]
    return ["CHANGELOG.md", *sorted(file.relative_to(ROOT).as_posix() for file in found)]


PAGES = {"README.md": "docs/index.md", **{file: page_of(file) for file in outside_documents()}}
"""Files of the project and the pages of the site that show them."""
LINK = re.compile(r"(\]\()([^)\s#:]+)((?:#[^)\s]*)?\))")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("builder-inited", _write_pages)
    app.connect("source-read", _lead_links_to_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def with_links(text: str, old: Path, new: Path) -> str:
    """Return a text with its links changed from the location `old` to `new`, both from the root."""

    def changed(link: re.Match[str]) -> str:
        begin, target, end = link.groups()
        place = Path(relpath(ROOT / old.parent / target, ROOT)).as_posix()
        page = PAGES.get(place, place)
        return f"{begin}{relpath(page, new.parent)}{end}"

    return LINK.sub(changed, text)


def _write_pages(app: Sphinx) -> None:
    for old in (DOCS / "elsewhere").rglob("*.md"):
        if old.relative_to(ROOT).as_posix() not in PAGES.values():
            old.unlink()
    for file in outside_documents():
        page = Path(page_of(file))
        text = with_links((ROOT / file).read_text(encoding="utf-8"), Path(file), page)
        target = ROOT / page
        target.parent.mkdir(exist_ok=True, parents=True)
        if not target.is_file() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")


def _lead_links_to_pages(app: Sphinx, docname: str, source: list[str]) -> None:
    path = Path(app.env.doc2path(docname, base=False))
    if path.suffix == ".md":
        place = Path("docs") / path
        source[0] = with_links(source[0], place, place)
