"""Pitch deviations and run-out of gears: displacements known over the revolution of their shafts.

A deviation e of a gear is subtracted from the deflection d of its meshes, so that the force of a mesh is

    F = k (d - e) + c (d' - e'),

and -k e - c e' is a given force at the orders of the shaft. The stiffness k varies with the mesh cycle, which brings
the sidebands h z +- n of the mesh orders h z for each order n of a shaft with z teeth.

The normal of a deviating flank is not that of the perfect one: by the work along e, the static force F_0 has the torque
F_0 de/dphi on the gear, which is given, too. The averaged system itself has no deviations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from exugear.steady.harmonics.lines import LineSet, ShaftOrders, fourier_coefficients, largest
from exugear.steady.mean_system.mesh_waves import MeshWaves
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from exugear.system.kernels.meshes import FRAME
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats, Integers

NEGLECTED = 1e-2
"""Share of a deviation's root mean square in orders that are left out."""
SAMPLES_PER_PIECE = 4
"""Samples of each cubic piece of a deviation for its Fourier coefficients; pieces are a fraction of a tooth."""


@dataclass(frozen=True, eq=False)
class WheelError:
    """Deviation of one gear in one of its meshes."""

    wave: int
    """Its mesh, by its place among the mesh components."""
    shaft: int
    """Place of its shaft in `WheelErrors.shafts`."""
    harmonics: Complexes
    """(h + 1,) Fourier coefficients over the shaft's angle at zero angle of the input, m along the mesh's row."""
    angles: tuple[int, int]
    """Coordinates of the gear's rotation and of its frame's, -1 for none: their static values add to the angle."""
    sense: float
    """1 where the gear turns about +z relative to its frame when the input does, else -1."""


@dataclass(frozen=True, eq=False)
class WheelErrors:
    """Deviations of all gears; without any, it is empty."""

    shafts: tuple[ShaftOrders, ...] = ()
    errors: tuple[WheelError, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bases of the shafts' orders."""
        return tuple(shaft.name for shaft in self.shafts)

    def displacements(self, lines: LineSet, waves: MeshWaves, speed: float) -> Complexes:
        """Deviations (n, m) of the meshes at the lines, at a speed of the input (rad/s), m."""
        found = np.zeros((len(lines.index), len(waves.waves)), dtype=complex)
        for error in self.errors:
            place, values = self._at_lines(error, error.harmonics, lines, waves, speed)
            np.add.at(found[:, error.wave], place, values)
        return found

    def reactions(self, lines: LineSet, waves: MeshWaves, speed: float, static: Floats) -> Complexes:
        """Generalized forces (n, size) in the frame of static mesh forces (m,) on gears that deviate, N and N m."""
        rotation = waves.system.frame.matrices(0.0)[0]
        found = np.zeros((len(lines.index), len(rotation.T)), dtype=complex)
        for error in self.errors:
            slopes = 1j * np.arange(len(error.harmonics)) * error.harmonics
            place, values = self._at_lines(error, static[error.wave] * slopes, lines, waves, speed)
            row = sum(sign * rotation[at] for at, sign in zip(error.angles, (1.0, -1.0), strict=True) if at >= 0)
            np.add.at(found, place, values[:, None] * row)
        return found

    def _at_lines(
        self, error: WheelError, harmonics: Complexes, lines: LineSet, waves: MeshWaves, speed: float
    ) -> tuple[Integers, Complexes]:
        """Place (h,) and coefficient of each harmonic of a function of the gear's angle that is among the lines."""
        static = waves.system.frame.matrices(0.0)[0] @ waves.system.static_at(speed)
        spin, frame = (float(static[at]) if at >= 0 else 0.0 for at in error.angles)
        order = np.arange(len(harmonics))
        values = harmonics * np.exp(1j * order * (spin - frame))
        if error.sense * speed < 0.0:
            values = values.conj()
        multiples = np.zeros((len(order), lines.index.shape[1]), dtype=np.int64)
        multiples[:, lines.index.shape[1] - len(self.shafts) + error.shaft] = order
        place, mirrored = lines.find(multiples)
        there = place >= 0
        return place[there], np.where(mirrored, values.conj(), values)[there]


def without_wheel_errors(assembly: Assembly) -> Assembly:
    """Return an assembly whose gears have no deviations."""
    none = (np.zeros(0), np.zeros(0))
    elements = tuple(replace(element, errors=none) for element in assembly.elements)
    meshes = assembly.meshes
    no_pieces = np.zeros_like(meshes.error_pieces)
    return replace(assembly, elements=elements, meshes=meshes._replace(error_pieces=no_pieces))


def wheel_errors(assembly: Assembly, waves: MeshWaves) -> WheelErrors:
    """Find the deviations of an assembly's gears, and the orders of their shafts that matter.

    Parameters
    ----------
    assembly : with deviations
    waves : mesh components of its averaged system without deviations
    """
    meshes = assembly.meshes
    frame = waves.system.frame
    names: list[str] = []
    errors: list[WheelError] = []
    teeth: list[list[tuple[int, int]]] = []
    for n, wave in enumerate(waves.waves):
        mesh = assembly.elements[wave.first].mesh
        for end, (body, gear) in enumerate(((mesh.pinion, mesh.pair.pinion), (mesh.gear, mesh.pair.gear))):
            pieces = int(meshes.error_pieces[wave.first, end])
            if not pieces:
                continue
            relative = frame.speeds.get(body, 0.0) - frame.speeds.get(mesh.frame, 0.0)
            if body not in names:
                names.append(body)
                teeth.append([])
            shaft = names.index(body)
            teeth[shaft].append((wave.base, gear.teeth))
            index = meshes.coordinates[wave.first]
            errors.append(
                WheelError(
                    wave=n,
                    shaft=shaft,
                    harmonics=_harmonics(meshes.error[wave.first, end, :pieces]),
                    angles=(int(index[BODY_SIZE * end + SPIN]), int(index[FRAME])),
                    sense=math.copysign(1.0, relative),
                )
            )
    shafts = []
    for shaft, name in enumerate(names):
        base, count = teeth[shaft][0]
        orders: set[int] = set()
        for error in errors:
            if error.shaft == shaft:
                number = next(z for b, z in teeth[shaft] if b == waves.waves[error.wave].base)
                orders |= _orders_of(error.harmonics, number)
        shafts.append(
            ShaftOrders(
                name=f"rotation of {name}",
                order=float(waves.base_orders[base]) / count,
                orders=tuple(sorted(orders)),
                bases=tuple(dict.fromkeys(base for base, _ in teeth[shaft])),
            )
        )
    return WheelErrors(tuple(shafts), tuple(errors))


def _harmonics(pieces: Floats) -> Complexes:
    """Fourier coefficients over a revolution of a function of equal cubic pieces (pieces, 4)."""
    powers = np.vander(np.arange(SAMPLES_PER_PIECE) / SAMPLES_PER_PIECE, 4, increasing=True).T
    samples = (pieces @ powers).ravel()
    return fourier_coefficients(samples, len(pieces) // 2)


def _orders_of(harmonics: Complexes, teeth: int) -> set[int]:
    """Orders n of a shaft up to half a mesh order that a deviation has, by itself or at h z +- n."""
    nearest = np.arange(len(harmonics))
    nearest = np.abs(nearest - teeth * np.round(nearest / teeth)).astype(np.int64)
    power = np.bincount(nearest, weights=np.abs(harmonics) ** 2, minlength=1)
    sizes = np.sqrt(power)
    sizes[0] = 0.0
    return set(np.flatnonzero(largest(sizes, NEGLECTED * float(np.linalg.norm(sizes)))).tolist()) - {0}
