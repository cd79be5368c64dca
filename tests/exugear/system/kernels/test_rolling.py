"""Rolling laws against sums over slices, against their own potential, and in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from exugear.system.bearings.rolling.contact import (
    bearing_load,
    equilibrium,
    row_contacts,
    tangent_stiffness,
)
from exugear.system.bearings.rolling.point_contact import rolling_arrays
from exugear.system.bearings.rolling.rows import BearingError, RollerRow, RollingRow
from exugear.system.kernels.rolling import (
    CAGE_DAMPING,
    CAGE_TORQUE,
    DAMPED_PART,
    ELASTIC_PART,
    MEMORY,
    STORED,
    RollingArrays,
    no_rolling,
    rolling_force,
    rolling_forces,
    rolling_memory,
    rolling_tangent,
    selected_rolling,
)

from ...cases.roller_bearings import BearingPair, TaperedRollerBearing
from ...cases.rolling import BALLS, CYLINDRICAL, TAPERED, plain_energy_and_load

NEEDLES = RollerRow(
    element_diameter=0.003,
    pitch_diameter=0.05,
    element_count=40,
    effective_length=0.015,
    profile_factor=0.00035,
    laminae=240,
)
ROLLERS = {
    "logarithmic": CYLINDRICAL,
    "tapered": TAPERED,
    "needles": NEEDLES,
    "crowned": replace(CYLINDRICAL, profile_factor=0.0, crown_curvature=1 / 60.0),
    "straight": replace(CYLINDRICAL, profile_factor=0.0),
    "by table": replace(CYLINDRICAL, profile_factor=0.0, profile_table=((0.0, 0.0), (0.5, 0.0), (1.0, 20e-6))),
    "aligning": replace(CYLINDRICAL, contact_angle=0.2, profile_factor=0.0, crown_curvature=1 / 60.0, aligning=True),
}
ALL_ROWS: dict[str, RollingRow] = {**ROLLERS, "balls": BALLS, "aligning balls": replace(BALLS, aligning=True)}
ALL_ROWS["angular contact balls"] = replace(BALLS, contact_angle=0.7, axial_position=0.02)


def alone(
    rows: Sequence[RollingRow], scale: float = 1.0, time: float = 0.0, cage_ratio: float = 0.0, phase: float = 0.0
) -> RollingArrays:
    """Arrays of one connector."""
    return rolling_arrays([tuple(rows)], [scale], [time], [cage_ratio], [phase])


def forces(
    arrays: RollingArrays, strain: np.ndarray, rate: np.ndarray | None = None, turn: float = 0.0, n: int = 0
) -> np.ndarray:
    out = rolling_memory(arrays)
    rolling_forces(n, strain, np.zeros(6) if rate is None else rate, turn, arrays, out)
    return out[:MEMORY]


def load(arrays: RollingArrays, strain: np.ndarray, turn: float = 0.0) -> np.ndarray:
    """Elastic force and moment, (5,)."""
    return forces(arrays, strain, turn=turn)[ELASTIC_PART : ELASTIC_PART + 5]


def tangent(arrays: RollingArrays, strain: np.ndarray, turn: float = 0.0) -> np.ndarray:
    out = np.empty((6, 6))
    rolling_tangent(0, strain, turn, arrays, out)
    assert not out[5].any()
    return out[:5, :5]


def static_rating(row: RollerRow) -> float:
    """Basic static radial load rating (N) of one row of rollers by ISO 76, sizes in mm."""
    length, diameter = 1e3 * row.effective_length, 1e3 * row.element_diameter
    return 44.0 * (1.0 - row.diameter_ratio) * row.element_count * length * diameter * np.cos(row.contact_angle)


def states(row: RollingRow, count: int, tilt: float = 1e-3) -> np.ndarray:
    """Displacements (count, 5) from hardly to fully loaded, with tilts (rad)."""
    random = np.random.default_rng(11)
    size = 0.5 * abs(row.radial_clearance) + 2e-3 * row.element_diameter * 10 ** random.uniform(-1.5, 0.3, count)
    found = random.normal(size=(count, 5)) * size[:, None]
    found[:, 2] *= 0.3
    found[:, 3:] = tilt * random.uniform(-1.0, 1.0, (count, 2)) * random.uniform(0.0, 1.0, (count, 1))
    return found


def sliced_load(row: RollerRow, state: np.ndarray, phase: float) -> np.ndarray:
    """Force and moment (5,) of 240 slices a roller, all at once; see `plain_energy_and_load`."""
    polar = phase + 2.0 * np.pi * np.arange(row.element_count)[:, None] / row.element_count
    along = ((np.arange(240) + 0.5) / 240 - 0.5) * row.effective_length
    cosine, sine = np.cos(row.contact_angle), np.sin(row.contact_angle)
    lever = 0.5 * row.pitch_diameter * sine - row.axial_position * cosine - along
    c, s, one = np.cos(polar), np.sin(polar), np.ones((row.element_count, 240))
    gradient = np.stack([cosine * c * one, cosine * s * one, sine * one, lever * s, -lever * c])
    gap = 0.5 * row.radial_clearance * cosine + 2.0 * row.drop(along)
    constant = 35948e6 * row.effective_length ** (8 / 9) / 240
    force = constant * np.maximum(np.tensordot(state, gradient, 1) - gap, 0.0) ** (10 / 9)
    return np.tensordot(gradient, force, 2)


@pytest.mark.parametrize("name", [name for name in ROLLERS if name != "aligning"])
def test_table_has_the_load_of_240_slices_within_1e_3_above_one_percent_of_the_rating(name: str) -> None:
    row = ROLLERS[name]
    arrays = alone([row], phase=0.1)
    errors, moments = [], []
    for state in states(row, 400):
        expected, found = sliced_load(row, state, 0.1), load(arrays, state)
        size = np.linalg.norm(expected[:3])
        if size > 0.01 * static_rating(row):
            errors.append(np.linalg.norm(found[:3] - expected[:3]) / size)
            moments.append(np.linalg.norm((found - expected)[3:]) / (size * 0.5 * row.effective_length))
    assert len(errors) > 100
    assert max(errors) < 1e-3
    assert np.median(errors) < 1e-4
    assert max(moments) < 2e-3


@pytest.mark.parametrize("name", ["logarithmic", "straight", "tapered"])
def test_beyond_the_table_slices_are_summed(name: str) -> None:
    for state in (np.array([2e-3, 0.0, 0.0, 0.0, 0.0]), np.array([1e-5, 2e-5, 0.0, 8e-3, 7e-3])):
        found, expected = load(alone([ROLLERS[name]]), state), sliced_load(ROLLERS[name], state, 0.0)
        # Rollers near the load's normal are less pressed or tilted and come from the table.
        assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()


@pytest.mark.validation
@pytest.mark.parametrize("name", ["logarithmic", "tapered", "balls", "angular contact balls"])
def test_compiled_law_is_a_plain_sum_over_slices_or_balls(name: str) -> None:
    row = replace(ALL_ROWS[name], axial_position=0.01)
    tolerance, least = (1e-4, 10e3) if isinstance(row, RollerRow) else (1e-11, 1.0)
    for state in states(row, 6):
        energy, expected = plain_energy_and_load(row, state, 0.1)
        found = forces(alone([row], phase=0.1), state)
        size = max(np.abs(expected).max(), least)
        assert np.abs(found[ELASTIC_PART : ELASTIC_PART + 5] - expected).max() < tolerance * size
        assert found[STORED] == pytest.approx(energy, rel=tolerance, abs=1e-3 * tolerance * size)


def from_differences(value, at: np.ndarray, step: float) -> np.ndarray:
    """Gradient by fourth-order central differences; translations in m, tilts by ten times the step."""
    columns = []
    for n in range(len(at)):
        e = np.zeros(len(at))
        e[n] = step * (10.0 if n > 2 else 1.0)
        columns.append((8.0 * (value(at + e) - value(at - e)) - value(at + 2 * e) + value(at - 2 * e)) / (12.0 * e[n]))
    return np.array(columns)


@pytest.mark.parametrize("name", ALL_ROWS)
@pytest.mark.parametrize("scale", [1.0, -0.6])
def test_load_is_the_gradient_of_the_energy_and_the_tangent_that_of_the_load(name: str, scale: float) -> None:
    """A housing's share and an outer ring on the second body are no exception."""
    # Preloaded, so that no element touches and parts within the steps.
    row = replace(ALL_ROWS[name], radial_clearance=-60e-6)
    arrays = alone([row], scale=scale, phase=0.2)
    for state in states(row, 4, tilt=2e-4) / 20.0:
        found = load(arrays, state)
        gradient = from_differences(lambda u: forces(arrays, u)[STORED], state, 1e-8)
        # Round-off of energies of 10 J over steps of 10 nm; patches of cubics join with continuous slopes.
        assert np.abs(found - gradient)[:3].max() < 1e-7 * np.abs(found[:3]).max() + 1e-2
        stiffness, sizes = tangent(arrays, state), np.sqrt(np.diag(tangent(arrays, state)) + 1e-30)
        assert np.array_equal(stiffness, stiffness.T)
        differences = from_differences(lambda u: load(arrays, u), state, 1e-9)
        assert np.abs((stiffness - differences) / np.outer(sizes, sizes)).max() < 2e-3


def test_energy_closes_along_a_path_to_the_error_of_its_quadrature() -> None:
    """Work of the load around a loop that opens and closes contacts, tilts and turns the cage."""
    arrays = alone([CYLINDRICAL], cage_ratio=0.43)
    angle = 2.0 * np.pi * np.arange(20001) / 20000
    path = np.stack(
        [60e-6 * np.cos(angle), 50e-6 * np.sin(angle), 0 * angle, 3e-4 * np.sin(2 * angle), 2e-4 * np.cos(angle)],
        axis=1,
    )
    turn = 0.5 * np.sin(angle)
    found = np.array([forces(arrays, u, turn=t) for u, t in zip(path, turn, strict=True)])
    coordinates = np.column_stack([path, turn])
    conjugate = np.column_stack([found[:, ELASTIC_PART : ELASTIC_PART + 5], found[:, CAGE_TORQUE]])
    work = np.sum(0.5 * (conjugate[1:] + conjugate[:-1]) * np.diff(coordinates, axis=0))
    assert abs(work) < 1e-6 * np.ptp(found[:, STORED])
    # Up to any point of the loop as well.
    partial = np.cumsum(np.sum(0.5 * (conjugate[1:] + conjugate[:-1]) * np.diff(coordinates, axis=0), axis=1))
    change = found[1:, STORED] - found[0, STORED]
    assert np.abs(partial - change).max() < 1e-6 * np.ptp(found[:, STORED])


@pytest.mark.parametrize("arrangement", ["X", "O", "tandem"])
@pytest.mark.parametrize("preload", [0.0, 30e-6, -20e-6])
def test_two_rows_are_a_bearing_pair(arrangement: str, preload: float) -> None:
    taper = TaperedRollerBearing(
        bore=0.160,
        outside_diameter=0.240,
        width=0.051,
        contact_angle=np.radians(17.0),
        profile_factor=0.00045,
        laminae=240,
    )
    pair = BearingPair(bearing=taper, arrangement=arrangement, axial_preload=preload)
    arrays = alone(pair.rows)
    for force in ([60e3, 20e3, 30e3], [80e3, 0.0, -20e3]) if arrangement != "tandem" else ([20e3, 5e3, 60e3],):
        for tilt in ((0.0, 0.0), (3e-4, -2e-4)):
            state = equilibrium(pair, force, tilt=tilt)
            u, sizes = state.displacement[:5], np.array([1.0, 1.0, 1.0, 0.1, 0.1])  # m: lever of the rollers' loads
            errors = (load(arrays, u) - state.load[:5]) / sizes
            assert np.abs(errors).max() < 1e-4 * np.linalg.norm(force)
            stiffness, found = (
                matrix / np.outer(sizes, sizes) for matrix in (state.tangent[:5, :5], tangent(arrays, u))
            )
            # Slopes of single slices are steep where they begin to carry: 240 of them still show it.
            assert np.abs(found - stiffness).max() < 5e-3 * np.abs(stiffness).max()


@pytest.mark.parametrize("name", ALL_ROWS)
def test_within_its_clearance_a_bearing_does_nothing_at_all(name: str) -> None:
    row = replace(ALL_ROWS[name], radial_clearance=60e-6)
    arrays = alone([row], time=1e-5, cage_ratio=0.4)
    random = np.random.default_rng(2)
    for _ in range(20):
        state = random.uniform(-1.0, 1.0, 5) * [15e-6, 15e-6, 5e-6, 3e-5, 3e-5]
        # 0.1 um ahead at most: damping, too, waits for what touches.
        assert not forces(arrays, state, 1e-2 * random.normal(size=6), 0.3).any()
        assert not tangent(arrays, state, 0.3).any()


@pytest.mark.parametrize("name", ALL_ROWS)
def test_a_cage_turned_by_one_pitch_is_the_same_cage(name: str) -> None:
    row = ALL_ROWS[name]
    pitch = 2.0 * np.pi / row.element_count
    arrays = alone([row], cage_ratio=0.5)
    for state in states(row, 5):
        one, two = (forces(arrays, state, turn=turn) for turn in (0.3, 0.3 + 2.0 * pitch))
        assert np.abs(one - two)[:CAGE_TORQUE].max() < 1e-12 * max(np.abs(one[:CAGE_TORQUE]).max(), 1e3)


@pytest.mark.parametrize("name", ALL_ROWS)
def test_law_is_that_of_the_statics_in_its_numpy_form(name: str) -> None:
    """Load and tangent of `exugear.system.bearings.rolling.contact`, which finds operating points by them."""
    row = replace(ALL_ROWS[name], axial_position=0.02)
    arrays, contacts = alone([row], phase=0.1), row_contacts([row], 0.1)
    load_limit, tangent_limit = (1e-3, 1e-2) if isinstance(row, RollerRow) else (1e-11, 1e-11)
    sizes = np.array([1.0, 1.0, 1.0, 0.1, 0.1])  # m: lever of the elements' loads
    for state in states(row, 40):
        expected = bearing_load(contacts, np.append(state, 0.0))[:5] / sizes
        if np.abs(expected).max() < 0.01 * row.element_count * 1e4 * (row.element_diameter / 0.01) ** 2:
            continue
        assert np.abs(load(arrays, state) / sizes - expected).max() < load_limit * np.abs(expected).max()
        stiffness = tangent_stiffness(contacts, np.append(state, 0.0))[:5, :5] / np.outer(sizes, sizes)
        found = tangent(arrays, state) / np.outer(sizes, sizes)
        assert np.abs(found - stiffness).max() < tangent_limit * np.abs(stiffness).max()


def test_straight_rollers_without_tilt_are_a_closed_form() -> None:
    """c_L d^(10/9) a roller (ISO/TS 16281)."""
    row = ROLLERS["straight"]
    arrays = alone([row])
    angle = 2.0 * np.pi * np.arange(row.element_count) / row.element_count
    constant = 35948.0 * (1e3 * row.effective_length) ** (8 / 9)  # N, mm
    for shift in (30e-6, 60e-6, 250e-6):
        approach = 1e3 * np.maximum(shift * np.cos(angle) - 20e-6, 0.0)
        expected = np.sum(constant * approach ** (10 / 9) * np.cos(angle))
        assert load(arrays, np.array([shift, 0, 0, 0, 0]))[0] == pytest.approx(expected, rel=2e-4)


def test_balls_under_axial_displacement_are_hertz_along_a_normal_that_turns() -> None:
    row = replace(BALLS, contact_angle=0.5, radial_clearance=0.0)
    arrays = alone([row])
    constant = arrays.geometry[0, 7]
    centres = (row.inner_conformity + row.outer_conformity - 1.0) * row.element_diameter
    for shift in (5e-6, 50e-6):
        radial, axial = centres * np.cos(0.5), centres * np.sin(0.5) + shift
        length = np.hypot(radial, axial)
        expected = row.element_count * constant * (length - centres) ** 1.5 * axial / length
        found = load(arrays, np.array([0, 0, shift, 0, 0]))
        assert found[2] == pytest.approx(expected, rel=1e-12)
        assert np.abs(found[[0, 1, 3, 4]]).max() < 1e-9 * found[2]


def test_aligning_rows_take_no_moment_and_feel_no_tilt() -> None:
    for row in (ALL_ROWS["aligning"], ALL_ROWS["aligning balls"]):
        arrays = alone([row])
        state = np.array([60e-6, 20e-6, 10e-6, 0.0, 0.0])
        tilted = state + [0, 0, 0, 5e-3, -0.02]
        assert np.array_equal(load(arrays, state), load(arrays, tilted))
        assert load(arrays, state)[0] > 1e3
        assert not load(arrays, tilted)[3:].any()


def test_aligning_rollers_have_the_load_of_their_slices() -> None:
    row = ALL_ROWS["aligning"]
    for shift in (30e-6, 80e-6, 200e-6):
        state = np.array([shift, 0.2 * shift, 10e-6, 0.0, 0.0])
        expected, found = sliced_load(row, state, 0.0)[:3], load(alone([row]), state)[:3]
        assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()


def test_damping_is_time_times_tangent_times_rate_and_takes_energy() -> None:
    """To first order in how far the rings move in that time, here 1 part in 50."""
    for name, scale in (("logarithmic", 1.0), ("angular contact balls", -0.7)):
        arrays = alone([ALL_ROWS[name]], scale=scale, time=3e-5)
        state, rate = np.array([70e-6, 20e-6, 5e-6, 2e-4, 1e-4]), np.array([1e-2, -2e-2, 1e-3, 0.1, -0.3, 0.0])
        found = forces(arrays, state, rate)[DAMPED_PART : DAMPED_PART + 5]
        expected = 3e-5 * tangent(arrays, state) @ rate[:5]
        assert np.abs(found - expected).max() < 2e-2 * np.abs(expected).max()
        slow = forces(arrays, state, 1e-3 * rate)[DAMPED_PART : DAMPED_PART + 5]
        assert np.abs(1e3 * slow - expected).max() < 1e-5 * np.abs(expected).max()
        for fast in 100.0 * rate * np.random.default_rng(1).normal(size=(50, 6)):
            assert forces(arrays, state, fast)[DAMPED_PART:CAGE_TORQUE] @ fast >= 0.0


def test_what_the_solver_takes_is_both_parts_together() -> None:
    for name, turn in (("logarithmic", 0.3), ("angular contact balls", -2.0)):
        arrays = alone([ALL_ROWS[name]], scale=-0.6, time=3e-5, cage_ratio=0.4)
        state, rate = np.array([70e-6, 20e-6, 5e-6, 2e-4, 1e-4]), np.array([1e-2, -2e-2, 1e-3, 0.1, -0.3, 5.0])
        parts, whole = forces(arrays, state, rate, turn), rolling_memory(arrays)
        rolling_force(0, state, rate, turn, arrays, whole)
        together = parts[ELASTIC_PART:DAMPED_PART] + parts[DAMPED_PART:CAGE_TORQUE]
        assert np.abs(whole[ELASTIC_PART:DAMPED_PART] - together).max() < 1e-12 * np.abs(together).max()
        assert whole[CAGE_TORQUE] == pytest.approx(parts[CAGE_TORQUE] + parts[CAGE_DAMPING], rel=1e-9)


def test_a_spinning_tilted_ring_that_stays_where_it_is_is_neither_damped_nor_braked() -> None:
    """The angular velocity of a ring spinning about its own axis, tilted by a and b, is (b, -a, 1) times its speed."""
    arrays = alone([CYLINDRICAL], time=1e-3)
    state = np.array([70e-6, 20e-6, 0.0, 2e-4, 1e-4])
    spinning = 100.0 * np.array([0.0, 0.0, 0.0, state[4], -state[3], 1.0])
    found = forces(arrays, state, spinning)
    assert found[:DAMPED_PART].any()
    assert np.abs(found[DAMPED_PART:CAGE_TORQUE]).max() < 1e-12 * np.abs(found).max()
    assert abs(found[:DAMPED_PART] @ spinning) < 1e-12 * np.abs(found).max()


def test_ring_that_is_fixed_to_the_other_body_changes_sides_alone() -> None:
    """Outer ring on the second body: force and moment on the first are those that a turned view shows."""
    state = np.array([60e-6, -10e-6, 0.0, 2e-4, 1e-4])
    one, other = load(alone([CYLINDRICAL]), state), load(alone([CYLINDRICAL], scale=-1.0), -state)
    assert np.array_equal(one, -other)


def test_share_takes_its_part_of_the_deflection_at_every_load() -> None:
    state = np.array([90e-6, -10e-6, 0.0, 2e-4, 1e-4])
    whole, shared = alone([CYLINDRICAL]), alone([CYLINDRICAL], scale=0.5)
    assert np.array_equal(load(shared, 2.0 * state), load(whole, state))
    assert np.allclose(tangent(shared, 2.0 * state), 0.5 * tangent(whole, state), rtol=1e-14)
    assert forces(shared, 2.0 * state)[STORED] == 2.0 * forces(whole, state)[STORED]


def test_rows_of_one_kind_share_their_table() -> None:
    tapers = [
        replace(TAPERED, contact_angle=a, axial_position=z, radial_clearance=c)
        for a, z, c in [(0.3, 0, 0), (-0.3, 0.1, 1e-5)]
    ]
    both, one = alone(tapers), alone(tapers[:1])
    assert both.tables.size == one.tables.size
    assert both.tables.nbytes < 110e3
    assert alone([ROLLERS["straight"]]).tables.nbytes < 210e3
    assert alone([*tapers, CYLINDRICAL]).tables.size == 2 * one.tables.size


def test_connectors_chosen_keep_their_rows() -> None:
    arrays = rolling_arrays(
        [(CYLINDRICAL,), (), (BALLS, TAPERED)], [1.0, 1.0, -1.0], [0.0, 0.0, 1e-5], [0.4, 0.0, 0.5], [0.0, 0.0, 0.1]
    )
    chosen = selected_rolling(arrays, np.array([2, 1, 0]))
    state, rate = np.array([60e-6, 0, 0, 0, 1e-4]), np.full(6, 1e-3)
    for n in range(3):
        assert np.array_equal(forces(arrays, state, rate, 0.2, n), forces(chosen, state, rate, 0.2, 2 - n))
    assert not forces(no_rolling(2), state, rate, 0.2, 1).any()


def test_row_of_unknown_elements_is_refused() -> None:
    plain = RollingRow(element_diameter=0.03, pitch_diameter=0.2, element_count=8)
    with pytest.raises(BearingError, match="RollingRow has no rolling law; it must be a RollerRow or a BallRow"):
        alone([plain])
