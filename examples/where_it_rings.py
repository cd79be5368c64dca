"""
Where does my gearbox ring?
===========================

A two-stage gearbox is run up from standstill. The waterfall of its transmission error shows the resonances, and the
eigenmodes say what moves in each.
"""

# %%
# The gearbox file is the one that ``exugear new gearbox.toml --kind parallel`` writes. Ten positions of the mesh cycle
# are few, to be quick.

from pathlib import Path

from exugear import Choice, Project, order_lines, plot_campbell, plot_waterfalls, run_waterfall, template
from exugear.results.spectra.resonances import (
    group_by_frequency,
    match_eigenfrequencies,
    pick_resonances,
)

case = Path("results/parallel/gearbox.toml")
case.parent.mkdir(parents=True, exist_ok=True)
case.write_text(template("parallel"))
project = Project.from_toml(case, case.parent, Choice("bushing"))
tables = project.tables(positions=10)

# %%
# The load case of the file accelerates the input to 3000 rpm in ten seconds. A run takes less than that.

run = project.run()
spectra, lines = run_waterfall(run.path), order_lines(project.gearbox)
picks = pick_resonances(spectra, lines, depth=25.0)
plot_waterfalls({"on bearings": spectra}, lines, marks={"on bearings": picks}, highest_frequency=3500.0)

# %%
# Circles are peaks along the orders of the two meshes, down to 25 dB below the highest. Each
# belongs to an eigenmode if one is near.

modes = project.modes()
resonances = group_by_frequency(picks)
nearest = match_eigenfrequencies(resonances, modes.frequency)
for resonance, mode in zip(resonances, nearest, strict=True):
    peak = resonance.picks[0]
    what = "no eigenmode within the resolution" if mode is None else modes.names[mode]
    print(f"{resonance.frequency:6.0f} Hz, {peak.level:5.1f} dB: {what}")

# %%
# The Campbell diagram is the map of what could ring: where a mesh order meets an eigenfrequency.

plot_campbell(modes.frequency[1:], lines, float(spectra.speed.max()), title="two parallel stages")
