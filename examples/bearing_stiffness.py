"""
How much do my bearings matter?
===============================

Gears on elastic bearings have more modes than on ideal joints, and bearing stiffness is often uncertain. This example
varies the seat stiffness of all bearings and shows the natural frequencies.
"""

# %%
# The gearbox has two parallel stages, as written by ``exugear new gearbox.toml --kind parallel``. Its bearings have
# boundary dimensions; their stiffness follows from ISO/TS 16281 at the load of each. The mesh stiffness of ISO 6336
# needs no tables.

import tomllib
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from exugear import Choice, Gearbox, eigenmodes, mesh_stiffness, template

gearbox = Gearbox.from_dict(tomllib.loads(template("parallel")))
stiffness = mesh_stiffness(gearbox, "iso6336")

# %%
# Ideal joints permit rotation only; bearings add all other motions.

for variant in ("rigid", "bushing"):
    modes = eigenmodes(gearbox, Choice(variant, "iso6336"), stiffness)
    elastic = modes.frequency[modes.frequency > 1.0]
    print(f"{variant}: {len(elastic)} modes from {elastic[0]:.0f} to {elastic[-1]:.0f} Hz")

# %%
# ``housing.factor`` is the fraction of a deflection that the bearing takes; the seat takes the rest. A value of 1 is a
# rigid housing. Any key of the gearbox file can be varied by its path.

factors = np.geomspace(0.1, 1.0, 9)
found = []
for factor in factors:
    varied = gearbox.varied({"housing.factor": float(factor)})
    found.append(eigenmodes(varied, Choice("bushing", "iso6336"), stiffness))

# %%
# The size of a point is the participation of the mode in the overall transmission error.

figure = Figure(figsize=(7.0, 4.0), layout="constrained")
panel = figure.subplots()
for factor, modes in zip(factors, found, strict=True):
    seen = np.abs(modes.overall) / np.abs(modes.overall).max()
    shown = (modes.frequency > 1.0) & (modes.frequency < 4000.0)
    size = 4.0 + 120.0 * seen[shown] ** 2
    panel.scatter(np.full(shown.sum(), factor), modes.frequency[shown], s=size, color="C0")
panel.set(xscale="log", xlabel="housing factor", ylabel="natural frequency / Hz")
panel.grid(True)
picture = Path("results/bearing_stiffness.png")
picture.parent.mkdir(exist_ok=True)
figure.savefig(picture)
print(f"diagram in {picture}")

# %%
# Modes that rise to the right depend on bearing stiffness; horizontal ones depend on mesh stiffness. Large points that
# rise are those for which the bearing stiffness must be accurate.
