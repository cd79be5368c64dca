"""Flanks that are computed once: the other flank of the same gear, and the files in which flanks are kept."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fe_ste.elasticity.flank
from fe_ste.elasticity.flank import FlankCompliance, flank_compliance, forget_flanks, known_flanks
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear
from fe_ste.tools.stores import FOLDER_VARIABLE

from ..cases.gears import HELICAL_12, RING_60

COARSE = MeshSettings(layers=3, flank=6, thickness=4, fillet=1, root=1, rim=3)


def assert_same(one: FlankCompliance, other: FlankCompliance, tolerance: float) -> None:
    assert (one.side, one.closed, one.figures) == (other.side, other.closed, other.figures)
    assert np.abs(one.images - other.images).max() == 0.0
    assert np.abs(one.roll - other.roll).max() == 0.0
    assert np.abs(one.axial - other.axial).max() < 1e-15
    assert one.regular.keys() == other.regular.keys()
    scale = np.abs(other.regular[0, 0]).max()
    for key, block in other.regular.items():
        assert np.abs(one.regular[key] - block).max() <= tolerance * scale
    assert np.abs(one.hub_torque - other.hub_torque).max() <= tolerance * np.abs(other.hub_torque).max()


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Folder of the files; memory is empty before and after."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "flanks"))
    forget_flanks()
    yield tmp_path / "flanks"
    forget_flanks()


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the gears that are computed."""
    computed = []

    def counted(gear: Gear, *rest: Any, **options: Any) -> FlankCompliance:
        computed.append(gear.name)
        return flank_compliance(gear, *rest, **options)

    monkeypatch.setattr(fe_ste.elasticity.flank, "flank_compliance", counted)
    return computed


@pytest.mark.sample
@pytest.mark.parametrize("open_teeth", [None, 5])
@pytest.mark.parametrize("gear", [HELICAL_12, RING_60], ids=lambda gear: gear.name)
def test_the_other_flank_is_the_same_one_turned(gear: Gear, open_teeth: int | None) -> None:
    """By 180 degrees about the middle of the tooth; against the finite elements loaded there."""
    one, other = (flank_compliance(gear, side, COARSE, open_teeth=open_teeth) for side in (1, -1))
    # 1e-10: rounding of thousands of equations.
    assert_same(one.turned(), other, 1e-10)
    assert_same(one.turned().turned(), one, 0.0)


def test_a_kept_flank_is_the_computed_one(kept: Path, calls: list[str]) -> None:
    wanted = [(HELICAL_12, 1), (dataclasses.replace(HELICAL_12, name="same gear"), -1)]
    first = known_flanks(wanted, COARSE)
    assert calls == ["helical"]
    assert len(list(kept.iterdir())) == 1
    forget_flanks()
    again = known_flanks(wanted, COARSE)
    assert calls == ["helical"]
    for one, other in zip(again, first, strict=True):
        assert_same(one, other, 0.0)
    assert [flank.gear.name for flank in again] == ["helical", "same gear"]


@pytest.mark.sample
@pytest.mark.parametrize(
    "other",
    [
        {"gear": dataclasses.replace(HELICAL_12, face_width=15.1e-3)},
        {"settings": dataclasses.replace(COARSE, rim=4)},
        {"open_teeth": 3},
        {"incompatible_modes": False},
    ],
    ids=lambda other: next(iter(other)),
)
def test_another_input_is_computed(kept: Path, calls: list[str], other: dict[str, Any]) -> None:
    known_flanks([(HELICAL_12, 1)], COARSE)
    options = {"gear": HELICAL_12, "settings": COARSE} | other
    known_flanks([(options.pop("gear"), 1)], options.pop("settings"), **options)
    assert len(calls) == len(list(kept.iterdir())) == 2


def test_another_method_does_not_use_the_files(kept: Path, calls: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    known_flanks([(HELICAL_12, 1)], COARSE)
    forget_flanks()
    monkeypatch.setattr(fe_ste.elasticity.flank, "_method", lambda: "changed sources")
    known_flanks([(HELICAL_12, 1)], COARSE)
    assert len(calls) == 2


@pytest.mark.sample
@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "other file"])
def test_a_damaged_file_is_computed_again(kept: Path, calls: list[str], damage: str) -> None:
    (first,) = known_flanks([(HELICAL_12, 1)], COARSE)
    (path,) = kept.iterdir()
    content = bytearray(path.read_bytes())
    if damage == "flipped":
        content[len(content) // 2] ^= 1
    kept_part = {"cut": content[:-100], "flipped": content, "empty": b"", "other file": b"text"}
    path.write_bytes(kept_part[damage])
    forget_flanks()
    (again,) = known_flanks([(HELICAL_12, 1)], COARSE)
    assert len(calls) == 2
    assert_same(again, first, 0.0)
    forget_flanks()
    known_flanks([(HELICAL_12, 1)], COARSE)
    assert len(calls) == 2  # the damaged file was replaced


def test_nothing_is_kept_when_switched_off(
    kept: Path, calls: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, "off")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    for _ in range(2):
        forget_flanks()
        known_flanks([(HELICAL_12, 1)], COARSE)
    assert len(calls) == 2
    assert list(tmp_path.rglob("flank-*")) == []


@pytest.mark.skipif(sys.platform != "linux", reason="each system has its own cache folder")
def test_flanks_are_kept_in_the_users_cache_folder(kept: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv(FOLDER_VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    known_flanks([(HELICAL_12, 1)], COARSE)
    assert len(list((tmp_path / "user" / "exugear" / "flanks").glob("flank-*.npz"))) == 1


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(
    kept: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "file"))
    (flank,) = known_flanks([(HELICAL_12, 1)], COARSE)
    assert flank.gear == HELICAL_12
    assert "each flank cannot be stored" in caplog.text


def test_files_used_least_lately_are_removed(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gears = [dataclasses.replace(HELICAL_12, face_width=width * 1e-3) for width in (14, 15, 16)]
    paths: list[Path] = []
    for gear in gears[:2]:
        known_flanks([(gear, 1)], COARSE)
        paths += set(kept.iterdir()) - set(paths)
    for age, path in zip((200, 100), paths, strict=True):
        os.utime(path, (path.stat().st_atime, path.stat().st_mtime - age))
    forget_flanks()
    known_flanks([(gears[0], 1)], COARSE)  # used again
    monkeypatch.setattr(fe_ste.elasticity.flank._flanks, "in_files", int(2.5 * paths[0].stat().st_size))
    known_flanks([(gears[2], 1)], COARSE)
    left = set(kept.iterdir())
    assert len(left) == 2
    assert paths[0] in left
    assert paths[1] not in left


@pytest.mark.validation
def test_two_processes_may_write_one_file(kept: Path, calls: list[str]) -> None:
    """Both compute the same gear at once; whoever ends last leaves a whole file."""
    program = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parents[3])!r})\n"
        "from tests.fe_ste.elasticity.test_known_flanks import COARSE, HELICAL_12, known_flanks\n"
        "for _ in range(3):\n    known_flanks([(HELICAL_12, 1)], COARSE)\n"
    )
    processes = [subprocess.Popen([sys.executable, "-c", program]) for _ in range(2)]
    assert [process.wait(timeout=120) for process in processes] == [0, 0]
    assert len(list(kept.iterdir())) == 1
    known_flanks([(HELICAL_12, 1)], COARSE)
    assert calls == []
