"""Sources of many files gone wrong: keys and files that are damaged, kills, full disks, hostile names."""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ...cases.case_mutations import mutant, toml_text
from ...cases.command import exugear
from ...cases.spur import SPUR_CASE
from ...exchange.load_files.test_load_files import packed
from ...gearbox.test_case_mutations import at_most, is_refused_in_words

LIMIT = 60.0
MANY = range(1000, 1500)
"""Damage for a release."""
SPUR = tomllib.loads(SPUR_CASE)
TURBINE = {"torque": "RotTorq", "speed": "RotSpeed"}
LOADS: dict[str, Any] = {
    "body": "shaft_1",
    "life_years": 2.0,
    "bins": 20,
    "wind": {"mean_m_per_s": 8.5, "shape": 2.0, "bin_m_per_s": 2.0, "hours_per_year": 900.0},
    "sources": {
        "site": {"files": "dlc/wind_*.csv", "wind": "wind_m_per_s", "skip_s": 1.0},
        "stops": {"files": "dlc/stop_?.csv", "events_per_year": 30.0, "skip_s": 0.0, "torque_factor": 0.5},
        "listed": {"files": "dlc/wind_*.csv", "hours_table": "hours.csv", "skip_s": 0.0, "speed_factor": 1.1},
        "packed": {"files": "dlc/*.outb", "hours_per_year": 50.0, "skip_s": 0.0, **TURBINE},
        "table": {"file": "table.csv", "hours_per_year": 20.0},
        "worst": {"file": "dlc/stop_1.csv", "kind": "extreme", "partial_factor": 1.35, "skip_s": 0.0},
    },
}  # fmt: skip


def series(seed: int, count: int = 120) -> str:
    rng = np.random.default_rng(seed)
    rows = zip(0.5 * np.arange(count), rng.normal(90.0, 20.0, count), rng.normal(1200.0, 30.0, count), strict=True)
    lines = (f"{time:.1f},{torque:.2f},{speed:.1f},{6.0 + seed}" for time, torque, speed in rows)
    return "\n".join(["time_s,shaft_1_N_m,shaft_1_rpm,wind_m_per_s", *lines, ""])


def write_files(folder: Path) -> None:
    (folder / "dlc").mkdir()
    for name, seed in (("wind_a", 1), ("wind_b", 4), ("stop_1", 2), ("stop_2", 3)):
        (folder / "dlc" / f"{name}.csv").write_text(series(seed))
    time = 0.5 * np.arange(60)
    values = np.column_stack([0.09 + 0.01 * np.sin(time), 1200.0 + 10.0 * np.cos(time)])
    units = ("(kN-m)", "(rpm)")
    (folder / "dlc" / "turbine.outb").write_bytes(packed(2, time, values, ("RotTorq", "RotSpeed"), units))
    (folder / "hours.csv").write_text("file,hours_per_year\nwind_a.csv,100\nwind_b.csv,200\n")
    (folder / "table.csv").write_text("torque_N_m,speed_rpm,hours\n100,1500,3\n-40,1000,1\n")


@pytest.fixture
def case(tmp_path: Path) -> Path:
    write_files(tmp_path)
    path = tmp_path / "gearbox.toml"
    path.write_text(toml_text({**SPUR, "loads": LOADS}), encoding="utf-8")
    return path


def loads(case: Path, out: Path) -> Any:
    with at_most(LIMIT):
        return exugear("loads", case, "--out", out, "--json")


class Told:
    """An outcome without the bar that tells which file is read."""

    def __init__(self, outcome: Any) -> None:
        self.exit_code, self.exception = outcome.exit_code, outcome.exception
        lines = outcome.stderr.splitlines(keepends=True)
        self.stderr = "".join(line for line in lines if line.strip() and not line.startswith("load files "))


def passes(case: Path, out: Path, told: str) -> bool:
    """Whether a case is counted; else it is refused in words, with nothing written."""
    outcome = loads(case, out)
    try:
        if is_refused_in_words(Told(outcome), case):
            assert not out.exists(), "was refused after it was written"
            return False
        numbers = json.loads(outcome.stdout, parse_constant=lambda token: pytest.fail(f"{token} is no JSON"))
        assert numbers["hours"] > 0.0
    except Exception as error:  # whatever it was: the seed tells how to see it again
        raise AssertionError(f"{told}: {error!r} {outcome.stderr}") from outcome.exception
    return True


def with_damaged_keys(seed: int) -> tuple[str, str]:
    """Text of the case with its loads gone wrong, and what was done."""
    text, told = mutant({"loads": {"loads": LOADS}}, seed)
    try:
        return toml_text({**SPUR, **tomllib.loads(text)}), told
    except (ValueError, RecursionError):  # no TOML: damaged as text, or too deep
        return text, told


def keys_survive(case: Path, seeds: range) -> list[bool]:
    found = []
    for seed in seeds:
        text, told = with_damaged_keys(seed)
        case.write_text(text, encoding="utf-8", newline="")
        found.append(passes(case, case.parent / f"out-keys-{seed}", told))
    return found


def test_the_loads_to_start_from_are_counted(case):
    outcome = loads(case, case.parent / "out")
    assert outcome.exit_code == 0, outcome.stderr
    files = {one["source"]: one["files"] for one in json.loads(outcome.stdout)["sources"]}
    assert files == {"site": 2, "stops": 2, "listed": 2, "packed": 1, "table": 1, "worst": 1}


@pytest.mark.validation
@pytest.mark.parametrize("seeds", [range(24), pytest.param(MANY, marks=pytest.mark.long)], ids=str)
def test_damaged_keys_of_loads_are_refused_in_words_or_counted(case, seeds):
    found = keys_survive(case, seeds)
    assert 2 / 24 < sum(found) / len(found) < 20 / 24  # else the mutants are no test of anything


def damaged(content: bytes, rng: random.Random) -> bytes:
    """A file cut short, with bytes changed, doubled or taken out."""
    at = rng.randrange(len(content))
    end = min(len(content), at + rng.choice((1, 2, 8, 300)))
    junk = bytes(rng.randrange(256) for _ in range(end - at))
    words = rng.choice((b"nan", b"1e400", b"-1", b",", b"\n", b"\x00", b"'", b"\xff\xfe", b"time_s", b" " * 3000))
    changes = (content[:at], content[:at] + junk + content[end:], content[:at] + content[end:])
    return rng.choice(
        (*changes, content[:at] + words + content[end:], content[:at] + 2 * content[at:end] + content[end:])
    )


def files_survive(case: Path, seeds: range) -> list[bool]:
    names = [*sorted((case.parent / "dlc").iterdir()), case.parent / "hours.csv", case.parent / "table.csv"]
    found = []
    for seed in seeds:
        rng = random.Random(seed)
        path = rng.choice(names)
        whole = path.read_bytes()
        path.write_bytes(damaged(whole, rng))
        found.append(passes(case, case.parent / f"out-{seed}", f"seed {seed}: {path.name}"))
        path.write_bytes(whole)
    return found


@pytest.mark.validation
@pytest.mark.parametrize("seeds", [range(24), pytest.param(MANY, marks=pytest.mark.long)], ids=str)
def test_damaged_files_of_many_are_refused_in_words_or_counted(case, seeds):
    found = files_survive(case, seeds)
    assert {True, False} == set(found)


@pytest.mark.parametrize(
    "name", ["wind_\x1b[31m.csv", "wind_<img src=x>.csv", "wind_[red].csv", "wind_\u202e.csv", "wind_\n.csv"]
)
def test_names_of_files_steer_no_terminal(case, name):
    """A file of any name is counted, or refused in a line of printable letters."""
    (case.parent / "dlc" / name).write_text(series(1).replace("90", "x", 1) + "1,2\n")
    outcome = loads(case, case.parent / "out")
    assert outcome.exit_code == 2 and "dlc/wind_" in outcome.stderr
    assert all(line.isprintable() for line in outcome.stderr.splitlines()), outcome.stderr
    assert not (case.parent / "out").exists()


def test_a_full_disk_is_a_sentence_and_what_was_there_stays(case):
    disk = case.parent / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)]
    if sys.platform != "linux" or os.geteuid() or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a file system cannot be mounted here")
    try:
        out = disk / "out"
        assert loads(case, out).exit_code == 0
        before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
        assert before
        with (disk / "ballast").open("wb", buffering=0) as ballast:
            for size in (4096, 1):
                try:
                    while True:
                        ballast.write(bytes(size))
                except OSError:
                    continue
        text = case.read_text(encoding="utf-8")
        case.write_text(text.replace("events_per_year = 30.0", "events_per_year = 60.0"), encoding="utf-8")
        outcome = loads(case, out)
        assert outcome.exit_code == 1, outcome.output
        assert "No space left on device" in outcome.stderr and str(disk) in outcome.stderr
        assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
    finally:
        subprocess.run(["umount", str(disk)], check=True)


@pytest.mark.validation
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_count_that_was_killed_is_done_again_to_the_same_bits(case):
    (case.parent / "known").mkdir()
    command = [sys.executable, "-m", "tests.exugear.cases.killed_lives", "loads", str(case.parent), "7"]
    ended = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[4], check=False)
    assert ended.returncode == 0, ended.stderr
    found = json.loads(ended.stdout)
    assert found["kills"] > 5
    assert (found["undisturbed"], found["wrong"]) == (0, [])
