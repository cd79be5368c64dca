"""Modal damping on arrays of coordinates: a share of critical damping for each mode of a gearbox.

With the mass matrix M and the undamped modes phi_i of unit modal mass and angular frequency w_i at rest, the matrix

    C = M Phi diag(2 zeta_i w_i) Phi^T M

gives each mode its share zeta_i of critical damping and leaves free rolling undamped. A gearbox with planets changes
as its carriers turn by an angle: what planet j did before is then divided among all planets i, and turned along with
them. With N equally spaced planets, a_ij the angle from planet j before to planet i now, and R a rotation in the plane,

    S_ij = w_ij R(a_ij),   w_ij = (1 + 2 sum_m cos(m a_ij) [+ (-1)^(i-j) for even N]) / N,

which is an orthogonal matrix: the multi-blade coordinates of Coleman and Feingold (1958), NACA report 1351, written for
the planets themselves. Damping forces are - S C S^T v.

Numbers here become part of machine code: `fe_ste.tools.compilation` recompiles when this file changes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exugear.system.kernels.coordinates import SPIN, TILT
from exugear.system.kernels.products import TILE, add_symmetric
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.bundles import cached_bundle
from fe_ste.tools.compilation import kernel
from fe_ste.tools.octets import SIZE, aligned_zeros

MOVED, ACTING, TURNED = range(3)
"""Rows of the memory of `add_modal_damping`; in the last one cosine and sine of the angle of each set's carrier."""


class ModalArrays(NamedTuple):
    """Modal damping of a system of c coordinates, with s sets of planets."""

    tiles: Floats
    """The symmetric matrix C, N s/m, as `exugear.system.kernels.products.symmetric_tiles` lays it out."""
    frame: Integers
    """(s,) coordinate of the spin of each set's carrier, -1 for a carrier that does not turn."""
    first: Integers
    """(s + 1,) first planet of each set."""
    planets: Integers
    """(p, 6) coordinates of each planet, -1 where it has none."""
    place: Floats
    """(p, 2) cosine and sine of the angle of each planet around its carrier."""
    equal: Integers
    """(s,) 1 for three or more equally spaced planets; other planets each take their own share along."""


@kernel
def share_of_planet(i: int, j: int, count: int, cosine: float) -> float:
    """Weight w_ij of planet j before in planet i now, `cosine` being that of the angle from one to the other."""
    total = 1.0
    before = 1.0
    now = cosine
    for _ in range((count - 1) // 2):
        total += 2.0 * now
        after = 2.0 * cosine * now - before  # cosines of multiples by Chebyshev's recurrence
        before = now
        now = after
    # What alternates from planet to planet keeps its sign in each.
    if count % 2 == 0:
        total += 1.0 - 2.0 * ((i - j) % 2)
    return total / count


@kernel
def turn_planets(turned: Floats, modal: ModalArrays, sense: float, given: Floats, out: Floats) -> None:
    """Set the planets' entries of `out` to S given with the sense 1, to S^T given with -1; others stay as they are.

    `turned` has cosine and sine of the angle of each set's carrier, one after the other.
    """
    for s in range(modal.frame.size):
        begin = modal.first[s]
        count = modal.first[s + 1] - begin
        cosine = turned[2 * s]
        sine = sense * turned[2 * s + 1]
        for a in range(count):
            own = modal.place[begin + a]
            # Sums over the planets stay in registers.
            x = y = z = tilt_x = tilt_y = spin = 0.0
            for b in range(count):
                if modal.equal[s] == 0 and a != b:
                    continue
                # From the place of one planet before to that of the other now; back, the other way round.
                other = modal.place[begin + b]
                along = own[0] * other[0] + own[1] * other[1]
                across = own[1] * other[0] - own[0] * other[1]
                c = along * cosine - across * sine
                d = across * cosine + along * sine
                weight = 1.0
                if modal.equal[s] == 1:
                    weight = share_of_planet(a, b, count, c)
                c *= weight
                d *= weight
                of = modal.planets[begin + b]
                if of[0] >= 0:
                    x += c * given[of[0]] - d * given[of[1]]
                    y += d * given[of[0]] + c * given[of[1]]
                    z += weight * given[of[2]]
                    tilt_x += c * given[of[TILT]] - d * given[of[TILT + 1]]
                    tilt_y += d * given[of[TILT]] + c * given[of[TILT + 1]]
                if of[SPIN] >= 0:
                    spin += weight * given[of[SPIN]]
            to = modal.planets[begin + a]
            if to[0] >= 0:
                out[to[0]], out[to[1]], out[to[2]] = x, y, z
                out[to[TILT]], out[to[TILT + 1]] = tilt_x, tilt_y
            if to[SPIN] >= 0:
                out[to[SPIN]] = spin


@kernel
def add_modal_damping(q: Floats, v: Floats, modal: ModalArrays | None, memory: Floats, f: Floats) -> float:
    """Add the damping forces of all modes to f and return the power that they dissipate (W).

    `memory` is that of `modal_memory`. Without modal damping (None) nothing is added, and nothing is compiled.
    """
    if modal is None:
        return 0.0
    moved = memory[MOVED]
    acting = memory[ACTING]
    size = min(v.size, acting.size)  # a solver's arrays may go on behind the coordinates, where the tiles are zero
    acting[:] = 0.0
    for i in range(size):
        moved[i] = v[i]
    turned = memory[TURNED]
    for s in range(modal.frame.size):
        angle = q[modal.frame[s]] if modal.frame[s] >= 0 else 0.0
        turned[2 * s], turned[2 * s + 1] = math.cos(angle), math.sin(angle)
    turn_planets(turned, modal, -1.0, v, moved)
    add_symmetric(modal.tiles, 0, acting.size, moved, acting)
    power = 0.0
    for i in range(size):
        power += moved[i] * acting[i]
        moved[i] = acting[i]
    turn_planets(turned, modal, 1.0, acting, moved)
    for i in range(size):
        f[i] -= moved[i]
    return power


def modal_matrix(q: Floats, modal: ModalArrays | None) -> Floats:
    """Damping matrix (size, size) at coordinates q; zero without modal damping.

    Examples
    --------
    >>> modal_matrix(np.zeros(2), None)
    array([[0., 0.],
           [0., 0.]])
    """
    matrix = np.zeros((q.size, q.size))
    if modal is not None:
        memory = modal_memory(modal)
        for rate, column in zip(np.eye(q.size), matrix, strict=True):  # the matrix is symmetric
            add_modal_damping(q, -rate, cached_bundle(modal), memory, column)
    return matrix


def modal_memory(modal: ModalArrays | None) -> Floats:
    """Memory for `add_modal_damping`, (3, c) with c filled up; what is filled up stays zero."""
    if modal is None:
        return np.zeros((3, 0))
    rows = math.isqrt(2 * modal.tiles.size // TILE)  # n (n + 1) / 2 tiles
    return aligned_zeros(3 * SIZE * rows).reshape(3, -1)
