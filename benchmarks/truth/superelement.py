"""Displacement of given contact cells on one gear by the superelement, and what parts a cell's middle from its mean."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cases import LoadCase
from fe_ste.contact.compliance import RegularCompliance, compliance_matrix
from fe_ste.contact.kinematics import FlankPair
from fe_ste.elasticity.flank import FlankCompliance
from fe_ste.elasticity.halfspace import rectangle_integral
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.compilation import compiled

RIGID = Material(youngs_modulus=1e30)


def cell_deflection(load: LoadCase, number: int, flank: FlankCompliance) -> Floats:
    """Displacement (n,) of the cells' middles on gear 0 or 1 under the forces of a load case, m."""
    pair, cells = load.pair, load.cells
    sense = 1 if number == 0 or pair.gear.internal else -1
    teeth = np.arange(cells.tooth.min(), cells.tooth.max() + 1)
    own = RegularCompliance.from_flank(flank, sense, teeth, int(np.ptp(teeth)))
    # The other gear is rigid.
    rigid = replace(flank, gear=replace((pair.gear, pair.pinion)[number], material=RIGID))
    both = [(flank, own), (rigid, replace(own, table=np.zeros_like(own.table)))]
    flanks, parts = zip(*(both if number == 0 else both[::-1]), strict=True)
    radii = pair.pinion.form_radius, pair.pinion.tip_radius
    rolls = [math.sqrt((radius / pair.pinion.base_radius) ** 2 - 1.0) for radius in radii]
    matrix = np.tril(compliance_matrix(cells, FlankPair.from_pair(pair, *rolls), load.axial, flanks, parts))
    return np.asarray((matrix + np.tril(matrix, -1).T) @ load.force)


@compiled
def _middle_less_mean(
    tooth: Integers, layer: Integers, z: Floats, roll: Floats, half: Floats, half_along: float, force: Floats,
    base_radius: float, twist: float, cosine: float, at: Floats, share: Floats, reach: int, result: Floats,
) -> None:  # fmt: skip
    for i in range(len(roll)):
        for j in range(len(roll)):
            if tooth[i] != tooth[j] or abs(layer[i] - layer[j]) > reach:
                continue
            along = (z[i] - z[j]) / cosine
            across = base_radius * 0.5 * (roll[i] + roll[j]) * (roll[i] - roll[j] - twist * (z[i] - z[j]))
            value = rectangle_integral(across, along, half[j], half_along)
            for k in range(len(at)):
                for m in range(len(at)):
                    value -= (
                        share[k]
                        * share[m]
                        * rectangle_integral(across + at[k] * half[i], along + at[m] * half_along, half[j], half_along)
                    )
            result[i] += value * force[j] / (4.0 * half[j] * half_along)


def middle_less_mean(load: LoadCase, number: int) -> Floats:
    """Displacement of the cells' middles less its mean over each cell, on an elastic half-space, m."""
    gear, pair, cells = load.on_gear(number)[0], load.pair, load.cells
    nodes, weights = np.polynomial.legendre.leggauss(8)
    result = np.zeros(len(load.force))
    twist = math.tan(pair.pinion.base_helix_angle) / pair.pinion.base_radius
    _middle_less_mean(
        cells.tooth, cells.layer, load.axial[cells.layer], cells.roll, cells.half_across, load.half_along, load.force,
        pair.pinion.base_radius, twist, math.cos(pair.pinion.base_helix_angle), nodes, weights / 2.0, 6, result,
    )  # fmt: skip
    material = gear.material
    return np.asarray(result * (1 - material.poissons_ratio**2) / (np.pi * material.youngs_modulus))
