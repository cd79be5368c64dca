"""Compliance of the contact cells of a gear pair: near field of half-spaces, and the regular part of both flanks.

The near field is the surface displacement of an elastic half-space under uniform cell pressures. The regular part is
what finite elements give for the tooth, the rim and the neighbouring teeth, with their own near field taken out
(`fe_ste.elasticity.flank`). Frame and signs as in `fe_ste.contact.kinematics`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fe_ste.contact.cells import Cells
from fe_ste.contact.kinematics import FlankPair
from fe_ste.contact.near_field import add_near_field
from fe_ste.contact.regular import RegularCompliance
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    from fe_ste.elasticity.flank import FlankCompliance


def compliance_matrix(
    cells: Cells,
    pair: FlankPair,
    axial: Floats,
    flanks: tuple[FlankCompliance, FlankCompliance],
    regular: tuple[RegularCompliance, RegularCompliance],
) -> Floats:
    """Approach of both flanks at each cell under unit forces on each cell.

    Parameters
    ----------
    axial : (slices,) middle of the contact slices, m
    flanks : gear 1, gear 2
    regular : of these flanks

    Returns
    -------
    (n, n) m/N; symmetric, of which the lower triangle is given and what is above it is not
    """
    matrix = np.zeros((len(cells.tooth), len(cells.tooth)))
    starts = np.flatnonzero(np.diff(cells.tooth * len(axial) + cells.layer)) + 1
    groups = np.concatenate([[0], starts, [len(cells.tooth)]])
    add_near_field(matrix, groups, cells, pair, axial, flanks)
    for part, roll in zip(regular, (cells.roll, cells.gear_roll), strict=True):
        part.add_to(matrix, groups, cells, roll, axial)
    return matrix
