"""
What does a turbine's load do to my bearings?
=============================================

A turbine simulation has ten minutes of torque at some wind speeds. This example counts them over twenty years,
applies them to the static equilibrium of a gearbox, and computes its bearing lives.
"""

# %%
# The gearbox is the GRC 750 kW; the files are those of the NREL 5 MW turbine at 8, 12 and 18 m/s. They are not loads
# of the GRC turbine: the gearbox file scales torque and speed, and every output states it. Hours are those of a
# Rayleigh distribution with a mean wind speed of 8.5 m/s.

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from exugear import Choice, Gearbox, Project, compute_life
from exugear.life.dynamic_factors import stated_factors
from exugear.life.life import checked_loads

gearbox = Gearbox.from_toml("../cases/grc750/gearbox.toml")
counted = checked_loads(gearbox)
for line in counted.remarks:
    print(line)

# %%
# Teeth and rolling bearings rotate through their load: the number of revolutions at each torque counts. The constant
# torque with equal damage depends on the slope of the S-N curve.

found = counted.distribution
for slope, torque in counted.equivalents().items():
    print(f"slope {slope:.3g}: {1e-3 * torque:.0f} kN m of at most {1e-3 * found.upper.max():.0f}")

# %%
# The static equilibrium is solved at twelve carrier angles. The mesh stiffness of ISO 6336 needs no tables, so gears
# have no stresses here. ``exugear life`` computes their tables and rates them as well.

assembly = Project(gearbox, "results/turbine", Choice("bushing", "iso6336")).assembly()
life = compute_life(assembly, counted, {}, stated_factors(gearbox, 1.05), "")
print(f"maximum load sharing factor K_gamma = {life.load_sharing['sun_planet']:.3f}")

# %%
# L10 of ISO 281 is compared with L10r of ISO/TS 16281, which includes tilt, clearance and profile. Both are basic
# lives, without lubricant, cleanliness and ribs.

figure = Figure(figsize=(8.0, 3.6), layout="constrained")
duration, lives = figure.subplots(1, 2)
middle = 0.5e-3 * (found.lower + found.upper)
duration.bar(middle, found.hours, width=1e-3 * np.abs(found.upper - found.lower))
duration.set(xlabel="torque on the carrier / kN m", ylabel="hours in 20 years")
place = np.arange(len(life.bearings))
lives.barh(place - 0.2, [one.basic_hours for one in life.bearings], height=0.4, label="L10")
lives.barh(place + 0.2, [one.reference_hours for one in life.bearings], height=0.4, label="L10r")
lives.axvline(found.hours.sum(), color="0.4", linestyle="--")
lives.set(xscale="log", xlabel="life / h", yticks=place, yticklabels=[one.name for one in life.bearings])
lives.legend()
picture = Path("results/turbine/lives.png")
picture.parent.mkdir(parents=True, exist_ok=True)
figure.savefig(picture)
print(f"diagrams in {picture}")

# %%
# The bearings of the high-speed shaft limit the life: they rotate eighty times as fast as the carrier. The broken line
# is the operating time in twenty years.
