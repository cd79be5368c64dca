"""WAV files: samples of integers or floats without names and units; the gearbox file states what full scale is.

A RIFF file is a sequence of chunks, each with a name of four letters and its length in bytes (Microsoft and IBM:
"Multimedia Programming Interface and Data Specifications 1.0", 1991). The length of the data is compared with that of
the file before it is read; SciPy decodes the samples.
"""

from __future__ import annotations

import os
import struct
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

from exugear.exchange.recordings.recording import (
    RecordedChannel,
    Recording,
    RecordingError,
    check_sizes,
    floats,
    places_of,
    recording_of,
)
from fe_ste.tools.files import open_regular

_FORMATS = {1: "integers", 3: "floats", 65534: "extensible"}
_MOST_CHANNELS = 1024
_MOST_CHUNKS = 10_000


def read_wav(path: Path, wanted: Sequence[str] | None = None) -> Recording:
    """All or the wanted channels of a WAV file, named ``channel 1``, ``channel 2``, ... without units.

    Integers are fractions of full scale, -1 to 1; floats are as written.

    Raises
    ------
    RecordingError
        The file is no WAV file, is damaged or truncated, or its samples are compressed.
    """
    from scipy.io import wavfile

    with open_regular(path) as file:
        channels, rate = _checked_header(path, file)
        names = [f"channel {number}" for number in range(1, channels + 1)]
        chosen = places_of(path, names, wanted)
        file.seek(0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)  # chunks that no sample is in
            try:
                _, samples = wavfile.read(file)
            except (ValueError, TypeError, ArithmeticError, EOFError, struct.error) as error:
                raise RecordingError(f"{path}: is a damaged WAV file ({error}); export it again") from None
    columns = samples.reshape(len(samples), -1)
    if columns.shape[1] != channels:
        raise RecordingError(
            f"{path}: is a damaged WAV file: {columns.shape[1]} of {channels} channels; export it again"
        )
    scale, offset = 1.0, 0.0
    if columns.dtype.kind != "f":  # samples of eight bits are unsigned, those of 24 bits in the upper part of 32
        scale = 2.0 ** (8 * columns.dtype.itemsize - 1)
        offset = scale if columns.dtype.kind == "u" else 0.0
    found = [RecordedChannel(names[n], "", (floats(columns[:, n]) - offset) / scale) for n in chosen]
    return recording_of(path, rate, 0.0, found)


def _checked_header(path: Path, file: IO[bytes]) -> tuple[int, float]:
    """Return number of channels and sampling rate (Hz) of a file whose data are as long as its header states."""
    size = os.fstat(file.fileno()).st_size
    layout: tuple[int, int, float, int] | None = None
    for name, begin, length in _chunks(path, file, size):
        if name == b"fmt " and length >= 16 and begin + 16 <= size:
            file.seek(begin)
            kind, channels, rate, _, block, _ = struct.unpack("<HHIIHH", file.read(16))
            if kind not in _FORMATS:
                raise RecordingError(f"{path}: its samples have format {kind}; integers (1) and floats (3) are read")
            layout = kind, channels, float(rate), block
        if name == b"data":
            if layout is None or not 1 <= layout[1] <= _MOST_CHANNELS or layout[3] < layout[1]:
                raise RecordingError(f"{path}: is a damaged WAV file: no valid format before its data; export it again")
            if begin + length > size:
                raise RecordingError(
                    f"{path}: its header states {length} bytes of data and {size - begin} follow; the file is "
                    "truncated, export it again"
                )
            check_sizes(path, "the recording", length // layout[3], layout[2])
            return layout[1], layout[2]
    raise RecordingError(f"{path}: has no chunk of data; export it again")


def _chunks(path: Path, file: IO[bytes], size: int) -> Iterator[tuple[bytes, int, int]]:
    head = file.read(12)
    if len(head) < 12 or head[:4] != b"RIFF" or head[8:] != b"WAVE":
        raise RecordingError(f"{path}: does not begin as a WAV file (RIFF, WAVE); check the extension")
    for _ in range(_MOST_CHUNKS):
        begin = file.tell() + 8
        if begin > size:
            return
        name, length = struct.unpack("<4sI", file.read(8))
        yield name, begin, length
        file.seek(begin + length + length % 2)
