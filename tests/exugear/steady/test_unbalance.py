"""Unbalance, forces and moments over the angle of a body, against closed forms, balances in space and runs."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.steady.balance.response import signals
from exugear.steady.point_solver import PointSolver
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.system import Assembly

from ..cases import gear_trains
from ..cases.assembled import assembled
from ..cases.both_ways import assert_both_solvers_move_alike
from ..cases.spur import SPUR_CASE
from ..cases.steady_runs import SHAPE, fitted, line_at, solver_of
from ..system.test_point_forces import content

MASS, TRANSVERSE, POLAR = 1.0, 1e-2, 4e-3
STIFFNESS, DAMPING, TILTING = 2e7, 400.0, 1e5
UNBALANCE = {"body": "shaft_1", "z_mm": 0.0, "unbalance_g_mm": 50.0, "phase_deg": [30.0]}
AMOUNT = 50e-6 * np.exp(1j * np.pi / 6.0)
"""kg m"""
SPEEDS = (2000.0, 6000.0)
SPEEDS_AROUND = (2500.0, 4472.0, -5800.0)
"""Below, at and above the resonance at sqrt(k / m) = 4472 rad/s, and against the sense of the z axis."""


def rotor(excitation: dict[str, Any], radial_y: float = STIFFNESS) -> Assembly:
    """Rigid rotor on one bearing at its centre of mass, beside teeth that are too soft to matter (0.1 N/m)."""
    content = tomllib.loads(SPUR_CASE)
    content["static_load"]["torques_N_m"] = {"shaft_1": 1e-7}
    content["housing"] = {"factor": 1.0}
    content["bodies"]["shaft_1"]["inertia"]["disc"] |= {"axial_kg_m2": POLAR, "transverse_kg_m2": TRANSVERSE}
    matrix = np.diag([STIFFNESS, radial_y, 1e8, TILTING, TILTING, 0.0]).tolist()
    content["bearings"]["bearing_1"] |= {"stiffness": {"matrix": matrix}, "damping": {"radial_N_s_per_m": DAMPING}}
    content["excitations"] = {"unbalance": excitation}
    return assemble(Gearbox.from_dict(content), Choice("bushing"), {"spur": np.array([0.1])})


def motion_at(solver: PointSolver, speed: float, order: float = 1.0) -> np.ndarray:
    """Complex amplitudes x y z a b of shaft 1 at an order, of Re(u exp(i order |angle|))."""
    line = line_at(solver.model, order)
    assert solver.model.lines.orders[line] == pytest.approx(order)
    found = 2.0 * solver.response(speed).motion[line]
    return found[list(solver.model.system.frame.assembly.coordinates["shaft_1"][:5])]


@pytest.mark.parametrize("radial_y", [STIFFNESS, 1.5e7])
def test_a_jeffcott_rotor_whirls_as_in_closed_form(radial_y):
    """x = m e Omega^2 / (k_x - m Omega^2 + i Omega c), y = -i m e Omega^2 / (k_y - ...), also where k_x is not k_y."""
    solver = solver_of(rotor(UNBALANCE, radial_y), SPEEDS, "linear", 1)
    for speed in SPEEDS_AROUND:
        w = abs(speed)
        amount = AMOUNT if speed > 0.0 else AMOUNT.conjugate()
        sense = np.sign(speed)
        forces = w**2 * amount * np.array([1.0, -1j * sense])
        expected = forces / (np.array([STIFFNESS, radial_y]) - MASS * w**2 + 1j * w * DAMPING)
        np.testing.assert_allclose(motion_at(solver, speed)[:2], expected, rtol=1e-6)


def test_an_unbalance_beside_the_centre_of_mass_tilts_the_rotor_with_its_gyroscopic_moment():
    """Forward whirl of a rigid rotor: tilt = U z Omega^2 / (k_t - (J_t - J_p) Omega^2); -y tilts about +x."""
    solver = solver_of(rotor(UNBALANCE | {"z_mm": 40.0}), SPEEDS, "linear", 1)
    for speed in (2500.0, 5800.0):
        amount = AMOUNT * 0.04 * speed**2
        tilt = amount / (TILTING - (TRANSVERSE - POLAR) * speed**2)
        np.testing.assert_allclose(motion_at(solver, speed)[3:], [1j * tilt, tilt], rtol=1e-6)


@pytest.mark.parametrize("direction", ["fixed", "rotating", "counter_rotating"])
def test_forces_move_a_rotor_along_their_direction_at_their_order(direction):
    """A force of the third order, 300 N along x and 100 N along y at zero angle: x and y as Re(F exp(i 3 theta))."""
    force = {"body": "shaft_1", "z_mm": 0.0, "orders": [3], "force_N": [[300.0, 100.0, 20.0]], "direction": direction}
    if direction != "fixed":
        force["force_N"] = [[300.0, 100.0, 0.0]]
    solver = solver_of(rotor(force), SPEEDS, "linear", 1)
    sense = {"fixed": 0.0, "rotating": 1.0, "counter_rotating": -1.0}[direction]
    w = 3.0 * 1500.0
    applied = np.array([300.0 + sense * 100j, 100.0 - sense * 300j])
    expected = applied / (STIFFNESS - MASS * w**2 + 1j * w * DAMPING)
    found = motion_at(solver, 1500.0, 3.0)
    np.testing.assert_allclose(found[:2], expected, rtol=1e-6)
    assert abs(found[2]) == pytest.approx(20.0 / abs(1e8 - w**2) if direction == "fixed" else 0.0, rel=1e-3, abs=1e-18)


def residual_in_space(assembly: Assembly, speed: float) -> float:
    """Largest difference of inertia from forces at five instants, by the response to stated loads, over these loads.

    All equations of motion of the assembly with the mean stiffness of the meshes, in which planets orbit and turn.
    """
    solver = solver_of(assembly, (0.5 * speed, 1.5 * speed), "linear", 1)
    frame = solver.model.system.frame
    response = solver.response(speed).interface.loads
    assert response is not None
    loads = LoadTable(varying=assembly.varying_loads)
    still = solver.model.system.static_at(speed)
    w = 1j * speed * solver.model.lines.orders[1:, None]

    def missing(psi: float, motion: np.ndarray, with_loads: bool) -> np.ndarray:
        waves = 2.0 * motion[1:] * np.exp(w * psi / speed)
        moved = (waves.sum(axis=0).real, (w * waves).sum(axis=0).real, (w**2 * waves).sum(axis=0).real)
        q, v, a = frame.state(psi, speed, still + moved[0], moved[1], moved[2])
        applied = loads.generalized(assembly, 0.0, q, v) if with_loads else 0.0
        return assembly.inertia_forces(q, v, a) - assembly.forces(q, v, frame.mean_meshes) - applied

    worst = 0.0
    for psi in (0.0, 0.4, 1.7, 3.0, 5.5):
        left = missing(psi, response.motion, True) - missing(psi, np.zeros_like(response.motion), False)
        q, v, _ = frame.state(psi, speed, still)
        applied = loads.generalized(assembly, 0.0, q, v)
        worst = max(worst, np.abs(left).max() / np.abs(applied).max())
    return worst


@pytest.mark.parametrize(("body", "orders"), [("planet_2", 3), ("planet", 3), ("carrier", 1), ("lss", 1), ("hss", 1)])
def test_the_response_to_an_unbalance_fulfils_the_equations_in_space(grc, stiffness, body, orders):
    """One planet's unbalance has its order and those one rotation of the carrier beside it; all planets' the same.

    What is left is of second order in the motion, which turns the static forces, and in the static deflection.
    """
    unbalance = {"body": body, "z_mm": -50.0 if body != "hss" else 300.0, "unbalance_g_mm": 1e3, "phase_deg": [20.0]}
    gearbox = grc.varied({"excitations": {"unbalance": unbalance}})
    assembly = assemble(gearbox, Choice("bushing"), stiffness)
    speed = 10.0 if body != "hss" else 1.0
    terms = solver_of(assembly, (0.5 * speed, 1.5 * speed), "linear", 1).model.shaft_orders.multiples
    assert len(np.unique(terms, axis=0)) == orders
    left = residual_in_space(assembly, speed)
    assert left < 1e-3


@pytest.mark.parametrize("order", [1, 3])
def test_a_planet_on_a_heavy_carrier_moves_as_in_closed_form(order):
    """A load F of an order n of planet 2 in space: z = F / (k - m w^2 - k^2 / (k + k_c - M w^2)), wherever it orbits.

    The bearing k on the carrier of 1e7 kg; beside the carrier's mass that of the other planets is below 1e-6.
    """
    content = gear_trains.planetary("ring")
    content["static_load"]["torques_N_m"] = {"sun": 1e-9}
    content["bodies"]["carrier"]["inertia"]["discs"] |= {"mass_kg": 1e7, "axial_kg_m2": 1e7, "transverse_kg_m2": 1e7}
    force = {"body": "planet_2", "z_mm": 0.0, "orders": [order], "force_N": [[100.0, 40.0, 0.0]], "phase_deg": [50.0]}
    content |= {"excitations": {"force": force}, "damping": {"bearing_time_s": 0.0}}
    gearbox = Gearbox.from_dict(content)
    assembly = assemble(gearbox, Choice("bushing"), dict.fromkeys(gearbox.pairs, np.array([1.0])))
    solver = solver_of(assembly, (500.0, 3000.0), "linear", 1)
    model, speed = solver.model, 1000.0
    frame = model.system.frame
    motion = solver.response(speed).interface.loads.motion
    turning = frame.speeds["planet_2"]
    w = order * abs(turning) * speed
    # Centrifugal forces move the planets outwards, and their teeth turn them a little.
    turned = frame.state(0.0, speed, model.system.static_at(speed))[0][assembly.spin["planet_2"]]
    phasor = np.exp(1j * (np.radians(50.0) + order * turned))
    carrier = 2e8 - 1e7 * w**2
    amplitude = np.array([100.0, 40.0]) * phasor / (2e8 - 0.8 * w**2 - 2e8**2 / (2e8 + carrier))
    found, expected = [], []
    for psi in np.linspace(0.0, 20.0, 9):
        waves = 2.0 * motion[1:] * np.exp(1j * model.lines.orders[1:, None] * psi)
        moved = frame.matrices(psi)[0] @ (motion[0].real + waves.sum(axis=0).real)
        found.append(moved[list(assembly.coordinates["planet_2"][:2])])
        # A load against the sense of the input is the conjugate of that along it.
        expected.append((amplitude if turning > 0.0 else amplitude.conj()) * np.exp(1j * order * abs(turning) * psi))
    np.testing.assert_allclose(found, np.real(expected), rtol=0.0, atol=1e-6 * np.abs(expected).max())


def geared(**changes: Any) -> Assembly:
    """Pair of gears with an unbalance beside the gear of shaft 1."""
    content = tomllib.loads(SPUR_CASE)
    content["excitations"] = {"unbalance": UNBALANCE | {"z_mm": 15.0, "unbalance_g_mm": 2e3} | changes}
    return assemble(Gearbox.from_dict(content), Choice("bushing"), {"spur": 3e8 * SHAPE})


def test_a_run_started_on_the_steady_state_with_unbalance_stays_there():
    """RK4 at 1/60 kHz, the order of the unbalance and all lines; the bearings let the unbalance move the teeth."""
    assembly = geared()
    solver = solver_of(assembly, (50.0, 150.0), "parametric")
    speed, lines = fitted(solver, solver.response(88.0), 0.8, 1.0 / 60e3, 0.4, assembly)
    known = 2.0 * signals(solver.model, solver.response(speed))[1:, 0]
    line = line_at(solver.model, 1.0) - 1
    assert abs(lines[line] - known[line]) < 1e-4 * abs(known[line])
    assert np.linalg.norm(lines - known) < 1e-4 * np.linalg.norm(known)


def test_both_solvers_have_the_same_unbalance():
    """In space: m e Omega^2 along the angle of the body plus 30 degrees, with its moment about the node."""
    assembly = geared()
    rng = np.random.default_rng(5)
    q, v = 1e-6 * rng.normal(size=(2, assembly.size))
    q[assembly.spin["shaft_1"]], v[assembly.spin["shaft_1"]] = 0.7, 80.0
    applied = LoadTable({}, varying=assembly.varying_loads).generalized(assembly, 0.0, q, v)
    size = 2e-3 * 80.0**2
    x, y = size * np.cos(0.7 + np.pi / 6.0), size * np.sin(0.7 + np.pi / 6.0)
    expected = [x, y, 0.0, -0.015 * y, 0.015 * x, 0.0]
    np.testing.assert_allclose(applied[list(assembly.coordinates["shaft_1"])], expected, rtol=1e-12, atol=1e-15)
    assert_both_solvers_move_alike(assembly, q, v, geared(enabled=False))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"orders": [2]}, "orders: an unbalance has order 1"),
        ({"unbalance_g_mm": -1.0}, "unbalance_g_mm"),
        ({"unbalance_g_mm": float("inf")}, "unbalance_g_mm"),
        ({"z_mm": None}, "set z_mm, the position"),
        ({"direction": "rotating"}, "direction = 'rotating' has an effect on force_N"),
        ({"phase_deg": [1.0, 2.0]}, "set as many phase_deg as unbalance_g_mm: 2 for 1"),
        ({"unbalance_g_mm": None}, "set orders with torque_N_m"),
        ({"unbalance_g_mm": None, "orders": [1], "force_N": [[1.0, 2.0]]}, "force_N"),
        ({"body": "planet_1"}, "no body 'planet_1'"),
    ],
)
def test_an_impossible_unbalance_or_force_is_refused_by_its_key(changes, said):
    content = tomllib.loads(SPUR_CASE)
    section = {key: value for key, value in (UNBALANCE | changes).items() if value is not None}
    content["excitations"] = {"unbalance": section}
    with pytest.raises(GearboxFileError, match=said.replace("[", r"\[")):
        Gearbox.from_dict(content)


def test_a_spin_only_body_takes_no_unbalance():
    content = tomllib.loads(SPUR_CASE)
    content["bodies"]["rotor"] = {"inertia": {"disc": {"axial_kg_m2": 0.1}}, "spin_only": True}
    content["couplings"] = {"shaft": {"bodies": ["rotor", "shaft_1"], "stiffness_N_m_per_rad": 1e5}}
    content["excitations"] = {"unbalance": UNBALANCE | {"body": "rotor"}}
    with pytest.raises(GearboxFileError, match="z_mm: 'rotor' is a spin-only body, which takes torques only"):
        Gearbox.from_dict(content)


def test_a_flexible_shaft_has_a_seat_where_its_unbalance_acts():
    """The force of 50 g mm at 200 rad/s is along x at the seat, without a moment about it."""
    case = content(elastic=True)
    del case["forces"]
    case["excitations"] = {"balance": {"body": "shaft_1", "z_mm": 30.0, "unbalance_g_mm": 50.0}}
    assembly = assembled(Gearbox.from_dict(case), Choice("flexible"), {"spur": 3e8})
    q, v = np.zeros((2, assembly.size))
    v[assembly.spin["shaft_1"]] = 200.0
    found = LoadTable(varying=assembly.varying_loads).generalized(assembly, 0.0, q, v)
    expected = np.zeros(assembly.size)
    expected[assembly.coordinates["shaft_1.balance"][0]] = 50e-6 * 200.0**2
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)
