"""Root stress of a gear by loads on its flanks: the gauges' stress in the closed ring, tooth by tooth.

Open sectors overestimate it: with free cut faces a tooth's root carries what the ring would share. By three, five,
seven and nine teeth a high-speed pinion has 473, 218, 200 and 196 MPa where the ring has 188.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_ste.elasticity.condensation import flank_functionals
from fe_ste.elasticity.half_sector import sector_halves, turn_signs
from fe_ste.elasticity.hexmesh import MeshSettings, sector_mesh
from fe_ste.elasticity.ring import Chain, ring_faces
from fe_ste.geometry.gears import Gear
from fe_ste.root_stress.gauges import COMPONENTS, GaugePlaces, gauge_columns, gauge_places
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed
from fe_ste.tools.threads import one_dense_thread

REACH = 3
"""Teeth on either side of the loaded one whose roots are read: beyond, less than a hundredth is felt."""


@dataclass(frozen=True)
class RootGauges(Displayed, line=" of {gear.name!r}: {places.edges!n} edges, {axial!n} layers"):
    """Stress at the root of the teeth of a gear under loads on the flank of one tooth."""

    gear: Gear
    side: int
    """Loaded flank: +1 counter-clockwise, -1 clockwise."""
    places: GaugePlaces
    roll: Floats
    axial: Floats
    """(f,), (l,) flank grid of the loads: roll angles (rad) and axial positions (m)."""
    stress: dict[int, Floats]
    """Tooth read less tooth loaded -> ndarray (g, 3, l, f l): stress along the section, along the face and shear
    (plane stress on the surface) per unit load into the flank at each node, Pa/N."""

    def node_loads(self, roll: Floats, axial: Floats, force: Floats) -> Floats:
        """Share forces (N) at places of a flank among its nodes, bilinear, (f l,); places off the flank at its edge."""
        first, along = _between(self.roll, roll)
        layer, across = _between(self.axial, axial)
        loads = np.zeros((len(self.roll), len(self.axial)))
        for step, share in ((0, 1.0 - along), (1, along)):
            for up, width in ((0, 1.0 - across), (1, across)):
                np.add.at(loads, (first + step, layer + up), force * share * width)
        return loads.ravel()

    def principal(self, loads: dict[int, Floats]) -> tuple[Floats, Floats]:
        """Largest and least principal stress, (teeth, g, l), Pa, of all teeth that loaded ones reach.

        Parameters
        ----------
        loads : number of a tooth, counter-clockwise -> its node loads (f l,), N
        """
        reach = max(self.stress)
        teeth = range(min(loads) - reach, max(loads) + reach + 1)
        layers = len(self.axial)
        total = np.zeros((len(teeth), len(self.places.edges), COMPONENTS, layers))
        for loaded, forces in loads.items():
            for read, block in self.stress.items():
                total[loaded + read - teeth[0]] += block @ forces
        mean = 0.5 * (total[:, :, 0] + total[:, :, 1])
        radius = np.hypot(0.5 * (total[:, :, 0] - total[:, :, 1]), total[:, :, 2])
        return mean + radius, mean - radius


def _between(grid: Floats, values: Floats) -> tuple[np.ndarray, Floats]:
    """Interval of a rising grid and the place in it, from 0 to 1."""
    at = np.clip(values, grid[0], grid[-1])
    first = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 2)
    return first, (at - grid[first]) / (grid[first + 1] - grid[first])


def root_gauges(gear: Gear, side: int, settings: MeshSettings | None = None) -> RootGauges:
    """Compute the root stress of a gear under loads on one flank by finite elements of the closed ring.

    Parameters
    ----------
    gear : held at ``gear.held_diameter``
    side : loaded flank: +1 counter-clockwise, -1 clockwise
    settings : the fillet's elements rule the error: see the tests
    """
    mesh = sector_mesh(gear, settings)
    places = gauge_places(mesh)
    flank = -flank_functionals(mesh, side)
    strains = gauge_columns(mesh, places)
    count = flank.shape[1]
    with one_dense_thread():
        even, odd = sector_halves(mesh, [flank, strains], True)
        signs = turn_signs(mesh)
        load = Chain(even.face_reading[:count].T, odd.face_reading[:count].T)
        reach = min(REACH, (gear.teeth - 2) // 2)
        faces = ring_faces(Chain(even.stiffness, odd.stiffness), load, signs, gear.teeth, reach)
    fixed = 0.5 * (even.fixed_reading + odd.fixed_reading)[count:, :count]
    gauges = {}
    for read in range(-reach, reach + 1):
        minus = signs[:, None] * faces[read]
        plus = faces[read + 1]
        strain = even.face_reading[count:] @ (0.5 * (plus + minus)) + odd.face_reading[count:] @ (0.5 * (plus - minus))
        strain = strain + fixed if read == 0 else strain
        gauges[read] = _stress(gear, strain.reshape(len(places.edges), COMPONENTS, -1, count))
    return RootGauges(gear, side, places, mesh.section.flank_roll, mesh.axial_positions, gauges)


def _stress(gear: Gear, strain: Floats) -> Floats:
    """Plane stress of surface strains; the shear strain is the whole change of the angle."""
    modulus = gear.material.youngs_modulus
    ratio = gear.material.poissons_ratio
    stiff = modulus / (1.0 - ratio**2)
    return np.stack(
        [
            stiff * (strain[:, 0] + ratio * strain[:, 1]),
            stiff * (strain[:, 1] + ratio * strain[:, 0]),
            0.5 * modulus / (1.0 + ratio) * strain[:, 2],
        ],
        axis=1,
    )
