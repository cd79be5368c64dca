"""What is installed holds all that stands in the packages, not their modules alone."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
FOR_DEVELOPERS = ("all", "dev", "docs", "release")
"""Extras without functions of their own for users."""


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


def test_a_type_checker_elsewhere_finds_both_packages_in_the_editable_install(tmp_path):
    """As an editor runs it: in a folder of its own, with nothing but the environment; a wrong type is told."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert settings["tool"]["distutils"]["editable_wheel"]["mode"] == "compat"
    if not any(file.suffix == ".pth" for file in distribution("exugear").files or ()):
        pytest.skip("exugear is not installed as editable here")
    script = tmp_path / "use.py"
    wrong = "import exugear\nfrom fe_ste.tools.versions import TABLE\nnumber: str = TABLE\n"
    script.write_text(wrong, encoding="utf-8")
    # All of both packages would take a minute: that they are found is enough.
    sections = [f"[mypy-{name}]\nfollow_imports = skip\n" for name in ("exugear.*", "fe_ste.*", "numpy.*")]
    sections.append("[mypy-fe_ste.tools.versions]\nfollow_imports = normal\n")
    (tmp_path / "mypy.ini").write_text("".join(["[mypy]\n", *sections]), encoding="utf-8")
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "MYPYPATH")}
    told = subprocess.run(
        [sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path / "cache"), script.name],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    ).stdout
    assert told.splitlines()[:-1] == [
        'use.py:3: error: Incompatible types in assignment (expression has type "int", variable has type "str")  '
        "[assignment]"
    ]


def test_the_installed_size_is_listed_for_each_extra_and_counts_each_package_once():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    program = [sys.executable, str(ROOT / "packaging" / "installed_size.py")]
    printed = subprocess.run(program, capture_output=True, text=True, check=True).stdout.splitlines()
    extras = [
        name for name in settings["project"]["optional-dependencies"] if name not in ("all", "dev", "docs", "release")
    ]
    assert [line.partition(":")[0] for line in printed] == ["exugear without extras", *extras]
    size, packages = map(int, re.search(r": (\d+) MB, (\d+) packages", printed[0]).groups())
    # Each of its direct requirements, and NumPy and SciPy alone are larger than this.
    assert packages >= len(settings["project"]["dependencies"])
    assert size > 150
