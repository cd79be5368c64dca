"""Runs in time that start on a steady state, and the lines that they show."""

from __future__ import annotations

import math
import tomllib

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.steady.balance.nonlinear import HarmonicResidual
from exugear.steady.balance.response import signals
from exugear.steady.mean_system.mean_system import MeanSystem
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.settling import frame_coordinates
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.transient.compiled.solver import CompiledSystem, Observer

from .spur import SPUR_CASE
from .table import surface_of

CYCLE = 2.0 * np.pi * np.arange(50) / 50
SHAPE = 1.0 + 0.08 * np.cos(CYCLE) + 0.03 * np.sin(2 * CYCLE)
"""Mesh stiffness over the mesh cycle, relative to its mean."""
FOUR = {"bodies.planet.planet_angles_deg": [0.0, 90.0, 180.0, 270.0]}
"""Four planets in place of the three of the GRC, each a quarter of a cycle ahead of the one before."""


def line_at(model, order):
    """Place of the line nearest to an order."""
    return int(np.argmin(np.abs(model.lines.orders - order)))


def solver_of(assembly, speeds, level, harmonics=10, combinations=3):
    model = harmonic_balance_model(assembly, np.array(speeds), harmonics, combinations)
    return PointSolver(model, level)


def loose_pair(torque=100.0, variation=3.0, **sections):
    """Spur pair by a table whose teeth are 0.03 mm thinner and may part, and its solver by the method `nonlinear`."""
    case = tomllib.loads(SPUR_CASE) | sections
    case["static_load"]["torques_N_m"]["shaft_1"] = torque
    case["damping"] = {"mesh_time_s": 4e-6, "bearing_time_s": 4e-6}
    for gear in case["gears"].values():
        gear["tooth_thinning_mm"] = 0.03
    gearbox = Gearbox.from_dict(case)
    surface = surface_of(gearbox, "spur", variation=variation, stiffness=3e8)
    assembly = assemble(gearbox, Choice("bushing", "table"), {"spur": surface})
    return assembly, solver_of(assembly, (50.0, 2000.0), "nonlinear")


def error_of_tangents(solver, speed, step, of_bearings=False):
    """Difference of the tangents of a balance from those by differences of its forces, over their size.

    The state is random lines of 10 nm about the static one, the step (m) others. Of bearings, whose tilts count as
    lengths, or of meshes, where 10 nm are 10 nrad.
    """
    balance = HarmonicResidual(solver.model, solver.model.at(speed), solver.sampling)
    random = np.random.default_rng(0)

    def some(size):
        values = random.normal(size=(2, *balance.static.shape))
        lines = size * (values[0] + 1j * values[1]) / (solver.model.lengths if of_bearings else 1.0)
        lines[0] = lines[0].real
        return lines

    state, change = balance.static + some(1e-8), some(step)
    own = np.s_[:, balance.meshes if of_bearings else 0 :]
    ahead, behind = (balance.forces(state + sign * change)[0][own] for sign in (1.0, -1.0))
    found = balance.forces(state)[1](change)[own]
    assert np.abs(found).max() > 0.0
    return np.linalg.norm(0.5 * (ahead - behind) - found) / np.linalg.norm(found)


def torque_of_vibration(system: MeanSystem, speed: float, frequencies: np.ndarray, motion: np.ndarray) -> float:
    """Return the mean torque of the drive, N m, caused by a vibration in addition to that of the averaged system.

    It is of second order in the vibration: bearing moments on tilting bodies do work along the kinematic rotation. A
    time simulation without it gains or loses speed, 4e-5 per second at a lightly damped resonance of the GRC, which
    shifts phases there by 1e-2.

    Parameters
    ----------
    speed : of the input, rad/s
    frequencies : (lines,) angular frequencies, rad/s
    motion : (lines, size) coefficients about the static state, the mean first

    Notes
    -----
    The mean power of all forces along the kinematic rotation has to vanish. Meshes contribute none: the rotation does
    not deflect them. Products of two different orders have zero mean, so each relevant order is evaluated alone.
    """
    frame = system.frame
    assembly = system.frame.assembly
    load = assembly.torque_vector(assembly.gearbox.case.static_load.torques_N_m)
    here = system.static_at(speed) + motion[0].real

    def power(change: np.ndarray, frequency: float) -> float:
        parts = change, 1j * frequency * change, -(frequency**2) * change
        place, rate, bend = (np.asarray(part.real) for part in parts)
        q, v, a = frame.state(0.0, speed, here + place, rate, bend)
        missing = assembly.inertia_forces(q, v, a) - assembly.forces(q, v, frame.mean_meshes) - load
        return float(assembly.rolling_velocity(q, frame.speeds) @ missing)

    energies = frequencies**2 * (np.abs(motion) ** 2 @ np.abs(np.diag(system.mass)))
    energies[0] = 0.0
    still = power(np.zeros(system.size, dtype=complex), 0.0)
    total = 0.0
    for line in np.flatnonzero(energies > 1e-6 * energies.sum()):
        for part in math.sqrt(2.0) * motion[line] * np.array([[1.0], [-1.0], [1j], [-1j]]):
            total += 0.5 * (power(part, float(frequencies[line])) - still)
    rolling = assembly.rolling_velocity(np.zeros(assembly.size), frame.speeds)
    return total / float(rolling @ system.drive)


def drive_of(model, response):
    """Torque that keeps the speed, what the vibration takes of it included."""
    own = response.interface
    # What displaced pins cause at multiples of the carrier's rotation stands still on the carrier: it takes no power.
    of_pins = model.pin_places(own.speed).any(axis=1)
    motion = np.where(of_pins[:, None] & (own.frequencies[:, None] > 0.0), 0.0, response.motion)
    return (
        response.torque
        + torque_of_vibration(model.system, own.speed, own.frequencies, motion)
        + torque_of_errors(model, response)
        + torque_of_stated_loads(model, response)
    )


def torque_of_stated_loads(model, response):
    """Mean torque of the drive, N m, by stated loads that turn with the vibration of their bodies.

    A torque over the angle of its body does no work over a revolution: what it gives to the vibration it takes from the
    rotation. The method `nonlinear` includes it.
    """
    own = response.interface
    if not len(model.shaft_orders.loads.order):
        return 0.0
    return model.with_turned_loads(own, response.motion).loads.torque - own.loads.torque


def torque_of_errors(model, response):
    """Mean torque of the drive, N m, that mesh forces take along the deviations e of gears: F de/dt over the speed."""
    own = response.interface
    errors = model.deviations(own.speed)
    rates = 1j * own.frequencies[:, None] * errors
    force = response.force / model.waves.line_of_action
    power = 2.0 * float(np.sum((force[1:] * rates[1:].conj()).real))
    rolling = model.system.frame.assembly.rolling_velocity(
        np.zeros(model.system.frame.assembly.size), model.system.frame.speeds
    )
    return -power / own.speed / float(rolling @ model.system.drive)


def run_from(model, response, duration, step, torque, assembly=None, name="overall_dte_angle"):
    """Instants, a signal of one part, and angle of the input of a run in time that starts on a response.

    The overall transmission error is a length here.
    """
    time, signals_over_time, states, observer = whole_run(model, response, duration, step, torque, assembly)
    column = column_of(observer, name)
    factor = 1.0 if " " in name else observer.layout.radius
    return time, factor * signals_over_time[:, column], states[:, model.system.pinned]


def column_of(observer, name):
    """Column of a signal of one part, such as `mesh_force ring_planet_1`."""
    kind, _, part = name.partition(" ")
    column = observer.layout[kind].start
    if part:
        (dimension,) = next(own.dimensions[1:] for own in observer.layout.signals if own.name == kind)
        column += observer.layout.names[dimension].index(part)
    return column


def start_of(model, response):
    """Coordinates and velocities of a response at zero angle of the input."""
    interface = response.interface
    system, motion = model.system, response.motion + model.pin_places(interface.speed)
    w = interface.frequencies[1:, None]
    u = system.static_at(interface.speed) + motion[0].real + 2.0 * motion[1:].sum(axis=0).real
    return system.frame.state(0.0, interface.speed, u, 2.0 * (1j * w * motion[1:]).sum(axis=0).real)[:2]


def whole_run(model, response, duration, step, torque, assembly=None, every=8):
    """Instants, all signals and coordinates of a run in time, every few steps, and its observer.

    The run starts on a response.
    """
    assembly = assembly or model.waves.assembly
    q, v = start_of(model, response)
    load = assembly.gearbox.case.static_load
    loads = LoadTable({**load.torques_N_m, load.locked[0]: torque}, varying=assembly.varying_loads)
    run = CompiledSystem(assembly, q, v, loads, step)
    observer = Observer(assembly, loads)
    steps = round(duration / step)
    time, signal, coordinates = [], [], []
    for first in range(0, steps, 8000):
        states = np.empty((8000, assembly.size))
        rates = np.empty_like(states)
        assert run.advance(first, states, rates) == 8000
        time.append(step * (first + np.arange(every, 8001, every)))
        states, rates = (np.ascontiguousarray(values[every - 1 :: every]) for values in (states, rates))
        signal.append(observer.observe(time[-1], states, rates)[0])
        coordinates.append(states)
    return (*(np.concatenate(values) for values in (time, signal, coordinates)), observer)


def fitted(solver, response, duration, step, last, assembly=None, name="overall_dte_angle"):
    """Mean speed of a run in time that starts on a response, and lines of a signal, by default of the overall error.

    A line above half the rate at which the run is read appears as another one below it, which may be one of the
    others: those that hardly are there are left at zero.
    """
    model = solver.model
    time, overall, angle = run_from(model, response, duration, step, drive_of(model, response), assembly, name)
    late = time > duration - last
    speed, start = np.polyfit(time[late], angle[late], 1)
    half_rate = np.pi / (time[1] - time[0])
    size = abs(signals(model, response)[:, 0])
    size[0] = np.inf
    seen = np.flatnonzero((abs(speed * model.lines.orders) < half_rate) | (size > 1e-6 * size[1:].max()))
    angles = np.outer(np.copysign(1.0, speed) * (speed * time[late] + start), model.lines.orders[seen])
    columns = np.hstack([np.cos(angles), -np.sin(angles[:, 1:])])
    found = np.linalg.lstsq(columns, overall[late], rcond=None)[0]
    lines = np.zeros(len(model.lines.orders), dtype=complex)
    lines[seen[1:]] = found[1 : len(seen)] + 1j * found[len(seen) :]
    return float(speed), lines[1:]


def apart(solver, speed, duration, step, last, assembly=None):
    """Differences of lines and of their amplitudes between response and run, over the size of all lines.

    The run keeps its mean speed to some 1e-7, which at a resonance turns phases by 1e-4: the response is solved again
    at the speed that the run has.
    """
    measured, lines = fitted(solver, solver.response(speed), duration, step, last, assembly)
    known = 2.0 * signals(solver.model, solver.response(measured))[1:, 0]
    size = np.linalg.norm(known)
    return np.linalg.norm(lines - known) / size, np.linalg.norm(abs(lines) - abs(known)) / size


def apart_over_time(solver, speed, duration, step, last, assembly=None, name="overall_dte_angle"):
    """Difference of a signal over time between response and run, over its vibration: orders may lie close together.

    The response is solved again at the speed that the run has, as in `apart`.
    """
    model = solver.model
    response = solver.response(speed)
    time, found, angle = run_from(model, response, duration, step, drive_of(model, response), assembly, name)
    late = time > duration - last
    mean, rolled = rolling(model, response, time[late], angle[late])
    column = 0 if name == "overall_dte_angle" else [own.name for own in model.signal_names].index(name)
    lines = signals(model, solver.response(mean))[:, column]
    known = model.lines.values(lines, np.outer(np.copysign(1.0, speed) * rolled, model.lines.bases))
    change = found[late] - known
    return float(np.std(change) / np.std(known))


def rolling(model, response, time, angle):
    """Mean speed of a run, and the angle of the input at it: without what slow orders of the vibration add."""
    mean, start = np.polyfit(time, angle, 1)
    for _ in range(2):
        angles = np.outer(np.copysign(1.0, mean) * (mean * time + start), model.lines.bases)
        own = model.lines.values(response.motion[:, [model.system.pinned]], angles)[:, 0]
        mean, start = np.polyfit(time, angle - own, 1)
    return float(mean), mean * time + start


def planets_apart_over_time(solver, speed, duration, step, last):
    """Differences of signals over time between response and run, as root mean squares without the mean.

    Returns
    -------
    error : of the overall transmission error, m
    overall : vibration of the overall transmission error, m
    forces : largest of those of the forces of the meshes of all planets, over the vibration of each
    """
    model = solver.model
    response = solver.response(speed)
    time, found, states, observer = whole_run(model, response, duration, step, drive_of(model, response))
    late = time > duration - last
    mean, rolled = rolling(model, response, time[late], states[late, model.system.pinned])
    lines = signals(model, solver.response(mean))
    names = [own.name for own in model.signal_names]
    angles = np.outer(np.copysign(1.0, speed) * rolled, model.lines.bases)
    overall = observer.layout.radius * found[late, column_of(observer, "overall_dte_angle")]
    forces = []
    for meshes, planets in model.waves.groups:
        waves = [wave for wave in (model.waves.waves[n] for n in model.waves.force_waves) if wave.first == meshes[0]]
        columns = [names.index(f"mesh_force {wave.name}") for wave in waves]
        shapes = planets.values(planets.ratio * rolled)
        known = np.einsum("snw,sw->sn", shapes, model.lines.values(lines[:, columns], angles))
        for place, mesh in enumerate(meshes):
            own = found[late, column_of(observer, f"mesh_force {model.waves.assembly.elements[mesh].mesh.name}")]
            forces.append(float(np.std(own - known[:, place]) / np.std(own)))
    error = float(np.std(overall - model.lines.values(lines[:, [0]], angles)[:, 0]))
    return error, float(np.std(overall)), max(forces)


def amplitudes_apart(solver, speed, duration, step, last):
    """Differences of amplitudes between response and run, of all signals of a quantity together, over their size.

    Forces of meshes are those of the run, of planets as waves. Forces of bearings and accelerations of their seats
    follow from the lines of its motion. Orders count that have a hundredth of their signal or more: what a run has
    elsewhere is noise, which accelerations of high orders multiply.
    """
    model = solver.model
    system = model.system
    response = solver.response(speed)
    drive = drive_of(model, response)
    time, found, states, observer = whole_run(model, response, duration, step, drive, every=4)
    late = time > duration - last
    mean, rolled = rolling(model, response, time[late], states[late, system.pinned])
    response = solver.response(mean)
    known = signals(model, response)
    names = [own.name for own in model.signal_names]
    of_run = [frame_coordinates(system.frame, states[late], rolled) - system.static_at(mean)]
    of_meshes = []
    for meshes, planets in model.waves.groups:
        waves = [wave for wave in (model.waves.waves[n] for n in model.waves.force_waves) if wave.first == meshes[0]]
        of_meshes += [names.index(f"mesh_force {wave.name}") for wave in waves]
        elements = [model.waves.assembly.elements[mesh].mesh.name for mesh in meshes]
        forces = found[late][:, [column_of(observer, f"mesh_force {name}") for name in elements]]
        if planets is not None:
            forces = np.linalg.solve(planets.values(planets.ratio * rolled), forces[..., None])[..., 0]
        of_run.append(forces)
    orders = model.lines.orders
    seen = np.flatnonzero(abs(mean) * orders < np.pi / (time[1] - time[0]))
    angles = np.outer(np.copysign(1.0, mean) * rolled, orders[seen])
    columns = np.hstack([np.cos(angles), -np.sin(angles[:, 1:])])
    fit = np.linalg.lstsq(columns, np.hstack(of_run), rcond=None)[0]
    lines = np.zeros((len(orders), fit.shape[1]), dtype=complex)
    lines[seen[0]] = fit[0]
    lines[seen[1:]] = 0.5 * (fit[1 : len(seen)] + 1j * fit[len(seen) :])
    made = np.zeros_like(known)
    rows = response.interface.rows
    made[:, : len(rows.names)] = rows.of(lines[:, : system.size], response.interface.frequencies)
    made[:, of_meshes] = lines[:, system.size :]
    apart_by = {}
    for quantity in ("overall_dte", "mesh_force", "support_force", "seat_acceleration"):
        own = [n for n, signal in enumerate(model.signal_names) if signal.quantity == quantity]
        size = np.abs(known[seen[1:]][:, own])
        counted = size > 0.01 * np.linalg.norm(size, axis=0)
        change = (np.abs(made[seen[1:]][:, own]) - size)[counted]
        apart_by[quantity] = float(np.linalg.norm(change) / np.linalg.norm(size))
    return apart_by
