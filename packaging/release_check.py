"""Checks before a release: one line per check with its result and, where it is needed, what to do.

Results are `pass`, `FAIL`, `note` (a list for the owner, nothing to refuse) and `not tried` with the reason, such as a
linter that is not installed. Ends with 1 if a check fails. Linters are looked for beside this Python and on the path.

    python packaging/release_check.py [--no-build]
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import yaml
from packaging.metadata import Metadata
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
PLACEHOLDERS = ("OWNER/exugear", "MAINTAINER@EXAMPLE.ORG", "the exugear authors", "AUTHOR NAME", "DISCLOSURE BY OWNER")
"""What the owner fills in before the first release."""
TEXTS = (".md", ".cff", ".json", ".yml", ".yaml", ".toml", ".bib")
PARTS = {
    "tables": ("TABLE",),
    "nonlinear": ("NONLINEAR_TABLE",),
    "dynamics": ("RUN",),
    "elastic": ("REDUCTION", "RUN"),
    "steady": ("STEADY",),
    "studies": ("STUDY",),
}
"""Method versions that parts of the benchmarks rest on."""


@dataclass(frozen=True)
class Result:
    """Result of one check: `state` is one of pass, FAIL, note, not tried."""

    state: str
    text: str
    details: tuple[str, ...] = ()


def judged(errors: Iterable[str], good: str) -> Result:
    """Return a failure with its errors, or a pass."""
    found = tuple(errors)
    return Result("FAIL", f"{len(found)} error{'s' * (len(found) != 1)}", found) if found else Result("pass", good)


def settings_of(root: Path) -> dict:
    """Return the content of pyproject.toml."""
    return tomllib.loads(_text(root / "pyproject.toml"))


def sections(root: Path) -> dict[str, tuple[str, str]]:
    """Return date and text of each section of the changelog and of its archive, by version."""
    files = [root / "CHANGELOG.md", root / "docs" / "development" / "history.md"]
    text = "\n".join(_text(file) for file in files if file.exists())
    heads = list(re.finditer(r"^## \[?([\w.]+)\]?(?: - (\S+))?$", text, re.MULTILINE))
    ends = [head.start() for head in heads[1:]] + [len(text)]
    return {head[1]: (head[2] or "", text[head.end() : end].strip()) for head, end in zip(heads, ends, strict=True)}


def same_version(root: Path) -> Result:
    """Compare version and date of all files that state them."""
    wanted = settings_of(root)["project"]["version"]
    citation = yaml.safe_load(_text(root / "CITATION.cff"))
    metadata = json.loads(_text(root / "codemeta.json"))
    recipe = yaml.safe_load(_text(root / "packaging" / "conda" / "recipe.yaml"))
    readme = _text(root / "README.md")
    date = sections(root).get(wanted, ("", ""))[0]
    errors = [
        f"{file}: version {stated}, pyproject.toml has {wanted}"
        for file, stated in (
            ("CITATION.cff", citation["version"]),
            ("codemeta.json", metadata["version"]),
            ("packaging/conda/recipe.yaml", recipe["context"]["version"]),
        )
        if stated != wanted
    ]
    errors += [
        f"{file}: date {stated}, CHANGELOG.md has {date or 'none'}"
        for file, stated in (("CITATION.cff", citation["date-released"]), ("codemeta.json", metadata["dateModified"]))
        if str(stated) != date
    ]
    if f"exugear-{wanted}-py3-none-any.whl" not in readme:
        errors.append(f"README.md: names no wheel of {wanted}")
    return judged(errors, f"{wanted} of {date}")


def changelog(root: Path) -> Result:
    """Check that the version has a section, and that nothing is left under Unreleased on the day."""
    wanted = settings_of(root)["project"]["version"]
    date, text = sections(root).get(wanted, ("", ""))
    if not date or not text:
        return Result("FAIL", f"CHANGELOG.md has no dated section [{wanted}] with entries")
    left = len(re.findall(r"^- ", sections(root).get("Unreleased", ("", ""))[1], re.MULTILINE))
    if left:
        return Result("note", f"[{wanted}] is there; {left} entries are still under Unreleased")
    return Result("pass", f"[{wanted}] - {date}")


def known_versions(root: Path) -> Result:
    """Find versions of the program in documents that were never released."""
    known = set(sections(root)) | {settings_of(root)["project"]["version"]}
    pattern = re.compile(r"(?:\b[Vv]ersion|\bexugear)[ -](\d+\.\d+\.\d+)(?![\d.]*\d)")
    errors = []
    for file in _documents(root):
        for number, line in enumerate(_text(file).splitlines(), 1):
            for found in pattern.findall(line):
                if found not in known:
                    errors.append(f"{file.relative_to(root).as_posix()}:{number}: {found}")
    return judged(errors, f"all of {', '.join(sorted(known - {'Unreleased'}))}")


def placeholders(root: Path) -> Result:
    """List what the owner fills in."""
    found = []
    for file in _tracked(root):
        if file.suffix not in TEXTS or not file.exists() or "tests" in file.relative_to(root).parts:
            continue
        for number, line in enumerate(_text(file).splitlines(), 1):
            found += [f"{file.relative_to(root).as_posix()}:{number}: {mark}" for mark in PLACEHOLDERS if mark in line]
    if "doi" not in yaml.safe_load(_text(root / "CITATION.cff")):
        found.append("CITATION.cff: no doi")
    if "urls" not in settings_of(root)["project"]:
        found.append("pyproject.toml: no [project.urls]; packaging/build.py --url adds them to what is built")
    return Result("note", f"{len(found)} to fill in", tuple(found)) if found else Result("pass", "none left")


def pythons(root: Path) -> Result:
    """Compare the versions of Python that files state."""
    project = settings_of(root)["project"]
    stated = re.findall(r"Python :: (3\.\d+)", " ".join(project["classifiers"]))
    low = stated[0]
    high = f"3.{int(stated[-1].split('.')[1]) + 1}"
    errors = []
    if project["requires-python"] != f">={low},<{high}":
        errors.append(
            f"pyproject.toml: requires-python {project['requires-python']}, classifiers {low} to {stated[-1]}"
        )
    others = {
        "packaging/try_wheel.py": (r'"(3\.\d+)"', r"^VERSIONS = .*", stated),
        "codemeta.json": (r"3\.\d+", r'"runtimePlatform": .*', [stated[0], stated[-1]]),
        "packaging/conda/recipe.yaml": (r"3\.\d+", r"python >.*", [low, high]),
    }
    for file, (number, line, expected) in others.items():
        found = re.search(line, _text(root / file), re.MULTILINE)
        if found is None or re.findall(number, found[0]) != expected:
            errors.append(f"{file}: {found[0] if found else 'no version'}, expected {', '.join(expected)}")
    for file in sorted((root / ".github" / "workflows").glob("*.yml")):
        named = set(re.findall(r'"(3\.\d+)"', _text(file)))
        errors += [f"{file.name}: Python {other}" for other in sorted(named - set(stated))]
    return judged(errors, f"{low} to {stated[-1]}")


def bounds(root: Path) -> Result:
    """List lower and upper bounds of all dependencies beside what is installed; refuse what does not fit."""
    project = settings_of(root)["project"]
    listed, errors = [], []
    wanted = [("", text) for text in project["dependencies"]]
    wanted += [(extra, text) for extra, texts in project["optional-dependencies"].items() for text in texts]
    for extra, text in wanted:
        required = Requirement(text)
        if required.name == project["name"] or (required.marker and not required.marker.evaluate()):
            continue
        try:
            installed = version(required.name)
        except PackageNotFoundError:
            installed = "not installed"
        line = f"{required.name} {required.specifier or 'any'} [{extra or 'always'}]: {installed}"
        fits = installed != "not installed" and required.specifier.contains(installed, prereleases=True)
        if not fits and (installed != "not installed" or not extra):
            errors.append(f"{line} does not fit")
        listed.append(line)
    if errors:
        return judged(errors, "")
    upper = [line for line in listed if re.search(r"<|==|~=", line.split(":")[0])]
    return Result("note", f"{len(listed)} requirements fit, {len(upper)} have an upper bound", tuple(listed))


def measured_before(measured: str, changed: dict[str, datetime], names: Iterable[str]) -> list[str]:
    """Return the method versions that were raised after a measurement.

    Examples
    --------
    >>> changed = {"RUN": datetime.fromisoformat("2026-11-25T00:00:00+00:00")}
    >>> measured_before("2026-11-23T07:05:12+00:00", changed, ["RUN"])
    ['RUN']
    """
    return [name for name in names if name in changed and datetime.fromisoformat(measured) < changed[name]]


def version_dates(root: Path) -> dict[str, datetime]:
    """Return when each method version got its number, from the history; empty outside of a checkout."""
    dates: dict[str, datetime] = {}
    for file in ("exugear/gearbox/versions.py", "fe_ste/tools/versions.py"):
        told = _run(root, "git", "blame", "--line-porcelain", file)
        time = 0
        for line in told.stdout.splitlines() if told.returncode == 0 else ():
            if line.startswith("committer-time "):
                time = int(line.split()[1])
            elif found := re.match(r"\t([A-Z_]+) = \d+$", line):
                dates[found[1]] = datetime.fromtimestamp(time).astimezone()
    return dates


def benchmarks(root: Path) -> Result:
    """Compare the dates of benchmarks with those of the methods they measure."""
    changed = version_dates(root)
    if not changed:
        return Result("not tried", "no history: this is no checkout")
    results = json.loads(_text(root / "benchmarks" / "results.json"))
    errors = [
        f"benchmarks/results.json: {part} of {results[part]['measured'][:10]} is older than {', '.join(old)}; "
        "run make benchmarks"
        for part, names in PARTS.items()
        if part in results and (old := measured_before(results[part]["measured"], changed, names))
    ]
    return judged(errors, "newer than the methods")


def trust(root: Path) -> Result:
    """Compare the last run of the longest comparisons with the dates of the methods."""
    changed = version_dates(root)
    if not changed:
        return Result("not tried", "no history: this is no checkout")
    runs = re.findall(r"^\| (\d+ [A-Z]\w+ \d{4}), all", _text(root / "docs" / "validation" / "index.md"), re.MULTILINE)
    if not runs:
        return Result("FAIL", "docs/validation/index.md states no run of all comparisons (make validate-long)")
    last = datetime.strptime(runs[0], "%d %B %Y").replace(hour=23, minute=59).astimezone()
    old = measured_before(last.isoformat(), changed, changed)
    errors = [f"docs/validation/index.md: run of {runs[0]} is older than {', '.join(old)}; run make validate-long"]
    return judged(errors if old else (), f"run of {runs[0]}")


def workflows(root: Path) -> Result:
    """Read the files of public services, by their schemas and linters if these are installed."""
    files = sorted((root / ".github" / "workflows").glob("*.yml"))
    errors = [f"{file.name}: {error}" for file in files for error in _unreadable(file, ("name", "jobs"))]
    commands = {
        "check-jsonschema": ("--builtin-schema", "vendor.github-workflows"),
        "zizmor": ("--offline", "--no-progress", "--min-severity", "medium", "--config", "packaging/zizmor.yml"),
        "actionlint": (),
    }
    tried, missing = ["YAML"], []
    for program, options in commands.items():
        _linted(root, program, options, files, errors, tried, missing)
    if not errors and (bot := root / ".github" / "dependabot.yml").exists():
        _linted(root, "check-jsonschema", ("--builtin-schema", "vendor.dependabot"), [bot], errors, [], [])
    return judged(errors, _by(tried, missing))


def recipes(root: Path) -> Result:
    """Read the conda recipe and the container file, by their linters if these are installed."""
    recipe = root / "packaging" / "conda" / "recipe.yaml"
    container = root / "packaging" / "Containerfile"
    errors = [
        f"{recipe.name}: {error}" for error in _unreadable(recipe, ("package", "source", "requirements", "about"))
    ]
    tried, missing = ["YAML"], []
    try:
        import rattler_build
    except ImportError:
        missing.append("rattler_build")
    else:
        tried.append("rattler_build")
        try:
            rattler_build.Stage0Recipe.from_file(str(recipe)).render()
        except rattler_build.RattlerBuildError as error:
            errors.append(f"{recipe.name}: {error}")
    _linted(root, "hadolint", ("--failure-threshold", "warning"), [container], errors, tried, missing)
    return judged(errors, _by(tried, missing))


def distributions(root: Path, folder: Path) -> Result:
    """Build sdist and wheel, and compare what they hold with the tree."""
    built = _run(root, sys.executable, str(root / "packaging" / "build.py"), "--out", str(folder))
    if built.returncode:
        return Result("FAIL", "packaging/build.py failed", tuple(built.stderr.splitlines()[-10:]))
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as opened:
        in_wheel = set(opened.namelist())
        metadata = next(name for name in in_wheel if name.endswith(".dist-info/METADATA"))
        header = opened.read(metadata)
    with tarfile.open(sdist) as archive:
        in_sdist = {name.partition("/")[2] for name in archive.getnames()}
    tracked = [file.relative_to(root).as_posix() for file in _tracked(root)]
    errors = [f"wheel: {name} is missing" for name in tracked if _in_packages(name) and name not in in_wheel]
    errors += [f"sdist: {name} is missing" for name in tracked if _in_sdist(name) and name not in in_sdist]
    try:
        Metadata.from_email(header, validate=True)
    except ExceptionGroup as group:
        errors += [f"metadata: {error}" for error in group.exceptions]
    tried, missing = ["packaging"], []
    _linted(root, "twine", ("check", "--strict"), [wheel, sdist], errors, tried, missing)
    sizes = ", ".join(f"{path.name} {path.stat().st_size / 1e6:.1f} MB" for path in (wheel, sdist))
    return judged(errors, f"{sizes}; metadata {_by(tried, missing)}")


def tree(root: Path) -> Result:
    """Check that all is committed and that the tag is free."""
    told = _run(root, "git", "status", "--porcelain")
    if told.returncode:
        return Result("not tried", "this is no checkout")
    errors = [f"not committed: {line}" for line in told.stdout.splitlines()]
    tag = f"v{settings_of(root)['project']['version']}"
    if _run(root, "git", "rev-parse", "--verify", "--quiet", f"refs/tags/{tag}").returncode == 0:
        errors.append(f"the tag {tag} exists already")
    return judged(errors, f"committed; the tag {tag} is free")


CHECKS: dict[str, Callable[[Path], Result]] = {
    "version": same_version,
    "changelog": changelog,
    "versions in documents": known_versions,
    "placeholders": placeholders,
    "Python versions": pythons,
    "bounds": bounds,
    "benchmarks": benchmarks,
    "trust tables": trust,
    "workflow files": workflows,
    "recipes": recipes,
    "work tree": tree,
}
"""Checks by name, in the order of the list."""


def _linted(
    root: Path,
    program: str,
    options: Iterable[str],
    files: Iterable[Path],
    errors: list[str],
    tried: list[str],
    missing: list[str],
) -> None:
    """Run a linter if it is installed and add its errors."""
    path = shutil.which(program, path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
    if path is None:
        missing.append(program)
        return
    tried.append(program)
    told = _run(root, path, *options, *map(str, files))
    if told.returncode:
        said = (told.stdout + told.stderr).strip().splitlines()
        errors += [f"{program}: {line}" for line in said[:20]] or [f"{program} ended with {told.returncode}"]


def _by(tried: list[str], missing: list[str]) -> str:
    return f"by {', '.join(tried)}" + (f"; not tried, not installed: {', '.join(missing)}" if missing else "")


def _unreadable(file: Path, keys: Iterable[str]) -> list[str]:
    """Return why a YAML file cannot be read, or which keys it lacks."""
    try:
        content = yaml.safe_load(_text(file))
    except (OSError, yaml.YAMLError) as error:
        return [" ".join(str(error).split())]
    return [f"has no {key}" for key in keys if not isinstance(content, dict) or key not in content]


def _in_packages(name: str) -> bool:
    return name.startswith(("exugear/", "fe_ste/"))


def _in_sdist(name: str) -> bool:
    """Whether a tracked file belongs to the sdist: everything but what serves the repository alone."""
    return not name.startswith((".ci/", ".git")) or name.startswith(".github/")


def _documents(root: Path) -> list[Path]:
    made = {"elsewhere", "gallery", "api"}
    pages = [page for page in (root / "docs").rglob("*.md") if not set(page.parts) & made]
    return sorted([*pages, *root.glob("*.md"), *(root / "paper").glob("*.md")])


def _tracked(root: Path) -> list[Path]:
    """Return the files of the tree: those that git knows, or all outside of a checkout."""
    told = _run(root, "git", "ls-files", "-z")
    if told.returncode == 0 and told.stdout:
        return [root / name for name in told.stdout.split("\0") if name and (root / name).is_file()]
    return [path for path in root.rglob("*") if path.is_file()]


def _run(folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=600)
    except FileNotFoundError as error:
        return subprocess.CompletedProcess(command, 127, "", str(error))


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="Checks before a release.")
    parser.add_argument("--no-build", action="store_true", help="build no sdist and no wheel")
    given = parser.parse_args()
    results = {name: check(ROOT) for name, check in CHECKS.items()}
    if given.no_build:
        results["sdist and wheel"] = Result("not tried", "--no-build")
    else:
        with tempfile.TemporaryDirectory() as scratch:
            results["sdist and wheel"] = distributions(ROOT, Path(scratch) / "dist")
    for name, result in results.items():
        print(f"{result.state:<10} {name:<22} {result.text}")
        for line in result.details:
            print(f"{'':<11}{line}")
    failed = [name for name, result in results.items() if result.state == "FAIL"]
    print(f"\n{len(failed)} of {len(results)} checks failed{': ' * bool(failed)}{', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
