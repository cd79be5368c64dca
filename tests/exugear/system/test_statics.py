"""Statics: the output locked under load, and runs that start in balance."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.kernels.connectors import add_connector_forces
from exugear.system.kernels.meshes import TILT_STIFFNESS
from exugear.system.statics import (
    BalanceError,
    accelerating_start,
    linearise,
    locked_equilibrium,
    static_state,
    tangent_stiffness,
)
from exugear.system.system import Assembly

from ..cases.assembled import assembled
from ..cases.plain_motion import accelerations_of

TORQUE = {"carrier": 240e3}
# Line-of-action forces of the specification, kN: sums over the planets, intermediate, high speed.
FORCES = {"sun_planet": 422.4e3, "ring_planet": 422.4e3, "intermediate": 128.7e3, "high_speed": 55.5e3}


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_locked_output_gives_the_mesh_forces_of_the_statics(grc: Gearbox, stiffness: dict, variant: str) -> None:
    assembly = assembled(grc, Choice(variant), stiffness)
    q = locked_equilibrium(assembly, TORQUE, ["hss"])
    force = dict(zip(assembly.mesh_names, assembly.mesh_states(q, 0 * q)[:, 4], strict=True))
    for family, expected in FORCES.items():
        total = sum(value for name, value in force.items() if name.startswith(family))
        assert total == pytest.approx(expected, rel=2e-3)  # 0.2 % asked for; printed with four digits
    shares = np.array([force[f"sun_planet_{number}"] for number in (1, 2, 3)]) / 422.46e3
    if variant == "rigid":
        assert shares == pytest.approx([1 / 3] * 3, rel=1e-4)
    else:
        # The intermediate gear pushes the low-speed shaft aside: planets share unevenly, by a few percent.
        assert 0.01 < np.ptp(shares) < 0.1


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_lock_carries_the_torque_over_the_ratio(grc: Gearbox, stiffness: dict, variant: str) -> None:
    assembly = assembled(grc, Choice(variant), stiffness)
    q = locked_equilibrium(assembly, TORQUE, ["hss"])
    lock = (assembly.forces(q, 0 * q) + assembly.torque_vector(TORQUE))[assembly.spin["hss"]]
    # Tilted shafts change the lever arms by their deflection over radius, 1e-5.
    assert lock == pytest.approx(2945.1, rel=5e-5)


def test_ring_carries_the_difference_of_carrier_and_sun_torque(grc: Gearbox, stiffness: dict) -> None:
    assembly = assemble(grc, Choice("bushing"), stiffness)
    q = locked_equilibrium(assembly, TORQUE, ["hss"])
    states = assembly.mesh_states(q, 0 * q)
    base_radius = grc.gears["ring"].base_radius
    ring = sum(
        state[4] * base_radius
        for element, state in zip(assembly.elements, states, strict=True)
        if element.mesh.family == "ring_planet"
    )
    assert ring / 240e3 == pytest.approx(99 / 120, rel=1e-6)


def test_bearing_reactions_balance_the_mesh_forces(grc: Gearbox, stiffness: dict) -> None:
    """All external loads on all bodies: ring mesh forces, bearings to ground, torques; forces and moments."""
    assembly = assemble(grc, Choice("bushing"), stiffness)
    q = locked_equilibrium(assembly, TORQUE, ["hss"])
    rest = np.zeros(assembly.size)
    force, moment = np.zeros(3), np.zeros(3)
    lock = -(assembly.forces(q, rest) + assembly.torque_vector(TORQUE))[assembly.spin["hss"]]
    moment[2] += TORQUE["carrier"] + lock
    loads, lag = assembly.bearing_loads(q, rest), 0.0
    psi = q[assembly.spin["carrier"]]
    turn = np.array([[math.cos(psi), -math.sin(psi), 0], [math.sin(psi), math.cos(psi), 0], [0, 0, 1]])
    for bearing, load, strain in zip(grc.bearings, loads, assembly.support_strains(q), strict=True):
        if bearing.on == "carrier":
            lag += np.cross(turn @ strain[:3], load[:3])[2]
        if bearing.on != "carrier":
            # The connector hands its force to the body where the body's own attachment has moved to.
            body = next(b for b in assembly.bodies if b.name == bearing.body)
            node = np.array([*body.axis, body.centre_of_mass_z])
            o = assembly.coordinates[body.name][0]
            alone = assembly_of_one_bearing(assembly, bearing.name, q)
            force += alone[o : o + 3]
            moment += np.cross(node + q[o : o + 3], alone[o : o + 3]) + to_moment(q[o : o + 6], alone[o + 3 : o + 6])
            assert np.allclose(alone[o : o + 3], -load[:3], rtol=1e-12)
    gears = zip(assembly.elements, assembly.mesh_states(q, rest), assembly.gear_positions(q)[:, 1], strict=True)
    for m, (element, state, misalignment) in enumerate(gears):
        if element.mesh.gear == "housing":
            # The ring feels minus its part of the row, in the carrier's frame; the train feels the opposite. So it does
            # with what teeth resist misalignment by.
            force += state[4] * turn @ element.force[6:9]
            resisted = assembly.meshes.tilt[m, TILT_STIFFNESS] * misalignment
            moment += turn @ (state[4] * element.force[9:12] + resisted * element.misalignment[9:12])
    assert np.abs(force).max() < 1e-8 * FORCES["ring_planet"]
    # A bearing takes its force where its first ring is: with the lag of the other across the force, a small moment.
    # Planets' bearings hand it on to the carrier; rows yield by half a degree beside their load.
    assert abs(moment[2] - lag) < 6e-8 * TORQUE["carrier"]
    assert abs(lag) < 1e-6 * TORQUE["carrier"]
    # Rows act about the undeflected nodes, which have moved by up to 0.1 mm: force times displacement.
    assert np.abs(moment).max() < 1e-4 * FORCES["ring_planet"]


def assembly_of_one_bearing(assembly: Assembly, name: str, q: np.ndarray) -> np.ndarray:
    n = assembly.connector_names.index(name)
    f = np.zeros(assembly.size)
    add_connector_forces(q, 0 * q, assembly.connectors.one(n), f)
    return f


def to_moment(coordinates: np.ndarray, generalized: np.ndarray) -> np.ndarray:
    """Global moment from the generalized moments of Rxyz angles: solve G^T M = Q."""
    a, b = coordinates[3:5]
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    return np.linalg.solve(np.array([[1, 0, 0], [0, ca, sa], [sb, -sa * cb, ca * cb]]), generalized)


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
@pytest.mark.parametrize(("case", "sense"), [("reference", -1), ("generating", 1)])
def test_run_starts_in_uniform_acceleration(grc: Gearbox, stiffness: dict, variant: str, case: str, sense: int) -> None:
    assembly = assembled(grc, Choice(variant), stiffness)
    torques = grc.load_cases[case].torques
    start = accelerating_start(assembly, torques)
    # 4.47 kN m over 5.97e3 kg m2, 215 rpm in 30 s.
    assert start.rates["carrier"] == pytest.approx(sense * 0.75, rel=5e-3)
    found = accelerations_of(assembly, start.q, start.v, assembly.torque_vector(torques))
    for name, rate in start.rates.items():
        assert found[assembly.spin[name]] == pytest.approx(rate, rel=1e-6)
    # The deflections stay: nothing but rolling motion accelerates.
    rolling = assembly.rolling_acceleration(start.q, dict.fromkeys(start.rates, 0.0), start.rates)
    assert np.abs(found - rolling).max() < 1e-6 * np.abs(found).max()


def test_start_at_speed_is_steady(grc: Gearbox, stiffness: dict) -> None:
    """At rated speed the planets pull outwards; the start holds them there."""
    assembly = assemble(grc, Choice("bushing"), stiffness)
    speed = 22.1 * math.pi / 30
    start = accelerating_start(assembly, grc.load_cases["rated"].torques, speed)
    found = accelerations_of(assembly, start.q, start.v, assembly.torque_vector(grc.load_cases["rated"].torques))
    o = assembly.coordinates["planet_1"][0]
    assert found[o] == pytest.approx(-(speed**2) * 0.308, rel=1e-3)


def test_speed_driven_start_solves_for_the_drive_torque(grc: Gearbox, stiffness: dict) -> None:
    assembly = assemble(grc, Choice("bushing"), stiffness)
    start = accelerating_start(assembly, TORQUE, driven=("hss", 0.0))
    assert start.drive_torque == pytest.approx(-2945.1, rel=5e-5)


@pytest.mark.parametrize("law", ["kinematic", "line_of_action"])
def test_train_near_balance_starts_with_what_its_loads_leave(grc: Gearbox, stiffness: dict, law: str) -> None:
    """Net torque over referred inertia, whatever share of the loads is left over."""
    assembly = assemble(grc, Choice("rigid", law), {} if law == "kinematic" else stiffness)
    ratios = grc.train.rolling_speeds("carrier", 1.0)
    inertia = sum(assembly.mass_matrix[i, i] * ratios[name] ** 2 for name, i in assembly.spin.items())
    for share in np.geomspace(1.0, 1e-6, 25):
        loads = {"carrier": 240e3, "hss": -240e3 * (1.0 - share) / ratios["hss"]}
        net = sum(torque * ratios[name] for name, torque in loads.items())
        # Both sums of torques, here and there, are rounded: a few units of the last digit of the loads.
        expected = pytest.approx(net / inertia, abs=100 * np.finfo(float).eps * 240e3 / inertia)
        assert accelerating_start(assembly, loads).rates["carrier"] == expected


def test_unheld_structure_is_reported(grc: Gearbox, stiffness: dict) -> None:
    assembly = assemble(grc, Choice("rigid"), stiffness)
    with pytest.raises(BalanceError):
        locked_equilibrium(assembly, TORQUE, [])


@pytest.mark.parametrize("variant", ["rigid", "bushing", "flexible"])
def test_the_tangent_of_the_statics_is_the_sum_over_the_elements(
    grc_shafts: Gearbox, stiffness: dict, variant: str
) -> None:
    assembly = assembled(grc_shafts, Choice(variant), stiffness)
    q = 1e-5 * np.random.default_rng(3).normal(size=assembly.size)
    expected = linearise(assembly, q).total_stiffness
    found = tangent_stiffness(assembly, q, assembly.mean_meshes)
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


def test_the_static_state_found_on_the_way_to_an_assembly_is_that_of_a_new_search(
    grc: Gearbox, stiffness: dict
) -> None:
    assembly = assembled(grc, Choice("bushing"), stiffness)
    assert assembly.known_rest
    known = static_state(assembly)
    copy = replace(assembly)
    assert not copy.known_rest
    searched = static_state(copy)
    largest = np.abs(searched.q).max()
    assert np.abs(known.q - searched.q).max() < 1e-9 * largest
    assert known.mesh_force == pytest.approx(searched.mesh_force, rel=1e-9)
    known.q[:] = 0.0  # the result belongs to the caller
    assert static_state(assembly).q.any()
