"""Long computations of the page: commands of this program in processes of their own, with progress and cancelling."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from exugear.cli.console import PROGRESS_SIGN, PROGRESS_VARIABLE

KINDS = {
    "tables": "Tables",
    "steady": "Steady-state response",
    "report": "Report",
    "changes": "Design changes",
}
"""Long computations of the page with their names."""
LAST_LINES = 12
"""Number of last lines of a command that the page shows."""
REASONS = ("Bad input: ", "Failed: ")
"""Beginnings of the message with which a command says why it fails."""
PATIENCE = 10.0
"""Time (s) that a cancelled command has to store completed parts before it is killed."""


class BusyError(Exception):
    """Another long computation is running."""


@dataclass
class LongTask:
    """One long computation."""

    kind: str
    digest: str
    """Of the gearbox file that it was started with."""
    process: subprocess.Popen[str]
    began: float
    progress: dict[str, Any] = field(default_factory=dict)
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=LAST_LINES))
    seconds: float | None = None
    """Run time once it has ended."""
    cancelled: bool = False

    def told(self) -> dict[str, Any]:
        """Return what the page shows of it."""
        code = self.process.poll() if self.seconds is not None else None
        state = "running" if code is None else "cancelled" if self.cancelled and code else "failed" if code else "done"
        lines = list(self.lines)
        message = ""
        if state == "failed":
            # A command that says no reason is told by its last line.
            starts = [number for number, line in enumerate(lines) if line.startswith(REASONS)]
            message = " ".join(lines[starts[-1] if starts else -1 :])
        return {
            "kind": self.kind,
            "name": KINDS[self.kind],
            "state": state,
            "digest": self.digest,
            "seconds": round(self.seconds if self.seconds is not None else time.monotonic() - self.began, 1),
            "progress": dict(self.progress),
            "message": message,
            "lines": lines,
        }


class LongWork:
    """Long computations of one gearbox file, one at a time."""

    def __init__(self, case: Path, folder: Path, allow_dir: Path | None = None) -> None:
        self._case = case
        self._folder = folder
        self._permitted = [] if allow_dir is None else ["--allow-dir", str(allow_dir)]
        self._lock = threading.Lock()
        self._task: LongTask | None = None

    def commands(self, kind: str) -> list[list[str]]:
        """Return the arguments of the commands of a long computation; stored results that fit are not repeated."""
        of_case = [str(self._case), "--out", str(self._folder), *self._permitted]
        steady = ["steady", *of_case]
        report = ["report", str(self._folder), *self._permitted]
        return {
            "tables": [["ste", *of_case]],
            "steady": [steady],
            "report": [steady, report],
            "changes": [steady, [*report, "--levers"]],
        }[kind]

    def start(self, kind: str, digest: str) -> None:
        """Start a long computation of the saved file, whose digest is given.

        Raises
        ------
        BusyError
            Another one is running.
        """
        with self._lock:
            if self.running:
                raise BusyError("another computation is running; wait for it or cancel it")
            first, *others = self.commands(kind)
            self._task = LongTask(kind, digest, _begun(first), time.monotonic())
        threading.Thread(target=_follow, args=(self._task, others), daemon=True).start()

    @property
    def running(self) -> bool:
        """Whether a long computation is running."""
        return self._task is not None and self._task.seconds is None

    def told(self) -> dict[str, Any] | None:
        """Return what the page shows of the last computation; None without one."""
        return None if self._task is None else self._task.told()

    def cancel(self) -> None:
        """Ask the running command to stop, as Ctrl-C does; completed parts are kept. Kill it if it does not respond."""
        task = self._task
        if task is None or task.seconds is not None:
            return
        task.cancelled = True
        _interrupt(task.process)
        threading.Thread(target=_kill_later, args=(task,), daemon=True).start()

    def end(self) -> None:
        """Cancel the running command and wait for its end."""
        self.cancel()
        if self._task is not None:
            _kill_later(self._task)


def _begun(arguments: list[str]) -> subprocess.Popen[str]:
    program = "from exugear.cli.app import main; main()"
    return subprocess.Popen(
        # -P: modules in the current folder, which may be a stranger's, are not imported.
        [sys.executable, "-P", "-c", program, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        errors="replace",
        env={**os.environ, PROGRESS_VARIABLE: "1", "COLUMNS": "100"},
        # Ctrl-C in the terminal is for the server, which then ends the command itself.
        start_new_session=True,
    )


def _follow(task: LongTask, others: list[list[str]]) -> None:
    """Read the output of a command until it ends, then those of the following ones while all succeed."""
    while True:
        assert task.process.stdout is not None
        with task.process.stdout as output:
            for line in output:
                if line.startswith(PROGRESS_SIGN):
                    task.progress = json.loads(line[1:])
                elif line.strip():
                    task.lines.append(line.rstrip("\n"))
        if task.process.wait() or task.cancelled or not others:
            break
        task.progress = {}
        task.process = _begun(others.pop(0))
        if task.cancelled:  # while it was started
            _interrupt(task.process)
    task.seconds = time.monotonic() - task.began


def _interrupt(process: subprocess.Popen[str]) -> None:
    if sys.platform == "win32":
        process.terminate()
    else:
        process.send_signal(signal.SIGINT)


def _kill_later(task: LongTask) -> None:
    """Wait for the end of a cancelled command, and kill it with its own processes after `PATIENCE`."""
    try:
        task.process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        if sys.platform == "win32":
            task.process.kill()
        else:
            os.killpg(task.process.pid, signal.SIGKILL)
        task.process.wait()
