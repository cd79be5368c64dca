"""Files named in a gearbox file, which may be untrusted: permitted folders, size, and permission to run.

A gearbox file names solids, measured flanks and torque series. Reading one must not hang, exhaust the memory or access
files unrelated to the gearbox, and its content must not be executed.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

LARGEST_CASE = 10_000_000
"""Maximum size of a gearbox file, bytes."""
LARGEST_TABLE = 100_000_000
"""Maximum size of a table of numbers (measured flank, torque series), bytes."""
LARGEST_MATRICES = 500_000_000
"""Maximum size of a file of matrices, bytes; those of the largest permitted bodies have 230 MB as a table."""
LARGEST_SOLID = 1_000_000_000
"""Maximum size of a solid, bytes."""


class NamedFileError(ValueError):
    """A file that is refused; the message states the reason and the remedy."""


@dataclass(frozen=True)
class Permissions:
    """Permissions of a gearbox file beyond reading files below its own folder."""

    scripts: bool = False
    """Whether gmsh scripts that it names may run; they have all rights of the user."""
    below: Path | None = None
    """Another folder whose files it may name."""


NOTHING_MORE = Permissions()
"""Permissions of a gearbox file unless the user grants more."""


def check_regular(path: Path, largest: int) -> None:
    """Raise an error unless a path is a regular file of at most `largest` bytes; the file is not read.

    Raises
    ------
    NamedFileError
        The path does not exist, is a folder, a pipe or a device, or has more than `largest` bytes.

    Examples
    --------
    >>> check_regular(Path("cases"), LARGEST_CASE)
    Traceback (most recent call last):
    ...
    exugear.gearbox.named_files.NamedFileError: a folder; a regular file is required
    """
    try:
        if not path.exists():
            raise NamedFileError("no such file")
        if not path.is_file():
            raise NamedFileError(f"{'a folder' if path.is_dir() else 'a pipe or device'}; a regular file is required")
        size = path.stat().st_size
    except OSError as error:
        raise NamedFileError(f"cannot be read ({error.strerror})") from None
    if size > largest:
        raise NamedFileError(f"{1e-6 * size:.0f} MB; at most {1e-6 * largest:.0f} MB are read")


def named_file(name: str, folder: Path, permissions: Permissions, largest: int) -> Path:
    """Path of a file of at most `largest` bytes that a gearbox file in `folder` names, if it may be read.

    Symbolic links are resolved first.

    Raises
    ------
    NamedFileError
        The file is outside the permitted folders, or `check_regular` refuses it.

    Examples
    --------
    >>> named_file("/etc/hostname", Path("cases"), NOTHING_MORE, LARGEST_TABLE)
    Traceback (most recent call last):
    ...
    exugear.gearbox.named_files.NamedFileError: is outside the folder of the gearbox file; move it there, or ...
    """
    path = folder / name
    try:
        permitted = [parent.resolve() for parent in (folder, permissions.below) if parent is not None]
        real_path = path.resolve()
    except (OSError, RuntimeError, ValueError):  # a name too long, circular links, a name with a zero byte
        raise NamedFileError("no such file") from None
    if not any(real_path.is_relative_to(parent) for parent in permitted):
        raise NamedFileError(
            "is outside the folder of the gearbox file; move it there, or permit its folder by --allow-dir DIR or "
            "EXUGEAR_ALLOW_DIR"
        )
    check_regular(path, largest)
    return path
