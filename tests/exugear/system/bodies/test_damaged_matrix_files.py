"""Damaged, truncated and hostile files of matrices: each is read, or refused by one error, in little memory."""

from __future__ import annotations

import io
import random
import struct
import tracemalloc
import zipfile
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from exugear.system.bodies.matrix_files.files import MatrixFiles, MatrixFormat, file_contents, keys_of, read_matrices
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices, MatrixFileError
from exugear.system.bodies.matrix_files.op4 import read_op4
from exugear.system.bodies.matrix_files.plain import npz_content

from ...cases.beams import sorted_frame
from .test_matrix_files import BOTH, binary_op4

FORMATS: tuple[MatrixFormat, ...] = get_args(MatrixFormat)
DAMAGES = (40, pytest.param(800, marks=pytest.mark.long))
"""Damaged copies of each file; more before a release."""
MEMORY = 3_000_000
"""Most memory that reading one of them may take, bytes; the matrices have 26 coordinates."""
EXTREME = (
    b"0",
    b"-1",
    b"999999999",
    b"9" * 18,
    b"9" * 400,
    b"1e308",
    b"nan",
    b"",
    b"\x00",
    b"\xff\xff\xff\x7f",
    b"KAAX",
)


def damaged(content: bytes, chance: random.Random) -> bytes:
    """Return a content cut short, with bytes changed, pieces moved, or numbers exchanged for extreme ones."""
    kind = chance.randrange(5)
    at = chance.randrange(len(content))
    if kind == 0:
        return content[:at]
    if kind == 1:
        return content[:at] + bytes([chance.randrange(256)]) + content[at + 1 :]
    if kind == 2:
        return content[:at] + chance.choice(EXTREME) + content[at + chance.randrange(9) :]
    if kind == 3:
        end = min(len(content), at + chance.randrange(200))
        return content[:at] + content[end:]
    other = chance.randrange(len(content))
    return content[:at] + content[other : other + 100] + content[at:]


def read_in_little_memory(files: MatrixFiles) -> bool:
    """Whether damaged files were read; an error must be that of this package, and name one of them."""
    tracemalloc.start()
    try:
        read_matrices(files)
    except MatrixFileError as error:
        assert any(str(path) in str(error) for path in files.paths), str(error)
        assert len(str(error)) < 1500 + 2 * len(str(files.paths[0]))
        return False
    else:
        return True
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < MEMORY, f"{peak} bytes"


@pytest.mark.parametrize("damages", DAMAGES)
@pytest.mark.parametrize("form", FORMATS)
def test_a_damaged_file_is_read_or_is_one_error(tmp_path: Path, form: MatrixFormat, damages: int) -> None:
    chance = random.Random(form)
    contents = file_contents(sorted_frame(), "body", form)
    files = MatrixFiles(**{key: tmp_path / name for key, name in keys_of("body", form).items()})
    refused = 0
    for _ in range(damages):
        for name, content in contents.items():
            (tmp_path / name).write_bytes(content)
        name = chance.choice(sorted(contents))
        (tmp_path / name).write_bytes(damaged(contents[name], chance))
        refused += not read_in_little_memory(files)
    assert refused > damages // 4  # digits of a number that change leave a readable file


@pytest.mark.parametrize("damages", DAMAGES)
@pytest.mark.parametrize("packing", ["dense", "sparse", "bigmat"])
def test_a_damaged_binary_file_is_read_or_is_one_error(tmp_path: Path, packing: str, damages: int) -> None:
    chance = random.Random(packing)
    file = tmp_path / "body.op4"
    for order in "<>":
        content = binary_op4(order, 4, packing, "MAAX") + binary_op4(order, 4, packing)
        for _ in range(damages):
            file.write_bytes(damaged(content, chance))
            tracemalloc.start()
            try:
                read_op4(file, BOTH)
            except MatrixFileError as error:
                assert str(file) in str(error)
            finally:
                peak = tracemalloc.get_traced_memory()[1]
                tracemalloc.stop()
            assert peak < MEMORY


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("length", [2, 3, 20, 33, 60, 100, -1, -9])
def test_a_truncated_binary_file_is_refused(tmp_path: Path, order: str, length: int) -> None:
    file = tmp_path / "body.op4"
    file.write_bytes(binary_op4(order, 4, "dense")[:length])
    with pytest.raises(MatrixFileError, match=r"truncated|binary data|not a whole number|no matrix"):
        read_op4(file, BOTH)


def test_a_huge_binary_matrix_is_refused_before_it_is_allocated(tmp_path: Path) -> None:
    content = bytearray(binary_op4("<", 4, "dense"))
    content[4:12] = struct.pack("<2i", 2_000_000_000, 2_000_000_000)
    file = tmp_path / "body.op4"
    file.write_bytes(bytes(content))
    with pytest.raises(MatrixFileError, match="2000000000 coordinates; 1 to 3000 are read"):
        read_op4(file, BOTH)
    record = struct.pack("<i", 2_000_000_000)
    file.write_bytes(binary_op4("<", 4, "dense")[:32] + record)
    with pytest.raises(MatrixFileError, match="a record of 2000000000 bytes at byte 36, but the file ends at 36"):
        read_op4(file, BOTH)


def test_an_npz_file_that_unpacks_to_more_than_it_states_or_runs_code_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "body.npz"
    good = file_contents(sorted_frame(), "body", "npz")["body.npz"]

    def repacked(name: str, content: bytes) -> None:
        with zipfile.ZipFile(io.BytesIO(good)) as old, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as new:
            for member in old.namelist():
                new.writestr(member, content if member == f"{name}.npy" else old.read(member))

    def array(values: np.ndarray) -> bytes:
        buffer = io.BytesIO()
        np.save(buffer, values, allow_pickle=True)
        return buffer.getvalue()

    head = array(np.zeros((2, 2))).replace(b"(2, 2)", b"(2900, 2900)")[:128]
    for content, message in (
        (array(np.zeros((4, 4)))[:100], "not a readable NPZ file"),
        (head + b"\0" * 32, "array stiffness .2900, 2900. needs 67280000 bytes"),
        (array(np.array([{"a": 1}], dtype=object)), "type object"),
        (array(np.zeros((3001, 1))), "3001 coordinates; 1 to 3000"),
        (array(np.zeros((26, 26, 1))), "shape .26, 26, 1."),
        (array(np.full((26, 26), np.nan)), "row 1, column 1 is not finite"),
        (array(np.zeros((26, 25))), "shape .26, 25.; expected a square"),
    ):
        repacked("stiffness", content)
        with pytest.raises(MatrixFileError, match=message):
            read_matrices(MatrixFiles(file))


def test_a_pipe_is_refused_without_waiting_for_it(tmp_path: Path) -> None:
    import os

    pipe = tmp_path / "body.pch"
    os.mkfifo(pipe)
    with pytest.raises(MatrixFileError, match="is not a regular file"):
        read_matrices(MatrixFiles(pipe))


def test_a_line_without_end_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "body.pch"
    file.write_bytes(b"GRID" + b" " * 1_100_000)
    with pytest.raises(MatrixFileError, match="line 1 has more than 1000000 bytes"):
        read_matrices(MatrixFiles(file))


def surfaces(body: InterfaceMatrices) -> dict[str, bytes]:
    """Files of a surface in both forms."""
    points = np.vstack([body.positions + 0.1 * direction for direction in np.eye(3)])
    normals = np.repeat(np.eye(3), len(body.nodes), axis=0)
    displacement = np.zeros((len(points), 3, body.size))
    for n, (node, at) in enumerate((node, at) for at in range(3) for node in range(len(body.nodes))):
        displacement[n, :, 6 * node : 6 * node + 3] = np.eye(3)
        x, y, z = 0.1 * np.eye(3)[at]
        displacement[n, :, 6 * node + 3 : 6 * node + 6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    arrays = {"nodes": np.array(body.nodes), "modal": np.array(body.modal)}
    of_points = {
        "points": points, "normals": normals, "areas": np.full(len(points), 0.01),
        "displacement": displacement.reshape(-1, body.size),
    }  # fmt: skip
    rows = np.einsum("pa,pan->pn", normals, displacement)
    of_integral = {"normal_motion": 0.01 * rows.T @ rows, "area": np.array([0.01 * len(points)])}
    found = {}
    for name, more in (("points", of_points), ("integral", of_integral)):
        buffer = io.BytesIO()
        np.savez(buffer, **arrays, **more)
        found[name] = buffer.getvalue()
    return found


@pytest.mark.parametrize("damages", DAMAGES)
@pytest.mark.parametrize("form", ["points", "integral"])
def test_a_damaged_surface_is_read_or_is_one_error(tmp_path: Path, form: str, damages: int) -> None:
    chance = random.Random(form)
    body = sorted_frame()
    content = surfaces(body)[form]
    (tmp_path / "body.npz").write_bytes(npz_content(body))
    files = MatrixFiles(file=tmp_path / "body.npz", recovery=tmp_path / "surface.npz")
    (tmp_path / "surface.npz").write_bytes(content)
    assert read_in_little_memory(files)
    refused = 0
    for _ in range(damages):
        (tmp_path / "surface.npz").write_bytes(damaged(content, chance))
        refused += not read_in_little_memory(files)
    assert refused > damages // 4


@pytest.mark.parametrize("shape", [(600_000, 26), (60_000_000, 26), (3, 10**15), (600_000, 2**62)])
def test_a_surface_that_states_more_than_it_has_allocates_nothing(tmp_path: Path, shape: tuple[int, int]) -> None:
    body = sorted_frame()
    (tmp_path / "body.npz").write_bytes(npz_content(body))
    with zipfile.ZipFile(tmp_path / "surface.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, value in (("nodes", np.array(body.nodes)), ("modal", np.array(body.modal))):
            buffer = io.BytesIO()
            np.save(buffer, value)
            archive.writestr(f"{name}.npy", buffer.getvalue())
        buffer = io.BytesIO()
        np.lib.format.write_array_header_1_0(buffer, {"descr": "<f8", "fortran_order": False, "shape": shape})
        archive.writestr("displacement.npy", buffer.getvalue() + bytes(1000))
    assert not read_in_little_memory(MatrixFiles(file=tmp_path / "body.npz", recovery=tmp_path / "surface.npz"))


@pytest.mark.parametrize("damages", DAMAGES)
@pytest.mark.parametrize("suffix", [".csv", ".pch", ".op4", ".mtx"])
def test_a_damaged_gyroscopic_matrix_is_read_or_is_one_error(tmp_path: Path, suffix: str, damages: int) -> None:
    chance = random.Random(suffix)
    body = sorted_frame()
    form = {".csv": "csv", ".pch": "dmig", ".op4": "op4", ".mtx": "mtx"}[suffix]
    written = file_contents(body, "body", form)
    content = next(text for name, text in written.items() if name.endswith(suffix) and "stiffness" not in name)
    content = content.replace(b"MAAX", b"GAAX")
    (tmp_path / "body.npz").write_bytes(npz_content(body))
    file = tmp_path / f"gyroscopic{suffix}"
    order = {"nodes": tmp_path / "body-nodes.pch"} if suffix == ".op4" else {}
    if order:
        order["nodes"].write_bytes(written["body-nodes.pch"])
    files = MatrixFiles(file=tmp_path / "body.npz", gyroscopic=file, **order)
    file.write_bytes(content)
    assert read_in_little_memory(files)
    refused = 0
    for _ in range(damages):
        file.write_bytes(damaged(content, chance))
        refused += not read_in_little_memory(files)
    assert refused > damages // 8
