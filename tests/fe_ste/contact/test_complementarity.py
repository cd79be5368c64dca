"""Rigid gap kinematics, contact cells, and the complementarity problem against brute force."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from fe_ste.contact.complementarity import ContactSolution, solve_complementarity
from fe_ste.contact.compliance import mean_inverse_distance
from fe_ste.contact.kinematics import ContactError, ContactSettings, FlankPair, lay_cells, rigid_gap
from fe_ste.geometry.gears import Gear, GearPair


def random_problem(count: int, seed: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Symmetric positive definite compliance of unit size, gaps and a load that closes some of them."""
    random = np.random.default_rng(seed)
    root = random.normal(size=(count, count))
    return root @ root.T / count + 0.1 * np.eye(count), random.uniform(0, 1, count), float(random.uniform(0.05, 2.0))


def brute_force(compliance: np.ndarray, gap: np.ndarray, load: float) -> tuple[np.ndarray, float]:
    """Try every set of touching cells; exactly one fulfils all conditions."""
    count = len(gap)
    for size in range(1, count + 1):
        for touching in itertools.combinations(range(count), size):
            index = list(touching)
            matrix = np.zeros((size + 1, size + 1))
            matrix[:size, :size] = compliance[np.ix_(index, index)]
            matrix[:size, size] = -1.0
            matrix[size, :size] = 1.0
            solution = np.linalg.solve(matrix, np.append(-gap[index], load))
            force = np.zeros(count)
            force[index] = solution[:size]
            if (force >= 0).all() and (compliance @ force + gap - solution[size] >= -1e-12).all():
                return force, float(solution[size])
    raise AssertionError("no solution")


def assert_solves(solution: ContactSolution, compliance: np.ndarray, gap: np.ndarray, load: float) -> None:
    force, approach = solution.force, solution.approach
    clearance = compliance @ force + gap - approach
    assert (force >= 0).all()
    assert clearance.min() > -1e-10 * abs(approach)
    assert np.abs(clearance[force > 0]).max() < 1e-10 * abs(approach)
    assert force.sum() == pytest.approx(load, rel=1e-10)


@pytest.mark.parametrize("seed", range(12))
def test_complementarity_equals_brute_force_over_all_sets(seed: int) -> None:
    compliance, gap, load = random_problem(7, seed)
    solution = solve_complementarity(compliance, gap, load, gap < 0.5)
    force, approach = brute_force(compliance, gap, load)
    assert solution.approach == pytest.approx(approach, rel=1e-10)
    assert solution.force == pytest.approx(force, abs=1e-10 * load)


@pytest.mark.parametrize("guess", ["empty", "all", "random", "wrong"])
def test_any_guess_leads_to_the_same_solution(guess: str) -> None:
    for seed in range(40):
        compliance, gap, load = random_problem(60, seed)
        reference = solve_complementarity(compliance, gap, load, gap < 0.5)
        assert_solves(reference, compliance, gap, load)
        random = np.random.default_rng(seed).random(60) < 0.5
        start = {"empty": gap < 0, "all": gap >= 0, "random": random, "wrong": reference.force == 0}[guess]
        solution = solve_complementarity(compliance, gap, load, start)
        assert_solves(solution, compliance, gap, load)
        assert solution.force == pytest.approx(reference.force, abs=1e-9 * load)


def test_derivative_by_the_load_is_that_of_the_approach() -> None:
    compliance, gap, load = random_problem(30, 1)
    here, there = (solve_complementarity(compliance, gap, load * f, gap < 0.5) for f in (1.0, 1.0 + 1e-7))
    slope = (there.approach - here.approach) / (1e-7 * load)
    assert here.approach_per_load == pytest.approx(slope, rel=1e-6)


def test_cells_out_of_reach_never_touch() -> None:
    compliance, gap, load = random_problem(10, 2)
    gap[3] = np.inf
    solution = solve_complementarity(compliance, gap, load, np.ones(10, dtype=bool))
    assert solution.force[3] == 0.0


def test_indefinite_matrix_is_refused() -> None:
    with pytest.raises(ContactError, match="positive definite"):
        solve_complementarity(np.array([[1.0, 2.0], [2.0, 1.0]]), np.zeros(2), 1.0, np.array([True, True]))


def test_values_that_are_no_numbers_are_refused() -> None:
    gap = np.array([0.0, np.nan])
    with pytest.raises(ContactError):
        solve_complementarity(np.array([[1.0, np.nan], [np.nan, 1.0]]), gap, 1.0, np.array([True, True]))
    with pytest.raises(ContactError):
        solve_complementarity(np.eye(2), np.zeros(2), np.nan, np.array([True, True]))


def test_a_set_that_does_not_settle_is_refused() -> None:
    compliance, gap, load = random_problem(60, 3)
    with pytest.raises(ContactError, match="settle"):
        solve_complementarity(compliance, gap, load, gap > 0.5, max_iterations=1)


@pytest.mark.parametrize(("key", "value"), [("slices", 2), ("cells", 2), ("window", 0.5), ("window", float("nan"))])
def test_settings_that_resolve_no_contact_are_refused(key: str, value: float) -> None:
    with pytest.raises(ValueError, match=key):
        ContactSettings(**{key: value})


def kinematics_of(pair: GearPair) -> FlankPair:
    gear = pair.pinion
    form, tip = (math.sqrt((r / gear.base_radius) ** 2 - 1) for r in (gear.form_radius, gear.tip_radius))
    return FlankPair.from_pair(pair, form, tip)


def line_roll(pair: GearPair, kinematics: FlankPair, axial: float, tooth: int, rotation: float) -> float:
    """Roll angle of the contact line on gear 1, from the generator of the involute helicoid."""
    gear = pair.pinion
    turned = rotation + tooth * gear.angular_pitch + axial * math.tan(gear.base_helix_angle) / gear.base_radius
    return math.tan(pair.working_pressure_angle) + turned


def active_lines(pair: GearPair) -> list[tuple[float, float, int, float]]:
    """(roll, axial, tooth, rotation) of points on contact lines inside the path of contact."""
    kinematics, found = kinematics_of(pair), []
    base = pair.pinion.base_radius
    for rotation in np.linspace(0, pair.pinion.angular_pitch, 7):
        for tooth in range(-3, 4):
            for axial in np.linspace(-0.5, 0.5, 9) * pair.face_width:
                roll = line_roll(pair, kinematics, float(axial), tooth, float(rotation))
                if pair.path_start + 1e-6 < base * roll < pair.path_end - 1e-6:
                    found.append((roll, float(axial), tooth, float(rotation)))
    return found


def gaps_around(pair: GearPair) -> None:
    kinematics = kinematics_of(pair)
    lines = active_lines(pair)
    assert len(lines) > 40
    for roll, axial, tooth, rotation in lines:
        gap, gear_roll = rigid_gap(kinematics, roll, axial, tooth, rotation)
        assert abs(gap) < 1e-12
        # Both roll lengths add up to (differ by) the length of the line of action between the base circles.
        sign = -1.0 if pair.gear.internal else 1.0
        between = pair.centre_distance * math.sin(pair.working_pressure_angle)
        lengths = pair.pinion.base_radius * roll + sign * pair.gear.base_radius * gear_roll
        assert sign * lengths == pytest.approx(between, abs=1e-12)
        near = [rigid_gap(kinematics, roll + step, axial, tooth, rotation)[0] for step in (-2e-2, -1e-2, 1e-2, 2e-2)]
        assert min(near) > 0
        assert near[0] > near[1]
        assert near[3] > near[2]


def test_gap_vanishes_on_the_contact_lines_and_opens_around(any_grc_pair: GearPair) -> None:
    gaps_around(any_grc_pair)
    gaps_around(any_grc_pair.with_centre_distance(any_grc_pair.centre_distance + _slack(any_grc_pair)))


def _slack(pair: GearPair) -> float:
    return -2e-4 if pair.gear.internal else 2e-4


def test_gap_opens_with_the_curvature_of_the_flanks(any_grc_pair: GearPair) -> None:
    """Next to the contact line the gap is a parabola of the sum of normal curvatures."""
    kinematics = kinematics_of(any_grc_pair)
    pinion, gear = any_grc_pair.pinion, any_grc_pair.gear
    roll = math.tan(any_grc_pair.working_pressure_angle)
    cosine = math.cos(pinion.base_helix_angle)
    sign = -1.0 if gear.internal else 1.0
    curvature = cosine / roll * (1 / pinion.base_radius + sign / gear.base_radius)
    step = 2e-4
    ahead, behind = (rigid_gap(kinematics, roll + d, 0.0, 0, 0.0)[0] for d in (step, -step))
    across = pinion.base_radius * roll * step  # along the transverse involute, perpendicular to the generator
    assert (ahead + behind) / 2 == pytest.approx(curvature * across**2 / 2, rel=2e-3)


def test_spur_gap_vanishes_on_the_contact_line() -> None:
    gear = Gear(name="gear", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
    gaps_around(GearPair(name="spur", pinion=gear, gear=gear, centre_distance=150e-3))


def test_gap_is_infinite_inside_the_base_circle_of_gear_2() -> None:
    gear = Gear(name="gear", teeth=20, normal_module=3e-3, face_width=20e-3, held_diameter=30e-3, profile_shift=0.1)
    pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=61e-3)
    assert rigid_gap(kinematics_of(pair)._replace(base_radius_2=35e-3), 0.6, 0.0, 0, 0.0)[0] == math.inf


def test_cells_cover_the_window_and_end_at_tip_edges(any_grc_pair: GearPair) -> None:
    pair = any_grc_pair
    kinematics = kinematics_of(pair)
    axial = (np.arange(24) + 0.5) / 24 * pair.face_width - pair.face_width / 2
    base, half_window = pair.pinion.base_radius, 1e-3
    teeth = np.arange(-4, 5)
    cells = lay_cells(kinematics, 0.3 * pair.pinion.angular_pitch, teeth, axial, half_window, 9)
    arc = base * cells.roll**2 / 2
    low, high = arc - cells.half_across, arc + cells.half_across
    top = base * kinematics.tip_roll_1**2 / 2
    assert high.max() <= top * (1 + 1e-12)
    regular = 2 * half_window / 9
    assert (2 * cells.half_across <= regular * 1.2 + 1e-12).all()
    # Merged or cut cells exist only at an edge.
    assert (np.abs(2 * cells.half_across - regular)[~cells.cut] < 1e-9).all()
    for tooth in np.unique(cells.tooth):
        for layer in range(24):
            own = (cells.tooth == tooth) & (cells.layer == layer)
            assert np.abs(low[own][1:] - high[own][:-1]).max(initial=0.0) < 1e-12
    # No cell beyond the tip circle of gear 2.
    tip_2 = pair.gear.tip_radius
    radius_2 = pair.gear.base_radius * np.hypot(1.0, cells.gear_roll)
    beyond = (radius_2 - tip_2) * (-1 if pair.gear.internal else 1)
    assert beyond.max() < 1e-9


def test_distant_cells_act_as_their_resultant() -> None:
    """The far formula joins the exact one within 1e-3 at the distance where it takes over."""
    for angle in np.linspace(0, np.pi / 2, 7):
        near, far = (
            mean_inverse_distance(5.5e-3 * f * math.cos(angle), 5.5e-3 * f * math.sin(angle), 2e-4, 1e-3)
            for f in (1 - 1e-9, 1 + 1e-9)
        )
        assert near == pytest.approx(far, rel=1e-3)
