"""
How much do my bearings matter?
===============================

Gears on ideal joints have fewer modes than gears on bearings, and bearings are seldom known well. This example softens
the seats of all bearings and watches the eigenfrequencies.
"""

# %%
# Two parallel stages, as ``exugear new gearbox.toml --kind parallel`` writes them. Their bearings are given by boundary
# dimensions; the stiffness follows from ISO/TS 16281 at the load that each carries. The mesh stiffness of ISO 6336
# needs no tables.

import tomllib

import numpy as np
from matplotlib.figure import Figure

from exugear import Choice, Gearbox, eigenmodes, mesh_stiffness, template

gearbox = Gearbox.from_dict(tomllib.loads(template("parallel")))
stiffness = mesh_stiffness(gearbox, "iso6336")

# %%
# Ideal joints leave the rotations alone, bearings add everything else.

for variant in ("rigid", "bushing"):
    modes = eigenmodes(gearbox, Choice(variant, "iso6336"), stiffness)
    elastic = modes.frequency[modes.frequency > 1.0]
    print(f"{variant}: {len(elastic)} modes from {elastic[0]:.0f} to {elastic[-1]:.0f} Hz")

# %%
# ``housing.factor`` is the share of a deflection that the bearing takes, the rest is its seat's: 1 is a stiff housing.
# Any key of the gearbox file is varied by its place in the file.

factors = np.geomspace(0.1, 1.0, 9)
found = []
for factor in factors:
    varied = gearbox.varied({"housing.factor": float(factor)})
    found.append(eigenmodes(varied, Choice("bushing", "iso6336"), stiffness))

# %%
# The size of a point is how strongly the overall transmission error sees the mode.

figure = Figure(figsize=(7.0, 4.0), layout="constrained")
panel = figure.subplots()
for factor, modes in zip(factors, found, strict=True):
    seen = np.abs(modes.overall) / np.abs(modes.overall).max()
    shown = (modes.frequency > 1.0) & (modes.frequency < 4000.0)
    size = 4.0 + 120.0 * seen[shown] ** 2
    panel.scatter(np.full(shown.sum(), factor), modes.frequency[shown], s=size, color="C0")
panel.set(xscale="log", xlabel="housing factor", ylabel="eigenfrequency / Hz")
panel.grid(True)

# %%
# Modes that climb to the right live in the bearings; level ones live in the teeth. Large points that climb are those
# for which the bearings must be known well.
