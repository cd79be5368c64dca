"""MDF files by asammdf in a process of its own: values, and files that are damaged, hang, or have formulas."""

from __future__ import annotations

import importlib.util
import struct
from pathlib import Path

import numpy as np
import pytest

from exugear.exchange.recordings.mdf4 import read_mdf
from exugear.exchange.recordings.reading import read_recording
from exugear.exchange.recordings.recording import RecordingError

from ....optional_libraries import needs_asammdf

RATE = 5000.0
TIME = np.arange(4000) / RATE
SIGNALS = {"Acc 3": (np.sin(40.0 * TIME), "m/s2"), "Tacho": ((np.cos(50.0 * TIME) > 0.9).astype(np.int16), "V")}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two groups: two channels, and one of them again together with a slow one."""
    from asammdf import MDF, Signal

    path = tmp_path_factory.mktemp("mdf") / "bench.mf4"
    with MDF(version="4.10") as file:
        file.append([Signal(values, TIME, name=name, unit=unit) for name, (values, unit) in SIGNALS.items()])
        slow = TIME[::200]
        file.append([Signal(np.cos(slow), slow, name=name, unit="degC") for name in ("Oil", "Tacho")])
        file.save(path, overwrite=True)
    return path


def test_without_asammdf_the_error_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "bench.mf4"
    path.write_bytes(b"MDF     4.10    " + bytes(200))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RecordingError, match=r"bench.mf4: MDF files need asammdf: pip install 'exugear\[mdf\]'"):
        read_recording(path)


def test_another_format_with_this_extension_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bench.mf4"
    path.write_bytes(b"time,left\n" * 100)
    with pytest.raises(RecordingError, match="does not begin as an MDF file; check the extension"):
        read_recording(path)


@needs_asammdf
def test_values_units_and_rate_come_back(written: Path) -> None:
    recording = read_recording(written)
    assert [channel.name for channel in recording.channels] == ["Acc 3", "0/Tacho"]
    assert [channel.unit for channel in recording.channels] == ["m/s2", "V"]
    assert recording.rate == pytest.approx(RATE, rel=1e-9)
    for channel, (values, _) in zip(recording.channels, SIGNALS.values(), strict=True):
        assert np.array_equal(channel.values, values)
    assert np.array_equal(read_recording(written, ["acc 3"]).channels[0].values, SIGNALS["Acc 3"][0])
    with pytest.raises(RecordingError, match="no channel 'Acc'; names like it are Acc 3"):
        read_recording(written, ["Acc"])
    with pytest.raises(RecordingError, match="is sampled at 25 Hz and Acc 3 at 5000 Hz"):
        read_recording(written, ["Acc 3", "Oil"])


@needs_asammdf
def test_a_channel_with_a_formula_is_refused(tmp_path: Path) -> None:
    from asammdf import MDF, Signal
    from asammdf.blocks.conversion_utils import from_dict

    path, mark = tmp_path / "bench.mf4", tmp_path / "ran"
    formula = f"__import__('pathlib').Path({str(mark)!r}).touch() or 2*X"
    with MDF(version="4.10") as file:
        conversion = from_dict({"formula": formula})
        file.append([Signal(np.arange(100), np.arange(100.0), name="a", conversion=conversion)])
        file.save(path, overwrite=True)
    with pytest.raises(RecordingError, match="channel a has a formula, which is not evaluated; export its values"):
        read_recording(path)
    assert not mark.exists()


@needs_asammdf
@pytest.mark.validation
def test_a_group_that_leads_to_itself_ends_after_the_time_limit(written: Path, tmp_path: Path) -> None:
    """The library follows the chain of data groups for ever; the process is ended."""
    content = bytearray(written.read_bytes())
    (first,) = struct.unpack_from("<Q", content, 64 + 24)  # first link of the header block
    assert content[first : first + 4] == b"##DG"
    struct.pack_into("<Q", content, first + 24, first)  # its link to the next data group
    path = tmp_path / "bench.mf4"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="took more than 4 s to read, as damaged MDF files do|damaged MDF file"):
        read_mdf(path, limit=4.0)


@needs_asammdf
@pytest.mark.validation
def test_damaged_files_are_one_error_or_a_recording_of_the_right_length(written: Path, tmp_path: Path) -> None:
    """Truncated at ten places, and with random bytes in its blocks."""
    content = written.read_bytes()
    rng = np.random.default_rng(1)
    path = tmp_path / "bench.mf4"
    for trial in range(20):
        damaged = bytearray(content)
        if trial < 8:
            del damaged[int(rng.integers(64, len(content))) :]
        else:
            for place in rng.integers(64, len(content), 40):
                damaged[place] = rng.integers(256)
        path.write_bytes(damaged)
        try:
            assert read_mdf(path, limit=10.0).samples <= TIME.size
        except RecordingError as error:
            assert str(error).startswith(f"{path}: ")
            assert "\n" not in str(error)
