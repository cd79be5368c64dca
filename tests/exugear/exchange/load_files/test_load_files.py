"""Readers of load files: against figures stored with the files, their text twins, and files written here."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from exugear.exchange.channels import LoadFileError
from exugear.exchange.series_files import read_channels

DATA = Path(__file__).parent / "data"
EXAMPLE = Path(__file__).parents[4] / "cases/grc750/loads"
NAMES, UNITS = ("RotTorq", "RotSpeed"), ("(kN-m)", "(rpm)")


def packed(
    kind: int,
    time: np.ndarray,
    values: np.ndarray,
    names: tuple[str, ...] = NAMES,
    units: tuple[str, ...] = UNITS,
    length: int = 10,
) -> bytes:
    """Write the layout that OpenFAST's module NWTC_IO documents."""
    steps, channels = values.shape
    content = struct.pack("<h", kind) + (struct.pack("<h", length) if kind == 4 else b"")
    content += struct.pack("<ii", channels, steps)
    low, high = values.min(axis=0), values.max(axis=0)
    scale = (65535.0 / np.where(high > low, high - low, 1.0)).astype("<f4")
    offset = (-32768.0 - scale * low).astype("<f4")
    if kind == 1:
        time_scale, time_offset = 1000.0, -500.0
        content += struct.pack("<dd", time_scale, time_offset)
    else:
        content += struct.pack("<dd", time[0], time[1] - time[0])
    if kind != 3:
        content += scale.tobytes() + offset.tobytes()
    content += struct.pack("<i", 4) + b"here"
    for texts in (("Time", *names), ("(s)", *units)):
        content += b"".join(text.encode("latin-1").ljust(length) for text in texts)
    if kind == 1:
        content += np.round(time * time_scale + time_offset).astype("<i4").tobytes()
    if kind == 3:
        return content + values.astype("<f8").tobytes()
    return content + np.clip(np.round(values * scale + offset), -32768, 32767).astype("<i2").tobytes()


@pytest.fixture
def written(tmp_path):
    def write(content: bytes, name: str = "turbine.outb") -> Path:
        path = tmp_path / name
        path.write_bytes(content)
        return path

    return write


def reversal() -> tuple[np.ndarray, np.ndarray]:
    """Torque that swings through zero while the speed falls, after a transient from rest."""
    time = np.arange(200) * 0.05
    torque = 900.0 * np.cos(1.3 * time) * (1.0 - np.exp(-time / 0.4))
    return time, np.column_stack([torque, 12.0 - 0.5 * time])


def test_format_2_equals_stored_statistics_of_the_turbine_file():
    """Figures of pCrunch's Test1: mean, largest and least torque, mean speed and generator torque."""
    series = read_channels(EXAMPLE / "oc3_hywind_test1.outb")
    torque = 1e-3 * series.channel("RotTorq", "torque")
    assert torque.mean() == pytest.approx(1933.6237, abs=6e-5)
    assert (torque.max(), torque.min()) == pytest.approx((3239.7921, 987.2910), abs=6e-5)
    assert series.channel("rotspeed", "speed").mean() * 30.0 / np.pi == pytest.approx(9.336851, abs=6e-7)
    assert 1e-3 * series.channel("GenTq", "torque").mean() == pytest.approx(19.934229, abs=6e-7)
    assert (series.time[0], series.time[-1]) == pytest.approx((60.0, 660.0), abs=1e-4)


def test_format_2_equals_the_value_that_the_reference_reader_is_tested_by():
    """The last generator power of openfast_toolbox's own example; in its tests it is 40.57663190807828."""
    series = read_channels(DATA / "FASTOutBin.outb")
    assert series.names[:4] == ("Wind1VelX", "Wind1VelY", "Wind1VelZ", "RotSpeed")
    assert series.values[-1, 9] == pytest.approx(40.57663190807828, abs=1e-7)


def test_format_3_equals_its_text_twin():
    binary, text = read_channels(DATA / "AOC_WSt.outb"), read_channels(DATA / "AOC_WSt.out")
    assert binary.names == text.names
    assert binary.time == pytest.approx(text.time)
    # Text has four to six digits of each value.
    assert np.all(np.abs(binary.values - text.values) <= 6e-4 * np.abs(text.values) + 1e-6)
    assert 1e-3 * binary.channel("LSShftTq", "torque").min() == pytest.approx(-10.4592, abs=6e-5)


def test_format_4_holds_long_names_and_many_channels():
    series = read_channels(DATA / "FASTOutBin_ID4.outb")
    assert (len(series.names), len(series.time)) == (235, 11)
    speed = series.channel("RotSpeed", "speed") * 30.0 / np.pi
    assert (speed[0], speed[-1]) == pytest.approx((9.90999992, 9.91543104), abs=1e-7)
    assert 1e-3 * series.channel("LSShftTq", "torque")[-1] == pytest.approx(298.947448, abs=1e-5)


def test_text_alone():
    series = read_channels(DATA / "FASTOut.out")
    assert series.channel("GenSpeed", "speed")[[0, -1]] * 30.0 / np.pi == pytest.approx([944.1, 1036.0])


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_every_format_gives_back_a_torque_reversal_with_its_transient(written, kind):
    time, values = reversal()
    series = read_channels(written(packed(kind, time, values, length=22 if kind == 4 else 10)))
    step = 0.0 if kind == 3 else np.ptp(values, axis=0).max() / 65535.0
    assert series.values == pytest.approx(values, abs=0.51 * step + 1e-3)  # offsets are single precision
    assert series.time == pytest.approx(time, abs=1e-3)
    assert series.channel("RotTorq", "torque").min() < 0.0 < series.channel("RotTorq", "torque").max()


def test_bytes_behind_the_declared_steps_are_left_alone(written):
    time, values = reversal()
    content = packed(2, time, values)
    assert read_channels(written(content + b"more")).values == pytest.approx(read_channels(written(content)).values)


@pytest.mark.parametrize("unit", ["(kN-m)", "(kN\xb7m)", "kN-m", "[kN m]", "kN*m"])
def test_units_are_understood_however_they_are_written(written, unit):
    time, values = reversal()
    series = read_channels(written(packed(3, time, values, units=(unit, "(rpm)"))))
    assert series.channel("RotTorq", "torque") == pytest.approx(1e3 * values[:, 0])


def test_the_same_channel_is_found_under_its_other_names(written):
    time, values = reversal()
    series = read_channels(written(packed(3, time, values, names=("LSShftTq", "LSSSpeed"))))
    assert series.channel("RotTorq", "torque") == pytest.approx(1e3 * values[:, 0])
    assert series.channel("rotspeed", "speed") == pytest.approx(values[:, 1] * np.pi / 30.0)


@pytest.mark.parametrize("length", [1, 9, 25, 40, 60, -1, -500])
def test_a_truncated_file_is_one_clear_error(written, length):
    time, values = reversal()
    with pytest.raises(LoadFileError, match="cut short in its"):
        read_channels(written(packed(2, time, values)[:length]))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"units": ("(furlong)", "(rpm)")}, r"unit '\(furlong\)'.*not a known unit of torque.*kN-m"),
        ({"units": ("(rpm)", "(rpm)")}, r"unit '\(rpm\)'.*not a known unit of torque"),
        ({"units": ("INVALID", "(rpm)")}, "unit 'INVALID'"),
        ({"names": ("RotTork", "RotSpeed")}, r"no channel 'RotTorq'; names like it are RotTork"),
    ],
)
def test_wrong_units_and_missing_channels_are_told(written, changed, message):
    time, values = reversal()
    series = read_channels(written(packed(3, time, values, **changed)))
    with pytest.raises(LoadFileError, match=message):
        series.channel("RotTorq", "torque")


def test_not_a_number_is_told_with_its_time(written):
    time, values = reversal()
    values[7, 0] = np.nan
    with pytest.raises(LoadFileError, match="RotTorq has no number at 0.35 s"):
        read_channels(written(packed(3, time, values))).channel("RotTorq", "torque")


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.outb", "\x07\x00nothing", "first number is 7"),
        ("a.out", "nothing here\n", "no line begins with Time"),
        ("a.out", "Time T\n(s)\n1 2\n", "2 names and 1 units"),
        ("a.out", "Time T\n(s) (N)\n0 2\n1\n", "line 4 has 1 columns"),
        ("a.csv", "time_s,hss\n0,1\n1,2\n2,3\n", "heading 'hss' ends in no unit"),
        ("a.csv", "time_s,hss_rpm\n0,1\nx,2\n2,3\n", ": line 3 has text where 'time_s' has a number: 'x'"),
        ("a.csv", "time_s,hss_rpm\n0,1\n2,2\n1,3\n", ": time does not increase after step 2"),
        ("a.csv", "time_s,hss_rpm\n0,1\n", "1 time steps; at least"),
        ("a.dat", "", "ends in .dat"),
    ],
)
def test_bad_files_are_one_clear_error_each(written, name, text, message):
    with pytest.raises(LoadFileError, match=message):
        assert len(read_channels(written(text.encode(), name)).time)


HOLES = "Time RotTorq RotSpeed B1N1Fl\n(s) (kN-m) (rpm) (N)\n0 100 10 {0}\n1 200 10 -4.5678-120\n2 300 10 1.0\n"


@pytest.mark.parametrize("hole", ["1.2345-101", "********", "1.5D+03", "NaN", "word"])
def test_a_hole_in_a_channel_that_nobody_asks_for_is_passed_over(written, hole):
    series = read_channels(written(HOLES.format(hole).encode(), "turbine.out"))
    assert series.channel("RotTorq", "torque").tolist() == [100e3, 200e3, 300e3]


def test_a_hole_in_a_channel_that_is_asked_for_names_line_channel_and_word(written):
    series = read_channels(written(HOLES.format("********").encode(), "turbine.out"))
    with pytest.raises(LoadFileError, match=": line 3 has text where 'B1N1Fl' has a number: '"):
        series.channel("B1N1Fl", "force")


@pytest.mark.parametrize(("word", "value"), [("1.2345-101", 1.2345e-101), ("1.5D+03", 1500.0), ("-2+2", -200.0)])
def test_numbers_of_fortran_without_e_are_numbers(written, word, value):
    """Fortran writes no E where an exponent has three digits (numpy issue 5557), and D in double precision."""
    series = read_channels(written(HOLES.format(word).encode(), "turbine.out"))
    assert series.channel("B1N1Fl", "force")[0] == pytest.approx(value, rel=1e-12)


def test_a_scale_of_zero_is_damage_of_its_channel_alone(written):
    time, values = np.linspace(0.0, 1.0, 21), np.column_stack([np.linspace(1.0, 2.0, 21), np.linspace(5.0, 6.0, 21)])
    content = bytearray(packed(2, time, values))
    content[2 + 8 + 16 + 4 : 2 + 8 + 16 + 8] = struct.pack("<f", 0.0)  # the scale of the second channel
    series = read_channels(written(bytes(content)))
    assert series.channel("RotTorq", "torque") == pytest.approx(1e3 * values[:, 0], rel=1e-4)
    with pytest.raises(LoadFileError, match="channel RotSpeed has the scale 0"):
        series.channel("RotSpeed", "speed")
