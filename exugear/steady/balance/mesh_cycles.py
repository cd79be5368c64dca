"""Functions of the mesh cycles that make forces along a row: their harmonics, and what they are beyond the mean.

A mesh has the stiffness k, the load F_0, the exponent m of its curve and the axial shift w of its load, all over the
position in the mesh cycle. Where loads shuttle, a misalignment g changes the deflection by -w g, and forces have the
moment -w F about the middle of the face.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exugear.steady.mean_system.mesh_places import DEFLECTION, MISALIGNMENT, CycleFunctions, Family, Spectra
from exugear.steady.mean_system.mesh_waves import CycleQuantity, MeshWaves
from fe_ste.tools.arrays import Complexes, Floats


@dataclass(frozen=True, eq=False)
class MeshCycles:
    """Harmonics over the mesh cycle of what all m mesh components have."""

    waves: MeshWaves
    families: tuple[Family, ...]
    harmonics: int
    """Highest one of each mesh frequency."""
    forces: int
    """Number of forces, and of readings, of each component."""
    shuttles: bool
    """Whether moments by misalignment are among them."""

    def functions(self, spectra: Spectra) -> CycleFunctions:
        """Functions of the mesh cycles by their harmonics, as `HarmonicCoupling` takes them at a speed."""
        return CycleFunctions(self.waves, self.families, spectra, self.forces)

    def _harmonics_of(self, *quantities: CycleQuantity) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of a product of quantities over the mesh cycle."""
        return self.waves.cycle_coefficients(*quantities, harmonics=self.harmonics)

    @cached_property
    def stiffness(self) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of the stiffness over the mesh cycle, N/m; of curves the tangent."""
        return self._harmonics_of("tangent")

    @cached_property
    def compliances(self) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of the static transmission error over the static load, m/N."""
        return self._harmonics_of("compliance")

    @cached_property
    def curves(self) -> tuple[Complexes, Complexes]:
        """Fourier coefficients (m, harmonics + 1) of load over deflection (N/m), and of the exponents less one."""
        return self._harmonics_of("secant"), self._harmonics_of("exponent")

    @cached_property
    def pulls(self) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of what the tangent has more than the curve without deflection, N."""
        return np.asarray(self.waves.loads[:, None] * self.curves[1])

    @cached_property
    def ways(self) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of the axial shift of the load, m."""
        return self._harmonics_of("way")

    @cached_property
    def moments_beyond(self) -> Complexes:
        """Fourier coefficients (m, harmonics + 1) of the moment that the static load has beyond that way, N m."""
        return self._harmonics_of("moment")

    @cached_property
    def moments(self) -> tuple[Complexes, Complexes, Complexes]:
        """Fourier coefficients (m, harmonics + 1) of that way times stiffness (N), pull (N m), and squared (N m)."""
        pulls = self.waves.loads[:, None] * self._harmonics_of("exponent", "way")
        return self._harmonics_of("tangent", "way"), pulls, self._harmonics_of("tangent", "way", "way")

    @cached_property
    def tangents(self) -> dict[tuple[int, int], Complexes]:
        """Derivatives (m, harmonics + 1) of the static model of each force by each reading, like those of stiffness.

        Derivative over the mesh cycle of the force by the deflection; where loads shuttle, of force and moment by
        deflection and misalignment.
        """
        found = {(DEFLECTION, DEFLECTION): self.stiffness}
        if self.shuttles:
            across, _, twice = self.moments
            found[DEFLECTION, MISALIGNMENT] = found[MISALIGNMENT, DEFLECTION] = -across
            found[MISALIGNMENT, MISALIGNMENT] = twice + _constant(twice, self.varying_tilting[:, 0])
        return found

    @cached_property
    def tangents_beyond_mean(self) -> CycleFunctions:
        """The same beyond the averaged system, as functions of the mesh cycles."""
        forces = self.forces
        means = np.zeros((len(self.waves.waves), forces))
        means[:, DEFLECTION] = self.waves.mean_stiffness
        if self.shuttles:
            means[:, MISALIGNMENT] = self.varying_tilting[:, 0]
        return CycleFunctions(self.waves, self.families, self.tangents, forces, means)

    @cached_property
    def slopes(self) -> CycleFunctions:
        """Derivative of the tangents by the position, N/m per cycle."""
        return self.functions({(DEFLECTION, DEFLECTION): self._derivative * self.stiffness})

    @cached_property
    def pull_slopes(self) -> CycleFunctions:
        """Derivative of the forces that curves have without deflection by the position, N per cycle."""
        return self.functions({(DEFLECTION, DEFLECTION): -self._derivative * self.pulls})

    @cached_property
    def bends(self) -> tuple[CycleFunctions, CycleFunctions]:
        """Derivative of the tangents of curves by the deflection, N/m2, and its product with that at the load, N/m.

        A curve of load over deflection is the load times the power m of deflection over that at this load.
        """
        loads = self.waves.loads[:, None]
        curved = loads > 0.0
        bend = self._harmonics_of("exponent", "tangent", "secant") / np.where(curved, loads, 1.0)
        slope = self._harmonics_of("exponent", "tangent")
        key = DEFLECTION, DEFLECTION
        return self.functions({key: np.where(curved, bend, 0.0)}), self.functions({key: np.where(curved, -slope, 0.0)})

    @property
    def _derivative(self) -> Complexes:
        """Derivative of harmonics (harmonics + 1,) by the position, 1 per cycle."""
        return np.asarray(2j * np.pi * np.arange(self.harmonics + 1))

    @cached_property
    def given(self) -> CycleFunctions:
        """Forces of tangents at zero deflection over the mesh cycle: of curves, and moments where loads shuttle."""
        spectra = {(DEFLECTION, DEFLECTION): -self.pulls}
        if self.shuttles:
            pulls = self.moments[1] - self.moments_beyond
            spectra[MISALIGNMENT, DEFLECTION] = pulls - _constant(pulls, self.varying_tilting[:, 2])
        return self.functions(spectra)

    @cached_property
    def varying_tilting(self) -> Floats:
        """`MeshWaves.tilting` of each wave's mesh (m, 3)."""
        return np.asarray(self.waves.tilting[[wave.first for wave in self.waves.waves]])


def _constant(cycle: Complexes, values: Floats) -> Complexes:
    """Coefficients, like those of a function over the mesh cycle (m, h + 1), of constants (m,)."""
    found = np.zeros_like(cycle)
    found[:, 0] = values
    return found
