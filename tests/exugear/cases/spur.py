"""A pair of spur gears on ideal joints or soft bearings that runs through its resonance: the smallest case there is."""

from __future__ import annotations

import functools

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.transmission_error.table import TableInput

COARSE_INPUT = functools.partial(
    TableInput, mesh=MeshSettings(layers=4, flank=8, thickness=6), contact=ContactSettings(slices=8)
)
"""Few elements a tooth: what the numbers of a table are worth is tested elsewhere."""

SPUR_CASE = """
name = "one spur pair"
default_inertias = "disc"
overall = { input = "shaft_1", output = "shaft_2", output_gear = "wheel" }
static_load = { torques_N_m = { shaft_1 = 100.0 }, locked = ["shaft_2"] }
ste = { positions = 8 }
housing = { factor = 0.5 }

[gears]
pinion = { teeth = 20, normal_module_mm = 3.0, face_width_mm = 15.0, held_diameter_mm = 30.0 }
wheel = { teeth = 30, normal_module_mm = 3.0, face_width_mm = 15.0, held_diameter_mm = 50.0 }

[pairs]
spur = { pinion = "pinion", gear = "wheel", centre_distance_mm = 75.0 }

[bodies.shaft_1]
axis_position_mm = [0.0, 0.0]
gears_z_mm = { pinion = 0.0 }
inertia.disc = { mass_kg = 1.0, axial_kg_m2 = 1e-2, transverse_kg_m2 = 1e-2, centre_of_mass_z_mm = 0.0 }

[bodies.shaft_2]
axis_position_mm = [75.0, 0.0]
gears_z_mm = { wheel = 0.0 }
inertia.disc = { mass_kg = 2.0, axial_kg_m2 = 3e-2, transverse_kg_m2 = 3e-2, centre_of_mass_z_mm = 0.0 }

[joints]
joint_1 = { body = "shaft_1", z_mm = 0.0 }
joint_2 = { body = "shaft_2", z_mm = 0.0 }

[bearings.bearing_1]
body = "shaft_1"
z_mm = 0.0
stiffness = { radial_N_per_m = 2e7, axial_N_per_m = 1e8, tilt_N_m_per_rad = 1e6 }

[bearings.bearing_2]
body = "shaft_2"
z_mm = 0.0
stiffness = { radial_N_per_m = 2e7, axial_N_per_m = 1e8, tilt_N_m_per_rad = 1e6 }

[meshes]
spur = { pair = "spur", pinion_body = "shaft_1", gear_body = "shaft_2" }

[load_cases]
run_up = { torques_N_m = { shaft_1 = 100.0, shaft_2 = 140.0 }, duration_s = 1.0 }
"""
