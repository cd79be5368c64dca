"""Cones of turned shafts: the map from a shaft of cylinders, whose lines are straight, to the radii that it has.

Meshes are made over cylinders: those that each section has where it begins, pushed on by all cones before it. At every
place along the shaft the map stretches radii piece by piece, and between the ends of a section it changes evenly, so
that edges of elements stay straight and follow the cone exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exugear.system.bodies.finite_elements.shaft_sections import ShaftSection
from fe_ste.tools.arrays import Floats


@dataclass(frozen=True)
class _Stretch:
    """Radii of the shaft over those of its cylinders at one place: straight between knots, shifted beyond the last."""

    cylinders: Floats
    radii: Floats

    def radius(self, cylinder: Floats) -> Floats:
        """Radius of the shaft."""
        beyond = np.maximum(cylinder - self.cylinders[-1], 0.0)
        return np.asarray(np.interp(cylinder, self.cylinders, self.radii) + beyond)

    def cylinder(self, radius: Floats) -> Floats:
        """Radius among the cylinders."""
        beyond = np.maximum(radius - self.radii[-1], 0.0)
        return np.asarray(np.interp(radius, self.radii, self.cylinders) + beyond)


class Tapers:
    """Radii of a shaft with cones over those of a shaft of cylinders.

    Parameters
    ----------
    sections : from the beginning at z = 0 on

    Attributes
    ----------
    outer, inner : (s,)
        Radii of the cylinders that stand for the sections, m.

    Examples
    --------
    >>> cone = Tapers([ShaftSection(1.0, 0.2, 0.0, 0.1), ShaftSection(1.0, 0.1)])
    >>> cone.outer
    array([0.1, 0.1])
    >>> cone.radius(np.array([0.1, 0.05, 0.1]), np.array([0.5, 0.5, 1.5]))
    array([0.075 , 0.0375, 0.05  ])
    """

    def __init__(self, sections: Sequence[ShaftSection]) -> None:
        self._ends = np.concatenate([[0.0], np.cumsum([section.length for section in sections])])
        self._stretches = [_Stretch(np.zeros(1), np.zeros(1))]
        outer = []
        inner = []
        for section in sections:
            last = self._stretches[-1]
            begins = 0.5 * np.array([section.inner_diameter, section.outer_diameter])
            cylinders = last.cylinder(begins)
            inner.append(float(cylinders[0]))
            outer.append(float(cylinders[1]))
            self._stretches.append(_stretched(last, section, begins, cylinders) if section.is_cone else last)
        self.outer, self.inner = np.array(outer), np.array(inner)

    def radius(self, cylinder: Floats, z: Floats) -> Floats:
        """Radii of the shaft at places z (m) for radii among the cylinders (m)."""
        number = np.clip(np.searchsorted(self._ends, z, side="right") - 1, 0, len(self.outer) - 1)
        found = np.empty(np.broadcast(cylinder, z).shape)
        for section in np.unique(number):
            here = number == section
            low = self._ends[section]
            high = self._ends[section + 1]
            share = np.clip((z[here] - low) / (high - low), 0.0, 1.0)
            before, after = (stretch.radius(cylinder[here]) for stretch in self._stretches[section : section + 2])
            found[here] = before + share * (after - before)
        return found

    def cylinder_at(self, boundary: int, radius: float) -> float:
        """Radius among the cylinders where a section with a number begins, for one of the shaft, m."""
        return float(self._stretches[boundary].cylinder(np.array([radius]))[0])


def _stretched(last: _Stretch, section: ShaftSection, begins: Floats, cylinders: Floats) -> _Stretch:
    """Stretch at the end of a cone: its radii become those there; what is thinner stretches, what is thicker shifts."""
    knots = np.unique(np.concatenate([last.cylinders, cylinders]))
    ends = 0.5 * np.array([section.inner_end, section.outer_end])
    # A section without bore has no knot for it but the axis.
    bored = int(begins[0] == 0.0)
    stretch = _Stretch(np.concatenate([[0.0], begins[bored:]]), np.concatenate([[0.0], ends[bored:]]))
    return _Stretch(knots, stretch.radius(last.radius(knots)))
