"""
Which resonances does my gearbox have?
======================================

A two-stage gearbox is run up from standstill. The waterfall of its transmission error shows the resonances, and the
modes show which body vibrates.
"""

# %%
# The gearbox file is that of ``exugear new gearbox.toml --kind parallel``. Ten positions of the mesh cycle keep the
# example short.

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
# The load case accelerates the input to 3000 rpm in ten seconds. The computation takes less time.

run = project.run()
spectra, lines = run_waterfall(run.path), order_lines(project.gearbox)
picks = pick_resonances(spectra, lines, depth=25.0)
print(f"diagrams in {case.parent}")
shown = {"marks": {"on bearings": picks}, "highest_frequency": 3500.0}
plot_waterfalls({"on bearings": spectra}, lines, case.with_name("waterfall.png"), **shown)

# %%
# Circles are peaks along the orders of the two meshes, down to 25 dB below the highest. Each belongs to a mode if one
# is near.

modes = project.modes()
resonances = group_by_frequency(picks)
nearest = match_eigenfrequencies(resonances, modes.frequency)
for resonance, mode in zip(resonances, nearest, strict=True):
    peak = resonance.picks[0]
    what = "no mode within the resolution" if mode is None else modes.names[mode]
    print(f"{resonance.frequency:6.0f} Hz, {peak.level:5.1f} dB: {what}")

# %%
# The Campbell diagram shows all possible resonances: speeds at which a mesh order has a natural frequency.

fastest, picture = float(spectra.speed.max()), case.with_name("campbell.png")
plot_campbell(modes.frequency[1:], lines, fastest, picture, title="two parallel stages")
