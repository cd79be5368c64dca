"""A helical pair whose pinion sits overhung on a slender shaft: the smallest case with an elastic body that spins."""

from __future__ import annotations

from dataclasses import replace

from exugear.system.system import Assembly

FLOATING_CASE = """
name = "a pinion on a slender shaft"
default_inertias = "disc"
overall = { input = "shaft", output = "wheel", output_gear = "wheel" }
static_load = { torques_N_m = { shaft = 6.0 }, locked = ["wheel"] }
ste = { positions = 8 }
elasticity = { band_Hz = 3000.0, limit_Hz = 5000.0 }

[gears]
pinion = { teeth = 20, normal_module_mm = 3.0, helix_angle_deg = 12.0, face_width_mm = 20.0, held_diameter_mm = 30.0 }
wheel = { teeth = 30, normal_module_mm = 3.0, helix_angle_deg = -12.0, face_width_mm = 20.0, held_diameter_mm = 50.0 }

[pairs]
pair = { pinion = "pinion", gear = "wheel", centre_distance_mm = 76.7 }

[bodies.shaft]
axis_position_mm = [0.0, 0.0]
gears_z_mm = { pinion = 250.0 }
inertia.disc = { mass_kg = 4.0, axial_kg_m2 = 2e-3, transverse_kg_m2 = 2.5e-2, centre_of_mass_z_mm = 150.0 }
flexibility = "ffrf"
[bodies.shaft.shape]
start_z_mm = 0.0
torque_z_mm = 0.0
sections = [{ length_mm = 260.0, outer_diameter_mm = 36.0 }]
blanks = { pinion = { mass_kg = 1.2, axial_kg_m2 = 8e-4, transverse_kg_m2 = 5e-4 } }

[bodies.wheel]
axis_position_mm = [76.7, 0.0]
gears_z_mm = { wheel = 250.0 }
inertia.disc = { mass_kg = 4.0, axial_kg_m2 = 1e-2, transverse_kg_m2 = 8e-3, centre_of_mass_z_mm = 250.0 }

[bodies.motor]
enabled = false
spin_only = true
axis_position_mm = [0.0, 0.0]
inertia.disc = { mass_kg = 1.0, axial_kg_m2 = 2e-3 }

[couplings.clutch]
bodies = ["motor", "shaft"]
stiffness_N_m_per_rad = 2e4

[bearings.left]
body = "shaft"
z_mm = 50.0
stiffness = { radial_N_per_m = 2e7, axial_N_per_m = 2e7, tilt_N_m_per_rad = 1e3 }

[bearings.right]
body = "shaft"
z_mm = 200.0
stiffness = { radial_N_per_m = 2e7, axial_N_per_m = 1e7, tilt_N_m_per_rad = 1e3 }

[bearings.hub]
body = "wheel"
z_mm = 250.0
stiffness = { radial_N_per_m = 5e7, axial_N_per_m = 5e7, tilt_N_m_per_rad = 1e5 }

[meshes]
pair = { pair = "pair", pinion_body = "shaft", gear_body = "wheel" }

[load_cases]
steady = { torques_N_m = { shaft = 6.0, wheel = 9.0 }, duration_s = 0.005, start_speed_rpm = 4000.0 }
run_up = { torques_N_m = { shaft = 6.0, wheel = 6.0 }, duration_s = 0.005, start_speed_rpm = 4000.0 }
"""


def without_floating_frames(assembly: Assembly) -> Assembly:
    """The same reduced bodies on their own coordinates, in the frame that does not turn."""
    bodies = {name: replace(body, floating=None) for name, body in assembly.elastic_bodies.items()}
    return replace(assembly, elastic_bodies=bodies)
