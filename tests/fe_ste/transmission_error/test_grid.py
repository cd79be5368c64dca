"""Grids of states: each equals the state solved alone, whichever way the grid is split, stopped or sent."""

from __future__ import annotations

import dataclasses
import itertools
import math
import multiprocessing
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import fe_ste.transmission_error.grid
from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.flank import flank_compliance
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.flanks import FlankModification
from fe_ste.tools.processes import Workers
from fe_ste.transmission_error.compliance import PairCompliance
from fe_ste.transmission_error.grid import Checkpoint, GridError, solve_grid
from fe_ste.transmission_error.search import contact_state, unloaded_states
from fe_ste.transmission_error.states import StateAxes, StateResults
from fe_ste.transmission_error.table import MeshTable, TableError
from fe_ste.transmission_error.transmission_error import solve_positions

from ..cases.gears import HELICAL_PAIR
from ..damage import damages

#: From a tenth of the load to twice, a wedge of a third of a millimetre per metre either way.
AXES = StateAxes.checked(HELICAL_PAIR, [25.0, 250.0, 500.0], 3, [104.55e-3, 104.6e-3], [-1.2e-3, 0.0, 1.2e-3])


@pytest.fixture(scope="module")
def compliance() -> PairCompliance:
    coarse = MeshSettings(layers=6, flank=10, thickness=8, fillet=2, root=2, rim=6)
    flanks = (flank_compliance(HELICAL_PAIR.pinion, 1, coarse), flank_compliance(HELICAL_PAIR.gear, 1, coarse))
    return PairCompliance.from_flanks(HELICAL_PAIR, flanks, ContactSettings(slices=16))


@pytest.fixture(scope="module")
def grid(compliance: PairCompliance) -> xr.Dataset:
    return solve_grid(compliance, AXES)


@pytest.mark.validation
def test_every_state_equals_the_one_solved_alone(compliance: PairCompliance, grid: xr.Dataset) -> None:
    """Same cells and a problem with one solution: rounding is all that differs."""
    cosine = math.cos(HELICAL_PAIR.pinion.base_helix_angle)
    for p, t, c, m in itertools.product(range(3), range(3), range(2), range(3)):
        placed = compliance.at_centre_distance(float(AXES.centre_distance[c]))
        alone = contact_state(placed, float(AXES.torque[t]), p / 3, float(AXES.misalignment[m]))
        state = grid.isel(pmc=p, torque=t, centre_distance=c, misalignment=m)
        assert float(state.ste) == pytest.approx(alone.solution.approach / cosine, rel=1e-10)
        shares = [
            alone.solution.force[alone.cells.tooth == tooth].sum() / alone.normal_load for tooth in grid.tooth.values
        ]
        assert state.load_share.values == pytest.approx(np.array(shares), abs=1e-10)


def test_a_state_depends_on_no_other(compliance: PairCompliance, grid: xr.Dataset) -> None:
    """Axes the other way round: other neighbours, other starts, the same numbers."""
    turned = dataclasses.replace(AXES, torque=AXES.torque[::-1], misalignment=AXES.misalignment[::-1])
    again = solve_positions(compliance, turned, [2, 1, 0]).values["ste"]
    assert again[::-1, ::-1, :, ::-1] == pytest.approx(grid.ste.values, rel=1e-10)


def test_transmission_error_falls_to_the_unloaded_one_with_the_load(compliance: PairCompliance) -> None:
    """Where the flanks touch first, from the gaps alone; crowned and tilted flanks and one tooth out of place."""
    crowned = FlankModification(lead_crowning=6e-6, profile_crowning=4e-6)
    modified = compliance.with_modifications(crowned, FlankModification()).with_tooth_gaps({0: 3e-6})
    axes = StateAxes.checked(HELICAL_PAIR, [1e-3, 250.0], 4, misalignment=[0.0, 8e-4])
    for one in (compliance, modified):
        results = solve_positions(one, axes, range(4))
        unloaded = unloaded_states(one, axes)["unloaded_ste"].to_numpy()[:, 0]
        light, loaded = results.values["ste"][:, 0, 0], results.values["ste"][:, 1, 0]
        # 4e-6 of the load turns the gear by some 1e-4 of what the load does; a point touches softer than a line.
        assert light == pytest.approx(unloaded, abs=2e-3 * float(loaded.max()))
        assert (light > unloaded).all()
    assert unloaded[:, 0].max() > 1e-6


def test_more_load_always_turns_the_gear_further(grid: xr.Dataset) -> None:
    """What the inverse of a table over its load axis needs."""
    assert bool(grid.converged.all())
    assert bool((grid.ste.diff("torque") > 0).all())


@pytest.fixture
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """One position at one centre distance a block."""
    monkeypatch.setattr(fe_ste.transmission_error.grid, "_BLOCK_STATES", 9)


def same(one: xr.Dataset, other: xr.Dataset) -> None:
    """All results but the iterations, which depend on where the search began; loads against the largest."""
    for name in one.drop_vars("iterations").data_vars:
        values, others = one[name].to_numpy(), other[name].to_numpy()
        assert values == pytest.approx(others, rel=1e-10, abs=1e-10 * float(np.nanmax(np.abs(others)))), name


@pytest.mark.usefixtures("small_blocks")
def test_any_executor_gives_the_same_grid(compliance: PairCompliance, grid: xr.Dataset) -> None:
    class Immediate:
        """Runs a call when it is submitted, as a cluster of one node would."""

        def submit(self, fn: Callable[..., StateResults], /, *args: object) -> Future[StateResults]:
            future: Future[StateResults] = Future()
            future.set_result(fn(*args))
            return future

    with ThreadPoolExecutor(2) as threads:
        for executor in (Immediate(), threads):
            same(solve_grid(compliance, AXES, executor=executor), grid)


@pytest.mark.validation
@pytest.mark.usefixtures("small_blocks")
def test_processes_give_the_same_grid(compliance: PairCompliance, grid: xr.Dataset) -> None:
    seen = []
    with Workers(1) as pool:
        data = solve_grid(compliance, AXES, executor=pool, progress=lambda done, of: seen.append((done, of)))
    same(data, grid)
    assert seen[-1] == (54, 54)


class Stopped(BaseException):
    """As Ctrl-C: no error that anything may swallow."""


def stop_after(states: int) -> Callable[[int, int], None]:
    def progress(done: int, of: int) -> None:
        if done > states:
            raise Stopped

    return progress


@pytest.mark.validation
@pytest.mark.usefixtures("small_blocks")
def test_a_stopped_grid_keeps_what_is_finished_and_goes_on_from_there(
    compliance: PairCompliance, grid: xr.Dataset, tmp_path: Path
) -> None:
    checkpoint = Checkpoint(tmp_path / "helical.partial.nc", "this input")
    with pytest.raises(Stopped):
        solve_grid(compliance, AXES, checkpoint=checkpoint, progress=stop_after(40))
    with xr.open_dataset(checkpoint.path, engine="h5netcdf") as partial:
        assert partial["solved"].values.tolist() == [[1, 1], [1, 0], [1, 0]]
        assert np.array_equal(np.isfinite(partial["ste"]).all(("torque", "misalignment")), partial["solved"])
    with pytest.raises(TableError):  # a part is never taken for a table
        MeshTable.open(checkpoint.path)
    counted: list[int] = []
    rest = solve_grid(compliance, AXES, checkpoint=checkpoint, progress=lambda done, of: counted.append(done))
    assert counted == list(range(37, 55))
    same(rest, grid)
    xr.testing.assert_identical(rest, solve_grid(compliance, AXES))  # to the last bit: a block depends on no other


def test_finished_positions_of_another_input_or_in_a_damaged_file_are_not_taken_up(
    compliance: PairCompliance, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "helical.partial.nc"
    results = solve_positions(compliance, AXES, range(3))
    Checkpoint(path, "another input").store(results, AXES, np.ones((3, 2), dtype=bool))
    empty = StateResults.empty(compliance, AXES.shape)
    assert not Checkpoint(path, "this input").load(empty).any()
    content = path.read_bytes()
    for damaged in damages(content, 60):
        path.write_bytes(damaged)
        assert not Checkpoint(path, "another input").load(empty).any()
        assert "its positions are computed again" in caplog.messages[-1]
    path.write_bytes(content)
    assert Checkpoint(path, "another input").load(empty).all()
    assert np.array_equal(empty.values["ste"], results.values["ste"])


@pytest.mark.validation
@pytest.mark.usefixtures("small_blocks")
def test_lost_workers_are_reported_and_finished_positions_kept(compliance: PairCompliance, tmp_path: Path) -> None:
    """A process that is killed, as for want of memory."""
    checkpoint = Checkpoint(tmp_path / "helical.partial.nc", "this input")

    def kill(done: int, of: int) -> None:
        for worker in multiprocessing.active_children():
            worker.kill()

    with Workers(1) as pool, pytest.raises(GridError, match="finished positions are kept"):
        solve_grid(compliance, AXES, executor=pool, checkpoint=checkpoint, progress=kill)
    assert 1 <= checkpoint.load(StateResults.empty(compliance, AXES.shape)).sum() < 6


def test_a_failed_state_says_where_and_leaves_the_others(compliance: PairCompliance, grid: xr.Dataset) -> None:
    """A load that no flank carries, beside the usual ones."""
    axes = dataclasses.replace(AXES, torque=np.array([25.0, 250.0, 1e7]), positions=3)
    results = solve_positions(compliance, axes, [0])
    assert np.isnan(results.values["ste"][:, 2]).all()
    assert len(results.failures) == 6
    for word in ("pmc 0.000", "torque 1e+07 N m", "centre distance 104.55 mm", "misalignment -1200 µrad"):
        assert word in results.failures[0]
    assert results.values["ste"][:, :2] == pytest.approx(grid.ste.values[:1, :2], rel=1e-10)
