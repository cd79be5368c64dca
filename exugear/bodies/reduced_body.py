"""An elastic body reduced to seats and modal coordinates: what every way of reducing gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.sparse.csgraph
from numpy.typing import NDArray

from fe_ste.tools.arrays import Floats

Frame = Literal["nonrotating", "carrier", "ground"]


class ReductionError(ValueError):
    """A body that cannot be reduced as asked."""


@dataclass(frozen=True)
class Seat:
    """A place on a body that other things are fixed to.

    Attributes
    ----------
    name : str
    place : (3,) centre in the gearbox's coordinates at zero angles, m
    """

    name: str
    place: tuple[float, float, float]


@dataclass(frozen=True)
class Blank:
    """A rigid ring on a seat, such as a gear blank: kg, and kg m2 about its centre."""

    mass: float
    transverse: float
    axial: float


@dataclass(frozen=True)
class Surface:
    """The surface of a reduced body for pictures.

    Attributes
    ----------
    points : (p, 3) at zero angles, m
    quads : (f, 4) corners of each face; a triangle repeats its last
    displacement : (p, 3, n) per coordinate
    strain : (f, 6, n) per coordinate, in orthogonal axes (those of each face, or x y z), engineering shear strains
    elasticity : (6, 6) stress by strain, Pa
    """

    points: Floats
    quads: NDArray[np.int64]
    displacement: NDArray[np.float32]
    strain: NDArray[np.float32]
    elasticity: Floats

    def energy_density(self, coordinates: Floats) -> Floats:
        """Strain energy per volume on each face, (f,), J/m3, at coordinates (n,)."""
        strain = self.strain @ coordinates
        density: Floats = 0.5 * np.einsum("fs,st,ft->f", strain, self.elasticity, strain)
        return density


@dataclass(frozen=True)
class Figures:
    """What a reduction took and found.

    Attributes
    ----------
    unknowns : number of unknowns by harmonic, or "whole" for a solid mesh
    seconds : wall time
    free_frequencies : by harmonic, elastic free vibrations of the whole model that are kept, and the next one, Hz
    lowered : by harmonic, frequencies of the reduced body above the limit that were lowered to it, Hz
    """

    unknowns: Mapping[str, int]
    seconds: float
    free_frequencies: Mapping[str, tuple[float, ...]]
    lowered: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class ReducedBody:
    """A reduced elastic body; n coordinates.

    Coordinates are six per seat (ux uy uz, tilts thx thy, and thz unwrapped; m and rad), then the inner amplitudes.

    Attributes
    ----------
    name, seats : what it is, and its seats in the order of the coordinates
    mass, stiffness : (n, n)
    gyroscopic : (n, n) antisymmetric G of M q'' + Omega G q' + K q = f
    spin : (n,) rigid spin about the axis: 1 on every seat's thz, and how it displaces seats off the axis, m; 0 for a
        body on the ground, which does not turn
    frame : where the coordinates are seen from: a frame that does not turn, the carrier's, or the ground
    groups : names of the inner amplitudes: bending x, bending y, torsion or stretching; of a solid mesh, inner
    surface : for pictures
    figures : what the reduction took and found
    """

    name: str
    seats: tuple[Seat, ...]
    mass: Floats
    stiffness: Floats
    gyroscopic: Floats
    spin: Floats
    frame: Frame
    groups: tuple[str, ...]
    surface: Surface
    figures: Figures

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.spin)

    def seat(self, name: str) -> int:
        """Find the first coordinate of a seat.

        Raises
        ------
        ReductionError
            No seat of that name.
        """
        for n, seat in enumerate(self.seats):
            if seat.name == name:
                return 6 * n
        raise ReductionError(f"body {self.name}: no seat {name!r}; seats are {', '.join(s.name for s in self.seats)}")

    @cached_property
    def blocks(self) -> tuple[NDArray[np.int64], ...]:
        """Coordinates that neither mass nor stiffness couples to others: both bending planes, torsion, stretching."""
        joined = scipy.sparse.csr_array((self.mass != 0.0) | (self.stiffness != 0.0))
        count, label = scipy.sparse.csgraph.connected_components(joined, directed=False)
        return tuple(np.flatnonzero(label == n) for n in range(count))

    def rigid_motions(self, centre: Sequence[float] | Floats) -> Floats:
        """Rigid motions (n, 6): translations, and turns about a centre (3,) in the gearbox's coordinates."""
        motions = np.zeros((self.size, 6))
        for n, seat in enumerate(self.seats):
            x, y, z = np.asarray(seat.place) - np.asarray(centre)
            motions[6 * n : 6 * n + 6] = np.eye(6)
            motions[6 * n : 6 * n + 3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        return motions

    @cached_property
    def rigid_inertia(self) -> RigidInertia:
        """Mass, centre of mass and inertias of the rigid body that this is."""
        origin = np.array(self.seats[0].place)
        about = self.rigid_motions(origin)
        moments = about.T @ self.mass @ about
        mass = float(moments[0, 0])
        x, y, z = (float(moments[i, j]) / mass for i, j in ((1, 5), (2, 3), (0, 4)))
        about = self.rigid_motions(origin + (x, y, z))
        inertia = np.diag(about.T @ self.mass @ about)
        transverse = float(inertia[3] + inertia[4]) / 2.0
        place = tuple((origin + (x, y, z)).tolist())
        return RigidInertia(mass, (place[0], place[1], place[2]), transverse, float(inertia[5]))

    @cached_property
    def free_frequencies(self) -> Floats:
        """Frequencies of the reduced body, free and at rest, elastic ones only, Hz."""
        values = scipy.linalg.eigh(self.stiffness, self.mass, eigvals_only=True)
        return np.sqrt(np.maximum(values[6:], 0.0)) / (2.0 * np.pi)


@dataclass(frozen=True)
class RigidInertia:
    """Mass properties of a rigid body: kg, centre (3,) m, kg m2 about the centre across z (mean) and about z."""

    mass: float
    centre: tuple[float, float, float]
    transverse: float
    axial: float
