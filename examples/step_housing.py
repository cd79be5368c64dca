"""
How do I bring in my own housing?
=================================

A housing comes as a STEP file from the design office. This example puts one around a helical pair, tells where its
bearings sit, and looks at what it changes.
"""

# %%
# The STEP file stands for yours. It is drawn here with gmsh: two plates with bores for four bearings, on a base with a
# hole along each side for the feet. The axes of the file are those of the gearbox.

import tomllib
from pathlib import Path

import gmsh

from exugear import Choice, Gearbox, Project, template
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
# In the gearbox file a solid names its file, the size of its elements, and a seat for everything that sits on it. The
# seats of bearings know place and size from the bearings; those of the feet say them. A bearing sits in the housing by
# its key ``on``, and mounts hold the housing on the ground. Large elements are coarse, to be quick.

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
# In the variant ``flexible`` the solid is meshed with tetrahedra and reduced to six coordinates a seat and some modal
# ones. The reduction is kept in the results folder.

project = Project(gearbox, folder, Choice("flexible", "iso6336"))
housing = project.bodies()["housing"]
print(housing.reduced)
plot = draw_free_vibration(housing.reduced, 0)

# %%
# What it changes: the modes of the gearbox on its bearings, in a stiff housing and in this one.

for name, chosen in {"stiff housing": project.chosen(variant="bushing"), "this housing": project}.items():
    modes = chosen.modes()
    frequencies = [f"{frequency:.0f}" for frequency in modes.frequency if 1.0 < frequency < 2000.0]
    print(f"{name}: {', '.join(frequencies)} Hz")

# %%
# The two plates bring modes of their own, and those of the bearings move.
