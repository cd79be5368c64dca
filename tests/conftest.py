"""What tests of all rooms share: the signals of a program in the foreground of a terminal."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

ASKING_TO_STOP = (signal.SIGINT, signal.SIGHUP, signal.SIGTERM, signal.SIGQUIT, signal.SIGPIPE)


@pytest.fixture
def terminal_signals() -> Iterator[None]:
    """Signals as they come from a terminal, for a test that sends some and for the processes that it starts.

    A shell that starts tests in its background ignores SIGINT for them, `nohup` SIGHUP, and children inherit both.
    Tests that send signals ask for this; during all others a hangup stays ignored where `nohup` has it so.
    """
    usual = {signal.SIGINT: signal.default_int_handler, signal.SIGPIPE: signal.SIG_IGN}  # Python's own two
    blocked = signal.pthread_sigmask(signal.SIG_UNBLOCK, ASKING_TO_STOP)
    before = {number: signal.signal(number, usual.get(number, signal.SIG_DFL)) for number in ASKING_TO_STOP}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
