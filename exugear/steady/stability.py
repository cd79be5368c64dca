"""Stability of steady states: what varying meshes do to a disturbance.

A balance of lines says nothing of its stability. Two ways tell the largest growth: a first-order estimate for all pairs
of modes at once, which finds the speeds where two modes and a harmonic of a mesh work together (Hsu 1963), and Floquet
exponents of the whole system at one speed, one base at a time, the meshes of others at their mean.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exugear.steady.excitation import Gearset
from exugear.steady.harmonics.floquet import exponents, kicks_needed
from exugear.steady.mean_system.mean_modes import mean_modes
from exugear.steady.nonlinear import Balance
from exugear.system.linearised import RIGID_BODY_LIMIT
from fe_ste.tools.arrays import Complexes

SMOOTH_KICKS, PARTING_KICKS = 400, 1000
"""Kicks per period at least, and where teeth part, so that the instants at which they do are met."""
ROLLING = 2
"""Multipliers of free rolling, which are one: angle and speed."""
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


def candidates(gearset: Gearset, low: float, high: float) -> tuple[Candidate, ...]:
    """Find combination resonances between two speeds (rad/s), the fastest growing first, to first order."""
    middle = 0.5 * (low + high)
    values, right, left = mean_modes(gearset.system, middle)
    size = gearset.system.size
    ports = gearset.ports_at(middle)
    felt = left[:, size:] @ np.linalg.solve(gearset.system.mass, gearset.loads(ports).astype(complex))
    felt = felt.reshape(len(felt), len(gearset.waves.waves), -1)
    seen = right[:, :size] @ np.moveaxis(ports.readings, (0, 1, 2), (2, 0, 1))
    decay = -values.real
    frequency = values.imag
    slow = min(abs(low), abs(high))
    found = []
    for base, order in enumerate(gearset.waves.base_orders):
        own = np.array([wave.base == base for wave in gearset.waves.waves])
        for harmonic in range(1, gearset.harmonics + 1):
            tangents = {at: own * values[:, harmonic] for at, values in gearset.cycle_tangents.items()}
            turned = {at: values.conj() for at, values in tangents.items()}
            for sign in (1.0, -1.0):
                there = _between(felt, tangents, seen.conj() if sign > 0.0 else seen)
                back = there.conj() if sign > 0.0 else _between(felt, turned, seen)
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


def _between(felt: Complexes, tangents: Mapping[tuple[int, int], Complexes], seen: Complexes) -> Complexes:
    """Couple modes (k, k) by tangents (m,) of forces by readings; what they feel (k, m, f) and make seen (r, k, m)."""
    parts = [(felt[..., force] * tangent) @ seen[read].T for (force, read), tangent in tangents.items()]
    return np.asarray(np.sum(parts, axis=0))


def growth_at(balance: Balance, readings: Complexes, base: int, least: int = SMOOTH_KICKS) -> float:
    """Fastest growth of a disturbance of a steady state, 1/s, by Floquet exponents over one period of a base.

    Parameters
    ----------
    balance : at the speed
    readings : (n, m, r) what the laws read in the steady state
    base : base that varies
    least : kicks per period at least
    """
    gearset = balance.gearset
    interface = balance.interface
    system = gearset.system
    ports = interface.ports
    size = system.size
    speed = interface.speed
    period = 2.0 * np.pi / (abs(speed) * float(gearset.waves.base_orders[base]))
    values = system.eigenvalues(speed)
    kicks = max(kicks_needed(float(np.abs(values).max()) / 2.0 / np.pi, period), least)
    varying = balance.tangents_along(readings, base, kicks)
    lower = np.linalg.solve(system.mass, np.hstack([-system.stiffness_at(speed), -system.damping_at(speed)]))
    pushes = np.vstack(
        [np.zeros((size, varying.shape[1])), np.linalg.solve(system.mass, gearset.loads(ports))],
    )
    rows = ports.readings.reshape(-1, size)
    # Rates of the waves as their meshes see them: those in the frame, and what the turning carries along.
    carried = speed * np.tensordot(gearset.partners, ports.readings, axes=1).reshape(-1, size)
    by_rates = np.zeros_like(rows) if ports.rates is None else ports.rates.reshape(-1, size)
    reads = np.block([[rows, by_rates], [carried, rows]])
    # Meshes of other bases do not vary: they belong to the constant part. Bearings do with all bases.
    own = np.ones(len(gearset.weights), dtype=bool)
    own[: len(gearset.waves.waves)] = [wave.base == base for wave in gearset.waves.waves]
    pushed = np.repeat(own, ports.forces.shape[1])
    read = np.tile(np.repeat(own, ports.readings.shape[1]), 2)
    constant = np.vstack([np.eye(size, 2 * size, size), lower])
    constant -= pushes[:, ~pushed] @ varying[0][np.ix_(~pushed, ~read)] @ reads[~read]
    # Many slopes are zero: what nothing pushes along or reads costs nothing then.
    pushed = pushed & varying.any(axis=(0, 2))
    read = read & varying.any(axis=(0, 1))
    varying = varying[:, pushed][:, :, read]
    pushes = pushes[:, pushed]
    reads = reads[read]
    found, shapes = exponents(constant, pushes, reads, varying, period)
    # Free rolling neither grows nor decays but for what the losses change with the speed: it is known by its shape.
    assembly = gearset.waves.assembly
    turning = assembly.rolling_velocity(np.zeros(assembly.size), system.frame.speeds)
    along = system.mass @ np.linalg.solve(system.frame.matrices(0.0)[0], turning)
    moved = shapes[:size]
    energy = np.sqrt(np.abs(np.sum(moved.conj() * (system.mass @ moved), axis=0)))
    rolling = np.argsort(-np.abs(along @ moved) / np.maximum(energy, 1e-300))[:ROLLING]
    return float(np.delete(found, rolling).real.max())


def growth_of_state(balance: Balance, readings: Complexes, parted: bool) -> float:
    """Fastest growth of a disturbance of a steady state over the bases, 1/s.

    Parameters as of `growth_at`; `parted` tells whether its teeth part. NaN where planets mesh out of phase: the
    carrier's angle is then a cause beside the mesh cycle.
    """
    if balance.gearset.waves.carriers:
        return math.nan
    least = PARTING_KICKS if parted else SMOOTH_KICKS
    return max(growth_at(balance, readings, base, least) for base in range(len(balance.gearset.waves.base_orders)))


def mean_growth(gearset: Gearset) -> float:
    """Fastest growth of the mean system over its speeds, 1/s; free rolling left out."""
    rates = []
    for speed in gearset.system.speeds:
        values = gearset.system.eigenvalues(float(speed))
        elastic = np.abs(values.imag) > 2.0 * np.pi * RIGID_BODY_LIMIT
        rates.append(float(values.real[elastic].max(initial=-np.inf)))
    return max(rates)
