"""What a REXS file says of service, loads and strength becomes sections with which `life` runs."""

from __future__ import annotations

import pytest

from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.gearbox.gearbox import Gearbox

from ...cases.command import exugear
from ...cases.spur import COARSE_INPUT
from .own_files import spur_pair

LIMITS = {"endurance_limit_flank": 1500.0, "endurance_limit_root": 461.0}


def file_with_spectrum(version="1.6", **material):
    """Two load cases: 200 N m at 1500 rpm for 70 % of 20,000 h, 100 N m at 900 rpm for the rest."""
    file, shafts = spur_pair(version, torque=200.0)
    file.give(file.steel, **(LIMITS | material))
    file.give(file.unit, operating_time=20000.0)
    file.add("lubricant", viscosity_at_40_degree_celsius=150.0)
    load = file.model().components_of_type("external_load")[0].number
    for torque, speed, share in ((200.0, 1500.0, 70.0), (100.0, 900.0, 30.0)):
        changes = {file.unit: {"operating_time_fraction": share}, load: {"torque_around_u_axis": torque}}
        speeds = {shafts[0]: {"rotational_speed": speed}, shafts[1]: {"rotational_speed": -0.5 * speed}}
        file.load_case({**changes, **speeds})
    return file


def imported(file):
    return to_case(file.model(), "own.rexs")


def test_load_spectrum_speeds_endurance_limits_and_oil_are_taken():
    result = imported(file_with_spectrum(heat_treated_material_type_iso_6336_2006="case_hardened_wrought_steel"))
    case = result.gearbox.case
    assert case.operation.rated_speed_rpm == 1500.0
    assert case.loads.body == "shaft_1"
    assert case.loads.life_years * 8766.0 == pytest.approx(20000.0)
    assert case.rating.viscosity_40_mm2_per_s == 150.0
    assert set(case.rating.gears) == {"gear_1", "gear_2"}
    strength = case.rating.gears["gear_1"]
    assert (strength.sigma_H_lim_MPa, strength.sigma_F_lim_MPa, strength.curve) == (1500.0, 461.0, "case_hardened")
    rows = [[float(one) for one in line.split(",")] for line in result.spectrum.splitlines()[1:]]
    assert rows == [pytest.approx([200.0, 1500.0, 14000.0]), pytest.approx([100.0, 900.0, 6000.0])]


def test_what_the_file_lacks_of_a_life_is_marked():
    text = imported(file_with_spectrum()).text
    for key in ("dynamic_factor", "roughness", "root_factor", "curve"):
        line = next(line for line in text.splitlines() if line.startswith(key))
        assert "# A   " in line, line
    unrated = imported(file_with_spectrum(endurance_limit_root="")).gearbox.case.rating
    assert not unrated.gears


def test_heat_treatments_have_their_curves():
    """ISO 6336-3: through hardened steel bears 2.5 times up to 10,000 cycles, nitrided 1.6 times up to 1,000."""
    for kind, point in (("through_hardened_wrought_steel", (1e4, 2.5)), ("nitrided_steel", (1e3, 1.6))):
        file = file_with_spectrum(heat_treated_material_type_iso_6336_2006=kind)
        assert imported(file).gearbox.case.rating.gears["gear_1"].bending_curve[0] == point
    soft = imported(file_with_spectrum(endurance_limit_flank=740.0)).gearbox.case.rating.gears["gear_1"]
    assert soft.curve is None
    assert soft.bending_curve[0] == (1e4, 2.5)


def test_a_file_without_loads_or_speeds_gets_no_sections_on_a_life():
    file, shafts = spur_pair()
    for shaft in shafts:
        file.give(shaft, rotational_speed="")
    result = imported(file)
    assert result.spectrum == ""
    assert result.gearbox.case.loads is None
    assert result.gearbox.case.rating is None
    assert result.gearbox.case.operation.rated_speed_rpm is None


def test_the_verbs_import_and_count_the_loads_and_never_write_over_a_table(tmp_path):
    path = tmp_path / "own.rexs"
    path.write_text(file_with_spectrum().text())
    assert exugear("import", path, "--out", tmp_path / "case").exit_code == 0
    case = tmp_path / "case" / "gearbox.toml"
    assert Gearbox.from_toml(case).case.loads.sources["load_spectrum"].file == "load_spectrum.csv"
    assert exugear("loads", case, "--out", tmp_path / "results").exit_code == 0
    case.unlink()  # as if the import had been killed between its two files
    assert exugear("import", path, "--out", tmp_path / "case").exit_code == 0
    other = tmp_path / "other"
    other.mkdir()
    (other / "load_spectrum.csv").write_text("mine")
    outcome = exugear("import", path, "--out", other)
    assert outcome.exit_code == 2
    assert "exists already" in outcome.output
    assert (other / "load_spectrum.csv").read_text() == "mine"
    assert not (other / "gearbox.toml").exists()


@pytest.mark.validation
def test_life_runs_on_what_was_imported(tmp_path, monkeypatch):
    """200 N m on 20 teeth of 3 mm and a face of 20 mm is too much for flanks: it ends with code 1 and says so."""
    monkeypatch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
    path = tmp_path / "own.rexs"
    path.write_text(file_with_spectrum().text())
    assert exugear("import", path, "--out", tmp_path / "case").exit_code == 0
    outcome = exugear("life", tmp_path / "case" / "gearbox.toml", "--out", tmp_path / "results")
    assert outcome.exit_code == 1
    assert "S_H" in outcome.output
    assert (tmp_path / "results" / "bushing" / "line_of_action-geometry" / "life.nc").exists()
