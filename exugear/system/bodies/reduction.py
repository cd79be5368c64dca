"""Reduction of elastic bodies: six coordinates at each seat, and a few modal coordinates inside.

A seat is where a gear or a bearing sits. Its six coordinates are the rigid motion nearest to that of its surface, so
that a seat looks to a mesh or a bearing like a rigid body. A body's displacement is a sum of component modes:

constraint modes
    One per seat coordinate: the shape of least strain energy with this coordinate at 1 and the others at 0.
inertia-relief modes
    What rigid accelerations do to the body between seats that do not move. With them every static deflection is exact,
    that of a body which accelerates included.
free-interface normal modes
    Elastic vibrations of the free body up to a frequency, less the constraint modes that move the seats alike; they
    are exact then.

The form with physical coordinates at the seats is that of Craig and Bampton (AIAA Journal 6, 1968), who take
fixed-interface normal modes; with inertia-relief and free-interface modes it is that of Hintz (AIAA Journal 13, 1975)
and Herting (Finite Elements in Analysis and Design 1, 1985).

A shaft that turns is described in a frame that does not (`frame` "nonrotating"): as it is axially symmetric, its
matrices are constant there, M q'' + Omega G q' + K q = f. No coordinate is needed for its spin: the common part of
the seats' turning about z is the spin, with Omega = r' M q' / (r' M r) for the rigid spin r.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy

from exugear.system.bodies.reduced_body import Frame, ReducedBody, ReductionError, RigidInertia
from fe_ste.tools.arrays import Floats, SparseMatrix

if TYPE_CHECKING:
    from fe_ste.elimination.sparse import Backend, Factorisation

MOST_LANCZOS_STEPS = 150
"""Lanczos steps after which the search for normal modes is given up."""
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
        raise ReductionError("the seats do not hold all rigid motions; give at least one more seat")
    constraint, relief = constraint_and_inertia_relief_modes(mass, stiffness, seats, rigid, backend)
    rows = scipy.sparse.csr_array(seats)
    loaded_mass = scipy.sparse.csr_array(mass + rows.T @ scipy.sparse.csr_array(blanks) @ rows)
    normal, frequencies = free_interface_modes(loaded_mass, stiffness, rigid, (np.pi * band) ** 2, band, backend)
    # Less the constraint modes that move the seats alike, a normal mode leaves the seats where they are.
    inner = np.hstack([normal - constraint @ (seats @ normal), relief])
    modes = np.hstack([constraint, _uncoupled(mass, stiffness, inner)])
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
    from fe_ste.elimination.sparse import factorise

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
    from fe_ste.elimination.sparse import factorise

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
    basis = [*known.T]
    images = [*(mass @ known).T]
    count = len(basis)
    diagonal: list[float] = []
    beside: list[float] = []
    vector = start
    while len(diagonal) < MOST_LANCZOS_STEPS:
        before = np.array(basis)
        image = np.array(images)
        for _ in range(2):  # once leaves round-off of the first pass
            vector = vector - before.T @ (image @ vector)
        vector_image = mass @ vector
        length = float(np.sqrt(vector @ vector_image))
        if diagonal:
            beside.append(length)
            converged = _converged(diagonal, beside, shift, band)
            if converged is not None:
                frequencies, weights = converged
                return frequencies, np.array(basis[count:]).T @ weights
        basis.append(vector / length)
        images.append(vector_image / length)
        vector = shifted.solve(images[-1])
        diagonal.append(float(images[-1] @ vector))
    raise ReductionError(f"more vibrations below {band:g} Hz than {MOST_LANCZOS_STEPS} steps find; lower the band")


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


def _uncoupled(mass: SparseMatrix, stiffness: SparseMatrix, inner: Floats) -> Floats:
    """Shapes that span `inner` (n, m), uncoupled from each other, of unit modal mass; what is nothing left out."""
    inner = inner / np.sqrt(np.einsum("im,im->m", inner, mass @ inner))
    share, axes = np.linalg.eigh(inner.T @ (mass @ inner))
    # Shapes that others span already have no mass of their own.
    independent = share > INDEPENDENCE_TOLERANCE
    inner = inner @ (axes[:, independent] / np.sqrt(share[independent]))
    _, axes = np.linalg.eigh(inner.T @ (stiffness @ inner))
    return np.asarray(inner @ axes)


def symmetric(matrix: Floats) -> Floats:
    """Symmetric part of a matrix, free of the round-off of products."""
    return 0.5 * (matrix + matrix.T)


def selective_mass_scaling(mass: Floats, stiffness: Floats, limit: float) -> tuple[Floats, tuple[float, ...]]:
    """Mass matrix in which modes above `limit` (Hz) have mass added until they are at it, and the frequencies they had.

    Only the step of an explicit solver would feel these modes. Mass is added in their shapes phi alone:
    M + sum (w^2 / w_limit^2 - 1) M phi (M phi)'. The other modes and all static deflections stay as they are.
    The method for explicit finite elements is that of Olovsson, Simonsson and Unosson (International Journal for
    Numerical Methods in Engineering 63, 2005); here the modes are known, so that it is exact.

    Examples
    --------
    >>> mass, scaled = selective_mass_scaling(np.eye(2), np.diag([4.0, 9.0]) * np.pi**2, 1.2)
    >>> scaled, np.diag(mass)
    ((1.5,), array([1.    , 1.5625]))
    """
    values, shapes = scipy.linalg.eigh(stiffness, mass)
    ratio = values / (2.0 * np.pi * limit) ** 2
    high = ratio > 1.0
    momenta = mass @ shapes[:, high]
    added = (momenta * (ratio[high] - 1.0)) @ momenta.T
    return mass + added, tuple(float(f) for f in limit * np.sqrt(ratio[high]))


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


def with_stiffness_factor(body: ReducedBody, factor: float) -> ReducedBody:
    """Return the same body with its stiffness times a factor."""
    return replace(body, stiffness=factor * body.stiffness)
