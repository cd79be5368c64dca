"""Time from a key stroke in the page of `exugear edit` until its results are shown, by gearbox.

    python benchmarks/edit_page.py            # prints the table; about two minutes
    python benchmarks/edit_page.py --write    # also writes it into docs/howto/editor_in_the_browser.md

Measured in the system's chromium, drawn by the processor. Each key adds a digit to a number that changes all modes.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from report_page import ARGUMENTS, CHROMIUM, DESK
from timing import CASE, ROOT, environment, load, machine, median

from exugear.gearbox.templates.kinds import KINDS, template

PAGE = ROOT / "docs" / "howto" / "editor_in_the_browser.md"
MARKS = ("<!-- figures of benchmarks/edit_page.py -->", "<!-- end of figures -->")
STEPS = {
    "check": "errors, kinematics",
    "picture": "picture",
    "dynamics": "Campbell diagram",
    "loads": "loads",
    "shapes": "mode shapes",
}
ROUNDS = 7
#: Notes when a key is pressed, and when each part is no longer grey.
WATCH = """() => {
    window.shownAt = {};
    addEventListener("keydown", (event) => { window.shownAt = {}; window.keyAt = performance.now(); }, true);
    const seen = new MutationObserver((changes) => {
        for (const { target } of changes) {
            if (target.classList.contains("old")) continue;
            window.shownAt[target.dataset.step] = performance.now() - window.keyAt;
        }
    });
    for (const part of document.querySelectorAll("[data-step]")) {
        seen.observe(part, { attributes: true, attributeFilter: ["class"] });
    }
}"""


def times(address: str) -> dict[str, float]:
    """Return the median time of each step, ms."""
    from playwright.sync_api import sync_playwright

    found: dict[str, list[float]] = {step: [] for step in STEPS}
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        page = browser.new_context(viewport=DESK, reduced_motion="reduce").new_page()
        page.goto(address)
        current = "html[data-ready]:not(:has([data-step].old))"
        page.wait_for_selector(current, state="attached", timeout=180_000)
        page.locator(".cm-line", has_text=re.compile(r"^factor = ")).first.click()
        page.keyboard.press("Home")
        for _ in range(len("factor = 0.3")):
            page.keyboard.press("ArrowRight")
        page.evaluate(WATCH)
        for number in range(ROUNDS):
            page.keyboard.press(str(1 + number % 9))
            page.wait_for_selector(current, state="attached", timeout=60_000)
            for step, value in page.evaluate("window.shownAt").items():
                found[step].append(float(value))
        browser.close()
    return {step: median(values) for step, values in found.items()}


def measure(case: Path, folder: str) -> dict[str, float]:
    """Serve a gearbox file, and measure it."""
    command = [sys.executable, "-c", "from exugear.cli.app import main; main()", "edit", str(case), "--no-browser"]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([*command, "--out", folder], text=True, env=environment(), **streams) as server:
        assert server.stdout is not None
        address = re.search(r"http\S+", server.stdout.readline())
        assert address is not None
        try:
            return times(address[0])
        finally:
            server.terminate()


def main() -> None:
    """Measure all templates and the GRC."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="write the table into the page, too")
    wanted = parser.parse_args()
    if CHROMIUM is None:
        sys.exit("no chromium: apt-get install chromium")
    lines = ["| gearbox | " + " | ".join(f"{words} / ms" for words in STEPS.values()) + " |"]
    lines.append("| --- |" + " --- |" * len(STEPS))
    before = load()
    with tempfile.TemporaryDirectory() as folder:
        cases = {"GRC 750": CASE}
        for kind in KINDS:
            cases[f"template `{kind}`"] = Path(folder, f"{kind}.toml")
            cases[f"template `{kind}`"].write_text(template(kind), encoding="utf-8")
        for name, case in reversed(cases.items()):
            found = measure(case, str(Path(folder, "results")))
            lines.append(f"| {name} | " + " | ".join(f"{found[step]:.0f}" for step in STEPS) + " |")
            print(lines[-1], flush=True)
    about = machine()
    where = f"{about['cores']} cores ({about['processor']}) without graphics card"
    others = ": other programs were using the machine" if before > 1.0 else ""
    told = [f"Medians of {ROUNDS} key strokes on {where}.", f"Load average at the start: {before}{others}."]
    text = "\n".join([*lines, "", *told])
    print(text)
    if wanted.write:
        head, rest = PAGE.read_text(encoding="utf-8").split(MARKS[0])
        after = rest.split(MARKS[1])[1]
        PAGE.write_text(f"{head}{MARKS[0]}\n{text}\n{MARKS[1]}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
