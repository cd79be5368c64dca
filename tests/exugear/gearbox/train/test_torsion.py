"""A body that torsion holds on what stands, such as a ring on a torque arm, is no way for the train to roll."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import load_warnings, summarise_loads
from exugear.gearbox.variant import VariantError
from exugear.system.bearings.stiffness import unsupported
from exugear.system.build import assemble
from exugear.system.modes import modes_of
from exugear.system.statics import accelerating_start, static_state
from exugear.transient.runup import simulate

RING_CASE = """
name = "ring on a torque arm"
default_inertias = "i"
[overall]
input = "carrier"
output = "sun"
output_gear = "s"
[static_load]
torques_N_m = { carrier = 500.0 }
locked = ["sun", "ring"]
[damping]
bearing_time_s = 2e-5
mesh_time_s = 2e-5
[gears.s]
teeth = 21
normal_module_mm = 3.0
face_width_mm = 30.0
held_diameter_mm = 38.0
rack = { addendum = 0.9, dedendum = 1.25, tip_radius = 0.3 }
[gears.p]
teeth = 39
normal_module_mm = 3.0
face_width_mm = 30.0
held_diameter_mm = 70.0
rack = { addendum = 0.9, dedendum = 1.25, tip_radius = 0.3 }
[gears.r]
teeth = 99
normal_module_mm = 3.0
face_width_mm = 30.0
held_diameter_mm = 339.0
internal = true
rack = { addendum = 0.9, dedendum = 1.25, tip_radius = 0.3 }
[pairs.sp]
pinion = "s"
gear = "p"
centre_distance_mm = 90.0
[pairs.rp]
pinion = "p"
gear = "r"
centre_distance_mm = 90.0
[bodies.carrier]
axis_position_mm = [0.0, 0.0]
inertia.i = { mass_kg = 5.0, axial_kg_m2 = 0.05, transverse_kg_m2 = 0.05, centre_of_mass_z_mm = 0.0 }
[bodies.ring]
axis_position_mm = [0.0, 0.0]
gears_z_mm = { r = 0.0 }
inertia.i = { mass_kg = 3.0, axial_kg_m2 = 0.06, transverse_kg_m2 = 0.06, centre_of_mass_z_mm = 0.0 }
[bodies.sun]
axis_position_mm = [0.0, 0.0]
gears_z_mm = { s = 0.0 }
inertia.i = { mass_kg = 0.5, axial_kg_m2 = 0.0005, transverse_kg_m2 = 0.0005, centre_of_mass_z_mm = 0.0 }
[bodies.planet]
carrier = "carrier"
orbit_radius_mm = 90.0
planet_angles_deg = [0.0, 120.0, 240.0]
gears_z_mm = { p = 0.0 }
inertia.i = { mass_kg = 0.7, axial_kg_m2 = 0.001, transverse_kg_m2 = 0.001, centre_of_mass_z_mm = 0.0 }
[meshes.ms]
pair = "sp"
pinion_body = "sun"
gear_body = "planet"
[meshes.mr]
pair = "rp"
pinion_body = "planet"
gear_body = "ring"
[bearings.bc]
body = "carrier"
z_mm = 0.0
stiffness = { radial_N_per_m = 1e9, axial_N_per_m = 1e9, tilt_N_m_per_rad = 1e7 }
[bearings.bs]
body = "sun"
z_mm = 0.0
stiffness = { radial_N_per_m = 1e9, axial_N_per_m = 1e9, tilt_N_m_per_rad = 1e7 }
[bearings.br]
body = "ring"
z_mm = 0.0
stiffness = { radial_N_per_m = 1e9, axial_N_per_m = 1e9, tilt_N_m_per_rad = 1e7, torsion_N_m_per_rad = 1e8 }
[bearings.bp]
body = "planet"
on = "carrier"
z_mm = 0.0
stiffness = { radial_N_per_m = 1e9, axial_N_per_m = 1e9, tilt_N_m_per_rad = 1e7 }
[load_cases.steady]
torques_N_m = { carrier = 500.0, sun = -87.5 }
start_speed_rpm = 60.0
duration_s = 1.0
"""
STIFFNESS = {"sp": np.array([4e8]), "rp": np.array([5e8])}
ON_BEARINGS = Choice("bushing", "constant", load_case="steady")


def ring_gearbox(**changes: Any) -> Gearbox:
    gearbox = Gearbox.from_dict(tomllib.loads(RING_CASE), "ring.toml")
    return gearbox.varied({key.replace("__", "."): value for key, value in changes.items()})


def test_the_ring_is_no_second_way_to_roll():
    """Speeds and forces are those of a ring that stands; the file may name it among the locked bodies or not."""
    gearbox = ring_gearbox()
    content = tomllib.loads(RING_CASE)
    del content["bearings"]["br"], content["bodies"]["ring"]["inertia"]
    content["bodies"]["ring"]["fixed"], content["static_load"]["locked"] = True, ["sun"]
    standing = Gearbox.from_dict(content, "standing.toml")
    assert gearbox.train.degrees_of_freedom == 1
    assert gearbox.train.ratio == pytest.approx(1.0 + 99.0 / 21.0)
    assert gearbox.train.ratio == pytest.approx(standing.train.ratio)
    for one in (gearbox, ring_gearbox(static_load__locked=["sun"])):
        assert one.train.static_mesh_forces() == pytest.approx(standing.train.static_mesh_forces())
    assert not gearbox.warnings
    loads = summarise_loads(gearbox, gearbox.load_cases["steady"])
    assert not load_warnings(loads)
    assert abs(loads.end_speed - loads.start_speed) < 1.0


@pytest.mark.sample
@pytest.mark.parametrize("solver", ["compiled", "exudyn"])
def test_a_ring_on_a_torsion_spring_starts_a_run(tmp_path, solver):
    """It twists by its torque over its stiffness, and stays there."""
    gearbox = ring_gearbox()
    assembly = assemble(gearbox, ON_BEARINGS, STIFFNESS)
    start = accelerating_start(assembly, {"carrier": 500.0, "sun": -87.5}, 6.28)
    twist = 500.0 * 99.0 / 120.0 / 1e8
    assert start.q[assembly.spin["ring"]] == pytest.approx(twist, rel=2e-2)
    run = simulate(gearbox, ON_BEARINGS, STIFFNESS, tmp_path, duration=0.01, solver=solver)
    assert run.trusted


def test_static_states_and_modes_know_the_spring():
    assembly = assemble(ring_gearbox(), ON_BEARINGS, STIFFNESS)
    assert static_state(assembly).q[assembly.spin["ring"]] == pytest.approx(500.0 * 99.0 / 120.0 / 1e8, rel=2e-2)
    frequency = modes_of(assembly).frequency
    assert np.sum(frequency < 1.0) == 1  # the train rolls in one way


def test_ideal_joints_have_no_such_spring_and_say_so():
    gearbox = ring_gearbox()
    said = "ring: rotation constrained by the torsion of a bearing or"
    assert said in unsupported(gearbox, "rigid")
    with pytest.raises(VariantError, match=said):
        assemble(gearbox, Choice("rigid", "constant"), STIFFNESS)
