"""The code keeps to its tables of modules: rooms, who imports whom, sizes; and what a quick start leaves unloaded."""

from __future__ import annotations

import ast
import re
import statistics
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("fe_ste", "exugear")
EXUDYN_ROOM = "exugear.transient.exudyn_model"
MOST_MODULES = 12
MOST_LINES = 600
MEDIAN_LINES = 250
MOST_LINES_OF_A_FUNCTION = 60
MEDIAN_LINES_OF_A_FUNCTION = 8

ROOM = re.compile(r"^### ([\w.]+)$(.*?)(?=^#{2,3} |\Z)", re.MULTILINE | re.DOTALL)
ROW = re.compile(r"^\| `(\w+)` \|[^|]*\|([^|]*)\|([^|]*)\|$", re.MULTILINE)


def room_of(module: str) -> str:
    """Room of a module; one at the top of a package is a room of its own."""
    folder = module.rpartition(".")[0]
    return module if folder in PACKAGES else folder


@cache
def documented() -> dict[str, dict[str, tuple[set[str], set[str]]]]:
    """Room -> module -> modules beside it and rooms above it that it may import, all in the order of the document."""
    text = (ROOT / "docs" / "reference" / "modules.md").read_text(encoding="utf-8")
    rooms: dict[str, dict[str, tuple[set[str], set[str]]]] = {}
    for room, section in ROOM.findall(text):
        package, _, _ = room.partition(".")
        folder = (
            room.rpartition(".")[0]
            if room.rpartition(".")[0] in PACKAGES and not (ROOT / _path(room)).is_dir()
            else room
        )
        rooms[room] = {}
        for name, beside, above in ROW.findall(section):
            modules = {f"{folder}.{other}" for other in re.findall(r"`([\w.]+)`", beside)}
            others = {_whole(other, package) for other in re.findall(r"`([\w.]+)`", above)}
            rooms[room][f"{folder}.{name}"] = modules, others
    return rooms


def _path(dotted: str) -> Path:
    return Path(*dotted.split("."))


def _whole(room: str, package: str) -> str:
    """Name of a room with its package, which the document leaves out where it is the reader's own."""
    return room if room.split(".")[0] in PACKAGES else f"{package}.{room}"


def modules_on_disk() -> dict[str, Path]:
    """Module -> file, without the packages' own __init__."""
    files = (file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py")) if file.stem != "__init__")
    return {".".join(file.relative_to(ROOT).with_suffix("").parts): file for file in files}


@cache
def tree_of(file: Path) -> ast.Module:
    """Syntax tree of a file."""
    return ast.parse(file.read_text(encoding="utf-8"))


def imported(file: Path) -> set[str]:
    """Dotted names that a file imports anywhere, those for type checkers included."""
    names = set()
    for node in ast.walk(tree_of(file)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def lines_of_functions(file: Path) -> list[int]:
    """Lines of each function's body, its docstring left out."""
    counts = []
    for node in ast.walk(tree_of(file)):
        if isinstance(node, ast.FunctionDef):
            body = node.body[1:] if ast.get_docstring(node) is not None else node.body
            counts.append(body[-1].end_lineno - body[0].lineno + 1 if body else 0)
    return counts


MODULES = modules_on_disk()
ROOMS = tuple(dict.fromkeys(room_of(module) for module in MODULES))


def test_every_room_and_module_stands_in_the_architecture_and_the_other_way_round():
    assert [module for modules in documented().values() for module in modules] != []
    assert {module for modules in documented().values() for module in modules} == set(MODULES)
    assert set(documented()) == set(ROOMS)


@pytest.mark.parametrize("module", MODULES)
def test_a_module_imports_what_the_architecture_says_and_it_stands_above(module):
    room = room_of(module)
    assert module in documented().get(room, {}), "docs/reference/modules.md does not list it"
    beside, rooms = documented()[room][module]
    own = {name for name in imported(MODULES[module]) if name in MODULES}
    assert {name for name in own if room_of(name) == room} == beside
    assert {room_of(name) for name in own} - {room} == rooms
    assert beside <= set(_above(documented()[room], module))
    assert rooms <= set(_above(documented(), room))


def _above(listed: dict[str, object], name: str) -> list[str]:
    return list(listed)[: list(listed).index(name)]


@pytest.mark.parametrize("module", [name for name in MODULES if name.startswith("fe_ste.")])
def test_fe_ste_never_imports_exugear(module):
    assert not {name for name in imported(MODULES[module]) if name.split(".")[0] == "exugear"}


@pytest.mark.parametrize("module", [name for name in MODULES if room_of(name) != EXUDYN_ROOM])
def test_only_one_room_knows_exudyn(module):
    assert "exudyn" not in {name.split(".")[0] for name in imported(MODULES[module])}


@pytest.mark.parametrize("module", MODULES)
def test_no_private_name_is_imported(module):
    private = re.compile(r"^(fe_ste|exugear)\..*\b_(?!_)")
    assert not [name for name in imported(MODULES[module]) if private.match(name)]


@pytest.mark.parametrize("room", ROOMS)
def test_no_room_holds_more_modules_than_a_glance_takes_in(room):
    assert sum(room_of(module) == room for module in MODULES) <= MOST_MODULES


def test_modules_and_functions_are_short():
    lines = {name: len(file.read_text(encoding="utf-8").splitlines()) for name, file in MODULES.items()}
    assert {name: count for name, count in lines.items() if count > MOST_LINES} == {}
    assert statistics.median(lines.values()) < MEDIAN_LINES
    bodies = {name: lines_of_functions(file) for name, file in MODULES.items()}
    assert {
        name: max(counts) for name, counts in bodies.items() if max(counts, default=0) > MOST_LINES_OF_A_FUNCTION
    } == {}
    assert statistics.median(count for counts in bodies.values() for count in counts) <= MEDIAN_LINES_OF_A_FUNCTION


def test_tests_mirror_the_rooms():
    folders = {
        f"{package}.{folder.name}"
        for package in PACKAGES
        for folder in (ROOT / "tests" / package).iterdir()
        if folder.is_dir() and any(folder.glob("test_*.py"))
    }
    assert folders <= {".".join(room.split(".")[:2]) for room in ROOMS}
    assert not [
        file
        for package in PACKAGES
        for file in (ROOT / "tests" / package).glob("test_*.py")
        if f"{package}.{file.stem.removeprefix('test_')}" not in ROOMS
    ]


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


@pytest.mark.validation
def test_compiled_run_loads_only_what_it_uses(tmp_path):
    run = ["run", "cases/grc750/gearbox.toml", "--variant", "rigid", "--mesh-law", "iso6336", "--duration", "0.01"]
    drawing = ("exudyn", "matplotlib", "pyvista")
    heavy = (
        *drawing,
        "xarray",
        "pandas",
        "skfem",
        "scipy.optimize",
        "scipy.interpolate",
        "scipy.signal",
        "scipy.stats",
    )
    assert "0.01 s simulated" in left_unloaded([*run, "--out", str(tmp_path)], heavy)


@pytest.mark.validation
def test_no_module_but_one_names_a_variant_as_text():
    """A new variant is a row of one table; `rigid` is the name of a mesh law, too."""
    names = {"rigid", "bushing", "flexible", "jointed"}
    homes = {"exugear.gearbox.variant", "exugear.tooth_mesh.laws.registry"}
    found = {
        module
        for module, file in MODULES.items()
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and node.value in names
    }
    assert found <= homes, sorted(found - homes)
