"""Elastic bodies in their own turning frame: against rigid bodies, their matrices, the frame that does not turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import skfem

from exugear.system.bodies.reduction import ReducedBody, RigidInertia, with_rigid_inertia
from exugear.system.bodies.shaft_sections import MeshSize, SeatBand, ShaftSection
from exugear.system.bodies.solid_elements import SolidSeat
from exugear.system.bodies.solids import (
    SolidModel,
    gyroscopic_matrix,
    reduce_matrices,
    reduce_solid,
)
from exugear.system.bodies.turned_section import Shaft, turned_hexahedra
from exugear.system.bodies.turning_frame import TurningBody, turning_arrays
from exugear.system.kernels.turning import (
    set_turning_motion,
    turning_energies,
    turning_memory,
    turning_weight_power,
)
from fe_ste.geometry.gears import Material

STEEL = Material(210e9, 0.3, 7850.0)
PINS = ((0.2, 0.0), (-0.1, 0.2), (-0.1, -0.2))
AXIS = (0.05, -0.02)


@pytest.fixture(scope="module")
def plate() -> ReducedBody:
    """A plate with a journal on each face and three pins off the axis, which is not in the middle of the gearbox."""
    x, y = (np.linspace(-0.3, 0.3, 7) + middle for middle in AXIS)
    mesh = skfem.MeshHex2.from_mesh(skfem.MeshHex.init_tensor(x, y, [0.0, 0.06, 0.12]))
    places = {"front": (0.0, 0.0, 0.0), "rear": (0.0, 0.0, 0.12)}
    places |= {f"pin_{n}": (*place, 0.12) for n, place in enumerate(PINS)}
    seats = tuple(SolidSeat(name, (p[0] + AXIS[0], p[1] + AXIS[1], p[2]), 0.15) for name, p in places.items())
    return reduce_solid(SolidModel("plate", mesh, STEEL, seats, "carrier", 2000.0, 12e3, axis=AXIS))


@pytest.fixture(scope="module")
def body(plate: ReducedBody) -> TurningBody:
    return TurningBody(plate, 1e-6, (0.5, -9.81, 1.0))


def turned_by(body: TurningBody, q: np.ndarray, angle: float) -> np.ndarray:
    """Coordinates of the body with displacements q in its frame, turned by an angle."""
    places = np.zeros_like(q)
    for n, seat in enumerate(body.reduced.seats):
        places[6 * n : 6 * n + 2] = np.array(seat.position[:2]) - AXIS
    moved = body.rotated(q + places, angle) - places
    moved[5 : 6 * body.seat_count : 6] += angle
    return moved


def at_random(body: TurningBody, angle: float, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coordinates and velocities near a turning at a speed, and generalized forces."""
    random = np.random.default_rng(3)
    q, v, f = random.normal(size=(3, body.reduced.size))
    q = turned_by(body, 1e-5 * q, angle)
    return q, body.rolling_velocity(q, speed) + 1e-2 * v, 1e3 * f


class Motion:
    """One body by the compiled kernels."""

    def __init__(self, body: TurningBody) -> None:
        self.arrays = turning_arrays([(0, body)])
        self.memory = turning_memory(self.arrays)

    def accelerations(self, q: np.ndarray, v: np.ndarray, f: np.ndarray) -> np.ndarray:
        out = np.zeros_like(q)
        set_turning_motion(q, v, f, False, self.arrays, self.memory, out)
        return out

    def energies(self, q: np.ndarray, v: np.ndarray) -> tuple[float, float, float, float]:
        """Kinetic and elastic energy, power damped, power of the weight."""
        kinetic, stored = turning_energies(q, v, self.arrays, self.memory)
        weight = turning_weight_power(q, v, self.arrays, self.memory)
        damped = set_turning_motion(q, v, 0.0 * q, True, self.arrays, self.memory, 0.0 * q)
        return kinetic, stored, damped, weight


def integrated(
    q: np.ndarray, v: np.ndarray, step: float, steps: int, law: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Classical Runge-Kutta method."""
    for _ in range(steps):
        slopes = [(v, law(q, v))]
        for ahead in (step / 2, step / 2, step):
            dq, dv = slopes[-1]
            slopes.append((v + ahead * dv, law(q + ahead * dq, v + ahead * dv)))
        weights = (1 / 6, 1 / 3, 1 / 3, 1 / 6)
        q = q + step * sum(w * s[0] for w, s in zip(weights, slopes, strict=True))
        v = v + step * sum(w * s[1] for w, s in zip(weights, slopes, strict=True))
    return q, v


def test_compiled_accelerations_are_those_of_the_plain_law(body: TurningBody) -> None:
    other = TurningBody(replace(body.reduced, mass=2.0 * body.reduced.mass), 3e-6)
    arrays = turning_arrays([(4, body), (4 + body.reduced.size, other)])
    states = [at_random(one, angle, speed) for one, angle, speed in ((body, 40.3, 7.0), (other, -7.1, -30.0))]
    q, v, f = (np.concatenate([np.zeros(4), *values, np.zeros(6)]) for values in zip(*states, strict=True))
    found = np.full_like(q, np.nan)
    set_turning_motion(q, v, f, False, arrays, turning_memory(arrays), found)
    expected = [
        one.accelerations(*state[:2], state[2] + one.forces(*state[:2]))
        for one, state in zip((body, other), states, strict=True)
    ]
    assert np.isnan(found[:4]).all() and np.isnan(found[-6:]).all()
    # Displacements of 1e-5 m are differences of places of 0.3 m, which are rounded to some 1e-16 m.
    assert np.abs(found[4:-6] - np.concatenate(expected)).max() < 1e-10 * np.abs(found[4:-6]).max()


def test_forces_of_several_states_are_those_of_each(body: TurningBody) -> None:
    states = [at_random(body, angle, speed)[:2] for angle, speed in ((40.3, 7.0), (-7.1, -30.0), (0.2, 0.0))]
    q, v = (np.array(values).T for values in zip(*states, strict=True))
    a = np.random.default_rng(5).normal(0.0, 1.0, q.shape)
    forces = np.transpose([body.forces(*state) for state in states])
    inertia = np.transpose([body.inertia_forces(*state, own) for state, own in zip(states, a.T, strict=True)])
    assert np.abs(body.forces(q, v) - forces).max() < 1e-9 * np.abs(forces).max()
    assert np.abs(body.inertia_forces(q, v, a) - inertia).max() < 1e-9 * np.abs(inertia).max()


def test_inertia_forces_invert_accelerations(body: TurningBody) -> None:
    q, v, f = at_random(body, 40.3, 7.0)
    assert body.inertia_forces(q, v, body.accelerations(q, v, f)) == pytest.approx(f, abs=1e-9 * np.abs(f).max())


@pytest.mark.parametrize(("angle", "speed"), [(0.0, 0.0), (0.4, 3.0), (1234.5, -60.0)])
def test_power_is_balanced_at_every_state(body: TurningBody, angle: float, speed: float) -> None:
    # d/dt of w M w / 2 + q K q / 2 with the accelerations of the compiled law = power of loads and weight - damped.
    motion = Motion(body)
    q, v, f = at_random(body, angle, speed)
    a = motion.accelerations(q, v, f)
    mass, stiffness = body.reduced.mass, body.reduced.stiffness
    psi, omega = body.angle(q), body.angle(v)
    w, moved = body.rotated(v, -psi), body.to_body_frame(q)
    rates = w - omega * (body.reduced.spin + body.quarter_turned(moved))
    h = 1e-5  # the displacements are nearly linear in time over this
    assert (body.to_body_frame(q + h * v) - body.to_body_frame(q - h * v)) / (2 * h) == pytest.approx(rates, abs=1e-5)
    slower = body.rotated(a, -psi) - omega * body.quarter_turned(w)
    change = w @ mass @ slower + rates @ stiffness @ moved
    kinetic, stored, damped, weight = motion.energies(q, v)
    assert (kinetic, stored) == pytest.approx((0.5 * w @ mass @ w, 0.5 * moved @ stiffness @ moved), rel=1e-10)
    # Round-off: the terms are some 1e5 W, at angles of 1e3 rad displacements of 1e-5 m have 1e-13 rad x 0.2 m.
    scale = np.abs(v) @ np.abs(f) + np.abs(rates) @ np.abs(stiffness @ moved)
    assert change == pytest.approx(v @ f + weight - damped, abs=(1e-10 if angle < 1.0 else 1e-8) * scale)


def test_nothing_changes_when_everything_is_turned(body: TurningBody) -> None:
    motion = Motion(replace(body, gravity=(0.0, 0.0, 3.0)))
    q, v, f = at_random(body, 0.0, 5.0)
    found = motion.accelerations(q, v, f)
    angle = 2.1 + 40 * np.pi
    again = motion.accelerations(turned_by(body, q, angle), body.rotated(v, angle), body.rotated(f, angle))
    # Round-off of the turning, 1e-14 m times the stiffness over the mass.
    assert body.rotated(again, -angle) == pytest.approx(found, abs=1e-8 * np.abs(found).max())


def rigid(angles: np.ndarray) -> np.ndarray:
    """Rotation of Tait-Bryan angles Rx Ry Rz."""
    (a, b, g) = angles
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(g), -np.sin(g), 0], [np.sin(g), np.cos(g), 0], [0, 0, 1]])
    return np.asarray(x @ y @ z)


def carried(body: ReducedBody, motion: np.ndarray) -> np.ndarray:
    """Coordinates of the body that moves as a rigid one: displacement of its centre of mass, and its angles."""
    centre = np.array(body.rigid_inertia.centre)
    q = np.zeros(body.size)
    for n, seat in enumerate(body.seats):
        arm = np.array(seat.position) - centre
        q[6 * n : 6 * n + 6] = [*(motion[:3] + rigid(motion[3:]) @ arm - arm), *motion[3:]]
    return q


def rigid_forces(inertia: RigidInertia, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Lagrange's equations of a symmetrical rigid body on angles Rx Ry Rz, T by hand."""
    sine, cosine = np.sin(q[4]), np.cos(q[4])
    momentum = inertia.axial * (v[5] + v[3] * sine)
    change = inertia.axial * (a[5] + a[3] * sine + v[3] * v[4] * cosine)
    first = inertia.transverse * (a[3] * cosine**2 - 2 * v[3] * v[4] * sine * cosine)
    first += change * sine + momentum * v[4] * cosine
    second = inertia.transverse * (a[4] + v[3] ** 2 * sine * cosine) - momentum * v[3] * cosine
    return np.array([*(inertia.mass * a[:3]), first, second, change])


def rates_of(law: Callable[[float], np.ndarray], h: float) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative at zero by central differences of sixth order."""
    values = np.array([law(n * h) for n in range(-3, 4)])
    return values.T @ [-1 / 60, 3 / 20, -3 / 4, 0, 3 / 4, -3 / 20, 1 / 60] / h, values.T @ [
        1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90
    ] / h**2  # fmt: skip


def rigid_residual(reduced: ReducedBody, speed: float, frequency: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Forces that a rigid motion of the reduced body needs, and those of the rigid body.

    The body turns while its centre and tilts vibrate. Elastic forces hold the shape, also against the centrifugal force
    of the balanced body, and do no work on rigid motions; what is left is projected on these.
    """
    free = TurningBody(replace(reduced, stiffness=np.zeros_like(reduced.stiffness)), 0.0)
    amplitude = size * np.array([0.3, 0.2, 0.1, 1.0, 0.8, 0.0])

    def motion(t: float) -> np.ndarray:
        phase = np.array([0.3, 1.1, 2.0, 0.7, 1.9, 0.0]) + np.array([1.0, 1.3, 0.8, 1.0, 1.2, 0.0]) * frequency * t
        return np.array([*(amplitude * np.cos(phase))[:5], 0.4 + speed * t])

    h = 1e-2 / frequency
    now = motion(0.0)
    v, a = rates_of(lambda t: carried(reduced, motion(t)), h)
    along = np.array([rates_of(lambda t, e=e: carried(reduced, now + t * e), 1e-4)[0] for e in np.eye(6)])
    q = carried(reduced, now)
    stretching = free.rotated(speed**2 * free.centrifugal, free.angle(q))
    found = along @ (free.inertia_forces(q, v, a) + stretching - free.forces(q, v))
    return found, rigid_forces(reduced.rigid_inertia, now, *rates_of(motion, h))


def test_a_rigid_motion_needs_the_forces_of_a_rigid_body(plate: ReducedBody) -> None:
    # With seats off the axis to first order in the speed: tilts vibrate fast, and moments of the gyroscope are 2 % of
    # the whole. Tilts of 1e-5 rad: quadratic terms, which the law leaves out, are 1e-5 of the rest, those with
    # the square of the speed over that of the vibrations 1e-4.
    for speed in (0.0, 3.0, -3.0):
        found, expected = rigid_residual(plate, speed, 300.0, 1e-5)
        without = rigid_residual(plate, 0.0, 300.0, 1e-5)[1]
        for part in (slice(0, 3), slice(3, 5)):
            assert found[part] == pytest.approx(expected[part], abs=2e-4 * np.abs(expected[part]).max())
        if speed:
            assert np.abs(expected - without)[3:5].max() > 1e-2 * np.abs(expected[3:5]).max()


def test_a_disc_on_the_axis_is_a_gyroscope_at_any_speed(shaft: SolidModel) -> None:
    # Here terms in the square of the speed are exact, too: tilts as slow as the spin.
    for speed in (30.0, -100.0):
        found, expected = rigid_residual(reduce_solid(shaft), speed, 30.0, 1e-5)
        for part in (slice(0, 3), slice(3, 5)):
            assert found[part] == pytest.approx(expected[part], abs=5e-5 * np.abs(expected[part]).max())


def test_another_rigid_inertia_keeps_the_law_of_a_rigid_body(plate: ReducedBody) -> None:
    old = plate.rigid_inertia
    wanted = RigidInertia(1.3 * old.mass, (*AXIS, 0.08), 1.1 * old.transverse, 1.6 * old.axial)
    changed = with_rigid_inertia(plate, wanted)
    assert changed.free_frequencies[:3] == pytest.approx(plate.free_frequencies[:3], rel=1e-9)
    assert changed.rigid_inertia.centre == pytest.approx(wanted.centre, abs=1e-12)
    found, expected = rigid_residual(changed, 3.0, 300.0, 1e-5)
    for part in (slice(0, 3), slice(3, 5)):
        assert found[part] == pytest.approx(expected[part], abs=2e-4 * np.abs(expected[part]).max())


def test_displacements_vibrate_as_mass_coriolis_and_stiffness_say(plate: ReducedBody) -> None:
    # Second method: M q'' + 2 Omega C q' + K q = 0 by the matrix exponential, the common spin taken out of both; the
    # law vibrates about its centrifugal expansion. In 0.5 ms at 20 rad/s Coriolis forces do some 1e-3 of the
    # displacement; terms in the square of the speed, (20 / omega)^2 = 1e-5 at the lowest 975 Hz, few times that.
    body, speed, time = TurningBody(plate, 0.0), 20.0, 5e-4
    motion, size, spin = Motion(body), plate.size, plate.spin
    expanded = np.linalg.lstsq(plate.stiffness, speed**2 * body.centrifugal)[0]
    expanded -= spin * (body.angle_weights @ expanded)
    inverse, lowest = np.linalg.inv(plate.mass), scipy.linalg.eigh(plate.stiffness, plate.mass)[1][:, :9]
    errors = []
    for coriolis in (plate.gyroscopic, np.zeros((size, size))):
        lower = np.hstack([-inverse @ plate.stiffness, -speed * inverse @ coriolis])
        exponential = scipy.linalg.expm(time * np.vstack([np.eye(size, 2 * size, size), lower]))
        # From velocities of seats: signs of modes, and directions among equal frequencies, are each machine's own.
        rates = np.zeros(size)
        rates[: 6 * body.seat_count] = 1e-3 * np.random.default_rng(2).normal(size=6 * body.seat_count)
        rates = lowest @ (lowest.T @ plate.mass @ rates)
        rates -= spin * (body.angle_weights @ rates)
        start = rates + speed * (spin + body.quarter_turned(expanded))
        q, _ = integrated(expanded, start, time / 250, 250, lambda q, v: motion.accelerations(q, v, np.zeros(size)))
        expected = (exponential @ np.concatenate([np.zeros(size), rates]))[:size]
        expected -= spin * (body.angle_weights @ expected)
        errors.append(np.abs(body.to_body_frame(q) - expanded - expected).max() / np.abs(expected).max())
    assert errors[0] < 1e-4 < 3e-4 < errors[1]


@pytest.mark.validation
def test_a_shaft_moves_alike_in_its_own_frame_and_in_one_that_does_not_turn(shaft: SolidModel) -> None:
    # Kicked at one end and free, at 30 rad/s; bending is at 1080 Hz, so that what is left out, (Omega / omega)^2 of
    # its restoring force, is 2e-5, while the gyroscopic effect on the tilts is of order one.
    own = reduce_solid(shaft)
    still = gyroscopic_matrix(replace(shaft, frame="nonrotating"), reduce_matrices(shaft))
    motion, speed = Motion(TurningBody(own, 0.0)), 30.0
    inverse, momentum = np.linalg.inv(own.mass), own.mass @ own.spin / (own.spin @ own.mass @ own.spin)

    def nonrotating(q: np.ndarray, v: np.ndarray, gyroscopic: np.ndarray = still) -> np.ndarray:
        moved = q - own.spin * q[5]
        return np.asarray(-inverse @ (own.stiffness @ moved + (momentum @ v) * (gyroscopic @ v)))

    kick = np.zeros(own.size)
    kick[[0, 1, 3, 4]] = 0.01, -0.02, 0.3, 0.1
    start = speed * own.spin + inverse @ own.mass[:, :12] @ kick[:12]
    steps, step = 2500, 2e-5
    ends = [
        integrated(np.zeros(own.size), start, step, steps, law)[0][:12]
        for law in (
            lambda q, v: motion.accelerations(q, v, np.zeros(own.size)),
            nonrotating,
            lambda q, v: nonrotating(q, v, np.zeros_like(still)),
        )
    ]
    assert ends[0][[5, 11]] == pytest.approx(ends[1][[5, 11]], rel=1e-6)
    for kind in ([0, 1, 6, 7], [3, 4, 9, 10]):
        size = np.abs(ends[1][kind]).max()
        assert ends[0][kind] == pytest.approx(ends[1][kind], abs=5e-5 * size)
        assert np.abs(ends[2][kind] - ends[1][kind]).max() > 0.1 * size


@pytest.fixture(scope="module")
def shaft() -> SolidModel:
    """A shaft with a disc, turned, on two plane seats; seen from its own frame."""
    sections = (ShaftSection(0.2, 0.06), ShaftSection(0.05, 0.3), ShaftSection(0.2, 0.06))
    bands = (SeatBand("left", 0.0), SeatBand("right", 0.45))
    seats = tuple(SolidSeat(name, (0.0, 0.0, z), 0.03) for name, z in (("left", 0.0), ("right", 0.45)))
    mesh = turned_hexahedra(Shaft(sections, STEEL, bands, MeshSize(0.1, 0.1, 0)), 8)
    return SolidModel("shaft", mesh, STEEL, seats, "carrier", 500.0, 12e3)


def test_an_unbalanced_rotor_pulls_with_its_centrifugal_force(plate: ReducedBody) -> None:
    inertia = plate.rigid_inertia
    weight = np.zeros(plate.size)
    weight[6 * 2 : 6 * 2 + 3] = 50.0  # kg on a pin
    heavy = replace(plate, mass=plate.mass + np.diag(weight), gyroscopic=plate.gyroscopic + 2 * coriolis_of(weight))
    force = TurningBody(heavy, 0.0)
    v = force.rolling_velocity(np.zeros(plate.size), 4.0)
    needed = force.inertia_forces(np.zeros(plate.size), v, force.rolling_acceleration(np.zeros(plate.size), 4.0, 0.0))
    motions = plate.rigid_motions((*AXIS, 0.0))
    expected = np.zeros(6)
    expected[0] = -50.0 * 0.2 * 16.0
    expected[4] = expected[0] * 0.12
    assert motions.T @ needed == pytest.approx(expected, abs=1e-9 * inertia.mass)


def coriolis_of(weight: np.ndarray) -> np.ndarray:
    """Matrix m phi_i . (e_z x phi_j) of point masses."""
    matrix = np.zeros((weight.size,) * 2)
    for i in np.flatnonzero(weight)[::3]:
        matrix[i, i + 1], matrix[i + 1, i] = -weight[i], weight[i]
    return matrix
