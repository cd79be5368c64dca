"""A run from its start to its end, or to the first fault or interruption, by either solver."""

from __future__ import annotations

import numpy as np

from exugear.transient.compiled.solver import CompiledSystem
from exugear.transient.interruption import Interruption
from exugear.transient.plan import RunPlan
from exugear.transient.recorder import Recorder
from exugear.transient.start import RunStart
from fe_ste.tools.arrays import Floats

STEPS_AT_ONCE = 2000
"""Steps of one call of the compiled solver: Ctrl-C is heard between calls, and a step takes up to half a ms."""
STEP_TOLERANCE = 1e-3
"""How far Exudyn's clock may be from the step that is due, in steps."""


def integrate(plan: RunPlan, start: RunStart, recorder: Recorder, interruption: Interruption) -> None:
    """Integrate as planned; the recorder takes the states and any fault."""
    if start.state.step >= plan.steps:  # a kill fell between the last step and the joining of the pieces
        recorder.last_time = start.state.step * plan.step
    elif plan.solver == "compiled":
        _integrate_compiled(plan, start, recorder, interruption)
    else:
        _integrate_in_exudyn(plan, start, recorder, interruption)


def _integrate_compiled(plan: RunPlan, start: RunStart, recorder: Recorder, interruption: Interruption) -> None:
    """Let the compiled solver fill the recorder's buffer."""
    state = start.state
    step = plan.step
    method = plan.integration.method
    system = CompiledSystem(plan.assembly, state.q, state.v, start.loads, step, method, state.past)
    done = state.step
    recorder.begin(done * step, state.q, state.v)
    while done < plan.steps and not interruption.asked and not recorder.halted:
        room = recorder.buffer.room(min(plan.steps - done, STEPS_AT_ONCE))
        good = system.advance(done, *room)
        if good < len(room.q):
            recorder.fault = f"the state is not finite at t = {(done + good + 1) * step:.6g} s"
        recorder.past = system.past
        recorder.take_observed(step * np.arange(done + 1, done + good + 1, dtype=np.float64))
        done += good


def _integrate_in_exudyn(plan: RunPlan, start: RunStart, recorder: Recorder, interruption: Interruption) -> None:
    """Let Exudyn hand over each state."""
    from exugear.transient.exudyn_model.library import SolverFailure
    from exugear.transient.exudyn_model.system import ExudynSystem

    state = start.state
    step = plan.step
    system = ExudynSystem(plan.assembly, state.q, state.v, start.loads.as_functions(), plan.mesh_route)
    follow = _StepFollower(plan, start, recorder, interruption)
    try:
        system.run(state.step * step, plan.steps - state.step, step, follow, not plan.is_implicit)
    except SolverFailure as error:
        recorder.fault = recorder.fault or f"Exudyn gave up at t = {recorder.last_time:.6g} s: {error}"


class _StepFollower:
    """Observer of Exudyn's steps: the first call is the start itself."""

    def __init__(self, plan: RunPlan, start: RunStart, recorder: Recorder, interruption: Interruption) -> None:
        self._step = plan.step
        self._next = start.state.step
        self._begun = False
        self._recorder = recorder
        self._interruption = interruption

    def __call__(self, t: float, q: Floats, v: Floats) -> bool:
        """Hand a state over; False ends the run."""
        recorder = self._recorder
        due = self._next * self._step
        self._next += 1
        if not self._begun:
            self._begun = True
            recorder.begin(t, q, v)
            return not self._interruption.asked and not recorder.halted
        if np.isfinite(q).all() and np.isfinite(v).all() and abs(t - due) > STEP_TOLERANCE * self._step:
            recorder.last_time = t
            recorder.fault = (
                f"Exudyn cut the step at t = {t:.9g} s, expected {due:.9g} s: "
                "the equations were not solved at this step; use a smaller one"
            )
            return False
        recorder.keep(t, q, v)
        return not self._interruption.asked and not recorder.halted
