"""Steady states one speed after the other, at any level."""

from __future__ import annotations

from exugear.dynamics.assembly import Assembly
from exugear.harmonics.krylov import HarmonicBalanceError
from exugear.harmonics.lattice import Lattice
from exugear.harmonics.lines import line_set, modulated
from exugear.rotating.mean_system import mean_system
from exugear.rotating.mesh_waves import mesh_waves
from exugear.steady.excitation import Gearset, Interface
from exugear.steady.nonlinear import Balance, nonlinear_response, response_of_readings
from exugear.steady.response import Response, linear_response, parametric_response, transmission_errors
from exugear.steady.settings import SteadySettings
from exugear.steady.stability import CHECKED, candidates, growth_at, mean_growth
from fe_ste.tools.arrays import Complexes, Floats


def gearset_of(assembly: Assembly, speeds: Floats, harmonics: int = 10, combinations: int = 3) -> Gearset:
    """Gearset of an assembly for speeds of the input (rad/s), with lines as `SteadySettings` says."""
    waves = mesh_waves(mean_system(assembly, speeds))
    orders, modulators = waves.base_orders.tolist(), [own for _, own in waves.carriers]
    lines = modulated(line_set(orders, harmonics, combinations), modulators)
    larger = modulated(line_set(orders, 2 * harmonics, 2 * combinations), modulators)
    return Gearset(waves, lines, larger, 2 * harmonics)


class PointSolver:
    """Solves one speed after the other; at the level `nonlinear` each starts from the one before.

    Parameters
    ----------
    gearset : Gearset
    settings : SteadySettings
    """

    def __init__(self, gearset: Gearset, settings: SteadySettings) -> None:
        self.gearset, self._level = gearset, settings.level
        self._last: Complexes | None = None

    @property
    def lattice(self) -> Lattice:
        """Samples of the level `nonlinear`."""
        return self.gearset.lattice

    def forcing(self, interface: Interface) -> Complexes:
        """Find the forces of the meshes (lines, m, f) that vary in the static state, N."""
        if not self.gearset.parting:
            return transmission_errors(self.gearset, interface)
        balance = Balance(self.gearset, interface, self.lattice)
        return balance.forces(balance.static)[0]

    def growth(self, low: float, high: float) -> float:
        """Fastest growth of a disturbance between two speeds of the input (rad/s), 1/s."""
        found = [mean_growth(self.gearset)]
        unknown = self.gearset.parting or self.gearset.waves.carriers
        for candidate in () if unknown else candidates(self.gearset, low, high)[:CHECKED]:
            balance = Balance(self.gearset, self.gearset.at(candidate.speed), self.lattice)
            found.append(growth_at(balance, balance.static, candidate.base))
        return max(found)

    def response(self, speed: float) -> Response:
        """Response at a speed of the input, rad/s.

        Raises
        ------
        HarmonicBalanceError
            No steady state was found.
        """
        interface = self.gearset.at(speed)
        if self._level == "linear":
            return linear_response(self.gearset, interface)
        if self._level == "parametric" and not self.gearset.waves.carriers:
            return parametric_response(self.gearset, interface)
        return self._in_time(interface)

    def readings(self, speed: float) -> Complexes:
        """Find what the mesh laws read (n, m, r) at a speed of the input (rad/s), at the level `nonlinear`."""
        self._in_time(self.gearset.at(speed))
        assert self._last is not None
        return self._last

    def response_to(self, readings: Complexes, speed: float) -> Response:
        """Response at a speed of the input (rad/s) where what the mesh laws read (n, m, r) is known."""
        return response_of_readings(Balance(self.gearset, self.gearset.at(speed), self.lattice), readings)

    def _in_time(self, interface: Interface) -> Response:
        frozen = self._level == "parametric"
        try:
            found, self._last = nonlinear_response(self.gearset, interface, self.lattice, self._last, frozen)
        except HarmonicBalanceError:
            if self._last is None:
                raise
            found, self._last = nonlinear_response(self.gearset, interface, self.lattice, None, frozen)
        return found
