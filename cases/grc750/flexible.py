"""GRC 750 kW gearbox with elastic shafts and housing on its bearings, beside the variants rigid and bushing.

    python cases/grc750/flexible.py [results folder]

Modes that move and modes that are new, misalignment of each mesh under 240 kN m, run-ups with their waterfalls and
resonances, pictures of a flexible mode. Results go to results/grc750 by default; what is there already is used again.
The housing's solid is meshed by gmsh (extra `mesh`) and reduced once, in about a minute.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from textwrap import fill

import numpy as np

from exugear.assembly import assemble
from exugear.elastic_scene import animate_elastic_bodies, draw_elastic_bodies, elastic_scene
from exugear.gearbox import Gearbox
from exugear.mesh_element import MeshData
from exugear.mesh_stiffness import mesh_stiffness
from exugear.modes import MOTIONS, Modes, counterparts, eigenmodes
from exugear.orders import order_lines, run_waterfall
from exugear.plots import plot_waterfalls
from exugear.results import bodies_folder, modes_path
from exugear.runup import Progress, simulate
from exugear.spectra import group_by_frequency, match_eigenfrequencies, pick_resonances
from exugear.statics import locked_equilibrium
from exugear.tables import order_tables

VARIANTS = ("rigid", "bushing", "flexible")
LAW = "line_of_action"
SAME_MODE = 0.5
"""Overlap with a mode on rigid shafts from which on a mode counts as the same one, moved."""


def main(out: Path) -> None:
    """Compute what is missing, then print and draw."""
    gearbox = Gearbox.from_toml(Path(__file__).with_name("gearbox.toml"))
    for order in order_tables(gearbox, out):
        _ = order.stored or order.fill()
    stiffness = mesh_stiffness(gearbox, LAW, out)
    modes = {variant: eigenmodes(gearbox, variant, stiffness, LAW, folder=bodies_folder(out)) for variant in VARIANTS}
    for variant, found in modes.items():
        found.save(modes_path(out, variant, LAW, found.assembly.inertias))
    print_modes(modes["bushing"], modes["flexible"])
    print_misalignments(gearbox, stiffness, bodies_folder(out))
    folder = modes_path(out, "flexible", LAW, modes["flexible"].assembly.inertias).parent
    draw_flexible_mode(modes["flexible"], folder)
    lines, spectra, picks = order_lines(gearbox), {}, {}
    for variant in VARIANTS:
        run = simulate(gearbox, variant, stiffness, out, mesh_law=LAW, progress=show)
        spectra[variant] = run_waterfall(run.path)
        picks[variant] = pick_resonances(spectra[variant], lines)
        groups = group_by_frequency(picks[variant])
        print(f"\n{variant}: resonances")
        for group, mode in zip(groups, match_eigenfrequencies(groups, modes[variant].frequency), strict=True):
            name = "no eigenfrequency within the resolution" if mode is None else modes[variant].names[mode]
            print(f"{group.frequency:7.0f} Hz  {group.picks[0].level:6.1f} dB  {name}")
    plot_waterfalls(spectra, lines, folder / "waterfalls.png", marks=picks)
    print(f"pictures in {folder}")


def print_modes(rigid: Modes, flexible: Modes) -> None:
    """Print which modes move when bodies become elastic, and which are new."""
    place, share = counterparts(rigid, flexible)
    print("bushing -> flexible, Hz (overlap)")
    for n, (mode, same) in enumerate(zip(place, share, strict=True)):
        if same >= SAME_MODE and rigid.frequency[n] > 0.0:
            moved = 100.0 * (flexible.frequency[mode] / rigid.frequency[n] - 1.0)
            print(f"{rigid.frequency[n]:7.0f} {flexible.frequency[mode]:7.0f}  {moved:+5.1f} %  ({same:.2f})")
    print("in flexible only, or too changed to tell")
    for mode in np.setdiff1d(np.arange(len(flexible.frequency)), place[share >= SAME_MODE]):
        print(f"{flexible.frequency[mode]:7.0f}  {flexible.names[mode]}")


def print_misalignments(gearbox: Gearbox, stiffness: Mapping[str, MeshData], folder: Path) -> None:
    """Print the misalignment of each mesh under the static load, output locked, for more and more elastic bodies."""
    print("misalignment under 240 kN m, output locked, rad / 1e6")
    rigid = gearbox.varied({f"bodies.{name}.flexibility": "none" for name in ("carrier", "housing")})
    cases = {"bushing": (rigid, "bushing"), "elastic shafts": (rigid, "flexible"), "all elastic": (gearbox, "flexible")}
    for name, (case, variant) in cases.items():
        assembly = assemble(case, variant, stiffness, LAW, folder=folder)
        load = case.case.static_load
        q = locked_equilibrium(assembly, load.torques_N_m, load.locked, assembly.mean_meshes)
        values = 1e6 * assembly.gear_positions(q)[:, 1]
        words = ", ".join(f"{mesh} {value:.0f}" for mesh, value in zip(assembly.mesh_names, values, strict=True))
        print(f"{name}: {words}")


def draw_flexible_mode(modes: Modes, folder: Path) -> None:
    """Draw and animate the mode in which bending of shafts and deflection of teeth come together most."""
    bending = modes.kinetic[:, :, MOTIONS.index("bending")].sum(axis=1)
    meshes = modes.strain[:, [name in modes.assembly.mesh_names for name in modes.element_names]].sum(axis=1)
    chosen = int(np.argmax(bending * meshes))
    title = fill(f"{modes.frequency[chosen]:.0f} Hz: {modes.names[chosen]}", 90)
    scene = elastic_scene(modes.assembly, modes.shapes[:, chosen], title=title)
    draw_elastic_bodies(scene, folder / "flexible-mode.png")
    animate_elastic_bodies(scene, folder / "flexible-mode.gif")


def show(progress: Progress) -> None:
    """Print how far the run is."""
    text = f"{progress.simulated:6.2f} of {progress.total:g} s, {progress.remaining:4.0f} s left"
    print(f"\r{text}, {progress.speed:.2f} s per s", end="", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("results/grc750"))
