"""Forks share the work on many items: results are those of one process, and none of them outlives it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import fe_ste.tools.processes
import fe_ste.tools.threads
from fe_ste.tools.processes import each_in_forks

from .test_workers import is_alive

pytestmark = [
    pytest.mark.usefixtures("terminal_signals"),
    pytest.mark.skipif(sys.platform != "linux", reason="forks exist on Linux alone"),
]
ROOT = Path(__file__).parents[3]
#: Forks that would take hours, and tell their numbers.
SLEEPERS = """
import os, pathlib, sys, time
import fe_ste.tools.processes
import fe_ste.tools.threads

fe_ste.tools.processes.available_cores = fe_ste.tools.threads.available_cores = lambda: 2
folder = pathlib.Path(sys.argv[1])

def sleep(n):
    if n > 1:
        (folder / str(os.getpid())).touch()
    time.sleep(0.2 if n < 2 else 600.0)

list(fe_ste.tools.processes.each_in_forks(sleep, range(50)))
"""


@pytest.fixture(autouse=True)
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fe_ste.tools.processes, "available_cores", lambda: 2)
    monkeypatch.setattr(fe_ste.tools.threads, "available_cores", lambda: 2)


def slow(item: int) -> tuple[int, int]:
    time.sleep(0.02 if item % 2 else 0.04)
    return item, os.getpid()


def test_results_come_in_order_from_this_process_and_two_forks() -> None:
    found = list(each_in_forks(slow, range(40)))
    assert [item for item, _ in found] == list(range(40))
    assert [process for _, process in found[:2]] == [os.getpid()] * 2
    assert os.getpid() not in {process for _, process in found[2:]}
    assert len({process for _, process in found}) == 3


def test_a_function_that_cannot_be_sent_and_what_it_holds_are_known_to_forks() -> None:
    held = {"factor": 3}

    def times(item: int) -> int:
        time.sleep(0.03)
        return held["factor"] * item

    assert list(each_in_forks(times, range(20))) == [3 * n for n in range(20)]


def test_quick_items_are_sent_in_parts_whose_results_are_in_order() -> None:
    def short(item: int) -> tuple[int, int]:
        time.sleep(0.003)
        return item, os.getpid()

    found = list(each_in_forks(short, range(203)))
    assert [item for item, _ in found] == list(range(203))
    assert len({process for _, process in found}) == 3


def test_quick_items_are_left_to_this_process() -> None:
    assert set(each_in_forks(lambda _: os.getpid(), range(20))) == {os.getpid()}


def test_forks_do_not_fork() -> None:
    def inner(_: int) -> int:
        time.sleep(0.03)
        return len({process for _, process in each_in_forks(slow, range(12))})

    assert list(each_in_forks(inner, range(6)))[2:] == [1] * 4


def test_an_error_is_raised_for_its_item_after_the_results_before_it() -> None:
    def fail(item: int) -> int:
        time.sleep(0.03)
        if item == 13:
            raise ValueError("thirteen")
        return item

    found = []
    with pytest.raises(ValueError, match="thirteen"):
        for item in each_in_forks(fail, range(40)):
            found.append(item)  # noqa: PERF402 - what came before the error
    assert found == list(range(13))


def test_this_process_goes_on_where_a_fork_was_ended() -> None:
    own = os.getpid()

    def end(item: int) -> int:
        time.sleep(0.03)
        if item == 13 and os.getpid() != own:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    assert list(each_in_forks(end, range(40))) == list(range(40))


def test_this_process_goes_on_where_no_fork_can_be_started(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a process left (`os.fork`), and without memory for semaphores (a full ``/dev/shm``)."""

    def none_left(*_: object, **__: object) -> int:
        raise OSError(28, "No space left on device")

    for name in ("os.fork", "multiprocessing.synchronize.SemLock.__init__"):
        with monkeypatch.context() as patched:
            patched.setattr(name, none_left)
            found = list(each_in_forks(slow, range(12)))
        assert found == [(item, os.getpid()) for item in range(12)]


def test_an_interrupt_ends_forks_that_are_busy() -> None:
    def sleep(item: int) -> int:
        time.sleep(0.1 if item < 3 else 600.0)
        return os.getpid()

    def interrupted(found: Iterator[int]) -> Iterator[int]:
        for item in found:
            yield item
            if item != os.getpid():
                raise KeyboardInterrupt

    begin = time.monotonic()
    forks = []
    with pytest.raises(KeyboardInterrupt):
        forks.extend(interrupted(each_in_forks(sleep, range(10))))
    assert time.monotonic() - begin < 60.0


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_forks_end_with_the_process_that_started_them(number: int, tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", SLEEPERS, str(tmp_path)], stderr=subprocess.DEVNULL, text=True, cwd=ROOT
    )
    deadline = time.monotonic() + 30.0
    while len(forks := [int(file.name) for file in tmp_path.iterdir()]) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
    assert len(forks) == 2
    process.send_signal(number)
    assert process.wait(timeout=20) != 0
    deadline = time.monotonic() + 20.0
    while any(map(is_alive, forks)) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(map(is_alive, forks))
