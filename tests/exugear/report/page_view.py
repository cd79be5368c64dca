"""The report page in a real browser, at the size of a desk and of a phone."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
SIZES = {"desk": (1440, 900), "phone": (390, 844)}
IN_BROWSER = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium: apt-get install chromium"),
    pytest.mark.xdist_group("browser"),
]


def data_of(page: Path) -> dict[str, Any]:
    """Data of the scripts of a page."""
    found = re.search(r'id="data">(.*?)</script>', page.read_text(encoding="utf-8"), re.DOTALL)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


@dataclass
class View:
    """A page in a browser, and what went wrong in it."""

    page: Any
    errors: list[str] = field(default_factory=list)

    def open(self, path: Path, fragment: str = "") -> None:
        self.page.goto("about:blank")
        self.page.goto(path.as_uri() + fragment)
        self.page.wait_for_selector("html[data-ready]", state="attached", timeout=60_000)

    def pixels(self, selector: str) -> str:
        return str(self.page.evaluate("s => document.querySelector(s).toDataURL()", selector))

    def soon(self, claim: Any) -> bool:
        """Wait for a claim: what is drawn comes a moment later."""
        for _ in range(100):
            if claim():
                return True
            self.page.wait_for_timeout(100)
        return False


def opened(browser: Any, size: str, **options: Any) -> View:
    width, height = SIZES[size]
    context = browser.new_context(
        viewport={"width": width, "height": height}, reduced_motion="reduce", accept_downloads=True, **options
    )
    view = View(context.new_page())
    view.page.on("pageerror", lambda error: view.errors.append(str(error)))
    view.page.on("console", lambda told: view.errors.append(told.text) if told.type == "error" else None)
    view.page.on("dialog", lambda dialog: view.errors.append(dialog.message))
    local = ("file:", "data:", "blob:", "about:")
    view.page.on("request", lambda asked: None if asked.url.startswith(local) else view.errors.append(asked.url))
    return view
