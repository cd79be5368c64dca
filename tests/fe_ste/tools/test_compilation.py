"""Machine code on disk: as new as all sources behind it, and never a reason for work to fail."""

from __future__ import annotations

import ast
import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from fe_ste.tools.compilation import kernel_folder

ROOT = Path(__file__).parents[3]
COMPILING = "Compiling kernels"

CALLEE = "from fe_ste.tools.compilation import compiled\n\n@compiled\ndef doubled(x):\n    return 2.0 * x\n"
CALLER = """
from fe_ste.tools.compilation import compiled
from small.callee import doubled

@compiled
def value(x):
    return doubled(x) + 1.0
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """Package of two kernels, one of which calls the other in another file."""
    package = tmp_path / "small"
    package.mkdir()
    for name, source in {"__init__": "", "callee": CALLEE, "caller": CALLER}.items():
        (package / f"{name}.py").write_text(source, encoding="utf-8")
    return package


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


def value(small: Path, **environment: str) -> tuple[str, str]:
    return printed("small.caller.value(1.0)", small.parent, **environment)


@pytest.mark.validation
def test_an_edited_callee_in_another_file_gives_the_new_number(small: Path) -> None:
    """And the number of before when the edit is taken back, without compiling."""
    before, said = value(small)
    assert before == "3.0"
    assert COMPILING in said
    (small / "callee.py").write_text(CALLEE.replace("2.0", "5.0"), encoding="utf-8")
    assert value(small)[0] == "6.0"
    (small / "callee.py").write_text(CALLEE, encoding="utf-8")
    before, said = value(small)
    assert before == "3.0"
    assert COMPILING not in said


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


def closed(small: Path) -> None:
    """Leave no place for a cache beside the sources, for an administrator either."""
    (small / "__pycache__").write_bytes(b"")


@pytest.mark.validation
def test_a_package_that_cannot_be_written_keeps_its_kernels_with_the_user(small: Path, tmp_path: Path) -> None:
    closed(small)
    cache = str(tmp_path / "cache")
    assert value(small, XDG_CACHE_HOME=cache)[0] == "3.0"
    assert value(small, XDG_CACHE_HOME=cache) == ("3.0", "")
    if sys.platform == "linux":
        assert list((tmp_path / "cache" / "exugear" / "small").glob("kernels-*/*.nbc"))


@pytest.mark.validation
def test_without_a_home_kernels_are_kept_in_a_private_folder_for_temporary_files(small: Path, tmp_path: Path) -> None:
    closed(small)
    place = tmp_path / "temporary"
    place.mkdir()
    homeless = {"HOME": os.devnull, "TMPDIR": str(place)}
    assert value(small, **homeless)[0] == "3.0"
    assert value(small, **homeless) == ("3.0", "")
    (own,) = place.iterdir()
    assert own.stat().st_mode & 0o077 == 0


@pytest.mark.sample
@pytest.mark.parametrize("trap", ["open folder", "link"])
def test_no_machine_code_is_read_from_where_another_user_could_put_it(small: Path, tmp_path: Path, trap: str) -> None:
    """What lies in a cache is executed."""
    closed(small)
    place = tmp_path / "temporary"
    place.mkdir()
    if trap == "link":
        (tmp_path / "elsewhere").mkdir()
        (place / f"exugear-{os.getuid()}").symlink_to(tmp_path / "elsewhere")
    else:
        place.chmod(0o777)
    assert value(small, HOME=os.devnull, TMPDIR=str(place))[0] == "3.0"
    assert not list(tmp_path.rglob("*.nb?"))


@pytest.mark.validation
def test_a_damaged_cache_is_compiled_anew(small: Path) -> None:
    assert value(small)[0] == "3.0"
    for file in small.rglob("*.nb?"):
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    for expected in (True, False):
        number, said = value(small)
        assert number == "3.0"
        assert (COMPILING in said) is expected


@pytest.mark.validation
def test_a_full_disk_costs_the_cache_and_not_the_work(small: Path) -> None:
    program = "import small.caller; print(small.caller.value(1.0))"
    outcome = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(small.parent), str(ROOT)])},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert outcome.stdout == "3.0\n", outcome.stderr
    assert outcome.stderr.count("compiled kernels cannot be stored (File too large)") == 1


def test_few_folders_of_older_sources_stay(small: Path) -> None:
    for age in range(9):
        old = small / "__pycache__" / f"kernels-{age}"
        old.mkdir(parents=True)
        (old / "function.nbi").touch()
        os.utime(old, (1e9 - age, 1e9 - age))
    current = kernel_folder(small / "caller.py")
    assert current is not None
    left = {folder.name for folder in (small / "__pycache__").iterdir()}
    assert left == {current.name, "kernels-0", "kernels-1", "kernels-2", "kernels-3"}


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
    assert not [name for name, text in sources.items() if "njit" in text and name != "fe_ste.tools.compilation"]
    others = {name for name, text in sources.items() if "fe_ste.tools.compilation" not in text}
    frozen = {name: list(foreign_names(text, others)) for name, text in with_kernels.items()}
    assert {name: names for name, names in frozen.items() if names} == {}


AHEAD = """
import subprocess, sys
import fe_ste.tools.compilation as compilation
from small.caller import value
begun = []
class Recorded(subprocess.Popen):
    def __init__(self, *given, **named):
        super().__init__(*given, **named)
        begun.append(self)
subprocess.Popen = Recorded
compilation.second_core_is_free = lambda: {free}
{first}
compilation.compile_ahead(value, 1.0)
print(value(1.0), [one.returncode == 0 for one in begun], sum(value.stats.cache_hits.values()))
"""


def ahead(small: Path, first: str = "", free: bool = True) -> str:
    """Value, whether processes beside it succeeded, and kernels found, of a process that has one compiled ahead."""
    path = os.pathsep.join(map(str, [small.parent, ROOT]))
    outcome = subprocess.run(
        [sys.executable, "-P", "-c", AHEAD.format(first=first, free=free)],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    return outcome.stdout.strip()


@pytest.mark.validation
def test_a_kernel_is_compiled_by_another_process_once(small: Path) -> None:
    assert ahead(small) == "3.0 [True] 1"
    assert ahead(small) == "3.0 [] 1"


def test_a_process_that_cannot_compile_ahead_leaves_it_to_the_first_call(small: Path) -> None:
    assert ahead(small, first=f"sys.executable = {shutil.which('false')!r}") == "3.0 [False] 0"


@pytest.mark.validation
def test_with_one_core_nothing_is_compiled_ahead(small: Path) -> None:
    assert ahead(small, free=False) == "3.0 [] 0"
