"""The Exudyn system against the assembly it is built from, and one mechanism against another."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.variant import VariantError
from exugear.system.build import assemble
from exugear.system.kernels.connectors import add_connector_forces
from exugear.system.kernels.coordinates import add_spring_forces
from exugear.system.loads import LoadTable
from exugear.system.modes import modes_of
from exugear.system.statics import StartState, accelerating_start, linearise
from exugear.system.system import Assembly
from exugear.transient.exudyn_model.system import ExudynSystem

from ...cases.assembled import assembled
from ...cases.plain_motion import accelerations_of

LOAD = {"carrier": 240e3, "hss": -3000.0}
STEP = 2.5e-5


def started(grc: Gearbox, stiffness: dict, variant: str, speed: float = 0.0) -> tuple[Assembly, StartState]:
    assembly = assembled(grc, Choice(variant), stiffness)
    return assembly, accelerating_start(assembly, LOAD, speed)


def trajectory(system: ExudynSystem, steps: int, step: float = STEP, explicit: bool = True) -> np.ndarray:
    rows: list[np.ndarray] = []

    def keep(t: float, q: np.ndarray, v: np.ndarray) -> bool:
        rows.append(np.concatenate([[t], q, v]))
        return True

    system.run(0.0, steps, step, keep, explicit)
    return np.array(rows)


def test_observer_sees_start_and_every_step(grc: Gearbox, stiffness: dict) -> None:
    assembly, start = started(grc, stiffness, "rigid")
    rows = trajectory(ExudynSystem(assembly, start.q, start.v, LoadTable(LOAD)), 10)
    assert rows[:, 0] == pytest.approx(STEP * np.arange(11), abs=1e-15)
    assert np.array_equal(rows[0, 1 : 1 + assembly.size], start.q)


def test_both_mesh_routes_give_the_same_trajectory(grc: Gearbox, stiffness: dict) -> None:
    assembly, start = started(grc, stiffness, "bushing", 2.3)
    found = [
        trajectory(ExudynSystem(assembly, start.q, start.v, LoadTable(LOAD), route), 40)[-1]
        for route in ("element", "loads")
    ]
    # The same forces by another path: round-off only.
    scale = np.abs(found[0]).max()
    assert np.abs(found[0] - found[1]).max() < 1e-12 * scale


def test_repeated_runs_are_bitwise_equal(grc: Gearbox, stiffness: dict) -> None:
    assembly, start = started(grc, stiffness, "bushing")
    first, second = (trajectory(ExudynSystem(assembly, start.q, start.v, LoadTable(LOAD)), 100) for _ in range(2))
    assert np.array_equal(first, second)


def test_matrices_of_exudyn_are_those_of_the_assembly(grc: Gearbox, stiffness: dict) -> None:
    """Bearings and couplings at rest, meshes left out."""
    assembly = assemble(grc, Choice("bushing"), stiffness)
    rest = np.zeros(assembly.size)
    system = ExudynSystem(assembly, rest, rest, LoadTable(), with_meshes=False)
    mass, stiff, damping = system.linearised()
    linear = linearise(assembly, rest)
    others = [name for name in linear.stiffness if name not in assembly.mesh_names]
    own_stiff = sum(linear.stiffness[name] for name in others)
    own_damping = sum(linear.damping[name] for name in others)
    assert np.abs(mass - linear.mass).max() < 1e-12 * linear.mass.max()
    # The assembly differentiates numerically (1e-10); Exudyn analytically.
    assert np.abs(stiff - own_stiff).max() < 1e-9 * np.abs(own_stiff).max()
    assert np.abs(damping - own_damping).max() < 1e-9 * np.abs(own_damping).max()


def test_exudyn_follows_the_assemblys_equations_of_motion(grc: Gearbox, stiffness: dict) -> None:
    """One classical Runge-Kutta step by hand from a preloaded, tilted, spinning state."""
    assembly, start = started(grc, stiffness, "bushing", 22.5)
    random = np.random.default_rng(2)
    q = start.q + 1e-5 * random.normal(size=assembly.size)
    v = start.v + 1e-2 * random.normal(size=assembly.size)
    found = trajectory(ExudynSystem(assembly, q, v, LoadTable(LOAD)), 1)[-1]
    applied = assembly.torque_vector(LOAD)

    def rate(state: np.ndarray) -> np.ndarray:
        at, velocity = state[: assembly.size], state[assembly.size :]
        return np.concatenate([velocity, accelerations_of(assembly, at, velocity, applied)])

    y = np.concatenate([q, v])
    k1 = rate(y)
    k2 = rate(y + 0.5 * STEP * k1)
    k3 = rate(y + 0.5 * STEP * k2)
    k4 = rate(y + STEP * k3)
    change = STEP / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)
    # Velocities of some 2e3 rad/s limit the difference of states to 1e-13 of them.
    assert np.abs(found[1:] - y - change).max() < 1e-9 * np.abs(change).max()


def test_joint_null_space_is_the_minimal_model(grc: Gearbox, stiffness: dict) -> None:
    jointed, minimal = assemble(grc, Choice("jointed"), stiffness), assemble(grc, Choice("rigid"), stiffness)
    rest = np.zeros(jointed.size)
    system = ExudynSystem(jointed, rest, rest, LoadTable(), with_meshes=False)
    motions, mass = system.joint_null_space()
    assert motions.shape == (jointed.size, minimal.size)
    assert np.abs(mass - minimal.mass_matrix).max() < 1e-9 * minimal.mass_matrix.max()


def test_jointed_model_follows_the_minimal_one(grc: Gearbox, stiffness: dict) -> None:
    minimal, start = started(grc, stiffness, "rigid")
    jointed = assemble(grc, Choice("jointed"), stiffness)
    q, v = np.zeros(jointed.size), np.zeros(jointed.size)
    for body in jointed.bodies:
        q[jointed.spin[body.name]] = start.q[minimal.spin[body.name]]
    ends = [
        trajectory(ExudynSystem(minimal, start.q, start.v, LoadTable(LOAD)), 400)[-1],
        trajectory(ExudynSystem(jointed, q, v, LoadTable(LOAD)), 400, explicit=False)[-1],
    ]
    for body in minimal.bodies:
        one = ends[0][1 + minimal.size + minimal.spin[body.name]]
        two = ends[1][1 + jointed.size + jointed.spin[body.name]]
        # Generalized-alpha at 25 us against RK44, speeds of up to 0.6 rad/s: 0.1 % at the mesh modes.
        assert two == pytest.approx(one, rel=1e-4, abs=1e-7)


def test_loads_route_needs_bodies(grc: Gearbox, stiffness: dict) -> None:
    assembly, start = started(grc, stiffness, "rigid")
    with pytest.raises(VariantError, match="mesh_route 'loads' requires bodies; use the variant jointed or bushing"):
        ExudynSystem(assembly, start.q, start.v, LoadTable(LOAD), "loads")


def test_gravity_acts_on_the_masses(grc: Gearbox, stiffness: dict) -> None:
    gearbox = grc.varied({"gravity.acceleration_m_per_s2": [0.0, -9.81, 0.0]})
    assembly = assemble(gearbox, Choice("bushing"), stiffness).unloaded
    rest = np.zeros(assembly.size)
    system = ExudynSystem(assembly, rest, rest, LoadTable(), with_meshes=False)
    step = 1e-8
    end = trajectory(system, 1, step)[-1]
    o = assembly.coordinates["hss"][0]
    assert end[1 + assembly.size + o + 1] / step == pytest.approx(-9.81, rel=1e-6)
    weight = -9.81 * sum(body.mass for body in assembly.bodies)
    assert assembly.constant_forces.sum() == pytest.approx(weight, rel=1e-12)
    f = np.zeros(assembly.size)
    add_connector_forces(rest, rest, assembly.connectors, f)
    add_spring_forces(rest, rest, assembly.springs, f)
    assert np.abs(f).max() < 1e-6  # N; nothing else acts at rest (round-off of the places)


def test_rigid_meshes_leave_the_train_and_its_couplings(grc: Gearbox) -> None:
    """Two bodies about one spring: everything geared together, and the brake behind its coupling."""
    assembly = assemble(grc, Choice("rigid", "kinematic"), {})
    assert assembly.motions.shape[1] == 2
    spins = grc.train.rolling_speeds("carrier", grc.train.rolling_speeds("hss", 1.0)["carrier"])
    referred = sum(assembly.mass_matrix[i, i] * spins[n] ** 2 for n, i in assembly.spin.items() if n != "brake")
    frequency = np.sqrt(1e6 * (1 / 0.39 + 1 / referred)) / (2 * np.pi)
    assert modes_of(assembly).frequency == pytest.approx([0.0, frequency], rel=1e-9)
    start = accelerating_start(assembly, LOAD)
    rows = trajectory(ExudynSystem(assembly, start.q, start.v, LoadTable(LOAD)), 400)
    carrier = rows[-1, 1 + assembly.size + assembly.spin["carrier"]]
    assert carrier == pytest.approx(start.rates["carrier"] * 0.01, rel=1e-9)
    with pytest.raises(VariantError, match=": a kinematic constraint, which requires the variant rigid, not"):
        assemble(grc, Choice("bushing", "kinematic"), {})
