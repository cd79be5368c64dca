"""Machine code on disk: as new as all sources behind it, and never a reason for work to fail."""

from __future__ import annotations

import ast
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


def printed(expression: str, *paths: Path, **environment: str) -> tuple[str, str]:
    """Value of an expression such as ``small.caller.value(1.0)`` in a process of its own, and what it logged."""
    module = expression.split("(")[0].rpartition(".")[0]
    program = f"import logging; logging.basicConfig(level='INFO')\nimport {module}\nprint({expression})"
    inherited = {key: value for key, value in os.environ.items() if key not in ("HOME", "XDG_CACHE_HOME")}
    outcome = subprocess.run(
        [sys.executable, "-P", "-c", program],  # not from the working directory
        env={**inherited, "PYTHONPATH": os.pathsep.join(map(str, [*paths, ROOT])), **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert outcome.returncode == 0, outcome.stderr
    return outcome.stdout.strip(), outcome.stderr


@pytest.mark.validation
def test_the_contact_s_near_field_follows_its_half_space(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "fe_ste", tmp_path / "fe_ste", ignore=shutil.ignore_patterns("__pycache__"))
    expression = "fe_ste.contact.compliance.mean_inverse_distance(0.0, 0.0, 1e-4, 1e-4)"
    before, _ = printed(expression, tmp_path)
    halfspace = tmp_path / "fe_ste" / "elasticity" / "halfspace.py"
    text = halfspace.read_text(encoding="utf-8")
    start = text.index("return ", text.index("def rectangle_integral("))
    halfspace.write_text(f"{text[:start]}return 2.0 * {text[start + len('return ') :]}", encoding="utf-8")
    after, _ = printed(expression, tmp_path)
    assert float(after) == pytest.approx(2.0 * float(before), rel=1e-12)


def foreign_names(source: str, without_kernels: set[str]) -> Iterator[str]:
    """Names that a file's compiled functions read and that come from modules without kernels."""
    tree = ast.parse(source)
    foreign = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module in without_kernels - {"fe_ste.tools.compilation"}
        for alias in node.names
    }
    for node in tree.body:
        decorators = node.decorator_list if isinstance(node, ast.FunctionDef) else []
        if {getattr(decorator, "id", "") for decorator in decorators} & {
            "compiled",
            "summing",
            "kernel",
            "summing_kernel",
        }:
            # Not those in annotations, which machine code knows nothing of.
            parts = (part for statement in node.body for part in ast.walk(statement))
            yield from sorted(foreign & {part.id for part in parts if isinstance(part, ast.Name)})


def test_compiled_functions_read_only_what_the_digest_covers() -> None:
    """Constants of a module without kernels would be frozen into machine code that outlives their change."""
    sources = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts): file.read_text(encoding="utf-8")
        for package in ("fe_ste", "exugear")
        for file in (ROOT / package).rglob("*.py")
    }
    with_kernels = {name: text for name, text in sources.items() if "fe_ste.tools.compilation import" in text}
    assert {"fe_ste.contact.compliance", "exugear.transient.compiled.equations"} <= set(with_kernels)
    may_compile = {"fe_ste.tools.compilation", "fe_ste.tools.bundles"}  # the second in an example only
    assert not [name for name, text in sources.items() if "njit" in text and name not in may_compile]
    others = {name for name, text in sources.items() if "fe_ste.tools.compilation" not in text}
    frozen = {name: list(foreign_names(text, others)) for name, text in with_kernels.items()}
    assert {name: names for name, names in frozen.items() if names} == {}


@pytest.fixture
def read_only(tmp_path: Path) -> Path:
    """A copy of the package in which no folder can be made beside the sources, by an administrator either."""
    shutil.copytree(ROOT / "fe_ste", tmp_path / "fe_ste", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "fe_ste" / "tools" / "__pycache__").write_bytes(b"")
    return tmp_path


@pytest.mark.validation
def test_a_package_that_cannot_be_written_keeps_its_kernels_with_the_user(read_only: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    folder, said = printed("fe_ste.tools.compilation.kernel_folder()", read_only, XDG_CACHE_HOME=str(cache))
    assert Path(folder).is_relative_to(cache / "exugear")
    assert said == ""


@pytest.mark.validation
def test_without_a_place_for_kernels_they_are_compiled_with_a_warning(read_only: Path) -> None:
    expression = "fe_ste.elasticity.halfspace.rectangle_integral(0.0, 0.0, 1.0, 1.0)"
    number, said = printed(expression, read_only, HOME=os.devnull)
    assert float(number) == pytest.approx(8.0 * math.log(1.0 + math.sqrt(2.0)), rel=1e-12)
    assert said.count("No folder for compiled kernels can be written") == 1


def test_no_machine_code_is_read_from_where_another_user_could_put_it(tmp_path: Path) -> None:
    """What lies in a cache is executed."""
    trap = tmp_path / "open"
    trap.mkdir()
    trap.chmod(0o777)
    folder, said = printed("fe_ste.tools.compilation.kernel_folder()", NUMBA_CACHE_DIR=str(trap / "cache"))
    assert folder == "None"
    assert "No folder for compiled kernels can be written" in said
    assert not list(trap.iterdir())


def test_only_the_folder_in_use_and_few_older_ones_stay(tmp_path: Path) -> None:
    for age in range(9):
        old = tmp_path / f"kernels-{age}"
        old.mkdir()
        os.utime(old, (1e9 - age, 1e9 - age))
    folder, _ = printed("fe_ste.tools.compilation.kernel_folder().name", NUMBA_CACHE_DIR=str(tmp_path))
    left = {entry.name for entry in tmp_path.iterdir()}
    assert left == {folder, "kernels-0", "kernels-1", "kernels-2", "kernels-3"}


@pytest.mark.sample
def test_damaged_machine_code_is_removed_with_a_message_and_the_next_start_compiles(tmp_path: Path) -> None:
    program = """
from exugear.cli.console import exit_codes
with exit_codes():
    from fe_ste.elasticity.halfspace import rectangle_integral
    print(rectangle_integral(1.0, 1.0, 1.0, 1.0))
"""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": str(ROOT)}

    def outcome() -> tuple[int, str]:
        command = [sys.executable, "-c", program]
        run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        return run.returncode, run.stderr

    assert outcome()[0] == 0
    for file in tmp_path.rglob("*.nb?"):
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    code, said = outcome()
    assert code == 1
    assert "kernels were damaged and have been removed; run the same command again" in said
    assert outcome()[0] == 0
