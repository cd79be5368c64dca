from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from .page_view import CHROMIUM


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    sync = pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
    with sync.sync_playwright() as play:
        # Drawn by the processor: the machines that test have no graphics.
        arguments = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
        one = play.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield one
        one.close()
