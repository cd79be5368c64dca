"""Elements of a sector mesh layer by layer, in the frame that turns with the section along the helix.

There all layers of one height have the same elements: they are computed once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_ste.elasticity.bricks import element_stiffness
from fe_ste.elasticity.hexmesh import SectorMesh
from fe_ste.tools.arrays import Floats, Integers

#: Part of the face width by which heights of layers may differ and count as equal.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class LayeredElements:
    """Stiffness of the bricks over the quadrilaterals of a section."""

    corners: Integers
    """(q, 8) section node of each corner of a brick."""
    above: Integers
    """(q, 8) 0 for a corner at the lower end of the layer, 1 at the upper end."""
    kinds: Integers
    """(layers,) height of each layer, as a place in `stiffness`."""
    stiffness: Floats
    """(heights, q, 8, 8, 3, 3) by two corners and two directions, N/m."""

    @classmethod
    def from_mesh(cls, mesh: SectorMesh, quads: Integers, share: Floats, incompatible_modes: bool) -> LayeredElements:
        """Compute the elements over some quadrilaterals, given by their number; of each a share counts.

        Raises
        ------
        ValueError
            If layers have sections of their own, or an element is folded.
        """
        if mesh.layer_points is not None:
            raise ValueError(f"gear {mesh.gear.name}: layers with sections of their own cannot be condensed")
        steps = np.diff(mesh.axial_positions)
        _, first, kinds = np.unique(
            np.round(steps / (_ROUNDING * mesh.gear.face_width)), return_index=True, return_inverse=True
        )
        layers = [_layer(mesh, quads, float(steps[at]), incompatible_modes) for at in first]
        corners, above, _ = layers[0]
        stiffness = np.stack([matrices for *_, matrices in layers])
        return cls(corners, above, kinds.ravel(), stiffness * share[:, None, None, None, None])

    def stack(self, elements: Integers) -> tuple[Integers, Floats]:
        """Stiffness of the stacks of bricks over some quadrilaterals, all layers joined.

        Parameters
        ----------
        elements : (e,)

        Returns
        -------
        nodes : (n,) their section nodes
        stiffness : (n, s, n, s) with s = 3 (layers + 1) unknowns a node, by layer and direction, N/m
        """
        nodes, local = np.unique(self.corners[elements], return_inverse=True)
        at = 2 * local.reshape(-1, 8) + self.above[elements]
        layers = len(self.kinds)
        result = np.zeros((len(nodes), layers + 1, 3, len(nodes), layers + 1, 3))
        for kind, stiffness in enumerate(self.stiffness):
            one = np.zeros((2 * len(nodes), 2 * len(nodes), 3, 3))
            for corners, matrix in zip(at, stiffness[elements], strict=True):
                one[corners[:, None], corners] += matrix
            both_ends = one.reshape(len(nodes), 2, len(nodes), 2, 3, 3).transpose(0, 1, 4, 2, 3, 5)
            for layer in np.flatnonzero(self.kinds == kind):
                result[:, layer : layer + 2, :, :, layer : layer + 2] += both_ends
        unknowns = 3 * (layers + 1)
        return nodes, result.reshape(len(nodes), unknowns, len(nodes), unknowns)


def _layer(
    mesh: SectorMesh, quads: Integers, height: float, incompatible_modes: bool
) -> tuple[Integers, Integers, Floats]:
    """Section nodes, ends and matrices of one layer, whose upper end is turned, and its unknowns with it."""
    section = mesh.section
    angle = mesh.twist_rate * height
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    lower = np.column_stack([section.points, np.zeros(len(section.points))])
    upper = lower @ turn.T + [0.0, 0.0, height]
    bottom = section.quads[quads]
    nodes, stiffness = element_stiffness(
        np.concatenate([lower, upper]),
        np.concatenate([bottom, bottom + len(lower)], axis=1),
        mesh.gear.material,
        incompatible_modes,
    )
    above, corners = np.divmod(nodes, len(lower))
    turns = np.where(above[..., None, None] == 1, turn, np.eye(3))
    blocks = stiffness.reshape(-1, 8, 3, 8, 3).transpose(0, 1, 3, 2, 4)
    return corners, above, np.asarray(turns.transpose(0, 1, 3, 2)[:, :, None] @ blocks @ turns[:, None])
