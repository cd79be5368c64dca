"""Files: written whole or not at all, sealed with a checksum of their content, and read only if it fits.

HDF5 hangs, crashes or misreads when it is given damaged bytes, and crashes when the disk is full. So it never meets
either: content is made in memory or written through `ErrorKeeper`, and a file is opened only after its last line, the
seal, was found to fit all bytes before it. HDF5 and zip ignore what follows their own end, so that a sealed file is
plain netCDF or npz for any other program.
"""

from __future__ import annotations

import hashlib
import io
import os
import secrets
import stat
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr
    from _typeshed import ReadableBuffer, WriteableBuffer


_SEAL = b"\nexugear sha256 "
_SEAL_LENGTH = len(_SEAL) + 65
_CHUNK = 1 << 20

#: Seconds after which an unfinished file is one that a kill left behind: no writing lasts as long.
_ABANDONED = 3600.0
_TEXT_LIMIT = 50_000_000


class FileError(OSError):
    """A file that cannot be used: missing, cut short, damaged or of another making; the message says which."""


@contextmanager
def replacement(path: Path, folder: Path | None = None) -> Iterator[IO[bytes]]:
    """Open a new file that takes the place of `path` when the context ends well; on any error nothing is left of it.

    It is never written through a link: a link of that name is replaced. Its mode is what the umask leaves. It is on the
    disk before it has its name, so that a power cut leaves the old file or the new one.

    Parameters
    ----------
    path : Path
        Its directory is made if need be.
    folder : Path, optional
        Where the file grows, in the same file system; beside its place by default.
    """
    folder = path.parent if folder is None else folder
    with _named_after(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(parents=True, exist_ok=True)
        _remove_abandoned(folder, path.name)
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


def _remove_abandoned(folder: Path, name: str) -> None:
    """Remove what kills left of earlier writings of a file."""
    for entry in os.scandir(folder):
        if entry.name.startswith(f".{name}.") and entry.name.endswith(".partial"):
            with suppress(OSError):  # another process removed it
                if time.time() - entry.stat(follow_symlinks=False).st_mtime > _ABANDONED:
                    os.unlink(entry.path)


def sync_folder(folder: Path) -> None:
    """Bring the names of a folder to the disk; Windows has no such call."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _write_all(file: IO[bytes], content: ReadableBuffer) -> None:
    left = memoryview(content)
    while left:
        left = left[file.write(left) :]


def write_file(path: Path, content: ReadableBuffer) -> None:
    """Write a file whole or not at all; see `replacement`."""
    with replacement(path) as file:
        _write_all(file, content)


def write_sealed(path: Path, content: ReadableBuffer) -> str:
    """Write a file whole or not at all, with the checksum of its content behind it; return that."""
    checksum = hashlib.sha256(content).hexdigest()
    with replacement(path) as file:
        _write_all(file, content)
        _write_all(file, _seal(checksum))
    return checksum


def seal(file: IO[bytes]) -> None:
    """Add the checksum of all that an open file holds."""
    file.seek(0)
    checksum = _checksum_of(file, file.seek(0, os.SEEK_END))
    file.seek(0, os.SEEK_END)
    _write_all(file, _seal(checksum))


def _seal(checksum: str) -> bytes:
    return _SEAL + checksum.encode("ascii") + b"\n"


def write_dataset(path: Path, dataset: xr.Dataset) -> None:
    """Write a sealed netCDF file whole or not at all."""
    content = io.BytesIO()
    dataset.to_netcdf(content, engine="h5netcdf")
    write_sealed(path, content.getvalue())


def append_line(path: Path, line: str) -> None:
    """Add a line to a text file; several processes may do so at once. A line cut short before it stays alone."""
    flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    with _named_after(path), io.FileIO(os.open(path, flags, 0o666), "r+") as file:
        _demand_regular(file.fileno(), path)
        length = file.seek(0, os.SEEK_END)
        if length:
            file.seek(length - 1)
        torn = length and file.read(1) != b"\n"
        _write_all(file, ("\n" * bool(torn) + line + "\n").encode("utf-8"))


class ErrorKeeper(io.RawIOBase):
    """File for HDF5 to write into: the first error is kept, and raised by `check` instead of inside HDF5.

    HDF5 cannot go on after a write that failed; told nothing, it ends in order, and the file is thrown away.

    Parameters
    ----------
    file : binary file without a buffer
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the error that a writing met.

        Raises
        ------
        OSError
        """
        if self._error is not None:
            raise self._error

    def readable(self) -> bool:
        """Tell that it can be read."""
        return True

    def writable(self) -> bool:
        """Tell that it can be written."""
        return True

    def seekable(self) -> bool:
        """Tell that it has a position."""
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move the position."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Return the position."""
        return self._file.tell()

    def readinto(self, buffer: WriteableBuffer) -> int:
        """Fill a buffer as far as the file reaches."""
        content = self._file.read(len(memoryview(buffer)))
        memoryview(buffer)[: len(content)] = content
        return len(content)

    def write(self, content: ReadableBuffer) -> int:
        """Write, or keep the error."""
        if self._error is None:
            try:
                _write_all(self._file, content)
            except OSError as error:
                self._error = error
        return len(memoryview(content))

    def truncate(self, size: int | None = None) -> int:
        """Set the length, or keep the error."""
        size = self._file.tell() if size is None else size
        if self._error is None:
            try:
                self._file.truncate(size)
            except OSError as error:
                self._error = error
        return size


@contextmanager
def _opened(path: Path) -> Iterator[IO[bytes]]:
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
        raise FileError(f"{path}: is no regular file")


def _checksum_of(file: IO[bytes], length: int) -> str:
    """Checksum of the first bytes of a file."""
    file.seek(0)
    checksum = hashlib.sha256()
    while length:
        chunk = file.read(min(_CHUNK, length))
        if not chunk:
            break
        checksum.update(chunk)
        length -= len(chunk)
    return checksum.hexdigest()


def _check_seal(file: IO[bytes], path: Path) -> str:
    """Return the checksum of a file if its content fits it."""
    length = file.seek(0, os.SEEK_END) - _SEAL_LENGTH
    written = b""
    if length >= 0:
        file.seek(length)
        written = file.read(_SEAL_LENGTH)
    if not (written.startswith(_SEAL) and written.endswith(b"\n")):
        raise FileError(
            f"{path}: has no checksum at its end: it was cut short, or written by an earlier version or another program"
        )
    checksum = _checksum_of(file, length)
    if written != _seal(checksum):
        raise FileError(f"{path}: is damaged, its content does not fit its checksum")
    return checksum


@contextmanager
def open_sealed(path: Path) -> Iterator[tuple[IO[bytes], str]]:
    """Open a sealed file whose content fits, and give its checksum.

    What is read is what was checked: files are replaced as a whole, so an open one does not change.

    Raises
    ------
    FileError
        It is missing, cannot be read, or does not fit its checksum.
    """
    with _opened(path) as file:
        try:
            checksum = _check_seal(file, path)
        except FileError:
            raise
        except OSError as error:
            raise FileError(f"{path}: cannot be read ({error.strerror})") from error
        file.seek(0)
        yield file, checksum


def read_sealed(path: Path) -> bytes:
    """Read the content of a sealed file, without the seal.

    Raises
    ------
    FileError
        As `open_sealed`.
    """
    with open_sealed(path) as (file, _):
        return file.read()[:-_SEAL_LENGTH]


def read_text(path: Path, limit: int = _TEXT_LIMIT) -> str:
    """Read a text of at most so many bytes; what is no UTF-8 becomes a sign for that.

    Raises
    ------
    FileError
        It is missing, cannot be read or is too large.
    """
    with _opened(path) as file:
        content = file.read(limit + 1)
    if len(content) > limit:
        raise FileError(f"{path}: is larger than {limit / 1e6:g} MB")
    return content.decode("utf-8", errors="replace")


@dataclass(frozen=True)
class Layout:
    """What a netCDF file of one kind holds.

    Attributes
    ----------
    kind : str
        In words, for messages.
    version : int
        Version of the method whose numbers it holds, its attribute ``method_version``.
    variables : mapping of str to tuple of str
        Dimensions by variable; there may be more.
    attributes : tuple of str
        Attributes that are there; there may be more.
    """

    kind: str
    version: int
    variables: Mapping[str, tuple[str, ...]]
    attributes: tuple[str, ...] = ()

    def check(self, dataset: xr.Dataset, path: Path) -> None:
        """Refuse a dataset of another kind or version.

        Raises
        ------
        FileError
        """
        for name, dimensions in self.variables.items():
            if name not in dataset.variables or dataset[name].dims != dimensions:
                raise FileError(f"{path}: holds no {self.kind}: {name} over ({', '.join(dimensions)}) is missing")
        for name in self.attributes:
            if name not in dataset.attrs:
                raise FileError(f"{path}: holds no {self.kind}: its attribute {name} is missing")
        version = dataset.attrs.get("method_version")
        if version != self.version:
            raise FileError(
                f"{path}: was computed by version {version} of its method, now at {self.version}; compute it again"
            )


@contextmanager
def open_dataset(path: Path, layout: Layout) -> Iterator[xr.Dataset]:
    """Open a sealed netCDF file; its arrays are read when they are used.

    Raises
    ------
    FileError
        It is missing, damaged, or not of this layout.
    """
    import xarray as xr

    with open_sealed(path) as (file, _):
        try:
            dataset = xr.open_dataset(file, engine="h5netcdf")
        # What the checksum fits was written whole: only a file of another make comes here, and there HDF5, h5netcdf
        # and xarray raise what they like.
        except Exception as error:
            raise FileError(f"{path}: is no netCDF file ({error})") from error
        with dataset:
            layout.check(dataset, path)
            yield dataset


def load_dataset(path: Path, layout: Layout, names: Sequence[str] | None = None) -> xr.Dataset:
    """Read a sealed netCDF file into memory.

    Parameters
    ----------
    path : Path
    layout : Layout
    names : sequence of str, optional
        Variables; all by default.

    Raises
    ------
    FileError
        As `open_dataset`, or a variable is not there.
    """
    with open_dataset(path, layout) as dataset:
        for name in names or ():
            if name not in dataset.variables:
                raise FileError(f"{path}: holds no {name}")
        return dataset.load() if names is None else dataset[list(names)].load()


@contextmanager
def exclusive(path: Path, work: str) -> Iterator[None]:
    """Hold a lock for the life of some work; it ends with the process, however that ends.

    Parameters
    ----------
    path : Path
        File of the lock, there while the work lasts; its directory is made if need be.
    work : str
        What is held, for the message.

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
        raise FileError(f"{work}: another process is at work on it; wait for its end or stop it") from None
    try:
        yield
    finally:
        with suppress(OSError):  # Windows lets go of the name only with the lock
            os.unlink(path)
        lock.release()
