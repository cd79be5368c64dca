"""What all tests share, those of docstrings too: flanks and contacts computed once for these sources.

They read and write none in the user's cache folder.
"""

import hashlib
import os
import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent
SOURCES_KEPT = 3
"""Versions of the sources whose flanks stay: `make validate` after `make test`, and branches that one goes back to."""


def folder_of_flanks() -> Path:
    """Return the folder of the flanks that the present sources compute; remove those of sources of long ago."""
    digest = hashlib.sha256()
    for file in sorted((ROOT / "fe_ste").rglob("*.py")):
        digest.update(file.read_bytes())
    kept = ROOT / ".pytest_cache" / "flanks"
    folder = kept / digest.hexdigest()[:16]
    folder.mkdir(parents=True, exist_ok=True)
    os.utime(folder)
    by_use = sorted(kept.iterdir(), key=lambda old: old.stat().st_mtime, reverse=True)
    for old in by_use[SOURCES_KEPT:]:
        shutil.rmtree(old, ignore_errors=True)
    return folder


# Processes that work side by side are started by this one and share its folder.
if "PYTEST_XDIST_WORKER" not in os.environ:
    try:
        os.environ["EXUGEAR_FLANKS"] = str(folder_of_flanks())
    except OSError:  # the checkout cannot be written, or another process removed a folder at the same moment
        os.environ["EXUGEAR_FLANKS"] = "off"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of a test marked `sample` the first set of parameters stays where it is, the others run before a release.

    Files with most tests of the mark `validation`, which take long, come first: no core waits at the end for one.
    """
    seen = set()
    for item in items:
        if item.get_closest_marker("sample") is not None:
            name = item.nodeid.partition("[")[0]
            if name in seen:
                item.add_marker("long")
            seen.add(name)
    long = Counter(
        item.path for item in items if item.get_closest_marker("validation") and not item.get_closest_marker("long")
    )
    items.sort(key=lambda item: -long[item.path])


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say loudly what was not looked at: a skipped browser must not pass for a passed one."""
    # A module skipped as a whole has no keywords.
    reports = [(report, getattr(report, "keywords", ())) for report in terminalreporter.stats.get("skipped", [])]
    skipped = [report for report, keywords in reports if "browser" in keywords]
    if skipped:
        words = f"NOT TESTED: {len(skipped)} claims about the pages, for want of a browser (chromium and playwright)"
        terminalreporter.write_line(words, red=True, bold=True)
