"""Tables that stresses of a life come from: around the places where gears stand, over the loads of the life."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.life.static_balance import LARGEST_STEP, stress_requests
from exugear.system.build import assemble
from exugear.system.operating_points import mesh_duties
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.tables import TableRequest
from fe_ste.transmission_error.contact_stress import face_load_factor

from ..cases.coarse_contact import coarse_curves, coarse_input

GRC = Path(__file__).parents[3] / "cases" / "grc750" / "gearbox.toml"
POSITIONS = 10


@cache
def assembly() -> Assembly:
    gearbox = Gearbox.from_toml(GRC)
    return assemble(gearbox, Choice("bushing", "line_of_action"), coarse_curves(gearbox))


def loads(share: float, back: float = -0.1) -> Any:
    """Counted loads up to a share of the static torque, and back to another share of that."""
    gearbox = assembly().gearbox
    (torque,) = (abs(torque) for torque in gearbox.case.static_load.torques_N_m.values())
    forces = {mesh.family: abs(gearbox.train.static_mesh_forces()[mesh.name]) / torque for mesh in gearbox.meshes}
    (body,) = gearbox.case.static_load.torques_N_m
    source = SimpleNamespace(torque=np.array([back, 1.0]) * share * torque)
    return SimpleNamespace(sources=[source], mesh_forces=forces, body=body)


def requests(folder: Path) -> list[TableRequest]:
    pairs = assembly().gearbox.gear_pairs
    return [
        TableRequest(name, coarse_input(assembly().gearbox, name, POSITIONS), folder / f"{name}.nc", None)
        for name in pairs
    ]


@pytest.mark.validation
def test_tables_hold_the_static_misalignment_and_all_loads(tmp_path: Path) -> None:
    found = {one.name: one.wanted for one in stress_requests(assembly(), requests(tmp_path), loads(1.3), tmp_path)}
    for element, duty in zip(assembly().elements, mesh_duties(assembly()), strict=True):
        wanted = found[element.mesh.pair.name]
        tilt = element.flank * duty.misalignment
        nodes = np.array(wanted.misalignment)
        assert nodes.min() <= min(0.0, 1.3 * tilt) and nodes.max() >= max(0.0, 1.3 * tilt)
        assert np.diff(nodes).max() * wanted.pair.face_width <= LARGEST_STEP * (1.0 + 1e-9)
        assert max(wanted.torque) >= 1.3 * duty.force * wanted.pair.pinion.base_radius * 0.95
        assert wanted.centre_distance == () and wanted.positions == POSITIONS


def test_tables_hold_the_misalignment_of_reversed_loads_and_keep_the_nodes_of_the_others(tmp_path: Path) -> None:
    turned, alone = (
        {one.name: one.wanted for one in stress_requests(assembly(), requests(tmp_path), loads(1.0, back), tmp_path)}
        for back in (-0.6, 0.0)
    )
    for element, duty in zip(assembly().elements, mesh_duties(assembly()), strict=True):
        name = element.mesh.pair.name
        tilt = element.flank * duty.misalignment
        assert min(turned[name].misalignment) <= -0.6 * tilt <= max(turned[name].misalignment)
        assert set(alone[name].misalignment) <= set(turned[name].misalignment)


def test_loads_that_change_a_little_leave_tables_as_they_are(tmp_path: Path) -> None:
    one, other = (stress_requests(assembly(), requests(tmp_path), loads(share), tmp_path) for share in (1.3, 1.31))
    assert [request.wanted.hash for request in one] == [request.wanted.hash for request in other]


def test_axes_of_the_file_and_gears_that_stand_straight_stay_as_they_are(tmp_path: Path) -> None:
    given = [
        replace(request, wanted=replace(request.wanted, misalignment=(-1e-4, 0.0, 1e-4)))
        for request in requests(tmp_path)
    ]
    assert stress_requests(assembly(), given, loads(1.0), tmp_path) == given
    gearbox = assembly().gearbox
    rigid = assemble(gearbox, Choice("rigid", "line_of_action"), coarse_curves(gearbox))
    straight = requests(tmp_path)
    assert stress_requests(rigid, straight, loads(1.0), tmp_path) == straight


@pytest.mark.validation
def test_the_load_along_the_face_is_that_of_contact_at_the_static_misalignment(tmp_path: Path) -> None:
    """K_Hbeta between the nodes of the table, against the contact that is solved where the gears stand."""
    (request,) = (
        one for one in stress_requests(assembly(), requests(tmp_path), loads(1.0), tmp_path) if one.name == "high_speed"
    )
    factor = face_load_factor(request.compute().dataset.isel(centre_distance=0))
    again = stress_requests(assembly(), requests(tmp_path), loads(1.0), tmp_path)
    assert [one.name for one in again if one.stored is not None] == ["high_speed"]
    (duty,) = (one for one in mesh_duties(assembly()) if one.name == "high_speed")
    flank = assembly().elements[assembly().mesh_names.index("high_speed")].flank
    torque = request.wanted.torque[request.wanted.torque.index(max(request.wanted.torque))]
    there = factor.sel(torque=torque).interp(misalignment=flank * duty.misalignment)
    assert float(there) == pytest.approx(duty.face_load_factor, rel=0.03)
    assert float(factor.sel(torque=torque).sel(misalignment=0.0)) < 0.9 * duty.face_load_factor
