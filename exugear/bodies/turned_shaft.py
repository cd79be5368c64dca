"""Turned shafts reduced to seats and modal coordinates."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exugear.bodies.reduced_body import Blank, Figures, ReducedBody, ReductionError, Seat, Surface
from exugear.bodies.reduction import ReducedPart, lowered, reduce_part, symmetric
from exugear.bodies.store import kept
from exugear.bodies.turned_section import STANDARD_SIZE, Harmonic, MeshSize, Motion, SeatBand, Shaft, ShaftSection
from exugear.model.versions import REDUCTION
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, SparseMatrix

MOTIONS: tuple[Motion, ...] = ("bending", "torsion", "stretching")


@dataclass(frozen=True)
class ShaftModel:
    """All that a reduced shaft depends on.

    Attributes
    ----------
    name : str
    sections : from the beginning at `origin` on
    material : Material
    origin : (3,) beginning of the shaft in the gearbox's coordinates, m
    seats : bands, z from the beginning of the shaft
    blanks : seat name -> rigid ring on it
    band : vibrations up to here are exact, Hz
    limit : vibrations of the reduced shaft above this are slowed down to it, Hz
    size : element sizes
    """

    name: str
    sections: tuple[ShaftSection, ...]
    material: Material
    origin: tuple[float, float, float]
    seats: tuple[SeatBand, ...]
    blanks: Mapping[str, Blank]
    band: float
    limit: float
    size: MeshSize = STANDARD_SIZE

    @property
    def key(self) -> str:
        """SHA-256 of these inputs and of the version of the method that reduces them."""
        text = json.dumps({"method_version": REDUCTION, **asdict(self)}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def reduce_shaft(model: ShaftModel) -> ReducedBody:
    """Reduce a shaft.

    Raises
    ------
    exugear.bodies.turned_section.ShaftError
        A shaft that cannot be, or a seat that does not lie on it.
    ReductionError
        A blank without its seat, or too few seats.
    """
    began = time.perf_counter()
    names = [seat.name for seat in model.seats]
    for name in model.blanks:
        if name not in names:
            raise ReductionError(f"shaft {model.name}: blank on {name!r}, but the seats are {', '.join(names)}")
    shaft = Shaft(model.sections, model.material, model.seats, model.size)
    harmonics = {motion: shaft.harmonic(motion) for motion in MOTIONS}
    parts: dict[Motion, ReducedPart] = {}
    slowed: dict[str, tuple[float, ...]] = {}
    for motion, h in harmonics.items():
        part = reduce_part(h.mass, h.stiffness, h.seats, h.rigid, _blank_masses(model, motion), model.band)
        mass, slowed[motion] = lowered(part.mass, part.stiffness, model.limit)
        parts[motion] = replace(part, mass=mass)
    layout = _Layout(len(names), {motion: part.shapes.shape[1] for motion, part in parts.items()})
    gyroscopic = _gyroscopic(model, harmonics["bending"], parts["bending"])
    spin = np.zeros(layout.size)
    spin[5 : 6 * len(names) : 6] = 1.0
    x, y, z = model.origin
    return ReducedBody(
        name=model.name,
        seats=tuple(Seat(seat.name, (x, y, z + seat.z)) for seat in model.seats),
        mass=layout.gather({motion: part.mass for motion, part in parts.items()}),
        stiffness=layout.gather({motion: part.stiffness for motion, part in parts.items()}),
        gyroscopic=layout.across(gyroscopic),
        spin=spin,
        frame="nonrotating",
        groups=layout.groups,
        surface=_surface(shaft, model.origin, parts, layout),
        figures=Figures(
            unknowns={motion: h.mass.shape[0] for motion, h in harmonics.items()},
            seconds=time.perf_counter() - began,
            free_frequencies={motion: part.frequencies for motion, part in parts.items()},
            lowered=slowed,
        ),
    )


def load_or_reduce(model: ShaftModel, folder: Path) -> ReducedBody:
    """Reduced shaft from a folder if it is there for exactly these inputs, else reduced and kept there."""
    return kept(folder / f"{model.name}-{model.key[:16]}.npz", model.key, lambda: reduce_shaft(model))


def _blank_masses(model: ShaftModel, motion: Motion) -> Floats:
    """Rigid masses of the blanks on the seat coordinates of one harmonic."""
    nothing = Blank(0.0, 0.0, 0.0)
    values: list[float] = []
    for seat in model.seats:
        blank = model.blanks.get(seat.name, nothing)
        values += {
            "bending": [blank.mass, blank.transverse],
            "torsion": [blank.axial],
            "stretching": [blank.mass],
        }[motion]
    return np.diag(values)


def _gyroscopic(model: ShaftModel, bending: Harmonic, part: ReducedPart) -> Floats:
    """Polar inertia 2 g of one bending plane, blanks included; half of it is what a rigid tilt has of 2 g."""
    gyroscopic: SparseMatrix = bending.gyroscopic
    doubled: Floats = 2.0 * part.shapes.T @ (gyroscopic @ part.shapes)
    for n, seat in enumerate(model.seats):
        if seat.name in model.blanks:
            doubled[2 * n + 1, 2 * n + 1] += model.blanks[seat.name].axial
    return symmetric(doubled)


class _Layout:
    """Where the coordinates of each harmonic stand among those of the body."""

    def __init__(self, seats: int, sizes: Mapping[Motion, int]) -> None:
        first = 6 * np.arange(seats)
        inner = 6 * seats
        amplitudes = sizes["bending"] - 2 * seats

        def following(count: int) -> NDArray[np.int64]:
            nonlocal inner
            inner += count
            return np.arange(inner - count, inner)

        pairs = np.stack([first, first + 4], axis=1).ravel(), np.stack([first + 1, first + 3], axis=1).ravel()
        self.x = np.concatenate([pairs[0], following(amplitudes)])
        self.y = np.concatenate([pairs[1], following(amplitudes)])
        self.torsion = np.concatenate([first + 5, following(sizes["torsion"] - seats)])
        self.stretching = np.concatenate([first + 2, following(sizes["stretching"] - seats)])
        self.size = inner
        # A tilt about +x moves what lies at +z towards -y: in the y plane the tilt counts negative.
        self.sign_y = np.where(np.isin(self.y, first + 3), -1.0, 1.0)
        self.groups = (
            *["bending x"] * amplitudes,
            *["bending y"] * amplitudes,
            *["torsion"] * (sizes["torsion"] - seats),
            *["stretching"] * (sizes["stretching"] - seats),
        )

    def planes(self, motion: Motion) -> list[tuple[NDArray[np.int64], Floats]]:
        """Coordinates of a harmonic and their signs; two planes for bending."""
        if motion == "bending":
            return [(self.x, np.ones(len(self.x))), (self.y, self.sign_y)]
        index = self.torsion if motion == "torsion" else self.stretching
        return [(index, np.ones(len(index)))]

    def gather(self, parts: Mapping[Motion, Floats]) -> Floats:
        """Matrix of the body from those of the harmonics."""
        matrix = np.zeros((self.size, self.size))
        for motion, part in parts.items():
            for index, sign in self.planes(motion):
                matrix[np.ix_(index, index)] = part * np.outer(sign, sign)
        return matrix

    def across(self, doubled: Floats) -> Floats:
        """Gyroscopic matrix from 2 g of one plane: M qx'' + 2 Omega g qy' and M qy'' - 2 Omega g qx'."""
        matrix = np.zeros((self.size, self.size))
        matrix[np.ix_(self.x, self.y)] = doubled * self.sign_y
        matrix[np.ix_(self.y, self.x)] = -(doubled * self.sign_y).T
        return matrix


ANGLES = 24
"""Faces around a shaft in pictures."""


def _surface(
    shaft: Shaft, origin: tuple[float, float, float], parts: Mapping[Motion, ReducedPart], layout: _Layout
) -> Surface:
    """Turn the outline of the half-section into a surface with displacement and strain per coordinate."""
    outline = shaft.outline()
    angle = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    points = np.stack(
        [np.outer(np.cos(angle), outline.r), np.outer(np.sin(angle), outline.r), np.outer(angle * 0 + 1, outline.z)], 2
    )
    count, edges = len(outline.r), len(outline.edges)
    around = (np.arange(ANGLES)[:, None] + np.array([0, 1])) % ANGLES * count
    corners = [around[:, :1] + outline.edges[:, 0], around[:, :1] + outline.edges[:, 1]]
    corners += [around[:, 1:] + outline.edges[:, 1], around[:, 1:] + outline.edges[:, 0]]
    displacement = np.zeros((ANGLES, count, 3, layout.size), dtype=np.float32)
    strain = np.zeros((ANGLES, edges, 6, layout.size), dtype=np.float32)
    for motion, part in parts.items():
        moved = shaft.displacement(motion, outline.nodes, part.shapes)
        strained = shaft.strain_at_edges(motion, outline.elements, part.shapes)
        for plane, (index, sign) in enumerate(layout.planes(motion)):
            turned = angle - plane * np.pi / 2.0
            face = turned + np.pi / ANGLES
            if motion == "bending":
                c, s, cf, sf = np.cos(turned), np.sin(turned), np.cos(face), np.sin(face)
                weights, face_weights = np.stack([c, s, c], 1), np.stack([cf, cf, cf, cf, sf, sf], 1)
            else:
                weights, face_weights = np.ones((ANGLES, 3)), np.ones((ANGLES, 6))
            u_r, u_phi, u_z = np.moveaxis(weights[:, None, :, None] * moved * sign, 2, 0)
            c, s = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
            displacement[..., index] = np.stack([u_r * c - u_phi * s, u_r * s + u_phi * c, u_z], axis=2)
            strain[..., index] = face_weights[:, None, :, None] * strained * sign
    return Surface(
        points=points.reshape(-1, 3) + np.array(origin),
        quads=np.stack(corners, axis=2).reshape(-1, 4).astype(np.int64),
        displacement=displacement.reshape(-1, 3, layout.size),
        strain=strain.reshape(-1, 6, layout.size),
        elasticity=shaft.elasticity,
    )
