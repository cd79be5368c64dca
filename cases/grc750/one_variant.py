"""What rigid.py and bushing.py share: tables, run-up, waterfall and modes of one variant."""

from __future__ import annotations

from pathlib import Path

from exugear.dynamics.modes import eigenmodes
from exugear.model.gearbox import Gearbox
from exugear.pictures.diagrams import plot_campbell, plot_waterfalls
from exugear.results.folder import keep_case
from exugear.runs.outcome import Progress
from exugear.runs.runup import simulate
from exugear.spectra.orders import order_lines, run_waterfall
from exugear.spectra.resonances import group_by_frequency, match_eigenfrequencies, pick_resonances
from exugear.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.tooth_mesh.tables import requested_tables

LAW = "line_of_action"


def compute(variant: str, out: Path) -> None:
    """Compute what is missing, then print and draw."""
    gearbox = Gearbox.from_toml(Path(__file__).with_name("gearbox.toml"))
    for request in requested_tables(gearbox, out):
        _ = request.stored or request.compute()
    keep_case(gearbox, out)
    stiffness = mesh_stiffness(gearbox, LAW, out)
    run = simulate(gearbox, variant, stiffness, out, mesh_law=LAW, progress=show)
    modes = eigenmodes(gearbox, variant, stiffness, LAW)
    modes.save(run.path.with_name("modes.nc"))
    spectra, lines = run_waterfall(run.path), order_lines(gearbox)
    picks = pick_resonances(spectra, lines)
    found = group_by_frequency(picks)
    print(f"\nvariant {variant}, law {LAW}, inertias {modes.assembly.inertias}; {spectra.description}")
    for resonance, mode in zip(found, match_eigenfrequencies(found, modes.frequency), strict=True):
        name = "no eigenfrequency within the resolution" if mode is None else modes.names[mode]
        print(f"{resonance.frequency:7.0f} Hz  {resonance.picks[0].level:6.1f} dB  {name}")
    plot_waterfalls({variant: spectra}, lines, run.path.with_name("waterfall.png"), marks={variant: picks})
    fastest = float(spectra.speed.max())
    plot_campbell(modes.frequency[1:], lines, fastest, run.path.with_name("campbell.png"), title=variant)
    print(f"pictures in {run.path.parent}")


def show(progress: Progress) -> None:
    """Print how far the run is."""
    text = f"{progress.simulated:6.2f} of {progress.total:g} s, {progress.remaining:4.0f} s left"
    print(f"\r{text}, {progress.speed:.2f} s per s", end="", flush=True)
