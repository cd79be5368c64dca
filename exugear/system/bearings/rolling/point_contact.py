"""Contact of balls with the grooves of both rings by Hertz: deflection, pressure, loads of rows of balls.

A ball between the grooves of two rigid rings carries ``k (l - A)^(3/2)``, where A is the distance of the groove
centres while the ball just touches both grooves, and l what the six displacements of the inner ring make of it. The
load acts along the line of the groove centres, so that the contact angle follows the load. Where the outer raceway is
a sphere about the middle of the bearing, the line stays on that middle.

Forces on the ball itself (centrifugal, gyroscopic, friction) are left out: both contacts of a ball carry the same.
The frame is that of `exugear.system.bearings.rolling.rows`.

A roller feels the approach of its middle and its tilt alone, so that one table over both holds what all its slices
(ISO/TS 16281) give together. It is made once for each kind of roller from more slices than a lamina model affords in a
run, and shared by all rows of that kind, whatever their number, angle, place and clearance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from exugear.system.bearings.rolling.rows import (
    LEAST_ELEMENTS,
    STEEL_MODULUS,
    BallRow,
    BearingError,
    RollerRow,
    RollingRow,
)
from exugear.system.kernels.rolling import (
    ALIGNED_BALL,
    AXIAL,
    BALL,
    CENTRE_AXIAL,
    CENTRE_RADIAL,
    CIRCLE,
    CONSTANT,
    COSINE,
    COUNT,
    FORM,
    GAP,
    GAPS,
    GEOMETRY_SIZE,
    HALF_SLICES,
    LAYOUT_SIZE,
    LEVER,
    LINE_POWER,
    MOST_DEPTH,
    MOST_TILT,
    PER_ROOT,
    PER_TILT,
    RADIUS,
    ROLLER,
    SINE,
    SLICE_LENGTH,
    SPAN,
    STRIPS,
    TABLE,
    TILTING,
    RollingArrays,
)
from fe_ste.tools.arrays import Floats, Integers

POINT_CONTACT_EXPONENT = 1.5
"""Load of a point contact over its approach."""
LARGEST_ELLIPSE_RATIO = 1e4
"""Ellipses of contact are not longer than this many widths: grooves that fit a ball this closely are line contacts."""


def elliptic_integrals(parameter: float) -> tuple[float, float]:
    """Complete elliptic integrals K and E of the first and second kind, by the arithmetic-geometric mean.

    Parameters
    ----------
    parameter : square of the modulus, at least 0 and below 1

    Examples
    --------
    >>> [round(value, 6) for value in elliptic_integrals(0.5)]
    [1.854075, 1.350644]

    References
    ----------
    Abramowitz and Stegun, Handbook of Mathematical Functions, 17.6.
    """
    mean = 1.0
    geometric = math.sqrt(1.0 - parameter)
    difference = math.sqrt(parameter)
    weight = 0.5
    total = 0.5 * parameter
    while abs(difference) > 1e-16:
        mean, geometric, difference = 0.5 * (mean + geometric), math.sqrt(mean * geometric), 0.5 * (mean - geometric)
        weight *= 2.0
        total += weight * difference**2
    first = 0.5 * math.pi / mean
    return first, first * (1.0 - total)


@dataclass(frozen=True)
class EllipticContact:
    """Hertz contact of two steel bodies whose gap grows with the square of the distance."""

    curvature_sum: float
    """Sum of the four principal curvatures, hollow ones negative, 1/m."""
    ratio: float
    """Long over short half axis of the ellipse of contact."""

    @property
    def compliance(self) -> float:
        """Approach over the load to the power of 2/3, m/N^(2/3)."""
        first, second = elliptic_integrals(1.0 - 1.0 / self.ratio**2)
        reduced = (2.0 * first / math.pi) * math.pow(math.pi / (2.0 * self.ratio**2 * second), 1.0 / 3.0)
        return 0.5 * self.curvature_sum * reduced * _size_of_unit_load(self.curvature_sum) ** 2

    @property
    def pressure(self) -> float:
        """Maximum pressure over the load to the power of 1/3, Pa/N^(1/3)."""
        _, second = elliptic_integrals(1.0 - 1.0 / self.ratio**2)
        long = math.pow(2.0 * self.ratio**2 * second / math.pi, 1.0 / 3.0) * _size_of_unit_load(self.curvature_sum)
        return 1.5 * self.ratio / (math.pi * long**2)


def _size_of_unit_load(curvature_sum: float) -> float:
    """Scale of the half axes under 1 N, m: ``(3 / (E' S))^(1/3)``."""
    return math.pow(3.0 / (curvature_sum * STEEL_MODULUS), 1.0 / 3.0)


@lru_cache(maxsize=1024)
def elliptic_contact(curvature_sum: float, curvature_difference: float) -> EllipticContact:
    """Find the ellipse of a Hertz contact.

    Parameters
    ----------
    curvature_sum : sum of the four principal curvatures, hollow ones negative, 1/m
    curvature_difference
        Difference of the curvatures of both bodies over the sum, F(rho): 0 for a ball on a plane, 1 for lines.

    Notes
    -----
    The ratio chi of the half axes follows from ``1 - 2 / (chi^2 - 1) (K / E - 1) = F(rho)``, whose left side grows from
    0 to 1. With ``E' = E / (1 - nu^2)`` of both bodies and the reduced values ``a* = (2 chi^2 E(m) / pi)^(1/3)`` and
    ``delta* = 2 K(m) / pi (pi / (2 chi^2 E(m)))^(1/3)``, ``m = 1 - 1 / chi^2``, the approach is ``delta* (3 Q / (E'
    S))^(2/3) S / 2`` and the maximum pressure ``3 Q / (2 pi a b)``.

    References
    ----------
    ISO/TS 16281:2008, its equations 1 to 4. Harris and Kotzalas, Essential Concepts of Bearing Technology, contact
    stress and deformation.
    """
    lower = 0.0
    upper = math.log(LARGEST_ELLIPSE_RATIO)
    for _ in range(80):
        middle = 0.5 * (lower + upper)
        if _difference_of(math.exp(middle)) < curvature_difference:
            lower = middle
        else:
            upper = middle
    return EllipticContact(curvature_sum, math.exp(0.5 * (lower + upper)))


def _difference_of(ratio: float) -> float:
    """F(rho) of an ellipse; near a circle by its series, where the formula is 0 / 0."""
    beyond = ratio**2 - 1.0
    if beyond < 1e-3:
        return 0.375 * beyond * (1.0 - 0.5 * beyond)
    first, second = elliptic_integrals(beyond / ratio**2)
    return 1.0 - 2.0 / beyond * (first / second - 1.0)


def groove_contacts(row: BallRow) -> tuple[EllipticContact, EllipticContact]:
    """Contacts of a ball with the groove of the inner and of the outer ring.

    Examples
    --------
    >>> inner, outer = groove_contacts(BallRow(element_diameter=0.0127, pitch_diameter=0.065, element_count=9))
    >>> round(inner.ratio, 2), round(outer.ratio, 2)
    (9.28, 7.3)
    """
    ratio = row.diameter_ratio
    size = row.element_diameter
    contacts = []
    for along, conformity in ((ratio / (1.0 - ratio), row.inner_conformity), (-ratio / (1.0 + ratio), _outer(row))):
        total = 2.0 + along - 0.5 / conformity
        contacts.append(elliptic_contact(2.0 / size * total, (along + 0.5 / conformity) / total))
    return contacts[0], contacts[1]


def _outer(row: BallRow) -> float:
    """Radius of the outer raceway across the rolling direction, over the ball's diameter."""
    return 0.5 * (1.0 / row.diameter_ratio + 1.0) if row.aligning else row.outer_conformity


def ball_constant(row: BallRow) -> float:
    """Load of a ball over its approach between both grooves to the power of 3/2, N/m^(3/2): c_P of ISO/TS 16281."""
    inner, outer = groove_contacts(row)
    constant: float = (inner.compliance + outer.compliance) ** -POINT_CONTACT_EXPONENT
    return constant


def ball_pressure(row: BallRow) -> float:
    """Maximum pressure of a ball on either ring over its load to the power of 1/3, Pa/N^(1/3)."""
    return max(contact.pressure for contact in groove_contacts(row))


@dataclass(frozen=True)
class BallArrays:
    """All balls of a bearing as arrays, the input of the kernels."""

    start: Floats
    """(n, 2) from the centre of the outer groove to that of the inner groove, radially and along the axis, m."""
    gradient: Floats
    """(n, 2, 6) gradient of the same with respect to the six displacements (1 and m)."""
    normal: Floats
    """(n, 2) direction in which the ball carries where that is fixed, else zeros."""
    free_length: Floats
    """(n,) distance of the groove centres at which the ball begins to carry, m."""
    constant: Floats
    """(n,) N/m^(3/2)."""
    pressure: Floats
    """(n,) maximum pressure over the load to the power of 1/3, Pa/N^(1/3)."""
    element: Integers
    """(n,) number of each ball, counted through all rows of the bearing."""


def ball_arrays(rows: Sequence[tuple[BallRow, int]], first_roller_angle: float = 0.0) -> BallArrays:
    """Place the balls.

    Parameters
    ----------
    rows : rows in the frame of the bearing, and the number of the first ball of each
    first_roller_angle : polar angle of the first ball of each row, rad

    Notes
    -----
    At displacements ``(x, y, z, a, b)``, with c and s the cosine and sine of the ball's polar angle and
    ``w = s a - c b``, the groove centres are apart by ``R = A cos alpha - G / 2 + x c + y s - zeta w`` and
    ``X = A sin alpha + z + rho w``, with rho and zeta the place of the inner groove's centre and G the clearance
    (ISO/TS 16281: ``cos alpha_0 = 1 - G / (2 A)`` of a bearing without nominal contact angle).
    """
    parts = [_row_balls(row, first, first_roller_angle) for row, first in rows]
    return BallArrays(*(np.concatenate([getattr(part, key) for part in parts]) for key in BallArrays.__annotations__))


def _row_balls(row: BallRow, first: int, first_roller_angle: float) -> BallArrays:
    count = row.element_count
    polar = first_roller_angle + 2.0 * math.pi * np.arange(count) / count
    c = np.cos(polar)
    s = np.sin(polar)
    cosine = math.cos(row.contact_angle)
    sine = math.sin(row.contact_angle)
    beyond = (row.inner_conformity - 0.5) * row.element_diameter  # from the ball's centre to that of the inner groove
    radius = 0.5 * row.pitch_diameter + beyond * cosine
    place = row.axial_position + beyond * sine
    if row.aligning:
        radius = place = 0.0  # forces pass through the middle of the bearing
    distance = (row.inner_conformity + _outer(row) - 1.0) * row.element_diameter
    zero = np.zeros(count)
    one = np.ones(count)
    gradient = np.stack(
        [
            np.column_stack([c, s, zero, -place * s, place * c, zero]),
            np.column_stack([zero, zero, one, radius * s, -radius * c, zero]),
        ],
        axis=1,
    )
    return BallArrays(
        start=np.tile([distance * cosine - 0.5 * row.radial_clearance, distance * sine], (count, 1)),
        gradient=gradient,
        normal=np.tile([cosine, sine] if row.aligning else [0.0, 0.0], (count, 1)),
        free_length=np.full(count, distance),
        constant=np.full(count, ball_constant(row)),
        pressure=np.full(count, ball_pressure(row)),
        element=first + np.arange(count),
    )


@dataclass(frozen=True)
class BallState:
    """Balls at a displacement of the inner ring."""

    approach: Floats
    """(n,) not below zero, m."""
    direction: Floats
    """(n, 2) unit vector of the contact force, radially and along the axis."""
    length: Floats
    """(n,) distance of the groove centres where the direction turns with it, else infinite, m."""


def ball_state(balls: BallArrays, displacement: Floats) -> BallState:
    """Approach and direction of each ball at a displacement of the inner ring, shape (6,)."""
    between = balls.start + balls.gradient @ displacement
    fixed = np.any(balls.normal != 0.0, axis=1)
    length = np.hypot(between[:, 0], between[:, 1])
    direction = np.where(fixed[:, None], balls.normal, between / length[:, None])
    along = np.einsum("ij,ij->i", direction, between)
    return BallState(
        approach=np.maximum(along - balls.free_length, 0.0),
        direction=direction,
        length=np.where(fixed, np.inf, length),
    )


def ball_loads(balls: BallArrays, displacement: Floats) -> Floats:
    """Load of each ball, N, shape (n,), at a displacement of the inner ring, shape (6,)."""
    return balls.constant * ball_state(balls, displacement).approach ** POINT_CONTACT_EXPONENT


def ball_energy(balls: BallArrays, displacement: Floats) -> float:
    """Energy stored in the contacts of all balls, J; its gradient is `ball_ring_load`."""
    power = POINT_CONTACT_EXPONENT + 1.0
    return float(np.sum(balls.constant * ball_state(balls, displacement).approach ** power) / power)


def ball_ring_load(balls: BallArrays, displacement: Floats) -> Floats:
    """Force and moment that hold the inner ring at a displacement, N and N m, shape (6,)."""
    state = ball_state(balls, displacement)
    load = balls.constant * state.approach**POINT_CONTACT_EXPONENT
    total: Floats = np.einsum("i,ij,ijk->k", load, state.direction, balls.gradient)
    return total


def ball_tangent(balls: BallArrays, displacement: Floats) -> Floats:
    """Differentiate `ball_ring_load` with respect to the displacement, shape (6, 6), symmetric."""
    state = ball_state(balls, displacement)
    load = balls.constant * state.approach**POINT_CONTACT_EXPONENT
    slope = POINT_CONTACT_EXPONENT * balls.constant * np.sqrt(state.approach)
    along = np.einsum("ij,ijk->ik", state.direction, balls.gradient)
    # Across its line a loaded ball is held by its load, which turns with the line: f / l.
    turned = np.column_stack([-state.direction[:, 1], state.direction[:, 0]])
    across = np.einsum("ij,ijk->ik", turned, balls.gradient)
    tangent = along.T @ (slope[:, None] * along) + across.T @ ((load / state.length)[:, None] * across)
    symmetric: Floats = 0.5 * (tangent + tangent.T)
    return symmetric


SLICES = 240
"""Slices of a roller: their sum is within 1e-4 of that of infinitely many where 30 are 1 % soft against tilting."""
STEPS, MORE_STEPS = (32, 24), (48, 32)
"""Steps of a table along the root of the depth and along the tilt; more where first contact is no smooth function of
the tilt, as of straight rollers."""
MOST_TILT_OF_TABLE = 5e-3
"""Tilt (rad) up to which a table extends: more than any bearing permits. Beyond it slices are summed."""
MOST_PRESSURE = 4e9
"""Contact pressure (Pa) that a table goes to: that of the static rating of roller bearings (ISO 76)."""
ROUNDING = 2e-4
"""How far the bound of first contact is rounded off where the roller has no smooth crown, as a share of the depth."""


HERMITE = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-3.0, -2.0, 3.0, -1.0], [2.0, 1.0, -2.0, 1.0]])
"""Coefficients of a cubic from value and slope at both ends of a step."""


class RollerTable(NamedTuple):
    """Condensed potential of a kind of roller, without clearance."""

    strips: Floats
    """(n, 6) bound of first contact as a cubic over a strip of tilts (m), first tilt (rad), 1 over its width."""
    patches: Floats
    """(m, n, 4, 4) U / depth^2 (N/m) as a bicubic over a step of tilt and one of the depth's root."""
    gaps: Floats
    """(h,) gap of both contacts of the slices of half a roller, from its middle, m."""
    most_tilt: float
    most_depth: float
    """Tilt (rad) and depth behind the bound of first contact (m) up to which the table goes."""


@lru_cache(maxsize=64)
def roller_table(row: RollerRow) -> RollerTable:
    """Table of a row; number of rollers, angle, place and clearance do not matter."""
    # The load of a line contact, flat against flat raceway, at the limit of pressure; then the approach under it.
    load = MOST_PRESSURE**2 * math.pi * row.effective_length * row.element_diameter / STEEL_MODULUS
    depth = float((load / row.contact_constant) ** (1.0 / LINE_POWER))
    steps, count = STEPS if _is_crowned(row) else MORE_STEPS
    count = 1 if row.aligning else count
    tilts = MOST_TILT_OF_TABLE * (np.arange(count + 1) / count) ** 2
    # An aligning roller is never tilted: both ends of its only strip are the same.
    at = np.zeros(2) if row.aligning else tilts
    # Minimum of gap and tilt times position over the roller's length. A slight crown, whose height is subtracted again,
    # keeps it smooth for rollers without a crown, so that forces are continuous at zero tilt.
    height = 0.0 if _is_crowned(row) else (ROUNDING * depth)
    share = np.linspace(-1.0, 1.0, 8001)[1:-1]
    place = 0.5 * row.effective_length * share
    gaps = 2.0 * row.drop(place) + height * share**2 + np.outer(at, place)
    least = gaps.argmin(axis=1)
    slope: Floats = place[least]
    slope[0] = 0.0
    onset, slope = gaps.min(axis=1) - height, slope
    most_depth = 1.2 * depth + 4.0 * row.profile_factor * row.element_diameter + float(onset[0] - onset[-1])
    roots = math.sqrt(most_depth) * np.arange(steps + 1) / steps
    nodes = np.stack([_nodes(row, roots, *line) for line in zip(at, onset, slope, strict=True)], axis=1)
    width = np.diff(tilts)
    cubics = HERMITE @ np.stack([onset[:-1], slope[:-1] * width, onset[1:], slope[1:] * width])
    # Coefficients, powers of the tilt first, from nodes likewise.
    scaled = np.zeros((len(nodes) - 1, len(width), 2, 2, 2, 2))
    for i in range(2):
        for j in range(2):
            scaled[:, :, j, :, i, :] = nodes[i : i + len(nodes) - 1, j : j + len(width)]
    scaled[:, :, :, 1] *= width[:, None, None, None]
    ends = scaled.reshape(len(nodes) - 1, len(width), 4, 4)
    patches: Floats = HERMITE @ ends @ HERMITE.T
    return RollerTable(
        strips=np.column_stack([cubics.T, tilts[:-1], 1.0 / width]),
        patches=patches,
        gaps=2.0 * row.drop(_slice_positions(row)[SLICES // 2 :]),
        most_tilt=float(tilts[-1]),
        most_depth=most_depth,
    )


def _is_crowned(row: RollerRow) -> bool:
    """Return whether the profile drops from the middle on, so that first contact moves continuously with the tilt."""
    return row.profile_table is None and (row.profile_factor > 0.0 or row.crown_curvature > 0.0)


def _slice_positions(row: RollerRow) -> Floats:
    """Middles of the slices along a roller, m."""
    along: Floats = ((np.arange(SLICES) + 0.5) / SLICES - 0.5) * row.effective_length
    return along


def _nodes(row: RollerRow, roots: Floats, tilt: float, onset: float, slope: float) -> Floats:
    """Nodes (m, 2, 2) at one tilt, from the sum over slices; zero where nothing touches yet.

    U over the depth squared and its derivative by the tilt, of each the value and the slope per step of the root.
    """
    along = _slice_positions(row)
    depth = roots**2
    approach = np.maximum((depth + onset)[:, None] - tilt * along - 2.0 * row.drop(along), 0.0)
    power = np.cbrt(np.cbrt(approach)) * row.contact_constant / SLICES
    force = power * approach
    stiffness = LINE_POWER * power
    # Derivatives by the tilt at constant approach turn into those at constant depth by that of the bound.
    by_tilt = slope - along if tilt > 0.0 else np.zeros(SLICES)
    nodes = np.zeros((len(roots), 2, 2))
    for n, (value, by_depth) in enumerate(
        (
            (np.sum(force * approach, axis=1) / (1.0 + LINE_POWER), force.sum(axis=1)),
            (force @ by_tilt, stiffness @ by_tilt),
        )
    ):
        nodes[1:, n, 0] = value[1:] / depth[1:] ** 2
        nodes[1:, n, 1] = 2.0 * roots[1] / roots[1:] * (by_depth[1:] / depth[1:] - 2.0 * nodes[1:, n, 0])
    return nodes


def rolling_arrays(
    rows_per_connector: Sequence[tuple[RollingRow, ...]],
    scale: Sequence[float],
    time: Sequence[float],
    cage_ratio: Sequence[float],
    phase: Sequence[float],
) -> RollingArrays:
    """Put the rolling laws of connectors into arrays.

    Parameters
    ----------
    rows_per_connector : rows of each connector in the frame of its bearing; none where it has no rolling law
    scale, time, cage_ratio, phase
        one number a connector each: see `exugear.system.kernels.rolling.RollingArrays`

    Raises
    ------
    BearingError
        A row of neither rollers nor balls.

    Examples
    --------
    >>> row = RollerRow(
    ...     element_diameter=0.03, pitch_diameter=0.225, element_count=20, effective_length=0.06, profile_factor=3.5e-4
    ... )
    >>> arrays = rolling_arrays([(row,), ()], scale=[1.0, 1.0], time=[0.0, 0.0], cage_ratio=[0.43, 0.0], phase=[0, 0])
    >>> arrays.first.tolist(), len(arrays.circle)
    ([0, 1, 1], 20)
    """
    rows = [row for rows in rows_per_connector for row in rows]
    packing = _Packing()
    places = [packing.place(row) for row in rows]
    return RollingArrays(
        first=np.cumsum([0, *(len(rows) for rows in rows_per_connector)]).astype(np.int64),
        scale=np.array(scale, dtype=np.float64),
        time=np.array(time, dtype=np.float64),
        cage_ratio=np.array(cage_ratio, dtype=np.float64),
        phase=np.array(phase, dtype=np.float64),
        layout=np.array([layout for layout, _ in places], dtype=np.int64).reshape(-1, LAYOUT_SIZE),
        geometry=np.array([geometry for _, geometry in places]).reshape(-1, GEOMETRY_SIZE),
        circle=np.concatenate([np.zeros((0, 2)), *packing.circles]),
        tables=np.concatenate([np.zeros(0), *packing.tables]),
    )


class _Packing:
    """Circles and tables so far; rows that have the same share them."""

    def __init__(self) -> None:
        self.circles: list[Floats] = []
        self.tables: list[Floats] = []
        self._first_on_circle: dict[int, int] = {}
        self._first_in_table: dict[RollerRow, int] = {}

    def place(self, row: RollingRow) -> tuple[list[int], Floats]:
        """Layout and geometry of a row."""
        cosine = math.cos(row.contact_angle)
        sine = math.sin(row.contact_angle)
        layout = [0] * LAYOUT_SIZE
        geometry = np.zeros(GEOMETRY_SIZE)
        # First line of the cosines and sines of equally spaced elements.
        if row.element_count not in self._first_on_circle:
            self._first_on_circle[row.element_count] = sum(len(circle) for circle in self.circles)
            angles = 2.0 * math.pi * np.arange(row.element_count) / row.element_count
            self.circles.append(np.column_stack([np.cos(angles), np.sin(angles)]))
        layout[COUNT], layout[CIRCLE] = row.element_count, self._first_on_circle[row.element_count]
        geometry[[COSINE, SINE, GAP]] = cosine, sine, 0.5 * row.radial_clearance * cosine
        if row.aligning:
            geometry[LEVER] = -row.sphere_centre * cosine
        else:
            lever = 0.5 * row.pitch_diameter * sine - row.axial_position * cosine
            geometry[LEVER], geometry[TILTING] = lever, 1.0
        if isinstance(row, RollerRow):
            self._place_rollers(row, layout, geometry)
        elif isinstance(row, BallRow):
            layout[FORM], geometry[CONSTANT] = ALIGNED_BALL if row.aligning else BALL, ball_constant(row)
            # The law follows the centre of the inner groove, which lies beyond the ball.
            beyond = (row.inner_conformity - 0.5) * row.element_diameter
            geometry[RADIUS] = 0.5 * row.pitch_diameter + beyond * cosine
            geometry[AXIAL] = row.axial_position + beyond * sine
            span = (row.inner_conformity + row.outer_conformity - 1.0) * row.element_diameter
            geometry[SPAN] = span
            geometry[[CENTRE_RADIAL, CENTRE_AXIAL]] = span * cosine - 0.5 * row.radial_clearance, span * sine
        else:
            raise BearingError(f"row: {type(row).__name__} has no rolling law; it must be a RollerRow or a BallRow")
        return layout, geometry

    def _place_rollers(self, row: RollerRow, layout: list[int], geometry: Floats) -> None:
        kind = replace(
            row,
            pitch_diameter=10.0 * row.element_diameter,
            element_count=LEAST_ELEMENTS,
            contact_angle=0.0,
            axial_position=0.0,
            radial_clearance=0.0,
            sphere_centre=0.0,
            laminae=SLICES,
        )
        table = roller_table(kind)
        if kind not in self._first_in_table:
            self._first_in_table[kind] = sum(part.size for part in self.tables)
            self.tables += [table.strips.ravel(), table.patches.ravel(), table.gaps]
        first, (steps, strips) = self._first_in_table[kind], table.patches.shape[:2]
        layout[FORM], layout[TABLE], layout[STRIPS] = ROLLER, first, strips
        layout[GAPS], layout[HALF_SLICES] = first + table.strips.size + table.patches.size, table.gaps.size
        geometry[CONSTANT], geometry[SLICE_LENGTH] = row.contact_constant / SLICES, row.effective_length / SLICES
        geometry[PER_TILT], geometry[MOST_TILT] = strips**2 / table.most_tilt, table.most_tilt
        geometry[PER_ROOT], geometry[MOST_DEPTH] = steps / math.sqrt(table.most_depth), table.most_depth
