"""Meshes of solid bodies: second-order hexahedra of turned shafts, tetrahedra by gmsh, files by meshio.

Files may come from a stranger. Scripts of gmsh run only where they are permitted to; shapes are read without what
lies beside them, meshes in formats that refer to no other file.

Every mesh comes out as scikit-fem's `MeshHex2` (27 nodes) or `MeshTet2` (10 nodes). Elements of first order keep their
straight edges and get nodes in the middle; the displacement is of second order in either case.

gmsh (under the GPL) and meshio are loaded only where used.
"""

from __future__ import annotations

import hashlib
import importlib
import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import skfem

from exugear.bodies.turned_section import SAME, Shaft
from fe_ste.elasticity.bricks import skfem_mesh
from fe_ste.tools.arrays import Floats, Integers

CORE = 0.5
"""Radius of the square core of a solid section over that of its first ring of lines."""
BULGE = 0.5
"""How far the sides of the core lean towards a circle: 0 is a square, 1 a circle without corners."""
_TET_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
_HEX_EDGES = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]])
_HEX_FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]])
_HEX_FACE_EDGES = np.array([[3, 8, 7, 11], [1, 9, 5, 10], [0, 9, 4, 8], [2, 11, 6, 10], [0, 1, 2, 3], [4, 5, 6, 7]])
"""Corners of edges and faces, and edges of faces, in the order of VTK."""
_CORNERS = {"tetra": 4, "tetra10": 4, "hexahedron": 8, "hexahedron20": 8, "hexahedron27": 8}
SCRIPT = ".geo"
"""Ending of gmsh scripts. Such a script can run any command of the system."""
CAD = {".step": "step", ".stp": "step", ".brep": "brep"}
"""Formats of shapes that hold nothing to run, by the ending of the file."""
GEOMETRY = (SCRIPT, *CAD)
"""Endings of files that gmsh meshes."""
MESHES = {".msh": "gmsh", ".inp": "abaqus", ".vtu": "vtu", ".vtk": "vtk"}
"""Formats of meshes that are read, by the ending of the file: one file each, which refers to no other, and whose
reader comes to an end on a file that is cut short (that of Nastran's does not)."""
UNPERMITTED = (
    "a gmsh script can run any command; if you trust it, permit it with --allow-scripts (modes, run, view) or "
    "EXUGEAR_ALLOW_SCRIPTS=1; a STEP file needs no permission"
)
"""Why a script is refused, and what would be right."""


class SolidError(ValueError):
    """A solid that cannot be meshed or read, or a seat that does not lie on it."""


def turned_hexahedra(shaft: Shaft, around: int = 8) -> Any:
    """Mesh a turned shaft with hexahedra on the lines of its half-section.

    A section without bore has a square core with bulging sides, which the first ring surrounds; all other rings are
    those of the half-section. All nodes lie on true circles.

    Parameters
    ----------
    shaft : Shaft
        Its axis is the z axis, its beginning z = 0.
    around : int
        Elements around, a multiple of 8. The mass is 0.08 % short with 8, 0.005 % with 16.

    Returns
    -------
    skfem.MeshHex2

    Raises
    ------
    SolidError
        `around` is not a multiple of 8.
    """
    if around < 8 or around % 8:
        raise SolidError(f"{around} elements around a shaft: it must be a multiple of 8")
    corners = np.asarray(shaft.mesh.p)[:, np.asarray(shaft.mesh.t)]
    radii, heights = (np.unique(np.round(np.asarray(line) / SAME)) * SAME for line in shaft.mesh.p)
    middle = corners.mean(axis=1)
    rings, layers = np.searchsorted(radii, middle[0]) - 1, np.searchsorted(heights, middle[1]) - 1
    on_axis = bool(radii[0] < SAME)
    points, faces, level = _square_rings(around, len(radii) if on_axis else len(radii) + 1)
    # Level 0 is the core, level 1 the ring about it: both fill the first cell of the half-section.
    ring_of = np.maximum(level - 1, 0) if on_axis else level - 2
    count = len(points)
    bricks = [
        np.hstack([faces[ring_of == ring] + count * layer, faces[ring_of == ring] + count * (layer + 1)])
        for ring, layer in zip(rings, layers, strict=True)
    ]
    used, numbers = np.unique(np.concatenate(bricks), return_inverse=True)
    logical = np.column_stack([points[used % count], heights[used // count]])
    mesh = skfem.MeshHex2.from_mesh(skfem_mesh(logical, numbers.reshape(-1, 8)))
    circles = np.concatenate([[0.0], radii[1:]]) if on_axis else np.concatenate([[0.0], radii])
    return skfem.MeshHex2(_to_circles(np.asarray(mesh.doflocs), circles), mesh.t)


def _square_rings(around: int, levels: int) -> tuple[Floats, Integers, Integers]:
    """Square of logical rings: points (n, 2), faces (f, 4), level (f,) of each face; level 0 is the core.

    A point at the largest coordinate s lies on ring s, and at 45 degrees times the smaller coordinate over s.
    """
    side = around // 8
    core = np.linspace(-1.0, 1.0, 2 * side + 1)
    x, y = np.meshgrid(core, core, indexing="ij")
    grid = np.arange(x.size).reshape(x.shape)
    faces = [np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)]
    border = np.concatenate([grid[:-1, 0], grid[-1, :-1], grid[:0:-1, -1], grid[0, :0:-1]])
    points = [np.stack([x.ravel(), y.ravel()], axis=1)]
    unit = points[0][border]
    inner, total = border, x.size
    for level in range(1, levels):
        points.append((level + 1.0) * unit)
        outer = total + np.arange(around)
        faces.append(np.stack([inner, outer, np.roll(outer, -1), np.roll(inner, -1)], axis=1))
        inner, total = outer, total + around
    numbers = np.repeat(np.arange(levels), [len(f) for f in faces])
    return np.concatenate(points), np.concatenate(faces).astype(np.int64), numbers


def _to_circles(logical: Floats, circles: Floats) -> Floats:
    """Move points (3, n) of the logical square onto circles; `circles` are the radii of rings 1, 2, 3, ..."""
    x, y, z = logical
    ring = np.maximum(np.abs(x), np.abs(y))
    safe = np.where(ring > 0.0, ring, 1.0)
    sideways = np.abs(x) < np.abs(y)
    angle = np.pi / 4.0 * np.where(sideways, x, y) / safe * np.sign(np.where(sideways, y, x))
    direction = np.where(
        sideways,
        np.sign(y) * np.array([np.sin(angle), np.cos(angle)]),
        np.sign(x) * np.array([np.cos(angle), np.sin(angle)]),
    )
    square = np.array([x, y]) / safe / np.sqrt(2.0)
    bulging = CORE * circles[1] * ((1.0 - BULGE * ring) * square + BULGE * ring * direction)
    inside = ring * bulging
    edge = CORE * circles[1] * ((1.0 - BULGE) * square + BULGE * direction)
    share = np.clip(ring - 1.0, 0.0, 1.0)
    between = (1.0 - share) * edge + share * circles[1] * direction
    radius = np.interp(ring, 1.0 + np.arange(len(circles)), circles)
    plane = np.where(ring <= 1.0, inside, np.where(ring <= 2.0, between, radius * direction))
    return np.vstack([plane, z])


def tetrahedra(build: Callable[[Any], None], size: float, curvature: int = 12) -> Any:
    """Mesh a solid with tetrahedra of second order by gmsh.

    Parameters
    ----------
    build : callable
        Is given `gmsh.model.occ` and adds volumes to it, in m. Fused pieces keep the edges between them.
    size : float
        Largest element, m.
    curvature : int
        Elements around a full circle, at least.

    Returns
    -------
    skfem.MeshTet2

    Raises
    ------
    SolidError
        gmsh or a library of the system is missing, or the shape has no volume.

    Examples
    --------
    >>> tetrahedra(lambda occ: occ.addBox(0.0, 0.0, 0.0, 1.0, 0.5, 0.25), 0.25)  # doctest: +SKIP
    <skfem MeshTet2 object>
    """

    def load(gmsh: Any) -> None:
        build(gmsh.model.occ)
        gmsh.model.occ.synchronize()

    return _meshed(load, size, curvature)


def mesh_geometry(path: Path, size: float, curvature: int = 12, unit: float = 1e-3, scripts: bool = False) -> Any:
    """Mesh a STEP or BREP file or a gmsh script (.geo, OpenCASCADE kernel) with tetrahedra of second order.

    Parameters
    ----------
    path : Path
        A script is one file: what it includes is not noticed when a reduction is looked up.
    size, curvature : float, int
        As in `tetrahedra`; m.
    unit : float
        Length of the file's unit, m. gmsh reads STEP in mm whatever its unit is.
    scripts : bool
        Whether a script may run. It can do all that the user can.

    Returns
    -------
    skfem.MeshTet2

    Raises
    ------
    SolidError
        As `tetrahedra`; also a file that is missing or that gmsh cannot read, and a script that may not run. After a
        syntax error in a script gmsh reads no other one in the same process.
    """
    if not path.is_file():
        raise SolidError(f"{path}: no such file")
    kind = path.suffix.lower()
    if kind not in GEOMETRY:
        raise SolidError(f"{path}: no geometry; its name must end in {', '.join(GEOMETRY)}")
    if kind == SCRIPT and not scripts:
        raise SolidError(f"{path.name}: {UNPERMITTED}")

    def load(gmsh: Any) -> None:
        if kind == SCRIPT:
            gmsh.open(str(path))
            return
        # gmsh.open would run a script of options that lies beside the shape; labels may refer to other files.
        gmsh.option.setNumber("Geometry.OCCImportLabels", 0)
        gmsh.model.occ.importShapes(str(path), format=CAD[kind])
        gmsh.model.occ.synchronize()

    try:
        return _meshed(load, size / unit, curvature, unit)
    except SolidError as error:
        raise SolidError(f"{path}: {error}") from None


def _meshed(load: Callable[[Any], None], size: float, curvature: int, unit: float = 1.0) -> Any:
    """Mesh what `load` puts into gmsh, in lengths of `unit` (m)."""
    gmsh = _library("gmsh")
    gmsh.initialize(["exugear", "-nopopup"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Geometry.OCCUnionUnify", 0)  # edges between fused pieces stay: bands end on them
        load(gmsh)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", curvature)
        # Without a size at the corners gmsh takes a tenth of the whole.
        gmsh.model.mesh.setSize(gmsh.model.getEntities(0), size)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.model.mesh.optimize("HighOrder")  # edges laid on coarse curves may turn an element inside out
        tags, places, _ = gmsh.model.mesh.getNodes()
        kinds, _, nodes = gmsh.model.mesh.getElements(3)
    except Exception as error:  # gmsh raises nothing narrower
        raise SolidError(f"gmsh cannot mesh it ({str(error).strip()})") from error
    finally:
        gmsh.finalize()
        _keep_broken_pipes()
    if not len(kinds):
        raise SolidError("the shape has no volume to mesh")
    order = np.argsort(tags)
    cells = order[np.searchsorted(tags[order], nodes[0])].reshape(-1, 10)
    # gmsh numbers the last two edges of a tetrahedron the other way round than VTK.
    return second_order(unit * places.reshape(-1, 3), cells[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]], "tetra10")


def _keep_broken_pipes() -> None:
    """Make a broken pipe an error again: gmsh leaves it to end the process, and with it a grid that lost a worker."""
    if hasattr(signal, "SIGPIPE") and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)


def read_solid(path: Path, unit: float = 1.0) -> Any:
    """Read a mesh of tetrahedra or hexahedra, first or second order, in one of the formats `MESHES`.

    Parameters
    ----------
    path : Path
    unit : float
        Length of the file's unit, m; 1e-3 for a file in mm.

    Returns
    -------
    skfem.MeshTet2 or skfem.MeshHex2

    Raises
    ------
    SolidError
        Another format, meshio is missing or cannot read the file, or it holds no solid elements of one kind.
    """
    kind = MESHES.get(path.suffix.lower())
    if kind is None:
        raise SolidError(f"{path}: no mesh that is read; its name must end in {', '.join(MESHES)}")
    meshio = _library("meshio")
    if not path.is_file():
        raise SolidError(f"{path}: no such file")
    if kind == "abaqus" and _includes(path):
        raise SolidError(f"{path}: refers to another file by *INCLUDE; put all of the mesh into one file")
    try:
        content = getattr(meshio, kind).read(str(path))
    except Exception as error:  # its readers let out whatever damaged content makes them stumble on
        raise SolidError(f"{path}: meshio cannot read it as {kind} ({error or type(error).__name__})") from None
    solid: dict[str, list[Any]] = {}
    for block in content.cells:
        if block.type in _CORNERS:
            solid.setdefault(block.type, []).append(block.data)
    if len(solid) != 1:
        found = ", ".join(solid or sorted({block.type for block in content.cells})) or "nothing"
        raise SolidError(f"{path}: found {found}; a solid needs elements of one kind among {', '.join(_CORNERS)}")
    kind, blocks = solid.popitem()
    return second_order(unit * np.asarray(content.points), np.concatenate(blocks).astype(np.int64), kind)


def _includes(path: Path) -> bool:
    """Tell whether a file of Abaqus takes in another one; keywords as meshio understands them."""
    with path.open(encoding="utf-8", errors="replace") as lines:
        return any(line.partition(",")[0].strip().replace("*", "").upper() == "INCLUDE" for line in lines)


@dataclass(frozen=True)
class SolidFile:
    """A solid in a file, meshed or read when its mesh is asked for.

    Attributes
    ----------
    path : geometry (`GEOMETRY`) or mesh
    unit : length of the file's unit, m
    size, curvature : largest element (m) and elements around a circle, for a geometry
    scripts : whether it may run if it is a script
    """

    path: Path
    unit: float
    size: float = 0.0
    curvature: int = 12
    scripts: bool = False

    @property
    def is_geometry(self) -> bool:
        """Tell whether gmsh has to mesh it."""
        return self.path.suffix.lower() in GEOMETRY

    @property
    def is_mesh(self) -> bool:
        """Tell whether it holds a mesh in a format that is read."""
        return self.path.suffix.lower() in MESHES

    @property
    def is_script(self) -> bool:
        """Tell whether it can run commands of the system."""
        return self.path.suffix.lower() == SCRIPT

    @cached_property
    def mesh(self) -> Any:
        """Mesh of the file.

        Raises
        ------
        SolidError
            As `mesh_geometry` and `read_solid`.
        """
        if self.is_geometry:
            return mesh_geometry(self.path, self.size, self.curvature, self.unit, self.scripts)
        return read_solid(self.path, self.unit)

    @property
    def digest(self) -> bytes:
        """Hash of the file's content and of how it is meshed; the mesh is not needed for it."""
        if not self.path.is_file():
            raise SolidError(f"{self.path}: no such file")
        how = f"{self.path.suffix.lower()} {self.unit!r} {self.size!r} {self.curvature}"
        return hashlib.sha256(self.path.read_bytes() + how.encode()).digest()


def second_order(points: Floats, cells: Integers, kind: str) -> Any:
    """Mesh of second order from nodes (n, 3), cells (m, k) in the order of VTK, and their kind in meshio's words.

    Raises
    ------
    SolidError
        An element is turned inside out.
    """
    corners = cells[:, : _CORNERS[kind]]
    used, numbers = np.unique(corners, return_inverse=True)
    numbers = numbers.reshape(corners.shape)
    tetrahedral = kind.startswith("tetra")
    straight = _linear_tetrahedra(points[used], numbers) if tetrahedral else skfem_mesh(points[used], numbers)
    mesh = (skfem.MeshTet2 if tetrahedral else skfem.MeshHex2).from_mesh(straight)
    places = np.array(mesh.doflocs)
    first = len(used)
    edges = points[cells[:, _CORNERS[kind] :]]
    if kind == "tetra10":
        _place(places[:, first:], mesh.edges, numbers[:, _TET_EDGES], edges)
    elif kind in ("hexahedron20", "hexahedron27"):
        _place(places[:, first:], mesh.edges, numbers[:, _HEX_EDGES], edges[:, :12])
        first += mesh.edges.shape[1]
        faces, bodies = edges[:, 12:18], edges[:, 18:19]
        if kind == "hexahedron20":  # the serendipity element's own place of these, or linear fields are lost
            ends = points[corners]
            faces = 0.5 * edges[:, _HEX_FACE_EDGES].sum(axis=2) - 0.25 * ends[:, _HEX_FACES].sum(axis=2)
            bodies = 0.25 * edges.sum(axis=1, keepdims=True) - 0.25 * ends.sum(axis=1, keepdims=True)
        _place(places[:, first:], mesh.facets, numbers[:, _HEX_FACES], faces)
        places[:, first + mesh.facets.shape[1] :] = bodies[:, 0].T
    found = type(mesh)(places, mesh.t)
    determinant = found.mapping().detDF(skfem.quadrature.get_quadrature(found.elem(), 4)[0])
    turned = np.flatnonzero((determinant.min(axis=1) < 0.0) == (determinant.max(axis=1) > 0.0))
    if turned.size:
        raise SolidError(f"element {turned[0]} of {len(cells)} is turned inside out; mesh finer where it is curved")
    return found


def _linear_tetrahedra(points: Floats, cells: Integers) -> Any:
    return skfem.MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))


def entity_numbers(entities: Integers, corners: Integers) -> Integers:
    """Numbers (m,) of edges or faces, given by corners (m, c) in any order, among all of a mesh (c, n)."""
    known, asked = np.sort(np.asarray(entities), axis=0).T, np.sort(corners, axis=1)
    _, label = np.unique(np.concatenate([known, asked]), axis=0, return_inverse=True)
    label = label.ravel()
    number = np.empty(label.max() + 1, dtype=np.int64)
    number[label[: len(known)]] = np.arange(len(known))
    return number[label[len(known) :]]


def _place(places: Floats, entities: Integers, own: Integers, wanted: Floats) -> None:
    """Put the nodes (3, ...) of edges or faces, (corners, n), where elements (m, e, corners) want them (m, e, 3)."""
    places[:, entity_numbers(entities, own.reshape(-1, own.shape[2]))] = wanted.reshape(-1, 3).T


def _library(name: str) -> Any:
    """Import an optional library, or tell what to install."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise SolidError(f"{name} is not installed: pip install 'exugear[mesh]'") from None
    except OSError as error:
        raise SolidError(
            f"{name} is installed, but a library of the system is missing ({error}): "
            "on Debian and Ubuntu install libglu1-mesa, libxcursor1, libxft2 and libxinerama1"
        ) from None
