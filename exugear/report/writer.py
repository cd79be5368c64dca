"""The report of a results folder: one web page with its pictures, tables, assumptions, hashes and times.

`SECTIONS` is the order of the page; a section is a function of the `Context` and the `StoredResults`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from exugear.model.named_files import Permissions
from exugear.report import page
from exugear.report.bearings import bearings_section
from exugear.report.context import Context
from exugear.report.inputs import assumptions_section, provenance_section, times_section
from exugear.report.modes import modes_section
from exugear.report.runs import runs_section
from exugear.report.steady import steady_section
from exugear.report.stored import StoredResults, stored_results
from exugear.report.tables import tables_section
from exugear.results.folder import REPORT_FILE, kept_case
from fe_ste.tools.files import write_file

SECTIONS: Final[tuple[Callable[[Context, StoredResults], str], ...]] = (
    runs_section,
    steady_section,
    modes_section,
    bearings_section,
    tables_section,
    times_section,
    provenance_section,
)
"""Sections below the head of the page, in their order; each gives its part of the page, or nothing."""


class ReportError(ValueError):
    """A folder that nothing can be reported from."""


@dataclass(frozen=True)
class Report:
    """A report that was written.

    Attributes
    ----------
    path : Path
        The page.
    statements : tuple of str
        What it says in short.
    left_out : tuple of str
        Files that do not belong to the case, and pictures that could not be made, with the reason.
    pictures : tuple of Path
    """

    path: Path
    statements: tuple[str, ...]
    left_out: tuple[str, ...]
    pictures: tuple[Path, ...]


def write_report(
    folder: str | Path,
    target: float | None = None,
    tell: Callable[[str], None] | None = None,
    files_below: Path | None = None,
) -> Report:
    """Write ``report.html`` from what a results folder holds: tables, runs, modes, pictures.

    Parameters
    ----------
    folder : path
        What ``exugear ste``, ``run`` and ``modes`` wrote into.
    target : float, optional
        Frequency to look for modes at, Hz; the case's reference frequency by default. Without either, modes are listed.
    tell : callable, optional
        Called with what is being done.
    files_below : Path, optional
        A further folder that files may lie in which the gearbox file names. Scripts among them never run: what they
        would make must be kept in the folder.

    Returns
    -------
    Report

    Raises
    ------
    CaseError
        The folder holds no results.
    ReportError
        Neither tables nor modes nor runs in it belong to its case.
    """
    folder = Path(folder)
    gearbox = kept_case(folder, Permissions(below=files_below))
    reference = gearbox.case.report.reference_frequency_Hz if target is None else target
    context = Context(folder, gearbox, reference, tell or (lambda what: None))
    results = stored_results(context)
    if not results:
        raise ReportError(
            "\n".join([f"{folder}: nothing here belongs to its case", *(context.notes.left_out or ["no files"])])
        )
    sections = [section(context, results) for section in SECTIONS]
    # The head comes last: sections note what it tells.
    title = f"{gearbox.name}: transmission error and dynamics"
    path = folder / REPORT_FILE
    write_file(path, page.whole(title, _head(context), *sections).encode("utf-8"))
    notes = context.notes
    return Report(path, tuple(notes.statements), tuple(notes.left_out), tuple(notes.pictures))


def _head(context: Context) -> str:
    """Gather what stands above the sections: warnings, the report in short, what is left out, assumptions."""
    gearbox, notes = context.gearbox, context.notes
    warning = "Runs that are not to be trusted; what follows shows them all the same"
    parts = [
        page.alert(warning, notes.distrusted) if notes.distrusted else "",
        page.paragraph(f"Ratio {gearbox.train.ratio:.6f}; case {gearbox.source}."),
        page.section("In short", page.bullets(notes.statements)),
        page.section("Left out", page.bullets(notes.left_out)) if notes.left_out else "",
        assumptions_section(context),
    ]
    return "".join(parts)
