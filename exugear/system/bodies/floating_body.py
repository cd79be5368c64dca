"""An elastic body as modes in a frame that floats with it: what the reduction gives and Exudyn takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.system.kernels.coordinates import BODY_SIZE
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed


@dataclass(frozen=True)
class FloatingBody(Displayed, line=" {name}: {seats!n} seats, {stiffness!n} modes, {mass:.4g} kg"):
    """A solid as modes in its own frame; n coordinates of the reduced body, k modes, s seats."""

    name: str
    seats: tuple[str, ...]
    """What it is, and names of its seats."""
    places: Floats
    """(s, 3) of the seats, m."""
    centre: Floats
    """(3,) where the frame is: mass centre of shape and rings, m."""
    mass: float
    """In kg."""
    mode_coordinates: Floats
    """(n, k) coordinates of the reduced body by mode: seats' first, then modal coordinates."""
    stiffness: Floats
    """(k,) of modes of unit mass, 1/s2."""
    added_mass: Floats
    """(k,) by mass scaling beyond the unit mass of modes above the limit."""
    first_moments: Floats
    """(3, 1 + k) int rho f of the place from the centre and of the modes, kg m and kg^0.5."""
    second_moments: Floats
    """(3, 3, 1 + k, 1 + k) int rho f_a g_b."""
    centrifugal_tension: Floats
    """(k, k) what times the square of the spin speed is the stiffness of centrifugal tension."""
    turning: Floats
    """(k, k) antisymmetric S: a turn by psi takes modes into each other by exp(psi S)."""

    @property
    def frequencies(self) -> Floats:
        """Frequencies of the free body at rest, (k,), Hz."""
        return np.sqrt(self.stiffness / (1.0 + self.added_mass)) / (2.0 * np.pi)

    @property
    def centrifugal(self) -> Floats:
        """Steady force on the modes over the square of the spin speed, (k,): it widens and shortens a body."""
        load: Floats = self.second_moments[0, 0, 0, 1:] + self.second_moments[1, 1, 0, 1:]
        return load

    @property
    def spin_stiffness(self) -> Floats:
        """Stiffness over the square of the spin speed, (k, k): centrifugal tension; scaling masses do not spin."""
        square = self.turning @ self.turning
        return self.centrifugal_tension + 0.5 * (self.added_mass[:, None] * square + square * self.added_mass)

    @property
    def spin_damping(self) -> Floats:
        """Antisymmetric damping over the spin speed, (k, k): scaling masses do not spin with the frame."""
        return self.added_mass[:, None] * self.turning + self.turning * self.added_mass

    @property
    def at_seats(self) -> Floats:
        """Displacement and turns of the seats by mode, (6 s, k)."""
        return self.mode_coordinates[: BODY_SIZE * len(self.seats)]
