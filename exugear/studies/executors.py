"""Computation of points in this process, in worker processes, on a Dask cluster or on any executor of that protocol.

Each process writes its own journal, so that processes do not wait for each other and any number can work in one
folder. A line is added by a single write and has a checksum, so that truncated lines are ignored. Journals of one
study can be copied into one folder.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import math
import os
import platform
import re
import secrets
import shutil
import statistics
import sys
import time
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

from threadpoolctl import threadpool_limits

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.reading import GearboxFileError
from exugear.results.folder import peak_memory
from exugear.studies.point_results import PointError, PointResults, PointSettings, Shared
from exugear.studies.quantities import Output
from exugear.studies.sampling import changed
from exugear.system.gearbox_checks import check_parts
from fe_ste.tools.files import FileError, open_regular, write_all
from fe_ste.tools.processes import Workers, WorkerStoppedError, stop_if_asked
from fe_ste.tools.threads import AtOnce, available_cores

# Journals of finished points: one line per point, keyed by the hash of its input, complete or ignored

FOLDER = "points"
INFINITE = "infinite"
"""Placeholder for infinite numbers, which JSON does not support; with a minus sign for negative infinity."""
_END = ".jsonl"
_DIGITS = 16
"""Digits of a line's checksum."""


@dataclass(frozen=True)
class Record:
    """Stored result of a point."""

    point: str
    """Hash of its input."""
    values: Mapping[str, Any] = field(default_factory=dict)
    """Outputs by name: a number, or numbers by name; None for NaN, `INFINITE` for infinite values."""
    error: str = ""
    """Reason of failure; empty for success."""
    doubts: list[str] = field(default_factory=list)
    """Warnings about the validity of the results."""
    seconds: float = 0.0
    """Wall time, s."""
    memory: float = 0.0
    """Peak memory of the process so far, bytes."""

    def line(self) -> str:
        """Return the record as a line of a journal."""
        text = json.dumps(asdict(self), allow_nan=False)
        return f'{{"checksum": "{_checksum(text)}", "record": {text}}}\n'


def _checksum(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8")).hexdigest()[:_DIGITS]


_POINT = re.compile(r'"record": \{"point": "([^"]*)"')
"""Key of the point in a line; lines of other points are not parsed further."""
_LINE = re.compile(rf'\{{"checksum": "([0-9a-f]{{{_DIGITS}}})", "record": (.*)\}}')


def _record(line: str) -> Record | None:
    """Return the record of a line; None if it is truncated or damaged."""
    match = _LINE.fullmatch(line)
    if match is None or _checksum(match[2]) != match[1]:
        return None
    try:
        return Record(**json.loads(match[2]))
    except (ValueError, TypeError):
        return None


def json_number(value: float) -> float | str | None:
    """Return a number in the form used in records.

    Examples
    --------
    >>> [json_number(value) for value in (2.0, float("inf"), float("nan"))]
    [2.0, 'infinite', None]
    """
    if math.isnan(value):
        return None
    if math.isfinite(value):
        return value
    return INFINITE if value > 0.0 else f"-{INFINITE}"


def number_of(value: Any) -> float:
    """Return a number from its form in records.

    Examples
    --------
    >>> [number_of(value) for value in (2.0, "infinite", "-infinite", None)]
    [2.0, inf, -inf, nan]
    """
    if isinstance(value, str):
        return -math.inf if value.startswith("-") else math.inf
    if value is None:
        return math.nan
    return float(value)


class Journal:
    """Journal of this process in a folder, created with its first line."""

    def __init__(self, folder: Path) -> None:
        host = re.sub(r"[^A-Za-z0-9]", "", platform.node())[:20] or "host"
        self._path = folder / FOLDER / f"{host}-{os.getpid()}-{secrets.token_hex(4)}{_END}"

    def add(self, record: Record) -> None:
        """Append a point, which is then visible to all processes.

        Raises
        ------
        OSError
            The file cannot be written, for example because the disk is full.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
        with os.fdopen(os.open(self._path, flags, 0o666), "ab", buffering=0) as file:
            write_all(file, record.line().encode("utf-8"))

    def settle(self) -> None:
        """Flush the journal to disk, so that a power failure does not lose it."""
        if self._path.exists():
            with open(self._path, "rb+") as file:
                os.fsync(file.fileno())


def read_journals(folder: Path, wanted: Collection[str]) -> dict[str, Record]:
    """Return the finished points of a folder among those wanted (hashes); a success has priority over a failure."""
    journals: dict[str, Record] = {}
    for path in sorted((folder / FOLDER).glob(f"*{_END}")):
        try:
            with open_regular(path) as file:
                lines = file.read().decode("utf-8", errors="replace").splitlines()
        except FileError:
            continue  # files that are not journals hold no points
        for line in lines:
            match = _POINT.search(line)
            if match is None or match[1] not in wanted:
                continue
            before = journals.get(match[1])
            record = _record(line)
            if record is not None and (before is None or before.error):
                journals[record.point] = record
    return journals


# Points computed by a worker one after the other, each recorded as soon as it is finished

LONG = 1.0
"""Computing time of a point (s) above which its record is flushed to disk at once."""
SHARED_FOLDER = "shared"
WORK_FOLDER = "work"
SHOWN_VALUES, LONGEST_VALUE = 5, 200
"""Maximum number of parameters in the error of a point, and maximum characters of each."""


@dataclass(frozen=True)
class Task:
    """Common data of all points of a study, sent to the workers."""

    content: Mapping[str, Any]
    """Content of the gearbox file, with the changes common to all points."""
    source: str
    permissions: Permissions
    choice: Choice
    settings: PointSettings
    outputs: Mapping[str, Output]
    folder: Path
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Names of the parameters that set values in the gearbox file, by path."""


@dataclass(frozen=True)
class PointInput:
    """Data of a point sent to a worker: the hash of its input, and values by path in the gearbox file."""

    point: str
    changes: Mapping[str, Any]


_journal = lru_cache(maxsize=4)(Journal)
"""Journal of this process; a worker takes batches of one study at a time."""


def compute_batch(task: Task, batch: Sequence[PointInput]) -> list[Record]:
    """Compute points, with dense linear algebra limited to one thread.

    Raises
    ------
    WorkerStoppedError
        The computation was cancelled; finished points are recorded.
    OSError
        A finished point cannot be written.
    """
    journal = _journal(task.folder)
    records = []
    try:
        with threadpool_limits(1):
            for work in batch:
                stop_if_asked()
                record = compute_point(task, work)
                journal.add(record)
                records.append(record)
                if record.seconds > LONG:
                    journal.settle()
    finally:
        journal.settle()
    return records


def compute_point(task: Task, work: PointInput) -> Record:
    """Compute one point; errors become part of its record."""
    start = time.perf_counter()
    values: dict[str, Any] = {}
    error = ""
    doubts = []
    folder = task.folder / WORK_FOLDER / work.point[:32]
    try:
        gearbox = _built(task, work)
        results = PointResults(gearbox, task.choice, task.settings, Shared(task.folder / SHARED_FOLDER), folder)
        for name, kept in task.outputs.items():
            try:
                found = kept.of(results)
                if isinstance(found, Mapping):
                    values[name] = {label: json_number(float(value)) for label, value in found.items()}
                else:
                    values[name] = json_number(float(found))
            except PointError as reason:  # the other outputs of the point are valid
                error += f"{'; ' if error else ''}outputs.{name}: {reason}"
        doubts = list(results.doubts)
        shutil.rmtree(folder, ignore_errors=True)
    except WorkerStoppedError:
        raise
    except Exception as reason:  # the failure of one point must not end the others
        values = {}
        error = f"{type(reason).__name__}: {reason}"
    return Record(work.point, values, error, doubts, round(time.perf_counter() - start, 6), peak_memory())


def _built(task: Task, work: PointInput) -> Gearbox:
    """Return the gearbox of a point; the error of an invalid one begins with the parameters and their values."""
    try:
        gearbox = Gearbox.from_dict(changed(task.content, work.changes), task.source, task.permissions)
        check_parts(gearbox)
        return gearbox
    except GearboxFileError as error:
        lines = [
            f"parameters.{task.parameters.get(path, '?')}: {path} = {value!r}"[:LONGEST_VALUE]
            for path, value in work.changes.items()
        ]
        more = [f"and {len(lines) - SHOWN_VALUES} more"] if len(lines) > SHOWN_VALUES else []
        raise GearboxFileError(*("; ".join([*lines[:SHOWN_VALUES], *more]) for _ in lines[:1]), *error.errors) from None


CONNECT_SECONDS = 30.0
"""Time limit for the answer of a scheduler, s."""


class ExecutorError(RuntimeError):
    """Error: workers cannot be reached, or were lost and cannot be replaced; finished points are kept."""


class StudyExecutor(Protocol):
    """Protocol required of an executor."""

    def submit(self, fn: Callable[[Task, Sequence[PointInput]], list[Record]], /, *args: Any) -> Future[list[Record]]:
        """Schedule a call and return its future."""
        ...


@dataclass(frozen=True)
class Pool:
    """Running executor."""

    executor: StudyExecutor
    """Object with the protocol of `concurrent.futures.Executor`."""
    workers: int
    """Number of batches computed at the same time."""


Opens = Callable[[], AbstractContextManager[Pool]]
"""Function that starts workers; called again after workers were lost."""


def processes(workers: int | None = None) -> Opens:
    """Return worker processes, by default on all cores; with one worker, this process itself.

    Examples
    --------
    >>> with processes(1)() as pool:
    ...     pool.workers
    1
    """
    count = available_cores() if workers is None else workers
    if count == 1:
        return lambda: nullcontext(Pool(AtOnce(), 1))

    @contextmanager
    def opened() -> Iterator[Pool]:
        with Workers(count) as executor:
            yield Pool(executor, count)

    return opened


def dask_cluster(address: str) -> Opens:
    """Return the workers of a Dask scheduler (``tcp://10.0.0.1:8786``), which need the same folders as this process."""

    @contextmanager
    def opened() -> Iterator[Pool]:
        try:
            distributed: Any = importlib.import_module("distributed")
        except ImportError:
            raise ExecutorError("--executor dask needs Dask: pip install 'exugear[cluster]'") from None
        try:
            client = distributed.Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError) as error:
            raise ExecutorError(f"--scheduler {address}: no Dask scheduler answers there ({error})") from error
        with client:
            yield Pool(client.get_executor(pure=False), max(1, sum(client.nthreads().values())))

    return opened


def given(executor: StudyExecutor, workers: int | None = None) -> Opens:
    """Return an executor that the caller starts and ends.

    Parameters
    ----------
    executor : object with the protocol of `concurrent.futures.Executor`
    workers : number of simultaneous batches; by default the cores of this machine
    """
    opened_before = False

    @contextmanager
    def opened() -> Iterator[Pool]:
        nonlocal opened_before
        if opened_before:
            raise ExecutorError(
                "the executor lost its workers; finished points are stored, start again with another executor"
            )
        opened_before = True
        yield Pool(executor, available_cores() if workers is None else workers)

    return opened


class PersistentPool:
    """Workers that are kept for several calls, and restarted only after they were lost."""

    def __init__(self, opens: Opens) -> None:
        self._opens = opens
        self._stack = ExitStack()
        self._pool: Pool | None = None

    @contextmanager
    def opened(self) -> Iterator[Pool]:
        """Provide the workers; an error in the calling block stops them."""
        if self._pool is None:
            self._pool = self._stack.enter_context(self._opens())
        try:
            yield self._pool
        except BaseException:
            self._pool = None
            if not self._stack.__exit__(*sys.exc_info()):
                raise

    def __enter__(self) -> Self:
        """Enter without starting workers."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop the workers."""
        self._pool = None
        self._stack.close()


class Pace:
    """Size of a batch: about half a second of work, which limits both communication and waiting time.

    Examples
    --------
    >>> pace = Pace()
    >>> pace.count
    1
    >>> pace.took.extend([0.002, 0.002])
    >>> pace.count
    100
    """

    seconds = 0.5
    most = 100

    def __init__(self) -> None:
        self.took: deque[float] = deque(maxlen=2 * self.most)
        """Computing times of the latest points, s."""

    @property
    def count(self) -> int:
        """Number of points of the next batch."""
        if not self.took:
            return 1
        usual = statistics.median(self.took)  # median, because the first points also load libraries
        return max(1, min(self.most, math.floor(self.seconds / max(usual, 1e-9))))


# Points sent to workers in batches, sent again when workers are lost, and reported on return

MOST_LOSSES = 3
"""Number of worker losses after which a point is abandoned; the last one while it was the only running point."""
ALONE_AFTER = 2
"""Number of worker losses after which a point is computed while no other runs, to identify the cause."""
BATCHES_A_WORKER = 2
"""Number of batches sent per worker: one is computed, one waits."""
Tell = Callable[[Record], None]


@dataclass
class _Running:
    """Waiting points, batches of workers, and returned records."""

    task: Task
    tell: Tell
    waiting: deque[PointInput]
    alone: deque[PointInput] = field(default_factory=deque)
    """Points that are computed while no other runs."""
    losses: Counter[str] = field(default_factory=Counter)
    """Numbers of worker losses by point."""
    found: dict[str, Record] = field(default_factory=dict)
    pace: Pace = field(default_factory=Pace)

    def take(self, records: Iterable[Record]) -> None:
        """Store and report returned records."""
        for record in records:
            if record.point not in self.found:
                self.found[record.point] = record
                self.tell(record)

    def work(self, pool: Pool) -> None:
        """Process points until none is left.

        Raises
        ------
        BrokenExecutor
            The pool has lost its workers; their points are queued again.
        """
        at_work: dict[Future[list[Record]], list[PointInput]] = {}
        ahead = BATCHES_A_WORKER * pool.workers
        try:
            while self.waiting or self.alone or at_work:
                # Points leave their queue only after they were sent, so that none is lost with its worker.
                while self.waiting and len(at_work) < ahead:
                    size = min(self.pace.count, max(1, len(self.waiting) // ahead))
                    batch = [self.waiting[n] for n in range(size)]
                    at_work[pool.executor.submit(compute_batch, self.task, batch)] = batch
                    for _ in batch:
                        self.waiting.popleft()
                if self.alone and not at_work:
                    batch = [self.alone[0]]
                    at_work[pool.executor.submit(compute_batch, self.task, batch)] = batch
                    self.alone.popleft()
                done, _ = wait(at_work, return_when=FIRST_COMPLETED)
                for future in done:
                    self._gather(future, at_work[future])
                    del at_work[future]
        except BrokenExecutor:
            self.again([work for batch in at_work.values() for work in batch])
            raise

    def _gather(self, future: Future[list[Record]], batch: list[PointInput]) -> None:
        """Take the result of a finished batch.

        Raises
        ------
        BrokenExecutor
            All workers are lost.
        """
        try:
            records = future.result()
        except (Exception, CancelledError) as error:
            # The loss of its worker only; `BrokenExecutor` is the loss of all.
            if not (isinstance(error, CancelledError) or type(error).__name__ == "KilledWorker"):
                raise
            self.again(batch)
        else:
            self.pace.took.extend(record.seconds for record in records)
            self.take(records)

    def again(self, lost: list[PointInput]) -> None:
        """Queue the unfinished points of lost workers again; abandon points that repeatedly lose their worker."""
        self.take(read_journals(self.task.folder, {work.point for work in lost}).values())
        for work in lost:
            if work.point in self.found:
                continue
            self.losses[work.point] += 1
            if self.losses[work.point] >= MOST_LOSSES:
                record = Record(work.point, error=f"its worker process ended unexpectedly {MOST_LOSSES} times")
                Journal(self.task.folder).add(record)
                self.take([record])
            else:
                (self.alone if self.losses[work.point] >= ALONE_AFTER else self.waiting).append(work)


def compute_points(task: Task, points: Iterable[PointInput], opens: Opens, tell: Tell) -> dict[str, Record]:
    """Compute points on workers; return their records by hash.

    Parameters
    ----------
    opens : callable
        Starts workers, as `exugear.studies.executors.processes`; called again when they are lost.
    tell : callable
        Called with each returned record.

    Raises
    ------
    ExecutorError
        Workers cannot be reached.
    OSError
        A finished point cannot be written.
    """
    running = _Running(task, tell, deque(points))
    while running.waiting or running.alone:
        with suppress(BrokenExecutor), opens() as pool:
            running.work(pool)
    seen = read_journals(task.folder, running.found)
    # The remaining points were written by workers into a folder that is not visible to this process.
    journal = Journal(task.folder)
    for point, record in running.found.items():
        if point not in seen:
            journal.add(record)
    journal.settle()
    return running.found
