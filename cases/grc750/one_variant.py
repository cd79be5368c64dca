"""What rigid.py and bushing.py share: tables, run-up, waterfall and modes of one variant."""

from __future__ import annotations

from pathlib import Path

from arguments import results_folder

from exugear import Choice, Project, order_lines, plot_campbell, plot_waterfalls, run_waterfall
from exugear.results.spectra.resonances import (
    group_by_frequency,
    match_eigenfrequencies,
    pick_resonances,
)
from exugear.transient.outcome import Progress

CASE = Path(__file__).with_name("gearbox.toml")


def compute(variant: str) -> None:
    """Compute what is missing, then print and draw."""
    project = grc_project(Choice(variant))
    project.tables()
    run, modes = project.run(progress=show), project.modes()
    spectra, lines = run_waterfall(run.path), order_lines(project.gearbox)
    picks = pick_resonances(spectra, lines)
    resonances = group_by_frequency(picks)
    print(f"\n{project}; {spectra.description}")
    for resonance, mode in zip(resonances, match_eigenfrequencies(resonances, modes.frequency), strict=True):
        name = "no eigenfrequency within the resolution" if mode is None else modes.names[mode]
        print(f"{resonance.frequency:7.0f} Hz  {resonance.picks[0].level:6.1f} dB  {name}")
    plot_waterfalls({variant: spectra}, lines, run.path.with_name("waterfall.png"), marks={variant: picks})
    fastest = float(spectra.speed.max())
    plot_campbell(modes.frequency[1:], lines, fastest, run.path.with_name("campbell.png"), title=variant)
    print(f"pictures in {run.path.parent}")


def grc_project(choice: Choice) -> Project:
    """Take up the GRC with the results folder that the command line names, results/grc750 without one."""
    return Project.from_toml(CASE, results_folder("results/grc750"), choice)


def show(progress: Progress) -> None:
    """Print how far the run is."""
    text = f"{progress.simulated:6.2f} of {progress.total:g} s, {progress.remaining:4.0f} s left"
    print(f"\r{text}, {progress.speed:.2f} s per s", end="", flush=True)
