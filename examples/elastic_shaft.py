"""
What do flexible shafts change?
===============================

A gear on an overhung or slender shaft tilts under load. This example describes the shape of the middle shaft of a
two-stage gearbox and compares the flexible with the rigid shaft.
"""

# %%
# The gearbox is that of ``exugear new gearbox.toml --kind parallel``. The shape is a list of cylinders. Gears and
# bearings on the shaft become seats; the additional mass of the gear body is a ``blank``.

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
# Both variants are on bearings, with the mesh stiffness of ISO 6336, which needs no tables. The shaft is meshed as a
# half-section and reduced to six coordinates per seat and some modal coordinates. The reduction is stored in the
# results folder.

folder = Path("results/elastic_shaft")
before = Project(rigid_shafts, folder / "rigid", Choice("bushing", "iso6336"))
after = Project(elastic_shaft, folder / "elastic", Choice("flexible", "iso6336"))
shaft = after.bodies()["middle"]
print(shaft)

# %%
# This is the misalignment of the gears under the static load, as the gap over the face width.

for name, project in {"rigid shafts": before, "flexible middle shaft": after}.items():
    state = static_state(project.assembly())
    for mesh, tilt in zip(state.assembly.mesh_names, state.misalignment, strict=True):
        width = 1e-3 * {"stage_1": 32.0, "stage_2": 50.0}[mesh]
        print(f"{name}, {mesh}: {1e6 * tilt * width:6.2f} um")

# %%
# The diagram shows the modes with rigid shafts on the left and with the flexible shaft on the right. A line connects
# modes with similar shapes; a mode without a line is a bending mode of the shaft.

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
panel.set(xlim=(-0.3, 1.3), xticks=(0.0, 1.0), ylabel="natural frequency / Hz")
panel.set_xticklabels(("rigid shafts", "flexible middle shaft"))
figure.savefig(folder / "modes.png")
print(f"diagram in {folder / 'modes.png'}")
