r"""Compiled geometry of gear meshes on arrays of coordinates: what deflects, at what rate, and where the gears stand.

Each mesh lives in a frame that carries its line of centres: ground, or a carrier of spin psi. With R the
rotation by psi, p a gear's place relative to the frame's axis and S = z x,

    z_b   = R^T (p_b + x_b) - p_b,  tilts likewise,  spin_b - psi          displacements seen from the frame
    delta = sum_b W_b . z_b                                                deflection, W constant
    pmc   = phase + (spin_1 - psi) cycles                                  position in the mesh cycle
    f     = -F dg/dq,  g = sum_b V_b . z_b                                 generalized force of a scalar force F

A law along a row that resists misalignment gamma has the deflection and the moment of
`exugear.system.tooth_mesh.contact_state` instead: e = delta - (zt + w) (gamma - g0) for delta, and + M d gamma/dq
beside it.

The row g does not change when everything turns with psi: the carrier's share of the force balances moments exactly.
Which force F a deflection raises is the matter of the mesh laws (`exugear.system.tooth_mesh.laws`). Errors of pitch and
run-out, given over a revolution of each gear, are subtracted from the deflection of any law.

Coordinates are those of `exugear.system.kernels.coordinates`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exugear.system.kernels.coordinates import AXIAL, BODY_SIZE, SPIN, TILT
from exugear.system.tooth_mesh.kernels.table_law import (
    NOMINAL_DISTANCE,
    NOMINAL_MISALIGNMENT,
    TableArrays,
    piece_at,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled, kernel

FRAME = 2 * BODY_SIZE
"""Local coordinates of a mesh: six of gear 1, six of gear 2, then the spin of the frame."""
ROW_SIZE = FRAME + 1
SPIN_1 = SPIN
SPIN_2 = BODY_SIZE + SPIN

DEFLECTION, RATE, PMC, STIFFNESS, FORCE, ENERGY, DAMPED_POWER, CYCLE_POWER, OTHER_POWER, OUTSIDE = range(10)
"""Columns of `mesh_state`.

Deflection (m), its rate (m/s), pmc in [0, 1), tangent stiffness (N/m), F_bt (N, negative on the other flank), elastic
energy (J); powers (W): damped, of the stiffness that changes with pmc, of a force that is not conjugate to its
deflection; 1 where the mesh is outside its table.
"""
STATE_SIZE = 10
TILT_STIFFNESS, TILT_DAMPING, TILT_LEVER, TILT_MOMENT, TILT_REST = range(5)
"""Columns of `MeshArrays.tilt`."""
TILT_COLUMNS = 5
WAY_COLUMNS, MOMENT_BEYOND = 8, 4
"""Columns of `MeshArrays.way`, and the first of the moment in them."""


class MeshArrays(NamedTuple):
    """All meshes of a system as arrays; m meshes, n cubic pieces at most."""

    coordinates: Integers
    """(m, 13) position of each local coordinate in the state, -1 where there is none."""
    axis: Floats
    """(m, 2, 2) axis of each gear relative to the frame's axis at zero angles, m."""
    form: Integers
    """(m,) number of the law's compiled form, which `exugear.system.tooth_mesh.laws.forms` chooses by."""
    deflection: Floats
    force: Floats
    """(m, 12) rows W and V, m/m and m/rad."""
    cycles: Floats
    """(m,) mesh cycles per rad of gear 1 relative to the frame, signed by the loaded flank."""
    phase: Floats
    """(m,) position in the mesh cycle at zero angles."""
    pieces: Integers
    """(m,) number of equal pieces over the mesh cycle."""
    stiffness: Floats
    """(m, n, c) coefficients of the law over each piece; of a stiffness four of a cubic, N/m."""
    damping: Floats
    """(m,) N s/m."""
    tilt: Floats
    """(m, 5) of a law along a row that resists misalignment: tilt stiffness kg (N m/rad) and damping (N m s/rad),
    lever zt (m), moment F0 (zc - zt) (N m) and misalignment g0 (rad); zeros where it does not."""
    way_pieces: Integers
    """(m,) number of equal pieces of the load's ways along the face; 0 where it stays."""
    way: Floats
    """(m, w, 8) coefficients over each piece of the mesh cycle: of the way w of what a little more deflection adds:
    to the load, m, then of the moment F0 (c - w) that the load itself has beyond it, N m."""
    line_of_action: Floats
    """(m,) F_bt per scalar mesh force."""
    error_pieces: Integers
    """(m, 2) number of equal cubic pieces of each gear's error over its revolution; 0 for no error."""
    error: Floats
    """(m, 2, e, 4) coefficients of the error over each piece, m along the transverse line of action."""
    table: TableArrays
    """Tables of the meshes that follow one."""

    def one(self, n: int) -> MeshArrays:
        """Arrays of mesh n alone."""
        table = TableArrays._make(values[n : n + 1] for values in self.table)
        others = {name: values[n : n + 1] for name, values in self._asdict().items() if name != "table"}
        return MeshArrays(**others, table=table)


def periodic_cubic(samples: Floats) -> Floats:
    """Coefficients of a periodic C1 cubic through equally spaced samples over one cycle.

    Slopes are central differences (Catmull and Rom 1974), so that a sample acts on its neighbourhood only.

    Parameters
    ----------
    samples : (n,) values at pmc = 0, 1/n, ...; one sample means a constant

    Returns
    -------
    (n, 4) coefficients c of sum_j c_j t^j on each piece, t from 0 to 1

    Examples
    --------
    >>> periodic_cubic(np.array([1.0, 2.0, 1.0, 0.0]))[0]
    array([ 1.,  1.,  1., -1.])
    """
    values = np.asarray(samples, dtype=np.float64)
    following = np.roll(values, -1)
    slope = 0.5 * (following - np.roll(values, 1))
    next_slope = np.roll(slope, -1)
    rise = following - values
    return np.stack([values, slope, 3.0 * rise - 2.0 * slope - next_slope, slope + next_slope - 2.0 * rise], axis=1)


@kernel
def stiffness_at(coefficients: Floats, pieces: int, pmc: float) -> tuple[float, float]:
    """Stiffness (N/m) and its slope per cycle at any position in the mesh cycle; coefficients (n, 4)."""
    # pmc is unwrapped: only its fraction tells the piece, and t in [0, 1) the position in that piece.
    scaled = (pmc - math.floor(pmc)) * pieces
    piece = piece_at(scaled, pieces)
    t = scaled - piece
    c = coefficients[piece]
    value: float = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
    # The cubic's derivative is per piece; there are `pieces` of them to a cycle.
    slope = (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])) * pieces
    return value, slope


@kernel
def way_at(coefficients: Floats, pieces: int, pmc: float) -> tuple[float, float, float, float]:
    """Way (m) and moment (N m) of coefficients (n, 8), each with its slope per cycle, as `stiffness_at`."""
    scaled = (pmc - math.floor(pmc)) * pieces
    piece = piece_at(scaled, pieces)
    t = scaled - piece
    c = coefficients[piece]
    way: float = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
    moving = (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])) * pieces
    moment: float = c[4] + t * (c[5] + t * (c[6] + t * c[7]))
    return way, moving, moment, (c[5] + t * (2.0 * c[6] + t * 3.0 * c[7])) * pieces


@kernel
def frame_row(q: Floats, index: Integers, axis: Floats, row: Floats, gradient: Floats, turning: Floats) -> float:
    """Value of sum W . z with its gradient (13,) and the gradient's derivative to psi (13,) for one mesh."""
    psi = q[index[FRAME]] if index[FRAME] >= 0 else 0.0
    c = math.cos(psi)
    s = math.sin(psi)
    value = 0.0
    gradient[:] = 0.0
    turning[:] = 0.0
    for end in range(2):
        o = BODY_SIZE * end
        # Translations and tilts are vectors in the plane, both turned back by psi. Only translations have a lever p.
        for pair in (0, TILT):
            if index[o + pair] < 0:
                continue
            px, py = (axis[end, 0], axis[end, 1]) if pair == 0 else (0.0, 0.0)
            x = px + q[index[o + pair]]
            y = py + q[index[o + pair + 1]]
            lx = c * x + s * y
            ly = c * y - s * x
            wx = row[o + pair]
            wy = row[o + pair + 1]
            value += wx * (lx - px) + wy * (ly - py)
            # dz/dq = R^T, so the gradient is the row turned forward; its derivative to psi is that turned by 90 deg.
            gradient[o + pair] = c * wx - s * wy
            gradient[o + pair + 1] = s * wx + c * wy
            turning[o + pair] = -gradient[o + pair + 1]
            turning[o + pair + 1] = gradient[o + pair]
            # dl/dpsi = -S l, l the gear's place from the frame's axis as the frame sees it; twice gives -l.
            gradient[FRAME] += wx * ly - wy * lx
            turning[FRAME] -= wx * lx + wy * ly
        # Along z and about it the frame's turning changes nothing but the spin that is seen.
        if index[o + AXIAL] >= 0:
            value += row[o + AXIAL] * q[index[o + AXIAL]]
            gradient[o + AXIAL] = row[o + AXIAL]
        spin = q[index[o + SPIN]] if index[o + SPIN] >= 0 else 0.0
        value += row[o + SPIN] * (spin - psi)
        gradient[o + SPIN] = row[o + SPIN]
        gradient[FRAME] -= row[o + SPIN]
    return value


@kernel
def error_at(m: int, end: int, angle: float, meshes: MeshArrays) -> tuple[float, float, float]:
    """Error (m) of one gear of mesh m at its angle (rad) seen from the frame, with two derivatives by the angle."""
    pieces = meshes.error_pieces[m, end]
    if pieces == 0:
        return 0.0, 0.0, 0.0
    # As in `stiffness_at`, over a revolution instead of a mesh cycle.
    turns = angle / (2.0 * math.pi)
    scaled = (turns - math.floor(turns)) * pieces
    piece = piece_at(scaled, pieces)
    t = scaled - piece
    c = meshes.error[m, end, piece]
    per_rad = pieces / (2.0 * math.pi)
    value: float = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
    slope = (c[1] + t * (2.0 * c[2] + t * 3.0 * c[3])) * per_rad
    return value, slope, (2.0 * c[2] + 6.0 * t * c[3]) * per_rad * per_rad


@kernel
def net_deflection(
    q: Floats, m: int, meshes: MeshArrays, row: Floats, side: float, gradient: Floats, turning: Floats, bend: Floats
) -> float:
    """Value of a row less the gears' errors (side 1; plus them for the other flank, -1), gradient as `frame_row`.

    The errors' second derivatives by the two spins go to `bend` (2,).
    """
    index = meshes.coordinates[m]
    value: float = frame_row(q, index, meshes.axis[m], row, gradient, turning)
    psi = q[index[FRAME]] if index[FRAME] >= 0 else 0.0
    for end in range(2):
        o = BODY_SIZE * end + SPIN
        spin = q[index[o]] if index[o] >= 0 else 0.0
        error, slope, curvature = error_at(m, end, spin - psi, meshes)
        value -= side * error
        # The error depends on spin - psi: what its slope adds to one it takes from the other.
        gradient[o] -= side * slope
        gradient[FRAME] += side * slope
        bend[end] = -side * curvature
    return value


@kernel
def mesh_pmc(q: Floats, m: int, meshes: MeshArrays) -> float:
    """Position in the mesh cycle of mesh m, unwrapped."""
    spin = q[meshes.coordinates[m, SPIN_1]] if meshes.coordinates[m, SPIN_1] >= 0 else 0.0
    psi = q[meshes.coordinates[m, FRAME]] if meshes.coordinates[m, FRAME] >= 0 else 0.0
    pmc: float = meshes.phase[m] + meshes.cycles[m] * (spin - psi)
    return pmc


@kernel
def load_way(m: int, pmc: float, meshes: MeshArrays) -> tuple[float, float, float, float]:
    """Way w (m) of the load of mesh m at a position in its cycle, its slope; moment F0 (c - w) (N m), its slope."""
    if meshes.way_pieces[m] == 0:
        return 0.0, 0.0, 0.0, 0.0
    return way_at(meshes.way[m], meshes.way_pieces[m], pmc)


@kernel
def row_dot(index: Integers, row: Floats, v: Floats) -> float:
    """Scalar product of a local row (13,) with the state's entries it belongs to."""
    total = 0.0
    for i in range(ROW_SIZE):
        if index[i] >= 0:
            total += row[i] * v[index[i]]
    return total


@kernel
def relative_spin(v: Floats, index: Integers, end: int) -> float:
    """Spin of a gear of a mesh seen from the mesh's frame; of coordinates or of their rates."""
    spin = v[index[BODY_SIZE * end + SPIN]] if index[BODY_SIZE * end + SPIN] >= 0 else 0.0
    psi = v[index[FRAME]] if index[FRAME] >= 0 else 0.0
    difference: float = spin - psi
    return difference


@compiled
def gear_position(q: Floats, m: int, meshes: MeshArrays, row: Floats, nominal: float) -> float:
    """Centre distance (m) or misalignment (rad) of mesh m by its row."""
    gradient = np.empty(ROW_SIZE)
    turning = np.empty(ROW_SIZE)
    index = meshes.coordinates[m]
    value: float = nominal + frame_row(q, index, meshes.axis[m], row, gradient, turning)
    return value


@kernel
def turn_rows(turning: Floats, bend: Floats, factor: float, out: Floats) -> None:
    """Add factor times the second derivatives of a row's value, (13, 13)."""
    # The value is bilinear in psi and the others: a full row and column of psi, whose corner counts once.
    for i in range(ROW_SIZE):
        out[i, FRAME] += factor * turning[i]
        if i != FRAME:
            out[FRAME, i] += factor * turning[i]
    # An error bends with spin - psi.
    for end in range(2):
        o = BODY_SIZE * end + SPIN
        out[o, o] += factor * bend[end]
        out[FRAME, FRAME] += factor * bend[end]
        out[o, FRAME] -= factor * bend[end]
        out[FRAME, o] -= factor * bend[end]


@kernel
def rate_gradient(v: Floats, index: Integers, turning: Floats, bend: Floats, out: Floats) -> None:
    """Differentiate a row's rate by the coordinates, (13,)."""
    # d(gradient . v)/dq is the second derivative times v: the same pattern as in `turn_rows`.
    psi_rate = v[index[FRAME]] if index[FRAME] >= 0 else 0.0
    for i in range(ROW_SIZE):
        out[i] = turning[i] * psi_rate
    out[FRAME] = row_dot(index, turning, v)
    for end in range(2):
        change = bend[end] * relative_spin(v, index, end)
        out[BODY_SIZE * end + SPIN] += change
        out[FRAME] -= change


@compiled
def gear_positions(q: Floats, meshes: MeshArrays, out: Floats) -> None:
    """Fill (m, 2): centre distance (m) and misalignment of the loaded flank (rad) of each mesh."""
    table = meshes.table
    for m in range(meshes.coordinates.shape[0]):
        out[m, 0] = gear_position(q, m, meshes, table.centre[m], table.nominal[m, NOMINAL_DISTANCE])
        out[m, 1] = gear_position(q, m, meshes, table.misalignment[m], table.nominal[m, NOMINAL_MISALIGNMENT])
