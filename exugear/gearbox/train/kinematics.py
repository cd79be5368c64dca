"""How a gear train rolls: rows that say how meshes close and couplings twist, and the motions that do neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Floats

RANK_TOLERANCE = 1e-9
"""Singular values below this part of the largest count as zero: rows are scaled to 1, and round-off is 1e-16."""


class MeshedBodies(Protocol):
    """What a mesh joins: bodies with gear 1 and gear 2, and the body whose spin carries the line of centres."""

    @property
    def name(self) -> str:
        """Name of the mesh."""

    @property
    def pair(self) -> GearPair:
        """Gear 1 and gear 2."""

    @property
    def pinion(self) -> str:
        """Body with gear 1."""

    @property
    def gear(self) -> str:
        """Body with gear 2."""

    @property
    def frame(self) -> str:
        """Body whose spin carries the line of centres; a name that is no spin stands still."""


class CoupledBodies(Protocol):
    """What a coupling joins: two bodies that roll at one speed."""

    @property
    def first(self) -> str:
        """One body."""

    @property
    def second(self) -> str:
        """The other body."""


@dataclass(frozen=True)
class Tie:
    """Two bodies that roll at one speed; a name that is no spin stands still."""

    first: str
    second: str


def mesh_row(spins: Sequence[str], mesh: MeshedBodies) -> Floats:
    """Return how a mesh closes per unit spins: r_b1 (t1 - tf) +- r_b2 (t2 - tf), flank s = +1.

    Plus for an external pair, minus for an internal one; tf is the spin of the frame.

    Parameters
    ----------
    spins : bodies that can turn; all others stand still

    Returns
    -------
    array (spins,), m/rad
    """
    row = np.zeros(len(spins))
    pinion_radius = mesh.pair.pinion.base_radius
    gear_radius = mesh.pair.gear.base_radius * (-1.0 if mesh.pair.gear.internal else 1.0)
    levers = ((mesh.pinion, pinion_radius), (mesh.gear, gear_radius), (mesh.frame, -(pinion_radius + gear_radius)))
    for name, lever in levers:
        if name in spins:
            row[spins.index(name)] += lever
    return row


def coupling_row(spins: Sequence[str], coupling: CoupledBodies) -> Floats:
    """Return how a coupling twists per unit spins, (spins,): 1 at its first body, -1 at its second."""
    return np.array([float(name == coupling.first) - float(name == coupling.second) for name in spins])


def kinematic_modes(rows: Floats) -> Floats:
    """Orthonormal basis of the spins that no row sees.

    Parameters
    ----------
    rows : (constraints, spins) of any units; each row is scaled by its largest entry

    Returns
    -------
    (spins, degrees of freedom)

    Examples
    --------
    Two wheels of 1 m and 2 m in mesh: the larger one turns half as fast, the other way round.

    >>> kinematic_modes(np.array([[1.0, 2.0]])).T * np.sqrt(5.0)
    array([[-2.,  1.]])
    """
    rows = np.vstack([rows, np.zeros((1, rows.shape[1]))])
    scale = np.abs(rows).max(axis=1, keepdims=True)
    _, singular, basis = np.linalg.svd(rows / np.where(scale > 0, scale, 1.0))
    rank = int(np.sum(singular > RANK_TOLERANCE * singular[0]))
    return np.asarray(basis[rank:].T)


def turn_together(motions: Floats, other_motions: Floats) -> bool:
    """Tell whether two bodies' rows of the rolling motions are one up to a factor: each fixes the other."""
    lengths = np.linalg.norm(motions) * np.linalg.norm(other_motions)
    return bool(abs(motions @ other_motions) > (1.0 - RANK_TOLERANCE) * lengths)
