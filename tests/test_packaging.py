"""What is installed holds all that stands in the packages, not their modules alone."""

from __future__ import annotations

import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent


def test_every_file_beside_the_modules_is_installed_with_them():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = settings["tool"]["setuptools"]["package-data"]
    installed = {
        file
        for package, globs in patterns.items()
        for pattern in globs
        for file in ROOT.joinpath(*package.split(".")).glob(pattern)
    }
    files = {
        file
        for package in ("fe_ste", "exugear")
        for file in (ROOT / package).rglob("*")
        if file.is_file() and file.suffix != ".py" and "__pycache__" not in file.parts
    }
    assert {file.suffix for file in files} >= {".toml", ".js", ".css", ".three"}
    assert files == installed
