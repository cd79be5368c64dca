"""What is computed once for all results folders: kept in memory, and in files for the next process.

Two processes may compute and write one file at once. A folder that cannot be written costs nothing but time.
"""

from __future__ import annotations

import functools
import logging
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Generic, TypeVar

from fe_ste.tools.display import Displayed
from fe_ste.tools.stores.store import Arrays, Store

#: Environment variable: another folder for what is kept, or "off" for none.
FOLDER_VARIABLE = "EXUGEAR_FLANKS"

Value = TypeVar("Value")
_log = logging.getLogger(__name__)


class Cache(Displayed, Generic[Value]):
    """Values by key, those used least lately removed.

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
        """Value of a key from memory or from its file, as `fe_ste.tools.stores.store.Store.read` does; None without."""
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
        """Keep a value in memory, and its arrays in a file; the log tells where that cannot be written."""
        self._remember(key, value)
        if store := self._store(key):
            try:
                store.write(arrays)
                self._remove_oldest(store.path.parent)
            except OSError as error:
                _tell_unkept(self._name, str(store.path.parent), str(error.strerror))

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
        """Remove the files used least lately beyond the bound; another process may do so, too."""
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
def _tell_unkept(name: str, folder: str, reason: str) -> None:
    _log.warning("%s: each %s cannot be kept (%s); the next process computes it again", folder, name, reason)


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
