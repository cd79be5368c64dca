"""
My gearbox is a REXS file: what now?
====================================

REXS is the exchange format of the gearbox industry. One call makes a commented gearbox file of it, in which each value
names its source and each assumption is marked.
"""

# %%
# The file is an industrial two-stage gearbox published with the format's own examples.

from pathlib import Path

from matplotlib.figure import Figure

from exugear import Choice, Project, read_rexs, to_case

source = Path("../tests/exugear/exchange/rexs/data/FVA-Industriegetriebe_2stufig_1-4.rexs")
imported = to_case(read_rexs(source), source.name)
case = Path("results/rexs/gearbox.toml")
case.parent.mkdir(parents=True, exist_ok=True)
case.write_text(imported.text)
print(imported.gearbox)

# %%
# What the import had to assume or replace, and what it compared because the file says it twice.

for line in imported.changed[:6]:
    print("assumed: ", line)
for line in imported.checked[:4]:
    print("compared:", line)

# %%
# The first lines on a gear. Behind each value stands the attribute that gives it.

lines = imported.text.splitlines()
begin = next(number for number, line in enumerate(lines) if line.startswith("[gears."))
print("\n".join(line[:110] for line in lines[begin : begin + 12]))

# %%
# The case runs as it is on ideal joints. Of three bearings the file knows the designation alone; they are blanks. With
# the boundary dimensions from a catalogue the gearbox stands on its bearings.

dimensions = {
    "bearing_1": {"type": "deep_groove_ball", "bore_mm": 50.0, "outer_diameter_mm": 90.0, "width_mm": 20.0},
    "bearing_2": {"type": "tapered_roller", "bore_mm": 70.0, "outer_diameter_mm": 110.0, "width_mm": 31.0},
    "bearing_3": {"type": "tapered_roller", "bore_mm": 60.0, "outer_diameter_mm": 95.0, "width_mm": 27.0},
}
dimensions["bearing_3"]["locates_towards"] = "-z"  # the two tapered ones hold against each other
filled = imported.gearbox.varied({f"bearings.{name}.catalogue": values for name, values in dimensions.items()})

# %%
# The modes that the overall transmission error sees best, with the mesh stiffness of ISO 6336, which needs no tables.

project = Project(filled, case.parent, Choice("bushing", "iso6336"))
modes = project.modes()
for number in abs(modes.overall).argsort()[::-1][:6]:
    print(f"{modes.frequency[number]:7.1f} Hz  {modes.names[number]}")

# %%
# How strongly the overall transmission error answers to each mode, per error of the mesh that excites it most.

figure = Figure(figsize=(7.0, 3.6), layout="constrained")
panel = figure.subplots()
elastic = modes.frequency > 1.0
panel.stem(modes.frequency[elastic], modes.amplification.max(axis=1)[elastic], basefmt=" ")
panel.set(xlim=(0.0, 8000.0), xlabel="eigenfrequency / Hz", ylabel="amplification")
panel.grid(True)
