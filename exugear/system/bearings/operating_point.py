"""The state that a bearing works in: what it carries, how its rings stand, and how stiff its rows are there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.parts import Bearing
from exugear.system.bearings import matrices
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.contact import (
    bearing_load,
    is_preloaded,
    pitch_averaged_tangent,
    row_contacts,
    tangent_stiffness,
)
from exugear.system.bearings.rolling.ratings import basic_dynamic_rating
from exugear.system.bearings.rolling.rows import BearingOfRows, RollingRow
from exugear.system.bearings.support_laws import LEAST_LOAD, holding_force
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed

CAGE_POSITIONS = 4
"""Positions of the cage within one pitch over which the stiffness is averaged: a linear bearing knows no cage."""


@dataclass(frozen=True)
class OperatingPoint(Displayed):
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
    """Whether it carries so little that its stiffness is that at the least load."""
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
