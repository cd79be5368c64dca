"""External loads on a gearbox, in the form that both solvers take: loads over time and angle, and a drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from exugear.system.kernels.varying_loads import VaryingLoadArrays, add_varying_loads
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True)
class Drive:
    """A machine that turns one body to an angle quadratic in time, through a torsional spring and damper."""

    body: str
    """Name of the driven body."""
    stiffness: float
    damping: float
    """N m/rad, N m s/rad."""
    angle: tuple[float, float, float]
    """Coefficients of 1, t, t^2; rad, rad/s, rad/s2."""

    def torque(self, t: float, angle: float, speed: float) -> float:
        """Torque (N m) on the driven body at its angle (rad) and speed (rad/s)."""
        start, rate, half_acceleration = self.angle
        ahead = start + rate * t + half_acceleration * t * t - angle
        return self.stiffness * ahead + self.damping * (rate + 2.0 * half_acceleration * t - speed)


@dataclass(frozen=True)
class LoadTable:
    """External loads: constant torques, torques linear between points in time, and a drive."""

    constant: Mapping[str, float] = field(default_factory=dict)
    """Torque by body about +z, N m."""
    series: Mapping[str, tuple[Floats, Floats]] = field(default_factory=dict)
    """Times (s) and torques (N m) by body; before and after them the first and last torque act."""
    drive: Drive | None = None
    varying: VaryingLoadArrays | None = None
    """Loads that vary with the angle of a body, of the same assembly; none by default."""

    @property
    def is_constant(self) -> bool:
        """Return whether the generalized forces are constant."""
        return self.drive is None and not self.series and (self.varying is None or not self.varying.turning.size)

    def torque(self, body: str, t: float) -> float:
        """Torque of the time series of a body at a time (s), N m."""
        return float(np.interp(t, *self.series[body]))

    def generalized(self, assembly: Assembly, t: float, q: Floats, v: Floats) -> Floats:
        """Generalized forces at a state, shape (size,)."""
        f = assembly.torque_vector(self.constant)
        for name in self.series:
            f[assembly.spin[name]] += self.torque(name, t)
        if self.varying is not None:
            add_varying_loads(q, v, self.varying, f)
        if self.drive is not None:
            i = assembly.spin[self.drive.body]
            f[i] += self.drive.torque(t, q[i], v[i])
        return f
