"""Threads: one for dense linear algebra, whose many small factorisations gain nothing from more; two in parallel.

OpenBLAS keeps its threads spinning between calls. On a machine whose cores others use too, or that runs several
computations in parallel, that costs 10 to 80 times what a second thread could gain on matrices of a few hundred rows.
Complete computations in parallel gain more than threads within each of them.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController

Item = TypeVar("Item")
Result = TypeVar("Result")
Other = TypeVar("Other")

#: Seconds after which a thread is asked to hand on Python's lock; by default 5 ms, longer than most factorisations.
_LOCK_KEPT = 2e-4

#: Held by whatever works on the second core; the first one's work holds none until it waits for the second.
_idle_core = threading.Semaphore(1)


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


def side_by_side(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Call a function for each item, two at a time; it has to let go of Python's lock to gain by it.

    One after the other where there is one core only, and in a worker process, which shares the cores with others. There
    are never more than two at a time: of calls within each other the one that finds the second core idle takes it.

    Examples
    --------
    >>> side_by_side(abs, [-1, 2])
    [1, 2]
    """
    given = list(items)
    if len(given) < 2 or not second_core_is_free():
        return [function(item) for item in given]
    results: dict[int, Result] = {}
    waiting = deque(enumerate(given))

    def work_off(most: int) -> None:
        for _ in range(most):
            try:
                number, item = waiting.popleft()
            except IndexError:  # none waits
                return
            results[number] = function(item)

    while len(waiting) > 1:
        if _idle_core.acquire(blocking=False):
            _with_help(lambda: work_off(len(given)), waiting.clear)
        else:
            work_off(1)
    work_off(1)
    return [results[number] for number in range(len(given))]


def _with_help(work: Callable[[], None], stop: Callable[[], None]) -> None:
    """Work here and in a second thread until both find nothing to do; an error of one keeps the other from going on."""

    def beside() -> None:
        try:
            work()
        finally:
            stop()
            _idle_core.release()

    with _lock_handed_on_soon(), ThreadPoolExecutor(1) as thread:
        helper = thread.submit(beside)
        try:
            work()
        finally:
            stop()
            _idle_core.release()  # this one's, while it waits
            wait([helper])
            _idle_core.acquire()
    helper.result()


@contextmanager
def _lock_handed_on_soon() -> Iterator[None]:
    """Let a thread that waits for Python's lock have it soon: it wants it for a moment, between two factorisations."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(_LOCK_KEPT)
    try:
        yield
    finally:
        sys.setswitchinterval(usual)


def both(first: Callable[[], Result], second: Callable[[], Other]) -> tuple[Result, Other]:
    """Call two functions, `side_by_side`.

    Examples
    --------
    >>> both(lambda: 1, lambda: "two")
    (1, 'two')
    """
    calls: list[Callable[[], Any]] = [first, second]
    one, other = side_by_side(lambda call: call(), calls)
    return one, other


class AtOnce(Executor):
    """Executor that computes when it is asked to, in the thread that asks.

    Examples
    --------
    >>> AtOnce().submit(abs, -1).result()
    1
    """

    def submit(self, function: Callable[..., Result], /, *given: Any, **named: Any) -> Future[Result]:
        """Call a function; its error waits in the future, as with other executors."""
        future: Future[Result] = Future()
        try:
            future.set_result(function(*given, **named))
        except Exception as error:
            future.set_exception(error)
        return future


def second_thread() -> Executor:
    """Return a second thread, or none where it would slow down this process or others.

    None is returned on a single core, and in a worker process, which shares the cores with others.

    Examples
    --------
    >>> with second_thread() as thread:
    ...     thread.submit(abs, -1).result()
    1
    """
    if second_core_is_free():
        return ThreadPoolExecutor(1)
    return AtOnce()


def second_core_is_free() -> bool:
    """Whether a core is likely to be free for a second thread: more than one core, and this is no worker process."""
    return available_cores() > 1 and multiprocessing.parent_process() is None


def available_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
