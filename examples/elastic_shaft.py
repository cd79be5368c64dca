"""
What do elastic shafts change?
==============================

A gear on an overhanging or slender shaft tilts under load. This example gives the middle shaft of a two-stage gearbox
its shape and compares it with a rigid one.
"""

# %%
# The two stages of ``exugear new gearbox.toml --kind parallel``. The shape is a list of cylindrical pieces. Gears and
# bearings of the shaft become its seats; what the wheel adds to the shaft is a ``blank``.

import tomllib
from pathlib import Path

from matplotlib.figure import Figure

from exugear import Choice, Gearbox, Project, static_state, template
from exugear.system.modes import counterparts

rigid_shafts = Gearbox.from_dict(tomllib.loads(template("parallel")))
shape = {
    "start_z_mm": -100.0,
    "sections": [
        {"length_mm": 30.0, "outer_diameter_mm": 40.0},
        {"length_mm": 38.0, "outer_diameter_mm": 60.0},
        {"length_mm": 40.0, "outer_diameter_mm": 50.0},
        {"length_mm": 54.0, "outer_diameter_mm": 60.0},
        {"length_mm": 48.0, "outer_diameter_mm": 40.0},
    ],
    "blanks": {"wheel_1": {"mass_kg": 4.8, "axial_kg_m2": 0.0162, "transverse_kg_m2": 0.0085}},
}
elastic_shaft = rigid_shafts.varied({"bodies.middle.shape": shape, "bodies.middle.flexibility": "elastic"})

# %%
# Both on their bearings, with the mesh stiffness of ISO 6336, which needs no tables. The shaft is meshed over its
# half-section and reduced to six coordinates a seat and a few modal ones; that is kept in the results folder.

folder = Path("results/elastic_shaft")
before = Project(rigid_shafts, folder / "rigid", Choice("bushing", "iso6336"))
after = Project(elastic_shaft, folder / "elastic", Choice("flexible", "iso6336"))
shaft = after.bodies()["middle"]
print(shaft)

# %%
# How far the gears tilt against each other under the static load, as the opening over the face width.

for name, project in {"rigid shafts": before, "elastic middle shaft": after}.items():
    state = static_state(project.assembly())
    for mesh, tilt in zip(state.assembly.mesh_names, state.misalignment, strict=True):
        width = 1e-3 * {"stage_1": 32.0, "stage_2": 50.0}[mesh]
        print(f"{name}, {mesh}: {1e6 * tilt * width:6.2f} um")

# %%
# Modes of both: on the left with rigid shafts, on the right with the elastic one. A line joins modes that are alike in
# shape; what stands alone on the right is the bending of the shaft.

old, new = before.modes(), after.modes()
place, share = counterparts(old, new)
figure = Figure(figsize=(7.0, 4.2), layout="constrained")
panel = figure.subplots()
for number, frequency in enumerate(old.frequency):
    if 1.0 < frequency < 3000.0:
        other = new.frequency[place[number]] if share[number] > 0.5 else float("nan")
        panel.plot((0.0, 1.0), (frequency, other), color="C0", linewidth=1.0)
        print(f"{frequency:7.0f} Hz -> {other:7.0f} Hz  {old.names[number]}")
for side, modes in enumerate((old, new)):
    shown = modes.frequency[(modes.frequency > 1.0) & (modes.frequency < 3000.0)]
    panel.plot([side] * len(shown), shown, "_", color="C1", markersize=26.0, markeredgewidth=2.0)
panel.set(xlim=(-0.3, 1.3), xticks=(0.0, 1.0), ylabel="eigenfrequency / Hz")
panel.set_xticklabels(("rigid shafts", "elastic middle shaft"))
