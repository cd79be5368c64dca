"""Worker processes end with the process that started them, and with the work that nobody waits for."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fe_ste.tools.processes import Workers, WorkerStoppedError, stop_if_asked

pytestmark = pytest.mark.usefixtures("terminal_signals")
ROOT = Path(__file__).parents[3]
#: Two workers that sleep, and more calls, too long for the pipe to the workers, that wait.
SLEEPERS = """
import os, signal, sys, time
from fe_ste.tools.processes import Workers

def stop(*_):
    raise KeyboardInterrupt

with Workers(2) as pool:
    for _ in range(2):
        pool.submit(time.sleep, 600.0)
    calls = [pool.submit(len, bytes(1_000_000)) for _ in range(6)]
    time.sleep(0.5)
    if "stops" in sys.argv:
        signal.signal(signal.SIGTERM, stop)
    print(*pool._processes, flush=True)
    time.sleep(600.0)
"""


def is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{pid}/stat")
    return not (state.exists() and state.read_text(encoding="utf-8").rpartition(")")[2].split()[0] == "Z")


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_the_process_that_started_them(number: int) -> None:
    """Busy ones and idle ones, and though nothing in that process can tell them."""
    process = subprocess.Popen([sys.executable, "-c", SLEEPERS], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    assert process.stdout is not None
    workers = [int(word) for word in process.stdout.readline().split()]
    assert len(workers) == 2
    assert all(map(is_alive, workers))
    process.send_signal(number)
    assert process.wait(timeout=20) == -number
    process.stdout.close()
    deadline = time.monotonic() + 20.0
    while any(map(is_alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(map(is_alive, workers))


def ten_minutes_in_steps() -> None:
    for _ in range(60_000):
        time.sleep(0.01)
        stop_if_asked()


def test_an_error_stops_the_work_and_drops_what_waits() -> None:
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt), Workers(1) as pool:
        running = pool.submit(ten_minutes_in_steps)
        waiting = [pool.submit(ten_minutes_in_steps) for _ in range(5)]
        while not running.running():
            time.sleep(0.01)
        raise KeyboardInterrupt
    assert time.monotonic() - begin < 60.0
    assert isinstance(running.exception(), WorkerStoppedError)
    assert waiting[-1].cancelled()


def test_a_signal_to_the_whole_group_ends_all_of_it() -> None:
    """As `timeout` and batch systems send it: workers end while calls wait for them."""
    process = subprocess.Popen(
        [sys.executable, "-c", SLEEPERS, "stops"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        start_new_session=True,
    )
    assert process.stdout is not None
    workers = [int(word) for word in process.stdout.readline().split()]
    os.killpg(process.pid, signal.SIGTERM)
    _, said = process.communicate(timeout=30)
    assert said.endswith("KeyboardInterrupt\n")
    assert not any(map(is_alive, workers))
