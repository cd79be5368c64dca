"""Tables over axes: named by the file, kept where they serve, and read at the static state."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.report.writer import write_report
from exugear.system.tooth_mesh.element import MeshCurve
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.tables import missing_tables, requested_tables, wanted_table

from ...cases.command import exugear
from ...cases.spur import COARSE_INPUT, SPUR_CASE

AXES = """ste = { positions = 8, torque_factors = [0.2, 1.0], centre_distance_offsets_um = [0.0, 50.0],
  misalignment_um = [0.0, 20.0] }"""
CASE = SPUR_CASE.replace("ste = { positions = 8 }", AXES.replace("\n", ""))


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A file with two values on each axis and its grid table."""
    folder = tmp_path_factory.mktemp("grid")
    case = folder / "spur.toml"
    case.write_text(CASE, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
        outcome = exugear("ste", case, "--grid", "--all", "--out", folder / "out")
    assert outcome.exit_code == 0, outcome.stderr
    assert "64/64" in outcome.stdout
    return case, folder / "out"


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)


@pytest.mark.validation
def test_axes_are_those_of_the_file_and_the_static_state_lies_on_them_exactly(computed: tuple[Path, Path]) -> None:
    case, out = computed
    gearbox = Gearbox.from_toml(case)
    data = xr.open_dataset(out / "tables" / "spur.nc")
    torque = gearbox.pairs["spur"].static_torque
    assert data["torque"].values == pytest.approx([0.2 * torque, torque], rel=1e-12)
    assert data["centre_distance"].values == pytest.approx([75e-3, 75.05e-3], rel=1e-12)
    assert data["centre_distance"].values[0] == gearbox.pairs["spur"].pair.centre_distance
    # 20 um over 15 mm of face.
    assert data["misalignment"].values == pytest.approx([0.0, 20e-6 / 15e-3], rel=1e-12)
    assert not list(out.rglob("*partial*"))


def test_a_grid_serves_where_only_the_static_state_is_needed(computed: tuple[Path, Path]) -> None:
    case, out = computed
    gearbox = Gearbox.from_toml(case)
    assert requested_tables(gearbox, out)[0].stored
    assert missing_tables(gearbox, out) == missing_tables(gearbox, out, grid=True) == []
    alone = requested_tables(gearbox, out.parent / "alone")[0].compute()
    # One solution of one problem, found from other starts.
    curve = mesh_stiffness(gearbox, "line_of_action", out)["spur"]
    assert isinstance(curve, MeshCurve)
    stiffness, tangent = (alone.static_state[name].to_numpy() for name in ("mesh_stiffness", "tangent_stiffness"))
    assert curve.stiffness == pytest.approx(stiffness, rel=1e-9)
    assert curve.tangent == pytest.approx(tangent, rel=1e-6)
    assert curve.force == pytest.approx(float(alone.static_state["line_of_action_force"][0]), rel=1e-12)


def test_one_state_does_not_serve_where_a_grid_is_needed_nor_a_grid_with_other_axes(
    computed: tuple[Path, Path], tmp_path: Path
) -> None:
    case, out = computed
    other = tmp_path / "other.toml"
    other.write_text(case.read_text(encoding="utf-8").replace("[0.2, 1.0]", "[0.3, 1.0]"), encoding="utf-8")
    gearbox = Gearbox.from_toml(other)
    assert missing_tables(gearbox, out) == []
    assert [request.name for request in missing_tables(gearbox, out, grid=True)] == ["spur"]
    requested_tables(gearbox, tmp_path)[0].compute()
    assert missing_tables(gearbox, tmp_path) == []
    assert missing_tables(gearbox, tmp_path, grid=True)[0].wanted == wanted_table(gearbox, "spur", 8, grid=True)


@pytest.mark.validation
def test_law_table_runs_from_the_command_line_on_its_grid(computed: tuple[Path, Path], tmp_path: Path) -> None:
    case, out = computed
    arguments = ["--mesh-model", "table", "--variant", "bushing", "--json", "--out", str(out)]
    outcome = exugear("run", case, "--duration", "0.05", *arguments)
    assert outcome.exit_code == 0, outcome.stderr
    summary = json.loads(outcome.stdout)
    assert summary["mesh_model"] == "table"
    data = xr.open_dataset(summary["file"])
    assert {"misalignment", "centre_distance_change"} <= set(data)
    # A grid of one load beside the static one ends there, and the gears tilt both ways.
    assert summary["longest_time_outside_table_s"] > 0.0
    outcome = exugear("modes", case, *arguments)
    assert outcome.exit_code == 0, outcome.stderr
    write_report(out)
    requested_tables(Gearbox.from_toml(case), tmp_path)[0].compute()
    with pytest.raises(MeshError, match="exugear ste --grid"):
        mesh_stiffness(Gearbox.from_toml(case), "table", tmp_path)


def test_file_may_ask_for_the_axes(tmp_path: Path) -> None:
    case = tmp_path / "spur.toml"
    case.write_text(CASE.replace("ste = { ", "ste = { grid = true, "), encoding="utf-8")
    (request,) = requested_tables(Gearbox.from_toml(case), tmp_path)
    assert len(request.wanted.torque) == 2
    assert request.wanted.static_torque == request.wanted.torque[1]


def test_default_axes_have_7500_states(grc: Gearbox) -> None:
    wanted = wanted_table(grc, "sun_planet", grc.ste.positions, grid=True)
    sizes = [len(axis) for axis in (wanted.torque, wanted.centre_distance, wanted.misalignment)]
    assert [wanted.positions, *sizes] == [50, 6, 5, 5]


MODIFICATION = """
[gears.pinion.modification]
tip_relief_um = 10.0
tip_relief_length_mm = 2.0
root_relief_um = 5.0
root_relief_start_roll_deg = 16.0
root_relief_shape = "parabolic"
lead_crowning_um = 3.0
helix_slope_um = 8.0
twist_um = 2.0
topography = "pinion.csv"
"""
TOPOGRAPHY = "radius_mm, -5.0, 5.0\n29.0, 0.0, 1.0\n32.0, 2.0, 4.0\n"


def modified(folder: Path, change: tuple[str, str] = ("", "")) -> Path:
    """Write the case with a modified pinion and its topography beside it."""
    (folder / "pinion.csv").write_text(TOPOGRAPHY, encoding="utf-8")
    case = folder / "spur.toml"
    tables, rest = CASE.split("[pairs]")
    pinion = "held_diameter_mm = 30.0 }"
    inline = ", ".join(MODIFICATION.replace(*change).strip().splitlines()[1:])
    tables = tables.replace(pinion, f"held_diameter_mm = 30.0, modification = {{ {inline} }} }}")
    case.write_text(f"{tables}[pairs]{rest}", encoding="utf-8")
    return case


def test_modifications_of_the_file_enter_the_table_and_its_hash(tmp_path: Path) -> None:
    gearbox = Gearbox.from_toml(modified(tmp_path))
    wanted = wanted_table(gearbox, "spur", 8)
    pinion = wanted.pair.pinion
    tip, root = wanted.pinion_modification.tip_relief, wanted.pinion_modification.root_relief
    assert tip is not None
    assert root is not None
    assert pinion.tip_roll_length - np.sqrt(tip.start_radius**2 - pinion.base_radius**2) == pytest.approx(2e-3)
    assert np.degrees(np.sqrt((root.start_radius / pinion.base_radius) ** 2 - 1.0)) == pytest.approx(16.0)
    assert (tip.amount, root.amount) == pytest.approx((10e-6, 5e-6), rel=1e-12)
    assert (tip.shape, root.shape) == ("linear", "parabolic")
    assert wanted.gear_modification == type(wanted.gear_modification)()
    (tmp_path / "plain.toml").write_text(CASE, encoding="utf-8")
    plain = wanted_table(Gearbox.from_toml(tmp_path / "plain.toml"), "spur", 8)
    assert wanted.hash != plain.hash
    (tmp_path / "pinion.csv").write_text(TOPOGRAPHY.replace("4.0", "5.0"), encoding="utf-8")
    assert wanted_table(Gearbox.from_toml(tmp_path / "spur.toml"), "spur", 8).hash != wanted.hash


def test_table_of_the_other_flank_sees_the_modification_from_the_other_end(tmp_path: Path) -> None:
    """Turned about the line of centres, a pair that is loaded on its other flanks is the table's."""
    case = modified(tmp_path)
    here = wanted_table(Gearbox.from_toml(case), "spur", 8).pinion_modification
    case.write_text(
        case.read_text(encoding="utf-8").replace("shaft_1 = 100.0 }, locked", "shaft_1 = -100.0 }, locked"),
        encoding="utf-8",
    )
    there = wanted_table(Gearbox.from_toml(case), "spur", 8).pinion_modification
    assert here.helix_slope == -there.helix_slope == pytest.approx(8e-6, rel=1e-12)
    assert there == here.mirrored()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("tip_relief_length_mm = 2.0", "tip_relief_shape = 'linear'"), "tip relief requires"),
        (
            ("tip_relief_length_mm = 2.0", "tip_relief_length_mm = 20.0"),
            "gears.pinion.modification: .* off the involute",
        ),
        (("tip_relief_length_mm = 2.0", "tip_relief_length_mm = 16.5"), "tip_relief.start_radius"),
        (("pinion.csv", "other.csv"), r"gears.pinion.modification.topography = 'other.csv': no such file"),
        (("lead_crowning_um = 3.0", "lead_crowning_um = -3.0"), "lead_crowning_um"),
        (("twist_um", "twist_mm"), "twist_um"),
    ],
)
def test_modifications_that_make_no_sense_are_refused_with_their_key(
    change: tuple[str, str], words: str, tmp_path: Path
) -> None:
    with pytest.raises(GearboxFileError, match=words):
        Gearbox.from_toml(modified(tmp_path, change))


def test_a_relief_that_is_stated_as_zero_is_none(tmp_path: Path) -> None:
    """So that a study may vary its amount from zero."""
    gearbox = Gearbox.from_toml(modified(tmp_path))
    without = gearbox.varied({"gears.pinion.modification.tip_relief_um": 0.0})
    assert gearbox.modifications["pinion"].tip_relief is not None
    assert without.modifications["pinion"].tip_relief is None
    assert wanted_table(without, "spur", 8).hash != wanted_table(gearbox, "spur", 8).hash


def test_bad_topography_names_file_line_and_value(tmp_path: Path) -> None:
    case = modified(tmp_path)
    (tmp_path / "pinion.csv").write_text(TOPOGRAPHY.replace(" 2.0", " two"), encoding="utf-8")
    with pytest.raises(GearboxFileError, match=r"gears.pinion.modification: .*pinion.csv: line 3: 'two'"):
        Gearbox.from_toml(case)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[0.2, 1.0]", "[0.2, 0.9]", "torque_factors"),
        ("[0.2, 1.0]", "[1.0, 0.2]", ": values must increase"),
        ("[0.2, 1.0]", "[0.0, 1.0]", "torque_factors"),
        ("[0.0, 50.0]", "[-50.0, 50.0]", "centre_distance_offsets_um"),
        ("[0.0, 20.0]", "[0.0, nan]", "misalignment_um"),
    ],
)
def test_axes_without_the_static_state_or_out_of_order_are_refused(
    old: str, new: str, words: str, tmp_path: Path
) -> None:
    case = tmp_path / "spur.toml"
    case.write_text(CASE.replace(old, new), encoding="utf-8")
    with pytest.raises(GearboxFileError, match=words):
        Gearbox.from_toml(case)


def test_a_centre_distance_at_which_flanks_overlap_is_refused_with_its_key(tmp_path: Path) -> None:
    case = tmp_path / "spur.toml"
    case.write_text(CASE.replace("[0.0, 50.0]", "[-50.0, 0.0]"), encoding="utf-8")
    outcome = exugear("ste", case, "--grid", "--out", tmp_path / "out")
    assert outcome.exit_code == 2
    assert "centre_distance_offsets_um: -50" in outcome.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.validation
def test_pictures_and_report_show_the_static_state_of_a_grid(computed: tuple[Path, Path]) -> None:
    _, out = computed
    assert (out / "pictures" / "ste.png").is_file()
    text = write_report(out).path.read_text(encoding="utf-8")
    with xr.open_dataset(out / "tables" / "spur.nc") as data:
        mean = 1e6 * float(data["ste"].isel(torque=1, centre_distance=0, misalignment=0).mean())
    assert np.isfinite(mean)
    assert f"{mean:.2f}" in text
