"""Reference pages of the gearbox file, one per block, generated from the models that read the file."""

from __future__ import annotations

from pathlib import Path

from sphinx.application import Sphinx

from exugear.gearbox.sections.schema.keys import TOP, blocks

FOLDER = Path(__file__).parent.parent / "reference" / "keys"


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("builder-inited", lambda app: write_pages())
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_pages() -> None:
    """Write the pages that changed; remove those of blocks that no longer exist."""
    pages = {FOLDER / f"{block}.md": _page(block, text) for block, text in blocks().items()}
    FOLDER.mkdir(exist_ok=True)
    for old in set(FOLDER.glob("*.md")) - set(pages):
        old.unlink()
    for file, text in pages.items():
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def _page(block: str, text: str) -> str:
    """Return the page of a block; its title is that of its first table, and its tables are one level below."""
    title = "Keys before the first table" if block == TOP else f"`[{block}]` in the gearbox file"
    return f"# {title}\n\n{text}\n[All blocks of the gearbox file](../gearbox_file.md)\n"
