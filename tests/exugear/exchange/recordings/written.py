"""Recordings in every format, as programs for measurements write them."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
from scipy.io import wavfile


def unv_set(
    values: np.ndarray,
    rate: float,
    title: str = "NONE",
    unit: str = "m/s2",
    node: int = 1,
    *,
    binary: str = "",
    double: bool = False,
    **changes: object,
) -> bytes:
    """Data set 58 as its format is published; `binary` is the byte order, `changes` replace fields of the header."""
    field = {"kind": 1, "count": len(values), "even": 1, "type": 4 if double else 2, "step": 1.0 / rate, "axis": 17}
    field |= changes
    content = np.asarray(values, dtype=f"{binary or '<'}{'f8' if double else 'f4'}").tobytes()
    field.setdefault("bytes", len(content))
    order = {"<": 1, ">": 2}.get(binary, 0)
    first = "    58" + (f"b{order:6d}{2:6d}{11:12d}{field['bytes']:12d}" + 4 * f"{0:6d}" if binary else "")
    lines = [
        "    -1",
        first,
        title,
        *["NONE"] * 4,
        f"{field['kind']:5d}{0:10d}{0:5d}{0:10d} {'HOUSING':10s}{node:10d}{3:4d} {'NONE':10s}{0:10d}{0:4d}",
        f"{field['type']:10d}{field['count']:10d}{field['even']:10d}{0.0:13.5e}{field['step']:13.5e}{0.0:13.5e}",
        f"{field['axis']:10d}{0:5d}{0:5d}{0:5d} {'Time':20s} {'s':20s}",
        f"{12:10d}{0:5d}{0:5d}{0:5d} {'Acceleration':20s} {unit:20s}",
        *[f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}"] * 2,
    ]
    text = ("\n".join(lines) + "\n").encode("utf-8")
    if not binary:
        form, each = ("%20.12E", 4) if double else ("%13.5E", 6)
        words = [form % value for value in values]
        content = "".join("".join(words[at : at + each]) + "\n" for at in range(0, len(words), each)).encode()
    return text + content + b"    -1\n"


def wav(path: Path, rate: int, columns: np.ndarray) -> Path:
    wavfile.write(path, rate, columns)
    return path


def hdf5(path: Path, channels: Mapping[str, np.ndarray], rate: float, units: Mapping[str, str]) -> Path:
    with h5py.File(path, "w") as file:
        for name, values in channels.items():
            file[name] = values
            file[name].attrs["units"] = units.get(name, "")
        file["time"] = np.arange(len(values)) / rate
        file["time"].attrs["units"] = "s"
    return path


def csv(path: Path, headings: str, rate: float, columns: np.ndarray, separator: str = ",") -> Path:
    rows = [separator.join(f"{value:.9g}" for value in row) for row in np.c_[np.arange(len(columns)) / rate, columns]]
    path.write_text("\n".join([headings, *rows]) + "\n", encoding="utf-8")
    return path


def wav_header(length: int, rate: int = 8000, channels: int = 1, kind: int = 3, bits: int = 32) -> bytes:
    """Header of a WAV file that states so many bytes of data."""
    block = channels * bits // 8
    form = struct.pack("<HHIIHH", kind, channels, rate, rate * block, block, bits)
    return (
        b"RIFF"
        + struct.pack("<I", 36)
        + b"WAVEfmt "
        + struct.pack("<I", 16)
        + form
        + b"data"
        + struct.pack("<I", length)
    )
