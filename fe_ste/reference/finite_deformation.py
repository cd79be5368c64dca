"""8-node bricks with incompatible modes under finite deformation, St. Venant-Kirchhoff steel.

The displacement gradient of a brick is that of its nodes plus that of three incompatible modes, whose gradients are
those of the linear element in `fe_ste.elasticity.bricks`: at vanishing displacements the tangent is that element's
stiffness matrix. The modes are unknowns of each element alone; they are condensed there and follow each Newton step.

Green's strain is exact in the brick's mean deformation gradient and linear in what deviates from it, as in physically
stabilised bricks (M. A. Puso, Int. J. Num. Meth. Eng. 49 (2000) 1029-1064). The square of the deviation, which vanishes
with the size of the brick, is left out on purpose: with it, a locking-free brick that is long along the face width and
thin below the flank buckles within itself as soon as the pressure exceeds E (thickness / length)^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_ste.elasticity.bricks import brick_gradients, brick_values
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.threads import side_by_side

_POINTS = 8
_FUNCTIONS = 11


class InvertedElementError(RuntimeError):
    """A brick was turned inside out, or its incompatible modes lost their stiffness."""


@compiled
def _mean_gradients(gradients: Floats, volumes: Floats) -> Floats:
    """Mean gradients (11, 3) over a brick of its shape functions; those of the incompatible modes vanish."""
    mean = np.zeros((_FUNCTIONS, 3))
    for point in range(_POINTS):
        for i in range(8):
            for a in range(3):
                mean[i, a] += volumes[point] * gradients[point * _FUNCTIONS + i, a]
    return mean / np.sum(volumes)


@compiled
def _gradient(motion: Floats, gradients: Floats) -> Floats:
    """Displacement gradient (3, 3) from displacements (11, 3) and gradients (11, 3)."""
    result = np.zeros((3, 3))
    for i in range(_FUNCTIONS):
        for a in range(3):
            for b in range(3):
                result[a, b] += motion[i, a] * gradients[i, b]
    return result


@compiled
def _stress(whole: Floats, deviation: Floats, lame: float, shear: float, finite: bool) -> Floats:
    """Second Piola-Kirchhoff stress from the displacement gradient and its deviation from the mean."""
    # Green's strain E = (H + H' + H'H) / 2 with H = mean + deviation, less the square of the deviation.
    strain = 0.5 * (whole + whole.T)
    if finite:
        mean = whole - deviation
        strain = strain + 0.5 * (mean.T @ mean + mean.T @ deviation + deviation.T @ mean)
    # St. Venant and Kirchhoff: S = 2 mu E + lambda tr(E) I.
    stress = 2.0 * shear * strain
    trace = lame * (strain[0, 0] + strain[1, 1] + strain[2, 2])
    for a in range(3):
        stress[a, a] += trace
    return stress


@compiled
def _determinant(f: Floats) -> float:
    """Return the determinant of a deformation gradient (3, 3): its volume ratio."""
    return float(
        f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
        - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
        + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
    )


@compiled
def _brick(
    motion: Floats,
    gradients: Floats,
    volumes: Floats,
    lame: float,
    shear: float,
    finite: bool,
    force: Floats,
    matrix: Floats,
) -> bool:
    """Compute internal force (33) and tangent (33, 33) of one brick; false where it is inverted."""
    force[:] = 0.0
    matrix[:] = 0.0
    mean = _mean_gradients(gradients, volumes)
    mean_deformation = np.eye(3)
    if finite:
        mean_deformation += _gradient(motion, mean)
    strains = np.empty((33, 6))
    stresses = np.empty((33, 6))
    rows = (0, 1, 2, 0, 1, 2)
    columns = (0, 1, 2, 1, 2, 0)
    for point in range(_POINTS):
        at_point = gradients[point * _FUNCTIONS : (point + 1) * _FUNCTIONS]
        gradient = _gradient(motion, at_point)
        deviation = _gradient(motion, at_point - mean)
        # Newton's method must not step through an element turned inside out: from there it does not come back.
        if finite and _determinant(gradient + np.eye(3)) <= 0.0:
            return False
        stress = _stress(gradient, deviation, lame, shear, finite)
        volume = volumes[point]
        for i in range(_FUNCTIONS):
            for a in range(3):
                row = 3 * i + a
                # Row of B: derivative of the strain by displacement a of node i, F' grad N symmetrised, in Voigt's
                # order with shears doubled. The internal force is the integral of B'S.
                for k in range(6):
                    b = rows[k]
                    c = columns[k]
                    strain = mean_deformation[a, b] * at_point[i, c]
                    if finite:
                        strain += deviation[a, b] * mean[i, c]
                    if k > 2:  # both halves of a shear
                        strain += mean_deformation[a, c] * at_point[i, b]
                        if finite:
                            strain += deviation[a, c] * mean[i, b]
                    strains[row, k] = strain
                    force[row] += volume * stress[b, c] * strain
                trace = lame * (strains[row, 0] + strains[row, 1] + strains[row, 2])
                for k in range(3):
                    stresses[row, k] = volume * (trace + 2.0 * shear * strains[row, k])
                    stresses[row, k + 3] = volume * shear * strains[row, k + 3]
        # Material stiffness B'DB, one triangle of it.
        for row in range(33):
            for column in range(row, 33):
                total = 0.0
                for k in range(6):
                    total += strains[row, k] * stresses[column, k]
                matrix[row, column] += total
        if finite:
            _add_geometric_stiffness(at_point, mean, volume * stress, matrix)
    for row in range(33):
        for column in range(row):
            matrix[row, column] = matrix[column, row]
    return True


@compiled
def _add_geometric_stiffness(at_point: Floats, mean: Floats, stress: Floats, matrix: Floats) -> None:
    """Add the stress times the second derivative of the strain, which has no square of the deviation."""
    # S : d2E, d2E = sym(grad N_i (x) grad N_j) for each direction alike, less that of the deviations.
    for i in range(_FUNCTIONS):
        of_whole = (0.0, 0.0, 0.0)
        of_deviation = (0.0, 0.0, 0.0)
        for b in range(3):
            x, y, z = stress[b]
            own = at_point[i, b]
            apart = own - mean[i, b]
            of_whole = (of_whole[0] + own * x, of_whole[1] + own * y, of_whole[2] + own * z)
            of_deviation = (of_deviation[0] + apart * x, of_deviation[1] + apart * y, of_deviation[2] + apart * z)
        for j in range(i, _FUNCTIONS):
            total = 0.0
            for a in range(3):
                total += of_whole[a] * at_point[j, a] - of_deviation[a] * (at_point[j, a] - mean[j, a])
            for a in range(3):
                matrix[3 * i + a, 3 * j + a] += total


@compiled
def _cholesky(matrix: Floats, right: Floats) -> bool:
    """Factorise `matrix` in place and solve for the columns of `right` in place; false unless positive definite."""
    size, columns = right.shape
    for j in range(size):
        for k in range(j):
            matrix[j, j] -= matrix[j, k] * matrix[j, k]
        if not matrix[j, j] > 0.0:
            return False
        matrix[j, j] = np.sqrt(matrix[j, j])
        for i in range(j + 1, size):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] /= matrix[j, j]
    for column in range(columns):
        for i in range(size):
            for k in range(i):
                right[i, column] -= matrix[i, k] * right[k, column]
            right[i, column] /= matrix[i, i]
        for i in range(size - 1, -1, -1):
            for k in range(i + 1, size):
                right[i, column] -= matrix[k, i] * right[k, column]
            right[i, column] /= matrix[i, i]
    return True


@compiled
def _all_bricks(
    displacement: Floats,
    modes: Floats,
    nodes: Integers,
    gradients: Floats,
    volumes: Floats,
    lame: Floats,
    shear: Floats,
    finite: bool,
    force: Floats,
    stiffness: Floats,
    recovery: Floats,
) -> int:
    """Condensed forces, stiffness and recovery of the modes of all bricks; the first inverted one, or -1."""
    motion = np.empty((_FUNCTIONS, 3))
    element_force = np.empty(33)
    matrix = np.empty((33, 33))
    for element in range(len(nodes)):
        for corner in range(8):
            motion[corner] = displacement[nodes[element, corner]]
        motion[8:] = modes[element]
        if not _brick(
            motion,
            gradients[element],
            volumes[element],
            lame[element],
            shear[element],
            finite,
            element_force,
            matrix,
        ):
            return element
        # Static condensation of the nine mode unknowns: with K_mm d_m = -(r_m + K_mu d_u) the step of the modes is
        # known from that of the nodes, and forces and stiffness lose what the modes take up.
        solved = recovery[element]
        solved[:, 0] = element_force[24:]
        solved[:, 1:] = matrix[24:, :24]
        if not _cholesky(matrix[24:, 24:].copy(), solved):
            return element
        for i in range(24):
            total = 0.0
            for k in range(9):
                total += matrix[i, 24 + k] * solved[k, 0]
            force[element, i] = element_force[i] - total
            for j in range(i, 24):
                total = 0.0
                for k in range(9):
                    total += matrix[i, 24 + k] * solved[k, 1 + j]
                stiffness[element, i, j] = matrix[i, j] - total
                stiffness[element, j, i] = stiffness[element, i, j]
    return -1


@compiled
def _cauchy_stress(
    displacement: Floats,
    modes: Floats,
    nodes: Integers,
    gradients: Floats,
    volumes: Floats,
    lame: Floats,
    shear: Floats,
    finite: bool,
) -> Floats:
    result = np.empty((len(nodes), _POINTS, 3, 3))
    motion = np.empty((_FUNCTIONS, 3))
    for element in range(len(nodes)):
        for corner in range(8):
            motion[corner] = displacement[nodes[element, corner]]
        motion[8:] = modes[element]
        mean = _mean_gradients(gradients[element], volumes[element])
        for point in range(_POINTS):
            at_point = gradients[element, point * _FUNCTIONS : (point + 1) * _FUNCTIONS]
            gradient = _gradient(motion, at_point)
            deviation = _gradient(motion, at_point - mean)
            stress = _stress(gradient, deviation, lame[element], shear[element], finite)
            if finite:  # Cauchy stress F S F' / det F
                deformation = gradient + np.eye(3)
                stress = deformation @ stress @ deformation.T / _determinant(deformation)
            result[element, point] = stress
    return result


@dataclass(frozen=True)
class BrickTangent:
    """What one evaluation of the bricks gives."""

    force: Floats
    """(n, 3) internal nodal forces with the modes condensed, N."""
    stiffness: Floats
    """(m, 24, 24) condensed tangents of the elements, N/m."""
    recovery: Floats
    """(m, 9, 25) step of the modes, taken negative: first column constant, others by the element's displacements."""


@dataclass(frozen=True)
class Bricks(ReprMixin):
    """8-node bricks with incompatible modes, ready to be evaluated at any displacement."""

    nodes: Integers
    """(m, 8)"""
    points: Floats
    """(n, 3) undeformed, m."""
    gradients: Floats
    """(m, 88, 3) of the eight shape functions and three modes at each of the eight Gauss points, 1/m."""
    volumes: Floats
    """(m, 8) m^3."""
    lame: Floats
    shear: Floats
    """(m,) lame's constants, Pa."""
    finite: bool
    """Finite deformation; false gives the linear element."""

    @classmethod
    def from_mesh(
        cls,
        points: Floats,
        hexahedra: Integers,
        materials: Sequence[Material],
        material_of: Integers | None = None,
        *,
        finite: bool = True,
    ) -> Bricks:
        """Prepare the bricks of a mesh.

        Parameters
        ----------
        points : (n, 3) m
        hexahedra : (m, 8) connectivity in VTK order
        material_of : (m,) number of each brick's material; the first for all unless given
        finite : finite deformation; false gives the linear element

        Raises
        ------
        ValueError
            If an element has a Gauss point with no positive volume.
        """
        nodes, gradients, volumes = brick_gradients(points, hexahedra)
        by_point = gradients.transpose(2, 3, 0, 1).reshape(len(nodes), _POINTS * _FUNCTIONS, 3)
        number = np.zeros(len(nodes), dtype=np.int64) if material_of is None else material_of
        modulus = np.array([material.youngs_modulus for material in materials])[number]
        ratio = np.array([material.poissons_ratio for material in materials])[number]
        return cls(
            nodes=nodes,
            points=points,
            gradients=np.ascontiguousarray(by_point),
            volumes=np.ascontiguousarray(volumes),
            lame=modulus * ratio / ((1 + ratio) * (1 - 2 * ratio)),
            shear=modulus / (2 * (1 + ratio)),
            finite=finite,
        )

    @cached_property
    def unknowns(self) -> Integers:
        """Unknowns (m, 24) of each brick: ``3 node + direction``."""
        return np.asarray((3 * self.nodes[:, :, None] + np.arange(3)).reshape(len(self.nodes), 24))

    def modes_at_rest(self) -> Floats:
        """Incompatible modes (m, 3, 3) of the undeformed bricks."""
        return np.zeros((len(self.nodes), 3, 3))

    def evaluate(self, displacement: Floats, modes: Floats) -> BrickTangent:
        """Evaluate forces and tangents.

        Parameters
        ----------
        displacement : (n, 3) m
        modes : (m, 3, 3) incompatible modes by mode and direction

        Raises
        ------
        InvertedElementError
            If a brick is turned inside out.

        References
        ----------
        J. C. Simo, F. Armero, Int. J. Num. Meth. Eng. 33 (1992) 1413-1449: modes on the displacement gradient.
        """
        count = len(self.nodes)
        force = np.empty((count, 24))
        stiffness = np.empty((count, 24, 24))
        recovery = np.empty((count, 9, 25))

        def part(chosen: slice) -> int:
            return _all_bricks(
                displacement,
                modes[chosen],
                self.nodes[chosen],
                self.gradients[chosen],
                self.volumes[chosen],
                self.lame[chosen],
                self.shear[chosen],
                self.finite,
                force[chosen],
                stiffness[chosen],
                recovery[chosen],
            )

        halves = (slice(0, count // 2), slice(count // 2, count))
        for half, inverted in zip(halves, side_by_side(part, halves), strict=True):
            if inverted >= 0:
                raise InvertedElementError(f"element {half.start + inverted} is turned inside out")
        nodal = np.zeros(self.points.size)
        np.add.at(nodal, self.unknowns, force)
        return BrickTangent(nodal.reshape(-1, 3), stiffness, recovery)

    def stepped_modes(self, modes: Floats, recovery: Floats, step: Floats, length: float) -> Floats:
        """Incompatible modes after `length` times a Newton step of the displacements, (n, 3); see `BrickTangent`."""
        element_step = step.ravel()[self.unknowns]
        change = recovery[:, :, 0] + np.einsum("ekj,ej->ek", recovery[:, :, 1:], element_step)
        return np.asarray(modes - length * change.reshape(-1, 3, 3))

    def nodal_stress(self, displacement: Floats, modes: Floats) -> Floats:
        """Cauchy stress (n, 3, 3) at the nodes, Pa: extrapolated from the Gauss points and averaged over bricks."""
        at_points = _cauchy_stress(
            displacement, modes, self.nodes, self.gradients, self.volumes, self.lame, self.shear, self.finite
        )
        at_corners = np.einsum("pc,epab->ecab", np.linalg.inv(brick_values()), at_points)
        total = np.zeros((len(self.points), 3, 3))
        np.add.at(total, self.nodes, at_corners)
        count = np.bincount(self.nodes.ravel(), minlength=len(self.points))
        return np.asarray(total / np.maximum(count, 1)[:, None, None])

    def _line(self) -> str:
        deformation = "finite" if self.finite else "small"
        return f": {len(self.nodes)} elements, {len(self.points)} nodes, {deformation} deformation"


def von_mises(stress: Floats) -> Floats:
    """Equivalent stress after von Mises of stresses (..., 3, 3).

    Examples
    --------
    >>> round(float(von_mises(np.diag([250.0, 0.0, 0.0]))), 9)
    250.0
    """
    mean = np.trace(stress, axis1=-2, axis2=-1)[..., None, None] / 3.0
    deviator = stress - mean * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.sum(deviator**2, axis=(-2, -1))))
