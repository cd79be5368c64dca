"""What makes a peak: which mesh's error excites it, which mode carries it, and what would lower it, in percent.

At the level `linear` a line of the overall transmission error is a sum over meshes, and over modes of the mean system.
Shares are the parts of each along the sum, so that they add up to one; parts that work against the sum are negative.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from exugear.steady.excitation import Gearset
from exugear.steady.mean_system.mean_modes import mean_modes
from exugear.steady.response import transmission_errors
from exugear.system.linearised import linearise
from fe_ste.tools.arrays import Complexes, Floats

LEAST_MODE = 0.01
"""Share of a mode below which it is not told."""


@dataclass(frozen=True)
class Contributions:
    """What a line of the overall transmission error is made of at one speed."""

    speed: float
    """Of the input, rad/s."""
    amplitude: float
    """Peak amplitude of the line at the level `linear`, m."""
    meshes: Mapping[str, float]
    """Share by family of meshes."""
    modes: tuple[tuple[float, float], ...]
    """Frequency (Hz) and share of each mode that carries a hundredth or more, the strongest first."""
    supports: Mapping[str, float]
    bodies: Mapping[str, float]
    """Relative change of the amplitude per relative change of a bearing's stiffness, and of a body's inertia, the
    mean stiffness of the meshes and the excitation staying as they are."""


def contributions(gearset: Gearset, speed: float, line: int) -> Contributions:
    """Find what makes a line of the overall transmission error at a speed.

    Parameters
    ----------
    gearset : of a law along a row, which has a first-order excitation
    speed : of the input, rad/s
    line : place in the line set, of one base alone: combinations are no sum over meshes
    """
    frequency = abs(speed) * float(gearset.lines.orders[line])
    row = gearset.row_of_overall(speed)
    forces, loads = _excitation(gearset, speed, line)
    dynamic = gearset.system.dynamic(speed, frequency)
    # One solution from either side: what the signal sees of any load, and what moves under these loads.
    adjoint = np.linalg.solve(dynamic.T, row.astype(np.complex128)).astype(np.complex128)
    motion = np.linalg.solve(dynamic, loads).astype(np.complex128)
    total = complex(row @ motion)
    meshes: dict[str, float] = {}
    parts = (adjoint @ forces).reshape(len(gearset.waves.waves), -1).sum(axis=1)
    for wave, part in zip(gearset.waves.waves, parts, strict=True):
        meshes[wave.family] = meshes.get(wave.family, 0.0) + _share(complex(part), total)
    supports, bodies = _derivatives(gearset, speed, frequency, adjoint, motion, total)
    modes = _modes(gearset, speed, frequency, loads, row, total)
    return Contributions(speed, abs(total), meshes, modes, supports, bodies)


def loudest_near(gearset: Gearset, speed: float, width: float, line: int) -> float:
    """Speed (rad/s) within a share `width` of another at which a line is loudest at the level `linear`.

    There the height of a peak changes with a parameter as the amplitude does at that speed: its place then counts
    for nothing.
    """
    import scipy.optimize  # a quarter of a second that others need not wait

    def quietness(factor: float) -> float:
        at = speed * factor
        dynamic = gearset.system.dynamic(at, abs(at) * float(gearset.lines.orders[line]))
        return -abs(complex(gearset.row_of_overall(at) @ np.linalg.solve(dynamic, _excitation(gearset, at, line)[1])))

    found = scipy.optimize.minimize_scalar(
        quietness, bounds=(1.0 - width, 1.0 + width), method="bounded", options={"xatol": 1e-4 * width}
    )
    return speed * float(found.x)


def _excitation(gearset: Gearset, speed: float, line: int) -> tuple[Complexes, Complexes]:
    """Generalized peak forces of each wave (size, m f) on a line, and their sum (size,)."""
    ports = gearset.ports_at(speed)
    excess = transmission_errors(gearset, ports, speed)[line]
    forces = -2.0 * gearset.loads(ports) * excess.ravel()
    return forces, np.asarray(forces.sum(axis=1))


def _share(part: complex, total: complex) -> float:
    """Part along the total, over its size."""
    return float((part * total.conjugate()).real / abs(total) ** 2)


def _modes(
    gearset: Gearset, speed: float, frequency: float, loads: Complexes, row: Floats, total: complex
) -> tuple[tuple[float, float], ...]:
    """Shares of the modes of the mean system, those of negative frequency counted with their partners."""
    values, right, left = mean_modes(gearset.system, speed)
    size = gearset.system.size
    pushed = np.linalg.solve(gearset.system.mass, loads)
    found = []
    for value, shape, partner in zip(values, right[:, :size] @ row, left[:, size:], strict=True):
        part = shape * (partner @ pushed) / (1j * frequency - value)
        part += np.conj(shape) * (partner.conj() @ pushed) / (1j * frequency - np.conj(value))
        found.append((abs(value) / (2.0 * np.pi), _share(complex(part), total)))
    return tuple(sorted((own for own in found if abs(own[1]) >= LEAST_MODE), key=lambda own: -abs(own[1])))


def _derivatives(
    gearset: Gearset, speed: float, frequency: float, adjoint: Complexes, motion: Complexes, total: complex
) -> tuple[dict[str, float], dict[str, float]]:
    """Relative changes of the amplitude per relative change of bearings' stiffness and of bodies' inertia.

    A change dD of the dynamic stiffness D changes the signal by -(row D^-1) dD (D^-1 loads). Damping goes with the
    stiffness.
    """
    system = gearset.system
    frame = gearset.system.frame
    assembly = frame.assembly
    t = frame.matrices(0.0)[0]
    q, _, _ = frame.state(0.0, speed, system.static_at(speed))
    elements = linearise(assembly, q, frame.mean_meshes)
    adjoint = t @ adjoint
    motion = t @ motion
    supports: dict[str, float] = {}
    for support in assembly.supports:
        forces = elements.stiffness[support.name] @ motion
        forces = forces + 1j * frequency * (elements.damping[support.name] @ motion)
        share = _share(-complex(adjoint @ forces), total)
        supports[support.family] = supports.get(support.family, 0.0) + share
    bodies: dict[str, float] = {}
    for body in assembly.bodies:
        place = assembly.elastic_slices.get(body.name)
        index = [i for i in assembly.coordinates[body.name] if i >= 0]
        index = index if place is None else list(range(place.start, place.stop))
        inertia = -(frequency**2) * (elements.mass[np.ix_(index, index)] @ motion[index])
        bodies[body.family] = bodies.get(body.family, 0.0) + _share(-complex(adjoint[index] @ inertia), total)
    return supports, bodies
