"""How large a run is: its samples, steps, memory and disk, checked before anything is allocated or written."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import LoadCase
from exugear.gearbox.reading import CaseError
from exugear.results.decimation import TAPS_PER_FACTOR
from exugear.system.signals import AXES, SignalLayout, signals_of

SAMPLE_RATE = 20e3
"""Stored rate, Hz."""
LEAST_SAMPLES = 8
"""Stored samples that a spectrum needs at least."""
MOST_STEPS_PER_SAMPLE = 1000
"""Steps between two stored samples at most: 5e-8 s at 20 kHz, for a motion of 6 MHz, which no gearbox has.

The anti-aliasing filter reaches over 31 times as many steps, and a simulated second takes minutes to hours.
"""
BUFFER_BYTES = 1 << 30
"""Memory of what is kept between two writes at most."""


def check_duration(
    gearbox: Gearbox, case: LoadCase, duration: float | None = None, sample_rate: float = SAMPLE_RATE
) -> None:
    """Refuse a simulated time (s; the load case's by default) that is no number or leaves too few samples.

    The anti-aliasing filter needs half its length of signal on both sides of each sample.
    """
    total, key = _span(gearbox, case, duration)
    if not math.isfinite(total):
        raise CaseError(f"{key} = {total:g}: give a finite number of seconds")
    least = (TAPS_PER_FACTOR + LEAST_SAMPLES) / sample_rate
    if total < least:
        raise CaseError(
            f"{key} = {total:g}: too short for a spectrum, since filtering takes {TAPS_PER_FACTOR / sample_rate:.3g} s "
            f"at the ends; give {least:.3g} s or more"
        )


def check_disk(
    gearbox: Gearbox,
    case: LoadCase,
    folder: Path,
    duration: float | None = None,
    sample_rate: float = SAMPLE_RATE,
    *,
    sample_bytes: int,
) -> None:
    """Refuse a simulated time (s) whose results do not fit on the disk of a folder, which need not be there yet."""
    total, key = _span(gearbox, case, duration)
    there = next(parent for parent in (folder.absolute(), *folder.absolute().parents) if parent.is_dir())
    needed = total * sample_rate * sample_bytes
    free = shutil.disk_usage(there).free
    if needed > free:
        raise CaseError(
            f"{key} = {total:g}: {total * sample_rate:.3g} samples take {1e-9 * needed:.3g} GB, and {there} has "
            f"{1e-9 * free:.3g} GB free; give at most {free / (sample_rate * sample_bytes):.3g} s"
        )


def sample_bytes(meshes: int, supports: int, tabled: bool, jointed: bool = False) -> int:
    """Size of one sample on disk, of a run with so many meshes and supports.

    Parameters
    ----------
    tabled : whether its mesh law is `table`, which has further signals
    jointed : whether supports are ideal joints, which have fewer

    Examples
    --------
    >>> sample_bytes(meshes=8, supports=12, tabled=False)
    384
    >>> sample_bytes(meshes=8, supports=12, tabled=False, jointed=True)
    240
    """
    names = {"mesh": ("",) * meshes, "support": ("",) * supports, "axis": AXES}
    return SignalLayout(signals_of(tabled, jointed), names, radius=1.0).sample_bytes


def too_fine(step: float, total: float, sample_rate: float) -> str:
    """Reason why a step (s) is absurdly small, empty if it is not.

    Examples
    --------
    >>> too_fine(2.5e-5, 30.0, 20e3)
    ''
    >>> too_fine(1e-12, 30.0, 20e3)
    'step = 1e-12 s: 3e+13 steps, 5e+07 for each stored sample; at most 1000 are taken, a step of 5e-08 s'
    """
    each = 1.0 / (step * sample_rate)
    if each <= MOST_STEPS_PER_SAMPLE * (1.0 + 1e-9):
        return ""
    return (
        f"step = {step:.3g} s: {total / step:.3g} steps, {each:.3g} for each stored sample; at most "
        f"{MOST_STEPS_PER_SAMPLE} are taken, a step of {1.0 / (MOST_STEPS_PER_SAMPLE * sample_rate):.3g} s"
    )


def buffer_rows(wanted: float, size: int, signals: int) -> int:
    """Count the steps between two writes: as many as wanted, as far as their states and signals fit into memory.

    Parameters
    ----------
    wanted : steps
    size, signals : coordinates and signals of a step

    Examples
    --------
    >>> buffer_rows(40000, size=60, signals=60), buffer_rows(1e12, size=60, signals=60)
    (40000, 209715)
    """
    numbers = 4 * size + 6 * signals + 40  # two buffers of states, signals and energies; the filter and the judge
    return max(1, min(round(wanted), BUFFER_BYTES // (8 * numbers)))


def _span(gearbox: Gearbox, case: LoadCase, duration: float | None) -> tuple[float, str]:
    """Find the simulated time (s), and where it is given."""
    if duration is not None:
        return duration, "duration"
    return case.duration, f"{gearbox.source}: load_cases.{case.name}.duration_s"
