"""Laws of supports: stiffness and damping as matrices, or rows of rolling elements with a law of their own.

A bearing with `model = "linear"` is linear: given matrices through the origin, or the tangent of its rows through the
point that they are in under the static load, which `exugear.system.operating_points` finds. One with
`model = "iso16281"` keeps its rows. The housing factor f stands for the seat: it gives way in proportion to the
bearing, so that the bearing takes the share f of a deflection under any load. A linear bearing is then f times as
stiff, and the rows of a non-linear one see f times the deflection: both agree in the limit of small motions, and forces
keep a potential. A clearance closes without load, which no share of a deflection does: such rows want an elastic
housing or no factor.

Catalogue bearings take their laws from the static load at one position of the carrier, where planets may be loaded
unequally. As the carrier turns every planet passes all positions: what lasts is the mean. Left as they are, unequal
planets would be an asymmetry that turns with the carrier, and make sidebands. Of rows of rolling elements the mean is
that of their places, which follow the load's direction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Bearing, Body, connector_matrix
from exugear.gearbox.sections.connections import CatalogueSection
from exugear.gearbox.units import optional_si, si
from exugear.gearbox.variant import Variant
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.contact import pitch_averaged_tangent
from exugear.system.bearings.rolling.point_contact import rolling_arrays
from exugear.system.bearings.rolling.ratings import basic_dynamic_rating
from exugear.system.bearings.rolling.rows import BearingError, BearingOfRows, RollingRow
from exugear.system.kernels.connectors import ConnectorArrays
from fe_ste.tools.arrays import Floats, Integers

# 6x6 matrices of bearings: symmetric about the axis, turned, in series with their seats, regularised


def axially_symmetric(stiffness: Floats) -> Floats:
    """Mean of a 6x6 stiffness over all directions in the plane of the bearing.

    Parameters
    ----------
    stiffness : (6, 6) in the frame of the bearing

    Returns
    -------
    (6, 6) unchanged by any turn about z, for models that want one radial and one tilting stiffness

    Examples
    --------
    >>> mean = axially_symmetric(np.diag([3.0, 1.0, 0.5, 4.0, 2.0, 0.0]))
    >>> [round(float(entry), 12) for entry in np.diag(mean)]
    [2.0, 2.0, 0.5, 3.0, 3.0, 0.0]
    """
    # The entries hold harmonics up to the second of the turning angle: three positions average them out.
    turned = [rotate_stiffness(stiffness, 2.0 * math.pi * position / 3.0) for position in range(3)]
    mean: Floats = np.mean(turned, axis=0)
    return mean


def rotate_stiffness(stiffness: Floats, angle: float) -> Floats:
    """Turn a 6x6 stiffness about z by an angle (rad), shape (6, 6)."""
    turn = _turn(angle)
    turned: Floats = turn @ stiffness @ turn.T
    return turned


def regularised(stiffness: Floats, floor: ArrayLike) -> Floats:
    """Set a stated stiffness in directions without stiffness.

    Parameters
    ----------
    stiffness : (6, 6) symmetric stiffness
    floor : (6,) minimum diagonal entries, N/m and N m/rad; zero leaves a direction free

    Returns
    -------
    (6, 6) the diagonal raised to the floor where it lies below, everything else as before

    Examples
    --------
    >>> held = regularised(np.diag([4e9, 4e9, 0.0, 1e6, 1e6, 0.0]), (0.0, 0.0, 1e8, 0.0, 0.0, 0.0))
    >>> float(held[2, 2]), float(held[5, 5])
    (100000000.0, 0.0)
    """
    least = np.asarray(floor, dtype=np.float64)
    if least.shape != (6,) or np.any(least < 0.0):
        raise BearingError(f"regularisation: floor = {floor!r} must be six numbers, none negative")
    raised: Floats = stiffness + np.diag(np.maximum(least - np.diag(stiffness), 0.0))
    return raised


def proportional_damping(stiffness: Floats, time_constant: float) -> Floats:
    """Viscous damping ``beta K``.

    Parameters
    ----------
    stiffness : (6, 6) stiffness
    time_constant : beta, s. A mode of frequency f with all its strain energy here gets the damping ratio ``pi f beta``.

    Returns
    -------
    (6, 6)

    Examples
    --------
    >>> float(proportional_damping(1e9 * np.eye(6), 4e-6)[0, 0])
    4000.0
    """
    if time_constant < 0.0:
        raise BearingError(f"damping: time_constant = {time_constant} s must not be negative")
    return time_constant * stiffness


NOMINAL_LOAD = 0.1
"""Load over the basic dynamic rating at which a bearing's stiffness is taken where its load is not known yet."""
LEAST_LOAD = 0.01
"""Load over the basic dynamic rating below which a linear bearing counts as loaded by this: none has no stiffness."""
HOLDING_LOAD = 1.25
"""Axial load over the minimum that a row with a contact angle needs under a radial load, where neither is known."""
QUARTER_PITCH = 0.25
"""Place of a cage that stands still, in pitches past the load: the stiffness has its mean over the pitch there, to
the second harmonic."""


@dataclass(frozen=True)
class SupportLaw:
    """Law of one support, in the axes of what it sits on."""

    stiffness: Floats
    damping: Floats
    """(6, 6) linear part, N/m .. N m/rad, and times s."""
    rows: tuple[RollingRow, ...] = ()
    """Rows of rolling elements that act in addition; none for a linear support."""
    scale: float = 1.0
    """Displacement of the inner ring against the outer one over that of the body against what it sits on."""
    damping_time: float = 0.0
    """Damping over the stiffness of the rows, s."""
    cage_ratio: float = 0.0
    """Revolutions of the cage per revolution of the body relative to its support; 0 for a cage at standstill."""
    phase: float = 0.0
    """Polar angle of the first rolling element, rad."""
    point_strain: Floats = field(default_factory=lambda: np.zeros(6))
    point_load: Floats = field(default_factory=lambda: np.zeros(6))
    """(6,) displacement (m, rad) and load (N, N m) that the linear part passes; the origin by default."""


def load_stands_still(bearing: Bearing, bodies: Mapping[str, Body]) -> bool:
    """Return whether a bearing's load keeps its direction in the axes of the supporting body, given bodies by name.

    This holds on the ground, and for planets on their carrier.
    """
    return bearing.on not in bodies or bodies[bearing.on].fixed or bodies[bearing.body].carrier == bearing.on


def law_in_words(bearing: Bearing, stands_still: bool = True) -> str:
    """Say what a bearing's force follows; one whose load does not stand still knows but the axial part of its point.

    Examples
    --------
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> bearings = {bearing.family: bearing for bearing in Gearbox.from_toml("cases/grc750/gearbox.toml").bearings}
    >>> [law_in_words(bearings[name]) for name in ("plc_a", "pl_a")]
    ['linear, at a specified load, through the origin', 'linear, at the static load']
    """
    if bearing.catalogue is None:
        return "linear, specified stiffness"
    if bearing.model == "iso16281":
        return f"rolling elements to ISO/TS 16281, cage {bearing.cage}"
    if not is_catalogued(bearing):
        return "linear, at a specified load, through the origin"
    return f"linear, at the static load{'' if stands_still else ', across the axis through the origin'}"


def is_catalogued(bearing: Bearing) -> bool:
    """Return whether rows of rolling elements determine a bearing's stiffness at the load from statics."""
    return bearing.catalogue is not None and bearing.catalogue.radial_load_kN is None


def bearing_rows(bearing: Bearing) -> tuple[RollingRow, ...]:
    """Rows of rolling elements of a catalogue bearing.

    Raises
    ------
    BearingError
        It has no catalogue, or dimensions that are impossible.
    """
    if bearing.catalogue is None:
        raise BearingError(f"bearing {bearing.name}: has no catalogue data")
    return catalogue_rows(bearing.catalogue)


def misplaced_factor(bearing: Bearing) -> str:
    """Say why a housing factor cannot stand for the seat of a bearing; empty if it can.

    Examples
    --------
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> bearing = next(b for b in Gearbox.from_toml("cases/grc750/gearbox.toml").bearings if b.name == "hss_a")
    >>> misplaced_factor(bearing)
    ''
    """
    rows = () if bearing.catalogue is None else catalogue_rows(bearing.catalogue)
    if bearing.model == "iso16281" and bearing.factor != 1.0 and any(row.radial_clearance > 0.0 for row in rows):
        return (
            f'bearings.{bearing.family}: model = "iso16281" with clearance and the housing stiffness factor '
            f"{bearing.factor:g}: the factor cannot be applied, since a clearance closes without load; set "
            "housing_factor_applies = false, or use the variant flexible with a flexible housing"
        )
    return ""


def linear_law(bearing: Bearing, damping_time: float, of_rows: Floats | None = None) -> SupportLaw:
    """Return the linear model of a support, housing factor included.

    Parameters
    ----------
    damping_time : damping over stiffness where the file gives no damping, s
    of_rows : (6, 6)
        Stiffness of its rows of rolling elements; by default that at the load which the file states, or at
        `NOMINAL_LOAD`. Directions below the stiffness that the file gives in addition to a catalogue bearing are raised
        to it.

    Raises
    ------
    BearingError
        The catalogue dimensions or the load are impossible.
    """
    stiffness = connector_matrix(bearing.stiffness)
    if bearing.catalogue is not None:
        rows_stiffness = catalogue_stiffness(bearing.catalogue) if of_rows is None else of_rows
        stiffness = regularised(rows_stiffness, np.diag(stiffness))
    stiffness = bearing.factor * stiffness
    if bearing.damping is not None:
        return SupportLaw(stiffness, connector_matrix(bearing.damping))
    return SupportLaw(stiffness, proportional_damping(stiffness, damping_time))


def rolling_law(bearing: Bearing, damping_time: float, of_rows: Floats, direction: float) -> SupportLaw:
    """Law of a bearing's rows of rolling elements, and what the file adds in directions that they leave free.

    Parameters
    ----------
    bearing : one with catalogue dimensions
    damping_time : damping over stiffness where the file gives no damping, s
    of_rows : (6, 6) stiffness of the rows at their load: the file's stiffness adds what lacks there
    direction : polar angle of the load on the inner ring, rad: a cage that stands still is placed by it
    """
    rows = bearing_rows(bearing)
    if misplaced_factor(bearing):
        raise BearingError(misplaced_factor(bearing))
    stated = connector_matrix(bearing.stiffness)
    added = bearing.factor * (regularised(of_rows, np.diag(stated)) - of_rows)
    given = bearing.damping is not None
    damping = connector_matrix(bearing.damping) if given else proportional_damping(added, damping_time)
    turning = bearing.cage == "turning"
    return SupportLaw(
        stiffness=added,
        damping=damping,
        rows=rows,
        scale=bearing.factor * (-1.0 if bearing.carries_outer_ring else 1.0),
        damping_time=0.0 if given else damping_time,
        cage_ratio=cage_ratio(rows[0], bearing.carries_outer_ring) if turning else 0.0,
        phase=0.0 if turning else direction + QUARTER_PITCH * 2.0 * math.pi / rows[0].element_count,
    )


def law_through_point(law: SupportLaw, strain: Floats, load: Floats, stands_still: bool) -> SupportLaw:
    """Linear law that passes a point: its load (6,) at the displacement (6,) in the axes of what the bearing sits on.

    It resists no spin there. Of a load that turns in these axes only the part along the axis stays what it is: the law
    then passes the origin across the axis.
    """
    kept = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0] if stands_still else [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    return replace(law, point_strain=kept * strain, point_load=kept * load)


def cage_ratio(row: RollingRow, outer_ring_turns: bool) -> float:
    """Return the revolutions of a cage per revolution of one ring with the other ring fixed, without slip.

    Examples
    --------
    >>> from exugear.system.bearings.rolling.rows import BallRow
    >>> row = BallRow(element_diameter=0.02, pitch_diameter=0.1, element_count=10)
    >>> round(cage_ratio(row, False), 12), round(cage_ratio(row, True), 12)
    (0.4, 0.6)
    """
    return 0.5 * (1.0 + row.diameter_ratio if outer_ring_turns else 1.0 - row.diameter_ratio)


def with_laws(connectors: ConnectorArrays, laws: Sequence[SupportLaw]) -> ConnectorArrays:
    """Connectors at their places, with the laws of all supports."""
    return connectors._replace(
        stiffness=np.array([law.stiffness for law in laws]).reshape(-1, 6, 6),
        damping=np.array([law.damping for law in laws]).reshape(-1, 6, 6),
        point_strain=np.array([law.point_strain for law in laws]).reshape(-1, 6),
        point_load=np.array([law.point_load for law in laws]).reshape(-1, 6),
        rolling=rolling_arrays(
            [law.rows for law in laws],
            scale=[law.scale for law in laws],
            time=[law.damping_time for law in laws],
            cage_ratio=[law.cage_ratio for law in laws],
            phase=[law.phase for law in laws],
        ),
    )


@lru_cache(maxsize=64)
def catalogue_stiffness(section: CatalogueSection) -> Floats:
    """Stiffness (6, 6) of rows at the load that the file states, else a nominal one; the same in all directions.

    Raises
    ------
    BearingError
        The catalogue dimensions or the load are impossible.
    """
    rows = catalogue_rows(section)
    if section.radial_load_kN is not None:
        force = (si(section, "radial_load_kN"), 0.0, optional_si(section, "axial_load_kN") or 0.0)
    else:
        force = holding_force(rows, NOMINAL_LOAD * basic_dynamic_rating(rows, section.type))
    return axially_symmetric(pitch_averaged_tangent(BearingOfRows(rows), force))


def holds_one_way(rows: Sequence[RollingRow]) -> bool:
    """Return whether rows locate the inner ring in one axial direction only."""
    angles = [row.contact_angle for row in rows]
    return min(angles) > 0.0 or max(angles) < 0.0


def holding_force(rows: Sequence[RollingRow], radial: float, direction: float = 0.0) -> tuple[float, float, float]:
    """Force (N) on the inner ring with a radial part along a polar angle (rad), and the axial one that it needs.

    Rows of one contact angle are pushed apart by a radial load alone.
    """
    axial = HOLDING_LOAD * radial * math.tan(rows[0].contact_angle) if holds_one_way(rows) else 0.0
    return radial * math.cos(direction), radial * math.sin(direction), axial


# Equal planets: bearings of a planet set get the mean of their laws, each seen along its own radius

FEWEST = 3
"""Planets that a set needs: fewer do not average out what their turning does to the others."""
SPACING = 1e-6
"""Largest departure of planets from equal spacing, rad."""


def planet_families(bodies: Iterable[Body]) -> list[list[Body]]:
    """Find the sets of planets: those of one family on one carrier that turns.

    They are in the order of their angles from the first one on, whichever order the gearbox file lists them in: waves
    around the carrier, such as the alternating one, count from planet to planet.
    """
    families: dict[tuple[str, str], list[Body]] = {}
    for body in bodies:
        if body.carrier is not None:
            families.setdefault((body.carrier, body.family), []).append(body)
    return [sorted(planets, key=lambda planet: _behind(planets[0], planet)) for planets in families.values()]


def _behind(first: Body, planet: Body) -> float:
    """Angle from one planet to another in the sense of rotation, 0 to 2 pi."""
    return (planet.orbit_angle - first.orbit_angle) % (2.0 * math.pi)


def equally_spaced(planets: Sequence[Body]) -> bool:
    """Return whether three or more planets of a set are at equal distances around their carrier."""
    spacing = 2.0 * math.pi / len(planets)
    turned = np.array([_behind(planets[0], planet) for planet in planets])
    return len(planets) >= FEWEST and bool(np.abs(turned - spacing * np.arange(len(planets))).max() <= SPACING)


class PlanetSupports(NamedTuple):
    """Supports of one family, one of each planet of a set."""

    numbers: Integers
    """(N,) among all supports, in the order of the planets."""
    angles: Floats
    """(N,) of the planets in the carrier's axes, rad."""


def planet_supports(supports: Sequence[Bearing], planets: Sequence[str], angles: Floats) -> list[PlanetSupports]:
    """Families of supports that each planet (names) of a set has one of; angles (N,) of the planets, rad."""
    found = []
    for family in sorted({support.family for support in supports if support.body in planets}):
        numbers = [
            n
            for name in planets
            for n, support in enumerate(supports)
            if support.body == name and support.family == family
        ]
        if len(numbers) == len(planets):
            found.append(PlanetSupports(np.array(numbers, dtype=np.int64), angles))
    return found


def with_equal_planets(connectors: ConnectorArrays, sets: Iterable[PlanetSupports]) -> tuple[ConnectorArrays, float]:
    """Connectors whose planets are equal, and the largest change of stiffness that this took, over it.

    Notes
    -----
    Cages that turn stay where they are.
    """
    stiffness, damping, phase = (
        values.copy() for values in (connectors.stiffness, connectors.damping, connectors.rolling.phase)
    )
    strain = connectors.point_strain.copy()
    load = connectors.point_load.copy()
    with_rows = np.diff(connectors.rolling.first) > 0
    largest = 0.0
    for members, angles in sets:
        if with_rows[members].all() and not connectors.rolling.cage_ratio[members].any():
            away = phase[members] - angles
            # Mean on the circle, on which these angles are near each other.
            phase[members] = angles + math.atan2(float(np.sin(away).mean()), float(np.cos(away).mean()))
        turns = np.array([_turn(angle) for angle in angles])
        back = turns.transpose(0, 2, 1)
        largest = max(largest, _spread(back @ stiffness[members] @ turns))
        for matrices in (stiffness, damping):
            matrices[members] = turns @ (back @ matrices[members] @ turns).mean(axis=0) @ back
        for vectors in (strain, load):
            mean = np.einsum("nij,nj->ni", back, vectors[members]).mean(axis=0)
            vectors[members] = turns @ mean
    rolling = connectors.rolling._replace(phase=phase)
    equal = connectors._replace(
        stiffness=stiffness, damping=damping, point_strain=strain, point_load=load, rolling=rolling
    )
    if largest or with_rows.any():
        return (equal, largest)
    return (connectors, 0.0)


def _spread(matrices: Floats) -> float:
    """Largest difference of the displacements' stiffness (n, 6, 6) from its mean, over it."""
    mean = matrices.mean(axis=0)
    size = np.sqrt(np.abs(np.diag(mean)).clip(min=1e-9 * np.abs(mean).max(initial=0.0) + 1e-300))
    return float(np.abs((matrices - mean) / np.outer(size, size))[:, :3, :3].max())


def _turn(angle: float) -> Floats:
    """Matrix (6, 6) that turns displacements and tilts about z by an angle (rad)."""
    c = math.cos(angle)
    s = math.sin(angle)
    turn = np.eye(6)
    turn[:2, :2] = turn[3:5, 3:5] = [[c, -s], [s, c]]
    return turn


# Active supports of a variant


def unsupported(gearbox: Gearbox, variant: str) -> str:
    """Say what a variant lacks that its bodies are held by; empty if nothing.

    Off bearings every body needs its joint: without one it would not turn on a fixed axis.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> unsupported(gearbox, "bushing"), unsupported(gearbox.varied({"bearings": {}}), "bushing")
    ('', 'the gearbox file has no [bearings]')
    """
    chosen = Variant.of(variant)
    elastic = elastic_names(gearbox)
    if not chosen.has_bearings:
        held = {*gearbox.apart, *(joint.body for joint in gearbox.joints)}
        missing = [b.name for b in gearbox.bodies() if not (b.fixed or b.spin_only or b.name in held)]
        if missing:
            return f"no joint supports {', '.join(missing)}; add one in [joints]"
        coupled = [bearing.name for bearing in gearbox.bearings if bearing.family in gearbox.case.couplings]
        if coupled:
            return (
                f"couplings.{coupled[0]} connects a rotating body to a fixed one, which this variant cannot model; "
                "use the variant bushing"
            )
        sprung = list(gearbox.held_by_torsion)
        if sprung:
            return (
                f"{', '.join(sprung)}: rotation constrained by the torsion of a bearing or mount, which this variant "
                f"cannot model; use the variant bushing, or set bodies.{sprung[0]}.fixed = true"
            )
        return ""
    if gearbox.unknown_bearings:
        names = ", ".join(f"bearings.{name} ({text})" for name, text in gearbox.unknown_bearings.items())
        return f"only the designation is known of {names}; add a [.catalogue] or a [.stiffness] table to each"
    if not gearbox.bearings:
        return "the gearbox file has no [bearings]"
    if chosen.is_elastic and not elastic:
        return 'no flexible body is defined; add [bodies.NAME.shape] and set flexibility = "elastic"'
    mounted = {mount.body for mount in mounts_at_work(gearbox)}
    for body in gearbox.bodies():
        if chosen.is_elastic and body.fixed and body.name in elastic and body.name not in mounted:
            return f"body {body.name} is flexible, but nothing supports it; add [mounts] on the ground"
    return ""


def elastic_names(gearbox: Gearbox) -> tuple[str, ...]:
    """Names of the bodies that are elastic in variants that have such."""
    return tuple(body.name for body in gearbox.bodies() if gearbox.case.bodies[body.family].flexibility != "none")


def mounts_at_work(gearbox: Gearbox, with_elastic: bool = True) -> tuple[Bearing, ...]:
    """Mounts that hold the gearbox where a fixed body is elastic, and those of what belongs to no train.

    A fixed body that is rigid is the ground itself, and so needs no mount; a pedestal between a bearing and the ground
    needs it in every variant.

    Parameters
    ----------
    with_elastic : whether elastic bodies are so, as in the variant `flexible`
    """
    elastic = elastic_names(gearbox)
    bodies = {body.name: body for body in gearbox.bodies()}
    if not with_elastic or not any(bodies[name].fixed for name in elastic):
        return tuple(mount for mount in gearbox.mounts if mount.body in gearbox.apart)
    return tuple(mount for mount in gearbox.mounts if mount.body in elastic or not bodies[mount.body].fixed)
