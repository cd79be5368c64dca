"""What is kept under a key is read as it was written, or not at all."""

from __future__ import annotations

import errno
import io
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from fe_ste.tools import stores
from fe_ste.tools.stores import (
    FOLDER_VARIABLE,
    Arrays,
    Cache,
    Layout,
    Store,
    load_dataset,
    write_arrays,
    write_dataset,
    write_sealed,
)

from ..damage import damages

VALUES = {"real": np.random.default_rng(1).random((40, 7)), "whole": np.arange(5), "names": np.array(["a", "bc"])}
DATA = xr.Dataset({"a": (("x",), np.linspace(0.0, 1.0, 9), {"units": "m"})}, attrs={"method_version": 3})
LAYOUT = Layout("numbers", 3, {"a": ("x",)})


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "folder" / "values.npz", "this input")


@pytest.fixture
def written(store: Store) -> Store:
    store.write(VALUES)
    return store


@pytest.mark.parametrize("compressed", [False, True])
def test_arrays_come_back_to_the_bit(store: Store, compressed: bool) -> None:
    store.write(VALUES, compressed=compressed)
    arrays = store.read(dict)
    assert arrays is not None and list(arrays) == list(VALUES)
    for name, values in VALUES.items():
        assert arrays[name].dtype == values.dtype and arrays[name].tobytes() == values.tobytes()


def test_a_dataset_comes_back_with_its_key(store: Store) -> None:
    store.write_dataset(DATA)
    found = store.read_dataset(LAYOUT)
    assert found is not None and found.identical(DATA.assign_attrs(input_hash="this input"))


def test_a_netcdf_file_is_read_as_xarray_reads_it(tmp_path: Path) -> None:
    """Two readers of one file: texts, truth values, NaN, coordinates of other dimensions, dimensions without values."""
    dataset = xr.Dataset(
        {
            "text": (("x",), np.array(["", "µm", "long name"]), {"long_name": "texts"}),
            "empty_text": (("none",), np.zeros(0, dtype=str)),
            "real": (("x", "free"), np.array([[1.0, np.nan]] * 3), {"units": "m", "range": np.array([0.0, 2.0])}),
            "whole": ((), np.int64(3), {"factor": np.array([2.5])}),
            "single": (("free",), np.ones(2, dtype=np.float32), {"flag": np.int32(1)}),
            "true": (("x",), np.array([True, False, True])),
        },
        coords={"x": [0.0, 0.5, 1.0], "name": (("x",), np.array(["a", "b", "c"])), "scalar": 7.0},
        attrs={"method_version": 3, "title": "numbers", "list": [1, 2]},
    )
    path = tmp_path / "numbers.nc"
    write_dataset(path, dataset)
    layout = Layout("numbers", 3, {"real": ("x", "free")}, ("title",))
    for names in (None, ["real"], ["text", "whole"], ["x"]):
        found = load_dataset(path, layout, names)
        expected = xr.load_dataset(path, engine="h5netcdf")
        expected = expected if names is None else expected[names]
        assert found.identical(expected), names
        if "true" in found:
            found["true"][1] = True
            assert found["true"].values.all(), "values are in memory and can be changed"
        assert {name: own.dtype.kind for name, own in found.variables.items()} == {
            name: own.dtype.kind for name, own in expected.variables.items()
        }


def test_what_is_not_there_or_of_another_key_is_none_without_a_word(
    written: Store, caplog: pytest.LogCaptureFixture
) -> None:
    assert Store(written.path, "another input").read(dict) is None
    assert Store(written.path.with_name("nothing"), written.key).read(dict) is None
    assert Store(written.path.with_name("nothing"), written.key).read_dataset(LAYOUT) is None
    written.write_dataset(DATA)
    assert Store(written.path, "another input").read_dataset(LAYOUT) is None
    assert written.read_dataset(Layout("numbers", 4, {"a": ("x",)})) is None, "another version is another key"
    write_dataset(written.path, DATA)
    assert written.read_dataset(LAYOUT) is None, "a file without a key"
    write_arrays(written.path, VALUES)
    assert written.read(dict) is None
    assert caplog.messages == []


@pytest.mark.parametrize("kind", ["arrays", "dataset"])
def test_no_damage_is_read_and_the_log_names_the_file(
    store: Store, caplog: pytest.LogCaptureFixture, kind: str
) -> None:
    (store.write(VALUES) if kind == "arrays" else store.write_dataset(DATA))
    for damaged in [b"", b"text", *damages(store.path.read_bytes(), 70)]:
        store.path.write_bytes(damaged)
        caplog.clear()
        assert (store.read(dict) if kind == "arrays" else store.read_dataset(LAYOUT)) is None
        assert len(caplog.messages) == 1
        assert str(store.path) in caplog.text and "it is computed again" in caplog.text


def test_arrays_that_do_not_make_what_is_wanted_are_damage(written: Store, caplog: pytest.LogCaptureFixture) -> None:
    def wanted(arrays: Arrays) -> float:
        return float(arrays["missing"])

    assert written.read(wanted) is None
    assert "is damaged (KeyError('missing')); it is computed again" in caplog.text


def test_a_stored_object_is_never_unpickled(store: Store) -> None:
    """A pickle runs whatever its maker likes."""
    content = io.BytesIO()
    np.savez(content, key=np.array(store.key), a=np.array([print], dtype=object))
    write_sealed(store.path, content.getvalue())
    assert store.read(dict) is None
    with pytest.raises(ValueError, match="allow_pickle"):
        store.write({"a": np.array([print], dtype=object)})


def test_a_full_disk_leaves_what_was_there(written: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(file: Any, content: Any) -> None:
        file.write(bytes(10))
        raise OSError(errno.ENOSPC, "No space left on device", file.name)

    monkeypatch.setattr(stores, "write_all", full)
    with pytest.raises(OSError, match="No space left"):
        written.write({"real": np.zeros(3)})
    arrays = written.read(dict)
    assert arrays is not None and np.array_equal(arrays["real"], VALUES["real"])
    assert list(written.path.parent.iterdir()) == [written.path]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signal")
def test_a_kill_in_the_middle_of_writing_leaves_what_was_there(written: Store) -> None:
    program = (
        "import os, signal, sys\nfrom pathlib import Path\nimport numpy as np\n"
        "from fe_ste.tools.stores import Store\n"
        "os.fsync = lambda handle: os.kill(os.getpid(), signal.SIGKILL)\n"
        "Store(Path(sys.argv[1]), 'this input').write({'real': np.zeros(3)})\n"
    )
    assert subprocess.run([sys.executable, "-c", program, str(written.path)], check=False).returncode < 0
    arrays = written.read(dict)
    assert arrays is not None and np.array_equal(arrays["real"], VALUES["real"])


def test_what_is_discarded_is_gone_and_may_be_discarded_again(written: Store) -> None:
    written.discard()
    written.discard()
    assert written.read(dict) is None and not written.path.exists()


@pytest.fixture
def cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Cache[float]:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "kept"))
    return Cache[float]("number", in_memory=2, in_files=10_000)


def number(arrays: Arrays) -> float:
    return float(arrays["value"])


def test_a_value_is_taken_from_memory_or_from_its_file(cache: Cache[float]) -> None:
    assert cache.get("a", number) is None
    for key, value in (("a", 1.5), ("b", 2.5), ("c", 3.5)):
        cache.keep(key, value, {"value": np.array(value)})
    assert repr(cache) == "<Cache: 2 of number in memory>"
    assert [cache.get(key, number) for key in "abc"] == [1.5, 2.5, 3.5]
    cache.forget()
    assert [cache.get(key, number) for key in "cab"] == [3.5, 1.5, 2.5]


def test_a_file_under_the_name_of_another_key_is_not_used(cache: Cache[float], tmp_path: Path) -> None:
    cache.keep("a", 1.5, {"value": np.array(1.5)})
    (tmp_path / "kept" / "number-a.npz").rename(tmp_path / "kept" / "number-b.npz")
    assert cache.get("b", number) is None
