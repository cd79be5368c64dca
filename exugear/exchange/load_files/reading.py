"""A file of loads over time, read by its ending."""

from __future__ import annotations

import hashlib
from pathlib import Path

from exugear.exchange.load_files.channels import Channels, LoadFileError
from exugear.exchange.load_files.openfast_binary import open_openfast_binary
from exugear.exchange.load_files.tables import open_headed_series, open_openfast_text
from fe_ste.tools.files import FileError, open_regular

LARGEST_SERIES = 2_000_000_000
"""Largest file that is read, bytes."""
_BLOCK = 1_000_000
SERIES_ENDINGS = (".outb", ".out", ".csv")


_OPENED = {".outb": open_openfast_binary, ".out": open_openfast_text, ".csv": open_headed_series}


def read_channels(path: str | Path) -> Channels:
    """Channels over time of OpenFAST's binary (``.outb``) or text (``.out``) output, or of a table with commas.

    Values are read in blocks when they are asked for.

    Raises
    ------
    LoadFileError
        Another ending, a file that cannot be read, is damaged or holds none.

    Examples
    --------
    >>> series = read_channels("cases/grc750/loads/oc3_hywind_test1.outb")
    >>> series
    <Channels of oc3_hywind_test1.outb: RotTorq, RotSpeed, GenTq, WindVxi>
    >>> round(float(series.channel("LSShftTq", "torque").mean()), 1)
    1933623.7
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in SERIES_ENDINGS:
        raise LoadFileError(f"{path}: ends in {ending or 'nothing'}; files of loads end in {', '.join(SERIES_ENDINGS)}")
    return _OPENED[ending](path)


def file_digest(path: Path) -> str:
    """SHA-256 of a file.

    Raises
    ------
    LoadFileError
        It cannot be read.
    """
    try:
        with open_regular(path) as file:
            digest = hashlib.sha256()
            while block := file.read(_BLOCK):
                digest.update(block)
            return digest.hexdigest()
    except FileError as error:
        raise LoadFileError(str(error)) from None
