"""What acts on a gearbox from outside, as both solvers take it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True)
class Drive:
    """A machine that turns one body at a prescribed angle, behind a torsional spring and damper."""

    body: str
    """Name of the driven body."""
    stiffness: float
    damping: float
    """N m/rad, N m s/rad."""
    angle: Callable[[float], float]
    speed: Callable[[float], float]
    """Functions of time, rad and rad/s."""


@dataclass(frozen=True)
class Loading:
    """What acts from outside."""

    constant: Mapping[str, float] = field(default_factory=dict)
    """Torque by body, N m."""
    varying: Mapping[str, Callable[[float], float]] = field(default_factory=dict)
    """Torque by body as a function of time, N m."""
    drive: Drive | None = None
    """Machine that prescribes the angle of one body."""

    @property
    def is_constant(self) -> bool:
        """Return whether the generalized forces are constant."""
        return self.drive is None and not self.varying

    def generalized(self, assembly: Assembly, t: float, q: Floats, v: Floats) -> Floats:
        """Generalized forces at a state, shape (size,)."""
        f = assembly.torque_vector(self.constant)
        for name, torque in self.varying.items():
            f[assembly.spin[name]] += torque(t)
        if self.drive is not None:
            i = assembly.spin[self.drive.body]
            drive = self.drive
            f[i] += drive.stiffness * (drive.angle(t) - q[i]) + drive.damping * (drive.speed(t) - v[i])
        return f


@dataclass(frozen=True)
class DriveLaw:
    """A machine that turns one body at an angle quadratic in time, behind a spring and damper."""

    body: str
    """Name of the driven body."""
    stiffness: float
    damping: float
    """N m/rad, N m s/rad."""
    angle: tuple[float, float, float]
    """Coefficients of 1, t, t^2; rad, rad/s, rad/s2."""


@dataclass(frozen=True)
class LoadTable:
    """What acts from outside, as numbers: constant torques, torques linear between lines, a drive."""

    constant: Mapping[str, float] = field(default_factory=dict)
    """Torque by body about +z, N m."""
    series: Mapping[str, tuple[Floats, Floats]] = field(default_factory=dict)
    """By body times (s) and torques (N m)."""
    drive: DriveLaw | None = None

    def as_functions(self) -> Loading:
        """Express the same as functions of time, for Exudyn."""
        varying = {name: _interpolator(times, torques) for name, (times, torques) in self.series.items()}
        return Loading(self.constant, varying, None if self.drive is None else _drive_of(self.drive))


def _drive_of(law: DriveLaw) -> Drive:
    angle, speed, half_rate = law.angle
    return Drive(
        body=law.body,
        stiffness=law.stiffness,
        damping=law.damping,
        angle=lambda t: angle + speed * t + half_rate * t * t,
        speed=lambda t: speed + 2.0 * half_rate * t,
    )


def _interpolator(times: Floats, torques: Floats) -> Callable[[float], float]:
    return lambda t: float(np.interp(t, times, torques))
