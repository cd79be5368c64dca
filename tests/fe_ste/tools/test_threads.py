"""Computations side by side."""

from __future__ import annotations

import multiprocessing
import threading
import time

import numpy as np
import pytest

import fe_ste.tools.threads
from fe_ste.elimination.dense import add_product
from fe_ste.tools.threads import AtOnce, one_dense_thread, second_thread, side_by_side


@pytest.fixture
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fe_ste.tools.threads, "available_cores", lambda: 2)


def threads_of(count: int) -> set[int]:
    def here(_: int) -> int:
        time.sleep(0.05)
        return threading.get_ident()

    return set(side_by_side(here, range(count)))


def test_results_come_in_the_order_of_what_was_given(two_cores: None) -> None:
    assert side_by_side(lambda seconds: time.sleep(seconds) or seconds, [0.1, 0.0, 0.05]) == [0.1, 0.0, 0.05]


def test_two_work_at_a_time(two_cores: None) -> None:
    both = threading.Barrier(2, timeout=30)
    side_by_side(lambda _: both.wait(), range(2))


def test_one_core_one_item_a_worker_and_what_is_beside_another_take_no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fe_ste.tools.threads, "available_cores", lambda: 2)
    assert threads_of(1) == {threading.get_ident()}
    inner = side_by_side(lambda _: threads_of(2) == {threading.get_ident()}, range(2))
    assert inner == [True, True]
    with monkeypatch.context() as in_worker:
        in_worker.setattr(multiprocessing, "parent_process", lambda: object())
        assert threads_of(2) == {threading.get_ident()}
    monkeypatch.setattr(fe_ste.tools.threads, "available_cores", lambda: 1)
    assert threads_of(2) == {threading.get_ident()}


def test_a_second_thread_is_none_on_one_core_and_in_a_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    def thread() -> int:
        with second_thread() as own:
            return own.submit(threading.get_ident).result()

    monkeypatch.setattr(fe_ste.tools.threads, "available_cores", lambda: 2)
    assert thread() != threading.get_ident()
    with monkeypatch.context() as in_worker:
        in_worker.setattr(multiprocessing, "parent_process", lambda: object())
        assert thread() == threading.get_ident()
    monkeypatch.setattr(fe_ste.tools.threads, "available_cores", lambda: 1)
    assert thread() == threading.get_ident()


def test_what_fails_at_once_is_raised_when_the_result_is_asked_for() -> None:
    failed = AtOnce().submit(int, "two")
    with pytest.raises(ValueError, match="two"):
        failed.result()


def test_an_error_of_one_is_raised(two_cores: None) -> None:
    def fails(item: int) -> int:
        if item:
            raise ValueError("second")
        return item

    with pytest.raises(ValueError, match="second"):
        side_by_side(fails, range(2))


def test_dense_products_let_go_of_the_lock(two_cores: None) -> None:
    """While a product of half a second runs, this thread goes on."""
    size = 3000
    left, target = np.ones((size, size), order="F"), np.zeros((size, size), order="F")
    begun, ended, steps = threading.Event(), threading.Event(), 0

    def multiply() -> None:
        begun.set()
        add_product(target, left, left)
        ended.set()

    with one_dense_thread():
        worker = threading.Thread(target=multiply)
        worker.start()
        begun.wait()
        while not ended.wait(0.01):
            steps += 1
        worker.join()
    assert steps > 5
    assert (target == size).all()
