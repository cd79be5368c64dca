"""HDF5 and netCDF 4 files: one-dimensional datasets of numbers as channels, with a time axis or a sampling rate.

Units are in the attribute ``units`` of a dataset, as netCDF has them; `scale_factor` and `add_offset` of packed values
are applied (netCDF Climate and Forecast conventions, section 8.1). The sampling rate follows from a dataset ``time``,
or it is an attribute ``sample_rate`` in Hz, of the dataset, of its group or of the file.

A few hundred bytes of HDF5 may declare any size, and datasets and links may be in other files. Sizes are compared with
the length of the file before anything is read, and nothing outside the file is opened.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from exugear.exchange.recordings.recording import (
    FEWEST_SAMPLES,
    RecordedChannel,
    Recording,
    RecordingError,
    check_sizes,
    common_rate,
    even_rate,
    floats,
    places_of,
    recording_of,
)
from exugear.gearbox.units import unit_of
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import open_regular

TIMES = ("time", "time_s", "t", "x", "timestamp")
"""Names of datasets with the times of the samples, without group."""
RATES = ("sample_rate", "sampling_rate", "sampling_frequency", "sample_rate_Hz", "sampling_rate_Hz", "rate", "fs")
"""Names of attributes with the sampling rate, Hz."""
_UNITS = ("units", "unit", "Units", "Unit")
_DEEPEST = 4
_MOST_OBJECTS = 10_000
_MOST_TIMES_THE_FILE = 1000
"""Largest size of values over that of the file: compression by deflate ends there (zlib, technical details)."""


def read_hdf5(path: Path, wanted: Sequence[str] | None = None) -> Recording:
    """Channels of an HDF5 or netCDF 4 file; a channel in a group is named ``group/name``.

    Parameters
    ----------
    wanted : names of the channels; by default all that are as long as the longest

    Raises
    ------
    RecordingError
        The file has no channels, no time axis, is damaged, or its values are larger than the file can hold.
    """
    with _open(path) as (file, size):
        found = dict(_datasets(path, file))
        times = {name: data for name, data in found.items() if _is_time(name, data)}
        signals = {name: data for name, data in found.items() if name not in times}
        longest = max((data.shape[0] for data in signals.values()), default=0)
        names = [name for name, data in signals.items() if wanted is not None or data.shape[0] == longest]
        if not names or longest < FEWEST_SAMPLES:
            raise RecordingError(f"{path}: has no one-dimensional datasets of numbers; export the channels as such")
        chosen = [names[place] for place in places_of(path, names, wanted)]
        for name in (*chosen, *times):
            declared = found[name].shape[0] * found[name].dtype.itemsize
            if declared > _MOST_TIMES_THE_FILE * size:
                raise RecordingError(
                    f"{path}: dataset {name} declares {declared:g} bytes, more than a file of {size} bytes can hold; "
                    "export it again"
                )
            check_sizes(path, f"dataset {name}", found[name].shape[0], 1.0)
        axes = [_time(path, name, signals[name], times) for name in chosen]
        rate = common_rate(path, chosen, [rate for rate, _ in axes])
        channels = [RecordedChannel(name, _unit(signals[name]), _values(signals[name])) for name in chosen]
    return recording_of(path, rate, axes[0][1], channels)


def _is_time(name: str, data: h5py.Dataset) -> bool:
    """Return whether a dataset has the times of samples, by name and unit: T in N m is a channel."""
    unit = unit_of(_unit(data).partition(" since ")[0] or "s", any_case=True)
    return name.rpartition("/")[2].lower() in TIMES and (unit is None or unit.quantity == "time")


@contextmanager
def _open(path: Path) -> Iterator[tuple[h5py.File, int]]:
    """Open a file, and give its length; whatever HDF5 raises about a damaged one is one clear error."""
    with open_regular(path) as raw:
        try:
            with h5py.File(raw, "r") as file:
                yield file, os.fstat(raw.fileno()).st_size
        except (RecordingError, MemoryError):
            raise
        # HDF5 and h5py raise what they like about a damaged file: OSError, KeyError, RuntimeError, TypeError, ...
        except Exception as error:
            reason = str(error).partition("(")[0].strip() or type(error).__name__
            raise RecordingError(
                f"{path}: is no HDF5 or netCDF 4 file, or damaged ({reason}); export it again"
            ) from None


def _datasets(path: Path, group: h5py.Group, before: str = "", depth: int = 0) -> Iterator[tuple[str, h5py.Dataset]]:
    """Yield the one-dimensional datasets of numbers that are in this file itself."""
    if len(group) > _MOST_OBJECTS:
        raise RecordingError(f"{path}: has more than {_MOST_OBJECTS} objects; export the channels alone")
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue  # a link may lead into another file
        item = group[name]
        if isinstance(item, h5py.Group) and depth < _DEEPEST:
            yield from _datasets(path, item, f"{before}{name}/", depth + 1)
        # one dimension, and numbers in this file itself
        elif isinstance(item, h5py.Dataset) and (
            len(item.shape or ()) == 1 and item.dtype.kind in "iuf" and not (item.external or item.is_virtual)
        ):
            yield f"{before}{name}", item


def _time(path: Path, name: str, data: h5py.Dataset, times: dict[str, h5py.Dataset]) -> tuple[float, float]:
    """Return sampling rate (Hz) and first time (s) of a channel: of its attribute, or of the time axis next to it."""
    for holder in (data, data.parent, data.file):
        for key in RATES:
            if key in holder.attrs:
                rate = _number(holder.attrs[key])
                check_sizes(path, f"dataset {name}", data.shape[0], rate)
                return rate, 0.0
    group = name.rpartition("/")[0]
    near = sorted(times, key=lambda own: (own.rpartition("/")[0] != group, own))
    axis = next((own for own in near if times[own].shape == data.shape), None)
    if axis is None:
        raise RecordingError(
            f"{path}: dataset {name} has no time axis of its length and no sampling rate; add a dataset time in s, or "
            f"the attribute {RATES[0]} in Hz"
        )
    unit = unit_of(_unit(times[axis]).partition(" since ")[0] or "s", any_case=True)
    if unit is None or unit.quantity != "time":
        raise RecordingError(f"{path}: dataset {axis} has the unit {_unit(times[axis])!r}; expected s or ms")
    seconds = unit.factor * _values(times[axis])
    return even_rate(path, seconds), float(seconds[0])


def _values(data: h5py.Dataset) -> Floats:
    return floats(data[:]) * _factor(data, "scale_factor", 1.0) + _factor(data, "add_offset", 0.0)


def _factor(data: h5py.Dataset, key: str, usual: float) -> float:
    return _number(data.attrs[key]) if key in data.attrs else usual


def _number(value: Any) -> float:
    """Return a number of an attribute; NaN for anything else."""
    try:
        return float(np.asarray(value).reshape(-1)[0])
    except (ValueError, TypeError, IndexError):
        return math.nan


def _unit(data: h5py.Dataset) -> str:
    """Return the unit as written in the file; empty without any."""
    value = next((data.attrs[key] for key in _UNITS if key in data.attrs), "")
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
