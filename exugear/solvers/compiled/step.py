"""Time step of the compiled solver: stable, and accurate for what resonates."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from exugear.dynamics.assembly import Assembly
from exugear.dynamics.linearised import Linearised, linearise
from exugear.dynamics.modes import coordinate_labels
from fe_ste.tools.arrays import Complexes, Floats

STABILITY_LIMIT = 2.6
"""Below this |lambda| h the method is stable for every damped motion, oscillating or creeping."""
STABLE = 2.0
"""Chosen |lambda| h at most: leaves room for k(PMC) at its peaks."""
ACCURATE = 1.02
"""Allowed w h at the top of the band: the response to an excitation there is then 0.15 % in error."""
RESONANCE_ERROR = 1e-3
"""Allowed error on the slope of a resonance, as a share of its peak."""
ACCURATE_BAND_FRACTION = 2.0 / 3.0
"""Share of elastic bodies' band up to which they vibrate as they should on bearings (`exugear.bodies.reduction`)."""
STIFFENING = 1.6
"""Stiffness of a non-linear bearing over that at its static load: at twice the load rollers have up to 1.25 times the
radial and 1.6 times the tilt stiffness, as more of them and more of their length carry."""
LIGHTEST_DAMPING = 2e-3
"""Damping ratio that lighter ones count as: an undamped resonance would ask for no error at all."""


def eigenvalues(assembly: Assembly) -> Complexes:
    """Eigenvalues (1/s) of the system linearised at rest, mean mesh stiffness, damping included."""
    linear = _at_rest(assembly)
    return scipy.linalg.eigvals(_free_motions(linear, assembly.motions)[1]).astype(np.complex128)


def _at_rest(assembly: Assembly) -> Linearised:
    """Linearised equations with all teeth in contact, non-linear bearings stiffer than under their static load."""
    stiffest = assembly.with_linear_supports(STIFFENING)
    return linearise(stiffest, np.zeros(assembly.size), stiffest.linear_meshes())


def _free_motions(linear: Linearised, free: Floats) -> tuple[Floats, Floats]:
    """Free motions of unit mass (size, n), and the matrix (2n, 2n) of the first-order equations of their amounts."""
    root = np.linalg.cholesky(linear.mass)
    basis = np.linalg.solve(root.T, scipy.linalg.orth(root.T @ free))
    size = free.shape[1]
    lower = np.hstack([-basis.T @ linear.total_stiffness @ basis, -basis.T @ linear.total_damping @ basis])
    return basis, np.vstack([np.eye(size, 2 * size, size), lower])


def highest_rate(assembly: Assembly) -> float:
    """Largest |eigenvalue|, rad/s: it decides whether a step is stable."""
    return float(np.abs(eigenvalues(assembly)).max())


def fastest_motion(assembly: Assembly) -> str:
    """Say in words what the largest |eigenvalue| belongs to: the body that moves, and what holds or damps it.

    Examples
    --------
    >>> from exugear.dynamics.assemble import assemble
    >>> from exugear.model.choice import Choice
    >>> from exugear.model.gearbox import Gearbox
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> fastest_motion(assemble(gearbox, Choice("rigid"), stiffness))
    'the fastest motion, 9.25e+03 rad/s, is of hss.spin against high_speed'
    """
    linear = _at_rest(assembly)
    basis, matrix = _free_motions(linear, assembly.motions)
    values, vectors = scipy.linalg.eig(matrix)
    fastest = int(np.argmax(np.abs(values)))
    rate, shape = float(np.abs(values[fastest])), basis @ vectors[: basis.shape[1], fastest]
    moving = int(np.argmax(np.abs(shape) ** 2 * np.diag(linear.mass)))
    strained = {
        name: abs(shape.conj() @ (k + values[fastest] * linear.damping[name]) @ shape)
        for name, k in linear.stiffness.items()
    }
    holding = max(strained, key=lambda name: strained[name]) if strained else "nothing"
    return f"the fastest motion, {rate:.3g} rad/s, is of {coordinate_labels(assembly)[moving]} against {holding}"


def choose_step(assembly: Assembly, sample_rate: float, band: float) -> float:
    """Longest step (s) that divides the sampling interval, is stable, and keeps amplitudes up to `band` (Hz).

    The method answers an excitation of frequency w with a relative error of about 0.0015 (w h)^4, and shifts an
    eigenfrequency by (w h)^4 / 120, which on the slope of its resonance with the damping ratio zeta costs up to
    0.5 / zeta of that. Resonances count where they are meant: with elastic bodies up to two thirds of the frequency to
    which these are described exactly.

    Examples
    --------
    >>> from exugear.dynamics.assemble import assemble
    >>> from exugear.model.choice import Choice
    >>> from exugear.model.gearbox import Gearbox
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> choose_step(assemble(gearbox, Choice("rigid"), stiffness), sample_rate=20e3, band=6.4e3)
    2.5e-05
    """
    values = eigenvalues(assembly)
    rates = np.maximum(np.abs(values), 1e-9)
    ratio = np.maximum(-values.real / rates, LIGHTEST_DAMPING)
    accurate_band = band
    if assembly.elastic_bodies:
        accurate_band = min(band, ACCURATE_BAND_FRACTION * assembly.gearbox.case.elasticity.band_Hz)
    resonant = rates < 2.0 * np.pi * accurate_band
    slopes = (240.0 * ratio[resonant] * RESONANCE_ERROR) ** 0.25 / rates[resonant]
    longest = min(STABLE / rates.max(), ACCURATE / (2.0 * np.pi * band), slopes.min(initial=np.inf))
    return float(1.0 / (sample_rate * np.ceil(1.0 / (sample_rate * longest) - 1e-9)))


def unstable(rate: float, step: float) -> str:
    """Reason why a step (s) is not stable for a largest eigenvalue `rate` (rad/s), empty if it is.

    Examples
    --------
    >>> unstable(1e4, 2.5e-5)
    ''
    >>> unstable(2e5, 2.5e-5)
    'step = 2.5e-05 s is not stable: the fastest motion has 2e+05 rad/s; use 1e-05 s or less'
    """
    if step * rate <= STABILITY_LIMIT:
        return ""
    longest = STABLE / rate
    return f"step = {step:g} s is not stable: the fastest motion has {rate:.4g} rad/s; use {longest:.2g} s or less"
