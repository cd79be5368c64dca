"""Files of matrices on interface nodes: each form against files written here by hand, and by its own writer."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from exugear.system.bodies.matrix_files.abaqus import read_inp_nodes, read_mtx
from exugear.system.bodies.matrix_files.files import (
    INSTEAD,
    MatrixFiles,
    MatrixFormat,
    file_contents,
    keys_of,
    read_matrices,
)
from exugear.system.bodies.matrix_files.interface import UNIT_SYSTEMS, InterfaceMatrices, MatrixFileError
from exugear.system.bodies.matrix_files.op4 import read_op4
from exugear.system.bodies.matrix_files.punch import nastran_real, read_punch

from ...cases.beams import frame, sorted_frame

FORMATS: tuple[MatrixFormat, ...] = get_args(MatrixFormat)
BOTH = frozenset({"KAAX", "MAAX"})


def written(folder: Path, body: InterfaceMatrices, form: MatrixFormat) -> MatrixFiles:
    for name, content in file_contents(body, "body", form).items():
        (folder / name).write_bytes(content)
    return MatrixFiles(**{key: folder / name for key, name in keys_of("body", form).items()})


def relative(found: np.ndarray, wanted: np.ndarray) -> float:
    """Largest difference over the diagonal entries of row and column: entries differ in unit."""
    scale = np.sqrt(np.abs(np.diag(wanted)))
    return float((np.abs(found - wanted) / np.outer(scale, scale)).max())


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("modes", [0, 2])
def test_what_is_written_is_read_back(tmp_path: Path, form: MatrixFormat, modes: int) -> None:
    # All digits, but for punch files: their 16 columns hold at least ten.
    body = sorted_frame(modes)
    found = read_matrices(written(tmp_path, body, form))
    assert (found.nodes, found.modal) == (body.nodes, body.modal)
    tolerance = 2e-10 if form == "dmig" else 0.0
    assert found.positions == pytest.approx(body.positions, rel=1e-9, abs=0.0)
    assert relative(found.mass, body.mass) <= tolerance
    assert relative(found.stiffness, body.stiffness) <= tolerance


@pytest.mark.parametrize("form", FORMATS)
def test_the_order_of_nodes_in_a_file_is_not_that_of_their_numbers(tmp_path: Path, form: MatrixFormat) -> None:
    """Only op4 has no labels: there the order is that of the node table, which a punch file gives by number."""
    body = sorted_frame() if form == "op4" else frame()
    found = read_matrices(written(tmp_path, body, form))
    assert found.nodes == sorted_frame().nodes
    assert relative(found.stiffness, sorted_frame().stiffness) < 2e-10


@pytest.mark.parametrize("units", UNIT_SYSTEMS)
def test_energies_are_the_same_in_every_unit_system(units: str) -> None:
    # A motion in m and rad is one in the other unit of length; its energies in J are those there times the unit.
    body = frame()
    other = body.from_si(units)
    length, mass, time = UNIT_SYSTEMS[units]
    random = np.random.default_rng(3)
    motion = random.normal(size=body.size)
    scale = np.concatenate([np.tile([length] * 3 + [1.0] * 3, 4), [np.sqrt(mass) * length] * 2])
    joule = mass * length**2 / time**2
    in_other = motion / scale
    assert joule * in_other @ other.stiffness @ in_other == pytest.approx(motion @ body.stiffness @ motion, rel=1e-12)
    assert joule * time**2 * in_other @ other.mass @ in_other == pytest.approx(motion @ body.mass @ motion, rel=1e-12)
    assert np.allclose(other.to_si(units).stiffness, body.stiffness, rtol=1e-13)
    assert np.diag(other.mass)[-2:] == pytest.approx(1.0, rel=1e-12)  # modes of unit mass stay so


def test_the_unit_of_mass_of_inches_and_pounds_is_175_kg() -> None:
    # 1 lbf s2/inch = 4.4482216152605 N s2 / 0.0254 m (NIST SP 811).
    assert UNIT_SYSTEMS["inch-lbf-s"].mass == pytest.approx(175.126835, rel=1e-8)


def test_a_turned_body_has_the_same_eigenvalues_and_turned_positions() -> None:
    body = frame()
    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    moved = body.moved(turn, (0.1, 0.2, 0.3))
    assert moved.positions[1] == pytest.approx(turn @ body.positions[1] + (0.1, 0.2, 0.3))
    rigid = moved.rigid_motions((0.0, 0.0, 0.0))
    assert np.abs(moved.stiffness @ rigid).max() < 1e-6 * np.abs(moved.stiffness).max()
    assert np.linalg.eigvalsh(moved.mass) == pytest.approx(np.linalg.eigvalsh(body.mass), rel=1e-9)


# Nastran punch, by hand

HEADER = "DMIG    KAAX           0       6       2       0                      12\n"


def test_small_wide_and_free_fields_of_a_punch_file_say_the_same(tmp_path: Path) -> None:
    small = tmp_path / "small.pch"
    cards = [
        ("GRID", "12", "", "1.", "0.5", "-2."),
        ("SPOINT", "900001"),
        ("DMIG", "MAAX", "0", "6", "2", "0", "", "", "7"),
        ("DMIG", "MAAX", "12", "1", "", "12", "1", "2.5", ""),
        ("+", "12", "3", "1.5-1", "", "900001", "0", "-.75"),
        ("DMIG", "MAAX", "900001", "0", "", "900001", "0", "1.D0"),
    ]
    lines = ["$ a comment", *(f"{name:8}" + "".join(f"{word:>8}" for word in words) for name, *words in cards)]
    small.write_text("\n".join(lines) + "\n", encoding="utf-8")
    wide = tmp_path / "wide.pch"
    wide.write_text(
        f"GRID*   {12:16d}{'':16}{1.0:16.9E}{0.5:16.9E}\n*       {-2.0:16.9E}\n"
        f"SPOINT  {900001:8d}\n"
        "DMIG    MAAX           0       6       2       0                       7\n"
        f"DMIG*   {'MAAX':16}{12:16d}{1:16d}\n"
        f"*       {12:16d}{1:16d}{'2.500000000D+00':>16}\n"
        f"*       {12:16d}{3:16d}{'1.5D-01':>16}\n"
        f"*       {900001:16d}{0:16d}{'-7.5E-01':>16}\n"
        f"DMIG*   {'MAAX':16}{900001:16d}{0:16d}\n"
        f"*       {900001:16d}{0:16d}{'1.0':>16}\n",
        encoding="utf-8",
    )
    free = tmp_path / "free.pch"
    free.write_text(
        "GRID,12,,1.0,.5,-2.0\nSPOINT,900001\nDMIG,MAAX,0,6,2,0,,,7\n"
        "DMIG,MAAX,12,1,,12,1,2.5,\n,12,3,.15,,900001,0,-.75\nDMIG,MAAX,900001,0,,900001,0,1.0\n",
        encoding="utf-8",
    )
    for file in (small, wide, free):
        matrices, names, nodes = read_punch(file, BOTH)
        assert names == ("MAAX",)
        assert dict(nodes.positions) == {12: (1.0, 0.5, -2.0)}
        assert nodes.order == (*((12, k) for k in range(1, 7)), (900001, 0))
        assert matrices["MAAX"].labels == ((12, 1), (12, 3), (900001, 0))
        assert matrices["MAAX"].values.tolist() == [[2.5, 0.15, -0.75], [0.15, 0.0, 0.0], [-0.75, 0.0, 1.0]]


def test_form_1_lists_both_triangles_and_is_not_doubled(tmp_path: Path) -> None:
    file = tmp_path / "both.pch"
    text = HEADER.replace("       6       2", "       1       2")
    text += "DMIG,KAAX,12,1,,12,1,3.0,\n,12,2,-1.0\nDMIG,KAAX,12,2,,12,1,-1.0,\n,12,2,4.0\n"
    file.write_text(text, encoding="utf-8")
    assert read_punch(file, BOTH)[0]["KAAX"].values.tolist() == [[3.0, -1.0], [-1.0, 4.0]]


def test_local_axes_are_removed(tmp_path: Path) -> None:
    """A node with displacements in axes turned by CORD2R, 30 degrees about z: K is that of the frame in global axes."""
    body = sorted_frame(0)
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    local = np.eye(body.size)
    for start in (6, 9):  # the second node, number 12
        local[start : start + 3, start : start + 3] = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]
    turned = InterfaceMatrices(
        body.nodes, body.positions, (), local @ body.mass @ local.T, local @ body.stiffness @ local.T
    )
    files = written(tmp_path, turned, "dmig")
    text = files.file.read_text(encoding="utf-8").splitlines()
    at = next(n for n, line in enumerate(text) if line.startswith("GRID*") and int(line[8:24]) == 12)
    text[at + 1] = text[at + 1][:24] + f"{10:16d}"
    text.insert(0, f"CORD2R,10,0,1.,2.,3.,1.,2.,4.,\n,{float(1 + c)!r},{float(2 + s)!r},3.")
    files.file.write_text("\n".join(text) + "\n", encoding="utf-8")
    found = read_matrices(files)
    assert relative(found.stiffness, body.stiffness) < 2e-10
    assert relative(found.mass, body.mass) < 2e-10


def test_positions_in_a_system_defined_in_another_are_moved_to_the_basic_one(tmp_path: Path) -> None:
    file = tmp_path / "nodes.pch"
    file.write_text(
        "CORD2R,1,0,1.,0.,0.,1.,0.,1.,\n,1.,1.,0.\n"  # at (1, 0, 0), x along the basic y
        "CORD2R,2,1,0.,0.,5.,0.,0.,6.,\n,1.,0.,5.\n"  # 5 above it
        "GRID,3,2,2.,0.,1.,2\n",
        encoding="utf-8",
    )
    nodes = read_punch(file, frozenset())[2]
    assert nodes.positions[3] == pytest.approx((1.0, 2.0, 6.0))
    assert nodes.axes[3] == pytest.approx(np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))


def test_the_external_superelement_card_states_the_order_of_op4_matrices(tmp_path: Path) -> None:
    body = frame()  # nodes in no order
    files = written(tmp_path, body, "op4")
    order = [word for node in body.nodes for word in (str(node), "123456")]
    order += [word for number in body.modal for word in (str(number), "0")]
    lines = [order[n : n + 8] for n in range(0, len(order), 8)]
    card = "\n".join(
        ("EXTRN   " if n == 0 else " " * 8) + "".join(f"{w:>8}" for w in line) for n, line in enumerate(lines)
    )
    files.nodes.write_text(files.nodes.read_text(encoding="utf-8") + card + "\n", encoding="utf-8")
    assert relative(read_matrices(files).stiffness, sorted_frame().stiffness) == 0.0


@pytest.mark.parametrize("value", [1.0, -1.0 / 3.0, 9.99999999999999e9, -9.99999999999e-10, 1e36, 5e-300, -2.5e100])
def test_a_number_in_16_columns_has_at_least_nine_digits(value: float) -> None:
    text = nastran_real(value)
    assert len(text) == 16
    assert float(text.replace("D", "E")) == pytest.approx(value, rel=1e-9 if abs(value) < 1e-90 else 1e-10)


# Abaqus, by hand


def test_matrix_input_lists_one_triangle_or_both(tmp_path: Path) -> None:
    one, both = tmp_path / "one.mtx", tmp_path / "both.mtx"
    one.write_text("** comment\n3,1, 3,1, 4.0e+0\n3,2, 3,1, -1.0\n-5,1, 3,2, 2.5D-01\n", encoding="utf-8")
    both.write_text(one.read_text(encoding="utf-8") + "3,1, 3,2, -1.0\n3,2, -5,1, 0.25\n", encoding="utf-8")
    for file in (one, both):
        matrix = read_mtx(file)["matrix"]
        assert matrix.labels == ((3, 1), (3, 2), (-5, 1))
        assert matrix.values.tolist() == [[4.0, -1.0, 0.0], [-1.0, 0.0, 0.25], [0.0, 0.25, 0.0]]


def test_user_element_of_two_nodes_and_a_mode(tmp_path: Path) -> None:
    """Lower triangle row by row, four values a line; the second line of components applies from the third node on."""
    body = InterfaceMatrices((4, 9), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), (900001,), np.eye(13), np.eye(13))
    random = np.random.default_rng(1).normal(size=(2, 13, 13))
    stiffness, mass = random @ random.transpose(0, 2, 1)
    lines = ["**", "*USER ELEMENT, NODES=3, LINEAR", "** ELEMENT NODES", "** 4, 9, 900001", "1, 2, 3, 4, 5, 6", "3, 1"]
    for name, matrix in (("STIFFNESS", stiffness), ("MASS", mass)):
        lines.append(f"*MATRIX,TYPE={name}")
        values = [f"{value:.16e}" for value in matrix[np.tril_indices(13)]]
        lines += [", ".join(values[n : n + 4]) + ("," if n + 4 < len(values) else "") for n in range(0, len(values), 4)]
    (tmp_path / "sub.mtx").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "model.inp").write_text(
        "*HEADING\n*NODE, NSET=ALL\n4, 0., 0., 0.\n9, 1.0, 0.\n77, 3., 3., 3.\n*ELEMENT, TYPE=C3D4\n1, 4, 9, 77, 4\n",
        encoding="utf-8",
    )
    found = read_matrices(MatrixFiles(tmp_path / "sub.mtx", nodes=tmp_path / "model.inp"))
    assert (found.nodes, found.modal) == (body.nodes, (900001,))
    assert np.array_equal(found.stiffness, stiffness)
    assert np.array_equal(found.mass, mass)
    assert read_inp_nodes(tmp_path / "model.inp").positions[9] == (1.0, 0.0, 0.0)


# op4, binary and packed, by hand

MATRIX = np.array([[4.0, -1.0, 0.0, 0.5], [-1.0, 3.0, 0.0, 0.0], [0.0, 0.0, 2.0, -0.25], [0.5, 0.0, -0.25, 1.0]])


def binary_op4(order: str, word: int, packing: str, name: str = "KAAX", kind: int = 2) -> bytes:
    """A matrix as records of Fortran, as the manuals describe OUTPUT4: dense, sparse, or sparse with `bigmat`."""
    integer = "i" if word == 4 else "q"
    real = "f" if kind == 1 and word == 4 else "d"
    per_value = struct.calcsize(real) // word

    def record(content: bytes) -> bytes:
        length = struct.pack(f"{order}i", len(content))
        return length + content + length

    def integers(*values: int) -> bytes:
        return struct.pack(f"{order}{len(values)}{integer}", *values)

    size = len(MATRIX)
    rows = -size if packing == "bigmat" else size
    content = record(integers(size, rows, 6, kind) + name.ljust(2 * word).encode())
    for column in range(size):
        values = MATRIX[:, column]
        if packing == "dense":
            body = struct.pack(f"{order}{size}{real}", *values)
            content += record(integers(column + 1, 1, size * per_value) + body)
            continue
        body = b""
        for row in np.flatnonzero(values):
            words = per_value
            head = (
                integers(words + 1, int(row) + 1)
                if packing == "bigmat"
                else integers(int(row) + 1 + 65536 * (words + 1))
            )
            body += head + struct.pack(f"{order}{real}", values[row])
        content += record(integers(column + 1, 0, len(body) // word) + body)
    return content + record(integers(size + 1, 1, per_value) + struct.pack(f"{order}{real}", 1.0))


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("word", [4, 8])
@pytest.mark.parametrize("packing", ["dense", "sparse", "bigmat"])
@pytest.mark.parametrize("kind", [1, 2])
def test_binary_op4_of_both_byte_orders_and_all_packings(
    tmp_path: Path, order: str, word: int, packing: str, kind: int
) -> None:
    file = tmp_path / "body.op4"
    other = binary_op4(order, word, packing, "PHIX", kind)
    file.write_bytes(other + binary_op4(order, word, packing, "KAAX", kind))
    matrices, names = read_op4(file, BOTH)
    assert names == ("PHIX", "KAAX")
    assert np.array_equal(matrices["KAAX"].values, MATRIX)  # powers of two: exact in single precision


def test_a_complex_matrix_beside_the_wanted_ones_is_skipped(tmp_path: Path) -> None:
    file = tmp_path / "body.op4"
    file.write_bytes(binary_op4("<", 4, "dense", "K4AAX", 4) + binary_op4("<", 4, "dense"))
    assert np.array_equal(read_op4(file, BOTH)[0]["KAAX"].values, MATRIX)
    file.write_bytes(binary_op4("<", 4, "dense", "KAAX", 4))
    with pytest.raises(MatrixFileError, match="KAAX is complex"):
        read_op4(file, BOTH)


def text_op4(packing: str) -> str:
    """The same matrix as text with numbers that touch, `5E16.9`."""
    size = len(MATRIX)
    rows = -size if packing == "bigmat" else size
    lines = [f"{size:8d}{rows:8d}{6:8d}{2:8d}{'KAAX':8}1P,5E16.9"]
    for column in range(size):
        values = MATRIX[:, column]
        if packing == "dense":
            lines += [f"{column + 1:8d}{1:8d}{size:8d}", "".join(f"{value:16.9E}" for value in values)]
            continue
        found = np.flatnonzero(values)
        heads = 2 if packing == "bigmat" else 1
        lines.append(f"{column + 1:8d}{0:8d}{len(found) * (2 + heads):8d}")
        for row in found:
            lines.append(f"{3:8d}{row + 1:8d}" if packing == "bigmat" else f"{row + 1 + 65536 * 3:12d}")
            lines.append(f"{values[row]:16.9E}")
    return "\n".join([*lines, f"{size + 1:8d}{1:8d}{1:8d}", f"{1.0:16.9E}"]) + "\n"


@pytest.mark.parametrize("packing", ["dense", "sparse", "bigmat"])
def test_text_op4_of_all_packings(tmp_path: Path, packing: str) -> None:
    file = tmp_path / "body.op4"
    file.write_text(text_op4(packing), encoding="utf-8")
    assert np.array_equal(read_op4(file, BOTH)[0]["KAAX"].values, MATRIX)


# What is refused, and what to do


@pytest.mark.parametrize("ending", INSTEAD)
def test_files_of_other_kinds_are_refused_with_what_to_write_instead(tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"body{ending}"
    file.write_bytes(b"\0" * 100)
    with pytest.raises(MatrixFileError, match=r"are not read; write .* instead"):
        read_matrices(MatrixFiles(file))


@pytest.mark.parametrize(
    ("ending", "text", "message"),
    [
        ("pch", HEADER + 2 * "DMIG,KAAX,12,1,,12,1,3.0\n", "node 12, component 1 .* occurs twice"),
        ("pch", HEADER.replace("       6       2", "       6       4"), "form 6 and type 4; only real"),
        ("pch", HEADER.replace("       6       2", "       9       2"), "form 9 and type 2; only real"),
        ("pch", "DMIG,KAAX,12,1,,12,1,3.0\n", "line 1: DMIG KAAX has no header card"),
        ("pch", HEADER + "DMIG,KAAX,12,1,,12,1,3.0x\n", "line 2: DMIG: '3.0x' is not a number"),
        ("pch", "GRID,1,7,0.,0.,0.\n", "line 1: coordinate system 7 is not defined"),
        ("pch", "CORD2R,7,7,0.,0.,0.,0.,0.,1.,\n,1.,0.,0.\nGRID,1,7,0.,0.,0.\n", "coordinate system 7"),
        ("pch", "CORD2R,7,,0.,0.,0.,0.,0.,1.,\n,0.,0.,2.\nGRID,1,7,0.,0.,0.\n", "its three points lie on a line"),
        ("pch", "SPOINT,1,THRU,900000000\n", "SPOINT 1 THRU 900000000; expected up to"),
        ("mtx", "1,1, 1,1, 1e36\n", "at node 1, component 1; such entries mark supports"),
        ("mtx", "1 1 2.0\n", "instead of FORMAT=COORDINATE"),
        ("mtx", "1,1, 2.0\n", "instead of FORMAT=COORDINATE"),
        ("mtx", "*USER ELEMENT\n1,2,3\n*MATRIX,TYPE=STIFFNESS\n1.0,\n", "its node list is missing"),
        ("mtx", "*USER ELEMENT\n1,2,3\n", "no .MATRIX, TYPE=STIFFNESS or MASS"),
        ("csv", "1.1,1.2\n1.0,2.0\n", "1 rows for 2 headings"),
        ("csv", "1.1\n1.0\n2.0\n", "more rows for 1 headings"),
        ("csv", "1.1,1.2\n1.0,2.0\n1.0\n", "line 3: 1 numbers; expected 2"),
        ("csv", "1.1,1.1\n1.0,2.0\n1.0,2.0\n", "heading 1.1 occurs twice"),
        ("csv", "ux,uy\n1.0,2.0\n1.0,2.0\n", "heading 'ux'; expected NODE.COMPONENT"),
        ("csv", "1.1\nnan\n", "line 2: column 1 is not finite"),
        ("csv", "", "is empty"),
        ("npz", "no zip", "not a readable NPZ file"),
        ("op4", "", "no matrix"),
        ("op4", text_op4("dense").replace("       4       4", "  999999  999999", 1), "999999 coordinates; 1 to 3000"),
        ("op4", "\n".join(text_op4("dense").splitlines()[:4]), "ends after line 4 inside matrix KAAX"),
        ("op4", text_op4("dense").replace("       1       4", "       3       4", 1), "column 1 has rows 3 to 6"),
        ("op4", text_op4("dense").replace("       1       4", "       199999999", 1), "states 99999999 words"),
        ("txt", "", "unknown format; its name must end in"),
    ],
)  # fmt: skip
def test_a_damaged_file_is_one_error_that_names_file_and_place(
    tmp_path: Path, ending: str, text: str, message: str
) -> None:
    file = tmp_path / f"body.{ending}"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(MatrixFileError, match=message) as refused:
        read_matrices(MatrixFiles(file) if ending != "csv" else MatrixFiles(stiffness=file, mass=file))
    assert str(refused.value).startswith(str(file))


def test_missing_matrices_nodes_and_positions_are_named(tmp_path: Path) -> None:
    files = written(tmp_path, frame(), "csv")
    with pytest.raises(MatrixFileError, match=r"contains no positions of nodes; set nodes"):
        read_matrices(MatrixFiles(stiffness=files.stiffness, mass=files.mass))
    with pytest.raises(MatrixFileError, match=r"contains one matrix; set the keys stiffness and mass"):
        read_matrices(MatrixFiles(files.stiffness, nodes=files.nodes))
    lines = files.nodes.read_text(encoding="utf-8").splitlines()
    files.nodes.write_text("\n".join(line for line in lines if not line.startswith("101,")), encoding="utf-8")
    with pytest.raises(MatrixFileError, match="node 101 of the matrices has no position"):
        read_matrices(files)
    op4 = written(tmp_path, frame(), "op4")
    with pytest.raises(MatrixFileError, match="no stiffness matrix named KUUX; matrices are KAAX, MAAX"):
        read_matrices(MatrixFiles(op4.file, nodes=op4.nodes, names={"stiffness": "KUUX"}))
    text = op4.nodes.read_text(encoding="utf-8").replace("SPOINT    900002\n", "")
    op4.nodes.write_text(text, encoding="utf-8")
    with pytest.raises(
        MatrixFileError, match="25 coordinates in the order of the nodes, but the stiffness matrix has 26"
    ):
        read_matrices(op4)
