"""The code keeps to docs/architecture.md: who imports whom, and what a quick start leaves unloaded."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("fe_ste", "exugear")
ALONE_WITH_EXUDYN = {"exugear.solvers.exudyn_model.system", "exugear.solvers.exudyn_model.floating"}
ROW = re.compile(r"^\| `(\w+)` \| .* \|([^|]*)\|$", re.MULTILINE)


def declared() -> dict[str, set[str]]:
    """Module -> modules it may import, in the order of the document."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    sections = re.split(r"^## ", text, flags=re.MULTILINE)
    modules = {}
    for package in PACKAGES:
        section = next(s for s in sections if s.startswith(f"{package}\n"))
        for module, needs in ROW.findall(section):
            names = re.findall(r"`([\w.]+)`", needs)
            modules[f"{package}.{module}"] = {n if "." in n else f"{package}.{n}" for n in names}
    return modules


def modules_on_disk() -> dict[str, Path]:
    """Module -> file, without the packages' own __init__."""
    return {
        f"{package}.{file.stem}": file
        for package in PACKAGES
        for file in sorted((ROOT / package).glob("*.py"))
        if file.stem != "__init__"
    }


def runtime_imports(file: Path) -> set[str]:
    """Dotted names that a file imports at any time, leaving out what only type checkers read."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    typing_only = {
        node
        for block in ast.walk(tree)
        if isinstance(block, ast.If) and getattr(block.test, "id", "") == "TYPE_CHECKING"
        for statement in block.body
        for node in ast.walk(statement)
    }
    names = set()
    for node in ast.walk(tree):
        if node in typing_only:
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            in_package = node.module in PACKAGES
            names |= {f"{node.module}.{a.name}" for a in node.names} if in_package else {node.module}
    return names


MODULES = modules_on_disk()


def test_every_module_stands_in_the_architecture_and_the_other_way_round():
    assert set(declared()) == set(MODULES)


@pytest.mark.parametrize("module", MODULES)
def test_a_module_imports_what_the_architecture_says_and_it_stands_above(module):
    allowed = declared()
    assert module in allowed, "docs/architecture.md does not list it"
    above = list(allowed)[: list(allowed).index(module)]
    own = {name for name in runtime_imports(MODULES[module]) if name in MODULES}
    assert own == allowed[module]
    assert own <= set(above)


@pytest.mark.parametrize("module", [name for name in MODULES if name.startswith("fe_ste.")])
def test_fe_ste_never_imports_exugear(module):
    assert not {name for name in runtime_imports(MODULES[module]) if name.split(".")[0] == "exugear"}


@pytest.mark.parametrize("module", [name for name in MODULES if name not in ALONE_WITH_EXUDYN])
def test_only_two_modules_know_exudyn(module):
    assert "exudyn" not in {name.split(".")[0] for name in runtime_imports(MODULES[module])}


def left_unloaded(arguments: list[str], heavy: tuple[str, ...]) -> str:
    """Output of the command line run in a process of its own, in which none of the named libraries was loaded."""
    program = (
        "import sys\nfrom exugear.cli.app import app\n"
        f"try:\n    app({arguments!r})\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
        f"sys.exit(', '.join(name for name in {heavy!r} if name in sys.modules) or 0)"
    )
    command = [sys.executable, "-c", program]
    outcome = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert outcome.returncode == 0, f"loaded by {arguments[0]}: {outcome.stderr}"
    return outcome.stdout


def test_help_loads_no_heavy_library():
    heavy = ("numpy", "scipy", "pydantic", "xarray", "numba", "matplotlib", "skfem", "pyvista", "exudyn")
    assert "Usage" in left_unloaded(["--help"], heavy)


def test_compiled_run_loads_neither_exudyn_nor_what_draws(tmp_path):
    run = ["run", "cases/grc750/gearbox.toml", "--variant", "rigid", "--mesh-law", "iso6336", "--duration", "0.01"]
    heavy = ("exudyn", "matplotlib", "pyvista", "scipy.signal", "scipy.stats", "pypardiso")
    assert "0.01 s simulated" in left_unloaded([*run, "--out", str(tmp_path)], heavy)
