"""The verb `modes`: eigenmodes of a variant at its static load, with a Campbell diagram."""

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
from exugear.cli.console import exit_codes, note, print_json, print_table, refuse_not_converged, say

if TYPE_CHECKING:
    from exugear.system.modes import Modes


def modes(
    case: CaseArgument,
    variant: VariantOption,
    mesh_model: LawOption = USUAL_LAW,
    inertias: InertiasOption = None,
    out: OutOption = None,
    allow_dir: FilesBelowOption = None,
    scripts: ScriptsOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compute the eigenmodes of a variant at its static load, with a Campbell diagram.

    Tables that are missing or do not fit the case are computed first.
    """
    with exit_codes():
        from exugear.gearbox.choice import Choice
        from exugear.system.statics import meshes_near_unconverged

        project = open_project(case, Choice(variant.value, mesh_model.value, inertias), out, allow_dir, scripts)
        project.begin()
        project.prepare()
        found = project.modes()
        path = project.modes_path
        picture = _draw_campbell(found, path)
        rows = _mode_summaries(found)
        if found.growth_rate > 0.0:
            note(f"Unstable: disturbances grow by up to {found.growth_rate:.3g} 1/s; a run diverges", style="yellow")
        if as_json:
            assembly = found.assembly
            label = {"variant": assembly.variant, "mesh_model": assembly.mesh_model, "inertias": assembly.inertias}
            print_json({"case": str(case), **label, "modes": rows, "file": str(path), "picture": str(picture)})
        else:
            print_table(f"Modes of {found.label}", [_mode_row(row) for row in rows], ("what moves",))
            say(f"Modes in {path}, diagram in {picture}")
        refuse_not_converged(meshes_near_unconverged(found.assembly))


def _draw_campbell(found: Modes, path: Path) -> Path:
    """Draw the modes that the overall transmission error sees, over the speeds of the fastest load case."""
    from exugear.report.pictures.diagrams import plot_campbell
    from exugear.results.spectra.run_spectra import mobility_shares
    from exugear.results.spectra.waterfall import order_lines

    gearbox = found.assembly.gearbox
    least = 1e-3
    shares = mobility_shares(found.to_dataset())
    seen = (found.frequency > 0.0) & (shares >= least)
    highest = max(gearbox.train.mesh_frequencies(1.0).values(), default=0.0)
    top = 1.1 * float(max(found.frequency[seen], default=1.0))
    picture = path.with_name("campbell.png")
    plot_campbell(
        found.frequency[seen],
        order_lines(gearbox),
        top / highest if highest else 1.0,
        picture,
        weights=(shares[seen] / shares.max()) ** 0.5,
        highest_frequency=top,
        title=f"{found.label}: modes with a share over {100 * least:g} %",
    )
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


def _mode_row(summary: dict[str, Any]) -> dict[str, str]:
    return {
        "no.": str(summary["mode"]),
        "Hz": f"{summary['frequency_Hz']:.1f}",
        "damping\n%": f"{100 * summary['damping_ratio']:.2f}",
        "DTE share\n%": f"{100 * summary['te_participation']:.2f}",
        "amplif.": f"{summary['amplification']:.2f}",
        "what moves": summary["name"],
    }
