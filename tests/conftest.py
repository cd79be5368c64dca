"""What tests of all rooms share: signals as from a terminal, and failures that show what a command raised."""

from __future__ import annotations

import functools
import signal
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import typer.main
import typer.testing

TRACEBACK = "traceback of a command"
ASKING_TO_STOP = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGHUP", "SIGTERM", "SIGQUIT", "SIGPIPE") if hasattr(signal, name)
)
"""Signals by which a terminal or a system ends programs; Windows has fewer."""


@contextmanager
def signals_of_a_terminal() -> Iterator[None]:
    """Handle signals as they come from a terminal, and let processes that are started meanwhile do so."""
    usual = {signal.SIGINT: signal.default_int_handler, signal.SIGPIPE: signal.SIG_IGN}  # Python's own two
    blocked = signal.pthread_sigmask(signal.SIG_UNBLOCK, ASKING_TO_STOP)
    before = {number: signal.signal(number, usual.get(number, signal.SIG_DFL)) for number in ASKING_TO_STOP}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)


@pytest.fixture
def terminal_signals() -> Iterator[None]:
    """Signals as they come from a terminal, for a test that sends some and for the processes that it starts.

    A shell that starts tests in its background ignores SIGINT for them, `nohup` SIGHUP, and children inherit both.
    Tests that send signals ask for this, and are skipped on Windows; during all others a hangup stays ignored where
    `nohup` has it so.
    """
    if not hasattr(signal, "pthread_sigmask"):
        pytest.skip("this system has no signals of a terminal")
    with signals_of_a_terminal():
        yield


@pytest.fixture(scope="module")
def terminal_signals_of_module() -> Iterator[None]:
    """`terminal_signals` for a process that all tests of a file share."""
    with signals_of_a_terminal():
        yield


@pytest.fixture(autouse=True, scope="session")
def commands_built_once() -> Iterator[None]:
    """Build the commands and options of an application once, not for each command that a test runs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("typer.testing._get_command", functools.cache(typer.main.get_command), raising=False)
        yield


@pytest.fixture(autouse=True)
def commands_that_raise(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the tracebacks of commands that a test runs in its own process.

    The runner catches what a command raises, and standard error, which most tests print where they fail, stays empty.
    """
    invoke = typer.testing.CliRunner.invoke

    def kept(runner: Any, app: Any, arguments: Any = None, *more: Any, **named: Any) -> Any:
        outcome = invoke(runner, app, arguments, *more, **named)
        if outcome.exception is not None and not isinstance(outcome.exception, SystemExit):
            text = "".join(traceback.format_exception(outcome.exception))
            request.node.user_properties.append((TRACEBACK, f"{arguments}\n{text}"))
        return outcome

    monkeypatch.setattr(typer.testing.CliRunner, "invoke", kept)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Add those tracebacks to the report of a test that fails."""
    outcome = yield
    report = outcome.get_result()
    if report.failed:
        report.sections += [("raised by the command", text) for name, text in item.user_properties if name == TRACEBACK]
