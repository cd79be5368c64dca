"""How numerical loops are compiled: kept on disk between processes, sums in the order written unless said."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])

WITHOUT_MEMORY: dict[str, Any] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "forceinline": True,
    "_nrt": False,
}


def compiled(function: Function) -> Function:
    """Compile a function that may allocate arrays."""
    return cast(Function, numba.njit(cache=True, nogil=True)(function))


def kernel(function: Function) -> Function:
    """Compile a function that allocates nothing, for loops over time; division without checks.

    Reference counts of arrays are left out (they cost ten times the arithmetic), and everything becomes one function
    (which saves handing over tuples of arrays).
    """
    return cast(Function, numba.njit(**WITHOUT_MEMORY)(function))


def summing_kernel(function: Function) -> Function:
    """Compile as `kernel`, with sums taken in parts: the same in every run, but not in the order that is written."""
    return cast(Function, numba.njit(**WITHOUT_MEMORY, fastmath={"reassoc", "contract", "nsz"})(function))
