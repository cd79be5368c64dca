"""Equations of motion and the loop over time as one compiled piece that allocates nothing per step.

The laws are those of `exugear.kernels`, which the tests hold them against; here they are arranged for speed: every
sine is taken once per evaluation, constant entries that are zero are left out, bearing forces are collected per body
before they are turned into generalized ones. Bodies without a coordinate point to one that stays zero, so that
the loops need no exceptions.
"""

from __future__ import annotations

import math

from exugear.kernels.coordinates import SPIN, TILT
from exugear.kernels.elastic import set_elastic_motion
from exugear.kernels.travelling import place_travelling, share_travelling_forces
from exugear.kernels.turning import set_turning_motion
from exugear.solvers.compiled.arrays import (
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
from exugear.solvers.compiled.connectors import add_connectors, place_bodies
from exugear.solvers.compiled.meshes import add_meshes
from exugear.solvers.compiled.methods import (
    CORRECT_POSITION,
    CORRECT_VELOCITY,
    EXTRAPOLATE,
    KNOWN,
    LATEST,
    PREDICT_POSITION,
    PREDICT_VELOCITY,
    Method,
    Past,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import kernel

LAST_STAGE = 3
"""Evaluations of a Runge-Kutta step are numbered 0 to 3; the last one, at the new state, serves the next step too."""
START_PARTS = 4
"""Runge-Kutta steps in place of one, while a multistep method has not enough of the past: their error is smaller."""


@kernel
def add_springs(q: Floats, v: Floats, springs: Springs, f: Floats) -> None:
    """Add the torques of the torsional springs to f."""
    for n in range(springs.ends.shape[0]):
        i, j = springs.ends[n, 0], springs.ends[n, 1]
        torque = springs.stiffness[n] * (q[j] - q[i]) + springs.damping[n] * (v[j] - v[i])
        f[i] += torque
        f[j] -= torque


@kernel
def set_loads(t: float, q: Floats, v: Floats, loads: Loads, series: Integers, f: Floats) -> None:
    """Set f to what acts from outside at time t (s)."""
    for i in range(loads.steady.size):
        f[i] = loads.steady[i]
    for n in range(loads.coordinate.size):
        first, last = loads.first[n], loads.first[n + 1] - 1
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
        i, law = loads.drive[n], loads.law[n]
        angle = law[ANGLE] + t * (law[SPEED] + t * law[HALF_ACCELERATION])
        speed = law[SPEED] + 2.0 * t * law[HALF_ACCELERATION]
        f[i] += law[STIFFNESS] * (angle - q[i]) + law[DAMPING] * (speed - v[i])


@kernel
def set_accelerations(v: Floats, bodies: Bodies, work: Work) -> None:
    """Solve the bodies' equations for `work.rate`; formula in `exugear.kernels.inertia.accelerations`."""
    f, out = work.force, work.rate
    for n in range(bodies.mass.size):
        o, jt, ja = bodies.start[n], bodies.transverse[n], bodies.axial[n]
        sb, cb = work.frames[n, SIN_B], work.frames[n, COS_B]
        for i in range(3):
            out[o + i] = f[o + i] / bodies.mass[n]
        a, b, spin = o + TILT, o + TILT + 1, o + SPIN
        da, db = v[a], v[b]
        p = ja * (v[spin] + da * sb)  # angular momentum about the body's axis
        out[a] = (f[a] - f[spin] * sb - p * db * cb + 2.0 * jt * da * db * sb * cb) / (jt * cb * cb)
        out[b] = (f[b] - jt * da * da * sb * cb + p * da * cb) / jt
        out[spin] = f[spin] / ja - out[a] * sb - da * db * cb
    for n in range(bodies.spin.size):
        out[bodies.spin[n]] = f[bodies.spin[n]] / bodies.spin_inertia[n]
    # Gears that only roll share their inertia: one dense product instead of the above.
    for n in range(bodies.inverse.shape[0]):
        out[bodies.spin[n]] = 0.0
        for m in range(bodies.inverse.shape[1]):
            out[bodies.spin[n]] += bodies.inverse[n, m] * f[bodies.spin[m]]


@kernel
def evaluate(t: float, q: Floats, v: Floats, equations: Equations, work: Work) -> None:
    """Fill `work.rate` with the accelerations at time t (s) and state q, v (e,)."""
    place_bodies(q, v, equations.bodies, work)
    set_loads(t, q, v, equations.loads, work.series, work.force)
    add_connectors(q, v, equations.bodies, equations.connectors, work)
    place_travelling(q, v, equations.travelling)
    add_meshes(q, v, equations.meshes, work)
    share_travelling_forces(q, equations.travelling, work.force)
    add_springs(q, v, equations.springs, work.force)
    set_accelerations(v, equations.bodies, work)
    set_elastic_motion(q, v, work.force, equations.motion, work.scratch[0], work.rate)
    set_turning_motion(q, v, work.force, equations.turning, work.memory, work.rate)


@kernel
def stay(work: Work, size: int) -> None:
    """Take the state itself as that of the stage."""
    for i in range(size):
        work.stage_q[i], work.stage_v[i] = work.q[i], work.v[i]


@kernel
def predict(step: float, method: Method, past: Past, work: Work) -> None:
    """Fill the stage's state with the one a step ahead and `past.sums[0]` with its acceleration, both extrapolated."""
    x, u, ahead = work.stage_q, work.stage_v, past.sums[0]
    rows, latest = past.accelerations.shape[0], past.counts[LATEST]
    for i in range(ahead.size):
        x[i], u[i], ahead[i] = 0.0, 0.0, 0.0
    for k in range(method.weights.shape[1]):
        a = past.accelerations[(latest + rows - k) % rows]
        of_u, of_x = method.weights[PREDICT_VELOCITY, k], method.weights[PREDICT_POSITION, k]
        of_a = method.weights[EXTRAPOLATE, k]
        for i in range(ahead.size):
            u[i] += of_u * a[i]
            x[i] += of_x * a[i]
            ahead[i] += of_a * a[i]
    for i in range(ahead.size):
        x[i] = work.q[i] + step * (work.v[i] + step * x[i])
        u[i] = work.v[i] + step * u[i]


@kernel
def correct(step: float, method: Method, past: Past, work: Work) -> None:
    """Take the predicted state over, corrected by how far the acceleration there is from the extrapolated one."""
    of_v = step * method.correction[CORRECT_VELOCITY]
    of_q = step * step * method.correction[CORRECT_POSITION]
    for i in range(past.sums.shape[1]):
        difference = work.rate[i] - past.sums[0, i]
        work.q[i] = work.stage_q[i] + of_q * difference
        work.v[i] = work.stage_v[i] + of_v * difference


@kernel
def runge_kutta_stage(stage: int, step: float, past: Past, work: Work) -> None:
    """Fill the stage's state, after the first with the accelerations of the one before, which are in `work.rate`.

    The first acceleration is that of the state itself, the latest of the past. In the last stage the step is over: the
    stage's state is the new one, as `work.q` and `work.v` are. `past.sums` collects accelerations: for the positions,
    which need the first three alone, and for the velocities.
    """
    q, v, x, u, a = work.q, work.v, work.stage_q, work.stage_v, work.rate
    known, sums = past.accelerations[past.counts[LATEST]], past.sums
    ahead = 0.5 * step if stage < 2 else step
    for i in range(sums.shape[1]):
        if stage == 0:
            sums[0, i], sums[1, i] = known[i], known[i]
            x[i], u[i] = q[i] + ahead * v[i], v[i] + ahead * known[i]
        elif stage < LAST_STAGE:
            sums[0, i] += a[i]
            sums[1, i] += 2.0 * a[i]
            x[i] = q[i] + ahead * u[i]
            u[i] = v[i] + ahead * a[i]
        else:
            q[i] += step * (v[i] + step / 6.0 * sums[0, i])
            v[i] += step / 6.0 * (sums[1, i] + a[i])
            x[i], u[i] = q[i], v[i]


@kernel
def keep_acceleration(as_new: bool, work: Work, past: Past) -> None:
    """Make the accelerations in `work.rate` the latest of the past, in place of the latest one if not as new."""
    if as_new:
        past.counts[LATEST] = (past.counts[LATEST] + 1) % past.accelerations.shape[0]
    latest = past.accelerations[past.counts[LATEST]]
    for i in range(latest.size):
        latest[i] = work.rate[i]


@kernel
def copy_state(work: Work, q: Floats, v: Floats) -> bool:
    """Copy the state into q, v (size,); tell whether it is finite."""
    # A sum that is not finite shows any entry that is not, without a test for each.
    check = 0.0
    for i in range(q.size):
        q[i], v[i] = work.q[i], work.v[i]
        check += abs(q[i]) + abs(v[i])
    return math.isfinite(check)


@kernel
def advance(
    first: int,
    step: float,
    method: Method,
    equations: Equations,
    work: Work,
    past: Past,
    out_q: Floats,
    out_v: Floats,
) -> int:
    """Fill out_q and out_v (steps, size) with the states after each step, from `work.q`, `work.v` on.

    The first step begins at the time ``first * step``. Accelerations of the past are taken from `past` and left there.
    A multistep method that has not enough of them takes Runge-Kutta steps, `START_PARTS` in place of each. Returns the
    number of steps that stayed finite.
    """
    steps, size = out_q.shape
    points = method.weights.shape[1]
    # A state whose acceleration is not known takes a step of no length first: number -1.
    for n in range(-1 if past.counts[KNOWN] == 0 else 0, steps):
        multistep = points > 0 and past.counts[KNOWN] >= points
        parts = START_PARTS if n >= 0 and points > 0 and not multistep else 1
        h = step / parts
        for part in range(parts):
            begin = (first + n) * step + part * h
            for stage in range(LAST_STAGE if n < 0 or multistep else 0, LAST_STAGE + 1):
                at = begin + (0.5 * h if stage < 2 else h)
                if stage == LAST_STAGE and part == parts - 1:
                    at = (first + n + 1) * step
                if n < 0:
                    stay(work, size)
                elif multistep:
                    predict(step, method, past, work)
                else:
                    runge_kutta_stage(stage, h, past, work)
                evaluate(at, work.stage_q, work.stage_v, equations, work)
            if multistep:
                correct(step, method, past, work)
            # Of the parts of a starting step only the last acceleration is one of the past.
            keep_acceleration(part == 0, work, past)
        past.counts[KNOWN] += 1
        if n >= 0 and not copy_state(work, out_q[n], out_v[n]):
            return n
    return steps
