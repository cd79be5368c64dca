"""Computations side by side."""

from __future__ import annotations

import multiprocessing
import sys
import threading
import time

import numpy as np
import pytest

import fe_ste.tools.threads
from fe_ste.elimination import add_product
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


def test_of_calls_within_calls_no_more_than_two_work_at_a_time(two_cores: None) -> None:
    working, most, counting = 0, 0, threading.Lock()

    def work(depth: int) -> None:
        nonlocal working, most
        if depth:
            side_by_side(work, [depth - 1] * 3)
            return
        with counting:
            working += 1
            most = max(most, working)
        time.sleep(0.01)
        with counting:
            working -= 1

    side_by_side(work, [2, 2, 0])
    assert most == 2


def test_a_core_that_has_nothing_left_to_do_helps_within_another_item(two_cores: None) -> None:
    both, other_ended = threading.Barrier(2, timeout=30), threading.Event()

    def step(number: int) -> None:
        if number:
            both.wait()
        else:
            assert other_ended.wait(30)
            time.sleep(0.1)  # until its thread has found nothing else to do

    side_by_side(lambda long: side_by_side(step, range(3)) if long else other_ended.set(), [True, False])


def test_the_lock_is_handed_on_soon_only_while_two_work(two_cores: None) -> None:
    usual = sys.getswitchinterval()
    assert set(side_by_side(lambda _: sys.getswitchinterval() < 1e-3, range(2))) == {True}
    assert sys.getswitchinterval() == usual


def test_one_core_one_item_and_a_worker_take_no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fe_ste.tools.threads, "available_cores", lambda: 2)
    assert threads_of(1) == {threading.get_ident()}
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


def test_after_an_error_no_further_item_is_begun(two_cores: None) -> None:
    begun = []

    def fails(item: int) -> None:
        begun.append(item)
        time.sleep(0.01)
        raise IndexError(f"item {item}")

    with pytest.raises(IndexError, match="item"):
        side_by_side(fails, range(100))
    assert len(begun) <= 2


@pytest.mark.validation
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
