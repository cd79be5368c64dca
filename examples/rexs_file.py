"""
My gearbox is a REXS file: what now?
====================================

REXS is the exchange format of the gearbox industry. One call converts it into a commented gearbox file, in which each
value has its source and each assumption is marked.
"""

# %%
# The file is an industrial two-stage gearbox published with the examples of the format.

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
# These are assumptions and replacements of the import, and values that it compared because the file states them twice.

for line in imported.changed[:6]:
    print("assumed: ", line)
for line in imported.checked[:4]:
    print("compared:", line)

# %%
# These are the first lines of a gear. Each value has the REXS attribute as a comment.

lines = imported.text.splitlines()
begin = next(number for number, line in enumerate(lines) if line.startswith("[gears."))
print("\n".join(line[:110] for line in lines[begin : begin + 12]))

# %%
# The variant on ideal joints is available at once. For three bearings the file has only the designation. With boundary
# dimensions from a catalogue, the variant on bearings becomes available.

dimensions = {
    "bearing_1": {"type": "deep_groove_ball", "bore_mm": 50.0, "outer_diameter_mm": 90.0, "width_mm": 20.0},
    "bearing_2": {"type": "tapered_roller", "bore_mm": 70.0, "outer_diameter_mm": 110.0, "width_mm": 31.0},
    "bearing_3": {"type": "tapered_roller", "bore_mm": 60.0, "outer_diameter_mm": 95.0, "width_mm": 27.0},
}
dimensions["bearing_3"]["locates_towards"] = "-z"  # the two tapered ones hold against each other
filled = imported.gearbox.varied({f"bearings.{name}.catalogue": values for name, values in dimensions.items()})

# %%
# These are the modes with the largest participation in the overall transmission error, with the mesh stiffness of ISO
# 6336, which needs no tables.

project = Project(filled, case.parent, Choice("bushing", "iso6336"))
modes = project.modes()
for number in abs(modes.overall).argsort()[::-1][:6]:
    print(f"{modes.frequency[number]:7.1f} Hz  {modes.names[number]}")

# %%
# The amplification is the overall transmission error at resonance per transmission error of the dominant mesh.

figure = Figure(figsize=(7.0, 3.6), layout="constrained")
panel = figure.subplots()
elastic = modes.frequency > 1.0
panel.stem(modes.frequency[elastic], modes.amplification.max(axis=1)[elastic], basefmt=" ")
panel.set(xlim=(0.0, 8000.0), xlabel="natural frequency / Hz", ylabel="amplification")
panel.grid(True)
figure.savefig(case.with_name("amplification.png"))
print(f"diagram in {case.with_name('amplification.png')}")
