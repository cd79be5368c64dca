"""The law of all connectors at once against plain loops over one after the other, and its tangents against differences.

The plain loops are the law as it was compiled before.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.system.bearings.rolling.point_contact import rolling_arrays
from exugear.system.kernels.connectors import (
    ConnectorArrays,
    add_connector_forces,
    add_connector_stiffness,
    connector_loads,
    connector_strains,
    connector_tangents,
)
from exugear.system.kernels.rolling import no_rolling

from ...cases.plain_connectors import DISPLACEMENT, add_forces, connector_load, connector_motion
from ...cases.rolling import BALLS, CYLINDRICAL

ENDS = np.array([[-1, 0], [0, 6], [12, -1], [6, 12], [0, 12]])
SIZE = 20
"""Three bodies of six coordinates, and two coordinates of others."""


@pytest.fixture(params=["matrices", "rows"])
def connectors(request: pytest.FixtureRequest) -> ConnectorArrays:
    rng = np.random.default_rng(3)
    count = len(ENDS)
    rows = [(), (CYLINDRICAL,), (replace(BALLS, axial_position=0.01), CYLINDRICAL), (), (BALLS,)]
    scales = [1.0, -1.0, 0.7, 1.0, 1.0]
    node = rng.normal(0.0, 0.3, (count, 2, 3)) * (ENDS >= 0)[..., None]
    stiffness = rng.normal(0.0, 1e8, (count, 6, 6))
    rolling = rolling_arrays(rows, scales, [1e-5] * count, [0.43] * count, [0.1] * count)
    return ConnectorArrays(
        bodies=ENDS,
        local=rng.normal(0.0, 0.2, (count, 2, 3)),
        node=node,
        stiffness=stiffness + stiffness.swapaxes(1, 2),
        damping=rng.normal(0.0, 1e3, (count, 6, 6)),
        point_strain=rng.normal(0.0, 1e-3, (count, 6)),
        point_load=rng.normal(0.0, 1e5, (count, 6)),
        rolling=rolling if request.param == "rows" else no_rolling(count),
    )


def state(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    q, v = rng.normal(0.0, 1e-3, SIZE), rng.normal(0.0, 1e-2, SIZE)
    q[5:18:6] += [40.0, -700.0, 3.0]  # spins are unwrapped
    v[5:18:6] += [2.0, -180.0, 20.0]
    return q, v


def test_forces_loads_and_strains_are_those_of_plain_loops(connectors: ConnectorArrays) -> None:
    q, v = state(1)
    expected, found = np.zeros(SIZE), np.zeros(SIZE)
    add_forces(q, v, connectors, expected)
    add_connector_forces(q, v, connectors, found)
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
    loads, strains = connector_loads(q, v, connectors), connector_strains(q, connectors)
    turn, arms, motion, load = np.empty((3, 3)), np.empty((2, 3)), np.empty((3, 6)), np.empty(6)
    for n in range(len(ENDS)):
        connector_motion(q, v, n, connectors, turn, arms, motion)
        assert np.abs(strains[n] - motion[DISPLACEMENT]).max() < 1e-13
        connector_load(q, v, n, connectors, arms, load)
        assert np.abs(loads[n] - load).max() < 1e-12 * np.abs(load).max()


def test_loads_at_several_states_are_those_at_each(connectors: ConnectorArrays) -> None:
    q, v = (np.array(values) for values in zip(*map(state, range(4)), strict=True))
    each = np.array([connector_loads(*own, connectors) for own in zip(q, v, strict=True)])
    assert np.abs(connector_loads(q, v, connectors) - each).max() < 1e-12 * np.abs(each).max()


def test_tangents_are_the_derivatives_of_the_forces_of_chosen_connectors(connectors: ConnectorArrays) -> None:
    """Central differences of the same length: of the whole law against those of each connector's own coordinates."""
    q, _ = state(2)
    chosen, step = np.array([0.0, 1.0, 1.0, 0.0, 1.0]), 1e-6
    tangents = np.array(list(connector_tangents(q, np.full(len(ENDS), step), connectors)))
    whole = np.zeros((SIZE, SIZE))
    add_connector_stiffness(q, np.full(len(ENDS), step), connectors, whole)
    assert np.abs(whole - tangents[:, 0].sum(axis=0)).max() < 1e-12 * np.abs(whole).max()
    stiffness, damping = tangents[chosen > 0.0].sum(axis=0)
    few = connectors.chosen(np.flatnonzero(chosen))
    few = few._replace(rolling=few.rolling._replace(cage_ratio=np.zeros(3)))  # whose torque tangents leave out
    if few.rolling.first[-1]:  # the cage stands where it would have stood
        turned = q[ENDS[chosen > 0.0][:, 1] + 5] * (ENDS[chosen > 0.0][:, 1] >= 0)
        turned -= q[ENDS[chosen > 0.0][:, 0] + 5] * (ENDS[chosen > 0.0][:, 0] >= 0)
        phase = few.rolling.phase + 0.43 * turned
        few = few._replace(rolling=few.rolling._replace(phase=phase))
    for matrix, of_rates in ((stiffness, False), (damping, True)):
        for c in range(SIZE):
            e = step * np.eye(SIZE)[c]
            ahead, back = np.zeros(SIZE), np.zeros(SIZE)
            add_forces(q + e * (not of_rates), e * of_rates, few, ahead)
            add_forces(q - e * (not of_rates), -e * of_rates, few, back)
            expected = (back - ahead) / (2.0 * step)
            if few.rolling.first[-1] and not of_rates and c % 6 == 5 and c < 18:
                continue  # the cage turns with the spin
            round_off = 1e-14 * np.abs(ahead).max() / step  # of forces, some dozens of ulps, in their difference
            assert np.abs(matrix[:, c] - expected).max() < 1e-6 * np.abs(matrix).max() + round_off
