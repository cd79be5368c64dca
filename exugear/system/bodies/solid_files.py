"""Solids from files: shapes meshed with tetrahedra by gmsh, meshes read by meshio.

Files may be untrusted. Scripts of gmsh run only where permitted; shapes are read without neighbouring files, meshes in
formats that refer to no other file.

gmsh (under the GPL) and meshio are loaded only where used.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import signal
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from exugear.system.bodies.solid_elements import CORNERS, SolidError, second_order

SCRIPT = ".geo"
"""Ending of gmsh scripts. Such a script can run any command of the system."""
CAD = {".step": "step", ".stp": "step", ".brep": "brep"}
"""Formats of shapes that hold nothing to run, by the ending of the file."""
GEOMETRY = (SCRIPT, *CAD)
"""Endings of files that gmsh meshes."""
MESHES = {".msh": "gmsh", ".inp": "abaqus", ".bdf": "nastran", ".nas": "nastran", ".vtu": "vtu", ".vtk": "vtk"}
"""Formats of meshes that are read, by the ending of the file: one file each, which refers to no other."""
OTHER_SOLIDS = ("wedge", "pyramid")
"""Beginnings of the names of solid elements that are not supported, and must not be left out."""
SOLID_CARDS = ("CTETRA", "CHEXA", "CPENTA", "CPYRA")
"""Nastran cards of solid elements."""
UNPERMITTED = (
    "a gmsh script can run any command; if you trust it, permit it with --allow-scripts (modes, run, view) or "
    "EXUGEAR_ALLOW_SCRIPTS=1; a STEP file needs no permission"
)
"""Why a script is refused, and what would be right."""


def tetrahedra(build: Callable[[Any], None], size: float, curvature: int = 12) -> Any:
    """Mesh a solid with tetrahedra of second order by gmsh.

    Parameters
    ----------
    build : is given `gmsh.model.occ` and adds volumes to it, in m. Fused pieces keep the edges between them.
    size : largest element, m
    curvature : elements around a full circle, at least

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
    path : a script is one file: what it includes is not noticed when a reduction is looked up
    size, curvature : as in `tetrahedra`; m
    unit : length of the file's unit, m. gmsh reads STEP in mm whatever its unit is
    scripts : whether a script may run. It can do all that the user can.

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
        raise SolidError(f"{path}: unknown geometry format; its name must end in {', '.join(GEOMETRY)}")
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
    handlers = _signal_handlers()
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
        for number, handler in handlers.items():
            signal.signal(number, handler)
    if not len(kinds):
        raise SolidError("the shape has no volume to mesh")
    order = np.argsort(tags)
    cells = order[np.searchsorted(tags[order], nodes[0])].reshape(-1, 10)
    # gmsh numbers the last two edges of a tetrahedron the other way round than VTK.
    return second_order(unit * places.reshape(-1, 3), cells[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]], "tetra10")


def _signal_handlers() -> dict[int, Any]:
    """Handlers that gmsh sets back to their defaults: its broken pipes and requests to stop would end the process."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    handlers = {number: signal.getsignal(number) for number in signal.valid_signals()}
    return {number: handler for number, handler in handlers.items() if handler not in (None, signal.SIG_DFL)}


def read_solid(path: Path, unit: float = 1.0) -> Any:
    """Read a mesh of tetrahedra or hexahedra, first or second order, in one of the formats `MESHES`.

    Parameters
    ----------
    unit : length of the file's unit, m; 1e-3 for a file in mm

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
        raise SolidError(f"{path}: unknown mesh format; its name must end in {', '.join(MESHES)}")
    meshio = _library("meshio")
    if not path.is_file():
        raise SolidError(f"{path}: no such file")
    if kind == "abaqus":
        with path.open(encoding="utf-8", errors="replace") as lines:
            # As meshio interprets keywords.
            keywords = (line.partition(",")[0].strip().replace("*", "").upper() for line in lines)
            if "INCLUDE" in keywords:
                raise SolidError(f"{path}: refers to another file by *INCLUDE; write the whole mesh into one file")
    try:
        content = _read_nastran(path, meshio) if kind == "nastran" else getattr(meshio, kind).read(str(path))
    except SolidError:
        raise
    except Exception as error:  # its readers let out whatever damaged content makes them stumble on
        content = _rewritten_by_gmsh(path, meshio)
        if content is None:
            raise SolidError(f"{path}: meshio cannot read it as {kind} ({error or type(error).__name__})") from None
    solid: dict[str, list[Any]] = {}
    for block in content.cells:
        if block.type in CORNERS or block.type.startswith(OTHER_SOLIDS):
            solid.setdefault(block.type, []).append(block.data)
    if len(solid) != 1 or next(iter(solid)) not in CORNERS:
        found = ", ".join(solid or sorted({block.type for block in content.cells})) or "nothing"
        raise SolidError(
            f"{path}: contains {found}; a solid must have elements of one of the types {', '.join(CORNERS)}"
        )
    kind, blocks = solid.popitem()
    return second_order(unit * np.asarray(content.points), np.concatenate(blocks).astype(np.int64), kind)


MESH_HEAD = b"$MeshFormat"
"""Beginning of a mesh of gmsh: what begins otherwise, gmsh would run as a script."""


def _rewritten_by_gmsh(path: Path, meshio: Any) -> Any:
    """Read the content of a mesh that meshio fails to read, via gmsh; None where gmsh cannot read it either.

    With `Mesh.SaveAll` a file holds elements with and without a physical group, which meshio does not accept in format
    4; it does after conversion to format 2.2.
    """
    with path.open("rb") as file:
        if path.suffix.lower() != ".msh" or file.read(len(MESH_HEAD)) != MESH_HEAD:
            return None
    gmsh = _library("gmsh")
    handlers = _signal_handlers()
    gmsh.initialize(["exugear", "-nopopup"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.merge(str(path))
        gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
        gmsh.option.setNumber("Mesh.Binary", 0)
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / "mesh.msh"
            gmsh.write(str(copy))
            return meshio.gmsh.read(str(copy))
    except Exception:  # gmsh raises nothing narrower; the first error is reported
        return None
    finally:
        gmsh.finalize()
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _read_nastran(path: Path, meshio: Any) -> Any:
    """Read nodes and solid elements of a Nastran bulk data file, without all else that it holds.

    meshio would not come to an end on a file that is cut short, and takes no notice of coordinate systems of nodes.
    """
    kept = []
    wanted = False
    with path.open(encoding="utf-8", errors="replace") as lines:
        for number, line in enumerate(lines, start=1):
            head = line[:8].partition(",")[0].strip().upper()
            if head == "INCLUDE":
                raise SolidError(f"{path}: line {number}: refers to another file by INCLUDE; write one file")
            if head == "ENDDATA":
                break
            if line.startswith("$") or not line.strip():
                continue
            if head and head[0] not in "+*":
                card = head.removesuffix("*").removesuffix("_")  # meshio marks elements of second order by _
                wanted = card == "GRID" or card in SOLID_CARDS
                if head.endswith("*") and card in SOLID_CARDS:
                    raise SolidError(f"{path}: line {number}: {head} in fields of 16; write elements in fields of 8")
                system = _coordinate_system(line) if card == "GRID" else ""
                if system not in ("", "0"):
                    raise SolidError(
                        f"{path}: line {number}: the node is in the coordinate system {system[:16]}; write nodes in "
                        "the basic system"
                    )
            if wanted:
                kept.append(line.rstrip("\n"))
    return meshio.nastran.read(io.StringIO("\n".join(["BEGIN BULK", *kept, "ENDDATA", ""])))


def _coordinate_system(line: str) -> str:
    """Field CP of a GRID card, as text."""
    if "," in line:
        return line.split(",")[2].strip() if line.count(",") > 1 else ""
    return line[24:40].strip() if line[:8].rstrip().endswith("*") else line[16:24].strip()


@dataclass(frozen=True)
class SolidFile:
    """A solid in a file, meshed or read when its mesh is asked for."""

    path: Path
    """Geometry (`GEOMETRY`) or mesh."""
    unit: float
    """Length of the file's unit, m."""
    size: float = 0.0
    curvature: int = 12
    """Largest element (m) and elements around a circle, for a geometry."""
    scripts: bool = False
    """Whether it may run if it is a script."""

    @property
    def is_geometry(self) -> bool:
        """Return whether gmsh has to mesh it."""
        return self.path.suffix.lower() in GEOMETRY

    @property
    def is_mesh(self) -> bool:
        """Return whether it contains a mesh in a supported format."""
        return self.path.suffix.lower() in MESHES

    @property
    def is_script(self) -> bool:
        """Return whether it can run commands of the system."""
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


def _library(name: str) -> Any:
    """Import an optional library, or raise an error that states what to install."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise SolidError(f"{name} is not installed: pip install 'exugear[mesh]'") from None
    except OSError as error:
        raise SolidError(
            f"{name} is installed, but a library of the system is missing ({error}): "
            "on Debian and Ubuntu install libglu1-mesa, libxcursor1, libxft2 and libxinerama1"
        ) from None
