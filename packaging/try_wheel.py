"""Install the wheel into a fresh environment and use it away from the sources, on this Python or on each it is for.

Names the versions that are not tried. Ends with 1 if any that is tried fails, or none is.

    python packaging/try_wheel.py dist/exugear-*.whl [--all] [--constraint requirements.lock] [--hour PAGE]

With `--hour` these are the commands of a user's first hour, and the page gets a table of what each takes.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

VERSIONS = ("3.11", "3.12", "3.13")
LONGEST = 1800
"""Seconds that one step may take."""
GRC = "share/exugear/cases/grc750/gearbox.toml"
FIRST_HOUR = (
    "new first.toml --kind parallel",
    "check first.toml",
    "ste first.toml",
    "modes first.toml",
    "steady first.toml",
    "run first.toml",
    "report results/work --levers",
)
"""Commands of the first hour in an empty folder; all but the first two write into `results/work`."""
TABLE = re.compile(r"(<!-- written by packaging/try_wheel.py -->\n).*?(<!-- end of the table -->)", re.DOTALL)


def interpreters(every: bool) -> dict[str, str]:
    """Path of a Python of each version that runs, by version; of this program's version alone unless `every`."""
    found: dict[str, str] = {}
    if not every:
        return {f"{sys.version_info[0]}.{sys.version_info[1]}": sys.executable}
    for version in VERSIONS:
        for candidate in _candidates(version):
            told = subprocess.run(
                [candidate, "-c", "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2])"],
                capture_output=True,
                text=True,
                check=False,
            )
            if told.returncode == 0 and told.stdout.strip() == version:
                found[version] = candidate
                break
    return found


def _candidates(version: str) -> Iterator[str]:
    if sys.version_info[:2] == tuple(map(int, version.split("."))):
        yield sys.executable
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    yield from (str(path) for path in sorted(pyenv.glob(f"{version}.*/bin/python")))
    for folder in os.environ.get("PATH", "").split(os.pathsep):
        path = shutil.which(f"python{version}", path=folder)
        if path:
            yield path


def try_wheel(python: str, wheel: Path, constraint: Path | None) -> None:
    """Install a wheel and run the verbs that a new user begins with.

    Raises
    ------
    subprocess.CalledProcessError, AssertionError
        What does not work.
    """
    with tempfile.TemporaryDirectory() as scratch:
        home = Path(scratch)
        own = installed(home, python, wheel, constraint)
        exugear = own / "exugear"
        where = run(home, own / "python", "-c", "import exugear, fe_ste; print(exugear.__file__, fe_ste.__file__)")
        assert all(Path(path).is_relative_to(home.resolve()) for path in where.split()), where
        for package in ("exugear", "fe_ste"):
            marker = (
                f"import {package}, pathlib; assert (pathlib.Path({package}.__file__).parent / 'py.typed').exists()"
            )
            run(home, own / "python", "-c", marker)
        run(home, exugear, "--version")
        run(home, exugear, "schema", "--out", "schema.json")
        for kind in ("pair", "planetary"):
            run(home, exugear, "new", f"{kind}.toml", "--kind", kind)
            run(home, exugear, "check", f"{kind}.toml")
        run(home, exugear, "ste", "pair.toml", "--positions", "8", "--out", "results")
        run(home, exugear, "check", home / "env" / GRC)


def installed(home: Path, python: str, wheel: Path, constraint: Path | None, extras: str = "") -> Path:
    """Install a wheel, with extras such as ``[all]``, into a fresh environment; return the folder of its programs."""
    run(home, python, "-m", "venv", "env")
    own = home / "env" / ("Scripts" if os.name == "nt" else "bin")
    limits = ["--constraint", str(constraint.resolve())] if constraint else []
    what = f"{wheel.resolve()}{extras}"
    run(home, own / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check", *limits, what)
    return own


def first_hour(python: str, wheel: Path, constraint: Path | None) -> dict[str, float]:
    """Wall time of the installation and of each command of the first hour, s."""
    with tempfile.TemporaryDirectory() as scratch:
        home = Path(scratch)
        begin = time.perf_counter()
        own = installed(home, python, wheel, constraint, "[all]")
        found = {"installation with the extra `all`": time.perf_counter() - begin}
        work = home / "work"
        work.mkdir()
        for command in FIRST_HOUR:
            begin = time.perf_counter()
            run(work, own / "exugear", *command.split())
            found[f"`exugear {command}`"] = time.perf_counter() - begin
        assert (work / "results" / "work" / "report.html").is_file()
    return found


def write_hours(page: Path, hours: dict[str, dict[str, float]]) -> None:
    """Write times by version and step into the table of a page."""
    steps = list(next(iter(hours.values())))
    rows = [f"| {time.strftime('%Y-%m-%d')}, wall time in s | {' | '.join(hours)} |", "| --- " * (1 + len(hours)) + "|"]
    rows += [f"| {step} | {' | '.join(f'{own[step]:.1f}' for own in hours.values())} |" for step in steps]
    text, count = TABLE.subn(
        lambda found: found[1] + "\n".join(rows) + "\n" + found[2], page.read_text(encoding="utf-8")
    )
    assert count == 1, f"{page} has no place for the table"
    page.write_text(text, encoding="utf-8")


def run(folder: Path, *command: str | Path) -> str:
    """Run a command in a folder and return what it says; what it says of a failure is printed."""
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTHONHOME")}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=LONGEST,
        check=False,
    )
    if done.returncode:
        print(f"FAILED ({done.returncode}): {' '.join(map(str, command))}\n{done.stdout}{done.stderr}", file=sys.stderr)
        raise subprocess.CalledProcessError(done.returncode, command)
    return done.stdout


def _processor_time() -> float:
    """Processor time of all that was run, s: wall time would count what others do on the machine."""
    times = os.times()
    return times.children_user + times.children_system


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="Try a wheel on this Python, or on every one that it is for.")
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--all", action="store_true", help="on every Python that it is for, as far as they are found")
    parser.add_argument("--constraint", type=Path)
    parser.add_argument("--hour", type=Path, metavar="PAGE", help="time a first hour, and write it into a page")
    given = parser.parse_args()
    found, failed = interpreters(given.all), []
    hours = {}
    for version, python in found.items():
        begin = _processor_time()
        try:
            if given.hour:
                hours[f"Python {version}"] = first_hour(python, given.wheel, given.constraint)
            else:
                try_wheel(python, given.wheel, given.constraint)
        except (subprocess.SubprocessError, AssertionError) as error:
            failed.append(version)
            print(f"Python {version} ({python}): FAILED: {error}", flush=True)
        else:
            spent = _processor_time() - begin
            print(f"Python {version} ({python}): works, {spent:.0f} s of processor time", flush=True)
    if hours:
        write_hours(given.hour, hours)
    for version in VERSIONS:
        if given.all and version not in found:
            print(f"*** Python {version} IS MISSING HERE: the wheel was NOT tried on it ***", flush=True)
    return 1 if failed or not found else 0


if __name__ == "__main__":
    sys.exit(main())
