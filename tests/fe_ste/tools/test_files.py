"""Files are written whole or not at all, never through a link, and damaged ones are never used."""

from __future__ import annotations

import io
import os
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray as xr

from fe_ste.tools.files import (
    ErrorKeeper,
    FileError,
    Layout,
    append_line,
    exclusive,
    load_dataset,
    open_sealed,
    read_sealed,
    read_text,
    replacement,
    seal,
    write_dataset,
    write_file,
    write_sealed,
)

from ..damage import damages

DATA = xr.Dataset(
    {"a": (("x", "y"), np.random.default_rng(1).random((50, 40)), {"units": "m"})},
    {"y": np.array([f"name {n}" for n in range(40)], dtype=object)},
    {"method_version": 3, "title": "numbers"},
)
LAYOUT = Layout("numbers", 3, {"a": ("x", "y")}, ("title",))


@pytest.fixture
def umask() -> Iterator[Callable[[int], int]]:
    before = os.umask(0o022)
    yield os.umask
    os.umask(before)


@pytest.mark.parametrize(("mask", "mode"), [(0o077, 0o600), (0o002, 0o664), (0o022, 0o644)])
def test_the_umask_decides_on_the_mode(umask: Callable[[int], int], tmp_path: Path, mask: int, mode: int) -> None:
    umask(mask)
    write_dataset(tmp_path / "a.nc", DATA)
    append_line(tmp_path / "lines", "one")
    assert [stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()] == [mode, mode]


def test_a_link_is_replaced_and_never_written_through(tmp_path: Path) -> None:
    private = tmp_path / "private"
    private.write_text("mine", encoding="utf-8")
    link = tmp_path / "picture.png"
    link.symlink_to(private)
    write_file(link, b"new")
    assert not link.is_symlink()
    assert link.read_bytes() == b"new"
    lines = tmp_path / "times.jsonl"
    lines.symlink_to(private)
    with pytest.raises(OSError, match=r"times\.jsonl"):
        append_line(lines, "more")
    assert private.read_text(encoding="utf-8") == "mine"


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
    assert read_sealed(tmp_path / "a.npz") == content.getvalue()


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
    with pytest.raises(FileError, match=r"a\.nc: holds no numbers: a over \(x, y\) is missing"):
        load_dataset(path, LAYOUT)
    write_dataset(path, DATA.drop_attrs())
    with pytest.raises(FileError, match=r"a\.nc: holds no numbers: its attribute title is missing"):
        load_dataset(path, LAYOUT)
    write_dataset(path, DATA.assign_attrs(method_version=2))
    with pytest.raises(FileError, match=r"computed by version 2 of its method, now at 3; compute it again"):
        load_dataset(path, LAYOUT)
    write_sealed(path, b"no netCDF")
    with pytest.raises(FileError, match=r"a\.nc: is no netCDF file"):
        load_dataset(path, LAYOUT)
    DATA.to_netcdf(path, engine="h5netcdf")  # as earlier versions wrote it
    with pytest.raises(FileError, match=r"written by an earlier version"):
        load_dataset(path, LAYOUT)


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir])
def test_what_is_no_file_is_refused_without_waiting(tmp_path: Path, make: Callable[[Path], None]) -> None:
    make(tmp_path / "it")
    for read in (read_sealed, read_text):
        with pytest.raises(FileError, match="is no regular file"):
            read(tmp_path / "it")
    with pytest.raises(FileError, match="no such file"):
        read_text(tmp_path / "nothing")


def test_a_text_has_a_largest_size(tmp_path: Path) -> None:
    write_file(tmp_path / "text", b"12345")
    assert read_text(tmp_path / "text", 5) == "12345"
    with pytest.raises(FileError, match=r"text: is larger than"):
        read_text(tmp_path / "text", 4)


def test_a_line_cut_short_stays_alone(tmp_path: Path) -> None:
    (tmp_path / "lines").write_text("one\ntw", encoding="utf-8")
    append_line(tmp_path / "lines", "three")
    append_line(tmp_path / "lines", "four")
    assert read_text(tmp_path / "lines") == "one\ntw\nthree\nfour\n"


def test_an_error_of_any_kind_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_file(path, b"old")
    with pytest.raises(KeyboardInterrupt), replacement(path) as file:
        file.write(b"half of the n")
        raise KeyboardInterrupt
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_a_kill_left_is_removed_when_it_is_old(tmp_path: Path) -> None:
    old, young = tmp_path / ".a.0123.partial", tmp_path / ".a.4567.partial"
    for path in (old, young):
        path.write_bytes(b"half")
    os.utime(old, (time.time() - 7200.0,) * 2)
    write_file(tmp_path / "a", b"whole")
    assert sorted(tmp_path.iterdir()) == [young, tmp_path / "a"]


FULL = """
import resource, sys
from pathlib import Path
import numpy as np
import xarray as xr
from fe_ste.tools.files import append_line, write_dataset, write_file
from fe_ste.tools.drawing import finish_figure, new_figure

folder = Path(sys.argv[1])
data = xr.Dataset({"a": ("x", np.random.default_rng(1).random(20000))})
figure = new_figure(4.0, 3.0)
figure.subplots().plot([1, 2], [2, 1])
finish_figure(figure, folder / "first.png")
writers = {
    "a.nc": lambda path: write_dataset(path, data),
    "a.png": lambda path: finish_figure(figure, path),
    "a.html": lambda path: write_file(path, b"x" * 10000),
    "a.jsonl": lambda path: append_line(path, "x" * 10000),
}
# A file may not grow beyond this: as on a full disk, some of it can be written and the rest cannot.
resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
for name, write in writers.items():
    try:
        write(folder / name)
    except OSError as error:
        print(name, error.filename == str(folder / name), error.strerror)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of the operating system")
def test_a_full_disk_is_an_error_with_the_name_and_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.nc").write_bytes(b"old")
    ended = subprocess.run(
        [sys.executable, "-c", FULL, str(tmp_path)], capture_output=True, text=True, check=False, timeout=120
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.splitlines() == [f"a.{kind} True File too large" for kind in ("nc", "png", "html", "jsonl")]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.jsonl", "a.nc", "first.png"]
    assert (tmp_path / "a.nc").read_bytes() == b"old"


FAILING = """
import errno, io, sys
import h5netcdf
import numpy as np
from fe_ste.tools.files import ErrorKeeper


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


HOLDING = """
import sys, time
from pathlib import Path
from fe_ste.tools.files import exclusive

with exclusive(Path(sys.argv[1]), "the run"):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_lock_keeps_others_out_and_ends_with_a_killed_process(tmp_path: Path) -> None:
    path = tmp_path / "run.partial.lock"
    with subprocess.Popen([sys.executable, "-c", HOLDING, str(path)], stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(FileError, match="the run: another process is at work on it"), exclusive(path, "the run"):
            pass
        holder.kill()
    assert path.exists()
    with exclusive(path, "the run"):
        assert path.exists()
    assert not path.exists()


WRITING = """
import sys
from pathlib import Path
import numpy as np
import xarray as xr
from fe_ste.tools.files import write_dataset

attributes = {"title": "", "method_version": 3}
for n in range(12):
    data = xr.Dataset({"a": (("x", "y"), np.full((50, 40), float(sys.argv[2])))}, attrs=attributes)
    write_dataset(Path(sys.argv[1]), data)
"""


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
