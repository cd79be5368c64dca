"""Readers of recordings: what is written in a format comes back; damaged, truncated and hostile files are one error."""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from exugear.exchange.recordings.reading import read_recording
from exugear.exchange.recordings.recording import RecordedChannel, RecordingError, recording_of

from . import written

RATE = 51200.0
N = 1003


@pytest.fixture
def signals() -> np.ndarray:
    """Two channels (2, samples), one of them with negative numbers that touch their neighbours in columns of text."""
    rng = np.random.default_rng(3)
    return np.array([-100.0 + rng.standard_normal(N), np.sin(0.02 * np.arange(N))])


def unv(path: Path, signals: np.ndarray, **options: object) -> Path:
    titles = ("Acc 3", "Tacho")
    path.write_bytes(b"".join(written.unv_set(y, RATE, t, **options) for y, t in zip(signals, titles, strict=True)))
    return path


@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize("binary", ["", "<", ">"])
def test_a_universal_file_gives_back_its_values(tmp_path, signals, binary, double):
    """Text has six or thirteen digits, binary values those of their type; the step has six (published format)."""
    recording = read_recording(unv(tmp_path / "a.unv", signals, binary=binary, double=double))
    assert [channel.name for channel in recording.channels] == ["Acc 3", "Tacho"]
    digits = {("", False): 6e-6, ("", True): 1e-12}.get((binary, double), 0.0 if double else 6e-8)
    for channel, values in zip(recording.channels, signals, strict=True):
        assert channel.values == pytest.approx(values, rel=digits, abs=1e-15)
    assert recording.rate == pytest.approx(RATE, rel=5e-6)
    assert recording.channels[0].quantity == "acceleration"


def test_the_end_mark_inside_binary_values_is_a_value(tmp_path):
    """Readers that search for the end of a data set cut the values there."""
    values = np.frombuffer(b"\n    -1\n" * 400, dtype="<f4").copy()
    path = tmp_path / "a.unv"
    path.write_bytes(written.unv_set(values, RATE, "a", binary="<") + written.unv_set(values, RATE, "b", binary="<"))
    assert [channel.values.size for channel in read_recording(path).channels] == [800, 800]


def test_other_data_sets_are_passed_over_and_names_are_unique(tmp_path, signals):
    other = b"    -1\n    15\n         1         0         0        11  0.0  0.0  0.0\n    -1\n"
    sets = [written.unv_set(y, RATE, node=node, binary="<") for y, node in zip(signals, (4, 5), strict=True)]
    sets[1:1] = [written.unv_set(signals[0], RATE, "spectrum", kind=12, binary=form) for form in ("<", "")]
    (path := tmp_path / "a.uff").write_bytes(other.join([b"", *sets, b""]))
    assert [channel.name for channel in read_recording(path).channels] == ["HOUSING 4:+Z", "HOUSING 5:+Z"]


@pytest.mark.parametrize("unit", ["m/s\u00b2", "m/s^2", "(m/s**2)"])
def test_units_with_other_signs_are_known(tmp_path, signals, unit):
    recording = read_recording(unv(tmp_path / "a.unv", signals, unit=unit))
    assert recording.channels[0].known_unit == ("acceleration", 1.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"count": 100}, "no end where its 100 values end|states 4012 bytes"),
        ({"count": 99_999_999}, "99999999 values take 399999996 bytes and"),
        ({"count": 2_147_483_647}, "2147483647 samples; 16 to 2e\\+08 are read"),
        ({"count": -5}, "-5 samples"),
        ({"step": 0.0}, "sampling rate 0 Hz"),
        ({"step": float("nan")}, "sampling rate nan Hz"),
        ({"kind": 4}, "contains a frequency response function, but no time signal"),
        ({"axis": 18}, "abscissa is quantity 18, not time"),
        ({"type": 5}, "complex values"),
        ({"even": 0}, "uneven time steps"),
        ({"bytes": 17}, "states 17 bytes"),
    ],
)
def test_a_header_that_contradicts_the_file_is_refused_before_memory_is_allocated(tmp_path, signals, changes, message):
    path = unv(tmp_path / "a.unv", signals, binary="<", **changes)
    tracemalloc.start()
    try:
        with pytest.raises(RecordingError, match=message) as caught:
            read_recording(path)
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("binary", ["", "<"])
def test_a_truncated_universal_file_is_refused_wherever_it_ends(tmp_path, signals, binary):
    content = unv(tmp_path / "a.unv", signals[:, :100], binary=binary).read_bytes()
    (path := tmp_path / "cut.unv").write_bytes(content)
    whole = content.index(b"    -1\n", 10) + 7  # the first data set alone is a file of its own
    for length in range(0, len(content) - 8, 7):
        path.write_bytes(content[:length])
        if length - whole in range(-1, 8):
            continue
        with pytest.raises(RecordingError, match="truncated|ends in its header|no data set 58|no end where|values"):
            read_recording(path)


@pytest.mark.parametrize("form", ["unv", "text", "wav", "csv", "h5"])
def test_random_damage_gives_a_reading_of_full_length_or_one_clear_error(tmp_path, signals, form):
    """Each of 150 files has three changed bytes, in its header for most formats; the message begins with the file."""
    first = signals[:, :200]
    path = tmp_path / {"unv": "a.unv", "text": "a.unv", "wav": "a.wav", "csv": "a.csv", "h5": "a.h5"}[form]
    if form in ("unv", "text"):
        unv(path, first, binary="<" if form == "unv" else "")
    elif form == "wav":
        written.wav(path, 8000, first.T.astype(np.float32))
    elif form == "csv":
        written.csv(path, "time_s,left_g,n_rpm", 8000.0, first.T)
    else:
        written.hdf5(path, {"left": first[0], "right": first[1]}, 8000.0, {"left": "g"})
    whole = path.read_bytes()
    rng = np.random.default_rng(7)
    outcomes = {"read": 0, "refused": 0}
    for _ in range(150):
        damaged = bytearray(whole)
        for _ in range(3):
            end = len(damaged) if form == "h5" else min(1000, len(damaged))
            damaged[rng.integers(0, end)] = rng.integers(0, 256)
        path.write_bytes(damaged)
        try:
            recording = read_recording(path)
        except RecordingError as error:
            assert str(error).startswith(str(path))
            assert "\n" not in str(error)
            outcomes["refused"] += 1
        else:
            assert {channel.values.size for channel in recording.channels} == {recording.samples}
            assert all(np.isfinite(channel.values).all() for channel in recording.channels)
            outcomes["read"] += 1
    assert outcomes["refused"] > 3
    assert sum(outcomes.values()) == 150


@pytest.mark.parametrize(
    ("kind", "tolerance"), [("u1", 2**-7), ("i2", 2**-15), ("i4", 2**-31), ("f4", 1e-7), ("f8", 0.0)]
)
def test_samples_of_a_wav_file_are_fractions_of_full_scale(tmp_path, kind, tolerance):
    wave = 0.8 * np.sin(np.arange(500.0))
    scale, offset = {"u1": (128, 128), "i2": (2**15, 0), "i4": (2**31, 0)}.get(kind, (1.0, 0.0))
    columns = np.column_stack([wave, -wave]) * scale + offset
    path = written.wav(tmp_path / "a.wav", 44100, columns.astype(kind))
    recording = read_recording(path, ["Channel 2"])
    assert recording.rate == 44100.0
    assert recording.channels[0].values == pytest.approx(-wave, abs=tolerance + 1e-15)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"nothing of that kind", "does not begin as a WAV file"),
        (written.wav_header(4_000_000_000), "states 4000000000 bytes of data and 0 follow"),
        (written.wav_header(400, kind=17) + bytes(400), "format 17"),
        (written.wav_header(8) + bytes(8), "2 samples"),
        (written.wav_header(400)[:36], "no chunk of data"),
    ],
)
def test_a_wrong_wav_file_is_refused(tmp_path, content, message):
    (path := tmp_path / "a.wav").write_bytes(content)
    with pytest.raises(RecordingError, match=message):
        read_recording(path)


def test_hdf5_and_netcdf_give_back_their_channels(tmp_path, signals):
    path = written.hdf5(tmp_path / "a.h5", {"bench/left": signals[0], "right": signals[1]}, RATE, {"bench/left": "g"})
    recording = read_recording(path)
    assert [(channel.name, channel.quantity) for channel in recording.channels] == [
        ("bench/left", "acceleration"), ("right", ""),
    ]  # fmt: skip
    assert recording.rate == pytest.approx(RATE, rel=1e-9)
    data = xr.Dataset({"left": ("time", signals[0], {"units": "m/s2"})}, {"time": np.arange(N) / RATE})
    data.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    channel = read_recording(tmp_path / "a.nc").channel("left")
    assert channel.values == pytest.approx(signals[0], rel=0.0)
    assert channel.unit == "m/s2"


def test_packed_values_are_unpacked_and_a_rate_may_be_an_attribute(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["left"] = np.arange(100, dtype="i2")
        file["left"].attrs.update(scale_factor=0.5, add_offset=-3.0, units="g")
        file.attrs["sample_rate"] = 100.0
    recording = read_recording(tmp_path / "a.h5")
    assert recording.rate == 100.0
    assert recording.channels[0].values == pytest.approx(0.5 * np.arange(100) - 3.0)


def test_a_torque_named_t_is_no_time(tmp_path):
    written.hdf5(tmp_path / "a.h5", {"T": np.arange(100.0), "left": np.arange(100.0)}, 100.0, {"T": "N m", "left": "g"})
    assert [channel.name for channel in read_recording(tmp_path / "a.h5").channels] == ["T", "left"]


def test_a_small_file_that_declares_gigabytes_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("left", shape=(2**34,), dtype="f8", chunks=(2**16,))
        file.attrs["sample_rate"] = 1.0
    assert (tmp_path / "a.h5").stat().st_size < 10_000
    with pytest.raises(RecordingError, match="left declares 1.37439e\\+11 bytes, more than a file of"):
        read_recording(tmp_path / "a.h5")


def test_values_and_links_in_other_files_are_not_opened(tmp_path):
    secret = written.hdf5(tmp_path / "secret.h5", {"key": np.arange(100.0)}, 100.0, {})
    (tmp_path / "raw").write_bytes(np.arange(100.0).tobytes())
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["linked"] = h5py.ExternalLink(str(secret), "/key")
        file.create_dataset("raw", shape=(100,), dtype="f8", external=[(str(tmp_path / "raw"), 0, 800)])
        layout = h5py.VirtualLayout(shape=(100,), dtype="f8")
        layout[:] = h5py.VirtualSource(str(secret), "key", shape=(100,))
        file.create_virtual_dataset("virtual", layout)
        file.attrs["sample_rate"] = 100.0
    with pytest.raises(RecordingError, match="no one-dimensional datasets"):
        read_recording(tmp_path / "a.h5")


@pytest.mark.parametrize(
    ("headings", "separator"),
    [
        ("time_s,left_g,n_rpm", ","),
        ("Time [s];left [g];n [rpm]", ";"),
        ("t\tleft\tn\ns\tg\trpm", "\t"),
        ('"time / s","left / (g)","n / rpm"', ","),
    ],
)
def test_units_of_a_table_are_in_its_headings_or_below_them(tmp_path, signals, headings, separator):
    path = written.csv(tmp_path / "a.csv", headings, 5000.0, signals.T, separator)
    recording = read_recording(path)
    assert [(channel.name, channel.quantity) for channel in recording.channels] == [
        ("left", "acceleration"), ("n", "speed"),
    ]  # fmt: skip
    assert recording.rate == pytest.approx(5000.0, rel=1e-9)
    assert recording.channels[1].values == pytest.approx(signals[1], rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("form", ["{!r}", "{:.25g}", "{:+.7E}", "{:.40f}"])
@pytest.mark.parametrize("text_beside", [False, True])
def test_numbers_of_a_table_are_the_nearest_floating_point_numbers(tmp_path, form, text_beside):
    """As Python's own `float` rounds them, in lines of numbers alone and in those with text in a column beside."""
    rng = np.random.default_rng(2)
    values = rng.normal(size=2000) * 10.0 ** rng.integers(-30, 30, 2000)
    written_as = [form.format(float(value)) for value in values]
    rows = [f"{n},{text},{'ok' if text_beside else 0}" for n, text in enumerate(written_as)]
    (path := tmp_path / "a.csv").write_text("\n".join(["time_s,left_m_per_s2,state", *rows]) + "\n")
    (channel,) = read_recording(path, ["left"]).channels
    assert channel.values.tolist() == [float(text) for text in written_as]


ROWS = [[f"{n / 100:.2f}", f"{n % 9}"] for n in range(40)]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: rows[20].__setitem__(0, "0.18"), "time does not increase after 0.19 s \\(sample 20\\)"),
        (lambda rows: rows.__delitem__(slice(20, 25)), "no samples between 0.19 and 0.25 s \\(after sample 20\\)"),
        (lambda rows: rows[3].__setitem__(1, "nan"), "channel left has no number at 0.03 s \\(sample 4\\)"),
        (lambda rows: rows[3].__setitem__(1, "fault"), "line 5 has text where 'left' has a number: 'fault'"),
        (lambda rows: rows[7].pop(), "line 9 has 1 columns; the headings have 2"),
        (lambda rows: rows.__delitem__(slice(10, None)), "10 samples; 16 to"),
        (lambda rows: rows.clear(), "no lines of numbers"),
    ],
)
def test_gaps_and_dropouts_of_a_table_are_named_with_their_place(tmp_path, change, message):
    rows = [list(row) for row in ROWS]
    change(rows)
    (path := tmp_path / "a.csv").write_text("\n".join(["time_s,left_g", *(",".join(row) for row in rows)]) + "\n")
    with pytest.raises(RecordingError, match=message):
        read_recording(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("left_g,right_g\n1,2\n", "first heading is 'left_g'; the first column must be time"),
        ("time_s\n1\n", "1 columns"),
        ("time_s;left\n0,00;1,5\n0,01;1,5\n", "line 2 has decimal commas"),
        ("time_rpm,left\n" + "\n".join(f"{n},1" for n in range(20)), "time has the unit 'rpm'"),
        ("time_s,a,a\n0,1,2\n", "two columns have the name 'a'"),
    ],
)
def test_a_wrong_table_is_refused(tmp_path, text, message):
    (path := tmp_path / "a.csv").write_text(text)
    with pytest.raises(RecordingError, match=message):
        read_recording(path)


def test_channels_of_different_length_or_rate_are_named():
    channels = [RecordedChannel("left", "g", np.zeros(100)), RecordedChannel("right", "g", np.zeros(99))]
    with pytest.raises(RecordingError, match="right has 99 samples and left has 100"):
        recording_of(Path("a.unv"), 100.0, 0.0, channels)


def test_channels_of_different_rates_are_refused_beyond_the_digits_of_a_header(tmp_path, signals):
    (path := tmp_path / "a.unv").write_bytes(
        written.unv_set(signals[0], RATE, "a", binary="<") + written.unv_set(signals[1], 2.0 * RATE, "b", binary="<")
    )
    with pytest.raises(RecordingError, match="channel b is sampled at 102.*and a at 51199.9 Hz"):
        read_recording(path)
    assert read_recording(path, ["b"]).samples == N


def test_an_unknown_channel_is_named_with_those_like_it(tmp_path, signals):
    with pytest.raises(RecordingError, match="no channel 'Acc 4'; names like it are Acc 3"):
        read_recording(unv(tmp_path / "a.unv", signals), ["Acc 4"])


def test_what_is_no_file_is_refused_without_waiting(tmp_path):
    os.mkfifo(tmp_path / "pipe.unv")
    (tmp_path / "folder.wav").mkdir()
    cases = {"pipe.unv": "a pipe or device", "folder.wav": "a folder", "none.csv": "no such file", "a.tdms": "no such"}
    for name, message in cases.items():
        with pytest.raises(RecordingError, match=message):
            read_recording(tmp_path / name)
    (tmp_path / "a.tdms").write_bytes(b"TDSm")
    with pytest.raises(RecordingError, match="ends in .tdms; recordings end in .unv"):
        read_recording(tmp_path / "a.tdms")


@pytest.mark.parametrize("bits", [8, 12, 16, 24])
def test_clipping_is_found_and_not_found_where_there_is_none(bits):
    """A tone with noise, quantised; cut at 0.7 of its peak it stays there for several samples."""
    rng = np.random.default_rng(bits)
    wave = np.sin(0.05 * np.arange(20000)) + 0.05 * rng.standard_normal(20000)
    step = 1.3 * 2.0 ** (1 - bits)
    assert RecordedChannel("a", "", np.round(wave / step) * step).clipped < 1e-4
    assert RecordedChannel("a", "", np.round(np.clip(wave, -0.7, 0.7) / step) * step).clipped > 0.1
