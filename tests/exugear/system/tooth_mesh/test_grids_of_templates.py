"""Grids of the templates end with every state solved, and the law `table` computes with them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.system.tooth_mesh.tables import fitting_table
from fe_ste.transmission_error.states import CUT_OFF

from ...cases.command import exugear
from ...cases.spur import COARSE_INPUT

WIDE = (
    "\n[ste]\npositions = {positions}\ntorque_factors = {loads}\n"
    "centre_distance_offsets_um = {offsets}\nmisalignment_um = [-60.0, -30.0, 0.0, 30.0, 60.0]\n"
)
"""Axes that templates had by themselves, and of which 55, 116 and 24 states a pair were not solved."""


def case_of(folder: Path, kind: str, **axes: Any) -> Path:
    path = folder / "gearbox.toml"
    text = template(kind)
    assert "[ste]" not in text
    path.write_text(text + (WIDE.format(**axes) if axes else ""), encoding="utf-8")
    return path


def check_verbs(case: Path, out: Path, *ste: object) -> list[dict[str, Any]]:
    """Tables, modes and a run by the law `table`, each with exit code 0; return what is said of the tables."""
    invoked = [
        exugear(*arguments, "--json", "--out", out)
        for arguments in (
            ("ste", case, "--grid", *ste),
            ("modes", case, "--variant", "bushing", "--mesh-model", "table"),
            ("run", case, "--variant", "bushing", "--mesh-model", "table", "--duration", 0.01),
        )
    ]
    assert [one.exit_code for one in invoked] == [0, 0, 0], [one.output for one in invoked]
    assert json.loads(invoked[2].stdout)["longest_interpolation_time_s"] == 0.0
    return list(json.loads(invoked[0].stdout)["tables"])


@pytest.mark.parametrize("kind", ["pair", pytest.param("planetary", marks=pytest.mark.long)])
def test_states_that_come_to_form_circles_are_solved(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fewer elements and positions; the centre distance goes where tips come nearest to their mates' roots."""
    monkeypatch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
    case = case_of(tmp_path, kind, positions=8, loads=[0.2, 1.0, 3.0], offsets=[-100.0, 0.0, 100.0])
    gearbox = Gearbox.from_toml(case)
    tables = check_verbs(case, tmp_path / "out")
    assert len(tables) == len(gearbox.pairs)
    for table in tables:
        assert table["states"] == 8 * 3 * 3 * 5 and table["not_converged"] == 0
        assert table["largest_share_cut_off"] < 5e-3
        data = fitting_table(gearbox, table["pair"], tmp_path / "out", grid=True).dataset
        assert table["cut_off"] == np.count_nonzero(data[CUT_OFF] > 0.0)


@pytest.mark.validation
@pytest.mark.long
@pytest.mark.parametrize("positions", [8, 50])
def test_the_default_grid_of_a_template_is_solved_whole(positions: int, tmp_path: Path) -> None:
    case = case_of(tmp_path, "pair")
    case.write_text(f"{template('pair')}\n[ste]\npositions = {positions}\n", encoding="utf-8")
    for table in check_verbs(case, tmp_path / "out"):
        assert table["states"] == 150 * positions and table["not_converged"] == 0
        assert table["static_share_cut_off"] == 0.0


@pytest.mark.validation
@pytest.mark.long
@pytest.mark.parametrize(("kind", "cut"), [("pair", 12), ("parallel", 101), ("planetary", 18)])
def test_wide_grids_of_templates_are_solved_whole_and_count_what_is_cut_off(
    kind: str, cut: int, tmp_path: Path
) -> None:
    axes = {"loads": [0.05, 0.2, 0.5, 1.0, 2.0, 3.0], "offsets": [-100.0, -50.0, 0.0, 50.0, 100.0]}
    case = case_of(tmp_path, kind, positions=50, **axes)
    tables = check_verbs(case, tmp_path / "out")
    assert all(table["not_converged"] == 0 for table in tables)
    assert max(table["largest_share_cut_off"] for table in tables) < 3e-3
    assert sum(table["cut_off"] for table in tables) == pytest.approx(cut, abs=3)
