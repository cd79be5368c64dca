"""Animation of the page of `exugear edit`: `python docs/tools/editor_picture.py` writes it; requires chromium."""

from __future__ import annotations

import io
import shutil
import tempfile
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image
from playwright.sync_api import sync_playwright

from exugear.cli.edit.server import EditServer
from exugear.gearbox.templates.kinds import template

if TYPE_CHECKING:
    from playwright.sync_api import Page, Position

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "howto" / "editor_in_the_browser.gif"
ARGUMENTS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
SIZE = {"width": 1280, "height": 720}
CURRENT = "html[data-ready]:not(:has([data-step].old))"
SLID = ("0.6", "0.7", "0.5", "0.4", "0.3", "0.4")
"""Housing factor as the slider is moved."""
START: Position = {"x": 20, "y": 8}
"""Near the start of a line, which is wider than what is seen of it."""


def frames(page: Page) -> list[tuple[bytes, int]]:
    """Return pictures of the page with their durations (ms): bearing selected, slider moved, error corrected."""
    taken: list[tuple[bytes, int]] = []

    def take(duration: int, until: str = CURRENT) -> None:
        page.wait_for_selector(until, state="attached")
        page.evaluate("document.querySelector('.result-side').scrollTop = 0")
        page.wait_for_timeout(500)
        taken.append((page.screenshot(), duration))

    take(1500)
    page.locator("#table-bearings .choice").first.click()
    take(2000)
    page.locator(".cm-scroller").evaluate("side => side.scrollTop = 0")
    page.locator(".cm-line", has_text="factor = 0.5").first.click(position=START)
    page.keyboard.press("Home")
    for _ in "factor = 0":
        page.keyboard.press("ArrowRight")
    for value in SLID:
        page.locator("#slider").fill(value)
        take(500)
    page.locator(".cm-line", has_text="factor = 0.4").first.click(position=START)
    page.keyboard.press("Home")
    page.mouse.move(0, 0)  # over the line, it would open the same message there
    page.keyboard.press("Delete")
    take(2000, "#verdict.bad")
    page.locator("#remarks").get_by_role("button", name="Replace by factor").click()
    take(1500)
    return taken


def main() -> None:
    """Serve the template `parallel`, and keep the animation."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        case = Path(folder, "gearbox.toml")
        case.write_text(template("parallel"), encoding="utf-8")
        server = EditServer(case, Path(folder, "results"))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_context(viewport=SIZE, reduced_motion="reduce").new_page()
        page.set_default_timeout(60_000)
        page.goto(server.address)
        taken = frames(page)
        browser.close()
        server.shutdown()
        server.server_close()
    images = [Image.open(io.BytesIO(content)).convert("RGB").quantize(64) for content, _ in taken]
    durations = [duration for _, duration in taken]
    images[0].save(PICTURE, save_all=True, append_images=images[1:], duration=durations, loop=0, optimize=True)
    print(PICTURE)


if __name__ == "__main__":
    main()
