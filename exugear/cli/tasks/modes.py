"""The command `modes`: eigenmodes of a variant at its static load, with a Campbell diagram."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from exugear.cli.console import print_json, refuse_not_converged, say, warn
from exugear.cli.tables import HARD_SPACE, Column, print_table, print_text
from exugear.cli.watched import WatchedProject
from exugear.results.spectra.run_spectra import report_mode
from exugear.system.modal_damping import damping_in_words
from exugear.system.modes import VISIBLE, Modes, unusual_damping
from exugear.system.statics import meshes_near_unconverged
from fe_ste.tools.drawing import drawing_style, finish_figure, new_figure

LEGEND = (
    "TE part.: squared, mass-normalised participation of the mode in the overall TE (all modes: 100 %). TE amplif.: "
    "overall TE at resonance per static TE of the dominant mesh. TE: transmission error. Energies: largest parts."
)


def modes(project: WatchedProject, as_json: bool) -> None:
    """Compute, store and print the modes of a project."""
    project.begin()
    project.prepare()
    found = project.modes()
    path = project.modes_path
    assembly = found.assembly
    summary = {
        "case": project.gearbox.source,
        "variant": assembly.variant,
        "mesh_model": assembly.mesh_model,
        "inertias": assembly.inertias,
        "modes": mode_summaries(found),
        "file": str(path),
        "picture": str(_draw_campbell(found, path)),
    }
    if found.growth_rate > 0.0:
        warn(f"unstable: disturbances grow at up to {found.growth_rate:.3g} 1/s; a run would diverge")
    if unusual := unusual_damping(found):
        warn(unusual)
    if as_json:
        print_json(summary)
    else:
        print_modes(summary)
        damping = damping_in_words(assembly.gearbox.case.damping)
        factor = assembly.housing_factor
        print_text(f"Linearised at the static load; housing stiffness factor {factor:g}; damping {damping}.")
        say(f"Results: {path}; Campbell diagram: {summary['picture']}")
    refuse_not_converged(meshes_near_unconverged(assembly))


def mode_summaries(found: Modes) -> list[dict[str, Any]]:
    """Summarise each mode."""
    data = found.to_dataset()
    return [
        {
            "mode": mode.index + 1,
            "frequency_Hz": mode.frequency,
            "damping_ratio": mode.damping_ratio,
            "te_participation": mode.share,
            "amplification": mode.amplification,
            "name": mode.name,
        }
        for mode in (report_mode(data, index) for index in range(len(found.names)))
    ]


def _draw_campbell(found: Modes, path: Path) -> Path:
    """Draw the Campbell diagram of modes with participation in the overall transmission error next to their file."""
    with drawing_style():
        figure = new_figure(7.2, 5.0)
        found.plot(ax=figure.add_subplot())
        figure.suptitle(f"{found.label}\nModes with more than {100 * VISIBLE:g} % TE participation", fontsize=9.5)
        picture = path.with_name("campbell.png")
        finish_figure(figure, picture)
    return picture


def _elastic(key: str) -> Any:
    """Return a function that takes a value from the summary of a mode; rigid-body modes have none."""
    return lambda mode: mode[key] if mode["frequency_Hz"] > 0.0 else None


def _energy(number: int) -> Any:
    """Return a function that takes the parts of the kinetic or of the strain energy from the name of a mode."""
    return lambda mode: mode["name"].replace(" %", "").partition("; strain energy: ")[number]


COLUMNS = (
    Column("mode", "mode"),
    Column("freq.\nHz", "frequency_Hz", ".1f"),
    Column("damping\n%", _elastic("damping_ratio"), ".2f", 100),
    Column("TE\npart. %", _elastic("te_participation"), ".2f", 100),
    Column("TE\namplif.", _elastic("amplification"), ".2f"),
    Column(
        "kinetic energy\n%",
        _energy(0),
        lambda text: ", ".join(part.replace(" ", HARD_SPACE) for part in text.split(", ")),
        is_text=True,
    ),
    Column("strain energy\n%", _energy(2), is_text=True),
)


def print_modes(summary: dict[str, Any]) -> None:
    """Print the table of modes; damping and TE participation are omitted for rigid-body modes."""
    title = "Modes: variant {variant}, mesh model {mesh_model}, inertia set {inertias}".format_map(summary)
    print_table(title, summary["modes"], COLUMNS, LEGEND)
