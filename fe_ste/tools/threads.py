"""Threads of the dense linear algebra: one, because its many small factorisations do not profit from more.

OpenBLAS keeps its threads spinning between calls. On a machine whose cores others use too, or that runs several
computations side by side, that costs 10 to 80 times what a second thread could gain on matrices of a few hundred rows.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import ThreadpoolController


@contextmanager
def one_dense_thread() -> Iterator[None]:
    """Let OpenBLAS work with one thread inside the context; the sparse solver keeps its own threads.

    Examples
    --------
    >>> with one_dense_thread():
    ...     pass
    """
    with ThreadpoolController().select(internal_api="openblas").limit(limits=1):
        yield
