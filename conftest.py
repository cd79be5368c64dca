"""What all tests share, those of docstrings too: flanks and contacts computed once, kept until the tests end.

They read and write none in the user's cache folder.
"""

import atexit
import os
import shutil
import tempfile
from typing import Any

import pytest

# Processes that work side by side are started by this one and share its folder.
if "PYTEST_XDIST_WORKER" not in os.environ:
    KEPT = os.environ["EXUGEAR_FLANKS"] = tempfile.mkdtemp(prefix="exugear-tests-")
    OWNER = os.getpid()

    @atexit.register
    def remove_what_was_kept() -> None:
        """At the end of this process, not of its forks."""
        if os.getpid() == OWNER:
            shutil.rmtree(KEPT, ignore_errors=True)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a test marked `sample` the first set of parameters stays where it is, the others run before a release."""
    seen = set()
    for item in items:
        if item.get_closest_marker("sample") is not None:
            name = item.nodeid.partition("[")[0]
            if name in seen:
                item.add_marker("long")
            seen.add(name)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say loudly what was not looked at: a skipped browser must not pass for a passed one."""
    skipped = [report for report in terminalreporter.stats.get("skipped", []) if "browser" in report.keywords]
    if skipped:
        words = f"NOT TESTED: {len(skipped)} claims about the pages, for want of a browser (chromium and playwright)"
        terminalreporter.write_line(words, red=True, bold=True)
