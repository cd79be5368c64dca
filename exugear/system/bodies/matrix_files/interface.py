"""Mass and stiffness on interface nodes: six coordinates per node, then modal coordinates; units and axes.

Finite-element programs reduce a body to some interface nodes by static condensation (Guyan, AIAA Journal 3, 1965) or
with modes of vibration between them (Craig and Bampton, AIAA Journal 6, 1968). Each mode then has a modal coordinate,
which belongs to no node.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin

MOST_COORDINATES = 3000
"""Largest number of coordinates; each matrix then has 72 MB. Usual deliveries have some hundred."""
NODE_SIZE = 6
"""Coordinates of a node: displacements along x, y, z and rotations about x, y, z."""
CONSTRAINED = 1e30
"""Stiffness from which an entry stands for a support: programs mark constrained coordinates by 1e36."""


class MatrixFileError(ValueError):
    """A file of matrices that cannot be used; the message names the file, the location and the remedy."""


class UnitSystem(NamedTuple):
    """Units of a finite-element model over those of SI: length (m), mass (kg), time (s)."""

    length: float
    mass: float
    time: float


UnitSystemName = Literal["SI", "mm-t-s", "mm-kg-ms", "mm-kg-s", "inch-lbf-s"]
UNIT_SYSTEMS: Mapping[UnitSystemName, UnitSystem] = {
    "SI": UnitSystem(1.0, 1.0, 1.0),
    "mm-t-s": UnitSystem(1e-3, 1e3, 1.0),
    "mm-kg-ms": UnitSystem(1e-3, 1.0, 1e-3),
    "mm-kg-s": UnitSystem(1e-3, 1.0, 1.0),
    "inch-lbf-s": UnitSystem(0.0254, 4.4482216152605 / 0.0254, 1.0),
}
"""Consistent unit systems. The unit of mass of inch-lbf-s is the lbf s2/inch, 175.127 kg."""

Label = tuple[int, int]
"""Node number and component 1 to 6 of a coordinate; component 0 is a scalar point."""


@dataclass(frozen=True, eq=False)
class LabelledMatrix:
    """A symmetric matrix as it is in a file."""

    values: Floats
    """(n, n) in the units of the file."""
    labels: tuple[Label, ...] | None = None
    """(n,) coordinates; None for a file without any, where the node table states their order."""


@dataclass(frozen=True, eq=False)
class NodeTable:
    """Interface nodes of a file."""

    positions: Mapping[int, tuple[float, float, float]] = field(default_factory=dict)
    """By node number, in the unit of length of the file."""
    axes: Mapping[int, Floats] = field(default_factory=dict)
    """By node number, axes (3, 3) of its displacements as rows, for nodes with local axes."""
    order: tuple[Label, ...] = ()
    """Coordinates of matrices without labels."""


@dataclass(frozen=True, eq=False)
class InterfaceMatrices(ReprMixin, line=": {nodes!n} interface nodes, {modal!n} modal coordinates"):
    """Mass and stiffness of a free body on interface nodes; n = 6 s + m coordinates of s nodes and m modes.

    Coordinates are ux uy uz rx ry rz of each node, then the modal coordinates; in SI units m, rad and kg^0.5 m.
    """

    nodes: tuple[int, ...]
    """(s,) node numbers."""
    positions: Floats
    """(s, 3)"""
    modal: tuple[int, ...]
    """(m,) numbers of the modal coordinates."""
    mass: Floats
    stiffness: Floats
    """(n, n)"""
    gyroscopic: Floats | None = None
    """(n, n) antisymmetric G of M q'' + Omega G q' + K q = f, Omega in rad/s about +z, if it is known."""
    normal_motion: Floats | None = None
    """(n, n) integral of (n . u)(n . u)^T over the outer surface, if it is known."""
    area: float = 0.0
    """Of this surface."""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return NODE_SIZE * len(self.nodes) + len(self.modal)

    @property
    def labels(self) -> tuple[Label, ...]:
        """Node and component of each coordinate; component 0 for modal coordinates."""
        of_nodes = [(node, component) for node in self.nodes for component in range(1, NODE_SIZE + 1)]
        return (*of_nodes, *((number, 0) for number in self.modal))

    def to_si(self, units: UnitSystemName) -> InterfaceMatrices:
        """Return the matrices in SI units.

        Parameters
        ----------
        units : unit system of these matrices

        Examples
        --------
        A mass of 2 t on a spring of 3 N/mm has the same frequency in SI units.

        >>> point = np.diag([2.0] * 3 + [1.0] * 3)
        >>> body = InterfaceMatrices((1,), np.array([[100.0, 0.0, 0.0]]), (), point, 1.5 * point).to_si("mm-t-s")
        >>> [float(value) for value in (body.positions[0, 0], body.mass[0, 0], body.stiffness[0, 0], body.mass[3, 3])]
        [0.1, 2000.0, 3000.0, 0.001]
        """
        return self._rescaled(UNIT_SYSTEMS[units])

    def from_si(self, units: UnitSystemName) -> InterfaceMatrices:
        """Return matrices in SI units in those of another system."""
        length, mass, time = UNIT_SYSTEMS[units]
        return self._rescaled(UnitSystem(1.0 / length, 1.0 / mass, 1.0 / time))

    def _rescaled(self, units: UnitSystem) -> InterfaceMatrices:
        """Convert with units over those of the result.

        Energies convert with mass length^2 / time^2. Displacements have the unit of length, rotations none. A modal
        coordinate of unit modal mass has the unit mass^0.5 length, with which its modal mass remains one.
        """
        length, mass, time = units
        per_coordinate = np.concatenate(
            [
                np.tile([1.0 / length] * 3 + [1.0] * 3, len(self.nodes)),
                np.full(len(self.modal), 1.0 / (np.sqrt(mass) * length)),
            ]
        )
        factors = mass * length**2 * np.outer(per_coordinate, per_coordinate)
        return replace(
            self,
            positions=self.positions * length,
            mass=self.mass * factors,
            stiffness=self.stiffness * factors / time**2,
            gyroscopic=None if self.gyroscopic is None else self.gyroscopic * factors,
            normal_motion=None if self.normal_motion is None else self.normal_motion * factors * length**2 / mass,
            area=self.area * length**2,
        )

    def moved(self, rotation: Floats, shift: Sequence[float]) -> InterfaceMatrices:
        """Return the body rotated about the origin, then shifted: positions become R x + s.

        Parameters
        ----------
        rotation : (3, 3) rotation matrix R
        shift : (3,) s, in the unit of the positions
        """
        turned = np.eye(self.size)
        for n in range(0, NODE_SIZE * len(self.nodes), 3):
            turned[n : n + 3, n : n + 3] = rotation
        return replace(
            self,
            positions=self.positions @ rotation.T + np.asarray(shift),
            mass=turned @ self.mass @ turned.T,
            stiffness=turned @ self.stiffness @ turned.T,
            gyroscopic=None if self.gyroscopic is None else turned @ self.gyroscopic @ turned.T,
            normal_motion=None if self.normal_motion is None else turned @ self.normal_motion @ turned.T,
        )

    def in_order(self, nodes: Sequence[int]) -> InterfaceMatrices:
        """Return the matrices with the nodes, given by their indices, in another order; modal coordinates stay last."""
        at_nodes = [NODE_SIZE * node + component for node in nodes for component in range(NODE_SIZE)]
        order = np.array([*at_nodes, *range(NODE_SIZE * len(self.nodes), self.size)])
        return replace(
            self,
            nodes=tuple(self.nodes[node] for node in nodes),
            positions=self.positions[list(nodes)],
            mass=self.mass[np.ix_(order, order)],
            stiffness=self.stiffness[np.ix_(order, order)],
            gyroscopic=None if self.gyroscopic is None else self.gyroscopic[np.ix_(order, order)],
            normal_motion=None if self.normal_motion is None else self.normal_motion[np.ix_(order, order)],
        )

    def rigid_motions(self, centre: Sequence[float] | Floats) -> Floats:
        """Rigid motions (n, 6): translations, and rotations about a centre (3,)."""
        return rigid_motions(self.size, self.positions, centre)


def rigid_motions(size: int, positions: ArrayLike, centre: ArrayLike) -> Floats:
    """Return translations, and rotations about a centre (3,), as motions (size, 6) of nodes at positions (s, 3)."""
    motions = np.zeros((size, NODE_SIZE))
    for n, (x, y, z) in enumerate(np.reshape(positions, (-1, 3)) - np.asarray(centre)):
        motions[6 * n : 6 * n + 6] = np.eye(6)
        motions[6 * n : 6 * n + 3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return motions


def check_size(count: int, path: object, name: str) -> None:
    """Refuse a matrix with more coordinates than `MOST_COORDINATES`, before it is allocated.

    Raises
    ------
    MatrixFileError
        The matrix is empty or too large.
    """
    if not 0 < count <= MOST_COORDINATES:
        raise MatrixFileError(
            f"{path}: matrix {name} has {count} coordinates; 1 to {MOST_COORDINATES} are read; reduce the body to its "
            "interface nodes and some modal coordinates"
        )


class EntryList:
    """Entries of a matrix that a text lists one by one, each with the labels of its row and column.

    Parameters
    ----------
    path, name : of the file and the matrix, for messages
    """

    def __init__(self, path: object, name: str) -> None:
        self.path = path
        self.name = name
        self._places: dict[Label, int] = {}
        self._rows: list[int] = []
        self._columns: list[int] = []
        self._values: list[float] = []

    def add(self, row: Label, column: Label, value: float) -> None:
        """Add an entry."""
        places = self._places
        self._rows.append(places.setdefault(row, len(places)))
        self._columns.append(places.setdefault(column, len(places)))
        self._values.append(value)

    def matrix(self, mirrored: bool) -> LabelledMatrix:
        """Return the matrix.

        Parameters
        ----------
        mirrored : whether an entry also stands for its mirror image, if the text does not list that

        Raises
        ------
        MatrixFileError
            The matrix is empty or too large, an entry occurs twice, or an entry is infinite or marks a support.
        """
        count = len(self._places)
        check_size(count, self.path, self.name)
        labels = tuple(self._places)
        rows, columns, values = np.array(self._rows), np.array(self._columns), np.array(self._values)
        wrong = np.flatnonzero(~(np.abs(values) < CONSTRAINED))
        if len(wrong):
            node, component = labels[rows[wrong[0]]]
            raise MatrixFileError(
                f"{self.path}: matrix {self.name}: entry {values[wrong[0]]:g} at node {node}, component {component}; "
                "such entries mark supports; remove the supports and reduce the free body"
            )
        entries, counts = np.unique(rows * count + columns, return_counts=True)
        if len(entries) < len(rows):
            row, column = divmod(int(entries[counts > 1][0]), count)
            raise MatrixFileError(
                f"{self.path}: matrix {self.name}: the entry of node {labels[row][0]}, component {labels[row][1]} and "
                f"node {labels[column][0]}, component {labels[column][1]} occurs twice; write the matrix once"
            )
        matrix = np.zeros((count, count))
        matrix[rows, columns] = values
        if mirrored:
            listed = np.zeros((count, count), dtype=bool)
            listed[rows, columns] = True
            alone = listed.T & ~listed
            matrix[alone] = matrix.T[alone]
        return LabelledMatrix(matrix, labels)


def interface_matrices(
    stiffness: LabelledMatrix,
    mass: LabelledMatrix,
    nodes: NodeTable,
    path: object,
    others: Mapping[str, LabelledMatrix] | None = None,
) -> InterfaceMatrices:
    """Combine a stiffness and a mass matrix, and others by the names of their fields, with the positions of nodes.

    The nodes are in the order of their numbers. Local axes are removed. A coordinate that only one matrix has is zero
    in the other. A number without a position and with a single coordinate is a modal coordinate.

    Parameters
    ----------
    path : file of the nodes, for messages

    Raises
    ------
    MatrixFileError
        A node has no position, or the order of coordinates is not known or has another length than the matrices.
    """
    labels_of = {}
    given = {"stiffness": stiffness, "mass": mass, **(others or {})}
    for name, matrix in given.items():
        labels = nodes.order if matrix.labels is None else matrix.labels
        if len(labels) != len(matrix.values):
            raise MatrixFileError(
                f"{path}: {len(labels)} coordinates in the order of the nodes, but the {name} matrix has "
                f"{len(matrix.values)}; list exactly the interface nodes, six coordinates each, and the modal "
                "coordinates as scalar points"
            )
        # Abaqus gives a modal coordinate the component 1, other programs none.
        labels_of[name] = tuple(
            (number, 0 if component == 1 and number not in nodes.positions else component)
            for number, component in labels
        )
    found: dict[int, set[int]] = {}
    for labels in labels_of.values():
        for number, component in labels:
            found.setdefault(number, set()).add(component)
    numbers = sorted(number for number in found if number in nodes.positions)
    modal = [number for number in found if number not in nodes.positions]
    lost = next((number for number in modal if len(found[number]) > 1), None)
    if lost is not None:
        raise MatrixFileError(f"{path}: node {lost} of the matrices has no position; add it to the nodes")
    odd = next((number for number in numbers if not found[number] <= set(range(1, NODE_SIZE + 1))), None)
    if odd is not None:
        raise MatrixFileError(
            f"{path}: node {odd} has components {sorted(found[odd])}; a node has components 1 to 6; give scalar points "
            "numbers that no node has"
        )
    if not numbers:
        raise MatrixFileError(f"{path}: no node of the matrices has a position; add the interface nodes")
    place = {
        (number, component): 6 * n + component - 1 for n, number in enumerate(numbers) for component in range(1, 7)
    }
    place |= {
        (number, component): 6 * len(numbers) + m for m, number in enumerate(modal) for component in found[number]
    }
    size = NODE_SIZE * len(numbers) + len(modal)
    check_size(size, path, "of all coordinates")
    whole = {}
    for name, matrix in given.items():
        at = np.array([place[label] for label in labels_of[name]])
        if len(np.unique(at)) < len(at):
            raise MatrixFileError(f"{path}: two rows of the {name} matrix have the same node and component")
        whole[name] = np.zeros((size, size))
        whole[name][np.ix_(at, at)] = matrix.values
    to_global = np.eye(size)
    for n, number in enumerate(numbers):
        if number in nodes.axes:
            for start in (6 * n, 6 * n + 3):
                to_global[start : start + 3, start : start + 3] = nodes.axes[number]
    turned = {name: to_global.T @ matrix @ to_global for name, matrix in whole.items()}
    return InterfaceMatrices(
        nodes=tuple(numbers),
        positions=np.array([nodes.positions[number] for number in numbers]),
        modal=tuple(modal),
        mass=turned["mass"],
        stiffness=turned["stiffness"],
        gyroscopic=turned.get("gyroscopic"),
        normal_motion=turned.get("normal_motion"),
    )
