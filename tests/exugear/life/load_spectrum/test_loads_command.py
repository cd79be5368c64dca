"""The verb `loads`: sources of every kind, what parts see of them, and bad files as one error each."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from exugear.exchange.rexs.containers import read_rexs
from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.life.load_spectrum.counted import count_loads
from exugear.life.load_spectrum.sources import load_sources

from ...cases.command import exugear

GRC = Path("cases/grc750/gearbox.toml")
FVA = Path("tests/exugear/exchange/rexs/data/FVA-Industriegetriebe_2stufig_1-4.rexs")


def loaded(tmp_path: Path, text: str, name: str = "loads.csv", **keys: object) -> Gearbox:
    """GRC with one source beside the gearbox file."""
    (tmp_path / name).write_text(text)
    source = {"file": name, "hours_per_year": 1000.0, **keys}
    source = {key: value for key, value in source.items() if value is not None}
    content = {**Gearbox.from_toml(GRC).content}
    content["loads"] = {"body": "carrier", "life_years": 2.0, "sources": {"bench": source}}
    return Gearbox.from_dict(content, str(tmp_path / "gearbox.toml"))


def test_the_example_tells_what_each_part_sees(tmp_path):
    result = exugear("loads", GRC, "--out", tmp_path, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert told["hours"] == pytest.approx(20.0 * (4410.6 + 2196.4 + 749.8))
    parts = {(row["part"], row.get("loaded_by")): row["cycles"] for row in told["parts"]}
    turns = told["revolutions"]
    # Per turn of the carrier: three planets pass a tooth of the sun at 4.714 turns relative to them.
    assert parts["sun, flank -", "sun_planet"] == pytest.approx(turns * 3 * 99 / 21)
    assert parts["ring, flank -", "ring_planet"] == pytest.approx(3 * turns)
    assert parts["hs_pinion, flank -", "high_speed"] == pytest.approx(81.490683 * turns)
    assert (tmp_path / "loads" / "carrier.csv").read_text().startswith("lower_N_m,upper_N_m,torque_N_m")
    assert (tmp_path / "loads" / "load_duration.png").stat().st_size > 10_000
    assert any("torque times 0.057415" in line for line in told["remarks"])


def test_a_spectrum_table_and_its_series_count_alike(tmp_path):
    """Two torques for equal times, as a table and as a series of steps."""
    table = loaded(tmp_path, "torque_N_m,speed_rpm,hours\n1000,10,1\n3000,20,1\n")
    steps = [(k, 1000 if k < 500 else 3000, 10 if k < 500 else 20) for k in range(1000)]
    lines = "\n".join(f"{t},{torque},{speed}" for t, torque, speed in steps)
    series = loaded(tmp_path, f"time_s,carrier_N_m,carrier_rpm\n{lines}\n", "series.csv", skip_s=0.0)
    one, other = (count_loads(gearbox).distribution for gearbox in (table, series))
    assert one.torque == pytest.approx(other.torque)
    assert one.revolutions == pytest.approx(other.revolutions, rel=2e-3)  # the ends of a series last half a step


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ("1000,10,3\n2000,-20,1\n", "positive torque at a negative speed for 25 % of its hours"),
        ("-1000,10,3\n2000,20,1\n", "negative torque at a positive speed for 75 % of its hours"),
        ("-1000,10,1\n2000,20,3\n", ""),  # a drive that brakes now and then
        ("-1000,-10,1\n2000,20,3\n", ""),  # one that is reversed
    ],
)
def test_torques_against_the_speed_are_doubted(tmp_path, rows, told):
    """Power is torque times speed: it flows back where their signs differ."""
    remarks = count_loads(loaded(tmp_path, f"torque_N_m,speed_rpm,hours\n{rows}")).remarks
    warnings = [line for line in remarks if line.startswith("Warning: bench: loads.csv has ")]
    assert len(warnings) == bool(told)
    assert all(told in line for line in warnings)


def test_skipped_time_is_left_out_and_told(tmp_path):
    lines = "\n".join(f"{t},{1e6 if t < 10 else 2000},10" for t in range(100))
    counted = count_loads(loaded(tmp_path, f"time_s,carrier_N_m,carrier_rpm\n{lines}\n", skip_s=10.0))
    assert counted.sources[0].torque.max() == 2000.0
    assert counted.remarks == ("bench: the first 10 s of loads.csv are skipped",)


def test_events_count_by_the_length_of_the_file(tmp_path):
    lines = "\n".join(f"{t},2000,10" for t in range(101))
    (tmp_path / "loads.csv").write_text(f"time_s,carrier_N_m,carrier_rpm\n{lines}\n")
    content = {**Gearbox.from_toml(GRC).content}
    source = {"file": "loads.csv", "events_per_year": 36.0, "skip_s": 0.0}
    content["loads"] = {"body": "carrier", "life_years": 5.0, "sources": {"stops": source}}
    (found,) = load_sources(Gearbox.from_dict(content, str(tmp_path / "gearbox.toml")))
    assert found.hours.sum() == pytest.approx(36.0 * 5.0 * 100.0 / 3600.0)


def test_a_torque_reversal_loads_the_other_flanks(tmp_path):
    counted = count_loads(loaded(tmp_path, "torque_N_m,speed_rpm,hours\n1000,10,3\n-500,10,1\n"))
    parts = {row["part"]: row["cycles"] for row in counted.part_rows()}
    assert parts["hs_pinion, flank -"] == pytest.approx(3.0 * parts["hs_pinion, flank +"])
    forces = {row["part"]: row["force_kN"] for row in counted.part_rows()}
    assert forces["hs_pinion, flank -"] == pytest.approx(2.0 * forces["hs_pinion, flank +"])


@pytest.mark.parametrize("line", ["0,10,1", "100,0,1"])
def test_loads_that_wear_nothing_are_refused(tmp_path, line):
    with pytest.raises(
        GearboxFileError,
        match="loads.sources: no fatigue source has torque, speed and hours",
    ):
        count_loads(loaded(tmp_path, f"torque_N_m,speed_rpm,hours\n{line}\n"))


def test_revolutions_backwards_count_as_those_forwards(tmp_path):
    """What matters to a flank is that it is loaded once more; which flank, the sign of the torque says."""
    one, other = (
        count_loads(loaded(tmp_path, f"torque_N_m,speed_rpm,hours\n1000,{speed},3\n-500,10,1\n")).part_rows()
        for speed in (10, -10)
    )
    assert one == other


def test_load_cases_of_a_rexs_file():
    """FVA's two-stage gearbox: 567, 345, 456 and 789 N m at 543, 3456, 1234 and 789 rpm for 20, 30, 35 and 15 %."""
    gearbox = to_case(read_rexs(FVA), FVA.name, FVA.with_name("gearbox.toml")).gearbox
    body = gearbox.case.overall.input
    content = {**gearbox.content}
    source = {"file": FVA.name, "hours_per_year": 1000.0}
    content["loads"] = {"body": body, "life_years": 1.0, "sources": {"spectrum": source}}
    (found,) = load_sources(Gearbox.from_dict(content, str(FVA.with_name("gearbox.toml"))))
    assert np.abs(found.torque) == pytest.approx([567.0, 345.0, 456.0, 789.0])
    assert np.abs(found.speed) * 30.0 / np.pi == pytest.approx([543.0, 3456.0, 1234.0, 789.0])
    assert found.hours == pytest.approx([200.0, 300.0, 350.0, 150.0])


HEADED = "time_s,carrier_N_m,carrier_rpm\n"


@pytest.mark.parametrize(
    ("text", "keys", "message"),
    [
        (f"{HEADED}0,1,1\n1,1,1\n2,1,1\n", {}, "skip_s: this key is missing"),
        (f"{HEADED}0,1,1\n1,1,1\n2,1,1\n", {"skip_s": 5.0}, ": no samples remain of a series of 2 s"),
        (f"{HEADED}0,1,1\n1,nan,1\n2,1,1\n", {"skip_s": 0.0}, "carrier_N_m has no number at 1 s"),
        (f"{HEADED}0,1,1\n1,1\n2,1,1\n", {"skip_s": 0.0}, "line 3 has 2 columns"),
        ("time_s,carrier_N_m\n0,1\n1,1\n2,1\n", {"skip_s": 0.0}, "no channel 'carrier_rpm'"),
        ("time_s,carrier_kN,carrier_rpm\n0,1,1\n1,1,1\n2,1,1\n", {"skip_s": 0.0, "torque": "carrier_kN"}, "unit 'kN'"),
        ("torque_N_m,hours\n1,1\n2,2\n", {}, "headings 'torque_N_m,hours'"),
        ("torque_N_m,speed_rpm,hours\n1,1,1\n2,2,-2\n", {}, "line 3 has 2,2,-2; .*hours not negative"),
        ("torque_N_m,speed_rpm,hours\n1,nan,1\n", {}, "line 2 has 1,nan,1"),
        ("torque_N_m,speed_rpm,hours\n1,1,0\n", {}, "all hours are 0"),
        ("torque_N_m,speed_rpm,hours\n1e12,1,1\n", {}, ": row 1 has 1e.12 N m; plausible are up to 1e.09"),
        ("torque_N_m,speed_rpm,hours\n", {}, "has headings only"),
        ("torque_N_m;speed_rpm;hours\n1;1;1\n", {}, "separated by commas"),
        ("torque_N_m,speed_rpm,speed_rpm\n1,1,1\n", {}, ": two columns have the name 'speed_rpm'"),
        ("", {}, "is empty"),
        (
            "torque_N_m,speed_rpm,hours\n1,1,1\n",
            {"skip_s": 3.0},
            "skip_s: not applicable to a table of loads; remove the key",
        ),
        ("torque_N_m,speed_rpm,hours\n1,1,1\n", {"hours_per_year": 8766.0, "file": "missing.csv"}, "no such file"),
    ],
)
def test_bad_sources_are_one_error_each(tmp_path, text, keys, message):
    with pytest.raises(GearboxFileError, match=message) as caught:
        load_sources(loaded(tmp_path, text, **keys))
    assert len(caught.value.errors) == 1


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"kind": "extreme"}, "an extreme source requires partial_factor, and none of"),
        ({"events_per_year": 3.0}, "requires one of hours_per_year, events_per_year"),
        ({"hours_per_year": 9000.0}, "must lie between 0 and 8766"),
        ({"torque_factor": 0.0}, "must not be 0"),
    ],
)
def test_bad_keys_are_told(tmp_path, keys, message):
    with pytest.raises(GearboxFileError, match=message):
        loaded(tmp_path, "torque_N_m,speed_rpm,hours\n1,1,1\n", **keys)


def test_more_hours_than_a_year_has_are_refused(tmp_path):
    gearbox = loaded(tmp_path, "torque_N_m,speed_rpm,hours\n1,1,1\n", hours_per_year=5000.0)
    content = {**gearbox.content}
    content["loads"]["sources"]["again"] = content["loads"]["sources"]["bench"]
    with pytest.raises(GearboxFileError, match="10000 hours per year in total; a year has"):
        load_sources(Gearbox.from_dict(content, gearbox.source))


def test_a_case_without_loads_is_bad_input(tmp_path):
    case = tmp_path / "gearbox.toml"
    assert exugear("new", case, "--kind", "pair").exit_code == 0
    text = case.read_text(encoding="utf-8")
    case.write_text(text[: text.index("[loads]")], encoding="utf-8")
    result = exugear("loads", case)
    assert result.exit_code == 2
    assert "loads: this section is missing" in result.stderr


def points(**keys: object) -> Gearbox:
    """GRC with operating points in the gearbox file itself."""
    stated = {"torque_N_m": [1000.0, 3000.0], "speed_rpm": [10.0, 20.0], "hours": [1.0, 2.0]} | keys
    stated = {key: value for key, value in stated.items() if value is not None}
    content = {**Gearbox.from_toml(GRC).content}
    content["loads"] = {"body": "carrier", "life_years": 2.0, "sources": {"bench": stated}}
    return Gearbox.from_dict(content, "gearbox.toml")


@pytest.mark.parametrize("keys", [{}, {"hours_per_year": 1000.0}, {"torque_factor": -1.0}])
def test_operating_points_in_the_file_count_as_a_table_does(tmp_path, keys):
    text = "torque_N_m,speed_rpm,hours\n1000,10,1\n3000,20,2\n"
    table = loaded(tmp_path, text, **{"hours_per_year": None, **keys})
    one, other = (count_loads(gearbox) for gearbox in (points(**keys), table))
    assert one.distribution.torque == pytest.approx(other.distribution.torque)
    assert one.distribution.hours == pytest.approx(other.distribution.hours)
    assert one.distribution.revolutions == pytest.approx(other.distribution.revolutions)
    assert one.sources[0].file == "gearbox.toml"


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"hours": [1.0]}, "torque_N_m, speed_rpm and hours must be stated together, with as many values"),
        ({"speed_rpm": None}, "must be stated together"),
        ({"file": "loads.csv"}, "a source requires file, files, or torque_N_m with speed_rpm and hours"),
        ({"skip_s": 1.0}, "skip_s: not applicable to a table of loads"),
        ({"hours": [8766.0, 8766.0 * 2.0]}, "hours per year in total"),
        ({"hours": [-1.0, 1.0]}, "hours"),
    ],
)
def test_operating_points_that_cannot_be_counted_are_one_error(keys, message):
    with pytest.raises(GearboxFileError, match=message):
        count_loads(points(**keys))
