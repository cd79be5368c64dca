"""What a run gives, and how it can fail."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fe_ste.tools.display import Displayed, TitledRows


class RunError(RuntimeError):
    """A run that went wrong; what was reached before is kept."""


class LimitError(RunError):
    """A run that was stopped beyond a limit of `exugear.transient.trust`, with what was reached."""

    def __init__(self, message: str, run: Run) -> None:
        super().__init__(message)
        self.run = run


@dataclass(frozen=True)
class Progress:
    """How far a run is: simulated and total time (s), wall time spent and expected to remain (s)."""

    simulated: float
    total: float
    wall: float
    remaining: float

    @property
    def speed(self) -> float:
        """Simulated seconds per second of wall time."""
        if self.wall > 0.0:
            return self.simulated / self.wall
        return 0.0


class ProgressMeter:
    """Teller of how far a run is.

    Parameters
    ----------
    begin, end : simulated time at the start and at the end, s
    tell : called with each `Progress`
    """

    def __init__(self, begin: float, end: float, tell: Callable[[Progress], None] | None) -> None:
        self._begin, self._end = begin, end
        self._tell = tell
        self._wall_start = time.perf_counter()

    @property
    def wall(self) -> float:
        """Wall time since the start, s."""
        return time.perf_counter() - self._wall_start

    def reach(self, now: float) -> None:
        """Tell that the run has reached a simulated time, s."""
        if self._tell is None:
            return
        wall = self.wall
        done = now - self._begin
        remaining = wall * (self._end - now) / done if done > 0.0 else math.inf
        self._tell(Progress(now, self._end, wall, remaining))


@dataclass(frozen=True)
class Run(Displayed):
    """A finished or stopped run.

    Examples
    --------
    >>> Run(Path("rigid/run.nc"), complete=True, end=0.5, wall=1.25)
    <Run rigid/run.nc: complete, 0.5 s simulated in 1.2 s, trusted>
    """

    path: Path
    complete: bool
    end: float
    wall: float
    """Simulated and wall time, s."""
    reasons: tuple[str, ...] = ()
    """Why it is not to be trusted (`exugear.transient.trust`), none if it is."""
    halted: bool = False
    """Whether it was stopped beyond a limit, and cannot go on."""

    @property
    def trusted(self) -> bool:
        """Whether the run stayed within the limits of what it may claim."""
        return not self.reasons

    @property
    def _state(self) -> str:
        if self.complete:
            return "complete"
        if self.halted:
            return "stopped beyond a limit"
        return "stopped"

    def _line(self) -> str:
        trust = "trusted" if self.trusted else "not to be trusted"
        return f" {self.path}: {self._state}, {self.end:g} s simulated in {self.wall:.1f} s, {trust}"

    def _table(self) -> TitledRows:
        rows = {
            "file": str(self.path),
            "state": self._state,
            "simulated": f"{self.end:g} s",
            "wall time": f"{self.wall:.1f} s",
            "to be trusted": "yes" if self.trusted else f"no: {'; '.join(self.reasons)}",
        }
        return "Run", rows
