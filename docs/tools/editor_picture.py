"""Picture of the page of `exugear edit`: `python docs/tools/editor_picture.py` writes it; requires chromium."""

from __future__ import annotations

import shutil
import tempfile
import threading
from pathlib import Path

from playwright.sync_api import sync_playwright

from exugear.cli.edit.server import EditServer
from exugear.gearbox.templates.kinds import template

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "howto" / "editor_in_the_browser.png"
ARGUMENTS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]


def main() -> None:
    """Serve the template `parallel`, put the cursor on a bearing, and keep a picture of the page."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        case = Path(folder, "gearbox.toml")
        case.write_text(template("parallel"), encoding="utf-8")
        server = EditServer(case, Path(folder, "results"))
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_context(viewport={"width": 1280, "height": 760}, reduced_motion="reduce").new_page()
        page.goto(server.address)
        page.wait_for_selector("html[data-ready]:not(:has([data-step].old))", state="attached", timeout=180_000)
        page.locator("#table-bearings .choice").first.click()
        page.keyboard.press("ArrowDown")
        page.keyboard.press("ArrowDown")
        page.keyboard.press("End")
        page.evaluate("document.querySelector('.result-side').scrollTop = 0")
        page.wait_for_timeout(1000)
        page.screenshot(path=PICTURE)
        browser.close()
        server.shutdown()
        server.server_close()
    print(PICTURE)


if __name__ == "__main__":
    main()
