"""Compilation of numerical loops, and the cache of their machine code between processes.

numba identifies a cached function by its own source file only, while the machine code contains the functions that it
calls, whichever file they are in. All kernels of a package are therefore cached in one folder, named by a digest of all
sources with kernels: after any change they are recompiled.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib
import logging
import os
import pickle
import shutil
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import IO, Any, TypeVar, cast

import llvmlite
import numba
from numba.core import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.runtime.nrt import rtsys

from fe_ste.tools.inner_kernels import Kernel
from fe_ste.tools.threads import second_core_is_free

Function = TypeVar("Function", bound=Callable[..., object])

#: Sums may be taken in parts: the same in every run, but not in the order that is written.
_IN_PARTS = {"reassoc", "contract", "nsz"}
_WITHOUT_MEMORY: dict[str, Any] = {"nogil": True, "error_model": "numpy", "forceinline": True, "_nrt": False}
_FOLDER = "kernels-"

#: Folders of kernels that stay beside the one in use: of branches and versions that one goes back to.
_FOLDERS_KEPT = 4

#: What the kernels of a package do, and the processor time of all that a first command compiles of them: the laws that
#: its model has.
_COMPILED = {
    "fe_ste": " of tooth contact (about 8 s)",
    "exugear": " of the equations of motion (10 to 25 s per model type)",
}

#: What a process does that compiles for this one: it finds modules where this one does.
_COMPILE = """
import pickle, sys
sys.path[:] = pickle.load(sys.stdin.buffer)
from fe_ste.tools.compilation import compile_as_asked
compile_as_asked(sys.stdin.buffer)
"""

#: numba's settings, which have no types.
_settings: Any = config
_log = logging.getLogger(__name__)
_with_kernels: set[Path] = set()
_compiled_ahead: dict[tuple[Callable[..., object], Any], subprocess.Popen[bytes]] = {}


def compiled(function: Function) -> Function:
    """Compile a function that may allocate arrays."""
    return _kept(function, nogil=True)


def summing(function: Function) -> Function:
    """Compile as `compiled`; division without checks, sums in parts, not in the order that is written."""
    return _kept(function, nogil=True, error_model="numpy", fastmath=_IN_PARTS)


def kernel(function: Function) -> Function:
    """Compile a function that allocates nothing, for loops over time; division without checks.

    Reference counts of arrays are left out (they cost ten times the arithmetic), and everything becomes one function
    (which saves handing over tuples of arrays).
    """
    return _kept(function, **_WITHOUT_MEMORY)


def summing_kernel(function: Function) -> Function:
    """Compile as `kernel`, with sums in parts, not in the order that is written."""
    return _kept(function, **_WITHOUT_MEMORY, fastmath=_IN_PARTS)


def compile_ahead(function: Callable[..., object], *given: object) -> None:
    """Compile a kernel in another process while this one works on other tasks before its first call.

    numba compiles one kernel at a time in a process. The first call waits for the other process, and compiles itself if
    that failed. Nothing is done if the kernel is already cached, if nothing is cached, or without a second core.

    Parameters
    ----------
    function : compiled function
        Defined at the top level of a module.
    given
        Arguments of the types with which it will be called.
    """
    kernel = cast(Any, function)
    if not (isinstance(function, Kernel) and isinstance(kernel._cache, _KernelCache) and second_core_is_free()):
        return
    signature = tuple(kernel.typeof_pyval(one) for one in given)
    if kernel._cache.holds(signature, kernel.targetctx) or not sys.executable or hasattr(sys, "frozen"):
        return
    process = subprocess.Popen(
        [sys.executable, "-c", _COMPILE],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    atexit.register(process.kill)
    with suppress(OSError), cast(IO[bytes], process.stdin) as request:
        request.write(pickle.dumps(sys.path) + pickle.dumps((kernel.__module__, kernel.__name__)))
        request.write(pickle.dumps(signature))
    _compiled_ahead[kernel.py_func, signature] = process


def compile_as_asked(request: IO[bytes]) -> None:
    """Compile the kernel that `compile_ahead` asks for: module and name, then types of arguments."""
    module, name = pickle.load(request)
    getattr(importlib.import_module(module), name).compile(pickle.load(request))


@cache
def kernel_folder(source: Path) -> Path | None:
    """Return the cache folder for the machine code of a source file's package; create it if necessary.

    Next to the sources, or in ``NUMBA_CACHE_DIR`` if that is set. If that folder is not writable: in the user's cache
    folder, else in a folder for temporary files that no other user can fill, because its content is executed.

    Returns
    -------
    None if there is no source to identify the version, or no writable folder: nothing is cached then
    """
    if source.is_file():
        return _folder_of(_package_of(source))
    return None


def _kept(function: Function, **options: Any) -> Function:
    """Compile with numba's options and keep the machine code."""
    if _settings.DISABLE_JIT:
        return function
    # Nobody calls these functions from C.
    made = Kernel(function, {"nopython": True, "no_cfunc_wrapper": True, **options})
    if kernel_folder(_source_of(function)):
        cast(Any, made)._cache = _KernelCache(function)  # type: ignore[no-untyped-call]
    return cast(Function, made)


def _source_of(function: Callable[..., object]) -> Path:
    return Path(function.__code__.co_filename)


class _Place:
    """Where numba looks for a function's machine code, and how it checks that it matches the sources."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return self._folder.name

    def ensure_cache_path(self) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)


class _KernelFiles(CompileResultCacheImpl):
    """Files of a function in a folder that this module chooses."""

    def __init__(self, function: Callable[..., object]) -> None:
        # In place of the base class's own, which chooses among numba's folders.
        self._lineno = function.__code__.co_firstlineno
        self._locator = _Place(cast(Path, kernel_folder(_source_of(function))))
        name = f"{function.__module__}.{function.__qualname__}-{self._lineno}"
        self._filename_base = f"{name}.py{sys.version_info[0]}{sys.version_info[1]}{getattr(sys, 'abiflags', '')}"


class _KernelCache(FunctionCache):
    """numba's cache of a function, whose errors cost a compilation and never the work."""

    _impl_class = _KernelFiles

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        kernel = self._found(sig, target_context)
        if kernel is None:
            _announce_compilation(self._py_func.__module__.partition(".")[0])
            if process := _compiled_ahead.pop((self._py_func, sig), None):
                process.wait()
                kernel = self._found(sig, target_context)
        return kernel

    def holds(self, sig: Any, target_context: Any) -> bool:
        """Return whether machine code exists for the given argument types."""
        key = self._index_key(sig, target_context.codegen())  # type: ignore[no-untyped-call]
        try:
            return key in cast(Any, self)._cache_file._load_index()
        except Exception:  # as below
            return False

    def _found(self, sig: Any, target_context: Any) -> Any:
        try:
            # numba's own way prepares to compile, too, which takes a tenth of a second that only a compilation needs.
            rtsys.initialize(target_context)
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception:  # what reading a damaged pickle raises is not bounded
            with suppress(OSError):
                self.flush()  # type: ignore[no-untyped-call]
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except OSError as error:
            _warn_not_stored(self.cache_path, error.strerror)


@cache
def _announce_compilation(package: str) -> None:
    """Say what is compiled and for how long, before the first kernel of a package is."""
    _log.info("Compiling kernels%s; once per installation or update", _COMPILED.get(package, ""))


@cache
def _warn_not_stored(folder: str, reason: str) -> None:
    _log.warning("%s: compiled kernels cannot be stored (%s); they are compiled at each start", folder, reason)


def _package_of(source: Path) -> Path:
    """Top folder of the package that a file belongs to."""
    folder = source.resolve().parent
    while (folder.parent / "__init__.py").is_file():
        folder = folder.parent
    return folder


@cache
def _folder_of(package: Path) -> Path | None:
    name = _FOLDER + _digest(package)
    _with_kernels.add(package)
    for folder in _places(package):
        with suppress(OSError):
            return _opened(folder, name)
    return None


def _digest(package: Path) -> str:
    """Digest of all sources with kernels, of a package and those before it, and of what else shapes the machine code.

    A kernel calls those of its own package and of packages that were imported before it. numba keeps the processor and
    its features apart within the folder.
    """
    compilers = numba.__version__, llvmlite.__version__
    shaping = _settings.OPT, _settings.BOUNDSCHECK, _settings.LOOP_VECTORIZE, _settings.SLP_VECTORIZE
    digest = hashlib.sha256(repr((compilers, shaping)).encode())
    for folder in sorted({package, _package_of(Path(__file__)), *_with_kernels}):
        for file in sorted(folder.rglob("*.py")):
            source = file.read_bytes()
            if __name__.encode() in source or file.name == Path(__file__).name:
                digest.update(f"\n{file.relative_to(folder)} {len(source)}\n".encode() + source)
    return digest.hexdigest()[:20]


def _places(package: Path) -> Iterator[Path]:
    """Folders to keep kernels in, the best first."""
    if _settings.CACHE_DIR:
        yield Path(_settings.CACHE_DIR) / package.name
    else:
        yield package / "__pycache__"
    import platformdirs  # seldom needed: not worth its time at each start

    user = platformdirs.user_cache_path("exugear", appauthor=False) / package.name
    if user.is_absolute() and _is_own(user):
        yield user
    if sys.platform != "win32":
        with suppress(OSError):  # no folder for temporary files
            temporary = Path(tempfile.gettempdir()) / f"exugear-{os.getuid()}"
            temporary.mkdir(mode=0o700, exist_ok=True)
            if not temporary.is_symlink() and _is_own(temporary):
                yield temporary / package.name


def _is_own(folder: Path) -> bool:
    """Return whether no other user but root can put files into a folder, or replace the folder by another."""
    if sys.platform == "win32":
        return True  # profiles are closed to other users
    for level in (folder, *folder.resolve().parents):
        try:
            status = level.stat()
        except FileNotFoundError:  # will be made by this process
            continue
        except OSError:
            return False
        open_to_all = bool(status.st_mode & stat.S_IWOTH) and not status.st_mode & stat.S_ISVTX
        if open_to_all or status.st_uid not in (0, os.getuid()):
            return False
    return True


def _opened(parent: Path, name: str) -> Path:
    """Return a folder of kernels that can be written; a new one takes the place of those not used for long."""
    folder = parent / name
    is_new = not folder.is_dir()
    folder.mkdir(parents=True, exist_ok=True)
    tempfile.TemporaryFile(dir=folder).close()
    os.utime(folder)
    if is_new:
        _prune(parent)
    return folder


def _prune(parent: Path) -> None:
    """Remove the kernel folders unused for longest; a process that still uses one recreates it."""

    def last_used(folder: Path) -> float:
        try:
            return folder.stat().st_mtime
        except FileNotFoundError:  # another process was faster
            return 0.0

    by_use = sorted(parent.glob(_FOLDER + "*"), key=last_used, reverse=True)
    for folder in by_use[1 + _FOLDERS_KEPT :]:
        shutil.rmtree(folder, ignore_errors=True)
