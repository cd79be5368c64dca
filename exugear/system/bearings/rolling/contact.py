"""Contact of rolling elements with their raceways to ISO/TS 16281: loads, equilibrium of the inner ring, tangent.

Rows of rollers and of balls between two rigid rings. Each roller is cut into laminae; a lamina between both
raceways carries ``c_L / n * delta^(10/9)`` with ``c_L = 35948 L_we^(8/9)`` (N, mm), its approach ``delta`` following
from the six displacements of the inner ring relative to the outer one. Balls are in
`exugear.system.bearings.rolling.point_contact`. Every contact has a potential that grows with its approach, which is a
convex function of the displacements; so the load of the bearing is the gradient of a convex function, the equilibrium
under a given force unique and the tangent symmetric.

Rings are rigid; ribs, cage, friction, centrifugal forces and the housing are neglected. The frame is that of
`exugear.system.bearings.rolling.rows`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike

from exugear.system.bearings.rolling.point_contact import (
    BallArrays,
    ball_arrays,
    ball_energy,
    ball_loads,
    ball_ring_load,
    ball_state,
    ball_tangent,
)
from exugear.system.bearings.rolling.rows import (
    STEEL_MODULUS,
    BallRow,
    BearingError,
    RollerRow,
    RollingBearing,
    RollingRow,
    raceway_rows,
)
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.display import ReprMixin

LINE_CONTACT_EXPONENT = 10.0 / 9.0
"""Load of a line contact over its approach."""
MOST_NEWTON_STEPS = 200
"""Steps after which the search for an equilibrium is given up."""
HIDDEN_FALL = 1e-9
"""Fall of the energy, over the energy, that rounding may hide: approaches are differences of longer distances."""
MOST_TRAVEL = 1.0
"""Displacement (m) at which a ring is taken for one that nothing holds."""
LEAST_SHOULDER = 1e-6
"""Minimum sine of the contact angle of a ball in a row with a contact angle."""


@dataclass(frozen=True)
class LaminaArrays:
    """All laminae of a bearing as arrays, the input of the kernels."""

    direction: Floats
    """(n, 6) gradient of each lamina's approach with respect to the six displacements (1 and m)."""
    gap: Floats
    """(n,) approach at which the lamina begins to carry, m."""
    constant: Floats
    """(n,) ``c_L / laminae``, N/m^(10/9)."""
    pressure: Floats
    """(n,) pressure on the inner raceway over the square root of the lamina's load, Pa/N^(1/2)."""
    element: Integers
    """(n,) number of the roller that each lamina belongs to, counted through all rows of the bearing."""


def lamina_arrays(rows: Sequence[tuple[RollerRow, int]], first_roller_angle: float = 0.0) -> LaminaArrays:
    """Place the rollers and their laminae.

    Parameters
    ----------
    rows : rows in the frame of the bearing, and the number of the first roller of each
    first_roller_angle : polar angle of the first roller of each row, rad
    """
    parts = [_row_laminae(row, first, first_roller_angle) for row, first in rows]
    return LaminaArrays(
        *(np.concatenate([getattr(part, key) for part in parts]) for key in LaminaArrays.__annotations__)
    )


def _row_laminae(row: RollerRow, first: int, first_roller_angle: float) -> LaminaArrays:
    number = np.repeat(np.arange(row.element_count), row.laminae)
    polar = first_roller_angle + 2.0 * math.pi * number / row.element_count
    slices = (np.arange(row.laminae) + 0.5) / row.laminae - 0.5  # middle of each slice, in roller lengths
    along = np.tile(slices, row.element_count) * row.effective_length
    cosine = math.cos(row.contact_angle)
    sine = math.sin(row.contact_angle)
    across, upwards = np.cos(polar), np.sin(polar)
    normal = np.array([cosine * across, cosine * upwards, np.full(polar.size, sine)])
    radius = 0.5 * row.pitch_diameter - along * sine
    point = np.array([radius * across, radius * upwards, row.axial_position + along * cosine])
    if row.aligning:  # contact forces pass through the centre of the raceway's sphere
        point[:] = np.array([0.0, 0.0, row.sphere_centre])[:, None]
    direction = np.empty((polar.size, 6))
    direction[:, :3] = normal.T
    direction[:, 3] = point[1] * normal[2] - point[2] * normal[1]
    direction[:, 4] = point[2] * normal[0] - point[0] * normal[2]
    direction[:, 5] = point[0] * normal[1] - point[1] * normal[0]
    return LaminaArrays(
        direction=direction,
        gap=0.5 * row.radial_clearance * cosine + 2.0 * row.drop(along),
        constant=np.full(polar.size, row.contact_constant / row.laminae),
        pressure=np.full(polar.size, _lamina_pressure(row)),
        element=first + number,
    )


def _lamina_pressure(row: RollerRow) -> float:
    """Pressure of a lamina on the inner raceway over the square root of its load, Pa/N^(1/2).

    Hertz, two cylinders: ``p^2 = q E S / (2 pi (1 - nu^2))`` with the load q per length and the sum S of curvatures.
    """
    if row.rib:
        return 0.0  # the form of ribs is not known
    curvature = 2.0 / (row.element_diameter * (1.0 - row.diameter_ratio))
    length = row.effective_length / row.laminae
    return math.sqrt(STEEL_MODULUS * curvature / (2.0 * math.pi * length))


def lamina_loads(laminae: LaminaArrays, displacement: Floats) -> Floats:
    """Load of each lamina, N, shape (n,), at a displacement of the inner ring, shape (6,)."""
    approach, carrying = _approaches(laminae, displacement)
    load = np.zeros(len(laminae.gap))
    load[carrying] = laminae.constant[carrying] * approach**LINE_CONTACT_EXPONENT
    return load


def _approaches(laminae: LaminaArrays, displacement: Floats) -> tuple[Floats, Integers]:
    """Approaches (m) of the laminae that carry, and which they are: most do not."""
    approach = laminae.direction @ displacement - laminae.gap
    carrying = np.flatnonzero(approach > 0.0)
    return approach[carrying], carrying


@dataclass(frozen=True)
class RowContacts:
    """All contacts of a bearing, the input of the functions below."""

    rows: tuple[RollingRow, ...]
    """The rows."""
    first: tuple[int, ...]
    """Number of the first element of each row, and the number of all elements at the end."""
    laminae: LaminaArrays | None
    """Of the rows of rollers; empty without any."""
    balls: BallArrays | None
    """Of the rows of balls; empty without any."""


def row_contacts(rows: Sequence[RollingRow], first_roller_angle: float = 0.0) -> RowContacts:
    """Place all rolling elements.

    Parameters
    ----------
    rows : rows of rollers, of balls, or of both, in the frame of the bearing
    first_roller_angle : polar angle of the first element of each row, rad
    """
    return _placed(tuple(rows), float(first_roller_angle))


@lru_cache(maxsize=128)
def _placed(rows: tuple[RollingRow, ...], first_roller_angle: float) -> RowContacts:
    """Place all rolling elements; cached, because an equilibrium search requests the same ones repeatedly."""
    first = (0, *np.cumsum([row.element_count for row in rows]).tolist())
    rollers = [(row, start) for row, start in zip(rows, first, strict=False) if isinstance(row, RollerRow)]
    balls = [(row, start) for row, start in zip(rows, first, strict=False) if isinstance(row, BallRow)]
    return RowContacts(
        rows=rows,
        first=first,
        laminae=lamina_arrays(rollers, first_roller_angle) if rollers else None,
        balls=ball_arrays(balls, first_roller_angle) if balls else None,
    )


def is_preloaded(rows: Sequence[RollingRow]) -> bool:
    """Return whether rolling elements carry load before the bearing is loaded; ribs in contact do not count."""
    return elastic_energy(row_contacts(raceway_rows(rows)), np.zeros(6)) > 0.0


def elastic_energy(contacts: RowContacts, displacement: Floats) -> float:
    """Energy stored in all contacts, J; its gradient is `bearing_load`."""
    energy = 0.0
    if contacts.laminae is not None:
        approach, carrying = _approaches(contacts.laminae, displacement)
        power = LINE_CONTACT_EXPONENT + 1.0
        energy += float(contacts.laminae.constant[carrying] @ approach**power / power)
    if contacts.balls is not None:
        energy += ball_energy(contacts.balls, displacement)
    return energy


def bearing_load(contacts: RowContacts, displacement: Floats) -> Floats:
    """Force and moment that hold the inner ring at a displacement, N and N m, shape (6,)."""
    load = np.zeros(6)
    if contacts.laminae is not None:
        laminae = contacts.laminae
        approach, carrying = _approaches(laminae, displacement)
        load += (laminae.constant[carrying] * approach**LINE_CONTACT_EXPONENT) @ laminae.direction[carrying]
    if contacts.balls is not None:
        load += ball_ring_load(contacts.balls, displacement)
    return load


def tangent_stiffness(contacts: RowContacts, displacement: Floats) -> Floats:
    """Differentiate `bearing_load` with respect to the displacement, shape (6, 6), symmetric."""
    tangent = np.zeros((6, 6))
    if contacts.laminae is not None:
        laminae = contacts.laminae
        approach, carrying = _approaches(laminae, displacement)
        slope = LINE_CONTACT_EXPONENT * laminae.constant[carrying] * approach ** (LINE_CONTACT_EXPONENT - 1.0)
        direction = laminae.direction[carrying]
        gram = direction.T @ (slope[:, None] * direction)
        tangent += 0.5 * (gram + gram.T)
    if contacts.balls is not None:
        tangent += ball_tangent(contacts.balls, displacement)
    return tangent


def element_loads(contacts: RowContacts, displacement: Floats) -> Floats:
    """Load of each rolling element, row by row, N, shape (elements,)."""
    load = np.zeros(contacts.first[-1])
    if contacts.laminae is not None:
        np.add.at(load, contacts.laminae.element, lamina_loads(contacts.laminae, displacement))
    if contacts.balls is not None:
        load[contacts.balls.element] = ball_loads(contacts.balls, displacement)
    return load


def loads_of_laminae(contacts: RowContacts, displacement: Floats) -> tuple[Floats | None, ...]:
    """Load of each lamina, N, for each row an array (elements, laminae); None for rows of balls."""
    if contacts.laminae is None:
        return (None,) * len(contacts.rows)
    load = lamina_loads(contacts.laminae, displacement)
    return tuple(
        load[(contacts.laminae.element >= start) & (contacts.laminae.element < end)].reshape(-1, row.laminae)
        if isinstance(row, RollerRow)
        else None
        for row, start, end in zip(contacts.rows, contacts.first[:-1], contacts.first[1:], strict=True)
    )


@dataclass(frozen=True)
class BearingState(ReprMixin):
    """A bearing in equilibrium with a force."""

    displacement: Floats
    """(6,) inner ring relative to outer ring, m and rad."""
    load: Floats
    """(6,) force and moment on the inner ring that hold it there, N and N m."""
    element_load: Floats
    """(elements,) load of each roller or ball, row by row, N."""
    element_pressure: Floats
    """(elements,) maximum pressure of each on a raceway, Pa."""
    lamina_load: tuple[Floats | None, ...]
    """(elements, laminae) for each row of rollers the load of each lamina, N; None for a row of balls."""
    contacts: RowContacts
    """The contacts, for further evaluation."""

    @cached_property
    def tangent(self) -> Floats:
        """Derivative (6, 6) of the load, N/m, N, N m/rad."""
        return tangent_stiffness(self.contacts, self.displacement)

    @property
    def energy(self) -> float:
        """Elastic energy, J."""
        return elastic_energy(self.contacts, self.displacement)

    def _line(self) -> str:
        displacement, load = (
            ", ".join(f"{round(value, 3) + 0.0:.3g}" for value in values.tolist())
            for values in (1e6 * self.displacement[:3], 1e-3 * self.load[:3])
        )
        carrying = f"{np.count_nonzero(self.element_load)} of {len(self.element_load)} elements loaded"
        return f" ({displacement}) µm under ({load}) kN, {carrying}"

    @property
    def radial_stiffness(self) -> float:
        """Tangent along the radial load with all other coordinates held, N/m."""
        direction = self.load[:2] / np.linalg.norm(self.load[:2])
        return float(direction @ self.tangent[:2, :2] @ direction)


def bearing_state(contacts: RowContacts, displacement: Floats) -> BearingState:
    """Evaluate loads and pressures of a bearing at a displacement of the inner ring, shape (6,)."""
    # The most loaded lamina of a roller on the inner raceway, which is the more curved one; pressures at the very end
    # of a roller, higher than Hertzian, are neglected. Balls: the raceway of lower conformity.
    pressure = np.zeros(contacts.first[-1])
    if contacts.laminae is not None:
        laminae = contacts.laminae
        np.maximum.at(pressure, laminae.element, laminae.pressure * np.sqrt(lamina_loads(laminae, displacement)))
    if contacts.balls is not None:
        balls = contacts.balls
        pressure[balls.element] = balls.pressure * np.cbrt(ball_loads(balls, displacement))
    return BearingState(
        displacement=displacement,
        load=bearing_load(contacts, displacement),
        element_load=element_loads(contacts, displacement),
        element_pressure=pressure,
        lamina_load=loads_of_laminae(contacts, displacement),
        contacts=contacts,
    )


def equilibrium(
    bearing: RollingBearing,
    force: ArrayLike,
    *,
    tilt: ArrayLike = (0.0, 0.0),
    first_roller_angle: float = 0.0,
) -> BearingState:
    """Displace the inner ring until the rolling elements balance a force.

    Parameters
    ----------
    bearing : the bearing
    force : (3,) force of the shaft on the inner ring, N, z along the axis
    tilt : (2,) rotations of the inner ring about x and y, rad, held: shaft and housing decide about them
    first_roller_angle : polar angle of the first element of each row, rad

    Raises
    ------
    BearingError
        If no displacement balances the force: an axial force on cylindrical rollers or against the direction that
        the rows hold, or on a single row with a contact angle an axial force below what its radial load induces.

    Notes
    -----
    Newton's method with line search on ``U(u) - F u``, which is convex because the energy of each contact is.

    Examples
    --------
    >>> from exugear.gearbox.sections.connections import CatalogueSection
    >>> from exugear.system.bearings.rolling.catalogue import catalogue_rows
    >>> from exugear.system.bearings.rolling.rows import BearingOfRows
    >>> section = CatalogueSection(type="cylindrical_roller", bore_mm=160.0, outer_diameter_mm=290.0, width_mm=80.0)
    >>> state = equilibrium(BearingOfRows(catalogue_rows(section)), (129.9e3, 0.0, 0.0))
    >>> round(1e6 * state.displacement[0])  # micrometres
    53
    """
    applied = np.asarray(force, dtype=np.float64)
    if applied.shape != (3,) or not np.all(np.isfinite(applied)):
        raise BearingError(f"bearing: force = {force!r} must be three finite numbers")
    if not np.any(applied):
        raise BearingError("bearing: force = 0; without load or preload a rolling bearing has no stiffness")
    if applied[2] != 0.0 and not any(_holds(row, applied[2]) for row in bearing.rows):
        raise BearingError(f"bearing: no row carries an axial force of {applied[2]:.6g} N")
    contacts = row_contacts(bearing.rows, first_roller_angle)
    displacement = _balance(contacts, applied, np.asarray(tilt, dtype=np.float64))
    if contacts.balls is not None:
        # Where a bearing has a contact angle, each groove has a shoulder on one side only, on which balls must lean.
        state = ball_state(contacts.balls, displacement)
        loaded = (state.approach > 0.0) & (contacts.balls.start[:, 1] != 0.0)
        held = np.sign(contacts.balls.start[loaded, 1]) * state.direction[loaded, 1]
        if np.any(held < LEAST_SHOULDER):
            raise _no_equilibrium(applied)
    return bearing_state(contacts, displacement)


def _holds(row: RollingRow, axial_force: float) -> bool:
    """Return whether a row can carry an axial force on the inner ring: balls in grooves without contact angle, both."""
    if row.contact_angle == 0.0:
        return isinstance(row, BallRow) and not row.aligning
    return (row.contact_angle > 0.0) == (axial_force > 0.0)


def _no_equilibrium(force: Floats) -> BearingError:
    return BearingError(
        f"bearing: no equilibrium with the force {force.tolist()} N; a single row with a contact angle requires an "
        "axial force above that induced by its radial load"
    )


def _balance(contacts: RowContacts, force: Floats, tilt: Floats) -> Floats:
    """Displacement whose first three load components are `force` (N), the tilt held."""
    displacement = _first_touch(contacts, force, np.concatenate([np.zeros(3), tilt, [0.0]]))
    tolerance = 1e-10 * float(np.linalg.norm(force))

    def surplus(candidate: Floats) -> float:
        return elastic_energy(contacts, candidate) - float(force @ candidate[:3])

    for _ in range(MOST_NEWTON_STEPS):
        residual = force - bearing_load(contacts, displacement)[:3]
        if np.linalg.norm(residual) <= tolerance:
            return displacement
        # The least-squares step leaves directions without stiffness and without load where they are.
        stiffness = tangent_stiffness(contacts, displacement)[:3, :3]
        step = np.zeros(6)
        step[:3] = np.linalg.lstsq(stiffness, residual, rcond=1e-12)[0]
        displacement = _line_search(surplus, displacement, step, float(residual @ step[:3]), tolerance)
    raise _no_equilibrium(force)


def _line_search(
    surplus: Callable[[Floats], float],
    displacement: Floats,
    step: Floats,
    descent: float,
    tolerance: float,
) -> Floats:
    """Halve the step until the energy falls; close to the minimum rounding hides the fall, take it whole."""
    start = surplus(displacement)
    if descent <= max(tolerance * float(np.linalg.norm(step)), HIDDEN_FALL * abs(start)):
        return displacement + step
    fraction = 1.0
    while surplus(displacement + fraction * step) > start - 1e-4 * fraction * descent and fraction > 1e-6:
        fraction *= 0.5
    return displacement + fraction * step


def _first_touch(contacts: RowContacts, force: Floats, start: Floats) -> Floats:
    """Start in contact: from `start` along the force until the load has at least its size in that direction."""
    if elastic_energy(contacts, start) > 0.0:
        return start  # preloaded or tilted rows are in contact already
    size = float(np.linalg.norm(force))
    direction = np.concatenate([force / size, np.zeros(3)])

    distance = 1e-6
    while float(bearing_load(contacts, start + distance * direction) @ direction) < size:
        distance *= 2.0
        if distance > MOST_TRAVEL:
            raise _no_equilibrium(force)
    return start + distance * direction


def pitch_averaged_tangent(bearing: RollingBearing, force: ArrayLike, positions: int = 4) -> Floats:
    """Tangent under a force, averaged over the cage positions within one roller pitch.

    A linear model knows no cage; the mean over the pitch is what a turning bearing shows.

    Parameters
    ----------
    bearing : the bearing
    force : (3,) force on the inner ring, N
    positions : number of equally spaced cage positions

    Returns
    -------
    (6, 6)

    Examples
    --------
    >>> from exugear.gearbox.sections.connections import CatalogueSection
    >>> from exugear.system.bearings.rolling.catalogue import catalogue_rows
    >>> from exugear.system.bearings.rolling.rows import BearingOfRows
    >>> section = CatalogueSection(type="cylindrical_roller", bore_mm=100.0, outer_diameter_mm=180.0, width_mm=46.0)
    >>> stiffness = pitch_averaged_tangent(BearingOfRows(catalogue_rows(section)), (33.5e3, 0.0, 0.0))
    >>> float(round(stiffness[0, 0] / 1e9, 1))
    1.9
    """
    pitch = 2.0 * math.pi / bearing.rows[0].element_count
    total = np.zeros((6, 6))
    for position in range(positions):
        angle = pitch * position / positions
        total += equilibrium(bearing, force, first_roller_angle=angle).tangent
    return total / positions
