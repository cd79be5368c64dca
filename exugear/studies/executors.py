"""Where points are computed: in this process, in processes, on a Dask cluster, or on any executor of that protocol.

Every process writes a journal of its own, so that none waits for another and any number can work in one folder. A line
is added by one write and carries a checksum: one that a kill cut short is no point. Journals of one study can be
copied together.
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
import statistics
import sys
import time
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
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
from exugear.studies.point_results import PointResults, PointSettings, Shared
from exugear.studies.quantities import Output, Values
from exugear.studies.sampling import changed
from exugear.system.readiness import check_parts
from fe_ste.tools.files import FileError, open_regular, write_all
from fe_ste.tools.threads import AtOnce, StoppedError, Workers, available_cores, stop_if_asked

# Journals of finished points: a line for each, keyed by the hash of its input, whole or not there at all

FOLDER = "points"
INFINITE = "infinite"
"""In place of a number that has no end, which JSON has not; with a sign where it is below all others."""
_END = ".jsonl"
_DIGITS = 16
"""Digits of a line's checksum."""


@dataclass(frozen=True)
class Record:
    """What is kept of a point."""

    point: str
    """Hash of its input."""
    values: Mapping[str, Any] = field(default_factory=dict)
    """Outputs by name: a number, or numbers by name; None for one that is none, `INFINITE` for one without end."""
    error: str = ""
    """Why it failed; empty if it did not."""
    doubts: list[str] = field(default_factory=list)
    """What speaks against trusting it."""
    seconds: float = 0.0
    """Wall time that it took."""
    memory: float = 0.0
    """Peak of the memory of its process so far, bytes."""

    def line(self) -> str:
        """Return it as a line of a journal."""
        text = json.dumps(asdict(self), allow_nan=False)
        return f'{{"checksum": "{_checksum(text)}", "record": {text}}}\n'


def _checksum(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8")).hexdigest()[:_DIGITS]


_POINT = re.compile(r'"record": \{"point": "([^"]*)"')
"""Where a line says of which point it is: those that are not wanted are not read any further."""
_LINE = re.compile(rf'\{{"checksum": "([0-9a-f]{{{_DIGITS}}})", "record": (.*)\}}')


def _record(line: str) -> Record | None:
    """Record of a line; None if it was cut short or changed."""
    match = _LINE.fullmatch(line)
    if match is None or _checksum(match[2]) != match[1]:
        return None
    try:
        return Record(**json.loads(match[2]))
    except (ValueError, TypeError):
        return None


def told_in_json(value: float) -> float | str | None:
    """Write a number as a record has it.

    Examples
    --------
    >>> [told_in_json(value) for value in (2.0, float("inf"), float("nan"))]
    [2.0, 'infinite', None]
    """
    if math.isnan(value):
        return None
    if math.isfinite(value):
        return value
    if value > 0.0:
        return INFINITE
    return f"-{INFINITE}"


def number_of(value: Any) -> float:
    """Read a number that a record tells.

    Examples
    --------
    >>> [number_of(value) for value in (2.0, "infinite", "-infinite", None)]
    [2.0, inf, -inf, nan]
    """
    if isinstance(value, str):
        if value.startswith("-"):
            return -math.inf
        return math.inf
    if value is None:
        return math.nan
    return float(value)


class Journal:
    """The journal of this process in a folder, begun with its first line.

    Parameters
    ----------
    folder : of the study
    """

    def __init__(self, folder: Path) -> None:
        host = re.sub(r"[^A-Za-z0-9]", "", platform.node())[:20] or "host"
        self._path = folder / FOLDER / f"{host}-{os.getpid()}-{secrets.token_hex(4)}{_END}"

    def add(self, record: Record) -> None:
        """Add a point; it is there for every process from then on.

        Raises
        ------
        OSError
            The disk is full, say.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
        with os.fdopen(os.open(self._path, flags, 0o666), "ab", buffering=0) as file:
            write_all(file, record.line().encode("utf-8"))

    def settle(self) -> None:
        """Bring what was added to the disk, so that a power cut does not lose it."""
        if self._path.exists():
            with open(self._path, "rb+") as file:
                os.fsync(file.fileno())


def read_journals(folder: Path, wanted: Collection[str]) -> dict[str, Record]:
    """Finished points of a folder, of those that are wanted; one that did not fail stands before one that did.

    Parameters
    ----------
    folder : of the study
    wanted : hashes
    """
    journals: dict[str, Record] = {}
    for path in sorted((folder / FOLDER).glob(f"*{_END}")):
        try:
            with open_regular(path) as file:
                lines = file.read().decode("utf-8", errors="replace").splitlines()
        except FileError:
            continue  # what is no journal holds no points
        for line in lines:
            match = _POINT.search(line)
            if match is None or match[1] not in wanted:
                continue
            before = journals.get(match[1])
            record = _record(line)
            if record is not None and (before is None or before.error):
                journals[record.point] = record
    return journals


# Points computed in a worker, one after the other, each noted as soon as it is finished

LONG = 1.0
"""Seconds of a point after which it is brought to the disk by itself."""
SHARED_FOLDER = "shared"
WORK_FOLDER = "work"
SHOWN_VALUES, LONGEST_VALUE = 5, 200
"""Most parameters that the error of a point names, and most letters of each."""


@dataclass(frozen=True)
class Task:
    """What all points of a study have in common, as it is sent to a worker."""

    content: Mapping[str, Any]
    """Of the gearbox file, with the changes that all points have."""
    source: str
    permissions: Permissions
    choice: Choice
    settings: PointSettings
    outputs: Mapping[str, Output]
    """By name."""
    folder: Path
    """Of the study."""
    parameters: Mapping[str, str] = field(default_factory=dict)
    """Mapping of path to str. Names of the parameters that set paths of the case."""


@dataclass(frozen=True)
class Work:
    """A point as it is sent to a worker: the hash of its input, and values at paths of the case."""

    point: str
    changes: Mapping[str, Any]


@lru_cache(maxsize=4)
def _journal(folder: Path) -> Journal:
    """Journal of this process; a worker takes batches of one study after the other."""
    return Journal(folder)


def compute_batch(task: Task, batch: Sequence[Work]) -> list[Record]:
    """Compute points; dense linear algebra keeps to one thread meanwhile.

    Raises
    ------
    StoppedError
        The results are wanted no more; what is finished is noted.
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


def compute_point(task: Task, work: Work) -> Record:
    """Compute one point; whatever goes wrong with it is part of its record."""
    start = time.perf_counter()
    values: dict[str, Any] = {}
    error = ""
    doubts = []
    folder = task.folder / WORK_FOLDER / work.point[:32]
    try:
        gearbox = _built(task, work)
        results = PointResults(gearbox, task.choice, task.settings, Shared(task.folder / SHARED_FOLDER), folder)
        values = {name: _told(kept.of(results)) for name, kept in task.outputs.items()}
        doubts = list(results.doubts)
        results.clear()
    except StoppedError:
        raise
    except Exception as reason:  # one point must not end the others, whatever it is
        values = {}
        error = f"{type(reason).__name__}: {reason}"
    return Record(work.point, values, error, doubts, round(time.perf_counter() - start, 6), peak_memory())


def _built(task: Task, work: Work) -> Gearbox:
    """Gearbox of a point; of one that cannot be, the error begins with the parameters and their values."""
    try:
        gearbox = Gearbox.from_dict(changed(task.content, work.changes), task.source, task.permissions)
        check_parts(gearbox)
        return gearbox
    except GearboxFileError as error:
        own = [
            f"parameters.{task.parameters.get(path, '?')}: {path} = {value!r}"[:LONGEST_VALUE]
            for path, value in work.changes.items()
        ]
        more = [f"and {len(own) - SHOWN_VALUES} more"] if len(own) > SHOWN_VALUES else []
        raise GearboxFileError(*("; ".join([*own[:SHOWN_VALUES], *more]) for _ in own[:1]), *error.faults) from None


def _told(values: Values) -> Any:
    """Values as a journal has them."""
    if isinstance(values, Mapping):
        return {name: told_in_json(float(value)) for name, value in values.items()}
    return told_in_json(float(values))


# Where points are computed: in this process, in processes, on a Dask cluster, or on any executor of that protocol

CONNECT_SECONDS = 30.0
"""Time within which a scheduler has to answer."""


class ExecutorError(RuntimeError):
    """Workers that cannot be reached, or that were lost and cannot be replaced; what is finished is kept."""


class Submits(Protocol):
    """What a study asks of an executor."""

    def submit(self, fn: Callable[[Task, Sequence[Work]], list[Record]], /, *args: Any) -> Future[list[Record]]:
        """Schedule a call and return its future."""
        ...


@dataclass(frozen=True)
class Pool:
    """An executor at work."""

    executor: Submits
    """Object with the protocol of `concurrent.futures.Executor`."""
    workers: int
    """Batches that it computes at once."""


Opens = Callable[[], AbstractContextManager[Pool]]
"""Starts workers; called again after workers were lost."""


@contextmanager
def _here() -> Iterator[Pool]:
    yield Pool(AtOnce(), 1)


def processes(workers: int | None = None) -> Opens:
    """Worker processes; all cores by default. One is this process itself.

    Examples
    --------
    >>> with processes(1)() as pool:
    ...     pool.workers
    1
    """
    count = available_cores() if workers is None else workers

    @contextmanager
    def opened() -> Iterator[Pool]:
        with Workers(count) as executor:
            yield Pool(executor, count)

    if count == 1:
        return _here
    return opened


def dask_cluster(address: str) -> Opens:
    """Return the workers of a Dask scheduler, which see the same folders as this process.

    Parameters
    ----------
    address : such as ``tcp://10.0.0.1:8786``
    """

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


def given(executor: Submits, workers: int | None = None) -> Opens:
    """Return an executor that somebody else starts and ends.

    Parameters
    ----------
    executor : object with the protocol of `concurrent.futures.Executor`
    workers : batches that it computes at once; the cores of this machine by default
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
    """Workers that stay for several calls, and are started anew only after they were lost.

    Parameters
    ----------
    opens : callable
        Starts workers.
    """

    def __init__(self, opens: Opens) -> None:
        self._opens = opens
        self._stack = ExitStack()
        self._pool: Pool | None = None

    @contextmanager
    def opened(self) -> Iterator[Pool]:
        """Lend the workers; an error of those who have them sends them away."""
        if self._pool is None:
            self._pool = self._stack.enter_context(self._opens())
        try:
            yield self._pool
        except BaseException:
            self._pool = None
            if not self._stack.__exit__(*sys.exc_info()):
                raise

    def __enter__(self) -> Self:
        """Begin without workers."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let the workers go."""
        self._pool = None
        self._stack.close()


def lost_worker(error: BaseException) -> bool:
    """Tell whether an error of a future says that its worker alone is gone; `BrokenExecutor` says that all are."""
    return isinstance(error, CancelledError) or type(error).__name__ == "KilledWorker"


class Pace:
    """How many points make a batch: some tenths of a second of work, so that little is sent and little is waited for.

    Examples
    --------
    >>> pace = Pace()
    >>> pace.count
    1
    >>> pace.learn([0.002, 0.002])
    >>> pace.count
    100
    """

    seconds = 0.5
    most = 100

    def __init__(self) -> None:
        self._took: list[float] = []

    def learn(self, seconds: Sequence[float]) -> None:
        """Take note of the seconds that points took."""
        self._took = [*self._took, *seconds][-2 * self.most :]

    @property
    def count(self) -> int:
        """Points of the next batch."""
        if not self._took:
            return 1
        usual = statistics.median(self._took)  # the first ones load libraries
        return max(1, min(self.most, math.floor(self.seconds / max(usual, 1e-9))))


# Points sent to workers in batches, sent again when workers are lost, and told while they come back

MOST_LOSSES = 3
"""A point whose worker was lost so often, the last time while it was alone at work, is given up."""
ALONE_AFTER = 2
"""Losses after which a point is computed while nothing else is, so that no other is blamed."""
BATCHES_A_WORKER = 2
"""Batches sent ahead: one is computed, one waits."""
Tell = Callable[[Record], None]


class _Running:
    """Points that wait, batches that workers have, and records that came back."""

    def __init__(self, task: Task, points: Iterable[Work], tell: Tell) -> None:
        self.task, self.tell = task, tell
        self.waiting, self.alone = deque(points), deque[Work]()
        self.losses: Counter[str] = Counter()
        self.found: dict[str, Record] = {}
        self.pace = Pace()

    def take(self, records: Iterable[Record]) -> None:
        """Keep and tell what came back."""
        for record in records:
            if record.point not in self.found:
                self.found[record.point] = record
                self.tell(record)

    def work(self, pool: Pool) -> None:
        """Work until nothing is left.

        Raises
        ------
        BrokenExecutor
            The pool has lost its workers; their points wait again.
        """
        at_work: dict[Future[list[Record]], list[Work]] = {}
        try:
            while self.waiting or self.alone or at_work:
                self._send(pool, at_work)
                done, _ = wait(at_work, return_when=FIRST_COMPLETED)
                for future in done:
                    self._gather(future, at_work[future])
                    del at_work[future]
        except BrokenExecutor:
            self.again([work for batch in at_work.values() for work in batch])
            raise

    def _send(self, pool: Pool, at_work: dict[Future[list[Record]], list[Work]]) -> None:
        ahead = BATCHES_A_WORKER * pool.workers
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

    def _gather(self, future: Future[list[Record]], batch: list[Work]) -> None:
        """Take what is done.

        Raises
        ------
        BrokenExecutor
            All workers are lost.
        """
        try:
            records = future.result()
        except BrokenExecutor:
            raise
        except (Exception, CancelledError) as error:
            if not lost_worker(error):
                raise
            self.again(batch)
            return
        self.pace.learn([record.seconds for record in records])
        self.take(records)

    def again(self, lost: list[Work]) -> None:
        """Put the points of lost workers back, but for those that they had finished; give up what loses them."""
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


def compute_points(task: Task, points: Iterable[Work], opens: Opens, tell: Tell) -> dict[str, Record]:
    """Compute points on workers.

    Parameters
    ----------
    opens : callable
        Starts workers, as `exugear.studies.executors.processes`; called again when they are lost.
    tell : callable
        Called with each record as it comes back.

    Returns
    -------
    by the hash of the point

    Raises
    ------
    ExecutorError
        Workers cannot be reached.
    OSError
        A finished point cannot be written.
    """
    running = _Running(task, points, tell)
    while running.waiting or running.alone:
        with suppress(BrokenExecutor), opens() as pool:
            running.work(pool)
    seen = read_journals(task.folder, running.found)
    _note_here(task, [record for point, record in running.found.items() if point not in seen])
    return running.found


def _note_here(task: Task, records: list[Record]) -> None:
    """Note what workers wrote into a folder that this process does not see."""
    journal = Journal(task.folder)
    for record in records:
        journal.add(record)
    journal.settle()
