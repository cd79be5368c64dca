"""What all tests share, those of docstrings too: they read and write no flanks in the user's cache folder."""

import os
from typing import Any

os.environ["EXUGEAR_FLANKS"] = "off"


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say loudly what was not looked at: a skipped browser must not pass for a passed one."""
    skipped = [report for report in terminalreporter.stats.get("skipped", []) if "browser" in report.keywords]
    if skipped:
        words = f"NOT TESTED: {len(skipped)} claims about the pages, for want of a browser (chromium and playwright)"
        terminalreporter.write_line(words, red=True, bold=True)
