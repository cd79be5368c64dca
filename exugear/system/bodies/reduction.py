"""Reduction of flexible bodies: six coordinates at each seat, and a few internal modal coordinates.

A seat is where a gear or a bearing sits. Its six coordinates are the rigid motion nearest to that of its surface, so
that meshes and bearings treat a seat as a rigid body. A body's displacement is a sum of component modes:

constraint modes
    One per seat coordinate: the shape of minimum strain energy with this coordinate at 1 and the others at 0.
inertia-relief modes
    Deformation of the body between fixed seats under rigid accelerations. With them every static deflection is exact,
    including that of an accelerating body.
free-interface normal modes
    Elastic vibrations of the free body up to a frequency, minus the constraint modes with the same motion of the seats;
    they are then exact.

The form with physical coordinates at the seats is that of Craig and Bampton (AIAA Journal 6, 1968), who take
fixed-interface normal modes; with inertia-relief and free-interface modes it is that of Hintz (AIAA Journal 13, 1975)
and Herting (Finite Elements in Analysis and Design 1, 1985).

A rotating shaft is described in a non-rotating frame (`frame` "nonrotating"): as it is axially symmetric, its matrices
are constant there, M q'' + Omega G q' + K q = f. No coordinate is needed for its spin: the common part of the seats'
turning about z is the spin, with Omega = r' M q' / (r' M r) for the rigid spin r.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import scipy
import scipy.linalg
from numpy.typing import NDArray

from exugear.system.bodies.matrix_files.interface import rigid_motions
from exugear.system.kernels.coordinates import AXIAL, TILT
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.stores import Store

if TYPE_CHECKING:
    from fe_ste.elimination import Backend, Factorisation

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
class BodySurface:
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
class RadiatingSurface:
    """Outer surface of a reduced body, for the sound that it radiates; n coordinates."""

    matrix: Floats
    """(n, n) integral of (n . u)(n . u)^T over the surface, with the normal displacement n . u per coordinate, m2."""
    area: float
    """Of the outer surface, with the discs that close its openings, m2."""
    whole_area: float
    """Of the whole surface of the solid, inside and outside, m2."""
    band: float
    """Cut-off frequency of the reduction, Hz."""


@dataclass(frozen=True)
class ReductionSummary:
    """What a reduction took and which modes it kept, by harmonic, or under "whole" for a solid mesh."""

    unknowns: Mapping[str, int]
    """Number of unknowns; empty for matrices of another program."""
    seconds: float
    """Wall time."""
    free_interface_frequencies: Mapping[str, tuple[float, ...]]
    """Of the elastic normal modes that are kept, and the next one, Hz."""
    mass_scaled_frequencies: Mapping[str, tuple[float, ...]]
    """Of modes of the reduced body above the limit before mass scaling brought them to it, Hz."""


@dataclass(frozen=True)
class ReducedBody(
    ReprMixin,
    line=" {name}: {seats!n} seats, {modal_groups!n} modal coordinates, {rigid_inertia.mass:.4g} kg, frame {frame}",
):
    """A reduced flexible body; n coordinates.

    Coordinates are six per seat (ux uy uz, tilts thx thy, and thz unwrapped; m and rad), then the modal coordinates
    of the internal modes.
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
    surface: BodySurface
    """For pictures."""
    summary: ReductionSummary
    """What the reduction took and which modes it kept."""
    radiating: RadiatingSurface | None = None
    """Outer surface of a solid on the ground; None for other bodies."""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.spin)

    @property
    def origin(self) -> str:
        """What the body was reduced from, in words."""
        unknowns = sum(self.summary.unknowns.values())
        return (
            f"{unknowns} unknowns reduced to {self.size} coordinates"
            if unknowns
            else f"matrices of {self.size} coordinates"
        )

    @cached_property
    def blocks(self) -> tuple[Integers, ...]:
        """Coordinates that neither mass nor stiffness couples to others: both bending planes, torsion, stretching."""
        import scipy.sparse.csgraph  # a tenth of a second that a gearbox without elastic bodies need not wait

        joined = scipy.sparse.csr_array((self.mass != 0.0) | (self.stiffness != 0.0))
        count, label = scipy.sparse.csgraph.connected_components(joined, directed=False)
        return tuple(np.flatnonzero(label == n) for n in range(count))

    def rigid_motions(self, centre: Sequence[float] | Floats) -> Floats:
        """Rigid motions (n, 6): translations, and turns about a centre (3,) in the gearbox's coordinates."""
        return rigid_motions(self.size, [seat.position for seat in self.seats], centre)

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


MOST_LANCZOS_STEPS = 1000
"""Lanczos steps after which the search for normal modes is given up: some three steps find one mode."""
ROWS_AT_A_TIME = 100
"""Lanczos vectors for which memory is reserved at once."""
CHECKED_EACH, CHECK_EVERY = 100, 10
"""Steps up to which convergence is checked after each; after so many each beyond."""
LANCZOS_TOLERANCE = 1e-9
"""Relative residual of a normal mode; its frequency is then exact to the square of it."""
INDEPENDENCE_TOLERANCE = 1e-8
"""Share of a normal mode that the constraint modes must leave over for it to count as a shape of its own."""


@dataclass(frozen=True)
class ReducedComponent:
    """One set of unknowns reduced: (s + m) coordinates, those of the seats first, then the modal ones."""

    mass: Floats
    stiffness: Floats
    """(s + m, s + m)"""
    component_modes: Floats
    """(unknowns, s + m) displacement per coordinate."""
    frequencies: tuple[float, ...]
    """Of the elastic free-interface normal modes that are kept, and the next one, Hz."""


def reduce_component(
    mass: SparseMatrix,
    stiffness: SparseMatrix,
    seats: Floats,
    rigid: Floats,
    blanks: Floats,
    band: float,
    backend: Backend | None = "superlu",
) -> ReducedComponent:
    """Reduce a free elastic structure to its seats' coordinates and modal coordinates.

    Parameters
    ----------
    mass, stiffness : (n, n)
    seats : (s, n) seat coordinates as averages of the unknowns
    rigid : (n, k) all rigid motions
    blanks : (s, s) rigid masses on the seats
    band
        All free-interface normal modes up to this frequency (Hz) become exact; modes on bearings come out to 1e-4 up
        to two thirds of it.
    backend : {"superlu", "pardiso"}, optional
        SuperLU gives the same digits in every run, PARDISO's threads do not; None is the fastest installed.

    Raises
    ------
    ReductionError
        The seats leave a rigid motion free.
    """
    moved = seats @ rigid
    if np.linalg.matrix_rank(moved) < rigid.shape[1]:
        raise ReductionError("the seats do not constrain all rigid-body motions; define at least one more seat")
    constraint, relief = constraint_and_inertia_relief_modes(mass, stiffness, seats, rigid, backend)
    rows = scipy.sparse.csr_array(seats)
    loaded_mass = scipy.sparse.csr_array(mass + rows.T @ scipy.sparse.csr_array(blanks) @ rows)
    normal, frequencies = free_interface_modes(loaded_mass, stiffness, rigid, (np.pi * band) ** 2, band, backend)
    # Less the constraint modes that move the seats alike, a normal mode leaves the seats where they are.
    inner = np.hstack([normal - constraint @ (seats @ normal), relief])
    # Shapes that span the same, uncoupled from each other, of unit modal mass.
    inner = inner / np.sqrt(np.einsum("im,im->m", inner, mass @ inner))
    share, axes = np.linalg.eigh(inner.T @ (mass @ inner))
    # Shapes that others span already have no mass of their own.
    independent = share > INDEPENDENCE_TOLERANCE
    inner = inner @ (axes[:, independent] / np.sqrt(share[independent]))
    _, axes = np.linalg.eigh(inner.T @ (stiffness @ inner))
    modes = np.hstack([constraint, inner @ axes])
    count = len(seats)
    reduced_mass = modes.T @ (mass @ modes)
    reduced_mass[:count, :count] += blanks
    # Leaves out of the seats' motion what is rigid, so that it stores no energy at all.
    deforming = np.eye(modes.shape[1])
    deforming[:count, :count] -= moved @ np.linalg.lstsq(moved, np.eye(count))[0]
    reduced_stiffness = deforming.T @ (modes.T @ (stiffness @ modes)) @ deforming
    return ReducedComponent(symmetric(reduced_mass), symmetric(reduced_stiffness), modes, frequencies)


def constraint_and_inertia_relief_modes(
    mass: SparseMatrix, stiffness: SparseMatrix, seats: Floats, rigid: Floats, backend: Backend | None = "superlu"
) -> tuple[Floats, Floats]:
    """Constraint modes (n, s), each with one seat coordinate at 1, and inertia-relief modes (n, k) between fixed seats.

    Loads at the seats and rigid accelerations that balance each other act on the body held by springs at as many
    unknowns as it has rigid motions, F the inverse: these springs then carry nothing. The forces at the seats follow
    from the motion of the seats, B (F B^T l + R a) = d with R^T B^T l = 0. An inertia-relief mode is what one rigid
    acceleration does, B u = 0; without it the modes know only loads in balance among the seats.
    """
    held_at = scipy.linalg.qr(rigid.T, mode="r", pivoting=True)[1][: rigid.shape[1]]
    springs = np.zeros(len(rigid))
    springs[held_at] = stiffness.diagonal().mean()
    from fe_ste.elimination import factorise

    with factorise(scipy.sparse.csr_array(stiffness + scipy.sparse.diags_array(springs)), backend) as held:
        deflections = held.solve(np.hstack([seats.T, mass @ rigid]))
    by_force = deflections[:, : len(seats)]
    by_acceleration = deflections[:, len(seats) :]
    moved = seats @ rigid
    count, motions = moved.shape
    # Compliances and rigid motions differ by ten powers of ten: both unknowns are scaled to one.
    scale = np.sqrt(np.diag(seats @ by_force))
    saddle = np.zeros((count + motions, count + motions))
    saddle[:count, :count] = (seats @ by_force) / np.outer(scale, scale)
    saddle[:count, count:] = moved / scale[:, None]
    saddle[count:, :count] = saddle[:count, count:].T
    # Unit motions of the seats on the left, seats at rest under unit rigid accelerations on the right.
    prescribed = np.zeros((count + motions, count + motions))
    prescribed[:count, :count] = np.diag(1.0 / scale)
    prescribed[:count, count:] = -(seats @ by_acceleration) / scale[:, None]
    prescribed[count:, count:] = -(rigid.T @ (mass @ rigid))
    unknowns = np.linalg.solve(saddle, prescribed)
    shapes = by_force @ (unknowns[:count] / scale[:, None]) + rigid @ unknowns[count:]
    relief = by_acceleration + shapes[:, count:]
    constraint = shapes[:, :count]
    # Rigid motions of the seats make rigid motions of the body to the last digit.
    constraint += (rigid - constraint @ moved) @ np.linalg.lstsq(moved, np.eye(count))[0]
    return constraint, relief - constraint @ (seats @ relief)


def free_interface_modes(
    mass: SparseMatrix,
    stiffness: SparseMatrix,
    rigid: Floats,
    shift: float,
    band: float,
    backend: Backend | None = "superlu",
) -> tuple[Floats, tuple[float, ...]]:
    """Elastic normal modes (n, m) of the free body up to `band` (Hz), and their frequencies and the next one.

    Lanczos steps with (K + shift M)^-1, every vector held orthogonal to the rigid motions and to all before it. They
    find one mode of each frequency; equal ones come in further sweeps, until one finds none in the band.

    Raises
    ------
    ReductionError
        More modes in the band than `MOST_LANCZOS_STEPS` can find.
    """
    known = rigid @ np.linalg.inv(np.linalg.cholesky(rigid.T @ (mass @ rigid))).T
    frequencies: list[float] = []
    random = np.random.default_rng(1)
    from fe_ste.elimination import factorise

    with factorise(scipy.sparse.csr_array(stiffness + shift * mass), backend) as shifted:
        while True:
            start = random.standard_normal(len(rigid))
            swept, shapes = _lanczos_sweep(mass, shifted, known, start, shift, band)
            inside = swept < band
            frequencies += swept[inside].tolist()
            known = np.hstack([known, shapes[:, inside]])
            if not inside.any():
                order = np.argsort(frequencies)
                return known[:, rigid.shape[1] :][:, order], (*sorted(frequencies), float(swept[0]))


def _lanczos_sweep(
    mass: SparseMatrix, shifted: Factorisation, known: Floats, start: Floats, shift: float, band: float
) -> tuple[Floats, Floats]:
    """Frequencies (Hz) up to the first beyond the band, and shapes, of what is orthogonal to the known ones."""
    count = known.shape[1]
    basis = np.concatenate([known.T, np.empty((ROWS_AT_A_TIME, len(start)))])
    diagonal: list[float] = []
    beside: list[float] = []
    vector = start
    while len(diagonal) < MOST_LANCZOS_STEPS:
        size = count + len(diagonal)
        before = basis[:size]
        for _ in range(2):  # once leaves round-off of the first pass
            vector = vector - (before @ (mass @ vector)) @ before
        image = mass @ vector
        length = float(np.sqrt(vector @ image))
        if diagonal:
            beside.append(length)
            # The eigenvalues of many steps cost more than a few more steps.
            if len(diagonal) < CHECKED_EACH or len(diagonal) % CHECK_EVERY == 0:
                converged = _converged(diagonal, beside, shift, band)
                if converged is not None:
                    frequencies, weights = converged
                    return frequencies, before[count:].T @ weights
        if size == len(basis):
            basis = np.concatenate([basis, np.empty((ROWS_AT_A_TIME, len(start)))])
        basis[size] = vector / length
        image /= length
        vector = shifted.solve(image)
        diagonal.append(float(image @ vector))
    raise ReductionError(
        f"more normal modes below {band:g} Hz than {MOST_LANCZOS_STEPS} steps find; set a lower band_Hz"
    )


def _converged(diagonal: list[float], beside: list[float], shift: float, band: float) -> tuple[Floats, Floats] | None:
    """Frequencies (Hz) up to the first beyond the band, and their weights (steps, f), once all are at round-off."""
    matrix = np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    values, vectors = np.linalg.eigh(matrix)
    values = values[::-1]
    vectors = vectors[:, ::-1]
    frequencies = np.sqrt(np.maximum(1.0 / np.maximum(values, 1e-300) - shift, 0.0)) / (2.0 * np.pi)
    needed = int(np.count_nonzero(frequencies < band)) + 1
    if needed > len(values):
        return None
    residual = beside[-1] * np.abs(vectors[-1, :needed]) / values[:needed]
    if residual.max() < LANCZOS_TOLERANCE:
        return (frequencies[:needed], vectors[:, :needed])
    return None


def symmetric(matrix: Floats) -> Floats:
    """Symmetric part of a matrix, free of the round-off of products."""
    return 0.5 * (matrix + matrix.T)


def selective_mass_scaling(mass: Floats, stiffness: Floats, limit: float) -> tuple[Floats, tuple[float, ...]]:
    """Mass matrix in which modes above `limit` (Hz) have mass added until they are at it, and the frequencies they had.

    Only the step of an explicit solver would feel these modes. Mass is added in their shapes phi alone:
    M + sum (w^2 / w_limit^2 - 1) M phi (M phi)'. The other modes and all static deflections stay as they are.
    The method for explicit finite elements is that of Olovsson, Simonsson and Unosson (International Journal for
    Numerical Methods in Engineering 63, 2005); here the modes are known, so that it is exact. Motions without mass, as
    matrices of other programs may have, get that of the limit.

    Examples
    --------
    >>> mass, scaled = selective_mass_scaling(np.eye(2), np.diag([4.0, 9.0]) * np.pi**2, 1.2)
    >>> [round(frequency, 12) for frequency in scaled], np.diag(mass).round(12)
    ([1.5], array([1.    , 1.5625]))
    """
    shift = (2.0 * np.pi * limit) ** 2
    # Of this pencil all eigenvalues 1 / (w^2 + shift) are finite, those of motions without mass are zero.
    pencil = stiffness + shift * mass
    values, shapes = scipy.linalg.eigh(mass, pencil)
    high = values < 0.5 / shift
    momenta = pencil @ shapes[:, high]
    added = (momenta * (1.0 / shift - 2.0 * values[high])) @ momenta.T
    with np.errstate(divide="ignore"):
        ratio = 1.0 / (np.maximum(values[high], 0.0) * shift) - 1.0
    return mass + added, tuple(float(f) for f in limit * np.sqrt(ratio[::-1]))


def rigid_gyroscopic_matrix(inertia: RigidInertia, frame: Frame) -> Floats:
    """Matrix G (6, 6) of a rigid body's translations and tilts about its centre of mass, seen from a frame.

    In a frame that does not turn a tilt has the axial inertia. In its own, 2 int rho phi_i . (e_z x phi_j): a
    translation has twice the mass, a tilt -(Ix + Iy - Iz).
    """
    matrix = np.zeros((6, 6))
    if frame == "nonrotating":
        matrix[3, 4] = inertia.axial
    elif frame == "carrier":
        matrix[0, 1], matrix[3, 4] = -2.0 * inertia.mass, inertia.axial - 2.0 * inertia.transverse
    return matrix - matrix.T


ASYMMETRY_TOLERANCE = 5e-3
"""Relative change of the seats' mass or stiffness by rotation through 90 degrees above which a body is not a body of
revolution.
"""
OFF_AXIS = 1e-6
"""Distance of a seat from the axis, m, beyond which a body is not a body of revolution."""


def check_revolution(
    name: str,
    seats: Sequence[tuple[float, float, float]],
    axis: tuple[float, float],
    mass: Floats,
    stiffness: Floats,
) -> None:
    """Raise an error if rotation through 90 degrees changes a body, or if its seats are not on the axis.

    Parameters
    ----------
    seats : positions, m
    axis : position x, y of the axis of rotation, m
    mass, stiffness : (n, n) with the coordinates of the seats first

    Raises
    ------
    ReductionError
        The body is not a body of revolution.
    """
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    count = 6 * len(seats)
    turn = np.kron(np.eye(count // 3), quarter)
    distance = max(float(np.hypot(seat[0] - axis[0], seat[1] - axis[1])) for seat in seats)
    if distance > OFF_AXIS:
        raise ReductionError(
            f"body {name}: a seat is {1e3 * distance:.3g} mm off the axis, but 'nonrotating' requires a body of "
            "revolution; move it to the axis, or remove it"
        )
    for matrix_name, matrix in (("mass", mass), ("stiffness", stiffness)):
        at_seats = matrix[:count, :count]
        # Entries differ in unit, so that each is compared with the diagonal entries of its row and column.
        diagonal = np.sqrt(np.maximum(at_seats.diagonal(), np.abs(turn) @ at_seats.diagonal()))
        change = float((np.abs(turn @ at_seats @ turn.T - at_seats) / np.outer(diagonal, diagonal)).max())
        if change > ASYMMETRY_TOLERANCE:
            raise ReductionError(
                f"body {name}: a rotation by 90 degrees changes its {matrix_name} by {change:.1e}, but 'nonrotating' "
                "requires a body of revolution; refine the mesh, or describe the shaft by a [.shape] table"
            )


def with_rigid_inertia(body: ReducedBody, wanted: RigidInertia) -> ReducedBody:
    """Give a body the rigid inertia of another model of it; its free elastic modes stay as they are.

    The difference rides on the rigid part of the motion, M + M R A R' M with R the rigid motions about the wanted
    centre and A so that R' M R becomes the wanted inertia; elastic modes are orthogonal to R. Gyroscopic forces
    become those of the wanted inertia likewise, in the frame of the body.
    """
    motions = body.rigid_motions(wanted.centre)
    momenta = body.mass @ motions
    inverse_inertia = np.linalg.inv(motions.T @ momenta)
    target = np.diag([wanted.mass] * 3 + [wanted.transverse] * 2 + [wanted.axial])
    difference = inverse_inertia @ target @ inverse_inertia - inverse_inertia
    mass = body.mass + momenta @ difference @ momenta.T
    missing = rigid_gyroscopic_matrix(wanted, body.frame) - motions.T @ body.gyroscopic @ motions
    gyroscopic = body.gyroscopic + momenta @ (inverse_inertia @ missing @ inverse_inertia) @ momenta.T
    return replace(body, mass=symmetric(mass), gyroscopic=0.5 * (gyroscopic - gyroscopic.T))


# Reductions of elastic bodies, stored in files by the hash of their input


def load_or_reduce(path: Path, key: str, reduce: Callable[[], ReducedBody]) -> ReducedBody:
    """Body from a file, or reduced and stored there if the file is missing, damaged or of another key.

    Parameters
    ----------
    key : hash of all that the reduction depends on
    reduce : called only where the file does not serve
    """
    store = Store(path, key)
    body = store.read(_from_arrays)
    if body is None:
        body = reduce()
        words = {
            "name": body.name,
            "seats": [[seat.name, seat.position] for seat in body.seats],
            "frame": body.frame,
            "groups": body.modal_groups,
            "figures": {stored: getattr(body.summary, name) for stored, name in _SUMMARY.items()},
        }
        arrays = {name: getattr(body, name) for name in _MATRICES}
        arrays |= {name: getattr(body.surface, name) for name in _SURFACE}
        if body.radiating is not None:
            arrays |= {f"radiating_{name}": np.array(getattr(body.radiating, name)) for name in _RADIATING}
        store.write({"words": np.array(json.dumps(words)), **arrays}, compressed=True)
    return body


_MATRICES = ("mass", "stiffness", "gyroscopic", "spin")
_SURFACE = ("points", "quads", "displacement", "strain", "elasticity")
_RADIATING = ("matrix", "area", "whole_area", "band")
_SUMMARY = {
    "unknowns": "unknowns",
    "seconds": "seconds",
    "free_frequencies": "free_interface_frequencies",
    "lowered": "mass_scaled_frequencies",
}
"""Names in files, which stay so that old files are found again, and in `ReductionSummary`."""


def _from_arrays(arrays: Mapping[str, NDArray[Any]]) -> ReducedBody:
    words = json.loads(str(arrays["words"]))
    summary = {name: words["figures"][stored] for stored, name in _SUMMARY.items()}
    for name in ("free_interface_frequencies", "mass_scaled_frequencies"):
        summary[name] = {harmonic: tuple(values) for harmonic, values in summary[name].items()}
    radiating = None
    if "radiating_matrix" in arrays:
        matrix, *sizes = (arrays[f"radiating_{name}"] for name in _RADIATING)
        radiating = RadiatingSurface(matrix, *(float(size) for size in sizes))
    return ReducedBody(
        name=words["name"],
        seats=tuple(Seat(name, (x, y, z)) for name, (x, y, z) in words["seats"]),
        **{name: arrays[name] for name in _MATRICES},
        frame=words["frame"],
        modal_groups=tuple(words["groups"]),
        surface=BodySurface(**{name: arrays[name] for name in _SURFACE}),
        summary=ReductionSummary(**summary),
        radiating=radiating,
    )
