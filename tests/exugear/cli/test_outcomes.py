"""The end of a command: a verdict, one table of ten rows, warnings, the path last; its numbers are those of --json."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from exugear.cli import tables
from exugear.results.findings import Finding
from fe_ste.tools.display import life_text

from ..cases.bearing import BEARING_CASE
from ..cases.command import exugear

pytestmark = pytest.mark.usefixtures("coarse_tables")

LOADED = (
    BEARING_CASE
    + """
[rating]
dynamic_factor = 1.1
viscosity_40_mm2_per_s = 320.0
[rating.gears.pinion]
sigma_H_lim_MPa = 1500.0
sigma_F_lim_MPa = 500.0
curve = "case_hardened"
roughness_Rz_um = 4.8
root_roughness_Rz_um = 16.0
tolerance_class = 6
[rating.gears.wheel]
sigma_H_lim_MPa = 1500.0
sigma_F_lim_MPa = 500.0
curve = "case_hardened"
roughness_Rz_um = 4.8
root_roughness_Rz_um = 16.0
tolerance_class = 6
[loads]
body = "shaft_1"
life_years = 1.0
[loads.sources.drive]
torque_N_m = [100.0, 50.0]
speed_rpm = [1000.0, 1200.0]
hours = [10.0, 200.0]
"""
)
SCALES = [10.0**power for power in (-9, -6, -3, 0, 2, 3, 6)]
"""Factors from the units of JSON to those of a table."""
COMMANDS = {
    "steady": ("steady", "--speeds", "500:1400", "--points", "20"),
    "modes": ("modes",),
    "life": ("life",),
    "check --rating": ("check", "--rating"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a case that has loads and strengths; results are shared."""
    place = tmp_path_factory.mktemp("outcomes")
    (place / "gearbox.toml").write_text(LOADED, encoding="utf-8")
    return place


def numbers(tree: Any) -> Iterator[float]:
    """All numbers of a JSON object."""
    if isinstance(tree, dict):
        tree = tree.values()
    if isinstance(tree, (int, float)):
        yield abs(float(tree))
    elif not isinstance(tree, str) and tree is not None:
        for entry in tree:
            yield from numbers(entry)


def is_known(text: str, values: set[float]) -> bool:
    """Whether a printed number is one of the values, in some unit, at its precision."""
    decimals = len(text.partition(".")[2])
    if float(text) == 0.0 or text in values:
        return True
    scaled = [scale * value for value in values for scale in SCALES]
    if len(text) > 3 and not decimals:  # lives have three digits
        return any(float(f"{value:.3g}") == float(text) or round(value) == int(text) for value in scaled)
    return any(abs(value - float(text)) <= 0.5001 * 10.0**-decimals for value in scaled)


@pytest.mark.validation
@pytest.mark.parametrize("name", COMMANDS)
def test_numbers_of_the_terminal_are_those_of_json(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    verb, *options = COMMANDS[name]
    command = (verb, folder / "gearbox.toml", *options, "--out", folder / "out")
    cells: list[tuple[str, str]] = []

    def spy(table: tables.Table) -> None:
        columns = [column for column in table.columns[1:] if not column.is_text]
        cells.extend((column.heading, column.cell(row)) for row in table.rows for column in columns)

    with monkeypatch.context() as patch:
        patch.setattr(tables, "print_table", spy)
        outcome = exugear(*command)
    assert outcome.exit_code == 0, outcome.stderr
    found = json.loads(exugear(*command, "--json").stdout)
    values = set(numbers(found))
    printed = [(heading, text) for heading, cell in cells for text in re.findall(r"(?<![<>\d.])\d+(?:\.\d+)?", cell)]
    assert len(printed) >= 8
    for heading, text in printed:
        assert is_known(text, values) or re.search(rf"[<>]{re.escape(text)}", " ".join(cell for _, cell in cells)), (
            heading,
            text,
        )


@pytest.mark.validation
def test_the_page_ranks_the_resonances_that_steady_prints(folder: Path) -> None:
    verb, *options = COMMANDS["steady"]
    command = (verb, folder / "gearbox.toml", *options, "--out", folder / "page")
    steady = json.loads(exugear(*command, "--json").stdout)
    report = json.loads(exugear("report", folder / "page", "--json").stdout)
    assert report["resonances"] == steady["resonances"]
    said = {own["text"] for own in report["findings"]}
    assert said >= {own["text"] for own in steady["findings"] if "mesh harmonics" in own["text"]}


def cells_of(page: str, table: str) -> list[dict[str, str]]:
    """Cells of a table of the page by heading."""
    (body,) = re.findall(rf'<table id="{table}".*?</table>', page, re.DOTALL)
    head, rows = body.split("<tbody>")
    plain = [
        [re.sub(r"<[^>]*>", "", cell).strip() for cell in re.findall(r"<t[hd][ >].*?</t[hd]>", row, re.DOTALL)]
        for row in (head, *re.findall(r"<tr.*?</tr>", rows, re.DOTALL))
    ]
    return [dict(zip(plain[0], row, strict=True)) for row in plain[1:]]


SAFETIES = {
    "S_H, FE": "contact_safety",
    "S_F, FE": "root_safety",
    "static S_H": "contact_static",
    "static S_F": "root_static",
}
LIVES = {"L10 / h": "basic_hours", "L10r / h": "reference_hours", "L10m / h": "modified_hours"}


@pytest.mark.validation
def test_lives_and_safety_factors_of_the_page_are_those_of_life(folder: Path) -> None:
    verb, *options = COMMANDS["steady"]
    out = ("--out", folder / "lives")
    assert exugear(verb, folder / "gearbox.toml", *options, *out).exit_code == 0
    life = json.loads(exugear("life", folder / "gearbox.toml", *out, "--json").stdout)
    report = exugear("report", folder / "lives", "--json")
    assert report.exit_code == 0, report.stderr
    page = html.unescape((folder / "lives" / "report.html").read_text(encoding="utf-8"))
    tables_of_life = sorted(re.findall(r'<table id="(life-[^"]*-(?:bearings|gears))"', page))
    assert len(tables_of_life) == 2
    bearings, flanks = (cells_of(page, table) for table in tables_of_life)
    for row, own in zip(flanks, life["flanks"], strict=True):
        for heading, key in SAFETIES.items():
            assert row[heading] == f"{own[key]:.2f}", (own["flank"], heading)
    assert len(bearings) == len(life["bearings"])
    compared = 0
    for row, own in zip(bearings, life["bearings"], strict=True):
        for heading, key in LIVES.items():
            if isinstance(own.get(key), float):
                assert row[heading] == life_text(own[key]), (own["bearing"], heading)
                compared += 1
    assert compared >= 3
    # The list of contacts has the smallest of both gears.
    (contact,) = cells_of(page, "contact-table")
    for heading, key in (("S_H, life", "contact_safety"), ("S_F, life", "root_safety")):
        assert contact[heading] == f"{min(own[key] for own in life['flanks']):.2f}"


def rows_of(count: int) -> tables.Table:
    columns = [tables.Column("row", "row"), tables.Column("more", "row", is_detail=True)]
    return tables.Table("Numbers", [{"row": number} for number in range(count)], columns, noun="numbers")


def printed(outcome: tables.Outcome, capsys: pytest.CaptureFixture[str], whole: bool = False) -> tuple[str, str]:
    """What an outcome prints on standard output and on standard error."""
    outcome.show(as_json=False, whole=whole)
    shown = capsys.readouterr()
    return shown.out, shown.err


def test_an_outcome_is_a_verdict_an_excerpt_and_a_path_and_all_of_it_with_an_option(
    capsys: pytest.CaptureFixture[str],
) -> None:
    findings = [Finding("passed", "closed"), Finding("warning", "beware"), Finding("note", "noted")]
    outcome = tables.Outcome("Fine", {}, [rows_of(12), rows_of(1)], findings, "a/b.nc", remarks=["Explained."])
    lines = printed(outcome, capsys)[0].splitlines()
    assert lines[0] == "Fine" and lines[-1] == "Results: a/b.nc"
    assert lines[-2] == "2 more numbers, 1 more column, 1 more table: --all"
    assert "more" not in "".join(lines[:-2]) and len(lines) == 5 + tables.SHOWN_ROWS + 2
    whole, said = printed(outcome, capsys, whole=True)
    assert said == "Warning: beware\n"
    assert whole.count("Numbers") == 2 and whole.count("more") == 2 and "Explained.\nclosed\nnoted\n" in whole
    assert whole.splitlines()[-1] == "Results: a/b.nc"


def test_further_results_follow_the_verdict_a_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = tables.Outcome("Fine", {}, [rows_of(1)], further=["Loud", "Warm"])
    assert printed(outcome, capsys)[0].splitlines()[:3] == ["Fine", "Loud", "Warm"]


def test_many_warnings_are_counted(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = tables.Outcome("Fine", {}, findings=[Finding("warning", f"number {n}") for n in range(9)])
    assert printed(outcome, capsys)[1].splitlines()[-1] == "and 5 more"
    assert "number 8" in printed(outcome, capsys, whole=True)[1]


def test_an_invalid_result_ends_with_code_1_and_its_path_last(capsys: pytest.CaptureFixture[str]) -> None:
    outcome = tables.Outcome("Bad", {"a": 1}, findings=[Finding("error", "unstable", 2.0)], path="a.nc")
    with pytest.raises(SystemExit) as ended:
        outcome.show(as_json=True, whole=False)
    assert ended.value.code == 1
    shown = capsys.readouterr()
    assert json.loads(shown.out) == {"a": 1, "findings": [{"level": "error", "text": "unstable", "value": 2.0}]}
    assert shown.err == "Failed: unstable\nResults: a.nc\n"
