"""Trains of every kind through all verbs in each variant, and the table of the documentation that tells of it."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.variant import OFFERED
from exugear.project import Project
from exugear.system.tooth_mesh import tables

from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..cases.gear_trains import KINDS
from ..cases.spur import COARSE_INPUT

GUIDE = Path(__file__).parents[3] / "docs" / "reference" / "gear_trains.md"
IN_EACH_CHANGE = ("planetary, ring held", "rotor without gears")
"""Tried with each change of the program; the others before a release.

Pairs of both kinds with phased planets, and a train without tables.
"""
HEAD = "| Kind | Tables | Modes | Runs | Steady state | Report |"


def told() -> dict[str, str]:
    """Rows of the table in the page of gear trains by kind."""
    lines = GUIDE.read_text(encoding="utf-8").split(HEAD)[1].splitlines()
    rows = itertools.takewhile(lambda line: line.startswith("|"), lines[2:])
    return {row.split("|")[1].strip(): row for row in rows}


def test_the_table_of_kinds_has_a_row_for_each() -> None:
    assert list(told()) == list(KINDS)


@pytest.mark.validation
@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=() if kind in IN_EACH_CHANGE else pytest.mark.long) for kind in KINDS]
)
def test_each_kind_goes_through_all_verbs_or_check_says_why_not(kind: str, tmp_path: Path, monkeypatch) -> None:
    content = KINDS[kind]()
    case, folder = tmp_path / "gearbox.toml", tmp_path / "results"
    case.write_text(toml_text(content), encoding="utf-8")
    checked = exugear("check", case, "--json")
    assert checked.exit_code == 0, checked.output
    lacks = json.loads(checked.stdout)
    assert lacks["variants"] == dict.fromkeys(OFFERED, "")
    assert lacks["load_cases"][0]["net_torque_N_m"] == 0.0

    speed = content["load_cases"]["steady"]["start_speed_rpm"]
    options = {"modes": (), "run": (), "steady": ("--speeds", f"{0.9 * speed}:{speed}", "--points", "2")}
    worked: dict[str, list[str]] = {verb: [] for verb in options}
    for variant in OFFERED:
        for verb, further in options.items():
            result = exugear(verb, case, "--variant", variant, *further, "--out", folder)
            reason = lacks["steady"][variant] if verb == "steady" else ""
            assert result.exit_code == (2 if reason else 0), result.output
            assert " ".join(reason.split()) in " ".join(result.output.split())
            worked[verb] += [] if reason else [variant]
    report = exugear("report", folder)
    assert report.exit_code == 0 and "left out" not in report.output.lower(), report.output

    done = ("all" if variants == list(OFFERED) else ", ".join(variants) or "no" for variants in worked.values())
    cells = [kind, _tables(content, folder, monkeypatch), *done, "yes"]
    assert told()[kind] == f"| {' | '.join(cells)} |"


def _tables(content: dict[str, Any], folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Whether all pairs get tables that are solved when the file states no stiffness; coarse ones."""
    monkeypatch.setattr(tables, "TableInput", COARSE_INPUT)
    for pair in content.get("pairs", {}).values():
        del pair["stiffness"]
    found = Project(Gearbox.from_dict(content), folder).tables()
    assert all(not table.failures for table in found.values())
    return "yes" if found else "no"
