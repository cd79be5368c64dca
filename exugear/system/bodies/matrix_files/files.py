"""Reading of reduced matrices from one or several files by their endings, and writing in a chosen format."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from exugear.system.bodies.matrix_files.abaqus import mtx_content, read_inp_nodes, read_mtx
from exugear.system.bodies.matrix_files.interface import (
    InterfaceMatrices,
    LabelledMatrix,
    MatrixFileError,
    NodeTable,
    interface_matrices,
)
from exugear.system.bodies.matrix_files.op4 import op4_content, read_op4
from exugear.system.bodies.matrix_files.plain import (
    csv_matrix_content,
    csv_nodes_content,
    npz_content,
    read_csv_matrix,
    read_csv_nodes,
    read_npz,
)
from exugear.system.bodies.matrix_files.punch import punch_content, punch_nodes_content, read_punch
from exugear.system.bodies.matrix_files.recovery import read_recovery, recovery_content, with_surface

MatrixFormat = Literal["npz", "csv", "mtx", "op4", "dmig"]
Kind = Literal["stiffness", "mass", "gyroscopic"]
KINDS: tuple[Kind, ...] = ("stiffness", "mass")
"""Matrices of every body."""
PUNCH = (".pch", ".bdf", ".dat", ".nas", ".asm")
"""Endings of Nastran punch and bulk data files."""
ENDINGS = (".npz", ".csv", ".mtx", ".op4", *PUNCH)
"""Endings of files with matrices."""
NODE_ENDINGS = (".csv", ".inp", ".npz", *PUNCH)
"""Endings of files with nodes."""
NAMES: Mapping[Kind, tuple[str, ...]] = {
    "stiffness": ("KAAX", "KAA", "KXX", "KGG", "K2GG", "K", "STIFF"),
    "mass": ("MAAX", "MAA", "MXX", "MGG", "M2GG", "M", "MASS"),
    "gyroscopic": ("GAAX", "GYRO", "BAAX", "BAA", "BGG", "B2GG", "G", "D"),
}
"""Usual names of the matrices in Nastran files, the first ones preferred."""
WRITTEN_NAMES = {"stiffness": "KAAX", "mass": "MAAX"}
"""Names of the matrices in files written here."""
INSTEAD = {
    ".op2": "write op4 and punch files in Nastran instead: EXTSEOUT(ASMBULK,EXTBULK,EXTID=1,MATOP4=30), or matrices as "
    "DMIG by EXTSEOUT(...,DMIGPCH)",
    ".sub": "write DMIG in Ansys APDL instead: *DMAT,K,D,IMPORT,SUB,file.sub,STIFF and *EXPORT,K,DMIG,file.pch, the "
    "same for MASS",
    ".h3d": "write DMIG in OptiStruct instead: PARAM,EXTOUT,DMIGPCH",
    ".sim": "write text in Abaqus instead: *SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED",
}
"""Files that are not read, and what to write in the program that made them."""


@dataclass(frozen=True)
class MatrixFiles:
    """Files of a body: `file` with both matrices, or one for each; and the nodes, if these have no positions.

    A gyroscopic matrix has a file of its own.
    """

    file: Path | None = None
    stiffness: Path | None = None
    mass: Path | None = None
    nodes: Path | None = None
    names: Mapping[Kind, str] | None = None
    """Names of the matrices in Nastran files; by default the first of `NAMES` that is there."""
    gyroscopic: Path | None = None
    recovery: Path | None = None
    """Surface, see `exugear.system.bodies.matrix_files.recovery`."""
    recovery_matrix: Path | None = None
    """Its recovery matrix in an op4 file."""

    @property
    def paths(self) -> tuple[Path, ...]:
        """All files."""
        given = (self.file, self.stiffness, self.mass, self.nodes, self.gyroscopic, self.recovery, self.recovery_matrix)
        return tuple(path for path in given if path is not None)


def read_matrices(files: MatrixFiles) -> InterfaceMatrices:
    """Read the matrices of a body, in the units of its files.

    Raises
    ------
    MatrixFileError
        A file cannot be used: its format is unknown, it is damaged, or a matrix or the positions of nodes are missing.

    Examples
    --------
    >>> import numpy as np, tempfile
    >>> body = InterfaceMatrices((7, 8), np.eye(2, 3), (), np.eye(12), np.zeros((12, 12)))
    >>> folder = Path(tempfile.mkdtemp())
    >>> for name, content in file_contents(body, "body", "npz").items():
    ...     _ = (folder / name).write_bytes(content)
    >>> read_matrices(MatrixFiles(folder / "body.npz"))
    <InterfaceMatrices: 2 interface nodes, 0 modal coordinates>
    """
    tables: list[tuple[Path, NodeTable]] = []
    matrices: dict[Kind, LabelledMatrix] = {}
    contents: dict[Path, tuple[dict[str, LabelledMatrix], tuple[str, ...], NodeTable | None]] = {}
    # Of Nastran files only matrices of these names are read.
    stated = files.names or {}
    wanted = frozenset(name.upper() for kind in KINDS for name in ([stated[kind]] if kind in stated else NAMES[kind]))
    for kind in KINDS:
        path = files.file or (files.stiffness if kind == "stiffness" else files.mass)
        if path is None:
            raise MatrixFileError(f"no file for the {kind} matrix; set file, or both stiffness and mass")
        if path not in contents:
            contents[path] = _read(path, wanted)
        found, others, table = contents[path]
        matrices[kind] = _chosen(path, found, others, kind, files)
        if table is not None and table.positions:
            tables.append((path, table))
    if files.nodes is not None:
        tables = [(files.nodes, read_nodes(files.nodes))]
    if not tables:
        raise MatrixFileError(
            f"{files.paths[0]}: contains no positions of nodes; set nodes to a file with them, "
            f"whose name ends in {', '.join(NODE_ENDINGS)}"
        )
    path, table = tables[0]
    more: dict[str, LabelledMatrix] = {}
    if files.gyroscopic is not None:
        found, others, _ = _read(files.gyroscopic, frozenset(NAMES["gyroscopic"]))
        more["gyroscopic"] = _chosen(files.gyroscopic, found, others, "gyroscopic", files)
    if files.recovery is None:
        return interface_matrices(matrices["stiffness"], matrices["mass"], table, path, more)
    recovery = read_recovery(files.recovery, files.recovery_matrix)
    more["normal_motion"] = recovery.normal_motion
    combined = interface_matrices(matrices["stiffness"], matrices["mass"], table, path, more)
    return with_surface(combined, recovery, files.recovery)


def read_nodes(path: Path) -> NodeTable:
    """Read the interface nodes of a file.

    Raises
    ------
    MatrixFileError
        The format is unknown, or the file is damaged or has no nodes.
    """
    ending = path.suffix.lower()
    if ending == ".csv":
        return read_csv_nodes(path)
    if ending == ".inp":
        return read_inp_nodes(path)
    if ending == ".npz":
        return read_npz(path)[1]
    if ending in PUNCH:
        return read_punch(path, frozenset())[2]
    raise MatrixFileError(f"{path}: unknown format of nodes; its name must end in {', '.join(NODE_ENDINGS)}")


def _read(path: Path, wanted: frozenset[str]) -> tuple[dict[str, LabelledMatrix], tuple[str, ...], NodeTable | None]:
    """Matrices that are read from a file, names of all that it has, and its nodes if it has some."""
    ending = path.suffix.lower()
    if ending in INSTEAD:
        raise MatrixFileError(f"{path}: files {ending} are not read; {INSTEAD[ending]}")
    table = None
    if ending == ".npz":
        matrices, table = read_npz(path)
        return matrices, tuple(matrices), table
    if ending == ".csv":
        return {"matrix": read_csv_matrix(path)}, ("matrix",), None
    if ending == ".mtx":
        matrices = read_mtx(path)
        return matrices, tuple(matrices), None
    if ending == ".op4":
        return (*read_op4(path, wanted), None)
    if ending in PUNCH:
        return read_punch(path, wanted)
    raise MatrixFileError(f"{path}: unknown format; its name must end in {', '.join(ENDINGS)}")


def _chosen(
    path: Path, found: Mapping[str, LabelledMatrix], others: tuple[str, ...], kind: Kind, files: MatrixFiles
) -> LabelledMatrix:
    """Choose the stiffness or mass matrix of a file."""
    stated = None if files.names is None else files.names.get(kind)
    candidates = [stated.upper()] if stated is not None else [kind, *NAMES[kind]]
    if files.file is None or kind == "gyroscopic":
        candidates.append("matrix")
    name = next((name for name in candidates if name in found), None)
    if name is None and "matrix" in found:
        raise MatrixFileError(
            f"{path}: contains one matrix; set the keys stiffness and mass, each to its file, instead of file"
        )
    if name is None:
        known = ", ".join(others[:20]) or "none"
        named = "" if stated is None else f" named {stated}"
        raise MatrixFileError(
            f"{path}: no {kind} matrix{named}; matrices are {known}; "
            + (f"name it {NAMES[kind][0]}" if kind == "gyroscopic" else f"set {kind}_name to the name of one")
        )
    return found[name]


def file_contents(matrices: InterfaceMatrices, stem: str, form: MatrixFormat) -> dict[str, bytes]:
    """Content of the files of a body, by file name.

    Parameters
    ----------
    stem : beginning of the file names
    form : npz, csv, mtx (Abaqus matrix input) and op4 (ASCII) keep all digits; dmig (Nastran punch) ten to fourteen
    """
    more = {} if matrices.normal_motion is None else {f"{stem}-surface.npz": recovery_content(matrices)}
    if matrices.gyroscopic is not None:
        more[gyroscopic_name(stem)] = csv_matrix_content(matrices, "gyroscopic")
    if form == "npz":
        return {f"{stem}.npz": npz_content(matrices)} | more
    if form == "dmig":
        return {f"{stem}.pch": punch_content(matrices, WRITTEN_NAMES)} | more
    if form == "op4":
        return more | {
            f"{stem}.op4": op4_content(matrices, WRITTEN_NAMES),
            f"{stem}-nodes.pch": punch_nodes_content(matrices),
        }
    content = csv_matrix_content if form == "csv" else mtx_content
    files = {f"{stem}-{kind}.{form}": content(matrices, kind) for kind in KINDS}
    return {**files, f"{stem}-nodes.csv": csv_nodes_content(matrices)} | more


def gyroscopic_name(stem: str) -> str:
    """Name of the file of a gyroscopic matrix, a CSV table beside the files of any format."""
    return f"{stem}-gyroscopic.csv"


def keys_of(stem: str, form: MatrixFormat, with_surface: bool = False, with_gyroscopic: bool = False) -> dict[str, str]:
    """Keys of `[bodies.NAME.external]` that name the files of `file_contents`."""
    if with_gyroscopic:
        return {**keys_of(stem, form, with_surface), "gyroscopic": gyroscopic_name(stem)}
    if with_surface:
        return {**keys_of(stem, form), "recovery": f"{stem}-surface.npz"}
    if form in ("npz", "dmig"):
        return {"file": f"{stem}.{'pch' if form == 'dmig' else form}"}
    if form == "op4":
        return {"file": f"{stem}.op4", "nodes": f"{stem}-nodes.pch"}
    return {**{kind: f"{stem}-{kind}.{form}" for kind in KINDS}, "nodes": f"{stem}-nodes.csv"}
