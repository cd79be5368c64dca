"""Files are written whole or not at all, and never through a link."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fe_ste.tools.files import FileError, append_line, exclusive, read_text, replacement, write_file
from fe_ste.tools.stores import load_arrays, write_dataset

DATA = xr.Dataset(
    {"a": (("x", "y"), np.random.default_rng(1).random((50, 40)), {"units": "m"})},
    {"y": np.array([f"name {n}" for n in range(40)], dtype=object)},
    {"method_version": 3, "title": "numbers"},
)


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


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir])
def test_what_is_no_file_is_refused_without_waiting(tmp_path: Path, make: Callable[[Path], None]) -> None:
    make(tmp_path / "it")
    for read in (load_arrays, read_text):
        with pytest.raises(FileError, match=": is not a regular file"):
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
from fe_ste.tools.files import append_line, write_file
from fe_ste.tools.drawing import finish_figure, new_figure
from fe_ste.tools.stores import write_dataset

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


@pytest.mark.validation
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
        with (
            pytest.raises(FileError, match="the run: in use by another process; wait until it ends, or stop it"),
            exclusive(path, "the run"),
        ):
            pass
        holder.kill()
    assert path.exists()
    with exclusive(path, "the run"):
        assert path.exists()
    assert not path.exists()
