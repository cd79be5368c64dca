"""What moves a mode: first-order shifts of its frequency from where its energy sits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import xarray as xr

from exugear.report.findings.words import Words

STEP = 0.1
"""Relative change of a stiffness or an inertia whose effect is told."""
LEAST_SHIFT = 5e-4
"""Relative shift of a frequency below which a lever is left out."""


@dataclass(frozen=True)
class Lever:
    """Something that moves a mode."""

    what: str
    """Element or body in words."""
    kind: str
    """{"stiffness", "inertia"}"""
    share: float
    """Of the mode's strain or kinetic energy."""
    shift: float
    """Change of the frequency for 10 % more of it, Hz."""


def shift_of(frequency: float, share: float, kind: str, step: float = STEP) -> float:
    """Shift of a frequency (Hz) for a relative change of what holds a share of the mode's energy.

    With the shape held, f^2 goes with strain energy over kinetic energy (Rayleigh's quotient), of which the shares
    are parts: f sqrt(1 + step share) for stiffness, f / sqrt(1 + step share) for inertia. The first order in the
    step is exact.

    Examples
    --------
    >>> round(shift_of(1000.0, 1.0, "stiffness", 0.21), 9), round(shift_of(1000.0, 0.2, "inertia"), 2)
    (100.0, -9.85)
    """
    power = 0.5 if kind == "stiffness" else -0.5
    return frequency * (math.pow(1.0 + step * share, power) - 1.0)


def levers_of(words: Words, modes: xr.Dataset, index: int) -> tuple[Lever, ...]:
    """List what moves a mode, stiffnesses first, each kind by its effect; copies of a planet set change together."""
    frequency = float(modes["frequency"][index])
    kinetic = modes["kinetic_energy_share"].isel(mode=index).sum("motion").to_numpy()
    bodies = words.gathered(dict(zip(map(str, modes["body"].to_numpy()), map(float, kinetic), strict=True)))
    parts = [("stiffness", words.gives(modes, index)), ("inertia", bodies)]
    levers = [
        Lever(what, kind, share, shift_of(frequency, share, kind))
        for kind, shares in parts
        for what, share in shares.items()
    ]
    return tuple(lever for lever in levers if not math.isclose(lever.shift, 0.0, abs_tol=LEAST_SHIFT * frequency))
