"""Tell whether two commits give the same numbers, and what each of them costs.

    python benchmarks/same_numbers.py BEFORE [AFTER]         # AFTER is HEAD; half an hour on two free cores
    python benchmarks/same_numbers.py BEFORE --short         # fewer positions of the mesh cycle, shorter runs
    python benchmarks/same_numbers.py BEFORE --only modes    # tables are always made: the rest is computed from them

Both commits are checked out into a temporary folder and driven by their command lines, each with its own case
``cases/grc750``. Everything numeric in the files that they write must be equal; the exit code is 1 if it is not. Three
things are held equal because one and the same commit would differ from itself without:

- MKL has one thread, since sums over several come in another order.
- Kernels are read from disk. A process that has just compiled them gives other last digits, so it computes again.
- The housing is meshed once, for both: gmsh optimises its elements in the order of their addresses in memory.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from comparing import compare_folders, files_below, report, summary
from reporting import duration, table
from timing import ROOT, Cost, environment, load, machine, median, say, timed

CASE = Path("cases/grc750/gearbox.toml")
VARIANTS = ("rigid", "bushing", "flexible")
PARTS = ("tables", "modes", "runs", "speed")
CHECKED_START = """
import sys
from importlib.util import find_spec
from pathlib import Path
for package in ("exugear", "fe_ste"):
    origin = find_spec(package).origin
    assert Path(origin).resolve().is_relative_to({folder!r}), f"{{origin}} is none of {folder}"
from {module} import {function}
sys.exit({function}())
"""


@dataclass(frozen=True)
class Extent:
    """How much is computed: positions of the mesh cycle, simulated seconds, rounds of the timing."""

    positions: int = 50
    grid_positions: int = 12
    run: float = 1.0
    table_run: float = 0.5
    exudyn_run: float = 0.02
    timed_run: float = 5.0
    rounds: int = 5


SHORT = Extent(positions=10, grid_positions=8, run=0.1, table_run=0.05, exudyn_run=0.002, timed_run=1.0, rounds=2)


# -- the two commits -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Checkout:
    """A commit in a folder of its own.

    Attributes
    ----------
    name : "before" or "after"
    commit : its hash
    folder : where it is checked out
    start : program that starts its command line
    """

    name: str
    commit: str
    folder: Path
    start: str

    @property
    def out(self) -> Path:
        """Folder of its results."""
        return self.folder.with_name(f"{self.name}-results")

    @property
    def kernels(self) -> Path:
        """Folder of its compiled kernels."""
        return self.folder.with_name(f"{self.name}-kernels")

    def python(self, program: str, *arguments: str, **more: str) -> str:
        """Run a program with this commit's packages; return what it prints."""
        surroundings = environment(PYTHONPATH=str(self.folder), NUMBA_CACHE_DIR=str(self.kernels), **more)
        command = [sys.executable, "-c", program, *arguments]
        outcome = subprocess.run(command, cwd=self.folder, env=surroundings, capture_output=True, text=True)
        if outcome.returncode:
            output = (outcome.stdout + outcome.stderr)[-4000:]
            raise SystemExit(f"{output}\n{self.name}: {shlex.join(arguments)} ended with {outcome.returncode}")
        return outcome.stdout

    def compute(self, subfolder: str, *arguments: str) -> None:
        """Run the command line into a folder of results; once more if that compiled kernels.

        Reduced bodies stay then: no kernel has a part in them, and they take as long as all the rest.
        """
        begin, out = time.perf_counter(), self.out / subfolder
        earlier, compiled = files_below(out), files_below(self.kernels)
        command = [*arguments, "--out", str(out)]
        self.python(self.start, *command, MKL_NUM_THREADS="1")
        if files_below(self.kernels) != compiled:
            for path in files_below(out) - earlier:
                if path.suffix == ".nc":
                    path.unlink()
            self.python(self.start, *command, MKL_NUM_THREADS="1")
        say(f"{self.name}: {shlex.join(arguments)}: {duration(time.perf_counter() - begin)}")


def git(*arguments: str, check: bool = True) -> str:
    """Run git on this repository; return what it prints."""
    command = ["git", "-C", str(ROOT), *arguments]
    return subprocess.run(command, check=check, stdout=subprocess.PIPE, text=True).stdout.strip()


@contextmanager
def checked_out(name: str, commit: str, place: Path) -> Iterator[Checkout]:
    """Check out a commit for as long as the context lasts; its packages must be those that are imported."""
    folder = place / name
    try:
        git("worktree", "add", "--quiet", "--detach", str(folder), commit)
        scripts = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
        module, function = scripts["exugear"].split(":")
        start = CHECKED_START.format(folder=str(folder), module=module, function=function)
        checkout = Checkout(name, commit, folder, start)
        for package in ("exugear", "fe_ste"):
            origin = checkout.python(f"import {package}; print({package}.__file__)").strip()
            assert Path(origin).resolve().is_relative_to(folder), f"{origin} is none of {folder}"
        yield checkout
    finally:
        git("worktree", "remove", "--force", str(folder), check=False)


def mesh_solid(geometry: Path, solid: dict[str, Any], targets: list[Path]) -> None:
    """Mesh a solid of a case by gmsh, as the program does."""
    import gmsh

    on_end = signal.getsignal(signal.SIGTERM)
    gmsh.initialize(["same_numbers", "-nopopup"], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Geometry.OCCUnionUnify", 0)
    gmsh.model.occ.importShapes(str(geometry))
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", solid["element_size_mm"])
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", solid["elements_around"])
    gmsh.model.mesh.setSize(gmsh.model.getEntities(0), solid["element_size_mm"])
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    gmsh.model.mesh.optimize("HighOrder")
    for target in targets:
        gmsh.write(str(target))
    gmsh.finalize()
    signal.signal(signal.SIGTERM, on_end)  # gmsh takes it away


def share_housing_mesh(pair: list[Checkout]) -> None:
    """Mesh the housing of the first commit, and let the cases of both name the mesh."""
    cases = [checkout.folder / CASE for checkout in pair]
    texts = [case.read_text(encoding="utf-8") for case in cases]
    solids = [tomllib.loads(text)["bodies"]["housing"]["solid"] for text in texts]
    mesh_solid(cases[0].with_name(solids[0]["file"]), solids[0], [case.with_name("housing.msh") for case in cases])
    for case, text, solid in zip(cases, texts, solids, strict=True):
        case.write_text(text.replace(f'"{solid["file"]}"', '"housing.msh"'), encoding="utf-8")


def commands(parts: set[str], extent: Extent) -> Iterator[tuple[str, list[str]]]:
    """Folders of results, and the command lines that write into them.

    The run by Exudyn lies beside the grids, because one by the compiled solver has its name beside the other tables.
    """
    case, of_table = str(CASE), ["--variant", "bushing", "--mesh-model", "table"]
    yield "static", ["ste", case, "--positions", str(extent.positions)]
    if parts != {"speed"}:
        yield "grid", ["ste", case, "--grid", "--positions", str(extent.grid_positions)]
    if "modes" in parts:
        yield from (("static", ["modes", case, "--variant", variant]) for variant in VARIANTS)
        yield "grid", ["modes", case, *of_table]
    if "runs" in parts:
        long = ["--duration", str(extent.run)]
        yield from (("static", ["run", case, "--variant", variant, *long]) for variant in VARIANTS)
        yield "grid", ["run", case, *of_table, "--duration", str(extent.table_run)]
        by_exudyn = ["--solver", "exudyn", "--duration", str(extent.exudyn_run)]
        yield "grid", ["run", case, "--variant", "bushing", *by_exudyn]


# -- speed -----------------------------------------------------------------------------------------------------------


def timed_programs(checkout: Checkout, extent: Extent) -> dict[str, list[str]]:
    """List what is timed, by its title: a program and its arguments."""
    start, case = checkout.start, str(CASE)
    bushing = [case, "--variant", "bushing", "--out", str(checkout.out / "static")]
    seconds = f"{extent.timed_run:g}"
    return {
        "exugear --help": [start, "--help"],
        "exugear check": [start, "check", case],
        f"exugear run, bushing, {seconds} s": [start, "run", *bushing, "--duration", seconds],
        "exugear modes, bushing": [start, "modes", *bushing],
        "import exugear": ["import exugear"],
        "import fe_ste": ["import fe_ste"],
    }


def cost_of(checkout: Checkout, program: list[str]) -> Cost:
    """Wall and processor time of a process of a commit."""
    begin = os.times()
    wall = timed(lambda: checkout.python(*program)).wall
    end = os.times()
    return Cost(wall, end.children_user + end.children_system - begin.children_user - begin.children_system)


def measure(pair: list[Checkout], extent: Extent) -> list[dict[str, Any]]:
    """Time both commits in turns, so that a machine that drifts hits both, after one round that does not count."""
    programs = {checkout.name: timed_programs(checkout, extent) for checkout in pair}
    rows = []
    for title in programs["before"]:
        costs: dict[str, list[Cost]] = {checkout.name: [] for checkout in pair}
        for number in range(extent.rounds + 1):
            for checkout in pair if number % 2 else pair[::-1]:
                costs[checkout.name].append(cost_of(checkout, programs[checkout.name][title]))
        rows.append({"what": title, **ratios(costs["before"][1:], costs["after"][1:])})
        say(f"speed: {title}: done")
    return rows


def ratios(before: list[Cost], after: list[Cost]) -> dict[str, Any]:
    """Medians of both commits and of the ratios within each round, with the least and the greatest ratio."""
    row: dict[str, Any] = {}
    for key in ("wall", "processor"):
        old, new = ([getattr(cost, key) for cost in costs] for costs in (before, after))
        each = [b / a for a, b in zip(old, new, strict=True)]
        row[key] = {"before_s": median(old), "after_s": median(new), "ratio": median(each)}
        row[key] |= {"least_ratio": min(each), "greatest_ratio": max(each)}
    return row


def speed_table(rows: list[dict[str, Any]]) -> str:
    """Table of the times."""
    lines = [
        [
            row["what"],
            key,
            duration(cost["before_s"]),
            duration(cost["after_s"]),
            f"{cost['ratio']:.3f} ({cost['least_ratio']:.3f} to {cost['greatest_ratio']:.3f})",
        ]
        for row in rows
        for key, cost in ((key, row[key]) for key in ("wall", "processor"))
    ]
    return table(["what", "time", "before", "after", "after / before (least to greatest)"], lines)


# -- all of it -------------------------------------------------------------------------------------------------------


def examine(pair: list[Checkout], parts: set[str], extent: Extent, tolerance: float) -> dict[str, Any]:
    """Compute, compare, time and tell."""
    if parts & {"modes", "runs"}:
        share_housing_mesh(pair)
    for checkout in pair:
        for subfolder, arguments in commands(parts, extent):
            checkout.compute(subfolder, *arguments)
    files = compare_folders(pair[0].out, pair[1].out)
    for title, comparison in files.items():
        sys.stdout.write(report(title, comparison, tolerance) + "\n")
    equal = max(comparison.greatest for comparison in files.values()) <= tolerance
    sys.stdout.write(f"{len(files)} files: {'the same numbers' if equal else 'NOT the same numbers'}\n")
    speed = measure(pair, extent) if "speed" in parts else []
    sys.stdout.write(speed_table(speed) if speed else "")
    entries = {title: summary(comparison, tolerance) for title, comparison in files.items()}
    return {"same": equal, "files": entries, "speed": speed}


def options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("before", metavar="BEFORE", help="commit to compare with")
    parser.add_argument("after", metavar="AFTER", nargs="?", default="HEAD", help="commit (default: HEAD)")
    parser.add_argument("--short", action="store_true", help="fewer positions of the mesh cycle, shorter runs")
    parser.add_argument("--only", choices=PARTS, action="append", help="this part; repeatable (default: all)")
    parser.add_argument("--tolerance", type=float, default=1e-13, help="relative difference to pass (default: 1e-13)")
    parser.add_argument("--keep", metavar="FILE", type=Path, help="write the results as JSON, too")
    return parser.parse_args()


def main() -> int:
    """Compare two commits; tell the exit code."""
    asked, at_start = options(), load()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # checkouts are removed then, too
    commits = {name: git("rev-parse", "--verify", f"{getattr(asked, name)}^{{commit}}") for name in ("before", "after")}
    with tempfile.TemporaryDirectory(prefix="same-numbers-") as folder, ExitStack() as stack:
        place = Path(folder).resolve()
        pair = [stack.enter_context(checked_out(name, commit, place)) for name, commit in commits.items()]
        found = examine(pair, set(asked.only or PARTS), SHORT if asked.short else Extent(), asked.tolerance)
    if asked.keep:
        now = datetime.now(UTC).isoformat(timespec="seconds")
        facts = {"measured": now, "load_at_start": at_start, "machine": machine(), "short": asked.short}
        facts |= {**commits, "tolerance": asked.tolerance}
        asked.keep.write_text(json.dumps({**facts, **found}, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return 0 if found["same"] else 1


if __name__ == "__main__":
    sys.exit(main())
