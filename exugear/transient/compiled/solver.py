"""The compiled solver: an assembly's equations integrated without Exudyn.

Coordinates and models are the same as in the Exudyn system built from the same assembly (see
`exugear.transient.compiled.equations`), so that with the same method the trajectories differ only by round-off.

Methods are in `exugear.transient.compiled.integrator`. Signals and powers follow from the evaluation that each step
makes at its new state anyway. A multistep method evaluates at the predicted state: the change of signals by the
correction is known, and subtracted here or when they are stored (`exugear.transient.filters`).

Numbers here become part of machine code: `fe_ste.tools.compilation` recompiles when this file changes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from exugear.system.kernels.meshes import DEFLECTION, FORCE, FRAME, SPIN_1, SPIN_2, Meshes
from exugear.system.loads import LoadTable
from exugear.system.modes import overall_row
from exugear.system.signals import ENERGIES, POWERS, SignalLayout, signal_layout
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.transient.compiled.equations import evaluate
from exugear.transient.compiled.integrator import (
    CORRECT_POSITION,
    CORRECT_VELOCITY,
    EXTRAPOLATE,
    KNOWN,
    LATEST,
    PREDICT_POSITION,
    PREDICT_VELOCITY,
    RUNGE_KUTTA,
    Method,
    StepHistory,
)
from exugear.transient.compiled.packing import Equations, Work, equations_of, work_for
from exugear.transient.compiled.sampling import Columns, columns_of, take_sample
from fe_ste.tools.arrays import Floats
from fe_ste.tools.bundles import bundle
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, all_eight, eight, put, sum_of

# The loop over time as one compiled piece that allocates nothing per step: states, their signals and powers

LAST_STAGE = 3
"""Evaluations of a Runge-Kutta step are numbered 0 to 3; the last one, at the new state, serves the next step too."""
START_PARTS = 4
"""Runge-Kutta steps in place of one, while a multistep method has not enough of the past: their error is smaller."""


@kernel
def take(q: Floats, v: Floats, work: Work) -> None:
    """Take a state (size,) as that of the stage."""
    for i in range(q.size):
        work.stage_q[i], work.stage_v[i] = q[i], v[i]


@kernel
def predict(step: float, method: Method, past: StepHistory, work: Work) -> None:
    """Fill the stage's state with the one a step ahead and `past.sums[0]` with its acceleration, both extrapolated."""
    weights = method.weights
    ahead = past.sums[0]
    none = all_eight(0.0)
    for i in range(0, ahead.size, SIZE):
        of_x = none
        of_u = none
        of_a = none
        row = past.counts[LATEST]
        for k in range(weights.shape[1]):
            known = eight(past.accelerations[row], i)
            of_u = of_u + known * weights[PREDICT_VELOCITY, k]
            of_x = of_x + known * weights[PREDICT_POSITION, k]
            of_a = of_a + known * weights[EXTRAPOLATE, k]
            row = row - 1 if row > 0 else past.accelerations.shape[0] - 1
        v = eight(work.v, i)
        put(work.stage_q, i, eight(work.q, i) + (v + of_x * step) * step)
        put(work.stage_v, i, v + of_u * step)
        put(ahead, i, of_a)


@kernel
def correct(step: float, method: Method, past: StepHistory, work: Work) -> None:
    """Take the predicted state over, corrected by how far the acceleration there is from the extrapolated one."""
    of_v = step * method.correction[CORRECT_VELOCITY]
    of_q = step * step * method.correction[CORRECT_POSITION]
    for i in range(0, past.sums.shape[1], SIZE):
        difference = eight(work.rate, i) - eight(past.sums[0], i)
        put(work.q, i, eight(work.stage_q, i) + difference * of_q)
        put(work.v, i, eight(work.stage_v, i) + difference * of_v)


@kernel
def corrected_by(i: int, past: StepHistory, work: Work) -> float:
    """Difference of the acceleration of coordinate i from the extrapolated one; one that is missing has none."""
    if i < past.sums.shape[1]:
        return float(work.rate[i] - past.sums[0, i])
    return 0.0


@kernel
def correct_spinning_meshes(step: float, method: Method, past: StepHistory, meshes: Meshes, work: Work) -> None:
    """Carry what meshes of gears that only spin do on to the corrected state, to first order: two products each.

    Rows of other meshes would take a tenth of a step; `exugear.transient.filters` puts their signals right.
    """
    of_v = step * method.correction[CORRECT_VELOCITY]
    of_q = step * step * method.correction[CORRECT_POSITION]
    for m in range(meshes.coordinates.shape[0]):
        if meshes.spinning[m] == 0:
            continue
        index = meshes.coordinates[m]
        state = work.mesh.states[m]
        frame = corrected_by(index[FRAME], past, work)
        change = meshes.arrays.deflection[m, SPIN_1] * (corrected_by(index[SPIN_1], past, work) - frame)
        change += meshes.arrays.deflection[m, SPIN_2] * (corrected_by(index[SPIN_2], past, work) - frame)
        state[DEFLECTION] += of_q * change
        if state[FORCE] != 0.0:  # teeth that are apart stay so
            force = (meshes.mean[m, 0] * of_q + meshes.mean[m, 1] * of_v) * change
            state[FORCE] += force * meshes.arrays.line_of_action[m]


@kernel
def runge_kutta_stage(stage: int, step: float, past: StepHistory, work: Work) -> None:
    """Fill the stage's state, after the first with the accelerations of the one before, which are in `work.rate`.

    The first acceleration is that of the state itself, the latest of the past. In the last stage the step is over: the
    stage's state is the new one, as `work.q` and `work.v` are. `past.sums` collects accelerations: for the positions,
    which need the first three alone, and for the velocities.
    """
    q = work.q
    v = work.v
    x = work.stage_q
    u = work.stage_v
    a = work.rate
    known = past.accelerations[past.counts[LATEST]]
    sums = past.sums
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
def keep_acceleration(as_new: bool, work: Work, past: StepHistory) -> None:
    """Make the accelerations in `work.rate` the latest of the past, in place of the latest one if not as new."""
    if as_new:
        past.counts[LATEST] = (past.counts[LATEST] + 1) % past.accelerations.shape[0]
    latest = past.accelerations[past.counts[LATEST]]
    for i in range(0, latest.size, SIZE):
        put(latest, i, eight(work.rate, i))


@kernel
def copy_state(work: Work, q: Floats, v: Floats) -> bool:
    """Copy the state into q, v (size,); return whether it is finite."""
    # Nothing is left of a number times zero, but of one that is not finite.
    check = all_eight(0.0)
    filled = q.size - q.size % SIZE
    for i in range(0, filled, SIZE):
        place = eight(work.q, i)
        rate = eight(work.v, i)
        put(q, i, place)
        put(v, i, rate)
        check = check + (place + rate) * 0.0
    rest = sum_of(check)
    for i in range(filled, q.size):
        q[i], v[i] = work.q[i], work.v[i]
        rest += (q[i] + v[i]) * 0.0
    return math.isfinite(rest)


@kernel
def advance(
    times: Floats,
    first: int,
    step: float,
    method: Method,
    equations: Equations,
    work: Work,
    past: StepHistory,
    columns: Columns,
    stride: int,
    out_q: Floats,
    out_v: Floats,
    out_signals: Floats,
    out_energies: Floats,
) -> int:
    """Fill out_q and out_v (steps, size) with the states after each step, from `work.q`, `work.v` on.

    The first step begins at the time ``first * step``. Accelerations of the past are taken from `past` and left there;
    a multistep method that has not enough of them takes Runge-Kutta steps, `START_PARTS` in place of each. Signals and
    powers are filled if there is room for them, (steps, columns) and (steps, 7), powers every `stride` steps, counted
    from the first of the run: see `exugear.transient.compiled.sampling.take_sample`.

    With ``times`` (steps,) the states are given: they are sampled only, and the system stays where it is. One function
    does both, so that the equations are compiled once. Returns the number of states that are finite.
    """
    steps, size = out_q.shape
    points = method.weights.shape[1]
    given = times.size > 0
    # A state whose acceleration is not known takes a step of no length first: number -1.
    for n in range(-1 if past.counts[KNOWN] == 0 and not given else 0, steps):
        multistep = points > 0 and past.counts[KNOWN] >= points
        at_once = given or n < 0 or multistep
        parts = START_PARTS if points > 0 and not at_once else 1
        h = step / parts
        end = times[n] if given else (first + n + 1) * step
        due = n < out_signals.shape[0] and (given or (first + n + 1) % stride == 0)
        for part in range(parts):
            begin = (first + n) * step + part * h
            for stage in range(LAST_STAGE if at_once else 0, LAST_STAGE + 1):
                at = begin + (0.5 * h if stage < 2 else h)
                if stage == LAST_STAGE and part == parts - 1:
                    at = end
                if given:
                    take(out_q[n], out_v[n], work)
                elif n < 0:
                    take(work.q[:size], work.v[:size], work)
                elif multistep:
                    predict(step, method, past, work)
                else:
                    runge_kutta_stage(stage, h, past, work)
                evaluate(at, work.stage_q, work.stage_v, due, equations, work)
            if given:
                continue
            if multistep:
                correct(step, method, past, work)
            # Of the parts of a starting step only the last acceleration is one of the past.
            keep_acceleration(part == 0, work, past)
        if not given:
            past.counts[KNOWN] += 1
            if n < 0:
                continue
            if not copy_state(work, out_q[n], out_v[n]):
                return n
        if n < out_signals.shape[0]:
            if multistep and not given:
                correct_spinning_meshes(step, method, past, equations.meshes, work)
            q = work.stage_q
            v = work.stage_v
            stood_for = stride if due else 0
            take_sample(end, q, v, equations, work, columns, stood_for, given, out_signals[n], out_energies[n])
    done: int = steps
    return done


# The compiled solver: an assembly's equations integrated without Exudyn

POWER_INTERVAL = 1.0 / 30e3
"""Time between observations of powers, s: a sum over samples errs by what lies at the rate of the samples itself, and
powers of motions up to 10 kHz reach up to twice that."""
POWER_INTERVAL_PARTING = 1.0 / 60e3
"""The same with contact loss: powers then change from one step to the next."""


def unsupported_reason(assembly: Assembly) -> str:
    """Reason why the compiled solver cannot take a variant, empty if it can.

    Every body of an assembly is axially symmetric with its centre of mass on its axis and at its node, as the
    equations need it; what is left to refuse are constraints.
    """
    if assembly.variant.is_constrained:
        return "the variant jointed has ideal joints as constraints, which an explicit method cannot solve"
    if assembly.floating:
        family = assembly.gearbox.body(next(iter(assembly.floating))).family
        return f"bodies.{family}.flexibility = 'ffrf' requires Exudyn, 'nonrotating' runs in both"
    return ""


class CompiledSystem:
    """An assembly in motion.

    Parameters
    ----------
    q, v : (size,) initial coordinates and velocities
    step : time step, s; see `exugear.transient.compiled.integrator`
    method : the classical Runge-Kutta method by default
    past : (n, size)
        Accelerations at the steps before, the latest at the state itself. A multistep method continues from them as if
        it had not stopped; without them it starts afresh.
    """

    def __init__(
        self,
        assembly: Assembly,
        q: Floats,
        v: Floats,
        loads: LoadTable,
        step: float,
        method: Method = RUNGE_KUTTA,
        past: Floats | None = None,
    ) -> None:
        self.step = step
        self.equations = equations_of(assembly, loads)
        self._bundle = bundle(self.equations)
        self._size = assembly.size
        self._work = work_for(self.equations, q, v)
        self._memory = bundle(self._work)
        self._method = method
        self._layout = signal_layout(assembly)
        self._columns = bundle(columns_of(self._layout))
        parting = LAWS[assembly.mesh_model].signals_positions
        interval = POWER_INTERVAL_PARTING if parting else POWER_INTERVAL
        self._stride = max(1, int(interval / step + 1e-9))
        self._past = StepHistory.of(method, np.zeros((0, assembly.size)) if past is None else past)
        self._past_b, self._method_b = bundle(self._past), bundle(method)

    @property
    def past(self) -> Floats:
        """Accelerations (n, size) from which to continue."""
        return self._past.chronological()[:, : self._size]

    def accelerations(self, time: float = 0.0) -> Floats:
        """Accelerations (size,) at the present state and a time (s)."""
        evaluate(time, self._work.q, self._work.v, False, self._bundle, self._memory)
        return self._work.rate[: self._size].copy()

    def advance(
        self, first: int, q: Floats, v: Floats, signals: Floats | None = None, energies: Floats | None = None
    ) -> int:
        """Fill q and v (steps, size) with the states after each step from step number `first` on.

        Parameters
        ----------
        signals, energies : (steps, columns) (steps, 8)
            For what `exugear.transient.compiled.sampling.take_sample` fills. Powers but those of meshes stand for as
            many steps as make up the interval of powers; energies are not whole.

        Returns
        -------
        number of steps that stayed finite
        """
        none = np.empty((0, 0))
        outcome = q, v, none if signals is None else signals, none if energies is None else energies
        return self._pass(np.empty(0), first, self._stride, *outcome)

    def observe(self, times: Floats, q: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Signals (n, columns) and energies (n, 8) of given states q, v (n, size) at times (n,), s.

        See `exugear.transient.compiled.sampling.take_sample`. The system itself stays where it is.
        """
        signals = np.empty((len(times), self._layout.count))
        energies = np.empty((len(times), len(ENERGIES) + len(POWERS)))
        self._pass(times, 0, 1, q, v, signals, energies)
        return signals, energies

    def _pass(self, times: Floats, first: int, stride: int, *rows: Floats) -> int:
        """Pass through states, see `exugear.transient.compiled.solver.advance`."""
        return advance(*self.arguments(times, first, stride, *rows))

    def arguments(self, times: Floats, first: int, stride: int, *rows: Floats) -> tuple[Any, ...]:
        """Return all that `exugear.transient.compiled.solver.advance` is called with."""
        how = first, self.step, self._method_b
        return times, *how, self._bundle, self._memory, self._past_b, self._columns, stride, *rows


# Signals, energies and powers of given states: what a run records, for whoever has the states


class Observer:
    """Signals and energies of an assembly's states by one compiled loop.

    Parameters
    ----------
    loads : what acts from outside, for its power

    Attributes
    ----------
    layout : columns of the signals
    """

    def __init__(self, assembly: Assembly, loads: LoadTable) -> None:
        self.layout: SignalLayout = signal_layout(assembly)
        overall = assembly.gearbox.case.overall
        self._input = assembly.spin[overall.input]
        self._overall = overall_row(assembly) / self.layout.radius
        self._spins = [assembly.spin[name] for name in self.layout.names["body"]]
        self._springs = assembly.springs
        rest = np.zeros(assembly.size)
        self._system = CompiledSystem(assembly, rest, rest, loads, step=1.0)

    def observe(self, time: Floats, q: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
        """Observe states.

        Parameters
        ----------
        time : (samples,) s
        q, v : (samples, size) coordinates and velocities

        Returns
        -------
        signals : (samples, columns) see `layout`
        energies : (samples, 2) `exugear.system.signals.ENERGIES`, J
        powers : (samples, 5) `exugear.system.signals.POWERS`, W
        """
        signals, energies = self._system.observe(time, q, v)
        self.complete(q, v, signals)
        return signals, energies[:, : len(ENERGIES)], energies[:, len(ENERGIES) :]

    def complete(self, q: Floats, v: Floats, signals: Floats) -> None:
        """Fill those signals (samples, columns) that states q, v (samples, size) have by themselves."""
        signals[:, self.layout["input_speed"].start] = v[:, self._input]
        signals[:, self.layout["overall_dte_angle"].start] = q @ self._overall
        signals[:, self.layout["body_speed"]] = v[:, self._spins]
        if "coupling_torque" in self.layout:
            first, second = self._springs.coordinates.T
            torques = self._springs.stiffness * (q[:, second] - q[:, first])
            signals[:, self.layout["coupling_torque"]] = torques + self._springs.damping * (v[:, second] - v[:, first])
