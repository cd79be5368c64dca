"""Numbers of the README and of the paper: each stands in the documentation, where tests and commands write them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
PAPER = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
SOURCES = ("docs/validation", "docs/reference/computing_time.md", "docs/case_study", "cases/grc750/README.md")
"""Pages whose numbers commands write or tests hold."""
NUMBER = re.compile(r"(?<![\w.:/-])\d[\d.,]*(?:e-?\d+)?(?: ?(?:%|µm|kN|kW|MW|Hz|dB|MB|s|rpm|minutes?|times)(?!\w))?")
NAMES = re.compile(r"ISO(?:/T[RS])? [\d, -]+|\(20\d\d\)|of 20\d\d|Python 3\.\d+|3\.\d\d or 3\.\d\d|[\w.-]+\.whl|3-D")
"""Standards, years, versions and files: names, not results."""


def documented() -> str:
    files = [
        path for name in SOURCES for path in ([ROOT / name] if name.endswith(".md") else (ROOT / name).rglob("*.*"))
    ]
    return "\n".join(path.read_text(encoding="utf-8") for path in files if path.suffix in (".md", ".toml"))


def prose(text: str) -> str:
    """Text without code, addresses, headings, names and markers of lists."""
    text = re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.DOTALL)
    text = re.sub(
        r"```.*?```|`[^`]*`|\]\([^)]*\)|^#[^\n]*$|^ {4}[^\n]*$|@\w+", " ", text, flags=re.DOTALL | re.MULTILINE
    )
    return NAMES.sub(" ", " ".join(text.split()))


def numbers(text: str) -> set[str]:
    return {found.strip().rstrip(".,") for found in NUMBER.findall(prose(text))}


def unsupported(text: str) -> set[str]:
    source = documented()
    return {number for number in numbers(text) if not re.search(rf"(?<![\d.]){re.escape(number)}(?![\d]|\.\d)", source)}


def test_every_number_of_the_paper_stands_in_the_documentation() -> None:
    assert {"0.3 %", "0.06 %", "1e-9", "2e-3", "728", "3215 Hz"} <= numbers(PAPER)
    assert unsupported(PAPER) == set()


def test_every_number_of_the_readme_stands_in_the_documentation() -> None:
    """Numbers of versions are checked by `test_readme.py`, as is the output of the example."""
    text = re.sub(r"Version \d+\.\d+\.\d+", "", README)
    assert {"0.3 %", "750 kW"} <= numbers(text)
    assert unsupported(text) == set()


def test_a_number_from_nowhere_is_found() -> None:
    assert unsupported("The error is 0.0173 % at 98765 Hz, on 3 gears.") >= {"0.0173 %", "98765 Hz"}


def test_the_validation_of_the_paper_is_that_of_the_page_on_trust_and_of_its_claims() -> None:
    section = re.search(r"^# Validation\n(.*?)^# ", PAPER, re.DOTALL | re.MULTILINE)
    assert section is not None
    files = [ROOT / "docs" / "validation" / name for name in ("trust.md", "claims.toml", "te_accuracy.md")]
    source = "\n".join(path.read_text(encoding="utf-8") for path in files)
    missing = {number for number in numbers(section[1]) if number not in source}
    assert missing == set()


def test_the_paper_has_the_sections_and_the_length_that_the_journal_asks_for() -> None:
    heads = re.findall(r"^# (.+)$", PAPER, re.MULTILINE)
    assert heads[:6] == [
        "Summary",
        "Statement of need",
        "State of the field",
        "Software design",
        "Validation",
        "Research use",
    ]
    assert "Disclosure of the use of language models" in heads
    words = re.findall(r"\b[\w'-]+\b", PAPER.split("\n---\n", 1)[1])
    assert 750 <= len(words) <= 1750


def test_references_of_the_paper_are_those_of_its_list_and_each_is_complete() -> None:
    entries = dict(
        re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", (ROOT / "paper" / "paper.bib").read_text("utf-8"), re.M | re.S)
    )
    assert set(re.findall(r"@(\w+)", PAPER.split("\n---\n", 1)[1])) == set(entries)
    for name, entry in entries.items():
        keys = set(re.findall(r"^  (\w+) = ", entry, re.MULTILINE))
        assert {"author", "title", "year"} <= keys, name
        assert keys & {"doi", "url", "publisher", "institution"}, name


@pytest.mark.parametrize("target", re.findall(r"!\[[^\]]*\]\(([^)]+)\)", PAPER))
def test_figures_of_the_paper_are_those_that_commands_write(target: str) -> None:
    assert (ROOT / "paper" / target).is_file()
