"""
What does planet phasing change?
================================

Whether planets mesh in step is a matter of tooth numbers and places. Planets in step add up in torsion and cancel
across; planets out of step do the opposite.
"""

# %%
# Sun 24, ring 96, three planets: 24 divides by 3, so that all planets mesh in step. Planets fit at every multiple of
# 360/(24 + 96) = 3 degrees. The second design moves two of them by 6 degrees: the same parts, another carrier. Eight
# positions of the mesh cycle are few, to be quick.

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from exugear import Choice, Project, template

case = Path("results/planetary/gearbox.toml")
case.parent.mkdir(parents=True, exist_ok=True)
case.write_text(template("planetary"))
in_step = Project.from_toml(case, case.parent, Choice("bushing"))
tables = in_step.tables(positions=8)
places = [0.0, 126.0, 234.0]
moved = in_step.gearbox.varied({"bodies.planet.planet_angles_deg": places})

# %%
# A planet at the angle psi is 24 psi / 360 mesh cycles behind the first. The sum of the phases is what the torsion
# sees of a harmonic, the sum with the planets' directions is what pushes the sun aside.

for angles in ([0.0, 120.0, 240.0], places):
    angle = np.radians(angles)
    torsion = [abs(np.exp(1j * harmonic * 24 * angle).mean()) for harmonic in (1, 2)]
    across = [abs((np.exp(1j * (harmonic * 24 + 1) * angle)).mean()) for harmonic in (1, 2)]
    print(f"planets at {angles}: torsion {np.round(torsion, 2)}, across {np.round(across, 2)}")

# %%
# The run-up of both. Tables depend on the gears alone, so that both designs share them.

designs = {"in step": in_step, "moved": Project(moved, Path("results/planetary/moved"), Choice("bushing"))}
tables = designs["moved"].tables(positions=8)
figure = Figure(figsize=(9.0, 3.4), layout="constrained")
panels = figure.subplots(1, 2)
for name, design in designs.items():
    with xr.open_dataset(design.run(duration=4.0).path) as run:
        speed = np.abs(run["input_speed"]) * 30.0 / np.pi
        whole = run["overall_dte"] - run["overall_dte"].rolling(time=400, center=True).mean()
        sun = run["support_force"].sel(support="sun")[:, :2]
        aside = np.sqrt((sun**2).sum("axis"))
        panels[0].plot(speed, 1e6 * whole, linewidth=0.4, label=name)
        panels[1].plot(speed, 1e-3 * aside, linewidth=0.4, label=name)
panels[0].set_ylabel("transmission error / um")
panels[1].set_ylabel("force on the bearing of the sun / kN")
for panel in panels:
    panel.set_xlabel("speed of the sun / rpm")
    panel.legend()

# %%
# The transmission error (overall, less its mean) of the second design is a third of the first's. Its sun is pushed
# aside once per mesh cycle, which the first spares its bearings.
