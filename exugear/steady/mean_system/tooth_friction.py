"""Friction of the teeth as forces that the mesh cycle varies: across the line of action, and moments on the gears.

Under the static mesh force F, friction has the forces and moments mu F times those of
`fe_ste.transmission_error.sliding.friction_over_cycle`. Friction excites the gearbox in addition to the transmission
error. Vibration changes neither the load nor the sense of sliding here: the effect of friction on disturbances, of the
order of mu times the mesh stiffness, is neglected.
"""

from __future__ import annotations

import math

import numpy as np

from exugear.steady.harmonics.lines import HarmonicCoupling, LineSet, fourier_coefficients
from exugear.steady.mean_system.mesh_places import CycleFunctions, MeshInterface, families, group_of
from exugear.steady.mean_system.mesh_waves import MeshWaves
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.system.tooth_mesh.element import friction_lack
from exugear.system.tooth_mesh.laws.friction import FRICTION_PARTS
from fe_ste.tools.arrays import Complexes


def tooth_friction(waves: MeshWaves, lines: LineSet, ports: MeshInterface, speed: float, harmonics: int) -> Complexes:
    """Return the generalized forces (n, size) of the friction of all meshes at a speed of the input (rad/s).

    Parameters and errors are those of `friction_parts`.
    """
    parts = friction_parts(waves, lines, ports, speed, harmonics)
    rows = np.array([element.friction_rows for element in waves.assembly.elements])
    gradients = np.stack([waves.gradients(rows[:, part], speed) for part in range(FRICTION_PARTS)], axis=1)
    return np.tensordot(parts, gradients * waves.weights[:, None, None], axes=2)


def friction_parts(waves: MeshWaves, lines: LineSet, ports: MeshInterface, speed: float, harmonics: int) -> Complexes:
    """Return force and moments (n, m, `FRICTION_PARTS`) of friction along their rows at a speed of the input (rad/s).

    Parameters
    ----------
    ports : of the meshes at this speed
    harmonics : of each mesh frequency that the forces have

    Raises
    ------
    SteadyError
        The sliding of a pair is unknown: its stiffness is not from a table.
    """
    assembly = waves.assembly
    coefficient = assembly.gearbox.case.damping.tooth_friction
    static = assembly.gearbox.train.static_mesh_forces()
    turns = waves.system.frame.speeds
    elements = [assembly.elements[wave.first] for wave in waves.waves]
    cycles = np.zeros((FRICTION_PARTS, len(elements), harmonics + 1), dtype=complex)
    if lack := friction_lack(elements):
        raise SteadyError(lack)
    for m, element in enumerate(elements):
        if element.friction is None:  # of a mesh without load
            continue
        # Friction opposes the sliding of gear 1 on gear 2.
        sliding = turns.get(element.mesh.pinion, 0.0) - turns.get(element.mesh.gear, 0.0)
        size = -coefficient * math.copysign(1.0, speed * sliding) * abs(static[element.mesh.name])
        for part, samples in enumerate(element.friction):
            found = fourier_coefficients(size * samples, harmonics)
            cycles[part, m, : len(found)] = found
    spectra = {(part, 0): own for part, own in enumerate(cycles)}
    everywhere = np.zeros((len(elements), FRICTION_PARTS))
    everywhere[:, 0] = [wave.wave == 0 for wave in waves.waves]
    kinds = families(waves)
    coupling = HarmonicCoupling(
        lines, tuple(group_of(own, harmonics, FRICTION_PARTS, lines.index.shape[1]) for own in kinds)
    )
    functions = CycleFunctions(waves, kinds, spectra, FRICTION_PARTS).at(ports, speed)
    return coupling.of_constants(functions, everywhere.ravel()).reshape(-1, *everywhere.shape)
