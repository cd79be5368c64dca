"""How far the load moves along the face in a mesh cycle, and whether `steady` says where its moment is left out."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.gearbox.units import RPM
from exugear.steady.balance.response import transmission_errors
from exugear.steady.crossings import contributions
from exugear.steady.mean_system.mesh_places import MISALIGNMENT
from exugear.steady.point_solver import harmonic_balance_model
from exugear.system.build import assemble
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.tables import fitting_table, requested_tables, shuttling_pairs

from ...cases.command import exugear
from ...cases.spur import SPUR_CASE

pytestmark = pytest.mark.usefixtures("coarse_tables")


def with_tables(content, folder):
    gearbox = Gearbox.from_dict(content)
    for request in requested_tables(gearbox, folder, positions=12):
        request.compute().save(request.path)
    return gearbox


@pytest.mark.validation
def test_the_load_of_spur_teeth_stays_in_the_middle(tmp_path):
    (own,) = shuttling_pairs(with_tables(tomllib.loads(SPUR_CASE), tmp_path), tmp_path)
    assert own.amplitude < 1e-6
    assert own.over_error < 0.01


@pytest.mark.validation
def test_the_load_of_helical_teeth_moves_along_them_as_their_contact_has_it(tmp_path):
    """Moment over push by the line loads of the contact itself, summed along the face."""
    gearbox = with_tables(tomllib.loads(template("pair")), tmp_path)
    (own,) = shuttling_pairs(gearbox, tmp_path)
    point = fitting_table(gearbox, "helical", tmp_path).static_state
    line_load = point["line_load"].sum("tooth").to_numpy()
    across = point["axial_position"].to_numpy()
    centre = (line_load * (across - across.mean())).sum(axis=1) / line_load.sum(axis=1)
    turning = np.exp(-2j * np.pi * np.arange(len(centre)) / len(centre))
    assert own.amplitude == pytest.approx(2.0 * abs(np.mean(centre * turning)), rel=0.1)
    assert own.over_error > 1.0


@pytest.mark.validation
def test_steady_says_that_the_moment_is_left_out_and_how_much_that_is(tmp_path):
    case = tmp_path / "pair.toml"
    case.write_text(template("pair"), encoding="utf-8")
    usual = [
        "steady",
        str(case),
        "--out",
        str(tmp_path / "out"),
        "--variant",
        "bushing",
        "--speeds",
        "500:1500",
        "--points",
        "4",
    ]
    asked = [*usual, "--mesh-model", "tangential"]
    told = exugear(*asked)
    assert told.exit_code == 0, told.stderr
    words = " ".join(told.stderr.split())
    assert "helical: load centroid shuttles by ±" in words
    assert "is neglected by the mesh model tangential; resonances with tilting gears may be" in words
    summary = json.loads(exugear(*asked, "--json").stdout)
    (own,) = summary["neglected_shuttling"]
    assert own["pair"] == "helical"
    assert own["over_transmission_error"] > 1.0
    # The usual law has it.
    assert "is neglected" not in " ".join(exugear(*usual).stderr.split())


def test_steady_says_nothing_where_the_load_stays(tmp_path):
    case = tmp_path / "spur.toml"
    case.write_text(SPUR_CASE, encoding="utf-8")
    asked = [
        "steady",
        str(case),
        "--out",
        str(tmp_path / "out"),
        "--variant",
        "bushing",
        "--speeds",
        "500:1500",
        "--points",
        "4",
    ]
    assert ": load centroid shuttles by ±" not in " ".join(exugear(*asked).stderr.split())


@pytest.mark.validation
def test_the_part_of_the_moment_in_a_peak_is_what_the_peak_lacks_without_it(tmp_path, monkeypatch):
    """The moment's own vibration along the sum, and the sum of a model whose load stays in its mean place."""
    gearbox = with_tables(tomllib.loads(template("pair")), tmp_path)
    speed, line = 2029.0 * RPM, 1
    assembly = assemble(gearbox, Choice("bushing"), mesh_stiffness(gearbox, "line_of_action", tmp_path))
    model = harmonic_balance_model(assembly, np.array([speed, speed]))
    found = contributions(model, speed, line)
    (share,) = found.shuttling.values()
    assert found.meshes.keys() == found.shuttling.keys()
    assert abs(share) > 0.05
    interface = model.at(speed)
    both = -2.0 * transmission_errors(model, interface.ports, speed)[line]
    moment = np.zeros_like(both)
    moment[:, MISALIGNMENT] = both[:, MISALIGNMENT]
    dynamic = model.system.dynamic(speed, speed * model.lines.orders[line])
    row = model.row_of_overall(speed)
    whole, own = (
        complex(row @ np.linalg.solve(dynamic, model.loads(interface.ports) @ forces.ravel()))
        for forces in (both, moment)
    )
    assert found.amplitude == pytest.approx(abs(whole), rel=1e-9)
    assert share == pytest.approx((own * whole.conjugate()).real / abs(whole) ** 2, rel=1e-9)
    staying = type(model.cycles)
    monkeypatch.setattr(staying, "ways", property(lambda given: 0.0 * model.cycles.curves[0]))
    monkeypatch.setattr(staying, "moments_beyond", property(lambda given: 0.0 * model.cycles.curves[0]))
    without = transmission_errors(model, interface.ports, speed)[line]
    rest = complex(row @ np.linalg.solve(dynamic, model.loads(interface.ports) @ (-2.0 * without).ravel()))
    # The way also moves the force of misaligned teeth, which is small here.
    assert 1.0 - share == pytest.approx((rest * whole.conjugate()).real / abs(whole) ** 2, abs=0.05)
