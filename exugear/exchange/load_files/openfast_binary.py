"""Binary output of OpenFAST (``.outb``), all four formats of it.

Little endian: format (int16); in format 4 the length of names (int16), 10 otherwise; numbers of channels and of steps
(int32 each); two float64: in format 1 scale and offset of packed times, else first time and step. Formats 1, 2 and 4
pack values as int16 with a scale and an offset (float32) for each channel, format 3 holds them as float64. Then the
description with its length, the names and units of time and of all channels; in format 1 the packed times (int32); the
values step by step. Packed are ``value * scale + offset`` (OpenFAST documentation, "Output files"; module NWTC_IO).
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np

from exugear.exchange.load_files.channels import Channels, LoadFileError
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError, open_regular

WITH_TIME, WITHOUT_TIME, NOT_COMPRESSED, LONG_NAMES = 1, 2, 3, 4
"""Formats of the file, by its first number."""
BLOCK = 4_000_000
"""Bytes of values that are in memory at once."""
_NAME_LENGTH = 10
_LONGEST_NAME = 1000
_MOST_CHANNELS = 100_000


@dataclass
class _Reader:
    """A file, taken from the front; nothing is taken that it does not hold."""

    path: Path
    file: IO[bytes]
    size: int

    def bytes(self, count: int, what: str) -> bytes:
        self.demand(count, what)
        return self.file.read(count)

    def demand(self, count: int, what: str) -> None:
        end = self.file.tell() + count
        if count < 0 or end > self.size:
            raise LoadFileError(
                f"{self.path}: cut short in its {what}: {end} bytes are needed, the file has {self.size}"
            )

    def numbers(self, form: str, what: str) -> tuple[float, ...]:
        return struct.unpack(f"<{form}", self.bytes(struct.calcsize(f"<{form}"), what))

    def array(self, kind: str, count: int, what: str) -> Floats:
        size = np.dtype(kind).itemsize
        return np.frombuffer(self.bytes(size * count, what), dtype=f"<{kind}").astype(np.float64)

    def texts(self, count: int, length: int, what: str) -> tuple[str, ...]:
        raw = self.bytes(count * length, what)
        return tuple(raw[k * length : (k + 1) * length].decode("latin-1").strip() for k in range(count))


@dataclass(frozen=True, eq=False)
class _Layout:
    """What the head of a file says of its values."""

    kind: int
    steps: int
    first: float
    second: float
    """Scale and offset of packed times, or first time and step."""
    scales: Floats
    offsets: Floats
    """(channels,)"""
    names: tuple[str, ...]
    units: tuple[str, ...]
    """Time first."""
    times: int
    rows: int
    """Places of packed times and of the first row, bytes."""

    @property
    def value(self) -> np.dtype:
        """Type of a value."""
        return np.dtype("<f8" if self.kind == NOT_COMPRESSED else "<i2")


def open_openfast_binary(path: Path) -> Channels:
    """Channels of an OpenFAST binary file; bytes behind its declared steps are left alone, as some files have them.

    Raises
    ------
    LoadFileError
        Another format, or a file that ends before its data; its length is looked at before anything is allocated.
    """
    try:
        with open_regular(path) as file:
            layout = _layout(_Reader(path, file, os.fstat(file.fileno()).st_size))
    except FileError as error:
        raise LoadFileError(str(error)) from None

    def read(places: tuple[int, ...]) -> Iterator[tuple[Floats, Floats]]:
        return _blocks(path, layout, places)

    return Channels(path, layout.names[1:], layout.units[1:], layout.units[0], read)


def _layout(reader: _Reader) -> _Layout:
    path = reader.path
    (kind,) = reader.numbers("h", "format")
    if kind not in (WITH_TIME, WITHOUT_TIME, NOT_COMPRESSED, LONG_NAMES):
        raise LoadFileError(f"{path}: its first number is {kind:g}; OpenFAST binary files begin with 1, 2, 3 or 4")
    (length,) = reader.numbers("h", "length of names") if kind == LONG_NAMES else (_NAME_LENGTH,)
    channels, steps = (int(number) for number in reader.numbers("ii", "numbers of channels and steps"))
    if not (0 < channels <= _MOST_CHANNELS and steps > 0 and 0 < length <= _LONGEST_NAME):
        raise LoadFileError(f"{path}: declares {channels} channels, {steps} steps and names of {length:g} letters")
    first, second = reader.numbers("dd", "times")
    scales = np.ones(channels)
    offsets = np.zeros(channels)
    if kind != NOT_COMPRESSED:
        scales = reader.array("f4", channels, "scales")
        offsets = reader.array("f4", channels, "offsets")
    (described,) = reader.numbers("i", "description")
    reader.bytes(int(described), "description")
    names = reader.texts(channels + 1, int(length), "names")
    units = reader.texts(channels + 1, int(length), "units")
    times = reader.file.tell()
    rows = times + (4 * steps if kind == WITH_TIME else 0)
    reader.demand(rows - times, "times")
    if np.any(scales == 0.0):
        raise LoadFileError(f"{path}: channel {names[1 + int(np.argmin(scales != 0.0))]} has the scale 0; damaged")
    layout = _Layout(int(kind), steps, first, second, scales, offsets, names, units, times, rows)
    reader.demand(rows - times + steps * channels * layout.value.itemsize, "values")
    return layout


def _blocks(path: Path, layout: _Layout, places: tuple[int, ...]) -> Iterator[tuple[Floats, Floats]]:
    """Give time and the values of some channels, in the units of the file, by blocks of steps."""
    chosen = list(places)
    width = len(layout.scales) * layout.value.itemsize
    each = max(1, BLOCK // width)
    with open_regular(path) as file:
        for begin in range(0, layout.steps, each):
            count = min(each, layout.steps - begin)
            time: Floats = layout.first + layout.second * np.arange(begin, begin + count, dtype=np.float64)
            if layout.kind == WITH_TIME:
                file.seek(layout.times + 4 * begin)
                packed = np.frombuffer(file.read(4 * count), dtype="<i4").astype(np.float64)
                time = (packed - layout.second) / layout.first
            file.seek(layout.rows + width * begin)
            rows = np.frombuffer(file.read(width * count), dtype=layout.value).reshape(count, -1)[:, chosen]
            yield time, (rows.astype(np.float64) - layout.offsets[chosen]) / layout.scales[chosen]
