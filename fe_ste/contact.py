"""Tooth contact of a gear pair at one position: rigid gap, compliance of the contact cells, complementarity.

Frame. Gear 1 turns counter-clockwise and drives. The x axis runs from its centre to the pitch point, z along the
axes, z = 0 in the middle of the common face width. The flanks in contact are the counter-clockwise flanks of gear 1
and of an external gear 2, and the clockwise flanks of an internal gear 2's teeth. Tooth pair 0 touches at the pitch
point for rotation 0; pair j is j base pitches ahead on the path of contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

from fe_ste.compilation import compiled, summing
from fe_ste.elasticity import FlankCompliance
from fe_ste.gears import GearPair
from fe_ste.halfspace import rectangle_integral

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

#: A cell cut by a tip edge to less than this part of its width is joined to its neighbour.
_LEAST_CELL = 0.2
#: Beyond this many half sides a cell acts as its resultant with its second moments (error below 1e-3 of its part).
_FAR = 6.0


class ContactError(RuntimeError):
    """A contact position that could not be solved; the message says why."""


@dataclass(frozen=True)
class ContactSettings:
    """Discretisation of the contact.

    Parameters
    ----------
    slices : int
        Slices along the common face width.
    cells : int
        Cells of a slice across the window that travels with the contact line.
    window : float
        Half width of that window in Hertzian half widths at the largest mean line load.
    """

    slices: int = 48
    cells: int = 9
    window: float = 1.8

    def __post_init__(self) -> None:
        """Refuse what cannot resolve a contact."""
        for key, least in (("slices", 3), ("cells", 3), ("window", 1.0)):
            if not getattr(self, key) >= least:
                raise ValueError(f"contact setting {key} = {getattr(self, key)}: must be at least {least}")


class FlankPair(NamedTuple):
    """Numbers of the rigid kinematics of two conjugate flanks; lengths in m, angles in rad."""

    base_radius_1: float
    base_radius_2: float
    centre_distance: float
    working_involute: float
    working_roll: float
    pitch_1: float
    pitch_2: float
    twist_1: float
    twist_2: float
    base_helix_cosine: float
    kind: float  # +1 external, -1 internal
    form_roll_1: float
    tip_roll_1: float
    tip_radius_2: float

    @classmethod
    def from_pair(cls, pair: GearPair, form_roll: float, tip_roll: float) -> FlankPair:
        """Collect the numbers of `pair`; `form_roll` and `tip_roll` bound the flank of gear 1."""
        one, two, angle = pair.pinion, pair.gear, pair.working_pressure_angle
        return cls(
            base_radius_1=one.base_radius,
            base_radius_2=two.base_radius,
            centre_distance=pair.centre_distance,
            working_involute=math.tan(angle) - angle,
            working_roll=math.tan(angle),
            pitch_1=one.angular_pitch,
            pitch_2=two.angular_pitch,
            twist_1=math.tan(one.base_helix_angle) / one.base_radius,
            twist_2=math.tan(two.base_helix_angle) / two.base_radius,
            base_helix_cosine=math.cos(one.base_helix_angle),
            kind=-1.0 if two.internal else 1.0,
            form_roll_1=form_roll,
            tip_roll_1=tip_roll,
            tip_radius_2=two.tip_radius,
        )


@compiled
def _polar_on_gear_2(pair: FlankPair, roll: float, axial: float, tooth: int, rotation: float) -> tuple[float, float]:
    """Radius and polar angle, about the axis of gear 2, of a flank point of gear 1."""
    radius = pair.base_radius_1 * math.sqrt(1.0 + roll * roll)
    angle = pair.working_involute - (roll - math.atan(roll)) + rotation + tooth * pair.pitch_1 + pair.twist_1 * axial
    x = pair.centre_distance - pair.kind * radius * math.cos(angle)
    y = -pair.kind * radius * math.sin(angle)
    return math.sqrt(x * x + y * y), math.atan2(y, x)


@compiled
def rigid_gap(pair: FlankPair, roll: float, axial: float, tooth: int, rotation: float) -> tuple[float, float]:
    """Gap between a flank point of gear 1 and the unmodified flank of gear 2, along the contact normal.

    The gap is the arc by which gear 2 would have to turn to touch the point, as a length on the normal: exact, with
    the sides of the teeth, tip corners and centre distance as they are.

    Parameters
    ----------
    pair : FlankPair
    roll : float
        Roll angle of the point on gear 1, rad.
    axial : float
        Its axial position, m.
    tooth : int
        Tooth pair.
    rotation : float
        Rotation of gear 1, rad; gear 2 is where it rolls with it.

    Returns
    -------
    gap : float
        m; infinite inside the base circle of gear 2.
    gear_roll : float
        Roll angle on gear 2 at the point's radius, rad.
    """
    radius, angle = _polar_on_gear_2(pair, roll, axial, tooth, rotation)
    square = (radius / pair.base_radius_2) ** 2 - 1.0
    if square <= 0.0:
        return math.inf, 0.0
    gear_roll = math.sqrt(square)
    rolled = -pair.kind * (rotation * pair.pitch_2 / pair.pitch_1 + tooth * pair.pitch_2)
    flank = pair.working_involute - (gear_roll - math.atan(gear_roll)) + rolled + pair.twist_2 * axial
    return pair.kind * pair.base_radius_2 * (angle - flank) * pair.base_helix_cosine, gear_roll


@compiled
def _tip_limit(pair: FlankPair, axial: float, tooth: int, rotation: float) -> float:
    """Least roll angle on gear 1 that the tip circle of gear 2 reaches, by bisection; within gear 1's flank."""
    low, high = pair.form_roll_1, pair.tip_roll_1
    if pair.kind * (_polar_on_gear_2(pair, low, axial, tooth, rotation)[0] - pair.tip_radius_2) <= 0.0:
        return low
    if pair.kind * (_polar_on_gear_2(pair, high, axial, tooth, rotation)[0] - pair.tip_radius_2) >= 0.0:
        return high
    for _ in range(60):
        middle = 0.5 * (low + high)
        if pair.kind * (_polar_on_gear_2(pair, middle, axial, tooth, rotation)[0] - pair.tip_radius_2) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@compiled
def _lay_cells(
    pair: FlankPair, rotation: float, teeth: IntArray, axial: FloatArray, half_window: float, count: int
) -> tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray, FloatArray, BoolArray]:
    """Cells around the contact lines: tooth, slice, mid arc length, half width, gap, roll on gear 2, cut by an edge.

    Arc lengths u = r_b roll^2 / 2 run along the transverse involute of gear 1.
    """
    most = len(teeth) * len(axial) * count
    tooth_of, slice_of = np.empty(most, np.int64), np.empty(most, np.int64)
    middle, half, gap, gear_roll = np.empty(most), np.empty(most), np.empty(most), np.empty(most)
    cut = np.zeros(most, np.bool_)
    edges = np.empty(count + 1)
    step = 2.0 * half_window / count
    top = 0.5 * pair.base_radius_1 * pair.tip_roll_1**2
    used = 0
    for tooth in teeth:
        for layer in range(len(axial)):
            line = pair.working_roll + rotation + tooth * pair.pitch_1 + pair.twist_1 * axial[layer]
            lowest_roll = _tip_limit(pair, axial[layer], tooth, rotation)
            bottom = 0.5 * pair.base_radius_1 * lowest_roll**2
            if top - bottom < step:
                continue
            line = min(max(line, lowest_roll), pair.tip_roll_1)
            centre = 0.5 * pair.base_radius_1 * line**2
            number = 0
            for edge in range(count + 1):
                at = centre - half_window + edge * step
                at = min(max(at, bottom), top)
                if number == 0 or at > edges[number - 1]:
                    edges[number] = at
                    number += 1
            if number > 2 and edges[1] - edges[0] < _LEAST_CELL * step:
                for edge in range(1, number - 1):
                    edges[edge] = edges[edge + 1]
                number -= 1
            if number > 2 and edges[number - 1] - edges[number - 2] < _LEAST_CELL * step:
                edges[number - 2] = edges[number - 1]
                number -= 1
            for cell in range(number - 1):
                mean = 0.5 * (edges[cell] + edges[cell + 1])
                roll = math.sqrt(2.0 * mean / pair.base_radius_1)
                distance, other = rigid_gap(pair, roll, axial[layer], tooth, rotation)
                tooth_of[used], slice_of[used] = tooth, layer
                middle[used], half[used] = mean, 0.5 * (edges[cell + 1] - edges[cell])
                gap[used], gear_roll[used] = distance, other
                cut[used] = edges[cell] == bottom or edges[cell + 1] == top
                used += 1
    return (
        tooth_of[:used], slice_of[:used], middle[:used], half[:used], gap[:used], gear_roll[:used], cut[:used]
    )  # fmt: skip


@compiled
def _mean_inverse_distance(across: float, along: float, half_across: float, half_along: float) -> float:
    square = across * across + along * along
    if square > (_FAR * max(half_across, half_along)) ** 2:
        moments = half_across**2 * (2 * across**2 - along**2) + half_along**2 * (2 * along**2 - across**2)
        return (1.0 + moments / (6.0 * square * square)) / math.sqrt(square)
    return rectangle_integral(across, along, half_across, half_along) / (4.0 * half_across * half_along)


@summing
def _add_far(
    row: FloatArray, strength: float, roll: float, across_scale: float, shift: float, along: float, half_across: float,
    half_along: float, rolls: FloatArray, halves: FloatArray,
) -> None:  # fmt: skip
    """Add the resultants and second moments of the cells of one slice, seen from afar, to ``row``; no branches."""
    for j in range(len(rolls)):
        across = across_scale * (roll + rolls[j]) * (roll - rolls[j] - shift)
        half = 0.5 * (half_across + halves[j])
        inverse = 1.0 / (across * across + along * along)
        moments = half * half * (2 * across * across - along * along)
        moments += half_along * half_along * (2 * along * along - across * across)
        row[j] += strength * math.sqrt(inverse) * (1.0 + moments * inverse * inverse / 6.0)


@compiled
def _add_near(
    row: FloatArray, strength: float, roll: float, across_scale: float, shift: float, along: float, half_across: float,
    half_along: float, rolls: FloatArray, halves: FloatArray,
) -> None:  # fmt: skip
    """Add the cells of one slice, seen from near, to ``row``."""
    for j in range(len(rolls)):
        across = across_scale * (roll + rolls[j]) * (roll - rolls[j] - shift)
        half = 0.5 * (half_across + halves[j])
        row[j] += strength * _mean_inverse_distance(across, along, half, half_along)


@compiled
def _add_half_spaces(
    matrix: FloatArray,
    groups: IntArray,
    tooth: IntArray,
    axial: FloatArray,
    roll: FloatArray,
    half_across: FloatArray,
    half_along: float,
    pair: FlankPair,
    surface: FloatArray,
    ends: FloatArray,
    mirror: FloatArray,
) -> None:
    """Add the surface displacement of both half-spaces under uniform cell pressures of unit resultant.

    ``groups`` bounds the runs of cells of one tooth pair and slice; distances along the contact line are common to a
    run, and so is whether it is seen from near. ``surface`` is (1 - nu^2) / (pi E) of each gear, ``ends`` the axial
    position of its free end faces (+-), and ``mirror`` the strength of the image loads behind them.
    """
    scale = 0.5 * pair.base_radius_1
    from_afar = _FAR * max(half_along, half_across.max())
    along, strength = np.empty(5), np.empty(5)
    for g in range(len(groups) - 1):
        for h in range(g + 1):
            one, other = groups[g], groups[h]
            if tooth[one] != tooth[other]:
                continue
            apart, together = axial[one] - axial[other], axial[one] + axial[other]
            along[0], strength[0] = apart / pair.base_helix_cosine, surface[0] + surface[1]
            for image in range(4):
                body, sign = image // 2, 2.0 * (image % 2) - 1.0
                along[image + 1] = (together - 2.0 * sign * ends[body]) / pair.base_helix_cosine
                strength[image + 1] = mirror[body] * surface[body]
            rolls, halves = roll[other : groups[h + 1]], half_across[other : groups[h + 1]]
            shift = pair.twist_1 * apart
            for i in range(one, groups[g + 1]):
                row = matrix[i, other : groups[h + 1]]
                for load in range(5):
                    if strength[load] == 0.0:
                        continue
                    place = (strength[load], roll[i], scale, shift, along[load], half_across[i], half_along)
                    if abs(along[load]) >= from_afar:
                        _add_far(row, *place, rolls, halves)
                    else:
                        _add_near(row, *place, rolls, halves)


@summing
def _add_regular(
    matrix: FloatArray,
    groups: IntArray,
    tooth: IntArray,
    layer: IntArray,
    first: IntArray,
    weights: FloatArray,
    table: FloatArray,
    number: IntArray,
    first_tooth: int,
) -> None:
    """Add the regular compliance of one gear, see `SlicedCompliance`; ``groups`` as in `_add_half_spaces`."""
    read = np.empty(table.shape[4])
    for g in range(len(groups) - 1):
        for h in range(g + 1):
            one, other, end = groups[g], groups[h], groups[h + 1]
            block = table[number[tooth[one] - first_tooth, tooth[other] - first_tooth], layer[one], layer[other]]
            lowest, highest = first[other], first[other]
            for j in range(other, end):
                lowest, highest = min(lowest, first[j]), max(highest, first[j])
            for i in range(one, groups[g + 1]):
                for b in range(lowest, highest + 4):
                    read[b] = (
                        weights[i, 0] * block[first[i], b]
                        + weights[i, 1] * block[first[i] + 1, b]
                        + weights[i, 2] * block[first[i] + 2, b]
                        + weights[i, 3] * block[first[i] + 3, b]
                    )
                for j in range(other, end):
                    at = first[j]
                    matrix[i, j] += (
                        weights[j, 0] * read[at]
                        + weights[j, 1] * read[at + 1]
                        + weights[j, 2] * read[at + 2]
                        + weights[j, 3] * read[at + 3]
                    )


@compiled
def _mirror_lower(matrix: FloatArray) -> None:
    for i in range(len(matrix)):
        for j in range(i):
            matrix[j, i] = matrix[i, j]


@dataclass(frozen=True)
class SlicedCompliance:
    """Regular compliance of one gear, contracted onto the contact slices; spline coefficients over the roll arc.

    Attributes
    ----------
    table : ndarray (blocks, slices, slices, f, f)
        m/N.
    number : ndarray (t, t)
        Block of (tooth pair read, tooth pair loaded); in a closed ring their difference decides.
    first_tooth : int
        Tooth pair of row and column 0 of `number`.
    knots : ndarray
        Knots of the cubic splines over the arc length u = r_b roll^2 / 2, m.
    base_radius : float
        m.
    """

    table: FloatArray
    number: IntArray
    first_tooth: int
    knots: FloatArray
    base_radius: float

    @classmethod
    def from_flank(
        cls, flank: FlankCompliance, axial: FloatArray, sense: int, teeth: IntArray, reach: int
    ) -> SlicedCompliance:
        """Contract `flank` onto slices.

        Parameters
        ----------
        flank : FlankCompliance
        axial : ndarray
            Middle of the slices, m.
        sense : int
            Sense in which this gear's tooth numbers run with the tooth pairs.
        teeth : ndarray
            Consecutive tooth pairs that may touch.
        reach : int
            Largest difference of tooth pairs in contact at once.
        """
        arc = flank.gear.base_radius * flank.roll**2 / 2.0
        along_roll = make_interp_spline(arc, np.eye(len(arc)), k=3)
        at_slices = make_interp_spline(flank.axial, np.eye(len(flank.axial)), k=3)(axial)
        keys: list[tuple[int, int]] = []
        number = np.full((len(teeth), len(teeth)), -1, dtype=np.int64)
        for row, read in enumerate(teeth):
            for column, loaded in enumerate(teeth):
                if abs(read - loaded) <= reach:
                    key = flank.key(int(sense * read), int(sense * loaded))
                    if key not in keys:
                        keys.append(key)
                    number[row, column] = keys.index(key)
        blocks = [_contracted(flank.regular[key], at_slices, along_roll.c) for key in keys]
        return cls(np.array(blocks), number, int(teeth[0]), along_roll.t, flank.gear.base_radius)

    def weights(self, roll: FloatArray) -> tuple[IntArray, FloatArray]:
        """First spline and the four spline values at each roll angle."""
        arc = np.clip(self.base_radius * roll**2 / 2.0, self.knots[0], self.knots[-1])
        rows = BSpline.design_matrix(arc, self.knots, 3)
        return rows.indices.reshape(-1, 4)[:, 0].astype(np.int64), rows.data.reshape(-1, 4)


def _contracted(block: FloatArray, at_slices: FloatArray, to_splines: FloatArray) -> FloatArray:
    """Turn nodal values on the flank grid (f l, f l) into spline coefficients at the slices (k, k, f, f)."""
    rolls, layers = len(to_splines), at_slices.shape[1]
    values = block.reshape(rolls, layers, rolls, layers)
    values = np.einsum("ka,paqb->pkqb", at_slices, values, optimize=True)
    values = np.einsum("lb,pkqb->klpq", at_slices, values, optimize=True)
    values = np.einsum("rp,klpq->klrq", to_splines, values, optimize=True)
    return np.ascontiguousarray(np.einsum("sq,klrq->klrs", to_splines, values, optimize=True))


@dataclass(frozen=True)
class Cells:
    """Contact cells of one position.

    Attributes
    ----------
    tooth, layer : ndarray (n,)
        Tooth pair and slice.
    roll, gear_roll : ndarray (n,)
        Roll angles of the middle on both gears, rad.
    half_across : ndarray (n,)
        Half width along the profile, m.
    gap : ndarray (n,)
        Rigid gap of the unmodified flanks, m.
    cut : ndarray (n,)
        Whether a tip edge bounds the cell.
    """

    tooth: IntArray
    layer: IntArray
    roll: FloatArray
    gear_roll: FloatArray
    half_across: FloatArray
    gap: FloatArray
    cut: BoolArray

    def select(self, keep: BoolArray) -> Cells:
        """Return the cells for which `keep` holds."""
        return Cells(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class ContactSolution:
    """Forces on the cells of one position.

    Attributes
    ----------
    approach : float
        Rotation of gear 2 as a length on the contact normal, m.
    approach_per_load : float
        Its derivative by the normal load, m/N.
    force : ndarray (n,)
        Normal force on each cell, N.
    force_per_load : ndarray (n,)
        Its derivative by the normal load, which is the derivative of the approach by the gap at the cell, too.
    iterations : int

    Notes
    -----
    The energy force C force / 2 + gap force is least under the sum of the forces. Its least value has the derivative
    `force` by the gap and the approach by the load, so that the mixed derivatives are the same.
    """

    approach: float
    approach_per_load: float
    force: FloatArray
    force_per_load: FloatArray
    iterations: int


def lay_cells(
    pair: FlankPair, rotation: float, teeth: IntArray, axial: FloatArray, half_window: float, count: int
) -> Cells:
    """Lay the cells of all `teeth` around their contact lines at one rotation of gear 1."""
    tooth, layer, middle, half, gap, gear_roll, cut = _lay_cells(pair, rotation, teeth, axial, half_window, count)
    return Cells(tooth, layer, np.sqrt(2.0 * middle / pair.base_radius_1), gear_roll, half, gap, cut)


def compliance_matrix(
    cells: Cells,
    pair: FlankPair,
    axial: FloatArray,
    flanks: tuple[FlankCompliance, FlankCompliance],
    sliced: tuple[SlicedCompliance, SlicedCompliance],
) -> FloatArray:
    """Approach of both flanks at each cell under unit forces on each cell, (n, n), m/N."""
    matrix = np.zeros((len(cells.tooth), len(cells.tooth)))
    materials = [flank.gear.material for flank in flanks]
    surface = np.array([(1 - m.poissons_ratio**2) / (np.pi * m.youngs_modulus) for m in materials])
    starts = np.flatnonzero(np.diff(cells.tooth * len(axial) + cells.layer)) + 1
    groups = np.concatenate([[0], starts, [len(cells.tooth)]])
    _add_half_spaces(
        matrix,
        groups,
        cells.tooth,
        axial[cells.layer],
        cells.roll,
        cells.half_across,
        0.5 * (axial[1] - axial[0]) / pair.base_helix_cosine,
        pair,
        surface,
        np.array([flank.gear.face_width / 2 for flank in flanks]),
        np.array([flank.mirror for flank in flanks]),
    )
    for part, roll in zip(sliced, (cells.roll, cells.gear_roll), strict=True):
        first, weights = part.weights(roll)
        blocks = (part.table, part.number, part.first_tooth)
        _add_regular(matrix, groups, cells.tooth, cells.layer, first, weights, *blocks)
    _mirror_lower(matrix)
    return matrix


def solve_complementarity(
    compliance: FloatArray, gap: FloatArray, load: float, guess: BoolArray, max_iterations: int = 60
) -> ContactSolution:
    """Solve force >= 0, compliance force + gap - approach >= 0, one of them zero, sum of forces = load.

    Primal-dual active set: the cells with pressure keep their contact, the cells that overlap gain it. When the
    number of wrong cells stops falling, only the last wrong cell is changed at a time, which cannot cycle for a
    positive definite matrix.

    Parameters
    ----------
    compliance : ndarray (n, n)
        Symmetric positive definite, m/N.
    gap : ndarray (n,)
        m.
    load : float
        Sum of the forces, N, positive.
    guess : ndarray (n,)
        Cells taken to be in contact at the start.
    max_iterations : int
        Block steps allowed.

    Returns
    -------
    ContactSolution

    Raises
    ------
    ContactError
        If the active set does not settle, or the matrix is not positive definite on it.

    References
    ----------
    M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865-888; J. J. Judice, F. M. Pires, Comput. Oper.
    Res. 21 (1994) 587-596 (block principal pivoting and its safeguard).

    Examples
    --------
    >>> solution = solve_complementarity(np.eye(2), np.array([0.0, 1.0]), 0.5, np.array([True, True]))
    >>> solution.force.tolist(), solution.approach
    ([0.5, 0.0], 0.5)
    """
    active = guess & np.isfinite(gap)
    fewest, patience = len(gap) + 1, 5
    for iteration in range(1, max_iterations + 1):
        if not active.any():
            active = gap == gap.min()
        numbers = np.flatnonzero(active)
        rows = compliance[numbers]
        closing, closing_per_load, approach, per_load = _solve_active(rows[:, numbers], gap[numbers], load)
        force = np.zeros(len(gap))
        force[numbers] = closing
        clearance = closing @ rows + gap - approach
        if np.isnan(clearance).any():  # every comparison below would pass
            raise ContactError("the contact problem holds values that are not numbers")
        tolerance = 1e-12 * max(abs(approach), 1e-12)
        wrong = np.where(active, force < 0.0, clearance < -tolerance)
        if not wrong.any():
            force_per_load = np.zeros(len(gap))
            force_per_load[numbers] = closing_per_load
            return ContactSolution(approach, per_load, force, force_per_load, iteration)
        count = int(wrong.sum())
        if count < fewest:
            fewest, patience = count, 5
        else:
            patience -= 1
        if patience > 0:
            active = active ^ wrong
        else:
            active = active.copy()
            active[np.flatnonzero(wrong)[-1]] ^= True
    raise ContactError(f"the active set did not settle in {max_iterations} iterations ({count} cells still change)")


def _solve_active(compliance: FloatArray, gap: FloatArray, load: float) -> tuple[FloatArray, FloatArray, float, float]:
    """Solve for contact on all cells given: forces, their derivatives by the load, approach, its derivative.

    Overwrites ``compliance``.
    """
    try:
        # The transpose of the symmetric matrix is in the order that LAPACK works in.
        factor = scipy.linalg.cho_factor(compliance.T, lower=True, overwrite_a=True, check_finite=False)
    except np.linalg.LinAlgError as error:
        raise ContactError("the compliance of the contact cells is not positive definite") from error
    right = np.stack([np.ones(len(gap)), gap])
    unit, closed = scipy.linalg.cho_solve(factor, right.T, overwrite_b=True, check_finite=False).T
    approach = (load + closed.sum()) / unit.sum()
    return unit * approach - closed, unit / unit.sum(), float(approach), float(1.0 / unit.sum())
