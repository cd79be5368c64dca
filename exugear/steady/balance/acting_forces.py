"""Orders at which a mesh can have forces beyond those of its mean stiffness.

The stiffness of a family of meshes of one mesh frequency carries an order to those that lie harmonics of this frequency
beside it. An order that has no such neighbour among the lines has no force there, and what the gearbox would answer to
it need not be found. Orders at which gears deviate have forces, too, and so have those that the turning of shafts at
their orders makes of others.
"""

from __future__ import annotations

import numpy as np

from exugear.steady.harmonics.lines import HarmonicCoupling
from fe_ste.tools.arrays import Booleans, Complexes


def acting_forces(coupling: HarmonicCoupling, slow: HarmonicCoupling, deviations: Complexes) -> Booleans:
    """Find lines and forces (n, k) where forces along a row may be other than zero.

    Parameters
    ----------
    coupling : of the forces with functions of the mesh cycles whose mean is zero
    slow : of the meshes of each family with signals at the orders of shafts
    deviations : (n, m) of the meshes, with the same number of forces of each
    """
    lines = len(coupling.lines.index)
    forces = sum(group.size for group in coupling.groups) // deviations.shape[1]
    found = np.repeat(deviations != 0.0, forces, axis=1)
    terms = coupling.terms
    for group, first in zip(coupling.groups, terms.first, strict=True):
        line = np.repeat(np.arange(lines), np.diff(first))
        others = line[terms.place[first[0] : first[-1]] != line]
        has_neighbours = np.bincount(others, minlength=lines) > 0
        own = slice(group.begin, group.begin + group.size)
        found[:, own] |= (has_neighbours | found[:, own].any(axis=1))[:, None]
    turned = found.copy()
    for group, first in zip(slow.groups, slow.terms.first, strict=True):
        line = np.repeat(np.arange(lines), np.diff(first))
        own = slice(forces * group.begin, forces * (group.begin + group.size))
        np.logical_or.at(turned[:, own], line, found[slow.terms.place[first[0] : first[-1]], own])
    return turned
