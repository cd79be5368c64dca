"""
Which uncertain input decides my resonance?
===========================================

A study draws several uncertain inputs at once and shows which of them moves a natural frequency of a two-stage gearbox.
"""

# %%
# The gearbox is that of ``exugear new gearbox.toml --kind parallel``. Two inputs that are seldom known are drawn within
# bounds: the stiffness factor of the housing, and a factor on the inertia of the output shaft. The output is the mode
# nearest to 430 Hz of those that strain the bearing ``middle_right``. The mesh model ``iso6336`` needs no tables.

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from exugear import load_study, run_study, template
from exugear.studies.executors import processes
from exugear.studies.study import Study

folder = Path("results/study")
folder.mkdir(parents=True, exist_ok=True)
(folder / "gearbox.toml").write_text(template("parallel"), encoding="utf-8")
(folder / "inputs.study.toml").write_text(
    """
name = "What decides the resonance"
case = "gearbox.toml"
choice = { variant = "bushing", mesh_model = "iso6336" }
samples = 16

[parameters.housing]
path = "housing.factor"
uniform = { min = 0.2, max = 1.0 }

[parameters.inertia]
path = "bodies.output.inertia.discs.axial_kg_m2"
acts = "scales"
uniform = { min = 0.5, max = 1.3 }

[outputs.resonance]
quantity = "nearest_frequency"
near_Hz = 430.0
element = "middle_right"
""",
    encoding="utf-8",
)
study = Study.from_toml(folder / "inputs.study.toml")
print(study)

# %%
# Finished points are kept: a second call computes nothing. One worker is this process itself; ``exugear study`` uses
# all cores. The results are one dataset.

run_study(study, folder / "points", processes(1))
data = load_study(folder / "points" / "study.nc")
print(
    f"{data['resonance'].size} points, {float(data['resonance'].min()):.0f} to {float(data['resonance'].max()):.0f} Hz"
)

# %%
# The rank correlation between an input and the frequency says which input decides: the stiffness of the bearing seats
# does, since the bearings hold nearly all strain energy of this mode.


def ranks(values):
    """Return the rank of each value."""
    return np.argsort(np.argsort(values))


figure = Figure(figsize=(7.0, 3.0), layout="constrained")
for axes, name in zip(figure.subplots(1, 2, sharey=True), ("housing", "inertia"), strict=True):
    correlation = np.corrcoef(ranks(data[name].values), ranks(data["resonance"].values))[0, 1]
    print(f"{name}: rank correlation {correlation:.2f}")
    axes.plot(data[name], data["resonance"], "o")
    axes.set(xlabel=f"{name} factor", title=f"rank correlation {correlation:.2f}")
    axes.grid(True)
figure.axes[0].set_ylabel("natural frequency / Hz")
figure.savefig(folder / "inputs.png")
print(f"diagram in {folder / 'inputs.png'}")
