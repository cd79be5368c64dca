"""Seats that travel around an elastic ring."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.sparse

from exugear.system.bodies.shaft_sections import MeshSize, SeatBand, ShaftSection
from exugear.system.bodies.solid_elements import SolidSeat, assemble, seat_rows
from exugear.system.bodies.turned_section import Shaft, turned_hexahedra
from exugear.system.kernels.turning import (
    TravellingArrays,
    follow,
    place_travelling,
    share_travelling_forces,
    travelling_memory,
    travelling_tangent,
)
from fe_ste.elimination import factorise
from fe_ste.geometry.gears import Material

NUMBER = 9
SIZE = 6 * NUMBER + 1
"""Sectors, then the angle of the frame."""


@pytest.fixture
def seats() -> TravellingArrays:
    """Two seats that travel with the last coordinate, 0.3 and 2.4 rad ahead of it."""
    middles = 2.0 * np.pi * np.arange(NUMBER) / NUMBER
    return TravellingArrays(
        first=np.array([SIZE, SIZE + 6]),
        frame=np.array([SIZE - 1, SIZE - 1]),
        angle=np.array([0.3, 2.4]),
        number=np.array([NUMBER, NUMBER]),
        sectors=np.tile(6 * np.arange(NUMBER), (2, 1)),
        axes=np.tile(np.stack([np.cos(middles), np.sin(middles)], axis=1), (2, 1, 1)),
    )


def at_angle(seats: TravellingArrays, sectors: np.ndarray, angle: float) -> np.ndarray:
    """Motion (6,) of the first seat when it is at an angle from the first sector."""
    q = np.append(sectors, angle - seats.angle[0])
    return follow(q[None], np.zeros((1, SIZE)), seats)[0][0, SIZE : SIZE + 6]


def state(seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    return random.normal(size=SIZE), random.normal(size=SIZE)


def test_rigid_motion_is_the_same_everywhere(seats: TravellingArrays) -> None:
    motion = np.arange(1.0, 7.0)
    for angle in np.linspace(0.0, 7.0, 23):
        assert at_angle(seats, np.tile(motion, NUMBER), angle) == pytest.approx(motion, abs=1e-13)


def test_in_the_middle_of_a_sector_is_the_sectors_motion(seats: TravellingArrays) -> None:
    q, _ = state()
    for k in range(NUMBER):
        own = q[6 * k : 6 * k + 6]
        assert at_angle(seats, q[:-1], 2.0 * math.pi * k / NUMBER) == pytest.approx(own, abs=1e-13)


@pytest.mark.parametrize("waves", range((NUMBER - 1) // 2 + 1))
def test_waves_of_radial_and_tangential_motion_are_met_between_sectors(seats: TravellingArrays, waves: int) -> None:
    def motion(angle: float) -> np.ndarray:
        radial, along, axial = math.cos(waves * angle + 0.4), math.sin(waves * angle), math.cos(waves * angle - 1.0)
        c, s = math.cos(angle), math.sin(angle)
        vector = np.array([radial * c - along * s, radial * s + along * c, axial])
        return np.concatenate([vector, 2.0 * vector])

    sectors = np.concatenate([motion(2.0 * math.pi * k / NUMBER) for k in range(NUMBER)])
    for angle in np.linspace(0.0, 6.0, 11):
        assert at_angle(seats, sectors, angle) == pytest.approx(motion(angle), abs=1e-13)


def test_rates_are_the_derivatives_of_motions(seats: TravellingArrays) -> None:
    q, v = state()
    step = 1e-6
    ends = [follow((q + side * step * v)[None], v[None], seats)[0][0] for side in (1.0, -1.0)]
    # Central differences: error step^2 times the third derivative, which is below 1e3 here.
    assert follow(q[None], v[None], seats)[1][0] == pytest.approx((ends[0] - ends[1]) / (2.0 * step), abs=1e-8)


def shares_at(x: np.ndarray, seats: TravellingArrays) -> np.ndarray:
    shares = travelling_memory(seats)
    place_travelling(x.copy(), np.zeros_like(x), seats, shares)
    return shares


def test_forces_do_the_same_work_on_sectors_and_frame(seats: TravellingArrays) -> None:
    q, v = state()
    x, u = (values[0] for values in follow(q[None], v[None], seats))
    force = np.random.default_rng(5).normal(size=x.size)
    force[-1] = 0.0  # what stays zero takes no force
    shared = force.copy()
    share_travelling_forces(seats, shares_at(x, seats), shared)
    assert not shared[SIZE:].any()
    assert shared @ u == pytest.approx(force @ u, rel=1e-13)


def test_tangent_is_the_derivative_of_a_law_on_travelling_seats(seats: TravellingArrays) -> None:
    random = np.random.default_rng(11)
    stiffness, damping = random.normal(size=(2, SIZE + 13, SIZE + 13))
    stiffness[-1] = damping[-1] = 0.0

    def forces(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        x, u = (values[0] for values in follow(q[None], v[None], seats))
        f = stiffness @ x + damping @ u
        share_travelling_forces(seats, shares_at(x, seats), f)
        return f[:SIZE]

    q, v = state()
    x, u = (values[0] for values in follow(q[None], v[None], seats))
    place, rate, turning = travelling_tangent(x, u, stiffness @ x + damping @ u, seats)
    by_q, by_v = place.T @ (stiffness @ place + damping @ rate) + turning, place.T @ damping @ place
    step = 1e-6
    moves, rates = step * np.eye(SIZE), np.eye(SIZE)
    found_q = np.array([forces(q + e, v) - forces(q - e, v) for e in moves]).T / (2.0 * step)
    found_v = np.array([forces(q, v + e) - forces(q, v - e) for e in rates]).T / 2.0  # linear in the rates
    assert np.abs(by_q - found_q).max() < 1e-7 * np.abs(by_q).max()  # central differences, as above
    assert np.abs(by_v - found_v).max() < 1e-12 * np.abs(by_v).max()


OUTER, INNER, WIDTH = 0.595, 0.5235, 0.23
"""Rim of the GRC's ring, m."""


@pytest.fixture(scope="module")
def compliance() -> np.ndarray:
    """Compliance (66, 66) among nine sectors of a rim on soft flanges, one half a sector further, and both flanges."""
    size, steel = MeshSize(axial=WIDTH / 2.0, radial=0.08), Material(206e9, 0.3, 7850.0)
    shaft = Shaft((ShaftSection(WIDTH, 2.0 * OUTER, 2.0 * INNER),), steel, (SeatBand("rim", WIDTH / 2.0, WIDTH),), size)
    solid = assemble(turned_hexahedra(shaft, 72), steel)
    part = 2.0 * math.pi / NUMBER

    def sector(name: str, middle: float) -> SolidSeat:
        return SolidSeat(name, (0.0, 0.0, WIDTH / 2.0), OUTER, WIDTH, sector=(middle, part))

    flanges = [SolidSeat(f"flange {z}", (0.0, 0.0, z), OUTER, inner_radius=INNER) for z in (0.0, WIDTH)]
    sectors = [sector(f"sector {k}", k * part) for k in range(NUMBER)]
    held = seat_rows(solid, flanges)
    rows = np.vstack([seat_rows(solid, sectors), seat_rows(solid, [sector("between", part / 2.0)]), held])
    springs = scipy.sparse.diags_array(np.tile([1e9, 1e9, 1e9, 3e8, 3e8, 3e8], 2))
    stiffness = solid.stiffness + scipy.sparse.csr_array(held.T) @ springs @ scipy.sparse.csr_array(held)
    with factorise(scipy.sparse.csr_array(stiffness), "superlu") as factors:
        found: np.ndarray = rows @ factors.solve(rows.T)
    return found


def seen_at_rim(angle: float) -> np.ndarray:
    """Radial, tangential and axial displacement (3, 6) of the rim at an angle, of a motion about the axis."""
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    arm = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, OUTER], [0.0, -OUTER, 0.0]])
    return np.hstack([turn, arm @ turn])


@pytest.mark.validation
def test_a_load_that_travels_around_a_round_ring_meets_the_same_compliance(
    seats: TravellingArrays, compliance: np.ndarray
) -> None:
    own = compliance[: 6 * NUMBER, : 6 * NUMBER]
    found = []
    for angle in np.linspace(0.0, 2.0, 7):
        share = seen_at_rim(angle) @ np.stack([at_angle(seats, e, angle) for e in np.eye(6 * NUMBER)], axis=1)
        found.append(share @ own @ share.T)
    # A ring of equal sectors is a circulant, whose diagonal the polynomial keeps; the mesh is round to 1e-12.
    assert np.ptp(found, axis=0).max() < 1e-10 * np.abs(found[0]).max()


def test_half_a_sector_further_a_ring_yields_as_a_sector_of_its_own(
    seats: TravellingArrays, compliance: np.ndarray
) -> None:
    between, part = math.pi / NUMBER, 2.0 * math.pi / NUMBER
    share = seen_at_rim(between) @ np.stack([at_angle(seats, e, between) for e in np.eye(6 * NUMBER)], axis=1)
    middle = slice(6 * NUMBER, 6 * NUMBER + 6)
    own = seen_at_rim(between) @ compliance[middle, middle] @ seen_at_rim(between).T
    for k in range(NUMBER):
        at = slice(6 * k, 6 * k + 6)
        there = seen_at_rim(k * part).T
        interpolated = share @ compliance[: 6 * NUMBER, at] @ there
        direct = seen_at_rim(between) @ compliance[middle, at] @ there
        # Waves beyond the fourth are not seen: measured 3 % of the compliance under the load itself.
        assert np.abs(interpolated - direct).max() < 0.04 * np.abs(own).max()
