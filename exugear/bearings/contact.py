"""Contact of rollers with their raceways by ISO/TS 16281: lamina loads, the inner ring in balance, its tangent.

Rows of rollers between two rigid rings. Each roller is cut into laminae; a lamina between both raceways
carries ``c_L / n * delta^(10/9)`` with ``c_L = 35948 L_we^(8/9)`` (N, mm), its approach ``delta`` following
from the six displacements of the inner ring relative to the outer one. Because every lamina has a potential,
the load of the bearing is the gradient of a convex function: the equilibrium under a given force is unique
and the tangent symmetric.

Rings are rigid, ribs, cage, friction, centrifugal forces and the housing are left out. The frame is that of
`exugear.bearings.rows`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from exugear.bearings.rows import BearingError, RollerRow, RollingBearing, RollingRow
from fe_ste.tools.arrays import Floats, Integers

LINE_CONTACT_EXPONENT = 10.0 / 9.0
"""Load of a line contact over its approach."""
MOST_NEWTON_STEPS = 200
"""Steps after which the search for an equilibrium is given up."""


@dataclass(frozen=True)
class LaminaArrays:
    """All laminae of a bearing as arrays, the input of the kernels.

    Attributes
    ----------
    direction : (n, 6) array
        Gradient of each lamina's approach with respect to the six displacements (1 and m).
    gap : (n,) array
        Approach at which the lamina begins to carry, m.
    constant : (n,) array
        ``c_L / laminae``, N/m^(10/9).
    roller : (n,) array of int
        Number of the roller that each lamina belongs to, counted through all rows.
    """

    direction: Floats
    gap: Floats
    constant: Floats
    roller: Integers


def lamina_arrays(rows: Sequence[RollingRow], first_roller_angle: float = 0.0) -> LaminaArrays:
    """Place the rollers and their laminae.

    Parameters
    ----------
    rows : sequence of RollerRow
        Rows in the frame of the bearing.
    first_roller_angle : float
        Polar angle of the first roller of each row, rad.

    Returns
    -------
    LaminaArrays
    """
    parts = [_row_laminae(row, first_roller_angle) for row in rows]
    offsets = np.cumsum([0, *(row.element_count for row in rows)])
    return LaminaArrays(
        direction=np.concatenate([part.direction for part in parts]),
        gap=np.concatenate([part.gap for part in parts]),
        constant=np.concatenate([part.constant for part in parts]),
        roller=np.concatenate([part.roller + offset for part, offset in zip(parts, offsets, strict=False)]),
    )


def _row_laminae(row: RollingRow, first_roller_angle: float) -> LaminaArrays:
    if not isinstance(row, RollerRow):
        raise BearingError("bearing: contact of balls with their raceways is not computed yet")
    number = np.repeat(np.arange(row.element_count), row.laminae)
    polar = first_roller_angle + 2.0 * math.pi * number / row.element_count
    slices = (np.arange(row.laminae) + 0.5) / row.laminae - 0.5  # middle of each slice, in roller lengths
    along = np.tile(slices, row.element_count) * row.effective_length
    cosine, sine = math.cos(row.contact_angle), math.sin(row.contact_angle)
    normal = np.column_stack([cosine * np.cos(polar), cosine * np.sin(polar), np.full(polar.size, sine)])
    radius = 0.5 * row.pitch_diameter - along * sine
    point = np.column_stack([radius * np.cos(polar), radius * np.sin(polar), row.axial_position + along * cosine])
    if row.aligning:
        point[:] = 0.0  # the raceway is a sphere: contact forces pass through its centre, that of the bearing
    return LaminaArrays(
        direction=np.hstack([normal, np.cross(point, normal)]),
        gap=0.5 * row.radial_clearance * cosine + 2.0 * row.drop(along),
        constant=np.full(polar.size, row.contact_constant / row.laminae),
        roller=number,
    )


def lamina_loads(laminae: LaminaArrays, displacement: Floats) -> Floats:
    """Load of each lamina, N, shape (n,), at a displacement of the inner ring, shape (6,)."""
    approach = np.maximum(laminae.direction @ displacement - laminae.gap, 0.0)
    return laminae.constant * approach**LINE_CONTACT_EXPONENT


def elastic_energy(laminae: LaminaArrays, displacement: Floats) -> float:
    """Energy stored in all contacts, J; its gradient is `bearing_load`."""
    approach = np.maximum(laminae.direction @ displacement - laminae.gap, 0.0)
    power = LINE_CONTACT_EXPONENT + 1.0
    return float(np.sum(laminae.constant * approach**power) / power)


def bearing_load(laminae: LaminaArrays, displacement: Floats) -> Floats:
    """Force and moment that hold the inner ring at a displacement, N and N m, shape (6,)."""
    load: Floats = laminae.direction.T @ lamina_loads(laminae, displacement)
    return load


def tangent_stiffness(laminae: LaminaArrays, displacement: Floats) -> Floats:
    """Differentiate `bearing_load` with respect to the displacement, shape (6, 6), symmetric."""
    approach = np.maximum(laminae.direction @ displacement - laminae.gap, 0.0)
    slope = LINE_CONTACT_EXPONENT * laminae.constant * approach ** (LINE_CONTACT_EXPONENT - 1.0)
    return _weighted_gram(laminae.direction, np.where(approach > 0.0, slope, 0.0))


def secant_stiffness(laminae: LaminaArrays, displacement: Floats) -> Floats:
    """Symmetric matrix that turns the displacement into the load at that displacement, shape (6, 6).

    Each lamina counts with its load over its whole approach, clearance included.
    """
    whole_approach = laminae.direction @ displacement
    load = lamina_loads(laminae, displacement)
    carrying = load > 0.0
    if np.any(whole_approach[carrying] <= 0.0):
        raise BearingError("a preloaded row carries where the displacement opens it: it has no secant, use the tangent")
    return _weighted_gram(laminae.direction, np.divide(load, whole_approach, out=np.zeros_like(load), where=carrying))


def _weighted_gram(direction: Floats, weight: Floats) -> Floats:
    gram = direction.T @ (weight[:, None] * direction)
    symmetric: Floats = 0.5 * (gram + gram.T)
    return symmetric


@dataclass(frozen=True)
class BearingState:
    """A bearing in equilibrium with a force.

    Attributes
    ----------
    displacement : (6,) array
        Inner ring relative to outer ring, m and rad.
    load : (6,) array
        Force and moment on the inner ring that hold it there, N and N m.
    tangent : (6, 6) array
        Derivative of the load, N/m, N, N m/rad.
    roller_load : (rollers,) array
        Load of each roller, row by row, N.
    energy : float
        Elastic energy, J.
    laminae : LaminaArrays
        The contacts, for further evaluation.
    """

    displacement: Floats
    load: Floats
    tangent: Floats
    roller_load: Floats
    energy: float
    laminae: LaminaArrays

    def __repr__(self) -> str:
        """Displacement and load in one line."""
        displacement, load = (
            ", ".join(f"{round(value, 3) + 0.0:.3g}" for value in values.tolist())
            for values in (1e6 * self.displacement[:3], 1e-3 * self.load[:3])
        )
        rollers = f"{np.count_nonzero(self.roller_load)} of {len(self.roller_load)} rollers loaded"
        return f"<BearingState ({displacement}) um under ({load}) kN, {rollers}>"

    @property
    def secant(self) -> Floats:
        """Secant stiffness, shape (6, 6): ``secant @ displacement = load``."""
        return secant_stiffness(self.laminae, self.displacement)

    @property
    def radial_stiffness(self) -> float:
        """Tangent along the radial load with all other coordinates held, N/m."""
        direction = self.load[:2] / np.linalg.norm(self.load[:2])
        return float(direction @ self.tangent[:2, :2] @ direction)


def equilibrium(
    bearing: RollingBearing,
    force: ArrayLike,
    *,
    tilt: ArrayLike = (0.0, 0.0),
    first_roller_angle: float = 0.0,
) -> BearingState:
    """Displace the inner ring until the rollers balance a force.

    Parameters
    ----------
    bearing : RollingBearing
        The bearing.
    force : array_like, shape (3,)
        Force of the shaft on the inner ring, N, z along the axis.
    tilt : array_like, shape (2,)
        Rotations of the inner ring about x and y, rad, held: shaft and housing decide about them.
    first_roller_angle : float
        Polar angle of the first roller of each row, rad.

    Returns
    -------
    BearingState

    Raises
    ------
    BearingError
        If no displacement balances the force: an axial force on cylindrical rollers, or on a single tapered
        row an axial force below what its radial load induces.

    Notes
    -----
    Newton's method with line search on ``U(u) - F u``, which is convex because each lamina's energy is.

    Examples
    --------
    >>> from exugear.bearings.rollers import CylindricalRollerBearing
    >>> bearing = CylindricalRollerBearing(bore=0.160, outside_diameter=0.290, width=0.080)
    >>> state = equilibrium(bearing, (129.9e3, 0.0, 0.0))
    >>> round(1e6 * state.displacement[0])  # micrometres
    48
    """
    applied = np.asarray(force, dtype=np.float64)
    if applied.shape != (3,) or not np.all(np.isfinite(applied)):
        raise BearingError(f"bearing: force = {force!r} must be three finite numbers")
    if not np.any(applied):
        raise BearingError("bearing: force = 0; without load or preload a roller bearing has no stiffness")
    laminae = lamina_arrays(bearing.rows, first_roller_angle)
    if applied[2] != 0.0 and not np.any(laminae.direction[:, 2] * np.sign(applied[2]) > 0.0):
        raise BearingError(f"bearing: no row holds an axial force of {applied[2]:.6g} N")
    displacement = _balance(laminae, applied, np.asarray(tilt, dtype=np.float64))
    roller_load = np.zeros(laminae.roller[-1] + 1)
    np.add.at(roller_load, laminae.roller, lamina_loads(laminae, displacement))
    return BearingState(
        displacement=displacement,
        load=bearing_load(laminae, displacement),
        tangent=tangent_stiffness(laminae, displacement),
        roller_load=roller_load,
        energy=elastic_energy(laminae, displacement),
        laminae=laminae,
    )


def _balance(laminae: LaminaArrays, force: Floats, tilt: Floats) -> Floats:
    """Displacement whose first three load components are `force` (N), the tilt held."""
    displacement = np.zeros(6)
    displacement[3:5] = tilt
    displacement[:3] = _first_touch(laminae, force)
    tolerance = 1e-10 * float(np.linalg.norm(force))

    def surplus(candidate: Floats) -> float:
        return elastic_energy(laminae, candidate) - float(force @ candidate[:3])

    for _ in range(MOST_NEWTON_STEPS):
        residual = force - bearing_load(laminae, displacement)[:3]
        if np.linalg.norm(residual) <= tolerance:
            return displacement
        # The least-squares step leaves directions without stiffness and without load where they are.
        stiffness = tangent_stiffness(laminae, displacement)[:3, :3]
        step = np.zeros(6)
        step[:3] = np.linalg.lstsq(stiffness, residual, rcond=1e-12)[0]
        displacement = _line_search(surplus, displacement, step, float(residual @ step[:3]), tolerance)
    raise BearingError(
        f"bearing: no equilibrium with the force {force.tolist()} N; "
        "a single tapered row needs an axial force that covers what its radial load induces"
    )


def _line_search(
    surplus: Callable[[Floats], float],
    displacement: Floats,
    step: Floats,
    descent: float,
    tolerance: float,
) -> Floats:
    """Halve the step until the energy falls; close to the minimum rounding hides the fall, take it whole."""
    if descent <= tolerance * float(np.linalg.norm(step)):
        return displacement + step
    start = surplus(displacement)
    fraction = 1.0
    while surplus(displacement + fraction * step) > start - 1e-4 * fraction * descent and fraction > 1e-6:
        fraction *= 0.5
    return displacement + fraction * step


def _first_touch(laminae: LaminaArrays, force: Floats) -> Floats:
    """Start in contact: along the force until the rollers that face it would carry it alone."""
    if np.any(laminae.gap < 0.0):
        return np.zeros(3)  # preloaded rows are in contact already
    direction = force / np.linalg.norm(force)
    facing = laminae.direction[:, :3] @ direction
    touching = facing > 0.5 * facing.max()

    def shortage(distance: float) -> float:
        approach = np.maximum(facing[touching] * distance - laminae.gap[touching], 0.0)
        load = laminae.constant[touching] * approach**LINE_CONTACT_EXPONENT
        return float(np.linalg.norm(force) - load @ facing[touching])

    upper = float(np.max(laminae.gap[touching] / facing[touching])) + 1e-6
    while shortage(upper) > 0.0:
        upper *= 2.0
    import scipy.optimize  # a tenth of a second that a gearbox with given stiffnesses need not wait

    distance: Floats = scipy.optimize.brentq(shortage, 0.0, upper) * direction
    return distance


def pitch_averaged_tangent(bearing: RollingBearing, force: ArrayLike, positions: int = 4) -> Floats:
    """Tangent under a force, averaged over the cage positions within one roller pitch.

    A linear model knows no cage; the mean over the pitch is what a turning bearing shows.

    Parameters
    ----------
    bearing : RollingBearing
        The bearing.
    force : array_like, shape (3,)
        Force on the inner ring, N.
    positions : int
        Number of equally spaced cage positions.

    Returns
    -------
    (6, 6) array

    Examples
    --------
    >>> from exugear.bearings.rollers import CylindricalRollerBearing
    >>> bearing = CylindricalRollerBearing(bore=0.100, outside_diameter=0.180, width=0.046)
    >>> stiffness = pitch_averaged_tangent(bearing, (33.5e3, 0.0, 0.0))
    >>> float(round(stiffness[0, 0] / 1e9, 1))
    2.1
    """
    pitch = 2.0 * math.pi / bearing.rows[0].element_count
    total = np.zeros((6, 6))
    for position in range(positions):
        angle = pitch * position / positions
        total += equilibrium(bearing, force, first_roller_angle=angle).tangent
    return total / positions
