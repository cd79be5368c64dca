"""The command `modes`: eigenmodes of a variant at its static load, with a Campbell diagram."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from exugear.cli.case import (
    USUAL_LAW,
    CaseArgument,
    FilesBelowOption,
    InertiasOption,
    JsonOption,
    LawOption,
    OutOption,
    ScriptsOption,
    VariantOption,
    open_project,
)
from exugear.cli.console import exit_codes, note, print_json, refuse_not_converged, say
from exugear.cli.tables import HARD_SPACE, print_table, print_text

if TYPE_CHECKING:
    from exugear.system.modes import Modes

LEGEND = (
    "TE part.: squared, mass-normalised participation of the mode in the overall TE (all modes: 100 %). TE amplif.: "
    "overall TE at resonance per static TE of the dominant mesh. TE: transmission error. Energies: largest parts."
)
_STRAIN = "; strain energy: "


def modes(
    case: CaseArgument,
    variant: VariantOption = None,
    mesh_model: LawOption = USUAL_LAW,
    inertias: InertiasOption = None,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compute eigenmodes and a Campbell diagram.

    The variant is linearised at the static load. Transmission error tables that are missing or out of date are computed
    first.
    """
    with exit_codes():
        from exugear.system.modes import unusual_damping
        from exugear.system.statics import meshes_near_unconverged

        project = open_project(case, out, allow_dir, scripts, variant, mesh_model, inertias)
        project.begin()
        project.prepare()
        found = project.modes()
        path = project.modes_path
        picture = _draw_campbell(found, path)
        rows = _mode_summaries(found)
        if found.growth_rate > 0.0:
            note(
                f"Warning: unstable: disturbances grow at up to {found.growth_rate:.3g} 1/s; a run would diverge",
                style="yellow",
            )
        if unusual := unusual_damping(found):
            note(f"Warning: {unusual}", style="yellow")
        if as_json:
            assembly = found.assembly
            label = {"variant": assembly.variant, "mesh_model": assembly.mesh_model, "inertias": assembly.inertias}
            print_json({"case": str(case), **label, "modes": rows, "file": str(path), "picture": str(picture)})
        else:
            _print_modes(found, rows)
            say(f"Results: {path}; Campbell diagram: {picture}")
        refuse_not_converged(meshes_near_unconverged(found.assembly))


def _draw_campbell(found: Modes, path: Path) -> Path:
    """Draw the Campbell diagram of modes with participation in the overall transmission error next to their file."""
    from exugear.system.modes import VISIBLE
    from fe_ste.tools.drawing import drawing_style, finish_figure, new_figure

    with drawing_style():
        figure = new_figure(7.2, 5.0)
        found.plot(ax=figure.add_subplot())
        figure.suptitle(f"{found.label}\nModes with more than {100 * VISIBLE:g} % TE participation", fontsize=9.5)
        picture = path.with_name("campbell.png")
        finish_figure(figure, picture)
    return picture


def _mode_summaries(found: Modes) -> list[dict[str, Any]]:
    from exugear.results.spectra.run_spectra import report_mode

    data = found.to_dataset()
    reports = [report_mode(data, index) for index in range(len(found.names))]
    return [
        {
            "mode": mode.index + 1,
            "frequency_Hz": mode.frequency,
            "damping_ratio": mode.damping_ratio,
            "te_participation": mode.share,
            "amplification": mode.amplification,
            "name": mode.name,
        }
        for mode in reports
    ]


def _print_modes(found: Modes, rows: list[dict[str, Any]]) -> None:
    """Print the table of modes; damping and TE participation are omitted for rigid-body modes."""
    from exugear.system.modal_damping import damping_in_words

    assembly = found.assembly
    title = f"Modes: variant {assembly.variant}, mesh model {assembly.mesh_model}, inertia set {assembly.inertias}"
    texts = ("kinetic energy\n%", "strain energy\n%")
    print_table(title, [_mode_row(row) for row in rows], texts, LEGEND)
    factor = assembly.housing_factor
    damping = damping_in_words(assembly.gearbox.case.damping)
    print_text(f"Linearised at the static load; housing stiffness factor {factor:g}; damping {damping}.")


def _mode_row(summary: dict[str, Any]) -> dict[str, str]:
    kinetic, _, strain = str(summary["name"]).replace(" %", "").partition(_STRAIN)
    kinetic = ", ".join(part.replace(" ", HARD_SPACE) for part in kinetic.split(", "))
    damping = share = amplification = "-"
    if summary["frequency_Hz"] > 0.0:
        damping = f"{100 * summary['damping_ratio']:.2f}"
        share = f"{100 * summary['te_participation']:.2f}"
        amplification = f"{summary['amplification']:.2f}"
    return {
        "mode": str(summary["mode"]),
        "freq.\nHz": f"{summary['frequency_Hz']:.1f}",
        "damping\n%": damping,
        "TE\npart. %": share,
        "TE\namplif.": amplification,
        "kinetic energy\n%": kinetic,
        "strain energy\n%": strain,
    }
