"""
Which of two designs is quieter?
================================

Two designs are run up side by side: a two-stage gearbox as it is, and with tip relief on its second stage.
"""

# %%
# The two stages of ``exugear new gearbox.toml --kind parallel``. A design is a varied gearbox: any key of the file can
# be replaced. Ten positions of the mesh cycle are few, to be quick.

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
# What the teeth excite: the ripple of the transmission error of each stage.

for name, project in designs.items():
    for pair, table in project.tables(positions=10).items():
        ste = table.static_state["ste"]
        print(f"{name}, {pair}: {1e6 * float(ste.max() - ste.min()):.3f} um peak to peak")

# %%
# What becomes of it in the gearbox: both run-ups, and the level along the order of each mesh.

spectra = {name: run_waterfall(project.run().path) for name, project in designs.items()}
lines = order_lines(plain, count=1)
figure = Figure(figsize=(9.0, 3.4), layout="constrained")
for panel, line in zip(figure.subplots(1, len(lines)), lines, strict=True):
    for name, waterfall in spectra.items():
        panel.plot(waterfall.speed * 30.0 / np.pi, line_level(waterfall, line), label=name)
    panel.set(title=line.name, xlabel="input speed / rpm", ylabel="level / dB re 1 um")
    panel.grid(True)
    panel.legend()

# %%
# The loudest level of each, in dB re 1 um. A relief changes what excites; where the gearbox rings stays where it is.

for name, waterfall in spectra.items():
    level = 20.0 * np.log10(1e6 * waterfall.amplitude.max())
    print(f"{name}: {level:.1f} dB")
