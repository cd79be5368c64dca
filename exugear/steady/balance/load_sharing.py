"""How unequally planets that are not alike share the load in a steady state: forces of their meshes on average."""

from __future__ import annotations

import math

import numpy as np

from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.mean_system.displaced_pins import displaced_carriers
from fe_ste.tools.arrays import Complexes, Floats, SingleComplexes

ANGLES = 64
"""Places of the carrier over which forces have their mean."""


def mean_planet_forces(
    model: HarmonicBalanceModel, lines: Complexes | SingleComplexes, speed: float
) -> dict[str, Floats]:
    """Find the mean force of each planet's mesh, over the mesh cycles and turns of the carrier, (planets,), N.

    Families with equal loads by construction, whose planets count by their mean, are left out.

    Parameters
    ----------
    lines : (n, signals) peak amplitudes of all signals
    speed : of the input, rad/s
    """
    waves = model.waves
    lines = lines.astype(np.complex128)
    names = [signal.name for signal in model.signal_names]
    sense = math.copysign(1.0, speed)
    slow = np.flatnonzero(~model.lines.index[:, : len(waves.base_orders)].any(axis=1))
    turned = sense * 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    found: dict[str, Floats] = {}
    for family in model.families:
        planets = family.planets
        if planets is None or family.carrier < 0:
            continue
        own = waves.waves[family.first : family.first + planets.waves]
        columns = np.array([names.index(f"mesh_force {wave.name}") for wave in own])
        turns = model.lines.index[slow, family.carrier]
        alone = np.flatnonzero(np.abs(model.lines.index[slow]).sum(axis=1) == np.abs(turns))
        phases = np.exp(1j * sense * np.outer(turned, turns[alone]))
        forces = np.real(phases @ lines[slow[alone]][:, columns])
        shapes = planets.values(math.copysign(1.0, planets.ratio) * turned)
        loads = np.einsum("snw,sw->n", shapes, forces) / ANGLES
        # Planets that are not alike are families of one each here.
        found[own[0].family] = np.append(found.get(own[0].family, np.zeros(0)), loads)
    return found


def load_sharing(model: HarmonicBalanceModel, amplitude: SingleComplexes, speeds: Floats) -> dict[str, float]:
    """Find K_gamma of each family whose planets are loaded unequally: the largest mean force over the mean of all.

    They are on displaced pins, or fewer than three, or unequally spaced.

    Parameters
    ----------
    amplitude : (points, n, signals) peak amplitudes
    speeds : (points,) of the input, rad/s; the largest value over them counts
    """
    found: dict[str, float] = {}
    sets = model.system.frame.sets
    unequal = any(planets.is_single for planets in sets) or displaced_carriers(model.waves.assembly, sets)
    if not unequal:
        return found
    for lines, speed in zip(amplitude, speeds.tolist(), strict=True):
        for family, forces in mean_planet_forces(model, lines, speed).items():
            share = float(np.max(forces / forces.mean()))
            found[family] = max(found.get(family, 0.0), share)
    return found
