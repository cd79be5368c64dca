"""The command `report`: a web page on a results folder."""

from __future__ import annotations

from contextlib import nullcontext, suppress
from dataclasses import asdict, dataclass, replace
from operator import attrgetter
from pathlib import Path

from exugear.cli.case import check_allow_dir
from exugear.cli.console import BadInputError, FailedError, interruption, model_errors, note, progress_bar
from exugear.cli.resonances import highest_resonance, resonance_table
from exugear.cli.tables import Column, Outcome, Table
from exugear.cli.watched import WatchedProject
from exugear.gearbox.choice import Choice, choice_of
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.reading import GearboxFileError, read_toml
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.project import default_folder, results_folder
from exugear.report.design_study import at_load
from exugear.report.findings.context import ReportError
from exugear.report.findings.design_changes import LEAST_DB, DesignStudy, settings_of_study
from exugear.report.findings.other_design import check_ranges
from exugear.report.findings.words import QUANTITIES
from exugear.report.writer import Report, write_report
from exugear.results.findings import Finding
from exugear.results.folder import CASE_FILE, read_stored_gearbox, stored_source, time_noted, times_spent
from exugear.results.run_file import load_run
from exugear.steady.settings import SteadySettings, operating_speeds
from exugear.steady.steady_file import load_response, settings_of
from exugear.system.gearbox_checks import usual_variant
from exugear.system.modes import load_modes
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.files import FileError
from fe_ste.tools.processes import Workers
from fe_ste.tools.threads import available_cores


@dataclass(frozen=True)
class DesignOptions:
    """Options of the ranking and of design changes."""

    levers: bool
    """Whether design changes are computed."""
    resonance: int | None
    loads: tuple[str, ...]
    quantity: str | None


def report(
    folder: Path,
    near: float | None,
    stored: bool,
    changes: DesignOptions,
    compare: Path | None,
    allow_dir: Path | None,
    as_json: bool,
    whole: bool,
) -> None:
    """Write the report of a results folder and print its highest resonances."""
    check_allow_dir(allow_dir)
    folder = _results_of(folder)
    if not folder.is_dir():
        raise BadInputError(f"{folder}: no such folder; specify the results folder of exugear run")
    if not changes.levers and (changes.resonance is not None or changes.loads):
        raise BadInputError("--resonance and --load are for design changes: add --levers")
    permissions = Permissions(below=allow_dir)
    for load in changes.loads:  # before long work
        at_load(read_stored_gearbox(folder, permissions), load)
    other = None if compare is None else _results_of(compare)
    if other is not None and not other.is_dir():
        raise BadInputError(f"{other}: --compare: no such folder; specify the results folder of another design")
    if other is not None:
        # Another design that cannot be compared is refused before anything is computed.
        try:
            check_ranges(read_stored_gearbox(folder, permissions), read_stored_gearbox(other, permissions))
        except ReportError as error:
            raise BadInputError(error) from error
    if not stored:
        _compute_missing(folder, allow_dir)
    study = _design_changes(folder, allow_dir, changes) if changes.levers else None
    try:
        with (
            time_noted(folder, "report"),
            progress_bar() as bar,
            Workers(1) if available_cores() > 1 else nullcontext() as executor,
        ):
            task = bar.add_task("report", total=None)

            def tell(what: str) -> None:
                interruption.check()
                bar.update(task, description=what)

            written = write_report(folder, near, tell, allow_dir, executor, other, changes.quantity)
    except ReportError as error:
        raise BadInputError(error) from error
    _outcome(folder, written, study).show(as_json, whole)


def _changed_since(folder: Path) -> list[Finding]:
    """Return a warning if the gearbox file has changed since the results in its folder were computed."""
    source = stored_source(folder)
    if source is None or not source.is_file():
        return []
    try:
        if read_toml(source) == read_stored_gearbox(folder).content:
            return []
    except GearboxFileError:  # being edited, or with files that need permission: nothing can be said
        return []
    text = f"{source.name} has changed since these results were computed; for the present one: exugear steady {source}"
    return [Finding("warning", text)]


def _compute_missing(folder: Path, allow_dir: Path | None) -> None:
    """Compute missing modes of all models with results, and a response of the one with most degrees of freedom.

    Modes and responses of another input are missing, too: a report of a changed gearbox would otherwise fall back to an
    estimate. What takes long (tables, contact loss) or fails is left to the report, which lists it with its command.
    """
    models = []
    responses = []
    loaders = {"run.nc": lambda path: load_run(path, ()), "modes.nc": load_modes, "steady-*.nc": load_response}
    for name, load in loaders.items():
        for path in sorted(folder.glob(f"*/*/{name}")):
            with suppress(FileError, ValueError, KeyError):
                attributes = load(path).attrs
                models.append(choice_of(attributes))
                if load is load_response:
                    responses.append(attributes)
    if not models:
        return
    with suppress(BadInputError, FailedError), model_errors():
        project = WatchedProject(read_stored_gearbox(folder, Permissions(below=allow_dir)), folder)
        chosen = {model: replace(project, choice=model) for model in models}
        ready = {
            model: own
            for model, own in chosen.items()
            if LAWS[own.choice.mesh_model].has_force and not own.missing_tables()
        }
        assemblies = {model: own.modes().assembly for model, own in ready.items()}
        linear = [
            own
            for own in ready.values()
            if (law := LAWS[own.choice.mesh_model]).needs_tables and not law.loses_contact  # excited, and linear
        ]
        fits = any(
            choice_of(attributes) in assemblies
            and settings_of(attributes).hash_with(assemblies[choice_of(attributes)]) == attributes["input_hash"]
            for attributes in responses
        )
        if linear and not fits:
            richest = max(linear, key=lambda own: list(Variant).index(own.choice.variant))
            richest.steady(SteadySettings(operating_speeds(project.gearbox)))


def _design_changes(folder: Path, allow_dir: Path | None, changes: DesignOptions) -> DesignStudy:
    """Compute the design changes of the model that the page leads with, or of the usual variant without a response."""
    gearbox = read_stored_gearbox(folder, Permissions(below=allow_dir))
    stored = []
    for path in sorted(folder.glob("*/*/steady-*.nc")):
        with suppress(FileError, ValueError, KeyError):
            choice = choice_of(load_response(path).attrs)
            if choice.inertias == gearbox.case.default_inertias and LAWS[choice.mesh_model].needs_tables:
                stored.append(choice)
    usual = Choice(usual_variant(gearbox))
    leading = max(stored, key=lambda choice: list(Variant).index(choice.variant), default=usual)
    project = WatchedProject(gearbox, folder, leading)
    project.prepare()
    if not stored:  # the page leads with a response
        project.steady(settings_of_study(gearbox))
    number = changes.resonance or 1
    study = project.design_changes(
        lambda done, total, words: note(f"Design change {done + 1} of {total}: {words}"),
        resonance=number,
        quantity=changes.quantity,
        loads=changes.loads,
    )
    if study is None:
        what = "no resonance" if number == 1 else f"no resonance {number}"
        raise BadInputError(f"{folder}: --levers: {what} in the operating range; nothing to reduce")
    return study


def _results_of(folder: Path) -> Path:
    """Return the default results folder of a gearbox file, or of that in a folder if only this one contains results."""
    if folder.suffix == ".toml" and folder.is_file():
        return results_folder(folder)
    below = default_folder(folder / "gearbox.toml")
    if (folder / CASE_FILE).is_file() or not (below / CASE_FILE).is_file() or not any(folder.glob("*.toml")):
        return folder
    note(f"{folder} contains the gearbox file; its results are in {below}")
    return below


def _outcome(folder: Path, written: Report, study: DesignStudy | None) -> Outcome:
    spent = times_spent(folder)
    lists = {name: list(getattr(written, name)) for name in ("statements", "resonances", "missing", "left_out")}
    shown = study or written.design_study
    changes = [{**asdict(one), "recommended": one.recommended} for one in (shown.results if shown else ())]
    found = {"design_changes": changes, "design_changes_loads": list(shown.loads) if shown else []}
    tables = [Table("Run time, last execution of each step", spent, TIMES, "Parallel steps overlap.")]
    verdict = written.statements[0] if written.statements else "No results to summarise"
    if written.headline is not None:
        headline = written.headline
        verdict = highest_resonance(written.gearbox, headline.ranking)
        model = f"{headline.choice.variant}, {headline.source}"
        tables.insert(0, resonance_table(written.gearbox, headline.ranking, model))
    findings = [*_changed_since(folder), *written.findings]
    findings += [Finding("warning", f"skipped: {line}") for line in written.left_out]
    if study is not None:
        tables.insert(0, _changes(study))
    if study is not None and study.requirements:
        more = f"; and {len(study.requirements) - 1} more" if len(study.requirements) > 1 else ""
        text = f"requirements that the unchanged gearbox does not meet: {study.requirements[0]}{more}"
        findings.append(Finding("warning", text))
    checks = {f"{finding.line}." for finding in written.findings}
    return Outcome(
        verdict=verdict,
        summary={"report": str(written.path), **lists, **found, "seconds": {own.step: own.seconds for own in spent}},
        tables=tables,
        findings=findings,
        path=written.path,
        remarks=[
            *(f"- {line}" for line in written.statements if line not in checks),
            *(f"Not computed: {line}" for line in written.missing),
        ],
    )


TIMES = (
    Column("step", attrgetter("step")),
    Column("wall\ntime s", attrgetter("seconds"), ".1f"),
    Column("memory\npeak MB", attrgetter("memory"), ".0f", 1e-6),
)


def _changes(study: DesignStudy) -> Table:
    """Return the table of the recommended changes, and why each other one is not recommended."""
    label = QUANTITIES[study.quantity]
    others = [name for name in QUANTITIES if name != study.quantity and name in study.amplitudes]
    columns = [
        Column("change", "change", is_text=True),
        Column(f"{label.short}\nhere", f"{study.quantity}_this_peak", _decibels, missing="–"),
        *(
            Column(f"{QUANTITIES[name].short}\nrange", f"{name}_highest", _decibels, missing="–")
            for name in (study.quantity, *others)
        ),
        Column("recommended; price", "verdict", is_text=True),
    ]
    rows = []
    for result in study.results:
        verdict = result.refusal or result.objection or ("yes" if result.recommended else "assumption")
        row = {"change": result.change.words, "verdict": "; ".join(filter(None, (verdict, result.price)))}
        for name, effect in result.effects.items():
            row |= {f"{name}_{key}": value for key, value in vars(effect).items()}
        rows.append(row)
    title = f"Design changes for resonance {study.number}, {study.frequency:.3g} Hz at {abs(study.speed) / RPM:.4g} rpm"
    title += f", {study.line}, dB; loads: {', '.join(study.loads)}"
    legend = "here: this peak; range: highest amplitude of any order. Rated: changes that are recommended otherwise."
    return Table(title, rows, columns, legend, noun="changes")


def _decibels(value: float) -> str:
    if value <= LEAST_DB:
        return f"<{LEAST_DB:g}"
    text = f"{value:+.1f}"
    return "0.0" if text in ("+0.0", "-0.0") else text
