"""Files that a gearbox file names, which may come from a stranger: where they may lie, how large, and what may run.

A gearbox file names solids, measured flanks and torque series. Reading one must not hang, fill the memory or reach
for files that have nothing to do with the gearbox; and what is in it must not run.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

LARGEST_CASE = 10_000_000
"""Largest gearbox file that is read, bytes."""
LARGEST_TABLE = 100_000_000
"""Largest table of numbers (measured flank, torque series) that is read, bytes."""
LARGEST_SOLID = 1_000_000_000
"""Largest solid that is read, bytes."""


class NamedFileError(ValueError):
    """A file that is not read; the message says why and what would be right."""


@dataclass(frozen=True)
class Permissions:
    """What a gearbox file may do beyond reading files below its own folder."""

    scripts: bool = False
    """Whether gmsh scripts that it names may run; they can do all that the user can."""
    below: Path | None = None
    """A further folder whose files it may name."""


NOTHING_MORE = Permissions()
"""What a gearbox file may do unless the user permits more."""


def check_regular(path: Path, largest: int) -> None:
    """Refuse what is no regular file or has more than `largest` bytes; nothing is read.

    Raises
    ------
    NamedFileError
        Nothing there, a folder, a pipe or a device, or more than `largest` bytes.

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
    """Path of a file that a gearbox file in `folder` names, if it may be read.

    Symbolic links count as what they lead to.

    Parameters
    ----------
    name : as the gearbox file gives it
    folder : folder of the gearbox file
    largest : bytes of the largest file that is read

    Raises
    ------
    NamedFileError
        The file lies elsewhere, or as `check_regular`.

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
    except (OSError, RuntimeError, ValueError):  # a name too long, links that go in circles, a name with a zero byte
        raise NamedFileError("no such file") from None
    if not any(real_path.is_relative_to(parent) for parent in permitted):
        raise NamedFileError(
            "is outside the folder of the gearbox file; move it there, or permit its folder by --allow-dir DIR or "
            "EXUGEAR_ALLOW_DIR"
        )
    check_regular(path, largest)
    return path
