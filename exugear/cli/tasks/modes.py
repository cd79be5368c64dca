"""The command `modes`: eigenmodes of a variant at its static load, with a Campbell diagram."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from exugear.cli.console import not_converged_failure
from exugear.cli.tables import HARD_SPACE, Column, Outcome, Table, significant
from exugear.cli.watched import WatchedProject
from exugear.results.findings import Finding
from exugear.results.spectra.run_spectra import report_mode
from exugear.system.modal_damping import damping_in_words
from exugear.system.modes import VISIBLE, unusual_damping
from exugear.system.statics import meshes_near_unconverged
from fe_ste.tools.drawing import drawing_style, finish_figure, new_figure

LEGEND = (
    "Linearised at the static load. TE part.: participation in the overall transmission error (TE), all modes 100 %. "
    "TE amplif.: overall TE at resonance per static TE of the dominant mesh."
)


def modes(project: WatchedProject, as_json: bool, whole: bool) -> None:
    """Compute, store and print the modes of a project."""
    project.begin()
    project.prepare()
    found = project.modes()
    path = project.modes_path
    assembly = found.assembly
    data = found.to_dataset()
    with drawing_style():
        figure = new_figure(7.2, 5.0)
        found.plot(ax=figure.add_subplot())
        figure.suptitle(f"{found.label}\nModes with more than {100 * VISIBLE:g} % TE participation", fontsize=9.5)
        picture = path.with_name("campbell.png")
        finish_figure(figure, picture)
    summary: dict[str, Any] = {
        "case": project.gearbox.source,
        "variant": assembly.variant,
        "mesh_model": assembly.mesh_model,
        "inertias": assembly.inertias,
        "modes": [
            {
                "mode": mode.index + 1,
                "frequency_Hz": mode.frequency,
                "damping_ratio": mode.damping_ratio,
                "te_participation": mode.share,
                "amplification": mode.amplification,
                "name": mode.name,
            }
            for mode in (report_mode(data, index) for index in range(len(found.names)))
        ],
        "file": str(path),
        "picture": str(picture),
    }
    last, first = summary["modes"][-1], max(summary["modes"], key=lambda mode: mode["te_participation"])
    verdict = f"{len(summary['modes'])} modes up to {COLUMNS[1].cell(last)} Hz"
    if first["frequency_Hz"] > 0.0:
        verdict += f"; largest TE participation {COLUMNS[3].cell(first)} %: mode {first['mode']}, "
        verdict += f"{COLUMNS[1].cell(first)} Hz"
    findings = []
    if found.growth_rate > 0.0:
        text = f"unstable: disturbances grow at up to {found.growth_rate:.3g} 1/s; a run would diverge"
        findings.append(Finding("warning", text, found.growth_rate))
    findings += [Finding("warning", text) for text in filter(None, [unusual_damping(found)])]
    damping = damping_in_words(assembly.gearbox.case.damping)
    Outcome(
        verdict=verdict,
        summary=summary,
        tables=[mode_table(summary, whole)],
        findings=findings,
        path=f"{path}, {Path(summary['picture']).name}",
        failure=not_converged_failure(meshes_near_unconverged(assembly)),
        remarks=[f"Housing stiffness factor {assembly.housing_factor:g}; damping {damping}."],
    ).show(as_json, whole)


def _elastic(key: str) -> Any:
    """Return a function that takes a value from the summary of a mode; rigid-body modes have none."""
    return lambda mode: mode[key] if mode["frequency_Hz"] > 0.0 else None


def _energy(number: int, most: int | None) -> Any:
    """Return a function that takes the largest parts of the kinetic or of the strain energy from the name of a mode."""

    def parts(mode: Mapping[str, Any]) -> str:
        listed = mode["name"].replace(" %", "").partition("; strain energy: ")[number].split(", ")
        return ", ".join(part.replace(" ", HARD_SPACE) for part in listed[:most])

    return parts


COLUMNS = (
    Column("mode", "mode"),
    Column("freq.\nHz", "frequency_Hz", partial(significant, digits=3, decimals=1)),
    Column("damping\n%", _elastic("damping_ratio"), ".1f", 100),
    Column("TE\npart. %", _elastic("te_participation"), ".1f", 100),
    Column("TE\namplif.", _elastic("amplification"), ".1f"),
)


def mode_table(summary: Mapping[str, Any], whole: bool) -> Table:
    """Return the table of modes by TE participation with the largest energies, or by frequency with all of them.

    Damping and TE participation are omitted for rigid-body modes, which come last. Modes that participate by round-off
    only are in the order of frequencies.
    """

    def rank(mode: Mapping[str, Any]) -> tuple[bool, float]:
        return mode["frequency_Hz"] == 0.0, -round(mode["te_participation"], 6)

    by = "frequency" if whole else "TE participation"
    rows = summary["modes"] if whole else sorted(summary["modes"], key=rank)
    most = None if whole else 1
    columns = [
        *COLUMNS,
        Column("kinetic energy\n%", _energy(0, most), is_text=True),
        Column("strain energy\n%", _energy(2, most), is_text=True),
    ]
    title = f"Modes by {by}: {summary['variant']}, {summary['mesh_model']}, {summary['inertias']}"
    return Table(title, rows, columns, LEGEND, noun="modes")
