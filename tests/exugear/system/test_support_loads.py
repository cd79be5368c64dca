"""Supports carry all six components: every body is in balance, and two variants agree on what its bearings carry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.kernels.meshes import TILT_STIFFNESS
from exugear.system.loads import LoadTable
from exugear.system.signals import SIGNALS, LoadsUnknownError, support_loads
from exugear.system.statics import accelerating_start, locked_equilibrium, rolled_coordinates
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import Observer

from ..cases.table import surfaces

TORQUE = {"carrier": 240e3}
MESH_FORCE = 270e3
"""Largest of the GRC under this torque, N."""
TILTED = 5e-6
"""Rows of meshes act about nodes that have moved, and arms of seats tilt, m: found 2.5e-6."""


def observed(assembly: Assembly, q: np.ndarray, v: np.ndarray, angle: float = 0.0) -> dict[str, np.ndarray]:
    """Mesh forces and loads of supports (n, 6) of one state, to which the input has turned by an angle."""
    observer = Observer(assembly, LoadTable({}))
    signals, _, _ = observer.observe(np.zeros(2), np.stack([q, q]), np.stack([v, v]))
    names = ("mesh_force", "support_force", "support_moment")
    run = {name: observer.layout.values(name, signals) for name in names if name in observer.layout}
    run |= {"time": np.array([0.0, 1.0]), "input_speed": np.full(2, angle)}
    return {"mesh_force": run["mesh_force"][1], "support": support_loads(assembly, run)[1]}


def turned(psi: float) -> np.ndarray:
    cosine, sine = np.cos(psi), np.sin(psi)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def from_supports_and_meshes(assembly: Assembly, q: np.ndarray, v: np.ndarray) -> dict[str, np.ndarray]:
    """Force and moment (6,) on each body, about its node: supports by their seats, meshes by rows in their frame."""
    signals = observed(assembly, q, v)
    nodes = {body.name: np.array([*body.axis, body.centre_of_mass_z]) for body in assembly.bodies}
    found = {name: np.zeros(6) for name in nodes}
    for support, load in zip(assembly.supports, signals["support"], strict=True):
        force, moment = load[:3], load[3:]
        for name, sense in ((support.body, 1.0), (support.on, -1.0)):
            if name in nodes:
                arm = turned(q[assembly.spin[name]]) @ (np.array(support.position) - nodes[name])
                found[name] += sense * np.concatenate([force, moment + np.cross(arm, force)])
    tilts = assembly.meshes.tilt[:, TILT_STIFFNESS] * assembly.gear_positions(q)[:, 1]
    for element, force, resisted in zip(assembly.elements, signals["mesh_force"], tilts, strict=True):
        frame = assembly.spin.get(element.mesh.frame)
        turn = turned(0.0 if frame is None else q[frame])
        rows = element.force.reshape(2, 2, 3) * force / element.line_of_action
        rows = rows + element.misalignment.reshape(2, 2, 3) * resisted
        for name, row in zip((element.mesh.pinion, element.mesh.gear), rows, strict=True):
            if name in nodes:
                found[name] -= (row @ turn.T).ravel()
    return found


def test_all_six_components_have_units_sense_and_acting_body():
    signals = {one.name: one for one in SIGNALS}
    force, moment = signals["support_force"], signals["support_moment"]
    assert (force.units, moment.units) == ("N", "N m")
    assert force.dimensions == moment.dimensions == ("time", "support", "axis")
    assert "on its body" in force.long_name
    assert "on the same body, about its seat" in moment.long_name
    assert "global" in force.sign_convention
    assert "global" in moment.sign_convention


@pytest.mark.parametrize("speed", [0.0, 3.0])
def test_supports_meshes_and_inertia_leave_nothing_on_any_body(grc: Gearbox, stiffness: dict, speed: float) -> None:
    """Newton and Euler for each body as the train speeds up, planets on their orbits; torques about z apart."""
    assembly = assemble(grc, Choice("bushing"), stiffness)
    start = accelerating_start(assembly, TORQUE, speed)
    speeds = grc.train.rolling({grc.train.input: speed})
    needed = assembly.inertia_forces(start.q, start.v, assembly.rolling_acceleration(start.q, speeds, start.rates))
    found = from_supports_and_meshes(assembly, start.q, start.v)
    largest = np.abs(observed(assembly, start.q, start.v)["support"][:, 3:]).max()
    assert largest > 500.0  # a body without its moments would be far out of balance
    for name, load in found.items():
        if min(assembly.coordinates[name]) >= 0:  # has a place in space
            left = load - needed[list(assembly.coordinates[name])]
            assert np.abs(left[:3]).max() < 1.0, name
            assert np.abs(left[3:5]).max() < TILTED * MESH_FORCE, name


def test_ideal_joints_carry_what_the_bearings_of_their_bodies_carry_together(grc: Gearbox, stiffness: dict) -> None:
    """Force and moment of each joint of the variant `rigid` against the sum over the bearings of `bushing`."""
    rigid, bushing = (assemble(grc, Choice(variant), stiffness) for variant in ("rigid", "bushing"))
    # Axes that are held have no misalignment, which teeth would resist.
    bushing = replace(bushing, meshes=bushing.meshes._replace(tilt=np.zeros_like(bushing.meshes.tilt)))
    states = [locked_equilibrium(one, TORQUE, ["hss"]) for one in (rigid, bushing)]
    ideal, real = (observed(one, q, np.zeros(one.size)) for one, q in zip((rigid, bushing), states, strict=True))
    by_joints, by_bearings = {}, {}
    for n, joint in enumerate(grc.joints):
        by_joints[joint.name] = ideal["support"][n]
        by_bearings[joint.name] = np.zeros(6)
        for m, support in enumerate(bushing.supports):
            if support.body == joint.body:
                force, moment = real["support"][m].reshape(2, 3)
                arm = np.array(support.position) - np.array(joint.position)
                by_bearings[joint.name] += np.append(force, moment + np.cross(arm, force))
    for name in ("ims", "hss"):  # held by two bearings each
        assert by_joints[name][:3] == pytest.approx(by_bearings[name][:3], abs=1.0)
        assert by_joints[name][3:] == pytest.approx(by_bearings[name][3:], abs=TILTED * MESH_FORCE)
    # Planets share unevenly on bearings: what all three carry, each turned to the place of the first where the carrier
    # stands, which yields by half a milliradian.
    ideal_pin, real_pin = (
        sum(
            (loads[f"pin_{n + 1}"].reshape(2, 3) @ turned(2.0 * np.pi / 3.0 * n + q[one.spin["carrier"]])).ravel()
            for n in range(3)
        )
        for loads, one, q in zip((by_joints, by_bearings), (rigid, bushing), states, strict=True)
    )
    assert np.abs(ideal_pin[4]) > 10e3
    assert real_pin == pytest.approx(ideal_pin, rel=5e-3, abs=100.0)


def test_moments_of_pins_turn_with_their_carrier(grc: Gearbox, stiffness: dict) -> None:
    """A pin's moment over its force is given by the place of the meshes alone, in axes that turn with the carrier."""
    assembly = assemble(grc, Choice("rigid"), stiffness)
    levers = []
    for angle in (0.0, 0.7):
        about = rolled_coordinates(assembly, "carrier", angle)
        q = locked_equilibrium(assembly, TORQUE, ["hss"], about=about)
        loads = dict(zip((one.name for one in grc.joints), observed(assembly, q, 0 * q, angle)["support"], strict=True))
        force, moment = loads["pin_1"].reshape(2, 3) @ turned(angle)
        levers.append(moment[1] / force[1])
        assert np.abs(loads["carrier"][3:]).max() < 1e-3 * np.abs(loads["pin_1"][3:]).max()
    assert abs(levers[0]) > 0.02
    assert levers[1] == pytest.approx(levers[0], rel=2e-3)


def test_joints_of_tables_say_that_their_moments_are_unknown(grc: Gearbox) -> None:
    assembly = assemble(grc, Choice("rigid", "table"), surfaces(grc))
    with pytest.raises(
        LoadsUnknownError,
        match=": uneven load distribution along the face width adds moments",
    ):
        support_loads(assembly, {"support_force": np.zeros((1, len(grc.joints), 3))})


def test_inertia_takes_the_power_that_kinetic_energy_gains_at_each_of_several_states(
    grc: Gearbox, stiffness: dict[str, np.ndarray]
) -> None:
    """The energy of axially symmetric bodies in Rxyz angles, its change by central differences."""
    assembly = assemble(grc, Choice("bushing"), stiffness)
    inertia, rng = assembly.inertia, np.random.default_rng(7)
    q, v, a = rng.normal(0.0, 0.3, (3, 4, assembly.size))

    def energy(q: np.ndarray, v: np.ndarray) -> float:
        total = 0.5 * (inertia.spin_inertia * v[inertia.spin] ** 2).sum()
        for first, mass, transverse, axial in zip(*inertia[:4], strict=True):
            tilt, (da, db, spin) = q[first + 4], v[first + 3 : first + 6]
            across = (da * np.cos(tilt)) ** 2 + db**2
            total += 0.5 * mass * (v[first : first + 3] ** 2).sum()
            total += 0.5 * transverse * across + 0.5 * axial * (spin + da * np.sin(tilt)) ** 2
        return float(total)

    forces = assembly.inertia_forces(q, v, a)
    h = 1e-5
    for n, (place, rate, bend) in enumerate(zip(q, v, a, strict=True)):
        gains = [energy(place + s * h * rate, rate + s * h * bend) for s in (1.0, -1.0)]
        assert forces[n] @ rate == pytest.approx((gains[0] - gains[1]) / (2.0 * h), rel=1e-6)
        np.testing.assert_allclose(forces[n], assembly.inertia_forces(place, rate, bend), rtol=1e-12, atol=1e-9)
