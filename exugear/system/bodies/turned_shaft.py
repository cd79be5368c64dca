"""Turned shafts reduced to seats and modal coordinates."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from exugear.gearbox.versions import REDUCTION
from exugear.system.bodies.reduction import (
    TILT_X,
    TILT_Y,
    UX,
    UY,
    UZ,
    Blank,
    BodySurface,
    ReducedBody,
    ReducedComponent,
    ReductionError,
    ReductionSummary,
    Seat,
    load_or_reduce,
    reduce_component,
    selective_mass_scaling,
    symmetric,
)
from exugear.system.bodies.shaft_sections import STANDARD_SIZE, MeshSize, SeatBand, ShaftSection
from exugear.system.bodies.turned_section import HarmonicName, Shaft
from exugear.system.kernels.coordinates import SPIN
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix

HARMONICS: tuple[HarmonicName, ...] = ("bending", "torsion", "stretching")
ANGLES = 24
"""Faces around a shaft in pictures."""


@dataclass(frozen=True)
class ShaftModel:
    """All that a reduced shaft depends on."""

    name: str
    sections: tuple[ShaftSection, ...]
    """From the beginning at `origin` on."""
    material: Material
    origin: tuple[float, float, float]
    """(3,) beginning of the shaft in the gearbox's coordinates, m."""
    seats: tuple[SeatBand, ...]
    """Bands, z from the beginning of the shaft."""
    blanks: Mapping[str, Blank]
    """Seat name -> rigid ring on it."""
    band: float
    """free-interface normal modes up to here are exact, Hz."""
    limit: float
    """Modes of the reduced shaft above this are brought down to it by mass scaling, Hz."""
    size: MeshSize = STANDARD_SIZE
    """Element sizes."""

    @property
    def key(self) -> str:
        """SHA-256 of these inputs and of the version of the method that reduces them."""
        inputs = asdict(self, dict_factory=_without_ends_of_cylinders)
        text = json.dumps({"method_version": REDUCTION, **inputs}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _without_ends_of_cylinders(items: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return inputs as they were before there were cones, so that what is stored of cylinders keeps its hash."""
    return {key: value for key, value in items if value is not None or not key.endswith("_diameter_end")}


def reduce_shaft(model: ShaftModel) -> ReducedBody:
    """Reduce a shaft.

    Raises
    ------
    exugear.system.bodies.shaft_sections.ShaftError
        A shaft that cannot be, or a seat that does not lie on it.
    ReductionError
        A blank without its seat, or too few seats.
    """
    began = time.perf_counter()
    seats = [seat.name for seat in model.seats]
    for blank in model.blanks:
        if blank not in seats:
            raise ReductionError(f"shaft {model.name}: blank on {blank!r}, but the seats are {', '.join(seats)}")
    shaft = Shaft(model.sections, model.material, model.seats, model.size)
    harmonics = {name: shaft.harmonic(name) for name in HARMONICS}
    components: dict[HarmonicName, ReducedComponent] = {}
    mass_scaled: dict[str, tuple[float, ...]] = {}
    for name, h in harmonics.items():
        component = reduce_component(h.mass, h.stiffness, h.seats, h.rigid, _blank_masses(model, name), model.band)
        mass, mass_scaled[name] = selective_mass_scaling(component.mass, component.stiffness, model.limit)
        components[name] = replace(component, mass=mass)
    layout = _HarmonicLayout(len(seats), {name: c.component_modes.shape[1] for name, c in components.items()})
    # Polar inertia 2 g of one bending plane, blanks included; half of it is what a rigid tilt has of 2 g.
    polar: SparseMatrix = harmonics["bending"].gyroscopic
    modes = components["bending"].component_modes
    doubled: Floats = 2.0 * modes.T @ (polar @ modes)
    for n, seat in enumerate(model.seats):
        if seat.name in model.blanks:
            tilt = 2 * n + 1  # a seat has a displacement and a tilt in each plane
            doubled[tilt, tilt] += model.blanks[seat.name].axial
    gyroscopic = symmetric(doubled)
    spin = np.zeros(layout.size)
    spin[SPIN : 6 * len(seats) : 6] = 1.0
    x, y, z = model.origin
    # 2 g of one plane: M qx'' + 2 Omega g qy' and M qy'' - 2 Omega g qx'.
    matrix = np.zeros((layout.size, layout.size))
    matrix[np.ix_(layout.x, layout.y)] = gyroscopic * layout.sign_y
    matrix[np.ix_(layout.y, layout.x)] = -(gyroscopic * layout.sign_y).T
    return ReducedBody(
        name=model.name,
        seats=tuple(Seat(seat.name, (x, y, z + seat.z)) for seat in model.seats),
        mass=layout.gather({name: component.mass for name, component in components.items()}),
        stiffness=layout.gather({name: component.stiffness for name, component in components.items()}),
        gyroscopic=matrix,
        spin=spin,
        frame="nonrotating",
        modal_groups=layout.modal_groups,
        surface=_surface(shaft, model.origin, components, layout),
        summary=ReductionSummary(
            unknowns={name: h.mass.shape[0] for name, h in harmonics.items()},
            seconds=time.perf_counter() - began,
            free_interface_frequencies={name: component.frequencies for name, component in components.items()},
            mass_scaled_frequencies=mass_scaled,
        ),
    )


def load_or_reduce_shaft(model: ShaftModel, folder: Path) -> ReducedBody:
    """Return the reduced shaft from a folder if stored for exactly these inputs; otherwise reduce and store it."""
    return load_or_reduce(folder / f"{model.name}-{model.key[:16]}.npz", model.key, lambda: reduce_shaft(model))


def _blank_masses(model: ShaftModel, harmonic: HarmonicName) -> Floats:
    """Rigid masses of the blanks on the seat coordinates of one harmonic."""
    no_blank = Blank(0.0, 0.0, 0.0)
    values: list[float] = []
    for seat in model.seats:
        blank = model.blanks.get(seat.name, no_blank)
        values += {
            "bending": [blank.mass, blank.transverse],
            "torsion": [blank.axial],
            "stretching": [blank.mass],
        }[harmonic]
    return np.diag(values)


class _HarmonicLayout:
    """Indices of the coordinates of each harmonic among those of the body."""

    def __init__(self, seats: int, sizes: Mapping[HarmonicName, int]) -> None:
        seat_starts = 6 * np.arange(seats)
        used = 6 * seats
        bending = sizes["bending"] - 2 * seats
        torsion = sizes["torsion"] - seats
        stretching = sizes["stretching"] - seats

        def following(count: int) -> Integers:
            """Take the next modal coordinates."""
            nonlocal used
            used += count
            return np.arange(used - count, used)

        x_plane = np.stack([seat_starts + UX, seat_starts + TILT_Y], axis=1).ravel()
        y_plane = np.stack([seat_starts + UY, seat_starts + TILT_X], axis=1).ravel()
        self.x = np.concatenate([x_plane, following(bending)])
        self.y = np.concatenate([y_plane, following(bending)])
        self.torsion = np.concatenate([seat_starts + SPIN, following(torsion)])
        self.stretching = np.concatenate([seat_starts + UZ, following(stretching)])
        self.size = used
        # A tilt about +x moves what lies at +z towards -y: in the y plane the tilt counts negative.
        self.sign_y = np.where(np.isin(self.y, seat_starts + TILT_X), -1.0, 1.0)
        self.modal_groups = (
            *["bending x"] * bending,
            *["bending y"] * bending,
            *["torsion"] * torsion,
            *["stretching"] * stretching,
        )

    def planes(self, harmonic: HarmonicName) -> list[tuple[Integers, Floats]]:
        """Coordinates of a harmonic and their signs; two planes for bending."""
        if harmonic == "bending":
            return [(self.x, np.ones(len(self.x))), (self.y, self.sign_y)]
        index = self.torsion if harmonic == "torsion" else self.stretching
        return [(index, np.ones(len(index)))]

    def gather(self, parts: Mapping[HarmonicName, Floats]) -> Floats:
        """Matrix of the body from those of the harmonics."""
        matrix = np.zeros((self.size, self.size))
        for harmonic, part in parts.items():
            for index, sign in self.planes(harmonic):
                matrix[np.ix_(index, index)] = part * np.outer(sign, sign)
        return matrix


def _surface(
    shaft: Shaft,
    origin: tuple[float, float, float],
    components: Mapping[HarmonicName, ReducedComponent],
    layout: _HarmonicLayout,
) -> BodySurface:
    """Turn the outline of the half-section into a surface with displacement and strain per coordinate."""
    outline = shaft.outline()
    angle = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    points = np.stack(
        [np.outer(np.cos(angle), outline.r), np.outer(np.sin(angle), outline.r), np.outer(angle * 0 + 1, outline.z)], 2
    )
    count = len(outline.r)
    edges = len(outline.edges)
    around = (np.arange(ANGLES)[:, None] + np.array([0, 1])) % ANGLES * count
    corners = [around[:, :1] + outline.edges[:, 0], around[:, :1] + outline.edges[:, 1]]
    corners += [around[:, 1:] + outline.edges[:, 1], around[:, 1:] + outline.edges[:, 0]]
    displacement = np.zeros((ANGLES, count, 3, layout.size), dtype=np.float32)
    strain = np.zeros((ANGLES, edges, 6, layout.size), dtype=np.float32)
    c = np.cos(angle)[:, None, None]
    s = np.sin(angle)[:, None, None]
    for harmonic, component in components.items():
        moved = shaft.displacement(harmonic, outline.nodes, component.component_modes)
        strained = shaft.strain_at_edges(harmonic, outline.elements, component.component_modes)
        for plane, (index, sign) in enumerate(layout.planes(harmonic)):
            # The y plane is the x plane a quarter turn on.
            weights, face_weights = _around(harmonic, angle - plane * np.pi / 2.0)
            u_r, u_phi, u_z = np.moveaxis(weights[:, None, :, None] * moved * sign, 2, 0)
            displacement[..., index] = np.stack([u_r * c - u_phi * s, u_r * s + u_phi * c, u_z], axis=2)
            strain[..., index] = face_weights[:, None, :, None] * strained * sign
    return BodySurface(
        points=points.reshape(-1, 3) + np.array(origin),
        quads=np.stack(corners, axis=2).reshape(-1, 4).astype(np.int64),
        displacement=displacement.reshape(-1, 3, layout.size),
        strain=strain.reshape(-1, 6, layout.size),
        elasticity=shaft.elasticity,
    )


def _around(harmonic: HarmonicName, angle: Floats) -> tuple[Floats, Floats]:
    """How displacements (a, 3) at angles and strains (a, 6) between two angles vary around the axis."""
    if harmonic != "bending":
        return np.ones((len(angle), 3)), np.ones((len(angle), 6))
    face = angle + np.pi / ANGLES
    c = np.cos(angle)
    s = np.sin(angle)
    cf = np.cos(face)
    sf = np.sin(face)
    return np.stack([c, s, c], 1), np.stack([cf, cf, cf, cf, sf, sf], 1)
