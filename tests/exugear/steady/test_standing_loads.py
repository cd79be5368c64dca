"""Loads on what stands still: together they are what accelerates the moving bodies (Newton and Euler)."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import node_position
from exugear.steady.balance.response import signals
from exugear.steady.point_solver import ContactLossState, harmonic_balance_model
from exugear.system.build import assemble

from ..cases.bearing import BEARING_CASE, NON_LINEAR
from ..cases.steady_runs import FOUR, solver_of
from .test_tooth_friction import curves_with_friction

SPEED = 10.0
AXES = "xyz"


def sampled(orders, angle):
    """Varying part of coefficients (lines, ...) at an angle of the input."""
    factors = np.exp(1j * orders[1:] * angle)
    return lambda coefficients: coefficients[0].real + 2.0 * np.tensordot(factors, coefficients[1:], 1).real


def accelerating_load(assembly, still, moved):
    """Force and moment (6,) about the origin that a motion (q, v, a) of all bodies needs beyond another one.

    Arms are those of the other one: deflections times static forces are left out, as in the equations of motion.
    """
    forces = assembly.inertia_forces(*moved) - assembly.inertia_forces(*still)
    total = np.zeros(6)
    for body in assembly.bodies:
        if body.fixed:
            continue
        at = list(assembly.coordinates.get(body.name, (-1,)))
        if at[0] < 0:
            total[5] += forces[assembly.spin[body.name]]
            continue
        force, moment = forces[at[:3]], forces[at[3:]]
        total += np.concatenate([force, moment + np.cross(node_position(body) + still[0][at[:3]], force)])
    return total


def standing_load(gearbox, names, values):
    """Force and moment (6,) about the origin on all moving bodies by bearings and meshes on what stands still.

    Those of excitations on a rigid fixed body, whose place is that on the axis of the body that they act on, follow.
    """

    def of(quantity, name):
        return np.array([values[names.index(f"{quantity} {name} {axis}")] for axis in AXES])

    total = np.zeros(6)
    for bearing in gearbox.standing_bearings:
        force = of("support_force", bearing.name)
        total += np.concatenate([force, of("support_moment", bearing.name) + np.cross(bearing.position, force)])
    for body in gearbox.bodies():
        for gear, z in body.wheels.items() if body.fixed else ():
            force = of("gear_force", gear)
            total -= np.concatenate([force, of("gear_moment", gear) + np.cross([*body.axis, z], force)])
    for name, place in {load.excitation: load.position for load in gearbox.varying_loads}.items():
        force = of("reaction_force", name)
        total -= np.concatenate([force, of("reaction_moment", name) + np.cross(place, force)])
    return total


def both_loads(gearbox, solver, speed, turns):
    """What motion needs, and what signals have, (12 angles, 6) each, without their means."""
    found = solver.response(speed)
    model, response = (found.model, found.response) if isinstance(found, ContactLossState) else (solver.model, found)
    lines, w = model.lines, response.interface.frequencies[:, None]
    names = [name.name for name in model.signal_names]
    values = signals(model, response)
    frame, static = model.system.frame, model.system.static_at(speed)
    needed, given = [], []
    for angle in np.random.default_rng(3).uniform(0.0, 2.0 * np.pi * turns, 12):
        at = sampled(lines.orders, angle)
        motion = response.motion
        still = frame.state(angle, speed, static)
        moved = frame.state(angle, speed, static + at(motion), at(1j * w * motion), at(-(w**2) * motion))
        needed.append(accelerating_load(model.system.frame.assembly, still, moved))
        given.append(standing_load(gearbox, names, at(values)))
    return np.array(needed) - np.mean(needed, axis=0), np.array(given) - np.mean(given, axis=0)


def assert_loads_accelerate_the_bodies(gearbox, solver):
    """Forces agree within 1e-5, moments within 2e-3: static forces of 1e5 N act on arms that vibrate by 1e-6 m."""
    needed, given = both_loads(gearbox, solver, SPEED, 30.0)
    size = needed.std(axis=0)
    assert size.min() > 100.0
    error = (given - needed).std(axis=0) / size
    assert error[:3].max() < 1e-5
    assert error[3:].max() < 2e-3
    return size


@pytest.mark.validation
@pytest.mark.parametrize("mesh_model", ["tangential", "line_of_action", "curves"])
def test_loads_on_bearings_and_ring_of_the_grc_accelerate_its_bodies(grc, stiffness, curves, mesh_model):
    gearbox = grc.varied(FOUR)
    data, name = (curves, "line_of_action") if mesh_model == "curves" else (stiffness, mesh_model)
    model_input = assemble(gearbox, Choice("bushing", name), data)
    assert_loads_accelerate_the_bodies(gearbox, solver_of(model_input, (1.0, 22.5), "parametric"))


STATOR = {
    "body": "hss",
    "reaction_on": "housing",
    "orders": [2, 6],
    "z_mm": 1500.0,
    "force_N": [[300.0, 200.0, 50.0], [100.0, 100.0, 0.0]],
    "moment_N_m": [[0.0, 40.0], [20.0, 0.0]],
    "torque_N_m": [60.0, 30.0],
    "phase_deg": [20.0, 70.0],
}


@pytest.mark.validation
def test_friction_of_teeth_and_reactions_of_excitations_are_among_the_loads_of_the_grc(grc, stiffness):
    """Together with them all loads accelerate the bodies; each of both is far larger than the tolerance."""
    gearbox = grc.varied(FOUR | {"damping.tooth_friction": 0.05, "excitations": {"stator": STATOR}})
    assembly = assemble(gearbox, Choice("bushing"), curves_with_friction(gearbox, stiffness))
    solver = solver_of(assembly, (1.0, 22.5), "parametric")
    size = assert_loads_accelerate_the_bodies(gearbox, solver)
    names = [name.name for name in solver.model.signal_names]
    response = solver.response(SPEED)
    friction = solver.model.friction_on_gears(SPEED)
    reaction = signals(solver.model, response)[:, names.index("reaction_force stator x") :][:, :6]
    assert np.abs(friction[1:, :3]).max() > 1e-3 * size[:3].max()
    assert np.abs(reaction[1:]).max(axis=0) == pytest.approx([150.0, 100.0, 25.0, 10.0, 20.0, 30.0])


@pytest.mark.validation
def test_moments_of_nonlinear_bearings_are_those_that_turn_the_shafts():
    gearbox = Gearbox.from_dict(tomllib.loads(BEARING_CASE)).varied(NON_LINEAR)
    cycle = 2.0 * np.pi * np.arange(50) / 50
    data = {"spur": 3e8 * (1.0 + 0.1 * (np.cos(cycle) + 0.4 * np.sin(2.0 * cycle)))}
    solver = solver_of(assemble(gearbox, Choice("bushing"), data), (20.0, 400.0), "nonlinear")
    needed, given = both_loads(gearbox, solver, 110.0, 30.0)
    size = needed.std(axis=0)
    assert size[[3, 4]].min() > 1.0
    assert ((given - needed).std(axis=0)[:5] < 5e-3 * size[:5] + 1e-9 * size.max()).all()


def test_ideal_joints_have_no_moments_and_only_gears_of_fixed_bodies_have_loads(grc, stiffness):
    model = harmonic_balance_model(assemble(grc, Choice("rigid"), stiffness), np.array([1.0, 22.5]))
    kinds = {name.quantity for name in model.signal_names}
    assert "support_moment" not in kinds
    assert {name.name.split()[1] for name in model.signal_names if name.quantity == "gear_force"} == {"ring"}
