"""The results folder: the case it belongs to, whether a file fits that case, and where the time went."""

from __future__ import annotations

import hashlib
import json
import logging
import math
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import NOTHING_MORE, Permissions
from exugear.gearbox.reading import CaseError, parsed
from fe_ste.tools.files import FileError, append_line, read_text, write_file

CASE_FILE = "case.json"
TIMES_FILE = "times.jsonl"
REPORT_FILE = "report.html"
_log = logging.getLogger(__name__)


def keep_case(gearbox: Gearbox, folder: Path) -> None:
    """Write the content of the gearbox file into the results folder, so that a report needs nothing else."""
    kept = {"source": str(Path(gearbox.source).resolve()), "content": gearbox.content}
    write_file(folder / CASE_FILE, json.dumps({**kept, "checksum": _checksum(kept)}, indent=1).encode("utf-8"))


def _checksum(kept: dict[str, Any]) -> str:
    """Checksum of a case as it is kept, however it is set out."""
    text = json.dumps([kept["source"], kept["content"]], sort_keys=True)
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def kept_case(folder: Path, permissions: Permissions = NOTHING_MORE) -> Gearbox:
    """Read the gearbox that the results of a folder belong to.

    Parameters
    ----------
    permissions : where else files that the gearbox file names may lie

    Raises
    ------
    CaseError
        The folder holds no results, or what it says of its case cannot be used.
    """
    path = folder / CASE_FILE
    if not path.is_file():
        raise CaseError(f"{folder}: holds no results (no {CASE_FILE}); name the folder that `exugear run` wrote into")
    try:
        kept = parsed(lambda: json.loads(read_text(path)), str(path), "JSON")
        if not isinstance(kept, dict):
            raise ValueError("it holds no case")
        if "checksum" not in kept:
            raise ValueError("it was written by an earlier version")
        if kept["checksum"] != _checksum(kept):
            raise ValueError("it was changed since it was written")
        content = kept["content"]
        source = kept["source"]
    # Whoever makes up a file with its checksum may write into it what he likes.
    except (FileError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise CaseError(f"{path}: cannot be used ({error}); run `exugear modes` into this folder again") from error
    return Gearbox.from_dict(content, source, permissions)


def modes_path(folder: str | Path, choice: Choice) -> Path:
    """Place of the modes of a choice that names its inertia set: ``<variant>/<law>-<inertias>/modes.nc``."""
    return Path(folder) / choice.variant / f"{choice.mesh_law}-{choice.inertias}" / "modes.nc"


def bearings_path(folder: str | Path, choice: Choice) -> Path:
    """Place of what the bearings of a choice bear: beside its modes."""
    return modes_path(folder, choice).with_name("bearings.json")


def bodies_folder(folder: Path) -> Path:
    """Place of the reductions of elastic bodies: ``bodies``."""
    return folder / "bodies"


@dataclass(frozen=True)
class Spent:
    """What a step of the work took."""

    step: str
    """What was done."""
    seconds: float
    """Wall time."""
    memory: float
    """Peak of the process's memory, bytes."""


def peak_memory() -> float:
    """Highest memory of this process so far, bytes; NaN on Windows."""
    if sys.platform == "win32":
        return math.nan  # no such account without a further library
    import resource

    peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return peak if sys.platform == "darwin" else 1024.0 * peak  # Linux counts in KiB


def note_time(folder: Path, step: str, seconds: float) -> None:
    """Add a line to the folder's account of time; processes may do so at once."""
    append_line(folder / TIMES_FILE, json.dumps(asdict(Spent(step, round(seconds, 2), peak_memory()))))


@contextmanager
def time_noted(folder: Path, step: str) -> Iterator[None]:
    """Note how long a step took, if it ended well; a folder that cannot be written then costs the note alone."""
    start = time.perf_counter()
    yield
    try:
        note_time(folder, step, time.perf_counter() - start)
    except OSError as error:  # the work itself is done
        _log.warning("The time that it took is not noted: %s", error)


def times_spent(folder: Path) -> tuple[Spent, ...]:
    """Last account of each step, in the order in which the steps were last done."""
    last: dict[str, Spent] = {}
    for entry in _lines(folder / TIMES_FILE):
        last.pop(entry.step, None)
        last[entry.step] = entry
    return tuple(last.values())


def _lines(path: Path) -> Iterator[Spent]:
    try:
        lines = read_text(path).splitlines()
    except FileError:
        return  # an account that is missing or is none
    for line in lines:
        try:
            values: dict[str, Any] = json.loads(line)
            spent = Spent(str(values["step"]), float(values["seconds"]), float(values["memory"]))
        except (ValueError, KeyError, TypeError, RecursionError, OverflowError):
            continue  # a line cut short by a kill says nothing
        if math.isfinite(spent.seconds):
            yield spent


def run_directory(out: str | Path, choice: Choice) -> Path:
    """Directory of a run: ``<variant>/<load case>-<law>-<inertias>`` in the results directory.

    Nothing in the choice is left open (`Choice.of`).
    """
    return Path(out) / choice.variant / f"{choice.load_case}-{choice.mesh_law}-{choice.inertias}"
