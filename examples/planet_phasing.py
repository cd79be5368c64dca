"""
What does planet phasing change?
================================

Tooth numbers and planet positions determine whether planets mesh in phase. In phase, mesh forces add in torsion and
cancel laterally; out of phase, the opposite holds.
"""

# %%
# Sun 24, ring 96, three planets: 24 is divisible by 3, so all planets mesh in phase. Planets can be assembled at every
# multiple of 360/(24 + 96) = 3 degrees. The second design moves two of them by 6 degrees, with the same gears. Eight
# positions of the mesh cycle keep the example short.

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
# A planet at the angle psi lags the first by 24 psi / 360 mesh cycles. The sum of the phases is the torsional
# excitation of a harmonic; the sum weighted by the planet directions is the lateral force on the sun.

for angles in ([0.0, 120.0, 240.0], places):
    angle = np.radians(angles)
    torsion = [abs(np.exp(1j * harmonic * 24 * angle).mean()) for harmonic in (1, 2)]
    across = [abs((np.exp(1j * (harmonic * 24 + 1) * angle)).mean()) for harmonic in (1, 2)]
    print(f"planets at {angles}: torsion {np.round(torsion, 2)}, lateral {np.round(across, 2)}")

# %%
# Both designs are run up. Tables depend on the gears only, so both designs share them.

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
figure.savefig(case.with_name("run_ups.png"))
print(f"diagrams in {case.with_name('run_ups.png')}")

# %%
# The overall transmission error (without its mean) of the second design is a third of the first. Its sun has a lateral
# force once per mesh cycle, which the first design does not have.
