"""Many and large files of loads: hours by file, length, event and wind; streams; equivalent loads of the hub."""

from __future__ import annotations

import json
import math
import struct
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.exchange.channels import LoadFileError
from exugear.exchange.series_files import read_channels
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.life.load_spectrum import series as pools
from exugear.life.load_spectrum.counted import CountedLoads, count_loads
from exugear.life.load_spectrum.counting import equivalent_range, rainflow
from exugear.life.load_spectrum.series import Samples, condensed
from exugear.life.load_spectrum.sources import load_sources

from ...cases.command import exugear
from ...exchange.load_files.test_load_files import packed

GRC = Path("cases/grc750/gearbox.toml")
LOADS = Path("cases/grc750/loads")


def gearbox(folder: Path, wind: dict[str, float] | None = None, **sources: dict[str, Any]) -> Gearbox:
    content = {**Gearbox.from_toml(GRC).content}
    content["loads"] = {"body": "carrier", "life_years": 2.0, "sources": sources} | ({"wind": wind} if wind else {})
    return Gearbox.from_dict(content, str(folder / "gearbox.toml"))


def turbine(name: str, **keys: Any) -> dict[str, Any]:
    """Source of one file or of many, with the channels of a turbine."""
    return {name: "dlc/*.outb", "skip_s": 0.0, "torque": "RotTorq", "speed": "RotSpeed", **keys}


@pytest.fixture
def dlc(tmp_path) -> Path:
    """Three files of a turbine at 8, 12 and 18 m/s."""
    (tmp_path / "dlc").mkdir()
    for number, wind in ((1, 8), (2, 12), (3, 18)):
        (tmp_path / "dlc" / f"wind_{wind}.outb").write_bytes((LOADS / f"oc3_hywind_test{number}.outb").read_bytes())
    return tmp_path


def alike(one: CountedLoads, other: CountedLoads, rel: float = 1e-9) -> None:
    for key in ("hours", "revolutions", "torque"):
        found, expected = getattr(one.distribution, key), getattr(other.distribution, key)
        assert found == pytest.approx(expected, rel=rel)
    for m, value in other.equivalent_ranges["torque"].items():
        assert one.equivalent_ranges["torque"][m] == pytest.approx(value, rel=1e-9)


def singles(folder: Path, hours: dict[int, float]) -> CountedLoads:
    sources = {
        f"w{wind}": turbine("file", file=f"dlc/wind_{wind}.outb", hours_per_year=value) for wind, value in hours.items()
    }
    return count_loads(gearbox(folder, **sources))


def test_files_of_one_pattern_count_as_each_by_itself(dlc):
    """Files of equal length share the hours evenly."""
    together = count_loads(gearbox(dlc, all=turbine("files", hours_per_year=3000.0)))
    alike(together, singles(dlc, {8: 1000.0, 12: 1000.0, 18: 1000.0}))
    assert (together.sources[0].files, together.sources[0].count) == (3, 3 * 6001)


def test_hours_of_files_come_from_a_table(dlc):
    (dlc / "hours.csv").write_text("file,hours_per_year\nwind_8.outb,4410.6\nwind_12.outb,2196.4\nwind_18.outb,749.8\n")
    together = count_loads(gearbox(dlc, all=turbine("files", hours_table="hours.csv")))
    alike(together, singles(dlc, {8: 4410.6, 12: 2196.4, 18: 749.8}))


def test_events_count_each_file_by_its_length(dlc):
    together = count_loads(gearbox(dlc, all=turbine("files", events_per_year=60.0)))
    each = 60.0 * 600.0 / 3600.0
    alike(together, singles(dlc, {8: each, 12: each, 18: each}), rel=1e-6)  # packed times end at 660.00001 s


def test_hours_of_files_come_from_the_wind_of_the_site(dlc):
    """Wind about 8, 12 and 18 m/s in bins of 2 m/s by Rayleigh's distribution, whatever the sources."""
    names = read_channels(dlc / "dlc" / "wind_8.outb").names
    wind = next(name for name in names if name.lower().startswith("wind"))
    means = [
        float(read_channels(dlc / "dlc" / f"wind_{one}.outb").channel(wind, "velocity").mean()) for one in (8, 12, 18)
    ]
    site = {"mean_m_per_s": 8.5}
    together = count_loads(gearbox(dlc, site, all=turbine("files", wind=wind)))

    def hours(speed: float) -> float:
        low, high = 2.0 * math.floor(speed / 2.0 + 0.5) - 1.0, 2.0 * math.floor(speed / 2.0 + 0.5) + 1.0
        return 8766.0 * (math.exp(-math.pi / 4 * (low / 8.5) ** 2) - math.exp(-math.pi / 4 * (high / 8.5) ** 2))

    expected = [hours(one) for one in means]
    alike(together, singles(dlc, dict(zip((8, 12, 18), expected, strict=True))))
    # The same file twice, of two sources: both share its bin.
    twice = {name: turbine("file", file="dlc/wind_12.outb", wind=wind) for name in ("one", "other")}
    shared = load_sources(gearbox(dlc, site, **twice))
    assert [one.hours.sum() / 2.0 for one in shared] == pytest.approx([0.5 * expected[1]] * 2)


def test_many_samples_put_together_do_the_damage_of_each(dlc, monkeypatch):
    """18,003 samples as 1,000 points or so: bins alike within 1e-3, equivalent loads within 1e-5."""
    whole = count_loads(gearbox(dlc, all=turbine("files", hours_per_year=3000.0)))
    monkeypatch.setattr(pools, "MOST_POINTS", 2000)
    few = count_loads(gearbox(dlc, all=turbine("files", hours_per_year=3000.0)))
    assert len(few.sources[0].torque) < 4000
    assert few.distribution.hours.sum() == pytest.approx(whole.distribution.hours.sum())
    assert few.distribution.revolutions.sum() == pytest.approx(whole.distribution.revolutions.sum())
    assert few.distribution.upper.max() == whole.distribution.upper.max()
    assert few.equivalent_ranges["torque"] == whole.equivalent_ranges["torque"]
    assert [*few.equivalents().values()] == pytest.approx([*whole.equivalents().values()], rel=1e-5)


def test_extreme_samples_put_together_keep_the_largest_of_each_load():
    rng = np.random.default_rng(2)
    samples = Samples(rng.normal(size=9000), np.ones(9000), np.ones(9000), rng.normal(size=(9000, 5)))
    found = condensed(samples, extreme=True)
    assert len(found) < 9000
    assert (found.torque.max(), found.torque.min()) == (samples.torque.max(), samples.torque.min())
    assert np.array_equal(found.hub.max(axis=0), samples.hub.max(axis=0))


def test_equivalent_ranges_of_all_loads_of_the_hub(tmp_path):
    """Each component against the count of its series by itself; those without a channel are left out."""
    time = np.arange(0.0, 60.0, 0.05)
    columns = {
        "carrier_N_m": 2e5 + 3e4 * np.sin(1.3 * time) + 5e3 * np.sin(7.1 * time),
        "carrier_rpm": 20.0 + 0.0 * time,
        "x_kN": 80.0 * np.sin(0.9 * time + 1.0),
        "y_kN": -400.0 + 20.0 * np.sin(2.3 * time) ** 3,
        "z_kN": 150.0 + 60.0 * np.sin(0.2 * time),
        "mx_kN_m": 300.0 * np.sin(1.9 * time) * np.sin(0.1 * time),
        "my_kN_m": 500.0 * np.cos(0.7 * time),
    }
    table = np.column_stack([time, *columns.values()])
    heading = ",".join(["time_s", *columns])
    np.savetxt(tmp_path / "hub.csv", table, "%.9g", ",", header=heading, comments="")
    source = {
        "file": "hub.csv",
        "hours_per_year": 100.0,
        "skip_s": 0.0,
        "hub_forces": ["x_kN", "-y_kN", "z_kN"],
        "hub_moments": ["mx_kN_m", "my_kN_m"],
    }
    found = count_loads(gearbox(tmp_path, one=source)).equivalent_ranges
    assert list(found) == ["torque", "force_x", "force_y", "force_z", "moment_x", "moment_y"]
    for name, (column, factor) in zip(found, ((0, 1.0), (2, 1e3), (3, 1e3), (4, 1e3), (5, 1e3), (6, 1e3)), strict=True):
        series = factor * np.loadtxt(tmp_path / "hub.csv", delimiter=",", skiprows=1)[:, 1 + column]
        ranges, _, counts = rainflow(series)
        for m, value in found[name].items():
            assert value == pytest.approx(equivalent_range(ranges, counts, m, time[-1] - time[0]), rel=1e-9)


def test_hours_of_a_table_of_loads_are_hours_of_the_life(tmp_path):
    """Without hours_per_year they are what they say; with it shares, and that is told."""
    (tmp_path / "table.csv").write_text("torque_N_m,speed_rpm,hours\n1000,10,30\n3000,20,10\n")
    (found,) = load_sources(gearbox(tmp_path, one={"file": "table.csv"}))
    assert found.hours.tolist() == [30.0, 10.0] and not found.remarks
    (found,) = load_sources(gearbox(tmp_path, one={"file": "table.csv", "hours_per_year": 1000.0}))
    assert found.hours.tolist() == [1500.0, 500.0]
    assert found.remarks == (
        "one: hours of table.csv, 40 in total, are used as fractions of the 2000 h that result from hours_per_year",
    )
    (found,) = load_sources(gearbox(tmp_path, one={"file": "table.csv", "hours_per_year": 20.0}))
    assert not found.remarks


def test_the_verb_tells_files_and_loads_of_the_hub(dlc):
    case = dlc / "gearbox.toml"
    text = GRC.read_text()
    begin = text.index("[loads]")
    text = text[:begin] + (
        '[loads]\nbody = "carrier"\nlife_years = 20.0\n[loads.sources.all]\nfiles = "dlc/*.outb"\n'
        'hours_per_year = 3000.0\nskip_s = 0.0\ntorque = "RotTorq"\nspeed = "RotSpeed"\ntorque_factor = 0.057\n'
    )
    for named in Path("cases/grc750").iterdir():
        if named.is_file() and named.suffix in (".step", ".geo"):
            (dlc / named.name).write_bytes(named.read_bytes())
    case.write_text(text)
    result = exugear("loads", case, "--out", dlc / "out", "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert (told["sources"][0]["files"], told["sources"][0]["file"]) == (3, "dlc/*.outb")


SOURCE = {"skip_s": 0.0, "hours_per_year": 10.0}


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"files": "dlc/*.bin", "hours_per_year": 1.0}, ".bin': no matching file in"),
        ({"files": "/etc/*.csv", "hours_per_year": 1.0}, "Non-relative patterns"),
        (
            {"files": "dlc/../../*", "hours_per_year": 1.0},
            "is outside the folder of the gearbox file; move it there, or",
        ),
        ({"files": "dlc/*", "hours_per_year": 1.0}, "does not end in one of .outb, .out, .csv"),
        ({"files": "dlc/*.outb", "hours_table": "short.csv"}, "has no line for wind_12.outb"),
        ({"files": "dlc/*.outb", "hours_table": "bad.csv"}, "line 2 has 'wind_12.outb,many'"),
        ({"files": "dlc/*.outb", "hours_table": "other.csv"}, "begins with file,hours_per_year"),
        (
            {"files": "dlc/*.outb", "file": "dlc/wind_8.outb", "hours_per_year": 1.0},
            "a source requires file, files, or torque_N_m",
        ),
        ({"files": "dlc/*.outb", "wind": "WindVxi"}, "requires the section .loads.wind."),
        (
            {"file": "dlc/wind_8.outb", "hours_table": "short.csv"},
            "hours_table applies to files; set hours_per_year for a single file",
        ),
    ],
)
def test_bad_patterns_are_one_error_each(dlc, keys, message):
    (dlc / "dlc" / "readme.md").write_text("files of a turbine")
    (dlc.parent / "outside.outb").write_text("not of this gearbox")
    (dlc / "short.csv").write_text("file,hours_per_year\nwind_8.outb,1\n")
    (dlc / "bad.csv").write_text("file,hours_per_year\nwind_12.outb,many\n")
    (dlc / "other.csv").write_text("name,hours\na,1\n")
    with pytest.raises(GearboxFileError, match=message) as caught:
        load_sources(gearbox(dlc, all={"skip_s": 0.0, "torque": "RotTorq", "speed": "RotSpeed", **keys}))
    assert len(caught.value.errors) == 1


def test_a_series_needs_its_hours(tmp_path):
    (tmp_path / "series.csv").write_text("time_s,carrier_N_m,carrier_rpm\n0,1,1\n1,1,1\n2,1,1\n")
    with pytest.raises(GearboxFileError, match=".hours_per_year: this key is missing; a time series requires it"):
        load_sources(gearbox(tmp_path, one={"file": "series.csv", "skip_s": 0.0}))


def test_a_link_that_leads_out_of_the_folder_is_refused(dlc, tmp_path_factory):
    outside = tmp_path_factory.mktemp("outside") / "stranger.outb"
    outside.write_bytes((dlc / "dlc" / "wind_8.outb").read_bytes())
    (dlc / "dlc" / "link.outb").symlink_to(outside)
    with pytest.raises(
        GearboxFileError,
        match="is outside the folder of the gearbox file; move it there, or",
    ):
        load_sources(gearbox(dlc, all=turbine("files", hours_per_year=10.0)))


def test_steps_that_a_file_does_not_hold_are_refused_before_anything_is_allocated(tmp_path):
    """891 bytes that declare 2^29 steps: 4 GB of times alone."""
    time = np.arange(40) * 0.1
    content = bytearray(packed(2, time, np.column_stack([time, time + 1.0])))
    content[6:10] = struct.pack("<i", 2**29)
    path = tmp_path / "many.outb"
    path.write_bytes(bytes(content))
    tracemalloc.start()
    with pytest.raises(LoadFileError, match="cut short in its values: 21474.* bytes are needed, the file has"):
        read_channels(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1e6


@pytest.mark.sample
@pytest.mark.parametrize("ending", ["outb", "csv"])
def test_a_large_file_is_never_in_memory_as_a_whole(tmp_path, monkeypatch, ending):
    """24 MB of packed values (96 MB as numbers) and 10 MB of text, which were 14 and 42 times as much in memory."""
    monkeypatch.setattr(pools, "MOST_POINTS", 10_000)
    rng = np.random.default_rng(1)
    path = tmp_path / f"big.{ending}"
    if ending == "outb":
        steps = 300_000
        names = ("RotTorq", "RotSpeed", *(f"other{k}" for k in range(38)))
        units = ("(kN-m)", "(rpm)", *("(kN)",) * 38)
        first = np.tile(np.linspace(0.0, 1.0, 40), (2, 1)) * np.array([[1000.0], [2000.0]])
        head = bytearray(packed(2, np.array([0.0, 0.05]), first, names, units))[: -2 * 2 * 40]
        head[6:10] = struct.pack("<i", steps)
        with path.open("wb") as file:
            file.write(bytes(head))
            for _ in range(30):
                file.write(rng.integers(-3000, 3000, (steps // 30, 40)).astype("<i2").tobytes())
        keys = {"torque": "RotTorq", "speed": "RotSpeed"}
    else:
        steps = 400_000
        with path.open("w") as file:
            file.write("time_s,carrier_N_m,carrier_rpm\n")
            for begin in range(0, steps, 40_000):
                loads = enumerate(rng.normal((2e5, 20.0), (1e4, 1.0), (40_000, 2)).tolist(), begin)
                file.write("".join(f"{0.05 * k:.2f},{torque:.1f},{speed:.4f}\n" for k, (torque, speed) in loads))
        keys = {}
    case = gearbox(tmp_path, one={"file": path.name, "hours_per_year": 10.0, "skip_s": 100.0, **keys})
    tracemalloc.start()
    (found,) = load_sources(case)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert found.count == steps - 2000 and found.hours.sum() == pytest.approx(20.0)
    # Cycles of the series are kept: three numbers for two turning points, of which white noise has most.
    assert peak < 30e6


def series(rows: list[str]) -> str:
    return "time_s,carrier_N_m,carrier_rpm\n" + "\n".join(rows) + "\n"


def steady_rows(count: int = 400) -> list[str]:
    return [f"{0.1 * k:.1f},2000,12" for k in range(count)]


@pytest.mark.parametrize(
    ("place", "row", "message"),
    [
        (30, "3.0,2000,1e300", "300 rpm; plausible are up to 100000 rpm"),
        (30, "3.0,2000,0", ": the speed falls from 12 rpm to 0 within the step to 3 s"),
        (30, "3.0,1e15,12", "torque at 3 s is 1e.15 N m"),
        (30, "3.0,,12", ": line 32 has text where"),
        (30, "3.0,nan,12", "has no number at 3 s"),
    ],
)
def test_what_no_shaft_does_is_refused_with_its_row(tmp_path, place, row, message):
    rows = steady_rows()
    rows[place] = row
    (tmp_path / "series.csv").write_text(series(rows))
    with pytest.raises(GearboxFileError, match=message):
        load_sources(gearbox(tmp_path, one={"file": "series.csv", **SOURCE}))


def test_a_gap_in_time_is_refused_with_its_row(tmp_path):
    rows = steady_rows()
    del rows[250:330]
    (tmp_path / "series.csv").write_text(series(rows))
    with pytest.raises(GearboxFileError, match=": no samples between 24.9 and 33 s"):
        load_sources(gearbox(tmp_path, one={"file": "series.csv", **SOURCE}))


def test_a_speed_of_a_table_beyond_all_shafts_is_refused_with_its_row(tmp_path):
    (tmp_path / "table.csv").write_text("torque_N_m,speed_rpm,hours\n1000,10,30\n3000,1e300,10\n")
    with pytest.raises(GearboxFileError, match=r"row 2 has 1e\+300 rpm"):
        load_sources(gearbox(tmp_path, one={"file": "table.csv"}))


@pytest.mark.parametrize(("unit", "second"), [("s", 1.0), ("ms", 1e-3), ("min", 60.0), ("h", 3600.0)])
def test_the_unit_of_time_is_read(tmp_path, unit, second):
    """Events count by the length of the file, in its own unit."""
    rows = [f"{k},2000,12" for k in range(101)]
    (tmp_path / "series.csv").write_text(series(rows).replace("time_s", f"time_{unit}"))
    (found,) = load_sources(gearbox(tmp_path, one={"file": "series.csv", "skip_s": 0.0, "events_per_year": 0.5}))
    assert found.duration == pytest.approx(100.0 * second)
    assert found.hours.sum() == pytest.approx(0.5 * 2.0 * 100.0 * second / 3600.0)


def test_a_unit_of_time_that_is_none_is_refused(tmp_path):
    time = np.arange(40) * 0.1
    content = packed(2, time, np.column_stack([time, time + 1.0])).replace(b"(s)       ", b"(parsec)  ", 1)
    path = tmp_path / "far.outb"
    path.write_bytes(content)
    with pytest.raises(LoadFileError, match=r"time has the unit '\(parsec\)'"):
        assert len(read_channels(path).time)


def test_line_ends_of_all_systems_are_read_across_blocks(tmp_path, monkeypatch):
    from exugear.exchange import series_files

    monkeypatch.setattr(series_files, "BLOCK", 7)
    rows = ["0,1,2", "1,2,3", "", "2,4,5", "3,6,7"]
    for end in ("\n", "\r\n", "\r"):
        path = tmp_path / "series.csv"
        path.write_bytes(end.join(["time_s,carrier_N_m,carrier_rpm", *rows, ""]).encode("utf-8-sig"))
        found = read_channels(path)
        assert found.time.tolist() == [0.0, 1.0, 2.0, 3.0]
        assert found.channel("carrier_N_m", "torque").tolist() == [1.0, 2.0, 4.0, 6.0]


def test_a_file_without_lines_is_no_table(tmp_path):
    path = tmp_path / "series.csv"
    path.write_bytes(b"time_s,a_N_m\n" + b"1" * 11_000_000)
    with pytest.raises(LoadFileError, match="a line of more than 1e.07 bytes"):
        assert len(read_channels(path).time)


@pytest.mark.validation
def test_a_spectrum_of_a_thousand_files(dlc):
    """Each of three files 334, 333 and 333 times: the loads of the three, in the hours of their number."""
    for number in range(1000):
        path = dlc / "dlc" / f"wind_{(8, 12, 18)[number % 3]}.outb"
        (dlc / "dlc" / f"seed_{number:04d}.out_b").with_suffix(".outb").write_bytes(path.read_bytes())
    sources = {"all": turbine("files", files="dlc/seed_*.outb", hours_per_year=3000.0)}
    told: list[tuple[int, int]] = []
    found = count_loads(gearbox(dlc, **sources), lambda done, total: told.append((done, total)))
    expected = singles(dlc, {8: 1002.0, 12: 999.0, 18: 999.0})
    assert (len(told), told[-1]) == (1000, (999, 1000))
    assert [*found.equivalents().values()] == pytest.approx([*expected.equivalents().values()], rel=1e-5)
    ranges = found.equivalent_ranges["torque"]
    assert [*ranges.values()] == pytest.approx([*expected.equivalent_ranges["torque"].values()], rel=1e-9)
