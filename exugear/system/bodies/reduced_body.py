"""An elastic body reduced to seats and modal coordinates: what every way of reducing gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from exugear.system.kernels.coordinates import AXIAL, BODY_SIZE, TILT
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import Displayed

Frame = Literal["nonrotating", "carrier", "ground"]
"""Where coordinates are seen from: a frame that does not turn, the carrier's own, or the ground."""
UX, UY, UZ, TILT_X, TILT_Y = 0, 1, AXIAL, TILT, TILT + 1
"""Coordinates of a seat before its spin: displacement, and tilts about x and y."""
ELASTIC = slice(6, None)
"""Normal modes of a free body in order of frequency that are elastic: the first six are its rigid motions."""


class ReductionError(ValueError):
    """A body that cannot be reduced as asked."""


@dataclass(frozen=True)
class Seat:
    """Where other things are fixed to a body."""

    name: str
    position: tuple[float, float, float]
    """(3,) centre in the gearbox's coordinates at zero angles, m."""


@dataclass(frozen=True)
class Blank:
    """A rigid ring on a seat, such as a gear blank: kg, and kg m2 about its centre."""

    mass: float
    transverse: float
    axial: float


@dataclass(frozen=True)
class Surface:
    """The surface of a reduced body for pictures."""

    points: Floats
    """(p, 3) at zero angles, m."""
    quads: Integers
    """(f, 4) corners of each face; a triangle repeats its last."""
    displacement: NDArray[np.float32]
    """(p, 3, n) per coordinate."""
    strain: NDArray[np.float32]
    """(f, 6, n) per coordinate, in orthogonal axes (those of each face, or x y z), engineering shear strains."""
    elasticity: Floats
    """(6, 6) stress by strain, Pa."""

    def energy_density(self, coordinates: Floats) -> Floats:
        """Strain energy per volume on each face, (f,), J/m3, at coordinates (n,)."""
        strain = self.strain @ coordinates
        density: Floats = 0.5 * np.einsum("fs,st,ft->f", strain, self.elasticity, strain)
        return density


@dataclass(frozen=True)
class ReductionSummary:
    """What a reduction took and which modes it kept, by harmonic, or under "whole" for a solid mesh."""

    unknowns: Mapping[str, int]
    """Number of unknowns."""
    seconds: float
    """Wall time."""
    free_interface_frequencies: Mapping[str, tuple[float, ...]]
    """Of the elastic normal modes that are kept, and the next one, Hz."""
    mass_scaled_frequencies: Mapping[str, tuple[float, ...]]
    """Of modes of the reduced body above the limit before mass scaling brought them to it, Hz."""


@dataclass(frozen=True)
class ReducedBody(
    Displayed,
    line=" {name}: {seats!n} seats, {modal_groups!n} modal coordinates, {rigid_inertia.mass:.4g} kg, frame {frame}",
):
    """A reduced elastic body; n coordinates.

    Coordinates are six per seat (ux uy uz, tilts thx thy, and thz unwrapped; m and rad), then the modal coordinates
    of the modes inside (`exugear.system.bodies.reduction`).
    """

    name: str
    seats: tuple[Seat, ...]
    """What it is, and its seats in the order of the coordinates."""
    mass: Floats
    stiffness: Floats
    """(n, n)"""
    gyroscopic: Floats
    """(n, n) antisymmetric G of M q'' + Omega G q' + K q = f."""
    spin: Floats
    """(n,) rigid spin about the axis: 1 on every seat's thz, and how it displaces seats off the axis, m; 0 for a:
    body on the ground, which does not turn."""
    frame: Frame
    """Where the coordinates are seen from: a frame that does not turn, the carrier's, or the ground."""
    modal_groups: tuple[str, ...]
    """What each modal coordinate describes: bending x, bending y, torsion or stretching; of a solid mesh,. inner."""
    surface: Surface
    """For pictures."""
    summary: ReductionSummary
    """What the reduction took and which modes it kept."""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.spin)

    def first_coordinate(self, seat_name: str) -> int:
        """Find the first of a seat's six coordinates.

        Raises
        ------
        ReductionError
            No seat of that name.
        """
        for n, seat in enumerate(self.seats):
            if seat.name == seat_name:
                return BODY_SIZE * n
        names = ", ".join(seat.name for seat in self.seats)
        raise ReductionError(f"body {self.name}: no seat {seat_name!r}; seats are {names}")

    @cached_property
    def blocks(self) -> tuple[Integers, ...]:
        """Coordinates that neither mass nor stiffness couples to others: both bending planes, torsion, stretching."""
        import scipy.sparse.csgraph  # a tenth of a second that a gearbox without elastic bodies need not wait

        joined = scipy.sparse.csr_array((self.mass != 0.0) | (self.stiffness != 0.0))
        count, label = scipy.sparse.csgraph.connected_components(joined, directed=False)
        return tuple(np.flatnonzero(label == n) for n in range(count))

    def rigid_motions(self, centre: Sequence[float] | Floats) -> Floats:
        """Rigid motions (n, 6): translations, and turns about a centre (3,) in the gearbox's coordinates."""
        motions = np.zeros((self.size, 6))
        for n, seat in enumerate(self.seats):
            x, y, z = np.asarray(seat.position) - np.asarray(centre)
            motions[6 * n : 6 * n + 6] = np.eye(6)
            motions[6 * n : 6 * n + 3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        return motions

    @cached_property
    def rigid_inertia(self) -> RigidInertia:
        """Mass, centre of mass and inertias of the rigid body that this is."""
        origin = np.array(self.seats[0].position)
        about_seat = self.rigid_motions(origin)
        moments = about_seat.T @ self.mass @ about_seat
        mass = float(moments[0, 0])
        # A turn about one axis moves the centre of mass along another: the first moments couple both.
        x, y, z = (float(moments[i, j]) / mass for i, j in ((1, 5), (2, 3), (0, 4)))
        about_centre = self.rigid_motions(origin + (x, y, z))
        inertia = np.diag(about_centre.T @ self.mass @ about_centre)
        transverse = float(inertia[3] + inertia[4]) / 2.0
        centre = tuple((origin + (x, y, z)).tolist())
        return RigidInertia(mass, (centre[0], centre[1], centre[2]), transverse, float(inertia[5]))

    @cached_property
    def free_frequencies(self) -> Floats:
        """Frequencies of the reduced body's elastic normal modes, free and at rest, Hz."""
        values = scipy.linalg.eigh(self.stiffness, self.mass, eigvals_only=True)
        return np.sqrt(np.maximum(values[ELASTIC], 0.0)) / (2.0 * np.pi)


@dataclass(frozen=True)
class RigidInertia:
    """Mass properties of a rigid body: kg, centre (3,) m, kg m2 about the centre across z (mean) and about z."""

    mass: float
    centre: tuple[float, float, float]
    transverse: float
    axial: float
