"""Files: written whole or not at all, opened only if they are regular files, and locked for the life of some work."""

from __future__ import annotations

import errno
import hashlib
import io
import os
import secrets
import stat
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


#: Seconds after which an unfinished file is one that a kill left behind: no writing lasts as long.
_ABANDONED = 3600.0
_TEXT_LIMIT = 50_000_000


class FileError(OSError):
    """A file that cannot be used: missing, cut short, damaged or of another making; the message says which."""


@contextmanager
def replacement(path: Path, folder: Path | None = None) -> Iterator[IO[bytes]]:
    """Open a new file that replaces `path` when the context ends without error; on any error it is removed.

    It is never written through a link: a link of that name is replaced. Its mode follows the umask. It is flushed to
    disk before it is renamed, so that after a power cut either the old or the new file exists. A pipe or a device of
    that name is refused, because it would be replaced by a file.

    Parameters
    ----------
    path : its directory is created if necessary
    folder : where the temporary file is written, in the same file system; by default the folder of `path`
    """
    folder = path.parent if folder is None else folder
    with _named_after(path):
        if path.exists() and not (path.is_symlink() or path.is_file() or path.is_dir()):
            raise OSError(errno.EINVAL, "is a pipe or a device", str(path))
        path.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(parents=True, exist_ok=True)
        for entry in os.scandir(folder):
            if entry.name.startswith(f".{path.name}.") and entry.name.endswith(".partial"):
                with suppress(OSError):  # another process removed it
                    if time.time() - entry.stat(follow_symlinks=False).st_mtime > _ABANDONED:
                        os.unlink(entry.path)
        growing = folder / f".{path.name}.{secrets.token_hex(4)}.partial"
        flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        handle = os.open(growing, flags, 0o666)
        try:
            with io.FileIO(handle, "r+") as file:
                yield file
                os.fsync(handle)
            os.replace(growing, path)
        except BaseException:
            with suppress(OSError):
                os.unlink(growing)
            raise
        sync_folder(path.parent)


@contextmanager
def _named_after(path: Path) -> Iterator[None]:
    """Put the path into an error of the operating system that names the unfinished file, or none."""
    try:
        yield
    except OSError as error:
        if error.errno is None or not (error.filename is None or str(error.filename).endswith(".partial")):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error


def sync_folder(folder: Path) -> None:
    """Bring the names of a folder to the disk; Windows has no such call."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_all(file: IO[bytes], content: ReadableBuffer) -> None:
    """Write all of a content: one call of an unbuffered file may take a part of it."""
    left = memoryview(content)
    while left:
        left = left[file.write(left) :]


def write_file(path: Path, content: ReadableBuffer) -> None:
    """Write a file whole or not at all; see `replacement`."""
    with replacement(path) as file:
        write_all(file, content)


def write_table(path: Path, headings: Sequence[str], rows: Iterable[Sequence[float | str]]) -> Path:
    """Write a CSV table as an atomic operation, with numbers to nine digits."""
    lines = [",".join(headings)]
    lines += [",".join(cell if isinstance(cell, str) else f"{cell:.9g}" for cell in row) for row in rows]
    write_file(path, ("\n".join(lines) + "\n").encode())
    return path


def append_line(path: Path, line: str) -> None:
    """Add a line to a text file; several processes may do so at once. A line cut short before it stays alone."""
    flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    with _named_after(path), io.FileIO(os.open(path, flags, 0o666), "r+") as file:
        _demand_regular(file.fileno(), path)
        length = file.seek(0, os.SEEK_END)
        if length:
            file.seek(length - 1)
        torn = length and file.read(1) != b"\n"
        write_all(file, ("\n" * bool(torn) + line + "\n").encode("utf-8"))


@contextmanager
def open_regular(path: Path) -> Iterator[IO[bytes]]:
    """Open a regular file; a pipe or a device is refused without waiting for it."""
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise FileError(f"{path}: no such file") from None
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        _demand_regular(handle, path)
    except FileError:
        os.close(handle)
        raise
    with os.fdopen(handle, "rb") as file:
        yield file


def _demand_regular(handle: int, path: Path) -> None:
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        raise FileError(f"{path}: is not a regular file")


def read_text(path: Path, limit: int = _TEXT_LIMIT) -> str:
    """Read a text of at most so many bytes; what is no UTF-8 becomes a sign for that.

    Raises
    ------
    FileError
        It is missing, cannot be read or is too large.
    """
    with open_regular(path) as file:
        content = file.read(limit + 1)
    if len(content) > limit:
        raise FileError(f"{path}: is larger than {limit / 1e6:g} MB")
    return content.decode("utf-8", errors="replace")


def file_digest(path: Path) -> str:
    """Compute the SHA-256 of a file, whatever its size.

    Raises
    ------
    FileError
        It is missing or cannot be read.
    """
    digest = hashlib.sha256()
    with open_regular(path) as file:
        while block := file.read(1_000_000):
            digest.update(block)
    return digest.hexdigest()


@contextmanager
def exclusive(path: Path, work: str) -> Iterator[None]:
    """Hold a lock for the life of some work; it ends with the process, however that ends.

    Parameters
    ----------
    path : file of the lock, there while the work lasts; its directory is made if need be
    work : what is held, for the message

    Raises
    ------
    FileError
        Another process holds it.
    """
    import filelock

    path.parent.mkdir(parents=True, exist_ok=True)
    lock = filelock.FileLock(path, timeout=0)
    try:
        lock.acquire()
    except filelock.Timeout:
        raise FileError(f"{work}: in use by another process; wait until it ends, or stop it") from None
    try:
        yield
    finally:
        with suppress(OSError):  # Windows lets go of the name only with the lock
            os.unlink(path)
        lock.release()
