"""Grids of contact states on an executor: split into blocks, stored while they grow, taken up again.

The unit of work is all states of a run of positions of the mesh cycle at one centre distance: in a run each position
begins with the contact of the one before. A block can be sent to any executor of `concurrent.futures` or with its
protocol: it carries all it needs and returns arrays. Which blocks there are depends on the axes alone, so a grid that
was stopped and taken up again has the same bits as one that was not.
"""

from __future__ import annotations

import logging
import math
import pickle
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from fe_ste.tools.arrays import Booleans
from fe_ste.tools.files import FileError
from fe_ste.tools.processes import Workers, stop_if_asked
from fe_ste.tools.stores import Layout, load_dataset, write_dataset
from fe_ste.tools.versions import TABLE
from fe_ste.transmission_error.compliance import PairCompliance
from fe_ste.transmission_error.states import RESULTS, STATE_AXES, StateAxes, StateResults
from fe_ste.transmission_error.transmission_error import solve_positions

if TYPE_CHECKING:
    import xarray as xr


#: States of a block: some seconds of work, so that little is lost and the time left is known, and a run that is long
#: enough for its first position, which begins from nothing, not to count.
_BLOCK_STATES = 750

#: Seconds between two writings of what is finished.
_STORE_EVERY = 10.0

#: Attribute that ties a file of finished blocks to its input.
_PARTIAL_OF = "partial_of"
_LAYOUT = Layout(
    "finished positions of a table",
    TABLE,
    {"solved": ("pmc", "centre_distance"), "line_load": ("pmc", *STATE_AXES, "tooth", "axial_position")}
    | dict.fromkeys((*RESULTS, "iterations"), ("pmc", *STATE_AXES))
    | dict.fromkeys(("load_share", "tangent_load_share"), ("pmc", *STATE_AXES, "tooth")),
    (_PARTIAL_OF, "failures"),
)
_log = logging.getLogger(__name__)


class GridError(RuntimeError):
    """A grid whose workers were lost; the message says what is kept."""


class GridExecutor(Protocol):
    """What a grid asks of an executor."""

    def submit(self, fn: Callable[..., StateResults], /, *args: object) -> Future[StateResults]:
        """Schedule a call and return its future."""
        ...


@dataclass(frozen=True)
class Checkpoint:
    """File in which a grid keeps the positions that are finished."""

    path: Path
    """Replaced as a whole at each writing, so that it can be read at any time, by xarray too."""
    input_hash: str
    """Hash of the grid's input; a file of another input is not taken up."""

    def load(self, results: StateResults) -> Booleans:
        """Fill `results` with what the file holds; return which positions are finished at which centre distance."""
        nothing = np.zeros(results.shape[::2], dtype=np.bool_)
        if not self.path.exists():
            return nothing
        try:
            stored = load_dataset(self.path, _LAYOUT)
        except FileError as error:
            _log.warning("%s; its positions are computed again", error)
            return nothing
        if stored.attrs[_PARTIAL_OF] != self.input_hash:
            return nothing
        finished = stored["solved"].to_numpy() != 0
        results.restore(stored, finished)
        return np.asarray(finished)

    def store(self, results: StateResults, axes: StateAxes, finished: Booleans) -> None:
        """Write what is finished; the other states are not a number."""
        dataset = results.dataset(axes, all_teeth=True)
        attributes = {"units": "1", "long_name": "whether all states of the position and centre distance are finished"}
        dataset["solved"] = (("pmc", "centre_distance"), finished.astype(np.int8), attributes)
        dataset.attrs |= {_PARTIAL_OF: self.input_hash, "method_version": TABLE}
        write_dataset(self.path, dataset)


@dataclass(frozen=True)
class _Block:
    """Positions in a row at one centre distance."""

    positions: tuple[int, ...]
    distance: int

    def axes(self, axes: StateAxes) -> StateAxes:
        """Axes of the grid at this centre distance alone."""
        return replace(axes, centre_distance=axes.centre_distance[[self.distance]])


def solve_grid(
    compliance: PairCompliance,
    axes: StateAxes,
    *,
    executor: GridExecutor | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Solve a grid of states.

    Parameters
    ----------
    executor : anything with ``submit`` of `concurrent.futures`; without it this process does the work
    checkpoint : where finished positions are kept, and looked for first
    progress
        Called with the number of finished states and of all states. What it raises, such as Ctrl-C, ends the grid
        after the finished positions are stored.

    Returns
    -------
    as of `fe_ste.static_transmission_error`

    Raises
    ------
    GridError
        If workers are lost.
    """
    results = StateResults.empty(compliance, axes.shape)
    finished = checkpoint.load(results) if checkpoint else np.zeros(axes.shape[::2], dtype=np.bool_)
    states_each = math.prod(axes.shape[1::2])
    total = math.prod(axes.shape)

    def tell(within_block: int = 0) -> None:
        if progress is not None:
            progress(int(finished.sum()) * states_each + within_block, total)

    stored = time.monotonic()
    try:
        blocks = _blocks(axes, finished)
        done = (
            ((block, solve_positions(compliance, block.axes(axes), block.positions, tell)) for block in blocks)
            if executor is None
            else _solved_by_workers(compliance, axes, blocks, executor)
        )
        for block, part in done:
            results.insert(block.positions, slice(block.distance, block.distance + 1), part)
            finished[list(block.positions), block.distance] = True
            if executor is not None:
                tell()
            if checkpoint and time.monotonic() - stored > _STORE_EVERY:
                checkpoint.store(results, axes, finished)
                stored = time.monotonic()
    except BaseException:
        if checkpoint and finished.any():
            checkpoint.store(results, axes, finished)
        raise
    return results.dataset(axes)


def _blocks(axes: StateAxes, finished: Booleans) -> list[_Block]:
    """Blocks of which something is still to solve: all runs are about as long."""
    positions, torques, distances, misalignments = axes.shape
    length = max(1, _BLOCK_STATES // (torques * misalignments))
    runs = [tuple(run.tolist()) for run in np.array_split(np.arange(positions), math.ceil(positions / length))]
    blocks = [_Block(run, distance) for distance in range(distances) for run in runs]
    return [block for block in blocks if not finished[list(block.positions), block.distance].all()]


def _solved_by_workers(
    compliance: PairCompliance, axes: StateAxes, blocks: list[_Block], executor: GridExecutor
) -> Iterator[tuple[_Block, StateResults]]:
    """Yield blocks in the order in which workers finish them."""
    # Fewer bytes than all that the compliance of a pair holds: a worker makes it again.
    packed = pickle.dumps(
        (compliance.pair, compliance.flanks, compliance.contact, compliance.modifications, compliance.tooth_gap)
    )
    with _cancelled_on_error(executor) as waiting:
        for block in blocks:
            waiting[executor.submit(solve_block, packed, block.axes(axes), block.positions)] = block
        while waiting:
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                try:
                    yield waiting.pop(future), future.result()
                except BrokenExecutor as error:
                    raise GridError(
                        f"a worker of the grid ended before its work was done ({error}); finished positions are kept"
                    ) from error


@contextmanager
def _cancelled_on_error(executor: GridExecutor) -> Iterator[dict[Future[StateResults], _Block]]:
    waiting: dict[Future[StateResults], _Block] = {}
    try:
        yield waiting
    finally:
        # Workers drop what waits themselves: before Python 3.12 a pool hangs if a process of it ends while calls that
        # were cancelled from outside wait, as when a signal goes to a whole group of processes.
        if not isinstance(executor, Workers):
            for future in waiting:
                future.cancel()


def solve_block(packed: bytes, axes: StateAxes, positions: tuple[int, ...]) -> StateResults:
    """Solve some positions in a worker, which unpacks the compliance of a pair once and stops if it is asked to.

    Parameters
    ----------
    packed : pickled pair, flanks, contact settings, modifications and gaps of the teeth
    """
    stop_if_asked()
    return solve_positions(_unpacked(packed), axes, positions, lambda solved: stop_if_asked())


@lru_cache(maxsize=1)
def _unpacked(packed: bytes) -> PairCompliance:
    pair, flanks, contact, modifications, tooth_gap = pickle.loads(packed)
    return replace(PairCompliance.from_flanks(pair, flanks, contact), modifications=modifications, tooth_gap=tooth_gap)
