"""What all benchmarks share: clocks, medians, facts about the machine, runs in a process of their own."""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
CASE = ROOT / "cases" / "grc750" / "gearbox.toml"
LIBRARIES = ("exudyn", "numba", "numpy", "scipy", "pypardiso")


@dataclass(frozen=True)
class Cost:
    """Wall time and processor time, s."""

    wall: float
    processor: float


def timed(work: Callable[[], object]) -> Cost:
    """Cost of a piece of work in this process and in those that it starts and ends."""
    wall, processor = time.perf_counter(), _processor_time()
    work()
    return Cost(time.perf_counter() - wall, _processor_time() - processor)


def _processor_time() -> float:
    """Processor time of this process, and of those that it started and that have ended, s."""
    own = os.times()
    return time.process_time() + own.children_user + own.children_system


def median(values: Iterable[float]) -> float:
    """Median of some figures."""
    return float(statistics.median(values))


def median_row(rows: list[dict[str, Any]], key: str) -> dict[str, Any]:
    """Row with the median of one of its figures."""
    return sorted(rows, key=lambda row: float(row[key]))[len(rows) // 2]


def peak_memory() -> float:
    """Highest memory of this process so far, MB.

    Linux hands the account of ``getrusage`` down to children, so its own count is read where it is there.
    """
    status = Path("/proc/self/status")
    if status.exists():
        lines = status.read_text(encoding="utf-8").splitlines()
        return float(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1024.0
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def load() -> float:
    """Load average over the last minute; a benchmark that went before counts, too."""
    return round(os.getloadavg()[0], 2)


def cores_busy(seconds: float = 3.0) -> float | None:
    """Cores that others use while this process sleeps; None where the system does not tell as Linux does."""
    account = Path("/proc/stat")
    if not account.exists():
        return None
    counts = []
    for pause in (seconds, 0.0):
        user, nice, system, idle, waiting = (int(word) for word in account.read_text().splitlines()[0].split()[1:6])
        counts.append((user + nice + system, idle + waiting))
        time.sleep(pause)
    (busy, idle), (busy_then, idle_then) = counts
    share = (busy_then - busy) / max(1, busy_then - busy + idle_then - idle)
    return round(share * (os.cpu_count() or 1), 2)


def machine() -> dict[str, Any]:
    """Tell what runs here: cores, processor, versions."""
    return {
        "cores": os.cpu_count(),
        "processor": _processor(),
        "python": platform.python_version(),
        **{name: _version(name) for name in LIBRARIES},
    }


def _processor() -> str:
    """Name of the processor as Linux tells it, else its kind."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def environment(**more: str) -> dict[str, str]:
    """Environment of a process of this copy of the program, with one BLAS thread as the command line sets it.

    Gears that are known from before are not taken from their files: what is measured begins from nothing. Python
    keeps its bytecode, as it does wherever nobody forbids it.
    """
    own = {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1", "EXUGEAR_FLANKS": "off"}
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**inherited, **own, **more}


def start(script: str, *arguments: str, **more: str) -> subprocess.Popen[str]:
    """Start one of these scripts in a process of its own, with `more` in its environment; it prints JSON."""
    command = [sys.executable, str(Path(__file__).with_name(script)), *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment(**more))


def result(process: subprocess.Popen[str]) -> Any:
    """Wait for such a process and read what it prints."""
    text = process.communicate()[0]
    if process.returncode:
        raise RuntimeError(f"{process.args} ended with {process.returncode}")
    return json.loads(text)


def say(text: str) -> None:
    """Tell on standard error how far it is."""
    sys.stderr.write(text + "\n")
