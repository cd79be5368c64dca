"""Tables of validation claims and of promises: data of ``docs/validation``, put into the pages of the site.

A page names a table of ``claims.toml`` by the comment ``<!-- claims: NAME -->``, and one of ``promises.toml`` by
``<!-- promises: NAME -->``. ``<!-- sources -->`` stands for the number of claims by kind of source from outside. Run as
a program, ``python docs/tools/claims_tables.py``, it prints these claims with source, result, tolerance and test.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from sphinx.application import Sphinx

FOLDER = Path(__file__).parent.parent / "validation"
HEADS = {"claims": ("Claim", "Reference", "Result", "Tolerance", "Test"), "promises": ("Promise", "Test")}
COMMENT = re.compile(rf"^<!-- ({'|'.join(HEADS)}): (\w+) -->$", re.MULTILINE)

SOURCES = "<!-- sources -->"

Rows = list[list[str]]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("source-read", _put_in)
    app.connect("env-before-read-docs", _read_again)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def tables() -> dict[tuple[str, str], Rows]:
    """Return the rows of each table by its kind and name."""
    files = {kind: tomllib.loads((FOLDER / f"{kind}.toml").read_text(encoding="utf-8")) for kind in HEADS}
    return {(kind, name): table["rows"] for kind, found in files.items() for name, table in found.items()}


def with_tables(text: str, rows: dict[tuple[str, str], Rows]) -> str:
    """Return a page with its tables in Markdown.

    Examples
    --------
    >>> print(with_tables("<!-- promises: a -->", {("promises", "a"): [["x", "`t`"]]}))
    | Promise | Test |
    | --- | --- |
    | x | `t` |
    """
    return COMMENT.sub(lambda found: _table(HEADS[found[1]], rows[found[1], found[2]]), text)


def from_outside() -> dict[str, Rows]:
    """Return the claims that are compared with a source from outside, by the kind of source; each claim once."""
    kinds = tomllib.loads((FOLDER / "sources.toml").read_text(encoding="utf-8"))["kinds"]
    found: dict[str, Rows] = {kind: [] for kind in kinds}
    claims = [row for (kind, _), rows in tables().items() if kind == "claims" for row in rows]
    for row in claims:
        kind = next((name for name, words in kinds.items() if re.search(words, " ".join(row[:2]))), None)
        if kind is not None:
            found[kind].append(row)
    return found


def sources_table() -> str:
    """Return the number of claims by kind of source, in Markdown."""
    found = from_outside()
    counts = [[kind, str(len(rows))] for kind, rows in found.items()]
    return _table(("Source", "Claims"), [*counts, ["all", str(sum(map(len, found.values())))]])


def _table(head: tuple[str, ...], rows: Rows) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *rows))


def _put_in(app: Sphinx, docname: str, source: list[str]) -> None:
    if COMMENT.search(source[0]):
        source[0] = with_tables(source[0], tables())
    if SOURCES in source[0]:
        source[0] = source[0].replace(SOURCES, sources_table())


def _read_again(app: Sphinx, env: object, docnames: list[str]) -> None:
    """Read pages with claims in every build, since Sphinx does not see changes of the data."""
    found = {name for name in app.env.found_docs if _has_tables(_text(Path(app.env.doc2path(name))))}
    docnames[:] = sorted({*docnames, *found})


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8") if file.suffix == ".md" else ""


def _has_tables(text: str) -> bool:
    return SOURCES in text or COMMENT.search(text) is not None


if __name__ == "__main__":
    for _kind, _rows in from_outside().items():
        print(f"\n{_kind}: {len(_rows)}")
        for _row in _rows:
            print("  " + " | ".join(_row))
