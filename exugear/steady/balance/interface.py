"""Meshes and nonlinear bearings in the averaged system at one speed: what they read of a motion, and how it answers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.steady.mean_system.bearing_waves import BearingMean
from exugear.steady.mean_system.mesh_places import MeshInterface
from exugear.steady.mean_system.signals import SignalRows
from fe_ste.tools.arrays import Complexes, Floats, Integers


@dataclass(frozen=True, eq=False)
class LoadResponse:
    """Response to loads on the bodies beside the forces along the meshes' rows at one speed; n orders.

    These are the friction of the teeth, stated loads, and those by which mesh forces act on gears with deviations.
    """

    loads: Complexes
    """(n, size) generalized forces in the rotating frame, N and N m."""
    motion: Complexes
    """(n, size) motion under them."""
    torque: float
    """Mean torque of the drive that overcomes them, N m."""
    reactions: Complexes
    """(n, 6 r) reactions of stated loads on fixed bodies, N and N m."""


@dataclass(frozen=True, eq=False)
class Interface:
    """Meshes of a gearbox in the averaged system at one speed; m components, r readings, f forces, n orders.

    Components of nonlinear bearings follow those of the meshes.
    """

    speed: float
    """Of the overall input, rad/s."""
    frequencies: Floats
    """(n,) angular frequencies of the lines, rad/s."""
    motion: Complexes
    """(n, size, m, f) motion under a unit of each force, the waves' weights in it."""
    ports: MeshInterface
    """What the meshes read and push along."""
    rows: SignalRows
    """Signals from the motion."""
    torque: float
    """Of the drive in the static state, N m."""
    torque_per_force: Floats
    """(m, f) torque of the drive per steady force, N m/N."""
    bearings: BearingMean | None
    """Nonlinear bearings in the averaged system."""
    along_bearings: Complexes
    """(n, size, c) motion under a unit of force along each coordinate of bearings whose stiffness varies with the
    carrier."""
    torque_along_bearings: Floats
    """(c,) torque of the drive per steady unit of these."""
    loads: LoadResponse | None = None
    """Response to loads beside the meshes' forces, if there are any."""

    @cached_property
    def static(self) -> Complexes:
        """Readings (n, m, r) without forces of the meshes beyond the averaged system: static state and other loads."""
        found = np.zeros((len(self.frequencies), *self.ports.static.shape), dtype=complex)
        if self.loads is not None:
            found += self.read(self.loads.motion)
        found[0] += self.ports.static
        return found

    @cached_property
    def deflection_per_force(self) -> Complexes:
        """What laws along a row read along what they push along, (n, m f, m f), under a unit of each force.

        They do not read rates.
        """
        lines, waves, forces = self.motion.shape[0], *self.motion.shape[2:]
        read = _taken(self.ports.readings[:, :forces], self.motion)
        return np.ascontiguousarray(read).reshape(lines, waves * forces, waves * forces)

    def answers_with(self, coordinates: Integers) -> Complexes:
        """Return `deflection_per_force` with coordinates of varying bearings behind the laws, (n, m f + c, m f + c)."""
        if not coordinates.size:
            return self.deflection_per_force
        lines, size, waves, forces = self.motion.shape
        rows = np.vstack([self.ports.readings[:, :forces].reshape(-1, size), np.eye(size)[coordinates]])
        return _taken(rows, np.concatenate([self.motion.reshape(lines, size, -1), self.along_bearings], axis=2))

    @cached_property
    def readings(self) -> Complexes:
        """All that the laws read (n, m, r, m, f) under a unit of each force."""
        return self.read(self.motion)

    def read(self, motion: Complexes) -> Complexes:
        """Find what the laws read (n, m, r, ...) of a motion (n, size, ...)."""
        found = _taken(self.ports.readings, motion)
        if self.ports.rates is not None:
            moving = 1j * self.frequencies.reshape(-1, *(1,) * (motion.ndim - 1)) * motion
            found += _taken(self.ports.rates, moving)
        return found


def _taken(rows: Floats, motion: Complexes) -> Complexes:
    """Products (n, ..., ...) of rows (..., size) with a motion (n, size, ...)."""
    lines, size, *loads = motion.shape
    # A row's numbers are real: so are the products with both parts of the motion.
    parts = np.ascontiguousarray(motion).view(np.float64).reshape(lines, size, -1)
    found = np.ascontiguousarray(rows).reshape(-1, size) @ parts
    return np.asarray(found.view(np.complex128).reshape(lines, *rows.shape[:-1], *loads))
