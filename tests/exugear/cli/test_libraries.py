"""Libraries that the command line leaves out."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from exugear.cli.process import leave_out_dask, let_in_dask

LEFT_OUT = """
import sys
from exugear.cli.process import leave_out_dask, let_in_dask
leave_out_dask()
import numpy as np, xarray as xr
xr.Dataset({{"a": ("x", np.arange(3.0))}}).to_netcdf({path!r}, engine="h5netcdf")
assert float(xr.load_dataset({path!r}, engine="h5netcdf").a.sum()) == 3.0
assert not [name for name in sys.modules if name.startswith(("dask.", "distributed"))]
let_in_dask()
import distributed
"""


def test_data_sets_do_without_dask_and_its_clusters_are_found_when_asked_for(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    script = LEFT_OUT.format(path=str(tmp_path / "data.nc"))
    subprocess.run([sys.executable, "-c", script], check=True)


def test_dask_that_is_loaded_already_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded = object()
    monkeypatch.setitem(sys.modules, "dask", loaded)  # type: ignore[arg-type]
    leave_out_dask()
    let_in_dask()
    assert sys.modules["dask"] is loaded
