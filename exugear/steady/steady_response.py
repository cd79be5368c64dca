"""Steady response of a gearbox over speed: every line at every speed, without a run-up."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.units import RPM
from exugear.results.sound.levels import a_weighted
from exugear.results.sound.over_speed import line_frequencies
from exugear.results.sound.radiated_power import RadiatedPower, equivalent_power
from exugear.steady.balance.load_sharing import load_sharing
from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.neighbours import judged_speeds, with_needed_neighbours
from exugear.steady.balance.nonlinear import HarmonicResidual, Tangent, turned_balance
from exugear.steady.balance.response import Response, dissipated_and_given, exchanged_power, signals
from exugear.steady.balance.stability import growth_of_state
from exugear.steady.campbell import Campbell, ModeTracks, campbell_of, modes_over_speed
from exugear.steady.crossings import (
    HARMONICS,
    WIDE,
    Contributions,
    Crossing,
    contributions,
    crossings,
    loudest_near,
    with_crossings,
)
from exugear.steady.damping_band import DampingBand, damping_band, no_band
from exugear.steady.harmonics.branches import Scales, beside_jumps, standing_peaks, trace
from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError
from exugear.steady.harmonics.lines import LineSet
from exugear.steady.mean_system.mean_system import Steps
from exugear.steady.mean_system.mesh_places import DEFLECTION
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.mean_system.signals import SURFACE_VELOCITY, SignalName, round_off
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.settings import (
    SteadySettings,
    check_law,
    check_nonlinear,
    check_speeds,
    check_varying,
)
from exugear.steady.tops import (
    LOUDEST,
    LOUDEST_BESIDE_OTHERS,
    HigherBetween,
    KnownTops,
    ResponseCurves,
    higher_between,
    missed_flanks,
    missed_tops,
)
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers, SingleComplexes, Texts
from fe_ste.tools.display import ReprMixin, TitledRows, value_range
from fe_ste.tools.processes import each_in_forks
from fe_ste.tools.threads import one_dense_thread

LONGEST = 0.4
"""Longest step along a branch: in tenths of the static deflections, and in hundredths of the speed."""


@dataclass(frozen=True, eq=False)
class SteadyBranch(ReprMixin):
    """Steady states along a branch; n points."""

    speed: Floats
    """(n,) of the overall input, rad/s."""
    readings: Complexes
    """(n, lines, m, r) inputs of the mesh models."""
    growth: Floats
    """(n,) largest growth rate of a disturbance, 1/s, over the bases evaluated one at a time."""
    folds: tuple[float, ...]
    """Speeds at which the branch turns back, rad/s."""
    ended: str = ""
    """Why it ends before the last speed, and where; empty if it does not."""

    def _line(self) -> str:
        folds = ", ".join(f"{speed:.5g}" for speed in self.folds) or "none"
        return f": {len(self.speed)} points, {self.speed.min():.4g} to {self.speed.max():.4g} rad/s, folds at {folds}"

    @property
    def stable(self) -> Booleans:
        """Whether disturbances decay, (n,)."""
        return np.asarray(self.growth < 0.0)


def follow_branch(
    solver: PointSolver, first: float, last: float, progress: Callable[[float], None] | None = None
) -> SteadyBranch:
    """Follow the steady states from one speed of the input to another (rad/s), folds included.

    Parameters
    ----------
    solver : of the level `nonlinear`
    first, last : rad/s, of one sense
    progress : called with the speed of each point

    Raises
    ------
    HarmonicBalanceError
        No steady state was found at the first speed, or beyond it.
    SteadyError
        Planets mesh out of phase.
    """
    model = solver.continuation_model
    if model.waves.carriers:
        raise SteadyError(
            f"continuation: planets of {model.waves.carriers[0][0]} mesh out of phase, and stability is not "
            "computed with excitation by the carrier angle; remove --continuation"
        )

    def balance_at(speed: float, readings: Complexes) -> HarmonicResidual:
        return turned_balance(model, model.at(speed), readings)

    # The unknowns are lengths: a mesh cycle and a radian count as a base pitch.
    lengths = model.lengths

    def residual(scaled: Complexes, speed: float) -> tuple[Complexes, Tangent]:
        readings = scaled / lengths
        balance = balance_at(speed, readings)
        excess, tangent, _ = balance.forces(readings)
        return lengths * (readings - balance.static - balance.answer(excess)), tangent

    def solve(tangent: Tangent, right: Complexes, tolerance: float) -> Complexes:
        return lengths * tangent.solved(right / lengths, tolerance)[0]

    start = solver.readings(first)
    size = float(np.linalg.norm(start[0, :, DEFLECTION]))
    scales = Scales(0.1 * size, 0.01 * abs(first))
    found = trace(
        residual,
        lengths * start,
        first,
        last,
        scales,
        step=0.1 * LONGEST,
        longest=LONGEST,
        solve=solve,
        progress=progress,
    )
    readings = found.lines / lengths
    growth = [
        growth_of_state(balance_at(float(speed), reading), reading, model.is_nonlinear)
        for speed, reading in zip(found.parameter, readings, strict=True)
    ]
    ended = ""
    if not found.whole:
        turns = [n for n, _ in found.folds]
        count = len(found.parameter)
        reason = (
            f"steps are short at grazing contact, with {len(turns)} turning points, "
            f"{sum(n > count // 2 for n in turns)} of them in the second half; start at that speed, or"
        )
        if found.lost:
            reason = "no steady state is found near the last point, where the branch may end or turn sharply;"
        ended = (
            f"the continuation ends at {found.parameter[-1] / RPM:.5g} rpm after {count} points, before "
            f"{last / RPM:.5g} rpm: {reason} remove --continuation"
        )
    return SteadyBranch(found.parameter, readings, np.array(growth), tuple(fold for _, fold in found.folds), ended)


@dataclass(frozen=True, eq=False)
class SolvedPoints:
    """Points of a steady response as they are solved and kept."""

    speed: Floats
    """(points,) of the overall input, rad/s."""
    amplitude: SingleComplexes
    """(points, lines, signals) peak amplitudes; of line 0 the mean of the vibration about the static state. Single
    precision, as in the file."""
    drive_torque: Floats
    """(points,) N m."""
    energy_error: Floats
    """(points,) power dissipated by damping minus power supplied by the meshes, over the larger of both."""
    products: Floats
    """(points,) products with the operator of the balance."""
    apart: Floats
    """(points, waves) fraction of time without contact of each mesh component."""
    free: Floats
    """(points, bearings) share of time in which no rolling element of a non-linear bearing touches, of planets the
    mean."""
    growth: Floats
    """(points,) largest growth rate of a disturbance, 1/s, on a continuation and with contact loss; NaN elsewhere."""
    mean_angles: Booleans
    """(points,) whether meshes and stated loads are at the angles of the mean speed, because the vibration turns their
    bodies too far."""
    remark: Texts
    """(points,) what is to be said of a point, or why there is none: its numbers are NaN then."""

    @property
    def jumps(self) -> Booleans:
        """(points,) points beside one with other angles, where the response over speed jumps; speeds ascend."""
        return beside_jumps(self.mean_angles)

    def part(self, which: slice | Booleans | Integers) -> SolvedPoints:
        """Take some of the points."""
        return SolvedPoints(**{field.name: getattr(self, field.name)[which] for field in fields(self)})

    def joined_with(self, other: SolvedPoints) -> SolvedPoints:
        """Put the points of another behind these."""
        names = [field.name for field in fields(self)]
        return SolvedPoints(**{name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in names})


@dataclass(frozen=True, eq=False)
class SteadyResponse(ReprMixin):
    """Steady response over speed."""

    assembly: Assembly
    """As it was solved, with equal planets."""
    settings: SteadySettings
    input_hash: str
    """Of gearbox, choices and settings."""
    lines: LineSet
    base_names: tuple[str, ...]
    wave_names: tuple[str, ...]
    """Meshes of each base, and mesh components."""
    signals: tuple[SignalName, ...]
    bearing_names: tuple[str, ...]
    """Bearings whose law was evaluated in time; all others are linear about the static state."""
    radiated: RadiatedPower | None
    """Surface that radiates sound; None without a flexible housing."""
    solved: SolvedPoints
    """Points in ascending order of speed, or along a branch."""
    unsolved: tuple[tuple[float, str], ...]
    """Speeds at which no steady state was found, rad/s, and why."""
    crossings: tuple[Crossing, ...]
    """Where lines meet modes, the strongest first."""
    contributions: tuple[tuple[int, Contributions], ...]
    """Line and what makes it, at the strongest crossings."""
    sound_contributions: tuple[tuple[int, Contributions], ...]
    """Line and what makes its sound power, of the loudest lines at the loudest speed."""
    folds: tuple[float, ...]
    """Speeds at which a branch turns back, rad/s."""
    branch_ended: str
    """Why a branch ends before the last speed, and where; empty if it does not."""
    growth_rate: float
    """Largest growth rate of any disturbance over the speeds, 1/s: of the averaged system at combination resonances of
    two modes and a mesh frequency, and of the points with contact loss."""
    varying_carriers: tuple[str, ...]
    """Carriers with whose angles stiffness varies: their planets pass a flexible ring gear, or are not alike."""
    higher_between: tuple[HigherBetween, ...]
    """By quantity, the peaks that are higher between the computed speeds."""
    neighbours_left_out: float
    """Largest change of an order of the meshes by the orders left out beside it, relative, see
    `exugear.steady.balance.neighbours.with_needed_neighbours`."""
    planet_spread: float
    """Largest change of planet bearings' stiffness that made the planets equal, over that stiffness."""
    stiffness_variation: float
    """Largest change of stiffness over the carrier's places, over the stiffness, whose mean counts."""
    load_sharing: dict[str, float]
    """Family of meshes and K_gamma of planets on displaced pins, as `load_sharing` has them."""
    harmonics: int
    """Harmonics of each mesh frequency."""
    left_out: Floats
    """(waves,) share of the variation of each mesh's compliance that is above them."""
    change_with_more: float
    """Largest relative change of the ten highest peaks with 1.5 times as many harmonics and combinations; NaN where
    each state has as many orders as it needs."""
    band: DampingBand
    """How high the highest peaks are with the lowest and the highest plausible damping."""
    shafts: int
    """Number of bases, the last ones, that are rotations of shafts whose gears have deviations."""
    campbell: Campbell
    """Modes over the speeds, up to the highest orders that `crossings` evaluates."""

    def _line(self) -> str:
        assembly = self.assembly
        return (
            f" of {assembly.gearbox.name[:60]!r}, {assembly.variant}, {assembly.mesh_model}, "
            f"{self.settings.method}: {len(self.solved.speed)} speeds, {len(self.lines.orders)} lines"
        )

    def _table(self) -> TitledRows:
        return repr(self).strip("<>"), {
            "speed of the input": value_range(self.solved.speed, "rpm", 1.0 / RPM),
            "lines": str(len(self.lines.orders)),
            "signals": str(len(self.signals)),
            "largest growth rate of the averaged system": f"{self.growth_rate:.3g} 1/s",
        }

    def amplitude(self, signal: str, line: tuple[int, ...]) -> Complexes:
        """Amplitude (points,) of a line, given by its multiples of the bases, in a signal, given by its name.

        Raises
        ------
        SteadyError
            There is no such signal, or no such line.
        """
        names = [name.name for name in self.signals]
        if signal not in names:
            raise SteadyError(f"no signal {signal!r}; signals are {', '.join(names)}")
        place, mirrored = self.lines.find(np.array(line, dtype=np.int64))
        if place < 0:
            raise SteadyError(f"no line {line}; single bases go up to {self.settings.harmonics}")
        values = self.solved.amplitude[:, int(place), names.index(signal)].astype(np.complex128)
        return np.conj(values) if mirrored else values


CHECKED, MORE = 10, 1.5
"""Number of highest peaks that are recomputed, and the factor on the numbers of harmonics and combinations."""
PEAKS_WITH_CONTRIBUTIONS = 20
"""Crossings whose peaks are taken apart."""
LINES_WITH_CONTRIBUTIONS = 5
"""Loudest lines whose sound power is explained."""
ROUNDS = 8
"""Times that tops, and then speeds on flanks, are looked for between speeds, at most."""
SLOWEST_BRANCH = 0.01
"""Share of the fastest speed at which a branch from standstill begins."""
LONGEST_WARNING = 300
"""Letters of a remark."""
KEPT_AT_MOST = 30.0
"""Time between two writes of the points that are solved, over the time of a write."""
RESOLVED = 1e-4
"""Share of the exchanged power below which dissipated power is round-off."""
STILL = 1e-12
"""Share of the largest deflection of a mesh below which vibration is round-off."""
Kept = Callable[[SolvedPoints], None]


@one_dense_thread()
def response_of(
    assembly: Assembly,
    settings: SteadySettings,
    known: SolvedPoints | None = None,
    progress: Callable[[int, int], None] | None = None,
    keep: Kept | None = None,
    keep_every: float = 10.0,
    prepared: Steps | None = None,
) -> SteadyResponse:
    """Steady response of an assembly.

    Parameters
    ----------
    known : points that were solved before
    progress : called with the number of points that are solved, and of all
    keep : callable, optional
        Called with the points that are solved, at times.
    keep_every : seconds between them at least
    prepared : called before the first point with the steps of the preparation
    """
    check_speeds(assembly.gearbox, settings.speeds)
    check_law(assembly.mesh_model, settings.method)
    check_nonlinear(assembly.gearbox, settings.method)
    check_varying(assembly, settings.method)
    even = settings.speeds.values
    model = harmonic_balance_model(assembly, even, settings.harmonics, settings.combinations, settings.method, prepared)
    solver = PointSolver(model, settings.method)
    report = progress or (lambda done, total: None)
    tracks = _tracks(model, even)
    operation = operating_range(assembly.gearbox)
    at_resonances = settings.at_resonances and (
        model.loses_contact or model.waves.varies or bool(model.shaft_orders.sidebands)
    )
    found = crossings(model, tracks, solver.forcing, operation) if at_resonances else ()
    neglected = 0.0
    if model.waves.neighbours and not model.loses_contact:
        every = model.lines.index
        judged = judged_speeds(even, [(one.line, one.speed) for one in found], operation)
        model, neglected = with_needed_neighbours(model, judged, prepared)
        solver = PointSolver(model, settings.method)
        found = tuple(replace(one, line=int(model.lines.find(every[one.line])[0])) for one in found)
    folds: tuple[float, ...] = ()
    ended = ""
    higher: tuple[HigherBetween, ...] = ()
    if settings.branches:
        points, folds, ended = _follow_branch(solver, settings.speeds.first, settings.speeds.last, report)
    else:
        # Without contact loss, curves through the neighbours of a wide resonance show its top.
        curved = settings.method != "nonlinear" and not model.loses_contact
        points = _empty(solver.model, with_crossings(even, found, WIDE if curved else math.inf))
        solve = partial(_solve_from, known=known, progress=report, keep=keep, keep_every=keep_every)
        solve(points, 0, lambda: solver, follows=settings.method == "nonlinear")
        if at_resonances:
            points, higher = _with_tops(solver, points, operation, tracks.least_damping, solve)
        points = points.part(np.argsort(points.speed, kind="stable"))
    is_solved = np.isfinite(points.drive_torque)
    if not is_solved.any():
        raise HarmonicBalanceError(str(points.remark[0]))
    solved = points if is_solved.all() else points.part(is_solved)
    linear = solver.linear
    strongest = () if linear.loses_contact else found[:PEAKS_WITH_CONTRIBUTIONS]
    band = no_band(tuple(quantity.name for quantity in linear.quantities))
    if settings.method != "nonlinear" and not linear.loses_contact:
        band = damping_band(linear, settings.method, solved.speed, solved.amplitude, solved.jumps)
    growth = solver.growth(float(even.min()), float(even.max()))
    return SteadyResponse(
        assembly=model.waves.assembly,
        settings=settings,
        input_hash=settings.hash_with(assembly),
        lines=model.lines,
        base_names=model.base_names,
        shafts=len(model.shaft_orders.rotations),
        wave_names=tuple(wave.name for wave in model.waves.waves),
        signals=model.signal_names,
        bearing_names=solver.model.bearing_names,
        radiated=model.radiated,
        solved=solved,
        unsolved=tuple(zip(points.speed[~is_solved].tolist(), points.remark[~is_solved].tolist(), strict=True)),
        crossings=found,
        contributions=tuple(each_in_forks(partial(_explained, linear.frozen), strongest)),
        sound_contributions=tuple(_sound_contributions(linear, solved, operation)),
        folds=folds,
        branch_ended=ended,
        growth_rate=float(np.fmax.reduce(solved.growth, initial=growth)),
        varying_carriers=model.waves.varying_carriers,
        higher_between=higher,
        neighbours_left_out=neglected,
        planet_spread=model.system.planet_spread,
        stiffness_variation=model.system.variation,
        load_sharing=load_sharing(model, solved.amplitude, solved.speed),
        harmonics=model.usual_harmonics,
        left_out=model.waves.left_out(model.usual_harmonics),
        change_with_more=math.nan if settings.branches else _change_with_more(solver, solved),
        band=band,
        campbell=campbell_of(linear.system, tracks),
    )


def _explained(model: HarmonicBalanceModel, crossing: Crossing) -> tuple[int, Contributions]:
    """Line of a crossing, and what makes it at its peak."""
    speed = loudest_near(model, crossing.speed, 2.0 * crossing.damping, crossing.line)
    return crossing.line, contributions(model, speed, crossing.line)


def _sound_contributions(
    model: HarmonicBalanceModel, solved: SolvedPoints, operation: tuple[float, float] | None
) -> Iterator[tuple[int, Contributions]]:
    """Yield the loudest lines at the loudest speed in operation, A-weighted, and what makes them."""
    radiated = model.radiated
    if radiated is None or model.loses_contact:
        return
    velocity = np.abs(solved.amplitude[..., model.signal_names.index(SURFACE_VELOCITY)]).astype(np.float64)
    frequency = line_frequencies(solved.speed, model.lines.orders)
    power = a_weighted(equivalent_power(velocity, radiated.area), frequency)
    power[frequency > radiated.limit] = 0.0
    in_operation = np.abs(solved.speed) >= 0.0
    if operation is not None:
        low, high = operation
        in_operation = (np.abs(solved.speed) >= low) & (np.abs(solved.speed) <= high)
    point = int(np.argmax(np.where(in_operation, power.sum(axis=1), -1.0)))
    for line in np.argsort(-power[point], kind="stable")[:LINES_WITH_CONTRIBUTIONS].tolist():
        # Combinations of several bases are no sum over meshes.
        if power[point, line] > 0.0 and np.count_nonzero(model.lines.index[line]) == 1:
            yield line, contributions(model.frozen, float(solved.speed[point]), line, model.frozen.radiated)


def _tracks(model: HarmonicBalanceModel, speeds: Floats) -> ModeTracks:
    """Follow modes that a harmonic of a mesh or a stated load may reach; of elastic bodies, those in their band."""
    assembly = model.waves.assembly
    low = float(speeds.min())
    high = float(speeds.max())
    order = max(HARMONICS * float(model.waves.base_orders.max(initial=0.0)), model.shaft_orders.highest_load)
    highest = order * float(np.abs(speeds).max()) / (2.0 * np.pi)
    if assembly.elastic_bodies:
        highest = min(highest, assembly.gearbox.case.elasticity.band_Hz)
    return modes_over_speed(model.system.frozen, low, high, highest)


def _with_tops(
    solver: PointSolver,
    points: SolvedPoints,
    operation: tuple[float, float] | None,
    damping: float,
    solve: Callable[..., None],
) -> tuple[SolvedPoints, tuple[HigherBetween, ...]]:
    """Solve at speeds where neighbours indicate peaks higher than at any known speed, until none remain.

    Then speeds are added on flanks of the highest peaks that have too few for a drawing. Each such state starts
    independently of others, so that a resumed computation gives the same results. Peaks that are higher between the
    speeds after that are returned, too.
    """
    tops: KnownTops = {}
    model = solver.model
    loudest = LOUDEST_BESIDE_OTHERS if model.waves.neighbours else LOUDEST

    def curves() -> ResponseCurves:
        """Return the response over the speeds that are solved."""
        is_solved = np.flatnonzero(np.isfinite(points.drive_torque))
        own = points.part(is_solved[np.argsort(points.speed[is_solved], kind="stable")])
        kinks = np.asarray(own.apart.any(axis=1) | own.free.any(axis=1))
        audible = None
        if model.radiated is not None:
            audible = line_frequencies(own.speed, model.lines.orders) <= model.radiated.limit
        return ResponseCurves(
            own.speed, own.amplitude, ~kinks, own.jumps, model.quantities, operation, damping, audible
        )

    for missed in (partial(missed_tops, known=tops, count=loudest), missed_flanks):
        for _ in range(ROUNDS):
            more = missed(curves())
            if not more.size:
                break
            count = len(points.speed)
            points = points.joined_with(_empty(model, more))
            solve(points, count, lambda: PointSolver(solver.linear, solver.method))
            # A speed that was not requested and has no steady state is dropped without a warning.
            kept = (np.arange(len(points.speed)) < count) | np.isfinite(points.drive_torque)
            points = points if kept.all() else points.part(kept)
    return points, higher_between(curves(), tops)


def _solve_from(
    points: SolvedPoints,
    first: int,
    solver: Callable[[], PointSolver],
    known: SolvedPoints | None,
    progress: Callable[[int, int], None],
    keep: Kept | None,
    keep_every: float,
    follows: bool = False,
) -> None:
    """Solve all points from one on; known ones are taken over.

    Parameters
    ----------
    follows : whether each state begins with the one before; else points are solved on all cores
    """
    count = first
    if known is not None:
        shared = min(len(known.speed), len(points.speed))
        if np.array_equal(known.speed[:shared], points.speed[:shared]):
            count = max(first, shared)
        start = solver()
        if not first and start.model.is_nonlinear and count < len(points.speed):
            # States with contact loss depend on earlier ones: continue from the last one with full contact.
            touching = np.isfinite(known.drive_torque) & ~(known.apart.any(axis=1) | known.free.any(axis=1))
            count = int(np.max(np.flatnonzero(touching[:count]) + 1, initial=0))
            if count:
                start.response(float(points.speed[count - 1]))
        for field in fields(SolvedPoints):
            getattr(points, field.name)[first:count] = getattr(known, field.name)[first:count]
    speeds = points.speed[count:].tolist()
    solved = (_solved_at(speed, solver()) for speed in speeds)
    if not follows:
        solved = each_in_forks(lambda speed: _solved_at(speed, solver()), speeds)
    kept = time.monotonic()
    done = count
    try:
        with closing(solved):
            for point in solved:
                for field in fields(SolvedPoints):
                    getattr(points, field.name)[done] = getattr(point, field.name)[0]
                done += 1
                progress(done, len(points.speed))
                if keep is not None and time.monotonic() - kept > keep_every:
                    begin = time.monotonic()
                    keep(points.part(slice(done)))
                    kept = time.monotonic()
                    # Hundreds of megabytes take seconds to write: most of the time is left to the solution.
                    keep_every = max(keep_every, KEPT_AT_MOST * (kept - begin))
    except KeyboardInterrupt:
        if keep is not None and done:
            keep(points.part(slice(done)))
        raise


def _change_with_more(solver: PointSolver, solved: SolvedPoints) -> float:
    """Return the largest relative change of the highest peaks of the transmission error with more orders.

    Peaks at which the method `nonlinear` finds no state from rest are left out.
    """
    model = solver.model
    if model.is_nonlinear:
        return math.nan
    if not model.waves.varies:
        return 0.0
    other = PointSolver(solver.linear.with_more(MORE), solver.method)
    values: Floats = np.abs(solved.amplitude[:, :, 0].astype(np.complex128))
    found = []
    for line in range(1, values.shape[1]):
        peaks = standing_peaks(values[:, line])
        found += [(int(point), line) for point in (peaks if peaks.size else [np.argmax(values[:, line])])]
    found.sort(key=lambda peak: -values[peak])
    least = round_off("error", float(values[found[0]]) if found else 0.0)
    changes = [0.0]
    for point, line in (peak for peak in found[:CHECKED] if values[peak] > least):
        place, _ = other.model.lines.find(model.lines.index[line])
        with suppress(HarmonicBalanceError):
            response = other.response(float(solved.speed[point]))
            amplitude = 2.0 * abs(complex(signals(other.model, response)[int(place), 0]))
            changes.append(abs(amplitude / float(values[point, line]) - 1.0))
    return max(changes)


def _solved_at(speed: float, solver: PointSolver) -> SolvedPoints:
    """Solve a point, or enter why it has no steady state; the others do not suffer from that."""
    out = _empty(solver.model, np.array([speed]))
    try:
        _fill(out, 0, solver.model, solver.response(speed))
    except HarmonicBalanceError as error:
        for values in (out.amplitude, out.drive_torque, out.energy_error, out.apart, out.free):
            values[0] = np.nan
        out.remark[0] = str(error)[:LONGEST_WARNING]
        return out
    if solver.state is not None:
        out.growth[0], out.remark[0] = solver.state.growth, solver.state.remark[:LONGEST_WARNING]
    return out


def _follow_branch(
    solver: PointSolver, first: float, last: float, progress: Callable[[int, int], None]
) -> tuple[SolvedPoints, tuple[float, ...], str]:
    """Points along a branch between two speeds (rad/s), its folds, and why it ended before the last.

    Progress counts in hundredths of the range.
    """
    fastest = max(abs(first), abs(last))
    first, last = (np.copysign(SLOWEST_BRANCH * fastest, first + last) if s == 0.0 else s for s in (first, last))
    branch = follow_branch(
        solver, first, last, lambda s: progress(int(100.0 * abs(s - first) / abs(last - first)), 100)
    )
    out = _empty(solver.model, branch.speed)
    for n, (speed, readings) in enumerate(zip(branch.speed, branch.readings, strict=True)):
        _fill(out, n, solver.model, solver.response_to(readings, float(speed)))
    out.growth[:] = branch.growth
    return out, branch.folds, branch.ended


def _empty(model: HarmonicBalanceModel, speeds: Floats) -> SolvedPoints:
    points = len(speeds)
    shape = (points, len(model.lines.orders), len(model.signal_names))
    return SolvedPoints(
        speed=speeds,
        amplitude=np.zeros(shape, dtype=np.complex64),
        drive_torque=np.zeros(points),
        energy_error=np.zeros(points),
        products=np.zeros(points),
        apart=np.zeros((points, len(model.waves.waves))),
        free=np.zeros((points, len(model.bearing_names))),
        growth=np.full(points, np.nan),
        mean_angles=np.zeros(points, dtype=bool),
        remark=np.zeros(points, dtype=f"<U{LONGEST_WARNING}"),
    )


def _fill(out: SolvedPoints, n: int, model: HarmonicBalanceModel, response: Response) -> None:
    """Enter the response at one speed as point n."""
    found = signals(model, response)
    found[1:] *= 2.0
    out.amplitude[n] = found
    taken, given = dissipated_and_given(model, response)
    out.drive_torque[n] = response.torque
    out.products[n] = response.products
    out.apart[n] = response.apart
    out.free[n] = response.free
    out.mean_angles[n] = response.at_mean_angles
    loads = response.interface.loads
    least = max(RESOLVED * exchanged_power(response), 1e-300)
    deflections = np.abs(response.deflection)
    nothing_loads = loads is None or not loads.motion[1:].any()
    if nothing_loads and deflections[1:].max(initial=0.0) <= STILL * deflections.max(initial=0.0):
        return  # nothing excites: powers of round-off do not balance
    out.energy_error[n] = (taken - given) / max(abs(taken), abs(given), least)
