"""Imported gearboxes move as they should: modes against inertias and springs by hand, runs against the statics."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from exugear.exchange.rexs.containers import read_rexs
from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.project import Project
from exugear.results.run_file import load_run
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

DATA = Path(__file__).parent / "data"
LAW = "iso6336"


def gearbox_of(name, folder):
    path = folder / "gearbox.toml"
    path.write_text(to_case(read_rexs(DATA / name), name, path).text, encoding="utf-8")
    return Gearbox.from_toml(path)


@pytest.mark.parametrize(
    "name", ["SEW_3-stage_cylindrical_gearbox_1.0.rexs", "FVA-Industriegetriebe_2_stufig_1-6.rexs"]
)
def test_torsional_modes_are_those_of_the_shafts_inertias_on_the_mesh_springs(name, tmp_path):
    """J from the imported bodies, k r r' from each pair, both put together here: the rest is an eigenvalue problem."""
    gearbox = gearbox_of(name, tmp_path)
    bodies = {body.name: number for number, body in enumerate(gearbox.bodies())}
    inertia = np.diag([body.axial for body in gearbox.bodies()])
    springs = mesh_stiffness(gearbox, LAW)
    stiffness = np.zeros_like(inertia)
    for mesh in gearbox.meshes:
        row = np.zeros(len(bodies))
        row[bodies[mesh.pinion]], row[bodies[mesh.gear]] = mesh.pair.pinion.base_radius, mesh.pair.gear.base_radius
        stiffness += np.mean(springs[mesh.pair.name]) * np.outer(row, row)
    expected = np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(inertia, stiffness)))) / (2.0 * math.pi)
    found = Project(gearbox, tmp_path, Choice("rigid", LAW)).modes().frequency
    assert np.sort(found)[1:] == pytest.approx(np.sort(expected)[1:], rel=1e-6)  # the first is rolling


@pytest.mark.validation
@pytest.mark.parametrize(
    ("name", "variant", "case"),
    [
        ("SEW_3-stage_cylindrical_gearbox_1.0.rexs", "bushing", "nominal"),
        pytest.param("FVA-Industriegetriebe_2_stufig_1-6.rexs", "rigid", "load_case_4", marks=pytest.mark.long),
        ("FVA_Planetary_stage_-_Minus_gearing_1.1.rexs", "bushing", "nominal"),
    ],
)
def test_a_run_keeps_its_speed_and_carries_the_torque_of_the_file(name, variant, case, tmp_path):
    gearbox = gearbox_of(name, tmp_path)
    run = Project(gearbox, tmp_path, Choice(variant, LAW, load_case=case)).run(duration=0.05)
    assert run.trusted
    data = load_run(run.path)
    speed = gearbox.load_cases[case].start_speed
    assert float(data["input_speed"].mean()) == pytest.approx(speed, rel=0.01)
    forces = gearbox.train.static_mesh_forces()
    for mesh in data["mesh_force"].transpose("mesh", ...):
        # Vibration around the mean over a few mesh cycles; gravity, which the statics leave out, is a thousandth.
        assert float(abs(mesh).mean()) == pytest.approx(abs(forces[str(mesh["mesh"].item())]), rel=0.03)


@pytest.mark.validation
def test_elastic_shafts_of_sections_lower_the_first_mode_of_the_imported_gearbox(tmp_path):
    gearbox = gearbox_of("SEW_3-stage_cylindrical_gearbox_1.0.rexs", tmp_path)
    first = {}
    for variant in ("bushing", "flexible"):
        frequencies = np.sort(Project(gearbox, tmp_path, Choice(variant, LAW)).modes().frequency)
        first[variant] = frequencies[frequencies > 1.0][0]
    assert 0.2 * first["bushing"] < first["flexible"] < first["bushing"]
