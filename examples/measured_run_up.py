"""
Does my model agree with a measured run-up?
===========================================

A run-up of a test rig is compared with the computed response: order cuts, peaks, and the parameters that explain the
difference. Here a run in time with other seats and other damping takes the place of the test rig.
"""

# %%
# The gearbox is that of ``exugear new gearbox.toml --kind parallel`` with stated mesh stiffness, which needs no tables.
# ``[measurements.bench]`` names the recording, its tacho, and what each channel measured.

from pathlib import Path

import h5py
import numpy as np

from exugear import Choice, Gearbox, Project, load_run, template

case = Path("results/measured/gearbox.toml")
case.parent.mkdir(parents=True, exist_ok=True)
case.write_text(
    template("parallel")
    + """
[pairs.stage_1.stiffness]
mean_N_per_m = 4.5e8
cosine_N_per_m = [18e6, 9e6]
[pairs.stage_2.stiffness]
mean_N_per_m = 8e8
cosine_N_per_m = [32e6, 16e6]

[measurements.bench]
file = "bench.h5"
tacho = { channel = "tacho", shaft = "input" }
harmonics = 2
[measurements.bench.channels.middle]
quantity = "force"
place = "middle_right"
direction = "y"
[measurements.bench.channels.error]
quantity = "transmission_error"
unit = "um"
"""
)

# %%
# The test rig: seats with 0.55 instead of 0.5 of the stiffness, 1.5 instead of 2 % damping, and 5 % noise.

rig = Gearbox.from_toml(case).varied({"housing.factor": 0.55, "damping.modal_percent": 1.5})
itself = Project(rig, "results/measured/rig", Choice("bushing"))
itself.run()
run = load_run(itself.run_path)
rate = (run.sizes["time"] - 1) / float(run["time"][-1] - run["time"][0])
signals = {
    "middle": (run["support_force"].sel(support="middle_right", axis="y").to_numpy(), "N"),
    "error": (1e6 * run["overall_dte"].to_numpy(), "um"),
}
noise = np.random.default_rng(1)
with h5py.File(case.with_name("bench.h5"), "w") as file:
    file.attrs["sample_rate"] = rate
    file["tacho"] = (np.cos(np.cumsum(run["input_speed"].to_numpy()) / rate) > 0.9).astype(float)
    for name, (values, unit) in signals.items():
        file[name] = values + 0.05 * values.std() * noise.standard_normal(values.size)
        file[name].attrs["units"] = unit

# %%
# The comparison: computed resonances are too low, and levels do not speak of damping until they agree.

project = Project.from_toml(case, case.parent, Choice("bushing"))
comparison = project.measured("bench")
print(comparison.verdict)
for finding in comparison.findings:
    print(f"{finding.level}: {finding.text}")

# %%
# Solid lines are measured. Dashed ones are computed: the steady-state response, swept along the measured speed and
# averaged in the same windows. The band is that of plausible damping.

cuts = comparison.plot("error")
picture = case.with_name("cuts.png")
cuts.figure.savefig(picture)
print(f"diagram in {picture}")

# %%
# Which numbers of the file explain it? Both are found within their intervals.

fit = project.fit_measured(comparison, ["housing.factor", "damping.modal_percent"])
for own in fit.parameters:
    print(f"{own.key}: {own.start:g} in the file, {own.value:.4g} fitted ({own.low:.4g} to {own.high:.4g})")
print(f"levels within {fit.before:.2f} dB before and {fit.after:.2f} dB after")
