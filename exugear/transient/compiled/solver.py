"""The compiled solver: an assembly's equations integrated without Exudyn.

Same coordinates and same laws as the Exudyn system built from the same assembly (see
`exugear.transient.compiled.equations`), so that by the same method the trajectories differ by round-off only.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from exugear.system.assembly import Assembly
from exugear.system.loads import LoadTable
from exugear.system.signals import ENERGIES, POWERS, signal_layout
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.transient.compiled.equations import evaluate
from exugear.transient.compiled.loop import advance
from exugear.transient.compiled.methods import RUNGE_KUTTA, Method, Past
from exugear.transient.compiled.packing import equations_of, work_for
from exugear.transient.compiled.sampling import columns_of
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import compile_ahead
from fe_ste.tools.inner_kernels import bundle

POWER_INTERVAL = 1.0 / 30e3
"""Time between observations of powers, s: a sum over samples errs by what lies at the rate of the samples itself, and
powers of motions up to 10 kHz reach up to twice that."""
POWER_INTERVAL_PARTING = 1.0 / 60e3
"""The same where teeth may part: powers then change from one step to the next."""


def unsupported_reason(assembly: Assembly) -> str:
    """Reason why the compiled solver cannot take a variant, empty if it can.

    Every body of an assembly is axially symmetric with its centre of mass on its axis and at its node, as the
    equations need it; what is left to refuse are constraints.
    """
    if assembly.variant.is_constrained:
        return "the variant jointed keeps ideal joints as constraints, which an explicit method cannot solve"
    if assembly.floating:
        family = assembly.gearbox.body(next(iter(assembly.floating))).family
        return f"bodies.{family}.flexibility = 'ffrf' runs in Exudyn only, 'nonrotating' in both"
    return ""


def compile_loop_ahead(assembly: Assembly) -> None:
    """Let the loop over time, most of all that compiles, be compiled while a state to start from is looked for."""
    rest = np.zeros(assembly.size)
    nothing = np.empty((0, 0))
    system = CompiledSystem(assembly, rest, rest, LoadTable(), 1.0)
    compile_ahead(advance, *system.arguments(np.empty(0), 0, 1, nothing, nothing, nothing, nothing))


class CompiledSystem:
    """An assembly in motion.

    Parameters
    ----------
    q, v : (size,) initial coordinates and velocities
    step : time step, s; see `exugear.transient.compiled.step`
    method : the classical Runge-Kutta method by default
    past : (n, size)
        Accelerations at the steps before, the latest at the state itself. A multistep method goes on from them as if
        it had not stopped; without them it starts anew.
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
        parting = LAWS[assembly.mesh_law].signals_positions
        interval = POWER_INTERVAL_PARTING if parting else POWER_INTERVAL
        self._stride = max(1, int(interval / step + 1e-9))
        self._past = Past.of(method, np.zeros((0, assembly.size)) if past is None else past)
        self._past_b, self._method_b = bundle(self._past), bundle(method)

    @property
    def past(self) -> Floats:
        """Accelerations (n, size) to go on from."""
        return self._past.in_order()[:, : self._size]

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
        signals, energies : (steps, columns) (steps, 7)
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
        """Signals (n, columns) and energies (n, 7) of given states q, v (n, size) at times (n,), s.

        See `exugear.transient.compiled.sampling.take_sample`. The system itself stays where it is.
        """
        signals = np.empty((len(times), self._layout.count))
        energies = np.empty((len(times), len(ENERGIES) + len(POWERS)))
        self._pass(times, 0, 1, q, v, signals, energies)
        return signals, energies

    def _pass(self, times: Floats, first: int, stride: int, *rows: Floats) -> int:
        """Pass through states, see `exugear.transient.compiled.loop.advance`."""
        return advance(*self.arguments(times, first, stride, *rows))

    def arguments(self, times: Floats, first: int, stride: int, *rows: Floats) -> tuple[Any, ...]:
        """Return all that `exugear.transient.compiled.loop.advance` is called with."""
        how = first, self.step, self._method_b
        return times, *how, self._bundle, self._memory, self._past_b, self._columns, stride, *rows
