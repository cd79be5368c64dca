"""Build sdist and wheel of a copy of the tree whose README shows its pictures and links anywhere.

An index shows the README without the files beside it. With the address of the repository, links and pictures of the
README become absolute, and the project gets its links; without one, pictures give way to their captions and links to
files to their texts, so that nothing is broken.

    python packaging/build.py --out dist [--url https://example.org/owner/exugear]
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
MADE = ("results", "dist", "build", ".git", ".ci")
"""Folders beside the sources that no distribution holds; packages may have such names."""
LEFT_OUT = shutil.ignore_patterns(".venv*", "*.egg-info", "__pycache__", ".*_cache", "node_modules")
PAGES = {"Documentation": "docs/user_guide.md", "Changelog": "CHANGELOG.md"}


def with_links(text: str, url: str) -> str:
    """Return the README with links that hold without the files beside it.

    Parameters
    ----------
    text : str
    url : str
        Address of the repository; empty for none.
    """

    def replaced(match: re.Match[str]) -> str:
        picture, words, target = match.groups()
        if re.match(r"[a-z]+://|#|mailto:", target):
            return match[0]
        if not url:
            return f"*Picture: {words}.*" if picture else words
        return f"{picture}[{words}]({url}/{'raw' if picture else 'blob'}/HEAD/{target})"

    return LINK.sub(replaced, text)


def with_urls(text: str, url: str) -> str:
    """Return pyproject.toml with the project's links; unchanged without an address."""
    if not url:
        return text
    links = {"Homepage": url, "Source": url, "Issues": f"{url}/issues"}
    links |= {name: f"{url}/blob/HEAD/{path}" for name, path in PAGES.items()}
    table = "\n".join(f'{name} = "{target}"' for name, target in links.items())
    return text.replace("[project.scripts]", f"[project.urls]\n{table}\n\n[project.scripts]", 1)


def _left_out(folder: str, names: list[str]) -> set[str]:
    made = set(MADE) if Path(folder) == ROOT else set()
    return made & set(names) | LEFT_OUT(folder, names)


def build(out: Path, url: str) -> list[Path]:
    """Build into a folder and return what is in it."""
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch) / "exugear"
        shutil.copytree(ROOT, copy, ignore=_left_out)
        for name, changed in (("README.md", with_links), ("pyproject.toml", with_urls)):
            path = copy / name
            path.write_text(changed(path.read_text(encoding="utf-8"), url), encoding="utf-8")
        command = [sys.executable, "-m", "build", "--outdir", str(out.resolve()), str(copy)]
        # Elsewhere than here, where a folder build would stand before the package of that name.
        subprocess.run(command, check=True, cwd=copy.parent)
    return sorted(out.iterdir())


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="Build sdist and wheel.")
    parser.add_argument("--out", type=Path, default=ROOT / "dist")
    parser.add_argument("--url", default="", help="address of the repository, for links and pictures")
    given = parser.parse_args()
    shutil.rmtree(given.out, ignore_errors=True)
    for path in build(given.out, given.url.rstrip("/")):
        print(f"{path}: {path.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
