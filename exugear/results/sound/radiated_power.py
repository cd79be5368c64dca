"""Sound power that elastic bodies on the ground radiate, as equivalent radiated power (ERP).

Every part of the surface radiates like a part of a plane wave, with the intensity rho c v^2 of its normal velocity v:

    W = 1/2 rho c w^2 q^H E q = 1/2 rho c A v^2,    E = int (n . u)(n . u)^T dA over the outer surface of the area A

for peak amplitudes q of the coordinates at the angular frequency w, v the amplitude of the normal velocity as its root
mean square over the surface (Fritze, Marburg and Hardtke, Acta Acustica united
with Acustica 95, 2009). This is the factor 1 of radiation of ISO/TS 7849-1, an upper estimate. Sound of a surface that
shakes to and fro cancels where it is smaller than half a wavelength: the power is then 10 dB and more too high.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.bodies import BodySection
from exugear.gearbox.variant import Variant
from exugear.system.bearings.stiffness import elastic_names
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats

AIR_IMPEDANCE = 411.0
"""Density times speed of sound of air, N s/m3 (ISO/TS 7849-1)."""
BAND_OVER_FREQUENCY = 1.5
"""Cut-off frequency of a reduction over the highest frequency at which its surface velocity is correct."""


@dataclass(frozen=True, eq=False)
class RadiatedPower:
    """Equivalent radiated power of elastic bodies by the coordinates of a gearbox; n coordinates."""

    rows: Floats
    """(r, n) whose squares over the motion add up to its q^T E q, m."""
    bodies: tuple[str, ...]
    """Names of the bodies that radiate."""
    area: float
    """Of their outer surfaces, m2."""
    whole_area: float
    """Of their surfaces inside and outside, m2."""
    limit: float
    """Highest frequency of lines that count, Hz: the lowest `band_Hz` of the bodies over 1.5."""

    def surface_velocity(self, motion: Complexes, frequencies: Floats) -> Floats:
        """Amplitude (lines,) of the normal velocity, as its root mean square over the outer surface, m/s.

        It is not reliable above the limit.

        Parameters
        ----------
        motion : (lines, n) peak amplitudes
        frequencies : (lines,) angular frequencies, rad/s

        Examples
        --------
        A piston of 0.5 m2 that moves by 1 mm at 100 and at 200 rad/s:

        >>> piston = RadiatedPower(np.array([[np.sqrt(0.5)]]), ("piston",), 0.5, 0.5, 20.0)
        >>> piston.surface_velocity(np.array([[1e-3], [1e-3]], dtype=complex), np.array([100.0, 200.0])).round(12)
        array([0.1, 0.2])
        """
        normal = motion @ self.rows.T
        square = np.square(normal.real).sum(axis=1) + np.square(normal.imag).sum(axis=1)
        return np.asarray(np.abs(frequencies) * np.sqrt(square / self.area))

    def row_along(self, motion: Complexes, frequency: float) -> Complexes:
        """Row (n,) whose product with a motion is its part of the surface velocity of another motion, m/s.

        The product with this other motion itself is its surface velocity, which `surface_velocity` gives.

        Parameters
        ----------
        motion : (n,) the other motion
        frequency : angular frequency, rad/s

        Examples
        --------
        >>> piston = RadiatedPower(np.array([[np.sqrt(0.5)]]), ("piston",), 0.5, 0.5, 20.0)
        >>> row = piston.row_along(np.array([1e-3j]), 100.0)
        >>> [round(float((row @ np.array([part])).real), 12) for part in (1e-3j, 1e-3)]
        [0.1, 0.0]
        """
        normal = self.rows @ motion
        along = normal.conj() / np.linalg.norm(normal)
        return np.asarray(abs(frequency) / np.sqrt(self.area) * (along @ self.rows), dtype=np.complex128)

    def in_frame(self, transformation: Floats) -> RadiatedPower:
        """Return the same by other coordinates u (k,), of which the gearbox's are a transformation (n, k)."""
        return RadiatedPower(self.rows @ transformation, self.bodies, self.area, self.whole_area, self.limit)


def equivalent_power(velocity: Floats, area: float) -> Floats:
    """Equivalent radiated power (...) of a surface, W: 1/2 rho c A v^2.

    Parameters
    ----------
    velocity : (...) amplitude of the normal velocity, root mean square over the surface, m/s
    area : of the surface, m2

    Examples
    --------
    >>> equivalent_power(np.array([0.1]), 0.5)
    array([1.0275])
    """
    return np.asarray(0.5 * AIR_IMPEDANCE * area * np.square(velocity))


def radiating_names(gearbox: Gearbox, variant: Variant) -> tuple[str, ...]:
    """Names of the bodies of a gearbox whose sound power is computed: flexible bodies with a surface that are fixed.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> radiating_names(gearbox, Variant.flexible), radiating_names(gearbox, Variant.bushing)
    (('housing',), ())
    """
    flexible = elastic_names(gearbox) if variant.is_elastic else ()
    return tuple(
        body.name
        for body in gearbox.bodies()
        if body.fixed and body.name in flexible and _has_surface(gearbox.case.bodies[body.family])
    )


def _has_surface(section: BodySection) -> bool:
    """Return whether a flexible body has an outer surface: a solid, or matrices with a recovery matrix."""
    return section.solid is not None or (section.external is not None and section.external.recovery is not None)


def radiated_power(assembly: Assembly) -> RadiatedPower | None:
    """Return the equivalent radiated power of an assembly; None if it has no elastic solid on the ground."""
    surfaces = {
        name: body.reduced.radiating
        for name, body in assembly.elastic_bodies.items()
        if body.reduced.radiating is not None
    }
    if not surfaces:
        return None
    blocks = []
    for name, surface in surfaces.items():
        values, vectors = np.linalg.eigh(surface.matrix)
        rows = np.zeros((len(values), assembly.size))
        rows[:, assembly.elastic_slices[name]] = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        blocks.append(rows)
    return RadiatedPower(
        rows=np.concatenate(blocks),
        bodies=tuple(surfaces),
        area=sum(surface.area for surface in surfaces.values()),
        whole_area=sum(surface.whole_area for surface in surfaces.values()),
        limit=min(surface.band for surface in surfaces.values()) / BAND_OVER_FREQUENCY,
    )
