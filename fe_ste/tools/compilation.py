"""Compilation of numerical loops by numba, and the folder of their machine code.

numba identifies a cached function by its own source file only, while the machine code contains the functions that it
calls, whichever file they are in. All kernels are therefore cached in one folder, named by a digest of all sources with
kernels: after any change they are recompiled.
"""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import llvmlite
import numba
from numba.core import event

Function = TypeVar("Function", bound=Callable[..., object])

#: Sums may be taken in parts: the same in every run, but not in the order that is written.
_IN_PARTS = {"reassoc", "contract", "nsz"}
_WITHOUT_MEMORY: dict[str, Any] = {"nogil": True, "error_model": "numpy", "forceinline": True, "_nrt": False}
_NOT_CALLED_FROM_C: dict[str, Any] = {"no_cfunc_wrapper": True}
_ROOT = Path(__file__).parents[2]
_PACKAGES = ("fe_ste", "exugear")
_FOLDER = "kernels-"

#: Folders of kernels that stay beside the one in use: of branches and versions that one goes back to.
_FOLDERS_KEPT = 4

#: What the kernels of a package do, and the processor time of all that a first command compiles of them: the laws that
#: its model has.
_COMPILED = {
    "fe_ste": " of tooth contact (about 8 s)",
    "exugear": " of the equations of motion (10 to 30 s per model type)",
}

#: Level of optimisation of what is always inlined, from 0 to 3.
_LEVEL_OF_KERNELS = 1

#: numba's settings, which have no types.
_settings: Any = cast(Any, numba).config
_log = logging.getLogger(__name__)


def compiled(function: Function) -> Function:
    """Compile a function that may allocate arrays."""
    return _kept(function, nogil=True)


def summing(function: Function) -> Function:
    """Compile as `compiled`; division without checks, sums in parts, not in the order that is written."""
    return _kept(function, nogil=True, error_model="numpy", fastmath=_IN_PARTS)


def kernel(function: Function) -> Function:
    """Compile a function that allocates nothing, for loops over time; division without checks.

    Reference counts of arrays are left out, which cost ten times the arithmetic.
    """
    return _kept(function, **_WITHOUT_MEMORY)


def summing_kernel(function: Function) -> Function:
    """Compile as `kernel`, with sums in parts, not in the order that is written."""
    return _kept(function, **_WITHOUT_MEMORY, fastmath=_IN_PARTS)


def _kept(function: Function, **options: Any) -> Function:
    """Compile with numba's options; keep the machine code if there is a folder for it."""
    folder = kernel_folder()
    before = _settings.CACHE_DIR
    # numba chooses the folder when it is given the function; other packages keep theirs.
    _settings.CACHE_DIR = str(folder or before)
    try:
        return cast(Function, numba.njit(function, cache=folder is not None, **_NOT_CALLED_FROM_C, **options))
    finally:
        _settings.CACHE_DIR = before


@cache
def kernel_folder() -> Path | None:
    """Return the folder of the machine code, the first that can be written; None if there is none.

    Next to the sources, or in ``NUMBA_CACHE_DIR`` if that is set, else in the user's cache folder.
    """
    cast(Any, event).register("numba:compile", _Compilation())
    for place in _places():
        with suppress(OSError):
            if not _is_closed_to_others(place):
                continue
            folder = place / (_FOLDER + _digest())
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
            os.utime(folder)
            with suppress(FileNotFoundError):  # another process was faster
                by_use = sorted(place.glob(_FOLDER + "*"), key=lambda old: old.stat().st_mtime, reverse=True)
                for old in by_use[1 + _FOLDERS_KEPT :]:
                    shutil.rmtree(old, ignore_errors=True)
            return folder
    _log.warning("No folder for compiled kernels can be written; they are compiled at each start")
    return None


def remove_damaged(error: BaseException) -> Path | None:
    """Remove the folder of machine code if an error came from reading it, such as a file cut off by a loss of power.

    Returns
    -------
    the removed folder; None if the error came from elsewhere
    """
    folder = kernel_folder()
    traced = error.__traceback__
    while traced is not None and folder is not None:
        source = Path(traced.tb_frame.f_code.co_filename)
        if source.name == "caching.py" and "numba" in source.parts:
            shutil.rmtree(folder, ignore_errors=True)
            return folder
        traced = traced.tb_next
    return None


class _Compilation(event.Listener):
    """Says what is compiled and for how long, before the first kernel of a package is, and optimises kernels lightly.

    A kernel is part of each function that calls it, and the compiler optimises the whole again. To optimise all of them
    fully took a fifth of the time of a first command and made nothing faster: loops over eight numbers at once are
    written as such (`fe_ste.tools.octets`).
    """

    def __init__(self) -> None:
        self._said: set[str] = set()
        self._before: list[Any] = []

    def on_start(self, event: Any) -> None:  # noqa: D102 - numba's name
        function = event.data["dispatcher"]
        package = function.py_func.__module__.partition(".")[0]
        if package in _COMPILED and package not in self._said:
            self._said.add(package)
            _log.info("Compiling kernels%s; once per installation or update", _COMPILED[package])
        level = _settings.OPT
        self._before.append(level)  # numba compiles in one thread at a time
        if package in _COMPILED and function.targetoptions.get("forceinline"):
            _settings.OPT = type(level)(min(_LEVEL_OF_KERNELS, level))

    def on_end(self, event: Any) -> None:  # noqa: D102 - numba's name
        _settings.OPT = self._before.pop()


def _places() -> Iterator[Path]:
    if _settings.CACHE_DIR:
        yield Path(_settings.CACHE_DIR)
        return
    yield Path(__file__).parent / "__pycache__"
    import platformdirs  # seldom needed: not worth its time at each start

    yield platformdirs.user_cache_path("exugear", appauthor=False)


def _is_closed_to_others(folder: Path) -> bool:
    """Return whether no other user but root can put files into a folder, or replace it: its content is executed."""
    if sys.platform == "win32":
        return True  # profiles are closed to other users
    for level in (folder, *folder.resolve().parents):
        with suppress(FileNotFoundError):  # will be made by this process
            status = level.stat()
            open_to_all = bool(status.st_mode & stat.S_IWOTH) and not status.st_mode & stat.S_ISVTX
            if open_to_all or status.st_uid not in (0, os.getuid()):
                return False
    return True


def _digest() -> str:
    """Digest of all sources with kernels and of the compilers; numba keeps processors apart within the folder."""
    digest = hashlib.sha256(repr((numba.__version__, llvmlite.__version__, _settings.OPT)).encode())
    for file in sorted(file for package in _PACKAGES for file in (_ROOT / package).rglob("*.py")):
        source = file.read_bytes()
        if __name__.encode() in source or file == Path(__file__):
            digest.update(f"\n{file.relative_to(_ROOT)} {len(source)}\n".encode() + source)
    return digest.hexdigest()[:20]
