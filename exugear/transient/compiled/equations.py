"""Equations of motion as one compiled piece that allocates nothing.

The laws are those of `exugear.system.kernels`, which the tests hold them against; here they are arranged for speed:
every sine is taken once per evaluation, constant entries that are zero are left out, bearing forces are collected per
body before they are turned into generalized ones. Bodies without a coordinate point to one that stays zero, so that the
loops need no exceptions.
"""

from __future__ import annotations

from exugear.system.bodies.kernels.elastic import set_elastic_motion
from exugear.system.bodies.kernels.travelling import place_travelling, share_travelling_forces
from exugear.system.bodies.kernels.turning import set_turning_motion
from exugear.system.kernels.coordinates import SPIN, TILT
from exugear.system.tooth_mesh.laws.forms import add_meshes
from exugear.transient.compiled.arrays import (
    ANGLE,
    COS_B,
    DAMPING,
    HALF_ACCELERATION,
    SIN_B,
    SPEED,
    STIFFNESS,
    Bodies,
    Equations,
    Loads,
    Springs,
    Work,
)
from exugear.transient.compiled.connectors import add_connectors
from exugear.transient.compiled.places import add_loads_of_places, gather_places, place_bodies
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel


@kernel
def add_springs(q: Floats, v: Floats, springs: Springs, f: Floats) -> None:
    """Add the torques of the torsional springs to f."""
    for n in range(springs.ends.shape[0]):
        i = springs.ends[n, 0]
        j = springs.ends[n, 1]
        torque = springs.stiffness[n] * (q[j] - q[i]) + springs.damping[n] * (v[j] - v[i])
        f[i] += torque
        f[j] -= torque


@kernel
def set_loads(t: float, q: Floats, v: Floats, loads: Loads, series: Integers, f: Floats) -> None:
    """Set f to what acts from outside at time t (s)."""
    for i in range(loads.steady.size):
        f[i] = loads.steady[i]
    for n in range(loads.coordinate.size):
        first = loads.first[n]
        last = loads.first[n + 1] - 1
        # Time mostly goes on: look from the line that was used last.
        line = series[n]
        while line < last - 1 and loads.time[line + 1] <= t:
            line += 1
        while line > first and loads.time[line] > t:
            line -= 1
        series[n] = line
        share = (t - loads.time[line]) / (loads.time[line + 1] - loads.time[line])
        share = min(1.0, max(0.0, share))
        f[loads.coordinate[n]] += loads.torque[line] + share * (loads.torque[line + 1] - loads.torque[line])
    for n in range(loads.drive.size):
        i = loads.drive[n]
        law = loads.law[n]
        angle = law[ANGLE] + t * (law[SPEED] + t * law[HALF_ACCELERATION])
        speed = law[SPEED] + 2.0 * t * law[HALF_ACCELERATION]
        f[i] += law[STIFFNESS] * (angle - q[i]) + law[DAMPING] * (speed - v[i])


@kernel
def set_accelerations(v: Floats, bodies: Bodies, work: Work) -> None:
    """Solve the bodies' equations for `work.rate`; formula in `exugear.system.kernels.inertia.accelerations`."""
    f = work.force
    out = work.rate
    for n in range(bodies.mass.size):
        o = bodies.start[n]
        jt = bodies.transverse[n]
        ja = bodies.axial[n]
        sb = work.frames[n, SIN_B]
        cb = work.frames[n, COS_B]
        per_mass = bodies.shares[n, 0]
        per_jt = bodies.shares[n, 1]
        per_ja = bodies.shares[n, 2]
        for i in range(3):
            out[o + i] = f[o + i] * per_mass
        a = o + TILT
        b = o + TILT + 1
        spin = o + SPIN
        da = v[a]
        db = v[b]
        p = ja * (v[spin] + da * sb)  # angular momentum about the body's axis
        out[a] = (f[a] - f[spin] * sb - p * db * cb + 2.0 * jt * da * db * sb * cb) * (per_jt / (cb * cb))
        out[b] = (f[b] - jt * da * da * sb * cb + p * da * cb) * per_jt
        out[spin] = f[spin] * per_ja - out[a] * sb - da * db * cb
    for n in range(bodies.spin.size):
        out[bodies.spin[n]] = f[bodies.spin[n]] / bodies.spin_inertia[n]
    # Gears that only roll share their inertia: one dense product instead of the above.
    for n in range(bodies.inverse.shape[0]):
        out[bodies.spin[n]] = 0.0
        for m in range(bodies.inverse.shape[1]):
            out[bodies.spin[n]] += bodies.inverse[n, m] * f[bodies.spin[m]]


@kernel
def evaluate(t: float, q: Floats, v: Floats, with_power: bool, equations: Equations, work: Work) -> None:
    """Fill `work.rate` with the accelerations at time t (s) and state q, v (e,).

    What bodies, meshes and connectors do there is left in `work.frames`, `work.mesh.states` and `work.supports`; what
    elastic bodies damp in `work.damped` if asked for with the power.
    """
    bodies = equations.bodies
    places = equations.places
    force = work.force
    place_bodies(q, v, bodies, work)
    place_travelling(q, v, equations.travelling, work.shares)
    gather_places(q, v, places, work)
    set_loads(t, q, v, equations.loads, work.series, force)
    add_connectors(q, bodies, equations.connectors, equations.pairs, work)
    add_meshes(q, v, equations.meshes, work)
    add_springs(q, v, equations.springs, force)
    add_loads_of_places(bodies, places, work)
    share_travelling_forces(equations.travelling, work.shares, force)
    set_accelerations(v, bodies, work)
    work.damped[0] = set_elastic_motion(q, v, force, with_power, equations.elastic, work.scratch, work.rate)
    work.damped[1] = set_turning_motion(q, v, force, with_power, equations.turning, work.memory, work.rate)
