"""Print the installed size of the program and of what each extra adds, from the packages of this environment.

    python packaging/installed_size.py

Sizes are those of all files that an installer noted, compiled Python files among them; on Linux, x86-64.
"""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

EXTRAS = ("fast", "pictures", "mesh", "cluster", "mdf")


def required(distributed: Distribution, extras: Iterable[str] = ("",)) -> list[Requirement]:
    """Return what a distribution requires on this machine with some extras; the empty name stands for none."""
    every = [Requirement(text) for text in distributed.requires or ()]
    return [one for one in every if one.marker is None or any(one.marker.evaluate({"extra": name}) for name in extras)]


def closure(wanted: Iterable[Requirement]) -> set[str]:
    """Return the names of all packages that requirements bring.

    Raises
    ------
    PackageNotFoundError
        One of them is not installed.
    """
    found: set[tuple[str, str]] = set()
    rest = list(wanted)
    while rest:
        one = rest.pop()
        for extra in ("", *one.extras):
            key = canonicalize_name(one.name), extra
            if key not in found:
                found.add(key)
                rest += required(distribution(one.name), (extra,))
    return {name for name, _ in found}


def megabytes(names: Iterable[str]) -> float:
    """Return the size of the files of some packages, MB."""
    files = (file for name in names for file in distribution(name).files or ())
    paths = (Path(str(file.locate())) for file in files)
    return sum(path.stat().st_size for path in paths if path.is_file()) / 1e6


def main() -> None:
    """Print the sizes, a line each."""
    own = distribution("exugear")
    base = closure(required(own))
    largest = sorted(base, key=lambda name: megabytes([name]), reverse=True)[:3]
    print(f"exugear without extras: {megabytes(base):.0f} MB, {len(base)} packages; the largest: {', '.join(largest)}")
    for extra in EXTRAS:
        try:
            added = closure(one for one in required(own, (extra,)) if one not in required(own)) - base
            print(f"{extra}: {megabytes(added):.0f} MB, {len(added)} packages")
        except PackageNotFoundError as error:
            print(f"{extra}: {error.name} is not installed")


if __name__ == "__main__":
    main()
