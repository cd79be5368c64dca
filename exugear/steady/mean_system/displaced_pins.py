"""Displaced planet pins in the rotating frame: planets that stand beside their nominal places on the carrier.

To first order a pin displaced by e carries its planet along. With coordinates of the planet that count from its
displaced place the bearings are as before, and the deflection of each mesh of the planet has g . e in addition, with
the row g of the deflection by the place of the planet: a deviation that stands still in the frame of the carrier. The
mean of e along radius and tangent over the planets of a set is part of the static state. What is left has the waves
that turn with the carrier: it excites at multiples of the carrier's rotation, and beside the mesh orders. Moments of
the planets' loads about displaced pins, which count by e over the radius of the carrier, are left out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from exugear.steady.mean_system.planet_sets import PlanetSet
from exugear.system.kernels.coordinates import BODY_SIZE
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.stiffness import pack
from fe_ste.tools.arrays import Floats

LEAST = 1e-9
"""Share of a displacement up to which pins that differ by it are displaced alike."""
PLANE = 2
"""Coordinates of a place in the plane of a gear."""


def unequal_pins(assembly: Assembly, sets: tuple[PlanetSet, ...]) -> dict[str, Floats]:
    """Offsets (2,) of planets from where their pins would be if all of a set were displaced alike, at zero angle, m.

    Sets whose pins are displaced alike have none.
    """
    found: dict[str, Floats] = {}
    for planets in sets:
        offsets = [complex(*assembly.gearbox.pin_offsets.get(name, (0.0, 0.0))) for name in planets.names]
        own = np.array(offsets) * np.exp(-1j * planets.angles)
        beyond = own - own.mean()
        if np.abs(beyond).max() > LEAST * np.abs(own).max():
            turned = beyond * np.exp(1j * planets.angles)
            found |= {name: np.array([way.real, way.imag]) for name, way in zip(planets.names, turned, strict=True)}
    return found


def displaced_carriers(assembly: Assembly, sets: tuple[PlanetSet, ...]) -> set[str]:
    """Carriers with pins of planets that are displaced unequally."""
    displaced = unequal_pins(assembly, sets)
    return {planets.carrier for planets in sets if displaced.keys() & set(planets.names)}


def with_equal_pins(assembly: Assembly, sets: tuple[PlanetSet, ...]) -> Assembly:
    """Return an assembly whose planets' pins are all displaced by the mean of their set along radius and tangent."""
    taken = unequal_pins(assembly, sets)
    if not taken:
        return assembly
    local = assembly.connectors.local.copy()
    for at, support in zip(local, assembly.supports, strict=True):
        if support.body in taken:
            at[0, :PLANE] -= taken[support.body]
    connectors = assembly.connectors._replace(local=local)
    if assembly.variant.has_bearings:
        return replace(assembly, connectors=connectors)
    # Without bearings the offsets are in the meshes themselves.
    elements = tuple(
        replace(element, offset=element.offset - [_along(element.deflection, ends), _along(element.centre, ends), 0.0])
        for element in assembly.elements
        for ends in [_at_ends(element.mesh.pinion, element.mesh.gear, taken)]
    )
    meshes = pack(elements, assembly.coordinates)._replace(error_pieces=assembly.meshes.error_pieces)
    return replace(assembly, elements=elements, meshes=meshes)


def pin_deflections(assembly: Assembly, sets: tuple[PlanetSet, ...], meshes: tuple[int, ...]) -> Floats:
    """Deflection (n,) that unequal pins give to meshes, by their numbers, m."""
    taken = unequal_pins(assembly, sets)
    elements = [assembly.elements[mesh] for mesh in meshes]
    return np.array([_along(own.deflection, _at_ends(own.mesh.pinion, own.mesh.gear, taken)) for own in elements])


def pin_places(assembly: Assembly, planets: PlanetSet, turned: float) -> Floats:
    """Coordinates (size,) by which planets are displaced unequally where their carrier has turned by an angle (rad), m.

    Zero without bearings: there the displacement is in the meshes alone.
    """
    found = np.zeros(assembly.size)
    if assembly.variant.has_bearings:
        c, s = math.cos(turned), math.sin(turned)
        for name, offset in unequal_pins(assembly, (planets,)).items():
            first = assembly.coordinates[name][0]
            found[first : first + PLANE] = np.array([[c, -s], [s, c]]) @ offset
    return found


def _at_ends(pinion: str, gear: str, offsets: Mapping[str, Floats]) -> tuple[Floats, Floats]:
    """Offsets (2,) of both bodies of a mesh."""
    none = np.zeros(PLANE)
    return offsets.get(pinion, none), offsets.get(gear, none)


def _along(row: Floats, ends: tuple[Floats, Floats]) -> float:
    """Value of a row (12,) of a mesh at offsets of both ends."""
    return float(row[:PLANE] @ ends[0] + row[BODY_SIZE : BODY_SIZE + PLANE] @ ends[1])
