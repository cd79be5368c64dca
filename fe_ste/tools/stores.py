"""Storage of results: files sealed with a checksum, files by the hash of their input, and a cache for all folders.

HDF5 hangs, crashes or misreads when it is given damaged bytes, and crashes when the disk is full. So it never meets
either: content is made in memory or written through `ErrorKeeper`, and a file is opened only after its last line, the
seal, was found to fit all bytes before it. HDF5 and zip ignore what follows their own end, so that a sealed file is
plain netCDF or npz for any other program.

Two processes may compute and write one file at once. A folder that cannot be written costs nothing but time.
"""

from __future__ import annotations

import functools
import hashlib
import io
import logging
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from fe_ste.tools.display import ReprMixin
from fe_ste.tools.files import FileError, open_regular, replacement, write_all

if TYPE_CHECKING:
    import h5py
    import xarray as xr
    from _typeshed import ReadableBuffer, WriteableBuffer

# Files sealed with a checksum of their content, netCDF or npz, and read only if it fits

_SEAL = b"\nexugear sha256 "
_SEAL_LENGTH = len(_SEAL) + 65
_CHUNK = 1 << 20
SETTLED = 2.0
"""Age (s) from which the times of a file are reliable to detect changes: file clocks are coarse."""
_checked: dict[tuple[int, ...], str] = {}
"""Checksums of the files that this process found to fit, by what the system says of each."""


class VersionError(FileError):
    """A whole file of another version of the method."""


def write_sealed(path: Path, content: ReadableBuffer) -> str:
    """Write a file whole or not at all, with the checksum of its content behind it; return that."""
    checksum = hashlib.sha256(content).hexdigest()
    with replacement(path) as file:
        write_all(file, content)
        write_all(file, _seal(checksum))
    return checksum


def seal(file: IO[bytes]) -> None:
    """Add the checksum of all that an open file holds."""
    file.seek(0)
    checksum = _checksum_of(file, file.seek(0, os.SEEK_END))
    file.seek(0, os.SEEK_END)
    write_all(file, _seal(checksum))


def _seal(checksum: str) -> bytes:
    return _SEAL + checksum.encode("ascii") + b"\n"


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
    status = os.fstat(file.fileno())
    facts = status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns
    checksum = _checked.get(facts) or _checksum_of(file, length)
    if written != _seal(checksum):
        raise FileError(f"{path}: is damaged, its content does not fit its checksum")
    if time.time() - 1e-9 * max(facts[-2:]) > SETTLED:
        _checked[facts] = checksum
    return checksum


@contextmanager
def open_sealed(path: Path) -> Iterator[tuple[IO[bytes], str]]:
    """Open a sealed file whose content matches its checksum, and return the checksum.

    The content read is the content checked: files are replaced as a whole, so an open one does not change. A file that
    this process has checked, and that is unchanged since according to the system, is not checked again: runs are large.

    Raises
    ------
    FileError
        It is missing, cannot be read, or does not fit its checksum.
    """
    with open_regular(path) as file:
        try:
            checksum = _check_seal(file, path)
        except FileError:
            raise
        except OSError as error:
            raise FileError(f"{path}: cannot be read ({error.strerror})") from error
        file.seek(0)
        yield file, checksum


class ErrorKeeper(io.RawIOBase):
    """File for HDF5 to write into: the first error is kept, and raised by `check` instead of inside HDF5.

    HDF5 cannot continue after a failed write; if it is not notified, it ends normally, and the file is discarded.

    Parameters
    ----------
    file : binary file without a buffer
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._error: OSError | None = None

    def check(self) -> None:
        """Raise the error that a writing met."""
        if self._error is not None:
            raise self._error

    def readable(self) -> bool:
        """Return that it can be read."""
        return True

    def writable(self) -> bool:
        """Return that it can be written."""
        return True

    def seekable(self) -> bool:
        """Return that it has a position."""
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
                write_all(self._file, content)
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


def write_arrays(path: Path, arrays: Mapping[str, Any], *, compressed: bool = False) -> str:
    """Write a sealed npz file of arrays by name whole or not at all; return its checksum."""
    content = io.BytesIO()
    save = np.savez_compressed if compressed else np.savez
    save(content, allow_pickle=False, **arrays)
    return write_sealed(path, content.getbuffer())


def load_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Read a sealed npz file into memory; what would run code in it is refused.

    Raises
    ------
    FileError
        It is missing, damaged, or no npz file.
    """
    with open_sealed(path) as (file, _):
        try:
            with np.load(file, allow_pickle=False) as content:
                return {name: content[name] for name in content.files}
        # As in `open_dataset`: only a file of another make comes here.
        except Exception as error:
            raise FileError(f"{path}: is not an npz file ({error})") from error


def write_dataset(path: Path, dataset: xr.Dataset) -> None:
    """Write a sealed netCDF file whole or not at all."""
    content = io.BytesIO()
    dataset.to_netcdf(content, engine="h5netcdf")
    write_sealed(path, content.getvalue())


@dataclass(frozen=True)
class Layout:
    """What a netCDF file of one kind holds."""

    kind: str
    """As text, for messages."""
    version: int
    """Version of the method whose numbers it holds, its attribute ``method_version``."""
    variables: Mapping[str, tuple[str, ...]]
    """Dimensions by variable; there may be more."""
    attributes: tuple[str, ...] = ()
    """Required attributes; others are permitted."""

    def check_dataset(self, dataset: xr.Dataset, path: Path) -> None:
        """Refuse a dataset of another kind or version, as `check` does."""
        self.check({str(name): own.dims for name, own in dataset.variables.items()}, dataset.attrs, path)

    def check(self, present: Mapping[str, tuple[Hashable, ...]], attributes: Mapping[Any, Any], path: Path) -> None:
        """Refuse a file of another kind or version, by the dimensions of its variables and its attributes.

        Raises
        ------
        FileError
            `VersionError` if it is of another version only.
        """
        for name, dimensions in self.variables.items():
            if present.get(name) != dimensions:
                raise FileError(
                    f"{path}: is not a file of {self.kind}: {name} over ({', '.join(dimensions)}) is missing"
                )
        for name in self.attributes:
            if name not in attributes:
                raise FileError(f"{path}: is not a file of {self.kind}: its attribute {name} is missing")
        version = attributes.get("method_version")
        if version != self.version:
            raise VersionError(
                f"{path}: was computed by version {version} of its method, now at {self.version}; recompute it"
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
            raise FileError(f"{path}: is not a netCDF file ({error})") from error
        with dataset:
            layout.check_dataset(dataset, path)
            yield dataset


def load_dataset(path: Path, layout: Layout, names: Sequence[str] | None = None) -> xr.Dataset:
    """Read a sealed netCDF file into memory.

    Parameters
    ----------
    names : variables; all by default

    Raises
    ------
    FileError
        As `open_dataset`, or a variable is not there.
    """
    import h5py
    import xarray as xr

    with open_sealed(path) as (file, _):
        try:
            content = h5py.File(file, "r")
            dimensions = _dimensions(content)
            attributes = _attributes(content)
        # As in `open_dataset`: only a file of another make comes here.
        except Exception as error:
            raise FileError(f"{path}: is not a netCDF file ({error})") from error
        with content:
            layout.check(dimensions, attributes, path)
            for name in names or ():
                if name not in dimensions:
                    raise FileError(f"{path}: holds no {name}")
            variables = {name: _attributes(content[name]) for name in dimensions}
            over = {dimension for name in names or () for dimension in dimensions[name]}
            coordinates = {*over}
            for of in (attributes, *variables.values()):
                coordinates.update(str(of.get("coordinates", "")).split())
            arrays = {
                name: xr.Variable(own, _values(content[name]), variables[name])
                for name, own in dimensions.items()
                if names is None or name in names or (name in coordinates and over.issuperset(own))
            }
    dataset = xr.decode_cf(xr.Dataset(arrays, attrs=attributes)).load()
    if names is None:
        return dataset
    return dataset.set_coords(coordinates.intersection(arrays))[list(names)]


# netCDF as HDF5 has it. xarray reads it as well, in eight times the time: it makes a dozen calls for every attribute

_NOT_A_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"
_OF_HDF5 = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST"}


def _dimensions(content: h5py.File) -> dict[str, tuple[str, ...]]:
    """Names of the dimensions of each variable of a netCDF file."""
    found = {}
    for name, data in content.items():
        if bytes(data.attrs.get("NAME", b"")).startswith(_NOT_A_VARIABLE):
            continue
        scales = (scale[0].name.rpartition("/")[2] for scale in data.dims)
        found[name] = (name,) if data.is_scale else tuple(scales)
    return found


def _attributes(of: h5py.File | h5py.Dataset) -> dict[str, Any]:
    """Attributes of a netCDF file or variable without those by which HDF5 knows dimensions; of one number, a number."""
    names = [name for name in of.attrs if name not in _OF_HDF5 and not name.startswith(("_Netcdf4", "_NC"))]
    found = {name: of.attrs[name] for name in names}
    return {name: value[0] if np.shape(value) == (1,) else value for name, value in found.items()}


def _values(data: h5py.Dataset) -> NDArray[Any]:
    """Values of a variable, texts as such."""
    text = data.dtype.kind == "O"
    return np.asarray(data.asstr()[...] if text else data[...], dtype=str if text else None)


# Files of what belongs to one key: arrays or a dataset, whole or absent

Arrays = dict[str, NDArray[Any]]
Content = TypeVar("Content")

_KEY = "key"
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Store:
    """File of what was computed from one input, and is computed again where the file does not serve.

    Examples
    --------
    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> store = Store(Path(folder.name) / "angles.npz", key="this input")
    >>> store.write({"angle": np.array([0.0, 0.1])})
    >>> store.read(lambda arrays: arrays["angle"].tolist())
    [0.0, 0.1]
    >>> print(Store(store.path, key="another input").read(dict))
    None
    >>> folder.cleanup()
    """

    path: Path
    """Its directory is made when something is written."""
    key: str
    """Hash of the whole input and of the version of the method. A file of another key is not read."""

    def read(self, unpack: Callable[[Arrays], Content]) -> Content | None:
        """Read what `write` wrote.

        Parameters
        ----------
        unpack : builds the value from the arrays by name. A missing or invalid array means a damaged file.

        Returns
        -------
        The result of `unpack`, or None if the file is missing, of another key, or damaged, which is logged.
        """
        try:
            arrays = load_arrays(self.path)
            if str(arrays.pop(_KEY, "")) == self.key:
                return unpack(arrays)
            return None
        except (OSError, ValueError, TypeError, LookupError, AttributeError) as error:
            self._warn_of_error(error)
            return None

    def write(self, arrays: Mapping[str, Any], *, compressed: bool = False) -> None:
        """Write arrays by name, whole or not at all.

        Raises
        ------
        OSError
            The file cannot be written.
        """
        write_arrays(self.path, {_KEY: np.array(self.key), **arrays}, compressed=compressed)

    def read_dataset(self, layout: Layout) -> xr.Dataset | None:
        """Read a dataset with the attribute ``input_hash``; None as in `read`."""
        try:
            dataset = load_dataset(self.path, layout)
        except VersionError:
            return None
        except OSError as error:
            self._warn_of_error(error)
            return None
        if dataset.attrs.get("input_hash") == self.key:
            return dataset
        return None

    def write_dataset(self, dataset: xr.Dataset) -> None:
        """Write a dataset whose attribute ``input_hash`` is the key, whole or not at all; OSError as in `write`."""
        write_dataset(self.path, dataset.assign_attrs(input_hash=self.key))

    def discard(self) -> None:
        """Remove the file: what it was kept for is done."""
        self.path.unlink(missing_ok=True)

    def _warn_of_error(self, error: Exception) -> None:
        """Log why an existing file is not read."""
        if os.path.exists(self.path):
            reason = str(error) if isinstance(error, OSError) else f"{self.path}: is damaged ({error!r})"
            _log.warning("%s; it is computed again", reason)


# What is computed once for all results folders: kept in memory, and in files for the next process

#: Environment variable: another folder for what is kept, or "off" for none.
FOLDER_VARIABLE = "EXUGEAR_FLANKS"

Value = TypeVar("Value")


class Cache(ReprMixin, Generic[Value]):
    """Cache of values by key; those unused for longest are removed.

    Parameters
    ----------
    name : of a value, in one word: files are ``<name>-<key>.npz`` in `kept_folder`
    in_memory : values that are kept in memory
    in_files : bytes that are kept in files

    Examples
    --------
    >>> squares = Cache[int]("square", in_memory=2, in_files=1000)
    >>> squares
    <Cache: 0 of square in memory>
    """

    def __init__(self, name: str, *, in_memory: int, in_files: int) -> None:
        self.in_files = in_files
        self._name, self._in_memory = name, in_memory
        self._values: OrderedDict[str, Value] = OrderedDict()
        self._lock = threading.Lock()

    def _line(self) -> str:
        return f": {len(self._values)} of {self._name} in memory"

    def get(self, key: str, unpack: Callable[[Arrays], Value]) -> Value | None:
        """Value of a key from memory or from its file, as `fe_ste.tools.stores.Store.read` does; None without."""
        with self._lock:
            value = self._values.get(key)
        if value is None and (store := self._store(key)):
            value = store.read(unpack)
            with suppress(OSError):
                os.utime(store.path)  # when it was used last
        if value is not None:
            self._remember(key, value)
        return value

    def keep(self, key: str, value: Value, arrays: Mapping[str, Any]) -> None:
        """Keep a value in memory, and its arrays in a file; log if the file cannot be written."""
        self._remember(key, value)
        if store := self._store(key):
            try:
                store.write(arrays)
                self._remove_oldest(store.path.parent)
            except OSError as error:
                _warn_not_stored(self._name, str(store.path.parent), str(error.strerror))

    def forget(self) -> None:
        """Drop all values from memory."""
        with self._lock:
            self._values.clear()

    def _store(self, key: str) -> Store | None:
        folder = kept_folder()
        if folder is None:
            return None
        return Store(folder / f"{self._name}-{key}.npz", key)

    def _remember(self, key: str, value: Value) -> None:
        with self._lock:
            self._values[key] = value
            self._values.move_to_end(key)
            while len(self._values) > self._in_memory:
                self._values.popitem(last=False)

    def _remove_oldest(self, folder: Path) -> None:
        """Remove the files unused for longest above the size limit; another process may do so, too."""
        files = []
        for entry in os.scandir(folder):
            if entry.name.startswith(f"{self._name}-") and entry.name.endswith(".npz"):
                with suppress(OSError):
                    status = entry.stat()
                    files.append((status.st_mtime, status.st_size, entry.path))
        total = 0
        for _, size, path in sorted(files, reverse=True):
            total += size
            if total > self.in_files:
                with suppress(OSError):
                    os.unlink(path)


@functools.cache
def _warn_not_stored(name: str, folder: str, reason: str) -> None:
    _log.warning("%s: each %s cannot be stored (%s); the next process recomputes it", folder, name, reason)


def kept_folder() -> Path | None:
    """Folder of what is computed once and kept for all results folders; None where nothing is to be kept."""
    asked = os.environ.get(FOLDER_VARIABLE, "")
    if asked:
        if asked == "off":
            return None
        return Path(asked)
    import platformdirs  # needed for a table only: not worth its time at each start

    user = platformdirs.user_cache_path("exugear", appauthor=False)
    return user / "flanks" if user.is_absolute() else None  # a user without a home has none
