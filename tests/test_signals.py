"""Tests say the same however they are started: also in the background, where shells ignore signals for them."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
SENT = re.compile(r"signal\.SIG(INT|TERM|HUP|QUIT)\b")
SENDERS = [file for file in sorted(TESTS.rglob("test_*.py")) if SENT.search(file.read_text(encoding="utf-8"))]
IGNORED = (signal.SIGINT, signal.SIGHUP, signal.SIGTERM, signal.SIGQUIT)


def as_in_the_background() -> None:
    """Ignore and block what asks to stop, in a child before it begins."""
    for number in IGNORED:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_BLOCK, IGNORED)


@pytest.mark.parametrize("file", SENDERS, ids=[file.stem for file in SENDERS])
def test_tests_that_send_signals_ask_for_those_of_a_terminal(file):
    text = file.read_text(encoding="utf-8")
    assert file == Path(__file__) or 'usefixtures("terminal_signals")' in text or "terminal_signals_of_module" in text


@pytest.mark.validation
def test_claims_about_signals_hold_where_they_are_ignored():
    """Those that need neither tables nor runs."""
    folder = TESTS / "exugear" / "cli" / "test_processes.py"
    names = ("test_other_requests_to_stop_act_as_ctrl_c", "test_the_second_ctrl_c_ends_at_once")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *(f"{folder}::{name}" for name in names)]
    outcome = subprocess.run(
        command, capture_output=True, text=True, cwd=TESTS.parent, check=False, preexec_fn=as_in_the_background
    )
    assert outcome.returncode == 0, outcome.stdout
    assert "3 passed" in outcome.stdout
