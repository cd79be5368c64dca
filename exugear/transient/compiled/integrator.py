"""The integrator: time integration methods, and a step that is stable and accurate for the vibrations.

Two kinds. The classical Runge-Kutta method of order 4 evaluates the accelerations four times a step. The multistep
method of order k evaluates them once: velocities are predicted by Adams and Bashforth, positions by the same polynomial
through the last k accelerations integrated twice (Stoermer, Cowell); the acceleration at the predicted state then
corrects both by its difference from the extrapolated one (predict, evaluate, correct; Hairer, Norsett and Wanner,
Solving Ordinary Differential Equations I, section III.1 and III.10).

The steps themselves, which advance coordinates and velocities, are in `exugear.transient.compiled.solver`.

Numbers here become part of machine code: `fe_ste.tools.compilation` recompiles when this file changes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg

from exugear.system.kernels.products import filled_up
from exugear.system.modes import coordinate_labels
from exugear.system.statics import Linearised, linearise
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats, Integers
from fe_ste.tools.display import ReprMixin

# Methods of time integration: their coefficients, and what they make of free and forced motions

PREDICT_VELOCITY, PREDICT_POSITION, EXTRAPOLATE = range(3)
"""Rows of `Method.weights`."""
CORRECT_VELOCITY, CORRECT_POSITION = range(2)
"""Entries of `Method.correction`."""
ORDERS = (4, 5, 6)
"""Orders of the multistep method to choose from: 3 has negative damping, 7 and more are rarely stable."""
_FREE_SHARES = np.array(
    [
        [0.78877, -0.32168, -0.37097, 0.34632],
        [0.47422, -0.34746, -0.18622, 0.27258],
        [0.60972, 0.53494, -0.85167, -0.35051],
    ]
)
"""Of fourth differences, the latest first, in each sum of `stabilised`."""
_FREE_CORRECTION = np.array([-0.09530, 0.06886])
"""Correction of `stabilised`."""
_EXACT = 1e-9
"""Sums that miss by less are exact but for round-off."""
LIGHTEST_DAMPING = 2e-3
"""Damping ratio that lighter ones count as: an undamped resonance would ask for no error at all."""
FOLLOWED_CLOSELY = 1e-2
"""Motions that turn by less than this in a step (rad) are followed to 1e-9 by all methods: round-off is larger."""
LATEST, KNOWN = range(2)
"""Entries of `StepHistory.counts`."""


class StepHistory(NamedTuple):
    """Accelerations that a run has passed, as the compiled loop keeps them."""

    accelerations: Floats
    """(rows, s) the latest ones, one row after the other, round and round; s is the size, filled up with zeros to a
    multiple of eight, as the loop takes them."""
    sums: Floats
    """(2, s) memory of a step."""
    counts: Integers
    """(2,) row of the latest, and how many are known."""

    @classmethod
    def of(cls, method: Method, accelerations: Floats) -> StepHistory:
        """Memory for a method; accelerations (n, size) that are known at the steps before, the latest last."""
        rows = max(1, method.points)
        known = accelerations[-rows:]
        kept = np.zeros((rows, filled_up(accelerations.shape[1])))
        kept[: len(known), : accelerations.shape[1]] = known
        return cls(kept, np.zeros((2, kept.shape[1])), np.array([max(0, len(known) - 1), len(known)]))

    def chronological(self) -> Floats:
        """Accelerations (n, s) that are known, the latest last."""
        latest, known = self.counts
        rows = len(self.accelerations)
        return np.asarray(self.accelerations[(latest - np.arange(min(known, rows))[::-1]) % rows])


class Method(NamedTuple):
    """A method of time integration, as the compiled loop reads it."""

    weights: Floats
    """(3, k) of the last k accelerations, the latest first: sums that predict the velocity (times the step), the
    position (times its square) and the next acceleration; k = 0 for the Runge-Kutta method."""
    correction: Floats
    """(2,) of the difference between the acceleration and the extrapolated one, for velocity and position."""

    @property
    def points(self) -> int:
        """Accelerations of the past that a step takes."""
        return int(self.weights.shape[1])

    @property
    def order(self) -> int:
        """Order of the error of a step, less one: the powers of time that the sums are exact for."""
        if not self.points:
            return 4
        misses = np.abs(self.weights @ _powers_at_nodes(self.points).T - _integrals(np.arange(self.points))).max(axis=0)
        return int(np.argmax(misses > _EXACT)) or self.points

    @property
    def is_multistep(self) -> bool:
        """Whether it uses several past accelerations."""
        return self.points > 0

    @property
    def evaluations(self) -> int:
        """Evaluations of the accelerations in a step."""
        if self.is_multistep:
            return 1
        return 4

    @property
    def name(self) -> str:
        """Name in files and messages."""
        if not self.is_multistep:
            return "RK4"
        kept = "" if self.order == self.points else ", stabilised"
        return f"Adams of order {self.order}{kept}"


RUNGE_KUTTA = Method(np.zeros((3, 0)), np.zeros(2))
"""The classical Runge-Kutta method of order 4."""


def adams(order: int) -> Method:
    """Multistep method of an order, from 1 on.

    Examples
    --------
    Order 2 predicts velocities by 3/2 and -1/2 of the last accelerations, as Adams and Bashforth:

    >>> adams(2).weights[PREDICT_VELOCITY].round(12).tolist()
    [1.5, -0.5]
    """
    powers = np.arange(order)
    # One more node at 1 adds a term that vanishes at all the others.
    term = np.poly1d(-powers, r=True) / math.factorial(order)
    once = np.polyint(term)(1.0)
    twice = np.polyint(np.polymul(term, [-1.0, 1.0]))(1.0)
    # The sums are exact for each power of time up to the order, less one.
    weights = np.linalg.solve(_powers_at_nodes(order), _integrals(powers).T).T
    return Method(np.ascontiguousarray(weights), np.array([once, twice]))


def stabilised() -> Method:
    """Return the multistep method of order 4 from eight accelerations, stable and exact at longer steps than Adams'.

    Four accelerations more than order 4 needs leave multiples of four fourth differences free in each sum; with both
    corrections that makes fourteen numbers. They minimise the error of free motions with damping ratios of 0 to 4 % up
    to w h = 0.50, among all that are stable up to w h = 0.86 with damping ratios of 2 to 3.5 %, as flexible bodies have
    at their highest frequencies (Adams' method of order 4: 0.72). The relative error of the free motion's eigenvalue is
    up to 1.3e-5 in this range; for Adams' method of order 4 at the same step it is 8e-4.

    Examples
    --------
    >>> stabilised().name, stabilised().order, stabilised().points
    ('Adams of order 4, stabilised', 4, 8)
    """
    four = adams(4)
    free = _FREE_SHARES.shape[1]
    differences = np.stack([np.pad([1.0, -4.0, 6.0, -4.0, 1.0], (n, free - 1 - n)) for n in range(free)])
    return Method(np.pad(four.weights, ((0, 0), (0, free))) + _FREE_SHARES @ differences, _FREE_CORRECTION)


def _powers_at_nodes(points: int) -> Floats:
    """Powers 0, 1, ... of time, by row, at the accelerations at 0, -1, -2 ..."""
    powers = np.arange(points)
    return np.asarray((-powers[None, :].astype(np.float64)) ** powers[:, None])


def _integrals(powers: Integers) -> Floats:
    """Integrate powers of time as the three sums are to, (3, powers)."""
    return np.stack([1.0 / (powers + 1.0), 1.0 / ((powers + 1.0) * (powers + 2.0)), np.ones(powers.size)])


def growth(method: Method, eigenvalues: Complexes, step: float) -> Complexes:
    """Factors by which a step multiplies the free motions of single oscillators.

    Parameters
    ----------
    eigenvalues : (n,)
        Of the motions, 1/s. A real one counts as critically damped, which is more than what a real motion takes.
    step : s

    Returns
    -------
    (n, m) roots; the first belongs to the motion itself, the others are parasitic
    """
    scaled = eigenvalues * step
    if not method.is_multistep:
        return np.asarray((1.0 + scaled * (1.0 + scaled / 2.0 * (1.0 + scaled / 3.0 * (1.0 + scaled / 4.0))))[:, None])
    roots = np.linalg.eigvals(_recurrences(method, np.abs(scaled), -scaled.real))
    exact = np.exp(scaled.real + 1j * np.abs(scaled.imag))
    own = np.argmin(np.abs(roots - exact[:, None]), axis=1)[:, None]
    first = np.take_along_axis(roots, own, axis=1)
    np.put_along_axis(roots, own, roots[:, :1], axis=1)
    roots[:, :1] = first
    return np.asarray(roots)


def _recurrences(method: Method, angle: Floats, decay: Floats) -> Floats:
    """Matrices (n, k + 2, k + 2) that a step applies to h v, q and h^2 times the last k accelerations.

    The acceleration is -w^2 q - 2 d v; ``angle`` is w h, ``decay`` d h.
    """
    count = method.points
    velocity = np.zeros(count + 2)
    position = np.zeros(count + 2)
    velocity[0], velocity[2:] = 1.0, method.weights[PREDICT_VELOCITY]
    position[:2], position[2:] = 1.0, method.weights[PREDICT_POSITION]
    acceleration = -(angle[:, None] ** 2) * position - 2.0 * decay[:, None] * velocity
    difference = acceleration.copy()
    difference[:, 2:] -= method.weights[EXTRAPOLATE]
    matrices = np.zeros((len(angle), count + 2, count + 2))
    matrices[:, 0] = velocity + method.correction[CORRECT_VELOCITY] * difference
    matrices[:, 1] = position + method.correction[CORRECT_POSITION] * difference
    matrices[:, 2] = acceleration
    matrices[:, np.arange(3, count + 2), np.arange(2, count + 1)] = 1.0
    return matrices


def forced_error(method: Method, angle: float) -> float:
    """Relative error of the amplitude of a free mass under a force that turns by an angle (rad) in each step.

    Far above their eigenfrequency, where a force makes vibrations of the highest frequency, bodies answer as masses.

    Examples
    --------
    At 6.4 kHz, steps of 1/60000 s:

    >>> angle = 2 * np.pi * 6400 / 60000
    >>> f"{forced_error(RUNGE_KUTTA, angle):.1e} {forced_error(adams(5), angle):.1e}"
    '-2.1e-04 -4.3e-04'
    """
    turn = np.exp(1j * angle)
    if not method.is_multistep:
        # Its sums over the force at the beginning, the middle and the end of a step.
        velocity = (1.0 + 4.0 * np.sqrt(turn) + turn) / 6.0 / (turn - 1.0)
        position = (velocity + (1.0 + 2.0 * np.sqrt(turn)) / 6.0) / (turn - 1.0)
    else:
        past = turn ** -np.arange(method.points)
        predicted_velocity, predicted_position, extrapolated = method.weights @ past
        difference = turn - extrapolated
        velocity = (predicted_velocity + method.correction[CORRECT_VELOCITY] * difference) / (turn - 1.0)
        position = velocity + predicted_position + method.correction[CORRECT_POSITION] * difference
        position /= turn - 1.0
    return float(abs(position) * angle**2 - 1.0)


def ahead_of_correction(method: Method, angle: Floats, lag: float = 0.0) -> Complexes:
    """Error of what is read off the predicted state, relative, of motions that turn by an angle (rad) in each step.

    The correction moves a position by ``h^2 c`` and a velocity by ``h c'`` times the difference of the acceleration
    from the extrapolated one. In a motion of one frequency that difference is the acceleration itself times a number
    that follows from the weights, and the acceleration is -w^2 times the position: so the error is known, in amplitude
    and phase, and what has been read off the predicted states can be put right afterwards.

    Parameters
    ----------
    angle : (n,) rad, up to pi
    lag
        What is read off is ahead by so many steps: position + lag * step * velocity, as the force of a spring with
        damping in proportion to its stiffness. A deflection has none.

    Examples
    --------
    Deflections at 6.43 kHz, steps of 1/60000 s:

    >>> f"{abs(1.0 + ahead_of_correction(adams(5), np.array([2 * np.pi * 6430 / 60000]))[0]) - 1.0:.4f}"
    '0.0049'
    """
    if not method.is_multistep:
        return np.zeros(np.shape(angle), dtype=np.complex128)
    past = np.exp(-1j * np.multiply.outer(angle, np.arange(1.0, method.points + 1.0)))
    difference = 1.0 - past @ method.weights[EXTRAPOLATE]
    corrected = method.correction[CORRECT_POSITION] + lag * method.correction[CORRECT_VELOCITY]
    return np.asarray(corrected * angle**2 * difference / (1.0 + 1j * lag * angle))


def resonance_error(method: Method, eigenvalues: Complexes, step: float, band: float) -> float:
    """Largest error of a resonance's answer to excitation up to a band, in amplitude and phase, as a share of its peak.

    The answer to a frequency w goes with 1 / (i w - s), s the eigenvalue, so that an error e of the eigenvalue changes
    it by e / (i w - s): by e over the rate of decay at the peak. That of a resonance above the band is largest at its
    end, and less than this, which takes the error of the free motion for that of the forced one.

    Parameters
    ----------
    eigenvalues : (n,) of motions that oscillate, 1/s
    step, band : s and Hz

    Examples
    --------
    A resonance at 6 kHz with a damping ratio of 2 %, steps of 12.5 us:

    >>> resonance = 2 * np.pi * 6000 * np.array([-0.02 + 1j])
    >>> [f"{resonance_error(method, resonance, 12.5e-6, 6.4e3):.0e}" for method in (stabilised(), adams(4))]
    ['5e-04', '3e-02']
    """
    resonances = eigenvalues[np.abs(eigenvalues) * step > FOLLOWED_CLOSELY]
    if not resonances.size:
        return 0.0
    exact = resonances.real + 1j * np.abs(resonances.imag)
    made = growth(method, resonances, step)[:, 0]
    error = np.abs(np.log(np.where(made.imag < 0.0, made.conj(), made)) / step - exact)
    width = np.maximum(-resonances.real, LIGHTEST_DAMPING * np.abs(resonances))
    beyond = np.maximum(exact.imag - 2.0 * np.pi * band, 0.0)
    return float((error * width / (width**2 + beyond**2)).max())


# Time step and method of the compiled solver: stable, and accurate for what resonates

MARGIN = 1.2
"""By this factor all motions may be faster before the step is not stable: stiffness by 1.44, room for teeth that carry
more than their static load."""
GROWTH_ALLOWED = 1e-9
"""Growth in a step that counts as none: undamped motions gain 0.2 % in 30 s."""
FORCED_ERROR = 7e-4
"""Allowed error of amplitudes at the top of the band, for a free mass; with stiffness around it may be 1.4 times."""
RESONANCE_ERROR = 1e-3
"""Allowed error of a resonance's answer to excitation within the band, as a share of its peak."""
STIFFENING = 1.6
"""Stiffness of a non-linear bearing over that at its static load: at twice the load rollers have up to 1.25 times the
radial and 1.6 times the tilt stiffness, as more of them and more of their length carry."""
MOST_MARGIN = 3.0
"""Margin up to which it is looked for."""
INTEGRATORS = ("adams", "rk4")
"""Kinds of methods that can be asked for."""
SLOWEST = 1e-3
"""Motions that turn by less than this in a step (rad) are the rolling of the train, also on planets whose pins are off:
methods of fourth order err by its fifth power, and the growth that is computed for them by round-off, far more."""
MOST_DIVISIONS = 100_000
"""Parts of a sampling interval that a step may be at least; finer ones are refused elsewhere, with the reason."""


@dataclass(frozen=True, eq=False)
class Integration(ReprMixin):
    """How a run is integrated."""

    method: Method
    step: float
    """s."""
    margin: float
    """Factor by which all motions may be faster before it is not stable, in tenths, at most `MOST_MARGIN`."""
    forced_error: float
    resonance_error: float
    """Expected errors, relative: of the amplitude of a free mass at the top of the band, and of the answer of the
    resonance where it is largest, for excitation within the band."""
    fastest_rate: float
    """Magnitude of the fastest eigenvalue, rad/s."""

    @property
    def error(self) -> float:
        """The larger of both errors, each over what is allowed of it."""
        return max(abs(self.forced_error) / FORCED_ERROR, self.resonance_error / RESONANCE_ERROR)

    @property
    def is_accurate(self) -> bool:
        """Whether both errors are as small as a run that chooses its step asks for."""
        return abs(self.forced_error) <= FORCED_ERROR and self.resonance_error <= RESONANCE_ERROR

    def _line(self) -> str:
        return f": {self.method.name}, step {1e6 * self.step:.4g} us, margin {self.margin:.2g}"


def eigenvalues(assembly: Assembly) -> Complexes:
    """Eigenvalues (1/s) of the system linearised at rest, mesh stiffness at its peaks, damping included."""
    linear = _linearised_equations(assembly)
    return scipy.linalg.eigvals(_free_motions(linear, assembly.motions)[1]).astype(np.complex128)


def _linearised_equations(assembly: Assembly) -> Linearised:
    """Linearised equations with all teeth in contact, meshes and non-linear bearings as stiff as they become."""
    stiffest = assembly.unloaded.with_linear_supports(STIFFENING)
    meshes = stiffest.linear_meshes()
    peaks = np.array([np.max(np.abs(e.tangent)) / np.abs(np.mean(e.stiffness)) for e in stiffest.elements])
    meshes = meshes._replace(stiffness=meshes.stiffness * peaks.reshape(-1, 1, 1))
    return linearise(stiffest, np.zeros(assembly.size), meshes)


def _free_motions(linear: Linearised, free: Floats) -> tuple[Floats, Floats]:
    """Free motions of unit mass (size, n), and the matrix (2n, 2n) of the first-order equations of their amounts."""
    root = np.linalg.cholesky(linear.mass)
    basis = np.linalg.solve(root.T, scipy.linalg.orth(root.T @ free))
    size = free.shape[1]
    lower = np.hstack([-basis.T @ linear.total_stiffness @ basis, -basis.T @ linear.total_damping @ basis])
    return basis, np.vstack([np.eye(size, 2 * size, size), lower])


def highest_rate(assembly: Assembly) -> float:
    """Largest ``|eigenvalue|``, rad/s: it decides whether a step is stable."""
    return float(np.abs(eigenvalues(assembly)).max())


def fastest_motion(assembly: Assembly) -> str:
    """Describe as text the motion of the largest ``|eigenvalue|``: the moving body, and the element that acts on it.

    Examples
    --------
    >>> from exugear.system.build import assemble
    >>> from exugear.gearbox.choice import Choice
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> fastest_motion(assemble(gearbox, Choice("rigid"), stiffness))
    'the fastest motion, 9.25e+03 rad/s, is that of hss.spin against high_speed'
    """
    linear = _linearised_equations(assembly)
    basis, matrix = _free_motions(linear, assembly.motions)
    values, vectors = scipy.linalg.eig(matrix)
    fastest = int(np.argmax(np.abs(values)))
    rate = float(np.abs(values[fastest]))
    shape = basis @ vectors[: basis.shape[1], fastest]
    moving = int(np.argmax(np.abs(shape) ** 2 * np.diag(linear.mass)))
    strained = {
        name: abs(shape.conj() @ (k + values[fastest] * linear.damping[name]) @ shape)
        for name, k in linear.stiffness.items()
    }
    holding = max(strained, key=lambda name: strained[name]) if strained else "nothing"
    return f"the fastest motion, {rate:.3g} rad/s, is that of {coordinate_labels(assembly)[moving]} against {holding}"


def _stable(method: Method, values: Complexes, step: float, factor: float) -> bool:
    """Return whether no free motion grows, all being faster by a factor."""
    moving = factor * values[np.abs(values) * step > SLOWEST]
    if not moving.size:
        return True
    # The motion itself may grow: a train that rolls has eigenvalues of either sign about zero.
    own = np.maximum(1.0, np.exp(moving.real * step))
    return bool((np.abs(growth(method, moving, step)).max(axis=1) <= own * (1.0 + GROWTH_ALLOWED)).all())


def _margin(method: Method, values: Complexes, step: float) -> float:
    """Largest factor on all eigenvalues with which the step is stable, in tenths; 0 if it is not stable."""
    margin = 0.0
    for tenths in range(10, round(10.0 * MOST_MARGIN) + 1):
        if not _stable(method, values, step, tenths / 10.0):
            break
        margin = tenths / 10.0
    return margin


class _Motions:
    """Free motions of an assembly, and what a method makes of them."""

    def __init__(self, assembly: Assembly, band: float) -> None:
        self.band = band
        self.values = eigenvalues(assembly)
        self.fastest = float(np.abs(self.values).max(initial=0.0))
        # Of a pair of conjugates one is enough; what does not oscillate has no resonance.
        self.resonances = self.values[self.values.imag > 0.0]
        self.values = self.values[self.values.imag >= 0.0]

    def with_step(self, method: Method, step: float) -> Integration:
        """Return the properties of a method with a step (s)."""
        return Integration(
            method,
            step,
            _margin(method, self.values, step),
            forced_error(method, 2.0 * math.pi * self.band * step),
            resonance_error(method, self.resonances, step, self.band),
            self.fastest,
        )

    def longest_step(self, method: Method, interval: float) -> float:
        """Longest step (s) that divides a sampling interval (s), is stable with the margin, and accurate."""
        divisions = 1
        while divisions < MOST_DIVISIONS and not self._will_do(method, interval / divisions):
            # One more part as long as they are few; many at once where a fast motion asks for thousands.
            divisions += max(1, divisions // 20)
        return interval / divisions

    def _will_do(self, method: Method, step: float) -> bool:
        # The cheapest test first: most steps fail in it.
        return (
            abs(forced_error(method, 2.0 * math.pi * self.band * step)) <= FORCED_ERROR
            and _stable(method, self.values, step, MARGIN)
            and resonance_error(method, self.resonances, step, self.band) <= RESONANCE_ERROR
        )


def methods_of(integrator: str | None) -> tuple[Method, ...]:
    """Return the methods to choose from: those of an integrator of `INTEGRATORS`, or all.

    Examples
    --------
    >>> [method.name for method in methods_of("adams")]
    ['Adams of order 4, stabilised', 'Adams of order 4', 'Adams of order 5', 'Adams of order 6']
    """
    multistep = stabilised(), *map(adams, ORDERS)
    return {"adams": multistep, "rk4": (RUNGE_KUTTA,), None: (*multistep, RUNGE_KUTTA)}[integrator]


def choose_integration(
    assembly: Assembly,
    sample_rate: float,
    band: float,
    *,
    step: float | None = None,
    integrator: str | None = None,
) -> Integration:
    """Choose the method and the step with the fewest evaluations.

    The step divides the sampling interval, is stable by `MARGIN` for all eigenvalues of the system at rest, meshes at
    their stiffest, keeps amplitudes up to `band` within `FORCED_ERROR` and resonances excited up to there within
    `RESONANCE_ERROR`, including those of flexible bodies: teeth excite them wherever mesh frequencies cross. Heavy
    damping shortens the steps of multistep methods: then the Runge-Kutta method is used.

    Parameters
    ----------
    sample_rate, band : Hz
    step : use this step, s, whatever its accuracy; the method is then the stable one of minimum error
    integrator : {"adams", "rk4"}, optional
        Kind of method; the cheaper one by default.

    Returns
    -------
    its margin is below 1 if the specified step is not stable

    Examples
    --------
    >>> from exugear.system.build import assemble
    >>> from exugear.gearbox.choice import Choice
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> choose_integration(assemble(gearbox, Choice("rigid"), stiffness), sample_rate=20e3, band=6.4e3)
    <Integration: Adams of order 5, step 16.67 us, margin 3>
    """
    motions = _Motions(assembly, band)
    methods = methods_of(integrator)
    if step is not None:
        return _best(motions.with_step(method, step) for method in methods)
    steps = [motions.longest_step(method, 1.0 / sample_rate) for method in methods]
    costs = [method.evaluations / longest for method, longest in zip(methods, steps, strict=True)]
    cheapest = [n for n, cost in enumerate(costs) if cost <= min(costs) * (1.0 + 1e-9)]
    return _best(motions.with_step(methods[n], steps[n]) for n in cheapest)


def _best(choices: Iterable[Integration]) -> Integration:
    """Return the cheapest that is stable with the margin and accurate; else the stable one of minimum error."""
    ranked = sorted(choices, key=lambda choice: (choice.margin < 1.0, choice.error))
    good = [choice for choice in ranked if choice.margin >= MARGIN and choice.is_accurate]
    if good:
        return min(good, key=lambda choice: choice.method.evaluations)
    return ranked[0]


def unstable(integration: Integration) -> str:
    """Reason why a step is not stable, empty if it is.

    Examples
    --------
    >>> unstable(Integration(RUNGE_KUTTA, 2.5e-5, 1.3, 0.0, 0.0, fastest_rate=8e4))
    ''
    >>> unstable(Integration(RUNGE_KUTTA, 2.5e-5, 0.0, 0.0, 0.0, fastest_rate=2e5))
    'step = 2.5e-05 s is unstable: the fastest motion has 2e+05 rad/s; use 1e-05 s or less'
    """
    if integration.margin >= 1.0:
        return ""
    rate = integration.fastest_rate
    return (
        f"step = {integration.step:g} s is unstable: the fastest motion has {rate:.4g} rad/s; use {2.0 / rate:.2g} s "
        "or less"
    )
