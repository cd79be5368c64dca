"""Contact of a mesh about its static state: what it deflects by, where it bears, and how both follow load and tilt.

With the deflection d at mid-face and the misalignment g, both of the loaded flank, a law along a row reads

    e = d - (zt + w) (g - g0),   force F(e),   moment M = F0 zc + zt (F - F0) + w F - kg (g - g0),

which has a potential, U = U(e) + (zt - zc) F0 (g - g0) + kg (g - g0)^2 / 2: the generalized force of the mesh is
-F dd/dq + M dg/dq. Teeth yield otherwise where the axes stand apart, by sa (a - a0) for a centre distance a: the row of
d has that in it, so that the load pushes between the axes as well. The load centre zc and that of a load more, zt, are
means over the mesh cycle, in the transverse plane of action from the middle of the common face towards +z.

Over the mesh cycle the load moves along the face, most of helical teeth, and what a little more deflection adds to it
moves otherwise: c(pmc) and w(pmc) are load centre and tangent load centre against their means. By w the deflection
under a constant load follows the misalignment, and the load its moment: F w + F0 (c - w), which at F0 is that of the
contact. The latter part is given by the cycle alone, in the potential -F0 (c - w) (g - g0). While both change, teeth
take or give the power (F w' + F0 (c' - w')) (g - g0) dpmc/dt, as they do while the stiffness changes. Dampers act along
the mean lever zt.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats

Samples = tuple[float, ...]


@dataclass(frozen=True)
class ContactCycle:
    """What of a contact changes over the mesh cycle, at equal steps from its beginning."""

    deflection: Samples
    """Tuple of float. Static transmission error, m."""
    tangent_stiffness: Samples
    """Tuple of float. N/m."""
    load_centre: Samples
    tangent_load_centre: Samples
    """Tuple of float. Of the load, and of what a little more deflection adds to it, m."""


@dataclass(frozen=True)
class ContactState:
    """Contact of a mesh at one load and misalignment, as mean over the mesh cycle.

    Examples
    --------
    >>> state = ContactState(50e3, 20e-6, 2.6e9, 1e-4, -2e-3, -1.9e-3, 2e5)
    >>> state.seen_by(-1).load_centre, state.seen_by(-1).misalignment
    (0.002, -0.0001)
    """

    force: float
    """Load F0 on the transverse line of action, N, positive."""
    deflection: float
    """Static transmission error at that load and misalignment, m."""
    tangent_stiffness: float
    """Change of the load with the deflection at that misalignment, N/m."""
    misalignment: float
    """g0, rad; it opens the gap at the +z end."""
    load_centre: float
    """Zc, m."""
    tangent_load_centre: float
    """Centre zt of the load that a little more deflection adds, m; also the change of the deflection with the
    misalignment under constant load, m/rad."""
    tilt_stiffness: float
    """kg: how much the load's moment falls with the misalignment while the load stays, N m/rad."""
    centre_distance: float = 0.0
    deflection_by_distance: float = 0.0
    """a0 (m), and sa: change of the deflection with the centre distance under constant load."""
    cycle: ContactCycle | None = None
    """What of it changes over the mesh cycle, if that is known."""

    def seen_by(self, flank: int) -> ContactState:
        """Take the state from the axes of a table to those of a mesh with this flank, or back.

        The flank -1 is that of the table turned about the line of centres: the ends of the face change places.
        """
        cycle = self.cycle
        if cycle is not None:
            centres = (
                tuple(flank * centre for centre in own) for own in (cycle.load_centre, cycle.tangent_load_centre)
            )
            cycle = ContactCycle(cycle.deflection, cycle.tangent_stiffness, *centres)
        return replace(
            self,
            misalignment=flank * self.misalignment,
            load_centre=flank * self.load_centre,
            tangent_load_centre=flank * self.tangent_load_centre,
            cycle=cycle,
        )


def changed_over_cycle(known: Floats, samples: Samples) -> Floats:
    """Give what is known finely over the mesh cycle the changes that were found at some positions of it.

    Their difference has no more harmonics than these positions can tell apart, and no mean: finer harmonics stay those
    that are known.

    Parameters
    ----------
    known : (n,) at pmc = 0, 1/n, ..
    found : tuple of k floats
        At pmc = 0, 1/k, ...

    Returns
    -------
    (n,) with the mean of `known`

    Examples
    --------
    >>> cycle = 2.0 * np.pi * np.arange(20) / 20
    >>> fine = 3.0 + np.cos(7 * cycle)
    >>> found = tuple(fine[::2] + 0.5 + np.cos(2 * cycle[::2]))
    >>> np.allclose(changed_over_cycle(fine, found), fine + np.cos(2 * cycle))
    True
    """
    count = len(samples)
    size = len(known)
    there = np.interp(np.arange(count) / count, np.arange(size) / size, known, period=1.0)
    spectrum = np.fft.rfft(np.array(samples) - there) / count
    spectrum[0] = 0.0
    spectrum[(count + 1) // 2 :] = 0.0
    return np.asarray(known + size * np.fft.irfft(spectrum, size))


def even_contact(pair: GearPair, force: float, stiffness: float, tangent_stiffness: float) -> ContactState:
    """Contact of teeth that are equally stiff all along the common face and bear evenly, so that kg = k b^2 / 12.

    Parameters
    ----------
    force : N
    stiffness, tangent_stiffness
        Load over deflection, and the slope of the load: that is what a tilt at constant load works against, N/m.
    """
    tilt_stiffness = tangent_stiffness * pair.face_width**2 / 12.0
    return ContactState(force, force / stiffness, tangent_stiffness, 0.0, 0.0, 0.0, tilt_stiffness)
