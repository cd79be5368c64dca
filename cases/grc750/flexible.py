"""GRC 750 kW gearbox with flexible shafts, carrier and housing on its bearings, next to the variants rigid and bushing.

    python cases/grc750/flexible.py [results folder]

Modes that move and modes that are new, misalignment of each mesh under 240 kN m, run-ups with their waterfalls and
resonances, pictures of flexible modes; and what the main shaft with hub and rotor changes. A flexible carrier turns
with its planets and has damping times; all variants have these here, so that they differ in their bodies alone. Results
go to results/grc750-published by default; tables and reductions that are there already are used again. The solids of
carrier and housing are meshed by gmsh (extra `mesh`) and reduced once, in about a minute; the run-up with all of it
elastic takes some minutes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from one_variant import show
from published import published_project

from exugear import Choice, Modes, Project, order_lines, plot_waterfalls, run_waterfall, static_state
from exugear.report.pictures.scene import (
    animate_elastic_bodies,
    draw_elastic_bodies,
    elastic_scene,
)
from exugear.results.spectra.resonances import (
    Pick,
    group_by_frequency,
    match_eigenfrequencies,
    pick_resonances,
)
from exugear.system.modes import BODY_MOTIONS, counterparts, modes_of

VARIANTS = ("rigid", "bushing", "flexible")
MAIN_SHAFT_MODES = 500.0
"""Modes with the main shaft are listed up to here, Hz: above, both bend and twist for themselves."""
MAIN_SHAFT = {"bodies.main_shaft.enabled": True, "static_load.torques_N_m": {"main_shaft": 240e3}}
"""The option with main shaft, hub and rotor, the torque at its hub."""
WEIGHT = {"gravity.acceleration_m_per_s2": [0.0, -9.773, -0.855]}
"""Gravity with 5 deg of tilt."""
SHAFTS_ALONE = {f"bodies.{name}.flexibility": "none" for name in ("carrier", "housing")}
"""Carrier and housing rigid."""
SOLIDS_EXACT = 600.0
"""Modes with carrier and housing are listed up to here, Hz: the housing's band in gearbox.toml."""
LOUD = 40.0
"""Resonances this far below the loudest, dB, are left out."""
SAME_MODE = 0.5
"""Overlap from which on a mode counts as the same one, moved."""


def main() -> None:
    """Compute what is missing, then print and draw."""
    project = published_project(Choice("flexible"))
    project.tables()
    projects = {variant: project.chosen(variant=variant) for variant in VARIANTS}
    modes = {variant: chosen.modes() for variant, chosen in projects.items()}
    shafts = modes_of_varied(project, SHAFTS_ALONE)
    print_modes(modes["bushing"], shafts, "bushing -> flexible shafts")
    print_modes(shafts, modes["flexible"], "flexible shafts -> carrier and housing flexible, too", SOLIDS_EXACT)
    with_main_shaft = modes_of_varied(project, MAIN_SHAFT)
    print_modes(modes["flexible"], with_main_shaft, "flexible -> flexible with main shaft and rotor", MAIN_SHAFT_MODES)
    print_misalignments(project)
    folder = project.modes_path.parent
    draw_mode(shafts, bending_and_teeth(shafts), folder / "flexible-mode")
    lines, spectra, picks = order_lines(project.gearbox), {}, {}
    for variant, chosen in projects.items():
        spectra[variant] = run_waterfall(chosen.run(progress=show).path)
        picks[variant] = pick_resonances(spectra[variant], lines, depth=LOUD)
        loudest = print_resonances(variant, picks[variant], modes[variant])
    draw_mode(modes["flexible"], loudest, folder / "loudest-mode")
    plot_waterfalls(spectra, lines, folder / "waterfalls.png", marks=picks)
    print(f"pictures in {folder}")


def varied(project: Project, changes: dict[str, object], variant: str = "flexible") -> Project:
    """Return a project with some keys of the gearbox file replaced; tables and reductions stay where they are."""
    return replace(project.chosen(variant=variant), gearbox=project.gearbox.varied(changes))


def modes_of_varied(project: Project, changes: dict[str, object]) -> Modes:
    """Eigenmodes of the variant `flexible` of a varied gearbox, which are not kept."""
    return modes_of(varied(project, changes).assembly())


def print_resonances(variant: str, picks: Sequence[Pick], modes: Modes) -> int:
    """Print resonances of a run-up with their modes; return the mode of the loudest that has one."""
    print(f"\n{variant}: resonances")
    groups = group_by_frequency(picks)
    matches = match_eigenfrequencies(groups, modes.frequency)
    for group, mode in zip(groups, matches, strict=True):
        name = "no eigenfrequency within the resolution" if mode is None else modes.names[mode]
        print(f"{group.frequency:7.0f} Hz  {group.picks[0].level:6.1f} dB  {name}")
    levels = {mode: group.picks[0].level for group, mode in zip(groups, matches, strict=True) if mode is not None}
    return max(levels, key=lambda mode: levels[mode])


def print_modes(before: Modes, after: Modes, title: str, highest: float = np.inf) -> None:
    """Print which modes move when bodies become elastic or are added, and which are new, up to a frequency (Hz)."""
    place, share = counterparts(before, after)
    print(f"{title}, Hz (overlap)")
    for old, new, same in zip(before.frequency, after.frequency[place], share, strict=True):
        if same >= SAME_MODE and 0.0 < new <= highest:
            moved = f"{100.0 * (new / old - 1.0):+5.1f} %" if old > 0.0 else "        "
            print(f"{old:7.1f} {new:7.1f}  {moved}  ({same:.2f})")
    print("in the latter only, or too changed to tell")
    for mode in np.setdiff1d(np.arange(len(after.frequency)), place[share >= SAME_MODE]):
        if 0.0 < after.frequency[mode] <= highest:
            print(f"{after.frequency[mode]:7.1f}  {after.names[mode]}")


def print_misalignments(project: Project) -> None:
    """Print the misalignment of each mesh under the static load, output locked, for more and more flexible bodies."""
    print("misalignment under 240 kN m, output locked, rad / 1e6")
    print_misalignment("bushing", varied(project, SHAFTS_ALONE, "bushing"))
    for name, changes in (("flexible shafts", SHAFTS_ALONE), ("all flexible", {})):
        for more, shaft in (("", {}), (", main shaft", MAIN_SHAFT)):
            print_misalignment(f"{name}{more}", varied(project, {**changes, **shaft}))
            print_misalignment(f"{name}{more}, gravity on", varied(project, {**changes, **shaft, **WEIGHT}))


def print_misalignment(title: str, project: Project) -> None:
    """Print the misalignment of each mesh."""
    state = static_state(project.assembly())
    values = zip(state.assembly.mesh_names, 1e6 * state.misalignment, strict=True)
    print(f"{title}: {', '.join(f'{mesh} {value:.0f}' for mesh, value in values)}")


def bending_and_teeth(modes: Modes) -> int:
    """Find the mode in which bending of shafts and deflection of teeth come together most."""
    bending = modes.kinetic[:, :, BODY_MOTIONS.index("bending")].sum(axis=1)
    meshes = modes.strain[:, [name in modes.assembly.mesh_names for name in modes.element_names]].sum(axis=1)
    return int(np.argmax(bending * meshes))


def draw_mode(modes: Modes, chosen: int, path: Path) -> None:
    """Draw and animate a mode, coloured by strain energy."""
    title = f"{modes.frequency[chosen]:.0f} Hz: {modes.names[chosen]}"
    scene = elastic_scene(modes.assembly, modes.shapes[:, chosen], title=title)
    draw_elastic_bodies(scene, path.with_suffix(".png"))
    animate_elastic_bodies(scene, path.with_suffix(".gif"))


if __name__ == "__main__":
    main()
