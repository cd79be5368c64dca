"""Forces of a REXS file become constant forces on bodies; what is left out and acts is told first."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.exchange.rexs.to_case.conversion import Imported, to_case

from .own_files import OwnFile, spur_pair


def imported(file: OwnFile) -> Imported:
    return to_case(file.model(), "own")


def test_a_force_acts_on_its_body_where_the_file_has_it_in_the_axes_of_the_gearbox() -> None:
    """x, y, z are v, w, u of the gear unit; u of the shaft counts from its left end at 0."""
    file, shafts = spur_pair()
    given = {"force_u_direction": 5e4, "force_v_direction": 300.0, "torque_around_w_axis": 7.0}
    load = file.load(shafts[1], None, **given)
    file.give(load, u_coordinate_on_shaft=25.0)
    made = imported(file)
    (force,) = made.gearbox.forces
    assert force.body == made.gearbox.case.overall.output
    assert force.position[2] == pytest.approx(0.025)
    assert force.wrench == pytest.approx((300.0, 0.0, 5e4, 0.0, 7.0))
    assert not made.lost


def test_a_force_on_a_shaft_that_points_the_other_way_is_turned_with_it() -> None:
    file = OwnFile()
    shafts = []
    for teeth, v in ((20, 0.0), (40, 90.0)):
        shaft = file.shaft((100.0, v, 0.0), [(0.0, 100.0, 30.0)])
        file.give(shaft, u_axis_vector=(-1.0, 0.0, 0.0))
        for u in (10.0, 90.0):
            file.stiff_bearing(shaft, (u, v, 0.0))
        shafts.append((shaft, file.gear(shaft, (40.0, v, 0.0), teeth, 3.0)))
        file.load(shaft, 100.0 if teeth == 20 else None)
    file.stage(shafts[0][1], shafts[1][1], 90.0)
    load = file.load(shafts[1][0], None, force_u_direction=1000.0)
    file.give(load, u_coordinate_on_shaft=25.0)
    (force,) = imported(file).gearbox.forces
    assert force.position[2] == pytest.approx(0.075)
    assert force.wrench[:3] == pytest.approx((0.0, 0.0, -1000.0))


def test_the_force_of_the_load_case_with_the_largest_torque_counts() -> None:
    file, shafts = spur_pair()
    loads = [number for number, part in file.model().components.items() if part.type == "external_load"]
    for torque, force in ((80.0, 100.0), (-250.0, 400.0)):
        changes = {loads[0]: {"torque_around_u_axis": torque}, loads[1]: {"force_v_direction": force}}
        file.load_case(changes)
    made = imported(file)
    assert [force.wrench[0] for force in made.gearbox.forces] == [400.0]
    assert any("differs between load cases" in line and "load_case_2" in line for line in made.changed)


def test_import_prints_what_acts_and_is_left_out(tmp_path: Path) -> None:
    """A force on the casing and a component that nothing reads; rating data follow in the head of the file alone."""
    file, shafts = spur_pair()
    file.load(file.casing, None, force_u_direction=2e3)
    file.add("additional_mass", "disc")
    file.add("cylindrical_stage_gear_data", "rating")
    made = imported(file)
    assert [line.split(":")[0].split(",")[0].split(" ")[0] for line in made.lost] == [
        "external_load",
        "additional_mass",
    ]
    assert "2000 N" in made.lost[0]
    assert made.ignored[: len(made.lost)] == made.lost
    assert "cylindrical_stage_gear_data, 1 of them" in made.ignored
    path = tmp_path / "own.rexs"
    path.write_text(file.text(), encoding="utf-8")
    told = CliRunner().invoke(app, ["import", str(path), "--out", str(tmp_path / "out")])
    assert told.exit_code == 0, told.output
    printed = " ".join(told.output.split())
    assert printed.index("Warning: not imported: external_load") < printed.index(
        "Warning: not imported: additional_mass"
    )
    told = CliRunner().invoke(app, ["import", str(path), "--out", str(tmp_path / "all"), "--all"])
    assert "also not imported, without effect on results: " in " ".join(told.output.split())
