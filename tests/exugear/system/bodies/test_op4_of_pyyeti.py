"""Files op4 both ways between this package and pyyeti, an independent reader and writer, where it is installed."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse

from exugear.system.bodies.matrix_files.files import MatrixFiles, file_contents, read_matrices
from exugear.system.bodies.matrix_files.op4 import read_op4

from ....optional_libraries import works
from ...cases.beams import sorted_frame

pytestmark = pytest.mark.skipif(not works("pyyeti"), reason="pyyeti is missing: pip install pyyeti")
SYMMETRIC = 6


@pytest.fixture(scope="module")
def op4() -> Any:
    return importlib.import_module("pyyeti.nastran.op4")


@pytest.mark.parametrize("sparse", ["dense", "bigmat", "nonbigmat"])
@pytest.mark.parametrize(("binary", "endian"), [(True, "<"), (True, ">"), (False, "=")])
def test_what_pyyeti_writes_is_read_to_the_last_digit(
    tmp_path: Path, op4: Any, binary: bool, endian: str, sparse: str
) -> None:
    """ASCII files have the 17 digits that are asked for here."""
    body = sorted_frame()
    holed = np.where(np.abs(body.stiffness) > 1e7, body.stiffness, 0.0)  # strings of non-zero entries
    given = {"KAAX": holed, "MAAX": body.mass}
    if sparse != "dense":
        given = {name: scipy.sparse.coo_matrix(matrix) for name, matrix in given.items()}
    file = tmp_path / "body.op4"
    op4.write(
        str(file), list(given), list(given.values()), binary=binary, digits=17, endian=endian, sparse=sparse,
        forms=[SYMMETRIC] * 2,
    )  # fmt: skip
    found, names = read_op4(file, frozenset(given))
    assert set(names) == set(given)
    assert np.array_equal(found["KAAX"].values, holed)
    assert np.array_equal(found["MAAX"].values, body.mass)


def test_what_is_written_here_pyyeti_reads_to_the_last_digit(tmp_path: Path, op4: Any) -> None:
    body = sorted_frame()
    for name, content in file_contents(body, "body", "op4").items():
        (tmp_path / name).write_bytes(content)
    read = op4.load(str(tmp_path / "body.op4"), into="dct", justmatrix=True)
    read = {name.upper(): matrix for name, matrix in read.items()}
    own = read_matrices(MatrixFiles(file=tmp_path / "body.op4", nodes=tmp_path / "body-nodes.pch"))
    for name, wanted in (("KAAX", own.stiffness), ("MAAX", own.mass)):
        assert np.array_equal(np.asarray(read[name]), wanted)
    assert np.array_equal(own.stiffness, body.stiffness)
