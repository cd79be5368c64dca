"""Flexible bodies of any shape: solid finite elements, reduced to seats and a few modal coordinates.

A body is reduced free of all supports; a housing is held by supports on its seats. The reference frame of its
coordinates determines the gyroscopic matrix:

nonrotating
    A rotating body of revolution in a non-rotating frame: G = C' - C'^T with C' = int rho N (x d_y - y d_x) N, as
    for turned shafts (`exugear.system.bodies.turned_section`).
carrier
    A body in its own rotating frame: the constant Coriolis matrix, 2 int rho phi_i . (e_z x phi_j). Centrifugal
    stiffening and softening are both neglected; at the speed of a planet carrier both are far below its stiffness.
ground
    A body that does not rotate: none.

In a floating frame, all elastic normal modes of the reduced solid are retained, so that static deflections are those
of the reduced body; mass scaling lowers the frequencies above the limit to this limit. The body is described by the
integrals int rho f_a g_b of its position and its modes f, g; rigid rings on seats (blanks) are added.

For a body of revolution a rotation by psi transforms the modes by exp(psi S), with eigenvalues of S at whole numbers: 0
for torsion and stretching, 1 for bending.

This module is independent of the solver; Exudyn's floating frame is in `exugear.transient.exudyn_model.floating`.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from exugear.gearbox.versions import REDUCTION
from exugear.system.bodies.elastic_body import FloatingBody, skew
from exugear.system.bodies.lazy import lazy_import
from exugear.system.bodies.outer_surface import radiating_surface
from exugear.system.bodies.reduction import (
    ELASTIC,
    Blank,
    BodySurface,
    Frame,
    ReducedBody,
    ReducedComponent,
    ReductionError,
    ReductionSummary,
    RigidInertia,
    Seat,
    check_revolution,
    load_or_reduce,
    reduce_component,
    rigid_gyroscopic_matrix,
    selective_mass_scaling,
)
from exugear.system.bodies.solid_elements import (
    Solid,
    SolidSeat,
    assemble,
    expand_to_directions,
    ordered_corners,
    seat_rows,
    shape_gradients,
)
from exugear.system.bodies.solid_files import SolidFile
from exugear.system.kernels.coordinates import SPIN
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats
from fe_ste.tools.stores import Store

if TYPE_CHECKING:
    import skfem

    from fe_ste.elimination import Backend
else:
    skfem = lazy_import("skfem")


@dataclass(frozen=True)
class SolidModel:
    """Complete input of the reduction of a solid."""

    name: str
    mesh: Any
    """skfem.MeshTet2 or skfem.MeshHex2, in the gearbox's coordinates, m; or the file that contains it."""
    material: Material
    seats: tuple[SolidSeat, ...]
    """Seats, at which other elements connect."""
    frame: Frame
    """Reference frame of the coordinates."""
    band: float
    """Cut-off frequency up to which free-interface normal modes are exact, Hz."""
    limit: float
    """Limit to which mass scaling lowers higher mode frequencies of the reduced body, Hz."""
    blanks: Mapping[str, Blank] = field(default_factory=dict)
    """Rigid rings by the name of their seat."""
    axis: tuple[float, float] = (0.0, 0.0)
    """(x, y) of the axis of rotation, parallel to z, m."""

    @property
    def key(self) -> str:
        """SHA-256 of these inputs and of the version of the method that reduces them."""
        words = {
            "material": asdict(self.material),
            "seats": [asdict(seat) for seat in self.seats],
            "blanks": {name: asdict(blank) for name, blank in self.blanks.items()},
            "method_version": REDUCTION,
            "rest": [self.name, self.frame, self.band, self.limit, self.axis],
        }
        if isinstance(self.mesh, SolidFile):
            shape = [self.mesh.digest]
        else:
            shape = [np.ascontiguousarray(a).tobytes() for a in (self.mesh.doflocs, self.mesh.t)]
        return hashlib.sha256(b"".join([json.dumps(words, sort_keys=True).encode(), *shape])).hexdigest()

    @property
    def elements(self) -> Any:
        """The mesh itself, read from its file if necessary."""
        return self.mesh.mesh if isinstance(self.mesh, SolidFile) else self.mesh


@dataclass(frozen=True)
class ReducedSolid:
    """Matrices of a solid and their reduction, before parts of them are discarded."""

    solid: Solid
    """The complete finite-element model."""
    component: ReducedComponent
    """Reduced model with component modes (3 n, coordinates)."""
    seconds: float
    """Wall-clock time of the reduction, s."""


def reduce_matrices(model: SolidModel, backend: Backend | None = None) -> ReducedSolid:
    """Assemble a solid and reduce its matrices, from which `reduce_solid` makes a body.

    Raises
    ------
    SolidError, ReductionError
        As in `reduce_solid`.
    """
    began = time.perf_counter()
    seats = [seat.name for seat in model.seats]
    for name in model.blanks:
        if name not in seats:
            raise ReductionError(f"body {model.name}: blank on {name!r}, but the seats are {', '.join(seats)}")
    solid = assemble(model.elements, model.material, model.axis)
    blanks = [model.blanks.get(seat, Blank(0.0, 0.0, 0.0)) for seat in seats]
    masses = np.diag([m for b in blanks for m in (*[b.mass] * 3, b.transverse, b.transverse, b.axial)])
    component = reduce_component(
        solid.mass,
        solid.stiffness,
        seat_rows(solid, model.seats),
        solid.rigid_motions((*model.axis, 0.0)),
        masses,
        model.band,
        backend,
    )
    return ReducedSolid(solid, component, time.perf_counter() - began)


def reduce_solid(model: SolidModel, backend: Backend | None = None) -> ReducedBody:
    """Reduce a solid to its seats and a few modal coordinates.

    Parameters
    ----------
    backend : {"pardiso", "superlu"}, optional
        Library for factorisation; by default the fastest one that is installed.

    Raises
    ------
    SolidError
        A seat has no faces, or two seats share some.
    ReductionError
        A blank has no seat, there are too few seats, or a body in the frame "nonrotating" is not a body of revolution.
    """
    return reduced_body(model, reduce_matrices(model, backend))


def reduced_body(model: SolidModel, reduced: ReducedSolid) -> ReducedBody:
    """Reduced body from a solid's matrices; errors as in `reduce_solid`."""
    began = time.perf_counter()
    component = reduced.component
    size = reduced.component.component_modes.shape[1]
    mass, mass_scaled = selective_mass_scaling(component.mass, component.stiffness, model.limit)
    spin = np.zeros(size)
    for number, seat in enumerate(model.seats if model.frame != "ground" else ()):
        x, y = np.array(seat.centre[:2]) - model.axis
        spin[6 * number : 6 * number + 6] = [-y, x, 0.0, 0.0, 0.0, 1.0]
    return ReducedBody(
        name=model.name,
        seats=tuple(Seat(seat.name, seat.centre) for seat in model.seats),
        mass=mass,
        stiffness=component.stiffness,
        gyroscopic=gyroscopic_matrix(model, reduced),
        spin=spin,
        frame=model.frame,
        modal_groups=("inner",) * (size - 6 * len(model.seats)),
        surface=_surface(model, reduced),
        summary=ReductionSummary(
            unknowns={"whole": 3 * len(reduced.solid.nodes)},
            seconds=reduced.seconds + time.perf_counter() - began,
            free_interface_frequencies={"whole": component.frequencies},
            mass_scaled_frequencies={"whole": mass_scaled},
        ),
        radiating=(
            radiating_surface(reduced.solid.mesh, model.seats, component.component_modes, model.band)
            if model.frame == "ground"
            else None
        ),
    )


def reduction_file(model: SolidModel, folder: Path) -> Path:
    """Path of a solid's reduction in the folder where reductions are stored."""
    return folder / f"{model.name}-{model.key[:16]}.npz"


def load_or_reduce_solid(model: SolidModel, folder: Path) -> ReducedBody:
    """Return the reduced solid from a folder if stored for exactly these inputs; otherwise reduce and store it."""
    return load_or_reduce(reduction_file(model, folder), model.key, lambda: reduce_solid(model))


def gyroscopic_matrix(model: SolidModel, reduced: ReducedSolid) -> Floats:
    """Antisymmetric G of M q'' + Omega G q' + K q = f in the body's frame, (n, n).

    Raises
    ------
    ReductionError
        A body in the frame "nonrotating" is not a body of revolution.
    """
    modes = reduced.component.component_modes
    size = reduced.component.component_modes.shape[1]
    matrix = np.zeros((size, size))
    if model.frame == "nonrotating":
        check_revolution(
            model.name,
            [seat.centre for seat in model.seats],
            model.axis,
            reduced.component.mass,
            reduced.component.stiffness,
        )
        scalar = expand_to_directions(reduced.solid.convection - reduced.solid.convection.T)
        matrix = modes.T @ (scalar @ modes)
    elif model.frame == "carrier":
        by_node = modes.reshape(-1, 3, size)
        across = np.stack([-by_node[:, 1], by_node[:, 0], np.zeros_like(by_node[:, 0])], axis=1).reshape(-1, size)
        matrix = 2.0 * modes.T @ (reduced.solid.mass @ across)
    for number, seat in enumerate(model.seats):
        if seat.name in model.blanks:
            at_seat = slice(6 * number, 6 * number + 6)
            # A rigid ring has int rho x^2 = int rho y^2 = axial / 2 and int rho z^2 = transverse - axial / 2.
            blank = model.blanks[seat.name]
            matrix[at_seat, at_seat] += rigid_gyroscopic_matrix(
                RigidInertia(blank.mass, (0.0, 0.0, 0.0), blank.transverse, blank.axial), model.frame
            )
    if model.frame == "nonrotating":
        spin = np.zeros(size)
        spin[SPIN : 6 * len(model.seats) : 6] = 1.0
        momentum = reduced.component.mass @ spin
        # The steady rotation itself would have Coriolis forces of twice the centrifugal force; only deformation has any
        # here.
        deforming = np.eye(size) - np.outer(spin, momentum) / (spin @ momentum)
        matrix = deforming.T @ matrix @ deforming
    return 0.5 * (matrix - matrix.T)


def _surface(model: SolidModel, reduced: ReducedSolid) -> BodySurface:
    """Boundary of the mesh with displacement, and strain at the centre of the adjacent element, per coordinate."""
    mesh = reduced.solid.mesh
    modes = reduced.component.component_modes
    facets = np.asarray(mesh.boundary_facets())
    corners = ordered_corners(mesh, facets)
    nodes, faces = np.unique(corners, return_inverse=True)
    dofs = np.asarray(skfem.assembly.Dofs(mesh, mesh.elem()).element_dofs).T[np.asarray(mesh.f2t)[0, facets]]
    middle = np.full((3, 1), 0.25 if mesh.t.shape[0] == 4 else 0.5)
    functions = [mesh.elem().lbasis(middle, number) for number in range(dofs.shape[1])]
    values, local = (np.stack(part) for part in zip(*functions, strict=True))
    slopes = shape_gradients(np.asarray(mesh.doflocs).T[dofs], values[:, None, :], local, np.ones(1))[2][..., 0]
    by_node = modes.reshape(-1, 3, modes.shape[1])
    gradient = np.zeros((len(facets), 3, 3, modes.shape[1]))  # displacement component by direction
    for function, slope in zip(dofs.T, slopes, strict=True):
        gradient += by_node[function][:, :, None, :] * slope.T[:, None, :, None]
    strain = [gradient[:, i, i] for i in range(3)]
    strain += [gradient[:, i, j] + gradient[:, j, i] for i, j in ((0, 2), (0, 1), (1, 2))]
    modulus = model.material.youngs_modulus
    ratio = model.material.poissons_ratio
    shear = modulus / (2.0 * (1.0 + ratio))
    elasticity = np.diag([2.0 * shear] * 3 + [shear] * 3)
    elasticity[:3, :3] += modulus * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
    return BodySurface(
        points=np.asarray(mesh.doflocs)[:, nodes].T,
        quads=faces.reshape(corners.shape).astype(np.int64),
        displacement=by_node[nodes].astype(np.float32),
        strain=np.stack(strain, axis=1).astype(np.float32),
        elasticity=elasticity,
    )


def floating_body(model: SolidModel, matrices: ReducedSolid | None = None) -> FloatingBody:
    """Modes of a solid in its own frame, and its mass integrals; from its reduced matrices if they are available."""
    reduced = matrices or reduce_matrices(model)
    solid = reduced.solid
    component = reduced.component
    values, vectors = scipy.linalg.eigh(component.stiffness, component.mass)
    values = values[ELASTIC]
    by_mode = vectors[:, ELASTIC]
    modes = component.component_modes @ by_mode
    node_mass = np.asarray(solid.scalar_mass.sum(axis=0)).ravel()
    rings = [(n, model.blanks[seat.name]) for n, seat in enumerate(model.seats) if seat.name in model.blanks]
    places = np.array([seat.centre for seat in model.seats])
    mass = node_mass.sum() + sum(ring.mass for _, ring in rings)
    centre = (node_mass @ solid.nodes + sum(ring.mass * places[n] for n, ring in rings)) / mass
    # Position relative to the centre, and modes, as fields over the nodes.
    fields_at_nodes = np.concatenate([(solid.nodes - centre)[:, :, None], modes.reshape(-1, 3, len(values))], axis=2)
    count = fields_at_nodes.shape[2]
    flat = fields_at_nodes.reshape(len(fields_at_nodes), -1)
    moments = (flat.T @ (solid.scalar_mass @ flat)).reshape(3, count, 3, count).transpose(0, 2, 1, 3)
    first_moments = (node_mass @ flat).reshape(3, count)
    tension = modes.T @ (expand_to_directions(solid.convection_square) @ modes)
    convection = modes.T @ (expand_to_directions(solid.convection) @ modes)
    for n, ring in rings:
        moved = by_mode[6 * n : 6 * n + 3]
        turns = by_mode[6 * n + 3 : 6 * n + 6]
        field = np.zeros((3, 4, count))  # for 1, x, y, z from the centre of the seat
        field[:, 0, 0], field[:, 1:, 0] = places[n] - centre, np.eye(3)
        field[:, 0, 1:] = moved
        field[:, 1:, 1:] = skew(turns.T).transpose(1, 2, 0)
        square = np.array([ring.mass, ring.axial / 2, ring.axial / 2, ring.transverse - ring.axial / 2])
        moments += np.einsum("acf,c,bcg->abfg", field, square, field)
        first_moments += ring.mass * field[:, 0]
        tension += turns.T @ (np.array([0.5, 0.5, 1.0])[:, None] * ring.axial * turns)
        across = ring.axial / 2 * np.outer(turns[0], turns[1])
        convection += across - across.T
    of_modes = moments[:, :, 1:, 1:]
    turning = of_modes[1, 0] - of_modes[0, 1] - convection
    return FloatingBody(
        name=model.name,
        seats=tuple(seat.name for seat in model.seats),
        places=places,
        centre=centre,
        mass=float(mass),
        mode_coordinates=by_mode,
        stiffness=values,
        added_mass=np.maximum(values / (2.0 * np.pi * model.limit) ** 2, 1.0) - 1.0,
        first_moments=first_moments,
        second_moments=moments,
        centrifugal_tension=0.5 * (tension + tension.T),
        turning=0.5 * (turning - turning.T),
    )


def with_inertia(body: FloatingBody, wanted: RigidInertia) -> FloatingBody:
    """Adjust a body to the rigid inertia of another model, as `system.bodies.reduction.with_rigid_inertia` does.

    The added or missing inertia moves with the frame, that is with the rigid part of the motion.
    """
    offset = np.array(wanted.centre) - body.centre
    square = np.diag([wanted.axial / 2, wanted.axial / 2, wanted.transverse - wanted.axial / 2])
    second_moments = body.second_moments.copy()
    first_moments = body.first_moments.copy()
    second_moments[:, :, 0, 0] = square + wanted.mass * np.outer(offset, offset)
    first_moments[:, 0] = wanted.mass * offset
    return replace(body, mass=wanted.mass, second_moments=second_moments, first_moments=first_moments)


def load_or_reduce_floating(model: SolidModel, folder: Path | None) -> tuple[ReducedBody, FloatingBody]:
    """Return both descriptions of a solid of revolution, from a folder if stored for exactly these inputs.

    Missing ones are reduced and stored.

    Raises
    ------
    exugear.system.bodies.solid_elements.SolidError, ReductionError
        As in `reduce_solid`.
    """
    matrices = cache(lambda: reduce_matrices(model))
    if folder is None:
        return reduced_body(model, matrices()), floating_body(model, matrices())
    name = f"{model.name}-{model.key[:16]}"
    reduced = load_or_reduce(folder / f"{name}.npz", model.key, lambda: reduced_body(model, matrices()))
    store = Store(folder / f"{name}-floating.npz", model.key)
    body = store.read(_from_arrays)
    if body is None:
        body = floating_body(model, matrices())
        store.write({stored: getattr(body, name) for stored, name in _STORED.items()}, compressed=True)
    return reduced, body


_STORED = {
    "name": "name",
    "seats": "seats",
    "places": "places",
    "centre": "centre",
    "mass": "mass",
    "coordinates": "mode_coordinates",
    "stiffness": "stiffness",
    "slowing": "added_mass",
    "first": "first_moments",
    "moments": "second_moments",
    "stretching": "centrifugal_tension",
    "turning": "turning",
}
"""Names in files, which are kept so that existing files remain readable, and in `FloatingBody`."""


def _from_arrays(arrays: Mapping[str, NDArray[Any]]) -> FloatingBody:
    values: dict[str, Any] = {name: arrays[stored] for stored, name in _STORED.items()}
    values |= {"name": str(values["name"]), "mass": float(values["mass"]), "seats": tuple(values["seats"].tolist())}
    return FloatingBody(**values)
