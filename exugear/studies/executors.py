"""Where points are computed: in this process, in processes, on a Dask cluster, or on any executor of that protocol."""

from __future__ import annotations

import importlib
import math
import statistics
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Protocol, Self

from exugear.studies.batches import Task, Work
from exugear.studies.journal import Record
from fe_ste.tools.threads import AtOnce, available_cores
from fe_ste.tools.workers import Workers

CONNECT_SECONDS = 30.0
"""Time within which a scheduler has to answer."""


class ExecutorError(RuntimeError):
    """Workers that cannot be reached, or that were lost and cannot be replaced; what is finished is kept."""


class Submits(Protocol):
    """What a study asks of an executor."""

    def submit(self, fn: Callable[[Task, Sequence[Work]], list[Record]], /, *args: Any) -> Future[list[Record]]:
        """Schedule a call and return its future."""
        ...


@dataclass(frozen=True)
class Pool:
    """An executor at work."""

    executor: Submits
    """Object with the protocol of `concurrent.futures.Executor`."""
    workers: int
    """Batches that it computes at once."""


Opens = Callable[[], AbstractContextManager[Pool]]
"""Starts workers; called again after workers were lost."""


@contextmanager
def _here() -> Iterator[Pool]:
    yield Pool(AtOnce(), 1)


def processes(workers: int | None = None) -> Opens:
    """Worker processes; all cores by default. One is this process itself.

    Examples
    --------
    >>> with processes(1)() as pool:
    ...     pool.workers
    1
    """
    count = available_cores() if workers is None else workers

    @contextmanager
    def opened() -> Iterator[Pool]:
        with Workers(count) as executor:
            yield Pool(executor, count)

    if count == 1:
        return _here
    return opened


def dask_cluster(address: str) -> Opens:
    """Return the workers of a Dask scheduler, which see the same folders as this process.

    Parameters
    ----------
    address : such as ``tcp://10.0.0.1:8786``
    """

    @contextmanager
    def opened() -> Iterator[Pool]:
        try:
            distributed: Any = importlib.import_module("distributed")
        except ImportError:
            raise ExecutorError("--executor dask needs Dask: pip install 'exugear[cluster]'") from None
        try:
            client = distributed.Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ExecutorError(f"--scheduler {address}: no Dask scheduler answers there ({error})") from error
        with client:
            yield Pool(client.get_executor(pure=False), max(1, sum(client.nthreads().values())))

    return opened


def given(executor: Submits, workers: int | None = None) -> Opens:
    """Return an executor that somebody else starts and ends.

    Parameters
    ----------
    executor : object with the protocol of `concurrent.futures.Executor`
    workers : batches that it computes at once; the cores of this machine by default
    """
    opened_before = False

    @contextmanager
    def opened() -> Iterator[Pool]:
        nonlocal opened_before
        if opened_before:
            raise ExecutorError("the executor lost its workers; what is finished is kept, begin anew with another one")
        opened_before = True
        yield Pool(executor, available_cores() if workers is None else workers)

    return opened


class Kept:
    """Workers that stay for several calls, and are started anew only after they were lost.

    Parameters
    ----------
    opens : callable
        Starts workers.
    """

    def __init__(self, opens: Opens) -> None:
        self._opens = opens
        self._stack = ExitStack()
        self._pool: Pool | None = None

    @contextmanager
    def opened(self) -> Iterator[Pool]:
        """Lend the workers; an error of those who have them sends them away."""
        if self._pool is None:
            self._pool = self._stack.enter_context(self._opens())
        try:
            yield self._pool
        except BaseException:
            self._pool = None
            if not self._stack.__exit__(*sys.exc_info()):
                raise

    def __enter__(self) -> Self:
        """Begin without workers."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let the workers go."""
        self._pool = None
        self._stack.close()


def lost_worker(error: BaseException) -> bool:
    """Tell whether an error of a future says that its worker alone is gone; `BrokenExecutor` says that all are."""
    return isinstance(error, CancelledError) or type(error).__name__ == "KilledWorker"


class Pace:
    """How many points make a batch: some tenths of a second of work, so that little is sent and little is waited for.

    Examples
    --------
    >>> pace = Pace()
    >>> pace.count
    1
    >>> pace.learn([0.002, 0.002])
    >>> pace.count
    100
    """

    seconds = 0.5
    most = 100

    def __init__(self) -> None:
        self._took: list[float] = []

    def learn(self, seconds: Sequence[float]) -> None:
        """Take note of the seconds that points took."""
        self._took = [*self._took, *seconds][-2 * self.most :]

    @property
    def count(self) -> int:
        """Points of the next batch."""
        if not self._took:
            return 1
        usual = statistics.median(self._took)  # the first ones load libraries
        return max(1, min(self.most, math.floor(self.seconds / max(usual, 1e-9))))
