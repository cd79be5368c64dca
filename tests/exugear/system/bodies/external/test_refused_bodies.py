"""Matrices and keys that are refused, and what is said of unusual ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.report.pictures.scene import elastic_scene
from exugear.system.bodies.external_of_gearbox import check_external, external_warnings
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices
from exugear.system.bodies.of_gearbox import node_numbers
from exugear.system.modes import modes_of
from exugear.system.system import input_hash

from .....optional_libraries import needs_meshio
from ....cases.assembled import assembled
from ....cases.beams import beams_between
from ....cases.box import box_content
from .shared import FOOT, STIFFNESS, box_of, write

pytestmark = needs_meshio


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"file": "missing.npz"}, r"bodies.box.external.file = 'missing.npz': no such file"),
        ({"file": "../box.npz"}, r"external.file = '../box.npz': is outside the folder"),
        ({"units": None}, r"bodies.box.external.units"),
        ({"units": "mm"}, r"bodies.box.external.units"),
        ({"file": None}, r"requires its matrices; set file, or stiffness and mass"),
        ({"stiffness": "box.npz"}, r"set either file, or stiffness and mass"),
        ({"nodes": "box.npz", "units": "mm-t-s"}, r"seats.bearing_1: no node at|nodes .* are all at"),
        ({"shift_mm": [1.0, 0.0, 0.0]}, r"external: seats.bearing_1: no node at \(0, 0, 0\) mm; the nearest is node 1"),
        ({"seats": {}}, r"seats.foot: no node at \(50, 0, -40\) mm; the nearest is node 3 at a distance of 28 mm"),
        ({"seats": {"foot": {"node": 9}}}, r"seats.foot.node = 9: no such node; nodes are 1, 2, 3"),
        ({"seats": {"foot": {"node": 1}}}, r"seats.foot: node 1 is also that of bearing_1; set same_as = 'bearing_1'"),
        ({"seats": {"foot": {"node": 3, "same_as": "bearing_1"}}}, r"set one of node, position_mm"),
        ({"seats": {"foot": {"same_as": "nothing"}}}, r"foot.same_as = 'nothing': no such seat; seats are bearing_1"),
        ({"seats": {"foot": {"sector_nodes": [1, 2, 3]}}}, r"foot.sector_nodes: only the seat of a gear has sectors"),
        ({"seats": {"foot": {"sector_nodes": [1, 2]}}}, r"sector_nodes must be an odd number"),
        ({"seats": {**FOOT, "other": {}}}, r"seats.other: no gear, bearing or mount of the body is named 'other'"),
        ({"torque_seat": "top"}, r"torque_seat = 'top': no such seat; seats are bearing_1, bearing_2, foot"),
        ({"stated_mass_kg": 0.6}, r"stated_mass_kg = 0.6: the matrices have 0.58875 kg; check units and model"),
        ({"stated_centre_mm": [40.0, 0.0, -6.0]}, r"the matrices have their centre at \(37.5, .*, -6\) mm"),
        ({"loss_factor": 0.02, "damping_time_s": 1e-6}, r"set either loss_factor or damping_time_s"),
        ({"loss_factor": 2.0}, r"bodies.box.external.loss_factor"),
        ({"stiffness_name": "KUUX"}, r"no stiffness matrix named KUUX; matrices are stiffness, mass"),
    ],
)  # fmt: skip
def test_a_body_that_cannot_be_is_one_error_with_its_key(
    tmp_path: Path, box: InterfaceMatrices, change: dict[str, Any], message: str
) -> None:
    keys = {"units": "SI", "seats": FOOT, **write(tmp_path, box), **change}
    content = box_content(tmp_path)
    del content["bodies"]["box"]["solid"]
    content["bodies"]["box"]["external"] = {key: value for key, value in keys.items() if value is not None}
    with pytest.raises(GearboxFileError, match=message) as refused:
        check_external(Gearbox.from_dict(content, str(tmp_path / "case.toml")), "box")
    assert len(refused.value.errors) == 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"flexibility": "ffrf", "fixed": False}, "flexibility 'ffrf' requires mass integrals"),
        ({"spin_only": True, "fixed": False}, "external matrices are for a body on a fixed axis or a fixed body"),
        ({"fixed": False, "external": {"file": "box.npz", "units": "SI", "loss_factor": 0.02}}, "set damping_time_s"),
        ({"solid": {"file": "plate.vtu"}}, "set one of shape, solid and external"),
    ],
)
def test_bodies_that_matrices_cannot_be_are_refused(
    tmp_path: Path, box: InterfaceMatrices, changes: dict[str, Any], message: str
) -> None:
    content = box_content(tmp_path)
    del content["bodies"]["box"]["solid"]
    content["bodies"]["box"] |= {"external": {**write(tmp_path, box), "units": "SI"}, **changes}
    with pytest.raises(GearboxFileError, match=message):
        Gearbox.from_dict(content, str(tmp_path / "case.toml"))


def test_matrices_that_fail_a_check_are_refused_before_anything_is_computed(
    tmp_path: Path, box: InterfaceMatrices
) -> None:
    stiffness = box.stiffness.copy()
    stiffness[:3, :3] += 1e7 * np.eye(3)
    keys = write(tmp_path, InterfaceMatrices(box.nodes, box.positions, box.modal, box.mass, stiffness))
    gearbox = box_of(tmp_path, keys)
    with pytest.raises(GearboxFileError, match="bodies.box.external: stiffness: 3 motions are free"):
        check_external(gearbox, "box")


def test_what_an_rbe2_does_and_what_is_unusual_is_said(tmp_path: Path, box: InterfaceMatrices) -> None:
    spare = beams_between(np.vstack([box.positions, [[0.02, 0.02, 0.0]]]), (1, 2, 3, 44), 0.02)
    gearbox = box_of(tmp_path, {**write(tmp_path, spare), "constraint": "rbe2"})
    check_external(gearbox, "box")
    said = list(external_warnings(gearbox, "box"))
    assert any("constraint = 'rbe2': RBE2 makes each seat rigid" in line for line in said)
    assert any("nodes 44 carry nothing and remain free" in line for line in said)
    wrong = box_of(tmp_path, {**write(tmp_path, box), "seats": {name: {"node": n} for n, name in
                                                             enumerate(("bearing_1", "bearing_2", "foot"), start=1)},
                              "units": "inch-lbf-s"})  # fmt: skip
    assert any("check units" in line for line in external_warnings(wrong, "box"))


def test_loads_and_matrices_have_the_same_node_numbers(tmp_path: Path, box: InterfaceMatrices) -> None:
    content = box_content(tmp_path)
    assert node_numbers(Gearbox.from_dict(content, str(tmp_path / "case.toml")), "box") == {
        "bearing_1": 1, "bearing_2": 2, "foot": 3,
    }  # fmt: skip
    renumbered = InterfaceMatrices((70, 8, 55), box.positions, box.modal, box.mass, box.stiffness)
    seats = {"bearing_1": {"node": 70}, "bearing_2": {"same_as": "bearing_1"}, "foot": {"node": 55}}
    gearbox = box_of(tmp_path, {**write(tmp_path, renumbered), "seats": seats})
    assert node_numbers(gearbox, "box") == {"bearing_1": 70, "bearing_2": 70, "foot": 55}


def test_other_files_are_other_results(tmp_path: Path, box: InterfaceMatrices) -> None:
    hashes = []
    for factor in (1.0, 1.01):
        keys = write(tmp_path, InterfaceMatrices(box.nodes, box.positions, box.modal, factor * box.mass, box.stiffness))
        hashes.append(input_hash(assembled(box_of(tmp_path, keys), Choice("flexible"), STIFFNESS)))
    assert hashes[0] != hashes[1]


def test_pictures_show_the_nodes(tmp_path: Path, box: InterfaceMatrices) -> None:
    assembly = assembled(box_of(tmp_path, write(tmp_path, box)), Choice("flexible"), STIFFNESS)
    surface = assembly.elastic_bodies["box"].reduced.surface
    assert surface.points[:18].reshape(3, 6, 3).mean(axis=1) == pytest.approx(box.positions)
    # Bars from the foot, at (50, 0, -12) mm, to both bearings: 51.4 and 27.7 mm are shorter than 75 mm.
    ends = surface.points[18:].reshape(2, 2, 4, 3).mean(axis=2)
    assert sorted(np.linalg.norm(np.diff(ends, axis=1)[:, 0], axis=1)) == pytest.approx([0.02773, 0.05142], abs=1e-5)
    rigid = surface.displacement @ assembly.elastic_bodies["box"].reduced.rigid_motions((0.0, 0.0, 0.0))
    assert rigid[:, :, 5] == pytest.approx(np.cross([0.0, 0.0, 1.0], surface.points), abs=1e-7)
    scene = elastic_scene(assembly, modes_of(assembly).shapes[:, 3])
    assert len(scene.bodies[0].quads) == 3 * 8 + 2 * 4  # seen from every side
