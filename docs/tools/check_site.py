"""Check of the built site: internal links have targets, and no page makes network requests.

Run it as ``python docs/tools/check_site.py build/docs/html``.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADING = {
    ("audio", "src"),
    ("embed", "src"),
    ("iframe", "src"),
    ("image", "href"),
    ("img", "src"),
    ("img", "srcset"),
    ("input", "src"),
    ("link", "href"),
    ("object", "data"),
    ("script", "src"),
    ("source", "src"),
    ("source", "srcset"),
    ("use", "href"),
    ("video", "src"),
}
"""Attributes whose address a browser loads automatically."""
STYLE_ADDRESS = re.compile(r"""(?:url\(\s*|@import\s+)["']?([a-z]*:?//[^"')\s]+)""", re.IGNORECASE)
SCRIPT_REQUEST = re.compile(r"""(?:fetch|import|importScripts|Worker|\.src\s*=)\s*\(?\s*["'`](https?://[^"'`]+)""")


class Page(HTMLParser):
    """Link targets, links and loaded addresses of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.places: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect the addresses of one element."""
        for name, value in attrs:
            if value is None:
                continue
            if name == "id" or (tag == "a" and name == "name"):
                self.places.add(value)
            if (tag, name) in LOADING and not (tag == "link" and dict(attrs).get("rel") == "canonical"):
                self.loads.append(value.split()[0] if name == "srcset" else value)
            elif tag == "a" and name == "href":
                self.links.append(value)
            elif name == "style":
                self.loads += STYLE_ADDRESS.findall(value)


def errors(site: Path) -> Iterator[str]:
    """Yield broken links and addresses that a page would load from the network."""
    pages = {file: Page(file.read_text(encoding="utf-8")) for file in pages_of(site)}
    for file, page in pages.items():
        name = file.relative_to(site)
        for address in page.loads:
            if urlsplit(address).netloc:
                yield f"{name}: requests {address}"
            elif urlsplit(address).scheme not in ("data", "blob") and not target(file, address).exists():
                yield f"{name}: {address} does not exist"
        for address in dict.fromkeys(page.links):
            parts = urlsplit(address)
            if parts.scheme or parts.netloc:
                continue
            aim = target(file, address)
            if not aim.exists():
                yield f"{name}: link to {address}, which does not exist"
            elif parts.fragment and aim in pages and unquote(parts.fragment) not in pages[aim].places:
                yield f"{name}: link to {address}: no such anchor on that page"
    for file in sorted([*site.rglob("*.css"), *site.rglob("*.html")]):
        found = STYLE_ADDRESS.findall(file.read_text(encoding="utf-8"))
        yield from (f"{file.relative_to(site)}: style requests {one}" for one in found)
    for file in sorted([*site.rglob("*.js"), *site.rglob("*.html")]):
        if "mathjax" not in file.parts:  # its addresses belong to speech, which is off
            found = SCRIPT_REQUEST.findall(file.read_text(encoding="utf-8"))
            yield from (f"{file.relative_to(site)}: script requests {one}" for one in found)


def pages_of(site: Path) -> list[Path]:
    """Return the pages of the site without the files of the theme."""
    return [file for file in sorted(site.rglob("*.html")) if "_static" not in file.parts]


def target(file: Path, address: str) -> Path:
    """Return the file of an internal address, relative to a page."""
    path = unquote(urlsplit(address).path)
    return (file.parent / path).resolve() if path else file


def main(site: Path) -> int:
    """Print the errors; return 1 if there are any."""
    found = list(errors(site.resolve()))
    print("\n".join(found), file=sys.stderr)
    count = len(pages_of(site))
    print(f"{count} pages: {len(found)} errors in links and requests")
    return 1 if found or not count else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
