"""Laws of supports: stiffness and damping as matrices, or rows of rolling elements with a law of their own.

A bearing with `law = "stiffness"` is linear: given matrices through the origin, or the tangent of its rows through the
point that they are in under the static load. One with `law = "iso16281"` keeps its rows. The housing factor f stands
for the seat: it gives way in proportion to the bearing, so that the bearing takes the share f of a deflection under any
load. A linear bearing is then f times as stiff, and the rows of a non-linear one see f times the deflection: both agree
in the limit of small motions, and forces keep a potential. A clearance closes without load, which no share of a
deflection does: such rows want an elastic housing or no factor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from exugear.gearbox.parts import Bearing, Body, stiffness_matrix
from exugear.gearbox.sections.connections import CatalogueSection
from exugear.system.bearings import matrices
from exugear.system.bearings.kernels.connectors import ConnectorArrays
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.contact import pitch_averaged_tangent
from exugear.system.bearings.rolling.potential import rolling_arrays
from exugear.system.bearings.rolling.ratings import basic_dynamic_rating
from exugear.system.bearings.rolling.rows import BearingError, BearingOfRows, RollingRow
from fe_ste.tools.arrays import Floats

NOMINAL_LOAD = 0.1
"""Load over the basic dynamic rating at which a bearing's stiffness is taken where its load is not known yet."""
LEAST_LOAD = 0.01
"""Load over the basic dynamic rating below which a linear bearing counts as loaded by this: none has no stiffness."""
HOLDING_LOAD = 1.25
"""Axial load over the least that one row with a contact angle needs beside a radial one, where neither is known."""
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
    """Rows of rolling elements that act beside it; none for a linear support."""
    scale: float = 1.0
    """Displacement of the inner ring against the outer one over that of the body against what it sits on."""
    damping_time: float = 0.0
    """Damping over the stiffness of the rows, s."""
    cage_ratio: float = 0.0
    """Turns of the cage per turn of the body against what it sits on; 0 for a cage that stands still."""
    phase: float = 0.0
    """Polar angle of the first rolling element, rad."""
    point_strain: Floats = field(default_factory=lambda: np.zeros(6))
    point_load: Floats = field(default_factory=lambda: np.zeros(6))
    """(6,) displacement (m, rad) and load (N, N m) that the linear part passes; the origin by default."""


def load_stands_still(bearing: Bearing, bodies: Mapping[str, Body]) -> bool:
    """Tell whether a bearing's load keeps its direction in the axes of what it sits on, of bodies by their names.

    So it does on the ground, and where planets sit on their carrier.
    """
    return bearing.on not in bodies or bodies[bearing.on].fixed or bodies[bearing.body].carrier == bearing.on


def law_in_words(bearing: Bearing, stands_still: bool = True) -> str:
    """Say what a bearing's force follows; one whose load does not stand still knows but the axial part of its point.

    Examples
    --------
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> bearings = {bearing.family: bearing for bearing in Gearbox.from_toml("cases/grc750/gearbox.toml").bearings}
    >>> [law_in_words(bearings[name]) for name in ("plc_a", "pl_a")]
    ['linear, at a stated load, through the origin', 'linear, at the static load']
    """
    if bearing.catalogue is None:
        return "linear, stiffness given"
    if bearing.law == "iso16281":
        return f"rows by ISO/TS 16281, cage {bearing.cage}"
    if not is_catalogued(bearing):
        return "linear, at a stated load, through the origin"
    return f"linear, at the static load{'' if stands_still else ', across the axis through the origin'}"


def is_catalogued(bearing: Bearing) -> bool:
    """Tell whether rows of rolling elements give a bearing's stiffness at the load that the statics find."""
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
    if bearing.law == "iso16281" and bearing.factor != 1.0 and any(row.radial_clearance > 0.0 for row in rows):
        return (
            f'bearings.{bearing.family}: law = "iso16281" with clearance and the housing factor {bearing.factor:g}: '
            "a clearance closes without load, so the factor does not apply; set housing_factor_applies = false, or "
            "use the variant flexible with an elastic housing"
        )
    return ""


def linear_law(bearing: Bearing, damping_time: float, of_rows: Floats | None = None) -> SupportLaw:
    """Linear law of a support, housing factor included.

    Parameters
    ----------
    damping_time : damping over stiffness where the file gives no damping, s
    of_rows : (6, 6)
        Stiffness of its rows of rolling elements; by default that at the load which the file states, or at
        `NOMINAL_LOAD`. Directions below the stiffness that the file gives beside a catalogue are raised to it.

    Raises
    ------
    BearingError
        The catalogue dimensions or the load are impossible.
    """
    stiffness = stiffness_matrix(bearing.stiffness)
    if bearing.catalogue is not None:
        rows_stiffness = catalogue_stiffness(bearing.catalogue) if of_rows is None else of_rows
        stiffness = matrices.regularised(rows_stiffness, np.diag(stiffness))
    stiffness = bearing.factor * stiffness
    if bearing.damping is not None:
        return SupportLaw(stiffness, stiffness_matrix(bearing.damping))
    return SupportLaw(stiffness, matrices.proportional_damping(stiffness, damping_time))


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
    stated = stiffness_matrix(bearing.stiffness)
    added = bearing.factor * (matrices.regularised(of_rows, np.diag(stated)) - of_rows)
    given = bearing.damping is not None
    damping = stiffness_matrix(bearing.damping) if given else matrices.proportional_damping(added, damping_time)
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


def through_point(law: SupportLaw, strain: Floats, load: Floats, stands_still: bool) -> SupportLaw:
    """Linear law that passes a point: its load (6,) at the displacement (6,) in the axes of what the bearing sits on.

    It resists no spin there. Of a load that turns in these axes only the part along the axis stays what it is: the law
    then passes the origin across the axis.
    """
    kept = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0] if stands_still else [0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    return replace(law, point_strain=kept * strain, point_load=kept * load)


def cage_ratio(row: RollingRow, outer_ring_turns: bool) -> float:
    """Find the turns of a cage per turn of one ring while the other one stands still, without slip.

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
        force = (1e3 * section.radial_load_kN, 0.0, 1e3 * (section.axial_load_kN or 0.0))
    else:
        force = holding_force(rows, NOMINAL_LOAD * basic_dynamic_rating(rows, section.type))
    return matrices.axially_symmetric(pitch_averaged_tangent(BearingOfRows(rows), force))


def holds_one_way(rows: Sequence[RollingRow]) -> bool:
    """Tell whether rows hold the inner ring in one direction along the axis only."""
    angles = [row.contact_angle for row in rows]
    return min(angles) > 0.0 or max(angles) < 0.0


def holding_force(rows: Sequence[RollingRow], radial: float, direction: float = 0.0) -> tuple[float, float, float]:
    """Force (N) on the inner ring with a radial part along a polar angle (rad), and the axial one that it needs.

    Rows of one contact angle are pushed apart by a radial load alone.
    """
    axial = HOLDING_LOAD * radial * math.tan(rows[0].contact_angle) if holds_one_way(rows) else 0.0
    return radial * math.cos(direction), radial * math.sin(direction), axial
