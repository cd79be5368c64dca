"""All that the balance of lines needs of a gearbox at one speed, taken from parabolas through three speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.harmonics.lines import LineSet
from exugear.harmonics.products import Product
from exugear.rotating.mean_system import MeanSystem
from exugear.rotating.mesh_waves import MeshWaves
from exugear.rotating.signals import SignalName, SignalRows, mesh_signal_names, signal_rows
from fe_ste.tools.arrays import Complexes, Floats, SparseMatrix


@dataclass(frozen=True, eq=False)
class Interface:
    """The meshes of a gearbox as they meet its mean system at one speed; m mesh waves, n lines.

    Attributes
    ----------
    speed : float
        Of the overall input, rad/s.
    frequencies : (n,) array
        Angular frequencies of the lines, rad/s.
    motion : (n, size, m) complex array
        Motion under a unit of each wave's force, the weights in it.
    deflection : (m, size) array
        Rows of the deflections.
    compliance : (n, m, m) complex array
        Deflections under unit forces.
    static : (m,) array
        Deflections of the static state, m.
    mean_stiffness : (m,) array
        N/m.
    coefficients : (m, harmonics + 1) complex array
        Fourier coefficients of the stiffness, N/m.
    rows : SignalRows
    torque : float
        Of the drive in the static state, N m.
    torque_per_force : (m,) array
        Torque of the drive per steady force of each wave, N m/N.
    """

    speed: float
    frequencies: Floats
    motion: Complexes
    deflection: Floats
    compliance: Complexes
    static: Floats
    mean_stiffness: Floats
    coefficients: Complexes
    rows: SignalRows
    torque: float
    torque_per_force: Floats


class Gearset:
    """A gearbox ready for the balance of lines at any speed within a range.

    Parameters
    ----------
    waves : MeshWaves
    lines : LineSet
    stiffness_harmonics : int
        Highest harmonic of the mesh stiffness.
    """

    def __init__(self, waves: MeshWaves, lines: LineSet, stiffness_harmonics: int) -> None:
        self.waves, self.lines, self.harmonics = waves, lines, stiffness_harmonics
        system = waves.system
        self._over_speed = {
            name: np.array(values)
            for name, values in zip(
                ("deflection", "force", "static", "position", "place", "rate", "acceleration"),
                zip(*(self._at_node(float(speed)) for speed in system.speeds), strict=True),
                strict=True,
            )
        }
        self.signal_names: tuple[SignalName, ...] = (*self._row_names, *mesh_signal_names(waves))

    @property
    def system(self) -> MeanSystem:
        """The mean system."""
        return self.waves.system

    def _at_node(self, speed: float) -> tuple[Floats, ...]:
        rows = signal_rows(self.system, speed)
        self._row_names = rows.names
        position = self.waves.positions(speed)
        return (
            *self.waves.rows(speed),
            self.waves.static_deflections(speed),
            position,
            rows.by_place,
            rows.by_rate,
            rows.by_acceleration,
        )

    @cached_property
    def cycle_coefficients(self) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of each wave's stiffness over its mesh cycle, N/m."""
        return self.waves.cycle_coefficients(self.harmonics)

    @cached_property
    def cycle_compliances(self) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of one over the stiffness, m/N."""
        return self.waves.cycle_coefficients(self.harmonics, reciprocal=True)

    @cached_property
    def products(self) -> tuple[Product, ...]:
        """Product with the stiffness of each base."""
        return tuple(Product(self.lines, base, self.harmonics) for base in range(len(self.waves.base_orders)))

    def by_angle(self, coefficients: Complexes, positions: Floats, speed: float) -> Complexes:
        """Coefficients (m, h + 1) over mesh cycles, by the angles of the bases instead."""
        shift = np.exp(2j * math.pi * positions[:, None] * np.arange(coefficients.shape[1]))
        forward = np.array([wave.sense for wave in self.waves.waves]) * math.copysign(1.0, speed) > 0.0
        turned = coefficients * shift
        return np.asarray(np.where(forward[:, None], turned, np.conj(turned)))

    def at(self, speed: float) -> Interface:
        """Everything at one speed of the input (rad/s), which is not zero."""
        system, known = self.system, {name: self.system.at(values, speed) for name, values in self._over_speed.items()}
        frequencies = abs(speed) * self.lines.orders
        loads = known["force"].T * self.waves.weights
        still = system.still(system.stiffness_at(speed), loads)
        moving = system.responses(speed, frequencies[1:], loads)
        motion = np.concatenate([still[None, :-1].astype(complex), moving])
        rows = SignalRows(self._row_names, known["place"], known["rate"], known["acceleration"])
        return Interface(
            speed=speed,
            frequencies=frequencies,
            motion=motion,
            deflection=known["deflection"],
            compliance=known["deflection"] @ motion,
            static=known["static"],
            mean_stiffness=self.waves.mean_stiffness,
            coefficients=self.by_angle(self.cycle_coefficients, known["position"], speed),
            rows=rows,
            torque=system.torque_at(speed),
            torque_per_force=still[-1],
        )

    def force_rows(self, speed: float) -> Floats:
        """Rows (m, size) of the forces by the frame's coordinates at a speed of the input, rad/s."""
        return self.system.at(self._over_speed["force"], speed)

    def compliances(self, speed: float) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of one over the stiffness by the bases' angles, m/N."""
        return self.by_angle(self.cycle_compliances, self.system.at(self._over_speed["position"], speed), speed)

    def coupling(self, coefficients: Complexes) -> list[tuple[SparseMatrix, SparseMatrix]]:
        """Map lines by the stiffness of each wave; coefficients (m, harmonics + 1), N/m."""
        return [
            self.products[wave.base].matrices(own) for wave, own in zip(self.waves.waves, coefficients, strict=True)
        ]
