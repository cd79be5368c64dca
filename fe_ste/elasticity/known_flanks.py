"""Flanks computed once: both flanks of a gear from one, kept in memory and in files for the next process.

A file is named by a hash of all that its numbers follow from: the gear but for its name, the mesh, and the sources of
the method. One that is missing or damaged is computed again; two processes may compute and write one at once.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import io
import json
import logging
import os
import threading
import zipfile
from collections import OrderedDict
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from fe_ste.elasticity.flank import TOOTH_REACH, FlankCompliance, flank_compliance
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear
from fe_ste.tools.files import kept_folder
from fe_ste.tools.sealed import read_sealed, write_sealed
from fe_ste.tools.threads import one_dense_thread, side_by_side

#: Flanks kept in memory, and bytes of files; of the default mesh each takes 5 MB.
_IN_MEMORY = 16
_BYTES = 300_000_000

#: Rooms whose sources make the numbers.
_ROOMS = ("tools", "geometry", "elimination", "elasticity")

_log = logging.getLogger(__name__)
_memory: OrderedDict[str, FlankCompliance] = OrderedDict()
_memory_lock = threading.Lock()


def known_flanks(
    wanted: Sequence[tuple[Gear, int]],
    settings: MeshSettings | None = None,
    *,
    open_teeth: int | None = None,
    tooth_reach: int = TOOTH_REACH,
    incompatible_modes: bool = True,
) -> list[FlankCompliance]:
    """Return flanks as `fe_ste.elasticity.flank.flank_compliance` does, each gear computed at most once.

    Files are kept in the folder ``flanks`` of exugear's user cache, those used least lately removed, or in the folder
    that ``EXUGEAR_FLANKS`` names; ``EXUGEAR_FLANKS=off`` neither reads nor writes any. Gears that have to be computed
    are so two at a time.

    Parameters
    ----------
    wanted : sequence of (Gear, int)
        Gears and sides: +1 counter-clockwise, -1 clockwise.
    settings : MeshSettings, optional
    open_teeth : int, optional
    tooth_reach : int
    incompatible_modes : bool
        As in `fe_ste.elasticity.flank.flank_compliance`, all three.

    Raises
    ------
    ValueError
        As in `fe_ste.elasticity.flank.flank_compliance`.
    """
    options: dict[str, Any] = {
        "open_teeth": open_teeth,
        "tooth_reach": tooth_reach,
        "incompatible_modes": incompatible_modes,
    }
    settings = settings or MeshSettings()
    keys = [_key(gear, settings, options) for gear, _ in wanted]
    gears: dict[str, Gear] = {}
    for key, (gear, _) in zip(keys, wanted, strict=True):
        gears.setdefault(key, gear)

    flanks = {key: flank for key, gear in gears.items() if (flank := _known(key, gear))}
    missing = [key for key in gears if key not in flanks]
    with one_dense_thread():
        computed = side_by_side(lambda key: flank_compliance(gears[key], 1, settings, **options), missing)
    for key, flank in zip(missing, computed, strict=True):
        flanks[key] = flank
        _keep(key, flank)
    return [
        dataclasses.replace(flanks[key] if side > 0 else flanks[key].turned(), gear=gear)
        for key, (gear, side) in zip(keys, wanted, strict=True)
    ]


def forget_flanks() -> None:
    """Drop all flanks from memory."""
    with _memory_lock:
        _memory.clear()


def _key(gear: Gear, settings: MeshSettings, options: dict[str, Any]) -> str:
    known_by = dataclasses.asdict(gear)
    del known_by["name"]
    given = {"gear": known_by, "mesh": dataclasses.asdict(settings), "options": options, "method": _method()}
    return hashlib.sha256(json.dumps(given, sort_keys=True).encode()).hexdigest()


@functools.cache
def _method() -> str:
    """Digest of the sources that make the numbers: no version has to be kept in mind."""
    digest, package = hashlib.sha256(), Path(__file__).parents[1]
    for source in sorted(file for room in _ROOMS for file in (package / room).rglob("*.py")):
        content = source.read_bytes()
        digest.update(f"{source.relative_to(package)} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _known(key: str, gear: Gear) -> FlankCompliance | None:
    """Flank from memory or from its file."""
    with _memory_lock:
        flank = _memory.get(key)
    if flank is None and (path := _path(key)):
        flank = _read(path, gear)
    if flank is not None:
        _remember(key, flank)
    return flank


def _keep(key: str, flank: FlankCompliance) -> None:
    _remember(key, flank)
    if path := _path(key):
        _write(path, flank)


def _remember(key: str, flank: FlankCompliance) -> None:
    with _memory_lock:
        _memory[key] = flank
        _memory.move_to_end(key)
        while len(_memory) > _IN_MEMORY:
            _memory.popitem(last=False)


def _path(key: str) -> Path | None:
    """File of a flank, or None where none is kept."""
    folder = kept_folder()
    return None if folder is None else folder / f"flank-{key}.npz"


def _read(path: Path, gear: Gear) -> FlankCompliance | None:
    """Flank of a file, or None if there is none that can be used."""
    try:
        with np.load(io.BytesIO(read_sealed(path)), allow_pickle=False) as content:
            stored: dict[str, Any] = json.loads(str(content["values"]))
            names = [tuple(name) for name in stored.pop("regular")]
            regular = dict(zip(names, content["regular"], strict=True))
            stored |= {name: content[name] for name in content.files if name not in ("values", "regular")}
            flank = FlankCompliance(gear=gear, regular=regular, **stored)
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        if path.exists():  # else nothing was kept so far
            _log.warning("%s; it is computed again", error)
        return None
    with suppress(OSError):
        os.utime(path)  # the files used least lately go first
    return flank


def _write(path: Path, flank: FlankCompliance) -> None:
    values: dict[str, Any] = {"regular": list(flank.regular)}
    arrays: dict[str, Any] = {"regular": np.stack(list(flank.regular.values()))}
    for field in dataclasses.fields(flank):
        value = getattr(flank, field.name)
        if isinstance(value, np.ndarray):
            arrays[field.name] = value
        elif field.name not in ("gear", "regular"):
            values[field.name] = value
    content = io.BytesIO()
    np.savez(content, values=np.array(json.dumps(values)), **arrays)
    try:
        write_sealed(path, content.getvalue())
        _prune(path.parent)
    except OSError as error:
        _tell_unkept(str(path.parent), str(error.strerror))


def _prune(folder: Path) -> None:
    """Remove the files used least lately beyond the bound; another process may do so, too."""
    files = []
    for path in folder.glob("flank-*.npz"):
        with suppress(OSError):
            status = path.stat()
            files.append((status.st_mtime, status.st_size, path))
    total = 0
    for _, size, path in sorted(files, reverse=True):
        total += size
        if total > _BYTES:
            with suppress(OSError):
                path.unlink()


@functools.cache
def _tell_unkept(folder: str, reason: str) -> None:
    _log.warning("%s: computed flanks cannot be kept (%s); the next process computes them again", folder, reason)
