"""Flexible bodies from matrices of other programs: nodes become seats, and a reduced body like any other results.

The files have mass and stiffness of the free body. What they lack follows here:

rigid motions
    Files with few digits leave strain energy in them, which would hold a body on soft mounts. The stiffness acts on the
    deformation alone, K <- D' K D with D = 1 - R R^+ and the rigid motions R of the nodes.
gyroscopic forces
    A shaft in a frame that does not turn has the polar inertia of its torsional motion also as it tilts: the mass
    matrix of the seats' spins couples their tilts about x and y, unless the file of a gyroscopic matrix is given. Of a
    carrier only the rigid part is known; in both, `exugear.system.bodies.reduction.with_rigid_inertia` makes the rigid
    part exact.
"""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy.linalg

from exugear.system.bodies.matrix_files.checks import MatrixReview, review
from exugear.system.bodies.matrix_files.files import MatrixFiles, read_matrices
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices, UnitSystemName
from exugear.system.bodies.reduction import (
    BodySurface,
    Frame,
    RadiatingSurface,
    ReducedBody,
    ReductionError,
    ReductionSummary,
    Seat,
    check_revolution,
    selective_mass_scaling,
    symmetric,
)
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN, TILT
from fe_ste.tools.arrays import Floats

SAME_PLACE = 1e-4
"""Largest distance of a node from the position of its seat, m."""
FIRST_MODAL = 900_001
"""Number of the first modal coordinate that is written, above those of usual nodes."""
LEAST_SKEW = 1e-6
"""Largest symmetric part of a gyroscopic matrix over its largest entry."""
LEAST_MOMENTUM = 0.05
"""Largest difference of the gyroscopic coupling of rigid tilts from the polar inertia, over that."""
MARK = 0.02
"""Size of the marks at the nodes in pictures over the extent of all nodes."""


@dataclass(frozen=True)
class NodeSeat:
    """A seat and the node that it is."""

    name: str
    position: tuple[float, float, float]
    """Where the node is looked for, in the gearbox's coordinates, m."""
    node: int | None = None
    """Its number; by default the only node at the position."""


@dataclass(frozen=True, eq=False)
class ExternalModel:
    """Complete input of a body from matrices; models of one key are equal."""

    name: str
    files: MatrixFiles
    units: UnitSystemName
    """Unit system of the files."""
    rotation: tuple[tuple[float, float, float], ...]
    shift: tuple[float, float, float]
    """From the coordinates of the files to those of the gearbox: rotation matrix (3, 3), then shift (m)."""
    seats: tuple[NodeSeat, ...]
    frame: Frame
    """Reference frame of the coordinates."""
    band: float
    """Highest frequency at which the file has modes, for the sound of its surface, Hz."""
    limit: float
    """Limit to which mass scaling lowers higher mode frequencies, Hz."""
    axis: tuple[float, float] = (0.0, 0.0)
    """(x, y) of the axis of rotation, parallel to z, m."""

    @cached_property
    def file_digest(self) -> str:
        """SHA-256 of all files."""
        digests = [hashlib.sha256(path.read_bytes()).digest() for path in self.files.paths]
        return hashlib.sha256(b"".join(digests)).hexdigest()

    @cached_property
    def key(self) -> str:
        """SHA-256 of these inputs."""
        words = {
            "files": self.file_digest,
            "names": dict(self.files.names or {}),
            "seats": [asdict(seat) for seat in self.seats],
            "rest": [self.name, self.units, self.rotation, self.shift, self.frame, self.limit, self.axis, self.band],
        }
        return hashlib.sha256(json.dumps(words, sort_keys=True).encode()).hexdigest()

    def __hash__(self) -> int:
        """Return the hash of the key."""
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        """Compare by the key."""
        return isinstance(other, ExternalModel) and self.key == other.key


@lru_cache(maxsize=16)
def matrices_of(model: ExternalModel) -> tuple[InterfaceMatrices, MatrixReview]:
    """Matrices of a model's files in SI units and in the axes of the files, and their review.

    Raises
    ------
    exugear.system.bodies.matrix_files.interface.MatrixFileError
        A file cannot be used.
    """
    matrices = read_matrices(model.files).to_si(model.units)
    return matrices, review(matrices)


def placed_matrices(model: ExternalModel) -> InterfaceMatrices:
    """Matrices in the gearbox's coordinates, the nodes in the order of the seats, then those without a seat.

    Raises
    ------
    ReductionError
        A seat has no node, or shares one with another seat; or the gyroscopic matrix is not that of the body.
    """
    matrices = matrices_of(model)[0].moved(np.array(model.rotation), model.shift)
    nodes = [_node_of(matrices, seat) for seat in model.seats]
    for n, node in enumerate(nodes):
        if node in nodes[:n]:
            first = model.seats[nodes.index(node)].name
            raise ReductionError(
                f"seats.{model.seats[n].name}: node {matrices.nodes[node]} is also that of {first}; set same_as = "
                f"{first!r}, or another node"
            )
    _check_gyroscopic(matrices)
    return matrices.in_order([*nodes, *(node for node in range(len(matrices.nodes)) if node not in nodes)])


def _check_gyroscopic(matrices: InterfaceMatrices) -> None:
    """Refuse a gyroscopic matrix that is not antisymmetric, or not that of the rigid body in rigid motions.

    A rotor with polar inertia J turning at Omega about +z has the moment -Omega J b' about x as it tilts at b' about y.
    """
    gyroscopic = matrices.gyroscopic
    if gyroscopic is None:
        return
    largest = float(np.abs(gyroscopic).max())
    lopsided = np.abs(gyroscopic + gyroscopic.T)
    if lopsided.max() > LEAST_SKEW * largest:
        row, column = divmod(int(lopsided.argmax()), matrices.size)
        (node, component), (other, across) = matrices.labels[row], matrices.labels[column]
        raise ReductionError(
            f"gyroscopic: not antisymmetric at node {node}, component {component} and node {other}, component "
            f"{across}: {gyroscopic[row, column]:.6g} and {gyroscopic[column, row]:.6g}; write both triangles, with "
            "opposite signs"
        )
    motions = matrices.rigid_motions(matrices.positions.mean(axis=0))
    polar = float(motions[:, SPIN] @ matrices.mass @ motions[:, SPIN])
    coupling = float(motions[:, TILT] @ gyroscopic @ motions[:, TILT + 1])
    if abs(coupling - polar) > LEAST_MOMENTUM * polar:
        raise ReductionError(
            f"gyroscopic: rigid tilts about x and y are coupled by {coupling:.5g} kg m2, but the polar inertia about z "
            f"is {polar:.5g} kg m2; write the matrix per rad/s, for a rotation about +z of the gearbox, in "
            "M q'' + Omega G q' + K q = f"
        )


def _node_of(matrices: InterfaceMatrices, seat: NodeSeat) -> int:
    """Index of the node of a seat."""
    if seat.node is not None:
        if seat.node not in matrices.nodes:
            known = ", ".join(map(str, matrices.nodes[:40]))
            raise ReductionError(f"seats.{seat.name}.node = {seat.node}: no such node; nodes are {known}")
        return matrices.nodes.index(seat.node)
    distance = np.linalg.norm(matrices.positions - np.array(seat.position), axis=1)
    found = np.flatnonzero(distance < SAME_PLACE)
    if len(found) == 1:
        return int(found[0])
    place = ", ".join(f"{1e3 * value:.6g}" for value in seat.position)
    if len(found):
        numbers = ", ".join(str(matrices.nodes[node]) for node in found)
        raise ReductionError(f"seats.{seat.name}: nodes {numbers} are all at ({place}) mm; set node to one of them")
    nearest = int(distance.argmin())
    raise ReductionError(
        f"seats.{seat.name}: no node at ({place}) mm; the nearest is node {matrices.nodes[nearest]} at a distance of "
        f"{1e3 * distance[nearest]:.4g} mm; set node, or check shift_mm, turn_deg and units"
    )


def reduce_external(model: ExternalModel) -> ReducedBody:
    """Make a reduced body of matrices.

    Raises
    ------
    exugear.system.bodies.matrix_files.interface.MatrixFileError
        A file cannot be used.
    ReductionError
        The matrices are not those of a free elastic body, a seat has no node, or a body in the frame "nonrotating" is
        not a body of revolution.
    """
    began = time.perf_counter()
    errors = matrices_of(model)[1].errors
    if errors:
        raise ReductionError("; ".join(errors))
    matrices = placed_matrices(model)
    names = [*(seat.name for seat in model.seats), *(f"node_{n}" for n in matrices.nodes[len(model.seats) :])]
    places = [(float(x), float(y), float(z)) for x, y, z in matrices.positions]
    # Few digits leave energy in rigid motions, which is taken out.
    motions = matrices.rigid_motions(matrices.positions.mean(axis=0))
    deforming = np.eye(matrices.size) - motions @ np.linalg.pinv(motions)
    stiffness = symmetric(deforming.T @ symmetric(matrices.stiffness) @ deforming)
    if model.frame == "nonrotating":
        check_revolution(model.name, places, model.axis, matrices.mass, stiffness)
    mass, mass_scaled = selective_mass_scaling(symmetric(matrices.mass), stiffness, model.limit)
    spin = np.zeros(matrices.size)
    for number, (x, y, _) in enumerate(places if model.frame != "ground" else ()):
        spin[6 * number : 6 * number + 6] = [model.axis[1] - y, x - model.axis[0], 0.0, 0.0, 0.0, 1.0]
    return ReducedBody(
        name=model.name,
        seats=tuple(Seat(name, place) for name, place in zip(names, places, strict=True)),
        mass=mass,
        stiffness=stiffness,
        gyroscopic=_gyroscopic_matrix(matrices, model.frame),
        spin=spin,
        frame=model.frame,
        modal_groups=("inner",) * len(matrices.modal),
        radiating=(
            None
            if matrices.normal_motion is None
            else RadiatingSurface(symmetric(matrices.normal_motion), matrices.area, matrices.area, model.band)
        ),
        surface=marked_nodes(matrices.positions, matrices.size),
        summary=ReductionSummary({}, time.perf_counter() - began, {"whole": ()}, {"whole": mass_scaled}),
    )


def _gyroscopic_matrix(matrices: InterfaceMatrices, frame: Frame) -> Floats:
    """Antisymmetric G of M q'' + Omega G q' + K q = f as far as mass and stiffness tell, (n, n)."""
    gyroscopic = np.zeros((matrices.size, matrices.size))
    if matrices.gyroscopic is not None:
        return 0.5 * (matrices.gyroscopic - matrices.gyroscopic.T)
    if frame == "nonrotating":
        spins = np.arange(SPIN, BODY_SIZE * len(matrices.nodes), BODY_SIZE)
        about_x, about_y = spins - SPIN + TILT, spins - SPIN + TILT + 1
        gyroscopic[np.ix_(about_x, about_y)] = matrices.mass[np.ix_(spins, spins)]
    return gyroscopic - gyroscopic.T


_OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
_TRIANGLES = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
_SQUARE = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])


def marked_nodes(positions: Floats, size: int) -> BodySurface:
    """Surface of small octahedra at nodes (s, 3), and bars between neighbours; `size` coordinates.

    Without the mesh of the other program, pictures show the interface alone, and no strain energy. Corners move with
    their node as with a rigid body. The bars are those of the shortest tree that joins all nodes.
    """
    from scipy.sparse.csgraph import minimum_spanning_tree  # loaded only for such bodies

    radius = MARK * max(float(np.ptp(positions, axis=0).max()), MARK)
    points = [(node, radius * corner) for node in range(len(positions)) for corner in _OCTAHEDRON]
    faces = [
        [*(6 * node + triangle), 6 * node + triangle[2]] for node in range(len(positions)) for triangle in _TRIANGLES
    ]
    distances = np.linalg.norm(positions[:, None] - positions, axis=2)
    tree = minimum_spanning_tree(distances)
    for first, second in np.argwhere(tree.toarray() > 0.0).tolist():
        across = scipy.linalg.null_space((positions[second] - positions[first])[None]).T
        start = len(points)
        points += [(node, 0.4 * radius * corner @ across) for node in (first, second) for corner in _SQUARE]
        faces += [[start + n, start + (n + 1) % 4, start + 4 + (n + 1) % 4, start + 4 + n] for n in range(4)]
    displacement = np.zeros((len(points), 3, size), dtype=np.float32)
    for number, (node, (x, y, z)) in enumerate(points):
        displacement[number, :, 6 * node : 6 * node + 3] = np.eye(3)
        displacement[number, :, 6 * node + 3 : 6 * node + 6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return BodySurface(
        points=np.array([positions[node] + offset for node, offset in points]),
        quads=np.array(faces, dtype=np.int64),
        displacement=displacement,
        strain=np.zeros((len(faces), 6, size), dtype=np.float32),
        elasticity=np.zeros((6, 6)),
    )


def interface_of(body: ReducedBody) -> InterfaceMatrices:
    """Return mass, stiffness and surface of a reduced body on its seats, for other programs; in SI units.

    A shaft has its gyroscopic matrix as well, in a frame that does not rotate.

    Nodes are numbered from 1 in the order of the seats. Modes above the limit of the body are at this limit.

    Examples
    --------
    >>> seats = (Seat("left", (1.0, 0.0, 0.0)), Seat("right", (0.0, 1.0, 0.0)))
    >>> surface, summary = marked_nodes(np.eye(2, 3), 12), ReductionSummary({}, 0.0, {}, {})
    >>> none = np.zeros((12, 12))
    >>> body = ReducedBody("lid", seats, np.eye(12), none, none, np.zeros(12), "ground", (), surface, summary)
    >>> interface_of(body)
    <InterfaceMatrices: 2 interface nodes, 0 modal coordinates>
    """
    return InterfaceMatrices(
        nodes=tuple(range(1, len(body.seats) + 1)),
        positions=np.array([seat.position for seat in body.seats]),
        modal=tuple(range(FIRST_MODAL, FIRST_MODAL + len(body.modal_groups))),
        mass=body.mass,
        stiffness=body.stiffness,
        gyroscopic=body.gyroscopic if body.frame == "nonrotating" and body.gyroscopic.any() else None,
        normal_motion=None if body.radiating is None else body.radiating.matrix,
        area=0.0 if body.radiating is None else body.radiating.area,
    )
