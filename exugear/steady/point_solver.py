"""Steady-state solutions, one speed after the other, by any method.

With contact loss, a solution of Newton's method is refined by more harmonics until they have no effect, and its
stability is checked. If no solution is found near the last one, or it is unstable, a time simulation starts from there:
it settles to another steady state, or to none, which is reported as text. Finally the planets are modelled
individually: with unequal load sharing each passing planet causes sidebands of all orders, and these act back on the
vibration.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from exugear.steady.balance.interface import Interface
from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.nonlinear import (
    HarmonicResidual,
    nonlinear_response,
    response_of_readings,
    solve_balance,
    solve_turning,
    turned_balance,
)
from exugear.steady.balance.response import (
    Response,
    linear_response,
    mean_deviation_forces,
    parametric_response,
    signals,
    transmission_errors,
)
from exugear.steady.balance.stability import CHECKED, candidates, growth_at, growth_of_state, mean_growth
from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError
from exugear.steady.harmonics.lines import LineSet, TorusSampling, joined, largest
from exugear.steady.mean_system.carrier_stability import growth_over_carrier
from exugear.steady.mean_system.mean_system import Steps, mean_system
from exugear.steady.mean_system.mesh_places import BACK, DEFLECTION, POSITION
from exugear.steady.mean_system.mesh_waves import FEWEST, mesh_waves
from exugear.steady.mean_system.shaft_orders import PassingMotion, any_shaft_orders, shaft_orders, without_deviations
from exugear.steady.settings import Method
from exugear.steady.settling import SettlingRun, SettlingSegment, cannot_settle
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Complexes, Floats

MAX_NEGLECTED_NORM = 2e-4
"""Maximum norm of all neglected orders, relative to the vibration."""
ALIASED = 2e-4
"""The same of the residual on other samples, up to which those of the balance do where something parts."""
DROP_LINE_TOL = 2e-5
"""The same of lines that a state has, up to which the next speed begins without them."""
FORCELESS = 1e-6
"""Share of the variation of the meshes' forces in lines whose answers are not looked at where there are thousands."""
ROUGH = 1e-5
"""Residual of the balance over the size of the deflections up to which it is solved before lines are added."""
UNEQUAL = 5e-4
"""Share of the vibration in sidebands of passing planets from which the planets are modelled individually."""
SIDEBAND_TOL = 1e-4
"""Minimum share of the vibration in an order for sidebands to be sought; maximum share in neglected ones."""
SIDEBAND_RESIDUAL = 1e-4
"""Residual relative to the vibration up to which sidebands of passing planets count as converged."""
MOST_SIDEBANDS = 3
"""Maximum number of multiples of the planet passing frequency whose orders are included."""
SIDEBAND_WARNING = 0.05
"""Share of the overall transmission error in sidebands from which a note is given."""
MOST_REFINED = 5
"""Times that lines are added at most."""
MOST_DENSER = 2
"""Times that samples are doubled at most."""
LEGS = 4
"""Legs of a run in time, after each of which Newton's method is tried."""
SAME_STATE_TOL = 0.1
"""Difference of amplitudes from those of a run in time, over the vibration, up to which both are one state."""
GROWING = 0.02
"""Growth in a period of the slowest base above which a state does not last: below it a run shows little of it."""
PERTURBATION = 1.02
"""Factor on the motion of an unstable state from which a run begins."""


def harmonic_balance_model(
    assembly: Assembly,
    speeds: Floats,
    harmonics: int | None = None,
    combinations: int = 3,
    method: Method = "parametric",
    prepared: Steps | None = None,
) -> HarmonicBalanceModel:
    """Build the model of an assembly for input speeds (rad/s), orders as in `SteadySettings`; linear bearings.

    With contact loss, each state takes as many orders as it needs, starting with few. With the method `linear`,
    stated loads have no sidebands. Deviations and loads are taken where passing planets turn their bodies on average,
    1e-3 rad at the sun in the planetary stage of the GRC. `prepared` is called as by `mean_system`.
    """
    waves = mesh_waves(mean_system(without_deviations(assembly), speeds, prepared))
    usual = FEWEST if LAWS[assembly.mesh_model].loses_contact else waves.needed_harmonics()
    count = usual if harmonics is None else harmonics
    moved = None
    if waves.varying_carriers and any_shaft_orders(assembly):
        moved = _passing_motion(HarmonicBalanceModel(waves, count, combinations))
    orders = shaft_orders(assembly, waves, moved)
    if method == "linear":
        orders = orders.without_load_sidebands
    return HarmonicBalanceModel(waves, count, combinations, orders)


def _passing_motion(model: HarmonicBalanceModel) -> PassingMotion:
    """Return the motion that the passing planets of each carrier cause, at the middle speed."""
    speeds = model.system.speeds
    speed = float(speeds[1] or speeds[2])
    motion = parametric_response(model, model.at(speed)).motion
    bases = math.copysign(1.0, speed) * model.lines.bases

    def moved(own: Complexes, psi: float) -> Floats:
        found: Floats = model.lines.values(own, psi * bases[None])[0]
        return found

    found: dict[str, Callable[[float], Floats]] = {}
    for carrier in model.waves.varying_carriers:
        others = np.delete(model.lines.index, model.base_names.index(carrier), axis=1).any(axis=1, keepdims=True)
        own = np.where(others, 0.0, motion)
        own[0] *= not found
        found[carrier] = partial(moved, own)
    return found


@dataclass(frozen=True, eq=False)
class ContactLossState:
    """A steady state of a gearbox, contact loss included."""

    model: HarmonicBalanceModel
    """With the lines that it took."""
    readings: Complexes
    """(n, m, r) what the laws read."""
    response: Response
    growth: float
    """Fastest growth of a disturbance, 1/s."""
    remark: str = ""
    """What is to be said of it, empty if nothing."""
    averaged: ContactLossState | None = None
    """The state with planets averaged over a revolution of the carrier, where this one has sidebands of it."""

    def on(self, model: HarmonicBalanceModel, interface: Interface | None = None) -> ContactLossState:
        """Return the state in the lines of another model, which are some of its own."""
        if model is self.model:
            return self
        old = self.response
        at = model.places_in(self.model)
        interface = interface or model.at(old.interface.speed)
        loads = old.interface.loads
        if loads is not None and model.shaft_orders.sidebands:
            own = at[0].ravel()
            turned = replace(loads, loads=loads.loads[own], motion=loads.motion[own], reactions=loads.reactions[own])
            interface = replace(interface, loads=turned)
        response = replace(
            old,
            interface=interface,
            deflection=old.deflection[at],
            excess=old.excess[at],
            force=old.force[at],
            apart=old.apart[at[1]] if len(at) > 1 else old.apart,
            of_bearings=old.of_bearings[at[0].ravel()],
        )
        return replace(self, model=model, readings=self.readings[at], response=response)


class PointSolver:
    """Solves one speed after the other; with the method `nonlinear`, each starts from the one before.

    Parameters
    ----------
    model : with linear bearings; the method `nonlinear` replaces those with rolling elements by their models
    method : as in `exugear.steady.settings.SteadySettings`
    """

    def __init__(self, model: HarmonicBalanceModel, method: Method) -> None:
        self.linear = model
        self.method = method
        self.model = model.with_bearings if method == "nonlinear" else model
        self._last: Complexes | None = None
        self._at_mean_angles = True
        self.state: ContactLossState | None = None

    @property
    def sampling(self) -> TorusSampling:
        """Samples of the method `nonlinear`."""
        return self.model.sampling

    def forcing(self, interface: Interface) -> Complexes:
        """Find the forces of the meshes (lines, m, f) that vary in the static state, N, bearings being linear."""
        if not self.linear.loses_contact:
            forces = transmission_errors(self.linear, interface.ports, interface.speed)
            forces[..., DEFLECTION] += mean_deviation_forces(self.linear, interface.speed)
            return forces
        balance = HarmonicResidual(self.linear, interface, self.linear.sampling)
        return balance.forces(balance.static)[0]

    def growth(self, low: float, high: float) -> float:
        """Fastest growth of a disturbance between two speeds of the input (rad/s), 1/s."""
        model = self.linear.without_shaft_orders
        if model.varying:
            system = model.system
            return max(growth_over_carrier(system, float(speed)) for speed in system.speeds if speed != 0.0)
        found = [mean_growth(model)]
        unknown = model.loses_contact or model.waves.carriers or not model.waves.waves
        for candidate in () if unknown else candidates(model, low, high)[:CHECKED]:
            balance = HarmonicResidual(model, model.at(candidate.speed), model.sampling)
            found.append(growth_at(balance, balance.static, candidate.base))
        return max(found)

    def response(self, speed: float) -> Response:
        """Response at a speed of the input, rad/s.

        Raises
        ------
        HarmonicBalanceError
            No steady state was found.
        """
        interface = self.model.at(speed)
        if self.method == "linear":
            return linear_response(self.model, interface)
        if self.method == "parametric":
            return parametric_response(self.model, interface)
        if self.model.is_nonlinear:
            self.state = _with_passing(self._with_contact_loss(speed))
            return self.state.on(self.model, interface).response
        return self._settle_in_time(interface)

    @property
    def continuation_model(self) -> HarmonicBalanceModel:
        """HarmonicBalanceModel with the orders of a continuation: twice the harmonics with contact loss."""
        return self.model.finer if self.model.is_nonlinear else self.model

    def readings(self, speed: float) -> Complexes:
        """Return the inputs of the mesh models (n, m, r) at an input speed (rad/s), in the orders of a continuation."""
        if self.model.is_nonlinear:
            state = self._with_contact_loss(speed)
            return readings_in(state.model, state.readings, self.continuation_model)
        self._settle_in_time(self.model.at(speed))
        assert self._last is not None
        return self._last

    def response_to(self, readings: Complexes, speed: float) -> Response:
        """Response at an input speed (rad/s) for known inputs of the mesh models (n, m, r), on a continuation."""
        model = self.continuation_model
        interface = self.model.at(speed)
        own = model.at(speed) if model is not self.model else interface
        response = response_of_readings(turned_balance(model, own, readings), readings)
        if model is self.model:
            return response
        return ContactLossState(model, readings, response, np.nan).on(self.model, interface).response

    def _settle_in_time(self, interface: Interface) -> Response:
        try:
            found, self._last = nonlinear_response(
                self.model, interface, self.sampling, self._last, self._at_mean_angles
            )
        except HarmonicBalanceError:
            if self._last is None:
                raise
            found, self._last = nonlinear_response(self.model, interface, self.sampling, None, self._at_mean_angles)
        self._at_mean_angles = found.at_mean_angles
        return found

    def _with_contact_loss(self, speed: float) -> ContactLossState:
        """Find the state at a speed: that near the last one if it is stable, else where a run in time settles."""
        last = self._last_averaged
        found = None
        reason = ""
        try:
            model, readings = _thinned(last, self.model) if last else (self.model, None)
            found = _refined(model, speed, readings, last is None or last.response.at_mean_angles)
        except HarmonicBalanceError as error:
            reason = str(error)
            found = self._from_rest(speed)
        if found is None or self._grows(found):
            found = self._settled(speed, found, reason)
        self.state = found
        return found

    def _from_rest(self, speed: float) -> ContactLossState | None:
        """Find the state near the static one if the last one does not help although nothing lost contact in it.

        Bearing forces are so nonlinear that a state at a distant speed is a bad start. With contact loss, a time
        simulation has to show which state the gearbox reaches.
        """
        last = self.state
        if self.model.bearings is None or last is None or _parted(last.response):
            return None
        with suppress(HarmonicBalanceError):
            return _refined(self.model, speed, None)
        return None

    @property
    def _last_averaged(self) -> ContactLossState | None:
        """The last state with planets at their mean."""
        if self.state:
            return self.state.averaged or self.state
        return None

    def _settled(self, speed: float, unstable: ContactLossState | None, reason: str) -> ContactLossState:
        """Find the state to which a run in time settles that begins at the last one, or at an unstable one."""
        begin = unstable or self._last_averaged
        model = begin.model if begin else self.model
        interface = model.at(speed)
        verdict = cannot_settle(model.system)
        if not verdict:
            motion = np.zeros((len(model.lines.orders), model.system.size), dtype=complex)
            if begin is not None:
                motion = PERTURBATION * begin.response.motion
            rows = interface.ports.readings[:, DEFLECTION]
            bases = model.waves.base_orders
            run = SettlingRun(model.system, model.lines, rows, bases, speed, motion, model.assembly_in_time)
            for _ in range(LEGS):
                leg = run.leg()
                if leg is None:
                    verdict = "the motion in time is not finite"
                    break
                verdict = leg.verdict
                found = _state_near(model, interface, leg)
                if found is not None and not self._grows(found):
                    return found
                unstable = found or unstable
        if unstable is None:
            raise HarmonicBalanceError(f"{reason}; {verdict}")
        grows = f"unstable: a disturbance grows at {unstable.growth:.3g} 1/s"
        return replace(unstable, remark=f"{grows}; {verdict}")

    def _grows(self, state: ContactLossState) -> bool:
        """Return whether a disturbance of a state grows within a time simulation."""
        slowest = abs(state.response.interface.speed) * float(self.model.waves.base_orders.min())
        return state.growth * 2.0 * np.pi / slowest > GROWING


def _with_passing(state: ContactLossState) -> ContactLossState:
    """Model planets individually: return a state with the sidebands of their passing, where these are relevant."""
    found = state
    speed = state.response.interface.speed
    still = state.response.at_mean_angles
    size = float(np.linalg.norm(state.readings[1:, :, DEFLECTION]))
    for _ in range(MOST_SIDEBANDS):
        model = found.model.passing(np.linalg.norm(found.readings[..., DEFLECTION], axis=1) > SIDEBAND_TOL * size)
        if model is None:
            break
        balance = HarmonicResidual(model, model.at(speed), model.sampling, still)
        start = readings_in(found.model, found.readings, model)
        known = found.model.places_in(model)[0].ravel()
        new = np.linalg.norm(balance.missing(start)[..., DEFLECTION], axis=1)
        new[known] = 0.0
        wanted = largest(new, SIDEBAND_TOL * size)
        if not wanted.any() or (found is state and float(np.linalg.norm(new)) < UNEQUAL * size):
            break
        wanted[known] = True
        model = model.of(wanted)
        balance = HarmonicResidual(model, model.at(speed), model.sampling, still)
        start = readings_in(found.model, found.readings, model)
        enough = SIDEBAND_RESIDUAL * size / float(np.linalg.norm(balance.static[..., DEFLECTION]))
        try:
            readings, products = solve_balance(balance, start, enough)
        except HarmonicBalanceError:
            return _with_warnings(state, "passing planets add orders, but no solution including them was found")
        response = response_of_readings(balance, readings, found.response.products + products)
        found = replace(state, model=model, readings=readings, response=response, averaged=state)
    if found is state:
        return state
    overall = np.abs(signals(found.model, found.response)[1:, 0])
    bases = len(found.model.waves.base_orders)
    share = float(np.linalg.norm(overall[found.model.lines.index[1:, bases:].any(axis=1)]) / np.linalg.norm(overall))
    if share < SIDEBAND_WARNING:
        return found
    return _with_warnings(
        found, f"passing planets add {100.0 * share:.2g} % of the overall transmission error at other orders"
    )


def _with_warnings(state: ContactLossState, remark: str) -> ContactLossState:
    return replace(state, remark="; ".join(filter(None, (state.remark, remark))))


def _state_near(model: HarmonicBalanceModel, interface: Interface, leg: SettlingSegment) -> ContactLossState | None:
    """Find the state near what a run in time settled to."""
    ports = interface.ports
    moved = leg.motion.copy()
    moved[0] -= model.system.static_at(interface.speed)
    readings = interface.read(moved)
    readings[0] += ports.static
    try:
        found = _refined(model, interface.speed, readings)
    except HarmonicBalanceError:
        return None
    state = found.on(model)
    # Phases hang on the last of the damping, to which the drive of the run adds.
    difference = np.linalg.norm((np.abs(state.readings) - np.abs(readings))[1:, :, DEFLECTION])
    if difference < SAME_STATE_TOL * np.linalg.norm(readings[1:, :, DEFLECTION]):
        return found
    return None


def _refined(
    model: HarmonicBalanceModel, speed: float, start: Complexes | None, at_mean_angles: bool = False
) -> ContactLossState:
    """Solve at a speed, from given readings or the static state, with those lines more that it lacks.

    `at_mean_angles` says which angles `solve_turning` tries first.
    """
    balance = HarmonicResidual(model, model.at(speed), model.sampling, at_mean_angles)
    readings = balance.static if start is None else start
    products = 0
    for _ in range(MOST_REFINED):
        balance, readings, took = solve_turning(balance, readings, ROUGH)
        products += took
        lacking = _lacking(balance, readings)
        if lacking is None:
            break
        # Kinks where something parts reach farther than any smooth law does.
        kinks = _parted(response_of_readings(balance, readings))
        before = balance.model
        lines = before.with_lines(joined(before.lines, lacking), kinks)
        balance = replace(balance, model=lines, interface=lines.at(speed), sampling=lines.sampling)
        readings = readings_in(before, readings, lines)
    balance, readings, took = solve_turning(balance, readings)
    products += took
    response = response_of_readings(balance, readings, products)
    if _parted(response):
        balance, readings, took = _without_aliases(balance, readings)
        response = response_of_readings(balance, readings, products + took)
    growth = growth_of_state(balance, readings, _parted(response))
    return ContactLossState(balance.model, readings, response, growth)


def _parted(response: Response) -> bool:
    """Return whether teeth or rolling elements lose contact."""
    return bool(response.apart.any() or response.free.any())


def _without_aliases(balance: HarmonicResidual, readings: Complexes) -> tuple[HarmonicResidual, Complexes, int]:
    """Solve on more samples until the balance holds on twice as many; with the products that it took."""
    size = float(np.linalg.norm(readings[1:, :, DEFLECTION]))
    products = 0
    for _ in range(MOST_DENSER):
        denser = balance.model.denser
        ahead = replace(balance, model=denser, sampling=denser.sampling)
        if float(np.linalg.norm(ahead.missing(readings)[..., DEFLECTION])) < ALIASED * size:
            break
        balance, readings, took = solve_turning(ahead, readings)
        products += took
    return balance, readings, products


def _lacking(balance: HarmonicResidual, readings: Complexes) -> LineSet | None:
    """Lines of the larger set that a state lacks, None where those that it has do.

    Their forces are those on the samples that the state has; what each line answers by itself is taken for its size.
    """
    whole = _acted_on(balance, readings)
    size = float(np.linalg.norm(readings[1:, :, DEFLECTION]))
    ahead = replace(balance, model=whole, interface=whole.at(balance.interface.speed), sampling=whole.sampling)
    start = readings_in(balance.model, readings, whole)
    if whole.shaft_orders.has_loads and not balance.at_mean_angles:
        ahead = ahead.with_turned_loads(start)
    excess, tangent, _ = ahead.forces(start)
    missing = tangent.alone(ahead.answer(excess) + ahead.static - start)
    new = _sizes(whole, missing, balance.at_mean_angles)
    new[balance.model.places_in(whole)[0]] = 0.0
    wanted = largest(new, MAX_NEGLECTED_NORM * size)
    if wanted.any():
        return whole.lines.part(wanted)
    return None


def _acted_on(balance: HarmonicResidual, readings: Complexes) -> HarmonicBalanceModel:
    """Return the model with all lines of its larger set; where stiffness varies, those on which meshes act noticeably.

    There are thousands of lines then, whose answers would take most of the time.
    """
    whole = balance.model.whole
    if not whole.waves.neighbours:
        return whole
    samples = TorusSampling(whole.lines, balance.sampling.generator, balance.sampling.samples)
    forces = samples.coefficients(balance.places.back @ balance.forces(readings)[2])[..., : BACK + 1]
    sizes = np.linalg.norm(forces, axis=(1, 2))
    own = np.isin(np.arange(len(sizes)), balance.model.places_in(whole)[0])
    vibration = float(np.linalg.norm(sizes[1:][own[1:]]))
    return whole.of(own | largest(np.where(own, 0.0, sizes), FORCELESS * vibration))


def _sizes(model: HarmonicBalanceModel, readings: Complexes, at_mean_angles: bool) -> Floats:
    """Sizes (n,) of lines in readings (n, m, r), m: deflections, with stated loads also rotations along the pitch."""
    read = [DEFLECTION, POSITION] if model.shaft_orders.sidebands and not at_mean_angles else [DEFLECTION]
    return np.asarray(np.linalg.norm((model.lengths * readings)[..., read], axis=(1, 2)))


def _thinned(state: ContactLossState, usual: HarmonicBalanceModel) -> tuple[HarmonicBalanceModel, Complexes]:
    """Orders of a state, without negligible ones beyond the usual orders, and its readings in them."""
    sizes = _sizes(state.model, state.readings, state.response.at_mean_angles)
    needed = np.isin(np.arange(len(sizes)), usual.places_in(state.model)[0])
    sizes[needed] = 0.0
    kept = needed | largest(sizes, DROP_LINE_TOL * float(np.linalg.norm(state.readings[1:, :, DEFLECTION])))
    model = state.model
    if kept.all():
        return model, state.readings
    thinner = model.with_lines(model.lines.part(kept), _parted(state.response))
    return thinner, readings_in(model, state.readings, thinner)


def readings_in(model: HarmonicBalanceModel, readings: Complexes, other: HarmonicBalanceModel) -> Complexes:
    """Enter readings (n, m, r) in the lines of another model; what only one of both has is left out."""
    found = np.zeros((len(other.lines.orders), *other.lengths.shape), dtype=complex)
    places = model.places_in(other)
    there = places[0].ravel() >= 0
    found[(places[0][there], *places[1:])] = readings[there]
    return found
