"""What a run gives, and how it can fail."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


class RunError(RuntimeError):
    """A run that went wrong; what was reached before is kept."""


class LimitError(RunError):
    """A run that was stopped beyond a limit of `exugear.runs.trust`, with what was reached."""

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
        return self.simulated / self.wall if self.wall > 0.0 else 0.0


@dataclass(frozen=True)
class Run:
    """A finished or stopped run.

    Attributes
    ----------
    path : Path
    complete : bool
    end, wall : float
        Simulated and wall time, s.
    reasons : tuple of str
        Why it is not to be trusted (`exugear.runs.trust`), none if it is.
    halted : bool
        Whether it was stopped beyond a limit, and cannot go on.
    """

    path: Path
    complete: bool
    end: float
    wall: float
    reasons: tuple[str, ...] = ()
    halted: bool = False

    @property
    def trusted(self) -> bool:
        """Whether the run stayed within the limits of what it may claim."""
        return not self.reasons
