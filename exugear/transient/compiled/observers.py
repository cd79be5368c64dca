"""Signals, energies and powers of given states: what a run records, for whoever has the states."""

from __future__ import annotations

import numpy as np

from exugear.system.assembly import Assembly
from exugear.system.eigenmodes.modes import overall_row
from exugear.system.loads import LoadTable
from exugear.system.signals import ENERGIES, SignalLayout, signal_layout
from exugear.transient.compiled.solver import CompiledSystem
from fe_ste.tools.arrays import Floats


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
