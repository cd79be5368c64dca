"""Spelling check of the documents: English words, and technical words in ``docs/words.txt``.

Run it as ``python docs/tools/check_spelling.py``. Code, formulas and addresses are left out.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from spellchecker import SpellChecker

ROOT = Path(__file__).parent.parent.parent
WORDS = ROOT / "docs" / "words.txt"
GENERATED = ("elsewhere", "gallery", "keys", "api")
NOT_PROSE = re.compile(
    r"^(`{3,}|~{3,}).*?^\1"  # fenced blocks
    r"|^(?: {4}|\t).*?$"  # indented blocks
    r"|<!--.*?-->"
    r"|^## Sources.*?^In the code"  # names and abbreviated journals
    r"|\$\$.*?\$\$|\$[^$\n]+\$"
    r"|`+[^`]+`+"
    r"|\]\([^)]*\)|\]: \S+"
    r"|\bhttps?://\S+",
    re.MULTILINE | re.DOTALL,
)
WORD = re.compile(r"[A-Za-zÀ-ÿ][a-zà-ÿ]+(?:'[a-z]+)?\b")
"""Words of two letters or more; words in capitals are names."""


def documents() -> list[Path]:
    """Return the Markdown documents and the examples of the gallery."""
    pages = [page for page in (ROOT / "docs").rglob("*.md") if not set(page.parts) & set(GENERATED)]
    others = [ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "examples").glob("*.rst")]
    return sorted([*pages, *others, *(ROOT / "examples").glob("*.py")])


def prose(file: Path) -> str:
    """Return the text of a document without code, of an example its head and comments."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".py":
        comments = re.findall(r"^# ?(.*)$", text, re.MULTILINE)
        text = "\n".join([*text.split('"""')[1:2], *comments])
    return NOT_PROSE.sub(" ", text)


def unknown_words(file: Path, dictionary: SpellChecker) -> list[str]:
    """Return the words of a document that are in neither the dictionary nor the list."""
    words = {re.sub(r"'s?$", "", word.lower()) for word in WORD.findall(prose(file))}
    return sorted(dictionary.unknown(words))


def main() -> int:
    """Print unknown words by document; return 1 if there are any."""
    dictionary = SpellChecker(language="en")
    dictionary.word_frequency.load_words(WORDS.read_text(encoding="utf-8").split())
    files, errors = documents(), 0
    for file in files:
        if found := unknown_words(file, dictionary):
            errors += len(found)
            print(f"{file.relative_to(ROOT)}: {', '.join(found)}", file=sys.stderr)
    print(f"{len(files)} documents: {errors} unknown words; words of the field go into {WORDS.relative_to(ROOT)}")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
