"""
Which of two designs is quieter?
================================

Two designs are compared in a run-up: a two-stage gearbox without and with tip relief on its second stage.
"""

# %%
# The gearbox is that of ``exugear new gearbox.toml --kind parallel``. A design is a varied gearbox: any key of the
# file can be replaced. Ten positions of the mesh cycle keep the example short.

import tomllib
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from exugear import Choice, Gearbox, Project, order_lines, run_waterfall, template
from exugear.results.spectra.waterfall import line_level

plain = Gearbox.from_dict(tomllib.loads(template("parallel")))
relief = {"tip_relief_um": 8.0, "tip_relief_length_mm": 6.0}
relieved = plain.varied({"gears.pinion_2.modification": relief, "gears.wheel_2.modification": relief})
designs = {
    "as it is": Project(plain, Path("results/designs/plain"), Choice("bushing")),
    "with relief": Project(relieved, Path("results/designs/relieved"), Choice("bushing")),
}

# %%
# The excitation is the peak-to-peak transmission error of each stage.

for name, project in designs.items():
    for pair, table in project.tables(positions=10).items():
        ste = table.static_state["ste"]
        print(f"{name}, {pair}: {1e6 * float(ste.max() - ste.min()):.3f} um peak to peak")

# %%
# The response is shown as the order cut of each mesh, for both run-ups.

spectra = {name: run_waterfall(project.run().path) for name, project in designs.items()}
lines = order_lines(plain, count=1)
figure = Figure(figsize=(9.0, 3.4), layout="constrained")
for panel, line in zip(figure.subplots(1, len(lines)), lines, strict=True):
    for name, waterfall in spectra.items():
        panel.plot(waterfall.speed * 30.0 / np.pi, line_level(waterfall, line), label=name)
    panel.set(title=line.name, xlabel="input speed / rpm", ylabel="level / dB re 1 um")
    panel.grid(True)
    panel.legend()
figure.savefig("results/designs/order_cuts.png")
print("diagrams in results/designs/order_cuts.png")

# %%
# These are the highest levels of each design, in dB re 1 µm. Tip relief changes the excitation; the resonance speeds
# remain.

for name, waterfall in spectra.items():
    level = 20.0 * np.log10(1e6 * waterfall.amplitude.max())
    print(f"{name}: {level:.1f} dB")
