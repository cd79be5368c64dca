"""Checks of matrices on interface nodes: what a free body must have, and which unit system its figures suggest.

All figures compare quantities of equal unit, so that they hold in every unit system. Each coordinate is scaled by the
root of its diagonal entry. A free body has six motions without strain energy; these must be the rigid motions of its
node positions, which finds wrong positions, local axes and orders of coordinates. Its mass matrix must have the
inertia of a rigid body under them. A consistent model in another unit system passes all of that; only the density and
the frequency of the first mode over the size of the body show it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from exugear.system.bodies.matrix_files.interface import NODE_SIZE, InterfaceMatrices
from fe_ste.tools.arrays import Floats

ASYMMETRY = 1e-6
"""Largest difference of two mirror images over the diagonal entries; files with ten digits have 1e-10."""
ZERO_STIFFNESS = 1e-6
"""Eigenvalue of the scaled stiffness below which a motion is free; elastic motions of usual bodies begin at 4e-3."""
RIGID_ENERGY = 1e-7
"""Largest strain energy of a rigid motion over that of its nodes one by one; a node off by 1 mm in 2 m has 2.5e-7."""
MASS_DIFFERENCE = 1e-3
"""Largest difference of the masses along x, y, z, and of first moments over mass and size."""
SUPPORT_RATIO = 0.05
"""Largest sixth frequency over the seventh of a free body."""
INDEFINITE_MASS, SINGULAR_MASS = -1e-9, 1e-12
"""Smallest eigenvalue of the scaled mass that is an error, and that of motions without mass."""
USUAL_DENSITY = (0.1, 5e4)
"""Usual mass over the cube of the largest extent of the nodes, kg/m3; bodies of gearboxes have 200 to 6000."""
USUAL_SPEED = (30.0, 5e3)
"""Usual first frequency times the largest extent of the nodes, m/s; bodies of gearboxes have 450 to 550."""
FREE_MOTIONS = 6
MOTIONS = ("translation x", "translation y", "translation z", "rotation x", "rotation y", "rotation z")
COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")
_SMALLEST = 1e-300


@dataclass(frozen=True)
class MatrixReview:
    """What the matrices of a body show about it; figures are NaN where errors prevent them."""

    errors: tuple[str, ...]
    """Reasons to refuse the matrices; each names matrix, node and value, and what to do."""
    warnings: tuple[str, ...]
    """What is possible but unusual."""
    mass: float = np.nan
    """In kg."""
    centre: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    """Centre of mass, m."""
    size: float = np.nan
    """Largest extent of the nodes along an axis, m; the radius of gyration if they share one position."""
    first_frequency: float = np.nan
    """Of the first elastic mode of the free body, Hz."""


def review(matrices: InterfaceMatrices) -> MatrixReview:
    """Review matrices in SI units that are those of a free elastic body.

    The checks build on each other: the first one that fails decides.

    Examples
    --------
    >>> body = InterfaceMatrices((7, 8), np.eye(2, 3), (), np.eye(12), np.eye(12))
    >>> review(body).errors[0][:75]
    'stiffness: 0 motions are free of strain energy instead of six; remove suppo'
    """
    for check in (_symmetry, _stiffness, _rigid_motions, _mass_definite):
        errors = tuple(check(matrices))
        if errors:
            return MatrixReview(errors, ())
    return _inertia(matrices)


def _scaled(matrix: Floats) -> Floats:
    """Matrix over the roots of its diagonal entries."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale[scale == 0.0] = 1.0
    return np.asarray(matrix / np.outer(scale, scale))


def _name(matrices: InterfaceMatrices, coordinate: int) -> str:
    """Name a coordinate for messages."""
    number, component = matrices.labels[coordinate]
    return f"node {number} {COMPONENTS[component - 1]}" if component else f"modal coordinate {number}"


def _symmetry(matrices: InterfaceMatrices) -> Iterator[str]:
    for kind in ("stiffness", "mass"):
        matrix: Floats = getattr(matrices, kind)
        difference = np.abs(_scaled(matrix) - _scaled(matrix).T)
        row, column = np.unravel_index(int(difference.argmax()), difference.shape)
        if difference[row, column] > ASYMMETRY:
            yield (
                f"{kind}: not symmetric, {matrix[row, column]:.6g} between {_name(matrices, int(row))} and "
                f"{_name(matrices, int(column))}, but {matrix[column, row]:.6g} the other way round; write the "
                "complete matrix, or a format that lists one triangle (Abaqus matrix input, DMIG of form 6)"
            )


def _stiffness(matrices: InterfaceMatrices) -> Iterator[str]:
    diagonal = np.diag(matrices.stiffness)
    empty = np.flatnonzero(diagonal == 0.0)
    if len(empty):
        yield (
            f"stiffness: {len(empty)} coordinates have none, the first is {_name(matrices, int(empty[0]))}; nodes of "
            "solid elements have no rotations: connect each interface node to its surface by an RBE3 or RBE2 and "
            "reduce to all six components"
        )
        return
    values = np.linalg.eigvalsh(_scaled(0.5 * (matrices.stiffness + matrices.stiffness.T)))
    if values[0] < -ZERO_STIFFNESS:
        yield (
            f"stiffness: negative strain energy, smallest scaled eigenvalue {values[0]:.2g}; check its sign, and "
            "whether mass and stiffness are exchanged"
        )
        return
    free = int(np.count_nonzero(values < ZERO_STIFFNESS))
    if free != FREE_MOTIONS:
        remedy = (
            "remove supports and springs to ground, and reduce the model to the interface nodes"
            if free < FREE_MOTIONS
            else "parts are loose, or rotations are missing; connect all parts and all six components of each node"
        )
        yield f"stiffness: {free} motions are free of strain energy instead of six; {remedy}"


def _rigid_motions(matrices: InterfaceMatrices) -> Iterator[str]:
    """Compare the free motions with the positions of the nodes, and find the node that is off."""
    motions = matrices.rigid_motions(matrices.positions.mean(axis=0))
    one_by_one = np.sum(motions**2 * np.diag(matrices.stiffness)[:, None], axis=0)
    energy = np.abs(np.diag(motions.T @ matrices.stiffness @ motions)) / one_by_one
    wrong = np.flatnonzero(energy > RIGID_ENERGY)
    if not len(wrong):
        return
    forces = matrices.stiffness @ motions
    own = np.sqrt(np.diag(matrices.stiffness))
    share = np.abs(forces) / np.maximum(own, _SMALLEST)[:, None] / np.sqrt(one_by_one)
    by_node = share[: NODE_SIZE * len(matrices.nodes)].reshape(len(matrices.nodes), -1).max(axis=1)
    worst = int(by_node.argmax())
    off = float(np.sqrt(energy.max()))
    yield (
        f"stiffness: {', '.join(MOTIONS[motion] for motion in wrong)} of the nodes as a rigid body have strain "
        f"energy, up to {energy.max():.2g} of that of the nodes one by one, the most at node {matrices.nodes[worst]}, "
        f"as if it was off by {1e3 * off * _extent(matrices):.2g} mm or {np.degrees(off):.2g} degrees; the matrix "
        "itself has six free motions: check the positions of the nodes, their local axes, the order of the coordinates "
        "and the unit of length"
    )


def _mass_definite(matrices: InterfaceMatrices) -> Iterator[str]:
    if not np.any(matrices.mass):
        yield "mass: all entries are zero; write the mass matrix, or state springs in [bearings] and [mounts] instead"
        return
    lowest = float(np.linalg.eigvalsh(_scaled(0.5 * (matrices.mass + matrices.mass.T)))[0])
    if lowest < INDEFINITE_MASS:
        yield (
            f"mass: negative kinetic energy, smallest scaled eigenvalue {lowest:.2g}; write the complete mass matrix, "
            "and check whether mass and stiffness are exchanged"
        )


def _extent(matrices: InterfaceMatrices) -> float:
    """Largest extent of the nodes along an axis, m."""
    return float(np.ptp(matrices.positions, axis=0).max())


def _inertia(matrices: InterfaceMatrices) -> MatrixReview:
    """Review the inertia under rigid motions, the first modes and what they say of the units."""
    middle = matrices.positions.mean(axis=0)
    motions = matrices.rigid_motions(middle)
    inertia = motions.T @ matrices.mass @ motions
    along = np.diag(inertia)[:3]
    mass = float(along.mean())
    errors = []
    if not mass > 0.0:
        return MatrixReview((f"mass: {mass:.3g} kg under rigid motions; write the complete mass matrix",), ())
    # Nodes may share one position, such as the sectors of a ring; the radius of gyration then is the length.
    size = _extent(matrices) or float(np.sqrt(np.abs(np.diag(inertia)[3:]).max() / mass))
    coupling = np.abs(inertia[:3, :3] - np.diag(along)).max()
    if max(np.ptp(along), coupling) > MASS_DIFFERENCE * mass:
        errors.append(
            f"mass: {', '.join(f'{value:.5g}' for value in along)} kg along x, y, z; a body has the same mass in each "
            "direction: check local axes, and whether the mass matrix has all components"
        )
    # Each first moment couples a rotation to two translations; both must agree.
    moments = np.array(
        [[inertia[1, 5], inertia[2, 3], inertia[0, 4]], [-inertia[2, 4], -inertia[0, 5], -inertia[1, 3]]]
    )
    misfit = float(np.abs(moments[0] - moments[1]).max()) / mass
    if not errors and misfit > MASS_DIFFERENCE * size:
        errors.append(
            f"mass: its first moments contradict each other by {1e3 * misfit:.3g} mm; the positions of the nodes do "
            "not belong to this mass matrix; write both again from one model"
        )
    frequencies = _frequencies(matrices)
    if not errors and not frequencies[5] < SUPPORT_RATIO * frequencies[6]:
        errors.append(
            f"stiffness: the sixth mode at {frequencies[5]:.3g} Hz is not far below the seventh at "
            f"{frequencies[6]:.3g} Hz; remove supports and springs to ground"
        )
    x, y, z = (float(value) for value in middle + moments.mean(axis=0) / mass)
    first = float(frequencies[6])
    warnings = () if errors else tuple(_unusual(matrices, mass, size, first))
    return MatrixReview(tuple(errors), warnings, mass, (x, y, z), size, first)


def _frequencies(matrices: InterfaceMatrices) -> Floats:
    """Frequencies of the free body, ascending, Hz; infinite for motions without mass."""
    shift = float(np.trace(matrices.stiffness) / np.trace(matrices.mass))
    pencil = matrices.stiffness + shift * matrices.mass
    values = scipy.linalg.eigh(0.5 * (matrices.mass + matrices.mass.T), 0.5 * (pencil + pencil.T), eigvals_only=True)[
        ::-1
    ]
    squares = np.full(len(values), np.inf)
    moving = values > SINGULAR_MASS / shift
    squares[moving] = np.maximum(1.0 / values[moving] - shift, 0.0)
    return np.asarray(np.sqrt(squares) / (2.0 * np.pi))


def _unusual(matrices: InterfaceMatrices, mass: float, size: float, first: float) -> Iterator[str]:
    lowest = float(np.linalg.eigvalsh(_scaled(0.5 * (matrices.mass + matrices.mass.T)))[0])
    if lowest < SINGULAR_MASS:
        yield (
            f"mass: some motions have none (smallest scaled eigenvalue {lowest:.1g}); mass is added so that they are "
            "at elasticity.limit_Hz"
        )
    density = mass / size**3
    if not USUAL_DENSITY[0] < density < USUAL_DENSITY[1]:
        yield (
            f"mass: {mass:.3g} kg on nodes that extend over {size:.3g} m ({density:.2g} kg/m3); check units, the unit "
            "system of the files"
        )
    if not USUAL_SPEED[0] < first * size < USUAL_SPEED[1]:
        yield (
            f"stiffness: the first elastic mode of the free body is at {first:.3g} Hz on nodes that extend over "
            f"{size:.3g} m ({first * size:.2g} m/s); check units, the unit system of the files"
        )
