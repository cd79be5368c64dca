"""Operating results of bearings: load, stiffness, misalignment, contact pressure and life at the operating point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.parts import Bearing
from exugear.gearbox.sections.connections import CatalogueSection
from exugear.gearbox.units import KN
from exugear.system.bearings import stiffness as matrices
from exugear.system.bearings.rolling.catalogue import (
    KnownRating,
    catalogue_rows,
    estimates,
    known_rating,
    margins,
    other_design,
    with_estimate,
)
from exugear.system.bearings.rolling.contact import (
    BearingState,
    bearing_load,
    bearing_state,
    element_loads,
    equilibrium,
    is_preloaded,
    pitch_averaged_tangent,
    row_contacts,
    tangent_stiffness,
)
from exugear.system.bearings.rolling.life import basic_rating_life, minimum_load, reference_life
from exugear.system.bearings.rolling.ratings import (
    basic_dynamic_rating,
    basic_static_rating,
    equivalent_load,
    equivalent_static_load,
)
from exugear.system.bearings.rolling.rows import BearingError, BearingOfRows, RollingRow, is_rib
from exugear.system.bearings.stiffness import LEAST_LOAD, holding_force, holds_one_way, law_in_words
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin

CAGE_POSITIONS = 4
"""Positions of the cage within one pitch over which the stiffness is averaged: a linear bearing knows no cage."""


@dataclass(frozen=True)
class OperatingPoint(ReprMixin):
    """A catalogue bearing under the static load of its gearbox."""

    bearing: Bearing
    rows: tuple[RollingRow, ...]
    displacement: Floats
    """(6,) inner ring relative to outer ring, m and rad, in the axes of what the bearing sits on."""
    load: Floats
    """(6,) force and moment of the shaft on the inner ring that the rows carry, N and N m."""
    stiffness: Floats
    """(6, 6) derivative of that load, mean over positions of the cage."""
    is_unloaded: bool
    """Whether its load is so small that the stiffness is taken at the minimum load."""
    first_roller_angle: float = 0.0
    """Polar angle of the first rolling element at which the displacement holds the load, rad."""
    load_stands_still: bool = True
    """Whether the load keeps its direction in these axes."""

    def _line(self) -> str:
        radial = 1e-3 * self.radial_load
        axial = 1e-3 * float(self.load[2])
        return f" of {self.bearing.name!r}: {radial:.4g} kN radially, {axial:.4g} kN axially"

    @property
    def radial_load(self) -> float:
        """Radial load, N."""
        return math.hypot(self.load[0], self.load[1])

    @property
    def direction(self) -> float:
        """Polar angle of the radial load on the inner ring, rad."""
        return math.atan2(self.load[1], self.load[0])

    @property
    def radial_stiffness(self) -> float:
        """Stiffness along the radial load with all other coordinates held, N/m."""
        along = np.array([math.cos(self.direction), math.sin(self.direction)])
        return float(along @ self.stiffness[:2, :2] @ along)

    @property
    def preload(self) -> float:
        """Half the sum of the loads of the rolling elements (N) if they carry load before the bearing does, else zero.

        Up to 30 % of it, in any direction, the tangent gives displacements within 3 % of the rows'.
        """
        if not is_preloaded(self.rows):
            return 0.0
        contacts = row_contacts(self.rows, self.first_roller_angle)
        return 0.5 * float(element_loads(contacts, self.displacement).sum())

    @property
    def misalignment(self) -> float:
        """Tilt of the inner ring against the outer one, rad."""
        return math.hypot(self.displacement[3], self.displacement[4])


def cage_angles(rows: Sequence[RollingRow], first_roller_angle: float) -> list[float]:
    """Polar angles (rad) of the first rolling element over one pitch, from a given one on."""
    step = 2.0 * math.pi / (rows[0].element_count * CAGE_POSITIONS)
    return [first_roller_angle + step * position for position in range(CAGE_POSITIONS)]


def operating_point(
    bearing: Bearing, displacement: Floats, load_stands_still: bool, first_roller_angle: float = 0.0
) -> OperatingPoint:
    """Find what a bearing carries at a displacement of its rings, and its stiffness there.

    Parameters
    ----------
    bearing : one with catalogue dimensions
    displacement : (6,) inner ring relative to outer ring, m and rad, in the axes of what the bearing sits on
    load_stands_still
        Whether the load keeps its direction in these axes; else the stiffness is the same in all directions.
    first_roller_angle : polar angle of the first rolling element at which the displacement holds the load, rad

    Notes
    -----
    The tangent holds the load's direction apart from the one across it: with clearance, fewer rolling elements resist a
    motion across the load. A bearing without preload that carries less than `LEAST_LOAD` of its rating gets the
    stiffness at that load.
    """
    assert bearing.catalogue is not None
    rows = catalogue_rows(bearing.catalogue)
    load = bearing_load(row_contacts(rows, first_roller_angle), displacement)
    stiffness = np.zeros((6, 6))
    for angle in cage_angles(rows, first_roller_angle):
        contacts = row_contacts(rows, angle)
        stiffness += tangent_stiffness(contacts, displacement) / CAGE_POSITIONS
    least = LEAST_LOAD * basic_dynamic_rating(rows, bearing.catalogue.type)
    is_unloaded = not is_preloaded(rows) and float(np.linalg.norm(load[:3])) < least
    if is_unloaded:
        stiffness = pitch_averaged_tangent(BearingOfRows(rows), holding_force(rows, least))
    if is_unloaded or not load_stands_still:
        stiffness = matrices.axially_symmetric(stiffness)
    return OperatingPoint(
        bearing, rows, displacement, load, stiffness, is_unloaded, first_roller_angle, load_stands_still
    )


INSIDE = ("element_diameter_mm", "element_count", "element_length_mm")
"""Estimates that ratings rest on."""
STATED_FACTOR = 3.0
"""Factor between a stated radial load and the reaction beyond which a remark says so: stiffness goes with the tenth to
the third power of the load."""


@dataclass(frozen=True)
class LoadRatings:
    """Load ratings of a bearing, N."""

    dynamic: float
    static: float
    estimated: bool
    """Whether they follow from the internal geometry of the bearing, according to ISO 281 and ISO 76."""
    makers: tuple[str, ...] = ()
    """Manufacturers whose catalogues were compared for the minimum; empty if the rating is from another source."""
    two_designs: str = ""
    """Which of two designs of the designation is used, where manufacturers list both; empty elsewhere."""


@dataclass(frozen=True)
class Sensitivity:
    """Radial stiffness (N/m) at both ends of what an estimated dimension may be, under the same load."""

    key: str
    """Key of the file that would replace the estimate."""
    value: float
    low: float
    high: float
    """Estimate and its range, in the unit of the key."""
    at_low: float
    at_high: float
    """Radial stiffness there, N/m; NaN where such a bearing cannot be built."""


@dataclass(frozen=True)
class BearingLoadState:
    """Operating results of a catalogue bearing."""

    name: str
    family: str
    kind: str
    model: str
    """Its name, that of its section, the type of bearing, and what its force follows."""
    radial_load: float
    axial_load: float
    """Of the shaft on the inner ring, what its rows carry, N."""
    reaction: float | None
    """Radial load that the statics find, N, where the loads before are those that the file states."""
    stiffness: Floats
    """(6, 6) of the rows, mean over positions of the cage, N/m .. N m/rad."""
    radial_stiffness: float
    """Along the load, N/m."""
    misalignment: float
    """Tilt of the inner ring against the outer one, rad."""
    element_load: float
    pressure: float
    """Load (N) and contact pressure at the inner ring (Pa) of the most loaded rolling element."""
    ratings: LoadRatings
    basic_life: float
    reference_life: float
    """L10 to ISO 281 and L10r to ISO/TS 16281 (basic: lubricant and cleanliness neglected), million revolutions;
    infinite without load."""
    remarks: tuple[str, ...]
    """What a reader should know before trusting the row."""


def ratings_of(section: CatalogueSection) -> LoadRatings:
    """Load ratings of catalogue bearings: from the file, the minimum of manufacturers' catalogues, or to ISO.

    Ratings to ISO 281 and ISO 76 follow from the internal geometry of the bearing. Where that is estimated, they are
    divided by the factor by which estimates may exceed catalogue values, so that the rating is conservative.
    """
    rows = catalogue_rows(section)
    given = (section.dynamic_rating_kN, section.static_rating_kN)
    computed = basic_dynamic_rating(rows, section.type), basic_static_rating(rows, section.type)
    known = known_rating(section)
    if known is not None:
        both = 1.0 if section.arrangement == "single" else 2.0
        computed = known.dynamic * both ** (7.0 / 9.0 if section.type.endswith("_roller") else 0.7), known.static * both
    elif any(estimate.key in INSIDE for estimate in estimates(section)):
        dynamic_margin, static_margin = margins(section)
        computed = computed[0] / dynamic_margin, computed[1] / static_margin
    dynamic, static = (
        rating if stated is None else KN * stated for rating, stated in zip(computed, given, strict=True)
    )
    if None not in given:
        return LoadRatings(dynamic, static, estimated=False)
    if known is None:
        return LoadRatings(dynamic, static, estimated=True)
    designs = _two_designs(section, known) * (section.dynamic_rating_kN is None)
    return LoadRatings(dynamic, static, estimated=False, makers=known.makers, two_designs=designs)


def _two_designs(section: CatalogueSection, taken: KnownRating) -> str:
    """Return a note if manufacturers list a reinforced design, too, and which is used; empty otherwise."""
    other = other_design(section)
    if other is None:
        return ""
    name, rating = other
    return (
        f"manufacturers list two designs of {section.designation}: C_r = {1e-3 * taken.dynamic:g} kN ("
        f"{', '.join(taken.makers)}) is used; the reinforced design {name} has {1e-3 * rating.dynamic:g} kN ("
        f"{', '.join(rating.makers)}); set that designation, or dynamic_rating_kN, to use it"
    )


def duty_of(point: OperatingPoint, reaction: Floats | None = None, *, is_opposed: bool = False) -> BearingLoadState:
    """Find what a bearing bears at its operating point.

    Parameters
    ----------
    reaction : (6,) for a bearing whose load the file states: what the statics find, N and N m
    is_opposed : whether another bearing of its body locates against the axial load that it cannot carry
    """
    bearing = point.bearing
    rows = point.rows
    section = point.bearing.catalogue
    assert section is not None
    ratings = ratings_of(section)
    states = [
        bearing_state(row_contacts(rows, angle), point.displacement)
        for angle in cage_angles(rows, point.first_roller_angle)
    ]
    radial = point.radial_load
    axial = float(point.load[2])
    equivalent = equivalent_load(rows, section.type, radial, abs(axial), ratings.static)
    return BearingLoadState(
        name=bearing.name,
        family=bearing.family,
        kind=section.type,
        model=law_in_words(bearing, point.load_stands_still),
        radial_load=radial,
        axial_load=axial,
        stiffness=point.stiffness,
        radial_stiffness=point.radial_stiffness,
        misalignment=point.misalignment,
        element_load=max(_largest_load(state) for state in states),
        pressure=max(float(state.element_pressure.max()) for state in states),
        ratings=ratings,
        basic_life=basic_rating_life(ratings.dynamic, equivalent, section.type),
        reference_life=reference_life(
            rows,
            [np.concatenate(loads) for loads in zip(*map(loads_of_rows, states), strict=True)],
            section.type,
            dynamic_rating=ratings.dynamic,
            inner_ring_turns_against_load=not bearing.carries_outer_ring,
        ),
        reaction=None if reaction is None else math.hypot(reaction[0], reaction[1]),
        remarks=tuple(_remarks(point, ratings, reaction, is_opposed)),
    )


def loads_of_rows(state: BearingState) -> list[Floats]:
    """Give the loads of each row as its life needs them, N: (elements, laminae) of rollers, (elements,) of balls."""
    first = state.contacts.first
    return [
        state.element_load[begin:end] if laminae is None else laminae
        for laminae, begin, end in zip(state.lamina_load, first[:-1], first[1:], strict=True)
    ]


def _largest_load(state: BearingState) -> float:
    """Load of the most loaded element on its raceways, N."""
    first = state.contacts.first
    of_rows = zip(state.contacts.rows, first[:-1], first[1:], strict=True)
    return max(float(state.element_load[begin:end].max()) for row, begin, end in of_rows if not is_rib(row))


def _remarks(point: OperatingPoint, ratings: LoadRatings, reaction: Floats | None, is_opposed: bool) -> list[str]:
    section = point.bearing.catalogue
    rows = point.rows
    assert section is not None
    remarks = []
    if point.is_unloaded:
        remarks.append("is almost unloaded: stiffness computed at 1 % of its dynamic rating")
    elif not is_preloaded(rows) and math.hypot(point.radial_load, float(point.load[2])) < minimum_load(
        ratings.dynamic, section.type
    ):
        remarks.append("load below the usual minimum load: rolling elements may slide")
    if reaction is not None:
        found = math.hypot(reaction[0], reaction[1])
        if max(found, point.radial_load) > STATED_FACTOR * min(found, point.radial_load):
            remarks.append(
                f"radial_load_kN = {1e-3 * point.radial_load:.4g} is specified; the static load results in "
                f"{1e-3 * found:.4g}"
            )
    if holds_one_way(rows) and not is_opposed:
        sense, other = ("+z", "-z") if rows[0].contact_angle > 0.0 else ("-z", "+z")
        remarks.append(
            f"locates its inner ring axially in one direction only, against a load towards {sense}; no other bearing "
            f"of its body carries a load towards {other}"
        )
    static = equivalent_static_load(rows, section.type, point.radial_load, abs(float(point.load[2])))
    if static > ratings.static:
        estimated = " estimated" if ratings.estimated else ""
        remarks.append(
            f"equivalent static load {1e-3 * static:.4g} kN exceeds its{estimated} static rating "
            f"{1e-3 * ratings.static:.4g} kN"
        )
    return remarks


def estimate_effects(point: OperatingPoint) -> tuple[Sensitivity, ...]:
    """Return the radial stiffness at both limits of each dimension missing in the file, at an operating point.

    The change is evaluated at one position of the cage.
    """
    section = point.bearing.catalogue
    assert section is not None
    share = point.radial_stiffness / _radial_stiffness(section, point)
    effects = []
    for estimate in estimates(section):
        limits = (estimate.low, estimate.high)
        ends = [share * _radial_stiffness(with_estimate(section, estimate, limit), point) for limit in limits]
        effects.append(Sensitivity(estimate.key, estimate.value, *limits, *ends))
    return tuple(effects)


def _radial_stiffness(section: CatalogueSection, point: OperatingPoint) -> float:
    force = point.load[:3]
    tilt = point.displacement[3:5]
    if point.is_unloaded:
        least = LEAST_LOAD * basic_dynamic_rating(point.rows, section.type)
        force = np.array(holding_force(point.rows, least, point.direction))
        tilt = np.zeros(2)
    try:
        rows = catalogue_rows(section)
        displacement = equilibrium(BearingOfRows(rows), force, tilt=tilt).displacement
    except BearingError:
        return float("nan")
    along = np.array([np.cos(point.direction), np.sin(point.direction)])
    return float(along @ tangent_stiffness(row_contacts(rows), displacement)[:2, :2] @ along)
