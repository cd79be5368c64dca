"""The GRC's main shaft with hub and rotor: against beam theory, and in the gearbox."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.bearings.rolling.contact import pitch_averaged_tangent
from exugear.system.bearings.stiffness import axially_symmetric
from exugear.system.bodies.of_gearbox import shaft_model
from exugear.system.bodies.reduction import ReducedBody
from exugear.system.bodies.shaft_sections import ShaftSection
from exugear.system.bodies.turned_shaft import ShaftModel, reduce_shaft
from exugear.system.loads import LoadTable
from exugear.system.modes import BODY_MOTIONS, modes_of
from exugear.system.statics import accelerating_start, linearise
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem
from exugear.transient.exudyn_model.system import ExudynSystem

from ...cases.assembled import assembled, modes_with_bodies
from ...cases.plain_motion import accelerations_of
from ...cases.reduced import first_coordinate
from ...cases.roller_bearings import BearingPair, TaperedRollerBearing

TORQUE = {"main_shaft": 240e3}
YOUNG, SHEAR, DENSITY = 206e9, 206e9 / 2.6, 7850.0
MAIN_BEARING = 0.3 * 1.25e10
"""Radial stiffness with the housing factor, N/m."""


@pytest.fixture(scope="module")
def with_shaft(grc_shafts: Gearbox) -> Gearbox:
    # What is looked at lies below 100 Hz: a band of 1 kHz saves coordinates. The housing is the ground.
    changes = {"bodies.main_shaft.enabled": True, "static_load.torques_N_m": TORQUE, "elasticity.band_Hz": 1000.0}
    return grc_shafts.varied(changes)


@pytest.fixture(scope="module")
def model(with_shaft: Gearbox) -> ShaftModel:
    return shaft_model(with_shaft, "main_shaft")


@pytest.fixture(scope="module")
def reduced(model: ShaftModel) -> ReducedBody:
    return reduce_shaft(model)


@pytest.fixture(scope="module")
def flexible(with_shaft: Gearbox, stiffness: dict) -> Assembly:
    return assembled(with_shaft, Choice("flexible"), stiffness)


def beam(sections: tuple[ShaftSection, ...], lines: list[float]) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Mass and stiffness of a stepped Timoshenko beam in a plane (deflection, slope by node), and its nodes in z."""
    ends = np.cumsum([0.0, *(section.length for section in sections)])
    places = sorted({round(float(z), 9) for z in (*ends, *lines, *np.arange(0.02, ends[-1], 0.02))})
    mass, stiffness = (np.zeros((2 * len(places), 2 * len(places))) for _ in range(2))
    for n, (start, end) in enumerate(zip(places[:-1], places[1:], strict=True)):
        section = sections[int(np.searchsorted(ends, (start + end) / 2)) - 1]
        own = slice(2 * n, 2 * n + 4)
        for whole, part in zip((mass, stiffness), beam_element(section, end - start), strict=True):
            whole[own, own] += part
    return mass, stiffness, places


def beam_element(section: ShaftSection, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Two-node beam, linear shapes with one integration point for shear: converges with h^2 at 2 cm."""
    outer, inner = section.outer_diameter, section.inner_diameter
    area, inertia = math.pi / 4 * (outer**2 - inner**2), math.pi / 64 * (outer**4 - inner**4)
    m = inner / outer  # Cowper's shear coefficient of a tube
    shear = 6 * 1.3 * (1 + m**2) ** 2 / ((7 + 1.8) * (1 + m**2) ** 2 + (20 + 3.6) * m**2)
    bend = np.array([0.0, -1.0, 0.0, 1.0]) / length
    slide = np.array([-1.0 / length, -0.5, 1.0 / length, -0.5])
    # Residual bending flexibility makes the linear element exact in its nodes.
    stiff = 1.0 / (1.0 / (shear * SHEAR * area) + length**2 / (12.0 * YOUNG * inertia))
    stiffness = length * (YOUNG * inertia * np.outer(bend, bend) + stiff * np.outer(slide, slide))
    pair = DENSITY * length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    mass = np.zeros((4, 4))
    mass[np.ix_([0, 2], [0, 2])], mass[np.ix_([1, 3], [1, 3])] = area * pair, inertia * pair
    return mass, stiffness


def frequencies(mass: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(scipy.linalg.eigh(stiffness, mass, eigvals_only=True), 0.0)) / (2 * np.pi)


@pytest.mark.validation
def test_the_shaft_alone_bends_free_as_a_timoshenko_beam(model: ShaftModel) -> None:
    # Behind the flange, with mild steps; reached are 0.05 and 0.2 %, for a beam takes shoulders as carrying at once.
    sections = model.sections[2:]
    moved = sum(section.length for section in model.sections[:2])
    seats = tuple(replace(seat, z=seat.z - moved) for seat in model.seats if seat.name != "torque")
    shaft = reduce_shaft(replace(model, sections=sections, seats=seats, blanks={}))
    mass, stiffness, _ = beam(sections, [])
    expected = frequencies(mass, stiffness)[2:4]
    assert shaft.summary.free_interface_frequencies["bending"][:2] == pytest.approx(expected, rel=4e-3)


@pytest.mark.validation
def test_the_rotor_on_its_bearings_nods_as_on_a_beam(model: ShaftModel, reduced: ReducedBody) -> None:
    # Main bearing as a spring, shrink disc clamped. The flange dishes under the hub's tube, which a beam does not: 3 %.
    places = {seat.name: seat.z for seat in model.seats}
    mass, stiffness, lines = beam(model.sections, list(places.values()))
    at = {name: 2 * lines.index(round(z, 9)) for name, z in places.items()}
    blank = model.blanks["torque"]
    mass[at["torque"], at["torque"]] += blank.mass
    mass[at["torque"] + 1, at["torque"] + 1] += blank.transverse
    stiffness[at["main_bearing"], at["main_bearing"]] += MAIN_BEARING
    free = [n for n in range(len(mass)) if n not in (at["shrink_disc"], at["shrink_disc"] + 1)]
    expected = frequencies(mass[np.ix_(free, free)], stiffness[np.ix_(free, free)])[:2]
    held = reduced.stiffness.copy()
    across = first_coordinate(reduced, "main_bearing")
    held[across, across] += MAIN_BEARING
    clamp = first_coordinate(reduced, "shrink_disc")
    plane = next(block for block in reduced.blocks if across in block)
    left = [n for n in plane if n not in range(clamp, clamp + 6)]
    found = frequencies(reduced.mass[np.ix_(left, left)], held[np.ix_(left, left)])[:2]
    assert found == pytest.approx(expected, rel=0.04)
    assert np.all(found < expected)


def twist_per_torque(model: ShaftModel) -> float:
    """Sum of length / G J from the hub's centre to the shrink disc, rad / (N m)."""
    end, total, start = next(s.z for s in model.seats if s.name == "shrink_disc"), 0.0, 0.0
    for section in model.sections:
        length = min(section.length, end - start)
        total += length / (SHEAR * math.pi / 32 * (section.outer_diameter**4 - section.inner_diameter**4))
        start += section.length
    return total


def test_the_shaft_winds_up_as_its_sections_say(reduced: ReducedBody, model: ShaftModel, with_shaft: Gearbox) -> None:
    hub, disc = (first_coordinate(reduced, seat) + 5 for seat in ("torque", "shrink_disc"))
    free = [n for n in next(block for block in reduced.blocks if hub in block) if n != disc]
    load = np.array([float(n == hub) for n in free])
    wound = np.linalg.solve(reduced.stiffness[np.ix_(free, free)], load)[free.index(hub)]
    assert wound == pytest.approx(twist_per_torque(model), rel=0.03)  # shoulders do not carry at once
    assert wound > twist_per_torque(model)
    # The option without this body takes a round-bar estimate.
    estimate = with_shaft.case.couplings["main_shaft"].stiffness_N_m_per_rad
    assert 1 / wound == pytest.approx(estimate, rel=0.15)


@pytest.mark.validation
def test_the_rotor_turns_against_the_gearbox_as_two_inertias(flexible: Assembly, model: ShaftModel) -> None:
    modes = modes_of(flexible)
    rotor = flexible.gearbox.body("main_shaft").axial
    linear = flexible.unloaded  # what is stored in proportion to the torque: bearings through the origin
    state = accelerating_start(linear, TORQUE)
    train = 240e3 / state.rates["carrier"] - rotor
    assert train == pytest.approx(5.97e3, rel=1e-3)  # 5.96e3 by the case file, and the shaft beyond the main bearing
    wound = modes.strain[:, modes.element_names.index("main_shaft_body")] > 0.8
    turning = modes.kinetic[:, :, BODY_MOTIONS.index("spin")].sum(axis=1) > 0.8
    (seen,) = np.flatnonzero(wound & turning)

    def two_inertias(stiffness: float) -> float:
        return math.sqrt(stiffness * (1 / rotor + 1 / train)) / (2 * math.pi)

    shaft_alone = two_inertias(1 / (twist_per_torque(model) + 1 / 9.3e9))
    assert 0.88 * shaft_alone < modes.frequency[seen] < shaft_alone  # the gearbox winds up, too
    # Rayleigh: with all that is stored while the rotor accelerates the train by the torque that the train takes.
    through = 240e3 * train / (train + rotor)
    stored = 0.5 * state.q @ linearise(linear, state.q).total_stiffness @ state.q
    assert modes.frequency[seen] == pytest.approx(two_inertias(through**2 / (2 * stored)), rel=5e-3)


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_rigid_variants_take_the_shaft_as_a_rigid_body(
    grc: Gearbox, with_shaft: Gearbox, stiffness: dict, variant: str
) -> None:
    plain, found = (modes_with_bodies(case, Choice(variant), stiffness) for case in (grc, with_shaft))
    assert found.frequency[0] == 0.0
    assert found.frequency[1] > 1.0
    assert len(found.frequency) == len(plain.frequency) + (1 if variant == "rigid" else 6)
    start = accelerating_start(found.assembly, {"main_shaft": 240e3, "hss": -3000.0}, 2.0)
    assert start.v[found.assembly.spin["main_shaft"]] == pytest.approx(2.0)


def test_both_solvers_join_the_shaft_to_the_carrier_at_its_seat(flexible: Assembly) -> None:
    rest = np.zeros(flexible.size)
    _, found, _ = ExudynSystem(flexible, rest, rest, LoadTable(), with_meshes=False).linearised()
    linear = linearise(flexible, rest)
    expected = sum(linear.stiffness[name] for name in linear.stiffness if name not in flexible.mesh_names)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    start = accelerating_start(flexible, TORQUE, 2.0)
    q = start.q + 1e-6 * np.random.default_rng(3).normal(size=flexible.size)
    compiled = CompiledSystem(flexible, q, start.v, LoadTable(TORQUE), 1e-5).accelerations()
    plain = accelerations_of(flexible, q, start.v, flexible.torque_vector(TORQUE))
    assert np.abs(compiled - plain).max() < 1e-9 * np.abs(plain).max()


def test_the_main_bearing_is_as_stiff_as_two_rows_whose_pressure_lines_meet_on_the_axis(with_shaft: Gearbox) -> None:
    angle = math.radians(11.0)
    row = TaperedRollerBearing(  # the given stiffness was taken from straight rollers of this length
        bore=0.38, outside_diameter=0.56, width=0.09, contact_angle=angle, effective_length=0.0675, profile_factor=0.0
    )
    pair = BearingPair(bearing=row, arrangement="X", row_distance=0.47 * math.tan(angle))
    found = np.diag(axially_symmetric(pitch_averaged_tangent(pair, (200e3, 0.0, 0.0))))
    given = with_shaft.case.bearings["main_bearing"].stiffness
    assert given is not None
    assert given.radial_N_per_m == pytest.approx(found[0], rel=0.05)  # given with two digits
    assert given.axial_N_per_m == pytest.approx(found[2], rel=0.05)
    assert found[3] < 0.02 * found[0] * 0.2**2  # such rows align themselves
