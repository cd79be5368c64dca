"""Life of rolling bearings under a load duration distribution: L10 of ISO 281, L10r of ISO/TS 16281, static safety.

Both are basic rating lives; L10m of ISO 281 includes lubricant and cleanliness if the gearbox file has them. Ribs and
cages are neglected. Loads are those of the static balance; the revolutions at each load are shared equally among the
angles of the carrier.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from exugear.gearbox.parts import Bearing
from exugear.gearbox.sections.loads import LubricantSection
from exugear.gearbox.units import KN
from exugear.life.static_balance import ActingLoads, StaticBalance
from exugear.system.bearings.duty import LoadRatings, cage_angles, loads_of_rows, ratings_of
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.contact import BearingState, equilibrium
from exugear.system.bearings.rolling.life import (
    LEAST_RATIO,
    basic_rating_life,
    contamination_factor,
    fatigue_limit,
    life_factor,
    minimum_load,
    reference_life,
    viscosity_at,
    viscosity_ratio,
)
from exugear.system.bearings.rolling.ratings import equivalent_load, equivalent_static_load
from exugear.system.bearings.rolling.rows import (
    BearingError,
    BearingOfRows,
    RollerRow,
    RollingRow,
    raceway_rows,
)
from fe_ste.tools.arrays import Floats

LAMINAE = 40
"""Number of roller laminae for the roller loads; 60 change the life by 0.1 %."""
UNLOADED = 1e-9
"""Load over static load rating below which a load is round-off."""
LOAD_SHARES = (0.15, 0.3, 0.5, 0.7, 0.85, 1.0)
"""Fractions of the largest load at which roller loads are solved; lives are interpolated linearly in logarithms."""


@dataclass(frozen=True)
class BearingLife:
    """Loads, damages and lives of a bearing over the life of the gearbox."""

    name: str
    revolutions: float
    """Relative revolutions of its rings in the life."""
    largest_load: float
    """Largest radial load, N, including extreme loads with their partial factors."""
    equivalent: float
    """Constant equivalent load with the same damage to ISO 281, N."""
    damage: float
    basic_hours: float
    """Miner's sum, and hours of operation until it is one, by L10."""
    reference_damage: float
    reference_hours: float
    """The same by L10r; NaN if no equilibrium of the rollers was found."""
    modified_damage: float
    modified_hours: float
    """The same by L10m, with a_ISO at each load and speed; NaN without oil data."""
    viscosity_ratio: float
    """Minimum kappa over all speeds under load; NaN without oil data."""
    minimum_load: float
    """Minimum required radial load, below which rolling elements may slide, N."""
    pressure: float
    """Maximum contact stress of rolling elements under the largest load, Pa; NaN as for L10r."""
    static_safety: float
    """C_0r over the largest static equivalent load."""
    ratings: LoadRatings
    remarks: tuple[str, ...]
    by_bin: Floats
    reference_by_bin: Floats
    modified_by_bin: Floats
    """(bins,) parts of the damages by torque bin, by L10, L10r and L10m."""


def bearing_lives(
    supports: tuple[Bearing, ...],
    turns: Mapping[str, float],
    acting: ActingLoads,
    balance: StaticBalance,
    oil: LubricantSection | None = None,
) -> tuple[BearingLife, ...]:
    """Rate all rotating bearings that have catalogue data.

    Parameters
    ----------
    supports : in the order of the balance
    turns : by bearing name, revolutions per revolution of the loaded body
    """
    lives = []
    for number, support in enumerate(supports):
        if support.catalogue is None or not turns.get(support.name, 0.0):
            continue
        case = _RatedBearing(support, acting, balance, number, oil)
        lives.append(case.life(turns[support.name]))
    return tuple(lives)


@dataclass(frozen=True)
class _RatedBearing:
    """One bearing with its index in the balance."""

    support: Bearing
    acting: ActingLoads
    balance: StaticBalance
    number: int
    oil: LubricantSection | None

    def life(self, turns: float) -> BearingLife:
        points, carried = self.acting.points, self.balance.bearing_load.of(self.number)
        loads = self.balance.at(carried, points.torque, points.other)
        worst = np.concatenate([self.balance.at(carried, *self.acting.worst(sense)) for sense in (1, -1)])
        section = self.support.catalogue
        assert section is not None
        rows = tuple(
            replace(row, laminae=LAMINAE) if isinstance(row, RollerRow) else row
            for row in raceway_rows(catalogue_rows(section))
        )
        ratings = ratings_of(section)
        if max(np.abs(forces[..., :3]).max() for forces in (loads, worst)) < UNLOADED * ratings.static:
            loads, worst = np.zeros_like(loads), np.zeros_like(worst)
        revolutions = points.revolutions * turns
        share = revolutions[:, None] / loads.shape[1]
        radial = np.hypot(loads[..., 0], loads[..., 1])
        equivalents = np.vectorize(
            lambda side, axial: equivalent_load(rows, section.type, side, abs(axial), ratings.static)
        )(radial, loads[..., 2])
        basic = np.vectorize(lambda load: basic_rating_life(ratings.dynamic, load, section.type))(equivalents)
        by_bin = np.sum(share / (1e6 * basic), axis=1)
        factor, ratio = self._life_factor(rows, ratings, equivalents, points.speed * turns)
        by_modified = np.sum(share / (1e6 * basic * factor), axis=1)
        modified = float(by_modified.sum())
        damage = float(by_bin.sum())
        lives, pressure, remarks = self._reference(rows, ratings, loads, revolutions, worst)
        by_reference = np.full(len(by_bin), math.nan)
        if lives is not None:
            by_reference = np.sum(share / (1e6 * _interpolated(lives, radial)), axis=1)
        reference = float(by_reference.sum())
        static = max(
            equivalent_static_load(rows, section.type, math.hypot(load[0], load[1]), abs(load[2]))
            for load in worst.reshape(-1, 6)
        )
        largest = float(np.hypot(worst[..., 0], worst[..., 1]).max())
        least = minimum_load(ratings.dynamic, section.type)
        remarks += self._remarks(ratings, ratio, largest, least)
        exponent = 10.0 / 3.0 if section.type.endswith("_roller") else 3.0
        total, hours = float(revolutions.sum()), float(points.hours.sum())
        return BearingLife(
            name=self.support.name,
            revolutions=total,
            largest_load=largest,
            equivalent=ratings.dynamic * (1e6 * damage / total) ** (1.0 / exponent) if total else 0.0,
            damage=damage,
            basic_hours=hours / damage if damage else math.inf,
            reference_damage=reference,
            reference_hours=hours / reference if reference else math.inf,
            modified_damage=modified,
            modified_hours=hours / modified if modified else math.inf,
            viscosity_ratio=ratio,
            minimum_load=least,
            pressure=pressure,
            static_safety=ratings.static / static if static else math.inf,
            ratings=ratings,
            remarks=tuple(remarks),
            by_bin=self.acting.sum_by_bin(by_bin),
            reference_by_bin=self.acting.sum_by_bin(by_reference),
            modified_by_bin=self.acting.sum_by_bin(by_modified),
        )

    def _remarks(self, ratings: LoadRatings, ratio: float, largest: float, least: float) -> list[str]:
        """Return remarks on minimum viscosity ratio, largest and minimum load (N), and the source of the ratings."""
        remarks = []
        if ratio < LEAST_RATIO:
            remarks.append(
                f"viscosity ratio {ratio:.2g} at the lowest speed: ISO 281 has no a_ISO below {LEAST_RATIO:g}; L10m "
                "contains its minimum there, a_ISO = 0.1"
            )
        if UNLOADED * ratings.static < largest < least:
            remarks.append(f"load at most {1e-3 * largest:.3g} kN, below the usual minimum load: elements may slide")
        if ratings.estimated:
            remarks.append("ratings estimated from its dimensions (conservative)")
        elif ratings.makers:
            designation = self.support.catalogue.designation if self.support.catalogue else ""
            remarks.append(f"ratings: smallest in catalogues of {', '.join(ratings.makers)} for {designation}")
        return remarks

    def _life_factor(
        self, rows: tuple[RollingRow, ...], ratings: LoadRatings, loads: Floats, speed: Floats
    ) -> tuple[Floats, float]:
        """Return a_ISO for equivalent loads (points, angles) at ring speeds (points,), and the minimum viscosity ratio.

        NaN if the gearbox file lacks oil, temperature or cleanliness.
        """
        oil, section = self.oil, self.support.catalogue
        assert section is not None
        if oil is None or oil.viscosity_100_mm2_per_s is None or oil.temperature_C is None or oil.cleanliness is None:
            return np.full(loads.shape, math.nan), math.nan
        viscosity = viscosity_at(oil.temperature_C, oil.viscosity_40_mm2_per_s, oil.viscosity_100_mm2_per_s)
        pitch = rows[0].pitch_diameter
        limit = KN * (section.fatigue_load_limit_kN or 0.0) or fatigue_limit(ratings.static, pitch, section.type)
        clean = contamination_factor(oil.cleanliness, pitch)
        ratios = np.array([viscosity_ratio(viscosity, float(value), pitch) for value in speed])
        factors = [
            [life_factor(ratio, clean * limit / max(load, 1e-9), section.type) for load in row]
            for ratio, row in zip(ratios.tolist(), loads.tolist(), strict=True)
        ]
        turning = ratios[speed != 0.0]
        return np.array(factors).reshape(loads.shape), float(turning.min(initial=math.inf))

    def _reference(
        self, rows: tuple[RollingRow, ...], ratings: LoadRatings, loads: Floats, revolutions: Floats, worst: Floats
    ) -> tuple[tuple[Floats, Floats] | None, float, list[str]]:
        """Return L10r (millions of revolutions) over radial load (N), maximum contact stress (Pa), and remarks.

        Direction, axial load and tilt have the proportions at the load and angle nearest to the mean of the fourth
        power over the revolutions.
        """
        size = np.hypot(loads[..., 0], loads[..., 1])
        mean = np.average(np.mean(size**4.0, axis=1), weights=revolutions) ** 0.25
        t, a = np.unravel_index(int(np.abs(size - mean).argmin()), size.shape)
        points = self.acting.points
        tilts = self.balance.at(
            self.balance.bearing_tilt.of(self.number), points.torque[t : t + 1], points.other[t : t + 1]
        )
        load, tilt, top = loads[t, a], tilts[0, a], np.hypot(worst[..., 0], worst[..., 1]).max()
        if not size[t, a]:
            return None, math.nan, ["no load: elements may slide"]
        holds_axially = any(row.contact_angle for row in rows) or not isinstance(rows[0], RollerRow)
        remarks = []
        if not holds_axially and abs(load[2]) > 0.01 * size[t, a]:
            remarks.append(f"ribs carry up to {1e-3 * abs(load[2]):.3g} kN, which the rating life does not include")
        solved = []
        for share in LOAD_SHARES:
            factor = share * float(top) / size[t, a]
            force = factor * load[:3] * np.array([1.0, 1.0, float(holds_axially)])
            try:
                life, pressure = self._life_at(rows, ratings, force, factor * tilt)
            except BearingError as error:
                return None, math.nan, [*remarks, f"no L10r: {error}"]
            solved.append((share * float(top), life))
        radial, lives = np.array(solved).T
        return (radial, lives), pressure, remarks

    def _life_at(
        self, rows: tuple[RollingRow, ...], ratings: LoadRatings, force: Floats, tilt: Floats
    ) -> tuple[float, float]:
        """Return L10r (millions of revolutions) and maximum contact stress (Pa) under a force (N) and a tilt (rad)."""
        section = self.support.catalogue
        assert section is not None
        bearing = BearingOfRows(rows)
        states: list[BearingState] = [
            equilibrium(bearing, force, tilt=tilt, first_roller_angle=angle) for angle in cage_angles(rows, 0.0)
        ]
        life = reference_life(
            rows,
            [np.concatenate(loads) for loads in zip(*map(loads_of_rows, states), strict=True)],
            section.type,
            dynamic_rating=ratings.dynamic,
            inner_ring_turns_against_load=not self.support.carries_outer_ring,
        )
        return life, max(float(state.element_pressure.max()) for state in states)


def _interpolated(lives: tuple[Floats, Floats], radial: Floats) -> Floats:
    """Interpolate lives at radial loads linearly in logarithms; below the smallest load, extrapolate with its slope."""
    x, y = np.log(lives[0]), np.log(lives[1])
    with np.errstate(divide="ignore"):
        at = np.log(radial)
    slope = (y[1] - y[0]) / (x[1] - x[0])
    return np.exp(np.where(at < x[0], y[0] + slope * (at - x[0]), np.interp(at, x, y)))
