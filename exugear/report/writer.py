"""The report of a results folder: one web page that needs nothing else.

`SECTIONS` is the order of the page; a section is a function of the `Material` that gives its `Part`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from exugear.gearbox.named_files import Permissions
from exugear.report.findings.context import Context
from exugear.report.findings.groups import groups_of
from exugear.report.findings.stored import bytes_of_runs, stored_models, with_responses
from exugear.report.findings.variations import begin_variations, model_variations
from exugear.report.findings.words import Words
from exugear.report.parts.material import Material, Part, lines_of
from exugear.report.parts.run_data import run_data
from exugear.report.sections.bearings import bearings_section
from exugear.report.sections.change import change_section
from exugear.report.sections.gears import gears_section
from exugear.report.sections.life import life_section
from exugear.report.sections.modes import modes_section
from exugear.report.sections.near import near_section
from exugear.report.sections.ranking import ranking_section
from exugear.report.sections.rings import rings_section
from exugear.report.sections.short import short_section
from exugear.report.sections.steady import steady_section
from exugear.report.sections.studies import studies_section
from exugear.report.sections.trust import trust_section
from exugear.report.shell import page_body
from exugear.report.web.arrays import ArrayStore
from exugear.report.web.document import whole_page
from exugear.results.folder import REPORT_FILE, kept_case
from fe_ste.tools.files import write_file

SECTIONS: Final[tuple[Callable[[Material], Part], ...]] = (
    short_section,
    rings_section,
    ranking_section,
    change_section,
    bearings_section,
    life_section,
    steady_section,
    modes_section,
    near_section,
    gears_section,
    studies_section,
    trust_section,
)
"""Sections of the page in their order. A new one is a function in ``sections`` and a line here."""
LIBRARIES: Final = ("uPlot.iife.min.js", "three.min.js")
"""Vendored libraries that the page needs."""
WORTH_A_PROCESS: Final = 3e7
"""Bytes of run-ups that take longer to analyse than another process takes to start, a second or two."""


class ReportError(ValueError):
    """A folder that nothing can be reported from."""


@dataclass(frozen=True)
class Report:
    """A report that was written."""

    path: Path
    """The page."""
    statements: tuple[str, ...]
    """What it says in short."""
    left_out: tuple[str, ...]
    """Files that do not belong to the case, and what could not be computed, with the reason."""


def write_report(
    folder: str | Path,
    target: float | None = None,
    tell: Callable[[str], None] | None = None,
    files_below: Path | None = None,
    executor: Executor | None = None,
) -> Report:
    """Write ``report.html`` from what a results folder holds: tables, runs, modes, steady responses.

    Parameters
    ----------
    folder : what ``exugear ste``, ``run``, ``modes`` and ``steady`` wrote into
    target : frequency to look for modes at, Hz; the case's reference frequency by default
    tell : called with what is being done
    files_below
        A further folder that files may lie in which the gearbox file names. Scripts among them never run: what they
        would make must be kept in the folder.
    executor : works beside this process where that saves time, such as `fe_ste.tools.workers.Workers`

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
    material = _material(context, executor)
    parts = [section(material) for section in SECTIONS]
    # The body comes last: sections note what its head tells.
    body = page_body(material, parts)
    data = {**_head_data(material), **_merged(parts)}
    title = f"{gearbox.name}: where it rings, how loud, and why"
    path = folder / REPORT_FILE
    page = whole_page(title, body, "report", data, material.arrays, LIBRARIES)
    write_file(path, page.encode("utf-8", "replace"))
    return Report(path, tuple(context.notes.statements), tuple(context.notes.left_out))


def _material(context: Context, executor: Executor | None) -> Material:
    models = stored_models(context)
    begun = None
    if executor is not None and models.modes and bytes_of_runs(context) > WORTH_A_PROCESS:
        begun = begin_variations(context, models.modes, executor)
    results = with_responses(context, models)
    if not results:
        reasons = context.notes.left_out or ["no files"]
        raise ReportError("\n".join([f"{context.folder}: nothing here belongs to its case", *reasons]))
    groups = groups_of(context, results)
    words = Words(context.gearbox)
    material = Material(context, results, words, groups, (), lines_of(context), ArrayStore())
    # Last what another process computes meanwhile.
    drawn = run_data(material)
    return replace(material, run_data=drawn, variations=model_variations(context, results.modes, begun))


def _head_data(material: Material) -> dict[str, Any]:
    gearbox = material.context.gearbox
    return {
        "name": gearbox.name,
        "input": material.input_words,
        "rated": gearbox.case.operation.rated_speed_rpm,
        "lines": [],
        "groups": [],
        "models": {},
    }


def _merged(parts: list[Part]) -> Mapping[str, Any]:
    """Put the data of all sections together, their figures under ``charts``."""
    merged: dict[str, Any] = {"charts": {}}
    for part in parts:
        for key, value in part.data.items():
            if key == "charts":
                merged["charts"].update(value)
            else:
                merged[key] = value
    return merged
