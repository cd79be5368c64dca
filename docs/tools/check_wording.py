"""Wording of documents, messages and docstrings, checked against the phrases of ``docs/phrases.toml``.

Run it as ``python docs/tools/check_wording.py [--show AREA] [--lower]``. Each phrase has a pattern, the wording to use
instead and the kinds of text it applies to: ``docs`` (Markdown and comments of gearbox files), ``ui`` (strings of the
packages, the page's scripts and the Makefile), ``api`` (docstrings and texts below constants), ``code`` (comments).
The hits of each area are compared with ``docs/phrases_budget.toml``, whose numbers may only fall. Code spans, code
blocks, formulas and addresses are not read, nor are lines marked ``wording: ok``. Sources are parsed, not imported.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import sys
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parent.parent.parent
PHRASES = ROOT / "docs" / "phrases.toml"
BUDGET = ROOT / "docs" / "phrases_budget.toml"
GENERATED = {"elsewhere", "gallery", "rooms", "command_line.md", "modules.md", "gearbox_file.md"}
EXCUSED = "wording: ok"
NOT_PROSE = re.compile(r"`+[^`]*`+|\]\([^)]*\)|<!--.*?-->|\$\$.*?\$\$|\$[^$\n]+\$|https?://\S+", re.DOTALL)
SCRIPT_STRING = re.compile(r"\"([^\"\\\n]{3,}?)\"|'([^'\\\n]{3,}?)'|`([^`]{3,}?)`")


class Text(NamedTuple):
    """A piece of text that a person reads: its kind, file, line and words."""

    kind: str
    file: Path
    line: int
    words: str

    @property
    def area(self) -> str:
        """Name under which hits are budgeted: the kind and the first two folders, such as ``ui exugear/cli``."""
        folders = self.file.relative_to(ROOT).parent.parts[:2]
        return f"{self.kind} {'/'.join(folders) or self.file.name}"


class Phrase(NamedTuple):
    """A pattern of words to avoid, what to write instead, and the kinds of text it applies to."""

    pattern: re.Pattern[str]
    use: str
    kinds: frozenset[str]


def read_phrases() -> list[Phrase]:
    """Read the list of phrases; a pattern without capitals ignores case."""
    phrases = []
    for entry in tomllib.loads(PHRASES.read_text(encoding="utf-8"))["phrase"]:
        has_capitals = re.search("[A-Z]", re.sub(r"\\.", "", entry["pattern"]))
        flags = re.NOFLAG if has_capitals else re.IGNORECASE
        phrases.append(Phrase(re.compile(entry["pattern"], flags), entry["use"], frozenset(entry["in"])))
    return phrases


def markdown_texts(file: Path) -> Iterator[Text]:
    """Yield the paragraphs, list items and table rows of a document, without its code blocks."""
    block: list[str] = []
    start, fenced = 0, False
    for number, line in enumerate([*file.read_text(encoding="utf-8").splitlines(), ""], 1):
        bare = line.strip()
        if bare.startswith(("```", "~~~")):
            fenced = not fenced
            bare = ""
        ends = fenced or not bare or line.startswith(("    ", "\t")) or bare.startswith((":::", "{"))
        begins = bool(re.match(r"([-*|#>]|\d+\.)\s?", bare)) or bare.startswith(": ")
        if block and (ends or begins):
            yield Text("docs", file, start, " ".join(block))
            block = []
        if not ends:
            start = start if block else number
            block.append(bare)


def python_texts(file: Path) -> Iterator[Text]:
    """Yield docstrings by paragraph, other strings that hold words, and comments of a module."""
    source = file.read_text(encoding="utf-8")
    tree = ast.parse(source)
    read: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            for child in node.body:
                if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
                    read.add(id(child.value))
                    for part in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|>>>))", str(child.value.value)):
                        if not part.lstrip().startswith(">>>"):
                            yield Text("api", file, child.lineno, part)
        elif isinstance(node, ast.JoinedStr):
            read.update(id(part) for part in ast.walk(node) if part is not node)
    for node in ast.walk(tree):
        if id(node) in read:
            continue
        if isinstance(node, ast.JoinedStr):
            words = "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            words = node.value
        else:
            continue
        if (" " in words.strip() and re.search(r"[a-z]{3}", words)) or words.istitle():
            yield Text("ui", file, node.lineno, words)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield Text("code", file, token.start[0], token.string.lstrip("# "))


def script_texts(file: Path) -> Iterator[Text]:
    """Yield the strings of a script of the page that hold words."""
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        for groups in SCRIPT_STRING.findall(re.sub(r"//.*", "", line)):
            words = re.sub(r"\$\{[^}]*\}", "{}", next(filter(None, groups), ""))
            if " " in words.strip() and re.match(r"[A-Za-z{ ][A-Za-z{} ,.;:%'-]*$", words):
                yield Text("ui", file, number, words)


def line_texts(file: Path, kind: str, pattern: str) -> Iterator[Text]:
    """Yield what a pattern finds in each line of a file."""
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        if found := re.search(pattern, line):
            yield Text(kind, file, number, found[1])


def texts() -> Iterator[Text]:
    """Yield every text of the project that a person reads, apart from the change log and generated pages."""
    documents = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "cases").rglob("*.md")]
    for file in sorted(documents):
        if not GENERATED & set(file.relative_to(ROOT).parts):
            yield from markdown_texts(file)
    for package in ("exugear", "fe_ste"):
        for file in sorted((ROOT / package).rglob("*.py")):
            yield from python_texts(file)
    for file in sorted((ROOT / "exugear" / "report" / "web" / "scripts").glob("*.js")):
        yield from script_texts(file)
    for folder in (ROOT / "exugear" / "gearbox" / "templates", ROOT / "cases"):
        for file in sorted(folder.rglob("*.toml")):
            yield from line_texts(file, "docs", r"#\s?(.*)$")
    yield from line_texts(ROOT / "Makefile", "ui", r"(.*\becho\b.*)")


def main() -> int:
    """Print the hits of each area beside its budget; return 1 if an area has more than it may have."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--show", metavar="AREA", help="print the hits of the areas whose name begins so")
    parser.add_argument("--lower", action="store_true", help="write the counts that have fallen into the budget")
    options = parser.parse_args()
    phrases = read_phrases()
    lines: dict[Path, list[str]] = {}
    hits: Counter[str] = Counter()
    for text in texts():
        if text.file not in lines:
            lines[text.file] = text.file.read_text(encoding="utf-8").splitlines()
        if EXCUSED in text.words or EXCUSED in lines[text.file][text.line - 1]:
            continue
        words = " ".join(NOT_PROSE.sub(" ` ", text.words).split())
        for phrase in phrases:
            if text.kind not in phrase.kinds:
                continue
            for found in phrase.pattern.finditer(words):
                hits[text.area] += 1
                if options.show is not None and text.area.startswith(options.show):
                    extract = words[max(0, found.start() - 60) : found.end() + 60]
                    print(f"{text.file.relative_to(ROOT)}:{text.line}: …{extract}…\n    use: {phrase.use}")
    budget = tomllib.loads(BUDGET.read_text(encoding="utf-8"))
    exceeded = sorted(area for area in hits if hits[area] > budget.get(area, 0))
    for area in exceeded:
        allowed = budget.get(area, 0)
        print(
            f"{area}: {hits[area]} phrases to avoid, at most {allowed}; list them by --show '{area}'", file=sys.stderr
        )
    if options.lower:
        kept = {area: min(allowed, hits[area]) for area, allowed in budget.items() if hits[area]}
        BUDGET.write_text("".join(f'"{area}" = {count}\n' for area, count in sorted(kept.items())), encoding="utf-8")
    elif fallen := sum(max(0, allowed - hits[area]) for area, allowed in budget.items()):
        print(f"{fallen} fewer than the budget: write the new counts with --lower")
    print(f"{sum(hits.values())} phrases to avoid in {len(lines)} files; {len(exceeded)} areas above their budget")
    return 1 if exceeded else 0


if __name__ == "__main__":
    sys.exit(main())
