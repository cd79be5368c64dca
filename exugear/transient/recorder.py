"""What a run leaves behind: its states turned into signals, filtered, judged and written piece by piece.

Two buffers take turns: while a solver fills one, a second thread filters, judges and writes the other. Its verdict is
heard when the next buffer is full, whichever thread is faster, so that a run depends on no clock. A worker of a study
shares the cores with others and does both in turn; the results are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import NamedTuple

import numpy as np

from exugear.results.run_file import RunCheckpoint, RunFile
from exugear.system.signals import BALANCE_TERMS, ENERGIES, POWERS
from exugear.transient.compiled.solver import Observer
from exugear.transient.plan import RunPlan, buffer_rows
from exugear.transient.start import RunStart
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.threads import second_thread

INTEGRATED = [BALANCE_TERMS.index(term) for term in POWERS]
"""Columns of the account that are integrals of powers."""
OBSERVED = [BALANCE_TERMS.index(term) for term in ENERGIES]
"""Columns of the account that are observed as they are."""


class EnergyAccount:
    """Terms of `exugear.system.signals.BALANCE_TERMS` accumulated during a run.

    Parameters
    ----------
    step : time between two states, s
    balance : (terms,) account at the state to start from, J
    powers : (powers,) powers at that state, W

    Attributes
    ----------
    balance, powers : (terms,) (powers,) account and powers at the last state, J and W

    Examples
    --------
    A steady 2 W of the loads over two steps of 0.5 s:

    >>> account = EnergyAccount(0.5, np.zeros(len(BALANCE_TERMS)), np.zeros(len(POWERS)))
    >>> powers = np.zeros((3, len(POWERS)))
    >>> powers[:, POWERS.index("work_of_loads")] = 2.0
    >>> lines = account.carry_on(powers, np.array([0, 2]), np.zeros((2, len(ENERGIES))))
    >>> lines[:, BALANCE_TERMS.index("work_of_loads")]
    array([0.5, 2.5])
    """

    def __init__(self, step: float, balance: Floats, powers: Floats) -> None:
        self.balance = balance
        self.powers = powers
        self._step = step

    def begin(self, powers: Floats) -> None:
        """Begin with the powers (W) at the first state, which is carried on to like all others."""
        # No time passes before the first state: the mean of its powers and these is none.
        self.powers = -powers

    def carry_on(self, powers: Floats, written: Integers, energies: Floats) -> Floats:
        """Carry the account on by states one step apart; powers by the trapezoidal rule.

        Parameters
        ----------
        powers : (n, powers) of `exugear.system.signals.POWERS` at each state, W
        written : (k,) numbers of the states whose lines are asked for, the last state's last
        energies : (k, energies) of `exugear.system.signals.ENERGIES` at these states, J

        Returns
        -------
        (k, terms) account at these states, J
        """
        # Whole sums up to each line; of the first and the last power in them half is too much or missing.
        starts = np.concatenate([[0], written[:-1] + 1])
        sums = np.cumsum(np.add.reduceat(powers, starts, axis=0), axis=0)
        worked = sums + 0.5 * (self.powers - powers[written])
        lines = np.empty((len(written), len(BALANCE_TERMS)))
        lines[:, INTEGRATED] = self.balance[INTEGRATED] + self._step * worked
        lines[:, OBSERVED] = energies
        self.powers, self.balance = powers[-1].copy(), lines[-1]
        return lines


FLUSH_INTERVAL = 0.25
"""Simulated time between writes to disk, s."""
FLUSH_FACTOR = {"compiled": 2, "exudyn": 1}
"""How many times this interval each solver goes without: a piece costs as much as 2000 compiled steps."""


class RowBuffer(NamedTuple):
    """Rows of a `StateBuffer`: coordinates and velocities (n, size), signals (n, columns), energies, powers (n, 7)."""

    q: Floats
    v: Floats
    signals: Floats
    energies: Floats


class StateBuffer:
    """States of a run between two writes, and what was observed of them.

    Parameters
    ----------
    rows, size, columns : most states; coordinates and signals of a state

    Attributes
    ----------
    filled, observed : int
        States that are in it, and how many of them have their signals.
    """

    def __init__(self, rows: int, size: int, columns: int) -> None:
        self.filled = self.observed = 0
        self._times = np.empty(rows)
        widths = (size, size, columns, len(ENERGIES) + len(POWERS))
        self._rows = RowBuffer._make(np.empty((rows, width)) for width in widths)

    @property
    def full(self) -> bool:
        """Whether no state fits in any more."""
        return self.filled == len(self._times)

    def room(self, most: int) -> RowBuffer:
        """Rows of the next states, up to so many, for a solver to fill."""
        return self._rows_between(self.filled, min(self.filled + most, len(self._times)))

    def take(self, times: Floats) -> None:
        """Count states that were filled into the buffer, at times (n,), s."""
        end = self.filled + len(times)
        self._times[self.filled : end] = times
        self.filled = end

    def states(self, first: int = 0) -> tuple[Floats, RowBuffer]:
        """Return times (n,) and rows of the states in it, from a number on."""
        return self._times[first : self.filled], self._rows_between(first, self.filled)

    def clear(self) -> None:
        """Forget all states."""
        self.filled = self.observed = 0

    def _rows_between(self, first: int, end: int) -> RowBuffer:
        return RowBuffer._make(rows[first:end] for rows in self._rows)


class Recorder:
    """Writer of a run in progress; as a context manager it waits for pending writes.

    Parameters
    ----------
    file : the file that grows with the run
    progress : called after each write, in the caller's thread, with the time that is on the disk, s

    Attributes
    ----------
    buffer : StateBuffer
        Where states wait to be written.
    last_time : float
        Time of the last state that counts, s.
    error : str
        The error that ended the run, empty if none.
    past : (n, size) array
        Accelerations from which a multistep solver continues after the last state, the latest last.
    """

    def __init__(
        self, plan: RunPlan, start: RunStart, file: RunFile, progress: Callable[[float], None] | None = None
    ) -> None:
        self.last_time = 0.0
        self.error = ""
        self._plan = plan
        self._start = start
        self._file = file
        self._progress = progress
        self._judge = start.judge
        self._observer = Observer(plan.assembly, start.loads)
        self._layout = self._observer.layout
        self._decimator = plan.decimator()
        self._decimator.pending, self._decimator.pending_first = start.state.pending, start.state.pending_first
        self._account = EnergyAccount(plan.step, start.state.balance, start.state.powers)
        self._mesh_times = start.state.mesh_times
        self.past = start.state.past
        wanted = FLUSH_FACTOR[plan.solver] * FLUSH_INTERVAL / plan.step
        size = plan.assembly.size
        rows = buffer_rows(wanted, size, self._layout.count)
        self.buffer, self._spare = (StateBuffer(rows, size, self._layout.count) for _ in range(2))
        self._stopped = self._judge.stop
        self._writer = second_thread()
        self._writing: Future[float] | None = None

    def __enter__(self) -> Recorder:
        """Have the loop over time compiled, which takes seconds once per installation, while Ctrl-C still ends it."""
        nothing = np.empty((0, self._plan.assembly.size))
        self._observer.observe(np.empty(0), nothing, nothing)
        return self

    def __exit__(self, *_: object) -> None:
        """Wait for the second thread, and give back the memory of the buffers."""
        self._writer.shutdown()
        self.buffer = self._spare = StateBuffer(0, 0, 0)

    @property
    def halted(self) -> bool:
        """Whether the run is known to be beyond a limit that no run may pass, or has an error."""
        return bool(self.error) or self._stopped

    def begin(self, time: float, q: Floats, v: Floats) -> None:
        """Take the state that the run starts from, at a time (s); a resumed run has it in its pieces already."""
        if self._start.resumed:
            self.last_time = time
            return
        self.keep(time, q, v)
        if not self.error:
            self._observe_rest(self.buffer)
            self._account.begin(self.buffer.states()[1].energies[0, len(ENERGIES) :])

    def keep(self, time: float, q: Floats, v: Floats) -> None:
        """Take one state at a time (s); one that is not finite is an error."""
        if not (np.isfinite(q).all() and np.isfinite(v).all()):
            self.error = f"the state is not finite at t = {time:.6g} s"
            return
        room = self.buffer.room(1)
        room.q[0], room.v[0] = q, v
        self._take(np.array([time]))

    def take_observed(self, times: Floats) -> None:
        """Accept the states that a solver stored in the buffer, with their signals, at times (n,), s."""
        self.buffer.observed += len(times)
        self._take(times)

    def _take(self, times: Floats) -> None:
        self.buffer.take(times)
        if len(times):
            self.last_time = float(times[-1])
        if self.buffer.full:
            self._hand_over()

    def _observe_rest(self, buffer: StateBuffer) -> None:
        """Observe the states that a solver left without signals: they follow those that have them."""
        times, rows = buffer.states(buffer.observed)
        if not len(times):
            return
        rows.signals[:], energies, powers = self._observer.observe(times, rows.q, rows.v)
        rows.energies[:, : len(ENERGIES)], rows.energies[:, len(ENERGIES) :] = energies, powers
        buffer.observed = buffer.filled

    def finish(self) -> None:
        """Write all that was taken; who ended the run hears no more of its progress."""
        self._progress = None
        self._hand_over()
        self._await_writing()

    def _hand_over(self) -> None:
        """Start writing the buffer and continue with the other, unless the previous write ends the run there."""
        self._await_writing()
        if self._stopped:
            self.buffer.clear()
            self.error = ""  # of a state beyond the end
        elif self.buffer.filled:
            against = (self.error,) if self.error else ()
            self._writing = self._writer.submit(self._write, self.buffer, self.past, against)
            self.buffer, self._spare = self._spare, self.buffer

    def _await_writing(self) -> None:
        """Wait for the buffer that is being written, and hear the verdict on it."""
        if self._writing is None:
            return
        written, self._writing = self._writing.result(), None
        self._stopped = self._judge.stop
        if self._stopped:
            self.last_time = written
        if self._progress is not None:
            self._progress(written)

    def _write(self, buffer: StateBuffer, past: Floats, against: tuple[str, ...]) -> float:
        """Convert the states of a buffer into signals, write them and the restart state; return its time (s)."""
        with np.errstate(over="ignore", invalid="ignore"):  # a run that diverges ends in numbers too large to add up
            self._observe_rest(buffer)
            times, rows = buffer.states()
            self._observer.complete(rows.q, rows.v, rows.signals)
            count = len(times)
            stride = max(1, round(FLUSH_INTERVAL / self._plan.step))
            written = np.unique(np.append(np.arange(0, count, stride), count - 1))
            # A solver that observes its steps leaves out the energies, which are asked for seldom.
            _, energies, _ = self._observer.observe(times[written], rows.q[written], rows.v[written])
            balances = self._account.carry_on(rows.energies[:, len(ENERGIES) :], written, energies)
        self._judge.see(times, self._layout.values("mesh_dte", rows.signals), rows.v, times[written], balances)
        self._mesh_times = self._mesh_times + self._plan.step * self._layout.mesh_times(rows.signals)
        centre, samples = self._decimator.push(rows.signals)
        numbers = centre + self._decimator.factor * np.arange(len(samples), dtype=np.float64)
        end = float(times[-1])
        self._note_validity(against + self._reasons(end))
        state = RunCheckpoint(
            step=round(end / self._plan.step),
            q=rows.q[-1],
            v=rows.v[-1],
            past=past,
            pending=self._decimator.pending,
            pending_first=self._decimator.pending_first,
            balance=self._account.balance,
            powers=self._account.powers,
            start_angle=self._start.state.start_angle,
            mesh_times=self._mesh_times,
            judgement=self._judge.figures,
        )
        pieces = self._start.pieces
        self._file.add(pieces.append(self._plan.step * numbers, samples, times[written], balances, state))
        buffer.clear()
        return end

    def reasons(self) -> tuple[str, ...]:
        """Return the reasons why the run is invalid so far."""
        return self._reasons(self.last_time)

    def _reasons(self, time: float) -> tuple[str, ...]:
        return self._judge.reasons(self._mesh_times, time)

    def note_validity(self) -> None:
        """Add to the pieces that follow what the run may claim so far, and what speaks against it."""
        self._note_validity(((self.error,) if self.error else ()) + self.reasons())

    def _note_validity(self, against: tuple[str, ...]) -> None:
        pieces = self._start.pieces
        pieces.note("limits", self._judge.limits.to_json())
        pieces.note("validity_message", "; ".join(against) or "within all limits")
        pieces.note("valid", 0 if against else 1)
