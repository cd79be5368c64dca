"""Time step and method of the compiled solver: stable, and accurate for what resonates."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from exugear.system.assembly import Assembly
from exugear.system.eigenmodes.modes import coordinate_labels
from exugear.system.linearised import Linearised, linearise
from exugear.transient.compiled.methods import (
    ORDERS,
    RUNGE_KUTTA,
    Method,
    adams,
    forced_error,
    growth,
    resonance_error,
    stabilised,
)
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.display import Displayed

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
class Integration(Displayed):
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
    linear = _at_rest(assembly)
    return scipy.linalg.eigvals(_free_motions(linear, assembly.motions)[1]).astype(np.complex128)


def _at_rest(assembly: Assembly) -> Linearised:
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
    """Say in words what the largest ``|eigenvalue|`` belongs to: the body that moves, and what holds or damps it.

    Examples
    --------
    >>> from exugear.system.assemble import assemble
    >>> from exugear.gearbox.choice import Choice
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> fastest_motion(assemble(gearbox, Choice("rigid"), stiffness))
    'the fastest motion, 9.25e+03 rad/s, is of hss.spin against high_speed'
    """
    linear = _at_rest(assembly)
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
    return f"the fastest motion, {rate:.3g} rad/s, is of {coordinate_labels(assembly)[moving]} against {holding}"


def _stable(method: Method, values: Complexes, step: float, factor: float) -> bool:
    """Tell whether no free motion grows, all being faster by a factor."""
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
        """Figures of a method with a step (s)."""
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
    """Find the method and the step that take the fewest evaluations.

    The step divides the sampling interval, is stable by `MARGIN` for all eigenvalues of the system at rest, meshes at
    their stiffest, keeps amplitudes up to `band` within `FORCED_ERROR` and resonances excited up to there within
    `RESONANCE_ERROR`, those of elastic bodies too: teeth excite them wherever mesh frequencies pass. Heavy damping
    shortens the steps of multistep methods: the Runge-Kutta method takes over then.

    Parameters
    ----------
    sample_rate, band : Hz
    step : take this step, s, whatever its accuracy; the method is then the stable one of least error
    integrator : {"adams", "rk4"}, optional
        Kind of method; whichever is cheaper by default.

    Returns
    -------
    its margin is below 1 if the step asked for is not stable

    Examples
    --------
    >>> from exugear.system.assemble import assemble
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
    """Return the cheapest that is stable with the margin and accurate; else the stable one of least error."""
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
    'step = 2.5e-05 s is not stable: the fastest motion has 2e+05 rad/s; use 1e-05 s or less'
    """
    if integration.margin >= 1.0:
        return ""
    rate = integration.fastest_rate
    return (
        f"step = {integration.step:g} s is not stable: the fastest motion has {rate:.4g} rad/s; "
        f"use {2.0 / rate:.2g} s or less"
    )
