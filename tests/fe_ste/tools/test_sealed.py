"""A file whose content does not fit its checksum is never used, and a sealed one is plain for other programs."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray as xr

from fe_ste.tools import stores
from fe_ste.tools.files import FileError, replacement
from fe_ste.tools.stores import (
    ErrorKeeper,
    Layout,
    load_dataset,
    open_sealed,
    seal,
    write_dataset,
    write_sealed,
)

from ..damage import damages

DATA = xr.Dataset(
    {"a": (("x", "y"), np.random.default_rng(1).random((50, 40)), {"units": "m"})},
    {"y": np.array([f"name {n}" for n in range(40)], dtype=object)},
    {"method_version": 3, "title": "numbers"},
)
LAYOUT = Layout("numbers", 3, {"a": ("x", "y")}, ("title",))


def checked(path: Path) -> str:
    """Checksum that the content of a file was found to fit."""
    with open_sealed(path) as (_, checksum):
        return checksum


def test_a_sealed_file_is_plain_netcdf_for_others(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    write_dataset(path, DATA)
    assert load_dataset(path, LAYOUT).identical(DATA)
    with xr.open_dataset(path, engine="h5netcdf") as plain:
        assert plain.identical(DATA)
    with h5py.File(path, "r") as plain:
        assert np.array_equal(plain["a"], DATA["a"])
    np.savez(content := io.BytesIO(), a=DATA["a"].to_numpy())
    write_sealed(tmp_path / "a.npz", content.getbuffer())
    with np.load(tmp_path / "a.npz") as arrays:
        assert np.array_equal(arrays["a"], DATA["a"])
    assert (tmp_path / "a.npz").read_bytes().startswith(content.getvalue())


def test_no_damage_is_ever_read(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    write_dataset(path, DATA)
    tried = 0
    for damaged in damages(path.read_bytes(), 280):
        path.write_bytes(damaged)
        with pytest.raises(FileError, match=r"a\.nc: (has no checksum at its end|is damaged)"):
            load_dataset(path, LAYOUT)
        tried += 1
    assert tried > 250


def test_other_kinds_and_versions_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    write_dataset(path, DATA.rename(a="b"))
    with pytest.raises(FileError, match="a.nc: is not a file of numbers: a over"):
        load_dataset(path, LAYOUT)
    write_dataset(path, DATA.drop_attrs())
    with pytest.raises(FileError, match="a.nc: is not a file of numbers: its attribute title is missing"):
        load_dataset(path, LAYOUT)
    write_dataset(path, DATA.assign_attrs(method_version=2))
    with pytest.raises(FileError, match=": was computed by version 2 of its method, now at 3; recompute it"):
        load_dataset(path, LAYOUT)
    write_sealed(path, b"no netCDF")
    with pytest.raises(FileError, match="a.nc: is not a netCDF file"):
        load_dataset(path, LAYOUT)
    DATA.to_netcdf(path, engine="h5netcdf")  # as earlier versions wrote it
    with pytest.raises(FileError, match=r"written by an earlier version"):
        load_dataset(path, LAYOUT)


FAILING = """
import errno, io, sys
import h5netcdf
import numpy as np
from fe_ste.tools.stores import ErrorKeeper


class Full(io.BytesIO):
    left = 0

    def write(self, content):
        self.left -= 1
        if self.left < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return super().write(content)


for room in range(10**6):
    full = Full()
    full.left = room
    target = ErrorKeeper(full)
    with h5netcdf.File(target, "w") as file:
        file.dimensions = {"time": 5000, "m": 4}
        for n in range(5):
            file.create_variable(f"v{n}", ("time", "m"), "f4")[:] = np.random.rand(5000, 4)
    try:
        target.check()
    except OSError as error:
        assert error.errno == errno.ENOSPC
    else:
        break
print(room)
"""


def test_hdf5_survives_a_disk_that_is_full_at_any_write() -> None:
    """Told of the error it would crash in closing the file."""
    ended = subprocess.run([sys.executable, "-c", FAILING], capture_output=True, text=True, check=False, timeout=120)
    assert ended.returncode == 0, ended.stderr
    assert int(ended.stdout) > 10


def test_a_streamed_file_is_sealed_like_others(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    with replacement(path) as raw:
        target = ErrorKeeper(raw)
        with h5netcdf.File(target, "w") as file:
            file.dimensions = {"x": 3}
            file.create_variable("a", ("x",), "f8")[:] = [1.0, 2.0, 3.0]
        target.check()
        seal(raw)
    with open_sealed(path) as (content, checksum):
        assert len(checksum) == 64
        assert xr.load_dataset(content, engine="h5netcdf")["a"].values.tolist() == [1.0, 2.0, 3.0]


WRITING = """
import sys
from pathlib import Path
import numpy as np
import xarray as xr
from fe_ste.tools.stores import write_dataset

attributes = {"title": "", "method_version": 3}
for n in range(12):
    data = xr.Dataset({"a": (("x", "y"), np.full((50, 40), float(sys.argv[2])))}, attrs=attributes)
    write_dataset(Path(sys.argv[1]), data)
"""


@pytest.mark.validation
def test_two_writers_of_one_file_and_a_reader_see_whole_files_only(tmp_path: Path) -> None:
    path = tmp_path / "a.nc"
    write_dataset(path, DATA)
    writers = [subprocess.Popen([sys.executable, "-c", WRITING, str(path), number]) for number in ("1", "2")]
    read = set()
    while any(writer.poll() is None for writer in writers):
        read.add(float(load_dataset(path, LAYOUT)["a"].std()))
    assert [writer.returncode for writer in writers] == [0, 0]
    assert read <= {0.0, float(DATA["a"].std())}
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_is_read_once_to_check_it_until_it_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that was checked long after its last change is taken as it is; a change that restores its times is seen."""
    path = tmp_path / "a.bin"
    write_sealed(path, bytes(4000))
    monkeypatch.setattr("fe_ste.tools.stores.SETTLED", -1.0)  # as if it had been written long ago
    taken: list[int] = []
    original = stores.hashlib.sha256
    monkeypatch.setattr(stores.hashlib, "sha256", lambda *content: taken.append(1) or original(*content))
    assert checked(path) == checked(path)
    assert len(taken) == 1
    before = path.stat()
    with path.open("r+b") as file:
        file.write(b"1")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    with pytest.raises(FileError, match="is damaged"):
        checked(path)


def test_a_file_of_this_moment_is_checked_each_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Clocks of files are coarse: two changes within a tick look like one."""
    path = tmp_path / "a.bin"
    write_sealed(path, bytes(4000))
    taken: list[int] = []
    original = stores.hashlib.sha256
    monkeypatch.setattr(stores.hashlib, "sha256", lambda *content: taken.append(1) or original(*content))
    monkeypatch.setattr("fe_ste.tools.stores.SETTLED", 3600.0)
    assert checked(path) == checked(path)
    assert len(taken) == 2
