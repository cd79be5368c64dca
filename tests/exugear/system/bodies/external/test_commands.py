"""Matrices on the command line."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.cli.tasks.export import write_together
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices

from .....optional_libraries import needs_meshio
from ....cases.box import box_content
from .shared import FOOT, box_of, write

pytestmark = needs_meshio


def exugear(*arguments: object) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def toml(content: Mapping[str, Any]) -> str:
    from ....cases.case_mutations import toml_text

    return toml_text(dict(content))


def test_export_writes_what_the_gearbox_file_reads(tmp_path: Path) -> None:
    case = tmp_path / "case.toml"
    content = box_content(tmp_path)
    case.write_text(toml(content), encoding="utf-8")
    wanted = ("--matrices", "box", "--format", "dmig", "--units", "mm-t-s", "--to", tmp_path)
    out = exugear("export", case, *wanted, "--out", tmp_path / "results", "--json")
    assert out.exit_code == 0, out.stderr
    said = json.loads(out.stdout)
    assert said["mass_kg"] == pytest.approx(0.58875)
    assert [(seat["node"], seat["seat"]) for seat in said["seats"]] == [(1, "bearing_1"), (2, "bearing_2"), (3, "foot")]
    assert said["files"] == [str(tmp_path / "box.pch"), str(tmp_path / "box-surface.npz")]
    assert said["keys"]["recovery"] == "box-surface.npz"
    del content["bodies"]["box"]["solid"]
    content["bodies"]["box"]["external"] = {**said["keys"], "units": said["units"], "seats": FOOT}
    case.write_text(toml(content), encoding="utf-8")
    check = exugear("check", case, "--json")
    assert check.exit_code == 0, check.stderr
    summary = json.loads(check.stdout)
    assert summary["variants"]["flexible"] == ""
    assert "bodies.box.external: 3 nodes" in summary["matrices"][0]
    assert "0.58875 kg, centre of mass at (37.5, " in summary["matrices"][0]
    again = exugear("export", case, "--matrices", "box", "--format", "dmig", "--to", tmp_path)
    assert again.exit_code == 2
    assert "box.pch: exists already; specify another folder with --to" in again.stderr.replace("\n", " ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--matrices", "lid"), "--matrices lid: no such flexible body; flexible bodies are box"),
        (("--matrices", "box", "file.rexs"), "--matrices box: omit file.rexs"),
        ((), "nothing to export; name a REXS file, a body with --matrices BODY, --loads FILE.nc or --surface FILE.nc"),
    ],
)
def test_an_export_that_cannot_be_is_refused_and_writes_nothing(
    tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    case = tmp_path / "case.toml"
    case.write_text(toml(box_content(tmp_path)), encoding="utf-8")
    before = sorted(tmp_path.rglob("*"))
    out = exugear("export", case, *arguments, "--out", tmp_path / "results")
    assert out.exit_code == 2
    assert message in " ".join(out.stderr.split())
    assert sorted(tmp_path.rglob("*")) == before


def test_damaged_matrices_are_bad_input_of_every_command(tmp_path: Path, box: InterfaceMatrices) -> None:
    keys = write(tmp_path, box, "op4")
    file = tmp_path / "box.op4"
    file.write_bytes(file.read_bytes()[:2000])
    gearbox = box_of(tmp_path, keys)
    case = tmp_path / "case.toml"
    case.write_text(toml(gearbox.content), encoding="utf-8")
    for verb in (
        ("check",),
        ("modes", "--variant", "flexible", "--mesh-model", "iso6336", "--out", tmp_path / "results"),
    ):
        out = exugear(verb[0], case, *verb[1:])
        assert out.exit_code == 2, out.stdout
        assert "bodies.box.external" in out.stderr
        assert "it is truncated" in " ".join(out.stderr.split())
    assert not (tmp_path / "results").exists()


def test_an_export_that_fails_at_its_second_file_leaves_none_behind(tmp_path: Path) -> None:
    """A folder has the name of the second file, as any other reason for which it cannot be written."""
    (tmp_path / "second.csv").mkdir()
    with pytest.raises(OSError, match="second"):
        write_together(tmp_path, {"first.csv": b"1", "second.csv": b"2"})
    assert [path.name for path in tmp_path.iterdir()] == ["second.csv"]
