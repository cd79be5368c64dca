"""Stiffness of rolling bearings from catalogue dimensions, by ISO/TS 16281.

Rows of rollers between two rigid rings. Each roller is cut into laminae; a lamina between both raceways
carries ``c_L / n * delta^(10/9)`` with ``c_L = 35948 L_we^(8/9)`` (N, mm), its approach ``delta`` following
from the six displacements of the inner ring relative to the outer one. Because every lamina has a potential,
the load of the bearing is the gradient of a convex function: the equilibrium under a given force is unique
and the tangent symmetric.

Frame: origin at the middle of the bearing, z along its axis; coordinates
``(u_x, u_y, u_z, theta_x, theta_y, theta_z)`` of the inner ring relative to the outer ring, SI units.
Rings are rigid, ribs, cage, friction, centrifugal forces and the housing are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

#: Load-deflection constant of steel line contact, roller against both raceways, N/m^2 in SI:
#: 35948 N/mm^(10/9) mm^(-8/9), where the exponents of the length add up to two (ISO/TS 16281).
LINE_CONTACT_CONSTANT = 35948.0e6
LINE_CONTACT_EXPONENT = 10.0 / 9.0

#: Logarithmic roller profile of ISO/TS 16281: drop / roller diameter, for `RollerRow.profile_factor`.
CYLINDRICAL_ROLLER_PROFILE = 0.00035
TAPERED_ROLLER_PROFILE = 0.00045


class BearingError(ValueError):
    """The bearing cannot exist, or cannot carry the load it is given."""


@dataclass(frozen=True, kw_only=True)
class RollerRow:
    """One row of rollers, the element all roller bearings are made of.

    Attributes
    ----------
    roller_diameter, effective_length, pitch_diameter : float
        Mean roller diameter, effective contact length and pitch circle diameter, m.
    roller_count : int
        Number of rollers.
    contact_angle : float
        Angle between the contact normal and the radial plane, rad, signed: positive where the row holds an
        inner ring that is pushed towards +z. Zero for cylindrical rollers.
    axial_position : float
        Middle of the rollers in the frame of the bearing, m.
    radial_clearance : float
        Diametral clearance of the mounted row in the radial plane, m. Negative: preload.
    profile_factor : float
        Logarithmic profile over roller diameter; 0 for a straight roller.
    laminae : int
        Slices per roller; ISO/TS 16281 asks for at least 30.
    """

    roller_diameter: float
    effective_length: float
    pitch_diameter: float
    roller_count: int
    contact_angle: float = 0.0
    axial_position: float = 0.0
    radial_clearance: float = 0.0
    profile_factor: float = 0.0
    laminae: int = 30

    def __post_init__(self) -> None:
        """Refuse what cannot be built."""
        for key in ("roller_diameter", "effective_length", "pitch_diameter"):
            if not getattr(self, key) > 0.0:
                raise BearingError(f"roller row: {key} = {getattr(self, key)!r} must be positive")
        if self.roller_count < 3:
            raise BearingError(f"roller row: roller_count = {self.roller_count} must be at least 3")
        if self.laminae < 1:
            raise BearingError(f"roller row: laminae = {self.laminae} must be at least 1")
        if not abs(self.contact_angle) < math.pi / 2:
            raise BearingError(f"roller row: contact_angle = {self.contact_angle} rad must lie within +-pi/2")
        if self.profile_factor < 0.0:
            raise BearingError(f"roller row: profile_factor = {self.profile_factor} must not be negative")
        if self.roller_count * self.roller_diameter > math.pi * self.pitch_diameter:
            raise BearingError(
                f"roller row: {self.roller_count} rollers of {1e3 * self.roller_diameter:.1f} mm "
                f"do not fit on a pitch circle of {1e3 * self.pitch_diameter:.1f} mm"
            )

    @property
    def contact_constant(self) -> float:
        """``c_L`` of a whole roller, N/m^(10/9)."""
        return LINE_CONTACT_CONSTANT * float(self.effective_length ** (8.0 / 9.0))


class RollerBearing(Protocol):
    """Anything made of rows of rollers between one inner and one outer ring body."""

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """Rows in the frame of the bearing."""
        ...


@dataclass(frozen=True, kw_only=True)
class CylindricalRollerBearing:
    """Single-row cylindrical roller bearing from its boundary dimensions.

    What the catalogue does not print is estimated from the boundary dimensions: roller diameter
    ``0.27 (D - d)``, effective length ``0.75 B``, and as many rollers as fit on the pitch circle at a
    pitch of 1.15 roller diameters (with a cage) or 1.01 (full complement).

    Parameters
    ----------
    bore, outside_diameter, width : float
        Boundary dimensions d, D, B, m.
    full_complement : bool
        Without a cage.
    roller_diameter, effective_length, roller_count : optional
        Replace the estimates where they are known.
    radial_clearance, profile_factor, laminae
        See `RollerRow`.

    Examples
    --------
    >>> bearing = CylindricalRollerBearing(bore=0.160, outside_diameter=0.290, width=0.080)
    >>> bearing.rows[0].roller_count
    17
    """

    bore: float
    outside_diameter: float
    width: float
    full_complement: bool = False
    roller_diameter: float | None = None
    effective_length: float | None = None
    roller_count: int | None = None
    radial_clearance: float = 0.0
    profile_factor: float = 0.0
    laminae: int = 30

    def __post_init__(self) -> None:
        """Check the boundary dimensions and the row that follows from them."""
        _check_boundary_dimensions(self.bore, self.outside_diameter, self.width)
        _ = self.rows

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """The one row, in the middle of the bearing."""
        return (_row_from_catalogue(self, contact_angle=0.0),)


@dataclass(frozen=True, kw_only=True)
class TaperedRollerBearing:
    """Single-row tapered roller bearing from its boundary dimensions.

    The pressure line is taken at the one contact angle that catalogues state (outer raceway); the rib is
    left out. Used alone, the bearing holds an inner ring that is pushed towards +z; turn it by a negative
    `contact_angle` or combine two in a `BearingPair`.

    Parameters
    ----------
    bore, outside_diameter, width : float
        Boundary dimensions d, D, T, m.
    contact_angle : float
        Nominal contact angle, rad, signed as in `RollerRow`.
    full_complement, roller_diameter, effective_length, roller_count : optional
        As in `CylindricalRollerBearing`.
    radial_clearance, profile_factor, laminae
        As in `CylindricalRollerBearing`.

    Examples
    --------
    >>> bearing = TaperedRollerBearing(
    ...     bore=0.160, outside_diameter=0.240, width=0.051, contact_angle=math.radians(17.0)
    ... )
    >>> round(1e3 * bearing.rows[0].roller_diameter, 1)
    21.6
    """

    bore: float
    outside_diameter: float
    width: float
    contact_angle: float
    full_complement: bool = False
    roller_diameter: float | None = None
    effective_length: float | None = None
    roller_count: int | None = None
    radial_clearance: float = 0.0
    profile_factor: float = 0.0
    laminae: int = 30

    def __post_init__(self) -> None:
        """Check the boundary dimensions and the row that follows from them."""
        _check_boundary_dimensions(self.bore, self.outside_diameter, self.width)
        if self.contact_angle == 0.0:
            raise BearingError("tapered roller bearing: contact_angle = 0 makes it a cylindrical one")
        _ = self.rows

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """The one row, in the middle of the bearing."""
        return (_row_from_catalogue(self, contact_angle=self.contact_angle),)


@dataclass(frozen=True, kw_only=True)
class BearingPair:
    """Two equal bearings side by side on one shaft and in one housing, as one bearing.

    Parameters
    ----------
    bearing : CylindricalRollerBearing or TaperedRollerBearing
        One of the two.
    arrangement : {"X", "O", "tandem"}
        X (face to face): pressure lines meet the axis towards the middle of the pair. O (back to back): away
        from it, stiff against tilting. Tandem: both rows take the same direction; also right for cylindrical
        rollers, where the three are the same.
    row_distance : float, optional
        Distance of the middles of the rows, m; by default the width of one bearing (mounted face to face).
    axial_preload : float
        Approach of the two rows along the axis against line-to-line contact, m; negative: axial clearance.

    Examples
    --------
    >>> taper = TaperedRollerBearing(
    ...     bore=0.160, outside_diameter=0.240, width=0.051, contact_angle=math.radians(17.0)
    ... )
    >>> pair = BearingPair(bearing=taper, arrangement="X")
    >>> [row.contact_angle > 0.0 for row in pair.rows]
    [False, True]
    """

    bearing: CylindricalRollerBearing | TaperedRollerBearing
    arrangement: Literal["X", "O", "tandem"]
    row_distance: float | None = None
    axial_preload: float = 0.0

    def __post_init__(self) -> None:
        """Refuse distances and arrangements that do not exist."""
        if self.arrangement not in ("X", "O", "tandem"):
            raise BearingError(f"bearing pair: arrangement = {self.arrangement!r} is not 'X', 'O' or 'tandem'")
        if self.row_distance is not None and self.row_distance < 0.0:
            raise BearingError(f"bearing pair: row_distance = {self.row_distance} m must not be negative")
        if self.axial_preload != 0.0 and self.rows[0].contact_angle == 0.0:
            raise BearingError("bearing pair: axial_preload needs rows with a contact angle")

    @property
    def rows(self) -> tuple[RollerRow, ...]:
        """The row at -z, then the row at +z."""
        (row,) = self.bearing.rows
        half_distance = 0.5 * (self.bearing.width if self.row_distance is None else self.row_distance)
        angle = abs(row.contact_angle)
        tandem = (row.contact_angle, row.contact_angle)
        angles = {"X": (-angle, angle), "O": (angle, -angle), "tandem": tandem}[self.arrangement]
        # An axial approach of both rows is shared by halves and closes each as a radial clearance does.
        clearance = row.radial_clearance - self.axial_preload * math.tan(angle)
        lower, upper = (
            replace(row, contact_angle=signed, axial_position=position, radial_clearance=clearance)
            for signed, position in zip(angles, (-half_distance, half_distance), strict=True)
        )
        return lower, upper


def _check_boundary_dimensions(bore: float, outside_diameter: float, width: float) -> None:
    if not 0.0 < bore < outside_diameter:
        raise BearingError(f"bearing: bore = {bore} m must lie between 0 and outside_diameter = {outside_diameter} m")
    if not width > 0.0:
        raise BearingError(f"bearing: width = {width} m must be positive")


def _row_from_catalogue(bearing: CylindricalRollerBearing | TaperedRollerBearing, contact_angle: float) -> RollerRow:
    """Fill what the catalogue leaves open with the usual proportions of the design."""
    pitch_diameter = 0.5 * (bearing.bore + bearing.outside_diameter)
    diameter = bearing.roller_diameter or 0.27 * (bearing.outside_diameter - bearing.bore)
    pitch_over_diameter = 1.01 if bearing.full_complement else 1.15
    return RollerRow(
        roller_diameter=diameter,
        effective_length=bearing.effective_length or 0.75 * bearing.width,
        pitch_diameter=pitch_diameter,
        roller_count=bearing.roller_count or int(math.pi * pitch_diameter / (pitch_over_diameter * diameter)),
        contact_angle=contact_angle,
        radial_clearance=bearing.radial_clearance,
        profile_factor=bearing.profile_factor,
        laminae=bearing.laminae,
    )


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

    direction: FloatArray
    gap: FloatArray
    constant: FloatArray
    roller: NDArray[np.int64]


def lamina_arrays(rows: Sequence[RollerRow], first_roller_angle: float = 0.0) -> LaminaArrays:
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
    offsets = np.cumsum([0, *(row.roller_count for row in rows)])
    return LaminaArrays(
        direction=np.concatenate([part.direction for part in parts]),
        gap=np.concatenate([part.gap for part in parts]),
        constant=np.concatenate([part.constant for part in parts]),
        roller=np.concatenate([part.roller + offset for part, offset in zip(parts, offsets, strict=False)]),
    )


def _row_laminae(row: RollerRow, first_roller_angle: float) -> LaminaArrays:
    number = np.repeat(np.arange(row.roller_count), row.laminae)
    polar = first_roller_angle + 2.0 * math.pi * number / row.roller_count
    slices = (np.arange(row.laminae) + 0.5) / row.laminae - 0.5  # middle of each slice, in roller lengths
    along = np.tile(slices, row.roller_count) * row.effective_length
    cosine, sine = math.cos(row.contact_angle), math.sin(row.contact_angle)
    normal = np.column_stack([cosine * np.cos(polar), cosine * np.sin(polar), np.full(polar.size, sine)])
    radius = 0.5 * row.pitch_diameter - along * sine
    point = np.column_stack([radius * np.cos(polar), radius * np.sin(polar), row.axial_position + along * cosine])
    drop = -row.profile_factor * row.roller_diameter * np.log(1.0 - (2.0 * along / row.effective_length) ** 2)
    return LaminaArrays(
        direction=np.hstack([normal, np.cross(point, normal)]),
        gap=0.5 * row.radial_clearance * cosine + 2.0 * drop,
        constant=np.full(polar.size, row.contact_constant / row.laminae),
        roller=number,
    )


def lamina_loads(laminae: LaminaArrays, displacement: FloatArray) -> FloatArray:
    """Load of each lamina, N, shape (n,), at a displacement of the inner ring, shape (6,)."""
    approach = np.maximum(laminae.direction @ displacement - laminae.gap, 0.0)
    return laminae.constant * approach**LINE_CONTACT_EXPONENT


def elastic_energy(laminae: LaminaArrays, displacement: FloatArray) -> float:
    """Energy stored in all contacts, J; its gradient is `bearing_load`."""
    approach = np.maximum(laminae.direction @ displacement - laminae.gap, 0.0)
    power = LINE_CONTACT_EXPONENT + 1.0
    return float(np.sum(laminae.constant * approach**power) / power)


def bearing_load(laminae: LaminaArrays, displacement: FloatArray) -> FloatArray:
    """Force and moment that hold the inner ring at a displacement, N and N m, shape (6,)."""
    load: FloatArray = laminae.direction.T @ lamina_loads(laminae, displacement)
    return load


def tangent_stiffness(laminae: LaminaArrays, displacement: FloatArray) -> FloatArray:
    """Differentiate `bearing_load` with respect to the displacement, shape (6, 6), symmetric."""
    approach = np.maximum(laminae.direction @ displacement - laminae.gap, 0.0)
    slope = LINE_CONTACT_EXPONENT * laminae.constant * approach ** (LINE_CONTACT_EXPONENT - 1.0)
    return _weighted_gram(laminae.direction, np.where(approach > 0.0, slope, 0.0))


def secant_stiffness(laminae: LaminaArrays, displacement: FloatArray) -> FloatArray:
    """Symmetric matrix that turns the displacement into the load at that displacement, shape (6, 6).

    Each lamina counts with its load over its whole approach, clearance included.
    """
    whole_approach = laminae.direction @ displacement
    load = lamina_loads(laminae, displacement)
    carrying = load > 0.0
    if np.any(whole_approach[carrying] <= 0.0):
        raise BearingError("a preloaded row carries where the displacement opens it: it has no secant, use the tangent")
    return _weighted_gram(laminae.direction, np.divide(load, whole_approach, out=np.zeros_like(load), where=carrying))


def _weighted_gram(direction: FloatArray, weight: FloatArray) -> FloatArray:
    gram = direction.T @ (weight[:, None] * direction)
    symmetric: FloatArray = 0.5 * (gram + gram.T)
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

    displacement: FloatArray
    load: FloatArray
    tangent: FloatArray
    roller_load: FloatArray
    energy: float
    laminae: LaminaArrays

    @property
    def secant(self) -> FloatArray:
        """Secant stiffness, shape (6, 6): ``secant @ displacement = load``."""
        return secant_stiffness(self.laminae, self.displacement)

    @property
    def radial_stiffness(self) -> float:
        """Tangent along the radial load with all other coordinates held, N/m."""
        direction = self.load[:2] / np.linalg.norm(self.load[:2])
        return float(direction @ self.tangent[:2, :2] @ direction)


def equilibrium(
    bearing: RollerBearing,
    force: ArrayLike,
    *,
    tilt: ArrayLike = (0.0, 0.0),
    first_roller_angle: float = 0.0,
) -> BearingState:
    """Displace the inner ring until the rollers balance a force.

    Parameters
    ----------
    bearing : RollerBearing
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
    >>> bearing = CylindricalRollerBearing(bore=0.160, outside_diameter=0.290, width=0.080)
    >>> state = equilibrium(bearing, (129.9e3, 0.0, 0.0))
    >>> round(1e6 * state.displacement[0])  # micrometres
    33
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


def _balance(laminae: LaminaArrays, force: FloatArray, tilt: FloatArray) -> FloatArray:
    """Displacement whose first three load components are `force` (N), the tilt held."""
    displacement = np.zeros(6)
    displacement[3:5] = tilt
    displacement[:3] = _first_touch(laminae, force)
    tolerance = 1e-10 * float(np.linalg.norm(force))

    def surplus(candidate: FloatArray) -> float:
        return elastic_energy(laminae, candidate) - float(force @ candidate[:3])

    for _ in range(200):
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
    surplus: Callable[[FloatArray], float],
    displacement: FloatArray,
    step: FloatArray,
    descent: float,
    tolerance: float,
) -> FloatArray:
    """Halve the step until the energy falls; close to the minimum rounding hides the fall, take it whole."""
    if descent <= tolerance * float(np.linalg.norm(step)):
        return displacement + step
    start = surplus(displacement)
    fraction = 1.0
    while surplus(displacement + fraction * step) > start - 1e-4 * fraction * descent and fraction > 1e-6:
        fraction *= 0.5
    return displacement + fraction * step


def _first_touch(laminae: LaminaArrays, force: FloatArray) -> FloatArray:
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

    distance: FloatArray = scipy.optimize.brentq(shortage, 0.0, upper) * direction
    return distance


def pitch_averaged_tangent(bearing: RollerBearing, force: ArrayLike, positions: int = 4) -> FloatArray:
    """Tangent under a force, averaged over the cage positions within one roller pitch.

    A linear model knows no cage; the mean over the pitch is what a turning bearing shows.

    Parameters
    ----------
    bearing : RollerBearing
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
    >>> bearing = CylindricalRollerBearing(bore=0.100, outside_diameter=0.180, width=0.046)
    >>> stiffness = pitch_averaged_tangent(bearing, (33.5e3, 0.0, 0.0))
    >>> float(round(stiffness[0, 0] / 1e9, 1))
    2.4
    """
    pitch = 2.0 * math.pi / bearing.rows[0].roller_count
    total = np.zeros((6, 6))
    for position in range(positions):
        angle = pitch * position / positions
        total += equilibrium(bearing, force, first_roller_angle=angle).tangent
    return total / positions


def axially_symmetric(stiffness: FloatArray) -> FloatArray:
    """Mean of a 6x6 stiffness over all directions in the plane of the bearing.

    Parameters
    ----------
    stiffness : (6, 6) array
        In the frame of the bearing.

    Returns
    -------
    (6, 6) array
        Unchanged by any turn about z, for models that want one radial and one tilting stiffness.

    Examples
    --------
    >>> mean = axially_symmetric(np.diag([3.0, 1.0, 0.5, 4.0, 2.0, 0.0]))
    >>> [round(float(entry), 12) for entry in np.diag(mean)]
    [2.0, 2.0, 0.5, 3.0, 3.0, 0.0]
    """
    # The entries hold harmonics up to the second of the turning angle: three positions average them out.
    turned = [rotate_stiffness(stiffness, 2.0 * math.pi * position / 3.0) for position in range(3)]
    mean: FloatArray = np.mean(turned, axis=0)
    return mean


def rotate_stiffness(stiffness: FloatArray, angle: float) -> FloatArray:
    """Turn a 6x6 stiffness about z by an angle (rad), shape (6, 6)."""
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.kron(np.eye(2), np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]))
    turned: FloatArray = turn @ stiffness @ turn.T
    return turned


def regularised(stiffness: FloatArray, floor: ArrayLike) -> FloatArray:
    """Give directions without stiffness the one that is stated.

    Parameters
    ----------
    stiffness : (6, 6) array
        Symmetric stiffness.
    floor : array_like, shape (6,)
        Least diagonal entries, N/m and N m/rad; zero leaves a direction free.

    Returns
    -------
    (6, 6) array
        The diagonal raised to the floor where it lies below, everything else as before.

    Examples
    --------
    >>> held = regularised(np.diag([4e9, 4e9, 0.0, 1e6, 1e6, 0.0]), (0.0, 0.0, 1e8, 0.0, 0.0, 0.0))
    >>> float(held[2, 2]), float(held[5, 5])
    (100000000.0, 0.0)
    """
    least = np.asarray(floor, dtype=np.float64)
    if least.shape != (6,) or np.any(least < 0.0):
        raise BearingError(f"regularisation: floor = {floor!r} must be six numbers, none negative")
    raised: FloatArray = stiffness + np.diag(np.maximum(least - np.diag(stiffness), 0.0))
    return raised


def in_series(first: FloatArray, second: FloatArray) -> FloatArray:
    """Stiffness of two elements that carry the same load one behind the other.

    Parameters
    ----------
    first, second : (6, 6) array
        Symmetric, positive semi-definite: for example bearing and housing seat, about the same point.

    Returns
    -------
    (6, 6) array
        Parallel sum ``A (A + B)^+ B`` of the matrices: ``(A^-1 + B^-1)^-1`` where these exist; a direction
        that either leaves free is free.

    Examples
    --------
    >>> series = in_series(np.diag([2.0, 2.0, 0.0, 1.0, 1.0, 0.0]), np.diag([2.0, 6.0, 5.0, 1.0, 1.0, 0.0]))
    >>> [round(float(entry), 12) for entry in np.diag(series)]
    [1.0, 1.5, 0.0, 0.5, 0.5, 0.0]
    """
    # Forces and moments differ by orders of magnitude: scale to a unit diagonal before a rank is decided.
    total = first + second
    scale = np.sqrt(np.where(np.diag(total) > 0.0, np.diag(total), 1.0))
    scales = np.outer(scale, scale)
    inverse = np.linalg.pinv(total / scales, rcond=1e-13, hermitian=True) / scales
    series = first @ inverse @ second
    symmetric: FloatArray = 0.5 * (series + series.T)
    return symmetric


def proportional_damping(stiffness: FloatArray, time_constant: float) -> FloatArray:
    """Viscous damping ``beta K``.

    Parameters
    ----------
    stiffness : (6, 6) array
        Stiffness.
    time_constant : float
        beta, s. A mode of frequency f with all its strain energy here gets the damping ratio ``pi f beta``.

    Returns
    -------
    (6, 6) array

    Examples
    --------
    >>> float(proportional_damping(1e9 * np.eye(6), 4e-6)[0, 0])
    4000.0
    """
    if time_constant < 0.0:
        raise BearingError(f"damping: time_constant = {time_constant} s must not be negative")
    return time_constant * stiffness
