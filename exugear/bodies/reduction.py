"""Elastic bodies reduced to a few coordinates: six at each seat, and a few amplitudes inside.

A seat is where a gear or a bearing sits. Its six coordinates are the rigid motion nearest to that of its surface, so
that a seat looks to a mesh or a bearing like a rigid body. Between the seats the body takes the shape of least
energy. Added to these static shapes are the sag of the body under rigid accelerations, so that every static deflection
is exact, and as many free vibrations as the band asks for, which are then exact as well.

A shaft that turns is described in a frame that does not (`frame` "nonrotating"): as it is axially symmetric, its
matrices are constant there, M q'' + Omega G q' + K q = f. No coordinate is needed for its spin: the common part of
the seats' turning about z is the spin, with Omega = r' M q' / (r' M r) for the rigid spin r.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse.csgraph

from exugear.bodies.reduced_body import Frame, ReducedBody, ReductionError, RigidInertia
from fe_ste.tools.arrays import Floats, SparseMatrix
from fe_ste.tools.sparse import Backend, Factorisation, factorise

MOST_STEPS = 150
"""Lanczos steps after which the search for free vibrations is given up."""
CONVERGED = 1e-9
"""Relative residual of a free vibration; its frequency is then exact to the square of it."""
NEGLIGIBLE = 1e-8
"""Share of a free vibration that the static shapes must leave over for it to count as a shape of its own."""


@dataclass(frozen=True)
class ReducedPart:
    """One set of unknowns reduced: (s + a) coordinates, seats' first, then amplitudes.

    Attributes
    ----------
    mass, stiffness : (s + a, s + a)
    shapes : (unknowns, s + a) displacement per coordinate
    frequencies : elastic free vibrations kept, and the next one, Hz
    """

    mass: Floats
    stiffness: Floats
    shapes: Floats
    frequencies: tuple[float, ...]


def reduce_part(
    mass: SparseMatrix,
    stiffness: SparseMatrix,
    seats: Floats,
    rigid: Floats,
    blanks: Floats,
    band: float,
    backend: Backend | None = "superlu",
) -> ReducedPart:
    """Reduce a free elastic structure to its seats' coordinates and amplitudes of free vibrations.

    Parameters
    ----------
    mass, stiffness : (n, n) sparse
    seats : (s, n) seat coordinates as averages of the unknowns
    rigid : (n, k) all rigid motions
    blanks : (s, s) rigid masses on the seats
    band : float
        All free vibrations up to this frequency (Hz) become exact; those on bearings come out to 1e-4 up to two
        thirds of it.
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
    static, relief = static_shapes(mass, stiffness, seats, rigid, backend)
    rows = scipy.sparse.csr_array(seats)
    whole = scipy.sparse.csr_array(mass + rows.T @ scipy.sparse.csr_array(blanks) @ rows)
    vibrations, frequencies = free_vibrations(whole, stiffness, rigid, (np.pi * band) ** 2, band, backend)
    inner = np.hstack([vibrations - static @ (seats @ vibrations), relief])
    basis = np.hstack([static, _amplitude_shapes(mass, stiffness, inner)])
    count = len(seats)
    reduced_mass = basis.T @ (mass @ basis)
    reduced_mass[:count, :count] += blanks
    elastic = np.eye(
        basis.shape[1]
    )  # leaves out of the seats' motion what is rigid, so that it stores no energy at all
    elastic[:count, :count] -= moved @ np.linalg.lstsq(moved, np.eye(count))[0]
    reduced_stiffness = elastic.T @ (basis.T @ (stiffness @ basis)) @ elastic
    return ReducedPart(symmetric(reduced_mass), symmetric(reduced_stiffness), basis, frequencies)


def static_shapes(
    mass: SparseMatrix, stiffness: SparseMatrix, seats: Floats, rigid: Floats, backend: Backend | None = "superlu"
) -> tuple[Floats, Floats]:
    """Shapes (n, s) of least strain energy, each with one seat coordinate at 1, and (n, k) sag between fixed seats.

    Loads at the seats and rigid accelerations that balance each other act on the body held by springs at as many
    unknowns as it has rigid motions, F the inverse: these springs then carry nothing. The forces at the seats follow
    from the motion of the seats, B (F B^T l + R a) = d with R^T B^T l = 0. The sag is what each rigid acceleration
    does, B u = 0; without it the shapes know only loads in balance among the seats.
    """
    held_at = scipy.linalg.qr(rigid.T, mode="r", pivoting=True)[1][: rigid.shape[1]]
    springs = np.zeros(len(rigid))
    springs[held_at] = stiffness.diagonal().mean()
    with factorise(scipy.sparse.csr_array(stiffness + scipy.sparse.diags_array(springs)), backend) as held:
        pulled = held.solve(np.hstack([seats.T, mass @ rigid]))
    pulled, sag = pulled[:, : len(seats)], pulled[:, len(seats) :]
    moved = seats @ rigid
    count, modes = moved.shape
    # Compliances and rigid motions differ by ten powers of ten: both unknowns are scaled to one.
    scale = np.sqrt(np.diag(seats @ pulled))
    saddle = np.zeros((count + modes, count + modes))
    saddle[:count, :count] = (seats @ pulled) / np.outer(scale, scale)
    saddle[:count, count:] = moved / scale[:, None]
    saddle[count:, :count] = saddle[:count, count:].T
    wanted = np.zeros((count + modes, count + modes))
    wanted[:count, :count] = np.diag(1.0 / scale)
    wanted[:count, count:] = -(seats @ sag) / scale[:, None]
    wanted[count:, count:] = -(rigid.T @ (mass @ rigid))
    found = np.linalg.solve(saddle, wanted)
    shapes = pulled @ (found[:count] / scale[:, None]) + rigid @ found[count:]
    relief = sag + shapes[:, count:]
    shapes = shapes[:, :count]
    shapes += (rigid - shapes @ moved) @ np.linalg.lstsq(moved, np.eye(count))[0]
    return shapes, relief - shapes @ (seats @ relief)


def free_vibrations(
    mass: SparseMatrix,
    stiffness: SparseMatrix,
    rigid: Floats,
    shift: float,
    band: float,
    backend: Backend | None = "superlu",
) -> tuple[Floats, tuple[float, ...]]:
    """Shapes (n, a) of the elastic free vibrations up to `band` (Hz), and their frequencies and the next one.

    Lanczos steps with (K + shift M)^-1, every vector held orthogonal to the rigid motions and to all before it. They
    find one vibration of each frequency; equal ones come in further sweeps, until one finds none in the band.

    Raises
    ------
    ReductionError
        More vibrations in the band than `MOST_STEPS` can find.
    """
    known = rigid @ np.linalg.inv(np.linalg.cholesky(rigid.T @ (mass @ rigid))).T
    frequencies: list[float] = []
    random = np.random.default_rng(1)
    with factorise(scipy.sparse.csr_array(stiffness + shift * mass), backend) as shifted:
        while True:
            start = random.standard_normal(len(rigid))
            found, shapes = _lanczos_sweep(mass, shifted, known, start, shift, band)
            kept = found < band
            frequencies += found[kept].tolist()
            known = np.hstack([known, shapes[:, kept]])
            if not kept.any():
                order = np.argsort(frequencies)
                return known[:, rigid.shape[1] :][:, order], (*sorted(frequencies), float(found[0]))


def _lanczos_sweep(
    mass: SparseMatrix, shifted: Factorisation, known: Floats, start: Floats, shift: float, band: float
) -> tuple[Floats, Floats]:
    """Frequencies (Hz) up to the first beyond the band, and shapes, of what is orthogonal to the known ones."""
    basis, images = [*known.T], [*(mass @ known).T]
    count = len(basis)
    diagonal: list[float] = []
    beside: list[float] = []
    vector = start
    while len(diagonal) < MOST_STEPS:
        before, image = np.array(basis), np.array(images)
        for _ in range(2):  # once leaves round-off of the first pass
            vector = vector - before.T @ (image @ vector)
        own = mass @ vector
        length = float(np.sqrt(vector @ own))
        if diagonal:
            beside.append(length)
            found = _converged(diagonal, beside, shift, band)
            if found is not None:
                frequencies, turned = found
                return frequencies, np.array(basis[count:]).T @ turned
        basis.append(vector / length)
        images.append(own / length)
        vector = shifted.solve(images[-1])
        diagonal.append(float(images[-1] @ vector))
    raise ReductionError(f"more vibrations below {band:g} Hz than {MOST_STEPS} steps find; lower the band")


def _converged(diagonal: list[float], beside: list[float], shift: float, band: float) -> tuple[Floats, Floats] | None:
    """Frequencies (Hz) up to the first beyond the band, and their weights (steps, f), once all are at round-off."""
    matrix = np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    values, turned = np.linalg.eigh(matrix)
    values, turned = values[::-1], turned[:, ::-1]
    frequencies = np.sqrt(np.maximum(1.0 / np.maximum(values, 1e-300) - shift, 0.0)) / (2.0 * np.pi)
    needed = int(np.count_nonzero(frequencies < band)) + 1
    if needed > len(values):
        return None
    residual = beside[-1] * np.abs(turned[-1, :needed]) / values[:needed]
    return (frequencies[:needed], turned[:, :needed]) if residual.max() < CONVERGED else None


def _amplitude_shapes(mass: SparseMatrix, stiffness: SparseMatrix, inner: Floats) -> Floats:
    """Shapes that span `inner` (n, a), uncoupled from each other, of unit modal mass; what is nothing left out."""
    inner = inner / np.sqrt(np.einsum("im,im->m", inner, mass @ inner))
    share, turned = np.linalg.eigh(inner.T @ (mass @ inner))
    inner = inner @ (turned[:, share > NEGLIGIBLE] / np.sqrt(share[share > NEGLIGIBLE]))
    _, turned = np.linalg.eigh(inner.T @ (stiffness @ inner))
    return np.asarray(inner @ turned)


def symmetric(matrix: Floats) -> Floats:
    """Symmetric part of a matrix, free of the round-off of products."""
    return 0.5 * (matrix + matrix.T)


def lowered(mass: Floats, stiffness: Floats, limit: float) -> tuple[Floats, tuple[float, ...]]:
    """Mass matrix whose vibrations above `limit` (Hz) are slowed down to it, and the frequencies they had.

    Mass is added in these vibrations alone, phi: M + sum (w^2 / w_limit^2 - 1) M phi (M phi)'. The other vibrations
    and all static deflections stay as they are.

    Examples
    --------
    >>> mass, found = lowered(np.eye(2), np.diag([4.0, 9.0]) * np.pi**2, 1.2)
    >>> found, np.diag(mass)
    ((1.5,), array([1.    , 1.5625]))
    """
    values, shapes = scipy.linalg.eigh(stiffness, mass)
    ratio = values / (2.0 * np.pi * limit) ** 2
    high = ratio > 1.0
    carried = mass @ shapes[:, high]
    added = (carried * (ratio[high] - 1.0)) @ carried.T
    return mass + added, tuple(float(f) for f in limit * np.sqrt(ratio[high]))


def rigid_gyroscopics(inertia: RigidInertia, frame: Frame) -> Floats:
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
    """Give a body the rigid inertia of another model of it; its free elastic vibrations stay as they are.

    The difference rides on the rigid part of the motion, M + M R A R' M with R the rigid motions about the wanted
    centre and A so that R' M R becomes the wanted inertia; elastic vibrations are orthogonal to R. Gyroscopic forces
    become those of the wanted inertia likewise, in the frame of the body.
    """
    motions = body.rigid_motions(wanted.centre)
    carried = body.mass @ motions
    present = np.linalg.inv(motions.T @ carried)
    target = np.diag([wanted.mass] * 3 + [wanted.transverse] * 2 + [wanted.axial])
    mass = body.mass + carried @ (present @ target @ present - present) @ carried.T
    turning = rigid_gyroscopics(wanted, body.frame)
    missing = turning - motions.T @ body.gyroscopic @ motions
    gyroscopic = body.gyroscopic + carried @ (present @ missing @ present) @ carried.T
    return replace(body, mass=symmetric(mass), gyroscopic=0.5 * (gyroscopic - gyroscopic.T))


def stiffened(body: ReducedBody, factor: float) -> ReducedBody:
    """Return the same body with its stiffness times a factor."""
    return replace(body, stiffness=factor * body.stiffness)
