"""What the report of the demo costs: its making, the size of its page, and how soon a browser shows it.

Measured by ``python benchmarks/run_all.py``; the part in a browser by the system's chromium, drawn by the processor.
"""

from __future__ import annotations

import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from timing import CASE, ROOT, Cost, environment, median, say, timed

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
#: Without graphics of its own, as on a machine that tests.
ARGUMENTS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"]
DESK = {"width": 1400, "height": 900}
#: Notes when the scripts say that all is there.
AT_READY = """
new MutationObserver((_, observer) => {
    if (!document.documentElement?.hasAttribute("data-ready")) return;
    window.readyAt = performance.now();
    observer.disconnect();
}).observe(document, {attributes: true, subtree: true, attributeFilter: ["data-ready"]});
"""
PAINT = "() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? null"


def exugear(*arguments: str) -> Cost:
    """Run one command; the processor time counts its own worker processes."""
    command = [sys.executable, "-c", "from exugear.cli.app import main; main()", *arguments]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    cost = timed(lambda: subprocess.run(command, check=True, capture_output=True, cwd=ROOT, env=environment()))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Cost(cost.wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def make_results(folder: str, quick: bool) -> None:
    """Compute what `make demo` computes before its report; in short only what shows that all of it works."""
    exugear("ste", str(CASE), "--out", folder, *(["--positions", "10"] if quick else []))
    for inertias in ("assemblies",) if quick else ("assemblies", "gears"):
        for variant in ("rigid", "bushing"):
            common = [str(CASE), "--variant", variant, "--inertias", inertias, "--out", folder]
            exugear("run", *common, *(["--duration", "2"] if quick else []))
            exugear("modes", *common)


def in_browser(page: Path, rounds: int) -> dict[str, float] | None:
    """First paint and the moment when all is ready, s after the page was asked for; None without a browser."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    if CHROMIUM is None:
        return None
    paints, readies = [], []
    with sync_playwright() as play:
        for _ in range(rounds):
            browser = play.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
            shown = browser.new_context(viewport=DESK, reduced_motion="reduce").new_page()
            shown.add_init_script(AT_READY)
            shown.goto(page.as_uri())
            shown.wait_for_selector("html[data-ready]", state="attached", timeout=120_000)
            paints.append(1e-3 * float(shown.evaluate(PAINT)))
            readies.append(1e-3 * float(shown.evaluate("window.readyAt")))
            browser.close()
    return {"first_paint_s": median(paints), "ready_s": median(readies)}


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    rounds = 1 if quick else 3
    with tempfile.TemporaryDirectory() as folder:
        make_results(folder, quick)
        say("report: results there")
        costs = [exugear("report", folder) for _ in range(rounds)]
        page = Path(folder) / "report.html"
        found = {
            "rounds": rounds,
            "wall_s": median(cost.wall for cost in costs),
            "processor_s": median(cost.processor for cost in costs),
            "page_MB": 1e-6 * page.stat().st_size,
            "browser": in_browser(page, rounds),
        }
    say("report: done")
    return found
