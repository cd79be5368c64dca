"""Recordings by their extension: universal files, comma-separated tables, WAV, HDF5, netCDF and MDF files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from exugear.exchange.recordings.mdf4 import read_mdf
from exugear.exchange.recordings.recording import Recording, RecordingError
from exugear.exchange.recordings.tables import read_table
from exugear.exchange.recordings.unv58 import read_unv
from exugear.exchange.recordings.wav import read_wav
from exugear.exchange.series_files import LARGEST_SERIES
from exugear.gearbox.named_files import NamedFileError, check_regular
from fe_ste.tools.files import FileError

RECORDING_ENDINGS = (".unv", ".uff", ".uf", ".58", ".csv", ".txt", ".wav", ".h5", ".hdf5", ".nc", ".mf4", ".mdf")


def read_recording(path: str | Path, channels: Sequence[str] | None = None) -> Recording:
    r"""Read channels of a measurement; the format follows from the extension.

    Parameters
    ----------
    path : universal file (``.unv``, ``.uff``, ``.uf``, ``.58``), table (``.csv``, ``.txt``), ``.wav``, HDF5 (``.h5``,
        ``.hdf5``), netCDF 4 (``.nc``) or, with asammdf, MDF (``.mf4``, ``.mdf``) file
    channels : names of the channels, in upper or lower case; all by default

    Raises
    ------
    RecordingError
        The extension is unknown, the file cannot be read, is damaged, truncated or too large, has no such channel, or
        its channels differ in length or have gaps.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "bench.csv"
    ...     rows = "\n".join(f"{n / 100:.2f},{n % 7},{1000 + n}" for n in range(50))
    ...     _ = path.write_text(f"time_s,left_m_per_s2,n / rpm\n{rows}\n")
    ...     recording = read_recording(path)
    >>> recording
    <Recording of bench.csv: 50 samples at 100 Hz, left, n>
    >>> [channel.quantity for channel in recording.channels]
    ['acceleration', 'speed']
    """
    path = Path(path)
    ending = path.suffix.lower()
    try:
        check_regular(path, LARGEST_SERIES)
        if ending in (".unv", ".uff", ".uf", ".58"):
            return read_unv(path, channels)
        if ending in (".csv", ".txt"):
            return read_table(path, channels)
        if ending == ".wav":
            return read_wav(path, channels)
        if ending in (".h5", ".hdf5", ".nc"):
            from exugear.exchange.recordings.hdf5 import read_hdf5  # a library that other formats do not need

            return read_hdf5(path, channels)
        if ending in (".mf4", ".mdf"):
            return read_mdf(path, channels)
    except NamedFileError as error:
        raise RecordingError(f"{path}: {error}") from None
    except FileError as error:
        raise RecordingError(str(error)) from None
    except MemoryError:
        raise RecordingError(f"{path}: does not fit into memory; split the file") from None
    raise RecordingError(f"{path}: ends in {ending or 'nothing'}; recordings end in {', '.join(RECORDING_ENDINGS)}")
