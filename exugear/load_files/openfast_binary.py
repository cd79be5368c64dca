"""Binary output of OpenFAST (``.outb``), all four formats of it.

Little endian: format (int16); in format 4 the length of names (int16), 10 otherwise; numbers of channels and of steps
(int32 each); two float64: in format 1 scale and offset of packed times, else first time and step. Formats 1, 2 and 4
pack values as int16 with a scale and an offset (float32) for each channel, format 3 holds them as float64. Then the
description with its length, the names and units of time and of all channels; in format 1 the packed times (int32); the
values step by step. Packed are ``value * scale + offset`` (OpenFAST documentation, "Output files"; module NWTC_IO).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exugear.load_files.channels import Channels, LoadFileError
from fe_ste.tools.arrays import Floats

WITH_TIME, WITHOUT_TIME, NOT_COMPRESSED, LONG_NAMES = 1, 2, 3, 4
"""Formats of the file, by its first number."""
_NAME_LENGTH = 10
_LONGEST_NAME = 1000
_MOST_CHANNELS = 100_000


@dataclass
class _Reader:
    """Bytes of a file, taken from the front."""

    path: Path
    content: bytes
    place: int = 0

    def bytes(self, count: int, what: str) -> bytes:
        end = self.place + count
        if count < 0 or end > len(self.content):
            raise LoadFileError(
                f"{self.path}: cut short in its {what}: {end} bytes are needed, the file has {len(self.content)}"
            )
        taken, self.place = self.content[self.place : end], end
        return taken

    def numbers(self, form: str, what: str) -> tuple[float, ...]:
        return struct.unpack(f"<{form}", self.bytes(struct.calcsize(f"<{form}"), what))

    def array(self, kind: str, count: int, what: str) -> Floats:
        size = np.dtype(kind).itemsize
        return np.frombuffer(self.bytes(size * count, what), dtype=f"<{kind}").astype(np.float64)

    def texts(self, count: int, length: int, what: str) -> tuple[str, ...]:
        raw = self.bytes(count * length, what)
        return tuple(raw[k * length : (k + 1) * length].decode("latin-1").strip() for k in range(count))


def parse_openfast_binary(path: Path, content: bytes) -> Channels:
    """Channels of an OpenFAST binary file; bytes behind its declared steps are left alone, as some files have them.

    Parameters
    ----------
    path : Path
        For messages.
    content : bytes

    Raises
    ------
    LoadFileError
        Another format, or a file that ends before its data.
    """
    reader = _Reader(path, content)
    (kind,) = reader.numbers("h", "format")
    if kind not in (WITH_TIME, WITHOUT_TIME, NOT_COMPRESSED, LONG_NAMES):
        raise LoadFileError(f"{path}: its first number is {kind:g}; OpenFAST binary files begin with 1, 2, 3 or 4")
    (length,) = reader.numbers("h", "length of names") if kind == LONG_NAMES else (_NAME_LENGTH,)
    channels, steps = (int(number) for number in reader.numbers("ii", "numbers of channels and steps"))
    if not (0 < channels <= _MOST_CHANNELS and steps > 0 and 0 < length <= _LONGEST_NAME):
        raise LoadFileError(f"{path}: declares {channels} channels, {steps} steps and names of {length:g} letters")
    first, second = reader.numbers("dd", "times")
    scales, offsets = np.ones(channels), np.zeros(channels)
    if kind != NOT_COMPRESSED:
        scales = reader.array("f4", channels, "scales")
        offsets = reader.array("f4", channels, "offsets")
    (described,) = reader.numbers("i", "description")
    reader.bytes(int(described), "description")
    names = reader.texts(channels + 1, int(length), "names")
    units = reader.texts(channels + 1, int(length), "units")
    time: Floats = first + second * np.arange(steps, dtype=np.float64)
    if kind == WITH_TIME:
        time = (reader.array("i4", steps, "times") - second) / first
    rows = reader.array("f8" if kind == NOT_COMPRESSED else "i2", steps * channels, "values")
    if np.any(scales == 0.0):
        raise LoadFileError(f"{path}: channel {names[1 + int(np.argmin(scales != 0.0))]} has the scale 0; damaged")
    return Channels(path, names[1:], units[1:], time, (rows.reshape(steps, channels) - offsets) / scales)
