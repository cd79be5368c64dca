"""The commands `import` and `export`: a gearbox file from a REXS file, and results in a copy of that file."""

from __future__ import annotations

from pathlib import Path

from exugear.cli.case import read_gearbox
from exugear.cli.console import BadInputError
from exugear.cli.tables import Outcome
from exugear.exchange.rexs.containers import read_rexs
from exugear.exchange.rexs.export.export import with_results
from exugear.exchange.rexs.to_case.conversion import Imported, to_case
from exugear.exchange.rexs.to_case.loads import SPECTRUM
from exugear.exchange.rexs.to_case.notes import Rules
from exugear.exchange.rexs.tree import RexsError
from exugear.project import results_folder
from exugear.results.findings import Finding
from fe_ste.tools.files import write_file

NAME = "gearbox.toml"
"""Name of the file that an import writes."""


def import_rexs(file: Path, out: Path | None, rules: Rules, as_json: bool, whole: bool) -> None:
    """Write the gearbox file of a REXS file, and the table of its load spectrum."""
    # A REXS file may have two extensions.
    stem = file.name.removesuffix(".zip").removesuffix(".xml").removesuffix(".json").rsplit(".rexs", 1)[0]
    target = (out or Path(stem or "imported")) / NAME
    _refuse_existing(target)
    imported = _imported(file, target, rules)
    if imported.spectrum:
        table = target.with_name(SPECTRUM)
        content = imported.spectrum.encode("utf-8")
        if not (table.is_file() and table.read_bytes() == content):  # as left by an import that was killed
            _refuse_existing(table)
            write_file(table, content)
    write_file(target, imported.text.encode("utf-8"))
    gearbox = imported.gearbox
    lists = {"changed": imported.changed, "checked": imported.checked, "left_out": imported.lost}
    lists["ignored"] = imported.ignored
    besides = len(imported.ignored) - len(imported.lost)
    findings = [
        Finding("warning", line) for line in (*(f"not imported: {line}" for line in imported.lost), *imported.changed)
    ]
    findings.append(Finding("warning", "values marked A in the file are assumed; check them"))
    if besides:
        text = f"also not imported, without effect on results: {besides} lines, listed at the top of {target.name}"
        findings.append(Finding("note", text))
    Outcome(
        verdict=f"{gearbox.name}: {gearbox.train.ratio_text}; {len(gearbox.pairs)} gear pairs, "
        f"{len(gearbox.bearings)} bearings",
        summary={
            "file": str(target),
            "name": gearbox.name,
            "ratio": gearbox.train.ratio,
            **{key: list(lines) for key, lines in lists.items()},
        },
        findings=findings,
        path=target,
    ).show(as_json, whole)


def _refuse_existing(path: Path) -> None:
    if path.exists():
        raise BadInputError(f"{path}: exists already and may have been edited; specify another folder with --out")


def _imported(file: Path, target: Path, rules: Rules) -> Imported:
    try:
        model = read_rexs(file)
        try:
            return to_case(model, file.name, target, rules)
        except RexsError as error:
            raise RexsError(*(f"{file}: {line}" for line in error.errors)) from None
    except RexsError as error:
        raise BadInputError(error) from error


def export_rexs(
    case: Path,
    rexs: Path,
    to: Path | None,
    out: Path | None,
    allow_dir: Path | None,
    rules: Rules,
    as_json: bool,
    whole: bool,
) -> None:
    """Write the results of a gearbox into a copy of its REXS file."""
    target = to or rexs.with_name(_new_name(rexs.name))
    if target.exists():
        raise BadInputError(f"{target}: exists already; specify another file with --to")
    gearbox = read_gearbox(case, allow_dir)
    try:
        exported = with_results(gearbox, results_folder(case, out), rexs, rules)
    except RexsError as error:
        raise BadInputError(error) from error
    write_file(target, exported.content)
    Outcome(
        verdict=f"{exported.named} REXS attributes, {exported.own} custom_exugear_ attributes written",
        summary={
            "file": str(target),
            "attributes": exported.named,
            "custom_attributes": exported.own,
            "replaced": list(exported.replaced),
            "left_out": list(exported.left_out),
        },
        findings=[
            *(Finding("warning", f"not exported: {line}") for line in exported.left_out),
            *(Finding("note", f"replaced: {line}") for line in exported.replaced),
        ],
        path=target,
    ).show(as_json, whole)


def _new_name(name: str) -> str:
    """Name of the copy of a file, which keeps its extensions.

    Examples
    --------
    >>> _new_name("gearbox.rexs"), _new_name("gearbox.rexs.zip")
    ('gearbox-exugear.rexs', 'gearbox-exugear.rexs.zip')
    """
    stem, dot, ends = name.partition(".")
    return f"{stem}-exugear{dot}{ends}"
