"""The comparison of two commits tells equal numbers from others."""

from __future__ import annotations

import importlib.util
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import xarray as xr

FOLDER = Path(__file__).parent.parent / "benchmarks"
NUMBERS = np.array([3.0, -1.0, 0.5])
TOLERANCE = 1e-13


@pytest.fixture(scope="module")
def comparing() -> Iterator[ModuleType]:
    specification = importlib.util.spec_from_file_location("comparing", FOLDER / "comparing.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    # Its data class looks its types up in the module.
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "comparing", module)
        specification.loader.exec_module(module)
        yield module


def test_same_numbers_are_bitwise_equal(comparing: ModuleType) -> None:
    compared = comparing.compare({"ste": NUMBERS}, {"ste": NUMBERS.copy()})
    assert compared.equal == ["ste"]
    assert compared.verdict(TOLERANCE) == "bitwise equal"


def test_difference_is_relative_to_the_largest_magnitude(comparing: ModuleType) -> None:
    moved = NUMBERS + [0.0, 0.0, 3e-12]
    compared = comparing.compare({"ste": NUMBERS}, {"ste": moved})
    assert compared.greatest == pytest.approx(1e-12, rel=1e-3)
    assert compared.verdict(TOLERANCE).startswith("DIFFERENT, ste by")
    assert compared.verdict(1e-11).startswith("equal within the tolerance, ste by")


@pytest.mark.parametrize(("before", "after"), [(["a"], ["a", "b"]), (["a", "b"], ["a"])])
def test_variable_that_is_missing_differs(comparing: ModuleType, before: list[str], after: list[str]) -> None:
    compared = comparing.compare(dict.fromkeys(before, NUMBERS), dict.fromkeys(after, NUMBERS))
    assert compared.differences == {"b": math.inf}


def test_attribute_that_is_new_is_told_and_one_that_is_lost_differs(comparing: ModuleType) -> None:
    plain, described = {"ste": NUMBERS}, {"ste": NUMBERS, "ste@units": np.array("m")}
    assert comparing.compare(plain, described).verdict(TOLERANCE) == "bitwise equal"
    assert comparing.compare(plain, described).noted == {"ste@units": "new"}
    assert comparing.compare(described, plain).differences == {"ste@units": math.inf}


def test_nan_is_equal_at_the_same_places_only(comparing: ModuleType) -> None:
    before, close, elsewhere = (
        np.array(values) for values in ([np.nan, 2.0, 1.0], [np.nan, 2.0, 1.0 + 2e-12], [2.0, np.nan, 1.0])
    )
    assert comparing.difference(before, before.copy()) is None
    assert comparing.difference(before, close) == pytest.approx(1e-12, rel=1e-3)
    assert comparing.difference(before, elsewhere) == math.inf


@pytest.mark.parametrize(
    "other",
    [NUMBERS[:2], NUMBERS.astype(np.float32), np.array([np.inf, -1.0, 0.5]), np.array(["3.0", "-1.0", "0.5"])],
    ids=["shape", "type", "infinite", "text"],
)
def test_what_cannot_be_subtracted_differs_without_bound(comparing: ModuleType, other: np.ndarray) -> None:
    assert comparing.difference(NUMBERS, other) == math.inf


def write(path: Path, ste: float, **attributes: str) -> None:
    data = xr.Dataset({"ste": ("pmc", [ste, 2.0])}, attrs=attributes)
    data.to_netcdf(path, engine="h5netcdf")
    with path.open("ab") as file:
        file.write(b"\nexugear sha256 " + 64 * b"0" + b"\n")


def test_files_are_compared_but_for_hashes_and_times(comparing: ModuleType, tmp_path: Path) -> None:
    before, after = tmp_path / "before", tmp_path / "after"
    for folder, digest in ((before, "1"), (after, "2")):
        folder.mkdir()
        write(folder / "table.nc", 1.0, input_hash=digest, input=json.dumps({"teeth": 21, "seconds": float(digest)}))
        np.savez(folder / f"carrier-{16 * digest}.npz", mass=NUMBERS)
    compared = comparing.compare_folders(before, after)
    assert {title: entry.verdict(0.0) for title, entry in compared.items()} == {
        "carrier.npz": "bitwise equal",
        "table.nc": "bitwise equal",
    }
    assert compared["table.nc"].noted == {"@input_hash": "different"}
    assert "@input/teeth" in compared["table.nc"].equal


def test_file_that_is_missing_or_holds_another_number_differs(comparing: ModuleType, tmp_path: Path) -> None:
    before, after = tmp_path / "before", tmp_path / "after"
    for folder, ste in ((before, 1.0), (after, 1.5)):
        folder.mkdir()
        write(folder / "table.nc", ste)
    write(before / "run.nc", 1.0)
    compared = comparing.compare_folders(before, after)
    assert compared["table.nc"].differences == {"ste": 0.25}
    assert compared["run.nc"].greatest == math.inf
    assert "DIFFERENT" in comparing.report("run.nc", compared["run.nc"], TOLERANCE)
