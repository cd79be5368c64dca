"""Contacts about a state solved once: kept in memory, and in files for the next process, beside the flanks of gears.

A file is named by a hash of its whole input and of the versions of the method. One that is missing or damaged is solved
again; two processes may solve and write one at once.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import io
import logging
import os
import threading
import zipfile
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import Any

import numpy as np

from fe_ste.contact.kinematics import ContactError
from fe_ste.tools.files import kept_folder
from fe_ste.tools.sealed import read_sealed, write_sealed
from fe_ste.tools.threads import one_dense_thread, side_by_side
from fe_ste.tools.versions import MEAN_CONTACT
from fe_ste.transmission_error.mean_contact import MeanContact, mean_contact
from fe_ste.transmission_error.table import TableInput

#: Contacts kept in memory and in files; each takes 4 kB.
_IN_MEMORY = 1000
_FILES = 5000

_log = logging.getLogger(__name__)
_told: ContextVar[Callable[[int, int], None] | None] = ContextVar("_told", default=None)
_memory: OrderedDict[str, MeanContact] = OrderedDict()
_memory_lock = threading.Lock()


@contextmanager
def contacts_told(progress: Callable[[int, int], None]) -> Iterator[None]:
    """Let somebody hear of contacts that are solved inside the context, however deep they are asked for.

    Parameters
    ----------
    progress : callable
        Called with the number of contacts that are there, and of all that have to be solved. What it raises, such as
        Ctrl-C, ends the work.
    """
    token = _told.set(progress)
    try:
        yield
    finally:
        _told.reset(token)


def known_contacts(wanted: Sequence[TableInput]) -> list[MeanContact | ContactError]:
    """Return contacts as `fe_ste.transmission_error.mean_contact.mean_contact` does, each solved at most once.

    Files are kept where `fe_ste.elasticity.known_flanks.known_flanks` keeps its own; each is written when it is solved,
    so that what is stopped goes on from there.

    Parameters
    ----------
    wanted : sequence of TableInput

    Returns
    -------
    list of MeanContact or ContactError
        In the order asked for; why one could not be solved stands in its place.
    """
    keys = [_key(one) for one in wanted]
    asked = dict(zip(keys, wanted, strict=True))
    found: dict[str, MeanContact | ContactError] = {key: kept for key in asked if (kept := _known(key)) is not None}
    missing = [key for key in asked if key not in found]
    progress = _told.get()

    def solve(key: str) -> MeanContact | ContactError:
        try:
            contact = mean_contact(asked[key])
        except ContactError as error:
            return error
        _keep(key, contact)
        return contact

    # Two at a time; between pairs of them the caller hears of it, and may end the work.
    with one_dense_thread():
        for first in range(0, len(missing), 2):
            if progress is not None:
                progress(first, len(missing))
            chosen = missing[first : first + 2]
            found |= dict(zip(chosen, side_by_side(solve, chosen), strict=True))
    if progress is not None and missing:
        progress(len(missing), len(missing))
    return [found[key] for key in keys]


def forget_contacts() -> None:
    """Drop all contacts from memory."""
    with _memory_lock:
        _memory.clear()


def _key(wanted: TableInput) -> str:
    return hashlib.sha256(f"{MEAN_CONTACT} {wanted.hash}".encode()).hexdigest()


def _known(key: str) -> MeanContact | None:
    """Contact from memory or from its file."""
    with _memory_lock:
        contact = _memory.get(key)
    if contact is None and (path := _path(key)):
        contact = _read(path)
    if contact is not None:
        _remember(key, contact)
    return contact


def _keep(key: str, contact: MeanContact) -> None:
    _remember(key, contact)
    if path := _path(key):
        _write(path, contact)


def _remember(key: str, contact: MeanContact) -> None:
    with _memory_lock:
        _memory[key] = contact
        _memory.move_to_end(key)
        while len(_memory) > _IN_MEMORY:
            _memory.popitem(last=False)


def _path(key: str) -> Path | None:
    folder = kept_folder()
    return None if folder is None else folder / f"contact-{key}.npz"


def _read(path: Path) -> MeanContact | None:
    """Contact of a file, or None if there is none that can be used."""
    try:
        with np.load(io.BytesIO(read_sealed(path)), allow_pickle=False) as content:
            stored = {field.name: content[field.name] for field in dataclasses.fields(MeanContact)}
        numbers = {name: float(values) for name, values in stored.items() if values.ndim == 0}
        contact = MeanContact(**stored | numbers)
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        if path.exists():  # else nothing was kept so far
            _log.warning("%s; it is solved again", error)
        return None
    with suppress(OSError):
        os.utime(path)  # the files used least lately go first
    return contact


def _write(path: Path, contact: MeanContact) -> None:
    content = io.BytesIO()
    arrays: dict[str, Any] = {field.name: getattr(contact, field.name) for field in dataclasses.fields(contact)}
    np.savez(content, **arrays)
    try:
        write_sealed(path, content.getvalue())
        _prune(path.parent)
    except OSError as error:
        _tell_unkept(str(path.parent), str(error.strerror))


def _prune(folder: Path) -> None:
    """Remove the files used least lately beyond the bound; another process may do so, too."""
    files = sorted(folder.glob("contact-*.npz"))
    if len(files) <= _FILES:
        return
    ages = []
    for path in files:
        with suppress(OSError):
            ages.append((path.stat().st_mtime, path))
    for _, path in sorted(ages, reverse=True)[_FILES:]:
        with suppress(OSError):
            path.unlink()


@functools.cache
def _tell_unkept(folder: str, reason: str) -> None:
    _log.warning("%s: solved contacts cannot be kept (%s); the next process solves them again", folder, reason)
