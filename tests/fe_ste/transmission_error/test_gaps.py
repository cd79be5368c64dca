"""States that are not solved: what stands in for them, and when they are too many."""

from __future__ import annotations

import numpy as np
import pytest

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.transmission_error.surface import GapError, complete_cycle, complete_loads
from fe_ste.transmission_error.table import MeshTable, TableInput

from ..cases.gears import PAIR_30


@pytest.fixture(scope="module")
def table() -> MeshTable:
    return MeshTable.compute(
        TableInput(
            pair=PAIR_30,
            torque=(25.0, 50.0, 100.0, 150.0),
            static_torque=100.0,
            positions=20,
            misalignment=(-1e-4, 0.0, 1e-4),
            mesh=MeshSettings(layers=4, flank=8, thickness=6),
            contact=ContactSettings(slices=8),
        )
    )


@pytest.mark.parametrize(("lost", "bound"), [([3, 4], 0.5), ([0, 19], 0.02), ([11], 0.05)])
def test_missing_positions_of_a_cycle_are_interpolated_between_their_neighbours(
    table: MeshTable, lost: list[int], bound: float
) -> None:
    """Within hundredths of the swing; where the step itself is lost, with which teeth enter, within half of it."""
    whole = table.static_state
    holed = whole.copy(deep=True)
    for name in ("ste", "mesh_stiffness", "tangent_stiffness"):
        holed[name][lost] = np.nan
    holed["converged"][lost] = False
    filled = complete_cycle(holed)
    swing = float(np.ptp(whole["ste"].values))
    assert np.abs((filled["ste"] - whole["ste"]).values).max() < bound * swing
    kept = np.delete(np.arange(20), lost)
    assert np.array_equal(filled["ste"][kept], whole["ste"][kept])
    assert filled["mesh_stiffness"].values == pytest.approx((whole.line_of_action_force / filled["ste"]).values)
    assert bool(np.isfinite(filled["tangent_stiffness"]).all())
    assert filled["converged"].values.tolist() == holed["converged"].values.tolist()  # it stays told


def test_a_whole_cycle_is_left_as_it_is(table: MeshTable) -> None:
    whole = table.static_state
    assert complete_cycle(whole) is whole


def test_more_than_a_tenth_of_the_cycle_is_too_much(table: MeshTable) -> None:
    holed = table.static_state.copy(deep=True)
    holed["converged"][:3] = False
    with pytest.raises(GapError, match=r"3 of 20 positions not converged \(15 %\); at most 10 %"):
        complete_cycle(holed)


def nodes_of(table: MeshTable) -> tuple[np.ndarray, ...]:
    data = table.dataset.transpose("pmc", "centre_distance", "misalignment", "torque", ...)
    root = np.concatenate([[0.0], np.sqrt(data["line_of_action_force"].values[0, 0, 0])])
    unloaded = data["unloaded_ste"].transpose("pmc", "centre_distance", "misalignment").values
    nodes = np.concatenate([unloaded[..., None], data["ste"].values], axis=-1)
    return root, nodes, data["tangent_stiffness"].values, data["tangent_load_centroid"].values


@pytest.mark.parametrize("load", [0, 1, 2, 3])
def test_a_missing_load_lies_between_its_neighbours_and_near_what_was_solved(table: MeshTable, load: int) -> None:
    root, nodes, tangent, centre = nodes_of(table)
    solved = np.ones(tangent.shape, dtype=bool)
    solved[5, 0, :2, load] = False
    holed = nodes.copy()
    holed[..., 1:][~solved] = np.nan
    lost_tangent, lost_centre = np.where(solved, tangent, np.nan), np.where(solved, centre, np.nan)
    filled, stiffness, slope = complete_loads(root, holed, lost_tangent, lost_centre, solved)
    assert (np.diff(filled, axis=-1) > 0.0).all() and (stiffness > 0.0).all() and np.isfinite(slope).all()
    # The first load bends most: flanks that begin to touch under misalignment yield as a cubic does not know.
    assert filled[..., 1:][~solved] == pytest.approx(nodes[..., 1:][~solved], abs=0.03 * nodes.max())
    assert stiffness[~solved] == pytest.approx(tangent[~solved], rel=0.4 if load == 0 else 0.25)
    assert np.array_equal(filled[..., 1:][solved], nodes[..., 1:][solved])


def test_a_place_without_any_load_takes_the_growth_of_its_neighbour(table: MeshTable) -> None:
    root, nodes, tangent, centre = nodes_of(table)
    solved = np.ones(tangent.shape, dtype=bool)
    solved[7, 0, 1] = False
    holed = np.where(np.concatenate([np.ones((20, 1, 3, 1), dtype=bool), solved], axis=-1), nodes, np.nan)
    filled, stiffness, _ = complete_loads(root, holed, tangent, centre, solved)
    assert (np.diff(filled, axis=-1) > 0.0).all()
    assert filled[7, 0, 1] == pytest.approx(nodes[7, 0, 1], rel=0.1)
    assert np.isfinite(stiffness).all()


def test_more_than_a_tenth_of_the_states_is_too_much(table: MeshTable) -> None:
    root, nodes, tangent, centre = nodes_of(table)
    solved = np.ones(tangent.shape, dtype=bool)
    solved[:, 0, 0] = False
    with pytest.raises(GapError, match="80 of 240 states not converged"):
        complete_loads(root, nodes, tangent, centre, solved)
