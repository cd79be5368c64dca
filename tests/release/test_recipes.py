"""Recipe of conda and container file: they install what pyproject.toml says, and run what the Makefile has."""

from __future__ import annotations

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).parent.parent.parent
RECIPE = yaml.safe_load((ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
CONTAINER = (ROOT / "packaging" / "Containerfile").read_text(encoding="utf-8")
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
OTHER_NAMES = {"matplotlib": "matplotlib-base"}
"""Names of packages that differ on conda-forge."""


def written(requirement: str) -> str:
    parsed = Requirement(requirement)
    return f"{OTHER_NAMES.get(parsed.name, parsed.name)} {parsed.specifier}".strip()


def test_the_recipe_needs_what_pip_needs() -> None:
    python = ",".join(sorted(SETTINGS["project"]["requires-python"].split(","), reverse=True))
    run = RECIPE["requirements"]["run"]
    assert run == [f"python {python}", *map(written, SETTINGS["project"]["dependencies"])]
    host = RECIPE["requirements"]["host"]
    assert host == [f"python {python}", "pip", *map(written, SETTINGS["build-system"]["requires"])]


def test_the_recipe_has_the_program_and_the_licences_of_the_wheel() -> None:
    (script,) = RECIPE["build"]["python"]["entry_points"]
    assert dict([script.split(" = ")]) == SETTINGS["project"]["scripts"]
    assert RECIPE["about"]["license"] == SETTINGS["project"]["license"]
    assert RECIPE["about"]["license_file"] == SETTINGS["project"]["license-files"]


def test_the_container_has_a_supported_python_and_everything_is_its_users() -> None:
    (version,) = re.findall(r"^FROM docker\.io/library/python:(3\.\d+)-slim$", CONTAINER, re.MULTILINE)
    assert f"Programming Language :: Python :: {version}" in SETTINGS["project"]["classifiers"]
    assert re.search(r"^USER 1000$", CONTAINER, re.MULTILINE)


def test_the_container_runs_targets_of_the_makefile_with_extras_that_exist() -> None:
    make = shutil.which("make")
    if make is None:
        pytest.skip("there is no make here")
    commands = re.findall(r"^RUN (make .+)$", CONTAINER, re.MULTILINE)
    commands += [
        " ".join(re.findall(r'"([^"]+)"', line)) for line in re.findall(r"^CMD (.+)$", CONTAINER, re.MULTILINE)
    ]
    assert len(commands) == 2
    for command in commands:
        _, extras, target = command.split()
        assert set(extras.removeprefix("EXTRAS=").split(",")) <= set(SETTINGS["project"]["optional-dependencies"])
        asked = subprocess.run(
            [make, "--dry-run", extras, target], cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert asked.returncode == 0, asked.stderr


def test_what_is_copied_into_the_container_leaves_out_what_is_made() -> None:
    ignored = (ROOT / ".containerignore").read_text(encoding="utf-8").split()
    assert {".git", ".venv*", "build", "dist", "results"} <= set(ignored)
