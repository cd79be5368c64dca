"""Sound of housings from matrices with a surface."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.variant import Variant
from exugear.results.sound.radiated_power import radiated_power, radiating_names
from exugear.system.bodies.external_of_gearbox import check_external
from exugear.system.bodies.matrix_files.files import MatrixFormat
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices, MatrixFileError
from exugear.system.bodies.matrix_files.recovery import read_recovery
from exugear.system.system import Assembly

from .....optional_libraries import needs_meshio
from ....cases.assembled import assembled
from .shared import STIFFNESS, assert_sound_is_that_of, box_of, write

pytestmark = needs_meshio


@pytest.mark.parametrize("form", ["npz", "dmig", "csv"])
def test_a_box_with_its_surface_radiates_as_it_does_when_reduced_here(
    tmp_path: Path, housed: Assembly, box: InterfaceMatrices, form: MatrixFormat
) -> None:
    moved = box.moved(np.diag([-1.0, -1.0, 1.0]), (0.1, 0.0, 0.0)).from_si("mm-t-s")
    keys = write(tmp_path, moved, form)
    gearbox = box_of(tmp_path, {**keys, "units": "mm-t-s", "recovery": "box-surface.npz", "band_Hz": 6000.0,
                                "turn_deg": [0.0, 0.0, 180.0], "shift_mm": [100.0, 0.0, 0.0]})  # fmt: skip
    check_external(gearbox, "box")
    assert radiating_names(gearbox, Variant.flexible) == ("box",)
    found = assembled(gearbox, Choice("flexible"), STIFFNESS)
    assert_sound_is_that_of(found, housed)
    sound = radiated_power(found)
    assert sound is not None
    assert sound.limit == pytest.approx(4000.0)
    without = box_of(tmp_path, {**keys, "units": "mm-t-s", "turn_deg": [0.0, 0.0, 180.0], "shift_mm": [100.0, 0, 0]})
    assert radiating_names(without, Variant.flexible) == ()
    assert radiated_power(assembled(without, Choice("flexible"), STIFFNESS)) is None


def sphere(body: InterfaceMatrices, radius: float = 0.05) -> dict[str, np.ndarray]:
    """Arrays of a sphere around the first node, whose 400 points move with it and with a mode by its normal."""
    cosine = -1.0 + (2.0 * np.arange(400) + 1.0) / 400
    angle = np.pi * (1.0 + 5.0**0.5) * np.arange(400)
    sine = np.sqrt(1.0 - cosine**2)
    normals = np.column_stack([sine * np.cos(angle), sine * np.sin(angle), cosine])
    displacement = np.zeros((400, 3, body.size))
    displacement[:, :, :3] = np.eye(3)
    for n, (x, y, z) in enumerate(radius * normals):
        displacement[n, :, 3:6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    displacement[:, :, -1] = normals
    return {
        "nodes": np.array(body.nodes), "modal": np.array(body.modal), "normals": normals,
        "points": body.positions[0] + radius * normals, "areas": np.full(400, np.pi * radius**2 / 100.0),
        "displacement": displacement.reshape(1200, -1),
    }  # fmt: skip


def test_a_sphere_from_points_has_the_power_of_a_piston_and_of_breathing(
    tmp_path: Path, box: InterfaceMatrices
) -> None:
    """Mean square of the normal along an axis 1/3, of breathing 1, and none of turning."""
    arrays = sphere(box)
    np.savez(tmp_path / "sphere.npz", **arrays)
    found = read_recovery(tmp_path / "sphere.npz")
    assert found.area == pytest.approx(4.0 * np.pi * 0.05**2)
    motion = found.normal_motion.values / found.area
    assert motion[:3, :3] == pytest.approx(np.eye(3) / 3.0, abs=2e-3)
    assert np.trace(motion[:3, :3]) == pytest.approx(1.0, rel=1e-12)
    assert motion[-1, -1] == pytest.approx(1.0, rel=1e-12)
    assert np.abs(motion[3:6, 3:6]).max() < 1e-15
    gearbox = box_of(tmp_path, {**write(tmp_path, box), "recovery": "sphere.npz"})
    check_external(gearbox, "box")
    assert radiated_power(assembled(gearbox, Choice("flexible"), STIFFNESS)) is not None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"normals": lambda a: 2.0 * a}, r"point 1 has a normal of length 2 and the area .*; expected unit normals"),
        ({"areas": lambda a: -a}, "expected unit normals and positive areas"),
        ({"areas": lambda a: a[:-1]}, r"array points has the shape \(400, 3\); expected \(399, 3\) for 399 areas"),
        ({"displacement": lambda a: a[:, :-1]}, r"array displacement has the shape .* expected \(1200, 26\)"),
        (
            {"displacement": lambda a: 1e3 * a},
            r"not move with the nodes as a rigid body [(]translations by 1e[+]06",
        ),
        ({"displacement": lambda a: a[:, ::-1]}, "check order of coordinates, units"),
        ({"points": lambda a: 1e3 * a}, r"[(]translations by 1 of its area[)]; check order of coordinates"),
        ({"points": None}, "no array 'points'; write points, normals, areas, displacement, and nodes"),
        ({"nodes": None}, "no array 'nodes'"),
        ({"nodes": lambda a: a[[0, 0, 2]]}, "arrays nodes and modal have a number twice"),
        ({"displacement": lambda a: a * np.nan}, "array displacement has values that are not finite"),
    ],
)
def test_a_surface_that_does_not_fit_is_one_error(
    tmp_path: Path, box: InterfaceMatrices, change: Mapping[str, Any], message: str
) -> None:
    arrays = sphere(box)
    for name, function in change.items():
        value = arrays.pop(name)
        if function is not None:
            arrays[name] = function(value)
    np.savez(tmp_path / "sphere.npz", **arrays)
    gearbox = box_of(tmp_path, {**write(tmp_path, box), "recovery": "sphere.npz"})
    with pytest.raises(GearboxFileError, match=message) as refused:
        check_external(gearbox, "box")
    assert len(refused.value.errors) == 1


def dense_op4(values: np.ndarray, name: str = "MUG1") -> bytes:
    """A matrix as records of Fortran with all values of each column, as OUTPUT4 writes it."""
    rows, columns = values.shape

    def record(content: bytes) -> bytes:
        length = struct.pack("<i", len(content))
        return length + content + length

    found = record(struct.pack("<4i", columns, rows, 2, 2) + name.ljust(8).encode())
    for number, column in enumerate(values.T, start=1):
        found += record(struct.pack("<3i", number, 1, 2 * rows) + column.astype("<f8").tobytes())
    return found + record(struct.pack("<3i", columns + 1, 1, 2) + struct.pack("<d", 1.0))


@pytest.mark.parametrize("with_rotations", [False, True])
def test_a_recovery_matrix_of_an_op4_file_is_that_of_the_surface(
    tmp_path: Path, box: InterfaceMatrices, with_rotations: bool
) -> None:
    arrays = sphere(box)
    np.savez(tmp_path / "whole.npz", **arrays)
    displacement = arrays.pop("displacement")
    np.savez(tmp_path / "sphere.npz", **arrays)
    rows = displacement.reshape(400, 3, -1)
    rotations = np.random.default_rng(2).normal(size=rows.shape)
    rows = np.concatenate([rows, rotations], axis=1) if with_rotations else rows
    content = dense_op4(rows.reshape(-1, displacement.shape[1]))
    (tmp_path / "body.op4").write_bytes(dense_op4(np.eye(3), "KAAX") + content)
    found = read_recovery(tmp_path / "sphere.npz", tmp_path / "body.op4")
    wanted = read_recovery(tmp_path / "whole.npz")
    assert np.array_equal(found.normal_motion.values, wanted.normal_motion.values)
    keys = {"recovery": "sphere.npz", "recovery_matrix": "body.op4"}
    gearbox = box_of(tmp_path, {**write(tmp_path, box), **keys})
    check_external(gearbox, "box")
    assert radiated_power(assembled(gearbox, Choice("flexible"), STIFFNESS)) is not None


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (dense_op4(np.ones((1201, 26))), r"MUG1 has 1201 rows; expected three or six for each of the 400 points"),
        (dense_op4(np.ones((1200, 25))), r"array displacement has the shape \(1200, 25\); expected \(1200, 26\)"),
        (dense_op4(np.eye(3), "KAAX"), "no matrix MUG1; matrices are KAAX"),
        (dense_op4(np.ones((1200, 26)))[:-5000], "truncated"),
        (
            dense_op4(np.ones((12, 2))).replace(struct.pack("<2i", 2, 12), struct.pack("<2i", 2, 1_000_000), 1),
            "MUG1 has 1000000 x 2 entries, but 24 in the file",
        ),
    ],
)
def test_a_recovery_matrix_that_does_not_fit_is_one_error(
    tmp_path: Path, box: InterfaceMatrices, content: bytes, message: str
) -> None:
    arrays = sphere(box)
    del arrays["displacement"]
    np.savez(tmp_path / "sphere.npz", **arrays)
    (tmp_path / "body.op4").write_bytes(content)
    with pytest.raises(MatrixFileError, match=message):
        read_recovery(tmp_path / "sphere.npz", tmp_path / "body.op4")
    np.savez(tmp_path / "whole.npz", **sphere(box))
    with pytest.raises(MatrixFileError, match=r"has the array displacement; remove it, or the key recovery_matrix"):
        read_recovery(tmp_path / "whole.npz", tmp_path / "body.op4")
    with pytest.raises(MatrixFileError, match=r"whole.npz: unknown format of a recovery matrix; .* end in .op4"):
        read_recovery(tmp_path / "sphere.npz", tmp_path / "whole.npz")
    with pytest.raises(GearboxFileError, match="recovery_matrix requires points, normals and areas of the surface"):
        box_of(tmp_path, {**write(tmp_path, box), "recovery_matrix": "body.op4"})
