"""Libraries that are loaded when they are used: a start does not wait for what it may never need."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any


class _AtFirstUse(ModuleType):
    """Stands for a module and loads it for the first attribute that is asked for."""

    def __getattr__(self, name: str) -> Any:
        return getattr(import_module(self.__name__), name)


def lazy_import(name: str) -> Any:
    """Return a proxy of a library that loads it at first use.

    For type checkers the library is also imported under ``TYPE_CHECKING``.

    Parameters
    ----------
    name : of a module that is installed

    Examples
    --------
    >>> fractions = lazy_import("fractions")
    >>> fractions.Fraction(2, 4)
    Fraction(1, 2)
    """
    return _AtFirstUse(name)
