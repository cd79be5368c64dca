"""Load sharing among planets as an output of studies."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from exugear.studies.point_results import PointError
from exugear.studies.quantities import dynamic_load_sharing, load_sharing
from fe_ste.tools.arrays import Floats


def results_of(forces: list[float]) -> Any:
    """Results of a point with these forces of the meshes of three planets, static and at four instants of a run."""
    run: Floats = np.tile(forces, (4, 1))
    return SimpleNamespace(
        gearbox=SimpleNamespace(meshes=[SimpleNamespace(family="sun_planet")] * len(forces)),
        static=SimpleNamespace(mesh_force=np.array(forces)),
        run={"mesh_force": run},
    )


@pytest.mark.parametrize("output", [load_sharing, dynamic_load_sharing])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_most_loaded_planet_counts_on_either_flank(output, sign, monkeypatch):
    monkeypatch.setattr("exugear.studies.quantities._settled", lambda results, signal: results.run[signal])
    results = results_of([sign * force for force in (900.0, 1000.0, 1100.0)])
    assert output(results, meshes="sun_planet") == pytest.approx(1.1, rel=1e-12)


def test_planets_without_load_have_no_load_sharing():
    with pytest.raises(PointError, match="meshes 'sun_planet' carry no load that the planets could share"):
        load_sharing(results_of([3.4e-15, 4.8e-14, -6.9e-14]), meshes="sun_planet")
