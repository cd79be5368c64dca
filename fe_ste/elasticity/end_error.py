"""What bricks err by under loads near an end face, beyond what they err by inside the face width.

An end face stands on the flank of a helical tooth under an acute or obtuse angle, and layers of bricks are too thick to
follow the field at such an edge. As in `fe_ste.elasticity.brick_error` the bricks behind the flank are laid on a plane
surface, which ends at an edge here. The truth is that of a wedge (`fe_ste.elasticity.halfspace.wedge_images`).

Along the edge all bricks are taken as those at the middle of the profile. Then bricks and truth are solved wave number
by wave number: one row of bricks, and the Fourier transform of 1 / distance, 2 K_0(wave number times distance).
"""

from __future__ import annotations

import numpy as np
from scipy.special import k0

from fe_ste.elasticity.brick_error import BLOCK_MARGIN, block_bricks, flank_spacing, flat_block, unknowns_of
from fe_ste.elasticity.bricks import stiffness_matrix
from fe_ste.elasticity.hexmesh import SectorMesh
from fe_ste.tools.arrays import Floats, Integers

#: Wave numbers; errors are found up to this many nodes along the profile.
WAVES = 8

#: Layers next to an end whose loads are corrected, and layers of nodes of the bricks.
END_LAYERS = 5
_LAYERS = 8

#: Rows of bricks behind those of the flat block, each this much deeper than the one before it: to no displacement.
_DEEPER = 6
_GROWTH = 1.5

#: Points of the integrals over a layer, and wave numbers on either side that the nodes cannot tell from one.
_POINTS = 12
_ALIASES = 5


def end_errors(mesh: SectorMesh, side: int, images: Floats, incompatible_modes: bool = True) -> tuple[Floats, Floats]:
    """Displacement of the flank nodes under tent loads by the bricks less the true one, less that inside the face.

    Parameters
    ----------
    mesh : with layers of one thickness
    side : loaded flank: +1 counter-clockwise, -1 clockwise
    images : (2, n, 3) image loads behind the lower and the upper end
    incompatible_modes : see `fe_ste.elasticity.bricks.stiffness_matrix`

    Returns
    -------
    lower, upper : (2 w - 1, r, l)
        By nodes along the profile from the load to the place read, from -w + 1 to w - 1 with w = `WAVES`; by layer
        read and layer loaded, `END_LAYERS` each, counted from the end; m/N.
    """
    loaded = np.arange(END_LAYERS)
    middle = END_LAYERS
    inside = _Row(mesh, side, 1, 2 * END_LAYERS + 1, incompatible_modes)
    known = inside.error(np.array([middle]), None)[..., 0]
    errors = []
    for end, of_end in zip((-1, 1), images, strict=True):
        error = _Row(mesh, side, end, _LAYERS, incompatible_modes).error(loaded, of_end)[:, :END_LAYERS]
        # Layers of the row inside run from the upper end downwards.
        error -= known[:, middle + end * (loaded[:, None] - loaded)]
        errors.append(_by_distance(error))
    return errors[0], errors[1]


def _wave_numbers() -> Floats:
    """Phases from node to node along the profile: half a step off zero, as the far field is not asked for."""
    return np.asarray((np.arange(WAVES) + 0.5) * np.pi / WAVES)


def _by_distance(transform: Floats) -> Floats:
    """Sum waves to a function of the nodes from load to place."""
    away = np.arange(1 - WAVES, WAVES)
    waves = np.exp(1j * _wave_numbers()[:, None] * away) / WAVES
    return np.asarray(np.einsum("krl,kj->jrl", transform, waves).real)


class _Row:
    """One row of bricks along the layers, as deep as the block, repeated along the profile."""

    def __init__(self, mesh: SectorMesh, side: int, end: int, layers: int, incompatible_modes: bool) -> None:
        self._mesh, self._end, self._layers = mesh, end, layers
        arc, self._layer, self._shear, self._cosine = flank_spacing(mesh, side)
        self._step = float(arc[1] - arc[0])
        points, numbers = flat_block(mesh, side)
        block = points.reshape(*numbers.shape, 3)[:, BLOCK_MARGIN + len(arc) // 2]
        behind = block[:, block.shape[1] // 2]
        across = block[0, 1] - block[0, 0]
        deeper = np.cumsum(_GROWTH ** np.arange(1, _DEEPER + 1))[:, None] * (behind[-1] - behind[-2])
        behind = np.concatenate([behind, behind[-1] + deeper])
        near = behind[:, None] - end * np.arange(layers)[:, None] * across
        places = np.stack([near, near + [self._step, 0.0, 0.0]], axis=1).reshape(-1, 3)
        nodes = np.arange(len(places)).reshape(len(behind), 2, layers)
        matrix = stiffness_matrix(places, block_bricks(places, nodes), mesh.gear.material, incompatible_modes)
        first, second = (unknowns_of(nodes[:, x].ravel()) for x in (0, 1))
        self._own = (matrix[first][:, first] + matrix[second][:, second]).toarray()
        self._next = matrix[first][:, second].toarray()
        self._nodes = np.arange(len(behind) * layers).reshape(len(behind), layers)

    def error(self, loaded: Integers, images: Floats | None) -> Floats:
        """Transform (w, layers, loads) of bricks less truth; without images the row has no end, but is held there."""
        return np.asarray(self._bricks(loaded, images is not None) - self._truth(loaded, images))

    def _bricks(self, loaded: Integers, ends: bool) -> Floats:
        held = np.zeros(self._nodes.shape, dtype=bool)
        held[-1] = held[:, -1] = True
        held[:, 0] |= not ends
        free = unknowns_of(self._nodes[~held])
        mass = np.zeros((self._layers, self._layers))
        for left in range(self._layers - 1):
            mass[left : left + 2, left : left + 2] += np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
        normal = 3 * self._nodes[0] + 2
        loads = np.zeros((self._nodes.size * 3, len(loaded)))
        loads[normal] = (mass / mass.sum(axis=0))[:, loaded]
        own, following = (part[np.ix_(free, free)] for part in (self._own, self._next))
        moved = np.zeros((WAVES, len(loads), len(loaded)), dtype=complex)
        for wave, phase in enumerate(_wave_numbers()):
            across = following * np.exp(1j * phase)
            tent = (2.0 + np.cos(phase)) / 3.0
            moved[wave, free] = np.linalg.solve(own + across + across.conj().T, tent * loads[free])
        return moved[:, normal]

    def _truth(self, loaded: Integers, images: Floats | None) -> Floats:
        material = self._mesh.gear.material
        places, shares = np.polynomial.legendre.leggauss(_POINTS)
        # The substitution gathers points at both ends, where the field of a layer's own load is a logarithm.
        s = (places + 1.0) / 2.0
        within = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        shares = 15.0 * shares * (s * (1.0 - s)) ** 2
        aliases = _wave_numbers()[:, None] + 2.0 * np.pi * np.arange(-_ALIASES, _ALIASES + 1)
        wave = (aliases / self._step)[:, :, None, None]
        tent = np.sinc(aliases / (2.0 * np.pi)) ** 2 / self._step
        read = self._layer * np.arange(self._layers)[:, None]
        found = np.zeros((WAVES, self._layers, len(loaded)), dtype=complex)
        for column, layer in enumerate(loaded.tolist()):
            total = 1.0 if layer else 0.5  # integral of the tent in layers, its halves 1/2 each
            for below, part in ((layer - 1, within), (layer, 1.0 - within)):
                if below < 0:
                    continue
                place = self._layer * (below + within)
                field = 2.0 * k0(np.abs(wave) * np.abs(read - place) / self._cosine)
                for strength, squares, product in () if images is None else images.tolist():
                    apart = np.sqrt(squares * (read**2 + place**2) + product * read * place) / self._cosine
                    field += strength * 2.0 * k0(np.abs(wave) * apart)
                field = field * np.exp(1j * wave * self._end * self._shear * (read - place))
                found[..., column] += np.einsum("km,kmrz,z->kr", tent, field, part * shares)
            found[..., column] /= total
        return found * ((1.0 - material.poissons_ratio**2) / (np.pi * material.youngs_modulus))
