"""What is said of tables with gaps, or with contact that is cut off; and what dynamics make of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.element import MeshCurve
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.tables import (
    requested_tables,
    table_notes,
    table_path,
    table_warnings,
    wanted_table,
)
from fe_ste.transmission_error.states import CUT_OFF
from fe_ste.transmission_error.table import MeshTable

from ...cases.spur import SPUR_CASE

REASON = "pmc 0.250, torque 100 N m: no balance"


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Gearbox, Path, MeshTable]:
    folder = tmp_path_factory.mktemp("spur")
    case = folder / "gearbox.toml"
    case.write_text(SPUR_CASE.replace("positions = 8", "positions = 20"), encoding="utf-8")
    gearbox = Gearbox.from_toml(case)
    return gearbox, folder, requested_tables(gearbox, folder)[0].compute()


def holed(table: MeshTable, lost: list[int]) -> MeshTable:
    data = table.dataset.copy(deep=True)
    for name in ("ste", "mesh_stiffness", "tangent_stiffness"):
        data[name][lost] = np.nan
    data["converged"][lost] = False
    data.attrs["failures"] = "\n".join(REASON for _ in lost)
    return MeshTable(data)


def cut(table: MeshTable, share: float) -> MeshTable:
    data = table.dataset.copy(deep=True)
    data[CUT_OFF][4] = share
    return MeshTable(data)


def test_a_whole_table_leaves_nothing_to_say(computed: tuple[Gearbox, Path, MeshTable]) -> None:
    table = computed[2]
    assert not list(table_notes("spur", table))
    assert not list(table_warnings("spur", table))


def test_few_missing_positions_are_a_remark_and_dynamics_go_on(
    computed: tuple[Gearbox, Path, MeshTable], tmp_path: Path
) -> None:
    gearbox, _, table = computed
    few = holed(table, [5, 6])
    (line,) = table_notes("spur", few)
    assert line.startswith(f"spur: 2 of 20 states not converged, first {REASON}; they are marked in the table")
    assert not list(table_warnings("spur", few))
    few.save(table_path(tmp_path, "spur"))
    assert wanted_table(gearbox, "spur", 20).hash == few.input_hash
    curve = mesh_stiffness(gearbox, "line_of_action", tmp_path)["spur"]
    assert isinstance(curve, MeshCurve)
    for samples, name in ((curve.stiffness, "mesh_stiffness"), (curve.tangent, "tangent_stiffness")):
        assert np.isfinite(samples).all()
        assert samples.mean() == pytest.approx(table.static_state[name].to_numpy().mean(), rel=0.01)


def test_many_missing_positions_are_a_doubt_and_dynamics_refuse_them(
    computed: tuple[Gearbox, Path, MeshTable], tmp_path: Path
) -> None:
    gearbox, _, table = computed
    many = holed(table, [1, 2, 3])
    assert list(table_warnings("spur", many)) == [
        "spur: 3 of 20 states not converged, more than 10 %",
        *[f"spur: {REASON}"] * 3,
    ]
    many.save(table_path(tmp_path, "spur"))
    with pytest.raises(MeshError, match="spur.nc: 3 of 20 positions not converged"):
        mesh_stiffness(gearbox, "line_of_action", tmp_path)


def test_what_is_cut_off_is_told_with_its_share_and_doubtful_from_one_per_cent_on(
    computed: tuple[Gearbox, Path, MeshTable],
) -> None:
    table = computed[2]
    (line,) = table_notes("spur", cut(table, 0.002))
    assert ": in 1 of 20 states contact extends beyond a form diameter" in line
    assert not list(table_warnings("spur", cut(table, 0.002)))
    (doubt,) = table_warnings("spur", cut(table, 0.02))
    assert (
        ": in the static state 2 % of the load is beyond a form diameter, where a tip would press on a fillet" in doubt
    )
