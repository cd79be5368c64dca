"""Files of a stranger: what a gearbox file names may neither run, nor hang the program, nor lie anywhere."""

from __future__ import annotations

import importlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import LARGEST_TABLE, Permissions
from exugear.gearbox.reading import GearboxFileError
from exugear.system.bodies.solid_elements import SolidError
from exugear.system.bodies.solid_files import mesh_geometry, read_solid

from ...optional_libraries import needs_gmsh, needs_meshio
from ..cases.command import exugear
from ..cases.spur import SPUR_CASE

posix = pytest.mark.skipif(sys.platform == "win32", reason="no such files")

PLATE = 'SetFactory("OpenCASCADE");\nBox(1) = {-25, -25, -12, 125, 50, 12};\n'
HOUSING = """
[bodies.box]
fixed = true
axis_position_mm = [0.0, 0.0]
flexibility = "elastic"
[bodies.box.solid]
file = "plate.geo"
element_size_mm = 25.0
[bodies.box.solid.seats]
bearing_1 = { diameter_mm = 72.0, inner_diameter_mm = 0.0 }
bearing_2 = { diameter_mm = 72.0, inner_diameter_mm = 0.0 }
foot = { diameter_mm = 72.0, inner_diameter_mm = 0.0 }

[mounts.foot]
body = "box"
position_mm = [50.0, 0.0, -12.0]
stiffness = { radial_N_per_m = 5e7, axial_N_per_m = 5e7, tilt_N_m_per_rad = 1e5, torsion_N_m_per_rad = 1e5 }

[elasticity]
band_Hz = 3000.0
limit_Hz = 12000.0
"""
TABLE = "time_s,shaft_1_N_m\n0.0,100.0\n1.0,100.0\n"
FLANK = "radius_mm, -6.0, 6.0\n29.0, 1.0, 1.0\n31.0, 2.0, 2.0\n"


def said(outcome: Any) -> str:
    return " ".join(outcome.stderr.split())


@pytest.fixture
def scripted(tmp_path: Path) -> tuple[Path, Path]:
    """Gearbox file whose housing is a script, and the file that shows that the script ran."""
    folder = tmp_path / "case"
    folder.mkdir()
    mark = folder / "ran"
    (folder / "plate.geo").write_text(f'SystemCall "touch {mark}";\n{PLATE}', encoding="utf-8")
    on_box = SPUR_CASE.replace('body = "shaft_1"\nz_mm', 'body = "shaft_1"\non = "box"\nz_mm')
    on_box = on_box.replace('body = "shaft_2"\nz_mm', 'body = "shaft_2"\non = "box"\nz_mm')
    case = folder / "spur.toml"
    case.write_text(on_box + HOUSING, encoding="utf-8")
    return case, mark


def modes(case: Path, *more: object, **environment: str) -> Any:
    out = case.parents[1] / "out"
    return exugear(
        "modes", case, "--variant", "flexible", "--mesh-model", "iso6336", "--out", out, *more, **environment
    )


@pytest.mark.parametrize("verb", ["modes", "run", "view"])
def test_a_script_is_refused_before_anything_is_written(scripted: tuple[Path, Path], verb: str) -> None:
    case, mark = scripted
    out = case.parents[1] / "out"
    choices = ("--variant", "flexible", "--mesh-model", "iso6336", "--out", out)
    outcome = exugear(verb, case, *choices, EXUGEAR_ALLOW_SCRIPTS="0")
    assert outcome.exit_code == 2
    assert "bodies.box.solid.file = 'plate.geo': a gmsh script can run any command" in said(outcome)
    for way in ("--allow-scripts", "EXUGEAR_ALLOW_SCRIPTS=1", "a STEP file"):
        assert way in said(outcome)
    assert not out.exists()
    assert not mark.exists()


def test_check_says_that_a_script_wants_permission_and_does_not_run_it(scripted: tuple[Path, Path]) -> None:
    case, mark = scripted
    outcome = exugear("check", case, EXUGEAR_ALLOW_SCRIPTS="1")
    assert outcome.exit_code == 0
    assert "bodies.box.solid.file = 'plate.geo': a gmsh script can run any command" in said(outcome)
    assert "--allow-scripts" in said(outcome)
    assert not mark.exists()


@pytest.mark.validation
@needs_gmsh
def test_a_permitted_script_runs_once_and_never_for_a_report(scripted: tuple[Path, Path], monkeypatch: Any) -> None:
    case, mark = scripted
    out = case.parents[1] / "out"
    assert modes(case, "--allow-scripts").exit_code == 0
    assert mark.exists()
    mark.unlink()
    # Its reduction is kept, so neither modes nor a report has to run it again.
    assert modes(case).exit_code == 0
    outcome = exugear("report", out, EXUGEAR_ALLOW_SCRIPTS="1")
    assert outcome.exit_code == 0, outcome.stderr
    assert "Left out: flexible" not in outcome.stderr
    assert not mark.exists()
    for file in (out / "bodies").iterdir():
        file.unlink()
    # The process remembers reductions: a report by a stranger's folder begins in a new one.
    command = [sys.executable, "-c", "from exugear.cli.app import main; main()", "report", str(out)]
    environment = {**os.environ, "EXUGEAR_ALLOW_SCRIPTS": "1"}
    found = subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment)
    assert found.returncode == 2, found.stderr
    assert "modes.nc: " in found.stderr
    assert "a gmsh script can run any command" in found.stderr
    assert not mark.exists()
    assert modes(case, EXUGEAR_ALLOW_SCRIPTS="1").exit_code == 0


@needs_gmsh
@posix
@pytest.mark.parametrize("kind", ["step", "stp", "brep"])
def test_shapes_run_nothing_whatever_is_in_them_or_beside_them(tmp_path: Path, kind: str) -> None:
    gmsh: Any = importlib.import_module("gmsh")
    mark = tmp_path / "ran"
    call = f'SystemCall "touch {mark}";\n'
    hidden = tmp_path / f"hidden.{kind}"
    hidden.write_text(call + PLATE, encoding="utf-8")
    with pytest.raises(SolidError, match=rf"hidden\.{kind}: "):
        mesh_geometry(hidden, 0.025)
    plate = tmp_path / f"plate.{kind}"
    gmsh.initialize(["test", "-nopopup"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(-25, -25, -12, 125, 50, 12)
        gmsh.model.occ.synchronize()
        gmsh.write(str(plate.with_suffix(".step" if kind == "stp" else plate.suffix)))
    finally:
        gmsh.finalize()
    if kind == "stp":
        plate.with_suffix(".step").rename(plate)
    # gmsh runs such a file of options beside a shape that it opens.
    (tmp_path / f"plate.{kind}.opt").write_text(call, encoding="utf-8")
    mesh = mesh_geometry(plate, 0.025)
    assert np.ptp(np.asarray(mesh.p), axis=1) == pytest.approx([0.125, 0.05, 0.012])
    assert not mark.exists()


@needs_gmsh
@posix
def test_python_permits_scripts_by_a_parameter(tmp_path: Path) -> None:
    mark, plate = tmp_path / "ran", tmp_path / "plate.GEO"
    plate.write_text(f'SystemCall "touch {mark}";\n{PLATE}', encoding="utf-8")
    with pytest.raises(SolidError, match="a gmsh script can run any command"):
        mesh_geometry(plate, 0.025)
    assert not mark.exists()
    mesh_geometry(plate, 0.025, scripts=True)
    assert mark.exists()
    with pytest.raises(SolidError, match=": unknown geometry format; its name must end in .geo, .step"):
        mesh_geometry(plate.rename(tmp_path / "plate.txt"), 0.025)


@needs_meshio
def test_meshes_are_read_in_formats_that_refer_to_no_other_file(tmp_path: Path) -> None:
    part = tmp_path / "part.inp"
    part.write_text("*NODE\n1, 0.0, 0.0, 0.0\n", encoding="utf-8")
    whole = tmp_path / "whole.inp"
    for keyword in ("*INCLUDE, INPUT=part.inp", "*Include,input=part.inp", "  *INCLUDE , INPUT=part.inp"):
        whole.write_text(f"** all of it\n{keyword}\n", encoding="utf-8")
        with pytest.raises(SolidError, match=r"whole\.inp: refers to another file by \*INCLUDE"):
            read_solid(whole)
    for name in ("plate.xdmf", "plate.med", "plate.fem", "plate", "plate.msh.h5"):
        (tmp_path / name).write_text("", encoding="utf-8")
        with pytest.raises(SolidError, match=r"its name must end in \.msh, \.inp, \.bdf, \.nas, \.vtu"):
            read_solid(tmp_path / name)


@needs_meshio
def test_a_mesh_that_swells_while_it_is_read_is_refused(tmp_path: Path) -> None:
    # Ten entities of ten of the last each: some 10 GB, if the parser followed them.
    levels = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 10))
    bomb = tmp_path / "bomb.vtu"
    bomb.write_text(
        f'<?xml version="1.0"?><!DOCTYPE VTKFile [<!ENTITY e0 "0123456789">{levels}]><VTKFile>&e9;</VTKFile>',
        encoding="utf-8",
    )
    with pytest.raises(SolidError, match=r"bomb\.vtu: meshio cannot read it"):
        read_solid(bomb)


@pytest.mark.parametrize("suffix", [".msh", ".inp", ".bdf", ".vtu", ".vtk"])
@needs_meshio
def test_a_mesh_of_anything_is_refused_in_one_sentence(tmp_path: Path, suffix: str, capfd: Any) -> None:
    random = np.random.default_rng(3)
    head = {
        ".msh": b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 900000000000 1 1\n",
        ".vtk": b"# vtk DataFile Version 4.2\n\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 9000000000000 double\n",
        ".bdf": b"BEGIN BULK\nGRID,1,,0.,zero\nCTETRA,1,1,1,1,1,1\nGRID",
        ".inp": b"*NODE\n1, 0, zero\n*ELEMENT, TYPE=C3D4\n1, 2, 3\n",
    }.get(suffix, b"")
    for content in (b"", head, head + random.bytes(300), random.bytes(300)):
        file = tmp_path / f"any{suffix}"
        file.write_bytes(content)
        with pytest.raises(SolidError, match=rf"any\{suffix}: "):
            read_solid(file)
    assert capfd.readouterr().out == ""


def with_files(folder: Path, **files: str) -> Path:
    """Gearbox file that names a measured flank or a torque series by a text each."""
    text = SPUR_CASE
    if "flank" in files:
        named = f"modification = {{ topography = {json.dumps(files['flank'])} }}"
        text = text.replace("pinion = { teeth", f"pinion = {{ {named}, teeth")
    if "series" in files:
        text = text.replace("duration_s = 1.0", f"duration_s = 1.0, torque_series = {json.dumps(files['series'])}")
    case = folder / "spur.toml"
    case.write_text(text, encoding="utf-8")
    return case


FLANK_KEY, SERIES_KEY = "gears.pinion.modification.topography", "load_cases.run_up.torque_series"


@pytest.mark.sample
@posix
@pytest.mark.parametrize(("kind", "key"), [("flank", FLANK_KEY), ("series", SERIES_KEY)])
def test_files_that_are_named_lie_below_the_gearbox_file_unless_permitted(tmp_path: Path, kind: str, key: str) -> None:
    inside, outside = tmp_path / "case", tmp_path / "measured"
    (inside / "deep").mkdir(parents=True)
    outside.mkdir()
    for file in (inside / "own.csv", inside / "deep" / "own.csv", outside / "other.csv"):
        file.write_text(FLANK if kind == "flank" else TABLE, encoding="utf-8")
    (inside / "link.csv").symlink_to(outside / "other.csv")
    (inside / "round.csv").symlink_to(inside / "round.csv")
    for name in ("own.csv", "deep/own.csv", "../case/own.csv", str(inside / "own.csv")):
        outcome = exugear("check", with_files(inside, **{kind: name}))
        assert outcome.exit_code == 0, outcome.stderr
    for name in ("../measured/other.csv", str(outside / "other.csv"), "link.csv", "deep/../../measured/other.csv"):
        case = with_files(inside, **{kind: name})
        outcome = exugear("check", case)
        assert outcome.exit_code == 2
        assert f"{key} = '{name}': is outside the folder of the gearbox file" in said(outcome)
        assert "--allow-dir DIR or EXUGEAR_ALLOW_DIR" in said(outcome)
        assert exugear("check", case, "--allow-dir", outside).exit_code == 0
        assert exugear("check", case, EXUGEAR_ALLOW_DIR=str(tmp_path)).exit_code == 0
        assert exugear("check", case, "--allow-dir", inside).exit_code == 2
        assert Gearbox.from_toml(case, Permissions(below=outside)).varied({"housing.factor": 0.4})
    for name in ("round.csv", "none.csv", "a\0b.csv", 200 * "long", 300 * "long"):
        outcome = exugear("check", with_files(inside, **{kind: name}))
        assert outcome.exit_code == 2
        assert len(outcome.stderr.splitlines()) == 1
        assert re.search("no such file|File name too long|control characters|at most 1000", said(outcome))
    outcome = exugear("check", case, "--allow-dir", tmp_path / "nowhere")
    assert outcome.exit_code == 2
    assert "nowhere: no such folder" in said(outcome)


@posix
def test_a_report_follows_the_same_rule(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    inside, outside, out = (Path(name) for name in ("case", "measured", "out"))
    inside.mkdir()
    outside.mkdir()
    (outside / "torque.csv").write_text(TABLE, encoding="utf-8")
    case = with_files(inside, series="../measured/torque.csv")
    permitted = ("--variant", "rigid", "--mesh-model", "iso6336", "--out", out, "--allow-dir", outside)
    assert exugear("modes", case, *permitted).exit_code == 0
    outcome = exugear("report", out)
    assert outcome.exit_code == 2
    assert f"{SERIES_KEY} = '../measured/torque.csv': is outside" in said(outcome)
    assert not (out / "report.html").exists()


@posix
@pytest.mark.parametrize(("kind", "key"), [("flank", FLANK_KEY), ("series", SERIES_KEY)])
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path, kind: str, key: str) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "folder.csv").mkdir()
    with (tmp_path / "large.csv").open("wb") as file:
        file.truncate(LARGEST_TABLE + 1)
    # In a process of its own: reading a pipe that nobody writes into never ends.
    case = with_files(tmp_path, **{kind: "pipe.csv"})
    code = "import sys; from exugear.gearbox.gearbox import Gearbox; Gearbox.from_toml(sys.argv[1])"
    found = subprocess.run([sys.executable, "-c", code, case], capture_output=True, text=True, timeout=60)
    assert f"GearboxFileError: {case}: {key} = 'pipe.csv': a pipe or device" in found.stderr
    for name, reason in (("folder.csv", "a folder"), ("large.csv", "100 MB; at most 100 MB")):
        outcome = exugear("check", with_files(tmp_path, **{kind: name}))
        assert outcome.exit_code == 2
        assert f"{key} = '{name}': {reason}" in said(outcome)
    with pytest.raises(GearboxFileError, match="a pipe or device"):
        Gearbox.from_toml(with_files(tmp_path, **{kind: "/dev/zero"}), Permissions(below=Path("/dev")))


@posix
def test_the_gearbox_file_itself_is_a_regular_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate(10_000_001)
    for path, reason in (
        (tmp_path / "pipe.toml", "a pipe or device"),
        (Path("/dev/zero"), "a pipe or device"),
        (tmp_path, "a folder"),
        (tmp_path / "large.toml", "at most 10 MB"),
    ):
        outcome = exugear("check", path)
        assert outcome.exit_code == 2
        assert f"{path}: " in said(outcome)
        assert reason in said(outcome)


def test_names_are_short_enough_for_files(tmp_path: Path) -> None:
    case = tmp_path / "spur.toml"
    case.write_text(SPUR_CASE.replace("run_up =", f"{81 * 'n'} ="), encoding="utf-8")
    outcome = exugear("check", case)
    assert outcome.exit_code == 2
    assert (
        "a name consists of letters, digits and underscores, begins with a letter, and has at most 80 characters"
        in said(outcome)
    )
