"""Install the wheel into a fresh environment and use it away from the sources, on this Python or on each it is for.

Names the versions that are not tried. Ends with 1 if any that is tried fails, or none is.

    python packaging/try_wheel.py dist/exugear-*.whl [--all] [--constraint requirements.lock]
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

VERSIONS = ("3.11", "3.12", "3.13")
LONGEST = 1800
"""Seconds that one step may take."""
GRC = "share/exugear/cases/grc750/gearbox.toml"


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
        run(home, python, "-m", "venv", "env")
        own = home / "env" / ("Scripts" if os.name == "nt" else "bin")
        limits = ["--constraint", str(constraint.resolve())] if constraint else []
        run(home, own / "python", "-m", "pip", "install", "-q", "--disable-pip-version-check", *limits, wheel.resolve())
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
    given = parser.parse_args()
    found, failed = interpreters(given.all), []
    for version, python in found.items():
        begin = _processor_time()
        try:
            try_wheel(python, given.wheel, given.constraint)
        except (subprocess.SubprocessError, AssertionError) as error:
            failed.append(version)
            print(f"Python {version} ({python}): FAILED: {error}", flush=True)
        else:
            spent = _processor_time() - begin
            print(f"Python {version} ({python}): works, {spent:.0f} s of processor time", flush=True)
    for version in VERSIONS:
        if given.all and version not in found:
            print(f"*** Python {version} IS MISSING HERE: the wheel was NOT tried on it ***", flush=True)
    return 1 if failed or not found else 0


if __name__ == "__main__":
    sys.exit(main())
