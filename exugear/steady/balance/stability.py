"""Stability of steady states by laws in time: the largest growth rate of a disturbance.

Harmonic balance does not show stability. The largest growth rate follows from two methods: a first-order estimate for
all pairs of modes at once, which finds the speeds of combination instability of two modes and a mesh harmonic (Hsu
1963), and Floquet exponents of the whole system at one speed, one base at a time, the meshes of others at their mean.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.nonlinear import HarmonicResidual
from exugear.steady.harmonics.branches import exponents, kicks_needed
from exugear.steady.mean_system.mean_system import mean_modes, most_rolling
from exugear.system.modes import fastest_growth, state_matrix
from fe_ste.tools.arrays import Complexes

SMOOTH_KICKS, PARTING_KICKS = 400, 1000
"""Minimum number of kicks per period, without and with contact loss, whose instants have to be resolved."""
CHECKED = 3
"""Candidates whose Floquet exponents are computed."""


@dataclass(frozen=True)
class Candidate:
    """A speed at which two modes and a harmonic of a mesh frequency may work together."""

    speed: float
    """Of the input, rad/s."""
    base: int
    harmonic: int
    """Which mesh frequency, and the multiple of it that is the sum or difference of both modes' frequencies."""
    growth: float
    """Estimate of the fastest growth there, 1/s."""


def candidates(model: HarmonicBalanceModel, low: float, high: float) -> tuple[Candidate, ...]:
    """Find combination resonances between two speeds (rad/s), the fastest growing first, to first order."""
    middle = 0.5 * (low + high)
    values, right, left = mean_modes(model.system, middle)
    size = model.system.size
    ports = model.ports_at(middle)
    felt = left[:, size:] @ np.linalg.solve(model.system.mass, model.loads(ports).astype(complex))
    felt = felt.reshape(len(felt), len(model.waves.waves), -1)
    seen = right[:, :size] @ np.moveaxis(ports.readings, (0, 1, 2), (2, 0, 1))
    decay = -values.real
    frequency = values.imag
    slow = min(abs(low), abs(high))
    found = []
    for base, order in enumerate(model.waves.base_orders):
        of_base = np.array([wave.base == base for wave in model.waves.waves])
        for harmonic in range(1, model.harmonics + 1):
            tangents = {at: of_base * values[:, harmonic] for at, values in model.cycles.tangents.items()}
            turned = {at: values.conj() for at, values in tangents.items()}
            for sign in (1.0, -1.0):
                there = _couple_modes(felt, tangents, seen.conj() if sign > 0.0 else seen)
                back = there.conj() if sign > 0.0 else _couple_modes(felt, turned, seen)
                product = there * back.T
                growth = -0.5 * (decay[:, None] + decay) + np.real(
                    np.sqrt(0.25 * (decay[:, None] - decay) ** 2 + product)
                )
                speed = (frequency[:, None] + sign * frequency) / (harmonic * order)
                inside = (speed >= slow) & (speed <= max(abs(low), abs(high))) & (speed > 0.0)
                if inside.any():
                    i, j = np.unravel_index(np.argmax(np.where(inside, growth, -np.inf)), growth.shape)
                    at = float(np.copysign(speed[i, j], middle))
                    found.append(Candidate(at, base, harmonic, float(growth[i, j])))
    return tuple(sorted(found, key=lambda candidate: -candidate.growth))


def _couple_modes(felt: Complexes, tangents: Mapping[tuple[int, int], Complexes], seen: Complexes) -> Complexes:
    """Couple modes (k, k) by tangents (m,) of forces by readings; what they feel (k, m, f) and make seen (r, k, m)."""
    parts = [(felt[..., force] * tangent) @ seen[read].T for (force, read), tangent in tangents.items()]
    return np.asarray(np.sum(parts, axis=0))


def growth_at(balance: HarmonicResidual, readings: Complexes, base: int, least: int = SMOOTH_KICKS) -> float:
    """Return the largest growth rate, 1/s, of a disturbance of a steady state, by Floquet exponents over one base.

    Parameters
    ----------
    balance : at the speed
    readings : (n, m, r) inputs of the models in the steady state
    base : base that varies
    least : minimum number of kicks per period
    """
    model = balance.model
    interface = balance.interface
    system = model.system
    ports = interface.ports
    size = system.size
    speed = interface.speed
    period = 2.0 * np.pi / (abs(speed) * float(model.waves.base_orders[base]))
    values = system.eigenvalues(speed)
    kicks = max(kicks_needed(float(np.abs(values).max()) / 2.0 / np.pi, period), least)
    varying = balance.tangents_along(readings, base, kicks)
    pushes = np.vstack(
        [np.zeros((size, varying.shape[1])), np.linalg.solve(system.mass, model.loads(ports))],
    )
    rows = ports.readings.reshape(-1, size)
    # Rates of the waves as their meshes see them: those in the frame, and what the turning carries along.
    carried = speed * np.tensordot(model.partners, ports.readings, axes=1).reshape(-1, size)
    by_rates = np.zeros_like(rows) if ports.rates is None else ports.rates.reshape(-1, size)
    reads = np.block([[rows, by_rates], [carried, rows]])
    # Meshes of other bases do not vary: they belong to the constant part. Bearings do with all bases.
    of_base = np.ones(len(model.weights), dtype=bool)
    of_base[: len(model.waves.waves)] = [wave.base == base for wave in model.waves.waves]
    pushed = np.repeat(of_base, ports.forces.shape[1])
    read = np.tile(np.repeat(of_base, ports.readings.shape[1]), 2)
    constant = state_matrix(system.mass, system.damping_at(speed), system.stiffness_at(speed))
    constant -= pushes[:, ~pushed] @ varying[0][np.ix_(~pushed, ~read)] @ reads[~read]
    # Many slopes are zero: what nothing pushes along or reads costs nothing then.
    pushed = pushed & varying.any(axis=(0, 2))
    read = read & varying.any(axis=(0, 1))
    varying = varying[:, pushed][:, :, read]
    pushes = pushes[:, pushed]
    reads = reads[read]
    found, shapes = exponents(constant, pushes, reads, varying, period)
    # Free rolling neither grows nor decays but for what the losses change with the speed: it is known by its shape.
    return float(np.delete(found, most_rolling(system, shapes[:size])).real.max())


def growth_of_state(balance: HarmonicResidual, readings: Complexes, parted: bool) -> float:
    """Return the largest growth rate of a disturbance of a steady state over the bases, 1/s.

    Parameters as of `growth_at`; `parted` is True with contact loss. NaN where planets mesh out of phase, and where
    gears with deviations lose contact: angles of shafts are then excitations in addition to the mesh cycle.
    """
    model = balance.model
    if model.waves.carriers or (parted and model.deviations(balance.interface.speed).any()):
        return math.nan
    least = PARTING_KICKS if parted else SMOOTH_KICKS
    return max(growth_at(balance, readings, base, least) for base in range(len(model.waves.base_orders)))


def mean_growth(model: HarmonicBalanceModel) -> float:
    """Largest growth rate of the averaged system over its speeds, 1/s; free rotation excluded."""
    return max(fastest_growth(model.system.eigenvalues(float(speed))) for speed in model.system.speeds)
