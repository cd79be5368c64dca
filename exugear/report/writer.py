"""Self-contained web page with the report of a results folder: its six parts, headline, controls and footer."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from exugear.gearbox.choice import Choice, choice_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import static_load_in_words
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import (
    Context,
    ReportError,
    StoredResults,
    bytes_of_runs,
    shown_path,
    stored_models,
    with_responses,
)
from exugear.report.findings.design_changes import DesignStudy
from exugear.report.findings.groups import groups_of
from exugear.report.findings.headline import Headline, headline_of
from exugear.report.findings.other_design import read_other_design
from exugear.report.findings.parameter_variations import begin_variations, model_variations
from exugear.report.findings.ratings import ratings_of
from exugear.report.findings.resonance_list import resonance_list
from exugear.report.findings.words import Labels, capitalised
from exugear.report.sections.answer import answer_section
from exugear.report.sections.bearings import bearings_section
from exugear.report.sections.changes import changes_section, stored_study
from exugear.report.sections.gears import gears_section
from exugear.report.sections.material import Part, ReportData
from exugear.report.sections.model import model_section
from exugear.report.sections.resonances import resonances_section
from exugear.report.sections.run_data import run_data
from exugear.report.web.document import ArrayStore, whole_page
from exugear.report.web.html import render
from exugear.results.findings import Finding
from exugear.results.folder import REPORT_FILE, read_stored_gearbox
from exugear.results.spectra.waterfall import order_lines
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.files import write_file


def commands_for_missing(context: Context, results: StoredResults) -> list[str]:
    """List results that the folder lacks, with the commands that compute them.

    These are the modes of each model with other results, and a steady-state response and a run if there is none.
    """
    computed = [choice_of(run.attributes) for run in results.runs]
    computed += [choice_of(data.attrs) for data in results.steady]
    models = list(dict.fromkeys([*computed, *results.modes])) or [Choice()]
    wanted = [("natural frequencies", "modes", model) for model in models if model not in results.modes]
    # The variant with most degrees of freedom comes last in the list of variants.
    richest = max(models, key=lambda model: list(Variant).index(model.variant))
    if not results.steady and LAWS[richest.mesh_model].has_force:
        wanted.append(("steady-state response", "steady", richest))
    if not results.runs:
        wanted.append(("run-up", "run", richest))
    return [
        f"{what}, {model.variant}: {command_line(context.gearbox, context.folder, verb, model)}"
        for what, verb, model in wanted
    ]


def command_line(gearbox: Gearbox, folder: Path, verb: str, model: Choice) -> str:
    """Return a command line for model settings, without options that have their default values."""
    words = ["exugear", verb, shown_path(gearbox.source), "--variant", str(model.variant)]
    usual = Choice(model.variant)
    if model.mesh_model != usual.mesh_model:
        words += ["--mesh-model", model.mesh_model]
    if model.inertias not in (None, gearbox.case.default_inertias):
        words += ["--inertias", str(model.inertias)]
    if verb == "steady" and LAWS[model.mesh_model].loses_contact:
        words += ["--method", "nonlinear"]
    return shlex.join([*words, "--out", shown_path(folder)])


# The report of a results folder as a self-contained web page

SECTIONS: Final[tuple[Callable[[ReportData], Part], ...]] = (
    answer_section,
    resonances_section,
    changes_section,
    bearings_section,
    gears_section,
    model_section,
)
"""The six parts of the page in their order."""
LIBRARIES: Final = ("uPlot.iife.min.js", "three.min.js")
"""Vendored libraries that the page needs."""
WORTH_A_PROCESS: Final = 3e7
"""Size of run-ups (bytes) whose analysis takes longer than the start of another process, a second or two."""


@dataclass(frozen=True)
class Report:
    """Report that was written."""

    path: Path
    statements: tuple[str, ...]
    resonances: tuple[dict[str, Any], ...]
    """Ranking that the page leads with, as `exugear steady` has it in ``--json``; the first is the headline."""
    missing: tuple[str, ...]
    """Results that are not in the folder, each with the command that computes it."""
    left_out: tuple[str, ...]
    """Skipped files that do not belong to the gearbox file, and results that could not be computed, with the reason."""
    gearbox: Gearbox
    headline: Headline | None = None
    """Ranking of the page; None if nothing is ranked."""
    findings: tuple[Finding, ...] = ()
    """Checks of the results that the ranking is from."""
    design_study: DesignStudy | None = None
    """Design changes on the page, computed before."""


def write_report(
    folder: str | Path,
    target: float | None = None,
    tell: Callable[[str], None] | None = None,
    allow_dir: Path | None = None,
    executor: Executor | None = None,
    compare: Path | None = None,
    quantity: str | None = None,
) -> Report:
    """Write ``report.html`` from the content of a results folder: tables, runs, modes, steady-state responses.

    Parameters
    ----------
    folder : output folder of ``exugear ste``, ``run``, ``modes`` and ``steady``
    target : target frequency for modes, Hz; by default the reference frequency of the gearbox file
    tell : callback for progress messages
    allow_dir
        A further permitted folder for files that the gearbox file names. Scripts among them never run: their output
        must be stored in the folder.
    executor : runs tasks in parallel where that saves time, such as `fe_ste.tools.processes.Workers`
    compare : results folder of another design to compare with
    quantity : quantity that ranks the resonances, as `[report] quantity` of the gearbox file, which it replaces

    Raises
    ------
    GearboxFileError
        The folder holds no results.
    ReportError
        None of its tables, modes and runs belongs to its gearbox file, or the other design cannot be compared.
    """
    folder = Path(folder)
    gearbox = read_stored_gearbox(folder, Permissions(below=allow_dir))
    if quantity is not None:
        gearbox = gearbox.varied({"report.quantity": quantity})
    reference = gearbox.case.report.reference_frequency_Hz if target is None else target
    context = Context(folder, gearbox, reference, tell or (lambda what: None))
    material = _material(context, executor)
    if compare is not None:
        material = replace(material, other_design=read_other_design(context, material.headline, compare))
    parts = [section(material) for section in SECTIONS]
    scope = [] if material.rated_rpm is None else [f"rated {material.rated_rpm:g} rpm"]
    scope += [material.words.labelled(static_load_in_words(gearbox)), gearbox.train.ratio_text]
    if material.headline is not None:
        scope += [Variant.of(material.headline.choice.variant).label, material.headline.source]
    # The body is made last, because sections add notes that its head shows.
    body = render(
        "report",
        name=gearbox.name,
        scope=f"{capitalised(', '.join(scope))}.",
        parts=[part for part in parts if part.html],
        notes=context.notes,
        steady=material.headline is not None and material.headline.response is not None,
        source=material.file_words,
    )
    data: dict[str, Any] = {
        "name": gearbox.name,
        "input": material.input_words,
        "rated": material.rated_rpm,
        "lines": [],
        "groups": [],
        "models": {},
        "charts": material.charts,
    }
    for part in parts:
        data |= part.data
    title = f"{gearbox.name}: resonance report"
    path = folder / REPORT_FILE
    page = whole_page(title, body, "report", data, material.arrays, LIBRARIES)
    write_file(path, page.encode("utf-8", "replace"))
    ranked = () if material.headline is None else material.headline.ranking.resonances
    return Report(
        path,
        tuple(context.notes.statements),
        tuple(resonance.summary() for resonance in ranked),
        material.missing,
        tuple(context.notes.left_out),
        gearbox,
        material.headline,
        tuple(context.notes.findings),
        material.design_study,
    )


def _material(context: Context, executor: Executor | None) -> ReportData:
    models = stored_models(context)
    begun = None
    if executor is not None and models.modes and bytes_of_runs(context) > WORTH_A_PROCESS:
        begun = begin_variations(context, models.modes, executor)
    results = with_responses(context, models)
    if not results:
        reasons = context.notes.left_out or ["no files"]
        raise ReportError("\n".join([f"{context.folder}: no results of this gearbox file", *reasons]))
    groups = groups_of(context, results)
    words = Labels(context.gearbox)
    lines = order_lines(context.gearbox)
    headline = headline_of(context, results, groups)
    lists = {(group.name, variant): resonance_list(group, variant) for group in groups for variant in group.runs}
    material = ReportData(context, results, words, groups, (), lines, headline, ArrayStore(), lists)
    # Variations come last; another process may compute them in the meantime.
    drawn = run_data(material)
    return replace(
        material,
        run_data=drawn,
        missing=tuple(commands_for_missing(context, results)),
        ratings=ratings_of(context),
        design_study=stored_study(context),
        variations=model_variations(context, results.modes, begun),
    )
