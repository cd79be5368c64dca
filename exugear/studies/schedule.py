"""Points sent to workers in batches, sent again when workers are lost, and told while they come back."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from contextlib import suppress

from exugear.studies.batches import Task, Work, compute_batch
from exugear.studies.executors import Opens, Pace, Pool, lost_worker
from exugear.studies.journal import Journal, Record, read_journals

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
                record = Record(work.point, error=f"its worker process was lost {MOST_LOSSES} times, as if killed")
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
