"""
How do I bring in my own housing, and how loud is it?
=====================================================

A housing is often available as a STEP file. This example puts one around a helical pair, connects its bearings, and
shows the effect on the modes and the sound power over speed.
"""

# %%
# The STEP file represents your own. It is drawn here with gmsh: two plates with bores for four bearings, on a base
# with a hole along each side for the feet. Its axes are those of the gearbox.

import tomllib
from pathlib import Path

import gmsh
import numpy as np
from matplotlib.figure import Figure

from exugear import Choice, Gearbox, Project, SpeedRange, SteadySettings, template
from exugear.report.pictures.scene import draw_free_vibration

folder = Path("results/housing")
folder.mkdir(parents=True, exist_ok=True)
gmsh.initialize(["housing"], readConfigFiles=False, interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
shape = gmsh.model.occ
pieces = [(3, shape.addBox(-80, -110, z, 350, 200, 24)) for z in (-72, 48)]
pieces += [(3, shape.addBox(-80, -140, -100, 350, 30, 200))]
whole, _ = shape.fuse(pieces[:1], pieces[1:])
holes = [(0, 0, 36), (128, 0, 45), (-55, -125, 10), (245, -125, 10)]  # x, y, radius
shape.cut(whole, [(3, shape.addCylinder(x, y, -200, 0, 0, 400, radius)) for x, y, radius in holes])
shape.synchronize()
gmsh.write(str(folder / "housing.step"))
gmsh.finalize()

# %%
# In the gearbox file, a solid has its file, the element size, and a seat for each connected part. Bearing seats take
# position and size from the bearings; the seats of the feet state them. A bearing is placed in the housing by its key
# ``on``, and mounts connect the housing to the ground. Large elements keep the example short.

foot = {"diameter_mm": 20.0, "width_mm": 200.0}
case = tomllib.loads(template("pair"))
case["bodies"]["housing"] = {
    "fixed": True,
    "axis_position_mm": [0.0, 0.0],
    "flexibility": "elastic",
    "solid": {
        "file": "housing.step",
        "element_size_mm": 40.0,
        "band_Hz": 3000.0,
        "seats": {**{name: {} for name in case["bearings"]}, "left": foot, "right": foot},
    },
}
for bearing in case["bearings"].values():
    bearing["on"] = "housing"
stiffness = {"radial_N_per_m": 1e8, "axial_N_per_m": 1e8, "tilt_N_m_per_rad": 1e6, "torsion_N_m_per_rad": 1e5}
case["mounts"] = {
    "left": {"body": "housing", "position_mm": [-55.0, -125.0, 0.0], "stiffness": stiffness},
    "right": {"body": "housing", "position_mm": [245.0, -125.0, 0.0], "stiffness": stiffness},
}
gearbox = Gearbox.from_dict(case, str(folder / "gearbox.toml"))

# %%
# In the variant ``flexible``, the solid is meshed with tetrahedra and reduced to six coordinates per seat and some
# modal coordinates. The reduction is stored in the results folder.

project = Project(gearbox, folder, Choice("flexible", "iso6336"))
housing = project.bodies()["housing"]
print(housing.reduced)
plot = draw_free_vibration(housing.reduced, 0, folder / "free_vibration.png")
print(f"picture in {folder / 'free_vibration.png'}")

# %%
# These are the natural frequencies of the gearbox on its bearings, in a rigid housing and in this one.

for name, chosen in {"rigid housing": project.chosen(variant="bushing"), "this housing": project}.items():
    modes = chosen.modes()
    frequencies = [f"{frequency:.0f}" for frequency in modes.frequency if 1.0 < frequency < 2000.0]
    print(f"{name}: {', '.join(frequencies)} Hz")

# %%
# The two plates add modes of their own, and the modes of the bearings are shifted.

# %%
# The steady-state response has the velocity of the outer surface, and its sound power as equivalent radiated power: an
# upper estimate. The mesh model needs a table of the transmission error; ten positions and few speeds keep this short.

sounding = project.chosen(mesh_model="line_of_action")
sounding.tables(positions=10)
response = sounding.steady(SteadySettings(SpeedRange.from_text("800:1200:21"), method="linear", at_resonances=False))
level = response["sound_level"].sel(weighting="A")
loudest = int(np.argmax(level.values))
speed = response["speed_rpm"]
print(f"{level.values[loudest]:.0f} dB(A) at {abs(speed.values[loudest]):.0f} rpm")

figure = Figure(figsize=(6.0, 3.0), layout="constrained")
axes = figure.subplots()
axes.plot(abs(speed), level)
axes.set(xlabel="input speed / rpm", ylabel="sound power level / dB(A) re 1 pW")
axes.grid(True)
figure.savefig(folder / "sound_power.png")
print(f"diagram in {folder / 'sound_power.png'}")
