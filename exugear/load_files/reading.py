"""A file of loads over time, read by its ending."""

from __future__ import annotations

from pathlib import Path

from exugear.load_files.channels import Channels, LoadFileError
from exugear.load_files.openfast_binary import parse_openfast_binary
from exugear.load_files.tables import parse_headed_series, parse_openfast_text
from fe_ste.tools.files import FileError, open_regular

LARGEST_SERIES = 2_000_000_000
"""Largest file that is read, bytes."""
SERIES_ENDINGS = (".outb", ".out", ".csv")


def read_channels(path: str | Path) -> Channels:
    """Channels over time of OpenFAST's binary (``.outb``) or text (``.out``) output, or of a table with commas.

    Raises
    ------
    LoadFileError
        Another ending, a file that cannot be read, is damaged or holds none.

    Examples
    --------
    >>> series = read_channels("cases/grc750/loads/oc3_hywind_test1.outb")
    >>> series
    <Channels of oc3_hywind_test1.outb: 4 over 6001 steps>
    >>> round(float(series.channel("LSShftTq", "torque").mean()), 1)
    1933623.7
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in SERIES_ENDINGS:
        raise LoadFileError(f"{path}: ends in {ending or 'nothing'}; files of loads end in {', '.join(SERIES_ENDINGS)}")
    content = file_content(path)
    if ending == ".outb":
        return parse_openfast_binary(path, content)
    return (parse_openfast_text if ending == ".out" else parse_headed_series)(path, decoded(content))


def file_content(path: Path) -> bytes:
    """Bytes of a file.

    Raises
    ------
    LoadFileError
        It cannot be read, or has more than `LARGEST_SERIES` bytes.
    """
    try:
        with open_regular(path) as file:
            content = file.read(LARGEST_SERIES + 1)
    except FileError as error:
        raise LoadFileError(str(error)) from None
    if len(content) > LARGEST_SERIES:
        raise LoadFileError(f"{path}: larger than {1e-9 * LARGEST_SERIES:g} GB; cut it")
    return content


def decoded(content: bytes) -> str:
    """Text of UTF-8, or of what older programs write."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")
