"""Elastic bodies of any shape: solid finite elements, reduced to seats and a few modal coordinates.

A body is reduced free of all supports; what holds a housing are supports on its seats. The frame its coordinates are
seen from decides on the gyroscopic matrix:

nonrotating
    A body of revolution that turns inside a frame that does not: G = C' - C'^T with C' = int rho N (x d_y - y d_x) N,
    as for turned shafts (`exugear.system.bodies.finite_elements.turned_section`).
carrier
    A body seen from its own turning frame: the constant Coriolis matrix, 2 int rho phi_i . (e_z x phi_j). Centrifugal
    stiffness and softening are left out together; at the speed of a planet carrier both are far below its stiffness.
ground
    A body that does not turn: none.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.versions import REDUCTION
from exugear.system.bodies.finite_elements.lazy import at_first_use
from exugear.system.bodies.finite_elements.solid_facets import ordered_corners
from exugear.system.bodies.finite_elements.solid_files import SolidFile
from exugear.system.bodies.finite_elements.solid_matrices import (
    Solid,
    assemble,
    in_each_direction,
    shape_gradients,
)
from exugear.system.bodies.finite_elements.solid_seats import SolidSeat, seat_rows
from exugear.system.bodies.reduced_body import (
    Blank,
    Frame,
    ReducedBody,
    ReductionError,
    ReductionSummary,
    RigidInertia,
    Seat,
    Surface,
)
from exugear.system.bodies.reduction import (
    ReducedComponent,
    reduce_component,
    rigid_gyroscopic_matrix,
    selective_mass_scaling,
)
from exugear.system.bodies.store import load_or_reduce
from exugear.system.kernels.coordinates import SPIN
from fe_ste.geometry.gears import Material
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    import skfem

    from fe_ste.elimination.sparse import Backend
else:
    skfem = at_first_use("skfem")


ASYMMETRY_TOLERANCE = 5e-3
"""Relative change of the seats' mass or stiffness by a quarter turn above which a body is none of revolution."""


@dataclass(frozen=True)
class SolidModel:
    """All that a reduced solid depends on."""

    name: str
    mesh: Any
    """skfem.MeshTet2 or skfem.MeshHex2, in the gearbox's coordinates, m; or the file with it."""
    material: Material
    seats: tuple[SolidSeat, ...]
    """Where other things sit."""
    frame: Frame
    """Where its coordinates are seen from."""
    band: float
    """free-interface normal modes up to here are exact, Hz."""
    limit: float
    """Modes of the reduced body above this are brought down to it by mass scaling, Hz."""
    blanks: Mapping[str, Blank] = field(default_factory=dict)
    """Seat name -> rigid ring on it."""
    axis: tuple[float, float] = (0.0, 0.0)
    """(x, y) of the axis of turning, parallel to z, m."""

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
        """The mesh itself, read from its file if it is in one."""
        if isinstance(self.mesh, SolidFile):
            return self.mesh.mesh
        return self.mesh


@dataclass(frozen=True)
class ReducedSolid:
    """A solid's matrices and their reduction, before anything is dropped."""

    solid: Solid
    """The whole model."""
    component: ReducedComponent
    """Reduced; component modes (3 n, coordinates)."""
    seconds: float
    """Wall time that it took."""


def reduce_matrices(model: SolidModel, backend: Backend | None = None) -> ReducedSolid:
    """Assemble a solid and reduce its matrices; what `reduce_solid` makes a body of.

    Raises
    ------
    SolidError, ReductionError
        As `reduce_solid`.
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
    """Reduce a solid.

    Parameters
    ----------
    backend : {"pardiso", "superlu"}, optional
        Library that factorises; the fastest installed by default.

    Raises
    ------
    SolidError
        A seat without faces, or two that share some.
    ReductionError
        A blank without its seat, too few seats, or a body in the frame "nonrotating" that is none of revolution.
    """
    return reduced_body(model, reduce_matrices(model, backend))


def reduced_body(model: SolidModel, reduced: ReducedSolid) -> ReducedBody:
    """Reduced body from a solid's matrices; errors as `reduce_solid`."""
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
    )


def reduction_file(model: SolidModel, folder: Path) -> Path:
    """Place of a solid's reduction in the folder where they are stored."""
    return folder / f"{model.name}-{model.key[:16]}.npz"


def load_or_reduce_solid(model: SolidModel, folder: Path) -> ReducedBody:
    """Reduced solid from a folder if it is there for exactly these inputs, else reduced and stored there."""
    return load_or_reduce(reduction_file(model, folder), model.key, lambda: reduce_solid(model))


def gyroscopic_matrix(model: SolidModel, reduced: ReducedSolid) -> Floats:
    """Antisymmetric G of M q'' + Omega G q' + K q = f in the body's frame, (n, n).

    Raises
    ------
    ReductionError
        Frame "nonrotating" for a body that a quarter turn changes.
    """
    modes = reduced.component.component_modes
    size = reduced.component.component_modes.shape[1]
    matrix = np.zeros((size, size))
    if model.frame == "nonrotating":
        _check_revolution(model, reduced.component)
        scalar = in_each_direction(reduced.solid.convection - reduced.solid.convection.T)
        matrix = modes.T @ (scalar @ modes)
    elif model.frame == "carrier":
        by_node = modes.reshape(-1, 3, size)
        across = np.stack([-by_node[:, 1], by_node[:, 0], np.zeros_like(by_node[:, 0])], axis=1).reshape(-1, size)
        matrix = 2.0 * modes.T @ (reduced.solid.mass @ across)
    for number, seat in enumerate(model.seats):
        if seat.name in model.blanks:
            at_seat = slice(6 * number, 6 * number + 6)
            matrix[at_seat, at_seat] += _blank_gyroscopics(model.blanks[seat.name], model.frame)
    if model.frame == "nonrotating":
        spin = np.zeros(size)
        spin[SPIN : 6 * len(model.seats) : 6] = 1.0
        momentum = reduced.component.mass @ spin
        # Coriolis forces of the steady spin itself would be twice the centrifugal force: only what deforms has any.
        deforming = np.eye(size) - np.outer(spin, momentum) / (spin @ momentum)
        matrix = deforming.T @ matrix @ deforming
    return 0.5 * (matrix - matrix.T)


def _blank_gyroscopics(blank: Blank, frame: Frame) -> Floats:
    """Matrix G (6, 6) of a rigid ring on its seat, as `exugear.system.bodies.reduction.rigid_gyroscopic_matrix`.

    Its particles have int rho x^2 = int rho y^2 = axial / 2 and int rho z^2 = transverse - axial / 2.
    """
    return rigid_gyroscopic_matrix(RigidInertia(blank.mass, (0.0, 0.0, 0.0), blank.transverse, blank.axial), frame)


def _check_revolution(model: SolidModel, component: ReducedComponent) -> None:
    """Refuse a body that a quarter turn changes, or whose seats do not lie on the axis."""
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    count = 6 * len(model.seats)
    turn = np.kron(np.eye(count // 3), quarter)
    off_axis = any(np.hypot(*(np.array(seat.centre[:2]) - model.axis)) > 0 for seat in model.seats)
    for name, matrix in (("mass", component.mass), ("stiffness", component.stiffness)):
        at_seats = matrix[:count, :count]
        # Entries differ in unit: each is measured by the diagonal entries of its row and column.
        diagonal = np.sqrt(np.maximum(at_seats.diagonal(), np.abs(turn) @ at_seats.diagonal()))
        change = float((np.abs(turn @ at_seats @ turn.T - at_seats) / np.outer(diagonal, diagonal)).max())
        if change > ASYMMETRY_TOLERANCE or off_axis:
            raise ReductionError(
                f"body {model.name}: a quarter turn changes its {name} by {change:.1e}, but the frame 'nonrotating' "
                "is for bodies of revolution; take 'carrier', or a finer mesh"
            )


def _surface(model: SolidModel, reduced: ReducedSolid) -> Surface:
    """Boundary of the mesh with displacement, and strain in the middle of the element below, per coordinate."""
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
    gradient = np.zeros((len(facets), 3, 3, modes.shape[1]))  # of displacement component by direction
    for function, slope in zip(dofs.T, slopes, strict=True):
        gradient += by_node[function][:, :, None, :] * slope.T[:, None, :, None]
    strain = [gradient[:, i, i] for i in range(3)]
    strain += [gradient[:, i, j] + gradient[:, j, i] for i, j in ((0, 2), (0, 1), (1, 2))]
    modulus = model.material.youngs_modulus
    ratio = model.material.poissons_ratio
    shear = modulus / (2.0 * (1.0 + ratio))
    elasticity = np.diag([2.0 * shear] * 3 + [shear] * 3)
    elasticity[:3, :3] += modulus * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
    return Surface(
        points=np.asarray(mesh.doflocs)[:, nodes].T,
        quads=faces.reshape(corners.shape).astype(np.int64),
        displacement=by_node[nodes].astype(np.float32),
        strain=np.stack(strain, axis=1).astype(np.float32),
        elasticity=elasticity,
    )
