"""What the end of a wedge adds to the displacement of a half-space, by quadratic finite elements.

The wedge is as long as its edge, so loads and displacements are transformed along it: a unit load at the distance d
from the edge moves the face at the distance d' by a function of (wave number d, wave number d'), which one plane
problem at the wave number 1 gives for all. A half-space with the same elements behind the loaded face is taken off,
and with it what these elements miss at the load. In these terms 1 / distance is 2 K_0(distance).

Run ``python benchmarks/truth/wedge.py`` for the numbers in `fe_ste.elasticity.halfspace.wedge_images` as they follow
from least squares over 55 to 125 degrees, a minute.
"""

from __future__ import annotations

import math
import sys

import numpy as np
import scipy.optimize
import scipy.sparse
import scipy.sparse.linalg
import skfem
from scipy.special import k0

from fe_ste.tools.arrays import Floats

NEAREST, FARTHEST = 1e-3, 16.0
"""Radii of the mesh; from outside, where all has decayed, and from inside nothing comes back."""

STEP, TURN = 0.08, 0.1
"""Size of elements, along the radius as part of it, and their angle."""

EVERY, LEFT_OUT = 4, 8
"""Nodes from one load to the next, and nodes at the outer end that are no loads."""


def _strain(u: skfem.DiscreteField) -> tuple[Floats, ...]:
    """Strains of a wave of number 1; the displacement along the edge is a quarter of a wave ahead."""
    along, across, up = np.asarray(u)
    slope = u.grad
    return (-along, slope[1, 0], slope[2, 1], slope[0, 0] + across, slope[0, 1] + up, slope[1, 1] + slope[2, 0])


def _stiffness(basis: skfem.CellBasis, poissons_ratio: float) -> scipy.sparse.csr_matrix:
    """Of a material with Young's modulus 1."""
    shear = 0.5 / (1.0 + poissons_ratio)
    volume = 2.0 * shear * poissons_ratio / (1.0 - 2.0 * poissons_ratio)

    @skfem.BilinearForm
    def work(u: skfem.DiscreteField, v: skfem.DiscreteField, _: object) -> Floats:
        e, f = _strain(u), _strain(v)
        normal = 2.0 * shear * sum(a * b for a, b in zip(e[:3], f[:3], strict=True))
        skewed = shear * sum(a * b for a, b in zip(e[3:], f[3:], strict=True))
        return np.asarray(volume * sum(e[:3]) * sum(f[:3]) + normal + skewed)

    return work.assemble(basis)


def face_displacement(angles: Floats, poissons_ratio: float) -> tuple[Floats, Floats]:
    """Return distances of loads from the edge, and the displacement (read, loaded) of the face at the first angle."""
    radius = np.exp(np.arange(math.log(NEAREST), math.log(FARTHEST), STEP))
    r, angle = np.meshgrid(radius, angles, indexing="ij")
    node = np.arange(r.size).reshape(r.shape)
    quads = np.stack([node[:-1, 1:], node[1:, 1:], node[1:, :-1], node[:-1, :-1]], axis=-1).reshape(-1, 4)
    points = np.stack([(r * np.cos(angle)).ravel(), (r * np.sin(angle)).ravel()])
    mesh = skfem.MeshQuad(points, np.ascontiguousarray(quads.T))
    basis = skfem.CellBasis(mesh, skfem.ElementVector(skfem.ElementQuad2(), 3), intorder=5)
    stiffness = _stiffness(basis, poissons_ratio)
    free = np.setdiff1d(np.arange(basis.N), basis.nodal_dofs[:, node[-1]])
    chosen = np.arange(0, len(radius) - LEFT_OUT, EVERY)
    pressed = basis.nodal_dofs[2, node[chosen, 0]]
    loads = np.zeros((basis.N, len(chosen)))
    loads[pressed, np.arange(len(chosen))] = 1.0
    moved = np.zeros_like(loads)
    moved[free] = scipy.sparse.linalg.splu(stiffness[free][:, free].tocsc()).solve(loads[free])
    return radius[chosen], moved[pressed]


def added_by_the_edge(angle: float, poissons_ratio: float) -> tuple[Floats, Floats]:
    """Distances (n,) from the edge, and what it adds (n, n) to 2 K_0 of the distance of two places, over 2.

    `angle` is in rad.
    """
    behind = np.linspace(0.0, -angle, max(6, math.ceil(angle / TURN)) + 1)
    beyond = np.linspace(-angle, -np.pi, math.ceil((np.pi - angle) / TURN) + 1)[1:]
    places, wedge = face_displacement(behind, poissons_ratio)
    _, whole = face_displacement(np.concatenate([behind, beyond]), poissons_ratio)
    return places, (wedge - whole) * np.pi / (2.0 * (1.0 - poissons_ratio**2))


def of_images(images: Floats, places: Floats) -> Floats:
    """Return the same by image loads, see `fe_ste.elasticity.halfspace.wedge_images`."""
    d, e = places[:, None], places
    return np.asarray(sum(a * k0(np.sqrt(b * (d * d + e * e) + c * d * e)) for a, b, c in images))


def relevance(places: Floats) -> Floats:
    """Weight of pairs of places: differences count as part of an image load's, less where one is far nearer."""
    apart, ratio = places[:, None] + places, places[:, None] / places
    return np.asarray(np.minimum(ratio, 1.0 / ratio) ** 0.25 / k0(apart) * (apart < 5.0))


def within(places: Floats, added: Floats) -> tuple[Floats, Floats]:
    """Return the part of `added_by_the_edge` that is fitted: not the mesh's inner end, nor what has decayed."""
    chosen = (places > 2.0 * NEAREST) & (places < 4.0)
    return places[chosen], added[np.ix_(chosen, chosen)]


def _images(fitted: Floats) -> Floats:
    strength, squares, half_product = fitted.reshape(2, 3).T
    return np.stack([np.exp(strength), np.exp(squares), 2.0 * np.exp(squares) * half_product], axis=-1)


def fitted(angle: float, poissons_ratio: float, start: Floats) -> Floats:
    """Logarithms of strength and factor of the squares, and half the product's over it, of two images (6,)."""
    places, added = within(*added_by_the_edge(angle, poissons_ratio))
    weight = relevance(places)
    bounds = ([-5.0, -3.0, -0.9] * 2, [3.0, 5.0, 5.0] * 2)
    found = scipy.optimize.least_squares(
        lambda values: (weight * (of_images(_images(values), places) - added)).ravel(), start, bounds
    )
    return np.asarray(found.x)


def main() -> None:
    """Fit all and print the powers."""
    terms, values = [], []
    for poissons_ratio in (0.30, 0.25, 0.35):
        right = np.array([0.34, 0.31, 0.19, -0.17, 2.19, 0.91])
        for angles in (range(90, 126, 5), range(85, 54, -5)):
            start = right
            for angle in angles:
                start = fitted(math.radians(angle), poissons_ratio, start)
                right = start if angle == 90 else right
                beyond, ratio = (angle - 90.0) / 35.0, (poissons_ratio - 0.3) / 0.05
                terms.append(np.concatenate([beyond ** np.arange(5), ratio * beyond ** np.arange(3)]))
                values.append(start)
    powers = np.linalg.lstsq(np.array(terms), np.array(values), rcond=None)[0].T
    for row in powers:
        sys.stdout.write("[" + ", ".join(f"{value:.4f}" for value in row) + "],\n")


if __name__ == "__main__":
    main()
