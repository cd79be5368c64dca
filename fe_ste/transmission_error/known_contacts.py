"""Contacts about a state solved once: kept in memory, and in files for the next process, beside the flanks of gears.

The key is a hash of its whole input and of the versions of the method.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from fe_ste.contact.kinematics import ContactError
from fe_ste.tools.stores.cache import Cache
from fe_ste.tools.stores.store import Arrays
from fe_ste.tools.threads import one_dense_thread, side_by_side
from fe_ste.tools.versions import MEAN_CONTACT
from fe_ste.transmission_error.mean_contact import MeanContact, mean_contact
from fe_ste.transmission_error.table import TableInput

#: Each takes 4 kB.
_contacts = Cache[MeanContact]("contact", in_memory=1000, in_files=20_000_000)
_told: ContextVar[Callable[[int, int], None] | None] = ContextVar("_told", default=None)


@contextmanager
def contacts_told(progress: Callable[[int, int], None]) -> Iterator[None]:
    """Let somebody hear of contacts that are solved inside the context, however deep they are asked for.

    Parameters
    ----------
    progress
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

    Returns
    -------
    in the order asked for; why one could not be solved stands in its place
    """
    keys = [_key(one) for one in wanted]
    asked = dict(zip(keys, wanted, strict=True))
    stored = {key: _contacts.get(key, _unpacked) for key in asked}
    found: dict[str, MeanContact | ContactError] = {key: kept for key, kept in stored.items() if kept is not None}
    missing = [key for key in asked if key not in found]
    progress = _told.get()

    def solve(key: str) -> MeanContact | ContactError:
        try:
            contact = mean_contact(asked[key])
        except ContactError as error:
            return error
        _contacts.keep(key, contact, vars(contact))
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
    _contacts.forget()


def _key(wanted: TableInput) -> str:
    return hashlib.sha256(f"{MEAN_CONTACT} {wanted.hash}".encode()).hexdigest()


def _unpacked(arrays: Arrays) -> MeanContact:
    """Contact from its fields."""
    values: dict[str, Any] = {field.name: arrays[field.name] for field in dataclasses.fields(MeanContact)}
    values |= {name: float(value) for name, value in values.items() if value.ndim == 0}
    return MeanContact(**values)
