"""Outcome of a run: results, failures and validity checks.

A run can end without an error and still be wrong: a torque of the wrong sign accelerates the gear train to speeds that
no gear survives, a parametric instability causes approaches larger than the tooth height, a bilateral model has tensile
force where teeth would have lost contact. Each limit is physical, far outside the range of valid runs, and is reported
with its reason. A run is stopped beyond limits that end in ``stopped``; beyond the others it continues and is marked as
invalid.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from exugear.gearbox.load_cases import BURSTING_RIM_SPEED, LoadSummary, rim_radii
from exugear.results.findings import percent_text
from exugear.results.folder import read_stored_gearbox
from exugear.results.spectra.diagrams import draw_levels, draw_waterfall
from exugear.results.spectra.waterfall import order_lines
from exugear.system.signals import ELASTIC, KINETIC, MESH_TIMES, energy_left_over
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin, TitledRows

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from exugear.gearbox.gearbox import Gearbox


class RunError(RuntimeError):
    """A run that failed; earlier results are kept."""


class LimitError(RunError):
    """A run that was stopped beyond a limit of this module, with its results so far."""

    def __init__(self, message: str, run: Run) -> None:
        super().__init__(message)
        self.run = run


@dataclass(frozen=True)
class Progress:
    """How far a run is: simulated and total time (s), wall time spent and expected to remain (s)."""

    simulated: float
    total: float
    wall: float
    remaining: float

    @property
    def speed(self) -> float:
        """Simulated seconds per second of wall time."""
        if self.wall > 0.0:
            return self.simulated / self.wall
        return 0.0


class ProgressMeter:
    """Progress reporter of a run.

    Parameters
    ----------
    begin, end : simulated time at the start and at the end, s
    tell : called with each `Progress`
    """

    def __init__(self, begin: float, end: float, tell: Callable[[Progress], None] | None) -> None:
        self._begin, self._end = begin, end
        self._report_progress = tell
        self._wall_start = time.perf_counter()

    @property
    def wall(self) -> float:
        """Wall time since the start, s."""
        return time.perf_counter() - self._wall_start

    def reach(self, now: float) -> None:
        """Report that the run has reached a simulated time, s."""
        if self._report_progress is None:
            return
        wall = self.wall
        done = now - self._begin
        remaining = wall * (self._end - now) / done if done > 0.0 else math.inf
        self._report_progress(Progress(now, self._end, wall, remaining))


@dataclass(frozen=True)
class Run(ReprMixin):
    """A finished or stopped run.

    Examples
    --------
    >>> Run(Path("rigid/run.nc"), complete=True, end=0.5, wall=1.25)
    <Run rigid/run.nc: complete, 0.5 s simulated in 1.2 s, valid>
    """

    path: Path
    complete: bool
    end: float
    wall: float
    """Simulated and wall time, s."""
    reasons: tuple[str, ...] = ()
    """Reasons why the run is invalid; empty if it is valid."""
    halted: bool = False
    """Whether it was stopped beyond a limit, and cannot be resumed."""

    def plot(
        self,
        kind: Literal["orders", "waterfall"] = "orders",
        ax: Axes | None = None,
        gearbox: Gearbox | None = None,
    ) -> Axes:
        """Draw the overall transmission error of a run-up.

        Parameters
        ----------
        kind : ``orders``: level along the orders of the meshes over speed, in dB; ``waterfall``: level over speed and
            frequency
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved
        gearbox : gearbox with the meshes; by default that of the results folder of the run

        Raises
        ------
        ValueError
            There is no such kind, or the speed does not change, so that no window length follows from it.
        FileError
            The run is missing or damaged.
        GearboxFileError
            The run is not in a results folder.

        Examples
        --------
        >>> Run(Path("rigid/run.nc"), complete=True, end=0.5, wall=1.25).plot("shape")
        Traceback (most recent call last):
        ValueError: kind = 'shape': must be one of orders, waterfall
        """
        from exugear.results.spectra.run_spectra import run_waterfall

        if kind not in ("orders", "waterfall"):
            raise ValueError(f"kind = {kind!r}: must be one of orders, waterfall")
        # The results folder, as `exugear.results.folder.run_directory` has it.
        lines = order_lines(gearbox or read_stored_gearbox(self.path.absolute().parents[2]))
        spectra = run_waterfall(self.path)
        if kind == "orders":
            return draw_levels(spectra, lines, ax)
        return draw_waterfall(spectra, lines, ax)

    @property
    def trusted(self) -> bool:
        """Whether the run stayed within the limits of what it may claim."""
        return not self.reasons

    @property
    def _state(self) -> str:
        if self.complete:
            return "complete"
        if self.halted:
            return "aborted at a limit"
        return "stopped"

    def _line(self) -> str:
        trust = "valid" if self.trusted else "invalid"
        return f" {self.path}: {self._state}, {self.end:g} s simulated in {self.wall:.1f} s, {trust}"

    def _table(self) -> TitledRows:
        rows = {
            "file": str(self.path),
            "state": self._state,
            "simulated": f"{self.end:g} s",
            "wall time": f"{self.wall:.1f} s",
            "valid": "yes" if self.trusted else f"no: {'; '.join(self.reasons)}",
        }
        return "Run", rows


# Validity checks of a run

ENERGY, RIM, SPEED, DEFLECTION, ACCOUNT = range(5)
"""Rows of the values of a `ValidityMonitor`; the last holds the initial energy and its scale."""
LARGEST, SINCE, WHERE = range(3)
"""Columns of these: largest value so far; time (s) and number of the body or mesh first beyond a limit."""
AT_START, SCALE = range(2)
"""Columns of the row `ACCOUNT`: energy that the account began with, and the largest so far, J."""
MONITOR_SHAPE = (5, 3)
"""Shape of the monitored values."""
TENSILE_ROW = MESH_TIMES.index("tensile_time")
"""Row of the times of meshes in which they pull."""
EXTRAPOLATED_ROW = MESH_TIMES.index("extrapolation_time")
"""Row of the times in which they are outside the range of their table."""
NOT_CONVERGED_ROW = MESH_TIMES.index("interpolation_time")
"""Row of the times in which they read a table next to states that have not converged."""
WHOLLY = 0.9
"""Part of a run with tensile mesh force from which it is load on the other flank, not oscillation about zero load."""


@dataclass(frozen=True)
class Limits:
    """Limits of what a run may claim."""

    energy_marked: float = 0.01
    energy_stopped: float = 0.1
    """Energy that the account does not explain, as part of the largest of work done, kinetic and elastic energy so
    far. Good runs stay below 1e-5: every term is known, and only the quadrature of the powers is left. At a
    hundredth, amplitudes are no longer known to the per cent that a level in dB is read by; a tenth from nowhere
    means that the step does not solve the equations."""
    rim_speed_stopped: float = BURSTING_RIM_SPEED
    """Tip speed of a gear, m/s: see `exugear.gearbox.load_cases.BURSTING_RIM_SPEED`."""
    overspeed_stopped: float = 2.0
    swaying: float = 10.0
    """Multiple of the maximum speed of the kinematic gear train under the loads, and permitted excess of the tip speed,
    m/s. Elastic motions oscillate about the kinematic one: 10 m/s at 1 kHz are 1.6 mm at the tip circle, a hundred
    times the deflection of loaded teeth."""
    deflection_marked: float = 0.05
    deflection_stopped: float = 0.25
    """Deflection of a mesh as part of the height of its teeth. Teeth of steel break at their root, at about 2 GPa, when
    they deflect by a sixtieth of their height: at three times this they have failed. At a quarter of the height the
    gear positions differ from those of the stiffness, and bilateral models include no gap."""
    pulling_marked: float = 0.5
    """Part of the run with tensile force in a mesh of a bilateral model. At resonances this may occur temporarily,
    where teeth would lose contact. A mesh with tensile force for half of the run or more is not loaded on the flank of
    its model."""

    def to_json(self) -> str:
        """Limits as text, for the file of a run."""
        return json.dumps(asdict(self))


LIMITS = Limits()


class ValidityMonitor:
    """Monitored values of a run so far, compared with the limits.

    Parameters
    ----------
    loads : what the load case intends, over the time that is simulated

    Attributes
    ----------
    figures : array of the shape `MONITOR_SHAPE`
        The complete state of the monitor: a resumed run takes it over.
    """

    def __init__(self, assembly: Assembly, loads: LoadSummary, limits: Limits = LIMITS) -> None:
        radii = rim_radii(assembly.gearbox)
        self.limits = limits
        self.figures = np.full(MONITOR_SHAPE, np.nan)
        self.figures[:ACCOUNT, LARGEST] = 0.0
        self._law = assembly.mesh_model
        self._bodies = tuple(radii)
        self._spins = np.array([assembly.spin[name] for name in self._bodies], dtype=np.int64)
        self._radii = np.array([radii[name] for name in self._bodies])
        self._intended = np.array([loads.rim_speeds[name] for name in self._bodies])
        self._allowed = limits.overspeed_stopped * self._intended + limits.swaying
        self._meshes = assembly.mesh_names
        gears = [(e.mesh.pair.pinion, e.mesh.pair.gear) for e in assembly.elements]
        self._heights = np.array([min(abs(g.tip_radius - g.root_radius) for g in pair) for pair in gears])
        # Teeth of a table fly from flank to flank without deflection.
        self._gaps = np.array([0.0 if e.table is None else e.table.backlash for e in assembly.elements])

    def see(self, times: Floats, deflections: Floats, v: Floats, account_times: Floats, account: Floats) -> None:
        """Add the results of a run since the last call.

        Parameters
        ----------
        times : (n,) s
        deflections : (n, meshes) m
        v : (n, size) velocities
        account_times, account : (k,) (k, terms)
            Rows of the energy balance, J, as in `exugear.system.signals.BALANCE_TERMS`.
        """
        # A run that diverges passes through numbers whose sums overflow: infinite or not a number, they are too large.
        with np.errstate(over="ignore", invalid="ignore"):
            start, scale = self.figures[ACCOUNT, [AT_START, SCALE]]
            if np.isnan(start):
                start = account[0, KINETIC] + account[0, ELASTIC]
                scale = 0.0
            left, scales = energy_left_over(account, start, scale)
            self.figures[ACCOUNT, [AT_START, SCALE]] = start, scales[-1]
            self._keep(ENERGY, account_times, left[None], 0.0, np.ones(1), self.limits.energy_marked)
            spins = v.T[self._spins]
            self._keep(RIM, times, spins, 0.0, self._radii, self.limits.rim_speed_stopped)
            self._keep(SPEED, times, spins, 0.0, self._radii / self._allowed, 1.0)
            given_way = np.ascontiguousarray(deflections.T)
            self._keep(DEFLECTION, times, given_way, self._gaps, 1.0 / self._heights, self.limits.deflection_marked)

    def _keep(
        self, row: int, times: Floats, values: Floats, gaps: Floats | float, scales: Floats, limit: float
    ) -> None:
        """Remember how large values become, and when and where one first passes a limit.

        Values (bodies or meshes, n) count with either sign, negative ones without a gap, each row times its scale.
        """
        if not values.size:
            return
        most = (np.maximum(values.max(axis=1), -values.min(axis=1) - gaps) * scales).max()
        if most <= limit:  # not so if any is no number
            self.figures[row, LARGEST] = max(self.figures[row, LARGEST], most)
            return
        values = (np.maximum(values.T, -values.T - gaps)) * scales
        known = np.where(np.isnan(values), np.inf, values)
        largest, since, _ = self.figures[row]
        self.figures[row, LARGEST] = max(largest, known.max())
        beyond = known.max(axis=1) > limit
        if beyond.any() and np.isnan(since):
            instant = int(np.argmax(beyond))
            self.figures[row, [SINCE, WHERE]] = times[instant], np.argmax(known[instant])

    @property
    def stop(self) -> bool:
        """Whether the run must be stopped."""
        limits = self.limits
        most = (limits.energy_stopped, limits.rim_speed_stopped, 1.0, limits.deflection_stopped)
        return bool(np.any(self.figures[:ACCOUNT, LARGEST] > most))

    def reasons(self, mesh_times: Floats, simulated: float) -> tuple[str, ...]:
        """Return the reasons why the run is invalid, none if it is valid.

        Parameters
        ----------
        mesh_times : (times, meshes) times of each mesh, s, as in `exugear.system.signals.MESH_TIMES`
        simulated : time so far, s
        """
        return (
            *self._energy_words(mesh_times[EXTRAPOLATED_ROW]),
            *self._speed_words(),
            *self._deflection_words(),
            *self._tensile_warning(mesh_times[TENSILE_ROW] / max(simulated, 1e-300)),
            *self._not_converged_warning(mesh_times[NOT_CONVERGED_ROW]),
        )

    def _energy_words(self, extrapolated: Floats) -> Iterator[str]:
        """Say that energy is missing, and why; the times (meshes,) of extrapolation beyond a table, s, are a cause."""
        largest, since, _ = self.figures[ENERGY]
        beyond = "the extrapolation beyond the table does not conserve energy, " if extrapolated.any() else ""
        if largest > self.limits.energy_marked:
            yield (
                f"energy: from t = {since:.4g} s on the energy balance error exceeds "
                f"{percent_text(self.limits.energy_marked)} of the largest energy in the run, maximum "
                f"{percent_text(largest)}; {beyond}the motion is unstable, or the time step is too large"
            )

    def _speed_words(self) -> Iterator[str]:
        """Say what is too fast: a motion that leaves the one which loads give it, or this motion itself."""
        largest, since, number = self.figures[SPEED]
        if largest > 1.0:
            name, intended, allowed = self._body(number)
            yield (
                f"speed: at t = {since:.4g} s the tip speed on {name} exceeds {allowed:.4g} m/s, but the loads cause "
                f"{intended:.4g} m/s at most; the motion is unstable"
            )
            return
        largest, since, number = self.figures[RIM]
        if largest > self.limits.rim_speed_stopped:
            name, _, _ = self._body(number)
            yield (
                f"overspeed at t = {since:.4g} s: tip speed on {name} exceeds {self.limits.rim_speed_stopped:g} m/s "
                "(burst speed of steel gears); check torque signs and torque balance"
            )

    def _body(self, figure: float) -> tuple[str, float, float]:
        """Name of a body by its number, its intended and its allowed speed of the rim, m/s."""
        number = int(figure)
        return self._bodies[number], float(self._intended[number]), float(self._allowed[number])

    def _deflection_words(self) -> Iterator[str]:
        largest, since, number = self.figures[DEFLECTION]
        limit = self.limits.deflection_marked
        if largest > limit:
            height = float(self._heights[int(number)])
            mesh = self._meshes[int(number)]
            yield (
                f"tooth deflection at t = {since:.4g} s: mesh {mesh}, tooth height {1e3 * height:.3g} mm, exceeds "
                f"{percent_text(limit)} of its tooth height, beyond breakage; maximum {percent_text(largest)}"
            )

    def _tensile_warning(self, share: Floats) -> Iterator[str]:
        limit = self.limits.pulling_marked
        names = [name for name, part in zip(self._meshes, share, strict=True) if part >= limit]
        if names:
            all_along = share.max() > WHOLLY
            cause = "check torque signs" if all_along else "the mesh is lightly loaded, or the motion is unstable"
            yield (
                f"tensile mesh force: {', '.join(names)} for up to {percent_text(share.max())} of the run (limit "
                f"{percent_text(limit)}); model {self._law} neglects contact loss; {cause}, or use --mesh-model table"
            )

    def _not_converged_warning(self, times: Floats) -> Iterator[str]:
        names = [name for name, time in zip(self._meshes, times, strict=True) if time > 0.0]
        if names:
            yield (
                f"table: {', '.join(names)} read table states next to non-converged ones (interpolated) for up to "
                f"{times.max():.3g} s; exugear ste lists the states and reasons"
            )
